//! Colliders as written in a file, with their collision groups and surface properties.
use crate::body::solid::{colliding, seen};
use crate::schema::describe::Schema;
use crate::schema::kind::{At, Kind, color, flag, number, raw, text, texts, vector, whole};
use crate::schema::record::{Presence, record};
use crate::text::report::Cx;
use crate::text::value::Text;
use linkwork_collision::{ColliderSpec, OnTerrain, Shape, Visibility};
use linkwork_runtime::{Located, Origin, Value};
use linkwork_spatial::{Pose, Quat, Vec3};

record! {
    /// Collision properties of a shape or a collider.
    pub(crate) struct Surface: "surface" {
        /// Padding: thickness that is added to the shape on all sides.
        padding: f64 = number("m").at_least(0.0).or(0.0),
        /// Number of thin discs across its length that replace a rolling cylinder in contact, so that forces are continuous.
        discs: Option<u32> = whole::<u32>(1, 64).maybe(),
        /// Collision groups to which it belongs (default: `default`).
        group: Vec<Text> = texts().or(Vec::new()),
        /// Collision groups with which it collides (default: all).
        meets: Option<Vec<Text>> = texts().maybe(),
        /// Whether it collides with the terrain; `false` for a wheel, whose model computes the ground contact.
        terrain: bool = flag().or(true),
        /// Name of its material, for `pairs` of `contact`.
        material: Option<Text> = text().maybe(),
        /// Friction coefficient; a pair has the geometric mean.
        friction: Option<f64> = number("").at_least(0.0).maybe(),
        /// Coefficient of restitution; a pair has the larger value.
        restitution: Option<f64> = number("").within(0.0, 1.0).maybe(),
        /// Coefficient of rolling friction: largest moment across the normal per newton of normal force; a pair has the larger value.
        rolling_friction: Option<f64> = number("m").at_least(0.0).maybe(),
        /// Coefficient of spinning friction: largest moment about the normal per newton; a pair has the larger value.
        spinning_friction: Option<f64> = number("m").at_least(0.0).maybe(),
        /// Velocity of the surface relative to its body, in body axes, such as that of a belt or a track.
        surface_velocity: Option<Vec3> = vector("m/s").maybe(),
        /// Hidden at the start of the run.
        hidden: bool = flag().or(false),
        /// A simpler shape in the same frame, for coarse queries.
        coarse: Option<Shape> = CoarseKind.maybe(),
    }
}
record! {
    /// A separate collider, in addition to its [`Surface`].
    pub(crate) struct Standing: "collider" {
        /// Body, node or `world`.
        on: Option<Text> = text().wanted("write `on: \"world\"`, or a body"),
        /// The shape.
        shape: Located = raw(|| seen().describe()).need("write `shape: HalfSpace`"),
        /// The shape's frame in that of `on`.
        at: Pose = crate::schema::record::of::<Pose>().or(Pose::identity()),
        /// Red, green, blue, opacity.
        color: Option<[f64; 4]> = color().maybe(),
        /// Whether it is visible.
        visible: bool = flag().or(true),
        /// Documentation.
        doc: Option<Text> = text().maybe(),
    }
}

struct CoarseKind;

impl Kind for CoarseKind {
    type Of = Shape;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Shape> {
        if let Value::Variant(_, inner) = &v.value
            && let Some(axis) = inner.get("axis")
        {
            let what = &at.what;
            let fact = format!("{what} uses the frame of the fine shape, so `axis` is not allowed");
            cx.fault(axis.origin, fact, "remove `axis`");
            return None;
        }
        colliding().read(cx, v, at).map(|(shape, _)| shape)
    }
    fn write(&self, x: &Shape) -> Value {
        colliding().write(&(x.clone(), Quat::identity()))
    }
    fn describe(&self) -> Schema {
        colliding().describe()
    }
}

/// A collider before its groups and the defaults of `contact` are resolved.
#[derive(Clone, Debug)]
pub(crate) struct Collider {
    pub spec: ColliderSpec,
    /// Collision groups to which it belongs; empty: `default`.
    pub groups: Vec<Text>,
    /// Collision groups with which it collides; `None`: all.
    pub meets: Option<Vec<Text>>,
    pub friction: Option<f64>,
    pub restitution: Option<f64>,
    pub rolling: Option<f64>,
    pub spinning: Option<f64>,
    pub origin: Origin,
}

impl Collider {
    pub fn new(name: &str, body: &str, X: Pose, shape: Shape, s: Surface, origin: Origin) -> Self {
        let mut spec = ColliderSpec::new(name, body, shape).at(X);
        spec.coarse = s.coarse;
        spec.padding = s.padding;
        spec.discs = s.discs.unwrap_or(0);
        spec.hidden = if s.hidden { Visibility::Hidden } else { Visibility::Shown };
        spec.terrain = if s.terrain { OnTerrain::Collide } else { OnTerrain::Pass };
        spec.material_name = s.material.map(|m| m.text);
        spec.surface_velocity = s.surface_velocity.unwrap_or_else(Vec3::zeros);
        let Surface { group, meets, friction, restitution, .. } = s;
        let (rolling, spinning) = (s.rolling_friction, s.spinning_friction);
        Collider { spec, groups: group, meets, friction, restitution, rolling, spinning, origin }
    }
}
