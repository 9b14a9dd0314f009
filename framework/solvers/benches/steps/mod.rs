//! Runs of scenes in Linkwork and MuJoCo, and their measurements.

use crate::mjcf;
use crate::scenes::Scene;
use linkwork_dynamics::spatial::Vec3;
use linkwork_dynamics::{Tree, Workspace, kinematics, kinetic_energy, potential_energy};
use linkwork_solvers::contact::Method;
use linkwork_solvers::{ConstraintMethod, ContactSettings, ContactStepper, StepReport};
use std::path::Path;
use std::sync::Arc;

/// Measurements of one run, for either side.
#[derive(Clone, Copy, Debug, Default)]
pub struct Figures {
    pub rate: f64,
    pub contacts: f64,
    pub penetration: f64,
    pub energy: [f64; 2],
    pub drift: f64,
    pub off: f64,
    /// Time of a step in the second half, and of the longest step, s.
    pub half: f64,
    pub worst: f64,
    /// Number of steps whose contact problem did not reach its tolerance.
    pub short: usize,
    /// Number of steps that Newton solved, and iterations of all steps.
    pub newton: usize,
    pub iterations: usize,
}

/// Combines the measurements of all variants of a scene: rates over their total time, means of contacts and energies, the worst of the others.
pub fn together(all: impl Iterator<Item = Figures>) -> Figures {
    let all: Vec<Figures> = all.collect();
    let n = all.len() as f64;
    let mean = |f: fn(&Figures) -> f64| all.iter().map(f).sum::<f64>() / n;
    let most = |f: fn(&Figures) -> f64| all.iter().map(f).fold(0.0, f64::max);
    let sum = |f: fn(&Figures) -> usize| all.iter().map(f).sum();
    Figures {
        rate: 1.0 / mean(|f| 1.0 / f.rate),
        contacts: mean(|f| f.contacts),
        penetration: most(|f| f.penetration),
        energy: [mean(|f| f.energy[0]), mean(|f| f.energy[1])],
        drift: most(|f| f.drift),
        off: most(|f| f.off),
        short: sum(|f| f.short),
        newton: sum(|f| f.newton),
        iterations: sum(|f| f.iterations),
        half: mean(|f| f.half),
        worst: most(|f| f.worst),
    }
}

/// A running scene.
struct Run<'s> {
    scene: &'s Scene,
    tree: Tree,
    ws: Workspace,
    stepper: ContactStepper,
    q: Vec<f64>,
    v: Vec<f64>,
    tau: Vec<f64>,
    vdot: Vec<f64>,
}

impl<'s> Run<'s> {
    fn new(scene: &'s Scene, settings: &ContactSettings) -> Self {
        let tree = Tree::new(&scene.mbs);
        let colliders = Arc::new(scene.colliders());
        let stepper =
            ContactStepper::new(&tree, colliders, settings.clone(), |_| ConstraintMethod::Embed);
        let mut ws = Workspace::new(&tree);
        ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
        let nv = tree.nv();
        Self {
            scene,
            ws,
            stepper,
            q: scene.q.clone(),
            v: scene.v.clone(),
            tau: vec![0.0; nv],
            vdot: vec![0.0; nv],
            tree,
        }
    }

    fn step(&mut self) -> StepReport {
        kinematics(&self.tree, &mut self.ws, &self.q, &self.v);
        for (i, tau) in self.tau.iter_mut().enumerate() {
            *tau = self.scene.applied[i] - self.scene.damping[i] * self.v[i];
        }
        let state = (&mut self.q[..], &mut self.v[..]);
        let h = self.scene.h;
        self.stepper
            .step(&self.tree, &mut self.ws, h, state, &[], None, &mut self.tau, &mut self.vdot)
            .unwrap_or_else(|e| panic!("{}: {e}", self.scene.name))
    }

    fn energy(&mut self) -> f64 {
        kinematics(&self.tree, &mut self.ws, &self.q, &self.v);
        kinetic_energy(&self.tree, &self.ws, &self.v) + potential_energy(&self.tree, &self.ws)
    }

    fn places(&mut self) -> Vec<Vec3> {
        self.scene.mbs.body_poses(&self.q).iter().map(|X| X.position).collect()
    }
}

#[allow(clippy::disallowed_methods)] // A benchmark reads the clock.
pub fn ours(scene: &Scene, settings: &ContactSettings, runs: usize) -> Figures {
    let (mut seconds, mut half, mut worst) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    for _ in 0..runs {
        let mut run = Run::new(scene, settings);
        let start = std::time::Instant::now();
        let (mut last, mut longest, mut middle) = (0.0, 0.0_f64, 0.0);
        for i in 0..scene.steps {
            run.step();
            let now = start.elapsed().as_secs_f64();
            longest = longest.max(now - last);
            middle = if i < scene.steps / 2 { now } else { middle };
            last = now;
        }
        seconds = seconds.min(last);
        half = half.min((last - middle) / (scene.steps - scene.steps / 2) as f64);
        worst = worst.min(longest);
    }
    let mut run = Run::new(scene, settings);
    let (mut f, middle) = (Figures::default(), scene.steps / 2);
    let mut places = run.places();
    f.energy[0] = run.energy();
    for i in 0..scene.steps {
        if i == scene.steps - scene.steps / 10 {
            places = run.places();
        }
        let report = run.step();
        f.short += usize::from(!report.converged);
        f.newton += usize::from(report.method == Method::Newton);
        f.iterations += report.iterations as usize;
        for c in run.tree.multibody().couplings() {
            let sum: f64 = c.terms.iter().map(|(q, _, factor)| factor * run.q[*q]).sum();
            f.off = f.off.max((sum - c.coupling.constant).abs());
        }
        if i >= middle {
            f.penetration = f.penetration.max(report.penetration);
            f.contacts += run.stepper.points().iter().filter(|p| p.gap <= 1e-3).count() as f64
                / middle as f64;
        }
    }
    f.energy[1] = run.energy();
    f.drift = run.places().iter().zip(&places).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    f.rate = scene.steps as f64 / seconds;
    (f.half, f.worst) = (half, worst);
    f
}

pub fn run_peer(program: &Path, scene: &Scene) -> Figures {
    let stem = std::env::temp_dir().join(format!("linkwork_steps_{}", std::process::id()));
    let (model, state) = (stem.with_extension("xml"), stem.with_extension("txt"));
    std::fs::write(&model, mjcf::model(scene)).expect("temporary file");
    std::fs::write(&state, mjcf::state(scene)).expect("temporary file");
    let out = std::process::Command::new(program)
        .args([&model, &state])
        .arg(scene.steps.to_string())
        .output()
        .expect("peer runs");
    std::fs::remove_file(&model).ok();
    std::fs::remove_file(&state).ok();
    assert!(out.status.success(), "peer failed: {}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).expect("text");
    let x: Vec<f64> = text.split_whitespace().map(|x| x.parse().expect("number")).collect();
    let [rate, contacts, penetration, e0, e1, drift, off] = x[..] else { panic!("{text}") };
    Figures { rate, contacts, penetration, energy: [e0, e1], drift, off, ..Figures::default() }
}
