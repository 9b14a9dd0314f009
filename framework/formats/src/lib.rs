//! Reads mechanisms from files of other programs (URDF, MJCF and SDF) and writes URDF files.
//!
//! Every reader returns a [`Description`]: bodies, hinges and nodes in a [`Builder`](linkwork_multibody::Builder), shapes, couplings, loop
//! closures, and a list of all unused contents of the file. All mistakes are reported together, each with its file, line and column.
//!
//! 1. `xml`: text → elements with their positions, each with a mark that states whether it was read.
//! 2. `urdf`, `mjcf`, `sdf`: elements → [`Description`].
//! 3. Elements that were never read become [`Description::ignored`]. `tables` lists every element and attribute of the three formats as read,
//!    rejected, or ignored with a warning; a name without an entry is reported as not part of the format.
//! 4. `mesh`: corners of STL, OBJ, COLLADA and glTF files.
//!
//! `srdf` reads names for groups of links from files of motion planners. `fmi` reads descriptions of FMI units (FMI 2.0 and 3.0), `daveml` static
//! models of aircraft and entry vehicles (DAVE-ML 2.0), and [`heights`] ground from elevation models and images. [`escaped`] makes text safe for XML
//! and HTML.
//!
//! ```
//! use linkwork_formats::{ReadOptions, Root, read_text, write_urdf};
//!
//! let text = r#"<robot name="arm">
//!   <link name="base"/>
//!   <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
//!     <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
//!   <joint name="swing" type="continuous"><parent link="base"/><child link="rod"/>
//!     <origin xyz="0 0 1"/><axis xyz="0 1 0"/></joint>
//!   <gazebo reference="rod"/>
//! </robot>"#;
//! let options = ReadOptions { root: Root::Fixed, ..ReadOptions::default() };
//! let arm = read_text(text, &options)?; // or read_file("arm.urdf", &options)
//! assert_eq!(arm.builder.build()?.nv(), 1);
//! assert_eq!(arm.coordinate("swing").map(|c| c.body), Some("rod".into()));
//! assert_eq!(arm.ignored[0].to_string(), "<text>:7: robot/gazebo: element <gazebo>");
//! let again = read_text(&write_urdf(&arm)?.text, &options)?;
//! assert_eq!(again.builder.build()?, arm.builder.build()?);
//!
//! let wrong = read_text(&text.replace("continuous", "continous"), &options);
//! assert_eq!(
//!     wrong.expect_err("no such type").to_string(),
//!     "<text>:5:23: joint `swing` has the unknown type `continous`\n  \
//!      help: did you mean `continuous`?"
//! );
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![allow(non_snake_case)]

pub mod daveml;
mod description;
mod device;
mod error;
mod export;
pub mod fmi;
mod gazebo;
mod geometry;
pub mod heights;
mod markup;
mod mesh;
mod mjcf;
mod read;
mod sdf;
mod srdf;
mod tables;
mod urdf;
mod xml;

pub use description::{
    BodyShape, CollisionClasses, CollisionMeshes, Description, Filter, Geometry, Ignored, Initial,
    Joint, Places, ShapeRole, Surface, Wheel, WheelRole,
};
pub use device::{Activation, Actuator, Device, DeviceFrame, DeviceKind, Length, Sensor, Tendon};
pub use error::{FaultKind, FileFault, FilePlace, FormatError};
pub use export::{ExportError, ExportFault, UrdfText, write_urdf};
pub use linkwork_multibody as multibody;
pub use linkwork_multibody::{Coupling, HingeCoordinate, LoopClosure, Term};
pub use linkwork_spatial as spatial;
pub use markup::escaped;
pub use mesh::{MESH_FILES, mesh_corners, mesh_corners_of};
pub use mjcf::read_mjcf;
pub use read::{
    Format, LARGEST_FILE, ReadOptions, Root, Unphysical, format_of, read_file, read_text,
    whole_file, whole_text,
};
pub use sdf::read_sdf;
pub use srdf::{Group, Srdf, read_srdf, read_srdf_file};
pub use urdf::read_urdf;
