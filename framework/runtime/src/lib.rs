//! Models, ports, wires, plan, clock, state, checkpoints.
//!
//! A simulation is compiled from a flat [`Spec`] into a `Plan` (shared, constant) and run as a
//! `Simulation` (everything that changes). Order comes from the wires; see `compile`.
// Mathematical functions that are bit-identical on every machine: they are called by their names in C.
extern crate linkwork_maths as _;
extern crate self as linkwork_runtime;

mod account;
pub mod balance;
mod binding;
mod block;
mod catalogue;
mod checkpoint;
pub mod columns;
mod compile;
mod condition;
pub mod connectors;
pub mod doc;
mod error;
mod field;
mod files;
mod identity;
mod jacobian;
mod made;
mod mechanism;
mod model;
pub mod noise;
mod overlay;
mod params;
pub mod pattern;
mod plan;
mod port_values;
mod ports;
mod program;
mod provider;
mod recorder;
mod route;
mod rows;
mod scenery;
mod schedule;
mod service_params;
mod services;
mod setting;
mod shown;
mod site;
mod sized;
mod spec;
mod start;
mod step;
mod surroundings;
pub mod testing;
mod time;
mod units;
mod value;
mod variable;
mod world;

pub use account::Account;
pub use binding::{BindSpec, BindTarget};
pub use block::{
    Block, Carried, EvalTime, Evaluation, Failure, Indices, Named, Outcome, Prototype, Wiring,
};
pub use catalogue::{Catalogue, Entry, Foreign, Making, PartType};
pub use checkpoint::{Checkpoint, CheckpointError, Snapshot};
pub use compile::{Bound, End, Host, HostWire, Lowering, check_parts, compile, known_variables};
pub use condition::{Condition, ConditionError, Times};
pub use error::BuildError;
pub use field::{Field, FieldSample, Shows, View};
pub use files::Files;
pub use jacobian::{Jacobian, Operation};
pub use linkwork_multibody::names::{did_you_mean, nearest};
pub use made::ServiceCache;
pub use mechanism::{
    Closing, ContactSpec, Frame, KinematicSpec, MechanismPart, MechanismPlan, MechanismPorts,
    MechanismSpec, Passing, PlaceError, Placed, Placement, RankReport, place_on_terrain,
    settle_placed,
};
pub use model::{Description, Fired, Functions, Model, Store};
pub use overlay::{
    OVERLAY_PERIOD, Overlay, OverlayNews, OverlayTile, OverlayValues, SharedOverlay,
};
pub use params::{NoParams, Param, ParamSpec, Params, ParamsBuilder, Range, ReadCx};
pub use plan::{
    FieldPlan, Fires, GuardPlan, Guarded, Integration, Op, PartPlan, Plan, Row, Sizes, Sum,
    TickWork, Via, Watched, WirePlan,
};
pub use ports::{
    AddedMass, BallState, BallTorque, BodyMass, ContactLoad, Direction, HingeAccel, HingeLoad,
    HingeState, HingeTorque, Lane, Lanes, NodeAccel, NodeState, PortKind, PortSpec,
    SurfaceVelocity, Text, Traction, VehicleMass, Wrench,
};
pub use program::{Phase, PhaseSpec, Program, TransitionSpec, WatchSpec, compile_program};
pub use provider::Service;
pub use recorder::{Change, Consumer, Overflow, Recorder, SetRow};
pub use rows::{Around, Group, Rows, Rule, Sample, Sink};
pub use scenery::{PLAIN, Scenery, Sight};
pub use schedule::Schedule;
pub use services::{
    Air, Atmosphere, Gravity, Ground, Handle, Light, Provided, Rock, SOLAR_CONSTANT,
    SPEED_OF_LIGHT, ServiceKind, ServiceObject, Services, Soil, Sun, SunState, Surface, Terrain,
};
pub use setting::Setting;
pub use shown::SharedField;
pub use site::{Axes, Site};
pub use sized::{SizedModel, SizedPorts};
pub use spec::{Accuracy, Integrator, PartSpec, PortRef, Spec, WireSpec, WireTiming};
pub use start::{Anomaly, BodyStart, Start, StartFrame, TwoLineSource};
pub use step::{
    GuardState, MoveReport, Notice, Observer, ObserverRequest, Profile, RunError, Simulation,
    Spent, State, Stop, Stretch, VariableError,
};
pub use surroundings::{Vertical, needs_level_ground};
pub use time::{Clock, IntoSeconds, Seconds};
pub use units::{AU, Unit, UnitError, split_quantity};
pub use value::{Fault, Faults, IntoValue, Located, Origin, Sources, Value, remedy, told};
pub use variable::{Place, Role, Variable};
pub use world::{Geographic, PlainWorld, World};

/// Items that a library of models needs in scope.
pub mod prelude {
    pub use crate::connectors::{
        Current, Currents, HeatFlow, HeatFlows, MassFlow, MassFlows, OpenVoltage, Propellant,
        Temperature, Voltage,
    };
    pub use crate::{
        AddedMass, Air, Atmosphere, Axes, BallState, BallTorque, BodyMass, BuildError, Clock,
        ContactLoad, Direction, Entry, Field, Files, Fired, Geographic, Gravity, Ground, Handle,
        HingeAccel, HingeLoad, HingeState, HingeTorque, Lanes, Light, Model, NodeAccel, NodeState,
        Overlay, OverlayTile, OverlayValues, PortKind, PortSpec, Rock, Scenery, Service,
        SharedOverlay, Shows, Site, SizedModel, SizedPorts, Soil, Store, Sun, SunState, Surface,
        SurfaceVelocity, Terrain, Traction, VehicleMass, Vertical, View, World, Wrench,
    };
    pub use linkwork_derive::{Params, Ports, State, field, model, service};
    pub use linkwork_spatial::{Quat, Vec3};
}
