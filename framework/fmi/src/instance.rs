//! A live instance of a unit: one safe set of operations for both versions of the C interface.
//!
//! ```text
//! instantiated → set start values → initialization → step ⇄ event (co-simulation)
//!                                                  → event ⇄ continuous time (model exchange)
//! ```
//! The status of every call is checked. After an error, the only permitted call is the end of the instance; after a fatal error, no call is
//! permitted.
mod stepping;

use crate::abi::{Callbacks2, EventInfo2, Raw, Status, calloc, free};
use crate::kind::Kind;
use crate::log::{Log, logger2, logger3};
use crate::slot::Slot;
use crate::unit::has_events;
use crate::unit::{Functions, Unit};
use linkwork_formats::fmi::{FmiVersion, VariableKind};
use linkwork_runtime::Failure;
use std::ffi::{CString, c_int, c_void};
use std::ptr::null_mut;
use std::sync::Arc;

/// Largest size of a serialized state, bytes.
const STATE_MAX: usize = 1 << 30;

/// State of a unit after an event.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Discrete {
    /// One more pass is needed.
    pub needed: bool,
    /// The unit requests the end of the simulation.
    pub terminate: bool,
    /// Time of the next event (s).
    pub next: Option<f64>,
}

/// State of the instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Instantiated,
    Initialized,
    /// After an error: it can only be ended.
    Failed,
    /// After a fatal error: it must not be called any more.
    Dead,
}

/// A live instance.
pub(crate) struct Instance {
    raw: Raw,
    stage: Stage,
    kind: Kind,
    unit: Arc<Unit>,
    /// Foreign code keeps pointers to these until the instance is freed.
    log: Box<Log>,
    _callbacks: Option<Box<Callbacks2>>,
    numbers: Vec<f64>,
    bytes: Vec<u8>,
}

// SAFETY: an instance is used by one thread at a time (every operation takes `&mut self`), as the
// standard requires; the log is shared only with calls of that thread and is behind a mutex.
unsafe impl Send for Instance {}

pub(crate) type Result<T> = std::result::Result<T, Box<Failure>>;

fn failure(message: impl Into<String>, help: &str) -> Box<Failure> {
    Box::new(Failure { message: message.into(), help: Some(help.into()) })
}

const ASK: &str =
    "the unit reported an error: check its start values and its inputs at this instant";

/// Returns the function, or an error if it is missing.
fn there<F>(function: Option<F>, name: &str) -> Result<F> {
    function.ok_or_else(|| {
        failure(
            format!("its shared library lacks the function `{name}`"),
            "its library does not match its description: export the unit again",
        )
    })
}

/// Calls a function of the unit's version, for calls with equal arguments in both versions.
macro_rules! both {
    ($self:ident, $f:ident, $may:ident, $name:literal $(, $arg:expr)*) => {
        both!($self, $f, $may, $name | $name $(, $arg)*)
    };
    ($self:ident, $f:ident, $may:ident, $two:literal | $three:literal $(, $arg:expr)*) => {{
        let unit = $self.unit.clone();
        let (status, name) = match &unit.functions {
            Functions::V2($f) => { let f = there($f.$may, concat!("fmi2", $two))?;
                // SAFETY: arguments as the header says; pointers are valid for the call.
                (unsafe { f($self.raw $(, $arg)*) }, $two) }
            Functions::V3($f) => { let f = there($f.$may, concat!("fmi3", $three))?;
                // SAFETY: as above.
                (unsafe { f($self.raw $(, $arg)*) }, $three) }
        };
        $self.check(status, name)
    }};
}

impl Instance {
    /// Instantiates a unit.
    pub fn new(unit: &Arc<Unit>, kind: Kind, name: &str) -> Result<Instance> {
        unit.claim(name)?;
        let made = Self::instantiate(unit, kind, name);
        if made.is_err() {
            unit.release();
        }
        made
    }

    fn instantiate(unit: &Arc<Unit>, kind: Kind, name: &str) -> Result<Instance> {
        let text = |t: &str| CString::new(t.replace('\0', "")).unwrap_or_default();
        let (label, token) = (text(name), text(&unit.description.token));
        let log = Box::<Log>::default();
        let environment = std::ptr::from_ref::<Log>(&log).cast_mut().cast::<c_void>();
        let mut callbacks = None;
        let raw = match &unit.functions {
            Functions::V2(f) => {
                let resources = text(&unit.resources_uri());
                let table = callbacks.insert(Box::new(Callbacks2 {
                    logger: logger2,
                    allocate: calloc,
                    free,
                    step_finished: None,
                    environment,
                }));
                let kind = c_int::from(kind == Kind::CoSimulation);
                // SAFETY: strings and callbacks live until the instance is freed, or for this call
                // if the standard does not permit the unit to keep a reference.
                unsafe {
                    (f.instantiate)(
                        label.as_ptr(),
                        kind,
                        token.as_ptr(),
                        resources.as_ptr(),
                        &**table,
                        0,
                        0,
                    )
                }
            }
            Functions::V3(f) => {
                let resources = text(&unit.resources_path());
                match kind {
                    Kind::CoSimulation => {
                        let make = there(f.instantiate_cs, "fmi3InstantiateCoSimulation")?;
                        let events = has_events(unit);
                        // SAFETY: as above; early return is permitted only with event mode, and
                        // intermediate updates are disabled.
                        unsafe {
                            make(
                                label.as_ptr(),
                                token.as_ptr(),
                                resources.as_ptr(),
                                false,
                                false,
                                events,
                                events,
                                std::ptr::null(),
                                0,
                                environment,
                                logger3,
                                std::ptr::null(),
                            )
                        }
                    }
                    Kind::ModelExchange => {
                        let make = there(f.instantiate_me, "fmi3InstantiateModelExchange")?;
                        // SAFETY: as above.
                        unsafe {
                            make(
                                label.as_ptr(),
                                token.as_ptr(),
                                resources.as_ptr(),
                                false,
                                false,
                                environment,
                                logger3,
                            )
                        }
                    }
                }
            }
        };
        if raw.is_null() {
            return Err(failure(
                format!("the unit cannot be instantiated{}", log.take()),
                "its description and shared library may not match (token or guid), or \
                 its resources are missing: export the unit again",
            ));
        }
        Ok(Instance {
            raw,
            stage: Stage::Instantiated,
            kind,
            unit: unit.clone(),
            log,
            _callbacks: callbacks,
            numbers: Vec::new(),
            bytes: Vec::new(),
        })
    }

    /// Converts a status to a result.
    fn check(&mut self, status: Status, call: &str) -> Result<()> {
        let word = match status {
            0 | 1 => return Ok(()),
            2 => "discard",
            3 => "error",
            4 => "fatal error",
            5 => "pending",
            _ => "an unknown status",
        };
        self.stage = if status == 3 { Stage::Failed } else { self.stage };
        if !(0..=3).contains(&status) {
            self.stage = Stage::Dead;
        }
        let prefix = match self.unit.description.version {
            FmiVersion::V2 => "fmi2",
            FmiVersion::V3 => "fmi3",
        };
        let message = format!("`{prefix}{call}` of the unit returned {word}{}", self.log.take());
        let help = match (status, call) {
            (2, "DoStep") => "use a shorter communication step (the part's `rate`)",
            _ => ASK,
        };
        Err(failure(message, help))
    }

    /// Initializes the unit. Start values must be set before.
    pub fn initialize(&mut self, start: f64, tolerance: Option<f64>) -> Result<()> {
        let unit = self.unit.clone();
        let (defined, tolerance) = (tolerance.is_some(), tolerance.unwrap_or(0.0));
        match &unit.functions {
            Functions::V2(f) => {
                let flag = c_int::from(defined);
                // SAFETY: a living instance; arguments are numbers.
                let status = unsafe { (f.setup)(self.raw, flag, tolerance, start, 0, 0.0) };
                self.check(status, "SetupExperiment")?;
                // SAFETY: as above.
                let status = unsafe { (f.enter_initialization)(self.raw) };
                self.check(status, "EnterInitializationMode")?;
                // SAFETY: as above.
                let status = unsafe { (f.exit_initialization)(self.raw) };
                self.check(status, "ExitInitializationMode")?;
            }
            Functions::V3(f) => {
                // SAFETY: as above.
                let status = unsafe {
                    (f.enter_initialization)(self.raw, defined, tolerance, start, false, 0.0)
                };
                self.check(status, "EnterInitializationMode")?;
                // SAFETY: as above.
                let status = unsafe { (f.exit_initialization)(self.raw) };
                self.check(status, "ExitInitializationMode")?;
            }
        }
        // Model exchange, and co-simulation with event mode, are then in event mode.
        self.stage = Stage::Initialized;
        Ok(())
    }

    /// Reads the values of a variable, in SI.
    pub fn get(&mut self, slot: &Slot, out: &mut [f64]) -> Result<()> {
        let unit = self.unit.clone();
        let (vr, n) = (&raw const slot.reference, out.len());
        let raw = self.raw;
        // Types other than f64 are read through a separate buffer.
        macro_rules! through {
            ($ty:ty, $call:expr, ($($n:expr)?), $name:literal) => {{
                let mut small = [<$ty>::default(); 16];
                let mut large = Vec::new();
                let buffer: &mut [$ty] = if n <= 16 {
                    &mut small[..n]
                } else {
                    large.resize(n, <$ty>::default());
                    &mut large
                };
                let call = $call;
                // SAFETY: one reference, and room for its values.
                let status = unsafe { call(raw, vr, 1, buffer.as_mut_ptr() $(, $n)?) };
                for (o, b) in out.iter_mut().zip(buffer.iter()) {
                    *o = *b as f64;
                }
                self.check(status, $name)
            }};
        }
        match &unit.functions {
            Functions::V2(f) => match slot.kind {
                VariableKind::Float64 => {
                    // SAFETY: one reference and one value.
                    let status = unsafe { (f.get_real)(raw, vr, 1, out.as_mut_ptr()) };
                    self.check(status, "GetReal")?;
                }
                VariableKind::Boolean => {
                    through!(c_int, f.get_boolean, (), "GetBoolean")?;
                }
                _ => {
                    through!(c_int, f.get_integer, (), "GetInteger")?;
                }
            },
            Functions::V3(f) => {
                use VariableKind as K;
                match slot.kind {
                    K::Float64 => {
                        // SAFETY: one reference and room for its values.
                        let status = unsafe { (f.get_float64)(raw, vr, 1, out.as_mut_ptr(), n) };
                        self.check(status, "GetFloat64")
                    }
                    K::Float32 => {
                        through!(f32, there(f.get_float32, "fmi3GetFloat32")?, (n), "GetFloat32")
                    }
                    K::Int8 => through!(i8, there(f.get_int8, "fmi3GetInt8")?, (n), "GetInt8"),
                    K::UInt8 => through!(u8, there(f.get_uint8, "fmi3GetUInt8")?, (n), "GetUInt8"),
                    K::Int16 => through!(i16, there(f.get_int16, "fmi3GetInt16")?, (n), "GetInt16"),
                    K::UInt16 => {
                        through!(u16, there(f.get_uint16, "fmi3GetUInt16")?, (n), "GetUInt16")
                    }
                    K::Int32 => through!(i32, there(f.get_int32, "fmi3GetInt32")?, (n), "GetInt32"),
                    K::UInt32 => {
                        through!(u32, there(f.get_uint32, "fmi3GetUInt32")?, (n), "GetUInt32")
                    }
                    K::Int64 | K::Enumeration => {
                        through!(i64, there(f.get_int64, "fmi3GetInt64")?, (n), "GetInt64")
                    }
                    K::UInt64 => {
                        through!(u64, there(f.get_uint64, "fmi3GetUInt64")?, (n), "GetUInt64")
                    }
                    K::Boolean => {
                        through!(u8, there(f.get_boolean, "fmi3GetBoolean")?, (n), "GetBoolean")
                    }
                    K::String | K::Binary | K::Clock => Err(not_numeric(slot)),
                }?;
            }
        }
        if slot.factor != 1.0 || slot.offset != 0.0 {
            out.iter_mut().for_each(|v| *v = slot.factor * *v + slot.offset);
        }
        Ok(())
    }

    /// Sets the values of a variable, given in SI.
    pub fn set(&mut self, slot: &Slot, values: &[f64]) -> Result<()> {
        let unit = self.unit.clone();
        let (vr, n, raw) = (&raw const slot.reference, values.len(), self.raw);
        self.numbers.clear();
        let own = values.iter().map(|v| (v - slot.offset) / slot.factor);
        if slot.factor == 1.0 && slot.offset == 0.0 {
            self.numbers.extend_from_slice(values);
        } else {
            self.numbers.extend(own);
        }
        if slot.kind == VariableKind::Boolean {
            self.numbers.iter_mut().for_each(|v| *v = f64::from(u8::from(*v > 0.5)));
        }
        let numbers = std::mem::take(&mut self.numbers);
        macro_rules! through {
            ($ty:ty, $call:expr, ($($n:expr)?), $name:literal) => {{
                let mut small = [<$ty>::default(); 16];
                let mut large = Vec::new();
                let buffer: &mut [$ty] = if n <= 16 {
                    &mut small[..n]
                } else {
                    large.resize(n, <$ty>::default());
                    &mut large
                };
                for (b, v) in buffer.iter_mut().zip(&numbers) {
                    *b = *v as $ty;
                    if *b as f64 != *v {
                        return Err(not_whole(slot, *v, stringify!($ty)));
                    }
                }
                let call = $call;
                // SAFETY: one reference and its values.
                let status = unsafe { call(raw, vr, 1, buffer.as_ptr() $(, $n)?) };
                self.check(status, $name)
            }};
        }
        let done = match &unit.functions {
            Functions::V2(f) => match slot.kind {
                VariableKind::Float64 => {
                    // SAFETY: one reference and one value.
                    let status = unsafe { (f.set_real)(raw, vr, 1, numbers.as_ptr()) };
                    self.check(status, "SetReal")
                }
                VariableKind::Boolean => {
                    through!(c_int, f.set_boolean, (), "SetBoolean")
                }
                _ => {
                    through!(c_int, f.set_integer, (), "SetInteger")
                }
            },
            Functions::V3(f) => {
                use VariableKind as K;
                match slot.kind {
                    K::Float64 => {
                        // SAFETY: one reference and its values.
                        let status = unsafe { (f.set_float64)(raw, vr, 1, numbers.as_ptr(), n) };
                        self.check(status, "SetFloat64")
                    }
                    K::Float32 => {
                        let narrow: Vec<f32> = numbers.iter().map(|v| *v as f32).collect();
                        let call = there(f.set_float32, "fmi3SetFloat32")?;
                        // SAFETY: as above.
                        let status = unsafe { call(raw, vr, 1, narrow.as_ptr(), n) };
                        self.check(status, "SetFloat32")
                    }
                    K::Int8 => through!(i8, there(f.set_int8, "fmi3SetInt8")?, (n), "SetInt8"),
                    K::UInt8 => through!(u8, there(f.set_uint8, "fmi3SetUInt8")?, (n), "SetUInt8"),
                    K::Int16 => through!(i16, there(f.set_int16, "fmi3SetInt16")?, (n), "SetInt16"),
                    K::UInt16 => {
                        through!(u16, there(f.set_uint16, "fmi3SetUInt16")?, (n), "SetUInt16")
                    }
                    K::Int32 => through!(i32, there(f.set_int32, "fmi3SetInt32")?, (n), "SetInt32"),
                    K::UInt32 => {
                        through!(u32, there(f.set_uint32, "fmi3SetUInt32")?, (n), "SetUInt32")
                    }
                    K::Int64 | K::Enumeration => {
                        through!(i64, there(f.set_int64, "fmi3SetInt64")?, (n), "SetInt64")
                    }
                    K::UInt64 => {
                        through!(u64, there(f.set_uint64, "fmi3SetUInt64")?, (n), "SetUInt64")
                    }
                    K::Boolean => {
                        through!(u8, there(f.set_boolean, "fmi3SetBoolean")?, (n), "SetBoolean")
                    }
                    K::String | K::Binary | K::Clock => Err(not_numeric(slot)),
                }
            }
        };
        self.numbers = numbers;
        done
    }

    /// Sets a text.
    pub fn set_text(&mut self, reference: u32, text: &str) -> Result<()> {
        let unit = self.unit.clone();
        let text = CString::new(text)
            .map_err(|_| failure("a text contains the character 0", "write another text"))?;
        let (vr, list) = (&raw const reference, [text.as_ptr()]);
        let status = match &unit.functions {
            // SAFETY: one reference and one C string that lives during the call.
            Functions::V2(f) => unsafe { (f.set_string)(self.raw, vr, 1, list.as_ptr()) },
            Functions::V3(f) => {
                let set = there(f.set_string, "fmi3SetString")?;
                // SAFETY: as above.
                unsafe { set(self.raw, vr, 1, list.as_ptr(), 1) }
            }
        };
        self.check(status, "SetString")
    }

    /// Returns whether it can only be ended, after an error.
    pub fn is_over(&self) -> bool {
        matches!(self.stage, Stage::Failed | Stage::Dead)
    }

    pub fn enter_event(&mut self) -> Result<()> {
        both!(self, f, enter_event, "EnterEventMode")
    }
    pub fn enter_continuous(&mut self) -> Result<()> {
        both!(self, f, enter_continuous, "EnterContinuousTimeMode")
    }
    pub fn set_time(&mut self, t: f64) -> Result<()> {
        both!(self, f, set_time, "SetTime", t)
    }
    pub fn set_states(&mut self, x: &[f64]) -> Result<()> {
        if x.is_empty() {
            return Ok(());
        }
        both!(self, f, set_states, "SetContinuousStates", x.as_ptr(), x.len())
    }
    pub fn states(&mut self, x: &mut [f64]) -> Result<()> {
        if x.is_empty() {
            return Ok(());
        }
        both!(self, f, get_states, "GetContinuousStates", x.as_mut_ptr(), x.len())
    }
    pub fn derivatives(&mut self, xdot: &mut [f64]) -> Result<()> {
        if xdot.is_empty() {
            return Ok(());
        }
        both!(
            self,
            f,
            get_derivatives,
            "GetDerivatives" | "GetContinuousStateDerivatives",
            xdot.as_mut_ptr(),
            xdot.len()
        )
    }
    pub fn indicators(&mut self, z: &mut [f64]) -> Result<()> {
        if z.is_empty() {
            return Ok(());
        }
        both!(self, f, get_indicators, "GetEventIndicators", z.as_mut_ptr(), z.len())
    }

    /// Makes one pass of an event.
    pub fn discrete_states(&mut self) -> Result<Discrete> {
        let unit = self.unit.clone();
        let found = match &unit.functions {
            Functions::V2(f) => {
                let update = there(f.discrete_states, "fmi2NewDiscreteStates")?;
                let mut info = EventInfo2::default();
                // SAFETY: room for the answer.
                let status = unsafe { update(self.raw, &mut info) };
                self.check(status, "NewDiscreteStates")?;
                Discrete {
                    needed: info.needed != 0,
                    terminate: info.terminate != 0,
                    next: (info.next_defined != 0).then_some(info.next),
                }
            }
            Functions::V3(f) => {
                let update = there(f.discrete_states, "fmi3UpdateDiscreteStates")?;
                let (mut needed, mut end, mut nominals, mut values, mut defined) = (0, 0, 0, 0, 0);
                let mut next = 0.0;
                // SAFETY: room for six answers.
                let status = unsafe {
                    update(
                        self.raw,
                        &mut needed,
                        &mut end,
                        &mut nominals,
                        &mut values,
                        &mut defined,
                        &mut next,
                    )
                };
                self.check(status, "UpdateDiscreteStates")?;
                Discrete {
                    needed: needed != 0,
                    terminate: end != 0,
                    next: (defined != 0).then_some(next),
                }
            }
        };
        if found.terminate {
            return Err(ended(&self.log));
        }
        Ok(found)
    }

    /// Activates an input clock, in event mode.
    pub fn activate(&mut self, clock: u32) -> Result<()> {
        let unit = self.unit.clone();
        let Functions::V3(f) = &unit.functions else { return Ok(()) };
        let (set, active) = (there(f.set_clock, "fmi3SetClock")?, true);
        // SAFETY: one reference and one value.
        let status = unsafe { set(self.raw, &raw const clock, 1, &raw const active) };
        self.check(status, "SetClock")
    }

    /// Returns whether an output clock ticks, in event mode.
    pub fn ticks(&mut self, clock: u32) -> Result<bool> {
        let unit = self.unit.clone();
        let Functions::V3(f) = &unit.functions else { return Ok(false) };
        let get = there(f.get_clock, "fmi3GetClock")?;
        let mut active = 0;
        // SAFETY: one reference, and room for one value.
        let status = unsafe { get(self.raw, &raw const clock, 1, &raw mut active) };
        self.check(status, "GetClock")?;
        Ok(active != 0)
    }

    /// Returns the time until the next tick of a countdown clock (s), if the unit has changed it since the last call.
    pub fn countdown(&mut self, clock: u32) -> Result<Option<f64>> {
        let unit = self.unit.clone();
        let Functions::V3(f) = &unit.functions else { return Ok(None) };
        let get = there(f.get_interval, "fmi3GetIntervalDecimal")?;
        let (mut interval, mut qualifier) = (0.0, 0);
        // SAFETY: one reference, and room for two answers.
        let status =
            unsafe { get(self.raw, &raw const clock, 1, &raw mut interval, &raw mut qualifier) };
        self.check(status, "GetIntervalDecimal")?;
        match qualifier {
            // Not yet known, unchanged.
            0 | 1 => Ok(None),
            2 if interval >= 0.0 && interval.is_finite() => Ok(Some(interval)),
            2 => {
                let fact = format!("a clock of the unit has the interval {interval} s");
                Err(failure(fact, "contact the vendor of the unit"))
            }
            other => {
                let fact = format!(
                    "the interval of a clock of the unit has the qualifier {other}, not 0, 1 or 2"
                );
                Err(failure(fact, "contact the vendor of the unit"))
            }
        }
    }

    /// Reports a completed step of the integrator to the unit. Returns `true` if the unit requests an event.
    pub fn completed_step(&mut self) -> Result<bool> {
        let unit = self.unit.clone();
        let (event, end) = match &unit.functions {
            Functions::V2(f) => {
                let call = there(f.completed_step, "fmi2CompletedIntegratorStep")?;
                let (mut event, mut end) = (0, 0);
                // SAFETY: room for two answers. The first flag is false, because the simulation may
                // restore an earlier state.
                let status = unsafe { call(self.raw, 0, &mut event, &mut end) };
                self.check(status, "CompletedIntegratorStep")?;
                (event != 0, end != 0)
            }
            Functions::V3(f) => {
                let call = there(f.completed_step, "fmi3CompletedIntegratorStep")?;
                let (mut event, mut end) = (0, 0);
                // SAFETY: as above.
                let status = unsafe { call(self.raw, false, &mut event, &mut end) };
                self.check(status, "CompletedIntegratorStep")?;
                (event != 0, end != 0)
            }
        };
        if end { Err(ended(&self.log)) } else { Ok(event) }
    }

    /// Returns the whole state of the unit, as bytes.
    pub fn save(&mut self) -> Result<Vec<u8>> {
        let mut state: Raw = null_mut();
        both!(self, f, get_state, "GetFMUstate" | "GetFMUState", &raw mut state)?;
        let read = self.serialized(state);
        let freed = both!(self, f, free_state, "FreeFMUstate" | "FreeFMUState", &raw mut state);
        let bytes = read?;
        freed.map(|()| bytes)
    }

    fn serialized(&mut self, state: Raw) -> Result<Vec<u8>> {
        let mut size = 0usize;
        both!(
            self,
            f,
            state_size,
            "SerializedFMUstateSize" | "SerializedFMUStateSize",
            state,
            &raw mut size
        )?;
        if size > STATE_MAX {
            return Err(failure(
                format!("its state has {size} bytes, but the limit is 1 GiB"),
                ASK,
            ));
        }
        self.bytes.clear();
        self.bytes.resize(size, 0);
        let into = self.bytes.as_mut_ptr();
        both!(self, f, serialize, "SerializeFMUstate" | "SerializeFMUState", state, into, size)?;
        Ok(std::mem::take(&mut self.bytes))
    }

    /// Restores a state.
    pub fn load(&mut self, bytes: &[u8]) -> Result<()> {
        let mut state: Raw = null_mut();
        let (from, size) = (bytes.as_ptr(), bytes.len());
        both!(
            self,
            f,
            deserialize,
            "DeSerializeFMUstate" | "DeserializeFMUState",
            from,
            size,
            &raw mut state
        )?;
        let set = both!(self, f, set_state, "SetFMUstate" | "SetFMUState", state);
        let freed = both!(self, f, free_state, "FreeFMUstate" | "FreeFMUState", &raw mut state);
        set.and(freed)
    }
}

fn ended(log: &Log) -> Box<Failure> {
    failure(
        format!("the unit requests the end of the simulation{}", log.take()),
        "end the run before this time (`until`), or check the messages of the unit",
    )
}

fn not_numeric(slot: &Slot) -> Box<Failure> {
    failure(format!("variable `{}` is not a number", slot.name), "use another variable")
}

fn not_whole(slot: &Slot, value: f64, ty: &str) -> Box<Failure> {
    failure(
        format!("variable `{}` requires an integer ({ty}), but the value is {value}", slot.name),
        "connect it to integers within the range",
    )
}

impl Drop for Instance {
    fn drop(&mut self) {
        if self.stage != Stage::Dead {
            let (terminate, free): (
                unsafe extern "C" fn(Raw) -> Status,
                unsafe extern "C" fn(Raw),
            ) = match &self.unit.functions {
                Functions::V2(f) => (f.terminate, f.free_instance),
                Functions::V3(f) => (f.terminate, f.free_instance),
            };
            let mut fatal = false;
            if self.stage == Stage::Initialized {
                // SAFETY: a living instance that was initialized and did not fail.
                fatal = unsafe { terminate(self.raw) } >= 4;
            }
            if !fatal {
                // SAFETY: the last call to this instance.
                unsafe { free(self.raw) };
            }
        }
        self.unit.release();
        debug_assert!(matches!(self.kind, Kind::CoSimulation | Kind::ModelExchange));
    }
}
