//! Compares spacecraft with Basilisk, connected in its usual way, in the same run: J2 orbit with attitude, rotating gravity fields of degree 20 and
//! 70, three reaction wheels with control, a hub with a chain of sixteen hinged plates; all with Runge–Kutta 4, without logs. Also a campaign of the
//! wheels, a thousand spacecraft in one simulation, and an entry: the error of samples of 1 s compared with the converged path. Peers:
//! `tests/benches/peers/install.sh --basilisk`. One command runs all benches: tests/benches/run.
#![allow(missing_docs, clippy::disallowed_methods, clippy::unwrap_used)]
#[path = "../common/mod.rs"]
mod common;

use linkwork_campaign::{Campaign, Folder, Orders, execute};
use linkwork_runner::Library;
use linkwork_runtime::{Seconds, Simulation};
use std::hint::black_box;
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

const CRAFT: &str =
    "\"craft\": (parent: \"world\", hinge: Free, mass: 750, inertia: [900, 800, 600],
    initial: (position: [7e6, 0, 0], velocity: [0, 6000, 4500], angular: [0.01, 0.02, -0.03]))";

fn orbit() -> String {
    format!(
        "Simulation(until: \"10 h\", step: \"10 s\", integrator: \"rk4\", bodies: {{ {CRAFT} }}, gravity: \"Field\",
        world: (body: \"earth\", mu: 3.986004415e14),
        parts: {{ \"Field\": (model: \"environment.zonal_gravity\", params: {{ \"radius\": 6378136.6, \"j2\": 1.08262668e-3 }}) }})"
    )
}

/// The file of the gravity field GGM03S in the reference data, which `LINKWORK_FIELD` passes to the peer.
fn field_file() -> Option<String> {
    let file = linkwork_tests::root().join("../shared/reference/gravity/basilisk_GGM03S.txt");
    Some(file.canonicalize().ok()?.to_str()?.to_string())
}

/// The spacecraft in a field of this degree and order that rotates with the Earth.
fn field(file: &str, degree: usize) -> String {
    format!(
        "Simulation(until: \"10 h\", step: \"10 s\", integrator: \"rk4\", bodies: {{ {CRAFT} }}, gravity: \"Field\",
        world: (body: \"earth\"),
        parts: {{ \"Field\": (model: \"environment.spherical_harmonics\",
            params: {{ \"file\": {file:?}, \"format\": \"basilisk\", \"degree\": {degree} }}) }})"
    )
}

fn wheels() -> String {
    // The wheels have 50 N m s at 6000 rpm and rotate at 100 rad/s; K = 3.5, P = 30 about each
    // axis.
    let (mut nodes, mut parts, mut wires) = (String::new(), String::new(), String::new());
    for (k, turn) in ["[0, \"90 deg\", 0]", "[\"-90 deg\", 0, 0]", "[0, 0, 0]"].iter().enumerate() {
        nodes += &format!("\"wheel{k}\": (rotation: (rpy: {turn})),");
        parts += &format!(
            "\"Wheel{k}\": (model: \"flight.reaction_wheel\", params: {{ \"inertia\": 0.0796, \"speed\": 100,
                \"torque_max\": 0.2 }}, bind: {{ \"wheel\": \"node:craft/wheel{k}\" }}),"
        );
        wires += &format!("\"Share.torques[{k}] -> Wheel{k}.torque\",");
    }
    let craft = CRAFT.replace("inertia: [900", &format!("nodes: {{ {nodes} }}, inertia: [900"));
    format!(
        "Simulation(until: \"1 h\", step: \"100 ms\", integrator: \"rk4\", bodies: {{ {craft} }}, parts: {{ {parts}
        \"Motion\": (model: \"sensors.motion\", bind: {{ \"mount\": \"node:craft\" }}),
        \"Target\": (model: \"basics.constant\", params: {{ \"value\": 1 }}),
        \"Bus\": (model: \"power.ideal_supply\", params: {{ \"voltage\": 28 }}),
        \"Pointing\": (model: \"control.pointing\", params: {{ \"inertia\": [900, 800, 600], \"frequency\": 0.06 }}),
        \"Share\": (model: \"control.wheel_distribution\", params: {{ \"axes\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }}),
        }}, wires: [ \"Motion.attitude -> Pointing.attitude\", \"Motion.rate -> Pointing.rate\",
        \"Target.y -> Pointing.target.w\", \"Pointing.torque -> Share.torque\", {wires} ],
        connect: [(\"Wheel0.supply\", \"Wheel1.supply\", \"Wheel2.supply\", \"Bus.terminal\")])"
    )
}

fn chain() -> String {
    let mut bodies = CRAFT.to_string();
    let mut parts = String::new();
    for k in 0..16 {
        // A plate is one metre long, with its hinge at one end and its centre of mass in the
        // middle.
        let (parent, at) = match k {
            0 => (
                "craft".to_string(),
                "at: (position: [0.5, 0, 1], rotation: (rpy: [0, 0, \"180 deg\"]))",
            ),
            k => (format!("plate{}", k - 1), "at: (position: [-1, 0, 0])"),
        };
        bodies += &format!(
            ", \"plate{k}\": (parent: \"{parent}\", {at}, hinge: Pin([0, 1, 0]), mass: 5, com: [-0.5, 0, 0],
                inertia: [5, 3, 2.5], initial: (angle: {}))",
            0.01
        );
        parts += &format!(
            "\"Spring{k}\": (model: \"actuators.spring_damper\",
                params: {{ \"stiffness\": 50, \"damping\": 0.1 }}, bind: {{ \"shaft\": \"hinge:plate{k}\" }}),"
        );
    }
    format!(
        "Simulation(until: \"1 h\", step: \"10 ms\", integrator: \"rk4\", bodies: {{ {bodies} }},
        parts: {{ {parts} }})"
    )
}

/// Four plates, each attached to a side of the hub by a hinge with a spring.
fn panels() -> String {
    let mut bodies = CRAFT.to_string();
    let mut parts = String::new();
    for (k, (position, yaw)) in
        [("0.5, 0", 180), ("0, 0.5", 270), ("-0.5, 0", 0), ("0, -0.5", 90)].iter().enumerate()
    {
        bodies += &format!(
            ", \"plate{k}\": (parent: \"craft\", at: (position: [{position}, 1], rotation: (rpy: [0, 0, \"{yaw} deg\"])),
                hinge: Pin([0, 1, 0]), mass: 5, com: [-0.5, 0, 0], inertia: [5, 3, 2.5], initial: (angle: {}))",
            0.01 * (k + 1) as f64
        );
        parts += &format!(
            "\"Spring{k}\": (model: \"actuators.spring_damper\",
                params: {{ \"stiffness\": 50, \"damping\": 0.1 }}, bind: {{ \"shaft\": \"hinge:plate{k}\" }}),"
        );
    }
    format!(
        "Simulation(until: \"1 h\", step: \"10 ms\", integrator: \"rk4\", bodies: {{ {bodies} }},
        parts: {{ {parts} }})"
    )
}

/// A capsule with tables of drag and lift over the Mach number, Apollo guidance at 2 Hz and the air of a rotating planet, from the entry interface
/// on.
fn guided_entry() -> String {
    "Simulation(until: \"200 s\", step: \"100 ms\", integrator: \"rk4\", gravity: \"Field\",
        bodies: { \"capsule\": (parent: \"world\", hinge: Free, mass: 3150, inertia: [5600, 4900, 4700],
            initial: (position: [3521190, 0, 0], velocity: [-1562, 5632, 0])) },
        world: (body: \"mars\", mu: 4.282837362e13, flattening: 0),
        parts: {
            \"Field\": (model: \"environment.zonal_gravity\", params: { \"j2\": 1.9566e-3 }),
            \"Air\": (model: \"environment.exponential_atmosphere\", params: { \"density\": 0.0158, \"scale_height\": 9354,
                \"temperature\": 210, \"gas_constant\": 191.8, \"heat_ratio\": 1.33, \"heating_constant\": 1.9027e-4 }),
            \"Aero\": (model: \"flight.entry_aerodynamics\", params: { \"area\": 15.9, \"nose_radius\": 1.1,
                \"drag\": [[0, 1.0], [2, 1.4], [30, 1.5]], \"lift_to_drag\": [[0, 0.1], [3, 0.23], [40, 0.25]] },
                bind: { \"body\": \"node:capsule\" }),
            \"Deceleration\": (model: \"basics.gain\", params: { \"k\": 3.2e-4 }),
            \"Guidance\": (model: \"flight.entry_guidance\", rate: \"2 Hz\", params: { \"target\": [0.975, 0.22, 0.01],
                \"ballistic\": 136, \"density\": 0.0158, \"scale_height\": 9354, \"lift_to_drag\": 0.24, \"lift_ref\": 0.45,
                \"start_height\": 80000, \"start_speed\": 5845, \"start_angle\": -0.26, \"end_speed\": 450 }, bind: { \"body\": \"node:capsule\" }),
        },
        wires: [\"Aero.drag -> Deceleration.u\", (wire: \"Deceleration.y -> Guidance.drag\", delay: 1), \"Guidance.bank -> Aero.bank\"])"
        .to_string()
}

/// A ballistic capsule in exponential air: the scene of tests/benches/peers/basilisk_entry.py.
fn entry(settings: &str) -> String {
    let (speed, angle) = (5845.0_f64, -15.5_f64.to_radians());
    format!(
        "Simulation(until: \"160 s\", {settings}, bodies: {{ \"capsule\": (parent: \"world\", hinge: Free, mass: 3150,
            inertia: [5600, 4900, 4700], initial: (position: [3521190, 0, 0], velocity: [{:?}, {:?}, 0])) }},
        world: (body: \"mars\", mu: 4.282837362e13, flattening: 0, turns: \"still\"),
        gravity: \"Field\", parts: {{ \"Field\": (model: \"environment.point_mass_gravity\"),
        \"Air\": (model: \"environment.exponential_atmosphere\", params: {{ \"density\": 0.0158, \"scale_height\": 9354,
            \"temperature\": 210, \"gas_constant\": 191.8, \"heat_ratio\": 1.33 }}),
        \"Drag\": (model: \"flight.drag\", params: {{ \"coefficient\": 1.45, \"area\": 15.9, \"heating_constant\": 0 }},
            bind: {{ \"body\": \"node:capsule\" }}) }})",
        speed * angle.sin(),
        speed * angle.cos()
    )
}

/// Returns positions (m) every ten seconds, and microseconds per sample.
fn flown(settings: &str) -> (Vec<[f64; 3]>, f64) {
    let mut sim = common::scene(&entry(settings), &[]).unwrap();
    let rows = sim.fork();
    let places = (1..=16).map(|k| {
        sim.run_until(Seconds::from_decimal(10.0 * f64::from(k)).unwrap()).unwrap();
        ["x", "y", "z"].map(|axis| sim.get(&format!("capsule.position.{axis}")).unwrap())
    });
    (places.collect(), measure(&rows, 140))
}

/// Compares samples of 1 s with the converged path, and with Basilisk's.
fn entries() {
    let (converged, _) = flown(
        "step: \"250 ms\", integrator: \"verner_87\", accuracy: (relative: 1e-13, absolute: 1e-10)",
    );
    let apart =
        |a: &[f64; 3], b: &[f64; 3]| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
    let worst =
        |of: &[[f64; 3]]| of.iter().zip(&converged).map(|(a, b)| apart(a, b)).fold(0.0, f64::max);
    for (name, settings) in [
        (
            "verner_87, 1e-10",
            "integrator: \"verner_87\", accuracy: (relative: 1e-10, absolute: 1e-8)",
        ),
        (
            "dormand_prince_54, 1e-10",
            "integrator: \"dormand_prince_54\", accuracy: (relative: 1e-10, absolute: 1e-8)",
        ),
        ("rk4, fixed", "integrator: \"rk4\""),
    ] {
        let (places, each) = flown(&format!("step: \"1 s\", {settings}"));
        println!(
            "entry, {name}: {:.2e} m from converged with rows of 1 s, {each:.2} µs a row",
            worst(&places)
        );
    }
    let theirs = peer("entry").unwrap_or_else(|| "not installed".into());
    println!("entry, Basilisk: {theirs} m with steps of 1 s; ours ends at {:?}", converged[15]);
}

/// Returns microseconds per step, the median of five runs.
fn measure(sim: &Simulation, steps: u32) -> f64 {
    median(|| {
        let mut run = sim.fork();
        (0..steps / 10).for_each(|_| run.step().unwrap());
        seconds(|| (0..steps).for_each(|_| run.step().unwrap())) / f64::from(steps) * 1e6
    })
}

fn peer(name: &str) -> Option<String> {
    let python = std::env::var("LINKWORK_BASILISK_PYTHON").ok()?;
    let script = if name == "entry" { "basilisk_entry.py" } else { "basilisk_space.py" };
    let script = linkwork_tests::root().join("tests/benches/peers").join(script);
    let mut command = Command::new(python);
    command.arg(script).arg(name).envs(field_file().map(|file| ("LINKWORK_FIELD", file)));
    let out = command.output().ok()?;
    let text = String::from_utf8_lossy(&out.stdout);
    text.lines().find_map(|l| Some(l.strip_prefix(name)?.split_whitespace().next()?.to_string()))
}

/// A campaign of the three wheels with control: its runs start with different masses and the same spacecraft motion.
struct Wheels {
    folder: tempfile::TempDir,
    library: Library,
    campaign: Campaign,
    runs: u64,
    made: u32,
}

impl Wheels {
    fn new(runs: u64, until: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let figures =
            "figures: { \"rate\": (of: \"craft.angular.x\", take: \"last\", unit: \"rad/s\") }";
        let simulation = wheels().replace(
            "until: \"1 h\"",
            &format!("until: \"{until}\", gravity: \"none\", {figures}"),
        );
        std::fs::write(folder.path().join("sim.ron"), simulation).unwrap();
        let path = folder.path().join("c.ron");
        let text = format!(
            "Campaign(simulation: \"sim.ron\", runs: {runs}, seed: 1, retain: (of: [\"craft.angular\"], every: \"10 s\"),
            vary: {{ \"craft.mass\": Normal(mean: 750, deviation: 5) }})"
        );
        std::fs::write(&path, text).unwrap();
        let library = Library { catalogue: common::catalogue(), embedded: Default::default() };
        let campaign = Campaign::read(&path, &library).unwrap_or_else(|f| panic!("{f}"));
        Wheels { folder, library, campaign, runs, made: 0 }
    }

    /// Returns the seconds for reading and compiling each run.
    fn loading(&self) -> f64 {
        seconds(|| {
            (0..self.runs).for_each(|run| drop(black_box(self.campaign.load(run, &self.library))))
        })
    }

    /// Returns the seconds for the runs as simulations, one after another: stepped to their ends, without a campaign.
    fn stepping(&self) -> f64 {
        let sims = (0..self.runs).map(|run| {
            let ready = self.campaign.load(run, &self.library).unwrap();
            (ready.loaded.simulation.until.unwrap(), Simulation::of(Arc::new(ready.program)))
        });
        let mut sims: Vec<_> = sims.collect();
        seconds(|| sims.iter_mut().for_each(|(until, sim)| sim.run_until(*until).unwrap()))
    }

    /// Returns the seconds for the whole campaign into a new folder, with or without tables and report.
    fn whole(&mut self, threads: usize, write: bool) -> f64 {
        self.made += 1;
        let own = self.folder.path().join(self.made.to_string());
        seconds(|| {
            let mut own = Folder::open(&own, &self.campaign).unwrap();
            let orders = Orders { library: &self.library, threads, stop: Default::default() };
            assert!(execute(&self.campaign, &orders, &mut own, |_| ()).unwrap());
            if write {
                own.write(&self.campaign, threads).1.unwrap();
            }
        })
    }
}

/// Cost of a campaign: sixteen short runs (6000 steps each) compared with Basilisk, and 64 runs of an hour (36 000 steps each), whose overhead and
/// two-thread speed-up are those of long campaigns.
fn campaign() {
    let mut short = Wheels::new(16, "600 s");
    let one = median(|| short.whole(1, false));
    let (two, tables) = (median(|| short.whole(2, false)), median(|| short.whole(2, true)));
    println!(
        "campaign: 16 retained runs of 6000 steps: {one:.3} s on one thread, {two:.3} s on two ({:.2} times as fast), \
         {tables:.3} s with tables and report (target 0.3); loading is {:.1} % of the runs; Basilisk on two processes {} s",
        one / two,
        100.0 * median(|| short.loading()) / one,
        peer("campaign").unwrap_or_else(|| "not installed".into())
    );
    // Both runs alternate, and the shortest of each counts, because other work on the machine only
    // adds time.
    let mut long = Wheels::new(64, "1 h");
    let rounds: Vec<[f64; 3]> =
        (0..7).map(|_| [long.stepping(), long.whole(1, true), long.whole(2, true)]).collect();
    let least = |k: usize| rounds.iter().map(|r| r[k]).fold(f64::INFINITY, f64::min);
    let [stepping, one, two] = [0, 1, 2].map(least);
    println!(
        "campaign: 64 retained runs of 36 000 steps, with tables and report: {one:.3} s on one thread, {:.2} times as fast on \
         two (target 1.9); loading, retaining, tables and report are {:.1} % of the stepping (target 2)",
        one / two,
        100.0 * (one / stepping - 1.0),
    );
}

fn seconds(f: impl FnOnce()) -> f64 {
    let begin = Instant::now();
    f();
    begin.elapsed().as_secs_f64()
}

/// Returns the median of five runs.
fn median(mut of: impl FnMut() -> f64) -> f64 {
    let mut all: Vec<f64> = (0..5).map(|_| of()).collect();
    all.sort_by(f64::total_cmp);
    all[2]
}

/// Spacecraft on a ring, each a separate body with attitude around the Earth with J2.
fn ring(count: usize) -> String {
    let one = |k: usize| {
        let (s, c) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
        format!(
            "\"craft{k}\": (parent: \"world\", hinge: Free, mass: 750, inertia: [900, 800, 600],
                initial: (position: [{:?}, {:?}, 0], velocity: [{:?}, {:?}, 10], angular: [0.01, 0.02, -0.03])),",
            7e6 * c,
            7e6 * s,
            -7546.0 * s,
            7546.0 * c
        )
    };
    orbit().replace(CRAFT, &(0..count).map(one).collect::<String>())
}

/// The same spacecraft as assemblies of a body and five models with connections among them and to the mechanism.
fn assemblies(count: usize) -> String {
    const PARTS: &str = "parts: {
        \"Motion\": (model: \"sensors.motion\", bind: { \"mount\": \"node:hub\" }),
        \"Target\": (model: \"basics.constant\", params: { \"value\": 1 }),
        \"Pointing\": (model: \"control.pointing\", params: { \"inertia\": [900, 800, 600], \"frequency\": 0.06 }),
        \"Wheel\": (model: \"flight.reaction_wheel\", params: { \"inertia\": 0.0796, \"speed\": 100, \"torque_max\": 0.2 },
            bind: { \"wheel\": \"node:hub/spin\" }),
        \"Jet\": (model: \"flight.thruster\", params: { \"thrust\": 10 }, bind: { \"nozzle\": \"node:hub/jet\" }),
        \"Feed\": (model: \"flight.ideal_feed\"),
        \"Bus\": (model: \"power.ideal_supply\", params: { \"voltage\": 28 }),
    }, wires: [\"Motion.attitude -> Pointing.attitude\", \"Motion.rate -> Pointing.rate\",
        \"Target.y -> Pointing.target.w\", \"Pointing.torque.z -> Wheel.torque\", \"Target.y -> Jet.command\"],
        connect: [(\"Jet.propellant\", \"Feed.outlet\"), (\"Wheel.supply\", \"Bus.terminal\")]";
    let one = |k: usize| {
        let (s, c) = (std::f64::consts::TAU * k as f64 / count as f64).sin_cos();
        format!(
            "\"Craft{k}\": (bodies: {{ \"hub\": (parent: \"world\", hinge: Free, mass: 750, inertia: [900, 800, 600],
                nodes: {{ \"spin\": (position: [0, 0, 0.1]), \"jet\": (position: [0, 0, -1]) }},
                initial: (position: [{:?}, {:?}, 0], velocity: [{:?}, {:?}, 10], angular: [0.01, 0.02, -0.03])) }},
                {PARTS}),",
            7e6 * c,
            7e6 * s,
            -7546.0 * s,
            7546.0 * c
        )
    };
    let craft: String = (0..count).map(one).collect();
    orbit().replace(CRAFT, "").replace("parts: {", &format!("parts: {{ {craft}"))
}

/// Time to read and create spacecraft that are assemblies with connections: four times as many must take four times as long.
fn wired() {
    let made = |count: usize| {
        let text = assemblies(count);
        median(|| seconds(|| drop(black_box(common::scene(&text, &[]).unwrap())))) * 1e6
            / count as f64
    };
    let (few, many) = (made(1000), made(4000));
    println!(
        "assemblies with five models and five wires: read, made and dropped in {few:.0} µs a craft of 1000, {many:.0} µs of 4000"
    );
}

/// Compares a thousand spacecraft in one simulation with a single one: time per spacecraft and step, and time to create it.
fn constellation() {
    const COUNT: usize = 1000;
    let alone = measure(&common::scene(&ring(1), &[]).unwrap(), 20_000);
    let text = ring(COUNT);
    let mut sim = None;
    let made = median(|| {
        sim = None;
        seconds(|| sim = Some(common::scene(&text, &[]).unwrap()))
    });
    let (sim, made) = (sim.unwrap(), made * 1e6 / COUNT as f64);
    let each = measure(&sim, 100) / COUNT as f64;
    let ratio = each / alone;
    println!(
        "constellation of {COUNT}: {each:.2} µs a craft and step, {ratio:.2} of one alone (target 1.3; Basilisk 1.3); read and \
         made in {made:.0} µs a craft (target 20; Basilisk 870)"
    );
}

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wanted = |name: &str| asked.is_empty() || asked.iter().any(|a| a == name);
    let file = field_file();
    let fields = file.as_deref().map_or(Vec::new(), |file| {
        vec![("field20", field(file, 20), 5000, 2.0), ("field70", field(file, 70), 2000, 8.0)]
    });
    if file.is_none() {
        println!("field20, field70: the reference data are not beside the project");
    }
    for (name, text, steps, target) in fields.into_iter().chain([
        ("orbit", orbit(), 20_000, 1.0),
        ("wheels", wheels(), 20_000, 2.5),
        ("chain", chain(), 5000, 8.0),
        ("panels", panels(), 5000, 4.0),
    ]) {
        if !wanted(name) {
            continue;
        }
        let sim = common::scene(&text, &[]).unwrap();
        let ours = measure(&sim, steps);
        let theirs = peer(name).unwrap_or_else(|| "not installed".into());
        println!("{name}: {ours:.2} µs a step (target {target}); Basilisk {theirs}");
    }
    if wanted("entry") {
        entries();
    }
    if wanted("guided") {
        let each = measure(&common::scene(&guided_entry(), &[]).unwrap(), 1500);
        println!(
            "guided entry, tables of drag and lift, RK4: {each:.2} µs a step (target 5; Basilisk without guidance, as others \
             published: 16)"
        );
    }
    if wanted("campaign") {
        campaign();
    }
    if wanted("constellation") {
        constellation();
    }
    if wanted("assemblies") {
        wired();
    }
}
