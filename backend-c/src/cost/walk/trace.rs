//! Follows the worst-case path again, to report its locations.

use super::super::tree::{Kind, Stmt};
use super::{BREAK, CONTINUE, Cost, Flow, Info, NEXT, RETURN, Walker};
use crate::Object;

/// A location on the worst-case path.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The line of `NAME.c`.
    pub line: u32,
    /// The objects of the net that it comes from: those of the line, or of the nearest enclosing piece.
    pub objects: Vec<Object>,
    /// How often it is executed.
    pub times: u64,
    /// The total time of all its executions, without its callees.
    pub time: u64,
}

/// Follows the worst-case path again.
pub(super) struct Tracer<'a> {
    pub(super) walker: &'a Walker<'a>,
    pub(super) map: &'a [(u32, Vec<Object>)],
    pub(super) path: Vec<Place>,
}

impl Tracer<'_> {
    /// Adds the path that a run has taken: lines with their time. A line that does not come from the net belongs to the nearest line above that
    /// does.
    pub(super) fn gone(&mut self, path: &[(u32, u64)]) {
        for (line, time) in path {
            let objects = match self.map.binary_search_by_key(line, |(line, _)| *line) {
                Ok(at) => self.map.get(at),
                Err(at) => at.checked_sub(1).and_then(|at| self.map.get(at)),
            };
            // More distant lines belong to the frame of the function.
            let objects = objects.filter(|(from, _)| line - from <= 2);
            let objects = objects.map(|(_, objects)| objects.clone()).unwrap_or_default();
            self.add(*line, &objects, 1, *time);
        }
    }

    fn objects(&self, line: u32, around: &[Object]) -> Vec<Object> {
        match self.map.binary_search_by_key(&line, |(line, _)| *line) {
            Ok(at) => self.map.get(at).map(|(_, objects)| objects.clone()).unwrap_or_default(),
            Err(_) => around.to_vec(),
        }
    }

    pub(super) fn function(&mut self, index: usize, times: u64, around: &[Object]) {
        let Some(summary) = self.walker.summaries.get(index) else { return };
        let function = self
            .walker
            .unit
            .functions
            .iter()
            .find(|it| self.walker.by_name.get(&it.name) == Some(&index));
        let Some(function) = function else { return };
        let line = function.body.first().map_or(0, |it| it.line.saturating_sub(1));
        self.add(line, around, times, summary.entry);
        let flow = self.flow(&function.body);
        let way = match (flow.on[NEXT], flow.on[RETURN]) {
            (Some(a), Some(b)) if b.time > a.time => RETURN,
            (None, _) => RETURN,
            (Some(_), _) => NEXT,
        };
        self.list(&function.body, way, times, around);
    }

    fn add(&mut self, line: u32, objects: &[Object], times: u64, time: u64) {
        let time = time.saturating_mul(times);
        if time == 0 {
            return;
        }
        if let Some(last) = self.path.last_mut()
            && last.line == line
            && last.objects == objects
        {
            last.time = last.time.saturating_add(time);
            return;
        }
        self.path.push(Place { line, objects: objects.to_vec(), times, time });
    }

    fn info(&self, stmt: &Stmt) -> Option<&Info> {
        self.walker.infos.get(stmt.id).and_then(Option::as_ref)
    }

    fn flow(&self, list: &[Stmt]) -> Flow {
        let mut flow = Flow::only(NEXT, Cost::default());
        for stmt in list {
            let one = self.info(stmt).map_or(Flow::NONE, |it| it.flow);
            match flow.on[NEXT].take() {
                Some(before) => flow.join(one, before),
                None => break,
            }
        }
        flow
    }

    /// Follows the expressions of a statement: adds its own time, then its callees.
    fn own(&mut self, line: u32, cost: Cost, calls: &[usize], times: u64, around: &[Object]) {
        let called: u64 = calls
            .iter()
            .filter_map(|index| self.walker.summaries.get(*index))
            .map(|it| it.cost.time)
            .sum();
        self.add(line, around, times, cost.time.saturating_sub(called));
        for index in calls {
            self.function(*index, times, around);
        }
    }

    fn list(&mut self, list: &[Stmt], way: usize, times: u64, around: &[Object]) {
        // The statement that leaves the list: the one with the largest sum including everything before it.
        let mut sum = 0_u64;
        let mut best: Option<(u64, usize)> = None;
        let mut end = list.len();
        for (at, stmt) in list.iter().enumerate() {
            let Some(info) = self.info(stmt) else { break };
            if way != NEXT
                && let Some(out) = info.flow.on[way]
            {
                let total = sum.saturating_add(out.time);
                if best.is_none_or(|(dearest, _)| total > dearest) {
                    best = Some((total, at));
                }
            }
            match info.flow.on[NEXT] {
                Some(next) => sum = sum.saturating_add(next.time),
                None => {
                    end = at + 1;
                    break;
                }
            }
        }
        let last = match best {
            Some((_, at)) => at,
            None => end,
        };
        for (at, stmt) in list.iter().enumerate().take(last + 1) {
            self.stmt(stmt, if at == last { way } else { NEXT }, times, around);
        }
    }

    fn stmt(&mut self, stmt: &Stmt, way: usize, times: u64, around: &[Object]) {
        let Some(info) = self.info(stmt).cloned() else { return };
        let around = self.objects(stmt.line, around);
        let time_of = |flow: Flow, way: usize| flow.on[way].map(|it| it.time);
        match &stmt.kind {
            Kind::Expr(_) | Kind::Local { .. } | Kind::Return(_) => {
                self.own(stmt.line, info.own, &info.calls, times, &around);
            }
            Kind::Break | Kind::Continue | Kind::UserCode => {}
            Kind::Block(body) => self.list(body, way, times, &around),
            Kind::If(arms, otherwise) => {
                let mut before = 0_u64;
                let mut best: Option<(u64, usize)> = None;
                let bodies: Vec<&[Stmt]> = arms
                    .iter()
                    .map(|(_, body)| body.as_slice())
                    .chain([otherwise.as_slice()])
                    .collect();
                let jump = u64::from(self.walker.machine.jump.time);
                // A branch that continues jumps over the branches after it.
                let last = bodies.len() - usize::from(otherwise.is_empty());
                let jump_of = |at: usize| if way == NEXT && at + 1 < last { jump } else { 0 };
                for (at, body) in bodies.iter().enumerate() {
                    before += info.arms.get(at).map_or(0, |(cost, _)| cost.time);
                    if let Some(time) = time_of(self.flow(body), way) {
                        let time = before + time + jump_of(at);
                        if best.is_none_or(|(dearest, _)| time > dearest) {
                            best = Some((time, at));
                        }
                    }
                }
                let Some((_, taken)) = best else { return };
                for (cost, calls) in info.arms.iter().take(taken + 1) {
                    self.own(stmt.line, *cost, calls, times, &around);
                }
                self.add(stmt.line, &around, times, jump_of(taken));
                if let Some(body) = bodies.get(taken) {
                    // A branch is not a statement; its first line is the line of its head, or the next one.
                    let inner = match body.first() {
                        Some(first) => self.objects(first.line.saturating_sub(1), &around),
                        None => around.clone(),
                    };
                    self.list(body, way, times, &inner);
                }
            }
            Kind::Switch(_, sections) => {
                self.own(stmt.line, info.own, &info.calls, times, &around);
                let mut best: Option<(u64, usize, usize)> = None;
                for (at, (_, body)) in sections.iter().enumerate() {
                    let flow = self.flow(body);
                    let ways: &[usize] = if way == NEXT { &[NEXT, BREAK] } else { &[way] };
                    for out in ways {
                        let jump = u64::from(self.walker.machine.jump.time);
                        let jump = if *out == BREAK { jump } else { 0 };
                        if let Some(time) = time_of(flow, *out).map(|it| it + jump)
                            && best.is_none_or(|(dearest, ..)| time > dearest)
                        {
                            best = Some((time, at, *out));
                        }
                    }
                }
                if let Some((_, at, out)) = best
                    && let Some((_, body)) = sections.get(at)
                {
                    if out == BREAK {
                        let jump = u64::from(self.walker.machine.jump.time);
                        self.add(stmt.line, &around, times, jump);
                    }
                    let inner = match body.first() {
                        Some(first) => self.objects(first.line.saturating_sub(1), &around),
                        None => around,
                    };
                    self.list(body, out, times, &inner);
                }
            }
            Kind::Loop { init, body, .. } => {
                if let Some(init) = init {
                    self.stmt(init, NEXT, times, &around);
                }
                let flow = self.flow(body);
                let rounds = info.rounds;
                let on = match (time_of(flow, NEXT), time_of(flow, CONTINUE)) {
                    (Some(a), Some(b)) if b > a => CONTINUE,
                    (None, _) => CONTINUE,
                    (Some(_), _) => NEXT,
                };
                let heads: u64 = info.arms.iter().map(|(cost, _)| cost.time).sum();
                let round = time_of(flow, on).map_or(0, |it| it.saturating_add(heads));
                let jump = u64::from(self.walker.machine.jump.time);
                // Either all rounds, or one round fewer, followed by the exit from the body.
                let out = if way == NEXT { BREAK } else { way };
                let leaves = time_of(flow, out)
                    .filter(|last| way != NEXT || last.saturating_add(jump) > round);
                let whole = if leaves.is_some() { rounds.saturating_sub(1) } else { rounds };
                let all = times.saturating_mul(whole);
                for (at, (cost, calls)) in info.arms.iter().enumerate() {
                    let asked = if at == 0 { all.saturating_add(times) } else { all };
                    self.own(stmt.line, *cost, calls, asked, &around);
                }
                if time_of(flow, on).is_some() && whole > 0 {
                    self.list(body, on, all, &around);
                }
                if leaves.is_some() && rounds > 0 {
                    self.add(stmt.line, &around, times, jump);
                    self.list(body, out, times, &around);
                }
            }
        }
    }
}
