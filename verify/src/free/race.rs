//! A way of free-running parts that is no run of the net, as events and in words.

use grafsynth_ir::division::{Division, PartIndex};
use grafsynth_ir::net::{InputId, Net, VarId};
use grafsynth_sim::{FreeParts, Moment};

/// A way of the parts that is no run of the net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Race {
    /// What is different at its end.
    pub what: Unlike,
    /// What happens in each episode after reset. All but the last one end at rest.
    pub episodes: Vec<Vec<Event>>,
}

/// What is different from the net.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unlike {
    /// What is shown after reset.
    Reset,
    /// The net does not come to rest.
    NetMoves,
    /// From here on, the parts may never come to rest.
    PartsMove,
    /// An object, counted as in [`FreeParts::seen`], takes a value that it does not take in the net.
    Becomes(usize, i64),
    /// An object does not take this value, although it does in the net.
    Missing(usize, i64),
    /// The values at rest.
    Rest,
    /// The value of a variable at rest.
    Variable(VarId),
    /// An assert, by its place among the properties of the net, does not hold.
    Assert(usize),
}

/// What happens between two moments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// The plant changes an input.
    Change(InputId, i64),
    /// A part reacts.
    React {
        /// The part.
        part: PartIndex,
        /// The number of changes that it takes from each of its lines.
        takes: Vec<usize>,
        /// True if a tick passes in this reaction.
        tick: bool,
    },
}

impl Race {
    /// What is different, in words.
    #[must_use]
    pub fn what(&self, net: &Net) -> String {
        match self.what {
            Unlike::Reset => "row 0 differs".to_owned(),
            Unlike::NetMoves => "the chart itself does not come to rest".to_owned(),
            Unlike::PartsMove => "the parts may not come to rest".to_owned(),
            Unlike::Becomes(object, value) if object < net.outputs.len() => {
                format!("{} becomes {value}, unlike in the chart", named(net, object))
            }
            Unlike::Becomes(object, value) => {
                let becomes = if value == 0 { "inactive" } else { "active" };
                format!("{} becomes {becomes}, unlike in the chart", named(net, object))
            }
            Unlike::Missing(object, value) => {
                format!("{} does not become {value}, as it does in the chart", named(net, object))
            }
            Unlike::Rest => "the parts come to rest elsewhere".to_owned(),
            Unlike::Variable(var) => {
                format!("variable `{}` has another value than in the chart", net.vars[var].name)
            }
            Unlike::Assert(at) => match net.properties.get(at).map(|one| one.name.as_str()) {
                Some("") | None => "an assert does not hold".to_owned(),
                Some(name) => format!("assert `{name}` does not hold"),
            },
        }
    }

    /// How it comes to that: one sentence for each event from the start.
    #[must_use]
    pub fn trace(&self, net: &Net, division: &Division) -> Vec<String> {
        let mut parts = FreeParts::new(net, division);
        let mut moment = parts.reset();
        let mut words = Vec::new();
        for event in self.episodes.iter().flatten() {
            words.push(match event {
                Event::Change(input, value) => {
                    parts.change(&mut moment, *input, *value);
                    format!("input `{}` becomes {value}", net.inputs[*input].name)
                }
                Event::React { part, takes, tick } => {
                    let next = parts.react(&moment, *part, takes, u32::from(*tick));
                    let before = std::mem::replace(&mut moment, next);
                    reaction(net, division, &parts, (&before, &moment), event)
                }
            });
        }
        words
    }
}

/// The reaction of a part between two moments.
fn reaction(
    net: &Net,
    division: &Division,
    parts: &FreeParts<'_>,
    (before, after): (&Moment, &Moment),
    event: &Event,
) -> String {
    let Event::React { part, takes, tick } = event else { return String::new() };
    let Some(of_part) = division.parts.get(*part) else { return String::new() };
    let mut text = format!("`{}` reacts", of_part.name);
    if *tick {
        text += " to a tick";
    }
    let inputs = of_part.net.inputs.values().zip(parts.taken(after, *part)).zip(takes);
    let read: Vec<String> = inputs
        .filter(|(_, takes)| **takes > 0)
        .map(|((input, value), _)| format!("{} {value}", input.name))
        .collect();
    if !read.is_empty() {
        text += &format!(", reads {}", read.join(", "));
    }
    let (old, new) = (parts.seen(before), parts.seen(after));
    let news: Vec<String> = (0..)
        .zip(old.iter().zip(&new))
        .filter(|(_, (old, new))| old != new)
        .map(|(object, (_, new))| format!("{} {new}", named(net, object)))
        .collect();
    if !news.is_empty() {
        text += &format!(": {}", news.join(", "));
    }
    text
}

/// The name of an output, a step, or the fault.
fn named(net: &Net, object: usize) -> String {
    let output = net.outputs.values().nth(object);
    let step = object.checked_sub(net.outputs.len());
    match (output, step.and_then(|at| net.steps.values().nth(at))) {
        (Some(output), _) => format!("output `{}`", output.name),
        (None, Some(step)) => format!("step `{}`", step.name),
        (None, None) => "the fault".to_owned(),
    }
}
