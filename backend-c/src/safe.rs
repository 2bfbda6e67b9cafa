//! Safe values of outputs in C: before the first reaction, after a stop, during the emergency of the chart (semantics §3.8), and after memory
//! corruption.
//!
//! A reaction computes its outputs as if there were no emergency, and writes the safe values over them at its end: nothing after that can undo it.
//!
//! # The safe state
//! With [`Options::safe_state`] a reaction first checks whether the instance is valid: each state variable, timer, number and Boolean is within the
//! values that a reaction can leave in it, and if a component's steps are bits, at most one is active, or exactly one if that is proved. If the check
//! fails, the outputs become safe, the hook `NAME_BAD_STATE` is called once, and the chart stops until the next `init`. Corruption that results in a
//! possible state of the chart is not detected: the instance alone can only be checked against ranges and components.
//!
//! | `intact` | meaning |
//! |---|---|
//! | 0xA5 | `init` was called, and no reaction has found corruption |
//! | 0x5A | stopped, by `NAME_stop` or because corruption was found: all bits differ, so no single bit error leads from one to the other |
//! | else | this byte is corrupt, or `init` was not called yet: memory that was never written does not run |
//!
//! The check costs only its comparisons. Members whose maximum value is a power of two minus one are combined by `|` and compared at once: a bit above
//! that maximum is in the result if it is in one of them. The check reads the instance as volatile, so that no compiler assumes that the instance still has
//! the values that were written; this also prevents a compiler from restructuring the reaction around its knowledge of the state (the text of one chart was a third
//! larger on an AVR).

use crate::Object;
use crate::c::print::Node;
use crate::cexpr::{CExpr, constant};
use crate::interface::Interface;
use crate::names::{MEMBER_OF_SAFE_STATE as MEMBER, MEMBER_OF_TRACE, Names, library, namer};
use crate::range::Range;
use crate::style_output::{Member, StyleOutput};
use crate::times::{count_type, unsigned};
use crate::{Options, codes};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::facts::{Component, Facts};
use grafsynth_ir::instance::{Extra, Place};
use grafsynth_ir::names::Namer;
use grafsynth_ir::net::{Net, OutputId};
use itertools::Itertools as _;
use std::collections::BTreeMap;

/// The value of `intact` after `init`.
const INTACT: &str = "0xA5U";
/// The value of `intact` in a chart that has stopped.
const STOPPED: &str = "0x5AU";

/// Gives the outputs in `which` their safe values: members, and bits of the words that a reaction collects in locals.
pub(crate) fn force(
    net: &Net,
    names: &Names,
    holds: &CExpr,
    which: impl Fn(OutputId) -> bool,
) -> Vec<Node> {
    let io = &names.io;
    // Masks of one word: the bits that are forced, those of them that are on, and the bits of all outputs.
    let mut words = vec![(0u32, 0u32, 0u32); io.output_words()];
    let mut objects: Vec<Vec<Object>> = vec![Vec::new(); words.len()];
    let mut members = Vec::new();
    for (id, output) in net.outputs.iter().filter(|(_, output)| !output.is_extern()) {
        match io.output_bit(id) {
            Some(bit) => {
                let (word, bit) = (bit / io.output_bits(), bit % io.output_bits());
                words[word].2 |= 1 << bit;
                if which(id) && output.is_forced() {
                    words[word].0 |= 1 << bit;
                    words[word].1 |= u32::from(output.safe_value() != 0) << bit;
                    objects[word].push(Object::Output(id));
                }
            }
            None if which(id) && output.is_forced() => members.push(
                Node::line(format!(
                    "out->{} = {};",
                    names.outputs[id],
                    constant(output.safe_value(), output.ty)
                ))
                .about(Object::Output(id)),
            ),
            None => {}
        }
    }
    let mut body = Vec::new();
    for (word, (mask, on, all)) in words.into_iter().enumerate() {
        if mask == 0 {
            continue;
        }
        let (ty, lit) = (io.output_type(), io.lit(word));
        let on = io.output_mask(on);
        let text = if mask == all {
            format!("{lit} = {on};")
        } else {
            format!("{lit} = ({ty})(({lit} & {}) | {on});", io.output_mask(all & !mask))
        };
        body.push(Node::line(text).about_all(objects[word].iter().copied()));
    }
    body.extend(members);
    if body.is_empty() {
        return Vec::new();
    }
    crate::calls::either(holds.clone(), body, Vec::new())
}

/// Why the safe state cannot check the requested code.
pub(crate) fn refusal(net: &Net, options: &Options) -> Option<Diagnostic> {
    let engine = options.style.row().engine?;
    let message = format!(
        "`--safe-state` does not support {engine}: only the tables define what its instance means"
    );
    options.safe_state.then(|| {
        Diagnostic::error(codes::SAFE_STATE_REFUSED, message)
            .at(net.name.span, "requested for this chart")
            .help("build it as `c`, or omit `--safe-state`")
    })
}

/// Adds the check to a program: the function `NAME_intact`, the member, and its value at the end of `init`.
pub(crate) fn watch(net: &Net, facts: &Facts, interface: &Interface, program: &mut StyleOutput) {
    let prefix = &interface.names.prefix;
    // Locals must not shadow the functions of the library.
    let mut locals = namer();
    library(net, &interface.names).iter().for_each(|function| locals.reserve(function));
    locals.reserve("i");
    if let Some(places) = interface.trace {
        let last = i64::from(places.max(1)) - 1;
        let member = |name| format!("{MEMBER_OF_TRACE}.{name}");
        program.ranges.push(Range::of(member("next"), "uint16_t", 0, last));
        program.ranges.push(Range::of(member("begins"), "bool", 0, 1));
    }
    if interface.gate {
        program.ranges.push(Range::of("gate".to_owned(), "uint8_t", 0, 2));
    }
    let mut body = vec![leave(&format!("self->{MEMBER} != {INTACT}"))];
    body.extend(of_ranges(&program.ranges, &mut locals));
    for component in &facts.components {
        body.extend(of_component(component, program, &mut locals));
    }
    body.push(Node::line("return true;"));
    program.functions.push(Node::comment(
        "Whether every state variable has a value that a reaction can leave in it.",
    ));
    program.functions.push(Node::function(
        format!("static bool {prefix}_intact(const volatile {prefix}_t *self)"),
        body,
    ));
    program.functions.push(Node::blank());
    program.instance.push(Member {
        declaration: format!("uint8_t {MEMBER}"),
        note: format!("{INTACT} while the chart runs, {STOPPED} after a stop"),
        objects: Vec::new(),
    });
    program.init.push(Node::line(format!("self->{MEMBER} = {INTACT};")));
}

/// What a proof knows about the member.
pub(crate) fn extra() -> (Place, Extra) {
    (Place::member(MEMBER), Extra::Running { runs: 0xA5, stopped: 0x5A })
}

fn leave(condition: &str) -> Node {
    Node::when(condition, vec![Node::line("return false;")])
}

/// The checks that members are in range. Each expression reads one member once, because it is volatile there.
fn of_ranges(ranges: &[Range], locals: &mut Namer) -> Vec<Node> {
    let mut unions: BTreeMap<(&'static str, i64), Vec<String>> = BTreeMap::new();
    let mut nodes = Vec::new();
    let mut loops = Vec::new();
    for range in ranges {
        let elements = match range.elements {
            None => vec![String::new()],
            Some((first, behind)) if behind - first <= 4 => {
                (first..behind).map(|at| at.to_string()).collect()
            }
            Some((first, behind)) => {
                loops.extend(of_elements(range, first, behind));
                continue;
            }
        };
        for index in elements {
            let value = range.value(&index);
            match range.union() {
                Some(union) => unions.entry(union).or_default().push(value),
                None => nodes.extend(range.broken(&value).iter().map(|it| leave(it))),
            }
        }
    }
    for ((ty, hi), values) in unions {
        let range = Range::of(String::new(), ty, 0, hi);
        match values.as_slice() {
            [only] => nodes.extend(range.broken(only).iter().map(|it| leave(it))),
            [first, others @ ..] => {
                let all = locals.name(&format!("all_{hi}"));
                nodes.push(Node::line(format!("{ty} {all} = {first};")));
                nodes.extend(
                    others.iter().map(|it| Node::line(format!("{all} = ({ty})({all} | {it});"))),
                );
                nodes.extend(range.broken(&all).iter().map(|it| leave(it)));
            }
            [] => {}
        }
    }
    nodes.extend(loops);
    nodes
}

/// The check for many elements of an array.
fn of_elements(range: &Range, first: u32, behind: u32) -> Option<Node> {
    let counter = count_type(i64::from(behind));
    let [from, to] = [first, behind].map(|it| unsigned(i64::from(it)));
    let head = format!("for ({counter} i = {from}; i < {to}; ++i)");
    let questions: Vec<Node> = range.broken(&range.value("i")).iter().map(|it| leave(it)).collect();
    (!questions.is_empty()).then(|| Node::block(head, questions))
}

/// The check that the bits of a component are those of one of its steps.
fn of_component(component: &Component, program: &StyleOutput, locals: &mut Namer) -> Vec<Node> {
    let steps = component.steps.iter().filter(|step| program.one_bit.contains(step));
    let bits: Vec<&String> = steps.map(|step| &program.active[*step]).collect();
    let exactly_one = component.always && bits.len() == component.steps.len();
    if bits.is_empty() || bits.len() == 1 && !exactly_one {
        return Vec::new();
    }
    if let ([only], true) = (bits.as_slice(), exactly_one) {
        return vec![leave(&format!("!{only}"))];
    }
    let count = locals.name("active");
    let most = i64::try_from(bits.len()).unwrap_or(i64::MAX);
    let mut nodes = vec![Node::line(format!("{} {count} = 0U;", count_type(most)))];
    nodes.extend(bits.iter().map(|bit| Node::when(bit, vec![Node::line(format!("++{count};"))])));
    nodes.push(leave(&format!("{count} {} 1U", if exactly_one { "!=" } else { ">" })));
    nodes
}

/// The check before a reaction.
pub(crate) fn guard(net: &Net, names: &Names) -> Node {
    let mut body = names.io.constants(net, &names.outputs, |id| net.outputs[id].safe_value());
    let found = vec![
        Node::line(format!("self->{MEMBER} = {STOPPED};")),
        Node::line(format!("{}_BAD_STATE(self);", names.upper)),
    ];
    body.push(Node::when(&format!("self->{MEMBER} != {STOPPED}"), found));
    body.push(Node::line("return;"));
    Node::when(&format!("!{}_intact(self)", names.prefix), body)
}

/// The statement that stops the chart; it does not set the outputs.
pub(crate) fn stop() -> Node {
    Node::line(format!("self->{MEMBER} = {STOPPED};"))
}

/// `NAME_stopped`, for the header.
pub(crate) fn stopped(names: &Names) -> Vec<Node> {
    let prefix = &names.prefix;
    vec![
        Node::comment(
            "Whether the chart is stopped: before init, after a stop, or after memory corruption. Its reactions then give the safe outputs.",
        ),
        Node::function(
            format!("static inline bool {prefix}_stopped(const {prefix}_t *self)"),
            vec![Node::line(format!("return self->{MEMBER} != {INTACT};"))],
        ),
        Node::blank(),
    ]
}

/// The safe outputs without an instance: as an initialiser, and written by a function.
pub(crate) fn before_init(net: &Net, names: &Names) -> Vec<Node> {
    let io = &names.io;
    let mut words = vec![0u32; io.output_words()];
    let mut members = Vec::new();
    for (id, output) in net.outputs.iter().filter(|(_, output)| !output.is_extern()) {
        let safe = output.safe_value();
        match io.output_bit(id) {
            Some(bit) => {
                words[bit / io.output_bits()] |= u32::from(safe != 0) << (bit % io.output_bits());
            }
            None => members.push(constant(safe, output.ty)),
        }
    }
    let words: Vec<String> = words.into_iter().map(|word| io.output_mask(word)).collect();
    let bits = (!words.is_empty()).then(|| format!("{{ {} }}", words.join(", ")));
    let all = bits.into_iter().chain(members).join(", ");
    let (prefix, upper) = (&names.prefix, &names.upper);
    vec![
        Node::comment(
            "The safe outputs for the time before init: an initialiser, and a function that writes them.",
        ),
        Node::directive(format!("#define {upper}_SAFE_OUT {{ {all} }}")),
        Node::function(
            format!("static inline void {prefix}_safe({prefix}_out_t *out)"),
            io.constants(net, &names.outputs, |id| net.outputs[id].safe_value()),
        ),
        Node::blank(),
    ]
}
