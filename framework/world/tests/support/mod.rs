//! Shared by the tests: reference files, random numbers with a seed, comparisons that fail for NaN.
#![allow(dead_code, clippy::unwrap_used)]

#[path = "../../../../tests/common/splitmix.rs"]
mod splitmix;
use linkwork_world::spatial::{Mat3, Vec3};
use serde_json::Value;
use splitmix::splitmix;
use std::path::PathBuf;

/// Reads a file of the reference data. If the folder is missing, the test prints this and is skipped; if `CI` is `true`, it fails.
pub fn reference(path: &str) -> Option<String> {
    let root = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference"));
    match std::fs::read_to_string(root.join(path)) {
        Ok(text) => Some(text),
        Err(e) if std::env::var("CI").is_ok_and(|v| v == "true") => {
            panic!("reference file {path}: {e}")
        }
        Err(_) => {
            println!("SKIPPED: no reference file {path}");
            None
        }
    }
}

/// The closed forms and library values of `flight/quick_golden.json`.
pub fn golden() -> Option<Value> {
    let all: Value = serde_json::from_str(&reference("flight/quick_golden.json")?).unwrap();
    Some(all["data"].clone())
}

pub fn numbers(v: &Value) -> Vec<f64> {
    v.as_array().unwrap_or_else(|| panic!("no list: {v}")).iter().map(number).collect()
}

pub fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or_else(|| panic!("no number: {v}"))
}

pub fn vec3(v: &Value) -> Vec3 {
    Vec3::from_column_slice(&numbers(v))
}

/// Rows of a 3 × 3 matrix.
pub fn mat3(v: &Value) -> Mat3 {
    let rows: Vec<f64> = v.as_array().unwrap().iter().flat_map(numbers).collect();
    Mat3::from_row_slice(&rows)
}

/// Checks |a − b| ≤ tol; fails for NaN.
#[track_caller]
pub fn near(a: f64, b: f64, tol: f64, what: &str) {
    let d = (a - b).abs();
    assert!(d <= tol, "{what}: {a:e} and {b:e} differ by {d:e}, more than {tol:e}");
}

/// Compares relative to `b`.
#[track_caller]
pub fn relative(a: f64, b: f64, tol: f64, what: &str) {
    near(a, b, tol * b.abs(), what);
}

/// Compares every entry, absolute.
#[track_caller]
pub fn near3(a: &Vec3, b: &Vec3, tol: f64, what: &str) {
    for k in 0..3 {
        near(a[k], b[k], tol, &format!("{what}[{k}]"));
    }
}

#[track_caller]
pub fn near33(a: &Mat3, b: &Mat3, tol: f64, what: &str) {
    for k in 0..9 {
        near(a[k], b[k], tol, &format!("{what}({}, {})", k % 3, k / 3));
    }
}

/// SplitMix64 (Steele, Lea & Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        splitmix(&mut self.0)
    }

    /// In [a, b).
    pub fn between(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Standard normal (Box–Muller).
    pub fn normal(&mut self) -> f64 {
        let (u, v) = (self.between(1e-300, 1.0), self.between(0.0, 1.0));
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }

    /// Uniform on the sphere of radius r.
    pub fn on_sphere(&mut self, r: f64) -> Vec3 {
        let v = Vec3::new(self.normal(), self.normal(), self.normal());
        v * (r / v.norm())
    }
}

/// Returns the Jacobian of a vector field by central differences of fourth order; columns are ∂/∂x.
pub fn slope(f: impl Fn(&Vec3) -> Vec3, p: &Vec3, h: f64) -> Mat3 {
    let column = |k: usize| {
        let mut e = Vec3::zeros();
        e[k] = h;
        ((f(&(p + e)) - f(&(p - e))) * 8.0 - f(&(p + e * 2.0)) + f(&(p - e * 2.0))) / (12.0 * h)
    };
    Mat3::from_columns(&[column(0), column(1), column(2)])
}

/// Returns the gradient of a scalar field, by the same method.
pub fn gradient(f: impl Fn(&Vec3) -> f64, p: &Vec3, h: f64) -> Vec3 {
    let line = |k: usize| {
        let mut e = Vec3::zeros();
        e[k] = h;
        ((f(&(p + e)) - f(&(p - e))) * 8.0 - f(&(p + e * 2.0)) + f(&(p - e * 2.0))) / (12.0 * h)
    };
    Vec3::new(line(0), line(1), line(2))
}

/// Makes one step of fourth-order Runge–Kutta for r̈ = a(t, r, v).
pub fn rk4(
    a: impl Fn(f64, &Vec3, &Vec3) -> Vec3,
    t: f64,
    (r, v): (Vec3, Vec3),
    h: f64,
) -> (Vec3, Vec3) {
    let a1 = a(t, &r, &v);
    let (r2, v2) = (r + v * (h / 2.0), v + a1 * (h / 2.0));
    let a2 = a(t + h / 2.0, &r2, &v2);
    let (r3, v3) = (r + v2 * (h / 2.0), v + a2 * (h / 2.0));
    let a3 = a(t + h / 2.0, &r3, &v3);
    let (r4, v4) = (r + v3 * h, v + a3 * h);
    let a4 = a(t + h, &r4, &v4);
    (r + (v + (v2 + v3) * 2.0 + v4) * (h / 6.0), v + (a1 + (a2 + a3) * 2.0 + a4) * (h / 6.0))
}
