//! `flight.plume`: pressure of the plume of an engine on flat panels of a body.
//! ```text
//! m(r, θ) = T (n + 2)/(2 π r²) cosⁿ θ        flux of momentum (Pa) at the distance r from the nozzle, θ from the plume's axis (θ < 90°)
//! F_k = −m A cos i [(1 − σ) 2 cos i n̂ + σ (−ê)]   cos i = −ê · n̂ > 0, ê: from the nozzle to the panel        M = Σ c_k × F_k
//! ```
//! The far field of Roberts (1964) and Simons: the gas moves away from the nozzle in straight lines into vacuum and carries the whole thrust T:
//! ∫ m cos θ dA = T. n = γ (γ − 1) M_e² for the Mach number M_e at the exit, some 5 to 15. σ = 1: the gas is absorbed (thermal speeds are
//! small beside the plume's); σ = 0: it is reflected specularly, twice Newton's pressure head on. Panels do not shade each other, and reflected gas
//! hits no other panel.

use crate::aerodynamics::panels::Panel;
use linkwork_runtime::prelude::*;
use std::f64::consts::PI;

/// Plume and panels.
#[derive(Params, Clone, Debug)]
pub struct PlumeParams {
    /// Panels of the body in the plume.
    pub panels: Vec<Panel>,
    /// Exponent n of the plume.
    #[param(default = 8.0, range = 0.0..=200.0)]
    pub exponent: f64,
    /// Fraction σ of the gas that is absorbed; the rest is reflected specularly.
    #[param(default = 1.0, range = 0.0..=1.0)]
    pub accommodation: f64,
    /// Direction of the gas, in the axes of the nozzle's node; thrusters push along +z.
    #[param(default = Vec3::new(0.0, 0.0, -1.0))]
    pub axis: Vec3,
    /// Distance below which the flux does not increase further: some radii of the exit.
    #[param(unit = "m", default = 0.05, range = 1e-4..)]
    pub near: f64,
}

/// The nozzle, its thrust, the body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PlumeIn {
    /// Node of the nozzle.
    #[port(bind = "nozzle")]
    pub nozzle: NodeState,
    /// Node of the body in the plume, with the axes of the panels.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Thrust now.
    #[port("N")]
    pub thrust: f64,
}

/// Load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PlumeOut {
    /// Load on the body at its node.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Size of the force.
    #[port("N")]
    pub force: f64,
    /// Greatest pressure on a panel.
    #[port("Pa")]
    pub pressure: f64,
}

/// A plume.
pub struct Plume {
    p: PlumeParams,
}

/// Ratio of momentum flux to thrust, 1/m², at a position relative to the nozzle (m), for a plume along a unit vector.
pub fn flux(place: &Vec3, axis: &Vec3, exponent: f64, near: f64) -> f64 {
    let r = place.norm();
    let cosine = if r > 0.0 { place.dot(axis) / r } else { 1.0 };
    if cosine <= 0.0 {
        return 0.0;
    }
    (exponent + 2.0) / (2.0 * PI * r.max(near).powi(2)) * cosine.powf(exponent)
}

/// Force and moment of an engine's plume on flat panels of a body, in vacuum.
#[model("flight.plume")]
impl Model for Plume {
    type Params = PlumeParams;
    type FeedthroughInputs = PlumeIn;
    type FeedthroughOutputs = PlumeOut;
    fn build(mut p: PlumeParams) -> Result<Self, BuildError> {
        p.axis = crate::axis::unit(p.axis, "[0, 0, -1]")?;
        crate::aerodynamics::panels::unit_normals(&mut p.panels)?;
        Ok(Plume { p })
    }
    fn feedthrough(&self, u: &PlumeIn) -> PlumeOut {
        let p = &self.p;
        let back = u.body.rotation.inverse();
        let from = back * (u.nozzle.position - u.body.position);
        let axis = back * (u.nozzle.rotation * p.axis);
        let thrust = u.thrust.max(0.0);
        let (mut force, mut moment, mut most) = (Vec3::zeros(), Vec3::zeros(), 0.0_f64);
        for k in &p.panels {
            let place = k.centre - from;
            let r = place.norm();
            let m = thrust * flux(&place, &axis, p.exponent, p.near);
            let cosine = if r > 0.0 { -place.dot(&k.normal) / r } else { 0.0 };
            if m == 0.0 || cosine <= 0.0 {
                continue;
            }
            let ahead = place / r;
            let kept = ahead * p.accommodation;
            let mirrored = k.normal * (-2.0 * cosine * (1.0 - p.accommodation));
            let f = (kept + mirrored) * (m * k.area * cosine);
            most = most.max(-f.dot(&k.normal) / k.area.max(f64::MIN_POSITIVE));
            force += f;
            moment += k.centre.cross(&f);
        }
        let R = u.body.rotation;
        let load = Wrench { moment: R * moment, force: R * force };
        PlumeOut { load, force: force.norm(), pressure: most }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plume(panels: Vec<Panel>, exponent: f64, accommodation: f64) -> Plume {
        Plume::build(PlumeParams {
            panels,
            exponent,
            accommodation,
            axis: Vec3::new(0.0, 0.0, -2.0),
            near: 0.05,
        })
        .unwrap()
    }

    fn met(m: &Plume, u: PlumeIn) -> PlumeOut {
        m.feedthrough(&u)
    }

    fn input() -> PlumeIn {
        let turn = Quat::from_euler_angles(0.3, -0.8, 1.1);
        let body = NodeState {
            position: Vec3::new(3.0, -1.0, 2.0),
            rotation: turn,
            ..NodeState::identity()
        };
        PlumeIn { nozzle: body, body, thrust: 40.0 }
    }

    /// A hemisphere of panels that face the nozzle receives the whole thrust.
    #[test]
    fn all_of_the_thrust_is_in_the_plume() {
        let (n, radius) = (200, 5.0);
        let mut panels = Vec::new();
        for i in 0..n {
            let theta = 0.5 * PI * (f64::from(i) + 0.5) / f64::from(n);
            for j in 0..64 {
                let phi = 2.0 * PI * (f64::from(j) + 0.5) / 64.0;
                let out = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), -theta.cos());
                let area =
                    radius * radius * theta.sin() * (0.5 * PI / f64::from(n)) * (2.0 * PI / 64.0);
                panels.push(Panel { area, normal: -out, centre: out * radius });
            }
        }
        for exponent in [0.0, 8.0, 15.0] {
            let y = met(&plume(panels.clone(), exponent, 1.0), input());
            let along = input().body.rotation.inverse() * y.load.force;
            assert!((along + Vec3::z() * 40.0).norm() < 2e-3, "{exponent}: {along}");
            assert!(y.load.moment.norm() < 1e-9);
        }
    }

    #[test]
    fn a_panel_in_front_feels_its_share() {
        let one = |normal: Vec3, centre: Vec3| vec![Panel { area: 0.3, normal, centre }];
        let ahead = Vec3::new(0.0, 0.0, -4.0);
        let head_on = 40.0 * 10.0 / (2.0 * PI * 16.0) * 0.3;
        let y = met(&plume(one(Vec3::z(), ahead), 8.0, 1.0), input());
        assert!((y.force - head_on).abs() < 1e-12 * head_on, "{} {head_on}", y.force);
        assert!((y.pressure - head_on / 0.3).abs() < 1e-9);
        let y = met(&plume(one(Vec3::z(), ahead), 8.0, 0.0), input());
        assert!((y.force - 2.0 * head_on).abs() < 1e-9, "mirrored");
        // At 30°, the flux decreases as cosⁿ, and the panel is hit obliquely.
        let (s, c) = (PI / 6.0).sin_cos();
        let y = met(&plume(one(Vec3::z(), Vec3::new(4.0 * s, 0.0, -4.0 * c)), 8.0, 1.0), input());
        assert!((y.force - head_on * c.powi(9)).abs() < 1e-9);
        // The back of the panel and panels behind the nozzle get no force.
        for (normal, centre) in [(-Vec3::z(), ahead), (-Vec3::z(), -ahead)] {
            assert_eq!(met(&plume(one(normal, centre), 8.0, 1.0), input()).force, 0.0);
        }
        // At distances below `near`, the flux does not increase further.
        let near = met(&plume(one(Vec3::z(), Vec3::z() * -1e-6), 8.0, 1.0), input());
        let at = met(&plume(one(Vec3::z(), Vec3::z() * -0.05), 8.0, 1.0), input());
        assert!((near.force - at.force).abs() < 1e-9);
    }
}
