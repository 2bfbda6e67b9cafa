//! The files of a package: what every chart has, around what its style decided.

use crate::calls;
use crate::cexpr::storage;
use crate::cprogram::{CProgram, Member, mentions};
use crate::ctext::{Kind, Node, Writer, comment_text};
use crate::names::{Names, is_extern};
use crate::times::Ticks;
use crate::{File, Object, Options};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Driver, InputKind, MacroStep, Net, StepKind, VarOrigin};

/// What a caller of the emitted functions must know: the harness is written from it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Interface {
    pub(crate) names: Names,
    pub(crate) has_instance: bool,
    pub(crate) has_in: bool,
    pub(crate) has_out: bool,
    pub(crate) ticks: Option<Ticks>,
    pub(crate) has_fault: bool,
    pub(crate) callbacks: bool,
}

impl Interface {
    /// The parameters of `NAME_init`, `NAME_step` and `NAME_stop`: only those that the chart has.
    fn parameters(&self, with_in: bool, with_dt: bool) -> String {
        let prefix = &self.names.prefix;
        let mut all = Vec::new();
        if self.has_instance {
            all.push(format!("{prefix}_t *self"));
        }
        if with_in && self.has_in {
            all.push(format!("const {prefix}_in_t *in"));
        }
        if let (true, Some(ticks)) = (with_dt, self.ticks) {
            all.push(format!("{} dt", ticks.name()));
        }
        if self.has_out {
            all.push(format!("{prefix}_out_t *out"));
        }
        if all.is_empty() { "void".to_string() } else { all.join(", ") }
    }
}

/// The files of a chart.
pub(crate) fn lay_out(
    net: &Net,
    names: &Names,
    program: CProgram,
    options: &Options,
) -> (Vec<File>, Interface) {
    let interface = Interface {
        names: names.clone(),
        has_instance: !program.instance.is_empty(),
        has_in: net.inputs.values().any(|it| matches!(it.kind, InputKind::Pin | InputKind::Event)),
        has_out: net.outputs.values().any(|it| !is_extern(it)),
        ticks: program.ticks,
        has_fault: program.has_fault,
        callbacks: options.callbacks,
    };
    let has_library = options.callbacks
        || net.inputs.values().any(|it| it.kind == InputKind::Extern)
        || net.outputs.values().any(is_extern);
    let layout = Layout { net, names, program, options, interface: &interface, has_library };
    let mut files = vec![layout.header(), layout.source(), layout.port()];
    if has_library {
        files.push(layout.library_header());
        files.push(layout.library_stub());
    }
    drop(layout);
    (files, interface)
}

struct Layout<'a> {
    net: &'a Net,
    names: &'a Names,
    program: CProgram,
    options: &'a Options,
    interface: &'a Interface,
    has_library: bool,
}

impl Layout<'_> {
    fn banner(&self, what: &str) -> Node {
        let version = env!("CARGO_PKG_VERSION");
        let mut text = format!("{}: {what}\nWritten by grafsynth {version}", self.net.name);
        if !self.options.source.is_empty() {
            text.push_str(&format!(" from {}", self.options.source));
        }
        text.push_str(&format!("; style {}", self.program.style));
        if self.options.callbacks {
            text.push_str(", callbacks");
        }
        if let Some(prefix) = &self.options.prefix {
            text.push_str(&format!(", prefix {prefix}"));
        }
        text.push('.');
        Node::comment(text)
    }

    fn file(&self, name: String, nodes: &[Node], keep_existing: bool) -> File {
        let (text, map) = Writer::write(nodes);
        File { name, text, keep_existing, map }
    }

    // --- NAME.h ----------------------------------------------------------------------------------------------------------------------------

    fn header(&self) -> File {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let mut nodes = vec![
            self.banner("what the chart offers. Do not edit: it is written anew from the chart."),
            Node::directive(format!("#ifndef {upper}_H")),
            Node::directive(format!("#define {upper}_H")),
            Node::blank(),
            Node::directive("#include <stdbool.h>"),
            Node::directive("#include <stdint.h>"),
            Node::blank(),
            Node::directive("#ifdef __cplusplus"),
            Node::line("extern \"C\" {"),
            Node::directive("#endif"),
            Node::blank(),
        ];
        if let Some(ticks) = self.interface.ticks {
            let tick = self.net.settings.tick_ns;
            nodes.push(
                Node::directive(format!("#define {upper}_TICK_NS {tick}ULL"))
                    .note("the length of a tick in nanoseconds"),
            );
            let most = if ticks.short { "; hand over 65535 for more than that" } else { "" };
            nodes.push(Node::comment(format!(
                "dt, below, is the number of ticks since the last reaction, 0 or more{most}."
            )));
            nodes.push(Node::blank());
        }
        self.input_struct(&mut nodes);
        self.output_struct(&mut nodes);
        for node in &self.program.enumerators {
            nodes.push(node.clone());
            nodes.push(Node::blank());
        }
        if self.options.callbacks {
            self.callback_enums(&mut nodes);
        }
        self.instance_struct(&mut nodes);
        let i = self.interface;
        nodes.push(Node::comment(if i.has_out {
            "Makes the initial steps active and gives the outputs that belong to them."
        } else {
            "Makes the initial steps active."
        }));
        nodes.push(Node::line(format!("void {prefix}_init({});", i.parameters(false, false))));
        nodes.push(Node::blank());
        nodes.push(Node::comment(
            "One reaction: reads the inputs, moves the chart, gives the outputs.",
        ));
        nodes.push(Node::line(format!("void {prefix}_step({});", i.parameters(true, true))));
        nodes.push(Node::blank());
        self.stop(&mut nodes);
        self.getters(&mut nodes);
        nodes.extend([
            Node::directive("#ifdef __cplusplus"),
            Node::line("}"),
            Node::directive("#endif"),
            Node::blank(),
            Node::directive("#endif"),
        ]);
        self.file(format!("{prefix}.h"), &nodes, false)
    }

    fn input_struct(&self, nodes: &mut Vec<Node>) {
        if !self.interface.has_in {
            return;
        }
        let mut body = Vec::new();
        for (id, input) in self.net.inputs.iter() {
            let note = match input.kind {
                InputKind::Pin => {
                    described(&input.name.text, &input.meta.label, &self.names.inputs[id], input.ty)
                }
                InputKind::Event => format!(
                    "event{}",
                    if input.meta.label.is_empty() {
                        String::new()
                    } else {
                        format!(": {}", input.meta.label)
                    }
                ),
                InputKind::Extern | InputKind::InternalEvent => continue,
            };
            body.push(
                Node::line(format!("{} {};", storage(input.ty), self.names.inputs[id]))
                    .note(note)
                    .about(Object::Input(id)),
            );
        }
        nodes.push(Node::comment("What the chart reads, once, at the start of a reaction."));
        nodes.push(
            Kind::Braces(
                "typedef struct".to_string(),
                body,
                format!(" {}_in_t;", self.names.prefix),
            )
            .into(),
        );
        nodes.push(Node::blank());
    }

    fn output_struct(&self, nodes: &mut Vec<Node>) {
        if !self.interface.has_out {
            return;
        }
        let body = self
            .net
            .outputs
            .iter()
            .filter(|(_, output)| !is_extern(output))
            .map(|(id, output)| {
                let note = described(
                    &output.name.text,
                    &output.meta.label,
                    &self.names.outputs[id],
                    output.ty,
                );
                Node::line(format!("{} {};", storage(output.ty), self.names.outputs[id]))
                    .note(note)
                    .about(Object::Output(id))
            })
            .collect();
        nodes.push(Node::comment("What the chart gives at the end of a reaction."));
        nodes.push(
            Kind::Braces(
                "typedef struct".to_string(),
                body,
                format!(" {}_out_t;", self.names.prefix),
            )
            .into(),
        );
        nodes.push(Node::blank());
    }

    fn callback_enums(&self, nodes: &mut Vec<Node>) {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let mut steps: Vec<Node> = Vec::new();
        for (id, step) in self.net.steps.iter() {
            if shown(step.kind, step.hidden) {
                steps.push(
                    Node::line(format!("{upper}_STEP_{},", self.names.steps[id]))
                        .about(Object::Step(id)),
                );
            }
        }
        steps.push(Node::line(format!("{upper}_STEPS")));
        nodes.push(
            Kind::Braces("typedef enum".to_string(), steps, format!(" {prefix}_step_t;")).into(),
        );
        nodes.push(Node::blank());
        let mut transitions: Vec<Node> = self
            .net
            .transitions
            .iter()
            .map(|(id, _)| {
                Node::line(format!("{upper}_T_{},", self.names.transitions[id]))
                    .about(Object::Transition(id))
            })
            .collect();
        transitions.push(Node::line(format!("{upper}_TRANSITIONS")));
        nodes.push(
            Kind::Braces(
                "typedef enum".to_string(),
                transitions,
                format!(" {prefix}_transition_t;"),
            )
            .into(),
        );
        nodes.push(Node::blank());
    }

    fn instance_struct(&self, nodes: &mut Vec<Node>) {
        if !self.interface.has_instance {
            return;
        }
        let body = self
            .program
            .instance
            .iter()
            .map(|Member { declaration, note, objects }| {
                Node::line(format!("{declaration};"))
                    .note(note.clone())
                    .about_all(objects.iter().copied())
            })
            .collect();
        nodes.push(Node::comment("One instance of the chart. Its layout is part of the interface: copy it, save it, keep several."));
        nodes.push(
            Kind::Braces("typedef struct".to_string(), body, format!(" {}_t;", self.names.prefix))
                .into(),
        );
        nodes.push(Node::blank());
    }

    fn stop(&self, nodes: &mut Vec<Node>) {
        let i = self.interface;
        let mut body = Vec::new();
        for (id, output) in self.net.outputs.iter().filter(|(_, output)| !is_extern(output)) {
            let off = output.ty.saturate(0);
            body.push(
                Node::line(format!(
                    "out->{} = {};",
                    self.names.outputs[id],
                    calls::constant(off, output.ty)
                ))
                .about(Object::Output(id)),
            );
        }
        if i.has_instance {
            body.push(Node::line("(void)self;"));
        }
        nodes.push(Node::comment(
            "Switches all outputs off. The chart stands still until the next init.",
        ));
        let head = format!(
            "static inline void {}_stop({})",
            self.names.prefix,
            i.parameters(false, false)
        );
        nodes.push(Node::function(head, body));
        nodes.push(Node::blank());
    }

    fn getters(&self, nodes: &mut Vec<Node>) {
        let prefix = &self.names.prefix;
        let parameter = if self.interface.has_instance {
            format!("const {prefix}_t *self")
        } else {
            "void".to_string()
        };
        let any_step = self.net.steps.values().any(|step| !step.hidden);
        if any_step {
            nodes.push(Node::comment("Whether a step is active."));
        }
        for (id, step) in self.net.steps.iter().filter(|(_, step)| !step.hidden) {
            let condition = &self.program.active[id];
            let mut body = vec![Node::line(format!("return {condition};"))];
            if self.interface.has_instance && !mentions(&body, "self") {
                body.insert(0, Node::line("(void)self;"));
            }
            let head =
                format!("static inline bool {prefix}_active_{}({parameter})", self.names.steps[id]);
            let note = if step.name.text == self.names.steps[id] {
                String::new()
            } else {
                step.name.text.clone()
            };
            nodes.push(Node::function(head, body).note(note).about(Object::Step(id)));
        }
        if any_step {
            nodes.push(Node::blank());
        }
        self.macro_getters(nodes, &parameter);
        for (id, var) in self.net.vars.iter().filter(|(_, var)| var.origin == VarOrigin::Declared) {
            let name = &self.names.vars[id];
            let (index, access) =
                if var.len.is_some() { (", uint32_t i", "[i]") } else { ("", "") };
            let head = format!(
                "static inline {} {prefix}_var_{name}({parameter}{index})",
                storage(var.ty)
            );
            nodes.push(
                Node::function(head, vec![Node::line(format!("return self->{name}{access};"))])
                    .about(Object::Var(id)),
            );
        }
        if self.program.has_fault {
            let body = match &self.program.fault {
                Some(text) => vec![Node::line(format!("return {text};"))],
                None if self.interface.has_instance => {
                    vec![Node::line("(void)self;"), Node::line("return false;")]
                }
                None => vec![Node::line("return false;")],
            };
            nodes.push(Node::comment(
                "Whether the last reaction was cut off by the limit, or a queue was full.",
            ));
            nodes.push(Node::function(
                format!("static inline bool {prefix}_fault({parameter})"),
                body,
            ));
        }
        nodes.push(Node::blank());
    }

    fn macro_getters(&self, nodes: &mut Vec<Node>, parameter: &str) {
        if self.net.macros.is_empty() {
            return;
        }
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        nodes.push(Node::comment(
            "A macro-step is inactive, active, or complete: its exit step is active.",
        ));
        nodes.push(Node::line(format!(
            "typedef enum {{ {upper}_INACTIVE, {upper}_ACTIVE, {upper}_COMPLETE }} {prefix}_macro_t;"
        )));
        for (index, it) in self.net.macros.iter().enumerate() {
            let MacroStep { steps, exit, .. } = it;
            let any: Vec<String> = steps.iter().map(|step| self.active_term(*step)).collect();
            let body = vec![
                Node::when(
                    &self.program.active[*exit],
                    vec![Node::line(format!("return {upper}_COMPLETE;"))],
                ),
                Node::line(format!(
                    "return ({}) ? {upper}_ACTIVE : {upper}_INACTIVE;",
                    if any.is_empty() { "false".to_string() } else { any.join(" || ") }
                )),
            ];
            let head = format!(
                "static inline {prefix}_macro_t {prefix}_macro_{}({parameter})",
                self.names.macros[index]
            );
            nodes.push(
                Node::function(head, body).about_all(steps.iter().map(|step| Object::Step(*step))),
            );
        }
        nodes.push(Node::blank());
    }

    fn active_term(&self, step: grafsynth_ir::net::StepId) -> String {
        self.program.active[step].clone()
    }

    // --- NAME.c ----------------------------------------------------------------------------------------------------------------------------

    fn source(&self) -> File {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let i = self.interface;
        let mut nodes = vec![
            self.banner("the chart. Do not edit: it is written anew from the chart."),
            Node::directive(format!("#include \"{prefix}.h\"")),
            Node::directive(format!("#include \"{prefix}_port.h\"")),
        ];
        if self.has_library {
            nodes.push(Node::directive(format!("#include \"{prefix}_user.h\"")));
        }
        nodes.push(Node::blank());
        nodes.extend(self.program.tables.iter().cloned());
        if !self.program.tables.is_empty() {
            nodes.push(Node::blank());
        }
        self.helpers(&mut nodes);
        nodes.extend(self.program.functions.iter().cloned());
        let mut step = self.program.step.clone();
        if self.options.callbacks {
            self.notify(&mut nodes, &mut step);
        }
        let init = self.with_unused(self.program.init.clone(), false, false);
        nodes.push(Node::function(
            format!("void {prefix}_init({})", i.parameters(false, false)),
            init,
        ));
        nodes.push(Node::blank());
        let step = self.with_unused(step, true, true);
        nodes.push(Node::function(
            format!("void {prefix}_step({})", i.parameters(true, true)),
            step,
        ));
        let _ = upper;
        self.file(format!("{prefix}.c"), &nodes, false)
    }

    fn with_unused(&self, body: Vec<Node>, with_in: bool, with_dt: bool) -> Vec<Node> {
        let i = self.interface;
        let mut names = Vec::new();
        if i.has_instance {
            names.push("self");
        }
        if with_in && i.has_in {
            names.push("in");
        }
        if with_dt && i.ticks.is_some() {
            names.push("dt");
        }
        if i.has_out {
            names.push("out");
        }
        crate::cprogram::with_unused(&names, body)
    }

    fn helpers(&self, nodes: &mut Vec<Node>) {
        let prefix = &self.names.prefix;
        for (slot, width, ty) in [(0, 16, "int"), (1, 32, "int32_t"), (2, 64, "int64_t")] {
            if self.program.helpers.clamp[slot] && self.calls(&format!("{prefix}_clamp{width}")) {
                nodes.push(Node::comment("The value, or the nearest bound."));
                nodes.push(Node::function(
                    format!("static {ty} {prefix}_clamp{width}({ty} value, {ty} lo, {ty} hi)"),
                    vec![Node::line("return (value < lo) ? lo : (value > hi) ? hi : value;")],
                ));
                nodes.push(Node::blank());
            }
        }
        let later = self.program.helpers.later && self.calls(&format!("{prefix}_later"));
        if let (true, Some(ticks)) = (later, self.interface.ticks) {
            let ty = ticks.name();
            nodes.push(Node::comment("A timer dt ticks later; it stays at its cap."));
            nodes.push(Node::function(
                format!("static {ty} {prefix}_later({ty} time, {ty} dt, {ty} cap)"),
                vec![Node::line(format!(
                    "return (dt < ({ty})(cap - time)) ? ({ty})(time + dt) : cap;"
                ))],
            ));
            nodes.push(Node::blank());
        }
    }

    /// Whether a helper is called in the text that was kept.
    fn calls(&self, helper: &str) -> bool {
        let program = &self.program;
        [&program.functions, &program.step, &program.init]
            .into_iter()
            .any(|nodes| mentions(nodes, helper))
    }

    /// The callbacks of seed 000: what changed in a reaction is told at its end.
    fn notify(&self, nodes: &mut Vec<Node>, step: &mut Vec<Node>) {
        if !self.interface.has_instance {
            return;
        }
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let mut body = Vec::new();
        let before = |text: &str| text.replace("self->", "before->");
        for (id, it) in self.net.steps.iter() {
            if !shown(it.kind, it.hidden) {
                continue;
            }
            let now = &self.program.active[id];
            let was = before(now);
            let name = format!("{upper}_STEP_{}", self.names.steps[id]);
            body.push(
                Node::when(
                    &format!("({now}) != ({was})"),
                    vec![Node::line(format!("{prefix}_activated({name}, {now});"))],
                )
                .about(Object::Step(id)),
            );
        }
        for (id, it) in self.net.transitions.iter() {
            if it.requires.is_empty() {
                continue;
            }
            let join = |negate: bool| {
                let all: Vec<String> = it
                    .requires
                    .iter()
                    .map(|step| {
                        let now = &self.program.active[*step];
                        format!("({})", if negate { before(now) } else { now.clone() })
                    })
                    .collect();
                all.join(" && ")
            };
            let condition = format!("{} && !({})", join(false), join(true));
            let name = format!("{upper}_T_{}", self.names.transitions[id]);
            body.push(
                Node::when(&condition, vec![Node::line(format!("{prefix}_enabled({name});"))])
                    .about(Object::Transition(id)),
            );
        }
        nodes.push(Node::comment("Tells the library what a reaction changed."));
        nodes.push(Node::function(
            format!(
                "static void {prefix}_notify(const {prefix}_t *self, const {prefix}_t *before)"
            ),
            crate::cprogram::with_unused(&["self", "before"], body),
        ));
        nodes.push(Node::blank());
        step.insert(0, Node::line(format!("const {prefix}_t before = *self;")));
        step.push(Node::line(format!("{prefix}_notify(self, &before);")));
    }

    // --- NAME_port.h -----------------------------------------------------------------------------------------------------------------------

    fn port(&self) -> File {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let mut nodes = vec![
            self.banner("what differs between machines. Define a macro before this file is read, or with -D, to change it."),
            Node::directive(format!("#ifndef {upper}_PORT_H")),
            Node::directive(format!("#define {upper}_PORT_H")),
            Node::blank(),
            Node::directive("#include <stdbool.h>"),
            Node::directive("#include <stdint.h>"),
            Node::blank(),
            Node::comment("Around what interrupts share with the chart: switch them off, and restore them."),
            Node::directive(format!("#ifndef {upper}_ENTER_CRITICAL")),
            Node::directive(format!("#define {upper}_ENTER_CRITICAL() ((void)0)")),
            Node::directive("#endif"),
            Node::directive(format!("#ifndef {upper}_EXIT_CRITICAL")),
            Node::directive(format!("#define {upper}_EXIT_CRITICAL() ((void)0)")),
            Node::directive("#endif"),
            Node::blank(),
            Node::comment("A state variable holds a value that it never takes: the memory was disturbed. The usual answer is a restart."),
            Node::directive(format!("#ifndef {upper}_BAD_STATE")),
            Node::directive(format!("#define {upper}_BAD_STATE(self) ((void)0)")),
            Node::directive("#endif"),
            Node::blank(),
            Node::comment("Where constant tables live: flash, on machines that have to be told."),
            Node::directive(format!("#ifndef {upper}_ROM")),
            Node::directive("#if defined(__FLASH) && !defined(__STRICT_ANSI__) && !defined(__cplusplus)"),
            Node::directive(format!("#define {upper}_ROM const __flash")),
            Node::directive("#elif defined(__SDCC_mcs51)"),
            Node::directive(format!("#define {upper}_ROM const __code")),
            Node::directive("#else"),
            Node::directive(format!("#define {upper}_ROM const")),
            Node::directive("#endif"),
            Node::directive("#endif"),
            Node::blank(),
        ];
        self.ring(&mut nodes);
        nodes.push(Node::directive("#endif"));
        self.file(format!("{prefix}_port.h"), &nodes, false)
    }

    /// The event ring: interrupts put events in, the loop that calls the chart takes them out.
    fn ring(&self, nodes: &mut Vec<Node>) {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let events: Vec<_> =
            self.net.inputs.iter().filter(|(_, input)| input.kind == InputKind::Event).collect();
        if events.is_empty() {
            return;
        }
        let mut body: Vec<Node> = Vec::new();
        for (position, (id, input)) in events.iter().enumerate() {
            let comma = if position + 1 == events.len() { "" } else { "," };
            body.push(
                Node::line(format!("{upper}_EVENT_{}{comma}", self.names.inputs[*id]))
                    .note(input.meta.label.clone())
                    .about(Object::Input(*id)),
            );
        }
        nodes.push(Node::directive(format!("#include \"{prefix}.h\"")));
        nodes.push(Node::blank());
        nodes.push(
            Kind::Braces("typedef enum".to_string(), body, format!(" {prefix}_event_t;")).into(),
        );
        nodes.push(Node::blank());
        nodes.push(Node::comment("The number of places of a ring, a power of two up to 128."));
        nodes.push(Node::directive(format!("#ifndef {upper}_RING_SIZE")));
        nodes.push(Node::directive(format!("#define {upper}_RING_SIZE 16U")));
        nodes.push(Node::directive("#endif"));
        nodes.push(Node::blank());
        nodes.push(Node::comment(
            "Events on their way from interrupts to the chart. Zero it before use. One writer and one reader need no lock:\neach index is written by one side only and is a single byte.",
        ));
        nodes.push(
            Kind::Braces(
                "typedef struct".to_string(),
                vec![
                    Node::line("volatile uint8_t head;").note("the next place to write"),
                    Node::line("volatile uint8_t tail;").note("the next place to read"),
                    Node::line(format!("volatile uint8_t events[{upper}_RING_SIZE];")),
                ],
                format!(" {prefix}_ring_t;"),
            )
            .into(),
        );
        nodes.push(Node::blank());
        nodes.push(Node::comment(
            "For interrupts: false when the ring is full and the event is lost.",
        ));
        nodes.push(Node::function(
            format!(
                "static inline bool {prefix}_post({prefix}_ring_t *ring, {prefix}_event_t event)"
            ),
            vec![
                Node::line("const uint8_t head = ring->head;"),
                Node::when(
                    &format!("(uint8_t)(head - ring->tail) >= {upper}_RING_SIZE"),
                    vec![Node::line("return false;")],
                ),
                Node::line(format!(
                    "ring->events[head & ({upper}_RING_SIZE - 1U)] = (uint8_t)event;"
                )),
                Node::line("ring->head = (uint8_t)(head + 1U);"),
                Node::line("return true;"),
            ],
        ));
        nodes.push(Node::blank());
        let mut cases: Vec<Node> = Vec::new();
        for (id, _) in &events {
            let name = &self.names.inputs[*id];
            let case = Kind::Case(
                vec![format!("case {upper}_EVENT_{name}:")],
                vec![Node::line(format!("in->{name} = true;")), Node::line("break;")],
            );
            cases.push(case.into());
        }
        cases.push(Kind::Case(vec!["default:".to_string()], vec![Node::line("break;")]).into());
        let mut take: Vec<Node> = events
            .iter()
            .map(|(id, _)| Node::line(format!("in->{} = false;", self.names.inputs[*id])))
            .collect();
        take.extend([
            Node::line("const uint8_t tail = ring->tail;"),
            Node::when("tail == ring->head", vec![Node::line("return false;")]),
            Node::block(format!("switch (ring->events[tail & ({upper}_RING_SIZE - 1U)])"), cases),
            Node::line("ring->tail = (uint8_t)(tail + 1U);"),
            Node::line("return true;"),
        ]);
        nodes.push(Node::comment(
            "For the loop that calls the chart: puts the oldest event, and no other, into the inputs; false when there was none.",
        ));
        nodes.push(Node::function(
            format!("static inline bool {prefix}_take({prefix}_ring_t *ring, {prefix}_in_t *in)"),
            take,
        ));
        nodes.push(Node::blank());
    }

    // --- NAME_user.h, NAME_user.c ----------------------------------------------------------------------------------------------------------

    /// The functions of the library: signature, comment, what a stub returns, what it comes from.
    fn library(&self) -> Vec<(String, String, Option<&'static str>, Object)> {
        let mut all = Vec::new();
        for (id, input) in
            self.net.inputs.iter().filter(|(_, input)| input.kind == InputKind::Extern)
        {
            let ty = storage(input.ty);
            let value = if input.ty.is_bool() { "false" } else { "0" };
            all.push((
                format!("{ty} {}(void)", self.names.inputs[id]),
                described(&input.name.text, &input.meta.label, &self.names.inputs[id], input.ty),
                Some(value),
                Object::Input(id),
            ));
        }
        for (id, output) in self.net.outputs.iter() {
            let Driver::Extern { params, .. } = &output.driver else { continue };
            let mut space = crate::names::namer();
            let list: Vec<String> = params
                .iter()
                .map(|param| {
                    let name =
                        space.name(if param.name.is_empty() { "value" } else { &param.name });
                    format!("{} {name}", storage(param.ty))
                })
                .collect();
            let list = if list.is_empty() { "void".to_string() } else { list.join(", ") };
            all.push((
                format!("void {}({list})", self.names.outputs[id]),
                described(
                    &output.name.text,
                    &output.meta.label,
                    &self.names.outputs[id],
                    Type::Bool,
                ),
                None,
                Object::Output(id),
            ));
        }
        all
    }

    fn callbacks(&self) -> Vec<(String, &'static str)> {
        if !self.options.callbacks {
            return Vec::new();
        }
        let prefix = &self.names.prefix;
        vec![
            (
                format!("void {prefix}_activated({prefix}_step_t step, bool active)"),
                "A step was activated or deactivated.",
            ),
            (
                format!("void {prefix}_enabled({prefix}_transition_t transition)"),
                "A transition became enabled: it waits for its receptivity from now on.",
            ),
        ]
    }

    fn library_header(&self) -> File {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let mut nodes = vec![
            self.banner("the functions that your library provides. Do not edit: it is written anew from the chart."),
            Node::directive(format!("#ifndef {upper}_USER_H")),
            Node::directive(format!("#define {upper}_USER_H")),
            Node::blank(),
            Node::directive("#include <stdbool.h>"),
            Node::directive("#include <stdint.h>"),
        ];
        if self.options.callbacks {
            nodes.push(Node::directive(format!("#include \"{prefix}.h\"")));
        }
        nodes.extend([
            Node::blank(),
            Node::directive("#ifdef __cplusplus"),
            Node::line("extern \"C\" {"),
            Node::directive("#endif"),
            Node::blank(),
        ]);
        for (signature, note, _, object) in self.library() {
            nodes.push(Node::line(format!("{signature};")).note(note).about(object));
        }
        for (signature, note) in self.callbacks() {
            nodes.push(Node::comment(note));
            nodes.push(Node::line(format!("{signature};")));
        }
        nodes.extend([
            Node::blank(),
            Node::directive("#ifdef __cplusplus"),
            Node::line("}"),
            Node::directive("#endif"),
            Node::blank(),
            Node::directive("#endif"),
        ]);
        self.file(format!("{prefix}_user.h"), &nodes, false)
    }

    fn library_stub(&self) -> File {
        let prefix = &self.names.prefix;
        let mut nodes = vec![
            Node::comment(format!(
                "{}: your library. Fill it in; it is yours and is never written again.",
                comment_text(&self.net.name.text)
            )),
            Node::directive(format!("#include \"{prefix}_user.h\"")),
            Node::blank(),
        ];
        for (signature, note, value, object) in self.library() {
            let mut body = unused_parameters(&signature);
            body.extend(value.map(|value| Node::line(format!("return {value};"))));
            if !note.is_empty() {
                nodes.push(Node::comment(note));
            }
            nodes.push(Node::function(signature, body).about(object));
            nodes.push(Node::blank());
        }
        for (signature, note) in self.callbacks() {
            nodes.push(Node::comment(note));
            let body = unused_parameters(&signature);
            nodes.push(Node::function(signature, body));
            nodes.push(Node::blank());
        }
        nodes.pop();
        self.file(format!("{prefix}_user.c"), &nodes, true)
    }
}

/// `(void)x;` for each parameter of a stub.
fn unused_parameters(signature: &str) -> Vec<Node> {
    let list = signature.split_once('(').map_or("", |(_, rest)| rest.trim_end_matches(')'));
    list.split(", ")
        .filter_map(|parameter| parameter.rsplit_once(' '))
        .map(|(_, name)| Node::line(format!("(void){};", name.trim_start_matches('*'))))
        .collect()
}

/// True for a step that traces show.
pub(crate) fn shown(kind: StepKind, hidden: bool) -> bool {
    !hidden && matches!(kind, StepKind::Leaf | StepKind::Enclosing | StepKind::Final)
}

/// A comment for a signal: its label, its name where C has another, and its range.
fn described(name: &str, label: &str, chosen: &str, ty: Type) -> String {
    let mut text = String::new();
    if name != chosen {
        text.push_str(name);
    }
    if !label.is_empty() {
        text.push_str(if text.is_empty() { "" } else { ": " });
        text.push_str(label);
    }
    if let Type::Int { lo, hi } = ty {
        text.push_str(if text.is_empty() { "" } else { ", " });
        text.push_str(&format!("{lo}..{hi}"));
    }
    text
}
