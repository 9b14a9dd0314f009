//! `flight.feed_line`: propellant goes through a line from one tank to another, driven by pressure and by height.
//! ```text
//! Δp = p_a − p_b + ρ a (z_a + h_a − z_b − h_b)         a: specific force along the tanks' axis; h: level; z: bottom
//! ṁ  = K √(ρ |Δp|) sign Δp                             K = C_d A √2;  straight within |Δp| < `smooth`
//! ```
//! Positive from a to b. The connectors `a` and `b` take ṁ from the one tank and −ṁ from the other, so that no propellant is lost. A tank
//! that has run dry is shut off, both ways; with a check valve nothing goes back to a. Shut, nothing flows. The liquid in the line has no inertia.
//! Two equal tanks without pressure level out in a time that has a closed form: √Δh falls in a straight line.

use linkwork_runtime::prelude::*;

/// Line and liquid.
#[derive(Params, Clone, Debug)]
pub struct FeedLineParams {
    /// Open area times its discharge coefficient, C_d A.
    #[param(unit = "m^2", range = 0.0..)]
    pub area: f64,
    /// Density of the propellant.
    #[param(unit = "kg/m^3", default = 1000.0, range = 1e-3..)]
    pub density: f64,
    /// Height of the bottom of tank a over that of tank b, along the thrust.
    #[param(unit = "m", default = 0.0)]
    pub height: f64,
    /// Pressure difference below which the flow is straight in it: a root has no slope at zero.
    #[param(unit = "Pa", default = 10.0, range = 1e-6..)]
    pub smooth: f64,
    /// Nothing goes back from b to a.
    #[param(default = false)]
    pub check_valve: bool,
}

/// The tanks, and what presses.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FeedLineIn {
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
    /// Tank a.
    #[port(connector)]
    pub a: Propellant,
    /// Tank b.
    #[port(connector)]
    pub b: Propellant,
    /// How far the valve is open, 0 to 1.
    #[port("1", default = 1.0)]
    pub open: f64,
}

/// What flows.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FeedLineOut {
    /// Flow out of tank a; positive from a to b.
    #[port(connector)]
    pub a: MassFlow,
    /// Flow out of tank b: the negative of the flow out of a.
    #[port(connector)]
    pub b: MassFlow,
    /// What drives it.
    #[port("Pa")]
    pub difference: f64,
}

/// A line between tanks.
pub struct FeedLine {
    p: FeedLineParams,
}

/// Flow through a line between two tanks, by pressure and by height.
#[model("flight.feed_line")]
impl Model for FeedLine {
    type Params = FeedLineParams;
    type Ud = FeedLineIn;
    type Yd = FeedLineOut;
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &FeedLineIn) -> FeedLineOut {
        let p = &self.p;
        let head = p.density * u.acceleration.max(0.0) * (p.height + u.level_a - u.level_b);
        let difference = u.pressure_a - u.pressure_b + head;
        let k = p.area * 2f64.sqrt() * u.open.clamp(0.0, 1.0);
        let size = difference.abs();
        // |Δp|/√smooth: meets the root where |Δp| = smooth.
        let root = if size < p.smooth { size / p.smooth.sqrt() } else { size.sqrt() };
        let mut flow = k * p.density.sqrt() * root * difference.signum();
        if !(u.a.available && u.b.available) || (p.check_valve && flow < 0.0) {
            flow = 0.0;
        }
        FeedLineOut { a: MassFlow { flow }, b: MassFlow { flow: -flow }, difference }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(check_valve: bool) -> FeedLine {
        let p =
            FeedLineParams { area: 1e-4, density: 800.0, height: 0.0, smooth: 1.0, check_valve };
        FeedLine { p }
    }

    fn input(level_a: f64, level_b: f64) -> FeedLineIn {
        FeedLineIn {
            level_a,
            level_b,
            pressure_a: 0.0,
            pressure_b: 0.0,
            acceleration: 5.0,
            a: Propellant { available: true },
            b: Propellant { available: true },
            open: 1.0,
        }
    }

    fn flow(line: &FeedLine, u: &FeedLineIn) -> f64 {
        let y = line.direct(&Clock::at(0.0, 0.1, 0), &(), &(), u, &());
        assert_eq!(y.a.flow, -y.b.flow);
        y.a.flow
    }

    #[test]
    fn flow_is_that_of_bernoulli_and_goes_both_ways() {
        let m = line(false);
        let wanted = 1e-4 * 800.0 * f64::sqrt(2.0 * 5.0 * 0.6);
        assert!((flow(&m, &input(1.0, 0.4)) / wanted - 1.0).abs() < 1e-14);
        assert!((flow(&m, &input(0.4, 1.0)) / wanted + 1.0).abs() < 1e-14);
        // Pressure does what the height of its column does.
        let u = FeedLineIn { pressure_a: 800.0 * 5.0 * 0.6, ..input(0.4, 0.4) };
        assert!((flow(&m, &u) / wanted - 1.0).abs() < 1e-14);
        // Without a jump where the root becomes straight.
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
            flow(&m, &FeedLineIn { a: Propellant { available: false }, ..input(1.0, 0.0) }),
            0.0
        );
        assert_eq!(
            flow(&m, &FeedLineIn { b: Propellant { available: false }, ..input(1.0, 0.0) }),
            0.0
        );
        assert_eq!(flow(&m, &FeedLineIn { open: 0.0, ..input(1.0, 0.4) }), 0.0);
        assert_eq!(flow(&m, &FeedLineIn { acceleration: 0.0, ..input(1.0, 0.4) }), 0.0);
        let half = flow(&m, &FeedLineIn { open: 0.5, ..input(1.0, 0.4) });
        assert!((2.0 * half / flow(&m, &input(1.0, 0.4)) - 1.0).abs() < 1e-14);
        assert_eq!(flow(&line(true), &input(0.4, 1.0)), 0.0);
        assert!(flow(&line(true), &input(1.0, 0.4)) > 0.0);
    }
}
