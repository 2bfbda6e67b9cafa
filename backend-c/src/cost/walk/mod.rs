//! The worst-case path through the functions of a chart.
//!
//! A statement has a cost for each way out of it: to the next statement, out of the function, out of the loop or `switch`, to the next round. A list adds
//! them up; `if` and `switch` take the maximum of each kind. So a branch that returns early is not added to the statements after it. The path is
//! found afterwards, by determining in reverse which part produced the result.

pub(super) mod compile;
mod expr;
mod frame;
mod kept;
mod live;
mod parts;
mod stmt;
mod trace;

use grafsynth_ir::Gather;
pub use trace::Place;

use self::frame::{Frame, is_one_return};
use self::parts::Compiled;
use self::trace::Tracer;
use super::NotUnderstood;
use super::TaskBound;
use super::machine::{Machine, Op, Widths};
use super::memory::size;
use super::paths::code::{self, Price};
use super::paths::run::Stopped;
use super::paths::{self, Contract, Way};
use super::tree::{Function, Type, Unit};
use crate::Object;
use crate::c::print::Marks;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// Time and number of calls of user functions, each with and without the emitted functions that are called.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
struct Cost {
    time: u64,
    user: u64,
    own: u64,
    own_user: u64,
}

impl Cost {
    /// The cost of something that calls nothing.
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

/// The cost of each way out of a statement; `None` if there is no such way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Flow {
    on: [Option<Cost>; 4],
}

/// Ways out, as indices of [`Flow::on`].
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

    /// The ways out of a loop with this body: after all rounds, or from the last one by `break` or `return`.
    /// Each round asks the condition, and ends with `step`; leaving the body costs a `jump`.
    fn repeated(self, rounds: u64, first: Cost, asked: Cost, step: Cost, jump: Cost) -> Flow {
        let round = match (self.on[NEXT], self.on[CONTINUE]) {
            (Some(a), Some(b)) => Some(a.or(b)),
            (a, b) => a.or(b),
        };
        let round = round.map(|it| it.plus(asked).plus(step)).unwrap_or_default();
        let mut all = Flow::only(NEXT, first.plus(round.times(rounds)).plus(asked));
        let but_one = first.plus(round.times(rounds.saturating_sub(1))).plus(asked);
        for (way, out) in [(NEXT, BREAK), (RETURN, RETURN)] {
            if let (Some(last), true) = (self.on[out], rounds > 0) {
                all.join(Flow::only(way, but_one.plus(last).plus(jump)), Cost::default());
            }
        }
        all
    }
}

/// The results of the walk for a statement.
#[derive(Debug, Clone)]
struct Info {
    /// Its own expressions, including their calls.
    own: Cost,
    /// The functions that these call.
    calls: Vec<usize>,
    flow: Flow,
    /// For each branch except the first: the cost of the condition and its calls. For a loop: the rounds.
    arms: Vec<(Cost, Vec<usize>)>,
    rounds: u64,
}

/// The results of the walk for a function.
#[derive(Debug, Clone, Default)]
struct Summary {
    cost: Cost,
    stack: u64,
    /// Bytes of its locals in memory, including its parts.
    memory: u64,
    entry: u64,
    user_code: bool,
}

#[derive(Debug, Clone)]
struct Local {
    ty: Type,
    rom: bool,
    /// Its initial value, if that is a constant.
    start: Option<i128>,
    /// Its first cell in path exploration.
    cell: usize,
}

struct Walker<'a> {
    unit: &'a Unit,
    machine: &'a Machine,
    /// Loop bounds that the emitter states, by line.
    marks: &'a Marks,
    /// The cost of each task found.
    tasks: Vec<TaskBound>,
    by_name: BTreeMap<Rc<str>, usize>,
    /// Header functions that consist of one expression.
    small: BTreeMap<&'a str, &'a Function>,
    /// Functions that are part of their only caller.
    parts: BTreeMap<&'a str, &'a Function>,
    summaries: Vec<Summary>,
    /// The number of call sites of each of these functions.
    call_sites: Vec<u64>,
    sites: BTreeMap<Rc<str>, u64>,
    infos: Vec<Option<Info>>,
    text: u64,
    // --- of the current function:
    /// Structures that it keeps in registers, and pointers to them.
    kept: BTreeSet<Rc<str>>,
    locals: Vec<(Rc<str>, Local)>,
    spilled: bool,
    /// True if stores may use a pointer without an offset.
    far: bool,
    user_code: bool,
    /// Stack bytes of the library functions.
    helper: u64,
    // --- for path exploration (see [`compile`]):
    /// A function whose cost was computed in another way, and that cost.
    known: Option<(String, Cost)>,
    routines: Vec<code::Routine>,
    ops: Vec<Option<code::Op>>,
    n_cells: usize,
    /// Why the current statement cannot be executed.
    lost: Option<String>,
    // --- of the current statement:
    line: u32,
    cost: Cost,
    calls: Vec<usize>,
}

/// Walks all functions that these roots need.
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
            .gather(),
        parts: BTreeMap::new(),
        summaries: Vec::new(),
        call_sites: Vec::new(),
        sites: BTreeMap::new(),
        infos: vec![None; unit.n_stmts],
        text: 0,
        kept: BTreeSet::new(),
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
    // The whole text is searched, because a function with one caller among these functions may have other callers too.
    for function in &unit.functions {
        for (name, n) in Frame::calls_of(unit, machine, &function.body) {
            *walker.sites.entry(name).or_default() += n;
        }
    }
    let known = walker.known.as_ref().map(|(name, _)| name.as_str());
    let compiled = parts::compiled(unit, machine, &functions, &walker.sites, known);
    for (function, compiled) in functions.into_iter().zip(compiled) {
        let before = walker.text;
        walker.function(function, compiled)?;
        // A function of one expression is inlined into its callers.
        if function.is_inline && is_one_return(function) {
            walker.text = before;
        }
    }
    Ok(walker)
}

/// A bound is reported as useless if a reaction that reaches the limit of micro-steps costs more than this many times as much as one that
/// does not.
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
    let named = |end: &str| format!("{prefix}_{end}");
    let walker = walked(unit, machine, marks, &["init", "step"].map(named), None)?;
    let tables = unit.globals.values().map(|it| size(unit, machine, &it.ty)).sum::<u64>();
    let find = |end: &str| {
        let name = named(end);
        let found = walker.by_name.get(&*name).copied();
        found.ok_or_else(|| NotUnderstood::new(0, format!("no `{name}`")))
    };
    let (step, init) = (find("step")?, find("init")?);
    let of_type = |end: &str| unit.types.get(&*named(end)).map_or(0, |ty| size(unit, machine, ty));
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
    // An estimate, which is used to choose a style, is based on the text.
    let found = if machine.is_bounded { paths::worst(&chart) } else { Err(Stopped::Estimate) };
    let (cost, of_one_event, way) = match &found {
        Ok(found) if found.price.time <= of_text.time => {
            let cost = |price: Price| Cost { user: price.user, ..Cost::of(price.time) };
            tracer.gone(&found.path);
            (cost(found.price), cost(found.of_one_event), found.way)
        }
        Ok(_) | Err(_) => {
            tracer.function(step, 1, &[]);
            (of_text, of_text, Way::Text)
        }
    };
    let path = tracer.path;
    let (unbounded, open) = reservations(&found, contract.limit, cost, machine);
    // The scan is in the header, and is compiled only if it is called, so it is analysed separately. The ring passes one event to each reaction.
    let known = Some((named("step"), of_one_event));
    let scanning = walked(unit, machine, marks, &["scan_isr", "scan"].map(named), known)?;
    let scan = |end: &str| {
        let summary = scanning.summaries.get(*scanning.by_name.get(&*named(end))?)?;
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

/// Why the time of a reaction is not a useful bound, and why it is from the text alone.
fn reservations(
    found: &Result<paths::Found, Stopped>,
    limit: Option<u32>,
    cost: Cost,
    machine: &Machine,
) -> (Option<String>, Option<String>) {
    let (time, unit) = (cost.plus(Cost::of(u64::from(machine.call.time))).time, machine.unit);
    let settles = found.as_ref().is_ok_and(|it| {
        it.settled.is_none_or(|settled| settled.time.saturating_mul(FAR) >= cost.time)
    });
    let open = found.as_ref().err().map(ToString::to_string);
    match (limit, found) {
        (Some(limit), _) if !settles => {
            let why = format!(
                "no number of micro-steps is proved; with the limit of {limit}, a reaction would take {time} {unit}"
            );
            (Some(why), open)
        }
        (_, Err(why @ Stopped::TooMuch)) => {
            let text = "judging by the C code alone, a reaction would take";
            (Some(format!("{why}; {text} {time} {unit}")), None)
        }
        _ => (None, open),
    }
}

/// The functions that these roots need, callees first.
fn needed<'a>(
    unit: &'a Unit,
    machine: &Machine,
    roots: &[String],
) -> Result<Vec<&'a Function>, NotUnderstood> {
    let by_name: BTreeMap<&str, usize> =
        unit.functions.iter().enumerate().map(|(at, it)| (&*it.name, at)).gather();
    let mut order = Vec::new();
    // The state of each function: 0 not visited, 1 in progress, 2 done.
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

impl<'a> Walker<'a> {
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

    fn function(
        &mut self,
        function: &'a Function,
        compiled: Compiled,
    ) -> Result<(), NotUnderstood> {
        let machine = self.machine;
        self.n_cells = 0;
        self.locals = Vec::new();
        for (name, ty) in &function.parameters {
            let cell = self.place_for(ty);
            let local = Local { ty: ty.clone(), rom: false, start: None, cell };
            self.locals.push((name.clone(), local));
        }
        self.user_code = false;
        let Compiled { alone, whole, kept } = compiled;
        self.kept = kept;
        self.far = whole.is_far;
        self.spilled = whole.is_spilled;
        self.helper = 0;
        self.cost = Cost::default();
        if whole.is_part {
            self.parts.insert(&*function.name, function);
        } else {
            self.pay(machine.frame.0);
            self.pay_times(
                machine.frame.1,
                whole.saved.div_ceil(u64::from(machine.register).max(1)),
            );
            if whole.on_stack > 0 {
                self.pay(machine.stack_frame);
            }
        }
        let entry = self.cost;
        let (flow, body) = self.list(&function.body)?;
        let mut both = Flow::NONE;
        both.join(flow, entry);
        let cost = match (both.on[NEXT], both.on[RETURN]) {
            (Some(a), Some(b)) => a.or(b),
            (a, b) => a.or(b).unwrap_or(entry),
        };
        let is_expression = function.is_inline && is_one_return(function);
        let own = |saved: u64| {
            if is_expression { 0 } else { u64::from(machine.return_address) + saved }
        };
        // A function with one call site becomes part of its caller, whose frame then contains its memory too.
        let (mut memory, mut below, mut user_code) = (alone.on_stack, self.helper, self.user_code);
        let called = Frame::calls_of(self.unit, machine, &function.body);
        for index in called.keys().filter_map(|name| self.by_name.get(name)) {
            let Some(callee) = self.summaries.get(*index) else { continue };
            let is_part = self.call_sites.get(*index) == Some(&1);
            memory += if is_part { callee.memory } else { 0 };
            below = below.max(callee.stack - if is_part { callee.memory } else { 0 });
            user_code |= callee.user_code;
        }
        // The larger of the two ways to count: as one frame, and as several frames.
        let memory = memory.max(whole.on_stack);
        let own = own(alone.saved.max(whole.saved));
        let deepest = called.keys().filter_map(|name| self.by_name.get(name));
        let deepest =
            deepest.filter_map(|index| self.routines.get(*index)).map(|it| it.depth).max();
        let routine = self.routine(function, body, entry.time, deepest.unwrap_or(0));
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
            user_code,
        });
        Ok(())
    }
}
