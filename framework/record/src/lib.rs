//! Logs: MCAP with protobuf on every channel; reading them back; comparison; plots.
mod ballast;
mod log;
mod plot;
mod read;
mod schema;

pub use ballast::Ballast;
pub use log::{Log, LogError, LogSpec};
pub use plot::{Curve, Plot, PlotError, draw};
pub use read::{Difference, Series, compare, read_log};
pub use schema::{Schema, decode};
