//! Search for parts and ports by name. The index is built once, so that the cost of a wire does not grow with the number of ports of a mechanism.
use super::part::Part;
use crate::author::model::Description;
use crate::author::ports::PortSpec;
use crate::author::value::{Fault, Origin, remedy};
use crate::plan::spec::PortRef;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// One port of a part, found.
#[derive(Clone, Copy)]
pub(super) struct FoundPort<'a> {
    pub part: usize,
    pub spec: &'a PortSpec,
    /// First lane: of the signals for outputs, of all inputs (feedthrough inputs last) for inputs.
    pub lane: usize,
}

/// Returns a fault, or `None` if it would only follow from one that is already reported.
pub(super) type NewFault = Option<Fault>;

pub(super) struct Finder<'a, 'b> {
    parts: &'a [Part<'b>],
    index: BTreeMap<&'a str, usize>,
    /// Parts without ports: services (true), and parts whose own faults are already reported (false).
    absent: BTreeMap<&'a str, bool>,
    /// Inputs and then outputs of each part, both by name.
    ports: Vec<FoundPort<'a>>,
    /// Start indices in `ports`: inputs and outputs of the first part, of the second, …; one more at the end.
    begins: Vec<usize>,
}

impl<'a, 'b> Finder<'a, 'b> {
    /// O(n log n) in the number of ports.
    pub fn new(parts: &'a [Part<'b>], absent: BTreeMap<&'a str, bool>) -> Self {
        let (mut ports, mut begins) = (Vec::new(), vec![0]);
        for (part, p) in parts.iter().enumerate() {
            let d = p.prototype.description();
            for (output, first) in [(false, 0), (true, p.wiring.ym)] {
                let begin = ports.len();
                let lanes = |lane: &mut usize, spec: &'a PortSpec| {
                    let at = *lane;
                    *lane += spec.lanes;
                    Some(FoundPort { part, spec, lane: at })
                };
                ports.extend(side(d, output).scan(first, lanes));
                ports[begin..].sort_by(|a, b| a.spec.name.cmp(&b.spec.name));
                begins.push(ports.len());
            }
        }
        let index = parts.iter().enumerate().map(|(k, p)| (p.spec.path.as_str(), k)).collect();
        Finder { parts, index, absent, ports, begins }
    }

    /// A part by its path.
    pub fn part(&self, path: &str) -> Option<usize> {
        self.index.get(path).copied()
    }

    /// Finds a port of a part by its whole name.
    pub fn port(&self, part: usize, name: &str, output: bool) -> Option<FoundPort<'a>> {
        let side = 2 * part + usize::from(output);
        let ports = &self.ports[self.begins[side]..self.begins[side + 1]];
        let at = ports.partition_point(|p| &*p.spec.name < name);
        ports.get(at).filter(|p| p.spec.name == name).copied()
    }

    /// Splits an end into its part and the name of the port: `IMU.accel.x` arrives as part `IMU.accel`, port `x`, since lanes have
    /// names too.
    fn split<'e>(
        &self,
        end: &'e PortRef,
        wire: &str,
        origin: Origin,
    ) -> Result<(usize, Cow<'e, str>), NewFault> {
        let mut part = end.part.as_str();
        loop {
            if let Some(k) = self.part(part) {
                let port = match end.part[part.len()..].strip_prefix('.') {
                    Some(inner) => Cow::Owned([inner, ".", &end.port].concat()),
                    None => Cow::Borrowed(&*end.port),
                };
                return Ok((k, port));
            }
            match self.absent.get(part) {
                Some(true) => {
                    let fact = format!("wire `{wire}`: `{part}` is a service: it has no ports");
                    return Err(Some(
                        Fault::new(origin, fact)
                            .help("models use services directly: write the path of the service in their parameters"),
                    ));
                }
                Some(false) => return Err(None),
                None => {}
            }
            let Some((head, _)) = part.rsplit_once('.') else {
                let known: Vec<&str> = self.index.keys().copied().collect();
                let fact = format!("wire `{wire}`: there is no part `{}`", end.part);
                return Err(Some(
                    Fault::new(origin, fact).help(remedy(&end.part, "parts", &known)),
                ));
            };
            part = head;
        }
    }

    /// Finds a port and the named lanes: the first lane and their number.
    pub fn find(
        &self,
        end: &PortRef,
        output: bool,
        wire: &str,
        origin: Origin,
    ) -> Result<(FoundPort<'a>, usize, usize), NewFault> {
        let (k, port) = self.split(end, wire, origin)?;
        let path = &self.parts[k].spec.path;
        // The name of a port may have dots itself (`wheels[2].rate`): the longest name that fits counts.
        let mut names = std::iter::successors(Some(&*port), |name| Some(name.rsplit_once('.')?.0));
        if let Some(found) = names.find_map(|name| self.port(k, name, output)) {
            let (spec, name) = (found.spec, &*found.spec.name);
            let rest = &port[name.len()..];
            let sub = match end.index {
                Some(i) => Cow::Owned(format!("{rest}[{i}]")),
                None => Cow::Borrowed(rest),
            };
            if sub.is_empty() {
                return Ok((found, 0, spec.lanes));
            }
            let lanes = spec.lane_names();
            if let Some(at) = lanes.iter().position(|(n, _)| *n == sub) {
                return Ok((found, at, 1));
            }
            // The path may name a group such as `state.position`.
            let within =
                |n: &str| n.strip_prefix(&*sub).is_some_and(|inner| inner.starts_with('.'));
            let group = lanes.iter().filter(|(n, _)| within(n)).count();
            if let Some(first) = lanes.iter().position(|(n, _)| within(n)) {
                return Ok((found, first, group));
            }
            let known: Vec<String> = lanes.iter().map(|(n, _)| format!("{name}{n}")).collect();
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            let fact = format!("wire `{wire}`: `{path}.{name}` has no element `{sub}`");
            let help = remedy(&format!("{name}{sub}"), "elements", &known);
            return Err(Some(Fault::new(origin, fact).help(help)));
        }
        let d = self.parts[k].prototype.description();
        let (this, other) = if output { ("output", "input") } else { ("input", "output") };
        let known: Vec<&str> = side(d, output).map(|p| &*p.name).collect();
        let mut help = remedy(&port, &format!("{this}s"), &known);
        if self.port(k, &port, !output).is_some() {
            help =
                format!("`{port}` is an {other}; a wire runs from an output to an input. {help}");
        }
        let fact = format!("wire `{wire}`: `{path}` has no {this} `{port}`");
        Err(Some(Fault::new(origin, fact).help(help)))
    }
}

/// Returns all inputs or all outputs.
fn side(d: &Description, output: bool) -> impl Iterator<Item = &PortSpec> {
    let (first, second) = match output {
        true => (&d.outputs, &d.feedthrough_outputs),
        false => (&d.inputs, &d.feedthrough_inputs),
    };
    first.iter().chain(second)
}
