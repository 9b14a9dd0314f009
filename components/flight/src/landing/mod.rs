//! Touchdown: legs that crush, airbags, tipping over.

pub mod airbag;
pub mod crushable_leg;
pub mod tip_over;
