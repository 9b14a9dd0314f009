//! Shared by tests: reference robots with their parts, and generators.
#![allow(dead_code)]

#[path = "../../../../tests/common/splitmix.rs"]
mod splitmix;
use linkwork_embedded::formats::{ReadOptions, read_file, read_srdf};
use linkwork_embedded::spatial::{InertiaCheck, Pose, Quat, Vec3};
use linkwork_embedded::*;
use serde_json::Value;
use splitmix::splitmix;
use std::path::PathBuf;
use std::sync::Arc;

fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference"))
}

/// Returns the path of a file of the reference data.
pub fn file(path: &str) -> PathBuf {
    folder().join(path)
}

/// Reads a file of the reference data. If the data are missing, prints a line and returns `None`; with `CI` set, fails.
pub fn reference(path: &str) -> Option<Value> {
    let Ok(text) = std::fs::read_to_string(folder().join(path)) else {
        assert!(std::env::var_os("CI").is_none(), "reference data {path} are missing");
        println!("skipped: reference data {path} are not here");
        return None;
    };
    Some(serde_json::from_str(&text).unwrap())
}

/// The arms of the reference have moments without mass in their fixed links.
pub fn options() -> ReadOptions {
    ReadOptions { inertia: InertiaCheck::PositiveMoments, ..ReadOptions::default() }
}

/// A reference robot with its parts.
pub fn robot(path: &str, parts: &[PartSpec], objects: Vec<ObjectSpec>) -> Arc<RobotModel> {
    let d = read_file(folder().join(path), &options()).unwrap();
    let mut spec = ModelSpec::from_description(&d).unwrap();
    spec.parts = parts.to_vec();
    spec.objects = objects;
    RobotModel::new(&spec).unwrap()
}

/// A shape of the reference; `key` picks its coarse one.
pub fn shape(v: &Value) -> Shape {
    let of = |k: &str| v[k].as_f64().unwrap();
    let point = |p: &Value| Vec3::from_column_slice(&numbers(p));
    match v["kind"].as_str().unwrap() {
        "sphere" => Shape::Sphere { radius: of("radius") },
        "box" => Shape::Box { half: point(&v["half"]) },
        "capsule" => Shape::Capsule { radius: of("radius"), half_length: of("half_length") },
        "cylinder" => Shape::Cylinder { radius: of("radius"), half_length: of("half_length") },
        "convex_hull" => Shape::ConvexHull {
            points: v["points"].as_array().unwrap().iter().map(point).collect(),
        },
        "mesh" => Shape::Mesh {
            vertices: v["points"].as_array().unwrap().iter().map(point).collect(),
            triangles: (v["triangles"].as_array().unwrap().iter())
                .map(|t| [0, 1, 2].map(|i| t[i].as_u64().unwrap() as u32))
                .collect(),
        },
        other => panic!("{other}"),
    }
}

/// Shapes and rules of a scene of the reference.
pub fn scene(json: &Value) -> (Vec<ColliderSpec>, Rules) {
    let colliders = json["shapes"].as_array().unwrap().iter().map(|s| {
        let text = |k: &str| s[k].as_str().unwrap();
        let x = [numbers(&s["position"]), numbers(&s["quaternion"])].concat();
        let mut spec = ColliderSpec::new(text("name"), text("body"), shape(s)).at(pose(&x));
        spec.coarse = s.get("coarse").map(shape);
        spec
    });
    let ignore = json["ignore"].as_array().unwrap().iter().map(names);
    let ignore = ignore.map(|p| [p[0].clone(), p[1].clone()]).collect();
    (colliders.collect(), Rules { ignore, ..Rules::default() })
}

/// A reference robot with a scene, parts and objects.
pub fn robot_in(
    path: &str,
    json: &Value,
    parts: &[PartSpec],
    objects: Vec<ObjectSpec>,
    more: Vec<ColliderSpec>,
) -> Arc<RobotModel> {
    let d = read_file(folder().join(path), &options()).unwrap();
    let mut spec = ModelSpec::from_description(&d).unwrap();
    spec.parts = parts.to_vec();
    spec.objects = objects;
    (spec.colliders, spec.rules) = scene(json);
    spec.colliders.extend(more);
    RobotModel::new(&spec).unwrap()
}

/// The groups of the two-armed robot.
pub const DUAL: &str = r#"<robot name="dual_ur5">
  <group name="left"><chain base_link="left_base_link" tip_link="left_tcp"/></group>
  <group name="right"><chain base_link="right_base_link" tip_link="right_tcp"/></group>
  <group name="neck"><joint name="neck_pan"/><joint name="neck_tilt"/></group>
  <group name="left_gripper"><link name="left_finger_a"/><link name="left_finger_b"/></group>
  <disable_collisions link1="left_finger_a" link2="left_finger_b" reason="Adjacent"/>
</robot>"#;

/// The two-armed robot with the groups above.
pub fn dual(objects: Vec<ObjectSpec>) -> Option<Arc<RobotModel>> {
    reference("robodarts/dual_ur5_kinematics.json")?;
    let path = folder().join("robodarts/dual_ur5.urdf");
    let d = read_file(path, &options()).unwrap();
    let srdf = read_srdf(DUAL, &ReadOptions::default()).unwrap();
    let mut spec = ModelSpec::from_description(&d).unwrap().groups(&srdf, &d).unwrap();
    spec.objects = objects;
    Some(RobotModel::new(&spec).unwrap())
}

pub fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// A matrix, row after row.
pub fn rows(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().flat_map(numbers).collect()
}

pub fn names(v: &Value) -> Vec<String> {
    v.as_array().unwrap().iter().map(|x| x.as_str().unwrap().to_owned()).collect()
}

/// x y z qx qy qz qw.
pub fn pose(x: &[f64]) -> Pose {
    let q = spatial::nalgebra::Quaternion::new(x[6], x[3], x[4], x[5]);
    Pose::new(Quat::from_quaternion(q), Vec3::new(x[0], x[1], x[2]))
}

/// m and rad between two poses.
pub fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    ((a.position - b.position).norm(), (a.rotation.inverse() * b.rotation).angle())
}

/// Returns the indices in q and β of each of the file's joints.
pub fn places(model: &RobotModel, dof: &[String]) -> Vec<(usize, usize)> {
    dof.iter().map(|n| model.coordinate(n).unwrap_or_else(|| panic!("joint {n}"))).collect()
}

/// Converts numbers of the file's joints to Linkwork's q.
pub fn to_q(model: &RobotModel, places: &[(usize, usize)], x: &[f64]) -> Vec<f64> {
    let mut q = model.multibody().neutral_q();
    for ((at, _), x) in places.iter().zip(x) {
        q[*at] = *x;
    }
    q
}

/// Converts numbers of the file's dofs to Linkwork's β (or τ).
pub fn to_v(model: &RobotModel, places: &[(usize, usize)], x: &[f64]) -> Vec<f64> {
    let mut v = vec![0.0; model.nv()];
    for ((_, at), x) in places.iter().zip(x) {
        v[*at] = *x;
    }
    v
}

/// Returns the largest difference; infinite for NaN and different lengths.
pub fn difference(a: &[f64], b: &[f64]) -> f64 {
    let bad = a.len() != b.len();
    let far = a
        .iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .map(|d| if d.is_nan() { f64::INFINITY } else { d });
    if bad { f64::INFINITY } else { far.fold(0.0, f64::max) }
}

/// The generator of the benchmarks (splitmix64).
#[derive(Clone)]
pub struct Rng(pub u64);

impl Rng {
    pub fn unit(&mut self) -> f64 {
        (splitmix(&mut self.0) >> 11) as f64 / (1u64 << 53) as f64
    }
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// Mass properties of a body of some 10 cm, of mass `m` (kg).
pub fn mass(rng: &mut Rng, m: f64) -> spatial::MassProperties {
    let com = spatial::Vec3::from_fn(|_, _| rng.within(-0.05, 0.05));
    let J = spatial::Vec3::from_fn(|_, _| m * rng.within(2e-3, 3e-3));
    spatial::MassProperties::new(m, com, spatial::Mat3::from_diagonal(&J))
}

/// Returns a pose within 10 cm and a rotation of at most some 100 deg.
pub fn place(rng: &mut Rng) -> spatial::Pose {
    let turn = spatial::Vec3::from_fn(|_, _| rng.within(-1.0, 1.0));
    spatial::Pose::new(
        spatial::Quat::from_scaled_axis(turn),
        spatial::Vec3::from_fn(|_, _| rng.within(-0.1, 0.1)),
    )
}
