//! Planets as bodies: shape, rotation, time, and moving frames.

mod bodies;
mod ellipsoid;
mod epoch;
mod motion;
mod orbital;
pub mod rotation;
mod site;

pub use bodies::*;
pub use ellipsoid::{Ellipsoid, Geodetic, geocentric_latitude};
pub use epoch::{Epoch, JD_J2000, tdb_minus_tt};
pub use motion::{FrameMotion, PointMotion, apparent_acceleration};
pub use orbital::{OrbitalAxes, orbital_frame};
pub use rotation::{Rotation, Spin};
pub use site::Site;
