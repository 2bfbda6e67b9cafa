//! The files of a package: the common parts of every chart, around the result of its style.

use crate::c::print::{Marks, Node, Writer};
use crate::gate;
use crate::interface::Interface;
use crate::names::Names;
use crate::style_output::{Member, StyleOutput, mentions};
use crate::{File, FileKind, Io, Object, Options};
use crate::{safe, trace};
use grafsynth_c::storage;
use grafsynth_ir::expr::Type;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{InputKind, MacroStep, Net, StepKind, VarOrigin};

/// The files of a chart.
pub(crate) fn lay_out(
    net: &Net,
    facts: &Facts,
    names: &Names,
    mut program: StyleOutput,
    options: &Options,
) -> (Vec<File>, Interface, Marks) {
    if options.trace.is_some() {
        trace::add(names, &mut program);
    }
    let has_library = options.callbacks
        || net.inputs.values().any(|it| it.kind == InputKind::Extern)
        || net.outputs.values().any(|it| it.is_extern());
    let interface = Interface {
        names: names.clone(),
        has_instance: !program.instance.is_empty(),
        has_in: net.inputs.values().any(|it| it.kind.is_handed()),
        has_out: net.outputs.values().any(|it| !it.is_extern()),
        ticks: program.ticks,
        has_fault: program.has_fault,
        callbacks: options.callbacks,
        has_library,
        // A chart without state cannot use the gate.
        gate: options.gate && !program.instance.is_empty(),
        trace: options.trace,
        // A chart without state has no memory that can be corrupted.
        safe_state: options.safe_state && !program.instance.is_empty(),
    };
    if interface.safe_state {
        safe::watch(net, facts, &interface, &mut program);
    }
    if interface.gate {
        program.instance.extend(gate::members(&interface));
        program.init.push(Node::line("self->gate = 0U;"));
    }
    let layout = Layout { net, names, program, options, interface: &interface, has_library };
    let (source, marks) = layout.source();
    let mut files = vec![layout.header(), source, layout.port()];
    if let Some(engine) = &layout.program.engine {
        let mut nodes =
            vec![layout.banner("the tables. Do not edit: they are regenerated from the chart.")];
        nodes.extend(engine.tables.iter().cloned());
        files.push(layout.file(format!("{}_tables.c", names.stem), &nodes, FileKind::Source));
        for (kind, name, text) in &engine.files {
            files.push(File {
                name: (*name).to_owned(),
                text: text.clone().into_owned(),
                keep_existing: false,
                map: Vec::new(),
                kind: *kind,
            });
        }
    }
    if has_library {
        files.push(layout.library_header());
        files.push(layout.library_stub());
    }
    drop(layout);
    (files, interface, marks)
}

/// The data from which the files of a package are written.
pub(crate) struct Layout<'a> {
    pub(crate) net: &'a Net,
    pub(crate) names: &'a Names,
    pub(crate) program: StyleOutput,
    pub(crate) options: &'a Options,
    pub(crate) interface: &'a Interface,
    pub(crate) has_library: bool,
}

impl Layout<'_> {
    pub(crate) fn banner(&self, what: &str) -> Node {
        let version = env!("CARGO_PKG_VERSION");
        let mut text = format!("{}: {what}\nWritten by grafsynth {version}", self.net.name);
        if !self.options.source.is_empty() {
            text.push_str(&format!(" from {}", self.options.source));
        }
        text.push_str(&format!("; style {}", self.program.style));
        if self.options.io == Io::Words {
            text.push_str(", inputs and outputs in words");
        }
        if self.interface.gate {
            text.push_str(", gate");
        }
        if self.interface.safe_state {
            text.push_str(", safe state");
        }
        if let Some(places) = self.interface.trace {
            text.push_str(&format!(", trace {places}"));
        }
        if self.options.callbacks {
            text.push_str(", callbacks");
        }
        if let Some(prefix) = &self.options.prefix {
            text.push_str(&format!(", prefix {prefix}"));
        }
        text.push('.');
        Node::comment(text)
    }

    /// A file of this chart that is rewritten by each build.
    pub(crate) fn file(&self, name: String, nodes: &[Node], kind: FileKind) -> File {
        let (text, map) = Writer::write(nodes);
        File { name, text, keep_existing: false, map, kind }
    }

    // --- NAME.h ----------------------------------------------------------------------------------------------------------------------------

    fn header(&self) -> File {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let mut nodes = Vec::new();
        if let Some(ticks) = self.interface.ticks {
            let tick = self.net.settings.tick_ns;
            nodes.push(
                Node::directive(format!("#define {upper}_TICK_NS {tick}ULL"))
                    .note("the length of a tick in nanoseconds"),
            );
            let most = if ticks.short { "; pass 65535 for more than that" } else { "" };
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
        if let Some(places) = self.interface.trace {
            nodes.extend(trace::ring(self.names, self.net, places));
        }
        if let Some(engine) = &self.program.engine {
            nodes.extend(engine.before.iter().cloned());
            nodes.push(Node::blank());
        }
        self.instance_struct(&mut nodes);
        let i = self.interface;
        nodes.push(Node::comment(if i.has_out {
            "Makes the initial steps active and sets their outputs."
        } else {
            "Makes the initial steps active."
        }));
        nodes.push(Node::line(format!("void {prefix}_init({});", i.parameters(false, false))));
        nodes.push(Node::blank());
        nodes.push(Node::comment(
            "One reaction: reads the inputs, runs the chart, sets the outputs.",
        ));
        if i.gate {
            let head = format!("void {prefix}_react({});", i.parameters(true, true));
            nodes.push(
                Node::line(head).note(
                    "the reaction itself; the step function calls it unless the gate skips it",
                ),
            );
            nodes.push(gate::step(i, &gate::same(self.net, i)));
        } else {
            nodes.push(Node::line(format!("void {prefix}_step({});", i.parameters(true, true))));
        }
        nodes.push(Node::blank());
        if let Some(engine) = &self.program.engine {
            nodes.extend(engine.declarations.iter().cloned());
        }
        self.stop(&mut nodes);
        self.getters(&mut nodes);
        if self.interface.trace.is_some() {
            nodes.extend(trace::reader(self.names));
        }
        let include = self.program.engine.as_ref().map(|it| format!("#include \"{}\"", it.include));
        let contents =
            include.map(Node::directive).into_iter().chain(Node::c_linkage(nodes)).collect();
        let what = "the interface of the chart. Do not edit: it is regenerated from the chart.";
        self.header_file("", what, contents)
    }

    /// A header file: `what` it is, its include guard, the types of C, and its contents.
    pub(crate) fn header_file(&self, suffix: &str, what: &str, contents: Vec<Node>) -> File {
        let guard = format!("{}{}_H", self.names.upper, suffix.to_ascii_uppercase());
        let mut nodes = vec![
            self.banner(what),
            Node::directive(format!("#ifndef {guard}")),
            Node::directive(format!("#define {guard}")),
            Node::blank(),
            Node::directive("#include <stdbool.h>"),
            Node::directive("#include <stdint.h>"),
        ];
        nodes.extend(contents);
        nodes.push(Node::directive("#endif"));
        self.file(format!("{}{suffix}.h", self.names.stem), &nodes, FileKind::Header)
    }

    fn input_struct(&self, nodes: &mut Vec<Node>) {
        if !self.interface.has_in {
            return;
        }
        nodes.extend(self.names.io.input_macros(self.net, &self.names.prefix, &self.names.inputs));
        let mut body = Vec::new();
        match self.names.io.input_words() {
            0 => {}
            words => body.push(Node::line(format!("uint8_t bits[{words}];"))),
        }
        for (id, input) in self.net.inputs.iter() {
            if self.names.io.input_bit(id).is_some() {
                continue;
            }
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
        nodes.push(Node::comment(
            "The inputs, which the chart reads once at the start of a reaction.",
        ));
        nodes.push(Node::typedef("struct", body, format!("{}_in_t", self.names.prefix)));
        nodes.push(Node::blank());
    }

    fn output_struct(&self, nodes: &mut Vec<Node>) {
        if !self.interface.has_out {
            return;
        }
        let io = &self.names.io;
        nodes.extend(io.output_macros(self.net, &self.names.outputs));
        let words = (io.n_outputs > 0)
            .then(|| Node::line(format!("{} bits[{}];", io.output_type(), io.output_words())));
        let members = self
            .net
            .outputs
            .iter()
            .filter(|(id, output)| !output.is_extern() && io.output_bit(*id).is_none())
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
            });
        let body = words.into_iter().chain(members).collect();
        nodes.push(Node::comment("The outputs, which the chart writes at the end of a reaction."));
        nodes.push(Node::typedef("struct", body, format!("{}_out_t", self.names.prefix)));
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
        nodes.push(Node::typedef("enum", steps, format!("{prefix}_step_t")));
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
        nodes.push(Node::typedef("enum", transitions, format!("{prefix}_transition_t")));
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
        nodes.push(Node::typedef("struct", body, format!("{}_t", self.names.prefix)));
        nodes.push(Node::blank());
    }

    fn stop(&self, nodes: &mut Vec<Node>) {
        let i = self.interface;
        let safe = |id| self.net.outputs[id].safe_value();
        let any_safe = self.net.outputs.values().any(|output| output.safe.is_some());
        if i.has_out && (i.safe_state || any_safe || self.net.emergency.is_some()) {
            nodes.extend(safe::before_init(self.net, self.names));
        }
        let mut body = self.names.io.constants(self.net, &self.names.outputs, safe);
        if i.safe_state {
            body.push(safe::stop());
        } else if i.has_instance {
            body.push(Node::line("(void)self;"));
        }
        nodes.push(Node::comment(if any_safe {
            "Sets all outputs to their safe values. The chart stops until the next init."
        } else {
            "Switches all outputs off. The chart stops until the next init."
        }));
        let head = format!(
            "static inline void {}_stop({})",
            self.names.prefix,
            i.parameters(false, false)
        );
        nodes.push(Node::function(head, body));
        nodes.push(Node::blank());
        if i.safe_state {
            nodes.extend(safe::stopped(self.names));
        }
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
            let value = match &self.program.engine {
                Some(engine) => engine.values.get(&id).cloned().unwrap_or_default(),
                None => format!("self->{name}{access}"),
            };
            nodes.push(
                Node::function(head, vec![Node::line(format!("return {value};"))])
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
            let any: Vec<String> = steps
                .iter()
                .filter(|step| *step != exit)
                .map(|step| self.active_term(*step))
                .collect();
            let body = vec![
                Node::when(
                    &self.program.active[*exit],
                    vec![Node::line(format!("return {upper}_COMPLETE;"))],
                ),
                Node::line(format!(
                    "return ({}) ? {upper}_ACTIVE : {upper}_INACTIVE;",
                    if any.is_empty() {
                        "false".to_string()
                    } else {
                        crate::cexpr::joined(&any, "||")
                    }
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
}

/// True for a step that traces show.
pub(crate) fn shown(kind: StepKind, hidden: bool) -> bool {
    !hidden && matches!(kind, StepKind::Leaf | StepKind::Enclosing | StepKind::Final)
}

/// A comment for a signal: its label, its chart name if the C name differs, and its range.
pub(crate) fn described(name: &str, label: &str, chosen: &str, ty: Type) -> String {
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
