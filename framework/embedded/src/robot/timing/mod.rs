//! Time parameterization of a path: the fastest motion within limits of rate, acceleration and effort.
//!
//! ```text
//! path           q(s), 0 ≤ s ≤ length;   x = ṡ², u = s̈:   q̇ = q′ ṡ,   q̈ = q′ u + q″ x
//! rate           |q′_j| √x ≤ rate_j
//! acceleration   |q′_j u + q″_j x| ≤ acceleration_j
//! effort         |a_j u + b_j x + c_j| ≤ effort_j        a = M q′,  b = M q″ + C(q, q′),  c = g, including held objects
//! couplings      a_i += Σ (∂q_d/∂q_i) a_d, a_d = 0, and so for b and c        d: a coordinate that follows others, such as a mimic joint
//! in a section   u is constant:  x = x_i + 2 u (s − s_i)
//! backward       K_i = {x: some u keeps all limits and leads into K_{i+1}},   K_N = {0}: an interval
//! forward        x_0 = 0, the greatest u of each section
//! ```
//! The method is the reachability analysis of Pham and Pham (IEEE Transactions on Robotics 34, 2018, "A new approach to time-optimal path
//! parameterization based on reachability analysis"). Limits are enforced at both ends and in the middle of each section, so that they also hold
//! where q″ jumps. Between these points a limit can be exceeded by an amount proportional to the square of the section's length. This excess is
//! measured, and the motion is computed again with limits reduced by it.

mod followers;
mod limits;
mod path;
mod section;

pub use limits::MotionLimits;

use super::Path;
use super::{Robot, numbers};
use crate::error::RobotError;
use followers::Follower;
use path::Geometry;
use section::{Section, UNBOUNDED};

/// Positions in a section, as fractions of its length, at which the limits are enforced.
const LOOKS: [f64; 3] = [0.0, 0.5, 1.0];
/// Positions in a section at which the motion is checked afterwards.
const BETWEEN: [f64; 6] = [0.125, 0.25, 0.375, 0.625, 0.75, 0.875];
/// Minimum number of sections of a piece.
const LEAST: usize = 4;
/// Maximum number of repetitions with reduced limits.
const NARROWINGS: usize = 6;

/// Result of a time parameterization.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Timed {
    /// A motion was found. [`Timing::at`] returns the robot's state at a time.
    Found {
        /// Duration of the motion, s.
        duration: f64,
    },
    /// No motion along the path keeps the limits.
    Infeasible {
        /// Position on the path, as a fraction of its length, where the limits cannot be kept. [`Timing::place`] returns the configuration there.
        part: f64,
        /// Smallest factor for all limits of acceleration and effort with which a motion exists. It is slightly above 1 if the path is at the
        /// boundary of what the limits allow.
        share: f64,
    },
}

/// One section of the path.
#[derive(Clone, Copy, Debug)]
struct Place {
    piece: usize,
    /// Distance from the beginning of its piece, and length.
    sigma: f64,
    length: f64,
    /// True if the motion is at rest at the end of the section.
    stop: bool,
}

/// Time parameterization of paths, with all memory that it needs, for one model.
#[derive(Clone, Debug)]
pub struct Timing {
    nq: usize,
    /// Index in q and index in β of each coordinate that moves. Only hinges with one coordinate are supported.
    moving: Vec<(usize, usize)>,
    geometry: Geometry,
    room: usize,
    sections: Vec<Place>,
    /// x and K at the ends of the sections, and the time there.
    x: Vec<f64>,
    reach: Vec<[f64; 2]>,
    t: Vec<f64>,
    /// For each section and each position in [`LOOKS`]: q′, q″ (one row of the coordinates each) and a, b, c (nv each).
    d1: Vec<f64>,
    d2: Vec<f64>,
    torque: [Vec<f64>; 3],
    section: Section,
    /// The robot's own q, restored after the call; q′ and q″ in β; the first configuration of the path.
    q: Vec<f64>,
    v: Vec<f64>,
    w: Vec<f64>,
    own: Vec<f64>,
    other: Vec<f64>,
    row: [Vec<f64>; 3],
    limits: MotionLimits,
    dynamic: bool,
    /// Coordinates that linear couplings determine.
    followers: Vec<Follower>,
}

impl Timing {
    /// Creates a time parameterization for paths of up to `configurations` configurations and `sections` sections. Twenty sections for each
    /// configuration are a coarse division, a hundred are a fine one. Allocates memory; later calls do not.
    ///
    /// # Errors
    /// [`RobotError::OutOfRange`] for fewer than two configurations or fewer than eight sections for each configuration.
    pub fn new(robot: &Robot, configurations: usize, sections: usize) -> Result<Self, RobotError> {
        if configurations < 2 {
            let (what, help) = ("configurations", "a path has at least two configurations");
            return Err(RobotError::OutOfRange { what, value: configurations as f64, help });
        }
        if sections < 2 * LEAST * configurations {
            let (what, help) = ("sections", "give at least eight for each configuration");
            return Err(RobotError::OutOfRange { what, value: sections as f64, help });
        }
        let limits = robot.model.limits.iter().enumerate();
        let moving: Vec<(usize, usize)> =
            limits.filter_map(|(v, l)| l.as_ref().map(|(q, _)| (*q, v))).collect();
        let (n, nq, nv) = (moving.len(), robot.q.len(), robot.tree.nv());
        let looks = LOOKS.len() * sections;
        let many = || Vec::with_capacity(sections + 1);
        let torque = || vec![0.0; nv * looks];
        Ok(Self {
            nq,
            moving,
            geometry: Geometry::new(n, configurations),
            room: sections,
            sections: Vec::with_capacity(sections),
            x: many(),
            reach: Vec::with_capacity(sections + 1),
            t: many(),
            d1: vec![0.0; n * looks],
            d2: vec![0.0; n * looks],
            torque: [torque(), torque(), torque()],
            section: Section::new(LOOKS.len() * (2 * n + 2 * nv + 2) + 4),
            q: vec![0.0; nq],
            v: vec![0.0; nv],
            w: vec![0.0; nv],
            own: vec![0.0; nq],
            other: vec![0.0; nq],
            row: [vec![0.0; n], vec![0.0; n], vec![0.0; n]],
            limits: MotionLimits::of(&robot.model),
            dynamic: false,
            followers: followers::of(robot.model.multibody()),
        })
    }

    /// Computes the fastest motion along `path` from rest to rest. `path` contains whole configurations one after the other (nq numbers each), such as
    /// those of a [`Planner`](super::Planner). All coordinates move in proportion between two of them. With `round` = 0 the motion stops at each
    /// corner and follows the path exactly. Otherwise corners are rounded so that no point of the motion is farther than `round` from the path
    /// (Euclidean distance of coordinates, rad and m); call [`free`](Self::free) afterwards, because a rounded corner may touch something. The
    /// robot's own q has no effect; the objects in its hands do. The work is 21 inverse dynamics for each section.
    ///
    /// A coordinate that a linear coupling determines, such as a joint that mimics another one, has no motor: its limits of rate and acceleration
    /// apply, and its force acts on the coordinates that it follows, whose limits of effort apply. The configurations of the path must satisfy the
    /// couplings.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`] for a robot of another size; [`RobotError::Length`]; [`RobotError::NotFinite`]; [`RobotError::NoRoom`] for more
    /// configurations or pieces than this object was created for; [`RobotError::OutOfRange`] for limits that are not positive, a negative `round`, a
    /// path that moves ball or free hinges, and a path on which no limit bounds the speed; [`RobotError::OpensClosure`] for a path that violates a
    /// coupling or moves a loop or a coupling with higher powers. [`Timed::Infeasible`] is a result, not an error.
    pub fn plan(
        &mut self,
        robot: &mut Robot,
        path: &[f64],
        limits: &MotionLimits,
        round: f64,
    ) -> Result<Timed, RobotError> {
        self.check(robot, path, limits, round)?;
        self.t.clear();
        self.sections.clear();
        let nq = self.nq;
        self.own.copy_from_slice(&path[..nq]);
        let moving = &self.moving;
        // Only hinges with one coordinate move; all other coordinates keep their values.
        let gather = |row: &'_ [f64], to: &mut Vec<f64>| to.extend(moving.iter().map(|m| row[m.0]));
        let mut rows = std::mem::take(&mut self.d1);
        rows.clear();
        path.chunks_exact(nq).for_each(|row| gather(row, &mut rows));
        let n = self.moving.len().max(1);
        self.geometry.make(rows.chunks_exact(n), round);
        rows.resize(self.moving.len() * LOOKS.len() * self.room, 0.0);
        self.d1 = rows;
        self.divide()?;
        self.dynamic = limits.effort.iter().any(|x| x.is_finite());
        self.copy_limits(limits);
        // Restore the robot's own configuration, also after an error.
        self.q.copy_from_slice(&robot.q);
        let told = self.looks(robot).and_then(|()| self.solve(robot, limits));
        robot.q.copy_from_slice(&self.q);
        robot.fresh = false;
        told
    }

    fn check(
        &self,
        robot: &Robot,
        path: &[f64],
        limits: &MotionLimits,
        round: f64,
    ) -> Result<(), RobotError> {
        if robot.q.len() != self.nq || robot.tree.nv() != self.v.len() {
            return Err(RobotError::ForeignHandle);
        }
        let rows = path.len() / self.nq.max(1);
        if rows == 0 {
            return Err(RobotError::Length { what: "path", got: path.len(), wanted: self.nq });
        }
        numbers("path", path, rows * self.nq)?;
        let room = self.geometry.pieces.capacity() / 2;
        if rows > room {
            return Err(RobotError::NoRoom { what: "configurations", wanted: rows, room });
        }
        limits.check(self.v.len())?;
        if !(round >= 0.0 && round.is_finite()) {
            let (what, value, help) = ("round", round, "a distance must not be negative");
            return Err(RobotError::OutOfRange { what, value, help });
        }
        for (at, x) in path.iter().enumerate() {
            let moves = self.moving.iter().any(|m| m.0 == at % self.nq);
            if !moves && *x != path[at % self.nq] {
                let what = "change of a coordinate of a ball or free hinge along a path";
                let (value, help) = (x - path[at % self.nq], "move only pins, sliders and screws");
                return Err(RobotError::OutOfRange { what, value, help });
            }
        }
        for at in 1..rows {
            let row = |k: usize| &path[k * self.nq..(k + 1) * self.nq];
            robot.model.opens_between(row(at - 1), row(at))?;
        }
        Ok(())
    }

    fn copy_limits(&mut self, from: &MotionLimits) {
        self.limits.rate.copy_from_slice(&from.rate);
        self.limits.acceleration.copy_from_slice(&from.acceleration);
        self.limits.jerk.copy_from_slice(&from.jerk);
        self.limits.effort.copy_from_slice(&from.effort);
    }

    /// Distributes the sections over the pieces in proportion to their lengths, with a minimum number for each.
    fn divide(&mut self) -> Result<(), RobotError> {
        let pieces = &self.geometry.pieces;
        let length = self.geometry.length();
        let spare = (self.room - self.room.min(LEAST * pieces.len())) as f64;
        for (piece, p) in pieces.iter().enumerate() {
            let count = LEAST + (spare * p.length / length + 1e-9) as usize;
            if self.sections.len() + count > self.room {
                let (wanted, room) = (self.sections.len() + count, self.room);
                return Err(RobotError::NoRoom { what: "sections", wanted, room });
            }
            for k in 0..count {
                let [from, to] = [k, k + 1].map(|k| p.length * k as f64 / count as f64);
                let stop = p.stop && k + 1 == count;
                self.sections.push(Place { piece, sigma: from, length: to - from, stop });
            }
        }
        Ok(())
    }

    /// Evaluates the coefficients of the limits at all positions of all sections.
    fn looks(&mut self, robot: &mut Robot) -> Result<(), RobotError> {
        for i in 0..self.sections.len() {
            for (k, part) in LOOKS.into_iter().enumerate() {
                self.look(robot, i, part, LOOKS.len() * i + k)?;
            }
        }
        Ok(())
    }

    /// Writes q′, q″, a, b and c at a fraction of a section into the rows `to`.
    fn look(
        &mut self,
        robot: &mut Robot,
        section: usize,
        part: f64,
        to: usize,
    ) -> Result<(), RobotError> {
        let (n, nv) = (self.moving.len(), self.v.len());
        let place = self.sections[section];
        let [q, d1, d2] = &mut self.row;
        self.geometry.at(place.piece, place.sigma + part * place.length, q, d1, d2);
        self.d1[n * to..n * (to + 1)].copy_from_slice(d1);
        self.d2[n * to..n * (to + 1)].copy_from_slice(d2);
        if !self.dynamic {
            return Ok(());
        }
        robot.q.copy_from_slice(&self.own);
        for (k, (at, v)) in self.moving.iter().enumerate() {
            robot.q[*at] = q[k];
            (self.v[*v], self.w[*v]) = (d1[k], d2[k]);
        }
        let [a, b, c] = &mut self.torque;
        let [a, b, c] = [a, b, c].map(|x| &mut x[nv * to..nv * (to + 1)]);
        robot.forces(None, None, &[], c)?;
        robot.forces(None, Some(&self.v), &[], a)?;
        robot.forces(Some(&self.v), Some(&self.w), &[], b)?;
        for j in 0..nv {
            a[j] -= c[j];
            b[j] -= c[j];
        }
        for follower in &self.followers {
            [&mut *a, &mut *b, &mut *c].into_iter().for_each(|forces| follower.hand_over(forces));
        }
        Ok(())
    }

    /// Runs the backward and forward passes, and repeats them with reduced limits while limits are exceeded between the checked positions.
    fn solve(&mut self, robot: &mut Robot, limits: &MotionLimits) -> Result<Timed, RobotError> {
        if self.sections.is_empty() {
            self.x.clear();
            self.x.push(0.0);
            self.t.push(0.0);
            return Ok(Timed::Found { duration: 0.0 });
        }
        for pass in 0..=NARROWINGS {
            if let Err(section) = self.backward(1.0) {
                let share = if pass == 0 { self.least_share() } else { 1.0 };
                return Ok(Timed::Infeasible { part: self.part(section), share });
            }
            if self.reach.iter().any(|k| k[1] >= 1e-1 * UNBOUNDED) {
                let what = "speed that the limits allow at a point of the path";
                let help = "give the moving joints limits of rate or acceleration";
                return Err(RobotError::OutOfRange { what, value: f64::INFINITY, help });
            }
            self.forward();
            if let Err(section) = self.clock() {
                self.t.clear();
                return Ok(Timed::Infeasible { part: self.part(section), share: 1.0 });
            }
            if pass == NARROWINGS || !self.narrow(robot, limits)? {
                break;
            }
        }
        let duration = self.t.last().copied().unwrap_or_default();
        Ok(Timed::Found { duration })
    }

    fn part(&self, section: usize) -> f64 {
        let place = self.sections[section];
        let s = self.geometry.pieces[place.piece].s + place.sigma;
        s / self.geometry.length()
    }

    /// Returns the largest x that the rate limits allow at a position.
    fn fastest(&self, to: usize) -> f64 {
        let n = self.moving.len();
        let mut x = UNBOUNDED;
        for (k, d) in self.d1[n * to..n * (to + 1)].iter().enumerate() {
            let rate = self.limits.rate[self.moving[k].1];
            if *d != 0.0 {
                x = x.min((rate / d) * (rate / d));
            }
        }
        x
    }

    /// Collects the rows of section i. Limits of acceleration and effort are multiplied by `share`.
    fn rows(&mut self, i: usize, share: f64, [low, high]: [f64; 2]) {
        let (n, nv) = (self.moving.len(), self.v.len());
        let length = self.sections[i].length;
        self.section.clear();
        for (k, part) in LOOKS.into_iter().enumerate() {
            let (to, ahead) = (LOOKS.len() * i + k, 2.0 * part * length);
            // x at this position is x_i + ahead u.
            if k > 0 {
                let fastest = self.fastest(to);
                self.section.row(ahead, 1.0, -fastest);
            }
            for (j, (_, v)) in self.moving.iter().enumerate() {
                let (d1, d2) = (self.d1[n * to + j], self.d2[n * to + j]);
                if d1 != 0.0 || d2 != 0.0 {
                    let most = share * self.limits.acceleration[*v];
                    self.section.within(d1 + d2 * ahead, d2, 0.0, most);
                }
            }
            if self.dynamic {
                for j in 0..nv {
                    let [a, b, c] = [0, 1, 2].map(|x| self.torque[x][nv * to + j]);
                    self.section.within(a + b * ahead, b, c, share * self.limits.effort[j]);
                }
            }
        }
        self.section.row(2.0 * length, 1.0, -high);
        self.section.row(-2.0 * length, -1.0, low);
    }

    /// Computes K from the end to the beginning. Returns the section without an admissible x as an error.
    fn backward(&mut self, share: f64) -> Result<(), usize> {
        let sections = self.sections.len();
        self.reach.clear();
        self.reach.resize(sections + 1, [0.0; 2]);
        // The robot is at rest before and after the motion, so it must be able to hold these configurations.
        for (section, look) in [(sections - 1, LOOKS.len() * sections - 1), (0, 0)] {
            let rest = &self.torque[2][self.v.len() * look..self.v.len() * (look + 1)];
            let held = |(c, most): (&f64, &f64)| c.abs() <= share * most;
            if self.dynamic && !rest.iter().zip(&self.limits.effort).all(held) {
                return Err(section);
            }
        }
        for i in (0..sections).rev() {
            let stop = i == 0 || self.sections[i - 1].stop;
            let most = if stop { 0.0 } else { self.fastest(LOOKS.len() * i) };
            // Also use the direction of the path at the end of the previous section.
            let most = if i > 0 { most.min(self.fastest(LOOKS.len() * i - 1)) } else { most };
            self.rows(i, share, self.reach[i + 1]);
            self.reach[i] = self.section.x(0.0, most).ok_or(i)?;
        }
        Ok(())
    }

    /// Computes x from the beginning to the end with the largest u of each section.
    fn forward(&mut self) {
        self.x.clear();
        self.x.push(0.0);
        for i in 0..self.sections.len() {
            let [low, high] = self.reach[i + 1];
            self.rows(i, 1.0, [low, high]);
            let x = self.x[i];
            let u = self.section.u(x)[1];
            self.x.push((x + 2.0 * u * self.sections[i].length).clamp(low, high));
        }
    }

    /// Computes the times at the ends of the sections. Returns the section in which the motion never ends as an error.
    fn clock(&mut self) -> Result<(), usize> {
        self.t.clear();
        self.t.push(0.0);
        let mut t = 0.0;
        for (i, place) in self.sections.iter().enumerate() {
            let speed = self.x[i].sqrt() + self.x[i + 1].sqrt();
            t += 2.0 * place.length / speed;
            if !t.is_finite() {
                return Err(i);
            }
            self.t.push(t);
        }
        Ok(())
    }

    /// Reduces the limits by what is exceeded between the checked positions. Returns false when nothing is exceeded.
    fn narrow(&mut self, robot: &mut Robot, limits: &MotionLimits) -> Result<bool, RobotError> {
        let (n, nv) = (self.moving.len(), self.v.len());
        let mut narrowed = false;
        let mut hold = |limit: &mut f64, asked: f64, value: f64| {
            let over = value.abs() / asked;
            if over > 1.0 + 1e-12 {
                // Reduce slightly more than the excess, starting from the already reduced limit.
                let new = asked / (over * (1.0 + 1e-7)) * (*limit / asked).min(1.0);
                if new < *limit {
                    *limit = new;
                    narrowed = true;
                }
            }
        };
        let to = LOOKS.len() * self.sections.len() - 1;
        // The last row is used as scratch memory and evaluated again afterwards.
        for i in 0..self.sections.len() {
            let length = self.sections[i].length;
            let u = (self.x[i + 1] - self.x[i]) / (2.0 * length);
            for part in BETWEEN {
                self.look(robot, i, part, to)?;
                let x = self.x[i] + 2.0 * u * part * length;
                for j in 0..n {
                    let (v, d1, d2) = (self.moving[j].1, self.d1[n * to + j], self.d2[n * to + j]);
                    hold(&mut self.limits.rate[v], limits.rate[v], d1 * x.max(0.0).sqrt());
                    let a = d1 * u + d2 * x;
                    hold(&mut self.limits.acceleration[v], limits.acceleration[v], a);
                }
                if self.dynamic {
                    for j in 0..nv {
                        let [a, b, c] = [0, 1, 2].map(|x| self.torque[x][nv * to + j]);
                        let tau = a * u + b * x + c;
                        hold(&mut self.limits.effort[j], limits.effort[j], tau);
                    }
                }
            }
        }
        self.look(robot, self.sections.len() - 1, 1.0, to)?;
        Ok(narrowed)
    }

    /// Returns the smallest factor of the limits with which a motion along the path exists.
    fn least_share(&mut self) -> f64 {
        let (mut low, mut high) = (1.0, 2.0);
        while self.backward(high).is_err() {
            (low, high) = (high, 2.0 * high);
            if high > 1e12 {
                return f64::INFINITY;
            }
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            match self.backward(middle) {
                Ok(()) => high = middle,
                Err(_) => low = middle,
            }
        }
        high
    }

    /// Returns the duration of the last motion, s; zero when none was found.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.t.last().copied().unwrap_or_default()
    }

    /// Writes the configuration (nq), rates and accelerations (nv) of the last motion at `time`, s. Before its beginning and after its end the robot
    /// is at rest.
    ///
    /// # Errors
    /// [`RobotError::NotFinite`]; [`RobotError::Length`]; [`RobotError::NoSearch`] before a motion was found.
    pub fn at(
        &mut self,
        time: f64,
        q: &mut [f64],
        v: &mut [f64],
        vdot: &mut [f64],
    ) -> Result<(), RobotError> {
        numbers("time", &[time], 1)?;
        self.lengths(q, v, vdot)?;
        if self.t.is_empty() {
            return Err(RobotError::NoSearch { part: 0 });
        }
        q.copy_from_slice(&self.own);
        v.fill(0.0);
        vdot.fill(0.0);
        if self.sections.is_empty() {
            return Ok(());
        }
        let t = time.clamp(0.0, self.duration());
        let i = self.t.partition_point(|x| *x <= t).clamp(1, self.sections.len()) - 1;
        let place = self.sections[i];
        let u = (self.x[i + 1] - self.x[i]) / (2.0 * place.length);
        let (since, begin) = (t - self.t[i], self.x[i].sqrt());
        let (along, rate) = match t < self.t[i + 1] {
            true => {
                let along = since * (begin + 0.5 * u * since);
                (along.clamp(0.0, place.length), (begin + u * since).max(0.0))
            }
            // Use the exact value at the end of a section, so that the rate at the end of the path is exactly zero.
            false => (place.length, self.x[i + 1].sqrt()),
        };
        let outside = time < 0.0 || time > self.duration();
        let [at, d1, d2] = &mut self.row;
        self.geometry.at(place.piece, place.sigma + along, at, d1, d2);
        for (k, (iq, iv)) in self.moving.iter().enumerate() {
            q[*iq] = at[k];
            if !outside {
                v[*iv] = d1[k] * rate;
                vdot[*iv] = d1[k] * u + d2[k] * rate * rate;
            }
        }
        Ok(())
    }

    /// Writes the configuration (nq) at a fraction (0 to 1) of the length of the last path.
    ///
    /// # Errors
    /// [`RobotError::NotFinite`], [`RobotError::Length`].
    pub fn place(&mut self, part: f64, q: &mut [f64]) -> Result<(), RobotError> {
        numbers("part", &[part], 1)?;
        if q.len() != self.nq {
            return Err(RobotError::Length { what: "q", got: q.len(), wanted: self.nq });
        }
        q.copy_from_slice(&self.own);
        let s = part.clamp(0.0, 1.0) * self.geometry.length();
        let pieces = &self.geometry.pieces;
        if let Some(piece) = pieces.partition_point(|p| p.s <= s).checked_sub(1) {
            let sigma = (s - pieces[piece].s).min(pieces[piece].length);
            self.whole(piece, sigma, q);
        }
        Ok(())
    }

    /// Checks the last path for collisions, with its corners as they are rounded. Straight pieces are checked as [`Robot::path_free`] does. A rounded
    /// corner is enclosed in boxes, which are halved until they are shorter than `least`, as a fraction of the corner. `at` in the result is a
    /// fraction of the path's length.
    ///
    /// # Errors
    /// Like `path_free`; [`RobotError::ForeignHandle`] for a robot of another size.
    pub fn free(&mut self, robot: &mut Robot, least: f64) -> Result<Path, RobotError> {
        if robot.q.len() != self.nq || robot.tree.nv() != self.v.len() {
            return Err(RobotError::ForeignHandle);
        }
        let length = self.geometry.length();
        let mut undecided = None;
        for piece in 0..self.geometry.pieces.len() {
            let p = self.geometry.pieces[piece];
            let whole = |part: f64| (p.s + part * p.length) / length;
            let found = match self.geometry.is_straight(piece) {
                true => {
                    let [mut a, mut b] =
                        [std::mem::take(&mut self.q), std::mem::take(&mut self.other)];
                    self.whole(piece, 0.0, &mut a);
                    self.whole(piece, p.length, &mut b);
                    let found = robot.path_free(&a, &b, least);
                    (self.q, self.other) = (a, b);
                    found?
                }
                false => self.corner_free(robot, piece, least)?,
            };
            match found {
                Path::Free => {}
                Path::Hit { at, pair } => return Ok(Path::Hit { at: whole(at), pair }),
                Path::Undecided { at } => undecided = undecided.or(Some(whole(at))),
            }
        }
        Ok(undecided.map_or(Path::Free, |at| Path::Undecided { at }))
    }

    /// Checks a rounded corner for collisions, as [`Robot::path_free`] does for a straight piece.
    fn corner_free(
        &mut self,
        robot: &mut Robot,
        piece: usize,
        least: f64,
    ) -> Result<Path, RobotError> {
        let whole = self.geometry.pieces[piece].length;
        let (mut at, mut length, mut undecided) = (0.0, 1.0, None);
        while at < 1.0 {
            let mut q = std::mem::take(&mut self.q);
            self.whole(piece, (at + 0.5 * length) * whole, &mut q);
            let hit = robot.first_hit(&q);
            // A parabola stays within the box of its ends and of the intersection of their tangents. The intersection is half the parameter length
            // along the first tangent.
            q.copy_from_slice(&self.own);
            self.w.fill(0.0);
            let [p0, d1, d2] = &mut self.row;
            self.geometry.at(piece, at * whole, p0, d1, d2);
            let half = 0.5 * length * whole;
            for (k, (iq, iv)) in self.moving.iter().enumerate() {
                let tangent = p0[k] + d1[k] * half;
                let end = tangent + (d1[k] + 2.0 * d2[k] * half) * half;
                let (low, high) = (p0[k].min(tangent).min(end), p0[k].max(tangent).max(end));
                q[*iq] = 0.5 * (low + high);
                self.w[*iv] = 0.5 * (high - low);
            }
            let near = robot.first_within(&q, &self.w);
            self.q = q;
            let middle = at + 0.5 * length;
            if let Some(pair) = hit? {
                return Ok(Path::Hit { at: middle, pair });
            }
            if near?.is_some() {
                if 0.5 * length >= least {
                    length *= 0.5;
                    continue;
                }
                undecided = undecided.or(Some(middle));
            }
            at += length;
            while length < 1.0 && (at / (2.0 * length)).fract() == 0.0 {
                length *= 2.0;
            }
        }
        Ok(undecided.map_or(Path::Free, |at| Path::Undecided { at }))
    }

    /// Writes the whole configuration at a position of a piece.
    fn whole(&mut self, piece: usize, sigma: f64, q: &mut [f64]) {
        q.copy_from_slice(&self.own);
        let [at, d1, d2] = &mut self.row;
        self.geometry.at(piece, sigma, at, d1, d2);
        for (x, (iq, _)) in at.iter().zip(&self.moving) {
            q[*iq] = *x;
        }
    }

    fn lengths(&self, q: &[f64], v: &[f64], vdot: &[f64]) -> Result<(), RobotError> {
        let all = [("q", q, self.nq), ("v", v, self.v.len()), ("vdot", vdot, self.v.len())];
        match all.into_iter().find(|(_, x, wanted)| x.len() != *wanted) {
            Some((what, x, wanted)) => Err(RobotError::Length { what, got: x.len(), wanted }),
            None => Ok(()),
        }
    }
}
