//! Messages of a unit, kept for the report of its next error.
use std::ffi::{CStr, c_char, c_int, c_void};
use std::sync::Mutex;

/// Largest number of kept messages.
const MESSAGES_MAX: usize = 6;
/// Largest number of characters of a message.
const MESSAGE_MAX: usize = 300;
/// The last messages of the unit. Foreign code writes them, so nothing here may panic.
#[derive(Default)]
pub(crate) struct Log(Mutex<Vec<String>>);

impl Log {
    pub fn add(&self, message: *const c_char) {
        if message.is_null() {
            return;
        }
        // SAFETY: a C string that lives during the call, by the standard.
        let text = unsafe { CStr::from_ptr(message) }.to_string_lossy();
        let text: String = text.trim().chars().take(MESSAGE_MAX).collect();
        if let Ok(mut kept) = self.0.lock()
            && !text.is_empty()
        {
            if kept.len() >= MESSAGES_MAX {
                kept.remove(0);
            }
            kept.push(text);
        }
    }

    /// Returns and removes the messages since the last call, as text for an error message.
    pub fn take(&self) -> String {
        let said = self.0.lock().map(|mut kept| std::mem::take(&mut *kept)).unwrap_or_default();
        if said.is_empty() { String::new() } else { format!("; it says: {}", said.join("; ")) }
    }
}

pub(crate) unsafe extern "C" fn logger2(
    environment: *mut c_void,
    _: *const c_char,
    _: c_int,
    _: *const c_char,
    message: *const c_char,
) {
    // SAFETY: null, or the log that the instance was made with and keeps.
    if let Some(log) = unsafe { environment.cast::<Log>().as_ref() } {
        log.add(message);
    }
}

pub(crate) unsafe extern "C" fn logger3(
    environment: *mut c_void,
    _: c_int,
    _: *const c_char,
    message: *const c_char,
) {
    // SAFETY: as for `logger2`.
    if let Some(log) = unsafe { environment.cast::<Log>().as_ref() } {
        log.add(message);
    }
}
