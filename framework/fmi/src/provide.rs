//! A simulation as a co-simulation unit of FMI 3.0: the implementation of the C functions that [`export_unit`](crate::export_unit) defines.
//!
//! ```text
//! resources/simulation.ron   the whole configuration    → the simulation
//! resources/unit.txt         token, hash, variables     → value references: 0 time, k the k-th variable
//! fmi3DoStep(t, h)           inputs → run to the tick at t + h, which must be a multiple of the step
//! fmi3GetFMUState            a checkpoint
//! ```
//! An input acts from the instant at which it is set, as in a run from Rust or Python. Every function catches panics, so that they do not unwind into
//! the importer.
use linkwork_runner::Library;
use linkwork_runtime::{Checkpoint, Place, Program, Seconds, Simulation};
use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Status of FMI 3.0.
const OK: c_int = 0;
const ERROR: c_int = 3;

/// A logger of the importer.
pub type Logger = Option<unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char)>;

/// A variable of the unit.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct UnitVariable {
    pub path: String,
    pub input: bool,
    pub boolean: bool,
}

/// `resources/unit.txt`: data that connect description, configuration and library.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Contents {
    pub token: String,
    pub hash: u64,
    pub variables: Vec<UnitVariable>,
}

impl Contents {
    pub fn to_text(&self) -> String {
        let mut out = format!("{}\n{:016x}\n", self.token, self.hash);
        for v in &self.variables {
            let role = if v.input { "input" } else { "output" };
            let kind = if v.boolean { "boolean" } else { "number" };
            out += &format!("{role} {kind} {}\n", v.path);
        }
        out
    }

    pub fn of_text(text: &str) -> Option<Contents> {
        let mut lines = text.lines();
        let token = lines.next()?.to_string();
        let hash = u64::from_str_radix(lines.next()?, 16).ok()?;
        let variables = lines.map(|line| {
            let mut words = line.splitn(3, ' ');
            let input = words.next()? == "input";
            let boolean = words.next()? == "boolean";
            Some(UnitVariable { path: words.next()?.to_string(), input, boolean })
        });
        Some(Contents { token, hash, variables: variables.collect::<Option<_>>()? })
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Instantiated,
    Initializing,
    Stepping,
    Over,
}

/// An instance of an exported unit.
pub struct Provided {
    program: Arc<Program>,
    sim: Simulation,
    contents: Contents,
    places: Vec<Place>,
    step: Seconds,
    /// Time of the importer at which the simulation began (s).
    start: f64,
    stage: Stage,
    environment: *mut c_void,
    logger: Logger,
}

type Answer<T> = Result<T, String>;

/// Passes an error message to the importer.
fn tell(logger: Logger, environment: *mut c_void, message: &str) {
    let text = CString::new(message.replace('\0', " ")).unwrap_or_default();
    if let Some(log) = logger {
        // SAFETY: the importer's own function and environment; both strings live during the call.
        unsafe { log(environment, ERROR, c"logStatusError".as_ptr(), text.as_ptr()) };
    }
}

fn open(folder: &Path, token: &str, library: fn() -> Library) -> Answer<(Arc<Program>, Contents)> {
    let read = |name: &str| {
        let path = folder.join(name);
        std::fs::read_to_string(&path).map_err(|e| format!("`{}`: {e}", path.display()))
    };
    let contents = Contents::of_text(&read("unit.txt")?)
        .ok_or("resources/unit.txt is corrupt: export the unit again")?;
    if contents.token != token {
        return Err("the instantiation token belongs to another unit: export the unit again".into());
    }
    let text = read("simulation.ron")?;
    let ready = library().text("simulation.ron", &text).map_err(|f| f.render(false))?;
    if ready.program.hash() != contents.hash {
        return Err(
            "the unit's library compiles its configuration to a different plan than the program \
                    that exported it: build both from the same version, and export again"
                .into(),
        );
    }
    Ok((Arc::new(ready.program), contents))
}

impl Provided {
    fn new(
        folder: &Path,
        token: &str,
        library: fn() -> Library,
        (environment, logger): (*mut c_void, Logger),
    ) -> Answer<Provided> {
        let (program, contents) = open(folder, token, library)?;
        let sim = Simulation::of(program.clone());
        let place =
            |v: &UnitVariable| sim.variable(&v.path).map(|v| v.place).map_err(|e| e.to_string());
        let places = contents.variables.iter().map(place).collect::<Answer<_>>()?;
        let step = sim.plan().step;
        let (start, stage) = (0.0, Stage::Instantiated);
        Ok(Provided { program, sim, contents, places, step, start, stage, environment, logger })
    }

    fn time(&self) -> f64 {
        self.start + self.sim.time()
    }

    fn variable(&self, reference: u32, boolean: bool) -> Answer<usize> {
        let k = (reference as usize).wrapping_sub(1);
        match self.contents.variables.get(k) {
            Some(v) if v.boolean == boolean => Ok(k),
            _ => Err(format!(
                "there is no variable of this type with the value reference {reference}"
            )),
        }
    }

    fn value(&self, reference: u32, boolean: bool) -> Answer<f64> {
        if reference == 0 && !boolean {
            return Ok(self.time());
        }
        Ok(self.sim.value(self.places[self.variable(reference, boolean)?]))
    }

    fn set(&mut self, reference: u32, boolean: bool, value: f64) -> Answer<()> {
        if self.stage == Stage::Over {
            return Err("variables cannot be set after the end of the run".into());
        }
        let k = self.variable(reference, boolean)?;
        let v = &self.contents.variables[k];
        if !v.input {
            return Err(format!("`{}` is an output: it cannot be set", v.path));
        }
        self.sim.set(&v.path, value).map_err(|e| e.to_string())
    }

    fn begin(&mut self, start: f64) -> Answer<()> {
        if self.stage != Stage::Instantiated {
            return Err("initialization is only allowed once, after instantiation or reset".into());
        }
        if !start.is_finite() {
            return Err(format!("the start time is {start}"));
        }
        (self.start, self.stage) = (start, Stage::Initializing);
        Ok(())
    }

    fn begun(&mut self) -> Answer<()> {
        if self.stage != Stage::Initializing {
            return Err("initialization mode was not entered".into());
        }
        self.sim.check().map_err(|e| e.to_string())?;
        self.stage = Stage::Stepping;
        Ok(())
    }

    fn step(&mut self, t: f64, h: f64) -> Answer<()> {
        if self.stage != Stage::Stepping {
            return Err("a step is only allowed after initialization and before the end".into());
        }
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * (1.0 + a.abs());
        if !near(t, self.time()) {
            return Err(format!("the step begins at {t} s, but the unit is at {} s", self.time()));
        }
        let steps = (t + h - self.start) / self.step.seconds();
        let whole = steps.round();
        if !(h > 0.0 && (steps - whole).abs() <= 1e-6 && whole < 9e15) {
            return Err(format!(
                "the communication step is {h} s at {t} s: use multiples of the simulation's step, {} s",
                self.step.seconds()
            ));
        }
        let target =
            Seconds::new(u128::from(self.step.num) * whole as u128, u128::from(self.step.den))
                .ok_or("the time is too large")?;
        if let Err(e) = self.sim.run_until(target) {
            self.stage = Stage::Over;
            return Err(e.to_string());
        }
        if !near(self.time(), t + h) {
            return Err(format!(
                "there is no tick at {} s: the next one is at {} s",
                t + h,
                self.time()
            ));
        }
        Ok(())
    }

    fn reset(&mut self) {
        self.sim = Simulation::of(self.program.clone());
        (self.start, self.stage) = (0.0, Stage::Instantiated);
    }

    fn state(&self) -> Answer<SavedState> {
        let checkpoint = self.sim.checkpoint("").map_err(|e| e.to_string())?;
        Ok(SavedState { checkpoint, start: self.start, stepping: self.stage == Stage::Stepping })
    }

    fn restore(&mut self, kept: &SavedState) -> Answer<()> {
        self.sim.restore(&kept.checkpoint).map_err(|e| e.to_string())?;
        self.start = kept.start;
        self.stage = if kept.stepping { Stage::Stepping } else { Stage::Initializing };
        Ok(())
    }
}

/// A saved state.
#[derive(serde::Serialize, serde::Deserialize)]
struct SavedState {
    checkpoint: Checkpoint,
    start: f64,
    stepping: bool,
}

/// Calls `f` with an instance; errors and panics are reported to the importer.
///
/// # Safety
/// `instance` is a result of [`instantiate`], or null.
unsafe fn on(instance: *mut c_void, f: impl FnOnce(&mut Provided) -> Answer<()>) -> c_int {
    // SAFETY: by the contract.
    let Some(unit) = (unsafe { instance.cast::<Provided>().as_mut() }) else { return ERROR };
    let (logger, environment) = (unit.logger, unit.environment);
    match catch_unwind(AssertUnwindSafe(|| f(unit))) {
        Ok(Ok(())) => OK,
        Ok(Err(message)) => {
            tell(logger, environment, &message);
            ERROR
        }
        Err(_) => {
            unit.stage = Stage::Over;
            tell(logger, environment, "the unit panicked: this is a bug of Linkwork");
            ERROR
        }
    }
}

/// Returns the text at a pointer.
///
/// # Safety
/// Null, or a C string.
unsafe fn text(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: by the contract.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

/// `fmi3InstantiateCoSimulation`.
///
/// # Safety
/// Strings are C strings; `logger` may be called with `environment` until the instance is freed.
pub unsafe fn instantiate(
    token: *const c_char,
    resources: *const c_char,
    environment: *mut c_void,
    logger: Logger,
    library: fn() -> Library,
) -> *mut c_void {
    // SAFETY: by the contract.
    let (token, folder) = unsafe { (text(token), PathBuf::from(text(resources))) };
    let made = catch_unwind(|| Provided::new(&folder, &token, library, (environment, logger)));
    match made {
        Ok(Ok(unit)) => Box::into_raw(Box::new(unit)).cast(),
        Ok(Err(message)) => {
            tell(logger, environment, &message);
            std::ptr::null_mut()
        }
        Err(_) => {
            tell(logger, environment, "the unit panicked: this is a bug of Linkwork");
            std::ptr::null_mut()
        }
    }
}

/// `fmi3FreeInstance`.
///
/// # Safety
/// `instance` is one of [`instantiate`] that was not freed, or null.
pub unsafe fn free_instance(instance: *mut c_void) {
    if !instance.is_null() {
        // SAFETY: by the contract. A panic while dropping must not unwind into C.
        let dropped = catch_unwind(AssertUnwindSafe(|| unsafe {
            drop(Box::from_raw(instance.cast::<Provided>()));
        }));
        // A panic cannot be reported, because the importer no longer receives messages.
        let _ = dropped.is_err();
    }
}

/// `fmi3EnterInitializationMode`.
///
/// # Safety
/// `instance` is one of [`instantiate`].
pub unsafe fn enter_initialization(instance: *mut c_void, start: f64) -> c_int {
    // SAFETY: by the contract.
    unsafe { on(instance, |unit| unit.begin(start)) }
}

/// `fmi3ExitInitializationMode`.
///
/// # Safety
/// `instance` is one of [`instantiate`].
pub unsafe fn exit_initialization(instance: *mut c_void) -> c_int {
    // SAFETY: by the contract.
    unsafe { on(instance, Provided::begun) }
}

/// `fmi3Terminate`.
///
/// # Safety
/// `instance` is one of [`instantiate`].
pub unsafe fn terminate(instance: *mut c_void) -> c_int {
    // SAFETY: by the contract.
    unsafe {
        on(instance, |unit| {
            unit.stage = Stage::Over;
            Ok(())
        })
    }
}

/// `fmi3Reset`.
///
/// # Safety
/// `instance` is one of [`instantiate`].
pub unsafe fn reset(instance: *mut c_void) -> c_int {
    // SAFETY: by the contract.
    unsafe {
        on(instance, |unit| {
            unit.reset();
            Ok(())
        })
    }
}

/// `fmi3GetFloat64` and `fmi3GetBoolean`: scalars only.
///
/// # Safety
/// `instance` is one of [`instantiate`]; the pointers have room for what the counts say.
pub unsafe fn get<T>(
    instance: *mut c_void,
    (references, n): (*const u32, usize),
    (values, room): (*mut T, usize),
    boolean: bool,
    convert: fn(f64) -> T,
) -> c_int {
    // SAFETY: by the contract; one element at a time, so that an empty list may be null.
    unsafe {
        on(instance, |unit| {
            if n != room {
                return Err(format!("{n} variables, but memory for {room} values"));
            }
            for k in 0..n {
                let value = unit.value(*references.add(k), boolean)?;
                values.add(k).write(convert(value));
            }
            Ok(())
        })
    }
}

/// `fmi3SetFloat64` and `fmi3SetBoolean`: scalars only.
///
/// # Safety
/// As [`get`].
pub unsafe fn set<T: Copy>(
    instance: *mut c_void,
    (references, n): (*const u32, usize),
    (values, given): (*const T, usize),
    boolean: bool,
    convert: fn(T) -> f64,
) -> c_int {
    // SAFETY: by the contract.
    unsafe {
        on(instance, |unit| {
            if n != given {
                return Err(format!("{n} variables, but {given} values"));
            }
            for k in 0..n {
                unit.set(*references.add(k), boolean, convert(*values.add(k)))?;
            }
            Ok(())
        })
    }
}

/// `fmi3DoStep`.
///
/// # Safety
/// `instance` is one of [`instantiate`]; the pointers have room for one value each, or are null.
pub unsafe fn do_step(
    instance: *mut c_void,
    (t, h): (f64, f64),
    flags: [*mut u8; 3],
    reached: *mut f64,
) -> c_int {
    // SAFETY: by the contract.
    unsafe {
        for flag in flags.into_iter().filter(|f| !f.is_null()) {
            flag.write(0);
        }
        let mut time = t;
        let status = on(instance, |unit| {
            let done = unit.step(t, h);
            time = unit.time();
            done
        });
        if !reached.is_null() {
            reached.write(time);
        }
        status
    }
}

/// `fmi3GetFMUState`.
///
/// # Safety
/// `instance` is one of [`instantiate`]; `state` points to null or to a state of this function.
pub unsafe fn get_state(instance: *mut c_void, state: *mut *mut c_void) -> c_int {
    // SAFETY: by the contract.
    unsafe {
        on(instance, |unit| {
            let kept = Box::new(unit.state()?);
            if !(*state).is_null() {
                drop(Box::from_raw((*state).cast::<SavedState>()));
            }
            *state = Box::into_raw(kept).cast();
            Ok(())
        })
    }
}

/// `fmi3SetFMUState`.
///
/// # Safety
/// `state` is one of [`get_state`] or [`deserialize`].
pub unsafe fn set_state(instance: *mut c_void, state: *mut c_void) -> c_int {
    // SAFETY: by the contract.
    unsafe {
        on(instance, |unit| match state.cast::<SavedState>().as_ref() {
            Some(kept) => unit.restore(kept),
            None => Err("the state is null".into()),
        })
    }
}

/// `fmi3FreeFMUState`.
///
/// # Safety
/// `state` points to null or to a state of this unit.
pub unsafe fn free_state(instance: *mut c_void, state: *mut *mut c_void) -> c_int {
    // SAFETY: by the contract.
    unsafe {
        on(instance, |_| {
            if !state.is_null() && !(*state).is_null() {
                drop(Box::from_raw((*state).cast::<SavedState>()));
                *state = std::ptr::null_mut();
            }
            Ok(())
        })
    }
}

/// Returns a state as bytes.
///
/// # Safety
/// `state` is one of this unit, or null.
unsafe fn bytes(state: *mut c_void) -> Answer<Vec<u8>> {
    // SAFETY: by the contract.
    let kept = unsafe { state.cast::<SavedState>().as_ref() }.ok_or("the state is null")?;
    rmp_serde::to_vec_named(kept).map_err(|e| e.to_string())
}

/// `fmi3SerializedFMUStateSize`.
///
/// # Safety
/// `state` is one of this unit; `size` has room for one number.
pub unsafe fn state_size(instance: *mut c_void, state: *mut c_void, size: *mut usize) -> c_int {
    // SAFETY: by the contract.
    unsafe {
        on(instance, |_| {
            size.write(bytes(state)?.len());
            Ok(())
        })
    }
}

/// `fmi3SerializeFMUState`.
///
/// # Safety
/// `state` is one of this unit; `into` has room for `room` bytes.
pub unsafe fn serialize(
    instance: *mut c_void,
    state: *mut c_void,
    into: *mut u8,
    room: usize,
) -> c_int {
    // SAFETY: by the contract; at most `room` bytes are written.
    unsafe {
        on(instance, |_| {
            let bytes = bytes(state)?;
            if bytes.len() > room {
                return Err(format!(
                    "there is memory for {room} bytes, but the state has {}",
                    bytes.len()
                ));
            }
            into.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
            Ok(())
        })
    }
}

/// `fmi3DeserializeFMUState`.
///
/// # Safety
/// `from` has `size` bytes; `state` has room for a pointer.
pub unsafe fn deserialize(
    instance: *mut c_void,
    from: *const u8,
    size: usize,
    state: *mut *mut c_void,
) -> c_int {
    // SAFETY: by the contract.
    unsafe {
        on(instance, |_| {
            let bytes: &[u8] = if size == 0 { &[] } else { std::slice::from_raw_parts(from, size) };
            let kept: SavedState = rmp_serde::from_slice(bytes)
                .map_err(|e| format!("these bytes are not a state of this unit: {e}"))?;
            state.write(Box::into_raw(Box::new(kept)).cast());
            Ok(())
        })
    }
}

/// Reports an error for functions of the standard that this unit does not support.
///
/// # Safety
/// `instance` is one of [`instantiate`].
pub unsafe fn unused(instance: *mut c_void, name: &str) -> c_int {
    // SAFETY: by the contract.
    unsafe { on(instance, |_| Err(format!("`{name}` is not supported by this unit"))) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn contents_come_back() {
        let shown = |path: &str, input, boolean| UnitVariable { path: path.into(), input, boolean };
        let contents = Contents {
            token: "{x}".into(),
            hash: 0xfe,
            variables: vec![shown("A.u v", true, false), shown("B.on", false, true)],
        };
        assert_eq!(Contents::of_text(&contents.to_text()).unwrap(), contents);
        assert_eq!(Contents::of_text("{x}\nzz\n"), None);
        assert_eq!(Contents::of_text("{x}\nff\ninput number\n"), None);
    }
}
