//! Representations of a `Mechanism` and a `Simulation`: lines of text, and HTML tables for notebooks. Names in tables are escaped, so HTML in a file
//! is shown as text.
use crate::hinge::kind_name;
use linkwork_formats::{Description, escaped};
use linkwork_multibody::{Body, BodyId, Modes, Multibody};
use linkwork_runtime::{Plan, Seconds};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Largest number of indented levels of a tree.
const INDENTED: usize = 40;

/// Largest number of rows of a table; further rows are only counted.
const ROWS: usize = 200;

/// Returns the bodies depth first, each with the branch characters before its name.
fn branches(mbs: &Multibody) -> Vec<(String, BodyId)> {
    let mut children: BTreeMap<Option<BodyId>, Vec<BodyId>> = BTreeMap::new();
    for id in mbs.body_ids() {
        children.entry(mbs.get(id).parent()).or_default().push(id);
    }
    // The search is not recursive, because chains can have thousands of bodies.
    let below = |id| children.get(&id).map_or(&[][..], Vec::as_slice);
    let mut open: Vec<(BodyId, Vec<bool>)> = Vec::new();
    let push = |open: &mut Vec<(BodyId, Vec<bool>)>, of, above: &[bool]| {
        for (k, child) in below(of).iter().enumerate().rev() {
            open.push((*child, [above, &[k + 1 == below(of).len()]].concat()));
        }
    };
    push(&mut open, None, &[]);
    let mut rows = Vec::new();
    while let Some((id, last)) = open.pop() {
        let (own, above) = last.split_last().map_or((true, &[][..]), |(own, above)| (*own, above));
        // Deeper levels are not indented further.
        let above = above.iter().take(INDENTED).map(|l| if *l { "   " } else { "│  " });
        let branch: String = above.chain([if own { "└─ " } else { "├─ " }]).collect();
        rows.push((branch, id));
        push(&mut open, Some(id), &last);
    }
    rows
}

/// Returns the kinds of a hinge: "pin", "slider + pin"; "fixed" without coordinates.
fn hinge(body: &Body) -> String {
    let kinds: Vec<&str> = body.subhinges().iter().map(|s| kind_name(&s.subhinge.kind)).collect();
    if body.v().is_empty() { "fixed".into() } else { kinds.join(" + ") }
}

/// Returns the mass of a body, including its modes, kg.
fn mass(body: &Body) -> f64 {
    body.inertia().mass() + body.modes().map_or(0.0, Modes::mass)
}

/// Returns a mechanism as a text tree: body, hinge and modes with their indices in q and v, mass.
pub fn tree(mbs: &Multibody) -> String {
    let (bodies, total) = (mbs.bodies().len(), number(mbs.total_mass()));
    let mut out = format!("{bodies} bodies, nq={}, nv={}, {total} kg\nworld", mbs.nq(), mbs.nv());
    for (branch, id) in branches(mbs) {
        let body = mbs.get(id);
        let _ = write!(out, "\n{branch}{}  {}", body.name(), hinge(body));
        if !body.v().is_empty() {
            let (q, v) = (body.q(), body.v());
            let _ = write!(out, "  q[{}:{}] v[{}:{}]", q.start, q.end, v.start, v.end);
        }
        if body.modes().is_some() {
            let (n, q, v) = (body.modes_q().len(), body.modes_q(), body.modes_v());
            let _ = write!(out, "  {n} modes  q[{}:{}] v[{}:{}]", q.start, q.end, v.start, v.end);
        }
        let _ = write!(out, "  {} kg", number(mass(body)));
    }
    out
}

/// Returns a mechanism as an HTML table: tree of bodies, joints of the file, hinges, indices in q and v, masses.
pub fn mechanism(mbs: &Multibody, description: Option<&Description>) -> String {
    let joints = description.map_or(&[][..], |d| &d.joints);
    let rows = branches(mbs);
    let rows = rows.iter().map(|(branch, id)| {
        let body = mbs.get(*id);
        let own = joints.iter().filter(|j| j.body == body.name()).map(|j| j.name.as_str());
        let place = |r: std::ops::Range<usize>| match r.len() {
            0 => String::new(),
            1 => r.start.to_string(),
            _ => format!("{}:{}", r.start, r.end),
        };
        let tree =
            format!("<code style=\"white-space: pre\">{branch}</code>{}", escaped(body.name()));
        let (mut kind, mut q, mut v) = (hinge(body), place(body.q()), place(body.v()));
        if body.modes().is_some() {
            let _ = write!(kind, " + {} modes", body.modes_q().len());
            (q, v) = (
                place(body.q().start..body.modes_q().end),
                place(body.v().start..body.modes_v().end),
            );
        }
        let mut cells = vec![tree, escaped(&kind), q, v, number(mass(body))];
        if !joints.is_empty() {
            cells.insert(1, escaped(&own.collect::<Vec<_>>().join(", ")));
        }
        cells
    });
    let mut heads = vec!["body", "hinge", "q", "v", "mass [kg]"];
    if !joints.is_empty() {
        heads.insert(1, "joint");
    }
    let names: Vec<&str> = mbs.constraints().map(|c| mbs.constraint_name(c)).collect();
    let loops = match names[..] {
        [] => String::new(),
        _ => format!("; loops and couplings: {}", names.join(", ")),
    };
    let about = format!(
        "{} bodies, nq = {}, nv = {}, {} kg{loops}",
        mbs.bodies().len(),
        mbs.nq(),
        mbs.nv(),
        number(mbs.total_mass())
    );
    table("Mechanism", &about, &heads, rows)
}

/// Returns a simulation as an HTML table: parts with their models and rates.
pub fn simulation(plan: &Plan, time: f64, until: Option<Seconds>, phase: &str) -> String {
    let end = until.map_or(String::new(), |u| format!(" of {} s", u.seconds()));
    let phase = if phase.is_empty() { String::new() } else { format!(", phase {phase}") };
    let about = format!(
        "t = {time} s{end}{phase}, step {}, seed {}, {} variables",
        period(plan.step),
        plan.seed,
        plan.lanes.len()
    );
    let rows = plan.parts.iter().map(|p| {
        let model = &p.prototype.description().name;
        let rate = p.rate.map_or("continuous".into(), period);
        vec![escaped(&p.path), escaped(model), rate]
    });
    table("Simulation", &about, &["part", "model", "rate"], rows)
}

/// Formats a number with at most six decimal places.
pub fn number(x: f64) -> String {
    let text = format!("{x:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

/// Formats a period: "1 ms", "20 ms (50 Hz)".
fn period(p: Seconds) -> String {
    let s = p.seconds();
    let text = if s < 1.0 { format!("{} ms", 1e3 * s) } else { format!("{s} s") };
    if p.num == 1 && p.den > 1 { format!("{text} ({} Hz)", p.den) } else { text }
}

fn table(
    name: &str,
    about: &str,
    heads: &[&str],
    rows: impl ExactSizeIterator<Item = Vec<String>>,
) -> String {
    let more = rows.len().saturating_sub(ROWS);
    let mut out = format!("<div><b>{name}</b> {}</div><table><thead><tr>", escaped(about));
    let cell = |out: &mut String, kind: &str, text: &str| {
        let _ = write!(out, "<{kind} style=\"text-align: left\">{text}</{kind}>");
    };
    heads.iter().for_each(|h| cell(&mut out, "th", h));
    out += "</tr></thead><tbody>";
    for row in rows.take(ROWS) {
        out += "<tr>";
        row.iter().for_each(|text| cell(&mut out, "td", text));
        out += "</tr>\n";
    }
    out += "</tbody></table>";
    if more > 0 {
        let _ = write!(out, "<div>and {more} more</div>");
    }
    out
}
