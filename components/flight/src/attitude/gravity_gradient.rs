//! `flight.gravity_gradient`: gravity-gradient torque, which aligns a long body with the vertical.
//! ```text
//! M = 3 μ/r³ r̂ × (I r̂)      body axes      I about the centre of mass, r from the planet's centre to it
//! ```
//! The planet is a point mass, and the torque is of first order in the body's size over r; J₂ of the Earth changes it by about 0.1 %. This torque
//! needs this part, because gravity acts on each body of the mechanism at its centre of mass. For bodies that are small or locked together, use one
//! part on one of them with the `inertia` of the whole. For bodies that are far apart, use one part on each body: gravity on each body already gives
//! the torque due to their distance, and the part adds the torque due to the body's own inertia, which it reads from the body.

use crate::orbit::body_mu;
use linkwork_spatial::{MassProperties, Mat3};
use linkwork_surroundings::prelude::*;
use linkwork_world::gravity::torque;

/// Parameters of the gravity-gradient torque.
#[derive(Params, Clone, Debug)]
pub struct GravityGradientParams {
    /// Moments of inertia xx, yy, zz about the centre of mass, axes of the node; default: the inertia of the body itself, without mass that wires
    /// add. For bodies that are locked together, write the inertia of the whole; the node is then used as the centre of mass.
    #[param(unit = "kg m^2")]
    pub inertia: Option<Vec3>,
    /// With `inertia`: products of inertia xy, xz, yz (matrix elements).
    #[param(unit = "kg m^2", default = Vec3::zeros())]
    pub products: Vec3,
    /// The world, whose body attracts.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GravityGradientIn {
    /// Node with the axes of the inertia.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Mass and inertia of its body.
    #[port(bind = "body")]
    pub own: BodyMass,
}

/// Gravity-gradient torque.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GravityGradientOut {
    /// Torque as a load on the body.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Torque in the axes of the node.
    #[port("N m")]
    pub torque: Vec3,
}

/// Gravity-gradient torque on a body.
pub struct GravityGradient {
    mu: f64,
    /// Inertia from the file; `None` uses the body's own inertia.
    inertia: Option<Mat3>,
    site: Option<Site>,
}

impl GravityGradientParams {
    /// Returns the inertia matrix from the file.
    fn written(&self) -> Option<Mat3> {
        let (i, j) = (self.inertia?, self.products);
        Some(Mat3::new(i.x, j.x, j.y, j.x, i.y, j.z, j.y, j.z, i.z))
    }
}

/// Gravity-gradient torque of a planet on a body.
#[model("flight.gravity_gradient")]
impl Model for GravityGradient {
    type Params = GravityGradientParams;
    type FeedthroughInputs = GravityGradientIn;
    type FeedthroughOutputs = GravityGradientOut;
    fn build(p: GravityGradientParams) -> Result<Self, BuildError> {
        let inertia = p.written();
        if let Some(inertia) = inertia {
            // Use any mass, because the inertia is about the centre of mass.
            MassProperties::new(1.0, Vec3::zeros(), inertia).validate().map_err(|e| {
                BuildError::new(format!("this inertia is not physically possible: {e}"))
                    .help("correct it, or leave it out to use the body's own inertia")
                    .at(if p.products == Vec3::zeros() { "inertia" } else { "products" })
            })?;
        } else if p.products != Vec3::zeros() {
            return Err(BuildError::new("`products` is written without `inertia`")
                .help("write both, or neither to use the body's own inertia")
                .at("products"));
        }
        let (mu, site) = (body_mu(&p.world)?, p.world.axes().place());
        Ok(GravityGradient { mu, inertia, site })
    }
    fn feedthrough(&self, u: &GravityGradientIn) -> GravityGradientOut {
        let (inertia, at) = match self.inertia {
            Some(inertia) => (inertia, u.body.position),
            None => (u.own.inertia_matrix(), u.body.position + u.body.rotation * u.own.com),
        };
        let r = self.site.map_or(at, |s| s.relative_to_centre(&at));
        let torque = torque(self.mu, &inertia, &(u.body.rotation.inverse() * r));
        let load = Wrench { moment: u.body.rotation * torque, force: Vec3::zeros() };
        GravityGradientOut { load, torque }
    }
    fn startup_warnings(&self, u: &GravityGradientIn) -> Vec<BuildError> {
        let own = u.own.inertia_matrix();
        let differs = |written: &Mat3| (written - own).amax() > 1e-6 * own.amax();
        let told = self.inertia.filter(differs).map(|written| {
            let moments =
                |m: &Mat3| format!("({:.6}, {:.6}, {:.6})", m[(0, 0)], m[(1, 1)], m[(2, 2)]);
            let fact = format!(
                "`inertia` is {} kg m^2 about the axes of the node, but its body has {}",
                moments(&written),
                moments(&own)
            );
            let help = "remove `inertia`, unless it is the inertia of several bodies that are locked together";
            BuildError::new(fact).help(help).at("inertia")
        });
        told.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::tests::fast_site;
    use linkwork_surroundings::PlainWorld;

    const MU: f64 = 3.986_004_418e14;

    fn params() -> GravityGradientParams {
        GravityGradientParams {
            inertia: Some(Vec3::new(900.0, 1100.0, 1500.0)),
            products: Vec3::new(20.0, -15.0, 30.0),
            world: PlainWorld::inertial(MU, 6_378_137.0, 0.0).handle(),
        }
    }

    /// A body of 70 kg with the inertia of [`params`], its centre of mass off the node.
    fn own() -> BodyMass {
        let inertia = [900.0, 1100.0, 1500.0, 20.0, -15.0, 30.0];
        BodyMass { mass: 70.0, com: Vec3::new(2e4, -1e4, 3e4), inertia }
    }

    fn at(p: GravityGradientParams, body: NodeState) -> GravityGradientOut {
        let m = GravityGradient::build(p).unwrap();
        let u = GravityGradientIn { body, own: own() };
        m.feedthrough(&u)
    }

    /// By default the torque uses the body's own inertia and centre of mass; a different `inertia` in the file causes a warning.
    #[test]
    fn unwritten_it_is_the_inertia_of_the_body() {
        let rotation = Quat::from_euler_angles(0.4, 0.2, -0.6);
        let body =
            NodeState { position: Vec3::new(3e6, -5e6, 4e6), rotation, ..NodeState::identity() };
        let bare = GravityGradientParams { inertia: None, products: Vec3::zeros(), ..params() };
        let centre = NodeState { position: body.position + rotation * own().com, ..body };
        let (unwritten, written) = (at(bare.clone(), body), at(params(), centre));
        assert!(
            (unwritten.torque - written.torque).norm() < 1e-15 && unwritten.torque.norm() > 1e-4
        );
        assert!((unwritten.torque - at(params(), body).torque).norm() > 1e-6);
        let remarks = |p: &GravityGradientParams| {
            let m = GravityGradient::build(p.clone()).unwrap();
            let u = GravityGradientIn { body, own: own() };
            m.startup_warnings(&u)
        };
        assert!(remarks(&bare).is_empty() && remarks(&params()).is_empty());
        let other = GravityGradientParams { products: Vec3::new(20.0, -15.0, 30.1), ..params() };
        let told = remarks(&other);
        assert!(told.len() == 1 && told[0].message.contains("but its body has"), "{told:?}");
        let half = GravityGradientParams { inertia: None, ..params() };
        let e = GravityGradient::build(half).err().unwrap();
        assert!(e.param.as_deref() == Some("products") && e.help.is_some());
    }

    /// Compares with the golden values of `framework/world/tests/gravity.rs` and with the gravity on six point masses that have this inertia.
    #[test]
    fn it_is_the_sum_of_the_pull_on_the_parts_of_the_body() {
        let rotation = Quat::from_euler_angles(0.4, 0.2, -0.6);
        let r = Vec3::new(3e6, -5e6, 4e6);
        let body = NodeState { position: rotation * r, rotation, ..NodeState::identity() };
        let y = at(params(), body);
        let golden =
            Vec3::new(-0.0005239084965177083, -0.0004907625748529336, -0.00022052184617788614);
        assert!((y.torque - golden).norm() < 1e-17, "{}", y.torque);
        assert!((rotation * golden - y.load.moment).norm() < 1e-17 && y.load.force.norm() == 0.0);
        // Represent the body by two masses m/2 at ±√(k/m) along each principal axis of ∫ x xᵀ dm,
        // whose eigenvalues are k.
        let p = params();
        let inertia = p.written().unwrap();
        let spread = (Mat3::identity() * (0.5 * inertia.trace()) - inertia).symmetric_eigen();
        // Use arms of some kilometres, so that the difference is above round-off.
        let (mut moment, mass) = (Vec3::zeros(), 1e-4);
        for k in 0..3 {
            let axis = spread.eigenvectors.column(k) * (spread.eigenvalues[k] / mass).sqrt();
            for arm in [axis, -axis] {
                let at = r + arm;
                moment += arm.cross(&(at * (-MU * 0.5 * mass / at.norm().powi(3))));
            }
        }
        assert!((moment - golden).norm() < 1e-4 * golden.norm(), "{moment}");
    }

    #[test]
    fn from_a_site_it_is_that_of_inertial_axes() {
        let (site, _) = fast_site();
        let world = PlainWorld::of_site(MU, 6_378_137.0, site).handle();
        let body = NodeState {
            position: Vec3::new(3e5, -2e5, 1e5),
            rotation: Quat::from_euler_angles(0.4, 0.2, -0.6),
            ..NodeState::identity()
        };
        let here = at(GravityGradientParams { world, ..params() }, body);
        let turn = site.to_inertial(40.0);
        let position = turn * site.relative_to_centre(&body.position);
        let outside = NodeState { position, rotation: turn * body.rotation, ..body };
        let there = at(params(), outside);
        assert!((here.torque - there.torque).norm() < 1e-12 * there.torque.norm());
        assert!((turn * here.load.moment - there.load.moment).norm() < 1e-12 * there.torque.norm());
        assert!(there.torque.norm() > 1e-4);
    }

    #[test]
    fn an_inertia_that_no_body_has_is_refused() {
        for (inertia, products, name) in [
            (Vec3::new(1.0, 1.0, 3.0), Vec3::zeros(), "inertia"),
            (Vec3::new(-1.0, 1.0, 1.0), Vec3::zeros(), "inertia"),
            (Vec3::new(2.0, 2.0, 2.0), Vec3::new(3.0, 0.0, 0.0), "products"),
        ] {
            let p = GravityGradientParams { inertia: Some(inertia), products, ..params() };
            let e = GravityGradient::build(p).err().unwrap();
            assert!(e.param.as_deref() == Some(name) && e.help.is_some(), "{}", e.message);
        }
        // The inertias of a thin rod and of a plate are valid.
        for inertia in [Vec3::new(0.0, 5.0, 5.0), Vec3::new(1.0, 2.0, 3.0)] {
            let products = Vec3::zeros();
            let p = GravityGradientParams { inertia: Some(inertia), products, ..params() };
            assert!(GravityGradient::build(p).is_ok());
        }
    }
}
