//! FIRE for Grafcet charts, and the execution of statement lists: semantics §3.3.

use grafsynth_ir::expr::{ArithOp, ExprKind, Type};
use grafsynth_ir::net::{
    Driver, Expr, InputId, Leaf, Net, OutputId, SendId, StepId, Stmt, StmtKind, TransitionId,
    VarId, VarOrigin,
};

use crate::layout::Cell;
use crate::notes::{Noticed, Writer};
use crate::reaction::Reaction;
use crate::row::Effect;
use crate::tables::ancestors;

impl Reaction<'_> {
    /// FIRE(F') of §3.9 for Grafcet charts: F1 to F5.
    pub(crate) fn fire(&mut self) {
        self.f1_next_situation();
        self.begin_lists();
        self.f2_deactivate();
        self.f3_act();
        self.f4_activate();
        self.end_lists();
        self.f5_age();
    }

    /// R3 for Grafcet charts: the activation lists of the initial situation, as in a micro-step from the empty situation.
    pub(crate) fn r3_initial_lists(&mut self) {
        self.work.check += 1;
        self.work.down.clear();
        let mut up = std::mem::take(&mut self.work.up);
        up.clear();
        up.extend(self.work.next.iter());
        self.in_order(&mut up);
        self.work.up = up;
        self.begin_lists();
        self.f4_activate();
        self.end_lists();
    }

    fn f1_next_situation(&mut self) {
        self.next();
        let (mut down, mut up) =
            (std::mem::take(&mut self.work.down), std::mem::take(&mut self.work.up));
        down.clear();
        up.clear();
        down.extend(self.state.situation.without(&self.work.next));
        up.extend(self.work.next.without(&self.state.situation));
        down.extend(self.work.restarted.iter());
        up.extend(self.work.restarted.iter());
        self.in_order(&mut down);
        self.in_order(&mut up);
        self.work.down = down;
        self.work.up = up;
    }

    /// Sorts steps by rank, then by declaration (semantics §3.3).
    fn in_order(&self, steps: &mut [StepId]) {
        steps.sort_unstable_by_key(|step| self.tables.ranks.step_place[step.index()]);
    }

    /// Prepares the lists of a micro-step: with simultaneous assignments, all of them read the values from its start.
    pub(crate) fn begin_lists(&mut self) {
        if self.net.settings.assign_simultaneous {
            self.work.before.clone_from(self.state);
            self.work.reads_before = true;
        }
    }

    pub(crate) fn end_lists(&mut self) {
        self.work.reads_before = false;
        self.work.writer = None;
    }

    fn f2_deactivate(&mut self) {
        for at in 0..self.work.down.len() {
            self.deactivate(self.work.down[at]);
        }
    }

    /// Runs the exit list, then clears the step's bit and timer.
    pub(crate) fn deactivate(&mut self, step: StepId) {
        let net = self.net;
        self.run_as(Writer::Exit(step), &net.steps[step].exit);
        self.state.situation.remove(step);
        if let Some((place, _)) = self.tables.layout.elapsed(step) {
            self.state.cells[place] = 0;
        }
        if let Some(place) = self.tables.layout.task(step) {
            self.state.cells[place] = 0;
        }
    }

    fn f3_act(&mut self) {
        let mut chosen = std::mem::take(&mut self.work.chosen);
        chosen.sort_unstable_by_key(|transition| {
            self.tables.ranks.transition_place[transition.index()]
        });
        for transition in &chosen {
            self.act(*transition);
        }
        self.work.chosen = chosen;
    }

    pub(crate) fn act(&mut self, transition: TransitionId) {
        let net = self.net;
        self.work.fired.push(transition);
        self.run_as(Writer::Transition(transition), &net.transitions[transition].actions);
    }

    fn f4_activate(&mut self) {
        for at in 0..self.work.up.len() {
            self.activate(self.work.up[at]);
        }
    }

    /// Sets the step's bit with its timers at 0, then runs the entry list.
    pub(crate) fn activate(&mut self, step: StepId) {
        let net = self.net;
        let layout = &self.tables.layout;
        self.state.situation.insert(step);
        let timers = layout.elapsed(step).into_iter().chain(layout.last_elapsed(step));
        for place in timers.map(|(place, _)| place).chain(layout.task(step)) {
            self.state.cells[place] = 0;
        }
        self.run_as(Writer::Entry(step), &net.steps[step].entry);
    }

    /// F5: moves the activated steps together to the youngest end of the orders of last activation, in declaration order.
    fn f5_age(&mut self) {
        for order in &self.tables.layout.ages {
            let cells = &mut self.state.cells[order.base..order.base + order.steps.len()];
            let is_young =
                |index: i64| self.work.up.iter().any(|step| step.index() as i64 == index);
            if !cells.iter().any(|index| is_young(*index)) {
                continue;
            }
            let (mut young, old): (Vec<i64>, Vec<i64>) =
                cells.iter().copied().partition(|index| is_young(*index));
            young.sort_unstable();
            for (cell, index) in cells.iter_mut().zip(old.into_iter().chain(young)) {
                *cell = index;
            }
        }
    }

    pub(crate) fn run_as(&mut self, writer: Writer, block: &[Stmt]) {
        if !block.is_empty() {
            self.work.writer = Some(writer);
            self.run(block);
        }
    }

    /// Runs a list: each statement sees the effects of the earlier ones.
    pub(crate) fn run(&mut self, block: &[Stmt]) {
        for stmt in block {
            match &stmt.kind {
                StmtKind::Assign { var, index, value } => {
                    self.assign(stmt, *var, index.as_ref(), value)
                }
                StmtKind::Raise(event) => self.raise(*event),
                StmtKind::Send(slot) => self.send(*slot),
                StmtKind::Cancel(slot) => {
                    let place = self.tables.layout.at(Cell::Slot(*slot));
                    self.state.cells[place] = 0;
                }
                StmtKind::Call { output, arguments } => self.call(*output, arguments),
                StmtKind::If { condition, then, otherwise } => {
                    self.mention(condition);
                    let branch = if self.eval(condition) != 0 { then } else { otherwise };
                    self.run(branch);
                }
                StmtKind::Code(text) => self.row.effects.push(Effect::Code(text.clone())),
            }
        }
    }

    /// Stores the nearest value in the variable's range (semantics §6).
    fn assign(&mut self, stmt: &Stmt, var: VarId, index: Option<&Expr>, value: &Expr) {
        if let Some(index) = index {
            self.mention(index);
        }
        self.mention(value);
        let index = index.map(|index| self.eval(index));
        let exact = self.eval(value);
        let stored = self.net.vars[var].ty.saturate(exact);
        if stored != exact {
            self.notes.add(Noticed::Saturated(var, stmt.span));
        }
        let place = self.var_place(var, index);
        let is_count = self.tables.counts[var.index()] && changes_by_one(var, value);
        self.note_writer(var, place, is_count);
        self.state.cells[place] = stored;
    }

    /// Notes the writer, and reports a race if another list wrote the same variable in this micro-step (semantics §3.6). This is not a race if the order of the
    /// lists does not depend on the declaration order (§3.3), or if both only change the number of a counted step: then no value is lost (§8). If a lowering
    /// writes a variable twice, it defines the order of these writes itself.
    fn note_writer(&mut self, var: VarId, place: usize, is_count: bool) {
        let Some(writer) = self.work.writer else { return };
        let now = (self.work.check, Some(writer), is_count);
        let (check, before, was_count) = std::mem::replace(&mut self.work.written[place], now);
        if let Some(before) = before
            && check == self.work.check
            && before != writer
            && !(is_count && was_count)
            && !self.is_order_fixed(before, writer)
            && self.net.vars[var].origin != VarOrigin::Hidden
        {
            self.notes.add(Noticed::Race(var, before, writer));
        }
    }

    /// True if the order of two lists does not depend on the declaration order. Deactivation lists come before actions, and these before activation lists; in a
    /// statechart a state is left after its descendants and entered before them (semantics §3.3).
    fn is_order_fixed(&self, first: Writer, second: Writer) -> bool {
        /// The phase in which a list runs, and its step.
        fn of(net: &Net, writer: Writer) -> (u8, Option<StepId>) {
            match writer {
                Writer::Exit(step) => (0, Some(step)),
                Writer::Transition(_) => (1, None),
                Writer::Entry(step) | Writer::InitialContent(step) => (2, Some(step)),
                Writer::HistoryContent(history) => (2, Some(net.histories[history].owner)),
            }
        }
        let ((phase_a, a), (phase_b, b)) = (of(self.net, first), of(self.net, second));
        let is_nested = |a: StepId, b: StepId| {
            a == b
                || ancestors(self.net, a).any(|above| above == b)
                || ancestors(self.net, b).any(|above| above == a)
        };
        phase_a != phase_b
            || self.net.settings.policy.is_statechart()
                && a.zip(b).is_some_and(|(a, b)| is_nested(a, b))
    }

    /// `raise e`: the event joins `next`; in a statechart, the internal queue.
    pub(crate) fn raise(&mut self, event: InputId) {
        match self.tables.layout.raised(event) {
            Some(place) => self.state.cells[place] = 1,
            None => self.join_internal(event),
        }
    }

    fn send(&mut self, slot: SendId) {
        let data = &self.net.sends[slot];
        let place = self.tables.layout.at(Cell::Slot(slot));
        if data.delay == 0 {
            self.join_external(data.event);
            return;
        }
        if self.state.cells[place] != 0 {
            self.notes.add(Noticed::Resent(slot));
        }
        self.state.cells[place] = i64::from(data.delay);
    }

    /// Makes a call at once; an argument is clamped like an assignment to its parameter (semantics §6).
    pub(crate) fn call(&mut self, output: OutputId, arguments: &[Expr]) {
        let Driver::Extern { params, .. } = &self.net.outputs[output].driver else { return };
        let mut values = Vec::with_capacity(arguments.len());
        for (place, argument) in arguments.iter().enumerate() {
            self.mention(argument);
            let exact = self.eval(argument);
            let passed = params.get(place).map_or(Type::Bool, |param| param.ty).saturate(exact);
            if passed != exact {
                self.notes.add(Noticed::ArgumentSaturated(output, argument.span));
            }
            values.push(passed);
        }
        self.row.effects.push(Effect::Call(output, values));
    }
}

/// True for `v + 1` and `v - 1`: the form in which lowering changes the number of a counted step.
fn changes_by_one(var: VarId, value: &Expr) -> bool {
    let ExprKind::Arith(ArithOp::Add | ArithOp::Sub, old, one) = &value.kind else { return false };
    old.kind == ExprKind::Leaf(Leaf::Var(var)) && one.kind == ExprKind::Int(1)
}
