//! Runs the JavaScript of the page of a chart in node: exactly the bytes that `grafsynth page` writes.

use crate::scratch::Scratch;
use crate::tools;
use crate::{Availability, Engine, EngineError, Job};
use grafsynth_ir::FileId;
use grafsynth_page::{Contents, Cut, Reference, cut};
use grafsynth_sim::{Trace, TraceLayout};
use std::fs;
use std::time::Duration;

/// The page of a chart in node.
#[derive(Debug, Clone, Copy)]
pub struct JsEngine;

/// The time limit of node.
const LIMIT: Duration = Duration::from_secs(300);
const DRIVER: &str = include_str!("js_driver.js");

impl Engine for JsEngine {
    fn name(&self) -> &'static str {
        "js"
    }

    fn about(&self) -> &'static str {
        "the JavaScript of `grafsynth page` in node"
    }

    fn availability(&self) -> Availability {
        match tools::find(&["node", "nodejs"]) {
            Some(_) => Availability::Here,
            None => Availability::Missing("node".to_owned()),
        }
    }

    fn by_default(&self) -> bool {
        false
    }

    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError> {
        let texts = js_traces(std::slice::from_ref(job))?;
        let text = texts.first().map(String::as_str).unwrap_or_default();
        let layout = TraceLayout::of(job.net);
        Trace::parse_csv(&layout, FileId(0), text).map_err(|found| {
            let found: Vec<String> = found.into_iter().map(|it| it.message).collect();
            EngineError::Failed(format!("the trace of node cannot be read: {}", found.join("; ")))
        })
    }
}

/// The traces of several jobs as CSV, with one start of node.
///
/// # Errors
/// A net has no page, or node fails.
#[expect(clippy::disallowed_methods, reason = "engines work in temporary folders")]
pub fn js_traces(jobs: &[Job<'_>]) -> Result<Vec<String>, EngineError> {
    let Some(node) = tools::find(&["node", "nodejs"]) else {
        return Err(EngineError::Failed("node is not installed".to_owned()));
    };
    let folder = Scratch::new().map_err(failed)?;
    let mut script = None;
    for (number, job) in jobs.iter().enumerate() {
        let page = grafsynth_page::page(job.net, &Reference::default(), &Contents::default())
            .map_err(EngineError::Refused)?;
        let (Some(engine), Some(data)) = (cut(&page, Cut::Engine), cut(&page, Cut::Data)) else {
            return Err(EngineError::Failed("the page contains no engine".to_owned()));
        };
        script.get_or_insert_with(|| format!("{engine}\n{DRIVER}"));
        let stimulus = job.stimulus.to_csv(job.net);
        fs::write(folder.path().join(format!("{number}.json")), data).map_err(failed)?;
        fs::write(folder.path().join(format!("{number}.csv")), stimulus).map_err(failed)?;
    }
    fs::write(folder.path().join("run.js"), script.unwrap_or_default()).map_err(failed)?;
    let count = jobs.len().to_string();
    let done = tools::run(&node, &["run.js", &count], folder.path(), b"", LIMIT)
        .map_err(EngineError::Failed)?;
    if !done.is_success {
        return Err(EngineError::Failed(format!("node: {}", done.stderr.trim())));
    }
    let trace = |number| fs::read_to_string(folder.path().join(format!("{number}.trace")));
    (0..jobs.len()).map(trace).collect::<Result<_, _>>().map_err(failed)
}

fn failed(error: std::io::Error) -> EngineError {
    EngineError::Failed(error.to_string())
}
