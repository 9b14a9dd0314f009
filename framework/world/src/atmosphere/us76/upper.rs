//! US Standard Atmosphere from 86 to 1000 km: molecular diffusion, eddy diffusion and transport of each gas.
//!
//! ```text
//! n_i = n_i7 (T₇/T) exp(−∫ F_i dz)
//! F = M g/(R* T)                                                              N₂
//! F = g/(R* T) D/(D + K) (M_i + M K/D + α_i R*/g dT/dz) + Q (z − U)² e^(−W (z − U)³)
//!     + q (u − z)² e^(−w (u − z)³)                                             O, O₂, Ar, He
//! D_i = a_i/N (T/273.15)^b_i,   M = M₀ up to 100 km, above of what N counts
//! N: of N₂ for O and O₂; of N₂, O, O₂ for Ar and He
//! n_H = (n_H11 − ∫ φ/D_H (T/T₁₁)^(1+α) e^τ dz) (T₁₁/T)^(1+α) e^(−τ),  τ = ∫ M_H g/(R* T) dz from 500 km
//! ```
//! Equations 33 to 41 and Tables 5 to 7 of the standard; internal lengths are in kilometres.

use super::super::gas::Air;
use super::{G0, GAMMA, M0, R_STAR};

const R0: f64 = super::R0 / 1000.0;
const Z7: f64 = 86.0;
/// Number of kilometres in the table.
const COUNT: usize = 914;
/// Number of integration steps in each third of a kilometre.
const STEPS: usize = 2;
/// Avogadro's constant of the standard, 1/kmol.
const AVOGADRO: f64 = 6.022169e26;

const N2: usize = 0;
const O: usize = 1;
const O2: usize = 2;
const AR: usize = 3;
const HE: usize = 4;

const MOLAR: [f64; 5] = [28.0134, 15.9994, 31.9988, 39.948, 4.0026];
const MOLAR_H: f64 = 1.00797;
/// Number densities at 86 km, 1/m³.
const N7: [f64; 5] = [1.129794e20, 8.6e16, 3.030898e19, 1.351400e18, 7.5817e14];
/// a, 1/(m s), b and α of O, O₂, Ar, He.
const DIFFUSION: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [6.986e20, 0.750, 0.0],
    [4.863e20, 0.750, 0.0],
    [4.487e20, 0.870, 0.0],
    [1.700e21, 0.691, -0.40],
];
/// Q, U, W: 1/km³, km, 1/km³.
const TRANSPORT: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [-5.809644e-4, 56.90311, 2.706240e-5],
    [1.366212e-4, 86.0, 8.333333e-5],
    [9.434079e-5, 86.0, 8.333333e-5],
    [-2.457369e-4, 86.0, 6.666667e-4],
];
/// q, u, w of atomic oxygen, below u.
const OXYGEN: [f64; 3] = [-3.416248e-3, 97.0, 5.008765e-4];
/// Hydrogen: n at 500 km, φ (1/(m² s)), a, b, α.
const HYDROGEN: [f64; 5] = [8.0e10, 7.2e11, 3.305e21, 0.5, -0.25];
/// Hydrogen is included from here, km; its integrals start at `Z11`.
const H_FROM: f64 = 150.0;
const Z11: f64 = 500.0;

/// Returns the temperature (K) and its gradient (K/km). `mid`, a height within the step, selects the equation at a seam.
fn temperature(z: f64, mid: f64) -> (f64, f64) {
    if mid < 91.0 {
        (186.8673, 0.0)
    } else if mid < 110.0 {
        let x = (z - 91.0) / 19.9429;
        let root = (1.0 - x * x).sqrt();
        (263.1905 - 76.3232 * root, 76.3232 * x / (19.9429 * root))
    } else if mid < 120.0 {
        (240.0 + 12.0 * (z - 110.0), 12.0)
    } else {
        let k = (R0 + 120.0) / (R0 + z);
        let rest = 640.0 * (-0.01875 * (z - 120.0) * k).exp();
        (1000.0 - rest, 0.01875 * k * k * rest)
    }
}

fn gravity(z: f64) -> f64 {
    let k = R0 / (R0 + z);
    G0 * k * k
}

/// Returns the eddy diffusion, m²/s.
fn eddy(z: f64, mid: f64) -> f64 {
    if mid < 95.0 {
        120.0
    } else if mid < 115.0 {
        let x = z - 95.0;
        120.0 * (1.0 - 400.0 / (400.0 - x * x)).exp()
    } else {
        0.0
    }
}

/// Returns F of the five gases, 1/km, for y = ln(n T).
fn slopes(z: f64, mid: f64, y: &[f64; 5]) -> [f64; 5] {
    let (t, dt) = temperature(z, mid);
    let (g, k) = (gravity(z), eddy(z, mid));
    let n: [f64; 5] = std::array::from_fn(|i| y[i].exp() / t);
    let low = mid < 100.0;
    let three = n[N2] + n[O] + n[O2];
    let mean = (n[N2] * MOLAR[N2] + n[O] * MOLAR[O] + n[O2] * MOLAR[O2]) / three;
    // g/(R* T) is per metre, so multiply by 1000 to get it per kilometre.
    let scale = 1000.0 * g / (R_STAR * t);
    let mut f = [0.0; 5];
    f[N2] = scale * if low { M0 } else { MOLAR[N2] };
    for (i, f) in f.iter_mut().enumerate().skip(1) {
        let light = i == AR || i == HE;
        let count = if light { three } else { n[N2] };
        let m = match (low, light) {
            (true, _) => M0,
            (false, false) => MOLAR[N2],
            (false, true) => mean,
        };
        let [a, b, alpha] = DIFFUSION[i];
        let d = a / count * (t / 273.15).powf(b);
        let thermal = alpha * R_STAR / g * dt / 1000.0;
        *f = scale * (d * (MOLAR[i] + thermal) + m * k) / (d + k) + transport(i, z, mid);
    }
    f
}

fn transport(i: usize, z: f64, mid: f64) -> f64 {
    let [q, u, w] = TRANSPORT[i];
    let x = z - u;
    let mut sum = q * x * x * (-w * x * x * x).exp();
    let [q, u, w] = OXYGEN;
    if i == O && mid < u {
        let x = u - z;
        sum += q * x * x * (-w * x * x * x).exp();
    }
    sum
}

/// Returns ln(n T) of the five gases at every third of a kilometre, by fourth-order Runge–Kutta.
fn integrate() -> Vec<[f64; 5]> {
    let h = 1.0 / (3 * STEPS) as f64;
    let mut y: [f64; 5] = std::array::from_fn(|i| (N7[i] * 186.8673).ln());
    let mut out = vec![y];
    for third in 0..3 * COUNT {
        for step in 0..STEPS {
            let z = Z7 + (third * STEPS + step) as f64 * h;
            let mid = z + 0.5 * h;
            let f = |z: f64, y: &[f64; 5]| slopes(z, mid, y);
            // F is the rate at which y decreases.
            let less = |k: &[f64; 5], h: f64| std::array::from_fn(|i| y[i] - k[i] * h);
            let k1 = f(z, &y);
            let k2 = f(mid, &less(&k1, 0.5 * h));
            let k3 = f(mid, &less(&k2, 0.5 * h));
            let k4 = f(z + h, &less(&k3, h));
            y = std::array::from_fn(|i| y[i] - h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        }
        out.push(y);
    }
    out
}

/// Returns hydrogen at every third of a kilometre, 1/m³, by the trapezoidal rule from 500 km down and up.
fn hydrogen(others: &[[f64; 5]]) -> Vec<f64> {
    let [n11, phi, a, b, alpha] = HYDROGEN;
    let height = |k: usize| Z7 + k as f64 / 3.0;
    let (t11, _) = temperature(Z11, Z11);
    // The first term is 1000 φ/D (T/T₁₁)^(1+α), per km; the second is the rate of τ, per km.
    let terms = |k: usize| {
        let z = height(k);
        let (t, _) = temperature(z, z);
        let count: f64 = others[k].iter().map(|y| y.exp() / t).sum();
        let d = a / count * (t / 273.15).powf(b);
        let flow = 1000.0 * phi / d * (t / t11).powf(1.0 + alpha);
        (flow, 1000.0 * MOLAR_H * gravity(z) / (R_STAR * t), t)
    };
    let start = ((Z11 - Z7) * 3.0).round() as usize;
    let mut n = vec![0.0; others.len()];
    n[start] = n11;
    let mut go = |next: &dyn Fn(usize) -> Option<usize>| {
        let (mut k, mut tau, mut lost) = (start, 0.0, 0.0);
        while let Some(to) = next(k) {
            let h = height(to) - height(k);
            let ((f0, s0, _), (f1, s1, t)) = (terms(k), terms(to));
            let tau1 = tau + 0.5 * h * (s0 + s1);
            lost += 0.5 * h * (f0 * f64::exp(tau) + f1 * f64::exp(tau1));
            tau = tau1;
            n[to] = (n11 - lost) * (t11 / t).powf(1.0 + alpha) * (-tau).exp();
            k = to;
        }
    };
    go(&|k| (height(k) > H_FROM + 0.1).then(|| k - 1));
    go(&|k| (k + 1 < others.len()).then_some(k + 1));
    n
}

/// Cubics of ln ρ and ln p in each kilometre, in Newton's form at thirds.
#[derive(Clone, Debug)]
pub(super) struct Profile(Vec<[[f64; 4]; 2]>);

impl Profile {
    pub(super) fn new() -> Self {
        let others = integrate();
        let light = hydrogen(&others);
        let logs: Vec<[f64; 2]> = others
            .iter()
            .enumerate()
            .map(|(k, y)| {
                let z = Z7 + k as f64 / 3.0;
                let (t, _) = temperature(z, z);
                let n: [f64; 5] = std::array::from_fn(|i| y[i].exp() / t);
                let mass: f64 = n.iter().zip(MOLAR).map(|(n, m)| n * m).sum();
                let density = (mass + light[k] * MOLAR_H) / AVOGADRO;
                let count = n.iter().sum::<f64>() + light[k];
                [density.ln(), (count * R_STAR / AVOGADRO * t).ln()]
            })
            .collect();
        let cubic = |k: usize, c: usize| {
            let mut d: [f64; 4] = std::array::from_fn(|j| logs[3 * k + j][c]);
            for order in 1..4 {
                for j in (order..4).rev() {
                    d[j] = (d[j] - d[j - 1]) / order as f64;
                }
            }
            d
        };
        Self((0..COUNT).map(|k| [cubic(k, 0), cubic(k, 1)]).collect())
    }

    pub(super) fn at(&self, z: f64) -> Air {
        let z = z / 1000.0;
        let k = ((z - Z7) as usize).min(COUNT - 1);
        let x = 3.0 * (z - Z7 - k as f64);
        let value = |d: &[f64; 4]| d[0] + x * (d[1] + (x - 1.0) * (d[2] + (x - 2.0) * d[3]));
        // The table continues linearly beyond its end, with the gradient of the last kilometre.
        let line = |d: &[f64; 4]| {
            let end = d[0] + 3.0 * (d[1] + 2.0 * (d[2] + d[3]));
            end + (end - d[0]) * (x / 3.0 - 1.0)
        };
        let [density, pressure] = self.0[k].map(|d| if x > 3.0 { line(&d) } else { value(&d) });
        let (density, pressure) = (density.exp(), pressure.exp());
        Air {
            density,
            temperature: temperature(z, z).0,
            pressure,
            sound_speed: (GAMMA * pressure / density).sqrt(),
        }
    }
}
