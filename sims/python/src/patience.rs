//! Long work in Rust that can be interrupted: it has a thread of its own, and this one looks at Ctrl-C.
use linkwork_runner::Stop;
use pyo3::prelude::*;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// Between two looks at Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// What the work gave, and what was raised meanwhile: by Ctrl-C, or by `heard`.
pub struct Waited<R> {
    pub given: R,
    pub raised: Option<PyErr>,
}

impl<R> Waited<R> {
    /// What the work gave, unless something was raised.
    pub fn or_raise(self) -> PyResult<R> {
        self.raised.map_or(Ok(self.given), Err)
    }
}

/// Does `work` in another thread, without the interpreter's lock. What it tells is given to `heard` in this one.
/// Ctrl-C, and what `heard` raises, set `stop`; the work is waited for all the same.
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
            // The receiver goes with the closure and comes back: it may be in one thread at a time.
            let (back, message) = py.detach(move || {
                let message = told.recv_timeout(LOOK);
                (told, message)
            });
            told = back;
            let seen = match message {
                // The work is done, or its sender is gone with it.
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
