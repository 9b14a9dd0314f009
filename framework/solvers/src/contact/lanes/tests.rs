//! Batches against the local solutions and products of single groups.

use super::super::layout::Layout;
use super::super::local::Block;
use super::super::problem::{Cone, Factor, Problem};
use super::super::residual::measure;
use super::super::samples::number;
use super::*;

/// Contacts between bodies of six degrees of freedom and with the ground, among groups of other kinds.
#[derive(Default)]
struct Case {
    start: Vec<u32>,
    dof: Vec<u32>,
    e: Vec<[f64; 4]>,
    cones: Vec<Cone>,
    b: Vec<[f64; 4]>,
    dofs: usize,
}

impl Case {
    fn problem(&self) -> Problem<'_> {
        let factor = Factor { start: &self.start, dof: &self.dof, e: &self.e, dofs: self.dofs };
        Problem::new(factor, &self.cones, &self.b, &[]).expect("a good problem")
    }

    fn add(&mut self, dofs: impl Iterator<Item = u32>, cone: Cone, seed: &mut u64) {
        for d in dofs {
            let mut e = [0.0; 4];
            e[..cone.rows()].fill_with(|| number(seed));
            self.dof.push(d);
            self.e.push(e);
        }
        self.start.push(self.dof.len() as u32);
        let mut b = [0.0; 4];
        b[..cone.rows()].fill_with(|| number(seed));
        self.b.push(b);
        self.cones.push(cone);
    }
}

/// 20 bodies; behind them a chain of seven degrees of freedom and a cart of two.
fn case(mut seed: u64) -> Case {
    let mut case = Case { start: vec![0], dofs: 129, ..Case::default() };
    for a in 0..20u32 {
        for b in [a + 1, a + 3, a + 4] {
            for _ in 0..2 {
                let friction = [0.0, 0.3, 0.8, 4.0][(number(&mut seed).abs() * 4.0) as usize];
                let bodies = [Some(a), (b < 20).then_some(b)];
                let dofs = bodies.into_iter().flatten().flat_map(|k| 6 * k..6 * k + 6);
                case.add(dofs, Cone::Coulomb { friction }, &mut seed);
            }
        }
    }
    case.add(120..127, Cone::Equality { rows: 3 }, &mut seed);
    case.add((0..6).chain(120..127), Cone::Coulomb { friction: 0.5 }, &mut seed);
    case.add(127..129, Cone::Coulomb { friction: 0.5 }, &mut seed);
    case.add(6..12, Cone::Spinning { friction: 0.4, spin: 0.1 }, &mut seed);
    case
}

/// Every group is in one batch or alone, and contacts of a batch share no degree of freedom.
#[test]
fn batches_share_nothing_and_leave_nothing_out() {
    let case = case(3);
    let (problem, mut colours) = (case.problem(), Colours::default());
    assert!(colours.set(&problem));
    let mut seen = vec![0; problem.groups()];
    colours.singles.iter().for_each(|g| seen[*g as usize] += 1);
    for (from, to) in &colours.batches {
        let batch = &colours.order[*from as usize..*to as usize];
        let mut touched = vec![0; case.dofs];
        for end in batch {
            seen[end.group as usize] += 1;
            problem.entries(end.group as usize).0.iter().for_each(|d| touched[*d as usize] += 1);
        }
        assert!(touched.iter().all(|n| *n <= 1), "{batch:?}");
    }
    assert!(seen.iter().all(|n| *n == 1), "{seen:?}");
    // These are the four groups of other kinds, and contacts that do not fill a batch of their
    // colour.
    assert!((4..12).contains(&colours.singles.len()), "{:?}", colours.singles);
}

/// Eᵀ λ, and the residual, of batches and of the groups alone.
#[test]
fn products_and_residuals_are_those_of_the_groups() {
    let (case, mut seed) = (case(5), 11);
    let (problem, mut layout) = (case.problem(), Layout::default());
    layout.set(&problem);
    assert!(!layout.lanes.is_empty() && layout.is_finite());
    let lambda: Vec<[f64; 4]> = (case.cones.iter())
        .map(|c| {
            let mut l = [0.0; 4];
            l[..c.rows()].fill_with(|| number(&mut seed));
            l
        })
        .collect();
    layout.pull(&lambda);
    let mut y = vec![0.0; case.dofs];
    (0..lambda.len()).for_each(|g| problem.scatter(g, &lambda[g], &mut y));
    for (a, b) in layout.pulled().zip(&y) {
        assert!((a - b).abs() < 1e-13, "{a} {b}");
    }
    let mut back = vec![[7.0; 4]; lambda.len()];
    back.copy_from_slice(&lambda);
    layout.lanes.store(&mut back);
    assert_eq!(back, lambda);
    // Compute the same quantities group by group.
    let (mut residual, mut work, mut violation, mut impulse) = (0.0, 0.0, 0.0, 0.0f64);
    for (g, l) in lambda.iter().enumerate() {
        let gathered = f64x4::new(problem.gathered(g, &y));
        let block = block(&problem, g);
        let v = block.velocity(gathered, f64x4::new(*l)).to_array();
        assert!((layout.scales[g] - block.scale).abs() < 1e-14);
        let cone = &problem.cones[g];
        for x in super::super::residual::natural(cone, block.scale, l, &v) {
            larger(&mut residual, x);
        }
        larger(&mut work, super::super::residual::idle_work(cone, l, &v));
        larger(&mut violation, super::super::residual::outside(cone, l));
        impulse = l.iter().fold(impulse, |m, x| m.max(x.abs()));
    }
    let found = measure(&problem, &mut layout, &lambda);
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-13 * b.abs(), "{a} {b}");
    near(found.residual, residual / problem.scale);
    near(found.complementarity, work / problem.scale / impulse);
    near(found.violation, violation / impulse);
}

/// The block of a group from its entries.
fn block(problem: &Problem, g: usize) -> Block {
    let (_, e) = problem.entries(g);
    let W = std::array::from_fn(|i| std::array::from_fn(|j| e.iter().map(|e| e[i] * e[j]).sum()));
    Block::new(problem, g, W)
}

/// Impulses of four contacts side by side and one by one: open, sticking, sliding, without friction, without compliance.
#[test]
fn four_local_solutions_are_those_of_single_contacts() {
    let (mut seed, mut kinds) = (17, [0; 4]);
    for trial in 0..400 {
        let mut case = Case { start: vec![0], dofs: 24, ..Case::default() };
        for k in 0..4u32 {
            let friction = [0.0, 0.2, 0.9, 3.0][(number(&mut seed).abs() * 4.0) as usize];
            let dofs = 6 * k..6 * k + if trial % 50 == 7 && k == 2 { 0 } else { 6 };
            case.add(dofs, Cone::Coulomb { friction }, &mut seed);
            if trial % 40 == 9 {
                // Make two rows linearly dependent, so that S is singular.
                let from = case.start[k as usize] as usize;
                case.e[from..].iter_mut().for_each(|e| e[2] = 0.5 * e[1]);
            }
        }
        let problem = case.problem();
        let mut blocks: Vec<Block> = (0..4).map(|g| block(&problem, g)).collect();
        let sums: [[f64; 6]; 4] = std::array::from_fn(|g| {
            let (_, e) = problem.entries(g);
            let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
            pairs.map(|(i, j)| e.iter().map(|e| e[i] * e[j]).sum())
        });
        let lanes = |f: &dyn Fn(usize) -> f64| f64x4::new(std::array::from_fn(f));
        let w = std::array::from_fn(|i| lanes(&|g| sums[g][i]));
        let b = std::array::from_fn(|k| lanes(&|g| case.b[g][k]));
        let friction = lanes(&|g| match case.cones[g] {
            Cone::Coulomb { friction } => friction,
            _ => f64::NAN,
        });
        let mut law = Law::new(w, b, friction);
        assert!(law.is_finite());
        for _ in 0..3 {
            let l: [[f64; 3]; 4] =
                std::array::from_fn(|_| std::array::from_fn(|_| number(&mut seed)));
            let v: [[f64; 3]; 4] =
                std::array::from_fn(|_| std::array::from_fn(|_| number(&mut seed)));
            let side = |x: &[[f64; 3]; 4], k: usize| lanes(&|g| x[g][k]);
            let new = law
                .solve(std::array::from_fn(|k| side(&l, k)), std::array::from_fn(|k| side(&v, k)));
            for g in 0..4 {
                let four = |x: &[f64; 3]| f64x4::new([x[0], x[1], x[2], 0.0]);
                let want = blocks[g].solve(four(&l[g]), four(&v[g])).to_array();
                let found: [f64; 3] = std::array::from_fn(|k| new[k].to_array()[g]);
                let size = want.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
                for k in 0..3 {
                    // Measured: 4e-9. Both methods find a root of α to 1e-7.
                    assert!(
                        (found[k] - want[k]).abs() < 1e-7 * size,
                        "{trial} {g}: {found:?} {want:?}"
                    );
                }
                let tangent = want[1].hypot(want[2]);
                let mu = friction.to_array()[g];
                let slides = tangent > (1.0 - 1e-9) * mu * want[0] && mu > 0.0;
                kinds[if want[0] == 0.0 {
                    0
                } else if mu == 0.0 {
                    1
                } else {
                    2 + usize::from(slides)
                }] += 1;
            }
        }
    }
    assert!(kinds.iter().all(|n| *n > 100), "{kinds:?}");
}
