//! Closed forms of planes, steps and rocks; sums over the points of a disc, one by one; seeing in parts.
use super::*;
use crate::map::Grid;
use crate::tiles::cell_at;
use linkwork_spatial::Vec3;

const GRID: Grid = Grid { cell: 0.1, memory: f64::INFINITY };

fn limits() -> Limits {
    Limits {
        radius: 0.8,
        step_width: 0.4,
        tilt: 25f64.to_radians(),
        roughness: 0.12,
        step: 0.3,
        seen: 0.3,
    }
}

/// Four points in each cell of [x0, x1) × [y0, y1), not in a square.
fn ground(x: [f64; 2], y: [f64; 2], height: impl Fn(f64, f64) -> f64) -> Vec<Vec3> {
    let places = |[from, to]: [f64; 2]| {
        let n = ((to - from) / 0.05).round() as usize;
        (0..n).map(move |k| from + 0.05 * (k as f64 + 0.5))
    };
    places(y)
        .flat_map(|y| places(x).map(move |x| [x + 0.01 * (9.0 * y).sin(), y]))
        .map(|[x, y]| Vec3::new(x, y, height(x, y)))
        .collect()
}

fn judged(points: &[Vec3]) -> (TerrainMap, Tiles<Patch>) {
    let (mut map, mut out) = (TerrainMap::default(), Tiles::default());
    let (touched, lost) = GRID.add(&mut map, points, 0.0);
    assert_eq!(lost, 0);
    Assessor::new(GRID.cell, limits()).unwrap().refresh(&map, &touched, &mut out);
    (map, out)
}

fn at(patches: &Tiles<Patch>, x: f64, y: f64) -> Patch {
    patches.get(cell_at(GRID.cell, [x, y]).unwrap()).copied().unwrap_or_default()
}

#[test]
fn flat_ground_is_best_and_what_was_not_seen_is_unknown() {
    let (_, out) = judged(&ground([-3.0, 3.0], [-3.0, 3.0], |_, _| 1234.5));
    let p = at(&out, 0.3, -0.4);
    assert!(p.known && p.goodness == BEST && p.tilt < 1e-6 && p.roughness < 1e-6, "{p:?}");
    assert_eq!(p.step, 0.0);
    // At the edge of the observed ground half of a disc is known; farther out by a disc's radius
    // nothing is.
    assert!(at(&out, 2.95, 0.0).known && !at(&out, 3.55, 0.0).known);
    assert!(!at(&out, 0.0, -3.95).known && !at(&out, 50.0, 0.0).known);
}

#[test]
fn a_slope_has_its_tilt_no_roughness_and_no_step() {
    for (degrees, turn) in [(5.0_f64, 0.3_f64), (15.0, 2.0), (24.0, -2.5), (35.0, 1.0)] {
        let (s, c) = turn.sin_cos();
        let slope = degrees.to_radians().tan();
        let (_, out) = judged(&ground([-3.0, 3.0], [-3.0, 3.0], |x, y| slope * (c * x + s * y)));
        let p = at(&out, 0.1, 0.2);
        assert!((f64::from(p.tilt) - degrees.to_radians()).abs() < 1e-6, "{p:?}");
        assert!(p.roughness < 1e-5, "{p:?}");
        // The square has five cells. The points in them are up to one cell farther apart than the centres of the outer
        // cells.
        assert!(f64::from(p.step) < slope * 0.15 * (c.abs() + s.abs()), "{p:?}");
        let want = (255.0 * (1.0 - degrees / 25.0)).max(0.0);
        assert!((f64::from(p.goodness) - want).abs() <= 0.51 || p.step > 0.05, "{p:?} {want}");
    }
    let (_, out) = judged(&ground([-3.0, 3.0], [-3.0, 3.0], |x, _| 0.5 * x));
    assert_eq!((at(&out, 0.0, 0.0).goodness, at(&out, 0.0, 0.0).known), (0, true));
}

#[test]
fn roughness_is_the_rms_of_waves_about_their_plane() {
    // The waves have a length of 0.2 m across many periods. Their RMS is amplitude/√2, and on a
    // slope it is reduced by its cosine.
    let (size, slope) = (0.03, 0.2_f64);
    let wave =
        |x: f64, y: f64| slope * y + size * (31.0 * (x - 0.01 * (9.0 * y).sin())).sin() + 0.0 * y;
    let (_, out) = judged(&ground([-3.0, 3.0], [-3.0, 3.0], wave));
    let want = size / 2f64.sqrt() * slope.atan().cos();
    let p = at(&out, 0.0, 0.0);
    assert!((f64::from(p.roughness) / want - 1.0).abs() < 0.02, "{p:?} {want}");
}

#[test]
fn a_rock_is_a_hazard_as_far_as_the_disc_and_the_square_reach() {
    let rock = |x: f64, y: f64| if x.hypot(y) < 0.3 { 0.4 } else { 0.0 };
    let (_, out) = judged(&ground([-4.0, 4.0], [-4.0, 4.0], rock));
    // The hazard extends beyond the rock by the disc and half a square, with an uncertainty of one
    // cell.
    let (reach, doubt) = (0.3 + 0.8 + 0.2, 0.11);
    for k in 0..32 {
        let (s, c) = (0.196 * f64::from(k)).sin_cos();
        let p = |rho: f64| at(&out, rho * c, rho * s);
        assert_eq!(p(0.3 + 0.8 - doubt).goodness, 0, "{k}");
        // Squares reach farther along their diagonals.
        assert!(p(reach * 1.08 + doubt).goodness == BEST, "{k}: {:?}", p(reach * 1.08 + doubt));
    }
    assert!((at(&out, 0.0, 0.0).step - 0.4).abs() < 0.03);
}

#[test]
fn a_wall_is_told_where_too_little_is_seen_to_fit_a_plane() {
    // Only the foot and the face of a wall were observed, in a strip of three cells.
    let (_, out) =
        judged(&ground([0.0, 0.3], [-0.2, 0.2], |x, _| if x > 0.15 { 0.9 } else { 0.0 }));
    let p = at(&out, 0.2, 0.0);
    assert!(p.known && p.goodness == 0 && p.step > 0.3, "{p:?}");
    let (_, out) = judged(&ground([0.0, 0.3], [-0.2, 0.2], |_, _| 0.0));
    assert!(!at(&out, 0.2, 0.0).known);
}

/// Points of a rough slope with rocks, without a pattern.
fn rough() -> Vec<Vec3> {
    let rock = |x: f64, y: f64| if (x - 1.0).hypot(y + 0.7) < 0.4 { 0.25 } else { 0.0 };
    let mut points = ground([-3.7, 4.1], [-2.9, 5.3], |x, y| {
        700.0 + 0.13 * x - 0.21 * y + 0.02 * (17.0 * x + 5.0 * y).sin() + rock(x, y)
    });
    // Leave holes like those behind rocks.
    points.retain(|p| ((7.0 * p.x).sin() * (5.0 * p.y).cos()) > -0.55);
    points
}

#[test]
fn sums_by_rows_are_sums_over_the_points_of_the_disc() {
    let points = rough();
    let (_, out) = judged(&points);
    let limits = limits();
    let mut compared = 0;
    for k in 0..60 {
        let middle = [-3.5 + 0.117 * f64::from(k), -2.5 + 0.124 * f64::from(k)];
        let index = cell_at(0.1, middle).unwrap();
        let patch = out.get(index).copied().unwrap_or_default();
        let inside = |p: &&Vec3| {
            let cell = cell_at(0.1, [p.x, p.y]).unwrap();
            let [i, j] = [cell[0] - index[0], cell[1] - index[1]];
            f64::from(i * i + j * j) <= (limits.radius / 0.1).powi(2) + 1e-9
        };
        let disc: Vec<&Vec3> = points.iter().filter(inside).collect();
        if !patch.known || disc.len() < 50 {
            continue;
        }
        // Compute the least squares in another way, by singular values.
        let n = disc.len();
        let A = linkwork_spatial::nalgebra::DMatrix::from_fn(n, 3, |r, c| match c {
            0 => disc[r].x - middle[0],
            1 => disc[r].y - middle[1],
            _ => 1.0,
        });
        let z = linkwork_spatial::nalgebra::DVector::from_fn(n, |r, _| disc[r].z - 700.0);
        let fit = A.clone().svd(true, true).solve(&z, 1e-14).unwrap();
        let slope = fit[0].hypot(fit[1]);
        let rms = ((A * &fit - z).norm_squared() / n as f64).sqrt() * slope.atan().cos();
        assert!((f64::from(patch.tilt) - slope.atan()).abs() < 1e-6, "{k}: {patch:?} {slope}");
        assert!((f64::from(patch.roughness) - rms).abs() < 1e-6, "{k}: {patch:?} {rms}");
        // Compute the steps cell by cell.
        let mut rise = 0.0_f64;
        for [i, j] in (-8..=8).flat_map(|j| (-8..=8).map(move |i: i32| [i, j])) {
            if i * i + j * j > 64 {
                continue;
            }
            let near = |p: &&Vec3| {
                let c = cell_at(0.1, [p.x, p.y]).unwrap();
                (c[0] - index[0] - i).abs() <= 2 && (c[1] - index[1] - j).abs() <= 2
            };
            let heights = points.iter().filter(near).map(|p| p.z);
            let [low, high] =
                heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], z| [a.min(z), b.max(z)]);
            rise = rise.max(high - low);
        }
        let step = (rise - (fit[0].abs() + fit[1].abs()) * 0.4).max(0.0);
        assert!((f64::from(patch.step) - step).abs() < 1e-6, "{k}: {patch:?} {step}");
        compared += 1;
    }
    assert!(compared > 30, "{compared}");
}

#[test]
fn what_is_judged_now_and_then_is_what_is_judged_at_once() {
    let points = rough();
    let (map, whole) = judged(&points);
    let (mut grown, mut parts) = (TerrainMap::default(), Tiles::default());
    let assessor = Assessor::new(0.1, limits()).unwrap();
    for part in points.chunks(1777) {
        let (touched, _) = GRID.add(&mut grown, part, 0.0);
        assessor.refresh(&grown, &touched, &mut parts);
    }
    assert_eq!(grown, map);
    assert_eq!(parts, whole);
    let bytes = rmp_serde::to_vec_named(&parts).unwrap();
    assert_eq!(rmp_serde::from_slice::<Tiles<Patch>>(&bytes).unwrap(), whole);
}

#[test]
fn limits_that_no_rover_has_are_refused() {
    let refused = |change: &dyn Fn(&mut Limits)| {
        let mut l = limits();
        change(&mut l);
        Assessor::new(0.1, l).unwrap_err().to_string()
    };
    assert!(refused(&|l| l.radius = 0.0).contains("radius of the disc"));
    assert!(refused(&|l| l.tilt = f64::NAN).contains("tilt"));
    assert!(refused(&|l| l.step = -1.0).contains("the step limit (m) is -1"));
    assert!(refused(&|l| l.roughness = f64::INFINITY).contains("roughness"));
    assert!(refused(&|l| l.seen = 1.5).contains("between 0 and 1"));
    assert!(refused(&|l| l.radius = 7.0).contains("make the cells larger"));
    assert!(refused(&|l| l.step_width = 20.0).contains("make the cells larger"));
    assert!(Assessor::new(0.0, limits()).is_err());
}
