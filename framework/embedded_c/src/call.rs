//! The table of C functions. [`calls!`] declares them like Rust functions, with the documentation that the header shows:
//!
//! ```text
//! calls![
//!     /// Writes the pose of the tip of a chain in the world at the robot's q.
//!     fn lw_robot_tip_pose(r: &mut LwRobot, part: Part, out: Out<LwPose>) {
//!         out.set(r.robot.tip_pose(part)?.into());
//!     }
//! ];
//! ```
//! The first argument selects the handle: `&mut H` locks the data of the handle for the call, `&H` is for handles that threads share, and a function
//! without a handle returns only a code. The body may use `?` and unsafe functions of `edge`; the macro adds the lock, the message, the barrier for
//! panics and the code. A declaration with `;` instead of a body frees the handle.
//!
//! Each other argument has a kind, which defines its type in C and its check. Memory for results is checked before all other arguments.
//!
//! | kind | type in C | check |
//! |---|---|---|
//! | number, `*const T`, `*mut T` | the same | none; the body checks arrays with `edge::numbers` |
//! | `Out<T>` | `T *` | not NULL, aligned |
//! | `Option<Out<T>>` | `T *`, may be NULL | aligned |
//! | `&str` | `const char *` | not NULL, UTF-8 |
//! | `Part`, `Object`, `ColliderId` | `uint32_t` | index of the model |
//!
//! cbindgen does not expand macros, so `tests/support/table.rs` reads this table in the same way. A new kind needs a row there, too.

use crate::edge::{Out, text};
use crate::status::Fault;
use linkwork_embedded::{ColliderId, Object, Part};
use std::ffi::c_char;

/// Kind of argument in the table.
pub trait Kind {
    /// Type in C.
    type C;
}

/// Conversion of an argument from C, with data `X` of the handle.
pub(crate) trait Read<X>: Kind + Sized {
    /// Checks memory for results.
    fn reach(_: &'static str, _: &Self::C, _: &X) -> Result<(), Fault> {
        Ok(())
    }

    /// # Safety
    /// The conditions in the crate documentation apply.
    unsafe fn read(what: &'static str, c: Self::C, of: &X) -> Result<Self, Fault>;
}

macro_rules! as_in_c {
    ($($type:ty $(, $T:ident)?;)*) => {
        $(
            impl$(<$T>)? Kind for $type {
                type C = Self;
            }

            impl<X $(, $T)?> Read<X> for $type {
                unsafe fn read(_: &'static str, c: Self, _: &X) -> Result<Self, Fault> {
                    Ok(c)
                }
            }
        )*
    };
}
as_in_c! { u32; i64; usize; f64; *const T, T; *mut T, T; }

impl<T> Kind for Out<T> {
    type C = *mut T;
}

impl<T, X> Read<X> for Out<T> {
    fn reach(what: &'static str, c: &Self::C, _: &X) -> Result<(), Fault> {
        Out::new(what, *c).map(drop)
    }

    unsafe fn read(what: &'static str, c: Self::C, _: &X) -> Result<Self, Fault> {
        Out::new(what, c)
    }
}

impl<T> Kind for Option<Out<T>> {
    type C = *mut T;
}

impl<T, X> Read<X> for Option<Out<T>> {
    fn reach(what: &'static str, c: &Self::C, _: &X) -> Result<(), Fault> {
        if c.is_null() { Ok(()) } else { Out::new(what, *c).map(drop) }
    }

    unsafe fn read(what: &'static str, c: Self::C, _: &X) -> Result<Self, Fault> {
        if c.is_null() { Ok(None) } else { Out::new(what, c).map(Some) }
    }
}

impl Kind for &str {
    type C = *const c_char;
}

impl<X> Read<X> for &str {
    unsafe fn read(what: &'static str, c: Self::C, _: &X) -> Result<Self, Fault> {
        // SAFETY: guaranteed by the caller.
        unsafe { text(what, c) }
    }
}

impl Kind for Part {
    type C = u32;
}
impl Kind for Object {
    type C = u32;
}
impl Kind for ColliderId {
    type C = u32;
}

/// Declares how a handle finds parts, objects and colliders by index.
macro_rules! indices {
    ($($type:ty, $X:ty, |$x:ident, $c:ident| $find:expr;)*) => {
        $(
            impl $crate::call::Read<$X> for $type {
                unsafe fn read(_: &'static str, $c: u32, $x: &$X) -> Result<Self, Fault> {
                    $find
                }
            }
        )*
    };
}
pub(crate) use indices;

/// Declares C functions; see the documentation of this file.
macro_rules! calls {
    ($($(#[$text:meta])* fn $name:ident $arguments:tt $body:tt)*) => {
        $($crate::call::call! { $(#[$text])* $name $arguments $body })*
    };
}
pub(crate) use calls;

/// Declares one C function.
macro_rules! call {
    ($(#[$text:meta])* $name:ident ($h:ident: *mut $H:ident) ;) => {
        $(#[$text])*
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($h: *mut $H) {
            // SAFETY: guaranteed by the caller.
            unsafe { $crate::edge::free($h) }
        }
    };
    ($(#[$text:meta])* $name:ident ($r:ident: &mut $H:ident $(, $arg:ident: $type:ty)* $(,)?) { $($body:tt)* }) => {
        $(#[$text])*
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            handle: *mut $H
            $(, $arg: <$type as $crate::call::Kind>::C)*
        ) -> $crate::status::LwStatus {
            // SAFETY: guaranteed by the caller.
            unsafe {
                $crate::edge::alone(handle, <$H>::parts, |$r| {
                    $(<$type as $crate::call::Read<_>>::reach(stringify!($arg), &$arg, $r)?;)*
                    $(let $arg = <$type as $crate::call::Read<_>>::read(stringify!($arg), $arg, $r)?;)*
                    $($body)*
                    Ok(())
                })
            }
        }
    };
    ($(#[$text:meta])* $name:ident ($m:ident: &$H:ident $(, $arg:ident: $type:ty)* $(,)?) { $($body:tt)* }) => {
        $(#[$text])*
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            handle: *const $H
            $(, $arg: <$type as $crate::call::Kind>::C)*
        ) -> $crate::status::LwStatus {
            // SAFETY: guaranteed by the caller.
            unsafe {
                $crate::edge::shared(handle, <$H>::message, |$m| {
                    $(<$type as $crate::call::Read<_>>::reach(stringify!($arg), &$arg, $m)?;)*
                    $(let $arg = <$type as $crate::call::Read<_>>::read(stringify!($arg), $arg, $m)?;)*
                    $($body)*
                    Ok(())
                })
            }
        }
    };
    ($(#[$text:meta])* $name:ident ($($arg:ident: $type:ty),* $(,)?) { $($body:tt)* }) => {
        $(#[$text])*
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name(
            $($arg: <$type as $crate::call::Kind>::C),*
        ) -> $crate::status::LwStatus {
            $crate::edge::plain(|| {
                // SAFETY: guaranteed by the caller.
                unsafe {
                    $(<$type as $crate::call::Read<_>>::reach(stringify!($arg), &$arg, &())?;)*
                    $(let $arg = <$type as $crate::call::Read<_>>::read(stringify!($arg), $arg, &())?;)*
                    $($body)*
                    Ok(())
                }
            })
        }
    };
}
pub(crate) use call;
