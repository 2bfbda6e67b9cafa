//! An answer of the tool: the question, the result, and its basis.

use grafsynth_driver::judge::CircuitsApart;
use grafsynth_driver::report::{Outcome, OutputFault, OutputProof, OutputReport, OutputVerdict};
use grafsynth_ir::Span;
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::Net;
use grafsynth_sim::Difference;
use grafsynth_verify::{Open, OpenReason, Scope, Tested};
use serde_json::{Map, Value, json};

/// The subject of a question.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum About {
    /// An `assert`, or a guarantee of an emergency.
    Assert,
    /// A kind of finding that was checked for.
    Lint,
    /// A number about a design.
    Fact,
    /// How long a transition waits for its turn.
    Bound,
    /// Whether a file of a build equals the chart.
    Output,
    /// Whether two designs, or an engine and the chart, are equal.
    Equality,
    /// The test vectors of a fuse map.
    Vectors,
    /// A part that only one of two charts has, or that differs.
    Part,
    /// A trace to be replayed.
    Replay,
}

impl About {
    /// Its name for machines.
    pub(crate) fn name(self) -> &'static str {
        match self {
            About::Assert => "assert",
            About::Lint => "lint",
            About::Fact => "fact",
            About::Bound => "bound",
            About::Output => "output",
            About::Equality => "equality",
            About::Vectors => "vectors",
            About::Part => "part",
            About::Replay => "replay",
        }
    }

    /// A short description.
    pub(crate) fn title(self) -> &'static str {
        match self {
            About::Assert => "what the chart must guarantee",
            About::Lint => "what was checked",
            About::Fact => "a fact about the design",
            About::Bound => "how long a transition waits",
            About::Output => "an output is equivalent to the chart",
            About::Equality => "two designs are equivalent",
            About::Vectors => "the test vectors of a fuse map pass",
            About::Part => "a part changed",
            About::Replay => "a trace matches the chart",
        }
    }
}

/// The result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Status {
    /// It is true, by a proof.
    Proved,
    /// It is false.
    Refuted,
    /// The result is unknown.
    Open,
    /// It cannot be checked.
    NotChecked,
    /// There was nothing to prove: a test or a check ran, or a fact is reported.
    Done,
}

impl Status {
    /// Its name for machines.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Status::Proved => "proved",
            Status::Refuted => "refuted",
            Status::Open => "open",
            Status::NotChecked => "not-checked",
            Status::Done => "done",
        }
    }
}

/// An answer.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answer {
    /// The kind of question.
    pub(crate) about: About,
    /// Its subject: the text of an assert, the name of a file or of an engine.
    pub(crate) subject: String,
    /// The result.
    pub(crate) status: Status,
    /// The answer in words.
    pub(crate) message: String,
    /// Where the subject is declared.
    pub(crate) place: Option<Span>,
    /// Its requirement tags.
    pub(crate) requirements: Vec<String>,
    /// Its basis: method, scope, witness, reasons, tests.
    pub(crate) details: Map<String, Value>,
}

impl Answer {
    /// An answer without location and details.
    pub(crate) fn new(
        about: About,
        subject: impl Into<String>,
        status: Status,
        message: impl Into<String>,
    ) -> Self {
        Answer {
            about,
            subject: subject.into(),
            status,
            message: message.into(),
            place: None,
            requirements: Vec::new(),
            details: Map::new(),
        }
    }

    /// Adds one more detail.
    pub(crate) fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.details.insert(name.to_owned(), value.into());
        self
    }

    /// Adds the stimuli to which it applies.
    pub(crate) fn scope(self, scope: &Scope) -> Self {
        let ticks = if let Scope::Ticks(ticks) = scope { Some(ticks.clone()) } else { None };
        let answer = self.with("scope", scope.name());
        match ticks {
            Some(ticks) => answer.with("ticks", ticks),
            None => answer,
        }
    }

    /// Adds the kind of proof, and the stimuli that it covers.
    pub(crate) fn proved_by(self, proof: Proof, scope: &Scope) -> Self {
        self.with("by", proof_name(proof)).scope(scope)
    }

    /// Adds the first value in which two traces differ.
    pub(crate) fn difference(self, difference: &Difference) -> Self {
        self.with("row", difference.row).with("column", difference.column.as_str())
    }

    /// Adds the difference between two circuits, and the inputs that show it.
    pub(crate) fn circuits(self, apart: &CircuitsApart) -> Self {
        self.with("row", apart.clocks())
            .with("column", apart.output.as_str())
            .witness(&apart.to_csv())
    }

    /// Adds the reasons why it is open, and what was tested instead.
    pub(crate) fn open(self, open: &Open) -> Self {
        let reasons: Vec<Value> = open.reasons.iter().map(reason).collect();
        let answer = self.with("reasons", reasons);
        match &open.tested {
            Some(tested) => answer.tested(tested),
            None => answer,
        }
    }

    /// Adds what was tested.
    pub(crate) fn tested(self, tested: &Tested) -> Self {
        let mut value = json!({"reactions": tested.reactions});
        if tested.transitions > 0 {
            value["transitions"] = json!(tested.transitions);
            value["fired"] = json!(tested.fired);
            value["never"] = json!(tested.never);
        }
        if tested.is_cut_short {
            value["cut_short"] = json!(true);
        }
        self.with("tested", value)
    }

    /// Adds a trace or a stimulus, as CSV, that demonstrates it.
    pub(crate) fn witness(self, csv: &str) -> Self {
        self.with("witness", csv)
    }

    /// Adds the names of the trace files that demonstrate it.
    pub(crate) fn traces(self, files: Vec<String>) -> Self {
        if files.is_empty() { self } else { self.with("traces", files) }
    }

    /// The answer of a build about a file.
    pub(crate) fn of_output(report: &OutputReport, net: &Net) -> Self {
        let message = report.parts().collect::<Vec<_>>().join("; ");
        let status = match report.outcome() {
            Outcome::Proved => Status::Proved,
            Outcome::NotChecked => Status::NotChecked,
            Outcome::Open => Status::Open,
            Outcome::Refuted => Status::Refuted,
        };
        let mut answer = Answer::new(About::Output, report.name.as_str(), status, message);
        let notes: Vec<Value> = report
            .notes
            .iter()
            .map(|note| json!({"kind": note.name(), "text": note.to_string()}))
            .collect();
        if !notes.is_empty() {
            answer = answer.with("notes", notes);
        }
        match &report.verdict {
            OutputVerdict::Proved(proof) => {
                let answer = answer.with("by", proof.name());
                match proof {
                    OutputProof::Run { scope, .. } => answer.scope(scope),
                    OutputProof::Text { .. } | OutputProof::Edited { .. } => {
                        answer.scope(&Scope::EveryStimulus)
                    }
                    _ => answer,
                }
            }
            OutputVerdict::Refuted(OutputFault::Row(fault)) => answer
                .with("row", fault.stimulus.len())
                .with("column", fault.column.as_str())
                .witness(&fault.stimulus.to_csv(net)),
            OutputVerdict::Refuted(OutputFault::Rebuilt(apart) | OutputFault::Bitstream(apart)) => {
                answer.circuits(apart)
            }
            OutputVerdict::Refuted(
                OutputFault::ReadsBackAsAnother
                | OutputFault::PinLost(_)
                | OutputFault::NoAnswer(_),
            ) => answer,
            OutputVerdict::ReadBack(open) => answer.with("read_back", true).open(open),
            OutputVerdict::Open(open) => answer.open(open),
            OutputVerdict::NotChecked => answer,
        }
    }
}

/// The name of a kind of proof, for people and machines.
pub(crate) fn proof_name(proof: Proof) -> &'static str {
    match proof {
        Proof::Explicit => "enumeration",
        Proof::Symbolic => "decision-diagram",
        Proof::Structural => "structure",
        Proof::Induction => "induction",
        Proof::Directed => "property-directed reachability",
    }
}

/// Why a question is open, for machines.
pub(crate) fn reason(reason: &OpenReason) -> Value {
    let mut value = json!({"kind": reason.name(), "text": reason.to_string()});
    if let Some(option) = reason.option() {
        value["option"] = json!(option);
    }
    value
}
