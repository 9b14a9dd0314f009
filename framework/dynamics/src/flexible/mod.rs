//! Trees with flexible bodies: the same scatter and gather sweeps, with modes between a body's link and its stations.
//!
//! A flexible body consists of the link that carries its frame, a set of modal coordinates η on that link, and stations that η moves. Each station is
//! a *slot* of the work arrays, after the slots of all links, so that bodies and frames attached to it have an ordinary parent. In the link's axes,
//! with θ = Φ_r η:
//! ```text
//! p = p₀ + Φ_t η − ½ x̂ ηᵀ G η                  R = exp(θ~) R₀
//! Ψ = [Γ(θ) Φ_r;  Φ_t − x̂ (G η)ᵀ]              relative velocity of the station: Ψ η̇ (its H* on η)
//! Ψ̇ η̇                                          relative acceleration with η̈ = 0
//! ```
//! Γ maps rates of a rotation vector to angular velocity. The mass of the body is that of its stations (`shape.rs`).
//!
//! Forces of the modes, −K η − C η̇, are internal: forward dynamics adds them to the given T and inverse dynamics subtracts them, so that T of a
//! modal coordinate is the external force.
//!
//! Rigid trees do not use this module: the public functions test `Tree::flexible` once.

mod forward;
mod inverse;
mod jacobian;
mod kinematics;
mod lanes;
mod layout;
mod mass;
mod shape;
mod sums;

pub(crate) use forward::{apply_inverse_mass, compliance, forward_dynamics, inverse_mass_matrix};
pub(crate) use inverse::inverse_dynamics;
pub(crate) use jacobian::{columns, jacobian_rate};
pub(crate) use kinematics::sweep;
pub(crate) use lanes::Lanes;
pub(crate) use layout::{FlexibleLayout, Hang};
pub(crate) use mass::{centroidal_matrix, com_jacobian, mass_matrix};
pub use sums::elastic_energy;
pub(crate) use sums::{
    apply_coriolis, apply_gravity, body_com, kinetic_energy, mass_moments, momentum,
};
pub(crate) use sums::{bias, com_acceleration, subtree_inertia};

use crate::error::DynamicsError;
use crate::linear::{M3, S3, V3, V6};
use crate::query::{v3, vec3};
use crate::tree::Tree;
use crate::units::{ConstraintMethod, Units, UnitsWork};
use crate::work::Work;
use linkwork_multibody::BodyId;
use linkwork_spatial::{RigidInertia, Vec3};
use std::ops::Range;

/// One step of a sweep, parents first.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Step {
    /// A link, counted from 0: slot k + 1.
    Link(usize),
    /// The modes of a flexible body.
    Set(usize),
}

/// The constants of a tree with flexible bodies in addition to those of its links.
#[derive(Clone, Debug)]
pub(crate) struct Flexible {
    /// Links and sets of modes, parents first.
    pub order: Vec<Step>,
    pub sets: Vec<Set>,
    pub stations: Vec<StationAt>,
    /// Number of links: station i has slot links + 1 + i.
    pub links: usize,
    /// The tree without its loops, with flexible bodies as units; created last.
    pub units: Option<Units>,
}

/// The modes of one body.
#[derive(Clone, Debug)]
pub(crate) struct Set {
    pub body: u32,
    /// Slot of the link that carries the body frame; 0 is the world.
    pub base: u32,
    pub q: usize,
    pub v: usize,
    /// Number of modes.
    pub n: usize,
    /// Range of its stations.
    pub first: usize,
    pub end: usize,
    /// Stiffness and damping matrices, n × n, row after row.
    pub K: Vec<f64>,
    pub C: Vec<f64>,
}

/// The constants of a station, in the axes of the link that carries its body.
#[derive(Clone, Debug)]
pub(crate) struct StationAt {
    pub set: u32,
    pub R: M3<f64>,
    pub p: V3<f64>,
    pub translation: Vec<V3<f64>>,
    /// Rotations of the modes, one per mode; zero if none were given.
    pub rotation: Vec<V3<f64>>,
    pub shortening: Option<(V3<f64>, Vec<f64>)>,
    /// Its own inertia about its origin, station axes, without welded bodies.
    pub own: RigidInertia,
    /// Mass, first moment and inertia about the station's origin, station axes, including welded bodies.
    pub m: f64,
    pub h: V3<f64>,
    pub J: S3<f64>,
    /// Index of its first column in the work arrays.
    pub column: usize,
}

/// Work memory of the modes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Bend {
    /// Ψ of each station, column after column, world axes.
    pub S: Vec<V6<f64>>,
    /// Rate of Ψ in the link's axes, rotated to world axes; it does not include the rotation of the link itself.
    pub S_dot: Vec<V6<f64>>,
    /// K η + C η̇ of each set, by index in β.
    pub elastic: Vec<f64>,
    /// ½ ηᵀ K η of all sets, J.
    pub energy: f64,
    /// β of the last kinematics, and η for modal coordinates.
    pub eta: Vec<f64>,
    pub rate: Vec<f64>,
    /// Memory of `Flexible::units`.
    pub units: Option<Box<UnitsWork>>,
    /// One number per independent rate, and two for each degree of freedom.
    pub y: Vec<f64>,
    pub x: Vec<f64>,
    pub zero: Vec<f64>,
    /// Composite inertia of each slot about its own origin.
    pub composite: Vec<crate::work::Composite<f64>>,
    /// C S of each degree of freedom, about the origin of its link (for modes, of the set's link).
    pub F: Vec<V6<f64>>,
}

impl Bend {
    pub fn new(tree: &Tree) -> Self {
        let Some(flex) = tree.flexible.as_deref() else { return Self::default() };
        let (nv, slots) = (tree.nv(), tree.slots());
        let columns = flex.stations.iter().map(|s| s.translation.len()).sum();
        Self {
            S: vec![V6::default(); columns],
            S_dot: vec![V6::default(); columns],
            elastic: vec![0.0; nv],
            energy: 0.0,
            eta: vec![0.0; nv],
            rate: vec![0.0; nv],
            units: flex.units.as_ref().map(|u| Box::new(UnitsWork::new(tree, u))),
            y: vec![0.0; nv],
            x: vec![0.0; nv],
            zero: vec![0.0; nv],
            composite: vec![Default::default(); slots],
            F: vec![V6::default(); nv],
        }
    }
}

impl Flexible {
    /// Returns the station of a slot; `None` for links and the world.
    #[inline]
    pub fn station(&self, slot: usize) -> Option<usize> {
        slot.checked_sub(self.links + 1)
    }

    pub fn slot(&self, station: usize) -> usize {
        self.links + 1 + station
    }

    /// Returns the modal degrees of freedom of each flexible body, and its first station's slot (0 without stations).
    pub fn modal(&self) -> Vec<(Range<usize>, u32)> {
        let first = |s: &Set| if s.first < s.end { self.slot(s.first) as u32 } else { 0 };
        self.sets.iter().map(|s| (s.v..s.v + s.n, first(s))).collect()
    }

    /// Returns the error of an algorithm that supports only rigid trees.
    #[cold]
    pub fn refuse(&self, tree: &Tree, what: &'static str) -> DynamicsError {
        let body =
            self.sets.first().map_or("", |s| tree.multibody.bodies()[s.body as usize].name());
        DynamicsError::Flexible { body: body.to_owned(), what }
    }
}

/// Lays out the units of a flexible tree.
pub(crate) fn prepare(tree: &mut Tree) {
    if tree.is_flexible() {
        let units = Units::new(tree, |_| ConstraintMethod::Augment);
        if let Some(flex) = &mut tree.flexible {
            flex.units = Some(units);
        }
    }
}

impl Tree {
    /// Returns true if some body is flexible. Algorithms that support only rigid trees then return an error.
    #[must_use]
    pub fn is_flexible(&self) -> bool {
        self.flexible.is_some()
    }

    /// Returns the slot with which a point (m, world) on a body moves: the link of a rigid body; for a flexible body the nearest station, or its
    /// frame if that is nearer.
    pub(crate) fn slot_near(&self, w: &Work<f64>, body: BodyId, point: &Vec3) -> u32 {
        let at = self.body(body);
        let sets = self.flexible.iter().flat_map(|f| f.sets.iter().map(move |s| (f, s)));
        let own = sets.filter(|(_, s)| s.body as usize == body.index());
        let slots = own.flat_map(|(f, s)| (s.first..s.end).map(move |i| f.slot(i)));
        let kin = &w.kin[at.slot as usize];
        let far = |p: V3<f64>| (vec3(&p) - point).norm_squared();
        let frame = (far(kin.p + kin.R.mul(v3(&at.p))), at.slot);
        let nearer = |a: (f64, u32), b: (f64, u32)| if b.0 < a.0 { b } else { a };
        slots.map(|s| (far(w.kin[s].p), s as u32)).fold(frame, nearer).1
    }

    /// Returns an error for a flexible mechanism and an algorithm (`what`) that supports only rigid ones. Call it before functions that assert this,
    /// [`regressor`](crate::regressor()) and [`Derivatives::inverse_dynamics`](crate::Derivatives).
    ///
    /// # Errors
    /// [`DynamicsError::Flexible`] with the first flexible body.
    pub fn check_rigid(&self, what: &'static str) -> Result<(), DynamicsError> {
        self.flexible.as_deref().map_or(Ok(()), |f| Err(f.refuse(self, what)))
    }

    /// Asserts that the mechanism is rigid.
    #[inline]
    #[track_caller]
    pub(crate) fn assert_rigid(&self, what: &'static str) {
        if let Err(e) = self.check_rigid(what) {
            panic!("{e}");
        }
    }
}
