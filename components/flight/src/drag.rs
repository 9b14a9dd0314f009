//! `flight.drag`: drag of a blunt body, with Mach number and stagnation heating.
//! ```text
//! v = velocity − wind        F = −½ ρ |v| v C_D A        β = m/(C_D A)
//! M = |v|/a                  q̇ = k √(ρ/r_n) |v|³         (Sutton, Graves 1971)
//! ```
//! k = 1.9027e-4 (Mars), 1.7415e-4 (Earth), SI: W/m². The force acts at the node and gives no moment there.

use crate::aerodynamics::AirData;
use linkwork_runtime::prelude::*;

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
    /// Sutton-Graves constant, SI.
    #[param(default = 1.9027e-4, range = 0.0..)]
    pub heating_constant: f64,
    /// The air.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DragIn {
    /// Where the drag acts.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// Force and what goes with it.
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
}

/// Drag of a blunt body in an atmosphere, its Mach number and stagnation heating.
#[model("flight.drag")]
impl Model for Drag {
    type Params = DragParams;
    type Ud = DragIn;
    type Yd = DragOut;
    fn direct(&self, c: &Clock, _: &(), _: &(), u: &DragIn) -> DragOut {
        let p = &self.p;
        let a = AirData::met(&p.atmosphere, c.t, &u.body, &Vec3::zeros());
        let through = u.body.rotation * a.velocity;
        let force = through * (-0.5 * a.density * a.speed * p.coefficient * p.area);
        DragOut {
            load: Wrench { moment: Vec3::zeros(), force },
            drag: a.pressure * p.coefficient * p.area,
            airspeed: a.speed,
            dynamic_pressure: a.pressure,
            mach: a.mach,
            heating: a.heating(p.heating_constant, p.nose_radius),
            density: a.density,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    struct Layer(Vec3);
    impl Atmosphere for Layer {
        fn air(&self, _: f64, p: Vec3) -> Air {
            Air {
                density: 0.020 * (-p.z / 11_100.0).exp(),
                pressure: 0.0,
                temperature: 200.0,
                speed_of_sound: 230.0,
                wind: self.0,
            }
        }
    }

    fn drag(wind: Vec3) -> Drag {
        Drag {
            p: DragParams {
                coefficient: 1.6,
                area: 5.5,
                nose_radius: 0.66,
                heating_constant: 1.9027e-4,
                atmosphere: Handle::new("air", Arc::new(Layer(wind)) as Arc<dyn Atmosphere>),
            },
        }
    }

    fn at(d: &Drag, position: Vec3, velocity: Vec3) -> DragOut {
        let body = NodeState { position, velocity, ..NodeState::identity() };
        d.direct(&Clock::at(0.0, 0.01, 0), &(), &(), &DragIn { body }, &())
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
        assert!((y.heating - want).abs() < 1e-9 * want && y.heating > 1e4);
    }

    #[test]
    fn steep_entry_follows_allen_and_eggers() {
        // Straight line at 14.06° without gravity: V = V_E exp(−ρ₀ H e^(−h/H)/(2 β sin γ)). Published peak:
        // h* = 29686.864 m, V* = 4405.839 m/s, 21.6610 g_E.
        let (ve, gamma, beta) = (7264.0, 14.06f64.to_radians(), 63.0);
        let mass = beta * 1.6 * 5.5;
        let d = drag(Vec3::zeros());
        let down = Vec3::new(gamma.cos(), 0.0, -gamma.sin());
        let (mut h, mut v, dt) = (180_000.0, ve, 2e-3);
        let (mut peak, mut peak_h, mut peak_v) = (0.0, 0.0, 0.0);
        let slope = |h: f64, v: f64| -at(&d, Vec3::new(0.0, 0.0, h), down * v).drag / mass;
        while h > 5000.0 {
            let a1 = slope(h, v);
            let (hm, vm) = (h - 0.5 * dt * v * gamma.sin(), v + 0.5 * dt * a1);
            let a2 = slope(hm, vm);
            h -= dt * vm * gamma.sin();
            v += dt * a2;
            if -a2 > peak {
                (peak, peak_h, peak_v) = (-a2, h, v);
            }
            let exact = ve
                * (-0.020 * 11_100.0 * (-h / 11_100.0_f64).exp() / (2.0 * beta * gamma.sin()))
                    .exp();
            assert!((v - exact).abs() < 0.02, "{h}: {v} {exact}");
        }
        assert!((peak / 9.80665 - 21.6610).abs() < 1e-3, "{}", peak / 9.80665);
        assert!(
            (peak_h - 29_686.864).abs() < 20.0 && (peak_v - 4405.839).abs() < 10.0,
            "{peak_h} {peak_v}"
        );
    }
}
