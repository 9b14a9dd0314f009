//! Accounts: numbers of a part that count in the balances of energy, mass and charge.

/// Role of a number in the balances of its part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Account {
    /// An amount that the part holds: J, kg or C.
    Stored,
    /// A rate at which the part receives from outside of the simulation: W, kg/s or A.
    Gained,
    /// A rate at which the part gives to outside of the simulation: W, kg/s or A.
    Lost,
}

/// A conserved quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Energy, J.
    Energy,
    /// Mass of propellant, kg.
    Mass,
    /// Electric charge, C.
    Charge,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Quantity; 3] = [Quantity::Energy, Quantity::Mass, Quantity::Charge];

    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Energy => "energy",
            Quantity::Mass => "mass",
            Quantity::Charge => "charge",
        }
    }

    /// The unit of its amounts.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Energy => "J",
            Quantity::Mass => "kg",
            Quantity::Charge => "C",
        }
    }

    /// Returns the quantity of a declared number, and whether it is an amount (J) or a rate (W).
    pub(crate) fn of(unit: &str) -> Option<(Quantity, bool)> {
        Some(match unit {
            "J" => (Quantity::Energy, true),
            "W" => (Quantity::Energy, false),
            "kg" => (Quantity::Mass, true),
            "kg/s" => (Quantity::Mass, false),
            "C" => (Quantity::Charge, true),
            "A" => (Quantity::Charge, false),
            _ => return None,
        })
    }
}

/// An account that a block reports itself, because it is not a port.
#[derive(Clone, Debug, PartialEq)]
pub struct OwnAccount {
    /// Name: `kinetic energy`.
    pub name: &'static str,
    /// Role of the number.
    pub account: Account,
    /// Quantity that it counts.
    pub quantity: Quantity,
}

/// The accounts of a block, and its exchanges whose amounts it cannot compute.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OwnAccounts {
    /// Numbers that it reports, in the order of [`crate::Block::accounts`].
    pub known: Vec<OwnAccount>,
    /// Exchanges that it cannot compute: their sum is the residual of its balance.
    pub unknown: Vec<String>,
    /// It receives the work of all parts.
    pub receives_work: bool,
}
