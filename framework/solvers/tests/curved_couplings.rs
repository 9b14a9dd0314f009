//! Couplings with higher powers of a coordinate, compared with the closed form of a cam and its follower.
//!
//! ```text
//! y = p(x) = a + b x + c x² + d x³ + e x⁴        masses m of the cam (x), n of the follower (y), forces f on x and g on y
//! (m + n p'²) ẍ = f + p' g − n p' p'' ẋ²         ÿ = p' ẍ + p'' ẋ²        force in the coupling λ = n ÿ − g
//! ```
use crate::dynamics_support::close;
use linkwork_dynamics::multibody::{
    BodySpec, Builder, ConstraintId, Coupling, Hinge, HingeCoordinate, Multibody, Powers, Term,
};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Vec3};
use linkwork_dynamics::{Tree, Workspace};
use linkwork_solvers::{
    ConstrainedSolver, ConstraintMethod, FixedValues, FullyAugmentedSolver, close_start,
};

const P: [f64; 5] = [0.2, 0.7, -0.9, 0.4, 0.25];
const MASSES: [f64; 2] = [1.5, 0.8];

/// p, p' and p'' at x.
fn law(x: f64) -> [f64; 3] {
    let [a, b, c, d, e] = P;
    [
        a + x * (b + x * (c + x * (d + x * e))),
        b + x * (2.0 * c + x * (3.0 * d + x * 4.0 * e)),
        2.0 * c + x * (6.0 * d + x * 12.0 * e),
    ]
}

fn at(body: &str) -> HingeCoordinate {
    HingeCoordinate { body: body.into(), subhinge: 0 }
}

/// y − b x − c x² − d x³ − e x⁴ = a, multiplied by a scale.
fn coupling(scale: f64) -> Coupling {
    let [a, b, c, d, e] = P.map(|x| scale * x);
    let terms = vec![
        Term { coordinate: at("follower"), factor: scale },
        Term { coordinate: at("cam"), factor: -b },
    ];
    let powers = vec![Powers { coordinate: at("cam"), factors: [-c, -d, -e] }];
    Coupling { powers, ..Coupling::linear("law", terms, a) }
}

fn machine(coupling: Coupling) -> Multibody {
    let mut b = Builder::new();
    for (name, axis, mass) in [("cam", Vec3::x(), MASSES[0]), ("follower", Vec3::y(), MASSES[1])] {
        let mass = MassProperties::new(mass, Vec3::zeros(), Mat3::identity());
        b.body(BodySpec::new(name, "world").hinge(Hinge::slider(axis)).mass(mass));
    }
    b.coupling(coupling);
    b.build().unwrap()
}

/// ẍ, ÿ and λ of the closed form.
fn closed_form(x: f64, rate: f64, [f, g]: [f64; 2]) -> [f64; 3] {
    let ([m, n], [_, s, c]) = (MASSES, law(x));
    let first = (f + s * g - n * s * c * rate * rate) / (m + n * s * s);
    let second = s * first + c * rate * rate;
    [first, second, n * second - g]
}

#[test]
fn every_method_has_the_accelerations_and_the_force_of_the_closed_form() {
    let scale = 3.0;
    let mbs = machine(coupling(scale));
    assert!(!mbs.couplings()[0].is_linear());
    let tree = Tree::new(&mbs);
    let id = ConstraintId::Coupling(0);
    for (x, rate, forces) in [(0.6, 1.3, [2.0, -3.0]), (-1.1, -0.8, [0.4, 1.7])] {
        let [y, slope, _] = law(x);
        let (q, v) = ([x, y], [rate, slope * rate]);
        let want = closed_form(x, rate, forces);
        assert!(mbs.couplings()[0].error(&q).abs() < 1e-14);
        assert!(mbs.couplings()[0].rate(&q, &v).abs() < 1e-14);
        let mut full = FullyAugmentedSolver::new(&tree).unwrap();
        let (mut ws, mut tau, mut vdot) = (Workspace::new(&tree), forces, [0.0; 2]);
        full.forward(&tree, &mut ws, (&q, &v), &[], &mut tau, &mut vdot).unwrap();
        close(&vdot, &want[..2], 1e-13, "fully augmented");
        close(full.forces(&tree, id), &[want[2] / scale], 1e-13, "its force");
        // `Embed` uses a multiplier, too: the rates that an aggregate eliminates have constant factors.
        for method in [ConstraintMethod::Augment, ConstraintMethod::Auto, ConstraintMethod::Embed] {
            let mut solver = ConstrainedSolver::new(&tree, |_| method);
            let (mut tau, mut vdot) = (forces, [0.0; 2]);
            solver.forward(&tree, &mut ws, (&q, &v), &[], &mut tau, &mut vdot).unwrap();
            close(&vdot, &want[..2], 1e-13, "tree-augmented");
            close(solver.forces(&tree, id), &[want[2] / scale], 1e-13, "its force");
        }
    }
}

/// A weight on the follower drives the cam: after 2 s, the energy and the coupling have the accuracy of the integrator.
#[test]
fn energy_is_kept_and_the_follower_stays_on_the_curve() {
    let tree = Tree::new(&machine(coupling(1.0)));
    let mut solver = ConstrainedSolver::new(&tree, |_| ConstraintMethod::Augment);
    let mut ws = Workspace::new(&tree);
    let weight = -9.0 * MASSES[1];
    let mut rates = |s: [f64; 4]| {
        let (mut tau, mut vdot) = ([0.0, weight], [0.0; 2]);
        let state = (&s[..2], &s[2..]);
        solver.forward(&tree, &mut ws, state, &[], &mut tau, &mut vdot).unwrap();
        [s[2], s[3], vdot[0], vdot[1]]
    };
    let energy =
        |s: [f64; 4]| 0.5 * (MASSES[0] * s[2] * s[2] + MASSES[1] * s[3] * s[3]) - weight * s[1];
    let mut s = [0.3, law(0.3)[0], 0.5, 0.5 * law(0.3)[1]];
    let (start, h) = (energy(s), 1e-3);
    for _ in 0..2000 {
        let plus = |k: [f64; 4], h: f64| std::array::from_fn(|i| s[i] + h * k[i]);
        let a = rates(s);
        let b = rates(plus(a, 0.5 * h));
        let c = rates(plus(b, 0.5 * h));
        let d = rates(plus(c, h));
        s = std::array::from_fn(|i| s[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    assert!((s[0] - 0.3).abs() > 0.5, "it has moved: {s:?}");
    assert!((energy(s) - start).abs() < 1e-8 * start.abs(), "{} {start}", energy(s));
    assert!((s[1] - law(s[0])[0]).abs() < 1e-8, "{s:?}");
}

#[test]
fn factor_and_bias_are_the_derivatives_of_the_error() {
    let mbs = machine(coupling(2.0));
    let c = &mbs.couplings()[0];
    let (q, v, h) = ([0.7, 0.1], [1.2, -0.4], 1e-5);
    let moved = |t: f64| [q[0] + t * v[0], q[1] + t * v[1]];
    let (before, after) = (c.error(&moved(-h)), c.error(&moved(h)));
    assert!((c.rate(&q, &v) - (after - before) / (2.0 * h)).abs() < 1e-8);
    let bias = (after - 2.0 * c.error(&q) + before) / (h * h);
    assert!((c.bias(&q, &v) - bias).abs() < 1e-4, "{} {bias}", c.bias(&q, &v));
    for (k, (at, ..)) in c.terms.iter().enumerate() {
        let moved = |by: f64| {
            let mut q = q;
            q[*at] += by;
            c.error(&q)
        };
        let slope = (moved(h) - moved(-h)) / (2.0 * h);
        assert!((c.factor(k, &q) - slope).abs() < 1e-8, "{k}: {} {slope}", c.factor(k, &q));
    }
}

/// The start moves the follower onto the curve and leaves the cam where it is.
#[test]
fn a_start_is_closed_with_the_given_cam() {
    let tree = Tree::new(&machine(coupling(1.0)));
    let kept = FixedValues { positions: vec![true, false], rates: vec![true, false] };
    let (mut q, mut v) = ([0.8, 0.0], [0.6, 0.0]);
    close_start(&tree, &[], &kept, &mut q, &mut v).unwrap();
    let [y, slope, _] = law(0.8);
    close(&q, &[0.8, y], 1e-12, "coordinates");
    close(&v, &[0.6, 0.6 * slope], 1e-12, "rates");
}

#[test]
fn powers_need_a_term_and_finite_factors() {
    let built = |c: Coupling| {
        let mut b = Builder::from(&machine(coupling(1.0)));
        b.couplings_mut()[0] = c;
        b.build().map_err(|e| e.to_string())
    };
    let other = Powers { coordinate: at("cam"), factors: [1.0, 0.0, 0.0] };
    let mut twice = coupling(1.0);
    twice.powers.push(other.clone());
    assert!(built(twice).unwrap_err().contains("appears twice"));
    let alone = Coupling {
        powers: vec![other],
        ..Coupling::linear("law", vec![Term { coordinate: at("follower"), factor: 1.0 }], 0.0)
    };
    assert!(built(alone).unwrap_err().contains("higher powers and no term"));
    let mut odd = coupling(1.0);
    odd.powers[0].factors[1] = f64::NAN;
    assert!(built(odd).unwrap_err().contains("NaN"));
    // Powers that are all zero leave a linear coupling, which can be embedded.
    let mut straight = coupling(1.0);
    straight.powers[0].factors = [0.0; 3];
    assert!(built(straight).unwrap().couplings()[0].is_linear());
}
