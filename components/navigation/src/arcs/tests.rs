//! Geometry of arcs and discs; votes on made ground; what is shut; leaving a hazard; hysteresis; mirror images.
use super::*;
use crate::assess::Patch;
use crate::tiles::{Tiles, middle_of, split};

const CELL: f64 = 0.1;

fn arcs() -> Arcs {
    Arcs {
        count: 11,
        curvature_max: 0.5,
        length: 4.0,
        step: 0.1,
        near: 1.0,
        leave: 0.3,
        share: 0.5,
        scale: 3.0,
        turn_cost: 1.0,
        stop_cost: 1.0,
        back_cost: 3.0,
        hysteresis: 0.05,
        body: Body { length: 1.6, width: 1.2, discs: 2 },
    }
}

/// Goodness by place, −8 … 8 m; `None`: unknown.
fn patches(good: impl Fn([f64; 2]) -> Option<u8>) -> Tiles<Patch> {
    let mut out = Tiles::default();
    for [i, j] in (-80..80).flat_map(|j| (-80..80).map(move |i| [i, j])) {
        let (at, place) = split([i, j]);
        let goodness = good(middle_of(CELL, [i, j]));
        out.tile_mut(at)[place] = Patch {
            goodness: goodness.unwrap_or(0),
            known: goodness.is_some(),
            ..Patch::default()
        };
    }
    out
}

fn ground(patches: &Tiles<Patch>) -> Ground<'_> {
    Ground { cell: CELL, patches, keep_out: &[], free: &[], radius: 0.0 }
}

/// Votes from the origin, heading along x, for a goal with nothing in between.
fn votes(arcs: &Arcs, patches: &Tiles<Patch>, goal: [f64; 2]) -> Vec<Vote> {
    votes_from(arcs, patches, goal, [0.0; 3])
}

fn votes_from(arcs: &Arcs, patches: &Tiles<Patch>, goal: [f64; 2], at: Place) -> Vec<Vote> {
    let value = |p: [f64; 2]| (p[0] - goal[0]).hypot(p[1] - goal[1]);
    let heading = (goal[1] - at[1]).atan2(goal[0] - at[0]);
    let distance = value([at[0], at[1]]);
    let wish = DriveRequest { value: &value, heading, distance, last: None };
    arcs.votes(&ground(patches), at, &wish)
}

fn chosen(patches: &Tiles<Patch>, goal: [f64; 2]) -> Option<Move> {
    let arcs = arcs();
    arcs.choose(&votes(&arcs, patches, goal), None).map(|v| v.mv)
}

#[test]
fn arcs_are_circles() {
    for (mv, sign) in [(Move::Forward(0.4), 1.0), (Move::Backward(-0.3), -1.0)] {
        let (Move::Forward(kappa) | Move::Backward(kappa)) = mv else { return };
        let at = [1.0, -2.0, 0.7];
        // Integrate in small steps along the heading in the middle of each step.
        let (n, mut p) = (20_000, at);
        for _ in 0..n {
            let ds = sign * 3.0 / f64::from(n);
            let middle = p[2] + 0.5 * kappa * ds;
            p = [p[0] + ds * middle.cos(), p[1] + ds * middle.sin(), p[2] + kappa * ds];
        }
        let end = end_of(at, mv, 3.0);
        assert!((0..3).all(|k| (end[k] - p[k]).abs() < 1e-8), "{end:?} {p:?}");
    }
    assert_eq!(end_of([1.0, 2.0, 0.0], Move::Forward(0.0), 2.5), [3.5, 2.0, 0.0]);
    assert_eq!(end_of([1.0, 2.0, 0.3], Move::Turn(-2.0), 0.5), [1.0, 2.0, 0.3 - 0.5]);
}

#[test]
fn discs_cover_the_rectangle_and_little_more() {
    for (length, width, discs) in [(2.8, 2.8, 2), (1.6, 1.2, 2), (3.0, 1.0, 3), (1.0, 1.0, 1)] {
        let body = Body { length, width, discs };
        let middles: Vec<_> = body.middles([0.0; 3]).collect();
        let mut farthest = 0.0_f64;
        for k in 0..=200 {
            let t = f64::from(k) / 200.0 - 0.5;
            for p in [[t * length, 0.5 * width], [0.5 * length, t * width]] {
                let near = middles.iter().map(|m| (m[0] - p[0]).hypot(m[1] - p[1]));
                farthest = farthest.max(near.fold(f64::INFINITY, f64::min));
            }
        }
        assert!((farthest - body.radius()).abs() < 1e-12, "{farthest} {}", body.radius());
    }
}

#[test]
fn free_ground_is_crossed_straight_and_a_goal_behind_is_turned_to() {
    let free = patches(|_| Some(BEST));
    assert_eq!(chosen(&free, [6.0, 0.0]), Some(Move::Forward(0.0)));
    let Some(Move::Forward(kappa)) = chosen(&free, [3.0, 2.0]) else { panic!("no arc") };
    assert!(kappa > 0.1);
    let Some(Move::Turn(angle)) = chosen(&free, [-6.0, 1.0]) else { panic!("no turn") };
    assert!((angle - 1.0_f64.atan2(-6.0)).abs() < 1e-12);
    // All arcs have the full vote of the obstacles, and the straight arc to the goal has the full vote of
    // the goal.
    let arcs = arcs();
    let votes = votes(&arcs, &free, [6.0, 0.0]);
    assert_eq!(votes.len(), 22);
    assert!(votes.iter().filter(|v| v.total > 0.0).all(|v| v.obstacles == 1.0));
    let straight = votes.iter().find(|v| v.mv == Move::Forward(0.0)).unwrap();
    assert!((straight.goal - 1.0).abs() < 1e-12 && (straight.total - 1.0).abs() < 1e-12);
}

#[test]
fn votes_of_a_mirrored_ground_are_mirrored() {
    let rough = |[x, y]: [f64; 2]| Some((128.0 + 100.0 * (1.3 * x + 2.1 * y).sin()) as u8);
    let (a, b) = (patches(rough), patches(|[x, y]| rough([x, -y])));
    let arcs = arcs();
    // The start must not be on the border of two cells, because the border belongs to one of them.
    let mirrored = |p: &Tiles<Patch>, side: f64| {
        votes_from(&arcs, p, [5.0, side * 1.5], [0.013, side * 0.037, side * 0.1])
    };
    let (a, b) = (mirrored(&a, 1.0), mirrored(&b, -1.0));
    for (k, v) in a.iter().take(22).enumerate() {
        let m = &b[k / 11 * 11 + 10 - k % 11];
        assert!((v.obstacles - m.obstacles).abs() < 1e-12, "{v:?} {m:?}");
        assert!((v.goal - m.goal).abs() < 1e-9 && (v.total - m.total).abs() < 1e-9, "{v:?} {m:?}");
    }
    let of = |f: fn(f64, f64) -> f64, from| a.iter().map(|v| v.obstacles).fold(from, f);
    assert!(of(f64::max, 0.0) - of(f64::min, 1.0) > 0.1);
}

#[test]
fn a_rock_ahead_shuts_the_arcs_that_meet_it_near_and_costs_those_that_meet_it_far() {
    // Goodness is evaluated for a disc, so the hazard is already enlarged. The front disc is 0.4 m ahead of the
    // centre.
    let rock = |at: [f64; 2]| {
        patches(move |[x, y]| Some(if (x - at[0]).hypot(y - at[1]) < 0.5 { 0 } else { BEST }))
    };
    let arcs = arcs();
    let straight = |at: [f64; 2]| {
        let votes = votes(&arcs, &rock(at), [7.0, 0.0]);
        *votes.iter().find(|v| v.mv == Move::Forward(0.0)).unwrap()
    };
    assert_eq!(straight([1.5, 0.0]).total, 0.0);
    // The arc meets the rock after 3 − 0.5 − 0.4 = 2.1 m, so the vote is (1 − (1 − 2.1/8)) at the
    // first pose inside.
    let far = straight([3.0, 0.0]);
    assert!(far.total > 0.0 && (far.obstacles - 0.5 * 2.1 / 4.0).abs() < 0.02, "{far:?}");
    assert_eq!(straight([3.0, 1.5]).obstacles, 1.0);
    for at in [[1.8, 0.0], [2.5, 0.1], [3.0, -0.1]] {
        let Some(Move::Forward(kappa)) = chosen(&rock(at), [7.0, 0.0]) else { panic!("{at:?}") };
        // The two discs of the body stay outside of the rock for at least `near`.
        for k in 0..=10 {
            for p in arcs.body.middles(end_of([0.0; 3], Move::Forward(kappa), 0.1 * f64::from(k))) {
                assert!((p[0] - at[0]).hypot(p[1] - at[1]) > 0.42, "{at:?} {kappa} {p:?}");
            }
        }
    }
}

#[test]
fn hazards_or_unknown_ground_all_around_leave_no_move() {
    let ring = |r: f64, beyond: Option<u8>| {
        patches(move |[x, y]| if x.hypot(y) < r { Some(BEST) } else { beyond })
    };
    assert_eq!(chosen(&ring(0.9, Some(0)), [6.0, 0.0]), None);
    assert_eq!(chosen(&ring(0.9, None), [6.0, 0.0]), None);
    // There is room to rotate, but not for an arc.
    assert!(matches!(chosen(&ring(0.6, Some(0)), [-6.0, 0.5]), Some(Move::Turn(_))));
    // Unknown ground farther than `near` ends an arc but does not exclude it.
    assert_eq!(chosen(&ring(2.5, None), [6.0, 0.0]), Some(Move::Forward(0.0)));
    assert_eq!(chosen(&patches(|_| None), [6.0, 0.0]), None);
}

#[test]
fn a_rover_leaves_a_hazard_by_the_short_way_only() {
    // The front disc is 0.2 m inside the rim of a hazard that lies ahead.
    let ahead = patches(|[x, _]| Some(if x > 0.2 { 0 } else { BEST }));
    assert!(matches!(chosen(&ahead, [6.0, 0.0]), Some(Move::Backward(_))));
    // The rover cannot leave from deep inside the hazard.
    let deep = patches(|[x, _]| Some(if x > -0.5 { 0 } else { BEST }));
    assert_eq!(chosen(&deep, [6.0, 0.0]), None);
}

#[test]
fn the_last_move_is_kept_until_another_is_better_by_the_hysteresis() {
    let arcs = arcs();
    let vote = |mv, total| Vote { mv, obstacles: 0.5, goal: 0.5, total };
    let votes = [
        vote(Move::Forward(0.0), 0.50),
        vote(Move::Forward(0.1), 0.54),
        vote(Move::Turn(0.7), 0.30),
        vote(Move::Turn(-5.5), 0.58),
        vote(Move::Backward(0.0), 0.0),
    ];
    let after = |last| arcs.choose(&votes, last).unwrap().mv;
    assert_eq!(after(None), Move::Turn(-5.5));
    assert_eq!(after(Some(Move::Forward(0.1))), Move::Forward(0.1));
    assert_eq!(after(Some(Move::Forward(0.0))), Move::Turn(-5.5));
    // A rotation continues in its direction, whatever the remaining angle is.
    assert_eq!(arcs.choose(&votes[..4], Some(Move::Turn(-5.0))).unwrap().mv, Move::Turn(-5.5));
    // A move that is no longer possible is not kept.
    assert_eq!(after(Some(Move::Backward(0.0))), Move::Turn(-5.5));
    assert_eq!(arcs.choose(&votes[4..], Some(Move::Backward(0.0))), None);
    assert_eq!(arcs.choose(&[], None), None);
}

#[test]
fn an_arc_is_no_longer_than_the_goal_is_far() {
    let free = patches(|_| Some(BEST));
    let arcs = arcs();
    let votes = votes(&arcs, &free, [0.5, 0.0]);
    let straight = votes.iter().find(|v| v.mv == Move::Forward(0.0)).unwrap();
    assert!((straight.goal - 1.0).abs() < 1e-12, "{straight:?}");
}
