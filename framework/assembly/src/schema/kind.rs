//! Kinds of field values: each defines how it is read, written and described.
//!
//! ```text
//! number("kg").at_least(0.0)        vector("m")      pose()      word(&[("Auto", Method::Auto), ..])
//! record::<Limits>()                list_of(texts("..")) ..
//! ```
use crate::schema::describe::Schema;
use crate::schema::read;
use crate::text::files::Near;
use crate::text::report::Cx;
use crate::text::value::{self, Text, is_unknown, variant};
use linkwork_runtime::{Located, Origin, Seconds, Value, remedy};
use linkwork_spatial::Vec3;
use std::borrow::Cow;
use std::f64::consts::TAU;
use std::fmt;
use std::marker::PhantomData;

/// The owner of a value for messages; the text is formatted only if there is a message.
#[derive(Clone)]
pub(crate) enum What<'a> {
    Named(Cow<'a, str>),
    Field(&'a What<'a>, &'a str),
    Item(&'a What<'a>, usize),
}

impl fmt::Display for What<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            What::Named(name) => f.write_str(name),
            What::Field(of, name) => write!(f, "{of}: `{name}`"),
            What::Item(of, k) => write!(f, "{of}: item {k}"),
        }
    }
}

/// Context of reading: the owner of the value for messages, and how its units depend on it.
#[derive(Clone)]
pub(crate) struct At<'a> {
    /// ``body `arm`: `limits` ``.
    pub what: What<'a>,
    /// The coordinate is a length, not an angle.
    pub slides: bool,
    /// Files that the text may use; `None`: none.
    pub near: Option<Near<'a>>,
    /// Position for faults, if it is not that of the value: the key of an entry.
    pub origin: Option<Origin>,
}

impl<'a> At<'a> {
    /// Creates a context without files.
    pub fn new(what: impl Into<Cow<'a, str>>) -> At<'a> {
        At { what: What::Named(what.into()), slides: false, near: None, origin: None }
    }
    /// Returns the context of a field.
    pub fn field<'b>(&'b self, name: &'b str) -> At<'b> {
        At {
            what: What::Field(&self.what, name),
            slides: self.slides,
            near: self.near,
            origin: None,
        }
    }
    /// Returns the context with files.
    pub fn among(self, near: Near<'a>) -> Self {
        At { near: Some(near), ..self }
    }
    /// Returns the context with a position.
    pub fn origin(self, origin: Origin) -> Self {
        At { origin: Some(origin), ..self }
    }
    /// Returns the context of a coordinate that is a length.
    pub fn sliding(self, slides: bool) -> Self {
        At { slides, ..self }
    }
}

/// Reading, writing and description of a kind of value. Reading adds a fault for each mistake and then returns `None`.
pub(crate) trait Kind {
    type Of;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Self::Of>;
    /// Returns the value so that it reads back; `Null` if it does not have a written form.
    fn write(&self, x: &Self::Of) -> Value;
    fn describe(&self) -> Schema;
}

/// A finite number in SI; its unit may depend on whether the coordinate is a length.
pub(crate) struct Number {
    turns: &'static str,
    slides: &'static str,
    low: f64,
    high: f64,
}

pub(crate) fn number(unit: &'static str) -> Number {
    drive_number(unit, unit)
}

/// Returns the reader of a number with one unit for angles and another for lengths.
pub(crate) fn drive_number(turns: &'static str, slides: &'static str) -> Number {
    Number { turns, slides, low: f64::NEG_INFINITY, high: f64::INFINITY }
}

impl Number {
    pub fn within(self, low: f64, high: f64) -> Number {
        Number { low, high, ..self }
    }
    /// Restricts an angle of a direction or position to one revolution; larger values are probably degrees without their unit.
    pub fn turn(self) -> Number {
        self.within(-TAU, TAU)
    }
    pub fn at_least(self, low: f64) -> Number {
        Number { low, ..self }
    }
    pub fn positive(self) -> Number {
        Number { low: f64::MIN_POSITIVE, ..self }
    }
    fn unit(&self, at: &At<'_>) -> &'static str {
        if at.slides { self.slides } else { self.turns }
    }
    fn in_range(&self, cx: &mut Cx, v: &Located, at: &At<'_>, x: f64) -> Option<f64> {
        if x >= self.low && x <= self.high {
            return Some(x);
        }
        let unit = self.unit(at);
        let help = match (self.low == f64::MIN_POSITIVE, self.high.is_finite()) {
            (_, true) if unit == "rad" => format!(
                "write an angle from {:.4} to {:.4} rad, or one in degrees with its unit: \"90 deg\"",
                self.low, self.high
            ),
            (true, false) => "write a positive number".to_string(),
            (_, true) => format!("write a number from {} to {}", self.low, self.high),
            (false, false) => format!("write {} or more", self.low),
        };
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        cx.fault(v.origin, format!("{} is {x}{unit}", at.what), help);
        None
    }
}

impl Kind for Number {
    type Of = f64;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<f64> {
        let x = read::number(cx, v, &at.what, self.unit(at))?;
        self.in_range(cx, v, at, x)
    }
    fn write(&self, x: &f64) -> Value {
        // An absent field stands for infinity. Write NaN as it is, so that the reader rejects it.
        if x.is_infinite() { Value::Null } else { Value::Number(*x) }
    }
    fn describe(&self) -> Schema {
        let unit = match self.turns == self.slides {
            true => self.turns.to_string(),
            false => format!("{} (sliding: {})", self.turns, self.slides),
        };
        Schema::Number { unit, low: self.low, high: self.high }
    }
}

/// A whole number.
pub(crate) struct Whole<T>(f64, f64, PhantomData<T>);

/// Reads an integer from one number to another, both included.
pub(crate) fn whole<T>(low: u32, high: u32) -> Whole<T> {
    Whole(low.into(), high.into(), PhantomData)
}

impl<T: TryFrom<u32> + TryInto<u32> + Copy> Kind for Whole<T> {
    type Of = T;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<T> {
        let x = number("").within(self.0, self.1).read(cx, v, at)?;
        if x.fract() != 0.0 {
            cx.fault(v.origin, format!("{} is {x}", at.what), "write an integer");
            return None;
        }
        T::try_from(x as u32).ok()
    }
    fn write(&self, x: &T) -> Value {
        (*x).try_into().map_or(Value::Null, |x: u32| Value::Number(x.into()))
    }
    fn describe(&self) -> Schema {
        Schema::Whole { low: self.0, high: self.1 }
    }
}

/// Defines kinds by a function in each direction and a description.
macro_rules! plain_kinds {
    ($( $(#[$doc:meta])* $name:ident / $make:ident -> $of:ty,
        |$cx:ident, $v:ident, $at:ident| $read:expr, |$x:ident| $write:expr, $describe:expr; )*) => {$(
        $(#[$doc])*
        pub(crate) struct $name;
        $(#[$doc])*
        pub(crate) fn $make() -> $name {
            $name
        }
        impl Kind for $name {
            type Of = $of;
            fn read(&self, $cx: &mut Cx, $v: &Located, $at: &At<'_>) -> Option<$of> {
                $read
            }
            fn write(&self, $x: &$of) -> Value {
                $write
            }
            fn describe(&self) -> Schema {
                $describe
            }
        }
    )*};
}

plain_kinds! {
    /// True or false.
    Flag / flag -> bool,
        |cx, v, at| read::flag(cx, v, &at.what), |x| Value::Bool(*x), Schema::Flag;
    /// A text with its place.
    TextKind / text -> Text,
        |cx, v, at| read::text(cx, v, &at.what), |x| Value::Text(x.text.clone()), Schema::Text;
    /// One text or a list of them.
    Many / texts -> Vec<Text>,
        |cx, v, at| match v.value {
            Value::Text(_) => Some(vec![read::text(cx, v, &at.what)?]),
            _ => list_of(text()).read(cx, v, at),
        },
        |x| list_of(text()).write(x),
        Schema::Any(vec![Schema::Text, Schema::List(Box::new(Schema::Text), None)]);
    /// A time or a rate.
    Period / period -> Seconds,
        |cx, v, at| read::period(cx, v, &at.what),
        |x| Value::Text(format!("{:?} s", x.seconds())),
        Schema::Number { unit: "s, or Hz".into(), low: 0.0, high: f64::INFINITY };
    /// The displayed unit of a quantity.
    UnitText / unit -> Text,
        |cx, v, at| {
            let t = read::text(cx, v, &at.what)?;
            match linkwork_runtime::Unit::parse(&t.text) {
                Ok(_) => Some(t),
                Err(e) => {
                    cx.fault(t.origin, format!("{}: {e}", at.what), "write for example \"N m\" or \"deg/s\"");
                    None
                }
            }
        },
        |x| Value::Text(x.text.clone()), Schema::Text;
    /// A vector that is not zero.
    Direction / direction -> Vec3,
        |cx, v, at| {
            let n = vector("").read(cx, v, at)?;
            if n.norm() < 1e-100 {
                let message = format!("{} has the length zero", at.what);
                cx.fault(v.origin, message, "write for example [0, 0, 1]");
                return None;
            }
            Some(n)
        },
        |x| value::vector(x), vector("").describe();
    /// Red, green, blue, and opacity, each 0 … 1.
    Color / color -> [f64; 4],
        |cx, v, at| {
            let c = match &v.value {
                Value::List(items) if items.len() == 4 => read::numbers::<4>(cx, v, &at.what, "")?,
                Value::List(items) if items.len() != 3 => {
                    let message = format!("{} must be a colour, but it has {} numbers", at.what, items.len());
                    cx.fault(v.origin, message, "write [red, green, blue] or [red, green, blue, opacity]");
                    return None;
                }
                _ => {
                    let [r, g, b] = read::numbers::<3>(cx, v, &at.what, "")?;
                    [r, g, b, 1.0]
                }
            };
            if c.iter().any(|x| !(0.0..=1.0).contains(x)) {
                let message = format!("{} has a number outside 0 .. 1", at.what);
                cx.fault(v.origin, message, "write [red, green, blue]");
                return None;
            }
            Some(c)
        },
        |x| value::list(*x),
        Schema::List(Box::new(number("").within(0.0, 1.0).describe()), None);
}

/// A value that is kept as written, for another reader.
pub(crate) struct Raw(fn() -> Schema);

pub(crate) fn raw(schema: fn() -> Schema) -> Raw {
    Raw(schema)
}

impl Kind for Raw {
    type Of = Located;
    fn read(&self, _: &mut Cx, v: &Located, _: &At<'_>) -> Option<Located> {
        Some(v.clone())
    }
    fn write(&self, x: &Located) -> Value {
        x.value.clone()
    }
    fn describe(&self) -> Schema {
        (self.0)()
    }
}

/// Exactly `N` numbers in one unit; after `turn` each must be from −2π to 2π.
pub(crate) struct Numbers<const N: usize>(&'static str, bool);

pub(crate) fn numbers<const N: usize>(unit: &'static str) -> Numbers<N> {
    Numbers(unit, false)
}

impl<const N: usize> Numbers<N> {
    /// Like [`Number::turn`], for each number.
    pub fn turn(self) -> Numbers<N> {
        Numbers(self.0, true)
    }
    fn one(&self) -> Number {
        let one = number(self.0);
        if self.1 { one.turn() } else { one }
    }
}

impl<const N: usize> Kind for Numbers<N> {
    type Of = [f64; N];
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<[f64; N]> {
        let all = read::numbers::<N>(cx, v, &at.what, self.0)?;
        all.iter().all(|x| self.one().in_range(cx, v, at, *x).is_some()).then_some(all)
    }
    fn write(&self, x: &[f64; N]) -> Value {
        value::list(*x)
    }
    fn describe(&self) -> Schema {
        Schema::List(Box::new(self.one().describe()), Some(N))
    }
}

/// Three numbers in one unit.
pub(crate) struct Vector(&'static str);

pub(crate) fn vector(unit: &'static str) -> Vector {
    Vector(unit)
}

impl Kind for Vector {
    type Of = Vec3;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Vec3> {
        read::numbers::<3>(cx, v, &at.what, self.0).map(Vec3::from)
    }
    fn write(&self, x: &Vec3) -> Value {
        value::vector(x)
    }
    fn describe(&self) -> Schema {
        numbers::<3>(self.0).describe()
    }
}

/// One of several words, each with its meaning.
pub(crate) struct Word<T: 'static>(pub &'static [(&'static str, T)]);

pub(crate) fn word<T>(words: &'static [(&'static str, T)]) -> Word<T> {
    Word(words)
}

impl<T: Copy + PartialEq> Kind for Word<T> {
    type Of = T;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<T> {
        if is_unknown(v) {
            return None;
        }
        let all: Vec<&str> = self.0.iter().map(|(w, _)| *w).collect();
        let (Value::Variant(given, _) | Value::Text(given)) = &v.value else {
            let message = format!("{} must be a word, but it is {}", at.what, v.value.what());
            cx.fault(v.origin, message, format!("one of: {}", all.join(", ")));
            return None;
        };
        let found = self.0.iter().find(|(w, _)| w == given).map(|(_, t)| *t);
        if found.is_none() {
            let message = format!("{}: there is no word `{given}`", at.what);
            cx.fault(v.origin, message, remedy(given, "words", &all));
        }
        found
    }
    fn write(&self, x: &T) -> Value {
        let word = self.0.iter().find(|(_, t)| t == x);
        word.map_or(Value::Null, |(w, _)| variant(w, Value::Null))
    }
    fn describe(&self) -> Schema {
        Schema::Words(self.0.iter().map(|(w, _)| *w).collect())
    }
}

/// A list.
pub(crate) struct ListOf<K>(K);

pub(crate) fn list_of<K: Kind>(kind: K) -> ListOf<K> {
    ListOf(kind)
}

impl<K: Kind> Kind for ListOf<K> {
    type Of = Vec<K::Of>;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Vec<K::Of>> {
        let items = read::list(cx, v, &at.what);
        let mut item = |(k, v): (usize, &Located)| {
            let at = At { what: What::Item(&at.what, k + 1), origin: None, ..at.clone() };
            self.0.read(cx, v, &at)
        };
        let read: Vec<_> = items.iter().enumerate().map(&mut item).collect();
        let whole = matches!(v.value, Value::List(_) | Value::Null);
        read.into_iter().collect::<Option<_>>().filter(|_| whole)
    }
    fn write(&self, x: &Vec<K::Of>) -> Value {
        Value::List(x.iter().map(|i| self.0.write(i).into()).collect())
    }
    fn describe(&self) -> Schema {
        Schema::List(Box::new(self.0.describe()), None)
    }
}

/// One of two forms, the first unless the value is a map: `0.2`, or `(force: 0.2, rate: 0.01)`.
pub(crate) struct Short<A, B>(A, B);

pub(crate) fn short<A: Kind, B: Kind<Of = A::Of>>(short: A, long: B) -> Short<A, B> {
    Short(short, long)
}

impl<A: Kind, B: Kind<Of = A::Of>> Kind for Short<A, B> {
    type Of = A::Of;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<A::Of> {
        match v.value {
            // `()` is the long form with all fields left out.
            Value::Map(_) | Value::Null => self.1.read(cx, v, at),
            _ => self.0.read(cx, v, at),
        }
    }
    fn write(&self, x: &A::Of) -> Value {
        match self.1.write(x) {
            Value::Null => self.0.write(x),
            long => long,
        }
    }
    fn describe(&self) -> Schema {
        Schema::Any(vec![self.0.describe(), self.1.describe()])
    }
}

/// One of two forms, the second if the value is a list: `0.2`, or `[0.2, 0.3]`.
pub(crate) struct OneOrList<A, B>(A, B);

pub(crate) fn one_or_list<A: Kind, B: Kind<Of = A::Of>>(one: A, list: B) -> OneOrList<A, B> {
    OneOrList(one, list)
}

impl<A: Kind, B: Kind<Of = A::Of>> Kind for OneOrList<A, B> {
    type Of = A::Of;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<A::Of> {
        match v.value {
            Value::List(_) => self.1.read(cx, v, at),
            _ => self.0.read(cx, v, at),
        }
    }
    fn write(&self, x: &A::Of) -> Value {
        match self.0.write(x) {
            Value::Null => self.1.write(x),
            one => one,
        }
    }
    fn describe(&self) -> Schema {
        Schema::Any(vec![self.0.describe(), self.1.describe()])
    }
}

/// A kind converted to another type; values without this form are not written.
pub(crate) struct Mapped<K: Kind, T>(K, fn(K::Of) -> T, fn(&T) -> Option<K::Of>);

pub(crate) fn mapped<K: Kind, T>(
    kind: K,
    from: fn(K::Of) -> T,
    to: fn(&T) -> Option<K::Of>,
) -> Mapped<K, T> {
    Mapped(kind, from, to)
}

impl<K: Kind, T> Kind for Mapped<K, T> {
    type Of = T;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<T> {
        self.0.read(cx, v, at).map(self.1)
    }
    fn write(&self, x: &T) -> Value {
        (self.2)(x).map_or(Value::Null, |x| self.0.write(&x))
    }
    fn describe(&self) -> Schema {
        self.0.describe()
    }
}

/// Names, each with a value.
pub(crate) struct TableOf<K>(K);

pub(crate) fn table_of<K: Kind>(kind: K) -> TableOf<K> {
    TableOf(kind)
}

impl<K: Kind> Kind for TableOf<K> {
    type Of = Vec<(Text, K::Of)>;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Self::Of> {
        let entries = read::table(cx, v, &at.what);
        let mut out = Vec::new();
        let mut whole = matches!(v.value, Value::Map(_) | Value::Null);
        for (key, v) in entries {
            let name = Text { text: key.clone(), origin: cx.key(v) };
            let at = At { origin: Some(name.origin), ..at.field(key) };
            match self.0.read(cx, v, &at) {
                Some(x) => out.push((name, x)),
                None => whole = false,
            }
        }
        whole.then_some(out)
    }
    fn write(&self, x: &Self::Of) -> Value {
        Value::Map(x.iter().map(|(k, v)| (k.text.clone(), self.0.write(v).into())).collect())
    }
    fn describe(&self) -> Schema {
        Schema::Table(Box::new(self.0.describe()))
    }
}
