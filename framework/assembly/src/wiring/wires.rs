//! Wires and exports: relative paths, exports of nested assemblies, `[*]` over arrays and lanes.
use crate::expand::instance::{Instance, ModelInst, Node};
use crate::form::wire::WireText;
use crate::text::report::Cx;
use crate::text::value::{Text, outer};
use linkwork_runtime::{
    Catalogue, Description, PortRef, PortSpec, WireSpec, WireTiming, did_you_mean, remedy,
};
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

/// Fact and remedy; an empty fact is one that has been reported elsewhere.
type Problem = (String, String);

fn segments(text: &str) -> Result<Vec<Segment>, Problem> {
    let help = "an end of a wire is `Part.port`, `Part.port[2]`, `Array[*].port`";
    let refuse = |why: String| (why, help.to_string());
    let mut out = Vec::new();
    for piece in text.split('.') {
        let (name, index) = match piece.split_once('[') {
            None => (piece, None),
            Some((name, rest)) => {
                let inner = rest
                    .strip_suffix(']')
                    .ok_or_else(|| refuse(format!("`{piece}` has no closing `]`")))?;
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
        return Err(refuse(format!("`{text}` names no port of a part")));
    }
    Ok(out)
}

/// Resolves the wires and exports of a tree.
pub(crate) struct Wiring<'a> {
    pub root: &'a Instance,
    pub catalogue: &'a Catalogue,
    /// Where files are that tell the ports of a part.
    pub files: linkwork_runtime::Files,
    /// Path of the mechanism: its variables are left to `compile`.
    pub mechanism: &'a str,
}

impl Wiring<'_> {
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
        out.sort_by_cached_key(|w: &WireSpec| (w.to.to_string(), w.from.to_string()));
        out
    }

    fn wire(
        &self,
        scope: &Instance,
        wire: &Text,
        timing: &WireTiming,
    ) -> Result<Vec<WireSpec>, Problem> {
        let ends: Vec<&str> = wire.text.split("->").map(str::trim).collect();
        let [from, to] = ends.as_slice() else {
            return Err((
                "a wire has one `->`".into(),
                "write \"Part.output -> Part.input\"".into(),
            ));
        };
        let mut from = self.end(scope, from, true)?;
        let mut to = self.end(scope, to, false)?;
        match (from.len(), to.len()) {
            (a, b) if a == b => {}
            (1, n) => from = vec![from[0].clone(); n],
            (n, 1) => to = vec![to[0].clone(); n],
            (a, b) => {
                let fact = format!("`[*]` is {a} on the left but {b} on the right");
                return Err((fact, "make both sides equally long, or one side single".into()));
            }
        }
        let text = || wire.text.clone();
        let each = from.into_iter().zip(to);
        Ok(each
            .map(|(from, to)| WireSpec {
                from,
                to,
                timing: timing.clone(),
                text: text(),
                origin: wire.origin,
            })
            .collect())
    }

    /// The ports that one end names, seen from a scope and then from those around it.
    fn end(&self, scope: &Instance, text: &str, output: bool) -> Result<Vec<PortRef>, Problem> {
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
        // A variable of the mechanism (`Rover/chassis.angle`) is for `compile` to know.
        if first == self.mechanism || first.contains('/') {
            let (_, port) = text.split_once('.').unwrap_or(("", text));
            return Ok(vec![PortRef { part: first.into(), port: port.into(), index: None }]);
        }
        let known: Vec<&str> =
            scope.parts.keys().chain(scope.arrays.keys()).map(String::as_str).collect();
        Err((format!("there is no part `{first}` here"), remedy(first, "parts", &known)))
    }

    /// Follows a path downwards from an instance.
    fn down(
        &self,
        here: &Instance,
        path: &[Segment],
        output: bool,
    ) -> Result<Vec<PortRef>, Problem> {
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
                    let fact = format!("`{}` is an array of parts, not of lanes", first.name);
                    return Err((fact, format!("name the element: {}", names.join(", "))));
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

    fn below(&self, node: &Node, rest: &[Segment], output: bool) -> Result<Vec<PortRef>, Problem> {
        match node {
            Node::Model(m) => self.port(m, rest, output),
            Node::Assembly(inner) => match rest {
                [port] => self.exported(inner, port, output),
                [] => Err((format!("`{}` is an assembly", inner.path), exports_help(inner, ""))),
                longer => {
                    // An export's lane with a name (`pose.x`), or a part further down.
                    if inner.parts.contains_key(&longer[0].name)
                        || inner.arrays.contains_key(&longer[0].name)
                        || inner.broken.contains(&longer[0].name)
                    {
                        return self.down(inner, longer, output);
                    }
                    if inner.exports.contains_key(&longer[0].name) {
                        let mut out = self.exported(inner, &longer[0], output)?;
                        for end in &mut out {
                            for more in &longer[1..] {
                                end.port = format!("{}.{}", end.port, more.name);
                            }
                        }
                        return Ok(out);
                    }
                    let known: Vec<&str> = inner.parts.keys().map(String::as_str).collect();
                    let name = &longer[0].name;
                    Err((
                        format!("`{}` has no part `{name}`", inner.path),
                        remedy(name, "parts", &known),
                    ))
                }
            },
        }
    }

    fn exported(
        &self,
        inner: &Instance,
        port: &Segment,
        output: bool,
    ) -> Result<Vec<PortRef>, Problem> {
        if inner.broken.contains(&port.name) {
            return Err(Problem::default());
        }
        let Some(target) = inner.exports.get(&port.name) else {
            match inner.parts.get(&port.name) {
                Some(Node::Assembly(i)) => {
                    let help = format!("add a port: {}", exports_help(i, ""));
                    return Err((format!("`{}` is an assembly, not a port", i.path), help));
                }
                Some(Node::Model(m)) => return self.port(m, &[], output),
                None => {}
            }
            let fact = format!("`{}` exports no `{}`", inner.path, port.name);
            return Err((fact, exports_help(inner, &port.name)));
        };
        let mut path = segments(&target.text)?;
        if let (Some(last), Some(index)) = (path.last_mut(), port.index) {
            if last.index.is_some() {
                let fact = format!("export `{}` is `{}`: one lane already", port.name, target.text);
                return Err((fact, "leave the index out".into()));
            }
            last.index = Some(index);
        }
        // Exports look only inwards, so this ends.
        self.down(inner, &path, output)
    }

    /// Checks that an export reaches a port of a model.
    fn export(&self, inner: &Instance, name: &str) -> Result<(), Problem> {
        let segment = Segment { name: name.into(), index: None };
        for end in self.exported(inner, &segment, true)? {
            let Some(Node::Model(m)) = self.node(&end.part) else { continue };
            let Some(d) = self.ports(m) else { continue };
            let ports: Vec<&PortSpec> = d.all_inputs().chain(d.all_outputs()).collect();
            let port = end.port.split('.').next().unwrap_or(&end.port);
            if !ports.iter().any(|p| p.name == port) {
                let known: Vec<&str> = ports.iter().map(|p| &*p.name).collect();
                let fact = format!("`{}` ({}) has no port `{port}`", end.part, m.model.text);
                return Err((fact, remedy(port, "ports", &known)));
            }
        }
        Ok(())
    }

    fn node(&self, path: &str) -> Option<&Node> {
        let (head, name) = path.rsplit_once('.').unwrap_or(("", path));
        self.root.at(head)?.parts.get(name)
    }

    /// Ports of a part; `None` when the catalogue does not know its model, or its parameters do not say.
    fn ports(&self, m: &ModelInst) -> Option<Arc<Description>> {
        let files = self.files.first(m.folder.as_deref());
        self.catalogue.get(&m.model.text)?.describe(&m.params, &files)
    }

    fn port(&self, m: &ModelInst, rest: &[Segment], output: bool) -> Result<Vec<PortRef>, Problem> {
        let part = &m.path;
        let described = self.ports(m);
        let ports: Option<Vec<&PortSpec>> = described.as_deref().map(|d| match output {
            true => d.all_outputs().collect(),
            false => d.all_inputs().collect(),
        });
        let Some((last, inner)) = rest.split_last() else {
            let ports = ports.unwrap_or_default();
            let known: Vec<&str> = ports.iter().map(|p| &*p.name).collect();
            let kind = if output { "outputs" } else { "inputs" };
            let help = format!("add a port: {}", remedy("", kind, &known));
            return Err((format!("`{part}` is a part, not a port"), help));
        };
        if inner.iter().any(|s| s.index.is_some()) {
            return elements(part, ports.as_deref(), rest);
        }
        let mut port: Vec<&str> = inner.iter().map(|s| s.name.as_str()).collect();
        port.push(&last.name);
        let port = port.join(".");
        let one = |port: &str, index| PortRef { part: part.clone(), port: port.into(), index };
        match last.index {
            None => Ok(vec![one(&port, None)]),
            Some(Index::At(k)) => Ok(vec![one(&port, Some(k))]),
            Some(Index::All) => {
                // A model or port that does not exist is for `compile` to report.
                let Some(ports) = ports else {
                    return Ok(vec![one(&port, None)]);
                };
                let Some(spec) = ports.iter().find(|p| p.name == port) else {
                    return Ok(vec![one(&port, None)]);
                };
                let lanes = spec.lane_names();
                Ok(lanes
                    .iter()
                    .enumerate()
                    .map(|(k, (suffix, _))| match suffix.strip_prefix('.') {
                        Some(word) => one(&format!("{port}.{word}"), None),
                        None if suffix.is_empty() => one(&port, None),
                        None => one(&port, Some(k)),
                    })
                    .collect())
            }
        }
    }
}

/// Ports of a sized model whose names have an element inside: `wheels[2].rate`, or all `wheels[*].rate`.
fn elements(
    part: &str,
    ports: Option<&[&PortSpec]>,
    rest: &[Segment],
) -> Result<Vec<PortRef>, Problem> {
    let name = |of_all: Option<usize>| {
        let each = rest.iter().map(|s| match (s.index, of_all) {
            (None, _) => s.name.clone(),
            (Some(Index::At(k)), _) | (Some(Index::All), Some(k)) => format!("{}[{k}]", s.name),
            (Some(Index::All), None) => format!("{}[*]", s.name),
        });
        each.collect::<Vec<_>>().join(".")
    };
    let one = |port: String| PortRef { part: part.into(), port, index: None };
    if !rest.iter().any(|s| s.index == Some(Index::All)) {
        return Ok(vec![one(name(None))]);
    }
    let ports = ports.unwrap_or_default();
    let is = |port: &str| ports.iter().any(|p| p.name == port);
    let found: Vec<PortRef> = (0..).map(|k| name(Some(k))).take_while(|n| is(n)).map(one).collect();
    if found.is_empty() {
        let known: Vec<&str> = ports.iter().map(|p| &*p.name).collect();
        let fact = format!("`{part}` has no port `{}`", name(Some(0)));
        return Err((fact, remedy(&name(Some(0)), "ports", &known)));
    }
    Ok(found)
}

fn exports_help(inner: &Instance, name: &str) -> String {
    let known: Vec<&str> = inner.exports.keys().map(String::as_str).collect();
    let mut help = remedy(name, "exports", &known);
    if let Some(guess) = did_you_mean(name, inner.parts.keys().map(String::as_str))
        && known.is_empty()
    {
        help.push_str(&format!("; to reach inside write the whole path ({guess})"));
    }
    help
}
