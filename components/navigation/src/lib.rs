//! Component library: navigation. Software that sees the ground, judges it, plans on it and drives.
//! ```text
//! tiles.rs     squares of cells that are made when they are touched
//! points.rs    a depth image → points in W
//! map.rs       points → moments of each cell                        TerrainMap
//! assess.rs    moments → tilt, roughness, step → goodness            Assessor
//! ground.rs    goodness, keep-out and free discs                     Ground
//! field_d_star.rs  costs → what it costs to the goal from anywhere     Planner
//! arcs.rs      goodness and that cost → votes of arcs               Arcs
//! rover.rs     all of it, sample by sample                          Rover
//! ```
#![allow(non_snake_case)]

pub mod arcs;
pub mod assess;
pub mod field_d_star;
pub mod ground;
pub mod map;
pub mod points;
pub mod rover;
pub mod tiles;
