//! Poses of an MJCF file: `pos` and an orientation in one of five forms.

use super::defaults::ORIENTATIONS;
use super::{Classed, Mj, Settings};
use crate::error::FaultKind;
use crate::read::Cx;
use linkwork_spatial::nalgebra::{Quaternion, Unit};
use linkwork_spatial::{Pose, Quat, Vec3};

impl<'e> Mj<'e> {
    /// Reads `pos` and the orientation in any form.
    pub(super) fn pose(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str) -> Pose {
        let p = self.numbers::<3>(cx, at, "pos", what).unwrap_or_default();
        Pose::new(self.rotation(cx, at, what).unwrap_or_else(Quat::identity), Vec3::from(p))
    }

    /// Returns the form in which the orientation is written, by the element or else by its class.
    fn orientation(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str) -> Option<&'static str> {
        let own = |name: &&str| at.e.attributes.iter().any(|a| a.name == **name);
        let mut forms = ORIENTATIONS.into_iter().filter(own);
        let first = forms.next();
        if let (Some(one), Some(two)) = (first, forms.next()) {
            let what = format!("{what} has `{one}` and `{two}`");
            let help = "write the orientation in one form".to_owned();
            cx.fault(at.e.place(), FaultKind::Unsupported { what, help });
        }
        let of_class = |name: &&str| self.classes.holder(at.class, at.kind, name).is_some();
        let mut inherited = None;
        for name in ORIENTATIONS.into_iter().filter(of_class) {
            self.attr(at, name); // mark every form in the class as read
            inherited = inherited.or(Some(name));
        }
        first.or(inherited)
    }

    fn rotation(&self, cx: &mut Cx<'_>, at: Classed<'e>, what: &str) -> Option<Quat> {
        let form = self.orientation(cx, at, what)?;
        let unit = |cx: &mut Cx<'_>, n: Vec3| {
            let (text, place) = self.attr(at, form)?;
            cx.unit(place, n, text, &format!("{what}: `{form}`"))
        };
        match form {
            "quat" => {
                let numbers = self.numbers::<4>(cx, at, form, what)?;
                self.quaternion(cx, at, numbers, what)
            }
            "axisangle" => {
                let [x, y, z, a] = self.numbers::<4>(cx, at, form, what)?;
                let n = unit(cx, Vec3::new(x, y, z))?;
                Some(Quat::from_axis_angle(&Unit::new_unchecked(n), a * self.of(at.e).angle))
            }
            "euler" => {
                self.numbers::<3>(cx, at, form, what).map(|e| turn_of_euler(self.of(at.e), e))
            }
            "xyaxes" => {
                let [a, b, c, d, e, f] = self.numbers::<6>(cx, at, form, what)?;
                let (x, y) = (unit(cx, Vec3::new(a, b, c))?, Vec3::new(d, e, f));
                let y = unit(cx, y - x * x.dot(&y))?;
                Some(Quat::from_basis_unchecked(&[x, y, x.cross(&y)]))
            }
            _ => {
                let z = Vec3::from(self.numbers::<3>(cx, at, form, what)?);
                unit(cx, z).map(|z| turn_of_z(&z))
            }
        }
    }

    fn quaternion(
        &self,
        cx: &mut Cx<'_>,
        at: Classed<'e>,
        [w, x, y, z]: [f64; 4],
        what: &str,
    ) -> Option<Quat> {
        let raw = Quaternion::new(w, x, y, z);
        let n = raw.coords.amax();
        if (1e-100..=1e100).contains(&n) {
            // Do not change the digits of a unit quaternion.
            let exact = raw.norm() == 1.0;
            return Some(if exact {
                Unit::new_unchecked(raw)
            } else {
                Quat::new_normalize(raw / n)
            });
        }
        let (text, place) = self.attr(at, "quat").unwrap_or(("", at.e.place()));
        let (expected, help) = ("a nonzero quaternion", "write w x y z, for example 1 0 0 0");
        cx.bad(place, &format!("{what}: `quat`"), text, expected, help);
        None
    }
}

/// Returns the rotation of three angles, in the file's unit, about the axes of `eulerseq`.
pub(super) fn turn_of_euler(settings: &Settings, angles: [f64; 3]) -> Quat {
    let mut q = Quat::identity();
    for ((axis, moving), angle) in settings.euler.iter().zip(angles) {
        let turn = Quat::from_scaled_axis(axis * (angle * settings.angle));
        q = if *moving { q * turn } else { turn * q };
    }
    q
}

/// Returns the smallest rotation from z to a unit vector; half a turn about x for −z.
pub(super) fn turn_of_z(z: &Vec3) -> Quat {
    let half_turn = || Quat::from_scaled_axis(Vec3::x() * std::f64::consts::PI);
    Quat::rotation_between(&Vec3::z(), z).unwrap_or_else(half_turn)
}
