//! Constraint islands: groups of rows that share degrees of freedom, found in every step.
//!
//! ```text
//! nodes    trees of bodies that hang on the world; those that loops and couplings connect are one node
//! edges    contacts between two trees
//! island   the groups of rows on a connected set of nodes; no two islands share an entry of E
//! ```
//! Each island is a separate problem with rates numbered from 0, so its result does not depend on the other islands.
//! The ground and prescribed bodies have zero rates, so they do not connect islands. A mechanism with one node is one island, for which nothing is
//! copied.

use crate::contact::{Cone, Factor, room};
use linkwork_collision::ContactPoint;
use linkwork_dynamics::Tree;
use linkwork_dynamics::units::{RowSet, Units, WIDTH};
use linkwork_multibody::{BodyId, ConstraintId, Multibody};

/// Marks bodies and groups without node or island.
const NONE: u32 = u32::MAX;

/// The nodes of a mechanism, and the islands of a step.
#[derive(Clone, Debug, Default)]
pub(super) struct Islands {
    /// Node of each body; [`NONE`] for a body without rates.
    node_of_body: Vec<u32>,
    /// Node of each independent rate, and of each constraint.
    node_of_rate: Vec<u32>,
    node_of_constraint: Vec<u32>,
    nodes: usize,
    /// Union–find over nodes.
    parent: Vec<u32>,
    /// Node of each group, then its island.
    of_group: Vec<u32>,
    island_of_node: Vec<u32>,
    count: usize,
    /// Groups by island, and first index of each island; rates likewise.
    order: Vec<u32>,
    first: Vec<usize>,
    rates: Vec<u32>,
    first_rate: Vec<usize>,
    /// Index of each rate within its island.
    local: Vec<u32>,
    /// Rows of one island.
    start: Vec<u32>,
    dof: Vec<u32>,
    e: Vec<[f64; WIDTH]>,
    pub cones: Vec<Cone>,
    pub b: Vec<[f64; WIDTH]>,
    pub lambda: Vec<[f64; WIDTH]>,
}

/// Returns the tree to which a body belongs.
fn root(mbs: &Multibody, body: BodyId) -> usize {
    mbs.ancestors(body).last().unwrap_or(body).index()
}

impl Islands {
    pub fn new(tree: &Tree, units: &Units) -> Self {
        let mbs = tree.multibody();
        let mut out = Self { parent: (0..mbs.bodies().len() as u32).collect(), ..Self::default() };
        let couples = |c: ConstraintId| -> Vec<BodyId> {
            match c {
                ConstraintId::Loop(i) => {
                    let l = &mbs.loops()[i as usize];
                    [l.a.body, l.b.body].into_iter().flatten().collect()
                }
                ConstraintId::Coupling(i) => mbs.couplings()[i as usize].bodies.clone(),
            }
        };
        for c in mbs.constraints() {
            let ends = couples(c);
            for pair in ends.windows(2) {
                out.join(root(mbs, pair[0]) as u32, root(mbs, pair[1]) as u32);
            }
        }
        // Nodes are numbered in the order of their first rate.
        let mut number = vec![NONE; mbs.bodies().len()];
        let mut node = |out: &mut Self, body: BodyId| {
            let at = out.find(root(mbs, body) as u32) as usize;
            if number[at] == NONE {
                number[at] = out.nodes as u32;
                out.nodes += 1;
            }
            number[at]
        };
        for body in units.bodies_of_rates(tree) {
            let n = node(&mut out, body);
            out.node_of_rate.push(n);
        }
        for body in mbs.body_ids() {
            let at = out.find(root(mbs, body) as u32) as usize;
            out.node_of_body.push(number[at]);
        }
        for c in mbs.constraints() {
            let of = |b: &BodyId| out.node_of_body[b.index()];
            out.node_of_constraint.push(couples(c).iter().map(of).min().unwrap_or(NONE));
        }
        // With one node, the single island never changes and keeps the original indices.
        let rates = out.node_of_rate.len();
        out.local = (0..rates as u32).collect();
        out.rates = out.local.clone();
        out.first_rate = vec![0, rates];
        out
    }

    fn find(&mut self, mut a: u32) -> u32 {
        while self.parent[a as usize] != a {
            let up = self.parent[self.parent[a as usize] as usize];
            self.parent[a as usize] = up;
            a = up;
        }
        a
    }

    /// Joins two nodes; the lower number becomes the root.
    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// Begins a step.
    pub fn begin(&mut self) {
        self.of_group.clear();
        if self.nodes > 1 {
            self.parent.clear();
            self.parent.extend(0..self.nodes as u32);
        }
    }

    /// Adds a group of the constraint at this index.
    pub fn constraint(&mut self, place: usize) {
        self.of_group.push(self.node_of_constraint[place]);
    }

    /// Adds a group of a contact point.
    pub fn contact(&mut self, p: &ContactPoint) {
        let node = |b: Option<BodyId>| b.map_or(NONE, |b| self.node_of_body[b.index()]);
        let (a, b) = (node(p.body_a), node(p.body_b));
        if a != NONE && b != NONE && a != b {
            self.join(a, b);
        }
        self.of_group.push(a.min(b));
    }

    /// Adds a group of a hinge of this body.
    pub fn hinge(&mut self, body: Option<BodyId>) {
        self.of_group.push(body.map_or(NONE, |b| self.node_of_body[b.index()]));
    }

    /// Finds the islands of the added groups.
    pub fn find_all(&mut self) {
        self.count = 0;
        let groups = self.of_group.len();
        if self.nodes <= 1 {
            self.of_group.fill(0);
            self.count = usize::from(groups > 0);
            self.order.clear();
            self.order.extend(0..groups as u32);
            self.first.clear();
            self.first.extend([0, groups]);
            return;
        }
        self.island_of_node.clear();
        self.island_of_node.resize(self.nodes, NONE);
        for g in 0..groups {
            // A group that nothing can move is a separate island.
            let island = match self.of_group[g] {
                NONE => NONE,
                node => {
                    let root = self.find(node) as usize;
                    if self.island_of_node[root] == NONE {
                        self.island_of_node[root] = self.count as u32;
                        self.count += 1;
                    }
                    self.island_of_node[root]
                }
            };
            self.of_group[g] = island;
            if island == NONE {
                self.of_group[g] = self.count as u32;
                self.count += 1;
            }
        }
        self.sort();
    }

    /// Sorts groups and rates by island, each in ascending order.
    fn sort(&mut self) {
        let (islands, groups) = (self.count, self.of_group.len());
        // A step may have more islands than any before it, but not more nodes.
        room(&mut self.first, self.nodes + 2);
        room(&mut self.first_rate, self.nodes + 2);
        self.first.clear();
        self.first.resize(islands + 1, 0);
        self.of_group.iter().for_each(|i| self.first[*i as usize + 1] += 1);
        (0..islands).for_each(|i| self.first[i + 1] += self.first[i]);
        self.order.clear();
        self.order.resize(groups, 0);
        for g in (0..groups).rev() {
            let end = &mut self.first[self.of_group[g] as usize + 1];
            *end -= 1;
            self.order[*end] = g as u32;
        }
        // Each entry now is the beginning of the previous island.
        self.first.remove(0);
        self.first.push(groups);
        self.first_rate.clear();
        self.first_rate.resize(islands + 1, 0);
        for d in 0..self.node_of_rate.len() {
            let root = self.find(self.node_of_rate[d]) as usize;
            let island = self.island_of_node[root];
            if island != NONE {
                let n = &mut self.first_rate[island as usize + 1];
                self.local[d] = *n as u32;
                *n += 1;
            }
        }
        (0..islands).for_each(|i| self.first_rate[i + 1] += self.first_rate[i]);
        self.rates.clear();
        self.rates.resize(self.first_rate[islands], 0);
        for d in 0..self.node_of_rate.len() {
            let root = self.find(self.node_of_rate[d]) as usize;
            let island = self.island_of_node[root];
            if island != NONE {
                self.rates[self.first_rate[island as usize] + self.local[d] as usize] = d as u32;
            }
        }
    }

    /// Returns whether more than one island is possible.
    pub fn several(&self) -> bool {
        self.nodes > 1
    }

    /// Returns the index of a rate within its island.
    pub fn local(&self, rate: u32) -> u32 {
        self.local[rate as usize]
    }

    /// Returns the number of islands in this step.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Returns the island of each group.
    pub fn of_group(&self) -> &[u32] {
        &self.of_group
    }

    /// Returns the groups of an island, ascending.
    pub fn groups(&self, island: usize) -> &[u32] {
        &self.order[self.first[island]..self.first[island + 1]]
    }

    /// Returns the rates of an island by their index in it.
    pub fn rates(&self, island: usize) -> &[u32] {
        &self.rates[self.first_rate[island]..self.first_rate[island + 1]]
    }

    /// Copies the factor of an island's groups, the first `lanes` rows of each. Clears cones, b and λ for the caller.
    pub fn copy(&mut self, rows: &RowSet, island: usize, lanes: impl Fn(usize) -> usize) {
        let (groups, entries) = (rows.groups().len(), rows.e().len());
        self.start.clear();
        room(&mut self.start, groups + 1);
        self.start.push(0);
        self.dof.clear();
        room(&mut self.dof, entries);
        self.e.clear();
        room(&mut self.e, entries);
        self.cones.clear();
        room(&mut self.cones, groups);
        self.b.clear();
        room(&mut self.b, groups);
        self.lambda.clear();
        room(&mut self.lambda, groups);
        for i in self.first[island]..self.first[island + 1] {
            let g = self.order[i] as usize;
            let range = rows.start()[g] as usize..rows.start()[g + 1] as usize;
            self.dof.extend(rows.dof()[range.clone()].iter().map(|d| self.local[*d as usize]));
            match lanes(g) {
                WIDTH => self.e.extend_from_slice(&rows.e()[range]),
                n => self.e.extend(rows.e()[range].iter().map(|e| first_lanes(e, n))),
            }
            self.start.push(self.dof.len() as u32);
        }
    }

    /// Returns the factor that was copied last.
    pub fn factor(&self, island: usize) -> Factor<'_> {
        let dofs = self.first_rate[island + 1] - self.first_rate[island];
        Factor { start: &self.start, dof: &self.dof, e: &self.e, dofs }
    }
}

/// Returns the first `n` numbers, then zeros.
pub(super) fn first_lanes(e: &[f64; WIDTH], n: usize) -> [f64; WIDTH] {
    std::array::from_fn(|k| if k < n { e[k] } else { 0.0 })
}
