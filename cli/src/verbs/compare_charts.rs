//! `grafsynth compare A B` of two charts: a proof for every stimulus, or a test on some.

use super::sim::stimulus;
use crate::args::Compare;
use crate::exit::Exit;
use crate::load::{Session, Stop};
use grafsynth_driver::compare as driver_compare;
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Difference, MAX_DT};
use grafsynth_verify::Limits;
use grafsynth_verify::pair::{Apart, Common, charts_by_chance, charts_equal, charts_on};
use grafsynth_verify::verdict::Verdict;

pub(crate) fn run(
    session: &mut Session,
    arguments: &Compare,
    left: &Valid<Net>,
    right: &Valid<Net>,
) -> Result<Exit, Stop> {
    let common = match driver_compare::common(left, right) {
        Ok(common) => common,
        Err(found) => {
            session.show(&found);
            return Ok(Exit::Errors);
        }
    };
    if let Some(path) = arguments.stimulus.as_deref() {
        let Some(stimulus) = stimulus(session, left, Some(path), None, arguments.seed, MAX_DT)?
        else {
            return Ok(Exit::Usage);
        };
        let found = charts_on(left, right, &common, &stimulus);
        return Ok(match found.difference {
            Some(difference) => {
                crate::print(&format!("different: {}\n", cells(&difference, "first", "second")));
                Exit::Refuted
            }
            None => {
                let mut text = format!("no difference on this stimulus: {} rows", found.compared);
                if found.compared < stimulus.len() {
                    text += &format!(
                        " of {}; row {} is none that both charts allow, or follows from what one leaves open",
                        stimulus.len(),
                        found.compared + 1
                    );
                }
                say(session, &format!("{text}\n{}", compared(&common)));
                Exit::Done
            }
        });
    }
    if let Some(reactions) = arguments.random.or(arguments.no_proof.then_some(10_000)) {
        let found = charts_by_chance(left, right, &common, reactions, arguments.seed, MAX_DT);
        return Ok(match found {
            Err(apart) => {
                crate::print(&different(left, right, &common, &apart, "first", "second"));
                Exit::Refuted
            }
            Ok(tested) => {
                say(
                    session,
                    &format!(
                        "no difference found in {} reactions\n{tested}\n{}",
                        tested.reactions,
                        compared(&common)
                    ),
                );
                Exit::Done
            }
        });
    }
    Ok(match charts_equal(left, right, &common, &Limits::default(), arguments.seed) {
        Verdict::Proved(by) => {
            say(session, &format!("equal: proved for every stimulus {by}\n{}", compared(&common)));
            Exit::Done
        }
        Verdict::Refuted(apart) => {
            crate::print(&different(left, right, &common, &apart, "first", "second"));
            Exit::Refuted
        }
        Verdict::Open(why) => {
            say(
                session,
                &format!(
                    "open: no difference found, not proved equal: {why}\n{}",
                    compared(&common)
                ),
            );
            Exit::Open
        }
    })
}

fn say(session: &Session, text: &str) {
    if !session.quiet {
        crate::print(text);
    }
}

/// What a comparison speaks of and what not, by name.
pub(crate) fn compared(common: &Common) -> String {
    let names: Vec<&str> = common.columns.iter().map(|column| column.name.as_str()).collect();
    let mut text = format!("compared: {}\n", names.join(", "));
    for omitted in &common.omitted {
        text += &format!("{omitted}\n");
    }
    text
}

fn cells(difference: &Difference, first: &str, second: &str) -> String {
    let Difference { row, column, left, right } = difference;
    format!("scan {row}, {column}: `{left}` in the {first}, `{right}` in the {second}")
}

/// Where two charts differ, and a stimulus that shows it.
pub(crate) fn different(
    left: &Net,
    right: &Net,
    common: &Common,
    apart: &Apart,
    first: &str,
    second: &str,
) -> String {
    let shortest = if apart.is_shortest { "shortest " } else { "" };
    let mut text = format!("different: {}\n", cells(&apart.difference, first, second));
    let (ours, theirs) = (apart.left.to_csv(left), apart.right.to_csv(right));
    let mut show = |title: &str, stimulus: &str| {
        text += &format!("{title}\n");
        for line in stimulus.lines() {
            text += &format!("    {line}\n");
        }
    };
    // Both take the same file if they have the same inputs, whatever the order of its columns.
    if common.inputs.iter().all(|input| input.left.is_some() && input.right.is_some()) {
        show(&format!("under the {shortest}stimulus"), &ours);
    } else {
        show(&format!("under the {shortest}stimulus of the {first}"), &ours);
        show(&format!("and of the {second}"), &theirs);
    }
    text
}
