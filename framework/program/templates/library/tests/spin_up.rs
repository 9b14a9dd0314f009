//! Compares the simulation of this library with its closed form.
use std::path::Path;

#[test]
fn the_flywheel_spins_up_behind_the_lag() {
    let sim = Path::new(env!("CARGO_MANIFEST_DIR")).join("sims/spin_up");
    let library = @name@::library();
    let ready = library.file(&sim, &[], None).unwrap_or_else(|mistakes| panic!("{mistakes}"));
    let mut sim = ready.simulation();
    sim.run_until(1.0).unwrap();
    // The torque is T = u (1 − exp(−t/τ)), and the rate is ω = u/I (t − τ (1 − exp(−t/τ))).
    let (u, inertia, lag, t) = (0.5, 0.5 * 2.0 * 0.2f64.powi(2), 0.2, 1.0f64);
    let torque = u * (1.0 - (-t / lag).exp());
    let rate = u / inertia * (t - lag * (1.0 - (-t / lag).exp()));
    assert!((sim.get("Motor.torque").unwrap() - torque).abs() < 1e-9);
    assert!((sim.get("wheel.rate").unwrap() - rate).abs() < 1e-9);
}
