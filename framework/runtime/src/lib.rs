//! Models, ports, wires, plan, clock, state, checkpoints.
//!
//! A simulation is compiled from a flat [`Spec`] into a `Plan` (shared, constant) and run as a
//! `Simulation` (everything that changes). Order comes from the wires; see `compile`.
extern crate self as linkwork_runtime;

mod block;
mod catalogue;
mod checkpoint;
mod compile;
mod mechanism;
mod model;
pub mod noise;
mod params;
mod place;
mod plan;
mod ports;
mod schedule;
mod services;
mod simulation;
mod spec;
mod tap;
mod time;
mod units;
mod value;

pub use block::{Block, Evaluation, Indices, Now, Prototype, Wiring};
pub use catalogue::{Catalogue, Entry};
pub use checkpoint::{Checkpoint, CheckpointError, Snapshot};
pub use compile::{check_parts, compile};
pub use mechanism::{Frame, MechanismPlan, MechanismWiring};
pub use model::{BuildError, Description, Functions, Model, Store};
pub use params::{Param, ParamSpec, Params, Range, ReadCx};
pub use place::{PlaceError, Placement, place_on_terrain};
pub use plan::{Op, PartPlan, Place, Plan, Role, Row, Sizes, TickWork, Variable, Via, WirePlan};
pub use ports::{
    HingeAccel, HingeState, HingeTorque, Lane, Lanes, NodeAccel, NodeState, PortKind, PortSpec,
    Wrench,
};
pub use schedule::Schedule;
pub use services::{
    Air, Atmosphere, Files, Gravity, Ground, Handle, Provided, Rock, Service, ServiceKind,
    ServiceObject, Services, Soil, Sun, SunState, Surface, Terrain,
};
pub use simulation::{RunError, Simulation, State, VariableError};
pub use spec::{
    BindSpec, BindTarget, ContactSpec, Integrator, MechanismSpec, PartSpec, PortRef, Spec, WireSpec,
};
pub use tap::{Consumer, Group, Overflow, Row as TapRow, Tap};
pub use time::{Clock, Seconds};
pub use units::{Unit, UnitError, split_quantity};
pub use value::{Fault, Faults, Located, Origin, Sources, Value, did_you_mean, remedy};

/// What a library of models needs in scope.
pub mod prelude {
    pub use crate::{
        Air, Atmosphere, BuildError, Clock, Entry, Files, Gravity, Ground, Handle, HingeAccel,
        HingeState, HingeTorque, Lanes, Model, NodeAccel, NodeState, Rock, Service, Soil, Sun,
        SunState, Surface, Terrain, Wrench,
    };
    pub use linkwork_derive::{Params, Ports, State, model, service};
    pub use linkwork_spatial::{Quat, Vec3};
}
