//! Devices of a file: actuators and sensors on a mechanism. They become parts of an assembly.
//!
//! ```text
//! length   l = Σ cᵢ qᵢ, torque on joint i: cᵢ f;   or that of a line over sites, times a gear;   or a wrench on a site
//! actuator                   f = (g₀ + g₁ l + g₂ l̇) w + b₀ + b₁ l + b₂ l̇,    w = u, or ẇ = u, or ẇ = (u − w) / T
//! tendon                     f = −k (l − r) − d l̇, and soft limits
//! ```

use crate::Geometry;
use linkwork_multibody::{HingeCoordinate, Term};
use linkwork_spatial::Pose;
use serde::{Deserialize, Serialize};

/// An actuator or sensor of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Device {
    /// Its name in the file, or its kind and number.
    pub name: String,
    /// Its kind.
    pub kind: DeviceKind,
}

/// The kinds of devices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum DeviceKind {
    /// A controlled force.
    Actuator(Actuator),
    /// A passive force along a sum of coordinates.
    Tendon(Tendon),
    /// A measurement.
    Sensor(Sensor),
    /// A force that compensates a share of the weight of a body.
    GravityCompensation {
        /// The body.
        body: String,
        /// 1: full compensation.
        share: f64,
    },
}

/// The length along which an actuator or a tendon acts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Length {
    /// A weighted sum of joint coordinates.
    Joints(Vec<Term>),
    /// The length of a line through sites, multiplied by a gear.
    Line {
        /// The factor.
        gear: f64,
        /// The sites from the first to the last.
        sites: Vec<DeviceFrame>,
    },
    /// A wrench on a site, for each unit of force.
    Wrench {
        /// Force and moment, in the axes of the reference site, or of the site itself.
        gear: [f64; 6],
        /// The site.
        site: DeviceFrame,
        /// The site on which the opposite wrench acts.
        reference: Option<DeviceFrame>,
    },
}

impl Length {
    /// Returns a copy with one more gear.
    #[must_use]
    pub fn geared(self, by: f64) -> Self {
        match self {
            Self::Joints(terms) => {
                let geared = |t: Term| Term { factor: t.factor * by, ..t };
                Self::Joints(terms.into_iter().map(geared).collect())
            }
            Self::Line { gear, sites } => Self::Line { gear: gear * by, sites },
            Self::Wrench { gear, site, reference } => {
                Self::Wrench { gear: gear.map(|g| g * by), site, reference }
            }
        }
    }
}

/// Dynamics with which the activation w of an actuator follows its control u.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Activation {
    /// T of ẇ = (u − w) / T, s; `None`: ẇ = u.
    pub time_constant: Option<f64>,
    /// Bounds of w.
    pub range: Option<[f64; 2]>,
}

/// A force that is affine in control or activation, length and rate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Actuator {
    /// The length along which it acts.
    pub length: Length,
    /// g: force per unit of control.
    pub gain: [f64; 3],
    /// b: force at zero control.
    pub bias: [f64; 3],
    /// The activation; `None`: the force follows the control at once.
    pub activation: Option<Activation>,
    /// Bounds of the control.
    pub control: Option<[f64; 2]>,
    /// Bounds of the force.
    pub force: Option<[f64; 2]>,
}

/// Spring, damper and soft limits along a length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tendon {
    /// The length.
    pub length: Length,
    /// k, N/m or N m/rad.
    pub stiffness: f64,
    /// Lengths between which the spring has no force.
    pub rest: [f64; 2],
    /// d, N s/m or N m s/rad.
    pub damping: f64,
    /// Bounds of the length.
    pub range: Option<[f64; 2]>,
    /// Stiffness and damping beyond a bound.
    pub limit: [f64; 2],
}

/// The measured quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Sensor {
    /// Coordinate and rate of a joint.
    Joint(HingeCoordinate),
    /// Position, attitude, velocity, angular rate and axes of a frame.
    Motion(DeviceFrame),
    /// Specific force and angular acceleration at a frame.
    SpecificForce(DeviceFrame),
    /// Force and moment that the parent exerts on a body through its hinge.
    HingeLoad {
        /// The body.
        body: String,
        /// Frame of the reading in the frame of the hinge on the body.
        frame: Pose,
    },
    /// Motion of a frame relative to another frame.
    Relative {
        /// The observed frame.
        frame: DeviceFrame,
        /// The frame relative to which it is observed.
        reference: DeviceFrame,
    },
    /// Mass, centre of mass, velocity and angular momentum of several bodies.
    Bodies(Vec<String>),
    /// Sum of the normal forces of the contacts of a body in a zone.
    Touch {
        /// The body.
        body: String,
        /// The frame of the zone on the body.
        frame: DeviceFrame,
        /// The zone, about the origin of the frame: a sphere, ellipsoid, box, cylinder or capsule.
        zone: Geometry,
    },
    /// Distance to the first surface along the z axis of a frame, except the surfaces of a body.
    Range {
        /// The body of the frame, which the ray passes through; `None`: the world.
        body: Option<String>,
        /// The frame.
        frame: DeviceFrame,
    },
    /// An output of another device.
    Of {
        /// The device.
        device: String,
        /// `length`, `velocity` or `force`.
        output: String,
    },
}

/// Frame of a sensor or of a site of a line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum DeviceFrame {
    /// The frame of a body.
    Body(String),
    /// A node.
    Node(String),
}
