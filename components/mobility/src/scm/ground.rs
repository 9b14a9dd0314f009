//! `mobility.scm_ground`: the nodes of deformable ground as a field that wheels and feet read and deform.

use crate::changed::Changed;
use crate::multipass::Unloading;
use crate::rigid_contact::Hub;
use crate::scm::contact::{Damping, GroundLoad, Law, Node, Sum};
use crate::scm::heap::{Heap, Heaps};
use crate::scm::shape::{Form, Presser};
use crate::tiles;
use linkwork_surroundings::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Nodes along the edge of a tile.
const EDGE: usize = 16;

/// Tiles of nodes.
pub type Nodes = tiles::Tiles<Node, EDGE>;

/// Parameters of the ground.
#[derive(Params, Clone, Debug)]
pub struct ScmGroundParams {
    /// Spacing of nodes.
    #[param(unit = "m", default = 0.025, range = 0.002..=1.0)]
    pub cell: f64,
    /// x_min, y_min, x_max, y_max (m) of the deformable ground; default: the whole terrain. Outside it carries nothing.
    #[param(default = None)]
    pub region: Option<[f64; 4]>,
    /// Stiffness of loaded soil at depth zero, N/m³.
    #[param(default = 0.0, range = 0.0..)]
    pub stiffness: f64,
    /// Increase of the stiffness of loaded soil with depth, N/m⁴; the default is Wong's value for LETE sand.
    #[param(default = 5.03e8, range = 0.0..)]
    pub stiffness_growth: f64,
    /// Ratio of the shear stiffness during unloading to the stiffness during loading.
    #[param(default = 20.0, range = 1.0..=1000.0)]
    pub shear_unloading: f64,
    /// Fraction of the displaced soil that is heaped up around the body; the rest is compacted.
    #[param(default = 0.3, range = 0.0..=1.0)]
    pub bulldozing: f64,
    /// Slope at which heaped soil slides.
    #[param(unit = "rad", default = 0.6109, range = 0.05..1.4, needs = "bulldozing")]
    pub repose: f64,
    /// The ground.
    #[param(service)]
    pub terrain: Handle<dyn Terrain>,
}

/// A body on the ground. A radius and length of zero mean that there is no body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Imprint {
    /// Centre of the wheel or sole, W.
    #[port("m")]
    pub print_middle: Vec3,
    /// Unit vector of the axle of a wheel, or of the upward normal of a sole, W.
    #[port("1")]
    pub print_axle: Vec3,
    /// Unit vector along the length of a rectangular sole, W.
    #[port("1")]
    pub print_along: Vec3,
    /// Velocity of the middle, W.
    #[port("m/s")]
    pub print_velocity: Vec3,
    /// Angular velocity, W.
    #[port("rad/s")]
    pub print_angular: Vec3,
    /// Radius of a wheel or of a round sole; 0 for a rectangular one.
    #[port("m")]
    pub print_radius: f64,
    /// Width of a wheel or of a rectangular sole; 0 for a round one.
    #[port("m")]
    pub print_width: f64,
    /// Length of a rectangular sole; 0 for others.
    #[port("m")]
    pub print_length: f64,
    /// Slip of a wheel, −1 to 1.
    #[port("1")]
    pub print_slip: f64,
}

impl Imprint {
    /// Creates the imprint of a body.
    pub fn of(p: &Presser, slip: f64) -> Imprint {
        let (radius, width, length) = match p.form {
            Form::Rim { radius, width } => (radius, width, 0.0),
            Form::Disc { radius } => (radius, 0.0, 0.0),
            Form::Plate { length, width } => (0.0, width, length),
        };
        Imprint {
            print_middle: p.hub.position,
            print_axle: p.hub.axle,
            print_along: p.along,
            print_velocity: p.hub.velocity,
            print_angular: p.hub.angular,
            print_radius: radius,
            print_width: width,
            print_length: length,
            print_slip: slip,
        }
    }

    /// Returns the pressing body; `None` if its numbers are not finite.
    pub fn presser(&self) -> Option<Presser> {
        let (radius, width, length) = (self.print_radius, self.print_width, self.print_length);
        let form = match (radius > 0.0, width > 0.0, length > 0.0) {
            (true, true, _) => Form::Rim { radius, width },
            (true, false, _) => Form::Disc { radius },
            (false, true, true) => Form::Plate { length, width },
            _ => return None,
        };
        let hub = Hub {
            position: self.print_middle,
            axle: self.print_axle,
            velocity: self.print_velocity,
            angular: self.print_angular,
        };
        let finite = |v: &Vec3| v.iter().all(|c| c.is_finite());
        let sound = finite(&hub.position) && finite(&hub.velocity) && finite(&hub.angular);
        (sound && finite(&hub.axle)).then_some(Presser { form, hub, along: self.print_along })
    }
}

/// Data of the field: loaded nodes, and the time of their last update.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Touched {
    /// The nodes.
    pub nodes: Nodes,
    /// Time of their last update, s.
    pub time: f64,
    /// Displaced soil of each body that has not been heaped yet, m³.
    pub waiting: Vec<f64>,
}

impl Shows for Touched {
    const KIND: &'static str = "scm_ground";
}

/// Deformable ground.
pub struct ScmGround {
    /// Spacing of nodes, m.
    pub cell: f64,
    /// x_min, y_min, x_max, y_max, m.
    pub region: [f64; 4],
    /// Stiffness of pressed soil.
    pub unloading: Unloading,
    /// Ratio of the shear stiffness during unloading to that during loading.
    pub shear_unloading: f64,
    /// Settings of heaps of displaced soil.
    pub heaps: Heaps,
    terrain: Handle<dyn Terrain>,
}

impl ScmGround {
    /// Returns first and last column and row of the nodes of the region in a box (m); `None`: there are none.
    fn span(&self, bounds: [f64; 4]) -> Option<([i32; 2], [i32; 2])> {
        let r = self.region;
        let low = [0, 1].map(|k| (bounds[k].max(r[k]) / self.cell).ceil());
        let high = [2, 3].map(|k| (bounds[k].min(r[k]) / self.cell).floor());
        // The range is empty for NaN and for distant positions, because these comparisons are
        // false.
        let some = (0..2).all(|k| low[k].abs() < 1e9 && high[k].abs() < 1e9 && low[k] <= high[k]);
        some.then(|| (low.map(|v| v as i32), high.map(|v| v as i32)))
    }

    /// Place of a node, m.
    pub fn place(&self, i: i32, j: i32) -> [f64; 2] {
        [f64::from(i) * self.cell, f64::from(j) * self.cell]
    }

    /// Returns an undisturbed node.
    pub fn fresh(&self, at: [f64; 2]) -> Node {
        let mut first = [[f64::NAN; 3]];
        self.terrain.relief(&[at], &mut first);
        Node { first: first[0].map(|v| v as f32), ..Node::default() }
    }

    /// Returns the load on a body at the time `t` (s).
    pub fn load(
        &self,
        data: &Touched,
        presser: &Presser,
        law: &Law,
        damping: &Damping,
        t: f64,
    ) -> GroundLoad {
        let age = (t - data.time).max(0.0);
        let mut sum = Sum::new(presser, law, damping, self.shear_unloading, age, self.cell);
        let Some((from, to)) = self.span(presser.bounds(self.cell)) else { return sum.load() };
        for part in Nodes::parts(from, to) {
            let tile = data.nodes.tile(part.tile);
            for j in part.from[1]..=part.to[1] {
                for i in part.from[0]..=part.to[0] {
                    let [x, y] = self.place(i, j);
                    let node = match tile.map(|nodes| &nodes[Nodes::place(i, j)]) {
                        Some(node) if node.known() => *node,
                        // This is ground that no update has touched yet.
                        _ => self.fresh([x, y]),
                    };
                    if presser.clears(x, y, f64::from(node.first[0] + node.heap)) {
                        continue;
                    }
                    if let Some(under) = presser.under(x, y, self.cell) {
                        sum.add(&node, x, y, &under);
                    }
                }
            }
        }
        sum.load()
    }

    /// Loads the nodes under a body for a time `dt` (s); returns the displaced volume (m³, in vertical projection) and the loaded area.
    pub fn press(
        &self,
        data: &mut Touched,
        presser: &Presser,
        law: &Law,
        dt: f64,
    ) -> (f64, Option<Heap>) {
        let Some((from, to)) = self.span(presser.bounds(self.cell)) else { return (0.0, None) };
        let (mut volume, mut heap) = (0.0, None::<Heap>);
        let hub = &presser.hub;
        for part in Nodes::parts(from, to) {
            let nodes = data.nodes.tile_mut(part.tile);
            for j in part.from[1]..=part.to[1] {
                for i in part.from[0]..=part.to[0] {
                    let [x, y] = self.place(i, j);
                    let node = &mut nodes[Nodes::place(i, j)];
                    if !node.known() {
                        *node = self.fresh([x, y]);
                    }
                    let under = match presser.clears(x, y, f64::from(node.first[0] + node.heap)) {
                        true => None,
                        false => presser.under(x, y, self.cell),
                    };
                    let Some(under) = under else {
                        node.release();
                        continue;
                    };
                    let base = node.base();
                    let sinkage = (base.height - under.z) * base.normal.z;
                    // The negated comparison also skips NaN.
                    if !(sinkage > 0.0) {
                        node.release();
                        continue;
                    }
                    let grown = law.press(node, sinkage, &self.unloading);
                    volume += grown * under.share * self.cell * self.cell / base.normal.z;
                    let p = law.pressure(node, sinkage);
                    if p > 0.0 {
                        let d = Vec3::new(x, y, under.z) - hub.position;
                        let v = hub.velocity + hub.angular.cross(&d);
                        let n = under.normal;
                        let step = (v - n * n.dot(&v)) * dt;
                        let (tau, called) = law.sheared(node, step, &n, p, self.shear_unloading);
                        node.shear = [tau.x as f32, tau.y as f32, tau.z as f32];
                        node.mobilised = called as f32;
                        heap = Some(heap.map_or_else(|| Heap::at(i, j), |h| h.with(i, j)));
                    } else {
                        node.release();
                    }
                }
            }
        }
        (volume, heap)
    }

    /// Returns the nodes that differ from the terrain: position and height of the surface (m), in a fixed order.
    pub fn changed<'a>(
        &'a self,
        data: &'a Touched,
    ) -> impl Iterator<Item = ([f64; 2], f64, &'a Node)> + 'a {
        let touched = |n: &Node| n.known() && (n.heap != 0.0 || n.pressed[2] > 0.0);
        let nodes = data.nodes.cells().filter(move |(_, n)| touched(n));
        nodes.map(|([i, j], n)| (self.place(i, j), n.surface(), n))
    }
}

/// Deformable ground: nodes with sinkage, heaps and shear. Wheels of `mobility.wheel_scm` and feet of `mobility.foot` deform them at the ticks of
/// this part and read their state after the last row. Choose a rate at which a body moves less than a tenth of the node spacing per tick.
#[field("mobility.scm_ground")]
impl Field for ScmGround {
    type Params = ScmGroundParams;
    type Data = Touched;
    type Imprint = Imprint;
    fn build(p: ScmGroundParams) -> Result<Self, BuildError> {
        p.terrain.needs_soil()?;
        let region = p.region.unwrap_or_else(|| p.terrain.bounds());
        crate::ruts::check_region(region)?;
        Ok(ScmGround {
            cell: p.cell,
            region,
            unloading: Unloading { k0: p.stiffness, growth: p.stiffness_growth },
            shear_unloading: p.shear_unloading,
            heaps: Heaps { share: p.bulldozing, slope: p.repose.tan() },
            terrain: p.terrain,
        })
    }
    fn start(&self) -> Touched {
        Touched::default()
    }
    fn update(&self, c: &Clock, data: &mut Touched, prints: &[Imprint], _: &[f64]) {
        data.waiting.resize(prints.len(), 0.0);
        for (k, print) in prints.iter().enumerate() {
            let Some(presser) = print.presser() else { continue };
            let at = presser.hub.position;
            let soil = self.terrain.soil(at.x, at.y);
            let law = Law::of(soil, presser.narrow(), print.print_slip);
            let (volume, pressed) = self.press(data, &presser, &law, c.dt);
            data.waiting[k] += volume * self.heaps.share;
            if let Some(pressed) = pressed {
                self.heaps.heap(self, data, k, &pressed, &presser);
            }
        }
        data.time = c.t;
    }
    fn overlay(&self, data: &Touched) -> Option<SharedOverlay> {
        let change = |node: &Node, _: [f64; 2]| match node.known() {
            true => (node.surface() - f64::from(node.first[0])) as f32,
            false => 0.0,
        };
        let (tiles, cell) = (data.nodes.clone(), self.cell);
        Some(Arc::new(Changed { tiles, cell, middle: 0.0, change: Box::new(change) }))
    }
}

#[cfg(test)]
#[path = "ground_tests.rs"]
mod tests;
