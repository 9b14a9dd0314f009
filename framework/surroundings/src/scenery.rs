//! Visible scene: the shapes of the bodies, for cameras and lidars.
use linkwork_collision::VisualShape;
use linkwork_runtime::{
    Fault, Lane, Located, NodeState, Param, ParamSpec, PortKind, PortSpec, Provided, ReadCx,
    TO_NODE, Value, pattern, remedy,
};
use linkwork_spatial::Pose;
use std::sync::Arc;

/// Kind of parameters that contain a scenery.
const KIND: &str = "list of patterns of bodies";

/// Name of the immovable body.
const WORLD: &str = "world";

/// A shape on a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Sight {
    /// Full name of the body, or `world`.
    pub body: String,
    /// Name, unique on its body.
    pub name: String,
    /// The shape's frame in the body.
    pub pose: Pose,
    /// Geometry of the shape.
    pub form: VisualShape,
    /// Red, green, blue: 0 … 1.
    pub color: [f64; 3],
}

/// The shapes of all bodies, or of those that a parameter names: a list of patterns (`*`: within a name, `**`: anything). A pattern after `!`
/// excludes bodies; a list of such patterns only excludes bodies from all. `./` at the beginning of a pattern stands for the assembly of the part.
///
/// A model with a parameter of this type has the ports of [`Scenery::ports`] among its direct inputs, and moves the shapes
/// with [`Scenery::poses`].
#[derive(Clone, Debug, Default)]
pub struct Scenery {
    shapes: Arc<Vec<Sight>>,
    /// Full names of the bodies that move and have shapes, each once, in order.
    bodies: Arc<Vec<String>>,
    /// For each shape the index of its body; `None`: the world.
    places: Arc<Vec<Option<usize>>>,
    /// Patterns as written; `None`: all.
    only: Option<Vec<String>>,
}

impl Scenery {
    /// Creates the scenery of these shapes.
    #[must_use]
    pub fn of(shapes: Vec<Sight>) -> Self {
        let moving = shapes.iter().filter(|s| s.body != WORLD);
        let mut bodies: Vec<String> = moving.map(|s| s.body.clone()).collect();
        bodies.sort_unstable();
        bodies.dedup();
        let places = shapes.iter().map(|s| bodies.binary_search(&s.body).ok()).collect();
        let (bodies, places) = (Arc::new(bodies), Arc::new(places));
        Self { shapes: Arc::new(shapes), bodies, places, only: None }
    }

    /// The shapes, in the order of their bodies.
    #[must_use]
    pub fn shapes(&self) -> &[Sight] {
        &self.shapes
    }

    /// Full names of the bodies that move and have shapes, each once.
    #[must_use]
    pub fn bodies(&self) -> &[String] {
        &self.bodies
    }

    /// Returns the ports for the poses of the bodies; they are bound automatically.
    #[must_use]
    pub fn ports(&self) -> Vec<PortSpec> {
        let port = |(k, body): (usize, &String)| PortSpec {
            bind: Some(format!("{TO_NODE}{body}").into()),
            ..PortSpec::named(format!("bodies[{k}]"), PortKind::NodeState, <NodeState as Lane>::N)
                .doc_of("A body that is seen.")
        };
        self.bodies.iter().enumerate().map(port).collect()
    }

    /// Returns the pose of each shape in W, in the order of [`Scenery::shapes`]; `u`: the lanes of [`Scenery::ports`].
    pub fn poses<'a>(&'a self, u: &'a [f64]) -> impl Iterator<Item = Pose> + 'a {
        self.shapes.iter().zip(&*self.places).map(|(shape, place)| match place {
            Some(k) => {
                let body = NodeState::get(&u[k * NodeState::N..]);
                Pose::new(body.rotation, body.position) * shape.pose
            }
            None => shape.pose,
        })
    }

    /// Returns the shapes on bodies that the patterns match; `home` is the path of the assembly.
    fn only(&self, patterns: Vec<String>, home: &str) -> Self {
        let all: Vec<(bool, String)> = patterns.iter().map(|p| resolved(p, home)).collect();
        let any = |keeps: bool, s: &Sight| {
            all.iter().any(|(kept, p)| *kept == keeps && pattern::path_matches(p, &s.body))
        };
        let open = !all.is_empty() && all.iter().all(|(kept, _)| !kept);
        let named = |s: &&Sight| (open || any(true, s)) && !any(false, s);
        let shapes = self.shapes.iter().filter(named).cloned().collect();
        Self { only: Some(patterns), ..Self::of(shapes) }
    }
}

/// Returns whether a pattern includes bodies, and the pattern with the full path of its assembly.
fn resolved(pattern: &str, home: &str) -> (bool, String) {
    let (keeps, pattern) = match pattern.strip_prefix('!') {
        Some(rest) => (false, rest),
        None => (true, pattern),
    };
    let full = match pattern.strip_prefix("./") {
        Some(local) if home.is_empty() => local.to_owned(),
        Some(local) => format!("{home}/{local}"),
        None => pattern.to_owned(),
    };
    (keeps, full)
}

/// The mechanism provides the shapes of its bodies.
impl Provided for Scenery {
    const WORD: &'static str = KIND;
    fn fingerprint(&self) -> String {
        format!("{:?}\n", self.shapes)
    }
}

impl Scenery {
    /// Returns the shapes of all bodies of the simulation.
    fn all(cx: &ReadCx<'_>) -> Scenery {
        cx.services.of_host::<Scenery>().map_or_else(Scenery::default, |all| (**all).clone())
    }
}

impl Param for Scenery {
    fn kind() -> String {
        KIND.into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Self> {
        let patterns = Vec::<String>::read(v, spec, cx)?;
        let all = Self::all(cx);
        let names: Vec<&str> = all.shapes.iter().map(|s| s.body.as_str()).collect();
        let home = cx.path.rsplit_once('.').map_or("", |(home, _)| home).to_owned();
        let nobody = |p: &&String| {
            let (_, full) = resolved(p, &home);
            !names.iter().any(|n| pattern::path_matches(&full, n))
        };
        // The scenery is empty if parameters are read without a simulation (for `describe`); names cannot be checked then.
        if let Some(stray) = patterns.iter().find(nobody).filter(|_| !names.is_empty()) {
            let fact = format!("`{}.{}`: no body with a shape is `{stray}`", cx.path, spec.name);
            let known: Vec<&str> = all.bodies.iter().map(String::as_str).chain([WORLD]).collect();
            cx.faults.push(Fault::new(v.origin, fact).help(remedy(stray, "bodies", &known)));
            return None;
        }
        Some(all.only(patterns, &home))
    }
    fn missing(_: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Option<Self>> {
        Some(Some(Self::all(cx)))
    }
    /// Returns the patterns; without any, the pattern that matches everything.
    fn show(&self) -> Value {
        self.only.clone().unwrap_or_else(|| vec!["**".into()]).show()
    }
}

/// The albedo of shapes without a colour.
pub const PLAIN: [f64; 3] = [0.6, 0.6, 0.62];

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_collision::Shape;
    use linkwork_spatial::Vec3;

    fn sight(body: &str, name: &str, x: f64) -> Sight {
        Sight {
            body: body.into(),
            name: name.into(),
            pose: Pose::translation(x, 0.0, 0.0),
            form: VisualShape::Shape(Shape::Sphere { radius: 1.0 }),
            color: PLAIN,
        }
    }

    #[test]
    fn shapes_go_with_their_bodies() {
        let scenery =
            Scenery::of(vec![sight("b", "1", 1.0), sight("world", "2", 2.0), sight("a", "3", 3.0)]);
        assert_eq!(scenery.bodies(), ["a", "b"]);
        let ports = scenery.ports();
        assert_eq!(ports[1].bind.as_deref(), Some("node:/b"));
        let mut u = vec![0.0; 2 * NodeState::N];
        for (k, height) in [10.0, 20.0].into_iter().enumerate() {
            let body = NodeState { position: Vec3::new(0.0, 0.0, height), ..NodeState::identity() };
            body.put(&mut u[k * NodeState::N..(k + 1) * NodeState::N]);
        }
        let at: Vec<[f64; 3]> = scenery.poses(&u).map(|p| p.position.into()).collect();
        assert_eq!(at, [[1.0, 0.0, 20.0], [2.0, 0.0, 0.0], [3.0, 0.0, 10.0]]);
        // A selection of bodies has another fingerprint.
        let only = |patterns: &[&str], home: &str| {
            scenery.only(patterns.iter().map(|p| (*p).to_owned()).collect(), home)
        };
        let some = only(&["a"], "");
        assert_eq!(some.bodies(), ["a"]);
        // Patterns after `!` exclude bodies that the other patterns include; alone, they exclude bodies from the list of all.
        assert_eq!(only(&["!a"], "").bodies(), ["b"]);
        assert_eq!(only(&["!./a"], "").shapes().len(), 2);
        assert_eq!(only(&["**", "!b", "!world"], "").bodies(), ["a"]);
        assert!(only(&[], "").shapes().is_empty());
        assert!(only(&["a", "!a"], "").shapes().is_empty());
        let robots = Scenery::of(vec![sight("A/tool", "1", 0.0), sight("B/tool", "2", 0.0)]);
        let own = |p: &str| robots.only(vec![p.to_owned()], "B").bodies().to_vec();
        assert_eq!(
            (own("!./tool"), own("./tool")),
            (vec!["A/tool".into()], vec!["B/tool".to_owned()])
        );
        assert_ne!(some.fingerprint(), scenery.fingerprint());
    }
}
