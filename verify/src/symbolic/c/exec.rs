//! The statements of C, executed on all paths at once: each path has a condition, and memory is merged where paths join.
//!
//! Conditions of paths are relative to the statement that made them, so that an `if` without exits leaves nothing but the values that it changed.

use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use grafsynth_c::tree::types::{IntKind, Type};
use grafsynth_c::tree::{
    Arm, Case, Init, ItemKind, Label, Loc, Stmt, StmtKind, StructId, SymbolId, SymbolKind, Unit,
};
use grafsynth_c::walk::each_item;
use grafsynth_ir::net::OutputId;

use super::machine::AtLoop;
use super::memory::{Cell, Cells, Memory, Object, Scalar, merge_scalars, n_cells};
use super::report::{Callback, Report};
use super::value::Int;
use crate::symbolic::aig::{Aig, Lit};
use crate::symbolic::calls::Call;
use crate::symbolic::number::Number;

/// The maximum number of statements and expressions that are executed, with those of other paths.
const MAX_WORK: u64 = 20_000_000;
/// The maximum nesting of calls.
const MAX_CALLS: usize = 64;
/// The maximum nesting of statements and expressions, with those of all calls around them.
const MAX_DEPTH: usize = 400;
/// The maximum number of rounds of one loop.
const MAX_ROUNDS: usize = 5_000;

/// The reason for a reaction of which some part has exits.
const LEFT: &str = "an exit from the middle of a reaction is not supported";

/// The reason why the program cannot be executed.
pub(super) type Stop = String;

/// Calls a function of an engine, if it is one.
pub(super) type Engine<'u> =
    fn(&mut Program<'u>, SymbolId, &[Scalar], &mut Memory) -> Option<Done<Option<Scalar>>>;

pub(super) type Done<T> = Result<T, Stop>;

/// Something that the program must never do.
#[derive(Debug, Clone)]
pub(super) struct Obligation {
    /// The condition under which the program does it.
    pub(super) broken: Lit,
    pub(super) what: Danger,
    pub(super) loc: Loc,
}

/// What a program must never do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Danger {
    /// Something that C leaves undefined, such as "divides by 0".
    Undefined(&'static str),
    /// It returns from a reaction before or after the loop over its checks, although the reaction is not complete.
    Leaves,
}

/// A function of the user's library.
#[derive(Debug, Clone)]
pub(super) enum Extern {
    /// An extern condition, with its value in this reaction.
    Condition(Scalar),
    Action(OutputId),
    /// A callback for changes (`--callbacks`).
    Callback(Callback),
}

/// A function whose calls are recorded; each gives instance and outputs any values.
#[derive(Debug, Clone)]
pub(super) struct Replaced {
    pub(super) function: SymbolId,
    /// The arguments that each call must have.
    pub(super) arguments: Vec<Scalar>,
    pub(super) instance: Option<StructId>,
    pub(super) outputs: Option<StructId>,
    /// The cells of the instance that it does not change.
    pub(super) kept: BTreeSet<usize>,
    pub(super) calls: Vec<Made>,
}

/// A call that was made.
#[derive(Debug, Clone)]
pub(super) struct Made {
    pub(super) when: Lit,
    pub(super) before: Memory,
    pub(super) after: Memory,
}

struct Function<'u> {
    params: &'u [SymbolId],
    body: &'u [Stmt],
}

/// The program, and the state of its execution.
pub(super) struct Program<'u> {
    pub(super) unit: &'u Unit,
    pub(super) aig: Aig,
    functions: BTreeMap<SymbolId, Function<'u>>,
    pub(super) constants: Vec<Cells>,
    pub(super) statics: BTreeMap<SymbolId, Object>,
    /// The objects of the locals, by call.
    pub(super) frames: Vec<BTreeMap<SymbolId, Object>>,
    /// The condition of the current path.
    pub(super) here: Lit,
    pub(super) obligations: Vec<Obligation>,
    /// The functions of the user's library that may be called.
    pub(super) externs: BTreeMap<SymbolId, Extern>,
    /// The calls of extern actions so far.
    pub(super) calls: Vec<Call>,
    /// The calls of callbacks so far.
    pub(super) reports: Vec<Report>,
    /// For each extern condition that was called, the conditions of its calls.
    pub(super) asked: BTreeMap<SymbolId, Vec<Lit>>,
    /// A function whose calls are recorded and not executed.
    pub(super) replaced: Option<Replaced>,
    /// True if all values are known, so that what is not known may be 0.
    pub(super) is_executed: bool,
    /// The functions of the engine that interprets the image of a chart, if they may be called.
    pub(super) engine: Option<Engine<'u>>,
    /// The number of rounds that a loop of such an image makes at most, if it is the loop of the evolution and the number is known.
    pub(super) most_rounds: Option<u32>,
    /// What happens at the loop of such an image, unless it is executed.
    pub(super) at_loop: Option<AtLoop<'u>>,
    /// The number of objects so far, also of those that ended.
    pub(super) n_objects: usize,
    work: u64,
    /// The nesting of the statement or expression that is executed.
    depth: usize,
    node_limit: usize,
}

/// The ways in which a statement ends, each with its condition relative to the start of the statement.
#[derive(Default)]
struct Flow {
    normal: Option<(Lit, Memory)>,
    breaks: Vec<(Lit, Memory)>,
    continues: Vec<(Lit, Memory)>,
    returns: Vec<(Lit, Memory, Option<Scalar>)>,
}

/// An arm of an `if` whose condition is not constant.
struct Taken {
    /// Its condition, on the path on which no earlier arm is taken.
    when: Lit,
    /// The number of objects before it.
    first: usize,
    flow: Flow,
}

impl Flow {
    fn n_exits(&self) -> u64 {
        (self.breaks.len() + self.continues.len() + self.returns.len()) as u64
    }

    fn on(memory: Memory) -> Flow {
        Flow { normal: Some((Lit::TRUE, memory)), ..Flow::default() }
    }

    /// Adds the exits of a part that starts under a condition. Returns its normal end.
    fn absorb(&mut self, aig: &mut Aig, when: Lit, part: Flow) -> Option<(Lit, Memory)> {
        for (to, from) in [(&mut self.breaks, part.breaks), (&mut self.continues, part.continues)] {
            for (condition, memory) in from {
                to.push((aig.and(when, condition), memory));
            }
        }
        for (condition, memory, value) in part.returns {
            self.returns.push((aig.and(when, condition), memory, value));
        }
        part.normal
    }
}

impl<'u> Program<'u> {
    /// The program of a unit; its constants are evaluated.
    pub(super) fn new(unit: &'u Unit, aig: Aig, node_limit: usize) -> Done<Self> {
        let mut program = Program {
            unit,
            aig,
            functions: BTreeMap::new(),
            constants: Vec::new(),
            statics: BTreeMap::new(),
            frames: vec![BTreeMap::new()],
            here: Lit::TRUE,
            obligations: Vec::new(),
            externs: BTreeMap::new(),
            calls: Vec::new(),
            reports: Vec::new(),
            asked: BTreeMap::new(),
            replaced: None,
            is_executed: false,
            engine: None,
            most_rounds: None,
            at_loop: None,
            n_objects: 0,
            work: 0,
            depth: 0,
            node_limit,
        };
        let mut objects: BTreeMap<SymbolId, (Option<&'u Init>, bool)> = BTreeMap::new();
        each_item(&unit.items, &mut |item| match &item.kind {
            ItemKind::Function { symbol, params, body } => {
                program.functions.insert(*symbol, Function { params, body });
            }
            ItemKind::Object { symbol, init, is_extern, .. } => {
                let known = objects.entry(*symbol).or_default();
                known.0 = known.0.or(init.as_ref());
                known.1 |= !is_extern;
            }
            _ => {}
        });
        for (symbol, (init, is_defined)) in objects {
            let data = &unit.symbols[symbol];
            // A static object that can change would store a value outside the instance, and the value of an object that another text defines is unknown.
            if !unit.is_const(&data.canonical) || init.is_none() && !is_defined {
                continue;
            }
            let cells = program.initialised(&data.canonical.ty, init, true)?;
            program.constants.push(Rc::new(cells));
            program.statics.insert(symbol, Object::Constant(program.constants.len() - 1));
        }
        Ok(program)
    }

    /// Adds an object to memory.
    pub(super) fn object(&mut self, memory: &mut Memory, cells: Vec<Rc<Cell>>) -> Object {
        let object = memory.add(self.n_objects, cells);
        self.n_objects += 1;
        object
    }

    /// The number of the next object.
    pub(super) fn next_object(&self) -> usize {
        self.n_objects
    }

    /// The cells of an object with an initialiser; without one, the object is 0 if it `is_static`, otherwise it has no value.
    pub(super) fn initialised(
        &mut self,
        ty: &Type,
        init: Option<&'u Init>,
        is_static: bool,
    ) -> Done<Vec<Rc<Cell>>> {
        let n = n_cells(self.unit, ty).ok_or("the size of an object is not known")?;
        if n > 1 << 20 {
            return Err("an object is too large".to_owned());
        }
        let mut cells = Cell::unset(n);
        if init.is_some() || is_static {
            let mut at = 0;
            self.zero(ty, &mut cells, &mut at);
        }
        if let Some(init) = init {
            self.fill(ty, init, &mut cells, 0)?;
        }
        Ok(cells)
    }

    pub(super) fn call(
        &mut self,
        function: SymbolId,
        arguments: Vec<Scalar>,
        memory: &mut Memory,
    ) -> Done<Option<Scalar>> {
        if self.replaced.as_ref().is_some_and(|one| one.function == function) {
            return self.call_replaced(&arguments, memory);
        }
        let data = &self.unit.symbols[function];
        let Some(Function { params, body }) = self.functions.get(&function) else {
            if let Some(known) = self.externs.get(&function).cloned() {
                return self.call_extern(function, known, &arguments);
            }
            if let Some(engine) = self.engine
                && let Some(done) = engine(self, function, &arguments, memory)
            {
                return done;
            }
            return Err(format!(
                "`{}` is called, but its definition is not in the text",
                data.name
            ));
        };
        if self.frames.len() > MAX_CALLS {
            return Err("calls are nested too deeply".to_owned());
        }
        let (params, body) = (*params, *body);
        let first = self.n_objects;
        let mut inner = memory.clone();
        let mut frame = BTreeMap::new();
        for (param, value) in params.iter().zip(arguments) {
            let object = self.object(&mut inner, vec![Rc::new(Cell::of(value))]);
            frame.insert(*param, object);
        }
        self.frames.push(frame);
        let flow = self.block(body, inner);
        self.frames.pop();
        let flow = flow?;
        let mut ends = flow.returns;
        ends.extend(flow.normal.map(|(when, memory)| (when, memory, None)));
        if data.canonical.ty.as_function().is_some_and(|it| it.result.ty != Type::Void) {
            let without = ends.iter().filter(|(_, _, value)| value.is_none());
            let without: Vec<Lit> = without.map(|(when, _, _)| *when).collect();
            let without = self.aig.or_all(without);
            self.oblige(without, "returns no value", data.span);
        }
        let values: Vec<(Lit, &Scalar)> =
            ends.iter().filter_map(|(when, _, value)| Some((*when, value.as_ref()?))).collect();
        let value = merge_scalars(&mut self.aig, &values);
        let memories = ends.into_iter().map(|(when, memory, _)| (when, memory)).collect();
        *memory = Memory::merge(&mut self.aig, memories, first);
        Ok(value)
    }

    /// Records a call of a function of the user's library, which cannot change an object of the program.
    fn call_extern(
        &mut self,
        function: SymbolId,
        known: Extern,
        arguments: &[Scalar],
    ) -> Done<Option<Scalar>> {
        if let Extern::Condition(value) = known {
            self.asked.entry(function).or_default().push(self.here);
            return Ok(Some(value));
        }
        let mut numbers = Vec::new();
        for argument in arguments {
            match argument {
                Scalar::Int(value) => numbers.push(value.number(&mut self.aig)),
                Scalar::Pointer(_) => {
                    return Err("a pointer passed to an extern action is not supported".to_owned());
                }
            }
        }
        let when = self.here;
        match known {
            Extern::Action(output) => self.calls.push(Call { output, when, arguments: numbers }),
            Extern::Callback(of) => self.reports.push(Report { of, when, arguments: numbers }),
            Extern::Condition(_) => {}
        }
        Ok(None)
    }

    /// Any value of a type.
    pub(super) fn any_of(&mut self, kind: IntKind) -> Int {
        if kind == IntKind::Bool {
            return Int::Bit(self.aig.variable());
        }
        let n_bits = self.unit.machine.bits(kind);
        let mut bits: Vec<Lit> = (0..n_bits).map(|_| self.aig.variable()).collect();
        if !self.unit.machine.is_signed(kind) {
            bits.push(Lit::FALSE);
        }
        Int::Word(Number::of_bits(bits))
    }

    /// Begins a call that is executed in parts, by [`Program::straight`] and [`Program::once`].
    pub(super) fn begin(
        &mut self,
        function: SymbolId,
        arguments: Vec<Scalar>,
        memory: &mut Memory,
    ) {
        let params = self.functions.get(&function).map(|it| it.params).unwrap_or_default();
        let mut frame = BTreeMap::new();
        for (param, value) in params.iter().zip(arguments) {
            let object = self.object(memory, vec![Rc::new(Cell::of(value))]);
            frame.insert(*param, object);
        }
        self.frames.push(frame);
    }

    /// Runs statements one after the other whose locals remain; an error if some path leaves them.
    pub(super) fn straight(
        &mut self,
        list: impl IntoIterator<Item = &'u Stmt>,
        memory: Memory,
    ) -> Done<Memory> {
        let mut memory = memory;
        for stmt in list {
            let flow = self.stmt(stmt, memory)?;
            let Flow { normal: Some((_, after)), breaks, continues, returns } = flow else {
                return Err(LEFT.to_owned());
            };
            // The check of `--safe-state` must pass.
            let exits = breaks.iter().chain(&continues).map(|(when, _)| *when);
            let exits = exits.chain(returns.iter().map(|(when, _, _)| *when));
            let left = self.aig.or_all(exits.collect::<Vec<_>>());
            self.never(left, Danger::Leaves, stmt.span);
            memory = after;
        }
        Ok(memory)
    }

    /// Runs a block under the condition that is true on the current path; an error if some path leaves it.
    pub(super) fn once(&mut self, list: &'u [Stmt], memory: Memory) -> Done<Memory> {
        let flow = self.block(list, memory)?;
        Self::only(flow)
    }

    fn only(flow: Flow) -> Done<Memory> {
        match flow {
            Flow { normal: Some((Lit::TRUE, memory)), breaks, continues, returns }
                if breaks.is_empty() && continues.is_empty() && returns.is_empty() =>
            {
                Ok(memory)
            }
            _ => Err(LEFT.to_owned()),
        }
    }

    /// Counts a step of work; an error if the limit is exceeded.
    pub(super) fn tick(&mut self) -> Done<()> {
        self.work += 1;
        if self.work > MAX_WORK {
            return Err(format!("the execution takes more than {MAX_WORK} steps"));
        }
        if self.aig.len() > self.node_limit {
            return Err(format!("the reaction has more than {} nodes", self.node_limit));
        }
        Ok(())
    }

    /// Runs a part one level deeper, with a step of work; an error if the nesting would exceed the limit, so that the stack is bounded.
    pub(super) fn deeper<T>(&mut self, part: impl FnOnce(&mut Self) -> Done<T>) -> Done<T> {
        self.tick()?;
        if self.depth >= MAX_DEPTH {
            return Err(format!(
                "statements and expressions nested more than {MAX_DEPTH} levels deep"
            ));
        }
        self.depth += 1;
        let done = part(self);
        self.depth -= 1;
        done
    }

    /// Runs a part under an additional condition.
    pub(super) fn under<T>(
        &mut self,
        when: Lit,
        part: impl FnOnce(&mut Self) -> Done<T>,
    ) -> Done<T> {
        let before = self.here;
        self.here = self.aig.and(before, when);
        let done = part(self);
        self.here = before;
        done
    }

    /// Records that the behaviour is undefined here if the condition is true.
    pub(super) fn oblige(&mut self, bad: Lit, what: &'static str, loc: Loc) {
        self.never(bad, Danger::Undefined(what), loc);
    }

    /// Records that this must not happen here.
    fn never(&mut self, bad: Lit, what: Danger, loc: Loc) {
        let broken = self.aig.and(self.here, bad);
        if broken != Lit::FALSE {
            self.obligations.push(Obligation { broken, what, loc });
        }
    }

    fn block(&mut self, list: impl IntoIterator<Item = &'u Stmt>, memory: Memory) -> Done<Flow> {
        let first = self.n_objects;
        let before = self.here;
        let mut all = Flow::default();
        let mut now = Some((Lit::TRUE, memory));
        let mut list = list.into_iter().peekable();
        while let Some(stmt) = list.next() {
            let Some((when, memory)) = now.take() else { break };
            let serving = list.peek().and_then(|next| self.serving_loop(stmt, next));
            if serving.is_some() {
                list.next();
            }
            let part = match self.deeper(|this| match serving {
                Some(serving) => this.serve(serving, memory).map(Flow::on),
                None => this.stmt(stmt, memory),
            }) {
                Ok(part) => part,
                Err(stop) => {
                    self.here = before;
                    return Err(stop);
                }
            };
            if let Some((then, memory)) = all.absorb(&mut self.aig, when, part) {
                let when = self.aig.and(when, then);
                self.here = self.aig.and(before, when);
                now = (when != Lit::FALSE).then_some((when, memory));
            }
        }
        self.here = before;
        if let Some((_, memory)) = &mut now {
            memory.end(first);
        }
        all.normal = now;
        Ok(all)
    }

    fn stmt(&mut self, stmt: &'u Stmt, mut memory: Memory) -> Done<Flow> {
        match &stmt.kind {
            StmtKind::Expr(expr) => {
                self.effect(expr, &mut memory)?;
                Ok(Flow::on(memory))
            }
            StmtKind::Define { symbol, init } => {
                let data = &self.unit.symbols[*symbol];
                if matches!(data.kind, SymbolKind::Local { is_static: true }) {
                    if !self.unit.is_const(&data.canonical) {
                        return Err(format!(
                            "the static object `{}`, which is not constant, is not supported",
                            data.name
                        ));
                    }
                    if !self.statics.contains_key(symbol) {
                        let cells = self.initialised(&data.canonical.ty, init.as_ref(), true)?;
                        self.constants.push(Rc::new(cells));
                        let object = Object::Constant(self.constants.len() - 1);
                        self.statics.insert(*symbol, object);
                    }
                    return Ok(Flow::on(memory));
                }
                let cells = match init {
                    Some(Init::Value(value)) => self.assigned(value, &mut memory)?,
                    init => self.initialised(&data.canonical.ty, init.as_ref(), false)?,
                };
                let object = self.object(&mut memory, cells);
                if let Some(frame) = self.frames.last_mut() {
                    frame.insert(*symbol, object);
                }
                Ok(Flow::on(memory))
            }
            StmtKind::If { arms, otherwise } => self.branches(arms, otherwise, memory),
            StmtKind::Switch { on, cases } => {
                let value = self.int(on, &mut memory)?;
                self.switch(on, &value, cases, memory)
            }
            StmtKind::While { condition, body } => {
                self.rounds(Some(condition), body, None, false, memory)
            }
            StmtKind::DoWhile { body, condition } => {
                self.rounds(Some(condition), body, None, true, memory)
            }
            StmtKind::For { init, condition, step, body } => {
                let first = self.n_objects;
                let mut all = Flow::default();
                for one in init {
                    let part = self.deeper(|this| this.stmt(one, memory))?;
                    let Some((_, after)) = all.absorb(&mut self.aig, Lit::TRUE, part) else {
                        return Ok(all);
                    };
                    memory = after;
                }
                let mut flow =
                    self.rounds(condition.as_ref(), body, step.as_ref(), false, memory)?;
                if let Some((_, memory)) = &mut flow.normal {
                    memory.end(first);
                }
                Ok(flow)
            }
            StmtKind::Break => Ok(Flow { breaks: vec![(Lit::TRUE, memory)], ..Flow::default() }),
            StmtKind::Continue => {
                Ok(Flow { continues: vec![(Lit::TRUE, memory)], ..Flow::default() })
            }
            StmtKind::Return(value) => {
                let value = match value {
                    Some(value) => Some(self.scalar(value, &mut memory)?),
                    None => None,
                };
                Ok(Flow { returns: vec![(Lit::TRUE, memory, value)], ..Flow::default() })
            }
            StmtKind::Block(body) => self.block(body, memory),
            StmtKind::Barrier => Ok(Flow::on(memory)),
            StmtKind::Opaque(_) => Err("C code of the chart's author is not supported".to_owned()),
        }
    }

    /// An `if` with all its `else if`, of which there can be any number.
    fn branches(&mut self, arms: &'u [Arm], otherwise: &'u [Stmt], memory: Memory) -> Done<Flow> {
        let before = self.here;
        let mut taken = Vec::new();
        let last = self.arms(arms, otherwise, memory, &mut taken);
        self.here = before;
        let mut flow = last?;
        for Taken { when, first, flow: yes } in taken.into_iter().rev() {
            // The exits of later arms are passed on once for each arm.
            self.work += flow.n_exits();
            self.tick()?;
            flow = self.either(when, yes, flow, first);
        }
        Ok(flow)
    }

    /// Executes arms up to one whose condition is constant. Returns the flow of the path on which none of those in `taken` is taken.
    fn arms(
        &mut self,
        arms: &'u [Arm],
        otherwise: &'u [Stmt],
        mut memory: Memory,
        taken: &mut Vec<Taken>,
    ) -> Done<Flow> {
        for arm in arms {
            let first = self.n_objects;
            let when = self.truth(&arm.condition, &mut memory)?;
            match when.as_constant() {
                Some(true) => return self.block(&arm.body, memory),
                Some(false) => continue,
                None => {}
            }
            let mut then = memory.clone();
            self.assume(&arm.condition, true, &mut then);
            self.assume(&arm.condition, false, &mut memory);
            let flow = self.under(when, |this| this.block(&arm.body, then))?;
            taken.push(Taken { when, first, flow });
            self.here = self.aig.and(self.here, !when);
        }
        self.block(otherwise, memory)
    }

    /// Joins the flows of two paths; objects from `first` on end here.
    fn either(&mut self, when: Lit, yes: Flow, no: Flow, first: usize) -> Flow {
        let mut all = Flow::default();
        let yes = all.absorb(&mut self.aig, when, yes);
        let no = all.absorb(&mut self.aig, !when, no);
        all.normal = match (yes, no) {
            (None, None) => None,
            (Some((then, memory)), None) => Some((self.aig.and(when, then), memory)),
            (None, Some((then, memory))) => Some((self.aig.and(!when, then), memory)),
            (Some((yes, then)), Some((no, otherwise))) => {
                let ends = vec![(when, then), (!when, otherwise)];
                let memory = Memory::merge(&mut self.aig, ends, first);
                Some((self.aig.ite(when, yes, no), memory))
            }
        };
        all
    }

    fn switch(
        &mut self,
        on: &'u grafsynth_c::tree::Expr,
        value: &Int,
        cases: &'u [Case],
        memory: Memory,
    ) -> Done<Flow> {
        let first = self.n_objects;
        let target = |value: i128| {
            let is = |case: &Case, wanted: Option<i128>| {
                case.labels.iter().any(|label| match label {
                    Label::Case(_, value) => Some(*value) == wanted,
                    Label::Default => wanted.is_none(),
                })
            };
            let exact = cases.iter().position(|case| is(case, Some(value)));
            exact.or_else(|| cases.iter().position(|case| is(case, None))).unwrap_or(cases.len())
        };
        // For each case, and after them for none: its condition, and the values that lead to it.
        let mut starts: BTreeMap<usize, (Vec<Lit>, Vec<i128>)> = BTreeMap::new();
        if let Some(all) = value.cases() {
            let index: BTreeMap<i128, usize> = cases
                .iter()
                .enumerate()
                .flat_map(|(at, case)| {
                    case.labels.iter().filter_map(move |label| match label {
                        Label::Case(_, value) => Some((*value, at)),
                        Label::Default => None,
                    })
                })
                .gather();
            let default = target(i128::MAX);
            for (value, condition) in all {
                let at = index.get(&value).copied().unwrap_or(default);
                let start = starts.entry(at).or_default();
                start.0.push(condition);
                start.1.push(value);
            }
        } else {
            let mut handled = Vec::new();
            for (at, case) in cases.iter().enumerate() {
                for label in &case.labels {
                    if let Label::Case(_, label) = label {
                        let is = value.is(&mut self.aig, *label);
                        handled.push(is);
                        starts.entry(at).or_default().0.push(is);
                    }
                }
            }
            let none = !self.aig.or_all(handled);
            starts.entry(target(i128::MAX)).or_default().0.push(none);
        }
        let mut all = Flow::default();
        let mut ends: Vec<(Lit, Memory)> = Vec::new();
        let is_only = starts.len() == 1;
        for (at, (conditions, values)) in starts {
            let when = if is_only { Lit::TRUE } else { self.aig.or_all(conditions) };
            if when == Lit::FALSE {
                continue;
            }
            let mut memory = memory.clone();
            if !values.is_empty() {
                self.assume_one_of(on, &values, &mut memory);
            }
            let body = cases.iter().skip(at).flat_map(|case| &case.body);
            let mut flow = self.under(when, |this| this.block(body, memory))?;
            let breaks = std::mem::take(&mut flow.breaks);
            let normal = all.absorb(&mut self.aig, when, flow);
            for (then, memory) in breaks.into_iter().chain(normal) {
                let when = self.aig.and(when, then);
                if when != Lit::FALSE {
                    ends.push((when, memory));
                }
            }
        }
        let is_total = all.returns.is_empty() && all.continues.is_empty();
        all.normal = self.joined(ends, is_total, first);
        Ok(all)
    }

    /// The end of paths with explicit conditions; `is_total` if one of them is always true.
    fn joined(
        &mut self,
        ends: Vec<(Lit, Memory)>,
        is_total: bool,
        first: usize,
    ) -> Option<(Lit, Memory)> {
        if ends.is_empty() {
            return None;
        }
        let when = if is_total {
            Lit::TRUE
        } else {
            self.aig.or_all(ends.iter().map(|(when, _)| *when).collect::<Vec<_>>())
        };
        Some((when, Memory::merge(&mut self.aig, ends, first)))
    }

    /// A loop; with `is_do`, the first round has no condition.
    fn rounds(
        &mut self,
        condition: Option<&'u grafsynth_c::tree::Expr>,
        body: &'u [Stmt],
        step: Option<&'u grafsynth_c::tree::Expr>,
        is_do: bool,
        memory: Memory,
    ) -> Done<Flow> {
        let before = self.here;
        let done = self.rounds_from(condition, body, step, is_do, memory);
        self.here = before;
        done
    }

    fn rounds_from(
        &mut self,
        condition: Option<&'u grafsynth_c::tree::Expr>,
        body: &'u [Stmt],
        step: Option<&'u grafsynth_c::tree::Expr>,
        is_do: bool,
        mut memory: Memory,
    ) -> Done<Flow> {
        let first = self.n_objects;
        let before = self.here;
        let mut all = Flow::default();
        let mut ends: Vec<(Lit, Memory)> = Vec::new();
        let mut running = Lit::TRUE;
        for round in 0.. {
            if round > MAX_ROUNDS {
                return Err(format!("a loop has more than {MAX_ROUNDS} rounds"));
            }
            if let Some(condition) = condition.filter(|_| round > 0 || !is_do) {
                let goes_on = self.truth(condition, &mut memory)?;
                if goes_on != Lit::TRUE {
                    let ends_here = self.aig.and(running, !goes_on);
                    let mut memory = memory.clone();
                    self.assume(condition, false, &mut memory);
                    if ends_here != Lit::FALSE {
                        ends.push((ends_here, memory));
                    }
                }
                self.assume(condition, true, &mut memory);
                running = self.aig.and(running, goes_on);
                self.here = self.aig.and(before, running);
                if running == Lit::FALSE {
                    break;
                }
            }
            let mut flow = self.block(body, memory)?;
            let breaks = std::mem::take(&mut flow.breaks);
            let continues = std::mem::take(&mut flow.continues);
            let normal = all.absorb(&mut self.aig, running, flow);
            for (when, memory) in breaks {
                ends.push((self.aig.and(running, when), memory));
            }
            let on: Vec<(Lit, Memory)> = continues.into_iter().chain(normal).collect();
            let Some((then, after)) = self.joined(on, false, first) else { break };
            memory = after;
            running = self.aig.and(running, then);
            self.here = self.aig.and(before, running);
            if running == Lit::FALSE {
                break;
            }
            if let Some(step) = step {
                self.effect(step, &mut memory)?;
            }
        }
        let is_total = all.returns.is_empty();
        all.normal = self.joined(ends, is_total, first);
        Ok(all)
    }
}
