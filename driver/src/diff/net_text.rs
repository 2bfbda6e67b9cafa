//! The changes between the texts of two nets: for designs that were read without a chart.

use super::{Change, ChangeKind};
use grafsynth_ir::Gather;
use grafsynth_ir::net::Net;
use grafsynth_ir::text;
use std::collections::{BTreeMap, BTreeSet};

/// The blocks that only one net has or whose text differs, in the order of the old net, followed by those of the new one.
pub(super) fn changes(old: &Net, new: &Net) -> Vec<Change> {
    let (before, after) = (blocks(old), blocks(new));
    let later: BTreeMap<&str, &str> =
        after.iter().map(|(name, text)| (name.as_str(), text.as_str())).gather();
    let earlier: BTreeSet<&str> = before.iter().map(|(name, _)| name.as_str()).gather();
    let gone_or_changed = before.iter().filter_map(|(name, text)| match later.get(name.as_str()) {
        Some(now) if now == text => None,
        Some(now) => Some(change(ChangeKind::Changed, name, Some(text), Some(now))),
        None => Some(change(ChangeKind::Removed, name, Some(text), None)),
    });
    let added = after
        .iter()
        .filter(|(name, _)| !earlier.contains(name.as_str()))
        .map(|(name, text)| change(ChangeKind::Added, name, None, Some(text)));
    gone_or_changed.chain(added).collect()
}

fn change(kind: ChangeKind, name: &str, old: Option<&str>, new: Option<&str>) -> Change {
    Change {
        kind,
        name: name.to_owned(),
        old_name: None,
        old: old.map(str::to_owned).into_iter().collect(),
        new: new.map(str::to_owned).into_iter().collect(),
        moved: None,
    }
}

/// The blocks of a net's text: each begins with a line that is not indented; the first two words of that line are its name.
fn blocks(net: &Net) -> Vec<(String, String)> {
    let mut blocks: Vec<(String, String)> = Vec::new();
    let mut seen: BTreeMap<String, usize> = BTreeMap::new();
    for line in text::print(net).lines().filter(|line| !line.trim().is_empty()) {
        match blocks.last_mut() {
            Some((_, text)) if line.starts_with([' ', '\t', '}']) => {
                text.push('\n');
                text.push_str(line);
            }
            _ => {
                let mut name: String =
                    line.split_whitespace().take(2).collect::<Vec<_>>().join(" ");
                let count = seen.entry(name.clone()).or_insert(0);
                *count += 1;
                if *count > 1 {
                    name = format!("{name} ({count})");
                }
                blocks.push((name, line.to_owned()));
            }
        }
    }
    blocks
}
