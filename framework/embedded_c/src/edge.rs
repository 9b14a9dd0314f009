//! Boundary to C: converts pointers and lengths to slices and values, or returns a fault. Panics are caught here.

use crate::status::{Fault, LwStatus, Message};
use linkwork_embedded::spatial::nalgebra::Quaternion;
use linkwork_embedded::spatial::{Motion, Pose, Quat, Vec3};
use linkwork_embedded::{Object, Part, RobotError, RobotModel};
use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError, TryLockError};

/// A pose of a frame in another frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwPose {
    /// Position x, y, z, m.
    pub position: [f64; 3],
    /// Quaternion x, y, z, w; of length 1 within 1e-6.
    pub quaternion: [f64; 4],
}

impl From<Pose> for LwPose {
    fn from(X: Pose) -> Self {
        let R = &X.rotation.coords;
        Self { position: X.position.into(), quaternion: [R.x, R.y, R.z, R.w] }
    }
}

impl LwPose {
    pub(crate) fn checked(&self) -> Result<Pose, Fault> {
        let position = vec3("position", &self.position)?;
        Ok(Pose::new(rotation(&self.quaternion)?, position))
    }
}

/// Converts a vector of finite numbers.
pub(crate) fn vec3(what: &'static str, x: &[f64; 3]) -> Result<Vec3, Fault> {
    finite(what, x)?;
    Ok(Vec3::from(*x))
}

/// Converts six finite numbers: angular part, then linear part.
pub(crate) fn motion(what: &'static str, x: &[f64; 6]) -> Result<Motion, Fault> {
    finite(what, x)?;
    let [a, b, c, d, e, f] = *x;
    Ok(Motion::new(Vec3::new(a, b, c), Vec3::new(d, e, f)))
}

/// Converts a quaternion x, y, z, w of length 1 within 1e-6.
pub(crate) fn rotation(x: &[f64; 4]) -> Result<Quat, Fault> {
    finite("quaternion", x)?;
    let q = Quaternion::new(x[3], x[0], x[1], x[2]);
    let value = q.norm();
    if (value - 1.0).abs() < 1e-6 {
        return Ok(Quat::from_quaternion(q));
    }
    let help = "give a quaternion of length 1";
    Err(RobotError::OutOfRange { what: "length of the quaternion", value, help }.into())
}

/// Rejects NaN and infinity.
pub(crate) fn finite(what: &'static str, x: &[f64]) -> Result<(), Fault> {
    match x.iter().position(|x| !x.is_finite()) {
        Some(index) => Err(RobotError::NotFinite { what, index, value: x[index] }.into()),
        None => Ok(()),
    }
}

/// Returns the part of a model by index.
pub(crate) fn part(model: &RobotModel, index: u32) -> Result<Part, Fault> {
    let found = model.parts().nth(index as usize).map(|p| p.0);
    Ok(found.ok_or(RobotError::ForeignHandle)?)
}

pub(crate) fn object(model: &RobotModel, index: u32) -> Result<Object, Fault> {
    let found = model.objects().nth(index as usize).map(|o| o.0);
    Ok(found.ok_or(RobotError::ForeignHandle)?)
}

/// Runs a call on data that several threads may share.
///
/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn shared<H>(
    handle: *const H,
    message: impl Fn(&H) -> &Mutex<Message>,
    work: impl FnOnce(&H) -> Result<(), Fault>,
) -> LwStatus {
    // SAFETY: a handle of this library that is not freed, or NULL.
    let Some(handle) = (unsafe { handle.as_ref() }) else { return LwStatus::Null };
    let done = catch_unwind(AssertUnwindSafe(|| work(handle)));
    let Err(fault) = done.unwrap_or(Err(Fault::Panicked)) else { return LwStatus::Ok };
    // A request for the length of a text is not an error, so it must not replace the message of another thread's
    // failure.
    if !matches!(fault, Fault::TextLength { room: 0, .. }) {
        let mut message = message(handle).lock().unwrap_or_else(PoisonError::into_inner);
        message.say(&fault);
    }
    fault.status()
}

/// Runs a call on data that only one thread at a time may change. After a panic the data are not used again.
///
/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn alone<H, T>(
    handle: *const H,
    parts: impl Fn(&H) -> (&Mutex<T>, &Mutex<Message>),
    work: impl FnOnce(&mut T) -> Result<(), Fault>,
) -> LwStatus {
    // SAFETY: a handle of this library that is not freed, or NULL.
    let Some(handle) = (unsafe { handle.as_ref() }) else { return LwStatus::Null };
    let (inner, message) = parts(handle);
    let done = catch_unwind(AssertUnwindSafe(|| match inner.try_lock() {
        Ok(mut inner) => work(&mut inner),
        Err(TryLockError::WouldBlock) => Err(Fault::Busy),
        Err(TryLockError::Poisoned(_)) => Err(Fault::Panicked),
    }));
    let Err(fault) = done.unwrap_or(Err(Fault::Panicked)) else { return LwStatus::Ok };
    if !matches!(fault, Fault::Busy) {
        message.lock().unwrap_or_else(PoisonError::into_inner).say(&fault);
    }
    fault.status()
}

/// Runs a call without a handle, which returns only a code.
pub(crate) fn plain(work: impl FnOnce() -> Result<(), Fault>) -> LwStatus {
    match catch_unwind(AssertUnwindSafe(work)).unwrap_or(Err(Fault::Panicked)) {
        Ok(()) => LwStatus::Ok,
        Err(fault) => fault.status(),
    }
}

/// Frees a handle; NULL has no effect.
///
/// # Safety
/// The conditions in the crate documentation apply; the handle is not used any more.
pub(crate) unsafe fn free<H>(handle: *mut H) {
    if !handle.is_null() {
        // SAFETY: the pointer came from `Box::into_raw` in this library and is freed once.
        let handle = unsafe { Box::from_raw(handle) };
        // Dropping these types does not panic; if it did, the panic must not reach C.
        let _ = catch_unwind(AssertUnwindSafe(|| drop(handle)));
    }
}

fn reachable<T>(what: &'static str, p: *const T) -> Result<(), Fault> {
    if p.is_null() {
        return Err(Fault::Null(what));
    }
    if p.is_aligned() { Ok(()) } else { Err(Fault::Misaligned(what)) }
}

fn array<T>(what: &'static str, p: *const T, got: usize, wanted: usize) -> Result<(), Fault> {
    if got != wanted {
        return Err(RobotError::Length { what, got, wanted }.into());
    }
    // NULL is allowed for an empty array.
    if got == 0 { Ok(()) } else { reachable(what, p) }
}

/// Returns numbers to read; NULL is allowed for an empty array.
///
/// # Safety
/// The conditions in the crate documentation apply. `wanted` numbers fit into memory.
pub(crate) unsafe fn numbers<'a, T>(
    what: &'static str,
    p: *const T,
    got: usize,
    wanted: usize,
) -> Result<&'a [T], Fault> {
    array(what, p, got, wanted)?;
    if got == 0 {
        return Ok(&[]);
    }
    // SAFETY: neither NULL nor misaligned, and the length was checked against the length that this library expects.
    Ok(unsafe { std::slice::from_raw_parts(p, got) })
}

/// Returns numbers to write; NULL is allowed for an empty array. Every bit pattern in the memory of a C program is a valid number.
///
/// # Safety
/// The conditions in the crate documentation apply. `wanted` numbers fit into memory.
pub(crate) unsafe fn numbers_mut<'a, T>(
    what: &'static str,
    p: *mut T,
    got: usize,
    wanted: usize,
) -> Result<&'a mut [T], Fault> {
    array(what, p, got, wanted)?;
    if got == 0 {
        return Ok(&mut []);
    }
    // SAFETY: neither NULL nor misaligned, and the length was checked against the length that this library expects.
    Ok(unsafe { std::slice::from_raw_parts_mut(p, got) })
}

/// Writes a list if there is room for it, and its length in any case.
///
/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn list<T>(
    what: &'static str,
    from: impl ExactSizeIterator<Item = T>,
    to: &mut [T],
    count: Out<usize>,
) -> Result<(), Fault> {
    let (wanted, room) = (from.len(), to.len());
    if wanted <= room {
        to.iter_mut().zip(from).for_each(|(to, from)| *to = from);
    }
    // SAFETY: guaranteed by the caller; the slices are not used after this.
    unsafe { count.set(wanted) };
    if wanted <= room { Ok(()) } else { Err(RobotError::NoRoom { what, wanted, room }.into()) }
}

/// Rejects memory to read that overlaps memory to write.
pub(crate) fn apart(
    (what, p, n): (&'static str, *const f64, usize),
    (other, o, m): (&'static str, *mut f64, usize),
) -> Result<(), Fault> {
    let end = |p: usize, n: usize| p.saturating_add(n.saturating_mul(size_of::<f64>()));
    let (p, o) = (p.addr(), o.addr());
    let clear = n == 0 || m == 0 || end(p, n) <= o || end(o, m) <= p;
    if clear { Ok(()) } else { Err(Fault::Overlap(what, other)) }
}

/// Rejects memory to write that overlaps memory to read or other memory to write.
pub(crate) fn disjoint(
    read: &[(&'static str, *const f64, usize)],
    written: &[(&'static str, *mut f64, usize)],
) -> Result<(), Fault> {
    for (k, w) in written.iter().enumerate() {
        for r in read {
            apart(*r, *w)?;
        }
        for (what, p, n) in &written[..k] {
            apart((what, p.cast_const(), *n), *w)?;
        }
    }
    Ok(())
}

/// Reads a value.
///
/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn value<T: Copy>(what: &'static str, p: *const T) -> Result<T, Fault> {
    reachable(what, p)?;
    // SAFETY: neither NULL nor misaligned; every bit pattern is valid for the types that are read (numbers).
    Ok(unsafe { p.read() })
}

/// Memory for a result.
pub struct Out<T>(*mut T);

impl<T> Out<T> {
    /// Checks the pointer before any work is done.
    pub(crate) fn new(what: &'static str, p: *mut T) -> Result<Self, Fault> {
        reachable(what, p.cast_const())?;
        Ok(Self(p))
    }

    /// # Safety
    /// The conditions in the crate documentation apply; no slice of the call is used any more.
    pub(crate) unsafe fn set(self, value: T) {
        // SAFETY: neither NULL nor misaligned.
        unsafe { self.0.write(value) }
    }
}

/// Reads a text that ends with a zero.
///
/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn text<'a>(what: &'static str, p: *const c_char) -> Result<&'a str, Fault> {
    reachable(what, p)?;
    // SAFETY: not NULL, and the text ends with a zero.
    unsafe { CStr::from_ptr(p) }.to_str().map_err(|_| Fault::Text(what))
}

/// Writes a text and its terminating zero into memory of `room` bytes, cut between two characters when it is too long. Writes the required number of
/// bytes to `wanted` unless that is NULL.
///
/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn write_text(
    words: &str,
    buffer: *mut c_char,
    room: usize,
    wanted: *mut usize,
) -> Result<(), Fault> {
    let count = words.len() + 1;
    let wanted = if wanted.is_null() { None } else { Some(Out::new("wanted", wanted)?) };
    if room > 0 {
        reachable("buffer", buffer.cast_const())?;
        let mut cut = words.len().min(room - 1);
        while !words.is_char_boundary(cut) {
            cut -= 1;
        }
        // SAFETY: `cut` bytes and a zero fit into `room` bytes, which the caller has; no text of this library overlaps them.
        unsafe {
            buffer.copy_from_nonoverlapping(words.as_ptr().cast(), cut);
            buffer.add(cut).write(0);
        }
    }
    if let Some(wanted) = wanted {
        // SAFETY: no slice is used after this.
        unsafe { wanted.set(count) };
    }
    let what = "buffer";
    if count <= room { Ok(()) } else { Err(Fault::TextLength { what, wanted: count, room }) }
}

/// Copies the message of a handle; see [`write_text`]. The message does not change.
///
/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn message<H>(
    handle: *const H,
    message: impl Fn(&H) -> &Mutex<Message>,
    buffer: *mut c_char,
    room: usize,
    wanted: *mut usize,
) -> LwStatus {
    // SAFETY: a handle of this library that is not freed, or NULL.
    let Some(handle) = (unsafe { handle.as_ref() }) else { return LwStatus::Null };
    let done = catch_unwind(AssertUnwindSafe(|| {
        let message = message(handle).lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: guaranteed by the caller.
        unsafe { write_text(message.text(), buffer, room, wanted) }
    }));
    match done.unwrap_or(Err(Fault::Panicked)) {
        Ok(()) => LwStatus::Ok,
        Err(fault) => fault.status(),
    }
}
