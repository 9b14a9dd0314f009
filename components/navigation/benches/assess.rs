//! What 10 m × 10 m at 0.1 m cost: points into the map, and ground judged for a rover whose disc has a radius of 1.5 m.
//! `cargo bench -p linkwork-navigation --bench assess`
#![allow(missing_docs)]
use divan::{Bencher, black_box};
use linkwork_navigation::assess::{Assessor, Limits, Patch};
use linkwork_navigation::map::{Grid, TerrainMap};
use linkwork_navigation::tiles::{Tiles, Touched};
use linkwork_spatial::Vec3;

const GRID: Grid = Grid { cell: 0.1, memory: f64::INFINITY };

/// Two points a cell over a square around the origin, row by row.
fn points(cells: i32) -> Vec<Vec3> {
    let at = |k: i32| f64::from(k) * 0.1 + 0.04;
    let height = |x: f64, y: f64| 0.1 * x + 0.05 * (3.0 * x).sin() * (2.0 * y).cos();
    let half = cells / 2;
    (-half..half)
        .flat_map(|j| (-cells..cells).map(move |i| [0.5 * at(i) + 0.01, at(j)]))
        .map(|[x, y]| Vec3::new(x, y, height(x, y)))
        .collect()
}

fn assessor() -> Assessor {
    let tilt = 25f64.to_radians();
    let limits =
        Limits { radius: 1.5, step_width: 0.5, tilt, roughness: 0.15, step: 0.3, seen: 0.3 };
    Assessor::new(GRID.cell, limits).expect("limits of a rover")
}

/// 20 000 points into an empty map.
#[divan::bench]
fn map(b: Bencher) {
    let points = points(100);
    b.bench_local(|| GRID.add(&mut TerrainMap::default(), black_box(&points), 0.0));
}

/// 100 by 100 cells anew, as when those in their middle were touched, all of them and all around them seen.
#[divan::bench]
fn assess(b: Bencher) {
    let assessor = assessor();
    let mut map = TerrainMap::default();
    GRID.add(&mut map, &points(160), 0.0);
    let (mut touched, mut patches) = (Touched::default(), Tiles::<Patch>::default());
    let half = 50 - assessor.depends_on();
    (-half..half).flat_map(|j| (-half..half).map(move |i| [i, j])).for_each(|c| touched.add(c));
    b.bench_local(|| assessor.refresh(black_box(&map), &touched, &mut patches));
    assert!(patches.get([-50, -50]).is_some_and(|p| p.known), "the corner was judged");
}

fn main() {
    divan::main();
}
