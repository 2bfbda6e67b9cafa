//! Syntax tree of an IEC 61131-3 text, before name resolution: names as written, every node with its span.
//!
//! The parser of PLCopen XML builds the same tree and turns ladders and function block diagrams into statements. So [`super::elaborate`] defines the meaning of
//! both.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

use grafsynth_ir::diag::{Code, Diagnostic};
use grafsynth_ir::{Name, Span};

use super::symbol::{Ident, Symbol};
use crate::codes;

/// The contents of a whole source.
#[derive(Debug, Clone, Default)]
pub(crate) struct Library {
    pub(crate) pous: Vec<Pou>,
    pub(crate) types: Vec<TypeDef>,
    /// `VAR_GLOBAL` outside of program organisation units (POUs).
    pub(crate) globals: Vec<Var>,
    /// `PROGRAM g WITH t : gravel` of a configuration.
    pub(crate) programs: Vec<Instance>,
    pub(crate) tasks: Vec<Task>,
    /// Names whose declarations have syntax errors: their uses are not errors of their own.
    pub(crate) lost: BTreeSet<Symbol>,
}

/// An instance of a program in a resource.
#[derive(Debug, Clone)]
pub(crate) struct Instance {
    pub(crate) name: Ident,
    pub(crate) task: Option<Ident>,
    pub(crate) program: Ident,
}

/// `TASK t(INTERVAL := T#10ms, PRIORITY := 0)`
#[derive(Debug, Clone)]
pub(crate) struct Task {
    pub(crate) name: Ident,
    /// Interval in nanoseconds.
    pub(crate) interval: Option<u64>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PouKind {
    Program,
    FunctionBlock,
    Function(Option<TypeRef>),
}

/// A program organisation unit (POU).
#[derive(Debug, Clone)]
pub(crate) struct Pou {
    pub(crate) kind: PouKind,
    pub(crate) name: Ident,
    pub(crate) vars: Vec<Var>,
    pub(crate) body: Body,
    /// Actions of a unit without a chart (PLCopen only): lists that statements call by name.
    pub(crate) actions: Vec<Action>,
    /// Settings from pragmas in the unit.
    pub(crate) options: Options,
    /// Unsupported parts of the unit.
    pub(crate) refused: Vec<Refusal>,
}

impl Pou {
    /// The lists of statements in the unit.
    pub(crate) fn lists(&self) -> Vec<&[Stmt]> {
        let (main, in_chart) = match &self.body {
            Body::Statements(list) => (list, [].as_slice()),
            Body::Sfc(sfc) => (&sfc.always, sfc.actions.as_slice()),
        };
        let actions = in_chart.iter().chain(&self.actions).map(|action| action.body.as_slice());
        actions.chain([main.as_slice()]).collect()
    }

    /// The elements of its chart, including those in macro-steps.
    pub(crate) fn elements(&self) -> Vec<&Element> {
        if let Body::Sfc(sfc) = &self.body { sfc.all_elements() } else { Vec::new() }
    }

    /// The names that the unit declares itself.
    pub(crate) fn own_names(&self) -> BTreeSet<&Symbol> {
        let vars = self.vars.iter().filter(|var| var.section != Section::External);
        vars.map(|var| &var.name.id).gather()
    }
}

/// Settings of a chart, from pragmas.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct Options {
    /// `{grafsynth final scan}`
    pub(crate) final_scan: bool,
    /// Other settings, in the syntax of the chart language, with their spans.
    pub(crate) settings: Vec<Name>,
}

#[derive(Debug, Clone)]
pub(crate) enum Body {
    Statements(Vec<Stmt>),
    Sfc(Sfc),
}

/// An unsupported feature or a mistake in a unit. It is reported if the unit is used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Refusal {
    code: Code,
    message: String,
    span: Span,
    help: String,
}

impl Refusal {
    pub(crate) fn unsupported(what: &str, span: Span, help: &str) -> Refusal {
        // A name that ends in `s` is a plural.
        let is_plural = what.ends_with('s') && !what.ends_with("ss");
        let verb = if is_plural { "are" } else { "is" };
        Refusal::mistake(codes::ST_NOT_READ, format!("{what} {verb} not supported"), span, help)
    }

    pub(crate) fn mistake(
        code: Code,
        message: impl Into<String>,
        span: Span,
        help: &str,
    ) -> Refusal {
        Refusal { code, message: message.into(), span, help: help.to_owned() }
    }

    pub(crate) fn diagnostic(&self) -> Diagnostic {
        Diagnostic::error(self.code, self.message.as_str())
            .at(self.span, "")
            .help(self.help.as_str())
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Section {
    Local,
    Input,
    Output,
    InOut,
    Global,
    External,
    Temp,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Var {
    pub(crate) name: Ident,
    pub(crate) section: Section,
    pub(crate) is_constant: bool,
    pub(crate) ty: TypeRef,
    pub(crate) init: Option<Init>,
    /// `%IX0.0`
    pub(crate) address: Option<Ident>,
    /// The comment after the declaration.
    pub(crate) label: String,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct TypeRef {
    pub(crate) kind: TypeKind,
    pub(crate) span: Span,
}

impl TypeRef {
    /// The type with this name.
    pub(crate) fn named(name: &str, span: Span) -> Self {
        TypeRef { kind: TypeKind::Named(Ident::new(name, span)), span }
    }

    /// The name of the type, if it is only a name.
    pub(crate) fn name(&self) -> Option<&Ident> {
        if let TypeKind::Named(name) = &self.kind { Some(name) } else { None }
    }

    /// Whether the type is only a name, namely `name`, which is in capitals.
    pub(crate) fn is_named(&self, name: &str) -> bool {
        self.name().is_some_and(|own| own.id == *name)
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum TypeKind {
    Named(Ident),
    /// `INT (0..9)`
    Subrange(Ident, Box<(Expr, Expr)>),
    Array(Vec<(Expr, Expr)>, Box<TypeRef>),
    /// `(red, green := 5)`
    Enum(Vec<(Ident, Option<Expr>)>),
    Struct(Vec<Var>),
    /// `STRING[10]`, `POINTER TO INT`: unsupported; the payload is the name for messages.
    Refused(String),
}

#[derive(Debug, Clone)]
pub(crate) struct TypeDef {
    pub(crate) name: Ident,
    pub(crate) ty: TypeRef,
    pub(crate) init: Option<Init>,
}

/// An initial value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Init {
    Value(Expr),
    /// `[1, 2(0), 3]`: values, each with its number of repetitions.
    List(Vec<(Option<Expr>, Init)>, Span),
    /// `(PT := T#3s)`
    Fields(Vec<(Ident, Init)>, Span),
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Sfc {
    /// Steps and transitions in source order.
    pub(crate) elements: Vec<Element>,
    pub(crate) actions: Vec<Action>,
    /// Statements that run in every scan, independent of the active steps (blocks that are wired outside the chart).
    pub(crate) always: Vec<Stmt>,
}

impl Sfc {
    /// The elements in source order, each macro-step after those in its body.
    pub(crate) fn all_elements(&self) -> Vec<&Element> {
        fn add<'e>(elements: &'e [Element], found: &mut Vec<&'e Element>) {
            for element in elements {
                if let Element::Macro(step) = element {
                    add(&step.body, found);
                }
                found.push(element);
            }
        }
        let mut found = Vec::new();
        add(&self.elements, &mut found);
        found
    }

    /// The uses of actions in its steps.
    pub(crate) fn uses(&self) -> impl Iterator<Item = &Use> {
        self.all_elements().into_iter().flat_map(Element::uses)
    }
}

#[derive(Debug, Clone)]
pub(crate) enum Element {
    Step(Step),
    Transition(Transition),
    Macro(MacroStep),
}

impl Element {
    /// The actions of a step.
    pub(crate) fn uses(&self) -> &[Use] {
        if let Element::Step(step) = self { &step.uses } else { &[] }
    }
}

#[derive(Debug, Clone)]
pub(crate) struct Step {
    pub(crate) name: Ident,
    pub(crate) is_initial: bool,
    pub(crate) uses: Vec<Use>,
    pub(crate) label: String,
    pub(crate) role: Role,
    pub(crate) span: Span,
}

/// The role of a step in the body of a macro-step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Role {
    #[default]
    Plain,
    Entry,
    Exit,
    EntryExit,
}

/// A macro-step with its body (PLCopen only).
#[derive(Debug, Clone)]
pub(crate) struct MacroStep {
    pub(crate) name: Ident,
    pub(crate) body: Vec<Element>,
    pub(crate) role: Role,
    pub(crate) span: Span,
}

/// The use of an action in a step.
#[derive(Debug, Clone)]
pub(crate) struct Use {
    pub(crate) action: Ident,
    pub(crate) qualifier: grafsynth_ir::net::Qualifier,
    pub(crate) duration: Option<Expr>,
    pub(crate) span: Span,
}

#[derive(Debug, Clone)]
pub(crate) struct Transition {
    pub(crate) name: Option<Ident>,
    pub(crate) from: Vec<Ident>,
    pub(crate) to: Vec<Ident>,
    pub(crate) priority: Option<u32>,
    /// `{grafsynth restart}`
    pub(crate) restart: bool,
    pub(crate) condition: Expr,
    pub(crate) label: String,
    pub(crate) span: Span,
}

#[derive(Debug, Clone)]
pub(crate) struct Action {
    pub(crate) name: Ident,
    pub(crate) body: Vec<Stmt>,
    pub(crate) label: String,
    pub(crate) span: Span,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Expr {
    pub(crate) kind: ExprKind,
    pub(crate) span: Span,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum ExprKind {
    Bool(bool),
    Int(i64),
    /// Duration in nanoseconds.
    Time(i64),
    Name(Ident),
    Field(Box<Expr>, Ident),
    /// `x.3`
    Bit(Box<Expr>, u32),
    Index(Box<Expr>, Vec<Expr>),
    /// `%IX0.0`
    Address(Ident),
    Not(Box<Expr>),
    Neg(Box<Expr>),
    Binary(Op, Box<Expr>, Box<Expr>),
    /// A chain of one operator. It is a list instead of nested pairs, so it may have any length.
    And(Vec<Expr>),
    Or(Vec<Expr>),
    Call(Ident, Vec<Arg>),
    /// A flag that jump elimination introduces; it has no textual form.
    Flag(Flag),
    /// `1.5`, `'text'`: unsupported; the payload is the name for messages.
    Refused(String),
}

/// A variable that replaces jumps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Flag {
    /// EXIT left the loop.
    Left,
    /// CONTINUE ended the iteration.
    Skipped,
    /// The loop variable after the loop, as an assignment target: EXIT assigns the value of the current iteration to it.
    Variable,
    /// RETURN left the unit.
    Returned,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Op {
    Xor,
    Eq,
    Ne,
    Lt,
    Le,
    Gt,
    Ge,
    Add,
    Sub,
    Mul,
    Div,
    Mod,
    Power,
}

impl Op {
    /// The operator that a standard function or instruction with this name, in capitals, applies.
    pub(crate) fn named(word: &str) -> Option<Self> {
        Some(match word {
            "XOR" => Op::Xor,
            "EQ" => Op::Eq,
            "NE" => Op::Ne,
            "LT" => Op::Lt,
            "LE" => Op::Le,
            "GT" => Op::Gt,
            "GE" => Op::Ge,
            "ADD" => Op::Add,
            "SUB" => Op::Sub,
            "MUL" => Op::Mul,
            "DIV" => Op::Div,
            "MOD" => Op::Mod,
            "EXPT" => Op::Power,
            _ => return None,
        })
    }
}

/// An argument of a call.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Arg {
    pub(crate) name: Option<Ident>,
    pub(crate) value: Expr,
    /// `=>`
    pub(crate) is_output: bool,
    /// `NOT q => x`
    pub(crate) is_negated: bool,
}

impl Arg {
    /// Whether the argument is for the parameter with this name, in capitals.
    pub(crate) fn is_for(&self, parameter: &str) -> bool {
        self.name.as_ref().is_some_and(|name| name.id == *parameter)
    }
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Stmt {
    pub(crate) kind: StmtKind,
    pub(crate) span: Span,
}

/// A value, or the first and last value of a range.
pub(crate) type CaseLabel = (Expr, Option<Expr>);

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum StmtKind {
    Assign {
        target: Expr,
        value: Expr,
    },
    /// A call of a function block instance.
    Call {
        target: Expr,
        arguments: Vec<Arg>,
    },
    If {
        arms: Vec<(Expr, Vec<Stmt>)>,
        otherwise: Vec<Stmt>,
    },
    Case {
        selector: Expr,
        arms: Vec<(Vec<CaseLabel>, Vec<Stmt>)>,
        otherwise: Vec<Stmt>,
    },
    For {
        var: Ident,
        from: Expr,
        to: Expr,
        by: Option<Expr>,
        body: Vec<Stmt>,
    },
    While {
        condition: Expr,
        body: Vec<Stmt>,
    },
    Repeat {
        body: Vec<Stmt>,
        until: Expr,
    },
    Exit,
    Continue,
    Return,
    /// A statement that could not be parsed; the payload is its name for messages.
    Refused(String),
}

/// A part of a statement.
pub(crate) enum Part<'a> {
    Expr(&'a Expr),
    List(&'a [Stmt]),
}

impl StmtKind {
    /// The statement lists of an IF, CASE or loop.
    pub(crate) fn lists(&self) -> impl Iterator<Item = &[Stmt]> {
        let list = |part| if let Part::List(list) = part { Some(list) } else { None };
        self.parts().into_iter().filter_map(list)
    }

    /// The conditions, selectors, bounds and statement lists of an IF, CASE or loop, in source order; empty for other statements.
    pub(crate) fn parts(&self) -> Vec<Part<'_>> {
        match self {
            StmtKind::If { arms, otherwise } => {
                let arms = arms
                    .iter()
                    .flat_map(|(condition, list)| [Part::Expr(condition), Part::List(list)]);
                arms.chain([Part::List(otherwise)]).collect()
            }
            StmtKind::Case { selector, arms, otherwise } => {
                let arms = arms.iter().flat_map(|(labels, list)| {
                    let labels =
                        labels.iter().flat_map(|(low, high)| Some(low).into_iter().chain(high));
                    labels.map(Part::Expr).chain([Part::List(list)])
                });
                [Part::Expr(selector)]
                    .into_iter()
                    .chain(arms)
                    .chain([Part::List(otherwise)])
                    .collect()
            }
            StmtKind::For { var: _, from, to, by, body } => {
                let bounds = [from, to].into_iter().chain(by).map(Part::Expr);
                bounds.chain([Part::List(body)]).collect()
            }
            StmtKind::While { condition, body } => vec![Part::Expr(condition), Part::List(body)],
            StmtKind::Repeat { body, until } => vec![Part::List(body), Part::Expr(until)],
            _ => Vec::new(),
        }
    }
}

impl Expr {
    pub(crate) fn new(kind: ExprKind, span: Span) -> Self {
        Expr { kind, span }
    }

    pub(crate) fn name(name: Ident) -> Self {
        let span = name.span;
        Expr::new(ExprKind::Name(name), span)
    }

    /// The operands, indices and arguments.
    pub(crate) fn children(&self) -> Vec<&Expr> {
        match &self.kind {
            ExprKind::Field(inner, _)
            | ExprKind::Bit(inner, _)
            | ExprKind::Not(inner)
            | ExprKind::Neg(inner) => vec![inner],
            ExprKind::Index(inner, indices) => [&**inner].into_iter().chain(indices).collect(),
            ExprKind::Binary(_, a, b) => vec![a, b],
            ExprKind::And(all) | ExprKind::Or(all) => all.iter().collect(),
            ExprKind::Call(_, arguments) => arguments.iter().map(|one| &one.value).collect(),
            _ => Vec::new(),
        }
    }

    /// Whether the expression reads the variable with this name, in capitals.
    pub(crate) fn reads(&self, variable: &str) -> bool {
        matches!(&self.kind, ExprKind::Name(name) if name.id == *variable)
            || self.children().into_iter().any(|one| one.reads(variable))
    }

    /// The variable at the root of an access.
    pub(crate) fn root(&self) -> Option<&Ident> {
        if let ExprKind::Name(name) = &self.kind {
            return Some(name);
        }
        if let ExprKind::Field(inner, _) | ExprKind::Bit(inner, _) | ExprKind::Index(inner, _) =
            &self.kind
        {
            return inner.root();
        }
        None
    }
}
