//! Units: a tree with closed loops, converted to a tree again.
//!
//! A *unit* is what the sweeps eliminate at once: an ordinary link, or an *aggregate*, which consists of the links of one or more loops whose
//! closures leave fewer independent rates (constraint embedding). Every aggregate hangs on one external parent, so the units form a tree. Constraints
//! that are not embedded are treated as rows outside of the tree (tree-augmented); a mechanism may have both kinds.
//!
//! ```text
//! members of a loop = links on the paths from its two ends to where the paths meet
//! ```
//! The modes of a flexible body are also an aggregate, without constraints: its members are the body's stations, its independent rates are those of
//! the modes. A loop with a flexible body on its path is always a row. Loops that share a member form one aggregate. The condition that an aggregate
//! has one external parent holds by construction: the meeting points of two loops with a common member lie on one path to the base, and the inner one
//! is then a member of the outer loop. Source: Jain, "Recursive algorithms using local constraint embedding for multibody system dynamics" and *Robot
//! and Multibody Dynamics* (aggregation).

mod aggregate;
mod closing;
pub(crate) mod closure;
mod dense;
mod floating;
mod forces;
mod reduction;
mod rows;
mod sweep;
mod walk;

use crate::flexible::Step;
use crate::tree::{Link, Tree};
use closure::Closure;
use linkwork_multibody::{BodyId, ConstraintId, Coordinate};
use std::collections::{BTreeMap, BTreeSet};

pub use closing::Level;
pub use rows::{RowGroup, RowSet, Run, WIDTH};
pub use sweep::UnitsWork;

/// Constraint method of a loop or coupling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintMethod {
    /// Its loop becomes an aggregate: minimal coordinates, no multipliers.
    Embed,
    /// Constraint rows with multipliers.
    Augment,
    /// Embeds if the aggregate is small, and where rows are not possible because a hinge of it moves nothing with mass outboard, such as a strut
    /// without mass. Otherwise augments.
    Auto,
}

/// Largest aggregate, in degrees of freedom of its members, that [`ConstraintMethod::Auto`] embeds. For larger ones the dense work within the aggregate
/// costs more than rows.
pub const EMBED_MAX: usize = 6;

/// The links of loops, eliminated at once.
#[derive(Clone, Debug)]
pub(crate) struct Aggregate {
    /// Slot of the external parent.
    pub parent: u32,
    /// Links, ascending: parents first.
    pub links: Vec<u32>,
    /// Index of each link's parent among the links; `None` is the external parent.
    pub inner: Vec<Option<u32>>,
    /// Indices of the members' rates in β, in the order of the links; and the first of each link.
    pub dofs: Vec<u32>,
    pub first: Vec<u32>,
    pub constraints: Vec<ConstraintId>,
    pub rows: usize,
}

#[derive(Clone, Debug)]
pub(crate) enum Unit {
    /// Index of the link.
    Link(u32),
    /// Index of the aggregate.
    Aggregate(u32),
}

/// Data at a slot for a row that comes from outboard.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Inward {
    pub through: Through,
    /// First index in β, and among the independent rates.
    pub v: u32,
    pub first: u32,
    /// Slot inboard of the unit.
    pub parent: u32,
}

#[derive(Clone, Copy, Debug, Default)]
pub(crate) enum Through {
    /// A hinge with this number of free dofs.
    Free(u32),
    /// A hinge with this number of prescribed dofs.
    Prescribed(u32),
    /// A root with six free dofs.
    Floating,
    /// A member of an aggregate, or the world.
    #[default]
    Aggregate,
}

/// The structure of a mechanism with closed loops: constants, shared by any number of
/// [`UnitsWork`]s.
#[derive(Clone, Debug)]
pub struct Units {
    pub(crate) units: Vec<Unit>,
    pub(crate) aggregates: Vec<Aggregate>,
    /// Data of a row at each slot on its path inward.
    pub(crate) inward: Vec<Inward>,
    /// Unit of each slot (slot 0, the world, lacks one).
    pub(crate) of_slot: Vec<u32>,
    /// Index of each link among the members of its aggregate.
    pub(crate) member: Vec<u32>,
    /// First independent rate of each unit, in the order of units.
    pub(crate) first: Vec<u32>,
    pub(crate) independent: usize,
    /// True for the first unit that the gather sweep propagates to its parent: it writes, others add.
    pub(crate) writes: Vec<bool>,
    /// Slot about whose origin the columns of a slot are.
    pub(crate) root: Vec<u32>,
    /// Loops by index.
    pub(crate) closures: Vec<Closure>,
    /// Slot and index in β of each coupling's terms, with the factor.
    pub(crate) couplings: Vec<Vec<(u32, u32, f64)>>,
    augmented: Vec<ConstraintId>,
    embedded: Vec<ConstraintId>,
}

impl Units {
    /// Creates the units of a tree; `constraint_method` returns the method for each constraint of its mechanism. O(links × loops), at set-up.
    #[must_use]
    pub fn new(tree: &Tree, constraint_method: impl Fn(ConstraintId) -> ConstraintMethod) -> Self {
        let mbs = tree.multibody();
        let closures: Vec<Closure> = (mbs.loops().iter().zip(&tree.anchors))
            .map(|(l, ends)| Closure::new(ends, &l.rows, l.gaps.clone()))
            .collect();
        let slot_of_v = |v: usize| {
            let k = tree.links.iter().position(|l| l.v as usize == v);
            k.map_or(0, |k| k as u32 + 1)
        };
        let couplings: Vec<Vec<(u32, u32, f64)>> = (mbs.couplings().iter())
            .map(|c| c.terms.iter().map(|(_, v, c)| (slot_of_v(*v), *v as u32, *c)).collect())
            .collect();
        let members = |c: ConstraintId| match c {
            ConstraintId::Loop(i) => members(tree, &closures[i as usize].slots, Ends::Bodies),
            ConstraintId::Coupling(i) => {
                let slots: Vec<u32> = couplings[i as usize].iter().map(|t| t.0).collect();
                members(tree, &slots, Ends::Hinges)
            }
        };
        let (mut wanted, mut augmented) = (Vec::new(), Vec::new());
        for c in mbs.constraints() {
            match constraint_method(c) {
                ConstraintMethod::Augment => augmented.push(c),
                t => {
                    let members = members(c);
                    let bends = |slot: &u32| *slot as usize > tree.links.len();
                    // The rates that an aggregate eliminates have constant factors in its couplings.
                    let curved = matches!(c, ConstraintId::Coupling(i) if !mbs.couplings()[i as usize].is_linear());
                    if curved || members.iter().any(bends) {
                        augmented.push(c);
                    } else {
                        wanted.push((c, t, members));
                    }
                }
            }
        }
        let clusters = merge(wanted, tree, &mut augmented);
        augmented.sort();
        Self::lay_out(tree, clusters, closures, couplings, augmented)
    }

    fn lay_out(
        tree: &Tree,
        clusters: Vec<(BTreeSet<u32>, Vec<ConstraintId>)>,
        closures: Vec<Closure>,
        couplings: Vec<Vec<(u32, u32, f64)>>,
        augmented: Vec<ConstraintId>,
    ) -> Self {
        let n = tree.slots();
        let mut cluster_of: BTreeMap<u32, usize> = BTreeMap::new();
        for (i, (links, _)) in clusters.iter().enumerate() {
            cluster_of.extend(links.iter().map(|k| (*k, i)));
        }
        let mut out = Self {
            units: Vec::new(),
            aggregates: Vec::new(),
            inward: vec![Inward::default(); n],
            of_slot: vec![0; n],
            member: vec![0; n],
            first: Vec::new(),
            independent: 0,
            writes: Vec::new(),
            root: vec![0; n],
            closures,
            couplings,
            augmented,
            embedded: clusters.iter().flat_map(|c| c.1.iter().copied()).collect(),
        };
        out.embedded.sort();
        let mut nw = 0;
        for step in tree.steps() {
            let unit = out.units.len() as u32;
            let k = match step {
                Step::Link(k) => k,
                Step::Set(i) => {
                    nw += out.modes(tree, i, nw);
                    continue;
                }
            };
            let (link, slot) = (&tree.links[k], k as u32 + 1);
            let Some(cluster) = cluster_of.get(&slot) else {
                out.root[k + 1] = match link.parent {
                    0 => slot,
                    p => out.root[p as usize],
                };
                out.of_slot[k + 1] = unit;
                out.units.push(Unit::Link(k as u32));
                out.first.push(nw);
                nw += link.kind.nv() as u32;
                continue;
            };
            let (links, constraints) = &clusters[*cluster];
            if links.first() != Some(&slot) {
                continue;
            }
            let links: Vec<u32> = links.iter().copied().collect();
            let (mut dofs, mut first, mut inner) = (Vec::new(), Vec::new(), Vec::new());
            for (place, s) in links.iter().enumerate() {
                let l = &tree.links[*s as usize - 1];
                first.push(dofs.len() as u32);
                dofs.extend(l.v..l.v + l.kind.nv() as u32);
                inner.push(links.binary_search(&l.parent).ok().map(|p| p as u32));
                out.of_slot[*s as usize] = unit;
                out.member[*s as usize] = place as u32;
                out.root[*s as usize] = match link.parent {
                    0 => slot,
                    p => out.root[p as usize],
                };
            }
            let rows = constraints.iter().map(|c| tree.multibody().rows(*c)).sum();
            out.units.push(Unit::Aggregate(out.aggregates.len() as u32));
            out.first.push(nw);
            nw += dofs.len() as u32;
            let constraints = constraints.clone();
            let parent = link.parent;
            out.aggregates.push(Aggregate { parent, links, inner, dofs, first, constraints, rows });
        }
        out.independent = nw as usize;
        let mut written = vec![false; n];
        out.writes = vec![false; out.units.len()];
        for unit in (0..out.units.len()).rev() {
            let parent = out.parent_slot(tree, unit) as usize;
            out.writes[unit] = !std::mem::replace(&mut written[parent], true);
        }
        out.inward = (0..n).map(|slot| out.inward_at(tree, slot)).collect();
        out
    }

    fn inward_at(&self, tree: &Tree, slot: usize) -> Inward {
        if slot == 0 {
            return Inward::default();
        }
        let unit = self.of_slot[slot] as usize;
        let first = self.first[unit];
        let k = match self.units[unit] {
            Unit::Link(k) => k as usize,
            Unit::Aggregate(i) => {
                let parent = self.aggregates[i as usize].parent;
                return Inward { first, parent, ..Inward::default() };
            }
        };
        let link = &tree.links[k];
        let n = link.kind.nv() as u32;
        let through = match link.coordinate {
            _ if floating::floats(link) => Through::Floating,
            Coordinate::Free => Through::Free(n),
            Coordinate::Prescribed => Through::Prescribed(n),
        };
        Inward { through, v: link.v, first, parent: link.parent }
    }

    /// Adds the modes of a flexible body as a unit; returns their number.
    fn modes(&mut self, tree: &Tree, set: usize, nw: u32) -> u32 {
        let Some(flex) = tree.flexible.as_deref() else { return 0 };
        let set = &flex.sets[set];
        if set.first == set.end {
            return 0;
        }
        let links: Vec<u32> = (set.first..set.end).map(|s| flex.slot(s) as u32).collect();
        for (place, slot) in links.iter().enumerate() {
            self.of_slot[*slot as usize] = self.units.len() as u32;
            self.member[*slot as usize] = place as u32;
            self.root[*slot as usize] = match set.base {
                0 => links[0],
                p => self.root[p as usize],
            };
        }
        self.units.push(Unit::Aggregate(self.aggregates.len() as u32));
        self.first.push(nw);
        self.aggregates.push(Aggregate {
            parent: set.base,
            inner: vec![None; links.len()],
            first: vec![0; links.len()],
            dofs: (set.v..set.v + set.n).map(|v| v as u32).collect(),
            constraints: Vec::new(),
            rows: 0,
            links,
        });
        set.n as u32
    }

    /// Returns the body to which each independent rate belongs, in the order of [`RowSet::dof`]. An aggregate is represented by its first body.
    /// O(bodies).
    #[must_use]
    pub fn bodies_of_rates(&self, tree: &Tree) -> Vec<BodyId> {
        let ids: Vec<BodyId> = tree.multibody().body_ids().collect();
        let mut out = Vec::with_capacity(self.independent);
        let all = self.independent as u32;
        let ends = self.first.iter().skip(1).chain([&all]);
        for (unit, end) in self.units.iter().zip(ends) {
            let slot = match unit {
                Unit::Link(k) => *k as usize + 1,
                Unit::Aggregate(i) => self.aggregates[*i as usize].links[0] as usize,
            };
            out.resize(*end as usize, ids[tree.body_of(slot)]);
        }
        out.reverse();
        out
    }

    /// Returns the embedded constraints.
    #[must_use]
    pub fn embedded(&self) -> &[ConstraintId] {
        &self.embedded
    }

    /// Returns the constraints that are treated as rows.
    #[must_use]
    pub fn augmented(&self) -> &[ConstraintId] {
        &self.augmented
    }

    /// Returns the names of the bodies whose hinges each aggregate contains, for messages and listings. The modes of a flexible body are an aggregate
    /// of that body alone.
    #[must_use]
    pub fn aggregates(&self, tree: &Tree) -> Vec<Vec<String>> {
        let name = |s: &u32| tree.multibody().bodies()[tree.body_of(*s as usize)].name().to_owned();
        self.aggregates
            .iter()
            .map(|a| {
                let mut names: Vec<String> = a.links.iter().map(name).collect();
                names.dedup();
                names
            })
            .collect()
    }

    /// Returns the number of independent rates, counting all members of aggregates: the length of `y`.
    #[must_use]
    pub fn independent(&self) -> usize {
        self.independent
    }

    /// Returns true if rows of two constraints can be coupled, because some unit lies inboard of both.
    #[must_use]
    pub fn meet(&self, tree: &Tree, a: ConstraintId, b: ConstraintId) -> bool {
        let (a, b) = (self.way(tree, a), self.way(tree, b));
        !a.is_disjoint(&b)
    }

    /// Returns every unit from the ends of a constraint to the base.
    fn way(&self, tree: &Tree, c: ConstraintId) -> BTreeSet<u32> {
        let mut slots: Vec<u32> = match c {
            ConstraintId::Loop(i) => self.closures[i as usize].slots.to_vec(),
            ConstraintId::Coupling(i) => self.couplings[i as usize].iter().map(|t| t.0).collect(),
        };
        let mut out = BTreeSet::new();
        while let Some(slot) = slots.pop() {
            if slot != 0 {
                let unit = self.of_slot[slot as usize];
                if out.insert(unit) {
                    slots.push(self.parent_slot(tree, unit as usize));
                }
            }
        }
        out
    }

    /// Returns the slot on which a unit hangs.
    pub(crate) fn parent_slot(&self, tree: &Tree, unit: usize) -> u32 {
        match self.units[unit] {
            Unit::Link(k) => tree.links[k as usize].parent,
            Unit::Aggregate(i) => self.aggregates[i as usize].parent,
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Ends {
    /// The link itself moves with the end.
    Bodies,
    /// The rows refer to the hinge of a link, so the link is always a member.
    Hinges,
}

/// Returns the links on the paths from the given ones to where all paths meet.
fn members(tree: &Tree, slots: &[u32], ends: Ends) -> BTreeSet<u32> {
    let parent = |s: u32| tree.inboard_of(s as usize) as u32;
    let way = |s: u32| {
        let mut way = vec![s];
        while let Some(last) = way.last().copied().filter(|s| *s != 0) {
            way.push(parent(last));
        }
        way
    };
    let ways: Vec<Vec<u32>> = slots.iter().map(|s| way(*s)).collect();
    let starts: Vec<&[u32]> = match ends {
        Ends::Bodies => ways.iter().map(|w| &w[..]).collect(),
        Ends::Hinges => ways.iter().map(|w| w.get(1..).unwrap_or(&[0])).collect(),
    };
    // Find the outermost slot on all paths.
    let meets = (starts.first().copied().unwrap_or(&[]).iter())
        .find(|s| starts.iter().all(|w| w.contains(s)))
        .copied()
        .unwrap_or(0);
    ways.iter().flat_map(|w| w.iter().copied().take_while(|s| *s != meets)).collect()
}

/// Returns the slots whose hinge moves nothing that has inertia in the tree; sweeps over the tree alone cannot determine their accelerations.
fn massless(tree: &Tree) -> BTreeSet<u32> {
    let mut solid = vec![false; tree.slots()];
    // Iterate in reverse, because outboard links have higher indices.
    for (k, link) in tree.links.iter().enumerate().rev() {
        let J = [link.J.xx, link.J.yy, link.J.zz];
        solid[k + 1] |= link.m > 0.0 || J.iter().any(|x| *x > 0.0);
        if solid[k + 1] {
            solid[link.parent as usize] = true;
        }
    }
    // Bodies on a flexible body are outboard of one of its stations; loops through these always
    // become rows.
    let free = |l: &Link| l.coordinate == Coordinate::Free && l.armature == 0.0 && l.kind.nv() > 0;
    let links = tree.links.iter().enumerate();
    links.filter(|(k, l)| free(l) && !solid[k + 1]).map(|(k, _)| k as u32 + 1).collect()
}

/// Joins constraints that share a link; aggregates that are too large for [`ConstraintMethod::Auto`] become rows.
fn merge(
    wanted: Vec<(ConstraintId, ConstraintMethod, BTreeSet<u32>)>,
    tree: &Tree,
    augmented: &mut Vec<ConstraintId>,
) -> Vec<(BTreeSet<u32>, Vec<ConstraintId>)> {
    type Cluster = (BTreeSet<u32>, Vec<(ConstraintId, ConstraintMethod)>);
    let mut clusters: Vec<Cluster> = Vec::new();
    for (c, t, mut links) in wanted {
        let mut all = vec![(c, t)];
        clusters.retain_mut(|(other, constraints)| {
            let apart = other.is_disjoint(&links);
            if !apart {
                links.append(other);
                all.append(constraints);
            }
            apart
        });
        clusters.push((links, all));
    }
    let dofs = |links: &BTreeSet<u32>| -> usize {
        links.iter().map(|s| tree.links[*s as usize - 1].kind.nv()).sum()
    };
    let massless = massless(tree);
    let mut out = Vec::new();
    for (links, mut constraints) in clusters {
        constraints.sort_by_key(|c| c.0);
        let forced = constraints.iter().any(|c| c.1 == ConstraintMethod::Embed)
            || links.iter().any(|slot| massless.contains(slot));
        let ids: Vec<ConstraintId> = constraints.iter().map(|c| c.0).collect();
        if !forced && dofs(&links) > EMBED_MAX {
            augmented.extend(ids);
        } else if !links.is_empty() {
            out.push((links, ids));
        } else {
            // Both ends are on one link, so this row has no rate. The augmented solver reports it.
            augmented.extend(ids);
        }
    }
    out
}
