//! RON assemblies and the Rust builder: one intermediate form, all diagnostics at once.
//!
//! [`load_file`] and [`load_text`] read a `Simulation(..)` or an `Assembly(..)`, include what it
//! names, replace parameters, apply overrides, and give the flat `Spec` that the runtime
//! compiles. Everything that is wrong is reported together, each mistake at its line and column.
//!
//! Folders, each of which uses only those before it (`tests/tests/runtime/tidy.rs` holds that):
//!
//! | folder | what it is |
//! |---|---|
//! | `text` | texts, located values in them, faults as text, finding files |
//! | `schema` | records of the format: `record!` declares one, and that is its reader, its writer and its JSON Schema |
//! | `scope` | parameters in force, arithmetic with them |
//! | `body` | records of bodies, loops, couplings, colliders, contact |
//! | `form` | assemblies, phases and settings as written |
//! | `machine` | mechanisms of URDF, MJCF and SDF files, and any other, as assemblies; side-cars |
//! | `expand` | the tree of instances, and references in it |
//! | `mechanism` | bodies, loops, couplings, contact as one mechanism |
//! | `wiring` | parts, bindings, wires |
//! | `load` | all of these in order, and the resolved text that needs no other file; simulations that are ready to run |
//! | `build` | assemblies that a Rust program builds |
#![allow(non_snake_case)]

mod body;
mod build;
mod expand;
pub mod form;
mod load;
pub mod machine;
mod mechanism;
pub mod schema;
mod scope;
mod text;
mod wiring;

pub use body::shapes::BodyShape;
pub use build::{Assembly, Body, BodyInertia, NewPart, NewWire};
pub use linkwork_runtime::{IntoValue, Value};
pub use load::library::{Library, Ready, Shared, sim_file};
pub use load::{Loaded, Options, Resolved, load_file, load_text, put_down, read_value, schema};
pub use text::parsed::Parsed;
pub use text::report::tidy;
pub use text::show::{Failure, Look, show_faults};
pub use text::value::{Text, variant};

/// The tree of instances of a loaded simulation.
pub mod tree {
    pub use crate::expand::tree::{TreeKind, TreeNode};
}

/// Patterns over the paths of variables: `"Rover.**.torque"`.
pub mod patterns {
    pub use crate::load::dotted;
    pub use crate::text::patterns::{match_patterns, matches, misspelt, path_matches};
}
