//! Two-body orbits: propagation, elements, and motion near a circular orbit; two-line elements and orbit ephemeris messages.

mod clohessy_wiltshire;
mod elements;
mod oem;
mod two_body;
mod two_line;

pub use clohessy_wiltshire::{ClohessyWiltshire, Relative};
pub use elements::Elements;
pub use oem::{Segment, read_oem};
pub use two_body::propagate;
pub use two_line::TwoLine;
