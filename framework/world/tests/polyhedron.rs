//! Polyhedra: golden numbers, gradients, far field, inside and outside, invalid meshes.

use crate::support::*;
use linkwork_world::gravity::point_mass;
use linkwork_world::gravity::polyhedron::{Polyhedron, from_obj};
use linkwork_world::spatial::Vec3;
use std::f64::consts::PI;

const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn corners() -> Vec<Vec3> {
    vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z()]
}

fn tetrahedron() -> Polyhedron {
    Polyhedron::new(corners(), &TETRAHEDRON, 1.0).unwrap()
}

const CUBE: &str = "# side 1, centre at the origin; quads\nv -0.5 -0.5 -0.5\nv 0.5 -0.5 -0.5\nv 0.5 0.5 -0.5\nv -0.5 0.5 -0.5\n\
    v -0.5 -0.5 0.5\nv 0.5 -0.5 0.5\nv 0.5 0.5 0.5\nv -0.5 0.5 0.5\nvn 0 0 1\n\
    f 1 4 3 2\nf 5/1/1 6/2/1 7/3/1 8/4/1\nf 1 2 6 5\nf 2 3 7 6\nf -6 -5 -1 -2\nf 4 1 5 8\n";

/// Reference: unit cube, Gρ = 1, at (1, 2, 3).
#[test]
fn the_cube_gives_the_golden_numbers() {
    let cube = from_obj("cube.obj", CUBE, 1.0, 1.0).unwrap();
    relative(cube.volume(), 1.0, 1e-15, "volume");
    near3(&cube.centroid(), &Vec3::zeros(), 3e-16, "centroid");
    let g = cube.gravity(&Vec3::new(1.0, 2.0, 3.0));
    near(g.potential, 0.26726619638669, 5e-15, "U");
    let a = Vec3::new(-0.0190855177453643, -0.0381776796414790, -0.0572817004062692);
    near3(&g.acceleration, &a, 5e-16, "a");
}

/// Cubature, and reference data quick_golden.json, polyhedron_tetrahedron_G_rho_1.
#[test]
fn the_tetrahedron_gives_the_golden_numbers() {
    let t = tetrahedron();
    let a = Vec3::new(-0.02407492538373, -0.01055451085095, -0.01733143971333);
    near3(&t.gravity(&Vec3::new(2.0, 1.0, 1.5)).acceleration, &a, 5e-15, "a");
    let Some(golden) = golden() else { return };
    let cases = golden["polyhedron_tetrahedron_G_rho_1"]["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 4);
    for case in cases {
        let g = t.gravity(&vec3(&case["r"]));
        near3(&g.acceleration, &vec3(&case["acc"]), 3e-15, "a");
        near(g.potential, number(&case["potential"]), 3e-15, "U");
        near(g.gradient.trace(), number(&case["laplacian"]), 1e-13, "∇²U");
    }
}

/// An ellipsoid-like body without symmetry: the asteroid of the reference data.
fn asteroid() -> Option<Polyhedron> {
    let file = reference("flight/asteroid_touch_and_go.json")?;
    let all: serde_json::Value = serde_json::from_str(&file).unwrap();
    let a = &all["asteroid"];
    let list = |what: &str| a[what].as_array().unwrap().clone();
    let vertices = list("vertices_m").iter().map(vec3).collect();
    let faces: Vec<[u32; 3]> = list("faces_outward_0based")
        .iter()
        .map(|f| numbers(f).iter().map(|x| *x as u32).collect::<Vec<_>>().try_into().unwrap())
        .collect();
    let body = Polyhedron::new(vertices, &faces, number(&a["G"]) * number(&a["density"])).unwrap();
    relative(body.volume(), number(&a["volume"]), 1e-14, "volume");
    relative(body.mu(), number(&a["mu"]), 1e-14, "mu");
    Some(body)
}

#[test]
fn acceleration_and_gradient_are_slopes_and_laplace_holds() {
    let Some(body) = asteroid() else { return };
    let mut random = Random(4);
    for k in 0..20 {
        // Test points inside and outside.
        let p = random.on_sphere(if k % 2 == 0 { 400.0 } else { 60.0 });
        let g = body.gravity(&p);
        let a = gradient(|p| body.gravity(p).potential, &p, 0.5);
        near3(&g.acceleration, &a, 1e-8 * g.acceleration.norm(), "a = ∂V/∂x");
        let H = slope(|p| body.gravity(p).acceleration, &p, 0.5);
        near33(&g.gradient, &H, 1e-7 * H.norm(), "∂a/∂x");
        let inside = k % 2 == 1;
        assert_eq!(body.contains(&p), inside, "{p:?}");
        near(body.winding(&p), f64::from(u8::from(inside)), 1e-13, "winding");
        let laplace = if inside { -4.0 * PI * body.mu() / body.volume() } else { 0.0 };
        near(g.gradient.trace(), laplace, 1e-12 * H.norm(), "∇²V");
    }
}

#[test]
fn far_away_it_is_a_point_at_the_centroid() {
    let Some(body) = asteroid() else { return };
    let p = Vec3::new(1.5e4, -2e4, 1e4);
    let point = point_mass(body.mu(), &(p - body.centroid()));
    let d = (body.gravity(&p).acceleration - point).norm() / point.norm();
    assert!(d < 1e-4 && d > 1e-6, "the rest is of second order: {d:e}");
}

/// A distant cube acts as a point to (size/distance)⁴ (its moments of degree 2 and 3 equal those of a sphere), but a tetrahedron does not: its closed
/// form and its series agree at the switch-over distance, and the series has consistent derivatives.
#[test]
fn far_away_moments_take_the_place_of_the_closed_form() {
    let cube = from_obj("cube.obj", CUBE, 1.0, 1.0).unwrap();
    let along = Vec3::new(1.0, 2.0, 3.0).normalize();
    for d in [1e3, 1e4, 1e5, 1e6, 1e9] {
        let g = cube.gravity(&(along * d));
        near3(&(g.acceleration * d * d), &-along, 1e-12, "a d²");
        relative(g.potential, 1.0 / d, 1e-12, "V");
        near(g.gradient.trace() * d * d * d, 0.0, 1e-14, "∇²V");
    }
    let body = tetrahedron();
    let size = body.vertices().iter().map(|v| (v - body.centroid()).norm()).fold(0.0, f64::max);
    for along in [Vec3::new(1.0, 2.0, 3.0), Vec3::new(-3.0, 1.0, 0.5), Vec3::new(0.0, -1.0, 2.0)] {
        let at = |k: f64| body.centroid() + along.normalize() * (k * size);
        let (near_by, far) = (body.gravity(&at(149.999_999)), body.gravity(&at(150.000_001)));
        // Subtract the change over the step.
        let step = near_by.gradient * (at(150.000_001) - at(149.999_999));
        let change = far.acceleration - near_by.acceleration - step;
        let (a, H) = (far.acceleration.norm(), far.gradient.norm());
        assert!(change.norm() < 2e-9 * a, "{:e}", change.norm() / a);
        near33(&far.gradient, &near_by.gradient, 1e-7 * H, "∂a/∂x");
        // At a smaller distance, both are accurate to (size/distance)⁴. A point mass would have an
        // error of 1e-4.
        let p = at(200.0);
        let g = body.gravity(&p);
        let slopes = gradient(|p| body.gravity(p).potential, &p, 1.0);
        near3(&g.acceleration, &slopes, 1e-8 * g.acceleration.norm(), "a = ∂V/∂x");
        near33(
            &g.gradient,
            &slope(|p| body.gravity(p).acceleration, &p, 1.0),
            1e-7 * g.gradient.norm(),
            "H",
        );
        let point = point_mass(body.mu(), &(p - body.centroid()));
        let beyond = (g.acceleration - point).norm() / point.norm();
        assert!(beyond > 1e-7 && beyond < 1e-4, "{beyond:e}");
    }
}

#[test]
fn edges_and_corners_have_finite_accelerations() {
    let t = tetrahedron();
    for p in [Vec3::zeros(), Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.2, 0.2, 0.0), Vec3::x() * 3.0] {
        let near_by = t.gravity(&(p + Vec3::new(1e-9, 2e-9, -1e-9)));
        let g = t.gravity(&p);
        assert!(g.acceleration.iter().all(|x| x.is_finite()), "{p:?}");
        near3(&g.acceleration, &near_by.acceleration, 1e-6, "continuous");
    }
}

#[test]
fn meshes_that_do_not_close_are_refused() {
    let fault = |v: Vec<Vec3>, f: &[[u32; 3]]| Polyhedron::new(v, f, 1.0).unwrap_err().to_string();
    let turned = TETRAHEDRON.map(|[a, b, c]| [a, c, b]);
    assert!(fault(corners(), &turned).contains("counter-clockwise as seen from outside"));
    assert!(fault(corners(), &TETRAHEDRON[..3]).contains("close the surface"));
    let mut one = TETRAHEDRON;
    one[3] = [1, 3, 2];
    assert!(fault(corners(), &one).contains("both run from"));
    one[3] = [1, 2, 4];
    assert!(fault(corners(), &one).contains("triangle 3: names vertex 4 of 4"));
    one[3] = [1, 2, 1];
    assert!(fault(corners(), &one).contains("triangle 3: has no area"));
    let mut bad = corners();
    bad[2].y = f64::NAN;
    assert!(fault(bad, &TETRAHEDRON).contains("vertex 2: has a NaN"));
    assert!(fault(vec![], &[]).contains("has no vertices"));
    assert!(
        Polyhedron::new(corners(), &TETRAHEDRON, -1.0).unwrap_err().to_string().contains("g_rho")
    );
}

#[test]
fn wrong_obj_lines_are_refused_with_their_number() {
    let fault = |t: &str| from_obj("rock.obj", t, 1.0, 1.0).unwrap_err().to_string();
    assert!(fault("v 1 2\n").contains("rock.obj:1: a vertex without three numbers"));
    assert!(
        fault("v 0 0 0\nf 1 2 3\n")
            .contains("rock.obj:2: `2` does not refer to one of the 1 vertices above")
    );
    assert!(fault("v 0 0 0\nf 1 1\n").contains("rock.obj:2: fewer than three corners"));
    assert!(fault("v 0 0 0\nf 1 x 1\n").contains("`x` is not a corner"));
    assert!(fault("f 0 0 0\n").contains("does not refer to one of"));
}
