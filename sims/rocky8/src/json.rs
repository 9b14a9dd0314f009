//! JSON with places: errors say where, and what nobody asked for can be listed.
use serde_json::{Map, Value};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::rc::Rc;

/// Errors are messages with the place in the file.
pub type Result<T> = std::result::Result<T, String>;

/// A value and its position in the file.
#[derive(Clone)]
pub struct Json {
    value: Rc<Value>,
    place: String,
    /// Keys of this map that were read.
    asked: Rc<RefCell<BTreeSet<String>>>,
}

impl Json {
    /// A whole file.
    pub fn read(name: &str, text: &str) -> Result<Json> {
        let value = serde_json::from_str(text).map_err(|e| format!("{name}: {e}"))?;
        Ok(Json::new(value, name.to_string()))
    }

    fn new(value: Value, place: String) -> Json {
        Json { value: Rc::new(value), place, asked: Rc::default() }
    }

    /// An error here.
    pub fn error<T>(&self, what: &str) -> Result<T> {
        Err(format!("{}: {what}", self.place))
    }

    fn map(&self) -> Result<&Map<String, Value>> {
        match &*self.value {
            Value::Object(map) => Ok(map),
            _ => self.error("this is not a map"),
        }
    }

    /// An entry, when there is one.
    pub fn find(&self, key: &str) -> Result<Option<Json>> {
        self.asked.borrow_mut().insert(key.into());
        let found = self.map()?.get(key);
        Ok(found.map(|v| Json::new(v.clone(), format!("{}/{key}", self.place))))
    }

    /// An entry.
    pub fn at(&self, key: &str) -> Result<Json> {
        match self.find(key)? {
            Some(v) => Ok(v),
            None => self.error(&format!("`{key}` is missing")),
        }
    }

    /// All entries.
    pub fn entries(&self) -> Result<Vec<(String, Json)>> {
        let keys: Vec<String> = self.map()?.keys().cloned().collect();
        keys.into_iter().map(|k| Ok((k.clone(), self.at(&k)?))).collect()
    }

    /// Keys that nobody asked for.
    pub fn ignored(&self) -> Result<Vec<String>> {
        let asked = self.asked.borrow();
        Ok(self.map()?.keys().filter(|k| !asked.contains(*k)).cloned().collect())
    }

    /// A finite number.
    pub fn number(&self) -> Result<f64> {
        match self.value.as_f64() {
            Some(x) if x.is_finite() => Ok(x),
            _ => self.error("this is not a number"),
        }
    }

    /// A text.
    pub fn text(&self) -> Result<String> {
        match &*self.value {
            Value::String(s) => Ok(s.clone()),
            _ => self.error("this is not a text"),
        }
    }

    /// True or false.
    pub fn flag(&self) -> Result<bool> {
        match &*self.value {
            Value::Bool(b) => Ok(*b),
            _ => self.error("this is neither true nor false"),
        }
    }

    /// The items of a list.
    pub fn items(&self) -> Result<Vec<Json>> {
        match &*self.value {
            Value::Array(items) => {
                let item =
                    |(k, v): (usize, &Value)| Json::new(v.clone(), format!("{}/{k}", self.place));
                Ok(items.iter().enumerate().map(item).collect())
            }
            _ => self.error("this is not a list"),
        }
    }

    /// N numbers.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N]> {
        let all: Vec<f64> = self.items()?.iter().map(Json::number).collect::<Result<_>>()?;
        match <[f64; N]>::try_from(all) {
            Ok(numbers) => Ok(numbers),
            Err(all) => {
                self.error(&format!("{N} numbers are required, but there are {}", all.len()))
            }
        }
    }

    /// Checks that a value is the one on which the conversion relies.
    pub fn must_be(&self, wanted: &Value) -> Result<()> {
        if *self.value == *wanted {
            return Ok(());
        }
        self.error(&format!("this is {}, but only {wanted} can be converted", self.value))
    }
}
