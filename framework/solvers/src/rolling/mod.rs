//! Vehicles that roll without slip on uneven ground: motion by kinematics alone, and what their wheels carry.
//!
//! A vehicle is a root on a free hinge, wheels, and joints that adapt to the ground (rockers, bogies); every other hinge
//! is prescribed (axles, steering). With δ a small motion of the unknown coordinates:
//! ```text
//! d           x, y, heading of the root: where the vehicle drives
//! s           height, roll, pitch of the root, and the joints: how it lies on the ground
//! G s + G_d d + g = 0        each wheel stays on the ground (along its normal n), couplings hold
//! H s + H_d d + h → least    each wheel's rim has no velocity over the ground, ahead and to the side
//! ```
//! g and h are what prescribed motions do. The first is solved for s, exactly where there are as many wheels as s has
//! coordinates, else by least squares; the second then gives d, by least squares over wheels that may disagree. The step goes
//! along these rates, exactly for a constant twist of the root; then s is put back onto the ground by Gauss–Newton
//! steps at the new place.
//!
//! Loads are those of rest: F along the vertical at each wheel, so that every wheel has the same share of traction, T = N tan α on
//! a slope α, and the virtual work of all forces vanishes for each motion s:
//! ```text
//! Uᵀ F = Sᵀ τ           τ: generalised forces that hold the machine still;   U: how far s lifts each wheel
//! ```
//! It knows no friction: what would slide or tip over rolls on. It knows no limits of joints either.
//!
//! With the traction of its wheels ([`Traction`]) it is quasi-static: wheels stand in the ground at their sinkage and slide so
//! that all forces balance at each instant. With u the velocity of a rim over the ground and c, R of its traction
//! ```text
//! f = c − R u                     force of the ground ahead and to the side, R ≥ 0 diagonal, R u within an ellipse
//! Σ (H_d + H s_d)ᵀ f = τ_d + s_dᵀ τ_s       balance along each motion d with the s that goes with it: no normal force works there
//! Gᵀ N = τ_s − Hᵀ f               then the normal forces;   τ: less what moments of the ground do
//! ```
//! which for R = 1, c = 0 and τ = 0 is the least sliding of above. c and R are taken anew at each step from where it slid before.
mod contact;
mod error;
mod small;

pub use contact::{Footing, footing};
pub use error::RollingError;

use linkwork_dynamics::{Tree, Workspace, body_jacobian, poses};
use linkwork_multibody::{BodyId, Coordinate, SubhingeKind};
use linkwork_spatial::nalgebra::Matrix6;
use linkwork_spatial::{Mat3, Vec3};
use small::Symmetric;

/// A vehicle on wheels.
#[derive(Clone, Debug, PartialEq)]
pub struct Vehicle {
    /// Its root, on a free hinge of the world.
    pub root: BodyId,
    /// Wheels: body, whose y axis is the axle and whose origin the hub, and radius (m).
    pub wheels: Vec<(BodyId, f64)>,
    /// Bodies whose pin hinges adapt to the ground.
    pub joints: Vec<BodyId>,
}

/// What a step left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RollingReport {
    /// Greatest distance of a wheel from the ground, above or in it (m).
    pub gap: f64,
    /// Root mean square of the speed at which rims would have to slide, ahead or sideways, since wheels disagree (m/s).
    pub slide: f64,
}

/// What the ground does to a wheel that slides over it slowly, about how it slides now.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traction {
    /// Force on the wheel where its rim does not slide, less the normal force, W (N).
    pub force: Vec3,
    /// Moment on the wheel beside that of the forces at its footing, as where they act ahead of it, W (N m).
    pub moment: Vec3,
    /// Force against sliding ahead and to the side (N s/m), not negative. A machine none of whose wheels has any rolls.
    pub resistance: [f64; 2],
    /// Greatest such force ahead and to the side (N), half axes of an ellipse.
    pub limit: [f64; 2],
    /// How deep the wheel stands in the ground, along its normal (m).
    pub sinkage: f64,
}

/// A wheel on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelLoad {
    /// The wheel.
    pub body: BodyId,
    /// Force of the ground, W (N): that of rest, along the vertical; with traction the one that balances.
    pub force: Vec3,
    /// Where it acts, W (m).
    pub point: Vec3,
}

/// Unknowns that drive, before those that settle.
const DRIVE: usize = 3;
/// Rows of a twist (angular, linear) in the order of the root's unknowns: x, y, heading, height, roll, pitch.
const TWIST: [usize; 2 * DRIVE] = [3, 4, 2, 5, 0, 1];
/// Weight of a coupling (rad) beside the gap of a wheel (m): couplings are exact where wheels are not.
const COUPLING: f64 = 100.0;
/// Gauss–Newton steps of a settling at most, and the distance (m, rad) from which one more changes nothing.
const SETTLES: (usize, f64) = (40, 1e-9);
/// Corrections below this (m, rad) leave a wheel on the same part of its rim.
const NEAR: f64 = 2e-3;
/// Searches of whole rims that find a wheel touching elsewhere, at most.
const ROUNDS: usize = 4;
/// Lifts of a machine with wheels in the ground, at most.
const LIFTS: usize = 6;
/// A wheel so far from the ground (m) has not come to lie on it.
const APART: f64 = 0.02;
/// Balances at most while wheels come to their limits, and the relative change of what they resist that ends them.
const LIMITS: (usize, f64) = (50, 1e-6);
/// Rims that slide faster than this (m/s) and than [`FASTER`] times the fastest of them turns: nothing balances any more.
const SLIDES: f64 = 1.0;
const FASTER: f64 = 3.0;

/// Where on the rim of a wheel the ground is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Search {
    /// All of the lower rim.
    Whole,
    /// Near the point that touched before.
    Near,
}

/// A coupling of a vehicle's joints: its place, factors of its unknowns, (place in q, in v, factor) of all terms, constant.
#[derive(Clone, Debug)]
struct CouplingRow {
    /// Place among the mechanism's couplings.
    place: usize,
    factors: Vec<f64>,
    terms: Vec<(usize, usize, f64)>,
    constant: f64,
}

/// A vehicle with its work space.
#[derive(Clone, Debug)]
struct Machine {
    spec: Vehicle,
    name: String,
    names: Vec<String>,
    /// First lane of the root's v; lanes of the joints.
    root: usize,
    joints: Vec<usize>,
    couplings: Vec<CouplingRow>,
    /// Footing of each wheel, and what the ground does to it.
    footing: Vec<Footing>,
    traction: Vec<Traction>,
    /// Ahead and side of each wheel along the ground, W.
    axes: Vec<[Vec3; 2]>,
    /// What each wheel resists as it slides, ahead and to the side (N s/m).
    resists: Vec<[f64; 2]>,
    /// Velocity of rims, ahead and side of each wheel, with each of d, and for d = 0; all on the ground.
    slides: Vec<[f64; DRIVE + 1]>,
    /// What holds the machine still, along each unknown, and what moments of the ground do there.
    holds: Vec<f64>,
    turns: Vec<f64>,
    /// Rows of unknowns, [`Machine::unknowns`] each: normal of each wheel and couplings; ahead and side of each wheel; up of
    /// each wheel and couplings.
    normal: Vec<f64>,
    slide: Vec<f64>,
    lift: Vec<f64>,
    /// What prescribed motions add to rows of `normal` and `slide`.
    given: [Vec<f64>; 2],
    gram: Symmetric,
    /// s that goes with each of d, and with what is given.
    columns: Vec<f64>,
    /// Solution: unknowns.
    rates: Vec<f64>,
    error: Vec<f64>,
    right: Vec<f64>,
    inverse: Matrix6<f64>,
}

/// Vehicles of a mechanism that roll, with their memory: nothing is allocated by a step.
#[derive(Clone, Debug)]
pub struct Rolling {
    machines: Vec<Machine>,
    prescribed: Vec<bool>,
    jacobian: Vec<f64>,
    given: Vec<f64>,
    dv: Vec<f64>,
    next: Vec<f64>,
    best: Vec<f64>,
    /// Where the machines stood when their footings were found, by the whole of each rim; empty before.
    stood: Vec<f64>,
    loads: Vec<WheelLoad>,
    /// Force of each coupling of the mechanism (N m or N).
    forces: Vec<f64>,
}

/// Height (m) and unit normal of the ground at x, y (m), W; `None` where there is none.
pub trait RollingGround: FnMut(f64, f64) -> Option<(f64, Vec3)> {}
impl<F: FnMut(f64, f64) -> Option<(f64, Vec3)>> RollingGround for F {}

impl Rolling {
    /// Vehicles that are all that moves in a mechanism, but for prescribed hinges.
    ///
    /// # Errors
    /// Roots and joints that cannot be such, coordinates that nothing determines, loops, flexible bodies.
    pub fn new(tree: &Tree, vehicles: &[Vehicle]) -> Result<Self, RollingError> {
        let mb = tree.multibody();
        let name = |b: BodyId| mb.get(b).name().to_string();
        let prescribed = mb.prescribed();
        let mut known = prescribed.clone();
        if let Some(l) = mb.loops().first() {
            let what = format!("loops (`{}`)", l.closure.name);
            let help = "couple the coordinates, or simulate with forces";
            return Err(RollingError::Unknown { what, help });
        }
        if let Some(b) = mb.bodies().iter().find(|b| !b.modes_q().is_empty()) {
            let what = format!("bodies that bend (`{}`)", b.name());
            let help = "write the body without `modes`, or simulate with forces";
            return Err(RollingError::Unknown { what, help });
        }
        let mut machines = Vec::new();
        for spec in vehicles {
            let body = mb.get(spec.root);
            let root = match (body.parent(), body.subhinges()) {
                (None, [s])
                    if s.subhinge.kind == SubhingeKind::Free
                        && s.subhinge.coordinate == Coordinate::Free =>
                {
                    s.v.start
                }
                _ => return Err(RollingError::Root { body: name(spec.root) }),
            };
            known[root..root + 6].fill(true);
            let mut joints = Vec::new();
            for joint in &spec.joints {
                match mb.get(*joint).subhinges() {
                    [s] if matches!(s.subhinge.kind, SubhingeKind::Pin { .. })
                        && s.subhinge.coordinate == Coordinate::Free =>
                    {
                        joints.push(s.v.start);
                        known[s.v.start] = true;
                    }
                    _ => return Err(RollingError::Joint { body: name(*joint) }),
                }
            }
            let unknowns = 2 * DRIVE + joints.len();
            let mut couplings = Vec::new();
            for (place, c) in mb.couplings().iter().enumerate() {
                let mut factors = vec![0.0; unknowns];
                for (_, v, factor) in &c.terms {
                    if let Some(k) = joints.iter().position(|j| j == v) {
                        factors[2 * DRIVE + k] += factor;
                    }
                }
                if factors.iter().any(|f| *f != 0.0) {
                    let constant = c.coupling.constant;
                    couplings.push(CouplingRow {
                        place,
                        factors,
                        terms: c.terms.clone(),
                        constant,
                    });
                }
            }
            let (wheels, settles) = (spec.wheels.len(), DRIVE + joints.len());
            let rows = wheels + couplings.len();
            if rows < settles {
                return Err(RollingError::Few {
                    root: name(spec.root),
                    wheels,
                    couplings: couplings.len(),
                    needed: settles,
                });
            }
            machines.push(Machine {
                name: name(spec.root),
                names: spec.wheels.iter().map(|w| name(w.0)).collect(),
                spec: spec.clone(),
                root,
                joints,
                footing: vec![Footing::default(); wheels],
                traction: vec![Traction::default(); wheels],
                axes: vec![[Vec3::zeros(); 2]; wheels],
                resists: vec![[1.0; 2]; wheels],
                slides: vec![[0.0; DRIVE + 1]; 2 * wheels],
                holds: vec![0.0; unknowns],
                turns: vec![0.0; unknowns],
                normal: vec![0.0; rows * unknowns],
                slide: vec![0.0; 2 * wheels * unknowns],
                lift: vec![0.0; rows * unknowns],
                given: [vec![0.0; rows], vec![0.0; 2 * wheels]],
                gram: Symmetric::new(settles),
                columns: vec![0.0; (DRIVE + 1) * settles],
                rates: vec![0.0; unknowns],
                error: vec![0.0; rows],
                right: vec![0.0; settles],
                inverse: Matrix6::identity(),
                couplings,
            });
        }
        if let Some(lane) = known.iter().position(|k| !k) {
            let body = mb.subhinges().find(|(_, s)| s.v.contains(&lane)).map(|(b, _)| name(b));
            return Err(RollingError::Undetermined { body: body.unwrap_or_default() });
        }
        let wheels = machines.iter().map(|m| m.spec.wheels.len()).sum();
        let (nq, nv) = (mb.nq(), mb.nv());
        Ok(Rolling {
            machines,
            prescribed,
            jacobian: vec![0.0; 6 * nv],
            given: vec![0.0; nv],
            dv: vec![0.0; nv],
            next: vec![0.0; nq],
            best: vec![0.0; nq],
            stood: Vec::with_capacity(nq),
            loads: Vec::with_capacity(wheels),
            forces: vec![0.0; mb.couplings().len()],
        })
    }

    /// Puts every vehicle onto the ground where it is: x, y and heading of its root stay. O(wheels · n) for each of some steps.
    /// After another ground than in the call before, this comes first.
    ///
    /// # Errors
    /// No ground, or none on which the wheels come to lie.
    pub fn settle(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        ground: &mut impl RollingGround,
        q: &mut [f64],
    ) -> Result<RollingReport, RollingError> {
        self.settle_all(tree, ws, ground, q, Search::Whole)
    }

    fn settle_all(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        ground: &mut impl RollingGround,
        q: &mut [f64],
        search: Search,
    ) -> Result<RollingReport, RollingError> {
        let mut report = RollingReport::default();
        self.stood.clear();
        for k in 0..self.machines.len() {
            report.gap = report.gap.max(self.settle_one(k, tree, ws, ground, q, search)?);
        }
        self.stood.extend_from_slice(q);
        Ok(report)
    }

    /// A step of `h` s from `q`, with the rates in `v` and the accelerations in `vdot` of prescribed coordinates, which are
    /// integrated exactly for constant ones; all of `v` are rates at the end. `hold` (nv): the generalised forces that hold the
    /// machine still at `q`; `up`: the vertical, W. `tractions`: of the wheels of all vehicles, in their order; empty where they
    /// roll.
    ///
    /// # Errors
    /// As of [`Rolling::settle`]; tractions under which nothing balances.
    ///
    /// # Panics
    /// If there are some tractions, and not one of each wheel.
    pub fn step(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        ground: &mut impl RollingGround,
        h: f64,
        (q, v, vdot): (&mut [f64], &mut [f64], &[f64]),
        (hold, up): (&[f64], &Vec3),
        mut tractions: &[Traction],
    ) -> Result<RollingReport, RollingError> {
        let mut report = RollingReport::default();
        self.loads.clear();
        for lane in 0..v.len() {
            let given = self.prescribed[lane];
            // The mean rate of the step.
            self.given[lane] = if given { v[lane] + 0.5 * h * vdot[lane] } else { 0.0 };
            v[lane] = if given { v[lane] + h * vdot[lane] } else { 0.0 };
        }
        self.dv.iter_mut().zip(&self.given).for_each(|(dv, v)| *dv = h * v);
        poses(tree, ws, q);
        let found = self.stood == *q;
        for machine in &mut self.machines {
            if !found {
                machine.stand(tree, ws, ground, Search::Whole)?;
            }
            let rolls = match tractions.split_at_checked(machine.traction.len()) {
                Some((own, rest)) => {
                    machine.traction.copy_from_slice(own);
                    tractions = rest;
                    own.iter().all(|t| t.resistance.iter().all(|r| !(*r > 0.0)))
                }
                None => true,
            };
            machine.rows(tree, ws, &mut self.jacobian, up);
            machine.holds(hold);
            machine.follow(tree, ws, &mut self.jacobian, &self.given);
            machine.solve(rolls);
            report.slide = report.slide.max(machine.slides());
            machine.fill_lanes(h, &mut self.dv);
            // The same geometry with the rates at the end.
            machine.follow(tree, ws, &mut self.jacobian, v);
            machine.solve(rolls);
            machine.fill_lanes(1.0, v);
            match rolls {
                true => machine.weigh(up, &mut self.loads, &mut self.forces),
                false => {
                    machine.balances()?;
                    machine.carry(&mut self.loads, &mut self.forces);
                }
            }
        }
        tree.multibody().integrate(q, &self.dv, &mut self.next);
        q.copy_from_slice(&self.next);
        report.gap = self.settle_all(tree, ws, ground, q, Search::Near)?.gap;
        Ok(report)
    }

    /// Force of each coupling of the mechanism in the last step, at its start: factor times force acts on each coordinate (N m, N).
    #[must_use]
    pub fn coupling_forces(&self) -> &[f64] {
        &self.forces
    }

    /// The vehicles.
    pub fn vehicles(&self) -> impl Iterator<Item = &Vehicle> {
        self.machines.iter().map(|m| &m.spec)
    }

    /// Loads of the last step, at its start.
    #[must_use]
    pub fn loads(&self) -> &[WheelLoad] {
        &self.loads
    }

    /// Settles one machine; `search`: how its wheels are looked for at first. In the end its footings are those of a search of
    /// whole rims.
    fn settle_one(
        &mut self,
        k: usize,
        tree: &Tree,
        ws: &mut Workspace,
        ground: &mut impl RollingGround,
        q: &mut [f64],
        search: Search,
    ) -> Result<f64, RollingError> {
        let (mb, up) = (tree.multibody(), Vec3::z());
        let machine = &mut self.machines[k];
        poses(tree, ws, q);
        machine.stand(tree, ws, ground, search)?;
        for _ in 0..ROUNDS {
            machine.rows(tree, ws, &mut self.jacobian, &up);
            let mut least = machine.errors(q);
            self.best.copy_from_slice(q);
            machine.correction();
            let mut share = 1.0;
            for _ in 0..SETTLES.0 {
                let most = share * machine.rates.iter().fold(0.0_f64, |a, r| a.max(r.abs()));
                if most < SETTLES.1 {
                    break;
                }
                self.dv.fill(0.0);
                machine.fill_lanes(share * (0.2 / most).min(1.0), &mut self.dv);
                mb.integrate(&self.best, &self.dv, q);
                poses(tree, ws, q);
                let search = if most < NEAR { Search::Near } else { Search::Whole };
                machine.stand(tree, ws, ground, search)?;
                let size = machine.errors(q);
                if size < least {
                    if size > 0.2 * least {
                        machine.rows(tree, ws, &mut self.jacobian, &up);
                    }
                    (least, share) = (size, 1.0);
                    self.best.copy_from_slice(q);
                    machine.correction();
                } else {
                    // Beyond an edge the ground is another one: back, and half as far.
                    share *= 0.5;
                }
            }
            if self.best != q {
                q.copy_from_slice(&self.best);
                poses(tree, ws, q);
                machine.stand(tree, ws, ground, Search::Near)?;
            }
            if !machine.touches_elsewhere(tree, ws, ground)? {
                break;
            }
        }
        // With more wheels than the machine has ways to lie it stands on those that touch first.
        let mut gap = 0.0;
        for _ in 0..LIFTS {
            let wheels = 0..machine.footing.len();
            gap = wheels.clone().fold(0.0_f64, |a, w| a.max(machine.gap(w).abs()));
            let lift = |w: usize| -machine.gap(w) / machine.footing[w].normal.z;
            let lift = wheels.fold(0.0_f64, |a, w| a.max(lift(w)));
            if !(lift > 1e-9) {
                break;
            }
            machine.rates.fill(0.0);
            machine.rates[DRIVE] = lift;
            self.dv.fill(0.0);
            machine.fill_lanes(1.0, &mut self.dv);
            self.best.copy_from_slice(q);
            mb.integrate(&self.best, &self.dv, q);
            poses(tree, ws, q);
            machine.stand(tree, ws, ground, Search::Whole)?;
        }
        let over = machine.footing.len() + machine.couplings.len() > machine.right.len();
        match !(gap < APART) && !over {
            true => Err(RollingError::Apart { root: machine.name.clone(), gap }),
            false => Ok(gap),
        }
    }
}

impl Machine {
    fn unknowns(&self) -> usize {
        2 * DRIVE + self.joints.len()
    }

    /// Distance of a wheel from where it stands, above or in the ground at its sinkage (m).
    fn gap(&self, wheel: usize) -> f64 {
        self.footing[wheel].gap + self.traction[wheel].sinkage
    }

    /// Footing of all wheels at the poses in the work space.
    fn stand(
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

    /// Looks along whole rims: is the ground nearer to a wheel than where it was found?
    fn touches_elsewhere(
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

    fn foot(
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

    /// Rows of all wheels with their footing; `up`: the vertical.
    fn rows(&mut self, tree: &Tree, ws: &Workspace, jacobian: &mut [f64], up: &Vec3) {
        let (n, nv) = (self.unknowns(), tree.nv());
        let origin = ws.body_pose(tree, self.spec.root).position;
        // From the root's lanes to its twist in the axes of W.
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
                // Angular velocity of the wheel, and velocity of its footing.
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

    /// What prescribed rates do, in the same rows.
    fn follow(&mut self, tree: &Tree, ws: &Workspace, jacobian: &mut [f64], given: &[f64]) {
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

    /// s for a right side of the rows of normals: −(GᵀG)⁻¹ Gᵀ e, into `right`.
    fn settled(&mut self, column: impl Fn(&Machine, usize) -> f64) {
        let (n, settles) = (self.unknowns(), self.right.len());
        for k in 0..settles {
            let rows = 0..self.given[0].len();
            self.right[k] =
                -rows.map(|row| self.normal[row * n + DRIVE + k] * column(self, row)).sum::<f64>();
        }
        self.gram.solve(&mut self.right);
    }

    /// Work of the generalised forces that hold the machine still, for each unknown: along twists of the root, then the joints.
    fn holds(&mut self, hold: &[f64]) {
        for k in 0..self.holds.len() {
            self.holds[k] = match TWIST.get(k) {
                Some(row) => {
                    (0..6).map(|lane| self.inverse[(lane, *row)] * hold[self.root + lane]).sum()
                }
                None => hold[self.joints[k - 2 * DRIVE]],
            } - self.turns[k];
        }
    }

    /// Rates of all unknowns for what is given: with the least sliding, or with that under which all forces balance.
    fn solve(&mut self, rolls: bool) {
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

    /// Rates of driving under which forces balance what holds, as the wheels resist now.
    fn balance(&self, rolls: bool, holds: &Vec3) -> Vec3 {
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
        // What no wheel determines stays.
        square += Mat3::identity() * (1e-13 * square.trace() + f64::MIN_POSITIVE);
        square.cholesky().map_or_else(Vec3::zeros, |c| c.solve(&side))
    }

    /// Lets wheels that slide at the rates of driving resist by no more than their limits. Greatest change, relative.
    fn limit(&mut self, drive: &Vec3) -> f64 {
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

    /// Force on a wheel that does not slide along a row of `slide` (N), and what resists there (N s/m).
    fn resists(&self, row: usize) -> (f64, f64) {
        let (traction, axis) = (&self.traction[row / 2], &self.axes[row / 2][row % 2]);
        (traction.force.dot(axis), self.resists[row / 2][row % 2])
    }

    /// Velocity of a rim over the ground along a row of `slide` (m/s).
    fn slides_along(&self, row: usize) -> f64 {
        let n = self.unknowns();
        let along = self.slide[row * n..(row + 1) * n].iter().zip(&self.rates);
        self.given[1][row] + along.map(|(a, b)| a * b).sum::<f64>()
    }

    /// Root mean square of the sliding that is left (m/s).
    fn slides(&self) -> f64 {
        let rows = self.given[1].len();
        let squares = (0..rows).map(|row| self.slides_along(row).powi(2)).sum::<f64>();
        (squares / rows.max(1) as f64).sqrt()
    }

    /// Distances of wheels and errors of couplings at `q`; their size.
    fn errors(&mut self, q: &[f64]) -> f64 {
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

    /// The step of s that takes the errors away, into the rates; d stays.
    fn correction(&mut self) {
        self.settled(|m, row| m.error[row]);
        self.rates[..DRIVE].fill(0.0);
        self.rates[DRIVE..].copy_from_slice(&self.right);
    }

    /// Unknowns times `h` into the lanes of v.
    fn fill_lanes(&self, h: f64, v: &mut [f64]) {
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

    /// Loads for the forces that hold the machine still; afterwards the rows of normals are factored no more.
    fn weigh(&mut self, up: &Vec3, loads: &mut Vec<WheelLoad>, forces: &mut [f64]) {
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

    /// Loads where tractions are known: normal forces such that all balances. The rows of normals are factored still.
    fn carry(&mut self, loads: &mut Vec<WheelLoad>, forces: &mut [f64]) {
        let n = self.unknowns();
        self.right.copy_from_slice(&self.holds[DRIVE..]);
        for row in 0..self.given[1].len() {
            let (force, resists) = self.resists(row);
            let along = force - resists * self.slides_along(row);
            let slide = &self.slide[row * n + DRIVE..(row + 1) * n];
            self.right.iter_mut().zip(slide).for_each(|(right, s)| *right -= along * s);
        }
        self.gram.solve(&mut self.right);
        let of = |row: usize| -> f64 {
            let normal = &self.normal[row * n + DRIVE..(row + 1) * n];
            normal.iter().zip(&self.right).map(|(a, b)| a * b).sum()
        };
        for (w, (foot, (body, _))) in self.footing.iter().zip(&self.spec.wheels).enumerate() {
            let along = |row: usize| {
                let (force, resists) = self.resists(row);
                force - resists * self.slides_along(row)
            };
            let [ahead, side] = self.axes[w];
            let force = foot.normal * of(w) + ahead * along(2 * w) + side * along(2 * w + 1);
            loads.push(WheelLoad { body: *body, force, point: foot.point });
        }
        for (c, coupling) in self.couplings.iter().enumerate() {
            forces[coupling.place] = COUPLING * of(self.footing.len() + c);
        }
    }

    /// Whether sliding has the size of driving: beyond it nothing balances, and the machine would fall down its slope.
    fn balances(&self) -> Result<(), RollingError> {
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
