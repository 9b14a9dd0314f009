//! SIMD version of `local.rs`: the local solution of four contacts with Coulomb friction at once, and their residual.

use super::super::local::{NEAR, NONE as LEAST, STEPS};
use wide::f64x4;

/// Data for the local solutions of four contacts. Lanes without a contact have compliance 0 and impulse 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law {
    /// W: nn, nx, ny, xx, xy, yy.
    w: [f64x4; 6],
    b: [f64x4; 3],
    friction: f64x4,
    /// Mean of the diagonal of W.
    pub scale: f64x4,
    /// 1 / Wnn; 0 if Wnn is 0.
    inverse: f64x4,
    /// Wtn / Wnn, and S⁻¹: xx, yy, xy.
    lean: [f64x4; 2],
    give: [f64x4; 3],
    /// Cosine and sine of the rotation that makes S diagonal, and its eigenvalues.
    turn: [f64x4; 2],
    s: [f64x4; 2],
    /// α of the last solution.
    alpha: f64x4,
}

#[inline(always)]
fn splat(x: f64) -> f64x4 {
    f64x4::splat(x)
}

/// Returns 1 / x where x is more than `least`, otherwise 0.
#[inline(always)]
fn reciprocal(x: f64x4, least: f64x4) -> f64x4 {
    x.simd_gt(least).bitselect(splat(1.0) / x, splat(0.0))
}

/// Returns x in rotated axes.
#[inline(always)]
fn turned([c, s]: [f64x4; 2], x: [f64x4; 2]) -> [f64x4; 2] {
    [c * x[0] + s * x[1], c * x[1] - s * x[0]]
}

impl Law {
    /// Computes the data from W = E_g E_gᵀ (nn, nx, ny, xx, xy, yy), b and μ.
    #[inline(always)]
    pub fn new(w: [f64x4; 6], b: [f64x4; 3], friction: f64x4) -> Law {
        let [nn, nx, ny, xx, xy, yy] = w;
        let scale = (nn + xx + yy) / splat(3.0);
        let inverse = reciprocal(nn, splat(LEAST) * scale);
        let lean = [nx * inverse, ny * inverse];
        let (a, d, off) = (xx - lean[0] * nx, yy - lean[1] * ny, xy - lean[0] * ny);
        let (turn, s) = axes(a, d, off, scale);
        let (trace, det) = (a + d, a * d - off * off);
        let per = splat(1.0) / det;
        let fine = det.simd_gt(splat(1e-6) * trace * trace);
        let [f, g] = s.map(|s| splat(1.0) / s);
        let [x, y] = turn;
        let give = [
            fine.bitselect(d * per, x * x * f + y * y * g),
            fine.bitselect(a * per, y * y * f + x * x * g),
            fine.bitselect(-off * per, x * y * (f - g)),
        ];
        Law { w, b, friction, scale, inverse, lean, give, turn, s, alpha: splat(0.0) }
    }

    /// Returns false if W or b overflows or is NaN.
    pub fn is_finite(&self) -> bool {
        let zero = splat(0.0);
        let sum = self.w.iter().chain(&self.b).fold(zero, |s, x| zero.mul_add(*x, s));
        sum.reduce_add() == 0.0
    }

    /// Computes velocities from E_g y.
    #[inline(always)]
    pub fn velocity(&self, gathered: [f64x4; 3]) -> [f64x4; 3] {
        std::array::from_fn(|k| gathered[k] + self.b[k])
    }

    /// Computes the new impulses from the old ones and their velocities v.
    #[inline(always)]
    pub fn solve(&mut self, l: [f64x4; 3], v: [f64x4; 3]) -> [f64x4; 3] {
        let [nn, nx, ny, xx, xy, yy] = self.w;
        let zero = splat(0.0);
        let qn = v[0] - ny.mul_add(l[2], nx.mul_add(l[1], nn * l[0]));
        let qx = v[1] - xy.mul_add(l[2], xx.mul_add(l[1], nx * l[0]));
        let qy = v[2] - yy.mul_add(l[2], xy.mul_add(l[1], ny * l[0]));
        let open = qn.simd_ge(zero) | self.inverse.simd_eq(zero);
        let n0 = -qn * self.inverse;
        let ([c, d], [f, g, h]) = (self.lean, self.give);
        let (qx, qy) = (qx - c * qn, qy - d * qn);
        let (x, y) = (-(f * qx + h * qy), -(h * qx + g * qy));
        let n = n0 - (c * x + d * y);
        let smooth = self.friction.simd_eq(zero);
        let radius = self.friction * n;
        let stick = n.simd_ge(zero) & (x * x + y * y).simd_le(radius * radius) & !smooth;
        let mut out = [smooth.bitselect(n0, n), stick.bitselect(x, zero), stick.bitselect(y, zero)];
        let slides = !(open | stick | smooth);
        if slides.any() {
            let slid = self.slide(slides, n0, [qx, qy]);
            out = std::array::from_fn(|k| slides.bitselect(slid[k], out[k]));
        }
        out.map(|x| open.bitselect(zero, x))
    }

    /// Computes the lanes `which` from q̃.
    #[inline(never)]
    fn slide(&mut self, which: f64x4, n0: f64x4, q: [f64x4; 2]) -> [f64x4; 3] {
        let (q, couple) = (turned(self.turn, q), turned(self.turn, self.lean));
        let friction = self.friction;
        let at = |alpha: f64x4| Trial::new(alpha, &q, &couple, &self.s, n0, friction);
        let (alpha, trial) = root(at, self.alpha, self.s[0], which);
        self.alpha = which.bitselect(alpha, self.alpha);
        let n = trial.n.max(splat(0.0));
        let most = friction * n;
        let keep = trial.size.simd_gt(most).bitselect(most / trial.size, splat(1.0));
        let ([x, y], [c, s]) = (trial.t.map(|t| keep * t), self.turn);
        [n, c * x - s * y, s * x + c * y]
    }

    /// Returns over-relaxed impulses, projected onto the cones.
    #[inline(never)]
    pub fn relaxed(&self, old: &[f64x4; 3], new: &[f64x4; 3], relaxation: f64) -> [f64x4; 3] {
        let [n, x, y]: [f64x4; 3] =
            std::array::from_fn(|k| (new[k] - old[k]).mul_add(splat(relaxation), old[k]));
        let n = n.max(splat(0.0));
        let (size, radius) = ((x * x + y * y).sqrt(), self.friction * n);
        let keep = size.simd_gt(radius).bitselect(radius / size, splat(1.0));
        [n, keep * x, keep * y]
    }

    /// Computes natural map, idle work and violation of the cone, as residual.rs defines them.
    #[inline(always)]
    pub fn residual(&self, l: &[f64x4; 3], v: &[f64x4; 3]) -> ([f64x4; 3], f64x4, f64x4) {
        let zero = splat(0.0);
        let p = l.map(|x| x * self.scale);
        let radius = self.friction * p[0].max(zero);
        let t = [p[1] - v[1], p[2] - v[2]];
        let size = (t[0] * t[0] + t[1] * t[1]).sqrt();
        let keep = size.simd_le(radius).bitselect(splat(1.0), radius / size);
        let natural = [p[0] - (p[0] - v[0]).max(zero), p[1] - keep * t[0], p[2] - keep * t[1]];
        let speed = (v[1] * v[1] + v[2] * v[2]).sqrt();
        let work = l[0] * v[0] + l[1] * v[1] + l[2] * v[2] + self.friction * speed * l[0];
        let tangent = (l[1] * l[1] + l[2] * l[2]).sqrt();
        let outside = (-l[0]).max(tangent - self.friction * l[0]).max(zero);
        (natural, work, outside)
    }
}

/// Returns the rotation that makes S = (a, off; off, d) diagonal, and its eigenvalues, bounded away from 0.
#[inline(always)]
fn axes(a: f64x4, d: f64x4, off: f64x4, scale: f64x4) -> ([f64x4; 2], [f64x4; 2]) {
    let (zero, one) = (splat(0.0), splat(1.0));
    let (mean, half) = (splat(0.5) * (a + d), splat(0.5) * (a - d));
    // Scale to the units of the group, so that squares neither overflow nor vanish.
    let unit = scale.simd_gt(zero).bitselect(scale, one);
    let (x, y) = (half / unit, off / unit);
    let size = unit * (x * x + y * y).sqrt();
    // cos 2θ = half / size. Take the larger of cosine and sine from the half angle.
    let big = (splat(0.5) * (one + half.abs() / size)).sqrt();
    let small = off.abs() / (splat(2.0) * size * big);
    let wide = half.simd_ge(zero);
    let y = wide.bitselect(small, big);
    let some = size.simd_gt(zero);
    let turn = [
        some.bitselect(wide.bitselect(big, small), one),
        some.bitselect(off.simd_lt(zero).bitselect(-y, y), zero),
    ];
    let least = splat(LEAST) * scale + splat(f64::MIN_POSITIVE);
    (turn, [(mean + size).max(least), (mean - size).max(least)])
}

/// The impulses for a given α.
#[derive(Clone, Copy)]
struct Trial {
    n: f64x4,
    t: [f64x4; 2],
    size: f64x4,
    g: f64x4,
    slope: f64x4,
}

impl Trial {
    #[inline(always)]
    fn new(
        alpha: f64x4,
        q: &[f64x4; 2],
        c: &[f64x4; 2],
        s: &[f64x4; 2],
        n0: f64x4,
        friction: f64x4,
    ) -> Trial {
        let one = splat(1.0);
        let (x, y) = (s[0] + alpha, s[1] + alpha);
        let per = one / (x * y);
        let u = [y * per, x * per];
        let t = [-q[0] * u[0], -q[1] * u[1]];
        let size = (t[0] * t[0] + t[1] * t[1]).sqrt();
        let per = one / size;
        let n = n0 - (c[0] * t[0] + c[1] * t[1]);
        let n_slope = c[0] * t[0] * u[0] + c[1] * t[1] * u[1];
        let shrink = (t[0] * t[0] * u[0] + t[1] * t[1] * u[1]) * (per * per);
        let per = friction * per;
        Trial { n, t, size, g: per * n, slope: per * (n_slope + n * shrink) }
    }

    #[inline(always)]
    fn chosen(which: f64x4, a: &Trial, b: &Trial) -> Trial {
        Trial {
            n: which.bitselect(a.n, b.n),
            t: std::array::from_fn(|k| which.bitselect(a.t[k], b.t[k])),
            size: which.bitselect(a.size, b.size),
            g: which.bitselect(a.g, b.g),
            slope: which.bitselect(a.slope, b.slope),
        }
    }
}

/// Finds the α > 0 with g(α) = 1 in the lanes `which`, with Newton steps inside a bracket, as in local.rs.
#[inline(always)]
fn root(at: impl Fn(f64x4) -> Trial, guess: f64x4, stiff: f64x4, which: f64x4) -> (f64x4, Trial) {
    let (far, one) = (splat(f64::INFINITY), splat(1.0));
    let (mut low, mut high) = (splat(0.0), far);
    let (mut alpha, mut trial, mut active) = (guess, at(guess), which);
    for _ in 0..STEPS {
        let off = trial.g - one;
        active &= off.abs().simd_lt(far);
        let below = off.simd_lt(splat(0.0));
        low = below.bitselect(alpha, low);
        high = below.bitselect(high, alpha);
        let newton = alpha - off / trial.slope;
        let good = trial.slope.simd_gt(splat(0.0)) & newton.simd_gt(low) & newton.simd_lt(high);
        active &= good | off.abs().simd_gt(splat(4.0 * f64::EPSILON));
        if !active.any() {
            break;
        }
        let halved =
            high.simd_lt(far).bitselect(splat(0.5) * (low + high), splat(2.0) * alpha + stiff);
        alpha = active.bitselect(good.bitselect(newton, halved), alpha);
        let next = at(alpha);
        // Near a fold g is not monotonic, and a step may diverge.
        let near =
            off.abs().simd_lt(splat(NEAR)) & (next.g - one).abs().simd_lt(splat(0.1) * off.abs());
        trial = Trial::chosen(active, &next, &trial);
        active &= !near;
        if !active.any() {
            break;
        }
    }
    (alpha, trial)
}
