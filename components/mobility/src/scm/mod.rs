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
//! Nodes are `mobility.scm_ground` (`ground`), a field; `mobility.wheel_scm` and `mobility.foot` press it. Differences to Chrono: shear
//! unloads and holds, so that what is parked does not creep and what turns back meets no force of its past; pressed soil is as stiff
//! as measured (Wong), not as a number of the method; where slip makes the soil softer (n₁), what is pressed gives way, too; edges
//! of a body count by the share of a cell that they cover; faces are cylinders and planes, nothing is searched on a mesh.
//! The walls of a wheel push no soil aside. The way is that over a node, which stays: for a wheel of the slip s some 1/(1 − s) times that over
//! its rim, which Wong and Reece count (`terramechanics`).

pub mod contact;
pub mod ground;
mod heap;
pub mod heaps;
pub mod shape;
