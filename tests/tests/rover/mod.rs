//! Rovers on slopes, soils, rocks and bodies, with forces and with kinematics, with autonomous navigation.

mod arm;
mod autonav;
mod bodies;
mod drive_stops;
mod flat_battery;
mod ground;
mod kinematic;
mod localisation;
mod navigation;
mod obstacles;
mod parked;
mod quasi_static;
mod rocky8;
mod ruts;
mod scenes;
mod scm;
mod sol;
mod steps;
mod strut;
mod symmetry;
mod terrain_navigation;
mod tiled_terrain;
mod vehicles;
mod wheel_rig;
mod wheels;
