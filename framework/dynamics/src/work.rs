//! Work arrays of the sweeps: one struct per link and sweep, allocated once.

use crate::articulated::Spatial;
use crate::columns::Columns;
use crate::flexible::Bend;
use crate::lane::Lane;
use crate::linear::{M3, S3, V3, V6};
use crate::query::v3;
use crate::tree::Tree;
use linkwork_spatial::{Motion, Pose};

/// Kinematics of a link; world axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Kin<L> {
    /// `R_WL`.
    pub R: M3<L>,
    /// Parent's origin to the link's.
    pub l: V3<L>,
    /// Vector from the world's origin to the link's: used only for queries, never in the dynamics.
    pub p: V3<L>,
    /// Velocity of the link at its origin.
    pub V: V6<L>,
    /// Bias acceleration: the acceleration with every β̇ = 0.
    pub A: V6<L>,
}

/// Articulated-body inertia P and force z about the link's origin, world axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Art<L> {
    pub P: Spatial<L>,
    pub z: V6<L>,
}

/// Data from the gather sweep for the scatter sweep at a one-dof hinge.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct One<L> {
    /// Free: G = P H* D⁻¹. Prescribed: U = P H*.
    pub G: V6<L>,
    /// Free: ν = D⁻¹ ε. Prescribed: H z.
    pub nu: L,
}

/// Data from the gather sweep for the scatter sweep at a hinge with several dofs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Multi<L> {
    /// Free ball: D⁻¹ [I, H].
    pub Gn: M3<L>,
    pub Gf: M3<L>,
    /// Free ball: ν in `n`. Free: P⁻¹ (T − z).
    pub nu: V6<L>,
    /// Prescribed: P and z of the link.
    pub P: Art<L>,
}

/// Composite rigid inertia about the root's origin, world axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Composite<L> {
    pub m: L,
    pub h: V3<L>,
    pub J: S3<L>,
}

/// All work arrays; index 0 is the world.
#[derive(Clone, Debug)]
pub(crate) struct Work<L: Lane> {
    pub kin: Vec<Kin<L>>,
    /// Sine and cosine of the angle of each link that rotates about its z axis.
    pub turns: Vec<(L, L)>,
    pub art: Vec<Art<L>>,
    pub one: Vec<One<L>>,
    pub multi: Vec<Multi<L>>,
    /// Acceleration less bias.
    pub acc: Vec<V6<L>>,
    pub f_ext: Vec<V6<L>>,
    pub force: Vec<V6<L>>,
    /// Composite inertias by block of dofs.
    pub composite: Vec<Composite<L::Block>>,
    /// Vector from the root's origin to the link's, world axes.
    pub r: Vec<V3<L>>,
    /// H* about the roots' origins.
    pub S: Columns<L>,
    /// C H* about the roots' origins.
    pub F: Columns<L>,
    /// Articulated-body inertia that outboard links propagate to each link, about its own origin.
    pub inertia: Vec<Spatial<L>>,
    /// S, and G = P S D⁻¹ (zero at prescribed dofs), about the roots' origins.
    pub sweeps: Vec<(V6<L>, V6<L>)>,
    pub D_inv: Vec<L>,
    /// Forces or accelerations that propagate along the tree, by level.
    pub sweep: Vec<V6<L>>,
    /// Accelerations that propagate outward, in blocks of columns, one row per level of the tree.
    pub outward: Vec<V6<L::Block>>,
    /// True if the frame on which the roots hang is not the world, or is not at rest.
    pub base_moves: bool,
    /// Uniform gravity, world axes.
    pub gravity: V3<L>,
    /// Modes of flexible bodies; empty for rigid trees.
    pub bend: Bend,
    /// Links on the path to a node.
    pub path: Vec<u32>,
}

impl<L: Lane> Work<L> {
    pub fn new(tree: &Tree) -> Self {
        let n = tree.slots();
        let mut kin = vec![Kin::default(); n];
        kin.iter_mut().for_each(|k| k.R = M3::identity());
        Self {
            kin,
            turns: vec![(L::default(), L::default()); n],
            art: vec![Art::default(); n],
            one: vec![One::default(); n],
            multi: vec![Multi::default(); tree.multi],
            acc: vec![V6::default(); n],
            f_ext: vec![V6::default(); n],
            force: vec![V6::default(); n],
            composite: vec![Composite::default(); tree.nv().div_ceil(L::PACK)],
            r: vec![V3::default(); n],
            S: Columns::new(tree.nv()),
            F: Columns::new(tree.nv()),
            inertia: vec![Spatial::default(); n],
            sweeps: vec![Default::default(); tree.nv()],
            D_inv: vec![L::default(); tree.nv()],
            sweep: vec![V6::default(); tree.dofs.levels()],
            outward: vec![V6::default(); tree.nv().div_ceil(L::PACK) * tree.dofs.levels()],
            base_moves: false,
            gravity: V3::default(),
            bend: Bend::new(tree),
            path: vec![0; tree.links.len()],
        }
    }

    pub fn clear_forces(&mut self) {
        self.f_ext.fill(V6::default());
        self.gravity = V3::default();
    }
}

/// Work memory of the algorithms for one tree, in double precision: poses, velocities, external forces, accelerations. Create it once; no algorithm
/// allocates.
#[derive(Clone, Debug)]
pub struct Workspace {
    pub(crate) work: Work<f64>,
}

impl Workspace {
    /// Creates the memory for `tree`; use it only with this tree.
    #[must_use]
    pub fn new(tree: &Tree) -> Self {
        Self { work: Work::new(tree) }
    }

    /// Sets pose, velocity and acceleration (of its origin, in the axes in which the pose is given) of the frame on which the mechanism's roots hang.
    /// For a [`Subgraph`](linkwork_multibody::Subgraph) use the motion of its base body in the whole mechanism, so that the subgraph moves as it does
    /// there. Initially the frame is the world, at rest. Call it before `kinematics`.
    pub fn set_base(&mut self, pose: &Pose, velocity: &Motion, acceleration: &Motion) {
        let R = pose.rotation.to_rotation_matrix();
        let R = R.matrix();
        let column = |j: usize| V3 { x: R[(0, j)], y: R[(1, j)], z: R[(2, j)] };
        let pair = |m: &Motion| V6 { n: v3(&m.angular), f: v3(&m.linear) };
        let base = &mut self.work.kin[0];
        base.R = M3 { x: column(0), y: column(1), z: column(2) };
        base.p = v3(&pose.position);
        base.V = pair(velocity);
        base.A = pair(acceleration);
        let rest = Motion::zero();
        self.work.base_moves =
            *pose != Pose::identity() || *velocity != rest || *acceleration != rest;
    }
}
