//! Frames that move with an orbit.

use super::FrameMotion;
use crate::error::WorldError;
use linkwork_spatial::{Mat3, Motion, Pose, Vec3, quat};

/// Axes of a frame that moves with an orbit; h = r × v, and a hat denotes a unit vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrbitalAxes {
    /// Local vertical, local horizontal: z = −r̂ (nadir), y = −ĥ, x = y × z (along the motion).
    Lvlh,
    /// Radial, transverse, normal: x = r̂, z = ĥ, y = z × x. Also called RSW, RIC.
    Rtn,
    /// Velocity, normal, co-normal: x = v̂, y = ĥ, z = x × y.
    Vnc,
}

/// Returns the frame O of an orbit in inertial axes I. Its origin is the satellite; its axes follow position `r` (m) and velocity `v` (m/s). The
/// acceleration `a` (m/s²) contributes to the rotation of the axes. ω_IO = ½ Σ e × ė over the three axes, with ė of r̂, v̂, ĥ by the quotient rule, ḣ
/// = r × a.
///
/// # Errors
/// Position and velocity are parallel, or one of them is zero.
pub fn orbital_frame(
    axes: OrbitalAxes,
    r: &Vec3,
    v: &Vec3,
    a: &Vec3,
) -> Result<FrameMotion, WorldError> {
    let h = r.cross(v);
    if !(h.norm() > 1e-12 * r.norm() * v.norm()) {
        return Err(WorldError::NoPlane { position: (*r).into(), velocity: (*v).into() });
    }
    let (w, dw) = unit(&h, &r.cross(a));
    let (x, y, z) = match axes {
        OrbitalAxes::Lvlh => {
            let (n, dn) = unit(r, v);
            let (y, z) = ((-w, -dw), (-n, -dn));
            (cross(&y, &z), y, z)
        }
        OrbitalAxes::Rtn => {
            let x = unit(r, v);
            (x, cross(&(w, dw), &x), (w, dw))
        }
        OrbitalAxes::Vnc => {
            let x = unit(v, a);
            (x, (w, dw), cross(&x, &(w, dw)))
        }
    };
    let R = Mat3::from_columns(&[x.0, y.0, z.0]);
    let omega = (x.0.cross(&x.1) + y.0.cross(&y.1) + z.0.cross(&z.1)) * 0.5;
    Ok(FrameMotion { pose: Pose::new(quat(&R), *r), velocity: Motion::new(omega, *v) })
}

/// A unit vector and its derivative.
type Axis = (Vec3, Vec3);

fn unit(x: &Vec3, dx: &Vec3) -> Axis {
    let n = x.norm();
    let e = x / n;
    (e, (dx - e * e.dot(dx)) / n)
}

fn cross(a: &Axis, b: &Axis) -> Axis {
    (a.0.cross(&b.0), a.1.cross(&b.0) + a.0.cross(&b.1))
}
