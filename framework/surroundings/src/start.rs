//! Start of a free body whose position is not written in the axes of W: on an orbit, in named axes, or over the ground.
use linkwork_runtime::Origin;
use linkwork_spatial::Vec3;

/// Axes in which a position and a velocity are written, origin at the centre of the world's body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StartFrame {
    /// Inertial axes in which the body of the world rotates.
    Inertial,
    /// Axes of the ICRF (GCRS at the Earth); with `turns: iau` they coincide with the inertial axes of the world.
    Icrf,
    /// Mean equator and equinox of J2000 (EME2000): a constant rotation of 23 mas from the ICRF.
    Eme2000,
    /// Inertial axes that coincide with the axes of the body at t = 0: z is its pole, x points to its prime meridian.
    Equator,
    /// Axes that rotate with the body, at their attitude at t = 0; velocities are relative to these rotating axes.
    Fixed,
    /// Earth-fixed axes with `turns: iau`.
    Itrf,
    /// True equator and mean equinox of date: the axes of two-line elements of Earth satellites.
    Teme,
}

/// Position of a body on its orbit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anomaly {
    /// True anomaly, rad.
    True(f64),
    /// Mean anomaly, rad.
    Mean(f64),
}

/// Position and velocity at the start, which the world transforms to W.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// Osculating elements about the body of the world.
    Elements {
        /// The axes, which do not rotate. `None`: the inertial axes, for bodies whose pole is within 1° of z.
        frame: Option<StartFrame>,
        /// a (m); below zero for a hyperbola.
        semi_major_axis: f64,
        /// e.
        eccentricity: f64,
        /// i, rad.
        inclination: f64,
        /// Ω, rad.
        ascending_node: f64,
        /// ω, rad.
        pericentre: f64,
        /// Place on the orbit.
        anomaly: Anomaly,
    },
    /// A position (m) and a velocity (m/s) in named axes.
    State {
        /// The axes.
        frame: StartFrame,
        /// Position relative to the centre of the body.
        position: Vec3,
        /// Velocity.
        velocity: Vec3,
    },
    /// A place over the ellipsoid.
    Geodetic {
        /// Geodetic latitude, rad.
        latitude: f64,
        /// East longitude, rad.
        longitude: f64,
        /// Height over the ellipsoid, m.
        height: f64,
        /// Velocity over the ground (m/s): east, north, up.
        velocity: Vec3,
    },
    /// State of an Earth satellite at the epoch of the world, from SGP4.
    TwoLine {
        /// The lines themselves, or the file that contains them.
        from: TwoLineSource,
        /// Name or number of one of several satellites.
        satellite: Option<String>,
    },
    /// State of a spacecraft by an orbit ephemeris message (CCSDS OEM) at the epoch of the world.
    Ephemeris {
        /// The file.
        file: String,
        /// `OBJECT_NAME` of one of several spacecraft.
        object: Option<String>,
    },
}

/// Source of two-line elements.
#[derive(Clone, Debug, PartialEq)]
pub enum TwoLineSource {
    /// A file.
    File(String),
    /// The lines.
    Lines(Vec<String>),
}

/// A body that starts so.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyStart {
    /// Its name in the mechanism.
    pub body: String,
    /// Start of the body.
    pub start: Start,
    /// Position of the start in the file.
    pub origin: Origin,
}
