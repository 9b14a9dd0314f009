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
