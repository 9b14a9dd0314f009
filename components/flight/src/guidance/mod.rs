//! Guidance laws for powered descent, entry, ascent and rendezvous, and navigation of landers.
//!
//! Each law is a pure function, and a thin model calls it, so that users can replace it by their own law.

pub mod approach;
pub mod ascent;
pub mod ascent_program;
pub mod convex;
pub mod convex_descent;
pub mod descent_filter;
pub mod entry;
pub mod entry_guidance;
pub mod gravity_turn_descent;
pub mod ground_motion;
pub mod ground_station;
pub mod hazard_map;
pub mod orbit_burns;
pub mod planet;
pub mod powered_descent;
pub mod rendezvous;
pub mod terminal_descent;
pub mod terrain_fix;
#[cfg(test)]
pub(crate) mod test_soil;
pub mod thrust_direction;
pub mod waypoints;
