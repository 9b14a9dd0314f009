//! Impacts as events within a step.
//!
//! The rows of the start of the step are used throughout. The velocity v of a step belongs to the instant t − h/2, as in semi-implicit Euler, so a
//! jump that reverses the velocity conserves the energy of a fall exactly:
//! ```text
//! r = ṙ₀ + E p                        rate of a row after the impulses so far, p = Σ Eᵀ λ
//! v(t) = r + a (t + h/2)              a: acceleration of the applied forces; free rotation, which no force does, is in r
//! g(t) = g₀ + ṙ₀ t + E (t p − Σ t_k Δp_k) + a t (t + h)/2
//! event      the first t at which some gap closes that approaches at more than `bounce_min` (r, so that the
//!            forces of one step alone do not count: what rests stays at rest)
//! impact     all contacts of its island that touch at t and approach, together:
//!            0 ≤ λn ⊥ v⁺ + e v⁻ ≥ 0, Coulomb friction; others that touch hold without bouncing (e = 0)
//! repeat     until no gap closes before the end of the step
//! ```
//! Contacts that do not approach are left out, so a ball in a row passes on its impulse before the next ball takes part (the generalised reflections
//! of B. Smith, D. M. Kaufman, E. Vouga, R. Tamstorf, E. Grinspun, "Reflections on simultaneous impact", ACM Transactions on Graphics 31, 2012).
//! Contacts that approach together are solved together, so a flat box stays flat. Without friction ΔE = ½ Σ λ (1 − e) v⁻ ≤ 0. With friction, Newton's
//! impact law can create energy (T. R. Kane). Impulses with e = 0 never do, so the impulses are then blended with those of e = 0 until energy is
//! conserved.

use super::islands::Islands;
use super::{Kind, StepError};
use crate::contact::{Cone, Contact, Factor, Method, Problem, Settings, room};
use linkwork_collision::ContactPoint;
use linkwork_dynamics::units::{RowSet, WIDTH};
use linkwork_spatial::Vec3;

/// Maximum number of events of a step for each contact point. A contact that still approaches then stops without bouncing.
const EVENTS: usize = 20;

/// A contact does not count as approaching if the forces of the step reduce its rate to less than this fraction.
const STILL: f64 = 1e-4;
/// Fraction of the exchanged energy that counts as round-off.
const NOISE: f64 = 1e-10;

/// Data of the step that impacts use.
pub(super) struct Scene<'a> {
    pub rows: &'a RowSet,
    pub kinds: &'a [Kind],
    pub cones: &'a [Cone],
    pub points: &'a [ContactPoint],
    pub frames: &'a [[Vec3; 3]],
    /// Difference between the acceleration of each contact point in non-rotating axes and in its rows, W.
    pub carried: &'a [Vec3],
    /// Part of its acceleration due to free rotation, W.
    pub free_turn: &'a [Vec3],
    /// Surface velocity of b minus surface velocity of a at each contact point, in its frame; empty if all surfaces are fixed to their bodies.
    pub belts: &'a [[f64; 3]],
    /// Restitution of each hinge limit.
    pub bounces: &'a [f64],
    pub islands: &'a Islands,
    pub h: f64,
    pub slop: f64,
    pub bounce_min: f64,
}

impl Scene<'_> {
    /// Returns the restitution of a contact or a limit; 0 for other rows.
    fn restitution(&self, g: usize) -> f64 {
        match self.kinds[g] {
            Kind::Contact(i) => self.points[i as usize].restitution,
            Kind::Limit(i) => self.bounces[i as usize],
            _ => 0.0,
        }
    }

    /// Returns the gap of a contact or a limit at the start of the step.
    fn gap(&self, g: usize) -> f64 {
        match self.kinds[g] {
            Kind::Contact(i) => self.points[i as usize].gap,
            _ => self.rows.groups()[g].error[0],
        }
    }
}

/// Impulses of impacts, and workspace to compute them.
pub(super) struct Impacts {
    solver: Contact,
    /// Eᵀ times the impulses to date, and −Σ t Eᵀ λ: the displacement missing because of late impulses.
    pub y: Vec<f64>,
    pub lag: Vec<f64>,
    /// Impulses on body b of each contact point, N s, W.
    pub impulses: Vec<Vec3>,
    /// By group: E y, and the first row of E lag.
    pub change: Vec<[f64; WIDTH]>,
    pub shift: Vec<f64>,
    groups: Vec<u32>,
    start: Vec<u32>,
    dof: Vec<u32>,
    e: Vec<[f64; WIDTH]>,
    cones: Vec<Cone>,
    /// Velocities before the impact, and the same minus their targets.
    before: Vec<[f64; WIDTH]>,
    b: Vec<[f64; WIDTH]>,
    lambda: Vec<[f64; WIDTH]>,
    plastic: Vec<[f64; WIDTH]>,
    pulled: [Vec<f64>; 2],
}

impl Impacts {
    /// Creates the memory for a mechanism with the given number of independent rates.
    pub fn new(rates: usize) -> Self {
        let settings = Settings { method: Method::Auto, tolerance: 1e-9, ..Settings::default() };
        Self {
            solver: Contact::new(settings),
            y: vec![0.0; rates],
            lag: vec![0.0; rates],
            impulses: Vec::new(),
            change: Vec::new(),
            shift: Vec::new(),
            groups: Vec::new(),
            start: Vec::new(),
            dof: Vec::new(),
            e: Vec::new(),
            cones: Vec::new(),
            before: Vec::new(),
            b: Vec::new(),
            lambda: Vec::new(),
            plastic: Vec::new(),
            pulled: [vec![0.0; rates], vec![0.0; rates]],
        }
    }

    /// Finds the impacts of a step. Returns their number.
    pub fn find(&mut self, scene: &Scene) -> Result<usize, StepError> {
        self.impulses.clear();
        self.impulses.resize(scene.points.len(), Vec3::zeros());
        let limits = scene.bounces.iter().any(|e| *e > 0.0);
        if !limits && !scene.points.iter().any(|p| p.restitution > 0.0) {
            return Ok(0);
        }
        self.y.fill(0.0);
        self.lag.fill(0.0);
        self.change.clear();
        self.change.resize(scene.kinds.len(), [0.0; WIDTH]);
        self.shift.clear();
        self.shift.resize(scene.kinds.len(), 0.0);
        self.make_room(scene);
        let mut count = 0;
        for island in 0..scene.islands.len() {
            count += self.find_in(scene, island)?;
        }
        Ok(count)
    }

    /// Reserves memory for all rows, because an impact may involve all.
    fn make_room(&mut self, scene: &Scene) {
        let (groups, entries) = (scene.kinds.len(), scene.rows.e().len());
        room(&mut self.groups, groups);
        room(&mut self.start, groups + 1);
        room(&mut self.dof, entries);
        room(&mut self.e, entries);
        room(&mut self.cones, groups);
        for x in [&mut self.before, &mut self.b, &mut self.lambda, &mut self.plastic] {
            room(x, groups);
        }
        self.solver.reserve(groups, entries, self.y.len());
    }

    /// Finds the impacts of an island.
    fn find_in(&mut self, scene: &Scene, island: usize) -> Result<usize, StepError> {
        let groups = scene.islands.groups(island);
        let bounces = |g: &u32| scene.restitution(*g as usize) > 0.0;
        if !groups.iter().any(bounces) {
            return Ok(0);
        }
        let (mut t, mut count) = (0.0, 0);
        while count < EVENTS * groups.len() {
            let Some(next) = self.next(scene, groups, t) else { break };
            t = next;
            if !self.impact(scene, island, t)? {
                break;
            }
            count += 1;
        }
        Ok(count)
    }

    /// Returns the first instant from `t` on at which an approaching gap closes.
    fn next(&mut self, scene: &Scene, groups: &[u32], t: f64) -> Option<f64> {
        let mut first = None;
        for g in groups.iter().map(|g| *g as usize) {
            let closes = match scene.kinds[g] {
                Kind::Contact(_) => true,
                // Limits without restitution stop the coordinate in the step itself.
                Kind::Limit(_) => scene.restitution(g) > 0.0,
                _ => false,
            };
            if closes
                && let Some(at) = self.closes(scene, g, t)
                && first.is_none_or(|f| at < f)
            {
                first = Some(at);
            }
        }
        first
    }

    /// Returns the normal rate of a contact without forces, and its acceleration due to forces.
    fn normal(&self, scene: &Scene, g: usize) -> (f64, f64) {
        let row = &scene.rows.groups()[g];
        let Kind::Contact(i) = scene.kinds[g] else {
            return (row.rate[0] + self.change[g][0], row.free[0]);
        };
        let i = i as usize;
        let n = &scene.frames[i][0];
        let (carried, turn) = (n.dot(&scene.carried[i]), n.dot(&scene.free_turn[i]));
        (row.rate[0] + self.change[g][0] + scene.h * turn, row.free[0] + carried - turn)
    }

    fn gap(&self, scene: &Scene, g: usize, t: f64) -> f64 {
        let (r, a) = self.normal(scene, g);
        scene.gap(g) + r * t + self.shift[g] + 0.5 * a * t * (t + scene.h)
    }

    /// Returns when an approaching contact touches, from `t` on, if that is within the step.
    fn closes(&self, scene: &Scene, g: usize, t: f64) -> Option<f64> {
        let (r, a) = self.normal(scene, g);
        if !(r < -scene.bounce_min && r + a * (t + 0.5 * scene.h) < STILL * r) {
            return None;
        }
        if self.gap(scene, g, t) <= scene.slop {
            return Some(t);
        }
        // Solve gap + (r + a h/2) τ + a τ²/2 = 0 with E lag in the gap; at the solution the contact approaches.
        let c = scene.gap(g) + self.shift[g];
        let b = r + 0.5 * a * scene.h;
        let inside = b * b - 2.0 * a * c;
        if !(inside >= 0.0) {
            return None;
        }
        let at = 2.0 * c / (inside.sqrt() - b);
        (at >= t && at <= scene.h).then_some(at)
    }

    /// Computes one impact of an island at `t`. Returns false if no contact takes part.
    fn impact(&mut self, scene: &Scene, island: usize, t: f64) -> Result<bool, StepError> {
        self.clear();
        let (mut most, mut elastic) = (0.0_f64, false);
        for g in scene.islands.groups(island).iter().map(|g| *g as usize) {
            let kind = &scene.kinds[g];
            let row = &scene.rows.groups()[g];
            let mut before: [f64; WIDTH] = std::array::from_fn(|k| row.rate[k] + self.change[g][k]);
            let mut target = 0.0;
            match kind {
                Kind::Dry | Kind::Rolling => continue,
                Kind::Constraint => {}
                Kind::Limit(_) if scene.restitution(g) > 0.0 => {
                    let (r, a) = self.normal(scene, g);
                    if self.gap(scene, g, t) > scene.slop + 1e-12 || !(r < -scene.bounce_min) {
                        continue;
                    }
                    before[0] += a * (t + 0.5 * scene.h);
                    target = scene.restitution(g) * before[0].min(0.0);
                    elastic = true;
                }
                Kind::Limit(_) if row.error[0] <= scene.slop => {}
                Kind::Limit(_) => continue,
                Kind::Contact(i) => {
                    let i = *i as usize;
                    if self.gap(scene, g, t) > scene.slop + 1e-12 {
                        continue;
                    }
                    if let Some(belt) = scene.belts.get(i) {
                        before.iter_mut().zip(belt).for_each(|(v, s)| *v += s);
                    }
                    let (r, _) = self.normal(scene, g);
                    let e = scene.points[i].restitution;
                    if r < -scene.bounce_min {
                        for (k, axis) in scene.frames[i].iter().enumerate() {
                            let turn = axis.dot(&scene.free_turn[i]);
                            let a = row.free[k] + axis.dot(&scene.carried[i]) - turn;
                            before[k] += a * (t + 0.5 * scene.h) + scene.h * turn;
                        }
                        target = e * before[0].min(0.0);
                        elastic |= e > 0.0;
                    } else if e > 0.0 {
                        // Contacts that do not approach are checked again once they do.
                        continue;
                    }
                }
            }
            before.iter().for_each(|x| most = most.max(x.abs()));
            self.groups.push(g as u32);
            self.cones.push(scene.cones[g]);
            self.before.push(before);
            before[0] += target;
            self.b.push(before);
            let range = scene.rows.start()[g] as usize..scene.rows.start()[g + 1] as usize;
            let dof = scene.rows.dof()[range.clone()].iter();
            self.dof.extend(dof.map(|d| scene.islands.local(*d)));
            self.e.extend_from_slice(&scene.rows.e()[range]);
            self.start.push(self.dof.len() as u32);
        }
        if self.groups.is_empty() {
            return Ok(false);
        }
        self.solve(scene.islands.rates(island).len(), most, elastic)?;
        self.take(scene, island, t);
        Ok(true)
    }

    fn clear(&mut self) {
        self.groups.clear();
        self.start.clear();
        self.start.push(0);
        self.dof.clear();
        self.e.clear();
        self.cones.clear();
        self.before.clear();
        self.b.clear();
    }

    /// Computes impulses that do not create energy, and their Eᵀ λ in the first of `pulled`.
    fn solve(&mut self, dofs: usize, most: f64, elastic: bool) -> Result<(), StepError> {
        self.pulled.iter_mut().for_each(|p| p.resize(dofs, 0.0));
        self.lambda.clear();
        self.lambda.resize(self.groups.len(), [0.0; WIDTH]);
        let factor = Factor { start: &self.start, dof: &self.dof, e: &self.e, dofs };
        let problem = Problem::new(factor, &self.cones, &self.b, &[])?.scaled(most);
        self.solver.solve(&problem, &mut self.lambda)?;
        self.pulled[0].iter_mut().zip(self.solver.pulled()).for_each(|(to, y)| *to = y);
        let made = work(&self.lambda, &self.before, &self.pulled[0]);
        let exchanged = pulled_energy(&self.pulled[0]);
        if !(elastic && made > NOISE * exchanged) {
            return Ok(());
        }
        self.plastic.clear();
        self.plastic.resize(self.groups.len(), [0.0; WIDTH]);
        let problem = Problem::new(factor, &self.cones, &self.before, &[])?.scaled(most);
        self.solver.solve(&problem, &mut self.plastic)?;
        self.pulled[1].iter_mut().zip(self.solver.pulled()).for_each(|(to, y)| *to = y);
        // The energy of plastic + s (λ − plastic) is a parabola in s that increases through 0 between 0 and 1.
        let low = work(&self.plastic, &self.before, &self.pulled[1]).min(0.0);
        let [all, soft] = &self.pulled;
        let bend = 0.5 * all.iter().zip(soft).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let slope = made - low - bend;
        let share = if bend > 0.0 {
            let root = (slope * slope - 4.0 * bend * low).max(0.0).sqrt();
            if slope > 0.0 { -2.0 * low / (slope + root) } else { (root - slope) / (2.0 * bend) }
        } else {
            0.0
        };
        let share = share.clamp(0.0, 1.0);
        for (to, from) in self.lambda.iter_mut().zip(&self.plastic) {
            *to = std::array::from_fn(|k| from[k] + share * (to[k] - from[k]));
        }
        let [all, soft] = &mut self.pulled;
        all.iter_mut().zip(soft).for_each(|(to, from)| *to = *from + share * (*to - *from));
        Ok(())
    }

    /// Adds the impulses found at `t`.
    fn take(&mut self, scene: &Scene, island: usize, t: f64) {
        for (d, new) in scene.islands.rates(island).iter().zip(&self.pulled[0]) {
            self.y[*d as usize] += new;
            self.lag[*d as usize] -= t * new;
        }
        for (g, lambda) in self.groups.iter().zip(&self.lambda) {
            if let Kind::Contact(i) = scene.kinds[*g as usize] {
                let frame = &scene.frames[i as usize];
                let impulse = frame[0] * lambda[0] + frame[1] * lambda[1] + frame[2] * lambda[2];
                self.impulses[i as usize] += impulse;
            }
        }
        for g in scene.islands.groups(island).iter().map(|g| *g as usize) {
            let (mut change, mut shift) = ([0.0; WIDTH], [0.0; WIDTH]);
            scene.rows.push(g, &self.y, &mut change);
            scene.rows.push(g, &self.lag, &mut shift);
            (self.change[g], self.shift[g]) = (change, shift[0]);
        }
    }
}

/// Returns the kinetic energy that impulses add: Σ λ·v⁻ + ½ |Eᵀ λ|².
fn work(lambda: &[[f64; WIDTH]], before: &[[f64; WIDTH]], pulled: &[f64]) -> f64 {
    let done = lambda.iter().zip(before).flat_map(|(l, v)| l.iter().zip(v)).map(|(l, v)| l * v);
    done.sum::<f64>() + pulled_energy(pulled)
}

/// Returns ½ |Eᵀ λ|².
fn pulled_energy(pulled: &[f64]) -> f64 {
    0.5 * pulled.iter().map(|y| y * y).sum::<f64>()
}
