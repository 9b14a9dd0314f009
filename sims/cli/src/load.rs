//! The catalogue of all component libraries, and loading a simulation with it.
use crate::exit;
use linkwork_assembly::{Failure, Loaded, Look, Options, load_file, load_text};
use linkwork_runtime::{
    Catalogue, Fault, Files, Handle, Located, Origin, Placement, Plan, Sources, Terrain, Value,
    compile, place_on_terrain, split_quantity,
};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// Every model and service of the component libraries.
pub fn catalogue() -> Catalogue {
    Catalogue::new([
        linkwork_basics::catalogue(),
        linkwork_actuators::catalogue(),
        linkwork_sensors::catalogue(),
        linkwork_mobility::catalogue(),
        linkwork_environment::catalogue(),
        linkwork_flight::catalogue(),
        linkwork_control::catalogue(),
        linkwork_power::catalogue(),
    ])
}

/// A simulation, compiled, with what else its file says.
pub struct Ready {
    /// As loaded.
    pub loaded: Loaded,
    /// As compiled.
    pub plan: Plan,
}

fn options<'a>(catalogue: &'a Catalogue, set: &[String], seed: Option<u64>) -> Options<'a> {
    let mut options = Options::new(catalogue);
    options.embedded = linkwork_assemblies::embedded();
    options.search = vec![PathBuf::from("assemblies")];
    options.overrides = set.to_vec();
    options.seed = seed;
    options
}

/// The sim.ron of a folder, or the file itself.
pub fn sim_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("sim.ron") } else { path.to_path_buf() }
}

/// Loads, compiles and places; prints every mistake and gives the exit code when there are any.
pub fn ready(path: &Path, set: &[String], seed: Option<u64>) -> Result<Ready, u8> {
    let catalogue = catalogue();
    finish(read(path, &options(&catalogue, set, seed))?, &catalogue)
}

/// Loads without compiling: no ground is made, no file but the texts is read.
pub fn loaded(path: &Path) -> Result<Loaded, u8> {
    let catalogue = catalogue();
    read(path, &options(&catalogue, &[], None))
}

fn read(path: &Path, options: &Options<'_>) -> Result<Loaded, u8> {
    let file = sim_file(path);
    if !file.exists() && !options.embedded.contains_key(&file.display().to_string()) {
        eprintln!(
            "error: there is no simulation `{}`\n  help: name a sim.ron file or the folder that holds it, \
             from the folder you are in",
            file.display()
        );
        return Err(exit::INPUT);
    }
    load_file(file, options).map_err(|failure| report(&failure))
}

/// The same from a resolved configuration (of a checkpoint).
pub fn ready_text(name: &str, text: &str) -> Result<Ready, u8> {
    let catalogue = catalogue();
    let options = options(&catalogue, &[], None);
    let loaded = load_text(name, text, &options).map_err(|failure| report(&failure))?;
    finish(loaded, &catalogue)
}

fn finish(loaded: Loaded, catalogue: &Catalogue) -> Result<Ready, u8> {
    let files = Files { folders: vec![PathBuf::from("."), PathBuf::from("assemblies")] };
    let faulty = |faults: Vec<Fault>, sources: &Sources| {
        report(&Failure { faults, sources: sources.clone() })
    };
    let mut plan = compile(&loaded.spec, catalogue, &files)
        .map_err(|faults| faulty(faults.0, &loaded.sources))?;
    if let Some(place) = &loaded.simulation.place {
        put_down(&mut plan, place).map_err(|fault| faulty(vec![fault], &loaded.sources))?;
    }
    Ok(Ready { loaded, plan })
}

/// Prints a failure to standard error: drawn on a terminal, in three plain lines elsewhere.
pub fn report(failure: &Failure) -> u8 {
    let no_color = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    let look = match (std::io::stderr().is_terminal(), no_color) {
        (false, _) => Look::Plain,
        (true, true) => Look::Drawn,
        (true, false) => Look::Coloured,
    };
    eprint!("{}", failure.show(look));
    exit::INPUT
}

/// A number with an optional unit, SI.
fn number(v: &Located) -> Option<f64> {
    match &v.value {
        Value::Number(x) => Some(*x),
        Value::Text(t) => {
            let (x, unit) = split_quantity(t)?;
            if unit.is_empty() {
                return Some(x);
            }
            Some(linkwork_runtime::Unit::parse(unit).ok()?.to_si(x))
        }
        _ => None,
    }
}

/// A list of numbers.
pub fn numbers(v: &Located) -> Option<Vec<f64>> {
    match &v.value {
        Value::List(items) => items.iter().map(number).collect(),
        _ => None,
    }
}

/// A list of texts, or one text.
pub fn texts(v: &Located) -> Option<Vec<String>> {
    match &v.value {
        Value::Text(t) => Some(vec![t.clone()]),
        Value::List(items) => items
            .iter()
            .map(|i| match &i.value {
                Value::Text(t) => Some(t.clone()),
                _ => None,
            })
            .collect(),
        _ => None,
    }
}

/// Refuses fields that are not known.
pub fn only(v: &Located, what: &str, known: &[&str]) -> Result<(), Fault> {
    let Value::Map(entries) = &v.value else {
        return Err(Fault::new(v.origin, format!("`{what}` is a map, this is {}", v.value.what())));
    };
    for (key, value) in entries {
        if !known.contains(&key.as_str()) {
            return Err(Fault::new(value.origin, format!("`{what}` has no field `{key}`"))
                .help(linkwork_runtime::remedy(key, "fields", known)));
        }
    }
    Ok(())
}

/// A field that must be there and be readable.
pub fn required<T>(
    v: &Located,
    what: &str,
    field: &str,
    read: impl Fn(&Located) -> Option<T>,
    form: &str,
) -> Result<T, Fault> {
    let at = v.get(field).ok_or_else(|| {
        Fault::new(v.origin, format!("`{what}` needs a field `{field}`"))
            .help(format!("write `{field}: {form}`"))
    })?;
    read(at).ok_or_else(|| {
        Fault::new(at.origin, format!("`{what}.{field}` is not {form}"))
            .help(format!("write `{field}: {form}`"))
    })
}

/// `place: (body, at, heading, wheels, radius, joints)`: names may hold `*`.
fn put_down(plan: &mut Plan, v: &Located) -> Result<f64, Fault> {
    only(v, "place", &["body", "at", "heading", "wheels", "radius", "joints", "terrain"])?;
    let mb = plan
        .mechanism
        .as_ref()
        .map(|m| m.multibody.clone())
        .ok_or_else(|| Fault::new(v.origin, "`place`: there are no bodies"))?;
    let names: Vec<&str> = mb.bodies().iter().map(|b| b.name()).collect();
    let expand = |patterns: Vec<String>, origin: Origin| -> Result<Vec<String>, Fault> {
        let mut out = Vec::new();
        for p in patterns {
            let found: Vec<String> = names
                .iter()
                .filter(|n| linkwork_assembly::path_matches(&dotted(&p), &dotted(n)))
                .map(|n| (*n).to_string())
                .collect();
            if found.is_empty() {
                return Err(Fault::new(origin, format!("`place`: `{p}` matches no body"))
                    .help(linkwork_runtime::remedy(&p, "bodies", &names)));
            }
            out.extend(found);
        }
        Ok(out)
    };
    let one = |v: &Located| texts(v).filter(|t| t.len() == 1).map(|t| t[0].clone());
    let body = required(v, "place", "body", one, "\"Rover/chassis\"")?;
    let at = required(v, "place", "at", numbers, "[x, y] in metres")?;
    let radius = required(v, "place", "radius", number, "the wheels' radius")?;
    let wheels = required(v, "place", "wheels", texts, "[\"Rover.Hardware.Wheels.*/wheel\"]")?;
    let joints = v.get("joints").and_then(texts).unwrap_or_default();
    let terrain = v.get("terrain").and_then(one);
    let handle: Handle<dyn Terrain> = plan
        .services
        .find(terrain.as_deref(), "")
        .map_err(|(m, h)| Fault::new(v.origin, format!("`place`: {m}")).help(h))?;
    if at.len() != 2 {
        return Err(Fault::new(v.origin, "`place.at` is [x, y]"));
    }
    let p = Placement {
        body,
        at: [at[0], at[1]],
        heading: v.get("heading").and_then(number).unwrap_or(0.0),
        wheels: expand(wheels, v.origin)?.into_iter().map(|w| (w, radius)).collect(),
        joints: expand(joints, v.origin)?,
    };
    place_on_terrain(plan, &*handle, &p)
        .map_err(|e| Fault::new(v.origin, format!("`place`: {}", e.message)).help(e.help))
}

/// `Rover.Wheels.Wheel1/wheel` with the slash as one more dot, for patterns.
pub fn dotted(path: &str) -> String {
    path.replace('/', ".")
}

/// Names of all variables that may be logged or plotted.
pub fn names(plan: &Plan) -> Vec<&str> {
    plan.variables.keys().map(String::as_str).collect()
}

/// The parameters of a part as resolved, by path.
pub fn params_of<'a>(plan: &'a Plan, path: &str) -> Option<&'a Value> {
    plan.parts.iter().find(|p| p.path == path).map(|p| p.prototype.params())
}

/// A map for metadata.
pub type About = BTreeMap<String, String>;
