//! `mobility.foot`: a flat sole, round or rectangular, on deformable ground, for legs, landers and grippers. It needs a
//! `mobility.scm_ground`.
//!
//! Pressure and shear act on each node under the sole (`scm`), so that the sole tilts into the ground, holds below the Mohr-Coulomb limit, slides
//! above it, and leaves a print. The soil constants are those of the terrain under its middle. Its edge does not push soil aside, and a sole that is
//! tilted by more than 84 degrees exerts no pressure.

use crate::rigid_contact::Hub;
use crate::scm::contact::{Damping, GroundLoad, Law};
use crate::scm::ground::{Imprint, ScmGround, Touched};
use crate::scm::shape::{Form, Presser};
use crate::terramechanics::presses_back;
use crate::wheel_scm::{ScmOut, without_ground};
use linkwork_surroundings::prelude::*;

/// Outline of a sole.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub enum Outline {
    /// A disc.
    Round,
    /// A rectangle along the node's x and y axes.
    Rectangular,
}

/// Sole and contact constants.
#[derive(Params, Clone, Debug)]
pub struct FootParams {
    /// Outline of the sole.
    #[param(default = Outline::Round)]
    pub outline: Outline,
    /// Diameter of a round sole; length of a rectangular one along the node's x axis.
    #[param(unit = "m", range = 1e-3..)]
    pub length: f64,
    /// Width of a rectangular sole along the node's y axis, m; default: its length.
    #[param(default = None)]
    pub width: Option<f64>,
    /// Damping time of the shear; damping displaces the soil by at most a twentieth of its shear modulus.
    #[param(unit = "s", default = 0.02, range = 0.0..)]
    pub shear_damping: f64,
    /// Normal damping: the pressure increases by this fraction per m/s of approach.
    #[param(unit = "s/m", default = 4.0, range = 0.0..)]
    pub normal_damping: f64,
    /// The ground.
    #[param(service)]
    pub terrain: Handle<dyn Terrain>,
}

/// The node of the sole.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FootIn {
    /// Middle of the sole; z points up into the foot.
    #[port(bind = "hub")]
    pub hub: NodeState,
}

/// A flat sole.
pub struct Foot {
    p: FootParams,
    form: Form,
}

/// Least width of a sole, m.
const LEAST: f64 = 1e-3;

impl Foot {
    fn presser(&self, n: &NodeState) -> Presser {
        let hub = Hub {
            position: n.position,
            axle: n.rotation * Vec3::z(),
            velocity: n.velocity,
            angular: n.angular,
        };
        Presser { form: self.form, hub, along: n.rotation * Vec3::x() }
    }
}

/// Flat sole on deformable ground, with pressure, shear and print of each node under it. It needs a `mobility.scm_ground`.
#[model("mobility.foot")]
impl Model for Foot {
    type Params = FootParams;
    type FeedthroughInputs = FootIn;
    type FeedthroughOutputs = ScmOut;
    fn build(p: FootParams) -> Result<Self, BuildError> {
        p.terrain.needs_soil()?;
        let form = match (p.outline, p.width) {
            (Outline::Round, None) => Form::Disc { radius: 0.5 * p.length },
            (Outline::Round, Some(_)) => {
                let fact = "`width` is written, but a round sole has only a diameter, `length`";
                let help = "remove `width`, or write `outline: Rectangular`";
                return Err(BuildError::new(fact).at("width").help(help));
            }
            (Outline::Rectangular, width) => {
                let width = width.unwrap_or(p.length);
                if !(width >= LEAST && width.is_finite()) {
                    let fact = format!("the width of the sole is {width} m");
                    let help = "write at least 1 mm";
                    return Err(BuildError::new(fact).at("width").help(help));
                }
                Form::Plate { length: p.length, width }
            }
        };
        let (narrow, param) = match form {
            Form::Plate { length, width } if width < length => (width, "width"),
            Form::Plate { length, .. } => (length, "length"),
            Form::Disc { radius } | Form::Rim { radius, .. } => (radius, "length"),
        };
        let soils = p.terrain.soils();
        soils.iter().try_for_each(|soil| presses_back(soil, narrow, param))?;
        Ok(Foot { p, form })
    }
    type Store = View<Touched>;
    fn feedthrough(&self, clock: &Clock, u: &FootIn, store: &View<Touched>) -> ScmOut {
        let p = &self.p;
        let presser = self.presser(&u.hub);
        let at = u.hub.position;
        let law = Law::of(p.terrain.soil(at.x, at.y), presser.narrow(), 0.0);
        let damping = Damping { shear: p.shear_damping, normal: p.normal_damping };
        let load = match store.with::<ScmGround>() {
            Some((field, data)) => field.load(data, &presser, &law, &damping, clock.t),
            None => GroundLoad::none(at),
        };
        // A sole does not rotate, so it slips like a wheel that does not rotate.
        let v = u.hub.velocity - load.normal * load.normal.dot(&u.hub.velocity);
        let slides = if load.area > 0.0 { v.norm() } else { 0.0 };
        let slip = [-(slides / slides.max(1e-3)), 0.0];
        ScmOut::of(&load, &Imprint::of(&presser, 0.0), slip)
    }
    fn startup_warnings(&self, store: &View<Touched>) -> Vec<BuildError> {
        without_ground(store)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scm::ground::ScmGroundParams;
    use crate::test_soils::lunar;
    use crate::wheel_rigid::tests::plane;

    fn params(outline: Outline, length: f64, width: Option<f64>) -> FootParams {
        FootParams {
            outline,
            length,
            width,
            shear_damping: 0.02,
            normal_damping: 4.0,
            terrain: plane(0.0),
        }
    }

    fn ground() -> ScmGround {
        ScmGround::build(ScmGroundParams {
            cell: 0.01,
            region: None,
            stiffness: 0.0,
            stiffness_growth: 5.03e8,
            shear_unloading: 20.0,
            bulldozing: 0.0,
            repose: 0.6,
            terrain: plane(0.0),
        })
        .unwrap()
    }

    #[test]
    fn a_loaded_sole_sinks_as_bekker_says_holds_on_a_slope_and_slides_beyond_its_limit() {
        let foot = Foot::build(params(Outline::Rectangular, 0.3, Some(0.2))).unwrap();
        let field = ground();
        let law = Law::of(&lunar(), 0.2, 0.0);
        let (weight, dt): (f64, f64) = (600.0, 1e-3);
        let sinks = weight / (0.06 * law.k);
        let limit = 170.0 * 0.06 + weight * 33f64.to_radians().tan();
        for (share, slides) in [(0.7, false), (1.05, true)] {
            let mut data = Touched::default();
            let mut hub = NodeState::identity();
            let mut last = Vec3::zeros();
            for k in 0..6000_u64 {
                let clock = Clock::at(dt * k as f64, dt, k);
                let view = View::of(ground(), data.clone());
                let y = foot.feedthrough(&clock, &FootIn { hub }, &view);
                // First the foot is loaded slowly, and then it is pulled.
                let weight = weight * (k as f64 / 1500.0).min(1.0);
                let pull = share * limit * ((k as f64 - 1500.0) / 2000.0).clamp(0.0, 1.0);
                let force = y.load.force + Vec3::new(0.0, pull, -weight);
                hub.velocity += force / 60.0 * dt;
                last = hub.velocity;
                hub.position += hub.velocity * dt;
                let print = Imprint::of(&foot.presser(&hub), 0.0);
                field.update(&Clock::at(dt * (k + 1) as f64, dt, k + 1), &mut data, &[print], &[]);
                if slides && k > 3000 && hub.velocity.y > 0.05 {
                    break;
                }
            }
            println!(
                "{share}: {:.5} m deep, {:.5} m along, {last:?}",
                -hub.position.z, hub.position.y
            );
            if slides {
                assert!(hub.velocity.y > 0.01, "{hub:?}");
            } else {
                assert!(last.norm() < 1e-7 && hub.position.y < 0.04, "{hub:?}");
                assert!((-hub.position.z / sinks - 1.0).abs() < 0.02, "{hub:?} {sinks}");
            }
        }
    }

    #[test]
    fn a_tilted_sole_is_turned_back() {
        let foot = Foot::build(params(Outline::Round, 0.4, None)).unwrap();
        let mut hub = NodeState::identity();
        hub.position.z = -0.01;
        hub.rotation = Quat::from_axis_angle(&Vec3::x_axis(), 0.03);
        let view = View::of(ground(), Touched::default());
        let y = foot.feedthrough(&Clock::at(0.0, 1e-3, 0), &FootIn { hub }, &view);
        assert!(y.load.moment.x < -1.0 && y.load.moment.y.abs() < 1e-6, "{:?}", y.load);
        assert!(y.normal_force > 0.0 && y.contact_point.y < -0.01, "{y:?}");
    }

    #[test]
    fn a_sole_that_is_none_is_refused() {
        for (outline, width) in [
            (Outline::Round, Some(0.1)),
            (Outline::Rectangular, Some(0.0)),
            (Outline::Rectangular, Some(f64::NAN)),
        ] {
            let e = Foot::build(params(outline, 0.2, width)).err().unwrap();
            assert!(e.param.as_deref() == Some("width") && e.help.is_some(), "{outline:?}: {e:?}");
        }
        let foot = Foot::build(params(Outline::Rectangular, 0.1, None)).unwrap();
        let told = foot.startup_warnings(&View::default());
        assert!(told[0].message.contains("mobility.scm_ground"), "{told:?}");
    }
}
