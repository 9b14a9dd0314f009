//! `flight.slosh`: the first lateral slosh mode of a tank, as a mass on springs along both lateral axes.
//! ```text
//! m₁, h₁, 1/L    from `flight.propellant_tank` with `slosh: apart`, at its level of the moment (`Slosh`)
//! ω² = a/L       k = m₁ ω²     c = 2 ζ ω m₁            a: acceleration that presses the propellant down, along z of the tank
//! f_x = −k x − c ẋ             f_y = −k y − c ẏ        on the two sliders of the body that swings
//! ```
//! The slosh mass is a body of the mechanism, so that the coupling with the tank is exact in all motions of the vehicle:
//! ```text
//! "swing": (parent: "craft", at: (position: …), hinge: Chain([Slider([1, 0, 0]), Slider([0, 1, 0])]), mass: "0.1 kg", inertia: [0, 0, 0])
//! ```
//! Its hinge frame is at the `bottom` of the tank, with z along the axis of the tank. This model adds the mass m₁ at the height h₁, which follow the
//! propellant level, and applies the spring and damper forces. Displacements and rates are the states of the hinge. The body's own mass represents
//! the propellant that never drains, and keeps the mass matrix regular when the tank is empty. The tank part carries the remaining propellant, so
//! that total mass and first moment at rest are correct.
//!
//! Not modelled: higher modes, motion along the axis, rotary sloshing, breaking waves, and the relative momentum of the drained propellant. The model
//! is valid for displacements below about 0.2 R. For a ≤ 0 the propellant is not settled, and there is no spring force. `acceleration` is a separate
//! input, because a spring that depends on the acceleration of the vehicle would close an algebraic loop. Wire it to thrust over mass, to gravity on
//! the pad, or to an accelerometer that is sampled.

use linkwork_runtime::prelude::*;

/// Parameters of the slosh mode that do not come from the tank.
#[derive(Params, Clone, Debug)]
pub struct SloshParams {
    /// Damping ratio ζ: about 0.005 for smooth walls, 0.05 and more with baffles.
    #[param(default = 0.01, range = 0.0..=1.0)]
    pub damping: f64,
}

/// Slosh properties from the tank, and the states of the two sliders.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SloshIn {
    /// Displacement of the slosh mass along x of the tank.
    #[port(bind = "x")]
    pub x: HingeState,
    /// Displacement of the slosh mass along y of the tank.
    #[port(bind = "y")]
    pub y: HingeState,
    /// Slosh mass m₁, from the tank.
    #[port("kg")]
    pub swinging: f64,
    /// Height h₁ of the slosh mass above the bottom, from the tank.
    #[port("m")]
    pub swing_height: f64,
    /// ω²/a, from the tank.
    #[port("1/m")]
    pub swing_stiffness: f64,
    /// Acceleration a that presses the propellant onto the bottom of the tank.
    #[port("m/s^2")]
    pub acceleration: f64,
}

/// Slosh mass and the forces on its hinge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SloshOut {
    /// Slosh mass, added to its body.
    #[port(bind = "swing")]
    pub added: AddedMass,
    /// Spring and damper force along x.
    #[port(bind = "x")]
    pub force_x: HingeTorque,
    /// Spring and damper force along y.
    #[port(bind = "y")]
    pub force_y: HingeTorque,
    /// Frequency ω of the mode in a tank that is held fixed.
    #[port("rad/s")]
    pub frequency: f64,
}

/// First lateral slosh mode of a tank.
pub struct Sloshing {
    p: SloshParams,
}

/// First lateral slosh mode of a tank as a mass on springs; mass, height and frequency follow the propellant level.
#[model("flight.slosh")]
impl Model for Sloshing {
    type Params = SloshParams;
    type FeedthroughInputs = SloshIn;
    type FeedthroughOutputs = SloshOut;
    fn feedthrough(&self, u: &SloshIn) -> SloshOut {
        let m = u.swinging.max(0.0);
        let frequency = (u.acceleration * u.swing_stiffness).max(0.0).sqrt();
        let (k, c) = (m * frequency * frequency, 2.0 * self.p.damping * frequency * m);
        let spring = |s: &HingeState| HingeTorque(-k * s.angle - c * s.rate);
        SloshOut {
            added: AddedMass::of(m, &Vec3::new(0.0, 0.0, u.swing_height), &Vec3::zeros()),
            force_x: spring(&u.x),
            force_y: spring(&u.y),
            frequency,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::propulsion::slosh::Slosh;
    use linkwork_formats::multibody::{BodySpec, Builder, Hinge, SubhingeKind};
    use linkwork_plant::MechanismSpec;
    use linkwork_runtime::{
        Accuracy, BindSpec, BindTarget, Catalogue, Integrator, Origin, PartSpec, PortRef, Seconds,
        Simulation, Spec, Value, WireSpec, compile,
    };
    use linkwork_spatial::nalgebra::Matrix3;
    use linkwork_spatial::{MassProperties, Pose};
    use std::sync::Arc;

    /// Motion of a node, for the momentum balance.
    #[derive(Ports, Clone, Copy, Debug)]
    struct NodeIn {
        /// The node.
        #[port(bind = "body")]
        body: NodeState,
    }
    /// Motion of a node as numbers.
    #[derive(Ports, Clone, Copy, Debug)]
    struct NodeOut {
        /// Position, W.
        #[port("m")]
        p: Vec3,
        /// Velocity, W.
        #[port("m/s")]
        v: Vec3,
        /// Angular velocity, W.
        #[port("rad/s")]
        w: Vec3,
        /// Axes x and z in W.
        #[port("1")]
        x: Vec3,
        /// z.
        #[port("1")]
        z: Vec3,
    }
    struct Probe;
    /// Outputs the motion of a node.
    #[model("t.probe")]
    impl Model for Probe {
        type Params = ();
        type FeedthroughInputs = NodeIn;
        type FeedthroughOutputs = NodeOut;
        fn build(_: ()) -> Result<Self, BuildError> {
            Ok(Probe)
        }
        fn feedthrough(&self, u: &NodeIn) -> NodeOut {
            let b = &u.body;
            let (x, z) = (b.rotation * Vec3::x(), b.rotation * Vec3::z());
            NodeOut { p: b.position, v: b.velocity, w: b.angular, x, z }
        }
    }

    const RADIUS: f64 = 0.4;
    const DENSITY: f64 = 800.0;
    const HUB: f64 = 300.0;
    /// Mass that never drains, kg.
    const REST: f64 = 1e-3;
    fn hub_inertia() -> Vec3 {
        Vec3::new(90.0, 120.0, 70.0)
    }

    struct Case {
        hub: Hinge,
        propellant: f64,
        drained: f64,
        acceleration: f64,
        damping: f64,
        /// Coordinates of the hub, then of the sliders.
        q: Vec<f64>,
        v: Vec<f64>,
    }

    fn simulation(case: &Case) -> Simulation {
        let mut b = Builder::new();
        let solid = MassProperties::new(HUB, Vec3::zeros(), Matrix3::from_diagonal(&hub_inertia()));
        b.body(BodySpec::new("hub", "world").hinge(case.hub.clone()).mass(solid));
        let bottom = Pose::translation(0.15, -0.1, 0.3);
        let sliders =
            Hinge::chain([Vec3::x(), Vec3::y()].map(|axis| SubhingeKind::Slider { axis }));
        let rest = MassProperties::new(REST, Vec3::zeros(), Matrix3::zeros());
        b.body(BodySpec::new("swing", "hub").hinge_in_parent(bottom).hinge(sliders).mass(rest));
        b.node("hub/bottom", "hub", bottom);
        let multibody = Arc::new(b.build().unwrap());
        let number = |key: &str, x: f64| (key.to_string(), Value::Number(x).into());
        let text = |key: &str, t: &str| (key.to_string(), Value::Text(t.into()).into());
        let row = |y: f64| {
            let row = vec![Value::Number(0.0).into(), Value::Number(y).into()];
            Value::Map(vec![("rows".into(), Value::List(vec![Value::List(row).into()]).into())])
        };
        let tank = vec![
            number("propellant", case.propellant),
            number("radius", RADIUS),
            number("density", DENSITY),
            text("slosh", "apart"),
        ];
        let part = |path: &str, model: &str, params: Value| PartSpec::new(path, model, params);
        let parts = vec![
            part("Tank", "flight.propellant_tank", Value::Map(tank)),
            part("Press", "flight.sequence", row(case.acceleration)),
            part("Flow", "flight.sequence", row(case.drained)),
            part("Drain", "flight.drain", Value::Map(vec![])),
            part("Slosh", "flight.slosh", Value::Map(vec![number("damping", case.damping)])),
            part("Hub", "t.probe", Value::Map(vec![])),
            part("Swing", "t.probe", Value::Map(vec![])),
        ];
        let end = |s: &str| {
            let (part, port) = s.split_once('.').unwrap();
            PortRef { part: part.into(), port: port.into(), index: None }
        };
        let wires = [
            ("Tank.swinging", "Slosh.swinging"),
            ("Tank.swing_height", "Slosh.swing_height"),
            ("Tank.swing_stiffness", "Slosh.swing_stiffness"),
            ("Press.y", "Slosh.acceleration"),
            ("Flow.y", "Drain.flow"),
            ("Tank.outlet.available", "Drain.tank.available"),
            ("Drain.tank.flow", "Tank.outlet.flow"),
        ];
        let wire = |(from, to): (&str, &str)| WireSpec {
            from: end(from),
            to: end(to),
            timing: Default::default(),
            text: format!("{from} -> {to}"),
            origin: Origin::NONE,
        };
        let slider = |index| BindTarget::Hinge { body: "swing".into(), index };
        let binds = [
            ("Tank", "bottom", BindTarget::Node("hub/bottom".into())),
            ("Slosh", "swing", BindTarget::Node("swing".into())),
            ("Slosh", "x", slider(0)),
            ("Slosh", "y", slider(1)),
            ("Hub", "body", BindTarget::Node("hub".into())),
            ("Swing", "body", BindTarget::Node("swing".into())),
        ];
        let bind = |(part, bind, target): (&str, &str, BindTarget)| BindSpec {
            part: part.into(),
            bind: bind.into(),
            target,
            origin: Origin::NONE,
        };
        let (q, v) = (case.q.clone(), case.v.clone());
        let mechanism = MechanismSpec {
            gravity: Some("none".into()),
            ..MechanismSpec::new("Mechanism", multibody, q, v)
        };
        let spec = Spec {
            parts,
            wires: wires.map(wire).to_vec(),
            binds: binds.map(bind).to_vec(),
            host: Some(Box::new(mechanism)),
            step: Seconds::new(1, 10).unwrap(),
            integrator: Integrator::DormandPrince,
            accuracy: Some(Accuracy {
                relative: 1e-13,
                absolute: 1e-15,
                step_max: 0.1,
                of: Vec::new(),
            }),
            ..Spec::default()
        };
        let catalogue = Catalogue::new([crate::catalogue(), vec![Entry::model::<Probe>()]]);
        let plan = compile(&spec, &catalogue, &Files::default()).unwrap_or_else(|e| panic!("{e}"));
        Simulation::new(Arc::new(plan))
    }

    fn vec3(sim: &Simulation, path: &str) -> Vec3 {
        Vec3::from(["x", "y", "z"].map(|c| sim.get(&format!("{path}.{c}")).unwrap()))
    }

    fn mode(propellant: f64) -> Slosh {
        let height = propellant / (DENSITY * std::f64::consts::PI * RADIUS * RADIUS);
        Slosh { radius: RADIUS, height, mass: propellant }
    }

    fn held(propellant: f64, damping: f64, q: [f64; 2]) -> Simulation {
        simulation(&Case {
            hub: Hinge::locked(),
            propellant,
            drained: 0.0,
            acceleration: 3.0,
            damping,
            q: q.to_vec(),
            v: vec![0.0, 0.0],
        })
    }

    /// Reference: ω² = 1.841 (a/R) tanh(1.841 h/R) at three fill levels, measured by the phase of the motion; both lateral axes agree.
    #[test]
    fn its_frequency_is_that_of_the_formula_at_three_fills() {
        for propellant in [20.0, 120.0, 600.0] {
            let h = mode(propellant).height;
            let k = 1.841_183_781_340_659;
            // The mass that never drains swings, too, and lowers the frequency.
            let m = mode(propellant).swinging();
            let omega = (k * 3.0 / RADIUS * (k * h / RADIUS).tanh() * m / (m + REST)).sqrt();
            let mut sim = held(propellant, 0.0, [1e-3, -2e-3]);
            sim.run_until(Seconds::from_decimal(8.3).unwrap()).unwrap();
            let [x, y, v] = ["Swing.p.x", "Swing.p.y", "Swing.v.x"].map(|n| sim.get(n).unwrap());
            let (x, y) = (x - 0.15, y + 0.1);
            let t = 8.3;
            let turns = (omega * t / (2.0 * std::f64::consts::PI)).floor();
            let phase = (-v / omega).atan2(x).rem_euclid(2.0 * std::f64::consts::PI);
            let found = (phase + 2.0 * std::f64::consts::PI * turns) / t;
            assert!((found / omega - 1.0).abs() < 1e-9, "{propellant}: {found} {omega}");
            assert!((y + 2.0 * x).abs() < 1e-12, "{x} {y}");
        }
    }

    /// Compares with the closed form of a damped oscillator with ζ = 0.02; its energy decays as e^(−2 ζ ω t).
    #[test]
    fn its_energy_falls_with_the_damping() {
        let (propellant, zeta, t) = (120.0, 0.02, 9.0);
        let s = mode(propellant);
        let m = s.swinging() + REST;
        // k and c are divided by the slosh mass plus the mass that never drains.
        let omega = (s.stiffness(3.0) / m).sqrt();
        let zeta_all = s.damping(3.0, zeta) / (2.0 * m * omega);
        let damped = omega * (1.0 - zeta_all * zeta_all).sqrt();
        let mut sim = held(propellant, zeta, [1e-3, 0.0]);
        let energy = |sim: &Simulation| {
            let [x, v] = ["Swing.p.x", "Swing.v.x"].map(|n| sim.get(n).unwrap());
            0.5 * m * (v * v + (omega * (x - 0.15)).powi(2))
        };
        let before = energy(&sim);
        sim.run_until(Seconds::from_decimal(t).unwrap()).unwrap();
        let fade = (-zeta_all * omega * t).exp();
        let (sin, cos) = (damped * t).sin_cos();
        let want = 1e-3 * fade * (cos + zeta_all * omega / damped * sin);
        let found = sim.get("Swing.p.x").unwrap() - 0.15;
        assert!((found - want).abs() < 1e-12, "{found} {want}");
        let ratio = energy(&sim) / before / (fade * fade);
        // Within a period the energy oscillates by a fraction 2 ζ about the exponential.
        assert!((ratio - 1.0).abs() < 2.0 * zeta, "{ratio}");
        assert!(fade < 0.7);
    }

    /// Returns momentum, angular momentum about the origin and about the centre of mass, and the centre of mass, of hub, tank and slosh mass.
    fn books(sim: &Simulation, propellant: f64) -> (Vec3, Vec3, Vec3) {
        let s = mode(propellant);
        let (m1, h1, h) = (s.swinging(), s.attachment(), s.height);
        let m0 = propellant - m1;
        let tell =
            |part: &str| ["p", "v", "w", "x", "z"].map(|k| vec3(sim, &format!("{part}.{k}")));
        let [p, v, w, x, z] = tell("Hub");
        let y = z.cross(&x);
        let R = Matrix3::from_columns(&[x, y, z]);
        let (mut mass, mut first, mut P, mut H) = (HUB, p * HUB, v * HUB, p.cross(&v) * HUB);
        H += R * hub_inertia().component_mul(&(R.transpose() * w));
        // Moments of the remaining propellant are the moments of the full propellant minus those of the
        // slosh mass.
        let h0 = (propellant * 0.5 * h - m1 * h1) / m0;
        let across =
            propellant * (RADIUS * RADIUS / 4.0 + h * h / 3.0) - m1 * h1 * h1 - m0 * h0 * h0;
        let about = (0.5 * propellant * RADIUS * RADIUS).min(2.0 * across);
        H += R * Vec3::new(across, across, about).component_mul(&(R.transpose() * w));
        let arm = R * Vec3::new(0.15, -0.1, 0.3 + h0);
        let mut point = |m: f64, p: Vec3, v: Vec3| {
            mass += m;
            first += p * m;
            P += v * m;
            H += p.cross(&v) * m;
        };
        point(m0, p + arm, v + w.cross(&arm));
        let [p, v, w, _, z] = tell("Swing");
        point(m1, p + z * h1, v + w.cross(&(z * h1)));
        point(REST, p, v);
        let centre = first / mass;
        (P, H - centre.cross(&P), centre)
    }

    /// In free tumbling, hub and propellant conserve momentum and angular momentum about the centre of mass, and the centre of mass moves uniformly;
    /// damping is an internal force.
    #[test]
    fn craft_and_propellant_keep_momentum_and_angular_momentum() {
        for damping in [0.0, 0.05] {
            let propellant = 120.0;
            let mut sim = simulation(&Case {
                hub: Hinge::free(),
                propellant,
                drained: 0.0,
                acceleration: 3.0,
                damping,
                q: vec![0.3, -0.4, 0.7, 0.0, 0.0, 0.0, 1.0, 0.05, -0.03],
                v: vec![0.1, -0.2, 0.15, 0.5, 0.3, -0.2, 0.1, 0.2],
            });
            let (P, H, centre) = books(&sim, propellant);
            sim.run_until(Seconds::from_decimal(10.0).unwrap()).unwrap();
            let (P1, H1, centre1) = books(&sim, propellant);
            let moved = vec3(&sim, "Swing.p") - vec3(&sim, "Hub.p");
            assert!(moved.norm() > 0.1 && H.norm() > 1.0);
            assert!((P1 - P).norm() < 1e-10 * P.norm(), "{P} {P1}");
            assert!((H1 - H).norm() < 1e-10 * H.norm(), "{H} {H1}");
            let mass = HUB + propellant + REST;
            assert!((centre1 - centre - P * (10.0 / mass)).norm() < 1e-9, "{centre} {centre1}");
        }
    }

    /// With an empty tank the mechanism can still be solved; the mode vanishes with the propellant.
    #[test]
    fn it_drains_with_the_tank() {
        let mut sim = simulation(&Case {
            hub: Hinge::locked(),
            propellant: 4.0,
            drained: 1.0,
            acceleration: 3.0,
            damping: 0.01,
            q: vec![1e-3, 0.0],
            v: vec![0.0, 0.0],
        });
        let mut last = f64::INFINITY;
        for k in 1..=5 {
            let m = sim.get("Tank.swinging").unwrap();
            assert!(m < last, "{k}: {m}");
            last = m;
            sim.run_until(Seconds::from_decimal(f64::from(k)).unwrap()).unwrap();
        }
        assert_eq!(sim.get("Tank.swinging").unwrap(), 0.0);
        assert_eq!(
            (sim.get("Slosh.frequency").unwrap(), sim.get("Slosh.force_x").unwrap()),
            (0.0, 0.0)
        );
        assert!(sim.get("Swing.p.x").unwrap().is_finite());
    }

    #[test]
    fn what_is_not_pressed_down_has_no_spring() {
        let m = Sloshing { p: SloshParams { damping: 0.05 } };
        let s = HingeState { angle: 0.1, rate: 0.2 };
        let u = SloshIn {
            x: s,
            y: s,
            swinging: 10.0,
            swing_height: 0.3,
            swing_stiffness: 4.0,
            acceleration: -1.0,
        };
        let y = m.feedthrough(&u);
        assert_eq!((y.force_x.0, y.frequency, y.added.mass), (0.0, 0.0, 10.0));
    }
}
