//! Range control of an entry along a reference trajectory (Apollo, MSL): the lift with which the vehicle reaches its target range.
//! ```text
//! reference over speed V: range to go R_ref, drag D_ref, rate of height ḣ_ref, gains F₁ = ∂R/∂D, F₂ = ∂R/∂ḣ, F₃ = ∂R/∂u
//! u = u_ref + K (R − R_p)/F₃,    R_p = R_ref + F₁ (D − D_ref) + F₂ (ḣ − ḣ_ref),    u = cos σ of the lift upwards
//! ```
//! Gains come from the adjoint of the motion along the reference, integrated backwards ([`adjoint`]):
//! ```text
//! Ṙ = V cos γ   V̇ = −D − g sin γ   γ̇ = (L/D u D − (g − V²/r) cos γ)/V   ḣ = V sin γ     λ̇ = −(∂f/∂x)ᵀ λ
//! at the end λ = (1, 0, 0, −cot γ_f);   F₁ = −(H_s/D) λ_h   F₂ = λ_γ/(V cos γ)   F₃ = ∫ (D/V)(L/D) λ_γ dt
//! ```

/// A row of a reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceRow {
    /// Speed, m/s.
    pub speed: f64,
    /// Range to go, m.
    pub range: f64,
    /// Drag deceleration, m/s².
    pub drag: f64,
    /// Rate of height, m/s.
    pub rise: f64,
    /// ∂R/∂D, m/(m/s²).
    pub by_drag: f64,
    /// ∂R/∂ḣ, m/(m/s).
    pub by_rise: f64,
    /// ∂R/∂u, m.
    pub by_lift: f64,
}

/// A planet and a vehicle for reference trajectories: exponential air, round planet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vehicle {
    /// Radius of the planet, m.
    pub radius: f64,
    /// Gravity at the surface, m/s².
    pub gravity: f64,
    /// Density at height 0, kg/m³.
    pub density: f64,
    /// Scale height, m.
    pub scale_height: f64,
    /// m/(C_D S), kg/m².
    pub ballistic: f64,
    /// L/D.
    pub lift_to_drag: f64,
}

impl Vehicle {
    /// Drag deceleration at a height and speed.
    pub fn drag(&self, height: f64, speed: f64) -> f64 {
        0.5 * self.density * (-height / self.scale_height).exp() * speed * speed / self.ballistic
    }

    /// Derivatives of (range flown, V, γ, h) at a lift u = cos σ.
    pub fn slope(&self, x: &[f64; 4], u: f64) -> [f64; 4] {
        let [_, v, gamma, h] = *x;
        let r = self.radius + h;
        let g = self.gravity * (self.radius / r).powi(2);
        let d = self.drag(h, v);
        let (s, c) = gamma.sin_cos();
        [v * c, -d - g * s, (self.lift_to_drag * u * d - (g - v * v / r) * c) / v, v * s]
    }

    /// Performs one RK4 step of length `h` s.
    pub fn step(&self, x: &[f64; 4], u: f64, h: f64) -> [f64; 4] {
        let at =
            |k: &[f64; 4], c: f64| -> [f64; 4] { std::array::from_fn(|i| x[i] + c * h * k[i]) };
        let a = self.slope(x, u);
        let b = self.slope(&at(&a, 0.5), u);
        let c = self.slope(&at(&b, 0.5), u);
        let d = self.slope(&at(&c, 1.0), u);
        std::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]))
    }

    /// Computes the reference from (0, V, γ, h) at constant u until the speed is `end`, with its gains; rows are `h` s apart and begin at the
    /// greatest speed.
    ///
    /// Returns `None` if it does not reach that speed within 2000 s above the ground.
    pub fn reference(
        &self,
        start: [f64; 4],
        u: f64,
        end: f64,
        h: f64,
    ) -> Option<Vec<ReferenceRow>> {
        let mut path = vec![start];
        let mut x = start;
        while x[1] > end {
            x = self.step(&x, u, h);
            // The negated comparison also ends the integration for NaN.
            if !(x[3] >= 0.0) || path.len() as f64 * h > 2000.0 {
                return None;
            }
            path.push(x);
        }
        let last = x;
        let gains = adjoint(self, &path, u, h);
        let row = |(x, k): (&[f64; 4], &[f64; 3])| ReferenceRow {
            speed: x[1],
            range: last[0] - x[0],
            drag: self.drag(x[3], x[1]),
            rise: x[1] * x[2].sin(),
            by_drag: k[0],
            by_rise: k[1],
            by_lift: k[2],
        };
        let rows: Vec<ReferenceRow> = path.iter().zip(&gains).map(row).collect();
        // At high altitude the speed increases before it decreases. Rows are found by speed, so leave out those
        // before the maximum.
        let fastest = (0..rows.len()).max_by(|a, b| rows[*a].speed.total_cmp(&rows[*b].speed))?;
        Some(rows[fastest..].to_vec())
    }
}

/// Gains F₁, F₂, F₃ at every point of a path with steps of `h` s: the adjoint, integrated backwards by the trapezoidal rule.
///
/// The range counts until the height of the end is reached: λ_h = −cot γ_f there.
pub fn adjoint(vehicle: &Vehicle, path: &[[f64; 4]], u: f64, h: f64) -> Vec<[f64; 3]> {
    // Compute −(∂f/∂x)ᵀ λ by central differences of the derivatives.
    let rate = |x: &[f64; 4], l: &[f64; 4]| -> [f64; 4] {
        let scale = [1.0, x[1].abs(), 1.0, vehicle.scale_height];
        std::array::from_fn(|j| {
            let e = 1e-6 * scale[j];
            let moved = |s: f64| {
                let mut y = *x;
                y[j] += s * e;
                vehicle.slope(&y, u)
            };
            let (a, b) = (moved(1.0), moved(-1.0));
            -(0..4).map(|i| (a[i] - b[i]) / (2.0 * e) * l[i]).sum::<f64>()
        })
    };
    let n = path.len();
    let end = path[n - 1];
    let mut l = [1.0, 0.0, 0.0, -1.0 / end[2].tan()];
    let mut lift = 0.0;
    let mut out = vec![[0.0; 3]; n];
    let integrand =
        |x: &[f64; 4], l: &[f64; 4]| vehicle.drag(x[3], x[1]) / x[1] * vehicle.lift_to_drag * l[2];
    for k in (0..n).rev() {
        let x = &path[k];
        if k + 1 < n {
            let later = &path[k + 1];
            let a = rate(later, &l);
            let guess: [f64; 4] = std::array::from_fn(|i| l[i] - h * a[i]);
            let b = rate(x, &guess);
            let before = integrand(later, &l);
            l = std::array::from_fn(|i| l[i] - 0.5 * h * (a[i] + b[i]));
            lift += 0.5 * h * (before + integrand(x, &l));
        }
        let drag = vehicle.drag(x[3], x[1]);
        out[k] = [-vehicle.scale_height / drag * l[3], l[2] / (x[1] * x[2].cos()), lift];
    }
    out
}

/// Returns the row of a reference at a speed; speeds decrease from row to row.
pub fn at_speed(rows: &[ReferenceRow], speed: f64) -> ReferenceRow {
    let k = rows.partition_point(|r| r.speed > speed).clamp(1, rows.len() - 1);
    let (a, b) = (&rows[k - 1], &rows[k]);
    let f = ((a.speed - speed) / (a.speed - b.speed)).clamp(0.0, 1.0);
    let mix = |x: f64, y: f64| x + f * (y - x);
    ReferenceRow {
        speed: mix(a.speed, b.speed),
        range: mix(a.range, b.range),
        drag: mix(a.drag, b.drag),
        rise: mix(a.rise, b.rise),
        by_drag: mix(a.by_drag, b.by_drag),
        by_rise: mix(a.by_rise, b.by_rise),
        by_lift: mix(a.by_lift, b.by_lift),
    }
}

/// Vertical lift fraction u = cos σ for a range to go, before it is limited to ±1.
pub fn lift(
    row: &ReferenceRow,
    lift_ref: f64,
    gain: f64,
    (range, drag, rise): (f64, f64, f64),
) -> f64 {
    let predicted = row.range + row.by_drag * (drag - row.drag) + row.by_rise * (rise - row.rise);
    // Near the end, lift has little effect on the range, so limit the divisor.
    let authority = row.by_lift.max(1.0);
    lift_ref + gain * (range - predicted) / authority
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vehicle() -> Vehicle {
        Vehicle {
            radius: 3_396_190.0,
            gravity: 3.71,
            density: 0.0158,
            scale_height: 9354.0,
            ballistic: 137.0,
            lift_to_drag: 0.24,
        }
    }

    const START: [f64; 4] = [0.0, 5845.0, -0.2600, 80_000.0];

    /// Returns the range flown at constant u until the height at which the reference ends.
    fn flown(start: [f64; 4], u: impl Fn(f64, &[f64; 4]) -> f64, height: f64) -> f64 {
        let (v, mut x, h) = (vehicle(), start, 0.05);
        while x[3] > height && x[1] > 100.0 {
            let before = x;
            x = v.step(&x, u(before[1], &before), h);
            if x[3] <= height {
                let f = (before[3] - height) / (before[3] - x[3]);
                return before[0] + f * (x[0] - before[0]);
            }
        }
        x[0]
    }

    fn end_height(u: f64) -> f64 {
        let (v, mut x) = (vehicle(), START);
        while x[1] > 450.0 {
            x = v.step(&x, u, 0.05);
        }
        x[3]
    }

    /// The gains are derivatives of the range: compared with finite differences of whole flights.
    #[test]
    fn gains_are_derivatives_of_the_range() {
        let (v, u) = (vehicle(), 0.5);
        let rows = v.reference(START, u, 450.0, 0.05).unwrap();
        let height = end_height(u);
        // Start from a point of the reference, with errors in drag (by height), vertical speed (by path
        // angle) and lift.
        let k = 1200;
        let mut x = START;
        for _ in 0..k {
            x = v.step(&x, u, 0.05);
        }
        // Rows begin at the greatest speed.
        let row = *rows.iter().find(|row| (row.speed - x[1]).abs() < 1e-9).unwrap();
        assert!(rows.windows(2).all(|w| w[1].speed < w[0].speed));
        let range = |x: [f64; 4], u: f64| flown(x, |_, _| u, height) - x[0];
        let slope = |e: f64, moved: &dyn Fn(f64) -> f64| (moved(e) - moved(-e)) / (2.0 * e);
        let by_height = slope(20.0, &|e| range([x[0], x[1], x[2], x[3] + e], u));
        let drag_by_height = -row.drag / v.scale_height;
        assert!((row.by_drag / (by_height / drag_by_height) - 1.0).abs() < 0.02, "{row:?}");
        let by_angle = slope(1e-4, &|e| range([x[0], x[1], x[2] + e, x[3]], u));
        let rise_by_angle = x[1] * x[2].cos();
        assert!((row.by_rise / (by_angle / rise_by_angle) - 1.0).abs() < 0.02);
        let by_lift = slope(1e-3, &|e| range(x, u + e));
        assert!((row.by_lift / by_lift - 1.0).abs() < 0.02, "{} {by_lift}", row.by_lift);
    }

    /// Guided flights from disturbed initial states reach the target range; unguided ones miss it by kilometres.
    #[test]
    fn guidance_takes_dispersions_away() {
        let (v, u) = (vehicle(), 0.5);
        let rows = v.reference(START, u, 450.0, 0.1).unwrap();
        let height = end_height(u);
        let nominal = flown(START, |_, _| u, height);
        let mut missed = 0;
        for (dv, dgamma) in [(0.0, 0.003), (0.0, -0.003), (20.0, 0.0), (-20.0, 0.002)] {
            let start = [0.0, START[1] + dv, START[2] + dgamma, START[3]];
            let free = flown(start, |_, _| u, height) - nominal;
            let law = |speed: f64, x: &[f64; 4]| {
                let drag = v.drag(x[3], speed);
                if drag < 1.96 {
                    return u;
                }
                let row = at_speed(&rows, speed);
                let now = (nominal - x[0], drag, speed * x[2].sin());
                lift(&row, u, 5.0, now).clamp(-1.0, 1.0)
            };
            let guided = flown(start, law, height) - nominal;
            println!("{dv} m/s, {dgamma} rad: {free:.0} m without, {guided:.0} m with guidance");
            assert!(guided.abs() < 200.0, "measured 40 m");
            missed += u8::from(free.abs() > 2000.0);
        }
        assert!(missed >= 2, "without guidance they miss");
    }

    #[test]
    fn a_reference_that_meets_the_ground_is_none() {
        assert!(vehicle().reference([0.0, 5845.0, -0.6, 80_000.0], -1.0, 100.0, 0.1).is_none());
    }
}
