//! Collision rules: which pairs of colliders are checked. They depend on groups, on bodies joined by hinges and loops, on lists of names, and on sets
//! of bodies that are not checked against each other.

use crate::error::ColliderFault;
use crate::shape::{ColliderSpec, Neighbours, OnTerrain, PairLaw, Rules};
use linkwork_multibody::Multibody;
use linkwork_names::nearest;
use std::collections::BTreeSet;

/// The name of the world.
pub(crate) const WORLD: &str = "world";

/// The collider that a runtime adds for the ground, and the name of its material. It is on the world, but is still checked against bodies that a
/// hinge joins to the world. Rules may refer to it before it exists.
pub const TERRAIN: &str = "terrain";

/// Returns the names of each entry.
fn names<E: AsRef<[String]>>(entries: &[E]) -> Vec<Vec<&str>> {
    entries.iter().map(|e| e.as_ref().iter().map(String::as_str).collect()).collect()
}

/// Returns faults for names in the rules that do not exist.
pub(crate) fn unknown(
    rules: &Rules,
    specs: &[ColliderSpec],
    multibody: &Multibody,
) -> Vec<ColliderFault> {
    let bodies = || multibody.bodies().iter().map(|b| b.name()).chain([WORLD]);
    let mut faults = Vec::new();
    let lists = [("ignore", &rules.ignore), ("collide", &rules.collide), ("joined", &rules.joined)];
    let (pairs, machines) = (lists.map(|(list, pairs)| (list, names(pairs))), names(&rules.apart));
    for (list, entries) in pairs.into_iter().chain([("apart", machines)]) {
        let of_bodies = ["joined", "apart"].contains(&list);
        let shapes = || specs.iter().map(|s| s.name.as_str()).filter(|_| !of_bodies);
        for (index, entry) in entries.into_iter().enumerate() {
            for name in entry {
                let ground = name == TERRAIN && !of_bodies;
                if !ground && !bodies().chain(shapes()).any(|n| n == name) {
                    let suggestion = nearest(name, bodies().chain(shapes())).map(str::to_owned);
                    faults.push(ColliderFault::UnknownName {
                        list,
                        index,
                        name: name.to_owned(),
                        suggestion,
                    });
                }
            }
        }
    }
    faults
}

/// Returns faults for pair laws with an unknown material or an invalid number.
pub(crate) fn laws(rules: &Rules, specs: &[ColliderSpec]) -> Vec<ColliderFault> {
    let named = || specs.iter().filter_map(|s| s.material_name.as_deref()).chain([TERRAIN]);
    let mut faults = Vec::new();
    for (index, law) in rules.laws.iter().enumerate() {
        for name in law.materials.iter().filter(|n| !named().any(|m| m == n.as_str())) {
            let suggestion = nearest(name, named()).map(str::to_owned);
            faults.push(ColliderFault::UnknownMaterial { index, name: name.clone(), suggestion });
        }
        let numbers = [
            ("friction", law.friction),
            ("restitution", law.restitution),
            ("rolling friction", law.rolling),
            ("spinning friction", law.spinning),
        ];
        for (what, value) in numbers {
            if let Some(value) = value.filter(|v| !(*v >= 0.0 && v.is_finite())) {
                faults.push(ColliderFault::LawNumber { index, what, value });
            }
        }
    }
    faults
}

/// Returns, for each pair of colliders, row after row, the index of its law, from 1 on; 0: none. Empty without laws.
pub(crate) fn law_table(rules: &Rules, specs: &[&ColliderSpec]) -> Vec<u16> {
    if rules.laws.is_empty() {
        return Vec::new();
    }
    let of = |a: &ColliderSpec, b: &ColliderSpec| {
        let (a, b) = (a.material_name.as_ref()?, b.material_name.as_ref()?);
        let fits = |law: &PairLaw| {
            let [p, q] = &law.materials;
            (p == a && q == b) || (p == b && q == a)
        };
        rules.laws.iter().position(fits)
    };
    let law = |a, b| of(a, b).map_or(0, |k| u16::try_from(k + 1).unwrap_or(0));
    specs.iter().flat_map(|a| specs.iter().map(move |b| law(a, b))).collect()
}

/// Returns the rigid groups: for each body (the world last) the first body of the group that is welded together.
#[must_use]
pub fn groups(multibody: &Multibody) -> Vec<usize> {
    groups_with(multibody, &[])
}

/// Like [`groups`], but bodies named in `welded` also count as welded to their parents.
fn groups_with(multibody: &Multibody, welded: &[String]) -> Vec<usize> {
    let world = multibody.bodies().len();
    let mut group: Vec<usize> = (0..=world).collect();
    for (i, body) in multibody.bodies().iter().enumerate() {
        if body.v().is_empty() || welded.iter().any(|name| name == body.name()) {
            group[i] = group[body.parent().map_or(world, |p| p.index())]; // parents come first
        }
    }
    group
}

/// Returns the pairs of [`groups`] that a hinge with fewer than six degrees of freedom joins.
#[must_use]
pub fn neighbours(multibody: &Multibody) -> Vec<(usize, usize)> {
    joined(multibody, &groups(multibody))
}

fn joined(multibody: &Multibody, group: &[usize]) -> Vec<(usize, usize)> {
    let world = multibody.bodies().len();
    let bodies = multibody.bodies().iter().enumerate();
    let joined = bodies.filter(|(_, b)| (1..6).contains(&b.v().len()));
    joined.map(|(i, b)| (group[i], group[b.parent().map_or(world, |p| p.index())])).collect()
}

/// Returns, for each pair of colliders, row after row, whether it would be checked if no hinge joined their bodies.
pub(crate) fn without_hinges(
    rules: &Rules,
    specs: &[&ColliderSpec],
    bodies: &[usize],
    multibody: &Multibody,
) -> Vec<bool> {
    let open = Rules { neighbours: Neighbours::Collide, ..rules.clone() };
    table(&open, specs, bodies, multibody)
}

/// Returns, for each pair of colliders, row after row, whether it is checked.
pub(crate) fn table(
    rules: &Rules,
    specs: &[&ColliderSpec],
    bodies: &[usize],
    multibody: &Multibody,
) -> Vec<bool> {
    let world = multibody.bodies().len();
    let group = groups_with(multibody, &rules.welded);
    let place = |name: &str| {
        if name == WORLD { Some(world) } else { multibody.body(name).map(|b| b.index()) }
    };
    let loops = rules.joined.iter().filter_map(|[a, b]| Some((group[place(a)?], group[place(b)?])));
    // Pairs are listed in both orders, because the loop below looks up each pair of colliders.
    let joined: BTreeSet<(usize, usize)> = (joined(multibody, &group).into_iter().chain(loops))
        .flat_map(|(p, q)| [(p, q), (q, p)])
        .collect();
    // These are the `apart` lists to which each collider belongs.
    let apart: Vec<Vec<usize>> = (specs.iter())
        .map(|s| {
            let of = rules.apart.iter().enumerate().filter(|(_, bodies)| bodies.contains(&s.body));
            of.map(|(machine, _)| machine).collect()
        })
        .collect();
    let n = specs.len();
    let mut meets = vec![false; n * n];
    for i in 0..n {
        for j in 0..n {
            let (a, b) = (specs[i], specs[j]);
            let (ga, gb) = (group[bodies[i]], group[bodies[j]]);
            let is = |s: &ColliderSpec, name: &str| {
                s.name == name || (s.body == name && specs.iter().all(|o| o.name != name))
            };
            let listed = |list: &[[String; 2]]| {
                list.iter().any(|[p, q]| (is(a, p) && is(b, q)) || (is(a, q) && is(b, p)))
            };
            let ground = [a, b].iter().any(|s| s.name == TERRAIN && s.body == WORLD);
            let neighbours =
                rules.neighbours == Neighbours::Pass && !ground && joined.contains(&(ga, gb));
            let pass = neighbours || apart[i].iter().any(|machine| apart[j].contains(machine));
            let pass = pass && !listed(&rules.collide);
            let passes = ground && [a, b].iter().any(|s| s.terrain == OnTerrain::Pass);
            let groups = a.groups & b.collides_with != 0 && b.groups & a.collides_with != 0;
            meets[i * n + j] = ga != gb && groups && !pass && !passes && !listed(&rules.ignore);
        }
    }
    meets
}
