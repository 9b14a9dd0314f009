//! `flight.sphere_cone`: aerodynamics of a blunt cone in Newtonian flow, from its shape without tables.
//! ```text
//! C_A, C_N, C_m    the closed form of `SphereCone`, C_p,max = 4/(γ+1) ((γ+1)²/4γ)^(γ/(γ−1))
//! C_A + C_p,b      base: viking adds −C_p,b(M) over the base, on the axis; none adds nothing
//! S = π r_b²       D = 2 r_b       r_n = ν r_b, of the heat flux, too
//! F, M, q̇         as `flight.axisymmetric_aerodynamics`, whose point of reference is the tip of the nose here
//! ```
//! The closed form is valid while the flow reaches the whole fore-body, that is, for total angles of attack up to the half-angle. Above, `outside`
//! selects the coefficients at the half-angle or a stop of the run. C_p,max is the limit for M → ∞; at Mach 3 it is 5 % too high for air. At lower
//! Mach numbers the flow is not Newtonian; `outside` applies below Mach 1, too.

use super::air_data::{AirData, Outside};
use super::air_data::{check_air_rate, heating_constant};
use super::axisymmetric::{AxisymmetricOut, BodyIn, Edge, Heat, LEAVES, Passed, Scales, TableExit};
use super::sphere_cone::{SphereCone, base_pressure, pressure_max};
use linkwork_surroundings::prelude::*;
use std::f64::consts::PI;

/// Model of the base pressure.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// Base pressure over Mach number, fitted to Viking.
    Viking,
    /// No base drag: the base has the pressure of the free stream, as in Newtonian flow.
    None,
}

/// Shape and gas properties.
#[derive(Params, Clone, Debug)]
pub struct SphereConeParams {
    /// Half-angle of the cone, between axis and side.
    #[param(unit = "rad", range = 0.01..=0.5 * PI)]
    pub half_angle: f64,
    /// Ratio of nose radius to base radius.
    #[param(range = 1e-6..=1.0)]
    pub bluntness: f64,
    /// Radius of the base.
    #[param(unit = "m", range = 1e-6..)]
    pub base_radius: f64,
    /// Ratio of specific heats of the gas: air 1.4, carbon dioxide 1.29; 1 gives the Newtonian pressure coefficient 2.
    #[param(range = 1.0..=2.0)]
    pub gamma: f64,
    /// Base pressure model: viking, none.
    #[param(default = Base::Viking)]
    pub base: Base,
    /// Tip of the nose relative to the node, body axes.
    #[param(unit = "m", default = Vec3::zeros())]
    pub nose: Vec3,
    /// Damping coefficients (C_lp, C_mq, C_nr), for rates times D/(2V).
    #[param(default = Vec3::zeros())]
    pub damping: Vec3,
    /// Rotation rate of the air with its planet, W, for the damping: the rate of the `world`; default: body rates relative to W.
    #[param(unit = "rad/s", default = Vec3::zeros(), needs = "damping")]
    pub air_rate: Vec3,
    /// Behaviour above the half-angle and below Mach 1: clamp, stop.
    #[param(default = Outside::Clamp)]
    pub outside: Outside,
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

/// Aerodynamics of a sphere-cone.
pub struct SphereConeShell {
    p: SphereConeParams,
    shape: SphereCone,
    scales: Scales,
}

impl SphereConeShell {
    /// Returns the air data and the distance inside the valid range: the relative distance below the half-angle or the distance above Mach 1,
    /// whichever is less.
    fn air(&self, t: f64, u: &BodyIn) -> (AirData, f64) {
        let data =
            AirData::met(&self.p.atmosphere, t, &u.body, &(self.p.air_rate + u.gust_rate), &u.gust);
        let by_angle = (self.p.half_angle - data.alpha_total()) / self.p.half_angle;
        // The Mach number is meaningless in a vacuum.
        let fast = if data.density > 0.0 { data.mach - 1.0 } else { by_angle };
        (data, by_angle.min(fast))
    }

    /// Builds the message for a flow outside the valid range.
    fn beyond(&self, does: &str, a: &AirData) -> BuildError {
        let (total, half) = (a.alpha_total().to_degrees(), self.p.half_angle.to_degrees());
        if total <= half {
            let fact = format!(
                "the flow {does} at Mach {:.4}, but Newtonian flow is only valid far above Mach 1",
                a.mach
            );
            let remedy = "use `flight.axisymmetric_aerodynamics` with tables";
            return self.p.outside.says(fact, "the coefficients of hypersonic flow are", remedy);
        }
        let fact = format!(
            "the flow {does} at a total angle of attack of {total:.2} deg, above the half-angle of {half:.2} deg, where it does not reach all of the fore-body"
        );
        let remedy = "use `flight.panel_aerodynamics` with a mesh";
        self.p.outside.says(fact, "the coefficients at the half-angle are", remedy)
    }
}

/// Aerodynamic force and moment of a blunt cone in Newtonian flow from half-angle, bluntness and radius, with stagnation heating.
#[model("flight.sphere_cone")]
impl Model for SphereConeShell {
    type Params = SphereConeParams;
    type FeedthroughInputs = BodyIn;
    type Outputs = Passed;
    type FeedthroughOutputs = AxisymmetricOut;
    type State = Heat;
    type DiscreteState = TableExit;
    type Guards = Edge;
    fn build(p: SphereConeParams) -> Result<Self, BuildError> {
        check_air_rate(&p.air_rate, p.world.as_ref(), "air_rate")?;
        let (half_angle, bluntness) = (p.half_angle, p.bluntness);
        let shape = SphereCone { half_angle, bluntness, pressure_max: pressure_max(p.gamma) };
        let scales = Scales {
            area: PI * p.base_radius * p.base_radius,
            length: 2.0 * p.base_radius,
            reference: p.nose,
            damping: p.damping,
            heating_constant: heating_constant(p.heating_constant, &p.atmosphere)?,
            nose_radius: bluntness * p.base_radius,
        };
        Ok(SphereConeShell { p, shape, scales })
    }
    fn outputs(&self, x: &Heat, d: &TableExit) -> Passed {
        Passed { heat_load: x.load, outside: d.outside }
    }
    fn feedthrough(&self, clock: &Clock, u: &BodyIn) -> AxisymmetricOut {
        let (a, _) = self.air(clock.t, u);
        let by_shape = self.shape.at(a.alpha_total().min(self.p.half_angle), 0.0);
        let base = match self.p.base {
            Base::Viking => base_pressure(a.mach),
            Base::None => 0.0,
        };
        let coefficients = [by_shape.axial - base, by_shape.normal, by_shape.pitch];
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
        // The setting `outside: stop` stops the run even if the flow has been outside before.
        let silent = d.outside && self.p.outside == Outside::Clamp;
        (fired.rose(LEAVES) && !silent).then(|| self.beyond("goes on", &self.air(clock.t, u).0))
    }
    fn startup_warnings(&self, clock: &Clock, u: &BodyIn) -> Vec<BuildError> {
        let (a, inside) = self.air(clock.t, u);
        let outside = inside < 0.0;
        outside.then(|| self.beyond("begins", &a)).into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::testing;

    const RADIUS: f64 = 2.25;

    /// The shell of the reference table: 70 deg, bluntness 0.5, C_p,max 2, the node 0.3 base radii behind the nose.
    fn params() -> SphereConeParams {
        SphereConeParams {
            half_angle: 70f64.to_radians(),
            bluntness: 0.5,
            base_radius: RADIUS,
            gamma: 1.0,
            base: Base::None,
            nose: Vec3::x() * (0.3 * RADIUS),
            damping: Vec3::zeros(),
            air_rate: Vec3::zeros(),
            world: None,
            outside: Outside::Clamp,
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
        }
    }

    fn shell(p: SphereConeParams) -> SphereConeShell {
        SphereConeShell::build(p).unwrap()
    }

    const STATE: (Heat, TableExit) = (Heat { load: 0.0 }, TableExit { outside: false });

    fn inputs(alpha: f64, roll: f64, speed: f64, angular: Vec3) -> BodyIn {
        let across = Vec3::new(0.0, roll.sin(), roll.cos());
        let velocity = (Vec3::x() * alpha.cos() + across * alpha.sin()) * speed;
        let rotation = Quat::from_euler_angles(0.3, -1.1, 0.7);
        let (velocity, angular) = (rotation * velocity, rotation * angular);
        let body = NodeState { rotation, velocity, angular, ..NodeState::identity() };
        BodyIn { body, gust: Vec3::zeros(), gust_rate: Vec3::zeros() }
    }

    fn at(m: &SphereConeShell, u: &BodyIn) -> AxisymmetricOut {
        m.feedthrough(&Clock::at(0.0, 0.01, 0), u)
    }

    /// (C_A, C_N, C_m about the node, C_D, C_L) from the load.
    fn coefficients(m: &SphereConeShell, alpha: f64, roll: f64) -> [f64; 5] {
        let u = inputs(alpha, roll, 5000.0, Vec3::zeros());
        let y = at(m, &u);
        let back = u.body.rotation.inverse();
        let qs = y.dynamic_pressure * PI * RADIUS * RADIUS;
        let (f, moment) = (back * y.load.force / qs, back * y.load.moment / (qs * 2.0 * RADIUS));
        let across = Vec3::new(0.0, roll.sin(), roll.cos());
        let drag = Vec3::x() * alpha.cos() + across * alpha.sin();
        let lift = Vec3::x() * alpha.sin() - across * alpha.cos();
        let nose_up = across.cross(&Vec3::x());
        [-f.x, -f.dot(&across), moment.dot(&nose_up), -f.dot(&drag), f.dot(&lift)]
    }

    /// Agrees with the reference table to all printed digits; the moment is computed at the nose and shifted to the node.
    #[test]
    fn the_table_of_the_seventy_degree_cone() {
        let m = shell(params());
        for (alpha, want, ratio) in [
            (0.0_f64, [1.769_465, 0.0, 0.0, 1.769_465, 0.0], 0.0),
            (11.0, [1.709_239, 0.043_179_9, -0.038_221_9, 1.686_075, -0.283_752], -0.168_291),
            (16.0, [1.643_786, 0.061_082_4, -0.054_068_8, 1.596_945, -0.394_373], -0.246_954),
            (20.0, [1.575_961, 0.074_092_4, -0.065_585_1, 1.506_260, -0.469_386], -0.311_624),
        ] {
            for roll in [0.0, 1.3, -2.4] {
                let found = coefficients(&m, alpha.to_radians(), roll);
                for (f, w) in found.into_iter().zip(want) {
                    assert!((f - w).abs() < 6e-7, "{alpha} {roll}: {found:?}");
                }
                assert!((found[4] / found[3] - ratio).abs() < 6e-7, "{alpha}: {found:?}");
            }
        }
    }

    #[test]
    fn gas_and_base_are_those_of_the_parameters() {
        let newton = coefficients(&shell(params()), 0.2, 0.0);
        let gas = coefficients(&shell(SphereConeParams { gamma: 1.29, ..params() }), 0.2, 0.0);
        for (g, n) in gas.iter().zip(newton) {
            assert!((g - n * 1.876_968_671_833_093 / 2.0).abs() < 1e-12, "{gas:?}");
        }
        // At Mach 5 the base pressure coefficient is −0.030821; the force is on the axis and has no moment about a node on it.
        let based = shell(SphereConeParams { base: Base::Viking, ..params() });
        let u = inputs(0.2, 0.0, 1250.0, Vec3::zeros());
        let without = at(&shell(params()), &u);
        let pull = u.body.rotation.inverse() * (at(&based, &u).load.force - without.load.force);
        let want = -0.030_821 * without.dynamic_pressure * PI * RADIUS * RADIUS;
        assert!((pull - Vec3::x() * want).norm() < 1e-9 * want.abs(), "{pull}");
        assert!((at(&based, &u).load.moment - without.load.moment).norm() < 1e-9);
        // The heat flux equals the flux at a nose of half the base radius.
        let heat = 1.9027e-4 * (0.02f64 / (0.5 * RADIUS)).sqrt() * 1250f64.powi(3);
        let free = 0.5 * 0.02 * without.airspeed.powi(3);
        let bounded = heat / (1.0 + (heat / free).powi(2)).sqrt();
        assert!((without.heating - bounded).abs() < 1e-9 * heat);
    }

    #[test]
    fn damping_is_over_the_diameter_and_takes_energy() {
        let damped = shell(SphereConeParams { damping: Vec3::new(-0.1, -0.3, -0.2), ..params() });
        let omega = Vec3::new(0.3, -0.2, 0.5);
        let u = inputs(0.1, 0.4, 300.0, omega);
        let moment = at(&damped, &u).load.moment - at(&shell(params()), &u).load.moment;
        let d = 2.0 * RADIUS;
        let scale = 0.5 * 0.02 * 9e4 * PI * RADIUS * RADIUS * d * d / 600.0;
        let want = Vec3::new(-0.1 * 0.3, 0.3 * 0.2, -0.2 * 0.5) * scale;
        assert!((u.body.rotation.inverse() * moment - want).norm() < 1e-9);
        assert!(moment.dot(&u.body.angular) < 0.0);
    }

    #[test]
    fn below_mach_1_it_says_that_the_flow_is_not_newtonian() {
        let (c, (_, d)) = (Clock::at(0.0, 0.01, 0), STATE);
        let m = shell(params());
        let at = |speed| inputs(0.1, 0.0, speed, Vec3::zeros());
        assert!(m.startup_warnings(&c, &at(260.0)).is_empty());
        let slow = m.startup_warnings(&c, &at(75.0));
        assert!(slow.len() == 1 && slow[0].message.contains("Mach 0.3000"));
        assert!(m.guards(&c, &d, &at(75.0)).outside > 0.0);
        assert!(
            m.runtime_warning(&c, Fired::rising(LEAVES), &d, &at(249.0))
                .unwrap()
                .message
                .contains("Mach 0.99")
        );
    }

    /// If a part of the fore-body is in the lee, the closed form is not valid: one warning with `clamp`, or the run stops.
    #[test]
    fn above_the_half_angle_it_clamps_or_stops_and_says_so() {
        let (c, (_, d)) = (Clock::at(0.0, 0.01, 0), STATE);
        let m = shell(SphereConeParams { half_angle: 0.5, ..params() });
        let edge = m.guards(&c, &d, &inputs(0.4, 0.0, 900.0, Vec3::zeros()));
        assert!((edge.outside + 0.2).abs() < 1e-12, "{edge:?}");
        let (end, beyond) = (coefficients(&m, 0.5, 0.0), coefficients(&m, 0.8, 0.0));
        assert!((0..3).all(|k| (end[k] - beyond[k]).abs() < 1e-12), "{end:?} {beyond:?}");
        let u = inputs(0.8, 0.0, 900.0, Vec3::zeros());
        assert!(m.guards(&c, &d, &u).outside > 0.0);
        let begins = m.startup_warnings(&c, &u);
        assert!(begins.len() == 1 && begins[0].message.contains("45.84 deg, above"));
        assert!(begins[0].param.as_deref() == Some("outside") && begins[0].help.is_some());
        let told = m.runtime_warning(&c, Fired::rising(LEAVES), &d, &u).unwrap();
        assert!(told.message.contains("half-angle of 28.65 deg"), "{}", told.message);
        let (x, d) = m.handle_event(&Heat { load: 3.0 });
        let y = m.outputs(&x, &d);
        assert!(y.outside && y.heat_load == 3.0);
        assert!(m.runtime_warning(&c, Fired::rising(LEAVES), &d, &u).is_none(), "it is said once");
        let near = inputs(0.4, 0.0, 900.0, Vec3::zeros());
        assert!(m.startup_warnings(&c, &near).is_empty());
        let stops = shell(SphereConeParams { half_angle: 0.5, outside: Outside::Stop, ..params() });
        // A trial step beyond the edge uses the coefficients at the edge.
        assert_eq!(at(&stops, &u), at(&m, &u));
        let (begins, told) = (stops.startup_warnings(&c, &u), |m: &SphereConeShell| {
            m.runtime_warning(&c, Fired::rising(LEAVES), &STATE.1, &u).unwrap()
        });
        assert!(begins.len() == 1 && begins[0].stops && told(&stops).stops && !told(&m).stops);
        assert!(told(&stops).help.unwrap().contains("`outside: clamp`"));
    }
}
