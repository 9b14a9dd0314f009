//! Colliders as written, with their groups and surfaces.
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
    /// What a shape of a body says when it collides, and a collider of its own.
    pub(crate) struct Surface: "surface" {
        /// The shape is taken to be this much thicker all around.
        padding: f64 = number("m").at_least(0.0).or(0.0),
        /// A cylinder that rolls: it touches as so many thin discs across its length, so that forces are continuous.
        discs: Option<u32> = whole::<u32>(1, 64).maybe(),
        /// Groups that it is in; `default` when none is written.
        group: Vec<Text> = texts().or(Vec::new()),
        /// Groups that it meets; all when none is written.
        meets: Option<Vec<Text>> = texts().maybe(),
        /// Whether it meets the terrain; `false` for a wheel, whose model of contact does.
        terrain: bool = flag().or(true),
        /// What it is made of, for `pairs` of `contact`.
        material: Option<Text> = text().maybe(),
        /// Coefficient of friction; a pair takes the geometric mean.
        friction: Option<f64> = number("").at_least(0.0).maybe(),
        /// Coefficient of restitution; a pair takes the larger.
        restitution: Option<f64> = number("").within(0.0, 1.0).maybe(),
        /// Coefficient of rolling friction: the moment across the normal for each newton of normal force; a pair takes the larger.
        rolling_friction: Option<f64> = number("m").at_least(0.0).maybe(),
        /// Coefficient of spinning friction: the moment about the normal for each newton; a pair takes the larger.
        spinning_friction: Option<f64> = number("m").at_least(0.0).maybe(),
        /// Velocity of the surface over its body, axes of the body: a belt or a track.
        surface_velocity: Option<Vec3> = vector("m/s").maybe(),
        /// Not there when the run begins.
        hidden: bool = flag().or(false),
        /// A simpler shape in the same frame, for queries that ask for it.
        coarse: Option<Shape> = CoarseKind.maybe(),
    }
}
record! {
    /// A collider that stands on its own, beside its [`Surface`].
    pub(crate) struct Standing: "collider" {
        /// Body, node or `world`.
        on: Option<Text> = text().wanted("write `on: \"world\"`, or a body"),
        /// The shape.
        shape: Located = raw(|| seen().describe()).need("write `shape: HalfSpace`"),
        /// The shape's frame in that of `on`.
        at: Pose = crate::schema::record::of::<Pose>().or(Pose::identity()),
        /// Red, green, blue, opacity.
        color: Option<[f64; 4]> = color().maybe(),
        /// Whether it is seen.
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
            let fact = format!("{what} stands in the frame of the fine shape, so it has no `axis`");
            cx.fault(axis.origin, fact, "leave the axis out");
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

/// A collider, ready but for its groups and what it takes from `contact`.
#[derive(Clone, Debug)]
pub(crate) struct Collider {
    pub spec: ColliderSpec,
    /// Groups that it is in; none: `default`.
    pub groups: Vec<Text>,
    /// Groups that it meets; `None`: all.
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
