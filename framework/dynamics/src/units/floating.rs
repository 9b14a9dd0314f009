//! A floating root: its six rates are eliminated at once.
//!
//! There is no inboard link to which inertia would be propagated, and any six numbers can serve as its independent rates:
//! ```text
//! K* K = P⁻¹                               K lower triangular, force before moment, world axes
//! gather   ε = K (H* T − z)
//! rows     e = K (H* c − z)
//! scatter  α = K* (ε + y),   β̇ = H α
//! ```
//! P and z are about the link's own origin, which is the root's. K takes the role of G, with D = 1.

use super::UnitsWork;
use super::sweep::loaded;
use crate::articulated::Spatial;
use crate::lane::Lane;
use crate::linear::{S3, V3, V6};
use crate::tree::{Kind, Link};
use crate::work::Work;
use linkwork_multibody::Coordinate;

/// Number of rates of a floating root.
pub(super) const RATES: usize = 6;

/// Returns true if a link floats: it is a free root and its rates are not prescribed.
pub(super) fn floats(link: &Link) -> bool {
    link.kind == Kind::Free && link.parent == 0 && link.coordinate == Coordinate::Free
}

/// Computes ε and K; `None` if some direction moves no inertia.
#[inline(never)]
pub(super) fn eliminate(
    link: &Link,
    k: usize,
    first: usize,
    w: &Work<f64>,
    uw: &mut UnitsWork,
    tau: &[f64],
) -> Option<()> {
    let (P, z) = loaded(link, k, w, uw);
    // A free hinge has no rotor.
    let K = inverse_factor(&P)?;
    let f = driven(&uw.S[link.v as usize..], &tau[link.v as usize..], &z);
    let mut reach = 0.0;
    for (K, at) in K.iter().zip(first..) {
        (uw.eps[at], uw.D_inv[at], uw.G[at]) = (K.dot(&f), 1.0, *K);
        reach += K.dot(K);
    }
    uw.reach[k + 1] = reach;
    Some(())
}

/// Returns H* T − z.
#[inline(always)]
pub(super) fn driven(S: &[V6<f64>], T: &[f64], z: &V6<f64>) -> V6<f64> {
    let f = V6 { n: -z.n, f: -z.f };
    S.iter().zip(&T[..RATES]).fold(f, |f, (S, T)| S.scale_add(*T, f))
}

/// Returns K f.
#[inline(always)]
pub(super) fn pulled<L: Lane>(K: &[V6<f64>], f: &V6<L>) -> [L; RATES] {
    let f = [f.f.x, f.f.y, f.f.z, f.n.x, f.n.y, f.n.z];
    std::array::from_fn(|i| {
        let K = ordered(&K[i]);
        (0..i).fold(f[i] * L::splat(K[i]), |sum, j| L::splat(K[j]).fma(f[j], sum))
    })
}

/// Returns the motion K* x; writes the rates of β to `rates`.
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

/// Returns the numbers of a vector with force before moment.
#[inline(always)]
fn ordered(a: &V6<f64>) -> [f64; RATES] {
    [a.f.x, a.f.y, a.f.z, a.n.x, a.n.y, a.n.z]
}

/// Computes the inverse of the Cholesky factor of P, row by row and in two halves:
/// ```text
/// K_M* K_M = M⁻¹,   B = H K_M*,   K_S* K_S = (I − B B*)⁻¹
/// K = [[K_M, 0], [−K_S B K_M, K_S]]                        force before moment
/// ```
#[inline(always)]
fn inverse_factor(P: &Spatial<f64>) -> Option<[V6<f64>; RATES]> {
    let K_M = inverse_factor3(&P.M)?;
    let B = K_M.map(|row| P.H.mul(row));
    let S = B.into_iter().fold(P.I, |S, b| S.sub_outer(b, b));
    let K_S = inverse_factor3(&S)?;
    let o = V3::default();
    let under = K_S.map(|row| {
        let [x, y, z] = B.map(|b| -row.dot(b));
        K_M[0].scale_add(x, K_M[1].scale_add(y, K_M[2].scale(z)))
    });
    Some([
        V6 { n: o, f: K_M[0] },
        V6 { n: o, f: K_M[1] },
        V6 { n: o, f: K_M[2] },
        V6 { n: K_S[0], f: under[0] },
        V6 { n: K_S[1], f: under[1] },
        V6 { n: K_S[2], f: under[2] },
    ])
}

/// Returns the inverse of the Cholesky factor of a symmetric matrix, row by row; `None` if it is not positive definite. With A = L D L* it is
/// D^{−1/2} L⁻¹.
#[inline(always)]
fn inverse_factor3(A: &S3<f64>) -> Option<[V3<f64>; 3]> {
    let x = 1.0 / A.xx;
    let (l_xy, l_xz) = (A.xy * x, A.xz * x);
    let (D_y, yz) = (l_xy.fnma(A.xy, A.yy), l_xy.fnma(A.xz, A.yz));
    let y = 1.0 / D_y;
    let l_yz = yz * y;
    let D_z = l_yz.fnma(yz, l_xz.fnma(A.xz, A.zz));
    if !(A.xx > 0.0 && D_y > 0.0 && D_z > 0.0) {
        return None;
    }
    let (x, y, z) = (x.sqrt(), y.sqrt(), (1.0 / D_z).sqrt());
    let n_xz = l_yz.fms(l_xy, l_xz);
    Some([V3::new(x, 0.0, 0.0), V3::new(-l_xy * y, y, 0.0), V3::new(n_xz * z, -l_yz * z, z)])
}
