//! From a depth image to points in W.
//! ```text
//! p_W = X_WC (o + r d)      o, d: ray of the pixel in the camera's frame; r: its range
//! ```
//! Pixels without a ray, and ranges outside the limits (∞ and NaN among them), give no point. Points are in the order of pixels.

use linkwork_render::{Lens, LensRay};
use linkwork_spatial::{Pose, Vec3};

/// The rays of a camera's pixels, computed once.
#[derive(Clone, Debug, PartialEq)]
pub struct Rays {
    rays: Vec<Option<LensRay>>,
}

impl Rays {
    /// Of a lens with `width` by `height` pixels.
    #[must_use]
    pub fn new(lens: &Lens, [width, height]: [usize; 2]) -> Self {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x as f64, y as f64]));
        Rays { rays: pixels.map(|p| lens.ray(p)).collect() }
    }

    /// Appends the points (m, W) of an image of ranges (m, row by row from the top) that was taken at `X_WC`, those whose range is
    /// between the limits (m, both included).
    ///
    /// # Panics
    /// When the image does not have one range for each pixel.
    pub fn points(&self, range: &[f64], X_WC: &Pose, limits: [f64; 2], out: &mut Vec<Vec3>) {
        assert_eq!(range.len(), self.rays.len(), "one range for each pixel");
        let R = X_WC.rotation.to_rotation_matrix();
        for (ray, r) in self.rays.iter().zip(range) {
            if let Some(ray) = ray.filter(|_| *r >= limits[0] && *r <= limits[1]) {
                out.push(R * (ray.origin + ray.direction * *r) + X_WC.position);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_render::{
        Brown, Camera, HeightMap, Light, Look, Scene, Surface, Want, collision::Shape,
    };
    use linkwork_spatial::{Mat3, Quat};
    use std::sync::Arc;

    /// x right, y down, z forward, of a camera that looks along `heading`, `pitch` below the horizon.
    fn looking(position: Vec3, heading: f64, pitch: f64) -> Pose {
        let forward =
            Vec3::new(heading.cos() * pitch.cos(), heading.sin() * pitch.cos(), -pitch.sin());
        let right = forward.cross(&Vec3::z()).normalize();
        let down = forward.cross(&right);
        Pose::new(Quat::from_matrix(&Mat3::from_columns(&[right, down, forward])), position)
    }

    #[test]
    fn points_of_a_rendered_image_lie_on_what_was_seen() {
        let mut scene = Scene::new(Light::default());
        let heights = vec![0.0, 2.0, 1.0, 3.0];
        let surface = Surface { origin: [-20.0; 2], spacing: [40.0; 2], nx: 2, ny: 2, heights };
        let ground = Arc::new(HeightMap::new(surface).unwrap());
        scene.set_ground(ground.clone(), Look::plain([0.3; 3])).unwrap();
        let at = Vec3::new(4.0, 1.0, 1.5);
        let ball = Shape::Sphere { radius: 0.7 };
        scene.add("ball", &ball, Look::plain([0.3; 3]), Pose::translation(4.0, 1.0, 1.5)).unwrap();
        scene.settle();
        let lens = Lens::Brown(Brown { radial: [-0.1, 0.0, 0.0], ..Brown::ideal(64, 48, 1.4) });
        let camera = Camera::new(lens, 64, 48, 1).unwrap();
        let X_WC = looking(Vec3::new(-1.0, 0.3, 3.5), 0.2, 0.5);
        let frame = camera.look(&scene, &X_WC, Want::Depth, 1).unwrap();
        let mut points = vec![];
        Rays::new(&lens, [64, 48]).points(&frame.range, &X_WC, [0.1, 9.0], &mut points);
        let seen = frame.range.iter().filter(|r| **r <= 9.0).count();
        assert!(seen > 1000 && seen < 64 * 48 && points.len() == seen);
        let mut of_ball = 0;
        for p in &points {
            let off_ball = ((p - at).norm() - 0.7).abs();
            let off_ground = (p.z - ground.height(p.x, p.y).unwrap()).abs();
            of_ball += usize::from(off_ball < 1e-9);
            assert!(off_ball.min(off_ground) < 1e-9, "{p:?}: {off_ball} {off_ground}");
        }
        assert!(of_ball > 30, "{of_ball}");
    }

    #[test]
    fn what_was_not_measured_gives_no_point() {
        let rays = Rays::new(&Lens::Brown(Brown::ideal(3, 2, 1.0)), [3, 2]);
        let mut out = vec![];
        let range = [f64::NAN, f64::INFINITY, 0.05, 1.0, 12.0, -1.0];
        rays.points(&range, &Pose::identity(), [0.1, 10.0], &mut out);
        assert_eq!(out.len(), 1);
    }
}
