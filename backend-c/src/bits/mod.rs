//! The style `bits`: the reaction program, printed.
//!
//! [`grafsynth_ir::lower::program`] turns any net into a bounded sequential program with one Boolean cell for each step. Here the cells become
//! members of the instance (Booleans as bit-fields), the temps become locals, and the statements become C. A long program is split into functions, so
//! that the C compiler's time stays linear; temps that several functions use are members of a structure on the stack.
// A variant that an emitter forgets is a miscompile.
#![warn(clippy::wildcard_enum_match_arm)]

mod declare;
pub(crate) mod outline;

use crate::c::print::{Arm, Kind, Node};
use crate::calls::{self, Callee};
use crate::cexpr::{CExpr, Class, Helpers, Prec, Scope, c_expr, saturated};
use crate::io::Structure;
use crate::names::{Names, namer};
use crate::queries::carriers;
use crate::style_output::{StyleOutput, mentions, without_unused};
use crate::times::{Ticks, count_type, unsigned};
use crate::{Object, Options};
use declare::{objects_of, objects_of_role};
use grafsynth_c::storage;
use grafsynth_ir::Gather;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{CompareOp, ExprKind, Type};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::lower::program::{Additions, ProgramOptions, program_with, shared_timers};
use grafsynth_ir::names::Namer;
use grafsynth_ir::net::{
    Evolution, InputId, InputKind, Leaf as NetLeaf, Net, OutputId, StepId, TransitionId,
};
use grafsynth_ir::program::{
    Cell, CellId, Expr, Leaf, Origin, Program, ResetEffect, Stmt, Temp, TempId, TempRole,
    expressions,
};
use grafsynth_ir::{IdMap, Valid};
use outline::{Home, Piece, cut, homes};
use std::collections::{BTreeMap, BTreeSet};

/// The number of expression nodes that count as one transition when a program is split into functions.
pub(crate) const NODES_PER_TRANSITION: usize = 16;

/// Marks an `if` as the one that runs a task.
fn as_task(mut nodes: Vec<Node>, task: Option<(StepId, usize)>) -> Vec<Node> {
    if let Some(Kind::Block(arms)) = nodes.first_mut().map(|node| &mut node.kind)
        && let Some(arm) = arms.first_mut()
    {
        arm.task = task;
    }
    nodes
}

/// Emits the net in this style.
///
/// # Errors
/// If the net has no reaction program.
pub(crate) fn program(
    net: &Valid<Net>,
    facts: &Facts,
    names: &Names,
    options: &Options,
) -> Result<StyleOutput, Vec<Diagnostic>> {
    let shared = shared_timers(net, facts);
    let additions = Additions { marks: options.trace.is_some(), shared: &shared };
    let program = program_with(net, &ProgramOptions::default(), additions)?;
    let limit = options.max_transitions.saturating_mul(NODES_PER_TRANSITION).max(1);
    let mut bodies = Vec::new();
    let main = cut(&program.body, limit, &mut bodies);
    let homes = homes(&program, &main, &bodies);
    let mut emit = Emit::new(net, names, &program, homes, names.member_namer(), &[]);
    emit.proved_rounds = facts.most_rounds(net).map(|rounds| rounds.value.into());
    Ok(emit.program(&main, &bodies))
}

/// Prints the statements of a program.
pub(crate) struct Emit<'a> {
    net: &'a Net,
    names: &'a Names,
    program: &'a Program,
    cells: IdMap<Cell, String>,
    /// Cells that are not members: another style stores their values elsewhere, and these expressions read them.
    pub(crate) elsewhere: BTreeMap<CellId, CExpr>,
    temps: IdMap<Temp, String>,
    homes: IdMap<Temp, Home>,
    step_cells: BTreeMap<StepId, CellId>,
    pub(crate) ticks: Option<Ticks>,
    /// Extern conditions that are called at the start of each reaction.
    eager: BTreeSet<InputId>,
    /// Extern conditions that are called when first needed.
    lazy: BTreeSet<InputId>,
    pub(crate) helpers: Helpers,
    /// True if the program is split into functions.
    pub(crate) is_split: bool,
    /// The function being printed: 0 is the reaction itself.
    pub(crate) function: usize,
    /// The number of loops emitted so far, which makes the names of their counters unique.
    loops: usize,
    /// The maximum number of rounds of the evolution, if one is proved. The cost model uses it; the emitted loop does not.
    pub(crate) proved_rounds: Option<u64>,
    /// True if some reaction may set the fault flag.
    pub(crate) sets_fault: bool,
    /// Temps that always have one constant value.
    constants: BTreeMap<TempId, CExpr>,
}

impl<'a> Emit<'a> {
    /// A printer for `program`; `members` contains the names of the instance's members, `taken` those of locals that other code declares.
    pub(crate) fn new(
        net: &'a Net,
        names: &'a Names,
        program: &'a Program,
        homes: IdMap<Temp, Home>,
        mut members: Namer,
        taken: &[String],
    ) -> Self {
        let mut step_cells = BTreeMap::new();
        let cells = IdMap::build(&program.cells, |id, cell| {
            if let Origin::Step(step) = cell.origin {
                step_cells.insert(step, id);
            }
            if let Origin::Var(var) = cell.origin {
                names.vars[var].clone()
            } else {
                members.name(&cell.name)
            }
        });
        let mut locals = namer();
        // Locals must not shadow the functions that compute their values.
        crate::names::library(net, names).iter().for_each(|function| locals.reserve(function));
        taken.iter().for_each(|name| locals.reserve(name));
        let temps = IdMap::build(&program.temps, |_, temp| locals.name(&temp.name));
        let mut emit = Emit {
            net,
            names,
            program,
            cells,
            elsewhere: BTreeMap::new(),
            temps,
            homes,
            step_cells,
            ticks: None,
            eager: BTreeSet::new(),
            lazy: BTreeSet::new(),
            helpers: Helpers::default(),
            is_split: false,
            function: 0,
            loops: 0,
            proved_rounds: None,
            sets_fault: net.settings.evolution != Evolution::Single
                && (program.reset_fault || program.body.iter().any(gives_fault)),
            constants: BTreeMap::new(),
        };
        emit.inputs_and_time();
        emit
    }

    /// Sets where each temp is stored.
    pub(crate) fn set_homes(&mut self, homes: IdMap<Temp, Home>) {
        self.homes = homes;
    }

    /// Decides when each extern condition is called, and whether time is read.
    fn inputs_and_time(&mut self) {
        let net = self.net;
        let mut used = BTreeSet::new();
        let mut timed = false;
        for leaf in expressions(&self.program.body).flat_map(Expr::leaves) {
            match *leaf {
                Leaf::Input(input) => {
                    used.insert(input);
                }
                Leaf::Dt => timed = true,
                Leaf::Cell(_) | Leaf::Temp(_) => {}
            }
        }
        let in_edges: BTreeSet<InputId> = (net.edges.values())
            .flat_map(|edge| edge.expr.leaves())
            .filter_map(NetLeaf::input)
            .gather();
        for input in used {
            if net.inputs[input].kind == InputKind::Extern {
                let set = if in_edges.contains(&input) { &mut self.eager } else { &mut self.lazy };
                set.insert(input);
            }
        }
        if timed {
            self.ticks = Some(Ticks::for_cap(farthest(self.program)));
        }
    }

    /// Emits a function for each body from number `first` on, and returns for every body its call in the reaction.
    pub(crate) fn parts(
        &mut self,
        bodies: &[Vec<Piece<'_>>],
        first: usize,
    ) -> (Vec<Node>, Vec<String>) {
        let prefix = self.names.prefix.clone();
        let mut functions = Vec::new();
        let mut calls = vec![String::new(); first];
        for (index, body) in bodies.iter().enumerate().skip(first) {
            self.function = index + 1;
            let mut nodes = self.locals();
            nodes.extend(self.pieces(body, &[]));
            let nodes = without_unused(nodes);
            let name = format!("{prefix}_part_{}", index + 1 - first);
            let (parameters, arguments) = self.parameters(&nodes);
            functions.push(Node::function(format!("static void {name}({parameters})"), nodes));
            functions.push(Node::blank());
            calls.push(format!("{name}({arguments});"));
        }
        self.function = 0;
        (functions, calls)
    }

    fn program(&mut self, main: &[Piece<'_>], bodies: &[Vec<Piece<'_>>]) -> StyleOutput {
        let prefix = self.names.prefix.clone();
        self.is_split = !bodies.is_empty();
        let (functions, calls) = self.parts(bodies, 0);
        self.function = 0;
        let mut tables = Vec::new();
        let mut step = Vec::new();
        let shared = self.shared_members();
        if !shared.is_empty() {
            step.push(Node::line(format!("{prefix}_scan_t scan;")));
            let mut node: Node = Node::typedef("struct", shared, format!("{prefix}_scan_t"));
            node.note = "data of one reaction".to_string();
            tables.push(node);
        }
        step.extend(self.locals());
        step.extend(self.conditions());
        step.extend(self.pieces(main, &calls));
        let mut step = without_unused(step);
        if !self.shared_members().is_empty() && !mentions(&step, "&scan") {
            step.push(Node::line("(void)scan;"));
        }
        let has_fault = self.net.settings.evolution != Evolution::Single;
        let sets_fault = self.sets_fault;
        StyleOutput {
            style: "bits",
            instance: self.instance(sets_fault),
            enumerators: Vec::new(),
            active: IdMap::build(&self.net.steps, |id, _| {
                self.active(id).map_or_else(|| "false".to_string(), |value| value.text)
            }),
            fault: sets_fault.then(|| "self->fault".to_string()),
            has_fault,
            ticks: self.ticks,
            tables,
            functions,
            init: self.init(sets_fault),
            step,
            helpers: self.helpers.clone(),
            engine: None,
            ranges: self.ranges(),
            holds: self.holds(sets_fault),
            locals: self.carried(&self.program.carried),
            one_bit: self.one_bit(),
        }
    }

    // --- declarations ----------------------------------------------------------------------------------------------------------------------

    fn parameters(&self, nodes: &[Node]) -> (String, String) {
        let prefix = &self.names.prefix;
        let mut parameters = Vec::new();
        let mut arguments = Vec::new();
        let mut add = |word: &str, argument: &str, ty: String| {
            if mentions(nodes, word) {
                parameters.push(format!("{ty}{word}"));
                arguments.push(argument.to_string());
            }
        };
        add("self", "self", format!("{prefix}_t *"));
        add("in", "in", format!("const {prefix}_in_t *"));
        add("dt", "dt", format!("{} ", self.ticks.map_or("uint32_t", Ticks::name)));
        add("out", "out", format!("{prefix}_out_t *"));
        add("scan", "&scan", format!("{prefix}_scan_t *"));
        let parameters =
            if parameters.is_empty() { "void".to_string() } else { parameters.join(", ") };
        (parameters, arguments.join(", "))
    }

    /// A member of the structure that functions share.
    fn shared(&self, name: &str) -> String {
        if self.function == 0 { format!("scan.{name}") } else { format!("scan->{name}") }
    }

    // --- statements ------------------------------------------------------------------------------------------------------------------------

    pub(crate) fn pieces(&mut self, pieces: &[Piece<'_>], calls: &[String]) -> Vec<Node> {
        let mut nodes = Vec::new();
        for piece in pieces {
            match piece {
                Piece::Whole(statement) => self.statement(statement, &mut nodes),
                Piece::If(condition, then, otherwise) => {
                    nodes.extend(self.ask(&[condition], &[]));
                    let task = self.task_of(condition);
                    let condition = self.expr(condition);
                    let then = self.pieces(then, calls);
                    let otherwise = self.pieces(otherwise, calls);
                    nodes.extend(as_task(calls::either(condition, then, otherwise), task));
                }
                Piece::Repeat(limit, condition, body) => {
                    let most = self.most_rounds(condition);
                    let condition = self.expr(condition);
                    let body = self.pieces(body, calls);
                    nodes.extend(self.repeat(*limit, &condition, body, most));
                }
                Piece::Switch(number, cases) => {
                    let cases = cases.iter().map(|case| {
                        let labels = case.steps.iter().map(|(_, label)| label);
                        let steps = case.steps.iter().map(|(step, _)| Object::Step(*step));
                        Node::cases(labels, self.pieces(&case.body, calls)).about_all(steps)
                    });
                    let cases = cases.collect();
                    nodes.push(Node::switch(number, cases));
                }
                Piece::Function(index) => nodes.extend(calls.get(*index).map(Node::line)),
            }
        }
        nodes
    }

    pub(crate) fn statements(&mut self, statements: &[Stmt]) -> Vec<Node> {
        let mut nodes = Vec::new();
        for statement in statements {
            self.statement(statement, &mut nodes);
        }
        nodes
    }

    fn statement(&mut self, statement: &Stmt, nodes: &mut Vec<Node>) {
        match statement {
            Stmt::Set(temp, value) => {
                let role = self.program.temps[*temp].role;
                nodes.extend(self.ask_for_role(value, role));
                let ty = self.program.temps[*temp].ty;
                let value = self.expr(value);
                if self.homes[*temp] == Home::Here && value.constant().is_some() {
                    self.constants.insert(*temp, value);
                    return;
                }
                let text = value.stored_as(ty);
                let name = &self.temps[*temp];
                let line = match self.homes[*temp] {
                    Home::Here => format!("const {} {name} = {text};", storage(ty)),
                    Home::Local(_) => format!("{name} = {text};"),
                    Home::Shared => format!("{} = {text};", self.shared(name)),
                    Home::Nowhere => return,
                };
                let node = Node::line(line).about_all(objects_of_role(role));
                nodes.push(if self.homes[*temp] == Home::Shared {
                    node
                } else {
                    node.defining(name)
                });
            }
            Stmt::Store(cell, index, value) => {
                let mentioned: Vec<&Expr> = index.iter().chain([value]).collect();
                nodes.extend(self.ask(&mentioned, &[]));
                let value = self.saturated(value, self.program.cells[*cell].ty);
                let index = index
                    .as_ref()
                    .map(|index| format!("[{}]", self.expr(index).text))
                    .unwrap_or_default();
                let line = format!("self->{}{index} = {value};", self.cells[*cell]);
                nodes
                    .push(Node::line(line).about_all(objects_of(self.program.cells[*cell].origin)));
            }
            Stmt::If(condition, then, otherwise) => {
                nodes.extend(self.ask(&[condition], &[]));
                let task = self.task_of(condition);
                let condition = self.expr(condition);
                let then = self.statements(then);
                let otherwise = self.statements(otherwise);
                nodes.extend(as_task(calls::either(condition, then, otherwise), task));
            }
            Stmt::Repeat { limit, condition, body } => {
                let most = self.most_rounds(condition);
                let condition = self.expr(condition);
                let body = self.statements(body);
                nodes.extend(self.repeat(*limit, &condition, body, most));
            }
            Stmt::Output(output, value) => {
                let active = self.carriers(*output, value);
                nodes.extend(self.ask(&[value], &active));
                let value = self.saturated(value, self.net.outputs[*output].ty);
                nodes.push(
                    Node::line(self.names.io.write(&self.names.outputs[*output], *output, &value))
                        .about(Object::Output(*output)),
                );
            }
            Stmt::Call(output, arguments) => {
                let mentioned: Vec<&Expr> = arguments.iter().collect();
                nodes.extend(self.ask(&mentioned, &[]));
                let arguments = arguments.iter().map(|argument| self.expr(argument)).collect();
                let callee = Callee { net: self.net, names: self.names, output: *output };
                nodes.push(callee.call(arguments, &mut self.helpers));
            }
            Stmt::Code(text) => nodes.extend(calls::verbatim(text)),
            Stmt::Mark(mark) => nodes.push(crate::trace::mark(self.names, *mark)),
            Stmt::Fault(value) => {
                if self.sets_fault {
                    let value = self.expr(value);
                    nodes.push(Node::line(format!("self->fault = {};", value.text)));
                }
            }
        }
    }

    /// The text of a value that is stored in a type: the nearest value of the type.
    fn saturated(&mut self, value: &Expr, ty: Type) -> String {
        let value = self.expr(value);
        saturated(value, ty, &self.names.prefix, &mut self.helpers).stored_as(ty)
    }

    /// The task that runs under this condition: if a step has several tasks, the one whose turn it is.
    fn task_of(&self, condition: &Expr) -> Option<(StepId, usize)> {
        let of = |expr: &Expr| {
            let ExprKind::Compare(CompareOp::Eq, left, right) = &expr.kind else { return None };
            let (ExprKind::Leaf(Leaf::Cell(cell)), ExprKind::Int(at)) = (&left.kind, &right.kind)
            else {
                return None;
            };
            let Origin::TaskIndex(step) = self.program.cells[*cell].origin else { return None };
            let at = usize::try_from(*at).ok()?;
            (at < self.net.steps[step].tasks.len()).then_some((step, at))
        };
        if let ExprKind::And(parts) = &condition.kind {
            parts.iter().find_map(of)
        } else {
            of(condition)
        }
    }

    /// The proved number of rounds of the loop with this condition.
    fn most_rounds(&self, condition: &Expr) -> Option<u64> {
        let again = self.program.evolution?;
        let is_evolution = matches!(condition.kind, ExprKind::Leaf(Leaf::Temp(it)) if it == again);
        self.proved_rounds.filter(|_| is_evolution)
    }

    /// A loop of at most `limit` rounds, and of at most `most` rounds if that is proved.
    pub(crate) fn repeat(
        &mut self,
        limit: u32,
        condition: &CExpr,
        body: Vec<Node>,
        most: Option<u64>,
    ) -> Vec<Node> {
        if condition.is_false() || limit == 0 {
            return Vec::new();
        }
        if limit == 1 {
            return calls::either(condition.clone(), body, Vec::new());
        }
        self.loops += 1;
        let counter =
            if self.loops == 1 { "round".to_string() } else { format!("round_{}", self.loops) };
        let ty = count_type(i64::from(limit));
        let bound = unsigned(i64::from(limit));
        let question = if condition.is_true() {
            format!("{counter} < {bound}")
        } else {
            format!("({counter} < {bound}) && {}", condition.within(Prec::Unary))
        };
        let head = format!("for ({ty} {counter} = 0; {question}; ++{counter})");
        let arm = Arm { at_most: most, ..Arm::new(head, body) };
        vec![Kind::Block(vec![arm]).into()]
    }

    pub(crate) fn expr(&mut self, expr: &Expr) -> CExpr {
        c_expr(expr, &mut Reader { emit: self })
    }

    // --- extern conditions -----------------------------------------------------------------------------------------------------------------

    /// Calls the extern conditions that a temp's value mentions; those of a receptivity are called only while its transition is enabled.
    fn ask_for_role(&mut self, value: &Expr, role: TempRole) -> Vec<Node> {
        let when = if let TempRole::Fireable(transition) | TempRole::Fire(transition) = role {
            self.enabled(transition)
        } else {
            Vec::new()
        };
        self.ask(&[value], &when)
    }

    /// The conditions that the source steps of a transition are active.
    fn enabled(&self, transition: TransitionId) -> Vec<CExpr> {
        self.net.transitions[transition]
            .requires
            .iter()
            .filter_map(|step| self.active(*step))
            .collect()
    }

    /// The expression that reads a step's bit.
    pub(crate) fn active(&self, step: StepId) -> Option<CExpr> {
        let cell = self.step_cells.get(&step)?;
        match self.elsewhere.get(cell) {
            Some(value) => Some(value.clone()),
            None => Some(CExpr::condition(format!("self->{}", self.cells[*cell]), Prec::Atom)),
        }
    }

    /// The condition that some step that assigns the output is active; empty if the value of the output calls no extern conditions.
    fn carriers(&self, output: OutputId, value: &Expr) -> Vec<CExpr> {
        let steps = carriers(self.net, output, value);
        if steps.is_empty() {
            return Vec::new();
        }
        let any: Vec<CExpr> = steps.into_iter().filter_map(|step| self.active(step)).collect();
        vec![CExpr::or(any)]
    }

    /// If `when` is true, calls the extern conditions that expressions mention and that were not called yet.
    fn ask(&mut self, expressions: &[&Expr], when: &[CExpr]) -> Vec<Node> {
        if self.lazy.is_empty() {
            return Vec::new();
        }
        let mentioned: BTreeSet<InputId> =
            (expressions.iter()).flat_map(|expr| expr.leaves()).filter_map(Leaf::input).gather();
        let mut nodes = Vec::new();
        for input in mentioned.into_iter().filter(|input| self.lazy.contains(input)) {
            let name = &self.names.inputs[input];
            let place = |word: &str| {
                let local = format!("{word}_{name}");
                if self.is_split { self.shared(&local) } else { local }
            };
            let asked = place("asked");
            let mut all = when.to_vec();
            all.push(CExpr::condition(asked.clone(), Prec::Atom).not());
            nodes.push(
                Node::when(
                    &CExpr::and(all).text,
                    vec![
                        Node::line(format!("{asked} = true;")),
                        Node::line(format!("{} = {name}();", place("cond")))
                            .defining_by(place("cond"), format!("(void){name}();")),
                    ],
                )
                .about(Object::Input(input)),
            );
        }
        nodes
    }

    // --- reset -----------------------------------------------------------------------------------------------------------------------------

    pub(crate) fn init(&mut self, fault: bool) -> Vec<Node> {
        let mut nodes = Vec::new();
        for (id, cell) in self.program.cells.iter() {
            if self.elsewhere.contains_key(&id) {
                continue;
            }
            let name = format!("self->{}", self.cells[id]);
            let set = calls::initial(&name, cell.ty, cell.len, &cell.init);
            nodes.extend(set.into_iter().map(|node| node.about_all(objects_of(cell.origin))));
        }
        if fault {
            nodes.push(Node::line(format!("self->fault = {};", self.program.reset_fault)));
        }
        nodes.extend(calls::initial_outputs(self.net, self.names, &self.program.reset_outputs));
        for effect in &self.program.reset_effects {
            match effect {
                ResetEffect::Call(output, values) => {
                    let callee = Callee { net: self.net, names: self.names, output: *output };
                    let values = values.iter().copied().map(CExpr::int).collect();
                    nodes.push(callee.call(values, &mut self.helpers));
                }
                ResetEffect::Code(text) => nodes.extend(calls::verbatim(text)),
            }
        }
        nodes
    }
}

/// The largest value that the timers of a program count to.
fn farthest(program: &Program) -> i64 {
    let timers = program.cells.values().filter(|cell| counts_ticks(cell));
    timers.map(|cell| cell.ty.bounds().1).max().unwrap_or(0)
}

/// How a program receives time; `None` if it does not read time.
pub(crate) fn ticks(program: &Program) -> Option<Ticks> {
    let timed = expressions(&program.body).flat_map(Expr::leaves).any(|leaf| *leaf == Leaf::Dt);
    timed.then(|| Ticks::for_cap(farthest(program)))
}

/// True for a cell that counts ticks.
fn counts_ticks(cell: &Cell) -> bool {
    matches!(
        cell.origin,
        Origin::Elapsed(_)
            | Origin::SharedElapsed(_)
            | Origin::LastElapsed(_)
            | Origin::Timer(_)
            | Origin::ActionTimer(..)
            | Origin::SendTimer(_)
            | Origin::Helper
    )
}

pub(crate) fn gives_fault(statement: &Stmt) -> bool {
    if let Stmt::Fault(value) = statement {
        return !value.is_false();
    }
    statement.lists().into_iter().flatten().any(gives_fault)
}

/// Reads cells, temps and inputs.
struct Reader<'e, 'a> {
    emit: &'e mut Emit<'a>,
}

impl Scope<Leaf> for Reader<'_, '_> {
    fn prefix(&self) -> &str {
        &self.emit.names.prefix
    }

    fn leaf(&mut self, leaf: &Leaf) -> CExpr {
        let emit = &self.emit;
        match *leaf {
            Leaf::Cell(cell) => match emit.elsewhere.get(&cell) {
                Some(value) => value.clone(),
                None => {
                    CExpr::place(format!("self->{}", emit.cells[cell]), emit.program.cells[cell].ty)
                }
            },
            Leaf::Temp(temp) if emit.constants.contains_key(&temp) => emit.constants[&temp].clone(),
            Leaf::Temp(temp) => {
                let name = &emit.temps[temp];
                let ty = emit.program.temps[temp].ty;
                match emit.homes[temp] {
                    Home::Shared => CExpr::place(emit.shared(name), ty),
                    Home::Here | Home::Local(_) | Home::Nowhere => CExpr::place(name, ty),
                }
            }
            Leaf::Input(input) => {
                let name = &emit.names.inputs[input];
                let ty = emit.net.inputs[input].ty;
                match emit.net.inputs[input].kind {
                    InputKind::Pin | InputKind::Event => {
                        emit.names.io.read(Structure::Behind("in"), name, input, ty)
                    }
                    InputKind::Extern if emit.is_split => {
                        CExpr::place(emit.shared(&format!("cond_{name}")), ty)
                    }
                    InputKind::Extern => CExpr::place(format!("cond_{name}"), ty),
                    InputKind::InternalEvent => CExpr::bool(false),
                }
            }
            Leaf::Dt => {
                let most = emit.ticks.map_or(i64::from(i32::MAX), Ticks::max);
                CExpr::exact("(int32_t)dt".to_string(), Prec::Unary, Class::Wide, (0, most))
            }
        }
    }

    fn element(&mut self, array: &Leaf, index: &CExpr) -> CExpr {
        let Leaf::Cell(cell) = *array else { return CExpr::int(0) };
        let text = format!("self->{}[{}]", self.emit.cells[cell], index.text);
        CExpr::place(text, self.emit.program.cells[cell].ty)
    }
}
