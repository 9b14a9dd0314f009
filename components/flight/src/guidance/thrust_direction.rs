//! `flight.thrust_direction`: attitude in which engines along z of a body exert a commanded force, and the thrust for the present attitude.
//! ```text
//! z_T = F/|F|, turned towards `up` until its angle to it is `tilt_max`           y_T = (z_T × forward), made unit      x_T = y_T × z_T
//! T = max(0, F · z)            z: of the body as it is
//! ```
//! x_T is as close to `forward` as z_T permits. Without a force the target is the present attitude. If z_T is parallel to `forward`, x of the body is
//! used instead, or its y. A force straight down is rotated towards `forward`, or towards x or y of W if `forward` is vertical.

use linkwork_spatial::Mat3;
use linkwork_spatial::nalgebra::Rotation3;
use linkwork_surroundings::prelude::*;

/// Heading of the body and limit of the tilt.
#[derive(Params, Clone, Debug)]
pub struct ThrustDirectionParams {
    /// Direction towards which x of the body points, W.
    #[param(default = Vec3::x())]
    pub forward: Vec3,
    /// Greatest angle of the thrust to the vertical.
    #[param(unit = "rad", default = 1.0471975511965976, range = 0.0..=3.15)]
    pub tilt_max: f64,
    /// The world; without a world the ground is level.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
    /// Gravity, for the vertical of level ground.
    #[param(service)]
    pub gravity: Option<Handle<dyn Gravity>>,
}

/// State of the body and commanded force.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThrustDirectionIn {
    /// Node of the body.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Commanded force, W.
    #[port("N")]
    pub force: Vec3,
}

/// Attitude and thrust commands.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThrustDirectionOut {
    /// Commanded attitude, body to W.
    #[port]
    pub target: Quat,
    /// Commanded force of the engines along z, body axes.
    #[port("N")]
    pub thrust: Vec3,
    /// Angle from z of the body to the direction of the force.
    #[port("rad")]
    pub off: f64,
    /// The direction of the force was limited to `tilt_max`.
    #[port]
    pub limited: bool,
}

/// Attitude command for a force.
pub struct ThrustDirection {
    p: ThrustDirectionParams,
    vertical: Vertical,
}

/// Returns the unit vector across `axis` (unit) in the plane of the first of three vectors that is not parallel to it. Two of them must not be
/// parallel to each other.
fn across(axis: &Vec3, of: [Vec3; 3]) -> Vec3 {
    let part = |v: &Vec3| v - axis * v.dot(axis);
    let found = of.iter().map(part).find(|p| p.norm() > 1e-6);
    found.unwrap_or_else(|| part(&of[2])).normalize()
}

/// Returns the unit vector `z`, rotated towards `up` until the angle between them is at most `most` (rad), and whether it was rotated. A vector
/// straight down is rotated to the side of `forward`.
fn within(z: &Vec3, up: &Vec3, forward: &Vec3, most: f64) -> (Vec3, bool) {
    let level = z - up * z.dot(up);
    let (sine, cosine) = (level.norm(), z.dot(up));
    if sine.atan2(cosine) <= most {
        return (*z, false);
    }
    let side = match sine < 1e-12 {
        true => across(up, [*forward, Vec3::x(), Vec3::y()]) * most.sin(),
        false => level * (most.sin() / sine),
    };
    (up * most.cos() + side, true)
}

/// Attitude in which a body exerts a commanded force by thrust along its z, and the thrust for the present attitude.
#[model("flight.thrust_direction")]
impl Model for ThrustDirection {
    type Params = ThrustDirectionParams;
    type FeedthroughInputs = ThrustDirectionIn;
    type FeedthroughOutputs = ThrustDirectionOut;
    fn build(p: ThrustDirectionParams) -> Result<Self, BuildError> {
        if !(p.forward.norm() > 1e-9) {
            return Err(BuildError::new("`forward` is the zero vector")
                .help("write a direction in W, e.g. forward: [1, 0, 0]")
                .at("forward"));
        }
        let vertical = Vertical::new(p.world.as_ref(), p.gravity.as_ref())?;
        Ok(ThrustDirection { p, vertical })
    }
    fn feedthrough(&self, clock: &Clock, u: &ThrustDirectionIn) -> ThrustDirectionOut {
        let (size, body) = (u.force.norm(), &u.body);
        if !(size > 0.0) {
            let (target, thrust) = (body.rotation, Vec3::zeros());
            return ThrustDirectionOut { target, thrust, off: 0.0, limited: false };
        }
        let up = self.vertical.up(clock.t, &body.position);
        let forward = self.p.forward.normalize();
        let (z, limited) = within(&(u.force / size), &up, &forward, self.p.tilt_max);
        let mut y = z.cross(&forward);
        if y.norm() < 1e-6 {
            let own = |axis: Vec3| body.rotation * axis;
            y = z.cross(&across(&z, [own(Vec3::x()), own(Vec3::y()), own(Vec3::z())]));
        }
        let y = y.normalize();
        let axes = Rotation3::from_matrix_unchecked(Mat3::from_columns(&[y.cross(&z), y, z]));
        let along = body.rotation * Vec3::z();
        ThrustDirectionOut {
            target: Quat::from_rotation_matrix(&axes),
            thrust: Vec3::z() * u.force.dot(&along).max(0.0),
            off: z.cross(&along).norm().atan2(z.dot(&along)),
            limited,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::planet::tests::Point;
    use super::*;
    use std::sync::Arc;

    fn law(tilt_max: f64, forward: Vec3, site: Option<Site>) -> ThrustDirection {
        let gravity = Handle::new("g", Arc::new(Point { mu: 4.3e13, site }) as Arc<dyn Gravity>);
        let (world, gravity) = (None, Some(gravity));
        ThrustDirection::build(ThrustDirectionParams { forward, tilt_max, world, gravity })
            .map_err(|e| e.message)
            .unwrap()
    }

    fn at(m: &ThrustDirection, body: NodeState, force: Vec3) -> ThrustDirectionOut {
        m.feedthrough(&Clock::at(0.0, 0.05, 0), &ThrustDirectionIn { body, force })
    }

    fn body() -> NodeState {
        NodeState {
            position: Vec3::new(1.2e6, -2.3e6, 2.1e6),
            rotation: Quat::from_scaled_axis(Vec3::new(0.3, -0.2, 0.8)),
            ..NodeState::identity()
        }
    }

    #[test]
    fn in_the_attitude_that_it_tells_all_of_the_force_is_given() {
        let m = law(3.1, Vec3::new(1.0, 2.0, 0.5), None);
        let force = Vec3::new(300.0, -800.0, 500.0);
        let told = at(&m, body(), force);
        let there = at(&m, NodeState { rotation: told.target, ..body() }, force);
        assert!((there.target * there.thrust - force).norm() < 1e-9 * force.norm());
        assert!(there.off < 1e-9 && !there.limited);
        // The x axis is as close to `forward` as z permits.
        let (x, y) = (told.target * Vec3::x(), told.target * Vec3::y());
        assert!(y.dot(&Vec3::new(1.0, 2.0, 0.5)).abs() < 1e-12 && x.dot(&Vec3::y()) > 0.0);
        // If the body is rotated away by an angle, the thrust is reduced by its cosine; beyond 90°
        // it is zero.
        let turned = |angle: f64| {
            let rotation = told.target * Quat::from_scaled_axis(Vec3::x() * angle);
            at(&m, NodeState { rotation, ..body() }, force)
        };
        assert!((turned(0.3).thrust.z - force.norm() * 0.3_f64.cos()).abs() < 1e-9);
        assert!((turned(0.3).off - 0.3).abs() < 1e-12 && turned(2.0).thrust == Vec3::zeros());
    }

    #[test]
    fn it_leans_no_further_than_it_may_from_the_vertical_of_its_place() {
        let up = body().position.normalize();
        let side = up.cross(&Vec3::x()).normalize();
        let m = law(0.6, Vec3::x(), None);
        for angle in [0.5_f64, 0.9, 2.5] {
            let y = at(&m, body(), (up * angle.cos() + side * angle.sin()) * 70.0);
            let want = angle.min(0.6);
            let z = y.target * Vec3::z();
            assert!((z - (up * want.cos() + side * want.sin())).norm() < 1e-12, "{angle}");
            assert_eq!(y.limited, angle > 0.6);
        }
        // At a site the vertical is the local one, and W has the axes of the site.
        let pose = linkwork_spatial::Pose::new(
            Quat::from_scaled_axis(Vec3::new(0.2, 0.5, -0.1)),
            Vec3::new(3.0e6, 1.0e6, 4e5),
        );
        let site = Site { pose, rate: 7e-5, start: Quat::identity() };
        let m = law(0.6, Vec3::x(), Some(site));
        let there = NodeState { position: Vec3::new(400.0, -3e3, 900.0), ..NodeState::identity() };
        let up = site.relative_to_centre(&there.position).normalize();
        let y = at(&m, there, -up * 5.0 + Vec3::x());
        assert!(((y.target * Vec3::z()).dot(&up) - 0.6_f64.cos()).abs() < 1e-12 && y.limited);
    }

    /// For a force straight down the tilt direction is undefined: the thrust tilts towards `forward`, or towards x or y of W, within the limit.
    #[test]
    fn a_force_straight_down_leans_no_further_than_it_may_either() {
        let up = body().position.normalize();
        for forward in [Vec3::y(), up, -up] {
            let y = at(&law(0.6, forward, None), body(), up * -50.0);
            let z = y.target * Vec3::z();
            assert!((z.dot(&up) - 0.6_f64.cos()).abs() < 1e-12 && y.limited, "{forward}: {z}");
        }
        let z = at(&law(0.6, Vec3::y(), None), body(), up * -50.0).target * Vec3::z();
        assert!(z.dot(&(Vec3::y() - up * up.y)) > 0.0, "{z}");
    }

    #[test]
    fn without_a_direction_it_stays_and_nonsense_is_refused() {
        let m = law(1.0, Vec3::x(), None);
        let y = at(&m, body(), Vec3::zeros());
        assert_eq!((y.target, y.thrust, y.limited), (body().rotation, Vec3::zeros(), false));
        // The axis x stays as close as possible to its present direction if the force is along `forward`.
        let m = law(3.1, Vec3::x(), None);
        let y = at(&m, body(), Vec3::x() * 9.0);
        let x = body().rotation * Vec3::x();
        assert!((y.target * Vec3::z() - Vec3::x()).norm() < 1e-12);
        assert!(
            (y.target * Vec3::y()).dot(&x).abs() < 1e-12 && (y.target * Vec3::x()).dot(&x) > 0.0
        );
        // x of the body is parallel to the force as well, so its y is used.
        let y = at(&m, NodeState { rotation: Quat::identity(), ..body() }, Vec3::x() * 9.0);
        assert!((y.target * Vec3::z() - Vec3::x()).norm() < 1e-12, "{:?}", y.target);
        let gravity = Arc::new(Point { mu: 1.0, site: None }) as Arc<dyn Gravity>;
        let (forward, gravity) = (Vec3::zeros(), Some(Handle::new("g", gravity)));
        let wrong = ThrustDirectionParams { forward, tilt_max: 1.0, world: None, gravity };
        let e = ThrustDirection::build(wrong).err().unwrap();
        assert!(e.param.as_deref() == Some("forward") && e.help.is_some());
    }
}
