//! Arms, hands and legs: what they take, carry and press.

mod balls;
mod devices;
mod driven;
mod ellipsoids;
mod errors;
mod grasp;
mod impacts;
mod loads;
mod machines;
mod manipulation;
mod pages;
mod starts;
