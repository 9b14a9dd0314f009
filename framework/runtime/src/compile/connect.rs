//! Wires: every input lane gets one source lane; reductions get many.
use super::Part;
use super::host::{End, HostWire};
use super::order::Order;
use crate::field::BINDING;
use crate::model::lanes;
use crate::plan::{Sizes, Sum, Via, WirePlan};
use crate::ports::{PortKind, PortSpec};
use crate::spec::{PortRef, Spec, WireSpec, WireTiming};
use crate::value::{Fault, Origin, remedy};
use std::collections::{BTreeMap, BTreeSet};

/// The result of connecting.
#[derive(Default)]
pub(crate) struct Connections {
    /// For each part: source lane of each lane of U and of Ud.
    pub inputs: Vec<(Vec<u32>, Vec<u32>)>,
    /// Reductions.
    pub sums: Vec<Sum>,
    /// Signal lanes with constant content.
    pub constants: Vec<(u32, f64)>,
    /// All signal lanes.
    pub signals: usize,
    /// Continuous and discrete lanes.
    pub sizes: Sizes,
    /// Signal lanes of inputs without a wire: (part, input lane) → lane.
    pub free: BTreeMap<(usize, usize), u32>,
    /// Wires whose values are sought: the algebraic loops are cut there.
    pub tears: Vec<Tear>,
    /// For listings and loop reports: (from path, to path, via, origin, first source lane).
    pub links: Vec<Link>,
}

/// A wire that is solved for.
pub(crate) struct Tear {
    /// What the writer sends.
    pub sources: Vec<u32>,
    /// First of the lanes that the reader sees.
    pub sought: u32,
    pub tolerance: f64,
    pub reader: usize,
    pub text: String,
    pub to: String,
    pub origin: Origin,
}

pub(crate) struct Link {
    pub from: String,
    pub to: String,
    pub via: Via,
    pub origin: Origin,
    pub source: u32,
    /// Reading part.
    pub reader: usize,
}

impl Connections {
    pub(crate) fn listing(&self, parts: &[Part<'_>], order: &Order) -> Vec<WirePlan> {
        self.links
            .iter()
            .map(|l| WirePlan {
                from: l.from.clone(),
                to: l.to.clone(),
                via: l.via,
                hold: order.sampled_lane(l.source)
                    && parts.get(l.reader).is_none_or(|p| p.wiring.period == 0),
            })
            .collect()
    }
}

/// One port of a part, found.
#[derive(Clone, Copy)]
struct Found<'a> {
    part: usize,
    spec: &'a PortSpec,
    /// First lane: of the signals for outputs, of all inputs (U then Ud) for inputs.
    lane: usize,
}

struct Connector<'a, 'b> {
    parts: &'a [Part<'b>],
    index: BTreeMap<&'a str, usize>,
    /// Parts without ports: services (true), and those whose own faults are told already (false).
    absent: BTreeMap<&'a str, bool>,
    /// Input lanes that a wire names, even a faulty one: they are not reported as unwired too.
    excused: BTreeSet<(usize, usize)>,
    /// Parts and their bindings that are given.
    bound: BTreeSet<(&'a str, &'a str)>,
    next: usize,
    /// Per part and input lane: sources, as (sort key, lane).
    sources: Vec<Vec<Vec<(String, u32)>>>,
    written: Vec<Vec<Option<(String, Origin)>>>,
    out: Connections,
}

/// Finds outputs of parts before they are wired: the port, and which of its lanes an end names.
pub(crate) fn outputs<'a>(
    parts: &'a [Part<'_>],
) -> impl Fn(&PortRef) -> Option<(PortSpec, std::ops::Range<usize>)> {
    let c = Connector::new(parts, BTreeMap::new(), Sizes::default());
    move |end| {
        let (found, first, n) = c.find(end, true, "", Origin::NONE).ok()?;
        Some((found.spec.clone(), first..first + n))
    }
}

pub(crate) fn connect<'a>(
    (spec, wires): (&'a Spec, &[WireSpec]),
    parts: &'a [Part<'_>],
    absent: BTreeMap<&'a str, bool>,
    bound: &[(&str, &HostWire)],
    sizes: Sizes,
    faults: &mut Vec<Fault>,
) -> Connections {
    let inputs = |p: &Part<'_>| p.prototype.description().all_inputs().map(|s| s.lanes).sum();
    let counts: Vec<usize> = parts.iter().map(inputs).collect();
    let mut c = Connector {
        bound: spec.binds.iter().map(|b| (b.part.as_str(), b.bind.as_str())).collect(),
        sources: counts.iter().map(|n| vec![Vec::new(); *n]).collect(),
        written: counts.iter().map(|n| vec![None; *n]).collect(),
        ..Connector::new(parts, absent, sizes)
    };
    let mut wires: Vec<_> = wires.iter().collect();
    wires.sort_by_key(|w| (w.from.to_string(), w.to.to_string()));
    for wire in wires {
        if let Err(mut fault) = c.wire(wire) {
            faults.append(&mut fault);
        }
    }
    for (host, wire) in bound {
        if let Some(host) = c.index.get(host).copied() {
            c.bound(host, wire);
        }
    }
    c.finish(faults);
    c.out
}

/// A fault, or none when it would only follow from one that is told already.
type Told = Option<Fault>;

impl<'a, 'b> Connector<'a, 'b> {
    fn new(parts: &'a [Part<'b>], absent: BTreeMap<&'a str, bool>, sizes: Sizes) -> Self {
        Connector {
            parts,
            index: parts.iter().enumerate().map(|(k, p)| (p.spec.path.as_str(), k)).collect(),
            absent,
            excused: BTreeSet::new(),
            bound: BTreeSet::new(),
            next: sizes.sig,
            sources: Vec::new(),
            written: Vec::new(),
            out: Connections { sizes, ..Connections::default() },
        }
    }

    fn part(&self, end: &PortRef, wire: &str, origin: Origin) -> Result<(usize, String), Told> {
        // `IMU.accel.x` arrives as part `IMU.accel`, port `x`: lanes have names too.
        let mut part = end.part.as_str();
        let mut port = end.port.clone();
        loop {
            if let Some(&k) = self.index.get(part) {
                return Ok((k, port));
            }
            match self.absent.get(part) {
                Some(true) => {
                    let fact = format!("wire `{wire}`: `{part}` is a service: it has no ports");
                    return Err(Some(
                        Fault::new(origin, fact)
                            .help("models ask services themselves; name it in their parameters"),
                    ));
                }
                Some(false) => return Err(None),
                None => {}
            }
            match part.rsplit_once('.') {
                Some((head, tail)) => {
                    port = format!("{tail}.{port}");
                    part = head;
                }
                None => {
                    let known: Vec<&str> = self.index.keys().copied().collect();
                    let fact = format!("wire `{wire}`: there is no part `{}`", end.part);
                    return Err(Some(
                        Fault::new(origin, fact).help(remedy(&end.part, "parts", &known)),
                    ));
                }
            }
        }
    }

    /// Finds a port and the lanes of it that are meant.
    fn find(
        &self,
        end: &PortRef,
        output: bool,
        wire: &str,
        origin: Origin,
    ) -> Result<(Found<'a>, usize, usize), Told> {
        let (k, port) = self.part(end, wire, origin)?;
        let part = &self.parts[k];
        let d = part.prototype.description();
        let ports: Vec<&PortSpec> =
            if output { d.all_outputs().collect() } else { d.all_inputs().collect() };
        // The name of a port may have dots itself (`wheels[2].rate`): the longest name that fits.
        let rest = |spec: &&PortSpec| {
            let rest = port.strip_prefix(&*spec.name)?;
            (rest.is_empty() || rest.starts_with('.')).then_some((spec.name.len(), rest))
        };
        let fits = ports.iter().enumerate().filter_map(|(i, spec)| Some((i, rest(spec)?)));
        if let Some((i, (_, rest))) = fits.max_by_key(|(_, (length, _))| *length) {
            let first: usize = ports[..i].iter().map(|spec| spec.lanes).sum();
            let lane = if output { part.wiring.ym + first } else { first };
            let (spec, name) = (ports[i], &ports[i].name);
            let found = Found { part: k, spec, lane };
            let index = end.index.map_or(String::new(), |i| format!("[{i}]"));
            let sub = format!("{rest}{index}");
            if sub.is_empty() {
                return Ok((found, 0, spec.lanes));
            }
            let names = spec.lane_names();
            if let Some(at) = names.iter().position(|(n, _)| *n == sub) {
                return Ok((found, at, 1));
            }
            // A group such as `state.position`.
            let group: Vec<usize> =
                (0..names.len()).filter(|&i| names[i].0.starts_with(&format!("{sub}."))).collect();
            if let (Some(first), n) = (group.first(), group.len()) {
                return Ok((found, *first, n));
            }
            let known: Vec<String> = names.iter().map(|(n, _)| format!("{name}{n}")).collect();
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            let fact = format!("wire `{wire}`: `{}.{name}` has no element `{sub}`", part.spec.path);
            let help = remedy(&format!("{name}{sub}"), "elements", &known);
            return Err(Some(Fault::new(origin, fact).help(help)));
        }
        let name = port;
        let (this, other) = if output { ("output", "input") } else { ("input", "output") };
        let known: Vec<&str> = ports.iter().map(|p| &*p.name).collect();
        let mut help = remedy(&name, &format!("{this}s"), &known);
        let others: Vec<&str> = if output {
            d.all_inputs().map(|p| &*p.name).collect()
        } else {
            d.all_outputs().map(|p| &*p.name).collect()
        };
        if others.contains(&name.as_str()) {
            help =
                format!("`{name}` is an {other}; a wire runs from an output to an input. {help}");
        }
        let fact = format!("wire `{wire}`: `{}` has no {this} `{name}`", part.spec.path);
        Err(Some(Fault::new(origin, fact).help(help)))
    }

    fn wire(&mut self, wire: &WireSpec) -> Result<(), Vec<Fault>> {
        let WireSpec { from, to, text, origin, .. } = wire;
        let origin = *origin;
        let (a, b) = (self.find(from, true, text, origin), self.find(to, false, text, origin));
        if let Ok((found, first, n)) = &b {
            let lanes = found.lane + first..found.lane + first + n;
            self.excused.extend(lanes.map(|l| (found.part, l)));
        }
        let ((src, s0, sn), (dst, d0, dn)) = match (a, b) {
            (Ok(a), Ok(b)) => (a, b),
            (a, b) => return Err(a.err().into_iter().chain(b.err()).flatten().collect()),
        };
        let fault = |fact: String, help: &str| {
            Err(vec![Fault::new(origin, format!("wire `{text}`: {fact}")).help(help)])
        };
        if sn != dn {
            return fault(
                format!("`{from}` has {sn} lanes but `{to}` takes {dn}"),
                "name one element on the longer side, as in `rate[2]` or `force.x`",
            );
        }
        let whole = sn == src.spec.lanes && dn == dst.spec.lanes;
        let plain = |k: PortKind| matches!(k, PortKind::Numbers | PortKind::Vector);
        if whole
            && src.spec.kind != dst.spec.kind
            && !(plain(src.spec.kind) && plain(dst.spec.kind))
            && !(dn == 1
                && !matches!(src.spec.kind, PortKind::Bool)
                && !matches!(dst.spec.kind, PortKind::Bool))
        {
            return fault(
                format!("`{from}` is a {:?} but `{to}` is a {:?}", src.spec.kind, dst.spec.kind),
                "wire ports of one kind, or name the elements",
            );
        }
        let (sl, dl) = (src.spec.lane_names(), dst.spec.lane_names());
        for k in 0..sn {
            let (su, du) = (sl[s0 + k].1, dl[d0 + k].1);
            let (a, b) = (
                crate::Unit::parse(su).unwrap_or(crate::Unit::ONE),
                crate::Unit::parse(du).unwrap_or(crate::Unit::ONE),
            );
            if !a.same_quantity(&b) {
                let shown =
                    |u: &str| if u.is_empty() { "no unit".to_string() } else { u.to_string() };
                return fault(
                    format!("{from} is in {} but {to} wants {}", shown(su), shown(du)),
                    "wire the quantity itself, or put a converter between them",
                );
            }
        }
        if let (Some(f), Some(g)) = (&src.spec.frame, &dst.spec.frame)
            && f != g
        {
            return fault(
                format!("`{from}` is in frame `{f}` but `{to}` wants frame `{g}`"),
                "put a frame transformation between them",
            );
        }
        let sent = (src.lane + s0) as u32;
        let first = match wire.timing {
            WireTiming::Solved { tolerance } => {
                self.tear(wire, (dst, d0), (sent, sn), tolerance)?
            }
            WireTiming::AtOnce | WireTiming::Delayed { .. } => sent,
        };
        for k in 0..sn {
            let (source, at) = (first + k as u32, dst.lane + d0 + k);
            if !dst.spec.sum
                && let Some((other, _)) = &self.written[dst.part][at]
            {
                return fault(
                    format!("input `{to}` is wired twice; the other wire is `{other}`"),
                    "remove one of the two: only inputs marked `sum` take several wires",
                );
            }
            self.written[dst.part][at] = Some((text.clone(), origin));
            self.sources[dst.part][at].push((from.to_string(), source));
        }
        self.out.links.push(Link {
            from: from.to_string(),
            to: to.to_string(),
            via: Via::Wire,
            origin,
            source: first,
            reader: dst.part,
        });
        Ok(())
    }

    /// Lanes for what a wire carries whose values are sought; they start at the default of the input.
    fn tear(
        &mut self,
        wire: &WireSpec,
        (dst, at): (Found<'_>, usize),
        (sent, n): (u32, usize),
        tolerance: f64,
    ) -> Result<u32, Vec<Fault>> {
        if !(tolerance > 0.0 && tolerance < 1.0) {
            let fact = format!("wire `{}`: a tolerance of {tolerance}", wire.text);
            return Err(vec![
                Fault::new(wire.origin, fact).help("write one above 0 and below 1, e.g. 1e-10"),
            ]);
        }
        let sought = self.allocate(n);
        let start = |k: usize| dst.spec.default.as_ref().map_or(0.0, |d| d[at + k]);
        self.out.constants.extend((0..n).map(|k| (sought + k as u32, start(k))));
        self.out.tears.push(Tear {
            sources: (0..n as u32).map(|k| sent + k).collect(),
            sought,
            tolerance,
            reader: dst.part,
            text: wire.text.clone(),
            to: wire.to.to_string(),
            origin: wire.origin,
        });
        Ok(sought)
    }

    fn allocate(&mut self, n: usize) -> u32 {
        let lane = self.next as u32;
        self.next += n;
        lane
    }

    /// A wire between a part and the host; both ports exist and are of one kind.
    fn bound(&mut self, host: usize, wire: &HostWire) {
        let Some(&part) = self.index.get(wire.part.as_str()) else { return };
        let (Some(far), Some(near)) = (
            self.port(host, &wire.host_port, wire.end == End::Input),
            self.port(part, &wire.port, wire.end == End::Output),
        ) else {
            return;
        };
        let key = format!("{}.{}", wire.part, wire.port);
        let (from, to) = match wire.end {
            End::Input => (far, near),
            End::Output => (near, far),
        };
        for k in 0..from.spec.lanes.min(to.spec.lanes) {
            let at = to.lane + k;
            self.sources[to.part][at].push((key.clone(), (from.lane + k) as u32));
            self.written[to.part][at] = Some((format!("bind {key}"), Origin::NONE));
        }
        let (a, b) = match wire.end {
            End::Input => (wire.label.clone(), key),
            End::Output => (key, wire.label.clone()),
        };
        self.out.links.push(Link {
            from: a,
            to: b,
            via: Via::Bind,
            origin: wire.origin,
            source: from.lane as u32,
            reader: to.part,
        });
    }

    /// A port of a part by its name.
    fn port(&self, part: usize, name: &str, output: bool) -> Option<Found<'a>> {
        let d = self.parts[part].prototype.description();
        let mut lane = if output { self.parts[part].wiring.ym } else { 0 };
        let ports: Vec<&'a PortSpec> =
            if output { d.all_outputs().collect() } else { d.all_inputs().collect() };
        for spec in ports {
            if spec.name == name {
                return Some(Found { part, spec, lane });
            }
            lane += spec.lanes;
        }
        None
    }

    fn finish(&mut self, faults: &mut Vec<Fault>) {
        for k in 0..self.parts.len() {
            self.finish_part(k, faults);
        }
        self.out.signals = self.next;
    }

    /// The lane that carries a sum: the source itself when there is one.
    fn reduce(&mut self, sources: Vec<u32>, lanes: usize) -> u32 {
        if sources.len() == lanes {
            return sources[0];
        }
        let dst = self.allocate(lanes);
        self.out.sums.push(Sum { dst, lanes: lanes as u32, sources });
        dst
    }

    /// Source lanes of one input port.
    fn finish_port(&mut self, k: usize, port: &PortSpec, lane: usize, all: &mut Vec<u32>) {
        let mut sources: Vec<Vec<(String, u32)>> =
            self.sources[k][lane..lane + port.lanes].iter_mut().map(std::mem::take).collect();
        sources.iter_mut().for_each(|s| s.sort());
        let count = sources.first().map_or(0, Vec::len);
        if count > 1 && sources.iter().all(|s| s.len() == count) {
            // Whole ports are summed by one operation.
            let each = |j: usize| sources.iter().map(move |s| s[j].1);
            let lanes = (0..count).flat_map(each).collect();
            let first = self.reduce(lanes, port.lanes);
            all.extend((0..port.lanes as u32).map(|i| first + i));
            return;
        }
        for (i, sources) in sources.iter().enumerate() {
            let default = port.default.as_ref().map_or(0.0, |d| d[i]);
            let source = match sources.as_slice() {
                [] => {
                    let l = self.allocate(1);
                    self.out.constants.push((l, default));
                    self.out.free.insert((k, lane + i), l);
                    l
                }
                [one] => one.1,
                many => {
                    let lanes = many.iter().map(|s| s.1).collect();
                    self.reduce(lanes, 1)
                }
            };
            all.push(source);
        }
    }

    fn finish_part(&mut self, k: usize, faults: &mut Vec<Fault>) {
        let d = self.parts[k].prototype.description();
        let path = &self.parts[k].spec.path;
        let unbound: Vec<&str> = d
            .bindings()
            .into_iter()
            .filter(|b| *b != BINDING && !self.bound.contains(&(path.as_str(), *b)))
            .collect();
        let (u_lanes, mut lane) = (lanes(&d.inputs), 0);
        let mut all = Vec::new();
        let mut missing: Vec<&str> = Vec::new();
        for port in d.all_inputs() {
            let empty = (0..port.lanes).all(|i| {
                self.sources[k][lane + i].is_empty() && !self.excused.contains(&(k, lane + i))
            });
            if empty && port.default.is_none() && !port.sum {
                match port.bind.as_deref().filter(|b| unbound.contains(b)) {
                    Some(bind) if !missing.contains(&bind) => missing.push(bind),
                    Some(_) => {}
                    None if port.bind.is_some() => {}
                    None => faults.push(
                        Fault::new(
                            self.parts[k].spec.origin,
                            match &*port.unit {
                                "" | "1" | "*" => {
                                    format!("required input `{path}.{}` is not wired", port.name)
                                }
                                u => format!(
                                    "required input `{path}.{}` ({u}) is not wired",
                                    port.name
                                ),
                            },
                        )
                        .help(format!(
                            "{}: add a wire `… -> {path}.{}`",
                            first_line(&port.doc),
                            port.name
                        )),
                    ),
                }
            }
            self.finish_port(k, port, lane, &mut all);
            lane += port.lanes;
        }
        for port in d.all_outputs() {
            if let Some(bind) = port.bind.as_deref().filter(|b| unbound.contains(b))
                && !missing.contains(&bind)
                && !d.all_inputs().any(|p| p.bind.as_deref() == Some(bind))
            {
                missing.push(bind);
            }
        }
        for bind in missing {
            faults.push(
                Fault::new(
                    self.parts[k].spec.origin,
                    format!("`{path}`: binding `{bind}` is not given"),
                )
                .help(format!("write `bind: {{ \"{bind}\": \"node:…\" }}` or `\"hinge:…\"`")),
            );
        }
        let ud = all.split_off(u_lanes);
        self.out.inputs.push((all, ud));
    }
}

fn first_line(doc: &str) -> &str {
    doc.lines().next().unwrap_or_default().trim_end_matches('.')
}
