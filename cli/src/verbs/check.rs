//! `grafsynth check FILE…`.

use crate::args::{Check, Input};
use crate::evidence;
use crate::exit::Exit;
use crate::files;
use crate::lists::did_you_mean;
use crate::load::{Session, Stop};
use crate::named::Notes;
use crate::progress;
use crate::report::{About, Answer, Status, proof_name, reason};
use grafsynth_backend_c::cost::Machine;
use grafsynth_driver::certify::Certifiable;
use grafsynth_driver::evidence::Evidence;
use grafsynth_driver::logic::LogicDesign;
use grafsynth_driver::read::{Design, NetDesign};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Net, Policy, Property};
use grafsynth_ir::{Diagnostic, FileId, Valid, counted};
use grafsynth_verify::{Checked, Explored, Limits, Outcome, PropertyVerdict, Scope, Wait, Waiting};
use serde_json::json;
use std::path::Path;

mod invariants;

/// The number of steps from which a chart counts as large.
const LARGE: usize = 100;

pub(crate) fn run(session: &mut Session, arguments: &Check) -> Result<Exit, Stop> {
    evidence::check_name(arguments.trace.as_deref())?;
    let exit = all(session, arguments)?;
    session.no_trace(arguments.trace.as_deref());
    Ok(exit)
}

fn all(session: &mut Session, arguments: &Check) -> Result<Exit, Stop> {
    let inputs = session.inputs(&arguments.inputs)?;
    if let [input] = inputs.as_slice() {
        if let Some(pass) = &arguments.dump_after {
            return dump(session, input, pass);
        }
        return one(session, arguments, input);
    }
    let Check { dump_after, certify, invariants, recheck, .. } = arguments;
    if dump_after.is_some() || certify.is_some() || invariants.is_some() || recheck.is_some() {
        return Err(Stop::Usage(
            "--dump-after, --certify, --invariants and --recheck accept one file".to_owned(),
        ));
    }
    session.each(&inputs, |session, input| one(session, arguments, input))
}

fn one(session: &mut Session, arguments: &Check, input: &Input) -> Result<Exit, Stop> {
    session.begin(&input.file);
    let (design, mut found) = session.design(input)?;
    let design = match design {
        Design::Net(design) => design,
        Design::Logic(design) => return Ok(logic(session, &design, found)),
    };
    session.know_found(&found);
    let net = &design.net;
    if session.is_impossible(net) {
        session.show(&found);
        return Ok(Exit::Errors);
    }
    let limits = arguments.limits.limits();
    // A large chart has more states than can be visited; its structure is analysed without them.
    let visited = if net.steps.len() > LARGE { limits.pairs.min(100_000) } else { limits.pairs };
    let visited = Limits { pairs: visited, ..limits.clone() };
    let name = net.name.to_string();
    progress::doing(format!("exploring the states of {name}"));
    // The guarantees of the emergency are checked in the same states as the rest.
    let (asked, refused) = match grafsynth_verify::with_emergency(net) {
        Ok(asked) => (asked, Vec::new()),
        Err(refused) => (net.clone(), refused),
    };
    if let Some(file) = &arguments.recheck {
        session.show(&found);
        let exit = invariants::recheck(session, &asked, file, &limits)?;
        return Ok(if session.demands.refuse(&found) { exit.worse(Exit::Errors) } else { exit });
    }
    let explored = Explored::of(&asked, &visited);
    let facts = explored.facts();
    progress::doing(format!("looking for conflicts, dead ends and livelock in {name}"));
    let findings = explored.findings(&facts);
    let own: Vec<Diagnostic> = findings
        .found
        .into_iter()
        .filter(|finding| !grafsynth_driver::read::is_consequence(finding, &found))
        .collect();
    found.extend(own);
    if arguments.notes.contains(&Notes::Conflicts) {
        found.extend(findings.notes);
    }
    found.extend(grafsynth_driver::trust::unseen(net));
    let machine = input.reading.machine;
    if let Some(output) = &arguments.certify {
        return certify(session, &design, machine, output, &limits, found);
    }
    if let Some(chart) = &design.chart {
        found.extend(grafsynth_driver::libraries::certificates(chart, machine, &limits));
    }
    session.show(&found);
    progress::doing(format!("proving the asserts of {name}"));
    let mut exit = Exit::Done;
    if !refused.is_empty() {
        session.show(&refused);
        let message = "its condition is not allowed in a property";
        let answer = Answer::new(About::Assert, "emergency", Status::Open, message);
        session.answer(&answer, &format!("open     emergency: {message}\n"));
        exit = Exit::Open;
    }
    let verdicts = explored.properties(&limits);
    for PropertyVerdict { property, outcome } in &verdicts {
        exit = exit.worse(said(session, arguments, &asked, &asked.properties[*property], outcome)?);
    }
    if let Some(output) = &arguments.invariants {
        exit = exit.worse(invariants::write(session, &asked, &verdicts, output, &limits)?);
    }
    progress::doing(format!("checking how long transitions of {name} wait"));
    waits(session, arguments, net, &explored, &limits)?;
    if session.demands.refuse(&found) {
        return Ok(exit.worse(Exit::Errors));
    }
    counts(session, net, &facts);
    if findings.checked.iter().any(|one| one.open.is_some()) {
        exit = exit.worse(session.demands.unchecked());
    }
    looked_for(session, &findings.checked);
    Ok(exit)
}

/// Reports the size of the chart.
fn counts(session: &Session, net: &Net, facts: &Facts) {
    let (steps, transitions) = (net.steps.len(), net.transitions.len());
    let mut message = format!(
        "{}, {}",
        counted(steps, "step", "steps"),
        counted(transitions, "transition", "transitions")
    );
    let mut answer = Answer::new(About::Fact, net.name.to_string(), Status::Done, "")
        .with("steps", steps)
        .with("transitions", transitions);
    if let Some(reach) = &facts.reach {
        let most = if reach.exact { "" } else { "at most " };
        message += &match reach.situations {
            u128::MAX => ", more than 10^38 reachable situations".to_owned(),
            n => {
                let situations = counted(n, "reachable situation", "reachable situations");
                format!(", {most}{situations}")
            }
        };
        // A number that JSON readers can represent exactly, or else text.
        let situations = u64::try_from(reach.situations)
            .ok()
            .filter(|n| *n < 1 << 53)
            .map_or_else(|| json!(reach.situations.to_string()), |n| json!(n));
        answer = answer.with("situations", situations).with("exact", reach.exact);
    }
    let text = format!("{}: {message}\n", net.name);
    answer.message = message;
    session.answer(&answer, &text);
}

/// Reports which checks were carried out, and which were not, with the reasons.
fn looked_for(session: &Session, checked: &[Checked]) {
    for one in checked {
        let (status, message) = match &one.open {
            None => (Status::Done, "looked for".to_owned()),
            Some(why) => (Status::Open, why.to_string()),
        };
        let mut answer = Answer::new(About::Lint, one.check.name(), status, message);
        if let Some(why) = &one.open {
            answer = answer.with("reasons", vec![reason(why)]);
        }
        session.keep(&answer);
    }
    if !checked.is_empty() && !session.quiet {
        crate::print(&looked_for_text(checked));
    }
}

/// The text of [`looked_for`].
fn looked_for_text(checked: &[Checked]) -> String {
    let names =
        |all: &[&Checked]| all.iter().map(|one| one.check.name()).collect::<Vec<_>>().join(", ");
    let done: Vec<&Checked> = checked.iter().filter(|one| one.open.is_none()).collect();
    let mut parts = Vec::new();
    if !done.is_empty() {
        parts.push(format!("checked: {}", names(&done)));
    }
    let mut left: Vec<&Checked> = checked.iter().filter(|one| one.open.is_some()).collect();
    while let Some(first) = left.first().copied() {
        let (same, others): (Vec<_>, Vec<_>) =
            left.into_iter().partition(|one| one.open == first.open);
        let why = first.open.as_ref().map_or_else(String::new, |why| match why.option() {
            Some(option) => format!("{why}; {option} allows more"),
            None => why.to_string(),
        });
        parts.push(format!("not checked: {} ({why})", names(&same)));
        left = others;
    }
    format!("{}\n", parts.join(" · "))
}

/// Logic has no properties; reports what was read, and whether the test vectors of the file pass.
fn logic(session: &Session, design: &LogicDesign, mut found: Vec<Diagnostic>) -> Exit {
    found.extend(design.remarks());
    session.show(&found);
    if session.demands.refuse(&found) {
        return Exit::Errors;
    }
    if !session.quiet {
        let counted = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
        let mut text = match &design.logic {
            Some(logic) => format!(
                "{}: {}, {}, {}",
                design.interface.name,
                counted(logic.inputs.len(), "input"),
                counted(logic.outputs.len(), "output"),
                counted(logic.flops.len(), "flip-flop")
            ),
            None => design.interface.name.to_string(),
        };
        if let Ok(placement) = &design.placement {
            let terms: usize = placement.cells.iter().map(|cell| cell.sum.len()).sum();
            text += &format!(
                "; {}, {} with {}",
                placement.device.name,
                counted(placement.cells.len(), "macrocell"),
                counted(terms, "product term")
            );
        }
        crate::print(&format!("{text}\n"));
    }
    let Some(fuses) = &design.fuses else { return Exit::Done };
    let (failed, vectors) = (fuses.n_failed, fuses.n_vectors);
    if vectors == 0 {
        return Exit::Done;
    }
    let (status, message) = match failed {
        0 => (Status::Proved, "every test vector of the file passes".to_owned()),
        _ => {
            let fail = if failed == 1 { "fails" } else { "fail" };
            (Status::Refuted, format!("{failed} of the file's {vectors} test vectors {fail}"))
        }
    };
    let name = design.interface.name.to_string();
    let answer = Answer::new(About::Vectors, name, status, message.as_str())
        .with("vectors", vectors)
        .with("failed", failed);
    if failed == 0 {
        session.keep(&answer);
        return Exit::Done;
    }
    session.answer(&answer, &format!("refuted  {message}\n"));
    Exit::Refuted
}

/// Writes the chart's text with certificates for its library charts.
fn certify(
    session: &Session,
    design: &NetDesign,
    machine: Option<&'static Machine>,
    output: &Path,
    limits: &Limits,
    mut found: Vec<Diagnostic>,
) -> Result<Exit, Stop> {
    // The chart is the first text that is read.
    let mut certified = design.chart.as_ref().map(|chart| {
        grafsynth_driver::certify::certify(chart, machine, &session.sources, FileId(0), limits)
    });
    found.extend(certified.iter_mut().flat_map(|certified| certified.found.drain(..)));
    let Some(certified) = certified.filter(|certified| certified.charts > 0) else {
        session.show(&found);
        return Err(Stop::Input("there is no library chart in the file to certify".to_owned()));
    };
    session.show(&found);
    if session.demands.refuse(&found) {
        return Err(Stop::Errors);
    }
    if output.as_os_str() == "-" {
        crate::print(&certified.text);
    } else {
        files::write_named(vec![(output.to_owned(), certified.text.into_bytes())])?;
    }
    session.note(&format!(
        "certified {} of {}\n",
        counted(certified.properties, "property", "properties"),
        counted(certified.charts, "library chart", "library charts")
    ));
    // People have already seen the findings; programs get an answer for each property.
    let judged = certified.verdicts.iter().map(|Certifiable { name, of, net, outcome }| {
        let answer = |status, message: String| Answer {
            place: Some(name.span),
            ..Answer::new(About::Assert, format!("{name} of {of}"), status, message)
        };
        let (answer, exit) = match outcome {
            Outcome::Proved { by, states, .. } => {
                let answer = answer(Status::Proved, format!("proved by {}", proof_name(*by)));
                let answer = answer.proved_by(*by, &Scope::EveryStimulus).with("states", *states);
                (answer, Exit::Done)
            }
            Outcome::Refuted { stimulus, row, is_shortest } => {
                let answer = answer(Status::Refuted, format!("broken in row {row} of a stimulus"))
                    .with("row", *row)
                    .with("is_shortest", *is_shortest)
                    .witness(&grafsynth_sim::run(net, stimulus).to_csv());
                (answer, Exit::Refuted)
            }
            Outcome::Open(why) => {
                (answer(Status::Open, why.to_string()).open(why), session.demands.open(why))
            }
        };
        session.keep(&answer);
        exit
    });
    Ok(judged.fold(Exit::Done, Exit::worse))
}

/// A property as it is written in its source.
fn written(session: &Session, property: &Property) -> String {
    let span = property.meta.span;
    let source = session.sources.get(span.file);
    source.and_then(|source| source.text.get(span.range())).map_or_else(
        || property.name.clone(),
        |text| text.split_whitespace().collect::<Vec<_>>().join(" "),
    )
}

/// Reports the result of one property.
fn said(
    session: &Session,
    arguments: &Check,
    net: &Valid<Net>,
    property: &Property,
    outcome: &Outcome,
) -> Result<Exit, Stop> {
    let span = property.meta.span;
    let text = written(session, property);
    let tags = if property.meta.req.is_empty() {
        String::new()
    } else {
        format!(" [{}]", property.meta.req.join(", "))
    };
    let answer = |status, message: String| Answer {
        place: Some(span),
        requirements: property.meta.req.clone(),
        ..Answer::new(About::Assert, text.as_str(), status, message)
    };
    Ok(match outcome {
        Outcome::Proved { by, states, invariant } => {
            let answer = answer(Status::Proved, format!("proved by {}", proof_name(*by)))
                .proved_by(*by, &Scope::EveryStimulus)
                .with("states", *states);
            let answer = match invariant {
                Some(invariant) => answer.with("clauses", invariant.clauses.len()),
                None => answer,
            };
            let extent = match (states, invariant) {
                (_, Some(invariant)) => {
                    format!(", {}", counted(invariant.clauses.len(), "clause", "clauses"))
                }
                (0, None) => String::new(),
                (_, None) => format!(", {}", counted(*states, "state", "states")),
            };
            let how = format!("{}{extent}", proof_name(*by));
            session.answer(&answer, &format!("proved   {text}{tags} ({how})\n"));
            Exit::Done
        }
        Outcome::Refuted { stimulus, row, is_shortest } => {
            let trace = grafsynth_sim::run(net, stimulus);
            let shown = Evidence::of_assert(net, property, stimulus);
            let place = session.sources.describe(span);
            let mut answer = answer(Status::Refuted, format!("broken in row {row} of a stimulus"))
                .with("row", *row)
                .with("is_shortest", *is_shortest)
                .witness(&trace.to_csv());
            if let Some(broken) = &shown.broken {
                answer = answer.with("broken", evidence::broken_json(&session.sources, broken));
            }
            let rows = session.shown(arguments.trace.as_deref(), &shown, &[("", &trace)])?;
            let text = format!(
                "refuted  {text}{tags} at {place}, in row {row} of this trace:\n{}",
                rows.text
            );
            session.answer(&answer.traces(rows.files), &text);
            Exit::Refuted
        }
        Outcome::Open(why) => {
            let answer = answer(Status::Open, why.to_string()).open(why);
            session.answer(&answer, &format!("open     {text}{tags}: {why}\n"));
            session.demands.open(why)
        }
    })
}

/// Reports how long competing transitions wait for their turn: a bound under `priority-age`, and under any policy the cycle on which one starves.
fn waits(
    session: &Session,
    arguments: &Check,
    net: &Valid<Net>,
    explored: &Explored<'_>,
    limits: &Limits,
) -> Result<(), Stop> {
    let by_age = net.settings.policy == Policy::PriorityAge;
    // Without ages, only the report for machines has bounds, and people need to know who may wait for ever.
    if !by_age && !session.is_for_machines() && !grafsynth_verify::may_lose(net) {
        return Ok(());
    }
    // This check is secondary, so it must not take long.
    let limits = Limits { pairs: limits.pairs.min(200_000), ..limits.clone() };
    let waits = match explored.waiting(&limits) {
        Ok(waits) => waits,
        Err(why) => {
            let subject = "how long transitions wait for their turn";
            let answer = Answer::new(About::Bound, subject, Status::Open, why.to_string())
                .with("reasons", vec![reason(&why)]);
            if by_age && !session.quiet {
                session.answer(&answer, &format!("open     {subject}: {why}\n"));
            } else {
                session.keep(&answer);
            }
            return Ok(());
        }
    };
    for Waiting { transition, wait } in waits {
        let transition = &net.transitions[transition];
        let name = &transition.name;
        let place = Some(transition.meta.span);
        match wait {
            Wait::Bounded { turns, reactions, .. } => {
                let counted_turns = counted(turns as usize, "turn", "turns");
                let within = reactions.map_or_else(
                    || {
                        "; other transitions may keep the step active for any length of time"
                            .to_owned()
                    },
                    |most| {
                        let reactions = counted(most, "reaction", "reactions");
                        format!(", and fires within {reactions} while its receptivity is true")
                    },
                );
                let message = format!("waits for at most {counted_turns} of others{within}");
                let answer =
                    Answer::new(About::Bound, name.to_string(), Status::Proved, message.as_str())
                        .with("turns", turns)
                        .with("reactions", reactions);
                let answer = Answer { place, ..answer };
                if by_age {
                    session.answer(&answer, &format!("bound    {name} {message}\n"));
                } else {
                    session.keep(&answer);
                }
            }
            Wait::Starves { way, cycle } => {
                let from = counted(way.len(), "row", "rows");
                let last = counted(cycle.len(), "row", "rows");
                let mut whole = way.clone();
                cycle.rows().for_each(|row| whole.push(&row));
                let trace = grafsynth_sim::run(net, &whole);
                let message = format!("after {from}, a trace repeats its last {last} for ever");
                let answer = Answer::new(About::Bound, name.to_string(), Status::Done, message)
                    .with("starves", true)
                    .with("cycle", cycle.len())
                    .witness(&trace.to_csv());
                let shown = Evidence::of_run(net, &whole, None);
                let shown = session.shown(arguments.trace.as_deref(), &shown, &[("", &trace)])?;
                let text = format!(
                    "starves  {name}: after {from}, this trace repeats its last {last} for ever:\n{}",
                    shown.text
                );
                session.answer(&Answer { place, ..answer }.traces(shown.files), &text);
            }
        }
    }
    Ok(())
}

fn dump(session: &mut Session, input: &Input, pass: &str) -> Result<Exit, Stop> {
    let passes: Vec<&str> = grafsynth_ir::lower::passes().collect();
    if pass == "list" {
        crate::print(&passes.iter().map(|pass| format!("{pass}\n")).collect::<String>());
        return Ok(Exit::Done);
    }
    if !passes.contains(&pass) {
        let near = did_you_mean(pass, passes.iter().copied());
        return Err(Stop::Usage(format!(
            "unknown pass `{pass}`{near} (passes: {})",
            passes.join(", ")
        )));
    }
    let (design, found) = session.net(input)?;
    session.show(&found);
    let Some(chart) = &design.chart else {
        return Err(Stop::Input(
            "a .net file is already lowered, so no pass runs on it".to_owned(),
        ));
    };
    let costs = design.counted.as_ref().map(|counted| counted.costs.clone()).unwrap_or_default();
    match grafsynth_ir::lower::dump_after(chart, &costs, pass) {
        Some(net) => crate::print(&grafsynth_ir::text::print(&net)),
        None => return Err(Stop::Usage(format!("unknown pass `{pass}`"))),
    }
    Ok(Exit::Done)
}
