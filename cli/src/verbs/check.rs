//! `grafsynth check FILE`.

use crate::args::Check;
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop};
use grafsynth_backend_c::cost::Machine;
use grafsynth_driver::logic::LogicDesign;
use grafsynth_driver::read::{Design, NetDesign};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::net::{Net, Policy};
use grafsynth_ir::{Diagnostic, FileId, Valid};
use grafsynth_verify::{Checked, Limits, Outcome, Wait, Waiting};
use std::path::Path;

/// Steps from which on a chart is large.
const LARGE: usize = 100;

pub(crate) fn run(session: &mut Session, arguments: &Check) -> Result<Exit, Stop> {
    if let Some(pass) = &arguments.dump_after {
        return dump(session, arguments, pass);
    }
    let (design, mut found) = session.design(&arguments.input)?;
    let design = match design {
        Design::Net(design) => design,
        Design::Logic(design) => return Ok(logic(session, &design, found)),
    };
    let net = &design.net;
    let limits = Limits { pairs: arguments.limits.proof_limit, ..Limits::default() };
    // A large chart has more states than can be visited; what its structure shows is found without them.
    let visited = if net.steps.len() > LARGE { limits.pairs.min(100_000) } else { limits.pairs };
    let visited = Limits { pairs: visited, ..limits.clone() };
    let facts = grafsynth_verify::facts(net, &visited);
    let findings = grafsynth_verify::findings(net, &facts, &visited);
    found.extend(findings.found);
    if arguments.notes.iter().any(|what| what == "conflicts") {
        found.extend(findings.notes);
    }
    found.extend(grafsynth_driver::trust::unseen(net));
    let machine = arguments.input.reading.machine;
    if let Some(output) = &arguments.certify {
        return certify(session, &design, machine, output, &limits, found);
    }
    if let Some(chart) = &design.chart {
        found.extend(grafsynth_driver::libraries::certificates(chart, machine, &limits));
    }
    session.show(&found);
    let exit = properties(session, net, &limits);
    waits(session, net, &limits);
    if any_error(&found) {
        return Ok(Exit::Errors);
    }
    if !session.quiet {
        crate::print(&format!(
            "{}: {} steps, {} transitions{}\n",
            net.name,
            net.steps.len(),
            net.transitions.len(),
            facts.reach.as_ref().map_or_else(String::new, |reach| {
                let most = if reach.exact { "" } else { "at most " };
                match reach.situations {
                    u128::MAX => ", more than 10^38 reachable situations".to_owned(),
                    n => format!(", {most}{n} reachable situations"),
                }
            })
        ));
        if !findings.checked.is_empty() {
            crate::print(&looked_for(&findings.checked));
        }
    }
    Ok(exit)
}

/// The line that says what was looked for, and what was not and why.
fn looked_for(checked: &[Checked]) -> String {
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

/// Logic has no properties; what was read is said.
fn logic(session: &Session, design: &LogicDesign, mut found: Vec<Diagnostic>) -> Exit {
    found.extend(design.remarks());
    session.show(&found);
    if any_error(&found) {
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
    if fuses.n_failed > 0 {
        session.tell(&format!(
            "refuted  {} of the file's {} test vectors do not pass\n",
            fuses.n_failed, fuses.n_vectors
        ));
        return Exit::Refuted;
    }
    Exit::Done
}

/// Writes the chart's text with certificates for the library charts in it.
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
        return Err(Stop::Usage("there is no library chart in the file to certify".to_owned()));
    };
    session.show(&found);
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
    Ok(Exit::Done)
}

fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// Says of each property whether it holds.
fn properties(session: &Session, net: &Valid<Net>, limits: &Limits) -> Exit {
    let (net, mut exit) = match grafsynth_verify::with_emergency(net) {
        Ok(net) => (net, Exit::Done),
        Err(found) => {
            session.show(&found);
            session.tell("open     emergency: its condition cannot stand in a property\n");
            (net.clone(), Exit::Open)
        }
    };
    for verdict in grafsynth_verify::properties(&net, limits) {
        let property = &net.properties[verdict.property];
        let place = session.sources.describe(property.meta.span);
        let text = session
            .sources
            .get(property.meta.span.file)
            .and_then(|source| source.text.get(property.meta.span.range()))
            .map_or_else(
                || property.name.clone(),
                |text| text.split_whitespace().collect::<Vec<_>>().join(" "),
            );
        let tags = if property.meta.req.is_empty() {
            String::new()
        } else {
            format!(" [{}]", property.meta.req.join(", "))
        };
        match verdict.outcome {
            Outcome::Proved { by, states, .. } => {
                if !session.quiet {
                    crate::print(&format!("proved   {text}{tags} ({by:?}, {states} states)\n"));
                }
            }
            Outcome::Refuted { stimulus, row, .. } => {
                let trace = grafsynth_sim::run(&net, &stimulus).to_csv();
                session.tell(&format!("refuted  {text}{tags} at {place}, in row {row} of\n"));
                for line in trace.lines() {
                    session.tell(&format!("    {line}\n"));
                }
                exit = exit.max(Exit::Refuted);
            }
            Outcome::Open(why) => {
                session.tell(&format!("open     {text}{tags}: {why}\n"));
                if exit == Exit::Done {
                    exit = Exit::Open;
                }
            }
        }
    }
    exit
}

/// Says how long transitions that compete wait for their turn: a bound under `priority-age`, and under any policy the cycle on which one starves.
fn waits(session: &Session, net: &Valid<Net>, limits: &Limits) {
    if session.quiet {
        return;
    }
    // It is asked in passing, so it may not take long.
    let limits = Limits { pairs: limits.pairs.min(200_000), ..limits.clone() };
    let by_age = net.settings.policy == Policy::PriorityAge;
    let waits = match grafsynth_verify::waiting(net, &limits) {
        Ok(waits) => waits,
        Err(why) if by_age => {
            crate::print(&format!("open     how long transitions wait for their turn: {why}\n"));
            return;
        }
        Err(_) => return,
    };
    for Waiting { transition, wait } in waits {
        let name = &net.transitions[transition].name;
        match wait {
            Wait::Bounded { turns, reactions, .. } if by_age => {
                let turns = counted(turns as usize, "turn", "turns");
                let within = reactions.map_or_else(
                    || "; others may keep the step as long as they like".to_owned(),
                    |most| {
                        format!(", and fires within {most} reactions while its receptivity holds")
                    },
                );
                crate::print(&format!(
                    "bound    {name} waits for at most {turns} of others{within}\n"
                ));
            }
            Wait::Bounded { .. } => {}
            Wait::Starves { way, cycle } => {
                let from = counted(way.len(), "row", "rows");
                crate::print(&format!("starves  {name}: after {from} over and over, in"));
                let mut whole = way.clone();
                cycle.rows().for_each(|row| whole.push(&row));
                let trace = grafsynth_sim::run(net, &whole).to_csv();
                let lines: Vec<&str> = trace.lines().collect();
                crate::print(&format!(" the last {} of\n", counted(cycle.len(), "row", "rows")));
                for line in lines {
                    crate::print(&format!("    {line}\n"));
                }
            }
        }
    }
}

fn dump(session: &mut Session, arguments: &Check, pass: &str) -> Result<Exit, Stop> {
    let passes: Vec<&str> = grafsynth_ir::lower::passes().collect();
    if pass == "list" {
        crate::print(&passes.iter().map(|pass| format!("{pass}\n")).collect::<String>());
        return Ok(Exit::Done);
    }
    if !passes.contains(&pass) {
        let near = grafsynth_ir::diag::nearest(pass, passes.iter().copied())
            .map(|near| format!(", did you mean `{near}`?"))
            .unwrap_or_default();
        return Err(Stop::Usage(format!(
            "no pass is called `{pass}`{near} (there are {})",
            passes.join(", ")
        )));
    }
    let (design, found) = session.net(&arguments.input)?;
    session.show(&found);
    let Some(chart) = &design.chart else {
        return Err(Stop::Usage("a .net file has passed all passes already".to_owned()));
    };
    let costs = design.counted.as_ref().map(|counted| counted.costs.clone()).unwrap_or_default();
    match grafsynth_ir::lower::dump_after(chart, &costs, pass) {
        Some(net) => crate::print(&grafsynth_ir::text::print(&net)),
        None => return Err(Stop::Usage(format!("no pass is called `{pass}`"))),
    }
    Ok(Exit::Done)
}
