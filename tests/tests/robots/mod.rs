//! Arms, hands and legs: what they take, carry and press.

mod grasp;
mod machines;
mod manipulation;
