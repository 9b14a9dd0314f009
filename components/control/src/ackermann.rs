//! `control.ackermann`: from a speed and a turn rate to steering angles and wheel rates of a six-wheeled rover.
//!
//! Steer, then drive: steering commands move at a limited rate, and wheels turn in proportion to how close they
//! are to their wanted angles. Speed changes at a limited acceleration (a trapezoid). Curvature is cut to
//! what the steering limit allows, except on the spot (speed zero). While no wheel is to turn, the brakes are on.

use crate::geometry::{Command, Layout, WHEELS};
use linkwork_runtime::prelude::*;

/// Wheels and limits.
#[derive(Params, Clone, Debug)]
pub struct AckermannParams {
    /// x (forward) and y (left) of the wheels LF, RF, LM, RM, LR, RR, m.
    pub wheels: [[f64; 2]; 6],
    /// Wheel radius.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// Greatest steering angle.
    #[param(unit = "rad", default = 1.5, range = 0.01..=1.57)]
    pub steer_max: f64,
    /// Rate at which steering commands move.
    #[param(unit = "rad/s", default = 0.5, range = 1e-3..)]
    pub steer_rate: f64,
    /// Acceleration of the wheel speeds.
    #[param(unit = "m/s^2", default = 0.1, range = 1e-4..)]
    pub acceleration: f64,
    /// Steering error at which the wheels stand still.
    #[param(unit = "rad", default = 0.3, range = 1e-3..)]
    pub alignment: f64,
}

/// Wanted motion.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AckermannIn {
    /// Forward speed.
    #[port("m/s", default = 0.0)]
    pub speed: f64,
    /// Turn rate, to the left.
    #[port("rad/s", default = 0.0)]
    pub turn_rate: f64,
}

/// Steering angles and wheel rates.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AckermannOut {
    /// Steering, left front.
    #[port("rad")]
    pub steer_lf: f64,
    /// Steering, right front.
    #[port("rad")]
    pub steer_rf: f64,
    /// Steering, left rear.
    #[port("rad")]
    pub steer_lr: f64,
    /// Steering, right rear.
    #[port("rad")]
    pub steer_rr: f64,
    /// Wheel rate, left front.
    #[port("rad/s")]
    pub rate_lf: f64,
    /// Wheel rate, right front.
    #[port("rad/s")]
    pub rate_rf: f64,
    /// Wheel rate, left middle.
    #[port("rad/s")]
    pub rate_lm: f64,
    /// Wheel rate, right middle.
    #[port("rad/s")]
    pub rate_rm: f64,
    /// Wheel rate, left rear.
    #[port("rad/s")]
    pub rate_lr: f64,
    /// Wheel rate, right rear.
    #[port("rad/s")]
    pub rate_rr: f64,
    /// All wheels are to stand: for the brakes.
    #[port("1")]
    pub stand: bool,
}

/// Commands as they stand.
#[derive(State, Clone, Copy, Debug)]
pub struct AckermannState {
    /// Steering commands.
    #[port("rad")]
    pub steer: [f64; 6],
    /// Wheel rate commands.
    #[port("rad/s")]
    pub rate: [f64; 6],
}

/// Six-wheel steering.
pub struct Ackermann {
    p: AckermannParams,
}

impl Ackermann {
    fn layout(&self) -> Layout {
        Layout { wheels: self.p.wheels, radius: self.p.radius }
    }

    /// What is wanted, with the curvature that the steering limit allows.
    fn wanted(&self, u: &AckermannIn) -> Option<Command> {
        let layout = self.layout();
        let turn = if u.speed == 0.0 {
            u.turn_rate
        } else {
            let most = u.speed.abs() / layout.radius_min(self.p.steer_max);
            u.turn_rate.clamp(-most, most)
        };
        layout.command(u.speed, turn)
    }
}

fn towards(now: f64, wanted: f64, most: f64) -> f64 {
    now + (wanted - now).clamp(-most, most)
}

/// Ackermann steering and wheel rates of a six-wheeled rover, on the spot or on a circle; steers before it drives.
#[model("control.ackermann")]
impl Model for Ackermann {
    type Params = AckermannParams;
    type U = AckermannIn;
    type Ym = AckermannOut;
    type D = AckermannState;
    fn moore(&self, _: &Clock, _: &(), d: &AckermannState) -> AckermannOut {
        AckermannOut {
            steer_lf: d.steer[0],
            steer_rf: d.steer[1],
            steer_lr: d.steer[4],
            steer_rr: d.steer[5],
            rate_lf: d.rate[0],
            rate_rf: d.rate[1],
            rate_lm: d.rate[2],
            rate_rm: d.rate[3],
            rate_lr: d.rate[4],
            rate_rr: d.rate[5],
            stand: d.rate == [0.0; WHEELS],
        }
    }
    fn update(&self, c: &Clock, _: &(), d: &AckermannState, u: &AckermannIn) -> AckermannState {
        let p = &self.p;
        let wanted = self.wanted(u).unwrap_or(Command { steer: d.steer, rate: [0.0; WHEELS] });
        let mut out = *d;
        let mut error = 0.0_f64;
        for i in 0..WHEELS {
            let limited = wanted.steer[i].clamp(-p.steer_max, p.steer_max);
            out.steer[i] = towards(d.steer[i], limited, p.steer_rate * c.dt);
            error = error.max((limited - out.steer[i]).abs());
        }
        let ready = (1.0 - error / p.alignment).clamp(0.0, 1.0);
        let change = p.acceleration * c.dt / p.radius;
        // All wheels change in step, so that they never work against each other.
        let needed =
            (0..WHEELS).map(|i| (ready * wanted.rate[i] - d.rate[i]).abs()).fold(0.0_f64, f64::max);
        let share = if needed > change { change / needed } else { 1.0 };
        for i in 0..WHEELS {
            out.rate[i] = d.rate[i] + share * (ready * wanted.rate[i] - d.rate[i]);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tests::curiosity;

    fn model() -> Ackermann {
        Ackermann {
            p: AckermannParams {
                wheels: curiosity().wheels,
                radius: 0.25,
                steer_max: 1.5,
                steer_rate: 0.5,
                acceleration: 0.1,
                alignment: 0.3,
            },
        }
    }

    fn run(u: AckermannIn, mut d: AckermannState, steps: u64) -> AckermannState {
        for n in 0..steps {
            let c = Clock::at(0.02 * n as f64, 0.02, n);
            d = model().update(&c, &(), &d, &u, &(), &mut ());
        }
        d
    }

    #[test]
    fn settles_on_the_geometry_of_the_circle() {
        let u = AckermannIn { speed: 0.04, turn_rate: 0.04 / 3.0 };
        let d = run(u, AckermannState::zero(), 500);
        assert!((d.steer[0].to_degrees() - 31.436).abs() < 1e-3, "{d:?}");
        assert!((d.rate[1] * 0.25 / 0.04 - 1.4107).abs() < 1e-4);
    }

    #[test]
    fn wheels_wait_for_the_steering() {
        let u = AckermannIn { speed: 0.0, turn_rate: 0.05 };
        let d = run(u, AckermannState::zero(), 20);
        assert!(d.rate.iter().all(|r| *r == 0.0) && d.steer[1] > 0.1, "{d:?}");
        assert!(run(u, d, 500).rate[1] > 0.1);
    }

    #[test]
    fn the_brakes_are_on_while_no_wheel_is_to_turn() {
        let stands =
            |d: &AckermannState| model().moore(&Clock::at(0.0, 0.02, 0), &(), d, &()).stand;
        assert!(stands(&AckermannState::zero()));
        // Steering on the spot first, then driving; standing again after the last of the slowing down.
        let u = AckermannIn { speed: 0.0, turn_rate: 0.05 };
        let d = run(u, AckermannState::zero(), 20);
        assert!(stands(&d));
        let d = run(u, d, 500);
        assert!(!stands(&d));
        let stop = AckermannIn { speed: 0.0, turn_rate: 0.0 };
        assert!(!stands(&run(stop, d, 1)) && stands(&run(stop, d, 200)));
    }

    #[test]
    fn stopping_keeps_the_steering_and_slows_at_the_limit() {
        let u = AckermannIn { speed: 0.1, turn_rate: 0.02 };
        let d = run(u, AckermannState::zero(), 1000);
        let stop = run(AckermannIn { speed: 0.0, turn_rate: 0.0 }, d, 10);
        assert_eq!(stop.steer, d.steer);
        let fastest =
            |d: &AckermannState| d.rate.iter().fold(0.0_f64, |a, r| a.max(r.abs())) * 0.25;
        assert!((fastest(&d) - fastest(&stop) - 0.1 * 0.2).abs() < 1e-9);
        assert!(fastest(&run(AckermannIn { speed: 0.0, turn_rate: 0.0 }, d, 200)) < 1e-12);
    }
}
