//! The flat specification that `compile` takes: parts, wires, bindings, a mechanism. Paths are dotted.
//!
//! The assembly floor writes it from RON; a Rust program may write it directly.
use crate::time::Seconds;
use crate::value::{Located, Origin, Value};
use linkwork_collision::Colliders;
use linkwork_multibody::{LoopMotion, Multibody};
use linkwork_solvers::{CompliantSettings, ContactSettings, Treatment};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A part: a model or a service at a path.
#[derive(Clone, Debug)]
pub struct PartSpec {
    /// Dotted path, unique: `Rover.Hardware.Wheels.Wheel1.Motor`.
    pub path: String,
    /// Name of the model or service in the catalogue.
    pub model: String,
    /// Where the model's name is written.
    pub model_origin: Origin,
    /// Parameters: a map.
    pub params: Located,
    /// Sample period, for sampled parts.
    pub rate: Option<Seconds>,
    /// Where the rate is written.
    pub rate_origin: Origin,
    /// Time of the first sample.
    pub offset: Seconds,
    /// Where the part is written.
    pub origin: Origin,
    /// Folder in which its files are looked for first.
    pub folder: Option<std::path::PathBuf>,
}

impl PartSpec {
    /// A part written by a program: parameters as a map, no rate.
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

/// A wire.
#[derive(Clone, Debug)]
pub struct WireSpec {
    /// An output.
    pub from: PortRef,
    /// An input.
    pub to: PortRef,
    /// As the user wrote it, for messages.
    pub text: String,
    /// Where it is written.
    pub origin: Origin,
}

/// A binding of a part to a node or a hinge coordinate of the mechanism.
#[derive(Clone, Debug)]
pub struct BindSpec {
    /// Path of the part.
    pub part: String,
    /// Name of the binding, as in `#[port(bind = "..")]`.
    pub bind: String,
    /// The target.
    pub target: BindTarget,
    /// Where it is written.
    pub origin: Origin,
}

/// What a part is bound to.
#[derive(Clone, Debug, PartialEq)]
pub enum BindTarget {
    /// A node of the mechanism by its full name, or a body (its hinge-side origin).
    Node(String),
    /// The one-dof hinge of a body, by the body's full name; `index` chooses the coordinate when it has several.
    Hinge {
        /// Body.
        body: String,
        /// Coordinate, from 0.
        index: usize,
    },
    /// A prescribed subhinge of a loop, by the loop's name; `index` chooses among several.
    Loop {
        /// The loop.
        name: String,
        /// Which of its prescribed subhinges, from 0.
        index: usize,
    },
}

/// The mechanism and how it starts.
#[derive(Clone)]
pub struct MechanismSpec {
    /// Path of the mechanism as a part: its outputs are `<path>.<body>…`.
    pub path: String,
    /// Structure.
    pub multibody: Arc<Multibody>,
    /// Coordinates at the start.
    pub q: Vec<f64>,
    /// Velocities at the start.
    pub v: Vec<f64>,
    /// Path of the gravity service; `None`: the only one, or no gravity when there is none.
    pub gravity: Option<String>,
    /// How each loop and coupling is treated, by name; `Auto` where nothing is said.
    pub treatments: BTreeMap<String, Treatment>,
    /// Prescribed subhinges of loops at the start.
    pub motions: Vec<LoopMotion>,
    /// Non-smooth contact, when the mechanism is stepped with it.
    pub contact: Option<ContactSpec>,
    /// Compliant contact: smooth forces with bristles as states. Not together with `contact`.
    pub compliant: Option<(Arc<Colliders>, CompliantSettings)>,
    /// Where it is written.
    pub origin: Origin,
    /// Where loops and couplings are written, by name.
    pub origins: BTreeMap<String, Origin>,
}

impl MechanismSpec {
    /// A mechanism without constraints' settings, contact or a gravity of its own.
    #[must_use]
    pub fn new(
        path: impl Into<String>,
        multibody: Arc<Multibody>,
        q: Vec<f64>,
        v: Vec<f64>,
    ) -> Self {
        Self {
            path: path.into(),
            motions: vec![LoopMotion::default(); multibody.motions()],
            multibody,
            q,
            v,
            gravity: None,
            treatments: BTreeMap::new(),
            contact: None,
            compliant: None,
            origin: Origin::NONE,
            origins: BTreeMap::new(),
        }
    }
}

/// Shapes that meet, and how their contact is solved. A mechanism with it advances a step at a time:
/// velocities and impulses together, first order in the step; other continuous states are
/// integrated as ever.
#[derive(Clone)]
pub struct ContactSpec {
    /// Shapes with the rules of who meets whom.
    pub colliders: Arc<Colliders>,
    /// How contact is solved.
    pub settings: ContactSettings,
}

/// Which integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Semi-implicit (symplectic) Euler: velocities first, then positions with the new velocities. Order 1.
    SemiImplicitEuler,
    /// The classical Runge–Kutta method. Order 4.
    Rk4,
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
    /// The mechanism.
    pub mechanism: Option<MechanismSpec>,
    /// Integration step.
    pub step: Seconds,
    /// Integrator.
    pub integrator: Integrator,
    /// Seed of all noise.
    pub seed: u64,
}

impl Default for Spec {
    fn default() -> Self {
        Spec {
            parts: Vec::new(),
            wires: Vec::new(),
            binds: Vec::new(),
            mechanism: None,
            step: Seconds { num: 1, den: 1000 },
            integrator: Integrator::Rk4,
            seed: 0,
        }
    }
}
