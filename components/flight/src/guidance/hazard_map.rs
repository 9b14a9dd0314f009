//! `flight.hazard_map`: a map of the ground under a lander by slope and roughness, and the place on it that is safe and near.
//! ```text
//! middle    p + `lead` v, the horizontal part: the map is square, 2 `radius` wide, about the node of the lattice next to it
//! disc      nodes of a lattice of `spacing` within `footprint` of a place: heights h_k = h(x_k, y_k) + σ n_k
//! plane     h = a + b x + c y by least squares      slope = atan √(b² + c²)      roughness = max |h_k − a − b x_k − c y_k|
//! danger    the greater of slope/slope_max and roughness/roughness_max; without ground in the disc it is infinite
//! place     of those with a danger of no more than 1, that with the least (danger)² + (distance from the middle/radius)²
//! ```
//! Where no place is safe, `found` is false and the place is that of the least danger; without any ground `aimed` is false, too. Made at the first row, kept from there on: a part that a phase brings makes
//! its map when the phase begins. Ground and map have the axes of W, z up: for a site, and heights that are small beside a planet. What stands between the lander and
//! the ground hides nothing; n_k is noise of the instrument, one number for each node of the lattice. Cost: (2 radius/spacing)² places of π (footprint/spacing)² nodes, once.

use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;

/// Nodes of a map to a side at most: noise has a number for each.
const SIDE_MAX: f64 = 4000.0;

/// Map, lander and limits.
#[derive(Params, Clone, Debug)]
pub struct HazardMapParams {
    /// Half of the width of the map.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// Distance of two nodes of the lattice.
    #[param(unit = "m", range = 1e-2..)]
    pub spacing: f64,
    /// Radius of the disc that the lander needs: its feet, and what it may miss the place by.
    #[param(unit = "m", range = 0.1..)]
    pub footprint: f64,
    /// Greatest slope that is safe.
    #[param(unit = "rad", default = 0.174, range = 1e-6..=1.5)]
    pub slope_max: f64,
    /// Greatest height over the plane of the disc that is safe.
    #[param(unit = "m", default = 0.3, range = 1e-6..)]
    pub roughness_max: f64,
    /// Time over which the lander goes on as it moves, to the middle of the map.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub lead: f64,
    /// Standard deviation of the height of a node.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub sigma: f64,
    /// The ground.
    #[param(service)]
    pub terrain: Handle<dyn Terrain>,
}

/// The lander.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HazardMapIn {
    /// The lander, as navigation knows it, W.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// The place.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HazardMapOut {
    /// Where to land, W.
    #[port("m")]
    pub place: Vec3,
    /// It is safe.
    #[port]
    pub found: bool,
    /// There is a place: a safe one, or that of the least danger.
    #[port]
    pub aimed: bool,
    /// Slope of the ground there.
    #[port("rad")]
    pub slope: f64,
    /// Roughness there.
    #[port("m")]
    pub roughness: f64,
    /// Share of the map's places that are safe.
    #[port("1")]
    pub safe: f64,
}

/// What was found.
#[derive(State, Clone, Copy, Debug)]
pub struct Found {
    /// There is a map.
    #[port]
    pub mapped: bool,
    /// The place is safe.
    #[port]
    pub found: bool,
    /// There is a place.
    #[port]
    pub aimed: bool,
    /// Where, W.
    #[port("m")]
    pub place: Vec3,
    /// Slope there.
    #[port("rad")]
    pub slope: f64,
    /// Roughness there.
    #[port("m")]
    pub roughness: f64,
    /// Share of the places that are safe.
    #[port("1")]
    pub safe: f64,
}

/// A disc of ground.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Disc {
    slope: f64,
    roughness: f64,
    /// Height of its plane in the middle, m.
    height: f64,
}

/// A map of hazards.
pub struct HazardMap {
    p: HazardMapParams,
}

impl HazardMap {
    /// Nodes from the middle of the map to its edge, and of a disc to its edge.
    fn reach(&self) -> (i32, i32) {
        let p = &self.p;
        ((p.radius / p.spacing + 1e-9) as i32, (p.footprint / p.spacing + 1e-9) as i32)
    }

    /// Calls `f` with x, y (m, from the middle of the disc) and height (m) of each node of a disc; false where there is no ground.
    fn nodes(
        &self,
        c: &Clock,
        (x, y): (f64, f64),
        (i, j): (i32, i32),
        mut f: impl FnMut(f64, f64, f64),
    ) -> bool {
        let (half, reach) = self.reach();
        let (h, most) = (self.p.spacing, self.p.footprint / self.p.spacing + 1e-9);
        let side = 2 * (half + reach) + 1;
        for a in -reach..=reach {
            for b in -reach..=reach {
                if f64::from(a * a + b * b).sqrt() > most {
                    continue;
                }
                let (k, l) = (i + a, j + b);
                let Some(g) = self.p.terrain.ground(x + f64::from(k) * h, y + f64::from(l) * h)
                else {
                    return false;
                };
                let lane = (k + half + reach) * side + l + half + reach;
                let noise =
                    if self.p.sigma > 0.0 { self.p.sigma * c.normal(lane as u32) } else { 0.0 };
                f(f64::from(a) * h, f64::from(b) * h, g.height + noise);
            }
        }
        true
    }

    /// The disc about node (i, j) of a map with its middle at (x, y) (m); none without ground.
    fn disc(&self, c: &Clock, middle: (f64, f64), node: (i32, i32)) -> Option<Disc> {
        let (mut normal, mut right) = (Mat3::zeros(), Vec3::zeros());
        let whole = self.nodes(c, middle, node, |x, y, h| {
            let row = Vec3::new(1.0, x, y);
            normal += row * row.transpose();
            right += row * h;
        });
        let plane = if whole { normal.try_inverse()? * right } else { return None };
        let mut roughness = 0.0_f64;
        self.nodes(c, middle, node, |x, y, h| {
            roughness = roughness.max((h - plane.x - plane.y * x - plane.z * y).abs());
        });
        Some(Disc { slope: plane.y.hypot(plane.z).atan(), roughness, height: plane.x })
    }

    /// The place of a map made from where a lander is.
    fn map(&self, c: &Clock, body: &NodeState) -> Found {
        let p = &self.p;
        let at = body.position + body.velocity * p.lead;
        let node = |x: f64| (x / p.spacing).round() * p.spacing;
        let middle = (node(at.x), node(at.y));
        let (half, _) = self.reach();
        let mut best = Found {
            mapped: true,
            found: false,
            aimed: false,
            place: Vec3::new(middle.0, middle.1, 0.0),
            slope: 0.0,
            roughness: 0.0,
            safe: 0.0,
        };
        let (mut least, mut safe) = (f64::INFINITY, 0_u32);
        for i in -half..=half {
            for j in -half..=half {
                let Some(d) = self.disc(c, middle, (i, j)) else { continue };
                let danger = (d.slope / p.slope_max).max(d.roughness / p.roughness_max);
                let good = danger <= 1.0;
                safe += u32::from(good);
                let far = f64::from(i * i + j * j) * (p.spacing / p.radius).powi(2);
                let cost = if good { danger * danger + far } else { danger };
                if (good && !best.found) || (good == best.found && cost < least) {
                    let (x, y) = (f64::from(i) * p.spacing, f64::from(j) * p.spacing);
                    best.place = Vec3::new(middle.0 + x, middle.1 + y, d.height);
                    (best.slope, best.roughness) = (d.slope, d.roughness);
                    (best.found, best.aimed, least) = (good, true, cost);
                }
            }
        }
        best.safe = f64::from(safe) / f64::from(2 * half + 1).powi(2);
        best
    }

    /// What was found, or is now.
    fn now(&self, c: &Clock, d: &Found, body: &NodeState) -> Found {
        if d.mapped { *d } else { self.map(c, body) }
    }
}

/// A map of slope and roughness under a lander, and the place that is safe and near; sampled.
#[model("flight.hazard_map")]
impl Model for HazardMap {
    type Params = HazardMapParams;
    type FeedthroughInputs = HazardMapIn;
    type FeedthroughOutputs = HazardMapOut;
    type DiscreteState = Found;
    fn build(p: HazardMapParams) -> Result<Self, BuildError> {
        let wrong =
            |at: &str, fact: String, help: &str| Err(BuildError::new(fact).help(help).at(at));
        if p.footprint < p.spacing {
            let fact = format!(
                "a disc of {} m has one node of a lattice of {} m: it has no slope",
                p.footprint, p.spacing
            );
            return wrong("footprint", fact, "write a smaller `spacing`");
        }
        let side = 2.0 * (p.radius + p.footprint) / p.spacing + 1.0;
        if side > SIDE_MAX {
            let fact = format!("the map has {side:.0} nodes to a side, more than {SIDE_MAX}");
            return wrong("spacing", fact, "write a greater `spacing` or a smaller `radius`");
        }
        Ok(HazardMap { p })
    }
    fn init_d(&self) -> Found {
        let place = Vec3::zeros();
        let (mapped, found, aimed) = (false, false, false);
        Found { mapped, found, aimed, place, slope: 0.0, roughness: 0.0, safe: 0.0 }
    }
    fn feedthrough(&self, clock: &Clock, d: &Found, u: &HazardMapIn) -> HazardMapOut {
        let Found { found, aimed, place, slope, roughness, safe, .. } = self.now(clock, d, &u.body);
        HazardMapOut { place, found, aimed, slope, roughness, safe }
    }
    fn update(&self, clock: &Clock, d: &Found, u: &HazardMapIn) -> Found {
        self.now(clock, d, &u.body)
    }
}

#[cfg(test)]
#[path = "hazard_map_tests.rs"]
mod tests;
