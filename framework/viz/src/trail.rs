//! Trails of bodies: fine near the last point, coarser with the distance from it, in the colours of the phases.
//!
//! If a body is followed, the near part of a trail has its own frame, which is at rest in W near the last point. There the trail keeps its precision,
//! and data that are sent repeatedly hardly change. The rest of the trail is expressed in W.
use crate::eye::Base;
use crate::shapes::{entity, f3};
use linkwork_spatial::{Pose, Vec3};
use re_sdk::EntityPath;
use re_sdk_types::archetypes::LineStrips3D;

/// Points of a trail that are closer than this are merged (m).
const NEAR: f64 = 0.05;
/// Largest number of points of a trail.
const POINTS: usize = 1000;
/// Length of the near part, which may grow to twice this length, and largest distance of its frame's origin from the last point (m). Single precision
/// has a resolution of half a millimetre at this distance.
const REACH: f64 = 16384.0;

/// The trail of a body.
pub struct Trail {
    /// Index of the body among the entities.
    pub body: usize,
    /// Entity of the part near the last point, or of the whole trail if no body is followed.
    pub path: EntityPath,
    /// Entity of the rest, in W.
    far: EntityPath,
    /// The body is external, so the trail has its own colour.
    told: bool,
    /// Origin of the frame of the near part in W (m); `None`: the whole trail is expressed in W.
    origin: Option<Vec3>,
    /// Points in W (m), with the phase of each.
    points: Vec<(Vec3, u32)>,
    /// Index of the first point of the near part, which is also the last point of the rest.
    joint: usize,
    /// Whether the last point changed the rest.
    far_is_new: bool,
    /// Smallest distance of two points, relative to their distance from the last point.
    spread: f64,
}

/// Returns the colour of a phase. The colours repeat.
pub fn color(phase: u32) -> re_sdk_types::components::Color {
    let [r, g, b] = [
        [255, 230, 60],
        [90, 200, 255],
        [255, 120, 90],
        [140, 230, 120],
        [230, 140, 255],
        [255, 180, 60],
        [120, 150, 255],
        [240, 240, 240],
    ][phase as usize % 8];
    re_sdk_types::components::Color::from_rgb(r, g, b)
}

/// Returns the colour of external bodies, which differs from those of the phases.
pub fn told_color() -> re_sdk_types::components::Color {
    re_sdk_types::components::Color::from_rgb(255, 60, 200)
}

fn apart(a: &Vec3, b: &Vec3) -> f64 {
    (a - b).norm()
}

impl Trail {
    /// Creates an empty trail of the entity `body` with its name. `told`: the body is external. `base`: the frame in which moving objects are
    /// expressed.
    pub fn new(body: usize, name: &str, told: bool, base: &Base) -> Trail {
        let [path, far] = ["trails", "trails_far"].map(|of| entity(&format!("{of}/{name}")));
        let origin = matches!(base, Base::Eye(_)).then(Vec3::zeros);
        let (points, joint, far_is_new, spread) = (Vec::new(), 0, false, 0.002);
        Trail { body, path, far, told, origin, points, joint, far_is_new, spread }
    }

    /// Returns the pose in W of the frame of the near part, if it has one.
    pub fn frame(&self) -> Option<Pose> {
        self.origin.map(|p| Pose::translation(p.x, p.y, p.z))
    }

    /// Adds a point if it is far enough from the last one. If there are too many points, distant parts are thinned out first.
    pub fn add(&mut self, p: &Vec3, phase: u32) -> bool {
        if self.points.last().is_some_and(|(last, _)| apart(last, p) < NEAR) {
            return false;
        }
        let thin = self.points.len() >= POINTS;
        while self.points.len() >= POINTS {
            let mut kept: Vec<(Vec3, u32)> = Vec::new();
            for (k, point) in self.points.iter().enumerate().rev() {
                let gap = kept.last().map_or(f64::INFINITY, |(next, _)| apart(next, &point.0));
                // Always keep the first point.
                if k == 0 || gap >= self.spread * apart(p, &point.0) {
                    kept.push(*point);
                }
            }
            kept.reverse();
            self.points = kept;
            if self.points.len() > POINTS / 2 {
                self.spread *= 2.0;
            }
        }
        self.points.push((*p, phase));
        if let Some(origin) = &mut self.origin {
            if apart(origin, p) > REACH {
                *origin = *p;
            }
            let beyond =
                |way: f64| self.points.iter().rposition(|(q, _)| apart(q, p) > way).unwrap_or(0);
            // The joint moves by a whole `REACH`, so that the rest is not sent again with every point.
            let moves = thin || beyond(2.0 * REACH) > self.joint;
            let joint = if moves { beyond(REACH) } else { self.joint };
            self.far_is_new = moves && joint.max(self.joint) > 0;
            self.joint = joint;
        }
        true
    }

    /// Returns what the last point changed: the near part, in its frame, and the rest.
    pub fn changes(&self) -> Vec<(EntityPath, LineStrips3D)> {
        let near = self.strips(&self.points[self.joint..], &self.origin.unwrap_or_default());
        let mut changes = vec![(self.path.clone(), near)];
        if self.far_is_new {
            // A single point is not a line.
            let rest = if self.joint > 0 { &self.points[..=self.joint] } else { &[] };
            changes.push((self.far.clone(), self.strips(rest, &Vec3::zeros())));
        }
        changes
    }

    /// Returns one strip per phase, in its colour, relative to an origin.
    fn strips(&self, points: &[(Vec3, u32)], origin: &Vec3) -> LineStrips3D {
        let (mut strips, mut colors) = (Vec::new(), Vec::new());
        let mut first = 0;
        for k in 1..=points.len() {
            let phase = points[first].1;
            if points.get(k).is_none_or(|next| next.1 != phase) {
                // Extend the strip to the first point of the next phase.
                let end = (k + 1).min(points.len());
                strips.push(
                    points[first..end].iter().map(|p| f3(&(p.0 - origin))).collect::<Vec<_>>(),
                );
                colors.push(if self.told { told_color() } else { color(phase) });
                first = k;
            }
        }
        LineStrips3D::new(strips)
            .with_colors(colors)
            .with_radii([re_sdk_types::components::Radius::new_ui_points(1.5)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_near_stays_fine_and_what_is_far_goes() {
        let mut trail = Trail::new(0, "body", false, &Base::World);
        // The body decelerates from a distance of 4000 km to a stop, and then moves 30 m at walking
        // speed.
        let mut far = 4e6;
        while far > 0.06 {
            trail.add(&Vec3::new(far, 0.0, 0.0), 0);
            far *= 0.999;
        }
        for k in 0..300 {
            trail.add(&Vec3::new(0.0, 0.1 * f64::from(k), 0.0), 1);
        }
        assert!(trail.points.len() < POINTS, "{}", trail.points.len());
        let places: Vec<Vec3> = trail.points.iter().map(|p| p.0).collect();
        assert_eq!(places[0][0], 4e6, "its beginning stays");
        let gaps = |from: usize| {
            places[from..].windows(2).map(|w| apart(&w[0], &w[1])).fold(0.0, f64::max)
        };
        assert!(gaps(places.len() - 20) < 0.11, "{}", gaps(places.len() - 20));
        // A point at the position of the last one is ignored.
        assert!(!trail.add(&Vec3::new(0.0, 29.92, 0.0), 1));
        assert!(color(0) != color(1));
    }

    fn positions(strips: &LineStrips3D) -> Vec<Vec3> {
        use re_sdk_types::Loggable as _;
        let batch = strips.strips.as_ref().map(|b| b.array.clone()).unwrap();
        let strips = re_sdk_types::components::LineStrip3D::from_arrow(&*batch).unwrap();
        strips.iter().flat_map(|s| &s.0).map(|p| Vec3::from(p.0.map(f64::from))).collect()
    }

    /// In orbit at the rate of a screen, and once per ten seconds.
    #[test]
    fn far_from_the_origin_its_end_keeps_its_digits_and_nothing_is_missing() {
        let (radius, speed) = (6.7e6, 7.7e3);
        for (apart_s, count) in [(0.033, 1500), (10.0, 300)] {
            let mut trail = Trail::new(0, "body", false, &Base::Eye(Pose::identity()));
            let (mut far, mut new, mut step) = (Vec::new(), 0, 0.0_f64);
            for k in 0..count {
                let (sin, cos) = (f64::from(k) * apart_s * speed / radius).sin_cos();
                let p = radius * Vec3::new(cos, 0.6 * sin, 0.8 * sin);
                assert!(trail.add(&p, 0));
                let origin = trail.frame().unwrap().position;
                assert!((p - origin).norm() <= REACH);
                let changes = trail.changes();
                let near = positions(&changes[0].1);
                let end = near[near.len() - 1] + origin;
                assert!((end - p).norm() < 1e-3, "{k}: {end:?} for {p:?}");
                if let Some((_, rest)) = changes.get(1) {
                    (far, new) = (positions(rest), new + 1);
                    // The older part has single precision at this distance.
                    let gap = (far[far.len() - 1] - near[0] - origin).norm();
                    assert!(gap < 0.6, "{k}: the parts are {gap} m apart");
                }
                step = step.max((near[near.len().saturating_sub(2)] - near[near.len() - 1]).norm());
            }
            let whole = far.len() + positions(&trail.changes()[0].1).len();
            assert_eq!(whole, trail.points.len() + 1, "the joint is in both");
            assert!(step > 0.99 * speed * apart_s, "{step}");
            // The older part is sent again once for each `REACH` of distance.
            let stretches = f64::from(count) * (speed * apart_s / REACH).min(1.0);
            assert!((f64::from(new) / stretches - 1.0).abs() < 0.2, "{new} for {stretches}");
        }
    }

    #[test]
    fn a_path_near_the_origin_has_one_part_in_numbers_of_w() {
        let mut trail = Trail::new(0, "body", false, &Base::Eye(Pose::identity()));
        for k in 0..30 {
            trail.add(&Vec3::new(f64::from(k), 2.0, 0.5), 0);
        }
        let changes = trail.changes();
        assert_eq!((changes.len(), trail.frame()), (1, Some(Pose::identity())));
        assert_eq!(positions(&changes[0].1)[29], Vec3::new(29.0, 2.0, 0.5));
    }
}
