//! Parachutes: how a canopy fills, its drag and apparent mass, and the lines that hold it.
//!
//! A canopy is a separate body of the mechanism; risers and bridles are tension-only lines between nodes, and a riser
//! may end in the legs of a bridle on a body that turns.

pub mod bridle;
pub mod canopy;
pub mod inflation;
pub mod line;
pub mod line_twist;
pub mod riser;
