//! Vehicles that roll without slip on uneven ground: motion by kinematics alone, and wheel loads.
//!
//! A vehicle is a root on a free hinge, wheels, and joints that adapt to the ground (rockers, bogies). Every other hinge is prescribed (axles,
//! steering). δ is a small motion of the unknown coordinates:
//! ```text
//! d           x, y, heading of the root: where the vehicle drives
//! s           height, roll, pitch of the root, and the joints: how it lies on the ground
//! G s + G_d d + g = 0        each wheel stays on the ground (along its normal n), couplings hold
//! H s + H_d d + h → least    each wheel's rim has no velocity over the ground, ahead and to the side
//! ```
//! g and h are the contributions of prescribed motions. The first equation is solved for s: exactly if the number of wheels equals the number of
//! coordinates in s, otherwise by least squares. The second then gives d by least squares, since wheels may contradict each other. The step follows
//! these rates, exactly for a constant twist of the root. Then Gauss–Newton steps put s back onto the ground at the new position.
//!
//! Loads are static. F is the vertical force at each wheel, such that every wheel has the same ratio of traction to load, T = N tan α on a slope α,
//! and the virtual work of all forces vanishes for each motion s:
//! ```text
//! Uᵀ F = Sᵀ τ           τ: generalised forces that hold the machine still;   U: how far s lifts each wheel
//! ```
//! Friction limits are ignored: a vehicle that would slide or tip over continues to roll. Limits of joints are ignored, too.
//!
//! If the wheels have traction ([`Traction`]), the motion is quasi-static: wheels sink into the ground and slide so that all forces balance at each
//! instant. u is the velocity of a rim over the ground, and c, R are its traction:
//! ```text
//! f = c − R u                     force of the ground ahead and to the side, R ≥ 0 diagonal, R u within an ellipse
//! Σ (H_d + H s_d)ᵀ f = τ_d + s_dᵀ τ_s       balance along each motion d with the s that goes with it: no normal force works there
//! Gᵀ N = τ_s − Hᵀ f               then the normal forces;   τ: less what moments of the ground do
//! ```
//! With R = 1, c = 0 and τ = 0 this is the least sliding from above. Each step recomputes c and R from the previous sliding.
mod balance;
mod contact;
mod error;
mod machine;
mod small;

pub use contact::{Footing, footing};
pub use error::RollingError;

use linkwork_dynamics::{Tree, Workspace, poses};
use linkwork_multibody::{BodyId, Coordinate, SubhingeKind};
use linkwork_spatial::Vec3;
use linkwork_spatial::nalgebra::Matrix6;
use machine::{CouplingRow, Machine, Search};
use small::Symmetric;

/// A vehicle on wheels.
#[derive(Clone, Debug, PartialEq)]
pub struct Vehicle {
    /// Root body, on a free hinge of the world.
    pub root: BodyId,
    /// Wheels: body (y axis along the axle, origin at the hub), and radius (m).
    pub wheels: Vec<(BodyId, f64)>,
    /// Bodies whose pin hinges adapt to the ground.
    pub joints: Vec<BodyId>,
}

/// Residuals of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RollingReport {
    /// Largest distance of a wheel from the ground, above or in it (m).
    pub gap: f64,
    /// RMS of the speed at which rims would have to slide, forward or sideways, because wheels contradict each other (m/s).
    pub slide: f64,
}

/// Traction of a wheel that slides slowly over the ground, linearized about its present sliding.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Traction {
    /// Force on the wheel if its rim does not slide, without the normal force, W (N).
    pub force: Vec3,
    /// Moment on the wheel in addition to the moment of the forces at its footing, for example if they act ahead of it, W (N m).
    pub moment: Vec3,
    /// Resistance against sliding forward and sideways (N s/m), not negative. If all wheels of a vehicle have zero resistance, it rolls.
    pub resistance: [f64; 2],
    /// Largest such force forward and sideways (N), the half axes of an ellipse.
    pub limit: [f64; 2],
    /// Sinkage of the wheel, along the normal of the ground (m).
    pub sinkage: f64,
}

/// Load of a wheel on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelLoad {
    /// The wheel.
    pub body: BodyId,
    /// Force of the ground, W (N): the static vertical force; with traction, the force that balances.
    pub force: Vec3,
    /// Point where it acts, W (m).
    pub point: Vec3,
}

/// Number of driving unknowns; they precede the settling ones.
const DRIVE: usize = 3;
/// Maximum number of Gauss–Newton steps for settling, and distance (m, rad) below which another step has no effect.
const SETTLES: (usize, f64) = (40, 1e-9);
/// Corrections below this (m, rad) keep a wheel on the same part of its rim.
const NEAR: f64 = 2e-3;
/// Maximum number of searches of whole rims that find a wheel touching elsewhere.
const ROUNDS: usize = 4;
/// Maximum number of lifts of a vehicle whose wheels are in the ground.
const LIFTS: usize = 6;
/// A wheel farther than this from the ground (m) does not lie on it.
const APART: f64 = 0.02;

/// Rolling vehicles of a mechanism, with their workspace: a step does not allocate.
#[derive(Clone, Debug)]
pub struct Rolling {
    machines: Vec<Machine>,
    prescribed: Vec<bool>,
    jacobian: Vec<f64>,
    given: Vec<f64>,
    dv: Vec<f64>,
    next: Vec<f64>,
    best: Vec<f64>,
    /// Configuration of the vehicles at the last search of whole rims; empty before.
    stood: Vec<f64>,
    loads: Vec<WheelLoad>,
    /// Force of each coupling of the mechanism (N m or N).
    forces: Vec<f64>,
}

/// Height (m) and unit normal of the ground at x, y (m), W; `None` where there is no ground.
pub trait RollingGround: FnMut(f64, f64) -> Option<(f64, Vec3)> {}
impl<F: FnMut(f64, f64) -> Option<(f64, Vec3)>> RollingGround for F {}

impl Rolling {
    /// Creates the workspace of vehicles. Nothing else in the mechanism may move, except prescribed hinges.
    ///
    /// # Errors
    /// Invalid roots and joints, undetermined coordinates, loops, flexible bodies.
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
            let what = format!("flexible bodies (`{}`)", b.name());
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
                let own = c.terms.iter().any(|(_, v, _)| joints.contains(v));
                if own && !c.is_linear() {
                    return Err(RollingError::Unknown {
                        what: format!("the coupling `{}`, which is not linear", c.coupling.name),
                        help: "write a linear coupling, or simulate the machine with forces",
                    });
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

    /// Puts every vehicle onto the ground at its present x, y and heading. O(wheels · n) for each of several steps. Call this first if the ground
    /// changed.
    ///
    /// # Errors
    /// No ground, or no pose in which the wheels touch it.
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

    /// Makes a step of `h` s from `q`. `v` and `vdot` have the rates and accelerations of prescribed coordinates, which are integrated exactly if
    /// constant. Afterwards, `v` has all rates at the end. `hold` (nv): the generalised forces that keep the vehicle at rest at `q`; `up`: the
    /// vertical, W. `tractions`: one for each wheel of all vehicles, in order; empty for pure rolling.
    ///
    /// # Errors
    /// As [`Rolling::settle`]; also tractions with which forces cannot be balanced.
    ///
    /// # Panics
    /// If `tractions` is neither empty nor has one entry for each wheel.
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
            // Use the mean rate of the step.
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
            // Same geometry with the rates at the end.
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

    /// Returns the force of each coupling of the mechanism in the last step, at its start: factor times force acts on each coordinate (N m, N).
    #[must_use]
    pub fn coupling_forces(&self) -> &[f64] {
        &self.forces
    }

    /// Returns the vehicles.
    pub fn vehicles(&self) -> impl Iterator<Item = &Vehicle> {
        self.machines.iter().map(|m| &m.spec)
    }

    /// Returns the loads of the last step, at its start.
    #[must_use]
    pub fn loads(&self) -> &[WheelLoad] {
        &self.loads
    }

    /// Settles one vehicle; `search` is the first search of its wheels. The final footings come from a search of whole rims.
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
                    // Beyond an edge the ground is different: go back, and take half the step.
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
        // If wheels outnumber the coordinates in s, the vehicle stands on the wheels that touch first.
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
