//! What parts bind to. A host converts bindings into ordinary wires on ports of its own part, so that later compilation steps handle only parts and
//! wires.
use crate::author::binding::{BindSpec, BindTarget};
use crate::author::block::Prototype;
use crate::author::ports::PortSpec;
use crate::author::services::{ServiceObject, Services};
use crate::author::setting::Setting;
use crate::author::value::{Fault, Origin};
use std::any::Any;

/// A part that others bind to.
pub trait Host: Any + Send + Sync {
    /// Path of its part.
    fn path(&self) -> &str;
    /// Name of its kind, used like the name of a model.
    fn kind(&self) -> &'static str;
    /// Position in the file.
    fn origin(&self) -> Origin;
    /// Returns the part with the ports that these bindings request, and the wires to these ports. A binding that
    /// cannot be served is a fault.
    fn lower(
        &self,
        bound: &[Bound<'_>],
        services: &Services,
        out: &mut Lowering<'_>,
    ) -> Box<dyn Prototype>;
    /// Returns whether the coordinate to which a part binds is a length; `None` if the target is not a coordinate, or does not exist.
    fn slides(&self, _target: &BindTarget) -> Option<bool> {
        None
    }
    /// Returns the settings that may have no effect, with the reasons in this phase.
    fn settings(&self) -> Vec<Setting> {
        Vec::new()
    }
    /// Returns a service that parameters of models can read ([`Services::of_host`]).
    fn service(&self) -> Option<ServiceObject> {
        None
    }
    /// A copy.
    fn boxed(&self) -> Box<dyn Host>;
}

impl Clone for Box<dyn Host> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

/// Result of converting bindings into wires.
pub struct Lowering<'a> {
    /// The wires.
    pub wires: Vec<HostWire>,
    /// Bindings that cannot be served.
    pub faults: &'a mut Vec<Fault>,
    /// Warnings about allowed but probably unintended bindings.
    pub warnings: &'a mut Vec<Fault>,
}

/// End of a wire that a port forms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The port is read.
    Input,
    /// The port is written.
    Output,
}

/// A binding with the ports of the part that it serves.
pub struct Bound<'a> {
    /// The binding.
    pub spec: &'a BindSpec,
    /// Ports that name it.
    pub ports: Vec<(&'a PortSpec, End)>,
}

/// A wire between a port of the host and a port of a part.
pub struct HostWire {
    /// Name of the host's port.
    pub host_port: String,
    /// End of the wire that the part's port forms.
    pub end: End,
    /// Path of the part.
    pub part: String,
    /// Its port.
    pub port: String,
    /// The target in words, for listings: `node chassis`.
    pub label: String,
    /// Position of the binding in the file.
    pub origin: Origin,
}
