//! Runtime of simulations: models, ports, wires, plan, clock, state, checkpoints.
//!
//! A simulation is compiled from a flat [`Spec`] into a `Plan` (shared, constant) and run as a
//! `Simulation` (all data that change). The wires determine the order of evaluation; see `compile`.
// This crate defines the mathematical functions under their names in C, bit-identical on every machine.
extern crate linkwork_maths as _;
extern crate self as linkwork_runtime;

mod author;
mod checkpoint;
mod compile;
mod plan;
mod recorders;
mod step;

pub use author::account::Account;
pub use author::binding::{BindSpec, BindTarget, TO_NODE};
pub use author::block::{
    Block, Carried, EvalTime, Evaluation, Failure, Indices, Named, Outcome, Prototype, Wiring,
};
pub use author::catalogue::{Catalogue, Entry, Foreign, Making, PartType};
pub use author::error::BuildError;
pub use author::field::{Field, FieldSample, Shows, View};
pub use author::files::{Files, text_of_bytes};
pub use author::host::{Bound, End, Host, HostWire, Lowering};
pub use author::jacobian::{Jacobian, Operation};
pub use author::made::ServiceCache;
pub use author::model::{Description, Fired, Functions, Model, Store};
pub use author::overlay::{
    OVERLAY_PERIOD, Overlay, OverlayNews, OverlayTile, OverlayValues, SharedOverlay,
};
pub use author::params::{NoParams, Param, ParamSpec, Params, ParamsBuilder, Range, ReadCx};
pub use author::ports::{
    AddedMass, BallState, BallTorque, BodyMass, ContactLoad, ContactZone, Direction, HingeAccel,
    HingeLoad, HingeState, HingeTorque, Lane, Lanes, NodeAccel, NodeState, PortKind, PortSpec,
    SurfaceVelocity, Text, Traction, VehicleMass, Wrench,
};
pub use author::provider::Service;
pub use author::services::{Contradiction, Handle, Provided, ServiceKind, ServiceObject, Services};
pub use author::setting::{IsWired, Judge, Judged, Setting, unwired};
pub use author::shown::SharedField;
pub use author::sized::{SizedModel, SizedPorts};
pub use author::time::{Clock, IntoSeconds, Seconds};
pub use author::units::{AU, Unit, UnitError, split_quantity};
pub use author::value::{Fault, Faults, IntoValue, Located, Origin, Sources, Value, remedy, told};
pub use author::variable::{Place, Role, Variable};
pub use author::{columns, connectors, doc, noise, pattern, testing};
pub use checkpoint::file::{Checkpoint, CheckpointError};
pub use checkpoint::state::Snapshot;
pub use compile::program::compile_program;
pub use compile::{check_parts, compile, known_variables};
pub use linkwork_names::{did_you_mean, nearest};
pub use plan::balance;
pub use plan::compiled::{
    FieldPlan, Fires, GuardPlan, Guarded, Integration, Op, PartPlan, Plan, Row, Sizes, Sum,
    TickWork, Via, Watched, WirePlan,
};
pub use plan::condition::{Condition, ConditionError, Times};
pub use plan::program::{Phase, PhaseSpec, Program, TransitionSpec, WatchSpec};
pub use plan::spec::{Accuracy, Integrator, PartSpec, PortRef, Spec, WireSpec, WireTiming};
pub use recorders::recorder::{Consumer, Overflow, Recorder, SetRow};
pub use recorders::rows::{Around, Group, Rows, Rule, Sample, Sink};
pub use recorders::schedule::Schedule;
pub use step::{
    Change, GuardState, MoveReport, Notice, Observer, ObserverRequest, Profile, RunError,
    Simulation, Spent, State, Stop, Stretch, VariableError,
};

/// Items for authors of a [`Host`] and of parts that solve for the states of many others, such as a multibody mechanism.
///
/// [`Prototype`] and [`Block`] are the part; [`Host`] converts bindings of other parts to ports of it. A host that places something finds its
/// start with [`settle`](host::settle).
pub mod host {
    pub use crate::author::block::{OldState, copy_store};
    pub use crate::author::model::Turning;
    pub use crate::step::{SettleGroup, settle};
}

/// Items for libraries of models.
pub mod prelude {
    pub use crate::author::connectors::{
        Current, Currents, HeatFlow, HeatFlows, MassFlow, MassFlows, OpenVoltage, Propellant,
        Temperature, Voltage,
    };
    pub use crate::{
        AddedMass, BallState, BallTorque, BodyMass, BuildError, Clock, ContactLoad, Direction,
        Entry, Field, Files, Fired, Handle, HingeAccel, HingeLoad, HingeState, HingeTorque,
        IsWired, Judge, Judged, Lanes, Model, NodeAccel, NodeState, Overlay, OverlayTile,
        OverlayValues, PortKind, PortSpec, Service, SharedOverlay, Shows, SizedModel, SizedPorts,
        Store, SurfaceVelocity, Traction, VehicleMass, View, Wrench, unwired,
    };
    pub use linkwork_derive::{Params, Ports, State, field, model, service};
    pub use linkwork_spatial::{Quat, Vec3};
}
