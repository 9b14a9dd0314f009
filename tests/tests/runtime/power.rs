//! Power and heat as complete systems: energy balance, closed forms, thermostats, an empty battery, interruptions at any time.
use linkwork_runtime::Simulation;

use crate::common::{scene, seconds};

const SIGMA: f64 = 5.670_374_419e-8;

fn get(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or_else(|e| panic!("{e}"))
}

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(seconds(t)).unwrap_or_else(|e| panic!("{e}"));
}

/// A box with a generator and a heater in it, a battery next to it, and a skin in sun and wind.
const NETWORK: &str = r#"Simulation(
    parts: {
        "Box": (model: "power.thermal_node", params: { "capacity": "41 kJ/K", "temperature": "252 K" }),
        "Pack": (model: "power.thermal_node", params: { "capacity": "7 kJ/K", "temperature": "263 K" }),
        "Skin": (
            model: "power.thermal_node",
            params: { "capacity": "13 kJ/K", "temperature": "201 K", "area": "1.7 m^2", "emissivity": 0.7, "absorptivity": 0.3, "convection": 0.9 },
        ),
        "BoxToSkin": (model: "power.thermal_link", params: { "conductance": 0.6, "exchange_area": "0.2 m^2" }),
        "BoxToPack": (model: "power.thermal_link", params: { "conductance": 0.9 }),
        "Supply": (model: "power.ideal_supply", params: { "voltage": 28 }),
        "Heater": (model: "power.heater", params: { "power": 150, "on_below": "262 K", "band": 2 }),
        "Generator": (model: "power.rtg", params: { "thermal_power": 60, "half_life": "2 day" }),
        "Air": (model: "basics.sine", params: { "amplitude": 30, "frequency": "20 uHz", "offset": 215 }),
        "Sky": (model: "basics.constant", params: { "value": 2.7 }),
        "Sun": (model: "basics.sine", params: { "amplitude": 200, "frequency": "15 uHz", "offset": 210, "phase": -1 }),
        "In": (model: "basics.energy_meter"),
        "Out": (model: "basics.energy_meter"),
    },
    wires: [
        "Air.y -> Skin.air", "Sun.y -> Skin.light", "Sky.y -> Skin.sky",
        "Heater.power -> In.power", "Generator.case.heat -> In.power", "Skin.absorbed -> In.power",
        "Skin.radiated -> Out.power", "Skin.convected -> Out.power",
    ],
    connect: [
        ("Heater.supply", "Supply.terminal"), ("BoxToSkin.a", "BoxToPack.a", "Heater.node", "Generator.case", "Box.port"),
        ("BoxToSkin.b", "Skin.port"), ("BoxToPack.b", "Pack.port"),
    ],
    step: "2 min", until: "40 h",
)"#;

/// Heat in the three nodes relative to the start, J.
fn stored(sim: &Simulation) -> f64 {
    [("Box", 41e3, 252.0), ("Pack", 7e3, 263.0), ("Skin", 13e3, 201.0)]
        .iter()
        .map(|(name, capacity, start)| {
            capacity * (get(sim, &format!("{name}.temperature")) - start)
        })
        .sum()
}

#[test]
fn what_is_put_in_is_stored_radiated_or_given_to_the_air_by_every_integrator() {
    for (integrator, accuracy) in [
        ("rk4", ""),
        ("semi_implicit_euler", ""),
        ("bogacki_shampine_32", ""),
        ("dormand_prince_54", ""),
        ("verner_87", ""),
        ("rodas4p", ""),
        ("rodas4p", "accuracy: (relative: 1e-3, absolute: 1e-3),"),
    ] {
        let text =
            NETWORK.replace("step:", &format!("integrator: \"{integrator}\", {accuracy} step:"));
        let mut sim = scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"));
        let (mut worst, mut most) = (0.0_f64, 0.0_f64);
        for hour in 1..=40 {
            until(&mut sim, 3600.0 * f64::from(hour));
            let (given, gone) = (get(&sim, "In.energy"), get(&sim, "Out.energy"));
            let error = given - gone - stored(&sim);
            assert!(error.is_finite());
            (worst, most) = (worst.max(error.abs()), most.max(given.abs() + gone.abs()));
        }
        let switchings = get(&sim, "Heater.state.switchings");
        println!("{integrator}: {worst:.1e} J of {most:.1e} J, {switchings} switchings");
        // Measured: 2e-15 of the energy throughput; 2e-13 with the stiff method, whose derivatives are differences.
        assert!(worst < 1e-12 * most && switchings > 30.0, "{integrator}: {worst} of {most} J");
    }
}

#[test]
fn a_body_that_radiates_cools_as_its_closed_form() {
    let text = r#"Simulation(
        parts: {
            "Body": (model: "power.thermal_node", params: { "capacity": "9 kJ/K", "temperature": "420 K", "area": "0.8 m^2", "emissivity": 0.65 }),
            "Dark": (model: "basics.constant", params: { "value": 0 }),
        },
        wires: ["Dark.y -> Body.sky"],
        step: "1 min", integrator: "dormand_prince_54", until: "10 h",
    )"#;
    let mut sim = scene(text, &[]).unwrap_or_else(|e| panic!("{e}"));
    for t in [600.0, 3600.0, 12_000.0, 36_000.0] {
        until(&mut sim, t);
        let wanted =
            420.0 * (1.0 + 3.0 * 0.65 * 0.8 * SIGMA * 420f64.powi(3) * t / 9e3).powf(-1.0 / 3.0);
        let error = get(&sim, "Body.temperature") / wanted - 1.0;
        // Measured: 2e-10.
        assert!(error.abs() < 2e-9, "{t} s: {error:e}");
    }
}

/// A heat source behind a link, behind another, in air.
const CHAIN: &str = r#"Simulation(
    parts: {
        "Heat": (model: "basics.constant", params: { "value": 24 }),
        "Source": (model: "power.heat_source"),
        "Air": (model: "basics.constant", params: { "value": 230 }),
        "Inner": (model: "power.thermal_node", params: { "capacity": "4 kJ/K", "temperature": "230 K" }),
        "Outer": (model: "power.thermal_node", params: { "capacity": "3 kJ/K", "temperature": "230 K", "area": "0.5 m^2", "convection": 1.6 }),
        "Link": (model: "power.thermal_link", params: { "conductance": 0.7 }),
    },
    wires: ["Heat.y -> Source.power", "Air.y -> Outer.air"],
    connect: [("Link.a", "Source.node", "Inner.port"), ("Link.b", "Outer.port")],
    step: "1 min", integrator: "dormand_prince_54", until: "60 h",
)"#;

#[test]
fn a_chain_comes_to_rest_by_its_resistances_with_its_two_time_constants() {
    let mut sim = scene(CHAIN, &[]).unwrap_or_else(|e| panic!("{e}"));
    let air = 1.6 * 0.5;
    // The deviations from equilibrium satisfy Ṫ = A T; the modes follow from the quadratic formula.
    let a = [[-0.7 / 4e3, 0.7 / 4e3], [0.7 / 3e3, -(0.7 + air) / 3e3]];
    let (half, det): (f64, f64) =
        (0.5 * (a[0][0] + a[1][1]), a[0][0] * a[1][1] - a[0][1] * a[1][0]);
    let root: f64 = (half * half - det).sqrt();
    let (slow, fast) = (half + root, half - root);
    let rest = [230.0 + 24.0 / air + 24.0 / 0.7, 230.0 + 24.0 / air];
    // The initial deviations are split into the two modes (1, (λ − a₀₀)/a₀₁).
    let mode = |l: f64| (l - a[0][0]) / a[0][1];
    let (x, y) = (230.0 - rest[0], 230.0 - rest[1]);
    let s = (y - mode(fast) * x) / (mode(slow) - mode(fast));
    let f = x - s;
    for t in [900.0, 7200.0, 42_000.0, 216_000.0] {
        until(&mut sim, t);
        let (es, ef) = (s * (slow * t).exp(), f * (fast * t).exp());
        let wanted = [rest[0] + es + ef, rest[1] + mode(slow) * es + mode(fast) * ef];
        for (name, wanted) in ["Inner.temperature", "Outer.temperature"].iter().zip(wanted) {
            let error = get(&sim, name) - wanted;
            // Measured: 1e-7 K.
            assert!(error.abs() < 1e-6, "{t} s, {name}: {error:e} K");
        }
    }
    assert!((get(&sim, "Inner.temperature") - rest[0]).abs() < 1e-5);
}

#[test]
fn a_thermostat_cycles_with_the_period_of_its_time_constant() {
    let text = r#"Simulation(
        parts: {
            "Box": (model: "power.thermal_node", params: { "capacity": "6 kJ/K", "temperature": "262 K", "area": "0.5 m^2", "convection": 1.4 }),
            "Air": (model: "basics.constant", params: { "value": 215 }),
            "Supply": (model: "power.ideal_supply", params: { "voltage": 28 }),
            "Heater": (model: "power.heater", params: { "power": 55, "on_below": "255 K", "band": 4 }),
            "Energy": (model: "basics.energy_meter"),
        },
        wires: ["Air.y -> Box.air", "Heater.power -> Energy.power"],
        connect: [("Heater.supply", "Supply.terminal"), ("Heater.node", "Box.port")],
        step: "5 min", integrator: "dormand_prince_54", until: "30 h",
    )"#;
    let mut sim = scene(text, &[]).unwrap_or_else(|e| panic!("{e}"));
    let lag = 6e3 / (1.4 * 0.5);
    let hot = 215.0 + 55.0 / (1.4 * 0.5);
    let first = lag * ((262.0 - 215.0) / (255.0 - 215.0_f64)).ln();
    let on = lag * ((hot - 255.0) / (hot - 259.0_f64)).ln();
    let off = lag * ((259.0 - 215.0) / (255.0 - 215.0_f64)).ln();
    let mut switched = Vec::new();
    let mut was = get(&sim, "Heater.state.switchings");
    while sim.time() < 30.0 * 3600.0 {
        sim.step_event().unwrap();
        if get(&sim, "Heater.state.switchings") != was {
            was = get(&sim, "Heater.state.switchings");
            switched.push(sim.time());
        }
        let t = get(&sim, "Box.temperature");
        assert!(t > 255.0 - 1e-6 && t < 262.0 + 1e-9, "{t} K at {} s", sim.time());
    }
    assert!(switched.len() > 50, "{} switchings", switched.len());
    for (k, t) in switched.iter().enumerate() {
        let cycles = (k / 2) as f64;
        let wanted = first + cycles * (on + off) + if k % 2 == 1 { on } else { 0.0 };
        // Measured: 2e-6 s after thirty hours.
        assert!((t - wanted).abs() < 1e-3, "switching {k} at {t} s instead of {wanted} s");
    }
    let cycles = (switched.len() / 2) as f64;
    println!("{cycles} cycles of {on:.1} s on and {off:.1} s off");
    assert!((get(&sim, "Energy.energy") / (55.0 * on * cycles) - 1.0).abs() < 0.02);
}

/// A battery with a load, a heater in a cold box, and a source that starts after three hours.
const FLAT: &str = r#"Simulation(
    parts: {
        "Source": (model: "basics.step", params: { "time": "3 h", "before": 0, "after": 50 }),
        "Charger": (model: "power.source"),
        "Battery": (model: "power.battery", params: { "capacity_ah": 2, "charge": 0.9, "lag": "1 s" }),
        "One": (model: "basics.constant", params: { "value": 1 }),
        "Zero": (model: "basics.constant", params: { "value": 0 }),
        "On": (model: "basics.comparator"),
        "Load": (model: "power.load", params: { "power_on": 25 }),
        "Box": (model: "power.thermal_node", params: { "capacity": "5 kJ/K", "temperature": "250 K", "area": "0.5 m^2", "convection": 1 }),
        "Air": (model: "basics.constant", params: { "value": 200 }),
        "Heater": (model: "power.heater", params: { "power": 6, "on_below": "280 K", "band": 2 }),
        "Shed": (model: "basics.energy_meter"),
    },
    wires: [
        "One.y -> On.a", "Zero.y -> On.b", "On.y -> Load.on", "Source.y -> Charger.power",
        "Air.y -> Box.air", "Battery.shed -> Shed.power",
    ],
    connect: [("Load.supply", "Heater.supply", "Battery.terminal"), ("Charger.output", "Battery.charger"), ("Heater.node", "Load.case", "Box.port")],
    step: "10 s", until: "8 h",
)"#;

/// With the stiff method and adaptive steps.
fn stiff(text: &str, set: &[&str]) -> Simulation {
    let with = "integrator: \"rodas4p\", accuracy: (relative: 1e-6, absolute: 1e-6), step:";
    scene(&text.replace("step:", with), set).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_battery_that_runs_flat_cuts_its_loads_off_and_takes_them_on_again() {
    let mut sim = stiff(FLAT, &[]);
    // The load draws 31 W and the losses from 1.8 A h at 24 to 32 V.
    let mut flat = f64::NAN;
    while get(&sim, "Battery.empty") < 0.5 {
        sim.step_event().unwrap();
        flat = sim.time();
        assert!(flat < 3.0 * 3600.0);
    }
    println!("flat after {flat:.0} s");
    assert!((1.4 * 3600.0..1.8 * 3600.0).contains(&flat), "{flat}");
    assert!(get(&sim, "Battery.charge").abs() < 1e-9, "located at the event");
    until(&mut sim, 10_000.0);
    // The state of an empty battery is defined and in the log: zero voltage, one brown-out of the
    // load, a cold heater.
    assert_eq!(get(&sim, "Battery.terminal.voltage"), 0.0);
    assert_eq!((get(&sim, "Battery.state.flat"), get(&sim, "Load.state.count")), (1.0, 1.0));
    assert_eq!((get(&sim, "Load.browned_out"), get(&sim, "Load.supply.current")), (1.0, 0.0));
    assert_eq!(
        (get(&sim, "Load.running"), get(&sim, "Heater.on"), get(&sim, "Heater.power")),
        (0.0, 0.0, 0.0)
    );
    assert!(get(&sim, "Battery.charge").abs() < 1e-9);
    // With 50 W the battery is back at a twentieth of its charge, and everything works again; the supplied power
    // exceeds the load.
    let mut back = f64::NAN;
    while get(&sim, "Battery.empty") > 0.5 {
        sim.step_event().unwrap();
        back = sim.time();
        assert!(back < 4.0 * 3600.0);
    }
    let wanted = 10_800.0 + 0.05 * 2.0 * 3600.0 / 0.98 / (50.0 / 25.5);
    assert!((back / wanted - 1.0).abs() < 0.02, "{back} instead of {wanted} s");
    until(&mut sim, 14_000.0);
    assert_eq!((get(&sim, "Load.running"), get(&sim, "Heater.on")), (1.0, 1.0));
    assert!((get(&sim, "Load.power") - 25.0).abs() < 1e-9);
    assert!(get(&sim, "Box.temperature") < 280.0 && get(&sim, "Battery.terminal.voltage") > 24.0);
}

#[test]
fn a_full_battery_sheds_what_its_sources_give_beyond_its_loads() {
    let set = ["Battery.charge=0.97", "Source.time=0", "Load.power_on=5", "Heater.power=0"];
    let mut sim = stiff(FLAT, &set);
    let mut most = 0.0_f64;
    while sim.time() < 6.0 * 3600.0 {
        sim.step_event().unwrap();
        most = most.max(get(&sim, "Battery.charge"));
    }
    assert!(most - 1.0 < 1e-9 && most > 0.999_999, "{most}");
    // The battery sheds 50 W minus the 5 W of the loads.
    assert!(get(&sim, "Battery.full") > 0.5 && (get(&sim, "Battery.shed") - 45.0).abs() < 1e-6);
    assert!(get(&sim, "Shed.energy") > 45.0 * 5.0 * 3600.0);
    assert_eq!(get(&sim, "Battery.state.flat"), 0.0);
}

#[test]
fn cuts_anywhere_leave_no_trace_in_networks_and_flat_batteries() {
    for (text, end) in [(NETWORK, 60_000.0), (FLAT, 14_000.0)] {
        let mut straight = stiff(text, &[]);
        let program = straight.program().clone();
        until(&mut straight, end);
        let mut sim = Simulation::of(program.clone());
        let mut random = 7_u64;
        while sim.before(seconds(end)) {
            sim.step_event().unwrap();
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            if random >> 60 == 0 {
                let bytes = sim.checkpoint("").unwrap();
                sim = Simulation::of(program.clone());
                sim.restore(&bytes).unwrap();
            } else if random >> 60 == 1 {
                sim = sim.fork();
            }
        }
        assert_eq!(sim.hash(), straight.hash());
    }
}
