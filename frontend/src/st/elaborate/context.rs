//! The state that all parts of the elaboration share: frames of names, instances, the chart under construction, findings.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::chart::{Declaration, DeclarationKind, Expr, Item, Path};
use grafsynth_ir::diag::{Diagnostic, ErrorReported, nearest};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::Meta;
use grafsynth_ir::{Name, Span};

use super::prelude;
use super::types::{Ty, length};
use super::usage::{Parameter, Params};
use super::value::Value;
use crate::codes;
use crate::st::ast::{Action, Flag, Library, Pou, PouKind, Refusal, Section, Stmt, TypeDef, Var};
use crate::st::symbol::{Ident, Symbol};

/// Maximum number of statements and expressions after expansion of all units.
pub(super) const BUDGET: usize = 500_000;

/// Maximum number of nodes in the value of a variable in a function.
pub(super) const MAX_NODES: usize = 4_000;
/// Maximum depth of nested function calls.
pub(super) const MAX_CALLS: usize = 32;

pub(super) type Outcome<T> = Result<T, ErrorReported>;

pub(super) type FrameId = usize;

/// The frame of the global variables.
pub(super) const GLOBALS: FrameId = 0;

/// The names of one unit or instance.
#[derive(Debug, Clone, Default)]
pub(super) struct Frame {
    pub(super) names: BTreeMap<Symbol, Binding>,
    /// The flags of the jumps that are being eliminated.
    pub(super) flags: BTreeMap<Flag, Binding>,
    /// The chart variables that store flags, by flag and by offset of the statement.
    pub(super) jumps: BTreeMap<(Flag, u32), Place>,
}

/// The object that a name or an expression refers to.
#[derive(Debug, Clone)]
pub(super) enum Binding {
    /// A constant, or the current value of a variable in a function.
    Value(Value),
    Place(Place),
    Object(usize),
    Step(Name),
    /// The declaration was refused.
    Broken,
}

impl Binding {
    /// The object, unless its declaration was refused.
    pub(super) fn declared(self) -> Outcome<Binding> {
        if matches!(self, Binding::Broken) { Err(ErrorReported) } else { Ok(self) }
    }
}

/// A variable of a chart, or one of its elements.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub(super) name: Name,
    /// Index of the chart that declares it.
    pub(super) chart: usize,
    pub(super) index: Option<Expr>,
    pub(super) ty: Ty,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ObjectKind {
    /// A function block, by its index among the units.
    Block(usize),
    Struct,
}

/// An instance of a function block, or a structure.
#[derive(Debug, Clone)]
pub(super) struct Object {
    pub(super) kind: ObjectKind,
    pub(super) frame: FrameId,
    /// The name of the instance in the chart.
    pub(super) prefix: String,
    /// Whether an initial value, a call or an assignment has given a value to PT of a timer.
    pub(super) has_preset: bool,
    pub(super) n_calls: usize,
}

pub(super) struct Elaborator<'a> {
    pub(super) library: &'a Library,
    /// The units of the library, then the standard function blocks.
    units: Vec<&'a Pou>,
    pub(super) types: BTreeMap<Symbol, &'a TypeDef>,
    /// Function blocks and functions by name, as indices in the library.
    pub(super) blocks: BTreeMap<Symbol, usize>,
    pub(super) functions: BTreeMap<Symbol, usize>,
    pub(super) enumerated: BTreeMap<Symbol, i64>,
    pub(super) found: Vec<Diagnostic>,
    pub(super) frames: Vec<Frame>,
    pub(super) objects: Vec<Object>,
    /// Items of the current chart.
    pub(super) items: Vec<Item>,
    pub(super) chart: usize,
    pub(super) chart_names: Vec<Name>,
    /// Names of the current chart.
    pub(super) taken: BTreeSet<Symbol>,
    /// Inputs of the current chart, by their names in it.
    pub(super) inputs: BTreeSet<String>,
    /// Booleans that are used only as actions, with their names in the chart.
    pub(super) flags: BTreeMap<Symbol, String>,
    /// Bodies of actions that statements may call.
    pub(super) bodies: BTreeMap<&'a Symbol, &'a [Stmt]>,
    /// Bodies that are being expanded: the frame of their variables, and the name of the action (`None` for the body of the unit itself).
    pub(super) open_bodies: Vec<(FrameId, Option<Symbol>)>,
    /// Prefix for the names of steps, transitions and actions: the instance whose chart is being expanded.
    pub(super) prefix: String,
    /// Whether the current unit is a program without a chart, which may call blocks with charts.
    pub(super) may_call_charts: bool,
    /// Steps that the current transition leaves, by their names in the chart.
    pub(super) leaving: BTreeSet<String>,
    /// The call of a standard block that is being expanded.
    pub(super) call_site: Option<Span>,
    /// Functions that are being evaluated.
    pub(super) calls: Vec<usize>,
    pub(super) narrowed: BTreeSet<Symbol>,
    /// Possible values, in nanoseconds, of TIME variables that are assigned only constants; by chart and name in it.
    pub(super) time_values: BTreeMap<(usize, String), BTreeSet<i64>>,
    pub(super) spent: usize,
}

/// The callable bodies of a unit.
pub(super) fn bodies_of(actions: &[Action]) -> BTreeMap<&Symbol, &[Stmt]> {
    actions.iter().map(|action| (&action.name.id, action.body.as_slice())).gather()
}

impl<'a> Elaborator<'a> {
    pub(super) fn new(library: &'a Library) -> Self {
        let mut elaborator = Elaborator {
            library,
            units: library.pous.iter().chain(prelude::blocks()).collect(),
            types: BTreeMap::new(),
            blocks: BTreeMap::new(),
            functions: BTreeMap::new(),
            enumerated: BTreeMap::new(),
            found: Vec::new(),
            frames: vec![Frame::default()],
            objects: Vec::new(),
            items: Vec::new(),
            chart: 0,
            chart_names: Vec::new(),
            taken: BTreeSet::new(),
            inputs: BTreeSet::new(),
            flags: BTreeMap::new(),
            bodies: BTreeMap::new(),
            open_bodies: Vec::new(),
            prefix: String::new(),
            may_call_charts: false,
            leaving: BTreeSet::new(),
            call_site: None,
            calls: Vec::new(),
            narrowed: BTreeSet::new(),
            time_values: BTreeMap::new(),
            spent: 0,
        };
        for def in &library.types {
            if elaborator.types.insert(def.name.id.clone(), def).is_some() {
                elaborator.declared_twice(&def.name);
            }
        }
        let mut seen = BTreeSet::new();
        for (index, pou) in library.pous.iter().enumerate() {
            let key = &pou.name.id;
            if !seen.insert(key.clone()) {
                elaborator.declared_twice(&pou.name);
                continue;
            }
            match pou.kind {
                PouKind::FunctionBlock => elaborator.blocks.insert(key.clone(), index),
                PouKind::Function(_) => elaborator.functions.insert(key.clone(), index),
                PouKind::Program => None,
            };
        }
        for (index, pou) in elaborator.units.iter().enumerate().skip(library.pous.len()) {
            elaborator.blocks.entry(pou.name.id.clone()).or_insert(index);
        }
        elaborator
    }

    // Units

    pub(super) fn unit(&self, index: usize) -> &'a Pou {
        self.units[index]
    }

    pub(super) fn is_standard(&self, index: usize) -> bool {
        index >= self.library.pous.len()
    }

    pub(super) fn is_standard_object(&self, object: usize) -> bool {
        matches!(self.objects[object].kind, ObjectKind::Block(index) if self.is_standard(index))
    }

    /// The parameters of a block in the order of a positional call.
    pub(super) fn parameters(&self, index: usize) -> Params {
        let parameter = |var: &Var| {
            let id = var.name.id.clone();
            let second = self.is_standard(index).then(|| prelude::second_name(&id)).flatten();
            matches!(var.section, Section::Input | Section::Output | Section::InOut)
                .then_some(Parameter { id, second, section: var.section })
        };
        self.unit(index).vars.iter().filter_map(parameter).collect()
    }

    /// The span to report for a statement or expression; inside the expansion of a standard block, the span of the call.
    pub(super) fn at(&self, span: Span) -> Span {
        self.call_site.unwrap_or(span)
    }

    // Findings

    pub(super) fn report(&mut self, diagnostic: Diagnostic) -> ErrorReported {
        if self.found.len() < 20_000 {
            self.found.push(diagnostic);
        }
        ErrorReported
    }

    pub(super) fn refused(&mut self, what: &str, span: Span, help: &str) -> ErrorReported {
        self.report(Refusal::unsupported(what, span, help).diagnostic())
    }

    pub(super) fn declared_twice(&mut self, name: &Ident) {
        self.report(
            Diagnostic::error(codes::ST_DUPLICATE, format!("`{name}` is declared twice"))
                .at(name.span, "again here")
                .help("rename one of them; names that differ only in letter case are the same"),
        );
    }

    pub(super) fn unknown(
        &mut self,
        what: &str,
        name: &Ident,
        candidates: &[String],
        help: &str,
    ) -> ErrorReported {
        // Its declaration has an error, which the parser reported.
        if self.library.lost.contains(&name.id) {
            return ErrorReported;
        }
        let finding = Diagnostic::error(codes::ST_UNKNOWN_NAME, format!("unknown {what} `{name}`"))
            .at(name.span, "not declared");
        // Hundreds of findings are not simple typing errors, so the search for similar names stops.
        let near = (self.found.len() < 200)
            .then(|| nearest(&name.id, candidates.iter().map(String::as_str)))
            .flatten();
        self.report(finding.near(name.span, near, help))
    }

    pub(super) fn spend(&mut self, span: Span, amount: usize) -> Outcome<()> {
        let before = self.spent;
        self.spent = self.spent.saturating_add(amount);
        if self.spent <= BUDGET {
            return Ok(());
        }
        if before <= BUDGET {
            self.too_much(span);
        }
        Err(ErrorReported)
    }

    pub(super) fn too_much(&mut self, span: Span) -> ErrorReported {
        self.report(
            Diagnostic::error(
                codes::ST_SIZE,
                "loops, functions and blocks expand to too many statements",
            )
            .at(span, "the limit is exceeded here")
            .help("use shorter loops, or fewer instances"),
        )
    }

    // Names in the chart

    /// The path to a variable, relative to the current chart.
    pub(super) fn path(&self, place: &Place, span: Span) -> Path {
        let own = Name::new(place.name.text.clone(), span);
        if place.chart == self.chart {
            return own.into();
        }
        let chart = self.chart_names.get(place.chart).map_or("", |name| name.text.as_str());
        Path { names: vec![Name::new(chart, span), own] }
    }

    /// An unused name of the chart.
    pub(super) fn free_name(&mut self, base: &str) -> String {
        let mut name = base.to_owned();
        let mut n = 2;
        while !self.taken.insert(Symbol::of(&name)) {
            name = format!("{base}_{n}");
            n += 1;
        }
        name
    }

    /// Declares a variable of the chart, which `frame` knows as `id`.
    pub(super) fn declare_var(
        &mut self,
        frame: FrameId,
        id: &Symbol,
        name: Name,
        ty: &Ty,
        init: Vec<Expr>,
        meta: Meta,
    ) {
        let place = self.new_var(name, ty, init, meta);
        self.bind(frame, id, Binding::Place(place));
    }

    /// Declares a variable of the chart.
    pub(super) fn new_var(&mut self, name: Name, ty: &Ty, init: Vec<Expr>, meta: Meta) -> Place {
        let (simple, len) = match ty {
            Ty::Array(bounds, element) => (element.simple(), u32::try_from(length(bounds)).ok()),
            Ty::Bool | Ty::Int { .. } | Ty::Time | Ty::Block(_) | Ty::Struct(_) | Ty::Broken => {
                (ty.simple(), None)
            }
        };
        let meta = Meta { span: name.span, ..meta };
        self.items.push(Item::Declaration(Declaration {
            name: name.clone(),
            kind: DeclarationKind::Var { ty: simple.unwrap_or(Type::Bool), len, init },
            meta,
        }));
        Place { name, chart: self.chart, index: None, ty: ty.clone() }
    }
}
