//! The rover has mirror and rotational symmetry: mirrored it drives the mirrored path, rotated the rotated one.
use linkwork_runtime::{Seconds, Simulation};

use crate::common;

/// An image of the world: rotated by an angle (rad), then optionally mirrored left and right.
#[derive(Clone, Copy)]
struct Image {
    turn: f64,
    mirrored: bool,
}

impl Image {
    fn point(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let y = if self.mirrored { -y } else { y };
        let (sin, cos) = self.turn.sin_cos();
        [x * cos - y * sin, x * sin + y * cos]
    }
    fn angle(self, a: f64) -> f64 {
        (if self.mirrored { -a } else { a }) + self.turn
    }
}

/// The rover drives a bend across a slope of 8 deg.
fn drive(image: Image, contact: &str) -> Simulation {
    let [a, b] = [[5.0, 1.5], [9.0, -1.0]].map(|p| common::list(&image.point(p)));
    let side = if image.mirrored { -0.35 } else { 0.35 };
    let text = format!(
        r#"Simulation(
    parts: {{ "Rover": (assembly: "rovers/rocker_bogie.ron", params: {{
        "world": "worlds/slope.ron", "waypoints": [{a}, {b}], "contact": "{contact}",
        "world_params": {{ "slope": "8 deg", "uphill": {:?} }},
    }}) }},
    overrides: {{ "Rover.Hardware.Mast/mast.at": (position: [0.75, {side}, 0.39]) }},
    step: "1 ms", integrator: "semi_implicit_euler", until: "100 s", seed: 1,
    place: (
        body: "Rover.Hardware.Chassis/chassis", at: [0, 0], heading: {:?},
        wheels: ["Rover.Hardware.Wheels.*/wheel"], radius: "0.25 m",
        joints: ["Rover.Hardware.Chassis/rocker_*", "Rover.Hardware.Chassis/bogie_*"],
    ),
)"#,
        image.angle(0.8f64.atan2(0.6)),
        image.angle(0.2),
    );
    common::scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn chassis(sim: &Simulation) -> [f64; 3] {
    ["x", "y", "z"]
        .map(|a| sim.get(&format!("Rover.Hardware.Chassis/chassis.position.{a}")).unwrap())
}

#[test]
fn mirrored_and_turned_it_drives_the_mirrored_and_turned_path() {
    for contact in ["mobility.wheel_rigid", "mobility.wheel_soil"] {
        let mut straight = drive(Image { turn: 0.0, mirrored: false }, contact);
        let images = [(0.0, true), (1.1, false), (2.9, false), (-0.7, true)]
            .map(|(turn, mirrored)| Image { turn, mirrored });
        let mut others = images.map(|image| drive(image, contact));
        let mut worst = common::Worst(0.0);
        let start = chassis(&straight);
        for second in 0..=20 {
            let time = Seconds { num: second, den: 1 };
            straight.run_until(time).unwrap();
            let [x, y, z] = chassis(&straight);
            for (image, other) in images.iter().zip(&mut others) {
                other.run_until(time).unwrap();
                let ([u, v], [p, q, r]) = (image.point([x, y]), chassis(other));
                worst.take((u - p).abs().max((v - q).abs()).max((z - r).abs()));
            }
        }
        let [x, y, _] = chassis(&straight);
        println!("{contact}: it went to ({x:.2}, {y:.2})");
        assert!((x - start[0]).hypot(y - start[1]) > 2.0, "{contact}: it went nowhere");
        worst.below(1e-9, contact);
    }
}
