//! A run from file to end, as one library: load → compile → place → taps → run → stop.
//!
//! The command line and the Python package are thin programs on it, so that a run means the same
//! in both. There is one time loop, [`Runner::go`]:
//! ```text
//! at each tick:   calls due → watcher → rows of the taps → checkpoint due → stop? → step
//! ```
//! What a row shows is therefore what a call has set, and a checkpoint comes after the rows of its
//! tick. Nothing in the loop but the step and the calls changes the state (rule 6 of ARCHITECTURE.md).
//!
//! | module | what it holds |
//! |---|---|
//! | `prepare` | every name of the file looked up, all mistakes at once |
//! | `recording` | variables of a run over time, in memory |
//! | `run` | the loop, with its taps |
//! | `change` | variables set and pinned while it runs |
//! | `saves` | when checkpoints are written, their names, what they carry |
//! | `folder` | the folder of a run: one run at a time, nothing of another run in the way |
//! | `balance` | balances of energy, mass and charge, integrated during a run |
//! | `figures` | a simulation's own figures, in fixed memory |
//! | `built` | what built the program, for logs, checkpoints and summaries |
//! | `pace` | as fast as real time, or a multiple of it; how late ticks were |
//!
//! Viewers are taps that the program hands in; this crate knows none.
mod balance;
mod built;
mod change;
mod figures;
mod folder;
mod pace;
mod prepare;
mod recording;
mod run;
mod saves;

pub use balance::{Balance, Balances, Part as PartBalance, Report};
pub use built::built;
pub use change::{assignment, changed};
pub use figures::{Figures, Tracked};
pub use folder::{Folder, FolderError};
pub use linkwork_assembly::{Library, Ready, Shared, sim_file};
pub use pace::{Lateness, Pace, Realtime, SystemClock, WallClock};
pub use prepare::{Prepared, log_rules, prepare};
pub use recording::{Columns, Recording};
pub use run::{Ended, Goal, Need, Pause, Runner, Stop, TapEnd, Watch, tap_entry};
pub use saves::{BUILT, Extra, Saves, signal_names, time_name};
