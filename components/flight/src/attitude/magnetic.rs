//! `flight.magnetic_field`, `flight.magnetic_torquer`: coils that push against a planet's field.
//! ```text
//! B = (a/r)³ (3 (m · r̂) r̂ − m)      a = 6371.2 km, m = (g₁¹, h₁¹, g₁⁰) in the planet's axes, which turn about z of W,
//!                                    or are those of the site that W is: then the field stands still in W
//! M = d × B                          d: the dipole of the coils, body axes, within its limit by axis
//! ```

use linkwork_runtime::prelude::*;
use linkwork_world::magnetic::dipole;

/// A planet's dipole.
#[derive(Params, Clone, Debug)]
pub struct FieldParams {
    /// (g₁¹, h₁¹, g₁⁰); as it stands of the Earth in 2020 (IGRF).
    #[param(unit = "T", default = Vec3::new(-1.4509e-6, 4.6525e-6, -2.94048e-5))]
    pub dipole: Vec3,
    /// Rate of the planet about z of W; unwritten: the Earth's, and in a site the site's.
    #[param(unit = "rad/s")]
    pub rate: Option<f64>,
    /// Angle from x of W to its prime meridian at t = 0; unwritten: 0, and in a site the site's.
    #[param(unit = "rad")]
    pub angle: Option<f64>,
    /// Gravity, which knows the site that W may be.
    #[param(service)]
    pub gravity: Option<Handle<dyn Gravity>>,
}

/// Where.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FieldIn {
    /// Where the field is wanted; the planet is at the origin of W, or under the site that W is.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// The field.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FieldOut {
    /// Flux density, W.
    #[port("T")]
    pub field: Vec3,
    /// Flux density in the axes of the node: what a magnetometer shows.
    #[port("T")]
    pub in_body: Vec3,
}

/// A magnetic field.
pub struct MagneticField {
    dipole: Vec3,
    /// Rate (rad/s) and angle (rad) at t = 0 about z of W.
    turn: (f64, f64),
    site: Option<Site>,
}

/// Of the Earth, rad/s.
const RATE: f64 = 7.292_115e-5;

/// The magnetic field of a planet as a tilted dipole that turns with it.
#[model("flight.magnetic_field")]
impl Model for MagneticField {
    type Params = FieldParams;
    type Ud = FieldIn;
    type Yd = FieldOut;
    fn build(p: FieldParams) -> Result<Self, BuildError> {
        let site = p.gravity.as_ref().and_then(|g| g.site());
        for (name, written) in [("rate", p.rate), ("angle", p.angle)] {
            if let (Some(gravity), Some(_), Some(_)) = (&p.gravity, site, written) {
                let fact = format!("`{name}` is written, and `{}` knows the site", gravity.path());
                return Err(BuildError::new(fact).help(format!("take `{name}` out")).at(name));
            }
        }
        let turn = (p.rate.unwrap_or(RATE), p.angle.unwrap_or(0.0));
        Ok(MagneticField { dipole: p.dipole, turn, site })
    }
    fn direct(&self, c: &Clock, _: &(), _: &(), u: &FieldIn) -> FieldOut {
        let field = if let Some(site) = &self.site {
            site.from_planet_axes(&dipole(&self.dipole, &site.to_planet(&u.body.position)))
        } else {
            let (rate, angle) = self.turn;
            let turn = Quat::from_scaled_axis(Vec3::z() * (angle + rate * c.t));
            turn * dipole(&self.dipole, &(turn.inverse() * u.body.position))
        };
        FieldOut { field, in_body: u.body.rotation.inverse() * field }
    }
}

/// Coils.
#[derive(Params, Clone, Debug)]
pub struct TorquerParams {
    /// Greatest dipole about each axis.
    #[param(unit = "A m^2", range = 0.0..)]
    pub dipole_max: f64,
}

/// Body, command and field.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TorquerIn {
    /// Node with the axes of the coils.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Dipole that is asked for, axes of the node.
    #[port("A m^2")]
    pub dipole: Vec3,
    /// Flux density, W.
    #[port("T")]
    pub field: Vec3,
}

/// Load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TorquerOut {
    /// On the body.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Dipole that there is, axes of the node.
    #[port("A m^2")]
    pub given: Vec3,
}

/// Three coils.
pub struct MagneticTorquer {
    p: TorquerParams,
}

/// Three coils whose dipole feels a torque in a magnetic field.
#[model("flight.magnetic_torquer")]
impl Model for MagneticTorquer {
    type Params = TorquerParams;
    type Ud = TorquerIn;
    type Yd = TorquerOut;
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &TorquerIn) -> TorquerOut {
        let limit = self.p.dipole_max;
        let given = u.dipole.map(|d| d.clamp(-limit, limit));
        let moment = (u.body.rotation * given).cross(&u.field);
        TorquerOut { load: Wrench { moment, force: Vec3::zeros() }, given }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::tests::fast_site;

    #[test]
    fn the_field_turns_with_the_planet() {
        let dipole = Vec3::new(-1.4509e-6, 4.6525e-6, -2.94048e-5);
        let p = FieldParams { dipole, rate: Some(1e-4), angle: Some(0.3), gravity: None };
        let m = MagneticField::build(p).unwrap();
        // Computed elsewhere, in the planet's axes.
        let r = Vec3::new(6.9e6, 1.0e6, 2.0e6);
        let want =
            Vec3::new(-1.6128006771743223e-05, -5.633075575567971e-06, 1.4968916584129132e-05);
        let turn = Quat::from_scaled_axis(Vec3::z() * (0.3 + 1e-4 * 500.0));
        let rotation = Quat::from_scaled_axis(Vec3::new(0.4, 0.2, -0.6));
        let body = NodeState { position: turn * r, rotation, ..NodeState::identity() };
        let y = m.direct(&Clock::at(500.0, 0.1, 0), &(), &(), &FieldIn { body }, &());
        assert!((turn.inverse() * y.field - want).norm() < 1e-18, "{}", y.field);
        assert!((rotation * y.in_body - y.field).norm() < 1e-20);
    }

    #[test]
    fn from_a_site_it_is_the_field_of_inertial_axes() {
        let (site, gravity) = fast_site();
        let dipole = Vec3::new(-1.4509e-6, 4.6525e-6, -2.94048e-5);
        let p = FieldParams { dipole, rate: None, angle: None, gravity: Some(gravity) };
        let here = MagneticField::build(p.clone()).unwrap();
        // Axes in which the planet turns about z, as the other one has them.
        let about_z = Site { start: Quat::from_scaled_axis(Vec3::z() * 0.3), ..site };
        let (rate, angle) = (Some(site.rate), Some(0.3));
        let there = FieldParams { dipole, rate, angle, gravity: None };
        let there = MagneticField::build(there).unwrap();
        let body = NodeState {
            position: Vec3::new(3e5, -2e5, 1e5),
            rotation: Quat::from_euler_angles(0.4, 0.2, -0.6),
            ..NodeState::identity()
        };
        for t in [0.0, 40.0] {
            let turn = about_z.to_inertial(t);
            let (position, rotation) =
                (turn * site.from_centre(&body.position), turn * body.rotation);
            let outside = NodeState { position, rotation, ..body };
            let c = Clock::at(t, 0.1, 0);
            let a = here.direct(&c, &(), &(), &FieldIn { body }, &());
            let b = there.direct(&c, &(), &(), &FieldIn { body: outside }, &());
            assert!((turn * a.field - b.field).norm() < 1e-18, "{} {}", a.field, b.field);
            assert!((a.in_body - b.in_body).norm() < 1e-18 && a.field.norm() > 1e-6);
        }
        for (wrong, name) in [
            (FieldParams { rate: Some(0.05), ..p.clone() }, "rate"),
            (FieldParams { angle: Some(0.3), ..p }, "angle"),
        ] {
            let e = MagneticField::build(wrong).err().unwrap();
            assert!(e.message.contains("`gravity` knows the site"), "{}", e.message);
            assert!(e.param.as_deref() == Some(name) && e.help.unwrap().contains(name));
        }
    }

    #[test]
    fn coils_push_across_the_field_within_their_limit() {
        let m = MagneticTorquer { p: TorquerParams { dipole_max: 10.0 } };
        let rotation = Quat::from_scaled_axis(Vec3::new(0.4, 0.2, -0.6));
        let field = Vec3::new(1e-5, -2e-5, 3e-5);
        let body = NodeState { rotation, ..NodeState::identity() };
        let u = TorquerIn { body, dipole: Vec3::new(4.0, -30.0, 1.0), field };
        let y = m.direct(&Clock::at(0.0, 0.1, 0), &(), &(), &u, &());
        assert_eq!(y.given, Vec3::new(4.0, -10.0, 1.0));
        let want = (rotation * y.given).cross(&field);
        assert!((y.load.moment - want).norm() < 1e-20 && y.load.moment.dot(&field).abs() < 1e-20);
    }
}
