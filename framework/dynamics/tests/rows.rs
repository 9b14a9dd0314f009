//! Rows over units without loops, compared with dense algebra: W = J M⁻¹ J*, and the effect of forces on rows.

use crate::support::{Rng, Shape, close, random_tree};
use linkwork_dynamics::multibody::BodyId;
use linkwork_dynamics::spatial::nalgebra::DMatrix;
use linkwork_dynamics::units::{ConstraintMethod, RowSet, Units, UnitsWork};
use linkwork_dynamics::*;

/// A random tree after a gather, with all accelerations and forces.
struct Case {
    tree: Tree,
    ws: Workspace,
    units: Units,
    uw: UnitsWork,
    vdot: Vec<f64>,
    inverse: DMatrix<f64>,
}

fn case(seed: u64) -> Case {
    let shape = Shape {
        bodies: 2 + seed as usize % 11,
        floating: !seed.is_multiple_of(4),
        prescribed: seed.is_multiple_of(3),
        armature: seed % 5 > 1,
    };
    let mbs = random_tree(seed + 700, shape);
    let tree = Tree::new(&mbs);
    let (nv, mut ws) = (tree.nv(), Workspace::new(&tree));
    kinematics(&tree, &mut ws, &mbs.random_q(seed), &mbs.random_v(seed));
    let mut inverse = vec![0.0; nv * nv];
    inverse_mass_matrix(&tree, &mut ws, &mut inverse).unwrap();
    let units = Units::new(&tree, |_| ConstraintMethod::Augment);
    let mut uw = UnitsWork::new(&tree, &units);
    let (tau, mut vdot) = (Rng(seed).vec(nv), Rng(seed + 1).vec(nv));
    units.gather(&tree, &mut ws, &mut uw, &tau, &vdot, &[]).unwrap();
    forward_dynamics_given_kinematics(&tree, &mut ws, &mut tau.clone(), &mut vdot).unwrap();
    let inverse = DMatrix::from_row_slice(nv, nv, &inverse);
    Case { tree, ws, units, uw, vdot, inverse }
}

/// Returns W of all groups, `width` rows each, and checks that both computations of a block agree.
fn compliance(rows: &RowSet, width: usize) -> Vec<f64> {
    let n = rows.groups().len();
    let mut W = vec![0.0; n * width * n * width];
    let mut shared = Vec::new();
    for g in 0..n {
        for h in 0..n {
            let block = rows.block(g, h);
            shared.clear();
            rows.shared(g, h, &mut shared);
            assert_eq!(rows.product(&shared).map(|row| row.to_array()), block, "block {g} {h}");
            for (i, row) in block.iter().enumerate().take(width) {
                for (j, x) in row.iter().enumerate().take(width) {
                    W[(g * width + i) * n * width + h * width + j] = *x;
                }
            }
        }
    }
    W
}

/// A row on each coordinate measures it: W equals M⁻¹, and the forces alone give the accelerations.
#[test]
fn rows_on_coordinates_give_the_inverse_of_the_mass_matrix() {
    for seed in 0..60 {
        let c = case(seed);
        let mut rows = RowSet::default();
        rows.clear();
        let factors: Vec<f64> = Rng(seed + 2).vec(c.tree.nv()).iter().map(|x| x + 2.0).collect();
        for (i, factor) in factors.iter().enumerate() {
            rows.add_coordinate(&c.tree, &c.units, &c.uw, i, *factor, 0.0);
        }
        let scale = DMatrix::from_diagonal(&factors.clone().into());
        let want = &scale * &c.inverse * &scale;
        // Measured: 2e-14.
        close(&compliance(&rows, 1), want.as_slice(), 1e-12, &format!("seed {seed}: W"));
        let free: Vec<f64> = rows.groups().iter().map(|g| g.free[0]).collect();
        let want: Vec<f64> = c.vdot.iter().zip(&factors).map(|(a, f)| a * f).collect();
        // Measured: 6e-15.
        close(&free, &want, 1e-12, &format!("seed {seed}: accelerations"));
    }
}

/// Contacts between links, and between a link and the world: W = J M⁻¹ J* with J from nodes.
#[test]
fn rows_at_points_give_their_compliance() {
    for seed in 0..60 {
        let c = case(seed);
        let (mbs, nv, mut r) = (c.tree.multibody(), c.tree.nv(), Rng(seed + 3));
        let mut rows = RowSet::default();
        rows.clear();
        let mut J = Vec::new();
        for (i, node) in mbs.nodes().iter().enumerate() {
            let here = mbs.node_ids().nth(i).unwrap();
            let point = c.ws.node_pose(&c.tree, here).position;
            let directions = [r.vec3(), r.vec3(), r.vec3()];
            // Every third point connects the previous body with this one.
            let other: Option<BodyId> = (i > 0 && i % 3 == 0).then(|| mbs.nodes()[i - 1].body());
            let bodies = (other, Some(node.body()));
            rows.add_point(&c.tree, &c.units, &c.ws, &c.uw, bodies, &point, &directions);
            let mut whole = vec![0.0; 6 * nv];
            node_jacobian(&c.tree, &c.ws, here, &mut whole);
            let mut against = vec![0.0; 6 * nv];
            if other.is_some() {
                let there = mbs.node_ids().nth(i - 1).unwrap();
                node_jacobian(&c.tree, &c.ws, there, &mut against);
                let arm = point - c.ws.node_pose(&c.tree, there).position;
                for j in 0..nv {
                    let w = |k: usize| against[k * nv + j];
                    let v = spatial::Vec3::new(w(0), w(1), w(2)).cross(&arm);
                    (0..3).for_each(|k| against[(3 + k) * nv + j] += v[k]);
                }
            }
            for n in &directions {
                let along = |j: usize| {
                    let row = |k: usize| whole[k * nv + j] - against[k * nv + j];
                    n.x * row(3) + n.y * row(4) + n.z * row(5)
                };
                J.extend((0..nv).map(along));
            }
        }
        let J = DMatrix::from_row_slice(J.len() / nv, nv, &J);
        let want = &J * &c.inverse * J.transpose();
        let W = compliance(&rows, 3);
        // Measured: 2e-14.
        close(&W, want.as_slice(), 1e-12, &format!("seed {seed}"));
        for i in 0..want.nrows() {
            let gross = rows.groups()[i / 3].gross[i % 3];
            assert!(gross >= W[i * want.nrows() + i] * (1.0 - 1e-12), "seed {seed}: bound");
        }
    }
}
