//! Strapdown navigation with the increments of `sensors.imu_increments`: a freely tumbling body causes coning and sculling, and attitude and velocity
//! are recovered with the two-sample corrections.
use crate::common::{get, rotation, scene, seconds, velocity};
use linkwork_runtime::Simulation;
use linkwork_spatial::{Quat, Vec3};

/// A tumbling body with a unit 0.4 m off its centre of mass, and the unit's output, held at its own rate.
fn tumbling(rate: u32) -> Simulation {
    let names = ["angle.x", "angle.y", "angle.z", "velocity.x", "velocity.y", "velocity.z"];
    let holds: Vec<String> = (0..6)
        .map(|k| format!("\"Hold{k}\": (model: \"basics.hold\", rate: \"{rate} Hz\")"))
        .collect();
    let wires: Vec<String> = (0..6).map(|k| format!("\"Imu.{} -> Hold{k}.u\"", names[k])).collect();
    let text = format!(
        r#"Simulation(
            bodies: {{ "craft": (parent: "world", hinge: Free, mass: 10, inertia: [1, 2.2, 2.6],
                initial: (angular: [0.9, 1.7, -0.6]), nodes: {{ "imu": (position: [0.3, -0.2, 0.2]) }}) }},
            gravity: "none",
            parts: {{
                "Pull": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, 0] }}),
                "Imu": (model: "sensors.imu_increments", rate: "{rate} Hz", params: {{ "grade": "ideal" }}, bind: {{ "mount": "node:craft/imu" }}),
                {}
            }},
            wires: [{}],
            step: "10 ms", integrator: "dormand_prince_54", accuracy: (relative: 1e-13, absolute: 1e-13), until: "20 s",
        )"#,
        holds.join(", "),
        wires.join(", ")
    );
    scene(&text, &[]).unwrap()
}

/// Attitude and velocity of the node, W.
fn truth(sim: &Simulation) -> (Quat, Vec3) {
    let R = rotation(sim, "craft");
    let (omega, v) = (R * get(sim, "craft.angular"), velocity(sim, "craft"));
    (R, v + omega.cross(&(R * Vec3::new(0.3, -0.2, 0.2))))
}

/// Returns the errors of attitude (rad) and velocity (m/s) after 20 s, without and with the corrections.
fn drift(rate: u32) -> [[f64; 2]; 2] {
    let mut sim = tumbling(rate);
    let (q0, v0) = truth(&sim);
    let mut plain = (q0, v0);
    let mut corrected = (q0, v0);
    let mut pair = Vec::new();
    for k in 0..=20 * rate {
        sim.run_until(seconds(f64::from(k) / f64::from(rate))).unwrap();
        let held =
            |from: usize| Vec3::from_fn(|i, _| sim.get(&format!("Hold{}.y", from + i)).unwrap());
        let (angle, push) = (held(0), held(3));
        if k == 0 {
            assert_eq!((angle, push), (Vec3::zeros(), Vec3::zeros()));
            continue;
        }
        plain.1 += plain.0 * push;
        plain.0 *= Quat::from_scaled_axis(angle);
        pair.push((angle, push));
        if let [(a, v), (b, w)] = pair[..] {
            let (turn, push) = (a + b, v + w);
            let push = push
                + turn.cross(&push) * 0.5
                + turn.cross(&turn.cross(&push)) * (1.0 / 6.0)
                + (a.cross(&w) + v.cross(&b)) * (2.0 / 3.0);
            let turn = turn + a.cross(&b) * (2.0 / 3.0);
            corrected.1 += corrected.0 * push;
            corrected.0 *= Quat::from_scaled_axis(turn);
            pair.clear();
        }
    }
    let (q, v) = truth(&sim);
    [plain, corrected].map(|(r, u)| [r.angle_to(&q), (u - v).norm()])
}

#[test]
fn increments_bring_back_attitude_and_velocity_of_a_body_that_tumbles() {
    let [slow, fast] = [50, 100].map(drift);
    println!("50 Hz: {slow:?}, 100 Hz: {fast:?}");
    let [plain, corrected] = slow;
    assert!(corrected[0] < 1e-3 * plain[0] && corrected[1] < 2e-3 * plain[1]);
    // Attitude is of second order and velocity of first order without corrections; with them, of fourth and third order.
    for (k, j, least, most) in
        [(0, 0, 3.5, 4.5), (0, 1, 1.8, 2.2), (1, 0, 12.0, 20.0), (1, 1, 7.0, 9.0)]
    {
        let ratio = slow[k][j] / fast[k][j];
        assert!((least..most).contains(&ratio), "{k} {j}: {ratio}");
    }
}
