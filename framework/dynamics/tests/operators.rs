//! Operators as values: identities compared with dense algebra and the kernels, cost, errors.

use crate::support::{Rng, Shape, close, random_tree};
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::nalgebra::DMatrix;
use linkwork_dynamics::spatial::{MassProperties, Mat3, Motion, Pose, Vec3};
use linkwork_dynamics::*;
use linkwork_operators::*;

struct Case {
    mbs: Multibody,
    tree: Tree,
    ws: Workspace,
    q: Vec<f64>,
    v: Vec<f64>,
}

fn case_of(mbs: Multibody, seed: u64) -> Case {
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    let (q, v) = (mbs.random_q(seed), mbs.random_v(seed));
    kinematics(&tree, &mut ws, &q, &v);
    Case { mbs, tree, ws, q, v }
}

fn case(seed: u64, prescribed: bool) -> Case {
    let shape = Shape {
        bodies: 9,
        floating: seed.is_multiple_of(2),
        prescribed,
        armature: seed.is_multiple_of(3),
    };
    case_of(random_tree(seed, shape), seed)
}

fn mass(c: &mut Case) -> DMatrix<f64> {
    let nv = c.mbs.nv();
    let mut M = vec![0.0; nv * nv];
    mass_matrix(&c.tree, &mut c.ws, &mut M);
    DMatrix::from_row_slice(nv, nv, &M)
}

/// Largest difference, relative to the largest entry of `b`; NaN is infinite.
#[track_caller]
fn same(a: &DMatrix<f64>, b: &DMatrix<f64>, tol: f64, what: &str) {
    assert_eq!(a.shape(), b.shape(), "{what}");
    close(a.as_slice(), b.as_slice(), tol, what);
}

/// Returns the rows and columns in `keep`.
fn pick(M: &DMatrix<f64>, keep: &[usize]) -> DMatrix<f64> {
    M.select_rows(keep).select_columns(keep)
}

#[test]
fn the_mass_matrix_its_factors_and_its_inverse_agree_with_dense_algebra() {
    for seed in 0..60 {
        let mut c = case(seed, false);
        let M = mass(&mut c);
        let ops = Operators::new(&c.tree, &c.ws).unwrap();
        let (I, H, phi, psi, K, D) =
            (ops.identity(), ops.H(), ops.phi(), ops.psi(), ops.K(), ops.D());
        let what = |text: &str| format!("seed {seed}, {text}");

        let newton = &H * &phi * ops.M() * phi.t() * H.t() + ops.J();
        same(&newton.dense().unwrap(), &M, 1e-13, &what("HφMφ*H* + J"));
        let L = &I + &H * &phi * &K;
        let factors = &L * &D * L.t();
        same(&factors.dense().unwrap(), &M, 1e-13, &what("(I+HφK) D (I+HφK)*"));

        let W = &I - &H * &psi * &K;
        let inverse = W.t() * D.inverse().unwrap() * &W;
        // The error is relative to the sum of products, so that a large M and a small inverse have
        // equal weight.
        let dense = inverse.dense().unwrap();
        let unit = (M.abs() * dense.abs()).max();
        let error = (&M * &dense - DMatrix::identity(c.mbs.nv(), c.mbs.nv())).abs().max();
        assert!(error <= 1e-13 * unit, "seed {seed}: M times its inverse is off by {error:e}");

        // Each expression is recognised as the inverse of the other.
        let found = newton.inverse().unwrap();
        assert_eq!(found.to_string(), "(I − H ψ K)* D⁻¹ (I − H ψ K)");
        same(&found.dense().unwrap(), &dense, 0.0, &what("inverse of HφMφ*H* + J"));
        let back = inverse.inverse().unwrap();
        assert_eq!(back.to_string(), "(I + H φ K) D (I + H φ K)*");
        same(&back.dense().unwrap(), &M, 1e-13, &what("inverse of the inverse"));
    }
}

#[test]
fn each_operator_and_its_transposed_and_its_inverse_are_what_they_say() {
    for seed in 0..30 {
        let c = case(seed, seed.is_multiple_of(2));
        let ops = Operators::new(&c.tree, &c.ws).unwrap();
        let (H, phi, psi) = (ops.H(), ops.phi(), ops.psi());
        let nodes: Vec<_> = c.mbs.node_ids().collect();
        let all = [
            H.clone(),
            phi.clone(),
            psi.clone(),
            ops.e_phi(),
            ops.e_psi(),
            ops.K(),
            ops.G(),
            ops.M(),
            ops.P(),
            ops.D(),
            ops.D_inv(),
            ops.J(),
            ops.upsilon(),
            ops.B(&nodes),
            ops.identity() + 2.0 * (&H * &phi * ops.K()),
            (ops.identity() - ops.e_phi()) * ops.P() * -3.5,
        ];
        for op in &all {
            let (A, At) = (op.dense().unwrap(), op.t().dense().unwrap());
            same(&At, &A.transpose(), 1e-14, &format!("seed {seed}: ({op})*"));
            // Check products with a vector, and of the transpose with a vector.
            let mut r = Rng(seed + 9);
            let (x, y) = (r.vec(A.ncols()), r.vec(A.nrows()));
            let Ax = op.apply(&x).unwrap();
            let dense = &A * DMatrix::from_column_slice(A.ncols(), 1, &x);
            let size = (A.abs() * DMatrix::from_element(A.ncols(), 1, 1.0)).max() + 1e-300;
            for (a, b) in Ax.iter().zip(dense.iter()) {
                assert!((a - b).abs() <= 1e-13 * size, "seed {seed}: {op} x");
            }
            let dual = op.t().apply(&y).unwrap();
            let (a, b): (f64, f64) = (
                Ax.iter().zip(&y).map(|(a, b)| a * b).sum(),
                dual.iter().zip(&x).map(|(a, b)| a * b).sum(),
            );
            assert!((a - b).abs() <= 1e-12 * size * x.len() as f64, "seed {seed}: {op}: {a} {b}");
        }
        let n = 6 * ops.links();
        let one = DMatrix::identity(n, n);
        for op in [phi.clone(), phi.t(), psi.clone(), psi.t()] {
            let inverse = op.inverse().unwrap();
            let product = (&op * &inverse).dense().unwrap();
            same(&product, &one, 1e-12, &format!("seed {seed}: {op} ({inverse})"));
            assert_eq!(inverse.inverse().unwrap().to_string(), op.to_string());
        }
        // K = ℰφ G,  ψ = (1 − ℰψ)⁻¹ and φ − ψ = φ K H ψ.
        let K = (ops.e_phi() * ops.G()).dense().unwrap();
        same(&ops.K().dense().unwrap(), &K, 1e-14, "K");
        let difference = (&phi - &psi).dense().unwrap();
        let product = (&phi * ops.K() * &H * &psi).dense().unwrap();
        let scale = phi.dense().unwrap().abs().max();
        let error = (difference - product).abs().max();
        assert!(error <= 1e-12 * scale, "seed {seed}: φ − ψ = φ K H ψ is off by {error:e}");
    }
}

#[test]
fn prescribed_coordinates_leave_the_mass_matrix_of_the_free_ones() {
    let mut seen = 0;
    for seed in 0..40 {
        let mut c = case(seed, true);
        let M = mass(&mut c);
        let mask = c.mbs.prescribed();
        let free: Vec<usize> = (0..mask.len()).filter(|i| !mask[*i]).collect();
        let given: Vec<usize> = (0..mask.len()).filter(|i| mask[*i]).collect();
        seen += given.len();
        let ops = Operators::new(&c.tree, &c.ws).unwrap();
        same(&ops.mass().dense().unwrap(), &M, 1e-13, "HφMφ*H* + J has every coordinate");
        let L = ops.identity() + ops.H() * ops.phi() * ops.K();
        let factors = (&L * ops.D() * L.t()).dense().unwrap();
        if free.is_empty() {
            continue;
        }
        same(&pick(&factors, &free), &pick(&M, &free), 1e-13, &format!("seed {seed}, factors"));
        let inverse = ops.mass_inverse().dense().unwrap();
        let M_ff = pick(&M, &free);
        let error =
            (&M_ff * pick(&inverse, &free) - DMatrix::identity(free.len(), free.len())).abs();
        let unit = (M_ff.abs() * pick(&inverse, &free).abs()).max();
        assert!(error.max() <= 1e-13 * unit, "seed {seed}: {:e}", error.max());
        for i in given {
            assert!(inverse.row(i).iter().chain(inverse.column(i).iter()).all(|x| *x == 0.0));
        }
        if mask.contains(&true) {
            let refused = ops.mass().inverse().unwrap_err().to_string();
            assert!(refused.contains("prescribed") && refused.contains("all_free"), "{refused}");
        }
        let whole = Operators::all_free(&c.tree, &c.ws);
        let inverse = whole.unwrap().mass().inverse().unwrap().dense().unwrap();
        let error = (&M * &inverse - DMatrix::identity(mask.len(), mask.len())).abs().max();
        assert!(error <= 1e-13 * (M.abs() * inverse.abs()).max(), "seed {seed}: {error:e}");
    }
    assert!(seen > 100, "prescribed coordinates occur");
}

#[test]
fn omega_gives_the_compliance_of_the_nodes_and_upsilon_is_its_diagonal() {
    for seed in 0..40 {
        let mut c = case(seed, seed.is_multiple_of(2));
        let M = mass(&mut c);
        let ops = Operators::new(&c.tree, &c.ws).unwrap();
        let nodes: Vec<_> = ["n01", "n04", "n08"].map(|n| c.mbs.node(n).unwrap()).to_vec();
        let B = ops.B(&nodes);
        let J = B.t() * ops.jacobian();
        assert_eq!(J.to_string(), "B* φ* H*");
        // Compare the Jacobian with the kernel's velocities.
        let mut want = Vec::new();
        for n in &nodes {
            let V = c.ws.node_velocity(&c.tree, *n);
            want.extend(V.angular.iter().chain(V.linear.iter()));
        }
        close(&J.apply(&c.v).unwrap(), &want, 1e-13, &format!("seed {seed}, J β"));

        let nv = c.mbs.nv();
        let mut one = vec![0.0; 6 * nv];
        node_jacobian(&c.tree, &c.ws, nodes[1], &mut one);
        let rows = J.dense().unwrap().rows(6, 6).into_owned();
        same(&rows, &DMatrix::from_row_slice(6, nv, &one), 1e-13, &format!("seed {seed}, J"));

        let compliance = B.t() * ops.omega() * &B;
        assert_eq!(compliance.to_string(), "B* ψ* H* D⁻¹ H ψ B");
        let lambda = compliance.dense().unwrap();
        let mask = c.mbs.prescribed();
        let free: Vec<usize> = (0..mask.len()).filter(|i| !mask[*i]).collect();
        let J = J.dense().unwrap().select_columns(&free);
        let solved = pick(&M, &free).cholesky().unwrap().solve(&J.transpose());
        // The dense reference loses digits due to its condition number; the recursion does not.
        same(&lambda, &(&J * solved), 1e-12, &format!("seed {seed}, J M⁻¹ Jᵀ"));
        let inner = (&J.transpose(), ops.mass_inverse().dense().unwrap());
        let same_inverse = &J * pick(&inner.1, &free) * inner.0;
        same(&lambda, &same_inverse, 1e-13, &format!("seed {seed}, through (I−HψK)*D⁻¹(I−HψK)"));

        let (omega, upsilon) = (ops.omega().dense().unwrap(), ops.upsilon().dense().unwrap());
        let mut diagonal = DMatrix::zeros(omega.nrows(), omega.ncols());
        for k in 0..ops.links() {
            let at = (6 * k, 6 * k);
            diagonal.view_mut(at, (6, 6)).copy_from(&omega.view(at, (6, 6)));
        }
        same(&upsilon, &diagonal, 1e-13, &format!("seed {seed}, Υ"));
    }
}

#[test]
fn expressions_are_inverse_and_forward_dynamics() {
    for seed in 0..20 {
        let mut c = case(seed, false);
        let nv = c.mbs.nv();
        // At rest and without gravity: T = H φ M φ* H* β̇ + J β̇.
        kinematics(&c.tree, &mut c.ws, &c.q, &vec![0.0; nv]);
        let ops = Operators::new(&c.tree, &c.ws).unwrap();
        let (I, H, phi, psi, K) = (ops.identity(), ops.H(), ops.phi(), ops.psi(), ops.K());
        let udot = Rng(seed).vec(nv);
        let mut T = vec![0.0; nv];
        inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &udot, &mut T);
        let said = (&H * &phi * ops.M() * phi.t() * H.t() + ops.J()) * &udot[..];
        close(&said.unwrap(), &T, 1e-13, &format!("seed {seed}, T"));
        let mut T = Rng(seed + 1).vec(nv);
        let mut want = vec![0.0; nv];
        forward_dynamics_given_kinematics(&c.tree, &mut c.ws, &mut T, &mut want).unwrap();
        let W = &I - &H * &psi * &K;
        let said = W.t() * ops.D().inverse().unwrap() * W * &T[..];
        close(&said.unwrap(), &want, 1e-12, &format!("seed {seed}, β̇"));
    }
}

#[test]
fn a_subgraph_has_operators_of_its_own_on_a_moving_base() {
    for seed in [3, 4, 6, 11] {
        let mut c = case(seed, seed.is_multiple_of(2));
        let M = mass(&mut c);
        let part = c.mbs.subtree_graph(c.mbs.body("b02").unwrap());
        let tree = Tree::new(&part.multibody);
        let mut ws = Workspace::new(&tree);
        if let Some(base) = part.base {
            let X = c.ws.body_pose(&c.tree, base);
            ws.set_base(&X, &c.ws.body_velocity(&c.tree, base), &Motion::zero());
        }
        let gather = multibody::Subgraph::gather;
        kinematics(&tree, &mut ws, &gather(&part.q, &c.q), &gather(&part.v, &c.v));
        let ops = Operators::new(&tree, &ws).unwrap();
        assert!(part.multibody.nv() > 0, "seed {seed}");
        // The mass matrix of a subtree is a block of the mass matrix of the whole tree.
        let block = pick(&M, &part.v);
        same(&ops.mass().dense().unwrap(), &block, 1e-12, &format!("seed {seed}"));
    }
}

#[test]
fn distance_from_the_origin_changes_nothing() {
    let near =
        random_tree(6, Shape { bodies: 8, floating: false, prescribed: false, armature: true });
    let mut far = Builder::from(&near);
    for b in far.bodies_mut().iter_mut().filter(|b| b.parent == "world") {
        b.hinge_in_parent = Pose::translation(1.5e11, -0.7e11, 2e10) * b.hinge_in_parent;
    }
    let (near, far) = (case_of(near, 1), case_of(far.build().unwrap(), 1));
    let dense = |c: &Case| Operators::new(&c.tree, &c.ws).unwrap().omega().dense().unwrap();
    let error = (dense(&near) - dense(&far)).abs().max();
    assert!(error <= 1e-9 * dense(&near).abs().max(), "{error:e}");
}

/// A chain of `n` pins.
fn chain(n: usize) -> Multibody {
    let mut r = Rng(n as u64);
    let mut b = Builder::new();
    for i in 0..n {
        let parent = if i == 0 { "world".into() } else { format!("b{:04}", i - 1) };
        let hinge = Hinge::pin(r.vec3());
        let (X, m) = (r.pose(), r.mass());
        b.body(BodySpec::new(format!("b{i:04}"), parent).hinge_in_parent(X).hinge(hinge).mass(m));
    }
    b.build().unwrap()
}

#[test]
fn work_is_linear_in_the_number_of_links_and_allocates_nothing() {
    let work = |n: usize| {
        let c = case_of(chain(n), 2);
        let ops = Operators::new(&c.tree, &c.ws).unwrap();
        [ops.mass(), ops.mass_inverse(), ops.omega(), ops.phi(), ops.upsilon()].map(|op| {
            let mut scratch = op.scratch().unwrap();
            let x = Rng(5).vec(op.columns().unwrap().unwrap().size());
            let mut y = vec![0.0; op.rows().unwrap().unwrap().size()];
            op.apply_into(&x, &mut y, &mut scratch).unwrap();
            let allocated = allocation_counter::measure(|| {
                op.apply_into(&x, &mut y, &mut scratch).unwrap();
            });
            assert_eq!(allocated.count_total, 0, "{op}");
            scratch.link_visits() / 2
        })
    };
    // The number of visits to each link equals the number of symbols in the expression; M⁻¹ has 2·3 +
    // 1.
    for n in [1, 10, 100, 400] {
        assert_eq!(work(n), [6, 7, 5, 1, 1].map(|symbols| symbols * n as u64));
    }
}

#[test]
fn expressions_print_as_they_are_written() {
    let c = case(1, false);
    let ops = Operators::new(&c.tree, &c.ws).unwrap();
    let (I, H, phi) = (ops.identity(), ops.H(), ops.phi());
    let print = |op: &Operator| op.to_string();
    assert_eq!(print(&(&H * &phi * ops.M() * phi.t() * H.t())), "H φ M φ* H*");
    assert_eq!(print(&(&I - &H * ops.psi() * ops.K()).t()), "(I − H ψ K)*");
    assert_eq!(print(&((&I * 2.0 - 3.0 * ops.D()) * ops.D_inv())), "(2 I − 3 D) D⁻¹");
    assert_eq!(print(&-(&H * (2.0 * &phi))), "−2 H φ");
    assert_eq!(print(&(&H * &phi).t().t()), "H φ");
    assert_eq!(print(&phi.inverse().unwrap()), "I − ℰφ");
    assert_eq!(print(&(-&I * &I).inverse().unwrap()), "−I");
}

#[test]
fn mistakes_are_refused_with_both_operands() {
    let (a, b) = (case(1, false), case(5, false));
    let (ops, other) =
        (Operators::new(&a.tree, &a.ws).unwrap(), Operators::new(&b.tree, &b.ws).unwrap());
    let (H, M, D, phi) = (ops.H(), ops.M(), ops.D(), ops.phi());
    let error = |op: &Operator| op.check().unwrap_err();

    let wrong = H.t() * &M;
    let text = error(&wrong).to_string();
    let (n, nv) = (6 * ops.links(), ops.nv());
    let want = format!(
        "cannot multiply `H*` (6·links = {n} × nv = {nv}) by `M` (6·links = {n} × 6·links = {n}): \
         nv = {nv} does not match 6·links = {n}\n  help: "
    );
    assert!(text.starts_with(&want), "{text}");
    assert!(matches!(H.t().try_mul(&M), Err(OperatorError::Multiply { .. })));
    // The first error is reported, independent of later operations.
    let later = (ops.identity() - 2.0 * wrong.t()) * other.D();
    assert_eq!(error(&later), error(&wrong));
    assert_eq!(later.apply(&[1.0]).unwrap_err(), error(&wrong));
    assert_eq!(later.dense().unwrap_err(), error(&wrong));
    assert_eq!(later.inverse().unwrap_err(), error(&wrong));
    assert!(later.to_string().contains("cannot multiply `H*`"));

    assert!(matches!(error(&(&M + &D)), OperatorError::Add { .. }));
    assert!(matches!(error(&(&H - ops.identity())), OperatorError::Add { .. }));
    let text = error(&(&H * other.phi())).to_string();
    assert!(text.contains("`H` and `φ` belong to different systems"), "{text}");
    // Operators of another snapshot belong to another system, even if the tree and the state are
    // the same.
    let again = Operators::new(&a.tree, &a.ws).unwrap();
    assert!(matches!(error(&(&H * again.phi())), OperatorError::Systems { .. }));
    assert!(matches!(error(&(&H * f64::NAN)), OperatorError::NotFinite { .. }));
    assert!(matches!(error(&(&H * 1e200 * 1e200)), OperatorError::NotFinite { .. }));

    let nodes: Vec<_> = a.mbs.node_ids().collect();
    let (two, next) = (ops.B(&nodes[..2]), ops.B(&nodes[1..3]));
    (two.t() * ops.omega() * &next).check().unwrap();
    assert!(matches!(error(&(&two + &next)), OperatorError::Add { .. }), "other nodes");

    let text = phi.apply(&[1.0, 2.0]).unwrap_err().to_string();
    assert!(text.contains("has 2 numbers, expected") && text.contains("six numbers"), "{text}");
    let mut x = vec![1.0; nv];
    x[0] = f64::NAN;
    assert!(matches!(D.apply(&x), Err(OperatorError::NotFinite { .. })));
    let mut short = vec![0.0; 1];
    let refused = phi.apply_into(&vec![1.0; n], &mut short, &mut Scratch::default());
    assert!(matches!(refused, Err(OperatorError::Length { what: "the result", .. })));
    assert!(matches!(ops.identity().dense(), Err(OperatorError::NoSize { .. })));

    for op in [&H, &(&H * &phi), &ops.e_phi(), &(&D + ops.J()), &(&D * 0.0)] {
        assert!(matches!(op.inverse(), Err(OperatorError::NoInverse { .. })), "{op}");
    }
    let c = case(3, false);
    let ops = Operators::new(&c.tree, &c.ws).unwrap();
    let bare = ops.H() * ops.phi() * ops.M() * ops.phi().t() * ops.H().t();
    let text = bare.inverse().unwrap_err().to_string();
    assert!(text.contains("add `J`"), "{text}");
}

#[test]
fn links_without_inertia_name_their_body() {
    let solid = MassProperties::new(1.0, Vec3::x() * 0.3, Mat3::identity() * 0.1);
    let arm = |hand: Hinge, mass| {
        let mut b = Builder::new();
        b.body(BodySpec::new("arm", "world").hinge(Hinge::pin(Vec3::z())).mass(solid));
        b.body(BodySpec::new("hand", "arm").hinge(hand).mass(mass));
        case_of(b.build().unwrap(), 1)
    };
    let none = MassProperties::massless();
    for hinge in [Hinge::pin(Vec3::x()), Hinge::slider(Vec3::y()), Hinge::ball(), Hinge::free()] {
        let c = arm(hinge, none);
        let error = Operators::new(&c.tree, &c.ws).unwrap_err();
        assert_eq!(error, DynamicsError::Singular { body: "hand".into(), v: 1 });
    }
    // With two pins on one axis, D of the inner pin is only round-off.
    let c = arm(Hinge::universal(Vec3::new(1.0, 0.2, 0.3), Vec3::new(1.0, 0.2, 0.3)), solid);
    assert!(Operators::new(&c.tree, &c.ws).is_err());
    // A link between two subhinges is massless, so M is singular, but D is not.
    let c = arm(Hinge::universal(Vec3::x(), Vec3::y()), solid);
    let ops = Operators::new(&c.tree, &c.ws).unwrap();
    let text = ops.M().inverse().unwrap_err().to_string();
    assert!(text.contains("body `hand`"), "{text}");
    ops.D().inverse().unwrap();
    let c = arm(Hinge::ball(), solid);
    let ops = Operators::new(&c.tree, &c.ws).unwrap();
    let one = (ops.M() * ops.M().inverse().unwrap()).dense().unwrap();
    same(&one, &DMatrix::identity(12, 12), 1e-13, "M M⁻¹");
}
