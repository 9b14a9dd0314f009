//! A model on a test bench: separate signals, smoothly varying inputs, Euler steps of 1 ms.
use linkwork_runtime::prelude::*;
use linkwork_runtime::{
    Block, Description, EvalTime, Evaluation, Lane, PortKind, PortSpec, Prototype, Wiring, noise,
};

/// Ticks between the samples of a sampled model.
const PERIOD: u64 = 20;
const STEP: f64 = 1e-3;

/// A model, connected to separate signals.
pub struct Rig {
    block: Box<dyn Block>,
    description: Description,
    period: u64,
    tick: u64,
    x: Vec<f64>,
    d: Vec<f64>,
    sig: Vec<f64>,
    xdot: Vec<f64>,
    outputs: usize,
    /// Values of the guards at the last tick.
    guards: Vec<f64>,
    values: Vec<f64>,
    /// Number of evaluations of everything per tick; more than one must not change a pure model.
    pub repeats: usize,
}

/// The part of a checkpoint that belongs to the model.
pub struct Saved {
    tick: u64,
    lanes: [Vec<f64>; 4],
    store: Vec<u8>,
}

fn lanes(specs: &[PortSpec]) -> usize {
    specs.iter().map(|s| s.lanes).sum()
}

impl Rig {
    /// Creates the bench: sampled every 20 ms if the model has updates, otherwise continuous.
    pub fn new(prototype: &dyn Prototype) -> Rig {
        let description = prototype.description().clone();
        let (nu, nud) = (lanes(&description.inputs), lanes(&description.feedthrough_inputs));
        let ym = nu + nud;
        let yd = ym + lanes(&description.outputs);
        let end = yd + lanes(&description.feedthrough_outputs);
        let guards = lanes(&description.guards);
        let period = if description.functions.update { PERIOD } else { 0 };
        let wiring = Wiring {
            u: (0..nu as u32).collect(),
            ud: (nu as u32..ym as u32).collect(),
            ym,
            yd,
            period,
            period_s: STEP * period as f64,
            key: noise::key(9, "bench.part"),
            ..Wiring::default()
        };
        let (nx, nd) = (lanes(&description.continuous), lanes(&description.discrete));
        let mut rig = Rig {
            block: prototype.block(wiring),
            description,
            period,
            tick: 0,
            x: vec![0.0; nx],
            d: vec![0.0; nd],
            sig: vec![0.0; end],
            xdot: vec![0.0; nx],
            outputs: ym,
            guards: vec![0.0; guards],
            values: vec![0.0; guards],
            repeats: 1,
        };
        prototype.initial(&mut rig.x, &mut rig.d);
        rig
    }

    /// Makes one tick: inputs, outputs, update, step.
    pub fn step(&mut self) {
        let t = STEP * self.tick as f64;
        let evaluation = Evaluation::Tick;
        let now =
            EvalTime { t, dt: STEP, tick: self.tick, evaluation, span: None, number: self.tick };
        let mut at = 0;
        for spec in self.description.inputs.iter().chain(&self.description.feedthrough_inputs) {
            move_input(spec, at, t, &mut self.sig[at..at + spec.lanes]);
            at += spec.lanes;
        }
        let f = self.description.functions;
        let due = self.period == 0 || self.tick.is_multiple_of(self.period);
        let continuous = !self.x.is_empty();
        for _ in 0..self.repeats {
            if f.outputs && (due || continuous) {
                self.block.outputs(&now, &self.x, &self.d, &mut self.sig).unwrap();
            }
            if f.modes && (due || continuous) {
                self.block.mode(&now, &self.x, &mut self.d, &self.sig).unwrap();
            }
            if f.feedthrough && (due || continuous) {
                self.block.feedthrough(&now, &self.x, &self.d, &mut self.sig).unwrap();
            }
        }
        if f.update && due {
            self.block.update(&now, &self.x, &mut self.d, &self.sig).unwrap();
        }
        if f.derivatives {
            for _ in 0..self.repeats {
                let (x, d, sig) = (&self.x, &self.d, &self.sig);
                self.block.derivatives(&now, x, d, sig, &mut self.xdot).unwrap();
            }
            for (x, dx) in self.x.iter_mut().zip(&self.xdot) {
                *x += STEP * dx;
            }
        }
        if f.guards {
            self.events(&now);
        }
        self.tick += 1;
    }

    /// Fires guards that changed their sign since the last tick.
    fn events(&mut self, now: &EvalTime) {
        let (x, d, sig) = (&self.x, &self.d, &self.sig);
        for _ in 0..self.repeats {
            self.block.guards(now, x, d, sig, &mut self.values).unwrap();
        }
        for k in 0..self.values.len() {
            let value = self.values[k];
            if value * self.guards[k] < 0.0 {
                let mut ways = [0; 64];
                ways[k] = if value > 0.0 { 1 } else { -1 };
                let which = Fired::new(&ways);
                self.block.handle_event(now, which, &mut self.x, &mut self.d, &self.sig).unwrap();
            }
            self.guards[k] = value;
        }
    }

    /// Makes steps, and returns the hash of all bits after each.
    pub fn trace(&mut self, ticks: usize) -> Vec<u64> {
        (0..ticks)
            .map(|_| {
                self.step();
                self.hash()
            })
            .collect()
    }

    fn hash(&self) -> u64 {
        let all = self.x.iter().chain(&self.d).chain(&self.sig);
        let mut bytes: Vec<u8> = all.flat_map(|v| v.to_le_bytes()).collect();
        bytes.extend(self.block.save_store().unwrap());
        noise::hash(bytes)
    }

    /// Returns the first signal that is not finite.
    pub fn bad(&self) -> Option<String> {
        let named = |specs: Vec<&PortSpec>, values: &[f64]| {
            let names: Vec<String> = specs
                .iter()
                .flat_map(|s| s.lane_names().into_iter().map(|(l, _)| format!("{}{l}", s.name)))
                .collect();
            let k = values.iter().position(|v| !v.is_finite())?;
            Some(format!("{} = {}", names.get(k).cloned().unwrap_or_default(), values[k]))
        };
        let d = &self.description;
        named(d.continuous.iter().collect(), &self.x)
            .or_else(|| named(d.discrete.iter().collect(), &self.d))
            .or_else(|| named(d.all_outputs().collect(), &self.sig[self.outputs..]))
    }

    /// Saves everything that changes.
    pub fn save(&self) -> Saved {
        Saved {
            tick: self.tick,
            lanes: [self.x.clone(), self.d.clone(), self.sig.clone(), self.guards.clone()],
            store: self.block.save_store().unwrap(),
        }
    }

    /// Restores it.
    pub fn load(&mut self, s: &Saved) {
        self.tick = s.tick;
        [self.x, self.d, self.sig, self.guards] = s.lanes.clone();
        self.block.load_store(&s.store).unwrap();
    }
}

/// Units of quantities that are never negative.
const POSITIVE: [&str; 8] = ["K", "Pa", "kg", "kg/m^3", "J", "W", "F", "ohm"];

/// Sets an input at time t: smooth, different for every signal, and consistent (rates are derivatives).
fn move_input(spec: &PortSpec, at: usize, t: f64, out: &mut [f64]) {
    let wave = |k: usize| {
        let (w, phase) = (2.0 + 0.7 * ((at + k) % 7) as f64, 0.9 * (at + k) as f64 + 0.4);
        ((w * t + phase).sin(), w * (w * t + phase).cos())
    };
    match spec.kind {
        PortKind::Bool => out[0] = f64::from(u8::from(wave(0).0 > 0.0)),
        PortKind::Quaternion => {
            let axis = Vec3::new(wave(0).0, wave(1).0, wave(2).0) * 0.3;
            Quat::from_scaled_axis(axis).put(out);
        }
        PortKind::NodeState => {
            let scale = [0.3, 0.2, 0.03];
            let v: [(f64, f64); 6] = std::array::from_fn(wave);
            NodeState {
                position: Vec3::from_fn(|k, _| scale[k] * v[k].0) + Vec3::new(0.0, 0.0, 0.25),
                rotation: Quat::from_scaled_axis(Vec3::new(v[3].0, v[4].0, v[5].0) * 0.1),
                angular: Vec3::new(v[3].1, v[4].1, v[5].1) * 0.1,
                velocity: Vec3::from_fn(|k, _| scale[k] * v[k].1),
            }
            .put(out);
        }
        PortKind::BallState => {
            let v: [(f64, f64); 3] = std::array::from_fn(wave);
            BallState {
                rotation: Quat::from_scaled_axis(Vec3::from_fn(|k, _| 0.1 * v[k].0)),
                rate: Vec3::from_fn(|k, _| 0.1 * v[k].1),
            }
            .put(out);
        }
        PortKind::HingeState => {
            let (angle, rate) = wave(0);
            HingeState { angle: 0.5 * angle, rate: 0.5 * rate }.put(out);
        }
        _ => {
            for (k, lane) in out.iter_mut().enumerate() {
                let middle = match &spec.default {
                    Some(d) => d[k],
                    None if POSITIVE.contains(&&*spec.unit) => 1.0,
                    None => 0.0,
                };
                *lane = middle + 0.5 * wave(k).0;
            }
        }
    }
}
