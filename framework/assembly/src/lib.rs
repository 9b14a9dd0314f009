//! RON assemblies and the Rust builder, which share one intermediate form; all mistakes are reported at once.
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
//! | `load` | all steps in order, and the resolved text that does not need other files; simulations that are ready to run |
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
pub use load::{
    Loaded, Options, Resolved, load_file, load_text, place_machines, read_value, schema,
};
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
