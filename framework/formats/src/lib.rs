//! Mechanisms from the files of other programs: URDF, MJCF and SDF; and URDF export.
//!
//! Every reader gives a [`Description`]: bodies, hinges and nodes ready to [build](linkwork_multibody::Builder::build),
//! shapes, couplings, loop closures, and a list of everything in the file that was not used.
//! Whatever is wrong is reported together, each mistake at its file, line and column.
//!
//! 1. `xml`: text → elements with places, which remember whether they were read.
//! 2. `urdf`, `mjcf`, `sdf`: elements → [`Description`].
//! 3. what was never read → [`Description::ignored`].
#![allow(non_snake_case)]

mod description;
mod error;
mod export;
mod geometry;
mod mesh;
mod mjcf;
mod names;
mod read;
mod sdf;
mod urdf;
mod xml;

pub use description::{
    BodyShape, Coupling, Description, Geometry, HingeCoordinate, Ignored, Initial, Joint,
    LoopClosure, ShapeRole, Term, Wheel, WheelRole,
};
pub use error::{Fault, FaultKind, FormatError, Place};
pub use export::{ExportError, ExportFault, UrdfText, write_urdf};
pub use linkwork_multibody as multibody;
pub use linkwork_spatial as spatial;
pub use mjcf::read_mjcf;
pub use read::{Format, ReadOptions, Root, format_of, read_file, read_text};
pub use sdf::read_sdf;
pub use urdf::read_urdf;
