//! Lines and jets in the `view` of a simulation file: patterns, resolved over all phases.
use crate::load::dotted;
use linkwork_assembly::Text;
use linkwork_assembly::form::{LineForm, PlumeForm};
use linkwork_assembly::patterns::path_matches;
use linkwork_plant::PlanExt;
use linkwork_runtime::{Fault, Origin, Plan, Program, remedy};
use linkwork_spatial::{Pose, Vec3};
use linkwork_viz::{End, Line, Plume};
use std::collections::BTreeMap;

/// Default colours of lines and jets.
const LINE: [u8; 4] = [240, 240, 235, 255];
const JET: [u8; 4] = [255, 170, 60, 230];

/// Nodes and bodies of all phases: the body and the pose on it; `None` if it differs between phases.
pub struct Places<'a>(BTreeMap<&'a str, Option<(&'a str, Pose)>>);

impl<'a> Places<'a> {
    pub fn new(program: &'a Program) -> Self {
        let mut all: BTreeMap<&str, Option<(&str, Pose)>> = BTreeMap::new();
        for plan in program.phases.iter().filter_map(|p| p.plan.mechanism()) {
            let m = &plan.multibody;
            let nodes = m.nodes().iter().map(|n| (n.name(), (m.get(n.body()).name(), n.pose())));
            let bodies = m.bodies().iter().map(|b| (b.name(), (b.name(), Pose::identity())));
            for (name, at) in nodes.chain(bodies) {
                let known = all.entry(name).or_insert(Some(at));
                if *known != Some(at) {
                    *known = None;
                }
            }
        }
        Places(all)
    }

    /// Returns the names that a pattern matches, with their bodies.
    fn find(&self, field: &str, p: &Text) -> Result<Vec<(&'a str, &'a str, Pose)>, Fault> {
        let matches = |name: &str| path_matches(&dotted(&p.text), &dotted(name));
        let found = self.0.iter().filter(|(name, _)| matches(name));
        let one = |(name, at): (&&'a str, &Option<(&'a str, Pose)>)| {
            let Some((body, pose)) = *at else {
                let fact = format!("`view`: {field}: the pose of `{name}` differs between phases");
                let help =
                    "use a node with the same pose in all phases, e.g. another node of the body";
                return Err(Fault::new(p.origin, fact).help(help));
            };
            Ok((*name, body, pose))
        };
        found.map(one).collect()
    }
}

/// Returns the variables that a pattern matches, in their order.
fn variables(field: &str, p: &Text, plan: &Plan) -> Result<Vec<String>, Fault> {
    let all = plan.variables.keys();
    let found: Vec<String> = all.filter(|k| path_matches(&p.text, k)).cloned().collect();
    if found.is_empty() {
        let known: Vec<&str> = plan.variables.keys().map(String::as_str).collect();
        let fact = format!("`view`: {field}: `{}` matches no variable", p.text);
        return Err(Fault::new(p.origin, fact).help(remedy(&p.text, "variables", &known)));
    }
    Ok(found)
}

/// Returns the points in W that a pattern matches: vectors of three variables.
fn vectors(p: &Text, plan: &Plan) -> Vec<String> {
    let stems = plan.variables.keys().filter_map(|k| k.strip_suffix(".x"));
    stems.filter(|k| path_matches(&p.text, k)).map(str::to_owned).collect()
}

/// Returns the k-th of several items, or the only one.
fn of<T>(all: &[T], k: usize) -> &T {
    if all.len() == 1 { &all[0] } else { &all[k] }
}

/// Returns an error unless each list has `n` items, or one.
fn pairs(what: &str, origin: Origin, n: usize, lists: &[(&str, usize)]) -> Result<(), Fault> {
    if lists.iter().all(|l| l.1 == n || l.1 == 1) {
        return Ok(());
    }
    let counts: Vec<String> = lists.iter().map(|(name, n)| format!("`{name}` {n}")).collect();
    let fact = format!("`view`: `{what}`: matches differ: {}", counts.join(", "));
    Err(Fault::new(origin, fact)
        .help("write patterns with equal numbers of matches, or with one match"))
}

fn name(path: &str) -> String {
    path.replace(['.', '/'], "_")
}

fn bytes(color: Option<[f64; 4]>, usual: [u8; 4]) -> [u8; 4] {
    color.map_or(usual, |c| c.map(|c| (255.0 * c) as u8))
}

/// Returns the lines of one entry.
pub fn lines(form: &LineForm, plan: &Plan, places: &Places<'_>) -> Result<Vec<Line>, Fault> {
    let ends = |field: &str, p: &Text| -> Result<Vec<(String, End)>, Fault> {
        let field = format!("`lines`: `{field}`");
        let on_bodies = places.find(&field, p)?;
        if !on_bodies.is_empty() {
            let end = |(name, body, at): (&str, &str, Pose)| {
                (name.to_owned(), End::Body { body: body.to_owned(), at: at.position })
            };
            return Ok(on_bodies.into_iter().map(end).collect());
        }
        let points = vectors(p, plan);
        if points.is_empty() {
            let known: Vec<&str> = places.0.keys().copied().collect();
            let fact = format!("`view`: {field}: `{}` matches no node, body or vector", p.text);
            return Err(Fault::new(p.origin, fact).help(remedy(&p.text, "names", &known)));
        }
        let end = |s: String| (s.clone(), End::Point(["x", "y", "z"].map(|c| format!("{s}.{c}"))));
        Ok(points.into_iter().map(end).collect())
    };
    let (from, to) = (ends("from", &form.from)?, ends("to", &form.to)?);
    let pull = form.pull.as_ref().map(|p| variables("`lines`: `pull`", p, plan)).transpose()?;
    let mut counts = vec![("from", from.len()), ("to", to.len())];
    counts.extend(pull.as_ref().map(|p| ("pull", p.len())));
    let n = from.len().max(to.len());
    pairs("lines", form.origin, n, &counts)?;
    let one = |k: usize| {
        let ((a, from), (b, to)) = (of(&from, k), of(&to, k));
        Line {
            path: format!("{}_to_{}", name(a), name(b)),
            ends: [from.clone(), to.clone()],
            pull: pull.as_ref().map(|p| of(p, k).clone()),
            color: bytes(form.color, LINE),
        }
    };
    Ok((0..n).map(one).collect())
}

/// Returns the jets of one entry.
pub fn plumes(form: &PlumeForm, plan: &Plan, places: &Places<'_>) -> Result<Vec<Plume>, Fault> {
    let at = places.find("`plumes`: `at`", &form.at)?;
    if at.is_empty() {
        let known: Vec<&str> = places.0.keys().copied().collect();
        let fact = format!("`view`: `plumes`: `at`: `{}` matches no node", form.at.text);
        return Err(Fault::new(form.at.origin, fact).help(remedy(&form.at.text, "nodes", &known)));
    }
    let by = variables("`plumes`: `by`", &form.by, plan)?;
    pairs("plumes", form.origin, at.len(), &[("at", at.len()), ("by", by.len())])?;
    let one = |(k, (node, body, pose)): (usize, &(&str, &str, Pose))| Plume {
        path: name(node),
        body: (*body).to_owned(),
        at: pose.position,
        along: pose.rotation * -Vec3::z(),
        by: of(&by, k).clone(),
        scale: form.scale,
        color: bytes(form.color, JET),
    };
    Ok(at.iter().enumerate().map(one).collect())
}
