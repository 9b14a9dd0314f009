//! Component library: control. Steering, waypoint following, hinge controllers, odometry.

pub mod ackermann;
pub mod follower;
pub mod geometry;
pub mod odometry;
pub mod pid;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::model::<ackermann::Ackermann>(),
        Entry::model::<follower::Follower>(),
        Entry::model::<pid::RateController>(),
        Entry::model::<pid::PositionController>(),
        Entry::model::<odometry::Odometry>(),
    ]
}
