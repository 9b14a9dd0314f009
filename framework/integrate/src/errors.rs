//! What is refused: settings at the door, and steps that cannot be taken.

/// Settings that cannot work; all bad lanes are named at once.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Setup {
    /// Absolute tolerances are above zero (infinity: a lane that does not count).
    #[error(
        "absolute tolerance of lanes {lanes:?}: must be above zero; infinity leaves a lane out"
    )]
    Absolute {
        /// The lanes.
        lanes: Vec<usize>,
    },
    /// Relative tolerances are at least zero and finite.
    #[error("relative tolerance of lanes {lanes:?}: must be at least zero and finite")]
    Relative {
        /// The lanes.
        lanes: Vec<usize>,
    },
    /// One absolute and one relative tolerance for each lane.
    #[error("{abs} absolute and {rel} relative tolerances: give one of each for every lane")]
    Lengths {
        /// Number of absolute tolerances.
        abs: usize,
        /// Number of relative ones.
        rel: usize,
    },
    /// The method has no error estimate.
    #[error(
        "`{method}` has no error estimate: step it at a fixed size, or choose one of {choices}"
    )]
    NoErrorEstimate {
        /// Name of the method.
        method: &'static str,
        /// Names of methods with one.
        choices: String,
    },
    /// Bounds of the step size in s: 0 ≤ least ≤ largest, first ≥ 0.
    #[error("steps from {min} s to {max} s: need 0 <= least <= largest, and no NaN")]
    Steps {
        /// Least step, s.
        min: f64,
        /// Largest step, s.
        max: f64,
    },
}

/// A step that could not be taken. The state that the caller handed in is untouched, bit for bit.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Failure<E> {
    /// The system refused.
    #[error("{0}")]
    System(E),
    /// State or derivative is not finite at the start of the step: no step size helps.
    #[error("at t = {t} s: lane {lane} or its derivative is not finite before the step")]
    Start {
        /// Time, s.
        t: f64,
        /// First such lane.
        lane: usize,
    },
    /// Dense output was asked for, and there is no accepted step.
    #[error("dense output: no step was accepted since the integrator was made or last failed")]
    NoStep,
    /// A stage or the end of a step of fixed size is not finite.
    #[error("at t = {t} s: a step of {h} s makes lane {lane} infinite or NaN; step less")]
    NotFinite {
        /// Time at the start, s.
        t: f64,
        /// Step, s.
        h: f64,
        /// First such lane.
        lane: usize,
    },
    /// The error asks for less than the least step.
    #[error(
        "at t = {t} s: lane {lane} has {error} times its tolerance in a step of {h} s, \
         and the least step is {least} s; loosen the lane's tolerance, or use a stiff method"
    )]
    StepTooSmall {
        /// Time at the start, s.
        t: f64,
        /// The step that was rejected, s.
        h: f64,
        /// Least step, s.
        least: f64,
        /// Lane with the largest error.
        lane: usize,
        /// Its error over its tolerance; NaN where the lane was not finite.
        error: f64,
    },
    /// Too many rejections in a row.
    #[error(
        "at t = {t} s: {rejections} steps rejected in a row, the last of {h} s for lane {lane}"
    )]
    Rejections {
        /// Time at the start, s.
        t: f64,
        /// The last step tried, s.
        h: f64,
        /// Lane with the largest error.
        lane: usize,
        /// How many.
        rejections: u32,
    },
}
