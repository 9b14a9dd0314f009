//! Bodies that a Rust program builds.
use super::here;
use crate::body::hinge::hinge;
use crate::body::solid;
use crate::schema::kind::Kind;
use crate::schema::record::of;
use crate::text::value::list;
use linkwork_collision::Shape;
use linkwork_multibody::Hinge;
use linkwork_runtime::{IntoValue, Located, Value};
use linkwork_spatial::{Mat3, Pose, Quat, Vec3};

/// The moments of inertia of a body about its centre of mass, in the axes of the body (kg m²): three principal moments, a matrix, or
/// the shape of a homogeneous solid with the mass of the body.
pub struct BodyInertia(Value);

impl From<[f64; 3]> for BodyInertia {
    fn from(principal: [f64; 3]) -> Self {
        BodyInertia(principal.into_value())
    }
}
impl From<Mat3> for BodyInertia {
    fn from(matrix: Mat3) -> Self {
        BodyInertia(list(matrix.transpose().iter().copied()))
    }
}
impl From<Shape> for BodyInertia {
    fn from(solid: Shape) -> Self {
        BodyInertia(solid::value(&solid))
    }
}

/// A body with its hinge, as a file describes one.
#[derive(Clone, Debug)]
pub struct Body {
    pub(super) fields: Vec<(String, Located)>,
}

impl Body {
    /// Hangs a body on `"world"`, on another body (`"chassis"`) or on a node of one (`"chassis/mast"`). The body is fixed there
    /// unless [`Body::hinge`] is called.
    #[must_use]
    #[track_caller]
    pub fn on(parent: &str) -> Body {
        Body { fields: Vec::new() }.set("parent", parent)
    }

    /// Sets how the body can move relative to its parent: `Hinge::pin(Vec3::y())`, `Hinge::free()`.
    #[must_use]
    #[track_caller]
    pub fn hinge(self, value: Hinge) -> Self {
        match hinge().write(&value) {
            // A body that has no hinge is fixed.
            Value::Null => self,
            written => self.set("hinge", written),
        }
    }

    /// Sets the frame of the hinge in the parent: a position (m), or a pose.
    #[must_use]
    #[track_caller]
    pub fn at(self, frame: impl Into<Pose>) -> Self {
        self.set("at", of::<Pose>().write(&frame.into()))
    }

    /// Sets the frame of the hinge in the body: a position (m), or a pose.
    #[must_use]
    #[track_caller]
    pub fn hinge_frame(self, frame: impl Into<Pose>) -> Self {
        self.set("hinge_frame", of::<Pose>().write(&frame.into()))
    }

    /// Sets the mass (kg).
    #[must_use]
    #[track_caller]
    pub fn mass(self, mass: f64) -> Self {
        self.set("mass", mass)
    }

    /// Sets the centre of mass in the frame of the body (m).
    #[must_use]
    #[track_caller]
    pub fn com(self, com: impl Into<Vec3>) -> Self {
        self.set("com", com.into())
    }

    /// Sets the moments of inertia about the centre of mass, in the axes of the body (kg m²).
    #[must_use]
    #[track_caller]
    pub fn inertia(self, inertia: impl Into<BodyInertia>) -> Self {
        self.set("inertia", inertia.into().0)
    }

    /// Sets the angle (rad) at which a pin starts.
    #[must_use]
    #[track_caller]
    pub fn initial_angle(self, angle: f64) -> Self {
        self.initial("angle", angle)
    }

    /// Sets the rate (rad/s, m/s) at which a pin or slider starts.
    #[must_use]
    #[track_caller]
    pub fn initial_rate(self, rate: f64) -> Self {
        self.initial("rate", rate)
    }

    /// Sets the position (m) at which a free body starts.
    #[must_use]
    #[track_caller]
    pub fn initial_position(self, position: impl Into<Vec3>) -> Self {
        self.initial("position", position.into())
    }

    /// Sets the rotation with which a free body or a ball hinge starts.
    #[must_use]
    #[track_caller]
    pub fn initial_rotation(self, rotation: Quat) -> Self {
        self.initial("rotation", crate::schema::pose::rotation().write(&rotation))
    }

    /// Sets the velocity (m/s) with which a free body starts, in the axes of its parent.
    #[must_use]
    #[track_caller]
    pub fn initial_velocity(self, velocity: impl Into<Vec3>) -> Self {
        self.initial("velocity", velocity.into())
    }

    /// Sets the angular velocity (rad/s) with which a free body or a ball hinge starts, in the axes of the body.
    #[must_use]
    #[track_caller]
    pub fn initial_angular_velocity(self, angular: impl Into<Vec3>) -> Self {
        self.initial("angular", angular.into())
    }

    /// Sets how the body starts by a field of `initial` in files: `initial("position", "2 cm")` of a slider.
    #[must_use]
    #[track_caller]
    pub fn initial(self, field: &str, value: impl IntoValue) -> Self {
        self.inside("initial", field, here(value))
    }

    /// Adds a frame that can be named `BODY/NAME`: a position (m), or a pose.
    #[must_use]
    #[track_caller]
    pub fn node(self, name: &str, frame: impl Into<Pose>) -> Self {
        self.inside("nodes", name, here(of::<Pose>().write(&frame.into())))
    }

    /// Adds a shape that is shown. [`Body::set`] can give shapes a frame, a colour and contact.
    #[must_use]
    #[track_caller]
    pub fn shape(mut self, shape: &Shape) -> Self {
        let item = here(crate::fields! { shape: solid::value(shape) });
        match self.fields.iter_mut().find(|(key, _)| key == "shapes") {
            Some((_, Located { value: Value::List(items), .. })) => items.push(item),
            _ => return self.set("shapes", Value::List(vec![item])),
        }
        self
    }

    /// Sets a field by the name that it has in files: `set("damping", 0.05)`, `set("reaction", true)`,
    /// `set("mass", "20 kg")`. A field that was set before is replaced.
    #[must_use]
    #[track_caller]
    pub fn set(mut self, field: &str, value: impl IntoValue) -> Self {
        let value = here(value);
        match self.fields.iter_mut().find(|(key, _)| key == field) {
            Some((_, there)) => *there = value,
            None => self.fields.push((field.to_string(), value)),
        }
        self
    }

    /// Sets an entry of a field that is a map.
    fn inside(mut self, field: &str, key: &str, value: Located) -> Self {
        let at = match self.fields.iter().position(|(key, _)| key == field) {
            Some(at) => at,
            None => {
                let empty = Located { value: Value::Map(Vec::new()), origin: value.origin };
                self.fields.push((field.to_string(), empty));
                self.fields.len() - 1
            }
        };
        crate::text::value::set(&mut self.fields[at].1, &[key.to_string()], &value);
        self
    }
}
