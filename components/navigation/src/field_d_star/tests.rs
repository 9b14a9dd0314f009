//! Against Dijkstra on the same grid, a fixed point found by another way, straight lines; after any changes; what has no way.
use super::*;

/// Numbers without a pattern, 0 … 1.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.next() * n as f64) as usize).min(n - 1)
    }
}

fn region(x: usize, y: usize) -> Region {
    Region { cell: 0.5, first: [-7, 3], size: [x, y] }
}

/// A point in edges of a cell from the corner of the region, in m.
fn metres(r: &Region, [x, y]: [f64; 2]) -> [f64; 2] {
    [(x + f64::from(r.first[0])) * r.cell, (y + f64::from(r.first[1])) * r.cell]
}

fn random_cost(n: &mut Numbers) -> f64 {
    match n.next() {
        r if r < 0.25 => f64::INFINITY,
        r if r < 0.6 => 1.0,
        _ => 1.0 + 4.0 * n.next(),
    }
}

fn changes(n: &mut Numbers, r: &Region, count: usize) -> Vec<(Index, f64)> {
    (0..count)
        .map(|_| {
            let cell = [n.below(r.size[0]) as i32, n.below(r.size[1]) as i32];
            ([r.first[0] + cell[0], r.first[1] + cell[1]], random_cost(n))
        })
        .collect()
}

/// From every corner to the goal along edges and diagonals of cells, by Dijkstra.
fn dijkstra(p: &Planner) -> Vec<f64> {
    let [nx, ny] = p.region.size;
    let wide = nx + 1;
    let mut value = vec![f64::INFINITY; wide * (ny + 1)];
    let mut open = BTreeSet::new();
    let goal = p.cell_of(p.goal);
    for n in p.corners(goal) {
        let at = [(n % wide) as f64, (n / wide) as f64];
        value[n] = p.at(goal) * (at[0] - p.goal[0]).hypot(at[1] - p.goal[1]);
        open.insert((value[n].to_bits(), n));
    }
    while let Some((bits, n)) = open.pop_first() {
        if f64::from_bits(bits) > value[n] {
            continue;
        }
        let (i, j) = ((n % wide) as isize, (n / wide) as isize);
        let cell = |i: isize, j: isize| {
            let inside = i >= 0 && j >= 0 && i < nx as isize && j < ny as isize;
            if inside { p.at([i as usize, j as usize]) } else { f64::INFINITY }
        };
        for (di, dj) in (-1..=1).flat_map(|j| (-1..=1).map(move |i: isize| (i, j))) {
            let (x, y) = (i + di, j + dj);
            if (di, dj) == (0, 0) || x < 0 || y < 0 || x > nx as isize || y > ny as isize {
                continue;
            }
            let (low_i, low_j) = (i.min(x), j.min(y));
            let way = match (di, dj) {
                (0, _) => cell(i - 1, low_j).min(cell(i, low_j)),
                (_, 0) => cell(low_i, j - 1).min(cell(low_i, j)),
                _ => cell(low_i, low_j) * 2f64.sqrt(),
            };
            let (to, total) = (y as usize * wide + x as usize, value[n] + way);
            if total < value[to] {
                value[to] = total;
                open.insert((total.to_bits(), to));
            }
        }
    }
    value
}

/// The same values by going over all corners until nothing changes, each way minimised by trying points of edges.
fn fixed_point(p: &Planner) -> Vec<f64> {
    let [nx, ny] = p.region.size;
    let wide = nx + 1;
    let place = |n: usize| [(n % wide) as f64, (n / wide) as f64];
    let mut value = vec![f64::INFINITY; wide * (ny + 1)];
    let goal = p.cell_of(p.goal);
    loop {
        let mut changed = false;
        for n in 0..value.len() {
            let mut best = value[n];
            let at = place(n);
            let cells = |k: usize| {
                (at[k] as usize).saturating_sub(1)..=(at[k] as usize).min([nx, ny][k] - 1)
            };
            for cell in cells(1).flat_map(|j| cells(0).map(move |i| [i, j])) {
                let c = p.at(cell);
                if c.is_infinite() {
                    continue;
                }
                if cell == goal {
                    best = best.min(c * (at[0] - p.goal[0]).hypot(at[1] - p.goal[1]));
                }
                for [a, b] in p.sides(cell) {
                    let (pa, pb) = (place(a), place(b));
                    // The path follows the edge from the corner for x, then goes straight to the opposite edge.
                    for s in 0..=40 {
                        let t = f64::from(s) / 40.0;
                        let q = [pa[0] + t * (pb[0] - pa[0]), pa[1] + t * (pb[1] - pa[1])];
                        let v = match s {
                            0 => value[a],
                            40 => value[b],
                            _ => value[a] * (1.0 - t) + value[b] * t,
                        };
                        best = best.min(c * (q[0] - at[0]).hypot(q[1] - at[1]) + v);
                    }
                }
            }
            if best < value[n] - 1e-12 {
                (value[n], changed) = (best, true);
            }
        }
        if !changed {
            return value;
        }
    }
}

#[test]
fn after_any_changes_it_is_what_a_new_planner_finds() {
    let mut n = Numbers(7);
    let mut found = 0;
    for _ in 0..15 {
        let r = region(6 + n.below(25), 6 + n.below(25));
        let inside = |n: &mut Numbers| {
            metres(&r, [n.next() * r.size[0] as f64, n.next() * r.size[1] as f64])
        };
        let goal = inside(&mut n);
        let mut p = Planner::new(r, goal, 1.0).unwrap();
        for round in 0..6 {
            let many = if round == 0 { r.size[0] * r.size[1] } else { 1 + n.below(40) };
            p.change(changes(&mut n, &r, many));
            let from = inside(&mut n);
            let way = p.plan(from, 3.0);
            let mut new = Planner::new(r, goal, 1.0).unwrap();
            let all =
                (0..r.size[1]).flat_map(|j| (0..r.size[0]).map(move |i| [i as i32, j as i32]));
            new.change(all.map(|[i, j]| {
                let cell = [r.first[0] + i, r.first[1] + j];
                (cell, p.cost(cell).unwrap())
            }));
            assert_eq!(way, new.plan(from, 3.0), "{from:?}");
            found += usize::from(matches!(way, PathCost::Found(_)));
            // The full plan is equal as well, and every corner is at most as far as along edges and
            // diagonals.
            new.plan(from, f64::INFINITY);
            let mut all = p.clone();
            all.plan(from, f64::INFINITY);
            assert!(all.g == new.g && all.g == all.rhs && all.open.is_empty());
            let grid = dijkstra(&p);
            let farther = |(g, d): (&f64, &f64)| !(*g <= d * (1.0 + 1e-12));
            assert!(!all.g.iter().zip(&grid).any(farther));
            // The cost is right within the requested tolerance.
            let limit = from_value(way) / r.cell + 3.0 / r.cell;
            assert!(p.g.iter().zip(&all.g).all(|(a, b)| a == b || *b > limit));
        }
    }
    assert!(found > 30, "{found}");
}

fn from_value(way: PathCost) -> f64 {
    if let PathCost::Found(v) = way { v } else { 0.0 }
}

#[test]
fn values_are_those_of_trying_all_points_of_edges() {
    let mut n = Numbers(3);
    for _ in 0..3 {
        let r = region(9, 8);
        let goal = metres(&r, [2.3 + n.next(), 4.1]);
        let mut p = Planner::new(r, goal, 1.0).unwrap();
        p.change(changes(&mut n, &r, 50));
        p.plan(goal, f64::INFINITY);
        let want = fixed_point(&p);
        for (k, (g, w)) in p.g.iter().zip(&want).enumerate() {
            // The sampled points are at most 1/80 of an edge off, and a path along an edge and then across is not sampled.
            assert!(g == w || (g - w < 1e-9 && w - g < 2e-2 * w), "{k}: {g} {w}");
        }
    }
}

#[test]
fn in_the_open_the_way_is_straight_within_a_percent() {
    let r = region(120, 100);
    let goal = metres(&r, [100.3, 80.6]);
    let mut p = Planner::new(r, goal, 1.0).unwrap();
    let mut worst = [0.0_f64; 2];
    for k in 0..40 {
        let turn = 0.04 * f64::from(k) + 3.1;
        let from = [goal[0] + 35.0 * turn.cos(), goal[1] + 35.0 * turn.sin()];
        let PathCost::Found(value) = p.plan(from, 1.0) else { panic!("no way from {from:?}") };
        let path = p.path(from, 10_000);
        let length: f64 =
            path.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum();
        let end = path[path.len() - 1];
        assert!((end[0] - goal[0]).hypot(end[1] - goal[1]) < 1e-9, "{end:?}");
        worst = [worst[0].max(length / 35.0 - 1.0), worst[1].max(value / 35.0 - 1.0)];
        assert!(length / 35.0 > 1.0 - 1e-12 && value / 35.0 > 1.0 - 1e-12);
    }
    println!("longer than straight: way {:.4}, value {:.4}", worst[0], worst[1]);
    assert!(worst[0] < 0.01 && worst[1] < 0.01, "{worst:?}");
}

#[test]
fn the_way_goes_around_a_wall_and_again_when_its_gap_is_shut() {
    let r = Region::new(0.5, [-20.0, -20.0], [20.0, 20.0]).unwrap();
    let (from, goal) = ([-10.2, 0.3], [10.1, 0.4]);
    let mut p = Planner::new(r, goal, 1.0).unwrap();
    let wall = |gap: [i32; 2]| {
        (-30..30).filter(move |j| !(gap[0]..gap[1]).contains(j)).map(|j| ([0, j], f64::INFINITY))
    };
    p.change(wall([6, 8]));
    let PathCost::Found(near) = p.plan(from, 2.0) else { panic!("no way") };
    // The path leads through the gap, whose y is 3 m to 4 m.
    let gap = [0.25, 3.5];
    let about =
        (gap[0] - from[0]).hypot(gap[1] - from[1]) + (gap[0] - goal[0]).hypot(gap[1] - goal[1]);
    assert!((near / about - 1.0).abs() < 0.03, "{near} {about}");
    let path = p.path(from, 1000);
    let through = path.iter().find(|q| q[0] >= 0.0).unwrap();
    assert!(through[1] > 2.9 && through[1] < 4.1, "{through:?}");
    // The length of the path must be equal to the planned cost.
    let length: f64 = path.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum();
    assert!((length / near - 1.0).abs() < 0.02, "{length} {near}");
    p.change([([0, 6], f64::INFINITY), ([0, 7], f64::INFINITY)]);
    let PathCost::Found(far) = p.plan(from, 2.0) else { panic!("no way") };
    assert!(far > near + 8.0, "{far} {near}");
    // Close the wall completely, then open one cell of it.
    let ends = || (-41..41).map(|j| ([0, j], f64::INFINITY));
    p.change(ends());
    assert_eq!(p.plan(from, 2.0), PathCost::Closed);
    assert_eq!(p.path(from, 10), [from]);
    p.change([([0, 20], 1.0)]);
    assert!(matches!(p.plan(from, 2.0), PathCost::Found(_)));
}

#[test]
fn dear_ground_is_crossed_where_it_is_worth_it() {
    let r = Region::new(0.5, [-10.0, -10.0], [10.0, 10.0]).unwrap();
    let (from, goal) = ([-5.0, 0.1], [5.0, 0.2]);
    let mut p = Planner::new(r, goal, 1.0).unwrap();
    let pond = |c: f64| (-4..4).flat_map(move |j| (-4..4).map(move |i| ([i, j], c)));
    // The pond is 4 m by 4 m: driving around costs some 1 m more, driving across (c − 1) 4 m more.
    p.change(pond(1.1));
    let across = |p: &Planner| p.path(from, 1000).iter().any(|q| q[0].hypot(q[1]) < 1.0);
    p.plan(from, 1.0);
    assert!(across(&p));
    p.change(pond(3.0));
    p.plan(from, 1.0);
    assert!(!across(&p));
}

#[test]
fn what_has_no_way_is_told() {
    let r = Region::new(0.5, [0.0, 0.0], [10.0, 10.0]).unwrap();
    assert!(Planner::new(r, [11.0, 5.0], 1.0).is_none());
    assert!(Planner::new(r, [f64::NAN, 5.0], 1.0).is_none());
    let mut p = Planner::new(r, [5.2, 5.2], 1.0).unwrap();
    assert_eq!(p.plan([-1.0, 2.0], 1.0), PathCost::Outside);
    assert_eq!(p.plan([f64::NAN, 2.0], 1.0), PathCost::Outside);
    p.change([([10, 10], f64::INFINITY), ([900, 3], f64::INFINITY)]);
    assert_eq!(p.plan([1.0, 1.0], 1.0), PathCost::GoalInObstacle);
    p.change([([10, 10], 1.0), ([2, 2], f64::INFINITY)]);
    assert_eq!(p.plan([1.1, 1.1], 1.0), PathCost::InObstacle);
    assert!(p.value([1.6, 1.6]).is_finite() && p.value([1.1, 1.1]).is_infinite());
    assert!(matches!(p.plan([1.6, 1.6], 1.0), PathCost::Found(_)));
    // The start is at the goal.
    assert_eq!(p.plan([5.2, 5.2], 1.0), PathCost::Found(0.0));
}

#[test]
fn regions_that_are_none_are_refused() {
    assert!(Region::new(0.5, [0.0, 0.0], [-1.0, 1.0]).is_err());
    assert!(Region::new(0.0, [0.0, 0.0], [1.0, 1.0]).is_err());
    assert!(Region::new(0.5, [0.0, f64::NAN], [1.0, 1.0]).is_err());
    let fault = Region::new(0.01, [-50.0, -50.0], [50.0, 50.0]).unwrap_err().to_string();
    assert!(fault.contains("10001 by 10001 cells"), "{fault}");
}

#[test]
fn a_planner_is_saved_bit_for_bit_in_the_middle_of_its_work() {
    let mut n = Numbers(11);
    let r = region(20, 20);
    let mut p = Planner::new(r, metres(&r, [3.0, 4.5]), 1.0).unwrap();
    p.change(changes(&mut n, &r, 300));
    p.plan(metres(&r, [6.0, 6.0]), 0.5);
    p.change(changes(&mut n, &r, 20));
    assert!(!p.open.is_empty());
    let bytes = rmp_serde::to_vec_named(&p).unwrap();
    let mut again: Planner = rmp_serde::from_slice(&bytes).unwrap();
    assert_eq!(again, p);
    let from = metres(&r, [17.0, 15.0]);
    assert_eq!(again.plan(from, 2.0), p.plan(from, 2.0));
    assert_eq!(again, p);
}
