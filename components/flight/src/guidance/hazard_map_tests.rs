//! Tests of `flight.hazard_map`: planes and bumps in closed form, site selection, noise, rejected parameters.
use super::*;
use crate::guidance::test_soil::firm;
use std::sync::Arc;

/// Ground whose height is a function of position, within 500 m of the origin.
struct Hills<F>(F, Soil);
impl<F: Fn(f64, f64) -> f64 + Send + Sync> Terrain for Hills<F> {
    fn ground(&self, x: f64, y: f64) -> Option<Ground> {
        let there = x.abs() <= 500.0 && y.abs() <= 500.0;
        there.then(|| Ground { height: (self.0)(x, y), normal: Vec3::z() })
    }
    fn bounds(&self) -> [f64; 4] {
        [-500.0, -500.0, 500.0, 500.0]
    }
    fn soil(&self, _: f64, _: f64) -> &Soil {
        &self.1
    }
    fn surface(&self) -> Surface {
        Surface { origin: [0.0; 2], spacing: [1.0; 2], nx: 0, ny: 0, heights: vec![] }
    }
}

fn params(height: impl Fn(f64, f64) -> f64 + Send + Sync + 'static) -> HazardMapParams {
    let ground = Hills(height, firm());
    HazardMapParams {
        radius: 40.0,
        spacing: 1.0,
        footprint: 4.0,
        slope_max: 0.15,
        roughness_max: 0.3,
        lead: 0.0,
        sigma: 0.0,
        terrain: Handle::new("ground", Arc::new(ground) as Arc<dyn Terrain>),
    }
}

fn lander(x: f64, y: f64) -> NodeState {
    NodeState { position: Vec3::new(x, y, 800.0), ..NodeState::identity() }
}

fn found(p: HazardMapParams, body: NodeState) -> SiteState {
    let m = HazardMap::build(p).map_err(|e| e.message).unwrap();
    m.map(&Clock::at(0.0, 0.1, 0), &body)
}

/// The fit of a plane is exact; the height of a bump of one node above the fit agrees with least squares.
#[test]
fn a_disc_tells_slope_and_roughness_of_closed_forms() {
    let m =
        HazardMap::build(params(|x, y| 3.0 + 0.06 * x - 0.08 * y)).map_err(|e| e.message).unwrap();
    let d = m.disc(&Clock::at(0.0, 0.1, 0), (20.0, -7.0), (3, 5)).unwrap();
    assert!((d.slope - 0.1_f64.atan()).abs() < 1e-12 && d.roughness < 1e-12, "{d:?}");
    assert!((d.height - (3.0 + 0.06 * 23.0 + 0.08 * 2.0)).abs() < 1e-12);
    // 49 nodes are within 4 m of the centre. The central node is 0.5 m higher, which lifts the plane by
    // 0.5/49.
    let m = HazardMap::build(params(|x, y| if x == 0.0 && y == 0.0 { 0.5 } else { 0.0 }));
    let m = m.map_err(|e| e.message).unwrap();
    let d = m.disc(&Clock::at(0.0, 0.1, 0), (0.0, 0.0), (0, 0)).unwrap();
    assert!((d.roughness - 0.5 * 48.0 / 49.0).abs() < 1e-12 && d.slope < 1e-15, "{d:?}");
}

/// On level ground the centre is selected. A boulder there is avoided by the radius of the disc, and by no more.
#[test]
fn it_goes_no_further_than_it_must() {
    let f = found(params(|_, _| -2.0), lander(10.3, -4.8));
    assert!(f.found && f.safe == 1.0);
    assert!((f.place - Vec3::new(10.0, -5.0, -2.0)).norm() < 1e-12, "{}", f.place);
    let boulder = |x: f64, y: f64| if (x - 10.0).hypot(y + 5.0) < 1.5 { 0.8 } else { 0.0 };
    let f = found(params(boulder), lander(10.3, -4.8));
    let off = (f.place.x - 10.0).hypot(f.place.y + 5.0);
    assert!(f.found && f.roughness < 1e-12, "{f:?}");
    // A node of the boulder is up to 1.4 m from its centre, and the disc has a radius of 4 m, so
    // the place is 5.1 to 6 m away.
    assert!((5.0..6.5).contains(&off), "{off}");
    // The map moves with the lander's velocity and `lead`.
    let p = HazardMapParams { lead: 2.0, ..params(boulder) };
    let body = NodeState { velocity: Vec3::new(-6.0, 9.0, -30.0), ..lander(10.3, -4.8) };
    assert_eq!(found(p, body).place.xy(), Vec3::new(-2.0, 13.0, 0.0).xy());
}

/// On a hillside that is too steep except for a shelf, the shelf is selected. Without the shelf no place is safe, and the least steep one is
/// selected.
#[test]
fn it_finds_the_shelf_and_tells_when_there_is_none() {
    let hill = |shelf: f64| {
        move |x: f64, y: f64| {
            // The ground gets steeper to the north. It is level within 9 m of (20, -10).
            let side = (x - 20.0).hypot(y + 10.0);
            if side < shelf { 0.0 } else { (0.3 + 1e-3 * y) * x }
        }
    };
    let f = found(params(hill(9.0)), lander(0.0, 0.0));
    assert!(f.found && f.slope < 0.15 && f.safe < 0.05, "{f:?}");
    assert!((f.place.xy() - Vec3::new(20.0, -10.0, 0.0).xy()).norm() <= 5.5, "{f:?}");
    let f = found(params(hill(0.0)), lander(0.0, 0.0));
    assert!(!f.found && f.aimed && f.safe == 0.0 && f.slope > 0.15, "{f:?}");
    assert!(f.place.y <= -30.0, "it is less steep in the south: {f:?}");
}

/// Without ground no site is selected. Noise increases the roughness; each node has its own noise, which is the same in all discs.
#[test]
fn edges_and_noise() {
    let f = found(params(|_, _| 0.0), lander(498.0, 0.0));
    assert!(f.found && f.place.x == 496.0 && f.safe < 0.6, "{f:?}");
    let f = found(params(|_, _| 0.0), lander(2000.0, 0.0));
    assert!(!f.found && !f.aimed && f.safe == 0.0 && f.place.x == 2000.0);
    let m = HazardMap::build(HazardMapParams { sigma: 0.05, ..params(|_, _| 0.0) });
    let m = m.map_err(|e| e.message).unwrap();
    let c = Clock::at(0.0, 0.1, 0);
    let (mut sum, mut square, mut n) = (0.0, 0.0, 0.0);
    for i in -30..=30 {
        m.nodes(&c, (0.0, 0.0), (i, 0), |x, y, h| {
            if x == 0.0 && y == 0.0 {
                (sum, square, n) = (sum + h, square + h * h, n + 1.0);
            }
        });
    }
    let deviation = (square / n - (sum / n) * (sum / n)).sqrt();
    assert!((0.035..0.065).contains(&deviation), "{deviation}");
    let height = |node: (i32, i32), at: (f64, f64)| {
        let mut found = f64::NAN;
        m.nodes(&c, (0.0, 0.0), node, |x, y, h| {
            if (x, y) == at {
                found = h;
            }
        });
        found
    };
    assert_eq!(height((3, -2), (1.0, 1.0)), height((4, -1), (0.0, 0.0)));
    assert!(height((3, -2), (1.0, 1.0)) != height((3, -2), (1.0, 0.0)));
}

#[test]
fn the_map_is_kept_and_what_makes_no_sense_is_refused() {
    let m = HazardMap::build(params(|x, _| 0.01 * x)).map_err(|e| e.message).unwrap();
    let c = |n: u64| Clock::at(0.1 * n as f64, 0.1, n);
    let d = m.init_d();
    let u = |x: f64| HazardMapIn { body: lander(x, 0.0) };
    let first = m.feedthrough(&c(0), &d, &u(5.0));
    let d = m.update(&c(0), &d, &u(5.0));
    let later = m.feedthrough(&c(1), &d, &u(60.0));
    assert!(first.found && first.place == later.place && first.place.x < 10.0);
    let refused = |p: HazardMapParams| HazardMap::build(p).err().unwrap().param.unwrap();
    let level = || params(|_, _| 0.0);
    assert_eq!(refused(HazardMapParams { spacing: 5.0, ..level() }), "footprint");
    assert_eq!(refused(HazardMapParams { radius: 2e4, ..level() }), "spacing");
}
