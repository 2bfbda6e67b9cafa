//! Answers as data: proved, refuted or open, with the stimuli to which they apply and the reasons for an open answer.
//!
//! A comparison with a net returns a [`Verdict`]. It becomes text only where it is printed, so that people and machines get the same answer.

use grafsynth_ir::counted;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Coverage, MICRO_STEPS};
use itertools::Itertools as _;
use std::fmt;

/// The answer to a question: proved with the proof `P`, refuted by the witness `W`, or open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict<P, W> {
    /// The statement is true, with its proof.
    Proved(P),
    /// The statement is false, with a witness.
    Refuted(W),
    /// Neither proved nor refuted.
    Open(Open),
}

/// The stimuli that an answer covers. A proof without its scope would be a claim about stimuli that were not examined.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Scope {
    /// Every stimulus that the contract allows: any `dt`, any inputs that satisfy the assumptions.
    #[default]
    EveryStimulus,
    /// Stimuli in which no reaction takes more than one tick. For a chip these are all stimuli (semantics §9), for C they are not.
    OneTick,
    /// Stimuli whose reactions take these numbers of ticks.
    Ticks(Vec<u32>),
    /// Stimuli in which each `dt` is 0 or 1, or reaches a time threshold, the tick before it or the tick after it.
    Thresholds,
}

impl Scope {
    /// The name of the scope for machines.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Scope::EveryStimulus => "every-stimulus",
            Scope::OneTick => "one-tick",
            Scope::Ticks(_) => "ticks",
            Scope::Thresholds => "thresholds",
        }
    }
}

impl fmt::Display for Scope {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Scope::EveryStimulus => write!(f, "for every stimulus"),
            Scope::OneTick => write!(f, "for at most one tick per reaction"),
            Scope::Ticks(ticks) => {
                let ticks = ticks.iter().map(ToString::to_string).join(" ");
                write!(f, "for dt {ticks}")
            }
            Scope::Thresholds => write!(f, "for the dt at and around each threshold"),
        }
    }
}

/// The reason why a question remained open.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OpenReason {
    /// An exploration reached its limit of pairs of a state and an input row.
    Pairs {
        /// The limit.
        limit: u64,
        /// The number of states found before the search ended.
        states: usize,
    },
    /// An exploration reached its limit of states.
    States {
        /// The limit.
        limit: usize,
    },
    /// Too many input rows are possible in one state.
    Rows {
        /// The limit.
        limit: u64,
    },
    /// An input has too many values to try all of them.
    InputValues {
        /// The name of the input.
        input: String,
        /// The number of values.
        values: u64,
    },
    /// The assumptions read too many inputs to try all of them.
    Assumptions,
    /// Too many inputs to enumerate.
    Inputs {
        /// The number of inputs.
        inputs: usize,
    },
    /// A method does not support this design, or reached its limit; the text gives the cause and its location.
    Method(String),
    /// The statement is proved for these stimuli, and unknown for all others.
    OnlyFor(Scope),
    /// An enumeration found the statement true for these stimuli; it is unknown for all others.
    RunOnlyFor {
        /// The stimuli.
        scope: Scope,
        /// The number of states.
        states: u64,
        /// The number of reactions compared.
        reactions: u64,
    },
    /// Some stimulus violates the property, but no such stimulus was found.
    Unfound,
    /// Programs that are needed for the answer are not installed.
    ToolMissing(Vec<String>),
    /// A needed program failed; contains its output.
    ToolFailed(String),
    /// The user requested no proof.
    NotAsked,
}

impl OpenReason {
    /// The name of the reason for machines.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            OpenReason::Pairs { .. } => "too-many-pairs",
            OpenReason::States { .. } => "too-many-states",
            OpenReason::Rows { .. } => "too-many-rows",
            OpenReason::InputValues { .. } => "too-many-values",
            OpenReason::Assumptions => "assumptions-too-wide",
            OpenReason::Inputs { .. } => "too-many-inputs",
            OpenReason::Method(_) => "method",
            OpenReason::OnlyFor(_) | OpenReason::RunOnlyFor { .. } => "scope",
            OpenReason::Unfound => "witness-not-found",
            OpenReason::ToolMissing(_) => "tool-missing",
            OpenReason::ToolFailed(_) => "tool-failed",
            OpenReason::NotAsked => "not-asked",
        }
    }

    /// The command-line option that would settle more such questions, if there is one.
    #[must_use]
    pub fn option(&self) -> Option<&'static str> {
        match self {
            OpenReason::Pairs { .. } => Some("--proof-limit"),
            OpenReason::States { .. } | OpenReason::Rows { .. } => Some("--effort"),
            _ => None,
        }
    }
}

impl fmt::Display for OpenReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            OpenReason::Pairs { limit, states } => {
                let states = counted(*states, "state", "states");
                write!(f, "more than {limit} pairs of a state and an input ({states} so far)")
            }
            OpenReason::States { limit } => write!(f, "more than {limit} states"),
            OpenReason::Rows { limit } => {
                write!(f, "more than {limit} rows of inputs are possible in one state")
            }
            OpenReason::InputValues { input, values } => {
                write!(f, "input `{input}` has {values} values")
            }
            OpenReason::Assumptions => {
                write!(f, "the assumptions read too many inputs to try all of them")
            }
            OpenReason::Inputs { inputs } => {
                write!(f, "{inputs} inputs are too many to enumerate")
            }
            OpenReason::Method(why) => f.write_str(why),
            OpenReason::OnlyFor(scope) => write!(f, "proved {scope} only"),
            OpenReason::RunOnlyFor { scope, states, reactions } => {
                let states = counted(*states, "state", "states");
                let reactions = counted(*reactions, "reaction", "reactions");
                write!(f, "proved {scope} only ({states}, {reactions})")
            }
            OpenReason::Unfound => {
                write!(f, "a stimulus that violates it exists, but was not found")
            }
            OpenReason::ToolMissing(tools) => write!(f, "{} not installed", tools.join(", ")),
            OpenReason::ToolFailed(text) => f.write_str(text),
            OpenReason::NotAsked => write!(f, "not proved, as requested"),
        }
    }
}

/// Converts the sentence of a method that gives its reason only as text.
impl From<String> for OpenReason {
    fn from(why: String) -> Self {
        OpenReason::Method(why)
    }
}

/// An open question: why each method failed, and how well the answer was tested instead.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Open {
    /// The reasons, in the order in which the methods were tried.
    pub reasons: Vec<OpenReason>,
    /// The random reactions that found no difference; `None` if there were none.
    pub tested: Option<Tested>,
}

impl Open {
    /// An open question without any test.
    #[must_use]
    pub fn because(reason: impl Into<OpenReason>) -> Self {
        Open { reasons: vec![reason.into()], tested: None }
    }

    /// Adds the test that was made instead of a proof.
    #[must_use]
    pub fn tested(self, tested: Tested) -> Self {
        Open { tested: Some(tested), ..self }
    }
}

impl fmt::Display for Open {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts: Vec<String> = self.reasons.iter().map(ToString::to_string).collect();
        parts.extend(self.tested.as_ref().map(ToString::to_string));
        f.write_str(&parts.join("; "))
    }
}

/// The extent of a test. A test is not a proof: it covers only the reactions that were executed.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Tested {
    /// The number of reactions that were compared.
    pub reactions: u64,
    /// The number of transitions that fired in these reactions.
    pub fired: usize,
    /// The number of transitions in the net.
    pub transitions: usize,
    /// The names of the transitions that never fired.
    pub never: Vec<String>,
    /// True if reactions took so many micro-steps that fewer were run than requested.
    pub is_cut_short: bool,
}

impl Tested {
    /// The coverage of directed random reactions of a net.
    #[must_use]
    pub fn of(net: &Net, coverage: &Coverage) -> Self {
        let never = coverage.never.iter().map(|id| net.transitions[*id].name.text.clone());
        Tested {
            reactions: coverage.reactions,
            fired: coverage.fired,
            transitions: net.transitions.len(),
            never: never.collect(),
            is_cut_short: coverage.is_cut_short,
        }
    }
}

/// The maximum number of transitions that one line lists as never fired.
const SHOWN: usize = 8;

/// A number with its digits in groups of three.
fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

impl fmt::Display for Tested {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = if self.reactions == 1 { "reaction" } else { "reactions" };
        write!(f, "tested: {} {word}", grouped(self.reactions))?;
        if self.is_cut_short {
            write!(f, " (stopped early after {} micro-steps)", grouped(MICRO_STEPS))?;
        }
        if self.transitions > 0 {
            write!(f, ", {} of {} transitions fired", self.fired, self.transitions)?;
        }
        if !self.never.is_empty() {
            let more = self.never.len().saturating_sub(SHOWN);
            let names = self.never.iter().take(SHOWN).map(String::as_str).join(", ");
            write!(f, " (never: {names}")?;
            if more > 0 {
                write!(f, " and {more} more")?;
            }
            f.write_str(")")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_answer_says_why_and_what_was_tested() {
        let tested = Tested {
            reactions: 10_000,
            fired: 41,
            transitions: 43,
            never: vec!["t7".to_owned(), "t19".to_owned()],
            is_cut_short: false,
        };
        let open = Open::because(OpenReason::States { limit: 500 }).tested(tested);
        assert_eq!(
            open.to_string(),
            "more than 500 states; tested: 10 000 reactions, 41 of 43 transitions fired (never: t7, t19)"
        );
    }

    #[test]
    fn names_beyond_the_eighth_are_counted() {
        let never: Vec<String> = (0..11).map(|n| format!("t{n}")).collect();
        let text = Tested { reactions: 1, transitions: 11, never, ..Tested::default() }.to_string();
        assert!(text.ends_with("t6, t7 and 3 more)"), "{text}");
    }
}
