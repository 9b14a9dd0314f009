//! Prints descriptions of files as JSON, for comparisons with other programs in `tests/differential`.
//!
//! Each line of the standard input is a JSON object `{"file": "..", "states": [{"q": {..}, "v": {..}}]}`; each line of the output corresponds to one
//! of them. A state contains the coordinates and rates of joints by name, in MuJoCo's convention: quaternions with w first; for a free joint the
//! position, the quaternion, the velocity in the axes of the world and the angular velocity in the axes of the body. The mass matrix and the bias use
//! the same rates.
//!
//! `{"mesh": ".."}` is answered with the corners of the triangles of a mesh file, `{"map": ".."}` with the nodes of a map of heights.
#![allow(non_snake_case, clippy::unwrap_used)]

use linkwork_dynamics::{Tree, Workspace, inverse_dynamics, kinematics, mass_matrix};
use linkwork_formats::heights::{HeightsOptions, read_heights};
use linkwork_formats::multibody::{Multibody, SubhingeKind};
use linkwork_formats::spatial::nalgebra::{DMatrix, DVector};
use linkwork_formats::spatial::{Pose, Quat, Vec3};
use linkwork_formats::{Description, Geometry, ReadOptions, ShapeRole, mesh_corners, read_file};
use serde_json::{Value, json};
use std::io::BufRead;

fn main() {
    for line in std::io::stdin().lock().lines() {
        let request: Value = serde_json::from_str(&line.unwrap()).unwrap();
        if let Some(file) = request["mesh"].as_str() {
            println!("{}", mesh(file));
            continue;
        }
        if let Some(file) = request["map"].as_str() {
            println!("{}", map(file));
            continue;
        }
        let file = request["file"].as_str().unwrap();
        let packages = request["packages"].as_array().into_iter().flatten();
        let package_paths = packages.filter_map(Value::as_str).map(Into::into).collect();
        let options = ReadOptions { package_paths, ..ReadOptions::default() };
        let out = match read_file(file, &options) {
            Ok(d) => described(&d, &request),
            Err(e) => json!({ "error": e.to_string() }),
        };
        println!("{out}");
    }
}

fn mesh(file: &str) -> Value {
    match mesh_corners(file.as_ref()) {
        Ok(corners) => {
            json!({ "corners": corners.iter().map(|p| p.as_slice()).collect::<Vec<_>>() })
        }
        Err(e) => json!({ "error": e }),
    }
}

/// The nodes of a map; a node without data is null.
fn map(file: &str) -> Value {
    let bytes = std::fs::read(file).unwrap();
    let folder = std::path::Path::new(file).parent().unwrap();
    let mut beside = |name: &str| std::fs::read(folder.join(name)).map_err(|e| e.to_string());
    match read_heights(file, &bytes, &HeightsOptions::default(), &mut beside) {
        Ok(h) => {
            let height = |x: &f32| (!x.is_nan()).then(|| f64::from(*x) + h.datum);
            json!({
                "size": [h.nx, h.ny], "spacing": h.spacing, "origin": h.origin,
                "heights": h.heights.iter().map(height).collect::<Vec<_>>(),
            })
        }
        Err(e) => json!({ "error": e.to_string() }),
    }
}

fn described(d: &Description, request: &Value) -> Value {
    let mut builder = d.builder.clone();
    builder.couplings_mut().extend(d.couplings.iter().cloned());
    let mbs = builder.build().unwrap();
    let states = request["states"].as_array().into_iter().flatten();
    let states: Vec<Value> = states.map(|s| state(d, &mbs, s)).collect();
    let notes = |list: &[linkwork_formats::Ignored]| -> Vec<String> {
        list.iter().map(ToString::to_string).collect()
    };
    json!({
        "bodies": mbs.bodies().iter().map(body).collect::<Vec<_>>(),
        "joints": d.joints.iter().map(|j| joint(&mbs, j)).collect::<Vec<_>>(),
        "devices": d.devices,
        "couplings": d.couplings.len(),
        "loops": d.loops.len(),
        "visuals": d.shapes.iter().filter(|s| s.role == ShapeRole::Visual).count(),
        "contacts": contacts(d, &mbs),
        "height_fields": height_fields(d),
        "ignored": notes(&d.ignored),
        "doubtful": notes(&d.doubtful),
        "states": states,
    })
}

fn body(b: &linkwork_formats::multibody::Body) -> Value {
    let m = b.mass_properties();
    let J = m.inertia_com;
    json!({
        "name": b.name(), "mass": m.mass, "com": m.com.as_slice(),
        "inertia": [J[(0, 0)], J[(1, 1)], J[(2, 2)], J[(0, 1)], J[(0, 2)], J[(1, 2)]],
    })
}

fn finite(x: f64) -> Value {
    if x.is_finite() { json!(x) } else { json!(x.to_string()) }
}

fn joint(mbs: &Multibody, j: &linkwork_formats::Joint) -> Value {
    let chain = mbs.get(mbs.body(&j.body).unwrap()).subhinges();
    let Some(s) = chain.get(j.subhinge).filter(|_| j.count > 0) else {
        return json!({ "name": j.name, "count": 0 });
    };
    let s = s.subhinge;
    json!({
        "name": j.name, "count": j.count, "body": j.body, "subhinge": j.subhinge,
        "lower": finite(s.limits.lower), "upper": finite(s.limits.upper),
        "rate": finite(s.limits.rate), "effort": finite(s.limits.effort), "ball": finite(s.ball.angle),
        "damping": s.damping, "friction": s.friction.force, "armature": s.armature,
        "stiffness": s.spring.stiffness, "rest": s.spring.rest,
    })
}

/// Returns the pairs of named collision shapes on different bodies that collide.
fn contacts(d: &Description, mbs: &Multibody) -> Vec<[String; 2]> {
    let classes = d.collision_classes();
    // Bodies that are welded together count as one.
    let top = |name: &str| -> String {
        let mut at = mbs.body(name);
        while let Some(b) = at.filter(|b| mbs.get(*b).v().is_empty()) {
            at = mbs.get(b).parent();
        }
        at.map_or("world".into(), |b| mbs.get(b).name().to_owned())
    };
    let shapes: Vec<_> = d.shapes.iter().enumerate().collect();
    let mut out = Vec::new();
    for (k, (i, a)) in shapes.iter().enumerate() {
        for (j, b) in &shapes[k + 1..] {
            let named = !a.name.is_empty() && !b.name.is_empty();
            let collide = a.role == ShapeRole::Collision && b.role == ShapeRole::Collision;
            let excluded = d
                .exclusions
                .iter()
                .any(|[x, y]| [x, y] == [&a.body, &b.body] || [x, y] == [&b.body, &a.body]);
            let met = classes.meets[classes.of[*i]].contains(&classes.of[*j]);
            let paired = d.pairs.iter().any(|p| *p == [*i, *j] || *p == [*j, *i]);
            if named && collide && top(&a.body) != top(&b.body) && met && (!excluded || paired) {
                out.push([a.name.clone(), b.name.clone()]);
            }
        }
    }
    out
}

/// Returns the heights of each named height field of the collision shapes, with its spacing.
fn height_fields(d: &Description) -> Vec<Value> {
    let named = d.shapes.iter().filter(|s| s.role == ShapeRole::Collision);
    let field = |s: &linkwork_formats::BodyShape| match &s.geometry {
        Geometry::HeightField { columns, spacing, heights } => Some(json!({
            "name": s.name, "columns": columns, "spacing": spacing, "heights": heights,
        })),
        _ => None,
    };
    named.filter_map(field).collect()
}

/// Returns the error of each coupling and its derivative with respect to the coordinates of joints.
fn couplings(d: &Description, mbs: &Multibody, q: &[f64]) -> Value {
    let joint = |v: usize| {
        let holds = |j: &&linkwork_formats::Joint| {
            let chain = mbs.get(mbs.body(&j.body).unwrap()).subhinges();
            j.count == 1 && chain[j.subhinge].v.start == v
        };
        d.joints.iter().find(holds).map_or_else(String::new, |j| j.name.clone())
    };
    let one = |c: &linkwork_formats::multibody::Coupled| {
        let factors: serde_json::Map<String, Value> = (c.terms.iter().enumerate())
            .map(|(k, (_, v, _))| (joint(*v), json!(c.factor(k, q))))
            .collect();
        (c.coupling.name.clone(), json!({ "error": c.error(q), "factors": factors }))
    };
    Value::Object(mbs.couplings().iter().map(one).collect())
}

fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().map(|a| a.iter().filter_map(Value::as_f64).collect()).unwrap_or_default()
}

/// Converts rates ν' of MuJoCo to rates ν of this engine: ν = T ν'. `drift` is ν̇ for ν̇' = 0.
struct Rates {
    T: DMatrix<f64>,
    drift: DVector<f64>,
}

fn state(d: &Description, mbs: &Multibody, s: &Value) -> Value {
    let mut q = d.configuration(mbs);
    let nv = mbs.nv();
    let order: Vec<&str> =
        s["order"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let count: usize = order.iter().map(|n| numbers(&s["v"][n]).len()).sum();
    let mut rates = Rates { T: DMatrix::zeros(nv, count), drift: DVector::zeros(nv) };
    let mut theirs = Vec::new();
    for name in &order {
        let Some(j) = d.joint(name) else { return json!({ "missing": name }) };
        let chain = mbs.get(mbs.body(&j.body).unwrap()).subhinges();
        let (given, v) = (numbers(&s["q"][name]), numbers(&s["v"][name]));
        let mut at = 0;
        for sub in chain.iter().skip(j.subhinge).take(j.count) {
            let column = theirs.len() + at;
            one(sub, &given, &v, at, column, &mut q, &mut rates);
            at += sub.v.len();
        }
        if at != v.len() {
            return json!({ "missing": format!("{name}: {at} rates, not {}", v.len()) });
        }
        theirs.extend(v);
    }
    let tree = Tree::new(mbs);
    let mut ws = Workspace::new(&tree);
    let v = (&rates.T * DVector::from_vec(theirs)).as_slice().to_vec();
    kinematics(&tree, &mut ws, &q, &v);
    let mut M = vec![0.0; nv * nv];
    mass_matrix(&tree, &mut ws, &mut M);
    let M = rates.T.transpose() * DMatrix::from_row_slice(nv, nv, &M) * &rates.T;
    let mut bias = vec![0.0; nv];
    ws.clear_forces();
    let gravity = numbers(&s["gravity"]);
    ws.apply_uniform_gravity(Vec3::from_column_slice(&gravity));
    inverse_dynamics(&tree, &mut ws, &q, &v, rates.drift.as_slice(), &mut bias);
    let bias = rates.T.transpose() * DVector::from_vec(bias);
    let poses = mbs.body_poses(&q);
    let pose = |X: &Pose| {
        let (p, r) = (X.position, X.rotation);
        json!([p.x, p.y, p.z, r.w, r.i, r.j, r.k])
    };
    let poses: serde_json::Map<String, Value> =
        mbs.bodies().iter().zip(&poses).map(|(b, X)| (b.name().to_owned(), pose(X))).collect();
    json!({ "M": M.as_slice(), "bias": bias.as_slice(), "poses": poses, "q": q,
        "couplings": couplings(d, mbs, &q) })
}

fn one(
    sub: &linkwork_formats::multibody::SubhingeRange,
    given: &[f64],
    v: &[f64],
    at: usize,
    column: usize,
    q: &mut [f64],
    rates: &mut Rates,
) {
    let turn = |w: &[f64]| [w[1], w[2], w[3], w[0]];
    let identity = |rates: &mut Rates| {
        for (k, i) in sub.v.clone().enumerate() {
            rates.T[(i, column + k)] = 1.0;
        }
    };
    match sub.subhinge.kind {
        SubhingeKind::Ball => {
            // A ball is alone, or it is the last of the four subhinges of a free joint with
            // armature. Its quaternion is at the end in both cases.
            let from = given.len() - 4;
            q[sub.q.clone()].copy_from_slice(&turn(&given[from..]));
            identity(rates);
        }
        SubhingeKind::Free => {
            let own = &mut q[sub.q.clone()];
            own[..3].copy_from_slice(&given[..3]);
            own[3..].copy_from_slice(&turn(&given[3..]));
            let [x, y, z, w] = turn(&given[3..]);
            let R = Quat::new_normalize(linkwork_formats::spatial::nalgebra::Quaternion::new(
                w, x, y, z,
            ));
            let (linear, angular) =
                (Vec3::from_column_slice(&v[..3]), Vec3::from_column_slice(&v[3..]));
            let start = sub.v.start;
            for k in 0..3 {
                rates.T[(start + k, column + 3 + k)] = 1.0;
                let e = R.inverse() * Vec3::ith(k, 1.0);
                for i in 0..3 {
                    rates.T[(start + 3 + i, column + k)] = e[i];
                }
            }
            let own = -angular.cross(&(R.inverse() * linear));
            for i in 0..3 {
                rates.drift[start + 3 + i] = own[i];
            }
        }
        _ => {
            q[sub.q.start] = given[at];
            identity(rates);
        }
    }
}
