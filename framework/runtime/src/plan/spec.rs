//! The flat specification that `compile` takes: parts, wires, bindings and their targets. Paths are dotted.
//!
//! The assembly layer creates it from RON; a Rust program may create it directly.
use crate::author::binding::BindSpec;
use crate::author::host::Host;
use crate::author::time::Seconds;
use crate::author::value::{Located, Origin, Value};
use linkwork_integrate::Method;

/// A part: a model or a service at a path.
#[derive(Clone, Debug)]
pub struct PartSpec {
    /// Dotted path, unique: `Rover.Hardware.Wheels.Wheel1.Motor`.
    pub path: String,
    /// Name of the model or service in the catalogue.
    pub model: String,
    /// Position of the model's name in the file.
    pub model_origin: Origin,
    /// Parameters: a map.
    pub params: Located,
    /// Sample period, for sampled parts.
    pub rate: Option<Seconds>,
    /// Position of the rate in the file.
    pub rate_origin: Origin,
    /// Time of the first sample.
    pub offset: Seconds,
    /// Position of the part in the file.
    pub origin: Origin,
    /// Folder that is searched first for its files.
    pub folder: Option<std::path::PathBuf>,
}

impl PartSpec {
    /// Creates a part of a program: parameters as a map, no rate.
    pub fn new(path: impl Into<String>, model: impl Into<String>, params: Value) -> PartSpec {
        PartSpec {
            path: path.into(),
            model: model.into(),
            model_origin: Origin::NONE,
            params: params.into(),
            rate: None,
            rate_origin: Origin::NONE,
            offset: Seconds::ZERO,
            origin: Origin::NONE,
            folder: None,
        }
    }
    /// Sampled with this period.
    #[must_use]
    pub fn rate(mut self, period: Seconds) -> PartSpec {
        self.rate = Some(period);
        self
    }
}

/// One end of a wire: a part's port, or one lane of it.
#[derive(Clone, Debug, PartialEq)]
pub struct PortRef {
    /// Path of the part.
    pub part: String,
    /// Name of the port.
    pub port: String,
    /// One element (`port[2]`) of a port with several lanes.
    pub index: Option<usize>,
}

impl std::fmt::Display for PortRef {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.part, self.port)?;
        if let Some(k) = self.index {
            write!(f, "[{k}]")?;
        }
        Ok(())
    }
}

/// Delay of a wire.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum WireTiming {
    /// No delay.
    #[default]
    AtOnce,
    /// Delay by samples of the reader, or else of the writer, or else by integration steps.
    Delayed {
        /// Number of samples, at least one.
        samples: u32,
        /// Values before the first sample arrives: one number for each lane, or one for all.
        initial: Vec<f64>,
    },
    /// No delay, and the wire closes an algebraic loop: Newton's method finds its values, so that the input equals the output.
    Solved {
        /// Tolerated difference between both ends, relative to the value if that is above one.
        tolerance: f64,
    },
}

/// A wire.
#[derive(Clone, Debug)]
pub struct WireSpec {
    /// An output.
    pub from: PortRef,
    /// An input.
    pub to: PortRef,
    /// Delay of the wire.
    pub timing: WireTiming,
    /// Text that the user wrote, for messages.
    pub text: String,
    /// Position in the file.
    pub origin: Origin,
}

/// Integration method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Semi-implicit (symplectic) Euler: velocities first, then positions with the new velocities. Order 1.
    SemiImplicitEuler,
    /// The classical Runge–Kutta method. Order 4.
    Rk4,
    /// Bogacki–Shampine 3(2).
    BogackiShampine,
    /// Dormand–Prince 5(4).
    DormandPrince,
    /// Verner 8(7): for orbits.
    Verner,
    /// Rosenbrock method Rodas4P of order 4, L-stable: for stiff systems.
    Rodas,
}

impl Integrator {
    /// All methods, by the names that files use.
    pub const ALL: [(&'static str, Integrator); 6] = [
        ("semi_implicit_euler", Integrator::SemiImplicitEuler),
        ("rk4", Integrator::Rk4),
        ("bogacki_shampine_32", Integrator::BogackiShampine),
        ("dormand_prince_54", Integrator::DormandPrince),
        ("verner_87", Integrator::Verner),
        ("rodas4p", Integrator::Rodas),
    ];

    /// The method.
    pub fn method(self) -> Method {
        Method::by_name(match self {
            Integrator::SemiImplicitEuler => "semi-implicit-euler",
            Integrator::Rk4 => "rk4",
            Integrator::BogackiShampine => "bogacki-shampine-32",
            Integrator::DormandPrince => "dormand-prince-54",
            Integrator::Verner => "verner-87",
            Integrator::Rodas => "rodas-4p",
        })
        .unwrap_or(linkwork_integrate::METHODS[0])
    }
}

/// Tolerances for the error of each adaptive step.
#[derive(Clone, Debug, PartialEq)]
pub struct Accuracy {
    /// Relative tolerance: fraction of the magnitude of a state.
    pub relative: f64,
    /// Absolute tolerance, in the unit of the state.
    pub absolute: f64,
    /// Longest step (s).
    pub step_max: f64,
    /// Absolute tolerances of states by a pattern of their paths (`*`: within a name, `**`: anything); the last pattern that matches counts.
    pub of: Vec<(String, f64, Origin)>,
}

impl Default for Accuracy {
    fn default() -> Self {
        Accuracy { relative: 1e-9, absolute: 1e-9, step_max: f64::INFINITY, of: Vec::new() }
    }
}

/// A whole simulation, flat.
#[derive(Clone)]
pub struct Spec {
    /// Parts.
    pub parts: Vec<PartSpec>,
    /// Wires.
    pub wires: Vec<WireSpec>,
    /// Bindings.
    pub binds: Vec<BindSpec>,
    /// Host of the bindings.
    pub host: Option<Box<dyn Host>>,
    /// Integration step.
    pub step: Seconds,
    /// Integrator.
    pub integrator: Integrator,
    /// Adaptive steps of this accuracy between rows; `None`: steps of the size of `step`.
    pub accuracy: Option<Accuracy>,
    /// Seed of all noise.
    pub seed: u64,
}

impl Default for Spec {
    fn default() -> Self {
        Spec {
            parts: Vec::new(),
            wires: Vec::new(),
            binds: Vec::new(),
            host: None,
            step: Seconds { num: 1, den: 1000 },
            integrator: Integrator::Rk4,
            accuracy: None,
            seed: 0,
        }
    }
}
