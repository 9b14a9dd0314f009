//! Kinematics: one scatter sweep, in world axes at each link's own origin.
//!
//! With p the parent of k, l from O_p to O_k, and u the velocity of O_k in the parent's axes:
//! ```text
//! V(k) = φ*(p,k) V(p) + H*(k) β(k)
//! A(k) = φ*(p,k) A(p) + a(k)                  bias: acceleration with every β̇ = 0
//! pin     a = [ω_p × hβ;  ω_p × (ω_p × l)]
//! slider  a = [0;         ω_p × (ω_p × l) + 2 ω_p × hβ]
//! screw   a = [ω_p × hβ;  ω_p × (ω_p × l) + 2 ω_p × s hβ]                s: pitch
//! ball    a = [ω_p × Rω;  ω_p × (ω_p × l)]
//! free    a = [ω_p × Rω;  ω_p × (ω_p × l) + 2 ω_p × Rv + Rω × Rv]
//! ```
//! Propagating the bias outward costs one shift here; it saves the product P a at each link of the articulated-body gather.

use crate::lane::Lane;
use crate::linear::{M3, V3, V6};
use crate::tree::{Kind, Link, Tree};
use crate::work::{Kin, Work, Workspace};
use linkwork_multibody::NodeId;

/// Computes poses, velocities and bias accelerations of all links from `q` (nq) and `v` (nv, β).
///
/// All queries of the workspace, and the `…_given_kinematics` algorithms, use the result. About 75 multiply-adds per one-dof link. Panics if a length
/// is wrong.
pub fn kinematics(tree: &Tree, ws: &mut Workspace, q: &[f64], v: &[f64]) {
    check(q.len(), tree.nq(), "q");
    check(v.len(), tree.nv(), "v");
    match tree.flexible.as_deref() {
        None => sweep::<f64, true>(tree, &mut ws.work, q, v),
        Some(flex) => crate::flexible::sweep::<true>(tree, flex, &mut ws.work, q, v),
    }
}

/// Computes only the poses of all links from `q` (nq), which is sufficient for [`mass_matrix`](crate::mass_matrix), poses and centres of mass.
/// Velocities and accelerations in the workspace remain those of an earlier call.
pub fn poses(tree: &Tree, ws: &mut Workspace, q: &[f64]) {
    check(q.len(), tree.nq(), "q");
    match tree.flexible.as_deref() {
        None => sweep::<f64, false>(tree, &mut ws.work, q, &[]),
        Some(flex) => crate::flexible::sweep::<false>(tree, flex, &mut ws.work, q, &[]),
    }
}

#[track_caller]
#[inline(always)]
pub(crate) fn check(got: usize, want: usize, what: &str) {
    if got != want {
        wrong(got, want, what);
    }
}

#[track_caller]
#[cold]
#[inline(never)]
fn wrong(got: usize, want: usize, what: &str) -> ! {
    panic!("`{what}` has {got} numbers, the mechanism has {want}");
}

pub(crate) fn sweep<L: Lane, const RATES: bool>(tree: &Tree, work: &mut Work<L>, q: &[L], v: &[L]) {
    let links = &tree.links;
    assert_eq!(work.kin.len(), links.len() + 1, "workspace made for another tree");
    turns(tree.turns::<L>(), &mut work.turns, q);
    let (kin, turns) = (&mut work.kin, &work.turns[..links.len()]);
    let at_rest = !work.base_moves;
    for (k, link) in links.iter().enumerate() {
        if link.on_world && at_rest {
            floating::<L, RATES>(link, &mut kin[k + 1], q, v);
            continue;
        }
        step::<L, RATES>(k, link, kin, turns[k], q, v);
    }
}

/// Computes the poses of the links from the base to a node. O(path).
pub(crate) fn path_poses<L: Lane>(tree: &Tree, work: &mut Work<L>, q: &[L], node: NodeId) {
    for at in tree.path_to(node, &mut work.path)..work.path.len() {
        link_pose(tree, work, work.path[at] as usize, q);
    }
}

/// Computes the pose of one link from the pose of its parent.
fn link_pose<L: Lane>(tree: &Tree, work: &mut Work<L>, k: usize, q: &[L]) {
    let link = &tree.links[k];
    let turn = match link.kind {
        Kind::Pin | Kind::Screw => q[link.q as usize].sin_cos(),
        _ => Default::default(),
    };
    step::<L, false>(k, link, &mut work.kin, turn, q, &[]);
}

#[inline(always)]
fn step<L: Lane, const RATES: bool>(
    k: usize,
    link: &Link,
    kin: &mut [Kin<L>],
    turn: (L, L),
    q: &[L],
    v: &[L],
) {
    let (done, rest) = kin.split_at_mut(k + 1);
    across::<L, RATES>(&done[link.parent as usize], &mut rest[0], link, turn, q, v);
}

/// Computes a link on the world, which is at rest. The result is bit-identical to that of [`across`].
#[inline(always)]
fn floating<L: Lane, const RATES: bool>(link: &Link, out: &mut Kin<L>, q: &[L], v: &[L]) {
    let q = &q[link.q as usize..];
    let R = M3::from_quat(&q[3..7]);
    (out.R, out.l) = (R, V3::read(q));
    out.p = out.l;
    if RATES {
        let v = &v[link.v as usize..];
        let (rate, slide) = (R.mul(V3::read(v)), R.mul(V3::read(&v[3..])));
        out.V = V6 { n: rate, f: slide };
        out.A = V6 { n: V3::default(), f: rate.cross(slide) };
    }
}

/// Computes a link from its parent.
#[inline(always)]
pub(crate) fn across<L: Lane, const RATES: bool>(
    p: &Kin<L>,
    out: &mut Kin<L>,
    link: &Link,
    turn: (L, L),
    q: &[L],
    v: &[L],
) {
    let q = &q[link.q as usize..];
    let v = if RATES { &v[link.v as usize..] } else { &[][..] };
    // Every link has a fixed pose on its parent, to which its kind adds a motion.
    let R0 = p.R.mat(&M3::splat(&link.R));
    let l0 = p.R.mul(V3::splat(&link.l));
    match link.kind {
        Kind::Pin => {
            out.R = turn_z(&R0, turn);
            out.l = l0;
            if RATES {
                let rate = R0.z.scale(v[0]);
                let u = p.V.n.cross(l0);
                out.V = V6 { n: p.V.n + rate, f: p.V.f + u };
                out.A = V6 {
                    n: p.V.n.cross_add(rate, p.A.n),
                    f: p.V.n.cross_add(u, p.A.n.cross_add(l0, p.A.f)),
                };
            }
        }
        Kind::Slider => {
            out.R = R0;
            out.l = R0.z.scale_add(q[0], l0);
            if RATES {
                rates(p, out, V3::default(), R0.z.scale(v[0]));
            }
        }
        Kind::Screw => {
            out.R = turn_z(&R0, turn);
            let s = L::splat(link.pitch);
            out.l = R0.z.scale_add(q[0] * s, l0);
            if RATES {
                rates(p, out, R0.z.scale(v[0]), R0.z.scale(v[0] * s));
            }
        }
        Kind::Ball => {
            out.R = R0.mat(&M3::from_quat(&q[..4]));
            out.l = l0;
            if RATES {
                rates(p, out, out.R.mul(V3::read(v)), V3::default());
            }
        }
        Kind::Free => {
            out.R = R0.mat(&M3::from_quat(&q[3..7]));
            out.l = R0.mul_add(V3::read(q), l0);
            if RATES {
                let (rate, slide) = (out.R.mul(V3::read(v)), out.R.mul(V3::read(&v[3..])));
                rates(p, out, rate, slide);
                out.A.f = rate.cross_add(slide, out.A.f);
            }
        }
    }
    out.p = p.p + out.l;
}

/// Computes sine and cosine of every rotating link's angle, block by block. `all` contains the links and their indices in q, in whole blocks.
#[inline(always)]
fn turns<L: Lane>(all: &[(u32, u32)], out: &mut [(L, L)], q: &[L]) {
    for some in all.chunks_exact(L::PACK) {
        let angles = L::collect(|i| q[some[i].1 as usize]);
        let (s, c) = angles.sin_cos();
        for (i, (link, _)) in some.iter().enumerate() {
            out[*link as usize] = (L::get(&s, i), L::get(&c, i));
        }
    }
}

/// Returns `R Rz` for a rotation given by sine and cosine.
#[inline(always)]
fn turn_z<L: Lane>(R: &M3<L>, (s, c): (L, L)) -> M3<L> {
    M3 { x: R.x.scale_add(c, R.y.scale(s)), y: R.y.scale_add(c, R.x.scale(-s)), z: R.z }
}

/// Computes velocity and bias for relative rates in world axes, for a hinge whose axes are fixed in the parent.
#[inline(always)]
fn rates<L: Lane>(p: &Kin<L>, out: &mut Kin<L>, rate: V3<L>, slide: V3<L>) {
    let l = out.l;
    let u = p.V.n.cross(l) + slide;
    out.V = V6 { n: p.V.n + rate, f: p.V.f + u };
    out.A = V6 {
        n: p.V.n.cross_add(rate, p.A.n),
        f: p.V.n.cross_add(u + slide, p.A.n.cross_add(l, p.A.f)),
    };
}
