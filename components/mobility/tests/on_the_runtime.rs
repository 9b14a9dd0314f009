//! The wheel models inside a simulation: a quarter of a rover on one wheel, parked and driven, at 1 ms.
use linkwork_multibody::{BodySpec, Builder, Hinge, SubhingeKind};
use linkwork_plant::MechanismSpec;
use linkwork_runtime::*;
use linkwork_spatial::nalgebra::Matrix3;
use linkwork_spatial::{MassProperties, Pose};
use linkwork_surroundings::prelude::*;
use std::sync::Arc;

const SOIL: Soil = Soil {
    n: 1.0,
    n1: 0.0,
    k_c: 1400.0,
    k_phi: 8.2e5,
    cohesion: 170.0,
    friction_angle: 0.5759586531581288,
    shear_modulus: 0.018,
    a0: 0.4,
    a1: 0.15,
    lambda: 0.5,
    density: 1600.0,
    friction: 0.8,
};

/// Slope of a plane.
#[derive(Params, Clone, Debug)]
struct SlopeParams {
    /// Rise over run along x.
    slope: f64,
}
/// A plane rising along x.
struct Slope(f64);
impl Terrain for Slope {
    fn ground(&self, x: f64, _: f64) -> Option<Ground> {
        let normal = Vec3::new(-self.0, 0.0, 1.0).normalize();
        Some(Ground { height: self.0 * x, normal })
    }
    fn bounds(&self) -> [f64; 4] {
        [-1e3, -1e3, 1e3, 1e3]
    }
    fn soil(&self, _: f64, _: f64) -> &Soil {
        &SOIL
    }
    fn surface(&self) -> Surface {
        Surface { origin: [0.0; 2], spacing: [1.0; 2], nx: 0, ny: 0, heights: vec![] }
    }
}
/// A plane.
#[service("t.slope", Terrain)]
impl Service for Slope {
    type Params = SlopeParams;
    fn build(p: SlopeParams, _: &Files) -> Result<Self, BuildError> {
        Ok(Slope(p.slope))
    }
}

/// Mars.
#[derive(Params, Clone, Debug)]
struct NoParams {}
/// Gravity of Mars.
struct Mars;
impl linkwork_surroundings::Gravity for Mars {
    fn acceleration(&self, _: f64, _: Vec3) -> Vec3 {
        Vec3::new(0.0, 0.0, -3.72)
    }
    fn uniform(&self) -> Option<Vec3> {
        Some(Vec3::new(0.0, 0.0, -3.72))
    }
}
/// Gravity of Mars.
#[service("t.mars", Gravity)]
impl Service for Mars {
    type Params = NoParams;
    fn build(_: NoParams, _: &Files) -> Result<Self, BuildError> {
        Ok(Mars)
    }
}

/// Wanted rate.
#[derive(Params, Clone, Debug)]
struct DriveParams {
    /// Wanted rate.
    #[param(unit = "rad/s")]
    rate: f64,
}
/// A hinge.
#[derive(Ports, Clone, Copy, Debug)]
struct Shaft {
    /// The hinge.
    #[port(bind = "shaft")]
    shaft: HingeState,
}
/// A torque.
#[derive(Ports, Clone, Copy, Debug)]
struct Torque {
    /// The torque.
    #[port(bind = "shaft")]
    torque: HingeTorque,
}
/// A drive.
struct Drive {
    p: DriveParams,
}
/// Holds a rate; at rate 0 also the angle 0.
#[model("t.drive")]
impl Model for Drive {
    type Params = DriveParams;
    type FeedthroughInputs = Shaft;
    type FeedthroughOutputs = Torque;
    fn feedthrough(&self, u: &Shaft) -> Torque {
        let hold = if self.p.rate == 0.0 { -3e4 * u.shaft.angle } else { 0.0 };
        Torque { torque: HingeTorque(hold + 300.0 * (self.p.rate - u.shaft.rate)) }
    }
}

fn part(path: &str, model: &str, params: &[(&str, f64)]) -> PartSpec {
    let map = params.iter().map(|(k, v)| (k.to_string(), Value::Number(*v).into())).collect();
    PartSpec {
        path: path.into(),
        model: model.into(),
        model_origin: Origin::NONE,
        params: Value::Map(map).into(),
        rate: None,
        rate_origin: Origin::NONE,
        offset: Seconds::ZERO,
        origin: Origin::NONE,
        folder: None,
    }
}

fn bind(part: &str, bind: &str, target: BindTarget) -> BindSpec {
    BindSpec { part: part.into(), bind: bind.into(), target, origin: Origin::NONE }
}

/// A block of 145 kg that moves without turning, on a wheel of 5 kg with a geared rotor of 1 kg m².
fn rig(model: &str, slope: f64, rate: f64, integrator: Integrator) -> Simulation {
    let mut b = Builder::new();
    let solid = |m: f64, i: f64| MassProperties::new(m, Vec3::zeros(), Matrix3::identity() * i);
    let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
    b.body(
        BodySpec::new("block", "world")
            .hinge(Hinge::chain(axes.map(|axis| SubhingeKind::Slider { axis })))
            .mass(solid(145.0, 10.0)),
    );
    b.body(
        BodySpec::new("wheel", "block")
            .hinge(Hinge::pin(Vec3::y()).armature(1.0))
            .mass(solid(5.0, 0.15)),
    );
    b.node("wheel/hub", "wheel", Pose::identity());
    let multibody = Arc::new(b.build().expect("a mechanism"));
    let mut q = multibody.neutral_q();
    q[2] = 0.25 * (1.0 + slope * slope).sqrt() - 0.002;
    let v = vec![0.0; 4];
    let spec = Spec {
        parts: vec![
            part("ground", "t.slope", &[("slope", slope)]),
            part("gravity", "t.mars", &[]),
            part("drive", "t.drive", &[("rate", rate)]),
            part("contact", model, &[("radius", 0.25), ("width", 0.4)]),
        ],
        binds: vec![
            bind("drive", "shaft", BindTarget::Hinge { body: "wheel".into(), index: 0 }),
            bind("contact", "hub", BindTarget::Node("wheel/hub".into())),
        ],
        host: Some(Box::new(MechanismSpec::new("Mechanism", multibody, q, v))),
        integrator,
        step: Seconds { num: 1, den: 1000 },
        ..Spec::default()
    };
    let catalogue = Catalogue::new([
        linkwork_mobility::catalogue(),
        vec![Entry::service::<Slope>(), Entry::service::<Mars>(), Entry::model::<Drive>()],
    ]);
    let plan = compile(&spec, &catalogue, &Files::default()).unwrap_or_else(|e| panic!("{e}"));
    Simulation::new(Arc::new(plan))
}

fn seconds(x: f64) -> Seconds {
    Seconds::from_decimal(x).expect("a time")
}

/// Where the ground bears the wheel.
fn position(sim: &Simulation) -> [f64; 3] {
    ["x", "y", "z"].map(|k| sim.get(&format!("contact.contact_point.{k}")).expect("a variable"))
}

#[test]
fn a_parked_wheel_holds_on_a_slope() {
    for model in ["mobility.wheel_rigid", "mobility.wheel_soil"] {
        for integrator in [Integrator::SemiImplicitEuler, Integrator::Rk4] {
            for slope_deg in [5.0, 15.0, 25.0_f64] {
                let mut sim = rig(model, slope_deg.to_radians().tan(), 0.0, integrator);
                sim.run_until(seconds(30.0)).expect("a run");
                let before = position(&sim);
                sim.run_until(seconds(40.0)).expect("a run");
                let after = position(&sim);
                let creep = (0..3).map(|k| (after[k] - before[k]).abs()).fold(0.0, f64::max) / 10.0;
                println!("{model} {integrator:?} {slope_deg}°: {creep:e} m/s");
                assert!(
                    creep < 1e-7 && before[0].abs() < 0.12,
                    "{model} {slope_deg}: {creep} {before:?}"
                );
            }
        }
    }
}

#[test]
fn a_driven_wheel_advances_with_its_rim() {
    for (model, slip_max) in [("mobility.wheel_rigid", 1e-3), ("mobility.wheel_soil", 0.1)] {
        for integrator in [Integrator::SemiImplicitEuler, Integrator::Rk4] {
            let mut sim = rig(model, 0.0, 0.16, integrator);
            sim.run_until(seconds(20.0)).expect("a run");
            let before = position(&sim);
            sim.run_until(seconds(30.0)).expect("a run");
            let speed = (position(&sim)[0] - before[0]) / 10.0;
            // The drive is slower under torque, so use the rate that it has.
            let turned = sim.get("wheel.rate").expect("a variable") * 0.25;
            let slip = 1.0 - speed / turned;
            println!("{model} {integrator:?}: slip {slip:.5}");
            assert!(slip > -1e-3 && slip < slip_max, "{model}: {speed} of {turned}");
        }
    }
}
