//! `flight.balloon`: balloon with a light gas, open at its foot (zero-pressure) or closed (super-pressure).
//! ```text
//! V  = min(m R T/p_a, V_max)       p = m R T/V       Δp = p − p_a ≥ 0       d = (6 V/π)^⅓: seen as a ball
//! F  = −ρ V g − ½ ρ C_D (π d²/4) |v| v + C_v ρ V g      v: through the air;  buoyancy, drag, virtual mass without weight
//! ṁ  = −C A_duct √(2 ρ_g Δp) − u C A_valve √(2 ρ_g (Δp + max(0, ρ − ρ_g) g d))      duct at the foot, valve at the top, 0 ≤ u ≤ 1
//! T  = T_a + ΔT, or with `heat` a state, p_a′ = ρ g·v:
//!      slack  m c_p Ṫ = h π d² (T_a + ΔT − T) + V p_a′        full  m (c_p − R) Ṫ = h π d² (T_a + ΔT − T) + ṁ R T
//! ```
//! A balloon without a duct keeps its gas and floats where ρ V_max equals its total mass: gas, envelope and load. A balloon with a duct releases gas
//! beyond V_max, so that Δp stays small. The gas and the virtual mass C_v ρ V are added to the envelope's body at the node, which is the centre of
//! the sphere; the mass of this body in the file is the mass of the envelope. Becoming full or slack is an event. Model ballast as a
//! `flight.propellant_tank` of the load. g is gravity at the node minus the acceleration of air that rotates with its planet, both for inertial W and
//! at a site, so that air at rest is in equilibrium. Below Δp of about 0.1 Pa the flow is linear in Δp. Not modelled: elasticity, strength and heat
//! capacity of the envelope, and winds that change along the path (ṁ_v, acceleration of the air). Sources: buoyancy, virtual mass of a sphere (½) and
//! gas law are textbook physics; orifices by Bernoulli's equation.

use crate::aerodynamics::air_data::gravity_in_air;
use crate::aerodynamics::gusty;
use linkwork_surroundings::prelude::*;
use std::f64::consts::PI;

/// Over-pressure below which the flow is linear in it, Pa.
const STILL: f64 = 0.1;

/// Heat transfer of the gas.
#[derive(Params, Clone, Copy, Debug)]
pub struct HeatParams {
    /// Heat transfer h between gas and air.
    #[param(unit = "W/(m^2 K)", range = 0.0..)]
    pub transfer: f64,
    /// Initial temperature of the gas.
    #[param(unit = "K", range = 1.0..)]
    pub temperature: f64,
}

/// Parameters of envelope and gas.
#[derive(Params, Clone, Debug)]
pub struct BalloonParams {
    /// Initial mass m of the gas.
    #[param(unit = "kg", range = 1e-9..)]
    pub gas: f64,
    /// Specific gas constant R; default: helium.
    #[param(unit = "J/(kg K)", default = 2077.26, range = 1.0..)]
    pub gas_constant: f64,
    /// Ratio of specific heats γ: c_p = γ R/(γ − 1); default: helium.
    #[param(default = 5.0 / 3.0, range = 1.01..=2.0, needs = "heat")]
    pub heat_ratio: f64,
    /// Volume V_max of the full envelope.
    #[param(unit = "m^3", range = 1e-6..)]
    pub volume: f64,
    /// Drag coefficient C_D, relative to the cross-section of the sphere.
    #[param(default = 0.47, range = 0.0..)]
    pub drag_coefficient: f64,
    /// Virtual mass coefficient C_v, relative to the displaced mass: ½ for a sphere.
    #[param(default = 0.5, range = 0.0..)]
    pub virtual_mass: f64,
    /// Area of the open duct at the foot; 0: closed, a super-pressure balloon.
    #[param(unit = "m^2", default = 0.0, range = 0.0..)]
    pub duct: f64,
    /// Area of the valve at the top.
    #[param(unit = "m^2", default = 0.0, range = 0.0..)]
    pub valve: f64,
    /// Discharge coefficient C of duct and valve.
    #[param(default = 0.6, range = 0.0..=1.0, needs = "duct or valve")]
    pub discharge: f64,
    /// Heat transfer of the gas; default: the gas always has the temperature of the air plus ΔT.
    pub heat: Option<HeatParams>,
    /// Atmosphere.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
    /// The world, with which the air rotates.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// State of the envelope, and commands.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BalloonIn {
    /// Node at the centre of the envelope.
    #[port(bind = "envelope")]
    pub envelope: NodeState,
    /// Opening of the valve, 0 to 1.
    #[port("1", default = 0.0)]
    pub vent: f64,
    /// Equilibrium temperature difference ΔT between gas and air, caused by sunlight on the envelope.
    #[port("K", default = 0.0)]
    pub superheat: f64,
    /// Gust velocity in addition to the wind, W, for example from `flight.gusts`.
    #[port("m/s", default = Vec3::zeros())]
    pub gust: Vec3,
}

/// Loads and state of the gas.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BalloonOut {
    /// Buoyancy and drag on the envelope, without the weight of the virtual mass.
    #[port(bind = "envelope")]
    pub load: Wrench,
    /// Mass of gas and virtual mass, added to the envelope.
    #[port(bind = "envelope")]
    pub added: AddedMass,
    /// Volume.
    #[port("m^3")]
    pub volume: f64,
    /// Over-pressure Δp at the foot.
    #[port("Pa")]
    pub over_pressure: f64,
    /// Temperature of the gas.
    #[port("K")]
    pub temperature: f64,
    /// Buoyancy.
    #[port("N")]
    pub buoyancy: f64,
    /// Drag.
    #[port("N")]
    pub drag: f64,
    /// Airspeed.
    #[port("m/s")]
    pub airspeed: f64,
    /// Mass flow of gas out of duct and valve.
    #[port("kg/s")]
    pub flow: f64,
}

/// The gas.
#[derive(State, Clone, Copy, Debug)]
pub struct Gas {
    /// Mass of the gas.
    #[port("kg")]
    pub mass: f64,
    /// Temperature of the gas; used with `heat` only.
    #[port("K")]
    pub temperature: f64,
}

/// Gas mass as an output.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GasOut {
    /// Mass of the gas.
    #[port("kg")]
    pub gas: f64,
}

/// Guard for the transition between slack and full.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Fullness {
    /// Volume of the gas at air pressure minus the volume of the full envelope.
    #[port("m^3")]
    pub over: f64,
}

/// Zero-pressure or super-pressure balloon.
pub struct Balloon {
    p: BalloonParams,
}

/// Quantities derived from the state and the air.
struct EnvelopeState {
    air: Air,
    pull: Vec3,
    through: Vec3,
    temperature: f64,
    /// Volume at air pressure without the limit of the envelope, and actual volume, m³.
    free: f64,
    volume: f64,
    over: f64,
    flow: f64,
}

impl Balloon {
    fn now(&self, c: &Clock, x: &Gas, u: &BalloonIn) -> EnvelopeState {
        let p = &self.p;
        let air = gusty(&p.atmosphere, c.t, &u.envelope.position, &u.gust);
        let place = &u.envelope.position;
        let pull = gravity_in_air(&p.gravity, p.world.as_ref(), c.t, place);
        let temperature =
            if p.heat.is_some() { x.temperature } else { air.temperature + u.superheat };
        // A stage of the integrator may evaluate a negative gas mass.
        let mass = x.mass.max(0.0);
        let work = mass * p.gas_constant * temperature;
        // In a vacuum the envelope is full. The lower bound avoids a division by zero.
        let free = work / air.pressure.max(f64::MIN_POSITIVE);
        let volume = free.min(p.volume);
        let over = if free > p.volume { work / p.volume - air.pressure } else { 0.0 };
        let density = if volume > 0.0 { mass / volume } else { 0.0 };
        let through = |area: f64, over: f64| {
            let speed = (2.0 * density / (over + STILL)).sqrt() * over;
            p.discharge * area * speed
        };
        let head = (air.density - density).max(0.0) * pull.norm() * diameter(volume);
        let flow = through(p.duct, over) + through(p.valve, over + head) * u.vent.clamp(0.0, 1.0);
        let through = u.envelope.velocity - air.wind;
        EnvelopeState { air, pull, through, temperature, free, volume, over, flow }
    }
}

/// Returns the diameter (m) of a sphere of the given volume (m³).
fn diameter(volume: f64) -> f64 {
    (6.0 * volume / PI).cbrt()
}

/// Zero-pressure or super-pressure balloon with buoyancy, drag, virtual mass, gas law and a valve.
#[model("flight.balloon")]
impl Model for Balloon {
    type Params = BalloonParams;
    type FeedthroughInputs = BalloonIn;
    type Outputs = GasOut;
    type FeedthroughOutputs = BalloonOut;
    type State = Gas;
    type Guards = Fullness;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let none = self.p.valve == 0.0;
        vec![
            (Judge::Param("valve"), unwired(wired, "vent", "the valve stays closed")),
            (
                Judge::Input("vent"),
                (none && wired("vent")).then(|| {
                    BuildError::new("`valve` is 0: the balloon has no valve")
                        .help("write `valve`, the area of the valve, or remove the wire")
                }),
            ),
        ]
    }
    fn init_x(&self) -> Gas {
        Gas { mass: self.p.gas, temperature: self.p.heat.map_or(0.0, |h| h.temperature) }
    }
    fn outputs(&self, x: &Gas) -> GasOut {
        GasOut { gas: x.mass.max(0.0) }
    }
    fn feedthrough(&self, clock: &Clock, x: &Gas, u: &BalloonIn) -> BalloonOut {
        let p = &self.p;
        let now = self.now(clock, x, u);
        let displaced = now.air.density * now.volume;
        let speed = now.through.norm();
        let section = 0.25 * PI * diameter(now.volume).powi(2);
        let drag = now.through * (-0.5 * now.air.density * p.drag_coefficient * section * speed);
        let buoyancy = now.pull * -displaced;
        let carried = p.virtual_mass * displaced;
        BalloonOut {
            load: Wrench { moment: Vec3::zeros(), force: buoyancy + drag - now.pull * carried },
            added: AddedMass::of(x.mass.max(0.0) + carried, &Vec3::zeros(), &Vec3::zeros()),
            volume: now.volume,
            over_pressure: now.over,
            temperature: now.temperature,
            buoyancy: buoyancy.norm(),
            drag: drag.norm(),
            airspeed: speed,
            flow: now.flow,
        }
    }
    fn derivatives(&self, clock: &Clock, x: &Gas, u: &BalloonIn) -> Gas {
        let p = &self.p;
        let now = self.now(clock, x, u);
        let Some(h) = p.heat.filter(|_| x.mass > 0.0) else {
            return Gas { mass: -now.flow, temperature: 0.0 };
        };
        let skin = PI * diameter(now.volume).powi(2);
        let c_p = p.gas_constant * p.heat_ratio / (p.heat_ratio - 1.0);
        let heat = h.transfer * skin * (now.air.temperature + u.superheat - x.temperature);
        let rate = if now.free > p.volume {
            let left = now.flow * p.gas_constant * x.temperature;
            (heat - left) / (x.mass * (c_p - p.gas_constant))
        } else {
            let pressure = now.air.density * now.pull.dot(&now.through);
            (heat + now.volume * pressure) / (x.mass * c_p)
        };
        Gas { mass: -now.flow, temperature: rate }
    }
    fn guards(&self, clock: &Clock, x: &Gas, u: &BalloonIn) -> Fullness {
        Fullness { over: self.now(clock, x, u).free - self.p.volume }
    }
    fn handle_event(&self, x: &Gas) -> (Gas, ()) {
        (*x, ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::testing;

    /// Isothermal air: ρ = ρ₀ e^(−z/H), H = R_a T/g.
    const G: f64 = 3.71;
    const T: f64 = 210.0;
    const R_A: f64 = 190.0;
    const H: f64 = R_A * T / G;
    const RHO: f64 = 0.016;
    fn params() -> BalloonParams {
        BalloonParams {
            gas: 4.0,
            gas_constant: 2077.26,
            heat_ratio: 5.0 / 3.0,
            volume: 5000.0,
            drag_coefficient: 0.47,
            virtual_mass: 0.5,
            duct: 0.0,
            valve: 0.0,
            discharge: 0.6,
            heat: None,
            atmosphere: testing::air(|_, p| {
                let density = RHO * (-p.z / H).exp();
                let pressure = density * R_A * T;
                Air {
                    density,
                    pressure,
                    temperature: T,
                    speed_of_sound: 230.0,
                    wind: Vec3::x() * 7.0,
                }
            }),
            gravity: testing::gravity(|_, _| Vec3::z() * -G),
            world: None,
        }
    }

    fn balloon(p: BalloonParams) -> Balloon {
        Balloon { p }
    }

    /// Height, vertical speed, and mass and temperature of the gas.
    type State = [f64; 4];

    /// Balloon with a dry mass in vertical motion, in air that moves with it horizontally.
    fn slope(m: &Balloon, dry: f64, vent: f64, y: &State) -> State {
        let position = Vec3::z() * y[0];
        let velocity = Vec3::new(7.0, 0.0, y[1]);
        let envelope = NodeState { position, velocity, ..NodeState::identity() };
        let (c, u) = (
            Clock::at(0.0, 0.1, 0),
            BalloonIn { envelope, vent, superheat: 0.0, gust: Vec3::zeros() },
        );
        let x = Gas { mass: y[2], temperature: y[3] };
        let out = m.feedthrough(&c, &x, &u);
        let rate = m.derivatives(&c, &x, &u);
        let mass = dry + out.added.mass;
        [y[1], out.load.force.z / mass - G, rate.mass, rate.temperature]
    }

    /// In a vacuum the envelope is full with an over-pressure m R T/V.
    #[test]
    fn without_air_the_gas_has_its_own_pressure() {
        let air = testing::air(|_, _| {
            let (density, pressure, wind) = (0.0, 0.0, Vec3::zeros());
            Air { density, pressure, temperature: T, speed_of_sound: 230.0, wind }
        });
        let m = balloon(BalloonParams { atmosphere: air, duct: 0.1, ..params() });
        let envelope = NodeState::identity();
        let u = BalloonIn { envelope, vent: 0.0, superheat: 0.0, gust: Vec3::zeros() };
        let y = m.feedthrough(&Clock::at(0.0, 0.1, 0), &m.init_x(), &u);
        let want = 4.0 * 2077.26 * T / 5000.0;
        assert!((y.over_pressure / want - 1.0).abs() < 1e-12, "{} {want}", y.over_pressure);
        assert!(y.flow > 0.0 && y.flow.is_finite() && y.volume == 5000.0);
    }

    fn fly(
        m: &Balloon,
        dry: f64,
        vent: f64,
        mut y: State,
        (h, n): (f64, usize),
        mut see: impl FnMut(f64, &State),
    ) -> State {
        let at =
            |y: &State, k: &State, c: f64| -> State { std::array::from_fn(|i| y[i] + c * k[i]) };
        for step in 0..n {
            see(step as f64 * h, &y);
            let a = slope(m, dry, vent, &y);
            let b = slope(m, dry, vent, &at(&y, &a, 0.5 * h));
            let c = slope(m, dry, vent, &at(&y, &b, 0.5 * h));
            let d = slope(m, dry, vent, &at(&y, &c, h));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
        y
    }

    #[test]
    fn it_rises_at_the_speed_of_its_lift_and_floats_where_it_displaces_its_mass() {
        let m = balloon(params());
        let dry = 28.0;
        let mut risen = None;
        let y = fly(&m, dry, 0.0, [0.0, 0.0, 4.0, 0.0], (0.5, 30_000), |t, y| {
            if t > 60.0 && risen.is_none() {
                risen = Some(*y);
            }
        });
        // While the envelope is slack, the displaced mass is m R_g T/(R_a T). Drag balances the net buoyancy, except
        // for the growth of the cross-section.
        let [z, rate, gas, _] = risen.unwrap();
        let displaced = gas * 2077.26 / R_A;
        let density = RHO * (-z / H).exp();
        let section = 0.25 * PI * (6.0 * displaced / density / PI).powf(2.0 / 3.0);
        let want = ((displaced - dry - gas) * G / (0.5 * density * 0.47 * section)).sqrt();
        println!("rises at {rate} m/s, closed form {want} m/s; floats at {} m", y[0]);
        assert!((rate / want - 1.0).abs() < 3e-3, "{rate} {want}");
        // Quadratic drag damps small oscillations slowly: an amplitude of 1 m remains after four hours.
        let float = H * (RHO * 5000.0 / (dry + 4.0)).ln();
        assert!((y[0] - float).abs() < 2.0 && y[1].abs() < 0.02, "{} {float}", y[0]);
    }

    #[test]
    fn about_its_float_height_it_bobs_with_the_period_of_its_displaced_air() {
        // The equation of motion is (1 + C_v) m z̈ = −m g z/H: virtual mass lowers the frequency.
        let m = balloon(BalloonParams { drag_coefficient: 0.0, ..params() });
        let float = H * (RHO * 5000.0 / 32.0).ln();
        let (mut crossings, mut before) = (Vec::new(), 1.0);
        fly(&m, 28.0, 0.0, [float + 1.0, 0.0, 4.0, 0.0], (0.25, 8000), |t, y| {
            let off = y[0] - float;
            if off <= 0.0 && before > 0.0 {
                crossings.push(t - 0.25 * off / (off - before));
            }
            before = off;
        });
        let period = crossings[1] - crossings[0];
        let want = 2.0 * PI * (1.5 * H / G).sqrt();
        println!("{period} s, closed form {want} s");
        assert!((period / want - 1.0).abs() < 1e-3, "{period} {want}");
    }

    #[test]
    fn without_heat_the_gas_expands_on_its_adiabat() {
        let m = balloon(BalloonParams {
            heat: Some(HeatParams { transfer: 0.0, temperature: T }),
            ..params()
        });
        let y = fly(&m, 20.0, 0.0, [0.0, 0.0, 4.0, T], (0.1, 3000), |_, _| ());
        let want = T * (-y[0] / H).exp().powf(0.4);
        println!("{} m: {} K, closed form {want} K", y[0], y[3]);
        assert!(y[0] > 300.0 && (y[3] - want).abs() < 1e-6, "{y:?} {want}");
        // A full balloon has constant volume, and without heat transfer constant energy.
        let full = balloon(BalloonParams { volume: 100.0, ..m.p.clone() });
        let rate = slope(&full, 20.0, 0.0, &[0.0, 3.0, 4.0, 205.0]);
        assert_eq!(rate[3], 0.0);
        // The gas approaches the temperature of the air if heat is transferred.
        let warm = balloon(BalloonParams {
            heat: Some(HeatParams { transfer: 50.0, temperature: T }),
            ..m.p.clone()
        });
        assert!(slope(&warm, 20.0, 0.0, &[0.0, 0.0, 4.0, 200.0])[3] > 0.0);
    }

    #[test]
    fn with_a_duct_what_is_beyond_its_volume_leaves() {
        let m = balloon(BalloonParams { duct: 0.5, volume: 3500.0, ..params() });
        let mut top = None;
        let y = fly(&m, 24.0, 0.0, [0.0, 0.0, 4.0, 0.0], (0.1, 30_000), |t, y| {
            if t > 10.0 && y[1] < 0.0 && top.is_none() {
                top = Some(*y);
            }
        });
        // At its greatest height the balloon is full and has no over-pressure.
        let top = top.unwrap();
        let density = RHO * (-top[0] / H).exp();
        println!("{} m with {} kg of gas", top[0], top[2]);
        assert!((top[2] / (density * R_A * 3500.0 / 2077.26) - 1.0).abs() < 1e-3, "{top:?}");
        // The balloon overshot the height of equilibrium, lost gas there, and sinks afterwards.
        assert!(density * 3500.0 < 24.0 + top[2] && top[2] < 3.9, "{top:?}");
        assert!(y[0] < top[0] && (y[2] / top[2] - 1.0).abs() < 1e-3, "{y:?} {top:?}");
    }

    #[test]
    fn a_valve_lets_gas_out_by_its_head_and_no_more_than_there_is() {
        let m = balloon(BalloonParams { valve: 0.1, ..params() });
        let gas = slope(&m, 28.0, 0.4, &[0.0, 0.0, 4.0, 0.0])[2];
        let light = RHO * R_A / 2077.26;
        let d = (6.0 * 4.0 / light / PI).cbrt();
        // The hydrostatic head is 0.9 Pa, including the regularization below 0.1 Pa.
        let head = (RHO - light) * G * d;
        let want = -0.4 * 0.6 * 0.1 * head * (2.0 * light / (head + 0.1)).sqrt();
        assert!((gas / want - 1.0).abs() < 1e-9 && head > 0.8, "{gas} {want} {head}");
        assert_eq!(slope(&m, 28.0, 0.0, &[0.0, 0.0, 4.0, 0.0])[2], 0.0);
        assert_eq!(slope(&m, 28.0, 1.0, &[0.0, 0.0, -1e-9, 0.0])[2], 0.0);
    }
}
