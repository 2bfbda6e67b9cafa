//! The gate (`--gate`): a reaction that cannot change anything returns at once.
//!
//! A reaction is a function of the instance, the inputs and `dt`, and of nothing else. [`refusal`] ensures this: a chart that calls functions of the
//! user's library or contains C text also depends on these, or has effects that the instance does not show. So if a reaction has left the instance
//! unchanged, byte for byte, the next one with the same inputs and the same `dt` has the same effect: it leaves the instance unchanged and gives the
//! same outputs, which are already in `out`. Edges, running timers, ages, budgets of tasks, queued and raised events are all in the instance: while
//! one of them has work to do, the instance changes, and the gate stays open. No knowledge of the chart is needed.
//!
//! Testing whether a reaction changed anything costs a copy of the instance. The test is made only if inputs and `dt` equal the last ones,
//! so a scan with new inputs only compares and stores them. The gate itself is inline, in the header: an idle scan costs no call.
//!
//! | `gate` | meaning |
//! |---|---|
//! | 0 | after `init`: no inputs are known |
//! | 1 | `gate_in` and `gate_dt` belong to the last reaction |
//! | 2 | and that reaction changed nothing |

use crate::c::print::Node;
use crate::codes;
use crate::interface::Interface;
use crate::style_output::{Member, StyleOutput};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::instance::Gate;
use grafsynth_ir::net::{InputKind, Net};

/// Why the gate would not be exact for this chart.
pub(crate) fn refusal(net: &Net) -> Option<Diagnostic> {
    let condition = net.inputs.values().find(|it| it.kind == InputKind::Extern).map(|it| {
        (
            format!("the extern condition `{}`, which may change on its own", it.name),
            it.name.span,
            "leave out `--gate`, or make the condition an input",
        )
    });
    let action = net.outputs.values().find(|it| it.is_extern()).map(|it| {
        (
            format!("the extern action `{}`, whose calls are not part of the instance", it.name),
            it.name.span,
            "leave out `--gate`, or make the action an output",
        )
    });
    let code = net.c_texts().first().map(|span| {
        let what = "C code, which may do anything".to_owned();
        (what, *span, "leave out `--gate`, or write the code as assignments")
    });
    let (what, span, help) = condition.or(action).or(code)?;
    Some(
        Diagnostic::error(codes::GATE_REFUSED, format!("the gate does not support {what}"))
            .at(span, "used here")
            .help(help),
    )
}

/// The members that the gate adds to the instance.
pub(crate) fn members(interface: &Interface) -> Vec<Member> {
    let prefix = &interface.names.prefix;
    let member = |declaration: String, note: &str| Member {
        declaration,
        note: note.to_string(),
        objects: Vec::new(),
    };
    let mut all = vec![member(
        "uint8_t gate".to_string(),
        "0: nothing known, 1: last inputs known, 2: and the last reaction changed nothing",
    )];
    if interface.has_in {
        all.push(member(format!("{prefix}_in_t gate_in"), "the inputs of the last reaction"));
    }
    if let Some(ticks) = interface.ticks {
        all.push(member(format!("{} gate_dt", ticks.name()), "its dt"));
    }
    all
}

/// What a proof knows about these members.
pub(crate) fn hint(net: &Net, program: &StyleOutput) -> Gate {
    let has_in = net.inputs.values().any(|input| input.kind.is_handed());
    Gate {
        mark: "gate".to_owned(),
        inputs: has_in.then(|| "gate_in".to_owned()),
        dt: program.ticks.is_some().then(|| "gate_dt".to_owned()),
    }
}

/// `NAME_step`, in the header.
pub(crate) fn step(interface: &Interface, same: &[String]) -> Node {
    let prefix = &interface.names.prefix;
    let mut all = vec!["self->gate == 2U".to_string()];
    all.extend(same.iter().cloned());
    let body = vec![
        Node::when(&crate::cexpr::joined(&all, "&&"), vec![Node::line("return;")])
            .note("the last reaction changed nothing, and this one would do the same"),
        Node::line(format!("{prefix}_react({});", arguments(interface))),
    ];
    let head = format!("static inline void {prefix}_step({})", interface.parameters(true, true));
    Node::function(head, body)
}

/// The functions that the gate calls, in the source; `reaction` is the body of the reaction itself.
pub(crate) fn functions(interface: &Interface, same: &[String], reaction: Vec<Node>) -> Vec<Node> {
    let prefix = &interface.names.prefix;
    let parameters = interface.parameters(true, true);
    let arguments = arguments(interface);
    let mut known = vec!["self->gate != 0U".to_string()];
    known.extend(same.iter().cloned());
    let each_byte = |line: &str| {
        let head = format!("for (uint16_t at = 0U; at < (uint16_t)sizeof({prefix}_t); ++at)");
        Node::block(head, vec![Node::line(line)])
    };
    let mut react = vec![Node::when(
        &crate::cexpr::joined(&known, "&&"),
        vec![Node::line(format!("{prefix}_probe({arguments});")), Node::line("return;")],
    )];
    if interface.has_in {
        react.push(Node::line("self->gate_in = *in;"));
    }
    if interface.ticks.is_some() {
        react.push(Node::line("self->gate_dt = dt;"));
    }
    react.push(Node::line("self->gate = 1U;"));
    react.push(Node::line(format!("{prefix}_reaction({arguments});")));
    vec![
        Node::function(format!("static void {prefix}_reaction({parameters})"), reaction),
        Node::blank(),
        Node::comment(
            "Runs a reaction with the inputs of the last one, and records whether it changes anything.",
        ),
        Node::function(
            format!("static void {prefix}_probe({parameters})"),
            vec![
                Node::line("const uint8_t *const now = (const uint8_t *)self;"),
                Node::line(format!("uint8_t before[sizeof({prefix}_t)];")),
                Node::line("uint8_t changes = 0U;"),
                each_byte("before[at] = now[at];"),
                Node::line(format!("{prefix}_reaction({arguments});")),
                each_byte("changes |= (uint8_t)(before[at] ^ now[at]);"),
                Node::when("changes == 0U", vec![Node::line("self->gate = 2U;")]),
            ],
        ),
        Node::blank(),
        Node::function(format!("void {prefix}_react({parameters})"), react),
    ]
}

/// The conditions that inputs and `dt` equal the last ones.
pub(crate) fn same(net: &Net, interface: &Interface) -> Vec<String> {
    let names = &interface.names;
    let mut all: Vec<String> = (0..names.io.input_words())
        .map(|word| format!("in->bits[{word}] == self->gate_in.bits[{word}]"))
        .collect();
    for (id, input) in net.inputs.iter() {
        let is_member = input.kind.is_handed() && names.io.input_bit(id).is_none();
        if is_member {
            all.push(format!("in->{0} == self->gate_in.{0}", names.inputs[id]));
        }
    }
    if interface.ticks.is_some() {
        all.push("dt == self->gate_dt".to_string());
    }
    all
}

fn arguments(interface: &Interface) -> String {
    let mut all = vec!["self"];
    if interface.has_in {
        all.push("in");
    }
    if interface.ticks.is_some() {
        all.push("dt");
    }
    if interface.has_out {
        all.push("out");
    }
    all.join(", ")
}
