//! Reads the elements of `modelDescription.xml` into a [`ModelDescription`] and collects mistakes.
use super::*;
use crate::FormatError;
use crate::error::{FaultKind, FileFault};
use crate::xml::{self, Element};
use std::collections::{BTreeMap, BTreeSet};

/// Reads a model description.
///
/// # Errors
/// Every mistake with its position: not XML, an unknown version, missing or wrong attributes, unknown references.
pub fn read_model_description(text: &str, file: &str) -> Result<ModelDescription, FormatError> {
    let root = xml::parse(text, file)?;
    let mut reader = Reader { faults: Vec::new() };
    let read = reader.whole(&root);
    match read {
        Some(description) if reader.faults.is_empty() => Ok(description),
        _ => Err(FormatError { faults: reader.faults }),
    }
}

struct Reader {
    faults: Vec<FileFault>,
}

/// Units and types by name.
struct Names {
    units: BTreeMap<String, UnitDefinition>,
    types: BTreeMap<String, OfType>,
}

/// Defaults for the variables of a type.
struct OfType {
    unit: Option<String>,
    nominal: Option<f64>,
    relative: bool,
}

/// The attribute for differences.
const RELATIVE: &str = "relativeQuantity";

impl Reader {
    fn fault(&mut self, at: &Element, attribute: &str, kind: FaultKind) {
        self.faults.push(FileFault { place: at.place_of(attribute), kind });
    }

    fn need<'e>(&mut self, e: &'e Element, name: &str) -> Option<&'e str> {
        let found = e.attr(name);
        if found.is_none() {
            let kind = FaultKind::Missing {
                what: format!("<{}>", e.label()),
                missing: format!("attribute `{name}`"),
                help: "the standard requires it: contact the vendor of the unit".into(),
            };
            self.fault(e, name, kind);
        }
        found
    }

    /// Reads an optional attribute of a type that can be parsed from text.
    fn get<T: std::str::FromStr>(&mut self, e: &Element, name: &str, expected: &str) -> Option<T> {
        let text = e.attr(name)?;
        match text.parse() {
            Ok(value) => Some(value),
            Err(_) => {
                self.bad(e, name, text, expected);
                None
            }
        }
    }

    fn bad(&mut self, e: &Element, name: &str, text: &str, expected: &str) {
        let kind = FaultKind::BadValue {
            what: format!("`{name}` of <{}>", e.label()),
            text: text.into(),
            expected: expected.into(),
            help:
                "the description does not conform to the standard: contact the vendor of the unit"
                    .into(),
        };
        self.fault(e, name, kind);
    }

    fn flag(&mut self, e: &Element, name: &str) -> bool {
        match e.attr(name) {
            None | Some("false" | "0") => false,
            Some("true" | "1") => true,
            Some(other) => {
                self.bad(e, name, other, "true or false");
                false
            }
        }
    }

    fn whole(&mut self, root: &Element) -> Option<ModelDescription> {
        if root.name != "fmiModelDescription" {
            let kind = FaultKind::WrongRoot {
                found: root.name.clone(),
                expected: "<fmiModelDescription>",
                help: "this is not the description of an FMI unit".into(),
            };
            self.fault(root, "", kind);
            return None;
        }
        let version = match self.need(root, "fmiVersion")? {
            v if v == "2.0" || v.starts_with("2.0.") => FmiVersion::V2,
            v if v == "3.0" || v.starts_with("3.0.") => FmiVersion::V3,
            other => {
                let kind = FaultKind::Unsupported {
                    what: format!("this is a unit of FMI {other}"),
                    help: "export the unit again as FMI 2.0 or 3.0".into(),
                };
                self.fault(root, "fmiVersion", kind);
                return None;
            }
        };
        let token = match version {
            FmiVersion::V2 => self.need(root, "guid"),
            FmiVersion::V3 => self.need(root, "instantiationToken"),
        };
        let name = self.need(root, "modelName");
        let co_simulation = root.child("CoSimulation").and_then(|e| self.interface(e, version));
        let model_exchange = root.child("ModelExchange").and_then(|e| self.interface(e, version));
        let names = self.names(root);
        let (variables, elements) = self.variables(root, version, &names);
        self.unique(&variables, &elements);
        let mut out = ModelDescription {
            version,
            name: name.unwrap_or_default().into(),
            doc: root.attr("description").unwrap_or_default().into(),
            token: token.unwrap_or_default().into(),
            co_simulation,
            model_exchange,
            scheduled_execution: root.child("ScheduledExecution").is_some(),
            variables,
            outputs: Vec::new(),
            states: Vec::new(),
            event_indicators: 0,
            tolerance: None,
        };
        if let Some(e) = root.child("DefaultExperiment") {
            out.tolerance = self.get(e, "tolerance", "a number");
        }
        match version {
            FmiVersion::V2 => self.structure2(root, &elements, &mut out),
            FmiVersion::V3 => self.structure3(root, &elements, &mut out),
        }
        Some(out)
    }

    fn interface(&mut self, e: &Element, version: FmiVersion) -> Option<Interface> {
        let identifier = self.need(e, "modelIdentifier")?;
        let plain = identifier.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
        if !plain || identifier.is_empty() || identifier.len() > 200 {
            let kind = FaultKind::BadName {
                kind: "model identifier",
                name: identifier.into(),
                help: "it is part of file and function names: use letters, digits and _ only"
                    .into(),
            };
            self.fault(e, "modelIdentifier", kind);
            return None;
        }
        let (state, serialize) = match version {
            FmiVersion::V2 => ("canGetAndSetFMUstate", "canSerializeFMUstate"),
            FmiVersion::V3 => ("canGetAndSetFMUState", "canSerializeFMUState"),
        };
        Some(Interface {
            identifier: identifier.into(),
            only_once: self.flag(e, "canBeInstantiatedOnlyOncePerProcess"),
            state: self.flag(e, state),
            serialize: self.flag(e, serialize),
            completed_step: match version {
                FmiVersion::V2 => !self.flag(e, "completedIntegratorStepNotNeeded"),
                FmiVersion::V3 => self.flag(e, "needsCompletedIntegratorStep"),
            },
            fixed_step: self
                .get(e, "fixedInternalStepSize", "a number")
                .filter(|h: &f64| *h > 0.0 && h.is_finite()),
            event_mode: version == FmiVersion::V3 && self.flag(e, "hasEventMode"),
            needs_tool: self.flag(e, "needsExecutionTool"),
        })
    }

    fn names(&mut self, root: &Element) -> Names {
        let mut units = BTreeMap::new();
        for e in root.child("UnitDefinitions").into_iter().flat_map(|d| d.all("Unit")) {
            let Some(name) = self.need(e, "name") else { continue };
            let base = e.child("BaseUnit").map(|b| {
                let mut exponents = [0i8; 8];
                let symbols = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];
                for (k, symbol) in symbols.iter().enumerate() {
                    exponents[k] = self.get(b, symbol, "a small integer").unwrap_or(0);
                }
                let factor = self.get(b, "factor", "a number").unwrap_or(1.0);
                let offset = self.get(b, "offset", "a number").unwrap_or(0.0);
                (exponents, factor, offset)
            });
            units.insert(name.to_string(), UnitDefinition { name: name.into(), base });
        }
        let mut types = BTreeMap::new();
        for e in root.child("TypeDefinitions").iter().flat_map(|d| &d.children) {
            e.touch();
            let Some(name) = e.attr("name") else { continue };
            // 2.0: <SimpleType name><Real unit/></SimpleType>; 3.0: <Float64Type name unit/>.
            let inner = if e.name == "SimpleType" { e.child("Real") } else { Some(e) };
            let Some(inner) = inner else { continue };
            let nominal = self.get(inner, "nominal", "a number");
            let relative = self.flag(inner, RELATIVE);
            let unit = inner.attr("unit").map(str::to_string);
            types.insert(name.to_string(), OfType { unit, nominal, relative });
        }
        Names { units, types }
    }

    fn variables<'e>(
        &mut self,
        root: &'e Element,
        version: FmiVersion,
        names: &Names,
    ) -> (Vec<FmiVariable>, Vec<&'e Element>) {
        let (mut variables, mut elements) = (Vec::new(), Vec::new());
        let Some(list) = root.child("ModelVariables") else {
            let kind = FaultKind::Missing {
                what: "the description".into(),
                missing: "<ModelVariables>".into(),
                help: "the standard requires it: contact the vendor of the unit".into(),
            };
            self.fault(root, "", kind);
            return (variables, elements);
        };
        let sizes = structural_sizes(list, version);
        for e in &list.children {
            e.touch();
            let read = match version {
                FmiVersion::V2 if e.name == "ScalarVariable" => {
                    let typed = e.children.iter().find(|c| VariableKind::of(&c.name).is_some());
                    match typed {
                        Some(typed) => self.variable(e, typed, names, &sizes),
                        None => {
                            let kind = FaultKind::Missing {
                                what: format!("<{}>", e.label()),
                                missing: "type (<Real>, <Integer>, <Boolean>, ..)".into(),
                                help: "the standard requires it: contact the vendor of the unit"
                                    .into(),
                            };
                            self.fault(e, "", kind);
                            None
                        }
                    }
                }
                FmiVersion::V3 if VariableKind::of(&e.name).is_some() => {
                    self.variable(e, e, names, &sizes)
                }
                _ => {
                    let kind = FaultKind::Unsupported {
                        what: format!("<{}> is not a variable type of this version", e.label()),
                        help: "the description does not conform to the standard: contact the vendor of the \
                               unit"
                            .into(),
                    };
                    self.fault(e, "", kind);
                    None
                }
            };
            if let Some(variable) = read {
                variables.push(variable);
                elements.push(e);
            }
        }
        (variables, elements)
    }

    /// Reads a variable: `e` has its name, `typed` its type (in 3.0 the same element).
    fn variable(
        &mut self,
        e: &Element,
        typed: &Element,
        names: &Names,
        sizes: &BTreeMap<u32, u64>,
    ) -> Option<FmiVariable> {
        let name = self.need(e, "name")?.to_string();
        self.need(e, "valueReference")?;
        let reference = self.get(e, "valueReference", "a whole number")?;
        let kind = VariableKind::of(&typed.name)?;
        let causality = match e.attr("causality") {
            None | Some("local") => Causality::Local,
            Some("parameter") => Causality::Parameter,
            Some("calculatedParameter") => Causality::CalculatedParameter,
            Some("structuralParameter") => Causality::StructuralParameter,
            Some("input") => Causality::Input,
            Some("output") => Causality::Output,
            Some("independent") => Causality::Independent,
            Some(other) => {
                self.bad(e, "causality", other, "a value of the standard");
                return None;
            }
        };
        let of_parameter = matches!(
            causality,
            Causality::Parameter | Causality::CalculatedParameter | Causality::StructuralParameter
        );
        let variability = match e.attr("variability") {
            Some("constant") => Variability::Constant,
            Some("fixed") => Variability::Fixed,
            Some("tunable") => Variability::Tunable,
            Some("discrete") => Variability::Discrete,
            Some("continuous") => Variability::Continuous,
            None if of_parameter => Variability::Fixed,
            None if kind.is_float() => Variability::Continuous,
            None => Variability::Discrete,
            Some(other) => {
                self.bad(e, "variability", other, "a value of the standard");
                return None;
            }
        };
        let initial = match e.attr("initial") {
            Some("exact") => Some(Initial::Exact),
            Some("approx") => Some(Initial::Approx),
            Some("calculated") => Some(Initial::Calculated),
            Some(other) => {
                self.bad(e, "initial", other, "exact, approx or calculated");
                return None;
            }
            None => match (causality, variability) {
                (Causality::Independent, _) => None,
                (Causality::Input, _) => Some(Initial::Exact),
                (Causality::Parameter | Causality::StructuralParameter, _)
                | (_, Variability::Constant) => Some(Initial::Exact),
                _ => Some(Initial::Calculated),
            },
        };
        let (unit, nominal, relative) = self.measure(typed, names);
        let clock = if kind == VariableKind::Clock { Some(self.clock(typed)?) } else { None };
        let (size, is_array) = self.size(e, sizes)?;
        let start = match kind {
            VariableKind::String => match typed.attr("start") {
                Some(text) => vec![text.to_string()],
                None => {
                    typed.all("Start").filter_map(|s| s.attr("value")).map(str::to_string).collect()
                }
            },
            _ => typed
                .attr("start")
                .unwrap_or_default()
                .split_whitespace()
                .map(str::to_string)
                .collect(),
        };
        let doc = e.attr("description").unwrap_or_default().to_string();
        Some(FmiVariable {
            name,
            reference,
            kind,
            causality,
            variability,
            initial,
            start,
            size,
            is_array,
            unit,
            relative,
            nominal,
            clock,
            doc,
        })
    }

    /// Reads the ticks of a clock: decimal numbers in s, or counters of a resolution.
    fn clock(&mut self, e: &Element) -> Option<FmiClock> {
        let decimal: Option<f64> = self.get(e, "intervalDecimal", "a number");
        let shift: Option<f64> = self.get(e, "shiftDecimal", "a number");
        let resolution: Option<f64> = self.get(e, "resolution", "a whole number");
        let counted = |reader: &mut Self, name: &str| -> Option<f64> {
            let counter: f64 = reader.get(e, name, "a whole number")?;
            resolution.map(|r| counter / r)
        };
        let interval = decimal.or(counted(self, "intervalCounter"));
        let shift = shift.or(counted(self, "shiftCounter")).unwrap_or(0.0);
        match self.need(e, "intervalVariability")? {
            "constant" | "fixed" | "tunable" => {
                let Some(interval) = interval else { return Some(FmiClock::Changing) };
                for (name, value, good) in [
                    ("intervalDecimal", interval, interval > 0.0 && interval.is_finite()),
                    ("shiftDecimal", shift, shift >= 0.0 && shift.is_finite()),
                ] {
                    if !good {
                        let wanted = "a positive interval and a shift of 0 or more, in s";
                        self.bad(e, name, &value.to_string(), wanted);
                        return None;
                    }
                }
                Some(FmiClock::Periodic { interval, shift })
            }
            "countdown" => Some(FmiClock::Countdown),
            "triggered" => Some(FmiClock::Triggered),
            "changing" => Some(FmiClock::Changing),
            other => {
                self.bad(e, "intervalVariability", other, "a value of the standard");
                None
            }
        }
    }

    /// Returns unit, typical magnitude, and whether it is a difference. The unit of a difference has no offset: 5 degC as a difference are 5 K.
    fn measure(
        &mut self,
        e: &Element,
        names: &Names,
    ) -> (Option<UnitDefinition>, Option<f64>, bool) {
        let of_type = e.attr("declaredType").and_then(|t| names.types.get(t));
        let nominal = self.get(e, "nominal", "a number").or(of_type.and_then(|t| t.nominal));
        let unit = e.attr("unit").map(str::to_string).or(of_type.and_then(|t| t.unit.clone()));
        let relative = match e.attr(RELATIVE) {
            Some(_) => self.flag(e, RELATIVE),
            None => of_type.is_some_and(|t| t.relative),
        };
        let unit = unit.map(|name| match names.units.get(&name) {
            Some(UnitDefinition { base: Some((exponents, factor, _)), .. }) if relative => {
                UnitDefinition { name, base: Some((*exponents, *factor, 0.0)) }
            }
            Some(defined) => defined.clone(),
            None => UnitDefinition { name, base: None },
        });
        (unit, nominal, relative)
    }

    fn size(&mut self, e: &Element, sizes: &BTreeMap<u32, u64>) -> Option<(usize, bool)> {
        let (mut size, mut any) = (1u64, false);
        for d in e.all("Dimension") {
            any = true;
            let fixed: Option<u64> = self.get(d, "start", "a whole number");
            let by: Option<u32> = self.get(d, "valueReference", "a whole number");
            match fixed.or_else(|| sizes.get(&by?).copied()) {
                Some(n) => size = size.saturating_mul(n),
                None => {
                    let kind = FaultKind::Missing {
                        what: format!("a dimension of <{}>", e.label()),
                        missing: "size".into(),
                        help:
                            "give it a `start`, or the reference of a structural parameter with one"
                                .into(),
                    };
                    self.fault(d, "", kind);
                    return None;
                }
            }
        }
        if size > VALUES_MAX as u64 {
            let kind = FaultKind::Unsupported {
                what: format!("<{}> has {size} values, the limit is {VALUES_MAX}", e.label()),
                help: "export a smaller array".into(),
            };
            self.fault(e, "", kind);
            return None;
        }
        Some((size as usize, any))
    }

    fn unique(&mut self, variables: &[FmiVariable], elements: &[&Element]) {
        let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
        for (k, v) in variables.iter().enumerate() {
            if let Some(first) = seen.insert(&v.name, k) {
                let kind = FaultKind::Duplicate {
                    kind: "variable",
                    name: v.name.clone(),
                    first: elements[first].place(),
                };
                self.fault(elements[k], "name", kind);
            }
        }
    }

    fn lost(&mut self, e: &Element, attribute: &str, text: &str) {
        let kind = FaultKind::UnknownName {
            what: format!("<{}>", e.name),
            kind: "variable",
            name: text.into(),
            help: "the model structure refers to an unknown variable".into(),
        };
        self.fault(e, attribute, kind);
    }

    /// Returns the indices of the variables in a list attribute.
    fn places(
        &mut self,
        e: &Element,
        attribute: &str,
        place: &dyn Fn(u32) -> Option<usize>,
    ) -> Option<Vec<usize>> {
        let text = e.attr(attribute)?;
        let mut out = Vec::new();
        for word in text.split_whitespace() {
            match word.parse().ok().and_then(place) {
                Some(k) => out.push(k),
                None => self.lost(e, attribute, word),
            }
        }
        Some(out)
    }

    fn structure2(&mut self, root: &Element, elements: &[&Element], out: &mut ModelDescription) {
        out.event_indicators = self
            .get(root, "numberOfEventIndicators", "a whole number")
            .filter(|n| *n <= VALUES_MAX)
            .unwrap_or(0);
        let count = out.variables.len();
        let place = |index: u32| (index as usize).checked_sub(1).filter(|k| *k < count);
        let Some(structure) = root.child("ModelStructure") else { return };
        for e in structure.child("Outputs").into_iter().flat_map(|o| o.all("Unknown")) {
            let Some(k) = self.places(e, "index", &place).and_then(|k| k.first().copied()) else {
                self.need(e, "index");
                continue;
            };
            let dependencies = self.places(e, "dependencies", &place);
            out.outputs.push(OutputStructure { variable: k, dependencies });
        }
        for e in structure.child("Derivatives").into_iter().flat_map(|o| o.all("Unknown")) {
            let Some(k) = self.places(e, "index", &place).and_then(|k| k.first().copied()) else {
                self.need(e, "index");
                continue;
            };
            let real = elements[k].child("Real");
            let state = real.and_then(|r| self.places(r, "derivative", &place));
            match state.and_then(|s| s.first().copied()) {
                Some(state) => out.states.push((state, k)),
                None => self.no_derivative(elements[k]),
            }
        }
    }

    fn structure3(&mut self, root: &Element, elements: &[&Element], out: &mut ModelDescription) {
        let places: BTreeMap<u32, usize> =
            out.variables.iter().enumerate().map(|(k, v)| (v.reference, k)).collect();
        if places.len() < out.variables.len() {
            let mut seen = BTreeSet::new();
            for (v, e) in out.variables.iter().zip(elements) {
                if !seen.insert(v.reference) {
                    let text = v.reference.to_string();
                    self.bad(e, "valueReference", &text, "unique");
                }
            }
        }
        let place = |reference: u32| places.get(&reference).copied();
        let Some(structure) = root.child("ModelStructure") else { return };
        for e in &structure.children {
            e.touch();
            if !["Output", "ContinuousStateDerivative", "EventIndicator"].contains(&e.name.as_str())
            {
                continue;
            }
            let found = self.places(e, "valueReference", &place);
            let Some(k) = found.and_then(|k| k.first().copied()) else {
                self.need(e, "valueReference");
                continue;
            };
            match e.name.as_str() {
                "Output" => {
                    let dependencies = self.places(e, "dependencies", &place);
                    out.outputs.push(OutputStructure { variable: k, dependencies });
                }
                "EventIndicator" => out.event_indicators += out.variables[k].size,
                _ => match self
                    .places(elements[k], "derivative", &place)
                    .and_then(|s| s.first().copied())
                {
                    Some(state) => out.states.push((state, k)),
                    None => self.no_derivative(elements[k]),
                },
            }
        }
        out.event_indicators = out.event_indicators.min(VALUES_MAX);
    }

    fn no_derivative(&mut self, e: &Element) {
        let kind = FaultKind::Missing {
            what: format!("the state derivative <{}>", e.label()),
            missing: "attribute `derivative`".into(),
            help: "the state of the derivative must be specified: contact the vendor of the unit"
                .into(),
        };
        self.fault(e, "derivative", kind);
    }
}

/// Returns start values of structural parameters and constants, by reference, for the sizes of arrays.
fn structural_sizes(list: &Element, version: FmiVersion) -> BTreeMap<u32, u64> {
    if version == FmiVersion::V2 {
        return BTreeMap::new();
    }
    let of = |e: &Element| {
        let reference = e.attr("valueReference")?.parse().ok()?;
        Some((reference, e.attr("start")?.parse().ok()?))
    };
    list.children.iter().filter(|e| e.name == "UInt64").filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const TWO: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="ball" guid="{1}" numberOfEventIndicators="1">
  <ModelExchange modelIdentifier="ball" canGetAndSetFMUstate="true" completedIntegratorStepNotNeeded="true"/>
  <UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit><Unit name="deg"><BaseUnit rad="1" factor="0.0174532925199433"/></Unit></UnitDefinitions>
  <TypeDefinitions><SimpleType name="Length"><Real unit="m"/></SimpleType></TypeDefinitions>
  <ModelVariables>
    <ScalarVariable name="h" valueReference="0" causality="output" initial="exact"><Real declaredType="Length" start="1"/></ScalarVariable>
    <ScalarVariable name="der(h)" valueReference="1"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="u" valueReference="2" causality="input"><Real start="0" unit="deg"/></ScalarVariable>
    <ScalarVariable name="n" valueReference="0" causality="output"><Integer/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1" dependencies=""/><Unknown index="4"/></Outputs>
    <Derivatives><Unknown index="2"/></Derivatives>
  </ModelStructure>
</fmiModelDescription>"#;

    const THREE: &str = r#"<fmiModelDescription fmiVersion="3.0" modelName="arrays" instantiationToken="{2}">
  <CoSimulation modelIdentifier="arrays" canGetAndSetFMUState="true" canSerializeFMUState="true" fixedInternalStepSize="0.001"/>
  <UnitDefinitions><Unit name="A"><BaseUnit A="1"/></Unit></UnitDefinitions>
  <ModelVariables>
    <UInt64 name="n" valueReference="9" causality="structuralParameter" start="3"/>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="i" valueReference="1" causality="input" unit="A" start="1 2 3"><Dimension valueReference="9"/></Float64>
    <Float64 name="y" valueReference="2" causality="output"><Dimension start="2"/><Dimension start="2"/></Float64>
    <Boolean name="on" valueReference="3" causality="output"/>
    <String name="s" valueReference="4" causality="parameter"><Start value="a b"/></String>
  </ModelVariables>
  <ModelStructure><Output valueReference="2" dependencies="1"/><Output valueReference="3"/></ModelStructure>
</fmiModelDescription>"#;

    #[test]
    fn both_versions_give_one_structure() {
        let d = read_model_description(TWO, "two").unwrap();
        assert_eq!((d.version, &*d.token, d.event_indicators), (FmiVersion::V2, "{1}", 1));
        assert_eq!(d.states, [(0, 1)]);
        let me = d.model_exchange.unwrap();
        assert!(me.state && !me.serialize && !me.completed_step && d.co_simulation.is_none());
        assert_eq!(d.outputs[0].dependencies.as_deref(), Some(&[][..]), "empty: on nothing");
        assert_eq!(d.outputs[1].dependencies, None, "absent: on everything");
        let unit = d.variables[0].unit.clone().unwrap();
        assert_eq!((&*unit.name, unit.base), ("m", Some(([0, 1, 0, 0, 0, 0, 0, 0], 1.0, 0.0))));
        assert_eq!(d.variables[2].unit.clone().unwrap().base.unwrap().1, 0.0174532925199433);
        assert_eq!(d.variables[3].variability, Variability::Discrete);

        let d = read_model_description(THREE, "three").unwrap();
        let sizes: Vec<usize> = d.variables.iter().map(|v| v.size).collect();
        assert_eq!(sizes, [1, 1, 3, 4, 1, 1]);
        assert_eq!(d.variables[2].start, ["1", "2", "3"]);
        assert_eq!(d.variables[5].start, ["a b"]);
        assert_eq!(d.variables[2].unit.clone().unwrap().base.unwrap().0, [0, 0, 0, 1, 0, 0, 0, 0]);
        assert_eq!(d.outputs[0].dependencies.as_deref(), Some(&[2][..]));
        assert_eq!(d.co_simulation.unwrap().fixed_step, Some(0.001));
    }

    #[test]
    fn mistakes_are_told_with_their_place() {
        let refused = |text: &str, phrases: &[&str]| {
            let e = read_model_description(text, "d.xml").unwrap_err().to_string();
            for phrase in phrases {
                assert!(e.contains(phrase), "{phrase}\n{e}");
            }
        };
        refused("<a", &["d.xml:1:", "well-formed"]);
        refused("<robot/>", &["d.xml:1:1", "<robot>"]);
        refused(&TWO.replace("fmiVersion=\"2.0\"", "fmiVersion=\"1.0\""), &["FMI 1.0", "help"]);
        refused(&TWO.replace(" guid=\"{1}\"", ""), &["d.xml:2:1", "`guid`"]);
        refused(
            &TWO.replace("=\"ball\" can", "=\"../../evil\" can"),
            &["../../evil", "letters, digits"],
        );
        refused(&TWO.replace("<Unknown index=\"4\"/>", "<Unknown index=\"9\"/>"), &["`9`"]);
        refused(&TWO.replace("derivative=\"1\"", ""), &["der(h)", "`derivative`"]);
        refused(&TWO.replace("name=\"n\"", "name=\"h\""), &["`h` is defined again"]);
        // Several mistakes are reported at once.
        let twice =
            TWO.replace("start=\"1\"", "").replace("causality=\"input\"", "causality=\"in\"");
        let twice = twice.replace("valueReference=\"1\"", "valueReference=\"-1\"");
        refused(&twice, &["`in`", "`-1`"]);
        refused(
            &THREE.replace("start=\"2\"/><Dim", "start=\"999999999\"/><Dim"),
            &["the limit is"],
        );
        refused(
            &THREE.replace("valueReference=\"9\"/>", "valueReference=\"8\"/>"),
            &["lacks size"],
        );
        refused(&THREE.replace("\"3\" causality", "\"2\" causality"), &["unique"]);
    }
}
