//! Scene, stream and blueprint for the Rerun viewer. Entity paths are the paths of the assembly.
//!
//! The viewer reads the samples of a recorder and never changes the run. Without the feature `viewer`, the crate contains only the description of the
//! scene and does not build Rerun.
#[cfg(feature = "viewer")]
mod batch;
#[cfg(feature = "viewer")]
mod external;
#[cfg(feature = "viewer")]
mod eye;
#[cfg(feature = "viewer")]
mod ground;
#[cfg(feature = "viewer")]
mod layers;
#[cfg(feature = "viewer")]
mod layout;
#[cfg(feature = "viewer")]
mod pictures;
#[cfg(feature = "viewer")]
mod planet;
#[cfg(feature = "viewer")]
mod player;
#[cfg(feature = "viewer")]
mod read;
mod scene;
#[cfg(feature = "viewer")]
mod shapes;
#[cfg(feature = "viewer")]
mod strands;
#[cfg(feature = "viewer")]
mod stream;
#[cfg(feature = "viewer")]
mod terrain;
#[cfg(feature = "viewer")]
mod trail;
#[cfg(feature = "viewer")]
mod viewer;

#[cfg(feature = "viewer")]
pub use external::ExternalData;
#[cfg(feature = "viewer")]
pub use player::{NotShown, Player};
#[cfg(feature = "viewer")]
pub use read::{RecordedSeries, read_recording};
pub use scene::{Arrow, End, InUnit, Line, Marker, Panel, Planet, Plume, Scene, Shape};
#[cfg(feature = "viewer")]
pub use stream::VizError;
#[cfg(feature = "viewer")]
pub use viewer::{View, Viewer};
