//! Steering geometry of a rover with any number of wheels: steering angles and wheel rates.
//! ```text
//! velocity of wheel i    w = (v − ω y_i, ω (x_i − x₀))          x₀: the axis about which the rover turns
//! steered                δ = atan2(w_y, w_x), folded into −90° … 90° with the sign of the speed;   rate = ±|w|/r_i
//! not steered            δ = 0, rate = w_x/r_i
//! turning circle ρ = v/ω:  δ = atan2(x_i − x₀, ρ − y_i),  |w|/v = √((x_i − x₀)² + (ρ − y_i)²)/|ρ|
//! least squares  w_i cos δ_i = v_x − ω y_i,  w_i sin δ_i = v_y + ω x_i       2 n equations, 3 unknowns
//! ```
//! A wheel that neither steers nor lies on the axis slips sideways in a turn, so it does not contribute to v_y.

use linkwork_runtime::prelude::*;

/// Maximum number of wheels of one rover.
pub const WHEELS_MAX: usize = 64;
/// Maximum steering angle of any wheel, rad; its tangent is finite.
pub const STEER_MAX: f64 = 1.57;
/// Maximum distance from the axis at which an unsteered wheel still rolls in a turn, m.
const ON_AXIS: f64 = 1e-3;
/// Wheels whose squared distances sum to less than this do not determine a turn rate, m².
const TOGETHER: f64 = 1e-12;

/// Position of a wheel.
#[derive(Params, Clone, Debug, PartialEq)]
pub struct WheelPlace {
    /// x (forward) and y (left) of the wheel.
    #[param(unit = "m")]
    pub position: [f64; 2],
    /// Whether it steers.
    #[param(default = true)]
    pub steered: bool,
    /// Radius, if it differs from the radius of the other wheels.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: Option<f64>,
}

/// Command to a wheel drive.
#[derive(Ports, Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Rate, positive forward.
    #[port("rad/s")]
    pub rate: f64,
    /// Brake command: the wheel is to stand.
    #[port("1")]
    pub brake: bool,
}

/// Positions and radii of the wheels.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    wheels: Vec<WheelPlace>,
    radii: Vec<f64>,
    axis: f64,
}

impl Layout {
    /// Creates the layout of wheels; `radius` (m) applies to wheels that do not state a radius.
    ///
    /// # Errors
    /// Returns an error for no wheel or too many wheels.
    pub fn new(wheels: &[WheelPlace], radius: f64) -> Result<Self, BuildError> {
        if wheels.is_empty() || wheels.len() > WHEELS_MAX {
            let why = format!("{} wheels", wheels.len());
            let help = format!("write 1 to {WHEELS_MAX}");
            return Err(BuildError::new(why).help(help).at("wheels"));
        }
        // The axis of rotation passes through the wheels that do not steer, because they cannot rotate the rover about
        // another axis. If all wheels steer, it passes through their centre.
        let mean = |of: &dyn Fn(&&WheelPlace) -> bool| {
            let x: Vec<f64> = wheels.iter().filter(of).map(|w| w.position[0]).collect();
            (!x.is_empty()).then(|| x.iter().sum::<f64>() / x.len() as f64)
        };
        let axis = mean(&|w| !w.steered).or(mean(&|_| true)).unwrap_or(0.0);
        let radii = wheels.iter().map(|w| w.radius.unwrap_or(radius)).collect();
        Ok(Layout { wheels: wheels.to_vec(), radii, axis })
    }

    /// Returns the number of wheels.
    pub fn count(&self) -> usize {
        self.wheels.len()
    }

    /// The wheels.
    pub fn wheels(&self) -> &[WheelPlace] {
        &self.wheels
    }

    /// Returns the radius of wheel `i`, m.
    pub fn radius(&self, i: usize) -> f64 {
        self.radii[i]
    }

    /// x of the axis about which the rover turns, m: the mean of the wheels that do not steer, or of all wheels if all steer.
    pub fn axis(&self) -> f64 {
        self.axis
    }

    /// Returns steering angle (rad, to the left) and rate (rad/s) of wheel `i` for a speed `v` (m/s, forward) of the point
    /// on the axis and a turn rate (rad/s, left), not both zero.
    pub fn command(&self, i: usize, v: f64, turn: f64) -> [f64; 2] {
        let WheelPlace { position: [x, y], steered, .. } = self.wheels[i];
        let (wx, wy) = (v - turn * y, turn * (x - self.axis));
        if !steered {
            return [0.0, wx / self.radii[i]];
        }
        let forward = if wx < 0.0 { -1.0 } else { 1.0 };
        [(forward * wy).atan2(forward * wx), forward * wx.hypot(wy) / self.radii[i]]
    }

    /// Returns the smallest |ρ| (m) at which no wheel steers beyond `limit` (rad) and none turns backwards.
    pub fn radius_min(&self, limit: f64) -> f64 {
        let tan = limit.min(STEER_MAX).tan();
        let reach = |w: &WheelPlace| match (w.steered, w.position) {
            (true, [x, y]) => y.abs() + (x - self.axis).abs() / tan,
            (false, [_, y]) => y.abs(),
        };
        self.wheels.iter().map(reach).fold(0.0, f64::max)
    }

    /// Returns body velocity v_x, v_y at the layout's origin (m/s) and turn rate (rad/s) that fit the measured steering (rad)
    /// and rate (rad/s) of each wheel best. Returns `None` if the wheels do not determine the motion.
    pub fn twist(&self, measured: impl Fn(usize) -> [f64; 2]) -> Option<[f64; 3]> {
        let (mut n, mut sy, mut s2) = (0.0, 0.0, 0.0);
        let (mut across, mut sx) = (0.0, 0.0);
        let (mut bx, mut by, mut bw) = (0.0, 0.0, 0.0);
        for (i, WheelPlace { position: [x, y], steered, .. }) in self.wheels.iter().enumerate() {
            let [steer, rate] = measured(i);
            let speed = rate * self.radii[i];
            let (sin, cos) = steer.sin_cos();
            let u = speed * cos;
            n += 1.0;
            sy += y;
            s2 += y * y;
            bx += u;
            bw -= y * u;
            if *steered || (x - self.axis).abs() < ON_AXIS {
                let w = speed * sin;
                across += 1.0;
                sx += x;
                s2 += x * x;
                by += w;
                bw += x * w;
            }
        }
        if across == 0.0 {
            // All wheels slip sideways, so the rover rotates about its axis.
            (across, sx) = (1.0, self.axis);
            s2 += self.axis * self.axis;
        }
        // The normal equations are n vx − Σy ω = Σu, m vy + Σx ω = Σw, and −Σy vx + Σx vy + Σ(x²+y²) ω =
        // Σ(x w − y u).
        let det = s2 - sy * sy / n - sx * sx / across;
        if det <= TOGETHER {
            return None;
        }
        let turn = (bw + sy * bx / n - sx * by / across) / det;
        Some([(bx + sy * turn) / n, (by - sx * turn) / across, turn])
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn places(wheels: &[([f64; 2], bool)]) -> Vec<WheelPlace> {
        let place = |&(position, steered): &_| WheelPlace { position, steered, radius: None };
        wheels.iter().map(place).collect()
    }

    /// Wheels of the public Curiosity model.
    pub(crate) fn curiosity() -> Vec<WheelPlace> {
        places(&[
            ([1.095, 1.063], true),
            ([1.095, -1.063], true),
            ([-0.089, 1.194], false),
            ([-0.089, -1.194], false),
            ([-1.163, 1.063], true),
            ([-1.163, -1.063], true),
        ])
    }

    fn layout(wheels: &[WheelPlace]) -> Layout {
        Layout::new(wheels, 0.25).unwrap()
    }

    fn commands(l: &Layout, v: f64, turn: f64) -> Vec<[f64; 2]> {
        (0..l.count()).map(|i| l.command(i, v, turn)).collect()
    }

    #[test]
    fn turning_circles_have_their_centre_on_the_axle_that_does_not_steer() {
        // Computed by hand: the steering angle is atan(Δx/(ρ − y)), and the speed ratio is the distance to the centre
        // of the circle divided by ρ. Δx is measured from the middle axle.
        // Columns: ρ; steering angles LF RF LR RR in deg; speeds LF RF LM RM LR RR divided by the speed of the centre.
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
            let c = commands(&layout(&curiosity()), 0.1, 0.1 / rho);
            for (i, want) in [0, 1, 4, 5].into_iter().zip(steer) {
                assert!((c[i][0].to_degrees() - want).abs() < 6e-4, "{rho} {i}: {c:?}");
            }
            for (i, want) in speed.into_iter().enumerate() {
                assert!((c[i][1] * 0.25 / 0.1 - want).abs() < 6e-5, "{rho} {i}: {c:?}");
            }
            assert_eq!((c[2][0], c[3][0]), (0.0, 0.0));
        }
    }

    #[test]
    fn turning_on_the_spot_is_across_the_way_to_the_centre() {
        let c = commands(&layout(&curiosity()), 0.0, 1.0);
        for (i, want) in [(0, -48.082), (1, 48.082), (4, 45.295), (5, -45.295)] {
            assert!((c[i][0].to_degrees() - want).abs() < 6e-4, "{c:?}");
        }
        let reach = [1.5912, 1.5912, 1.1940, 1.1940, 1.5111, 1.5111];
        for (i, want) in reach.into_iter().enumerate() {
            let sign = if i % 2 == 0 { -1.0 } else { 1.0 };
            assert!((c[i][1] * 0.25 - sign * want).abs() < 6e-5, "{i}: {c:?}");
        }
    }

    /// Layouts of four, six and eight wheels, with all of them steered and with none.
    #[test]
    fn odometry_inverts_the_command() {
        let four = [[0.7, 0.5], [0.7, -0.5], [-0.6, 0.5], [-0.6, -0.5]];
        let eight = [1.5, 0.5, -0.4, -1.5].into_iter().flat_map(|x| [[x, 0.9], [x, -0.9]]);
        let front: Vec<_> = eight.map(|[x, y]| ([x, y], !(-1.0..1.0).contains(&x))).collect();
        for wheels in [
            curiosity(),
            places(&four.map(|p| (p, true))),
            places(&four.map(|p| (p, false))),
            places(&front),
        ] {
            let l = layout(&wheels);
            for (v, w) in [(0.1, 0.0), (0.1, 0.03), (-0.05, 0.02), (0.0, -0.1)] {
                let t = l.twist(|i| l.command(i, v, w)).unwrap();
                // The command must hold at the axis of rotation.
                let want = [v, -w * l.axis(), w];
                for k in 0..3 {
                    assert!((t[k] - want[k]).abs() < 1e-12, "{v} {w}: {t:?} {wheels:?}");
                }
            }
        }
        let heap = layout(&places(&[([1.0, 1.0], true); 6]));
        assert!(heap.twist(|_| [0.0, 1.0]).is_none());
        assert!(Layout::new(&[], 0.2).is_err());
    }

    /// A tricycle: its front wheel steers and has three times the radius of the rear wheels. Rim speeds follow from the distances to the centre of
    /// the circle for all radii.
    #[test]
    fn each_wheel_turns_at_its_rim_speed_over_its_own_radius() {
        let mut wheels = places(&[([0.9, 0.0], true), ([0.0, 0.3], false), ([0.0, -0.3], false)]);
        wheels[0].radius = Some(0.3);
        let l = Layout::new(&wheels, 0.1).unwrap();
        let rho = 1.2;
        let c = commands(&l, 0.6, 0.6 / rho);
        // The distances to the centre are √(0.9² + 1.2²) = 1.5 m, 0.9 m and 1.5 m. The speeds are proportional to these
        // distances divided by 1.2 m.
        for (command, rate) in c.iter().zip([0.75 / 0.3, 0.45 / 0.1, 0.75 / 0.1]) {
            assert!((command[1] - rate).abs() < 1e-12, "{c:?}");
        }
        let twist = l.twist(|i| c[i]).unwrap();
        for (found, want) in twist.iter().zip([0.6, 0.0, 0.5]) {
            assert!((found - want).abs() < 1e-12, "{twist:?}");
        }
    }

    #[test]
    fn at_the_smallest_circle_a_wheel_is_at_its_limit() {
        let l = layout(&curiosity());
        let limit = 35f64.to_radians();
        let c = commands(&l, 0.1, 0.1 / l.radius_min(limit));
        let worst = c.iter().fold(0.0_f64, |a, s| a.max(s[0].abs()));
        assert!((worst - limit).abs() < 1e-9, "{}", worst.to_degrees());
    }
}
