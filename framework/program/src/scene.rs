//! The scene of the viewer, from the shapes of the bodies and the `view` of the simulation file.
use crate::load::{dotted, params_of};
use crate::strands::{self, Places};
use linkwork_assembly::form::{ArrowForm, ViewForm};
use linkwork_assembly::patterns::{match_patterns, path_matches};
use linkwork_assembly::{BodyShape, Loaded, Text};
use linkwork_collision::{VisualShape, box_of_inertia};
use linkwork_multibody::Body;
use linkwork_plant::PlanExt;
use linkwork_runtime::{Fault, Located, Place, Plan, Program, Seconds, Unit, Value, remedy};
use linkwork_spatial::Vec3;
use linkwork_surroundings::{Terrain, site_of};
use linkwork_viz::{Arrow, InUnit, Marker, Panel, Planet, Scene, Shape};

/// Returns the scene and its sample period.
pub fn scene(
    title: &str,
    loaded: &Loaded,
    program: &Program,
) -> Result<(Scene, Seconds), Vec<Fault>> {
    let plan = &*program.phases[0].plan;
    let mut faults = Vec::new();
    let mut seen = shapes(loaded);
    if seen.is_empty() {
        seen = boxes(plan);
    }
    let mut scene = Scene {
        title: title.to_string(),
        shapes: seen.into_iter().chain(loaded.grounds.iter().map(shape)).collect(),
        panels: panels(loaded, plan, &mut faults),
        planet: planet(loaded, plan, &mut faults),
        sky: loaded.simulation.view.as_ref().and_then(|v| v.sky).map(bytes),
        ground: loaded.simulation.view.as_ref().and_then(|v| v.ground).map(bytes),
        follow: free_body(plan),
        ..Scene::default()
    };
    let mut period = Seconds { num: 1, den: 30 };
    if let Some(v) = &loaded.simulation.view {
        view(v, program, &mut scene, &mut period, &mut faults);
    }
    if faults.is_empty() { Ok((scene, period)) } else { Err(faults) }
}

/// Default colour, 0 … 1.
const GREY: [f64; 4] = [0.72, 0.72, 0.75, 1.0];

/// Converts a colour from 0 … 1 to 0 … 255.
fn bytes(color: [f64; 4]) -> [u8; 4] {
    color.map(|c| (255.0 * c) as u8)
}

/// Returns the planet: the one on which W is a site, or the one about the origin of W.
fn planet(loaded: &Loaded, plan: &Plan, faults: &mut Vec<Fault>) -> Option<Planet> {
    let site = site_of(&plan.services);
    let view = loaded.simulation.view.as_ref();
    let written = view.and_then(|v| v.planet);
    let [r, g, b, _] = bytes(written.unwrap_or([0.6, 0.55, 0.5, 1.0]));
    let color = [r, g, b];
    match (site, view.and_then(|v| Some((v.origin, v.planet_radius?)))) {
        (Some(site), None) => {
            let centre = -site.relative_to_centre(&Vec3::zeros());
            Some(Planet { centre, radius: centre.norm(), color })
        }
        (Some(_), Some((origin, _))) => {
            let message =
                "`view`: `planet_radius` is not allowed, because W is a site on a known planet";
            faults.push(Fault::new(origin, message).help("remove it"));
            None
        }
        (None, Some((_, radius))) => Some(Planet { centre: Vec3::zeros(), radius, color }),
        (None, None) => None,
    }
}

/// Returns the shapes of the bodies of all phases, each with the phases in which it exists.
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
    let [r, g, b, a] = bytes(s.color.unwrap_or(GREY));
    Shape {
        body: s.body.clone(),
        name: s.name.clone(),
        pose: s.pose,
        form: s.shape.clone(),
        color: [r, g, b, a],
        phases: Vec::new(),
    }
}

/// Returns the first body that moves freely in W.
fn free_body(plan: &Plan) -> Option<String> {
    let mut bodies = plan.mechanism()?.multibody.bodies().iter();
    bodies.find(|b| b.parent().is_none() && b.is_free()).map(|b| b.name().to_string())
}

/// Returns boxes with the inertia of each body, for a machine without shapes.
fn boxes(plan: &Plan) -> Vec<Shape> {
    let bodies = plan.mechanism().map_or(&[][..], |m| m.multibody.bodies());
    let box_of = |body: &Body| {
        let (pose, form) = box_of_inertia(body.mass_properties())?;
        Some(Shape {
            body: body.name().to_string(),
            name: "inertia".into(),
            pose,
            form: VisualShape::Shape(form),
            color: bytes(GREY),
            phases: Vec::new(),
        })
    };
    bodies.iter().filter_map(box_of).collect()
}

/// Returns labels for paths that match one pattern, from their different segments: `Rover.Wheels.Wheel1.Motor.torque` → `Wheel1`.
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
        let own = paths.first().map_or("", |p| &*plan.variables[*p].unit);
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
                            "plot `{}`: `{path}` is in {}, which is a different quantity than {unit}",
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

/// Resolves the names in the `view` and collects all mistakes.
fn view(
    v: &ViewForm,
    program: &Program,
    scene: &mut Scene,
    period: &mut Seconds,
    faults: &mut Vec<Fault>,
) {
    *period = v.rate.unwrap_or(*period);
    let plan = &*program.phases[0].plan;
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
    // A camera position without a body is relative to W.
    if v.follow.is_some() || v.eye.is_some() {
        scene.follow = find("follow", v.follow.as_slice(), &bodies, "body").into_iter().next();
    }
    scene.trails = find("trails", &v.trails, &bodies, "body");
    scene.frames = find("frames", &v.frames, &nodes, "node");
    scene.eye = v.eye;
    for item in &v.arrows {
        match arrows(item, plan) {
            Ok(found) => scene.arrows.extend(found),
            Err(fault) => faults.push(fault),
        }
    }
    let places = Places::new(program);
    for item in &v.lines {
        match strands::lines(item, plan, &places) {
            Ok(found) => scene.lines.extend(found),
            Err(fault) => faults.push(fault),
        }
    }
    for item in &v.plumes {
        match strands::plumes(item, plan, &places) {
            Ok(found) => scene.plumes.extend(found),
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
        return Err(
            Fault::new(item.origin, message).help("write patterns with equal numbers of matches")
        );
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

/// Reads `markers: "<part>.<parameter>"`: a parameter that is a list of [x, y], which are placed on the ground.
fn markers(path: &Text, plan: &Plan) -> Result<Vec<Marker>, Fault> {
    let wrong = || {
        let message = "`view`: `markers` must be a parameter that is a list of [x, y]";
        Fault::new(path.origin, message)
            .help("write `markers: \"Rover.NavigationSoftware.Follower.waypoints\"`")
    };
    let (part, name) = path.text.rsplit_once('.').ok_or_else(wrong)?;
    let params = params_of(plan, part).ok_or_else(wrong)?;
    let list = Located::from(params.clone()).get(name).cloned().ok_or_else(wrong)?;
    let Value::List(items) = &list.value else { return Err(wrong()) };
    let terrain = plan.services.iter().find_map(|(_, o)| o.get::<dyn Terrain>().cloned());
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

/// Returns the slots of x, y and z of a body's free position.
pub fn position(plan: &Plan, body: &str) -> Option<[Place; 3]> {
    let at = |c: &str| plan.variables.get(&format!("{body}.position.{c}")).map(|v| v.place);
    Some([at("x")?, at("y")?, at("z")?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_multibody::{BodySpec, Builder, Hinge};
    use linkwork_plant::{MechanismSpec, SpecExt};
    use linkwork_runtime::{Catalogue, Entry, Files, Spec, compile};
    use linkwork_spatial::{MassProperties, Mat3};
    use std::sync::Arc;

    fn plan(bodies: Vec<BodySpec>) -> Plan {
        let mut b = Builder::new();
        for body in bodies {
            b.body(body);
        }
        let multibody = Arc::new(b.build().expect("it is whole"));
        let (q, v) = (multibody.neutral_q(), vec![0.0; multibody.nv()]);
        let mut spec = Spec::default();
        spec.set_mechanism(MechanismSpec::new("Mechanism", multibody, q, v));
        let catalogue = Catalogue::new(Vec::<Vec<Entry>>::new());
        compile(&spec, &catalogue, &Files::default()).expect("it compiles")
    }

    #[test]
    fn a_body_without_shapes_is_shown_as_the_box_of_its_inertia() {
        let mass = MassProperties::new(7.0, Vec3::new(0.1, -0.2, 0.4), Mat3::identity());
        let plan = plan(vec![
            BodySpec::new("bob", "world").hinge(Hinge::free()).mass(mass),
            BodySpec::new("carrier", "world"),
        ]);
        let [bob] = &boxes(&plan)[..] else { panic!("one for each body with mass") };
        assert_eq!((bob.body.as_str(), bob.pose.position), ("bob", mass.com));
    }

    #[test]
    fn the_eye_follows_what_is_free() {
        let pendulum =
            plan(vec![
                BodySpec::new("arm", "world")
                    .hinge(Hinge::pin(Vec3::y()))
                    .mass(MassProperties::new(1.0, Vec3::zeros(), Mat3::identity())),
            ]);
        assert_eq!(free_body(&pendulum), None);
        let mass = MassProperties::new(1.0, Vec3::zeros(), Mat3::identity());
        let craft = plan(vec![
            BodySpec::new("tower", "world"),
            BodySpec::new("craft", "world").hinge(Hinge::free()).mass(mass),
        ]);
        assert_eq!(free_body(&craft).as_deref(), Some("craft"));
    }
}
