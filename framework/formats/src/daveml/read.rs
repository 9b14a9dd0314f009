//! Reads the elements of a DAVE-ML file into a [`DaveModel`] and collects mistakes.

use super::axis::{Axis, Interpolation};
use super::mathml::{Expression, Formulas};
use super::scattered::Scattered;
use super::table::{DIMENSIONS, Function, Grid};
use super::{DaveModel, DaveVariable, Making, Role, Shot, ShotValue};
use crate::FormatError;
use crate::error::{FaultKind, FileFault, FilePlace};
use crate::xml::{self, Element};
use linkwork_names::suggest;
use std::collections::BTreeMap;

/// Reads a model.
///
/// # Errors
/// Every mistake with its position: not XML, another root, missing or unknown variables, breakpoints and tables, tables of another size than their
/// breakpoints, invalid formulas, circular definitions.
pub fn read_dave(text: &str, file: &str) -> Result<DaveModel, FormatError> {
    let root = xml::parse_with(text, file, xml::Declarations::Allowed, xml::DEPTH)?;
    let mut reader = Reader { faults: Vec::new(), variables: Vec::new(), ids: BTreeMap::new() };
    match reader.whole(&root) {
        Some(model) if reader.faults.is_empty() => Ok(model),
        _ => Err(FormatError { faults: reader.faults }),
    }
}

/// Shared tables and breakpoints of functions.
struct Shared<'e> {
    breakpoints: BTreeMap<String, Vec<f64>>,
    tables: BTreeMap<String, &'e Element>,
    /// Tables without a grid.
    ungridded: BTreeMap<String, &'e Element>,
}

struct Reader {
    faults: Vec<FileFault>,
    variables: Vec<DaveVariable>,
    /// Index of each variable, and the position of its definition.
    ids: BTreeMap<String, (usize, FilePlace)>,
}

/// Reads numbers separated by commas or white space.
fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split([',', ' ', '\t', '\n', '\r', ';'])
        .filter(|t| !t.is_empty())
        .map(|t| t.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| t.to_string()))
        .collect()
}

impl Reader {
    fn fault(&mut self, e: &Element, attribute: &str, kind: FaultKind) {
        self.faults.push(FileFault { place: e.place_of(attribute), kind });
    }

    fn bad(&mut self, e: &Element, attribute: &str, text: &str, expected: &str, help: &str) {
        let what = if attribute.is_empty() {
            format!("<{}>", e.label())
        } else {
            format!("`{attribute}` of <{}>", e.label())
        };
        let kind = FaultKind::BadValue {
            what,
            text: text.into(),
            expected: expected.into(),
            help: help.into(),
        };
        self.fault(e, attribute, kind);
    }

    fn need<'e>(&mut self, e: &'e Element, name: &str) -> Option<&'e str> {
        let found = e.attr(name);
        if found.is_none() {
            let kind = FaultKind::Missing {
                what: format!("<{}>", e.label()),
                missing: format!("attribute `{name}`"),
                help: format!("write {name}=\"…\""),
            };
            self.fault(e, "", kind);
        }
        found
    }

    fn need_child<'e>(&mut self, e: &'e Element, name: &str) -> Option<&'e Element> {
        let found = e.child(name);
        if found.is_none() {
            let kind = FaultKind::Missing {
                what: format!("<{}>", e.label()),
                missing: format!("<{name}>"),
                help: format!("write <{name}> in it"),
            };
            self.fault(e, "", kind);
        }
        found
    }

    /// Reads an optional number in an attribute.
    fn number(&mut self, e: &Element, name: &str) -> Option<f64> {
        let text = e.attr(name)?;
        match text.parse::<f64>() {
            Ok(x) if !x.is_nan() => Some(x),
            _ => {
                self.bad(e, name, text, "a number", "write a number such as 0.25");
                None
            }
        }
    }

    fn list(&mut self, e: &Element) -> Option<Vec<f64>> {
        match numbers(&e.text) {
            Ok(list) => Some(list),
            Err(word) => {
                self.bad(e, "", &word, "a number", "separate numbers by commas or white space");
                None
            }
        }
    }

    fn variable(&mut self, e: &Element, attribute: &str, id: &str) -> Option<usize> {
        if let Some((k, _)) = self.ids.get(id) {
            return Some(*k);
        }
        let kind = FaultKind::UnknownName {
            what: format!("<{}>", e.label()),
            kind: "variable",
            name: id.into(),
            help: suggest(id, "variable", self.ids.keys().map(String::as_str)),
        };
        self.fault(e, attribute, kind);
        None
    }

    fn whole(&mut self, root: &Element) -> Option<DaveModel> {
        if root.name != "DAVEfunc" {
            let kind = FaultKind::WrongRoot {
                found: root.name.clone(),
                expected: "<DAVEfunc>",
                help: "this is not a DAVE-ML file".into(),
            };
            self.fault(root, "", kind);
            return None;
        }
        // These attributes refer to the schema of the document, so mark them as read.
        for name in ["xmlns", "schemaLocation", "xsi:schemaLocation"] {
            root.attr(name);
        }
        let name = root.child("fileHeader").and_then(|h| h.attr("name")).unwrap_or_default();
        let definitions: Vec<&Element> = root.all("variableDef").collect();
        for e in &definitions {
            self.define(e);
        }
        let mut making: Vec<Option<Making>> = vec![None; self.variables.len()];
        for e in definitions {
            self.formula(e, &mut making);
        }
        let shared = self.shared(root);
        for e in root.all("function") {
            self.function(e, &shared, &mut making);
        }
        self.roles(&making);
        let shots = self.shots(root);
        let order = self.order(making, root)?;
        Some(DaveModel {
            name: name.to_string(),
            variables: std::mem::take(&mut self.variables),
            shots,
            ignored: root.unread(None),
            order,
        })
    }

    fn define(&mut self, e: &Element) {
        let Some(id) = self.need(e, "varID").map(String::from) else { return };
        let place = e.place_of("varID");
        if let Some((_, first)) = self.ids.get(&id) {
            let kind =
                FaultKind::Duplicate { kind: "variable", name: id.clone(), first: first.clone() };
            self.fault(e, "varID", kind);
            return;
        }
        let limit = |r: &mut Self, name: &str, none: f64| r.number(e, name).unwrap_or(none);
        let limits =
            [limit(self, "minValue", f64::NEG_INFINITY), limit(self, "maxValue", f64::INFINITY)];
        if limits[0] > limits[1] {
            let text = format!("{}", limits[0]);
            self.bad(e, "minValue", &text, "at most maxValue", "swap the two");
            return;
        }
        let initial = self.number(e, "initialValue");
        let flag = |name: &str| {
            e.child(name).is_some_and(|c| {
                c.touch_all();
                true
            })
        };
        // The caller must set it, even if it has an initial value.
        let given = flag("isInput") | flag("isControl") | flag("isDisturbance");
        let doc = e.child_text("description").map_or("", |(_, t)| t);
        let variable = DaveVariable {
            name: self.need(e, "name").unwrap_or_default().to_string(),
            units: self.need(e, "units").unwrap_or_default().to_string(),
            sign: e.attr("sign").unwrap_or_default().to_string(),
            doc: doc.split_whitespace().collect::<Vec<_>>().join(" "),
            role: if given { Role::Input } else { Role::Constant },
            output: flag("isOutput"),
            standard: flag("isStdAIAA"),
            initial,
            limits,
            id: id.clone(),
        };
        // These attributes only describe the variable, so mark them as read.
        for word in ["axisSystem", "symbol", "alias"] {
            e.attr(word);
        }
        for word in ["isState", "isStateDeriv"] {
            flag(word);
        }
        self.ids.insert(id, (self.variables.len(), place));
        self.variables.push(variable);
    }

    /// Sets the computation of a result, which has only one and is neither input nor constant.
    fn make(&mut self, e: &Element, k: usize, new: Making, making: &mut [Option<Making>]) {
        let id = self.variables[k].id.clone();
        if making[k].is_some() {
            let first = self.ids[&id].1.clone();
            self.fault(e, "", FaultKind::Duplicate { kind: "formula of", name: id, first });
            return;
        }
        if self.variables[k].role == Role::Input {
            let help = "remove <isInput/> or the formula";
            self.bad(e, "", &id, "a computed variable", help);
            return;
        }
        making[k] = Some(new);
    }

    fn formula(&mut self, e: &Element, making: &mut [Option<Making>]) {
        let Some(k) = e.attr("varID").and_then(|id| self.ids.get(id)).map(|v| v.0) else { return };
        let Some(calculation) = e.child("calculation") else { return };
        let Some(math) = self.need_child(calculation, "math") else { return };
        math.attr("xmlns");
        let ids = &self.ids;
        let find = |id: &str| ids.get(id).map(|v| v.0);
        let nearest = |id: &str| suggest(id, "variable", ids.keys().map(String::as_str));
        let mut formulas = Formulas { find: &find, nearest: &nearest, faults: &mut self.faults };
        if let Some(expression) = formulas.math(math) {
            self.make(e, k, Making::Formula(expression), making);
        }
    }

    fn shared<'e>(&mut self, root: &'e Element) -> Shared<'e> {
        let mut shared = Shared {
            breakpoints: BTreeMap::new(),
            tables: BTreeMap::new(),
            ungridded: BTreeMap::new(),
        };
        for e in root.all("breakpointDef") {
            e.attr("name");
            e.attr("units");
            let Some(id) = self.need(e, "bpID").map(String::from) else { continue };
            let Some(values) = self.need_child(e, "bpVals") else { continue };
            let Some(list) = self.list(values) else { continue };
            if list.is_empty() || list.windows(2).any(|w| !(w[1] > w[0])) {
                let help = "write each breakpoint once, in increasing order";
                self.bad(values, "", &values.text, "rising breakpoints", help);
                continue;
            }
            if shared.breakpoints.insert(id.clone(), list).is_some() {
                let kind = FaultKind::Duplicate { kind: "breakpoints", name: id, first: e.place() };
                self.fault(e, "bpID", kind);
            }
        }
        for (name, key, tables) in [
            ("griddedTableDef", "gtID", &mut shared.tables),
            ("ungriddedTableDef", "utID", &mut shared.ungridded),
        ] {
            for e in root.all(name) {
                let Some(id) = self.need(e, key).map(String::from) else { continue };
                if let Some(old) = tables.insert(id.clone(), e) {
                    let kind = FaultKind::Duplicate { kind: "table", name: id, first: old.place() };
                    self.fault(e, key, kind);
                }
            }
        }
        shared
    }

    fn function(&mut self, e: &Element, shared: &Shared<'_>, making: &mut [Option<Making>]) {
        e.attr("name");
        // A simple function contains its points. Other functions contain a definition or refer to
        // one.
        let read = match e.child("independentVarPts") {
            Some(_) => self.simple(e),
            None => self.gridded(e, shared),
        };
        if let Some((result, function)) = read {
            self.make(e, result, Making::Table(function), making);
        }
    }

    fn axis(&mut self, e: &Element, points: Vec<f64>) -> Option<Axis> {
        for word in ["name", "units", "sign"] {
            e.attr(word);
        }
        let id = self.need(e, "varID")?.to_string();
        let variable = self.variable(e, "varID", &id);
        let (low, high) = (self.number(e, "min"), self.number(e, "max"));
        let beyond = match e.attr("extrapolate").unwrap_or("neither") {
            "neither" => [false, false],
            "min" | "minimum" => [true, false],
            "max" | "maximum" => [false, true],
            "both" => [true, true],
            other => {
                let help = "write neither, min, max or both";
                self.bad(e, "extrapolate", other, "a valid extrapolation", help);
                return None;
            }
        };
        let way = match e.attr("interpolate").unwrap_or("linear") {
            "linear" => Interpolation::Linear,
            "discrete" => Interpolation::Nearest,
            "floor" => Interpolation::Floor,
            "ceiling" => Interpolation::Ceiling,
            other => {
                let help = "write linear, discrete, floor or ceiling; resample a spline finely";
                self.bad(e, "interpolate", other, "a supported interpolation", help);
                return None;
            }
        };
        let limits = [low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY)];
        if limits[0] > limits[1] {
            self.bad(e, "min", &limits[0].to_string(), "at most max", "swap the two");
            return None;
        }
        Some(Axis { variable: variable?, points, way, beyond, limits })
    }

    /// Reads a function of one independent variable that contains its points.
    fn simple(&mut self, e: &Element) -> Option<(usize, Function)> {
        let independent: Vec<&Element> = e.all("independentVarPts").collect();
        let dependent = self.need_child(e, "dependentVarPts")?;
        for word in ["name", "units", "sign"] {
            dependent.attr(word);
        }
        let id = self.need(dependent, "varID")?.to_string();
        let result = self.variable(dependent, "varID", &id);
        let mut axes = Vec::new();
        for i in independent {
            let points = self.list(i)?;
            if points.is_empty() || points.windows(2).any(|w| !(w[1] > w[0])) {
                let help = "write each point once, in increasing order";
                self.bad(i, "", &i.text, "rising points", help);
                return None;
            }
            axes.push(self.axis(i, points)?);
        }
        let data = self.list(dependent)?;
        self.sized(dependent, axes, data).and_then(|f| Some((result?, f)))
    }

    fn gridded(&mut self, e: &Element, shared: &Shared<'_>) -> Option<(usize, Function)> {
        let references: Vec<&Element> = e.all("independentVarRef").collect();
        let dependent = self.need_child(e, "dependentVarRef")?;
        let id = self.need(dependent, "varID")?.to_string();
        let result = self.variable(dependent, "varID", &id);
        let definition = self.need_child(e, "functionDefn")?;
        definition.attr("name");
        let without = ["ungriddedTableRef", "ungriddedTableDef", "ungriddedTable"];
        if without.iter().any(|name| definition.child(name).is_some()) {
            let names = ["ungriddedTable", "utID"];
            let table = self.referred(e, definition, names, &shared.ungridded)?;
            let mut axes = Vec::new();
            for r in references {
                axes.push((r, self.axis(r, Vec::new())?));
            }
            return self.scattered(table, axes).and_then(|f| Some((result?, f)));
        }
        let table = self.referred(e, definition, ["griddedTable", "gtID"], &shared.tables)?;
        let (breakpoints, data) = self.table(table, shared)?;
        if breakpoints.len() != references.len() {
            let text = format!("{} breakpoint sets", breakpoints.len());
            let expected = format!("{}, one for each independentVarRef", references.len());
            self.bad(table, "", &text, &expected, "write a bpRef for each variable, in order");
            return None;
        }
        let mut axes = Vec::new();
        for (r, points) in references.into_iter().zip(breakpoints) {
            axes.push(self.axis(r, points)?);
        }
        self.sized(table, axes, data).and_then(|f| Some((result?, f)))
    }

    /// Finds the table of a function: contained in its definition, or referred to.
    fn referred<'e>(
        &mut self,
        e: &Element,
        definition: &'e Element,
        [name, key]: [&str; 2],
        tables: &BTreeMap<String, &'e Element>,
    ) -> Option<&'e Element> {
        if let Some(inline) =
            [format!("{name}Def"), name.to_string()].iter().find_map(|n| definition.child(n))
        {
            return Some(inline);
        }
        let Some(r) = definition.child(&format!("{name}Ref")) else {
            let kind = FaultKind::Missing {
                what: format!("<{}>", e.label()),
                missing: "table".into(),
                help: "write <griddedTableRef gtID=\"…\"/> or <griddedTableDef>".into(),
            };
            self.fault(definition, "", kind);
            return None;
        };
        let id = self.need(r, key)?.to_string();
        let found = tables.get(&id).copied();
        if found.is_none() {
            let kind = FaultKind::UnknownName {
                what: format!("<{}>", e.label()),
                kind: "table",
                help: suggest(&id, "table", tables.keys().map(String::as_str)),
                name: id,
            };
            self.fault(r, key, kind);
        }
        found
    }

    /// Reads points without a grid: of one variable a table over the points, of two a triangulation.
    fn scattered(&mut self, e: &Element, axes: Vec<(&Element, Axis)>) -> Option<Function> {
        for word in ["name", "units", "utID"] {
            e.attr(word);
        }
        let n = axes.len();
        let mut rows = Vec::new();
        for point in e.all("dataPoint") {
            // Mark the attribute that names the modification of the file as read.
            point.attr("modID");
            let row = self.list(point)?;
            if row.len() != n + 1 {
                let expected = format!("{}: each independent variable and the value", n + 1);
                let help = "write the variables in the order of independentVarRef, then the value";
                self.bad(point, "", &format!("{} numbers", row.len()), &expected, help);
                return None;
            }
            rows.push(row);
        }
        if n == 1 {
            rows.sort_by(|a, b| a[0].total_cmp(&b[0]));
            if rows.is_empty() || rows.windows(2).any(|w| !(w[1][0] > w[0][0])) {
                let help = "write one dataPoint for each position";
                self.bad(
                    e,
                    "",
                    &format!("{} points", rows.len()),
                    "points at different positions",
                    help,
                );
                return None;
            }
            let (_, mut axis) = axes.into_iter().next()?;
            axis.points = rows.iter().map(|row| row[0]).collect();
            let data = rows.iter().map(|row| row[1]).collect();
            return Some(Function::Grid(Grid { axes: vec![axis], data }));
        }
        let axes: [(&Element, Axis); 2] = axes
            .try_into()
            .map_err(|_| {
                let kind = FaultKind::Unsupported {
                    what: format!("<{}> is a table of {n} variables without a grid", e.label()),
                    help: "resample it on a grid: <griddedTableDef>".into(),
                };
                self.fault(e, "", kind);
            })
            .ok()?;
        for (r, axis) in &axes {
            if axis.way != Interpolation::Linear || axis.beyond != [false; 2] {
                let kind = FaultKind::Unsupported {
                    what: format!(
                        "<{}>: without a grid a table of two variables is linear, and ends at its hull",
                        r.label()
                    ),
                    help: "remove `interpolate` and `extrapolate`, or resample it on a grid".into(),
                };
                self.fault(r, "", kind);
                return None;
            }
        }
        let rows: Vec<[f64; 3]> = rows.iter().map(|row| [row[0], row[1], row[2]]).collect();
        match Scattered::new(axes.map(|(_, axis)| axis), &rows) {
            Ok(table) => Some(Function::Scattered(table)),
            Err([fact, help]) => {
                self.bad(e, "", fact, "points that span a surface, one value at each", help);
                None
            }
        }
    }

    /// Reads breakpoints of each axis, and data.
    fn table(&mut self, e: &Element, shared: &Shared<'_>) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
        for word in ["name", "units", "gtID"] {
            e.attr(word);
        }
        let mut breakpoints = Vec::new();
        for r in self.need_child(e, "breakpointRefs")?.all("bpRef") {
            let id = self.need(r, "bpID")?.to_string();
            match shared.breakpoints.get(&id) {
                Some(b) => breakpoints.push(b.clone()),
                None => {
                    let all = shared.breakpoints.keys().map(String::as_str);
                    let kind = FaultKind::UnknownName {
                        what: format!("<{}>", e.label()),
                        kind: "breakpoints",
                        help: suggest(&id, "breakpoints", all),
                        name: id,
                    };
                    self.fault(r, "bpID", kind);
                    return None;
                }
            }
        }
        let table = self.need_child(e, "dataTable")?;
        Some((breakpoints, self.list(table)?))
    }

    fn sized(&mut self, e: &Element, axes: Vec<Axis>, data: Vec<f64>) -> Option<Function> {
        if axes.is_empty() || axes.len() > DIMENSIONS {
            let expected = format!("1 to {DIMENSIONS}");
            let text = format!("{} independent variables", axes.len());
            self.bad(e, "", &text, &expected, "split the function");
            return None;
        }
        let wanted: usize = axes.iter().map(|a| a.points.len()).product();
        if wanted != data.len() {
            let sizes: Vec<String> = axes.iter().map(|a| a.points.len().to_string()).collect();
            let expected = format!("{wanted} ({})", sizes.join(" × "));
            let help = "write a value for each combination, the last variable fastest";
            self.bad(e, "", &format!("{} numbers", data.len()), &expected, help);
            return None;
        }
        Some(Function::Grid(Grid { axes, data }))
    }

    /// Makes a variable without value and formula an input.
    fn roles(&mut self, making: &[Option<Making>]) {
        for (v, m) in self.variables.iter_mut().zip(making) {
            if m.is_some() {
                v.role = Role::Result;
            } else if v.initial.is_none() {
                v.role = Role::Input;
            }
        }
    }

    fn order(
        &mut self,
        mut making: Vec<Option<Making>>,
        root: &Element,
    ) -> Option<Vec<(usize, Making)>> {
        let needs: Vec<Vec<usize>> = making
            .iter()
            .map(|m| {
                let mut all = Vec::new();
                match m {
                    Some(Making::Formula(e)) => Expression::variables(e, &mut all),
                    Some(Making::Table(f)) => all.extend(f.variables()),
                    None => {}
                }
                all
            })
            .collect();
        let mut done: Vec<bool> = making.iter().map(Option::is_none).collect();
        let mut order = Vec::new();
        loop {
            let ready: Vec<usize> = (0..done.len())
                .filter(|k| !done[*k] && needs[*k].iter().all(|n| done[*n]))
                .collect();
            if ready.is_empty() {
                break;
            }
            for k in ready {
                done[k] = true;
                order.extend(making[k].take().map(|m| (k, m)));
            }
        }
        let left: Vec<&str> = (done.iter().zip(&self.variables))
            .filter(|(d, _)| !**d)
            .map(|(_, v)| v.id.as_str())
            .collect();
        if left.is_empty() {
            return Some(order);
        }
        let kind = FaultKind::Unsupported {
            what: format!("the definitions of variables are circular: {}", left.join(", ")),
            help: "change one of them to an input".into(),
        };
        let place = self.ids.get(left[0]).map_or_else(|| root.place(), |v| v.1.clone());
        self.faults.push(FileFault { place, kind });
        None
    }

    fn shots(&mut self, root: &Element) -> Vec<Shot> {
        let Some(data) = root.child("checkData") else { return Vec::new() };
        let mut out = Vec::new();
        for e in data.all("staticShot") {
            let mut shot = Shot {
                name: e.attr("name").unwrap_or_default().to_string(),
                line: e.line,
                inputs: Vec::new(),
                wanted: Vec::new(),
            };
            for (group, given) in
                [("checkInputs", true), ("internalValues", false), ("checkOutputs", false)]
            {
                for s in e.child(group).iter().flat_map(|g| g.all("signal")) {
                    let Some(value) = self.signal(s) else { continue };
                    if given && !DaveModel::settable(self.variables[value.variable].role) {
                        let id = self.variables[value.variable].id.clone();
                        self.bad(s, "", &id, "an input", "move it to <internalValues>");
                    } else if given {
                        shot.inputs.push(value);
                    } else {
                        shot.wanted.push(value);
                    }
                }
            }
            out.push(shot);
        }
        out
    }

    fn signal(&mut self, e: &Element) -> Option<ShotValue> {
        let by_id = ["varID", "signalID"].iter().find_map(|n| e.child_text(n));
        let (place, variable) = match (by_id, e.child_text("signalName")) {
            (Some((c, id)), name) => {
                // A signal may have an identifier and a name; use the identifier.
                let _ = name;
                (c, self.ids.get(id).map(|v| v.0))
            }
            (None, Some((c, name))) => (c, self.variables.iter().position(|v| v.name == name)),
            (None, None) => {
                let kind = FaultKind::Missing {
                    what: "<signal>".into(),
                    missing: "<signalName> or <varID>".into(),
                    help: "name the variable".into(),
                };
                self.fault(e, "", kind);
                return None;
            }
        };
        let Some(variable) = variable else {
            let names = self.variables.iter().flat_map(|v| [v.id.as_str(), v.name.as_str()]);
            let kind = FaultKind::UnknownName {
                what: "<signal>".into(),
                kind: "variable",
                name: place.text.clone(),
                help: suggest(&place.text, "variable", names),
            };
            self.fault(place, "", kind);
            return None;
        };
        if let Some((c, units)) = e.child_text("signalUnits")
            && units != self.variables[variable].units
        {
            let expected = format!("`{}` as the variable", self.variables[variable].units);
            self.bad(c, "", units, &expected, "write the value in the units of the variable");
            return None;
        }
        let parse = |r: &mut Self, c: &Element| match c.text.parse::<f64>() {
            Ok(x) if x.is_finite() => Some(x),
            _ => {
                r.bad(c, "", &c.text, "a number", "write a number");
                None
            }
        };
        let value = self.need_child(e, "signalValue").and_then(|c| parse(self, c))?;
        // The default tolerance is the precision of printed numbers.
        let tolerance = match e.child("tol") {
            Some(c) => parse(self, c)?.abs(),
            None => 1e-9 * value.abs().max(1e-3),
        };
        Some(ShotValue { variable, value, tolerance })
    }
}
