//! Every example runs, and what it prints is right. The answers are computed here by other formulas than in the examples where there
//! are such, and from published numbers.
#[path = "../examples/arm_inverse_kinematics.rs"]
mod arm_inverse_kinematics;
#[path = "../examples/motor_on_a_hinge.rs"]
mod motor_on_a_hinge;
#[path = "../examples/orbit.rs"]
mod orbit;
#[path = "../examples/own_model.rs"]
mod own_model;
#[path = "../examples/pendulum.rs"]
mod pendulum;
#[path = "../examples/wheel_on_ground.rs"]
mod wheel_on_ground;

#[track_caller]
fn close(found: f64, right: f64, relative: f64) {
    assert!((found / right - 1.0).abs() < relative, "{found} is not {right}");
}

#[test]
fn pendulum_has_its_period() {
    pendulum::main().unwrap();
    let period = pendulum::simulated().unwrap();
    close(period, pendulum::closed_form(), 1e-8);
    // Period with the series of the amplitude up to its sixth power: 2π √(0.66/(9.81 · 0.8)) (1 + θ²/16 + 11 θ⁴/3072 +
    // 173 θ⁶/737280).
    let small = std::f64::consts::TAU * (0.66f64 / (9.81 * 0.8)).sqrt();
    close(period, small * (1.0 + 0.25 + 11.0 * 16.0 / 3072.0 + 173.0 * 64.0 / 737_280.0), 1e-2);
}

#[test]
fn motor_on_a_hinge_has_its_speed_and_current() {
    motor_on_a_hinge::main().unwrap();
    let [rate, current] = motor_on_a_hinge::simulated().unwrap();
    // The balance of torques is J dω/dt = n k i, where dω/dt = (ω∞ − ω)/T with ω∞ = 6 rad/s and T = 0.8 s.
    let right = 6.0 * (1.0 - (-0.5f64 / 0.8).exp());
    close(rate, right, 1e-9);
    close(current, 0.4 * (6.0 - right) / 0.8, 1e-9);
    let [rate_0, current_0] = motor_on_a_hinge::closed_form();
    close(rate, rate_0, 1e-9);
    close(current, current_0, 1e-9);
}

#[test]
fn wheel_on_ground_rolls_with_the_speed_of_the_balance() {
    wheel_on_ground::main().unwrap();
    let [speed, slip] = wheel_on_ground::simulated().unwrap();
    // The speed is 0.5 · 20 · 0.25/(0.5 + 20 · 0.0625). The wheel sinks in by 0.5 mm of 250 mm.
    close(speed, 10.0 / 7.0, 5e-3);
    assert!(slip.abs() < 5e-3, "{slip}");
    close(wheel_on_ground::balance(), 10.0 / 7.0, 1e-12);
}

#[test]
fn orbit_has_the_period_of_kepler() {
    orbit::main().unwrap();
    let [period, distance] = orbit::simulated().unwrap();
    // The period is 2π √(8000³/398600.4418) s. The crossing is found by linear interpolation over 1
    // s.
    close(period, 7_121.08, 1e-5);
    close(period, orbit::kepler()[0], 1e-8);
    close(distance, 8.8e6, 1e-8);
}

#[test]
fn arm_reaches_with_the_angles_of_the_law_of_cosines() {
    arm_inverse_kinematics::main().unwrap();
    let (q, error) = arm_inverse_kinematics::found().unwrap();
    assert!(error < 1e-9, "{error}");
    let right = arm_inverse_kinematics::closed_form();
    for (q, right) in q.iter().zip(right) {
        close(*q, right, 1e-7);
    }
    // Check the closed form by forward kinematics.
    let x = 0.5 * right[0].cos() + 0.3 * (right[0] + right[1]).cos();
    close(x, 0.4, 1e-12);
}

#[test]
fn own_model_comes_back_after_one_period() {
    own_model::main().unwrap();
    // The period is not a multiple of the step of 1 ms, so the end is at most one step away from the turning point.
    close(own_model::simulated().unwrap(), 0.3, 5e-5);
}
