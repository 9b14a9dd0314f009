//! Heaps of displaced soil: the soil is added to the nodes around the body and slides down slopes that are too steep.
//! ```text
//! ring       nodes up to two beside those that are pressed; ahead and at the sides, not behind where the body comes from
//! sliding    between neighbours a, b:  |S_a − S_b| > δ tan(repose):  heap moves by a quarter of what is too much, five times
//! ```
//! S is the surface without load. The moved volume is subtracted at one node and added at another as one number, so that the total is conserved.
//! Displaced soil is collected until it gives a sufficiently thick layer on the ring. Slopes of the undisturbed terrain do not slide.

use crate::scm::contact::Node;
use crate::scm::ground::{Nodes, ScmGround, Touched};
use crate::scm::heap::{Heap, Heaps};
use crate::scm::shape::Presser;

/// Number of nodes around the loaded ones on which soil may slide.
const AROUND: i32 = 6;
/// Nodes of the ring.
const RING: i32 = 2;
/// Times that soil slides.
const TIMES: usize = 5;
/// Least thickness of a layer on the ring, m.
const LAYER: f64 = 2e-4;

/// A window of nodes, copied.
struct Window {
    from: [i32; 2],
    size: [usize; 2],
    nodes: Vec<Node>,
    /// Under the body.
    pressed: Vec<bool>,
}

impl Heaps {
    /// Heaps the collected soil of the body `k`, which loads the nodes `pressed`, if there is enough of it.
    pub fn heap(
        &self,
        ground: &ScmGround,
        data: &mut Touched,
        k: usize,
        pressed: &Heap,
        presser: &Presser,
    ) {
        let cell = ground.cell;
        let [w, h] = [0, 1].map(|k| f64::from(pressed.to[k] - pressed.from[k] + 1));
        let ring = 2.0 * f64::from(RING) * (w + h) * cell * cell;
        if data.waiting[k] < LAYER * ring {
            return;
        }
        let mut window = Window::of(ground, data, pressed, presser);
        let open = window.ring(ground, presser);
        if open.is_empty() {
            return;
        }
        let layer = (data.waiting[k] / (open.len() as f64 * cell * cell)) as f32;
        let mut heaped = 0.0;
        for at in open {
            let node = &mut window.nodes[at];
            let before = node.heap;
            node.heap += layer;
            heaped += f64::from(node.heap) - f64::from(before);
        }
        data.waiting[k] -= heaped * cell * cell;
        for _ in 0..TIMES {
            window.slide(cell, self.slope);
        }
        window.put_back(data);
    }
}

impl Window {
    fn of(ground: &ScmGround, data: &Touched, pressed: &Heap, presser: &Presser) -> Window {
        let from = pressed.from.map(|v| v - AROUND);
        let size = [0, 1].map(|k| (pressed.to[k] - pressed.from[k] + 1 + 2 * AROUND) as usize);
        let count = size[0] * size[1];
        let mut out = Window { from, size, nodes: Vec::new(), pressed: vec![false; count] };
        for at in 0..count {
            let [i, j] = out.index(at);
            let place = ground.place(i, j);
            let node = match data.nodes.get(i, j) {
                Some(node) if node.known() => *node,
                _ => ground.fresh(place),
            };
            let under = presser.under(place[0], place[1], ground.cell);
            out.pressed[at] = under.is_some_and(|u| u.z < node.base().height);
            out.nodes.push(node);
        }
        out
    }

    /// Returns column and row of a node.
    fn index(&self, at: usize) -> [i32; 2] {
        [self.from[0] + (at % self.size[0]) as i32, self.from[1] + (at / self.size[0]) as i32]
    }

    /// Returns the nodes next to the nodes under the body, except for those behind it.
    fn ring(&self, ground: &ScmGround, presser: &Presser) -> Vec<usize> {
        let (v, c) = (presser.hub.velocity, presser.hub.position);
        let speed = v.x.hypot(v.y);
        let near = |at: usize| {
            let (i, j) = ((at % self.size[0]) as i32, (at / self.size[0]) as i32);
            (-RING..=RING).any(|b| {
                (-RING..=RING).any(|a| {
                    let (i, j) = (i + a, j + b);
                    i >= 0
                        && j >= 0
                        && i < self.size[0] as i32
                        && j < self.size[1] as i32
                        && self.pressed[j as usize * self.size[0] + i as usize]
                })
            })
        };
        let ahead = |at: usize| {
            let [i, j] = self.index(at);
            let [x, y] = ground.place(i, j);
            speed < 1e-3 || (x - c.x) * v.x + (y - c.y) * v.y >= 0.0
        };
        let whole = |at: usize| self.nodes[at].known();
        (0..self.nodes.len())
            .filter(|at| !self.pressed[*at] && whole(*at) && ahead(*at) && near(*at))
            .collect()
    }

    /// Moves soil between neighbours once.
    fn slide(&mut self, cell: f64, slope: f64) {
        let [nx, ny] = self.size;
        let most = cell * slope;
        for j in 0..ny {
            for i in 0..nx {
                let a = j * nx + i;
                let right = (i + 1 < nx).then_some(a + 1);
                let above = (j + 1 < ny).then_some(a + nx);
                for b in [right, above].into_iter().flatten() {
                    if self.pressed[a] || self.pressed[b] {
                        continue;
                    }
                    let (one, other) = (&self.nodes[a], &self.nodes[b]);
                    let fall = one.surface() - other.surface();
                    let first = f64::from(one.first[0]) - f64::from(other.first[0]);
                    let over = fall.abs() - most.max(first.abs());
                    // The negated comparison also skips missing ground (NaN).
                    if !(over > 0.0) {
                        continue;
                    }
                    let moved = (0.25 * over * fall.signum()) as f32;
                    self.nodes[a].heap -= moved;
                    self.nodes[b].heap += moved;
                }
            }
        }
    }

    fn put_back(&self, data: &mut Touched) {
        for (at, node) in self.nodes.iter().enumerate() {
            let [i, j] = self.index(at);
            let was = data.nodes.get(i, j);
            // Keep a node, too, whose height was queried in the meantime.
            if was.is_none_or(|was| !was.known() || was.heap != node.heap) {
                let (tile, k) = Nodes::split(i, j);
                data.nodes.tile_mut(tile)[k] = *node;
            }
        }
    }
}

#[cfg(test)]
#[path = "heaps_tests.rs"]
mod tests;
