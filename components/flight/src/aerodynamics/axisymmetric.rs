//! `flight.axisymmetric_aerodynamics`: aerodynamics of a capsule or aeroshell from tables over total angle of attack and Mach number.
//! ```text
//! F = q S (−C_A, −C_N l_y, −C_N l_z)             l = (0, v, w)/√(v² + w²): the velocity leans to l
//! M_ref = q S D C_m (0, l_z, −l_y)               about the point that the tables speak of
//! M = M_ref + p_ref × F + q S D²/(2V) (C_lp p, C_mq q, C_mq r)       p_ref: from the node, body axes
//! q̇ = k √(ρ/r_n) V³      Q = ∫ q̇ dt              heat at the stagnation point (Sutton, Graves)
//! ```
//! The force never accelerates the body along its velocity: the tables must satisfy C_A cos α_t + C_N sin α_t ≥ 0, and beyond their ends an
//! accelerating component is removed. Positive C_m raises the nose at positive α; a stable shell has negative C_m. Tables are interpolated linearly.
//! Outside their range, `outside` selects the value at the end or a stop of the run.

use super::air_data::{AirData, Outside};
use super::air_data::{check_air_rate, heating_constant};
use crate::table::Surface;
use linkwork_surroundings::prelude::*;

/// Reference quantities and tables.
#[derive(Params, Clone, Debug)]
pub struct AxisymmetricParams {
    /// Reference area S.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// Reference length D.
    #[param(unit = "m", range = 1e-6..)]
    pub length: f64,
    /// Total angles of attack of the rows, in ascending order.
    #[param(unit = "rad")]
    pub angles: Vec<f64>,
    /// Mach numbers of the columns, in ascending order; default: one column for all Mach numbers.
    #[param(default = Vec::new())]
    pub machs: Vec<f64>,
    /// Axial force coefficient C_A: a row for each angle, a column for each Mach number.
    pub axial: Vec<Vec<f64>>,
    /// Normal force coefficient C_N.
    pub normal: Vec<Vec<f64>>,
    /// Pitching moment coefficient C_m about the reference point.
    pub pitch: Vec<Vec<f64>>,
    /// Reference point of C_m relative to the node, body axes.
    #[param(unit = "m", default = Vec3::zeros())]
    pub reference: Vec3,
    /// Damping coefficients (C_lp, C_mq, C_nr), for rates times D/(2V).
    #[param(default = Vec3::zeros())]
    pub damping: Vec3,
    /// Rotation rate of the air with its planet, W, for the damping: the rate of the `world`; default: body rates relative to W.
    #[param(unit = "rad/s", default = Vec3::zeros(), needs = "damping")]
    pub air_rate: Vec3,
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
    /// The world, with whose body the air rotates.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// The body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BodyIn {
    /// Node with body axes, usually at the centre of mass.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Gust velocity in addition to the wind, W, for example from `flight.gusts`.
    #[port("m/s", default = Vec3::zeros())]
    pub gust: Vec3,
    /// Angular velocity of the air in addition to `air_rate`, W, for example `rotation` of `flight.gusts`.
    #[port("rad/s", default = Vec3::zeros())]
    pub gust_rate: Vec3,
}

/// Aerodynamic load and flow quantities.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct AxisymmetricOut {
    /// Force and moment at the node.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Airspeed.
    #[port("m/s")]
    pub airspeed: f64,
    /// Mach number.
    #[port("1")]
    pub mach: f64,
    /// Dynamic pressure.
    #[port("Pa")]
    pub dynamic_pressure: f64,
    /// Angle of attack.
    #[port("rad")]
    pub alpha: f64,
    /// Angle of sideslip.
    #[port("rad")]
    pub beta: f64,
    /// Magnitude of the aerodynamic force.
    #[port("N")]
    pub force: f64,
    /// Heat flux at the stagnation point.
    #[port("W/m^2")]
    pub heating: f64,
}

/// Accumulated heat and the flag of the table range.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Passed {
    /// Accumulated heat per area at the stagnation point.
    #[port("J/m^2")]
    pub heat_load: f64,
    /// The flow has been outside the range of the coefficients.
    #[port]
    pub outside: bool,
}

/// Accumulated heat.
#[derive(State, Clone, Copy, Debug)]
pub struct Heat {
    /// Heat per area at the stagnation point.
    #[port("J/m^2")]
    pub load: f64,
}

/// Flag of the table range.
#[derive(State, Clone, Copy, Debug)]
pub struct TableExit {
    /// The flow has been outside the range of the coefficients.
    #[port]
    pub outside: bool,
}

/// Guards for the edge of the tables, or of the range of a closed form.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Edge {
    /// Distance outside the range of the coefficients, relative to its width; negative inside. An event in both directions, because the coefficients
    /// have a kink there.
    #[port("1")]
    pub outside: f64,
    /// Like `outside`, but for a run that begins outside; negative once the flow has been outside.
    #[port("1", rising)]
    pub begins: f64,
}

impl Edge {
    /// Returns the guards for a flow that is `inside` by this fraction of the range; `was` states whether it has been outside.
    pub(super) fn at(inside: f64, was: &TableExit) -> Edge {
        // A flow that begins exactly on the edge counts as inside; the guard `outside` detects a flow that leaves.
        Edge { outside: -inside, begins: if was.outside { -1.0 } else { -inside - BEGINS } }
    }
}

/// Fraction of the range's width beyond the edge from which a flow counts as beginning outside.
const BEGINS: f64 = 1e-9;

/// Index in [`Edge`] of the guard that rises when the flow leaves the range.
pub(super) const LEAVES: usize = 0;

/// Builds the message for a flow outside the tables; `reach` describes the flow and the ends of the tables.
fn beyond(outside: Outside, does: &str, reach: impl FnOnce() -> String) -> BuildError {
    let fact = format!("the flow {does} {}", reach());
    outside.says(fact, "the value at the end is", "extend the tables")
}

/// Returns the startup warning for a flow that begins outside the tables.
pub(super) fn remark(
    outside: Outside,
    inside: f64,
    reach: impl FnOnce() -> String,
) -> Vec<BuildError> {
    let begins = || beyond(outside, "begins outside the tables,", reach);
    (inside < 0.0).then(begins).into_iter().collect()
}

/// Returns the warning for a flow that leaves the tables; entering them causes no message.
pub(super) fn leaves(
    outside: Outside,
    which: Fired<'_>,
    reach: impl FnOnce() -> String,
    was: &TableExit,
) -> Option<BuildError> {
    // The setting `clamp` reports only the first exit; with `stop` every exit stops the run.
    let silent = was.outside && outside == Outside::Clamp;
    (which.rose(LEAVES) && !silent).then(|| beyond(outside, "leaves the tables,", reach))
}

/// Reference quantities that scale the coefficients of an axisymmetric body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scales {
    /// Reference area S, m².
    pub(super) area: f64,
    /// Reference length D, m.
    pub(super) length: f64,
    /// Reference point of C_m relative to the node, body axes, m.
    pub(super) reference: Vec3,
    /// Damping coefficients (C_lp, C_mq, C_nr), for rates times D/(2V).
    pub(super) damping: Vec3,
    /// Sutton-Graves constant, SI.
    pub(super) heating_constant: f64,
    /// Nose radius, m.
    pub(super) nose_radius: f64,
}

impl Scales {
    /// Computes load and flow quantities from C_A, C_N and C_m; `R` rotates body axes to W.
    pub(super) fn loaded(
        &self,
        a: &AirData,
        R: &Quat,
        [axial, normal, pitch]: [f64; 3],
    ) -> AxisymmetricOut {
        let lean = a.lean();
        let qs = a.pressure * self.area;
        let mut force = Vec3::new(-axial, -normal * lean.y, -normal * lean.z) * qs;
        // Coefficients beyond the end of their table keep their last values, which may accelerate the body
        // along its velocity.
        let push = force.dot(&a.velocity);
        if push > 0.0 {
            force -= a.velocity * (push / (a.speed * a.speed));
        }
        let about = Vec3::new(0.0, lean.z, -lean.y) * (qs * self.length * pitch);
        // q S D²/(2V) = ρ V S D²/4 avoids a division by zero at rest.
        let rate = 0.25 * a.density * a.speed * self.area * self.length * self.length;
        let damping = a.angular.component_mul(&self.damping) * rate;
        let moment = about + self.reference.cross(&force) + damping;
        AxisymmetricOut {
            load: Wrench { moment: R * moment, force: R * force },
            airspeed: a.speed,
            mach: a.mach,
            dynamic_pressure: a.pressure,
            alpha: a.alpha(),
            beta: a.beta(),
            force: force.norm(),
            heating: a.heating(self.heating_constant, self.nose_radius),
        }
    }
}

/// Aerodynamics of a capsule from tables.
pub struct Axisymmetric {
    p: AxisymmetricParams,
    scales: Scales,
    tables: [Surface; 3],
}

impl Axisymmetric {
    /// Returns the air data and the distance inside the tables, relative to their width; an axis of angles that begins at 0 has no lower end.
    fn air(&self, t: f64, u: &BodyIn) -> (AirData, f64) {
        let data =
            AirData::met(&self.p.atmosphere, t, &u.body, &(self.p.air_rate + u.gust_rate), &u.gust);
        let (angles, table) = (&self.p.angles, &self.tables[0]);
        let (first, last) = (angles[0], angles[angles.len() - 1]);
        if first > 0.0 || last == first {
            return (data, table.inside(data.alpha_total(), data.mach));
        }
        let by_angle = (last - data.alpha_total()) / (last - first);
        (data, by_angle.min(table.inside(0.5 * (first + last), data.mach)))
    }
}

impl Axisymmetric {
    /// Describes the flow and the ends of the tables, for messages.
    fn reach(&self, a: &AirData) -> String {
        let ends = |points: &[f64]| [points[0], points[points.len() - 1]];
        let [low, high] = ends(&self.p.angles).map(f64::to_degrees);
        let total = a.alpha_total().to_degrees();
        let by_mach = |machs: &[f64]| {
            let [first, last] = ends(machs);
            format!(", and Mach {first} to {last}, here Mach {:.4}", a.mach)
        };
        let machs = &self.p.machs;
        let by_mach = if machs.len() > 1 { by_mach(machs) } else { String::new() };
        format!("which have angles of {low:.2} to {high:.2} deg, here {total:.2} deg{by_mach}")
    }
}

/// Aerodynamic force and moment of a capsule from tables over total angle of attack and Mach number, with stagnation heating.
#[model("flight.axisymmetric_aerodynamics")]
impl Model for Axisymmetric {
    type Params = AxisymmetricParams;
    type FeedthroughInputs = BodyIn;
    type Outputs = Passed;
    type FeedthroughOutputs = AxisymmetricOut;
    type State = Heat;
    type DiscreteState = TableExit;
    type Guards = Edge;
    fn build(p: AxisymmetricParams) -> Result<Self, BuildError> {
        check_air_rate(&p.air_rate, p.world.as_ref(), "air_rate")?;
        let table = |rows: &[Vec<f64>], name: &str| {
            Surface::new((&p.angles, "angles"), (&p.machs, "machs"), (rows, name))
        };
        let tables =
            [table(&p.axial, "axial")?, table(&p.normal, "normal")?, table(&p.pitch, "pitch")?];
        for (k, angle) in p.angles.iter().enumerate() {
            let (sin, cos) = angle.sin_cos();
            let along = |(axial, normal): (&f64, &f64)| axial * cos + normal * sin;
            let row = p.axial[k].iter().zip(&p.normal[k]).map(along);
            if let Some(push) = row.into_iter().find(|along| !(*along > -1e-6)) {
                let fact = format!(
                    "C_A cos α + C_N sin α is {push:.4} at {:.2} deg, so the air would accelerate the body",
                    angle.to_degrees()
                );
                let help = "C_A is along the body axis: beyond 90 deg a drag has a negative C_A";
                return Err(BuildError::new(fact).help(help).at("axial"));
            }
        }
        let AxisymmetricParams { area, length, reference, damping, .. } = p;
        let (constant, nose_radius) = (p.heating_constant, p.nose_radius);
        let heating_constant = heating_constant(constant, &p.atmosphere)?;
        let scales = Scales { area, length, reference, damping, heating_constant, nose_radius };
        Ok(Axisymmetric { p, scales, tables })
    }
    fn outputs(&self, x: &Heat, d: &TableExit) -> Passed {
        Passed { heat_load: x.load, outside: d.outside }
    }
    fn feedthrough(&self, clock: &Clock, u: &BodyIn) -> AxisymmetricOut {
        let (a, _) = self.air(clock.t, u);
        let coefficients = [0, 1, 2].map(|k| self.tables[k].at(a.alpha_total(), a.mach));
        self.scales.loaded(&a, &u.body.rotation, coefficients)
    }
    fn derivatives(&self, y: &AxisymmetricOut) -> Heat {
        Heat { load: y.heating }
    }
    fn guards(&self, clock: &Clock, d: &TableExit, u: &BodyIn) -> Edge {
        Edge::at(self.air(clock.t, u).1, d)
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
        u: &BodyIn,
    ) -> Option<BuildError> {
        leaves(self.p.outside, fired, || self.reach(&self.air(clock.t, u).0), d)
    }
    fn startup_warnings(&self, clock: &Clock, u: &BodyIn) -> Vec<BuildError> {
        let (a, inside) = self.air(clock.t, u);
        remark(self.p.outside, inside, || self.reach(&a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::testing;

    fn capsule(outside: Outside) -> Axisymmetric {
        let column = |v: [f64; 3]| v.map(|x| vec![x]).to_vec();
        Axisymmetric::build(AxisymmetricParams {
            area: 4.0,
            length: 2.0,
            angles: vec![0.0, 0.2, 0.4],
            machs: vec![],
            axial: column([1.6, 1.5, 1.3]),
            normal: column([0.0, 0.05, 0.09]),
            pitch: column([0.0, -0.06, -0.11]),
            reference: Vec3::new(0.7, 0.0, 0.02),
            damping: Vec3::new(-0.1, -0.3, -0.2),
            air_rate: Vec3::zeros(),
            world: None,
            outside,
            nose_radius: 0.5,
            heating_constant: Some(1.9027e-4),
            atmosphere: testing::air(|_, _| {
                let wind = Vec3::zeros();
                Air {
                    density: 0.02,
                    pressure: 1.0,
                    temperature: 200.0,
                    speed_of_sound: 250.0,
                    wind,
                }
            }),
        })
        .unwrap()
    }

    fn at(m: &Axisymmetric, v: Vec3, angular: Vec3) -> AxisymmetricOut {
        let body = NodeState { velocity: v, angular, ..NodeState::identity() };
        m.feedthrough(
            &Clock::at(0.0, 0.01, 0),
            &BodyIn { body, gust: Vec3::zeros(), gust_rate: Vec3::zeros() },
        )
    }

    #[test]
    fn force_and_moment_follow_the_lean_of_the_velocity() {
        let m = capsule(Outside::Clamp);
        let (speed, total) = (500.0, 0.3_f64);
        let qs = 0.5 * 0.02 * speed * speed * 4.0;
        for roll in [0.0_f64, 1.0, -2.5] {
            let lean = Vec3::new(0.0, roll.sin(), roll.cos());
            let v = (Vec3::x() * total.cos() + lean * total.sin()) * speed;
            let y = at(&m, v, Vec3::zeros());
            let want = (Vec3::x() * -1.4 - lean * 0.07) * qs;
            assert!((y.load.force - want).norm() < 1e-9, "{}", y.load.force);
            let about = Vec3::new(0.0, lean.z, -lean.y) * (-0.085 * qs * 2.0);
            let want = about + Vec3::new(0.7, 0.0, 0.02).cross(&want);
            assert!((y.load.moment - want).norm() < 1e-9);
        }
        // A positive angle of attack (w > 0) with C_m < 0 lowers the nose (moment along −y).
        let y = at(&m, Vec3::new(490.0, 0.0, 80.0), Vec3::zeros());
        assert!(y.alpha > 0.0 && y.load.force.z < 0.0);
        let heat = 1.9027e-4 * (0.02f64 / 0.5).sqrt() * y.airspeed.powi(3);
        let free = 0.5 * 0.02 * y.airspeed.powi(3);
        let bounded = heat / (1.0 + (heat / free).powi(2)).sqrt();
        assert!((y.heating - bounded).abs() < 1e-9 * heat);
    }

    #[test]
    fn damping_takes_energy_and_vanishes_at_rest() {
        let m = capsule(Outside::Clamp);
        let omega = Vec3::new(0.3, -0.2, 0.5);
        let (with, without) =
            (at(&m, Vec3::x() * 300.0, omega), at(&m, Vec3::x() * 300.0, Vec3::zeros()));
        let damping = with.load.moment - without.load.moment;
        let scale = 0.5 * 0.02 * 9e4 * 4.0 * 4.0 / 600.0;
        let want = Vec3::new(-0.1 * 0.3, 0.3 * 0.2, -0.2 * 0.5) * scale;
        assert!((damping - want).norm() < 1e-12 && damping.dot(&omega) < 0.0);
        assert_eq!(at(&m, Vec3::zeros(), omega).load, Wrench::zero());
    }

    /// A capsule that flies backwards, beyond the end of its table at 0.4 rad, is not accelerated: C_A at the end would push it with 1.3 q S.
    #[test]
    fn nothing_pushes_along_the_velocity() {
        let m = capsule(Outside::Clamp);
        for angle in [0.0, 0.3, 1.0, 1.6, 2.0, 3.0, std::f64::consts::PI] {
            let (sin, cos) = f64::sin_cos(angle);
            let v = Vec3::new(cos, 0.6 * sin, -0.8 * sin) * 500.0;
            let power = at(&m, v, Vec3::zeros()).load.force.dot(&v);
            assert!(power < 1e-6, "{angle}: {power} W");
        }
        let with = |axial: Vec<Vec<f64>>| {
            Axisymmetric::build(AxisymmetricParams {
                angles: vec![0.0, std::f64::consts::PI],
                normal: vec![vec![0.0]; 2],
                pitch: vec![vec![0.0]; 2],
                axial,
                ..capsule(Outside::Clamp).p
            })
        };
        assert!(with(vec![vec![1.6], vec![-0.9]]).is_ok());
        let e = with(vec![vec![1.6], vec![0.9]]).err().unwrap();
        assert!(
            e.param.as_deref() == Some("axial") && e.message.contains("180.00 deg"),
            "{}",
            e.message
        );
    }

    #[test]
    fn where_the_tables_end_it_clamps_or_stops() {
        let v = Vec3::new(400.0, 0.0, 300.0);
        let clamped = at(&capsule(Outside::Clamp), v, Vec3::zeros());
        assert!((clamped.load.force.x + 1.3 * clamped.dynamic_pressure * 4.0).abs() < 1e-9);
        // A trial step may evaluate the flow beyond the edge; the run stops with the message.
        assert_eq!(at(&capsule(Outside::Stop), v, Vec3::zeros()), clamped);
        let body = NodeState { velocity: v, ..NodeState::identity() };
        let u = BodyIn { body, gust: Vec3::zeros(), gust_rate: Vec3::zeros() };
        let (c, x, d) = (Clock::at(0.0, 0.01, 0), Heat { load: 3.0 }, TableExit { outside: false });
        for (outside, stops) in [(Outside::Clamp, false), (Outside::Stop, true)] {
            let m = capsule(outside);
            assert!(m.guards(&c, &d, &u).outside > 0.0);
            let (told, begins) = (
                m.runtime_warning(&c, Fired::rising(LEAVES), &d, &u).unwrap(),
                m.startup_warnings(&c, &u),
            );
            for (told, does) in [(&told, "leaves"), (&begins[0], "begins outside")] {
                let words = format!(
                    "the flow {does} the tables, which have angles of 0.00 to 22.92 deg, here 36.87 deg"
                );
                assert!(told.stops == stops && told.message == words, "{}", told.message);
            }
        }
        let m = capsule(Outside::Clamp);
        let (x, d) = m.handle_event(&x);
        let y = m.outputs(&x, &d);
        assert!(y.outside && y.heat_load == 3.0);
        assert!(m.runtime_warning(&c, Fired::rising(LEAVES), &d, &u).is_none(), "it is said once");
    }
}
