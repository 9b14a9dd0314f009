//! Arms, hands and legs: grasping, carrying and pressing.

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
mod mjcf_elements;
mod mjcf_sensors;
mod mjcf_touch;
mod pages;
mod starts;
