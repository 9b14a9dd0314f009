//! Interruptible long calls: the work runs in a separate thread while this thread checks for Ctrl-C.
use linkwork_runner::Stop;
use pyo3::prelude::*;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// Interval between two checks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// The result of the work, and the exception that was raised meanwhile: by Ctrl-C or by `heard`.
pub struct Waited<R> {
    pub given: R,
    pub raised: Option<PyErr>,
}

impl<R> Waited<R> {
    /// Returns the result of the work, or the exception.
    pub fn or_raise(self) -> PyResult<R> {
        self.raised.map_or(Ok(self.given), Err)
    }
}

/// Runs `work` in another thread, without the interpreter's lock. Messages of the work are passed to `heard` in this thread. Ctrl-C, and an exception
/// in `heard`, set `stop`; the function then still waits for the end of the work.
pub fn patiently<T: Send, R: Send>(
    py: Python<'_>,
    stop: &Stop,
    work: impl FnOnce(Sender<T>) -> R + Send,
    mut heard: impl FnMut(T) -> PyResult<()>,
) -> Waited<R> {
    std::thread::scope(|scope| {
        let (tell, mut told) = channel();
        let worker = scope.spawn(move || work(tell));
        let mut raised: Option<PyErr> = None;
        loop {
            // The receiver is moved into the closure and back, because only one thread may own it at a time.
            let (back, message) = py.detach(move || {
                let message = told.recv_timeout(LOOK);
                (told, message)
            });
            told = back;
            let seen = match message {
                // The sender was dropped: the work is done.
                Err(RecvTimeoutError::Disconnected) => break,
                Ok(message) if raised.is_none() => py.check_signals().and_then(|()| heard(message)),
                Ok(_) | Err(RecvTimeoutError::Timeout) => py.check_signals(),
            };
            if let Err(e) = seen {
                stop.set();
                raised.get_or_insert(e);
            }
        }
        match py.detach(|| worker.join()) {
            Ok(given) => Waited { given, raised },
            Err(panic) => std::panic::resume_unwind(panic),
        }
    })
}
