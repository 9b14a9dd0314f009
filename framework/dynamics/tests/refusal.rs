//! Error tests: invalid mechanisms and slices.

use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Vec3};
use linkwork_dynamics::*;

fn arm(hand: Hinge, mass: MassProperties) -> Multibody {
    let solid = MassProperties::new(1.0, Vec3::x() * 0.3, Mat3::identity() * 0.1);
    let mut b = Builder::new();
    b.body(BodySpec::new("arm", "world").hinge(Hinge::pin(Vec3::z())).mass(solid));
    b.body(BodySpec::new("hand", "arm").hinge(hand).mass(mass));
    b.build().unwrap()
}

fn run(mbs: &Multibody) -> Result<Vec<f64>, DynamicsError> {
    let tree = Tree::new(mbs);
    let mut ws = Workspace::new(&tree);
    let (q, v) = (mbs.random_q(1), mbs.random_v(1));
    let (mut tau, mut vdot) = (mbs.random_v(2), vec![0.0; mbs.nv()]);
    forward_dynamics(&tree, &mut ws, &q, &v, &mut tau, &mut vdot).map(|()| vdot)
}

#[test]
fn a_free_hinge_with_nothing_to_move_names_its_body() {
    let none = MassProperties::massless();
    for hinge in [Hinge::pin(Vec3::x()), Hinge::slider(Vec3::y()), Hinge::ball(), Hinge::free()] {
        let error = run(&arm(hinge.clone(), none)).unwrap_err();
        assert_eq!(error, DynamicsError::Singular { body: "hand".into(), v: 1 });
        assert!(error.to_string().contains("help: add mass to the body"), "{error}");
        // A prescribed hinge may carry a massless link.
        run(&arm(hinge.clone().prescribed(), none)).unwrap();
        if hinge != Hinge::free() {
            run(&arm(hinge.armature(0.1), none)).unwrap();
        }
    }
}

#[test]
fn a_state_that_is_not_finite_is_refused() {
    let solid = MassProperties::new(1.0, Vec3::x() * 0.3, Mat3::identity() * 0.1);
    let mbs = arm(Hinge::pin(Vec3::x()), solid);
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    let result = forward_dynamics(
        &tree,
        &mut ws,
        &[0.1, f64::NAN],
        &[0.0, 0.0],
        &mut [0.0, 0.0],
        &mut [0.0, 0.0],
    );
    assert!(result.is_err());
}

#[test]
#[should_panic(expected = "`q` has 1 numbers, the mechanism has 2")]
fn slices_of_the_wrong_length_are_refused() {
    let solid = MassProperties::new(1.0, Vec3::x() * 0.3, Mat3::identity() * 0.1);
    let tree = Tree::new(&arm(Hinge::pin(Vec3::x()), solid));
    kinematics(&tree, &mut Workspace::new(&tree), &[0.0], &[0.0, 0.0]);
}

#[test]
fn checked_algorithms_say_what_is_wrong() {
    let solid = MassProperties::new(1.0, Vec3::x() * 0.3, Mat3::identity() * 0.1);
    let mbs = arm(Hinge::free(), solid);
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    let (nq, nv) = (mbs.nq(), mbs.nv());
    let (q, v) = (mbs.random_q(1), mbs.random_v(1));
    let [mut a, mut b, mut M] = [vec![0.1; nv], vec![0.2; nv], vec![0.0; nv * nv]];
    let text = |e: InputError| e.to_string();
    let mut forward = |q: &[f64], v: &[f64], tau: &mut [f64]| {
        checked::forward_dynamics(&tree, &mut ws, q, v, tau, &mut b)
    };
    forward(&q, &v, &mut a).unwrap();
    let short = text(forward(&q[1..], &v, &mut a).unwrap_err());
    assert_eq!(
        short,
        format!("`q` has {} numbers, the mechanism has {nq}\n  help: give {nq} numbers", nq - 1)
    );
    let mut bad = v.clone();
    bad[2] = f64::NAN;
    let nan = text(forward(&q, &bad, &mut a).unwrap_err());
    assert_eq!(nan, "`v`: number 2 is NaN\n  help: give finite numbers");
    bad[2] = f64::INFINITY;
    assert!(text(forward(&q, &v, &mut bad).unwrap_err()).starts_with("`tau`: number 2 is inf"));
    let mut zero = q.clone();
    zero[nq - 4..].fill(0.0);
    let place = InputError::ZeroQuaternion { place: nq - 4 };
    assert_eq!(forward(&zero, &v, &mut a).unwrap_err(), place);
    let mut ws = Workspace::new(&tree);
    assert_eq!(checked::mass_matrix(&tree, &mut ws, &zero, &mut M).unwrap_err(), place);
    checked::mass_matrix(&tree, &mut ws, &q, &mut M).unwrap();
    checked::inverse_mass_matrix(&tree, &mut ws, &q, &mut M).unwrap();
    assert!(checked::inverse_mass_matrix(&tree, &mut ws, &q, &mut M[1..]).is_err());
    let mut tau = vec![0.0; nv];
    checked::inverse_dynamics(&tree, &mut ws, &q, &v, &a, &mut tau).unwrap();
    assert!(checked::inverse_dynamics(&tree, &mut ws, &q, &v, &a[1..], &mut tau).is_err());

    // All numbers are valid, but a massless arm cannot be inverted.
    let ghost = Tree::new(&arm(Hinge::pin(Vec3::x()), MassProperties::massless()));
    let mut ws = Workspace::new(&ghost);
    let error = checked::inverse_mass_matrix(&ghost, &mut ws, &[0.1, 0.2], &mut [0.0; 4]);
    assert!(matches!(error.unwrap_err(), InputError::Dynamics(DynamicsError::Singular { .. })));
}
