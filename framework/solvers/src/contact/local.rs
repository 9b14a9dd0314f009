//! Local solution: the exact impulse of one group with all others fixed.
//!
//! ```text
//! W = E_g E_gᵀ + R_g,   q = v − W λ                     velocity of the group without its own impulse
//! equality     λ ← λ − W⁺ v                             W⁺ the pseudo-inverse: redundant rows share
//! unilateral   λ ← max(0, −q/W)
//! dry          λ ← clamp(−q/W, ± bound)
//! Coulomb      qn ≥ 0: λ ← 0.  Else vn = 0 and vt = −α λt with α ≥ 0; the normal row eliminated,
//!              S = Wtt − Wtn Wnt / Wnn = rotation · diag(s₁, s₂) · rotationᵀ
//!              q̃ = qt − Wtn qn / Wnn
//!              λt(α) = −(S + α)⁻¹ q̃,   λn(α) = −(qn + Wnt λt) / Wnn
//!              stick when |λt(0)| ≤ μ λn(0); else slide with α > 0 of
//!              g(α) = μ λn(α) / |λt(α)| = 1
//! spin         λs ← clamp(λs − vs/Wss, ± μs λn) after the other three
//! ```
//! g(0) < 1 outside the cone, and g grows without bound with α if qn < 0, so a root exists for any μ. If S is a multiple of the identity and the
//! coupling is zero, g is linear and Newton's step exact. A strong coupling (Painlevé) may have several solutions; the function returns λ = 0 if that
//! is one of them.

use super::problem::{Cone, Problem, masked};
use wide::f64x4;

/// Data of a group for its local solution, computed once for a problem.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    cone: Cone,
    /// W by columns; the pseudo-inverse W⁺ for an equality.
    m: [f64x4; 4],
    /// b and R; unused lanes are 0.
    b: f64x4,
    soft: f64x4,
    /// Trace of W divided by the number of rows.
    pub scale: f64,
    /// 1 / W of the normal, or only, row; 0 if W is 0.
    inverse: f64,
    /// 1 / W of the spin row; 0 if W is 0.
    spin: f64,
    /// Wtn / Wnn; S⁻¹ and S as diagonal and off-diagonal entry.
    lean: [f64; 2],
    give: [f64; 3],
    stiff: [f64; 3],
    /// Data for sliding, computed on first use.
    axes: Option<Axes>,
    /// α of the last solution.
    alpha: f64,
    /// Whether the last sweep that visited the group left it unchanged.
    pub rests: bool,
}

/// S in its principal axes.
#[derive(Clone, Copy, Debug)]
struct Axes {
    /// Cosine and sine of the rotation that makes S diagonal.
    turn: [f64; 2],
    /// Eigenvalues of S, bounded away from 0.
    s: [f64; 2],
    /// Wtn / Wnn.
    couple: [f64; 2],
}

/// Relative size below which a compliance counts as 0.
pub(super) const NONE: f64 = 1e-13;
/// Maximum number of steps for α: Newton takes 2 to 5, and bisection alone takes fewer than this.
pub(super) const STEPS: usize = 60;
/// Value of |g − 1| below which one Newton step is enough for a sweep.
pub(super) const NEAR: f64 = 1e-3;

impl Block {
    /// Computes the data of group g from E_g E_gᵀ.
    #[inline(always)]
    pub fn new(problem: &Problem, g: usize, mut W: [[f64; 4]; 4]) -> Block {
        let (cone, soft) = (problem.cones[g], problem.soft(g));
        for k in 0..4 {
            W[k][k] += soft[k];
        }
        let rows = cone.rows();
        let mut block = Block {
            cone,
            m: W.map(f64x4::new),
            b: f64x4::new(masked(problem.b[g], rows)),
            soft: f64x4::new(soft),
            scale: (0..rows).map(|k| W[k][k]).sum::<f64>() / rows as f64,
            inverse: 0.0,
            spin: 0.0,
            lean: [0.0; 2],
            give: [0.0; 3],
            stiff: [0.0; 3],
            axes: None,
            alpha: 0.0,
            rests: false,
        };
        match cone {
            Cone::Equality { rows } => {
                block.m = super::dense::pseudo_inverse(&W, rows).map(f64x4::new);
            }
            Cone::Unilateral | Cone::Dry { .. } => {}
            Cone::Coulomb { .. } => block.tangents(&W),
            Cone::Spinning { .. } => {
                block.scale = (W[0][0] + W[1][1] + W[2][2]) / 3.0;
                block.spin = reciprocal(W[3][3], 0.0);
                block.tangents(&W);
            }
        }
        block.inverse = reciprocal(W[0][0], NONE * block.scale);
        block
    }

    /// Returns false if W overflows or is NaN.
    pub fn is_finite(&self) -> bool {
        let zero = f64x4::splat(0.0);
        let sum =
            self.m.iter().chain([&self.b]).fold(zero, |s, x| zero.mul_add(*x, s)).reduce_add();
        self.scale.is_finite() && sum == 0.0
    }

    /// Computes E_g y + b_g + R_g λ_g; unused lanes are 0.
    #[inline(always)]
    pub fn velocity(&self, gathered: f64x4, l: f64x4) -> f64x4 {
        self.soft.mul_add(l, gathered + self.b)
    }

    /// Computes S and its inverse. Smaller eigenvalues are replaced by the lower bound.
    #[inline(always)]
    fn tangents(&mut self, W: &[[f64; 4]; 4]) {
        let inverse = reciprocal(W[0][0], NONE * self.scale);
        self.lean = [W[0][1] * inverse, W[0][2] * inverse];
        let c = self.lean;
        let (a, b) = (W[1][1] - c[0] * W[0][1], W[2][2] - c[1] * W[0][2]);
        let off = W[1][2] - c[0] * W[0][2];
        self.stiff = [a, b, off];
        // S is far from singular if its determinant is large: det S ≥ s₂ tr S / 2, where s₂ is the
        // smaller eigenvalue.
        let (trace, det) = (a + b, a * b - off * off);
        if det > 1e-6 * trace * trace {
            let per = 1.0 / det;
            self.give = [b * per, a * per, -off * per];
        } else {
            let Axes { turn: [x, y], s, .. } = self.axes();
            let [f, g] = s.map(|s| 1.0 / s);
            self.give = [x * x * f + y * y * g, y * y * f + x * x * g, x * y * (f - g)];
        }
    }

    /// Returns the axes of S, computed once.
    fn axes(&mut self) -> Axes {
        if let Some(axes) = self.axes {
            return axes;
        }
        let [a, b, off] = self.stiff;
        let (mean, half) = (0.5 * (a + b), 0.5 * (a - b));
        // Scale to the units of the group, so that squares neither overflow nor vanish.
        let unit = if self.scale > 0.0 { self.scale } else { 1.0 };
        let (x, y) = (half / unit, off / unit);
        let size = unit * (x * x + y * y).sqrt();
        let mut turn = [1.0, 0.0];
        if size > 0.0 {
            // cos 2θ = half / size. Take the larger of cosine and sine from the half angle.
            let big = (0.5 * (1.0 + half.abs() / size)).sqrt();
            let small = off.abs() / (2.0 * size * big);
            let [x, y] = if half >= 0.0 { [big, small] } else { [small, big] };
            turn = [x, if off < 0.0 { -y } else { y }];
        }
        let least = NONE * self.scale + f64::MIN_POSITIVE;
        let s = [(mean + size).max(least), (mean - size).max(least)];
        *self.axes.insert(Axes { turn, s, couple: turned(turn, self.lean) })
    }

    /// Computes the new impulse of the group from its old impulse `l` and the velocity `v` that belongs to `l`.
    #[inline(always)]
    pub fn solve(&mut self, l: f64x4, v: f64x4) -> f64x4 {
        match self.cone {
            Cone::Coulomb { friction } => f64x4::new(self.coulomb(friction, l, v)),
            Cone::Equality { .. } => l - self.times(v),
            Cone::Unilateral => first((l - v * f64x4::splat(self.inverse)).to_array()[0].max(0.0)),
            Cone::Dry { bound } => {
                let free = (l - v * f64x4::splat(self.inverse)).to_array()[0];
                first(free.clamp(-bound, bound))
            }
            Cone::Spinning { friction, spin } => f64x4::new(self.spinning(friction, spin, l, v)),
        }
    }

    /// Computes m x.
    #[inline(always)]
    fn times(&self, x: f64x4) -> f64x4 {
        let (m, [a, b, c, d]) = (&self.m, x.to_array().map(f64x4::splat));
        m[1].mul_add(b, m[0] * a) + m[3].mul_add(d, m[2] * c)
    }

    #[inline(always)]
    fn coulomb(&mut self, friction: f64, l: f64x4, v: f64x4) -> [f64; 4] {
        let [qn, qx, qy, _] = {
            let (W, [a, b, c, _]) = (&self.m, l.to_array().map(f64x4::splat));
            (v - W[2].mul_add(c, W[1].mul_add(b, W[0] * a))).to_array()
        };
        if qn >= 0.0 || self.inverse == 0.0 {
            return [0.0; 4];
        }
        let n0 = -qn * self.inverse;
        if friction == 0.0 {
            return [n0, 0.0, 0.0, 0.0];
        }
        let ([c, d], [f, g, h]) = (self.lean, self.give);
        let (qx, qy) = (qx - c * qn, qy - d * qn);
        let (x, y) = (-(f * qx + h * qy), -(h * qx + g * qy));
        let n = n0 - (c * x + d * y);
        if n >= 0.0 && x * x + y * y <= friction * friction * n * n {
            return [n, x, y, 0.0];
        }
        self.slide(friction, n0, [qx, qy])
    }

    /// Computes the sliding impulse from q̃.
    #[inline(never)]
    fn slide(&mut self, friction: f64, n0: f64, q: [f64; 2]) -> [f64; 4] {
        let Axes { turn, s, couple } = self.axes();
        let q = turned(turn, q);
        let at = |alpha: f64| Trial::new(alpha, &q, &couple, &s, n0, friction);
        let (alpha, trial) = root(at, self.alpha, s[0]);
        self.alpha = alpha;
        let n = trial.n.max(0.0);
        let keep = if trial.size > friction * n { friction * n / trial.size } else { 1.0 };
        let ([x, y], [c, s]) = (trial.t.map(|t| keep * t), turn);
        [n, c * x - s * y, s * x + c * y, 0.0]
    }

    #[inline(never)]
    fn spinning(&mut self, friction: f64, spin: f64, l: f64x4, v: f64x4) -> [f64; 4] {
        let mut out = self.coulomb(friction, l, v);
        let change = (f64x4::new(out) - l) * f64x4::new([1.0, 1.0, 1.0, 0.0]);
        let vs = v.to_array()[3] + (self.m[3] * change).reduce_add();
        let (most, l) = (spin * out[0], l.to_array()[3]);
        out[3] = (l - vs * self.spin).clamp(-most, most);
        out
    }
}

/// Returns x in rotated axes.
#[inline(always)]
fn turned([c, s]: [f64; 2], x: [f64; 2]) -> [f64; 2] {
    [c * x[0] + s * x[1], c * x[1] - s * x[0]]
}

/// Returns x in the first lane and 0 in the others.
#[inline(always)]
fn first(x: f64) -> f64x4 {
    f64x4::new([x, 0.0, 0.0, 0.0])
}

/// The impulse for a given α.
#[derive(Clone, Copy)]
struct Trial {
    n: f64,
    t: [f64; 2],
    size: f64,
    g: f64,
    slope: f64,
}

impl Trial {
    #[inline(always)]
    fn new(alpha: f64, q: &[f64; 2], c: &[f64; 2], s: &[f64; 2], n0: f64, friction: f64) -> Trial {
        // Needs only two divisions and one square root.
        let (x, y) = (s[0] + alpha, s[1] + alpha);
        let per = 1.0 / (x * y);
        let u = [y * per, x * per];
        let t = [-q[0] * u[0], -q[1] * u[1]];
        let square = t[0] * t[0] + t[1] * t[1];
        let size = square.sqrt();
        let per = 1.0 / size;
        let n = n0 - (c[0] * t[0] + c[1] * t[1]);
        let n_slope = c[0] * t[0] * u[0] + c[1] * t[1] * u[1];
        let shrink = (t[0] * t[0] * u[0] + t[1] * t[1] * u[1]) * (per * per);
        let per = friction * per;
        Trial { n, t, size, g: per * n, slope: per * (n_slope + n * shrink) }
    }
}

/// Finds the α > 0 with g(α) = 1, from g(0) < 1, with Newton steps inside a bracket. Stops after a successful step from |g − 1| < `NEAR`, because the
/// next sweep squares the remaining error again.
#[inline(always)]
fn root(at: impl Fn(f64) -> Trial, guess: f64, stiff: f64) -> (f64, Trial) {
    let (mut low, mut high) = (0.0, f64::INFINITY);
    let mut alpha = guess;
    let mut trial = at(guess);
    for _ in 0..STEPS {
        let off = trial.g - 1.0;
        if !off.is_finite() {
            break;
        }
        if off < 0.0 {
            low = alpha
        } else {
            high = alpha
        }
        let newton = alpha - off / trial.slope;
        let next = if trial.slope > 0.0 && newton > low && newton < high {
            newton
        } else if off.abs() <= 4.0 * f64::EPSILON {
            break;
        } else if high.is_finite() {
            0.5 * (low + high)
        } else {
            2.0 * alpha + stiff
        };
        alpha = next;
        trial = at(alpha);
        // Near a fold g is not monotonic, and a step may diverge.
        if off.abs() < NEAR && (trial.g - 1.0).abs() < 0.1 * off.abs() {
            break;
        }
    }
    (alpha, trial)
}

/// Returns 1/x, or 0 if x is `least` or less.
fn reciprocal(x: f64, least: f64) -> f64 {
    if x > least { 1.0 / x } else { 0.0 }
}
