//! Non-smooth contact in minimal coordinates: one step of velocities and impulses.
//!
//! ```text
//! gather                              units of the tree, embedded loops among them
//! rows        E, v = J β + h J β̇_f    loops and couplings (equality), contacts (Coulomb), limits
//!                                     (unilateral), dry friction in hinges (bounded)
//! islands     groups of rows that share no rates are problems of their own (islands.rs)
//! impacts     as events in the step   v⁺ = −e v⁻ at contacts that close (impacts.rs)
//! resistance  |m_t| ≤ μ_r λn across the normal, |m_n| ≤ μ_s λn about it (resistance.rs)
//! v⁺ = E E* λ + v + gap/h             complementary to λ in each row's cone
//! y = E* λ, scatter                   β⁺ = β + h β̇_f + M⁻¹ J* λ
//! q⁺ = q ⊕ h β⁺                       then out of penetration, without touching β⁺
//! ```
//! The velocity of a free hinge is in the body's axes. During a step it is in the axes at the start, so that a flying body keeps its momentum and a
//! rolling one stays on the ground at any spin rate; then it is rotated. The size of the problem is the number of rows, independent of bodies and
//! hinges. An open gap may close within the step, but not further. Penetration is reduced by displacements alone, so it does not add kinetic energy,
//! and only by the part that the motion of the step does not already reduce.

mod impacts;
mod islands;
mod resistance;
mod settings;
mod solve;
mod turning;

use crate::constrained::{SolverError, greater, index};
use crate::contact::{Cone, Contact, Method, Settings};
use impacts::Impacts;
use islands::Islands;
use linkwork_collision::{
    ColliderId, Colliders, ContactPoint, Hiding, Query, Resistance, Scratch, SurfaceVelocities,
};
use linkwork_dynamics::units::{ConstraintMethod, RowSet, Units, UnitsWork, WIDTH};
use linkwork_dynamics::{Tree, Workspace};
use linkwork_multibody::{BallLimits, BodyId, ConstraintId, LoopMotion, Multibody, SubhingeRange};
use linkwork_spatial::{Force, Vec3};
use resistance::Rolling;
pub use settings::{ContactSettings, Impulse, JointLimits, StepError, StepReport};
use std::sync::Arc;
use turning::Turning;
use wide::f64x4;

/// Fraction of the velocity that forces alone would cause in a step. Smaller velocities count as rest, and residuals are relative to this.
const REST: f64 = 0.01;

/// Kind of a group of rows.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Constraint,
    Contact(u32),
    /// A limit of a hinge, with its index in the restitutions.
    Limit(u32),
    Dry,
    /// Moment perpendicular to the normal of a contact point.
    Rolling,
}

/// Steps one mechanism with contacts. The workspace grows to the largest problem and is reused. Only the impulses of [`ContactStepper::warm`] carry
/// over from step to step.
pub struct ContactStepper {
    /// Settings. You may change them between steps.
    pub settings: ContactSettings,
    /// Velocities of surfaces relative to their bodies. You may change them between steps.
    pub surfaces: SurfaceVelocities,
    colliders: Arc<Colliders>,
    units: Units,
    uw: UnitsWork,
    rows: RowSet,
    scratch: Scratch,
    extents: Vec<f64>,
    reach: Vec<f64>,
    points: Vec<ContactPoint>,
    limits: Vec<Limit>,
    balls: Vec<Ball>,
    /// Restitution of each limit row.
    bounces: Vec<f64>,
    /// Body of each hinge rate in β.
    bodies: Vec<Option<BodyId>>,
    turning: Turning,
    contact: Contact,
    push: Contact,
    kinds: Vec<Kind>,
    frames: Vec<[Vec3; 3]>,
    cones: Vec<Cone>,
    b: Vec<[f64; WIDTH]>,
    lambda: Vec<[f64; WIDTH]>,
    some: Vec<Cone>,
    /// Entries of E with only the lanes of `some`.
    some_e: Vec<[f64; WIDTH]>,
    y: Vec<f64>,
    impacts: Impacts,
    islands: Islands,
    /// Velocity scale of each island, for its residual.
    speeds: Vec<f64x4>,
    /// Difference between the acceleration of each contact point in non-rotating axes and in its rows, W.
    carried: Vec<Vec3>,
    /// Acceleration of each contact point due to free rotation, W.
    free_turn: Vec<Vec3>,
    /// Rows of rolling friction.
    rolling: Vec<Rolling>,
    /// Surface velocity of b minus surface velocity of a at each contact point, in its frame; empty if all surfaces are fixed to their bodies.
    belts: Vec<[f64; 3]>,
    /// Moment on body b of each contact point, N m s, W; empty if rolling and spinning have zero resistance.
    moments: Vec<Vec3>,
    dq: Vec<f64>,
    q_next: Vec<f64>,
    /// λ / h by constraint, and the first index of each.
    forces: Vec<f64>,
    place: Vec<usize>,
    warm: Vec<Impulse>,
}

/// A coordinate with limits.
#[derive(Clone, Copy, Debug)]
struct Limit {
    q: usize,
    v: usize,
    lower: f64,
    upper: f64,
    restitution: f64,
}

/// A ball hinge with limits.
#[derive(Clone, Copy, Debug)]
struct Ball {
    q: usize,
    v: usize,
    limits: BallLimits,
    restitution: f64,
}

fn balls(mbs: &Multibody) -> Vec<Ball> {
    let limited = mbs.subhinges().map(|(_, s)| s).filter(|s| s.subhinge.ball != BallLimits::NONE);
    let ball = |s: &SubhingeRange| Ball {
        q: s.q.start,
        v: s.v.start,
        limits: s.subhinge.ball,
        restitution: s.subhinge.restitution.unwrap_or(0.0),
    };
    limited.map(ball).collect()
}

fn limits(mbs: &Multibody) -> Vec<Limit> {
    let mut out = Vec::new();
    for (_, s) in mbs.subhinges() {
        let l = s.subhinge.limits;
        if s.v.len() == 1 && (l.lower.is_finite() || l.upper.is_finite()) {
            let restitution = s.subhinge.restitution.unwrap_or(0.0);
            let (q, v) = (s.q.start, s.v.start);
            out.push(Limit { q, v, lower: l.lower, upper: l.upper, restitution });
        }
    }
    out
}

/// Returns the body of each element of β; `None` for modes.
fn bodies(mbs: &Multibody) -> Vec<Option<BodyId>> {
    let mut out = vec![None; mbs.nv()];
    for (body, s) in mbs.subhinges() {
        out[s.v.clone()].fill(Some(body));
    }
    out
}

impl ContactStepper {
    /// Creates a stepper for a tree and the colliders of its bodies, with the constraint method `constraint_method` for each loop.
    #[must_use]
    pub fn new(
        tree: &Tree,
        colliders: Arc<Colliders>,
        settings: ContactSettings,
        constraint_method: impl Fn(ConstraintId) -> ConstraintMethod,
    ) -> Self {
        let units = Units::new(tree, constraint_method);
        let mut place = vec![0];
        for c in tree.multibody().constraints() {
            place.push(place[place.len() - 1] + tree.multibody().rows(c));
        }
        let push = Settings { method: Method::GaussSeidel, tolerance: 1e-3, ..Settings::default() };
        Self {
            contact: Contact::new(settings.solver),
            push: Contact::new(push),
            scratch: Scratch::new(&colliders),
            surfaces: colliders.surface_velocities(),
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
            balls: match settings.limits {
                JointLimits::Stop => balls(tree.multibody()),
                JointLimits::Ignore => Vec::new(),
            },
            bounces: Vec::new(),
            bodies: bodies(tree.multibody()),
            turning: Turning::new(tree.multibody()),
            kinds: Vec::new(),
            frames: Vec::new(),
            cones: Vec::new(),
            b: Vec::new(),
            lambda: Vec::new(),
            some: Vec::new(),
            some_e: Vec::new(),
            y: vec![0.0; units.independent()],
            impacts: Impacts::new(units.independent()),
            islands: Islands::new(tree, &units),
            speeds: Vec::new(),
            carried: Vec::new(),
            free_turn: Vec::new(),
            rolling: Vec::new(),
            belts: Vec::new(),
            moments: Vec::new(),
            dq: vec![0.0; tree.nv()],
            q_next: Vec::with_capacity(tree.nq()),
            forces: vec![0.0; place[place.len() - 1]],
            place,
            warm: Vec::new(),
            units,
            settings,
        }
    }

    /// Returns a stepper with separate memory and the same structure, settings and impulses.
    #[must_use]
    pub fn fork(&self, tree: &Tree) -> Self {
        let constraint_method = |c: ConstraintId| {
            if self.units.embedded().contains(&c) {
                ConstraintMethod::Embed
            } else {
                ConstraintMethod::Augment
            }
        };
        let mut copy =
            Self::new(tree, self.colliders.clone(), self.settings.clone(), constraint_method);
        copy.warm.clone_from(&self.warm);
        copy.surfaces.clone_from(&self.surfaces);
        copy
    }

    /// Returns the colliders.
    #[must_use]
    pub fn colliders(&self) -> &Arc<Colliders> {
        &self.colliders
    }

    /// Returns the contact points of the last step.
    #[must_use]
    pub fn points(&self) -> &[ContactPoint] {
        &self.points
    }

    /// Returns the impulses of the impacts of the last step for each of [`ContactStepper::points`], N s: on body b, world axes. They are in addition
    /// to [`ContactStepper::warm`].
    #[must_use]
    pub fn impacts(&self) -> &[Vec3] {
        &self.impacts.impulses
    }

    /// Returns the moments of rolling and spinning friction on body b over the last step for each of [`ContactStepper::points`], N m s, world axes,
    /// about the point. Empty if all pairs of colliders have zero rolling and spinning resistance.
    #[must_use]
    pub fn moments(&self) -> &[Vec3] {
        &self.moments
    }

    /// Returns the impulses of the last step for each of [`ContactStepper::points`], without impacts, N s: on body b, world axes. They belong to the
    /// state of a run.
    #[must_use]
    pub fn warm(&self) -> &[Impulse] {
        &self.warm
    }

    /// Restores impulses from [`ContactStepper::warm`].
    pub fn set_warm(&mut self, warm: &[Impulse]) {
        self.warm.clear();
        self.warm.extend_from_slice(warm);
    }

    /// Makes one step of `h` s from (q, β), in place, at the state of the last [`kinematics`](linkwork_dynamics::kinematics()), with the external
    /// forces and gravity of the workspace. `tau` and `vdot` are as in forward dynamics; afterwards `vdot` is the mean acceleration of the step,
    /// impulses included. The step satisfies loops in rates; close positions afterwards with a [`Projector`](crate::Projector).
    ///
    /// # Errors
    /// [`StepError`]; the state is then unchanged.
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
        self.turning.hold(tree, ws, h);
        let gathered = self.units.gather(tree, ws, &mut self.uw, tau, vdot, motions);
        self.turning.let_go(tree, ws);
        gathered.map_err(SolverError::from)?;
        self.turning.begin(tree, ws, v);
        self.look(tree, ws, h, hiding);
        self.build(tree, ws, h, (q, v), motions);
        let impacts = self.find_impacts(h)?;
        self.free_velocities(h, impacts > 0);
        self.recall();
        let report = self.solve_with_rolling()?;
        self.remember();
        let inverse = 1.0 / h;
        for y in &mut self.y {
            *y *= inverse;
        }
        if impacts > 0 {
            self.y.iter_mut().zip(&self.impacts.y).for_each(|(y, p)| *y += inverse * p);
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
        self.push_out(tree, h, impacts > 0)?;
        for (d, v) in self.dq.iter_mut().zip(v.iter()) {
            *d += h * v;
        }
        let mbs = tree.multibody();
        self.turning.leave_start_axes(h, &mut self.dq, v);
        // `integrate` needs a separate output.
        self.q_next.clear();
        self.q_next.extend_from_slice(q);
        mbs.integrate(&self.q_next, &self.dq, q);
        let depth = self.points.iter().fold(0.0, |d, p| greater(d, -p.gap));
        Ok(StepReport {
            contacts: self.points.len(),
            rows: self.rows.rows(),
            islands: self.islands.len(),
            impacts,
            penetration: depth,
            method: report.method,
            iterations: report.iterations,
            measure: report.measure,
            converged: report.converged,
        })
    }

    /// Computes the mean forces of the constraints over the step.
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

    /// Returns the mean forces of a constraint over the last step, one per row (N or N m), without impacts.
    #[must_use]
    pub fn forces(&self, tree: &Tree, constraint: ConstraintId) -> &[f64] {
        let i = index(constraint, tree.multibody().loops().len());
        &self.forces[self.place[i]..self.place[i + 1]]
    }

    /// Adds the mean forces of the last step of `h` s to the external forces of the workspace, which must be at the start of that step: forces of
    /// loops, and impulses and moments of contacts over `h`.
    pub fn add_forces(&self, tree: &Tree, ws: &mut Workspace, h: f64, motions: &[LoopMotion]) {
        let mbs = tree.multibody();
        for i in 0..mbs.loops().len() {
            let forces = &self.forces[self.place[i]..self.place[i + 1]];
            self.units.add_loop_forces(ws, &self.uw, i, forces, motions);
        }
        let impulses = self.warm.iter().zip(&self.impacts.impulses);
        for (i, (p, (steady, impact))) in self.points.iter().zip(impulses).enumerate() {
            let force = (steady.impulse + impact) / h;
            let moment = self.moments.get(i).map_or_else(Vec3::zeros, |m| m / h);
            for (body, sign) in [(p.body_a, -1.0), (p.body_b, 1.0)] {
                let Some(body) = body else { continue };
                let arm = p.point - ws.body_pose(tree, body).position;
                let wrench = Force::new(sign * (moment + arm.cross(&force)), sign * force);
                ws.add_wrench_at_body(tree, body, wrench);
            }
        }
    }

    /// Finds the contact points that can matter in this step: within the margin of all positions that bodies can reach.
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

    /// Builds the rows and cones of everything that acts in this step.
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
        self.carried.clear();
        self.free_turn.clear();
        self.rolling.clear();
        self.bounces.clear();
        self.belts.clear();
        self.islands.begin();
        let loops = tree.multibody().loops().len();
        for c in self.units.augmented() {
            let before = self.rows.groups().len();
            self.rows.add_constraint(tree, &self.units, ws, &self.uw, *c, motions, (q, v));
            (before..self.rows.groups().len())
                .for_each(|_| self.islands.constraint(index(*c, loops)));
        }
        self.rows.silence_rounding();
        for row in self.rows.groups() {
            self.kinds.push(Kind::Constraint);
            self.cones.push(Cone::Equality { rows: row.n });
        }
        let conveys = self.surfaces.any();
        for (i, p) in self.points.iter().enumerate() {
            let frame = frame(&p.normal);
            self.frames.push(frame);
            let ends = (p.body_a, p.body_b);
            let resistance = match self.colliders.resists() {
                true => self.colliders.resistance(p.a, p.b),
                false => Resistance::default(),
            };
            let (axes, cone) = resistance::contact_cone(&frame, p.friction, resistance.spinning);
            let at = (ends, &p.point);
            self.rows.add_wrenches(tree, &self.units, ws, &self.uw, at.0, at.1, &frame, axes);
            self.kinds.push(Kind::Contact(i as u32));
            self.cones.push(cone);
            self.islands.contact(p);
            if conveys {
                self.belts.push(resistance::belt(&self.surfaces, tree, ws, p, &frame));
            }
            if resistance.rolling > 0.0 {
                let contact = self.kinds.len() as u32 - 1;
                for axis in resistance::rolling_axes(tree, ws, p, &frame) {
                    let (group, point) = (self.kinds.len() as u32, i as u32);
                    let coefficient = resistance.rolling;
                    self.rolling.push(Rolling { group, contact, point, coefficient, axis });
                    let axes = &[axis];
                    self.rows.add_wrenches(tree, &self.units, ws, &self.uw, at.0, at.1, &[], axes);
                    self.kinds.push(Kind::Rolling);
                    self.cones.push(Cone::Dry { bound: 0.0 });
                    self.islands.contact(p);
                }
            }
            let carried = |body| self.turning.carried(body);
            self.carried.push(carried(p.body_b) - carried(p.body_a));
            let turn = |body| self.turning.free_turn(body, &p.point);
            self.free_turn.push(turn(p.body_b) - turn(p.body_a));
        }
        for l in &self.limits {
            let reach = 2.0 * h * v[l.v].abs() + 1e-3;
            for (bound, sign) in [(l.lower, 1.0), (l.upper, -1.0)] {
                let gap = sign * (q[l.q] - bound);
                if gap < reach {
                    self.rows.add_coordinate(tree, &self.units, &self.uw, l.v, sign, v[l.v]);
                    self.rows.set_error(gap);
                    self.kinds.push(Kind::Limit(self.bounces.len() as u32));
                    self.bounces.push(l.restitution);
                    self.cones.push(Cone::Unilateral);
                    self.islands.hinge(self.bodies[l.v]);
                }
            }
        }
        for ball in &self.balls {
            let fastest = v[ball.v..ball.v + 3].iter().map(|w| w * w).sum::<f64>().sqrt();
            for (gap, d) in ball.limits.left(&q[ball.q..ball.q + 4]).into_iter().flatten() {
                if gap < 2.0 * h * fastest + 1e-3 {
                    self.rows.add_direction(tree, &self.units, &self.uw, ball.v, &d, v);
                    self.rows.set_error(gap);
                    self.kinds.push(Kind::Limit(self.bounces.len() as u32));
                    self.bounces.push(ball.restitution);
                    self.cones.push(Cone::Unilateral);
                    self.islands.hinge(self.bodies[ball.v]);
                }
            }
        }
        for (place, force) in &self.settings.dry {
            self.islands.hinge(self.bodies[*place]);
            self.rows.add_coordinate(tree, &self.units, &self.uw, *place, 1.0, v[*place]);
            self.kinds.push(Kind::Dry);
            self.cones.push(Cone::Dry { bound: force * h });
        }
        self.islands.find_all();
    }

    fn find_impacts(&mut self, h: f64) -> Result<usize, StepError> {
        let scene = impacts::Scene {
            rows: &self.rows,
            kinds: &self.kinds,
            cones: &self.cones,
            points: &self.points,
            frames: &self.frames,
            carried: &self.carried,
            free_turn: &self.free_turn,
            belts: &self.belts,
            bounces: &self.bounces,
            islands: &self.islands,
            h,
            slop: self.settings.slop,
            bounce_min: self.settings.bounce_min,
        };
        self.impacts.find(&scene)
    }

    /// Returns the velocity of a group's rows at the end of the step without its impulses, impacts included.
    fn free_velocity(&self, g: usize, h: f64, impacts: bool) -> [f64; WIDTH] {
        let row = &self.rows.groups()[g];
        let mut v = row.rate;
        if impacts {
            v.iter_mut().zip(&self.impacts.change[g]).for_each(|(v, x)| *v += x);
        }
        v.iter_mut().zip(&row.free).for_each(|(v, a)| *v += h * a);
        if let Kind::Contact(i) = self.kinds[g] {
            let (carried, axes) = (&self.carried[i as usize], &self.frames[i as usize]);
            v.iter_mut().zip(axes).for_each(|(v, axis)| *v += h * axis.dot(carried));
        }
        v
    }

    /// Computes b of the step: velocities without this step's impulses, minus their targets. Also computes the largest velocity of each island, as
    /// the scale of residuals. Gaps that are far from closing do not count.
    fn free_velocities(&mut self, h: f64, impacts: bool) {
        self.b.clear();
        self.speeds.clear();
        self.speeds.resize(self.islands.len(), f64x4::splat(0.0));
        let (inverse, none) = (1.0 / h, [0.0; WIDTH]);
        for (g, row) in self.rows.groups().iter().enumerate() {
            let mut b = self.free_velocity(g, h, impacts);
            let change = f64x4::new(if impacts { self.impacts.change[g] } else { none });
            let gain = f64x4::splat(h) * f64x4::new(row.free);
            let moving = (f64x4::new(row.rate) + change).abs();
            let speed = &mut self.speeds[self.islands.of_group()[g] as usize];
            *speed = speed.fast_max(moving).fast_max(f64x4::splat(REST) * gain.abs());
            // Impacts late in the step move bodies for less than its whole length.
            let late = if impacts { self.impacts.shift[g] } else { 0.0 };
            let open = |gap: f64| (gap.max(0.0) + late) * inverse;
            match self.kinds[g] {
                Kind::Constraint => {
                    b.iter_mut().zip(&row.bias).for_each(|(b, bias)| *b += h * bias);
                }
                Kind::Contact(i) => {
                    b[0] += open(self.points[i as usize].gap);
                    if let Some(belt) = self.belts.get(i as usize) {
                        b.iter_mut().zip(belt).for_each(|(b, s)| *b += s);
                        let moves = f64x4::splat(belt[1].abs().max(belt[2].abs()));
                        let speed = &mut self.speeds[self.islands.of_group()[g] as usize];
                        *speed = speed.fast_max(moves);
                    }
                }
                Kind::Limit(_) => b[0] += open(row.error[0]),
                Kind::Dry | Kind::Rolling => {}
            }
            self.b.push(b);
        }
    }

    /// Restores the impulses of the last step at points that still exist.
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
        self.keep_moments();
        for (kind, lambda) in self.kinds.iter().zip(&self.lambda) {
            if let Kind::Contact(i) = kind {
                let (p, frame) = (&self.points[*i as usize], &self.frames[*i as usize]);
                let impulse = frame[0] * lambda[0] + frame[1] * lambda[1] + frame[2] * lambda[2];
                let pair = (id(p.a), id(p.b));
                self.warm.push(Impulse { pair, feature: p.feature, impulse });
            }
        }
    }
}

fn id(c: ColliderId) -> u32 {
    c.index() as u32
}

/// Returns the normal and two tangents (T. Duff et al., "Building an orthonormal basis, revisited", Journal of Computer Graphics Techniques 6, 2017).
fn frame(n: &Vec3) -> [Vec3; 3] {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    let x = Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    [*n, x, Vec3::new(b, sign + n.y * n.y * a, -n.y)]
}
