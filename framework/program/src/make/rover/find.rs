//! Detection of wheels, steering and suspension of a machine.
//!
//! ```text
//! wheel        a body on one pin without limits and with a level axis, with a cylinder, a sphere or a round mesh about that axis
//! steering     a pin with an upright axis that carries one wheel
//! swivel       an upright pin without limits whose axis does not pass over its wheel: a caster, whose wheel has no drive
//! support      a small shape fixed to the body that reaches down to the ground of the wheels, if these cannot carry the body: a ball caster
//! suspension   any other pin between a wheel and the root
//! differential between a left and a right rocker on the root, if wheels and couplings do not determine the pitch of the body
//! ```
//! The machine is in the pose of its file, with all joints at zero; x is forward, z up. A companion file can define the wheels, their sizes, which of
//! them are idle, and their steering.
use linkwork_formats::{BodyShape, Description, Geometry, ShapeRole, WheelRole};
use linkwork_multibody::{BodySpec, Coupling, SubhingeKind};
use linkwork_spatial::{Pose, Vec3};
use std::collections::BTreeMap;

/// A detected wheel.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundWheel {
    /// Its body.
    pub body: String,
    /// Radius and width (m).
    pub size: [f64; 2],
    /// Its centre in its body (m).
    pub centre: Vec3,
    /// The axle in its body, to the left.
    pub axle: Vec3,
    /// Whether the hinge's axis points to the left.
    pub forwards: bool,
    /// Its centre in the axes of the root (m).
    pub place: Vec3,
    /// Whether a motor drives it.
    pub driven: bool,
    /// The body that steers it, and whether its steering axis points up.
    pub steering: Option<(String, bool)>,
    /// Largest steering angle to both sides, if its hinge has limits, rad.
    pub steer_max: Option<f64>,
    /// The body of the free upright pin of a caster.
    pub swivel: Option<String>,
    /// Friction with which it slides over the ground, if it is a fixed support and not a wheel.
    pub slides: Option<f64>,
    /// Limits of its hinge, if the file has them: largest rate (rad/s).
    pub rate: Option<f64>,
    /// Largest torque (N m).
    pub torque: Option<f64>,
}

/// A detected vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct DetectedVehicle {
    /// The root body.
    pub root: String,
    /// Mass of all bodies (kg).
    pub mass: f64,
    /// The wheels, front to rear, left before right.
    pub wheels: Vec<FoundWheel>,
    /// Suspension bodies, on pins that adapt to the ground.
    pub suspension: Vec<String>,
    /// Rockers to be connected by a differential, with the factors of their angles, if the file does not determine the pitch of the body between
    /// them.
    pub differential: Option<[(String, f64); 2]>,
    /// Bodies on other moving hinges: arms, masts.
    pub others: Vec<String>,
}

/// Largest sine of the angle between a wheel's axis and the horizontal plane. It is also used for the smallest angle of a steering axis.
const LEVEL: f64 = 0.35;
const UPRIGHT: f64 = 0.9;
/// Distance of the centre of a wheel ahead of or behind the axis of its swivel, as a fraction of the radius.
const TRAIL: f64 = 0.1;
/// Distance of the centre of mass from the polygon of the supports, as a fraction of the radius, that is round-off.
const ROUND_OFF: f64 = 1e-6;
/// A fixed support reaches down to the ground of the wheels up to this fraction of their radius, and is smaller than they are.
const REACH: f64 = 0.25;
/// Friction of a fixed support whose file does not state it: a ball caster on its bearing.
const BALL: f64 = 0.1;
/// A mesh is round if its extents across the axis differ by at most this fraction.
const ROUND: f64 = 0.12;

/// Returns the poses of the bodies with all joints at zero, in the axes of the root.
fn poses(d: &Description, root: &str) -> BTreeMap<String, Pose> {
    let mut out = BTreeMap::from([(root.to_string(), Pose::identity())]);
    let bodies = d.builder.bodies();
    // Repeat, because files may list children before their parents.
    for _ in 0..bodies.len() {
        let before = out.len();
        for b in bodies {
            let Some(parent) = out.get(&b.parent) else { continue };
            if !out.contains_key(&b.name) {
                let pose = *parent * b.hinge_in_parent * b.hinge_in_body.inverse();
                out.insert(b.name.clone(), pose);
            }
        }
        if out.len() == before {
            break;
        }
    }
    out
}

/// Returns the axis of a body on one pin, in body axes.
pub fn pin(b: &BodySpec) -> Option<Vec3> {
    match &b.hinge.subhinges[..] {
        [s] => match s.kind {
            SubhingeKind::Pin { axis } => Some(b.hinge_in_body.rotation * axis.normalize()),
            _ => None,
        },
        _ => None,
    }
}

fn unlimited(b: &BodySpec) -> bool {
    b.hinge.subhinges.iter().all(|s| s.limits.lower < -6.0 && s.limits.upper > 6.0)
}

/// Whether a pin turns by half a revolution to both sides, like the swivel of a caster.
fn swings(b: &BodySpec) -> bool {
    b.hinge.subhinges.iter().all(|s| s.limits.lower < -3.1 && s.limits.upper > 3.1)
}

/// Returns radius, width and centre of the rotating shape about an axis of a body: of a cylinder, a sphere, or a readable mesh.
fn measured(
    d: &Description,
    body: &str,
    axis: &Vec3,
    corners: &dyn Fn(&std::path::Path) -> Option<Vec<Vec3>>,
) -> Option<([f64; 2], Vec3)> {
    let mut found: Vec<([f64; 2], Vec3)> = Vec::new();
    for role in [ShapeRole::Contact, ShapeRole::Collision, ShapeRole::Visual] {
        for s in d.shapes.iter().filter(|s| s.body == body && s.role == role) {
            match &s.geometry {
                Geometry::Cylinder { radius, length }
                    if (s.pose.rotation * Vec3::z()).dot(axis).abs() > 0.99 =>
                {
                    found.push(([*radius, *length], s.pose.position));
                }
                // A ball touches the ground in a point, so use a narrow wheel instead.
                Geometry::Sphere { radius } => {
                    found.push(([*radius, 0.5 * radius], s.pose.position));
                }
                Geometry::Mesh { path: Some(path), scale, .. } => {
                    let scale = Vec3::from(*scale);
                    let points = corners(path).unwrap_or_default();
                    let points =
                        points.iter().map(|p| s.pose.transform_point(&p.component_mul(&scale)));
                    found.extend(round(points, axis));
                }
                _ => {}
            }
        }
        // The tyre is the largest shape. Collision shapes have priority over visual shapes.
        if let Some(largest) = found.iter().max_by(|a, b| a.0[0].total_cmp(&b.0[0])) {
            return Some(*largest);
        }
    }
    None
}

/// Returns radius, width and centre of points about an axis, if they are round.
fn round(points: impl Iterator<Item = Vec3> + Clone, axis: &Vec3) -> Option<([f64; 2], Vec3)> {
    let aside = if axis.x.abs() < 0.7 { Vec3::x() } else { Vec3::y() };
    let e1 = axis.cross(&aside).normalize();
    let e2 = axis.cross(&e1);
    let span = |e: &Vec3| {
        points
            .clone()
            .map(|p| p.dot(e))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
    };
    let [along, one, two] = [span(axis), span(&e1), span(&e2)];
    let size = |s: [f64; 2]| s[1] - s[0];
    let (a, b) = (size(one), size(two));
    let mean = |s: [f64; 2]| 0.5 * (s[0] + s[1]);
    let centre = axis * mean(along) + e1 * mean(one) + e2 * mean(two);
    let good = a.is_finite() && a > 0.0 && (a - b).abs() < ROUND * a.max(b);
    good.then(|| ([0.25 * (a + b), size(along)], centre))
}

/// Returns the corners of the box around a shape in the axes of the root, or `None` for shapes without a size.
fn extent(
    shape: &BodyShape,
    body: &Pose,
    corners: &dyn Fn(&std::path::Path) -> Option<Vec<Vec3>>,
) -> Option<[Vec3; 2]> {
    let pose = *body * shape.pose;
    let around = |half: Vec3| {
        let m = pose.rotation.to_rotation_matrix().into_inner().abs();
        let half = m * half;
        [pose.position - half, pose.position + half]
    };
    Some(match &shape.geometry {
        Geometry::Box { size } => around(Vec3::from(*size) * 0.5),
        Geometry::Sphere { radius } => {
            let half = Vec3::repeat(*radius);
            [pose.position - half, pose.position + half]
        }
        Geometry::Cylinder { radius, length } => around(Vec3::new(*radius, *radius, 0.5 * length)),
        Geometry::Capsule { radius, length } => {
            around(Vec3::new(*radius, *radius, 0.5 * length + radius))
        }
        Geometry::Ellipsoid { radii } => around(Vec3::from(*radii)),
        Geometry::Mesh { path: Some(path), scale, .. } => {
            let scale = Vec3::from(*scale);
            let points = corners(path)?;
            let mut all = points.iter().map(|p| pose.transform_point(&p.component_mul(&scale)));
            let first = all.next()?;
            let (low, high) =
                all.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
            [low, high]
        }
        Geometry::Plane { .. } | Geometry::Mesh { .. } | Geometry::HeightField { .. } => {
            return None;
        }
    })
}

/// Returns the fixed supports of a body whose wheels alone cannot carry it: one for each body, the shape that is nearest to the ground. `ground` is the
/// height of the ground under the wheels, `radius` their radius.
fn supports(
    d: &Description,
    root: &str,
    poses: &BTreeMap<String, Pose>,
    corners: &dyn Fn(&std::path::Path) -> Option<Vec<Vec3>>,
    (ground, radius): (f64, f64),
) -> Vec<FoundWheel> {
    let bodies = d.builder.bodies();
    let fixed = |name: &str| {
        let chain = std::iter::successors(bodies.iter().find(|b| b.name == name), |b| {
            bodies.iter().find(|p| p.name == b.parent)
        });
        chain.take_while(|b| b.name != root).all(|b| b.hinge.subhinges.is_empty())
    };
    let mut found: BTreeMap<[i64; 2], (f64, FoundWheel)> = BTreeMap::new();
    for role in [ShapeRole::Contact, ShapeRole::Collision, ShapeRole::Visual] {
        for s in d.shapes.iter().filter(|s| s.role == role && fixed(&s.body)) {
            let Some(pose) = poses.get(&s.body) else { continue };
            let Some([low, high]) = extent(s, pose, corners) else { continue };
            let (size, off) = (high - low, (low.z - ground).abs());
            if off > REACH * radius || size.max() > 2.0 * radius || !(size.z > 0.0) {
                continue;
            }
            let place = (low + high) * 0.5;
            let r = 0.5 * size.z;
            let support = FoundWheel {
                body: s.body.clone(),
                size: [r, (0.5 * size.y).min(r)],
                centre: pose.inverse().transform_point(&place),
                axle: pose.rotation.inverse() * Vec3::y(),
                forwards: true,
                place,
                driven: false,
                steering: None,
                steer_max: None,
                swivel: None,
                slides: Some(s.surface.friction.unwrap_or(BALL)),
                rate: None,
                torque: None,
            };
            // Shapes of one support, such as its visual and its collision shape, are at the same place.
            let cell = [place.x, place.y].map(|x| (x / radius).round() as i64);
            let nearer = found.get(&cell).is_none_or(|(other, _)| off < *other);
            if nearer {
                found.insert(cell, (off, support));
            }
        }
        if !found.is_empty() {
            break;
        }
    }
    found.into_values().map(|(_, support)| support).collect()
}

/// Returns by how much a point is outside of the convex hull of others (m); not positive inside.
fn outside(hull: &[[f64; 2]], p: [f64; 2]) -> f64 {
    let mut most = f64::NEG_INFINITY;
    for a in hull {
        for b in hull {
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let length = dx.hypot(dy);
            let right = |q: &[f64; 2]| ((q[0] - a[0]) * dy - (q[1] - a[1]) * dx) / length;
            // The line from a to b is an edge if no point is on its right.
            if length > 1e-9 && hull.iter().all(|q| right(q) < 1e-9) {
                most = most.max(right(&p));
            }
        }
    }
    most
}

/// Checks that the wheels with a drive roll along x of the root.
///
/// # Errors
/// Fact and remedy: a wheel rolls in another direction.
fn rolls_forward(
    wheels: &[FoundWheel],
    root: &str,
    poses: &BTreeMap<String, Pose>,
) -> Result<(), (String, String)> {
    // The direction of the axle on level ground; camber does not count.
    let axle = |w: &FoundWheel| {
        let axle = poses[&w.body].rotation * w.axle;
        let across = axle.x.hypot(axle.y);
        [axle.x / across, axle.y / across]
    };
    let driven = || wheels.iter().filter(|w| w.driven);
    let Some(odd) = driven().find(|w| axle(w)[1].abs() < UPRIGHT) else { return Ok(()) };
    let [x, y] = axle(odd);
    let angle = (-x).atan2(y).to_degrees();
    let fact = format!(
        "its wheel `{}` rolls at {angle:.0} deg to x of `{root}`, but a rover drives along x, with y to its left and z up",
        odd.body
    );
    let help = match driven().all(|w| axle(w)[0].abs() >= UPRIGHT) {
        true => format!(
            "add a root link whose x is the forward direction: <link name=\"base\"/> <joint name=\"base_joint\" type=\"fixed\"><parent link=\"base\"/>\
             <child link=\"{root}\"/><origin rpy=\"0 0 -1.5707963\"/></joint> if y of `{root}` is forward, with 1.5707963 if -y is forward"
        ),
        false => "wheels that roll in different directions, such as omnidirectional wheels, are not supported; \
                  for a free wheel write `role: Idle` in a companion file"
            .to_string(),
    };
    Err((fact, help))
}

/// Detects a vehicle in a description.
///
/// # Errors
/// Fact and remedy: no wheels, wheels that do not carry the machine, several roots.
pub fn vehicle(
    d: &Description,
    corners: &dyn Fn(&std::path::Path) -> Option<Vec<Vec3>>,
) -> Result<DetectedVehicle, (String, String)> {
    let bodies = d.builder.bodies();
    let roots: Vec<&BodySpec> = bodies.iter().filter(|b| b.parent == "world").collect();
    let [root] = roots[..] else {
        let names: Vec<&str> = roots.iter().map(|b| b.name.as_str()).collect();
        let fact = format!("the machine has {} roots: {}", roots.len(), names.join(", "));
        return Err((fact, "give it one root link".into()));
    };
    let poses = poses(d, &root.name);
    let body = |name: &str| bodies.iter().find(|b| b.name == name);
    let mut wheels = Vec::new();
    for b in bodies.iter().filter(|b| b.name != root.name) {
        let (Some(axis), Some(pose)) = (pin(b), poses.get(&b.name)) else { continue };
        let named = d.wheels.iter().find(|w| w.body == b.name);
        let up = (pose.rotation * axis).z.abs();
        let (size, centre) = match named {
            Some(w) => ([w.radius, w.width], Vec3::zeros()),
            None if !d.wheels.is_empty() || !unlimited(b) || up > LEVEL => continue,
            None => match measured(d, &b.name, &axis, corners) {
                Some(found) => found,
                None => continue,
            },
        };
        let forwards = (pose.rotation * axis).y >= 0.0;
        // Take the joint from the companion file, or the nearest upright pin above the wheel that carries no other
        // wheel.
        let by_name = named.and_then(|w| w.steering.as_deref()).and_then(|j| d.joint(j));
        let steering = match by_name {
            Some(j) => Some(j.body.clone()),
            None => std::iter::successors(body(&b.parent), |p| body(&p.parent))
                .find(|p| pin(p).is_some_and(|a| (poses[&p.name].rotation * a).z.abs() > UPRIGHT))
                .map(|p| p.name.clone()),
        };
        let steering = steering.filter(|s| *s != root.name).map(|s| {
            let axis = body(&s).and_then(pin).unwrap_or_else(Vec3::z);
            let up = (poses[&s].rotation * axis).z > 0.0;
            (s, up)
        });
        let limits = b.hinge.subhinges[0].limits;
        let known = |x: f64| (x.is_finite() && x > 0.0 && x < 1e4).then_some(x);
        wheels.push(FoundWheel {
            body: b.name.clone(),
            size,
            centre,
            axle: if forwards { axis } else { -axis },
            forwards,
            place: pose.transform_point(&centre),
            driven: named.is_none_or(|w| w.role == WheelRole::Driven),
            steering,
            steer_max: None,
            swivel: None,
            slides: None,
            rate: known(limits.rate),
            torque: known(limits.effort),
        });
    }
    // A pin that carries several wheels is not the steering of a single one.
    let shared: Vec<String> =
        wheels.iter().filter_map(|w| Some(w.steering.as_ref()?.0.clone())).collect();
    for w in &mut wheels {
        w.steering.take_if(|(s, _)| shared.iter().filter(|o| *o == s).count() > 1);
    }
    // A wheel that trails behind its upright pin is a caster and rotates freely. The companion file has priority.
    for w in &mut wheels {
        let by_file = d.wheels.iter().find(|f| f.body == w.body);
        if by_file.is_some_and(|f| f.role == WheelRole::Driven || f.steering.is_some()) {
            continue;
        }
        let Some((name, _)) = &w.steering else { continue };
        let Some(pin_of) = body(name).filter(|b| swings(b)) else { continue };
        let pose = poses[name];
        let axis = pose.rotation * pin(pin_of).unwrap_or_else(Vec3::z);
        let arm = w.place - pose.transform_point(&pin_of.hinge_in_body.position);
        // A wheel at the side of its pin is steered by the pin. Only a wheel that is ahead of or behind it rotates
        // the pin.
        let rolling = axis.cross(&(poses[&w.body].rotation * w.axle));
        if arm.dot(&rolling).abs() > TRAIL * w.size[0] {
            w.swivel = w.steering.take().map(|(name, _)| name);
            w.driven = false;
        }
    }
    for w in &mut wheels {
        let yoke = w.steering.as_ref().and_then(|(name, _)| body(name));
        let limits = yoke.and_then(|b| b.hinge.subhinges.first()).map(|s| s.limits);
        let most = limits.map(|l| l.upper.min(-l.lower));
        if let (Some(a), Some((name, _))) = (most, &w.steering)
            && !(a > 0.0)
        {
            let fact = format!("the steering joint of `{name}` turns to one side only");
            return Err((fact, "write limits on both sides of zero".into()));
        }
        w.steer_max = most.filter(|a| *a > 0.0 && *a < std::f64::consts::FRAC_PI_2);
    }
    if wheels.iter().filter(|w| w.driven).count() < 2 {
        let fact = format!(
            "{} with a drive; a wheel is a body on a single joint with a horizontal axis and without limits, and has a cylinder, a sphere or a round mesh about that axis",
            match wheels.len() {
                0 => "there is no wheel",
                _ => "there are not two wheels",
            }
        );
        let help = "define the wheels in a companion file: Companion(wheels: { \"link\": (radius: \"10 cm\", width: \"5 cm\") })";
        return Err((fact, help.into()));
    }
    rolls_forward(&wheels, &root.name, &poses)?;
    let radius = wheels.iter().map(|w| w.size[0]).fold(0.0, f64::max);
    let mass: f64 = bodies.iter().map(|b| b.mass.mass).sum();
    if !(mass > 0.0) {
        let fact = "none of its links has a mass".to_string();
        return Err((fact, "write `inertial` into its links".into()));
    }
    let moment =
        |b: &BodySpec| Some(poses.get(&b.name)?.transform_point(&b.mass.com) * b.mass.mass);
    let com = bodies.iter().filter_map(moment).sum::<Vec3>() / mass;
    let beyond = |wheels: &[FoundWheel]| {
        let contacts: Vec<[f64; 2]> = wheels.iter().map(|w| [w.place.x, w.place.y]).collect();
        outside(&contacts, [com.x, com.y])
    };
    if (wheels.len() < 3 && d.loops.is_empty()) || beyond(&wheels) > ROUND_OFF * radius {
        let bottom = |w: &FoundWheel| w.place.z - w.size[0];
        let ground = wheels.iter().map(bottom).fold(f64::INFINITY, f64::min);
        wheels.extend(supports(d, &root.name, &poses, corners, (ground, radius)));
    }
    let rows = |w: &FoundWheel| (-(w.place.x / radius).round() as i64, w.place.y < 0.0);
    wheels.sort_by_key(rows);
    let mut suspension = Vec::new();
    let mut others = Vec::new();
    let steers =
        |name: &str| wheels.iter().any(|w| w.steering.as_ref().is_some_and(|s| s.0 == name));
    let carries = |name: &str| {
        wheels.iter().any(|w| {
            std::iter::successors(body(&w.body), |p| body(&p.parent))
                .skip(1)
                .any(|p| p.name == name)
        })
    };
    let swivels = |name: &str| wheels.iter().any(|w| w.swivel.as_deref() == Some(name));
    for b in bodies.iter().filter(|b| b.name != root.name && !b.hinge.subhinges.is_empty()) {
        if wheels.iter().any(|w| w.body == b.name) || steers(&b.name) || swivels(&b.name) {
            continue;
        }
        match pin(b).is_some() && carries(&b.name) {
            true => suspension.push(b.name.clone()),
            false => others.push(b.name.clone()),
        }
    }
    // Wheels and couplings must determine height, roll, pitch and the suspension.
    let coupled = |c: &&Coupling| c.terms.iter().any(|t| suspension.contains(&t.coordinate.body));
    let couplings = d.couplings.iter().filter(coupled).count() + d.loops.len();
    let known = wheels.len() + couplings;
    let rockers = || {
        let on_root = |b: &&String| body(b).is_some_and(|b| b.parent == root.name);
        let all: Vec<&String> = suspension.iter().filter(on_root).collect();
        let [a, b] = all[..] else { return None };
        let factor = |b: &String| {
            let axis = poses[b].rotation * body(b).and_then(pin)?;
            (axis.y.abs() > UPRIGHT).then(|| (b.clone(), axis.y.signum()))
        };
        let apart = poses[a].position.y * poses[b].position.y < 0.0;
        Some([factor(a)?, factor(b)?]).filter(|_| apart)
    };
    let differential = match (3 + suspension.len()).saturating_sub(known) {
        1 => rockers(),
        _ => None,
    };
    if 3 + suspension.len() > known + usize::from(differential.is_some()) {
        let (n, joints) = (wheels.len(), suspension.join(", "));
        if suspension.is_empty() {
            let fact = format!(
                "it would tip over: it has {n} wheels and no fixed shape that reaches the ground, such as the ball of a caster, but it needs three supports"
            );
            let help = format!(
                "give its other support a collision shape whose lower end is within {:.3} m of the ground and which is smaller than {:.3} m, on a fixed joint; \
                 or define a caster that turns on a joint as a wheel without a drive in a companion file: \
                 Companion(wheels: {{ \"caster\": (radius: \"3 cm\", width: \"2 cm\", role: Idle) }})",
                REACH * radius,
                2.0 * radius
            );
            return Err((fact, help));
        }
        let fact = format!(
            "{n} wheels and {couplings} couplings do not determine its pose on the ground with {} joints between wheels and body ({joints})",
            suspension.len(),
        );
        let help = "couple the joints in a companion file: Companion(couplings: { \"differential\": (terms: { \"left_joint\": 1, \"right_joint\": 1 }, constant: 0) }); or fix them in the file";
        return Err((fact, help.into()));
    }
    let beyond = beyond(&wheels);
    if beyond > ROUND_OFF * radius {
        let fact = format!(
            "it would tip over: its centre of mass [{:.4}, {:.4}] m (x, y) is {beyond:.4} m outside of the polygon of its wheels and supports",
            com.x, com.y
        );
        let help = "correct the positions in `inertial`, or add the missing support: a caster, or a small collision shape that reaches the ground";
        return Err((fact, help.into()));
    }
    Ok(DetectedVehicle { root: root.name.clone(), mass, wheels, suspension, differential, others })
}
