//! Golden cases and differential runs over all engines.
//!
//! With `GRAFSYNTH_DEEP=1` in the environment the large numbers of rounds are run, with `GRAFSYNTH_DEEP=8` an eighth of them; `scripts/test --deep` sets it.

pub mod conversions;
pub mod facts_check;
pub mod fleet;
pub mod large_chart;
pub mod random_c;
pub mod random_chart;
pub mod random_net;
pub mod random_table;
pub mod variants;

use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_verify::Limits;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// The number of rounds of a test: `few` by default, `many` with `GRAFSYNTH_DEEP=1`, and `many / n`, but at least `few`, with `GRAFSYNTH_DEEP=n`.
#[must_use]
#[allow(clippy::disallowed_methods, reason = "the environment says how long the tests may take")]
pub fn rounds(few: u64, many: u64) -> u64 {
    match std::env::var("GRAFSYNTH_DEEP").ok().and_then(|part| part.parse::<u64>().ok()) {
        None | Some(0) => few,
        Some(part) => many.div_ceil(part).max(few),
    }
}

/// Runs `work` for each item on all processors; returns the results in the order of the items.
///
/// # Panics
/// If `work` panics.
#[must_use]
pub fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let take = || {
        let mut done = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(at) else { return done };
            done.push((at, work(item)));
        }
    };
    let n_workers = thread::available_parallelism().map_or(1, usize::from).min(items.len());
    let mut all = thread::scope(|scope| {
        let workers: Vec<_> = (0..n_workers).map(|_| scope.spawn(take)).collect();
        let answers = workers.into_iter().map(|worker| match worker.join() {
            Ok(done) => done,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        answers.flatten().collect::<Vec<_>>()
    });
    all.sort_by_key(|(at, _)| *at);
    all.into_iter().map(|(_, answer)| answer).collect()
}

/// Limits for the facts of small random nets: low, because there are many nets.
#[must_use]
pub fn small_limits() -> Limits {
    Limits { pairs: 4_000, states: 500, image_work: 200_000, ..Limits::default() }
}

/// The net of a text; the extension of `name` determines its language.
///
/// # Panics
/// If the text has an error: it is part of a test.
#[must_use]
pub fn chart(name: &str, text: &str) -> Valid<Net> {
    let mut sources = Sources::default();
    let main = sources.add(name, text);
    match read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()) {
        (Some(Design::Net(design)), _) => design.net,
        (Some(Design::Logic(_)) | None, found) => panic!("{name}: {found:#?}"),
    }
}

/// The codes with which a device rejects a design: insufficient resources, and impossible power-up values.
pub const DEVICE_LIMITS: [&str; 3] = ["G0710", "G0711", "G0713"];

/// A net in its most readable form: `.graf` if that can express it, otherwise `.net`.
#[must_use]
pub fn readable(net: &Valid<Net>) -> String {
    match grafsynth_frontend::graf::write_net(net) {
        Ok(text) => text,
        Err(_) => grafsynth_ir::text::print(net),
    }
}
