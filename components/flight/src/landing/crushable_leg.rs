//! `flight.crushable_leg`: a leg whose honeycomb crushes once, on a foot that meets flat ground.
//! ```text
//! s = h₀ − z of the foot: how far the foot would be in the ground if the leg were rigid
//! c = greatest s so far that was crushed: honeycomb does not come back
//! F = k (s − c) + d ṡ, at most the force of the stage at c; where it is more, the honeycomb crushes: ċ = (…)₊
//! stages: (stroke, force), soft before hard; after the last one the leg is solid: F = k (s − c)
//! friction: −μ F v_t/√(v_t² + ε²)          the foot is a node on the lander, z up
//! ```
//! k is the stiffness of what does not crush (strut, soil), so that contact begins without a jump. c is a
//! state: it follows ċ = max(0, (F_free − F_stage)/d_c), a fast creep that keeps the force at the stage
//! within d_c ċ. Touching and leaving the ground are events.

use linkwork_runtime::prelude::*;

/// A stage of honeycomb.
#[derive(Params, Clone, Copy, Debug)]
pub struct Stage {
    /// Its stroke.
    #[param(unit = "m", range = 1e-6..)]
    pub stroke: f64,
    /// Its force while it crushes.
    #[param(unit = "N", range = 0.0..)]
    pub force: f64,
}

/// A leg.
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
    /// Force over speed of the crushing beyond the stage's force, d_c.
    #[param(unit = "N s/m", default = 100.0, range = 1e-3..)]
    pub creep: f64,
    /// Height of the ground, W.
    #[param(unit = "m", default = 0.0)]
    pub ground: f64,
    /// Friction of the foot μ.
    #[param(default = 0.5, range = 0.0..)]
    pub friction: f64,
    /// Speed ε below which friction is smooth.
    #[param(unit = "m/s", default = 0.01, range = 1e-6..)]
    pub smoothing: f64,
}

/// The foot.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LegIn {
    /// Node at the foot, where it is with the honeycomb whole.
    #[port(bind = "foot")]
    pub foot: NodeState,
}

/// Load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct LegOut {
    /// On the lander at the foot.
    #[port(bind = "foot")]
    pub load: Wrench,
    /// Force of the ground upwards.
    #[port("N")]
    pub force: f64,
}

/// Stroke so far.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Stroke {
    /// Honeycomb that is crushed.
    #[port("m")]
    pub crushed: f64,
    /// Energy that it has taken.
    #[port("J")]
    pub taken: f64,
}

/// State of the honeycomb.
#[derive(State, Clone, Copy, Debug)]
pub struct Crush {
    /// Honeycomb that is crushed.
    #[port("m")]
    pub crushed: f64,
    /// Energy that it has taken.
    #[port("J")]
    pub taken: f64,
}

/// The ground.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Touch {
    /// Depth of the foot less what is crushed.
    #[port("m")]
    pub touches: f64,
}

/// A crushable leg.
pub struct CrushableLeg {
    p: LegParams,
}

impl CrushableLeg {
    /// Force at which the honeycomb gives way; none after the last stage.
    fn stage(&self, crushed: f64) -> Option<f64> {
        let mut end = 0.0;
        self.p.stages.iter().find_map(|s| {
            end += s.stroke;
            (crushed < end).then_some(s.force)
        })
    }

    /// Force of the ground, and the rate of crushing.
    fn force(&self, x: &Crush, foot: &NodeState) -> (f64, f64) {
        let p = &self.p;
        let depth = p.ground - foot.position.z - x.crushed;
        if depth <= 0.0 {
            return (0.0, 0.0);
        }
        let free = p.stiffness * depth - p.damping * foot.velocity.z;
        match self.stage(x.crushed) {
            Some(limit) if free > limit => {
                // Through strut (k, d) and creeping honeycomb in a row: d (ṡ − ċ) + k δ = limit + d_c ċ.
                let rate = (free - limit) / (p.creep + p.damping);
                (limit + p.creep * rate, rate)
            }
            _ => (free.max(0.0), 0.0),
        }
    }
}

/// A landing leg with honeycomb in stages that crushes once, on flat ground with friction.
#[model("flight.crushable_leg")]
impl Model for CrushableLeg {
    type Params = LegParams;
    type Ud = LegIn;
    type Ym = Stroke;
    type Yd = LegOut;
    type X = Crush;
    type G = Touch;
    fn moore(&self, _: &Clock, x: &Crush) -> Stroke {
        Stroke { crushed: x.crushed, taken: x.taken }
    }
    fn direct(&self, _: &Clock, x: &Crush, _: &(), u: &LegIn) -> LegOut {
        let (up, _) = self.force(x, &u.foot);
        let along = Vec3::new(u.foot.velocity.x, u.foot.velocity.y, 0.0);
        let smooth = along.norm().hypot(self.p.smoothing);
        let force = Vec3::z() * up - along * (self.p.friction * up / smooth);
        LegOut { load: Wrench { moment: Vec3::zeros(), force }, force: up }
    }
    fn deriv(&self, _: &Clock, x: &Crush, _: &(), _: &(), u: &LegIn) -> Crush {
        let (force, rate) = self.force(x, &u.foot);
        Crush { crushed: rate, taken: force * rate }
    }
    fn guards(&self, _: &Clock, x: &Crush, _: &(), _: &(), u: &LegIn) -> Touch {
        Touch { touches: self.p.ground - u.foot.position.z - x.crushed }
    }
    fn fired(&self, _: &Clock, _: usize, x: &Crush) -> (Crush, ()) {
        (*x, ())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tip_over::crush;
    use super::*;

    fn leg(stages: Vec<Stage>) -> CrushableLeg {
        CrushableLeg {
            p: LegParams {
                stages,
                stiffness: 1e8,
                damping: 0.0,
                creep: 0.01,
                ground: 0.0,
                friction: 0.5,
                smoothing: 0.01,
            },
        }
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
            let x = Crush { crushed, taken: 0.0 };
            m.direct(&Clock::at(0.0, 0.1, 0), &x, &(), &foot(z, Vec3::zeros()), &()).force
        };
        assert_eq!(at(0.0, 0.1), 0.0);
        // The strut is not yet at the force of the first stage; then it is.
        assert!((at(0.0, -1e-5) - 1000.0).abs() < 1e-9);
        assert_eq!(m.stage(0.04), Some(2000.0));
        assert_eq!((m.stage(0.06), m.stage(0.26)), (Some(6000.0), None));
        // Solid at the end.
        assert!((at(0.25, -0.2501) - 1e8 * 1e-4).abs() < 1e-3);
        // It does not come back.
        assert_eq!(at(0.1, -0.05), 0.0);
        let y = m.direct(
            &Clock::at(0.0, 0.1, 0),
            &Crush { crushed: 0.0, taken: 0.0 },
            &(),
            &foot(-1e-5, Vec3::new(3.0, 4.0, 0.0)),
            &(),
        );
        assert!((y.load.force - Vec3::new(-300.0, -400.0, 1000.0)).norm() < 0.01);
    }

    /// A lander on three legs beside the closed form: stroke and energy.
    #[test]
    fn a_landing_takes_the_stroke_of_the_closed_form() {
        let (mass, g) = (600.0, 3.71);
        let mut m = leg(vec![Stage { stroke: 1.0, force: 4500.0 }]);
        (m.p.stiffness, m.p.creep) = (1e7, 1.0);
        let (mut z, mut v, mut x) = (0.0, -2.4, Crush { crushed: 0.0, taken: 0.0 });
        let (c, h) = (Clock::at(0.0, 0.1, 0), 5e-8);
        // ċ adjusts within d_c/k = 1e-7 s: small steps, and only as long as it sinks.
        let mut t = 0.0;
        while v < 0.0 && t < 1.0 {
            let u = foot(z, Vec3::z() * v);
            let y = m.direct(&c, &x, &(), &u, &());
            let r = m.deriv(&c, &x, &(), &(), &u, &(), &y);
            x = Crush { crushed: x.crushed + r.crushed * h, taken: x.taken + r.taken * h };
            v += h * (3.0 * y.force / mass - g);
            z += h * v;
            t += h;
        }
        let (stroke, _) = crush(mass, 2.4, g, 3.0, 4500.0).unwrap();
        // The strut gives 4500/1e7 = 0.45 mm, and holds 1 J of it.
        assert!((x.crushed - stroke).abs() < 6e-4, "{} {stroke}", x.crushed);
        assert!((x.taken / (4500.0 * x.crushed) - 1.0).abs() < 2e-3, "{}", x.taken);
        assert!((t - 0.12772751463544438).abs() < 6e-4);
    }
}
