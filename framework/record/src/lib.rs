//! Logs: MCAP with protobuf on every channel; reading them back; comparison; plots.
mod ballast;
mod log;
mod plot;
mod read;
mod schema;

pub use log::{Log, LogError, LogSpec};
pub use plot::{Curve, Plot, PlotError, draw};
pub use read::{
    Difference, End, LogContents, Rows, Series, Tolerances, compare, read_log, read_log_contents,
};
pub use schema::{Schema, decode};
