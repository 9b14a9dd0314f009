//! The contact search against planes, closed forms, dense sampling, and itself a hair further on.

use super::*;

const WHEEL: Wheel = Wheel { radius: 0.25, width: 0.4 };

fn unit(x: f64, y: f64, z: f64) -> Vec3 {
    Vec3::new(x, y, z).normalize()
}

/// A ground from a height and its gradient.
fn ground_of(f: impl Fn(f64, f64) -> [f64; 3]) -> impl Fn(f64, f64) -> Option<(f64, Vec3)> {
    move |x, y| {
        let [h, hx, hy] = f(x, y);
        Some((h, unit(-hx, -hy, 1.0)))
    }
}

/// A ridge, step or wall along a line at the angle `turn` (rad): a function of the distance from it, with its derivative.
fn turned(turn: f64, f: impl Fn(f64) -> [f64; 2]) -> impl Fn(f64, f64) -> [f64; 3] {
    let (sin, cos) = turn.sin_cos();
    move |x, y| {
        let [h, dh] = f(cos * x + sin * y);
        [h, dh * cos, dh * sin]
    }
}

/// A smooth rise of the height `h` over the length `w`.
fn step(h: f64, w: f64) -> impl Fn(f64) -> [f64; 2] {
    move |u| {
        let t = (u / w).clamp(0.0, 1.0);
        [h * t * t * (3.0 - 2.0 * t), h * 6.0 * t * (1.0 - t) / w]
    }
}

/// A smooth ridge of the height `h` on a base of the length `w`.
fn ridge(h: f64, w: f64) -> impl Fn(f64) -> [f64; 2] {
    move |u| {
        let t = (2.0 * u / w).clamp(-1.0, 1.0);
        let q = 1.0 - t * t;
        [h * q * q, -8.0 * h * q * t / w]
    }
}

/// Relief from waves of all directions down to a length of 0.25 m.
fn relief(seed: u64) -> impl Fn(f64, f64) -> [f64; 3] {
    let mut state = seed;
    let mut random = move || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let waves: Vec<[f64; 4]> = (0..24)
        .map(|i| {
            let length = 0.25 * 1.15f64.powi(i);
            let (k, turn) = (std::f64::consts::TAU / length, std::f64::consts::TAU * random());
            [k * turn.cos(), k * turn.sin(), std::f64::consts::TAU * random(), 0.012 * length]
        })
        .collect();
    move |x, y| {
        waves.iter().fold([0.0; 3], |a, [kx, ky, phase, size]| {
            let (sin, cos) = (kx * x + ky * y + phase).sin_cos();
            [a[0] + size * sin, a[1] + size * kx * cos, a[2] + size * ky * cos]
        })
    }
}

/// Depth of a disc by dense sampling: the radius less the least distance to the ground in the disc's plane. Upright discs.
fn dense(c: Vec3, e1: Vec3, ground: &impl Fn(f64, f64) -> Option<(f64, Vec3)>) -> f64 {
    let mut least = f64::INFINITY;
    for k in -5000..=5000 {
        let s = 0.25 * f64::from(k) / 5000.0;
        let q = c + e1 * s;
        let z = ground(q.x, q.y).unwrap().0 - c.z;
        least = least.min(s * s + z * z);
    }
    0.25 - least.sqrt()
}

#[test]
fn plane_is_exact_at_any_attitude() {
    let n = unit(0.2, -0.1, 1.0);
    let plane = |x: f64, y: f64| Some((-(n.x * x + n.y * y) / n.z, n));
    for yaw in [0.0, 0.7, 2.0] {
        for roll in [0.0, 0.1, -0.3] {
            let axle = unit(-f64::sin(yaw), f64::cos(yaw), roll);
            let down = -(n - axle * n.dot(&axle)).normalize();
            let centre = Vec3::new(0.3, 0.1, 0.05);
            for (i, disc) in WHEEL.discs(centre, axle, &plane).iter().enumerate() {
                let point = centre + axle * ((i as f64 - 1.0) * 0.4 / 3.0) + down * 0.25;
                let depth = -n.dot(&point);
                let [p] = disc.patches() else {
                    panic!("one patch: {:?}, depth {depth}", disc.patches());
                };
                assert!((p.depth - depth).abs() < 1e-12 && p.share == 1.0, "{p:?} {depth}");
                assert!((p.normal - n).norm() < 1e-12, "{p:?}");
                assert!((p.point - point).norm() < 1e-9, "{p:?} {point}");
            }
        }
    }
}

#[test]
fn ball_and_bowl_have_the_closed_form() {
    // The wheel in the plane y = 0 is on the top or at the side of a cylinder across its path.
    for (radius, sign) in [(0.3, 1.0), (0.15, 1.0), (2.0, -1.0), (0.6, -1.0)] {
        let ground = |x: f64, _: f64| {
            let rest = radius * radius - x * x;
            if rest <= 0.0 {
                return Some((0.0, Vec3::z()));
            }
            let z = sign * rest.sqrt();
            Some((z, Vec3::new(x, 0.0, z) / radius * sign))
        };
        for angle in [-0.5, -0.2, 0.0, 0.3_f64] {
            let reach = if sign > 0.0 { radius + 0.249 } else { -(radius - 0.249) };
            let centre = Vec3::new(reach * angle.sin(), 0.0, reach * angle.cos());
            let d = WHEEL.discs(centre, Vec3::y(), &ground)[1].depth();
            assert!((d - 0.001).abs() < 1e-4, "R {radius} {sign} at {angle}: {d}");
        }
    }
}

/// A ground by height and gradient.
type Shape = Box<dyn Fn(f64, f64) -> [f64; 3]>;

/// Every kind of obstacle from several sides: with slopes up to 3, or faces with slopes of 7 to 12.
fn obstacles(steep: bool) -> Vec<(String, Shape)> {
    let mut all: Vec<(String, Shape)> = Vec::new();
    for turn in [0.0, 0.13, -1.4, 2.6] {
        let heights = if steep { [0.25, 0.4, -0.3] } else { [0.03, 0.1, -0.1] };
        for height in heights {
            all.push((
                format!("step {height} m, {turn}"),
                Box::new(turned(turn, step(height, 0.05))),
            ));
        }
        for height in if steep { vec![] } else { vec![0.02, 0.06, 0.1] } {
            all.push((
                format!("ridge {height} m, {turn}"),
                Box::new(turned(turn, ridge(height, 0.15))),
            ));
        }
    }
    for seed in if steep { 0..0 } else { 1..7 } {
        all.push((format!("relief {seed}"), Box::new(relief(seed))));
    }
    all
}

/// Leads the wheel along x at a depth of about `target`, up and down as the ground asks; `f` sees every pose.
fn lead(
    ground: &impl Fn(f64, f64) -> Option<(f64, Vec3)>,
    axle: Vec3,
    target: f64,
    hair: f64,
    mut f: impl FnMut(Vec3, &[DiscContact; DISCS]),
) {
    let mut c = Vec3::new(-0.45, 0.02, 0.0);
    for i in -10..=10 {
        for k in -10..=10 {
            let h = ground(c.x + 0.025 * f64::from(i), c.y + 0.02 * f64::from(k)).unwrap().0;
            c.z = c.z.max(h + 0.25);
        }
    }
    while c.x < 0.45 {
        let now = WHEEL.discs(c, axle, ground);
        f(c, &now);
        let depth = now.iter().fold(0.0_f64, |a, d| a.max(d.depth()));
        let rise = (0.02 * (depth - target)).clamp(-hair, hair);
        // If the wheel is deep in a wall, it rises without moving forward.
        c += Vec3::new(if depth > 1.5 * target { 0.0 } else { hair }, 0.0, rise);
    }
}

#[test]
fn depth_and_press_are_continuous_over_steps_walls_ledges_ridges_and_relief() {
    let axle = unit(0.02, 1.0, 0.03);
    let mut all = Vec::new();
    // The targets are depths: 3 mm is deep on rigid ground, and 30 mm on soil.
    for (steep, target, most) in
        [(false, 0.003, [4.0, 8.0]), (false, 0.03, [30.0, 80.0]), (true, 0.003, [12.0, 14.0])]
    {
        let mut worst = [(0.0_f64, String::new()), (0.0_f64, String::new())];
        for (name, shape) in obstacles(steep) {
            let ground = ground_of(shape);
            let mut last: Option<(Vec3, [DiscContact; DISCS])> = None;
            lead(&ground, axle, target, 1e-4, |c, now| {
                if let Some((was, old)) = last {
                    let moved = (c - was).norm();
                    for (a, b) in now.iter().zip(&old) {
                        let depth = (a.depth() - b.depth()).abs() / moved;
                        let press = (a.press() - b.press()).norm() / moved;
                        for (w, x) in worst.iter_mut().zip([depth, press]) {
                            if x > w.0 {
                                *w = (x, format!("{name} at {c:?}: {a:?}\n{b:?}"));
                            }
                        }
                    }
                }
                last = Some((c, *now));
            });
        }
        println!("steep {steep}, {target} m deep: change of depth and press over motion {worst:?}");
        all.push(worst.map(|w| w.0).into_iter().zip(most));
    }
    for (found, most) in all.into_iter().flatten() {
        assert!(found < most, "{found} instead of {most}");
    }
}

#[test]
fn no_ground_is_missed() {
    // `.ci/verify damage` tests every 40th position; otherwise every 160th is tested.
    let every = if std::env::var_os("LINKWORK_VERIFY").is_some() { 40 } else { 160 };
    for (steep, most) in [(false, 4.5e-3), (true, 12e-3)] {
        let mut worst = (0.0_f64, String::new());
        for (name, shape) in obstacles(steep) {
            let ground = ground_of(shape);
            let mut k = 0;
            lead(&ground, Vec3::y(), 0.01, 2e-4, |centre, discs| {
                k += 1;
                if k % every != 0 {
                    return;
                }
                for (k, disc) in discs.iter().enumerate() {
                    let c = centre + Vec3::y() * ((k as f64 - 1.0) * 0.4 / 3.0);
                    let want = dense(c, Vec3::x(), &ground).max(0.0);
                    // Compare depths in the plane of the disc; the depth of a patch is along the
                    // normal in space.
                    let found = disc.patches().iter().fold(0.0_f64, |a, p| {
                        a.max(p.depth / (1.0 - p.normal.y * p.normal.y).sqrt())
                    });
                    if (found - want).abs() > worst.0 {
                        worst = (
                            (found - want).abs(),
                            format!("{name} at {centre:?} disc {k}: {found} instead of {want}"),
                        );
                    }
                }
            });
        }
        println!("steep {steep}: worst {} m: {}", worst.0, worst.1);
        assert!(worst.0 < most, "{worst:?}");
    }
}

#[test]
fn floor_and_wall_count_in_full_each() {
    let ground = ground_of(turned(0.0, step(0.5, 0.05)));
    // The wheel is 2 mm deep in the floor. At hub height it is 12 mm deep in the face, half way up
    // the rise.
    let reach = 0.238;
    let centre = Vec3::new(0.025 - reach, 0.0, 0.248);
    for disc in WHEEL.discs(centre, Vec3::y(), &ground) {
        let [floor, wall] = disc.patches() else { panic!("two patches: {:?}", disc.patches()) };
        assert!((floor.depth - 0.002).abs() < 1e-6 && floor.share > 0.99, "{floor:?}");
        assert!((wall.depth - 0.012).abs() < 2e-3 && wall.share > 0.99, "{wall:?}");
        assert!(floor.normal.z > 0.999 && wall.normal.x < -0.98, "{disc:?}");
    }
}

#[test]
fn a_wall_is_pushed_out_of_and_never_climbed_by_its_height() {
    // The depth in a wall of any height is the distance that the wheel was driven into it.
    for height in [0.4, 2.0, 20.0] {
        let ground = ground_of(turned(0.0, step(height, 0.05)));
        for into in [0.0, 0.01, 0.05, 0.1] {
            let centre = Vec3::new(into - 0.25, 0.0, 0.25);
            let depth = WHEEL.discs(centre, Vec3::y(), &ground)[1].depth();
            assert!(depth <= into + 1e-3 && depth > into - 0.055, "{height} m, {into} m: {depth}");
        }
    }
}

#[test]
fn a_buried_hub_is_lifted() {
    let ground = ground_of(|x, _| [0.1 * x, 0.1, 0.0]);
    let disc = WHEEL.discs(Vec3::new(0.0, 0.0, -0.05), Vec3::y(), &ground)[1];
    // The depth is at most the radius, however high the ground is.
    assert!((disc.depth() - 0.25).abs() < 1e-12 && disc.press().z > 0.0, "{disc:?}");
}

#[test]
fn off_the_map_there_is_no_contact() {
    let discs = WHEEL.discs(Vec3::zeros(), Vec3::y(), &|_, _| None);
    assert!(discs.iter().all(|d| d.patches().is_empty()));
    // Half of the wheel is outside of the map. The half above ground stands on it.
    let edge = |x: f64, _: f64| (x <= 0.0).then_some((0.0, Vec3::z()));
    let disc = WHEEL.discs(Vec3::new(-0.01, 0.0, 0.249), Vec3::y(), &edge)[1];
    assert!((disc.depth() - 0.001).abs() < 1e-9, "{disc:?}");
}
