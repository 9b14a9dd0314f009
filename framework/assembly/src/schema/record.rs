//! Records of the file format: [`record!`] declares a record once and generates its reader, its writer and its description.
use crate::schema::describe::{Field, Schema};
use crate::schema::kind::{At, Kind};
use crate::schema::read::record_fields;
use crate::text::report::Cx;
use linkwork_runtime::{Located, Origin, Value, remedy};
use std::fmt::Display;
use std::marker::PhantomData;

/// A set of named fields.
pub(crate) trait Record: Sized {
    /// Title in the schema.
    const TITLE: &'static str;
    /// Returns the names of its fields.
    fn names() -> Vec<&'static str>;
    /// Returns its fields with kinds, defaults and descriptions.
    fn fields() -> Vec<Field>;
    /// Reads the fields and adds a fault for each mistake; the caller must check for unknown names. A field with a mistake counts as missing, so that
    /// the rest is still checked; returns `None` if a required field is missing.
    fn read_fields(cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Self>;
    /// Writes the fields that differ from their defaults.
    fn write_fields(&self, out: &mut Vec<(String, Located)>);

    /// Reads the record, and rejects unknown fields.
    fn read(cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Self> {
        if !record_fields(cx, v, &at.what, &Self::names(), Self::fields) {
            return None;
        }
        Self::read_fields(cx, v, at)
    }
    /// Returns the record as a map.
    fn write(&self) -> Value {
        let mut out = Vec::new();
        self.write_fields(&mut out);
        Value::Map(out)
    }
    /// Returns its schema, with its title.
    fn describe() -> Schema {
        Schema::Record(Self::TITLE, Self::fields)
    }
}

/// Two records in one map.
impl<A: Record, B: Record> Record for (A, B) {
    const TITLE: &'static str = A::TITLE;
    fn names() -> Vec<&'static str> {
        [A::names(), B::names()].concat()
    }
    fn fields() -> Vec<Field> {
        [A::fields(), B::fields()].concat()
    }
    fn read_fields(cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Self> {
        let (a, b) = (A::read_fields(cx, v, at), B::read_fields(cx, v, at));
        Some((a?, b?))
    }
    fn write_fields(&self, out: &mut Vec<(String, Located)>) {
        self.0.write_fields(out);
        self.1.write_fields(out);
    }
}

/// A field of a record: its value if it is written, and if it is not.
pub(crate) trait Entry {
    type Of;
    fn get(&self, cx: &mut Cx, map: &Located, name: &str, at: &At<'_>) -> Option<Self::Of>;
    /// Returns the replacement for a value that cannot be read.
    fn fallback(&self) -> Option<Self::Of>;
    fn put(&self, out: &mut Vec<(String, Located)>, name: &str, x: &Self::Of);
    fn field(&self, name: &'static str, doc: &'static str) -> Field;
}

/// A value with a default.
pub(crate) struct Or<K: Kind>(K, K::Of);
/// An optional value.
pub(crate) struct Maybe<K>(K);
/// A required value, with help text.
pub(crate) struct Need<K>(K, &'static str);

/// A required value; without it, the rest of the record is still checked.
pub(crate) struct Want<K>(K, &'static str);

/// Presence of a kind in a record.
pub(crate) trait Presence: Kind + Sized {
    fn or(self, default: Self::Of) -> Or<Self> {
        Or(self, default)
    }
    fn maybe(self) -> Maybe<Self> {
        Maybe(self)
    }
    /// Makes it required; `help` is the remedy if it is missing.
    fn need(self, help: &'static str) -> Need<Self> {
        Need(self, help)
    }
    /// Makes it required, but the rest of the record is read without it.
    fn wanted(self, help: &'static str) -> Want<Self> {
        Want(self, help)
    }
}
impl<K: Kind> Presence for K {}

fn put(out: &mut Vec<(String, Located)>, name: &str, v: Value) {
    if v != Value::Null {
        out.push((name.into(), v.into()));
    }
}

impl<K: Kind> Entry for Or<K>
where
    K::Of: Clone + PartialEq,
{
    type Of = K::Of;
    fn get(&self, cx: &mut Cx, map: &Located, name: &str, at: &At<'_>) -> Option<K::Of> {
        match map.get(name) {
            Some(v) => self.0.read(cx, v, &at.field(name)),
            None => Some(self.1.clone()),
        }
    }
    fn fallback(&self) -> Option<K::Of> {
        Some(self.1.clone())
    }
    fn put(&self, out: &mut Vec<(String, Located)>, name: &str, x: &K::Of) {
        if *x != self.1 {
            put(out, name, self.0.write(x));
        }
    }
    fn field(&self, name: &'static str, doc: &'static str) -> Field {
        let default = Some(self.0.write(&self.1)).filter(|v| *v != Value::Null);
        Field { name, doc, schema: self.0.describe(), required: false, default }
    }
}

impl<K: Kind> Entry for Maybe<K> {
    type Of = Option<K::Of>;
    fn get(&self, cx: &mut Cx, map: &Located, name: &str, at: &At<'_>) -> Option<Option<K::Of>> {
        match map.get(name).filter(|v| v.value != Value::Null) {
            Some(v) => self.0.read(cx, v, &at.field(name)).map(Some),
            None => Some(None),
        }
    }
    fn fallback(&self) -> Option<Option<K::Of>> {
        Some(None)
    }
    fn put(&self, out: &mut Vec<(String, Located)>, name: &str, x: &Option<K::Of>) {
        if let Some(x) = x {
            put(out, name, self.0.write(x));
        }
    }
    fn field(&self, name: &'static str, doc: &'static str) -> Field {
        Field { name, doc, schema: self.0.describe(), required: false, default: None }
    }
}

fn missing(cx: &mut Cx, map: &Located, name: &str, at: &At<'_>, help: &str) {
    let origin = at.origin.unwrap_or(map.origin);
    cx.fault(origin, format!("{} has no `{name}`", at.what), help);
}

impl<K: Kind> Entry for Need<K> {
    type Of = K::Of;
    fn get(&self, cx: &mut Cx, map: &Located, name: &str, at: &At<'_>) -> Option<K::Of> {
        let Some(v) = map.get(name) else {
            missing(cx, map, name, at, self.1);
            return None;
        };
        self.0.read(cx, v, &at.field(name))
    }
    fn fallback(&self) -> Option<K::Of> {
        None
    }
    fn put(&self, out: &mut Vec<(String, Located)>, name: &str, x: &K::Of) {
        put(out, name, self.0.write(x));
    }
    fn field(&self, name: &'static str, doc: &'static str) -> Field {
        Field { name, doc, schema: self.0.describe(), required: true, default: None }
    }
}

impl<K: Kind> Entry for Want<K> {
    type Of = Option<K::Of>;
    fn get(&self, cx: &mut Cx, map: &Located, name: &str, at: &At<'_>) -> Option<Option<K::Of>> {
        let Some(v) = map.get(name) else {
            missing(cx, map, name, at, self.1);
            return None;
        };
        self.0.read(cx, v, &at.field(name)).map(Some)
    }
    fn fallback(&self) -> Option<Option<K::Of>> {
        Some(None)
    }
    fn put(&self, out: &mut Vec<(String, Located)>, name: &str, x: &Option<K::Of>) {
        if let Some(x) = x {
            put(out, name, self.0.write(x));
        }
    }
    fn field(&self, name: &'static str, doc: &'static str) -> Field {
        Field { name, doc, schema: self.0.describe(), required: true, default: None }
    }
}

/// A record as a kind.
pub(crate) struct Of<T>(PhantomData<T>);

pub(crate) fn of<T: Record>() -> Of<T> {
    Of(PhantomData)
}

impl<T: Record> Kind for Of<T> {
    type Of = T;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<T> {
        T::read(cx, v, at)
    }
    fn write(&self, x: &T) -> Value {
        match x.write() {
            Value::Map(fields) if fields.is_empty() => Value::Null,
            map => map,
        }
    }
    fn describe(&self) -> Schema {
        T::describe()
    }
}

/// Declares a record: `struct Name: "title" { /// meaning  field: Type = kind, .. }` also declares the struct; `for Name: "title" { /// meaning
/// field: kind, .. }` uses an existing one. `; origin` at the end stores the position.
macro_rules! record {
    (for $T:ty: $title:literal
        { $( $(#[doc = $doc:literal])+ $field:ident: $entry:expr ),* $(,)? $(; $origin:ident)? }) => {
        impl $crate::schema::record::Record for $T {
            const TITLE: &'static str = $title;
            fn names() -> Vec<&'static str> {
                vec![$(stringify!($field)),*]
            }
            fn fields() -> Vec<$crate::schema::describe::Field> {
                vec![$($crate::schema::record::Entry::field(&$entry, stringify!($field), concat!($($doc),+))),*]
            }
            fn read_fields(
                cx: &mut $crate::text::report::Cx,
                v: &linkwork_runtime::Located,
                at: &$crate::schema::kind::At<'_>,
            ) -> Option<Self> {
                let _ = (&cx, v, at);
                $( let $field = {
                    let entry = $entry;
                    use $crate::schema::record::Entry as _;
                    entry.get(cx, v, stringify!($field), at).or_else(|| entry.fallback())
                }; )*
                $( let $origin = at.origin.unwrap_or(v.origin); )?
                Some(Self { $( $field: $field?, )* $( $origin )? })
            }
            fn write_fields(&self, out: &mut Vec<(String, linkwork_runtime::Located)>) {
                let _ = &out;
                $($crate::schema::record::Entry::put(&$entry, out, stringify!($field), &self.$field);)*
            }
        }
    };
    ($(#[$about:meta])* $vis:vis struct $T:ident: $title:literal
        { $( $(#[doc = $doc:literal])+ $field:ident: $of:ty = $entry:expr ),* $(,)? $(; $origin:ident)? }) => {
        $(#[$about])*
        $vis struct $T {
            $( $(#[doc = $doc])+ pub $field: $of, )*
            $( /// Where it is written.
            pub $origin: linkwork_runtime::Origin, )?
        }
        $crate::schema::record::record! {
            for $T: $title { $( $(#[doc = $doc])+ $field: $entry ),* $(; $origin)? }
        }
    };
}
pub(crate) use record;

/// Reads the argument of `Name(..)`: fields, or the value of the one field that `short` names.
pub(crate) fn argument<T: Record>(
    cx: &mut Cx,
    inner: &Located,
    at: &At<'_>,
    short: &str,
) -> Option<T> {
    match &inner.value {
        Value::Map(_) | Value::Null => T::read(cx, inner, at),
        _ if short.is_empty() => {
            let message =
                format!("{} accepts only fields, but there is {}", at.what, inner.value.what());
            cx.fault(inner.origin, message, "write only the name, or fields in brackets");
            None
        }
        _ => {
            let fields = vec![(short.to_string(), inner.clone())];
            T::read_fields(cx, &Located { value: Value::Map(fields), origin: inner.origin }, at)
        }
    }
}

/// Returns the schema of `Name(fields)`, `Name(value)` of the one field that `short` names, or `Name` alone.
pub(crate) fn variant_of<T: Record>(name: &'static str, short: &str) -> Schema {
    let fields = T::fields();
    let mut forms = vec![Schema::Variant(name, Box::new(T::describe()))];
    let one = fields.iter().find(|f| f.name == short);
    forms.extend(one.map(|f| Schema::Variant(name, Box::new(f.schema.clone()))));
    if fields.iter().all(|f| !f.required) {
        forms.push(Schema::Words(vec![name]));
    }
    Schema::Any(forms)
}

/// Returns the name of a variant with its argument, and the position of the name; adds a fault if it is not in `known`.
pub(crate) fn variant_name<'v>(
    cx: &mut Cx,
    v: &'v Located,
    what: impl Display,
    (one, many, known): (&str, &str, &[&str]),
) -> Option<(&'v str, &'v Located)> {
    let Value::Variant(name, inner) = &v.value else {
        let message = format!("{what} must be a {one}, but it is {}", v.value.what());
        cx.fault(v.origin, message, format!("one of: {}", known.join(", ")));
        return None;
    };
    if !known.contains(&name.as_str()) {
        let origin = Origin { end: v.origin.start + name.len() as u32, ..v.origin };
        let message = format!("{what}: there is no {one} `{name}`");
        cx.fault(origin, message, remedy(name, many, known));
        return None;
    }
    Some((name, inner))
}
