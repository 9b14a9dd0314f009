//! `flight.crushable_leg`: landing leg with a honeycomb absorber that crushes irreversibly, and contact of its foot with the ground.
//! ```text
//! s = (h − z) n_z of the foot: how far the foot would be in the ground if the leg were rigid
//! h, n: height and normal of the ground under the foot: of the terrain, or of the plane z = `ground`
//! c = greatest s so far that was crushed: honeycomb does not come back
//! F = k (s − c) + d ṡ, at most the force of the stage at c; where it is more, the honeycomb crushes: ċ = (…)₊
//! with a pad of radius b the soil gives way, too (Bekker), and does not come back: s − c − z in place of s − c, F at most
//!     π b² (k_c/b + k_φ) zⁿ  of the sinkage z so far; where it is more, the pad sinks: ż = (…)₊
//! stages: (stroke, force), soft before hard; after the last one the leg is solid: F = k (s − c)
//! along the ground: q = k_t z + d_t v_t pulls back; where |q| > μ F the foot slips at u = (|q| − μ F)/(d_u + d_t) along q:
//! force on the foot: F n − q, or F n − (μ F + d_u u) q/|q|          ż = v_t − u q/|q|, ṡ = −v·n
//! ```
//! k is the elastic stiffness of strut and soil, so that contact begins without a jump of the force. The crushed length c is a state that follows ċ =
//! max(0, (F_free − F_stage)/d_c), a fast creep that exceeds the force of the stage by d_c ċ only. The coefficient d_u regularizes friction in the
//! same way; a foot at rest on a slope does not creep. In the air the tangential deflection z decays with the time constant d_u/k_t. Touchdown and
//! lift-off are events. There is no ground outside the map of a terrain.

use linkwork_surroundings::needs_level_ground;
use linkwork_surroundings::prelude::*;

/// One stage of the honeycomb.
#[derive(Params, Clone, Copy, Debug)]
pub struct Stage {
    /// Stroke of the stage.
    #[param(unit = "m", range = 1e-6..)]
    pub stroke: f64,
    /// Crush force.
    #[param(unit = "N", range = 0.0..)]
    pub force: f64,
}

/// Depth of the foot outside the map, m: far above the ground.
const NOWHERE: f64 = -1e6;

/// Parameters of a landing leg.
#[derive(Params, Clone, Debug)]
pub struct LegParams {
    /// Stages in the order in which they crush.
    pub stages: Vec<Stage>,
    /// Stiffness k of strut and ground.
    #[param(unit = "N/m", default = 1e6, range = 1.0..)]
    pub stiffness: f64,
    /// Damping d of strut and ground.
    #[param(unit = "N s/m", default = 0.0, range = 0.0..)]
    pub damping: f64,
    /// Creep coefficient d_c: force above the crush force per crushing speed.
    #[param(unit = "N s/m", default = 100.0, range = 1e-3..)]
    pub creep: f64,
    /// Height of a plane as the ground, W; default: the terrain, or z = 0 without a terrain.
    #[param(unit = "m")]
    pub ground: Option<f64>,
    /// Friction coefficient μ of the foot.
    #[param(default = 0.5, range = 0.0..)]
    pub friction: f64,
    /// Stiffness k_t of strut and ground along the ground; default: k.
    #[param(unit = "N/m", range = 1.0..)]
    pub side_stiffness: Option<f64>,
    /// Damping d_t along the ground; default: d.
    #[param(unit = "N s/m", range = 0.0..)]
    pub side_damping: Option<f64>,
    /// Slip coefficient d_u: force above the friction limit per sliding speed; default: d_c.
    #[param(unit = "N s/m", range = 1e-3..)]
    pub slip: Option<f64>,
    /// Radius b of a round footpad that sinks into the soil of the terrain; default: no sinkage.
    #[param(unit = "m", range = 1e-3..)]
    pub pad: Option<f64>,
    /// Terrain, used as the ground if `ground` is not written.
    #[param(service)]
    pub terrain: Option<Handle<dyn Terrain>>,
    /// The world; z of W must be up.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Foot of the leg.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LegIn {
    /// Node at the foot, in its position with uncrushed honeycomb.
    #[port(bind = "foot")]
    pub foot: NodeState,
}

/// Contact force.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LegOut {
    /// Force on the lander at the foot.
    #[port(bind = "foot")]
    pub load: Wrench,
    /// Normal force of the ground.
    #[port("N")]
    pub force: f64,
}

/// Crushed length, absorbed energy and sinkage.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Stroke {
    /// Crushed length of the honeycomb.
    #[port("m")]
    pub crushed: f64,
    /// Energy absorbed by the honeycomb.
    #[port("J")]
    pub taken: f64,
    /// Sinkage of the footpad in the soil.
    #[port("m")]
    pub sinkage: f64,
}

/// State of honeycomb, soil and tangential contact.
#[derive(State, Clone, Copy, Debug)]
pub struct Crush {
    /// Crushed length of the honeycomb.
    #[port("m")]
    pub crushed: f64,
    /// Energy absorbed by the honeycomb.
    #[port("J")]
    pub taken: f64,
    /// Sinkage of the footpad in the soil.
    #[port("m")]
    pub sinkage: f64,
    /// Deflection z of the foot along the ground, W.
    #[port("m")]
    pub aside: Vec3,
}

/// Guard for contact with the ground.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Touch {
    /// Depth of the foot minus crushed length and sinkage.
    #[port("m")]
    pub touches: f64,
}

/// Landing leg with a crushable absorber.
pub struct CrushableLeg {
    p: LegParams,
}

impl CrushableLeg {
    /// Returns the force (N) at which the honeycomb crushes; `None` after the last stage.
    fn stage(&self, crushed: f64) -> Option<f64> {
        let mut end = 0.0;
        self.p.stages.iter().find_map(|s| {
            end += s.stroke;
            (crushed < end).then_some(s.force)
        })
    }

    /// Returns the depth (m) of the foot in the ground for a rigid, uncrushed leg, and the normal of the ground, W.
    fn sunk(&self, foot: &NodeState) -> (f64, Vec3) {
        let at = &foot.position;
        match (self.p.ground, &self.p.terrain) {
            (None, Some(terrain)) => match terrain.ground(at.x, at.y) {
                Some(g) => ((g.height - at.z) * g.normal.z, g.normal),
                None => (NOWHERE, Vec3::z()),
            },
            (plane, _) => (plane.unwrap_or(0.0) - at.z, Vec3::z()),
        }
    }

    /// Computes contact forces and rates of the foot.
    fn met(&self, x: &Crush, foot: &NodeState) -> FootContact {
        let p = &self.p;
        let (sunk, normal) = self.sunk(foot);
        let depth = sunk - x.crushed - x.sinkage;
        let (stiffness, slip) =
            (p.side_stiffness.unwrap_or(p.stiffness), p.slip.unwrap_or(p.creep));
        if depth <= 0.0 {
            let aside = x.aside * (-stiffness / slip);
            return FootContact {
                up: 0.0,
                crushing: 0.0,
                sinking: 0.0,
                along: Vec3::zeros(),
                aside,
                normal,
            };
        }
        let rising = foot.velocity.dot(&normal);
        let free = p.stiffness * depth - p.damping * rising;
        let limits = [self.stage(x.crushed), self.bearing(&foot.position, x.sinkage)];
        let (up, [crushing, sinking]) = self.upwards(limits, free);
        let sliding = foot.velocity - normal * rising;
        let damping = p.side_damping.unwrap_or(p.damping);
        let pull = (x.aside - normal * x.aside.dot(&normal)) * stiffness + sliding * damping;
        let over = pull.norm() - p.friction * up;
        if over <= 0.0 {
            return FootContact { up, crushing, sinking, along: -pull, aside: sliding, normal };
        }
        let (slips, to) = (over / (slip + damping), pull / pull.norm());
        let along = to * -(p.friction * up + slip * slips);
        FootContact { up, crushing, sinking, along, aside: sliding - to * slips, normal }
    }

    /// Returns the bearing force (N) of the soil under a footpad with the given `sinkage` (m); `None` without a pad.
    fn bearing(&self, at: &Vec3, sinkage: f64) -> Option<f64> {
        let (b, terrain) = (self.p.pad?, self.p.terrain.as_ref()?);
        let soil = terrain.soil(at.x, at.y);
        let modulus = soil.k_c / b + soil.k_phi;
        Some(std::f64::consts::PI * b * b * modulus * sinkage.max(0.0).powf(soil.n))
    }

    /// Returns the normal force (N), and the rates (m/s) at which honeycomb and soil yield. `free` is the elastic force without yielding (N),
    /// `limits` are the yield forces (N; `None`: does not yield). Strut (k, d), honeycomb and soil are in series, so they carry the same force:
    /// ```text
    /// F = free − d (ċ + ż),  ċ = (F − F_c)₊/d_c,  ż = (F − F_z)₊/d_c
    /// ```
    fn upwards(&self, limits: [Option<f64>; 2], free: f64) -> (f64, [f64; 2]) {
        let (d, creep) = (self.p.damping, self.p.creep);
        let [crush, sink] = limits.map(|l| l.unwrap_or(f64::INFINITY));
        let (weak, strong) = (crush.min(sink), crush.max(sink));
        if free <= weak {
            return (free.max(0.0), [0.0; 2]);
        }
        let one = weak + creep * (free - weak) / (creep + d);
        let force = if one <= strong {
            one
        } else {
            (creep * free + d * (weak + strong)) / (creep + 2.0 * d)
        };
        (force, [crush, sink].map(|l| (force - l).max(0.0) / creep))
    }
}

/// Contact of a foot: force along the normal (N), rates of crushing and sinking (m/s), force along the ground (N), rate of the tangential deflection
/// (m/s), normal.
struct FootContact {
    up: f64,
    crushing: f64,
    sinking: f64,
    along: Vec3,
    aside: Vec3,
    normal: Vec3,
}

/// Landing leg with a honeycomb absorber in stages that crushes irreversibly, on ground with friction.
#[model("flight.crushable_leg")]
impl Model for CrushableLeg {
    type Params = LegParams;
    type FeedthroughInputs = LegIn;
    type Outputs = Stroke;
    type FeedthroughOutputs = LegOut;
    type State = Crush;
    type Guards = Touch;
    fn build(p: LegParams) -> Result<Self, BuildError> {
        needs_level_ground(p.world.as_ref())?;
        if p.pad.is_some() && (p.terrain.is_none() || p.ground.is_some()) {
            return Err(BuildError::new(
                "`pad` needs the soil of a terrain, but the ground is a plane",
            )
            .help("add a terrain and remove `ground`, or remove `pad`")
            .at("pad"));
        }
        if let (Some(_), Some(terrain)) = (p.pad, &p.terrain) {
            terrain.needs_soil().map_err(|e| e.at("terrain"))?;
        }
        if let Some(k) = p.stages.windows(2).position(|w| w[1].force < w[0].force) {
            let (hard, soft) = (p.stages[k].force, p.stages[k + 1].force);
            let fact = format!(
                "a stage of {hard} N is listed before one of {soft} N, but the softer one crushes first"
            );
            return Err(BuildError::new(fact)
                .help("list the stages in ascending order of their force")
                .at("stages"));
        }
        Ok(CrushableLeg { p })
    }
    fn outputs(&self, x: &Crush) -> Stroke {
        Stroke { crushed: x.crushed, taken: x.taken, sinkage: x.sinkage }
    }
    fn feedthrough(&self, x: &Crush, u: &LegIn) -> LegOut {
        let FootContact { up, along, normal, .. } = self.met(x, &u.foot);
        LegOut { load: Wrench { moment: Vec3::zeros(), force: normal * up + along }, force: up }
    }
    fn derivatives(&self, x: &Crush, u: &LegIn) -> Crush {
        let FootContact { up, crushing, sinking, aside, .. } = self.met(x, &u.foot);
        Crush { crushed: crushing, taken: up * crushing, sinkage: sinking, aside }
    }
    fn guards(&self, x: &Crush, u: &LegIn) -> Touch {
        Touch { touches: self.sunk(&u.foot).0 - x.crushed - x.sinkage }
    }
    fn handle_event(&self, x: &Crush) -> (Crush, ()) {
        (*x, ())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tip_over::crush;
    use super::*;
    use linkwork_surroundings::testing::Plane;

    #[test]
    fn stages_are_soft_before_hard() {
        let stage = |force| Stage { stroke: 0.1, force };
        let p = |forces: [f64; 2]| leg(forces.map(stage).to_vec()).p;
        let e = CrushableLeg::build(p([1e4, 1e3])).err().unwrap();
        assert!(e.param.as_deref() == Some("stages") && e.help.is_some(), "{}", e.message);
        assert!(CrushableLeg::build(p([1e3, 1e4])).is_ok());
    }

    fn leg(stages: Vec<Stage>) -> CrushableLeg {
        CrushableLeg {
            p: LegParams {
                stages,
                stiffness: 1e8,
                damping: 0.0,
                creep: 0.01,
                ground: None,
                friction: 0.5,
                side_stiffness: None,
                side_damping: None,
                slip: Some(1.0),
                pad: None,
                terrain: None,
                world: None,
            },
        }
    }

    fn whole() -> Crush {
        Crush { crushed: 0.0, taken: 0.0, sinkage: 0.0, aside: Vec3::zeros() }
    }

    fn foot(z: f64, v: Vec3) -> LegIn {
        let position = Vec3::z() * z;
        LegIn { foot: NodeState { position, velocity: v, ..NodeState::identity() } }
    }

    #[test]
    fn the_force_is_that_of_the_stage_until_the_last_is_used_up() {
        let stage = |stroke, force| Stage { stroke, force };
        let m = leg(vec![stage(0.05, 2000.0), stage(0.2, 6000.0)]);
        let at = |crushed: f64, z: f64| {
            let x = Crush { crushed, ..whole() };
            m.feedthrough(&x, &foot(z, Vec3::zeros())).force
        };
        assert_eq!(at(0.0, 0.1), 0.0);
        // Initially the force is below the crushing force of the first stage, and the strut is elastic.
        assert!((at(0.0, -1e-5) - 1000.0).abs() < 1e-9);
        assert_eq!(m.stage(0.04), Some(2000.0));
        assert_eq!((m.stage(0.06), m.stage(0.26)), (Some(6000.0), None));
        // After the last stage the leg is solid.
        assert!((at(0.25, -0.2501) - 1e8 * 1e-4).abs() < 1e-3);
        // Crushing is irreversible.
        assert_eq!(at(0.1, -0.05), 0.0);
    }

    /// A spring holds the foot below μ F; above, the foot slips with a friction force μ F against its motion. A lander at rest stays on a slope. In
    /// the air the deflection decays.
    #[test]
    fn friction_holds_up_to_its_limit_and_slips_beyond() {
        let mut m = leg(vec![Stage { stroke: 0.05, force: 2000.0 }]);
        let at = |m: &CrushableLeg, aside: Vec3, v: Vec3, z: f64| {
            let (x, u) = (Crush { aside, ..whole() }, foot(z, v));
            let y = m.feedthrough(&x, &u);
            (y.load.force, m.derivatives(&x, &u).aside)
        };
        // At a normal force of 1000 N, the foot sticks up to 500 N, which is a deflection of 5 µm.
        let to = Vec3::new(0.6, 0.8, 0.0);
        let (force, rate) = at(&m, to * 4e-6, to * 0.3, -1e-5);
        assert!((force - Vec3::new(-240.0, -320.0, 1000.0)).norm() < 1e-9 && rate == to * 0.3);
        // In steady sliding at 5 m/s the deflection is constant, and the force is μ F plus d_u times 5 m/s.
        let stands = to * ((500.0 + 5.0) / 1e8);
        let (force, rate) = at(&m, stands, to * 5.0, -1e-5);
        assert!((force - Vec3::new(-303.0, -404.0, 1000.0)).norm() < 1e-9, "{force}");
        assert!(rate.norm() < 1e-12, "{rate}");
        // Damping has no effect, because the strut does not move.
        m.p.side_damping = Some(40.0);
        let (force, rate) = at(&m, stands, to * 5.0, -1e-5);
        assert!((force - Vec3::new(-303.0, -404.0, 1000.0)).norm() < 1e-9 && rate.norm() < 1e-12);
        let (force, rate) = at(&m, stands, Vec3::zeros(), 1.0);
        assert!(force == Vec3::zeros() && (rate + stands * 1e8).norm() < 1e-12);
    }

    /// On a slope the result equals that of a plane, rotated: force, rate and depth are along the normal. Outside the map there is no force.
    #[test]
    fn on_a_slope_it_pushes_along_the_normal() {
        let mut level = leg(vec![Stage { stroke: 0.05, force: 2000.0 }]);
        let mut m = leg(vec![Stage { stroke: 0.05, force: 2000.0 }]);
        let (slope, height) = (0.3_f64, 12.0);
        (level.p.damping, m.p.damping) = (20.0, 20.0);
        m.p.terrain = Some(Plane { height: 12.0, slope: 0.3, ..Plane::default() }.handle());
        let turn = Quat::from_scaled_axis(Vec3::y() * -slope.atan());
        let x = whole();
        for (z, v) in [(-1e-5, Vec3::new(0.02, -0.01, 0.0)), (-3e-5, Vec3::new(-1.0, 0.4, -0.5))] {
            let (flat, there) = (foot(z, v), turn * Vec3::new(4.0, 1.0, z) + Vec3::z() * height);
            let moved = NodeState { position: there, velocity: turn * v, ..NodeState::identity() };
            let u = LegIn { foot: moved };
            let (a, b) = (level.feedthrough(&x, &flat), m.feedthrough(&x, &u));
            assert!(
                (turn * a.load.force - b.load.force).norm() < 1e-4,
                "{} {}",
                a.load.force,
                b.load.force
            );
            let rate = |m: &CrushableLeg, u: &LegIn| m.derivatives(&x, u).crushed;
            let (p, q) = (rate(&level, &flat), rate(&m, &u));
            assert!((p - q).abs() < 1e-9 * p + 1e-12, "{p} {q}");
            assert!((m.guards(&x, &u).touches + z).abs() < 1e-12);
        }
        let mut off = foot(-5.0, Vec3::zeros());
        off.foot.position.x = 200.0;
        assert_eq!(m.feedthrough(&x, &off).load, Wrench::zero());
        // `ground` takes precedence over the terrain.
        m.p.ground = Some(-6.0);
        assert_eq!(m.feedthrough(&x, &off).force, 0.0);
        off.foot.position.z = -6.00001;
        assert!((m.feedthrough(&x, &off).force - 1000.0).abs() < 1e-6);
    }

    /// Under a slowly increasing force the soil yields first, along Bekker's curve, then the honeycomb. On unloading neither recovers.
    #[test]
    fn a_pad_sinks_until_the_honeycomb_is_weaker() {
        let soil =
            Soil { n: 1.1, k_c: 1400.0, k_phi: 820_000.0, ..crate::guidance::test_soil::firm() };
        let mut m = leg(vec![Stage { stroke: 0.2, force: 3000.0 }]);
        (m.p.pad, m.p.creep, m.p.stiffness) = (Some(0.2), 50.0, 1e7);
        m.p.terrain = Some(Plane { soil, ..Plane::default() }.handle());
        let bearing =
            |z: f64| std::f64::consts::PI * 0.04 * (1400.0 / 0.2 + 820_000.0) * z.powf(1.1);
        let h = 1e-6;
        let (mut x, mut z, speed) = (whole(), 0.0, 0.05);
        let mut press = |to: f64, x: &mut Crush, v: f64| {
            let mut last = 0.0;
            while (to - z) * v > 0.0 {
                let u = foot(z, Vec3::z() * v);
                let y = m.feedthrough(x, &u);
                let r = m.derivatives(x, &u);
                x.crushed += r.crushed * h;
                x.sinkage += r.sinkage * h;
                z += v * h;
                last = y.force;
            }
            last
        };
        let force = press(-0.02, &mut x, -speed);
        // The creep force is 50 N s/m at 0.05 m/s.
        assert!((force - bearing(x.sinkage) - 2.5).abs() < 0.5, "{force} {}", bearing(x.sinkage));
        assert!(x.crushed == 0.0 && (x.sinkage - 0.02 + force / 1e7).abs() < 1e-6);
        let force = press(-0.1, &mut x, -speed);
        let full = (3000.0 / bearing(1.0)).powf(1.0 / 1.1);
        assert!((force - 3002.5).abs() < 1.0, "{force}");
        assert!((x.sinkage / full - 1.0).abs() < 2e-3, "{} {full}", x.sinkage);
        assert!((x.crushed + x.sinkage + force / 1e7 - 0.1).abs() < 1e-6 && x.crushed > 0.0);
        let before = (x.crushed, x.sinkage);
        assert_eq!(press(-0.09, &mut x, speed), 0.0);
        // While the strut relaxes, its elastic energy causes further yielding.
        assert!((x.crushed - before.0).abs() < 1e-6 && x.sinkage == before.1);
        let p = LegParams { terrain: None, ..m.p.clone() };
        assert_eq!(CrushableLeg::build(p).err().unwrap().param.as_deref(), Some("pad"));
    }

    /// With damping in the strut, strut, honeycomb and soil carry the same force in all combinations of yielding.
    #[test]
    fn one_force_goes_through_all_in_a_row() {
        let mut m = leg(vec![Stage { stroke: 0.2, force: 3000.0 }]);
        (m.p.damping, m.p.creep) = (400.0, 100.0);
        for (limits, free) in [
            ([Some(3000.0), None], 5000.0),
            ([Some(3000.0), Some(3100.0)], 5000.0),
            ([Some(3000.0), Some(900.0)], 1500.0),
            ([None, Some(900.0)], 9000.0),
            ([Some(3000.0), Some(9000.0)], 2000.0),
        ] {
            let (force, [c, z]) = m.upwards(limits, free);
            assert!((force - (free - 400.0 * (c + z))).abs() < 1e-9, "{limits:?}: {force} {c} {z}");
            for (rate, limit) in [c, z].into_iter().zip(limits) {
                let over = limit.map_or(0.0, |l| (force - l).max(0.0));
                assert!((rate * 100.0 - over).abs() < 1e-9);
            }
        }
    }

    /// Compares stroke and energy of a lander on three legs with the closed form.
    #[test]
    fn a_landing_takes_the_stroke_of_the_closed_form() {
        let (mass, g) = (600.0, 3.71);
        let mut m = leg(vec![Stage { stroke: 1.0, force: 4500.0 }]);
        (m.p.stiffness, m.p.creep) = (1e7, 1.0);
        let (mut z, mut v, mut x) = (0.0, -2.4, whole());
        let h = 5e-8;
        // ċ adjusts within d_c/k = 1e-7 s, so use small steps, and only while the leg sinks.
        let mut t = 0.0;
        while v < 0.0 && t < 1.0 {
            let u = foot(z, Vec3::z() * v);
            let y = m.feedthrough(&x, &u);
            let r = m.derivatives(&x, &u);
            x = Crush { crushed: x.crushed + r.crushed * h, taken: x.taken + r.taken * h, ..x };
            v += h * (3.0 * y.force / mass - g);
            z += h * v;
            t += h;
        }
        let (stroke, _) = crush(mass, 2.4, g, 3.0, 4500.0).unwrap();
        // The strut deflects by 4500/1e7 = 0.45 mm and stores 1 J.
        assert!((x.crushed - stroke).abs() < 6e-4, "{} {stroke}", x.crushed);
        assert!((x.taken / (4500.0 * x.crushed) - 1.0).abs() < 2e-3, "{}", x.taken);
        assert!((t - 0.12772751463544438).abs() < 6e-4);
    }
}
