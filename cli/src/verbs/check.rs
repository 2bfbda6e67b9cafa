//! `grafsynth check FILE`.

use crate::args::Check;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use grafsynth_driver::read::Design;
use grafsynth_ir::Valid;
use grafsynth_ir::diag::any_error;
use grafsynth_ir::net::Net;
use grafsynth_verify::{Limits, Outcome};

/// Steps from which on a chart is large.
const LARGE: usize = 100;

pub(crate) fn run(session: &mut Session, arguments: &Check) -> Result<Exit, Stop> {
    if let Some(pass) = &arguments.dump_after {
        return dump(session, arguments, pass);
    }
    let (design, mut found) = session.design(&arguments.input)?;
    let Design::Net(design) = design else {
        session.show(&found);
        if !session.quiet {
            crate::print("no errors\n");
        }
        return Ok(Exit::Done);
    };
    let net = &design.net;
    let limits = Limits { pairs: arguments.limits.proof_limit, ..Limits::default() };
    // A large chart has more states than can be visited; what its structure shows is found without them.
    let visited = if net.steps.len() > LARGE { limits.pairs.min(100_000) } else { limits.pairs };
    let facts = grafsynth_verify::facts(net, &Limits { pairs: visited, ..limits.clone() });
    found.extend(grafsynth_verify::lints(net, &facts));
    if let Some(chart) = &design.chart {
        found.extend(grafsynth_driver::libraries::certificates(chart, &limits));
    }
    session.show(&found);
    let exit = properties(session, net, &limits);
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
    }
    Ok(exit)
}

/// Says of each property whether it holds.
fn properties(session: &Session, net: &Valid<Net>, limits: &Limits) -> Exit {
    let mut exit = Exit::Done;
    for verdict in grafsynth_verify::properties(net, limits) {
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
                let trace = grafsynth_sim::run(net, &stimulus).to_csv();
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
    match grafsynth_ir::lower::dump_after(chart, pass) {
        Some(net) => crate::print(&grafsynth_ir::text::print(&net)),
        None => return Err(Stop::Usage(format!("no pass is called `{pass}`"))),
    }
    Ok(Exit::Done)
}
