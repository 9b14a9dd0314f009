//! Force balance of a vehicle whose wheels have traction.
use super::machine::{COUPLING, Machine};
use super::{DRIVE, RollingError, WheelLoad};
use linkwork_spatial::{Mat3, Vec3};

/// If rims slide faster than this (m/s) and faster than [`FASTER`] times the fastest rim rotates, the forces cannot be balanced.
const SLIDES: f64 = 1.0;
const FASTER: f64 = 3.0;

impl Machine {
    /// Returns the driving rates at which forces balance `holds`, with the present resistance of the wheels.
    pub fn balance(&self, rolls: bool, holds: &Vec3) -> Vec3 {
        let (mut square, mut side) = (Mat3::zeros(), -holds);
        for (row, &[x, y, heading, alone]) in self.slides.iter().enumerate() {
            let (force, resists) = self.resists(row);
            let (force, change) = (if rolls { 0.0 } else { force }, [x, y, heading]);
            for i in 0..DRIVE {
                side[i] += change[i] * (force - resists * alone);
                for j in 0..DRIVE {
                    square[(i, j)] += resists * change[i] * change[j];
                }
            }
        }
        // Coordinates that no wheel determines stay unchanged.
        square += Mat3::identity() * (1e-13 * square.trace() + f64::MIN_POSITIVE);
        square.cholesky().map_or_else(Vec3::zeros, |c| c.solve(&side))
    }

    /// Limits the resistance of wheels that slide at these driving rates. Returns the largest relative change.
    pub fn limit(&mut self, drive: &Vec3) -> f64 {
        let mut most = 0.0_f64;
        for (w, (now, t)) in self.resists.iter_mut().zip(&self.traction).enumerate() {
            let over: f64 = (0..2)
                .map(|k| {
                    let [x, y, heading, alone] = self.slides[2 * w + k];
                    let slides = alone + x * drive.x + y * drive.y + heading * drive.z;
                    let part = t.resistance[k] * slides / t.limit[k];
                    if t.resistance[k] > 0.0 { part * part } else { 0.0 }
                })
                .sum::<f64>()
                .sqrt();
            let share = if over > 1.0 { 1.0 / over } else { 1.0 };
            for (now, own) in now.iter_mut().zip(t.resistance) {
                let next = share * own;
                if next > 0.0 {
                    most = most.max((next - *now).abs() / next);
                }
                *now = next;
            }
        }
        most
    }

    /// Returns the force on a wheel that does not slide along a row of `slide` (N), and its resistance (N s/m).
    pub fn resists(&self, row: usize) -> (f64, f64) {
        let (traction, axis) = (&self.traction[row / 2], &self.axes[row / 2][row % 2]);
        (traction.force.dot(axis), self.resists[row / 2][row % 2])
    }

    /// Returns the velocity of a rim over the ground along a row of `slide` (m/s).
    pub fn slides_along(&self, row: usize) -> f64 {
        let n = self.unknowns();
        let along = self.slide[row * n..(row + 1) * n].iter().zip(&self.rates);
        self.given[1][row] + along.map(|(a, b)| a * b).sum::<f64>()
    }

    /// Returns the force of the ground on a wheel along a row of `slide`, with its present sliding (N).
    fn along(&self, row: usize) -> f64 {
        let (force, resists) = self.resists(row);
        force - resists * self.slides_along(row)
    }

    /// Returns the RMS of the remaining sliding (m/s).
    pub fn slides(&self) -> f64 {
        let rows = self.given[1].len();
        let squares = (0..rows).map(|row| self.slides_along(row).powi(2)).sum::<f64>();
        (squares / rows.max(1) as f64).sqrt()
    }

    /// Computes the loads from known tractions: normal forces that balance all forces. The rows of normals must still be factored.
    pub fn carry(&mut self, loads: &mut Vec<WheelLoad>, forces: &mut [f64]) {
        let n = self.unknowns();
        self.right.copy_from_slice(&self.holds[DRIVE..]);
        for row in 0..self.given[1].len() {
            let along = self.along(row);
            let slide = &self.slide[row * n + DRIVE..(row + 1) * n];
            self.right.iter_mut().zip(slide).for_each(|(right, s)| *right -= along * s);
        }
        self.gram.solve(&mut self.right);
        let of = |row: usize| -> f64 {
            let normal = &self.normal[row * n + DRIVE..(row + 1) * n];
            normal.iter().zip(&self.right).map(|(a, b)| a * b).sum()
        };
        for (w, (foot, (body, _))) in self.footing.iter().zip(&self.spec.wheels).enumerate() {
            let [ahead, side] = self.axes[w];
            let force =
                foot.normal * of(w) + ahead * self.along(2 * w) + side * self.along(2 * w + 1);
            loads.push(WheelLoad { body: *body, force, point: foot.point });
        }
        for (c, coupling) in self.couplings.iter().enumerate() {
            forces[coupling.place] = COUPLING * of(self.footing.len() + c);
        }
    }

    /// Checks that sliding is not much faster than driving. Otherwise forces cannot be balanced, and the vehicle would slide down its slope.
    pub fn balances(&self) -> Result<(), RollingError> {
        let turns = |w: usize| self.given[1][2 * w].abs();
        let (rows, wheels) = (0..self.given[1].len(), 0..self.footing.len());
        let speed = rows.map(|row| self.slides_along(row).abs()).fold(0.0, f64::max);
        let fastest = wheels.map(turns).fold(0.0, f64::max);
        match !(speed < SLIDES + FASTER * fastest) {
            true => Err(RollingError::Slides { root: self.name.clone(), speed }),
            false => Ok(()),
        }
    }
}
