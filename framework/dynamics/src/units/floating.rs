//! A root that floats: its six rates eliminated at once.
//!
//! Nothing lies inboard that would have to be told, and its independent rates may be any six:
//! ```text
//! K* K = (P + armature)⁻¹                  K lower triangular, force before moment, world axes
//! gather   ε = K (H* T − z)
//! rows     e = K (H* c − z)
//! scatter  α = K* (ε + y),   β̇ = H α
//! ```
//! P and z are about the link's own origin, which is the root's. K takes the place of G, with D = 1.

use super::UnitsWork;
use super::sweep::loaded;
use crate::articulated::Spatial;
use crate::lane::Lane;
use crate::linear::{V3, V6};
use crate::tree::{Kind, Link};
use crate::work::Work;
use linkwork_multibody::Coordinate;

/// Rates of a floating root.
pub(super) const RATES: usize = 6;

/// Whether a link floats: a free root whose rates are not prescribed.
pub(super) fn floats(link: &Link) -> bool {
    link.kind == Kind::Free && link.parent == 0 && link.coordinate == Coordinate::Free
}

/// ε and K; `None` if some direction has nothing to move.
pub(super) fn eliminate(
    link: &Link,
    k: usize,
    first: usize,
    w: &Work<f64>,
    uw: &mut UnitsWork,
    tau: &[f64],
) -> Option<()> {
    let (P, z) = loaded(link, k, w, uw);
    let K = inverse_factor(&P, link.armature)?;
    let f = driven(&uw.S[link.v as usize..], &tau[link.v as usize..], &z);
    let mut reach = 0.0;
    for (K, at) in K.iter().zip(first..) {
        (uw.eps[at], uw.D_inv[at], uw.G[at]) = (K.dot(&f), 1.0, *K);
        reach += K.dot(K);
    }
    uw.reach[k + 1] = reach;
    Some(())
}

/// H* T − z.
#[inline(always)]
pub(super) fn driven(S: &[V6<f64>], T: &[f64], z: &V6<f64>) -> V6<f64> {
    let f = V6 { n: -z.n, f: -z.f };
    S.iter().zip(&T[..RATES]).fold(f, |f, (S, T)| S.scale_add(*T, f))
}

/// K f.
#[inline(always)]
pub(super) fn pulled<L: Lane>(K: &[V6<f64>], f: &V6<L>) -> [L; RATES] {
    let f = [f.f.x, f.f.y, f.f.z, f.n.x, f.n.y, f.n.z];
    std::array::from_fn(|i| {
        let K = ordered(&K[i]);
        (0..i).fold(f[i] * L::splat(K[i]), |sum, j| L::splat(K[j]).fma(f[j], sum))
    })
}

/// K* x, and β's rates of it: returns the motion, `rates` are those of S.
#[inline(always)]
pub(super) fn moved(
    K: &[V6<f64>],
    S: &[V6<f64>],
    x: impl Fn(usize) -> f64,
    rates: &mut [f64],
) -> V6<f64> {
    let a = (0..RATES).fold(V6::default(), |a, j| K[j].scale_add(x(j), a));
    rates.iter_mut().zip(S).for_each(|(rate, S)| *rate = S.dot(&a));
    a
}

/// Force before moment.
#[inline(always)]
fn ordered(a: &V6<f64>) -> [f64; RATES] {
    [a.f.x, a.f.y, a.f.z, a.n.x, a.n.y, a.n.z]
}

/// The inverse of the Cholesky factor of P + armature, row by row: with P = L D L*, D^{−1/2} L⁻¹.
#[inline(always)]
fn inverse_factor(P: &Spatial<f64>, armature: f64) -> Option<[V6<f64>; RATES]> {
    let (M, H, I) = (&P.M, &P.H, &P.I);
    // Lower triangle by rows.
    let mut A = [
        [M.xx, 0.0, 0.0, 0.0, 0.0, 0.0],
        [M.xy, M.yy, 0.0, 0.0, 0.0, 0.0],
        [M.xz, M.yz, M.zz, 0.0, 0.0, 0.0],
        [H.x.x, H.y.x, H.z.x, I.xx, 0.0, 0.0],
        [H.x.y, H.y.y, H.z.y, I.xy, I.yy, 0.0],
        [H.x.z, H.y.z, H.z.z, I.xz, I.yz, I.zz],
    ];
    let mut K = [[0.0; RATES]; RATES];
    let mut D_inv = [0.0; RATES];
    for j in 0..RATES {
        let D = A[j][j] + armature;
        if !(D > 0.0) {
            return None;
        }
        D_inv[j] = 1.0 / D;
        K[j][j] = 1.0;
        // Column j of L, what it takes from what is left, and from the rows of L⁻¹ below.
        let column: [f64; RATES] = std::array::from_fn(|i| A[i][j]);
        for i in j + 1..RATES {
            let l = column[i] * D_inv[j];
            for m in j + 1..=i {
                A[i][m] = l.fnma(column[m], A[i][m]);
            }
            for m in 0..=j {
                K[i][m] = l.fnma(K[j][m], K[i][m]);
            }
        }
    }
    Some(std::array::from_fn(|i| {
        let (K, s) = (&K[i], D_inv[i].sqrt());
        V6 { n: V3::new(K[3], K[4], K[5]), f: V3::new(K[0], K[1], K[2]) }.scaled(s)
    }))
}
