//! The colliders of a mechanism: checked, sorted by name, constant.

use crate::discs::Discs;
use crate::error::{ColliderFault, CollisionError};
use crate::item::{ColliderId, Item, fellows};
use crate::rules::{self, WORLD};
use crate::settings::{Hiding, SurfaceVelocities};
use crate::shape::{ColliderSpec, Detail, PairLaw, Resistance, Rules, Shape, Visibility};
use crate::solid::Solid;
use linkwork_multibody::{BodyId, Multibody};
use linkwork_names::nearest;
use std::sync::Arc;

/// All specifications and their geometry, from which [`Colliders::rebuild`] starts.
#[derive(Debug)]
struct Book {
    specs: Vec<ColliderSpec>,
    solids: Vec<[Option<Arc<Solid>>; 2]>,
    rules: Rules,
}

impl Item {
    /// Returns true if this detail has a separate coarse shape.
    pub(crate) fn is_coarse(&self, detail: Detail) -> bool {
        detail == Detail::Coarse && self.solids[1].is_some()
    }

    /// Returns the geometry of a detail.
    pub(crate) fn solid(&self, detail: Detail) -> Option<&Solid> {
        let [fine, coarse] = &self.solids;
        match detail {
            Detail::Coarse => coarse.as_deref().or(fine.as_deref()),
            Detail::Fine => fine.as_deref(),
        }
    }
}

/// The colliders of a mechanism. They never change; visibility and surface velocities are kept by the run ([`Hiding`], [`SurfaceVelocities`]).
#[derive(Debug)]
pub struct Colliders {
    book: Arc<Book>,
    pub(crate) items: Vec<Item>,
    pub(crate) meets: Vec<bool>,
    /// For each pair the index of its law, from 1 on.
    laws: Vec<u16>,
    resists: bool,
}

/// Result of [`Colliders::rebuild`].
#[derive(Debug)]
pub struct Rebuilt {
    /// The colliders of the existing bodies.
    pub colliders: Colliders,
    /// Names of colliders whose body does not exist now. They return when their body does.
    pub dropped: Vec<String>,
}

impl Colliders {
    /// Checks everything and builds hulls, triangle trees and the table of pairs. O(n²) in the number of colliders.
    ///
    /// # Errors
    /// All faults of the colliders and the rules at once.
    pub fn new(
        specs: Vec<ColliderSpec>,
        rules: Rules,
        multibody: &Multibody,
    ) -> Result<Self, CollisionError> {
        let mut specs = specs;
        let mut faults = check(&specs, multibody);
        let mut solids = Vec::with_capacity(specs.len());
        for s in &specs {
            solids.push(build(s, &mut faults));
        }
        faults.extend(rules::unknown(&rules, &specs, multibody));
        faults.extend(rules::laws(&rules, &specs));
        if !faults.is_empty() {
            return Err(CollisionError { faults });
        }
        let mut order: Vec<usize> = (0..specs.len()).collect();
        order.sort_by(|i, j| specs[*i].name.cmp(&specs[*j].name));
        let solids = order.iter().map(|i| solids[*i].clone()).collect();
        specs.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Self::assemble(Arc::new(Book { specs, solids, rules }), multibody))
    }

    /// Returns a copy with one more collider. The geometry of the existing ones is shared, not built again.
    ///
    /// # Errors
    /// All faults of the new collider.
    pub fn with(&self, more: ColliderSpec, multibody: &Multibody) -> Result<Self, CollisionError> {
        let mut specs = self.book.specs.clone();
        let at = specs.partition_point(|s| s.name <= more.name);
        let mut faults = Vec::new();
        let solid = build(&more, &mut faults);
        specs.insert(at, more);
        faults.extend(check(&specs[at..=at], multibody));
        if at > 0 && specs[at - 1].name == specs[at].name {
            let name = specs[at].name.clone();
            faults.push(ColliderFault::Duplicate { name, count: 2 });
        }
        if !faults.is_empty() {
            return Err(CollisionError { faults });
        }
        let mut solids = self.book.solids.clone();
        solids.insert(at, solid);
        let rules = self.book.rules.clone();
        Ok(Self::assemble(Arc::new(Book { specs, solids, rules }), multibody))
    }

    fn assemble(book: Arc<Book>, multibody: &Multibody) -> Self {
        let mut items = Vec::new();
        for (spec, s) in book.specs.iter().enumerate() {
            let body = multibody.body(&s.body);
            if body.is_some() || s.body == WORLD {
                let solids = book.solids[spec].clone();
                let discs = Discs::new(&s.fine, s.discs);
                let (pose, padding, fellows) = (s.pose, s.padding, Vec::new());
                items.push(Item { spec, body, pose, padding, discs, fellows, solids });
            }
        }
        let fellows = fellows(&items, multibody);
        for (item, near) in items.iter_mut().zip(fellows) {
            item.fellows = near;
        }
        let specs: Vec<&ColliderSpec> = items.iter().map(|i| &book.specs[i.spec]).collect();
        let world = multibody.bodies().len();
        let bodies: Vec<usize> =
            items.iter().map(|i| i.body.map_or(world, |b| b.index())).collect();
        let meets = rules::table(&book.rules, &specs, &bodies, multibody);
        let laws = rules::law_table(&book.rules, &specs);
        let none = Resistance::default();
        let of_law = |l: &PairLaw| l.rolling.is_some() || l.spinning.is_some();
        let resists =
            specs.iter().any(|s| s.resistance != none) || book.rules.laws.iter().any(of_law);
        drop(specs);
        Self { book, items, meets, laws, resists }
    }

    /// Returns the same colliders and rules for another mechanism, matched by name, for example after bodies were attached or detached. Geometry is
    /// shared, not built again. Colliders of missing bodies are omitted and listed; they are kept for the next call.
    #[must_use]
    pub fn rebuild(&self, multibody: &Multibody) -> Rebuilt {
        let gone = |s: &&ColliderSpec| s.body != WORLD && multibody.body(&s.body).is_none();
        let dropped = self.book.specs.iter().filter(gone).map(|s| s.name.clone()).collect();
        Rebuilt { colliders: Self::assemble(self.book.clone(), multibody), dropped }
    }

    /// Returns the number of colliders.
    #[must_use]
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Returns true if there are no colliders.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// Returns all handles, in the order of names.
    pub fn ids(&self) -> impl ExactSizeIterator<Item = ColliderId> + use<> {
        (0..self.items.len() as u32).map(ColliderId)
    }

    /// Returns the collider with the given name. O(log n); call it at set-up.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<ColliderId> {
        let at = self.items.binary_search_by(|i| self.book.specs[i.spec].name.as_str().cmp(name));
        at.ok().map(|i| ColliderId(i as u32))
    }

    /// Returns the specification of a collider.
    #[must_use]
    #[track_caller]
    pub fn spec(&self, id: ColliderId) -> &ColliderSpec {
        &self.book.specs[self.items[id.index()].spec]
    }

    /// Returns the body of a collider; `None` for the world.
    #[must_use]
    #[track_caller]
    pub fn body(&self, id: ColliderId) -> Option<BodyId> {
        self.items[id.index()].body
    }

    /// Returns an upper bound for the distance of a collider's points from its body's origin, m; 0 for an unbounded collider (a half space).
    #[must_use]
    #[track_caller]
    pub fn extent(&self, id: ColliderId) -> f64 {
        let item = &self.items[id.index()];
        let of = |solid: &Arc<Solid>| {
            let (mid, half) = ((solid.lo + solid.hi) / 2.0, (solid.hi - solid.lo) / 2.0);
            let far = item.pose.transform_point(&mid).norm() + half.norm() + item.padding;
            if far.is_finite() { far } else { 0.0 }
        };
        item.solids.iter().flatten().map(of).fold(0.0, f64::max)
    }

    /// Returns the collision rules as given.
    #[must_use]
    pub fn rules(&self) -> &Rules {
        &self.book.rules
    }

    /// Returns true if the rules include a pair. Visibility is not considered.
    #[must_use]
    #[track_caller]
    pub fn meet(&self, a: ColliderId, b: ColliderId) -> bool {
        self.meets[a.index() * self.items.len() + b.index()]
    }

    /// Returns the pairs that are excluded only because a hinge joins their bodies, each once. O(n²); call it at set-up.
    #[must_use]
    pub fn parted_by_hinges(&self, multibody: &Multibody) -> Vec<(ColliderId, ColliderId)> {
        let specs: Vec<&ColliderSpec> = self.ids().map(|i| self.spec(i)).collect();
        let world = multibody.bodies().len();
        let place = |i: &Item| i.body.map_or(world, |b| b.index());
        let bodies: Vec<usize> = self.items.iter().map(place).collect();
        let open = rules::without_hinges(&self.book.rules, &specs, &bodies, multibody);
        let n = self.items.len();
        let parted = |i: &usize, j: &usize| open[i * n + j] && !self.meets[i * n + j];
        let rows =
            (0..n).flat_map(|i| (i + 1..n).filter(move |j| parted(&i, j)).map(move |j| (i, j)));
        rows.map(|(i, j)| (ColliderId(i as u32), ColliderId(j as u32))).collect()
    }

    /// Returns the index in [`Rules::laws`] of the law for a pair.
    #[must_use]
    #[track_caller]
    pub fn law(&self, a: ColliderId, b: ColliderId) -> Option<usize> {
        if self.laws.is_empty() {
            return None;
        }
        usize::from(self.laws[a.index() * self.items.len() + b.index()]).checked_sub(1)
    }

    /// Returns true if any pair has rolling or spinning friction.
    #[must_use]
    pub fn resists(&self) -> bool {
        self.resists
    }

    /// Returns the rolling and spinning friction of a pair.
    #[must_use]
    #[track_caller]
    pub fn resistance(&self, a: ColliderId, b: ColliderId) -> Resistance {
        let (x, y) = (self.spec(a).resistance, self.spec(b).resistance);
        let law = self.law(a, b).map(|k| &self.rules().laws[k]);
        let (rolling, spinning) = (law.and_then(|l| l.rolling), law.and_then(|l| l.spinning));
        Resistance {
            rolling: rolling.unwrap_or(x.rolling.max(y.rolling)),
            spinning: spinning.unwrap_or(x.spinning.max(y.spinning)),
        }
    }

    /// Returns the surface velocities relative to the bodies at the beginning of a run, from the specifications.
    #[must_use]
    pub fn surface_velocities(&self) -> SurfaceVelocities {
        SurfaceVelocities { of: self.ids().map(|i| self.spec(i).surface_velocity).collect() }
    }

    /// Returns the visibility at the beginning of a run, from the specifications.
    #[must_use]
    pub fn hiding(&self) -> Hiding {
        let hidden = |i| self.spec(i).hidden == Visibility::Hidden;
        Hiding { hidden: self.ids().map(hidden).collect() }
    }

    /// Returns the visibility carried over from `old` colliders by name; new colliders have the visibility of their specification.
    #[must_use]
    pub fn carry_hiding(&self, old: &Colliders, hiding: &Hiding) -> Hiding {
        let mut new = self.hiding();
        for i in self.ids() {
            if let Some(before) = old.find(&self.spec(i).name) {
                new.set(i, hiding.of(before));
            }
        }
        new
    }
}

/// Builds the fine and coarse geometry of a collider; adds faults of its shapes to `faults`.
fn build(s: &ColliderSpec, faults: &mut Vec<ColliderFault>) -> [Option<Arc<Solid>>; 2] {
    let mut one = |which: &'static str, shape| match Solid::new(shape) {
        Ok(solid) => Some(Arc::new(solid)),
        Err(found) => {
            let named = |fault| ColliderFault::Shape { collider: s.name.clone(), which, fault };
            faults.extend(found.into_iter().map(named));
            None
        }
    };
    [one("fine", &s.fine), s.coarse.as_ref().and_then(|shape| one("coarse", shape))]
}

/// Checks everything in the specifications except the shapes.
fn check(specs: &[ColliderSpec], multibody: &Multibody) -> Vec<ColliderFault> {
    let mut faults = Vec::new();
    for (i, s) in specs.iter().enumerate() {
        let collider = || s.name.clone();
        let count = specs.iter().filter(|o| o.name == s.name).count();
        if count > 1 && specs[..i].iter().all(|o| o.name != s.name) {
            faults.push(ColliderFault::Duplicate { name: collider(), count });
        }
        if s.body != WORLD && multibody.body(&s.body).is_none() {
            let names = multibody.bodies().iter().map(|b| b.name()).chain([WORLD]);
            let suggestion = nearest(&s.body, names).map(str::to_owned);
            faults.push(ColliderFault::UnknownBody {
                collider: collider(),
                body: s.body.clone(),
                suggestion,
            });
        }
        let numbers = [
            ("padding", s.padding),
            ("friction", s.material.friction),
            ("restitution", s.material.restitution),
            ("rolling friction", s.resistance.rolling),
            ("spinning friction", s.resistance.spinning),
        ];
        for (what, value) in numbers {
            if !(value >= 0.0 && value.is_finite()) {
                faults.push(ColliderFault::Number { collider: collider(), what, value });
            }
        }
        if let Some(value) = s.surface_velocity.iter().copied().find(|x| !x.is_finite()) {
            let what = "surface velocity";
            faults.push(ColliderFault::Number { collider: collider(), what, value });
        }
        if s.discs > 0 && !matches!(s.fine, Shape::Cylinder { .. }) {
            faults.push(ColliderFault::Discs { collider: collider() });
        }
        if !s.pose.is_finite() || (s.pose.rotation.coords.norm() - 1.0).abs() > 1e-9 {
            faults.push(ColliderFault::Pose { collider: collider() });
        }
    }
    faults
}
