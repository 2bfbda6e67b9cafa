//! The trace ring: the last transitions that fired, with the number of their reaction, stored in the instance.
//!
//! The ring exists only if it is requested; without it the text is unchanged. Every style calls `NAME_fired` when a transition fires:
//! in `switch` at the transition's owner, in tables with a number in each row, in statecharts once a region has chosen, and in `bits` by a mark of
//! the reaction program ([`Additions`](grafsynth_ir::lower::program::Additions)). The order within one micro-step depends on the style.
//!
//! A program reads the ring byte by byte with `NAME_trace_byte` and can send it anywhere. Its bytes, with numbers in little-endian order:
//!
//! | offset | bytes | contents |
//! |---|---|---|
//! | 0 | 4 | `GTR1` |
//! | 4 | 4 | [`hash`] of the chart |
//! | 8 | 4 | reactions since `init`, modulo 2^32 |
//! | 12 | 4 | transitions fired since `init`; saturates at the largest number |
//! | 16 | 2 | number of entries of the ring |
//! | 18 | 2 | the entry that is written next |
//! | 20 | 6 each | reaction (4), transition (2), from 0 in declaration order; [`BEGINS`] is added at the beginning of a micro-step |
//!
//! The first reaction has the number 1, as in a trace of the simulator. Micro-steps are marked only in charts with stable evolution: in others there
//! is one per reaction.

use crate::Options;
use crate::c::print::{Arm, Kind, Node};
use crate::codes;
use crate::names::{MEMBER_OF_TRACE as MEMBER, Names};
use crate::style_output::{Member, StyleOutput, mentions};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::instance::{Extra, Place};
use grafsynth_ir::net::{Net, TransitionId};
use grafsynth_ir::program::Mark;

/// The first bytes of a dump.
pub const MAGIC: [u8; 4] = *b"GTR1";
/// The number of bytes before the first entry.
pub const HEADER_BYTES: usize = 20;
/// The number of bytes of an entry.
pub const ENTRY_BYTES: usize = 6;
/// The maximum number of entries of a ring: its bytes can still be counted with 16 bits.
pub const MAX_PLACES: u16 = 8192;
/// Added to the number of a transition that is the first of its micro-step.
pub const BEGINS: u16 = 0x8000;

/// A hash of the whole chart (FNV-1a over its text as a net), so that a dump is not read with another chart.
#[must_use]
pub fn hash(net: &Net) -> u32 {
    grafsynth_ir::text::print(net)
        .bytes()
        .fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}

/// Why a ring is impossible.
pub(crate) fn refusal(net: &Net, options: &Options) -> Option<Diagnostic> {
    let places = options.trace?;
    if options.gate {
        let message = "the trace ring cannot be combined with the gate, which skips reactions";
        return Some(
            Diagnostic::error(codes::TRACE_REFUSED, message)
                .at(net.name.span, "this chart")
                .help("omit `--gate` or `--trace-ring`"),
        );
    }
    if net.transitions.len() > usize::from(BEGINS) {
        let message = format!(
            "the trace ring supports at most {BEGINS} transitions, but the chart has {}",
            net.transitions.len()
        );
        return Some(
            Diagnostic::error(codes::TRACE_REFUSED, message)
                .at(net.name.span, "this chart")
                .help("omit `--trace-ring`, or trace a part of the chart"),
        );
    }
    if places == 0 || places > MAX_PLACES {
        let message = format!("a trace ring has 1 to {MAX_PLACES} entries, not {places}");
        return Some(
            Diagnostic::error(codes::TRACE_REFUSED, message)
                .at(net.name.span, "this chart")
                .help("give another number to `--trace-ring`"),
        );
    }
    None
}

/// Records that a transition fires.
pub(crate) fn fired(names: &Names, id: TransitionId) -> Node {
    Node::line(format!("{}_fired(self, {}U);", names.prefix, id.index()))
}

/// Records that a micro-step begins.
pub(crate) fn micro_step() -> Node {
    Node::line(format!("self->{MEMBER}.begins = true;"))
}

/// The statement of a mark of the reaction program.
pub(crate) fn mark(names: &Names, mark: Mark) -> Node {
    match mark {
        Mark::MicroStep => micro_step(),
        Mark::Fires(id) => fired(names, id),
    }
}

/// Adds the ring to a program: the member, its initialisation, the count of reactions, and `NAME_fired`.
pub(crate) fn add(names: &Names, program: &mut StyleOutput) {
    let prefix = &names.prefix;
    program.instance.push(Member {
        declaration: format!("{prefix}_trace_t {MEMBER}"),
        note: "the transitions that fired last".to_owned(),
        objects: Vec::new(),
    });
    for (member, zero) in [("reactions", "0"), ("count", "0"), ("next", "0"), ("begins", "false")] {
        program.init.push(Node::line(format!("self->{MEMBER}.{member} = {zero};")));
    }
    let clear = vec![
        Node::line(format!("self->{MEMBER}.at[i] = 0;")),
        Node::line(format!("self->{MEMBER}.fired[i] = 0;")),
    ];
    let head = format!("for (uint16_t i = 0U; i < {}_TRACE_PLACES; ++i)", names.upper);
    program.init.push(Node::block(head, clear));
    program.step.insert(0, Node::line(format!("++self->{MEMBER}.reactions;")));
    let called = format!("{prefix}_fired");
    if !mentions(&program.functions, &called) && !mentions(&program.step, &called) {
        return;
    }
    let body = vec![
        Node::line(format!("{prefix}_trace_t *trace = &self->{MEMBER};")),
        Node::line("trace->at[trace->next] = trace->reactions;"),
        Node::line(
            "trace->fired[trace->next] = (uint16_t)(transition | (trace->begins ? 0x8000U : 0U));",
        ),
        Node::line("trace->begins = false;"),
        Node::line("++trace->next;"),
        Node::when(
            &format!("trace->next >= {}_TRACE_PLACES", names.upper),
            vec![Node::line("trace->next = 0U;")],
        ),
        Node::when("trace->count != 0xffffffffU", vec![Node::line("++trace->count;")]),
    ];
    let head = format!("static void {prefix}_fired({prefix}_t *self, uint16_t transition)");
    let function = vec![
        Node::comment("Records in the ring that a transition fires."),
        Node::function(head, body),
        Node::blank(),
    ];
    program.functions.splice(0..0, function);
}

/// What a proof knows about the members of the ring: the next entry is one of the ring, and nothing but `NAME_trace_byte` reads the entries.
pub(crate) fn extra(places: u16) -> Vec<(Place, Extra)> {
    let name = |member: &str| format!("{MEMBER}.{member}");
    let numbers = [
        ("reactions", i64::from(u32::MAX)),
        ("count", i64::from(u32::MAX)),
        ("next", i64::from(places.max(1)) - 1),
        ("begins", 1),
    ];
    let numbers = numbers.map(|(member, most)| (Place::member(name(member)), Extra::UpTo(most)));
    let mut all = numbers.to_vec();
    for at in 0..u32::from(places) {
        for member in ["at", "fired"] {
            all.push((Place::element(name(member), at), Extra::Written));
        }
    }
    all
}

/// The type of the ring and its numbers, before the instance.
pub(crate) fn ring(names: &Names, net: &Net, places: u16) -> Vec<Node> {
    let upper = &names.upper;
    let bytes = HEADER_BYTES + ENTRY_BYTES * usize::from(places);
    let body = vec![
        Node::line("uint32_t reactions;").note("since init"),
        Node::line("uint32_t count;").note("transitions fired since init"),
        Node::line("uint16_t next;").note("the entry that is written next"),
        Node::line("bool begins;").note("the next one is the first of its micro-step"),
        Node::line(format!("uint32_t at[{upper}_TRACE_PLACES];")).note("reaction"),
        Node::line(format!("uint16_t fired[{upper}_TRACE_PLACES];"))
            .note("transition, from 0; 0x8000 is added at the beginning of a micro-step"),
    ];
    vec![
        Node::directive(format!("#define {upper}_TRACE_PLACES {places}U")),
        Node::directive(format!("#define {upper}_TRACE_BYTES {bytes}U"))
            .note("size of the trace in bytes"),
        Node::directive(format!("#define {upper}_TRACE_CHART 0x{:08x}U", hash(net)))
            .note("identifies the chart"),
        Node::typedef("struct", body, format!("{}_trace_t", names.prefix)),
        Node::blank(),
    ]
}

/// `NAME_trace_byte`, after the other functions of the header.
pub(crate) fn reader(names: &Names) -> Vec<Node> {
    let (prefix, upper) = (&names.prefix, &names.upper);
    let magic = u32::from_le_bytes(MAGIC);
    let number = |first: usize, value: String| {
        let arm = Node::line(format!("value = {value};"));
        (format!("at < {}U", first + 4), arm)
    };
    let parts = [
        number(0, format!("0x{magic:08x}U")),
        number(4, format!("{upper}_TRACE_CHART")),
        number(8, format!("self->{MEMBER}.reactions")),
        number(12, format!("self->{MEMBER}.count")),
        number(16, format!("{upper}_TRACE_PLACES | ((uint32_t)self->{MEMBER}.next << 16)")),
    ];
    let mut arms = Vec::new();
    for (condition, line) in parts {
        arms.push(Arm::when(&condition, vec![line]));
    }
    arms.push(Arm::otherwise(vec![
        Node::line("const uint16_t entry = (uint16_t)((at - 20U) / 6U);"),
        Node::line("byte = (uint8_t)((at - 20U) % 6U);"),
        Kind::Block(vec![
            Arm::when("byte < 4U", vec![Node::line(format!("value = self->{MEMBER}.at[entry];"))]),
            Arm::otherwise(vec![
                Node::line("byte = (uint8_t)(byte - 4U);"),
                Node::line(format!("value = self->{MEMBER}.fired[entry];")),
            ]),
        ])
        .into(),
    ]));
    let body = vec![
        Node::line("uint32_t value;"),
        Node::line("uint8_t byte = (uint8_t)(at % 4U);"),
        Kind::Block(arms).into(),
        Node::line("byte = (uint8_t)(8U * byte);"),
        Node::line("return (uint8_t)((value >> byte) & 0xffU);"),
    ];
    let head =
        format!("static inline uint8_t {prefix}_trace_byte(const {prefix}_t *self, uint16_t at)");
    vec![
        Node::comment(format!(
            "Returns byte `at` of the trace; `at` must be less than {upper}_TRACE_BYTES. Send all bytes, raw or as hexadecimal text; grafsynth trace reads them.\nCall it only between reactions, because the ring must not change."
        )),
        Node::function(head, body),
        Node::blank(),
    ]
}

/// Prints the trace on standard error, for the harness.
pub(crate) fn dump(names: &Names) -> Vec<Node> {
    let (prefix, upper) = (&names.prefix, &names.upper);
    let print = format!("fprintf(stderr, \"%02x\", (unsigned){prefix}_trace_byte(&self, at));");
    vec![
        Node::block(
            format!("for (uint16_t at = 0; at < {upper}_TRACE_BYTES; ++at)"),
            vec![Node::line(print)],
        ),
        Node::line("fputc('\\n', stderr);"),
    ]
}
