//! Work on a thread of its own, without the interpreter's lock: meanwhile signals are looked at and progress is handed on.

use crate::raised;
use calib::error::{Error, Result};
use calib::pipeline::{Interrupted, Observer};
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Time between two looks at signals: Ctrl-C is answered within it.
const LOOK: Duration = Duration::from_millis(50);

/// Stage, units done, units in all, and a text: the arguments of the callable.
type Step = (String, u64, Option<u64>, String);

enum Event<T> {
    Step(Step),
    Ended(std::thread::Result<Result<T>>),
}

struct Watch<T> {
    events: Sender<Event<T>>,
    stopped: Arc<AtomicBool>,
    /// Units in all, and what is done.
    bar: Mutex<(Option<u64>, String)>,
}

impl<T> Watch<T> {
    /// Hands a step on, or leaves the work of one who does not wait any more.
    fn tell(&self, stage: &str, done: u64, text: &str) {
        if self.stopped.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Interrupted));
        }
        let bar = self.bar.lock().unwrap_or_else(PoisonError::into_inner);
        let text = if text.is_empty() { &bar.1 } else { text };
        let step = (stage.into(), done, bar.0, text.to_string());
        let _ = self.events.send(Event::Step(step));
    }

    fn start(&self, total: Option<u64>, what: &str) {
        *self.bar.lock().unwrap_or_else(PoisonError::into_inner) = (total, what.into());
    }
}

impl<T: Send> Observer for Watch<T> {
    fn stage_begins(&self, id: &str, _uses: &str, reason: &str) {
        self.start(None, reason);
        self.tell(id, 0, "");
    }
    fn begin(&self, id: &str, what: &str, total: Option<u64>, _unit: &str) {
        self.start(total, what);
        self.tell(id, 0, "");
    }
    fn advance(&self, id: &str, done: u64, message: &str) {
        self.tell(id, done, message);
    }
}

/// Works, and waits for it. Raises what the callable or a signal raises: the work then ends at its next step.
pub fn wait<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    work: impl FnOnce(&dyn Observer) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let (events, mut received) = channel();
    let stopped = Arc::new(AtomicBool::new(false));
    let watch = Watch {
        events: events.clone(),
        stopped: stopped.clone(),
        bar: Mutex::default(),
    };
    std::thread::spawn(move || {
        let ended = catch_unwind(AssertUnwindSafe(|| work(&watch)));
        let _ = events.send(Event::Ended(ended));
    });
    loop {
        let event;
        (received, event) = py.detach(move || {
            let event = received.recv_timeout(LOOK);
            (received, event)
        });
        let mut sent = Ok(());
        match event {
            Ok(Event::Ended(Ok(ended))) => return ended.map_err(raised),
            Ok(Event::Ended(Err(_))) | Err(RecvTimeoutError::Disconnected) => {
                return Err(raised(Error::Bug("the work panicked".into())));
            }
            Ok(Event::Step(step)) => {
                if let Some(progress) = &progress {
                    sent = progress.call1(py, step).map(drop);
                }
            }
            Err(RecvTimeoutError::Timeout) => (),
        }
        if let Err(error) = sent.and_then(|()| py.check_signals()) {
            stopped.store(true, Ordering::Relaxed);
            return Err(error);
        }
    }
}
