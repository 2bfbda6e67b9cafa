//! The top level of a chart: the variables of the file, and the steps that start and end the function that the chart runs.

use super::ast::{ExprKind, Init};
use super::flow::Names;
use super::pieces::{declaration, meta};
use super::resolve::{FunctionId, Home, Program, Reference, VarId};
use super::texts::comment_text;
use super::types::{Scalar, Type};
use super::{ast, constant, initial, lexer};
use crate::codes;
use crate::findings::Findings;
use grafsynth_ir::Gather;
use grafsynth_ir::chart::{
    ActionHow, Block, DeclarationKind, Expr, Item, Leaf, MacroStep, Path, Step, StepItem,
    StepItemKind, StepRole, Stmt, StmtKind, Transition,
};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{Expr as GenericExpr, ExprKind as NetKind, Type as NetType};
use grafsynth_ir::{Name, Span};
use std::collections::{BTreeMap, BTreeSet};

/// The top level of the chart: starts the function and shows its results.
pub(super) fn frame(
    program: &Program<'_>,
    var_names: &BTreeMap<VarId, String>,
    macros: &BTreeMap<FunctionId, String>,
    shared: &BTreeMap<FunctionId, String>,
    mut names: Names,
    bodies: Vec<Item>,
) -> Vec<Item> {
    let info = &program.functions[program.entry];
    let span = info.def.name.span;
    let params: Vec<VarId> =
        info.params.iter().copied().filter(|var| !program.vars[*var].in_library).collect();
    let result = info.result.filter(|var| !program.vars[*var].in_library);
    let macro_step = |name: &str, body: &str| {
        Item::MacroStep(MacroStep {
            name: Name::new(name, span),
            body: Name::new(body, span),
            meta: meta(span, String::new()),
            ..MacroStep::default()
        })
    };
    let shared = shared.iter().map(|(id, step)| macro_step(step, &macros[id]));
    if info.def.name.text == "main" && params.is_empty() {
        // NBS88: the main program is at the top, and the other functions are macro-steps.
        let main = &macros[&program.entry];
        let placed = |body| match body {
            Item::Macro(one) if one.name.text == *main => at_top(one.items),
            body => vec![body],
        };
        return bodies.into_iter().flat_map(placed).chain(shared).collect();
    }
    let (start, run) = (names.fresh("start"), names.fresh("run"));
    let mut passed = Passed {
        program,
        span,
        run: &run,
        var_names,
        names,
        inputs: Vec::new(),
        outputs: Vec::new(),
        latches: Block::new(),
        leaves: Block::new(),
    };
    passed.input(&start, NetType::Bool, format!("run {} once", info.def.name));
    params.iter().for_each(|var| passed.parameter(*var));
    if let Some(var) = result
        && let Some(scalar) = program.vars[var].scalar()
    {
        passed.output("result", var, scalar.stored(), "what the function returns".to_owned());
    }
    let Passed { mut names, inputs: mut items, mut outputs, latches, leaves, .. } = passed;
    let done = names.plain("done");
    outputs.push((done.clone(), NetType::Bool, "the function has returned".to_owned()));
    items.extend(outputs.into_iter().map(|(name, ty, label)| {
        let kind =
            DeclarationKind::Output { ty, init: None, registered: false, mealy: false, safe: None };
        declaration(&name, span, kind, label)
    }));
    let (ready, finished) = (names.fresh("ready"), names.fresh("finished"));
    items.extend(bodies);
    items.extend(shared);
    let body = macro_step(&run, &macros[&program.entry]);
    items.extend(cycle(span, [&ready, &run, &finished], body, &start, done, latches, leaves));
    items
}

/// The steps around the function: it runs while `start` is on, and `done` is on until `start` is off again.
fn cycle(
    span: Span,
    [ready, run, finished]: [&str; 3],
    body: Item,
    start: &str,
    done: String,
    latches: Block,
    leaves: Block,
) -> Vec<Item> {
    let step = |name: &str, role, body| {
        let (name, meta) = (Name::new(name, span), meta(span, String::new()));
        Item::Step(Step { name, role, body, meta, ..Step::default() })
    };
    let mut items = vec![step(ready, StepRole::Initial, Vec::new())];
    items.push(body);
    let action = StepItemKind::Action {
        target: Name::new(done, span),
        arguments: None,
        how: ActionHow::Bare,
        condition: None,
    };
    items.push(step(finished, StepRole::Plain, vec![StepItem { kind: action, span }]));
    let path = |name: &str| Path::from(Name::new(name, span));
    let when_start = Expr::leaf(Leaf::Name(path(start)), span);
    let transition = |from: &str, to: &str, guard: Option<Expr>, actions: Block| {
        Item::Transition(Transition {
            sources: vec![path(from)],
            targets: vec![path(to)],
            guard,
            actions,
            meta: meta(span, String::new()),
            ..Transition::default()
        })
    };
    items.push(transition(ready, run, Some(when_start.clone()), latches));
    items.push(transition(run, finished, None, leaves));
    items.push(transition(finished, ready, Some(when_start.not()), Block::new()));
    items
}

/// The values that the chart passes to the function and back.
struct Passed<'a> {
    program: &'a Program<'a>,
    span: Span,
    /// The macro-step of the function.
    run: &'a str,
    var_names: &'a BTreeMap<VarId, String>,
    names: Names,
    inputs: Vec<Item>,
    /// Outputs with type and label.
    outputs: Vec<(String, NetType, String)>,
    /// The assignments before the function.
    latches: Block,
    /// The assignments after it.
    leaves: Block,
}

impl Passed<'_> {
    fn input(&mut self, name: &str, ty: NetType, label: String) {
        let kind = DeclarationKind::Input { ty, synchronous: false };
        self.inputs.push(declaration(name, self.span, kind, label));
    }

    /// The name of an input or output.
    fn outside(&self, name: &str) -> Path {
        Path::from(Name::new(name, self.span))
    }

    /// The variable in the function.
    fn inside(&self, var: VarId) -> Path {
        let name = self.var_names.get(&var).cloned().unwrap_or_default();
        Path { names: vec![Name::new(self.run, self.span), Name::new(name, self.span)] }
    }

    fn assign(&self, target: Path, index: Option<Expr>, value: Path) -> Stmt {
        let value = Expr::leaf(Leaf::Name(value), self.span);
        Stmt { kind: StmtKind::Assign { target, index, value }, span: self.span }
    }

    /// A new output that shows a variable after the function.
    fn output(&mut self, name: &str, var: VarId, ty: NetType, label: String) {
        let name = self.names.fresh(name);
        self.leaves.push(self.assign(self.outside(&name), None, self.inside(var)));
        self.outputs.push((name, ty, label));
    }

    /// A parameter: an input, and an output if the function writes through it; an array has an input for each element.
    fn parameter(&mut self, var: VarId) {
        let info = &self.program.vars[var];
        let Some(scalar) = info.scalar() else { return };
        let ty = scalar.stored();
        if let Some(length) = info.length() {
            for index in 0..i64::from(length) {
                let name = self.names.fresh(&format!("{}_{index}", info.name));
                self.input(&name, ty, String::new());
                let (to, from) = (self.inside(var), self.outside(&name));
                self.latches.push(self.assign(to, Some(Expr::int(index)), from));
            }
            return;
        }
        let name = self.names.plain(&info.name.text);
        self.input(&name, ty, comment_at(self.program, info.name.span).unwrap_or_default());
        self.latches.push(self.assign(self.inside(var), None, self.outside(&name)));
        if info.reference == Reference::Scalar && info.is_written {
            self.output(&format!("{}_out", info.name), var, ty, format!("*{}", info.name));
        }
    }
}

/// Turns the items of a macro into items of a chart. The entry step becomes initial. The exit step becomes a plain step, or is omitted if
/// no transition leads to it.
fn at_top(items: Vec<Item>) -> Vec<Item> {
    let targets: BTreeSet<String> = items
        .iter()
        .filter_map(
            |item| if let Item::Transition(transition) = item { Some(transition) } else { None },
        )
        .flat_map(|transition| transition.targets.iter().map(ToString::to_string))
        .gather();
    let mut top = Vec::new();
    for mut item in items {
        if let Item::Step(step) = &mut item {
            match step.role {
                StepRole::MacroEntry => step.role = StepRole::Initial,
                StepRole::MacroExit if !targets.contains(&step.name.text) => continue,
                StepRole::MacroExit => step.role = StepRole::Plain,
                _ => {}
            }
        }
        top.push(item);
    }
    top
}

/// Variables of the file. An `extern` or `volatile` variable of the file becomes an output if the source writes or initialises it,
/// otherwise an input; arrays and all other variables stay variables.
pub(super) fn globals(
    program: &Program<'_>,
    var_names: &BTreeMap<VarId, String>,
    findings: &mut Findings,
) -> Vec<Item> {
    let mut items = Vec::new();
    for (id, var) in program.vars.iter().enumerate() {
        let (Home::Global, Some(name)) = (var.home, var_names.get(&id)) else { continue };
        let Some(scalar) = var.scalar() else { continue };
        let is_outside = (var.is_extern || var.is_volatile) && var.owner.is_none();
        let ty = scalar.stored();
        let span = var.name.span;
        let init = initial_values(program, id, scalar, findings);
        let is_array = matches!(var.ty, Type::Array(..));
        let kind = if is_outside && !is_array && !var.is_written && var.init.is_none() {
            DeclarationKind::Input { ty, synchronous: false }
        } else if is_outside && !is_array {
            DeclarationKind::Output {
                ty,
                init: init.into_iter().next(),
                registered: false,
                mealy: false,
                safe: None,
            }
        } else {
            DeclarationKind::Var { ty, len: var.length(), init }
        };
        let comment = comment_at(program, span).unwrap_or_default();
        items.push(declaration(name, span, kind, comment));
    }
    items
}

/// The comment after a declaration on the same line.
pub(super) fn comment_at(program: &Program<'_>, span: Span) -> Option<String> {
    let comment = program.source.comments.iter().find(|comment| comment.start >= span.end)?;
    let gap = program.text.get(span.end as usize..comment.start as usize)?;
    let is_near = !gap.contains('\n') && gap.chars().all(|letter| !letter.is_alphabetic());
    is_near.then(|| comment_text(program.text_of(*comment)))
}

fn constant_expr(value: i64, scalar: Scalar, span: Span) -> Expr {
    if scalar == Scalar::Bool {
        return GenericExpr::new(NetKind::Bool(value != 0), span);
    }
    let Scalar::Int { bits, is_signed } = scalar else {
        return GenericExpr::new(NetKind::Int(value), span);
    };
    let n = 1_i64 << bits;
    let low = value.rem_euclid(n);
    let is_negative = (is_signed || scalar.is_folded()) && low >= n / 2;
    let value = if is_negative { low - n } else { low };
    match u64::try_from(value) {
        Ok(_) => GenericExpr::new(NetKind::Int(value), span),
        Err(_) => GenericExpr::new(
            NetKind::Neg(Box::new(GenericExpr::new(NetKind::Int(-value), span))),
            span,
        ),
    }
}

/// The initial value of a variable of the file, or those of its elements.
fn initial_values(
    program: &Program<'_>,
    id: VarId,
    scalar: Scalar,
    findings: &mut Findings,
) -> Vec<Expr> {
    let var = &program.vars[id];
    let mut of = |expr: Option<&ast::Expr>| match expr {
        None => constant_expr(0, scalar, var.name.span),
        Some(expr) => match constant::value(expr, &program.constants) {
            Ok(value) => constant_expr(value, scalar, expr.span),
            Err(span) => {
                findings.report(|| {
                    Diagnostic::error(
                        codes::C_CONSTANT,
                        format!("the initial value of `{}` is not constant", var.name),
                    )
                    .at(span, "not a constant expression")
                    .help("use numbers, characters, and names from `#define` and `enum`, or assign it in a function")
                });
                constant_expr(0, scalar, span)
            }
        },
    };
    match (var.init, var.length()) {
        (None, _) => Vec::new(),
        (Some(Init::One(expr)), Some(length)) if matches!(expr.kind, ExprKind::Text) => {
            let mut all = lexer::characters(program.file, program.text, expr.span, findings);
            all.resize(length as usize, 0);
            all.into_iter().map(|value| constant_expr(value, scalar, expr.span)).collect()
        }
        (Some(Init::One(expr)), _) => vec![of(Some(expr))],
        (Some(Init::List(all, _)), None) => match all.first() {
            Some(Init::One(expr)) => vec![of(Some(expr))],
            _ => Vec::new(),
        },
        (Some(Init::List(all, span)), Some(length)) => {
            let rest: &[u32] = if let Type::Array(_, _, rest) = &var.ty { rest } else { &[] };
            let mut values = Vec::new();
            initial::flatten(all, rest, &mut values);
            let n = values.len();
            let mut exprs: Vec<Expr> =
                values.into_iter().take(length as usize).map(&mut of).collect();
            if n > length as usize {
                findings.report(|| {
                    Diagnostic::error(codes::C_TYPE, format!("{n} values for {length} elements"))
                        .at(*span, "")
                        .help(format!("remove values, or declare {n} elements"))
                });
            }
            exprs.resize_with(length as usize, || constant_expr(0, scalar, *span));
            exprs
        }
    }
}
