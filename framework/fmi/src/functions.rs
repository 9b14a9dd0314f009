//! The C functions of an exported unit, as a macro, so that only the shared library that uses it exports these symbols.
/// Turns a library crate (`crate-type = ["cdylib"]`) into the shared library of exported units: all functions of FMI 3.0, with the models and
/// assemblies that `$library` (`fn() -> Library`) returns.
#[macro_export]
macro_rules! export_unit {
    ($library:path) => {
        mod fmi3 {
            #![allow(non_snake_case, missing_docs, clippy::missing_safety_doc)]
            use std::ffi::{c_char, c_int, c_void};
            use $crate::provide as p;

            #[unsafe(no_mangle)]
            pub extern "C" fn fmi3GetVersion() -> *const c_char {
                c"3.0".as_ptr()
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3InstantiateCoSimulation(
                _name: *const c_char,
                token: *const c_char,
                resources: *const c_char,
                _visible: bool,
                _logging: bool,
                _event_mode: bool,
                _early_return: bool,
                _required: *const u32,
                _n: usize,
                environment: *mut c_void,
                logger: p::Logger,
                _intermediate: *const c_void,
            ) -> *mut c_void {
                unsafe { p::instantiate(token, resources, environment, logger, $library) }
            }
            #[unsafe(no_mangle)]
            pub extern "C" fn fmi3InstantiateModelExchange() -> *mut c_void {
                std::ptr::null_mut()
            }
            #[unsafe(no_mangle)]
            pub extern "C" fn fmi3InstantiateScheduledExecution() -> *mut c_void {
                std::ptr::null_mut()
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3FreeInstance(i: *mut c_void) {
                unsafe { p::free_instance(i) }
            }
            #[unsafe(no_mangle)]
            pub extern "C" fn fmi3SetDebugLogging(_: *mut c_void) -> c_int {
                // Only errors are logged, and they always are.
                0
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3EnterInitializationMode(
                i: *mut c_void,
                _tolerance_defined: bool,
                _tolerance: f64,
                start: f64,
                _stop_defined: bool,
                _stop: f64,
            ) -> c_int {
                unsafe { p::enter_initialization(i, start) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3ExitInitializationMode(i: *mut c_void) -> c_int {
                unsafe { p::exit_initialization(i) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3Terminate(i: *mut c_void) -> c_int {
                unsafe { p::terminate(i) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3Reset(i: *mut c_void) -> c_int {
                unsafe { p::reset(i) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3GetFloat64(
                i: *mut c_void,
                r: *const u32,
                n: usize,
                v: *mut f64,
                room: usize,
            ) -> c_int {
                unsafe { p::get(i, (r, n), (v, room), false, |x| x) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3SetFloat64(
                i: *mut c_void,
                r: *const u32,
                n: usize,
                v: *const f64,
                given: usize,
            ) -> c_int {
                unsafe { p::set(i, (r, n), (v, given), false, |x| x) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3GetBoolean(
                i: *mut c_void,
                r: *const u32,
                n: usize,
                v: *mut u8,
                room: usize,
            ) -> c_int {
                unsafe { p::get(i, (r, n), (v, room), true, |x| u8::from(x > 0.5)) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3SetBoolean(
                i: *mut c_void,
                r: *const u32,
                n: usize,
                v: *const u8,
                given: usize,
            ) -> c_int {
                unsafe { p::set(i, (r, n), (v, given), true, |x| f64::from(u8::from(x != 0))) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3DoStep(
                i: *mut c_void,
                t: f64,
                h: f64,
                _no_set_prior: bool,
                event: *mut u8,
                end: *mut u8,
                early: *mut u8,
                reached: *mut f64,
            ) -> c_int {
                unsafe { p::do_step(i, (t, h), [event, end, early], reached) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3GetFMUState(i: *mut c_void, s: *mut *mut c_void) -> c_int {
                unsafe { p::get_state(i, s) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3SetFMUState(i: *mut c_void, s: *mut c_void) -> c_int {
                unsafe { p::set_state(i, s) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3FreeFMUState(
                i: *mut c_void,
                s: *mut *mut c_void,
            ) -> c_int {
                unsafe { p::free_state(i, s) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3SerializedFMUStateSize(
                i: *mut c_void,
                s: *mut c_void,
                size: *mut usize,
            ) -> c_int {
                unsafe { p::state_size(i, s, size) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3SerializeFMUState(
                i: *mut c_void,
                s: *mut c_void,
                into: *mut u8,
                room: usize,
            ) -> c_int {
                unsafe { p::serialize(i, s, into, room) }
            }
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn fmi3DeserializeFMUState(
                i: *mut c_void,
                from: *const u8,
                size: usize,
                s: *mut *mut c_void,
            ) -> c_int {
                unsafe { p::deserialize(i, from, size, s) }
            }
            $crate::unused_functions! {
                fmi3EnterEventMode fmi3EnterConfigurationMode fmi3ExitConfigurationMode
                fmi3EnterStepMode fmi3EvaluateDiscreteStates fmi3UpdateDiscreteStates
                fmi3EnterContinuousTimeMode fmi3CompletedIntegratorStep fmi3SetTime
                fmi3SetContinuousStates fmi3GetContinuousStateDerivatives fmi3GetEventIndicators
                fmi3GetContinuousStates fmi3GetNominalsOfContinuousStates
                fmi3GetNumberOfEventIndicators fmi3GetNumberOfContinuousStates
                fmi3GetNumberOfVariableDependencies fmi3GetVariableDependencies
                fmi3GetDirectionalDerivative fmi3GetAdjointDerivative fmi3GetOutputDerivatives
                fmi3ActivateModelPartition
                fmi3GetFloat32 fmi3GetInt8 fmi3GetUInt8 fmi3GetInt16 fmi3GetUInt16 fmi3GetInt32
                fmi3GetUInt32 fmi3GetInt64 fmi3GetUInt64 fmi3GetString fmi3GetBinary fmi3GetClock
                fmi3SetFloat32 fmi3SetInt8 fmi3SetUInt8 fmi3SetInt16 fmi3SetUInt16 fmi3SetInt32
                fmi3SetUInt32 fmi3SetInt64 fmi3SetUInt64 fmi3SetString fmi3SetBinary fmi3SetClock
                fmi3GetIntervalDecimal fmi3GetIntervalFraction fmi3GetShiftDecimal
                fmi3GetShiftFraction fmi3SetIntervalDecimal fmi3SetIntervalFraction
                fmi3SetShiftDecimal fmi3SetShiftFraction
            }
        }
    };
}

/// Functions that are not supported and return an error. They use only the instance and ignore further arguments. This is sound where the caller
/// removes the arguments, as in the C calling conventions of all supported platforms.
#[doc(hidden)]
#[macro_export]
macro_rules! unused_functions {
    ($($name:ident)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(i: *mut c_void) -> c_int {
            unsafe { p::unused(i, stringify!($name)) }
        }
    )*};
}
