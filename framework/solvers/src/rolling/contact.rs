//! Finds the point of a wheel's rim that is nearest to the ground.
//!
//! ```text
//! p(θ) = c + r (cos θ down + sin θ ahead)      height over the ground  g(θ) = p_z − h(p),  least where  n · dp/dθ = 0
//! ```
//! n is the normal of the ground. The lower rim is sampled. Between the lowest sample and the neighbour towards which the rim descends, bracketed
//! secant steps find the point where the rim is parallel to the ground.
//!
//! Angles are stored with sine and cosine. The angles of the samples are multiples of one angle, computed by rotation, which is much cheaper than the
//! functions.
use linkwork_spatial::{Pose, Vec3};

/// Position of a wheel over the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footing {
    /// Distance of the rim from the ground along its normal (m); negative if the rim is in the ground.
    pub gap: f64,
    /// The nearest point of the rim, W (m).
    pub point: Vec3,
    /// Unit normal of the ground there, upwards, W.
    pub normal: Vec3,
    /// Angle of the point on the rim, from the lowest point, ahead (rad).
    pub angle: f64,
}

/// Number of samples on each side of the lowest point, and the angle between two samples.
const SIDE: usize = 8;
const APART: Turn =
    Turn { angle: 8.0 * DEGREE, sine: 0.139_173_100_960_065_44, cosine: 0.990_268_068_741_570_3 };
/// Half of the interval that is searched near a known point.
const BESIDE: Turn =
    Turn { angle: DEGREE, sine: 0.017_452_406_437_283_512, cosine: 0.999_847_695_156_391_2 };
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Maximum number of secant steps, and change of angle (rad) at which they stop: the height then changes by less than 1e-14 m.
const SECANTS: (usize, f64) = (12, 1e-7);

/// An angle (rad) with its sine and cosine.
#[derive(Clone, Copy, Debug)]
struct Turn {
    angle: f64,
    sine: f64,
    cosine: f64,
}

impl Turn {
    fn of(angle: f64) -> Self {
        let (sine, cosine) = angle.sin_cos();
        Turn { angle, sine, cosine }
    }

    fn then(self, other: Turn) -> Self {
        Turn {
            angle: self.angle + other.angle,
            sine: self.sine * other.cosine + self.cosine * other.sine,
            cosine: self.cosine * other.cosine - self.sine * other.sine,
        }
    }

    fn back(self) -> Self {
        Turn { angle: -self.angle, sine: -self.sine, cosine: self.cosine }
    }
}

/// The rim of a wheel and the ground below it.
struct Rim<'g, G> {
    ground: &'g mut G,
    centre: Vec3,
    down: Vec3,
    ahead: Vec3,
}

impl<'g, G: FnMut(f64, f64) -> Option<(f64, Vec3)>> Rim<'g, G> {
    fn new(ground: &'g mut G, pose: &Pose, radius: f64) -> Self {
        let axle = pose.rotation * Vec3::y();
        let down = -(Vec3::z() - axle * axle.z).normalize();
        let ahead = axle.cross(&-down) * radius;
        Rim { ground, centre: pose.position, down: down * radius, ahead }
    }

    fn at(&mut self, turn: Turn) -> Option<Point> {
        let from_hub = self.down * turn.cosine + self.ahead * turn.sine;
        let along = self.ahead * turn.cosine - self.down * turn.sine;
        let point = self.centre + from_hub;
        let (height, normal) = (self.ground)(point.x, point.y)?;
        let height = point.z - height;
        let footing = Footing { gap: height * normal.z, point, normal, angle: turn.angle };
        Some(Point { footing, height, slope: normal.dot(&along) })
    }

    /// Finds the point where the rim is parallel to the ground, between `a`, where it descends towards `b`, and `b`, where it is higher or descends
    /// towards `a`.
    fn between(&mut self, mut a: Point, mut b: Point) -> Option<Footing> {
        // Slope in the direction from a to b. It is negative at a.
        let sign = (b.footing.angle - a.footing.angle).signum();
        let along = |p: &Point| sign * p.slope;
        let (mut last, mut new) = (b, a);
        for _ in 0..SECANTS.0 {
            let [from, to] = [a, b].map(|p| p.footing.angle);
            let (x0, x1) = (last.footing.angle, new.footing.angle);
            let secant = x1 - new.slope * (x1 - x0) / (new.slope - last.slope);
            let inside = (secant - from) * sign > 0.0 && (to - secant) * sign > 0.0;
            let x = if inside && along(&b) > 0.0 { secant } else { 0.5 * (from + to) };
            if (x - x1).abs() < SECANTS.1 {
                break;
            }
            (last, new) = (new, self.at(Turn::of(x))?);
            // At this point the rim still descends, and it did not rise in between, so the minimum
            // is beyond the point.
            if along(&new) < 0.0 && new.height < a.height {
                a = new;
            } else {
                b = new;
            }
        }
        Some(new.footing)
    }
}

/// A point of the rim.
#[derive(Clone, Copy, Debug, Default)]
struct Point {
    footing: Footing,
    /// Height over the ground (m).
    height: f64,
    /// n · dp/dθ (m/rad).
    slope: f64,
}

/// Finds the footing of a wheel whose hub is the origin of `pose`, whose axle is its y axis, and whose radius is `radius` (m). `None` if there is no
/// ground under part of the lower rim.
pub fn footing(
    ground: &mut impl FnMut(f64, f64) -> Option<(f64, Vec3)>,
    pose: &Pose,
    radius: f64,
) -> Option<Footing> {
    let mut rim = Rim::new(ground, pose, radius);
    let mut all = [Point::default(); 2 * SIDE + 1];
    let mut turn = Turn::of(0.0);
    all[SIDE] = rim.at(turn)?;
    for k in 1..=SIDE {
        turn = turn.then(APART);
        all[SIDE - k] = rim.at(turn.back())?;
        all[SIDE + k] = rim.at(turn)?;
    }
    let mut least = 0;
    for k in 1..all.len() {
        if all[k].height < all[least].height {
            least = k;
        }
    }
    let (here, next) =
        (all[least], if all[least].slope < 0.0 { least + 1 } else { least.wrapping_sub(1) });
    match all.get(next) {
        Some(beside) if here.slope != 0.0 => rim.between(here, *beside),
        _ => Some(here.footing),
    }
}

/// Finds the footing near a known angle on the rim (rad), or on the whole rim if the minimum is not there.
pub(super) fn near(
    ground: &mut impl FnMut(f64, f64) -> Option<(f64, Vec3)>,
    pose: &Pose,
    radius: f64,
    angle: f64,
) -> Option<Footing> {
    let mut rim = Rim::new(ground, pose, radius);
    let known = Turn::of(angle);
    let here = rim.at(known)?;
    if here.slope == 0.0 {
        return Some(here.footing);
    }
    let towards = if here.slope < 0.0 { BESIDE } else { BESIDE.back() };
    let beside = rim.at(known.then(towards))?;
    if here.slope * beside.slope < 0.0 {
        return rim.between(here, beside);
    }
    footing(ground, pose, radius)
}
