//! The law of a node: pressure there and back, shear that loads, unloads and holds, energy that is never made.

use super::*;
use crate::test_soils::lunar;

const WONG: Unloading = Unloading { k0: 0.0, growth: 5.03e8 };

fn law(slip: f64) -> Law {
    Law::of(&Soil { n1: 0.4, n: 1.1, ..lunar() }, 0.4, slip)
}

fn flat() -> Node {
    Node { first: [0.0; 3], ..Node::default() }
}

/// A deterministic wander between −1 and 1.
fn wander(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    }
}

#[test]
fn pressure_follows_bekker_there_and_wong_back() {
    let (law, mut node) = (law(0.0), flat());
    assert_eq!(law.pressure(&node, 0.02), law.k * 0.02f64.powf(1.1));
    assert_eq!(law.pressure(&node, -1e-9), 0.0);
    let grown = law.press(&mut node, 0.02, &WONG);
    let rebound = law.virgin(0.02) / (5.03e8 * 0.02);
    assert!((grown - (0.02 - rebound)).abs() < 1e-8, "{grown}");
    // The soil is stiff below the deepest press, continuous above it, and without force in the rut.
    assert!((law.pressure(&node, 0.02) / law.virgin(0.02) - 1.0).abs() < 1e-5);
    assert!((law.pressure(&node, 0.02 + 1e-6) / law.virgin(0.02) - 1.0).abs() < 1e-3);
    let half = law.pressure(&node, 0.02 - 0.5 * rebound);
    assert!((half / law.virgin(0.02) - 0.5).abs() < 1e-3, "{half}");
    assert_eq!(law.pressure(&node, 0.02 - 1.01 * rebound), 0.0);
    assert_eq!(law.press(&mut node, 0.019, &WONG), 0.0);
}

#[test]
fn slip_softens_what_was_pressed_without_it() {
    let (still, mut node) = (law(0.0), flat());
    still.press(&mut node, 0.02, &WONG);
    let spun = law(0.8);
    assert!(spun.pressure(&node, 0.02) < 0.5 * still.pressure(&node, 0.02));
    let grown = spun.press(&mut node, 0.02, &WONG);
    assert!(grown > 0.0 && grown < 0.001, "{grown}");
    // The soil is as soft as at the start if it is pressed without slip again.
    assert!((still.pressure(&node, 0.02) / spun.virgin(0.02) - 1.0).abs() < 1e-5);
}

/// A node pressed by 5 kPa.
fn pressed() -> Node {
    Node { pressed: [0.01, 5000.0, 0.0095], ..flat() }
}

/// The node after a step (m).
fn go(law: &Law, node: &mut Node, step: Vec3, p: f64) {
    let (tau, called) = law.sheared(node, step, &Vec3::z(), p, 20.0);
    node.shear = [tau.x as f32, tau.y as f32, tau.z as f32];
    node.mobilised = called as f32;
}

fn stress(node: &Node) -> Vec3 {
    Vec3::from(node.shear.map(f64::from))
}

#[test]
fn shear_is_janosi_forth_and_elastic_back() {
    let (law, mut node) = (law(0.0), pressed());
    let (dir, strength) = (Vec3::new(0.6, 0.8, 0.0), law.strength(5000.0));
    for k in 1..=1000 {
        go(&law, &mut node, dir * 5e-5, 5000.0);
        let j = 5e-5 * f64::from(k);
        let want = strength * (1.0 - (-j / law.shear).exp());
        // The error is at most j e^(−j/K)/(ρ K), which is 1.8 % of the strength at j = K.
        assert!((stress(&node) - dir * want).norm() < 0.02 * strength, "{node:?} {want}");
    }
    // Moving back by the elastic deflection, K/20 at full strength, removes the stress; moving forth
    // again restores it.
    let was = stress(&node);
    let elastic = was.norm() / (20.0 * strength / law.shear);
    go(&law, &mut node, -dir * elastic, 5000.0);
    assert!(stress(&node).norm() < 1e-3 * strength && elastic < 1e-3, "{node:?}");
    go(&law, &mut node, dir * elastic, 5000.0);
    assert!((stress(&node) - was).norm() < 1e-3 * strength);
    // The stress stays while the wheel is at rest. Less pressure reduces it to the strength at this pressure. If the
    // direction of motion changes, the stress follows within a millimetre or two.
    let still = node;
    go(&law, &mut node, Vec3::zeros(), 5000.0);
    assert!((stress(&node) - stress(&still)).norm() < 1e-6 * strength);
    go(&law, &mut node, Vec3::zeros(), 1000.0);
    assert!(stress(&node).norm() <= law.strength(1000.0));
    let across = Vec3::new(-0.8, 0.6, 0.0);
    for _ in 0..60 {
        go(&law, &mut node, across * 5e-5, 5000.0);
    }
    assert!(stress(&node).dot(&across) > 0.98 * stress(&node).norm(), "{node:?}");
    // The stress is in the plane of the face.
    let tilted = Vec3::new(0.6, 0.0, 0.8);
    assert!(law.sheared(&node, Vec3::zeros(), &tilted, 5e3, 20.0).0.dot(&tilted).abs() < 1e-9);
}

#[test]
fn what_is_stored_under_one_pressure_is_given_back_under_another() {
    let (law, mut node) = (law(0.0), pressed());
    go(&law, &mut node, Vec3::x() * 0.05, 5000.0);
    let elastic = stress(&node).norm() / (20.0 * law.strength(5000.0) / law.shear);
    go(&law, &mut node, -Vec3::x() * elastic, 5000.0);
    // Shear the soil by a third of the elastic range from zero stress, halve the pressure, and reverse the shear.
    go(&law, &mut node, Vec3::x() * (elastic / 3.0), 5000.0);
    let stored = stress(&node).norm();
    go(&law, &mut node, Vec3::zeros(), 2500.0);
    assert!((stress(&node).norm() - stored).abs() < 1e-3 * stored);
    go(&law, &mut node, -Vec3::x() * (elastic / 3.0), 2500.0);
    assert!(stress(&node).norm() < 1e-3 * stored, "{node:?} of {stored}");
}

#[test]
fn closed_ways_only_cost_energy_also_when_the_pressure_changes() {
    let law = Law { cohesion: 0.0, ..law(0.0) };
    for seed in 1..60 {
        let mut random = wander(seed);
        let (mut node, mut at, mut work) = (pressed(), Vec3::zeros(), 0.0);
        let mut walk = |step: Vec3, p: f64, node: &mut Node, at: &mut Vec3| {
            let before = stress(node);
            go(&law, node, step, p);
            work += 0.5 * (before + stress(node)).dot(&step);
            *at += step;
        };
        for round in 0..40 {
            let size = if round % 2 == 0 { 2e-5 } else { 2e-6 };
            let step = Vec3::new(random(), random(), 0.0) * size;
            let (p, rate) = (2500.0 + 2000.0 * random(), 500.0 * random());
            for k in 0..(100.0 * (1.1 + random())) as usize {
                let p = p + rate * (k as f64 / 100.0);
                walk(step, p, &mut node, &mut at);
            }
        }
        let home = -at / 2000.0;
        for _ in 0..2000 {
            walk(home, 4000.0, &mut node, &mut at);
        }
        assert!(at.norm() < 1e-9 && work > 0.0, "seed {seed}: {work} J/m² from {at}");
    }
}

#[test]
fn a_node_survives_its_text_and_numbers_that_are_none_change_nothing() {
    let mut node = flat();
    let law = law(0.1);
    law.press(&mut node, 0.013, &WONG);
    (node.shear, node.mobilised) = ([1e3, -2e3, 3e2], 0.4);
    node.heap = 0.004;
    assert_eq!(Node::from(<[f32; 11]>::from(node)), node);
    let bad = Law { k: f64::NAN, ..law };
    let before = node;
    assert_eq!(bad.press(&mut node, 0.05, &WONG), 0.0);
    assert_eq!(node, before);
    assert!(!Node::default().known() && node.known());
}
