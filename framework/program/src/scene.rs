//! What the viewer shows, from the shapes of the bodies and the `view` of the simulation file.
use crate::load::{dotted, params_of};
use linkwork_assembly::{
    ArrowForm, BodyShape, Loaded, Text, ViewForm, match_patterns, path_matches,
};
use linkwork_runtime::{Fault, Located, Place, Plan, Seconds, ServiceObject, Unit, Value, remedy};
use linkwork_spatial::Vec3;
use linkwork_viz::{Arrow, InUnit, Marker, Panel, Planet, Scene, Shape};

/// The scene, and the period of its rows.
pub fn scene(title: &str, loaded: &Loaded, plan: &Plan) -> Result<(Scene, Seconds), Vec<Fault>> {
    let mut faults = Vec::new();
    let mut scene = Scene {
        title: title.to_string(),
        shapes: shapes(loaded).into_iter().chain(loaded.grounds.iter().map(shape)).collect(),
        panels: panels(loaded, plan, &mut faults),
        planet: planet(loaded, plan),
        sky: loaded.simulation.view.as_ref().and_then(|v| v.sky).map(bytes),
        ..Scene::default()
    };
    let mut period = Seconds { num: 1, den: 30 };
    if let Some(v) = &loaded.simulation.view {
        view(v, plan, &mut scene, &mut period, &mut faults);
    }
    if faults.is_empty() { Ok((scene, period)) } else { Err(faults) }
}

/// A colour from 0 … 1 to 0 … 255.
fn bytes(color: [f64; 4]) -> [u8; 4] {
    color.map(|c| (255.0 * c) as u8)
}

/// The planet on which W is a site.
fn planet(loaded: &Loaded, plan: &Plan) -> Option<Planet> {
    let site = plan.services.iter().find_map(|(_, o)| o.axes().site())?;
    let written = loaded.simulation.view.as_ref().and_then(|v| v.planet);
    let [r, g, b, _] = bytes(written.unwrap_or([0.6, 0.55, 0.5, 1.0]));
    Some(Planet { centre: -site.from_centre(&Vec3::zeros()), color: [r, g, b] })
}

/// Shapes of the bodies of all phases, each with the phases that have it so.
fn shapes(loaded: &Loaded) -> Vec<Shape> {
    let phases = &loaded.phase_shapes;
    let mut all: Vec<Shape> = Vec::new();
    for (k, seen) in phases.iter().enumerate() {
        for s in seen.iter().map(shape) {
            let same = |known: &&mut Shape| Shape { phases: Vec::new(), ..(*known).clone() } == s;
            match all.iter_mut().find(same) {
                Some(known) => known.phases[k] = true,
                None => {
                    let mut there = vec![false; phases.len()];
                    there[k] = true;
                    all.push(Shape { phases: there, ..s });
                }
            }
        }
    }
    for s in &mut all {
        if s.phases.iter().all(|there| *there) {
            s.phases.clear();
        }
    }
    all
}

fn shape(s: &BodyShape) -> Shape {
    let [r, g, b, a] = bytes(s.color.unwrap_or([0.72, 0.72, 0.75, 1.0]));
    Shape {
        body: s.body.clone(),
        name: s.name.clone(),
        pose: s.pose,
        form: s.shape.clone(),
        color: [r, g, b, a],
        phases: Vec::new(),
    }
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
            .map(|(label, path)| {
                let shown = InUnit { offset: scale.offset, factor: 1.0 / scale.scale };
                (label, (*path).to_string(), shown)
            })
            .collect();
        let shown =
            if unit.is_empty() || unit == "1" { String::new() } else { format!(" [{unit}]") };
        out.push(Panel { title: format!("{}{shown}", plot.title), series });
    }
    out
}

/// Finds what the `view` names: every mistake in it is gathered.
fn view(
    v: &ViewForm,
    plan: &Plan,
    scene: &mut Scene,
    period: &mut Seconds,
    faults: &mut Vec<Fault>,
) {
    *period = v.rate.unwrap_or(*period);
    let (bodies, nodes): (Vec<&str>, Vec<&str>) = match plan.mechanism() {
        Some(m) => (
            m.multibody.bodies().iter().map(|b| b.name()).collect(),
            m.multibody.nodes().iter().map(|n| n.name()).collect(),
        ),
        None => Default::default(),
    };
    let mut find = |field: &str, patterns: &[Text], known: &[&str], what: &str| {
        let mut out = Vec::new();
        for p in patterns {
            let matches = |k: &&&str| path_matches(&dotted(&p.text), &dotted(k));
            let before = out.len();
            out.extend(known.iter().filter(matches).map(|k| (*k).to_string()));
            if out.len() == before {
                let message = format!("`view`: `{field}`: `{}` matches no {what}", p.text);
                faults.push(Fault::new(p.origin, message).help(remedy(&p.text, "names", known)));
            }
        }
        out
    };
    scene.follow = find("follow", v.follow.as_slice(), &bodies, "body").into_iter().next();
    scene.trails = find("trails", &v.trails, &bodies, "body");
    scene.frames = find("frames", &v.frames, &nodes, "node");
    scene.eye = v.eye;
    for item in &v.arrows {
        match arrows(item, plan) {
            Ok(found) => scene.arrows.extend(found),
            Err(fault) => faults.push(fault),
        }
    }
    if let Some(m) = &v.markers {
        match markers(m, plan) {
            Ok(found) => scene.markers = found,
            Err(fault) => faults.push(fault),
        }
    }
}

fn arrows(item: &ArrowForm, plan: &Plan) -> Result<Vec<Arrow>, Fault> {
    let stems = |p: &Text| -> Result<Vec<String>, Fault> {
        let vectors = || plan.variables.keys().filter_map(|k| k.strip_suffix(".x"));
        let found: Vec<String> =
            vectors().filter(|k| path_matches(&p.text, k)).map(str::to_string).collect();
        if found.is_empty() {
            let known: Vec<&str> = vectors().collect();
            let message = format!("`view`: `arrows`: `{}` matches no vector", p.text);
            return Err(Fault::new(p.origin, message).help(remedy(&p.text, "vectors", &known)));
        }
        Ok(found)
    };
    let (at, along) = (stems(&item.at)?, stems(&item.along)?);
    if at.len() != along.len() {
        let (a, b) = (at.len(), along.len());
        let message = format!("`view`: `arrows`: `at` matches {a} vectors, `along` {b}");
        return Err(Fault::new(item.origin, message).help("write patterns that match in pairs"));
    }
    let color = item.color.map_or([80, 220, 100, 255], bytes);
    let xyz = |s: &String| ["x", "y", "z"].map(|c| format!("{s}.{c}"));
    let one = |(o, a): (&String, &String)| Arrow {
        path: a.clone(),
        origin: xyz(o),
        vector: xyz(a),
        scale: item.scale,
        color,
    };
    Ok(at.iter().zip(&along).map(one).collect())
}

/// `markers: "<part>.<parameter>"`: a parameter that is a list of [x, y]; set on the ground.
fn markers(path: &Text, plan: &Plan) -> Result<Vec<Marker>, Fault> {
    let wrong = || {
        let message = "`view`: `markers` names a parameter that is a list of [x, y]";
        Fault::new(path.origin, message)
            .help("write `markers: \"Rover.NavigationSoftware.Follower.waypoints\"`")
    };
    let (part, name) = path.text.rsplit_once('.').ok_or_else(wrong)?;
    let params = params_of(plan, part).ok_or_else(wrong)?;
    let list = Located::from(params.clone()).get(name).cloned().ok_or_else(wrong)?;
    let Value::List(items) = &list.value else { return Err(wrong()) };
    let terrain = plan.services.iter().find_map(|(_, o)| match o {
        ServiceObject::Terrain(t) => Some(t.clone()),
        _ => None,
    });
    let number = |v: &Located| match v.value {
        Value::Number(x) => Some(x),
        _ => None,
    };
    // Parameters of a plan are in SI.
    let one = |(k, item): (usize, &Located)| {
        let Value::List(xy) = &item.value else { return Err(wrong()) };
        let (Some(x), Some(y)) = (xy.first().and_then(number), xy.get(1).and_then(number)) else {
            return Err(wrong());
        };
        let ground = terrain.as_ref().and_then(|t| t.ground(x, y));
        let z = ground.map_or(0.0, |g| g.height) + 0.3;
        Ok(Marker { at: Vec3::new(x, y, z), label: format!("{}", k + 1) })
    };
    items.iter().enumerate().map(one).collect()
}

/// Places of the x and y of a body's free position, for the map.
pub fn position(plan: &Plan, body: &str) -> Option<(Place, Place)> {
    let at = |c: &str| plan.variables.get(&format!("{body}.position.{c}")).map(|v| v.place);
    Some((at("x")?, at("y")?))
}
