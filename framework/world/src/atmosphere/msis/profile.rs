//! Temperature over height, and density that follows from it.
//!
//! ```text
//! ζ(z, z₀) = (z − z₀)(R + z₀)/(R + z)                               geopotential height over z₀
//! above z_a:  T = T∞ − (T∞ − T₁₂₀) e^(−s ζ)                         Bates
//!             n = n₁₂₀ (T₁₂₀/T)^(1 + α + γ) e^(−s γ ζ),  γ = M g/(s R* T∞)
//! below:      1/T a cubic spline over ζ,  n ∝ T^−(1 + α) exp(−M g/R* ∫ dζ/T)
//! ```
//! Hedin 1987, appendix A; 1991.

/// The model's gas constant: g of cm/s², heights of km.
const R_STAR: f64 = 831.4;

/// Gravity at the ground, cm/s², and effective radius, km.
#[derive(Clone, Copy)]
pub(super) struct Earth {
    pub(super) g: f64,
    pub(super) radius: f64,
}

impl Earth {
    fn zeta(&self, z: f64, from: f64) -> f64 {
        (z - from) * (self.radius + from) / (self.radius + z)
    }

    fn gravity(&self, z: f64) -> f64 {
        self.g / (1.0 + z / self.radius).powi(2)
    }

    /// Returns R* T/(M g), km.
    pub(super) fn scale_height(&self, z: f64, mass: f64, temperature: f64) -> f64 {
        R_STAR * temperature / (self.gravity(z) * mass)
    }
}

/// 1/T as a cubic spline over geopotential height between nodes, with decreasing heights.
pub(super) struct Spline<const N: usize> {
    earth: Earth,
    top: f64,
    bottom: f64,
    /// ζ of the bottom relative to the top; negative.
    span: f64,
    x: [f64; N],
    y: [f64; N],
    bend: [f64; N],
}

impl<const N: usize> Spline<N> {
    /// Creates the spline from nodes of height (km) and temperature, and dT/dz at both ends, K/km.
    pub(super) fn new(earth: Earth, z: &[f64; N], t: &[f64; N], ends: [f64; 2]) -> Self {
        let (top, bottom) = (z[0], z[N - 1]);
        let span = earth.zeta(bottom, top);
        let x = z.map(|z| earth.zeta(z, top) / span);
        let y = t.map(|t| 1.0 / t);
        let stretch = ((earth.radius + bottom) / (earth.radius + top)).powi(2);
        let first = -ends[0] / (t[0] * t[0]) * span;
        let last = -ends[1] / (t[N - 1] * t[N - 1]) * span * stretch;
        Self { earth, top, bottom, span, x, y, bend: bends(&x, &y, first, last) }
    }

    /// Returns T at `z`, K; below the last node the temperature of the last node.
    pub(super) fn temperature(&self, z: f64) -> f64 {
        let at = self.place(z);
        let k = self.x[1..N - 1].iter().take_while(|x| **x <= at).count();
        let h = self.x[k + 1] - self.x[k];
        let (a, b) = ((self.x[k + 1] - at) / h, (at - self.x[k]) / h);
        let curve = (a * a * a - a) * self.bend[k] + (b * b * b - b) * self.bend[k + 1];
        1.0 / (a * self.y[k] + b * self.y[k + 1] + curve * h * h / 6.0)
    }

    /// Returns the density at `z` divided by that at the top, for a mass and a thermal diffusion factor.
    pub(super) fn fall(&self, z: f64, mass: f64, alpha: f64) -> f64 {
        let at = self.place(z);
        let mut sum = 0.0;
        for k in 0..N - 1 {
            if at <= self.x[k] {
                break;
            }
            let end = if k < N - 2 { at.min(self.x[k + 1]) } else { at };
            let h = self.x[k + 1] - self.x[k];
            let (a, b) = ((self.x[k + 1] - end) / h, (end - self.x[k]) / h);
            let (a2, b2) = (a * a, b * b);
            let curve = (a2 / 2.0 - (1.0 + a2 * a2) / 4.0) * self.bend[k]
                + (b2 * b2 / 4.0 - b2 / 2.0) * self.bend[k + 1];
            let line = (1.0 - a2) * self.y[k] / 2.0 + b2 * self.y[k + 1] / 2.0;
            sum += (line + curve * h * h / 6.0) * h;
        }
        let exponent = (mass * self.earth.gravity(self.top) * self.span / R_STAR * sum).min(50.0);
        (1.0 / self.y[0] / self.temperature(z)).powf(1.0 + alpha) * (-exponent).exp()
    }

    fn place(&self, z: f64) -> f64 {
        self.earth.zeta(z.max(self.bottom), self.top) / self.span
    }
}

/// Returns the second derivatives of a cubic spline with given slopes at its ends.
fn bends<const N: usize>(x: &[f64; N], y: &[f64; N], first: f64, last: f64) -> [f64; N] {
    let (mut bend, mut u) = ([0.0; N], [0.0; N]);
    let slope = |k: usize| (y[k + 1] - y[k]) / (x[k + 1] - x[k]);
    bend[0] = -0.5;
    u[0] = 3.0 / (x[1] - x[0]) * (slope(0) - first);
    for k in 1..N - 1 {
        let sigma = (x[k] - x[k - 1]) / (x[k + 1] - x[k - 1]);
        let p = sigma * bend[k - 1] + 2.0;
        bend[k] = (sigma - 1.0) / p;
        u[k] = (6.0 * (slope(k) - slope(k - 1)) / (x[k + 1] - x[k - 1]) - sigma * u[k - 1]) / p;
    }
    let un = 3.0 / (x[N - 1] - x[N - 2]) * (last - slope(N - 2));
    bend[N - 1] = (un - 0.5 * u[N - 2]) / (0.5 * bend[N - 2] + 1.0);
    for k in (0..N - 1).rev() {
        bend[k] = bend[k] * bend[k + 1] + u[k];
    }
    bend
}

/// The thermosphere: Bates profile above `joint`, a spline of five nodes below.
pub(super) struct Thermosphere {
    earth: Earth,
    exosphere: f64,
    base_temperature: f64,
    base: f64,
    slope: f64,
    joint: f64,
    below: Spline<5>,
}

impl Thermosphere {
    /// Creates the profile from T∞, T at `base` (120 km), s, heights of the nodes, temperatures of all but the first, and the gradient at the last.
    pub(super) fn new(
        earth: Earth,
        [exosphere, base_temperature, base, slope]: [f64; 4],
        nodes: &[f64; 5],
        temperatures: &[f64; 4],
        gradient: f64,
    ) -> Self {
        let joint = nodes[0];
        let at_joint =
            exosphere - (exosphere - base_temperature) * (-slope * earth.zeta(joint, base)).exp();
        let stretch = ((earth.radius + base) / (earth.radius + joint)).powi(2);
        let [a, b, c, d] = *temperatures;
        let ends = [(exosphere - at_joint) * slope * stretch, gradient];
        let below = Spline::new(earth, nodes, &[at_joint, a, b, c, d], ends);
        Self { earth, exosphere, base_temperature, base, slope, joint, below }
    }

    pub(super) fn temperature(&self, z: f64) -> f64 {
        if z < self.joint { self.below.temperature(z) } else { self.bates(z) }
    }

    fn bates(&self, z: f64) -> f64 {
        let fall = (-self.slope * self.earth.zeta(z, self.base)).exp();
        self.exosphere - (self.exosphere - self.base_temperature) * fall
    }

    /// Returns the number density at `z` of a gas with `n` at the base.
    pub(super) fn density(&self, z: f64, n: f64, mass: f64, alpha: f64) -> f64 {
        let high = z.max(self.joint);
        let gamma = mass * self.earth.gravity(self.base) / (self.slope * R_STAR * self.exosphere);
        let fall = (-self.slope * gamma * self.earth.zeta(high, self.base)).exp().min(50.0);
        let n = n * (self.base_temperature / self.bates(high)).powf(1.0 + alpha + gamma) * fall;
        if z < self.joint { n * self.below.fall(z, mass, alpha) } else { n }
    }
}
