//! Tests of `flight.terrain_fix`: shifts are found within the reported deviation; doubtful matches are rejected.
use super::*;
use crate::guidance::test_soil::firm;
use linkwork_spatial::Quat;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Terrain made of waves, with or without repetition within the search.
#[derive(Clone, Copy)]
enum Shape {
    Hills,
    Even,
    Furrows,
    Tiles,
    Rows,
}

struct Field(Shape, Soil);

impl Field {
    fn height(&self, x: f64, y: f64) -> f64 {
        match self.0 {
            Shape::Hills => {
                1.5 * (0.21 * x + 0.3).sin() * (0.17 * y - 0.8).cos()
                    + 0.8 * (0.43 * x - 0.31 * y).sin()
                    + 0.4 * (0.77 * y + 0.55 * x + 1.0).cos()
                    + 0.02 * x
            }
            Shape::Even => 0.03 * x - 0.01 * y,
            Shape::Furrows => 1.5 * (0.5 * x).sin(),
            // These heights have a period of 12 m along x and y.
            Shape::Tiles => {
                let k = std::f64::consts::TAU / 12.0;
                1.5 * (k * x).sin() * (k * y).cos() + 0.5 * (2.0 * k * y).sin()
            }
            // These heights have a period of 12 m along x and are constant along y.
            Shape::Rows => {
                let k = std::f64::consts::TAU / 12.0;
                (k * x).sin() * (1.5 + (0.19 * y).cos()) + 0.9 * (0.33 * y + 0.4).sin()
            }
        }
    }
}

impl Terrain for Field {
    fn ground(&self, x: f64, y: f64) -> Option<Ground> {
        if x.abs() > 200.0 || y.abs() > 200.0 {
            return None;
        }
        let h = 1e-5;
        let a = (self.height(x + h, y) - self.height(x - h, y)) / (2.0 * h);
        let b = (self.height(x, y + h) - self.height(x, y - h)) / (2.0 * h);
        Some(Ground { height: self.height(x, y), normal: Vec3::new(-a, -b, 1.0).normalize() })
    }
    fn bounds(&self) -> [f64; 4] {
        [-200.0, -200.0, 200.0, 200.0]
    }
    fn soil(&self, _: f64, _: f64) -> &Soil {
        &self.1
    }
    fn surface(&self) -> Surface {
        unreachable!("nobody draws it")
    }
}

fn field(shape: Shape) -> Field {
    Field(shape, firm())
}

fn fix(shape: Shape, sigma: f64) -> TerrainFix {
    let map = Arc::new(field(shape)) as Arc<dyn Terrain>;
    TerrainFix::build(TerrainFixParams {
        columns: 16,
        rows: 8,
        azimuth: [-std::f64::consts::PI, std::f64::consts::PI],
        elevation: [-1.5, -0.9],
        step: 1.0,
        steps: 15,
        apart: 3,
        sigma,
        echoes_min: 20,
        gate: 5.0,
        misfit_max: 2.0,
        map: Handle::new("map", map),
    })
    .unwrap()
}

/// Computes ranges from the true state by marching along each beam, with range noise.
fn ranges(m: &TerrainFix, shape: Shape, at: &NodeState, noise: f64, sample: u64) -> Vec<f64> {
    let ground = field(shape);
    let over = |p: Vec3| p.z - ground.height(p.x, p.y);
    let c = Clock::at(0.0, 1.0, sample);
    let one = |(k, d): (usize, &Vec3)| {
        let d = at.rotation * d;
        let (mut low, mut high) = (0.0, 0.0);
        while over(at.position + d * high) > 0.0 {
            (low, high) = (high, high + 0.5);
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if over(at.position + d * middle) > 0.0 { low = middle } else { high = middle }
        }
        low + noise * c.normal(k as u32)
    };
    m.beams.iter().enumerate().map(one).collect()
}

fn lander() -> NodeState {
    let rotation = Quat::from_euler_angles(0.06, -0.04, 0.9);
    NodeState { position: Vec3::new(12.0, -7.0, 60.0), rotation, ..NodeState::identity() }
}

#[test]
fn an_error_of_the_estimate_is_found_exactly_without_noise() {
    let m = fix(Shape::Hills, 0.05);
    let truth = lander();
    let seen = ranges(&m, Shape::Hills, &truth, 0.0, 0);
    for error in [Vec3::zeros(), Vec3::new(7.3, -4.6, 2.1), Vec3::new(-12.2, 9.9, -30.0)] {
        let estimate = NodeState { position: truth.position + error, ..truth };
        let y = m.find(&estimate, &seen);
        assert!(y.matched && y.why == 0.0, "{y:?}");
        assert!(
            (y.position - truth.position).norm() < 1e-6,
            "{error}: {:?}",
            y.position - truth.position
        );
        assert!((y.shift + error).norm() < 1e-6 && y.misfit < 1e-9 && y.echoes == 128.0);
        assert!(y.rival > 5.0, "{}", y.rival);
    }
}

#[test]
fn errors_with_noise_are_those_that_it_tells() {
    // Beams are within 40° of the vertical, so the noise of a range is nearly the noise of a height.
    let m = fix(Shape::Hills, 0.1);
    let truth = lander();
    let estimate = NodeState { position: truth.position + Vec3::new(3.4, 2.7, -1.0), ..truth };
    let (mut squares, runs) = (Vec3::zeros(), 60);
    for sample in 0..runs {
        let seen = ranges(&m, Shape::Hills, &truth, 0.1, sample);
        let y = m.find(&estimate, &seen);
        assert!(y.matched, "{sample}: {y:?}");
        let e = y.position - truth.position;
        squares += e.component_div(&y.deviation).map(|x| x * x) / runs as f64;
    }
    // The RMS of 60 standard normal numbers is between 0.7 and 1.3 within three standard
    // deviations.
    for k in 0..3 {
        assert!((0.6..1.3).contains(&squares[k].sqrt()), "{k}: {}", squares[k].sqrt());
    }
}

#[test]
fn what_may_be_a_false_match_is_told() {
    let truth = lander();
    let at = |m: &TerrainFix, map: Shape, error: Vec3| {
        let estimate = NodeState { position: truth.position + error, ..truth };
        m.find(&estimate, &ranges(m, map, &truth, 0.02, 3))
    };
    let small = Vec3::new(2.3, -1.4, 0.5);
    let told = |y: TerrainFixOut, why: f64| {
        assert!(!y.matched && y.why == why, "{why}: {y:?}");
        assert!(y.shift == Vec3::zeros() && y.deviation == Vec3::zeros());
    };
    told(at(&fix(Shape::Even, 0.1), Shape::Even, small), 2.0);
    // Position along furrows is not observable.
    told(at(&fix(Shape::Furrows, 0.1), Shape::Furrows, small), 2.0);
    // A pattern that repeats within the search fits the rival as well as the match.
    let y = at(&fix(Shape::Tiles, 0.1), Shape::Tiles, small);
    assert!(y.misfit < 1.0, "{}", y.misfit);
    told(y, 3.0);
    let y = at(&fix(Shape::Rows, 0.1), Shape::Rows, small);
    assert!(y.misfit < 1.0, "{}", y.misfit);
    told(y, 3.0);
    // Here the ground differs from the map.
    told(at(&fix(Shape::Hills, 0.1), Shape::Tiles, small), 4.0);
    // The true shift is outside the search, so the match must be rejected, for any reason.
    for error in
        [Vec3::new(25.0, 3.0, 0.0), Vec3::new(-4.0, -31.0, 2.0), Vec3::new(19.0, 19.0, 0.0)]
    {
        assert!(!at(&fix(Shape::Hills, 0.1), Shape::Hills, error).matched, "{error}");
    }
    // A true shift at the edge of the search is found but rejected.
    told(at(&fix(Shape::Hills, 0.1), Shape::Hills, Vec3::new(15.0, 0.0, 0.0)), 5.0);
    let m = fix(Shape::Hills, 0.1);
    let mut few = ranges(&m, Shape::Hills, &truth, 0.0, 0);
    few[19..].fill(0.0);
    told(m.find(&truth, &few), 1.0);
    let gone = NodeState { position: Vec3::new(1e4, 0.0, 60.0), ..truth };
    told(m.find(&gone, &ranges(&m, Shape::Hills, &truth, 0.0, 0)), 1.0);
}

#[test]
fn a_search_that_costs_too_much_or_has_no_rivals_is_refused() {
    let refused = |steps: u32, apart: u32| {
        let p = TerrainFixParams { steps, apart, ..fix(Shape::Hills, 0.1).p };
        TerrainFix::build(p).err().unwrap().to_string()
    };
    assert!(refused(500, 3).contains("map heights per sample"));
    assert!(refused(3, 3).contains("no shift can be more than"));
}

/// A map that counts its queries.
struct Counted(Field, AtomicUsize);

impl Terrain for Counted {
    fn ground(&self, x: f64, y: f64) -> Option<Ground> {
        self.1.fetch_add(1, Ordering::Relaxed);
        self.0.ground(x, y)
    }
    fn bounds(&self) -> [f64; 4] {
        self.0.bounds()
    }
    fn soil(&self, x: f64, y: f64) -> &Soil {
        self.0.soil(x, y)
    }
    fn surface(&self) -> Surface {
        self.0.surface()
    }
}

/// Best node and rival agree with a list of all nodes, for any position of the best node. The map is queried once for each node and echo, and a
/// second time in the rows near the best node.
#[test]
fn the_search_finds_best_and_rival_of_all_nodes_and_looks_once() {
    let truth = lander();
    for (apart, error) in [
        (1, Vec3::new(2.3, -1.4, 0.5)),
        (3, Vec3::new(-14.6, 7.2, 0.0)),
        (4, Vec3::new(14.9, -14.9, 1.0)),
        (14, Vec3::new(-3.0, 9.0, 0.0)),
    ] {
        let map = Arc::new(Counted(field(Shape::Rows), AtomicUsize::new(0)));
        let p = fix(Shape::Rows, 0.1).p;
        let map_of_it = Handle::new("map", Arc::clone(&map) as Arc<dyn Terrain>);
        let m = TerrainFix::build(TerrainFixParams { apart, map: map_of_it, ..p }).unwrap();
        let seen = ranges(&m, Shape::Rows, &truth, 0.02, 7);
        let estimate = NodeState { position: truth.position + error, ..truth };
        let seen = EchoPoints { beams: &m.beams, ranges: &seen, estimate: &estimate };
        let all: Vec<([i32; 2], f64)> = (-15..=15)
            .flat_map(|i| (-15..=15).map(move |j| [i, j]))
            .map(|node| (node, m.node_cost(&seen, 128, node)))
            .collect();
        let (best, cost) = *all.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        let far = |n: &[i32; 2]| (0..2).any(|k| (n[k] - best[k]).abs() > apart as i32);
        let others = all.iter().filter(|(n, _)| far(n)).map(|(_, cost)| *cost);
        let rival = others.fold(f64::INFINITY, f64::min);
        map.1.store(0, Ordering::Relaxed);
        let found = m.search(&seen).unwrap();
        assert_eq!((found.best, found.cost, found.rival), (best, cost, rival), "{apart} {error}");
        let rows = 31 + (2 * apart as usize + 1).min(31);
        let asked = map.1.load(Ordering::Relaxed);
        assert!((31 * 31 * 128..=rows * 31 * 128).contains(&asked), "{apart} {error}: {asked}");
    }
}
