//! Logs: MCAP with protobuf on every channel; reading them back; comparison; plots.
mod ballast;
mod log;
mod pictures;
mod plot;
mod read;
mod schema;

pub use log::{Log, LogError, LogSpec, logged_names};
pub use plot::{Curve, Plot, PlotError, draw};
pub use read::{
    Difference, End, Entry, LogContents, Rows, Series, Tolerances, compare, read_log,
    read_log_contents, walk_log,
};
pub use schema::{Schema, decode};
