//! What is shown: shapes on bodies, arrows, trails, frames, plots, markers.
use linkwork_collision::Seen;
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
    /// What it is.
    pub form: Seen,
    /// Red, green, blue, alpha: 0 to 255.
    pub color: [u8; 4],
    /// In which phases it is there; empty: in all.
    pub phases: Vec<bool>,
}

/// An arrow from variables: at a point, along a vector, both in W.
#[derive(Clone, Debug, PartialEq)]
pub struct Arrow {
    /// Dotted path under which it is shown.
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

/// Where a line ends.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// At a point that is fixed on a body.
    Body {
        /// Name of the body.
        body: String,
        /// The point, from the body's origin, its axes (m).
        at: Vec3,
    },
    /// At a point in W (m): variables of its coordinates.
    Point([String; 3]),
}

/// A line that spans two points: a riser, a bridle, a tether.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Dotted path under which it is shown.
    pub path: String,
    /// Its ends. It is drawn while both are there.
    pub ends: [End; 2],
    /// Variable that is above zero while it pulls: it is dimmed while it does not, and is not there where the variable is
    /// not. Bright always without one.
    pub pull: Option<String>,
    /// Red, green, blue, alpha.
    pub color: [u8; 4],
}

/// The jet of an engine or a thruster: an arrow whose length is that of a variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Plume {
    /// Dotted path under which it is shown.
    pub path: String,
    /// Name of the body.
    pub body: String,
    /// Where it begins, from the body's origin, its axes (m).
    pub at: Vec3,
    /// Unit vector along which it goes, body axes.
    pub along: Vec3,
    /// Variable of its strength: throttle or thrust.
    pub by: String,
    /// Metres for one unit of the variable.
    pub scale: f64,
    /// Red, green, blue, alpha.
    pub color: [u8; 4],
}

/// A number in the unit in which it is shown: (SI − offset) · factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InUnit {
    /// What is zero in that unit, SI: 273.15 K for degrees Celsius.
    pub offset: f64,
    /// From SI to the unit.
    pub factor: f64,
}

impl InUnit {
    /// The number as it is shown, of one in SI.
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
    /// Label and variable of each curve, and how it is shown.
    pub series: Vec<(String, String, InUnit)>,
}

/// A labelled point.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    /// Place in W.
    pub at: Vec3,
    /// Label.
    pub label: String,
}

/// The planet: of a site W, drawn as a sphere through the origin of W, or about the origin of W.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planet {
    /// Its centre in W (m).
    pub centre: Vec3,
    /// Its radius (m): the distance of the centre from the origin of W where W is a site.
    pub radius: f64,
    /// Colour of its ground: red, green, blue, 0 to 255.
    pub color: [u8; 3],
}

/// All that is shown.
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
    /// Bodies whose path is drawn.
    pub trails: Vec<String>,
    /// Nodes whose axes are drawn.
    pub frames: Vec<String>,
    /// Panels of curves.
    pub panels: Vec<Panel>,
    /// Labelled points.
    pub markers: Vec<Marker>,
    /// The body that the eye follows.
    pub follow: Option<String>,
    /// Where the eye starts relative to the followed body (or W) (m); with a planet z of it is up at that body.
    pub eye: Option<Vec3>,
    /// The planet.
    pub planet: Option<Planet>,
    /// Colour of the sky; dark grey when it is not given.
    pub sky: Option<[u8; 4]>,
    /// Colour of the ground at its middle height; that of Mars when it is not given.
    pub ground: Option<[u8; 4]>,
}
