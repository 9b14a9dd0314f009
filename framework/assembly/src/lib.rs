//! RON assemblies and the Rust builder: one intermediate form; all mistakes are reported at once.
//!
//! [`load_file`] and [`load_text`] read a `Simulation(..)` or an `Assembly(..)`, include the files that it uses, replace parameters, apply overrides,
//! and return the flat `Spec` that the runtime compiles. All mistakes are reported together, each with its line and column.
//!
//! Each folder uses only those before it (`tests/tests/runtime/tidy.rs` tests this):
//!
//! | folder | content |
//! |---|---|
//! | `text` | texts, values with positions, formatting of faults, search of files |
//! | `schema` | records of the format: a declaration with `record!` generates reader, writer and JSON Schema |
//! | `scope` | parameters in scope, arithmetic with them |
//! | `body` | records of bodies, loops, couplings, colliders, contact |
//! | `form` | assemblies, phases and settings as written in files; the Rust builder |
//! | `machine` | mechanisms of URDF, MJCF and SDF files, and other mechanisms, as assemblies; companion files |
//! | `expand` | the tree of instances, and references in it |
//! | `mechanism` | bodies, loops, couplings, contact as one mechanism |
//! | `wiring` | parts, bindings, wires |
//! | `load` | all steps in order, and the resolved text that does not need other files |
#![allow(non_snake_case)]

mod body;
mod expand;
mod form;
mod load;
mod machine;
mod mechanism;
mod schema;
mod scope;
mod text;
mod wiring;

pub use body::shapes::BodyShape;
pub use expand::tree::{TreeKind, TreeNode};
pub use form::assembly::{Assembly, ItemForm, MountDecl, PartForm, PartKind};
pub use form::settings::{
    AroundForm, ArrowForm, LineForm, LogRule, Metric, MetricOf, PlacementForm, Plot, PlumeForm,
    Settings, Take, ViewForm,
};
pub use linkwork_formats::{MESH_FILES, mesh_corners, mesh_corners_of};
pub use linkwork_runtime::Value;
pub use load::{
    Loaded, Options, Resolved, dotted, load_file, load_text, place_machines, read_value, schema,
};
pub use machine::convert::Converted;
pub use machine::import::{Import, read_machine};
pub use machine::sidecar::apply_side_car;
pub use schema::describe::{Field, Parameters, Schema, document, plain};
pub use scope::parameters::ParamDecl;
pub use text::parsed::Parsed;
pub use text::patterns::{match_patterns, matches, misspelt, path_matches};
pub use text::report::tidy;
pub use text::show::{Failure, Look, show_faults};
pub use text::value::{IntoValue, Text, variant};
