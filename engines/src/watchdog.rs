//! A time limit for each answer of a running program.
//!
//! One thread serves all answers: it looks at a counter now and then, so that a program that answers within microseconds is not slowed down.

use std::process::Child;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The time between two looks.
const GLANCE: Duration = Duration::from_millis(100);

/// Stops a program if an answer takes too long. Its thread ends with it.
pub(crate) struct Watchdog {
    /// Counts the beginnings and ends of answers: odd during one.
    count: Arc<AtomicU64>,
    is_late: Arc<AtomicBool>,
    _alive: Sender<()>,
}

impl Watchdog {
    /// Watches a program; `patience` is the time limit for one answer. Without a thread, if none can be started, nothing is limited.
    pub(crate) fn new(child: Arc<Mutex<Child>>, patience: Duration) -> Watchdog {
        let (alive, ended) = mpsc::channel::<()>();
        let (count, is_late) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
        let watch = {
            let (count, is_late) = (Arc::clone(&count), Arc::clone(&is_late));
            move || {
                let (mut seen, mut waited) = (0, Duration::ZERO);
                while ended.recv_timeout(GLANCE) == Err(RecvTimeoutError::Timeout) {
                    let now = count.load(Ordering::Acquire);
                    if now != seen || now % 2 == 0 {
                        (seen, waited) = (now, Duration::ZERO);
                        continue;
                    }
                    waited += GLANCE;
                    if waited >= patience {
                        is_late.store(true, Ordering::Release);
                        kill(&child);
                        return;
                    }
                }
            }
        };
        let _ = std::thread::Builder::new().name("watchdog".to_owned()).spawn(watch);
        Watchdog { count, is_late, _alive: alive }
    }

    /// Limits the time of `answer`.
    pub(crate) fn during<T>(&self, answer: impl FnOnce() -> T) -> T {
        self.count.fetch_add(1, Ordering::AcqRel);
        let result = answer();
        self.count.fetch_add(1, Ordering::AcqRel);
        result
    }

    /// Whether the program was stopped because an answer took too long.
    pub(crate) fn is_late(&self) -> bool {
        self.is_late.load(Ordering::Acquire)
    }
}

/// Stops a program, if it still runs.
pub(crate) fn kill(child: &Mutex<Child>) {
    if let Ok(mut child) = child.lock() {
        let _ = child.kill();
    }
}
