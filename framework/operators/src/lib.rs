//! Spatial operators as values: φ ψ H M K D of a system, which are multiplied and added like numbers.
//!
//! ```text
//! φ = (1 − ℰφ)⁻¹       ℰφ has φ(p,k) at (p, k), p the parent of k
//! ψ = (1 − ℰψ)⁻¹       ψ(p,k) = φ(p,k) (1 − G(k) H(k))
//! D = H P H* + J,  G = P H* D⁻¹,  K = ℰφ G           J: reflected inertia of the rotors, diagonal
//! mass matrix          H φ M φ* H* + J = (I + H φ K) D (I + H φ K)*
//! its inverse          (I − H ψ K)* D⁻¹ (I − H ψ K)
//! compliance           Λ⁻¹ = B* Ω B,  Ω = ψ* H* D⁻¹ H ψ,  Υ = its diagonal blocks
//! ```
//! An [`Operator`] is an expression. Products and sums of operators stay symbolic, have no cost and are printed in the usual notation. A product with
//! a vector is evaluated from right to left as sweeps: each symbol visits each link once, so it costs O(links). A matrix is computed only by
//! [`Operator::dense`].
//!
//! There are two spaces: *links* (6 numbers each, angular part or moment first, world axes at the link's own origin) and *hinges* (nv numbers). In
//! addition there are the *nodes* that are given to [`Operators::B`]. A link is one subhinge with everything that is welded outboard of it: a hinge
//! with two subhinges has two links, of which the inner one has no mass.
//!
//! **Prescribed coordinates.** At these coordinates G is zero, so ψ(p,k) = φ(p,k); D and D⁻¹ have zero rows and columns. (I − H ψ K)* D⁻¹ (I − H ψ K)
//! is then the inverse of the mass matrix of the free coordinates and zero elsewhere. [`Operators::all_free`] treats every coordinate as free.
//!
//! **Errors.** `a * b` cannot return a `Result`, and a panic in the middle of a formula would end the program. An invalid product is therefore an
//! operator that carries its error. All expressions that contain it carry the error, too, and `apply`, `dense`, `inverse` and `check` return the
//! *first* error with both operands. [`Operator::try_mul`] and [`Operator::try_add`] return it immediately.

#![allow(non_snake_case)]

mod error;
mod expression;
mod inverse;
mod product;
mod side;
mod snapshot;
mod sweeps;

pub use error::{Operand, OperatorError};
pub use expression::{Operator, Space};
pub use product::Scratch;

use expression::Expr;
use linkwork_dynamics::{DynamicsError, Tree, Workspace};
use linkwork_multibody::NodeId;
use side::Side;
use snapshot::{Articulation, Snapshot};
use std::sync::Arc;
use sweeps::Symbol;

/// The operators of one system at one configuration. Inexpensive to clone; operators created from it keep the data that they need.
#[derive(Clone, Debug)]
pub struct Operators {
    system: Arc<Snapshot>,
}

impl Operators {
    /// Creates the operators at the last [`kinematics`](linkwork_dynamics::kinematics()) or [`poses`](linkwork_dynamics::poses) of `ws`, and computes articulated-body
    /// inertias. O(links). Panics if `ws` was made for another tree.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if a free subhinge moves no inertia; [`DynamicsError::Flexible`].
    #[track_caller]
    pub fn new(tree: &Tree, ws: &Workspace) -> Result<Self, DynamicsError> {
        let system = Arc::new(Snapshot::new(tree, ws, Articulation::AsGiven)?);
        Ok(Self { system })
    }

    /// Like [`new`](Self::new), but treats every coordinate as free, prescribed ones, too.
    ///
    /// # Errors
    /// Like [`Operators::new`].
    #[track_caller]
    pub fn all_free(tree: &Tree, ws: &Workspace) -> Result<Self, DynamicsError> {
        let system = Arc::new(Snapshot::new(tree, ws, Articulation::AllFree)?);
        Ok(Self { system })
    }

    /// Returns the number of links; the *links* space has six times as many numbers.
    #[must_use]
    pub fn links(&self) -> usize {
        self.system.links.len()
    }

    /// Returns the number of degrees of freedom, which is the size of the *hinges* space.
    #[must_use]
    pub fn nv(&self) -> usize {
        self.system.nv
    }

    /// Returns the body to whose hinge a link belongs; `None` for an index above the last link.
    #[must_use]
    pub fn link_body(&self, link: usize) -> Option<&str> {
        self.system.links.get(link).map(|l| self.system.name(l))
    }

    /// Returns the identity, whose size follows from the expression.
    #[must_use]
    pub fn identity(&self) -> Operator {
        Operator::identity()
    }

    /// φ (links × links): gathers forces from the tips; φ* scatters motions from the base.
    #[must_use]
    pub fn phi(&self) -> Operator {
        self.symbol(Symbol::Phi)
    }

    /// ψ (links × links): φ of the articulated system.
    #[must_use]
    pub fn psi(&self) -> Operator {
        self.symbol(Symbol::Psi)
    }

    /// ℰφ (links × links): one step of φ, from each link to its parent.
    #[must_use]
    pub fn e_phi(&self) -> Operator {
        self.symbol(Symbol::EPhi)
    }

    /// ℰψ (links × links): one step of ψ.
    #[must_use]
    pub fn e_psi(&self) -> Operator {
        self.symbol(Symbol::EPsi)
    }

    /// H (nv × links): maps forces to hinges; H* maps rates to relative velocities.
    #[must_use]
    pub fn H(&self) -> Operator {
        self.symbol(Symbol::H)
    }

    /// M (links × links, block-diagonal): rigid inertia of each link about its origin.
    #[must_use]
    pub fn M(&self) -> Operator {
        self.symbol(Symbol::M)
    }

    /// P (links × links, block-diagonal): articulated-body inertia of the link and everything outboard.
    #[must_use]
    pub fn P(&self) -> Operator {
        self.symbol(Symbol::P)
    }

    /// D (nv × nv, block-diagonal): articulated-body inertia at each hinge, including armature.
    #[must_use]
    pub fn D(&self) -> Operator {
        self.symbol(Symbol::D)
    }

    /// D⁻¹ (nv × nv, block-diagonal).
    #[must_use]
    pub fn D_inv(&self) -> Operator {
        self.symbol(Symbol::DInv)
    }

    /// J (nv × nv, diagonal): reflected inertia of the rotors, kg m² or kg.
    #[must_use]
    pub fn J(&self) -> Operator {
        self.symbol(Symbol::J)
    }

    /// G (links × nv, block-diagonal): P H* D⁻¹.
    #[must_use]
    pub fn G(&self) -> Operator {
        self.symbol(Symbol::G)
    }

    /// K (links × nv): ℰφ G, the gain shifted to the parent.
    #[must_use]
    pub fn K(&self) -> Operator {
        self.symbol(Symbol::K)
    }

    /// Υ (links × links, block-diagonal): diagonal blocks of Ω, by the recursion from base to tips
    /// ```text
    /// Υ(k) = ψ*(p,k) Υ(p) ψ(p,k) + H*(k) D⁻¹(k) H(k)
    /// ```
    #[must_use]
    pub fn upsilon(&self) -> Operator {
        self.symbol(Symbol::Upsilon)
    }

    /// B (links × 6·nodes): maps wrenches on nodes (about each node's origin, world axes) to their links; B* φ* H* is the Jacobian of the nodes. A
    /// node on the world has zero rows.
    #[must_use]
    #[track_caller]
    pub fn B(&self, nodes: &[NodeId]) -> Operator {
        let list: Arc<[usize]> = nodes.iter().map(|n| n.index()).collect();
        assert!(list.iter().all(|n| *n < self.system.nodes.len()), "a node of another mechanism");
        Operator::leaf(&self.system, Expr::Nodes(list, Side::Plain))
    }

    /// Returns `H φ M φ* H* + J`, the mass matrix (nv × nv).
    #[must_use]
    pub fn mass(&self) -> Operator {
        let H_phi = self.H() * self.phi();
        &H_phi * self.M() * H_phi.t() + self.J()
    }

    /// Returns `(I − H ψ K)* D⁻¹ (I − H ψ K)`, the inverse of the mass matrix (nv × nv); on the free coordinates if some are prescribed.
    #[must_use]
    pub fn mass_inverse(&self) -> Operator {
        let innovation = self.identity() - self.H() * self.psi() * self.K();
        innovation.t() * self.D_inv() * innovation
    }

    /// Returns `Ω = ψ* H* D⁻¹ H ψ` (links × links): accelerations of links for unit wrenches.
    #[must_use]
    pub fn omega(&self) -> Operator {
        let H_psi = self.H() * self.psi();
        H_psi.t() * self.D_inv() * H_psi
    }

    /// Returns `φ* H*` (links × nv), the Jacobian of all links.
    #[must_use]
    pub fn jacobian(&self) -> Operator {
        (self.H() * self.phi()).t()
    }

    fn symbol(&self, symbol: Symbol) -> Operator {
        Operator::leaf(&self.system, Expr::Symbol(symbol, Side::Plain))
    }
}
