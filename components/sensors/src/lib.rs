//! Component library of sensors: encoders, inertial units, attitude, pose and motion of nodes, relative motion, momentum of
//! bodies, motion of joints, touch, range finders, cameras, lidar, radar, star trackers, sun sensors, magnetometers, receivers of satellite
//! navigation, solar clocks, force-torque sensors, current sensors, and a detector of rocks under a rover. The seed of the
//! run determines the noise.
//!
//! A program adds the library with its catalogue; a file then uses a model by its name (`model: "sensors.imu"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_sensors::catalogue()]);
//! assert!(catalogue.get("sensors.imu").is_some());
//! ```

#![allow(non_snake_case)]

pub mod attitude;
pub mod camera;
pub mod contact_switch;
pub mod current;
pub mod encoder;
pub mod force_torque;
pub mod gnss;
pub mod hinge_load;
pub mod imu;
pub mod imu_increments;
pub mod inclinometer;
pub mod joint_motion;
pub mod lidar;
pub mod magnetometer;
pub mod mass_properties;
pub mod motion;
pub mod pose;
pub mod potentiometer;
pub mod radar;
pub mod range_finder;
pub mod relative_motion;
pub mod rock_overlap;
pub mod solar_clock;
pub mod specific_force;
pub mod star_tracker;
pub mod subtree;
pub mod sun_sensor;
#[cfg(test)]
mod test_ground;
pub mod touch;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::model::<attitude::Attitude>(),
        Entry::field::<camera::CameraSensor>(),
        Entry::model::<contact_switch::ContactSwitch>(),
        Entry::model::<current::Current>(),
        Entry::model::<encoder::Encoder>(),
        Entry::model::<force_torque::ForceTorque>(),
        Entry::model::<hinge_load::HingeLoadSensor>(),
        Entry::sized::<gnss::Gnss>(),
        Entry::model::<imu::Imu>(),
        Entry::model::<imu_increments::ImuIncrements>(),
        Entry::model::<inclinometer::Inclinometer>(),
        Entry::model::<joint_motion::JointMotion>(),
        Entry::sized::<lidar::LidarSensor>(),
        Entry::model::<magnetometer::Magnetometer>(),
        Entry::model::<mass_properties::MassProperties>(),
        Entry::model::<motion::Motion>(),
        Entry::model::<pose::PoseSensor>(),
        Entry::model::<potentiometer::Potentiometer>(),
        Entry::sized::<radar::Radar>(),
        Entry::sized::<range_finder::RangeFinder>(),
        Entry::model::<relative_motion::RelativeMotion>(),
        Entry::sized::<rock_overlap::RockOverlap>(),
        Entry::model::<solar_clock::SolarClock>(),
        Entry::model::<specific_force::SpecificForce>(),
        Entry::model::<star_tracker::StarTracker>(),
        Entry::sized::<subtree::Subtree>(),
        Entry::model::<sun_sensor::SunSensor>(),
        Entry::sized::<touch::Touch>(),
    ]
}
