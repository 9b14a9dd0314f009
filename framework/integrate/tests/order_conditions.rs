//! Order conditions of every table, with rooted trees up to the order of the method.
//!
//! ```text
//! Σᵢ bᵢ Φᵢ(τ) = 1/γ(τ)      Φᵢ([τ₁ … τₘ]) = Πₗ Σⱼ aᵢⱼ Φⱼ(τₗ)      γ(τ) = |τ| Π γ(τₗ)
//! Σᵢ bᵢ(θ) Φᵢ(τ) = θ^|τ| / γ(τ)            for the dense output
//! ```
//! The conditions are from Hairer, Nørsett, Wanner I, section II.2, and for Rosenbrock methods from II, section IV.7: a vertex with one branch has
//! α + γ in place of a, others α.
use linkwork_integrate::{Explicit, METHODS, Method, Rosenbrock};

/// A rooted tree: the subtrees on its root, by index in the list.
struct Tree {
    order: usize,
    branches: Vec<usize>,
    gamma: f64,
}

/// All trees up to an order, smaller ones first.
fn trees(order_max: usize) -> Vec<Tree> {
    let mut all = vec![Tree { order: 1, branches: vec![], gamma: 1.0 }];
    for order in 2..=order_max {
        let mut sets = Vec::new();
        choose(&all, all.len(), order - 1, &mut Vec::new(), &mut sets);
        for branches in sets {
            let gamma = order as f64 * branches.iter().map(|b| all[*b].gamma).product::<f64>();
            all.push(Tree { order, branches, gamma });
        }
    }
    all
}

/// Multisets of trees with a given total number of vertices, indices descending.
fn choose(
    all: &[Tree],
    below: usize,
    left: usize,
    had: &mut Vec<usize>,
    out: &mut Vec<Vec<usize>>,
) {
    if left == 0 {
        return out.push(had.clone());
    }
    for place in (0..below).filter(|p| all[*p].order <= left) {
        had.push(place);
        choose(all, place + 1, left - all[place].order, had, out);
        had.pop();
    }
}

/// Φᵢ of every tree; `one` is the matrix at vertices with one branch, `many` at the others.
fn weights_of(trees: &[Tree], one: &[Vec<f64>], many: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let mut phi: Vec<Vec<f64>> = Vec::new();
    for tree in trees {
        let matrix = if tree.branches.len() == 1 { one } else { many };
        let row = |i: usize| {
            let sum = |b: &usize| matrix[i].iter().zip(&phi[*b]).map(|(a, p)| a * p).sum::<f64>();
            tree.branches.iter().map(sum).product::<f64>()
        };
        let row = (0..one.len()).map(row).collect();
        phi.push(row);
    }
    phi
}

/// Largest violation over the trees up to an order.
fn violation(trees: &[Tree], phi: &[Vec<f64>], b: &[f64], theta: f64, order: u32) -> f64 {
    let mut worst: f64 = 0.0;
    for (tree, phi) in trees.iter().zip(phi).filter(|(t, _)| t.order <= order as usize) {
        let sum: f64 = b.iter().zip(phi).map(|(b, p)| b * p).sum();
        let error = (sum - theta.powi(tree.order as i32) / tree.gamma).abs();
        assert!(error.is_finite());
        worst = worst.max(error);
    }
    worst
}

/// A square matrix of rows that may be short.
fn square(rows: &[&[f64]], n: usize) -> Vec<Vec<f64>> {
    let full = |row: &&[f64]| row.iter().copied().chain(std::iter::repeat(0.0)).take(n).collect();
    rows.iter().map(full).collect()
}

/// Returns bᵢ(θ) from the Bernstein form.
fn polynomials(rows: &[Vec<f64>], theta: f64) -> Vec<f64> {
    let degree = rows[0].len() as i32;
    let basis = |p: i32| {
        let binomial: f64 = (0..p).map(|i| f64::from(degree - i) / f64::from(i + 1)).product();
        binomial * theta.powi(p) * (1.0 - theta).powi(degree - p)
    };
    let value = |row: &Vec<f64>| row.iter().zip(1..).map(|(beta, p)| beta * basis(p)).sum();
    rows.iter().map(value).collect()
}

fn explicit_tables() -> Vec<&'static Explicit> {
    METHODS
        .iter()
        .filter_map(|m| if let Method::Explicit(t) = m { Some(*t) } else { None })
        .collect()
}

#[test]
fn trees_are_counted_as_cayley_did() {
    let all = trees(8);
    let counts: Vec<_> = (1..=8).map(|p| all.iter().filter(|t| t.order == p).count()).collect();
    assert_eq!(counts, [1, 1, 2, 4, 9, 20, 48, 115]);
}

#[test]
fn steps_satisfy_their_order_and_no_more() {
    let all = trees(9);
    for t in explicit_tables() {
        let a = square(t.a, t.a.len());
        let phi = weights_of(&all, &a, &a);
        let met = violation(&all, &phi, t.b, 1.0, t.order);
        let next = violation(&all, &phi, t.b, 1.0, t.order + 1);
        println!("{}: order {} to {met:.1e}, next {next:.1e}", t.name, t.order);
        // Measured: at most 6e-13 (Verner, whose entries are up to 123), and at least 4e-7 for the next order.
        assert!(met < 2e-12, "{}: violated by {met:e}", t.name);
        assert!(next > 1e-7, "{}: the order is higher than said", t.name);
        for (i, row) in a.iter().enumerate() {
            let sum: f64 = row.iter().sum();
            assert!((sum - t.c[i]).abs() < 1e-13, "{}: node {i} is not its row's sum", t.name);
        }
    }
}

#[test]
fn estimates_satisfy_their_order_and_no_more() {
    let all = trees(9);
    for t in explicit_tables().into_iter().filter(|t| t.error_order > 0) {
        let a = square(t.a, t.a.len());
        let phi = weights_of(&all, &a, &a);
        let lower: Vec<f64> = t.b.iter().zip(t.error).map(|(b, e)| b - e).collect();
        let met = violation(&all, &phi, &lower, 1.0, t.error_order);
        let next = violation(&all, &phi, &lower, 1.0, t.error_order + 1);
        println!("{}: order {} to {met:.1e}, next {next:.1e}", t.name, t.error_order);
        assert!(met < 1e-13, "{}: violated by {met:e}", t.name);
        assert!(next > 1e-7, "{}: the estimate is of higher order than said", t.name);
    }
}

#[test]
fn dense_outputs_satisfy_their_order_and_end_in_the_step() {
    let all = trees(9);
    for t in explicit_tables() {
        let a = square(t.a, t.a.len());
        let phi = weights_of(&all, &a, &a);
        let rows: Vec<Vec<f64>> = t.dense.iter().map(|r| r.to_vec()).collect();
        let (mut met, mut next) = (0.0_f64, 0.0_f64);
        for theta in [0.1, 0.25, 0.37, 0.5, 0.73, 0.9, 0.99] {
            let b = polynomials(&rows, theta);
            met = met.max(violation(&all, &phi, &b, theta, t.dense_order));
            next = next.max(violation(&all, &phi, &b, theta, t.dense_order + 1));
        }
        println!("{}: dense order {} to {met:.1e}, next {next:.1e}", t.name, t.dense_order);
        assert!(met < 1e-12, "{}: violated by {met:e}", t.name);
        assert!(next > 1e-7, "{}: the dense output is of higher order than said", t.name);
        for (i, end) in polynomials(&rows, 1.0).into_iter().enumerate() {
            let b = t.b.get(i).copied().unwrap_or(0.0);
            assert!((end - b).abs() < 1e-15, "{}: b_{i}(1) = {end}, not {b}", t.name);
        }
    }
}

/// The textbook matrices of a Rosenbrock method, from the coefficients of the u form.
struct Textbook {
    alpha: Vec<Vec<f64>>,
    beta: Vec<Vec<f64>>,
    gamma: Vec<Vec<f64>>,
}

/// c = diag(1/γ) − Γ⁻¹, so Γ = (diag(1/γ) − c)⁻¹; α = a Γ.
fn textbook(t: &Rosenbrock) -> Textbook {
    let s = t.a.len();
    let c = square(t.c, s);
    let mut gamma = vec![vec![0.0; s]; s];
    for j in 0..s {
        for i in j..s {
            let unit = if i == j { 1.0 } else { 0.0 };
            let dot: f64 = (j..i).map(|k| c[i][k] * gamma[k][j]).sum();
            gamma[i][j] = t.gamma * (unit + dot);
        }
    }
    let alpha: Vec<Vec<f64>> = square(t.a, s).iter().map(|row| times(row, &gamma)).collect();
    let add = |a: &Vec<f64>, g: &Vec<f64>| a.iter().zip(g).map(|(a, g)| a + g).collect();
    let beta = alpha.iter().zip(&gamma).map(|(a, g)| add(a, g)).collect();
    Textbook { alpha, beta, gamma }
}

/// row · matrix.
fn times(row: &[f64], matrix: &[Vec<f64>]) -> Vec<f64> {
    (0..matrix.len()).map(|j| row.iter().zip(matrix).map(|(r, m)| r * m[j]).sum()).collect()
}

#[test]
fn rosenbrock_satisfies_its_orders() {
    let all = trees(5);
    for method in METHODS {
        let Method::Rosenbrock(t) = method else { continue };
        let Textbook { alpha, beta, gamma } = textbook(t);
        let phi = weights_of(&all, &beta, &alpha);
        let lower: Vec<f64> = t.m.iter().zip(t.error).map(|(m, e)| m - e).collect();
        for (m, order, what) in
            [(t.m.to_vec(), t.order, "step"), (lower, t.error_order, "estimate")]
        {
            let b = times(&m, &gamma);
            let met = violation(&all, &phi, &b, 1.0, order);
            let next = violation(&all, &phi, &b, 1.0, order + 1);
            println!("{} {what}: order {order} to {met:.1e}, next {next:.1e}", t.name);
            assert!(met < 1e-13, "{} {what}: violated by {met:e}", t.name);
            assert!(next > 1e-4, "{} {what}: the order is higher than said", t.name);
        }
        for i in 0..t.a.len() {
            let sums: [f64; 2] = [alpha[i].iter().sum(), gamma[i].iter().sum()];
            assert!((sums[0] - t.alpha[i]).abs() < 1e-13, "{}: α{i} {}", t.name, sums[0]);
            assert!((sums[1] - t.d[i]).abs() < 1e-13, "{}: d{i} {}", t.name, sums[1]);
        }
        let [h1, h2] = t.dense;
        let values = |theta: f64| -> Vec<f64> {
            let value = |i: usize| theta * (t.m[i] + (1.0 - theta) * (h1[i] + theta * h2[i]));
            (0..t.m.len()).map(value).collect()
        };
        let (mut met, mut next) = (0.0_f64, 0.0_f64);
        for theta in [0.1, 0.25, 0.37, 0.5, 0.73, 0.9, 0.99] {
            let b = times(&values(theta), &gamma);
            met = met.max(violation(&all, &phi, &b, theta, t.dense_order));
            next = next.max(violation(&all, &phi, &b, theta, t.dense_order + 1));
        }
        println!("{} dense: order {} to {met:.1e}, next {next:.1e}", t.name, t.dense_order);
        assert!(met < 1e-12 && next > 1e-4, "{} dense: {met:e} {next:e}", t.name);
    }
}
