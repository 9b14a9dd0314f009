//! Component library for rover navigation: software that maps and assesses the ground, plans paths, drives, and estimates the pose of the rover.
//! ```text
//! tiles.rs            square tiles of cells, which are allocated at first use
//! map.rs              points → moments of each cell                            TerrainMap
//! assess.rs           moments → tilt, roughness, step → goodness               Assessor
//! ground.rs           goodness, keep-out areas and free discs                  Ground
//! field_d_star.rs     cost of cells → cost to the goal from any point          Planner
//! arcs.rs             goodness and cost to the goal → votes for arcs           Arcs
//! trail.rs            path so far → move back along it                         Trail
//! rover.rs            all steps of the navigation, sample by sample            Rover
//! hazard_map.rs       goodness and planned path → overlay of viewers and logs  HazardMap
//! autonav.rs          the navigation as a part that reads a camera             navigation.autonav
//! features.rs         corners of images, tracked to the next image             Features
//! visual_odometry.rs  two image pairs → motion of the camera                   VisualOdometry
//! pose_filter.rs      wheels, gyroscopes, Sun, motions → pose, covariance      PoseFilter
//! pose_estimator.rs   visual odometry and filter as a part                     navigation.pose_estimator
//! ```
//!
//! A program adds the library with its catalogue; a file then uses a model by its name (`model: "navigation.autonav"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_navigation::catalogue()]);
//! assert!(catalogue.get("navigation.autonav").is_some());
//! ```
#![allow(non_snake_case)]

pub mod arcs;
pub mod assess;
pub mod autonav;
pub mod features;
pub mod field_d_star;
pub mod ground;
mod hazard_map;
pub mod map;
pub mod pose_estimator;
pub mod pose_filter;
pub mod rover;
pub mod tiles;
pub mod trail;
pub mod visual_odometry;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::model::<autonav::AutoNav>(), Entry::model::<pose_estimator::PoseEstimator>()]
}
