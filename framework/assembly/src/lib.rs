//! RON assemblies and the Rust builder: one intermediate form, all diagnostics at once.
//!
//! [`load_file`] and [`load_text`] read a `Simulation(..)` or an `Assembly(..)`, include what it
//! names, replace parameters, apply overrides, and give the flat `Spec` that the runtime
//! compiles. Everything that is wrong is reported together, each mistake at its line and column.
//!
//! Passes, in order:
//! 1. `ron_text`: text → located values.
//! 2. `form`: located values → [`Assembly`], as written.
//! 3. `expand` (`scope`, `expression`, `files`): → tree of instances with numbers.
//! 4. `flatten` (`body`, `reference`, `wires`): → parts, bindings, mechanism, wires.
//! 5. `resolved`: the same as one text that needs no other file.
//!
//! Beside them: `import` brings the bodies of URDF, MJCF and SDF files into an assembly, `sidecar` reads what such a file
//! cannot say, and `machine` writes any mechanism as an assembly ([`Assembly::from_description`]).
#![allow(non_snake_case)]

mod body;
mod builder;
mod collider;
mod collision;
mod constraints;
mod contact;
mod context;
mod expand;
mod expression;
mod files;
mod flatten;
mod form;
mod globs;
mod hinge;
mod import;
mod initial;
mod load;
mod machine;
mod modes;
mod phases;
mod place;
mod pose;
mod print;
mod read;
mod reference;
mod render;
mod resolved;
mod ron_text;
mod scope;
mod settings;
mod shape;
mod sidecar;
mod stl;
mod tree;
mod wires;

pub use builder::{IntoValue, variant};
pub use context::{Text, tidy};
pub use form::{Assembly, ItemForm, MountDecl, ParamDecl, PartForm, PartKind};
pub use globs::{match_patterns, path_matches};
pub use import::{Import, read_machine};
pub use linkwork_runtime::Value;
pub use load::{Loaded, Options, load_file, load_text};
pub use machine::Converted;
pub use place::{dotted, numbers, only, put_down, texts};
pub use render::{Failure, Look, show_faults};
pub use settings::{Figure, LogRule, Plot, Settings, Take};
pub use shape::{BodyShape, Shape};
pub use sidecar::apply_side_car;
pub use tree::{TreeKind, TreeNode};
