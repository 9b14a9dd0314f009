//! Wires: every input lane has one source lane; reductions have several.
use super::arrivals::Arrivals;
use super::connections::{Connections, Link, Tear};
use super::find::{Finder, FoundPort};
use super::order::Order;
use super::part::Part;
use crate::author::host::{End, HostWire};
use crate::author::ports::{PortKind, PortSpec, Text};
use crate::author::units::Unit;
use crate::author::value::{Fault, Origin};
use crate::plan::compiled::{Sizes, Via, WirePlan};
use crate::plan::spec::{PortRef, Spec, WireSpec, WireTiming};
use std::collections::BTreeMap;

struct Connector<'a, 'b, 'w> {
    finder: Finder<'a, 'b>,
    arrivals: Arrivals,
    /// Text of each link, as the user wrote it.
    texts: Vec<&'w str>,
    out: Connections,
}

/// Finds outputs of parts before they are wired: the port, and which of its lanes an end names.
pub(crate) fn outputs<'a>(
    parts: &'a [Part<'_>],
) -> impl Fn(&PortRef) -> Option<(PortSpec, std::ops::Range<usize>)> {
    let finder = Finder::new(parts, BTreeMap::new());
    move |end| {
        let (found, first, n) = finder.find(end, true, "", Origin::NONE).ok()?;
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
    let mut c = Connector {
        finder: Finder::new(parts, absent),
        arrivals: Arrivals::new(parts),
        texts: Vec::new(),
        out: Connections { signals: sizes.sig, sizes, ..Connections::default() },
    };
    let mut named: Vec<(String, String, &WireSpec)> =
        wires.iter().map(|w| (w.from.to_string(), w.to.to_string(), w)).collect();
    named.sort_by(|a, b| (&a.0, &a.1).cmp(&(&b.0, &b.1)));
    for (from, to, wire) in named {
        if let Err(mut fault) = c.wire(wire, from, to) {
            faults.append(&mut fault);
        }
    }
    for (host, wire) in bound {
        if let Some(host) = c.finder.part(host) {
            c.bound(host, wire, faults);
        }
    }
    let mut given: Vec<(usize, &str)> =
        spec.binds.iter().filter_map(|b| Some((c.finder.part(&b.part)?, &*b.bind))).collect();
    given.sort_unstable();
    let Connector { arrivals, mut out, .. } = c;
    arrivals.finish(parts, &given, &mut out, faults);
    super::connectors::check(parts, &out.links, faults);
    out
}

impl<'w> Connector<'_, '_, 'w> {
    /// `from` and `to`: its ends in words.
    fn wire(&mut self, wire: &'w WireSpec, from: String, to: String) -> Result<(), Vec<Fault>> {
        let (text, origin) = (&wire.text, wire.origin);
        let a = self.finder.find(&wire.from, true, text, origin);
        let b = self.finder.find(&wire.to, false, text, origin);
        if let Ok((found, first, n)) = &b {
            self.arrivals.excuse(found.part, found.lane + first, *n);
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
                format!("`{from}` has {sn} elements, but `{to}` has {dn}"),
                "select one element on the longer side, as in `rate[2]` or `force.x`",
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
                format!("`{from}` is a {:?}, but `{to}` is a {:?}", src.spec.kind, dst.spec.kind),
                "wire ports of one kind, or name the elements",
            );
        }
        let alike = src.spec.kind == dst.spec.kind && src.spec.unit == dst.spec.unit;
        if !(whole && alike)
            && let Some((su, du)) = unlike((src.spec, s0), (dst.spec, d0), sn)
        {
            let shown = |u: &str| if u.is_empty() { "no unit".to_string() } else { u.to_string() };
            return fault(
                format!("{from} is in {}, but {to} is in {}", shown(&su), shown(&du)),
                "wire an output of the same quantity, or insert a part that converts it",
            );
        }
        if let (Some(f), Some(g)) = (&src.spec.frame, &dst.spec.frame)
            && f != g
        {
            return fault(
                format!("`{from}` is in frame `{f}`, but `{to}` requires frame `{g}`"),
                "insert a frame transformation between them",
            );
        }
        let sent = (src.lane + s0) as u32;
        let first = match wire.timing {
            WireTiming::Solved { tolerance } => {
                self.tear(wire, (dst, d0), (sent, sn), tolerance)?
            }
            WireTiming::AtOnce | WireTiming::Delayed { .. } => sent,
        };
        for at in dst.lane + d0..dst.lane + d0 + sn {
            if !dst.spec.sum
                && let Some(other) = self.arrivals.at(dst.part, at)
            {
                let other = self.texts[other];
                return fault(
                    format!("input `{to}` is wired twice; the other wire is `{other}`"),
                    "remove one of the two: only inputs marked `sum` accept several wires",
                );
            }
        }
        let link = Link {
            from,
            to,
            via: Via::Wire,
            end: End::Output,
            origin,
            source: first,
            reader: dst.part,
        };
        self.link(link, text, (dst.lane + d0, sn));
        Ok(())
    }

    /// Connects `n` lanes of the reader from `lane` on to the lanes from the link's source on.
    fn link(&mut self, link: Link, text: &'w str, (lane, n): (usize, usize)) {
        for k in 0..n {
            let at = self.out.links.len();
            self.arrivals.add(link.reader, lane + k, at, link.source + k as u32);
        }
        self.out.links.push(link);
        self.texts.push(text);
    }

    /// Allocates lanes for the unknown values of a wire that is solved for; they start at the default of the input.
    fn tear(
        &mut self,
        wire: &WireSpec,
        (dst, at): (FoundPort<'_>, usize),
        (sent, n): (u32, usize),
        tolerance: f64,
    ) -> Result<u32, Vec<Fault>> {
        if !(tolerance > 0.0 && tolerance < 1.0) {
            let fact = format!("wire `{}`: the tolerance is {tolerance}", wire.text);
            return Err(vec![
                Fault::new(wire.origin, fact).help("write one above 0 and below 1, e.g. 1e-10"),
            ]);
        }
        let sought = self.out.allocate(n);
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

    /// Adds a wire between a part and the host; both ports exist and are of the same kind.
    fn bound(&mut self, host: usize, wire: &'w HostWire, faults: &mut Vec<Fault>) {
        let Some(part) = self.finder.part(&wire.part) else { return };
        let (Some(far), Some(near)) = (
            self.finder.port(host, &wire.host_port, wire.end == End::Input),
            self.finder.port(part, &wire.port, wire.end == End::Output),
        ) else {
            return;
        };
        let key = [&*wire.part, ".", &*wire.port].concat();
        let (from, to, a, b) = match wire.end {
            End::Input => (far, near, wire.label.clone(), key),
            End::Output => (near, far, key, wire.label.clone()),
        };
        let n = from.spec.lanes.min(to.spec.lanes);
        let other = (to.lane..to.lane + n).find_map(|at| self.arrivals.at(to.part, at));
        if let Some(other) = other.filter(|_| !to.spec.sum) {
            let Link { from, to, .. } = &self.out.links[other];
            let fact = format!(
                "`{a} -> {b}`: the connection `{from} -> {to}` already drives the same input"
            );
            let help = "remove one of the two, because an input can have only one source";
            faults.push(Fault::new(wire.origin, fact).help(help));
        }
        let link = Link {
            from: a,
            to: b,
            via: Via::Bind,
            end: wire.end,
            origin: wire.origin,
            source: from.lane as u32,
            reader: to.part,
        };
        self.link(link, &wire.label, (to.lane, n));
    }
}

/// Returns the units of the first of `n` lanes of two ports that have different quantities.
fn unlike(
    (from, a): (&PortSpec, usize),
    (to, b): (&PortSpec, usize),
    n: usize,
) -> Option<(Text, Text)> {
    let (from, to) = (from.lane_names(), to.lane_names());
    let quantity = |unit: &str| Unit::parse(unit).unwrap_or(Unit::ONE);
    let each = (0..n).map(|k| (from[a + k].1.clone(), to[b + k].1.clone()));
    let mut differ = each.filter(|(a, b)| a != b);
    differ.find(|(a, b)| !quantity(a).same_quantity(&quantity(b)))
}

/// Returns the links in the form of the list of a plan.
pub(super) fn listing(links: Vec<Link>, parts: &[Part<'_>], order: &Order) -> Vec<WirePlan> {
    let listed = |l: Link| {
        let held = parts.get(l.reader).is_none_or(|p| p.wiring.period == 0);
        let hold = order.sampled_lane(l.source) && held;
        WirePlan { from: l.from, to: l.to, via: l.via, hold }
    };
    links.into_iter().map(listed).collect()
}
