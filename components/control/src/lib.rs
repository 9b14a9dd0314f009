//! Component library of control software: steering, waypoint following, hinge controllers, odometry, attitude control, jet selection,
//! plans of activities.
//!
//! A program adds the library with its catalogue; a file then uses a model by its name (`model: "control.pointing"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_control::catalogue()]);
//! assert!(catalogue.get("control.pointing").is_some());
//! ```

pub mod ackermann;
pub mod attitude;
pub mod drive_monitor;
pub mod follower;
pub mod geometry;
pub mod odometry;
pub mod pid;
pub mod plan;
pub mod plan_settings;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::sized::<ackermann::Ackermann>(),
        Entry::model::<attitude::estimator::AttitudeFilter>(),
        Entry::sized::<attitude::jets::JetSelection>(),
        Entry::model::<attitude::momentum::Desaturation>(),
        Entry::model::<attitude::momentum::WheelDistribution>(),
        Entry::model::<attitude::phase_plane::PhasePlane>(),
        Entry::model::<attitude::phase_plane::PulseWidth>(),
        Entry::model::<attitude::pointing::Pointing>(),
        Entry::sized::<attitude::throttles::Throttles>(),
        Entry::sized::<drive_monitor::DriveMonitor>(),
        Entry::model::<follower::Follower>(),
        Entry::model::<pid::RateController>(),
        Entry::model::<pid::PositionController>(),
        Entry::sized::<odometry::Odometry>(),
        Entry::sized::<plan::Plan>(),
    ]
}
