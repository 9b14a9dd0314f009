//! `sensors.pose`: position, heading and tilt of a node, true or with noise; a stand-in for localisation.
//! ```text
//! heading = atan2(x_y, x_x) of the node's x axis      tilt: angle of its z axis to the vertical
//! roll, pitch: R = R_z(heading) R_y(pitch) R_x(roll), as an inclinometer at rest reads them
//! ```

use linkwork_runtime::prelude::*;

/// Noise.
#[derive(Params, Clone, Debug)]
pub struct PoseParams {
    /// Standard deviation of the position on each axis.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub position_sigma: f64,
    /// Standard deviation of the heading.
    #[param(unit = "rad", default = 0.0, range = 0.0..)]
    pub heading_sigma: f64,
}

/// The node.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PoseIn {
    /// The node.
    #[port(bind = "mount")]
    pub mount: NodeState,
}

/// Pose.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PoseOut {
    /// x in W.
    #[port("m")]
    pub x: f64,
    /// y in W.
    #[port("m")]
    pub y: f64,
    /// z in W.
    #[port("m")]
    pub z: f64,
    /// Heading from x towards y.
    #[port("rad")]
    pub heading: f64,
    /// Angle of the deck to the horizontal.
    #[port("rad")]
    pub tilt: f64,
    /// Rotation about x; positive if y points up.
    #[port("rad")]
    pub roll: f64,
    /// Rotation about y; positive if x points down.
    #[port("rad")]
    pub pitch: f64,
    /// Speed along the node's x axis.
    #[port("m/s")]
    pub speed: f64,
}

/// A pose sensor.
pub struct PoseSensor {
    p: PoseParams,
}

/// Pose of a node, true or with white noise; sampled.
#[model("sensors.pose")]
impl Model for PoseSensor {
    type Params = PoseParams;
    type FeedthroughInputs = PoseIn;
    type FeedthroughOutputs = PoseOut;
    fn feedthrough(&self, clock: &Clock, u: &PoseIn) -> PoseOut {
        let forward = u.mount.rotation * Vec3::x();
        let up = u.mount.rotation * Vec3::z();
        let noise =
            |lane: u32, sigma: f64| if sigma > 0.0 { sigma * clock.normal(lane) } else { 0.0 };
        let s = self.p.position_sigma;
        PoseOut {
            x: u.mount.position.x + noise(0, s),
            y: u.mount.position.y + noise(1, s),
            z: u.mount.position.z + noise(2, s),
            heading: forward.y.atan2(forward.x) + noise(3, self.p.heading_sigma),
            tilt: up.z.clamp(-1.0, 1.0).acos(),
            roll: (u.mount.rotation * Vec3::y()).z.atan2(up.z),
            pitch: (-forward.z).clamp(-1.0, 1.0).asin(),
            speed: forward.dot(&u.mount.velocity),
        }
    }
    fn update(&self) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heading_and_tilt_are_those_of_the_axes() {
        let mut mount = NodeState::identity();
        mount.rotation = Quat::from_axis_angle(&Vec3::z_axis(), 2.0)
            * Quat::from_axis_angle(&Vec3::x_axis(), 0.3);
        mount.velocity = Vec3::new(2f64.cos(), 2f64.sin(), 0.0) * 0.4;
        let s = PoseSensor { p: PoseParams { position_sigma: 0.0, heading_sigma: 0.0 } };
        let y = s.feedthrough(&Clock::at(0.0, 0.1, 0), &PoseIn { mount });
        assert!((y.heading - 2.0).abs() < 1e-12 && (y.tilt - 0.3).abs() < 1e-12);
        assert!((y.speed - 0.4).abs() < 1e-12);
    }
}
