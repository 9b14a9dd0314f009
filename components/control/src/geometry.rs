//! Steering geometry of a six-wheeled rover: where wheels point and how fast they turn.
//! ```text
//! velocity of wheel i    w = (v − ω y_i, ω (x_i − x₀))          x₀: the axis of the wheels that do not steer
//! steering δ = atan2(w_y, w_x), folded into −90° … 90° with the sign of the speed;   rate = ±|w|/r
//! turning circle ρ = v/ω:  δ = atan2(x_i − x₀, ρ − y_i),  |w|/v = √((x_i − x₀)² + (ρ − y_i)²)/|ρ|
//! least squares  w_i cos δ_i = v_x − ω y_i,  w_i sin δ_i = v_y + ω x_i     (12 equations, 3 unknowns)
//! ```

/// Order of the wheels: left and right of front, middle and rear.
pub const WHEELS: usize = 6;

/// Where the wheels are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    /// x (forward) and y (left) of the wheels LF, RF, LM, RM, LR, RR, m.
    pub wheels: [[f64; 2]; WHEELS],
    /// Wheel radius, m.
    pub radius: f64,
}

/// Steering angles (rad) and wheel rates (rad/s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Command {
    /// Steering, positive to the left.
    pub steer: [f64; WHEELS],
    /// Wheel rates, positive forward.
    pub rate: [f64; WHEELS],
}

impl Layout {
    /// x of the axis about which the rover turns: the mean of the middle wheels.
    pub fn axis(&self) -> f64 {
        0.5 * (self.wheels[2][0] + self.wheels[3][0])
    }

    /// The command for a speed `v` (m/s, forward) of the point on the axis and a turn rate (rad/s, left).
    /// Middle wheels do not steer. `None` when both are zero: there is no direction.
    pub fn command(&self, v: f64, turn: f64) -> Option<Command> {
        if v == 0.0 && turn == 0.0 {
            return None;
        }
        let x0 = self.axis();
        let mut out = Command::default();
        for (i, [x, y]) in self.wheels.into_iter().enumerate() {
            let (wx, wy) = (v - turn * y, turn * (x - x0));
            if i == 2 || i == 3 {
                out.rate[i] = wx / self.radius;
                continue;
            }
            let forward = if wx < 0.0 { -1.0 } else { 1.0 };
            out.steer[i] = (forward * wy).atan2(forward * wx);
            out.rate[i] = forward * wx.hypot(wy) / self.radius;
        }
        Some(out)
    }

    /// The smallest |ρ| (m) at which no wheel steers beyond `limit` (rad).
    pub fn radius_min(&self, limit: f64) -> f64 {
        let x0 = self.axis();
        let tan = limit.min(1.57).tan();
        let reach = |[x, y]: [f64; 2]| y.abs() + (x - x0).abs() / tan;
        self.wheels.into_iter().map(reach).fold(0.0, f64::max)
    }

    /// Body velocity v_x, v_y at the layout's origin (m/s) and turn rate (rad/s) that fit the measured wheels
    /// best. `None` when the wheels do not determine it.
    pub fn twist(&self, measured: &Command) -> Option<[f64; 3]> {
        let n = WHEELS as f64;
        let (mut sx, mut sy, mut s2) = (0.0, 0.0, 0.0);
        let (mut bx, mut by, mut bw) = (0.0, 0.0, 0.0);
        for (i, [x, y]) in self.wheels.into_iter().enumerate() {
            let speed = measured.rate[i] * self.radius;
            let (sin, cos) = measured.steer[i].sin_cos();
            let (u, w) = (speed * cos, speed * sin);
            sx += x;
            sy += y;
            s2 += x * x + y * y;
            bx += u;
            by += w;
            bw += x * w - y * u;
        }
        // Normal equations: n vx − Σy ω = Σu, n vy + Σx ω = Σw, −Σy vx + Σx vy + Σ(x²+y²) ω = Σ(x w − y u).
        let det = s2 - (sx * sx + sy * sy) / n;
        if det <= 1e-12 {
            return None;
        }
        let turn = (bw + sy * bx / n - sx * by / n) / det;
        Some([(bx + sy * turn) / n, (by - sx * turn) / n, turn])
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Wheels of the public Curiosity model.
    pub(crate) fn curiosity() -> Layout {
        Layout {
            wheels: [
                [1.095, 1.063],
                [1.095, -1.063],
                [-0.089, 1.194],
                [-0.089, -1.194],
                [-1.163, 1.063],
                [-1.163, -1.063],
            ],
            radius: 0.25,
        }
    }

    #[test]
    fn turning_circles_match_the_published_table() {
        // ρ; steering LF RF LR RR in deg; speeds LF RF LM RM LR RR over that of the centre.
        let rows = [
            (
                3.0,
                [31.436, 16.247, -29.007, -14.807],
                [0.7567, 1.4107, 0.6020, 1.3980, 0.7383, 1.4009],
            ),
            (
                5.0,
                [16.738, 11.050, -15.259, -10.045],
                [0.8222, 1.2355, 0.7612, 1.2388, 0.8162, 1.2315],
            ),
            (
                10.0,
                [7.547, 6.109, -6.853, -5.545],
                [0.9015, 1.1126, 0.8806, 1.1194, 0.9001, 1.1115],
            ),
        ];
        for (rho, steer, speed) in rows {
            let c = curiosity().command(0.1, 0.1 / rho).unwrap();
            for (i, want) in [0, 1, 4, 5].into_iter().zip(steer) {
                assert!((c.steer[i].to_degrees() - want).abs() < 6e-4, "{rho} {i}: {:?}", c.steer);
            }
            for (i, want) in speed.into_iter().enumerate() {
                assert!((c.rate[i] * 0.25 / 0.1 - want).abs() < 6e-5, "{rho} {i}: {:?}", c.rate);
            }
            assert_eq!((c.steer[2], c.steer[3]), (0.0, 0.0));
        }
    }

    #[test]
    fn turning_on_the_spot_matches_the_published_table() {
        let c = curiosity().command(0.0, 1.0).unwrap();
        for (i, want) in [(0, -48.082), (1, 48.082), (4, 45.295), (5, -45.295)] {
            assert!((c.steer[i].to_degrees() - want).abs() < 6e-4, "{:?}", c.steer);
        }
        let reach = [1.5912, 1.5912, 1.1940, 1.1940, 1.5111, 1.5111];
        for (i, want) in reach.into_iter().enumerate() {
            let sign = if i % 2 == 0 { -1.0 } else { 1.0 };
            assert!((c.rate[i] * 0.25 - sign * want).abs() < 6e-5, "{i}: {:?}", c.rate);
        }
    }

    #[test]
    fn odometry_inverts_the_command() {
        let l = curiosity();
        for (v, w) in [(0.1, 0.0), (0.1, 0.03), (-0.05, 0.02), (0.0, -0.1)] {
            let t = l.twist(&l.command(v, w).unwrap()).unwrap();
            // The command holds on the axis; the layout's origin is 0.089 m before it.
            let want = [v, w * 0.089, w];
            for k in 0..3 {
                assert!((t[k] - want[k]).abs() < 1e-12, "{v} {w}: {t:?}");
            }
        }
        assert!(
            Layout { wheels: [[1.0, 1.0]; 6], radius: 0.2 }.twist(&Command::default()).is_none()
        );
    }

    #[test]
    fn at_the_smallest_circle_a_wheel_is_at_its_limit() {
        let l = curiosity();
        let limit = 35f64.to_radians();
        let rho = l.radius_min(limit);
        let c = l.command(0.1, 0.1 / rho).unwrap();
        let worst = c.steer.iter().fold(0.0_f64, |a, s| a.max(s.abs()));
        assert!((worst - limit).abs() < 1e-9, "{}", worst.to_degrees());
    }
}
