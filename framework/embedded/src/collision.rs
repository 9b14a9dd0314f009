//! The colliders of a model (on bodies, on objects, in the world), and which of them are checked against each other while an object is held.
//!
//! Objects are free bodies next to the mechanism, so the rules of `framework/collision` apply to them by name. A held object counts as welded to the
//! tip that holds it: it is not checked against bodies that are welded to the tip, nor against bodies that a hinge joins to these.

use crate::error::{ModelError, ModelFault};
use crate::linkage::{Link, Linkage, objects};
use crate::model::ModelSpec;
use crate::part::Resolved;
use linkwork_collision::{ColliderId, Colliders, Neighbours, Shape, groups, neighbours};
use linkwork_multibody::{BodyId, Builder, Multibody};
use linkwork_spatial::{Mat3, Pose, Vec3};

/// Carrier of a collider.
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
    /// Model counterpart of each body of the mechanism with objects.
    pub bodies: Vec<Carrier>,
    /// Carrier of each collider.
    pub carriers: Vec<Carrier>,
    /// For each part and each collider: whether an object that the part's tip holds is checked against the collider, and whether a body that a hinge
    /// joins to the object is.
    pub meets_held: Vec<Vec<[bool; 2]>>,
    /// True if bodies that a hinge joins are not checked against each other.
    pub pass: bool,
    bounds: Vec<(f64, f64)>,
    /// For each body, its parent and the largest distance between both origins, m.
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
                // A body that a hinge joins to a held object is a neighbour of the tip.
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

    /// Returns an error if two padded colliders would touch at every configuration.
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

    /// Returns an upper bound for the distance of two colliders over all configurations, m; infinite if there is none. `far` contains the distances
    /// of each collider's farthest point from its body's origin.
    pub fn apart(&self, a: ColliderId, b: ColliderId, far: [f64; 2]) -> f64 {
        let ends = [a, b].map(|i| match self.carriers[i.index()] {
            _ if self.endless(i) => None,
            Carrier::World => Some(None),
            Carrier::Body(body) => Some(Some(body)),
            Carrier::Object(_) | Carrier::Linked(..) => None,
        });
        let [Some(mut x), Some(mut y)] = ends else { return f64::INFINITY };
        let mut way = far[0] + far[1];
        // Bodies come after their parents, so step from the later body to its parent.
        while x != y {
            let last = if x > y { &mut x } else { &mut y };
            let Some(body) = *last else { break };
            let (parent, step) = self.steps[body.index()];
            way += step;
            *last = parent;
        }
        way
    }

    /// Returns true if a collider is unbounded.
    pub fn endless(&self, id: ColliderId) -> bool {
        let spec = self.colliders.spec(id);
        let endless = |s: &Shape| matches!(s, Shape::HalfSpace | Shape::HeightField { .. });
        endless(&spec.fine) || spec.coarse.as_ref().is_some_and(endless)
    }

    /// Returns an upper bound for the distance, m, that points of a body move while the coordinates change by `dv`; `far` (m) is the largest distance
    /// of the points from the body's origin.
    pub fn motion(&self, body: BodyId, far: f64, dv: &[f64]) -> f64 {
        let row = &self.bounds[body.index() * self.nv..(body.index() + 1) * self.nv];
        let moving = row.iter().zip(dv).filter(|(_, d)| **d != 0.0);
        // A body that is only translated does not rotate, so the distance of its points does not matter, even if it is infinite.
        let of = |factor: f64| if factor > 0.0 { factor * far } else { 0.0 };
        moving.map(|((factor, more), d)| (of(*factor) + more) * d.abs()).sum()
    }
}

/// For each body and each degree of freedom, returns a factor and a summand: factor · (distance of the farthest point from the body's origin) +
/// summand bounds the motion of that point per unit of the degree of freedom (bodies × nv pairs). The factor is 0 for a slider and for a degree of
/// freedom that does not carry the body. Values are infinite where no limit exists.
fn bounds(mbs: &Multibody) -> Vec<(f64, f64)> {
    use linkwork_multibody::SubhingeKind as Kind;
    let nv = mbs.nv();
    let mut out = vec![(0.0, 0.0); mbs.bodies().len() * nv];
    for body in mbs.body_ids() {
        let row = &mut out[body.index() * nv..(body.index() + 1) * nv];
        // Go from the body to the root, and sum the largest possible distance of its origin from the
        // current frame.
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
                        // On a screw the origin moves only by the linear part.
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

/// Returns for each body its parent and the largest distance between both origins, m.
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

/// Returns the body of an object by name.
fn linked(linkages: &[Option<Linkage>], name: &str) -> Carrier {
    let mut all = linkages.iter().enumerate();
    let found = all.find_map(|(o, l)| Some((o, l.as_ref()?.multibody().body(name)?)));
    found.map_or(Carrier::World, |(o, b)| Carrier::Linked(o, b))
}

/// Converts a pose to a rotation matrix and a position.
pub(crate) fn matrix(X: &Pose) -> (Mat3, Vec3) {
    (X.rotation.to_rotation_matrix().into_inner(), X.position)
}

impl Carrier {
    /// Returns the frame in the world of what carries a collider: rotation matrix, and position of the origin, m.
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

    /// Returns the object that carries the collider, and how the collider's body is connected to it.
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
