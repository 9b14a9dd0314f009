//! `sensors.lidar`: ranges to the ground along a fan of beams, for a spinning lidar, a flash lidar or a single-beam range finder.
//! ```text
//! beams    columns × rows, at the centres of equal parts of the angles of view; x of the mount forward, y left, z up
//! echo     e = ρ |n·d| (R/r)² ≥ 1 and near ≤ r ≤ far
//! reading  r + σ n, rounded to a multiple of the resolution; 0 without an echo
//! ```
//! The equations are those of `linkwork_render::lidar`. The lidar sees the terrain including rocks, as triangles between the nodes of its grid, and
//! the shapes of the bodies in `sees`. All beams of a sample are measured at one instant.

use linkwork_render::lidar::{Lidar, middles, spinning};
use linkwork_render::spatial::Pose;
use linkwork_render::{Look, Surroundings};
use linkwork_runtime::Lane;
use linkwork_surroundings::prelude::*;

/// Beams and their noise.
#[derive(Params, Clone, Debug)]
pub struct LidarParams {
    /// Number of columns: beams side by side.
    #[param(default = 36, range = 1.0..=4096.0)]
    pub columns: u32,
    /// Number of rows: beams above each other.
    #[param(default = 1, range = 1.0..=256.0)]
    pub rows: u32,
    /// Range of azimuth angles over which columns are spread, from x towards y.
    #[param(unit = "rad", default = [-std::f64::consts::PI, std::f64::consts::PI])]
    pub azimuth: [f64; 2],
    /// Range of elevation angles over which rows are spread, upwards.
    #[param(unit = "rad", default = [-0.4, 0.0])]
    pub elevation: [f64; 2],
    /// Minimum range.
    #[param(unit = "m", default = 0.2, range = 0.0..=1e6)]
    pub near: f64,
    /// Length of the measuring interval: the maximum range is `near` plus `depth`.
    #[param(unit = "m", default = 50.0, range = 1e-3..=1e6)]
    pub depth: f64,
    /// Range R at which a white surface that faces the beam is just detected.
    #[param(unit = "m", default = 200.0, range = 1e-3..)]
    pub reach: f64,
    /// Standard deviation of a range.
    #[param(unit = "m", default = 0.02, range = 0.0..)]
    pub sigma: f64,
    /// Resolution of the reading; 0: no quantization.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub resolution: f64,
    /// Probability that an echo is lost.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub drop_out: f64,
    /// Albedo of the ground.
    #[param(default = 0.2, range = 0.0..=1.0)]
    pub albedo: f64,
    /// Patterns of the names of visible bodies. Default: all. Exclude the body that carries the lidar if it would block beams.
    #[param(service)]
    pub sees: Scenery,
    /// The ground (optional).
    #[param(service)]
    pub terrain: Option<Handle<dyn Terrain>>,
}

/// Maximum number of beams: each is a slot of the output.
const BEAMS_MAX: u32 = 1 << 16;

/// A lidar.
pub struct LidarSensor {
    lidar: Lidar,
    around: Surroundings,
}

/// Lidar: ranges to ground and bodies along beams, with noise and lost echoes; sampled.
#[model("sensors.lidar")]
impl SizedModel for LidarSensor {
    type Params = LidarParams;

    fn ports(p: &LidarParams) -> SizedPorts {
        let mut mount = PortSpec::named("mount", PortKind::NodeState, <NodeState as Lane>::N)
            .doc_of("The sensor: x forward, y left, z up.");
        mount.bind = Some("mount".into());
        let count = (p.columns as usize * p.rows as usize).min(BEAMS_MAX as usize);
        let range = PortSpec::named("range", PortKind::Numbers, count)
            .unit_of("m")
            .doc_of("Range of each beam, column by column, with all rows of a column in sequence; 0 without an echo.");
        let echoes = PortSpec::named("echoes", PortKind::Numbers, 1)
            .unit_of("1")
            .doc_of("Number of beams with an echo.");
        SizedPorts {
            feedthrough_inputs: std::iter::once(mount).chain(p.sees.ports()).collect(),
            feedthrough_outputs: vec![range, echoes],
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: LidarParams) -> Result<Self, BuildError> {
        if p.columns.saturating_mul(p.rows) > BEAMS_MAX {
            let fact = format!("{} × {} beams are not supported", p.columns, p.rows);
            return Err(BuildError::new(fact)
                .at("columns")
                .help(format!("the maximum is {BEAMS_MAX} beams: each is a separate variable")));
        }
        for (name, [from, to]) in [("azimuth", p.azimuth), ("elevation", p.elevation)] {
            let limit =
                if name == "azimuth" { std::f64::consts::TAU } else { std::f64::consts::PI };
            if !(from <= to && to - from <= limit + 1e-9) {
                let fact = format!("`{name}` from {from} to {to} rad is not a valid range");
                let help =
                    "write the smaller angle first; at most 2π for `azimuth` and π for `elevation`";
                return Err(BuildError::new(fact).at(name).help(help));
            }
        }
        let angles = |[from, to]: [f64; 2], count: u32| middles(from, to, count as usize);
        let lidar = Lidar {
            beams: spinning(&angles(p.azimuth, p.columns), &angles(p.elevation, p.rows)),
            limits: [p.near, p.near + p.depth],
            reach: p.reach,
            sigma: p.sigma,
            resolution: p.resolution,
            drop_out: p.drop_out,
        };
        lidar.check().map_err(|e| BuildError::of(&e))?;
        let around = Surroundings::new(p.terrain.as_ref(), Look::plain([p.albedo; 3]), p.sees)?;
        Ok(Self { lidar, around })
    }

    fn feedthrough(&self, clock: &Clock, u: &[f64], y: &mut [f64]) {
        let mount = NodeState::get(u);
        let X_WS = Pose::new(mount.rotation, mount.position);
        let Some(scene) = self.around.now(&u[<NodeState as Lane>::N..]) else {
            // A non-finite pose gives NaN outputs, which stop the run with an error.
            y.fill(f64::NAN);
            return;
        };
        let Some((echoes, ranges)) = y.split_last_mut() else { return };
        *echoes = 0.0;
        for (k, range) in ranges.iter_mut().enumerate() {
            let echo = self.lidar.echo(&scene, &X_WS, clock.key, clock.n, k);
            let found = echo.range.is_finite();
            *range = if found { echo.range } else { 0.0 };
            *echoes += f64::from(u8::from(found));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_ground;

    fn params() -> LidarParams {
        LidarParams {
            columns: 24,
            rows: 3,
            azimuth: [-std::f64::consts::PI, std::f64::consts::PI],
            elevation: [-0.6, 0.6],
            near: 0.2,
            depth: 40.0,
            reach: 1e4,
            sigma: 0.0,
            resolution: 0.0,
            drop_out: 0.0,
            albedo: 0.2,
            sees: Scenery::default(),
            terrain: Some(test_ground::slope(100.0)),
        }
    }

    fn read(p: LidarParams, mount: NodeState) -> Vec<f64> {
        let lanes: usize = LidarSensor::ports(&p).feedthrough_outputs.iter().map(|s| s.lanes).sum();
        let m = LidarSensor::build(p).unwrap();
        let (mut u, mut y) = (vec![0.0; <NodeState as Lane>::N], vec![f64::NAN; lanes]);
        mount.put(&mut u);
        m.feedthrough(&Clock::at(0.0, 0.1, 0), &u, &mut y);
        y
    }

    #[test]
    fn ranges_to_a_slope_are_those_of_its_plane() {
        let mut mount = NodeState::identity();
        mount.position = Vec3::new(3.0, -1.0, 0.75 + 1.2);
        mount.rotation = Quat::from_scaled_axis(Vec3::new(0.1, -0.2, 0.7));
        let y = read(params(), mount);
        let normal = Vec3::new(-0.25, 0.0, 1.0);
        let mut found = 0.0;
        for (k, range) in y[..72].iter().enumerate() {
            let a = -std::f64::consts::PI + std::f64::consts::TAU * ((k / 3) as f64 + 0.5) / 24.0;
            let e = -0.4 + 0.4 * (k % 3) as f64;
            let d = mount.rotation * Vec3::new(a.cos() * e.cos(), a.sin() * e.cos(), e.sin());
            let t = -1.2 / normal.dot(&d);
            let want = if t > 0.2 && t < 40.2 { t } else { 0.0 };
            assert!((range - want).abs() < 1e-9, "{k}: {range} {want}");
            found += f64::from(u8::from(want > 0.0));
        }
        assert!(y[72] == found && found > 20.0 && found < 60.0, "{found}");
    }

    #[test]
    fn a_body_in_the_way_is_nearer_than_the_ground() {
        let ball = linkwork_surroundings::Sight {
            body: "ball".into(),
            name: "ball".into(),
            pose: Pose::identity(),
            form: linkwork_render::collision::VisualShape::Shape(
                linkwork_render::collision::Shape::Sphere { radius: 0.5 },
            ),
            color: [1.0; 3],
        };
        // The lidar has one beam along x, high above the ground; a ball crosses it.
        let p = LidarParams {
            columns: 1,
            rows: 1,
            azimuth: [0.0, 0.0],
            elevation: [0.0, 0.0],
            sees: Scenery::of(vec![ball]),
            terrain: None,
            ..params()
        };
        let m = LidarSensor::build(p.clone()).map_err(|e| e.message).unwrap();
        assert_eq!(LidarSensor::ports(&p).feedthrough_inputs.len(), 2);
        let range = |at: Vec3| {
            let n = <NodeState as Lane>::N;
            let (mut u, mut y) = (vec![0.0; 2 * n], [f64::NAN; 2]);
            NodeState::identity().put(&mut u[..n]);
            NodeState { position: at, ..NodeState::identity() }.put(&mut u[n..]);
            m.feedthrough(&Clock::at(0.0, 0.1, 0), &u, &mut y);
            y
        };
        assert_eq!(range(Vec3::new(6.0, 2.0, 0.0)), [0.0, 0.0]);
        let [near, echoes] = range(Vec3::new(6.0, 0.3, 0.0));
        assert!((near - (6.0 - (0.25_f64 - 0.09).sqrt())).abs() < 1e-9 && echoes == 1.0, "{near}");
        assert_eq!(range(Vec3::new(-6.0, 0.0, 0.0)), [0.0, 0.0]);
    }

    #[test]
    fn what_cannot_be_is_refused_at_its_parameter() {
        let refused = |p: LidarParams| LidarSensor::build(p).err().unwrap();
        let e = refused(LidarParams { columns: 4096, rows: 256, ..params() });
        assert!(e.param.as_deref() == Some("columns") && e.help.is_some());
        let e = refused(LidarParams { azimuth: [1.0, -1.0], ..params() });
        assert_eq!(e.param.as_deref(), Some("azimuth"));
        let e = refused(LidarParams { elevation: [-3.0, 3.0], ..params() });
        assert_eq!(e.param.as_deref(), Some("elevation"));
    }
}
