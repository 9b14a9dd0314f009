//! The edge: pointers and lengths become slices and values, or a fault; what panics ends here.

use crate::status::{Fault, LwStatus, Message};
use linkwork_embedded::spatial::nalgebra::Quaternion;
use linkwork_embedded::spatial::{Motion, Pose, Quat, Vec3};
use linkwork_embedded::{Object, Part, RobotError, RobotModel};
use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, PoisonError, TryLockError};

/// A pose: where a frame is in another.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwPose {
    /// x, y, z, m.
    pub position: [f64; 3],
    /// x, y, z, w; of length 1 within 1e-6.
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

/// A vector of finite numbers.
pub(crate) fn vec3(what: &'static str, x: &[f64; 3]) -> Result<Vec3, Fault> {
    finite(what, x)?;
    Ok(Vec3::from(*x))
}

/// Angular part, then linear part.
pub(crate) fn motion(what: &'static str, x: &[f64; 6]) -> Result<Motion, Fault> {
    finite(what, x)?;
    let [a, b, c, d, e, f] = *x;
    Ok(Motion::new(Vec3::new(a, b, c), Vec3::new(d, e, f)))
}

/// x, y, z, w of length 1 within 1e-6.
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

/// Refuses NaN and infinities.
pub(crate) fn finite(what: &'static str, x: &[f64]) -> Result<(), Fault> {
    match x.iter().position(|x| !x.is_finite()) {
        Some(index) => Err(RobotError::NotFinite { what, index, value: x[index] }.into()),
        None => Ok(()),
    }
}

/// The part of a model at a place.
pub(crate) fn part(model: &RobotModel, index: u32) -> Result<Part, Fault> {
    let found = model.parts().nth(index as usize).map(|p| p.0);
    Ok(found.ok_or(RobotError::ForeignHandle)?)
}

pub(crate) fn object(model: &RobotModel, index: u32) -> Result<Object, Fault> {
    let found = model.objects().nth(index as usize).map(|o| o.0);
    Ok(found.ok_or(RobotError::ForeignHandle)?)
}

/// Runs a call on what a handle shares among threads.
///
/// # Safety
/// The promises at the head of the crate.
pub(crate) unsafe fn shared<H>(
    handle: *const H,
    message: impl Fn(&H) -> &Mutex<Message>,
    work: impl FnOnce(&H) -> Result<(), Fault>,
) -> LwStatus {
    // SAFETY: a handle of this library that is not freed, or NULL.
    let Some(handle) = (unsafe { handle.as_ref() }) else { return LwStatus::Null };
    let done = catch_unwind(AssertUnwindSafe(|| work(handle)));
    let Err(fault) = done.unwrap_or(Err(Fault::Panicked)) else { return LwStatus::Ok };
    // Who asks how long a text is has made no mistake: the message of another thread's failure stays.
    if !matches!(fault, Fault::TextLength { room: 0, .. }) {
        let mut message = message(handle).lock().unwrap_or_else(PoisonError::into_inner);
        message.say(&fault);
    }
    fault.status()
}

/// Runs a call on what one thread at a time may change. What panicked once is not touched again.
///
/// # Safety
/// The promises at the head of the crate.
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

/// Runs a call without a handle: its code is all that is told.
pub(crate) fn plain(work: impl FnOnce() -> Result<(), Fault>) -> LwStatus {
    match catch_unwind(AssertUnwindSafe(work)).unwrap_or(Err(Fault::Panicked)) {
        Ok(()) => LwStatus::Ok,
        Err(fault) => fault.status(),
    }
}

/// Frees a handle; NULL is none.
///
/// # Safety
/// The promises at the head of the crate; nobody uses the handle any more.
pub(crate) unsafe fn free<H>(handle: *mut H) {
    if !handle.is_null() {
        // SAFETY: it came from `Box::into_raw` in this library, and is given back once.
        let handle = unsafe { Box::from_raw(handle) };
        // Nothing that is freed panics; if it did, it would not go further.
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
    // NULL stands for no numbers.
    if got == 0 { Ok(()) } else { reachable(what, p) }
}

/// Numbers to read; NULL is allowed for none.
///
/// # Safety
/// The promises at the head of the crate. `wanted` fits into memory.
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
    // SAFETY: neither NULL nor misaligned, of the length that this library has itself.
    Ok(unsafe { std::slice::from_raw_parts(p, got) })
}

/// Numbers to write; NULL is allowed for none. Memory of a C program holds some number or other before, if only by chance.
///
/// # Safety
/// The promises at the head of the crate. `wanted` fits into memory.
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
    // SAFETY: neither NULL nor misaligned, of the length that this library has itself.
    Ok(unsafe { std::slice::from_raw_parts_mut(p, got) })
}

/// Answers with a list where there is room for it, and with how many there are.
///
/// # Safety
/// The promises at the head of the crate.
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
    // SAFETY: the caller's promises; the slices are in use no more.
    unsafe { count.set(wanted) };
    if wanted <= room { Ok(()) } else { Err(RobotError::NoRoom { what, wanted, room }.into()) }
}

/// Refuses memory to read that overlaps memory to write.
pub(crate) fn apart(
    (what, p, n): (&'static str, *const f64, usize),
    (other, o, m): (&'static str, *mut f64, usize),
) -> Result<(), Fault> {
    let end = |p: usize, n: usize| p.saturating_add(n.saturating_mul(size_of::<f64>()));
    let (p, o) = (p.addr(), o.addr());
    let clear = n == 0 || m == 0 || end(p, n) <= o || end(o, m) <= p;
    if clear { Ok(()) } else { Err(Fault::Overlap(what, other)) }
}

/// Refuses memory to write that overlaps memory to read, or other memory to write.
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

/// A value to read.
///
/// # Safety
/// The promises at the head of the crate.
pub(crate) unsafe fn value<T: Copy>(what: &'static str, p: *const T) -> Result<T, Fault> {
    reachable(what, p)?;
    // SAFETY: neither NULL nor misaligned; all values of the types read are legal (numbers).
    Ok(unsafe { p.read() })
}

/// Memory for an answer.
pub(crate) struct Out<T>(*mut T);

impl<T> Out<T> {
    /// Looked at before anything is done.
    pub fn new(what: &'static str, p: *mut T) -> Result<Self, Fault> {
        reachable(what, p.cast_const())?;
        Ok(Self(p))
    }

    /// # Safety
    /// The promises at the head of the crate; no slice of the call is in use any more.
    pub unsafe fn set(self, value: T) {
        // SAFETY: neither NULL nor misaligned.
        unsafe { self.0.write(value) }
    }
}

/// A text that ends with a zero.
///
/// # Safety
/// The promises at the head of the crate.
pub(crate) unsafe fn text<'a>(what: &'static str, p: *const c_char) -> Result<&'a str, Fault> {
    reachable(what, p)?;
    // SAFETY: not NULL, and ends with a zero.
    unsafe { CStr::from_ptr(p) }.to_str().map_err(|_| Fault::Text(what))
}

/// Writes a text and its zero into memory of `room` bytes, cut between two characters when it is too long; and into `wanted`, unless
/// that is NULL, for how many bytes there must be room.
///
/// # Safety
/// The promises at the head of the crate.
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
        // SAFETY: `cut` and a zero fit into `room` bytes, which the caller has; no text of this library lies there.
        unsafe {
            buffer.copy_from_nonoverlapping(words.as_ptr().cast(), cut);
            buffer.add(cut).write(0);
        }
    }
    if let Some(wanted) = wanted {
        // SAFETY: no slice is in use.
        unsafe { wanted.set(count) };
    }
    let what = "buffer";
    if count <= room { Ok(()) } else { Err(Fault::TextLength { what, wanted: count, room }) }
}

/// Copies the message of a handle; see [`write_text`]. The message stays as it is.
///
/// # Safety
/// The promises at the head of the crate.
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
        // SAFETY: the caller's promises.
        unsafe { write_text(message.text(), buffer, room, wanted) }
    }));
    match done.unwrap_or(Err(Fault::Panicked)) {
        Ok(()) => LwStatus::Ok,
        Err(fault) => fault.status(),
    }
}
