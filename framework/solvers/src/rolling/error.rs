//! Errors of rolling vehicles, at set-up and during motion.
use thiserror::Error;

/// Reason why vehicles cannot roll.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RollingError {
    /// The root of a vehicle cannot be driven.
    #[error("`{body}` has no free hinge on the world\n  help: name the root body of the machine")]
    Root {
        /// Name of the body.
        body: String,
    },
    /// A joint cannot adapt to the ground.
    #[error(
        "the hinge of `{body}` cannot adapt to the ground\n  help: each body in `joints` must have a single pin that is not prescribed"
    )]
    Joint {
        /// Name of the body.
        body: String,
    },
    /// A coordinate is undetermined.
    #[error(
        "the motion of the hinge of `{body}` is undetermined without forces\n  help: prescribe its motion, lock it, or list it in `joints`, where it adapts to the ground"
    )]
    Undetermined {
        /// The body.
        body: String,
    },
    /// More coordinates than wheels.
    #[error(
        "{wheels} wheels and {couplings} couplings do not determine the attitude of `{root}` on the ground: {needed} are needed\n  help: list fewer `joints`, or couple them (as a differential does)"
    )]
    Few {
        /// The vehicle.
        root: String,
        /// Number of wheels.
        wheels: usize,
        /// Number of couplings of its joints.
        couplings: usize,
        /// Number of coordinates that adapt.
        needed: usize,
    },
    /// Something that rolling does not support.
    #[error("rolling without forces does not support {what}\n  help: {help}")]
    Unknown {
        /// The unsupported thing.
        what: String,
        /// Remedy.
        help: &'static str,
    },
    /// A wheel is off the map, or where the map has no data.
    #[error(
        "there is no ground under `{wheel}` at ({x:.3}, {y:.3})\n  help: stay where the terrain has data"
    )]
    NoGround {
        /// The wheel.
        wheel: String,
        /// Position x (m).
        x: f64,
        /// Position y (m).
        y: f64,
    },
    /// No pose exists in which the wheels touch the ground.
    #[error(
        "`{root}` finds no pose on the ground: a wheel stays {gap:.3} m away from it\n  help: the ground is too rough for the wheels here; drive around, or simulate with forces"
    )]
    Apart {
        /// The vehicle.
        root: String,
        /// Largest distance of a wheel (m).
        gap: f64,
    },
    /// The required traction exceeds the possible traction.
    #[error(
        "`{root}` slides at {speed:.2} m/s: the traction of its wheels is not sufficient\n  help: drive where it is less steep, or simulate with forces"
    )]
    Slides {
        /// The vehicle.
        root: String,
        /// Largest speed of a rim over the ground (m/s).
        speed: f64,
    },
}
