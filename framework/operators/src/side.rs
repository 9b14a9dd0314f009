//! Operators and their transposes.

/// A symbol, or its transpose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Plain,
    Transposed,
}

impl Side {
    pub fn flip(self) -> Self {
        if self == Side::Plain { Side::Transposed } else { Side::Plain }
    }
}
