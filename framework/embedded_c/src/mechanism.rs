//! Mechanisms without a file: bodies on hinges, of the robot or on objects, and limits.

use crate::builder::{Draft, LwBuilder};
use crate::call::calls;
use crate::edge::{LwPose, value};
use crate::mass_properties::mass_of;
use crate::status::Fault;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, HingeCoordinate, Limits};
use linkwork_embedded::spatial::Vec3;

/// The body is welded to its parent.
pub const LW_HINGE_LOCKED: u32 = 0;
/// Rotation about `axis`: 1 number of q, rad.
pub const LW_HINGE_PIN: u32 = 1;
/// Translation along `axis`: 1 number of q, m.
pub const LW_HINGE_SLIDER: u32 = 2;
/// Rotation about `axis` with an advance along it of `pitch`: 1 number of q, rad.
pub const LW_HINGE_SCREW: u32 = 3;
/// Translation along `axis` and rotation about it: 2 numbers of q, m and rad.
pub const LW_HINGE_CYLINDRICAL: u32 = 4;
/// Rotation about `axis`, then about `second`, which moves with the body: 2 numbers of q, rad.
pub const LW_HINGE_UNIVERSAL: u32 = 5;
/// Rotation about the moving x, y and z axes: 3 numbers of q, rad.
pub const LW_HINGE_GIMBAL: u32 = 6;
/// Translation along x and y, then rotation about z: 3 numbers of q, m and rad.
pub const LW_HINGE_PLANAR: u32 = 7;
/// Any rotation: 4 numbers of q, a quaternion x y z w, and 3 degrees of freedom.
pub const LW_HINGE_BALL: u32 = 8;
/// Any motion: 7 numbers of q, position and quaternion, and 6 degrees of freedom.
pub const LW_HINGE_FREE: u32 = 9;

/// Hinge between a body and its parent. Unused fields must be zero.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwHinge {
    /// One of `LW_HINGE_...`.
    pub kind: u32,
    /// Axis of a pin, slider, screw, cylindrical or universal hinge, of any length except zero, in the hinge's frame.
    pub axis: [f64; 3],
    /// The second axis of a universal hinge, of any length except zero.
    pub second: [f64; 3],
    /// Pitch of a screw, m/rad.
    pub pitch: f64,
}

impl LwHinge {
    fn checked(&self) -> Result<Hinge, Fault> {
        let [axis, second] = [self.axis, self.second].map(Vec3::from);
        let (hinge, [turns, crosses, advances]) = match self.kind {
            LW_HINGE_LOCKED => (Hinge::locked(), [false; 3]),
            LW_HINGE_PIN => (Hinge::pin(axis), [true, false, false]),
            LW_HINGE_SLIDER => (Hinge::slider(axis), [true, false, false]),
            LW_HINGE_SCREW => (Hinge::screw(axis, self.pitch), [true, false, true]),
            LW_HINGE_CYLINDRICAL => (Hinge::cylindrical(axis), [true, false, false]),
            LW_HINGE_UNIVERSAL => (Hinge::universal(axis, second), [true, true, false]),
            LW_HINGE_GIMBAL => (Hinge::gimbal(), [false; 3]),
            LW_HINGE_PLANAR => (Hinge::planar(), [false; 3]),
            LW_HINGE_BALL => (Hinge::ball(), [false; 3]),
            LW_HINGE_FREE => (Hinge::free(), [false; 3]),
            value => return Err(Fault::Choice { what: "kind", value, help: "one of LW_HINGE_.." }),
        };
        let zero = |x: &[f64]| x.iter().all(|x| *x == 0.0);
        let unused = [
            ("axis", turns || zero(&self.axis)),
            ("second", crosses || zero(&self.second)),
            ("pitch", advances || self.pitch == 0.0),
        ];
        match unused.iter().find(|u| !u.1) {
            None => Ok(hinge),
            Some((what, _)) => Err(Fault::Model(format!(
                "hinge {} does not use `{what}`\n  help: set the unused fields to zero",
                self.kind
            ))),
        }
    }
}

/// # Safety
/// The conditions in the crate documentation apply.
unsafe fn body_of(
    [name, parent]: [&str; 2],
    (hinge, at): (*const LwHinge, *const LwPose),
    (mass, center, inertia): (f64, *const f64, *const f64),
) -> Result<BodySpec, Fault> {
    // SAFETY: guaranteed by the caller.
    unsafe {
        let hinge = match hinge.is_null() {
            true => Hinge::locked(),
            false => value("hinge", hinge)?.checked()?,
        };
        let mass = mass_of(mass, center, inertia)?;
        let mut body = BodySpec::new(name, parent);
        body = body.hinge(hinge).mass(mass);
        if !at.is_null() {
            body = body.hinge_in_parent(value("at", at)?.checked()?);
        }
        Ok(body)
    }
}

impl Draft {
    /// Adds a body of the robot. A hinge with one degree of freedom is a joint with the body's name.
    fn body(&mut self, body: BodySpec) -> Result<(), Fault> {
        if body.hinge.nv() == 1 {
            let to = HingeCoordinate { body: body.name.clone(), subhinge: 0 };
            if let Some(other) = self.spec.joints.get(&body.name) {
                let text = format!(
                    "the name of body `{}` is already the name of a joint, which moves body `{}`\n  help: rename the body",
                    body.name, other.body
                );
                return Err(Fault::Model(text));
            }
            self.spec.joints.insert(body.name.clone(), to);
        }
        self.spec.mechanism.body(body);
        Ok(())
    }

    fn limits(&mut self, name: &str, limits: Limits) -> Result<(), Fault> {
        let all = |b: &mut Builder| {
            b.bodies_mut().iter_mut().find(|b| b.name == name).map(|b| {
                b.hinge = b.hinge.clone().limits(limits);
            })
        };
        let spec = &mut self.spec;
        let found = all(&mut spec.mechanism).or_else(|| all(&mut spec.linkages));
        found.ok_or_else(|| {
            let help = "add the body first, with `lw_builder_robot_file`, `lw_builder_body` or `lw_builder_object_body`";
            Fault::Unknown(format!("there is no body `{name}`\n  help: {help}"))
        })
    }
}

calls![
    /// Adds a body of the robot, connected to `parent` (a body, or "world") by `hinge` (NULL: welded) at the pose `at` in the parent's frame (NULL: at
    /// its origin). The hinge is at the body's origin. Mass properties as in `lw_builder_object`; a body with zero mass, centre and inertia is a frame.
    /// With such bodies a robot needs no file; after a file they are added to its bodies. A hinge with one degree of freedom is found with
    /// `lw_model_joint` under the body's name, every hinge with `lw_model_hinge`.
    fn lw_builder_body(
        d: &mut LwBuilder,
        name: &str,
        parent: &str,
        hinge: *const LwHinge,
        at: *const LwPose,
        mass: f64,
        center: *const f64,
        inertia: *const f64,
    ) {
        d.body(body_of([name, parent], (hinge, at), (mass, center, inertia))?)?;
    }

    /// Adds a body that hangs on an object, or on another such body (`parent`), by `hinge` (NULL: welded) at the pose `at` in the parent's frame (NULL:
    /// at its origin). The hinge is at the body's origin. Mass properties as in `lw_builder_object`. `lw_model_object_hinge` returns the indices of its
    /// coordinates.
    fn lw_builder_object_body(
        d: &mut LwBuilder,
        name: &str,
        parent: &str,
        hinge: *const LwHinge,
        at: *const LwPose,
        mass: f64,
        center: *const f64,
        inertia: *const f64,
    ) {
        let body = body_of([name, parent], (hinge, at), (mass, center, inertia))?;
        d.spec.linkages.body(body);
    }

    /// Sets the limits of each pin, slider and screw in the hinge of a body that was added before: smallest and largest coordinate, rad or m; largest
    /// rate, rad/s or m/s; largest effort, N m or N. Infinite for no limit. They replace limits of the file.
    fn lw_builder_limits(
        d: &mut LwBuilder,
        body: &str,
        lower: f64,
        upper: f64,
        rate: f64,
        effort: f64,
    ) {
        d.limits(body, Limits { lower, upper, rate, effort })?;
    }
];
