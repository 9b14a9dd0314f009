//! The colliders of a model: on bodies, on objects, in the world; and which of them meet while an object is held.
//!
//! Objects are free bodies beside the mechanism, so that the rules of `framework/collision` serve them by name. What is held counts as welded to
//! the tip that holds it: it does not meet what is welded to that, nor what a hinge joins to that.

use crate::error::{ModelError, ModelFault};
use crate::linkage::{Link, Linkage, objects};
use crate::model::ModelSpec;
use crate::part::Resolved;
use linkwork_collision::{ColliderId, Colliders, Neighbours, Shape, groups, neighbours};
use linkwork_multibody::{BodyId, Builder, Multibody};
use linkwork_spatial::{Mat3, Pose, Vec3};

/// What carries a collider.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Carrier {
    World,
    Body(BodyId),
    Object(usize),
    /// A body that hangs on an object.
    Linked(usize, BodyId),
}

/// Colliders and what carries them.
#[derive(Debug)]
pub(crate) struct Scene {
    pub colliders: Colliders,
    /// By body of the mechanism with objects: what it is in the model.
    pub bodies: Vec<Carrier>,
    /// By collider.
    pub carriers: Vec<Carrier>,
    /// For each part, for each collider: whether what the part's tip holds meets it; and whether what a hinge joins to that does.
    pub meets_held: Vec<Vec<[bool; 2]>>,
    /// Bodies that a hinge joins pass each other.
    pub pass: bool,
    bounds: Vec<(f64, f64)>,
    /// By body: the one inward, and how far its origin may be from that one's, m.
    steps: Vec<(Option<BodyId>, f64)>,
    nv: usize,
}

impl Scene {
    pub fn new(
        spec: &ModelSpec,
        mbs: &Multibody,
        parts: &[Resolved],
        linkages: &[Option<Linkage>],
    ) -> Result<Self, ModelError> {
        let fault = |text| ModelError { faults: vec![ModelFault::Mechanism { text }] };
        let builder = objects(Builder::from(mbs), spec);
        let all = builder.build().map_err(|e| fault(e.to_string()))?;
        let colliders = Colliders::new(spec.colliders.clone(), spec.rules.clone(), &all)
            .map_err(|e| fault(e.to_string()))?;
        let object = |name: &str| spec.objects.iter().position(|o| o.name == name);
        let bodies: Vec<Carrier> = (all.bodies().iter())
            .map(|b| match (object(b.name()), mbs.body(b.name())) {
                (Some(o), _) => Carrier::Object(o),
                (None, Some(body)) => Carrier::Body(body),
                (None, None) => linked(linkages, b.name()),
            })
            .collect();
        let carriers: Vec<Carrier> = (colliders.ids())
            .map(|i| colliders.body(i).map_or(Carrier::World, |b| bodies[b.index()]))
            .collect();
        let pass = spec.rules.neighbours == Neighbours::Pass;
        let (group, joined, world) = (groups(mbs), neighbours(mbs), mbs.bodies().len());
        let meets_held = parts.iter().map(|p| {
            let tip = p.chain.as_ref().map_or(world, |c| c.tip_body.index());
            let meets = |c: &Carrier| {
                let other = match c {
                    Carrier::Object(_) | Carrier::Linked(..) => return [true; 2],
                    Carrier::Body(b) => b.index(),
                    Carrier::World => world,
                };
                let pair = (group[tip], group[other]);
                let near = joined.iter().any(|j| *j == pair || (j.1, j.0) == pair);
                // What a hinge joins to a held object is the tip's neighbour.
                [pair.0 != pair.1 && !(near && pass), pair.0 != pair.1 || !pass]
            };
            carriers.iter().map(meets).collect()
        });
        let meets_held = meets_held.collect();
        let (bounds, steps, nv) = (bounds(mbs), steps(mbs), mbs.nv());
        let scene = Self { colliders, bodies, carriers, meets_held, pass, bounds, steps, nv };
        scene.never_free()?;
        Ok(scene)
    }

    /// Refuses padding with which two touch wherever the robot is.
    fn never_free(&self) -> Result<(), ModelError> {
        let all = &self.colliders;
        let mut faults = Vec::new();
        for a in all.ids() {
            for b in all.ids().filter(|b| *b > a && all.meet(a, *b)) {
                let padding = [a, b].map(|i| all.spec(i).padding);
                let own = [a, b].map(|i| all.extent(i) - all.spec(i).padding);
                let most = self.apart(a, b, own);
                if padding[0] + padding[1] >= most {
                    let [name, other] = [a, b].map(|i| all.spec(i).name.as_str());
                    let all = padding[0] + padding[1];
                    faults.push(ModelFault::Padding {
                        name: name.into(),
                        other: other.into(),
                        all,
                        most,
                    });
                }
            }
        }
        if faults.is_empty() { Ok(()) } else { Err(ModelError { faults }) }
    }

    /// Greatest distance that two colliders may have at any configuration, at most, m; infinite where nothing bounds it. `far`: of the farthest
    /// point of each from its body's origin.
    pub fn apart(&self, a: ColliderId, b: ColliderId, far: [f64; 2]) -> f64 {
        let ends = [a, b].map(|i| match self.carriers[i.index()] {
            _ if self.endless(i) => None,
            Carrier::World => Some(None),
            Carrier::Body(body) => Some(Some(body)),
            Carrier::Object(_) | Carrier::Linked(..) => None,
        });
        let [Some(mut x), Some(mut y)] = ends else { return f64::INFINITY };
        let mut way = far[0] + far[1];
        // Bodies come after those that carry them: the later one steps inward.
        while x != y {
            let last = if x > y { &mut x } else { &mut y };
            let Some(body) = *last else { break };
            let (parent, step) = self.steps[body.index()];
            way += step;
            *last = parent;
        }
        way
    }

    /// Whether a collider has no end.
    pub fn endless(&self, id: ColliderId) -> bool {
        let spec = self.colliders.spec(id);
        let endless = |s: &Shape| matches!(s, Shape::HalfSpace | Shape::HeightField { .. });
        endless(&spec.fine) || spec.coarse.as_ref().is_some_and(endless)
    }

    /// How far points of a body, at most `far` (m) from its origin, may come while the coordinates change by `dv`, m.
    pub fn motion(&self, body: BodyId, far: f64, dv: &[f64]) -> f64 {
        let row = &self.bounds[body.index() * self.nv..(body.index() + 1) * self.nv];
        let moving = row.iter().zip(dv).filter(|(_, d)| **d != 0.0);
        // What is only carried along does not turn, however far it reaches.
        let of = |factor: f64| if factor > 0.0 { factor * far } else { 0.0 };
        moving.map(|((factor, more), d)| (of(*factor) + more) * d.abs()).sum()
    }
}

/// For each body, for each dof: what multiplies and what is added to the distance of the farthest point from the body's
/// origin to bound how far that point comes for a unit of the dof (bodies × nv pairs). A slider and a dof that does not carry the body multiply
/// it by 0. Infinite where limits say nothing.
fn bounds(mbs: &Multibody) -> Vec<(f64, f64)> {
    use linkwork_multibody::SubhingeKind as Kind;
    let nv = mbs.nv();
    let mut out = vec![(0.0, 0.0); mbs.bodies().len() * nv];
    for body in mbs.body_ids() {
        let row = &mut out[body.index() * nv..(body.index() + 1) * nv];
        // From the body inward: how far its origin may be from the frame at hand.
        let mut reach = 0.0;
        for b in mbs.ancestors(body) {
            let b = mbs.get(b);
            reach += b.hinge_in_body().position.norm();
            for s in b.subhinges().iter().rev() {
                let l = s.subhinge.limits;
                let travel = l.lower.abs().max(l.upper.abs());
                match s.subhinge.kind {
                    Kind::Pin { .. } => row[s.v.start] = (1.0, reach),
                    Kind::Slider { .. } => {
                        row[s.v.start] = (0.0, 1.0);
                        reach += travel;
                    }
                    Kind::Screw { pitch, .. } => {
                        row[s.v.start] = (1.0, reach + pitch.abs());
                        reach += travel * pitch.abs();
                    }
                    Kind::Ball => row[s.v.clone()].fill((1.0, reach)),
                    Kind::Free => {
                        // Along a screw the origin goes no farther than the linear part says.
                        row[s.v.start..s.v.start + 3].fill((1.0, reach));
                        row[s.v.start + 3..s.v.end].fill((0.0, 1.0));
                        reach = f64::INFINITY;
                    }
                    Kind::Locked => {}
                }
            }
            reach += b.hinge_in_parent().position.norm();
        }
    }
    out
}

/// For each body the one inward, and how far its origin may be from that one's, m.
fn steps(mbs: &Multibody) -> Vec<(Option<BodyId>, f64)> {
    use linkwork_multibody::SubhingeKind as Kind;
    let of = |id: BodyId| {
        let b = mbs.get(id);
        let mut step = b.hinge_in_body().position.norm() + b.hinge_in_parent().position.norm();
        for s in b.subhinges() {
            let l = s.subhinge.limits;
            let travel = l.lower.abs().max(l.upper.abs());
            step += match s.subhinge.kind {
                Kind::Slider { .. } => travel,
                Kind::Screw { pitch, .. } => travel * pitch.abs(),
                Kind::Free => f64::INFINITY,
                Kind::Pin { .. } | Kind::Ball | Kind::Locked => 0.0,
            };
        }
        (b.parent(), step)
    };
    mbs.body_ids().map(of).collect()
}

/// The body of an object that has this name.
fn linked(linkages: &[Option<Linkage>], name: &str) -> Carrier {
    let mut all = linkages.iter().enumerate();
    let found = all.find_map(|(o, l)| Some((o, l.as_ref()?.multibody().body(name)?)));
    found.map_or(Carrier::World, |(o, b)| Carrier::Linked(o, b))
}

/// A pose as a rotation matrix and a place.
pub(crate) fn matrix(X: &Pose) -> (Mat3, Vec3) {
    (X.rotation.to_rotation_matrix().into_inner(), X.position)
}

impl Carrier {
    /// Where in the world what carries a collider is: rotation matrix, and place of the origin, m.
    pub fn frame(
        self,
        body: impl Fn(BodyId) -> (Mat3, Vec3),
        objects: &[Pose],
        linked: impl Fn(usize, BodyId) -> (Mat3, Vec3),
    ) -> (Mat3, Vec3) {
        match self {
            Self::World => (Mat3::identity(), Vec3::zeros()),
            Self::Body(b) => body(b),
            Self::Object(o) => matrix(&objects[o]),
            Self::Linked(o, b) => linked(o, b),
        }
    }

    /// The object, and how the body of it that carries hangs on it.
    pub fn object(self, linkages: &[Option<Linkage>]) -> Option<(usize, Link)> {
        match self {
            Self::World | Self::Body(_) => None,
            Self::Object(o) => Some((o, Link::Welded)),
            Self::Linked(o, b) => {
                let link = linkages[o].as_ref().map_or(Link::Welded, |l| l.links[b.index()]);
                Some((o, link))
            }
        }
    }
}
