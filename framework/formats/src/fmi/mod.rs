//! The description of an FMI unit: `modelDescription.xml` of FMI 2.0 and 3.0 → one neutral
//! [`ModelDescription`] for both.
//!
//! Terms that differ between the versions have one name here: a guid and an instantiation token are the [`token`](ModelDescription::token); indices
//! of scalar variables (2.0) and value references (3.0) in the model structure are indices in [`variables`](ModelDescription::variables). The reader
//! follows the FMI 2.0.4 and 3.0.2 standards.
mod read;

pub use read::read_model_description;

/// A version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FmiVersion {
    /// 2.0.
    V2,
    /// 3.0.
    V3,
}

/// The interface for running a unit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Interface {
    /// Name of its shared library, a C identifier.
    pub identifier: String,
    /// Whether a process may have only one instance.
    pub only_once: bool,
    /// Whether its state can be saved and restored.
    pub state: bool,
    /// Whether the state can be serialized to bytes.
    pub serialize: bool,
    /// Whether it must be notified after each complete integrator step (model exchange).
    pub completed_step: bool,
    /// The communication step must be a multiple of this (s) (co-simulation, 3.0).
    pub fixed_step: Option<f64>,
    /// Whether it can stop at events inside a communication step (co-simulation, 3.0).
    pub event_mode: bool,
    /// Whether it requires another installed program.
    pub needs_tool: bool,
}

/// The type of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VariableKind {
    /// `Real` (2.0), `Float64`.
    Float64,
    /// `Float32`.
    Float32,
    /// `Int8`.
    Int8,
    /// `UInt8`.
    UInt8,
    /// `Int16`.
    Int16,
    /// `UInt16`.
    UInt16,
    /// `Integer` (2.0), `Int32`.
    Int32,
    /// `UInt32`.
    UInt32,
    /// `Int64`.
    Int64,
    /// `UInt64`.
    UInt64,
    /// `Boolean`.
    Boolean,
    /// `Enumeration`: an integer.
    Enumeration,
    /// `String`.
    String,
    /// `Binary`.
    Binary,
    /// `Clock`.
    Clock,
}

impl VariableKind {
    fn of(element: &str) -> Option<Self> {
        Some(match element {
            "Real" | "Float64" => Self::Float64,
            "Float32" => Self::Float32,
            "Int8" => Self::Int8,
            "UInt8" => Self::UInt8,
            "Int16" => Self::Int16,
            "UInt16" => Self::UInt16,
            "Integer" | "Int32" => Self::Int32,
            "UInt32" => Self::UInt32,
            "Int64" => Self::Int64,
            "UInt64" => Self::UInt64,
            "Boolean" => Self::Boolean,
            "Enumeration" => Self::Enumeration,
            "String" => Self::String,
            "Binary" => Self::Binary,
            "Clock" => Self::Clock,
            _ => return None,
        })
    }

    /// Floating point.
    pub fn is_float(self) -> bool {
        matches!(self, Self::Float64 | Self::Float32)
    }

    /// Whether it is a number or a boolean, which a lane can hold.
    pub fn is_numeric(self) -> bool {
        !matches!(self, Self::String | Self::Binary | Self::Clock)
    }
}

/// The purpose of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Set before the start.
    Parameter,
    /// Follows from parameters.
    CalculatedParameter,
    /// A parameter for sizes of arrays.
    StructuralParameter,
    /// Driven from outside.
    Input,
    /// Seen from outside.
    Output,
    /// Inside.
    Local,
    /// Time.
    Independent,
}

/// Times at which a variable may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variability {
    /// Never.
    Constant,
    /// Not after the start.
    Fixed,
    /// The variable may be set from outside, at events.
    Tunable,
    /// The variable changes at events.
    Discrete,
    /// Always.
    Continuous,
}

/// The meaning of a start value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Initial {
    /// The exact value.
    Exact,
    /// A guess.
    Approx,
    /// No start value: the unit computes it.
    Calculated,
}

/// A unit of measurement: SI value = `factor` × number + `offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitDefinition {
    /// Name as written in the file.
    pub name: String,
    /// Exponents of kg, m, s, A, K, mol, cd, rad with factor and offset; `None` if the file does not define it.
    pub base: Option<([i8; 8], f64, f64)>,
}

/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub struct FmiVariable {
    /// Name, unique in the file.
    pub name: String,
    /// Value reference.
    pub reference: u32,
    /// Type.
    pub kind: VariableKind,
    /// Its purpose.
    pub causality: Causality,
    /// Times at which the variable may change.
    pub variability: Variability,
    /// The meaning of its start value, with the default of the standard.
    pub initial: Option<Initial>,
    /// Start values as written, in the order of the array (row by row).
    pub start: Vec<String>,
    /// Number of values: 1, or the product of the dimensions.
    pub size: usize,
    /// Whether it has dimensions, even if its size is 1.
    pub is_array: bool,
    /// Unit, if it has one; without an offset for a difference.
    pub unit: Option<UnitDefinition>,
    /// Whether it is a difference (`relativeQuantity`): offsets of units do not apply.
    pub relative: bool,
    /// Typical magnitude.
    pub nominal: Option<f64>,
    /// The ticks of a clock; `None` for other variables.
    pub clock: Option<FmiClock>,
    /// Meaning.
    pub doc: String,
}

/// The ticks of a clock (3.0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FmiClock {
    /// It ticks periodically (`constant`, `fixed` and `tunable`, whose interval the importer could change).
    Periodic {
        /// Time between two ticks, s.
        interval: f64,
        /// Time of the first tick after the start, s.
        shift: f64,
    },
    /// The unit states the time until the next tick (`countdown`).
    Countdown,
    /// Events outside of an input clock, or inside of the unit of an output clock, activate it (`triggered`).
    Triggered,
    /// The unit changes the interval after each tick (`changing`), or the interval is not in the description.
    Changing,
}

/// An output and its direct dependencies on inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputStructure {
    /// Index of the variable.
    pub variable: usize,
    /// Indices of the variables on which it depends; `None`: not specified, so all.
    pub dependencies: Option<Vec<usize>>,
}

/// The description of an FMI unit.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelDescription {
    /// Version of the standard.
    pub version: FmiVersion,
    /// Name.
    pub name: String,
    /// Meaning.
    pub doc: String,
    /// Identifier that the shared library compares, to check that the description belongs to it.
    pub token: String,
    /// Interface for co-simulation, with the unit's own solver.
    pub co_simulation: Option<Interface>,
    /// Interface for model exchange, as equations.
    pub model_exchange: Option<Interface>,
    /// Whether it has an interface for scheduled execution, in which the importer activates its clocks.
    pub scheduled_execution: bool,
    /// All variables, in the order of the file.
    pub variables: Vec<FmiVariable>,
    /// Outputs, in the order of the model structure.
    pub outputs: Vec<OutputStructure>,
    /// Continuous states and their derivatives (indices of variables), in the order of the unit.
    pub states: Vec<(usize, usize)>,
    /// Number of event indicators.
    pub event_indicators: usize,
    /// Relative tolerance of the default experiment.
    pub tolerance: Option<f64>,
}

/// Maximum number of values of one array, and of all ports together.
pub const VALUES_MAX: usize = 1 << 20;
