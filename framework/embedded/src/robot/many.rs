//! Collisions at many configurations: four at a time in lanes, and as many robots as the caller has threads for.
//!
//! A block of rows is posed in lanes; then each row is asked as [`Robot::collides`] asks it, and gets the same answer.

use super::{Robot, numbers};
use crate::error::RobotError;
use linkwork_dynamics::{Batch, Lane, f64x4};

/// Memory of a block of configurations.
#[derive(Debug)]
pub(super) struct Block {
    batch: Batch<f64x4>,
    q: Vec<f64x4>,
}

impl Block {
    pub fn new(tree: &linkwork_dynamics::Tree) -> Self {
        Self { batch: Batch::new(tree), q: vec![f64x4::splat(0.0); tree.nq()] }
    }
}

impl Robot {
    /// Whether two colliders that meet touch or overlap at each of many configurations: `q` (n × nq, row after row), into `out` (n). Every answer is that of
    /// [`collides`](Self::collides), in less time; what hands hold goes with them. No allocation.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`] (its index counts from the first number of the table); then nothing is written.
    pub fn collides_all(&mut self, q: &[f64], out: &mut [bool]) -> Result<(), RobotError> {
        numbers("q of all", q, out.len() * self.q.len())?;
        self.blocks(q, out)
    }

    /// As [`collides_all`](Self::collides_all), of numbers that were checked.
    fn blocks(&mut self, q: &[f64], out: &mut [bool]) -> Result<(), RobotError> {
        let nq = self.q.len();
        for (b, out) in out.chunks_mut(f64x4::WIDTH).enumerate() {
            // What is missing of the last block is a copy of its last row.
            let row = |lane: usize| (b * f64x4::WIDTH + lane.min(out.len() - 1)) * nq;
            let Block { batch, q: lanes } = &mut self.collide.block;
            for (i, lanes) in lanes.iter_mut().enumerate() {
                *lanes = f64x4::gather(|lane| q[row(lane) + i]);
            }
            batch.poses(&self.tree, lanes);
            for (lane, out) in out.iter_mut().enumerate() {
                let memory = &mut self.collide;
                memory.block.batch.state_poses(lane, &mut memory.ws);
                *out = self.hit_as_posed()?.is_some();
            }
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
    numbers("q of all", q, out.len() * nq)?;
    let rows = out.len().div_ceil(rest.len() + 1).max(1);
    std::thread::scope(|scope| {
        let mut runs = out.chunks_mut(rows).enumerate().map(|(k, out)| {
            let from = k * rows * nq;
            (&q[from..from + out.len() * nq], out)
        });
        let own = runs.next();
        let others: Vec<_> = (rest.iter_mut().zip(runs))
            .map(|(robot, (q, out))| scope.spawn(move || robot.blocks(q, out)))
            .collect();
        let done = own.map_or(Ok(()), |(q, out)| first.blocks(q, out));
        others.into_iter().fold(done, |done, other| {
            let told = other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            done.and(told)
        })
    })
}
