//! Shared by tests and benches: random mechanisms, and mechanisms from the reference data.
#![allow(dead_code)]

#[path = "../../../../tests/common/splitmix.rs"]
pub mod splitmix;
use linkwork_dynamics::Tree;
use linkwork_dynamics::multibody::{BodySpec, Builder, Coordinate, Hinge, Multibody, SubhingeKind};
use linkwork_dynamics::spatial::nalgebra::{DMatrix, DVector, Rotation3};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Quat, Vec3};
use serde_json::Value;
use splitmix::splitmix;
use std::path::PathBuf;

/// A seeded generator of numbers without zeros (splitmix64).
pub struct Rng(pub u64);

impl Rng {
    pub fn bits(&mut self) -> u64 {
        splitmix(&mut self.0)
    }
    /// ±(0.1 … 1).
    pub fn signed(&mut self) -> f64 {
        let x = 0.1 + 0.9 * (self.bits() >> 11) as f64 / (1u64 << 53) as f64;
        if self.bits() & 1 == 0 { x } else { -x }
    }
    pub fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
    pub fn quat(&mut self) -> Quat {
        Quat::from_scaled_axis(self.vec3() * 2.0)
    }
    pub fn pose(&mut self) -> Pose {
        Pose::new(self.quat(), self.vec3() * 0.5)
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() >> 33) as usize % n
    }
    pub fn vec(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.signed()).collect()
    }
    pub fn mass(&mut self) -> MassProperties {
        // Second moments of a mass distribution: all positive values are physical.
        let s = Vec3::new(self.signed().abs(), self.signed().abs(), self.signed().abs()) * 0.1;
        let principal = Mat3::from_diagonal(&Vec3::new(s.y + s.z, s.x + s.z, s.x + s.y));
        let R = self.quat().to_rotation_matrix().into_inner();
        let I = R * principal * R.transpose();
        MassProperties::new(self.signed().abs() + 0.5, self.vec3() * 0.3, (I + I.transpose()) * 0.5)
    }
    pub fn hinge(&mut self) -> Hinge {
        match self.below(11) {
            0 | 1 => Hinge::pin(self.vec3()),
            2 => Hinge::slider(self.vec3()),
            3 => Hinge::screw(self.vec3(), self.signed()),
            4 => Hinge::ball(),
            5 => Hinge::free(),
            6 => Hinge::locked(),
            7 => Hinge::universal(self.vec3(), self.vec3()),
            8 => Hinge::cylindrical(self.vec3()),
            9 => Hinge::planar(),
            _ => Hinge::chain([SubhingeKind::Slider { axis: self.vec3() }, SubhingeKind::Ball]),
        }
    }
}

/// Options of a random tree.
#[derive(Clone, Copy)]
pub struct Shape {
    pub bodies: usize,
    /// The first body floats and carries all others.
    pub floating: bool,
    /// One subhinge in three is prescribed.
    pub prescribed: bool,
    pub armature: bool,
}

/// A branching tree with all hinge types.
pub fn random_tree(seed: u64, shape: Shape) -> Multibody {
    let mut r = Rng(seed);
    let mut b = Builder::new();
    for i in 0..shape.bodies {
        let first = i == 0;
        let parent = match i {
            0 => "world".to_owned(),
            _ if !shape.floating && r.below(6) == 0 => "world".to_owned(),
            _ => format!("b{:02}", i - 1 - r.below(i.min(3))),
        };
        let mut hinge = if first && shape.floating { Hinge::free() } else { r.hinge() };
        for s in &mut hinge.subhinges {
            if shape.prescribed && r.below(3) == 0 {
                s.coordinate = Coordinate::Prescribed;
            }
            if shape.armature && s.kind != SubhingeKind::Free {
                s.armature = 0.1 * r.signed().abs();
            }
        }
        let (X_PJ, X_BJ) = (r.pose(), r.pose());
        b.body(
            BodySpec::new(format!("b{i:02}"), parent)
                .hinge_in_parent(X_PJ)
                .hinge_in_body(X_BJ)
                .hinge(hinge)
                .mass(r.mass()),
        );
        b.node(format!("n{i:02}"), format!("b{i:02}"), r.pose());
    }
    b.build().unwrap_or_else(|e| panic!("seed {seed}: {e}"))
}

/// Largest difference over the largest size; NaN counts as infinite.
pub fn relative_error(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let (mut worst, mut scale) = (0.0_f64, 1e-300_f64);
    for (x, y) in a.iter().zip(b) {
        if !(x - y).is_finite() {
            return f64::INFINITY;
        }
        worst = worst.max((x - y).abs());
        scale = scale.max(y.abs());
    }
    worst / scale
}

/// Panics unless `a` is within `tol` of `b`, relative to the largest entry of `b`.
#[track_caller]
pub fn close(a: &[f64], b: &[f64], tol: f64, what: &str) {
    let e = relative_error(a, b);
    assert!(e <= tol, "{what}: relative error {e:e} > {tol:e}\n  got  {a:?}\n  want {b:?}");
}

/// Solves a dense symmetric system.
pub fn solve(M: &[f64], n: usize, rhs: &[f64]) -> Vec<f64> {
    let M = DMatrix::from_row_slice(n, n, M);
    let x = M.lu().solve(&DVector::from_column_slice(rhs));
    x.expect("regular matrix").as_slice().to_vec()
}

/// Reads a file of the reference data. If it is missing, prints a line and returns `None`; with `CI` set, fails.
pub fn reference_text(path: &str) -> Option<String> {
    let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference"));
    let text = std::fs::read_to_string(root.join(path)).ok();
    if text.is_none() {
        assert!(std::env::var_os("CI").is_none(), "reference data {path} are missing");
        println!("skipped: reference data {path} is not here");
    }
    text
}

pub fn reference_path(path: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference")).join(path)
}

/// A robot of the reference data, and the mapping of its numbers to Linkwork's.
pub struct Robot {
    pub tree: Tree,
    pub json: Value,
    /// Joint names in the reference's order.
    pub joints: Vec<String>,
    /// For each of the reference's v: index in Linkwork's v.
    pub v_map: Vec<usize>,
    /// For each of the reference's q: index in Linkwork's q.
    pub q_map: Vec<usize>,
}

pub fn nums(v: &Value) -> Vec<f64> {
    v.as_array().expect("array").iter().map(|x| x.as_f64().expect("number")).collect()
}

pub fn vec3(v: &Value) -> Vec3 {
    Vec3::from_column_slice(&nums(v))
}

pub fn mat3(v: &Value) -> Mat3 {
    let rows: Vec<f64> = v.as_array().expect("rows").iter().flat_map(nums).collect();
    Mat3::from_row_slice(&rows)
}

pub fn pose(R: &Value, p: &Value) -> Pose {
    let R = Rotation3::from_matrix_unchecked(mat3(R));
    Pose::new(Quat::from_rotation_matrix(&R), vec3(p))
}

/// The axes in a URDF, in order of joints: `<axis xyz="…"/>` of movable joints.
fn urdf_axes(text: &str) -> Vec<Vec3> {
    text.split("<axis xyz=\"")
        .skip(1)
        .map(|s| {
            let s = s.split('"').next().expect("quoted");
            let n: Vec<f64> = s.split_whitespace().map(|x| x.parse().expect("number")).collect();
            Vec3::from_column_slice(&n)
        })
        .collect()
}

/// Builds a robot of the reference data.
pub fn robot(name: &str) -> Option<Robot> {
    let json: Value =
        serde_json::from_str(&reference_text(&format!("robots/{name}.json"))?).expect("json");
    let axes = urdf_axes(&reference_text(&format!("robots/{name}.urdf"))?);
    let mut b = Builder::new();
    let joints = json["joints"].as_array().expect("joints").clone();
    let name_of = |id: u64| match id {
        0 => "world".to_owned(),
        _ => joints[id as usize - 1]["name"].as_str().expect("name").to_owned(),
    };
    for (i, j) in joints.iter().enumerate() {
        let hinge = match j["type"].as_str().expect("type") {
            "JointModelRX" => Hinge::pin(Vec3::x()),
            "JointModelRY" => Hinge::pin(Vec3::y()),
            "JointModelRZ" => Hinge::pin(Vec3::z()),
            "JointModelRevoluteUnaligned" => Hinge::pin(axes[i]),
            "JointModelFreeFlyer" => Hinge::free(),
            other => panic!("joint type {other}"),
        };
        let parent = name_of(j["parent"].as_u64().expect("parent"));
        let mass = j["mass"].as_f64().expect("mass");
        b.body(
            BodySpec::new(name_of(i as u64 + 1), parent)
                .hinge_in_parent(pose(&j["placement_R"], &j["placement_p"]))
                .hinge(hinge)
                .mass(
                    MassProperties::new(mass, vec3(&j["com"]), mat3(&j["inertia_com"]))
                        // Published robots contain impossible links.
                        .with_check(linkwork_dynamics::spatial::InertiaCheck::PositiveMoments),
                ),
        );
    }
    for f in json["contact_frames"].as_array().expect("frames") {
        let body = name_of(f["joint"].as_u64().expect("joint"));
        b.node(f["name"].as_str().expect("name"), body, pose(&f["R"], &f["p"]));
    }
    let mbs = b.build().unwrap_or_else(|e| panic!("{name}: {e}"));
    let (mut v_map, mut q_map) = (Vec::new(), Vec::new());
    for j in &joints {
        let body = mbs.get(mbs.body(j["name"].as_str().expect("name")).expect("body"));
        let (q, v) = (body.q(), body.v());
        if v.len() == 6 {
            // The reference orders rates as [v; ω], Linkwork as [ω; v].
            v_map.extend([3, 4, 5, 0, 1, 2].map(|i| v.start + i));
        } else {
            v_map.extend(v);
        }
        q_map.extend(q);
    }
    let joints = joints.iter().map(|j| j["name"].as_str().expect("name").to_owned()).collect();
    Some(Robot { tree: Tree::new(&mbs), json, joints, v_map, q_map })
}

impl Robot {
    pub fn q(&self, v: &Value) -> Vec<f64> {
        scatter(&nums(v), &self.q_map)
    }
    pub fn v(&self, v: &Value) -> Vec<f64> {
        scatter(&nums(v), &self.v_map)
    }
    /// A matrix given by rows, one column for each of the reference's v; row after row.
    pub fn columns(&self, v: &Value) -> Vec<f64> {
        v.as_array().expect("rows").iter().flat_map(|row| self.v(row)).collect()
    }
    /// A matrix of partial derivatives: rows and columns by the reference's v.
    pub fn square(&self, v: &Value) -> Vec<f64> {
        let rows: Vec<Vec<f64>> =
            v.as_array().expect("rows").iter().map(|row| self.v(row)).collect();
        let mut out = vec![Vec::new(); rows.len()];
        for (row, i) in rows.into_iter().zip(&self.v_map) {
            out[*i] = row;
        }
        out.concat()
    }
    /// A symmetric matrix given by its upper triangle, row after row.
    pub fn matrix(&self, v: &Value) -> Vec<f64> {
        let (n, x) = (self.v_map.len(), nums(v));
        let mut out = vec![0.0; n * n];
        let mut at = x.iter();
        for i in 0..n {
            for j in i..n {
                let (a, b) = (self.v_map[i], self.v_map[j]);
                let x = *at.next().expect("upper triangle");
                out[a * n + b] = x;
                out[b * n + a] = x;
            }
        }
        out
    }
}

fn scatter(x: &[f64], map: &[usize]) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    for (x, i) in x.iter().zip(map) {
        out[*i] = *x;
    }
    out
}
