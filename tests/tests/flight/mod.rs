//! Flight: orbits, entries, landings, ascents and rendezvous compared with results of independent programs.

mod ascent;
mod asteroid;
mod balloon;
mod capsule_landing;
mod cases;
mod check_cases;
mod dave_files;
mod descent;
mod entry;
mod ephemeris;
#[path = "../../common/kernel.rs"]
mod kernel;
mod lunar_landing;
mod missions;
mod notices;
mod one_world;
mod orders;
mod parting;
mod refusals;
mod rendezvous;
mod reviewed;
mod site;
mod site_spacecraft;
mod spacecraft;
mod stops;
mod strapdown;
mod surroundings;
mod thrusters;
mod touch_and_go;
mod trajectories;
mod turning;
mod variants;
