//! `flight.hazard_map`: hazard detection. It maps slope and roughness of the ground under a lander, and selects a safe landing site near the centre
//! of the map.
//! ```text
//! middle    p + `lead` v, the horizontal part: the map is square, 2 `radius` wide, about the node of the lattice next to it
//! disc      nodes of a lattice of `spacing` within `footprint` of a place: heights h_k = h(x_k, y_k) + σ n_k
//! plane     h = a + b x + c y by least squares      slope = atan √(b² + c²)      roughness = max |h_k − a − b x_k − c y_k|
//! danger    the greater of slope/slope_max and roughness/roughness_max; without ground in the disc it is infinite
//! place     of those with a danger of no more than 1, that with the least (danger)² + (distance from the middle/radius)²
//! ```
//! If no place is safe, `found` is false and the place with the least danger is selected; without any ground `aimed` is false, too. The map is made
//! at the first sample and then kept, so a part that a phase adds makes its map when the phase begins. Terrain and map have the axes of W with z up:
//! use the model at a site, and for maps that are small compared with the planet. Occlusion is not modelled. n_k is the instrument noise, one number
//! per node of the lattice. The map costs (2 radius/spacing)² places with π (footprint/spacing)² nodes each, once.

use linkwork_spatial::Mat3;
use linkwork_surroundings::prelude::*;

/// Greatest number of nodes along a side of the map, because each node has its own noise channel.
const SIDE_MAX: f64 = 4000.0;

/// Map size, lander footprint and limits.
#[derive(Params, Clone, Debug)]
pub struct HazardMapParams {
    /// Half width of the map.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// Spacing of the nodes of the lattice.
    #[param(unit = "m", range = 1e-2..)]
    pub spacing: f64,
    /// Radius of the disc that must be safe: radius of the footpads plus landing error.
    #[param(unit = "m", range = 0.1..)]
    pub footprint: f64,
    /// Greatest safe slope.
    #[param(unit = "rad", default = 0.174, range = 1e-6..=1.5)]
    pub slope_max: f64,
    /// Greatest safe roughness: deviation of a height from the plane of the disc.
    #[param(unit = "m", default = 0.3, range = 1e-6..)]
    pub roughness_max: f64,
    /// Time over which the position of the lander is extrapolated with its velocity to the centre of the map.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub lead: f64,
    /// Standard deviation of the measured height of a node.
    #[param(unit = "m", default = 0.0, range = 0.0..)]
    pub sigma: f64,
    /// Terrain under the lander.
    #[param(service)]
    pub terrain: Handle<dyn Terrain>,
}

/// The lander.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HazardMapIn {
    /// Estimated state of the lander from navigation, W.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// Landing site.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HazardMapOut {
    /// Position of the landing site, W.
    #[port("m")]
    pub place: Vec3,
    /// The landing site is safe.
    #[port]
    pub found: bool,
    /// A site was selected: a safe one, or else the one with the least danger.
    #[port]
    pub aimed: bool,
    /// Slope of the ground at the site.
    #[port("rad")]
    pub slope: f64,
    /// Roughness of the ground at the site.
    #[port("m")]
    pub roughness: f64,
    /// Fraction of the map that is safe.
    #[port("1")]
    pub safe: f64,
}

/// Map result, kept after the first sample.
#[derive(State, Clone, Copy, Debug)]
pub struct SiteState {
    /// The map has been made.
    #[port]
    pub mapped: bool,
    /// The site is safe.
    #[port]
    pub found: bool,
    /// A site was selected.
    #[port]
    pub aimed: bool,
    /// Position of the site, W.
    #[port("m")]
    pub place: Vec3,
    /// Slope at the site.
    #[port("rad")]
    pub slope: f64,
    /// Roughness at the site.
    #[port("m")]
    pub roughness: f64,
    /// Fraction of the map that is safe.
    #[port("1")]
    pub safe: f64,
}

/// Plane fit of a disc of ground.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Disc {
    slope: f64,
    roughness: f64,
    /// Height of the fitted plane at the centre of the disc, m.
    height: f64,
}

/// Hazard detection with a map of slope and roughness.
pub struct HazardMap {
    p: HazardMapParams,
}

impl HazardMap {
    /// Returns the number of nodes from the centre of the map to its edge, and from the centre of a disc to its edge.
    fn reach(&self) -> (i32, i32) {
        let p = &self.p;
        ((p.radius / p.spacing + 1e-9) as i32, (p.footprint / p.spacing + 1e-9) as i32)
    }

    /// Calls `f` with x, y (m, from the centre of the disc) and height (m) of each node of a disc; returns false if a node has no ground.
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

    /// Returns the plane fit of the disc about node (i, j) of a map with centre (x, y) (m); `None` without ground.
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

    /// Makes the map for the state of a lander and selects the landing site.
    fn map(&self, c: &Clock, body: &NodeState) -> SiteState {
        let p = &self.p;
        let at = body.position + body.velocity * p.lead;
        let node = |x: f64| (x / p.spacing).round() * p.spacing;
        let middle = (node(at.x), node(at.y));
        let (half, _) = self.reach();
        let mut best = SiteState {
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

    /// Returns the stored result, or makes the map.
    fn now(&self, c: &Clock, d: &SiteState, body: &NodeState) -> SiteState {
        if d.mapped { *d } else { self.map(c, body) }
    }
}

/// Hazard detection: maps slope and roughness of the ground under a lander and selects a safe landing site; sampled.
#[model("flight.hazard_map")]
impl Model for HazardMap {
    type Params = HazardMapParams;
    type FeedthroughInputs = HazardMapIn;
    type FeedthroughOutputs = HazardMapOut;
    type DiscreteState = SiteState;
    fn build(p: HazardMapParams) -> Result<Self, BuildError> {
        let wrong =
            |at: &str, fact: String, help: &str| Err(BuildError::new(fact).help(help).at(at));
        if p.footprint < p.spacing {
            let fact = format!(
                "`footprint` is {} m and `spacing` {} m: a disc with a single node has no slope",
                p.footprint, p.spacing
            );
            return wrong("footprint", fact, "`spacing` must not exceed `footprint`");
        }
        let side = 2.0 * (p.radius + p.footprint) / p.spacing + 1.0;
        if side > SIDE_MAX {
            let fact = format!("the map has {side:.0} nodes along a side, more than {SIDE_MAX}");
            return wrong("spacing", fact, "increase `spacing` or reduce `radius`");
        }
        Ok(HazardMap { p })
    }
    fn init_d(&self) -> SiteState {
        let place = Vec3::zeros();
        let (mapped, found, aimed) = (false, false, false);
        SiteState { mapped, found, aimed, place, slope: 0.0, roughness: 0.0, safe: 0.0 }
    }
    fn feedthrough(&self, clock: &Clock, d: &SiteState, u: &HazardMapIn) -> HazardMapOut {
        let SiteState { found, aimed, place, slope, roughness, safe, .. } =
            self.now(clock, d, &u.body);
        HazardMapOut { place, found, aimed, slope, roughness, safe }
    }
    fn update(&self, clock: &Clock, d: &SiteState, u: &HazardMapIn) -> SiteState {
        self.now(clock, d, &u.body)
    }
}

#[cfg(test)]
#[path = "hazard_map_tests.rs"]
mod tests;
