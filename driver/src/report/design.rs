//! The design in brief.

use super::document::{Block, Table};
use super::{Subject, counted};
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::Evolution;

pub(super) fn write(subject: &Subject<'_>) -> Vec<Block> {
    let net = subject.net;
    let hash: String =
        crate::jedec::signature(net).iter().map(|byte| format!("{byte:02x}")).collect();
    let mut table = Table::new(["Property", "Value"]);
    let mut say = |what: &str, is: String| table.row([what.to_owned(), is]);
    say(if subject.is_logic { "logic" } else { "chart" }, net.name.text.clone());
    say("made by", format!("grafsynth {}", env!("CARGO_PKG_VERSION")));
    if subject.is_logic {
        say("inputs, outputs", format!("{}, {}", net.inputs.len(), net.outputs.len()));
        return vec![Block::Table(table)];
    }
    say("signature", format!("{hash} (FNV-1a, 64 bits, of the net's text)"));
    if let Some(device) = &net.board.device {
        say("board", format!("{}, {}", device.text, counted(net.board.pins.len(), "pin", "pins")));
    }
    say(
        "steps, transitions",
        format!(
            "{}, {}",
            net.steps.values().filter(|step| !step.hidden).count(),
            net.transitions.len()
        ),
    );
    say("inputs, outputs", format!("{}, {}", net.inputs.len(), net.outputs.len()));
    let policy = net.settings.policy.word();
    let evolution = match net.settings.evolution {
        Evolution::Single => "single".to_owned(),
        Evolution::Stable { limit } => {
            format!("stable, at most {}", counted(limit as usize, "micro-step", "micro-steps"))
        }
    };
    say("conflict, evolution", format!("{policy}, {evolution}"));
    say("tick", ticks(net.settings.tick_ns));
    if let Some(reach) = &subject.reach {
        let how = match reach.by {
            Proof::Explicit => "enumerated",
            Proof::Symbolic => "counted in a decision diagram",
            Proof::Structural => "from the structure",
            Proof::Induction => "by induction",
            Proof::Directed => "by property-directed reachability",
        };
        let sure = if reach.exact { how.to_owned() } else { format!("at most; {how}") };
        say("reachable situations", format!("{} ({sure})", reach.situations));
    }
    vec![Block::Table(table)]
}

/// A duration in the largest unit that divides it.
fn ticks(ns: u64) -> String {
    let units = [(1_000_000_000, "s"), (1_000_000, "ms"), (1_000, "us"), (1, "ns")];
    let (unit, name) =
        units.into_iter().find(|(unit, _)| ns.is_multiple_of(*unit)).unwrap_or((1, "ns"));
    format!("{} {name}", ns / unit)
}
