//! Statements: the cost of each way out of a statement, and its form for path exploration.

use super::super::NotUnderstood;
use super::super::TaskBound;
use super::super::machine::Op;
use super::super::memory::size;
use super::super::paths::code::{self, Price, What};
use super::super::tree::{Expr, Kind, Stmt, Type};
use super::{BREAK, CONTINUE, Cost, Flow, Info, Local, NEXT, RETURN, Walker, compile};
use std::rc::Rc;

impl Walker<'_> {
    pub(super) fn list(&mut self, list: &[Stmt]) -> Result<(Flow, Vec<code::Op>), NotUnderstood> {
        let (depth, first_cell) = (self.locals.len(), self.n_cells);
        let mut flow = Flow::only(NEXT, Cost::default());
        let mut ops = Vec::with_capacity(list.len());
        for stmt in list {
            let one = self.stmt(stmt)?;
            let op = self.taken(stmt);
            ops.push(op);
            // Unreachable statements are walked for their code size and take no time.
            if let Some(before) = flow.on[NEXT].take() {
                flow.join(one, before);
            }
        }
        self.locals.truncate(depth);
        ops.extend(self.forget(list.last().map_or(0, |it| it.line), first_cell));
        Ok((flow, ops))
    }

    /// The cost of everything that `work` walks, and the functions that it calls; nothing from before is included.
    pub(super) fn measured(
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
                self.declared(stmt, (name, ty, *rom), init.as_ref(), &mut info)?
            }
            Kind::If(arms, otherwise) => self.branch(stmt, arms, otherwise, &mut info)?,
            Kind::Switch(subject, sections) => self.switch(stmt, subject, sections, &mut info)?,
            Kind::Loop { init, condition, step, body } => {
                let around = (init.as_deref(), condition.as_ref(), step.as_ref());
                self.repeat(stmt, around, body, &mut info)?
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
                code::Op { line: stmt.line, what: What::Lost("user code".to_owned()) }
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

    /// Walks the declaration of a local with its initial value.
    fn declared(
        &mut self,
        stmt: &Stmt,
        (name, ty, rom): (&Rc<str>, &Type, bool),
        init: Option<&Expr>,
        info: &mut Info,
    ) -> Result<code::Op, NotUnderstood> {
        let machine = self.machine;
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
        let start = init.and_then(|init| self.unit.value(init));
        let cell = self.place_for(ty);
        let op = self.op(stmt.line, |it| it.local_op(cell, ty, init, info.own));
        self.locals.push((name.clone(), Local { ty: ty.clone(), rom, start, cell }));
        Ok(op)
    }

    /// A chain of `if` and `else`.
    fn branch(
        &mut self,
        stmt: &Stmt,
        arms: &[(Expr, Vec<Stmt>)],
        otherwise: &[Stmt],
        info: &mut Info,
    ) -> Result<code::Op, NotUnderstood> {
        let machine = self.machine;
        let mut before = Cost::default();
        let mut ways = Vec::new();
        let last = arms.len();
        for (at, (condition, body)) in arms.iter().enumerate() {
            self.line = stmt.line;
            let (cost, calls) = self.measured(|it| it.condition(condition))?;
            before = before.plus(cost);
            // The last branch falls through to the next statement.
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
        Ok(self.op(stmt.line, |it| match compile::all_asked(ways) {
            Some(ways) => What::If(ways, otherwise),
            None => it.lost_op("a condition"),
        }))
    }

    fn switch(
        &mut self,
        stmt: &Stmt,
        subject: &Expr,
        sections: &[(Vec<Option<i128>>, Vec<Stmt>)],
        info: &mut Info,
    ) -> Result<code::Op, NotUnderstood> {
        let machine = self.machine;
        let labels = sections.iter().flat_map(|(labels, _)| labels);
        let n = labels.flatten().count() as u64;
        (info.own, info.calls) = self.measured(|it| {
            it.value(subject)?;
            let values = || sections.iter().flat_map(|(labels, _)| labels.iter().flatten());
            let range = values().max().zip(values().min());
            let is_dense = range.is_some_and(|(most, least)| most - least < 3 * i128::from(n));
            let groups = sections.len() as u64;
            let from = u64::from(machine.table_from);
            // Each level of a tree compares for equal and for less.
            let tree = u64::from(u64::BITS - n.leading_zeros());
            let by_tree = n.min(tree * 2) * u64::from(machine.switch_compare.time);
            let by_table = u64::from(machine.switch_table.time);
            it.spend(if is_dense && groups > from {
                by_table
            } else if n < from {
                by_tree
            } else {
                // A compiler may or may not merge labels with the same body, so the larger cost counts.
                by_tree.max(by_table)
            });
            it.text += (n * u64::from(machine.switch_compare.text))
                .min(u64::from(machine.switch_table.text) + 2 * n);
            Ok(())
        })?;
        let has_default = sections.iter().any(|(labels, _)| labels.contains(&None));
        // From the last section backwards: a section without `break` continues in the next.
        let mut suffix = Flow::only(NEXT, Cost::default());
        let mut all = Flow::NONE;
        let mut flows = Vec::new();
        let mut runs = Vec::new();
        for (labels, body) in sections {
            let (flow, body) = self.list(body)?;
            flows.push(flow);
            let values = labels.iter().map(|it| it.and_then(|it| i64::try_from(it).ok()));
            runs.push((values.collect(), body));
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
        Ok(self.op(stmt.line, |it| What::Switch {
            price: compile::own(info.own),
            subject: it.code(subject),
            sections: runs,
            jump: Price { time: u64::from(machine.jump.time), user: 0 },
        }))
    }

    /// A loop: initialisation, condition, step and body.
    fn repeat(
        &mut self,
        stmt: &Stmt,
        (init, condition, step): (Option<&Stmt>, Option<&Expr>, Option<&Expr>),
        body: &[Stmt],
        info: &mut Info,
    ) -> Result<code::Op, NotUnderstood> {
        let machine = self.machine;
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
        let Some((rounds, is_proved)) = self.rounds(stmt, condition, body) else {
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
        // A counter that only the loop reads is not tracked, because the number of rounds determines it.
        let free = compile::without_counter(stmt, condition, body);
        let question = free.unwrap_or(condition).map(|it| self.op_of_question(stmt.line, it));
        let (price, is_free) = (compile::own(asked.0), free.is_some());
        let counted = step.map(|step| self.op(stmt.line, |it| it.effect_op(step, stepped.0)));
        let jump = Cost::of(u64::from(machine.jump.time));
        self.text += u64::from(machine.jump.text);
        let (flow, ops) = self.list(body)?;
        info.flow = flow.repeated(rounds, first, asked.0, stepped.0.plus(jump), jump);
        info.own = first;
        info.rounds = rounds;
        info.arms = vec![(asked.0, asked.1), (stepped.0.plus(jump), stepped.1)];
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
                (true, [only]) => (vec![compile::paid(only)], counted.map(|it| compile::paid(&it))),
                _ => (begin, counted),
            };
            // The condition without the counter is still evaluated: before each round, and once at the end.
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
        Ok(match gone {
            Some(gone) => code::Op { line: stmt.line, what: What::Block(vec![whole, gone]) },
            None => whole,
        })
    }

    /// The maximum number of rounds of a loop. It comes from the emitter, or from a conjunct `counter < constant` of a counter that begins with a constant and
    /// is incremented in every round. The flag is true if the text alone does not end the loop there.
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
