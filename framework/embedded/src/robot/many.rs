//! Collision checks of many configurations, optionally in several threads.
//!
//! Within one configuration the bounding spheres of shapes are compared in SIMD lanes (`framework/collision`). Lanes over configurations were
//! measured and are not faster: computing the poses takes only one fortieth of the time, and after the bounding spheres each configuration needs
//! different work.

use super::Robot;
use crate::error::RobotError;

impl Robot {
    /// Writes for each of n configurations whether checked colliders touch or overlap. `q` has n × nq numbers, row after row; `out` has n. Each
    /// result equals that of [`collides`](Self::collides); held objects move with the hands. No allocation.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::ZeroQuaternion`] (with an index from the first number of the table). After an
    /// error no output is written.
    pub fn collides_all(&mut self, q: &[f64], out: &mut [bool]) -> Result<(), RobotError> {
        self.model.configurations("q of all", q, out.len())?;
        self.rows(q, out)
    }

    /// Like [`collides_all`](Self::collides_all), for numbers that are already checked.
    fn rows(&mut self, q: &[f64], out: &mut [bool]) -> Result<(), RobotError> {
        let nq = self.q.len();
        for (k, out) in out.iter_mut().enumerate() {
            *out = self.collides(&q[k * nq..(k + 1) * nq])?;
        }
        Ok(())
    }
}

/// Like [`Robot::collides_all`], but with several robots, each in its own thread with an equal share of the rows. Instances of one model that hold
/// the same objects return the same results as a single instance. The threads are created for this call and end with it, which allocates.
///
/// # Errors
/// Like [`Robot::collides_all`]; [`RobotError::NoRoom`] without a robot; [`RobotError::ForeignHandle`] for robots of different models. After an error
/// no output is written.
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
