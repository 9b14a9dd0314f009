//! Component library: navigation. Software that sees the ground, judges it, plans on it and drives.
//! ```text
//! tiles.rs     squares of cells that are made when they are touched
//! points.rs    a depth image → points in W
//! map.rs       points → moments of each cell                        TerrainMap
//! assess.rs    moments → tilt, roughness, step → goodness            Assessment
//! ```
#![allow(non_snake_case)]

pub mod assess;
pub mod field_d_star;
pub mod map;
pub mod points;
pub mod tiles;
