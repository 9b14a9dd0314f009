//! Parameters that are services.
use crate::author::params::{Param, ParamSpec, ReadCx};
use crate::author::services::{Handle, Provided};
use crate::author::value::{Located, Origin, Value};

impl<T: ?Sized + Provided> Param for Handle<T> {
    fn kind() -> String {
        format!("path of a {} service", T::WORD)
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Self> {
        let Value::Text(path) = &v.value else {
            cx.wrong(v, spec, "the path of a service");
            return None;
        };
        Self::find(Some(path), v.origin, cx)
    }
    fn missing(_: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Option<Self>> {
        Some(Self::find(None, Origin::NONE, cx))
    }
    fn if_there(cx: &mut ReadCx<'_>) -> Option<Self> {
        let any = cx.services.iter().any(|(_, object)| object.get::<T>().is_some());
        if any { Self::find(None, Origin::NONE, cx) } else { None }
    }
    fn show(&self) -> Value {
        Value::Text(self.path().to_string())
    }
}

impl<T: ?Sized + Provided> Handle<T> {
    fn find(path: Option<&str>, origin: Origin, cx: &mut ReadCx<'_>) -> Option<Self> {
        match cx.services.find::<T>(path, &cx.path) {
            Ok(handle) => {
                cx.asked.push(handle.path().to_string());
                Some(handle)
            }
            Err(missing) => {
                if let Some((message, help)) = missing {
                    let message = format!("`{}`: {message}", cx.path);
                    cx.fault(origin, message, Some(help));
                }
                None
            }
        }
    }
}
