//! Bodies on hinges of the world pass through fixed shapes, because connected bodies never touch: a mass on a vertical slider falls through the
//! ground. Users expect this if the two shapes overlap at the hinge, but not if they are apart at the start and can approach each other; this case
//! gives a warning.

use crate::spec::MechanismSpec;
use linkwork_collision::{ColliderId, Colliders, Detail, Scratch, TERRAIN};
use linkwork_multibody::{BodyId, SubhingeKind};
use linkwork_runtime::Fault;
use linkwork_spatial::Pose;

/// Shapes that are nearer than this at the start are considered parts of the hinge, m.
const TOUCH: f64 = 1e-3;

/// A body whose shapes pass through a shape of the world.
pub struct Passing {
    /// Names of the two colliders; the collider of the body is the first.
    pub colliders: [String; 2],
    /// The warning, at the body.
    pub warning: Fault,
}

impl MechanismSpec {
    /// Returns each body of which a shape could reach a shape of the world that it passes through.
    #[must_use]
    pub fn passing(&self) -> Vec<Passing> {
        let mut found = Vec::new();
        let Some(colliders) = self.colliders() else { return found };
        let pairs = colliders.parted_by_hinges(&self.multibody);
        if pairs.is_empty() {
            return found;
        }
        let all = self.multibody.body_poses(&self.q);
        let poses = |b: Option<BodyId>| b.map_or_else(Pose::identity, |b| all[b.index()]);
        let mut scratch = Scratch::new(colliders);
        let mut told: Vec<BodyId> = Vec::new();
        for (a, b) in pairs {
            // The body that does not move is welded to the world, or is the world itself.
            let (moving, still) = if self.moves(colliders, a) { (a, b) } else { (b, a) };
            let Some(body) = colliders.body(moving).filter(|b| !told.contains(b)) else { continue };
            let stands = !self.moves(colliders, still) && colliders.spec(still).name != TERRAIN;
            if !stands || !self.reaches(colliders, (moving, still), body, &mut scratch, poses) {
                continue;
            }
            told.push(body);
            let (name, other) = (self.multibody.get(body).name(), &colliders.spec(still).name);
            let fact = format!(
                "`{name}`: its shapes do not collide with `{other}`, because a hinge joins `{name}` to the world, and neighbours do not collide with each other"
            );
            let help = format!(
                "write `collide: [[\"{name}\", \"{other}\"]]` in `contact` if they are to collide, otherwise `ignore: [[\"{name}\", \"{other}\"]]`"
            );
            let origin = self.bodies.get(name).copied().unwrap_or(self.origin);
            let colliders = [moving, still].map(|c| colliders.spec(c).name.clone());
            found.push(Passing { colliders, warning: Fault::new(origin, fact).help(help) });
        }
        found
    }

    /// Returns whether two colliders of these names exist and may touch.
    #[must_use]
    pub fn meets(&self, [a, b]: &[String; 2]) -> bool {
        let pair = |c: &Colliders| Some(c.meet(c.find(a)?, c.find(b)?));
        self.colliders().and_then(pair).unwrap_or(false)
    }

    /// Returns whether there is a movable hinge between the body of a collider and the world.
    fn moves(&self, colliders: &Colliders, id: ColliderId) -> bool {
        let mut way = colliders.body(id).into_iter().flat_map(|b| self.multibody.ancestors(b));
        way.any(|b| !self.multibody.get(b).v().is_empty())
    }

    /// Returns whether two shapes are apart at the start and may come together; a body that only rotates reaches at most twice its extent.
    fn reaches(
        &self,
        colliders: &Colliders,
        (moving, still): (ColliderId, ColliderId),
        body: BodyId,
        scratch: &mut Scratch,
        poses: impl Fn(Option<BodyId>) -> Pose,
    ) -> bool {
        let far = colliders.distance(scratch, moving, still, Detail::Fine, poses);
        let Some(far) = far.map(|d| d.distance).filter(|d| *d > TOUCH) else { return false };
        let of = |b: BodyId| self.multibody.get(b);
        let turns = |b: BodyId| {
            let pin = |k: &SubhingeKind| matches!(k, SubhingeKind::Pin { .. } | SubhingeKind::Ball);
            of(b).subhinges().iter().all(|s| pin(&s.subhinge.kind))
        };
        !self.multibody.ancestors(body).all(turns) || far < 2.0 * colliders.extent(moving)
    }
}
