//! `linkwork new rover --from my.urdf FOLDER`: creates a rover that drives from the description of a machine.
//!
//! Sizes come from the file; missing data are chosen from them:
//! ```text
//! largest wheel load     N_w: twice an equal share; half of the weight without a suspension, because two wheels may carry all of it
//! stall torque           μ N_w r, μ = 0.9: a wheel that carries N_w can spin                or the effort limit of the file
//! no-load rate           4 √r m/s at the rim                                               or the rate limit of the file
//! contact                k = N/(0.005 r): penetration of 0.5 % of the radius; half of that stiffness sideways, with damping ratio ζ = 0.14
//! rotor                  1/50 of the machine's mass at the rim, shared by the wheels; the time constant of the motor is at least 20 ms
//! gain of the rate loop  half of the gain at which a wheel in the air reaches its rate within one sample, at most 2:
//!                        min(2, a/(2 (1 − a))), a = e^(−h/T), T = J ω₀/τ₀ for the rotor J, sample h = 10 ms; unstable at (1 + a)/(1 − a)
//! steering               within 95 % of the limits of the file; a rover that cannot turn on the spot within them drives circles instead
//! brake                  holds the wheel like a spring on which the rotor would oscillate with 200 rad/s
//! joint friction         as in the file, as tanh of the rate over 0.05 rad/s; over a larger rate if the step would be too long for it
//! ```
mod find;
mod sizes;

use super::{Refusal, filled, folder_with, wrong};
use crate::program::program;
use find::{DetectedVehicle, FoundWheel};
use linkwork_formats::{Description, Geometry, ReadOptions, Root, ShapeRole};
use linkwork_spatial::{Quat, Vec3};
use sizes::Sizes;
use std::fmt::Write;
use std::path::{Component, Path, PathBuf};

/// Gravity for which drives and contacts are sized (m/s²).
const G: f64 = 9.81;
/// Step of the created simulation, s.
const STEP: f64 = 1e-3;
/// Friction for which drives are sized.
const FRICTION: f64 = 0.9;
/// Share of the range of a steering hinge that is used, because its servo overshoots.
const STEER_SHARE: f64 = 0.95;
/// Friction between wheels and ground.
const RUBBER: f64 = 0.7;
/// Sample period of the rate control in `parts/wheel_drive.ron`, s.
const SAMPLE: f64 = 0.01;
/// Largest gain of the rate control, in units of the motor's own constant; larger gains do not help.
const GAIN_MAX: f64 = 2.0;

/// Returns the gain of a sampled rate control, in units of the motor's own constant: half of the gain at which a motor with this time constant (s)
/// and without load reaches the commanded rate within one sample.
fn rate_gain(time_constant: f64) -> f64 {
    let left = (-SAMPLE / time_constant).exp();
    (0.5 * left / (1.0 - left)).min(GAIN_MAX)
}

/// Formats a number with at most five digits.
fn n(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return "0".into();
    }
    let digits = (4 - x.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{x:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => text,
    }
}

fn list(v: &[f64]) -> String {
    format!("[{}]", v.iter().map(|x| n(*x)).collect::<Vec<_>>().join(", "))
}

/// Returns the rate at which the friction of a joint saturates (rad/s). Below it, the friction acts as damping force/rate, which must not reverse a
/// body's motion within a step. The body's own inertia is the smallest inertia that it moves.
fn friction_rate(d: &Description, body: &str, force: f64, armature: f64) -> f64 {
    let spec = d.builder.bodies().iter().find(|b| b.name == body);
    let inertia = spec
        .and_then(|b| Some((b, find::pin(b)?)))
        .map_or(0.0, |(b, axis)| axis.dot(&(b.mass.inertia_com * axis)) + armature);
    if inertia > 0.0 { (2.0 * STEP * force / inertia).max(0.05) } else { 0.05 }
}

/// Returns the relative path from a folder to a file.
fn relative(from: &Path, to: &Path) -> PathBuf {
    let (from, to): (Vec<Component>, Vec<Component>) =
        (from.components().collect(), to.components().collect());
    let same = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = from[same..].iter().map(|_| Component::ParentDir);
    up.chain(to[same..].iter().copied()).collect()
}

/// Returns the name of a body after import.
fn imported(name: &str) -> String {
    name.chars().map(|c| if ['.', '/', ':', ' '].contains(&c) { '_' } else { c }).collect()
}

/// Returns a quaternion whose y axis is the axle.
fn turn(axle: &Vec3) -> [f64; 4] {
    let q = Quat::rotation_between(&Vec3::y(), axle)
        .unwrap_or_else(|| Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI));
    [q.i, q.j, q.k, q.w]
}

/// Formats a quaternion in full precision, because its length must be 1.
fn quaternion([x, y, z, w]: [f64; 4]) -> String {
    format!("[{x}, {y}, {z}, {w}]")
}

/// Returns whether a viewer shows a shape of a body.
fn shown_of(d: &Description, body: &str) -> bool {
    let seen = |g: &Geometry| match g {
        Geometry::Mesh { path, .. } => {
            path.as_deref().is_some_and(|p| linkwork_assembly::machine::mesh_corners(p).is_ok())
        }
        Geometry::Plane { .. } | Geometry::HeightField { .. } => false,
        _ => true,
    };
    d.shapes.iter().any(|s| s.body == body && s.role == ShapeRole::Visual && seen(&s.geometry))
}

/// Returns visual shapes for a body whose own shapes cannot be shown: its collision shapes, or a box between the wheels.
fn hull(d: &Description, found: &DetectedVehicle) -> String {
    let mut shapes = Vec::new();
    for s in d.shapes.iter().filter(|s| s.body == found.root && s.role == ShapeRole::Collision) {
        let shape = match &s.geometry {
            Geometry::Box { size } => format!("Box({})", list(size)),
            Geometry::Sphere { radius } => format!("Sphere({})", n(*radius)),
            Geometry::Cylinder { radius, length } => {
                format!("Cylinder(radius: {}, length: {})", n(*radius), n(*length))
            }
            _ => continue,
        };
        let q = s.pose.rotation;
        shapes.push(format!(
            "(shape: {shape}, at: (position: {}, rotation: (quat: {})), color: [0.85, 0.7, 0.2])",
            list(s.pose.position.as_slice()),
            list(&[q.i, q.j, q.k, q.w])
        ));
    }
    if shapes.is_empty() {
        let (mut low, mut high) = (found.wheels[0].place, found.wheels[0].place);
        for w in &found.wheels {
            (low, high) = (low.inf(&w.place), high.sup(&w.place));
        }
        let [radius, width] = found.wheels[0].size;
        let size = [high.x - low.x, (high.y - low.y - 1.2 * width).max(width), radius];
        let middle = (low + high) * 0.5 + Vec3::z() * radius;
        shapes.push(format!(
            "(shape: Box({}), at: (position: {}), color: [0.85, 0.7, 0.2])",
            list(&size),
            list(middle.as_slice())
        ));
    }
    let (root, shapes) = (imported(&found.root), shapes.join(", "));
    format!(
        "    // The file's own shapes of `{root}` cannot be shown.\n    bodies: {{ \"hull\": (parent: \"{root}\", shapes: [{shapes}]) }},\n"
    )
}

/// Creates the files of a rover.
pub(super) fn rover(folder: &Path, file: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let Some(name) = folder.file_name().and_then(|f| f.to_str()) else {
        let fact = format!("`{}` does not have a name that a simulation can use", folder.display());
        return Err(wrong(fact, "give a folder: `new rover scout --from scout.urdf`"));
    };
    let shown = file.display().to_string();
    let there = std::fs::canonicalize(file).map_err(|e| {
        wrong(format!("`{shown}` cannot be read: {e}"), "give a URDF, MJCF or SDF file")
    })?;
    // Use the options with which the created assembly reads the file. `run` will warn of inertias
    // that no rigid body can have.
    let options = ReadOptions { root: Root::Free, ..ReadOptions::default() };
    let description =
        linkwork_assembly::machine::read_machine(&there, &options).map_err(|failure| {
            let told = linkwork_assembly::show_faults(
                &failure.faults,
                &failure.sources,
                linkwork_assembly::Look::Plain,
            );
            let help = match failure.faults.iter().any(|f| f.help.is_some()) {
                // Each error contains its own remedy.
                true => "",
                false => "correct the file",
            };
            wrong(format!("`{shown}` is rejected:\n{}", told.trim_end()), help)
        })?;
    let corners = |path: &Path| linkwork_assembly::machine::mesh_corners(path).ok();
    let found = find::vehicle(&description, &corners)
        .map_err(|(fact, help)| wrong(format!("`{shown}`: {fact}"), help))?;
    let parent = match folder.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    // The folder does not exist yet, and its parent may not exist either.
    let whole = std::path::absolute(parent).unwrap_or_else(|_| parent.into()).join(name);
    let whole = whole.components().collect::<PathBuf>();
    let path = relative(&whole, &there).to_string_lossy().replace('\\', "/");
    let words = words(name, (&shown, &path), &found, &description);
    let words: Vec<(&str, &str)> = words.iter().map(|(k, v)| (*k, v.as_str())).collect();
    let texts = [
        ("rover.ron", include_str!("../../../templates/rover/rover.txt")),
        ("sim.ron", include_str!("../../../templates/rover/sim.txt")),
        ("README.md", include_str!("../../../templates/rover/readme.txt")),
    ];
    let files = texts.map(|(file, text)| (file.to_string(), filled(text, &words)));
    folder_with(folder, &files)
}

/// Circles that a vehicle can drive within the limits of its steering.
struct TurningCircle {
    /// Radius of the smallest circle of the point on the axis about which it turns, m; zero without limits.
    radius: f64,
    /// Whether it can turn on the spot.
    on_the_spot: bool,
    /// The steering angle that all steered wheels reach, if it is limited, rad.
    steer_max: Option<f64>,
}

/// Returns the circles that a vehicle can drive; the geometry agrees with `control.ackermann`.
fn turning_circle(driven: &[&FoundWheel]) -> TurningCircle {
    let limit = driven.iter().filter_map(|w| w.steer_max).reduce(f64::min);
    let Some(limit) = limit.map(|a| STEER_SHARE * a) else {
        return TurningCircle { radius: 0.0, on_the_spot: true, steer_max: None };
    };
    let fixed: Vec<f64> =
        driven.iter().filter(|w| w.steering.is_none()).map(|w| w.place.x).collect();
    let all: Vec<f64> = driven.iter().map(|w| w.place.x).collect();
    let of = if fixed.is_empty() { &all } else { &fixed };
    let axis = of.iter().sum::<f64>() / of.len() as f64;
    let steered = || {
        let all = driven.iter().filter(|w| w.steering.is_some());
        all.map(|w| [(w.place.x - axis).abs(), w.place.y.abs()])
    };
    TurningCircle {
        radius: steered().map(|[x, y]| y + x / limit.tan()).fold(0.0, f64::max),
        on_the_spot: steered().all(|[x, y]| x.atan2(y) <= limit),
        steer_max: Some(limit),
    }
}

/// Returns the names that the templates contain between `@` signs, each with the text that replaces it.
fn words(
    name: &str,
    (shown, path): (&str, &str),
    found: &DetectedVehicle,
    d: &Description,
) -> Vec<(&'static str, String)> {
    let driven: Vec<&FoundWheel> = found.wheels.iter().filter(|w| w.driven).collect();
    let idle: Vec<&FoundWheel> = found.wheels.iter().filter(|w| !w.driven).collect();
    let steered: Vec<&FoundWheel> =
        driven.iter().copied().filter(|w| w.steering.is_some()).collect();
    let ([radius, width], count) = (driven[0].size, found.wheels.len() as f64);
    let load = found.mass * G / count;
    let sizes = Sizes::of(found);
    // The drives have one range of rates, so the smallest wheel limits the speed.
    let least = driven.iter().map(|w| w.size[0]).fold(f64::INFINITY, f64::min);
    let of_file = |get: fn(&FoundWheel) -> Option<f64>| {
        driven.iter().map(|w| get(w)).reduce(|a, b| Some(a?.min(b?))).flatten()
    };
    // A machine without a suspension may rest on two wheels. With a suspension, a wheel on a rock also carries the
    // share of its neighbour.
    let worst = if found.suspension.is_empty() {
        (2.0 * load).max(0.5 * found.mass * G)
    } else {
        2.0 * load
    };
    let largest = driven.iter().map(|w| w.size[0]).fold(0.0, f64::max);
    let torque = of_file(|w| w.torque).unwrap_or(FRICTION * worst * largest);
    let rate = of_file(|w| w.rate).unwrap_or(4.0 / least.sqrt());
    let stiffness = load / (0.005 * radius);
    let sideways = 0.5 * stiffness;
    // Dimensions of the course scale with the distance of the wheels.
    let span = |get: fn(&FoundWheel) -> f64| {
        let all = found.wheels.iter().map(get);
        all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
    };
    let length = span(|w| w.place.x).max(span(|w| w.place.y)).max(2.0 * radius);
    let circle = turning_circle(&driven);
    let leg = (6.0 * length).max(1.5).max(4.0 * circle.radius);
    let rate_max = 0.85 * rate;
    let speed_max = 0.8 * rate_max * least;
    let speed = 0.5 * speed_max;
    let place = |w: &FoundWheel| {
        let steered = if w.steering.is_some() { "" } else { ", steered: false" };
        let own = match sizes.radius(w) {
            r if r == radius => String::new(),
            r => format!(", radius: {}", n(r)),
        };
        format!("(position: {}{steered}{own})", list(&[w.place.x, w.place.y]))
    };
    let places = format!("[{}]", driven.iter().map(|w| place(w)).collect::<Vec<_>>().join(", "));
    let mut wheels = String::new();
    let mut overrides = String::new();
    let rotor =
        (0.02 * found.mass * largest * largest / driven.len() as f64).max(0.02 * torque / rate);
    let element = |w: &FoundWheel, direction: &str| {
        let body = imported(&w.body);
        let visible = match shown_of(d, &w.body) {
            true => String::new(),
            false => {
                let [radius, width] = w.size.map(n);
                format!(", \"visible\": true, \"radius\": {radius}, \"width\": {width}")
            }
        };
        format!(
            "                (mounts: {{ \"wheel\": \"{body}\" }}, params: {{ \"centre\": {}, \"turn\": {}{direction}{visible}{} }}),\n",
            list(w.centre.as_slice()),
            quaternion(turn(&w.axle)),
            sizes.parameter(w),
        )
    };
    for w in &driven {
        wheels += &element(w, if w.forwards { "" } else { ", \"direction\": -1" });
        let _ = writeln!(overrides, "        \"{}.armature\": {},", imported(&w.body), n(rotor));
    }
    let mut more = String::new();
    let mut outer_wires = String::new();
    if !idle.is_empty() {
        more += "        \"Idle\": (\n            assembly: \"parts/wheel_idle.ron\",\n            params: { \"contact\": \"$contact\", \"contact_params\": \"$contact_params\" },\n            array: [\n";
        idle.iter().for_each(|w| more += &element(w, ""));
        more += "            ],\n        ),\n";
    }
    if !steered.is_empty() {
        let stiff = 40.0 * load * radius;
        let _ = write!(
            more,
            "        \"Steering\": (\n            assembly: \"parts/steering_drive.ron\",\n            params: {{ \"torque\": {}, \"stiffness\": {}, \"damping\": {} }},\n            array: [\n",
            n(2.0 * FRICTION * load * radius.max(width)),
            n(stiff),
            n(0.03 * stiff)
        );
        for (body, up) in steered.iter().filter_map(|w| w.steering.as_ref()) {
            let direction = if *up { "" } else { ", params: { \"direction\": -1 }" };
            let body = imported(body);
            let _ =
                writeln!(more, "                (mounts: {{ \"yoke\": \"{body}\" }}{direction}),");
            let _ = writeln!(overrides, "        \"{body}.armature\": {},", n(4.0 * rotor));
        }
        more += "            ],\n        ),\n";
        outer_wires += "\n        \"Software.Ackermann.wheels[*].steer -> Steering[*].angle_cmd\",";
    }
    // Dry friction acts only in its smooth form without `contact`.
    let rubs = d.joints.iter().filter(|j| j.friction > 0.0 && !found.others.contains(&j.body));
    for joint in rubs {
        let (body, force) = (imported(&joint.body), n(joint.friction));
        let steers = |w: &FoundWheel| w.steering.as_ref().is_some_and(|s| s.0 == joint.body);
        let armature = match driven.iter().any(|w| w.body == joint.body) {
            true => rotor,
            false if steered.iter().any(|w| steers(w)) => 4.0 * rotor,
            false => 0.0,
        };
        let rate = n(friction_rate(d, &joint.body, joint.friction, armature));
        let _ = writeln!(overrides, "        \"{body}.friction\": (force: {force}, rate: {rate}),");
    }
    for other in &found.others {
        // Joints without an actuator are held in the pose of the file.
        let _ = writeln!(overrides, "        \"{}.prescribed\": true,   // held", imported(other));
    }
    let mut table = String::from(
        "| wheel | radius, width | centre | drives | steered by |\n|---|---|---|---|---|\n",
    );
    for w in &found.wheels {
        let steering = match (&w.steering, &w.swivel, w.slides) {
            (Some((body, _)), ..) => body.clone(),
            (_, Some(body), _) => format!("turns freely on `{body}`"),
            (.., Some(friction)) => format!("slides with friction {}", n(friction)),
            _ => "–".to_string(),
        };
        let drives = if w.driven { "yes" } else { "no" };
        let _ = writeln!(
            table,
            "| `{}` | {} m, {} m | {} | {drives} | {steering} |",
            w.body,
            n(w.size[0]),
            n(w.size[1]),
            list(w.place.as_slice())
        );
    }
    let common = format!(
        "\"stiffness\": {}, \"tangential_stiffness\": {}, \"tangential_damping\": {}",
        n(stiffness),
        n(sideways),
        n(0.28 * (sideways * load / G).sqrt())
    );
    let [placed, placed_radius] = sizes.placed(found);
    let spot = match circle.on_the_spot {
        true => format!("\"spot_rate\": {}", n((speed / length).min(0.8))),
        // The heading error is never as large as 3.2 rad, so the rover always drives a circle.
        false => "\"spot_angle\": 3.2".to_string(),
    };
    let steer_max =
        circle.steer_max.map_or(String::new(), |a| format!(", \"steer_max\": {}", n(a)));
    let steering_supply = if steered.is_empty() { "" } else { "\"Steering[*].supply\", " };
    let names =
        |all: &[String]| all.iter().map(|s| format!("`{s}`")).collect::<Vec<_>>().join(", ");
    let mut told = format!("Mass {} kg.", n(found.mass));
    if !found.suspension.is_empty() {
        let _ = write!(told, " Joints that adapt to the ground: {}.", names(&found.suspension));
    }
    let mut differential = String::new();
    if let Some([(a, fa), (b, fb)]) = &found.differential {
        let _ = write!(
            told,
            " A differential, which the file does not have, connects `{a}` and `{b}`, because otherwise the pitch of the body is not determined."
        );
        differential = format!(
            "    couplings: {{ \"differential\": (terms: {{ \"{}\": {}, \"{}\": {} }}, constant: 0) }},\n",
            imported(a),
            n(*fa),
            imported(b),
            n(*fb)
        );
    }
    if !found.others.is_empty() {
        let _ =
            write!(told, " Joints without an actuator, which are held: {}.", names(&found.others));
    }
    let hub = |b: &String| format!("\"Rover/{}\"", imported(b));
    let joints = found.suspension.iter().map(hub).collect::<Vec<_>>().join(", ");
    let leave = if d.wheels.is_empty() { "" } else { ", leave_out: [\"wheels\"]" };
    let chosen = match (of_file(|w| w.rate), of_file(|w| w.torque)) {
        (Some(_), Some(_)) => " (the limits of its joints)",
        (Some(_), None) => " (the rate of its joints)",
        (None, Some(_)) => " (the torque of its joints)",
        (None, None) => "",
    };
    let way = [[1.0, 0.0], [1.7, 0.7], [1.0, 1.4], [0.0, 1.0]];
    let way: Vec<String> = way.iter().map(|p| list(&[p[0] * leg, p[1] * leg])).collect();
    vec![
        ("name", name.to_string()),
        ("program", program().name.to_string()),
        ("shown", shown.replace('"', "'")),
        ("file", path.replace('"', "\\\"")),
        ("import", leave.to_string()),
        ("count", found.wheels.len().to_string()),
        ("root", imported(&found.root)),
        ("waypoints", format!("[{}]", way.join(", "))),
        ("speed", n(speed)),
        ("slow", n(0.5 * speed)),
        ("speed_max", n(speed_max)),
        ("radius", n(radius)),
        ("width", n(width)),
        ("load", n(load)),
        ("friction", n(RUBBER)),
        ("soil", sizes.on_soil()),
        ("more_contacts", sizes.parameters(&common)),
        ("common", common),
        ("overrides", overrides),
        ("differential", differential),
        ("hull", if shown_of(d, &found.root) { String::new() } else { hull(d, found) }),
        ("look_ahead", n((1.2 * length).max(1.5 * circle.radius))),
        ("tolerance", n((0.5 * length).max(0.75 * circle.radius))),
        ("spot", spot),
        ("steer_max", steer_max),
        ("places", places),
        ("rate_max", n(rate_max)),
        ("acceleration", n((2.0 * speed_max).min(1.0))),
        (
            "steer_wire",
            if steered.is_empty() {
                ""
            } else {
                "\n                \"Ackermann.wheels[*].steer -> Odometry.wheels[*].steer\","
            }
            .to_string(),
        ),
        ("hold_stiffness", n(4e4 * rotor)),
        ("gain", n(rate_gain(rotor * rate / torque))),
        ("torque", n(torque)),
        ("rate", n(rate)),
        ("wheels", wheels),
        ("more", more),
        ("outer_wires", outer_wires),
        ("steering_supply", steering_supply.to_string()),
        ("size", n((6.0 * leg).ceil())),
        ("spacing", n((0.5 * least).clamp(0.02, 0.2))),
        ("relief", n(0.3 * least)),
        ("wavelength", n(6.0 * length)),
        ("placed", placed),
        ("placed_radius", placed_radius),
        ("joints", joints),
        ("eye", [-2.5, -3.0, 1.6].map(|k| n(k * length)).join(", ")),
        ("arrow", n(0.8 * length / (4.0 * load))),
        ("table", table),
        ("found", told),
        ("chosen", chosen.to_string()),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_paths_lead_back() {
        assert_eq!(
            [0.0, 0.1651, 46.034, 123456.0, -0.00012345678, 2.0].map(n),
            ["0", "0.1651", "46.034", "123456", "-0.00012346", "2"]
        );
        let path = relative(Path::new("/a/b/new"), Path::new("/a/c/x.urdf"));
        assert_eq!(path, Path::new("../../c/x.urdf"));
    }

    #[test]
    fn the_axle_becomes_y() {
        for axle in [Vec3::y(), -Vec3::y(), Vec3::x(), Vec3::z(), Vec3::new(0.6, 0.0, 0.8)] {
            let [i, j, k, w] = turn(&axle);
            let q = Quat::from_quaternion(linkwork_spatial::nalgebra::Quaternion::new(w, i, j, k));
            assert!((q * Vec3::y() - axle).norm() < 1e-12);
            // The printed numbers must still be a rotation, which five digits of 1/√2 are not.
            let text = quaternion(turn(&axle));
            let digits =
                text.trim_matches(['[', ']']).split(", ").map(|x| x.parse::<f64>().unwrap());
            assert!((digits.map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12, "{text}");
        }
    }

    #[test]
    fn every_word_of_the_texts_is_filled_in() {
        let urdf = tests_urdf();
        let d = linkwork_formats::read_text(
            &urdf,
            &ReadOptions { root: Root::Free, ..ReadOptions::default() },
        )
        .unwrap();
        let found = find::vehicle(&d, &|_| None).unwrap();
        assert!(found.differential.is_none() && found.suspension == ["rocker"]);
        let words = words("scout", ("scout.urdf", "../scout.urdf"), &found, &d);
        let words: Vec<(&str, &str)> = words.iter().map(|(k, v)| (*k, v.as_str())).collect();
        for text in [
            include_str!("../../../templates/rover/rover.txt"),
            include_str!("../../../templates/rover/sim.txt"),
            include_str!("../../../templates/rover/readme.txt"),
        ] {
            assert!(!filled(text, &words).contains('@'), "{}", filled(text, &words));
        }
    }

    /// A vehicle with all features: axles in each direction, inverted steering, a rocker, an arm, an idle wheel with its size.
    fn tests_urdf() -> String {
        let wheel = |name: &str, parent: &str, xyz: &str, axis: &str, roll: &str| {
            format!(
                r#"<link name="{name}"><inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
            <collision><origin rpy="{roll} 0 0"/><geometry><cylinder radius="0.1" length="0.06"/></geometry></collision></link>
            <joint name="{name}_joint" type="continuous"><parent link="{parent}"/><child link="{name}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/></joint>"#
            )
        };
        let arm = |name: &str, parent: &str, xyz: &str, axis: &str| {
            format!(
                r#"<link name="{name}"><inertial><mass value="0.5"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="{name}_joint" type="revolute"><parent link="{parent}"/><child link="{name}"/><origin xyz="{xyz}"/><axis xyz="{axis}"/><limit lower="-1" upper="1" effort="10" velocity="2"/></joint>"#
            )
        };
        let parts = [
            arm("rocker", "base", "0 0.3 0", "0 1 0"),
            arm("yoke", "base", "0.4 -0.3 0", "0 0 -1"),
            arm("mast", "base", "0 0 0.3", "0 0 1"),
            wheel("fl", "rocker", "0.4 0 -0.1", "0 1 0", "1.5707963"),
            wheel("rl", "rocker", "-0.4 0 -0.1", "0 -1 0", "1.5707963"),
            wheel("fr", "yoke", "0 0 -0.1", "0 1 0", "-1.5707963"),
            wheel("rr", "base", "-0.4 -0.3 -0.1", "0 1 0", "1.5707963"),
        ];
        format!(
            r#"<robot name="scout"><link name="base"><inertial><mass value="20"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>{}</robot>"#,
            parts.concat()
        )
    }

    /// A wheel in the air whose rate is measured as the mean over the last sample, as with the ticks of an encoder, with integral part and
    /// feed-forward of `parts/wheel_drive.ron`. A gain of 2 with a time constant of 4 ms made the wheel oscillate between the voltage limits.
    #[test]
    fn a_wheel_in_the_air_comes_to_its_rate_without_swinging() {
        for time_constant in [2e-3, 4e-3, 0.02, 0.05, 0.3] {
            let gain = rate_gain(time_constant);
            let left = (-SAMPLE / time_constant).exp();
            let (mut rate, mut mean, mut sum, mut greatest) = (0.0_f64, 0.0, 0.0, 0.0_f64);
            let mut late = 0.0_f64;
            for k in 0..600 {
                let error = 1.0 - mean;
                sum += 3.0 * SAMPLE * error;
                let volts = 1.0 + gain * error + sum;
                // The motor follows dω/dt = (u − ω)/T during the sample.
                let next = volts + (rate - volts) * left;
                mean = volts + (rate - volts) * (time_constant / SAMPLE) * (1.0 - left);
                rate = next;
                greatest = greatest.max(rate);
                if k >= 500 {
                    late = late.max((rate - 1.0).abs());
                }
            }
            assert!(late < 1e-3 && greatest < 1.4, "{time_constant}: {late} {greatest}");
        }
        assert_eq!(rate_gain(1.0), GAIN_MAX);
    }
}
