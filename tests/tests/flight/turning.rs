//! A rotating vehicle follows the same trajectory as a non-rotating one: the velocity of a free body is integrated in axes that do not rotate with
//! it.
use crate::common;
use common::{get, scene, seconds};
use linkwork_runtime::Simulation;
use linkwork_spatial::Vec3;

/// A spacecraft in an orbit about the oblate Earth that rotates at `spin` rad/s.
fn craft(spin: f64, integrator: &str, phases: &str) -> Simulation {
    let text = format!(
        r#"Simulation(until: "1 h", step: "10 s", {integrator}, {phases}
        bodies: {{
            "craft": (parent: "world", hinge: Free, mass: 750, inertia: [900, 800, 600],
                initial: (position: [7e6, 0, 0], velocity: [0, 6000, 4500], angular: [{spin}, 0, 0])),
        }},
        gravity: "Field", parts: {{ "Field": (model: "environment.zonal_gravity",
            params: {{ "radius": 6378136.6, "j2": 1.08262668e-3 }}) }},
        world: (body: "earth", mu: 3.986004415e14))"#
    );
    scene(&text, &[]).unwrap()
}

const RK4: &str = r#"integrator: "rk4""#;
const ADAPTIVE: &str =
    r#"integrator: "dormand_prince_54", accuracy: (relative: 1e-11, absolute: 1e-9)"#;

/// Returns its final position, and its velocity along its own axes.
fn flown(mut sim: Simulation) -> (Vec3, Vec3) {
    sim.run_until(seconds(3600.0)).unwrap();
    (get(&sim, "craft.position"), get(&sim, "craft.velocity"))
}

/// It rotates by 0.4 rad in each step. The stages of the method are the same, so the results differ only by round-off.
#[test]
fn a_craft_that_turns_keeps_its_orbit() {
    let between =
        r#"start: "a", phases: { "a": (to: { "b": "craft.position.x < 0 m" }), "b": () },"#;
    for (integrator, phases, limit) in
        [(RK4, "", 1e-6), (RK4, between, 1e-6), (ADAPTIVE, "", 1e-2), (ADAPTIVE, between, 1e-2)]
    {
        let [still, turning] = [0.0, 0.04].map(|spin| flown(craft(spin, integrator, phases)));
        let apart = (still.0 - turning.0).norm();
        assert!(apart < limit, "{apart} m apart, {integrator} {phases}");
        assert!((still.0 - Vec3::new(7e6, 0.0, 0.0)).norm() > 1e6, "it has flown");
        // Both have the same speed; the rotating one has its velocity in other axes.
        assert!((still.1.norm() - turning.1.norm()).abs() < 1e-6 * limit.max(1e-3) * 1e3);
        assert!((still.1 - turning.1).norm() > 100.0);
    }
}

/// A prescribed velocity stays constant in the body's axes.
#[test]
fn a_velocity_that_is_pinned_stays() {
    let mut sim = craft(0.01, RK4, "");
    for (axis, speed) in [("x", 3.0), ("y", 6000.0), ("z", 4500.0)] {
        sim.pin(&format!("craft.velocity.{axis}"), speed).unwrap();
    }
    sim.run_until(seconds(100.0)).unwrap();
    assert_eq!(get(&sim, "craft.velocity"), Vec3::new(3.0, 6000.0, 4500.0));
    // The craft moves on a circle: the prescribed component is along x, the other perpendicular to
    // it.
    let way = get(&sim, "craft.position") - Vec3::new(7e6, 0.0, 0.0);
    assert!((way.x - 300.0).abs() < 1e-6, "{way:?}");
    let (turn, w) = (1.0_f64, 0.01);
    let side = Vec3::new(
        0.0,
        (6000.0 * turn.sin() - 4500.0 * (1.0 - turn.cos())) / w,
        (6000.0 * (1.0 - turn.cos()) + 4500.0 * turn.sin()) / w,
    );
    let off = Vec3::new(0.0, way.y - side.y, way.z - side.z).norm();
    assert!(off < 0.5, "{off} m of {}", side.norm());
}
