//! The dearest way through the functions of a chart.
//!
//! A statement has a cost for each way out of it: to the next statement, out of the function, out of the loop or `switch`, to the next round. Lists add them up, `if` and
//! `switch` take the dearest of each kind; so a branch that returns early is not added to what stands behind it. The path is found afterwards, by asking
//! in reverse which part gave the figure.

mod compile;
mod expr;
mod frame;
mod trace;

pub(super) use compile::{NOWHERE, cells, numbers};
pub use trace::Place;

use self::frame::{Frame, is_one_return};
use self::trace::Tracer;
use super::NotUnderstood;
use super::TaskBound;
use super::machine::{Machine, Op, Widths};
use super::memory::size;
use super::paths::code::{self, Price, What};
use super::paths::run::Stopped;
use super::paths::{self, Contract, Way};
use super::tree::{Expr, Function, Kind, Stmt, Type, Unit};
use crate::Object;
use crate::ctext::Marks;
use std::collections::BTreeMap;
use std::rc::Rc;

/// Time, and calls of functions of the user; and both without what functions of the text take that are called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Cost {
    time: u64,
    user: u64,
    own: u64,
    own_user: u64,
}

impl Cost {
    /// Something that calls nothing.
    fn of(time: u64) -> Cost {
        Cost { time, user: 0, own: time, own_user: 0 }
    }

    fn each(self, other: Cost, both: impl Fn(u64, u64) -> u64) -> Cost {
        Cost {
            time: both(self.time, other.time),
            user: both(self.user, other.user),
            own: both(self.own, other.own),
            own_user: both(self.own_user, other.own_user),
        }
    }

    fn plus(self, other: Cost) -> Cost {
        self.each(other, u64::saturating_add)
    }

    fn times(self, n: u64) -> Cost {
        self.each(self, |one, _| one.saturating_mul(n))
    }

    fn or(self, other: Cost) -> Cost {
        self.each(other, u64::max)
    }
}

/// The ways out of a statement; none where there is no such way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Flow {
    on: [Option<Cost>; 4],
}

/// Ways out, as places in [`Flow::on`].
const NEXT: usize = 0;
const RETURN: usize = 1;
const BREAK: usize = 2;
const CONTINUE: usize = 3;

impl Flow {
    const NONE: Flow = Flow { on: [None; 4] };

    fn only(way: usize, cost: Cost) -> Flow {
        let mut flow = Flow::NONE;
        flow.on[way] = Some(cost);
        flow
    }

    fn join(&mut self, other: Flow, before: Cost) {
        for (mine, theirs) in self.on.iter_mut().zip(other.on) {
            let theirs = theirs.map(|it| it.plus(before));
            *mine = match (*mine, theirs) {
                (Some(a), Some(b)) => Some(a.or(b)),
                (a, b) => a.or(b),
            };
        }
    }
}

/// What was found out of a statement.
#[derive(Debug, Clone)]
struct Info {
    /// Of its own expressions, with what they call.
    own: Cost,
    /// The functions that these call.
    calls: Vec<usize>,
    flow: Flow,
    /// For each arm but the first: the condition's cost and its calls. For a loop: the rounds.
    arms: Vec<(Cost, Vec<usize>)>,
    rounds: u64,
}

/// What was found out of a function.
#[derive(Debug, Clone, Default)]
struct Summary {
    cost: Cost,
    stack: u64,
    /// Bytes of it that are locals in memory, of all that is part of it.
    memory: u64,
    entry: u64,
    /// The same, or that of a function which becomes part of it, where that is dearer.
    whole_entry: u64,
    user_code: bool,
}

#[derive(Debug, Clone)]
struct Local {
    ty: Type,
    rom: bool,
    /// The value that it begins with, if that is a constant.
    start: Option<i128>,
    /// Its first cell in runs.
    cell: usize,
}

struct Walker<'a> {
    unit: &'a Unit,
    machine: &'a Machine,
    /// Loop bounds that the emitter states, by line.
    marks: &'a Marks,
    /// What each task costs that was met.
    tasks: Vec<TaskBound>,
    by_name: BTreeMap<Rc<str>, usize>,
    /// Functions of the header that are one expression.
    small: BTreeMap<&'a str, &'a Function>,
    summaries: Vec<Summary>,
    /// For each of these the number of places that call it.
    call_sites: Vec<u64>,
    sites: BTreeMap<Rc<str>, u64>,
    infos: Vec<Option<Info>>,
    text: u64,
    // --- of the present function:
    locals: Vec<(Rc<str>, Local)>,
    spilled: bool,
    /// Stores may go through a pointer without an offset.
    far: bool,
    user_code: bool,
    /// Bytes of stack of the library's functions.
    helper: u64,
    // --- for runs (see [`compile`]):
    /// What a function costs that was found in another way.
    known: Option<(String, Cost)>,
    routines: Vec<code::Routine>,
    ops: Vec<Option<code::Op>>,
    n_cells: usize,
    /// Why the present statement can't be run.
    lost: Option<String>,
    // --- of the present statement:
    line: u32,
    cost: Cost,
    calls: Vec<usize>,
}

/// All functions that these need, looked at.
fn walked<'a>(
    unit: &'a Unit,
    machine: &'a Machine,
    marks: &'a Marks,
    roots: &[String],
    known: Option<(String, Cost)>,
) -> Result<Walker<'a>, NotUnderstood> {
    let mut walker = Walker {
        unit,
        machine,
        marks,
        tasks: Vec::new(),
        by_name: BTreeMap::new(),
        small: unit
            .functions
            .iter()
            .filter(|it| it.is_inline && is_one_return(it))
            .map(|it| (&*it.name, it))
            .collect(),
        summaries: Vec::new(),
        call_sites: Vec::new(),
        sites: BTreeMap::new(),
        infos: vec![None; unit.n_stmts],
        text: 0,
        locals: Vec::new(),
        spilled: false,
        far: false,
        user_code: false,
        helper: 0,
        known,
        routines: Vec::new(),
        ops: vec![None; unit.n_stmts],
        n_cells: 0,
        lost: None,
        line: 0,
        cost: Cost::default(),
        calls: Vec::new(),
    };
    let functions = needed(unit, machine, roots)?;
    for function in &functions {
        for (name, n) in Frame::calls_of(unit, machine, &function.body) {
            *walker.sites.entry(name).or_default() += n;
        }
    }
    for function in functions {
        let before = walker.text;
        walker.function(function)?;
        // A function of one expression becomes text within its callers.
        if function.is_inline && is_one_return(function) {
            walker.text = before;
        }
    }
    Ok(walker)
}

/// A reaction that goes to its limit and takes this many times what one takes that does not says nothing.
const FAR: u64 = 3;

/// The bound of a whole chart.
pub(super) fn bound(
    unit: &Unit,
    machine: &Machine,
    prefix: &str,
    marks: &Marks,
    contract: &Contract,
    map: &[(u32, Vec<Object>)],
) -> Result<super::Bound, NotUnderstood> {
    let named = |ends: &[&str]| -> Vec<String> {
        ends.iter().map(|end| format!("{prefix}_{end}")).collect()
    };
    let walker = walked(unit, machine, marks, &named(&["init", "step"]), None)?;
    let tables = unit.globals.values().map(|it| size(unit, machine, &it.ty)).sum::<u64>();
    let find = |end: &str| {
        let name = format!("{prefix}_{end}");
        walker
            .by_name
            .get(&*name)
            .copied()
            .ok_or_else(|| NotUnderstood::new(0, format!("no `{name}`")))
    };
    let (step, init) = (find("step")?, find("init")?);
    let of_type = |end: &str| {
        let name = format!("{prefix}_{end}");
        unit.types.get(&*name).map_or(0, |ty| size(unit, machine, ty))
    };
    let total = |index: usize| walker.summaries.get(index).cloned().unwrap_or_default();
    let of_text = total(step).cost;
    let call = Cost::of(u64::from(machine.call.time));
    let mut tracer = Tracer { walker: &walker, map, path: Vec::new() };
    let chart = paths::Chart {
        unit,
        routines: &walker.routines,
        int_bits: machine.int_bits,
        step,
        init,
        prefix,
        contract,
    };
    // An estimate, to choose a style, is made from the text.
    let found = if machine.is_bounded {
        paths::worst(&chart)
    } else {
        Err(Stopped::Lost("more than the instructions of this machine".to_owned()))
    };
    let (cost, of_one_event, way, open) = match &found {
        Ok(found) if found.price.time <= of_text.time => {
            let cost = |price: Price| Cost { user: price.user, ..Cost::of(price.time) };
            tracer.gone(&found.path);
            (cost(found.price), cost(found.of_one_event), found.way, None)
        }
        Ok(_) | Err(_) => {
            tracer.function(step, 1, &[]);
            (of_text, of_text, Way::Text, found.as_ref().err().map(ToString::to_string))
        }
    };
    let path = tracer.path;
    let unbounded = contract.limit.and_then(|limit| {
        let settled = found.as_ref().ok().map(|it| it.settled);
        match settled {
            Some(Some(settled)) if settled.time.saturating_mul(FAR) >= cost.time => None,
            Some(None) => None,
            Some(Some(_)) | None => Some(format!(
                "no number of micro-steps is proved, and up to the limit of {limit} a reaction would take {} {}",
                cost.plus(call).time,
                machine.unit
            )),
        }
    });
    // The scan lies in the header, and is text only where it is called: it is looked at by itself. The ring hands over one event for each reaction.
    let known = Some((format!("{prefix}_step"), of_one_event));
    let scanning = walked(unit, machine, marks, &named(&["scan_isr", "scan"]), known)?;
    let scan = |end: &str| {
        let name = format!("{prefix}_{end}");
        let summary = scanning.summaries.get(*scanning.by_name.get(&*name)?)?;
        Some(super::ScanBound {
            time: summary.cost.plus(call).time,
            user_calls: summary.cost.user,
            stack: summary.stack,
        })
    };
    Ok(super::Bound {
        step: cost.plus(call).time,
        way,
        open,
        unbounded,
        init: total(init).cost.plus(call).time,
        user_calls: cost.user,
        user_code: total(step).user_code,
        stack: total(step).stack.max(total(init).stack),
        instance: of_type("t"),
        io: of_type("in_t") + of_type("out_t"),
        ring: of_type("ring_t"),
        text: walker.text + tables,
        path,
        scan: scan("scan"),
        scan_isr: scan("scan_isr"),
        tasks: walker.tasks,
    })
}

/// The functions that these need, callees first.
fn needed<'a>(
    unit: &'a Unit,
    machine: &Machine,
    roots: &[String],
) -> Result<Vec<&'a Function>, NotUnderstood> {
    let by_name: BTreeMap<&str, usize> =
        unit.functions.iter().enumerate().map(|(at, it)| (&*it.name, at)).collect();
    let mut order = Vec::new();
    // 0 not met, 1 on the way, 2 done.
    let mut met = vec![0_u8; unit.functions.len()];
    let mut stack: Vec<(usize, bool)> =
        roots.iter().filter_map(|name| by_name.get(name.as_str())).map(|at| (*at, false)).collect();
    while let Some((at, is_done)) = stack.pop() {
        let Some(function) = unit.functions.get(at) else { continue };
        if is_done {
            met[at] = 2;
            order.push(function);
            continue;
        }
        if met[at] != 0 {
            continue;
        }
        met[at] = 1;
        stack.push((at, true));
        let called = Frame::calls_of(unit, machine, &function.body);
        for callee in called.keys().filter_map(|name| by_name.get(&**name)) {
            match met.get(*callee) {
                Some(0) => stack.push((*callee, false)),
                Some(1) => {
                    return Err(NotUnderstood::new(0, format!("`{}` recurses", function.name)));
                }
                Some(_) | None => {}
            }
        }
    }
    Ok(order)
}

fn width(bits: u8) -> usize {
    match bits {
        0..=8 => 0,
        9..=16 => 1,
        17..=32 => 2,
        _ => 3,
    }
}

impl Walker<'_> {
    fn unknown<T>(&self, what: impl Into<String>) -> Result<T, NotUnderstood> {
        Err(NotUnderstood::new(self.line, what))
    }

    fn spend(&mut self, time: u64) {
        self.cost = self.cost.plus(Cost::of(time));
    }

    fn pay(&mut self, op: Op) {
        self.pay_times(op, 1);
    }

    fn pay_times(&mut self, op: Op, n: u64) {
        self.spend(u64::from(op.time) * n);
        self.text += u64::from(op.text) * n;
    }

    fn pay_width(&mut self, widths: &Widths, bits: u8) {
        self.pay(widths[width(bits)]);
    }

    // --- functions -------------------------------------------------------------------------------------------------------------------------

    fn function(&mut self, function: &Function) -> Result<(), NotUnderstood> {
        let machine = self.machine;
        self.n_cells = 0;
        self.locals = Vec::new();
        for (name, ty) in &function.parameters {
            let cell = self.place_for(ty);
            let local = Local { ty: ty.clone(), rom: false, start: None, cell };
            self.locals.push((name.clone(), local));
        }
        self.user_code = false;
        let mut frame = Frame::default();
        for (_, ty) in &function.parameters {
            frame.add(self.unit, machine, ty);
        }
        frame.look(self.unit, machine, &function.body);
        frame.kept(&function.body);
        self.far = frame.pointers > machine.near_pointers;
        // Besides what has a name: both operands of the widest operator.
        let temporary = 2 * u64::from(frame.widest / 8).max(2);
        let kept = frame.reads.values().filter(|n| **n > 1).count() as u64;
        let registers = frame.registers + temporary + kept;
        let scratch = if frame.calls { 0 } else { u64::from(machine.scratch) };
        let saved = registers.saturating_sub(scratch).min(u64::from(machine.saved));
        let spilled = registers.saturating_sub(u64::from(machine.scratch + machine.saved));
        self.spilled = spilled > 0;
        // Once registers are short, temporaries are kept in memory too.
        let on_stack = frame.memory + 3 * spilled + if spilled > 0 { temporary } else { 0 };
        self.helper = 0;
        self.cost = Cost::default();
        self.pay(machine.frame.0);
        self.pay_times(machine.frame.1, saved.div_ceil(u64::from(machine.register).max(1)));
        if on_stack > 0 {
            self.pay(machine.stack_frame);
        }
        let entry = self.cost;
        let (flow, body) = self.list(&function.body)?;
        let mut both = Flow::NONE;
        both.join(flow, entry);
        let cost = match (both.on[NEXT], both.on[RETURN]) {
            (Some(a), Some(b)) => a.or(b),
            (a, b) => a.or(b).unwrap_or(entry),
        };
        let own = if function.is_inline && is_one_return(function) {
            0
        } else {
            u64::from(machine.return_address) + saved
        };
        // A function with one place of call becomes part of its caller, whose frame then holds what it keeps in memory beside everything else there.
        let mut whole_entry = entry.time;
        let (mut memory, mut below, mut user_code) = (on_stack, self.helper, self.user_code);
        for index in frame.called.keys().filter_map(|name| self.by_name.get(name)) {
            let Some(callee) = self.summaries.get(*index) else { continue };
            let is_part = self.call_sites.get(*index) == Some(&1);
            memory += if is_part { callee.memory } else { 0 };
            below = below.max(callee.stack - if is_part { callee.memory } else { 0 });
            user_code |= callee.user_code;
            // The caller then saves what both need.
            whole_entry = whole_entry.max(if is_part { callee.whole_entry } else { 0 });
        }
        let called = frame.called.keys().filter_map(|name| self.by_name.get(name));
        let deepest = called.filter_map(|index| self.routines.get(*index)).map(|it| it.depth).max();
        let routine = self.routine(function, body, whole_entry, deepest.unwrap_or(0));
        self.routines.push(routine);
        let known = self.known.as_ref().filter(|(name, _)| **name == *function.name);
        let cost = known.map_or(cost, |(_, known)| *known);
        self.by_name.insert(function.name.clone(), self.summaries.len());
        self.call_sites.push(self.sites.get(&*function.name).copied().unwrap_or(0));
        self.summaries.push(Summary {
            cost,
            stack: own + memory + below,
            memory,
            entry: entry.time,
            whole_entry,
            user_code,
        });
        Ok(())
    }

    // --- statements ------------------------------------------------------------------------------------------------------------------------

    fn list(&mut self, list: &[Stmt]) -> Result<(Flow, Vec<code::Op>), NotUnderstood> {
        let (depth, first_cell) = (self.locals.len(), self.n_cells);
        let mut flow = Flow::only(NEXT, Cost::default());
        let mut ops = Vec::with_capacity(list.len());
        for stmt in list {
            let one = self.stmt(stmt)?;
            let op = self.taken(stmt);
            ops.push(op);
            // What can't be reached is looked at, for its text, and costs nothing.
            if let Some(before) = flow.on[NEXT].take() {
                flow.join(one, before);
            }
        }
        self.locals.truncate(depth);
        ops.extend(self.forget(list.last().map_or(0, |it| it.line), first_cell));
        Ok((flow, ops))
    }

    /// The cost of expressions on their own.
    fn measured(
        &mut self,
        work: impl FnOnce(&mut Self) -> Result<(), NotUnderstood>,
    ) -> Result<(Cost, Vec<usize>), NotUnderstood> {
        let before = (self.cost, std::mem::take(&mut self.calls));
        self.cost = Cost::default();
        let done = work(self);
        let (cost, calls) = (self.cost, std::mem::take(&mut self.calls));
        (self.cost, self.calls) = before;
        done?;
        Ok((cost, calls))
    }

    fn stmt(&mut self, stmt: &Stmt) -> Result<Flow, NotUnderstood> {
        self.line = stmt.line;
        let machine = self.machine;
        let mut info = Info {
            own: Cost::default(),
            calls: Vec::new(),
            flow: Flow::NONE,
            arms: Vec::new(),
            rounds: 0,
        };
        let op = match &stmt.kind {
            Kind::Expr(expr) => {
                (info.own, info.calls) = self.measured(|it| it.effect(expr))?;
                info.flow = Flow::only(NEXT, info.own);
                self.op(stmt.line, |it| it.effect_op(expr, info.own))
            }
            Kind::Local { name, ty, rom, init } => {
                (info.own, info.calls) = self.measured(|it| {
                    let Some(init) = init else { return Ok(()) };
                    if let Expr::List(n) = init {
                        it.pay_times(machine.store[0], *n);
                        return Ok(());
                    }
                    it.value_into(init, ty)?;
                    match ty {
                        Type::Struct(_) => {
                            let bytes = size(it.unit, machine, ty);
                            it.pay_times(machine.copy, bytes);
                        }
                        Type::Number { bits, .. } => it.local(*bits),
                        Type::Pointer(..) => it.pay_width(&machine.constant, 16),
                        Type::Void | Type::Array(..) => {}
                    }
                    Ok(())
                })?;
                info.flow = Flow::only(NEXT, info.own);
                let start = init.as_ref().and_then(|init| self.unit.value(init));
                let cell = self.place_for(ty);
                let op = self.op(stmt.line, |it| it.local_op(cell, ty, init.as_ref(), info.own));
                self.locals.push((name.clone(), Local { ty: ty.clone(), rom: *rom, start, cell }));
                op
            }
            Kind::If(arms, otherwise) => {
                let mut before = Cost::default();
                let mut ways = Vec::new();
                let last = arms.len();
                for (at, (condition, body)) in arms.iter().enumerate() {
                    self.line = stmt.line;
                    let (cost, calls) = self.measured(|it| it.condition(condition))?;
                    before = before.plus(cost);
                    // The last of all arms falls through to what follows.
                    let more = at + 1 < last || !otherwise.is_empty();
                    let jump = if more { machine.jump } else { Op::default() };
                    self.text += u64::from(jump.text);
                    let question = self.op_of_question(stmt.line, condition);
                    let (mut flow, body) = self.list(body)?;
                    ways.push((question, body, Price { time: u64::from(jump.time), user: 0 }));
                    if let Some(next) = &mut flow.on[NEXT] {
                        *next = next.plus(Cost::of(u64::from(jump.time)));
                    }
                    info.flow.join(flow, before);
                    info.arms.push((cost, calls));
                }
                let (flow, otherwise) = self.list(otherwise)?;
                info.flow.join(flow, before);
                self.op(stmt.line, |it| match compile::all_asked(ways) {
                    Some(ways) => What::If(ways, otherwise),
                    None => it.lost_op("a condition"),
                })
            }
            Kind::Switch(subject, sections) => {
                let labels = sections.iter().flat_map(|(labels, _)| labels);
                let n = labels.flatten().count() as u64;
                (info.own, info.calls) = self.measured(|it| {
                    it.value(subject)?;
                    let values: Vec<i128> = sections
                        .iter()
                        .flat_map(|(labels, _)| labels.iter().flatten())
                        .filter_map(|label| it.unit.value(label))
                        .collect();
                    let range = values.iter().max().zip(values.iter().min());
                    let is_dense =
                        range.is_some_and(|(most, least)| most - least < 3 * i128::from(n));
                    let groups = sections.len() as u64;
                    let from = u64::from(machine.table_from);
                    // Each level of a tree asks for equal and for less.
                    let tree = u64::from(u64::BITS - n.leading_zeros());
                    let by_tree = n.min(tree * 2) * u64::from(machine.switch_compare.time);
                    let by_table = u64::from(machine.switch_table.time);
                    it.spend(if is_dense && groups > from {
                        by_table
                    } else if n < from {
                        by_tree
                    } else {
                        // Labels with one body may or may not count as one.
                        by_tree.max(by_table)
                    });
                    it.text += (n * u64::from(machine.switch_compare.text))
                        .min(u64::from(machine.switch_table.text) + 2 * n);
                    Ok(())
                })?;
                let has_default = sections.iter().any(|(labels, _)| labels.contains(&None));
                // From the last section on: a section without `break` goes on in the next.
                let mut suffix = Flow::only(NEXT, Cost::default());
                let mut all = Flow::NONE;
                let mut flows = Vec::new();
                let mut runs = Vec::new();
                for (labels, body) in sections {
                    let (flow, body) = self.list(body)?;
                    flows.push(flow);
                    runs.push((self.labels(labels), body));
                }
                for flow in flows.into_iter().rev() {
                    let mut one = flow;
                    if let Some(next) = one.on[NEXT].take() {
                        one.join(suffix, next);
                    }
                    suffix = one;
                    all.join(one, Cost::default());
                }
                if !has_default {
                    all.join(Flow::only(NEXT, Cost::default()), Cost::default());
                }
                if let Some(out) = all.on[BREAK].take() {
                    let jump = Cost::of(u64::from(machine.jump.time));
                    all.join(Flow::only(NEXT, out), jump);
                }
                self.text += u64::from(machine.jump.text) * sections.len() as u64;
                info.flow.join(all, info.own);
                self.line = stmt.line;
                self.op(stmt.line, |it| What::Switch {
                    price: compile::own(info.own),
                    subject: it.code(subject),
                    sections: runs,
                    jump: Price { time: u64::from(machine.jump.time), user: 0 },
                })
            }
            Kind::Loop { init, condition, step, body } => {
                let depth = self.locals.len();
                let first_cell = self.n_cells;
                let mut first = Cost::default();
                let mut begin = Vec::new();
                if let Some(init) = init {
                    let flow = self.stmt(init)?;
                    first = flow.on[NEXT].unwrap_or_default();
                    begin.push(self.taken(init));
                }
                self.line = stmt.line;
                let Some((rounds, is_proved)) = self.rounds(stmt, condition.as_ref(), body) else {
                    return self.unknown("a loop without a bound");
                };
                let asked = match condition {
                    Some(condition) => self.measured(|it| it.condition(condition))?,
                    None => (Cost::default(), Vec::new()),
                };
                let stepped = match step {
                    Some(step) => self.measured(|it| it.effect(step))?,
                    None => (Cost::default(), Vec::new()),
                };
                // A counter that only the loop asks for is no part of what is known: its rounds say it.
                let free = compile::without_counter(stmt, condition.as_ref(), body);
                let question =
                    free.unwrap_or(condition.as_ref()).map(|it| self.op_of_question(stmt.line, it));
                let (price, is_free) = (compile::own(asked.0), free.is_some());
                let counted = step
                    .as_ref()
                    .map(|step| self.op(stmt.line, |it| it.effect_op(step, stepped.0)));
                let jump = Cost::of(u64::from(machine.jump.time));
                self.text += u64::from(machine.jump.text);
                let (flow, ops) = self.list(body)?;
                // A round that goes on.
                let round = match (flow.on[NEXT], flow.on[CONTINUE]) {
                    (Some(a), Some(b)) => Some(a.or(b)),
                    (a, b) => a.or(b),
                };
                let round = round.map(|it| it.plus(asked.0).plus(stepped.0).plus(jump));
                let whole = round.unwrap_or_default().times(rounds);
                let but_one = round.unwrap_or_default().times(rounds.saturating_sub(1));
                let mut all = Flow::only(NEXT, first.plus(whole).plus(asked.0));
                if rounds > 0 {
                    for (way, out) in [(NEXT, BREAK), (RETURN, RETURN)] {
                        if let Some(last) = flow.on[out] {
                            let cost = first.plus(but_one).plus(asked.0).plus(last).plus(jump);
                            all.join(Flow::only(way, cost), Cost::default());
                        }
                    }
                }
                info.own = first;
                info.rounds = rounds;
                info.arms = vec![(asked.0, asked.1), (stepped.0.plus(jump), stepped.1)];
                info.flow = all;
                self.locals.truncate(depth);
                let gone = self.forget(stmt.line, first_cell);
                let whole = self.op(stmt.line, |it| {
                    let condition = match question {
                        Some(None) => return it.lost_op("a condition"),
                        Some(found) => found,
                        None => None,
                    };
                    let left = condition.as_ref().map_or(price, |it| price.less(it.price()));
                    let (begin, counted) = match (is_free, begin.as_slice()) {
                        (true, [only]) => {
                            (vec![compile::paid(only)], counted.map(|it| compile::paid(&it)))
                        }
                        _ => (begin, counted),
                    };
                    // What is not asked any more is asked all the same: before each round, and once more.
                    let asked = |at: u32| code::Op { line: at, what: What::Pay(left) };
                    let mut init = begin;
                    init.push(asked(stmt.line));
                    let mut step: Vec<code::Op> = counted.into_iter().collect();
                    step.push(asked(stmt.line));
                    What::Loop {
                        init,
                        condition,
                        step,
                        body: ops,
                        jump: compile::own(jump),
                        rounds,
                        is_proved,
                    }
                });
                match gone {
                    Some(gone) => {
                        code::Op { line: stmt.line, what: What::Block(vec![whole, gone]) }
                    }
                    None => whole,
                }
            }
            Kind::Return(value) => {
                (info.own, info.calls) = self.measured(|it| match value {
                    Some(value) => it.value(value).map(|_| ()),
                    None => Ok(()),
                })?;
                let jump = Cost::of(u64::from(machine.jump.time));
                info.own = info.own.plus(jump);
                self.text += u64::from(machine.jump.text);
                info.flow = Flow::only(RETURN, info.own);
                self.op(stmt.line, |it| {
                    let Some(value) = value else {
                        return What::Return(compile::own(info.own), None);
                    };
                    let (value, asked) = it.root(value);
                    What::Return(compile::own(info.own).less(asked), Some(value))
                })
            }
            Kind::Break => {
                info.flow = Flow::only(BREAK, Cost::default());
                code::Op { line: stmt.line, what: What::Break }
            }
            Kind::Continue => {
                info.flow = Flow::only(CONTINUE, Cost::default());
                code::Op { line: stmt.line, what: What::Continue }
            }
            Kind::Block(body) => {
                let (flow, body) = self.list(body)?;
                info.flow = flow;
                code::Op { line: stmt.line, what: What::Block(body) }
            }
            Kind::UserCode => {
                self.user_code = true;
                info.flow = Flow::only(NEXT, Cost::default());
                code::Op { line: stmt.line, what: What::Lost("code of the user".to_owned()) }
            }
        };
        if let Some(place) = self.ops.get_mut(stmt.id) {
            *place = Some(op);
        }
        let flow = info.flow;
        if let (Kind::If(..), Ok(at)) =
            (&stmt.kind, self.marks.tasks.binary_search_by_key(&stmt.line, |(line, ..)| *line))
            && let Some((_, step, task)) = self.marks.tasks.get(at)
        {
            let time = flow.on[NEXT].unwrap_or_default().time;
            self.tasks.push(TaskBound { step: *step, task: *task, time });
        }
        if let Some(place) = self.infos.get_mut(stmt.id) {
            *place = Some(info);
        }
        Ok(flow)
    }

    /// The most rounds of a loop: from the emitter, or from a conjunct `counter < constant` of a counter that begins with a constant and is counted in every round.
    /// True with it: the text alone does not end the loop there.
    fn rounds(&self, stmt: &Stmt, condition: Option<&Expr>, body: &[Stmt]) -> Option<(u64, bool)> {
        let marked = self
            .marks
            .loops
            .binary_search_by_key(&stmt.line, |(line, _)| *line)
            .ok()
            .and_then(|at| self.marks.loops.get(at))
            .map(|(_, n)| *n);
        let counted = condition.and_then(|condition| self.counted(stmt, condition, body));
        match (marked, counted) {
            (Some(a), Some(b)) => Some((a.min(b), a < b)),
            (a, b) => a.map(|it| (it, true)).or(b.map(|it| (it, false))),
        }
    }

    fn counted(&self, stmt: &Stmt, condition: &Expr, body: &[Stmt]) -> Option<u64> {
        let Expr::Binary(sign, a, b) = condition else { return None };
        if *sign == "&&" {
            return self.counted(stmt, a, body).or_else(|| self.counted(stmt, b, body));
        }
        let Expr::Name(name) = &**a else { return None };
        if *sign != "<" {
            return None;
        }
        let limit = self.unit.value(b)?;
        let start = self.locals.iter().rev().find(|(it, _)| it == name)?.1.start?;
        let is_count = |expr: &Expr| matches!(expr, Expr::Count(it) if matches!(&**it, Expr::Name(it) if it == name));
        let in_step = matches!(&stmt.kind, Kind::Loop { step: Some(step), .. } if is_count(step));
        let in_body = body.iter().any(|it| matches!(&it.kind, Kind::Expr(expr) if is_count(expr)));
        (in_step || in_body).then(|| u64::try_from(limit.saturating_sub(start)).unwrap_or(0))
    }
}
