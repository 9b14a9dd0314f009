//! Splits one level of a text with `ron`: a scalar, or the pieces of a list or map, unparsed.
use linkwork_runtime::Value;
use ron::Deserializer;
use ron::value::RawValue;
use serde::de::{self, DeserializeSeed, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// Returns a text, number or word that is the whole token.
pub(crate) fn scalar(token: &str) -> Option<Value> {
    let mut de = Deserializer::from_str(token).ok()?;
    match de::Deserializer::deserialize_any(&mut de, Pieces) {
        Ok(Piece::Value(value)) if de.remainder().is_empty() => Some(value),
        _ => None,
    }
}

/// Name of the expected key in messages of [`KeySeed`].
pub(crate) const KEY: &str = "a text as key";

pub(crate) enum Key<'t> {
    Borrowed(&'t str),
    Owned(String),
}

pub(crate) enum Piece<'t> {
    Value(Value),
    List(Vec<&'t str>),
    Map(Vec<(Key<'t>, &'t str)>),
}

/// Splits one level into unparsed pieces.
pub(crate) struct Pieces;

impl<'t> Visitor<'t> for Pieces {
    type Value = Piece<'t>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }
    fn visit_bool<E: de::Error>(self, b: bool) -> Result<Piece<'t>, E> {
        Ok(Piece::Value(Value::Bool(b)))
    }
    fn visit_i64<E: de::Error>(self, x: i64) -> Result<Piece<'t>, E> {
        Ok(Piece::Value(Value::Number(x as f64)))
    }
    fn visit_u64<E: de::Error>(self, x: u64) -> Result<Piece<'t>, E> {
        Ok(Piece::Value(Value::Number(x as f64)))
    }
    fn visit_i128<E: de::Error>(self, x: i128) -> Result<Piece<'t>, E> {
        Ok(Piece::Value(Value::Number(x as f64)))
    }
    fn visit_u128<E: de::Error>(self, x: u128) -> Result<Piece<'t>, E> {
        Ok(Piece::Value(Value::Number(x as f64)))
    }
    fn visit_f64<E: de::Error>(self, x: f64) -> Result<Piece<'t>, E> {
        Ok(Piece::Value(Value::Number(x)))
    }
    fn visit_str<E: de::Error>(self, s: &str) -> Result<Piece<'t>, E> {
        Ok(Piece::Value(Value::Text(s.into())))
    }
    fn visit_none<E: de::Error>(self) -> Result<Piece<'t>, E> {
        Ok(Piece::Value(Value::Null))
    }
    fn visit_unit<E: de::Error>(self) -> Result<Piece<'t>, E> {
        Ok(Piece::Value(Value::Null))
    }
    fn visit_seq<A: SeqAccess<'t>>(self, mut seq: A) -> Result<Piece<'t>, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = seq.next_element::<&'t RawValue>()? {
            items.push(item.get_ron());
        }
        Ok(Piece::List(items))
    }
    fn visit_map<A: MapAccess<'t>>(self, mut map: A) -> Result<Piece<'t>, A::Error> {
        let mut entries = Vec::new();
        while let Some(key) = map.next_key_seed(KeySeed)? {
            entries.push((key, map.next_value::<&RawValue>()?.get_ron()));
        }
        Ok(Piece::Map(entries))
    }
}

struct KeySeed;

impl<'t> DeserializeSeed<'t> for KeySeed {
    type Value = Key<'t>;
    fn deserialize<D: de::Deserializer<'t>>(self, d: D) -> Result<Key<'t>, D::Error> {
        d.deserialize_any(self)
    }
}

impl<'t> Visitor<'t> for KeySeed {
    type Value = Key<'t>;
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(KEY)
    }
    fn visit_borrowed_str<E: de::Error>(self, s: &'t str) -> Result<Key<'t>, E> {
        Ok(Key::Borrowed(s))
    }
    fn visit_str<E: de::Error>(self, s: &str) -> Result<Key<'t>, E> {
        Ok(Key::Owned(s.into()))
    }
}
