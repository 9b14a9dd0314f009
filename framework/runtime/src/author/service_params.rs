//! Parameters that are services or scenery.
use crate::author::params::{Param, ParamSpec, ReadCx};
use crate::author::pattern;
use crate::author::scenery::{KIND, Scenery, WORLD};
use crate::author::services::{Handle, Provided};
use crate::author::value::{Fault, Located, Origin, Value, remedy};

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

impl Param for Scenery {
    fn kind() -> String {
        KIND.into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Self> {
        let patterns = Vec::<String>::read(v, spec, cx)?;
        let all = &cx.services.scenery;
        let names: Vec<&str> = all.shapes.iter().map(|s| s.body.as_str()).collect();
        let nobody = |p: &&String| !names.iter().any(|n| pattern::path_matches(p, n));
        // Without a specification the scenery is empty, and names cannot be checked.
        if let Some(stray) = patterns.iter().find(nobody).filter(|_| !names.is_empty()) {
            let fact = format!("`{}.{}`: no body with a shape is `{stray}`", cx.path, spec.name);
            let known: Vec<&str> = all.bodies.iter().map(String::as_str).chain([WORLD]).collect();
            cx.faults.push(Fault::new(v.origin, fact).help(remedy(stray, "bodies", &known)));
            return None;
        }
        Some(all.only(patterns))
    }
    fn missing(_: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Option<Self>> {
        Some(Some(cx.services.scenery.clone()))
    }
    /// Returns the patterns; without any, the pattern that matches everything.
    fn show(&self) -> Value {
        self.only.clone().unwrap_or_else(|| vec!["**".into()]).show()
    }
}
