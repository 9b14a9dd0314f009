//! The description of a foreign unit: `modelDescription.xml` of FMI 2.0 and 3.0 → one neutral
//! [`ModelDescription`] for both.
//!
//! What the two versions call differently has one name here: a guid and an instantiation token are
//! the [`token`](ModelDescription::token); indices of scalar variables (2.0) and value references
//! (3.0) in the model structure are places in [`variables`](ModelDescription::variables).
//! Read with the FMI 2.0.4 and 3.0.2 standards.
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

/// How a unit is run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Interface {
    /// Name of its shared library, a C identifier.
    pub identifier: String,
    /// Only one instance may live in a process.
    pub only_once: bool,
    /// Its state can be taken and put back.
    pub state: bool,
    /// The state can be written as bytes.
    pub serialize: bool,
    /// It is to be told when a step of the integrator is complete (model exchange).
    pub completed_step: bool,
    /// The communication step must be a multiple of this (s) (co-simulation, 3.0).
    pub fixed_step: Option<f64>,
    /// It can be stopped at events inside a communication step (co-simulation, 3.0).
    pub event_mode: bool,
    /// It only talks to another program that has to be there.
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
    /// `Enumeration`: a whole number.
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

    /// A number or a truth value: something that a lane can hold.
    pub fn is_numeric(self) -> bool {
        !matches!(self, Self::String | Self::Binary | Self::Clock)
    }
}

/// What a variable is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Set before the start.
    Parameter,
    /// Follows from parameters.
    CalculatedParameter,
    /// Sizes of arrays follow from it.
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

/// When a variable may change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variability {
    /// Never.
    Constant,
    /// Not after the start.
    Fixed,
    /// At events, from outside.
    Tunable,
    /// At events.
    Discrete,
    /// Always.
    Continuous,
}

/// How a start value is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Initial {
    /// It is the value.
    Exact,
    /// It is a guess.
    Approx,
    /// There is none: the unit computes it.
    Calculated,
}

/// A unit of measurement: SI value = `factor` × number + `offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitDefinition {
    /// As written.
    pub name: String,
    /// Exponents of kg, m, s, A, K, mol, cd, rad with factor and offset; `None` when the file
    /// does not define it.
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
    /// What it is for.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// How its start value is meant, with the default of the standard.
    pub initial: Option<Initial>,
    /// Start values as written, in the order of the array (row by row).
    pub start: Vec<String>,
    /// Number of values: 1, or the product of the dimensions.
    pub size: usize,
    /// It has dimensions, if only one of size 1.
    pub is_array: bool,
    /// Unit, when it has one; without an offset when it is a difference.
    pub unit: Option<UnitDefinition>,
    /// It is a difference (`relativeQuantity`): offsets of units do not count.
    pub relative: bool,
    /// Typical magnitude.
    pub nominal: Option<f64>,
    /// Meaning.
    pub doc: String,
}

/// An output and what of the inputs it sees at once.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputStructure {
    /// Place among the variables.
    pub variable: usize,
    /// Places of what it depends on; `None`: not said, on everything.
    pub dependencies: Option<Vec<usize>>,
}

/// A foreign unit as its description has it.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelDescription {
    /// Version of the standard.
    pub version: FmiVersion,
    /// Name.
    pub name: String,
    /// Meaning.
    pub doc: String,
    /// What the shared library compares, to know that the description belongs to it.
    pub token: String,
    /// As a unit with a solver of its own.
    pub co_simulation: Option<Interface>,
    /// As equations.
    pub model_exchange: Option<Interface>,
    /// All variables, in the order of the file.
    pub variables: Vec<FmiVariable>,
    /// Outputs, in the order of the model structure.
    pub outputs: Vec<OutputStructure>,
    /// Continuous states and their derivatives (places among the variables), in the order in which
    /// the unit gives them.
    pub states: Vec<(usize, usize)>,
    /// Number of event indicators.
    pub event_indicators: usize,
    /// Relative tolerance of the default experiment.
    pub tolerance: Option<f64>,
}

/// Most values that one array, or all ports together, may have.
pub const VALUES_MAX: usize = 1 << 20;
