//! Test benches for machines without files, console or much memory: the chart on a microcontroller, driven byte by byte.
//!
//! The bench is the same text for every machine, and may contain several charts. A *port* has three functions that differ between machines: `bench_get` (the next byte
//! of the stimulus), `bench_put` (one byte of the response) and `bench_end` (stop the machine). The machine formats nothing: the response contains values,
//! and the caller, who knows the net, turns them into rows.
//!
//! Stimulus, for each reaction: a byte 1, the ticks (4 bytes), each input with a column in declaration order (as wide as it is stored, a Boolean one
//! byte); after the last reaction, a byte 0. Numbers have their low byte first, which is how each of these machines stores them.
//!
//! Response, for `init` and each reaction: for each call of an extern action, its index among the outputs plus 1 (2 bytes) and its arguments; 2 zero bytes;
//! the bits of the shown steps, eight per byte; each output except extern actions; each declared variable, arrays element by element; the fault flag.

use crate::Package;
use crate::c::print::{Kind, Node, Writer};
use crate::harness::{arguments, columns_of_steps};
use crate::interface::Interface;
use crate::io::Structure;
use grafsynth_c::storage;
use grafsynth_ir::Valid;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Driver, InputKind, Net, StepId, VarOrigin};
use itertools::Itertools as _;

/// The name of the header that a port provides: `bench_get`, `bench_put`, `bench_end`, `bench_begin`.
pub const PORT: &str = "bench_port.h";

/// The steps whose bits are in a response, in this order.
#[must_use]
pub fn shown_steps(net: &Net) -> Vec<StepId> {
    columns_of_steps(net)
}

/// The number of bytes in which emitted C stores a value of this type.
#[must_use]
pub fn stored_bytes(ty: Type) -> usize {
    match storage(ty) {
        "bool" | "uint8_t" | "int8_t" => 1,
        "uint16_t" | "int16_t" => 2,
        "uint32_t" | "int32_t" => 4,
        _ => 8,
    }
}

/// The `main` of one or more charts, which respond one after the other. Compile it with the package's sources and a port (see the module), without
/// `NAME_user.c`.
///
/// If there are several charts, their prefixes must differ ([`crate::Options::prefix`]), and their sources must be wrapped by [`renamed`], because libraries
/// may have functions with equal names.
#[must_use]
pub fn firmware(all: &[(&Valid<Net>, &Package)]) -> String {
    let charts = all.iter().map(|(net, _)| net.name.to_string()).join(", ");
    let title = format!("{charts}: runs on a microcontroller.");
    let mut text = Writer::write(&[
        Node::comment(title),
        Node::directive(format!("#include \"{PORT}\"")),
        Node::directive("#include <stdbool.h>"),
        Node::blank(),
    ])
    .0;
    text.push_str(&Writer::write(&bytes()).0);
    let mut main = vec![Node::line("bench_begin();")];
    // Not every chart calls all of them.
    for helper in ["bench_send", "bench_receive", "bench_fill"] {
        main.push(Node::line(format!("(void){helper};")));
    }
    for (net, package) in all {
        let prefix = &package.interface.names.prefix;
        let stem = package.stem();
        let mut chart = vec![Node::directive(format!("#include \"{stem}.h\""))];
        if package.interface.has_library {
            chart.push(Node::directive(format!("#include \"{stem}_user.h\"")));
        }
        chart.push(Node::blank());
        chart.extend(run(net, &package.interface, None));
        let chart = Writer::write(&chart).0;
        text.push_str(&if all.len() > 1 { renamed(net, package, &chart) } else { chart });
        main.push(Node::line(format!("{prefix}_run();")));
    }
    main.push(Node::line("bench_end();"));
    main.push(Node::line("return 0;"));
    text.push_str(&Writer::write(&[Node::function("int main(void)", main)]).0);
    text
}

/// A text of a chart in which the library functions get the chart's name as a prefix, so that other libraries may use the same names.
#[must_use]
pub fn renamed(net: &Valid<Net>, package: &Package, text: &str) -> String {
    let names = &package.interface.names;
    let mut functions = crate::names::library(net, names);
    functions.sort_unstable();
    functions.dedup();
    let define = |name: &String| format!("#define {name} {}_lib_{name}\n", names.prefix);
    let undefine = |name: &String| format!("#undef {name}\n");
    let before: String = functions.iter().map(define).collect();
    let after: String = functions.iter().map(undefine).collect();
    format!("{before}{text}{after}")
}

/// How the C of a link calls the part of a chart on a CPU, together with its chips.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LinkCalls {
    /// The prefix of the link: NAME in `NAME_link_round`.
    pub name: String,
    /// The members of `NAME_link_in_t`, with the types of the inputs.
    pub members: Vec<(String, Type)>,
    /// The type of the parameter `dt`, if there is one.
    pub dt: Option<String>,
}

/// The `main` of the part of a chart on a CPU, which makes each reaction through its link. The stimulus of a reaction has the members of `NAME_link_in_t`, then the
/// extern conditions of the part; the response is that of the part, as in [`firmware`].
#[must_use]
pub fn linked(net: &Valid<Net>, package: &Package, calls: &LinkCalls) -> String {
    let mut nodes = vec![
        Node::comment(format!("{}: runs with its chips.", net.name)),
        Node::directive(format!("#include \"{PORT}\"")),
        Node::directive("#include <stdbool.h>"),
        Node::directive(format!("#include \"{}_link.h\"", calls.name)),
    ];
    if package.interface.has_library {
        nodes.push(Node::directive(format!("#include \"{}_user.h\"", package.stem())));
    }
    nodes.push(Node::blank());
    nodes.extend(bytes());
    nodes.extend(run(net, &package.interface, Some(calls)));
    let mut main = vec![Node::line("bench_begin();")];
    for helper in ["bench_send", "bench_receive", "bench_fill"] {
        main.push(Node::line(format!("(void){helper};")));
    }
    let prefix = &package.interface.names.prefix;
    main.extend([
        Node::line(format!("{prefix}_run();")),
        Node::line("bench_end();"),
        Node::line("return 0;"),
    ]);
    nodes.push(Node::function("int main(void)", main));
    Writer::write(&nodes).0
}

/// The user's functions and `NAME_run`, which responds until its stimulus ends.
fn run(net: &Net, interface: &Interface, link: Option<&LinkCalls>) -> Vec<Node> {
    let prefix = &interface.names.prefix;
    let mut nodes = library(net, interface);
    nodes.extend(callbacks(interface));
    let mut body = Vec::new();
    let structure = match link {
        Some(link) => format!("static {}_link_in_t in;", link.name),
        None => format!("static {prefix}_in_t in;"),
    };
    for (has, declaration) in [
        (interface.has_instance, format!("static {prefix}_t self;")),
        (link.map_or(interface.has_in, |link| !link.members.is_empty()), structure),
        (interface.has_out, format!("static {prefix}_out_t out;")),
    ] {
        if has {
            body.push(Node::line(declaration));
        }
    }
    body.push(Node::line("uint32_t dt = 0U;"));
    for (has, place) in [(interface.has_instance, "self"), (interface.has_out, "out")] {
        if has {
            body.push(
                Node::line(format!("bench_fill(&{place}, (uint16_t)sizeof {place});"))
                    .note("memory that init does not set must not affect the result"),
            );
        }
    }
    let init = match link {
        Some(link) => format!("{}_link_init({});", link.name, arguments(interface, false)),
        None => format!("{prefix}_init({});", arguments(interface, false)),
    };
    body.push(Node::line(init));
    let mut round = row(net, interface);
    round.push(Node::when("bench_get() != 1U", vec![Node::line("break;")]));
    round.push(Node::line("bench_receive(&dt, 4U);"));
    if let Some(link) = link {
        round.extend(link.members.iter().map(|(name, ty)| received(&format!("in.{name}"), *ty)));
        round.extend(conditions(net, interface));
        round.extend(linked_round(interface, link));
    } else {
        round.extend(inputs(net, interface));
        round.extend(step(interface));
    }
    body.push(Node::block("for (;;)", round));
    nodes.push(Node::function(format!("static void {prefix}_run(void)"), body));
    nodes.push(Node::blank());
    nodes
}

/// The call of `NAME_step`.
fn step(interface: &Interface) -> Vec<Node> {
    let prefix = &interface.names.prefix;
    let call = Node::line(format!("{prefix}_step({});", arguments(interface, true)));
    let Some(ticks) = interface.ticks else { return vec![call] };
    let (name, most) = (ticks.name(), ticks.max());
    let clip = format!("const {name} ticks = ({name})((dt > {most}UL) ? {most}UL : dt);");
    scope(vec![Node::line(clip), call]).to_vec()
}

/// The call of `NAME_link_round`.
fn linked_round(interface: &Interface, link: &LinkCalls) -> Vec<Node> {
    let ticks = link.dt.as_ref().map(|ty| format!("({ty})dt"));
    let all = [
        interface.has_instance.then(|| "&self".to_owned()),
        (!link.members.is_empty()).then(|| "&in".to_owned()),
        ticks,
        interface.has_out.then(|| "&out".to_owned()),
    ];
    let arguments = all.into_iter().flatten().join(", ");
    vec![Node::line(format!("{}_link_round({arguments});", link.name))]
}

/// Input and output of numbers of any width.
fn bytes() -> Vec<Node> {
    vec![
        Node::function(
            "static void bench_send(const void *from, uint8_t n)",
            vec![
                Node::line("const uint8_t *bytes = (const uint8_t *)from;"),
                Node::block("while (n-- > 0U)", vec![Node::line("bench_put(*bytes++);")]),
            ],
        ),
        Node::blank(),
        Node::function(
            "static void bench_receive(void *to, uint8_t n)",
            vec![
                Node::line("uint8_t *bytes = (uint8_t *)to;"),
                Node::block("while (n-- > 0U)", vec![Node::line("*bytes++ = bench_get();")]),
            ],
        ),
        Node::blank(),
        Node::function(
            "static void bench_fill(void *to, uint16_t n)",
            vec![
                Node::line("uint8_t *bytes = (uint8_t *)to;"),
                Node::block("while (n-- > 0U)", vec![Node::line("*bytes++ = 0x55U;")]),
            ],
        ),
        Node::blank(),
    ]
}

/// A separate block, for locals.
fn scope(body: Vec<Node>) -> [Node; 3] {
    [Node::line("{"), Kind::Nested(body).into(), Node::line("}")]
}

/// Sends `value` as it is stored.
fn send(value: &str, ty: Type) -> Vec<Node> {
    match ty {
        Type::Bool => vec![Node::line(format!("bench_put(({value}) ? 1U : 0U);"))],
        Type::Int { .. } => scope(vec![
            Node::line(format!("const {} value = {value};", storage(ty))),
            Node::line("bench_send(&value, (uint8_t)sizeof value);"),
        ])
        .to_vec(),
    }
}

/// The user's functions: conditions are answered from the stimulus, and calls of actions are reported when they happen.
fn library(net: &Net, interface: &Interface) -> Vec<Node> {
    let mut nodes = Vec::new();
    for (id, input) in net.inputs.iter().filter(|(_, it)| it.kind == InputKind::Extern) {
        let (name, ty) = (&interface.names.inputs[id], storage(input.ty));
        let prefix = &interface.names.prefix;
        nodes.push(Node::line(format!("static {ty} {prefix}_stimulus_{name};")));
        nodes.push(Node::function(
            format!("{ty} {}(void)", interface.names.provided[&id]),
            vec![Node::line(format!("return {prefix}_stimulus_{name};"))],
        ));
        nodes.push(Node::blank());
    }
    for (id, output) in net.outputs.iter() {
        let Driver::Extern { params, .. } = &output.driver else { continue };
        let number = id.index() + 1;
        let mut body = vec![
            Node::line(format!("bench_put({}U);", number & 0xff)),
            Node::line(format!("bench_put({}U);", number >> 8 & 0xff)),
        ];
        let mut list = Vec::new();
        for (index, param) in params.iter().enumerate() {
            body.extend(send(&format!("p{index}"), param.ty));
            list.push(format!("{} p{index}", storage(param.ty)));
        }
        let list = if list.is_empty() { "void".to_string() } else { list.join(", ") };
        nodes.push(Node::function(format!("void {}({list})", interface.names.outputs[id]), body));
        nodes.push(Node::blank());
    }
    nodes
}

/// Callback functions that do nothing.
fn callbacks(interface: &Interface) -> Vec<Node> {
    let prefix = &interface.names.prefix;
    if !interface.callbacks || !interface.has_instance {
        return Vec::new();
    }
    vec![
        Node::function(
            format!("void {prefix}_activated({prefix}_step_t step, bool active)"),
            vec![Node::line("(void)step;"), Node::line("(void)active;")],
        ),
        Node::blank(),
        Node::function(
            format!("void {prefix}_enabled({prefix}_transition_t transition)"),
            vec![Node::line("(void)transition;")],
        ),
        Node::blank(),
    ]
}

/// The code that sends the response of one reaction.
fn row(net: &Net, interface: &Interface) -> Vec<Node> {
    let prefix = &interface.names.prefix;
    let this = if interface.has_instance { "&self" } else { "" };
    let mut nodes = vec![Node::line("bench_put(0U);"), Node::line("bench_put(0U);")];
    for eight in shown_steps(net).chunks(8) {
        let mut body = vec![Node::line("uint8_t bits = 0U;")];
        for (bit, step) in eight.iter().enumerate() {
            let active = format!("{prefix}_active_{}({this})", interface.names.steps[*step]);
            let mask = 1u32 << bit;
            body.push(Node::when(&active, vec![Node::line(format!("bits |= {mask}U;"))]));
        }
        body.push(Node::line("bench_put(bits);"));
        nodes.extend(scope(body));
    }
    for (id, output) in net.outputs.iter() {
        if !output.is_extern() {
            let place =
                interface.names.io.lamp(Structure::Local("out"), &interface.names.outputs[id], id);
            nodes.extend(send(&place, output.ty));
        }
    }
    for (id, var) in net.vars.iter().filter(|(_, it)| it.origin == VarOrigin::Declared) {
        let name = &interface.names.vars[id];
        match var.len {
            None => nodes.extend(send(&format!("{prefix}_var_{name}(&self)"), var.ty)),
            Some(len) => {
                let element = send(&format!("{prefix}_var_{name}(&self, i)"), var.ty);
                nodes.extend(scope(vec![
                    Node::line("uint32_t i;"),
                    Node::block(format!("for (i = 0U; i < {len}UL; ++i)"), element),
                ]));
            }
        }
    }
    nodes.push(Node::line(if interface.has_fault {
        format!("bench_put({prefix}_fault({this}) ? 1U : 0U);")
    } else {
        "bench_put(0U);".to_string()
    }));
    nodes
}

/// The statement that receives a value.
fn received(place: &str, ty: Type) -> Node {
    Node::line(if ty.is_bool() {
        format!("{place} = bench_get() != 0U;")
    } else {
        format!("bench_receive(&{place}, (uint8_t)sizeof {place});")
    })
}

/// The code that receives the inputs of one reaction.
fn inputs(net: &Net, interface: &Interface) -> Vec<Node> {
    let mut nodes = Vec::new();
    for (id, input) in net.inputs.iter().filter(|(_, it)| it.kind != InputKind::InternalEvent) {
        let name = &interface.names.inputs[id];
        nodes.push(if input.kind == InputKind::Extern {
            condition(name, input.ty, interface)
        } else if input.ty.is_bool() {
            Node::line(interface.names.put(Structure::Local("in"), id, "bench_get() != 0U"))
        } else {
            received(&format!("in.{name}"), input.ty)
        });
    }
    nodes
}

/// The code that receives the extern conditions of one reaction.
fn conditions(net: &Net, interface: &Interface) -> Vec<Node> {
    let all = net.inputs.iter().filter(|(_, it)| it.kind == InputKind::Extern);
    all.map(|(id, it)| condition(&interface.names.inputs[id], it.ty, interface)).collect()
}

fn condition(name: &str, ty: Type, interface: &Interface) -> Node {
    received(&format!("{}_stimulus_{name}", interface.names.prefix), ty)
}
