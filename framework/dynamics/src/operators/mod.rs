//! Spatial operators as values: φ ψ H M K D of a system, multiplied and added like numbers.
//!
//! ```text
//! φ = (1 − ℰφ)⁻¹       ℰφ has φ(p,k) at (p, k), p the parent of k
//! ψ = (1 − ℰψ)⁻¹       ψ(p,k) = φ(p,k) (1 − G(k) H(k))
//! D = H P H* + J,  G = P H* D⁻¹,  K = ℰφ G           J: reflected inertia of the rotors, diagonal
//! mass matrix          H φ M φ* H* + J = (I + H φ K) D (I + H φ K)*
//! its inverse          (I − H ψ K)* D⁻¹ (I − H ψ K)
//! compliance           Λ⁻¹ = B* Ω B,  Ω = ψ* H* D⁻¹ H ψ,  Υ = its diagonal blocks
//! ```
//! An [`Operator`] is an expression: products and sums of operators stay symbolic, cost nothing and
//! print as they are read. A product with a vector runs from right to left as sweeps: each symbol
//! visits each link once, so it costs O(links). Rows of a matrix are made only by
//! [`Operator::dense`].
//!
//! Two spaces: *links* (6 numbers each, angular part or moment first, world axes at the link's own
//! origin) and *hinges* (nv numbers); and the *nodes* that [`Operators::B`] is given. A link is one
//! subhinge with what is welded outboard of it: a hinge of two subhinges has two links, the inner
//! one without mass.
//!
//! **Prescribed coordinates.** There G is zero, so ψ(p,k) = φ(p,k); D and D⁻¹ have zero rows and
//! columns. (I − H ψ K)* D⁻¹ (I − H ψ K) is then the inverse of the mass matrix of the free
//! coordinates and zero elsewhere. [`Operators::all_free`] takes every coordinate for free.
//!
//! **Mistakes.** `a * b` cannot return a `Result`, and a panic in the middle of a formula would take
//! the program with it. A product that makes no sense is therefore an operator that carries its
//! error: all that is made from it carries it too, and `apply`, `dense`, `inverse` and `check` report
//! the *first* mistake with both operands. [`Operator::try_mul`] and [`Operator::try_add`] report at once.

mod error;
mod expression;
mod inverse;
mod product;
mod snapshot;
mod sweeps;

pub use error::{Operand, OperatorError};
pub use expression::{Operator, Space};
pub use product::Scratch;

use crate::error::DynamicsError;
use crate::tree::Tree;
use crate::work::Workspace;
use expression::{Expr, Side};
use linkwork_multibody::NodeId;
use snapshot::{Articulation, Snapshot};
use std::sync::Arc;
use sweeps::Symbol;

/// The operators of one system at one configuration. Cheap to clone; operators made from it keep
/// what they need.
#[derive(Clone, Debug)]
pub struct Operators {
    system: Arc<Snapshot>,
}

impl Operators {
    /// Takes them at the last [`kinematics`](crate::kinematics()) or [`poses`](crate::poses) of
    /// `ws`, and computes articulated inertias. O(links). Panics if `ws` was made for another tree.
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] if a free subhinge has nothing to move, [`DynamicsError::Flexible`].
    #[track_caller]
    pub fn new(tree: &Tree, ws: &Workspace) -> Result<Self, DynamicsError> {
        tree.check_rigid("operators")?;
        let system = Arc::new(Snapshot::new(tree, ws, Articulation::AsGiven)?);
        Ok(Self { system })
    }

    /// The same with every coordinate free, prescribed ones too.
    ///
    /// # Errors
    /// As [`Operators::new`].
    #[track_caller]
    pub fn all_free(tree: &Tree, ws: &Workspace) -> Result<Self, DynamicsError> {
        tree.check_rigid("operators")?;
        let system = Arc::new(Snapshot::new(tree, ws, Articulation::AllFree)?);
        Ok(Self { system })
    }

    /// How many links there are: the *links* space has six times as many numbers.
    #[must_use]
    pub fn links(&self) -> usize {
        self.system.links.len()
    }

    /// Degrees of freedom: the size of the *hinges* space.
    #[must_use]
    pub fn nv(&self) -> usize {
        self.system.nv
    }

    /// The body whose hinge a link belongs to; `None` beyond the last link.
    #[must_use]
    pub fn link_body(&self, link: usize) -> Option<&str> {
        self.system.links.get(link).map(|l| self.system.name(l))
    }

    /// 1, of the size that its place in an expression asks for.
    #[must_use]
    pub fn identity(&self) -> Operator {
        Operator::identity()
    }

    /// φ (links × links): forces gathered from the tips; φ* scatters motions from the base.
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

    /// H (nv × links): forces to hinges; H* takes rates to relative velocities.
    #[must_use]
    pub fn H(&self) -> Operator {
        self.symbol(Symbol::H)
    }

    /// M (links × links, block-diagonal): rigid inertia of each link about its origin.
    #[must_use]
    pub fn M(&self) -> Operator {
        self.symbol(Symbol::M)
    }

    /// P (links × links, block-diagonal): articulated inertia, of the link and all outboard.
    #[must_use]
    pub fn P(&self) -> Operator {
        self.symbol(Symbol::P)
    }

    /// D (nv × nv, block-diagonal): articulated inertia that each hinge feels, armature included.
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

    /// B (links × 6·nodes): wrenches on nodes (about each node's origin, world axes) to their links;
    /// B* φ* H* is the Jacobian of the nodes. A node on the world has zero rows.
    #[must_use]
    #[track_caller]
    pub fn B(&self, nodes: &[NodeId]) -> Operator {
        let list: Arc<[usize]> = nodes.iter().map(|n| n.index()).collect();
        assert!(list.iter().all(|n| *n < self.system.nodes.len()), "a node of another mechanism");
        Operator::leaf(&self.system, Expr::Nodes(list, Side::Plain))
    }

    /// `H φ M φ* H* + J`: the mass matrix (nv × nv).
    #[must_use]
    pub fn mass(&self) -> Operator {
        let H_phi = self.H() * self.phi();
        &H_phi * self.M() * H_phi.t() + self.J()
    }

    /// `(I − H ψ K)* D⁻¹ (I − H ψ K)`: its inverse (nv × nv); on the free coordinates when some are
    /// prescribed.
    #[must_use]
    pub fn mass_inverse(&self) -> Operator {
        let innovation = self.identity() - self.H() * self.psi() * self.K();
        innovation.t() * self.D_inv() * innovation
    }

    /// `Ω = ψ* H* D⁻¹ H ψ` (links × links): velocities that unit wrenches cause per unit time.
    #[must_use]
    pub fn omega(&self) -> Operator {
        let H_psi = self.H() * self.psi();
        H_psi.t() * self.D_inv() * H_psi
    }

    /// `φ* H*` (links × nv): the Jacobian of all links.
    #[must_use]
    pub fn jacobian(&self) -> Operator {
        (self.H() * self.phi()).t()
    }

    fn symbol(&self, symbol: Symbol) -> Operator {
        Operator::leaf(&self.system, Expr::Symbol(symbol, Side::Plain))
    }
}
