//! `grafsynth diff OLD NEW`.

use super::compare_charts::{compared, different};
use crate::args::{Diff, Reading};
use crate::exit::Exit;
use crate::load::{Session, Stop};
use grafsynth_driver::diff::{Behaviour, Part};
use grafsynth_verify::verdict::Verdict;

pub(crate) fn run(session: &mut Session, arguments: &Diff) -> Result<Exit, Stop> {
    let reading = Reading { machine: arguments.machine, ..Reading::default() };
    let (old, found) = session.net_at(&arguments.old, &reading)?;
    session.show(&found);
    let (new, found) = session.net_at(&arguments.new, &reading)?;
    session.show(&found);
    let diff = grafsynth_driver::diff::diff(&old.net, &new.net, arguments.random, arguments.seed);
    let mut text = String::new();
    for Part { name, old, new } in &diff.parts {
        let word = match (old, new) {
            (Some(_), Some(_)) => "changed",
            (Some(_), None) => "gone",
            (None, _) => "new",
        };
        text.push_str(&format!("{word:<8} {name}\n"));
        for (sign, block) in [('-', old), ('+', new)] {
            for line in block.iter().flat_map(|block| block.lines()) {
                text.push_str(&format!("    {sign} {line}\n"));
            }
        }
    }
    let exit = match &diff.behaviour {
        Behaviour::Incomparable(why) => {
            text.push_str(&format!("behaviour not compared: {why}\n"));
            Exit::Refuted
        }
        Behaviour::Compared(common, answer) => {
            let same = if diff.parts.is_empty() { Exit::Done } else { Exit::Refuted };
            match answer {
                Verdict::Proved(by) => {
                    text.push_str(&format!("same behaviour: proved for every stimulus {by}\n"));
                    text.push_str(&compared(common));
                    same
                }
                Verdict::Open(why) => {
                    text.push_str(&format!(
                        "no difference in behaviour found, not proved: {why}\n"
                    ));
                    text.push_str(&compared(common));
                    same
                }
                Verdict::Refuted(apart) => {
                    text.push_str(&different(&old.net, &new.net, common, apart, "old", "new"));
                    Exit::Refuted
                }
            }
        }
    };
    crate::print(&text);
    Ok(exit)
}
