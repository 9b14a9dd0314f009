//! Colliders as they are stored, and the colliders of a body that touch each other.
use crate::discs::Discs;
use crate::rules::groups;
use crate::shape::Detail;
use crate::solid::{Kind, Solid};
use linkwork_multibody::spatial::{Pose, Vec3};
use linkwork_multibody::{BodyId, Multibody};
use std::sync::Arc;

/// Handle of a collider of one [`Colliders`](crate::Colliders): its index in the order of names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ColliderId(pub(crate) u32);

/// A collider that is ready for queries.
#[derive(Debug)]
pub(crate) struct Item {
    /// Its index in the book.
    pub spec: usize,
    /// Its body.
    pub body: Option<BodyId>,
    /// `X_BC`.
    pub pose: Pose,
    /// Padding, m.
    pub padding: f64,
    /// Discs that replace the fine shape in contact.
    pub discs: Option<Discs>,
    /// Other colliders of its rigid piece that touch or overlap it and may cover its faces.
    pub fellows: Vec<u32>,
    pub(crate) solids: [Option<Arc<Solid>>; 2],
}

impl ColliderId {
    /// Returns its index in the order of names.
    #[must_use]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Distance outside the face at which another shape is tested; narrower gaps count as closed.
pub(crate) const OUTSIDE: f64 = 1e-3;

/// Returns, for each collider, the others of its rigid piece whose bounding boxes overlap with its own. O(n²) in the colliders.
pub(crate) fn fellows(items: &[Item], multibody: &Multibody) -> Vec<Vec<u32>> {
    let world = multibody.bodies().len();
    let group = groups(multibody);
    // Compute poses in the frame of the piece; parents come first.
    let mut in_piece = vec![Pose::identity(); world + 1];
    for (i, body) in multibody.bodies().iter().enumerate() {
        if body.v().is_empty() {
            let parent = in_piece[body.parent().map_or(world, |p| p.index())];
            in_piece[i] = parent * body.hinge_in_parent() * body.hinge_in_body().inverse();
        }
    }
    let place = |item: &Item| item.body.map_or(world, |b| b.index());
    let bounds: Vec<Option<(Vec3, Vec3)>> = (items.iter())
        .map(|item| {
            let solid = item.solid(Detail::Fine)?;
            let covers = matches!(solid.kind, Kind::Convex { .. } | Kind::HalfSpace);
            let X = in_piece[place(item)] * item.pose;
            covers.then(|| around(solid, &X, item.padding + OUTSIDE * solid.size))
        })
        .collect();
    let meet = |i: usize, j: usize| {
        let (Some((lo, hi)), Some((low, high))) = (&bounds[i], &bounds[j]) else { return false };
        (0..3).all(|k| lo[k] <= high[k] && low[k] <= hi[k])
    };
    let of = |i: usize| group[place(&items[i])];
    let near = |i: usize| {
        let all = (0..items.len()).filter(move |j| i != *j);
        all.filter(|j| of(i) == of(*j) && meet(i, *j)).map(|j| j as u32).collect()
    };
    (0..items.len()).map(near).collect()
}

/// Returns the box around a solid at a pose, enlarged by `grow`.
pub(crate) fn around(solid: &Solid, X: &Pose, grow: f64) -> (Vec3, Vec3) {
    let far = f64::INFINITY;
    let finite = solid.lo.iter().chain(solid.hi.iter()).all(|x| x.is_finite());
    if !finite {
        return (Vec3::repeat(-far), Vec3::repeat(far));
    }
    let (mid, half) = ((solid.lo + solid.hi) / 2.0, (solid.hi - solid.lo) / 2.0);
    let R = X.rotation.to_rotation_matrix().into_inner();
    let at = R * mid + X.position;
    let reach = crate::convert::magnitudes(&R) * half;
    let room = grow + 1e-12 * (at.amax() + half.amax());
    (at - reach.add_scalar(room), at + reach.add_scalar(room))
}
