//! One answer of the tool: what was asked, what is known, and what it rests on.

use grafsynth_driver::report::{Outcome, OutputFault, OutputProof, OutputReport, OutputVerdict};
use grafsynth_ir::Span;
use grafsynth_ir::facts::Proof;
use grafsynth_ir::net::Net;
use grafsynth_sim::Difference;
use grafsynth_verify::{Open, OpenReason, Scope, Tested};
use serde_json::{Map, Value, json};

/// What a question is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum About {
    /// An `assert`, or what an emergency must keep.
    Assert,
    /// A kind of finding that was looked for.
    Lint,
    /// A number that is known of a design.
    Fact,
    /// How long a transition waits for its turn.
    Bound,
    /// A file of a build: is it the chart?
    Output,
    /// Two designs, or an engine and the chart: are they equal?
    Equality,
    /// Test vectors that a fuse map carries.
    Vectors,
    /// A part that only one of two charts has, or that reads otherwise.
    Part,
    /// A trace that was to be replayed.
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

    /// What it stands for, in a few words.
    pub(crate) fn title(self) -> &'static str {
        match self {
            About::Assert => "what the chart must guarantee",
            About::Lint => "what was looked for",
            About::Fact => "what is known of the design",
            About::Bound => "how long a transition waits",
            About::Output => "an output is the chart",
            About::Equality => "two designs do the same",
            About::Vectors => "the test vectors of a fuse map pass",
            About::Part => "a part changed",
            About::Replay => "a trace is what the chart does",
        }
    }
}

/// What is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Status {
    /// It holds, which was proved.
    Proved,
    /// It does not hold.
    Refuted,
    /// It was not found out.
    Open,
    /// No program can tell.
    NotChecked,
    /// There was nothing to prove: a test or a check ran, or a fact is told.
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
    /// What was asked.
    pub(crate) about: About,
    /// Of what: the text of an assert, the name of a file, of an engine.
    pub(crate) subject: String,
    /// What is known.
    pub(crate) status: Status,
    /// The answer as a sentence.
    pub(crate) message: String,
    /// Where the subject was declared.
    pub(crate) place: Option<Span>,
    /// Its requirement tags.
    pub(crate) requirements: Vec<String>,
    /// What it rests on: method, scope, witness, reasons, tests.
    pub(crate) details: Map<String, Value>,
}

impl Answer {
    /// An answer without place and details.
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

    /// With one more detail.
    pub(crate) fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.details.insert(name.to_owned(), value.into());
        self
    }

    /// With the stimuli that it holds for.
    pub(crate) fn scope(self, scope: &Scope) -> Self {
        let ticks = if let Scope::Ticks(ticks) = scope { Some(ticks.clone()) } else { None };
        let answer = self.with("scope", scope.name());
        match ticks {
            Some(ticks) => answer.with("ticks", ticks),
            None => answer,
        }
    }

    /// With the kind of proof that it was proved by, and the stimuli that this covers.
    pub(crate) fn proved_by(self, proof: Proof, scope: &Scope) -> Self {
        self.with("by", proof_name(proof)).scope(scope)
    }

    /// With the first cell in which two traces differ.
    pub(crate) fn difference(self, difference: &Difference) -> Self {
        self.with("row", difference.row).with("column", difference.column.as_str())
    }

    /// With the reasons why it is open, and what was tested instead.
    pub(crate) fn open(self, open: &Open) -> Self {
        let reasons: Vec<Value> = open.reasons.iter().map(reason).collect();
        let answer = self.with("reasons", reasons);
        match &open.tested {
            Some(tested) => answer.tested(tested),
            None => answer,
        }
    }

    /// With what was tested.
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

    /// With a trace or a stimulus, as CSV, that shows it.
    pub(crate) fn witness(self, csv: &str) -> Self {
        self.with("witness", csv)
    }

    /// What a build says of a file.
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
                if let OutputProof::Run { scope, .. } = proof {
                    answer.scope(scope)
                } else {
                    answer
                }
            }
            OutputVerdict::Refuted(OutputFault::Row { stimulus, column, .. }) => answer
                .with("row", stimulus.len())
                .with("column", column.as_str())
                .witness(&stimulus.to_csv(net)),
            OutputVerdict::Refuted(_) => answer,
            OutputVerdict::ReadBack(open) => answer.with("read_back", true).open(open),
            OutputVerdict::Open(open) => answer.open(open),
            OutputVerdict::NotChecked => answer,
        }
    }
}

/// The name of a kind of proof, the same for people and machines.
pub(crate) fn proof_name(proof: Proof) -> &'static str {
    match proof {
        Proof::Explicit => "enumeration",
        Proof::Symbolic => "decision-diagram",
        Proof::Structural => "structure",
        Proof::Induction => "induction",
    }
}

/// Why a question stayed open, for machines.
pub(crate) fn reason(reason: &OpenReason) -> Value {
    let mut value = json!({"kind": reason.name(), "text": reason.to_string()});
    if let Some(option) = reason.option() {
        value["option"] = json!(option);
    }
    value
}
