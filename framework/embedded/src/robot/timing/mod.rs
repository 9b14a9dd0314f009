//! A way in time: as fast as limits of rate, acceleration and force allow.
//!
//! ```text
//! way            q(s), 0 ≤ s ≤ length;   x = ṡ², u = s̈:   q̇ = q′ ṡ,   q̈ = q′ u + q″ x
//! rate           |q′_j| √x ≤ rate_j
//! acceleration   |q′_j u + q″_j x| ≤ acceleration_j
//! effort         |a_j u + b_j x + c_j| ≤ effort_j        a = M q′,  b = M q″ + C(q, q′),  c = g, with what hands hold
//! in a section   u is constant:  x = x_i + 2 u (s − s_i)
//! backward       K_i = {x: some u keeps all limits and leads into K_{i+1}},   K_N = {0}: an interval
//! forward        x_0 = 0, the greatest u of each section
//! ```
//! Reachability analysis of Pham and Pham (IEEE Transactions on Robotics 34, 2018, "A new approach to time-optimal path parameterization based on reachability
//! analysis"); each section looks at its limits at both ends and in the middle, so that they hold in between, too, and where q″ jumps. What is
//! then exceeded between these places, by the square of a section's length, is taken off the limits once more.

mod limits;
mod path;
mod section;

pub use limits::MotionLimits;

use super::Path;
use super::{Robot, numbers};
use crate::error::RobotError;
use path::Geometry;
use section::{Section, UNBOUNDED};

/// Places of a section where its limits are looked at, as parts of it.
const LOOKS: [f64; 3] = [0.0, 0.5, 1.0];
/// Places where it is measured afterwards how far they hold.
const BETWEEN: [f64; 6] = [0.125, 0.25, 0.375, 0.625, 0.75, 0.875];
/// Sections that a piece of a way has at least.
const LEAST: usize = 4;
/// How often the limits are narrowed by what is exceeded.
const NARROWINGS: usize = 6;

/// What a timing ends with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Timed {
    /// The way takes so long, s. [`Timing::at`] tells where the robot is meanwhile.
    Found {
        /// s.
        duration: f64,
    },
    /// No motion along the way keeps the limits.
    Infeasible {
        /// Where it becomes impossible, as a part of the way's length: [`Timing::place`] gives its configuration.
        part: f64,
        /// The least number by which all limits of acceleration and effort would have to be multiplied. 1 and a little: what is possible is a limit itself.
        share: f64,
    },
}

/// One section of the way.
#[derive(Clone, Copy, Debug)]
struct Place {
    piece: usize,
    /// From the beginning of its piece, and how long.
    sigma: f64,
    length: f64,
    /// Of the end: no motion there.
    stop: bool,
}

/// Memory of timings for one model.
#[derive(Clone, Debug)]
pub struct Timing {
    nq: usize,
    /// Which places of q move, and in β; of all with one coordinate.
    moving: Vec<(usize, usize)>,
    geometry: Geometry,
    room: usize,
    sections: Vec<Place>,
    /// x and K at the ends of sections, and the time there.
    x: Vec<f64>,
    reach: Vec<[f64; 2]>,
    t: Vec<f64>,
    /// For each section and look: q′, q″ (rows of the coordinates) and a, b, c (nv each).
    d1: Vec<f64>,
    d2: Vec<f64>,
    torque: [Vec<f64>; 3],
    section: Section,
    /// The robot's own q meanwhile; q′ and q″ in β; the first configuration of the way.
    q: Vec<f64>,
    v: Vec<f64>,
    w: Vec<f64>,
    own: Vec<f64>,
    other: Vec<f64>,
    row: [Vec<f64>; 3],
    limits: MotionLimits,
    dynamic: bool,
}

impl Timing {
    /// For ways of so many configurations, in so many sections: twenty for each configuration are few, a hundred are many. Allocates: once, at set-up.
    ///
    /// # Errors
    /// [`RobotError::OutOfRange`] for fewer than two configurations, and for fewer than eight sections a configuration; [`RobotError::OpensClosure`].
    pub fn new(robot: &Robot, configurations: usize, sections: usize) -> Result<Self, RobotError> {
        robot.model.open_tree("a timed way")?;
        if configurations < 2 {
            let (what, help) = ("configurations", "a way has at least two");
            return Err(RobotError::OutOfRange { what, value: configurations as f64, help });
        }
        if sections < 2 * LEAST * configurations {
            let (what, help) = ("sections", "eight at least for each configuration");
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
        })
    }

    /// Times a way from rest to rest: rows of whole configurations (nq each), between which all coordinates move in proportion, as those of a
    /// [`Planner`](super::Planner). Where `round` is zero the motion stands still at each corner and stays on the way; else corners are rounded so that no
    /// point of it is farther than `round` from the way (root of the sum of squares of coordinates, rad and m): then ask [`free`](Self::free). The robot's own
    /// q does not matter; what its hands hold does. Work: 21 inverse dynamics for each section.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`] for a robot of another size; [`RobotError::Length`], [`RobotError::NotFinite`]; [`RobotError::NoRoom`] for more configurations
    /// or pieces than there is room for; [`RobotError::OutOfRange`] for limits that are not above zero, a `round` below zero, a way that moves ball or free
    /// hinges, and one whose speed no limit bounds. *Infeasible* is an answer, not an error.
    pub fn plan(
        &mut self,
        robot: &mut Robot,
        way: &[f64],
        limits: &MotionLimits,
        round: f64,
    ) -> Result<Timed, RobotError> {
        self.check(robot, way, limits, round)?;
        self.t.clear();
        self.sections.clear();
        let nq = self.nq;
        self.own.copy_from_slice(&way[..nq]);
        let moving = &self.moving;
        // All coordinates with one number move; the rest stays.
        let gather = |row: &'_ [f64], to: &mut Vec<f64>| to.extend(moving.iter().map(|m| row[m.0]));
        let mut rows = std::mem::take(&mut self.d1);
        rows.clear();
        way.chunks_exact(nq).for_each(|row| gather(row, &mut rows));
        let n = self.moving.len().max(1);
        self.geometry.make(rows.chunks_exact(n), round);
        rows.resize(self.moving.len() * LOOKS.len() * self.room, 0.0);
        self.d1 = rows;
        self.divide()?;
        self.dynamic = limits.effort.iter().any(|x| x.is_finite());
        self.copy_limits(limits);
        // The robot's own configuration is put back, whatever happens.
        self.q.copy_from_slice(&robot.q);
        let told = self.looks(robot).and_then(|()| self.solve(robot, limits));
        robot.q.copy_from_slice(&self.q);
        robot.fresh = false;
        told
    }

    fn check(
        &self,
        robot: &Robot,
        way: &[f64],
        limits: &MotionLimits,
        round: f64,
    ) -> Result<(), RobotError> {
        if robot.q.len() != self.nq || robot.tree.nv() != self.v.len() {
            return Err(RobotError::ForeignHandle);
        }
        let rows = way.len() / self.nq.max(1);
        if rows == 0 {
            return Err(RobotError::Length { what: "way", got: way.len(), wanted: self.nq });
        }
        numbers("way", way, rows * self.nq)?;
        let room = self.geometry.pieces.capacity() / 2;
        if rows > room {
            return Err(RobotError::NoRoom { what: "configurations", wanted: rows, room });
        }
        limits.check(self.v.len())?;
        if !(round >= 0.0 && round.is_finite()) {
            let (what, value, help) = ("round", round, "a distance is not below zero");
            return Err(RobotError::OutOfRange { what, value, help });
        }
        for (at, x) in way.iter().enumerate() {
            let moves = self.moving.iter().any(|m| m.0 == at % self.nq);
            if !moves && *x != way[at % self.nq] {
                let what = "the change of a coordinate of a ball or free hinge along a way";
                let (value, help) = (x - way[at % self.nq], "move pins, sliders and screws alone");
                return Err(RobotError::OutOfRange { what, value, help });
            }
        }
        Ok(())
    }

    fn copy_limits(&mut self, from: &MotionLimits) {
        self.limits.rate.copy_from_slice(&from.rate);
        self.limits.acceleration.copy_from_slice(&from.acceleration);
        self.limits.jerk.copy_from_slice(&from.jerk);
        self.limits.effort.copy_from_slice(&from.effort);
    }

    /// Sections of the pieces: by their lengths, at least a few each.
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

    /// What limits depend on, at every look of every section.
    fn looks(&mut self, robot: &mut Robot) -> Result<(), RobotError> {
        for i in 0..self.sections.len() {
            for (k, part) in LOOKS.into_iter().enumerate() {
                self.look(robot, i, part, LOOKS.len() * i + k)?;
            }
        }
        Ok(())
    }

    /// q′, q″, a, b and c at a part of a section, into the rows `to`.
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
        Ok(())
    }

    /// Both passes, and narrower limits where they are exceeded in between.
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
                let what = "the speed that limits allow somewhere on the way";
                let help = "give limits of rate, or of acceleration, to what moves";
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

    /// The greatest x that rates allow at a look.
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

    /// The rows of section i; those of acceleration and effort with limits times `share`.
    fn rows(&mut self, i: usize, share: f64, [low, high]: [f64; 2]) {
        let (n, nv) = (self.moving.len(), self.v.len());
        let length = self.sections[i].length;
        self.section.clear();
        for (k, part) in LOOKS.into_iter().enumerate() {
            let (to, ahead) = (LOOKS.len() * i + k, 2.0 * part * length);
            // x at the look is x_i + ahead u.
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

    /// K from the end to the beginning, or the section that has none.
    fn backward(&mut self, share: f64) -> Result<(), usize> {
        let sections = self.sections.len();
        self.reach.clear();
        self.reach.resize(sections + 1, [0.0; 2]);
        // Before and after the motion the robot stands still.
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
            // The look at the end of the section before has the direction there.
            let most = if i > 0 { most.min(self.fastest(LOOKS.len() * i - 1)) } else { most };
            self.rows(i, share, self.reach[i + 1]);
            self.reach[i] = self.section.x(0.0, most).ok_or(i)?;
        }
        Ok(())
    }

    /// As fast as each section can.
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

    /// The times; the section that takes forever.
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

    /// Narrows the limits by what is exceeded between the looks; false when nothing is.
    fn narrow(&mut self, robot: &mut Robot, limits: &MotionLimits) -> Result<bool, RobotError> {
        let (n, nv) = (self.moving.len(), self.v.len());
        let mut narrowed = false;
        let mut hold = |limit: &mut f64, asked: f64, value: f64| {
            let over = value.abs() / asked;
            if over > 1.0 + 1e-12 {
                // A little more than what is too much, from where the limit stands.
                let new = asked / (over * (1.0 + 1e-7)) * (*limit / asked).min(1.0);
                if new < *limit {
                    *limit = new;
                    narrowed = true;
                }
            }
        };
        let to = LOOKS.len() * self.sections.len() - 1;
        // The last row is lent for it, and made again.
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

    /// The least share of limits with which the way can be gone.
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

    /// How long the way takes that was timed last, s; zero when none was found.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.t.last().copied().unwrap_or_default()
    }

    /// The configuration (nq), rates and accelerations (nv) at a time, s, of the way that was timed last: before its beginning and after its end it stands still.
    ///
    /// # Errors
    /// [`RobotError::NotFinite`], [`RobotError::Length`]; [`RobotError::NoSearch`] when no way was timed.
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
            // The end of a section to the bit: at the end of the way no rate is left.
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

    /// The configuration (nq) at a part (0 to 1) of the length of the way that was given last.
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

    /// Whether the way that was given last touches nothing, its corners as they are rounded: straight pieces as [`Robot::path_free`] proves them, corners by
    /// boxes that hold them, cut in halves down to the part `least` of a corner. `at` in the answer is a part of the way's length.
    ///
    /// # Errors
    /// As `path_free`; [`RobotError::ForeignHandle`] for a robot of another size.
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

    /// As `Robot::path_free` of a rounded corner.
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
            // A parabola stays within the box of its ends and of the place where their tangents meet, which is the middle's place along the first tangent.
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

    /// A whole configuration of a piece.
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
