//! Acceleration and its gradient from spherical harmonics, without a singularity at the poles.
//!
//! The method is Pines, *Uniform representation of the gravitational potential and its derivatives*, AIAA Journal 11 (1973). With r̂ = (s, t, u) the
//! potential is a polynomial in s, t, u:
//! ```text
//! V = μ/r Σ_m [p_m(u) r_m(s,t) + q_m(u) i_m(s,t)],   r_m + i i_m = (s + i t)ᵐ
//! p_m = Σ_n F_nm C̄_nm,  q_m = Σ_n F_nm S̄_nm,   F_nm = (R/r)ⁿ Ā_nm(u),  Ā_nm = P̄_nm / cosᵐφ
//! Ā_mm = √((2m+1)/2m) Ā_m-1,m-1,  Ā_11 = √3,  Ā_00 = 1
//! Ā_nm = a u Ā_n-1,m − b Ā_n-2,m      a² = (2n−1)(2n+1)/((n−m)(n+m))
//!                                     b² = (2n+1)(n+m−1)(n−m−1)/((n−m)(n+m)(2n−3))
//! ```
//! The column recursion is stable (the forward column method of Holmes & Featherstone, *J. Geodesy* 76 (2002)). The leading factor of each degree is
//! moved into the coefficients:
//! ```text
//! F_nm = s_nm G_nm,   s_nm = a_m+1 a_m+2 … a_n        G_n = uρ G_n-1 − β ρ² G_n-2       ρ = R/r
//! β = b_n/(a_n a_n-1) = (n+m−1)(n−m−1)/((2n−1)(2n−3))
//! D = ∂G/∂u /ρ:      D_n = uρ D_n-1 + G_n-1 − βρ² D_n-2
//! E = ∂²G/∂u² /2ρ²:  E_n = uρ E_n-1 + D_n-1 − βρ² E_n-2
//! ```
//! s_nm grows as 2ⁿ⁻ᵐ, to 10¹⁰⁸ at degree 360, and G_nm decreases at the same rate, so both stay far from the limits of double precision.
//!
//! Sums over n are computed first: they give a few numbers p, p' … for each order m, which are then multiplied by (s + it)ᵐ. Four orders are computed
//! at once in SIMD lanes. An evaluation needs only registers as memory.
//!
//! Definitions: P = 1 − r̂ r̂ᵀ, g = ∂W/∂(s,t,u), K = ∂g/∂(s,t,u), W = V r/μ, and the weights n + 1 and (n + 1)(n + 2) that result from ∂/∂r (index 1
//! and 2):
//! ```text
//! a = μ/r² (P g − W₁ r̂)
//! ∂a/∂x = μ/r³ (P K P − (r̂·g) P − Pg r̂ᵀ − r̂ (Pg)ᵀ − Pg₁ r̂ᵀ − r̂ (Pg₁)ᵀ − W₁ P + W₂ r̂ r̂ᵀ)
//! ```

use super::coefficients::Coefficients;
use linkwork_spatial::{Mat3, Vec3};
use wide::f64x4;

/// Number of orders computed at once.
const LANES: usize = 4;
type Lanes = f64x4;
const ZERO: Lanes = Lanes::ZERO;

/// One degree of four orders.
#[derive(Clone, Copy, Debug)]
struct Row {
    /// β.
    b: Lanes,
    /// s_nm C̄_nm and s_nm S̄_nm.
    c: Lanes,
    s: Lanes,
}

/// Potential, acceleration and gravity gradient at a point, axes of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gravity {
    /// V, m²/s²; positive, zero at infinity. The potential energy of a mass is −m V.
    pub potential: f64,
    /// ∂V/∂x, m/s².
    pub acceleration: Vec3,
    /// ∂²V/∂x∂x, 1/s²; symmetric, its trace is zero outside the body.
    pub gradient: Mat3,
}

/// A field ready for evaluation: degree after degree for four orders at a time.
#[derive(Clone, Debug)]
pub struct Harmonics {
    mu: f64,
    radius: f64,
    degree: usize,
    /// Blocks of four orders, one after the other; block k has degrees 4k … degree.
    rows: Vec<Row>,
    /// Ā_mm.
    diagonal: Vec<Lanes>,
}

/// Sums over degrees of one block: index 0 for C̄, 1 for S̄.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// G, (n+1) G, D.
    f: [Lanes; 2],
    f1: [Lanes; 2],
    d: [Lanes; 2],
    /// (n+1)(n+2) G, (n+1) D, E; only with the gradient.
    f2: [Lanes; 2],
    d1: [Lanes; 2],
    dd: [Lanes; 2],
}

impl Harmonics {
    /// Prepares a field. O(degree × order) memory, 96 bytes for four coefficients.
    #[must_use]
    pub fn new(field: &Coefficients) -> Self {
        let (degree, order) = (field.degree(), field.order());
        let mut rows = Vec::new();
        let mut diagonal = Vec::new();
        let mut a_mm = 1.0;
        for first in (0..=order).step_by(LANES) {
            let mut start = [0.0; LANES];
            for (lane, start) in start.iter_mut().enumerate() {
                let m = first + lane;
                if m > 0 {
                    let k = if m == 1 { 3.0 } else { (2 * m + 1) as f64 / (2 * m) as f64 };
                    a_mm *= f64::sqrt(k);
                }
                *start = if m <= order { a_mm } else { 0.0 };
            }
            diagonal.push(start.into());
            let mut scale = [1.0; LANES];
            rows.extend((first..=degree).map(|n| row(field, n, first, &mut scale)));
        }
        Self { mu: field.mu, radius: field.radius, degree, rows, diagonal }
    }

    /// Returns μ, m³/s².
    #[must_use]
    pub fn mu(&self) -> f64 {
        self.mu
    }

    /// Returns the reference radius, m.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the highest degree.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// Returns ∂V/∂x at `p`, m from the centre, in the body's axes; m/s² in the same axes.
    ///
    /// Valid outside the sphere around the body; inside it the series diverges for high degrees. At the centre the result is NaN. Takes degree ×
    /// order × 6 fused operations.
    #[must_use]
    pub fn acceleration(&self, p: &Vec3) -> Vec3 {
        let (at, t) = self.totals::<false>(p);
        self.first(&at, &t)
    }

    /// Returns V at `p`, m²/s². Takes as long as [`Harmonics::acceleration`].
    #[must_use]
    pub fn potential(&self, p: &Vec3) -> f64 {
        let (at, t) = self.totals::<false>(p);
        self.mu / at.r * t.w
    }

    /// Returns potential, acceleration and gradient; takes twice as long as the acceleration.
    #[must_use]
    pub fn full(&self, p: &Vec3) -> Gravity {
        let (at, t) = self.totals::<true>(p);
        let n = at.n;
        let off = |x: &Vec3| x - n * n.dot(x);
        let (pg, pg1) = (off(&t.g), off(&t.g1));
        let nn = n * n.transpose();
        let P = Mat3::identity() - nn;
        let sum = pg + pg1;
        let H = P * t.k * P - P * (n.dot(&t.g) + t.w1) - sum * n.transpose() - n * sum.transpose()
            + nn * t.w2;
        Gravity {
            potential: self.mu / at.r * t.w,
            acceleration: self.first(&at, &t),
            gradient: H * (self.mu / (at.r * at.r * at.r)),
        }
    }

    fn first(&self, at: &Place, t: &Totals) -> Vec3 {
        let n = at.n;
        (t.g - n * (n.dot(&t.g) + t.w1)) * (self.mu / (at.r * at.r))
    }

    /// Computes the sums over all degrees and orders.
    fn totals<const GRADIENT: bool>(&self, p: &Vec3) -> (Place, Totals) {
        let r = p.norm();
        let at = Place { r, n: p / r };
        let rho = self.radius / r;
        let (u_rho, rho2) = (at.n.z * rho, rho * rho);
        let mut t = Lanewise::default();
        let mut power = Powers::start(at.n.x, at.n.y);
        let mut rho_m = Lanes::from([1.0, rho, rho2, rho * rho2]);
        let rho_4 = Lanes::splat(rho2 * rho2);
        let mut from = 0;
        for (k, diagonal) in self.diagonal.iter().enumerate() {
            let first = k * LANES;
            let count = self.degree + 1 - first;
            let rows = &self.rows[from..from + count];
            let mut sums = block::<GRADIENT>(rows, first, *diagonal * rho_m, [u_rho, rho2]);
            sums.scale::<GRADIENT>(rho, rho2);
            from += count;
            t.add::<GRADIENT>(&sums, first as f64, &power);
            power.next::<GRADIENT>();
            rho_m *= rho_4;
        }
        let t = t.totals::<GRADIENT>();
        (at, t)
    }
}

/// Returns the recursion factor and the coefficients of degree `n`, orders `first` … `first + 3`. `scale` is s of the previous degree.
fn row(field: &Coefficients, n: usize, first: usize, scale: &mut [f64; LANES]) -> Row {
    let [mut b, mut c, mut s] = [[0.0; LANES]; 3];
    for (lane, scale) in scale.iter_mut().enumerate() {
        let m = first + lane;
        if m > n || m > field.order() {
            continue;
        }
        if n > m {
            let (n, m) = (n as f64, m as f64);
            *scale *= ((2.0 * n - 1.0) * (2.0 * n + 1.0) / ((n - m) * (n + m))).sqrt();
            // This factor is zero at n = m + 1.
            b[lane] = (n + m - 1.0) * (n - m - 1.0) / ((2.0 * n - 1.0) * (2.0 * n - 3.0));
        }
        let (cos, sin) = field.get(n, m);
        (c[lane], s[lane]) = (*scale * cos, *scale * sin);
    }
    Row { b: b.into(), c: c.into(), s: s.into() }
}

/// The recursion over the degrees of four orders.
struct Recursion {
    u_rho: Lanes,
    rho2: Lanes,
    /// G, D, E of the last degree and of the previous one.
    last: [Lanes; 3],
    before: [Lanes; 3],
    /// Degree of the next row, plus one.
    n1: Lanes,
    sums: Sums,
}

impl Recursion {
    /// Adds one degree; `start` changes G before it is summed.
    #[inline(always)]
    fn degree<const GRADIENT: bool>(&mut self, row: &Row, start: impl Fn(Lanes) -> Lanes) {
        let (t, b, last, before) = (self.u_rho, row.b * self.rho2, self.last, self.before);
        let f = start(t.mul_add(last[0], -(b * before[0])));
        let d = t.mul_add(last[1], (-b).mul_add(before[1], last[0]));
        let dd = match GRADIENT {
            true => t.mul_add(last[2], (-b).mul_add(before[2], last[1])),
            false => ZERO,
        };
        self.sums.add::<GRADIENT>(row, [f, d, dd], self.n1);
        (self.before, self.last) = (last, [f, d, dd]);
        self.n1 += Lanes::ONE;
    }
}

/// Computes the sums over the degrees of four orders. The first four rows start with the diagonal, lane by lane.
#[inline(always)]
fn block<const GRADIENT: bool>(
    rows: &[Row],
    first: usize,
    diagonal: Lanes,
    [u_rho, rho2]: [f64; 2],
) -> Sums {
    let mut all = Recursion {
        u_rho: u_rho.into(),
        rho2: rho2.into(),
        last: [ZERO; 3],
        before: [ZERO; 3],
        n1: ((first + 1) as f64).into(),
        sums: Sums::default(),
    };
    let (head, rest) = rows.split_at(LANES.min(rows.len()));
    for (k, row) in head.iter().enumerate() {
        // The value G of this lane is still zero, so start it with its diagonal.
        let mut unit = [0.0; LANES];
        unit[k] = 1.0;
        let start = diagonal * Lanes::from(unit);
        all.degree::<GRADIENT>(row, |f| f + start);
    }
    for row in rest {
        all.degree::<GRADIENT>(row, |f| f);
    }
    all.sums
}

impl Sums {
    /// Adds one degree of four orders.
    #[inline(always)]
    fn add<const GRADIENT: bool>(&mut self, row: &Row, [f, d, dd]: [Lanes; 3], n1: Lanes) {
        let f1 = n1 * f;
        for (j, x) in [row.c, row.s].into_iter().enumerate() {
            self.f[j] = f.mul_add(x, self.f[j]);
            self.f1[j] = f1.mul_add(x, self.f1[j]);
            self.d[j] = d.mul_add(x, self.d[j]);
            if GRADIENT {
                self.f2[j] = ((n1 + Lanes::ONE) * f1).mul_add(x, self.f2[j]);
                self.d1[j] = (n1 * d).mul_add(x, self.d1[j]);
                self.dd[j] = dd.mul_add(x, self.dd[j]);
            }
        }
    }

    /// Converts D and E to the derivatives of F with respect to u.
    #[inline(always)]
    fn scale<const GRADIENT: bool>(&mut self, rho: f64, rho2: f64) {
        let (rho, twice) = (Lanes::splat(rho), Lanes::splat(2.0 * rho2));
        for j in 0..2 {
            self.d[j] *= rho;
            if GRADIENT {
                self.d1[j] *= rho;
                self.dd[j] *= twice;
            }
        }
    }
}

/// Distance and direction.
struct Place {
    r: f64,
    n: Vec3,
}

/// A complex number for each of four orders.
#[derive(Clone, Copy, Default)]
struct Complex {
    re: Lanes,
    im: Lanes,
}

impl Complex {
    #[inline(always)]
    fn of(x: [(f64, f64); LANES]) -> Self {
        Self { re: x.map(|x| x.0).into(), im: x.map(|x| x.1).into() }
    }

    #[inline(always)]
    fn times(self, z: Self) -> Self {
        Self {
            re: self.re.mul_add(z.re, -(self.im * z.im)),
            im: self.re.mul_add(z.im, self.im * z.re),
        }
    }
}

/// (s + it) to the powers m, m − 1, m − 2 of four orders m. A negative power is zero, because its factor is zero anyway.
struct Powers {
    m: Complex,
    m1: Complex,
    m2: Complex,
    /// (s + it)⁴ in each lane.
    four: Complex,
}

impl Powers {
    #[inline(always)]
    fn start(s: f64, t: f64) -> Self {
        let z = |x: (f64, f64)| (s * x.0 - t * x.1, s * x.1 + t * x.0);
        let one = (1.0, 0.0);
        let two = z((s, t));
        let (none, three) = ((0.0, 0.0), z(two));
        Self {
            m: Complex::of([one, (s, t), two, three]),
            m1: Complex::of([none, one, (s, t), two]),
            m2: Complex::of([none, none, one, (s, t)]),
            four: Complex::of([z(three); LANES]),
        }
    }

    /// Advances to the next four orders.
    #[inline(always)]
    fn next<const GRADIENT: bool>(&mut self) {
        let last = self.m;
        self.m = self.m.times(self.four);
        let behind = |last: Lanes, now: Lanes| {
            let ([_, _, c, d], [e, f, g, _]) = (last.to_array(), now.to_array());
            [Lanes::from([d, e, f, g]), Lanes::from([c, d, e, f])]
        };
        let [re, im] = [behind(last.re, self.m.re), behind(last.im, self.m.im)];
        self.m1 = Complex { re: re[0], im: im[0] };
        if GRADIENT {
            self.m2 = Complex { re: re[1], im: im[1] };
        }
    }
}

/// W, g, K, and the same with weights n + 1 and (n + 1)(n + 2).
struct Totals {
    w: f64,
    w1: f64,
    w2: f64,
    g: Vec3,
    g1: Vec3,
    k: Mat3,
}

/// The totals for each of four orders, before the final sum.
#[derive(Default)]
struct Lanewise {
    w: Lanes,
    w1: Lanes,
    w2: Lanes,
    g: [Lanes; 3],
    g1: [Lanes; 3],
    /// ∂²/∂s², ∂²/∂s∂t, ∂²/∂s∂u, ∂²/∂t∂u, ∂²/∂u².
    k: [Lanes; 5],
}

impl Lanewise {
    /// Adds four orders from `first` on: p r_m + q i_m and its derivatives. ∂/∂s turns r_m into m r_m-1.
    #[inline(always)]
    fn add<const GRADIENT: bool>(&mut self, sums: &Sums, first: f64, z: &Powers) {
        let m = Lanes::splat(first) + Lanes::from([0.0, 1.0, 2.0, 3.0]);
        let m1 = Complex { re: m * z.m1.re, im: m * z.m1.im };
        let (f, f1, d) = (&sums.f, &sums.f1, &sums.d);
        self.w += re(f, z.m);
        self.w1 += re(f1, z.m);
        for (g, x) in self.g.iter_mut().zip([re(f, m1), im(f, m1), re(d, z.m)]) {
            *g += x;
        }
        if GRADIENT {
            let (f2, d1, dd) = (&sums.f2, &sums.d1, &sums.dd);
            self.w2 += re(f2, z.m);
            for (g, x) in self.g1.iter_mut().zip([re(f1, m1), im(f1, m1), re(d1, z.m)]) {
                *g += x;
            }
            let mm = m * (m - Lanes::ONE);
            let m2 = Complex { re: mm * z.m2.re, im: mm * z.m2.im };
            let all = [re(f, m2), im(f, m2), re(d, m1), im(d, m1), re(dd, z.m)];
            for (k, x) in self.k.iter_mut().zip(all) {
                *k += x;
            }
        }
    }

    #[inline(always)]
    fn totals<const GRADIENT: bool>(&self) -> Totals {
        let vec3 = |x: &[Lanes; 3]| Vec3::from(x.map(Lanes::reduce_add));
        let mut t = Totals {
            w: self.w.reduce_add(),
            w1: self.w1.reduce_add(),
            w2: 0.0,
            g: vec3(&self.g),
            g1: Vec3::zeros(),
            k: Mat3::zeros(),
        };
        if GRADIENT {
            let [ss, st, su, tu, uu] = self.k.map(Lanes::reduce_add);
            (t.w2, t.g1) = (self.w2.reduce_add(), vec3(&self.g1));
            t.k = Mat3::new(ss, st, su, st, -ss, tu, su, tu, uu);
        }
        t
    }
}

/// Returns p r + q i.
#[inline(always)]
fn re(x: &[Lanes; 2], z: Complex) -> Lanes {
    x[0].mul_add(z.re, x[1] * z.im)
}

/// Returns q r − p i.
#[inline(always)]
fn im(x: &[Lanes; 2], z: Complex) -> Lanes {
    x[1].mul_add(z.re, -(x[0] * z.im))
}
