//! Collisions at many configurations, in as many threads as the caller has robots for.
//!
//! Within one configuration the balls about shapes are compared side by side in SIMD lanes (`framework/collision`). Lanes over configurations were measured
//! and gain nothing: poses are a fortieth of an answer, and from the balls on each configuration goes its own way.

use super::Robot;
use crate::error::RobotError;

impl Robot {
    /// Whether two colliders that meet touch or overlap at each of many configurations: `q` (n × nq, row after row), into `out` (n). Every answer is that of
    /// [`collides`](Self::collides); what hands hold goes with them. No allocation.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::ZeroQuaternion`] (their index counts from the first number of the table); then nothing is written.
    pub fn collides_all(&mut self, q: &[f64], out: &mut [bool]) -> Result<(), RobotError> {
        self.model.configurations("q of all", q, out.len())?;
        self.rows(q, out)
    }

    /// As [`collides_all`](Self::collides_all), of numbers that were checked.
    fn rows(&mut self, q: &[f64], out: &mut [bool]) -> Result<(), RobotError> {
        let nq = self.q.len();
        for (k, out) in out.iter_mut().enumerate() {
            *out = self.collides(&q[k * nq..(k + 1) * nq])?;
        }
        Ok(())
    }
}

/// As [`Robot::collides_all`] with several robots, each in a thread of its own and with an equal run of the rows: instances of one model that hold the same
/// give the same answers as one alone. Each thread is made for this call, and ends with it: that allocates.
///
/// # Errors
/// As [`Robot::collides_all`]; [`RobotError::NoRoom`] without a robot; [`RobotError::ForeignHandle`] for robots of different models. Then nothing is written.
pub fn collides_all(robots: &mut [Robot], q: &[f64], out: &mut [bool]) -> Result<(), RobotError> {
    let Some((first, rest)) = robots.split_first_mut() else {
        return Err(RobotError::NoRoom { what: "robots", wanted: 1, room: 0 });
    };
    if rest.iter().any(|r| !std::sync::Arc::ptr_eq(r.model(), first.model())) {
        return Err(RobotError::ForeignHandle);
    }
    let nq = first.q.len();
    first.model.configurations("q of all", q, out.len())?;
    let rows = out.len().div_ceil(rest.len() + 1).max(1);
    std::thread::scope(|scope| {
        let mut runs = out.chunks_mut(rows).enumerate().map(|(k, out)| {
            let from = k * rows * nq;
            (&q[from..from + out.len() * nq], out)
        });
        let own = runs.next();
        let others: Vec<_> = (rest.iter_mut().zip(runs))
            .map(|(robot, (q, out))| scope.spawn(move || robot.rows(q, out)))
            .collect();
        let done = own.map_or(Ok(()), |(q, out)| first.rows(q, out));
        others.into_iter().fold(done, |done, other| {
            let told = other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            done.and(told)
        })
    })
}
