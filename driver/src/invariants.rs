//! Inductive invariants as a text file, which proves the asserts of a chart without a search.
//!
//! ```text
//! grafsynth invariants 1
//! # chart hopper
//! assert 2
//! times free
//! micro-steps 1
//! clause !step:t1_load !step:t2_load
//! clause !step:t1_load !step:free
//! clause !step:t2_load !step:free
//! ```
//! Asserts are counted from 1 in the order of the chart. In each clause, at least one of the bits is 1, or 0 after `!`. Numbers are named bit by bit:
//! `var:n:0:3` is bit 3 of element 0 of `n`, after the minimum of its range is subtracted. Lines that begin with `#` are comments.

use grafsynth_ir::Gather;
use grafsynth_ir::Valid;
use grafsynth_ir::net::{Net, Property, PropertyRole};
use grafsynth_ir::program::Origin;
use grafsynth_verify::{
    Directed, Invariant, Limits, Outcome, PropertyVerdict, Refused, StateBit, Times,
};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The first line of a file.
const FORMAT: &str = "grafsynth invariants 1";

/// The invariants of a chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The file.
    pub text: String,
    /// The number of asserts with an invariant.
    pub asserts: usize,
    /// The indices in [`Net::properties`] of asserts that are proved but have no invariant, with the reason.
    pub missing: Vec<(usize, String)>,
}

/// The invariants of all proved asserts. An assert that was proved by another method is proved once more by property-directed reachability.
#[must_use]
pub fn write(net: &Valid<Net>, verdicts: &[PropertyVerdict], limits: &Limits) -> Written {
    let facts = grafsynth_verify::structural_facts(net);
    let mut written = Written {
        text: format!("{FORMAT}\n# chart {}\n", net.name),
        asserts: 0,
        missing: Vec::new(),
    };
    for PropertyVerdict { property, outcome } in verdicts {
        let Outcome::Proved { invariant, .. } = outcome else { continue };
        let asserted = &net.properties[*property];
        let found = match invariant {
            Some(invariant) => Directed::Proved(invariant.clone()),
            None => grafsynth_verify::directed(net, Some(&facts), limits, asserted),
        };
        match found {
            Directed::Proved(invariant) => {
                section(net, &mut written.text, *property, &invariant);
                written.asserts += 1;
            }
            Directed::Open(why) => written.missing.push((*property, why)),
            Directed::Refuted { .. } | Directed::Unconfirmed => {
                unreachable!("no stimulus violates a proved assert")
            }
        }
    }
    written
}

/// The indices of the asserts in the properties of a net, in order.
fn asserts(net: &Net) -> Vec<usize> {
    let all = net.properties.iter().enumerate();
    all.filter(|(_, one)| one.role == PropertyRole::Assert).map(|(at, _)| at).collect()
}

fn section(net: &Net, text: &mut String, property: usize, invariant: &Invariant) {
    let number = asserts(net).iter().take_while(|at| **at < property).count() + 1;
    let times = match invariant.times {
        Times::Free => "free",
        Times::Counted => "counted",
    };
    let _ = writeln!(text, "assert {number}\ntimes {times}\nmicro-steps {}", invariant.micro_steps);
    for clause in &invariant.clauses {
        text.push_str("clause");
        for (bit, value) in clause {
            let _ = write!(text, " {}{}", if *value { "" } else { "!" }, name(net, *bit));
        }
        text.push('\n');
    }
}

/// The name of a bit. Names of the chart with white space are written with `_` instead.
fn name(net: &Net, StateBit { origin, element, bit }: StateBit) -> String {
    let step = |id| format!("{}", net.steps[id].name);
    let action = |id| format!("{}", net.actions[id].name);
    let number = |kind: &str, name: String| format!("{kind}:{name}:{bit}");
    let name = match origin {
        Origin::Step(id) => format!("step:{}", step(id)),
        Origin::Elapsed(id) => number("elapsed", step(id)),
        Origin::LastElapsed(id) => number("last-elapsed", step(id)),
        Origin::Var(id) => format!("var:{}:{element}:{bit}", net.vars[id].name),
        Origin::Edge(id) => format!("edge:{}", id.index() + 1),
        Origin::Timer(id) => number("timer", format!("{}", id.index() + 1)),
        Origin::TimerCondition(id) => format!("timer-runs:{}", id.index() + 1),
        Origin::Older(a, b) => format!("older:{}:{}", step(a), step(b)),
        Origin::TaskIndex(id) => number("task", step(id)),
        Origin::ActionQ(id) => format!("action:{}", action(id)),
        Origin::ActionLatch(id, part) => format!("latch:{}:{part:?}", action(id)),
        Origin::ActionTimer(id, part) => number("action-timer", format!("{}:{part:?}", action(id))),
        Origin::Pending(id) => format!("pending:{}", net.inputs[id].name),
        // The second encoding stores nothing else.
        _ => format!("other:{origin:?}:{element}:{bit}"),
    };
    name.split_whitespace().collect::<Vec<_>>().join("_")
}

/// The reason why a file proves nothing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damaged {
    /// The line, counted from 1.
    pub line: usize,
    /// The reason, for a message.
    pub why: String,
}

/// The invariant of one assert in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Section {
    /// The index of the assert in [`Net::properties`].
    pub property: usize,
    /// The claimed invariant.
    pub invariant: Invariant,
    /// The line of the assert, and those of the clauses.
    lines: (usize, Vec<usize>),
}

/// Reads a file of invariants of this chart. Nothing in it is trusted: see [`recheck`].
///
/// # Errors
/// The first line that is not part of such a file.
pub fn read(net: &Valid<Net>, text: &str) -> Result<Vec<Section>, Damaged> {
    let bits: BTreeMap<String, StateBit> =
        grafsynth_verify::state_bits(net).into_iter().map(|bit| (name(net, bit), bit)).gather();
    let asserts = asserts(net);
    let mut lines = text.lines().zip(1..).filter(|(line, _)| !line.trim_start().starts_with('#'));
    let damaged = |line: usize, why: &str| Damaged { line, why: why.to_owned() };
    if lines.next().is_none_or(|(line, _)| line != FORMAT) {
        return Err(damaged(1, "this is not a file that `check --invariants` writes"));
    }
    let mut sections: Vec<Section> = Vec::new();
    for (line, at) in lines {
        let mut words = line.split_whitespace();
        let Some(word) = words.next() else { continue };
        let words: Vec<&str> = words.collect();
        if word == "assert" {
            let number = one_number(&words).and_then(|n| asserts.get(n.checked_sub(1)?).copied());
            let property =
                number.ok_or_else(|| damaged(at, "no assert of the chart has this number"))?;
            let invariant =
                Invariant { times: Times::Counted, micro_steps: 1, clauses: Vec::new() };
            sections.push(Section { property, invariant, lines: (at, Vec::new()) });
            continue;
        }
        let section =
            sections.last_mut().ok_or_else(|| damaged(at, "expected `assert` and its number"))?;
        let invariant = &mut section.invariant;
        match (word, words.as_slice()) {
            ("times", ["free"]) => invariant.times = Times::Free,
            ("times", ["counted"]) => invariant.times = Times::Counted,
            ("micro-steps", words) => {
                let number = one_number(words).and_then(|n| u32::try_from(n).ok());
                invariant.micro_steps = number.ok_or_else(|| damaged(at, "expected a number"))?;
            }
            ("clause", words) => {
                let mut clause = Vec::new();
                for word in words {
                    let negated = word.strip_prefix('!');
                    let bit = bits.get(negated.unwrap_or(word)).ok_or_else(|| Damaged {
                        line: at,
                        why: format!("the state of the chart has no bit `{word}`"),
                    })?;
                    clause.push((*bit, negated.is_none()));
                }
                invariant.clauses.push(clause);
                section.lines.1.push(at);
            }
            _ => return Err(damaged(at, "expected `assert`, `times`, `micro-steps` or `clause`")),
        }
    }
    Ok(sections)
}

fn one_number(words: &[&str]) -> Option<usize> {
    match words {
        [word] => word.parse().ok(),
        _ => None,
    }
}

/// Proves an assert by the invariant of a file, without any search.
///
/// # Errors
/// The line of the file that is wrong.
pub fn recheck(net: &Valid<Net>, section: &Section, limits: &Limits) -> Result<(), Damaged> {
    let property: &Property = &net.properties[section.property];
    grafsynth_verify::recheck(net, limits, property, &section.invariant).map_err(|why| {
        let clause = match why {
            Refused::NoSuchBit(at) | Refused::Reset(at) | Refused::NotInductive(at) => Some(at),
            Refused::NotSafe | Refused::Unchecked(_) => None,
        };
        let (first, clauses) = &section.lines;
        let line = clause.and_then(|at| clauses.get(at)).unwrap_or(first);
        Damaged { line: *line, why: why.to_string() }
    })
}
