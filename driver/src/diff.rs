//! What changed between two charts: their parts, and what they do.

use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, text};
use grafsynth_verify::Limits;
use grafsynth_verify::pair::{Answer, Common, Incomparable, charts_equal};
use std::collections::{BTreeMap, BTreeSet};

/// What changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diff {
    /// Parts that only one has, or that read otherwise, in the order of the old chart and then of the new one.
    pub parts: Vec<Part>,
    /// What they do.
    pub behaviour: Behaviour,
}

/// A part of a net that changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Kind and name, such as `step p1`.
    pub name: String,
    /// Its text in the old net; none if it is new.
    pub old: Option<String>,
    /// Its text in the new net; none if it is gone.
    pub new: Option<String>,
}

/// Whether two charts do the same.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Behaviour {
    /// The answer, in the columns that both have.
    Compared(Box<Common>, Answer),
    /// They cannot be compared.
    Incomparable(Incomparable),
}

/// Compares two nets; where nothing can be proved, in so many random reactions.
#[must_use]
pub fn diff(old: &Valid<Net>, new: &Valid<Net>, random: usize, seed: u64) -> Diff {
    let limits = Limits { random_rows: random, ..Limits::default() };
    let behaviour = match Common::of(old, new) {
        Ok(common) => {
            let answer = charts_equal(old, new, &common, &limits, seed);
            Behaviour::Compared(Box::new(common), answer)
        }
        Err(why) => Behaviour::Incomparable(why),
    };
    Diff { parts: parts(old, new), behaviour }
}

/// The blocks of a net's text: a line that is not indented begins one; its first two words are its name.
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

fn parts(old: &Net, new: &Net) -> Vec<Part> {
    let (before, after) = (blocks(old), blocks(new));
    let later: BTreeMap<&str, &str> =
        after.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    let earlier: BTreeSet<&str> = before.iter().map(|(name, _)| name.as_str()).collect();
    let gone_or_changed = before.iter().filter_map(|(name, text)| match later.get(name.as_str()) {
        Some(now) if now == text => None,
        now => Some(Part {
            name: name.clone(),
            old: Some(text.clone()),
            new: now.map(|now| (*now).to_owned()),
        }),
    });
    let added = after
        .iter()
        .filter(|(name, _)| !earlier.contains(name.as_str()))
        .map(|(name, text)| Part { name: name.clone(), old: None, new: Some(text.clone()) });
    gone_or_changed.chain(added).collect()
}
