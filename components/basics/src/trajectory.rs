//! Prescribed motion of a hinge: a profile of position, rate or acceleration over time.
//! ```text
//! β̇ = q̈_p + 2 ω (q̇_p − q̇) + ω² (q_p − q)          ω: natural frequency, critically damped
//! ```
//! The hinge is prescribed: its acceleration is an input of the dynamics and is integrated. The feedback removes initial errors and integration
//! errors as e^(−ω t) (1 + ω t). Without it (ω = 0) the integration error remains and grows at most linearly with time. Every row of the profile is
//! an event, so that no integrator step crosses a jump of q̈ or of its derivative, and the integrator keeps its order.

use crate::profile::{Between, Motion, Profile};
use crate::rows::Rows;
use linkwork_runtime::prelude::*;

/// Quantity of the rows of a profile.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gives {
    /// Positions.
    Position,
    /// Rates.
    Rate,
    /// Accelerations.
    Acceleration,
}

/// Interpolation between the rows of a profile.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Default for the quantity: positions smooth, rates and accelerations linear.
    Usual,
    /// Continuous up to the acceleration.
    Smooth,
    /// At rest at every row.
    Stops,
    /// Linear between rows.
    Straight,
    /// Constant from each row to the next.
    Hold,
}

/// Current piece of the profile.
#[derive(State, Clone, Copy, Debug)]
pub struct ProfileState {
    /// Number of passed rows.
    #[port("1")]
    pub passed: f64,
}

/// The next row.
#[derive(Ports, Clone, Copy, Debug)]
pub struct NextRow {
    /// Time since the next row.
    #[port("s", rising)]
    pub since_row: f64,
}

/// Creates a profile from its parameters, or returns an error.
fn profile(
    rows: &Rows,
    (gives, way): (Gives, Interpolation),
    (start, start_rate): (Option<f64>, Option<f64>),
    units: [&str; 3],
) -> Result<Profile, BuildError> {
    rows.check().map_err(|e| e.at("profile"))?;
    rows.check_unit(units[gives as usize]).map_err(|e| e.at("profile"))?;
    let useless = |name: &str, what: &str| {
        BuildError::new(format!("{what} already determine `{name}`"))
            .help(format!("remove `{name}`"))
            .at(name)
    };
    if gives == Gives::Position && start.is_some() {
        return Err(useless("start", "positions"));
    }
    if gives != Gives::Acceleration && start_rate.is_some() {
        return Err(useless("start_rate", "positions and rates"));
    }
    let (start, start_rate) = (start.unwrap_or(0.0), start_rate.unwrap_or(0.0));
    let impossible = |words: &str| {
        let fact =
            format!("a profile of {gives:?}s does not support this interpolation between rows")
                .to_lowercase();
        Err(BuildError::new(fact).help(format!("write one of: {words}")).at("between"))
    };
    match (gives, way) {
        (Gives::Position, Interpolation::Usual | Interpolation::Smooth) => {
            Ok(Profile::of_positions(&rows.rows, Between::Smooth))
        }
        (Gives::Position, Interpolation::Stops) => {
            Ok(Profile::of_positions(&rows.rows, Between::Stops))
        }
        (Gives::Position, _) => impossible("smooth, stops"),
        (Gives::Rate, Interpolation::Usual | Interpolation::Straight) => {
            Ok(Profile::of_rates(&rows.rows, Between::Straight, start))
        }
        (Gives::Rate, Interpolation::Smooth) => {
            Ok(Profile::of_rates(&rows.rows, Between::Smooth, start))
        }
        (Gives::Rate, _) => impossible("straight, smooth"),
        (Gives::Acceleration, Interpolation::Usual | Interpolation::Straight) => {
            Ok(Profile::of_accelerations(&rows.rows, Between::Straight, (start, start_rate)))
        }
        (Gives::Acceleration, Interpolation::Hold) => {
            Ok(Profile::of_accelerations(&rows.rows, Between::Hold, (start, start_rate)))
        }
        (Gives::Acceleration, _) => impossible("straight, hold"),
    }
}

/// Common part of both models.
struct Follower {
    profile: Profile,
    omega: f64,
}

impl Follower {
    /// Returns the piece of the state; `None` if the part joined the run after that piece ended.
    fn held(&self, c: &Clock, d: &ProfileState) -> Option<usize> {
        let k = d.passed as usize;
        let (begin, end) = self.profile.ends(k);
        (c.t >= begin - c.dt && c.t <= end + c.dt).then_some(k)
    }

    fn piece(&self, c: &Clock, d: &ProfileState) -> usize {
        self.held(c, d).unwrap_or_else(|| self.profile.piece(c.t))
    }

    fn motion(&self, c: &Clock, d: &ProfileState) -> Motion {
        self.profile.at(self.piece(c, d), c.t)
    }

    fn acceleration(&self, m: &Motion, hinge: &HingeState) -> f64 {
        let w = self.omega;
        m.acceleration + 2.0 * w * (m.rate - hinge.rate) + w * w * (m.position - hinge.angle)
    }

    fn next_row(&self, c: &Clock, d: &ProfileState) -> NextRow {
        let k = self.piece(c, d);
        let end = self.profile.ends(k).1;
        let rest = if end.is_finite() { end - c.t } else { 1.0 };
        // A part that joins a run after the end of its piece switches to the current piece at once.
        NextRow { since_row: if self.held(c, d).is_none() { 1.0 } else { -rest } }
    }

    fn passed(&self, c: &Clock, d: &ProfileState) -> ProfileState {
        let k = self.piece(c, d);
        let end = self.profile.ends(k).1;
        // The event is located within 1 ps of the row, before or after it.
        ProfileState { passed: (if c.t > end - 1e-9 { k + 1 } else { k }) as f64 }
    }

    /// Returns a warning if the hinge does not start on the profile.
    fn remark(
        &self,
        c: &Clock,
        d: &ProfileState,
        hinge: &HingeState,
        (unit, field): (&str, &str),
    ) -> Vec<BuildError> {
        let m = self.motion(c, d);
        let (dq, dv) = (hinge.angle - m.position, hinge.rate - m.rate);
        let scale = |a: f64, b: f64| 1e-9 * (1.0 + a.abs().max(b.abs()));
        if dq.abs() <= scale(hinge.angle, m.position) && dv.abs() <= scale(hinge.rate, m.rate) {
            return Vec::new();
        }
        let then = match self.omega > 0.0 {
            true => "the feedback removes the difference with the natural frequency",
            false => "the difference remains",
        };
        let fact = format!(
            "the hinge starts at {:.6} {unit} and {:.6} {unit}/s, the profile at {:.6} and {:.6}: {then}",
            hinge.angle, hinge.rate, m.position, m.rate
        );
        let help = format!(
            "write `initial: ({field}: {:?}, rate: {:?})` in the body of the hinge",
            m.position, m.rate
        );
        vec![BuildError::new(fact).help(help)]
    }
}

macro_rules! trajectory {
    (
        $(#[$doc:meta])* $model:ident, $params:ident, $in:ident, $out:ident, $name:tt, $field:tt,
        $u0:tt, $u1:tt, $u2:tt
    ) => {
        /// Parameters of a profile and its feedback.
        #[derive(Params, Clone, Debug)]
        pub struct $params {
            /// Rows (time, value), or a column of a CSV file.
            pub profile: Rows,
            /// Quantity of the rows.
            #[param(default = Gives::Position)]
            pub gives: Gives,
            /// Interpolation between rows. Positions: smooth or stops; rates: straight or smooth; accelerations: straight or hold.
            #[param(default = Interpolation::Usual)]
            pub between: Interpolation,
            /// Position at the first row, for rates and accelerations. Default: 0.
            #[param(unit = $u0)]
            pub start: Option<f64>,
            /// Rate at the first row, for accelerations. Default: 0.
            #[param(unit = $u1)]
            pub start_rate: Option<f64>,
            /// Natural frequency of the feedback that removes errors; 0: no feedback. Explicit methods need step · frequency below 2.
            #[param(unit = "rad/s", default = 10.0, range = 0.0..)]
            pub natural_frequency: f64,
        }

        /// The hinge.
        #[derive(Ports, Clone, Copy, Debug)]
        pub struct $in {
            /// The prescribed hinge.
            #[port($u0, bind = "hinge")]
            pub hinge: HingeState,
        }

        /// Motion of the profile.
        #[derive(Ports, Clone, Copy, Debug)]
        pub struct $out {
            /// Acceleration of the hinge.
            #[port($u2, bind = "hinge")]
            pub prescribed: HingeAccel,
            /// Position of the profile.
            #[port($u0)]
            pub position: f64,
            /// Rate of the profile.
            #[port($u1)]
            pub rate: f64,
            /// Acceleration of the profile.
            #[port($u2)]
            pub acceleration: f64,
            /// Position error: hinge minus profile.
            #[port($u0)]
            pub error: f64,
        }

        $(#[$doc])*
        pub struct $model {
            follower: Follower,
        }

        $(#[$doc])*
        #[model($name)]
        impl Model for $model {
            type Params = $params;
            type FeedthroughInputs = $in;
            type FeedthroughOutputs = $out;
            type DiscreteState = ProfileState;
            type Guards = NextRow;
            fn build(p: $params) -> Result<Self, BuildError> {
                let starts = (p.start, p.start_rate);
                let profile = profile(&p.profile, (p.gives, p.between), starts, [$u0, $u1, $u2])?;
                Ok($model { follower: Follower { profile, omega: p.natural_frequency } })
            }
            fn init_d(&self) -> ProfileState {
                ProfileState { passed: self.follower.profile.piece(0.0) as f64 }
            }
            fn feedthrough(&self, clock: &Clock, d: &ProfileState, u: &$in) -> $out {
                let m = self.follower.motion(clock, d);
                $out {
                    prescribed: HingeAccel(self.follower.acceleration(&m, &u.hinge)),
                    position: m.position,
                    rate: m.rate,
                    acceleration: m.acceleration,
                    error: u.hinge.angle - m.position,
                }
            }
            fn guards(&self, clock: &Clock, d: &ProfileState) -> NextRow {
                self.follower.next_row(clock, d)
            }
            fn handle_event(&self, clock: &Clock, d: &ProfileState) -> ((), ProfileState) {
                ((), self.follower.passed(clock, d))
            }
            fn startup_warnings(&self, clock: &Clock, d: &ProfileState, u: &$in) -> Vec<BuildError> {
                self.follower.remark(clock, d, &u.hinge, ($u0, $field))
            }
        }
    };
}

trajectory!(
    /// Prescribes a pin or screw: angles, rates or accelerations over time, from rows or a CSV file.
    HingeTrajectory, HingeTrajectoryParams, HingeTrajectoryIn, HingeTrajectoryOut,
    "basics.hinge_trajectory", "angle", "rad", "rad/s", "rad/s^2"
);
trajectory!(
    /// Prescribes a slider: displacements, rates or accelerations over time, from rows or a CSV file.
    SliderTrajectory, SliderTrajectoryParams, SliderTrajectoryIn, SliderTrajectoryOut,
    "basics.slider_trajectory", "position", "m", "m/s", "m/s^2"
);
