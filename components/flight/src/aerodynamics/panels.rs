//! `flight.panel_aerodynamics`: forces on flat panels, from the continuum to free molecular flow.
//! ```text
//! sin θ = n · v̂      head on: 1            v: velocity of the node through the air
//! continuum (Newton)   C_p = C_p,max sin²θ on the windward side, 0 on the lee, no shear
//! free molecules       C_p, C_τ of Schaaf and Chambré, both sides of the stream
//! F = −q A (C_p n + C_τ τ)     τ: the direction of motion along the panel
//! Kn = λ/L    λ = m/(√2 π d² ρ)    bridged by sin²
//! ```
//! No panel shades another: right for convex bodies. The turning of the body is not felt by the panels.

use super::air_data::{AirData, gusty};
use super::rarefied::{bridge, free_molecular};
use linkwork_runtime::prelude::*;

/// A flat panel.
#[derive(Params, Clone, Debug)]
pub struct Panel {
    /// Area.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// Outward normal, body axes; its length does not matter.
    pub normal: Vec3,
    /// Centre, from the node, body axes.
    #[param(unit = "m", default = Vec3::zeros())]
    pub centre: Vec3,
}

/// Panels and gas.
#[derive(Params, Clone, Debug)]
pub struct PanelParams {
    /// The panels, one for each side that the air reaches.
    pub panels: Vec<Panel>,
    /// Pressure coefficient at the stagnation point; 2: Newton.
    #[param(default = 2.0, range = 0.0..=4.0)]
    pub pressure_max: f64,
    /// Length of the Knudsen number.
    #[param(unit = "m", default = 1.0, range = 1e-6..)]
    pub length: f64,
    /// Share of molecules that leave the wall diffusely.
    #[param(default = 1.0, range = 0.0..=1.0)]
    pub diffuse: f64,
    /// Temperature of the wall.
    #[param(unit = "K", default = 300.0, range = 1.0..)]
    pub wall_temperature: f64,
    /// Molar mass of the gas: air 0.02897, carbon dioxide 0.04401.
    #[param(unit = "kg/mol", default = 0.02897, range = 1e-3..)]
    pub molar_mass: f64,
    /// Diameter of a molecule.
    #[param(unit = "m", default = 3.7e-10, range = 1e-11..)]
    pub molecule: f64,
    /// The air.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PanelIn {
    /// Node with body axes.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Gust over the wind, W, as of `flight.gusts`.
    #[port("m/s", default = Vec3::zeros())]
    pub gust: Vec3,
}

/// Load, and in which flow it is.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PanelOut {
    /// Force and moment at the node.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Knudsen number.
    #[port("1")]
    pub knudsen: f64,
    /// Dynamic pressure.
    #[port("Pa")]
    pub dynamic_pressure: f64,
    /// Angle between x and the velocity.
    #[port("rad")]
    pub alpha_total: f64,
}

/// Gas constant, J/(mol K), and Avogadro's number (both exact).
const GAS: f64 = 8.314_462_618_153_24;
const AVOGADRO: f64 = 6.022_140_76e23;

/// Force and moment coefficients times area (m², m³), body axes: what q is multiplied with.
///
/// `direction`: unit vector of motion, body axes; `share` of free molecules; `(s, a, wall)` as in
/// [`free_molecular`].
pub fn sum(
    panels: &[Panel],
    direction: &Vec3,
    pressure_max: f64,
    share: f64,
    (speed_ratio, diffuse, wall): (f64, f64, f64),
) -> (Vec3, Vec3) {
    let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
    for p in panels {
        let sine = p.normal.dot(direction);
        let newton = if sine > 0.0 { pressure_max * sine * sine } else { 0.0 };
        let (mut normal, mut shear) = (newton * (1.0 - share), 0.0);
        if share > 0.0 {
            let (cp, ct) = free_molecular(sine, speed_ratio, diffuse, wall);
            normal += share * cp;
            shear = share * ct;
        }
        let along = direction - p.normal * sine;
        let length = along.norm();
        let along = if length > 1e-12 { along / length } else { Vec3::zeros() };
        let f = (p.normal * normal + along * shear) * -p.area;
        force += f;
        moment += p.centre.cross(&f);
    }
    (force, moment)
}

/// Makes the normals unit vectors.
///
/// # Errors
/// A normal without length.
pub fn unit_normals(panels: &mut [Panel]) -> Result<(), BuildError> {
    for (k, panel) in panels.iter_mut().enumerate() {
        let length = panel.normal.norm();
        if !(length > 1e-9) {
            return Err(BuildError::new(format!("the normal of panel {} has no length", k + 1))
                .help("write a direction, e.g. normal: [1, 0, 0]")
                .at("panels"));
        }
        panel.normal /= length;
    }
    Ok(())
}

/// Panels in a stream.
pub struct PanelAerodynamics {
    p: PanelParams,
}

/// Aerodynamic force and moment of flat panels, from Newtonian flow through the bridge to free molecules.
#[model("flight.panel_aerodynamics")]
impl Model for PanelAerodynamics {
    type Params = PanelParams;
    type Ud = PanelIn;
    type Yd = PanelOut;
    fn build(mut p: PanelParams) -> Result<Self, BuildError> {
        unit_normals(&mut p.panels)?;
        Ok(PanelAerodynamics { p })
    }
    fn direct(&self, c: &Clock, _: &(), _: &(), u: &PanelIn) -> PanelOut {
        let p = &self.p;
        let air = gusty(&p.atmosphere, c.t, &u.body.position, &u.gust);
        let data = AirData::of(&u.body, &air, &Vec3::zeros());
        let molecule = p.molar_mass / AVOGADRO;
        let area = 2f64.sqrt() * std::f64::consts::PI * p.molecule * p.molecule;
        // Without any air the flow is free, and the force zero.
        let knudsen = (molecule / (area * air.density * p.length)).min(1e12);
        let mut load = Wrench::zero();
        if data.speed > 0.0 && data.pressure > 0.0 {
            let thermal = (2.0 * GAS / p.molar_mass * air.temperature).sqrt();
            let gas = (data.speed / thermal, p.diffuse, p.wall_temperature / air.temperature);
            let direction = data.velocity / data.speed;
            let (f, m) = sum(&p.panels, &direction, p.pressure_max, bridge(knudsen), gas);
            load.force = u.body.rotation * (f * data.pressure);
            load.moment = u.body.rotation * (m * data.pressure);
        }
        PanelOut { load, knudsen, dynamic_pressure: data.pressure, alpha_total: data.alpha_total }
    }
}

/// Panels of a sphere-cone: nose at the origin, x forward, base radius 1; `rings` along each part, `around` of them in
/// a ring. The base is left out: the lee of Newtonian flow.
pub fn sphere_cone(half_angle: f64, bluntness: f64, rings: usize, around: usize) -> Vec<Panel> {
    let (sd, cd) = half_angle.sin_cos();
    let mut panels = Vec::new();
    let turn = 2.0 * std::f64::consts::PI / around as f64;
    let mut ring = |x: f64, radius: f64, n: (f64, f64), width: f64| {
        for j in 0..around {
            let (s, c) = ((j as f64 + 0.5) * turn).sin_cos();
            panels.push(Panel {
                area: width * radius * turn,
                normal: Vec3::new(n.0, n.1 * c, n.1 * s),
                centre: Vec3::new(x, radius * c, radius * s),
            });
        }
    };
    // The cap: polar angle from the nose to π/2 − δ.
    let end = 0.5 * std::f64::consts::PI - half_angle;
    for i in 0..rings {
        let step = end / rings as f64;
        let (s, c) = ((i as f64 + 0.5) * step).sin_cos();
        ring(bluntness * (c - 1.0), bluntness * s, (c, s), bluntness * step);
    }
    // The cone: from the seam to the base.
    let seam = bluntness * cd;
    let x0 = bluntness * (sd - 1.0);
    for i in 0..rings {
        let step = (1.0 - seam) / rings as f64;
        let radius = seam + (i as f64 + 0.5) * step;
        ring(x0 - (radius - seam) * cd / sd, radius, (sd, cd), step / sd);
    }
    panels
}

#[cfg(test)]
mod tests {
    use super::super::sphere_cone::SphereCone;
    use super::*;
    use std::f64::consts::PI;
    use std::sync::Arc;

    /// Two ways to one number: panels and the closed form.
    #[test]
    fn panels_go_to_the_closed_form_with_the_square_of_their_size() {
        let (delta, nu) = (70f64.to_radians(), 0.5);
        let exact = SphereCone { half_angle: delta, bluntness: nu, pressure_max: 2.0 };
        for alpha in [0.0, 0.1, 0.3, -0.2] {
            let want = exact.at(alpha, 0.3);
            let found = |n: usize| {
                let panels = sphere_cone(delta, nu, n, 4 * n);
                let v = Vec3::new(f64::cos(alpha), 0.0, f64::sin(alpha));
                let (f, m) = sum(&panels, &v, 2.0, 0.0, (1.0, 1.0, 1.0));
                // About a point 0.3 behind the nose, over the diameter; nose up is +y.
                let m = m + Vec3::new(0.3, 0.0, 0.0).cross(&f);
                [-f.x / PI, -f.z / PI, m.y / PI / 2.0]
            };
            let error = |n: usize| -> f64 {
                let want = [want.axial, want.normal, want.pitch];
                found(n).iter().zip(want).map(|(a, b)| (a - b).abs()).sum()
            };
            let (coarse, fine) = (error(20), error(80));
            assert!(fine < 3e-5 && fine < coarse / 12.0 + 1e-13, "{alpha}: {coarse:e} {fine:e}");
        }
    }

    struct Gas(f64);
    impl Atmosphere for Gas {
        fn air(&self, _: f64, _: Vec3) -> Air {
            let wind = Vec3::zeros();
            Air { density: self.0, pressure: 1.0, temperature: 900.0, speed_of_sound: 600.0, wind }
        }
    }

    fn model(density: f64, panels: Vec<Panel>) -> Result<PanelAerodynamics, BuildError> {
        let atmosphere = Handle::new("air", Arc::new(Gas(density)) as Arc<dyn Atmosphere>);
        PanelAerodynamics::build(PanelParams {
            panels,
            pressure_max: 1.84,
            length: 1.0,
            diffuse: 1.0,
            wall_temperature: 300.0,
            molar_mass: 0.02897,
            molecule: 3.7e-10,
            atmosphere,
        })
    }

    #[test]
    fn a_plate_goes_from_newton_to_free_molecules_as_the_air_gets_thin() {
        let plate = || vec![Panel { area: 2.0, normal: Vec3::x() * 3.0, centre: Vec3::y() }];
        let at = |density: f64| {
            let body = NodeState { velocity: Vec3::x() * 7500.0, ..NodeState::identity() };
            let m = model(density, plate()).unwrap();
            m.direct(
                &Clock::at(0.0, 0.01, 0),
                &(),
                &(),
                &PanelIn { body, gust: Vec3::zeros() },
                &(),
            )
        };
        let coefficient = |y: &PanelOut| -y.load.force.x / (y.dynamic_pressure * 2.0);
        let (thick, thin) = (at(1e-2), at(1e-12));
        assert!(thick.knudsen < 1e-3 && thin.knudsen > 10.0);
        assert!((coefficient(&thick) - 1.84).abs() < 1e-12);
        let s = 7500.0 / (2.0 * 8.314_462_618_153_24 / 0.02897 * 900.0f64).sqrt();
        let want = free_molecular(1.0, s, 1.0, 1.0 / 3.0).0;
        assert!((coefficient(&thin) - want).abs() < 1e-12 && want > 2.0 && want < 2.5);
        // The plate is to the right: a drag there turns the nose to the right (+z).
        assert!((thick.load.moment.z + thick.load.force.x).abs() < 1e-9);
        assert_eq!(at(0.0).load, Wrench::zero());
        let flat = vec![Panel { area: 1.0, normal: Vec3::zeros(), centre: Vec3::zeros() }];
        assert!(model(1.0, flat).is_err_and(|e| e.param.as_deref() == Some("panels")));
    }
}
