//! `control.drive_monitor`: stops a drive on a stalled wheel or on excessive slip, and reports the cause.
//! ```text
//! stall    |ω| < share · |ω*|  and  |τ| ≥ τ_stall  of one wheel, for `stall_after`
//! slip     s = 1 − Δx/Δw        Δw: wheel travel since the last check, of length `slip_distance`; Δx: travel of the rover along its heading, summed over samples
//!          s > slip_max
//! ```
//! Connect it between the source of motion commands and `control.ackermann`. After a stop the rover stands with its brakes on until `clear` is true.
//! While `clear` is true nothing is checked, so that a plan can drive the rover back. The travel of the rover comes from its pose estimate, which
//! limits the accuracy of slip. Turns on the spot do not contribute to slip.

use crate::geometry::{WHEELS_MAX, WheelPlace};
use linkwork_runtime::prelude::*;

/// Wheels and limits.
#[derive(Params, Clone, Debug)]
pub struct DriveMonitorParams {
    /// The wheels, in the order of the inputs; their positions and radii are not used here.
    pub wheels: Vec<WheelPlace>,
    /// Torque at which a drive is at its limit.
    #[param(unit = "N m", default = 1e9, range = 0.0..)]
    pub stall_torque: f64,
    /// Fraction of the commanded rate below which a wheel counts as not turning.
    #[param(default = 0.1, range = 0.0..=1.0, needs = "stall_torque != 1e9")]
    pub stall_share: f64,
    /// Time without turning after which a wheel counts as stalled.
    #[param(unit = "s", default = 2.0, range = 0.0.., needs = "stall_torque != 1e9")]
    pub stall_after: f64,
    /// Slip that stops the drive.
    #[param(default = 1e9, range = 0.0..)]
    pub slip_max: f64,
    /// Wheel travel between two checks of slip.
    #[param(unit = "m", default = 0.5, range = 1e-3.., needs = "slip_max != 1e9")]
    pub slip_distance: f64,
}

/// Estimated motion of the rover.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MonitorIn {
    /// Forward speed from wheel odometry.
    #[port("m/s", default = 0.0)]
    pub wheel_speed: f64,
    /// x in W.
    #[port("m", default = 0.0)]
    pub x: f64,
    /// y in W.
    #[port("m", default = 0.0)]
    pub y: f64,
    /// Heading from x towards y.
    #[port("rad", default = 0.0)]
    pub heading: f64,
    /// Clears the stop. While it is true, no check is made.
    #[port("1", default = false)]
    pub clear: bool,
}

/// Commanded motion.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WantedIn {
    /// Commanded forward speed.
    #[port("m/s", default = 0.0)]
    pub speed: f64,
    /// Commanded turn rate, to the left.
    #[port("rad/s", default = 0.0)]
    pub turn_rate: f64,
}

/// Permitted motion.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AllowedOut {
    /// Forward speed: the command, or zero after a stop.
    #[port("m/s")]
    pub drive_speed: f64,
    /// Turn rate: the command, or zero after a stop.
    #[port("rad/s")]
    pub drive_turn_rate: f64,
}

/// Cause of the stop.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MonitorOut {
    /// A wheel has stalled; latched until cleared.
    #[port("1")]
    pub stalled: bool,
    /// Slip exceeded `slip_max`; latched until cleared.
    #[port("1")]
    pub slipping: bool,
    /// Number of the stalled wheel, from 1; 0: none.
    #[port("1")]
    pub wheel: f64,
    /// Slip at the last check.
    #[port("1")]
    pub slip: f64,
}

/// State of the checks, followed by the time (s) since each wheel last turned.
#[derive(State, Clone, Copy, Debug)]
pub struct MonitorState {
    /// A wheel stalled.
    #[port("1")]
    pub stalled: bool,
    /// Slip exceeded `slip_max`.
    #[port("1")]
    pub slipping: bool,
    /// Number of the stalled wheel, from 1.
    #[port("1")]
    pub wheel: f64,
    /// Slip at the last check.
    #[port("1")]
    pub slip: f64,
    /// Position at the last sample, W.
    #[port("m")]
    pub from: [f64; 2],
    /// Heading at the last sample.
    #[port("rad")]
    pub heading: f64,
    /// Travel of the rover along its heading since the last check, signed.
    #[port("m")]
    pub moved: f64,
    /// Wheel travel since the last check, signed.
    #[port("m")]
    pub way: f64,
    /// A first sample has been taken.
    #[port("1")]
    pub started: bool,
}

/// A drive monitor.
pub struct DriveMonitor {
    p: DriveMonitorParams,
}

impl DriveMonitor {
    /// Returns the state after the checks of a sample; `u` are the inputs without the wheels.
    fn checked(&self, d: MonitorState, u: &MonitorIn, dt: f64) -> MonitorState {
        let (from, heading) = ([u.x, u.y], u.heading);
        let here = MonitorState { from, heading, way: 0.0, moved: 0.0, started: true, ..d };
        if !d.started {
            return here;
        }
        let way = d.way + u.wheel_speed * dt;
        // The heading changes on a curve, so use the heading at the middle of the sample. Angles may wrap.
        let turned = (u.heading - d.heading).sin().atan2((u.heading - d.heading).cos());
        let (sin, cos) = (d.heading + 0.5 * turned).sin_cos();
        let moved = d.moved + (u.x - d.from[0]) * cos + (u.y - d.from[1]) * sin;
        if way.abs() < self.p.slip_distance {
            return MonitorState { way, moved, ..here };
        }
        let slip = 1.0 - moved / way;
        let slipping = d.slipping || slip > self.p.slip_max;
        MonitorState { slip, slipping, ..here }
    }
}

/// Stops a drive on a stalled wheel or on excessive slip, reports the cause, and permits motion again when cleared.
#[model("control.drive_monitor")]
impl SizedModel for DriveMonitor {
    type Params = DriveMonitorParams;

    fn ports(p: &DriveMonitorParams) -> SizedPorts {
        let n = p.wheels.len();
        let mut inputs = MonitorIn::specs();
        for k in 0..n {
            for (name, unit, doc) in [
                ("target", "rad/s", "Commanded rate of the wheel."),
                ("rate", "rad/s", "Measured rate."),
                ("torque", "N m", "Torque of its drive."),
            ] {
                let port = PortSpec::named(format!("wheels[{k}].{name}"), PortKind::Numbers, 1);
                inputs.push(port.unit_of(unit).doc_of(doc).or(0.0));
            }
        }
        let doc = "Time since each wheel last turned.";
        let mut discrete = MonitorState::specs();
        discrete.push(PortSpec::named("stood", PortKind::Numbers, n).unit_of("s").doc_of(doc));
        SizedPorts {
            inputs,
            feedthrough_inputs: WantedIn::specs(),
            outputs: MonitorOut::specs(),
            feedthrough_outputs: AllowedOut::specs(),
            discrete,
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let torque = unwired(wired, "torque", "no drive is ever at its limit");
        let measured = unwired(wired, "wheel_speed", "the slip is not known");
        vec![(Judge::Param("stall_torque"), torque), (Judge::Param("slip_max"), measured)]
    }
    fn build(p: DriveMonitorParams) -> Result<Self, BuildError> {
        if p.wheels.is_empty() || p.wheels.len() > WHEELS_MAX {
            let why = BuildError::new(format!("{} wheels", p.wheels.len()));
            return Err(why.help(format!("write 1 to {WHEELS_MAX}")).at("wheels"));
        }
        Ok(DriveMonitor { p })
    }

    fn outputs(&self, d: &[f64], y: &mut [f64]) {
        let MonitorState { stalled, slipping, wheel, slip, .. } = MonitorState::get(d);
        MonitorOut { stalled, slipping, wheel, slip }.put(y);
    }

    fn feedthrough(&self, d: &[f64], u: &[f64], y: &mut [f64]) {
        let d = MonitorState::get(d);
        let WantedIn { speed, turn_rate } = WantedIn::get(u);
        let out = match d.stalled || d.slipping {
            true => AllowedOut { drive_speed: 0.0, drive_turn_rate: 0.0 },
            false => AllowedOut { drive_speed: speed, drive_turn_rate: turn_rate },
        };
        out.put(y);
    }

    fn update(&self, clock: &Clock, d: &mut [f64], u: &[f64]) {
        let (head, stood) = d.split_at_mut(MonitorState::N);
        let d = MonitorState::get(head);
        let (own, rest) = u.split_at(MonitorIn::N);
        let own = MonitorIn::get(own);
        if own.clear {
            stood.fill(0.0);
            self.checked(MonitorState::zero(), &own, clock.dt).put(head);
            return;
        }
        let mut next = self.checked(d, &own, clock.dt);
        for (k, (stood, wheel)) in stood.iter_mut().zip(rest.chunks_exact(3)).enumerate() {
            let [target, rate, torque] = [wheel[0], wheel[1], wheel[2]];
            let stands =
                target != 0.0 && rate * target.signum() < self.p.stall_share * target.abs();
            let limit = torque * target.signum() >= self.p.stall_torque;
            *stood = if stands && limit { *stood + clock.dt } else { 0.0 };
            if *stood > self.p.stall_after && !next.stalled {
                (next.stalled, next.wheel) = (true, (k + 1) as f64);
            }
        }
        next.put(head);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tests::places;

    /// Two wheels at 10 Hz, which stall at 50 N m and may slip by a half.
    fn monitor() -> DriveMonitor {
        let p = DriveMonitorParams {
            wheels: places(&[([0.0, 1.0], false), ([0.0, -1.0], false)]),
            stall_torque: 50.0,
            stall_share: 0.1,
            stall_after: 1.0,
            slip_max: 0.5,
            slip_distance: 0.5,
        };
        DriveMonitor::build(p).unwrap()
    }

    /// Inputs without the wheels, then target, rate and torque of each.
    fn sample(m: &DriveMonitor, d: &mut [f64; 12], own: [f64; 5], wheels: [[f64; 3]; 2]) {
        let u: Vec<f64> = own.into_iter().chain(wheels.into_iter().flatten()).collect();
        m.update(&Clock::at(0.0, 0.1, 0), d, &u);
    }

    fn drives(m: &DriveMonitor, d: &[f64; 12]) -> bool {
        let mut y = [f64::NAN; 2];
        m.feedthrough(d, &[0.2, 0.1], &mut y);
        assert!(y == [0.2, 0.1] || y == [0.0, 0.0], "{y:?}");
        y[0] != 0.0
    }

    const TURNS: [f64; 3] = [1.0, 1.0, 60.0];

    #[test]
    fn a_wheel_that_stands_at_its_limit_for_long_enough_stops_the_drive() {
        for side in [1.0, -1.0] {
            let (m, mut d) = (monitor(), [0.0; 12]);
            let stands = [side, 0.05 * side, 55.0 * side];
            for _ in 0..10 {
                sample(&m, &mut d, [0.0; 5], [TURNS, stands]);
            }
            assert!(drives(&m, &d), "a second is not longer than a second");
            sample(&m, &mut d, [0.0; 5], [TURNS, stands]);
            let s = MonitorState::get(&d);
            assert!(s.stalled && !s.slipping && s.wheel == 2.0 && !drives(&m, &d), "{s:?}");
            // The stop remains when the wheel is free again, until it is cleared.
            sample(&m, &mut d, [0.0; 5], [TURNS, TURNS]);
            assert!(!drives(&m, &d));
            sample(&m, &mut d, [0.0, 0.0, 0.0, 0.0, 1.0], [TURNS, stands]);
            assert!(drives(&m, &d));
        }
    }

    #[test]
    fn what_is_no_stall_does_not_stop_it() {
        // The wheel is slow but rotates; it is at rest but not at its limit; its load drives it backwards;
        // or it is not commanded to rotate.
        for wheel in [[1.0, 0.2, 60.0], [1.0, 0.0, 40.0], [1.0, 0.0, -60.0], [0.0, 0.0, 60.0]] {
            let (m, mut d) = (monitor(), [0.0; 12]);
            for _ in 0..100 {
                sample(&m, &mut d, [0.0; 5], [wheel, wheel]);
            }
            assert!(drives(&m, &d), "{wheel:?}");
        }
        // A wheel that is only sometimes at rest does not stop the drive, either.
        let (m, mut d) = (monitor(), [0.0; 12]);
        for k in 0..100 {
            let wheel = if k % 8 == 0 { TURNS } else { [1.0, 0.0, 60.0] };
            sample(&m, &mut d, [0.0; 5], [wheel, wheel]);
        }
        assert!(drives(&m, &d));
    }

    #[test]
    fn slip_is_of_the_way_and_stops_it_beyond_its_limit() {
        // The rover drives forwards and backwards along a heading of 30 degrees; its speed is divided by the speed of the wheels.
        for (share, stops) in [(0.9, false), (0.55, false), (0.45, true), (-0.1, true)] {
            for speed in [0.2, -0.2] {
                let (m, mut d) = (monitor(), [0.0; 12]);
                let heading = std::f64::consts::FRAC_PI_6;
                for k in 0..60 {
                    let way = 0.1 * f64::from(k) * speed * share;
                    let [x, y] = [3.0 + way * heading.cos(), way * heading.sin() - 1.0];
                    sample(&m, &mut d, [speed, x, y, heading, 0.0], [TURNS, TURNS]);
                }
                let s = MonitorState::get(&d);
                assert_eq!((s.slipping, drives(&m, &d)), (stops, !stops), "{share}, {speed}");
                assert!((s.slip - (1.0 - share)).abs() < 1e-12, "{s:?}");
            }
        }
    }

    /// Three quarters of a circle of 0.5 m radius at 0.05 m/s without slip: the chord of 0.5 m would read 16 % of slip.
    #[test]
    fn a_curve_without_slip_reads_none() {
        for side in [1.0, -1.0] {
            let (m, mut d) = (monitor(), [0.0; 12]);
            for k in 0..480 {
                let angle = 0.01 * f64::from(k);
                let [x, y] = [0.5 * angle.sin(), 0.5 * side * (1.0 - angle.cos())];
                // This estimate keeps its heading between −π and π.
                let heading = (side * angle).sin().atan2((side * angle).cos());
                sample(&m, &mut d, [0.05, x, y, heading, 0.0], [TURNS, TURNS]);
            }
            let s = MonitorState::get(&d);
            assert!(s.slip.abs() < 1e-4 && s.slip != 0.0 && !s.slipping, "{s:?}");
        }
    }

    #[test]
    fn limits_that_are_not_written_stop_nothing() {
        let p = DriveMonitorParams { stall_torque: 1e9, slip_max: 1e9, ..monitor().p };
        let (m, mut d) = (DriveMonitor::build(p.clone()).unwrap(), [0.0; 12]);
        for _ in 0..100 {
            sample(&m, &mut d, [0.2, 0.0, 0.0, 0.0, 0.0], [[1.0, 0.0, 99.0]; 2]);
        }
        assert!(drives(&m, &d) && MonitorState::get(&d).slip == 1.0);
        assert!(DriveMonitor::build(DriveMonitorParams { wheels: Vec::new(), ..p }).is_err());
    }
}
