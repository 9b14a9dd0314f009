//! Wheel on soft soil: stresses under a rigid rim integrated to forces and moments.
//! ```text
//! σ(θ) = k rⁿ (cos θ − cos θ_f)ⁿ                         θ_m ≤ θ ≤ θ_f     (Wong, Reece 1967)
//! σ(θ) = σ(θ_e),  θ_e = θ_f − (θ − θ_r)/(θ_m − θ_r) (θ_f − θ_m)   θ_r ≤ θ < θ_m
//! θ_f = acos(1 − z/r),  θ_r = −acos(1 − λ z/r),  θ_m = (a₀ + a₁ |s|) θ_f,  n = n₀ + n₁ |s|
//! k = k_c/b + k_φ  (Bekker)    k = (c k_c + ρ g b k_φ)/bⁿ  (Reece)
//! j_x = r [m((θ_f − θ) − (sin θ_f − sin θ)) + s ℓ(θ)],  j_y = −r (v_y/(r ω)) q(θ)
//! τ = (c + σ tan φ)(1 − e^(−|j|/K))                      (Janosi, Hanamoto 1961)
//!    along the slip velocity (isotropic), or per axis (independent; Ishigami 2007)
//! F_x = r b ∫ (τ_x cos θ − σ sin θ) dθ      F_z = r b ∫ (τ_x sin θ + σ cos θ) dθ
//! F_y = ∫ (r b τ_y − R_b(h)(r − h cos θ) sin β) dθ        T = r² b ∫ τ_x dθ
//! R_b = D₁ (c h + D₂ ρ g h²/2),  h = r (cos θ − cos θ_f)
//! M_x = r² b ∫ τ_y cos θ dθ + (r − z/2) F_bulldozing                 M_z = r² b ∫ τ_y sin θ dθ
//! ```
//! `grousers` adds the forces of grousers to these.
//!
//! Contact frame: x is the heading of the wheel, y its axle, z points out of the ground; forces act on the wheel.
//! θ runs from the bottom towards the front. `m` is 1 for a wheel that rolls and 0 for one at
//! rest, whose stress is symmetric; with `m = 1`, `ℓ = sin θ_f − sin θ` and `q = θ_f − θ`: the
//! published model. Integrals: The integrals use Gauss-Legendre quadrature with 8 nodes on each smooth piece. For `n` that is not
//! an integer the end of the arc is a power singularity and the error about 1e-5.

use crate::grousers::Grousers;
use crate::multipass::{Rut, Unloading};
use crate::quadrature::{NODES, WEIGHTS};
use linkwork_surroundings::prelude::{BuildError, Soil};
use wide::f64x4;

/// Rim of a wheel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rim {
    /// Radius at which the soil is sheared (rim plus the effective part of the grousers), m.
    pub radius: f64,
    /// Width, m.
    pub width: f64,
}

/// Distribution of the shear stress between the two directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shear {
    /// One Mohr-Coulomb limit for the vector of shear stress, along the slip velocity.
    Isotropic,
    /// A limit for each axis (Ishigami), with moduli `k = slope·β + offset` in m (β in rad). It
    /// can exceed the friction circle by √2 and is kept for comparison.
    Independent {
        /// Longitudinal modulus: slope (m/rad) and offset (m).
        k_x: [f64; 2],
        /// Lateral modulus: slope (m/rad) and offset (m).
        k_y: [f64; 2],
    },
}

/// Pressure-sinkage law that scales the normal stress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sinkage {
    /// `k = k_c/b + k_φ`.
    Bekker,
    /// `k = (c k_c' + γ b k_φ')/bⁿ` with γ the weight of a unit of volume, N/m³. `k_c` and `k_φ` of the soil are then Reece's dimensionless moduli.
    Reece {
        /// Specific weight ρ g, N/m³.
        gamma: f64,
    },
}

/// Motion of the wheel: all quantities except the sinkage on which the stresses depend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Longitudinal slip `1 − v_x/(r ω)` (negative when skidding), dimensionless.
    pub slip: f64,
    /// Lateral creep `v_y/(r ω)`, dimensionless.
    pub lateral: f64,
    /// 1 for a rolling wheel, 0 at rest, and in between at creeping speed.
    pub rolling: f64,
    /// Slip angle `atan2(v_y, |v_x|)` for bulldozing, rad.
    pub beta: f64,
}

impl Motion {
    /// Creates the motion of a rolling wheel with the slip `s` and the slip angle `beta` (rad). `s ≥ 0` is
    /// `1 − v_x/(rω)`, `s < 0` is `rω/v_x − 1` (> −1).
    pub fn rolling(s: f64, beta: f64) -> Motion {
        let ratio = if s >= 0.0 { 1.0 - s } else { 1.0 / (1.0 + s).max(1e-9) };
        Motion { slip: 1.0 - ratio, lateral: ratio * beta.tan(), rolling: 1.0, beta }
    }

    /// Slip on the scale −1 to 1 that the soil's `n₁` and `a₁` use.
    pub fn slip_scale(&self) -> f64 {
        let s = self.slip;
        if s >= 0.0 { s.min(1.0) } else { s / (1.0 - s) }
    }
}

/// Forces (N) and moments (N m) of the soil on the wheel, about the hub, in the contact frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WheelForces {
    /// Drawbar pull.
    pub fx: f64,
    /// Side force.
    pub fy: f64,
    /// Load carried.
    pub fz: f64,
    /// Torque that the drive must supply to turn the wheel forward.
    pub torque: f64,
    /// Overturning moment about the heading.
    pub mx: f64,
    /// Self-aligning moment about the ground normal.
    pub mz: f64,
}

impl WheelForces {
    /// Returns the mean of these forces with the given weight (0 to 1) and of others.
    pub fn mixed(&self, other: &WheelForces, weight: f64) -> WheelForces {
        let mix = |a: f64, b: f64| weight * a + (1.0 - weight) * b;
        WheelForces {
            fx: mix(self.fx, other.fx),
            fy: mix(self.fy, other.fy),
            fz: mix(self.fz, other.fz),
            torque: mix(self.torque, other.torque),
            mx: mix(self.mx, other.mx),
            mz: mix(self.mz, other.mz),
        }
    }
}

/// A rim on a soil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelSoil {
    /// The rim.
    pub rim: Rim,
    /// The soil.
    pub soil: Soil,
    /// Sharing of shear stress.
    pub shear: Shear,
    /// Pressure-sinkage law.
    pub sinkage: Sinkage,
    /// Gravity for the weight of the soil that a side wall pushes, m/s².
    pub gravity: f64,
    /// Angle of approach of bulldozing, rad; `None`: 45° − φ/2.
    pub approach: Option<f64>,
    /// Grousers; `None`: a smooth wheel.
    pub grousers: Option<Grousers>,
}

/// Greatest fraction of the entry angle at which the normal stress may peak.
const PEAK_MAX: f64 = 0.95;

/// Quantities that do not change along the arc.
struct Arc {
    r: f64,
    front: f64,
    middle: f64,
    rear: f64,
    cos_front: f64,
    sin_front: f64,
    n: f64,
    kr: f64,
    /// Ratio of the depth of the rut in which the wheel runs to its radius; `None` on undisturbed ground.
    rut: Option<(Rut, f64)>,
    slip: f64,
    lateral: f64,
    rolling: f64,
    half: f64,
    c: f64,
    tan_phi: f64,
    kx: f64,
    ky: f64,
}

/// Checks that a soil presses back (Bekker) under a face whose shorter side is `b` (m); `param` names that side. Checks that the soil supports the
/// wheel; with a negative cohesive modulus it does not support narrow faces.
///
/// # Errors
/// The modulus is negative; the error contains it and the width above which it is positive.
pub fn presses_back(soil: &Soil, b: f64, param: &str) -> Result<(), BuildError> {
    let k = soil.k_c / b + soil.k_phi;
    if k > 0.0 && k.is_finite() {
        return Ok(());
    }
    let fact = format!("the sinkage modulus of this soil is {k:.3e} under a width of {b} m");
    let help = format!(
        "k_c/b + k_phi must be positive: with k_c = {} and k_phi = {} for widths above {:.4} m",
        soil.k_c,
        soil.k_phi,
        -soil.k_c / soil.k_phi
    );
    Err(BuildError::new(fact).at(param).help(help))
}

impl WheelSoil {
    /// Sinkage modulus `k` of the chosen law, N/m^(n+2), for the exponent `n`.
    pub fn modulus(&self, n: f64) -> f64 {
        let (s, b) = (&self.soil, self.rim.width);
        match self.sinkage {
            Sinkage::Bekker => s.k_c / b + s.k_phi,
            Sinkage::Reece { gamma } => (s.cohesion * s.k_c + gamma * b * s.k_phi) / b.powf(n),
        }
    }

    /// Returns whether the soil supports a rim of this width; with a negative cohesive modulus narrow rims sink without limit.
    ///
    /// # Errors
    /// The modulus, and from which width on it is positive.
    pub fn check(&self) -> Result<(), BuildError> {
        let (k, b) = (self.modulus(self.soil.n), self.rim.width);
        match self.sinkage {
            Sinkage::Bekker => presses_back(&self.soil, b, "width"),
            Sinkage::Reece { .. } if k > 0.0 && k.is_finite() => Ok(()),
            Sinkage::Reece { .. } => {
                let fact =
                    format!("the sinkage modulus of this soil is {k:.3e} under a width of {b} m");
                let help = "c k_c + gamma b k_phi must be positive";
                Err(BuildError::new(fact).at("width").help(help))
            }
        }
    }

    fn arc(&self, z: f64, m: &Motion) -> Arc {
        let (soil, r) = (&self.soil, self.rim.radius);
        let s = m.slip_scale().abs();
        let n = soil.n + soil.n1 * s;
        let cos_front = 1.0 - (z / r).min(1.5);
        let front = cos_front.acos();
        let lambda = m.rolling * soil.lambda + (1.0 - m.rolling);
        let rear = -(1.0 - (lambda * z / r).clamp(0.0, 1.5)).acos();
        let peak = (m.rolling * (soil.a0 + soil.a1 * s)).min(PEAK_MAX);
        let (kx, ky) = match self.shear {
            Shear::Isotropic => (soil.shear_modulus, soil.shear_modulus),
            Shear::Independent { k_x, k_y } => {
                let b = m.beta.abs();
                (k_x[0] * b + k_x[1], k_y[0] * b + k_y[1])
            }
        };
        Arc {
            r,
            front,
            middle: peak * front,
            rear,
            cos_front,
            sin_front: front.sin(),
            n,
            kr: self.modulus(n) * r.powf(n),
            rut: None,
            slip: m.slip,
            lateral: m.lateral,
            rolling: m.rolling,
            half: 0.5 * (front - rear),
            c: soil.cohesion,
            tan_phi: soil.friction_angle.tan(),
            kx,
            ky,
        }
    }

    /// Returns the forces at the sinkage `z` (m, along the ground normal); zero if `z ≤ 0`. Cost:
    /// 16 to 32 evaluations of the stresses, no allocation.
    pub fn forces(&self, z: f64, motion: &Motion) -> WheelForces {
        if z <= 0.0 {
            return WheelForces::default();
        }
        self.forces_on(&self.arc(z, motion), z, motion)
    }

    /// Returns the forces at the sinkage `z` (m) below the bottom of a rut, and the state of the ground after the wheel.
    /// On undisturbed ground they equal those of `forces`.
    pub fn pass(
        &self,
        z: f64,
        motion: &Motion,
        rut: &Rut,
        unloading: &Unloading,
    ) -> (WheelForces, Rut) {
        if z <= 0.0 {
            return (WheelForces::default(), *rut);
        }
        let (k, n) = self.press(motion);
        (self.forces_in(z, motion, rut), rut.pressed(rut.depth() + z, k, n, unloading))
    }

    /// Returns the forces at the sinkage `z` (m) below the bottom of a rut.
    pub fn forces_in(&self, z: f64, motion: &Motion, rut: &Rut) -> WheelForces {
        if z <= 0.0 || rut.sinkage <= 0.0 {
            return self.forces(z, motion);
        }
        let mut arc = self.arc(z, motion);
        arc.rut = Some((*rut, self.modulus(arc.n)));
        self.forces_on(&arc, z, motion)
    }

    /// Returns modulus `k` (N/m^(n+2)) and exponent `n` of the pressure under a wheel with this motion.
    pub fn press(&self, motion: &Motion) -> (f64, f64) {
        let n = self.soil.n + self.soil.n1 * motion.slip_scale().abs();
        (self.modulus(n), n)
    }

    fn forces_on(&self, arc: &Arc, z: f64, motion: &Motion) -> WheelForces {
        let mut sum = Sums::default();
        match self.shear {
            Shear::Isotropic => self.integrate(arc, &mut sum, Arc::shear_isotropic),
            Shear::Independent { .. } => self.integrate(arc, &mut sum, Arc::shear_independent),
        }
        let (r, b) = (self.rim.radius, self.rim.width);
        let bulldozing = self.bulldozing(arc, motion.beta);
        let mut forces = WheelForces {
            fx: r * b * sum.x,
            fy: r * b * sum.y - bulldozing,
            fz: r * b * sum.z,
            torque: r * r * b * sum.t,
            mx: r * r * b * sum.mx - bulldozing * (r - 0.5 * z),
            mz: r * r * b * sum.mz,
        };
        if let Some(grousers) = &self.grousers {
            match self.shear {
                Shear::Isotropic => self.push(grousers, arc, &mut forces, Arc::shear_isotropic),
                Shear::Independent { .. } => {
                    self.push(grousers, arc, &mut forces, Arc::shear_independent);
                }
            }
        }
        forces
    }

    /// Adds the forces of the grousers that are in the ground.
    fn push(
        &self,
        grousers: &Grousers,
        a: &Arc,
        forces: &mut WheelForces,
        shear: impl Fn(&Arc, f64, f64, f64, f64) -> [f64; 2],
    ) {
        let gamma = self.soil.density * self.gravity;
        for theta in grousers.between(a.rear, a.front) {
            let (sin, cos) = theta.sin_cos();
            let equivalent = if theta >= a.middle { cos } else { a.equivalent(theta).cos() };
            let sigma = a.sigma(equivalent);
            let depth = a.r * (equivalent - a.cos_front);
            let limit = grousers.limit(&self.soil, gamma, [self.rim.width, a.r], [depth, sigma]);
            let strength = a.c + sigma * a.tan_phi;
            if strength <= 0.0 {
                continue;
            }
            let force = limit * shear(a, theta, sin, cos, sigma)[0] / strength;
            forces.fx += force * cos;
            forces.fz += force * sin;
            forces.torque += a.r * force;
        }
    }

    fn integrate(
        &self,
        a: &Arc,
        sum: &mut Sums,
        shear: impl Fn(&Arc, f64, f64, f64, f64) -> [f64; 2],
    ) {
        // Where the longitudinal slip velocity changes its sign (skid), the shear stress jumps.
        let ratio = 1.0 - a.slip;
        let turn = if ratio > 1.0 && a.rolling > 0.0 {
            let cos = a.rolling / (a.rolling - a.slip);
            if cos > a.cos_front { cos.acos() } else { f64::INFINITY }
        } else {
            f64::INFINITY
        };
        if !turn.is_finite() {
            self.piece_pair(a, sum, &shear);
            return;
        }
        let clip = |x: f64| x.clamp(a.rear, a.front);
        let mut cuts = [a.rear, clip(-turn), clip(turn), a.middle, a.front];
        cuts.sort_by(f64::total_cmp);
        for w in cuts.windows(2) {
            let (lo, hi) = (w[0], w[1]);
            if hi - lo < 1e-12 {
                continue;
            }
            let (mid, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
            let (sines, cosines) = sin_cos(mid, half);
            for i in 0..8 {
                let (th, weight) = (mid + half * NODES[i], WEIGHTS[i]);
                let (sin, cos) = (sines[i], cosines[i]);
                let equivalent = if th >= a.middle { cos } else { a.equivalent(th).cos() };
                let sigma = a.sigma(equivalent);
                sum.add(weight * half, sin, cos, sigma, shear(a, th, sin, cos, sigma));
            }
        }
    }

    /// Integrates front and rear pieces together: the stress of the rear at a node equals that of the front at the mirrored node, which saves half of
    /// the power functions.
    fn piece_pair(
        &self,
        a: &Arc,
        sum: &mut Sums,
        shear: &impl Fn(&Arc, f64, f64, f64, f64) -> [f64; 2],
    ) {
        let mut stress = [0.0; 8];
        let (mid, half) = (0.5 * (a.middle + a.front), 0.5 * (a.front - a.middle));
        let (sines, cosines) = sin_cos(mid, half);
        for i in 0..8 {
            let th = mid + half * NODES[i];
            let (sin, cos) = (sines[i], cosines[i]);
            stress[i] = a.sigma(cos);
            sum.add(WEIGHTS[i] * half, sin, cos, stress[i], shear(a, th, sin, cos, stress[i]));
        }
        let (mid, half) = (0.5 * (a.rear + a.middle), 0.5 * (a.middle - a.rear));
        let (sines, cosines) = sin_cos(mid, half);
        for i in 0..8 {
            let th = mid + half * NODES[i];
            let (sin, cos) = (sines[i], cosines[i]);
            let sigma = stress[7 - i];
            sum.add(WEIGHTS[i] * half, sin, cos, sigma, shear(a, th, sin, cos, sigma));
        }
    }

    /// Returns the side force of the soil that the wall of the wheel pushes (Hegedus; Ishigami 2007), N.
    fn bulldozing(&self, a: &Arc, beta: f64) -> f64 {
        let sin_beta = beta.sin();
        if sin_beta == 0.0 {
            return 0.0;
        }
        let phi = self.soil.friction_angle;
        let approach = self.approach.unwrap_or(std::f64::consts::FRAC_PI_4 - 0.5 * phi);
        let (d1, d2) = bulldozing_factors(phi, approach);
        let weight = self.soil.density * self.gravity;
        let (mid, half) = (0.5 * (a.rear + a.front), 0.5 * (a.front - a.rear));
        let mut sum = 0.0;
        for (cos, w) in sin_cos(mid, half).1.into_iter().zip(WEIGHTS) {
            let h = a.r * (cos - a.cos_front).max(0.0);
            let pressure = d1 * (self.soil.cohesion * h + 0.5 * d2 * weight * h * h);
            sum += w * half * pressure * (a.r - h * cos);
        }
        sum * sin_beta
    }

    /// Returns the sinkage (m) that carries `load` (N), by bracketed secants on `F_z(z)` in logarithms. `F_z(z)` is monotone without grousers; with
    /// them the bracket still contains a solution. Returns `None` if the wheel does not carry the load at a sinkage of 1.5 radii.
    pub fn sinkage_under(&self, load: f64, motion: &Motion) -> Option<f64> {
        self.sinkage_in(load, motion, &Rut::default())
    }

    /// Returns the sinkage (m) below the bottom of a rut that carries `load` (N), by the same method.
    pub fn sinkage_in(&self, load: f64, motion: &Motion, rut: &Rut) -> Option<f64> {
        let (mut lo, mut hi) = (0.0, 1.5 * self.rim.radius);
        let carries = |z: f64| self.forces_in(z, motion, rut).fz;
        let mut last = (hi, carries(hi));
        if load.is_nan() || load <= 0.0 || last.1 < load {
            return if load == 0.0 { Some(0.0) } else { None };
        }
        let mut z = 0.1 * self.rim.radius;
        for _ in 0..80 {
            let now = (z, carries(z));
            if now.1 > load {
                hi = z
            } else {
                lo = z
            }
            if (now.1 - load).abs() <= 1e-13 * load {
                break;
            }
            // The load is nearly a power of the sinkage.
            let power = (now.1 / last.1).ln() / (now.0 / last.0).ln();
            let secant = z * ((load / now.1).ln() / power).exp();
            let next = if secant > lo && secant < hi { secant } else { 0.5 * (lo + hi) };
            if (next - z).abs() <= 1e-15 * self.rim.radius {
                break;
            }
            (last, z) = (now, next);
        }
        Some(z)
    }
}

/// `D₁ = cot X_c + tan(X_c + φ)` and `D₂ = cot X_c + cot² X_c tan φ` of the bulldozing resistance
/// for an angle of internal friction `phi` and an angle of approach `approach` (rad).
pub fn bulldozing_factors(phi: f64, approach: f64) -> (f64, f64) {
    let cot = 1.0 / approach.tan();
    (cot + (approach + phi).tan(), cot + cot * cot * phi.tan())
}

/// Computes sines and cosines at the nodes of a piece of the arc, four at a time.
#[inline(always)]
fn sin_cos(mid: f64, half: f64) -> ([f64; 8], [f64; 8]) {
    let (mut sin, mut cos) = ([0.0; 8], [0.0; 8]);
    for k in [0, 4] {
        let node = f64x4::new([NODES[k], NODES[k + 1], NODES[k + 2], NODES[k + 3]]);
        let (s, c) = (node * f64x4::splat(half) + f64x4::splat(mid)).sin_cos();
        sin[k..k + 4].copy_from_slice(&s.to_array());
        cos[k..k + 4].copy_from_slice(&c.to_array());
    }
    (sin, cos)
}

impl Arc {
    fn sigma(&self, cos: f64) -> f64 {
        let x = (cos - self.cos_front).max(0.0);
        if let Some((rut, k)) = &self.rut {
            return rut.pressure_at(rut.depth() + self.r * x, *k, self.n);
        }
        self.kr * if self.n == 1.0 { x } else { x.powf(self.n) }
    }

    fn equivalent(&self, th: f64) -> f64 {
        self.front - (th - self.rear) / (self.middle - self.rear) * (self.front - self.middle)
    }

    /// Shear displacement at θ, m.
    fn displacement(&self, th: f64, sin: f64) -> [f64; 2] {
        let turned = self.front - th;
        let run = self.sin_front - sin;
        let m = self.rolling;
        let x = m * (turned - run) + self.slip * (m * run + (1.0 - m) * self.half);
        let y = -self.lateral * (m * turned + (1.0 - m) * self.half);
        [self.r * x, self.r * y]
    }

    fn shear_isotropic(&self, th: f64, sin: f64, cos: f64, sigma: f64) -> [f64; 2] {
        let j = self.displacement(th, sin);
        let size = (j[0] * j[0] + j[1] * j[1]).sqrt();
        let tau = (self.c + sigma * self.tan_phi) * -(-size / self.kx).exp_m1();
        let ux = self.rolling * (1.0 - cos) + self.slip * (1.0 - self.rolling * (1.0 - cos));
        let uy = -self.lateral;
        let u = (ux * ux + uy * uy).sqrt();
        if u < 1e-300 {
            return [0.0, 0.0];
        }
        [tau * ux / u, tau * uy / u]
    }

    fn shear_independent(&self, th: f64, sin: f64, _: f64, sigma: f64) -> [f64; 2] {
        let j = self.displacement(th, sin);
        let limit = self.c + sigma * self.tan_phi;
        let one = |j: f64, k: f64| -(-j.abs() / k).exp_m1() * j.signum() * limit;
        [one(j[0], self.kx), one(j[1], self.ky)]
    }
}

#[derive(Default)]
struct Sums {
    x: f64,
    y: f64,
    z: f64,
    t: f64,
    mx: f64,
    mz: f64,
}

impl Sums {
    fn add(&mut self, w: f64, sin: f64, cos: f64, sigma: f64, tau: [f64; 2]) {
        let [tx, ty] = tau;
        self.x += w * (tx * cos - sigma * sin);
        self.y += w * ty;
        self.z += w * (tx * sin + sigma * cos);
        self.t += w * tx;
        self.mx += w * ty * cos;
        self.mz += w * ty * sin;
    }
}

#[cfg(test)]
#[path = "terramechanics_tests.rs"]
mod tests;
