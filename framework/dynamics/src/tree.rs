//! A mechanism in the form that the kernels use: flat arrays of moving links.
//!
//! A *link* is one moving subhinge with everything that is welded outboard of it. The frames of one-dof subhinges are rotated so that their axis is
//! local z, and about z so that the link's inertia has no xy term. Slot 0 of the work arrays is the world.

use crate::compound::Compounds;
use crate::dofs::Dofs;
use crate::error::DynamicsError;
use crate::flexible::{Flexible, FlexibleLayout, Hang};
use crate::lane::Lane;
use crate::linear::{M3, S3, V3};
use crate::query::v3;
use linkwork_multibody::{BodyId, Coordinate, Multibody, NodeId, SubhingeKind};
use linkwork_spatial::{Mat3, Pose, Quat, RigidInertia, Vec3};
use std::sync::Arc;

/// Kind of motion of a link relative to its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Pin,
    Slider,
    Screw,
    Ball,
    Free,
}

impl Kind {
    /// Returns the number of degrees of freedom.
    pub fn nv(self) -> usize {
        match self {
            Kind::Pin | Kind::Slider | Kind::Screw => 1,
            Kind::Ball => 3,
            Kind::Free => 6,
        }
    }
}

/// The constants of one moving link.
#[derive(Clone, Debug)]
pub(crate) struct Link {
    pub kind: Kind,
    pub coordinate: Coordinate,
    /// Slot of the parent; 0 is the world.
    pub parent: u32,
    /// Slot of the inboard link that hangs on the world.
    pub root: u32,
    pub q: u32,
    pub v: u32,
    /// Index after the last degree of freedom outboard.
    pub v_end: u32,
    /// Index among links with several dof.
    pub multi: u32,
    /// True for the first of its siblings in the gather sweep (the last in order): it writes, the others add.
    pub gathers_first: bool,
    pub leaf: bool,
    /// Its hinge is [`Kind::Free`] and starts at the world's frame.
    pub on_world: bool,
    /// It has no children, its hinge is free in all six directions and hangs on the world at any frame, and it is
    /// [solid](crate::compound::Compound::solid).
    pub lone: bool,
    /// Reflected inertia of the rotor at the coordinate.
    pub armature: f64,
    /// Pitch of a screw, m/rad.
    pub pitch: f64,
    /// Pose in the parent link at q = 0.
    pub R: M3<f64>,
    pub l: V3<f64>,
    /// Mass, first moment and inertia about the link's origin, link axes.
    pub m: f64,
    pub h: V3<f64>,
    pub J: S3<f64>,
    /// The body whose hinge contains this link.
    pub body: u32,
}

/// A frame fixed on a link.
#[derive(Clone, Debug)]
pub(crate) struct OnLink {
    /// Slot of the link; 0 is the world.
    pub slot: u32,
    /// Pose of the frame in the link.
    pub R: Mat3,
    pub p: Vec3,
}

/// A [`Multibody`] prepared for the kernels: constants only, shared by any number of workspaces.
#[derive(Clone, Debug)]
pub struct Tree {
    pub(crate) links: Vec<Link>,
    pub(crate) bodies: Vec<OnLink>,
    /// The bodies that are locked onto each link, as one body.
    pub(crate) compounds: Compounds,
    pub(crate) nodes: Vec<OnLink>,
    /// Frames A and B of each loop.
    pub(crate) anchors: Vec<[OnLink; 2]>,
    pub(crate) multi: usize,
    pub(crate) dofs: Dofs,
    /// Links that rotate about their z axis, with their indices in q; the last one is repeated to fill a block.
    turns: Vec<(u32, u32)>,
    turning: usize,
    /// Every link is [`Link::lone`].
    pub(crate) apart: bool,
    /// All links are outboard of the first.
    pub(crate) one_root: bool,
    pub(crate) multibody: Arc<Multibody>,
    /// Flexible bodies; if there are any, links must be processed in the order of `Flexible::order`.
    pub(crate) flexible: Option<Box<Flexible>>,
    moving_mass: f64,
}

impl Tree {
    /// Prepares a mechanism for the kernels. O(bodies).
    #[must_use]
    pub fn new(multibody: &Multibody) -> Self {
        let mut build = Layout::default();
        for id in multibody.body_ids() {
            build.body(multibody, id);
        }
        let mut tree = build.finish(multibody);
        crate::flexible::prepare(&mut tree);
        tree
    }

    /// Returns the mechanism from which this tree was created.
    #[must_use]
    pub fn multibody(&self) -> &Multibody {
        &self.multibody
    }

    /// Returns the mechanism for an object that keeps it.
    #[must_use]
    pub fn shared_multibody(&self) -> Arc<Multibody> {
        self.multibody.clone()
    }

    /// Returns the number of coordinates in q.
    #[must_use]
    pub fn nq(&self) -> usize {
        self.multibody.nq()
    }

    /// Returns the number of degrees of freedom.
    #[must_use]
    pub fn nv(&self) -> usize {
        self.multibody.nv()
    }

    /// Returns the mass of all bodies that can move, kg, without bodies that are welded to the world.
    #[must_use]
    pub fn total_mass(&self) -> f64 {
        self.moving_mass
    }

    /// Selects the bodies whose inertias [`Tree::set_inertia`] changes repeatedly: the other bodies that move with them are summed here, once.
    /// O(bodies).
    pub fn vary(&mut self, bodies: &[BodyId]) {
        self.compounds.vary(bodies, &self.bodies, &self.multibody);
    }

    /// Sets the inertia of a body, about its origin, body axes. The inertias of everything that moves with its link are summed again, in the order of
    /// the bodies with the variable ones last ([`Tree::vary`]), so the result depends only on the present inertias. O(variable bodies) for a variable
    /// body, otherwise O(bodies that move with it). Allocates in the first call if the mechanism of the tree is shared.
    ///
    /// # Errors
    /// [`DynamicsError::Flexible`] when the body moves with a station of a flexible body.
    pub fn set_inertia(
        &mut self,
        body: BodyId,
        inertia: RigidInertia,
    ) -> Result<(), DynamicsError> {
        let slot = self.bodies[body.index()].slot as usize;
        if slot > self.links.len() {
            let body = self.multibody.get(body).name().to_owned();
            return Err(DynamicsError::Flexible { what: "change of inertia", body });
        }
        Arc::make_mut(&mut self.multibody).set_inertia(body, inertia);
        let Some(link) = slot.checked_sub(1) else { return Ok(()) };
        let sum = self.compounds.changed(body, slot, &self.bodies, &self.multibody);
        let link = &mut self.links[link];
        link.put(&sum, self.compounds.get(slot));
        self.dofs.set_inertia(link);
        self.apart = self.links.iter().all(|l| l.lone);
        self.moving_mass = moving_mass(&self.links, self.flexible.as_deref());
        Ok(())
    }

    /// Returns the number of slots in the work arrays: the world, links, stations of flexible bodies.
    pub(crate) fn slots(&self) -> usize {
        1 + self.links.len() + self.flexible.as_deref().map_or(0, |f| f.stations.len())
    }

    /// Returns the bodies that move with stations of flexible bodies.
    pub(crate) fn bodies_on_stations(&self) -> impl Iterator<Item = BodyId> + '_ {
        let on_station = |b: &BodyId| self.bodies[b.index()].slot as usize > self.links.len();
        self.multibody.body_ids().filter(on_station)
    }

    /// Returns the links that rotate about their z axis, with their indices in q, in whole blocks of a lane.
    #[inline(always)]
    pub(crate) fn turns<L: Lane>(&self) -> &[(u32, u32)] {
        &self.turns[..self.turning.next_multiple_of(L::PACK)]
    }

    /// Writes the links from the base to a node to the end of `path`, which has room for all; returns the index of the first. Returns an empty path
    /// for a tree with stations, because paths may lead through them. O(path).
    pub(crate) fn path_to(&self, n: NodeId, path: &mut [u32]) -> usize {
        let mut at = path.len();
        let mut slot = if self.flexible.is_some() { 0 } else { self.node(n).slot };
        while slot != 0 {
            at -= 1;
            path[at] = slot - 1;
            slot = self.links[slot as usize - 1].parent;
        }
        at
    }

    /// Returns the error for a link that moves no inertia.
    #[cold]
    pub(crate) fn singular(&self, k: usize) -> DynamicsError {
        let body = self.multibody.bodies()[self.links[k].body as usize].name().to_owned();
        DynamicsError::Singular { body, v: self.links[k].v as usize }
    }

    pub(crate) fn body(&self, b: BodyId) -> &OnLink {
        &self.bodies[b.index()]
    }

    pub(crate) fn node(&self, n: NodeId) -> &OnLink {
        &self.nodes[n.index()]
    }
}

/// A link under construction.
struct Draft {
    kind: Kind,
    coordinate: Coordinate,
    parent: Hang,
    q: usize,
    v: usize,
    armature: f64,
    pitch: f64,
    X_PL: Pose,
    inertia: RigidInertia,
    body: u32,
}

#[derive(Default)]
struct Layout {
    drafts: Vec<Draft>,
    /// For each body: the link or station that carries it, and `X_LB`.
    bodies: Vec<(Hang, Pose)>,
    flexible: FlexibleLayout,
}

impl Layout {
    fn body(&mut self, mbs: &Multibody, id: BodyId) {
        let body = mbs.get(id);
        // Frame in which the next subhinge starts, relative to its carrier.
        let (mut slot, mut X_LJ) = self.hang(mbs, body.parent(), &body.hinge_in_parent());
        for s in body.subhinges() {
            let kind = match s.subhinge.kind {
                SubhingeKind::Pin { .. } => Kind::Pin,
                SubhingeKind::Slider { .. } => Kind::Slider,
                SubhingeKind::Screw { .. } => Kind::Screw,
                SubhingeKind::Ball => Kind::Ball,
                SubhingeKind::Free => Kind::Free,
                SubhingeKind::Locked => continue,
            };
            let turn = s.subhinge.kind.axis().map_or_else(Quat::identity, |a| z_to(&a));
            let pitch = match s.subhinge.kind {
                SubhingeKind::Screw { pitch, .. } => pitch,
                _ => 0.0,
            };
            self.drafts.push(Draft {
                kind,
                coordinate: s.subhinge.coordinate,
                parent: slot,
                q: s.q.start,
                v: s.v.start,
                armature: s.subhinge.reflected_inertia(),
                pitch,
                X_PL: X_LJ * Pose::rotation(turn),
                inertia: RigidInertia::zero(),
                body: id.index() as u32,
            });
            self.flexible.link(self.drafts.len() - 1);
            slot = Hang::Link(self.drafts.len());
            X_LJ = Pose::rotation(turn.inverse());
        }
        let X_LB = X_LJ * body.hinge_in_body().inverse();
        let I = body.inertia().rotate(&X_LB.rotation).shift_to_parent(&X_LB.position);
        match slot {
            Hang::Link(0) => {}
            Hang::Link(k) => self.drafts[k - 1].inertia += I,
            Hang::Station(i) => self.flexible.add_mass(i, &I),
        }
        self.bodies.push((slot, X_LB));
        self.flexible.body(mbs, id, slot);
    }

    /// Returns what carries a frame on a body, and the frame relative to that.
    fn hang(&mut self, mbs: &Multibody, on: Option<BodyId>, X: &Pose) -> (Hang, Pose) {
        let Some(on) = on else { return (Hang::Link(0), Pose::identity() * *X) };
        self.flexible.place(mbs, on, X).unwrap_or_else(|| {
            let (slot, X_LB) = self.bodies[on.index()];
            (slot, X_LB * *X)
        })
    }

    /// Rotates one-dof links about their own z until J_xy = 0, and rotates their children back.
    fn remove_xy(&mut self) {
        let mut turns = vec![Pose::identity()];
        for d in &mut self.drafts {
            let turn = if matches!(d.kind, Kind::Ball | Kind::Free) {
                Pose::identity()
            } else {
                let J = d.inertia.inertia();
                let angle = 0.5 * (2.0 * J[(0, 1)]).atan2(J[(0, 0)] - J[(1, 1)]);
                Pose::rotation(Quat::from_axis_angle(&Vec3::z_axis(), angle))
            };
            d.inertia = d.inertia.rotate(&turn.rotation.inverse());
            d.X_PL = d.parent.of(&turns).inverse() * d.X_PL * turn;
            turns.push(turn);
        }
        for (slot, X_LB) in &mut self.bodies {
            *X_LB = slot.of(&turns).inverse() * *X_LB;
        }
    }

    fn finish(mut self, mbs: &Multibody) -> Tree {
        self.remove_xy();
        let nodes: Vec<(Hang, Pose)> =
            mbs.nodes().iter().map(|n| self.hang(mbs, Some(n.body()), &n.pose())).collect();
        let n = self.drafts.len();
        let anchors: Vec<[(Hang, Pose); 2]> = (mbs.loops().iter())
            .map(|l| [&l.a, &l.b].map(|a| self.hang(mbs, a.body, &a.pose)))
            .collect();
        let layout = std::mem::take(&mut self.flexible);
        let (flexible, stations) = layout.finish(mbs, n, &self.bodies);
        let slot = |hang: Hang| match hang {
            Hang::Link(k) => k,
            Hang::Station(i) => stations[i],
        };
        let inboard = |slot: usize| match slot.checked_sub(n + 1).zip(flexible.as_deref()) {
            Some((i, flex)) => flex.sets[flex.stations[i].set as usize].base as usize,
            None => slot,
        };
        let mut last_child = vec![0; n + 1 + stations.len()];
        for (k, d) in self.drafts.iter().enumerate() {
            last_child[slot(d.parent)] = k + 1;
        }
        // In depth-first order the links outboard of a link are contiguous in β.
        let mut v_end: Vec<usize> = self.drafts.iter().map(|d| d.v + d.kind.nv()).collect();
        for k in (0..n).rev() {
            // Find the next link inboard, through any stations.
            let mut at = slot(self.drafts[k].parent);
            while at > n {
                at = inboard(at);
            }
            if let Some(parent) = at.checked_sub(1) {
                v_end[parent] = v_end[parent].max(v_end[k]);
            }
        }
        let mut multi = 0;
        let mut links = Vec::with_capacity(n);
        for (k, d) in self.drafts.iter().enumerate() {
            let mut J = s3(&d.inertia.inertia());
            if d.kind.nv() == 1 {
                // The frame was rotated about the joint axis so that this product of inertia vanishes; remove the round-off.
                J.xy = 0.0;
            }
            links.push(Link {
                kind: d.kind,
                coordinate: d.coordinate,
                parent: slot(d.parent) as u32,
                root: links
                    .get(slot(d.parent).wrapping_sub(1))
                    .map_or(k as u32 + 1, |p: &Link| p.root),
                q: d.q as u32,
                v: d.v as u32,
                v_end: v_end[k] as u32,
                multi,
                gathers_first: last_child[slot(d.parent)] == k + 1,
                leaf: last_child[k + 1] == 0,
                on_world: d.kind == Kind::Free && slot(d.parent) == 0 && d.X_PL == Pose::identity(),
                lone: false,
                armature: d.armature,
                pitch: d.pitch,
                R: m3(&d.X_PL.rotation.to_rotation_matrix().into_inner()),
                l: v3(&d.X_PL.position),
                m: d.inertia.mass(),
                h: v3(&d.inertia.h()),
                J,
                body: d.body,
            });
            multi += u32::from(matches!(d.kind, Kind::Ball | Kind::Free));
        }
        let on_link = |slot: usize, X: &Pose| OnLink {
            slot: slot as u32,
            R: X.rotation.to_rotation_matrix().into_inner(),
            p: X.position,
        };
        let nodes = nodes.iter().map(|(at, X)| on_link(slot(*at), X));
        let anchors = anchors.iter().map(|ends| ends.map(|(at, X)| on_link(slot(at), &X)));
        let mut turns: Vec<_> = (links.iter().enumerate())
            .filter(|(_, l)| matches!(l.kind, Kind::Pin | Kind::Screw))
            .map(|(k, l)| (k as u32, l.q))
            .collect();
        let turning = turns.len();
        let fill = turns.last().copied().unwrap_or_default();
        turns.resize(turning.next_multiple_of(<f64 as Lane>::PACK), fill);
        let nodes: Vec<OnLink> = nodes.collect();
        let bodies: Vec<OnLink> = self.bodies.iter().map(|(at, X)| on_link(slot(*at), X)).collect();
        let compounds = Compounds::new(links.len(), &bodies, mbs);
        for (k, link) in links.iter_mut().enumerate() {
            link.alone(compounds.get(k + 1));
        }
        Tree {
            moving_mass: moving_mass(&links, flexible.as_deref()),
            multi: multi as usize,
            dofs: match flexible.as_deref() {
                None => Dofs::new(&links, mbs.nv()),
                Some(flex) => Dofs::flat(&links, &flex.modal(), mbs.nv()),
            },
            turns,
            turning,
            apart: links.iter().all(|l| l.lone),
            one_root: links.iter().filter(|l: &&Link| l.parent == 0).count() == 1,
            anchors: anchors.collect(),
            nodes,
            bodies,
            compounds,
            links,
            flexible,
            multibody: Arc::new(mbs.clone()),
        }
    }
}

/// Returns the shortest rotation from z to the unit vector `axis`.
fn z_to(axis: &Vec3) -> Quat {
    Quat::rotation_between(&Vec3::z(), axis)
        .unwrap_or_else(|| Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI))
}

fn moving_mass(links: &[Link], flexible: Option<&Flexible>) -> f64 {
    links.iter().map(|l| l.m).sum::<f64>()
        + flexible.map_or(0.0, |f| f.stations.iter().map(|s| s.m).sum())
}

pub(crate) fn s3(J: &Mat3) -> S3<f64> {
    let [xx, xy, xz] = [J[(0, 0)], J[(0, 1)], J[(0, 2)]];
    S3 { xx, xy, xz, yy: J[(1, 1)], yz: J[(1, 2)], zz: J[(2, 2)] }
}

pub(crate) fn m3(m: &Mat3) -> M3<f64> {
    let c = |j: usize| V3 { x: m[(0, j)], y: m[(1, j)], z: m[(2, j)] };
    M3 { x: c(0), y: c(1), z: c(2) }
}
