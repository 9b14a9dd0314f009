//! Parameters: reading them from located values with units, ranges and defaults, and converting them back to values.
use crate::author::files::Files;
use crate::author::services::Services;
use crate::author::setting::Setting;
use crate::author::units::{Unit, split_quantity};
use crate::author::value::{Fault, IntoValue, Located, Origin, Value, remedy};
use linkwork_names::nearest;
use linkwork_spatial::Vec3;
use std::ops::{Range as StdRange, RangeFrom, RangeInclusive, RangeTo, RangeToInclusive};

/// The range of a number: lower and upper end, and whether the ends belong to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// The upper end is excluded.
    pub open: bool,
}

impl Range {
    /// Creates a range from a Rust range expression.
    pub fn of(r: impl Into<Range>) -> Range {
        r.into()
    }
    fn holds(&self, x: f64) -> bool {
        x >= self.low && if self.open { x < self.high } else { x <= self.high }
    }
    /// Returns the range as text: `1e-3 ..`, `0 ..= 1`.
    pub fn text(&self) -> String {
        let end = |x: f64| {
            let plain = x == 0.0 || (1e-3..1e6).contains(&x.abs());
            if plain { format!("{x}") } else { format!("{x:e}") }
        };
        let (low, high) = (end(self.low), end(self.high));
        match (self.low.is_finite(), self.high.is_finite()) {
            (true, true) => format!("{low} ..{} {high}", if self.open { "" } else { "=" }),
            (true, false) => format!("{low} .."),
            (false, true) => format!("..{} {high}", if self.open { "" } else { "=" }),
            (false, false) => "any".into(),
        }
    }
}
impl From<RangeFrom<f64>> for Range {
    fn from(r: RangeFrom<f64>) -> Range {
        Range { low: r.start, high: f64::INFINITY, open: false }
    }
}
impl From<RangeTo<f64>> for Range {
    fn from(r: RangeTo<f64>) -> Range {
        Range { low: f64::NEG_INFINITY, high: r.end, open: true }
    }
}
impl From<RangeToInclusive<f64>> for Range {
    fn from(r: RangeToInclusive<f64>) -> Range {
        Range { low: f64::NEG_INFINITY, high: r.end, open: false }
    }
}
impl From<RangeInclusive<f64>> for Range {
    fn from(r: RangeInclusive<f64>) -> Range {
        Range { low: *r.start(), high: *r.end(), open: false }
    }
}
impl From<StdRange<f64>> for Range {
    fn from(r: StdRange<f64>) -> Range {
        Range { low: r.start, high: r.end, open: true }
    }
}

/// Description of a parameter.
#[derive(Clone, Debug)]
pub struct ParamSpec {
    /// Name.
    pub name: &'static str,
    /// SI unit of a number without a unit; a written unit must have the same dimension. Rows of different quantities have a list: `s, N`.
    pub unit: Option<&'static str>,
    /// Meaning.
    pub doc: &'static str,
    /// Allowed values.
    pub range: Option<Range>,
    /// Default value; `None`: required.
    pub default: Option<Value>,
    /// Kind of value.
    pub kind: String,
    /// Fields, for a nested struct.
    pub fields: Vec<ParamSpec>,
    /// A reference to a service.
    pub service: bool,
    /// SI unit that replaces `unit` if the part acts on a slider: coordinates are lengths there, and torques are forces.
    pub slider: Option<&'static str>,
    /// Condition on other parameters of the same struct under which it has an effect: `brake` (not zero), `law = current, resistance`, `law != power`,
    /// `filling_time = none` (not written); terms are combined by ` or `. A written parameter without an effect causes a warning.
    pub needs: Option<&'static str>,
}

/// The kind of a parameter that is the world of the simulation.
const WORLD: &str = "path of a world service";

/// Returns the replacement of a parameter that many models had before `world` existed. A name that has another meaning in other models (the radius of
/// a wheel) counts as a property of the planet only in models that use the world.
fn moved(key: &str, specs: &[ParamSpec]) -> Option<String> {
    let of_planet = specs.iter().any(|s| s.kind.starts_with(WORLD));
    let field = match key {
        "planet" => "body: .., epoch: .., site: (..)",
        "planet_radius" | "ground_radius" => "body: .., radius: ..",
        "planet_rate" => "body: .., rate: ..",
        "mu" if of_planet => "body: .., mu: ..",
        "radius" if of_planet => "body: .., radius: ..",
        "rotation" if of_planet => "body: .., rate: ..",
        "epoch" if of_planet => "body: .., epoch: ..",
        "kernel" if of_planet => "body: .., epoch: .., kernel: ..",
        "latitude" | "longitude" if of_planet => "body: .., site: (latitude: .., longitude: ..)",
        _ => return None,
    };
    Some(format!("it applies to the whole simulation: write `world: ({field})` next to `parts`"))
}

/// Returns whether a value is zero, false, nothing, or a list of such values.
fn is_zero(value: &Value) -> bool {
    match value {
        Value::Number(x) => *x == 0.0,
        Value::Text(text) => split_quantity(text).is_some_and(|(number, _)| number == 0.0),
        Value::Bool(b) => !b,
        Value::Null => true,
        Value::List(items) => items.iter().all(|item| is_zero(&item.value)),
        _ => false,
    }
}

/// Returns why a condition on other parameters ([`ParamSpec::needs`]) does not hold, and the remedy; `None` if it holds.
fn idle(needs: &str, map: &Located, specs: &[ParamSpec]) -> Option<(String, String)> {
    let (mut facts, mut names) = (Vec::new(), Vec::new());
    for term in needs.split(" or ") {
        let end = term.find(['!', '=']).unwrap_or(term.len());
        let (name, test) = (term[..end].trim(), &term[end..]);
        let written = map.get(name).map(|v| v.value.clone());
        let default = || specs.iter().find(|s| s.name == name).and_then(|s| s.default.clone());
        let value = written.or_else(default).unwrap_or(Value::Null);
        let is = |word: &str| match &value {
            Value::Number(x) => word.parse() == Ok(*x),
            Value::Text(text) => text == word,
            Value::Variant(name, _) => name == word,
            Value::Null => word == "none",
            _ => false,
        };
        let any = |words: &str| words.split(',').any(|word| is(word.trim()));
        let holds = match (test.strip_prefix("!="), test.strip_prefix('=')) {
            (Some(words), _) => !any(words),
            (None, Some(words)) => any(words),
            (None, None) => !is_zero(&value),
        };
        if holds {
            return None;
        }
        facts.push(match &value {
            Value::Null => format!("`{name}` is not written"),
            Value::Variant(word, _) => format!("`{name}` is {word}"),
            Value::Text(text) => format!("`{name}` is {text}"),
            Value::Number(x) => format!("`{name}` is {}", crate::author::doc::number(*x)),
            other => format!("`{name}` is {other}"),
        });
        names.push(format!("`{name}`"));
    }
    let help = format!("remove it, or write {}", names.join(" or "));
    Some((facts.join(" and "), help))
}

/// Sets some or all parameters of a struct from a program. `#[derive(Params)]` makes a builder for each struct, with a setter
/// for each field.
pub trait ParamsBuilder: Default {
    /// Returns the parameters that are set: names and values, each with the place of its call.
    fn entries(&mut self) -> &mut Vec<(String, Located)>;

    /// Sets a parameter by its name to anything that a file may hold: a text with a unit (`"0.6 ohm"`), a file, or the
    /// parameter of an assembly (`"$radius"`). The name and the value are checked when the assembly is loaded.
    #[must_use]
    #[track_caller]
    fn set(mut self, name: &str, value: impl IntoValue) -> Self {
        let mut value = Located::from(value.into_value());
        value.place(Origin::caller());
        self.entries().push((name.to_string(), value));
        self
    }

    /// Returns the parameters that are set, as a map.
    fn into_map(mut self) -> Value {
        Value::Map(std::mem::take(self.entries()))
    }
}

/// The builder of `()`, for parts without parameters.
#[derive(Clone, Debug, Default)]
pub struct NoParams(Vec<(String, Located)>);

impl ParamsBuilder for NoParams {
    fn entries(&mut self) -> &mut Vec<(String, Located)> {
        &mut self.0
    }
}

/// A struct of parameters (derive it).
pub trait Params: Sized + Send + Sync + 'static {
    /// Sets parameters from Rust.
    type Builder: ParamsBuilder;
    /// Returns the parameters of the struct.
    fn specs() -> Vec<ParamSpec>;
    /// Reads a map and collects faults in `cx`.
    fn read_map(map: &Located, cx: &mut ReadCx<'_>) -> Option<Self>;
    /// Converts to a value from which reading returns an equal result.
    fn show_map(&self) -> Value;
}

impl Params for () {
    type Builder = NoParams;
    fn specs() -> Vec<ParamSpec> {
        Vec::new()
    }
    fn read_map(map: &Located, cx: &mut ReadCx<'_>) -> Option<()> {
        cx.only_known(map, &[]).then_some(())
    }
    fn show_map(&self) -> Value {
        Value::Map(Vec::new())
    }
}

/// A type that a parameter field may have.
pub trait Param: Sized {
    /// Kind of value, for `describe`.
    fn kind() -> String;
    /// Fields of a nested struct.
    fn fields() -> Vec<ParamSpec> {
        Vec::new()
    }
    /// Reads a value and collects faults in `cx`.
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Self>;
    /// Returns the value of an omitted parameter without a default.
    fn missing(_spec: &ParamSpec, _cx: &mut ReadCx<'_>) -> Option<Option<Self>> {
        None
    }
    /// Returns the available service for an omitted optional service parameter.
    fn if_there(_cx: &mut ReadCx<'_>) -> Option<Self> {
        None
    }
    /// Converts to a value from which reading returns an equal result.
    fn show(&self) -> Value;
}

/// Context of reading: path of the part, services, files and collected faults.
pub struct ReadCx<'a> {
    /// Path of the part, for messages.
    pub path: String,
    /// Services to bind.
    pub services: &'a Services,
    /// Search folders of files that parameters name.
    pub files: Files,
    /// Collected faults.
    pub faults: Vec<Fault>,
    /// Paths of the services that were bound.
    pub(crate) asked: Vec<String>,
    /// Warnings about allowed but probably unintended values.
    pub warnings: Vec<Fault>,
    /// Parameters for which a misspelt name was probably intended, with the origin of their map; they are not also reported as missing.
    meant: Vec<(Origin, String)>,
    /// The part acts on sliders only, so its parameters have the units of lengths and forces.
    pub(crate) slides: bool,
    /// Written parameters that have an effect only with other parameters.
    pub(crate) settings: Vec<Setting>,
}

impl<'a> ReadCx<'a> {
    /// Creates a context for one part.
    pub fn new(path: impl Into<String>, services: &'a Services) -> Self {
        let (files, faults, warnings) = (Files::default(), Vec::new(), Vec::new());
        let (asked, meant, settings) = (Vec::new(), Vec::new(), Vec::new());
        let (path, slides) = (path.into(), false);
        ReadCx { path, services, files, faults, asked, warnings, meant, slides, settings }
    }

    /// Creates a context for inspection only: files are found but do not become part of a plan.
    pub(crate) fn looking(services: &'a Services, files: &Files) -> Self {
        ReadCx { files: files.apart(), ..ReadCx::new("", services) }
    }

    /// Returns the text of a file that a parameter names; records a fault at `origin` on failure.
    pub fn text(&mut self, name: &str, origin: Origin) -> Option<String> {
        match self.files.text(name) {
            Ok(text) => Some(text),
            Err(e) => {
                self.fault(origin, format!("`{}`: {}", self.path, e.message), e.help);
                None
            }
        }
    }

    /// Records a fault.
    pub fn fault(&mut self, origin: Origin, message: String, help: Option<String>) {
        self.faults.push(Fault { message, origin, help });
    }

    /// Records a warning.
    pub fn warn(&mut self, origin: Origin, message: String, help: Option<String>) {
        self.warnings.push(Fault { message, origin, help });
    }

    /// Records faults for unknown keys.
    pub fn only_known(&mut self, map: &Located, specs: &[ParamSpec]) -> bool {
        let entries = match &map.value {
            Value::Map(entries) => entries,
            Value::Null => return true,
            other => {
                let message = format!(
                    "`{}`: parameters must be a map, but this is {}",
                    self.path,
                    other.what()
                );
                self.fault(map.origin, message, None);
                return false;
            }
        };
        let names: Vec<&str> = specs.iter().map(|s| s.name).collect();
        let mut ok = true;
        for (k, (key, v)) in entries.iter().enumerate() {
            if !names.contains(&key.as_str()) {
                let message = format!("`{}` has no parameter `{key}`", self.path);
                let help = moved(key, specs);
                let help = help.unwrap_or_else(|| remedy(key, "parameters", &names));
                self.fault(v.origin, message, Some(help));
                let meant = nearest(key, names.iter().copied());
                self.meant.extend(meant.map(|m| (map.origin, m.to_string())));
                ok = false;
            }
            if entries[..k].iter().any(|(other, _)| other == key) {
                let message = format!("`{}`: parameter `{key}` is written twice", self.path);
                self.fault(v.origin, message, Some("keep one of the two".into()));
                ok = false;
            }
        }
        ok
    }

    /// Reads one field of a parameter map.
    pub fn field<T: Param>(
        &mut self,
        map: &Located,
        spec: &ParamSpec,
        default: Option<fn() -> T>,
    ) -> Option<T> {
        match map.get(spec.name) {
            Some(v) => T::read(v, spec, self),
            None => match (default, T::missing(spec, self)) {
                (Some(make), _) => Some(make()),
                (None, Some(result)) => result,
                (None, None)
                    if self.meant.iter().any(|m| m.0 == map.origin && m.1 == spec.name) =>
                {
                    None
                }
                (None, None) => {
                    let unit = self.one_unit(spec).map(|u| format!(", in {u}")).unwrap_or_default();
                    let message = format!(
                        "`{}`: required parameter `{}` is missing ({}{unit})",
                        self.path,
                        spec.name,
                        crate::author::doc::first_sentence(spec.doc).trim_end_matches('.')
                    );
                    self.fault(map.origin, message, Some(format!("write `{}: …`", spec.name)));
                    None
                }
            },
        }
    }

    /// Returns the SI unit of a parameter of this part; `*` accepts any unit.
    fn unit(&self, spec: &ParamSpec) -> Option<&'static str> {
        if self.slides { spec.slider.or(spec.unit) } else { spec.unit }
    }

    /// Returns the SI unit of a parameter of this part for a message; `None` if it is a plain number, or accepts any unit.
    fn one_unit(&self, spec: &ParamSpec) -> Option<&'static str> {
        self.unit(spec).filter(|u| *u != "*")
    }

    /// Records the written parameters of a struct that have an effect only with other parameters of it.
    pub fn settings_of(&mut self, map: &Located, specs: &[ParamSpec]) {
        for spec in specs {
            let (Some(needs), Some(own)) = (spec.needs, map.get(spec.name)) else { continue };
            // A value that equals the default, or that is the default of an assembly, asks for nothing.
            if own.origin.default || spec.default.as_ref().is_some_and(|d| *d == own.value) {
                continue;
            }
            let owner = format!("`{}`", self.path);
            let idle = idle(needs, map, specs);
            self.settings.push(Setting { owner, name: spec.name, origin: own.origin, idle });
        }
    }

    /// Reads a number with its unit and range.
    pub fn number(&mut self, v: &Located, spec: &ParamSpec) -> Option<f64> {
        let at = format!("`{}.{}`", self.path, spec.name);
        let number = match &v.value {
            Value::Number(x) => *x,
            Value::Text(text) => match self.quantity(text, spec) {
                Ok(x) => x,
                Err((message, help)) => {
                    self.fault(v.origin, format!("{at}: {message}"), Some(help));
                    return None;
                }
            },
            other => {
                let message = format!("{at} must be a number, but it is {}", other.what());
                self.fault(v.origin, message, None);
                return None;
            }
        };
        if number.is_nan() {
            self.fault(
                v.origin,
                format!("{at} is not a number (NaN)"),
                Some("write a number".into()),
            );
            return None;
        }
        if let Some(range) = spec.range
            && !range.holds(number)
        {
            let unit = self.one_unit(spec).map(|u| format!(" {u}")).unwrap_or_default();
            let message = format!("{at} = {number}{unit} is out of range {}{unit}", range.text());
            let mut help = crate::author::doc::first_paragraph(spec.doc);
            if self.unit(spec) == Some("rad") && matches!(v.value, Value::Number(_)) {
                help +=
                    &format!(" (a number without a unit is in rad; in degrees: \"{number} deg\")");
            }
            self.fault(v.origin, message, Some(help));
            return None;
        }
        Some(number)
    }

    fn quantity(&self, text: &str, spec: &ParamSpec) -> Result<f64, (String, String)> {
        let unit = self.unit(spec);
        let wants = match unit {
            Some("*") => "write a number in SI, or a text with a unit such as \"12 V\"".into(),
            Some(u) => format!("write a number in {u}, or a text with a unit such as \"1 {u}\""),
            None => "write a plain number".into(),
        };
        let Some((number, unit_text)) = split_quantity(text) else {
            return Err((format!("`{text}` is not a quantity"), wants));
        };
        if unit_text.is_empty() {
            return Ok(number);
        }
        let given = Unit::parse(unit_text).map_err(|e| (e.to_string(), wants.clone()))?;
        let want = match unit {
            Some(u) => Unit::parse(u).map_err(|e| (e.to_string(), wants.clone()))?,
            None => Unit::ONE,
        };
        if !given.same_quantity(&want) {
            let fact = format!(
                "`{text}` is in {unit_text}, but {} is expected",
                unit.unwrap_or("a plain number")
            );
            let slider = if self.slides && spec.slider.is_some() {
                ", because the part acts on a slider"
            } else {
                ""
            };
            return Err((fact, format!("{wants}{slider}")));
        }
        Ok(given.to_si(number))
    }

    /// Reads one of a few words.
    pub fn choice(&mut self, v: &Located, spec: &ParamSpec, words: &[&str]) -> Option<String> {
        let word = match &v.value {
            Value::Text(t) => t.clone(),
            Value::Variant(name, inner) if inner.value == Value::Null => name.clone(),
            other => {
                let message = format!(
                    "`{}.{}` must be a word, but it is {}",
                    self.path,
                    spec.name,
                    other.what()
                );
                self.fault(v.origin, message, Some(format!("one of: {}", words.join(", "))));
                return None;
            }
        };
        if !words.contains(&word.as_str()) {
            let message = format!("`{}.{}` cannot be `{word}`", self.path, spec.name);
            self.fault(v.origin, message, Some(remedy(&word, "choices", words)));
            return None;
        }
        Some(word)
    }

    pub(crate) fn wrong(&mut self, v: &Located, spec: &ParamSpec, wanted: &str) {
        let message =
            format!("`{}.{}` must be {wanted}, but it is {}", self.path, spec.name, v.value.what());
        self.fault(v.origin, message, None);
    }
}

impl Param for f64 {
    fn kind() -> String {
        "number".into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<f64> {
        cx.number(v, spec)
    }
    fn show(&self) -> Value {
        Value::Number(*self)
    }
}

macro_rules! integer {
    ($($t:ty),*) => {$(
        impl Param for $t {
            fn kind() -> String { "integer".into() }
            fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<$t> {
                let x = cx.number(v, spec)?;
                if x.fract() != 0.0 || x < <$t>::MIN as f64 || x > <$t>::MAX as f64 {
                    let message = format!(
                        "`{}.{}` must be an integer from {} to {}, but it is {x}",
                        cx.path, spec.name, <$t>::MIN, <$t>::MAX);
                    cx.fault(v.origin, message, None);
                    return None;
                }
                Some(x as $t)
            }
            fn show(&self) -> Value { Value::Number(*self as f64) }
        }
    )*};
}
integer!(u8, u32, u64, i64, usize);

impl Param for bool {
    fn kind() -> String {
        "true | false".into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<bool> {
        match v.value {
            Value::Bool(b) => Some(b),
            _ => {
                cx.wrong(v, spec, "true or false");
                None
            }
        }
    }
    fn show(&self) -> Value {
        Value::Bool(*self)
    }
}

impl Param for String {
    fn kind() -> String {
        "text".into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<String> {
        match &v.value {
            Value::Text(t) => Some(t.clone()),
            _ => {
                cx.wrong(v, spec, "a text");
                None
            }
        }
    }
    fn show(&self) -> Value {
        Value::Text(self.clone())
    }
}

pub(crate) fn list<'v>(
    v: &'v Located,
    spec: &ParamSpec,
    cx: &mut ReadCx<'_>,
) -> Option<&'v [Located]> {
    match &v.value {
        Value::List(items) => Some(items),
        _ => {
            cx.wrong(v, spec, "a list");
            None
        }
    }
}

impl<T: Param, const N: usize> Param for [T; N] {
    fn kind() -> String {
        format!("list of {N} {}", T::kind())
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<[T; N]> {
        let items = list(v, spec, cx)?;
        if items.len() != N {
            let message = format!(
                "`{}.{}` must have {N} values, but it has {}",
                cx.path,
                spec.name,
                items.len()
            );
            cx.fault(v.origin, message, None);
            return None;
        }
        let units = spec.unit.filter(|u| u.contains(','));
        let read: Vec<Option<T>> = match units {
            None => items.iter().map(|item| T::read(item, spec, cx)).collect(),
            Some(units) => {
                let of = |k: usize| {
                    let unit = Some(units.split(',').nth(k).map_or("1", str::trim));
                    ParamSpec { unit, ..spec.clone() }
                };
                items.iter().enumerate().map(|(k, item)| T::read(item, &of(k), cx)).collect()
            }
        };
        let all: Vec<T> = read.into_iter().collect::<Option<_>>()?;
        all.try_into().ok()
    }
    fn show(&self) -> Value {
        Value::List(self.iter().map(|t| t.show().into()).collect())
    }
}

impl Param for Vec3 {
    fn kind() -> String {
        "list of 3 numbers".into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Vec3> {
        <[f64; 3]>::read(v, spec, cx).map(Vec3::from)
    }
    fn show(&self) -> Value {
        [self.x, self.y, self.z].show()
    }
}

impl<T: Param> Param for Option<T> {
    fn kind() -> String {
        format!("{} or nothing", T::kind())
    }
    fn fields() -> Vec<ParamSpec> {
        T::fields()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Option<T>> {
        match v.value {
            Value::Null => Some(None),
            _ => T::read(v, spec, cx).map(Some),
        }
    }
    fn missing(_: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Option<Self>> {
        Some(Some(T::if_there(cx)))
    }
    fn show(&self) -> Value {
        self.as_ref().map_or(Value::Null, Param::show)
    }
}
