//! The result for each output: proved, refuted or open, with notes for the user. It remains data until it is printed.

use crate::evidence::Evidence;
use crate::judge::{CircuitsApart, EqualBy, Judged};
use crate::run::{logic_trace, net_trace};
use grafsynth_backend_pld::MovedPin;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, counted};
use grafsynth_sim::{Stimulus, Trace};
use grafsynth_verify::c_code::Induction;
use grafsynth_verify::equiv::{Counterexample, Verdict};
use grafsynth_verify::{Certificate, Dominance, Method, Open, OpenReason, Scope, Tested};

/// The result for an output, from best to worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// It is equivalent to the net.
    Proved,
    /// It cannot be checked: grafsynth does not read the language of the text.
    NotChecked,
    /// The result is unknown.
    Open,
    /// It differs from the net.
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

/// The report of a build for one output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutputReport {
    /// The name of the file.
    pub name: String,
    /// Whether it equals the net.
    pub verdict: OutputVerdict,
    /// Additional notes, in order.
    pub notes: Vec<Note>,
}

/// Whether an output equals the net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OutputVerdict {
    /// The output equals the net, by this proof.
    Proved(OutputProof),
    /// The output differs from the net.
    Refuted(OutputFault),
    /// It was read back, and whether it equals the net is open.
    ReadBack(Open),
    /// Whether it equals the net is open: it was not read back, or its run did not finish.
    Open(Open),
    /// It cannot be checked: grafsynth does not read that language.
    NotChecked,
}

/// How an output was proved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OutputProof {
    /// The text of a net reads back as the same net.
    SameNet,
    /// A fuse map decodes to the same products in the same macrocells.
    SameProducts,
    /// A circuit, read back, is equivalent to the net in everything that a chip can observe.
    Circuit(Certificate),
    /// A circuit, read back, equals the circuit that it was made from.
    Rebuilt(EqualBy),
    /// A bitstream, read back, equals the Verilog that it was made from.
    Bitstream(EqualBy),
    /// Compiled C gives the rows of the net in every state, for every input and the ticks of the scope.
    Run {
        /// The number of states of net and C together.
        states: u64,
        /// The number of compared reactions.
        reactions: u64,
        /// The stimuli that this applies to.
        scope: Scope,
        /// True if undefined behaviour is excluded: by the proof of the text, or because the program would have stopped at it.
        is_defined: bool,
    },
    /// The text of the C, read back, gives the rows of the net for every stimulus of any length.
    Text {
        /// The size of the proof.
        induction: Induction,
        /// The test of the compiled text, or the reason why there was none.
        ran: Result<Tested, OpenReason>,
    },
    /// The same for edited text, which was not compiled.
    Edited {
        /// The size of the proof.
        induction: Induction,
        /// The test of the tree, or the reason why there was none.
        ran: Result<Tested, OpenReason>,
    },
}

/// The difference between an output and the net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum OutputFault {
    /// A cell of a trace differs.
    Row(Box<RowFault>),
    /// It reads back as another net.
    ReadsBackAsAnother,
    /// A signal has no pin in the design that was read back.
    PinLost(String),
    /// A bitstream differs from the Verilog that it was made from.
    Bitstream(Box<CircuitsApart>),
    /// It differs from the circuit that it was made from.
    Rebuilt(Box<CircuitsApart>),
    /// Compiled C does not respond: it crashes, or a reaction does not end.
    NoAnswer(String),
}

/// A stimulus with which an output differs from the chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowFault {
    /// The stimulus; its last row shows the difference.
    pub stimulus: Stimulus,
    /// The column.
    pub column: String,
    /// The value in the chart.
    pub chart: String,
    /// The value in the output.
    pub output: String,
    /// The side that was run.
    pub of: Ran,
    /// The trace of the output with this stimulus; `None` if it could not be run again.
    pub trace: Option<Trace>,
}

/// The form of an output that was run for the comparison with the chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ran {
    /// The circuit that was read back.
    Circuit,
    /// The compiled C.
    C,
}

impl Ran {
    /// Its name in the header of a column.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Ran::Circuit => "output",
            Ran::C => "C",
        }
    }
}

impl std::fmt::Display for Ran {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Ran::Circuit => "the output",
            Ran::C => "C",
        })
    }
}

impl OutputFault {
    /// The relevant part of the run that shows the fault, if there is one. `net` is the chart of the build, or the pins of logic.
    #[must_use]
    pub fn evidence(&self, net: &Valid<Net>) -> Option<Evidence> {
        let (first, second) = self.sides();
        match self {
            OutputFault::Row(fault) => Some(match &fault.trace {
                Some(trace) => {
                    let chart = net_trace(net, &fault.stimulus);
                    let (ours, theirs) = ((first, &chart), (second, trace));
                    Evidence::of_traces(net, &fault.stimulus, &fault.column, ours, theirs)
                }
                None => Evidence::of_run(net, &fault.stimulus, Some(&fault.column)),
            }),
            OutputFault::Bitstream(apart) | OutputFault::Rebuilt(apart) => {
                Some(Evidence::of_circuits(apart, first, second))
            }
            _ => None,
        }
    }

    /// The traces that show the fault, each with the name of what was run: first that of the chart or of the source, then that of the output.
    #[must_use]
    pub fn traces(&self, net: &Valid<Net>) -> Vec<(&'static str, Trace)> {
        let (first, second) = self.sides();
        match self {
            OutputFault::Row(fault) => {
                let chart = (first, net_trace(net, &fault.stimulus));
                std::iter::once(chart).chain(fault.trace.clone().map(|it| (second, it))).collect()
            }
            OutputFault::Bitstream(apart) | OutputFault::Rebuilt(apart) => {
                let traces = apart.traces.as_deref().cloned();
                traces.map_or(Vec::new(), |(ours, theirs)| vec![(first, ours), (second, theirs)])
            }
            _ => Vec::new(),
        }
    }

    /// The names of what was compared.
    fn sides(&self) -> (&'static str, &'static str) {
        match self {
            OutputFault::Row(fault) => ("chart", fault.of.title()),
            OutputFault::Bitstream(_) => ("Verilog", "bitstream"),
            OutputFault::Rebuilt(_) => ("text", "output"),
            _ => ("chart", "output"),
        }
    }

    /// True if this fault of another output is the same finding: the same run shows the same values.
    #[must_use]
    pub fn is_same(&self, other: &OutputFault) -> bool {
        match (self, other) {
            (OutputFault::Row(a), OutputFault::Row(b)) => {
                (&a.stimulus, &a.column, &a.chart, &a.output)
                    == (&b.stimulus, &b.column, &b.chart, &b.output)
            }
            (OutputFault::Rebuilt(a), OutputFault::Rebuilt(b)) => {
                (&a.output, a.left, &a.inputs, &a.rows) == (&b.output, b.left, &b.inputs, &b.rows)
            }
            (_, _) => false,
        }
    }

    /// The fault of several outputs ([`OutputFault::is_same`]), as a predicate in the plural.
    #[must_use]
    pub fn of_several(&self) -> String {
        match self {
            OutputFault::Row(fault) => fault.sentence("differ", "the outputs"),
            OutputFault::Rebuilt(apart) => {
                format!("differ from the text: {}", apart.sentence("text", "outputs"))
            }
            _ => self.to_string(),
        }
    }
}

impl RowFault {
    fn sentence(&self, verb: &str, of: &str) -> String {
        let RowFault { stimulus, column, chart, output, .. } = self;
        let after = match stimulus.len() {
            0 => "at power-up".to_owned(),
            1 => "after 1 reaction".to_owned(),
            n => format!("after {n} reactions"),
        };
        format!(
            "{verb} from the chart {after}: {column} is `{chart}` in the chart and `{output}` in {of}"
        )
    }
}

/// A note on an output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Note {
    /// The contents of a fuse map: macrocells, products, vectors; or the command that programs it.
    Burned(String),
    /// Whether the emergency dominates in every state of the design that was read back.
    Emergency(Dominance),
    /// The state encoding and don't-cares.
    Codes(String),
    /// Illegal codes return to legal ones, by proof or because there are none.
    Safe(String),
    /// It is not proved that illegal codes return, with the reason.
    NotSafe(String),
    /// Pins are not assigned because the design does not fit, with advice unless it is given elsewhere.
    PinsOpen(String),
    /// An input or output that is not on the pin given by the order of declarations, and the reason.
    PinMoved(MovedPin),
    /// How the micro-steps of the chart become clocks of the circuit.
    Form(String),
    /// A history that has its own flip-flops, with the reason.
    History {
        /// Its name.
        name: String,
        /// The reason.
        why: String,
    },
    /// Inputs that arrive with a delay.
    Synchronised {
        /// The number of pins with a synchroniser.
        pins: usize,
        /// The number of flip-flops of each synchroniser.
        stages: usize,
    },
    /// The C code of the chart's author was left out of the compiled and tested program.
    WithoutForeignCode,
    /// The macro that the user must define if an interrupt shares numbers with the chart; this was not checked.
    CriticalSection(String),
    /// The gate (`--gate`) was active in the compared reactions.
    Gate,
    /// A style of C is wrong because of a bug in grafsynth, and another one is right.
    OtherStyle {
        /// Its name.
        style: &'static str,
        /// The result for the other style.
        outcome: Outcome,
    },
    /// A style of C is wrong because of a bug in grafsynth, and no other style is right.
    NoStyle,
    /// The C differs from the chart, and contains code of the chart's author, which was trusted.
    TrustedCode,
    /// Functions of the text that a proof does not cover.
    NotCompared(Vec<String>),
    /// A remark of an external tool.
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
            Note::TrustedCode => "trusted-code",
            Note::NotCompared(_) => "not-compared",
            Note::Remark(_) => "remark",
        }
    }

    /// The result that the note implies for the output.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        match self {
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
            | Note::TrustedCode
            | Note::NotCompared(_)
            | Note::Remark(_) => Outcome::Proved,
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
            OutputProof::Text { .. } | OutputProof::Edited { .. } => "induction",
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
            Note::NotCompared(names) => write!(f, "not compared: {}", names.join(", ")),
            Note::PinMoved(moved) => write!(f, "{moved}"),
            Note::NotSafe(why) => write!(f, "not proved safe: {why}"),
            Note::PinsOpen(advice) if advice.is_empty() => {
                f.write_str("pins not assigned: the design does not fit")
            }
            Note::PinsOpen(advice) => {
                write!(f, "pins not assigned: the design does not fit; {advice}")
            }
            Note::History { name, why } => {
                write!(f, "history `{name}` has its own flip-flops: {why}")
            }
            Note::CriticalSection(name) => {
                write!(
                    f,
                    "with interrupts, define {name}: otherwise numbers of more than 8 bits can be read half-written"
                )
            }
            Note::Gate => f.write_str("each reaction runs through the gate (--gate)"),
            Note::OtherStyle { style, outcome } => {
                let how = match outcome {
                    Outcome::Proved => "is proved equal",
                    Outcome::NotChecked | Outcome::Open | Outcome::Refuted => {
                        "showed no difference in the tests"
                    }
                };
                write!(f, "this is a bug in grafsynth: the style `{style}` {how}")
            }
            Note::NoStyle => f.write_str("this is a bug in grafsynth"),
            Note::TrustedCode => f.write_str(
                "the chart's own C may have side effects or undefined behaviour (it is trusted with --trust-code); if it has neither, this is a bug in grafsynth",
            ),
            Note::WithoutForeignCode => f.write_str("without the chart's own C (see --trust-code)"),
            Note::Synchronised { pins, stages } => {
                let inputs = counted(*pins, "input", "inputs");
                let clocks = counted(*stages, "clock", "clocks");
                write!(f, "synchronisers delay {inputs} by {clocks}")
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

    /// An incorrect output.
    #[must_use]
    pub fn refuted(name: &str, fault: OutputFault) -> Self {
        OutputReport::new(name, OutputVerdict::Refuted(fault))
    }

    /// An output that was not read back, or whose run did not finish.
    #[must_use]
    pub fn open(name: &str, why: impl Into<OpenReason>) -> Self {
        OutputReport::new(name, OutputVerdict::Open(Open::because(why)))
    }

    /// The report for the verdict of the verifier on the circuit of a text that was read back.
    #[must_use]
    pub fn of_verdict(name: &str, net: &Valid<Net>, read_back: &Logic, verdict: Verdict) -> Self {
        let verdict = match verdict {
            Verdict::Proved(certificate) => {
                OutputVerdict::Proved(OutputProof::Circuit(certificate))
            }
            Verdict::Refuted(Counterexample { stimulus, difference }) => {
                let trace = logic_trace(net, read_back, &stimulus).ok();
                OutputVerdict::Refuted(OutputFault::Row(Box::new(RowFault {
                    stimulus,
                    column: difference.column,
                    chart: difference.left,
                    output: difference.right,
                    of: Ran::Circuit,
                    trace,
                })))
            }
            Verdict::Open(open) => OutputVerdict::ReadBack(open),
        };
        OutputReport::new(name, verdict)
    }

    /// The report for the comparison of a circuit, read back, with the circuit that it was made from.
    pub(crate) fn of_judged(
        name: &str,
        judged: Judged,
        proof: fn(EqualBy) -> OutputProof,
        fault: fn(Box<CircuitsApart>) -> OutputFault,
    ) -> Self {
        let verdict = match judged {
            Judged::Equal(by) => OutputVerdict::Proved(proof(by)),
            Judged::Different(apart) => OutputVerdict::Refuted(fault(Box::new(apart))),
            Judged::Open(open) => OutputVerdict::ReadBack(open),
        };
        OutputReport::new(name, verdict)
    }

    /// The worst of the verdict and of the results that the notes imply.
    #[must_use]
    pub fn outcome(&self) -> Outcome {
        let own = match self.verdict {
            OutputVerdict::Proved(_) => Outcome::Proved,
            OutputVerdict::NotChecked => Outcome::NotChecked,
            OutputVerdict::ReadBack(_) | OutputVerdict::Open(_) => Outcome::Open,
            OutputVerdict::Refuted(_) => Outcome::Refuted,
        };
        self.notes.iter().map(Note::outcome).fold(own, Outcome::max)
    }

    /// Its parts as text: the verdict, then each note.
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
                "read back and proved equal to the Verilog by enumeration: {}, {} compared under every input",
                counted(*states, "state", "states"),
                counted(*outputs, "pin", "pins")
            ),
            OutputProof::Bitstream(EqualBy::Functions(n)) => {
                let functions = counted(*n, "function", "functions");
                write!(f, "read back and proved equal to the Verilog by induction: {functions}")
            }
            OutputProof::Run { states, reactions, scope, is_defined } => {
                write!(
                    f,
                    "compiled and proved by enumeration: {}, {}, {scope}",
                    counted(*states, "state", "states"),
                    counted(*reactions, "reaction", "reactions")
                )?;
                if !is_defined {
                    f.write_str(
                        " (undefined behaviour was not looked for: the C compiler has no sanitizers)",
                    )?;
                }
                Ok(())
            }
            OutputProof::Text { induction, ran } => {
                write!(f, "read back and {induction}, {}", Scope::EveryStimulus)?;
                if induction.is_of_image {
                    f.write_str(" (the interpreter of the image is not part of the proof)")?;
                }
                match ran {
                    Ok(tested) => write!(f, "; compiled and {tested}"),
                    Err(why) => write!(f, "; not compiled: {why}"),
                }
            }
            OutputProof::Edited { induction, ran } => {
                write!(f, "{induction}, {}", Scope::EveryStimulus)?;
                match ran {
                    Ok(tested) => write!(f, "; executed without a compiler and {tested}"),
                    Err(why) => write!(f, "; not executed: {why}"),
                }
            }
        }
    }
}

impl std::fmt::Display for OutputFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            OutputFault::Row(fault) => {
                f.write_str(&fault.sentence("differs", &fault.of.to_string()))
            }
            OutputFault::ReadsBackAsAnother => write!(f, "reads back as a different net"),
            OutputFault::PinLost(name) => write!(f, "`{name}` has no pin in the bitstream"),
            OutputFault::Bitstream(apart) => {
                write!(f, "differs from the Verilog: {}", apart.sentence("Verilog", "bitstream"))
            }
            OutputFault::Rebuilt(apart) => {
                write!(f, "differs from the text: {}", apart.sentence("text", "output"))
            }
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
