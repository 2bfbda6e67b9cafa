//! The second kind of image: the reaction program of `grafsynth_ir::lower::program` as byte code. It is used for everything that the tables of states and
//! transitions have no columns for.
//!
//! `grafsynth_program.c` runs it. If the program calls an extern condition or action or reaches user text, the engine returns with a
//! number, `NAME.c` performs the call, and the engine continues: it needs no function pointers.

use super::bytes::{Assembler, Place, Places};
use super::check::{Evolution, most_instructions};
use super::handing::{as_type, clear_words, hand_in, hand_out};
use super::image::{Line, PROGRAM_HEADER, PROGRAM_KIND, VERSION, crc32, narrow};
use super::loading::Loading;
use super::ops::Machine;
use super::room::Room;
use super::{clear_array, member, size};
use crate::c::print::Node;
use crate::calls::{self, Callee};
use crate::cexpr::{CExpr, Class, Helpers, Prec};
use crate::names::{Names, library, namer};
use crate::refusal::{Failure, Refusal};
use crate::style_output::{StyleOutput, mentions};
use crate::times::Ticks;
use crate::{Object, Options, bits};
use grafsynth_ir::Gather;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::instance::{Carried, Holds, Local, LocalPart, Place as Held};
use grafsynth_ir::lower::program::{Additions, ProgramOptions, program_with};
use grafsynth_ir::net::{
    Driver, Evolution as Mode, InputId, InputKind, Leaf as NetLeaf, Net, Verbatim,
};
use grafsynth_ir::program::{Expr, Leaf, Origin, Program, Stmt, TempId, expressions, statements};
use grafsynth_ir::{IdMap, Valid};
use std::collections::BTreeSet;

/// The engine's own files.
pub(super) const FILES: [(&str, &str); 2] = [
    ("grafsynth_program.h", include_str!("grafsynth_program.h")),
    ("grafsynth_program.c", include_str!("grafsynth_program.c")),
];

/// The memory that a chart needs, and its parameters.
struct Needs {
    room: Room,
    /// See [`crate::Package::instructions`].
    instructions: Option<u64>,
    sets_fault: bool,
}

/// Emits the net as a program for the engine.
///
/// # Errors
/// See [`Failure`].
pub(crate) fn program(
    net: &Valid<Net>,
    facts: &Facts,
    names: &Names,
    options: &Options,
) -> Result<StyleOutput, Failure> {
    let additions = Additions { marks: options.trace.is_some(), ..Additions::default() };
    let program =
        program_with(net, &ProgramOptions::default(), additions).map_err(Failure::Errors)?;
    let ticks = bits::ticks(&program);
    let places = Places::of(net, &program);
    let sets_fault = net.settings.evolution != Mode::Single
        && (program.reset_fault || program.body.iter().any(bits::gives_fault));
    let (eager, lazy) = conditions(net, &program);
    let mut assembler = Assembler::new(net, &program, &places, &lazy, sets_fault);
    let reset = assembler.reset().map_err(Failure::Refused)?;
    let reaction = assembler.reaction(&eager).map_err(Failure::Refused)?;
    let evolution = assembler.evolution.zip(facts.most_rounds(net));
    let evolution = evolution.map(|(at, it)| Evolution { at, rounds: it.value.into() });
    let instructions = most_instructions(&reaction, evolution);
    let fired = if options.trace.is_some() { net.transitions.len() } else { 0 };
    let room = Room {
        is_program: true,
        interface: interface(net, &places, ticks),
        inputs: narrow(places.inputs.len()).into(),
        outputs: narrow(places.outputs.len()).into(),
        bits: size(places.n_bits.div_ceil(8)),
        values: size(places.n_values),
        flags: size(assembler.n_flags.div_ceil(8)),
        numbers: size(assembler.n_numbers),
        calls: narrow(places.actions.len()).into(),
        texts: narrow(places.texts.len()).into(),
        fired: narrow(fired).into(),
        rounds: u32::try_from(assembler.rounds).unwrap_or(u32::MAX),
        ..Room::default()
    };
    let counts = [places.n_bits, places.n_values, assembler.n_flags, assembler.n_numbers];
    let lines = image(&program, &places, counts, room.interface, reset, reaction);
    let length: usize = lines.iter().map(|line| line.bytes.len()).sum();
    let most = counts.into_iter().max().unwrap_or(0).max(length);
    if most > usize::from(u16::MAX) {
        return Err(Failure::Refused(Refusal {
            what: format!("a chart whose program needs {most} bytes or cells (at most 65535)"),
            span: net.name.span,
        }));
    }
    let needs = Needs { room, instructions, sets_fault };
    let locals = Locals::of(net, names);
    let carried = carried(&program, &assembler, &places, &locals);
    let output = emit(net, names, &program, &places, &needs, (&locals, ticks), &lines);
    Ok(StyleOutput { locals: carried, ..output })
}

/// What the memory of a reaction carries from one check to the next.
fn carried(
    program: &Program,
    assembler: &Assembler<'_>,
    places: &Places,
    locals: &Locals,
) -> Vec<(Local, Carried)> {
    let local = |place| match place {
        Place::Bit(at) => Local { name: locals.flags.clone(), part: LocalPart::Bit(at.into()) },
        Place::Number(at) => {
            Local { name: locals.numbers.clone(), part: LocalPart::Element(at.into()) }
        }
    };
    // What never changes carries nothing: without this, the proof would have to show that the limit is never exceeded.
    let changes = |temp: &TempId| {
        let mut values = statements(&program.body).filter_map(|stmt| {
            let Stmt::Set(to, value) = stmt else { return None };
            (to == temp).then_some(value)
        });
        values.next().is_some_and(|first| first.as_constant().is_none()) || values.next().is_some()
    };
    let temps = program.carried.iter().filter(|(temp, _)| changes(temp));
    let mut all: Vec<_> =
        temps.map(|(temp, what)| (local(assembler.place(*temp)), what.clone())).collect();
    for (input, flag) in assembler.asked() {
        all.push((local(flag), Carried::Asked(input)));
        let part = LocalPart::Element(places.inputs[&input].into());
        all.push((Local { name: locals.inputs.clone(), part }, Carried::Answer(input)));
    }
    all
}

/// Extern conditions that the program mentions: those that are called before each reaction, and those that are called when first needed.
fn conditions(net: &Net, program: &Program) -> (BTreeSet<InputId>, BTreeSet<InputId>) {
    let used: BTreeSet<InputId> =
        expressions(&program.body).flat_map(Expr::leaves).filter_map(Leaf::input).gather();
    let in_edges: BTreeSet<InputId> = (net.edges.values())
        .flat_map(|edge| edge.expr.leaves())
        .filter_map(NetLeaf::input)
        .gather();
    used.into_iter()
        .filter(|input| net.inputs[*input].kind == InputKind::Extern)
        .partition(|input| in_edges.contains(input))
}

/// Like the interface number of tables, but extern functions and C texts count too.
fn interface(net: &Net, places: &Places, ticks: Option<Ticks>) -> u32 {
    let mut text = super::interface_text(net, ticks);
    text.push_str("program\n");
    for (_, input) in net.inputs.iter().filter(|(_, it)| it.kind == InputKind::Extern) {
        text.push_str(&format!("asks {} {:?}\n", input.name, input.ty.bounds()));
    }
    for output in &places.actions {
        let output = &net.outputs[*output];
        if let Driver::Extern { params, .. } = &output.driver {
            let types: Vec<_> = params.iter().map(|param| param.ty.bounds()).collect();
            text.push_str(&format!("calls {} {types:?}\n", output.name));
        }
    }
    for own in &places.texts {
        text.push_str(&format!("text {own}\n"));
    }
    crc32(text.as_bytes())
}

/// The image as lines.
fn image(
    program: &Program,
    places: &Places,
    counts: [usize; 4],
    interface: u32,
    reset: Vec<u8>,
    reaction: Vec<u8>,
) -> Vec<Line> {
    let mut rows: Vec<Line> = Vec::new();
    for (cell, first, many) in &places.rows {
        let cell = &program.cells[*cell];
        let (lo, hi) = cell.ty.bounds();
        let mut bytes = narrow(*first).to_le_bytes().to_vec();
        bytes.extend(narrow(*many).to_le_bytes());
        for bound in [lo, hi] {
            // Ranges fit in 32 bits: cells that are not variables count ticks or tokens.
            bytes.extend(i32::try_from(bound).unwrap_or(i32::MAX).to_le_bytes());
        }
        rows.push(Line { bytes, title: None, note: cell.name.clone(), object: None });
    }
    let length = PROGRAM_HEADER
        + rows.iter().map(|row| row.bytes.len()).sum::<usize>()
        + reset.len()
        + reaction.len();
    let mut header = b"GSTB".to_vec();
    header.extend([VERSION, PROGRAM_KIND]);
    header.extend(narrow(length).to_le_bytes());
    header.extend([0; 4]);
    header.extend(interface.to_le_bytes());
    for count in counts {
        header.extend(narrow(count).to_le_bytes());
    }
    for count in [rows.len(), reset.len(), reaction.len()] {
        header.extend(narrow(count).to_le_bytes());
    }
    header.resize(PROGRAM_HEADER, 0);
    let title = "header: magic, version, kind, length, checksum, interface, numbers of bits, values, flags, numbers, cells, bytes of reset and of reaction";
    let line = |bytes, title| Line { bytes, title: Some(title), note: String::new(), object: None };
    let mut lines = vec![line(header, title)];
    if let Some(first) = rows.first_mut() {
        first.title = Some("cells: first value, number of values, minimum, maximum");
    }
    lines.extend(rows);
    lines.push(line(reset, "reset"));
    lines.push(line(reaction, "reaction"));
    super::image::seal(&mut lines);
    lines
}

// --- text --------------------------------------------------------------------------------------------------------------------------------------

/// Locals of the emitted functions; functions of the user's library may have the same names.
struct Locals {
    run: String,
    inputs: String,
    outputs: String,
    flags: String,
    numbers: String,
    wants: String,
    room: String,
    found: String,
}

impl Locals {
    fn of(net: &Net, names: &Names) -> Self {
        let mut all = namer();
        library(net, names).iter().for_each(|function| all.reserve(function));
        let mut name = |text: &str| all.name(text);
        Locals {
            run: name("run"),
            inputs: name("inputs"),
            outputs: name("outputs"),
            flags: name("flags"),
            numbers: name("numbers"),
            wants: name("wants"),
            room: name("room"),
            found: name("found"),
        }
    }
}

fn emit(
    net: &Net,
    names: &Names,
    program: &Program,
    places: &Places,
    needs: &Needs,
    (locals, ticks): (&Locals, Option<Ticks>),
    lines: &[Line],
) -> StyleOutput {
    let loading = Loading { names, room: &needs.room, locals: [&locals.room, &locals.found] };
    let mut instance =
        loading.instance(["the program that it runs", "steps, truth values", "numbers"]);
    if needs.sets_fault {
        instance.push(member(
            "bool fault",
            "the last reaction did not become stable, or a queue was full",
        ));
    }
    let mut helpers = Helpers::default();
    let (mut functions, going) = services(net, names, places, needs, locals, &mut helpers);
    let reset = reaction(net, names, places, needs, ticks, locals, &going, true);
    let step = reaction(net, names, places, needs, ticks, locals, &going, false);
    functions.extend(loading.functions("this program", reset));
    let values = values(program, places);
    let fault = needs.sets_fault.then(|| (Held::member("fault"), Holds::Piece(Origin::Fault, 0)));
    StyleOutput {
        style: "engine with a program",
        instance,
        active: IdMap::build(&net.steps, |id, _| {
            let cell = program.cells.iter().find(|(_, cell)| cell.origin == Origin::Step(id));
            match cell.map(|(cell, _)| places.cells[cell]) {
                Some(Place::Bit(at)) => format!("gs_bit(self->bits, {at}U)"),
                Some(Place::Number(_)) | None => "false".to_owned(),
            }
        }),
        fault: needs.sets_fault.then(|| "self->fault".to_owned()),
        has_fault: net.settings.evolution != Mode::Single,
        ticks,
        functions,
        init: loading.init(),
        step,
        helpers,
        holds: holds(program, places).into_iter().chain(fault).collect(),
        engine: Some(loading.engine(FILES, Machine::Wide, needs.instructions, values, lines)),
        ..StyleOutput::default()
    }
}

/// The contents of the bits and values of the instance.
fn holds(program: &Program, places: &Places) -> Vec<(Held, Holds)> {
    let mut all = Vec::new();
    for (id, cell) in program.cells.iter() {
        match places.cells[id] {
            Place::Bit(at) => {
                let bit = u32::from(at);
                let place = Held { bit: Some(bit % 8), ..Held::element("bits", bit / 8) };
                all.push((place, Holds::Piece(cell.origin, 0)));
            }
            Place::Number(row) => {
                let first = u32::from(places.first(row));
                all.extend((0..cell.len.unwrap_or(1)).map(|at| {
                    (Held::element("values", first + at), Holds::Piece(cell.origin, at))
                }));
            }
        }
    }
    all
}

/// The expression that reads each variable.
fn values(
    program: &Program,
    places: &Places,
) -> std::collections::BTreeMap<grafsynth_ir::net::VarId, String> {
    let mut all = std::collections::BTreeMap::new();
    for (id, cell) in program.cells.iter() {
        let Origin::Var(var) = cell.origin else { continue };
        let text = match places.cells[id] {
            Place::Bit(at) => format!("gs_bit(self->bits, {at}U)"),
            Place::Number(row) => {
                let first = places.rows.get(usize::from(row)).map_or(0, |(_, first, _)| *first);
                let value = match cell.len {
                    Some(_) => format!("self->values[{first}U + i]"),
                    None => format!("self->values[{first}]"),
                };
                as_type(cell.ty, &value)
            }
        };
        all.insert(var, text);
    }
    all
}

/// What the engine requests: the functions that perform it, and the cases of the loop that drives a reaction.
struct Services<'a> {
    net: &'a Net,
    names: &'a Names,
    places: &'a Places,
    locals: &'a Locals,
    functions: Vec<Node>,
    arms: Vec<Node>,
}

impl Services<'_> {
    /// A request that a function performs: it selects by a number, unless there is nothing to select.
    fn select(
        &mut self,
        code: &str,
        what: &str,
        head: &str,
        number: &str,
        call: String,
        cases: Vec<Node>,
    ) {
        if cases.is_empty() {
            return;
        }
        let head = format!("static void {}_{head}", self.names.prefix);
        self.functions.extend(Node::documented(what, head, vec![Node::switch(number, cases)]));
        self.arms.push(Node::case(code, vec![Node::line(format!("{}_{call}", self.names.prefix))]));
    }

    /// Calls of extern conditions.
    fn conditions(&mut self) {
        let (names, inputs, run) = (self.names, &self.locals.inputs, &self.locals.run);
        let asked = self.net.inputs.iter().filter(|(_, it)| it.kind == InputKind::Extern);
        let cases = asked.map(|(id, input)| {
            let function = &names.inputs[id];
            let value = if input.ty.is_bool() {
                format!("{function}() ? 1 : 0")
            } else {
                format!("(int32_t){function}()")
            };
            let at = self.places.inputs[&id];
            let line = Node::line(format!("{inputs}[{at}] = {value};"));
            Node::case(format!("{at}U"), vec![line.about(Object::Input(id))])
        });
        let cases = cases.collect();
        let head = format!("ask(uint16_t number, int32_t {inputs}[])");
        let call = format!("ask({run}->number, {inputs});");
        self.select("GP_ASK", "Calls an extern condition.", &head, "number", call, cases);
    }

    /// Calls of extern actions.
    fn actions(&mut self, helpers: &mut Helpers) {
        let (net, names, run) = (self.net, self.names, &self.locals.run);
        let mut cases = Vec::new();
        for (number, output) in self.places.actions.iter().enumerate() {
            let Driver::Extern { params, .. } = &net.outputs[*output].driver else { continue };
            let arguments = params.iter().enumerate().map(|(at, param)| {
                let text = format!("{run}->stack[{at}]");
                if param.ty.is_bool() {
                    CExpr::condition(format!("{text} != 0"), Prec::Compare)
                } else {
                    CExpr::exact(text, Prec::Atom, Class::Huge, (i64::MIN, i64::MAX))
                }
            });
            let arguments = arguments.collect();
            let callee = Callee { net, names, output: *output };
            cases.push(Node::case(format!("{number}U"), vec![callee.call(arguments, helpers)]));
        }
        let (head, number) = (format!("call(const gp_run_t *{run})"), format!("{run}->number"));
        let call = format!("call({run});");
        self.select("GP_CALL", "Calls an extern action.", &head, &number, call, cases);
    }

    /// Code blocks of the chart.
    fn texts(&mut self) {
        let texts = self.places.texts.iter().enumerate();
        let cases: Vec<Node> = texts
            .map(|(number, text)| {
                let text = Verbatim { language: "c".to_owned(), text: text.clone() };
                Node::case(format!("{number}U"), calls::verbatim(&text))
            })
            .collect();
        let (parameters, arguments) = parameters(self.names, self.net, &cases);
        let head = format!("text({parameters}uint16_t number)");
        let call = format!("text({arguments}{}->number);", self.locals.run);
        self.select("GP_TEXT", "Runs a code block of the chart.", &head, "number", call, cases);
    }
}

/// The services for the engine: functions, and the loop that drives a reaction.
fn services(
    net: &Net,
    names: &Names,
    places: &Places,
    needs: &Needs,
    locals: &Locals,
    helpers: &mut Helpers,
) -> (Vec<Node>, Vec<Node>) {
    let (prefix, run, wants) = (&names.prefix, &locals.run, &locals.wants);
    let (functions, arms) = (Vec::new(), Vec::new());
    let mut services = Services { net, names, places, locals, functions, arms };
    services.conditions();
    services.actions(helpers);
    services.texts();
    let Services { mut functions, mut arms, .. } = services;
    if needs.room.fired > 0 {
        let fired = Node::line(format!("{prefix}_fired(self, {run}->number);"));
        arms.push(Node::case("GP_FIRED", vec![fired]));
        arms.push(Node::case("GP_MICRO", vec![crate::trace::micro_step()]));
    }
    if arms.is_empty() {
        return (functions, vec![Node::line(format!("(void)gp_go(&{run});"))]);
    }
    let next = Node::line(format!("{wants} = gp_go({run});"));
    let body = vec![
        Node::line(format!("uint8_t {wants} = gp_go({run});")),
        Node::block(format!("while ({wants} != GP_DONE)"), vec![Node::switch(wants, arms), next]),
    ];
    let (mut parameters, mut arguments) = parameters(names, net, &body);
    parameters.push_str(&format!("gp_run_t *{run}"));
    arguments.push_str(&format!("&{run}"));
    if mentions(&body, &locals.inputs) {
        parameters.push_str(&format!(", int32_t {}[]", locals.inputs));
        arguments.push_str(&format!(", {}", locals.inputs));
    }
    functions.extend(Node::documented(
        "Runs to completion and performs the calls that the engine requests.",
        format!("static void {prefix}_go({parameters})"),
        body,
    ));
    (functions, vec![Node::line(format!("{prefix}_go({arguments});"))])
}

/// The parameters of a reaction that some text mentions, each followed by a comma.
fn parameters(names: &Names, net: &Net, nodes: &[Node]) -> (String, String) {
    let prefix = &names.prefix;
    let has_in = net.inputs.values().any(|it| it.kind.is_handed());
    let (mut parameters, mut arguments) = (String::new(), String::new());
    for (word, ty, there) in [
        ("self", format!("{prefix}_t *self, "), true),
        ("in", format!("const {prefix}_in_t *in, "), has_in),
        ("out", format!("{prefix}_out_t *out, "), true),
    ] {
        if there && mentions(nodes, word) {
            parameters.push_str(&ty);
            arguments.push_str(&format!("{word}, "));
        }
    }
    (parameters, arguments)
}

/// The body of a reset or a reaction.
#[expect(clippy::too_many_arguments, reason = "the parts of one function of the text")]
fn reaction(
    net: &Net,
    names: &Names,
    places: &Places,
    needs: &Needs,
    ticks: Option<Ticks>,
    locals: &Locals,
    going: &[Node],
    reset: bool,
) -> Vec<Node> {
    let (prefix, upper) = (&names.prefix, &names.upper);
    let Locals { run, inputs, outputs, flags, numbers, .. } = locals;
    let mut body = vec![
        Node::line(format!("int32_t {inputs}[{}];", places.inputs.len().max(1))),
        Node::line(format!("int32_t {outputs}[{}];", places.outputs.len().max(1))),
        Node::line(format!("uint8_t {flags}[{upper}_FLAGS];")),
        Node::line(format!("int64_t {numbers}[{upper}_NUMBERS];")),
        Node::line(format!("gp_run_t {run};")),
    ];
    let needs_in = reset && mentions(going, "in");
    if needs_in {
        // Lists of initial steps run before any inputs exist.
        body.push(Node::line(format!("const {prefix}_in_t none = {{ 0 }};")));
        body.push(Node::line(format!("const {prefix}_in_t *in = &none;")));
    }
    let handed: Vec<_> = places.inputs.iter().map(|(id, at)| (*id, usize::from(*at))).collect();
    body.extend(hand_in(net, names, &handed, inputs, reset));
    body.push(clear_array(
        &format!("{}U", places.outputs.len().max(1)),
        &format!("{outputs}[i] = 0;"),
    ));
    for (name, value) in [
        ("image", "self->image"),
        ("bits", "self->bits"),
        ("values", "self->values"),
        ("in", inputs),
        ("out", outputs),
        ("flags", flags),
        ("numbers", numbers),
        ("dt", if ticks.is_some() && !reset { "dt" } else { "0U" }),
        ("cells", "0U"),
        ("at", "0U"),
        ("end", "0U"),
        ("number", "0U"),
        ("depth", "0U"),
        ("loops", "0U"),
        ("fault", "false"),
    ] {
        body.push(Node::line(format!("{run}.{name} = {value};")));
    }
    body.push(Node::line(format!("gp_begin(&{run}, {reset});")));
    body.extend(going.iter().cloned());
    if needs.sets_fault {
        body.push(Node::line(format!("self->fault = {run}.fault;")));
    }
    body.extend(clear_words(names));
    let given = places.outputs.iter().map(|(id, at)| (*id, format!("{outputs}[{at}]")));
    body.extend(hand_out(net, names, given));
    body
}
