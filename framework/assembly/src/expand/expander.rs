//! Expansion of assemblies to a tree of instances: files are read, parameters replaced, overrides applied, arrays unrolled.
use crate::body::BodyFields;
use crate::body::collider::{Standing, Surface};
use crate::body::constraint::{CouplingForm, LoopForm};
use crate::expand::assemblies::Assemblies;
use crate::expand::instance::{Instance, ItemInst, ModelInst, Node};
use crate::expand::stowed::stow;
use crate::form::assembly::{
    AssemblyForm, ItemForm, ModelForm, PartForm, PartKind, read_overrides,
};
use crate::form::wire::WireText;
use crate::machine::import::{self, Import};
use crate::schema::read::text;
use crate::schema::record::Record;
use crate::scope::parameters::{Env, bind, substitute, substitute_text};
use crate::text::files::Home;
use crate::text::patterns::segment_matches;
use crate::text::report::Cx;
use crate::text::value::{Text, entries, join, set, sort};
use linkwork_runtime::{
    Catalogue, Description, Fault, Located, Origin, Value, did_you_mean, remedy,
};
use std::collections::BTreeMap;

/// An override that has not been applied to its instance yet.
#[derive(Clone)]
pub(crate) struct Pending {
    id: usize,
    path: Vec<String>,
    value: Located,
}

struct Written {
    text: String,
    origin: Origin,
    scope: String,
    used: bool,
}

/// State of the expansion, which all levels share.
pub(crate) struct Expander<'a, 'o> {
    pub cx: &'a mut Cx,
    pub files: Assemblies<'o>,
    pub catalogue: &'o Catalogue,
    /// Files that are open above this level.
    stack: Vec<String>,
    overrides: Vec<Written>,
    /// Overrides from outside without a match.
    pub unmatched: Vec<Unmatched>,
    /// The files that were imported.
    pub imports: Vec<Import>,
    /// Number of parts, bodies and other items so far; `None` after a limit was exceeded.
    count: Option<usize>,
}

/// Largest number of parts, bodies, loops, couplings and colliders of a simulation.
const MOST: usize = 500_000;
/// Largest depth of nested files.
const DEEPEST: usize = 100;

/// Context of an assembly.
struct Around<'p> {
    path: &'p str,
    kind: &'p str,
    env: &'p Env,
    home: &'p Home,
}

/// Returns how many segments of a path name parts, and whether they end at a model.
fn depth(root: &Instance, path: &str) -> (usize, bool) {
    let mut here = root;
    for (k, segment) in path.split('.').enumerate() {
        match here.parts.get(segment) {
            Some(Node::Assembly(inner)) => here = inner,
            Some(Node::Model(_)) => return (k + 1, true),
            None => return (k, false),
        }
    }
    (path.split('.').count(), false)
}

/// An override from outside without a match in a phase; another phase may have one.
pub struct Unmatched {
    /// Its path.
    pub path: String,
    /// Number of segments of the path that exist.
    pub depth: usize,
    /// The phase has the model of the path, but without such a parameter.
    pub has_model: bool,
    /// The fault, if no phase has a match.
    pub fault: Fault,
}

impl<'a, 'o> Expander<'a, 'o> {
    pub fn new(cx: &'a mut Cx, files: Assemblies<'o>, catalogue: &'o Catalogue) -> Self {
        Expander {
            cx,
            files,
            catalogue,
            stack: Vec::new(),
            overrides: Vec::new(),
            unmatched: Vec::new(),
            imports: Vec::new(),
            count: Some(0),
        }
    }

    /// Counts `more` items; `None` if there are too many, which is reported once. Files that contain another file twice double the number at each
    /// level.
    fn room(&mut self, more: usize, path: &str, origin: Origin) -> Option<()> {
        let count = self.count? + more;
        let told = match (count > MOST, self.stack.len() >= DEEPEST) {
            (false, false) => {
                self.count = Some(count);
                return Some(());
            }
            (true, _) => format!("`{path}`: the simulation has more than {MOST} parts and bodies"),
            (_, true) => format!("`{path}` is nested in {DEEPEST} other assemblies"),
        };
        self.cx.fault(origin, told, "check whether files include each other too often");
        self.count = None;
        None
    }

    /// Returns the model's description, if it is in the catalogue.
    fn description(&self, model: &str) -> Option<&'o Description> {
        Some(&self.catalogue.get(model)?.description)
    }

    fn pend(&mut self, scope: &str, path: &Text, value: Located) -> Pending {
        self.overrides.push(Written {
            text: path.text.clone(),
            origin: path.origin,
            scope: scope.to_string(),
            used: false,
        });
        let mut segments = Vec::new();
        for segment in path.text.split('.') {
            match segment.split_once('/') {
                Some((head, body)) => {
                    segments.extend((!head.is_empty()).then(|| head.to_string()));
                    segments.push(format!("/{body}"));
                }
                None => segments.push(segment.to_string()),
            }
        }
        Pending { id: self.overrides.len() - 1, path: segments, value }
    }

    /// Returns the whole tree. Faults of overrides without a match come last; those from outside are collected in `unmatched`.
    pub fn root(
        &mut self,
        a: &AssemblyForm,
        home: &Home,
        outer: &[(Text, Located)],
    ) -> (Instance, Env) {
        let pending: Vec<Pending> =
            outer.iter().map(|(path, v)| self.pend("", path, v.clone())).collect();
        let given = self.given(&a.params, Value::Map(Vec::new()).into(), &pending);
        let env = bind(self.cx, "simulation", Origin::NONE, &a.params, &given, &Env::new());
        let around = Around { path: "", kind: "simulation", env: &env, home };
        let root = self.instance(a, &around, BTreeMap::new(), pending);
        self.unused(&root, outer.len());
        (root, env)
    }

    /// Returns the values of parameters, with the overrides that apply to them.
    fn given<T>(
        &mut self,
        decls: &BTreeMap<String, T>,
        mut given: Located,
        pending: &[Pending],
    ) -> Located {
        for p in pending.iter().filter(|p| p.path.len() == 1) {
            for name in decls.keys().filter(|n| segment_matches(&p.path[0], n)) {
                set(&mut given, std::slice::from_ref(name), &p.value);
                self.overrides[p.id].used = true;
            }
        }
        given
    }

    fn instance(
        &mut self,
        a: &AssemblyForm,
        around: &Around<'_>,
        mounts: BTreeMap<String, Text>,
        outer: Vec<Pending>,
    ) -> Instance {
        // Apply the part's own overrides first and outer overrides later, so that the outermost
        // override wins.
        let mut pending = Vec::new();
        for (path, value) in &a.overrides {
            let path = substitute_text(self.cx, around.env, path);
            let value = substitute(self.cx, around.env, value);
            pending.push(self.pend(around.path, &path, value));
        }
        pending.extend(outer.into_iter().filter(|p| p.path.len() > 1));
        let mut out = Instance {
            path: around.path.to_string(),
            kind: around.kind.to_string(),
            doc: a.doc.clone(),
            parts: BTreeMap::new(),
            arrays: BTreeMap::new(),
            bodies: BTreeMap::new(),
            loops: BTreeMap::new(),
            couplings: BTreeMap::new(),
            colliders: BTreeMap::new(),
            contact: a.contact.as_ref().map(|c| substitute(self.cx, around.env, c)),
            self_collision: a.self_collision.as_ref().map(|s| substitute(self.cx, around.env, s)),
            ignore: None,
            mounts,
            exports: BTreeMap::new(),
            wires: Vec::new(),
            connect: Vec::new(),
            params: a.params.keys().cloned().collect(),
            broken: a.broken.clone(),
        };
        let written = a.imports.as_ref().map(|i| substitute(self.cx, around.env, i));
        let imported = written.map(|i| {
            let place = (around.path, around.home);
            import::with_imports(self.cx, &self.files.files, &i, place, a, &mut self.imports)
        });
        let all = imported.as_ref().unwrap_or(a);
        let has_part = |name: &str| a.parts.contains_key(name);
        out.ignore = all.ignore.as_ref().map(|s| substitute(self.cx, around.env, s));
        let known = BodyFields::names();
        out.bodies = self.items(&all.bodies, around, &pending, (&has_part, &known));
        let known = LoopForm::names();
        out.loops = self.items(&all.loops, around, &pending, (&has_part, &known));
        let known = CouplingForm::names();
        out.couplings = self.items(&all.couplings, around, &pending, (&has_part, &known));
        let known = <(Standing, Surface)>::names();
        out.colliders = self.items(&all.colliders, around, &pending, (&has_part, &known));
        for (base, form) in &all.parts {
            let form = form.with_values(self.cx, around.env, &join(around.path, base));
            let elements = form.elements(self.cx, base);
            if form.array.is_some() {
                out.arrays.insert(base.clone(), elements.iter().map(|e| e.0.clone()).collect());
            }
            for (name, part) in elements {
                let inner: Vec<Pending> = pending
                    .iter()
                    .filter(|p| p.path.len() > 1 && segment_matches(&p.path[0], &name))
                    .map(|p| Pending { path: p.path[1..].to_vec(), ..p.clone() })
                    .collect();
                let Some(node) = self.part(&name, &part, around, inner) else {
                    out.broken.insert(name);
                    continue;
                };
                if out.parts.insert(name.clone(), node).is_some() {
                    let message = format!("`{}`: two parts have the name `{name}`", around.path);
                    self.cx.fault(part.origin, message, "rename the array's elements");
                }
            }
        }
        for name in a.bodies.keys().filter(|n| out.mounts.contains_key(*n)) {
            let message = format!("`{name}` is both a body and a mount");
            self.cx.fault(a.bodies[name].origin, message, "rename one of them");
        }
        let replace = |cx: &mut Cx, t: &Text| match t.text.contains("${") {
            true => substitute_text(cx, around.env, t),
            false => t.clone(),
        };
        for w in &a.wires {
            out.wires.push(WireText { text: replace(self.cx, &w.text), timing: w.timing.clone() });
        }
        for ends in &a.connect {
            out.connect.push(ends.iter().map(|end| replace(self.cx, end)).collect());
        }
        out.exports = all.exports.iter().map(|(k, t)| (k.clone(), replace(self.cx, t))).collect();
        out
    }

    /// Replaces and overrides the parameters of bodies, loops, couplings or colliders; `known` are their fields.
    fn items(
        &mut self,
        forms: &BTreeMap<String, ItemForm>,
        around: &Around<'_>,
        pending: &[Pending],
        (has_part, known): (&dyn Fn(&str) -> bool, &[&str]),
    ) -> BTreeMap<String, ItemInst> {
        let mut out = BTreeMap::new();
        let first = forms.values().next().map_or(Origin::NONE, |form| form.origin);
        if self.room(forms.len(), around.path, first).is_none() {
            return out;
        }
        for (name, form) in forms {
            let mut fields = substitute(self.cx, around.env, &form.fields);
            for p in pending {
                let slashed = p.path[0].strip_prefix('/');
                let own = slashed.is_some_and(|s| segment_matches(s, name))
                    || (p.path[0] == *name && !has_part(name));
                if own && p.path.len() > 1 && known.contains(&p.path[1].as_str()) {
                    set(&mut fields, &p.path[1..], &p.value);
                    self.overrides[p.id].used = true;
                }
            }
            sort(&mut fields);
            let item = ItemInst { fields, origin: form.origin, home: around.home.clone() };
            out.insert(name.clone(), item);
        }
        out
    }

    fn part(
        &mut self,
        name: &str,
        part: &PartForm,
        around: &Around<'_>,
        pending: Vec<Pending>,
    ) -> Option<Node> {
        let path = join(around.path, name);
        let params = part.params.clone();
        self.room(1, &path, part.origin)?;
        match &part.kind {
            PartKind::Model { model, rate, offset, bind, folder } => {
                let folder = match (folder, around.home) {
                    (Some(f), _) => Some(f.text.clone().into()),
                    (None, Home::Folder(f)) => Some(f.clone()),
                    (None, Home::Embedded(_)) => None,
                };
                let mut m = ModelInst {
                    path,
                    doc: part.doc.clone(),
                    model: substitute_text(self.cx, around.env, model),
                    params,
                    rate: rate.clone(),
                    offset: offset.clone(),
                    bind: bind.clone(),
                    folder,
                    origin: part.origin,
                };
                let known = self.description(&m.model.text);
                for p in &pending {
                    let has = known.is_none_or(|d| d.params.iter().any(|s| s.name == p.path[0]));
                    if has {
                        set(&mut m.params, &p.path, &p.value);
                        self.overrides[p.id].used = true;
                    }
                }
                sort(&mut m.params);
                Some(Node::Model(m))
            }
            PartKind::File { assembly, mounts, overrides, stowed } => {
                let file = substitute_text(self.cx, around.env, assembly);
                let (key, home, read) = self.files.assembly(self.cx, &file, around.home, &path)?;
                if self.stack.contains(&key) {
                    let ring = format!("{} -> {key}", self.stack.join(" -> "));
                    let message = format!("`{path}`: assembly `{key}` contains itself: {ring}");
                    self.cx.fault(file.origin, message, "remove one of these parts");
                    return None;
                }
                let given = self.given(&read.params, params, &pending);
                let env = bind(self.cx, &path, part.origin, &read.params, &given, &Env::new());
                let mounts = self.mounts(&path, part.origin, &read, mounts);
                // Overrides in the entry of a part belong to its parent. Apply them after the part's own overrides and
                // before the outer ones.
                let mut all = Vec::new();
                let what = format!("`{path}`: `overrides`");
                for (text, value) in read_overrides(self.cx, overrides, &what) {
                    all.push(self.pend(&path, &text, value));
                }
                all.extend(pending);
                self.stack.push(key.clone());
                let inner = Around { path: &path, kind: &key, env: &env, home: &home };
                let mut instance = self.instance(&read, &inner, mounts, all);
                self.stack.pop();
                if let Some(stowed) = stowed {
                    stow(self.cx, &mut instance, stowed);
                }
                Some(Node::Assembly(instance))
            }
            PartKind::Inline(inner) => {
                let given = self.given(&inner.params, params, &pending);
                let env = bind(self.cx, &path, part.origin, &inner.params, &given, around.env);
                let here = Around { path: &path, kind: "inline", env: &env, home: around.home };
                Some(Node::Assembly(self.instance(inner, &here, BTreeMap::new(), pending)))
            }
        }
    }

    fn mounts(
        &mut self,
        path: &str,
        origin: Origin,
        a: &AssemblyForm,
        given: &Located,
    ) -> BTreeMap<String, Text> {
        let known: Vec<&str> = a.mounts.keys().map(String::as_str).collect();
        let mut out = BTreeMap::new();
        for (key, v) in entries(given) {
            if !a.mounts.contains_key(key) {
                let message = format!("`{path}` does not have a mount `{key}`");
                self.cx.fault(self.cx.key(v), message, remedy(key, "mounts", &known));
            } else if let Some(t) = text(self.cx, v, format!("mount `{key}`")) {
                out.insert(key.clone(), t);
            }
        }
        for (key, decl) in a.mounts.iter().filter(|(k, _)| given.get(k).is_none()) {
            let doc = decl.doc.trim_end_matches('.');
            let message = format!("`{path}`: mount `{key}` is not bound ({doc})");
            let help = format!("write `mounts: {{ \"{key}\": \"a body or node\" }}`");
            self.cx.fault(origin, message, help);
            // Loading fails with this fault. Continue with `world`, which always exists, so that bodies on this
            // mount cause no further faults.
            out.insert(key.clone(), Text::new("world"));
        }
        out
    }

    /// Adds faults for overrides without a match, with the point at which their path ends.
    fn unused(&mut self, root: &Instance, outer: usize) {
        let all = std::mem::take(&mut self.overrides).into_iter().enumerate();
        for (id, w) in all.filter(|(_, w)| !w.used) {
            let help = match root.at(&w.scope) {
                Some(scope) if scope.is_broken(&w.text) => continue,
                Some(scope) => self.why_unused(scope, &w.text),
                None => String::new(),
            };
            let fault = Fault::new(w.origin, format!("override `{}` matches nothing", w.text));
            let fault = fault.help(help);
            match id < outer {
                // An override that is given twice is reported once.
                true if self.unmatched.iter().any(|u| u.path == w.text) => {}
                true => {
                    let (depth, has_model) = depth(root, &w.text);
                    self.unmatched.push(Unmatched { path: w.text, depth, has_model, fault });
                }
                false => self.cx.faults.push(fault),
            }
        }
    }

    fn why_unused(&self, scope: &Instance, text: &str) -> String {
        let mut here = scope;
        let segments: Vec<&str> = text.split('.').collect();
        for (k, segment) in segments.iter().enumerate() {
            let last = k + 1 == segments.len();
            if let Some((head, name)) = segment.split_once('/') {
                return body_help(here.at(head), name);
            }
            match here.parts.get(*segment) {
                Some(Node::Assembly(inner)) if !last => here = inner,
                Some(Node::Assembly(inner)) => {
                    let list = names("parameters", inner.params.iter());
                    return format!("`{}` is an assembly: add a parameter. {list}", inner.path);
                }
                Some(Node::Model(m)) => {
                    let params = self.description(&m.model.text).map(|d| &d.params);
                    let known: Vec<&str> = params.into_iter().flatten().map(|p| p.name).collect();
                    let what = format!("`{}` ({})", m.path, m.model.text);
                    return match segments.get(k + 1) {
                        Some(field) if ModelForm::names().contains(field) => {
                            let list = names("parameters", known.iter());
                            format!(
                                "`{field}` is not a parameter of {what}, but a field in the file that contains the part: \
                                 change it there, or give that file a parameter for it. {list}"
                            )
                        }
                        Some(next) => {
                            let list = remedy(next, "parameters", &known);
                            format!("{what} has no such parameter. {list}")
                        }
                        None => {
                            let list = remedy("", "parameters", &known);
                            format!("{what} is a part: add a parameter. {list}")
                        }
                    };
                }
                None if segment.contains('*') => {
                    return "no part has a parameter with this path".into();
                }
                None => {
                    let known: Vec<&str> = here.parts.keys().map(String::as_str).collect();
                    let params: Vec<&str> = here.params.iter().map(String::as_str).collect();
                    return if last {
                        let list = remedy(segment, "parameters", &params);
                        format!("{} has no parameter `{segment}`. {list}", shown(here))
                    } else {
                        let guess = did_you_mean(segment, known.iter().copied());
                        let guess = guess.map(|g| format!("{g} ")).unwrap_or_default();
                        let list = names("parts", here.parts.keys());
                        format!("{guess}{} has no part `{segment}`; {list}", shown(here))
                    };
                }
            }
        }
        String::new()
    }
}

fn shown(here: &Instance) -> String {
    if here.path.is_empty() { "the simulation".into() } else { format!("`{}`", here.path) }
}

fn names<S: AsRef<str>>(kind: &str, names: impl Iterator<Item = S>) -> String {
    let names: Vec<S> = names.collect();
    let known: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    remedy("", kind, &known)
}

fn body_help(here: Option<&Instance>, name: &str) -> String {
    let Some(here) = here else {
        return "a body is `assembly/body`, its fields `assembly/body.mass`".into();
    };
    let kinds = [
        ("body", &here.bodies, BodyFields::names()),
        ("loop", &here.loops, LoopForm::names()),
        ("coupling", &here.couplings, CouplingForm::names()),
        ("collider", &here.colliders, <(Standing, Surface)>::names()),
    ];
    if let Some((kind, _, known)) = kinds.iter().find(|k| k.1.contains_key(name)) {
        return format!("{kind} `{name}` has no such field. fields: {}", known.join(", "));
    }
    let known: Vec<&str> = here.bodies.keys().map(String::as_str).collect();
    format!("{} has no body `{name}`. {}", shown(here), remedy(name, "bodies", &known))
}
