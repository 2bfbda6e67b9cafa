//! `grafsynth diff OLD NEW`.

use crate::args::{Diff, Reading};
use crate::exit::Exit;
use crate::load::{Session, Stop};
use grafsynth_driver::diff::{Behaviour, Part};

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
        Behaviour::Same { states } => {
            text.push_str(&format!("the same behaviour: proved over {states} pairs of states\n"));
            if diff.parts.is_empty() { Exit::Done } else { Exit::Refuted }
        }
        Behaviour::SameAsFarAsSeen { reactions } => {
            text.push_str(&format!(
                "no difference in behaviour in {reactions} random reactions (not proved)\n"
            ));
            if diff.parts.is_empty() { Exit::Done } else { Exit::Refuted }
        }
        Behaviour::NothingInCommon => {
            text.push_str("no output, variable or set of steps in common\n");
            Exit::Refuted
        }
        Behaviour::Different { stimulus, difference, is_shortest } => {
            let shortest = if *is_shortest { "shortest " } else { "" };
            text.push_str(&format!(
                "different behaviour: scan {}, {}: `{}` in the old, `{}` in the new, under the {shortest}stimulus\n",
                difference.row, difference.column, difference.left, difference.right
            ));
            for line in stimulus.to_csv(&old.net).lines() {
                text.push_str(&format!("    {line}\n"));
            }
            Exit::Refuted
        }
    };
    crate::print(&text);
    Ok(exit)
}
