//! Component library for flight: aerodynamics from tables, files, shapes and meshes; engines, thrusters, tanks and slosh; radiation
//! pressure on panels and meshes; parachutes, balloons, airbags and landing legs; reaction wheels, control moment gyros and magnetic
//! torquers; guidance for ascent, orbit, entry and landing.
//!
//! A program adds the library with its catalogue; a file then uses a model by its name (`model: "flight.engine"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_flight::catalogue()]);
//! assert!(catalogue.get("flight.engine").is_some());
//! ```
#![allow(non_snake_case)]

pub mod aerodynamics;
pub mod attitude;
mod axis;
pub mod balloon;
pub mod capture;
pub mod drag;
pub mod engine;
pub mod guidance;
pub mod kickoff_spring;
pub mod landing;
pub mod mesh;
pub mod orbit;
pub mod parachute;
pub mod program;
pub mod propellant_tank;
pub mod propulsion;
pub mod pyro;
pub mod radiation;
pub mod recontact;
pub mod separation_spring;
pub mod table;
pub mod wired_mass;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::model::<aerodynamics::axisymmetric::Axisymmetric>(),
        Entry::model::<aerodynamics::dave::DaveAerodynamics>(),
        Entry::sized::<aerodynamics::dave_model::DaveStatic>(),
        Entry::model::<wired_mass::WiredMass>(),
        Entry::model::<aerodynamics::entry::EntryAerodynamics>(),
        Entry::model::<aerodynamics::gusts::Gusts>(),
        Entry::model::<aerodynamics::panels::PanelAerodynamics>(),
        Entry::model::<aerodynamics::rate_damping::RateDamping>(),
        Entry::model::<aerodynamics::sphere_cone_shell::SphereConeShell>(),
        Entry::model::<attitude::bank_control::BankControl>(),
        Entry::model::<attitude::control_moment_gyro::ControlMomentGyro>(),
        Entry::model::<attitude::gravity_gradient::GravityGradient>(),
        Entry::model::<attitude::magnetic::MagneticField>(),
        Entry::model::<attitude::magnetic::MagneticTorquer>(),
        Entry::model::<attitude::reaction_wheel::ReactionWheel>(),
        Entry::model::<attitude::thrust_vector::ThrustVectorControl>(),
        Entry::model::<balloon::Balloon>(),
        Entry::model::<capture::Capture>(),
        Entry::model::<drag::Drag>(),
        Entry::model::<engine::Engine>(),
        Entry::model::<guidance::approach::Glideslope>(),
        Entry::model::<guidance::approach::Transfer>(),
        Entry::model::<guidance::ascent::LinearTangent>(),
        Entry::model::<guidance::ascent_program::GravityTurn>(),
        Entry::model::<guidance::ascent_program::PitchProgram>(),
        Entry::model::<guidance::convex_descent::ConvexDescent>(),
        Entry::sized::<guidance::descent_filter::DescentFilter>(),
        Entry::model::<guidance::entry_guidance::EntryGuidance>(),
        Entry::model::<guidance::gravity_turn_descent::GravityTurnDescent>(),
        Entry::model::<guidance::ground_motion::GroundMotion>(),
        Entry::model::<guidance::ground_station::GroundStation>(),
        Entry::model::<guidance::hazard_map::HazardMap>(),
        Entry::model::<guidance::orbit_burns::OrbitBurns>(),
        Entry::model::<guidance::powered_descent::PoweredDescent>(),
        Entry::model::<guidance::rendezvous::StationKeeping>(),
        Entry::model::<guidance::terminal_descent::TerminalDescent>(),
        Entry::sized::<guidance::terrain_fix::TerrainFix>(),
        Entry::model::<guidance::thrust_direction::ThrustDirection>(),
        Entry::model::<guidance::waypoints::Waypoints>(),
        Entry::model::<kickoff_spring::KickoffSpring>(),
        Entry::model::<landing::airbag::Airbag>(),
        Entry::model::<landing::crushable_leg::CrushableLeg>(),
        Entry::model::<orbit::Orbit>(),
        Entry::model::<parachute::bridle::Bridle>(),
        Entry::model::<parachute::canopy::Canopy>(),
        Entry::model::<parachute::line::Line>(),
        Entry::model::<parachute::line_twist::LineTwist>(),
        Entry::model::<parachute::riser::Riser>(),
        Entry::model::<program::BodyLoad>(),
        Entry::model::<program::Sequence>(),
        Entry::model::<propulsion::blow_down::BlowDown>(),
        Entry::model::<propulsion::feed::Drain>(),
        Entry::model::<propulsion::feed::IdealFeed>(),
        Entry::model::<propulsion::feed_line::FeedLine>(),
        Entry::model::<propulsion::held_thruster::HeldThruster>(),
        Entry::model::<propulsion::plume::Plume>(),
        Entry::model::<propulsion::sloshing::Sloshing>(),
        Entry::model::<propulsion::solid_motor::SolidMotor>(),
        Entry::model::<propulsion::thruster::Thruster>(),
        Entry::model::<propulsion::vector_thrust::VectorThrust>(),
        Entry::model::<propellant_tank::PropellantTank>(),
        Entry::model::<pyro::Pyro>(),
        Entry::model::<radiation::panels::PanelRadiation>(),
        Entry::model::<radiation::ball::RadiationPressure>(),
        Entry::model::<recontact::Recontact>(),
        Entry::model::<separation_spring::SeparationSpring>(),
    ]
}
