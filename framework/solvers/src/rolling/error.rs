//! Why vehicles cannot roll: at set-up, and on their way.
use thiserror::Error;

/// Why vehicles cannot roll.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RollingError {
    /// A root that cannot be driven.
    #[error("`{body}` has no free hinge on the world\n  help: name the root body of the machine")]
    Root {
        /// Its name.
        body: String,
    },
    /// A joint that cannot adapt.
    #[error(
        "the hinge of `{body}` cannot adapt to the ground\n  help: `joints` are bodies on one pin each that no motion prescribes"
    )]
    Joint {
        /// Its name.
        body: String,
    },
    /// A coordinate that nothing determines.
    #[error(
        "nothing says how the hinge of `{body}` moves without forces\n  help: prescribe its motion, lock it, or list it in `joints`, where it adapts to the ground"
    )]
    Undetermined {
        /// The body.
        body: String,
    },
    /// More coordinates than wheels.
    #[error(
        "{wheels} wheels and {couplings} couplings do not determine how `{root}` lies on the ground: that takes {needed}\n  help: list fewer `joints`, or couple them (as a differential does)"
    )]
    Few {
        /// The vehicle.
        root: String,
        /// Its wheels.
        wheels: usize,
        /// Couplings of its joints.
        couplings: usize,
        /// Coordinates that adapt.
        needed: usize,
    },
    /// What rolling knows nothing of.
    #[error("rolling without forces knows no {what}\n  help: {help}")]
    Unknown {
        /// What it is.
        what: String,
        /// What to do instead.
        help: &'static str,
    },
    /// Off the map, or where it has no data.
    #[error(
        "there is no ground under `{wheel}` at ({x:.3}, {y:.3})\n  help: stay where the terrain has data"
    )]
    NoGround {
        /// The wheel.
        wheel: String,
        /// Where (m).
        x: f64,
        /// Where (m).
        y: f64,
    },
    /// No pose in which the wheels touch.
    #[error(
        "`{root}` does not come to lie on the ground: a wheel stays {gap:.3} m from it\n  help: the ground is too rough for the wheels here; drive around, or simulate with forces"
    )]
    Apart {
        /// The vehicle.
        root: String,
        /// Greatest distance of a wheel (m).
        gap: f64,
    },
    /// More is asked of the ground than it gives.
    #[error(
        "`{root}` slides at {speed:.2} m/s: its wheels do not get from the ground what holds it\n  help: drive where it is less steep, or simulate with forces"
    )]
    Slides {
        /// The vehicle.
        root: String,
        /// Greatest speed of a rim over the ground (m/s).
        speed: f64,
    },
}
