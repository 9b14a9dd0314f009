//! `mobility.wheel_soil_quasi_static`: massless wheel on soft ground for quasi-static machines, by the stress integrals of `terramechanics` in steady
//! rolling.
//! ```text
//! z                   the sinkage that carries N at the slip s and the slip angle β
//! c, R_x              of the drawbar pull at ±|u_x|, so that c is what rolling resists
//! R_y = −F_y(u)/u_y
//! ```
use super::{QuasiStaticIn, ROLLING, Sliding, idle};
use crate::multipass::Rut;
use crate::ruts::{Ruts, Tracks};
use crate::terramechanics::{Motion, WheelForces, WheelSoil};
use crate::wheel_soil::{WheelSoilModel, WheelSoilParams};
use linkwork_runtime::prelude::*;

/// Ground reaction and print.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SoilQuasiStaticOut {
    /// Traction for the force balance of the machine.
    #[port(bind = "hub")]
    pub traction: Traction,
    /// Normal force; negative if the wheel would have to be pulled down.
    #[port("N")]
    pub normal_force: f64,
    /// Slip (rω − v)/max(|rω|, |v|), signed.
    #[port("1")]
    pub slip: f64,
    /// Angle of the hub's velocity to the heading.
    #[port("rad")]
    pub slip_angle: f64,
    /// Sinkage below the undisturbed surface.
    #[port("m", bind = "field")]
    pub sinkage: f64,
    /// Depth of the rut under the wheel.
    #[port("m")]
    pub rut: f64,
    /// Point where the load acts, W.
    #[port("m", bind = "field")]
    pub contact_point: Vec3,
    /// Force of the ground, W.
    #[port("N")]
    pub contact_force: Vec3,
    /// Drive torque on the axle.
    #[port("N m")]
    pub torque: f64,
    /// Power dissipated in the soil.
    #[port("W")]
    pub power: f64,
    /// Ground normal, unit, W.
    #[port("1", bind = "field")]
    pub print_normal: Vec3,
    /// Heading of the wheel in the ground plane, unit, W.
    #[port("1", bind = "field")]
    pub print_heading: Vec3,
    /// Radius of the rim, for the print.
    #[port("m", bind = "field")]
    pub print_radius: f64,
    /// Width of the rim, for the print.
    #[port("m", bind = "field")]
    pub print_width: f64,
    /// Sinkage modulus of the print, N/m^(n+2).
    #[port("1", bind = "field")]
    pub print_modulus: f64,
    /// Sinkage exponent of the print.
    #[port("1", bind = "field")]
    pub print_exponent: f64,
}

/// Massless wheel on soft ground.
pub struct WheelSoilQuasiStatic {
    model: WheelSoilModel,
}

/// Least slip at which the stresses are evaluated.
const LEAST_SLIP: f64 = 1e-5;
/// Greatest slip of a braked wheel; a locked wheel is treated as one that rotates slowly.
const BRAKED: f64 = 0.95;
/// Sinkage, relative to the radius, of a wheel that the soil cannot support.
const DEEPEST: f64 = 1.5;

/// Returns the motion of a wheel whose rim slides at `u` (m/s) along and across the direction of travel; slip is relative to `scale` (m/s).
fn motion(u: [f64; 2], scale: f64, rolling: f64) -> Motion {
    let s = (-u[0] / scale).clamp(-BRAKED, 1.0);
    let (rim, speed) = if s >= 0.0 { (1.0, 1.0 - s) } else { (1.0 + s, 1.0) };
    let lateral = u[1] / (scale * rim);
    let beta = u[1].atan2(scale * speed.max(1e-6));
    Motion { slip: 1.0 - speed / rim, lateral, rolling, beta }
}

impl WheelSoilQuasiStatic {
    /// Returns the sinkage (m) in a rut at which the soil supports the load (N).
    fn sinks(soil: &WheelSoil, load: f64, motion: &Motion, rut: &Rut) -> f64 {
        soil.sinkage_in(load, motion, rut).unwrap_or(DEEPEST * soil.rim.radius)
    }
}

/// Wheel on soft ground for a quasi-static machine: the stresses of `mobility.wheel_soil` in steady rolling, at the sinkage that supports the load.
/// The parameters for damping and unloading have no effect.
#[model("mobility.wheel_soil_quasi_static")]
impl Model for WheelSoilQuasiStatic {
    type Params = WheelSoilParams;
    type FeedthroughInputs = QuasiStaticIn;
    type FeedthroughOutputs = SoilQuasiStaticOut;
    type Store = View<Tracks>;
    fn without_effect(&self, _: IsWired<'_>) -> Judged {
        let names = ["shear_damping", "shear_unloading", "normal_damping", "unloading_stiffness"];
        idle(names, "damping nor unloading", "mobility.wheel_soil")
    }
    fn build(p: WheelSoilParams) -> Result<Self, BuildError> {
        Ok(WheelSoilQuasiStatic { model: WheelSoilModel::build(p)? })
    }
    fn feedthrough(
        &self,
        clock: &Clock,
        u: &QuasiStaticIn,
        store: &View<Tracks>,
    ) -> SoilQuasiStaticOut {
        let (p, force) = (self.model.params(), u.load.force);
        let wheel = Sliding::of(u, p.radius, &*p.terrain);
        let constants = self.model.soil(&wheel.hub);
        let (forwards, load, scale) = (wheel.direction(), wheel.carries, wheel.scale);
        let spoke = u.hub.rotation * Vec3::x();
        let contact = self.model.contact(constants, clock.t, &wheel.hub, spoke);
        let ahead = wheel.axes[0] * forwards;
        let soil = contact.stresses_at(constants, &ahead, &wheel.normal);
        let travel = 0.5 * (wheel.rim + wheel.speed);
        let rolling = (travel.abs() / ROLLING).min(1.0);
        // Sliding velocities in the direction of travel, with a lower bound so that differences of the law
        // exceed round-off.
        let [ahead, side] = [forwards * wheel.slides[0], wheel.slides[1]];
        let [a, b] = [ahead, side].map(|u| u.abs().max(LEAST_SLIP * scale));
        let aside = b.copysign(side);
        let now = motion([ahead, side], scale, rolling);
        let rut = match store.with::<Ruts>() {
            Some((store, tracks)) if load > 0.0 => {
                let fresh = Self::sinks(&soil, load, &now, &Rut::default());
                let m = forwards * rolling;
                contact.met(&store.past(tracks), fresh, &wheel.point, wheel.axes, m)
            }
            _ => Rut::default(),
        };
        let z = if load > 0.0 { Self::sinks(&soil, load, &now, &rut) } else { 0.0 };
        let at = |u: f64| soil.forces_in(z, &motion([u, aside], scale, rolling), &rut);
        let [drives, brakes]: [WheelForces; 2] = [at(-a), at(a)];
        let is = if ahead < 0.0 { drives } else { brakes };
        let still = forwards * 0.5 * (drives.fx + brakes.fx);
        let resistance = [(0.5 * (drives.fx - brakes.fx) / a).max(0.0), (-is.fy / aside).max(0.0)];
        // Compute the greatest forces, at full slip along and across, with the sinkage at that
        // slip.
        let most = |u: [f64; 2]| {
            let motion = motion(u, scale, rolling);
            let flat = soil.forces_in(z, &motion, &rut).fz.max(f64::MIN_POSITIVE);
            let power = constants.n + constants.n1 * motion.slip_scale().abs() + 0.5;
            let deeper = (z * (load / flat).powf(1.0 / power)).min(DEEPEST * soil.rim.radius);
            let there = soil.forces_in(deeper, &motion, &rut);
            let share = if there.fz > 0.0 { load / there.fz } else { 0.0 };
            [there.fx * share, there.fy * share]
        };
        let ([spins, _], [_, shoved]) = (most([-scale, 0.0]), most([0.0, scale]));
        let limit = [
            (forwards * spins - still).abs().max(resistance[0] * a),
            shoved.abs().max(resistance[1] * b),
        ];
        let sinkage = if z > 0.0 { z + rut.depth() } else { 0.0 };
        let torque = forwards * is.torque;
        let (modulus, exponent) = soil.press(&now);
        let [heading, across] = wheel.axes;
        let pushes = heading * (forwards * is.fx) + across * is.fy;
        // This is the moment of the stresses about the hub, minus the moment of their resultant at the
        // contact point.
        let arm = wheel.point - wheel.hub.position;
        let moment = heading * (is.mx + arm.dot(&across) * load) - wheel.hub.axle * torque
            + wheel.normal * (forwards * is.mz)
            - arm.cross(&(pushes + wheel.normal * load));
        SoilQuasiStaticOut {
            traction: Traction { force: heading * still, moment, resistance, limit, sinkage },
            normal_force: force.dot(&wheel.normal),
            slip: wheel.slip(),
            slip_angle: wheel.slip_angle(),
            sinkage,
            rut: rut.depth(),
            contact_point: wheel.point,
            contact_force: force,
            torque,
            power: torque * wheel.hub.angular.dot(&wheel.hub.axle)
                - pushes.dot(&wheel.hub.velocity),
            print_normal: wheel.normal,
            print_heading: heading,
            print_radius: contact.wheel.radius,
            print_width: contact.wheel.width,
            print_modulus: modulus,
            print_exponent: exponent,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wheel_rigid::tests::{gravity, plane};
    use crate::wheel_soil::ShearLaw;

    fn wheel() -> WheelSoilQuasiStatic {
        let p = WheelSoilParams {
            radius: 0.25,
            width: 0.4,
            grousers: None,
            shear: ShearLaw::Isotropic,
            shear_damping: 0.02,
            shear_unloading: 20.0,
            normal_damping: 4.0,
            unloading_stiffness: 3e5,
            terrain: plane(0.0),
            gravity: gravity(3.71),
        };
        WheelSoilQuasiStatic::build(p).unwrap()
    }

    /// Wheel with rim speed `rim` (m/s), sliding at `u` (m/s), under 400 N.
    fn slides(rim: f64, u: [f64; 2]) -> SoilQuasiStaticOut {
        let hub = NodeState {
            position: Vec3::new(0.0, 0.0, 0.25),
            rotation: Quat::identity(),
            angular: Vec3::y() * (rim / 0.25),
            velocity: Vec3::new(rim + u[0], u[1], 0.0),
        };
        let load = ContactLoad { force: Vec3::z() * 400.0, point: Vec3::zeros() };
        let u = QuasiStaticIn { hub, load };
        wheel().feedthrough(&Clock::at(0.0, 0.02, 0), &u, &View::default())
    }

    fn steady(s: f64, beta: f64) -> (f64, WheelForces) {
        let (model, soil) = (wheel(), crate::test_soils::lunar());
        let hub = crate::wheel_rigid::hub_of(&NodeState::identity());
        let stresses = model.model.contact(&soil, 0.0, &hub, Vec3::x()).stresses(&soil);
        let motion = Motion::rolling(s, beta);
        let z = stresses.sinkage_under(400.0, &motion).unwrap();
        (z, stresses.forces(z, &motion))
    }

    #[test]
    fn where_it_slides_the_force_is_that_of_steady_rolling() {
        // Test driven and braked wheels, forwards and backwards, with and without a slip angle.
        for (s, beta) in [(0.3_f64, 0.0_f64), (0.1, 0.2), (-0.2, -0.1), (0.6, 0.0)] {
            for way in [1.0, -1.0] {
                let (rim, speed) =
                    if s >= 0.0 { (0.1, 0.1 * (1.0 - s)) } else { (0.1 * (1.0 + s), 0.1) };
                let u = [way * (speed - rim), speed * beta.tan()];
                let (y, (z, expected)) = (slides(way * rim, u), steady(s, beta));
                let t = y.traction;
                let fx = t.force.x - t.resistance[0] * u[0];
                assert!((fx - way * expected.fx).abs() < 1e-6, "{s} {beta}: {fx} {}", expected.fx);
                if beta != 0.0 {
                    let fy = -t.resistance[1] * u[1];
                    assert!((fy - expected.fy).abs() < 1e-6, "{s} {beta}: {fy} {}", expected.fy);
                }
                assert!((y.sinkage - z).abs() < 1e-9, "{} {z}", y.sinkage);
                assert!((y.torque - way * expected.torque).abs() < 1e-6);
                assert!(y.power > 0.0, "{}", y.power);
                assert!((y.slip - way * s).abs() < 1e-9, "{} {s}", y.slip);
            }
        }
    }

    #[test]
    fn parked_it_holds_and_pushes_nowhere() {
        let t = slides(0.0, [0.0, 0.0]).traction;
        // The secant resistance of a wheel at rest opposes a speed of 1 nm/s with the coefficient for a
        // small slip.
        assert!(t.force.norm() < 1e-5, "{t:?}");
        assert!(t.resistance.iter().all(|r| *r > 1e9), "{t:?}");
        assert!(t.sinkage > 0.003, "{t:?}");
    }

    #[test]
    fn resistance_is_never_a_push() {
        for k in 0..200 {
            let (a, b) = (0.11 * f64::from(k % 20 - 10), 0.03 * f64::from(k / 20 - 5));
            for rim in [0.0, 0.2, -0.2] {
                let t = slides(rim, [a, b]).traction;
                assert!(
                    t.resistance.iter().all(|r| r.is_finite() && *r >= 0.0),
                    "{rim} {a} {b}: {t:?}"
                );
                assert!(t.force.iter().all(|f| f.is_finite()));
            }
        }
    }
}
