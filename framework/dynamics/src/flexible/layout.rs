//! Converts modes to sets and stations in link axes. Only stations with mass, and stations that carry something, become slots.

use super::{Flexible, Set, StationAt, Step};
use crate::linear::S3;
use crate::query::v3;
use crate::tree::m3;
use linkwork_multibody::modes::{Carrier, Modes, Station};
use linkwork_multibody::{BodyId, Multibody};
use linkwork_spatial::{Pose, RigidInertia, Vec3};

/// The body or station that carries a frame while the tree is built.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Hang {
    /// A slot; 0 is the world.
    Link(usize),
    /// A station, counted over all bodies.
    Station(usize),
}

impl Hang {
    /// Returns how far its axes were rotated while the tree was laid out; stations are never rotated.
    pub fn of(self, turns: &[Pose]) -> Pose {
        match self {
            Hang::Link(k) => turns[k],
            Hang::Station(_) => Pose::identity(),
        }
    }
}

/// Stations under construction, in body axes.
#[derive(Default)]
pub(crate) struct FlexibleLayout {
    order: Vec<Step>,
    /// Body, and what carries it.
    sets: Vec<(usize, Hang)>,
    /// Set, station, and its index among the body's stations.
    stations: Vec<(usize, Station, Option<usize>)>,
    /// Inertias that are welded to stations.
    welded: Vec<(usize, RigidInertia)>,
}

impl FlexibleLayout {
    pub fn link(&mut self, k: usize) {
        self.order.push(Step::Link(k));
    }

    /// Adds the modes of a body whose frame is carried by `base`.
    pub fn body(&mut self, mbs: &Multibody, id: BodyId, base: Hang) {
        let Some(modes) = mbs.get(id).modes() else { return };
        let set = self.sets.len();
        self.order.push(Step::Set(set));
        self.sets.push((id.index(), base));
        for (i, s) in modes.stations.iter().enumerate().filter(|(_, s)| s.mass.mass > 0.0) {
            self.stations.push((set, s.clone(), Some(i)));
        }
    }

    /// Adds a body that is welded to a station, with its inertia about the station's origin.
    pub fn add_mass(&mut self, station: usize, inertia: &RigidInertia) {
        self.welded.push((station, *inertia));
    }

    /// Returns what carries the frame `X` of a flexible body, and the frame in it.
    pub fn place(&mut self, mbs: &Multibody, on: BodyId, X: &Pose) -> Option<(Hang, Pose)> {
        let modes = mbs.get(on).modes()?;
        let set = self.sets.iter().position(|(b, _)| *b == on.index())?;
        // In a valid mechanism, every frame has a carrier, so an error cannot occur.
        Some(match modes.place(X).ok()? {
            Carrier::Station { station, pose } => (self.own(set, modes, station), pose),
            Carrier::Between { station, pose } => {
                let same = |(_, (s, other, _)): &(usize, &(usize, Station, Option<usize>))| {
                    *s == set && other.pose == station.pose
                };
                let known = self.stations.iter().enumerate().find(same).map(|(i, _)| i);
                (Hang::Station(known.unwrap_or_else(|| self.push((set, *station, None)))), pose)
            }
        })
    }

    fn own(&mut self, set: usize, modes: &Modes, station: usize) -> Hang {
        let known = self.stations.iter().position(|(s, _, i)| (*s, *i) == (set, Some(station)));
        let new = || (set, modes.stations[station].clone(), Some(station));
        Hang::Station(match known {
            Some(i) => i,
            None => self.push(new()),
        })
    }

    fn push(&mut self, station: (usize, Station, Option<usize>)) -> usize {
        self.stations.push(station);
        self.stations.len() - 1
    }

    /// Sorts the stations by set. Returns the data, and the slot of each station.
    pub fn finish(
        self,
        mbs: &Multibody,
        links: usize,
        bodies: &[(Hang, Pose)],
    ) -> (Option<Box<Flexible>>, Vec<usize>) {
        if self.sets.is_empty() {
            return (None, Vec::new());
        }
        let mut by_set: Vec<usize> = (0..self.stations.len()).collect();
        by_set.sort_by_key(|i| self.stations[*i].0);
        let mut slots = vec![0; by_set.len()];
        for (at, i) in by_set.iter().enumerate() {
            slots[*i] = links + 1 + at;
        }
        let slot = |hang: Hang| match hang {
            Hang::Link(k) => k,
            Hang::Station(i) => slots[i],
        };
        let mut flex = Flexible {
            order: self.order,
            sets: Vec::new(),
            stations: Vec::new(),
            links,
            units: None,
        };
        let mut column = 0;
        for (body, base) in &self.sets {
            let (b, X_LB) = (&mbs.bodies()[*body], bodies[*body].1);
            let (n, first, set) = (b.modes_v().len(), flex.stations.len(), flex.sets.len());
            for i in by_set.iter().filter(|i| self.stations[**i].0 == set) {
                let s = &self.stations[*i].1;
                // The mass properties were checked when the mechanism was built, so an error cannot
                // occur.
                let own = s.mass.validate().unwrap_or_default();
                let welded = self.welded.iter().filter(|(at, _)| at == i);
                let inertia = welded.fold(own, |sum, (_, I)| sum + *I);
                let mut at = at_link(s, &inertia, &X_LB, set, &mut column, n);
                at.own = own;
                flex.stations.push(at);
            }
            let (K, C) =
                b.modes().map(|m| (m.stiffness_matrix(), m.damping_matrix())).unwrap_or_default();
            flex.sets.push(Set {
                body: *body as u32,
                base: slot(*base) as u32,
                q: b.modes_q().start,
                v: b.modes_v().start,
                n,
                first,
                end: flex.stations.len(),
                K,
                C,
            });
        }
        (Some(Box::new(flex)), slots)
    }
}

/// Converts a station to the axes of the link on which its body frame has the pose `X_LB`.
fn at_link(
    s: &Station,
    inertia: &RigidInertia,
    X_LB: &Pose,
    set: usize,
    column: &mut usize,
    n: usize,
) -> StationAt {
    let turn = |v: &Vec3| v3(&X_LB.transform_vector(v));
    let X = *X_LB * s.pose;
    let J = inertia.inertia();
    let start = *column;
    *column += n;
    StationAt {
        set: set as u32,
        R: m3(&X.rotation.to_rotation_matrix().into_inner()),
        p: v3(&X.position),
        translation: s.translation.iter().map(turn).collect(),
        rotation: (0..n).map(|i| s.rotation.get(i).map(turn).unwrap_or_default()).collect(),
        shortening: s.shortening.as_ref().map(|g| (turn(&g.axis), g.matrix.clone())),
        own: Default::default(),
        m: inertia.mass(),
        h: v3(&inertia.h()),
        J: S3 {
            xx: J[(0, 0)],
            xy: J[(0, 1)],
            xz: J[(0, 2)],
            yy: J[(1, 1)],
            yz: J[(1, 2)],
            zz: J[(2, 2)],
        },
        column: start,
    }
}
