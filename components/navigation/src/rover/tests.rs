//! The software on made points, without a camera: walls, zones, ends of all kinds, forks.
use super::*;
use crate::arcs::Body;
use crate::assess::Limits;

fn rover(goal: [f64; 2]) -> Rover {
    let body = Body { length: 1.2, width: 1.0, discs: 2 };
    Rover {
        goal,
        tolerance: 0.3,
        speed: 0.2,
        spot_rate: 0.2,
        tilt_max: 0.5,
        slip_max: 0.6,
        patience: 10.0,
        progress: 100.0,
        weight: 2.0,
        unknown: 0.7,
        coarse: 2,
        margin: 6.0,
        keep_in: [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY],
        look_ahead: 2.0,
        body_margin: 0.1,
        sight: 6.0,
        keep_out: vec![],
        free: vec![[0.0, 0.0, 1.5]],
        grid: Grid { cell: 0.1, memory: f64::INFINITY },
        arcs: Arcs {
            count: 15,
            curvature_max: 0.8,
            length: 3.0,
            step: 0.1,
            near: 0.6,
            leave: 0.3,
            share: 0.4,
            scale: 3.0,
            turn_cost: 0.5,
            stop_cost: 0.5,
            back_cost: 3.0,
            hysteresis: 0.03,
            body,
        },
    }
}

fn judge(rover: &Rover) -> Assessor {
    let radius = rover.arcs.body.radius() + 0.1;
    let limits =
        Limits { radius, step_width: 0.3, tilt: 0.4, roughness: 0.1, step: 0.2, seen: 0.4 };
    Assessor::new(rover.grid.cell, limits).unwrap()
}

/// All points of the ground within 5 m, 60° to either side of the heading.
fn seen(at: Place, height: &dyn Fn(f64, f64) -> f64) -> Vec<Vec3> {
    let side = |k: i32, n: i32| f64::from(k) / f64::from(n);
    let fan = (1..100).flat_map(|r| (-60..=60).map(move |t| (side(r, 20), side(t, 57))));
    fan.map(|(r, t)| {
        let (s, c) = (at[2] + t).sin_cos();
        let (x, y) = (at[0] + r * c, at[1] + r * s);
        Vec3::new(x, y, height(x, y))
    })
    .collect()
}

struct Run {
    k: Knowledge,
    memory: Memory,
    at: Place,
    way: Vec<Place>,
}

impl Run {
    fn new() -> Self {
        let at = [0.0; 3];
        Run { k: Knowledge::default(), memory: Memory::default(), at, way: vec![] }
    }

    /// Samples of 0.5 s, a picture in each fourth.
    fn go(&mut self, rover: &Rover, from: u32, to: u32, height: &dyn Fn(f64, f64) -> f64) {
        let judge = judge(rover);
        for n in from..to {
            let time = 0.5 * f64::from(n);
            if n % 4 == 0 {
                rover.see(&judge, &mut self.k, &seen(self.at, height), self.at, time);
            }
            let pose = Pose { place: self.at, tilt: 0.0, slip: 0.0 };
            let [v, w] = rover.decide(&judge, &mut self.k, &mut self.memory, &pose, time, true);
            if let Some(mv) = self.memory.doing.filter(|_| self.memory.status.goes_on()) {
                let rates = match mv {
                    Move::Forward(kappa) => [0.2, 0.2 * kappa],
                    Move::Backward(kappa) => [-0.2, -0.2 * kappa],
                    Move::Turn(angle) => [0.0, 0.2_f64.copysign(angle)],
                };
                assert_eq!([v, w], rates);
                self.at = rover.after(self.at, mv, 0.5);
            } else {
                assert_eq!([v, w], [0.0; 2]);
            }
            self.way.push(self.at);
        }
    }
}

/// A wall across the way, 0.6 m high and thick, from y = −3 to 3 m.
fn wall(x: f64, y: f64) -> f64 {
    if (4.0..4.6).contains(&x) && y.abs() < 3.0 { 0.6 } else { 0.0 }
}

#[test]
fn it_drives_around_a_wall_that_it_comes_to_see() {
    let rover = rover([8.0, 0.0]);
    let mut run = Run::new();
    run.go(&rover, 0, 400, &wall);
    assert_eq!(run.memory.status, Status::Arrived, "{:?}", run.at);
    let off = (run.at[0] - 8.0).hypot(run.at[1]);
    assert!(off <= 0.3, "{off}");
    for [x, y, heading] in run.way {
        // The points are on the edges of the rover's rectangle, with its corners.
        for k in 0..40 {
            let t = 0.05 * f64::from(k % 20) - 0.475;
            let [along, left] = if k < 20 { [1.2 * t, 0.5] } else { [0.6, 1.0 * t] };
            for sign in [1.0, -1.0] {
                let (s, c) = heading.sin_cos();
                let p = [x + sign * (c * along - s * left), y + sign * (s * along + c * left)];
                assert_eq!(wall(p[0], p[1]), 0.0, "{x} {y} {heading}");
            }
        }
    }
}

#[test]
fn a_long_way_around_is_progress_and_the_region_grows_with_it() {
    // The wall extends 8 m beyond the initial region. For longer than `progress` the rover comes no nearer to the goal
    // while it drives along the wall.
    let wall = |x: f64, y: f64| if (4.0..4.6).contains(&x) && y.abs() < 14.0 { 0.6 } else { 0.0 };
    let rover = Rover { progress: 120.0, ..rover([8.0, 0.0]) };
    let mut run = Run::new();
    run.go(&rover, 0, 900, &wall);
    assert_eq!(run.memory.status, Status::Arrived, "{:?}", run.at);
    let farthest = run.way.iter().map(|at| at[1].abs()).fold(0.0, f64::max);
    assert!(farthest > 14.0, "{farthest}");
}

#[test]
fn it_stays_where_it_may_plan() {
    // The wall crosses the whole area in which the rover may plan: the rover would have to leave
    // the area to pass it.
    let wall = |x: f64, y: f64| if (4.0..4.6).contains(&x) && y.abs() < 6.0 { 0.6 } else { 0.0 };
    let rover = Rover { keep_in: [-2.0, -5.0, 10.0, 5.0], ..rover([8.0, 0.0]) };
    let mut run = Run::new();
    run.go(&rover, 0, 600, &wall);
    assert!(matches!(run.memory.status, Status::NoWay), "{:?}", run.memory.status);
    assert!(run.way.iter().all(|at| (-2.0..10.0).contains(&at[0]) && at[1].abs() < 5.0));
    let outside = Rover { keep_in: [-2.0, -5.0, 7.0, 5.0], ..rover };
    let mut run = Run::new();
    run.go(&outside, 0, 4, &|_, _| 0.0);
    assert_eq!(run.memory.status, Status::Outside);
}

#[test]
fn from_hazards_that_it_sees_late_it_goes_back_where_it_came_from() {
    let rover = Rover { progress: 300.0, ..rover([8.0, 0.0]) };
    let mut run = Run::new();
    run.go(&rover, 0, 30, &|_, _| 0.0);
    let [x, y, _] = run.at;
    assert!(run.memory.status == Status::Driving && x > 2.0, "{:?}", run.at);
    // A rock is next to each front side of the rover: its discs overlap hazards, its rectangle does
    // not.
    let rock = move |px: f64, py: f64| {
        let beside = (py - y).abs() > 0.62 && (py - y).abs() < 1.0;
        if beside && (x - 0.2..x + 0.6).contains(&px) { 0.5 } else { 0.0 }
    };
    let began = run.way.len();
    run.go(&rover, 30, 700, &rock);
    assert_eq!(run.memory.status, Status::Arrived, "{:?}", run.at);
    let back = run.way[began..].iter().map(|at| at[0]).fold(f64::INFINITY, f64::min);
    assert!(back < x - 0.5 && !run.k.failed.is_empty(), "{back} {x}");
    // The rover drives back along its trail, and its rectangle never overlaps the rocks.
    for [ax, ay, heading] in run.way.drain(began..) {
        for k in 0..40 {
            let t = 0.05 * f64::from(k % 20) - 0.475;
            let [along, left] = if k < 20 { [1.2 * t, 0.5] } else { [0.6, 1.0 * t] };
            for sign in [1.0, -1.0] {
                let (s, c) = heading.sin_cos();
                let p = [ax + sign * (c * along - s * left), ay + sign * (s * along + c * left)];
                assert_eq!(rock(p[0], p[1]), 0.0, "{ax} {ay} {heading}");
            }
        }
    }
}

#[test]
fn split_is_straight() {
    let rover = rover([8.0, 0.0]);
    let (mut straight, mut split) = (Run::new(), Run::new());
    straight.go(&rover, 0, 120, &wall);
    split.go(&rover, 0, 61, &wall);
    let bytes = rmp_serde::to_vec_named(&split.k).unwrap();
    let fork = split.k.clone();
    split.k = rmp_serde::from_slice(&bytes).unwrap();
    split.go(&rover, 61, 120, &wall);
    assert!(split.way == straight.way && split.k == straight.k && split.memory == straight.memory);
    // The fork does not change when the original continues.
    assert!(rmp_serde::to_vec_named(&fork).unwrap() == bytes && fork != split.k);
}

#[test]
fn keep_out_zones_are_not_entered() {
    let zone = [4.0, 0.3, 1.0];
    let rover = Rover { keep_out: vec![zone], ..rover([8.0, 0.0]) };
    let mut run = Run::new();
    run.go(&rover, 0, 300, &|_, _| 0.0);
    assert_eq!(run.memory.status, Status::Arrived, "{:?}", run.at);
    for at in run.way {
        let clear = rover.arcs.body.middles(at).map(|p| (p[0] - zone[0]).hypot(p[1] - zone[1]));
        assert!(clear.fold(f64::INFINITY, f64::min) > zone[2] + rover.arcs.body.radius());
    }
}

#[test]
fn every_end_is_a_state() {
    let end = |rover: &Rover, height: &dyn Fn(f64, f64) -> f64, samples: u32| {
        let mut run = Run::new();
        run.go(rover, 0, samples, height);
        (run.memory.status, run.at)
    };
    let flat = |_: f64, _: f64| 0.0;
    // The goals are in a wall, within a ring of zones, far away, and not finite.
    let (status, _) = end(&rover([4.3, 0.0]), &wall, 200);
    assert_eq!(status, Status::GoalInObstacle);
    let zones: Vec<Disc> = (0..16)
        .map(|k| std::f64::consts::FRAC_PI_8 * f64::from(k))
        .map(|t| [6.0 + 2.5 * f64::cos(t), 2.5 * f64::sin(t), 0.7])
        .collect();
    let (status, at) = end(&Rover { keep_out: zones, ..rover([6.0, 0.0]) }, &flat, 200);
    assert_eq!((status, at), (Status::NoWay, [0.0; 3]));
    // Rocks surround the start.
    let ring = |x: f64, y: f64| if (0.8..1.0).contains(&x.hypot(y)) { 0.5 } else { 0.0 };
    let (status, at) = end(&rover([6.0, 0.0]), &ring, 60);
    assert!(status == Status::StartInObstacle && at[0].hypot(at[1]) < 0.3, "{status:?} {at:?}");
    for goal in [[1e9, 0.0], [f64::NAN, 0.0], [5e4, 5e4]] {
        assert_eq!(end(&rover(goal), &flat, 4), (Status::Outside, [0.0; 3]), "{goal:?}");
    }
    // The rover never sees the ground: it stands still, and gives up.
    let blind = Rover { free: vec![], sight: 0.1, ..rover([5.0, 0.0]) };
    assert_eq!(end(&blind, &flat, 40), (Status::NoMove, [0.0; 3]));
}

#[test]
fn tilt_slip_and_want_of_progress_stop_it_for_good() {
    let rover = rover([5.0, 0.0]);
    let judge = judge(&rover);
    let flat = seen([0.0; 3], &|_, _| 0.0);
    let calm = Pose { place: [0.0; 3], tilt: 0.0, slip: 0.0 };
    for (pose, status) in [
        (Pose { tilt: 0.6, ..calm }, Status::Tilted),
        (Pose { tilt: f64::NAN, ..calm }, Status::Tilted),
        (Pose { slip: 0.7, ..calm }, Status::Slipping),
    ] {
        let (mut k, mut memory) = (Knowledge::default(), Memory::default());
        rover.see(&judge, &mut k, &flat, calm.place, 0.0);
        let mut decide = |pose: &Pose, t| rover.decide(&judge, &mut k, &mut memory, pose, t, true);
        assert!(decide(&calm, 0.0)[0] > 0.0);
        assert_eq!(decide(&pose, 0.5), [0.0; 2]);
        assert_eq!(decide(&calm, 1.0), [0.0; 2]);
        assert_eq!(memory.status, status);
    }
    // The rover is commanded to drive and does not move forward.
    let (mut k, mut memory) = (Knowledge::default(), Memory::default());
    rover.see(&judge, &mut k, &flat, calm.place, 0.0);
    let mut when = None;
    for n in 0..300 {
        let v = rover.decide(&judge, &mut k, &mut memory, &calm, f64::from(n), true);
        if v == [0.0; 2] {
            when.get_or_insert(n);
        }
    }
    assert_eq!((memory.status, when), (Status::NoProgress, Some(100)));
}

#[test]
fn it_does_not_see_itself_and_stands_until_it_sees() {
    let rover = rover([5.0, 0.0]);
    let judge = judge(&rover);
    let (mut k, mut memory) = (Knowledge::default(), Memory::default());
    let pose = Pose { place: [0.0, 0.0, 0.5], tilt: 0.0, slip: 0.0 };
    assert_eq!(rover.decide(&judge, &mut k, &mut memory, &pose, 0.0, false), [0.0; 2]);
    assert_eq!(memory.status, Status::Blind);
    // The points are a mast on the body, a point beyond the range of sight, a non-finite point, and
    // a point that counts.
    let (s, c) = pose.place[2].sin_cos();
    let points = [
        Vec3::new(0.6 * c, 0.6 * s, 1.0),
        Vec3::new(7.0, 0.0, 0.0),
        Vec3::new(f64::NAN, 0.0, 0.0),
        Vec3::new(2.0, 0.0, 0.0),
    ];
    rover.see(&judge, &mut k, &points, pose.place, 0.0);
    let count: f64 = k.map.cells.iter().flat_map(|(_, cells)| cells.iter().map(|c| c.count)).sum();
    assert_eq!((count, k.lost), (1.0, 1));
}
