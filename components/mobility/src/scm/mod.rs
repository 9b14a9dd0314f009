//! Deformable ground node by node, after the soil contact model (SCM) of Krenn and Hirzinger as Chrono has it.
//! ```text
//! sinkage    ζ = (h + heap − z) n₀·ẑ           z: lower side of what presses (`shape`), h, n₀: first surface and its normal
//! pressure   p = k ζⁿ                          ζ > ζ_u: deeper than before     k = k_c/b + k_φ, n = n₀ + n₁ |s|
//!            p = (p_u − k_u (ζ_u − ζ))₊        p_u = min(p_u, k ζ_uⁿ),  k_u = k₀ + A_u ζ_u      (`multipass`)
//! shear      τ̇ = G v while |τ| ≤ m S,  S = c + p tan φ,  G = ρ (c + p_u tan φ)/K;  beyond, the node slides and m grows:
//!            ṁ = (1 − m) w/K',  w: what is not elastic,  K' = K (1 − 1/ρ), so that m is 1 − e^(−j/K) within 0.4/ρ;  τ = m = 0 at p = 0
//! force      A (p n − τ), A = share δ²/(n₀·ẑ)/(n·n₀) on the face, n into the body, v: velocity of the body along its face
//! heaps      what is displaced goes, by the share that does not compact, on the nodes around, and slides where it is too steep
//! ```
//! Nodes are `mobility.scm_ground` (`ground`), a field; `mobility.wheel_scm` and `mobility.foot` press it. Differences to Chrono: shear unloads
//! elastically and holds, so that parked bodies do not creep and a reversed motion has no force from the earlier one; loaded soil has a measured
//! stiffness (Wong) instead of a numerical parameter; where slip softens the soil (n₁), loaded soil yields, too; edges of a body count by the covered
//! fraction of a cell; faces are cylinders and planes, and no mesh is searched. The side walls of a wheel do not push soil aside. The shear
//! displacement is measured at a node, which is at rest: for a wheel with the slip s it is about 1/(1 − s) times that along the rim, which Wong and
//! Reece use (`terramechanics`).

pub mod contact;
pub mod ground;
mod heap;
pub mod heaps;
pub mod shape;
