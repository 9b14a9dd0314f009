//! One vehicle: rows of its wheels and couplings, and the motions that they permit.
use super::contact::{self, Footing, footing};
use super::small::Symmetric;
use super::{DRIVE, RollingError, RollingGround, SETTLES, Traction, Vehicle, WheelLoad};
use linkwork_dynamics::{Tree, Workspace, body_jacobian};
use linkwork_spatial::Vec3;
use linkwork_spatial::nalgebra::Matrix6;

/// Weight of a coupling (rad) relative to the gap of a wheel (m), so that couplings are exact where wheels are not.
pub const COUPLING: f64 = 100.0;
/// Maximum number of balances while wheels reach their limits, and relative change of the resistance at which the iteration stops.
pub const LIMITS: (usize, f64) = (50, 1e-6);
/// Elements of a twist (angular, linear) in the order of the root's unknowns: x, y, heading, height, roll, pitch.
const TWIST: [usize; 2 * DRIVE] = [3, 4, 2, 5, 0, 1];

/// Part of a wheel's rim that is searched for the nearest ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Search {
    /// The whole lower rim.
    Whole,
    /// Near the previous contact point.
    Near,
}

/// A coupling of a vehicle's joints: its index, factors of its unknowns, (index in q, in v, factor) of all terms, constant.
#[derive(Clone, Debug)]
pub struct CouplingRow {
    /// Index among the mechanism's couplings.
    pub place: usize,
    pub factors: Vec<f64>,
    pub terms: Vec<(usize, usize, f64)>,
    pub constant: f64,
}

/// A vehicle with its workspace.
#[derive(Clone, Debug)]
pub struct Machine {
    pub spec: Vehicle,
    pub name: String,
    pub names: Vec<String>,
    /// First index of the root in v; indices of the joints.
    pub root: usize,
    pub joints: Vec<usize>,
    pub couplings: Vec<CouplingRow>,
    /// Footing of each wheel, and its traction.
    pub footing: Vec<Footing>,
    pub traction: Vec<Traction>,
    /// Forward and sideways direction of each wheel along the ground, W.
    pub axes: Vec<[Vec3; 2]>,
    /// Resistance of each wheel against sliding, forward and sideways (N s/m).
    pub resists: Vec<[f64; 2]>,
    /// Velocity of the rims, forward and sideways of each wheel, for each element of d, and for d = 0; all with the wheels on the ground.
    pub slides: Vec<[f64; DRIVE + 1]>,
    /// Generalised forces that keep the vehicle at rest, for each unknown, and the effect of the ground's moments.
    pub holds: Vec<f64>,
    pub turns: Vec<f64>,
    /// Rows of unknowns, [`Machine::unknowns`] each: normal of each wheel and couplings; forward and sideways of each wheel; up of each wheel and
    /// couplings.
    pub normal: Vec<f64>,
    pub slide: Vec<f64>,
    pub lift: Vec<f64>,
    /// Contribution of prescribed motions to the rows of `normal` and `slide`.
    pub given: [Vec<f64>; 2],
    pub gram: Symmetric,
    /// s for each element of d, and for the prescribed motions.
    pub columns: Vec<f64>,
    /// Solution: rates of the unknowns.
    pub rates: Vec<f64>,
    pub error: Vec<f64>,
    pub right: Vec<f64>,
    pub inverse: Matrix6<f64>,
}

impl Machine {
    pub fn unknowns(&self) -> usize {
        2 * DRIVE + self.joints.len()
    }

    /// Returns the distance of a wheel from its position of contact, which is at its sinkage in the ground (m).
    pub fn gap(&self, wheel: usize) -> f64 {
        self.footing[wheel].gap + self.traction[wheel].sinkage
    }

    /// Computes the footing of all wheels at the poses in the workspace.
    pub fn stand(
        &mut self,
        tree: &Tree,
        ws: &Workspace,
        ground: &mut impl RollingGround,
        search: Search,
    ) -> Result<(), RollingError> {
        for w in 0..self.footing.len() {
            self.footing[w] = self.foot(w, tree, ws, ground, search)?;
        }
        Ok(())
    }

    /// Searches whole rims, and returns whether the ground is nearer to a wheel elsewhere than at its footing.
    pub fn touches_elsewhere(
        &mut self,
        tree: &Tree,
        ws: &Workspace,
        ground: &mut impl RollingGround,
    ) -> Result<bool, RollingError> {
        let mut elsewhere = false;
        for w in 0..self.footing.len() {
            let found = self.foot(w, tree, ws, ground, Search::Whole)?;
            elsewhere |= found.gap < self.footing[w].gap - SETTLES.1;
            self.footing[w] = found;
        }
        Ok(elsewhere)
    }

    pub fn foot(
        &self,
        w: usize,
        tree: &Tree,
        ws: &Workspace,
        ground: &mut impl RollingGround,
        search: Search,
    ) -> Result<Footing, RollingError> {
        let (body, radius) = self.spec.wheels[w];
        let pose = ws.body_pose(tree, body);
        let found = match search {
            Search::Whole => footing(ground, &pose, radius),
            Search::Near => contact::near(ground, &pose, radius, self.footing[w].angle),
        };
        found.ok_or_else(|| {
            let c = pose.position;
            RollingError::NoGround { wheel: self.names[w].clone(), x: c.x, y: c.y }
        })
    }

    /// Computes the rows of all wheels at their footing; `up` is the vertical.
    pub fn rows(&mut self, tree: &Tree, ws: &Workspace, jacobian: &mut [f64], up: &Vec3) {
        let (n, nv) = (self.unknowns(), tree.nv());
        let origin = ws.body_pose(tree, self.spec.root).position;
        // The Jacobian maps the root's rates to its twist in the axes of W.
        body_jacobian(tree, ws, self.spec.root, jacobian);
        let twist = Matrix6::from_fn(|row, k| jacobian[row * nv + self.root + k]);
        self.inverse = twist.try_inverse().unwrap_or_else(Matrix6::identity);
        self.turns.fill(0.0);
        for (w, (body, _)) in self.spec.wheels.iter().enumerate() {
            let (pose, foot) = (ws.body_pose(tree, *body), self.footing[w]);
            body_jacobian(tree, ws, *body, jacobian);
            let arm = foot.point - pose.position;
            let part = |k: usize, row: usize| {
                let at = |row: usize| jacobian[row * nv + k];
                Vec3::new(at(row), at(row + 1), at(row + 2))
            };
            let ahead = (pose.rotation * Vec3::y()).cross(&foot.normal).normalize();
            let side = foot.normal.cross(&ahead);
            self.axes[w] = [ahead, side];
            let directions = [foot.normal, ahead, side, *up];
            let from_root = foot.point - origin;
            for k in 0..n {
                // The function returns the angular velocity of the wheel, and the velocity of its
                // footing.
                let turning = |axis: Vec3| (axis, axis.cross(&from_root));
                let (turns, motion) = match k {
                    0 => (Vec3::zeros(), Vec3::x()),
                    1 => (Vec3::zeros(), Vec3::y()),
                    2 => turning(Vec3::z()),
                    3 => (Vec3::zeros(), Vec3::z()),
                    4 => turning(Vec3::x()),
                    5 => turning(Vec3::y()),
                    _ => {
                        let lane = self.joints[k - 2 * DRIVE];
                        let turns = part(lane, 0);
                        (turns, part(lane, 3) + turns.cross(&arm))
                    }
                };
                self.turns[k] += self.traction[w].moment.dot(&turns);
                let [normal, ahead, side, up] = directions.map(|d| d.dot(&motion));
                self.normal[w * n + k] = normal;
                self.slide[2 * w * n + k] = ahead;
                self.slide[(2 * w + 1) * n + k] = side;
                self.lift[w * n + k] = up;
            }
        }
        let wheels = self.spec.wheels.len();
        for (c, coupling) in self.couplings.iter().enumerate() {
            let at = (wheels + c) * n;
            for (k, factor) in coupling.factors.iter().enumerate() {
                self.normal[at + k] = COUPLING * factor;
                self.lift[at + k] = *factor;
            }
        }
        let settles = n - DRIVE;
        self.gram.of_columns(&self.normal, n, DRIVE..DRIVE + settles);
    }

    /// Computes the contribution of prescribed rates to the same rows.
    pub fn follow(&mut self, tree: &Tree, ws: &Workspace, jacobian: &mut [f64], given: &[f64]) {
        let nv = given.len();
        for (w, (body, _)) in self.spec.wheels.iter().enumerate() {
            let (pose, foot) = (ws.body_pose(tree, *body), self.footing[w]);
            body_jacobian(tree, ws, *body, jacobian);
            let mut twist = [0.0; 6];
            for (row, sum) in twist.iter_mut().enumerate() {
                *sum = (0..nv).map(|k| jacobian[row * nv + k] * given[k]).sum();
            }
            let [a, b, c, x, y, z] = twist;
            let arm = foot.point - pose.position;
            let moved = Vec3::new(x, y, z) + Vec3::new(a, b, c).cross(&arm);
            let [ahead, side] = self.axes[w];
            self.given[0][w] = foot.normal.dot(&moved);
            self.given[1][2 * w] = ahead.dot(&moved);
            self.given[1][2 * w + 1] = side.dot(&moved);
        }
        let wheels = self.spec.wheels.len();
        for (c, coupling) in self.couplings.iter().enumerate() {
            let moved: f64 = coupling.terms.iter().map(|(_, v, f)| f * given[*v]).sum();
            self.given[0][wheels + c] = COUPLING * moved;
        }
    }

    /// Solves for s with a right side of the rows of normals: −(GᵀG)⁻¹ Gᵀ e, into `right`.
    pub fn settled(&mut self, column: impl Fn(&Machine, usize) -> f64) {
        let (n, settles) = (self.unknowns(), self.right.len());
        for k in 0..settles {
            let rows = 0..self.given[0].len();
            self.right[k] =
                -rows.map(|row| self.normal[row * n + DRIVE + k] * column(self, row)).sum::<f64>();
        }
        self.gram.solve(&mut self.right);
    }

    /// Computes the work of the generalised forces that keep the vehicle at rest, for each unknown: along twists of the root, then the joints.
    pub fn holds(&mut self, hold: &[f64]) {
        for k in 0..self.holds.len() {
            self.holds[k] = match TWIST.get(k) {
                Some(row) => {
                    (0..6).map(|lane| self.inverse[(lane, *row)] * hold[self.root + lane]).sum()
                }
                None => hold[self.joints[k - 2 * DRIVE]],
            } - self.turns[k];
        }
    }

    /// Computes the rates of all unknowns for the prescribed motions: with the least sliding, or with sliding that balances all forces.
    pub fn solve(&mut self, rolls: bool) {
        let n = self.unknowns();
        let rows = self.given[1].len();
        let settles = self.right.len();
        let mut columns = std::mem::take(&mut self.columns);
        for d in 0..=DRIVE {
            match d {
                DRIVE => self.settled(|m, row| m.given[0][row]),
                _ => self.settled(|m, row| m.normal[row * n + d]),
            }
            columns[d * settles..(d + 1) * settles].copy_from_slice(&self.right);
        }
        let column = |d: usize| &columns[d * settles..(d + 1) * settles];
        for row in 0..rows {
            let slides = &self.slide[row * n..(row + 1) * n];
            let of = |s: &[f64]| -> f64 { slides[DRIVE..].iter().zip(s).map(|(a, b)| a * b).sum() };
            let alone = self.given[1][row] + of(column(DRIVE));
            let change = |d: usize| if d == DRIVE { alone } else { slides[d] + of(column(d)) };
            self.slides[row] = std::array::from_fn(change);
        }
        let mut holds = Vec3::zeros();
        if !rolls {
            for d in 0..DRIVE {
                let settles = self.holds[DRIVE..].iter().zip(column(d));
                holds[d] = self.holds[d] + settles.map(|(hold, s)| hold * s).sum::<f64>();
            }
        }
        for (now, t) in self.resists.iter_mut().zip(&self.traction) {
            *now = if rolls { [1.0; 2] } else { t.resistance };
        }
        let mut drive = self.balance(rolls, &holds);
        let mut balances = if rolls { 0 } else { LIMITS.0 };
        while balances > 0 {
            let changes = self.limit(&drive);
            drive = self.balance(rolls, &holds);
            balances = if changes < LIMITS.1 { 0 } else { balances - 1 };
        }
        self.rates[..DRIVE].copy_from_slice(drive.as_slice());
        for k in 0..settles {
            let along: f64 = (0..DRIVE).map(|d| column(d)[k] * drive[d]).sum();
            self.rates[DRIVE + k] = column(DRIVE)[k] + along;
        }
        self.columns = columns;
    }

    /// Computes the distances of wheels and the errors of couplings at `q`. Returns their norm.
    pub fn errors(&mut self, q: &[f64]) -> f64 {
        let wheels = self.footing.len();
        for w in 0..wheels {
            self.error[w] = self.gap(w);
        }
        for (error, c) in self.error[wheels..].iter_mut().zip(&self.couplings) {
            let sum: f64 = c.terms.iter().map(|(at, _, f)| f * q[*at]).sum();
            *error = COUPLING * (sum - c.constant);
        }
        self.error.iter().map(|e| e * e).sum::<f64>().sqrt()
    }

    /// Writes the step of s that removes the errors into the rates; d stays unchanged.
    pub fn correction(&mut self) {
        self.settled(|m, row| m.error[row]);
        self.rates[..DRIVE].fill(0.0);
        self.rates[DRIVE..].copy_from_slice(&self.right);
    }

    /// Writes the unknowns times `h` into v.
    pub fn fill_lanes(&self, h: f64, v: &mut [f64]) {
        let r = &self.rates;
        let twist = [r[4], r[5], r[2], r[0], r[1], r[3]];
        for k in 0..6 {
            let along = (0..6).map(|row| self.inverse[(k, row)] * twist[row]);
            v[self.root + k] = h * along.sum::<f64>();
        }
        for (lane, rate) in self.joints.iter().zip(&r[2 * DRIVE..]) {
            v[*lane] = h * rate;
        }
    }

    /// Computes the loads from the forces that keep the vehicle at rest. Overwrites the factor of the rows of normals.
    pub fn weigh(&mut self, up: &Vec3, loads: &mut Vec<WheelLoad>, forces: &mut [f64]) {
        let n = self.unknowns();
        let settles = self.right.len();
        self.right.copy_from_slice(&self.holds[DRIVE..]);
        self.gram.of_columns(&self.lift, n, DRIVE..DRIVE + settles);
        self.gram.solve(&mut self.right);
        let of = |row: usize| -> f64 {
            let lift = &self.lift[row * n + DRIVE..(row + 1) * n];
            lift.iter().zip(&self.right).map(|(a, b)| a * b).sum()
        };
        for (w, (foot, (body, _))) in self.footing.iter().zip(&self.spec.wheels).enumerate() {
            loads.push(WheelLoad { body: *body, force: up * of(w), point: foot.point });
        }
        for (c, coupling) in self.couplings.iter().enumerate() {
            forces[coupling.place] = of(self.footing.len() + c);
        }
    }
}
