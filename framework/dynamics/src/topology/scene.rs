//! A mechanism as parts with their own coordinates, so that parts can be moved and assembled again.

use super::TopologyError;
use crate::kinematics::kinematics;
use crate::tree::Tree;
use crate::work::Workspace;
use linkwork_multibody::{BodySpec, Builder, Coupling, LoopClosure, Multibody, NodeSpec};
use linkwork_spatial::{Motion, Pose};

/// A body, its hinge, and the state of the hinge.
#[derive(Clone, Debug)]
pub(super) struct Part {
    pub spec: BodySpec,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
}

#[derive(Clone, Debug, Default)]
pub(super) struct Parts {
    pub bodies: Vec<Part>,
    pub nodes: Vec<NodeSpec>,
    pub loops: Vec<LoopClosure>,
    pub couplings: Vec<Coupling>,
}

/// The assembled parts, in canonical order.
#[derive(Clone, Debug)]
pub(super) struct Scene {
    pub mbs: Multibody,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
}

impl Parts {
    pub fn of(scene: &Scene) -> Self {
        let mbs = &scene.mbs;
        let bodies = mbs.body_ids().map(|id| {
            let body = mbs.get(id);
            let (q, v) = (scene.q[body.q()].to_vec(), scene.v[body.v()].to_vec());
            Part { spec: mbs.spec(id), q, v }
        });
        let nodes = mbs.nodes().iter().map(|n| NodeSpec {
            name: n.name().into(),
            body: mbs.get(n.body()).name().into(),
            pose: n.pose(),
        });
        Self {
            bodies: bodies.collect(),
            nodes: nodes.collect(),
            loops: mbs.loops().iter().map(|l| l.closure.clone()).collect(),
            couplings: mbs.couplings().iter().map(|c| c.coupling.clone()).collect(),
        }
    }

    /// Removes the couplings of coordinates that do not exist any more; returns their names.
    pub fn uncouple(&mut self, body: &str) -> Vec<String> {
        let of = |c: &Coupling| c.terms.iter().any(|t| t.coordinate.body == body);
        let gone: Vec<String> =
            self.couplings.iter().filter(|c| of(c)).map(|c| c.name.clone()).collect();
        self.couplings.retain(|c| !of(c));
        gone
    }

    /// Removes the loops of bodies that do not exist any more; returns their names.
    pub fn open_loops(&mut self, bodies: &[String]) -> Vec<String> {
        let of = |l: &LoopClosure| bodies.contains(&l.body_a) || bodies.contains(&l.body_b);
        let gone: Vec<String> =
            self.loops.iter().filter(|l| of(l)).map(|l| l.name.clone()).collect();
        self.loops.retain(|l| !of(l));
        gone
    }

    pub fn find(&mut self, name: &str) -> Option<&mut Part> {
        self.bodies.iter_mut().find(|p| p.spec.name == name)
    }

    pub fn assemble(&self) -> Result<Scene, TopologyError> {
        let mut builder = Builder::new();
        for part in &self.bodies {
            builder.body(part.spec.clone());
        }
        builder.nodes_mut().extend(self.nodes.iter().cloned());
        builder.loops_mut().extend(self.loops.iter().cloned());
        builder.couplings_mut().extend(self.couplings.iter().cloned());
        let mbs = builder.build()?;
        let (mut q, mut v) = (vec![0.0; mbs.nq()], vec![0.0; mbs.nv()]);
        for part in &self.bodies {
            if let Some(id) = mbs.body(&part.spec.name) {
                q[mbs.get(id).q()].copy_from_slice(&part.q);
                v[mbs.get(id).v()].copy_from_slice(&part.v);
            }
        }
        Ok(Scene { mbs, q, v })
    }
}

impl Scene {
    /// Returns the tree and a workspace with kinematics.
    pub fn moving(&self) -> (Tree, Workspace) {
        let tree = Tree::new(&self.mbs);
        let mut ws = Workspace::new(&tree);
        kinematics(&tree, &mut ws, &self.q, &self.v);
        (tree, ws)
    }
}

/// Returns q and β of a free hinge whose frames are those of the two bodies, from the pose and velocity of the child relative to the parent.
pub(super) fn free_state(X: &Pose, V: &Motion) -> (Vec<f64>, Vec<f64>) {
    let (p, r) = (&X.position, &X.rotation);
    let V = V.rotate(&r.inverse());
    let (w, u) = (&V.angular, &V.linear);
    (vec![p.x, p.y, p.z, r.i, r.j, r.k, r.w], vec![w.x, w.y, w.z, u.x, u.y, u.z])
}
