//! Converts nets to C99.
//!
//! [`emit`] turns a valid net and the proved facts about it into a package of C files: a header with the instance structure and the interface, the
//! chart, a port header with the machine-dependent parts, and for charts with extern functions a header and a stub of the user's library. The text
//! uses no dynamic memory, no recursion and no global variables; it compiles without warnings as C99 and as C++11, and gives the same results on
//! machines whose `int` has 16 bits.
//!
//! ```
//! use grafsynth_backend_c::{Options, emit};
//! use grafsynth_ir::{facts::Facts, net::Net, span::Name, validate};
//!
//! let mut net = Net::default();
//! net.name = Name::new("empty", Default::default());
//! # net.parts.push(grafsynth_ir::net::Part { name: net.name.clone(), level: 1, ..Default::default() });
//! let net = validate(net).expect("a chart without steps is valid");
//! let package = emit(&net, &Facts::default(), &Options::default()).expect("and can be emitted");
//! assert_eq!(package.files[0].name, "empty.h");
//! ```
//!
//! The main styles are: `switch` (the module `switch`: a state variable for each sequential component, with tables for components that only wait for
//! inputs), `statechart` (a state variable for each region, and a `switch` on it for each event), `bits` (the reaction program of
//! `grafsynth_ir::lower::program`, printed) and, on request,
//! `engine` (tables that one engine interprets for all charts); [`Style`] lists all of them. `docs/c.md` describes the result for users.

mod bits;
mod c;
mod callback_check;
mod calls;
mod cexpr;
pub mod codes;
pub mod cost;
mod engine;
pub mod firmware;
mod gate;
mod handover;
mod harness;
mod header;
mod interface;
mod io;
mod library;
mod names;
pub mod package;
mod port;
mod queries;
mod range;
mod refusal;
mod representation;
mod safe;
mod source;
mod statechart;
mod style_output;
mod styles;
mod switch;
mod times;
pub mod trace;

pub use engine::check::{Damage, Flaw};
pub use engine::room::{Room, check_image};
pub use engine::{is_engine_file, style_of_header};
pub use harness::{explorer, harness, multi_harness};
pub use styles::Style;

use grafsynth_c::SourceFile;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::instance::Representation;
use grafsynth_ir::net::{
    ActionId, Input, InputId, Net, Output, OutputId, StepId, TimerId, TransitionId, VarId,
};
use grafsynth_ir::{FileId, IdMap, Span, Valid};
use std::collections::BTreeMap;

/// The layout of Boolean inputs and outputs in `NAME_in_t` and `NAME_out_t`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Io {
    /// A `bool` member for each.
    #[default]
    Members,
    /// A bit for each: inputs in bytes, outputs in the smallest word that contains all of them, at most 32 bits wide.
    Words,
}

/// The options of the C back end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Options {
    /// The style of the code.
    pub style: Style,
    /// The machine for which [`Style::Auto`] finds the best style; without a machine, it uses tables from 32 rows on.
    pub machine: Option<&'static cost::Machine>,
    /// The optimisation goal of the best style: speed or size.
    pub goal: cost::Goal,
    /// The layout of Boolean inputs and outputs.
    pub io: Io,
    /// The gate (`--gate`): a reaction with the same inputs and the same `dt` as the last one returns at once if the last one left the instance
    /// unchanged.
    pub gate: bool,
    /// The safe state: a reaction checks the state variables first; on corruption, the outputs stay safe from then on.
    pub safe_state: bool,
    /// The number of entries of the trace ring in the instance, at most [`trace::MAX_PLACES`]; `None` for no ring.
    pub trace: Option<u16>,
    /// The prefix of all global names, converted to a C identifier if necessary; `None` uses the chart's name.
    pub prefix: Option<String>,
    /// The prefix of all file names; `None` uses the prefix of the global names.
    pub stem: Option<String>,
    /// True to call the user's `NAME_activated` when a step changes, and `NAME_enabled` when a transition becomes enabled.
    pub callbacks: bool,
    /// True if other code, which calls the function of each extern condition at most once in several reactions, provides the functions that the reaction calls:
    /// `NAME_once_x` for the user's `x`.
    pub once: bool,
    /// The maximum number of transitions in one function; larger charts are split, so that a C compiler's time stays linear.
    pub max_transitions: usize,
    /// The name of the source, for the comment at the top of each file; without a path, so that the text is the same everywhere.
    pub source: String,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            style: Style::Auto,
            machine: None,
            goal: cost::Goal::Speed,
            io: Io::Members,
            gate: false,
            safe_state: false,
            trace: None,
            prefix: None,
            stem: None,
            callbacks: false,
            once: false,
            max_transitions: 200,
            source: String::new(),
        }
    }
}

/// An object of the net that a line of the output comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "each variant names the thing it points to")]
pub enum Object {
    Step(StepId),
    Transition(TransitionId),
    Input(InputId),
    Output(OutputId),
    Var(VarId),
    Timer(TimerId),
    Action(ActionId),
}

impl Object {
    /// Where it is declared.
    #[must_use]
    pub fn span(self, net: &Net) -> Span {
        match self {
            Object::Step(id) => net.steps[id].meta.span,
            Object::Transition(id) => net.transitions[id].meta.span,
            Object::Input(id) => net.inputs[id].meta.span,
            Object::Output(id) => net.outputs[id].meta.span,
            Object::Var(id) => net.vars[id].meta.span,
            Object::Timer(id) => net.timers[id].meta.span,
            Object::Action(id) => net.actions[id].meta.span,
        }
    }

    /// Its name in the chart.
    #[must_use]
    pub fn name(self, net: &Net) -> &str {
        match self {
            Object::Step(id) => &net.steps[id].name.text,
            Object::Transition(id) => &net.transitions[id].name.text,
            Object::Input(id) => &net.inputs[id].name.text,
            Object::Output(id) => &net.outputs[id].name.text,
            Object::Var(id) => &net.vars[id].name.text,
            Object::Timer(id) => &net.timers[id].name.text,
            Object::Action(id) => &net.actions[id].name.text,
        }
    }
}

/// One emitted file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name, without a folder.
    pub name: String,
    /// Its text.
    pub text: String,
    /// True if the user edits the file: it is written only if no file with that name exists.
    pub keep_existing: bool,
    /// For each line (from 1) that comes from the net, its objects.
    pub map: Vec<(u32, Vec<Object>)>,
    /// The kind of file.
    pub kind: FileKind,
}

/// The kinds of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FileKind {
    /// A header of a chart.
    Header,
    /// C code of a chart.
    Source,
    /// A header of an engine, the same for every chart.
    EngineHeader,
    /// The C code of an engine, the same for every chart.
    EngineSource,
    /// Something else, such as a Makefile or an example.
    Other,
}

impl FileKind {
    /// True for C code that is compiled with a chart.
    #[must_use]
    pub fn is_source(self) -> bool {
        matches!(self, FileKind::Source | FileKind::EngineSource)
    }

    /// True for a file that is the same for every chart of an engine.
    #[must_use]
    pub fn is_of_engine(self) -> bool {
        matches!(self, FileKind::EngineHeader | FileKind::EngineSource)
    }
}

/// A chart in C.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Package {
    /// The files: `STEM.h`, `STEM.c`, `STEM_port.h`, and for a chart with extern functions `STEM_user.h` and `STEM_user.c`.
    pub files: Vec<File>,
    /// The chosen style, such as `switch`, `switch with tables`, `statechart`, `bits` or `engine`.
    pub style: &'static str,
    /// Why `auto` did not choose the style `switch`; empty if it did.
    pub reason: String,
    /// Warnings and notes.
    pub diagnostics: Vec<Diagnostic>,
    /// For a chart that an engine interprets as an image (`engine`, `program`): the bytes of `STEM_tables.c`. Empty for all other styles.
    pub image: Vec<u8>,
    /// The names and types that the harness needs.
    interface: interface::Interface,
    /// How the C represents the net, for the proof; `None` if the style does not state it.
    pub representation: Option<Representation>,
    /// If the style was chosen for a machine: the styles that were tried.
    pub tried: Vec<cost::Candidate>,
    /// For a chart as an interpreted program: the maximum number of instructions that one reaction runs, with the proved rounds of the evolution.
    pub instructions: Option<u64>,
    /// For a chart with an image: the engine and the instance that [`check_image`] checks an image for.
    pub room: Option<Room>,
    /// Additional facts for the analysis of `NAME.c`.
    marks: c::print::Marks,
    /// The possible values of its inputs and members.
    contract: cost::Contract,
}

/// The names and types with which other C calls `NAME_step`.
#[derive(Debug, Clone, Copy)]
pub struct ReactionInterface<'p> {
    /// NAME.
    pub prefix: &'p str,
    /// The members of `NAME_in_t`, if inputs are members.
    pub inputs: &'p IdMap<Input, String>,
    /// The members of `NAME_out_t`, if outputs are members.
    pub outputs: &'p IdMap<Output, String>,
    /// True if the functions have the parameter `self`.
    pub has_instance: bool,
    /// The type of the parameter `dt`, if there is one.
    pub dt: Option<&'static str>,
    /// The user's functions for extern conditions. The reaction calls the function with the name of the input.
    pub provided: &'p BTreeMap<InputId, String>,
}

impl Package {
    /// How other C calls the reaction.
    #[must_use]
    pub fn reaction_interface(&self) -> ReactionInterface<'_> {
        let (interface, names) = (&self.interface, &self.interface.names);
        ReactionInterface {
            prefix: &names.prefix,
            inputs: &names.inputs,
            outputs: &names.outputs,
            has_instance: interface.has_instance,
            dt: interface.ticks.map(|ticks| ticks.name()),
            provided: &names.provided,
        }
    }

    /// The header with the functions that the user provides.
    #[must_use]
    pub fn library_header(&self) -> String {
        format!("{}_user.h", self.stem())
    }

    /// The prefix of its file names.
    #[must_use]
    pub fn stem(&self) -> &str {
        &self.interface.names.stem
    }

    /// The files as the C parser reads them: `NAME.c` first, then the files that it may include.
    #[must_use]
    pub fn sources(&self) -> Vec<SourceFile<'_>> {
        let main = format!("{}.c", self.stem());
        let (first, rest): (Vec<_>, Vec<_>) = self.files.iter().partition(|it| it.name == main);
        let all = first.into_iter().chain(rest).zip(0..);
        all.map(|(file, at)| SourceFile { file: FileId(at), name: &file.name, text: &file.text })
            .collect()
    }

    /// The prefix of all global names: the chart's name as a C identifier.
    #[must_use]
    pub fn prefix(&self) -> &str {
        &self.interface.names.prefix
    }

    /// The macros of `NAME_port.h` that the user may define, with their parameters.
    #[must_use]
    pub fn hooks(&self) -> Vec<String> {
        let upper = &self.interface.names.upper;
        ["ENTER_CRITICAL()", "EXIT_CRITICAL()", "BAD_STATE(self)", "WATCHDOG()", "IDLE()"]
            .iter()
            .map(|hook| format!("{upper}_{hook}"))
            .collect()
    }

    /// The member of the input structure for an input.
    #[must_use]
    pub fn input_name(&self, input: InputId) -> &str {
        &self.interface.names.inputs[input]
    }

    /// False for a chart without a state, whose functions take no instance.
    #[must_use]
    pub fn has_instance(&self) -> bool {
        self.interface.has_instance
    }

    /// True if the gate (`--gate`) precedes the reaction, so that some reactions are skipped.
    #[must_use]
    pub fn has_gate(&self) -> bool {
        self.interface.gate
    }

    /// The macro that must disable interrupts if an interrupt shares numbers with the chart: some number cannot be read or written at once by an 8-bit
    /// processor.
    #[must_use]
    pub fn critical_section(&self, net: &Net) -> Option<String> {
        let is_wide = |ty: grafsynth_ir::expr::Type| ty.bits() > 8;
        let mut inputs =
            net.inputs.values().filter(|input| input.kind == grafsynth_ir::net::InputKind::Pin);
        let mut outputs = net.outputs.values().filter(|output| !output.is_extern());
        (inputs.any(|input| is_wide(input.ty)) || outputs.any(|output| is_wide(output.ty)))
            .then(|| format!("{}_ENTER_CRITICAL", self.interface.names.upper))
    }
}

/// The net in C.
///
/// A fact is used only if it is proved. Without facts, [`Style::Auto`] gives a chart that is not a statechart the style `bits` or one variable per step.
///
/// # Errors
/// If the requested style does not support the chart, or the net has no reaction program.
pub fn emit(
    net: &Valid<Net>,
    facts: &Facts,
    options: &Options,
) -> Result<Package, Vec<Diagnostic>> {
    if let (Style::Auto, Some(machine)) = (options.style, options.machine) {
        return cost::emit_best(net, facts, options, machine);
    }
    let simpler = grafsynth_ir::rewrite::simpler(net);
    let net = simpler.as_ref().unwrap_or(net);
    let mut diagnostics = Vec::new();
    let wanted = options.prefix.as_deref().unwrap_or(&net.name.text);
    let names = names::Names::of(net, wanted, options);
    diagnostics.extend(renamed(net, &names));
    diagnostics.extend(foreign_code(net));
    if options.gate {
        diagnostics.extend(gate::refusal(net));
        if !diagnostics.is_empty() && grafsynth_ir::diag::any_error(&diagnostics) {
            return Err(diagnostics);
        }
    }
    if let Some(refusal) = trace::refusal(net, options) {
        diagnostics.push(refusal);
        return Err(diagnostics);
    }
    if let Some(refusal) = safe::refusal(net, options) {
        diagnostics.push(refusal);
        return Err(diagnostics);
    }
    let request = styles::Request { net, facts, names: &names, options };
    let styles::Emitted { program, reason } = match (options.style.row().emit)(&request) {
        Ok(emitted) => emitted,
        Err(errors) => {
            diagnostics.extend(errors);
            return Err(diagnostics);
        }
    };
    let style = program.style;
    let image = program.engine.as_ref().map(|it| it.image.clone()).unwrap_or_default();
    let instructions = program.engine.as_ref().and_then(|it| it.instructions);
    let room = program.engine.as_ref().and_then(|it| it.room);
    let representation = (!program.holds.is_empty() || program.instance.is_empty())
        .then(|| representation::representation(net, &names, &program, options));
    let contract = cost::Contract::of(net, facts, &names, &program.ranges);
    let (files, interface, marks) = header::lay_out(net, facts, &names, program, options);
    Ok(Package {
        files,
        style,
        reason,
        diagnostics,
        image,
        interface,
        representation,
        tried: Vec::new(),
        instructions,
        room,
        marks,
        contract,
    })
}

/// Warnings about functions of the user's library whose names are not allowed in C.
fn renamed(net: &Net, names: &names::Names) -> Vec<Diagnostic> {
    let conditions = net
        .inputs
        .iter()
        .filter(|(_, input)| input.kind == grafsynth_ir::net::InputKind::Extern)
        .map(|(id, input)| (&input.name, &names.provided[&id]));
    let actions = net
        .outputs
        .iter()
        .filter(|(_, output)| output.is_extern())
        .map(|(id, output)| (&output.name, &names.outputs[id]));
    conditions
        .chain(actions)
        .filter(|(name, chosen)| name.text != **chosen)
        .map(|(name, chosen)| {
            Diagnostic::warning(
                codes::RENAMED,
                format!("the function of `{name}` is called `{chosen}` in C, because `{name}` cannot be used"),
            )
            .at(name.span, "declared here")
            .help("rename it in the chart, so that chart and library agree")
        })
        .collect()
}

/// Warnings about verbatim text for other languages, which is omitted.
fn foreign_code(net: &Net) -> Vec<Diagnostic> {
    net.texts()
        .into_iter()
        .filter(|(text, _)| !text.is_c())
        .map(|(text, span)| {
            Diagnostic::warning(
                codes::FOREIGN_CODE,
                format!("code for `{}` is omitted from the C text", text.language),
            )
            .at(span, "written here")
        })
        .collect()
}
