//! `flight.panel_aerodynamics`: forces on flat panels, from the continuum to free molecular flow.
//! ```text
//! sin θ = n · v̂      head on: 1            v: velocity of the node through the air
//! continuum (Newton)   C_p = C_p,max sin²θ on the windward side, 0 on the lee, no shear
//! free molecules       C_p, C_τ of Schaaf and Chambré, both sides of the stream
//! F = −q A (C_p n + C_τ τ)     τ: the direction of motion along the panel
//! Kn = λ/L    λ = m/(√2 π d² ρ)    bridged by sin²
//! ```
//! Panels are listed in the file, or are the facets of a `mesh`, or both; listed panels (a solar array, an antenna) are added to the mesh. Panels do
//! not shade each other, so the model is correct for convex bodies. The rotation of the body has no effect on the forces.

use super::air_data::{AirData, gusty};
use super::rarefied::{bridge, free_molecular};
use crate::mesh::{MeshParams, some_panels};
use linkwork_surroundings::prelude::*;
use linkwork_world::gravity::polyhedron::Facet;

/// Flat panel.
#[derive(Params, Clone, Debug)]
pub struct Panel {
    /// Area.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// Outward normal, body axes; its length does not matter.
    pub normal: Vec3,
    /// Centre relative to the node, body axes.
    #[param(unit = "m", default = Vec3::zeros())]
    pub centre: Vec3,
}

/// Panels and gas properties.
#[derive(Params, Clone, Debug)]
pub struct PanelParams {
    /// Panels, one for each side that is exposed to the air; added to the facets of `mesh`.
    #[param(default = Vec::new())]
    pub panels: Vec<Panel>,
    /// Mesh whose facets are panels.
    pub mesh: Option<MeshParams>,
    /// Pressure coefficient at the stagnation point; 2: Newton.
    #[param(default = 2.0, range = 0.0..=4.0)]
    pub pressure_max: f64,
    /// Reference length of the Knudsen number.
    #[param(unit = "m", default = 1.0, range = 1e-6..)]
    pub length: f64,
    /// Fraction of molecules that are reflected diffusely (accommodation).
    #[param(default = 1.0, range = 0.0..=1.0)]
    pub diffuse: f64,
    /// Temperature of the wall.
    #[param(unit = "K", default = 300.0, range = 1.0..)]
    pub wall_temperature: f64,
    /// Molar mass of the gas; default: from pressure, density and temperature of the atmosphere, R ρ T/p.
    #[param(unit = "kg/mol", range = 1e-3..)]
    pub molar_mass: Option<f64>,
    /// Diameter of a molecule.
    #[param(unit = "m", default = 3.7e-10, range = 1e-11..)]
    pub molecule: f64,
    /// Atmosphere.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PanelIn {
    /// Node with body axes.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Gust velocity in addition to the wind, W, for example from `flight.gusts`.
    #[port("m/s", default = Vec3::zeros())]
    pub gust: Vec3,
}

/// Aerodynamic load and flow regime.
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
    /// Total angle of attack: angle between x and the velocity.
    #[port("rad")]
    pub alpha_total: f64,
}

/// Gas constant, J/(mol K), and Avogadro's number (both exact).
const GAS: f64 = 8.314_462_618_153_24;
const AVOGADRO: f64 = 6.022_140_76e23;

/// Returns the molar mass of `air` as a perfect gas, kg/mol; hydrogen in a vacuum.
fn molar_mass(air: &Air) -> f64 {
    let here = GAS * air.density * air.temperature / air.pressure;
    if here.is_finite() && here > 0.0 { here } else { 1.008e-3 }
}

/// Returns force and moment per dynamic pressure (m², m³), body axes.
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

/// Normalizes the normals of panels.
///
/// # Errors
/// A normal is the zero vector.
pub fn unit_normals(panels: &mut [Panel]) -> Result<(), BuildError> {
    for (k, panel) in panels.iter_mut().enumerate() {
        let length = panel.normal.norm();
        if !(length > 1e-9) {
            return Err(BuildError::new(format!(
                "the normal of panel {} is the zero vector",
                k + 1
            ))
            .help("write a direction, e.g. normal: [1, 0, 0]")
            .at("panels"));
        }
        panel.normal /= length;
    }
    Ok(())
}

/// Aerodynamics of flat panels.
pub struct PanelAerodynamics {
    p: PanelParams,
}

/// Aerodynamic force and moment of flat panels in Newtonian, transitional and free molecular flow.
#[model("flight.panel_aerodynamics")]
impl Model for PanelAerodynamics {
    type Params = PanelParams;
    type FeedthroughInputs = PanelIn;
    type FeedthroughOutputs = PanelOut;
    fn build(mut p: PanelParams) -> Result<Self, BuildError> {
        unit_normals(&mut p.panels)?;
        if let Some(mesh) = &p.mesh {
            let panel = |f: &Facet| Panel { area: f.area, normal: f.normal, centre: f.centre };
            p.panels.extend(mesh.facets()?.iter().map(panel));
        }
        some_panels(p.panels.len())?;
        Ok(PanelAerodynamics { p })
    }
    fn feedthrough(&self, clock: &Clock, u: &PanelIn) -> PanelOut {
        let p = &self.p;
        let air = gusty(&p.atmosphere, clock.t, &u.body.position, &u.gust);
        let data = AirData::of(&u.body, &air, &Vec3::zeros());
        let molar_mass = p.molar_mass.unwrap_or_else(|| molar_mass(&air));
        let molecule = molar_mass / AVOGADRO;
        let area = 2f64.sqrt() * std::f64::consts::PI * p.molecule * p.molecule;
        // In a vacuum the flow counts as free molecular, and the force is zero.
        let knudsen = (molecule / (area * air.density * p.length)).min(1e12);
        let mut load = Wrench::zero();
        if data.speed > 0.0 && data.pressure > 0.0 {
            let thermal = (2.0 * GAS / molar_mass * air.temperature).sqrt();
            let gas = (data.speed / thermal, p.diffuse, p.wall_temperature / air.temperature);
            let direction = data.velocity / data.speed;
            let (f, m) = sum(&p.panels, &direction, p.pressure_max, bridge(knudsen), gas);
            load.force = u.body.rotation * (f * data.pressure);
            load.moment = u.body.rotation * (m * data.pressure);
        }
        PanelOut { load, knudsen, dynamic_pressure: data.pressure, alpha_total: data.alpha_total() }
    }
}

/// Returns panels of a sphere-cone: nose at the origin, x forward, base radius 1; `rings` along each part, `around` panels per ring. The base is
/// omitted, because it is in the lee of the flow.
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
    // The cap extends from the nose to the polar angle π/2 − δ.
    let end = 0.5 * std::f64::consts::PI - half_angle;
    for i in 0..rings {
        let step = end / rings as f64;
        let (s, c) = ((i as f64 + 0.5) * step).sin_cos();
        ring(bluntness * (c - 1.0), bluntness * s, (c, s), bluntness * step);
    }
    // The cone extends from the seam to the base.
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
    use linkwork_surroundings::testing;
    use std::f64::consts::PI;

    /// Panels agree with the closed form.
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
                // The moment is about a point 0.3 behind the nose, divided by the diameter. Nose up
                // is +y.
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

    fn model(density: f64, panels: Vec<Panel>) -> Result<PanelAerodynamics, BuildError> {
        meshed(density, panels, None)
    }

    fn meshed(
        density: f64,
        panels: Vec<Panel>,
        mesh: Option<MeshParams>,
    ) -> Result<PanelAerodynamics, BuildError> {
        let atmosphere = testing::air(move |_, _| {
            let wind = Vec3::zeros();
            Air { density, pressure: 1.0, temperature: 900.0, speed_of_sound: 600.0, wind }
        });
        PanelAerodynamics::build(PanelParams {
            panels,
            mesh,
            pressure_max: 1.84,
            length: 1.0,
            diffuse: 1.0,
            wall_temperature: 300.0,
            molar_mass: Some(0.02897),
            molecule: 3.7e-10,
            atmosphere,
        })
    }

    /// US Standard Atmosphere 1976 at 400 km: 2.803e-12 kg/m³, 995.83 K, 1.4524e-6 Pa, whose molecular mass is 15.98 g/mol: atomic oxygen.
    #[test]
    fn the_gas_is_that_of_the_atmosphere() {
        let (density, temperature, pressure) = (2.803e-12, 995.83, 1.4524e-6);
        let air =
            Air { density, pressure, temperature, speed_of_sound: 850.0, wind: Vec3::zeros() };
        assert!((molar_mass(&air) / 0.01598 - 1.0).abs() < 2e-3, "{}", molar_mass(&air));
        let none = Air { density: 0.0, pressure: 0.0, ..air };
        assert!(molar_mass(&none) > 0.0);
    }

    #[test]
    fn a_plate_goes_from_newton_to_free_molecules_as_the_air_gets_thin() {
        let plate = || vec![Panel { area: 2.0, normal: Vec3::x() * 3.0, centre: Vec3::y() }];
        let at = |density: f64| {
            let body = NodeState { velocity: Vec3::x() * 7500.0, ..NodeState::identity() };
            let m = model(density, plate()).unwrap();
            m.feedthrough(&Clock::at(0.0, 0.01, 0), &PanelIn { body, gust: Vec3::zeros() })
        };
        let coefficient = |y: &PanelOut| -y.load.force.x / (y.dynamic_pressure * 2.0);
        let (thick, thin) = (at(1e-2), at(1e-12));
        assert!(thick.knudsen < 1e-3 && thin.knudsen > 10.0);
        assert!((coefficient(&thick) - 1.84).abs() < 1e-12);
        let s = 7500.0 / (2.0 * 8.314_462_618_153_24 / 0.02897 * 900.0f64).sqrt();
        let want = free_molecular(1.0, s, 1.0, 1.0 / 3.0).0;
        assert!((coefficient(&thin) - want).abs() < 1e-12 && want > 2.0 && want < 2.5);
        // The plate is on the right, so its drag rotates the nose to the right (+z).
        assert!((thick.load.moment.z + thick.load.force.x).abs() < 1e-9);
        assert_eq!(at(0.0).load, Wrench::zero());
        let flat = vec![Panel { area: 1.0, normal: Vec3::zeros(), centre: Vec3::zeros() }];
        assert!(model(1.0, flat).is_err_and(|e| e.param.as_deref() == Some("panels")));
    }

    /// Returns the OBJ text of a complete sphere-cone with base. The corners are on the surface, so the mesh is inside it.
    fn obj(delta: f64, nu: f64, rings: usize, around: usize) -> String {
        let mut text = "v 0 0 0\n".to_string();
        let (sd, cd) = delta.sin_cos();
        let end = 0.5 * PI - delta;
        let cap = (1..=rings).map(|i| {
            let (s, c) = (end * i as f64 / rings as f64).sin_cos();
            (nu * (c - 1.0), nu * s)
        });
        let cone = (1..=rings).map(|i| {
            let radius = nu * cd + (1.0 - nu * cd) * i as f64 / rings as f64;
            (nu * (sd - 1.0) - (radius - nu * cd) * cd / sd, radius)
        });
        for (x, radius) in cap.chain(cone) {
            for j in 0..around {
                let (s, c) = (2.0 * PI * j as f64 / around as f64).sin_cos();
                text += &format!("v {x:?} {:?} {:?}\n", radius * c, radius * s);
            }
        }
        let at = |ring: usize, j: usize| 2 + ring * around + j % around;
        for j in 0..around {
            text += &format!("f 1 {} {}\n", at(0, j), at(0, j + 1));
            for ring in 1..2 * rings {
                let (a, b) = (at(ring - 1, j), at(ring - 1, j + 1));
                text += &format!("f {a} {} {} {b}\n", at(ring, j), at(ring, j + 1));
            }
        }
        let base: Vec<String> =
            (0..around).rev().map(|j| at(2 * rings - 1, j).to_string()).collect();
        text + &format!("f {}\n", base.join(" "))
    }

    /// The model with a mesh converges to the closed form with the square of the facet size, at any roll angle.
    #[test]
    fn a_meshed_sphere_cone_goes_to_the_closed_form() {
        let (delta, nu, size) = (70f64.to_radians(), 0.5, 1.5);
        let exact = SphereCone { half_angle: delta, bluntness: nu, pressure_max: 1.84 };
        let built = |n: usize| {
            let mut mesh = crate::mesh::tests::mesh(&obj(delta, nu, n, 4 * n));
            // The node is 0.3 base radii behind the nose.
            (mesh.scale, mesh.origin) = (size, Vec3::new(0.3 * size, 0.0, 0.0));
            meshed(1e-2, vec![], Some(mesh)).unwrap()
        };
        let (coarse, fine) = (built(8), built(32));
        for (alpha, roll) in [(0.0_f64, 0.0_f64), (0.19, 0.0), (0.35, 1.1), (-0.2, 2.0)] {
            let want = exact.at(alpha, 0.3);
            let across = Vec3::new(0.0, roll.sin(), roll.cos());
            let velocity = (Vec3::x() * alpha.cos() + across * alpha.sin()) * 7000.0;
            let error = |m: &PanelAerodynamics| -> f64 {
                let body = NodeState { velocity, ..NodeState::identity() };
                let u = PanelIn { body, gust: Vec3::zeros() };
                let y = m.feedthrough(&Clock::at(0.0, 0.01, 0), &u);
                let qs = y.dynamic_pressure * PI * size * size;
                let nose_up = Vec3::x().cross(&-across);
                [
                    -y.load.force.x / qs - want.axial,
                    -y.load.force.dot(&across) / qs - want.normal,
                    y.load.moment.dot(&nose_up) / (qs * 2.0 * size) - want.pitch,
                ]
                .map(f64::abs)
                .iter()
                .sum()
            };
            let (coarse, fine) = (error(&coarse), error(&fine));
            assert!(coarse < 2e-2 && fine < 1e-3, "{alpha}: {coarse:e} {fine:e}");
            // The error with facets four times smaller is a sixteenth, apart from higher-order terms.
            assert!((12.0..20.0).contains(&(coarse / fine)), "{alpha}: {coarse:e} {fine:e}");
        }
    }

    #[test]
    fn typed_panels_count_beside_the_mesh_and_no_surface_is_refused() {
        let array = || vec![Panel { area: 3.0, normal: Vec3::x(), centre: Vec3::y() * 2.0 }];
        let cube = || Some(crate::mesh::tests::mesh(crate::mesh::tests::CUBE));
        let force = |m: PanelAerodynamics| {
            let body = NodeState { velocity: Vec3::x() * 7500.0, ..NodeState::identity() };
            let u = PanelIn { body, gust: Vec3::zeros() };
            let y = m.feedthrough(&Clock::at(0.0, 0.01, 0), &u);
            y.load.force.x / y.dynamic_pressure
        };
        let both = force(meshed(1e-2, array(), cube()).unwrap());
        assert!((both + 1.84 * (4.0 + 3.0)).abs() < 1e-12, "{both}");
        let alone = force(meshed(1e-2, vec![], cube()).unwrap());
        assert!((alone + 1.84 * 4.0).abs() < 1e-12, "{alone}");
        let none = meshed(1e-2, vec![], None).err().unwrap();
        assert!(none.param.as_deref() == Some("panels") && none.help.is_some());
        let bad = meshed(1e-2, array(), Some(crate::mesh::tests::mesh(""))).err().unwrap();
        assert!(bad.param.as_deref() == Some("mesh") && bad.help.is_some());
    }
}
