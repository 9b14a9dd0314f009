//! A variable of a unit with its conversion to SI.
use linkwork_formats::fmi::{FmiVariable, Variability, VariableKind};

/// A variable of a unit: SI value = factor × number + offset.
#[derive(Clone, Debug)]
pub(crate) struct Slot {
    pub name: String,
    pub reference: u32,
    pub kind: VariableKind,
    pub size: usize,
    pub factor: f64,
    pub offset: f64,
    /// It changes only at events.
    pub discrete: bool,
}

impl Slot {
    pub fn of(v: &FmiVariable) -> Slot {
        let (factor, offset) = match v.unit.as_ref().and_then(|u| u.base) {
            Some((_, factor, offset)) if v.kind.is_float() => (factor, offset),
            _ => (1.0, 0.0),
        };
        Slot {
            name: v.name.clone(),
            reference: v.reference,
            kind: v.kind,
            size: v.size,
            factor,
            offset,
            discrete: !v.kind.is_float() || v.variability == Variability::Discrete,
        }
    }
}
