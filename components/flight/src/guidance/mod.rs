//! Laws that say where to push: powered descent, entry, ascent, rendezvous; and where a lander is.
//!
//! Each law is a pure function with a thin model over it, so that a user's own law can take its place.

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
