//! `control.ackermann`: computes steering angles and wheel rates from a speed and a turn rate, for a rover with any number of wheels, steered or not.
//!
//! Steer, then drive: steering commands move at a limited rate, and wheel rates are scaled down until the steering angles are close to their
//! commands. Speed changes at a limited acceleration (trapezoidal profile). Curvature is limited by the steering limit, except on the spot (speed
//! zero). While all wheel commands are zero, the brakes are on.
//!
//! On hard ground, wheels at exact rates work against each other, because their path lengths over bumps differ. With `droop`, each rate decreases
//! with its load (speed droop), so that the torque is shared:
//! ```text
//! rate_i = ω_i − clamp(κ (τ_i − mean τ), ±0.15 max |ω|)        τ: torque at the wheel, low-pass filtered over 0.2 s
//! ```

use crate::geometry::{Drive, Layout, STEER_MAX, WheelPlace};
use linkwork_runtime::prelude::*;

/// Wheels and limits.
#[derive(Params, Clone, Debug)]
pub struct AckermannParams {
    /// The wheels, in the order of the outputs.
    pub wheels: Vec<WheelPlace>,
    /// Radius of all wheels for which `wheels` does not state a radius.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// Maximum steering angle.
    #[param(unit = "rad", default = 1.5, range = 0.01..=STEER_MAX)]
    pub steer_max: f64,
    /// Rate limit of steering commands.
    #[param(unit = "rad/s", default = 0.5, range = 1e-3..)]
    pub steer_rate: f64,
    /// Acceleration limit of the wheel speeds.
    #[param(unit = "m/s^2", default = 0.1, range = 1e-4..)]
    pub acceleration: f64,
    /// Steering error at which the wheels stop.
    #[param(unit = "rad", default = 0.3, range = 1e-3..)]
    pub alignment: f64,
    /// Maximum rate of the drives: speed and turn rate are scaled together so that no wheel command exceeds it.
    #[param(unit = "rad/s", range = 1e-3..)]
    pub rate_max: Option<f64>,
    /// Speed droop κ, rad/s per N m: decrease of a wheel's rate command for each newton metre of torque above the mean of all wheels; 0: exact rates.
    #[param(default = 0.0, range = 0.0..)]
    pub droop: f64,
}

/// Maximum rate correction by torque sharing, relative to the rate of the fastest wheel.
const SHARED_MAX: f64 = 0.15;
/// Averaging time of torques, s.
const SHARED_OVER: f64 = 0.2;

/// Commanded motion.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AckermannIn {
    /// Forward speed.
    #[port("m/s", default = 0.0)]
    pub speed: f64,
    /// Turn rate, to the left.
    #[port("rad/s", default = 0.0)]
    pub turn_rate: f64,
}

/// Steering angles and wheel rates. Discrete state: the steering of each wheel (rad), then the rate of each (rad/s),
/// then whether the motion was limited, then the rate correction of each wheel by torque sharing (rad/s).
pub struct Ackermann {
    p: AckermannParams,
    layout: Layout,
}

impl Ackermann {
    /// Returns the commanded speed and turn rate after the limits of curvature and drive rates, and whether the drive limit applied. Returns `None`
    /// if both are zero: without a direction, the steering angles stay.
    fn wanted(&self, u: &AckermannIn) -> Option<(f64, f64, bool)> {
        let turn = if u.speed == 0.0 {
            u.turn_rate
        } else {
            let most = u.speed.abs() / self.layout.radius_min(self.p.steer_max);
            u.turn_rate.clamp(-most, most)
        };
        if u.speed == 0.0 && turn == 0.0 {
            return None;
        }
        let rate = |i: usize| self.layout.command(i, u.speed, turn)[1].abs();
        let fastest = (0..self.layout.count()).map(rate).fold(0.0_f64, f64::max);
        let share = match self.p.rate_max {
            Some(most) if fastest > most => most / fastest,
            _ => 1.0,
        };
        Some((u.speed * share, turn * share, share < 1.0))
    }
}

fn towards(now: f64, wanted: f64, most: f64) -> f64 {
    now + (wanted - now).clamp(-most, most)
}

/// Ackermann steering and wheel rates of a rover on any number of wheels, on the spot or on a circle; steers before it drives.
#[model("control.ackermann")]
impl SizedModel for Ackermann {
    type Params = AckermannParams;

    fn ports(p: &AckermannParams) -> SizedPorts {
        let mut outputs = Vec::new();
        for (k, wheel) in p.wheels.iter().enumerate() {
            let drive = format!("wheels[{k}].drive");
            outputs.extend(PortSpec::group::<Drive>(drive, "Drive of the wheel"));
            if wheel.steered {
                let steer = format!("wheels[{k}].steer");
                let doc = "Steering angle, to the left.";
                let port = PortSpec::named(steer, PortKind::Numbers, 1).unit_of("rad").doc_of(doc);
                outputs.push(port);
            }
        }
        let each = |name: &'static str, unit: &'static str, doc: &'static str| {
            PortSpec::named(name, PortKind::Numbers, p.wheels.len()).unit_of(unit).doc_of(doc)
        };
        let doc = "The commanded motion exceeded `rate_max` of the drives and was scaled down.";
        let limited = PortSpec::named("limited", PortKind::Bool, 1).doc_of(doc);
        outputs.push(limited.clone());
        let torque = |k: usize| {
            let doc = "Torque at the wheel, positive where it drives forward; for `droop`.";
            let port = PortSpec::named(format!("wheels[{k}].torque"), PortKind::Numbers, 1);
            PortSpec { default: Some(vec![0.0]), ..port.unit_of("N m").doc_of(doc) }
        };
        let mut inputs = AckermannIn::specs();
        inputs.extend((0..p.wheels.len()).map(torque));
        SizedPorts {
            inputs,
            outputs,
            discrete: vec![
                each("steer", "rad", "Steering commands."),
                each("rate", "rad/s", "Wheel rate commands."),
                limited,
                each("shared", "rad/s", "Rate corrections by torque sharing."),
            ],
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let torque = unwired(wired, "torque", "the wheels turn at exact rates");
        vec![(Judge::Param("droop"), torque)]
    }
    fn build(p: AckermannParams) -> Result<Self, BuildError> {
        let layout = Layout::new(&p.wheels, p.radius)?;
        Ok(Ackermann { p, layout })
    }

    fn outputs(&self, d: &[f64], y: &mut [f64]) {
        let (steer, rest) = d.split_at(self.layout.count());
        let (rate, rest) = rest.split_at(self.layout.count());
        let (limited, shared) = rest.split_at(1);
        let brake = rate.iter().all(|r| *r == 0.0);
        let mut out = y;
        for (k, wheel) in self.layout.wheels().iter().enumerate() {
            let (drive, rest) = out.split_at_mut(Drive::N);
            Drive { rate: rate[k] + shared[k], brake }.put(drive);
            out = rest;
            if wheel.steered {
                out[0] = steer[k];
                out = &mut out[1..];
            }
        }
        out.copy_from_slice(limited);
    }

    fn update(&self, clock: &Clock, d: &mut [f64], u: &[f64]) {
        let p = &self.p;
        let wanted = self.wanted(&AckermannIn::get(u));
        let (steer, rest) = d.split_at_mut(self.layout.count());
        let (rate, rest) = rest.split_at_mut(self.layout.count());
        let (limited, shared) = rest.split_at_mut(1);
        limited[0] = f64::from(u8::from(wanted.is_some_and(|(_, _, cut)| cut)));
        let mut error = 0.0_f64;
        if let Some((speed, turn, _)) = wanted {
            for (i, steer) in steer.iter_mut().enumerate() {
                let [angle, _] = self.layout.command(i, speed, turn);
                let angle = angle.clamp(-p.steer_max, p.steer_max);
                *steer = towards(*steer, angle, p.steer_rate * clock.dt);
                error = error.max((angle - *steer).abs());
            }
        }
        let ready = (1.0 - error / p.alignment).clamp(0.0, 1.0);
        let missing = |i: usize, rate: f64| {
            let wanted =
                wanted.map_or(0.0, |(speed, turn, _)| self.layout.command(i, speed, turn)[1]);
            ready * wanted - rate
        };
        let change = p.acceleration * clock.dt / p.radius;
        // All wheel speeds change in proportion, so that the wheels never work against each other.
        let needed =
            |(i, r): (usize, &f64)| missing(i, *r).abs() * (self.layout.radius(i) / p.radius);
        let needed = rate.iter().enumerate().map(needed).fold(0.0_f64, f64::max);
        let share = if needed > change { change / needed } else { 1.0 };
        for (i, rate) in rate.iter_mut().enumerate() {
            *rate += share * missing(i, *rate);
        }
        // Torque sharing is off while the rover is at rest.
        let torque = &u[AckermannIn::N..];
        let mean = torque.iter().sum::<f64>() / torque.len() as f64;
        let most = SHARED_MAX * rate.iter().map(|r| r.abs()).fold(0.0, f64::max);
        for (shared, torque) in shared.iter_mut().zip(torque) {
            let now =
                *shared + (clock.dt / SHARED_OVER).min(1.0) * (p.droop * (mean - torque) - *shared);
            *shared = now.clamp(-most, most);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tests::curiosity;

    fn params() -> AckermannParams {
        AckermannParams {
            wheels: curiosity(),
            radius: 0.25,
            steer_max: 1.5,
            steer_rate: 0.5,
            acceleration: 0.1,
            alignment: 0.3,
            rate_max: Some(1.5),
            droop: 0.0,
        }
    }

    /// Steering angles and rates of the six wheels, the limit flag, and the rate corrections.
    type Commands = [f64; 19];

    fn run(speed: f64, turn_rate: f64, mut d: Commands, steps: u64) -> Commands {
        let model = Ackermann::build(params()).unwrap();
        for n in 0..steps {
            let c = Clock::at(0.02 * n as f64, 0.02, n);
            model.update(&c, &mut d, &[speed, turn_rate, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        }
        d
    }

    #[test]
    fn settles_on_the_geometry_of_the_circle() {
        let d = run(0.04, 0.04 / 3.0, [0.0; 19], 500);
        assert!((d[0].to_degrees() - 31.436).abs() < 1e-3, "{d:?}");
        assert!((d[6 + 1] * 0.25 / 0.04 - 1.4107).abs() < 1e-4);
    }

    #[test]
    fn wheels_wait_for_the_steering() {
        let d = run(0.0, 0.05, [0.0; 19], 20);
        assert!(d[6..12].iter().all(|r| *r == 0.0) && d[1] > 0.1, "{d:?}");
        assert!(run(0.0, 0.05, d, 500)[6 + 1] > 0.1);
    }

    #[test]
    fn the_brakes_are_on_while_no_wheel_is_to_turn() {
        // Find outputs by name, such as the brake command of the third wheel, which does not steer.
        let ports = Ackermann::ports(&params()).outputs;
        let at = |name: &str| ports.iter().position(|p| p.name == name).unwrap();
        assert_eq!((ports.len(), at("wheels[1].steer")), (17, 5));
        assert!(ports.iter().all(|p| p.name != "wheels[2].steer"));
        let outputs = |d: &Commands| {
            let mut y = [f64::NAN; 17];
            let model = Ackermann::build(params()).unwrap();
            model.outputs(d, &mut y);
            y
        };
        let stands = |d: &Commands| outputs(d)[at("wheels[2].drive.brake")] == 1.0;
        assert!(stands(&[0.0; 19]));
        // The rover first steers at rest and then drives. The brakes act again after it has slowed
        // down.
        let d = run(0.0, 0.05, [0.0; 19], 20);
        assert!(stands(&d));
        let d = run(0.0, 0.05, d, 500);
        assert!(!stands(&d));
        let y = outputs(&d);
        assert_eq!((y[at("wheels[5].steer")], y[at("wheels[5].drive.rate")]), (d[5], d[11]));
        assert!(!stands(&run(0.0, 0.0, d, 1)) && stands(&run(0.0, 0.0, d, 200)));
    }

    #[test]
    fn stopping_keeps_the_steering_and_slows_at_the_limit() {
        let d = run(0.1, 0.02, [0.0; 19], 1000);
        let stop = run(0.0, 0.0, d, 10);
        assert_eq!(stop[..6], d[..6]);
        let fastest = |d: &Commands| d[6..12].iter().fold(0.0_f64, |a, r| a.max(r.abs())) * 0.25;
        assert!((fastest(&d) - fastest(&stop) - 0.1 * 0.2).abs() < 1e-9);
        assert!(fastest(&run(0.0, 0.0, d, 200)) < 1e-12);
    }

    #[test]
    fn a_wheel_gives_way_to_its_load_within_a_share_and_not_at_rest() {
        let model = Ackermann::build(AckermannParams { droop: 2e-3, ..params() }).unwrap();
        let loads = [30.0, -10.0, 5.0, 5.0, 0.0, 0.0];
        let outputs = |d: &Commands| {
            let mut y = [f64::NAN; 17];
            model.outputs(d, &mut y);
            y
        };
        let drive = |d: Commands, speed: f64, loads: [f64; 6]| {
            let mut d = d;
            for n in 0..400 {
                let u: Vec<f64> = [speed, 0.0].into_iter().chain(loads).collect();
                model.update(&Clock::at(0.02 * n as f64, 0.02, n), &mut d, &u);
            }
            d
        };
        let d = drive([0.0; 19], 0.25, loads);
        // The outputs are rate and brake of each wheel, and the angle of the first two wheels,
        // which steer.
        let y = outputs(&d);
        assert!((y[0] - (1.0 - 2e-3 * 25.0)).abs() < 1e-9, "{y:?}");
        assert!((y[3] - (1.0 + 2e-3 * 15.0)).abs() < 1e-9, "{y:?}");
        let sum: f64 = d[13..].iter().sum();
        assert!(sum.abs() < 1e-9 && d[6] == 1.0, "{d:?}");
        // The sharing is limited, however large the load of a wheel is. It is the same for driving
        // backwards.
        assert!((drive(d, 0.25, loads.map(|l| 100.0 * l))[13] + 0.15).abs() < 1e-12);
        let back = drive([0.0; 19], -0.25, loads);
        assert!((back[13] - d[13]).abs() < 1e-12);
        let stands = drive(d, 0.0, loads);
        assert!(stands[13..].iter().all(|s| *s == 0.0) && outputs(&stands)[1] == 1.0);
    }

    #[test]
    fn what_the_drives_do_not_reach_is_cut_on_the_same_circle_and_told() {
        let (speed, turn) = (0.6, 0.1);
        let l = Layout::new(&curiosity(), 0.25).unwrap();
        let d = run(speed, turn, [0.0; 19], 1000);
        let fastest = d[6..12].iter().fold(0.0_f64, |a, r| a.max(r.abs()));
        assert!((fastest - 1.5).abs() < 1e-12 && d[12] == 1.0, "{d:?}");
        let wanted = |i: usize| l.command(i, speed, turn);
        let of_all = (0..6).map(|i| wanted(i)[1]).fold(0.0_f64, f64::max);
        for i in 0..6 {
            let [steer, rate] = wanted(i);
            assert!((d[i] - steer).abs() < 1e-12 && (d[6 + i] / 1.5 - rate / of_all).abs() < 1e-12);
        }
        assert_eq!(run(0.2, turn, d, 1)[12], 0.0);
    }
}
