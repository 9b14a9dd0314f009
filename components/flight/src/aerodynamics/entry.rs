//! `flight.entry_aerodynamics`: lift and drag of a point mass with a bank angle, for entry with three degrees of freedom.
//! ```text
//! e = v/V (through the air)      l₀ = up − (up · e) e, made unit      up = p/|p|, from the planet's centre
//! F = q S C_D (−e + (L/D) (cos σ l₀ + sin σ e × l₀))                   σ: bank; positive turns to the right
//! C_D, L/D: a table times a factor
//! q̇ = k √(ρ/r_n) V³      Q = ∫ q̇ dt
//! ```
//! C_D and L/D are tables over Mach number with linear interpolation, clamped at their ends. Leaving the tables is an event, at which `outside`
//! selects whether the run stops. The model does not use the attitude of the body and exerts no moment. In vertical flight there is no lift.

use super::air_data::{AirData, Outside, gusty, heating_constant};
use super::axisymmetric::{Edge, Heat, Passed, TableExit, leaves, remark};
use crate::table::Curve;
use linkwork_surroundings::prelude::*;

/// Coefficients and atmosphere.
#[derive(Params, Clone, Debug)]
pub struct EntryParams {
    /// Reference area S.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// Rows (Mach, C_D), in ascending order of Mach number.
    pub drag: Vec<[f64; 2]>,
    /// Rows (Mach, L/D), in ascending order of Mach number.
    pub lift_to_drag: Vec<[f64; 2]>,
    /// Factor on C_D, to model its uncertainty.
    #[param(default = 1.0, range = 0.0..)]
    pub drag_factor: f64,
    /// Factor on L/D.
    #[param(default = 1.0)]
    pub lift_to_drag_factor: f64,
    /// Behaviour outside the tables: clamp, stop.
    #[param(default = Outside::Clamp)]
    pub outside: Outside,
    /// Nose radius, for heating.
    #[param(unit = "m", default = 1.0, range = 1e-6..)]
    pub nose_radius: f64,
    /// Sutton-Graves constant k (kg^½/m); default: from the gas of the atmosphere.
    #[param(range = 0.0..)]
    pub heating_constant: Option<f64>,
    /// Atmosphere.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
    /// The world, for the vertical; without a world the ground is level.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
    /// Gravity, for the vertical of level ground.
    #[param(service)]
    pub gravity: Option<Handle<dyn Gravity>>,
}

/// Body, bank angle and gust.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EntryIn {
    /// Node at which the force acts.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Bank angle: 0 is lift up, positive is lift to the right.
    #[port("rad", default = 0.0)]
    pub bank: f64,
    /// Gust velocity in addition to the wind, W, for example from `flight.gusts`.
    #[port("m/s", default = Vec3::zeros())]
    pub gust: Vec3,
}

/// Aerodynamic force and flow quantities.
#[derive(Ports, Clone, Copy, Debug)]
pub struct EntryOut {
    /// Lift and drag.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Lift.
    #[port("N")]
    pub lift: f64,
    /// Drag.
    #[port("N")]
    pub drag: f64,
    /// Airspeed.
    #[port("m/s")]
    pub airspeed: f64,
    /// Mach number.
    #[port("1")]
    pub mach: f64,
    /// Dynamic pressure.
    #[port("Pa")]
    pub dynamic_pressure: f64,
    /// Density.
    #[port("kg/m^3")]
    pub density: f64,
    /// Static pressure of the air.
    #[port("Pa")]
    pub ambient_pressure: f64,
    /// Heat flux at the stagnation point.
    #[port("W/m^2")]
    pub heating: f64,
}

/// Lift and drag of a point mass.
pub struct EntryAerodynamics {
    p: EntryParams,
    drag: Curve,
    ratio: Curve,
    vertical: Vertical,
    heating: f64,
}

/// Returns the aerodynamic force (N) of `lift` and `drag` (N) for a velocity relative to the air, in the axes of `velocity` and `up`.
pub fn force(velocity: &Vec3, up: &Vec3, bank: f64, lift: f64, drag: f64) -> Vec3 {
    let speed = velocity.norm();
    if !(speed > 0.0) {
        return Vec3::zeros();
    }
    let e = velocity / speed;
    let across = up - e * up.dot(&e);
    let length = across.norm();
    let l0 = if length > 1e-12 * up.norm() { across / length } else { Vec3::zeros() };
    e * -drag + (l0 * bank.cos() + e.cross(&l0) * bank.sin()) * lift
}

impl EntryAerodynamics {
    fn inside(&self, mach: f64) -> f64 {
        self.drag.inside(mach).min(self.ratio.inside(mach))
    }

    fn mach(&self, t: f64, u: &EntryIn) -> f64 {
        AirData::met(&self.p.atmosphere, t, &u.body, &Vec3::zeros(), &u.gust).mach
    }

    /// Describes the flow and the ends of the tables, for messages.
    fn reach(&self, mach: f64) -> String {
        // A table with one row is constant and has no ends.
        let tables = [("drag", &self.drag), ("lift_to_drag", &self.ratio)];
        let ends = tables.iter().filter_map(|(name, curve)| {
            let [a, b] = curve.ends();
            (a < b).then(|| format!("`{name}` from Mach {a} to {b}"))
        });
        format!("{}, here Mach {mach:.4}", ends.collect::<Vec<_>>().join(" and "))
    }
}

/// Lift, drag and heating of a point mass from tables over Mach number, with the bank angle as input.
#[model("flight.entry_aerodynamics")]
impl Model for EntryAerodynamics {
    type Params = EntryParams;
    type FeedthroughInputs = EntryIn;
    type Outputs = Passed;
    type FeedthroughOutputs = EntryOut;
    type State = Heat;
    type DiscreteState = TableExit;
    type Guards = Edge;
    fn build(p: EntryParams) -> Result<Self, BuildError> {
        let (drag, ratio) =
            (Curve::new(&p.drag, "drag")?, Curve::new(&p.lift_to_drag, "lift_to_drag")?);
        let drag = drag.not_negative("C_D", "drag")?;
        let heating = heating_constant(p.heating_constant, &p.atmosphere)?;
        // Without lift, the vertical does not matter.
        let lifts = p.lift_to_drag.iter().any(|row| row[1] != 0.0);
        let vertical = match Vertical::new(p.world.as_ref(), p.gravity.as_ref()) {
            Ok(vertical) => vertical,
            Err(e) if lifts => return Err(e),
            Err(_) => Vertical::Level,
        };
        Ok(EntryAerodynamics { p, drag, ratio, vertical, heating })
    }
    fn outputs(&self, x: &Heat, d: &TableExit) -> Passed {
        Passed { heat_load: x.load, outside: d.outside }
    }
    fn feedthrough(&self, clock: &Clock, u: &EntryIn) -> EntryOut {
        let p = &self.p;
        let air = gusty(&p.atmosphere, clock.t, &u.body.position, &u.gust);
        let a = AirData::of(&u.body, &air, &Vec3::zeros());
        let drag = a.pressure * p.area * self.drag.at(a.mach) * p.drag_factor;
        let lift = drag * self.ratio.at(a.mach) * p.lift_to_drag_factor;
        let through = u.body.rotation * a.velocity;
        let up = self.vertical.up(clock.t, &u.body.position);
        let force = force(&through, &up, u.bank, lift, drag);
        EntryOut {
            load: Wrench { moment: Vec3::zeros(), force },
            lift,
            drag,
            airspeed: a.speed,
            mach: a.mach,
            dynamic_pressure: a.pressure,
            density: a.density,
            ambient_pressure: air.pressure,
            heating: a.heating(self.heating, p.nose_radius),
        }
    }
    fn derivatives(&self, y: &EntryOut) -> Heat {
        Heat { load: y.heating }
    }
    fn guards(&self, clock: &Clock, d: &TableExit, u: &EntryIn) -> Edge {
        Edge::at(self.inside(self.mach(clock.t, u)), d)
    }
    fn handle_event(&self, x: &Heat) -> (Heat, TableExit) {
        // The flow leaves or enters the range, so it has been outside at least once.
        (*x, TableExit { outside: true })
    }
    fn runtime_warning(
        &self,
        clock: &Clock,
        fired: Fired<'_>,
        d: &TableExit,
        u: &EntryIn,
    ) -> Option<BuildError> {
        leaves(self.p.outside, fired, || self.reach(self.mach(clock.t, u)), d)
    }
    fn startup_warnings(&self, clock: &Clock, u: &EntryIn) -> Vec<BuildError> {
        let mach = self.mach(clock.t, u);
        remark(self.p.outside, self.inside(mach), || self.reach(mach))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lift_turns_with_the_bank_and_is_across_the_path() {
        let up = Vec3::z() * 3.4e6;
        let v = Vec3::new(5000.0, 0.0, -1000.0);
        let level = force(&v, &up, 0.0, 10.0, 0.0);
        assert!(level.z > 0.0 && level.dot(&v).abs() < 1e-9 && (level.norm() - 10.0).abs() < 1e-12);
        // The flight is along x with z up, so the right is −y.
        let right = force(&v, &up, 0.5 * std::f64::consts::PI, 10.0, 0.0);
        assert!((right + Vec3::y() * 10.0).norm() < 1e-12, "{right}");
        let drag = force(&v, &up, 1.0, 0.0, 7.0);
        assert!((drag + v.normalize() * 7.0).norm() < 1e-12);
        assert_eq!(force(&Vec3::zeros(), &up, 0.0, 1.0, 1.0), Vec3::zeros());
        let down = force(&-up, &up, 0.3, 5.0, 2.0);
        assert!((down - Vec3::z() * 2.0).norm() < 1e-12, "no lift straight down");
    }
}
