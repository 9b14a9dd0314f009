//! Campaigns: many runs of one simulation, with parameters that are sampled from distributions.
//!
//! ```text
//! file → draws of run r → load → one loop (linkwork_runner) → metrics → journal → tables, statistics, report
//! ```
//! A run is a pure function of the campaign's file and the run's number: sampled values are counter-based random numbers with the key (seed, run, path). Results
//! therefore do not depend on the order of runs, threads, or interruptions.
//!
//! | module | content |
//! |---|---|
//! | `form` | the parsed campaign file; every error is reported with its position in the file |
//! | `distribution`, `correlation`, `sampling` | quantile functions, factorization of a correlation matrix, numbers in (0, 1) |
//! | `campaign` | the configuration of each run |
//! | `one` | one run, from its number to its result, and the files of a failed run |
//! | `execute` | threads |
//! | `histories` | retained time histories, and percentile bands over time |
//! | `folder` | the folder of a campaign: journal, failures, tables, report |
//! | `outcome`, `journal` | the result of a run; the file of finished runs, which survives a killed process |
//! | `statistics`, `results` | summaries, rank correlations, ellipses; CSV and Parquet |
//! | `svg`, `report` | the report |
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
pub use results::{Column, Footprint, Missed, PROBABILITY, Results, Table, few};
pub use sampling::Sampling;
pub use statistics::{Ellipse, Summary, rank_correlation};
