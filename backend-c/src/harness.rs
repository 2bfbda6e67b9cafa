//! Programs that run emitted charts and print their traces.
//!
//! A harness reads one reaction from each line of its standard input: the ticks since the last reaction, then the inputs, extern conditions and
//! events in declaration order (except internal events), all as decimal numbers separated by blanks. It prints the trace of semantics §11 as CSV, row
//! 0 first. Extern conditions are answered from the line; calls of extern actions are counted, or their arguments are listed, for the columns of the
//! trace.
//!
//! A harness is a test bench for a hosted C compiler; it is not part of a package.

use crate::Package;
use crate::c::print::{Arm, Kind, Node, Writer};
use crate::callback_check;
use crate::header::shown;
use crate::interface::Interface;
use crate::io::Structure;
use crate::names::library;
use grafsynth_c::storage;
use grafsynth_ir::Valid;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Driver, InputId, InputKind, Net, StepId, VarOrigin};

/// A `main` for one chart; compile it with the package's `NAME.c` (but without `NAME_user.c`, whose functions it provides).
#[must_use]
pub fn harness(net: &Valid<Net>, package: &Package) -> String {
    let mut nodes = heading(net, package, "runs the chart and prints its trace");
    nodes.extend(bench(net, &package.interface, false));
    nodes.push(main_of(package));
    Writer::write(&nodes).0
}

/// A program that answers queries about single reactions, to explore everything that a chart can do.
///
/// It reads batches: a line with the number of queries, then that many queries. A query is a state followed by the line of a [`harness`]; the state is
/// the number of a state in an earlier answer, or `-1 - n` for the state after answer `n`. The answers of a batch are printed when all are ready. An
/// answer is two lines: the row of the trace (its scan is always 0), and the number of the state that the instance is then in. Equal states have
/// equal numbers. The heading of the trace and the answer 0 come first: state 0 is the one after `init`.
///
/// The contents of the output structure are not kept from query to query: this reveals an output that `step` does not write. With a gate before
/// `step`, the outputs belong to the state, because a skipped reaction leaves them unchanged.
#[must_use]
pub fn explorer(net: &Valid<Net>, package: &Package) -> String {
    let mut nodes = heading(net, package, "answers for single reactions");
    if package.interface.has_instance {
        let text = instances(&package.interface.names.prefix, carries_outputs(&package.interface));
        nodes.push(Kind::Verbatim(text).into());
    }
    nodes.push(Kind::Verbatim(ANSWERS.to_owned()).into());
    nodes.extend(bench(net, &package.interface, true));
    nodes.push(main_of(package));
    Writer::write(&nodes).0
}

/// True if the outputs belong to the state, because a skipped reaction leaves them unchanged.
fn carries_outputs(interface: &Interface) -> bool {
    interface.gate && interface.has_out
}

/// The states after all answers.
const ANSWERS: &str = r#"static int64_t *bench_after;
static size_t bench_n_answers;
static size_t bench_n_after;

static void bench_answered(int64_t state)
{
    if (bench_n_answers == bench_n_after) {
        bench_n_after = bench_n_after * 2U + 64U;
        bench_after = (int64_t *)realloc(bench_after, bench_n_after * sizeof *bench_after);
        if (bench_after == NULL) {
            exit(1);
        }
    }
    bench_after[bench_n_answers++] = state;
}

"#;

/// The comment with the purpose of the program, the headers of the package, and the declarations that all programs need.
fn heading(net: &Net, package: &Package, what: &str) -> Vec<Node> {
    let stem = package.stem();
    let mut nodes = vec![
        Node::comment(format!("{}: {what}.", net.name)),
        Node::directive(format!("#include \"{stem}.h\"")),
    ];
    if has_library(package) {
        nodes.push(Node::directive(format!("#include \"{stem}_user.h\"")));
    }
    nodes.extend(common());
    nodes
}

fn main_of(package: &Package) -> Node {
    Node::function(
        "int main(void)",
        vec![
            Node::line("bench_unused();"),
            Node::line(format!("{}_run();", package.interface.names.prefix)),
            Node::line("return 0;"),
        ],
    )
}

/// The table of instances seen so far, open addressing with linear probing.
fn instances(prefix: &str, with_outputs: bool) -> String {
    let outputs = if with_outputs { format!("    {prefix}_out_t out;\n") } else { String::new() };
    format!(
        r#"typedef struct {{
    {prefix}_t self;
{outputs}}} bench_state_t;

static bench_state_t *bench_seen;
static size_t bench_n_seen;
static size_t bench_room;
static size_t *bench_slots;
static size_t bench_n_slots;

static size_t bench_slot(const bench_state_t *state)
{{
    const unsigned char *bytes = (const unsigned char *)state;
    uint64_t hash = 1469598103934665603U;
    for (size_t i = 0; i < sizeof *state; ++i) {{
        hash = (hash ^ bytes[i]) * 1099511628211U;
    }}
    size_t at = (size_t)(hash % bench_n_slots);
    while (bench_slots[at] != 0U && memcmp(&bench_seen[bench_slots[at] - 1U], state, sizeof *state) != 0) {{
        at = (at + 1U) % bench_n_slots;
    }}
    return at;
}}

/* The number of a state; a new one gets the next. */
static size_t bench_instance(const bench_state_t *state)
{{
    if (2U * (bench_n_seen + 1U) > bench_n_slots) {{
        bench_n_slots = bench_n_slots * 2U + 64U;
        free(bench_slots);
        bench_slots = (size_t *)calloc(bench_n_slots, sizeof *bench_slots);
        if (bench_slots == NULL) {{
            exit(1);
        }}
        for (size_t i = 0; i < bench_n_seen; ++i) {{
            bench_slots[bench_slot(&bench_seen[i])] = i + 1U;
        }}
    }}
    const size_t at = bench_slot(state);
    if (bench_slots[at] == 0U) {{
        if (bench_n_seen == bench_room) {{
            bench_room = bench_room * 2U + 64U;
            bench_seen = (bench_state_t *)realloc(bench_seen, bench_room * sizeof *bench_seen);
            if (bench_seen == NULL) {{
                exit(1);
            }}
        }}
        memcpy(&bench_seen[bench_n_seen], state, sizeof *state);
        bench_slots[at] = ++bench_n_seen;
    }}
    return bench_slots[at] - 1U;
}}

"#
    )
}

/// One program for many charts that contains all their text: compile it alone. Its first argument is the index of the chart to run, from 0. Without
/// arguments, each chart in turn reads its stimulus from the standard input up to an empty line, and prints its trace after a line
/// with `#` and its index.
///
/// The packages must have been emitted with different prefixes ([`crate::Options::prefix`]); functions of their libraries may have equal names.
#[must_use]
pub fn multi_harness(all: &[(&Valid<Net>, &Package)]) -> String {
    // The headers are part of this one file, so unused inline functions are not mistakes.
    let mut text =
        "#if defined(__clang__)\n#pragma clang diagnostic ignored \"-Wunused-function\"\n#endif\n"
            .to_string();
    text.push_str(&Writer::write(&common()).0);
    // The text of each engine is inserted once, headers first.
    let mut engines: Vec<&crate::File> = Vec::new();
    for file in all.iter().flat_map(|(_, package)| &package.files) {
        let is_new = !engines.iter().any(|known| known.name == file.name);
        if is_new && file.kind.is_of_engine() {
            engines.push(file);
        }
    }
    engines.sort_by_key(|file| file.kind.is_source());
    for file in engines {
        push_without_includes(&mut text, &file.text);
    }
    for (net, package) in all {
        let (library, prefix) =
            (library(net, &package.interface.names), &package.interface.names.prefix);
        for name in &library {
            text.push_str(&format!("#define {name} {prefix}_lib_{name}\n"));
        }
        // Headers come first; the headers that they include are already in the text.
        let stem = package.stem();
        let wanted = [
            format!("{stem}.h"),
            format!("{stem}_port.h"),
            format!("{stem}_user.h"),
            format!("{stem}.c"),
            format!("{stem}_tables.c"),
        ];
        for name in &wanted {
            if let Some(file) = package.files.iter().find(|file| file.name == *name) {
                push_without_includes(&mut text, &file.text);
            }
        }
        text.push_str(&Writer::write(&bench(net, &package.interface, false)).0);
        for name in &library {
            text.push_str(&format!("#undef {name}\n"));
        }
    }
    let cases = all.iter().enumerate().map(|(index, (_, package))| {
        let run = Node::line(format!("{}_run();", package.interface.names.prefix));
        Node::case(index, vec![run])
    });
    let run = Node::function(
        "static void bench_one(int which)",
        vec![Node::switch("which", cases.collect())],
    );
    let main = Node::function(
        "int main(int argc, char **argv)",
        vec![
            Node::line("bench_unused();"),
            Node::when(
                "argc > 1",
                vec![Node::line("bench_one(atoi(argv[1]));"), Node::line("return 0;")],
            ),
            Node::block(
                format!("for (int i = 0; i < {}; ++i)", all.len()),
                vec![Node::line("printf(\"#%d\\n\", i);"), Node::line("bench_one(i);")],
            ),
            Node::line("return 0;"),
        ],
    );
    text.push_str(&Writer::write(&[run, Node::blank(), main]).0);
    text
}

fn push_without_includes(text: &mut String, part: &str) {
    for line in part.lines().filter(|line| !line.starts_with("#include")) {
        text.push_str(line);
        text.push('\n');
    }
}

fn has_library(package: &Package) -> bool {
    package.interface.has_library
}

/// The functions that every harness needs: input of numbers, output of text. Not every chart calls all of them.
const COMMON: &str = include_str!("text/harness.c");

fn common() -> [Node; 2] {
    [Kind::Verbatim(COMMON.to_string()).into(), Node::blank()]
}

/// The library functions and `NAME_run`; if it explores, it reads a state at the beginning of each line and prints the resulting state.
fn bench(net: &Net, interface: &Interface, explore: bool) -> Vec<Node> {
    let prefix = &interface.names.prefix;
    let mut nodes = stand_ins(net, interface);
    nodes.extend(steps(net, interface));
    let mut body: Vec<Node> = interface.variables(interface.has_in).map(Node::line).collect();
    body.push(Node::line("int64_t dt = 0;"));
    body.push(Node::line("int64_t scan = 0;"));
    if explore {
        body.push(Node::line("int64_t left = 0;"));
    }
    if interface.has_instance {
        body.push(
            Node::line("memset(&self, 0x55, sizeof self);")
                .note("memory that init does not set must not affect the result"),
        );
    }
    if interface.has_in {
        body.push(Node::line("memset(&in, 0, sizeof in);"));
    }
    if interface.has_out {
        body.push(Node::line("memset(&out, 0x55, sizeof out);"));
    }
    for (id, input) in net.inputs.iter().filter(|(_, it)| it.kind != InputKind::InternalEvent) {
        let zero = input.ty.saturate(0);
        if input.kind == InputKind::Extern || zero != 0 {
            body.push(put(net, interface, id, &zero.to_string()));
        }
    }
    body.push(Node::line(format!("fputs(\"{}\\n\", stdout);", columns(net, interface).join(","))));
    body.push(Node::line(format!("{prefix}_init({});", arguments(interface, false))));
    let mut round = row(net, interface);
    if explore {
        if interface.trace.is_some() {
            // The ring is not part of the chart's state.
            let member = crate::names::MEMBER_OF_TRACE;
            round.push(Node::line(format!("memset(&self.{member}, 0, sizeof self.{member});")));
        }
        round.extend(answer(interface));
    } else {
        round.push(Node::line("++scan;"));
    }
    round.push(Node::when("!bench_number(&dt)", vec![Node::line("break;")]));
    if let Some(ticks) = interface.ticks {
        let most = ticks.max();
        round.push(Node::line(format!(
            "const {0} ticks = ({0})(dt > {most} ? {most} : dt);",
            ticks.name()
        )));
    }
    round.extend(inputs(net, interface));
    for (id, _) in net.outputs.iter().filter(|(_, it)| it.is_extern()) {
        let calls = format!("{prefix}_calls_{}", interface.names.outputs[id]);
        round.push(Node::line(format!("{calls}.count = 0;")));
        round.push(Node::line(format!("{calls}.length = 0;")));
    }
    round.extend(callback_check::before(net, interface));
    round.push(Node::line(format!("{prefix}_step({});", arguments(interface, true))));
    round.extend(callback_check::after(net, interface));
    body.push(Node::block("for (;;)", round));
    if let (Some(_), false) = (interface.trace, explore) {
        body.extend(crate::trace::dump(&interface.names));
    }
    for (id, _) in net.outputs.iter().filter(|(_, it)| it.is_extern()) {
        body.push(Node::line(format!(
            "free({prefix}_calls_{}.text);",
            interface.names.outputs[id]
        )));
    }
    nodes.push(Node::function(format!("static void {prefix}_run(void)"), body));
    nodes.push(Node::blank());
    nodes
}

/// The statements that read the inputs of a reaction from the line.
fn inputs(net: &Net, interface: &Interface) -> Vec<Node> {
    let mut nodes = vec![Node::line("int64_t value = 0;")];
    for (id, input) in net.inputs.iter().filter(|(_, it)| it.kind != InputKind::InternalEvent) {
        nodes.push(Node::line("bench_number(&value);"));
        let value = match input.ty {
            _ if input.kind == InputKind::Extern => "value".to_string(),
            Type::Bool => "value != 0".to_string(),
            Type::Int { .. } => format!("({})value", storage(input.ty)),
        };
        nodes.push(put(net, interface, id, &value));
    }
    nodes.extend([Node::line("(void)value;"), Node::line("bench_end_of_line();")]);
    nodes
}

/// The statement that assigns an input, or the answer of an extern condition.
fn put(net: &Net, interface: &Interface, id: InputId, value: &str) -> Node {
    let names = &interface.names;
    Node::line(if net.inputs[id].kind == InputKind::Extern {
        format!("{}_stimulus_{} = {value};", names.prefix, names.inputs[id])
    } else {
        names.put(Structure::Local("in"), id, value)
    })
}

/// The second line of an answer, and the initial state of the next query.
fn answer(interface: &Interface) -> Vec<Node> {
    let with_outputs = carries_outputs(interface) && interface.has_instance;
    let mut nodes = Vec::new();
    if interface.has_instance {
        nodes.push(Node::line("bench_state_t state;"));
        nodes.push(
            Node::line("memset(&state, 0, sizeof state);")
                .note("including the padding between members"),
        );
        nodes.push(Node::line("memcpy(&state.self, &self, sizeof self);"));
        if with_outputs {
            nodes.push(Node::line("memcpy(&state.out, &out, sizeof out);"));
        }
        nodes.push(Node::line("const int64_t number = (int64_t)bench_instance(&state);"));
    } else {
        nodes.push(Node::line("const int64_t number = 0;"));
    }
    nodes.push(Node::line("bench_print(number);"));
    nodes.push(Node::line("putchar('\\n');"));
    nodes.push(Node::line("bench_answered(number);"));
    let batch = vec![
        Node::line("fflush(stdout);").note("the caller waits for it"),
        Node::when("!bench_number(&left)", vec![Node::line("break;")]),
        Node::line("bench_end_of_line();"),
    ];
    nodes.push(Node::when("left == 0", batch));
    nodes.push(Node::line("--left;"));
    nodes.push(Node::line("int64_t from = 0;"));
    nodes.push(Node::when("!bench_number(&from)", vec![Node::line("break;")]));
    if interface.has_instance {
        nodes.push(Node::when("from < 0", vec![Node::line("from = bench_after[-1 - from];")]));
        nodes.push(Node::line("memcpy(&self, &bench_seen[from].self, sizeof self);"));
    }
    if with_outputs {
        nodes.push(Node::line("memcpy(&out, &bench_seen[from].out, sizeof out);"));
    } else if interface.has_out {
        nodes.push(Node::line("memset(&out, 0x55, sizeof out);"));
    }
    nodes
}

pub(crate) fn arguments(interface: &Interface, step: bool) -> String {
    let mut all = Vec::new();
    if interface.has_instance {
        all.push("&self");
    }
    if step && interface.has_in {
        all.push("&in");
    }
    if step && interface.ticks.is_some() {
        all.push("ticks");
    }
    if interface.has_out {
        all.push("&out");
    }
    all.join(", ")
}

/// The library functions, which answer from the stimulus.
fn stand_ins(net: &Net, interface: &Interface) -> Vec<Node> {
    let prefix = &interface.names.prefix;
    let mut nodes = Vec::new();
    for (id, input) in net.inputs.iter().filter(|(_, it)| it.kind == InputKind::Extern) {
        let name = &interface.names.inputs[id];
        let stimulus = format!("{prefix}_stimulus_{name}");
        let value = if input.ty.is_bool() {
            format!("{stimulus} != 0")
        } else {
            format!("({}){stimulus}", storage(input.ty))
        };
        nodes.push(Node::line(format!("static int64_t {stimulus};")));
        nodes.push(Node::function(
            format!("{} {name}(void)", storage(input.ty)),
            vec![Node::line(format!("return {value};"))],
        ));
    }
    for (id, output) in net.outputs.iter() {
        let Driver::Extern { params, .. } = &output.driver else { continue };
        let name = &interface.names.outputs[id];
        let calls = format!("{prefix}_calls_{name}");
        let mut body = Vec::new();
        for (index, _) in params.iter().enumerate() {
            let joint = if index == 0 {
                format!("{calls}.count > 0 ? ';' : '\\0'")
            } else {
                "':'".to_string()
            };
            body.push(Node::line(format!("bench_add(&{calls}, p{index}, {joint});")));
        }
        body.push(Node::line(format!("++{calls}.count;")));
        let list: Vec<String> = params
            .iter()
            .enumerate()
            .map(|(index, param)| format!("{} p{index}", storage(param.ty)))
            .collect();
        let list = if list.is_empty() { "void".to_string() } else { list.join(", ") };
        nodes.push(Node::line(format!("static bench_calls_t {calls};")));
        nodes.push(Node::function(format!("void {name}({list})"), body));
    }
    nodes.extend(callback_check::functions(net, interface));
    nodes
}

/// The heading of the trace.
fn columns(net: &Net, interface: &Interface) -> Vec<String> {
    let mut all = vec!["scan".to_string(), "dt".to_string()];
    all.extend(
        net.inputs
            .values()
            .filter(|it| it.kind != InputKind::InternalEvent)
            .map(|it| it.name.text.clone()),
    );
    all.push("steps".to_string());
    all.extend(net.outputs.values().map(|it| it.name.text.clone()));
    for var in net.vars.values().filter(|it| it.origin == VarOrigin::Declared) {
        match var.len {
            None => all.push(var.name.text.clone()),
            Some(len) => all.extend((0..len).map(|index| format!("{}[{index}]", var.name.text))),
        }
    }
    if interface.has_fault {
        all.push("fault".to_string());
    }
    all.iter().map(|name| string_text(name)).collect()
}

/// The steps that a trace shows.
pub(crate) fn columns_of_steps(net: &Net) -> Vec<StepId> {
    net.steps.iter().filter(|(_, step)| shown(step.kind, step.hidden)).map(|(id, _)| id).collect()
}

/// Prints one row.
fn row(net: &Net, interface: &Interface) -> Vec<Node> {
    let prefix = &interface.names.prefix;
    let value =
        |text: &str| vec![Node::line("putchar(',');"), Node::line(format!("bench_print({text});"))];
    let mut nodes = vec![Node::line("bench_print(scan);")];
    nodes.extend(value("dt"));
    for (id, input) in net.inputs.iter() {
        let name = &interface.names.inputs[id];
        match input.kind {
            InputKind::Pin | InputKind::Event => {
                nodes.extend(value(
                    &interface.names.io.read(Structure::Local("in"), name, id, input.ty).text,
                ));
            }
            InputKind::Extern => nodes.extend(value(&format!("{prefix}_stimulus_{name}"))),
            InputKind::InternalEvent => {}
        }
    }
    let visible = columns_of_steps(net);
    nodes.push(Node::line("putchar(',');"));
    if !visible.is_empty() {
        let this = if interface.has_instance { "&self, " } else { "" };
        let mut listed = vec![Node::line("const char *blank = \"\";")];
        for part in 0..visible.len().div_ceil(PART) {
            listed.push(Node::line(format!("bench_steps_{prefix}_{part}({this}&blank);")));
        }
        nodes.push(Node::line("{"));
        nodes.push(Kind::Nested(listed).into());
        nodes.push(Node::line("}"));
    }
    for (id, output) in net.outputs.iter() {
        let name = &interface.names.outputs[id];
        let Driver::Extern { params, .. } = &output.driver else {
            nodes.extend(value(&interface.names.io.lamp(Structure::Local("out"), name, id)));
            continue;
        };
        let calls = format!("{prefix}_calls_{name}");
        if params.is_empty() {
            nodes.extend(value(&format!("{calls}.count")));
        } else {
            nodes.push(Node::line("putchar(',');"));
            let print = Node::line(format!("fwrite({calls}.text, 1, {calls}.length, stdout);"));
            nodes.push(Node::when(&format!("{calls}.length > 0U"), vec![print]));
        }
    }
    for (id, var) in net.vars.iter().filter(|(_, it)| it.origin == VarOrigin::Declared) {
        let name = &interface.names.vars[id];
        match var.len {
            None => nodes.extend(value(&format!("{prefix}_var_{name}(&self)"))),
            Some(len) => nodes.push(
                Kind::Block(vec![Arm::new(
                    format!("for (uint32_t i = 0; i < {len}U; ++i)"),
                    value(&format!("{prefix}_var_{name}(&self, i)")),
                )])
                .into(),
            ),
        }
    }
    if interface.has_fault {
        let this = if interface.has_instance { "&self" } else { "" };
        nodes.extend(value(&format!("{prefix}_fault({this})")));
    }
    nodes.push(Node::line("putchar('\\n');"));
    nodes
}

/// The maximum number of steps that one function of the harness prints: compile time grows with the square of a function's calls.
const PART: usize = 200;

/// The functions that print the active steps, separated by blanks.
fn steps(net: &Net, interface: &Interface) -> Vec<Node> {
    let prefix = &interface.names.prefix;
    let (parameter, this) = if interface.has_instance {
        (format!("const {prefix}_t *self, "), "self")
    } else {
        (String::new(), "")
    };
    let visible = columns_of_steps(net);
    let mut nodes = Vec::new();
    for (part, steps) in visible.chunks(PART).enumerate() {
        let call = |id: &StepId| {
            let name = &interface.names.steps[*id];
            let text = string_text(&net.steps[*id].name.text);
            Node::line(format!("bench_name({prefix}_active_{name}({this}), \"{text}\", blank);"))
        };
        let head =
            format!("static void bench_steps_{prefix}_{part}({parameter}const char **blank)");
        nodes.push(Node::function(head, steps.iter().map(call).collect()));
        nodes.push(Node::blank());
    }
    nodes
}

/// Text inside a string literal: everything except plain letters as octal numbers, which end after three digits.
pub(crate) fn string_text(text: &str) -> String {
    let mut out = String::new();
    for byte in text.bytes() {
        if byte.is_ascii_alphanumeric() || b" _.,[]-+".contains(&byte) {
            out.push(char::from(byte));
        } else {
            out.push_str(&format!("\\{byte:03o}"));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_any_letters_stand_in_strings() {
        assert_eq!(string_text("m1.s"), "m1.s");
        assert_eq!(string_text("é\"1"), "\\303\\251\\0421");
    }
}
