//! Free hinges in a step: their velocities have the body's axes, which turn.
//!
//! ```text
//! v̇ = a − ω × v       a: acceleration in axes that do not turn
//! w = v + h (v̇ + ω × v)              at the end of the step, in the axes at its start
//! p⁺ = p + h R w,   v⁺ = exp(−h ω⁺) w
//! ```
//! With w the origin goes straight and keeps its momentum; with v + h v̇ its speed would grow by ω²h/2 in each
//! second, and what rolls would rise from the ground in the eyes of its contact.
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::{BodyId, Multibody, straight};
use linkwork_spatial::{Quat, Vec3};

/// One free hinge.
#[derive(Clone, Copy, Debug)]
struct FreeHinge {
    body: BodyId,
    /// First of its six velocities.
    v: usize,
    /// From the hinge's axes to those of the body.
    axes: Quat,
    /// ω × v at the start of the step.
    transport: Vec3,
}

/// The free hinges of a mechanism.
#[derive(Clone, Debug)]
pub(super) struct Turning {
    hinges: Vec<FreeHinge>,
    /// By body: the sum of ω × v of free hinges inboard, W.
    carried: Vec<Vec3>,
}

impl Turning {
    pub fn new(mbs: &Multibody) -> Self {
        let free = mbs.turning().map(|(body, v)| {
            let axes = mbs.get(body).hinge_in_body().rotation;
            FreeHinge { body, v, axes, transport: Vec3::zeros() }
        });
        Turning { hinges: free.collect(), carried: vec![Vec3::zeros(); mbs.bodies().len()] }
    }

    /// At the start of a step, after kinematics.
    pub fn begin(&mut self, tree: &Tree, ws: &Workspace, v: &[f64]) {
        if self.hinges.is_empty() {
            return;
        }
        self.carried.fill(Vec3::zeros());
        let mbs = tree.multibody();
        for hinge in &mut self.hinges {
            hinge.transport = vector(&v[hinge.v..]).cross(&vector(&v[hinge.v + 3..]));
            let world = ws.body_pose(tree, hinge.body).rotation * (hinge.axes * hinge.transport);
            mbs.subtree(hinge.body).for_each(|body| self.carried[body.index()] += world);
        }
    }

    /// What the acceleration of a body's points lacks in axes that do not turn, W (m/s²).
    pub fn carried(&self, body: Option<BodyId>) -> Vec3 {
        body.map_or_else(Vec3::zeros, |body| self.carried[body.index()])
    }

    /// Velocities v + h v̇ into the axes at the start.
    pub fn enter_start_axes(&self, h: f64, v: &mut [f64]) {
        for hinge in &self.hinges {
            (0..3).for_each(|k| v[hinge.v + 3 + k] += h * hinge.transport[k]);
        }
    }

    /// The displacement of the step as `integrate` wants it, along a screw that ends where the straight way
    /// does; velocities into the axes at the end.
    pub fn leave_start_axes(&self, h: f64, dq: &mut [f64], v: &mut [f64]) {
        for hinge in &self.hinges {
            let d = &mut dq[hinge.v..hinge.v + 6];
            let linear = straight(&vector(d), &vector(&d[3..]));
            d[3..].copy_from_slice(linear.as_slice());
            let v = &mut v[hinge.v..hinge.v + 6];
            let turned = Quat::from_scaled_axis(-h * vector(v)) * vector(&v[3..]);
            v[3..].copy_from_slice(turned.as_slice());
        }
    }
}

fn vector(lanes: &[f64]) -> Vec3 {
    Vec3::new(lanes[0], lanes[1], lanes[2])
}
