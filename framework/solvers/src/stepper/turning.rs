//! Free hinges in a step: their velocities are in the body's axes, which rotate.
//!
//! ```text
//! v̇ = a − ω × v       a: acceleration in axes that do not turn
//! w = v + h (v̇ + ω × v + ω × (ω × c))      at the end of the step, in the axes at its start
//! u = w + ω⁺ × c                            velocity of the centre of mass: u = u₀ + h a_c
//! c⁺ goes by h u from c,   v⁺ = exp(−h ω⁺) u − ω⁺ × c
//! ```
//! c is the centre of mass of a body that carries no moving bodies ([`Tree::lone_com`]), else 0. It moves straight and keeps its momentum. With v + h
//! v̇ its speed would increase by ω²h/2 per second, and its contact would see a rolling body rise from the ground. The rotation of such a body is a
//! step of the implicit midpoint rule, which conserves its energy ([`Workspace::add_midpoint_moment`]).
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::{BodyId, Multibody, straight};
use linkwork_spatial::{Force, Quat, Vec3};

/// A free hinge.
#[derive(Clone, Copy, Debug)]
struct FreeHinge {
    body: BodyId,
    /// Index of the first of its six velocities.
    v: usize,
    /// Rotation from the hinge's axes to the body's axes.
    axes: Quat,
    /// Centre of mass of a body that carries no moving bodies, hinge axes; otherwise 0.
    com: Vec3,
    /// Term missing in v̇ at the start of the step: ω × v + ω × (ω × c).
    transport: Vec3,
    /// External wrench before the moment of the midpoint rule was added.
    wrench: Option<Force>,
    /// Angular acceleration of the free rotation by this rule, W.
    turn: Vec3,
}

/// The free hinges of a mechanism.
#[derive(Clone, Debug)]
pub(super) struct Turning {
    hinges: Vec<FreeHinge>,
    /// By body: the sum of ω × v of free hinges inboard, W.
    carried: Vec<Vec3>,
    /// By body: angular acceleration of its free rotation, and the centre of mass about which it rotates, W.
    turns: Vec<(Vec3, Vec3)>,
}

impl Turning {
    pub fn new(mbs: &Multibody) -> Self {
        let free = mbs.turning().map(|(body, v)| {
            let axes = mbs.get(body).hinge_in_body().rotation;
            let (com, transport) = (Vec3::zeros(), Vec3::zeros());
            FreeHinge { body, v, axes, com, transport, wrench: None, turn: Vec3::zeros() }
        });
        let n = mbs.bodies().len();
        let (carried, turns) = (vec![Vec3::zeros(); n], vec![Default::default(); n]);
        Turning { hinges: free.collect(), carried, turns }
    }

    /// Adds the moments of the midpoint rule to the external forces; [`Turning::let_go`] removes them.
    pub fn hold(&mut self, tree: &Tree, ws: &mut Workspace, h: f64) {
        for hinge in &mut self.hinges {
            let com = tree.lone_com(hinge.body);
            hinge.com = com.unwrap_or_else(Vec3::zeros);
            let before = com.map(|_| ws.link_wrench(tree, hinge.body));
            let turn = com.and_then(|_| ws.add_midpoint_moment(tree, hinge.body, h));
            hinge.wrench = before.filter(|_| turn.is_some());
            hinge.turn = turn.unwrap_or_else(Vec3::zeros);
        }
    }

    /// Restores the external forces.
    pub fn let_go(&mut self, tree: &Tree, ws: &mut Workspace) {
        for hinge in &mut self.hinges {
            if let Some(wrench) = hinge.wrench.take() {
                ws.set_link_wrench(tree, hinge.body, wrench);
            }
        }
    }

    /// Starts a step, after kinematics.
    pub fn begin(&mut self, tree: &Tree, ws: &Workspace, v: &[f64]) {
        if self.hinges.is_empty() {
            return;
        }
        self.carried.fill(Vec3::zeros());
        let mbs = tree.multibody();
        for hinge in &mut self.hinges {
            let w = vector(&v[hinge.v..]);
            hinge.transport = w.cross(&(vector(&v[hinge.v + 3..]) + w.cross(&hinge.com)));
            let X = ws.body_pose(tree, hinge.body);
            let world = X.rotation * (hinge.axes * hinge.transport);
            mbs.subtree(hinge.body).for_each(|body| self.carried[body.index()] += world);
            let origin = mbs.get(hinge.body).hinge_in_body().position;
            let center = X.position + X.rotation * (origin + hinge.axes * hinge.com);
            mbs.subtree(hinge.body).for_each(|b| self.turns[b.index()] = (hinge.turn, center));
        }
    }

    /// Returns the term that the acceleration of a body's points lacks in non-rotating axes, W (m/s²).
    pub fn carried(&self, body: Option<BodyId>) -> Vec3 {
        body.map_or_else(Vec3::zeros, |body| self.carried[body.index()])
    }

    /// Returns the acceleration of a point (W) of a body due to its free rotation, W (m/s²). Forces do not cause it, so it is left out of the energy
    /// exchange with forces.
    pub fn free_turn(&self, body: Option<BodyId>, point: &Vec3) -> Vec3 {
        body.map_or_else(Vec3::zeros, |body| {
            let (turn, center) = &self.turns[body.index()];
            turn.cross(&(point - center))
        })
    }

    /// Converts the velocities v + h v̇ into the axes at the start.
    pub fn enter_start_axes(&self, h: f64, v: &mut [f64]) {
        for hinge in &self.hinges {
            (0..3).for_each(|k| v[hinge.v + 3 + k] += h * hinge.transport[k]);
        }
    }

    /// Computes the displacement of the step for `integrate`, along a screw that ends at the end of the straight path, and converts velocities into
    /// the axes at the end.
    pub fn leave_start_axes(&self, h: f64, dq: &mut [f64], v: &mut [f64]) {
        for hinge in &self.hinges {
            let c = &hinge.com;
            let offset = *c != Vec3::zeros();
            let d = &mut dq[hinge.v..hinge.v + 6];
            let (turn, mut way) = (vector(d), vector(&d[3..]));
            if offset {
                way += turn.cross(c) + c - Quat::from_scaled_axis(turn) * c;
            }
            let linear = straight(&turn, &way);
            d[3..].copy_from_slice(linear.as_slice());
            let v = &mut v[hinge.v..hinge.v + 6];
            let (w, mut u) = (vector(v), vector(&v[3..]));
            if offset {
                u += w.cross(c);
            }
            let mut turned = Quat::from_scaled_axis(-h * w) * u;
            if offset {
                turned -= w.cross(c);
            }
            v[3..].copy_from_slice(turned.as_slice());
        }
    }
}

fn vector(lanes: &[f64]) -> Vec3 {
    Vec3::new(lanes[0], lanes[1], lanes[2])
}
