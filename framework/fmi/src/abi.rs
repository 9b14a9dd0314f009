//! The C interface of FMI 2.0 and 3.0: function tables of shared libraries.
//!
//! Follows the headers `fmi2Functions.h` (2.0.4) and `fmi3Functions.h` (3.0.2), and contains only functions that are called here. A C `bool` that
//! foreign code writes is read as a byte, because a byte other than 0 and 1 would not be a valid Rust `bool`.
use crate::Refusal;
use libloading::Library;
use std::ffi::{c_char, c_int, c_void};

/// An instance.
pub(crate) type Raw = *mut c_void;
/// A status of 2.0 and 3.0: 0 OK, 1 warning, 2 discard, 3 error, 4 fatal, 5 pending (2.0).
pub(crate) type Status = c_int;

/// Signature of the logger of FMI 2.0. Its variadic arguments are never read.
pub(crate) type Logger2 =
    unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char);
/// The logger of 3.0.
pub(crate) type Logger3 = unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char);

/// `fmi2CallbackFunctions`.
#[repr(C)]
pub(crate) struct Callbacks2 {
    pub logger: Logger2,
    pub allocate: unsafe extern "C" fn(usize, usize) -> *mut c_void,
    pub free: unsafe extern "C" fn(*mut c_void),
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, c_int)>,
    pub environment: *mut c_void,
}

/// `fmi2EventInfo`.
#[repr(C)]
#[derive(Default)]
pub(crate) struct EventInfo2 {
    pub needed: c_int,
    pub terminate: c_int,
    pub nominals_changed: c_int,
    pub values_changed: c_int,
    pub next_defined: c_int,
    pub next: f64,
}

unsafe extern "C" {
    /// Memory for units of 2.0, which require C's allocator.
    pub(crate) fn calloc(count: usize, size: usize) -> *mut c_void;
    /// Its release.
    pub(crate) fn free(block: *mut c_void);
}

/// A table of functions, filled from a library. Functions in the second group may be missing, because they belong to the other interface or to an
/// optional capability.
macro_rules! table {
    ($(#[$doc:meta])* $name:ident, $prefix:literal,
     { $($field:ident = $symbol:literal : $ty:ty),* $(,)? },
     { $($may:ident = $may_symbol:literal : $may_ty:ty),* $(,)? }) => {
        $(#[$doc])*
        #[allow(non_snake_case)]
        pub(crate) struct $name { $(pub $field: $ty,)* $(pub $may: Option<$may_ty>),* }

        impl $name {
            /// Loads the functions.
            pub fn of(library: &Library, file: &str) -> Result<Self, Refusal> {
                $(
                    // SAFETY: the header defines this type for a function with this name; a library with another
                    // function under this name is not an FMU.
                    let $field = unsafe { library.get::<$ty>(concat!($prefix, $symbol, "\0").as_bytes()) };
                    let $field = *$field.map_err(|_| missing(file, concat!($prefix, $symbol)))?;
                )*
                $(
                    // SAFETY: as above.
                    let $may = unsafe { library.get::<$may_ty>(concat!($prefix, $may_symbol, "\0").as_bytes()) };
                    let $may = $may.ok().map(|f| *f);
                )*
                Ok($name { $($field,)* $($may),* })
            }
        }
    };
}

fn missing(file: &str, symbol: &str) -> Refusal {
    Refusal::new(format!("the shared library of `{file}` lacks the function `{symbol}`"))
        .help("the library does not match the interface in its description: export the unit again")
}

type Get<T> = unsafe extern "C" fn(Raw, *const u32, usize, *mut T) -> Status;
type Set<T> = unsafe extern "C" fn(Raw, *const u32, usize, *const T) -> Status;
type Plain = unsafe extern "C" fn(Raw) -> Status;
type Read = unsafe extern "C" fn(Raw, *mut f64, usize) -> Status;

table!(
    /// Functions of 2.0.
    Fmi2, "fmi2",
    {
        instantiate = "Instantiate": unsafe extern "C" fn(
            *const c_char, c_int, *const c_char, *const c_char, *const Callbacks2, c_int, c_int) -> Raw,
        free_instance = "FreeInstance": unsafe extern "C" fn(Raw),
        setup = "SetupExperiment": unsafe extern "C" fn(Raw, c_int, f64, f64, c_int, f64) -> Status,
        enter_initialization = "EnterInitializationMode": Plain,
        exit_initialization = "ExitInitializationMode": Plain,
        terminate = "Terminate": Plain,
        get_real = "GetReal": Get<f64>,
        get_integer = "GetInteger": Get<c_int>,
        get_boolean = "GetBoolean": Get<c_int>,
        set_real = "SetReal": Set<f64>,
        set_integer = "SetInteger": Set<c_int>,
        set_boolean = "SetBoolean": Set<c_int>,
        set_string = "SetString": Set<*const c_char>,
    },
    {
        get_state = "GetFMUstate": unsafe extern "C" fn(Raw, *mut Raw) -> Status,
        set_state = "SetFMUstate": unsafe extern "C" fn(Raw, Raw) -> Status,
        free_state = "FreeFMUstate": unsafe extern "C" fn(Raw, *mut Raw) -> Status,
        state_size = "SerializedFMUstateSize": unsafe extern "C" fn(Raw, Raw, *mut usize) -> Status,
        serialize = "SerializeFMUstate": unsafe extern "C" fn(Raw, Raw, *mut u8, usize) -> Status,
        deserialize = "DeSerializeFMUstate":
            unsafe extern "C" fn(Raw, *const u8, usize, *mut Raw) -> Status,
        do_step = "DoStep": unsafe extern "C" fn(Raw, f64, f64, c_int) -> Status,
        enter_event = "EnterEventMode": Plain,
        discrete_states = "NewDiscreteStates": unsafe extern "C" fn(Raw, *mut EventInfo2) -> Status,
        enter_continuous = "EnterContinuousTimeMode": Plain,
        completed_step = "CompletedIntegratorStep":
            unsafe extern "C" fn(Raw, c_int, *mut c_int, *mut c_int) -> Status,
        set_time = "SetTime": unsafe extern "C" fn(Raw, f64) -> Status,
        set_states = "SetContinuousStates": unsafe extern "C" fn(Raw, *const f64, usize) -> Status,
        get_derivatives = "GetDerivatives": Read,
        get_indicators = "GetEventIndicators": Read,
        get_states = "GetContinuousStates": Read,
    }
);

type Get3<T> = unsafe extern "C" fn(Raw, *const u32, usize, *mut T, usize) -> Status;
type Set3<T> = unsafe extern "C" fn(Raw, *const u32, usize, *const T, usize) -> Status;

table!(
    /// Functions of 3.0.
    Fmi3, "fmi3",
    {
        free_instance = "FreeInstance": unsafe extern "C" fn(Raw),
        enter_initialization = "EnterInitializationMode":
            unsafe extern "C" fn(Raw, bool, f64, f64, bool, f64) -> Status,
        exit_initialization = "ExitInitializationMode": Plain,
        terminate = "Terminate": Plain,
        get_float64 = "GetFloat64": Get3<f64>,
        set_float64 = "SetFloat64": Set3<f64>,
    },
    {
        instantiate_cs = "InstantiateCoSimulation": unsafe extern "C" fn(
            *const c_char, *const c_char, *const c_char, bool, bool, bool, bool, *const u32, usize,
            *mut c_void, Logger3, *const c_void) -> Raw,
        instantiate_me = "InstantiateModelExchange": unsafe extern "C" fn(
            *const c_char, *const c_char, *const c_char, bool, bool, *mut c_void, Logger3) -> Raw,
        get_float32 = "GetFloat32": Get3<f32>,
        get_int8 = "GetInt8": Get3<i8>,
        get_uint8 = "GetUInt8": Get3<u8>,
        get_int16 = "GetInt16": Get3<i16>,
        get_uint16 = "GetUInt16": Get3<u16>,
        get_int32 = "GetInt32": Get3<i32>,
        get_uint32 = "GetUInt32": Get3<u32>,
        get_int64 = "GetInt64": Get3<i64>,
        get_uint64 = "GetUInt64": Get3<u64>,
        get_boolean = "GetBoolean": Get3<u8>,
        set_float32 = "SetFloat32": Set3<f32>,
        set_int8 = "SetInt8": Set3<i8>,
        set_uint8 = "SetUInt8": Set3<u8>,
        set_int16 = "SetInt16": Set3<i16>,
        set_uint16 = "SetUInt16": Set3<u16>,
        set_int32 = "SetInt32": Set3<i32>,
        set_uint32 = "SetUInt32": Set3<u32>,
        set_int64 = "SetInt64": Set3<i64>,
        set_uint64 = "SetUInt64": Set3<u64>,
        set_boolean = "SetBoolean": Set3<u8>,
        set_string = "SetString": Set3<*const c_char>,
        get_clock = "GetClock": unsafe extern "C" fn(Raw, *const u32, usize, *mut u8) -> Status,
        set_clock = "SetClock": unsafe extern "C" fn(Raw, *const u32, usize, *const bool) -> Status,
        get_interval = "GetIntervalDecimal":
            unsafe extern "C" fn(Raw, *const u32, usize, *mut f64, *mut c_int) -> Status,
        get_state = "GetFMUState": unsafe extern "C" fn(Raw, *mut Raw) -> Status,
        set_state = "SetFMUState": unsafe extern "C" fn(Raw, Raw) -> Status,
        free_state = "FreeFMUState": unsafe extern "C" fn(Raw, *mut Raw) -> Status,
        state_size = "SerializedFMUStateSize": unsafe extern "C" fn(Raw, Raw, *mut usize) -> Status,
        serialize = "SerializeFMUState": unsafe extern "C" fn(Raw, Raw, *mut u8, usize) -> Status,
        deserialize = "DeserializeFMUState":
            unsafe extern "C" fn(Raw, *const u8, usize, *mut Raw) -> Status,
        do_step = "DoStep": unsafe extern "C" fn(
            Raw, f64, f64, bool, *mut u8, *mut u8, *mut u8, *mut f64) -> Status,
        enter_event = "EnterEventMode": Plain,
        enter_step = "EnterStepMode": Plain,
        discrete_states = "UpdateDiscreteStates": unsafe extern "C" fn(
            Raw, *mut u8, *mut u8, *mut u8, *mut u8, *mut u8, *mut f64) -> Status,
        enter_continuous = "EnterContinuousTimeMode": Plain,
        completed_step = "CompletedIntegratorStep":
            unsafe extern "C" fn(Raw, bool, *mut u8, *mut u8) -> Status,
        set_time = "SetTime": unsafe extern "C" fn(Raw, f64) -> Status,
        set_states = "SetContinuousStates": unsafe extern "C" fn(Raw, *const f64, usize) -> Status,
        get_derivatives = "GetContinuousStateDerivatives": Read,
        get_indicators = "GetEventIndicators": Read,
        get_states = "GetContinuousStates": Read,
    }
);
