//! The JSON of a net, as described in `docs/net-json.md` and, as JSON Schema, in `docs/net-json.schema.json`.
//!
//! All numbered objects of the net are in arrays, and references are indices into these arrays. Expressions are trees of objects with an `op`;
//! operands are in `args`. The members of an object are in alphabetical order, so that the same net gives the same bytes.

use grafsynth_ir::Gather;
use grafsynth_ir::Valid;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{ArithOp, CompareOp, Expr, ExprKind, Type};
use grafsynth_ir::interval::type_of;
use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_ir::names::{C, Namer};
use grafsynth_ir::net::{
    self, Block, ControlledAction, Driver, Emission, Enter, Evolution, ForcingOrder, History,
    Input, InputKind, Meta, Net, Output, Part, Policy, Schedule, Settings, Step, StepKind,
    StmtKind, Transition, TransitionKind, Var, VarId, VarOrigin, Verbatim,
};
use grafsynth_ir::program::{self, Origin, Program, ResetEffect};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The value of `format`.
pub const FORMAT: &str = "grafsynth-net";
/// The value of `version`. It increases if a member is removed or changes its meaning. Added members do not change it.
pub const VERSION: u32 = 1;

/// The maximum time between two reactions, in ticks (semantics §7).
const MOST_TICKS: i64 = i32::MAX as i64;

/// The JSON of a net as text, with a line break at its end.
#[must_use]
pub fn text(json: &Value) -> String {
    // An object of strings, numbers and lists can always be written.
    let mut text = serde_json::to_string_pretty(json).unwrap_or_default();
    text.push('\n');
    text
}

/// The JSON of a net, with the program of one reaction.
///
/// # Errors
/// If the net has no bounded program.
pub fn json(net: &Valid<Net>) -> Result<Value, Vec<Diagnostic>> {
    let program = program(net, &ProgramOptions::default())?;
    let idents = Idents::of(net);
    let settings = &net.settings;
    let label = net.parts.values().map(|part| part.meta.label.as_str());
    let label = label.into_iter().find(|label| !label.is_empty()).unwrap_or_default();
    let mut all = json!({
        "format": FORMAT,
        "version": VERSION,
        "name": net.name.text,
        "ident": Namer::new(&C).name(&net.name.text),
        "label": label,
        "settings": settings_json(settings),
        "parts": list(net.parts.values(), part),
        "inputs": list(net.inputs.values().zip(&idents.inputs), input),
        "outputs": list(net.outputs.values().zip(&idents.outputs), output),
        "vars": list(net.vars.iter().zip(&idents.vars), |it| var(net, it)),
        "timers": net.timers.values().map(|timer| with_meta(json!({
            "name": timer.name.text,
            "condition": condition(&timer.condition),
            "starts_expired": timer.starts_expired,
        }), &timer.meta)).collect::<Vec<_>>(),
        "edges": net.edges.values().map(|edge| json!({ "operand": condition(&edge.expr) })).collect::<Vec<_>>(),
        "steps": list(net.steps.values().zip(&idents.steps), step),
        "transitions": list(net.transitions.values().zip(&idents.transitions), transition),
        "actions": list(net.actions.values(), action),
        "sends": net.sends.values().map(|send| with_meta(json!({
            "name": send.name.text, "event": send.event.index(), "delay": send.delay,
        }), &send.meta)).collect::<Vec<_>>(),
        "histories": list(net.histories.values(), history),
        "forcings": net.forcings.iter().map(|forcing| json!({
            "step": forcing.step.index(),
            "target": indices(&forcing.target),
            "order": match &forcing.order {
                ForcingOrder::Situation(steps) => json!({ "situation": indices(steps) }),
                ForcingOrder::Hold => json!("hold"),
            },
        })).collect::<Vec<_>>(),
        "emergency": net.emergency.as_ref().map(|it| with_meta(json!({
            "condition": condition(&it.condition),
        }), &it.meta)),
        "macros": net.macros.iter().map(|it| with_meta(json!({
            "name": it.name.text,
            "steps": indices(&it.steps),
            "entry": it.entry.index(),
            "exit": it.exit.index(),
        }), &it.meta)).collect::<Vec<_>>(),
        "program": program_json(net, &program),
    });
    // Only the parts of a split have it.
    if let Some(ending) = &net.ending {
        all["ending"] = json!({ "waits": condition(&ending.waits), "quiet": ending.is_quiet });
    }
    Ok(all)
}

/// The objects of an array.
fn list<T>(items: impl Iterator<Item = T>, one: impl Fn(T) -> Value) -> Vec<Value> {
    items.map(one).collect()
}

fn settings_json(settings: &Settings) -> Value {
    json!({
        "policy": match settings.policy {
            Policy::All => "all",
            Policy::Priority => "priority",
            Policy::PriorityAge => "priority-age",
            Policy::InnerFirst => "inner-first",
            Policy::OuterFirst => "outer-first",
        },
        "evolution": match settings.evolution {
            Evolution::Single => json!({ "mode": "single" }),
            Evolution::Stable { limit } => json!({ "mode": "stable", "limit": limit }),
        },
        "schedule": match settings.schedule {
            Schedule::Declared => "declared",
            Schedule::Level => "level",
            Schedule::Priority => "priority",
        },
        "fire_one": settings.fire_one,
        "assign_simultaneous": settings.assign_simultaneous,
        "final_scan": settings.final_scan,
        "events_exclusive": settings.events_exclusive,
        "queue": settings.queue,
        "tick_ns": settings.tick_ns,
    })
}

fn part(part: &Part) -> Value {
    with_meta(
        json!({
            "name": part.name.text,
            "level": part.level,
            "priority": part.priority,
            "initial": enters(&part.initial),
        }),
        &part.meta,
    )
}

fn input((input, ident): (&Input, &String)) -> Value {
    with_meta(
        json!({
            "name": input.name.text,
            "ident": ident,
            "type": ty(input.ty),
            "kind": match input.kind {
                InputKind::Pin => "pin",
                InputKind::Extern => "extern",
                InputKind::Event => "event",
                InputKind::InternalEvent => "internal-event",
            },
            "synchronous": input.synchronous,
        }),
        &input.meta,
    )
}

fn output((output, ident): (&Output, &String)) -> Value {
    with_meta(
        json!({
            "name": output.name.text,
            "ident": ident,
            "type": ty(output.ty),
            "driver": driver(&output.driver),
            "safe": safe(output),
        }),
        &output.meta,
    )
}

fn var(net: &Net, ((id, var), ident): ((VarId, &Var), &String)) -> Value {
    with_meta(
        json!({
            "name": var.name.text,
            "ident": ident,
            "type": ty(var.ty),
            "length": var.len,
            "sharing": net.sharing.get(&id).map(|sharing| sharing.word()),
            "init": values(var.ty, &var.init),
            "origin": match var.origin {
                VarOrigin::Declared => "declared",
                VarOrigin::StoredOutput => "stored-output",
                VarOrigin::Hidden => "hidden",
            },
        }),
        &var.meta,
    )
}

fn step((step, ident): (&Step, &String)) -> Value {
    with_meta(
        json!({
            "name": step.name.text,
            "ident": ident,
            "part": step.part.index(),
            "initial": step.is_initial,
            "kind": match step.kind {
                StepKind::Leaf => "leaf",
                StepKind::Enclosing => "enclosing",
                StepKind::Composite => "composite",
                StepKind::Parallel => "parallel",
                StepKind::Final => "final",
            },
            "shown": !step.hidden && matches!(step.kind, StepKind::Leaf | StepKind::Enclosing | StepKind::Final),
            "parent": step.parent.map(grafsynth_ir::Id::index),
            "activation_link": step.activation_link,
            "hidden": step.hidden,
            "priority": step.priority,
            "entry": block(&step.entry),
            "exit": block(&step.exit),
            "initial_content": block(&step.initial_content),
            "code": step.code.iter().map(verbatim).collect::<Vec<_>>(),
            "budget": step.budget,
            "tasks": step.tasks.iter().map(|task| json!({
                "name": task.name.text, "cost": task.cost, "body": block(&task.body),
            })).collect::<Vec<_>>(),
            "done_event": step.done_event.map(grafsynth_ir::Id::index),
            "locks": indices(&step.locks),
        }),
        &step.meta,
    )
}

fn transition((it, ident): (&Transition, &String)) -> Value {
    with_meta(
        json!({
            "name": it.name.text,
            "ident": ident,
            "part": it.part.index(),
            "kind": match it.kind {
                TransitionKind::Move => "move",
                TransitionKind::Reaction => "reaction",
            },
            "requires": indices(&it.requires),
            "clears": indices(&it.clears),
            "enters": enters(&it.enters),
            "events": indices(&it.events),
            "guard": condition(&it.guard),
            "priority": it.priority,
            "restart": it.restart,
            "actions": block(&it.actions),
        }),
        &it.meta,
    )
}

fn action(action: &ControlledAction) -> Value {
    with_meta(
        json!({
            "name": action.name.text,
            "duration": action.duration,
            "uses": action.uses.iter().map(|it| json!({
                "step": it.step.index(),
                "qualifier": it.qualifier.letters(),
                "condition": it.condition.as_ref().map(condition),
            })).collect::<Vec<_>>(),
            "body": block(&action.body),
        }),
        &action.meta,
    )
}

fn history(history: &History) -> Value {
    with_meta(
        json!({
            "name": history.name.text,
            "owner": history.owner.index(),
            "cases": history.cases.iter().map(|case| json!({
                "step": case.step.index(), "enters": enters(&case.enters),
            })).collect::<Vec<_>>(),
            "default": enters(&history.default),
            "default_content": block(&history.default_content),
        }),
        &history.meta,
    )
}

/// Identifiers of ASCII letters, digits and `_`, each unique within its array.
struct Idents {
    inputs: Vec<String>,
    outputs: Vec<String>,
    vars: Vec<String>,
    steps: Vec<String>,
    transitions: Vec<String>,
}

impl Idents {
    fn of(net: &Net) -> Self {
        let all = |names: Vec<&str>| Namer::new(&C).assign(names);
        Idents {
            inputs: all(net.inputs.values().map(|it| it.name.text.as_str()).collect()),
            outputs: all(net.outputs.values().map(|it| it.name.text.as_str()).collect()),
            vars: all(net.vars.values().map(|it| it.name.text.as_str()).collect()),
            steps: all(net.steps.values().map(|it| it.name.text.as_str()).collect()),
            transitions: all(net.transitions.values().map(|it| it.name.text.as_str()).collect()),
        }
    }
}

fn with_meta(mut value: Value, meta: &Meta) -> Value {
    if let Value::Object(members) = &mut value {
        members.insert("label".to_owned(), json!(meta.label));
        members.insert("req".to_owned(), json!(meta.req));
    }
    value
}

fn indices<T>(ids: &[grafsynth_ir::Id<T>]) -> Vec<usize> {
    ids.iter().map(|id| id.index()).collect()
}

fn ty(ty: Type) -> Value {
    match ty {
        Type::Bool => json!({ "kind": "bool" }),
        Type::Int { lo, hi } => json!({ "kind": "int", "lo": lo, "hi": hi }),
    }
}

/// Values of a type as JSON: a Boolean becomes `false` or `true`.
fn values(ty: Type, numbers: &[i64]) -> Vec<Value> {
    numbers.iter().map(|number| value(ty, *number)).collect()
}

fn value(ty: Type, number: i64) -> Value {
    if ty.is_bool() { json!(number != 0) } else { json!(number) }
}

fn verbatim(code: &Verbatim) -> Value {
    json!({ "language": code.language, "text": code.text })
}

fn enters(enters: &[Enter]) -> Vec<Value> {
    let one = |enter: &Enter| match enter {
        Enter::Step(step) => json!({ "step": step.index() }),
        Enter::InitialContent(step) => json!({ "initial_content": step.index() }),
        Enter::History(history) => json!({ "history": history.index() }),
    };
    enters.iter().map(one).collect()
}

fn driver(driver: &Driver) -> Value {
    let emissions = |emissions: &[Emission]| -> Vec<Value> {
        let one = |it: &Emission| json!({ "step": it.step.index(), "condition": it.condition.as_ref().map(condition) });
        emissions.iter().map(one).collect()
    };
    match driver {
        Driver::Continuous(all) => json!({ "kind": "continuous", "emissions": emissions(all) }),
        Driver::Mealy(all) => json!({ "kind": "mealy", "emissions": emissions(all) }),
        Driver::Fires(transitions) => {
            let all: Vec<usize> = transitions.iter().map(|id| id.index()).collect();
            json!({ "kind": "fires", "transitions": all })
        }
        Driver::Stored(var) => json!({ "kind": "stored", "var": var.index() }),
        Driver::Controlled(action) => json!({ "kind": "controlled", "action": action.index() }),
        Driver::Extern { params, calls } => json!({
            "kind": "extern",
            "params": params.iter().map(|it| json!({ "name": it.name, "type": ty(it.ty) })).collect::<Vec<_>>(),
            "calls": calls.iter().map(|it| json!({
                "step": it.step.index(),
                "condition": it.condition.as_ref().map(condition),
                "args": it.arguments.iter().map(condition).collect::<Vec<_>>(),
            })).collect::<Vec<_>>(),
        }),
    }
}

/// The value of the output during the emergency, declared or not; null for functions, which are not called then.
fn safe(output: &Output) -> Value {
    match output.driver {
        Driver::Extern { .. } => Value::Null,
        Driver::Continuous(_)
        | Driver::Mealy(_)
        | Driver::Fires(_)
        | Driver::Stored(_)
        | Driver::Controlled(_) => value(output.ty, output.safe_value()),
    }
}

fn block(block: &Block) -> Vec<Value> {
    let one = |statement: &net::Stmt| match &statement.kind {
        StmtKind::Assign { var, index, value } => json!({
            "stmt": "assign", "var": var.index(), "index": index.as_ref().map(condition), "value": condition(value),
        }),
        StmtKind::Raise(event) => json!({ "stmt": "raise", "event": event.index() }),
        StmtKind::Send(send) => json!({ "stmt": "send", "send": send.index() }),
        StmtKind::Cancel(send) => json!({ "stmt": "cancel", "send": send.index() }),
        StmtKind::Call { output, arguments } => json!({
            "stmt": "call", "output": output.index(), "args": arguments.iter().map(condition).collect::<Vec<_>>(),
        }),
        StmtKind::If { condition: test, then, otherwise } => json!({
            "stmt": "if", "condition": condition(test), "then": self::block(then), "else": self::block(otherwise),
        }),
        StmtKind::Code(code) => {
            json!({ "stmt": "code", "language": code.language, "text": code.text })
        }
    };
    block.iter().map(one).collect()
}

/// An expression of the net as JSON.
fn condition(expr: &net::Expr) -> Value {
    use net::Leaf;
    tree(expr, &|leaf| match leaf {
        Leaf::Input(input) => json!({ "op": "input", "input": input.index() }),
        Leaf::Var(var) => json!({ "op": "var", "var": var.index() }),
        Leaf::Active(step) => json!({ "op": "active", "step": step.index() }),
        Leaf::Elapsed(step) => json!({ "op": "elapsed", "step": step.index() }),
        Leaf::LastElapsed(step) => json!({ "op": "last-elapsed", "step": step.index() }),
        Leaf::TasksDone(step) => json!({ "op": "tasks-done", "step": step.index() }),
        Leaf::Timer(timer) => json!({ "op": "timer", "timer": timer.index() }),
        Leaf::Rise(edge) => json!({ "op": "rise", "edge": edge.index() }),
        Leaf::Fall(edge) => json!({ "op": "fall", "edge": edge.index() }),
        Leaf::Fireable(transition) => json!({ "op": "fireable", "transition": transition.index() }),
        Leaf::Controlled(action) => json!({ "op": "controlled", "action": action.index() }),
    })
}

/// An expression as objects; its depth is limited by validation.
fn tree<L>(expr: &Expr<L>, leaf: &impl Fn(&L) -> Value) -> Value {
    let node = |op: &str, args: &[&Expr<L>]| json!({ "op": op, "args": args.iter().map(|it| tree(it, leaf)).collect::<Vec<_>>() });
    let list = |op: &str, all: &[Expr<L>]| json!({ "op": op, "args": all.iter().map(|it| tree(it, leaf)).collect::<Vec<_>>() });
    match &expr.kind {
        ExprKind::Bool(value) => json!({ "op": "bool", "value": value }),
        ExprKind::Int(value) => json!({ "op": "int", "value": value }),
        ExprKind::Leaf(inner) => leaf(inner),
        ExprKind::Element(array, index) => {
            json!({ "op": "element", "array": leaf(array), "args": [tree(index, leaf)] })
        }
        ExprKind::Not(a) => node("not", &[a]),
        ExprKind::And(all) => list("and", all),
        ExprKind::Or(all) => list("or", all),
        ExprKind::Compare(op, a, b) => node(
            match op {
                CompareOp::Eq => "eq",
                CompareOp::Ne => "ne",
                CompareOp::Lt => "lt",
                CompareOp::Le => "le",
                CompareOp::Gt => "gt",
                CompareOp::Ge => "ge",
            },
            &[a, b],
        ),
        ExprKind::Neg(a) => node("neg", &[a]),
        ExprKind::Arith(op, a, b) => node(
            match op {
                ArithOp::Add => "add",
                ArithOp::Sub => "sub",
                ArithOp::Mul => "mul",
                ArithOp::Div => "div",
                ArithOp::Mod => "mod",
                ArithOp::BitAnd => "band",
                ArithOp::BitOr => "bor",
                ArithOp::BitXor => "bxor",
                ArithOp::Shl => "shl",
                ArithOp::Shr => "shr",
            },
            &[a, b],
        ),
        ExprKind::Select(c, a, b) => node("select", &[c, a, b]),
    }
}

// --- the program -----------------------------------------------------------------------------------------------------------------------------------

/// The data collected about a program while it is written.
struct Writing<'a> {
    net: &'a Net,
    program: &'a Program,
    /// The largest absolute value of any expression or subexpression.
    largest: u64,
}

fn program_json(net: &Net, program: &Program) -> Value {
    let cells = Namer::new(&C).assign(program.cells.values().map(|it| it.name.as_str()));
    let temps = Namer::new(&C).assign(program.temps.values().map(|it| it.name.as_str()));
    let mut writing = Writing { net, program, largest: 0 };
    for ty in program.cells.values().map(|it| it.ty).chain(net.inputs.values().map(|it| it.ty)) {
        writing.bound(ty);
    }
    let body = writing.list(&program.body);
    let outputs = net.outputs.values().zip(&program.reset_outputs);
    json!({
        "cells": program.cells.values().zip(&cells).map(|(cell, ident)| json!({
            "ident": ident,
            "type": ty(cell.ty),
            "length": cell.len,
            "init": values(cell.ty, &cell.init),
            "origin": origin(cell.origin),
        })).collect::<Vec<_>>(),
        "temps": program.temps.values().zip(&temps).map(|(temp, ident)| json!({
            "ident": ident, "type": ty(temp.ty),
        })).collect::<Vec<_>>(),
        "reset": {
            "outputs": outputs.map(|(output, number)| value(output.ty, *number)).collect::<Vec<_>>(),
            "effects": program.reset_effects.iter().map(|effect| match effect {
                ResetEffect::Call(output, arguments) => json!({
                    "stmt": "call",
                    "output": output.index(),
                    "args": arguments.iter().zip(params(net, *output)).map(|(number, of)| {
                        let op = if of.is_bool() { "bool" } else { "int" };
                        json!({ "op": op, "value": value(of, *number) })
                    }).collect::<Vec<_>>(),
                }),
                ResetEffect::Code(code) => json!({ "stmt": "code", "language": code.language, "text": code.text }),
            }).collect::<Vec<_>>(),
            "fault": program.reset_fault,
        },
        "body": body,
        "largest": writing.largest,
        "step_cells": cells_of(program, &net.steps, Origin::Step),
        "var_cells": cells_of(program, &net.vars, Origin::Var),
    })
}

/// For each item of an arena, the cell that stores it, if any.
fn cells_of<T>(
    program: &Program,
    arena: &grafsynth_ir::Arena<T>,
    origin: fn(grafsynth_ir::Id<T>) -> Origin,
) -> Vec<Option<usize>> {
    let known: BTreeMap<Origin, usize> =
        program.cells.iter().map(|(id, cell)| (cell.origin, id.index())).gather();
    arena.ids().map(|id| known.get(&origin(id)).copied()).collect()
}

fn params(net: &Net, output: net::OutputId) -> Vec<Type> {
    match net.outputs.get(output).map(|it| &it.driver) {
        Some(Driver::Extern { params, .. }) => params.iter().map(|it| it.ty).collect(),
        Some(
            Driver::Continuous(_)
            | Driver::Mealy(_)
            | Driver::Fires(_)
            | Driver::Stored(_)
            | Driver::Controlled(_),
        )
        | None => Vec::new(),
    }
}

impl Writing<'_> {
    fn list(&mut self, statements: &[program::Stmt]) -> Vec<Value> {
        statements.iter().map(|statement| self.statement(statement)).collect()
    }

    fn statement(&mut self, statement: &program::Stmt) -> Value {
        use program::Stmt;
        match statement {
            Stmt::Set(temp, value) => {
                json!({ "stmt": "set", "temp": temp.index(), "value": self.expr(value) })
            }
            Stmt::Store(cell, index, value) => json!({
                "stmt": "store",
                "cell": cell.index(),
                "index": index.as_ref().map(|it| self.expr(it)),
                "value": self.expr(value),
            }),
            Stmt::If(test, then, otherwise) => json!({
                "stmt": "if", "condition": self.expr(test), "then": self.list(then), "else": self.list(otherwise),
            }),
            Stmt::Repeat { limit, condition, body } => json!({
                "stmt": "repeat", "limit": limit, "condition": self.expr(condition), "body": self.list(body),
            }),
            Stmt::Output(output, value) => {
                json!({ "stmt": "output", "output": output.index(), "value": self.expr(value) })
            }
            Stmt::Call(output, arguments) => json!({
                "stmt": "call",
                "output": output.index(),
                "args": arguments.iter().map(|it| self.expr(it)).collect::<Vec<_>>(),
            }),
            Stmt::Code(code) => {
                json!({ "stmt": "code", "language": code.language, "text": code.text })
            }
            // Programs for templates have no marks.
            Stmt::Mark(_) => json!({ "stmt": "mark" }),
            Stmt::Fault(value) => json!({ "stmt": "fault", "value": self.expr(value) }),
        }
    }

    fn expr(&mut self, expr: &program::Expr) -> Value {
        use program::Leaf;
        self.measure(expr);
        tree(expr, &|leaf| match leaf {
            Leaf::Cell(cell) => json!({ "op": "cell", "cell": cell.index() }),
            Leaf::Temp(temp) => json!({ "op": "temp", "temp": temp.index() }),
            Leaf::Input(input) => json!({ "op": "input", "input": input.index() }),
            Leaf::Dt => json!({ "op": "dt" }),
        })
    }

    fn bound(&mut self, ty: Type) {
        let (lo, hi) = ty.bounds();
        self.largest = self.largest.max(lo.unsigned_abs()).max(hi.unsigned_abs());
    }

    /// Records the range of an expression and its parts. Validation has rejected expressions without a type.
    fn measure(&mut self, expr: &program::Expr) {
        let (net, program) = (self.net, self.program);
        let mut leaf = |leaf: &program::Leaf| match *leaf {
            program::Leaf::Cell(cell) => program.cells[cell].ty,
            program::Leaf::Temp(temp) => program.temps[temp].ty,
            program::Leaf::Input(input) => net.inputs[input].ty,
            program::Leaf::Dt => Type::Int { lo: 0, hi: MOST_TICKS },
        };
        match type_of(expr, &mut leaf) {
            Ok(ty) => self.bound(ty),
            // Sums that saturate on storing may exceed 64 bits; a template should then use exact integers.
            Err(_) => self.largest = u64::MAX,
        }
        for operand in expr.children() {
            self.measure(operand);
        }
    }
}

/// The origin of a cell in the net: a kind, and its object.
fn origin(origin: Origin) -> Value {
    let of = |kind: &str, what: &str, index: usize| json!({ "kind": kind, what: index });
    let only = |kind: &str| json!({ "kind": kind });
    match origin {
        Origin::Step(step) => of("step", "step", step.index()),
        Origin::Region(step) => of("region", "step", step.index()),
        // The program of a template gives each step its own timer.
        Origin::Elapsed(step) | Origin::SharedElapsed(step) => of("elapsed", "step", step.index()),
        Origin::LastElapsed(step) => of("last-elapsed", "step", step.index()),
        Origin::Var(var) => of("var", "var", var.index()),
        Origin::Edge(edge) => of("edge", "edge", edge.index()),
        Origin::Timer(timer) => of("timer", "timer", timer.index()),
        Origin::TimerCondition(timer) => of("timer-condition", "timer", timer.index()),
        Origin::Older(a, b) => json!({ "kind": "older", "step": a.index(), "than": b.index() }),
        Origin::TaskIndex(step) => of("task", "step", step.index()),
        Origin::ActionQ(action) => of("action", "action", action.index()),
        Origin::ActionLatch(action, _) => of("action-latch", "action", action.index()),
        Origin::ActionTimer(action, _) => of("action-timer", "action", action.index()),
        Origin::Pending(event) => of("pending", "input", event.index()),
        Origin::InternalQueue => only("internal-queue"),
        Origin::InternalLength => only("internal-length"),
        Origin::ExternalQueue => only("external-queue"),
        Origin::ExternalLength => only("external-length"),
        Origin::SendTimer(send) => of("send-timer", "send", send.index()),
        Origin::SendRuns(send) => of("send-runs", "send", send.index()),
        Origin::Recorded(history, step) => {
            json!({ "kind": "recorded", "history": history.index(), "step": step.index() })
        }
        Origin::Ended(part) => of("ended", "part", part.index()),
        Origin::Fault => only("fault"),
        Origin::HeldOutput(output, _) => of("held-output", "output", output.index()),
        Origin::Helper => only("helper"),
    }
}
