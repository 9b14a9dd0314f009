//! Columns of node Jacobians and their rates, including modes.
//!
//! For a station s of a link b: d is the vector from the station's origin to the node's, ω_b the angular velocity of the link:
//! ```text
//! J = [σ; u + σ × d],  [σ; u] a column of Ψ
//! J̇ = [σ̇; u̇ + σ̇ × d + σ × ḋ],   σ̇ = ω_b × σ + Ψ̇,  u̇ = ω_b × u + Ψ̇,  ḋ = v_N − v_s
//! ```

use super::Flexible;
use crate::composite::each_axis;
use crate::linear::{V3, V6};
use crate::tree::Tree;
use crate::work::Work;

/// Visits each degree of freedom inboard of a slot, from the tip, with its index, its column at a point `d` from the slot's origin, the slot that it
/// moves (of the link or of the station), and the vector from that slot's origin to the point.
#[inline(always)]
pub(crate) fn columns(
    tree: &Tree,
    flex: &Flexible,
    w: &Work<f64>,
    mut slot: usize,
    mut d: V3<f64>,
    mut each: impl FnMut(usize, V6<f64>, usize, V3<f64>),
) {
    while slot != 0 {
        let kin = &w.kin[slot];
        match flex.station(slot) {
            Some(s) => {
                let at = &flex.stations[s];
                let set = &flex.sets[at.set as usize];
                for j in 0..set.n {
                    each(set.v + j, w.bend.S[at.column + j].to_child(d), slot, d);
                }
            }
            None => {
                let mut i = tree.links[slot - 1].v as usize;
                each_axis(&tree.links[slot - 1], kin, -d, |J| {
                    each(i, J, slot, d);
                    i += 1;
                });
            }
        }
        d = d + kin.l;
        slot = tree.inboard(flex, slot);
    }
}

/// Computes each column of the rate of a Jacobian, at a point `d` from the origin of a slot.
pub(crate) fn jacobian_rate(
    tree: &Tree,
    flex: &Flexible,
    w: &Work<f64>,
    slot: usize,
    d: V3<f64>,
    mut put: impl FnMut(usize, V6<f64>),
) {
    let v = w.kin[slot].V.to_child(d).f;
    columns(tree, flex, w, slot, d, |i, J, slot, d| {
        let V = w.kin[slot].V;
        // Convert to the column at the slot's own origin.
        let S = V6 { n: J.n, f: J.f - J.n.cross(d) };
        let (w_axes, S_dot) = match flex.station(slot) {
            Some(s) => {
                let at = &flex.stations[s];
                let set = &flex.sets[at.set as usize];
                (w.kin[set.base as usize].V.n, w.bend.S_dot[at.column + i - set.v])
            }
            None => (V.n, V6::default()),
        };
        let n = w_axes.cross_add(S.n, S_dot.n);
        let f = w_axes.cross_add(S.f, S_dot.f);
        put(i, V6 { n, f: S.n.cross_add(v - V.f, n.cross_add(d, f)) });
    });
}
