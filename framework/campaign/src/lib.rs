//! Campaigns: many runs of one simulation, with values drawn from distributions.
//!
//! ```text
//! file → draws of run r → load → one loop (linkwork_runner) → metrics → journal → tables, statistics, report
//! ```
//! A run is a pure function of the campaign's file and its number: draws come from counters, keyed by (seed, run,
//! path), so that neither the order of runs, nor threads, nor a kill in between leave a trace in the results.
//!
//! | module | what it holds |
//! |---|---|
//! | `form` | the file as read, every mistake at its place |
//! | `distribution`, `correlation`, `sampling` | quantiles, the factor of a matrix of correlations, numbers in (0, 1) |
//! | `campaign` | what each run is made from |
//! | `one` | one run: its number → its outcome, and what a failure leaves |
//! | `execute` | threads |
//! | `histories` | what every run keeps of its way, and bands over time |
//! | `folder` | the folder of a campaign: journal, failures, tables, report |
//! | `outcome`, `journal` | how a run ended; the file that survives a kill |
//! | `statistics`, `results` | summaries, rank correlations, ellipses; CSV and Parquet |
//! | `svg`, `report` | the page |
mod campaign;
mod correlation;
mod distribution;
mod execute;
mod folder;
mod form;
mod histories;
mod journal;
mod one;
mod outcome;
mod report;
mod results;
mod sampling;
mod statistics;
mod svg;

pub use campaign::{Aim, Campaign, LoadError};
pub use correlation::CorrelationError;
pub use distribution::Distribution;
pub use execute::{CampaignError, Orders, Progress, execute};
pub use folder::{Folder, FolderError};
pub use form::{Bound, Drawn, Form, Noise, Requirement, Retain, schema};
pub use histories::{BAND, Band, Retained};
pub use journal::{Journal, JournalError};
pub use one::{Begun, MakeError, Means, Under, Watched, end, one};
pub use outcome::{Cause, Outcome};
pub use report::page;
pub use results::{Column, Missed, Results, Table, few};
pub use sampling::Sampling;
pub use statistics::{Ellipse, Summary, rank_correlation};
