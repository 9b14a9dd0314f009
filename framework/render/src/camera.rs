//! A camera: a lens with pixels, whose rays are computed once, and the images that it takes of a scene.
//! ```text
//! tiles     8 × 8 pixels; geometry that no ray of a tile can hit is excluded for the tile (`beam`)
//! threads   take rows of tiles in turn; each pixel is a pure function of scene, camera and pose
//! shadows   a ray to the Sun from each hit, started 1e-6 (1 + distance) off the surface
//! ```
//! Depth, range, normal and masks are computed for the ray through the centre of a pixel; radiance is the mean of n × n rays.

use crate::beam::Beam;
use crate::error::RenderError;
use crate::lens::{Lens, LensRay};
use crate::light::Rgb;
use crate::scene::{Candidates, FAR, Hit, Scene, check_pose};
use linkwork_spatial::{Pose, Vec3};
use std::sync::{Mutex, PoisonError};

/// Edge of a tile, pixels.
const TILE: usize = 8;

/// Maximum number of rays of a camera: the table of rays takes 56 bytes each, a frame about 110 bytes per pixel.
const RAYS_MAX: u128 = 1 << 23;

/// A camera.
#[derive(Clone, Debug)]
pub struct Camera {
    lens: Lens,
    width: usize,
    height: usize,
    samples: usize,
    /// Rays through the centres of pixels, row by row.
    middles: Vec<Option<LensRay>>,
    /// The rays of all samples, pixel by pixel, when a pixel has several.
    fine: Vec<Option<LensRay>>,
}

/// Quantities to be computed for each pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Want {
    /// Depth, range, masks.
    Depth,
    /// Also normals.
    Geometry,
    /// Also radiance.
    Radiance,
}

/// Result of a camera. Arrays are row by row from the top, with one entry per pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Depth along the optical axis from the centre of projection, m; ∞ without a hit.
    pub depth: Vec<f64>,
    /// Distance along the ray from its origin, m; ∞ without a hit.
    pub range: Vec<f64>,
    /// Unit normals against the rays, W; zero without a hit; empty when only depth is computed.
    pub normals: Vec<[f32; 3]>,
    /// Object numbers: 0 nothing, 1 the ground, others [`ObjectId::in_mask`](crate::ObjectId::in_mask).
    pub objects: Vec<u16>,
    /// Semantic classes, [`Look::class`](crate::Look::class); 0 nothing.
    pub classes: Vec<u16>,
    /// Radiance, W/(m² sr); empty unless requested. Zero where the lens has no ray.
    pub radiance: Vec<[f32; 3]>,
    /// True if the camera is inside a solid or below the ground. Its rays then hit from inside: at distance 0 in a solid, and at the underside of the
    /// ground below it.
    pub inside: bool,
}

/// One pixel of a frame.
#[derive(Clone, Copy)]
struct Pixel {
    depth: f64,
    range: f64,
    normal: [f32; 3],
    object: u16,
    radiance: [f32; 3],
}

impl Camera {
    /// Creates a camera with `width` by `height` pixels, and `samples` by `samples` rays in each pixel for its radiance.
    ///
    /// # Errors
    /// An invalid lens, an image without pixels, an image with too many rays.
    pub fn new(
        lens: Lens,
        width: usize,
        height: usize,
        samples: usize,
    ) -> Result<Self, RenderError> {
        lens.check()?;
        if width == 0 || height == 0 || samples == 0 {
            return Err(RenderError::Empty { width, height });
        }
        let rays = [height, samples, samples]
            .iter()
            .fold(width as u128, |n, k| n.saturating_mul(*k as u128));
        if rays > RAYS_MAX {
            return Err(RenderError::TooLarge { width, height, samples, rays, max: RAYS_MAX });
        }
        let pixels =
            || (0..height).flat_map(move |y| (0..width).map(move |x| [x as f64, y as f64]));
        let middles = pixels().map(|p| lens.ray(p)).collect();
        let offset = move |k: usize| (k as f64 + 0.5) / samples as f64 - 0.5;
        let inside =
            || (0..samples).flat_map(move |j| (0..samples).map(move |i| [offset(i), offset(j)]));
        let fine = match samples {
            1 => vec![],
            _ => pixels()
                .flat_map(|[x, y]| inside().map(move |[i, j]| [x + i, y + j]))
                .map(|p| lens.ray(p))
                .collect(),
        };
        Ok(Self { lens, width, height, samples, middles, fine })
    }

    /// Returns the lens.
    #[must_use]
    pub fn lens(&self) -> &Lens {
        &self.lens
    }

    /// Returns the numbers of columns and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Renders the scene from a pose (`X_WC`) with `threads` threads (at least one). The result is bit-identical for any number of threads.
    ///
    /// # Errors
    /// An invalid pose, invalid light, or a scene that is not settled.
    pub fn look(
        &self,
        scene: &Scene,
        X_WC: &Pose,
        want: Want,
        threads: usize,
    ) -> Result<Frame, RenderError> {
        check_pose("camera", X_WC)?;
        scene.check()?;
        let count = self.width * self.height;
        let blank =
            Pixel { depth: FAR, range: FAR, normal: [0.0; 3], object: 0, radiance: [0.0; 3] };
        let mut pixels = vec![blank; count];
        {
            let bands = Mutex::new(pixels.chunks_mut(TILE * self.width).enumerate());
            let work = || {
                let mut among = Candidates::default();
                loop {
                    let next = bands.lock().unwrap_or_else(PoisonError::into_inner).next();
                    let Some((k, band)) = next else { return };
                    for x in (0..self.width).step_by(TILE) {
                        self.tile(scene, X_WC, want, [x, k * TILE], band, &mut among);
                    }
                }
            };
            std::thread::scope(|s| {
                (1..threads.min(self.height.div_ceil(TILE))).for_each(|_| {
                    s.spawn(work);
                });
                work();
            });
        }
        Ok(self.frame(scene, X_WC, want, &pixels))
    }

    fn frame(&self, scene: &Scene, X_WC: &Pose, want: Want, pixels: &[Pixel]) -> Frame {
        let (centre, _) = self.lens.axis();
        Frame {
            width: self.width,
            height: self.height,
            depth: pixels
                .iter()
                .map(|p| if p.object == 0 { f64::INFINITY } else { p.depth })
                .collect(),
            range: pixels
                .iter()
                .map(|p| if p.object == 0 { f64::INFINITY } else { p.range })
                .collect(),
            normals: match want {
                Want::Depth => vec![],
                Want::Geometry | Want::Radiance => pixels.iter().map(|p| p.normal).collect(),
            },
            objects: pixels.iter().map(|p| p.object).collect(),
            classes: pixels.iter().map(|p| scene.class(p.object)).collect(),
            radiance: match want {
                Want::Depth | Want::Geometry => vec![],
                Want::Radiance => pixels.iter().map(|p| p.radiance).collect(),
            },
            inside: scene.is_inside(&X_WC.transform_point(&centre)),
        }
    }

    /// Renders one tile: its pixels from `x`, `y` on, in a band of rows that begins at `y`.
    fn tile(
        &self,
        scene: &Scene,
        X_WC: &Pose,
        want: Want,
        [x0, y0]: [usize; 2],
        band: &mut [Pixel],
        among: &mut Candidates,
    ) {
        let rows = band.len() / self.width;
        let x1 = (x0 + TILE).min(self.width);
        let several = want == Want::Radiance && self.samples > 1;
        let n = self.samples * self.samples;
        let R = X_WC.rotation.to_rotation_matrix();
        let world = |r: &LensRay| (R * r.origin + X_WC.position, R * r.direction);
        let mut middles = [(Vec3::zeros(), Vec3::zeros()); TILE * TILE];
        let mut good = [false; TILE * TILE];
        for y in 0..rows {
            for x in x0..x1 {
                if let Some(r) = &self.middles[(y0 + y) * self.width + x] {
                    middles[y * TILE + x - x0] = world(r);
                    good[y * TILE + x - x0] = true;
                }
            }
        }
        let of_pixel = |p: usize| &self.fine[p * n..(p + 1) * n];
        let all = (0..rows * TILE).filter(|k| good[*k]).map(|k| middles[k]);
        let more = several.then(|| {
            let pixels = (0..rows).flat_map(|y| (x0..x1).map(move |x| (y0 + y) * self.width + x));
            pixels.flat_map(of_pixel).flatten().map(world)
        });
        let Some(beam) = Beam::around(all.chain(more.into_iter().flatten())) else { return };
        scene.candidates(&beam, among);
        let (centre, axis) = self.lens.axis();
        let (centre, axis) = (X_WC.transform_point(&centre), X_WC.transform_vector(&axis));
        for y in 0..rows {
            for x in x0..x1 {
                let k = y * TILE + x - x0;
                let pixel = &mut band[y * self.width + x];
                let (o, d) = &middles[k];
                let mut hit = good[k].then(|| scene.cast_among(among, o, d)).flatten();
                if want != Want::Depth {
                    hit = hit.map(|h| scene.with_normal(h, o, d));
                }
                if let Some(hit) = &hit {
                    let p = o + d * hit.distance;
                    pixel.depth = (p - centre).dot(&axis);
                    pixel.range = hit.distance;
                    pixel.normal = [0, 1, 2].map(|i| hit.normal[i] as f32);
                    pixel.object = hit.object;
                }
                if want != Want::Radiance {
                    continue;
                }
                let rgb = match several {
                    false if good[k] => radiance(scene, o, d, hit),
                    false => [0.0; 3],
                    true => {
                        let mut sum = [0.0; 3];
                        for ray in of_pixel((y0 + y) * self.width + x).iter().flatten() {
                            let (o, d) = world(ray);
                            let hit = scene.cast_among(among, &o, &d);
                            let hit = hit.map(|h| scene.with_normal(h, &o, &d));
                            let one = radiance(scene, &o, &d, hit);
                            (0..3).for_each(|i| sum[i] += one[i]);
                        }
                        sum.map(|v| v / n as f64)
                    }
                };
                pixel.radiance = rgb.map(|v| v as f32);
            }
        }
    }
}

/// Returns the radiance along a ray that has hit an object or the sky.
fn radiance(scene: &Scene, o: &Vec3, d: &Vec3, hit: Option<Hit>) -> Rgb {
    let Some(hit) = hit else { return scene.light().sky(d) };
    let Some(look) = scene.look(hit.object) else { return [0.0; 3] };
    let p = o + d * hit.distance;
    let albedo = look.albedo_at(&scene.local(hit.object, &p));
    let light = scene.light();
    let faces = hit.normal.dot(&light.sun) > 0.0;
    let off = p + hit.normal * (1e-6 * (1.0 + hit.distance));
    let lit = faces && !hit.inside && !scene.blocked(&off, &light.sun, FAR);
    light.reflected(&albedo, &hit.normal, lit)
}
