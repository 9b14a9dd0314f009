//! Description of a scene: shapes on bodies, arrows, trails, frames, plots, markers.
use linkwork_collision::VisualShape;
use linkwork_spatial::{Pose, Vec3};

/// A shape on a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Name of the body.
    pub body: String,
    /// Name of the shape, unique on the body.
    pub name: String,
    /// X_BS: the shape in the body.
    pub pose: Pose,
    /// The geometry.
    pub form: VisualShape,
    /// Red, green, blue, alpha: 0 to 255.
    pub color: [u8; 4],
    /// For each phase, whether the shape exists; empty: in all phases.
    pub phases: Vec<bool>,
}

/// An arrow whose origin and vector are variables, both in W.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrow {
    /// Dotted path of the entity.
    pub path: String,
    /// Variables of the origin.
    pub origin: [String; 3],
    /// Variables of the vector.
    pub vector: [String; 3],
    /// Metres of arrow per unit of the vector.
    pub scale: f64,
    /// Red, green, blue, alpha.
    pub color: [u8; 4],
}

/// End point of a line.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// A point that is fixed on a body.
    Body {
        /// Name of the body.
        body: String,
        /// The point relative to the body's origin, in body axes (m).
        at: Vec3,
    },
    /// A point in W (m): variables of its coordinates.
    Point([String; 3]),
}

/// A line between two points: a riser, a bridle, a tether.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Dotted path of the entity.
    pub path: String,
    /// Its ends. The line is drawn while both exist.
    pub ends: [End; 2],
    /// Variable that is positive while the line is taut. The line is dimmed while the variable is not positive, and hidden while the variable does
    /// not exist. Without a variable, the line is always bright.
    pub pull: Option<String>,
    /// Red, green, blue, alpha.
    pub color: [u8; 4],
}

/// The jet of an engine or a thruster: an arrow whose length is proportional to a variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Plume {
    /// Dotted path of the entity.
    pub path: String,
    /// Name of the body.
    pub body: String,
    /// Start point relative to the body's origin, in body axes (m).
    pub at: Vec3,
    /// Unit vector of its direction, in body axes.
    pub along: Vec3,
    /// Variable of its strength, such as throttle or thrust.
    pub by: String,
    /// Metres per unit of the variable.
    pub scale: f64,
    /// Red, green, blue, alpha.
    pub color: [u8; 4],
}

/// Conversion to the displayed unit: (SI − offset) · factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InUnit {
    /// Zero point of that unit in SI: 273.15 K for degrees Celsius.
    pub offset: f64,
    /// Factor from SI to the unit.
    pub factor: f64,
}

impl InUnit {
    /// Converts a number from SI to the displayed unit.
    #[must_use]
    pub fn of(self, si: f64) -> f64 {
        (si - self.offset) * self.factor
    }
}

/// A panel of curves.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Title, with the unit.
    pub title: String,
    /// Label and variable of each curve, and its displayed unit.
    pub series: Vec<(String, String, InUnit)>,
}

/// A labelled point.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    /// Position in W.
    pub at: Vec3,
    /// Label.
    pub label: String,
}

/// The planet: a sphere through the origin of W if W is a site, or a sphere about the origin of W.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planet {
    /// Its centre in W (m).
    pub centre: Vec3,
    /// Its radius (m). If W is a site, it is the distance of the centre from the origin of W.
    pub radius: f64,
    /// Colour of its ground: red, green, blue, 0 to 255.
    pub color: [u8; 3],
}

/// The complete scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Name of the run, shown as the application.
    pub title: String,
    /// Shapes on bodies.
    pub shapes: Vec<Shape>,
    /// Arrows.
    pub arrows: Vec<Arrow>,
    /// Lines.
    pub lines: Vec<Line>,
    /// Jets.
    pub plumes: Vec<Plume>,
    /// Bodies whose trail is drawn.
    pub trails: Vec<String>,
    /// Nodes whose axes are drawn.
    pub frames: Vec<String>,
    /// Panels of curves.
    pub panels: Vec<Panel>,
    /// Labelled points.
    pub markers: Vec<Marker>,
    /// The body that the camera follows.
    pub follow: Option<String>,
    /// Initial position of the camera relative to the followed body (or W) (m). With a planet, its z axis is the up direction at that body.
    pub eye: Option<Vec3>,
    /// The planet.
    pub planet: Option<Planet>,
    /// Colour of the sky (default: dark grey).
    pub sky: Option<[u8; 4]>,
    /// Colour of the ground at its middle height (default: that of Mars).
    pub ground: Option<[u8; 4]>,
}
