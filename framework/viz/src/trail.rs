//! Paths of bodies: fine near the last point, coarser the farther back, in the colours of the phases.
use crate::shapes::f3;
use linkwork_spatial::Vec3;
use re_sdk::EntityPath;

/// Points of a trail nearer than this are one (m).
const NEAR: f64 = 0.05;
/// Points of a trail, at most.
const POINTS: usize = 1000;

/// The path of a body.
pub struct Trail {
    /// Among the entities.
    pub body: usize,
    /// Where it is shown.
    pub path: EntityPath,
    /// Somebody else tells it: it has one colour of its own.
    told: bool,
    /// With the phase of each.
    points: Vec<([f32; 3], u32)>,
    /// Least distance of two points, over their distance from the last.
    spread: f64,
}

/// Colours of the phases, in their order, again and again.
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

/// Colour of what somebody else tells: none of those of phases.
pub fn told_color() -> re_sdk_types::components::Color {
    re_sdk_types::components::Color::from_rgb(255, 60, 200)
}

fn apart(a: &[f32; 3], b: &[f32; 3]) -> f64 {
    let d = |k: usize| f64::from(a[k]) - f64::from(b[k]);
    (0..3).map(|k| d(k).powi(2)).sum::<f64>().sqrt()
}

impl Trail {
    /// Of the entity `body`, without a point. `told`: by somebody else than the simulation.
    pub fn new(body: usize, path: EntityPath, told: bool) -> Trail {
        Trail { body, path, told, points: Vec::new(), spread: 0.002 }
    }

    /// Adds a point that is far enough from the last; thins out when there are very many, what is far away first.
    pub fn add(&mut self, p: &Vec3, phase: u32) -> bool {
        let p = f3(p);
        if self.points.last().is_some_and(|(last, _)| apart(last, &p) < NEAR) {
            return false;
        }
        while self.points.len() >= POINTS {
            let mut kept: Vec<([f32; 3], u32)> = Vec::new();
            for (k, point) in self.points.iter().enumerate().rev() {
                let gap = kept.last().map_or(f64::INFINITY, |(next, _)| apart(next, &point.0));
                // The beginning stays.
                if k == 0 || gap >= self.spread * apart(&p, &point.0) {
                    kept.push(*point);
                }
            }
            kept.reverse();
            self.points = kept;
            if self.points.len() > POINTS / 2 {
                self.spread *= 2.0;
            }
        }
        self.points.push((p, phase));
        true
    }

    /// One strip for each phase, in its colour.
    pub fn strips(&self) -> re_sdk_types::archetypes::LineStrips3D {
        let (mut strips, mut colors) = (Vec::new(), Vec::new());
        let mut first = 0;
        for k in 1..=self.points.len() {
            let phase = self.points[first].1;
            if self.points.get(k).is_none_or(|next| next.1 != phase) {
                // To the first point of the next.
                let end = (k + 1).min(self.points.len());
                strips.push(self.points[first..end].iter().map(|p| p.0).collect::<Vec<_>>());
                colors.push(if self.told { told_color() } else { color(phase) });
                first = k;
            }
        }
        re_sdk_types::archetypes::LineStrips3D::new(strips)
            .with_colors(colors)
            .with_radii([re_sdk_types::components::Radius::new_ui_points(1.5)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_near_stays_fine_and_what_is_far_goes() {
        let mut trail = Trail::new(0, EntityPath::from("trail"), false);
        // From 4000 km away to a stop, then 30 m at a walk.
        let mut far = 4e6;
        while far > 0.06 {
            trail.add(&Vec3::new(far, 0.0, 0.0), 0);
            far *= 0.999;
        }
        for k in 0..300 {
            trail.add(&Vec3::new(0.0, 0.1 * f64::from(k), 0.0), 1);
        }
        assert!(trail.points.len() < POINTS, "{}", trail.points.len());
        let places: Vec<[f32; 3]> = trail.points.iter().map(|p| p.0).collect();
        assert_eq!(places[0][0], 4e6, "its beginning stays");
        let gaps = |from: usize| {
            places[from..].windows(2).map(|w| apart(&w[0], &w[1])).fold(0.0, f64::max)
        };
        assert!(gaps(places.len() - 20) < 0.11, "{}", gaps(places.len() - 20));
        // A point that is not away from the last is none.
        assert!(!trail.add(&Vec3::new(0.0, 29.92, 0.0), 1));
        assert!(color(0) != color(1));
    }
}
