//! Damping, friction and stops of hinges: against closed forms, with and without contact, and warnings.
use crate::common::*;
use linkwork_collision::{Colliders, Rules};
use linkwork_multibody::{BodySpec, Builder, Friction, Hinge, Limits, Spring, Stop};
use linkwork_plant::*;
use linkwork_runtime::*;
use linkwork_solvers::ContactSettings;
use linkwork_spatial::nalgebra::Matrix3;
use linkwork_spatial::{MassProperties, Vec3};
use std::sync::{Arc, Mutex};

const MASS: f64 = 1.3;
const ARM: f64 = 0.6;
const GRAVITY: f64 = 3.71;
/// About the pin: 0.23 about the centre of mass.
const INERTIA: f64 = 0.23 + MASS * ARM * ARM;
/// MASS · GRAVITY · ARM / INERTIA, rad/s².
const PULL: f64 = MASS * GRAVITY * ARM / INERTIA;

#[derive(Clone, Copy, PartialEq)]
enum Contact {
    Off,
    On,
}

/// A bar on a hinge at the world with its centre of mass at `com`, in gravity `g` along −z.
fn bar(hinge: Hinge, com: [f64; 3], g: f64, start: (Vec<f64>, Vec<f64>), contact: Contact) -> Spec {
    let mut b = Builder::new();
    let inertia = Matrix3::from_diagonal(&Vec3::new(0.23, 0.23, 0.23));
    b.body(BodySpec::new("bar", "world").hinge(hinge).mass(MassProperties::new(
        MASS,
        com.into(),
        inertia,
    )));
    let multibody = Arc::new(b.build().unwrap());
    let mut s = spec(vec![part("world.gravity", "t.gravity", &[], None)], &[]);
    let lane = |x: f64| Value::Number(x).into();
    let g = Value::List(vec![lane(0.0), lane(0.0), lane(-g)]);
    s.parts[0].params = Value::Map(vec![("g".into(), g.into())]).into();
    let mut m = MechanismSpec::new("Mechanism", multibody.clone(), start.0, start.1);
    m.step = Some(0.001);
    if contact == Contact::On {
        let colliders = Colliders::new(Vec::new(), Rules::default(), &multibody).unwrap();
        let settings = ContactSettings::default();
        m.contact = Some(ContactSpec { colliders: Arc::new(colliders), settings });
    }
    s.set_mechanism(m);
    s.integrator = Integrator::Rk4;
    s.step = seconds(0.001);
    s
}

fn pin() -> Hinge {
    Hinge::pin(Vec3::y())
}

/// Hangs down: stable at 0.
fn pendulum(hinge: Hinge, q: f64, v: f64, contact: Contact) -> Spec {
    bar(hinge, [0.0, 0.0, -ARM], GRAVITY, (vec![q], vec![v]), contact)
}

/// Stands out along x: falls towards positive angles.
fn flag(hinge: Hinge, contact: Contact) -> Spec {
    bar(hinge, [ARM, 0.0, 0.0], GRAVITY, (vec![0.0], vec![0.0]), contact)
}

/// (t, q, q̇) after each step.
fn track(spec: &Spec, steps: u32) -> Vec<[f64; 3]> {
    let plan = plan(spec);
    let at = plan.mechanism().unwrap().x;
    let mut sim = Simulation::new(plan);
    let mut out = Vec::new();
    for k in 0..=steps {
        let t = f64::from(k) * 0.001;
        sim.run_until(Seconds::new(u128::from(k), 1000).unwrap()).unwrap();
        out.push([t, sim.state().x[at], sim.state().x[at + 1]]);
    }
    out
}

fn energy(q: f64, v: f64) -> f64 {
    0.5 * INERTIA * v * v - MASS * GRAVITY * ARM * q.cos()
}

#[test]
fn a_small_swing_decays_as_its_closed_form() {
    let d = 0.31;
    let (a, swing) = (0.5 * d / INERTIA, 1e-4);
    let w = (PULL - a * a).sqrt();
    let track = track(&pendulum(pin().damping(d), swing, 0.0, Contact::Off), 4000);
    let mut worst = 0.0f64;
    for [t, q, _] in track {
        let exact = swing * (-a * t).exp() * ((w * t).cos() + a / w * (w * t).sin());
        assert!(q.is_finite());
        worst = worst.max((q - exact).abs());
    }
    // Measured: 1.2e-13, from the nonlinearity of the sine (of order swing³). Without damping the
    // difference would be 1e-4.
    assert!(worst < 1e-12, "{worst:e}");
}

#[test]
fn a_large_swing_loses_the_work_of_its_damping() {
    let d = 0.31;
    let track = track(&pendulum(pin().damping(d), 2.0, 0.7, Contact::Off), 2000);
    let power = |k: usize| d * track[k][2] * track[k][2];
    // The integral uses Simpson's rule.
    let lost: f64 = (0..1000)
        .map(|i| (power(2 * i) + 4.0 * power(2 * i + 1) + power(2 * i + 2)) * 0.001 / 3.0)
        .sum();
    let [first, last] = [track[0], track[2000]].map(|[_, q, v]| energy(q, v));
    assert!(lost > 1.0, "{lost}");
    // Measured: 8e-13.
    assert!((first - last - lost).abs() < 1e-11 * lost, "{:e}", first - last - lost);
}

#[test]
fn rates_of_a_ball_decay_each() {
    let d = 0.4;
    let start = (vec![0.0, 0.0, 0.0, 1.0], vec![0.3, -1.0, 0.6]);
    let spec = bar(Hinge::ball().damping(d), [0.0; 3], 0.0, start.clone(), Contact::Off);
    let plan = plan(&spec);
    let at = plan.mechanism().unwrap().x + 4;
    let mut sim = Simulation::new(plan);
    sim.run_until(seconds(1.0)).unwrap();
    for (v, v0) in sim.state().x[at..at + 3].iter().zip(&start.1) {
        let exact = v0 * (-d / 0.23f64).exp();
        assert!((v - exact).abs() < 1e-12, "{v} {exact}");
    }
}

#[test]
fn damping_acts_with_contact_to_first_order() {
    let d = 0.31;
    let run = |contact| {
        let spec = bar(pin().damping(d), [0.0; 3], 0.0, (vec![0.0], vec![2.0]), contact);
        track(&spec, 1000)[1000][2]
    };
    let exact = 2.0 * (-d / 0.23f64).exp();
    assert!((run(Contact::Off) - exact).abs() < 1e-12);
    let stepped = (run(Contact::On) - exact).abs() / exact;
    // Measured: 9.09e-4, as predicted to first order by h d² t / 2 I².
    assert!((5e-4..2e-3).contains(&stepped), "{stepped:e}");
}

#[test]
fn a_bar_that_falls_on_its_stop_stays_within_the_stated_distance() {
    let hinge = pin().limits(Limits::position(-1.0, 0.3));
    let spec = flag(hinge, Contact::Off);
    assert!(plan(&spec).warnings.is_empty());
    let track = track(&spec, 6000);
    let fastest = (2.0 * PULL * 0.3f64.sin()).sqrt();
    let h = 0.001;
    let allowed = 5.0 * h * fastest + 50.0 * h * h * PULL;
    let deepest = track.iter().map(|x| x[1]).fold(f64::NEG_INFINITY, f64::max) - 0.3;
    // Measured: 0.0058 of 0.0080 rad allowed.
    assert!(deepest > 0.2 * allowed && deepest < allowed, "{deepest} {allowed}");
    // It comes to rest in the stop, where spring and weight balance.
    let [_, q, v] = track[6000];
    let rest = PULL * 0.3f64.cos() * (h / 0.2) * (h / 0.2);
    assert!(v.abs() < 1e-3 && (q - 0.3 - rest).abs() < 0.1 * rest, "{q} {v} {rest}");
    // Energy never comes out of the stop: heights between impacts only fall.
    let up = track.windows(3).filter(|w| w[0][1] > w[1][1] && w[1][1] <= w[2][1]);
    let tops: Vec<f64> = up.map(|w| w[1][1]).filter(|q| *q < 0.3).collect();
    assert!(!tops.is_empty() && tops.is_sorted(), "{tops:?}");
    // Without a stop the bar keeps swinging.
    let free = flag(pin().limits(Limits::position(-1.0, 0.3)).stop(Stop::Off), Contact::Off);
    assert!(plan(&free).warnings.is_empty());
    assert!(self::track(&free, 2000).iter().any(|x| x[1] > 1.5));
}

#[test]
fn no_impact_on_a_usual_stop_gives_energy_or_goes_too_deep() {
    let hinge = pin().limits(Limits::position(-1.0, 0.3));
    // `steps` is the permitted depth in units of the motion per step. Measured: 0.996 × 5, and
    // 1.0006 × 5 for the first-order method, which is therefore permitted one step more.
    for (integrator, steps) in [
        (Integrator::Rk4, 5.0),
        (Integrator::SemiImplicitEuler, 6.0),
        (Integrator::BogackiShampine, 5.0),
        (Integrator::DormandPrince, 5.0),
        (Integrator::Verner, 5.0),
        (Integrator::Rodas, 5.0),
    ] {
        for speed in [0.01, 0.1, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0] {
            let start = (vec![0.3 - 1e-7], vec![speed]);
            let mut spec = bar(hinge.clone(), [0.0; 3], 0.0, start, Contact::Off);
            spec.integrator = integrator;
            let track = track(&spec, 60);
            let deepest = track.iter().map(|x| x[1]).fold(0.0, f64::max) - 0.3;
            let back = -track[60][2];
            assert!(deepest > 0.0 && deepest < 0.001 * steps * speed, "{speed}: {deepest}");
            assert!(back.is_finite() && back < speed && track[60][1] < 0.3 + deepest, "{back}");
        }
    }
}

#[test]
fn a_stop_never_pulls() {
    // The bar is inside the stop and leaves it faster than 1/c, so the stop exerts no force.
    let stop = Stop::Soft { stiffness: 400.0, damping: 1.0 };
    let hinge = pin().limits(Limits::position(-1.0, 0.3)).stop(stop);
    let spec = bar(hinge, [0.0; 3], 0.0, (vec![0.5], vec![-5.0]), Contact::Off);
    for [t, q, v] in track(&spec, 100) {
        assert!(v == -5.0 && (q - (0.5 - 5.0 * t)).abs() < 1e-12, "{t} {q} {v}");
    }
}

#[test]
fn a_written_stop_has_its_stiffness_and_contact_its_own() {
    let stop = Stop::Soft { stiffness: 400.0, damping: 3.0 };
    let hinge = pin().limits(Limits::position(-0.3, 0.3)).stop(stop).damping(0.2);
    let [_, q, _] = track(&flag(hinge.clone(), Contact::Off), 8000)[8000];
    // The spring balances the weight.
    let sag = MASS * GRAVITY * ARM * q.cos() / 400.0;
    assert!((q - 0.3 - sag).abs() < 1e-4 * sag, "{q} {sag}");
    let deepest = track(&flag(hinge, Contact::On), 2000).iter().map(|x| x[1]).fold(0.0, f64::max);
    // With contact the limit is a constraint row, which leaves a residual of 1e-4.
    assert!(deepest > 0.29 && deepest < 0.3 + 2e-4, "{deepest}");
}

#[test]
fn smooth_friction_creeps_and_friction_with_contact_sticks() {
    let weight = MASS * GRAVITY * ARM;
    let friction = Friction { force: 1.5 * weight, rate: 0.01 };
    let [_, q, v] = track(&flag(pin().friction(friction), Contact::Off), 1000)[1000];
    // The velocity follows from force tanh(v / rate) = weight · cos q.
    let creep = 0.01 * (q.cos() / 1.5f64).atanh();
    assert!((v - creep).abs() < 1e-6 && q > 0.005, "{q} {v} {creep}");
    let [_, q, v] = track(&flag(pin().friction(friction), Contact::On), 1000)[1000];
    assert!(q.abs() < 1e-6 && v.abs() < 1e-6, "{q} {v}");
    let slips = Friction { force: 0.5 * weight, ..friction };
    let [_, q, _] = track(&flag(pin().friction(slips), Contact::On), 1000)[1000];
    assert!(q > 0.3, "{q}");
}

#[test]
fn what_cannot_act_is_a_warning_with_place_and_remedy() {
    let limits = Limits::position(-0.2, 0.2);
    let told = |mut spec: Spec, step: Option<f64>| -> Vec<String> {
        let m = spec.mechanism_mut().unwrap();
        m.step = step;
        Arc::make_mut(&mut m.bodies).insert("bar".into(), Origin::in_file(0, 7, 9));
        let plan = plan(&spec);
        assert!(plan.warnings.iter().all(|w| w.origin.start == 7 && w.help.is_some()));
        plan.warnings.iter().map(|w| w.message.clone()).collect()
    };
    let h = Some(0.001);
    let limited = || pin().limits(limits);
    let said = told(flag(limited(), Contact::Off), None);
    assert!(said.len() == 1 && said[0].contains("its limits have no effect"), "{said:?}");
    assert!(told(flag(limited(), Contact::On), None).is_empty());
    assert!(told(flag(limited(), Contact::Off), h).is_empty());
    let said = told(pendulum(limited(), 0.5, 0.0, Contact::Off), h);
    assert!(said.len() == 1 && said[0].contains("outside its limits"), "{said:?}");
    let said = told(pendulum(limited(), 0.5, 0.0, Contact::On), h);
    assert!(said.len() == 1 && said[0].contains("outside its limits"), "{said:?}");
    let rubs = || pin().friction(Friction { force: 0.3, rate: 0.0 });
    let said = told(flag(rubs(), Contact::Off), h);
    assert!(said.len() == 1 && said[0].contains("`friction` has no effect: it is dry"), "{said:?}");
    assert!(told(flag(rubs(), Contact::On), h).is_empty());
    // The greatest damping that a step can follow: 2 I / h.
    let most = 2.0 * INERTIA / 0.001;
    for contact in [Contact::Off, Contact::On] {
        assert!(told(flag(pin().damping(0.99 * most), contact), h).is_empty());
        let said = told(flag(pin().damping(1.01 * most), contact), h);
        assert!(said.len() == 1 && said[0].contains("unstable"), "{said:?}");
    }
}

#[test]
fn prescribed_coordinates_and_limits_out_of_reach_change_no_bits() {
    let hash = |hinge: Hinge| {
        let mut sim = Simulation::new(plan(&pendulum(hinge, 0.7, 0.4, Contact::Off)));
        sim.run_until(seconds(1.0)).unwrap();
        sim.state().x.iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    let far = Limits::position(-2.0, 2.0);
    assert_eq!(hash(pin().limits(far)), hash(pin()));
    assert_ne!(hash(pin().limits(Limits::position(-0.5, 0.72))), hash(pin()));
    let all = pin().limits(far).damping(0.5).friction(Friction { force: 1.0, rate: 0.1 });
    assert_eq!(hash(all.clone().prescribed()), hash(pin().prescribed()));
    assert_ne!(hash(all), hash(pin()));
}

/// The accounts of the mechanism in the balance of energy, at every instant.
struct Accounts(Arc<Mutex<Vec<Vec<f64>>>>);

impl Observer for Accounts {
    fn instant(&mut self, _: Times, values: &[f64]) {
        self.0.lock().unwrap().push(values.to_vec());
    }
    fn stretch(&mut self, _: &mut Stretch<'_>) {}
}

/// Returns the accounts at each ms of two seconds, the amounts first: kinetic, potential and elastic energy, then the power of losses. Each comes with the state.
fn accounts(spec: &Spec) -> Vec<(Vec<f64>, Vec<f64>)> {
    let plan = plan(spec);
    let mechanism = plan.parts.iter().find(|p| p.path == "Mechanism").unwrap();
    let names: Vec<&str> =
        mechanism.prototype.accounts().known.iter().map(|account| account.name).collect();
    assert_eq!(names[2..4], ["springs of hinges", "friction and stops of hinges"]);
    let seen = Arc::new(Mutex::new(Vec::new()));
    let request = ObserverRequest {
        accounts: vec![("Mechanism".into(), names.len())],
        ..ObserverRequest::default()
    };
    let mut sim = Simulation::new(plan);
    sim.observe(&request, Box::new(Accounts(seen.clone())));
    let mut out = Vec::new();
    for k in 1..=2000 {
        sim.run_until(Seconds::new(k, 1000).unwrap()).unwrap();
        sim.observe_now();
        let last = seen.lock().unwrap().last().unwrap().clone();
        out.push((last, sim.state().x.clone()));
    }
    out
}

#[test]
fn a_spring_stores_energy_and_a_damper_loses_it() {
    let spring = |hinge: Hinge, rest: f64| {
        let mut hinge = hinge;
        hinge.subhinges[0].spring = Spring { stiffness: 4.0, rest };
        hinge
    };
    let elastic = |x: &[f64]| 0.5 * 4.0 * (x[0] - 0.3) * (x[0] - 0.3);
    let free = accounts(&pendulum(spring(pin(), 0.3), 1.2, 0.5, Contact::Off));
    let whole = energy(1.2, 0.5) + elastic(&[1.2]);
    for (y, x) in &free {
        assert!((y[2] - elastic(x)).abs() < 1e-14, "{y:?}");
        assert_eq!(y[3], 0.0);
        // Measured: 3e-12.
        assert!((y[0] + y[1] + y[2] - whole).abs() < 1e-10, "{y:?} {whole}");
    }
    let damped = accounts(&pendulum(spring(pin(), 0.3).damping(0.4), 1.2, 0.5, Contact::Off));
    let mut left = whole;
    let mut before = -0.4 * 0.5 * 0.5;
    for (y, x) in &damped {
        assert!((y[3] + 0.4 * x[1] * x[1]).abs() < 1e-14, "{y:?}");
        left += 0.5 * 1e-3 * (before + y[3]);
        before = y[3];
        // The trapezoidal rule with 1 ms has an error of some 1e-6 J; the spring takes 1 J.
        assert!((y[0] + y[1] + y[2] - left).abs() < 1e-5, "{y:?} {left}");
    }
    // The ball is rotated by 0.9 rad about an oblique axis.
    let turn = linkwork_spatial::Quat::from_scaled_axis(Vec3::new(0.6, -0.6, 0.3));
    let q = turn.coords.iter().copied().collect::<Vec<_>>();
    let start = (q, vec![0.3, -0.2, 0.5]);
    let ball = bar(spring(Hinge::ball(), 0.0), [0.0, 0.0, -ARM], GRAVITY, start, Contact::Off);
    let all = accounts(&ball);
    let sum = |y: &[f64]| y[0] + y[1] + y[2];
    for (y, x) in &all {
        // θ is the rotation angle of the quaternion (x, y, z, w).
        let theta = 2.0 * Vec3::new(x[0], x[1], x[2]).norm().atan2(x[3].abs());
        assert!((y[2] - 2.0 * theta * theta).abs() < 1e-12, "{y:?} {theta}");
        assert!((sum(y) - sum(&all[0].0)).abs() < 1e-9, "{y:?}");
    }
}
