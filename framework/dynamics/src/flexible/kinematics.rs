//! Kinematics of a tree with flexible bodies. Links are computed as in a rigid tree, then each station s of a link b:
//!
//! ```text
//! l = R_b p(η)            V = φ*(b,s) V_b + Ψ η̇
//! A = φ*(b,s) A_b + [ω_b × σ;  ω_b × (ω_b × l) + 2 ω_b × u] + Ψ̇ η̇,     [σ; u] = Ψ η̇
//! ```
//! All quantities are in world axes. K η + C η̇ of each body is computed, too.

use super::shape::Turn;
use super::{Bend, Flexible, Set, StationAt, Step};
use crate::kinematics::across;
use crate::linear::V6;
use crate::tree::{Kind, Tree};
use crate::work::{Kin, Work};

pub(crate) fn sweep<const RATES: bool>(
    tree: &Tree,
    flex: &Flexible,
    work: &mut Work<f64>,
    q: &[f64],
    v: &[f64],
) {
    assert_eq!(work.kin.len(), tree.slots(), "workspace made for another tree");
    work.bend.energy = 0.0;
    for step in &flex.order {
        match *step {
            Step::Link(k) => {
                let link = &tree.links[k];
                let turn = match link.kind {
                    Kind::Pin | Kind::Screw => q[link.q as usize].sin_cos(),
                    _ => Default::default(),
                };
                let p = work.kin[link.parent as usize];
                across::<f64, RATES>(&p, &mut work.kin[k + 1], link, turn, q, v);
            }
            Step::Set(i) => {
                let set = &flex.sets[i];
                let base = work.kin[set.base as usize];
                elastic::<RATES>(set, &mut work.bend, q, v);
                for s in set.first..set.end {
                    let (at, kin) = (&flex.stations[s], &mut work.kin[flex.slot(s)]);
                    station::<RATES>(at, set, &base, kin, &mut work.bend);
                }
            }
        }
    }
}

/// Stores η and η̇, and the forces of the springs and dampers of the modes.
fn elastic<const RATES: bool>(set: &Set, bend: &mut Bend, q: &[f64], v: &[f64]) {
    let (n, at) = (set.n, set.v);
    bend.eta[at..at + n].copy_from_slice(&q[set.q..set.q + n]);
    if RATES {
        bend.rate[at..at + n].copy_from_slice(&v[at..at + n]);
    }
    for i in 0..n {
        let row = |A: &[f64], x: &[f64]| -> f64 {
            A[i * n..(i + 1) * n].iter().zip(&x[at..at + n]).map(|(a, x)| a * x).sum()
        };
        let spring = row(&set.K, &bend.eta);
        bend.energy += 0.5 * spring * bend.eta[at + i];
        bend.elastic[at + i] = spring + if RATES { row(&set.C, &bend.rate) } else { 0.0 };
    }
}

fn station<const RATES: bool>(
    at: &StationAt,
    set: &Set,
    base: &Kin<f64>,
    out: &mut Kin<f64>,
    bend: &mut Bend,
) {
    let places = set.v..set.v + set.n;
    let eta = &bend.eta[places.clone()];
    let turn = Turn::new(StationAt::sum(&at.rotation, eta));
    out.R = base.R.mat(&turn.rotation(&at.R));
    out.l = base.R.mul(at.position(eta));
    out.p = base.p + out.l;
    for i in 0..set.n {
        let S = at.column(&turn, i, eta);
        bend.S[at.column + i] = V6 { n: base.R.mul(S.n), f: base.R.mul(S.f) };
    }
    if !RATES {
        return;
    }
    let rate = &bend.rate[places];
    let theta_dot = StationAt::sum(&at.rotation, rate);
    let (mut V, mut A) = (V6::default(), V6::default());
    for (i, x) in rate.iter().enumerate() {
        let S_dot = at.column_rate(&turn, i, theta_dot, rate);
        let S_dot = V6 { n: base.R.mul(S_dot.n), f: base.R.mul(S_dot.f) };
        bend.S_dot[at.column + i] = S_dot;
        A = S_dot.scale_add(*x, A);
        V = bend.S[at.column + i].scale_add(*x, V);
    }
    let (w, l) = (base.V.n, out.l);
    let u = w.cross(l) + V.f;
    out.V = base.V.to_child(l) + V;
    let turning = V6 { n: w.cross(V.n), f: w.cross(u + V.f) };
    out.A = base.A.to_child(l) + turning + A;
}
