//! Rows: constraints that stay outside the units, as a factor of their compliance.
//!
//! A row is a wrench on one or two links, or factors of hinge coordinates. Its unit force runs inward
//! over the units of a factored tree ([`Units::gather`]):
//! ```text
//! ε = c − S · z,   e = D^{−1/2} ε,   z⁺ = z + G ε            W = E E*   (E: a row's e side by side)
//! J β̇ = E e_f + Σ ε β̇ (prescribed) − z · A (aggregates)      e_f: of the applied forces
//! ```
//! So neither J nor M⁻¹ is formed, and no sweep is made for any row: the forces λ enter one scatter
//! as y = E*λ. Where the two ways of a row meet, its wrenches meet.

use super::{Unit, Units, UnitsWork};
use crate::linear::{V3, V6};
use crate::query::v3;
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::{BodyId, ConstraintId, Coordinate, LoopMotion};
use linkwork_spatial::Vec3;
use wide::f64x4;

/// Part of the bound of its diagonal entry below which a row is nothing.
const ROUNDING: f64 = 1e-20;

/// The most rows side by side.
pub const WIDTH: usize = 4;

/// A group of up to four rows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Row {
    /// How many.
    pub n: usize,
    /// What the rows measure: d of a constraint, rad or m; zero for a contact.
    pub error: [f64; WIDTH],
    /// Its rate J β at the present state.
    pub rate: [f64; WIDTH],
    /// J β̇ of the applied forces alone, without J̇ β.
    pub free: [f64; WIDTH],
    /// J̇ β.
    pub bias: [f64; WIDTH],
    /// A bound of W's diagonal, from the sizes of wrenches and columns that meet: against it a row
    /// that is left of terms that cancel counts as nothing.
    pub gross: [f64; WIDTH],
}

/// Rows and their factor E: [`RowSet::clear`], then add; it keeps its memory.
#[derive(Clone, Debug, Default)]
pub struct RowSet {
    start: Vec<u32>,
    dof: Vec<u32>,
    e: Vec<[f64; WIDTH]>,
    groups: Vec<Row>,
    /// What reaches prescribed dofs: group, place in β, ε.
    held: Vec<(u32, u32, [f64; WIDTH])>,
    /// What reaches members of aggregates: group, slot, z about the member's origin.
    held_ends: Vec<(u32, u32, V6<f64x4>)>,
    /// Factors on members' dofs: group, unit, place among the members' dofs, c.
    held_terms: Vec<(u32, u32, u32, f64x4)>,
    independent: usize,
    ends: Vec<(u32, V6<f64x4>)>,
    terms: Vec<(u32, u32, f64x4)>,
}

impl RowSet {
    /// Forgets all rows.
    pub fn clear(&mut self) {
        self.start.clear();
        self.start.push(0);
        self.dof.clear();
        self.e.clear();
        self.held.clear();
        self.held_ends.clear();
        self.held_terms.clear();
        self.groups.clear();
    }

    /// First entry of each group; one more number than groups.
    #[must_use]
    pub fn start(&self) -> &[u32] {
        &self.start
    }

    /// Independent rate of each entry, ascending within a group; tips come first.
    #[must_use]
    pub fn dof(&self) -> &[u32] {
        &self.dof
    }

    /// Entries of E: one number for each row of the group.
    #[must_use]
    pub fn e(&self) -> &[[f64; WIDTH]] {
        &self.e
    }

    /// The groups.
    #[must_use]
    pub fn groups(&self) -> &[Row] {
        &self.groups
    }

    /// Independent rates of the units.
    #[must_use]
    pub fn independent(&self) -> usize {
        self.independent
    }

    /// Rows of all groups.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.groups.iter().map(|g| g.n).sum()
    }

    /// Adds E*λ of one group to `y`.
    pub fn pull(&self, group: usize, lambda: &[f64; WIDTH], y: &mut [f64]) {
        let range = self.start[group] as usize..self.start[group + 1] as usize;
        for (dof, e) in self.dof[range.clone()].iter().zip(&self.e[range]) {
            let sum = e[0] * lambda[0] + e[1] * lambda[1] + (e[2] * lambda[2] + e[3] * lambda[3]);
            y[*dof as usize] += sum;
        }
    }

    /// Adds E y of one group to `v`: what a motion `y` of the independent rates does to its rows.
    pub fn push(&self, group: usize, y: &[f64], v: &mut [f64; WIDTH]) {
        let range = self.start[group] as usize..self.start[group + 1] as usize;
        for (dof, e) in self.dof[range.clone()].iter().zip(&self.e[range]) {
            for (v, e) in v.iter_mut().zip(e) {
                *v += e * y[*dof as usize];
            }
        }
    }

    /// Empties the rows that are rounding: what is left of E where everything in a row cancels, as in
    /// the three of five rows that a planar loop in space does not need. A solver that divides by W
    /// would else divide rounding by rounding.
    pub fn silence_rounding(&mut self) {
        for (g, row) in self.groups.iter().enumerate() {
            let range = self.start[g] as usize..self.start[g + 1] as usize;
            let mut size = [0.0; WIDTH];
            for e in &self.e[range.clone()] {
                size.iter_mut().zip(e).for_each(|(s, e)| *s += e * e);
            }
            for lane in 0..row.n {
                if size[lane] <= ROUNDING * row.gross[lane] {
                    self.e[range.clone()].iter_mut().for_each(|e| e[lane] = 0.0);
                }
            }
        }
    }

    /// Says what the last group's first row measures: a gap, rad or m.
    pub fn set_error(&mut self, error: f64) {
        if let Some(row) = self.groups.last_mut() {
            row.error[0] = error;
        }
    }

    /// Takes what the rows' forces λ (by group) hold at prescribed coordinates off the forces that
    /// [`Units::scatter`] has found there, and gives aggregates their share before
    /// [`Units::constraint_forces`].
    pub fn relieve(
        &self,
        units: &Units,
        uw: &mut UnitsWork,
        lambda: impl Fn(usize) -> [f64; WIDTH],
        tau: &mut [f64],
    ) {
        for (group, v, e) in &self.held {
            let x = lambda(*group as usize);
            tau[*v as usize] -= e[0] * x[0] + e[1] * x[1] + (e[2] * x[2] + e[3] * x[3]);
        }
        for (group, slot, z) in &self.held_ends {
            let Unit::Aggregate(i) = units.units[units.of_slot[*slot as usize] as usize] else {
                continue;
            };
            let x = f64x4::new(lambda(*group as usize));
            let sum = |a: &V3<f64x4>| {
                V3::new((a.x * x).reduce_add(), (a.y * x).reduce_add(), (a.z * x).reduce_add())
            };
            let to = &mut uw.embedded[i as usize].z[units.member[*slot as usize] as usize];
            *to = *to + V6 { n: sum(&z.n), f: sum(&z.f) };
        }
        for (group, unit, d, c) in &self.held_terms {
            if let Unit::Aggregate(i) = units.units[*unit as usize] {
                let x = f64x4::new(lambda(*group as usize));
                uw.embedded[i as usize].tau[*d as usize] += (*c * x).reduce_add();
            }
        }
    }

    /// The block W_gh = Σ e_g e_h* of two groups, row after row.
    #[must_use]
    pub fn block(&self, g: usize, h: usize) -> [[f64; WIDTH]; WIDTH] {
        let range = |g: usize| self.start[g] as usize..self.start[g + 1] as usize;
        let (a, b) = (range(g), range(h));
        let (da, db) = (&self.dof[a.clone()], &self.dof[b.clone()]);
        let (ea, eb) = (&self.e[a], &self.e[b]);
        let mut out = [f64x4::splat(0.0); WIDTH];
        let (mut i, mut j) = (0, 0);
        while i < da.len() && j < db.len() {
            match da[i].cmp(&db[j]) {
                std::cmp::Ordering::Less => i += 1,
                std::cmp::Ordering::Greater => j += 1,
                std::cmp::Ordering::Equal => {
                    let right = f64x4::new(eb[j]);
                    for (out, x) in out.iter_mut().zip(ea[i]) {
                        *out = f64x4::splat(x).mul_add(right, *out);
                    }
                    i += 1;
                    j += 1;
                }
            }
        }
        out.map(|row| row.to_array())
    }

    /// Adds the rows of a constraint at the state of the last [`Units::gather`]: two groups where it
    /// has more than four.
    pub fn add_constraint(
        &mut self,
        tree: &Tree,
        units: &Units,
        ws: &Workspace,
        uw: &UnitsWork,
        constraint: ConstraintId,
        motions: &[LoopMotion],
        (q, v): (&[f64], &[f64]),
    ) {
        match constraint {
            ConstraintId::Loop(i) => {
                let c = &units.closures[i as usize];
                let rows = c.rows(&ws.work.kin, &uw.r, &units.root, motions);
                // Five or six rows: three and the rest, which fills two blocks evenly.
                let split = if rows.n > WIDTH { 3 } else { rows.n };
                for range in [0..split, split..rows.n] {
                    if range.is_empty() {
                        continue;
                    }
                    let wrench = blocks(&rows.wrench[range.clone()]);
                    self.ends.clear();
                    for (end, slot) in [c.a.slot, c.b.slot].into_iter().enumerate() {
                        let arm = uw.r[slot as usize] + rows.arms[end];
                        // z is less the force.
                        let z = wrench.to_parent(arm.block());
                        self.end(slot, if end == 1 { minus(z) } else { z });
                    }
                    let mut row = Row { n: range.len(), ..Row::default() };
                    row.error[..range.len()].copy_from_slice(&rows.error[range.clone()]);
                    row.rate[..range.len()].copy_from_slice(&rows.rate[range.clone()]);
                    row.bias[..range.len()].copy_from_slice(&rows.bias[range.clone()]);
                    self.terms.clear();
                    self.walk(tree, units, uw, row);
                }
            }
            ConstraintId::Coupling(i) => {
                let coupling = &tree.multibody().couplings()[i as usize];
                let mut row = Row { n: 1, ..Row::default() };
                row.error[0] = -coupling.coupling.constant;
                self.ends.clear();
                self.terms.clear();
                for ((slot, _, _), (iq, iv, c)) in
                    units.couplings[i as usize].iter().zip(&coupling.terms)
                {
                    row.error[0] += c * q[*iq];
                    row.rate[0] += c * v[*iv];
                    self.term(*slot, *iv as u32, *c);
                }
                self.walk(tree, units, uw, row);
            }
        }
    }

    /// Adds one row on one hinge coordinate (place in q and β), with this factor: a limit, or friction
    /// in the hinge.
    pub fn add_coordinate(
        &mut self,
        tree: &Tree,
        units: &Units,
        uw: &UnitsWork,
        place: usize,
        factor: f64,
        rate: f64,
    ) {
        let slot = tree.dofs.link[place];
        self.ends.clear();
        self.terms.clear();
        self.term(slot, place as u32, factor);
        let mut row = Row { n: 1, ..Row::default() };
        row.rate[0] = factor * rate;
        self.walk(tree, units, uw, row);
    }

    /// Adds rows that measure the velocity of body `b` relative to body `a` at a point (m, world)
    /// along directions (unit vectors, world), three at most: a contact. `None` is the world. On a
    /// flexible body the point is glued to the nearest station that has mass or carries something,
    /// or to the body frame when that is nearer.
    pub fn add_point(
        &mut self,
        tree: &Tree,
        units: &Units,
        ws: &Workspace,
        uw: &UnitsWork,
        (a, b): (Option<BodyId>, Option<BodyId>),
        point: &Vec3,
        directions: &[Vec3],
    ) {
        self.add_wrenches(tree, units, ws, uw, (a, b), point, directions, &[]);
    }

    /// As [`RowSet::add_point`], then rows that measure relative angular velocity about axes.
    pub fn add_wrenches(
        &mut self,
        tree: &Tree,
        units: &Units,
        ws: &Workspace,
        uw: &UnitsWork,
        (a, b): (Option<BodyId>, Option<BodyId>),
        point: &Vec3,
        directions: &[Vec3],
        axes: &[Vec3],
    ) {
        let o = V3::default();
        let mut wrenches = [V6::default(); WIDTH];
        let n = directions.len() + axes.len();
        for (to, f) in wrenches.iter_mut().zip(directions) {
            *to = V6 { n: o, f: v3(f) };
        }
        for (to, m) in wrenches[directions.len()..].iter_mut().zip(axes) {
            *to = V6 { n: v3(m), f: o };
        }
        let wrench = blocks(&wrenches[..n]);
        let mut row = Row { n, ..Row::default() };
        self.ends.clear();
        self.terms.clear();
        for (body, sign) in [(a, -1.0), (b, 1.0)] {
            let slot = body.map_or(0, |b| tree.slot_near(&ws.work, b, point));
            let kin = &ws.work.kin[slot as usize];
            let arm = v3(point) - kin.p;
            let V = kin.V.to_child(arm);
            for (rate, w) in row.rate.iter_mut().zip(&wrenches[..n]) {
                *rate += sign * w.dot(&V);
            }
            let z = wrench.to_parent((uw.r[slot as usize] + arm).block());
            self.end(slot, if sign > 0.0 { minus(z) } else { z });
        }
        self.walk(tree, units, uw, row);
    }

    fn end(&mut self, slot: u32, z: V6<f64x4>) {
        if slot != 0 {
            self.ends.push((slot, z));
        }
    }

    fn term(&mut self, slot: u32, v: u32, factor: f64) {
        self.terms.push((slot, v, f64x4::new([factor, 0.0, 0.0, 0.0])));
        if !self.ends.iter().any(|e| e.0 == slot) {
            self.ends.push((slot, V6::default()));
        }
    }

    /// Inward over the units from the ends, the outermost unit first.
    fn walk(&mut self, tree: &Tree, units: &Units, uw: &UnitsWork, mut row: Row) {
        let (mut free, mut gross) = (f64x4::splat(0.0), f64x4::splat(0.0));
        self.independent = units.independent;
        let last = (units.independent as u32).wrapping_sub(1);
        while let Some(unit) = self.ends.iter().map(|e| units.of_slot[e.0 as usize]).max() {
            let first = units.first[unit as usize];
            let (ends, terms) = (&mut self.ends, &self.terms);
            let mut z = V6::default();
            match units.units[unit as usize] {
                Unit::Link(k) => {
                    let link = &tree.links[k as usize];
                    let reach = f64x4::splat(uw.reach[k as usize + 1]);
                    if let [(_, only)] = ends[..] {
                        gross = square(&only).mul_add(reach, gross);
                        z = only;
                        ends.clear();
                    } else {
                        ends.retain(|e| {
                            let here = e.0 == k + 1;
                            if here {
                                gross = square(&e.1).mul_add(reach, gross);
                                z = z + e.1;
                            }
                            !here
                        });
                    }
                    for j in (0..link.kind.nv() as u32).rev() {
                        let (v, w) = (link.v + j, first + j);
                        let mut c = f64x4::splat(0.0);
                        for t in terms.iter().filter(|t| t.1 == v) {
                            c += t.2;
                        }
                        let eps = uw.S[v as usize].block().dot_from(&z, c);
                        let at = w as usize;
                        if link.coordinate == Coordinate::Prescribed {
                            free = eps.mul_add(f64x4::splat(uw.given[at]), free);
                            self.held.push((self.groups.len() as u32, v, eps.to_array()));
                            continue;
                        }
                        z = uw.G[at].block().scale_add(eps, z);
                        let e = eps * f64x4::splat(uw.s[at]);
                        free = e.mul_add(f64x4::splat(uw.e[at]), free);
                        self.dof.push(last - w);
                        self.e.push(e.to_array());
                    }
                }
                Unit::Aggregate(i) => {
                    let (agg, m) = (&units.aggregates[i as usize], &uw.embedded[i as usize]);
                    let (size, n, from) = (agg.dofs.len(), m.n, self.e.len());
                    let w = |j: usize| first as usize + j;
                    // Rows of this unit, the last rate first.
                    for j in (0..n).rev() {
                        self.dof.push(last - w(j) as u32);
                        self.e.push([0.0; WIDTH]);
                    }
                    for t in terms.iter() {
                        let Some(d) = agg.dofs.iter().position(|d| *d == t.1) else { continue };
                        free = t.2.mul_add(f64x4::splat(m.x[d]), free);
                        self.held_terms.push((self.groups.len() as u32, unit, d as u32, t.2));
                        gross = (t.2 * t.2).mul_add(f64x4::splat(m.reach), gross);
                        for j in 0..n {
                            let e = &mut self.e[from + n - 1 - j];
                            let x = f64x4::splat(m.X[d * size + j]);
                            *e = t.2.mul_add(x, f64x4::new(*e)).to_array();
                        }
                    }
                    let (held, group) = (&mut self.held_ends, self.groups.len() as u32);
                    let mut meet = |slot: u32, end: &V6<f64x4>| {
                        let place = units.member[slot as usize] as usize;
                        let own = end.to_parent((-uw.r[slot as usize]).block());
                        z = z + *end;
                        held.push((group, slot, own));
                        free -= m.A[place].block().dot(&own);
                        gross = square(&own).mul_add(f64x4::splat(uw.reach[slot as usize]), gross);
                        for j in 0..n {
                            let e = &mut self.e[from + n - 1 - j];
                            let H = m.H[place * size + j].block();
                            *e = H.dot_from(&own, f64x4::new(*e)).to_array();
                        }
                    };
                    ends.retain(|e| {
                        let here = units.of_slot[e.0 as usize] == unit;
                        if here {
                            meet(e.0, &e.1);
                        }
                        !here
                    });
                    for j in (0..n).rev() {
                        let e = f64x4::new(self.e[from + n - 1 - j]);
                        z = uw.G[w(j)].block().scale_add(e, z);
                        free = e.mul_add(f64x4::splat(uw.e[w(j)]), free);
                    }
                }
            }
            let parent = units.parent_slot(tree, unit as usize);
            if parent != 0 {
                match ends.iter_mut().find(|e| e.0 == parent) {
                    Some(e) => e.1 = e.1 + z,
                    None => ends.push((parent, z)),
                }
            }
        }
        row.free = free.to_array();
        row.gross = gross.to_array();
        self.groups.push(row);
        self.start.push(self.dof.len() as u32);
    }
}

/// |n|² + |f|².
#[inline(always)]
fn square(z: &V6<f64x4>) -> f64x4 {
    z.dot(z)
}

fn minus(z: V6<f64x4>) -> V6<f64x4> {
    V6 { n: -z.n, f: -z.f }
}

/// Up to four wrenches side by side.
fn blocks(wrenches: &[V6<f64>]) -> V6<f64x4> {
    let pick = |f: fn(&V6<f64>) -> f64| {
        let mut out = [0.0; WIDTH];
        out.iter_mut().zip(wrenches).for_each(|(to, w)| *to = f(w));
        f64x4::new(out)
    };
    V6 {
        n: V3 { x: pick(|w| w.n.x), y: pick(|w| w.n.y), z: pick(|w| w.n.z) },
        f: V3 { x: pick(|w| w.f.x), y: pick(|w| w.f.y), z: pick(|w| w.f.z) },
    }
}
