//! Arms, hands and legs: what they take, carry and press.

mod errors;
mod grasp;
mod machines;
mod manipulation;
mod pages;
mod starts;
