//! Rotation of planets: orientation and angular velocity over time.

mod binary_pck;
mod earth;
mod earth_parameters;
mod iau;
mod orientation;
mod pck;

pub use binary_pck::{KernelRotation, PckKernel};
pub use earth::{Earth, earth_rotation_angle, eme2000_to_gcrs, gcrs_to_itrs, teme_to_gcrs};
pub use earth_parameters::EarthParameters;
pub use iau::{IauRotation, IauTerm};
pub use orientation::EarthOrientation;
pub use pck::PckConstants;

use super::{Epoch, FrameMotion};
use crate::error::{WorldError, number};
use linkwork_spatial::{Motion, Pose, Quat, Vec3, nalgebra};
use std::f64::consts::TAU;

/// Orientation and angular velocity of a planet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spin {
    /// `R_IP`: the planet's axes to inertial axes.
    pub R_IP: Quat,
    /// ω of P in I, inertial axes, rad/s.
    pub omega_I: Vec3,
}

impl Spin {
    /// Returns the spin as a frame motion at the planet's centre.
    #[must_use]
    pub fn motion(&self) -> FrameMotion {
        FrameMotion {
            pose: Pose::rotation(self.R_IP),
            velocity: Motion::new(self.omega_I, Vec3::zeros()),
        }
    }

    /// Returns ω of P in I, in the planet's axes, rad/s.
    #[must_use]
    pub fn omega_P(&self) -> Vec3 {
        self.R_IP.inverse() * self.omega_I
    }
}

/// Rotation about a fixed axis at a constant rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedRate {
    /// `R_IP` at t = 0.
    pub R_I0: Quat,
    /// Rate about z of the planet, east positive, rad/s.
    pub rate: f64,
}

/// Returns rate · t without whole revolutions, rad; `turns` is the rate in revolutions per second. The product is computed exactly, because otherwise
/// a planet would move in steps of a micrometre after a month.
fn phase(turns: f64, t: f64) -> f64 {
    let product = turns * t;
    let rest = turns.mul_add(t, -product);
    ((product - product.round()) + rest) * TAU
}

impl FixedRate {
    /// Creates a rotation with the pole along inertial z, the prime meridian at `angle` (rad) from inertial x at t = 0, and `rate` (rad/s).
    ///
    /// # Errors
    /// The angle or rate is NaN or infinite.
    pub fn about_z(angle: f64, rate: f64) -> Result<Self, WorldError> {
        number("angle of the prime meridian, rad", angle, |_| true, "a finite angle")?;
        number("rate of rotation, rad/s", rate, |_| true, "a finite rate")?;
        Ok(Self { R_I0: about_z(angle), rate })
    }
}

/// Rotation model of a planet. `t` is in seconds of TT from the epoch of the simulation.
#[derive(Clone, Debug)]
pub enum Rotation {
    /// Fixed axis, constant rate.
    Fixed(FixedRate),
    /// Pole and prime meridian of the IAU.
    Iau(IauRotation),
    /// Rotation of the Earth by IAU 2006/2000A.
    Earth(Box<Earth>),
    /// Euler angles of a binary kernel.
    Kernel(KernelRotation),
}

impl Rotation {
    /// Returns a planet that does not rotate.
    #[must_use]
    pub fn none() -> Self {
        Self::Fixed(FixedRate { R_I0: Quat::identity(), rate: 0.0 })
    }

    /// Returns Mars at `epoch` (IAU 2009).
    #[must_use]
    pub fn mars(epoch: &Epoch) -> Self {
        Self::Iau(IauRotation::mars(epoch.tdb_days()))
    }

    /// Returns the Moon at `epoch` (IAU 2009, thirteen libration angles).
    #[must_use]
    pub fn moon(epoch: &Epoch) -> Self {
        Self::Iau(IauRotation::moon(epoch.tdb_days()))
    }

    /// Returns the spin at `t` (s). Does not allocate. Takes 20 ns for a fixed rate, 0.1 µs for Mars and for the Earth within its table, 0.3 µs for
    /// the Moon.
    #[must_use]
    pub fn at(&self, t: f64) -> Spin {
        match self {
            Self::Fixed(f) => Spin {
                R_IP: f.R_I0 * about_z(phase(f.rate / TAU, t)),
                omega_I: f.R_I0 * Vec3::z() * f.rate,
            },
            Self::Iau(iau) => iau.at(t),
            Self::Earth(earth) => earth.at(t),
            Self::Kernel(kernel) => kernel.at(t),
        }
    }
}

fn about_z(angle: f64) -> Quat {
    Quat::from_axis_angle(&nalgebra::Vector3::z_axis(), angle)
}

fn about_x(angle: f64) -> Quat {
    Quat::from_axis_angle(&nalgebra::Vector3::x_axis(), angle)
}

fn about_y(angle: f64) -> Quat {
    Quat::from_axis_angle(&nalgebra::Vector3::y_axis(), angle)
}
