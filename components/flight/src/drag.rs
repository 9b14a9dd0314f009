//! `flight.drag`: drag of a blunt body, with Mach number and stagnation heating.
//! ```text
//! v = velocity − wind        F = −½ ρ |v| v C_D A        β = m/(C_D A)
//! M = |v|/a                  q̇ = k √(ρ/r_n) |v|³         (Sutton, Graves 1971; bounded in thin air, see `AirData::heating`)
//! ```
//! k = 1.9027e-4 (Mars), 1.7415e-4 (Earth), SI: W/m². The force acts at the node and gives no moment there.

use crate::aerodynamics::AirData;
use crate::aerodynamics::air_data::heating_constant;
use linkwork_surroundings::prelude::*;

/// Shape and air.
#[derive(Params, Clone, Debug)]
pub struct DragParams {
    /// Drag coefficient.
    #[param(range = 0.0..)]
    pub coefficient: f64,
    /// Reference area.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// Nose radius.
    #[param(unit = "m", default = 1.0, range = 1e-6..)]
    pub nose_radius: f64,
    /// Constant k (kg^½/m) of Sutton and Graves; default: from the gas of the atmosphere.
    #[param(range = 0.0..)]
    pub heating_constant: Option<f64>,
    /// The air.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DragIn {
    /// Node at which the drag acts.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Gust over the wind, W, as of `flight.gusts`.
    #[port("m/s", default = Vec3::zeros())]
    pub gust: Vec3,
}

/// Force and related quantities.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DragOut {
    /// Drag.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Size of the drag.
    #[port("N")]
    pub drag: f64,
    /// Speed through the air.
    #[port("m/s")]
    pub airspeed: f64,
    /// Dynamic pressure.
    #[port("Pa")]
    pub dynamic_pressure: f64,
    /// Mach number.
    #[port("1")]
    pub mach: f64,
    /// Heat flux at the stagnation point.
    #[port("W/m^2")]
    pub heating: f64,
    /// Density of the air.
    #[port("kg/m^3")]
    pub density: f64,
}

/// Drag.
pub struct Drag {
    p: DragParams,
    heating: f64,
}

/// Drag of a blunt body in an atmosphere, its Mach number and stagnation heating.
#[model("flight.drag")]
impl Model for Drag {
    type Params = DragParams;
    type FeedthroughInputs = DragIn;
    type FeedthroughOutputs = DragOut;
    fn build(p: DragParams) -> Result<Self, BuildError> {
        let heating = heating_constant(p.heating_constant, &p.atmosphere)?;
        Ok(Drag { p, heating })
    }
    fn feedthrough(&self, clock: &Clock, u: &DragIn) -> DragOut {
        let p = &self.p;
        let a = AirData::met(&p.atmosphere, clock.t, &u.body, &Vec3::zeros(), &u.gust);
        let through = u.body.rotation * a.velocity;
        let force = through * (-0.5 * a.density * a.speed * p.coefficient * p.area);
        DragOut {
            load: Wrench { moment: Vec3::zeros(), force },
            drag: a.pressure * p.coefficient * p.area,
            airspeed: a.speed,
            dynamic_pressure: a.pressure,
            mach: a.mach,
            heating: a.heating(self.heating, p.nose_radius),
            density: a.density,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::testing;

    fn drag(wind: Vec3) -> Drag {
        let p = DragParams {
            coefficient: 1.6,
            area: 5.5,
            nose_radius: 0.66,
            heating_constant: Some(1.9027e-4),
            atmosphere: testing::air(move |_, p| Air {
                density: 0.020 * (-p.z / 11_100.0).exp(),
                pressure: 0.0,
                temperature: 200.0,
                speed_of_sound: 230.0,
                wind,
            }),
        };
        Drag::build(p).unwrap()
    }

    fn at(d: &Drag, position: Vec3, velocity: Vec3) -> DragOut {
        let body = NodeState { position, velocity, ..NodeState::identity() };
        d.feedthrough(&Clock::at(0.0, 0.01, 0), &DragIn { body, gust: Vec3::zeros() })
    }

    #[test]
    fn drag_opposes_the_motion_through_the_air() {
        let y = at(&drag(Vec3::zeros()), Vec3::zeros(), Vec3::new(100.0, 0.0, 0.0));
        assert!((y.load.force - Vec3::new(-0.5 * 0.020 * 1e4 * 8.8, 0.0, 0.0)).norm() < 1e-9);
        assert!((y.mach - 100.0 / 230.0).abs() < 1e-12);
        let y = at(&drag(Vec3::new(100.0, 0.0, 0.0)), Vec3::zeros(), Vec3::new(100.0, 0.0, 0.0));
        assert_eq!(y.drag, 0.0, "carried by the wind");
    }

    #[test]
    fn heating_is_sutton_and_graves() {
        let y =
            at(&drag(Vec3::zeros()), Vec3::new(0.0, 0.0, 40_000.0), Vec3::new(6000.0, 0.0, 0.0));
        let want = 1.9027e-4 * (y.density / 0.66).sqrt() * 6000f64.powi(3);
        // Heating follows the law of a dense gas, except for the bound by the energy of the stream.
        let ratio = want / (0.5 * y.density * 6000f64.powi(3));
        let bounded = want / (1.0 + ratio * ratio).sqrt();
        assert!(
            (y.heating / bounded - 1.0).abs() < 1e-9 && y.heating > 1e4 && ratio < 0.1,
            "{ratio}"
        );
    }

    /// No more than the energy that the gas brings, however thin it is; nothing without gas.
    #[test]
    fn heating_is_bounded_by_the_energy_of_the_gas() {
        for h in [0.0, 80e3, 120e3, 180e3, 400e3] {
            let y = at(&drag(Vec3::zeros()), Vec3::z() * h, Vec3::x() * 7800.0);
            let most = 0.5 * y.density * 7800f64.powi(3);
            assert!(y.heating > 0.0 && y.heating <= most, "{h}: {} {most}", y.heating);
            let continuous = 1.9027e-4 * (y.density / 0.66).sqrt() * 7800f64.powi(3);
            assert!(y.heating <= continuous);
            if h > 300e3 {
                assert!(y.heating > 0.999 * most);
            }
        }
        let none = at(&drag(Vec3::zeros()), Vec3::z() * 1e8, Vec3::x() * 7800.0);
        assert_eq!(none.heating, 0.0);
    }

    #[test]
    fn a_gas_whose_constant_is_not_known_is_refused() {
        let p = DragParams { heating_constant: None, ..drag(Vec3::zeros()).p };
        let e = Drag::build(p).err().unwrap();
        assert!(e.param.as_deref() == Some("heating_constant") && e.help.is_some());
    }

    #[test]
    fn steep_entry_follows_allen_and_eggers() {
        // Allen and Eggers: a straight line at 14.06° over flat ground, starting above the atmosphere, without gravity.
        // The solution is V = V_E exp(−ρ₀ H e^(−h/H)/(2 β sin γ)), with the peak of 21.6610 g_E at h* = 29686.864 m and
        // V* = 4405.839 m/s.
        let (ve, gamma, beta) = (7264.0, 14.06f64.to_radians(), 63.0);
        let mass = beta * 1.6 * 5.5;
        let d = drag(Vec3::zeros());
        let down = Vec3::new(gamma.cos(), 0.0, -gamma.sin());
        let braking = |h: f64, v: f64| at(&d, Vec3::new(0.0, 0.0, h), down * v).drag / mass;
        // Integrate dV/dh = a/(V sin γ) downwards in h, with RK4.
        let slope = |h: f64, v: f64| braking(h, v) / (v * gamma.sin());
        let step = |h: f64, v: f64, dh: f64| {
            let a = slope(h, v);
            let b = slope(h + 0.5 * dh, v + 0.5 * dh * a);
            let c = slope(h + 0.5 * dh, v + 0.5 * dh * b);
            let e = slope(h + dh, v + dh * c);
            v + dh / 6.0 * (a + 2.0 * (b + c) + e)
        };
        // At 400 km, the density is e^(−400/11.1) = 2e-16 of the density at the ground.
        let (mut h, mut v) = (400_000.0, ve);
        let mut rows = Vec::new();
        while h > 5000.0 {
            let dh = if h > 40_000.0 { -25.0 } else { -2.0 };
            v = step(h, v, dh);
            h += dh;
            let air = 0.020 * 11_100.0 * (-h / 11_100.0_f64).exp();
            let exact = ve * (-air / (2.0 * beta * gamma.sin())).exp();
            assert!((v - exact).abs() < 1e-8, "{h}: {v} {exact}");
            rows.push((h, v, braking(h, v)));
        }
        let top = (1..rows.len()).max_by(|a, b| rows[*a].2.total_cmp(&rows[*b].2)).unwrap();
        // The peak lies between rows, so fit a parabola through three of them.
        let [a, b, c] = [rows[top - 1].2, rows[top].2, rows[top + 1].2];
        let h_peak = rows[top].0 - 2.0 * 0.5 * (a - c) / (a - 2.0 * b + c);
        let v_peak = step(rows[top].0, rows[top].1, h_peak - rows[top].0);
        let peak = braking(h_peak, v_peak) / 9.80665;
        println!("peak at {h_peak} m, {v_peak} m/s, {peak} g_E");
        assert!((h_peak - 29_686.864).abs() < 1e-3, "{h_peak}");
        assert!((v_peak - 4405.839).abs() < 1e-3, "{v_peak}");
        assert!((peak - 21.6610).abs() < 1e-4, "{peak}");
    }
}
