//! Propagation of rows inward over the units of a factored tree ([`Units::gather`]).
//!
//! A row is a wrench on one or two links, or factors c of hinge coordinates:
//! ```text
//! ε = c − S · z,   e = D^{−1/2} ε,   z⁺ = z + G ε            up to four rows side by side
//! J β̇ = E e_f + Σ ε β̇ (prescribed) − z · A (aggregates)      e_f: due to the applied forces
//! ```
//! Where the two paths of a row meet, its wrenches are added. Inboard of that point, or if a row has only one end, the path is followed from link to
//! link.

use super::rows::{RowGroup, RowSet, WIDTH};
use super::{Inward, Through, Unit, Units, UnitsWork, floating};
use crate::linear::{V3, V6};
use crate::query::v3;
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::{BodyId, ConstraintId, LoopMotion};
use linkwork_spatial::Vec3;
use wide::f64x4;

/// Sums along a path: J β̇ due to the applied forces, and the bound of W's diagonal.
#[derive(Clone, Copy)]
struct Sums {
    free: f64x4,
    gross: f64x4,
}

impl RowSet {
    /// Adds the rows of a constraint at the state of the last [`Units::gather`]; a constraint with more than four rows takes two groups.
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
                let closure = &units.closures[i as usize];
                let ends = closure.ends(&ws.work.kin, &uw.r, &units.root);
                for block in &closure.blocks {
                    let rows = block.rows(&ends, motions);
                    self.ends.clear();
                    self.terms.clear();
                    for (end, slot) in closure.slots.into_iter().enumerate() {
                        if slot != 0 {
                            let arm = uw.r[slot as usize] + ends.arms[end];
                            // z is the negative of the force on the body.
                            let z = rows.wrench.to_parent(arm.block());
                            self.ends.push((slot, if end == 1 { minus(z) } else { z }));
                        }
                    }
                    let (error, rate, bias) = (rows.error, rows.rate, rows.bias);
                    self.walk(
                        units,
                        uw,
                        RowGroup { n: rows.n, error, rate, bias, ..RowGroup::default() },
                    );
                }
            }
            ConstraintId::Coupling(i) => {
                let coupling = &tree.multibody().couplings()[i as usize];
                let mut row = RowGroup { n: 1, ..RowGroup::default() };
                row.error[0] = coupling.error(q);
                row.rate[0] = coupling.rate(q, v);
                row.bias[0] = coupling.bias(q, v);
                self.ends.clear();
                self.terms.clear();
                for (k, (slot, v, _)) in units.couplings[i as usize].iter().enumerate() {
                    self.term(*slot, *v, coupling.factor(k, q));
                }
                self.walk(units, uw, row);
            }
        }
    }

    /// Adds one row on one hinge coordinate (indices in q and β) with this factor: a limit, or friction in the hinge.
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
        let mut row = RowGroup { n: 1, ..RowGroup::default() };
        row.rate[0] = factor * rate;
        self.walk(units, uw, row);
    }

    /// Like [`RowSet::add_coordinate`], for a sum of three coordinates of one hinge with factors `d`, from index `place` in β: a limit of a ball
    /// hinge.
    pub fn add_direction(
        &mut self,
        tree: &Tree,
        units: &Units,
        uw: &UnitsWork,
        place: usize,
        d: &Vec3,
        v: &[f64],
    ) {
        self.ends.clear();
        self.terms.clear();
        let mut row = RowGroup { n: 1, ..RowGroup::default() };
        for k in 0..3 {
            self.term(tree.dofs.link[place + k], (place + k) as u32, d[k]);
            row.rate[0] += d[k] * v[place + k];
        }
        self.walk(units, uw, row);
    }

    /// Adds at most three rows that measure the velocity of body `b` relative to body `a` at a point (m, world) along directions (unit vectors,
    /// world): a contact. `None` is the world. On a flexible body the point moves with the nearest station that has mass or carries something, or
    /// with the body frame if that is nearer.
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

    /// Like [`RowSet::add_point`], followed by rows that measure relative angular velocity about axes.
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
        let wrench = V6 { n: side_by_side(directions.len(), axes), f: side_by_side(0, directions) };
        let mut rate = f64x4::splat(0.0);
        self.ends.clear();
        self.terms.clear();
        for (body, sign) in [(a, -1.0), (b, 1.0)] {
            let slot = body.map_or(0, |b| tree.slot_near(&ws.work, b, point));
            if slot == 0 {
                continue;
            }
            let kin = &ws.work.kin[slot as usize];
            let arm = v3(point) - kin.p;
            let V = kin.V.to_child(arm).block();
            rate = wrench.dot(&V).mul_add(f64x4::splat(sign), rate);
            let z = wrench.to_parent((uw.r[slot as usize] + arm).block());
            self.ends.push((slot, if sign > 0.0 { minus(z) } else { z }));
        }
        let n = directions.len() + axes.len();
        self.walk(units, uw, RowGroup { n, rate: rate.to_array(), ..RowGroup::default() });
    }

    fn term(&mut self, slot: u32, v: u32, factor: f64) {
        self.terms.push((slot, v, f64x4::new([factor, 0.0, 0.0, 0.0])));
        if !self.ends.iter().any(|e| e.0 == slot) {
            self.ends.push((slot, V6::default()));
        }
    }

    /// Propagates the ends inward over the units, the outermost unit first.
    fn walk(&mut self, units: &Units, uw: &UnitsWork, mut row: RowGroup) {
        let o = f64x4::splat(0.0);
        let mut sums = Sums { free: o, gross: o };
        self.independent = units.independent;
        self.afloat(units, uw, &mut sums);
        loop {
            if let [(slot, z)] = self.ends[..]
                && self.terms.is_empty()
            {
                match self.alone(units, uw, slot, z, &mut sums) {
                    Some(end) => self.ends[0] = end,
                    None => break,
                }
            }
            let Some(unit) = self.ends.iter().map(|e| units.of_slot[e.0 as usize]).max() else {
                break;
            };
            let (z, parent) = match units.units[unit as usize] {
                Unit::Link(k) => {
                    let slot = k as usize + 1;
                    (self.hinge(units, uw, slot, &mut sums), units.inward[slot].parent)
                }
                Unit::Aggregate(i) => {
                    let z = self.aggregate(units, uw, (unit, i as usize), &mut sums);
                    (z, units.aggregates[i as usize].parent)
                }
            };
            self.terms.retain(|t| units.of_slot[t.0 as usize] != unit);
            if parent != 0 {
                match self.ends.iter_mut().find(|e| e.0 == parent) {
                    Some(e) => e.1 = e.1 + z,
                    None => self.ends.push((parent, z)),
                }
            }
        }
        row.free = sums.free.to_array();
        row.gross = sums.gross.to_array();
        self.groups.push(row);
        self.start.push(self.dof.len() as u32);
    }

    /// Treats two ends on different floating roots.
    #[inline(always)]
    fn afloat(&mut self, units: &Units, uw: &UnitsWork, sums: &mut Sums) {
        let [(p, x), (q, y)] = self.ends[..] else { return };
        let floats = |slot: u32| matches!(units.inward[slot as usize].through, Through::Floating);
        if p == q || !self.terms.is_empty() || !(floats(p) && floats(q)) {
            return;
        }
        let last = (units.independent as u32).wrapping_sub(1);
        let ends = if units.of_slot[p as usize] > units.of_slot[q as usize] {
            [(p, x), (q, y)]
        } else {
            [(q, y), (p, x)]
        };
        for (slot, z) in ends {
            let slot = slot as usize;
            sums.gross = square(&z).mul_add(f64x4::splat(uw.reach[slot]), sums.gross);
            self.floating(uw, units.inward[slot].first as usize, last, &minus(z), sums);
        }
        self.ends.clear();
    }

    /// Follows one end alone, from link to link; returns it at anything other than a free hinge.
    #[inline(always)]
    fn alone(
        &mut self,
        units: &Units,
        uw: &UnitsWork,
        mut slot: u32,
        mut z: V6<f64x4>,
        sums: &mut Sums,
    ) -> Option<(u32, V6<f64x4>)> {
        let mut to = *sums;
        let last = (units.independent as u32).wrapping_sub(1);
        while slot != 0 {
            let at = &units.inward[slot as usize];
            let (v, first) = (at.v as usize, at.first as usize);
            let n = match at.through {
                Through::Free(n) => n as usize,
                Through::Floating => {
                    to.gross = square(&z).mul_add(f64x4::splat(uw.reach[slot as usize]), to.gross);
                    self.floating(uw, first, last, &minus(z), &mut to);
                    break;
                }
                Through::Prescribed(_) | Through::Aggregate => {
                    *sums = to;
                    return Some((slot, z));
                }
            };
            to.gross = square(&z).mul_add(f64x4::splat(uw.reach[slot as usize]), to.gross);
            for j in (0..n).rev() {
                let eps = uw.S[v + j].block().dot_from(&z, f64x4::splat(0.0));
                let w = first + j;
                z = uw.G[w].block().scale_add(eps, z);
                let e = eps * f64x4::splat(uw.s[w]);
                to.free = e.mul_add(f64x4::splat(uw.e[w]), to.free);
                self.dof.push(last - w as u32);
                self.e.push(e.to_array());
            }
            slot = at.parent;
        }
        *sums = to;
        None
    }

    /// Evaluates a floating root: e = K f.
    #[inline(always)]
    fn floating(
        &mut self,
        uw: &UnitsWork,
        first: usize,
        last: u32,
        f: &V6<f64x4>,
        sums: &mut Sums,
    ) {
        let e = floating::pulled(&uw.G[first..first + floating::RATES], f);
        for (e, f) in e.iter().zip(&uw.e[first..]) {
            sums.free = e.mul_add(f64x4::splat(*f), sums.free);
        }
        // The rates are stored in reverse order.
        let least = last - (first + floating::RATES - 1) as u32;
        self.dof.extend(std::array::from_fn::<u32, { floating::RATES }, _>(|i| least + i as u32));
        self.e.extend(std::array::from_fn::<_, { floating::RATES }, _>(|i| {
            e[floating::RATES - 1 - i].to_array()
        }));
    }

    /// Evaluates a hinge where ends meet or terms act; returns z inboard of it.
    fn hinge(&mut self, units: &Units, uw: &UnitsWork, slot: usize, sums: &mut Sums) -> V6<f64x4> {
        let Inward { v, first, through, .. } = units.inward[slot];
        let last = (units.independent as u32).wrapping_sub(1);
        let reach = f64x4::splat(uw.reach[slot]);
        let mut z = V6::default();
        self.ends.retain(|e| {
            let here = e.0 as usize == slot;
            if here {
                sums.gross = square(&e.1).mul_add(reach, sums.gross);
                z = z + e.1;
            }
            !here
        });
        let n = match through {
            Through::Floating => {
                let mut f = minus(z);
                for t in self.terms.iter().filter(|t| t.0 as usize == slot) {
                    f = uw.S[t.1 as usize].block().scale_add(t.2, f);
                }
                self.floating(uw, first as usize, last, &f, sums);
                return z;
            }
            Through::Free(n) | Through::Prescribed(n) => n,
            Through::Aggregate => 0,
        };
        for j in (0..n).rev() {
            let (v, w) = (v + j, first + j);
            let here = self.terms.iter().filter(|t| t.1 == v);
            let c = here.fold(f64x4::splat(0.0), |c, t| c + t.2);
            let eps = uw.S[v as usize].block().dot_from(&z, c);
            let at = w as usize;
            if let Through::Prescribed(_) = through {
                sums.free = eps.mul_add(f64x4::splat(uw.given[at]), sums.free);
                self.held.push((self.groups.len() as u32, v, eps.to_array()));
                continue;
            }
            z = uw.G[at].block().scale_add(eps, z);
            let e = eps * f64x4::splat(uw.s[at]);
            sums.free = e.mul_add(f64x4::splat(uw.e[at]), sums.free);
            self.dof.push(last - w);
            self.e.push(e.to_array());
        }
        z
    }

    /// Evaluates an aggregate; returns z inboard of it.
    fn aggregate(
        &mut self,
        units: &Units,
        uw: &UnitsWork,
        (unit, which): (u32, usize),
        sums: &mut Sums,
    ) -> V6<f64x4> {
        let (agg, m) = (&units.aggregates[which], &uw.embedded[which]);
        let (size, n, from) = (agg.dofs.len(), m.n, self.e.len());
        let first = units.first[unit as usize] as usize;
        let (last, group) = ((units.independent as u32).wrapping_sub(1), self.groups.len() as u32);
        // The rates of this unit are stored in reverse order.
        for j in (0..n).rev() {
            self.dof.push(last - (first + j) as u32);
            self.e.push([0.0; WIDTH]);
        }
        let Sums { mut free, mut gross } = *sums;
        for t in &self.terms {
            let Some(d) = agg.dofs.iter().position(|d| *d == t.1) else { continue };
            free = t.2.mul_add(f64x4::splat(m.x[d]), free);
            self.held_terms.push((group, unit, d as u32, t.2));
            gross = (t.2 * t.2).mul_add(f64x4::splat(m.reach), gross);
            for j in 0..n {
                let e = &mut self.e[from + n - 1 - j];
                let x = f64x4::splat(m.X[d * size + j]);
                *e = t.2.mul_add(x, f64x4::new(*e)).to_array();
            }
        }
        let (mut z, all, held) = (V6::default(), &mut self.e, &mut self.held_ends);
        self.ends.retain(|(slot, end)| {
            let s = *slot as usize;
            if units.of_slot[s] != unit {
                return true;
            }
            let place = units.member[s] as usize;
            let own = end.to_parent((-uw.r[s]).block());
            z = z + *end;
            held.push((group, *slot, own));
            free -= m.A[place].block().dot(&own);
            gross = square(&own).mul_add(f64x4::splat(uw.reach[s]), gross);
            for j in 0..n {
                let e = &mut all[from + n - 1 - j];
                let H = m.H[place * size + j].block();
                *e = H.dot_from(&own, f64x4::new(*e)).to_array();
            }
            false
        });
        for j in (0..n).rev() {
            let e = f64x4::new(self.e[from + n - 1 - j]);
            z = uw.G[first + j].block().scale_add(e, z);
            free = e.mul_add(f64x4::splat(uw.e[first + j]), free);
        }
        *sums = Sums { free, gross };
        z
    }
}

/// Returns |n|² + |f|².
#[inline(always)]
fn square(z: &V6<f64x4>) -> f64x4 {
    z.dot(z)
}

fn minus(z: V6<f64x4>) -> V6<f64x4> {
    V6 { n: -z.n, f: -z.f }
}

/// Packs up to four vectors side by side, the first at a lane.
#[inline(always)]
fn side_by_side(lane: usize, vectors: &[Vec3]) -> V3<f64x4> {
    let (mut x, mut y, mut z) = ([0.0; WIDTH], [0.0; WIDTH], [0.0; WIDTH]);
    for (v, k) in vectors.iter().zip(lane..) {
        (x[k], y[k], z[k]) = (v.x, v.y, v.z);
    }
    V3 { x: f64x4::new(x), y: f64x4::new(y), z: f64x4::new(z) }
}
