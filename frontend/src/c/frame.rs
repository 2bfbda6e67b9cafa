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
    let is_program = info.def.name.text == "main" && params.is_empty();
    let mut items = Vec::new();
    let step = |name: &str, role, body, label: &str| {
        Item::Step(Step {
            name: Name::new(name, span),
            role,
            body,
            meta: meta(span, label.to_owned()),
            ..Step::default()
        })
    };
    let macro_step = |name: &str, body: &str, is_initial| {
        Item::MacroStep(MacroStep {
            name: Name::new(name, span),
            body: Name::new(body, span),
            role: if is_initial { StepRole::Initial } else { StepRole::Plain },
            meta: meta(span, String::new()),
            ..MacroStep::default()
        })
    };
    let path = |name: &str| Path::from(Name::new(name, span));
    let name_of = |var: &VarId| var_names.get(var).cloned().unwrap_or_default();
    if is_program {
        // NBS88: the main program is at the top, and the other functions are macro-steps.
        for body in bodies {
            let is_main =
                matches!(&body, Item::Macro(one) if one.name.text == macros[&program.entry]);
            if !is_main {
                items.push(body);
            } else if let Item::Macro(main) = body {
                items.extend(at_top(main.items));
            }
        }
        items.extend(shared.iter().map(|(id, step)| macro_step(step, &macros[id], false)));
        return items;
    }
    let start = names.fresh("start");
    let run = names.fresh("run");
    let input = |name: &str, ty, label: String| {
        declaration(name, span, DeclarationKind::Input { ty, synchronous: false }, label)
    };
    items.push(input(&start, NetType::Bool, format!("run {} once", info.def.name)));
    let mut latches = Block::new();
    let mut leaves = Block::new();
    let mut outputs = Vec::new();
    let assign = |target: Path, index: Option<Expr>, value: Expr| Stmt {
        kind: StmtKind::Assign { target, index, value },
        span,
    };
    let inside = |var: &VarId| Path {
        names: vec![Name::new(run.clone(), span), Name::new(name_of(var), span)],
    };
    for var in &params {
        let info = &program.vars[*var];
        let Some(scalar) = info.scalar() else { continue };
        let ty = scalar.stored();
        match info.length() {
            None => {
                let name = names.plain(&info.name.text);
                items.push(input(
                    &name,
                    ty,
                    comment_at(program, info.name.span).unwrap_or_default(),
                ));
                latches.push(assign(inside(var), None, Expr::leaf(Leaf::Name(path(&name)), span)));
                if info.reference == Reference::Scalar && info.is_written {
                    let name = names.fresh(&format!("{}_out", info.name));
                    outputs.push((name.clone(), ty, format!("*{}", info.name)));
                    leaves.push(assign(
                        path(&name),
                        None,
                        Expr::leaf(Leaf::Name(inside(var)), span),
                    ));
                }
            }
            Some(length) => {
                for index in 0..i64::from(length) {
                    let name = names.fresh(&format!("{}_{index}", info.name));
                    items.push(input(&name, ty, String::new()));
                    latches.push(assign(
                        inside(var),
                        Some(Expr::int(index)),
                        Expr::leaf(Leaf::Name(path(&name)), span),
                    ));
                }
            }
        }
    }
    if let Some(var) = result
        && let Some(scalar) = program.vars[var].scalar()
    {
        let name = names.fresh("result");
        outputs.push((name.clone(), scalar.stored(), "what the function returns".to_owned()));
        leaves.push(assign(path(&name), None, Expr::leaf(Leaf::Name(inside(&var)), span)));
    }
    let done = names.plain("done");
    for (name, ty, label) in outputs {
        items.push(declaration(
            &name,
            span,
            DeclarationKind::Output { ty, init: None, registered: false, mealy: false, safe: None },
            label,
        ));
    }
    items.push(declaration(
        &done,
        span,
        DeclarationKind::Output {
            ty: NetType::Bool,
            init: None,
            registered: false,
            mealy: false,
            safe: None,
        },
        "the function has returned".to_owned(),
    ));
    let (ready, finished) = (names.fresh("ready"), names.fresh("finished"));
    items.extend(bodies);
    items.extend(shared.iter().map(|(id, step)| macro_step(step, &macros[id], false)));
    items.push(step(&ready, StepRole::Initial, Vec::new(), ""));
    items.push(macro_step(&run, &macros[&program.entry], false));
    let action = StepItem {
        kind: StepItemKind::Action {
            target: Name::new(done, span),
            arguments: None,
            how: ActionHow::Bare,
            condition: None,
        },
        span,
    };
    items.push(step(&finished, StepRole::Plain, vec![action], ""));
    let when_start = Expr::leaf(Leaf::Name(path(&start)), span);
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
    items.push(transition(&ready, &run, Some(when_start.clone()), latches));
    items.push(transition(&run, &finished, None, leaves));
    items.push(transition(&finished, &ready, Some(when_start.not()), Block::new()));
    items
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
