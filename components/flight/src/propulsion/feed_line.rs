//! `flight.feed_line`: propellant flows through a line from one tank to another, driven by pressure and height.
//! ```text
//! Δp = p_a − p_b + ρ a (z_a + h_a − z_b − h_b)         a: specific force along the tanks' axis; h: level; z: bottom
//! f  = K √(ρ |Δp|) sign Δp                             K = C_d A √2;  straight within |Δp| < `smooth`
//! ẇ  = (f − w)/τ,   ṁ = w while the tank that gives has propellant, else 0
//! d  = s_b − s_a                                       s: surface of the propellant in a tank, W
//! momentum of what flows: w d                          force on the tanks' bodies: −ẇ d − w ḋ − ṁ (v_b − v_a), half at each surface
//! ```
//! Positive from a to b. The connectors take ṁ from the one tank and −ṁ from the other, so that no propellant is lost. An empty tank supplies no
//! propellant, but can be filled; with a check valve, propellant does not flow back to a. Shut, nothing flows.
//!
//! Propellant that moves within a vehicle pushes the vehicle the other way, and takes part in its rotation (Coriolis). The tank models alone do not
//! include this effect: mass leaves one tank at the velocity of that tank, and enters the other at the velocity of the other. The line knows both
//! ends and exerts the missing forces, so that momentum and centre of mass of the whole vehicle are conserved. The liquid reaches its speed, and
//! comes to rest behind a closing valve, within a few τ (`inertia_time`); a fixed step of the integrator has to be shorter than 2 τ. If a tank runs
//! dry, the flow ends at once, and its momentum is returned within a few τ. The motion of liquid that spreads over the cross-section of a tank is not
//! modelled, so angular momentum about the axes of the tanks is conserved only if the tanks have equal radii. For two equal tanks without pressure
//! there is a closed form: √Δh decreases linearly with time.

use linkwork_runtime::prelude::*;

/// Line and liquid.
#[derive(Params, Clone, Debug)]
pub struct FeedLineParams {
    /// Open area times discharge coefficient, C_d A.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// Density of the propellant.
    #[param(unit = "kg/m^3", default = 1000.0, range = 1e-3..)]
    pub density: f64,
    /// Height of the bottom of tank a above the bottom of tank b, along the thrust.
    #[param(unit = "m", default = 0.0)]
    pub height: f64,
    /// Pressure difference below which the flow is linear in it, because the square root has an infinite slope at zero.
    #[param(unit = "Pa", default = 10.0, range = 1e-6..)]
    pub smooth: f64,
    /// Propellant does not flow back from b to a.
    #[param(default = false)]
    pub check_valve: bool,
    /// Time constant τ with which the flow follows the pressure difference.
    #[param(unit = "s", default = 0.1, range = 1e-6..)]
    pub inertia_time: f64,
}

/// Tanks, and pressures that drive the flow.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FeedLineIn {
    /// Bottom of tank a, its z towards the surface.
    #[port(bind = "a")]
    pub a: NodeState,
    /// Bottom of tank b.
    #[port(bind = "b")]
    pub b: NodeState,
    /// Level in tank a.
    #[port("m")]
    pub level_a: f64,
    /// Level in tank b.
    #[port("m")]
    pub level_b: f64,
    /// Pressure of the gas in tank a.
    #[port("Pa", default = 0.0)]
    pub pressure_a: f64,
    /// Pressure of the gas in tank b.
    #[port("Pa", default = 0.0)]
    pub pressure_b: f64,
    /// Specific force that presses the propellant onto the bottoms.
    #[port("m/s^2", default = 0.0)]
    pub acceleration: f64,
    /// Outlet of tank a.
    #[port(connector)]
    pub tank_a: Propellant,
    /// Outlet of tank b.
    #[port(connector)]
    pub tank_b: Propellant,
    /// Opening of the valve, 0 to 1.
    #[port("1", default = 1.0)]
    pub open: f64,
}

/// Flow, and the loads on the bodies of the tanks.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FeedLineOut {
    /// Force of the moving liquid at tank a.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// Force of the moving liquid at tank b.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Flow out of tank a.
    #[port(connector)]
    pub tank_a: MassFlow,
    /// Flow out of tank b: the negative of the flow out of a.
    #[port(connector)]
    pub tank_b: MassFlow,
    /// Pressure difference that drives the flow.
    #[port("Pa")]
    pub difference: f64,
}

/// The liquid under way.
#[derive(State, Clone, Copy, Debug)]
pub struct UnderWay {
    /// Flow w of the liquid in the line.
    #[port("kg/s")]
    pub moving: f64,
    /// Level in tank a, smoothed by τ.
    #[port("m")]
    pub level_a: f64,
    /// Level in tank b, smoothed by τ.
    #[port("m")]
    pub level_b: f64,
}

/// Beginning of the part.
#[derive(State, Clone, Copy, Debug)]
pub struct Begun {
    /// The smoothed levels have been set to the levels at the start.
    #[port]
    pub begun: bool,
}

/// Guard at the start, when the levels become known.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Beginning {
    /// Positive until the smoothed levels have been set.
    #[port("1", rising)]
    pub start: f64,
}

/// A line between tanks.
pub struct FeedLine {
    p: FeedLineParams,
}

impl FeedLine {
    /// Steady flow from a to b (kg/s), and the pressure difference that drives it (Pa).
    fn steady(&self, u: &FeedLineIn) -> (f64, f64) {
        let p = &self.p;
        let along = if u.acceleration < 0.0 { 0.0 } else { u.acceleration };
        let head = p.density * along * (p.height + u.level_a - u.level_b);
        let difference = u.pressure_a - u.pressure_b + head;
        let k = p.area * 2f64.sqrt() * u.open.clamp(0.0, 1.0);
        let size = difference.abs();
        // For small |Δp|, replace the root by |Δp|/√smooth, which is equal to the root at |Δp| =
        // smooth.
        let root = if size < p.smooth { size / p.smooth.sqrt() } else { size.sqrt() };
        let flow = k * p.density.sqrt() * root * difference.signum();
        let source = if flow > 0.0 { u.tank_a.available } else { u.tank_b.available };
        let shut = !source || (p.check_valve && flow < 0.0);
        (if shut { 0.0 } else { flow }, difference)
    }

    /// Derivative of the liquid's state.
    fn rate(&self, x: &UnderWay, u: &FeedLineIn) -> UnderWay {
        let tau = self.p.inertia_time;
        UnderWay {
            moving: (self.steady(u).0 - x.moving) / tau,
            level_a: (u.level_a - x.level_a) / tau,
            level_b: (u.level_b - x.level_b) / tau,
        }
    }
}

/// Returns the vector from the bottom of a tank to the surface at `level` (m), and the velocity of that point of the tank, W.
fn surface(bottom: &NodeState, level: f64) -> (Vec3, Vec3) {
    let arm = bottom.rotation * Vec3::z() * level;
    (arm, bottom.velocity + bottom.angular.cross(&arm))
}

/// Flow through a line between two tanks, by pressure and by height, with the momentum of what flows.
#[model("flight.feed_line")]
impl Model for FeedLine {
    type Params = FeedLineParams;
    type FeedthroughInputs = FeedLineIn;
    type FeedthroughOutputs = FeedLineOut;
    type State = UnderWay;
    type DiscreteState = Begun;
    type Guards = Beginning;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        vec![(
            Judge::Param("height"),
            unwired(wired, "acceleration", "a column without weight has no pressure"),
        )]
    }
    fn init_x(&self) -> UnderWay {
        UnderWay { moving: 0.0, level_a: 0.0, level_b: 0.0 }
    }
    fn feedthrough(&self, x: &UnderWay, u: &FeedLineIn) -> FeedLineOut {
        let source = if x.moving > 0.0 { u.tank_a.available } else { u.tank_b.available };
        let flow = if source { x.moving } else { 0.0 };
        let (difference, dx) = (self.steady(u).1, self.rate(x, u));
        let (at_a, v_a) = surface(&u.a, x.level_a);
        let (at_b, v_b) = surface(&u.b, x.level_b);
        let way = u.b.position + at_b - u.a.position - at_a;
        let rising = u.b.rotation * Vec3::z() * dx.level_b - u.a.rotation * Vec3::z() * dx.level_a;
        let parting = v_b - v_a;
        // The mass that flows has the velocities of the surfaces at the present levels.
        let carried = surface(&u.b, u.level_b).1 - surface(&u.a, u.level_a).1;
        let force = -way * dx.moving - (parting + rising) * x.moving - carried * flow;
        let half = force * 0.5;
        FeedLineOut {
            on_a: Wrench { moment: at_a.cross(&half), force: half },
            on_b: Wrench { moment: at_b.cross(&half), force: half },
            tank_a: MassFlow { flow },
            tank_b: MassFlow { flow: -flow },
            difference,
        }
    }
    fn derivatives(&self, x: &UnderWay, u: &FeedLineIn) -> UnderWay {
        self.rate(x, u)
    }
    fn guards(&self, d: &Begun) -> Beginning {
        Beginning { start: if d.begun { -1.0 } else { 1.0 } }
    }
    fn handle_event(&self, x: &UnderWay, u: &FeedLineIn) -> (UnderWay, Begun) {
        // Smoothed levels that rise from zero would exert the force of liquid that rises.
        (UnderWay { level_a: u.level_a, level_b: u.level_b, ..*x }, Begun { begun: true })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(check_valve: bool) -> FeedLine {
        let p = FeedLineParams {
            area: 1e-4,
            density: 800.0,
            height: 0.0,
            smooth: 1.0,
            check_valve,
            inertia_time: 0.1,
        };
        FeedLine { p }
    }

    fn input(level_a: f64, level_b: f64) -> FeedLineIn {
        FeedLineIn {
            a: NodeState::identity(),
            b: NodeState::identity(),
            level_a,
            level_b,
            pressure_a: 0.0,
            pressure_b: 0.0,
            acceleration: 5.0,
            tank_a: Propellant { available: true },
            tank_b: Propellant { available: true },
            open: 1.0,
        }
    }

    /// Steady flow.
    fn flow(line: &FeedLine, u: &FeedLineIn) -> f64 {
        let (moving, _) = line.steady(u);
        let x = UnderWay { moving, level_a: u.level_a, level_b: u.level_b };
        let y = line.feedthrough(&x, u);
        assert!(y.tank_a.flow == -y.tank_b.flow && y.tank_a.flow == moving);
        assert_eq!(line.derivatives(&x, u).moving, 0.0);
        // The flow ends at once if the tank runs dry.
        let dry = FeedLineIn {
            tank_a: Propellant { available: moving < 0.0 },
            tank_b: Propellant { available: moving > 0.0 },
            ..*u
        };
        assert_eq!(line.feedthrough(&x, &dry).tank_a.flow, 0.0);
        y.tank_a.flow
    }

    #[test]
    fn flow_is_that_of_bernoulli_and_goes_both_ways() {
        let m = line(false);
        let wanted = 1e-4 * 800.0 * f64::sqrt(2.0 * 5.0 * 0.6);
        assert!((flow(&m, &input(1.0, 0.4)) / wanted - 1.0).abs() < 1e-14);
        assert!((flow(&m, &input(0.4, 1.0)) / wanted + 1.0).abs() < 1e-14);
        // A pressure has the same effect as the height of its column.
        let u = FeedLineIn { pressure_a: 800.0 * 5.0 * 0.6, ..input(0.4, 0.4) };
        assert!((flow(&m, &u) / wanted - 1.0).abs() < 1e-14);
        // The flow is continuous where the root is replaced by a straight line.
        let at = |p: f64| flow(&m, &FeedLineIn { pressure_a: p, ..input(0.4, 0.4) });
        assert!((at(1.0 + 1e-9) - at(1.0 - 1e-9)).abs() < 1e-9 && at(0.0) == 0.0);
        assert!((at(0.5) + at(-0.0) - 0.5 * at(1.0)).abs() < 1e-15);
    }

    /// Two upright tanks of section S: dΔh/dt = −2 C_d A √(2 a Δh)/S, so √Δh = √Δh₀ − C_d A √(2a) t/S.
    #[test]
    fn two_tanks_level_out_as_the_closed_form_says() {
        let (m, section, h0) = (line(false), 0.05, 1.2);
        let (mut a, mut b, dt) = (1.4, 0.2, 0.01);
        let steps = 2000;
        for _ in 0..steps {
            let f = |a: f64, b: f64| flow(&m, &input(a, b)) / (800.0 * section);
            let half = f(a, b) * 0.5 * dt;
            let d = f(a - half, b + half) * dt;
            (a, b) = (a - d, b + d);
        }
        let t = f64::from(steps) * dt;
        let root = f64::sqrt(h0) - 1e-4 * f64::sqrt(2.0 * 5.0) * t / section;
        assert!(root > 0.5, "it is not over: {root}");
        assert!((a - b - root * root).abs() < 1e-8, "{} {}", a - b, root * root);
        assert!((a + b - 1.6).abs() < 1e-13, "nothing is lost");
    }

    #[test]
    fn dry_tanks_valves_and_weightlessness_stop_it() {
        let m = line(false);
        assert_eq!(
            flow(&m, &FeedLineIn { tank_a: Propellant { available: false }, ..input(1.0, 0.0) }),
            0.0
        );
        assert_eq!(
            flow(&m, &FeedLineIn { tank_b: Propellant { available: false }, ..input(0.0, 1.0) }),
            0.0
        );
        // A dry tank can be filled.
        assert!(
            flow(&m, &FeedLineIn { tank_b: Propellant { available: false }, ..input(1.0, 0.0) })
                > 0.0
        );
        assert!(
            flow(&m, &FeedLineIn { tank_a: Propellant { available: false }, ..input(0.0, 1.0) })
                < 0.0
        );
        assert_eq!(flow(&m, &FeedLineIn { open: 0.0, ..input(1.0, 0.4) }), 0.0);
        assert_eq!(flow(&m, &FeedLineIn { acceleration: 0.0, ..input(1.0, 0.4) }), 0.0);
        let half = flow(&m, &FeedLineIn { open: 0.5, ..input(1.0, 0.4) });
        assert!((2.0 * half / flow(&m, &input(1.0, 0.4)) - 1.0).abs() < 1e-14);
        assert_eq!(flow(&line(true), &input(0.4, 1.0)), 0.0);
        assert!(flow(&line(true), &input(1.0, 0.4)) > 0.0);
    }
}
