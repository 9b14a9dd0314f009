//! Bodies with shapes on a ground, stepped: shared by the contact tests.
#![allow(dead_code)]

use linkwork_collision::{ColliderSpec, Colliders, Material, Rules, Shape};
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Quat, Vec3};
use linkwork_dynamics::{Tree, Workspace, kinematics, kinetic_energy, potential_energy};
use linkwork_solvers::{ConstraintMethod, ContactSettings, ContactStepper, StepReport};
use std::sync::Arc;

pub struct Scene {
    pub builder: Builder,
    pub colliders: Vec<ColliderSpec>,
    pub rules: Rules,
    pub start: Vec<(String, Pose, [f64; 6])>,
    pub gravity: Vec3,
    pub settings: ContactSettings,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            builder: Builder::new(),
            colliders: Vec::new(),
            rules: Rules::default(),
            start: Vec::new(),
            gravity: Vec3::new(0.0, 0.0, -9.81),
            settings: ContactSettings::default(),
        }
    }
}

pub struct Run {
    pub mbs: Multibody,
    pub tree: Tree,
    pub ws: Workspace,
    pub stepper: ContactStepper,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub tau: Vec<f64>,
    pub vdot: Vec<f64>,
    pub gravity: Vec3,
    pub time: f64,
}

pub fn solid_box(mass: f64, half: Vec3) -> MassProperties {
    let (x, y, z) = (half.x * half.x, half.y * half.y, half.z * half.z);
    let J = Mat3::from_diagonal(&(Vec3::new(y + z, x + z, x + y) * (mass / 3.0)));
    MassProperties::new(mass, Vec3::zeros(), J)
}

pub fn solid_ball(mass: f64, radius: f64) -> MassProperties {
    let J = Mat3::identity() * (0.4 * mass * radius * radius);
    MassProperties::new(mass, Vec3::zeros(), J)
}

impl Scene {
    pub fn ground(&mut self, material: Material) -> &mut Self {
        let mut ground = ColliderSpec::new("ground", "world", Shape::HalfSpace);
        ground.material = material;
        self.colliders.push(ground);
        self
    }

    /// A free body with one shape at a pose, with body rates [ω; v].
    pub fn body(
        &mut self,
        name: &str,
        mass: MassProperties,
        shape: Shape,
        material: Material,
        at: Pose,
        rates: [f64; 6],
    ) -> &mut Self {
        self.builder.body(BodySpec::new(name, "world").hinge(Hinge::free()).mass(mass));
        let mut c = ColliderSpec::new(name, name, shape);
        c.material = material;
        self.colliders.push(c);
        self.start.push((name.into(), at, rates));
        self
    }

    pub fn run(&self) -> Run {
        let mbs = self.builder.build().expect("scene");
        let tree = Tree::new(&mbs);
        let colliders =
            Colliders::new(self.colliders.clone(), self.rules.clone(), &mbs).expect("colliders");
        let (mut q, mut v) = (mbs.neutral_q(), vec![0.0; mbs.nv()]);
        for (name, X, rates) in &self.start {
            let b = mbs.get(mbs.body(name).expect("body"));
            let p = &X.position;
            let r = X.rotation.coords;
            q[b.q()].copy_from_slice(&[p.x, p.y, p.z, r.x, r.y, r.z, r.w]);
            v[b.v()].copy_from_slice(rates);
        }
        let stepper =
            ContactStepper::new(&tree, Arc::new(colliders), self.settings.clone(), |_| {
                ConstraintMethod::Auto
            });
        let (nv, ws) = (mbs.nv(), Workspace::new(&tree));
        Run {
            stepper,
            ws,
            q,
            v,
            tau: vec![0.0; nv],
            vdot: vec![0.0; nv],
            gravity: self.gravity,
            time: 0.0,
            mbs,
            tree,
        }
    }
}

impl Run {
    pub fn step(&mut self, h: f64) -> StepReport {
        kinematics(&self.tree, &mut self.ws, &self.q, &self.v);
        self.ws.clear_forces();
        self.ws.apply_uniform_gravity(self.gravity);
        self.vdot.fill(0.0);
        let state = (&mut self.q[..], &mut self.v[..]);
        let report = self
            .stepper
            .step(&self.tree, &mut self.ws, h, state, &[], None, &mut self.tau, &mut self.vdot)
            .unwrap_or_else(|e| panic!("t = {}: {e}", self.time));
        self.time += h;
        report
    }

    /// Returns kinetic plus potential energy of the present state, J.
    pub fn energy(&mut self) -> f64 {
        kinematics(&self.tree, &mut self.ws, &self.q, &self.v);
        self.ws.clear_forces();
        self.ws.apply_uniform_gravity(self.gravity);
        kinetic_energy(&self.tree, &self.ws, &self.v) + potential_energy(&self.tree, &self.ws)
    }

    pub fn pose(&mut self, body: &str) -> Pose {
        kinematics(&self.tree, &mut self.ws, &self.q, &self.v);
        self.ws.body_pose(&self.tree, self.mbs.body(body).expect("body"))
    }

    /// Returns the rates [ω; v] of a free body, body axes.
    pub fn rates(&self, body: &str) -> Vec<f64> {
        self.v[self.mbs.get(self.mbs.body(body).expect("body")).v()].to_vec()
    }
}

pub fn turned(axis: Vec3, angle: f64) -> Quat {
    Quat::from_scaled_axis(axis * angle)
}
