//! One group on its own, everything else held: its impulse, exactly.
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
//! g(0) < 1 outside the cone, and g grows without bound with α when qn < 0: a root exists for any μ. For S a multiple of one and no coupling g is linear, and Newton's step exact.
//! With a strong coupling (Painlevé) there may be several solutions; λ = 0 is taken where it is one.

use super::problem::{Cone, Problem, axpy4};

/// What the local solution needs of a group; made once for a problem.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Block {
    /// W by columns; for an equality W⁺.
    pub m: [[f64; 4]; 4],
    /// Trace of W divided by the number of rows.
    pub scale: f64,
    /// 1 / W of the normal, or only, row; 0 when W is.
    inverse: f64,
    /// 1 / W of the spin row; 0 when W is.
    spin: f64,
    /// Cosine and sine of the turn that makes S diagonal.
    turn: [f64; 2],
    /// Eigenvalues of S, not quite 0.
    s: [f64; 2],
    /// Wtn / Wnn in axes of S.
    couple: [f64; 2],
    /// 1 / s.
    flex: [f64; 2],
    /// α of the last solution.
    alpha: f64,
}

/// Relative size below which a compliance counts as none.
const NONE: f64 = 1e-13;
/// Steps for α: Newton takes 2 to 5, bisection alone fewer than this.
const STEPS: usize = 60;
/// |g − 1| from which one step of Newton is enough for a sweep.
const NEAR: f64 = 1e-3;

impl Block {
    /// From the group's own entries. O(entries).
    pub fn new(problem: &Problem, g: usize) -> Block {
        let (cone, soft) = (&problem.cones[g], problem.soft(g));
        let mut W = [[0.0; 4]; 4];
        for e in problem.entries(g).1 {
            for j in 0..4 {
                W[j] = axpy4(e[j], e, W[j]);
            }
        }
        for k in 0..4 {
            W[k][k] += soft[k];
        }
        let rows = cone.rows();
        let scale = (0..rows).map(|k| W[k][k]).sum::<f64>() / rows as f64;
        let mut block = Block { m: W, scale, turn: [1.0, 0.0], ..Block::default() };
        block.inverse = reciprocal(W[0][0], NONE * scale);
        match cone {
            Cone::Equality { rows } => block.m = super::dense::pseudo_inverse(&W, *rows),
            Cone::Unilateral | Cone::Dry { .. } => {}
            Cone::Coulomb { .. } => block.tangents(&W),
            Cone::Spinning { .. } => {
                block.scale = (W[0][0] + W[1][1] + W[2][2]) / 3.0;
                block.spin = reciprocal(W[3][3], 0.0);
                block.tangents(&W);
            }
        }
        block
    }

    /// False when W overflows.
    pub fn is_finite(&self) -> bool {
        let sum = self.m.iter().flatten().fold(0.0, |s, x| s + 0.0 * x);
        self.scale.is_finite() && sum == 0.0
    }

    fn tangents(&mut self, W: &[[f64; 4]; 4]) {
        let c = [W[0][1] * self.inverse, W[0][2] * self.inverse];
        let (a, b) = (W[1][1] - c[0] * W[0][1], W[2][2] - c[1] * W[0][2]);
        let off = W[1][2] - c[0] * W[0][2];
        let (mean, half) = (0.5 * (a + b), 0.5 * (a - b));
        // In units of the group, so that squares neither overflow nor vanish.
        let unit = if self.scale > 0.0 { self.scale } else { 1.0 };
        let (x, y) = (half / unit, off / unit);
        let size = unit * (x * x + y * y).sqrt();
        if size > 0.0 {
            // cos 2θ = half / size; the larger of cosine and sine from the half angle.
            let big = (0.5 * (1.0 + half.abs() / size)).sqrt();
            let small = off.abs() / (2.0 * size * big);
            let [x, y] = if half >= 0.0 { [big, small] } else { [small, big] };
            self.turn = [x, if off < 0.0 { -y } else { y }];
        }
        let least = NONE * self.scale + f64::MIN_POSITIVE;
        self.s = [(mean + size).max(least), (mean - size).max(least)];
        self.flex = self.s.map(|s| 1.0 / s);
        self.couple = self.turned(c);
    }

    #[inline(always)]
    fn turned(&self, x: [f64; 2]) -> [f64; 2] {
        let [c, s] = self.turn;
        [c * x[0] + s * x[1], c * x[1] - s * x[0]]
    }

    #[inline(always)]
    fn back(&self, x: [f64; 2]) -> [f64; 2] {
        let [c, s] = self.turn;
        [c * x[0] - s * x[1], s * x[0] + c * x[1]]
    }

    /// The new impulse of the group, given its old one and the velocity v with it.
    #[inline(always)]
    pub fn solve(&mut self, cone: &Cone, l: &[f64; 4], v: &[f64; 4]) -> [f64; 4] {
        match *cone {
            Cone::Equality { .. } => std::array::from_fn(|k| {
                let m = &self.m[k];
                l[k] - ((m[0] * v[0] + m[1] * v[1]) + (m[2] * v[2] + m[3] * v[3]))
            }),
            Cone::Unilateral => [(l[0] - v[0] * self.inverse).max(0.0), 0.0, 0.0, 0.0],
            Cone::Dry { bound } => {
                [(l[0] - v[0] * self.inverse).clamp(-bound, bound), 0.0, 0.0, 0.0]
            }
            Cone::Coulomb { friction } => self.coulomb(friction, l, v),
            Cone::Spinning { friction, spin } => self.spinning(friction, spin, l, v),
        }
    }

    #[inline(always)]
    fn coulomb(&mut self, friction: f64, l: &[f64; 4], v: &[f64; 4]) -> [f64; 4] {
        let W = &self.m;
        let q: [f64; 3] =
            std::array::from_fn(|k| v[k] - (W[0][k] * l[0] + W[1][k] * l[1] + W[2][k] * l[2]));
        if q[0] >= 0.0 || self.inverse == 0.0 {
            return [0.0; 4];
        }
        let n0 = -q[0] * self.inverse;
        if friction == 0.0 {
            return [n0, 0.0, 0.0, 0.0];
        }
        // q̃ and Wnt λt / Wnn in axes of S.
        let (qt, c) = (self.turned([q[1], q[2]]), self.couple);
        let qt = [qt[0] - c[0] * q[0], qt[1] - c[1] * q[0]];
        let stick = [-qt[0] * self.flex[0], -qt[1] * self.flex[1]];
        let n = n0 - (c[0] * stick[0] + c[1] * stick[1]);
        let square = stick[0] * stick[0] + stick[1] * stick[1];
        if n >= 0.0 && square <= friction * friction * n * n {
            let t = self.back(stick);
            return [n, t[0], t[1], 0.0];
        }
        let at = |alpha: f64| Trial::new(alpha, &qt, &c, &self.s, n0, friction);
        let (alpha, trial) = slide(at, self.alpha, self.s[0]);
        self.alpha = alpha;
        let n = trial.n.max(0.0);
        let keep = if trial.size > friction * n { friction * n / trial.size } else { 1.0 };
        let t = self.back([keep * trial.t[0], keep * trial.t[1]]);
        [n, t[0], t[1], 0.0]
    }

    fn spinning(&mut self, friction: f64, spin: f64, l: &[f64; 4], v: &[f64; 4]) -> [f64; 4] {
        let mut out = self.coulomb(friction, l, v);
        let W = &self.m;
        let vs = v[3] + (0..3).map(|k| W[3][k] * (out[k] - l[k])).sum::<f64>();
        let most = spin * out[0];
        out[3] = (l[3] - vs * self.spin).clamp(-most, most);
        out
    }
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
        let u = [1.0 / (s[0] + alpha), 1.0 / (s[1] + alpha)];
        let t = [-q[0] * u[0], -q[1] * u[1]];
        let square = t[0] * t[0] + t[1] * t[1];
        let size = square.sqrt();
        let n = n0 - (c[0] * t[0] + c[1] * t[1]);
        let n_slope = c[0] * t[0] * u[0] + c[1] * t[1] * u[1];
        let shrink = (t[0] * t[0] * u[0] + t[1] * t[1] * u[1]) / square;
        let per = friction / size;
        Trial { n, t, size, g: per * n, slope: per * (n_slope + n * shrink) }
    }
}

/// The α > 0 with g(α) = 1, from g(0) < 1: Newton's steps inside a bracket. The last step is one
/// from |g − 1| < `NEAR` that helps; what it leaves, the next sweep squares again.
#[inline(always)]
fn slide(at: impl Fn(f64) -> Trial, guess: f64, stiff: f64) -> (f64, Trial) {
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
        // Near a fold g is not monotonic, and a step may lead away.
        if off.abs() < NEAR && (trial.g - 1.0).abs() < 0.1 * off.abs() {
            break;
        }
    }
    (alpha, trial)
}

/// 1/x, or 0 when x is `least` or less.
fn reciprocal(x: f64, least: f64) -> f64 {
    if x > least { 1.0 / x } else { 0.0 }
}
