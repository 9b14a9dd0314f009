//! Non-smooth contact in minimal coordinates: one step of velocities and impulses.
//!
//! ```text
//! gather                              units of the tree, embedded loops among them
//! impacts     one after another       v⁺ = −e v⁻ at approaching contacts of bodies that touch
//! rows        E, v = J β + h J β̇_f    loops and couplings (equality), contacts (Coulomb), limits
//!                                     (unilateral), dry friction in hinges (bounded)
//! v⁺ = E E* λ + v + gap/h             complementary to λ in each row's cone
//! y = E* λ, scatter                   β⁺ = β + h β̇_f + M⁻¹ J* λ
//! q⁺ = q ⊕ h β⁺                       then out of penetration, without touching β⁺
//! ```
//! The velocity of a free hinge has the body's axes. In a step it is that in the axes at the start, so that what
//! flies keeps its momentum and what rolls stays on the ground, however fast it spins; then it is turned.
//! The size of the problem is that of the rows, whatever the bodies and hinges. A gap that is still
//! open may close within the step but not further (unless the contact bounces: then it is left to
//! close, and the impact is next step's). Penetration is worked off in positions alone, so it
//! gives no kinetic energy.

mod turning;

use crate::constrained::{SolverError, greater, index};
use crate::contact::{Cone, Contact, ContactError, Factor, Measure, Method, Problem, Settings};
use linkwork_collision::{ColliderId, Colliders, ContactPoint, Hiding, Query, Scratch};
use linkwork_dynamics::units::{RowSet, Treatment, Units, UnitsWork, WIDTH};
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::{ConstraintId, LoopMotion, Multibody};
use linkwork_spatial::Vec3;
use std::sync::Arc;
use thiserror::Error;
use turning::Turning;
use wide::f64x4;

/// The part of the velocity that forces alone would give in a step which counts as motion: below it all
/// rests, and residuals are parts of that.
const REST: f64 = 0.01;

/// What limits of hinges do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum JointLimits {
    /// They stop the coordinate, without bouncing.
    #[default]
    Stop,
    /// Nothing.
    Ignore,
}

/// How contact is treated.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactSettings {
    /// Gaps up to this are looked at, m; of what moves, up to as much more as it covers in a step.
    pub margin: f64,
    /// Penetration that is left alone, m: it keeps resting contacts in touch.
    pub slop: f64,
    /// Part of the penetration beyond it that is worked off in a step.
    pub correction: f64,
    /// Greatest speed of that, m/s.
    pub push_max: f64,
    /// Contacts that approach more slowly than this do not bounce, m/s.
    pub bounce_min: f64,
    /// Whether limits of hinges hold.
    pub limits: JointLimits,
    /// Dry friction of hinges: place in β, force (N m or N).
    pub dry: Vec<(usize, f64)>,
    /// The complementarity solver's. Its tolerance is a part of the largest velocity of any row, or of
    /// 0.01 of what forces alone would give it in the step when that is more.
    pub solver: Settings,
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self {
            margin: 1e-3,
            slop: 1e-4,
            correction: 0.2,
            push_max: 1.0,
            bounce_min: 0.01,
            limits: JointLimits::Stop,
            dry: Vec::new(),
            solver: Settings { tolerance: 1e-3, least: 1, ..Settings::default() },
        }
    }
}

/// Impulse of a contact of the last step: where the next search begins. Part of a run's state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impulse {
    /// The colliders.
    pub pair: (u32, u32),
    /// The point within the pair.
    pub feature: u64,
    /// On the second body, N s, world axes.
    pub impulse: Vec3,
}

/// What a step was like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepReport {
    /// Contact points looked at.
    pub contacts: usize,
    /// Rows of the problem.
    pub rows: usize,
    /// Impacts that were resolved one after another.
    pub impacts: usize,
    /// Deepest penetration at the start of the step, m.
    pub penetration: f64,
    /// The method whose answer was taken.
    pub method: Method,
    /// Its sweeps, linear systems or pivots.
    pub iterations: u32,
    /// How far the impulses are from a solution.
    pub measure: Measure,
    /// Whether that is within the tolerance.
    pub converged: bool,
}

/// Why a step was not made.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StepError {
    /// Of the mechanism.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// Of the contact problem.
    #[error(transparent)]
    Contact(#[from] ContactError),
}

/// What a group of rows stands for.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Constraint,
    Contact(u32),
    Limit,
    Dry,
}

/// Steps one mechanism with contacts. Memory grows to the largest problem seen and is kept; nothing
/// but the impulses of [`ContactStepper::warm`] passes from step to step.
pub struct ContactStepper {
    /// Settings; they may be changed between steps.
    pub settings: ContactSettings,
    colliders: Arc<Colliders>,
    units: Units,
    uw: UnitsWork,
    rows: RowSet,
    scratch: Scratch,
    extents: Vec<f64>,
    reach: Vec<f64>,
    points: Vec<ContactPoint>,
    limits: Vec<Limit>,
    turning: Turning,
    contact: Contact,
    push: Contact,
    kinds: Vec<Kind>,
    frames: Vec<[Vec3; 3]>,
    cones: Vec<Cone>,
    b: Vec<[f64; WIDTH]>,
    lambda: Vec<[f64; WIDTH]>,
    some: Vec<Cone>,
    /// Entries of E with the lanes that `some` has.
    some_e: Vec<[f64; WIDTH]>,
    y: Vec<f64>,
    impact: Vec<f64>,
    /// Impulses of impacts by contact point, on body b.
    impacts: Vec<Vec3>,
    dq: Vec<f64>,
    q_next: Vec<f64>,
    /// λ / h by constraint, and where each begins.
    forces: Vec<f64>,
    place: Vec<usize>,
    warm: Vec<Impulse>,
}

/// A coordinate that must not pass a limit.
#[derive(Clone, Copy, Debug)]
struct Limit {
    q: usize,
    v: usize,
    lower: f64,
    upper: f64,
}

fn limits(mbs: &Multibody) -> Vec<Limit> {
    let mut out = Vec::new();
    for (_, s) in mbs.subhinges() {
        let l = s.subhinge.limits;
        if s.v.len() == 1 && (l.lower.is_finite() || l.upper.is_finite()) {
            out.push(Limit { q: s.q.start, v: s.v.start, lower: l.lower, upper: l.upper });
        }
    }
    out
}

impl ContactStepper {
    /// For a tree and the colliders of its bodies; loops are treated as `treatment` says.
    #[must_use]
    pub fn new(
        tree: &Tree,
        colliders: Arc<Colliders>,
        settings: ContactSettings,
        treatment: impl Fn(ConstraintId) -> Treatment,
    ) -> Self {
        let units = Units::new(tree, treatment);
        let mut place = vec![0];
        for c in tree.multibody().constraints() {
            place.push(place[place.len() - 1] + tree.multibody().rows(c));
        }
        let push = Settings { method: Method::GaussSeidel, tolerance: 1e-3, ..Settings::default() };
        Self {
            contact: Contact::new(settings.solver),
            push: Contact::new(push),
            scratch: Scratch::new(&colliders),
            extents: colliders.ids().map(|id| colliders.extent(id)).collect(),
            reach: Vec::new(),
            colliders,
            uw: UnitsWork::new(tree, &units),
            rows: RowSet::default(),
            points: Vec::new(),
            limits: match settings.limits {
                JointLimits::Stop => limits(tree.multibody()),
                JointLimits::Ignore => Vec::new(),
            },
            turning: Turning::new(tree.multibody()),
            kinds: Vec::new(),
            frames: Vec::new(),
            cones: Vec::new(),
            b: Vec::new(),
            lambda: Vec::new(),
            some: Vec::new(),
            some_e: Vec::new(),
            y: vec![0.0; units.independent()],
            impact: vec![0.0; units.independent()],
            impacts: Vec::new(),
            dq: vec![0.0; tree.nv()],
            q_next: Vec::with_capacity(tree.nq()),
            forces: vec![0.0; place[place.len() - 1]],
            place,
            warm: Vec::new(),
            units,
            settings,
        }
    }

    /// A stepper with memory of its own and the same structure, settings and impulses.
    #[must_use]
    pub fn fork(&self, tree: &Tree) -> Self {
        let treatment = |c: ConstraintId| {
            if self.units.embedded().contains(&c) { Treatment::Embed } else { Treatment::Augment }
        };
        let mut copy = Self::new(tree, self.colliders.clone(), self.settings.clone(), treatment);
        copy.warm.clone_from(&self.warm);
        copy
    }

    /// The colliders.
    #[must_use]
    pub fn colliders(&self) -> &Arc<Colliders> {
        &self.colliders
    }

    /// Contact points of the last step.
    #[must_use]
    pub fn points(&self) -> &[ContactPoint] {
        &self.points
    }

    /// Impulses of the impacts of the last step for each of [`ContactStepper::points`], N s: on body b, world axes. They come
    /// beside those of [`ContactStepper::warm`].
    #[must_use]
    pub fn impacts(&self) -> &[Vec3] {
        &self.impacts
    }

    /// Impulses of the last step for each of [`ContactStepper::points`], impacts left out, N s: on body b, world axes. They belong to the state of a
    /// run.
    #[must_use]
    pub fn warm(&self) -> &[Impulse] {
        &self.warm
    }

    /// Puts impulses back, as [`ContactStepper::warm`] gave them.
    pub fn set_warm(&mut self, warm: &[Impulse]) {
        self.warm.clear();
        self.warm.extend_from_slice(warm);
    }

    /// One step of `h` s from (q, β), in place, at the state of the last
    /// [`kinematics`](linkwork_dynamics::kinematics()), with the external forces and gravity of the
    /// workspace. `tau` and `vdot` as in forward dynamics; afterwards `vdot` is the mean acceleration
    /// of the step, impulses included. Loops are kept in rates; close positions afterwards with a
    /// [`Projector`](crate::Projector).
    ///
    /// # Errors
    /// [`StepError`]; the state is then as it was.
    pub fn step(
        &mut self,
        tree: &Tree,
        ws: &mut Workspace,
        h: f64,
        (q, v): (&mut [f64], &mut [f64]),
        motions: &[LoopMotion],
        hiding: Option<&Hiding>,
        tau: &mut [f64],
        vdot: &mut [f64],
    ) -> Result<StepReport, StepError> {
        self.units.gather(tree, ws, &mut self.uw, tau, vdot, motions).map_err(SolverError::from)?;
        self.turning.begin(tree, ws, v);
        self.look(tree, ws, h, hiding);
        self.build(tree, ws, h, (q, v), motions);
        let impacts = self.bounce()?;
        let speed = self.free_velocities(h, impacts);
        self.recall();
        let factor = factor(&self.rows);
        let problem = Problem::trusted(factor, &self.cones, &self.b).scaled(speed);
        let report = self.contact.solve(&problem, &mut self.lambda)?;
        self.remember();
        let inverse = 1.0 / h;
        for ((y, a), b) in self.y.iter_mut().zip(&self.impact).zip(self.contact.pulled()) {
            *y = (a + b) * inverse;
        }
        self.units.scatter(tree, ws, &mut self.uw, &self.y, tau, vdot);
        let lambda = &self.lambda;
        self.rows.relieve(&self.units, &mut self.uw, |g| lambda[g].map(|x| x * inverse), tau);
        if !vdot.iter().all(|x| x.is_finite()) {
            return Err(SolverError::NotFinite.into());
        }
        self.keep_forces(tree, inverse, tau, vdot);
        for (v, a) in v.iter_mut().zip(vdot.iter()) {
            *v += h * a;
        }
        self.turning.enter_start_axes(h, v);
        self.push_out(tree, h)?;
        for (d, v) in self.dq.iter_mut().zip(v.iter()) {
            *d += h * v;
        }
        let mbs = tree.multibody();
        self.turning.leave_start_axes(h, &mut self.dq, v);
        // `integrate` wants another place for its answer.
        self.q_next.clear();
        self.q_next.extend_from_slice(q);
        mbs.integrate(&self.q_next, &self.dq, q);
        let depth = self.points.iter().fold(0.0, |d, p| greater(d, -p.gap));
        Ok(StepReport {
            contacts: self.points.len(),
            rows: self.rows.rows(),
            impacts,
            penetration: depth,
            method: report.method,
            iterations: report.iterations,
            measure: report.measure,
            converged: report.converged,
        })
    }

    /// Mean forces of the constraints over the step.
    fn keep_forces(&mut self, tree: &Tree, inverse: f64, tau: &mut [f64], vdot: &[f64]) {
        let loops = tree.multibody().loops().len();
        let (place, forces) = (&self.place, &mut self.forces);
        let mut g = 0;
        for c in self.units.augmented() {
            let (mut at, end) = (place[index(*c, loops)], place[index(*c, loops) + 1]);
            while at < end {
                let n = self.rows.groups()[g].n;
                for (to, x) in forces[at..at + n].iter_mut().zip(&self.lambda[g]) {
                    *to = x * inverse;
                }
                at += n;
                g += 1;
            }
        }
        if !self.units.embedded().is_empty() {
            self.units.constraint_forces(tree, &mut self.uw, vdot, tau, |c, lambda| {
                let at = place[index(c, loops)];
                forces[at..at + lambda.len()].copy_from_slice(lambda);
            });
        }
    }

    /// Mean forces of a constraint over the last step, one a row (N or N m), impacts left out.
    #[must_use]
    pub fn forces(&self, tree: &Tree, constraint: ConstraintId) -> &[f64] {
        let i = index(constraint, tree.multibody().loops().len());
        &self.forces[self.place[i]..self.place[i + 1]]
    }

    /// Contact points near enough to matter in this step: within the margin of where they may come.
    fn look(&mut self, tree: &Tree, ws: &Workspace, h: f64, hiding: Option<&Hiding>) {
        self.reach.clear();
        self.reach.extend(self.colliders.ids().zip(&self.extents).map(|(id, extent)| {
            let Some(body) = self.colliders.body(id) else { return 0.0 };
            let V = ws.body_velocity(tree, body);
            h * (V.linear.norm() + V.angular.norm() * extent)
        }));
        let query = Query { hiding, reach: &self.reach, ..Query::margin(self.settings.margin) };
        let poses = |b: Option<_>| {
            b.map_or_else(linkwork_spatial::Pose::identity, |b| ws.body_pose(tree, b))
        };
        self.colliders.contacts(&mut self.scratch, &query, poses, &mut self.points);
    }

    /// Rows and cones of everything that acts in this step.
    fn build(
        &mut self,
        tree: &Tree,
        ws: &Workspace,
        h: f64,
        (q, v): (&[f64], &[f64]),
        motions: &[LoopMotion],
    ) {
        self.rows.clear();
        self.kinds.clear();
        self.cones.clear();
        self.frames.clear();
        for c in self.units.augmented() {
            self.rows.add_constraint(tree, &self.units, ws, &self.uw, *c, motions, (q, v));
        }
        self.rows.silence_rounding();
        for row in self.rows.groups() {
            self.kinds.push(Kind::Constraint);
            self.cones.push(Cone::Equality { rows: row.n });
        }
        for (i, p) in self.points.iter().enumerate() {
            let frame = frame(&p.normal);
            self.frames.push(frame);
            let ends = (p.body_a, p.body_b);
            self.rows.add_point(tree, &self.units, ws, &self.uw, ends, &p.point, &frame);
            self.kinds.push(Kind::Contact(i as u32));
            self.cones.push(Cone::Coulomb { friction: p.friction });
        }
        for l in &self.limits {
            let reach = 2.0 * h * v[l.v].abs() + 1e-3;
            for (bound, sign) in [(l.lower, 1.0), (l.upper, -1.0)] {
                let gap = sign * (q[l.q] - bound);
                if gap < reach {
                    self.rows.add_coordinate(tree, &self.units, &self.uw, l.v, sign, v[l.v]);
                    self.rows.set_error(gap);
                    self.kinds.push(Kind::Limit);
                    self.cones.push(Cone::Unilateral);
                }
            }
        }
        for (place, force) in &self.settings.dry {
            self.rows.add_coordinate(tree, &self.units, &self.uw, *place, 1.0, v[*place]);
            self.kinds.push(Kind::Dry);
            self.cones.push(Cone::Dry { bound: force * h });
        }
    }

    /// Impacts one after another, the fastest first, until nothing that touches approaches: a ball that
    /// is hit passes on what it got before others are asked. Impulses go to `impact`.
    fn bounce(&mut self) -> Result<usize, StepError> {
        self.impact.fill(0.0);
        self.impacts.clear();
        self.impacts.resize(self.points.len(), Vec3::zeros());
        let slop = self.settings.slop;
        let touching = |p: &ContactPoint| p.restitution > 0.0 && p.gap <= slop;
        if !self.points.iter().any(touching) {
            return Ok(0);
        }
        let limit = 20 * self.points.len();
        let mut count = 0;
        while count < limit {
            let mut worst = (-self.settings.bounce_min, None);
            for (g, kind) in self.kinds.iter().enumerate() {
                let Kind::Contact(i) = kind else { continue };
                let normal = self.velocity(g)[0];
                if touching(&self.points[*i as usize]) && normal < worst.0 {
                    worst = (normal, Some((g, *i as usize)));
                }
            }
            let Some((hit, i)) = worst.1 else { break };
            self.some.clear();
            self.b.clear();
            for g in 0..self.kinds.len() {
                let mut b = self.velocity(g);
                if g == hit {
                    b[0] += self.points[i].restitution * worst.0;
                }
                let acts = g == hit || matches!(self.kinds[g], Kind::Constraint);
                self.some.push(if acts { self.cones[g] } else { Cone::Dry { bound: 0.0 } });
                self.b.push(b);
            }
            self.lambda.clear();
            self.lambda.resize(self.kinds.len(), [0.0; WIDTH]);
            let kinds = &self.kinds;
            mask(&self.rows, &mut self.some_e, |g| {
                if g == hit || matches!(kinds[g], Kind::Constraint) { WIDTH } else { 0 }
            });
            let factor = Factor { e: &self.some_e, ..factor(&self.rows) };
            let problem = Problem::new(factor, &self.some, &self.b, &[])?;
            self.contact.solve(&problem, &mut self.lambda)?;
            for (g, lambda) in self.lambda.iter().enumerate() {
                if lambda[0] != 0.0 || g == hit {
                    self.rows.pull(g, lambda, &mut self.impact);
                }
            }
            for (axis, x) in self.frames[i].iter().zip(&self.lambda[hit]) {
                self.impacts[i] += axis * *x;
            }
            count += 1;
        }
        Ok(count)
    }

    /// Present velocity of a group's rows, impacts included.
    fn velocity(&self, g: usize) -> [f64; WIDTH] {
        let mut v = self.rows.groups()[g].rate;
        self.rows.push(g, &self.impact, &mut v);
        v
    }

    /// b of the step: velocities without this step's impulses, less their targets. The largest of the
    /// velocities, of which residuals are parts: gaps that are far from closing do not count.
    fn free_velocities(&mut self, h: f64, impacts: usize) -> f64 {
        self.b.clear();
        let mut most = f64x4::splat(0.0);
        for (g, row) in self.rows.groups().iter().enumerate() {
            let mut b = row.rate;
            if impacts > 0 {
                self.rows.push(g, &self.impact, &mut b);
            }
            let (rate, gain) = (f64x4::new(b), f64x4::splat(h) * f64x4::new(row.free));
            most = most.fast_max(rate.abs()).fast_max(f64x4::splat(REST) * gain.abs());
            let mut b = (rate + gain).to_array();
            match self.kinds[g] {
                Kind::Constraint => {
                    b.iter_mut().zip(&row.bias).for_each(|(b, bias)| *b += h * bias);
                }
                Kind::Contact(i) => {
                    let p = &self.points[i as usize];
                    let carried = self.turning.carried(p.body_b) - self.turning.carried(p.body_a);
                    let axes = &self.frames[i as usize];
                    b.iter_mut().zip(axes).for_each(|(b, axis)| *b += h * axis.dot(&carried));
                    let bounces = p.restitution > 0.0 && row.rate[0] < -self.settings.bounce_min;
                    if p.gap > 0.0 {
                        // What will bounce may touch first, and a little more.
                        b[0] = if bounces { b[0].abs() } else { b[0] + p.gap / h };
                    }
                }
                Kind::Limit => b[0] += row.error[0].max(0.0) / h,
                Kind::Dry => {}
            }
            self.b.push(b);
        }
        most.to_array().into_iter().fold(0.0, f64::max)
    }

    /// Impulses of the last step, where the same points are there again.
    fn recall(&mut self) {
        self.lambda.clear();
        let mut at = 0;
        for kind in &self.kinds {
            let mut lambda = [0.0; WIDTH];
            if let Kind::Contact(i) = kind {
                let p = &self.points[*i as usize];
                let key = (id(p.a), id(p.b), p.feature);
                while self.warm.get(at).is_some_and(|w| (w.pair.0, w.pair.1, w.feature) < key) {
                    at += 1;
                }
                if let Some(w) = self.warm.get(at)
                    && (w.pair.0, w.pair.1, w.feature) == key
                {
                    let frame = &self.frames[*i as usize];
                    for (to, axis) in lambda.iter_mut().zip(frame) {
                        *to = axis.dot(&w.impulse);
                    }
                }
            }
            self.lambda.push(lambda);
        }
    }

    fn remember(&mut self) {
        self.warm.clear();
        for (kind, lambda) in self.kinds.iter().zip(&self.lambda) {
            if let Kind::Contact(i) = kind {
                let (p, frame) = (&self.points[*i as usize], &self.frames[*i as usize]);
                let impulse = frame[0] * lambda[0] + frame[1] * lambda[1] + frame[2] * lambda[2];
                let pair = (id(p.a), id(p.b));
                self.warm.push(Impulse { pair, feature: p.feature, impulse });
            }
        }
    }

    /// Displacements out of penetration, into `dq`: the same rows as motions, without friction.
    fn push_out(&mut self, tree: &Tree, h: f64) -> Result<(), StepError> {
        self.dq.fill(0.0);
        let (slop, part) = (self.settings.slop, self.settings.correction);
        let most = self.settings.push_max * h;
        let deep = |gap: f64| (part * (-gap - slop)).clamp(0.0, most);
        let depth = |kind: &Kind, error: f64| match kind {
            Kind::Contact(i) => deep(self.points[*i as usize].gap),
            Kind::Limit => deep(error),
            _ => 0.0,
        };
        let rows = self.rows.groups();
        let any = self.kinds.iter().zip(rows).any(|(k, r)| depth(k, r.error[0]) > 0.0);
        if !any {
            return Ok(());
        }
        self.b.clear();
        self.some.clear();
        for (kind, row) in self.kinds.iter().zip(rows) {
            let acts = match kind {
                Kind::Constraint => Cone::Equality { rows: row.n },
                // Other contacts that touch must not be pushed together.
                Kind::Contact(_) | Kind::Limit => Cone::Unilateral,
                Kind::Dry => Cone::Dry { bound: 0.0 },
            };
            let gap = match kind {
                Kind::Contact(i) => self.points[*i as usize].gap.max(0.0),
                Kind::Limit => row.error[0].max(0.0),
                _ => 0.0,
            };
            self.some.push(acts);
            self.b.push([gap - depth(kind, row.error[0]), 0.0, 0.0, 0.0]);
        }
        self.lambda.clear();
        self.lambda.resize(self.kinds.len(), [0.0; WIDTH]);
        let kinds = &self.kinds;
        mask(&self.rows, &mut self.some_e, |g| match kinds[g] {
            Kind::Constraint => WIDTH,
            Kind::Contact(_) | Kind::Limit => 1,
            Kind::Dry => 0,
        });
        let factor = Factor { e: &self.some_e, ..factor(&self.rows) };
        let problem = Problem::new(factor, &self.some, &self.b, &[])?;
        self.push.solve(&problem, &mut self.lambda)?;
        self.y.iter_mut().zip(self.push.pulled()).for_each(|(to, y)| *to = y);
        self.units.impulse(tree, &mut self.uw, &self.y, &mut self.dq);
        Ok(())
    }
}

fn id(c: ColliderId) -> u32 {
    c.index() as u32
}

fn factor(rows: &RowSet) -> Factor<'_> {
    Factor { start: rows.start(), dof: rows.dof(), e: rows.e(), dofs: rows.independent() }
}

/// E with only the first lanes of each group's entries.
fn mask(rows: &RowSet, out: &mut Vec<[f64; WIDTH]>, lanes: impl Fn(usize) -> usize) {
    out.clear();
    for g in 0..rows.groups().len() {
        let (from, to) = (rows.start()[g] as usize, rows.start()[g + 1] as usize);
        let n = lanes(g);
        out.extend(rows.e()[from..to].iter().map(|e| {
            let mut kept = [0.0; WIDTH];
            kept[..n].copy_from_slice(&e[..n]);
            kept
        }));
    }
}

/// The normal and two tangents (T. Duff et al., "Building an orthonormal basis, revisited", Journal of
/// Computer Graphics Techniques 6, 2017).
fn frame(n: &Vec3) -> [Vec3; 3] {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    let x = Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    [*n, x, Vec3::new(b, sign + n.y * n.y * a, -n.y)]
}
