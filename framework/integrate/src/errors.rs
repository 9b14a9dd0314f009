//! Errors: invalid settings, and steps that failed.

/// Invalid settings. Every invalid lane is listed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Setup {
    /// Absolute tolerances must be above zero. Infinity excludes a lane from the error norm.
    #[error(
        "absolute tolerance of lanes {lanes:?}: must be above zero; infinity leaves a lane out"
    )]
    Absolute {
        /// Numbers of the lanes.
        lanes: Vec<usize>,
    },
    /// Relative tolerances must be at least zero and finite.
    #[error("relative tolerance of lanes {lanes:?}: must be at least zero and finite")]
    Relative {
        /// Numbers of the lanes.
        lanes: Vec<usize>,
    },
    /// The numbers of absolute and relative tolerances differ.
    #[error("{abs} absolute and {rel} relative tolerances: give one of each for every lane")]
    Lengths {
        /// Number of absolute tolerances.
        abs: usize,
        /// Number of relative tolerances.
        rel: usize,
    },
    /// The method lacks an error estimate.
    #[error(
        "`{method}` does not have an error estimate: use a fixed step size, or choose one of {choices}"
    )]
    NoErrorEstimate {
        /// Name of the method.
        method: &'static str,
        /// Names of methods with an error estimate.
        choices: String,
    },
    /// The bounds of the step size must satisfy 0 ≤ min ≤ max, in s.
    #[error("steps from {min} s to {max} s: they must satisfy 0 <= least <= largest, without NaN")]
    Steps {
        /// Smallest step, s.
        min: f64,
        /// Largest step, s.
        max: f64,
    },
}

/// A step failed. The caller's state is bit-identical with its value before.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Failure<E> {
    /// The system returned an error.
    #[error("{0}")]
    System(E),
    /// State or derivative is not finite at the start of the step, so a smaller step size does not help.
    #[error("at t = {t} s: lane {lane} or its derivative is not finite before the step")]
    Start {
        /// Time, s.
        t: f64,
        /// First such lane.
        lane: usize,
    },
    /// Dense output was requested, but there is no accepted step.
    #[error("dense output: no step was accepted since the integrator was created or last failed")]
    NoStep,
    /// A stage or the end of a fixed-size step is not finite.
    #[error("at t = {t} s: a step of {h} s makes lane {lane} infinite or NaN; use a smaller step")]
    NotFinite {
        /// Time at the start, s.
        t: f64,
        /// Step, s.
        h: f64,
        /// First such lane.
        lane: usize,
    },
    /// The error requires a step below the minimum.
    #[error(
        "at t = {t} s: the error of lane {lane} is {error} times its tolerance in a step of {h} s, and the smallest \
        step is {least} s; loosen the lane's tolerance, or use a stiff method"
    )]
    StepTooSmall {
        /// Time at the start, s.
        t: f64,
        /// The rejected step, s.
        h: f64,
        /// Smallest step, s.
        least: f64,
        /// Lane with the largest error.
        lane: usize,
        /// Its error divided by its tolerance; NaN if the lane was not finite.
        error: f64,
    },
    /// Too many consecutive rejections.
    #[error(
        "at t = {t} s: {rejections} steps rejected in a row, the last of {h} s for lane {lane}"
    )]
    Rejections {
        /// Time at the start, s.
        t: f64,
        /// The last attempted step, s.
        h: f64,
        /// Lane with the largest error.
        lane: usize,
        /// Number of rejections.
        rejections: u32,
    },
}
