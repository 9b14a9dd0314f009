//! `sensors.camera`: camera that takes one picture of ground and bodies per sample, for models that read `pictures`.
//! ```text
//! picture   image (detector counts) and range along the ray of each pixel
//! range     true range, or with a `baseline` the range from stereo matching of two images
//! mount     x along the axis, y left, z up; the right camera of a pair is at −y
//! ```
//! The equations are those of `linkwork_render`. A picture is taken at one instant, its sample, and is available to readers from the next log row on.
//! The camera sees every shape that the viewer shows, including the body that carries it: mount it with a free view, or select the visible bodies
//! with `sees`.

use linkwork_render::spatial::Pose;
use linkwork_render::stereo::{Matcher, right_of};
use linkwork_render::{
    Brown, Camera, Channels, Detector, Image, Lens, Light, Look, Noise, Picture, RenderError,
    Scene, Surroundings, Want,
};
use linkwork_runtime::{AU, Lane};
use linkwork_surroundings::prelude::*;

/// Lens, detector and scene.
#[derive(Params, Clone, Debug)]
pub struct CameraParams {
    /// Width of the image, pixels.
    #[param(default = 160, range = 1.0..=8192.0)]
    pub width: u32,
    /// Height of the image, pixels.
    #[param(default = 120, range = 1.0..=8192.0)]
    pub height: u32,
    /// Angle of view across the width.
    #[param(unit = "rad", default = 1.0, range = 1e-3..=3.0)]
    pub view: f64,
    /// Radial distortion k₁, k₂, k₃ of Brown's model.
    #[param(default = [0.0, 0.0, 0.0])]
    pub radial: [f64; 3],
    /// Tangential distortion p₁, p₂.
    #[param(default = [0.0, 0.0])]
    pub tangential: [f64; 2],
    /// Rays along each edge of a pixel: 1 is fast, larger values smooth edges.
    #[param(default = 1, range = 1.0..=16.0)]
    pub samples: u32,
    /// Whether pixels are red, green and blue instead of grey.
    #[param(default = false)]
    pub color: bool,
    /// Bits per pixel value.
    #[param(default = 8, range = 8.0..=16.0)]
    pub bits: u32,
    /// Exposure time.
    #[param(unit = "s", default = 0.02, range = 1e-9..)]
    pub exposure: f64,
    /// Whether images have photon noise and read noise.
    #[param(default = true)]
    pub noise: bool,
    /// Baseline of a stereo pair. Default: one camera with true ranges.
    #[param(unit = "m", default = None, range = 1e-4..)]
    pub baseline: Option<f64>,
    /// Number of disparities that the stereo matcher searches.
    #[param(default = 64, range = 3.0..=4096.0, needs = "baseline")]
    pub disparities: u32,
    /// Maximum range.
    #[param(unit = "m", default = 100.0, range = 1e-3..=1e7)]
    pub reach: f64,
    /// Albedo of the ground: red, green, blue.
    #[param(default = [0.30, 0.19, 0.12], range = 0.0..=1.0)]
    pub albedo: [f64; 3],
    /// Contrast of the ground texture: relative variation of its albedo.
    #[param(default = 0.35, range = 0.0..=1.0)]
    pub contrast: f64,
    /// Length of the coarsest grain of that texture.
    #[param(unit = "m", default = 0.15, range = 1e-6.., needs = "contrast")]
    pub grain: f64,
    /// Patterns of the names of visible bodies. Default: all.
    #[param(service)]
    pub sees: Scenery,
    /// The ground (optional).
    #[param(service)]
    pub terrain: Option<Handle<dyn Terrain>>,
    /// The Sun (optional). Default: a Sun high in the sky.
    #[param(service)]
    pub sun: Option<Handle<dyn Sun>>,
    /// The world: the sky is dark where W is inertial, or where the body has no air.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
    /// The atmosphere (optional). It lights the sky of a body other than the Earth or Mars.
    #[param(service)]
    pub atmosphere: Option<Handle<dyn Atmosphere>>,
}

/// A camera or a pair.
pub struct CameraSensor {
    p: CameraParams,
    camera: Camera,
    detector: Detector,
    threads: usize,
    around: Surroundings,
}

/// Writers of a camera; a camera has none.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Nothing {}

/// Returns the rotation from lens axes (x right, y down, z forward) to mount axes.
fn lens_axes() -> Quat {
    Quat::from_basis_unchecked(&[-Vec3::y(), -Vec3::z(), Vec3::x()])
}

impl CameraSensor {
    fn mount(u: &[f64]) -> Pose {
        let mount = NodeState::get(u);
        Pose::new(mount.rotation * lens_axes(), mount.position)
    }

    /// Returns the light at a time (s) and position (W).
    fn light(&self, t: f64, at: &Vec3) -> Light {
        let usual = Light::default();
        let Some(sun) = &self.p.sun else { return usual };
        let seen = sun.light(t, at);
        // The default light is for 1.52 AU.
        let share = (1.52 * AU / seen.distance).powi(2);
        let air = self.p.atmosphere.is_some();
        let sky = self.p.world.as_ref().is_none_or(|w| {
            w.axes() != Axes::Inertial && (air || matches!(w.body(), "earth" | "mars"))
        });
        let up = f64::from(u8::from(sky && seen.direction.z > 0.0));
        Light {
            sun: seen.direction,
            sun_irradiance: usual.sun_irradiance.map(|e| share * seen.visible * e),
            sky_irradiance: usual.sky_irradiance.map(|e| share * up * e),
            horizon: usual.horizon.map(|l| share * up * l),
            zenith: usual.zenith.map(|l| share * up * l),
        }
    }

    /// Takes the picture from a pose (X_WC) of a scene whose shapes have been moved to their current poses.
    fn take(&self, c: &Clock, scene: &Scene, X_WC: Pose) -> Result<Picture, RenderError> {
        let [width, height] = self.camera.size();
        let frame = self.camera.look(scene, &X_WC, Want::Radiance, self.threads)?;
        let image = self.detector.read(&frame, c.key, c.n)?;
        let near = |range: f64| if range <= self.p.reach { range as f32 } else { f32::NAN };
        let (range, objects) = match self.p.baseline {
            None => (frame.range.iter().map(|r| near(*r)).collect(), frame.objects),
            Some(baseline) => {
                let right = self.camera.look(
                    scene,
                    &right_of(&X_WC, baseline),
                    Want::Radiance,
                    self.threads,
                )?;
                // A separate key makes the noise of the two cameras independent.
                let right = self.detector.read(&right, c.key ^ 1, c.n)?;
                let matcher =
                    Matcher { disparities: self.p.disparities as usize, ..Matcher::default() };
                let found = matcher.match_pair(&grey(&image), &grey(&right))?;
                let depth = found.depth(self.camera.lens(), baseline)?;
                let along = |(k, depth): (usize, f64)| {
                    let pixel = [(k % width) as f64, (k / width) as f64];
                    let ray = self.camera.lens().ray(pixel);
                    ray.map_or(f32::NAN, |ray| near(depth / ray.direction.z))
                };
                (depth.into_iter().enumerate().map(along).collect(), Vec::new())
            }
        };
        let lens = *self.camera.lens();
        let number = c.n + 1;
        Ok(Picture { number, time: c.t, pose: X_WC, lens, width, height, range, objects, image })
    }
}

/// Returns the mean of the colours.
fn grey(image: &Image) -> Image {
    if image.channels == 1 {
        return image.clone();
    }
    let mean =
        |rgb: &[u16]| (rgb.iter().map(|v| u32::from(*v)).sum::<u32>() / rgb.len() as u32) as u16;
    let data = image.data.chunks_exact(image.channels).map(mean).collect();
    Image { channels: 1, data, ..*image }
}

/// Camera: image and range of each pixel, for models that read `pictures`; sampled.
#[field("sensors.camera")]
impl Field for CameraSensor {
    type Params = CameraParams;
    type Data = Picture;
    type Imprint = Nothing;

    fn build(p: CameraParams) -> Result<Self, BuildError> {
        let at = |name: &'static str| move |e: RenderError| BuildError::of(&e).at(name);
        let (width, height) = (p.width as usize, p.height as usize);
        let ideal = Brown::ideal(width, height, p.view);
        let plain = p.radial == [0.0; 3] && p.tangential == [0.0; 2];
        if p.baseline.is_some() && !plain {
            let fact = "stereo matching does not support lens distortion";
            return Err(BuildError::new(fact)
                .at("baseline")
                .help("remove `radial` and `tangential`, or `baseline`"));
        }
        let lens = Lens::Brown(Brown { radial: p.radial, tangential: p.tangential, ..ideal });
        let camera = Camera::new(lens, width, height, p.samples as usize).map_err(at("width"))?;
        let usual = Detector::default();
        let detector = Detector {
            channels: if p.color { Channels::Rgb } else { Channels::Mono },
            bits: p.bits,
            exposure: p.exposure,
            gain: usual.well / f64::from((1u32 << p.bits) - 1),
            noise: if p.noise { Noise::On } else { Noise::Off },
            ..usual
        };
        detector.check().map_err(at("exposure"))?;
        if let Some(baseline) = p.baseline {
            // Parameters that stereo matching does not support are reported before the first
            // picture.
            let matcher = Matcher { disparities: p.disparities as usize, ..Matcher::default() };
            let blank =
                Image { width, height, channels: 1, bits: p.bits, data: vec![0; width * height] };
            let found = matcher.match_pair(&blank, &blank).map_err(at("disparities"))?;
            found.depth(camera.lens(), baseline).map_err(at("baseline"))?;
        }
        let ground = Look {
            albedo: p.albedo,
            contrast: p.contrast,
            grain: p.grain,
            class: Look::soil().class,
        };
        let around = Surroundings::new(p.terrain.as_ref(), ground, p.sees.clone())?;
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Ok(Self { p, camera, detector, threads, around })
    }

    fn start(&self) -> Picture {
        Picture::default()
    }

    fn inputs(built: Option<&Self>) -> Vec<PortSpec> {
        let mut mount = PortSpec::named("mount", PortKind::NodeState, <NodeState as Lane>::N)
            .doc_of("The camera: x along its axis, y left, z up.");
        mount.bind = Some("mount".into());
        let bodies = built.map(|camera| camera.around.ports()).unwrap_or_default();
        std::iter::once(mount).chain(bodies).collect()
    }

    fn update(&self, c: &Clock, picture: &mut Picture, _: &[Nothing], u: &[f64]) {
        let (mount, bodies) = u.split_at(<NodeState as Lane>::N);
        let taken = self.around.now(bodies).and_then(|mut scene| {
            let pose = Self::mount(mount);
            scene.set_light(self.light(c.t, &pose.position));
            self.take(c, &scene, pose).ok()
        });
        // Poses are finite here: non-finite values have stopped the run before.
        if let Some(taken) = taken {
            *picture = taken;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_render::collision::{Shape, VisualShape};
    use linkwork_surroundings::Sight;
    use linkwork_surroundings::testing::{self, Plane};

    fn params() -> CameraParams {
        let ground = Plane { soil: crate::test_ground::firm(), ..Plane::default() };
        CameraParams {
            width: 64,
            height: 48,
            view: 1.0,
            radial: [0.0; 3],
            tangential: [0.0; 2],
            samples: 1,
            color: false,
            bits: 8,
            exposure: 0.01,
            noise: true,
            baseline: None,
            disparities: 32,
            reach: 50.0,
            albedo: [0.3, 0.2, 0.1],
            contrast: 0.6,
            grain: 0.3,
            sees: Scenery::default(),
            terrain: Some(ground.handle()),
            sun: None,
            world: None,
            atmosphere: None,
        }
    }

    /// Without air only the Sun lights the ground.
    #[test]
    fn a_body_without_air_has_no_sky() {
        let pose = linkwork_spatial::Pose::new(Quat::identity(), Vec3::z() * 2e6);
        let site = Site { pose, rate: 0.0, start: Quat::identity() };
        let rock = linkwork_surroundings::PlainWorld::of_site(5e12, 2e6, site).handle();
        let sun = testing::sun(Vec3::z(), 1.0);
        let air = testing::air(|_, _| {
            let (density, temperature) = (1e-3, 200.0);
            Air { density, pressure: 50.0, temperature, speed_of_sound: 230.0, wind: Vec3::zeros() }
        });
        let sky = |world, atmosphere| {
            let sun = Some(sun.clone());
            let m = CameraSensor::build(CameraParams { sun, world, atmosphere, ..params() });
            let light = m.unwrap().light(0.0, &Vec3::zeros());
            assert!(light.sun_irradiance[0] > 0.0);
            light.sky_irradiance[0]
        };
        assert_eq!(sky(Some(rock.clone()), None), 0.0);
        assert!(sky(Some(rock), Some(air)) > 0.0 && sky(None, None) > 0.0);
    }

    /// Inputs of a camera 2 m above the ground that looks along +x and downwards by an angle, followed by lanes of bodies.
    fn lanes(down: f64, bodies: &[Vec3]) -> Vec<f64> {
        let node = |position, rotation| NodeState { position, rotation, ..NodeState::identity() };
        let mut nodes =
            vec![node(Vec3::new(0.0, 0.0, 2.0), Quat::from_scaled_axis(Vec3::y() * down))];
        nodes.extend(bodies.iter().map(|p| node(*p, Quat::identity())));
        let mut u = vec![0.0; nodes.len() * <NodeState as Lane>::N];
        for (node, lanes) in nodes.iter().zip(u.chunks_exact_mut(<NodeState as Lane>::N)) {
            node.put(lanes);
        }
        u
    }

    fn picture(p: CameraParams, u: &[f64], n: u64) -> Picture {
        let camera = CameraSensor::build(p).map_err(|e| e.message).unwrap();
        let mut picture = camera.start();
        camera.update(&Clock::at(3.0, 0.1, n), &mut picture, &[], u);
        picture
    }

    #[test]
    fn level_ground_is_as_far_as_its_rays_are_long() {
        let down = 0.5_f64;
        let seen = picture(params(), &lanes(down, &[]), 0);
        assert_eq!((seen.number, seen.time, seen.image.data.len()), (1, 3.0, 64 * 48));
        let f = 32.0 / 0.5_f64.tan();
        let mut found = 0;
        for (k, range) in seen.range.iter().enumerate() {
            // The camera has x to the right and y down.
            let (x, y) = ((k % 64) as f64 - 31.5, (k / 64) as f64 - 23.5);
            let d = Vec3::new(x / f, y / f, 1.0).normalize();
            let falls = d.z * down.sin() + d.y * down.cos();
            let want = if falls > 0.0 { 2.0 / falls } else { f64::INFINITY };
            if want <= 50.0 {
                assert!((f64::from(*range) / want - 1.0).abs() < 1e-6, "{k}: {range} {want}");
                found += 1;
            } else {
                assert!(range.is_nan(), "{k}: {range}");
            }
        }
        assert!(found > 2000, "{found}");
        assert_eq!(seen.points().count(), found);
        assert!(seen.points().all(|p| p.z.abs() < 1e-5 && p.x > 0.0), "on the ground, in front");
    }

    #[test]
    fn a_body_is_seen_where_it_is() {
        let ball = |body: &str| Sight {
            body: body.into(),
            name: "ball".into(),
            pose: Pose::identity(),
            form: VisualShape::Shape(Shape::Sphere { radius: 0.3 }),
            color: [1.0; 3],
        };
        let p = CameraParams { sees: Scenery::of(vec![ball("a"), ball("b")]), ..params() };
        // One ball is in front, to the left, and one is behind the camera.
        let at = [Vec3::new(5.0, 1.0, 2.0), Vec3::new(-5.0, 0.0, 2.0)];
        let seen = picture(p, &lanes(0.0, &at), 0);
        let of = |object: u16| {
            let all = seen.objects.iter().enumerate().filter(move |(_, o)| **o == object);
            all.map(|(k, _)| ((k % 64) as f64, (k / 64) as f64)).collect::<Vec<_>>()
        };
        let (first, second) = (of(2), of(3));
        assert!(second.is_empty(), "what is behind is not seen");
        let n = first.len() as f64;
        let mean = first.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
        let f = 32.0 / 0.5_f64.tan();
        assert!((mean.0 - (31.5 - f / 5.0)).abs() < 0.5 && (mean.1 - 23.5).abs() < 0.5, "{mean:?}");
        // The area is π (f r/z)², except for the pixels at the edge.
        let area = std::f64::consts::PI * (f * 0.3 / 5.0).powi(2);
        assert!((n - area).abs() < 0.15 * area, "{n} {area}");
    }

    #[test]
    fn a_pair_finds_ranges_by_matching() {
        let truth = picture(params(), &lanes(0.6, &[]), 0);
        let p = CameraParams { baseline: Some(0.25), ..params() };
        let found = picture(p, &lanes(0.6, &[]), 0);
        assert!(found.objects.is_empty(), "a pair does not know what it sees");
        let both: Vec<f32> = (found.range.iter().zip(&truth.range))
            .filter(|(a, b)| a.is_finite() && b.is_finite() && **b < 6.0)
            .map(|(a, b)| (a / b - 1.0).abs())
            .collect();
        let good = both.iter().filter(|e| **e < 0.05).count();
        assert!(both.len() > 600 && good as f64 > 0.9 * both.len() as f64, "{good}/{}", both.len());
    }

    #[test]
    fn noise_is_of_the_sample_and_not_of_the_call() {
        let u = lanes(0.5, &[]);
        let image = |n| picture(params(), &u, n).image;
        assert_eq!(image(4), image(4));
        assert_ne!(image(4), image(5));
        let plain = CameraParams { noise: false, ..params() };
        assert_eq!(picture(plain.clone(), &u, 4).image, picture(plain, &u, 5).image);
    }

    #[test]
    fn what_cannot_be_is_refused_at_its_parameter() {
        let refused = |p: CameraParams| CameraSensor::build(p).err().unwrap().param.unwrap();
        let pair = CameraParams { baseline: Some(0.2), ..params() };
        assert_eq!(refused(CameraParams { radial: [0.1, 0.0, 0.0], ..pair.clone() }), "baseline");
        assert_eq!(refused(CameraParams { disparities: 65, ..pair }), "disparities");
        let large = CameraParams { width: 8192, height: 8192, ..params() };
        assert_eq!(refused(large), "width");
        let gone = Sight {
            body: "a".into(),
            name: "mesh".into(),
            pose: Pose::identity(),
            form: VisualShape::File { file: "no/such.stl".into(), scale: Vec3::repeat(1.0) },
            color: [1.0; 3],
        };
        assert_eq!(refused(CameraParams { sees: Scenery::of(vec![gone]), ..params() }), "sees");
    }
}
