//! Tokens that `ron` reads: texts with escapes, numbers with bases or suffixes.
use linkwork_runtime::Value;
use ron::Deserializer;
use serde::de::{self, Deserializer as _, Visitor};
use std::fmt;

/// The value of a token.
///
/// # Errors
/// Why it is none, in the words of `ron`.
pub(crate) fn scalar(token: &str) -> Result<Value, String> {
    let mut reader = Deserializer::from_str(token).map_err(|e| e.code.to_string())?;
    let value = reader.deserialize_any(Scalar).map_err(|e| e.to_string())?;
    match reader.remainder() {
        "" => Ok(value),
        rest => Err(format!("`{rest}` after a value")),
    }
}

struct Scalar;

impl Visitor<'_> for Scalar {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }
    fn visit_bool<E: de::Error>(self, b: bool) -> Result<Value, E> {
        Ok(Value::Bool(b))
    }
    fn visit_i64<E: de::Error>(self, x: i64) -> Result<Value, E> {
        Ok(Value::Number(x as f64))
    }
    fn visit_u64<E: de::Error>(self, x: u64) -> Result<Value, E> {
        Ok(Value::Number(x as f64))
    }
    fn visit_i128<E: de::Error>(self, x: i128) -> Result<Value, E> {
        Ok(Value::Number(x as f64))
    }
    fn visit_u128<E: de::Error>(self, x: u128) -> Result<Value, E> {
        Ok(Value::Number(x as f64))
    }
    fn visit_f64<E: de::Error>(self, x: f64) -> Result<Value, E> {
        Ok(Value::Number(x))
    }
    fn visit_str<E: de::Error>(self, s: &str) -> Result<Value, E> {
        Ok(Value::Text(s.into()))
    }
}
