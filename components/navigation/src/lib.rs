//! Component library: navigation. Software that sees the ground, judges it, plans on it and drives, and that finds out where it is.
//! ```text
//! tiles.rs     squares of cells that are made when they are touched
//! map.rs       points → moments of each cell                        TerrainMap
//! assess.rs    moments → tilt, roughness, step → goodness            Assessor
//! ground.rs    goodness, keep-out and free discs                     Ground
//! field_d_star.rs  costs → what it costs to the goal from anywhere     Planner
//! arcs.rs      goodness and that cost → votes of arcs               Arcs
//! trail.rs     where it has been → the move back along it            Trail
//! rover.rs     all of it, sample by sample                          Rover
//! hazard_map.rs  goodness and plan → what viewers and logs show       HazardMap
//! autonav.rs   the same as a part that reads a camera               navigation.autonav
//! features.rs  corners of images, and where they are in the next       Features
//! visual_odometry.rs  two pictures → how the camera moved              VisualOdometry
//! pose_filter.rs  wheels, gyroscopes, Sun, motions → pose, covariance  PoseFilter
//! pose_estimator.rs  both as a part                                   navigation.pose_estimator
//! ```
//! A program takes it by its catalogue, and a file names its models (`model: "navigation.autonav"`):
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
