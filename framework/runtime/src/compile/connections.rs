//! Connections: the source lane of each input.
use crate::author::host::End;
use crate::author::setting::Setting;
use crate::author::value::Origin;
use crate::plan::compiled::{Sizes, Sum, Via};
use std::collections::BTreeMap;

/// The result of connecting.
#[derive(Default)]
pub(crate) struct Connections {
    /// For each part: source lane of each lane of the inputs and of the feedthrough inputs.
    pub inputs: Vec<(Vec<u32>, Vec<u32>)>,
    /// Reductions.
    pub sums: Vec<Sum>,
    /// Signal lanes with constant content.
    pub constants: Vec<(u32, f64)>,
    /// All signal lanes.
    pub signals: usize,
    /// Continuous and discrete lanes.
    pub sizes: Sizes,
    /// Signal lanes of inputs without a wire: (part, input lane) → lane.
    pub free: BTreeMap<(usize, usize), u32>,
    /// Wires that are solved for: algebraic loops are cut at these wires.
    pub tears: Vec<Tear>,
    /// For listings and loop reports.
    pub links: Vec<Link>,
    /// Parameters and inputs that may have no effect.
    pub settings: Vec<Setting>,
}

/// A wire that is solved for.
pub(crate) struct Tear {
    /// Lanes that the writer sends.
    pub sources: Vec<u32>,
    /// First of the lanes that the reader reads.
    pub sought: u32,
    pub tolerance: f64,
    pub reader: usize,
    pub text: String,
    pub to: String,
    pub origin: Origin,
}

/// Connection of an output to an input.
pub(crate) struct Link {
    /// Path of the output, or the target of the binding.
    pub from: String,
    pub to: String,
    pub via: Via,
    /// End that identifies the link: the reader if an output of the host is bound, else the writer.
    pub end: End,
    pub origin: Origin,
    /// First source lane.
    pub source: u32,
    /// Reading part.
    pub reader: usize,
}

impl Connections {
    /// Allocates signal slots and returns the first one.
    pub(super) fn allocate(&mut self, n: usize) -> u32 {
        let lane = self.signals as u32;
        self.signals += n;
        lane
    }
}
