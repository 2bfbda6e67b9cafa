//! What is known of each output: proved, refuted or open, and what else the user should know of it. Data until it is printed.

use crate::judge::{CircuitsApart, EqualBy};
use grafsynth_backend_pld::MovedPin;
use grafsynth_sim::Stimulus;
use grafsynth_verify::equiv::{Counterexample, Verdict};
use grafsynth_verify::{Certificate, Dominance, Method, Open, OpenReason, Scope};

/// How sure we are of an output, the surest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// It does what the net does.
    Proved,
    /// No program can tell: the text is in a language that grafsynth does not read.
    NotChecked,
    /// It was not found out.
    Open,
    /// It does something else.
    Refuted,
}

impl Outcome {
    /// Its name, for people and machines.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Outcome::Proved => "proved",
            Outcome::NotChecked => "not checked",
            Outcome::Open => "open",
            Outcome::Refuted => "refuted",
        }
    }
}

/// What a build says of one of its outputs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutputReport {
    /// The name of the file.
    pub name: String,
    /// Whether it is the net.
    pub verdict: OutputVerdict,
    /// What else is to be said of it, in order.
    pub notes: Vec<Note>,
}

/// Whether an output is the net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OutputVerdict {
    /// It is, as this proof shows.
    Proved(OutputProof),
    /// It is not.
    Refuted(OutputFault),
    /// It was read back, and its equality is open.
    ReadBack(Open),
    /// It was not read back, nor run to the end.
    Open(Open),
    /// No program can tell: grafsynth does not read that language.
    NotChecked,
}

/// How an output was proved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OutputProof {
    /// The text of a net reads back as the same net.
    SameNet,
    /// A fuse map decodes to the same products in the same macrocells.
    SameProducts,
    /// A circuit, read back, is equal to the net for all that a chip sees.
    Circuit(Certificate),
    /// A circuit, read back, is equal to the circuit that it was made of.
    Rebuilt(EqualBy),
    /// A bitstream, read back, is equal to the Verilog that it was made of.
    Bitstream(EqualBy),
    /// Compiled C gives the net's rows in every state, under every input and these ticks.
    Run {
        /// States of net and C together.
        states: u64,
        /// Reactions compared.
        reactions: u64,
        /// For which stimuli.
        scope: Scope,
    },
}

/// Where an output is not the net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OutputFault {
    /// A cell of a trace differs after these reactions.
    Row {
        /// A stimulus that shows it in its last row.
        stimulus: Stimulus,
        /// The column.
        column: String,
        /// The cell in the chart.
        chart: String,
        /// The cell in the output.
        output: String,
        /// What the output is called: `the output`, `C`.
        of: &'static str,
    },
    /// It reads back as something else.
    ReadsBackAsAnother,
    /// A signal has no pin in what was read back.
    PinLost(String),
    /// A pin of a bitstream differs from the Verilog after these clocks.
    Clock {
        /// The pin.
        pin: String,
        /// How many clocks.
        clocks: usize,
    },
    /// It differs from the circuit that it was made of; says where.
    Rebuilt(CircuitsApart),
    /// Compiled C does not answer: it crashes, or does not end a reaction.
    NoAnswer(String),
}

/// What else a line says of an output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Note {
    /// A part of what a fuse map holds: macrocells, products, vectors; how to burn it.
    Burned(String),
    /// Whether the emergency dominates in every state of what was read back.
    Emergency(Dominance),
    /// Codes of steps and don't-cares.
    Codes(String),
    /// Illegal codes lead back, proved or needless.
    Safe(String),
    /// It was not proved that illegal codes lead back, and why.
    NotSafe(String),
    /// Pins are not assigned, since the design does not fit; what would fit.
    PinsOpen(String),
    /// An input or output whose pin is not in the order of declarations, and why.
    PinMoved(MovedPin),
    /// How micro-steps become clocks.
    Form(String),
    /// A history that has flip-flops of its own, and why.
    History {
        /// Its name.
        name: String,
        /// Why.
        why: String,
    },
    /// Inputs that arrive later.
    Synchronised {
        /// Pins with a synchroniser.
        pins: usize,
        /// Its flip-flops.
        stages: usize,
    },
    /// The chart's own C was left out when this was compiled and run.
    WithoutForeignCode,
    /// The macro that the user defines where an interrupt shares numbers with the chart; nothing of that was checked.
    CriticalSection(String),
    /// The quiescence gate was in front of the reactions that were compared.
    Gate,
    /// A style of C is wrong, by a fault of the tool, and another one is right.
    OtherStyle {
        /// Its name.
        style: &'static str,
        /// How sure that is.
        outcome: Outcome,
    },
    /// A style of C is wrong, by a fault of the tool, and no other style is right.
    NoStyle,
    /// What a tool remarked.
    Remark(String),
}

impl Note {
    /// Its name for machines.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Note::Burned(_) => "fuse-map",
            Note::Emergency(_) => "emergency",
            Note::Codes(_) => "codes",
            Note::Safe(_) => "safe",
            Note::NotSafe(_) => "not-safe",
            Note::PinsOpen(_) => "pins-open",
            Note::PinMoved(_) => "pin-moved",
            Note::Form(_) => "form",
            Note::History { .. } => "history",
            Note::Synchronised { .. } => "synchronised",
            Note::WithoutForeignCode => "without-foreign-code",
            Note::CriticalSection(_) => "critical-section",
            Note::Gate => "gate",
            Note::OtherStyle { .. } => "other-style",
            Note::NoStyle => "no-style",
            Note::Remark(_) => "remark",
        }
    }
}

impl OutputProof {
    /// Its name for machines.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            OutputProof::SameNet => "same-net",
            OutputProof::SameProducts => "same-products",
            OutputProof::Circuit(certificate) => match certificate.method {
                Method::Explicit { .. } => "enumeration",
                Method::Symbolic { .. } => "induction",
            },
            OutputProof::Rebuilt(_) => "equal-circuits",
            OutputProof::Bitstream(_) => "equal-bitstream",
            OutputProof::Run { .. } => "enumeration",
        }
    }
}

impl std::fmt::Display for Note {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Note::Burned(text)
            | Note::Codes(text)
            | Note::Safe(text)
            | Note::Form(text)
            | Note::Remark(text) => f.write_str(text),
            Note::Emergency(found) => write!(f, "{found}"),
            Note::PinMoved(moved) => write!(f, "{moved}"),
            Note::NotSafe(why) => write!(f, "not proved safe: {why}"),
            Note::PinsOpen(advice) => {
                write!(f, "pins not assigned: the design does not fit; {advice}")
            }
            Note::History { name, why } => {
                write!(f, "history `{name}` has flip-flops of its own: {why}")
            }
            Note::CriticalSection(name) => {
                write!(
                    f,
                    "with interrupts, define {name}: without it numbers of more than 8 bits can tear"
                )
            }
            Note::Gate => f.write_str("with the gate of --gate"),
            Note::OtherStyle { style, outcome } => {
                let how = match outcome {
                    Outcome::Proved => "is proved equal",
                    Outcome::NotChecked | Outcome::Open | Outcome::Refuted => {
                        "is equal in what was tested"
                    }
                };
                write!(f, "this is a fault of grafsynth: the style `{style}` {how}")
            }
            Note::NoStyle => f.write_str("this is a fault of grafsynth"),
            Note::WithoutForeignCode => f.write_str("without the chart's own C (see --trust-code)"),
            Note::Synchronised { pins, stages } => {
                write!(f, "{pins} inputs arrive {stages} clocks later, by synchronisers")
            }
        }
    }
}

impl OutputReport {
    /// A report without notes.
    #[must_use]
    pub fn new(name: &str, verdict: OutputVerdict) -> Self {
        OutputReport { name: name.to_owned(), verdict, notes: Vec::new() }
    }

    /// A proved output.
    #[must_use]
    pub fn proved(name: &str, proof: OutputProof) -> Self {
        OutputReport::new(name, OutputVerdict::Proved(proof))
    }

    /// An output that is wrong.
    #[must_use]
    pub fn refuted(name: &str, fault: OutputFault) -> Self {
        OutputReport::new(name, OutputVerdict::Refuted(fault))
    }

    /// An output that was neither read back nor run to the end.
    #[must_use]
    pub fn open(name: &str, why: impl Into<OpenReason>) -> Self {
        OutputReport::new(name, OutputVerdict::Open(Open::because(why)))
    }

    /// The report for what the verifier says of a text that was read back.
    #[must_use]
    pub fn of_verdict(name: &str, verdict: Verdict) -> Self {
        let verdict = match verdict {
            Verdict::Proved(certificate) => {
                OutputVerdict::Proved(OutputProof::Circuit(certificate))
            }
            Verdict::Refuted(Counterexample { stimulus, difference }) => {
                OutputVerdict::Refuted(OutputFault::Row {
                    stimulus,
                    column: difference.column,
                    chart: difference.left,
                    output: difference.right,
                    of: "the output",
                })
            }
            Verdict::Open(open) => OutputVerdict::ReadBack(open),
        };
        OutputReport::new(name, verdict)
    }

    /// How sure we are, all notes included.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        let own = match self.verdict {
            OutputVerdict::Proved(_) => Outcome::Proved,
            OutputVerdict::NotChecked => Outcome::NotChecked,
            OutputVerdict::ReadBack(_) | OutputVerdict::Open(_) => Outcome::Open,
            OutputVerdict::Refuted(_) => Outcome::Refuted,
        };
        let of_note = |note: &Note| match note {
            Note::Emergency(Dominance::Refuted { .. }) => Outcome::Refuted,
            Note::Emergency(Dominance::Open(_)) | Note::NotSafe(_) => Outcome::Open,
            Note::Emergency(Dominance::Proved { .. })
            | Note::Burned(_)
            | Note::Codes(_)
            | Note::Safe(_)
            | Note::PinsOpen(_)
            | Note::PinMoved(_)
            | Note::Form(_)
            | Note::History { .. }
            | Note::Synchronised { .. }
            | Note::WithoutForeignCode
            | Note::CriticalSection(_)
            | Note::Gate
            | Note::OtherStyle { .. }
            | Note::NoStyle
            | Note::Remark(_) => Outcome::Proved,
        };
        self.notes.iter().map(of_note).fold(own, Outcome::max)
    }

    /// Its parts as a person reads them: the verdict, then each note.
    pub fn parts(&self) -> impl Iterator<Item = String> + '_ {
        std::iter::once(self.verdict.to_string()).chain(self.notes.iter().map(ToString::to_string))
    }
}

impl std::fmt::Display for OutputVerdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            OutputVerdict::Proved(proof) => write!(f, "{proof}"),
            OutputVerdict::Refuted(fault) => write!(f, "{fault}"),
            OutputVerdict::ReadBack(open) => write!(f, "read back; {open}"),
            OutputVerdict::Open(open) => match open.tested {
                Some(_) if open.reasons == [OpenReason::NotAsked] => write!(f, "{open}"),
                Some(_) => write!(f, "not proved: {open}"),
                None => write!(f, "not checked: {open}"),
            },
            OutputVerdict::NotChecked => {
                write!(f, "not checked: grafsynth does not read it back")
            }
        }
    }
}

impl std::fmt::Display for OutputProof {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            OutputProof::SameNet => write!(f, "read back: the same net"),
            OutputProof::SameProducts => {
                write!(f, "read back and decoded: the same products in the same macrocells")
            }
            OutputProof::Circuit(certificate) => write!(f, "read back and {certificate}"),
            OutputProof::Rebuilt(by) => write!(f, "read back and {by}"),
            OutputProof::Bitstream(EqualBy::Enumerated { states, outputs }) => write!(
                f,
                "read back and proved equal to the Verilog by enumeration: {states} states, {outputs} pins compared under every input"
            ),
            OutputProof::Bitstream(EqualBy::Functions(n)) => {
                write!(f, "read back and proved equal to the Verilog by induction: {n} functions")
            }
            OutputProof::Run { states, reactions, scope } => write!(
                f,
                "compiled and proved by enumeration: {states} states, {reactions} reactions, {scope}"
            ),
        }
    }
}

impl std::fmt::Display for OutputFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            OutputFault::Row { stimulus, column, chart, output, of } => write!(
                f,
                "differs from the chart after {} reactions: {column} is `{chart}` in the chart and `{output}` in {of}",
                stimulus.len()
            ),
            OutputFault::ReadsBackAsAnother => write!(f, "reads back as another net"),
            OutputFault::PinLost(name) => write!(f, "`{name}` is on no pin of the bitstream"),
            OutputFault::Clock { pin, clocks } => {
                write!(f, "is not the Verilog: `{pin}` differs after {clocks} clocks")
            }
            OutputFault::Rebuilt(how) => write!(f, "differs from the text: {how}"),
            OutputFault::NoAnswer(how) => f.write_str(how),
        }
    }
}

impl std::fmt::Display for OutputReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let parts: Vec<String> = self.parts().collect();
        write!(f, "{:<24} {}", self.name, parts.join("; "))
    }
}
