//! Balances of energy, mass and charge: compared with closed forms, and checked for every supplied simulation.
use crate::common;
use linkwork_runner::{Balance, Balances, Metrics, Report, Shared};
use linkwork_runtime::{Seconds, Simulation};
use std::sync::Arc;

/// Returns the balances of a program after a time, and the samples.
fn run(
    program: linkwork_runtime::Program,
    until: Seconds,
    rows_max: u64,
) -> (Balances, Vec<String>) {
    let balance = Balance::new(&program);
    let mut sim = Simulation::of(Arc::new(program));
    let mut metrics = Metrics::default();
    metrics.balance = balance;
    metrics.observe(&mut sim);
    sim.observe_now();
    for _ in 0..rows_max {
        if !sim.before(until) {
            break;
        }
        sim.step().unwrap();
        sim.observe_now();
    }
    report_of(&sim)
}

/// Returns the balances of a simulation so far, and their warnings.
fn report_of(sim: &Simulation) -> (Balances, Vec<String>) {
    let balance = Metrics::of(sim).and_then(|metrics| metrics.balance.as_ref());
    let warnings = balance.map(Balance::warnings).unwrap_or_default();
    let told = warnings.iter().map(|w| w.message.clone()).collect();
    (balance.map(Balance::report).unwrap_or_default(), told)
}

fn of(text: &str) -> Balances {
    let (program, settings) = common::program_of(text).unwrap_or_else(|e| panic!("{e}"));
    let (balances, told) = run(program, settings.until.unwrap(), u64::MAX);
    assert!(told.is_empty(), "{told:#?}");
    balances
}

fn term(report: &Report, part: &str, name: &str) -> f64 {
    let part = report.parts.get(part).unwrap_or_else(|| panic!("{part}: {report:#?}"));
    *part.terms.get(name).unwrap_or_else(|| panic!("{name}: {part:#?}"))
}

#[track_caller]
fn near(y: f64, want: f64, within: f64) {
    assert!((y - want).abs() <= within, "{y} for {want}");
}

/// Integrators and sample rates: the amounts agree with the closed form for each.
const METHODS: [(&str, &str); 4] = [
    ("semi_implicit_euler", "1 ms"),
    ("rk4", "10 ms"),
    ("dormand_prince_54", "1 s"),
    ("dormand_prince_54", "100 s"),
];

#[test]
fn a_load_on_a_battery_takes_its_power_and_its_charge() {
    for (method, step) in METHODS {
        let all = of(&format!(
            r#"Simulation(
                parts: {{
                    "Battery": (model: "power.battery", params: {{ "capacity_ah": 10, "charge": 0.8 }}),
                    "Level": (model: "basics.step", params: {{ "time": 20, "before": 0, "after": 1 }}),
                    "One": (model: "basics.constant", params: {{ "value": 1 }}),
                    "Zero": (model: "basics.constant", params: {{ "value": 0 }}),
                    "On": (model: "basics.comparator"),
                    "Load": (model: "power.load", params: {{ "power_on": 60, "heat_share": 0.75 }}),
                    "Charger": (model: "power.source"),
                    "Fed": (model: "basics.constant", params: {{ "value": 10 }}),
                }},
                connect: [("Load.supply", "Battery.terminal"), ("Charger.output", "Battery.charger")],
                wires: ["One.y -> On.a", "Zero.y -> On.b", "On.y -> Load.on", "Level.y -> Load.level", "Fed.y -> Charger.power"],
                step: "{step}", integrator: "{method}", until: "100 s",
            )"#
        ));
        let energy = &all["energy"];
        // The load draws 60 W from 20 s on. It switches inside a fixed step.
        near(term(energy, "Load", "supply"), 4800.0, 0.7);
        near(term(energy, "Load", "case"), -3600.0, 0.5);
        near(term(energy, "Charger", "output"), -1000.0, 1e-6);
        let battery = &energy.parts["Battery"];
        assert!(battery.residual.unwrap().abs() < 1.0, "{method} {step}: {battery:#?}");
        // The charge decreases by the current of the loads minus the supplied current, except for charging losses.
        let charge = &all["charge"];
        let battery = &charge.parts["Battery"];
        assert!(battery.residual.unwrap().abs() < 0.1, "{method} {step}: {battery:#?}");
        near(term(charge, "Battery", "stored held"), 4800.0 / 31.0 - 1000.0 / 31.1, 3.0);
    }
}

#[test]
fn propellant_that_leaves_is_missing_in_the_tank() {
    for (method, step) in METHODS {
        let all = of(&format!(
            r#"Simulation(
                bodies: {{ "b": (parent: "world", hinge: Free, mass: 100, inertia: [10, 10, 10]) }},
                gravity: "none",
                parts: {{
                    "Tank": (model: "flight.propellant_tank", params: {{ "propellant": 50, "radius": 0.5 }}, bind: {{ "bottom": "node:b" }}),
                    "Open": (model: "basics.step", params: {{ "time": 3.5, "before": 0, "after": 0.25 }}),
                    "Leak": (model: "flight.drain"),
                }},
                connect: [("Leak.tank", "Tank.outlet")],
                wires: ["Open.y -> Leak.flow"],
                step: "{step}", integrator: "{method}", until: "100 s",
            )"#
        ));
        let mass = &all["mass"];
        near(term(mass, "Leak", "tank"), 0.25 * 96.5, 0.002);
        near(term(mass, "Tank", "stored mass"), 0.25 * 96.5, 0.002);
        near(mass.residual, 0.0, 0.002);
    }
}

/// The energy of a ball drive equals that given to the body; a belt under a box gives μ m g times its path, part of which is motion of the box, and
/// the rest is contact heat.
#[test]
fn a_driven_ball_and_a_belt_close() {
    let all = of(r#"Simulation(
            bodies: { "b": (parent: "world", hinge: Ball, mass: 1, inertia: [0.2, 0.3, 0.4], initial: (rotation: (rpy: [0.4, 1.2, -0.7]))) },
            gravity: "none",
            parts: {
                "Supply": (model: "power.ideal_supply", params: { "voltage": 24 }),
                "Push": (model: "basics.sine", params: { "amplitude": 2, "frequency": 1 }),
                "Drive": (model: "actuators.ball_drive", params: { "stiffness": 6, "damping": 0.3 }, bind: { "ball": "hinge:b" }),
            },
            connect: [("Drive.supply", "Supply.terminal")], wires: ["Push.y -> Drive.torque.y"],
            step: "1 ms", integrator: "rk4", until: "3 s",
        )"#);
    let energy = &all["energy"];
    let work = term(energy, "Mechanism", "work of parts");
    near(term(energy, "Drive", "supply"), work, 1e-6);
    near(term(energy, "Mechanism", "kinetic energy"), -work, 1e-4 * energy.carried);
    assert!(energy.carried > 1.0 && energy.parts["Drive"].residual.unwrap().abs() < 1e-6);
    let all = of(r#"Simulation(
            bodies: {
                "belt": (parent: "world", hinge: Locked, mass: 10, inertia: [1, 1, 1], shapes: [(shape: Box([40, 0.5, 0.1]), collide: (friction: 0.5), name: "top")]),
                "box": (parent: "world", hinge: Free, mass: 1, inertia: Box([0.1, 0.1, 0.1]), initial: (position: [0, 0, 0.1]), shapes: [(shape: Box([0.1, 0.1, 0.1]), collide: (friction: 0.5), name: "s")]),
            },
            contact: (compliant: (stiffness: 1e4, damping: 5, bristle_stiffness: 2e4, bristle_damping: 50)),
            parts: {
                "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }),
                "Speed": (model: "basics.ramp", params: { "time": 0, "start": 0, "slope": 8 }),
                "Belt": (model: "actuators.belt", params: { "direction": [1, 0, 0] }, bind: { "belt": "node:belt" }),
            },
            wires: ["Speed.y -> Belt.speed"], step: "0.5 ms", integrator: "rk4", until: "1 s",
        )"#);
    let (energy, push) = (&all["energy"], 0.5 * 9.81);
    near(term(energy, "Mechanism", "moving surfaces of bodies"), push * 4.0, 0.05);
    near(term(energy, "Mechanism", "kinetic energy"), -0.5 * push * push, 0.05);
    let heat = term(energy, "Mechanism", "non-uniform gravity and compliant contact");
    near(heat, -push * (4.0 - 0.5 * push), 0.05);
    near(energy.parts["Mechanism"].residual.unwrap(), 0.0, 2e-3);
}

/// The force of a sampled part jumps at the ends of fixed steps; the work of each step is force × path, exactly.
#[test]
fn a_sampled_force_closes() {
    let all = of(r#"Simulation(
        bodies: { "a": (parent: "world", hinge: Slider([1, 0, 0]), mass: 2, inertia: [1, 1, 1], initial: (rate: 0.3)) },
        gravity: "none",
        parts: {
            "Supply": (model: "power.ideal_supply", params: { "voltage": 24 }),
            "Drive": (model: "actuators.torque_drive", bind: { "shaft": "hinge:a" }),
            "Wave": (model: "basics.sine", params: { "amplitude": 5, "frequency": 0.3 }),
            "Hold": (model: "basics.hold", rate: "5 Hz"),
        },
        connect: [("Drive.supply", "Supply.terminal")], wires: ["Wave.y -> Hold.u", "Hold.y -> Drive.torque"],
        step: "100 ms", integrator: "rk4", until: "5 s",
    )"#);
    let mechanism = &all["energy"].parts["Mechanism"];
    assert!(mechanism.carried > 5.0 && mechanism.uncertainty < 1.0, "{mechanism:#?}");
    near(mechanism.residual.unwrap(), 0.0, 1e-9);
}

/// Pulses of a thruster that are shorter than a fixed step: work, and mass of the propellant.
#[test]
fn pulses_within_a_fixed_step_close() {
    for (method, step) in [("rk4", "100 ms"), ("rk4", "1 s"), ("semi_implicit_euler", "100 ms")] {
        let all = of(&format!(
            r#"Simulation(
                bodies: {{ "a": (parent: "world", hinge: Slider([0, 0, 1]), mass: 10, inertia: [1, 1, 1]) }},
                gravity: "none",
                parts: {{
                    "Feed": (model: "flight.ideal_feed"),
                    "Rows": (model: "flight.sequence", params: {{ "rows": [[0, 0], [1.3, 1], [1.303, 0], [2.1, 1], [2.5, 0]] }}),
                    "Thruster": (model: "flight.thruster", params: {{ "thrust": 22, "rise": "6 ms", "fall": "11 ms" }}, bind: {{ "nozzle": "node:a" }}),
                }},
                connect: [("Thruster.propellant", "Feed.outlet")], wires: ["Rows.y -> Thruster.command"],
                step: "{step}", integrator: "{method}", until: "4 s",
            )"#
        ));
        // The impulse of a pulse of width w is T (w + (fall − rise)(1 − e^(−w/rise))).
        let pulse = |w: f64| 22.0 * (w + 0.005 * -f64::exp_m1(-w / 0.006));
        let impulse = pulse(0.003) + pulse(0.4);
        let energy = 0.5 * impulse * impulse / 10.0;
        let mechanism = &all["energy"].parts["Mechanism"];
        near(term(&all["energy"], "Mechanism", "kinetic energy"), -energy, 1e-6);
        near(mechanism.residual.unwrap(), 0.0, 1e-6);
        near(-term(&all["mass"], "Feed", "outlet"), impulse / (220.0 * 9.80665), 1e-9);
    }
}

/// A spacecraft in orbit, or one that rotates freely, exchanges little compared with its energy: the accuracy of the integration is no open balance.
#[test]
fn accurate_motion_without_exchange_is_not_open() {
    let orbit = |method: &str| {
        format!(
            r#"bodies: {{ "a": (parent: "world", hinge: Free, mass: 1000, inertia: [1, 1, 1], initial: (elements: (semi_major_axis: "7000 km", inclination: "50 deg"))) }},
            world: (body: "earth"), parts: {{ "Gravity": (model: "environment.point_mass_gravity") }},
            step: "60 s", integrator: "{method}", until: "30000 s""#
        )
    };
    let tumbling = r#"bodies: { "a": (parent: "world", hinge: Free, mass: 1000, inertia: [100, 200, 250], initial: (angular: [1, 2, 3])) },
        gravity: "none", step: "1 s", integrator: "dormand_prince_54", until: "1000 s""#;
    for text in [orbit("dormand_prince_54"), orbit("verner_87"), tumbling.to_string()] {
        // `of` panics if there is a warning.
        let all = of(&format!("Simulation({text})"));
        assert!(all["energy"].parts["Mechanism"].stored > 1e3, "{all:#?}");
    }
}

#[test]
fn free_rotation_that_gains_energy_is_reported() {
    // The rotation of a body about its middle axis is unstable: the body flips again and again. An explicit method of the first order adds energy with each flip.
    let text = |method: &str, step: &str| {
        format!(
            r#"Simulation(
                bodies: {{ "nut": (parent: "world", hinge: Free, mass: 1, inertia: [1, 2, 2.8], initial: (angular: [1e-3, 6, 1e-3])) }},
                gravity: "none", step: "{step}", integrator: "{method}", until: "60 s",
            )"#
        )
    };
    let energy = |method: &str, step: &str| {
        let (program, settings) = common::program_of(&text(method, step)).unwrap();
        let (all, told) = run(program, settings.until.unwrap(), u64::MAX);
        // The kinetic energy is 36 J at the start.
        // A term is positive into the mechanism, so stored energy is negative.
        (-term(&all["energy"], "Mechanism", "kinetic energy") / 36.0, told)
    };
    let (gained, told) = energy("semi_implicit_euler", "10 ms");
    println!("semi_implicit_euler: {gained} {told:?}");
    assert!(gained > 0.5, "{gained}");
    assert!(told.len() == 1 && told[0].contains("`Mechanism` is not closed"), "{told:?}");
    for (method, step) in [("rk4", "10 ms"), ("dormand_prince_54", "1 s")] {
        let (gained, told) = energy(method, step);
        println!("{method}: {gained}");
        assert!(gained.abs() < 1e-4 && told.is_empty(), "{method}: {gained} {told:?}");
    }
}

#[test]
fn a_motor_turns_electricity_into_work_and_heat() {
    for (method, step) in
        [("semi_implicit_euler", "0.1 ms"), ("rk4", "1 ms"), ("verner_87", "10 ms")]
    {
        let all = of(&format!(
            r#"Simulation(
                bodies: {{ "wheel": (parent: "world", hinge: Pin([0, 0, 1]), damping: 0.02, mass: 2, inertia: [0.1, 0.1, 0.2]) }},
                gravity: "none",
                parts: {{
                    "Supply": (model: "power.ideal_supply", params: {{ "voltage": 24 }}),
                    "Volts": (model: "basics.constant", params: {{ "value": 20 }}),
                    "Motor": (
                        model: "actuators.dc_motor", bind: {{ "shaft": "hinge:wheel" }},
                        params: {{ "resistance": 2, "torque_constant": 0.05, "gear": 20, "efficiency": 0.8, "coulomb": 0.3, "inductance": 0.01 }},
                    ),
                }},
                connect: [("Motor.supply", "Supply.terminal")],
                wires: ["Volts.y -> Motor.volts"],
                step: "{step}", integrator: "{method}", until: "4 s",
            )"#
        ));
        let energy = &all["energy"];
        let taken = term(energy, "Motor", "supply");
        near(term(energy, "Supply", "terminal"), -taken, 1e-9);
        let motor = &energy.parts["Motor"];
        assert!(motor.residual.unwrap().abs() < 2e-3 * taken, "{method}: {motor:#?}");
        // The wheel has the energy ½ J ω², and its damping dissipates the rest.
        let wheel = &energy.parts["Mechanism"];
        let work = term(energy, "Mechanism", "work of parts");
        assert!(work > 10.0 && wheel.residual.unwrap().abs() < 2e-3 * work, "{method}: {wheel:#?}");
        near(term(energy, "Motor", "shaft"), -work, 1e-3 * work);
        assert!(term(energy, "Mechanism", "friction and stops of hinges") < -1.0);
    }
}

#[test]
fn a_pendulum_loses_what_its_hinge_takes() {
    for (method, step) in [("rk4", "1 ms"), ("dormand_prince_54", "100 ms")] {
        let all = of(&format!(
            r#"Simulation(
                bodies: {{ "arm": (parent: "world", hinge: Pin([0, 1, 0]), damping: 0.5, mass: 2, com: [0, 0, -1], inertia: [0.1, 0.1, 0.1], initial: (angle: 1.5)) }},
                parts: {{ "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}) }},
                step: "{step}", integrator: "{method}", until: "60 s",
            )"#
        ));
        let energy = &all["energy"];
        // The potential energy is m g (1 − cos 1.5) at the start, zero at the end.
        let height = 2.0 * 9.81 * (1.0 - f64::cos(1.5));
        near(term(energy, "Mechanism", "potential energy"), height, 1e-4);
        near(term(energy, "Mechanism", "friction and stops of hinges"), -height, 1e-3);
        // Measured: 5e-11 J with rk4.
        near(energy.residual, 0.0, 1e-3);
    }
}

/// A state that a user sets adds energy, which no term of the model contains: the balance is not checked, and there is no warning.
#[test]
fn a_state_that_is_set_from_outside_opens_no_balance() {
    let text = r#"Simulation(
        bodies: { "arm": (parent: "world", hinge: Pin([0, 1, 0]), mass: 2, com: [0, 0, -1], inertia: [0.1, 0.1, 0.1]) },
        parts: { "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }) },
        step: "1 ms", until: "1 s",
    )"#;
    let changes: [fn(&mut Simulation); 3] =
        [|_| {}, |sim| sim.set("arm.rate", 3.0).unwrap(), |sim| sim.pin("arm.angle", 0.4).unwrap()];
    for (k, change) in changes.iter().enumerate() {
        let (program, settings) = common::program_of(text).unwrap();
        let mut metrics = Metrics::default();
        metrics.balance = Balance::new(&program);
        let mut sim = Simulation::of(Arc::new(program));
        metrics.observe(&mut sim);
        sim.observe_now();
        change(&mut sim);
        while sim.before(settings.until.unwrap()) {
            sim.step().unwrap();
            sim.observe_now();
        }
        let (balances, warnings) = report_of(&sim);
        let energy = &balances["energy"];
        assert!(warnings.is_empty(), "{warnings:?}");
        let checked = energy.parts.values().any(|part| part.residual.is_some());
        assert_eq!(checked, k == 0, "{energy:#?}");
        assert_eq!(energy.not_counted.is_empty(), k == 0, "{:?}", energy.not_counted);
    }
}

/// A damped pendulum with a spring comes to rest where weight and spring balance: the energies of height and spring, and the loss, are known there.
#[test]
fn a_pendulum_names_the_energy_of_its_spring() {
    let (stiffness, rest, start) = (8.0, 0.4, 1.5);
    let weight = 2.0 * 9.81;
    // The angle at rest is the root of m g l sin q + k (q − rest), by bisection.
    let (mut low, mut high) = (0.0_f64, rest);
    for _ in 0..60 {
        let q = 0.5 * (low + high);
        let ends =
            if weight * q.sin() + stiffness * (q - rest) > 0.0 { &mut high } else { &mut low };
        *ends = q;
    }
    let potential = weight * (low.cos() - f64::cos(start));
    let elastic = |q: f64| 0.5 * stiffness * (q - rest) * (q - rest);
    let released = elastic(start) - elastic(low);
    let text = |hinge: &str, part: &str| {
        format!(
            r#"Simulation(
                bodies: {{ "arm": (parent: "world", hinge: Pin([0, 1, 0]), {hinge} mass: 2, com: [0, 0, -1], inertia: [0.1, 0.1, 0.1], initial: (angle: {start})) }},
                parts: {{ "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}), {part} }},
                step: "1 ms", integrator: "rk4", until: "120 s",
            )"#
        )
    };
    let hinge = format!("spring: (stiffness: {stiffness}, rest: {rest}), damping: 0.5,");
    let all = of(&text(&hinge, ""));
    let energy = &all["energy"];
    near(term(energy, "Mechanism", "potential energy"), potential, 1e-4);
    near(term(energy, "Mechanism", "springs of hinges"), released, 1e-4);
    near(term(energy, "Mechanism", "friction and stops of hinges"), -potential - released, 1e-3);
    near(energy.residual, 0.0, 1e-4);
    let part = format!(
        r#""Spring": (model: "actuators.spring_damper", bind: {{ "shaft": "hinge:arm" }}, params: {{ "stiffness": {stiffness}, "rest": {rest}, "damping": 0.5 }}),"#
    );
    let all = of(&text("", &part));
    let energy = &all["energy"];
    near(term(energy, "Spring", "stored energy"), released, 1e-4);
    near(term(energy, "Spring", "loss"), -potential - released, 1e-3);
    near(term(energy, "Mechanism", "work of parts"), -potential, 1e-3);
    near(energy.parts["Spring"].residual.unwrap(), 0.0, 1e-3);
}

#[test]
fn a_craft_in_the_field_of_a_planet_gains_what_gravity_does() {
    let all = of(r#"Simulation(
        bodies: { "craft": (parent: "world", hinge: Free, mass: 500, inertia: [100, 80, 60], initial: (position: [7e6, 0, 0], velocity: [0, 5000, 1000])) },
        world: (body: "earth"),
        parts: { "Gravity": (model: "environment.point_mass_gravity") },
        step: "1 s", integrator: "rk4", until: "600 s",
    )"#);
    let energy = &all["energy"];
    let gained = term(energy, "Mechanism", "non-uniform gravity and compliant contact");
    assert!(gained > 1e8, "{gained}");
    near(energy.residual, 0.0, 1e-5 * gained);
}

#[test]
fn what_is_not_counted_is_named() {
    let all = of(r#"Simulation(
        bodies: { "ball": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), initial: (position: [0, 0, 1])) },
        colliders: { "ball": (on: "ball", shape: Sphere(0.1)), "floor": (on: "world", shape: HalfSpace) },
        contact: (restitution: 0.5),
        parts: { "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }) },
        step: "1 ms", until: "3 s",
    )"#);
    let energy = &all["energy"];
    assert_eq!(energy.not_counted, ["contact by impulses"], "{energy:#?}");
    let lost = energy.totals["not counted"];
    assert!(lost < -7.0 && energy.parts["Mechanism"].residual.is_none(), "{energy:#?}");
}

#[test]
fn a_part_that_makes_energy_is_reported() {
    // A step of 20 ms on a motor with a time constant of 7 ms is stable, but inaccurate.
    let text = r#"Simulation(
        bodies: { "wheel": (parent: "world", hinge: Pin([0, 0, 1]), mass: 2, inertia: [0.1, 0.1, 0.01]) },
        gravity: "none",
        parts: {
            "Supply": (model: "power.ideal_supply", params: { "voltage": 24 }),
            "Volts": (model: "basics.sine", params: { "amplitude": 20, "frequency": 20 }),
            "Motor": (model: "actuators.dc_motor", bind: { "shaft": "hinge:wheel" }, params: { "resistance": 1, "torque_constant": 0.05, "gear": 20 }),
        },
        connect: [("Motor.supply", "Supply.terminal")],
        wires: ["Volts.y -> Motor.volts"],
        step: "15 ms", integrator: "rk4", until: "3 s",
    )"#;
    let (program, settings) = common::program_of(text).unwrap();
    let (balances, told) = run(program, settings.until.unwrap(), u64::MAX);
    assert!(told.iter().any(|w| w.contains("is not closed")), "{told:?} {balances:#?}");
}

/// The balances of the first samples of every supplied simulation: each closes to 2 % of its throughput.
#[test]
fn the_balances_of_every_simulation_close() {
    let (library, shared, mut open) =
        (linkwork_assemblies::library(), Shared::default(), Vec::new());
    for file in super::splits::simulations() {
        let name = file.display().to_string();
        let rovers = ["rover_traverse/sim.ron", "mars_edl/sim.ron"];
        let coarse = rovers.iter().any(|f| file.ends_with(f));
        let set = if coarse { vec!["Rover.Environment.spacing=0.5".to_string()] } else { vec![] };
        let ready = library.file_of_many(&file, &set, None, &shared).map_err(|f| f.render(false));
        let ready = ready.unwrap();
        let until = ready.loaded.simulation.until.unwrap_or(Seconds { num: 100, den: 1 });
        let rows = if name.contains("rover") { 400 } else { 1500 };
        let (balances, told) = run(ready.program, until, rows);
        for (quantity, report) in &balances {
            println!("{name}: {quantity} {:.4e} of {:.4e} left", report.residual, report.carried);
        }
        open.extend(told.into_iter().map(|w| format!("{name}: {w}")));
    }
    assert!(open.is_empty(), "\n{}", open.join("\n"));
}
