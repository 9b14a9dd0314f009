//! The links of a tree at one configuration as matrices, for algorithms outside of this crate that are written with operators.
use crate::error::DynamicsError;
use crate::linear::S3;
use crate::query::{mat3, v3, vec3};
use crate::tree::{Kind, Link, Tree};
use crate::work::{Kin, Workspace};
use linkwork_multibody::{Coordinate, NodeId};
use linkwork_spatial::nalgebra::{Matrix6, Vector6};
use linkwork_spatial::{Mat3, Vec3, skew};

/// A link (one subhinge with everything that is welded outboard of it) at the last [`kinematics`](crate::kinematics()); world axes at its origin.
#[derive(Clone, Debug)]
pub struct LinkView {
    /// Index of the parent link; `None`: the world.
    pub parent: Option<usize>,
    /// Vector from the parent's origin to the link's (m).
    pub offset: Vec3,
    /// Index of its first rate in β.
    pub v: usize,
    /// Index of the body to whose hinge it belongs.
    pub body: usize,
    /// Whether its coordinates are free or prescribed.
    pub coordinate: Coordinate,
    /// Inertia of the rotor at each of its coordinates (kg m² or kg).
    pub armature: f64,
    /// Rigid inertia M about its origin, angular part first (kg m², kg m, kg).
    pub inertia: Matrix6<f64>,
    /// Columns of H*, one per rate, angular part first.
    pub hinge_map: Vec<Vector6<f64>>,
}

/// Returns the links at the last [`kinematics`](crate::kinematics()) or [`poses`](crate::poses) of `ws`, parents before children. Panics if `ws` was made
/// for another tree.
///
/// # Errors
/// [`DynamicsError::Flexible`], because a flexible body is more than a rigid inertia.
#[track_caller]
pub fn link_views(tree: &Tree, ws: &Workspace) -> Result<Vec<LinkView>, DynamicsError> {
    tree.check_rigid("operators")?;
    let kin = &ws.work.kin;
    assert_eq!(kin.len(), tree.links.len() + 1, "workspace made for another tree");
    let view = |(link, kin): (&Link, &Kin<f64>)| LinkView {
        parent: (link.parent as usize).checked_sub(1),
        offset: vec3(&kin.l),
        v: link.v as usize,
        body: link.body as usize,
        coordinate: link.coordinate,
        armature: link.armature,
        inertia: rigid(link, kin),
        hinge_map: hinge_map(link, kin),
    };
    Ok(tree.links.iter().zip(&kin[1..]).map(view).collect())
}

/// Returns the index of the link that carries a node (`None`: the world), and the vector from its origin to the node's (m, world axes).
#[must_use]
pub fn node_offset(tree: &Tree, ws: &Workspace, node: NodeId) -> (Option<usize>, Vec3) {
    let at = &tree.nodes[node.index()];
    let slot = at.slot as usize;
    (slot.checked_sub(1), vec3(&ws.work.kin[slot].R.mul(v3(&at.p))))
}

/// Returns M of a link, world axes about its origin.
fn rigid(link: &Link, kin: &Kin<f64>) -> Matrix6<f64> {
    let S3 { xx, xy, xz, yy, yz, zz } = link.J;
    let R = mat3(&kin.R);
    let J = R * Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * R.transpose();
    let h = skew(&vec3(&kin.R.mul(link.h)));
    let mut M = Matrix6::zeros();
    M.fixed_view_mut::<3, 3>(0, 0).copy_from(&((J + J.transpose()) * 0.5));
    M.fixed_view_mut::<3, 3>(0, 3).copy_from(&h);
    M.fixed_view_mut::<3, 3>(3, 0).copy_from(&-h);
    M.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Mat3::identity() * link.m));
    M
}

/// Returns the columns of H* of a link, world axes.
fn hinge_map(link: &Link, kin: &Kin<f64>) -> Vec<Vector6<f64>> {
    let (R, o) = (mat3(&kin.R), Vec3::zeros());
    let pair = |n: Vec3, f: Vec3| Vector6::new(n.x, n.y, n.z, f.x, f.y, f.z);
    let axis = |j: usize| Vec3::from(R.column(j));
    match link.kind {
        Kind::Pin => vec![pair(axis(2), o)],
        Kind::Slider => vec![pair(o, axis(2))],
        Kind::Screw => vec![pair(axis(2), axis(2) * link.pitch)],
        Kind::Ball => (0..3).map(|j| pair(axis(j), o)).collect(),
        Kind::Free => {
            let turns = (0..3).map(|j| pair(axis(j), o));
            turns.chain((0..3).map(|j| pair(o, axis(j)))).collect()
        }
    }
}
