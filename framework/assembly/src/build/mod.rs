//! Assemblies and simulations that a Rust program builds.
//!
//! ```
//! use linkwork_assembly::{Assembly, Body};
//! use linkwork_multibody::Hinge;
//! use linkwork_spatial::Vec3;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut pendulum = Assembly::new();
//! pendulum.body(
//!     "bob",
//!     Body::on("world")
//!         .hinge(Hinge::pin(Vec3::y()))
//!         .mass(1.0)
//!         .com([0.0, 0.0, -1.0])
//!         .inertia([1e-3, 1e-3, 1e-3])
//!         .initial_rate(2.0),
//! );
//! let mut sim = pendulum.simulation()?;
//! sim.run_until(3.0)?; // without gravity
//! assert!((sim.get("bob.angle")? - 6.0).abs() < 1e-9);
//! # Ok(())
//! # }
//! ```
//! Every call writes the value that a file would hold, together with the place of the call. The loader then checks it like a file; the error messages
//! are the same, but contain `file.rs:line:column` of the call.
mod body;
mod items;

pub use body::{Body, BodyInertia};
pub use items::{NewPart, NewWire};

use crate::load::library::{Library, Ready};
use crate::load::load_value;
use crate::text::print::document;
use crate::text::show::{Failure, Look, show_faults};
use linkwork_runtime::{
    Entry, Fault, Integrator, IntoValue, Located, Origin, ParamsBuilder, PartType, Simulation,
    Sources, Value,
};

/// A map: `fields! { resistance: "0.6 ohm", "gear": 20.0 }`.
#[macro_export]
macro_rules! fields {
    (@key $key:ident) => { ::std::string::String::from(stringify!($key)) };
    (@key $key:literal) => { ::std::string::String::from($key) };
    ($($key:tt : $value:expr),* $(,)?) => {
        $crate::Value::Map(vec![
            $(($crate::fields!(@key $key), $crate::IntoValue::into_value($value).into())),*
        ])
    };
}

/// Returns a value with the place of the caller. Values inside it that have a place keep it.
#[track_caller]
fn here(value: impl IntoValue) -> Located {
    let mut value: Located = value.into_value().into();
    value.place(Origin::caller());
    value
}

/// An assembly of parts, bodies and wires, with the settings of its simulation.
///
/// Files use the same names, paths and fields (`framework/assembly/FORMAT.md`). [`Assembly::load`], [`Assembly::ready`] and
/// [`Assembly::simulation`] check the assembly and report all mistakes together.
#[derive(Clone, Default)]
pub struct Assembly {
    fields: Vec<(String, Located)>,
    library: Library,
    faults: Vec<Fault>,
}

impl Assembly {
    /// Makes one without parts.
    #[must_use]
    pub fn new() -> Assembly {
        Assembly::default()
    }

    /// Adds a library: its models can be named by [`Assembly::model`] and by included files, and its files can be included.
    pub fn with_library(&mut self, library: &Library) -> &mut Self {
        library.catalogue.iter().for_each(|entry| self.entry(entry.clone(), Origin::NONE));
        let all = (*self.library.embedded).clone().into_iter();
        self.library.embedded =
            std::sync::Arc::new(all.chain((*library.embedded).clone()).collect());
        self
    }

    /// Adds a body of the mechanism.
    #[track_caller]
    pub fn body(&mut self, name: &str, body: Body) -> &mut Self {
        self.named("bodies", "body", name, here(Value::Map(body.fields)));
        self
    }

    /// Adds a part of a Rust type: a model, a service or a field. `params` sets its parameters; those that it leaves out have
    /// their defaults.
    ///
    /// ```
    /// # use linkwork_assembly::Assembly;
    /// # use linkwork_runtime::prelude::*;
    /// # /// Its value.
    /// # #[derive(Params)]
    /// # struct ConstantParams {
    /// #     /// The value.
    /// #     value: f64,
    /// # }
    /// # /// The value.
    /// # #[derive(Ports)]
    /// # struct Out {
    /// #     /// The value.
    /// #     #[port("1")]
    /// #     y: f64,
    /// # }
    /// # struct Constant {
    /// #     p: ConstantParams,
    /// # }
    /// # /// A constant.
    /// # #[model("example.constant")]
    /// # impl Model for Constant {
    /// #     type Params = ConstantParams;
    /// #     type Outputs = Out;
    /// #     fn outputs(&self) -> Out {
    /// #         Out { y: self.p.value }
    /// #     }
    /// # }
    /// let mut assembly = Assembly::new();
    /// assembly.part::<Constant>("Two", |p| p.value(2.0));
    /// let sim = assembly.simulation().unwrap();
    /// assert_eq!(sim.get("Two.y").unwrap(), 2.0);
    /// ```
    #[track_caller]
    pub fn part<T: PartType>(
        &mut self,
        name: &str,
        params: impl FnOnce(T::Builder) -> T::Builder,
    ) -> NewPart<'_> {
        let entry = T::entry();
        let model = entry.description.name.to_string();
        self.entry(entry, Origin::caller());
        self.model(name, &model, params(T::Builder::default()).into_map())
    }

    /// Adds a part by the name of its model in a catalogue, with a map of parameters: `fields! { resistance: "0.6 ohm" }`.
    #[track_caller]
    pub fn model(&mut self, name: &str, model: &str, params: impl IntoValue) -> NewPart<'_> {
        let mut part = vec![("model".to_string(), here(model))];
        let params = here(params);
        if params.value != Value::Map(Vec::new()) {
            part.push(("params".to_string(), params));
        }
        NewPart { fields: self.named("parts", "part", name, here(Value::Map(part))) }
    }

    /// Adds an assembly from a file: of a library ([`Assembly::with_library`]), or relative to the working directory.
    #[track_caller]
    pub fn include(&mut self, name: &str, file: &str) -> NewPart<'_> {
        let part = vec![("assembly".to_string(), here(file))];
        NewPart { fields: self.named("parts", "part", name, here(Value::Map(part))) }
    }

    /// Adds another assembly in place. The nested assembly can use the parameters and bodies around it.
    #[track_caller]
    pub fn nest(&mut self, name: &str, inner: Assembly) -> &mut Self {
        self.with_library(&inner.library);
        self.faults.extend(inner.faults);
        let mut fields = inner.fields;
        if !fields.iter().any(|(key, _)| key == "parts") {
            fields.push(("parts".to_string(), here(Value::Map(Vec::new()))));
        }
        self.named("parts", "part", name, here(Value::Map(fields)));
        self
    }

    /// Wires an output to an input: `wire("Ramp.y", "Motor.volts")`. The value arrives at once unless the returned wire is
    /// given a delay.
    #[track_caller]
    pub fn wire(&mut self, from: &str, to: &str) -> NewWire<'_> {
        NewWire { item: self.item("wires", here(format!("{from} -> {to}"))) }
    }

    /// Joins two or more connectors: `connect(["Motor.supply", "Battery.terminal"])`.
    #[track_caller]
    pub fn connect<const N: usize>(&mut self, connectors: [&str; N]) -> &mut Self {
        self.item("connect", here(connectors));
        self
    }

    /// Makes the port of a part a port of this assembly.
    #[track_caller]
    pub fn export(&mut self, name: &str, port: &str) -> &mut Self {
        self.named("exports", "export", name, here(port));
        self
    }

    /// Declares a parameter of this assembly: `fields! { unit: "m", default: 0.25, range: [1e-3, 5.0], doc: ".." }`. Values
    /// inside name it with a dollar sign: `"$radius"`.
    #[track_caller]
    pub fn param(&mut self, name: &str, fields: impl IntoValue) -> &mut Self {
        self.named("params", "parameter", name, here(fields));
        self
    }

    /// Adds a hinge that closes a loop: `fields! { a: "crank/pin", b: "rod", hinge: variant("Pin", [0, 1, 0]) }`.
    #[track_caller]
    pub fn loop_closure(&mut self, name: &str, fields: impl IntoValue) -> &mut Self {
        self.named("loops", "loop", name, here(fields));
        self
    }

    /// Adds a linear relation between hinge coordinates: `fields! { terms: fields! { left: 1.0, right: 1.0 } }`.
    #[track_caller]
    pub fn coupling(&mut self, name: &str, fields: impl IntoValue) -> &mut Self {
        self.named("couplings", "coupling", name, here(fields));
        self
    }

    /// Adds a collision shape: `fields! { on: "world", shape: variant("HalfSpace", Value::Null) }`.
    #[track_caller]
    pub fn collider(&mut self, name: &str, fields: impl IntoValue) -> &mut Self {
        self.named("colliders", "collider", name, here(fields));
        self
    }

    /// Sets a parameter below this assembly by its path: `"Rover.Motor.gear"`.
    #[track_caller]
    pub fn override_param(&mut self, path: &str, value: impl IntoValue) -> &mut Self {
        self.named("overrides", "override", path, here(value));
        self
    }

    /// Sets the time between rows, in which sampled parts, contact and fixed-step integrators advance: seconds, or a text such as
    /// `"1 ms"`. Default: 1 ms.
    #[track_caller]
    pub fn step(&mut self, step: impl IntoValue) -> &mut Self {
        self.set("step", here(step))
    }

    /// Sets the integrator. Default: the classical Runge–Kutta method.
    #[track_caller]
    pub fn integrator(&mut self, integrator: Integrator) -> &mut Self {
        let name = Integrator::ALL.iter().find(|(_, i)| *i == integrator).map_or("", |(n, _)| n);
        self.set("integrator", here(name))
    }

    /// Sets the errors that the steps of an integrator with step size control may make: a part of each state, and in the unit of
    /// each state.
    #[track_caller]
    pub fn accuracy(&mut self, relative: f64, absolute: f64) -> &mut Self {
        let value = fields! { relative: relative, absolute: absolute };
        self.set("accuracy", here(value))
    }

    /// Sets a field of the simulation or assembly by the name that it has in files: `set("seed", 7)`,
    /// `set("contact", fields! { friction: 0.6 })`, `set("stop_when", "Tank.mass < 1 kg")`. A field that was set before is replaced.
    #[track_caller]
    pub fn set(&mut self, field: &str, value: impl IntoValue) -> &mut Self {
        let value = here(value);
        match self.fields.iter_mut().find(|(key, _)| key == field) {
            Some((_, there)) => *there = value,
            None => self.fields.push((field.to_string(), value)),
        }
        self
    }

    /// Returns the text of a simulation file with the same content.
    #[must_use]
    pub fn to_ron(&self) -> String {
        document(&self.value("Simulation"))
    }

    /// Loads it without compiling it: the flat specification, as of a file.
    ///
    /// # Errors
    /// Everything that is wrong, at once, each mistake with the place of its call.
    pub fn load(&self) -> Result<crate::Loaded, Failure> {
        let faults = self.faults.clone();
        let mut options = self.library.options(&[], None);
        options.search.insert(0, std::path::PathBuf::from("."));
        load_value("the assembly", self.value("Simulation").into(), faults, &options)
    }

    /// Loads, compiles and places it: the plans of all phases, and the warnings.
    ///
    /// # Errors
    /// Everything that is wrong, at once, each mistake with the place of its call.
    pub fn ready(&self) -> Result<Ready, Failure> {
        self.library.ready(self.load()?)
    }

    /// Makes a simulation at time zero. Warnings go to the standard error; [`Assembly::ready`] returns them instead.
    ///
    /// # Errors
    /// Everything that is wrong, at once, each mistake with the place of its call.
    pub fn simulation(&self) -> Result<Simulation, Failure> {
        let ready = self.ready()?;
        let warnings = show_faults(&ready.warnings(), &Sources::default(), Look::Plain);
        if !warnings.is_empty() {
            eprint!("{}", warnings.replace("error: ", "warning: "));
        }
        Ok(ready.simulation())
    }

    fn value(&self, kind: &str) -> Value {
        Value::Variant(kind.into(), Box::new(Value::Map(self.fields.clone()).into()))
    }

    fn entry(&mut self, entry: Entry, origin: Origin) {
        if let Err(name) = self.library.catalogue.include(entry) {
            let fact = format!("two types of parts have the name `{name}`");
            let help =
                "give one of them another name in its attribute, as in #[model(\"library.name\")]";
            self.faults.push(Fault::new(origin, fact).help(help));
        }
    }

    /// The value of a field, which is made when there is none.
    fn field(&mut self, field: &str, empty: Value, origin: Origin) -> &mut Value {
        let at = match self.fields.iter().position(|(key, _)| key == field) {
            Some(at) => at,
            None => {
                self.fields.push((field.to_string(), Located { value: empty, origin }));
                self.fields.len() - 1
            }
        };
        &mut self.fields[at].1.value
    }

    /// Adds an entry to a map of things with names.
    fn named(&mut self, field: &str, kind: &str, name: &str, value: Located) -> &mut Located {
        let origin = value.origin;
        let taken = match self.field(field, Value::Map(Vec::new()), origin) {
            Value::Map(entries) => entries.iter().any(|(key, _)| key == name),
            other => {
                // The caller used `set` to replace the table by another kind of value; start a new
                // table.
                *other = Value::Map(Vec::new());
                false
            }
        };
        if taken {
            let fact = format!("there are two entries `{name}` in `{field}`");
            let help = format!("give the second {kind} another name");
            self.faults.push(Fault::new(origin, fact).help(help));
        }
        let Value::Map(entries) = self.field(field, Value::Null, origin) else {
            unreachable!("the field is a map")
        };
        entries.push((name.to_string(), value));
        let last = entries.len() - 1;
        &mut entries[last].1
    }

    /// Adds an item to a list.
    fn item(&mut self, field: &str, value: Located) -> &mut Located {
        let list = self.field(field, Value::List(Vec::new()), value.origin);
        if !matches!(list, Value::List(_)) {
            *list = Value::List(Vec::new());
        }
        let Value::List(items) = list else { unreachable!("the field is a list") };
        items.push(value);
        let last = items.len() - 1;
        &mut items[last]
    }
}
