//! Values that variables keep.
use std::collections::BTreeMap;
use std::sync::Arc;

/// The pins by path, and their slots in a plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Pins {
    pub(super) values: BTreeMap<String, (f64, Target)>,
    pub(super) x: Vec<(u32, f64)>,
    pub(super) d: Vec<(u32, f64)>,
    pub(super) sig: Vec<(u32, f64)>,
    /// Operation, lane that it writes, and value, in the order of the operations.
    pub(super) written: Vec<(u32, u32, f64)>,
}

impl Pins {
    /// States to their values.
    pub fn states(&self, x: &mut [f64]) {
        for &(k, value) in &self.x {
            x[k as usize] = value;
        }
    }

    /// Sets discrete states to their pinned values.
    pub fn discrete(&self, d: &mut [f64]) {
        for &(k, value) in &self.d {
            d[k as usize] = value;
        }
    }

    /// Signals to their values.
    pub fn signals(&self, sig: &mut [f64]) {
        for &(k, value) in &self.sig {
            sig[k as usize] = value;
        }
    }

    /// Everything to its value.
    pub fn hold(&self, x: &mut [f64], d: &mut [f64], sig: &mut [f64]) {
        self.states(x);
        self.discrete(d);
        self.signals(sig);
    }

    /// Sets derivatives of pinned states to zero.
    pub fn still(&self, xdot: &mut [f64]) {
        for &(k, _) in &self.x {
            xdot[k as usize] = 0.0;
        }
    }

    /// Overwrites the pinned values among those that an operation has just written.
    pub fn after(&self, op: u32, sig: &mut [f64]) {
        let first = self.written.partition_point(|w| w.0 < op);
        for &(_, k, value) in self.written[first..].iter().take_while(|w| w.0 == op) {
            sig[k as usize] = value;
        }
    }

    /// Returns path and value of each pin.
    pub fn values(&self) -> impl Iterator<Item = (&str, f64)> {
        self.values.iter().map(|(path, (value, _))| (path.as_str(), *value))
    }

    /// Creates the pins for these values; `None` if there are none.
    pub(super) fn of(values: BTreeMap<String, (f64, Target)>) -> Option<Arc<Pins>> {
        let mut pins = Pins { values, ..Pins::default() };
        for &(value, target) in pins.values.values() {
            match target {
                Target::X(k) => pins.x.push((k, value)),
                Target::D(k) => pins.d.push((k, value)),
                Target::Signal(k, op) => {
                    pins.sig.push((k, value));
                    pins.written.extend(op.map(|op| (op, k, value)));
                }
            }
        }
        pins.written.sort_by_key(|w| (w.0, w.1));
        (!pins.values.is_empty()).then(|| Arc::new(pins))
    }
}

/// Location at which a variable can be pinned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Target {
    X(u32),
    D(u32),
    /// A signal, and the operation that writes it.
    Signal(u32, Option<u32>),
}
