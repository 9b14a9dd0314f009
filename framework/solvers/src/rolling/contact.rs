//! Where the rim of a wheel is nearest to the ground.
//!
//! ```text
//! p(θ) = c + r (cos θ down + sin θ ahead)      gap = min over θ of (p_z − h(p)) n_z,  the distance along the normal
//! ```
//! The lower rim is sampled, and parabolas through the lowest sample and its neighbours find the least distance between
//! them: to 1e-9 m on smooth ground.
use linkwork_spatial::{Pose, Vec3};

/// A wheel over the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footing {
    /// Distance of the rim from the ground along its normal (m); negative: in it.
    pub gap: f64,
    /// The point of the rim that is nearest, W (m).
    pub point: Vec3,
    /// Unit normal of the ground there, upwards, W.
    pub normal: Vec3,
    /// Angle of the point on the rim, from the lowest point, ahead (rad).
    pub angle: f64,
}

/// Samples to each side of the lowest point, their distance (rad), parabolas.
const SIDE: i32 = 8;
const APART: f64 = 8.0 * std::f64::consts::PI / 180.0;
const PARABOLAS: usize = 4;
/// Half of the interval that is searched near a known point (rad).
const BESIDE: f64 = 1.0 * std::f64::consts::PI / 180.0;

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

    fn at(&mut self, angle: f64) -> Option<Footing> {
        let (s, c) = angle.sin_cos();
        let point = self.centre + self.down * c + self.ahead * s;
        let (height, normal) = (self.ground)(point.x, point.y)?;
        Some(Footing { gap: (point.z - height) * normal.z, point, normal, angle })
    }

    /// The least of three with the lowest in the middle.
    fn between(&mut self, mut three: [Footing; 3]) -> Option<Footing> {
        for _ in 0..PARABOLAS {
            let [(a, fa), (b, fb), (c, fc)] = three.map(|f| (f.angle, f.gap));
            let (p, q) = ((b - a) * (fb - fc), (b - c) * (fb - fa));
            if p == q {
                break;
            }
            let x = b - 0.5 * ((b - a) * p - (b - c) * q) / (p - q);
            if !(x > a && x < c) || (x - b).abs() < 1e-8 {
                break;
            }
            let new = self.at(x)?;
            three = match (new.gap < fb, x < b) {
                (true, true) => [three[0], new, three[1]],
                (true, false) => [three[1], new, three[2]],
                (false, true) => [new, three[1], three[2]],
                (false, false) => [three[0], three[1], new],
            };
        }
        Some(three[1])
    }
}

/// The footing of a wheel whose hub is the origin of `pose`, whose axle is its y axis, and whose radius is `radius` (m). `None`
/// where there is no ground under a part of the lower rim.
pub fn footing(
    ground: &mut impl FnMut(f64, f64) -> Option<(f64, Vec3)>,
    pose: &Pose,
    radius: f64,
) -> Option<Footing> {
    let mut rim = Rim::new(ground, pose, radius);
    let mut all = [Footing::default(); 2 * SIDE as usize + 1];
    let mut least = 0;
    for (i, k) in (-SIDE..=SIDE).enumerate() {
        all[i] = rim.at(APART * f64::from(k))?;
        if all[i].gap < all[least].gap {
            least = i;
        }
    }
    if least == 0 || least + 1 == all.len() {
        return Some(all[least]);
    }
    rim.between([all[least - 1], all[least], all[least + 1]])
}

/// The same near a known angle on the rim (rad); the whole rim where the least is not there.
pub(super) fn near(
    ground: &mut impl FnMut(f64, f64) -> Option<(f64, Vec3)>,
    pose: &Pose,
    radius: f64,
    angle: f64,
) -> Option<Footing> {
    let mut rim = Rim::new(ground, pose, radius);
    let three = [rim.at(angle - BESIDE)?, rim.at(angle)?, rim.at(angle + BESIDE)?];
    if three[1].gap <= three[0].gap && three[1].gap <= three[2].gap {
        return rim.between(three);
    }
    footing(ground, pose, radius)
}
