//! Subproblems of closed-form inverse kinematics: rotations about one or two axes that satisfy one equation each.
//!
//! The decomposition follows Paden (1985) and Kahan, in the form of Elias and Wen (2022), "IK-Geo". Axes have length 1, angles are in radians. If a
//! solution is missed only because of round-off, the nearest angle is returned; the caller checks the pose.

use linkwork_spatial::Vec3;
use std::f64::consts::PI;

/// Largest round-off error of a cosine beyond ±1.
const ROUNDING: f64 = 1e-9;
/// A cosine that is closer to ±1 than this counts as ±1.
const DOUBLE: f64 = 1e-15;
/// Vectors shorter than this, relative to their scale, have no direction.
const TINY: f64 = 1e-10;

/// Zero, one or two angles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Angles {
    all: [f64; 2],
    count: usize,
}

impl Angles {
    fn none() -> Self {
        Self::default()
    }

    pub(super) fn one(a: f64) -> Self {
        Self { all: [a, 0.0], count: 1 }
    }

    fn two(a: f64, b: f64) -> Self {
        Self { all: [a, b], count: 2 }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = f64> + use<> {
        self.all.into_iter().take(self.count)
    }
}

/// Rotates `v` about `h`.
pub(super) fn turned(h: &Vec3, angle: f64, v: &Vec3) -> Vec3 {
    let (s, c) = angle.sin_cos();
    v * c + h.cross(v) * s + h * (h.dot(v) * (1.0 - c))
}

/// Returns the angle about `h` that rotates the projection of `a` perpendicular to `h` to that of `b`; `free` if `a` is parallel to `h`.
pub(super) fn onto(h: &Vec3, a: &Vec3, b: &Vec3, free: f64) -> f64 {
    let across = a - h * h.dot(a);
    if across.norm() <= TINY * a.norm() || a.norm() == 0.0 {
        return free;
    }
    h.dot(&across.cross(b)).atan2(across.dot(b))
}

/// Returns angles about `h` with `k · R a = d`; `free` if the angle has no effect.
pub(super) fn height(h: &Vec3, k: &Vec3, a: &Vec3, d: f64, free: f64) -> Angles {
    let (cosine, sine) = (k.dot(&(a - h * h.dot(a))), k.dot(&h.cross(a)));
    let (r, scale) = (cosine.hypot(sine), k.norm() * a.norm());
    let rest = d - k.dot(h) * h.dot(a);
    if r <= TINY * scale || r == 0.0 {
        return if rest.abs() <= ROUNDING * scale { Angles::one(free) } else { Angles::none() };
    }
    let (middle, c) = (sine.atan2(cosine), rest / r);
    if c.abs() > 1.0 + ROUNDING * (scale / r) {
        return Angles::none();
    }
    // If both solutions coincide up to round-off, return only one: an arc cosine would turn an error of 1e-16 into an angle of 1e-8.
    if 1.0 - c.abs() < DOUBLE {
        return Angles::one(if c > 0.0 { middle } else { middle + PI });
    }
    let half = c.acos();
    Angles::two(middle + half, middle - half)
}

/// Returns angles about `h` with `|R a + b| = d`; `free` if the angle has no effect.
pub(super) fn distance(h: &Vec3, a: &Vec3, b: &Vec3, d: f64, free: f64) -> Angles {
    height(h, b, a, 0.5 * (d * d - a.norm_squared() - b.norm_squared()), free)
}

/// Returns pairs of angles about `h1` and `h2` with `R₁ R₂ v = u`; `free` for an axis that is parallel to its vector.
pub(super) fn through_both(
    (h1, h2): (&Vec3, &Vec3),
    (v, u): (&Vec3, &Vec3),
    free: [f64; 2],
) -> impl Iterator<Item = [f64; 2]> + use<> {
    let c = h1.dot(h2);
    let n = h1.cross(h2);
    let s2 = n.norm_squared();
    let (x, y) = (h1.dot(u), h2.dot(v));
    let (a, b) = ((x - c * y) / s2, (y - c * x) / s2);
    let left = v.norm_squared() - a * a - b * b - 2.0 * a * b * c;
    let scale = v.norm_squared();
    let off = (left.max(0.0) / s2).sqrt();
    let sides = match () {
        () if left < -ROUNDING * scale => Angles::none(),
        () if off == 0.0 => Angles::one(0.0),
        () => Angles::two(off, -off),
    };
    let (h1, h2, v, u) = (*h1, *h2, *v, *u);
    sides.iter().map(move |side| {
        let w = h1 * a + h2 * b + n * side;
        [onto(&h1, &w, &u, free[0]), onto(&h2, &v, &w, free[1])]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(x: f64, y: f64, z: f64) -> Vec3 {
        Vec3::new(x, y, z).normalize()
    }

    fn same(a: f64, b: f64) -> bool {
        ((a - b).sin().abs() < 1e-12) && (a - b).cos() > 0.0
    }

    #[test]
    fn each_finds_the_angle_that_its_equation_was_made_with() {
        let (h, k) = (axis(1.0, -2.0, 0.5), axis(0.3, 0.2, -1.0));
        let (a, b) = (Vec3::new(0.4, 1.1, -0.3), Vec3::new(-0.7, 0.2, 0.9));
        for angle in [-3.0, -1.2, 0.0, 0.4, 2.9] {
            let to = turned(&h, angle, &a);
            assert!((to.norm() - a.norm()).abs() < 1e-15 && (h.dot(&to) - h.dot(&a)).abs() < 1e-15);
            assert!(same(onto(&h, &a, &to, 9.0), angle));
            for found in
                [height(&h, &k, &a, k.dot(&to), 9.0), distance(&h, &a, &b, (to + b).norm(), 9.0)]
            {
                assert!(found.count == 2 && found.iter().any(|x| same(x, angle)), "{found:?}");
            }
            let both = turned(&k, 0.8, &to);
            let found: Vec<_> = through_both((&k, &h), (&a, &both), [9.0; 2]).collect();
            assert!(found.iter().any(|[x, y]| same(*x, 0.8) && same(*y, angle)), "{found:?}");
            for [x, y] in &found {
                assert!((turned(&k, *x, &turned(&h, *y, &a)) - both).norm() < 1e-12);
            }
            assert_eq!(found.len(), 2);
        }
    }

    #[test]
    fn without_a_solution_there_is_none_and_without_a_say_the_angle_is_free() {
        let (h, a) = (axis(0.0, 0.0, 1.0), Vec3::new(1.0, 0.0, 0.2));
        assert_eq!(height(&h, &Vec3::x(), &a, 1.01, 9.0), Angles::none());
        assert_eq!(height(&h, &Vec3::x(), &a, 1.0 + 1e-12, 9.0), Angles::one(0.0));
        assert_eq!(distance(&h, &a, &Vec3::x(), 2.5, 9.0), Angles::none());
        // A rotation does not change its own axis.
        assert_eq!(height(&h, &h, &a, 0.2, 9.0), Angles::one(9.0));
        assert_eq!(height(&h, &h, &a, 0.3, 9.0), Angles::none());
        assert_eq!(onto(&h, &h, &a, 9.0), 9.0);
        assert_eq!(onto(&h, &Vec3::zeros(), &a, 9.0), 9.0);
        let (v, far) = (Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 2.0));
        assert_eq!(through_both((&h, &Vec3::x()), (&v, &far), [9.0; 2]).count(), 0);
    }
}
