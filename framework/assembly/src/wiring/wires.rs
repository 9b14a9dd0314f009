//! Wires and exports: relative paths, exports of nested assemblies, `[*]` over arrays and components, groups of ports.
use crate::expand::instance::{Instance, ModelInst, Node};
use crate::form::wire::WireText;
use crate::text::report::Cx;
use crate::text::value::{Text, outer};
use linkwork_runtime::{
    Catalogue, Description, PortRef, PortSpec, WireSpec, WireTiming, did_you_mean, remedy,
};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// One segment: `Motor`, `Wheel[*]`, `rate[2]`.
#[derive(Clone, Debug, PartialEq)]
struct Segment {
    name: String,
    index: Option<Index>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Index {
    All,
    At(usize),
}

/// Target of one end of a wire.
#[derive(Clone, Default)]
struct End {
    /// A port, with an empty name here, or the ports of a group by their names in it.
    ports: Vec<(String, PortRef)>,
    /// Index for `[*]` in the names of ports.
    element: Option<usize>,
}

impl End {
    fn of(port: PortRef) -> End {
        End { ports: vec![(String::new(), port)], element: None }
    }
    /// Returns the port, if it is one and not a group.
    fn port(&self) -> Option<&PortRef> {
        match &self.ports[..] {
            [(name, port)] if name.is_empty() => Some(port),
            _ => None,
        }
    }
    /// Returns the names within a group.
    fn list(&self) -> String {
        self.ports.iter().map(|(n, _)| n.as_str()).collect::<Vec<_>>().join(", ")
    }
}

/// Returns `rate` of `wheels[2].rate` under `wheels[2]`.
fn within<'n>(name: &'n str, group: &str) -> Option<&'n str> {
    name.strip_prefix(group)?.strip_prefix('.')
}

/// Fact and remedy of an error; an empty fact means that the error has already been reported.
pub(super) type Problem = (String, String);

fn segments(text: &str) -> Result<Vec<Segment>, Problem> {
    let help = "write an end of a wire as `Part.port`, `Part.port[2]` or `Array[*].port`";
    let refuse = |why: String| (why, help.to_string());
    let mut out = Vec::new();
    for piece in text.split('.') {
        let (name, index) = match piece.split_once('[') {
            None => (piece, None),
            Some((name, rest)) => {
                let inner = rest
                    .strip_suffix(']')
                    .ok_or_else(|| refuse(format!("`{piece}` lacks a closing `]`")))?;
                let index = match inner {
                    "*" => Index::All,
                    digits => Index::At(digits.parse().map_err(|_| {
                        refuse(format!("`[{digits}]` is neither a number nor `*`"))
                    })?),
                };
                (name, Some(index))
            }
        };
        if name.is_empty() || name.contains(char::is_whitespace) {
            return Err(refuse(format!("`{text}` is not the path of a port")));
        }
        out.push(Segment { name: name.into(), index });
    }
    if out.len() < 2 {
        return Err(refuse(format!("`{text}` is not a port of a part")));
    }
    Ok(out)
}

/// Resolves the wires and exports of a tree.
pub(crate) struct Wiring<'a> {
    pub root: &'a Instance,
    pub catalogue: &'a Catalogue,
    /// Locations of the files that determine the ports of a part.
    pub files: linkwork_runtime::Files,
    /// Path of the mechanism, whose variables `compile` resolves.
    pub mechanism: &'a str,
    /// Cache of the ports of parts by their paths.
    pub found: RefCell<BTreeMap<&'a str, Option<Arc<Description>>>>,
}

impl<'a> Wiring<'a> {
    /// All wires, in canonical order.
    pub fn wires(&self, cx: &mut Cx) -> Vec<WireSpec> {
        let mut instances = Vec::new();
        self.root.walk(&mut instances);
        let mut out = Vec::new();
        for instance in &instances {
            for WireText { text: wire, timing } in &instance.wires {
                match self.wire(instance, wire, timing) {
                    Ok(found) => out.extend(found),
                    Err((fact, _)) if fact.is_empty() => {}
                    Err((fact, help)) => {
                        cx.fault(wire.origin, format!("wire `{}`: {fact}", wire.text), help);
                    }
                }
            }
            for (name, target) in &instance.exports {
                if let Err((fact, help)) = self.export(instance, name)
                    && !fact.is_empty()
                {
                    let message = format!("export `{name}: \"{}\"`: {fact}", target.text);
                    cx.fault(target.origin, message, help);
                }
            }
        }
        out.extend(self.connections(&instances, cx));
        out.sort_by_cached_key(|w: &WireSpec| (w.to.to_string(), w.from.to_string()));
        out
    }

    /// Returns the ports of one direction of the connectors at a path, each with its name inside its connector.
    pub(super) fn group(
        &self,
        scope: &'a Instance,
        path: &str,
        output: bool,
    ) -> Result<Vec<(String, PortRef)>, Problem> {
        let ends = self.end(scope, path, output)?;
        let groups = ends.into_iter().filter(|end| end.port().is_none());
        Ok(groups.flat_map(|end| end.ports).collect())
    }

    /// Returns the remedy for the name of a connector that does not exist.
    pub(super) fn connectors_beside(&self, scope: &'a Instance, end: &str) -> String {
        let usual = "`linkwork describe MODEL` lists the connectors of a model";
        let Ok(ends) = self.end(scope, end, true) else { return usual.into() };
        let Some(part) = ends.iter().find_map(|e| Some(&e.ports.first()?.1.part)) else {
            return usual.into();
        };
        let Some(Node::Model(model)) = self.node(part) else { return usual.into() };
        let Some(ports) = self.ports(model) else { return usual.into() };
        let all = ports.all_inputs().chain(ports.all_outputs());
        let mut names: Vec<&str> = all.filter_map(|p| p.connector.as_deref()).collect();
        names.sort_unstable();
        names.dedup();
        match names.is_empty() {
            true => format!("`{part}` has no connectors: connect its ports by `wires`"),
            false => format!("connectors of `{part}`: {}", names.join(", ")),
        }
    }

    /// Returns whether an input is the sum of several wires.
    pub(super) fn takes_sum(&self, input: &PortRef) -> bool {
        let Some(Node::Model(m)) = self.node(&input.part) else { return false };
        let Some(d) = self.ports(m) else { return false };
        d.all_inputs().any(|p| p.name == input.port && p.sum)
    }

    fn wire(
        &self,
        scope: &'a Instance,
        wire: &Text,
        timing: &WireTiming,
    ) -> Result<Vec<WireSpec>, Problem> {
        let ends: Vec<&str> = wire.text.split("->").map(str::trim).collect();
        let [from, to] = ends.as_slice() else {
            return Err((
                "a wire must have one `->`".into(),
                "write \"Part.output -> Part.input\"".into(),
            ));
        };
        let (left, right) = (*from, *to);
        let mut from = self.end(scope, left, true)?;
        let mut to = self.end(scope, right, false)?;
        let elements =
            |ends: &[End]| ends.iter().map(|e| e.element).collect::<Option<Vec<usize>>>();
        if let (Some(a), Some(b)) = (elements(&from), elements(&to))
            && a != b
        {
            let fact = format!("`{left}` has the elements {a:?}, but `{right}` has {b:?}");
            return Err((fact, "connect them one by one, or use the same elements".into()));
        }
        match (from.len(), to.len()) {
            (a, b) if a == b => {}
            (1, n) => from = vec![from[0].clone(); n],
            (n, 1) => to = vec![to[0].clone(); n],
            (a, b) => {
                let fact = format!("`[*]` is {a} on the left but {b} on the right");
                return Err((
                    fact,
                    "use equal numbers on both sides, or a single port on one side".into(),
                ));
            }
        }
        let mut out = Vec::new();
        for (from, to) in from.into_iter().zip(to) {
            let absent =
                |end: &End, output: bool| end.port().is_some_and(|p| !self.exists(p, output));
            let pairs = match absent(&from, true) || absent(&to, false) {
                // `compile` reports mistakes here, because it has all wires.
                true => vec![(from.ports[0].1.clone(), to.ports[0].1.clone())],
                false => members((left, from), (right, to))?,
            };
            out.extend(pairs.into_iter().map(|(from, to)| {
                let (timing, text) = (timing.clone(), wire.text.clone());
                WireSpec { from, to, timing, text, origin: wire.origin }
            }));
        }
        Ok(out)
    }

    /// Returns the ports of one end, resolved in a scope and then in the surrounding ones.
    fn end(&self, scope: &'a Instance, text: &str, output: bool) -> Result<Vec<End>, Problem> {
        let path = segments(text)?;
        let first = path[0].name.as_str();
        let mut here = scope;
        loop {
            let known = here.parts.contains_key(first) || here.arrays.contains_key(first);
            if known || here.broken.contains(first) {
                return self.down(here, &path, output);
            }
            if here.path.is_empty() {
                break;
            }
            here = self.root.at(outer(&here.path)).unwrap_or(self.root);
        }
        // `compile` resolves variables of the mechanism (`Rover/chassis.angle`).
        if first == self.mechanism || first.contains('/') {
            let (_, port) = text.split_once('.').unwrap_or(("", text));
            return Ok(vec![End::of(PortRef {
                part: first.into(),
                port: port.into(),
                index: None,
            })]);
        }
        let known: Vec<&str> =
            scope.parts.keys().chain(scope.arrays.keys()).map(String::as_str).collect();
        Err((format!("there is no part `{first}` here"), remedy(first, "parts", &known)))
    }

    /// Follows a path downward from an instance.
    fn down(
        &self,
        here: &'a Instance,
        path: &[Segment],
        output: bool,
    ) -> Result<Vec<End>, Problem> {
        let (first, rest) = (&path[0], &path[1..]);
        if let Some(index) = first.index {
            let Some(names) = here.arrays.get(&first.name) else {
                let known: Vec<&str> = here.arrays.keys().map(String::as_str).collect();
                let fact = format!("`{}` is not an array", first.name);
                return Err((fact, remedy(&first.name, "arrays", &known)));
            };
            let names: Vec<&String> = match index {
                Index::All => names.iter().collect(),
                Index::At(_) => {
                    let fact = format!("`{}` is an array of parts, not of components", first.name);
                    return Err((fact, format!("write the element: {}", names.join(", "))));
                }
            };
            let mut out = Vec::new();
            for name in names {
                let Some(node) = here.parts.get(name) else { return Err(Problem::default()) };
                out.extend(self.below(node, rest, output)?);
            }
            return Ok(out);
        }
        match here.parts.get(&first.name) {
            None if here.broken.contains(&first.name) => Err(Problem::default()),
            Some(node) => self.below(node, rest, output),
            None if here.arrays.contains_key(&first.name) => {
                let names = here.arrays[&first.name].join(", ");
                let fact = format!("`{}` is an array of parts", first.name);
                Err((fact, format!("write `{}[*]`, or one of: {names}", first.name)))
            }
            None => {
                let known: Vec<&str> = here.parts.keys().map(String::as_str).collect();
                let fact = format!("`{}` has no part `{}`", here.path, first.name);
                Err((fact, remedy(&first.name, "parts", &known)))
            }
        }
    }

    fn below(&self, node: &'a Node, rest: &[Segment], output: bool) -> Result<Vec<End>, Problem> {
        match node {
            Node::Model(m) => self.port(m, rest, output),
            Node::Assembly(inner) => match rest {
                [] => Err((format!("`{}` is an assembly", inner.path), exports_help(inner, ""))),
                [first, _, ..]
                    if inner.parts.contains_key(&first.name)
                        || inner.arrays.contains_key(&first.name)
                        || inner.broken.contains(&first.name) =>
                {
                    self.down(inner, rest, output)
                }
                path => self.exported(inner, path, output),
            },
        }
    }

    /// Returns the target of an export: a port, a component or member of it (`pose.x`), or all exports that begin with the name (`drive` for
    /// `drive.rate` and `drive.brake`).
    fn exported(
        &self,
        inner: &'a Instance,
        path: &[Segment],
        output: bool,
    ) -> Result<Vec<End>, Problem> {
        let name = |n: usize| {
            let names: Vec<&str> = path[..n].iter().map(|s| s.name.as_str()).collect();
            names.join(".")
        };
        if inner.broken.contains(&path[0].name) {
            return Err(Problem::default());
        }
        let indexed = |of: &[Segment]| {
            let (name, index) = of.iter().find_map(|s| Some((&s.name, s.index?)))?;
            let index = match index {
                Index::All => "*".to_string(),
                Index::At(k) => k.to_string(),
            };
            let fact = format!("`{name}[{index}]`: `{name}` is a group of exports, not an array");
            Some((fact, "remove the index, or move it to the port".to_string()))
        };
        let longest = (1..=path.len()).rev().find(|n| inner.exports.contains_key(&name(*n)));
        let Some(n) = longest else {
            let group = name(path.len());
            let mut end = End::default();
            for export in inner.exports.keys() {
                let Some(member) = within(export, &group) else { continue };
                let names: Vec<Segment> =
                    export.split('.').map(|s| Segment { name: s.into(), index: None }).collect();
                let mut found = self.exported(inner, &names, output)?;
                let (Some(one), true) = (found.pop(), found.is_empty()) else {
                    let fact =
                        format!("export `{export}` of the group `{group}` has several ports");
                    return Err((fact, "export one port by each name of a group".into()));
                };
                end.ports.extend(one.ports.into_iter().map(|(deeper, port)| {
                    let dot = if deeper.is_empty() { "" } else { "." };
                    (format!("{member}{dot}{deeper}"), port)
                }));
            }
            if !end.ports.is_empty() {
                return match indexed(path) {
                    Some(problem) => Err(problem),
                    None => Ok(vec![end]),
                };
            }
            let grouped = inner.exports.keys().any(|e| within(e, &path[0].name).is_some());
            if path.len() > 1 && !grouped {
                let known: Vec<&str> = inner.parts.keys().map(String::as_str).collect();
                let name = &path[0].name;
                let fact = format!("`{}` has no part `{name}`", inner.path);
                return Err((fact, remedy(name, "parts", &known)));
            }
            match inner.parts.get(&group) {
                Some(Node::Assembly(i)) => {
                    let help = format!("add a port: {}", exports_help(i, ""));
                    return Err((format!("`{}` is an assembly, not a port", i.path), help));
                }
                Some(Node::Model(m)) => return self.port(m, &[], output),
                None => {}
            }
            let fact = format!("`{}` does not export `{group}`", inner.path);
            return Err((fact, exports_help(inner, &group)));
        };
        if let Some(problem) = indexed(&path[..n - 1]) {
            return Err(problem);
        }
        let (export, rest) = (name(n), &path[n..]);
        let target = &inner.exports[&export];
        let mut inward = segments(&target.text)?;
        if let (Some(last), Some(index)) = (inward.last_mut(), path[n - 1].index) {
            if last.index.is_some() {
                let fact = format!(
                    "export `{export}` is `{}`, which is already one component",
                    target.text
                );
                return Err((fact, "remove the index".into()));
            }
            last.index = Some(index);
        }
        inward.extend_from_slice(rest);
        // This terminates because exports refer only to inner instances.
        self.down(inner, &inward, output)
    }

    /// Checks that an export reaches a port of a model.
    fn export(&self, inner: &'a Instance, name: &str) -> Result<(), Problem> {
        if let Some((first, _)) = name.split_once('.') {
            let outer = inner.exports.keys().find(|other| within(name, other).is_some());
            let fact = match outer {
                Some(outer) => format!("there is also an export `{outer}`"),
                None if inner.parts.contains_key(first) || inner.arrays.contains_key(first) => {
                    format!("there is also a part `{first}`")
                }
                None => String::new(),
            };
            if !fact.is_empty() {
                return Err((fact, "rename the group".into()));
            }
        }
        let path: Vec<Segment> =
            name.split('.').map(|s| Segment { name: s.into(), index: None }).collect();
        let ends = self.exported(inner, &path, true)?;
        for (_, end) in ends.into_iter().flat_map(|end| end.ports) {
            let Some(Node::Model(m)) = self.node(&end.part) else { continue };
            let Some(d) = self.ports(m) else { continue };
            let ports: Vec<&PortSpec> = d.all_inputs().chain(d.all_outputs()).collect();
            let is = |output: bool| self.exists(&end, output);
            if !is(true)
                && !is(false)
                && !ports.iter().any(|p| within(&p.name, &end.port).is_some())
            {
                let known: Vec<&str> = ports.iter().map(|p| &*p.name).collect();
                let port = end.port.split('.').next().unwrap_or(&end.port);
                let fact = format!("`{}` ({}) has no port `{port}`", end.part, m.model.text);
                return Err((fact, remedy(port, "ports", &known)));
            }
        }
        Ok(())
    }

    fn node(&self, path: &str) -> Option<&'a Node> {
        let (head, name) = path.rsplit_once('.').unwrap_or(("", path));
        self.root.at(head)?.parts.get(name)
    }

    /// Returns whether a port may exist: false if its model is known and does not have it.
    fn exists(&self, end: &PortRef, output: bool) -> bool {
        let Some(Node::Model(m)) = self.node(&end.part) else { return true };
        let Some(d) = self.ports(m) else { return true };
        let is = |p: &PortSpec| p.name == end.port || within(&end.port, &p.name).is_some();
        if output { d.all_outputs().any(is) } else { d.all_inputs().any(is) }
    }

    /// Returns the ports of a part; `None` if its model is not in the catalogue, or its parameters do not determine them.
    fn ports(&self, m: &'a ModelInst) -> Option<Arc<Description>> {
        let find = || {
            let files = self.files.first(m.folder.as_deref());
            self.catalogue.get(&m.model.text)?.describe(&m.params, &files)
        };
        self.found.borrow_mut().entry(&m.path).or_insert_with(find).clone()
    }

    fn port(&self, m: &'a ModelInst, rest: &[Segment], output: bool) -> Result<Vec<End>, Problem> {
        let part = &m.path;
        let described = self.ports(m);
        let ports: Option<Vec<&PortSpec>> = described.as_deref().map(|d| match output {
            true => d.all_outputs().collect(),
            false => d.all_inputs().collect(),
        });
        let Some(last) = rest.last() else {
            let ports = ports.unwrap_or_default();
            let known: Vec<&str> = ports.iter().map(|p| &*p.name).collect();
            let kind = if output { "outputs" } else { "inputs" };
            let help = format!("add a port: {}", remedy("", kind, &known));
            return Err((format!("`{part}` is a part, not a port"), help));
        };
        let one =
            |port: &str, index| End::of(PortRef { part: part.clone(), port: port.into(), index });
        let (bare, written) = (joined(rest, false), joined(rest, true));
        // `compile` reports models and ports that do not exist.
        let lane = match last.index {
            Some(Index::At(k)) => Some(k),
            _ => None,
        };
        let Some(ports) = ports else { return Ok(vec![one(&bare, lane)]) };
        // The last index selects a component of a port.
        let plain = rest[..rest.len() - 1].iter().all(|s| s.index.is_none());
        if plain && let Some(spec) = ports.iter().find(|p| p.name == bare) {
            let Some(Index::All) = last.index else { return Ok(vec![one(&bare, lane)]) };
            let lanes = spec.lane_names();
            let lane = |(k, (suffix, _)): (usize, &(String, _))| match suffix.strip_prefix('.') {
                Some(word) => one(&format!("{bare}.{word}"), None),
                None if suffix.is_empty() => one(&bare, None),
                None => one(&bare, Some(k)),
            };
            return Ok(lanes.iter().enumerate().map(lane).collect());
        }
        // Ports can have indices in their names (`wheels[2].rate`). Such a name can also contain `[*]`, or
        // name a group of ports (`wheels[2]`).
        let Some((before, after)) = written.split_once("[*]") else {
            return Ok(vec![named(&ports, part, &written).unwrap_or_else(|| match plain {
                true => one(&bare, lane),
                false => one(&written, None),
            })]);
        };
        if after.contains("[*]") {
            let fact = format!("`{written}` has more than one `[*]`");
            return Err((fact, "write one wire per element of one of them".into()));
        }
        let element = |p: &&PortSpec| {
            let (k, _) = p.name.strip_prefix(before)?.strip_prefix('[')?.split_once(']')?;
            k.parse::<usize>().ok()
        };
        let elements: BTreeSet<usize> = ports.iter().filter_map(element).collect();
        let name = |k: usize| format!("{before}[{k}]{after}");
        let element = |k: usize| Some(End { element: Some(k), ..named(&ports, part, &name(k))? });
        let found: Vec<End> = elements.into_iter().filter_map(element).collect();
        if !found.is_empty() {
            return Ok(found);
        }
        if plain {
            return Ok(vec![one(&bare, None)]);
        }
        let known: Vec<&str> = ports.iter().map(|p| &*p.name).collect();
        Err((format!("`{part}` has no port `{}`", name(0)), remedy(&name(0), "ports", &known)))
    }
}

/// Joins segments to a name, with or without the index of the last one.
fn joined(path: &[Segment], whole: bool) -> String {
    let each = path.iter().enumerate().map(|(i, s)| match s.index {
        Some(Index::At(k)) if whole || i + 1 < path.len() => format!("{}[{k}]", s.name),
        Some(Index::All) if whole || i + 1 < path.len() => format!("{}[*]", s.name),
        _ => s.name.clone(),
    });
    each.collect::<Vec<_>>().join(".")
}

/// Returns the port with exactly this name, or a component of it, or the ports of the group.
fn named(ports: &[&PortSpec], part: &str, name: &str) -> Option<End> {
    let one = |port: &str| PortRef { part: part.into(), port: port.into(), index: None };
    if ports.iter().any(|p| p.name == name || within(name, &p.name).is_some()) {
        return Some(End::of(one(name)));
    }
    let member = |p: &&PortSpec| Some((within(&p.name, name)?.to_string(), one(&p.name)));
    let members: Vec<_> = ports.iter().filter_map(member).collect();
    (!members.is_empty()).then_some(End { ports: members, element: None })
}

/// Returns the wires between two ends: one port each, or two groups with the same ports.
fn members(
    (left, from): (&str, End),
    (right, to): (&str, End),
) -> Result<Vec<(PortRef, PortRef)>, Problem> {
    match (from.port().is_some(), to.port().is_some()) {
        (true, true) => {}
        (false, false) => {
            let lacks = |of: &End, other: &End| {
                let mut there = of.ports.iter();
                let found = there.find(|(n, _)| other.ports.iter().all(|(m, _)| m != n));
                found.map(|(name, _)| name.clone())
            };
            for (name, has, none, ends) in
                [(lacks(&from, &to), left, right, &to), (lacks(&to, &from), right, left, &from)]
            {
                let Some(name) = name else { continue };
                let fact = format!("`{has}` has `{name}`, but `{none}` has only {}", ends.list());
                let help =
                    "one wire connects groups with the same ports; here each port needs a wire";
                return Err((fact, help.into()));
            }
        }
        (single, _) => {
            let (group, end, port) = match single {
                true => (right, &to, left),
                false => (left, &from, right),
            };
            let fact =
                format!("`{group}` is a group of ports ({}), but `{port}` is one port", end.list());
            return Err((fact, format!("write one of them: `{group}.{}`", end.ports[0].0)));
        }
    }
    let mut to: BTreeMap<String, PortRef> = to.ports.into_iter().collect();
    Ok(from.ports.into_iter().filter_map(|(name, from)| Some((from, to.remove(&name)?))).collect())
}

fn exports_help(inner: &Instance, name: &str) -> String {
    let known: Vec<&str> = inner.exports.keys().map(String::as_str).collect();
    let mut help = remedy(name, "exports", &known);
    if let Some(guess) = did_you_mean(name, inner.parts.keys().map(String::as_str))
        && known.is_empty()
    {
        help.push_str(&format!("; to connect to an inner part, write the whole path ({guess})"));
    }
    help
}
