//! Two frames: the path between them, and the last results along it.
//!
//! The path goes from A inward to the nearest common ancestor C and outward to B. Frames inward of C are not used, so two frames of one rover on a
//! distant planet do not lose accuracy because of the distance.

use super::edge::{Edge, Level, State};
use super::relative::{self, RelativeFrame};
use super::{Counts, FrameId};
use linkwork_spatial::{Motion, Pose};

/// A frame on the path, relative to C.
#[derive(Clone, Debug)]
struct Step {
    frame: usize,
    seen: RelativeFrame,
}

#[derive(Clone, Debug)]
pub(super) struct Path {
    pub a: FrameId,
    pub b: FrameId,
    /// Frames from C outward to A, and to B, without C.
    to_a: Vec<Step>,
    to_b: Vec<Step>,
    /// The structure for which the path was determined.
    structure: u64,
    /// Time of the last computation of each level, and of the last check whether one is due.
    computed: [u64; 3],
    looked: [u64; 3],
    pub X: Pose,
    pub V: Motion,
    pub A: Motion,
}

impl Path {
    pub fn new(a: FrameId, b: FrameId) -> Self {
        Self {
            a,
            b,
            to_a: Vec::new(),
            to_b: Vec::new(),
            structure: 0,
            computed: [0; 3],
            looked: [0; 3],
            X: Pose::identity(),
            V: Motion::zero(),
            A: Motion::zero(),
        }
    }

    /// Determines the path if the structure has changed. O(depth).
    pub fn route(&mut self, edges: &[Edge], structure: u64) {
        if self.structure == structure {
            return;
        }
        let inward = |frame: FrameId| {
            let mut path = vec![frame.index()];
            while let Some(edge) = path.last().filter(|f| **f != 0).map(|f| &edges[*f]) {
                path.push(edge.parent);
            }
            path
        };
        let (mut a, mut b) = (inward(self.a), inward(self.b));
        while a.len() > 1 && b.len() > 1 && a[a.len() - 2] == b[b.len() - 2] {
            a.pop();
            b.pop();
        }
        let steps = |path: Vec<usize>| {
            let outward = path.into_iter().rev().skip(1);
            outward.map(|frame| Step { frame, seen: RelativeFrame::default() }).collect()
        };
        (self.to_a, self.to_b) = (steps(a), steps(b));
        self.structure = structure;
        self.computed = [0; 3];
        self.looked = [0; 3];
    }

    /// Updates one level and the levels below it.
    pub fn refresh(
        &mut self,
        level: Level,
        edges: &mut [Edge],
        states: &[State],
        now: u64,
        counts: &mut Counts,
    ) {
        let i = level as usize;
        if self.looked[i] == now {
            return;
        }
        match level {
            Level::Pose => {}
            Level::Velocity => self.refresh(Level::Pose, edges, states, now, counts),
            Level::Acceleration => self.refresh(Level::Velocity, edges, states, now, counts),
        }
        self.looked[i] = now;
        let path = self.to_a.iter().chain(&self.to_b);
        let last = path.map(|s| edges[s.frame].changed[i]).max().unwrap_or(1);
        if self.computed[i] >= last {
            return;
        }
        self.computed[i] = now;
        for steps in [&mut self.to_a, &mut self.to_b] {
            let mut before = RelativeFrame::default();
            for step in steps {
                let edge = &mut edges[step.frame];
                counts.edges[i] += u64::from(edge.refresh(level, states, now));
                match level {
                    Level::Pose => before.pose(&edge.X, &mut step.seen),
                    Level::Velocity => before.velocity(&edge.V, &mut step.seen),
                    Level::Acceleration => before.acceleration(&edge.V, &edge.A, &mut step.seen),
                }
                before = step.seen;
            }
        }
        counts.pairs[i] += 1;
        let end = |steps: &[Step]| steps.last().map_or_else(RelativeFrame::default, |s| s.seen);
        let (a, b) = (end(&self.to_a), end(&self.to_b));
        match level {
            Level::Pose => self.X = relative::pose(&a, &b),
            Level::Velocity => self.V = relative::velocity(&a, &b),
            Level::Acceleration => self.A = relative::acceleration(&a, &b),
        }
    }
}
