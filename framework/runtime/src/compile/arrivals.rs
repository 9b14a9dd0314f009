//! Sources of the inputs of all parts: one source lane for each input lane, several for reductions.
use super::connections::{Connections, Link};
use super::part::Part;
use crate::author::host::End;
use crate::author::model::{Description, lanes};
use crate::author::ports::PortSpec;
use crate::author::setting::{Judge, Setting};
use crate::author::shown::BINDING;
use crate::author::value::{Fault, Origin};
use crate::plan::compiled::Sum;

/// A source lane that arrives at an input lane.
#[derive(Clone, Copy)]
struct Arrival {
    input: u32,
    /// Place among the links.
    link: u32,
    source: u32,
}

/// Input lanes are counted through all parts: the inputs and then the feedthrough inputs of the first, of the second, …
pub(super) struct Arrivals {
    /// First input lane of each part.
    first: Vec<usize>,
    all: Vec<Arrival>,
    /// Link that arrives at each input lane.
    by: Vec<u32>,
    /// Input lanes that a wire names, even a faulty one: they are not reported as unwired too.
    excused: Vec<bool>,
}

const NONE: u32 = u32::MAX;

impl Arrivals {
    pub fn new(parts: &[Part<'_>]) -> Self {
        let mut n = 0;
        let count = |p: &Part<'_>| {
            let d = p.prototype.description();
            let first = n;
            n += lanes(&d.inputs) + lanes(&d.feedthrough_inputs);
            first
        };
        let first = parts.iter().map(count).collect();
        Arrivals { first, all: Vec::new(), by: vec![NONE; n], excused: vec![false; n] }
    }

    /// Marks `n` lanes of a part from `lane` on as named by a wire.
    pub fn excuse(&mut self, part: usize, lane: usize, n: usize) {
        let first = self.first[part] + lane;
        self.excused[first..first + n].fill(true);
    }

    /// Returns the link that already arrives at an input lane.
    pub fn at(&self, part: usize, lane: usize) -> Option<usize> {
        let link = self.by[self.first[part] + lane];
        (link != NONE).then_some(link as usize)
    }

    pub fn add(&mut self, part: usize, lane: usize, link: usize, source: u32) {
        let (input, link) = ((self.first[part] + lane) as u32, link as u32);
        self.by[input as usize] = link;
        self.all.push(Arrival { input, link, source });
    }

    /// Writes the sources of every input of every part to `out`. `bound`: parts and their bindings that are given, in order.
    pub fn finish(
        self,
        parts: &[Part<'_>],
        bound: &[(usize, &str)],
        out: &mut Connections,
        faults: &mut Vec<Fault>,
    ) {
        let mut begins = vec![0u32; self.by.len() + 1];
        for a in &self.all {
            begins[a.input as usize + 1] += 1;
        }
        for k in 1..begins.len() {
            begins[k] += begins[k - 1];
        }
        // Sort the arrivals of each lane by path, because this is the order in which the terms of a
        // sum are added.
        let mut all = self.all;
        let key = |a: &Arrival| out.links[a.link as usize].key();
        all.sort_by_key(|a| a.input);
        for at in all.chunk_by_mut(|a, b| a.input == b.input).filter(|at| at.len() > 1) {
            at.sort_by(|a, b| (key(a), a.source).cmp(&(key(b), b.source)));
        }
        let sorted = Sorted { all, begins, excused: self.excused };
        out.inputs.reserve(parts.len());
        for ((k, part), lane) in parts.iter().enumerate().zip(self.first) {
            sorted.part((k, part), lane, bound, out, faults);
        }
    }
}

impl Link {
    /// Returns the sort key among the sources of one lane: the path of its part's port, or the start of the wire.
    fn key(&self) -> &str {
        match self.end {
            End::Input => &self.to,
            End::Output => &self.from,
        }
    }
}

struct Sorted {
    all: Vec<Arrival>,
    /// Index in `all` of the first source of each input lane.
    begins: Vec<u32>,
    excused: Vec<bool>,
}

impl Sorted {
    fn at(&self, input: usize) -> &[Arrival] {
        &self.all[self.begins[input] as usize..self.begins[input + 1] as usize]
    }

    /// Finds the sources of all inputs of a part; the first input is `lane`.
    fn part(
        &self,
        (k, part): (usize, &Part<'_>),
        first: usize,
        bound: &[(usize, &str)],
        out: &mut Connections,
        faults: &mut Vec<Fault>,
    ) {
        let d = part.prototype.description();
        let unbound = |bind: &str| bind != BINDING && bound.binary_search(&(k, bind)).is_err();
        let (u_lanes, mut lane) = (lanes(&d.inputs), 0);
        let mut all = Vec::with_capacity(u_lanes + lanes(&d.feedthrough_inputs));
        let mut missing: Vec<&str> = Vec::new();
        let mut open: Vec<&str> = Vec::new();
        let needed = part.prototype.must_be_wired();
        for port in d.all_inputs() {
            let at = first + lane;
            let empty = (at..at + port.lanes).all(|i| self.at(i).is_empty() && !self.excused[i]);
            if let Some((_, why)) = needed.iter().find(|(name, _)| empty && *name == port.name) {
                let fault = unwired(part, port);
                let fact = format!("{}: {}", fault.message, why.message);
                let help = why.help.clone().or(fault.help).unwrap_or_default();
                faults.push(Fault::new(part.spec.origin, fact).help(help));
            }
            if empty && port.default.is_none() && !port.sum {
                match port.bind.as_deref() {
                    Some(bind) if unbound(bind) => {
                        if !missing.contains(&bind) {
                            missing.push(bind);
                        }
                    }
                    Some(_) => {}
                    None => match port.connector.as_deref() {
                        Some(connector) if open.contains(&connector) => {}
                        Some(connector) => {
                            open.push(connector);
                            faults.push(unconnected(part, connector));
                        }
                        None => faults.push(unwired(part, port)),
                    },
                }
            }
            self.port((k, port), (lane, at), out, &mut all);
            lane += port.lanes;
        }
        for port in d.all_outputs() {
            if let Some(bind) = port.bind.as_deref().filter(|b| unbound(b))
                && !missing.contains(&bind)
                && !reads(d, bind)
            {
                missing.push(bind);
            }
        }
        for bind in missing {
            let fact = format!("`{}`: binding `{bind}` is missing", part.spec.path);
            let help = format!("write `bind: {{ \"{bind}\": \"node:…\" }}` or `\"hinge:…\"`");
            faults.push(Fault::new(part.spec.origin, fact).help(help));
        }
        let ud = all.split_off(u_lanes);
        out.inputs.push((all, ud));
        self.judge(part, first, out);
    }

    /// Records the parameters and inputs of a part that may have no effect ([`crate::Model::without_effect`]); its first input is `first`.
    fn judge(&self, part: &Part<'_>, first: usize, out: &mut Connections) {
        let d = part.prototype.description();
        let sources = |name: &str| -> Vec<&Arrival> {
            let (mut lane, mut found) = (first, Vec::new());
            for port in d.all_inputs() {
                let own = port
                    .name
                    .strip_suffix(name)
                    .is_some_and(|rest| rest.is_empty() || rest.ends_with('.'));
                let lanes = lane..lane + port.lanes;
                lane += port.lanes;
                found.extend(lanes.filter(|_| own).filter_map(|at| self.at(at).first()));
            }
            found
        };
        for (judged, idle) in part.prototype.without_effect(&|name| !sources(name).is_empty()) {
            let (name, origin) = match judged {
                Judge::Input(name) => {
                    let wire = sources(name).first().map(|a| out.links[a.link as usize].origin);
                    (name, wire.unwrap_or(part.spec.origin))
                }
                Judge::Param(name) => {
                    let spec = d.params.iter().find(|p| p.name == name);
                    let default = spec.and_then(|p| p.default.as_ref());
                    let Some(own) = part.spec.params.get(name) else { continue };
                    // A value that equals the default, or that is the default of an assembly, requests nothing. `needs` is judged elsewhere.
                    let by_default = own.origin.default || default == Some(&own.value);
                    if by_default || spec.is_some_and(|p| p.needs.is_some()) {
                        continue;
                    }
                    (name, own.origin)
                }
            };
            let idle = idle.map(|why| (why.message, why.help.unwrap_or_default()));
            let origin = if origin == Origin::NONE { part.spec.origin } else { origin };
            out.settings.push(Setting {
                owner: format!("`{}`", part.spec.path),
                name,
                origin,
                idle,
            });
        }
    }

    /// Finds the source lanes of one input port; its first lane is `lane` in its part and `at` among all.
    fn port(
        &self,
        (k, port): (usize, &PortSpec),
        (lane, at): (usize, usize),
        out: &mut Connections,
        all: &mut Vec<u32>,
    ) {
        let count = if port.lanes > 0 { self.at(at).len() } else { 0 };
        if count > 1 && (0..port.lanes).all(|i| self.at(at + i).len() == count) {
            // If all lanes of a port have the same number of sources, one operation sums the whole
            // port.
            let each = |j: usize| (0..port.lanes).map(move |i| self.at(at + i)[j].source);
            let first = reduce(out, (0..count).flat_map(each).collect(), port.lanes);
            all.extend((0..port.lanes as u32).map(|i| first + i));
            return;
        }
        for i in 0..port.lanes {
            all.push(match self.at(at + i) {
                [] => {
                    let l = out.allocate(1);
                    let default = port.default.as_ref().map_or(0.0, |d| d[i]);
                    out.constants.push((l, default));
                    out.free.insert((k, lane + i), l);
                    l
                }
                [one] => one.source,
                many => reduce(out, many.iter().map(|a| a.source).collect(), 1),
            });
        }
    }
}

/// Returns the lane that carries a sum.
fn reduce(out: &mut Connections, sources: Vec<u32>, lanes: usize) -> u32 {
    let dst = out.allocate(lanes);
    out.sums.push(Sum { dst, lanes: lanes as u32, sources });
    dst
}

/// Returns whether an input names the binding; a missing binding is then reported for this input.
fn reads(d: &Description, bind: &str) -> bool {
    d.all_inputs().any(|p| p.bind.as_deref() == Some(bind))
}

fn unwired(part: &Part<'_>, port: &PortSpec) -> Fault {
    let (path, name) = (&part.spec.path, &port.name);
    let unit = match &*port.unit {
        "" | "1" | "*" => String::new(),
        u => format!(" ({u})"),
    };
    let meaning = crate::author::doc::first_sentence(&port.doc);
    let meaning = meaning.trim_end_matches('.');
    Fault::new(part.spec.origin, format!("required input `{path}.{name}`{unit} is not wired"))
        .help(format!("{meaning}: add a wire `… -> {path}.{name}`"))
}

fn unconnected(part: &Part<'_>, connector: &str) -> Fault {
    let path = &part.spec.path;
    Fault::new(part.spec.origin, format!("connector `{path}.{connector}` is not connected")).help(format!(
        "write connect: [(\"{path}.{connector}\", \"…\")] with the connector of a source (`linkwork list` shows models with connectors)"
    ))
}
