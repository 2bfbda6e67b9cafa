//! `host.c`: the chart on the machine that compiles it, driven by numbers on standard input.

use super::Chart;
use crate::c::print::{Kind, Node, Writer, comment_text};
use crate::harness::{arguments, columns_of_steps, string_text};
use crate::io::Structure;
use grafsynth_c::storage;
use itertools::Itertools as _;

/// The text; `include` is the path by which it includes `NAME.h`.
pub(super) fn text(chart: &Chart<'_>, include: &str) -> String {
    let (net, interface) = (chart.net, &chart.package.interface);
    let (prefix, names) = (chart.name(), &interface.names);
    let inputs: Vec<_> = net.inputs.iter().filter(|(_, it)| it.kind.is_handed()).collect();
    let mut columns: Vec<String> = Vec::new();
    columns.extend(interface.ticks.map(|_| "ticks".to_owned()));
    columns.extend(inputs.iter().map(|(_, it)| comment_text(&it.name.text)));
    let row = if columns.is_empty() { "nothing".to_owned() } else { columns.join(" ") };
    let mut nodes = vec![
        Node::comment(format!(
            "{}: runs the chart here. Each line of standard input is a reaction, numbers separated by blanks:\n{row}\nThe first line of standard output is a heading. Each further line has the scan, the active steps and the outputs;\nthe first of these is the state after reset.",
            comment_text(&net.name.text)
        )),
        Node::directive(format!("#include {include}")),
        Node::directive("#include <stdio.h>"),
        Node::blank(),
    ];
    nodes.push(Kind::Verbatim(READ.to_owned()).into());
    nodes.push(Node::blank());
    if interface.ticks.is_some() || !inputs.is_empty() {
        nodes.push(Kind::Verbatim(NUMBER.to_owned()).into());
        nodes.push(Node::blank());
    }
    nodes.push(Kind::Verbatim(END_LINE.to_owned()).into());
    nodes.push(Node::blank());
    nodes.push(Node::function(
        format!("static void print_row({})", row_parameters(chart)),
        print_row(chart),
    ));
    nodes.push(Node::blank());
    let variables = interface.variables(interface.has_in);
    let mut body: Vec<Node> = variables.map(|it| Node::line(format!("static {it}"))).collect();
    body.push(Node::line("long scan = 0;"));
    body.push(Node::blank());
    let heading = ["scan".to_owned(), "steps".to_owned()]
        .into_iter()
        .chain(
            net.outputs.values().filter(|it| !it.is_extern()).map(|it| string_text(&it.name.text)),
        )
        .join(",");
    body.push(Node::line(format!("puts(\"{heading}\");")));
    body.push(Node::line(format!("{prefix}_init({});", arguments(interface, false))));
    body.push(Node::line(format!("print_row({});", row_arguments(chart))));
    let mut round = Vec::new();
    if let Some(ticks) = interface.ticks {
        round.push(Node::line(format!(
            "const {0} ticks = ({0})number(0, {1});",
            ticks.name(),
            ticks.max()
        )));
    }
    for (id, input) in &inputs {
        let (lo, hi) = input.ty.bounds();
        let value = if input.ty.is_bool() {
            "number(0, 1) != 0".to_owned()
        } else {
            format!("({})number({lo}, {hi})", storage(input.ty))
        };
        let mut source = value;
        if names.io.input_bit(*id).is_some() {
            // The macro evaluates the value twice.
            let local = format!("bit_{}", names.inputs[*id]);
            round.push(Node::line(format!("const bool {local} = {source};")));
            source = local;
        }
        round.push(Node::line(names.put(Structure::Local("in"), *id, &source)));
    }
    round.push(Node::line("end_line();"));
    round.push(Node::line(format!("{prefix}_step({});", arguments(interface, true))));
    round.push(Node::line("++scan;"));
    round.push(Node::line(format!("print_row({});", row_arguments(chart))));
    body.push(Node::block("while (more_lines())", round));
    body.push(Node::line("return 0;"));
    nodes.push(Node::function("int main(void)", body));
    Writer::write(&nodes).0
}

fn row_parameters(chart: &Chart<'_>) -> String {
    let (prefix, interface) = (chart.name(), &chart.package.interface);
    let mut all = vec!["long scan".to_owned()];
    if interface.has_instance {
        all.push(format!("const {prefix}_t *self"));
    }
    if interface.has_out {
        all.push(format!("const {prefix}_out_t *out"));
    }
    all.join(", ")
}

fn row_arguments(chart: &Chart<'_>) -> String {
    let interface = &chart.package.interface;
    let mut all = vec!["scan"];
    all.extend(interface.has_instance.then_some("&self"));
    all.extend(interface.has_out.then_some("&out"));
    all.join(", ")
}

/// Prints active steps, then outputs.
fn print_row(chart: &Chart<'_>) -> Vec<Node> {
    let (net, interface) = (chart.net, &chart.package.interface);
    let (prefix, names) = (chart.name(), &interface.names);
    let mut body = vec![
        Node::line("const char *blank = \"\";"),
        Node::blank(),
        Node::line("printf(\"%ld,\", scan);"),
    ];
    let this = if interface.has_instance { "self" } else { "" };
    for id in columns_of_steps(net) {
        let condition = format!("{prefix}_active_{}({this})", names.steps[id]);
        body.push(Node::when(
            &condition,
            vec![
                Node::line(format!(
                    "printf(\"%s%s\", blank, \"{}\");",
                    string_text(&net.steps[id].name.text)
                )),
                Node::line("blank = \" \";"),
            ],
        ));
    }
    for (id, _) in net.outputs.iter().filter(|(_, it)| !it.is_extern()) {
        let value = names.io.lamp(Structure::Behind("out"), &names.outputs[id], id);
        body.push(Node::line(format!("printf(\",%lld\", (long long)({value}));")));
    }
    body.push(Node::line("putchar('\\n');"));
    body.push(Node::line("(void)blank;"));
    if interface.has_instance {
        body.push(Node::line("(void)self;"));
    }
    body
}

const READ: &str = r"/* False at the end of the input. */
static int more_lines(void)
{
    const int next = getchar();
    if (next != EOF) {
        (void)ungetc(next, stdin);
    }
    return next != EOF;
}";

const NUMBER: &str = r"/* The next number of the line, limited to its range; 0 if the line has no more numbers. */
static long long number(long long least, long long most)
{
    int next = getchar();
    int is_negative = 0;
    long long value = 0;

    while (next == ' ' || next == ',' || next == '\t' || next == '\r') {
        next = getchar();
    }
    if (next == '-') {
        is_negative = 1;
        next = getchar();
    }
    while (next >= '0' && next <= '9') {
        if (value < 10000000000LL) {
            value = (value * 10) + (next - '0');
        }
        next = getchar();
    }
    if (next != EOF) {
        (void)ungetc(next, stdin);
    }
    value = is_negative ? -value : value;
    return value < least ? least : (value > most ? most : value);
}";

const END_LINE: &str = r"static void end_line(void)
{
    int next = getchar();
    while (next != '\n' && next != EOF) {
        next = getchar();
    }
}";
