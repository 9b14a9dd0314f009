//! Wires with a delay: each is a sampled part between its two ends, with its own lanes and state.
use super::part::Part;
use crate::author::block::{Block, EvalTime, Outcome, Prototype, Wiring};
use crate::author::model::{Description, Functions};
use crate::author::ports::{PortKind, PortSpec};
use crate::author::value::{Fault, Value};
use crate::plan::spec::{PartSpec, PortRef, Spec, WireSpec, WireTiming};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;

/// Maximum delay in samples; a longer one was probably meant in seconds.
const SAMPLES_MAX: u32 = 100_000;

/// The wires, where each delayed wire is replaced by two wires and a part between them.
pub(super) struct Delays<'a> {
    /// Wires of the specification, and those to and from the parts of delays.
    pub wires: Cow<'a, [WireSpec]>,
    /// For each delayed wire: its index in [`Delays::of`].
    pub specs: Vec<PartSpec>,
    of: Vec<&'a WireSpec>,
}

/// Creates the parts of delayed wires. The rates of the parts follow from the two ends.
pub(super) fn split<'a>(spec: &'a Spec) -> Delays<'a> {
    let delayed = |w: &&WireSpec| matches!(w.timing, WireTiming::Delayed { .. });
    let mut of: Vec<&WireSpec> = spec.wires.iter().filter(delayed).collect();
    if of.is_empty() {
        return Delays { wires: Cow::Borrowed(&spec.wires), specs: Vec::new(), of };
    }
    of.sort_by_key(|w| (w.to.to_string(), w.from.to_string()));
    let parts: BTreeMap<&str, &PartSpec> = spec.parts.iter().map(|p| (&*p.path, p)).collect();
    let find = |path: &str| parts.get(path).copied();
    let mut wires: Vec<WireSpec> = spec.wires.iter().filter(|w| !delayed(w)).cloned().collect();
    let mut names: BTreeMap<String, u32> = BTreeMap::new();
    let mut specs = Vec::new();
    for wire in &of {
        let stem = format!("{}.delay", wire.to).replace(['[', ']'], "_");
        let n = names.entry(stem.clone()).or_insert(0);
        *n += 1;
        let path = if *n == 1 { stem } else { format!("{stem}{n}") };
        let port = |port: &str| PortRef { part: path.clone(), port: port.into(), index: None };
        let half = |from, to| WireSpec {
            from,
            to,
            timing: WireTiming::AtOnce,
            text: wire.text.clone(),
            origin: wire.origin,
        };
        wires.push(half(wire.from.clone(), port("u")));
        wires.push(half(port("y"), wire.to.clone()));
        let mut part = PartSpec::new(path.clone(), "delay", Value::Map(Vec::new()));
        part.origin = wire.origin;
        let ends = [&wire.to, &wire.from].map(|end| owner(end, &find));
        let sampled = ends.into_iter().flatten().find(|p| p.rate.is_some());
        (part.rate, part.offset) = match sampled {
            Some(p) => (p.rate, p.offset),
            None => (Some(spec.step), part.offset),
        };
        specs.push(part);
    }
    Delays { wires: Cow::Owned(wires), specs, of }
}

/// Returns the part that an end names: `IMU.accel.x` arrives as part `IMU.accel`.
fn owner<'a>(end: &PortRef, find: &impl Fn(&str) -> Option<&'a PartSpec>) -> Option<&'a PartSpec> {
    let mut path = end.part.as_str();
    loop {
        if let Some(part) = find(path) {
            return Some(part);
        }
        path = path.rsplit_once('.')?.0;
    }
}

impl Delays<'_> {
    /// Inserts the parts among the others.
    pub fn add<'b>(&'b self, parts: &mut Vec<Part<'b>>, faults: &mut Vec<Fault>) {
        if self.specs.is_empty() {
            return;
        }
        let mut new = Vec::new();
        let output = super::connect::outputs(parts);
        for (spec, wire) in self.specs.iter().zip(&self.of) {
            let WireTiming::Delayed { samples, initial } = &wire.timing else { continue };
            let fault = |fact: String, help: &str| {
                Fault::new(wire.origin, format!("wire `{}`: {fact}", wire.text)).help(help)
            };
            if !(1..=SAMPLES_MAX).contains(samples) {
                let fact = format!("a delay of {samples} samples is not possible");
                faults.push(fault(fact, "write a number of samples from 1 to 100000"));
            }
            // If the output does not exist, the check of the wire reports it, and compilation fails. Continue
            // with one number, so that the delays of the other wires are checked, too.
            let (source, range) = output(&wire.from)
                .unwrap_or_else(|| (PortSpec::named("y", PortKind::Numbers, 1), 0..1));
            let lanes = range.len();
            let mut start = initial.clone();
            if start.len() <= 1 {
                start = vec![start.first().copied().unwrap_or(0.0); lanes];
            }
            if start.len() != lanes {
                let fact = format!("it carries {lanes} numbers, but `initial` has {}", start.len());
                faults.push(fault(fact, "write one number for all, or one for each"));
                start.resize(lanes, 0.0);
            }
            let samples = (*samples).clamp(1, SAMPLES_MAX);
            let prototype = Box::new(Delay::new(&source, range, samples as usize, start));
            new.push(Part { spec, prototype, wiring: Wiring::default(), asks: Vec::new() });
        }
        drop(output);
        parts.extend(new);
        parts.sort_by(|a, b| a.spec.path.cmp(&b.spec.path));
    }
}

/// Holds samples back.
struct Delay {
    description: Description,
    params: Value,
    lanes: usize,
    start: Vec<f64>,
}

impl Delay {
    fn new(source: &PortSpec, range: Range<usize>, samples: usize, start: Vec<f64>) -> Delay {
        let lanes = range.len();
        let port = |name: &'static str, doc: &'static str| {
            let port = match lanes == source.lanes {
                true => PortSpec::named(name, source.kind, lanes).unit_of(source.unit.clone()),
                // All lanes in the range of a port have one unit: take it from the first lane.
                false => PortSpec::named(name, PortKind::Numbers, lanes)
                    .unit_of(source.lane_names()[range.start].1.clone()),
            };
            port.doc_of(doc)
        };
        let held = PortSpec::named("held", PortKind::Numbers, lanes * samples)
            .doc_of("Delayed samples, the oldest first.");
        let description = Description {
            name: "delay".into(),
            doc: "A wire whose values arrive some samples later.".into(),
            functions: Functions { outputs: true, update: true, ..Functions::default() },
            inputs: vec![port("u", "Value to delay.")],
            outputs: vec![port("y", "Delayed value.")],
            discrete: vec![held],
            ..Description::default()
        };
        let params = Value::Map(vec![(
            "initial".into(),
            Value::List(start.iter().map(|v| Value::Number(*v).into()).collect()).into(),
        )]);
        Delay { description, params, lanes, start }
    }
}

impl Prototype for Delay {
    fn description(&self) -> &Description {
        &self.description
    }
    fn params(&self) -> &Value {
        &self.params
    }
    fn initial(&self, _: &mut [f64], d: &mut [f64]) {
        d.chunks_exact_mut(self.lanes).for_each(|sample| sample.copy_from_slice(&self.start));
    }
    fn stored(&self) -> bool {
        false
    }
    fn block(&self, wiring: Wiring) -> Box<dyn Block> {
        let n = self.description.discrete[0].lanes;
        Box::new(DelayLine { w: wiring, lanes: self.lanes, n })
    }
}

struct DelayLine {
    w: Wiring,
    lanes: usize,
    n: usize,
}

impl Block for DelayLine {
    fn outputs(&mut self, _: &EvalTime, _: &[f64], d: &[f64], sig: &mut [f64]) -> Outcome {
        sig[self.w.ym..self.w.ym + self.lanes].copy_from_slice(&d[self.w.d..self.w.d + self.lanes]);
        Ok(())
    }
    fn feedthrough(&mut self, _: &EvalTime, _: &[f64], _: &[f64], _: &mut [f64]) -> Outcome {
        Ok(())
    }
    fn derivatives(
        &mut self,
        _: &EvalTime,
        _: &[f64],
        _: &[f64],
        _: &[f64],
        _: &mut [f64],
    ) -> Outcome {
        Ok(())
    }
    fn update(&mut self, _: &EvalTime, _: &[f64], d: &mut [f64], sig: &[f64]) -> Outcome {
        let held = &mut d[self.w.d..self.w.d + self.n];
        held.copy_within(self.lanes.., 0);
        let last = self.n - self.lanes;
        for (to, lane) in held[last..].iter_mut().zip(&self.w.u) {
            *to = sig[*lane as usize];
        }
        Ok(())
    }
    fn save_store(&self) -> Result<Vec<u8>, String> {
        Ok(Vec::new())
    }
    fn load_store(&mut self, _: &[u8]) -> Result<(), String> {
        Ok(())
    }
    fn fork(&self) -> Box<dyn Block> {
        Box::new(DelayLine { w: self.w.clone(), lanes: self.lanes, n: self.n })
    }
}
