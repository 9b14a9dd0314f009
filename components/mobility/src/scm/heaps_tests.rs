//! Heaped soil: it slides until it is no steeper than it may be, keeps its volume, and leaves slopes alone that the ground had.

use super::*;
use crate::wheel_rigid::tests::plane;
use linkwork_runtime::prelude::Field;

fn window(ground: &ScmGround, n: usize) -> Window {
    let count = n * n;
    let nodes = (0..count).map(|at| {
        let place = ground.place((at % n) as i32, (at / n) as i32);
        ground.fresh(place)
    });
    let nodes = nodes.collect();
    Window { from: [0, 0], size: [n, n], nodes, pressed: vec![false; count] }
}

fn ground(slope: f64) -> ScmGround {
    ScmGround::build(crate::scm::ground::ScmGroundParams {
        cell: 0.02,
        region: None,
        stiffness: 0.0,
        stiffness_growth: 5.03e8,
        shear_unloading: 20.0,
        bulldozing: 1.0,
        repose: 0.6,
        terrain: plane(slope),
    })
    .unwrap()
}

#[test]
fn a_column_slides_to_its_slope_and_none_is_lost() {
    let mut w = window(&ground(0.0), 21);
    w.nodes[10 * 21 + 10].heap = 0.2;
    for _ in 0..400 {
        w.slide(0.02, 0.6_f64.tan());
    }
    let sum: f64 = w.nodes.iter().map(|n| f64::from(n.heap)).sum();
    assert!((sum - 0.2).abs() < 1e-6, "{sum}");
    for j in 0..21 {
        for i in 0..20 {
            let fall = (w.nodes[j * 21 + i].surface() - w.nodes[j * 21 + i + 1].surface()).abs();
            assert!(fall < 0.02 * 0.6_f64.tan() + 1e-4, "{fall} at {i} {j}");
        }
    }
    let top = w.nodes[10 * 21 + 10].heap;
    assert!(top < 0.1 && top > 0.01, "{top}");
}

#[test]
fn a_slope_that_was_there_stays_and_what_presses_holds_its_soil() {
    // The slope is 1 in 1, steeper than soil that slides.
    let mut w = window(&ground(1.0), 9);
    w.slide(0.02, 0.6_f64.tan());
    assert!(w.nodes.iter().all(|n| n.heap == 0.0));
    let mut w = window(&ground(0.0), 9);
    w.nodes[4 * 9 + 4].heap = 0.1;
    w.pressed[4 * 9 + 4] = true;
    w.slide(0.02, 0.6_f64.tan());
    assert_eq!(w.nodes[4 * 9 + 4].heap, 0.1);
}
