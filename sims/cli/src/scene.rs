//! What the viewer shows, from the shapes of the bodies and the `view` of the simulation file.
use crate::load::{dotted, numbers, only, params_of, texts};
use linkwork_assembly::{BodyShape, Loaded, Shape as Solid, match_patterns, path_matches};
use linkwork_collision::Shape as Collides;
use linkwork_runtime::{Fault, Located, Place, Plan, Seconds, ServiceObject, Unit, Value};
use linkwork_spatial::Vec3;
use linkwork_viz::{Arrow, Form, Marker, Panel, Scene, Shape};

/// The scene, and the period of its rows.
pub fn scene(title: &str, loaded: &Loaded, plan: &Plan) -> Result<(Scene, Seconds), Vec<Fault>> {
    let mut faults = Vec::new();
    let mut scene = Scene {
        title: title.to_string(),
        shapes: loaded.shapes.iter().map(shape).chain(grounds(loaded)).collect(),
        panels: panels(loaded, plan, &mut faults),
        ..Scene::default()
    };
    let mut period = Seconds { num: 1, den: 30 };
    if let Some(v) = &loaded.simulation.view {
        view(v, plan, &mut scene, &mut period, &mut faults);
    }
    if faults.is_empty() { Ok((scene, period)) } else { Err(faults) }
}

fn shape(s: &BodyShape) -> Shape {
    let [r, g, b, a] = s.color.unwrap_or([0.72, 0.72, 0.75, 1.0]).map(|c| (255.0 * c) as u8);
    let form = match &s.shape {
        Solid::Cylinder { radius, length } => Form::Cylinder { radius: *radius, length: *length },
        Solid::Box { size } => Form::Box(Vec3::from(*size)),
        Solid::Sphere { radius } => Form::Sphere(*radius),
        Solid::Capsule { radius, length } => Form::Capsule { radius: *radius, length: *length },
        Solid::Mesh { file, scale } => Form::Mesh { file: file.into(), scale: *scale },
    };
    Shape { body: s.body.clone(), name: s.name.clone(), pose: s.pose, form, color: [r, g, b, a] }
}

/// Colliders that no shape stands for: what a machine meets is seen.
fn grounds(loaded: &Loaded) -> impl Iterator<Item = Shape> {
    let shown = |name: &str| loaded.shapes.iter().any(|s| format!("{}/{}", s.body, s.name) == name);
    let colliders = loaded.colliders.iter().flat_map(|all| all.ids().map(|id| all.spec(id)));
    colliders.filter(move |c| !shown(&c.name)).filter_map(|c| {
        let form = match &c.fine {
            Collides::HalfSpace => Form::HalfSpace,
            Collides::ConvexHull { points } => Form::Hull { points: points.clone() },
            Collides::HeightField { x, y, spacing, heights } => {
                Form::HeightField { x: *x, y: *y, spacing: *spacing, heights: heights.clone() }
            }
            // Solids and mesh files are shown as shapes, unless the file says that they are not.
            _ => return None,
        };
        let (body, name) = (c.body.clone(), c.name.replace(['.', '/'], "_"));
        Some(Shape { body, name, pose: c.pose, form, color: [150, 135, 115, 255] })
    })
}

/// What differs between paths of one pattern: `Rover.Wheels.Wheel1.Motor.torque` → `Wheel1`.
fn labels(paths: &[&str]) -> Vec<String> {
    let split: Vec<Vec<&str>> = paths.iter().map(|p| p.split('.').collect()).collect();
    let differs = |k: usize| split.iter().any(|s| s.get(k) != split[0].get(k));
    let longest = split.iter().map(Vec::len).max().unwrap_or(0);
    let keep: Vec<usize> = (0..longest).filter(|&k| differs(k)).collect();
    split
        .iter()
        .map(|s| {
            let parts: Vec<&str> = keep.iter().filter_map(|&k| s.get(k).copied()).collect();
            if parts.is_empty() {
                s.last().copied().unwrap_or("").to_string()
            } else {
                parts.join(".")
            }
        })
        .collect()
}

fn panels(loaded: &Loaded, plan: &Plan, faults: &mut Vec<Fault>) -> Vec<Panel> {
    let names: Vec<&str> = plan.variables.keys().map(String::as_str).collect();
    let mut out = Vec::new();
    for plot in &loaded.simulation.plots {
        let found = match match_patterns(&plot.of, &names) {
            Ok(found) => found,
            Err(mut f) => {
                faults.append(&mut f);
                continue;
            }
        };
        let paths: Vec<&str> = found.iter().map(|&k| names[k]).collect();
        let own = paths.first().map_or("", |p| plan.variables[*p].unit.as_str());
        let unit = plot.unit.as_ref().map_or(own, |u| u.text.as_str());
        let scale = match Unit::parse(if unit.is_empty() { "1" } else { unit }) {
            Ok(u) => u,
            Err(e) => {
                faults.push(Fault::new(plot.origin, format!("plot `{}`: {e}", plot.title)));
                continue;
            }
        };
        for path in &paths {
            let v = Unit::parse(&plan.variables[*path].unit).unwrap_or(Unit::ONE);
            if !v.same_quantity(&scale) {
                faults.push(
                    Fault::new(
                        plot.origin,
                        format!(
                            "plot `{}`: `{path}` is in {}, which is no {unit}",
                            plot.title, plan.variables[*path].unit
                        ),
                    )
                    .help("choose a unit of the same quantity, or another plot"),
                );
            }
        }
        let series = labels(&paths)
            .into_iter()
            .zip(&paths)
            .map(|(label, path)| (label, (*path).to_string(), 1.0 / scale.scale))
            .collect();
        let shown =
            if unit.is_empty() || unit == "1" { String::new() } else { format!(" [{unit}]") };
        out.push(Panel { title: format!("{}{shown}", plot.title), series });
    }
    out
}

const FIELDS: [&str; 7] = ["rate", "follow", "eye", "trails", "frames", "arrows", "markers"];

/// Reads the `view`: every mistake in it is gathered.
fn view(
    v: &Located,
    plan: &Plan,
    scene: &mut Scene,
    period: &mut Seconds,
    faults: &mut Vec<Fault>,
) {
    let mut keep = |fault: Fault| faults.push(fault);
    only(v, "view", &FIELDS).unwrap_or_else(&mut keep);
    if let Some(r) = v.get("rate") {
        match Seconds::period(&r.value) {
            Ok(p) if p.num > 0 => *period = p,
            _ => keep(
                Fault::new(r.origin, format!("`view.rate`: `{}` is not a time", bare(&r.value)))
                    .help("write \"20 Hz\" or \"50 ms\""),
            ),
        }
    }
    let (bodies, nodes): (Vec<&str>, Vec<&str>) = match plan.mechanism() {
        Some(m) => (
            m.multibody.bodies().iter().map(|b| b.name()).collect(),
            m.multibody.nodes().iter().map(|n| n.name()).collect(),
        ),
        None => Default::default(),
    };
    let mut find = |field: &str, known: &[&str], what: &str| {
        named(v, field, known, what).unwrap_or_else(|fault| {
            keep(fault);
            Vec::new()
        })
    };
    scene.follow = find("follow", &bodies, "body").into_iter().next();
    scene.trails = find("trails", &bodies, "body");
    scene.frames = find("frames", &nodes, "node");
    if let Some(e) = v.get("eye") {
        match numbers(e).as_deref() {
            Some([x, y, z]) => scene.eye = Some(Vec3::new(*x, *y, *z)),
            _ => keep(
                Fault::new(e.origin, "`view.eye` is not a position")
                    .help("write [x, y, z] in metres, for example eye: [-4, -5, 3]"),
            ),
        }
    }
    match v.get("arrows").map(|list| (&list.value, list.origin)) {
        None => {}
        Some((Value::List(items), _)) => {
            for item in items {
                match arrows(item, plan) {
                    Ok(found) => scene.arrows.extend(found),
                    Err(fault) => keep(fault),
                }
            }
        }
        Some((_, origin)) => keep(
            Fault::new(origin, "`view.arrows` is a list")
                .help("write arrows: [(at: \"Part.point\", along: \"Part.force\", scale: 0.001)]"),
        ),
    }
    if let Some(m) = v.get("markers") {
        match markers(m, plan) {
            Ok(found) => scene.markers = found,
            Err(fault) => keep(fault),
        }
    }
}

/// A value without the quotes of a text.
fn bare(v: &Value) -> String {
    match v {
        Value::Text(t) => t.clone(),
        other => other.to_string(),
    }
}

/// Names or patterns in a field, matched against what there is.
fn named(v: &Located, field: &str, known: &[&str], what: &str) -> Result<Vec<String>, Fault> {
    let Some(at) = v.get(field) else { return Ok(Vec::new()) };
    let Some(patterns) = texts(at) else {
        return Err(Fault::new(at.origin, format!("`view.{field}` is a name, or a list of names")));
    };
    let mut out = Vec::new();
    for p in patterns {
        let before = out.len();
        out.extend(
            known
                .iter()
                .filter(|k| path_matches(&dotted(&p), &dotted(k)))
                .map(|k| (*k).to_string()),
        );
        if out.len() == before {
            return Err(Fault::new(at.origin, format!("`view.{field}`: `{p}` matches no {what}"))
                .help(linkwork_runtime::remedy(&p, "names", known)));
        }
    }
    Ok(out)
}

fn arrows(item: &Located, plan: &Plan) -> Result<Vec<Arrow>, Fault> {
    only(item, "view.arrows", &["at", "along", "scale", "color"])?;
    let pattern = |field: &str| -> Result<(String, linkwork_runtime::Origin), Fault> {
        let at = item
            .get(field)
            .ok_or_else(|| Fault::new(item.origin, format!("an arrow needs `{field}`")))?;
        match &at.value {
            Value::Text(t) => Ok((t.clone(), at.origin)),
            _ => Err(Fault::new(at.origin, format!("`{field}` is a pattern of variables"))),
        }
    };
    let stems = |field: &str| -> Result<Vec<String>, Fault> {
        let (p, origin) = pattern(field)?;
        let found: Vec<String> = plan
            .variables
            .keys()
            .filter_map(|k| k.strip_suffix(".x"))
            .filter(|k| path_matches(&p, k))
            .map(str::to_string)
            .collect();
        if found.is_empty() {
            let known: Vec<&str> =
                plan.variables.keys().filter_map(|k| k.strip_suffix(".x")).collect();
            return Err(Fault::new(origin, format!("`{p}` matches no vector"))
                .help(linkwork_runtime::remedy(&p, "vectors", &known)));
        }
        Ok(found)
    };
    let (at, along) = (stems("at")?, stems("along")?);
    if at.len() != along.len() {
        return Err(Fault::new(
            item.origin,
            format!("an arrow: `at` matches {} vectors, `along` {}", at.len(), along.len()),
        ));
    }
    let one = |field: &str, otherwise: f64| match item.get(field).map(|v| &v.value) {
        Some(Value::Number(x)) => *x,
        _ => otherwise,
    };
    let scale = one("scale", 1.0);
    let color = match item.get("color").and_then(numbers).as_deref() {
        Some([r, g, b]) => [*r, *g, *b].map(|c| (255.0 * c) as u8),
        _ => [80, 220, 100],
    };
    let xyz = |s: &String| ["x", "y", "z"].map(|c| format!("{s}.{c}"));
    Ok(at
        .iter()
        .zip(&along)
        .map(|(o, a)| Arrow {
            path: a.clone(),
            origin: xyz(o),
            vector: xyz(a),
            scale,
            color: [color[0], color[1], color[2], 255],
        })
        .collect())
}

/// `markers: "<part>.<parameter>"`: a parameter that is a list of [x, y]; set on the ground.
fn markers(v: &Located, plan: &Plan) -> Result<Vec<Marker>, Fault> {
    let wrong = || {
        Fault::new(v.origin, "`view.markers` names a parameter that is a list of [x, y]")
            .help("write `markers: \"Rover.NavigationSoftware.Follower.waypoints\"`")
    };
    let Value::Text(path) = &v.value else { return Err(wrong()) };
    let (part, name) = path.rsplit_once('.').ok_or_else(wrong)?;
    let params = params_of(plan, part).ok_or_else(wrong)?;
    let list = Located::from(params.clone()).get(name).cloned().ok_or_else(wrong)?;
    let Value::List(items) = &list.value else { return Err(wrong()) };
    let terrain = plan.services.iter().find_map(|(_, o)| match o {
        ServiceObject::Terrain(t) => Some(t.clone()),
        _ => None,
    });
    items
        .iter()
        .enumerate()
        .map(|(k, item)| match numbers(item).as_deref() {
            Some([x, y, ..]) => {
                let ground = terrain.as_ref().and_then(|t| t.ground(*x, *y));
                let z = ground.map_or(0.0, |g| g.height) + 0.3;
                Ok(Marker { at: Vec3::new(*x, *y, z), label: format!("{}", k + 1) })
            }
            _ => Err(wrong()),
        })
        .collect()
}

/// Places of the x and y of a body's free position, for the map.
pub fn position(plan: &Plan, body: &str) -> Option<(Place, Place)> {
    let at = |c: &str| plan.variables.get(&format!("{body}.position.{c}")).map(|v| v.place);
    Some((at("x")?, at("y")?))
}
