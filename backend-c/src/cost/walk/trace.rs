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
        match &stmt.kind {
            Kind::Expr(_) | Kind::Local { .. } | Kind::Return(_) => {
                self.own(stmt.line, info.own, &info.calls, times, &around);
            }
            Kind::Break | Kind::Continue | Kind::UserCode => {}
            Kind::Block(body) => self.list(body, way, times, &around),
            Kind::If(arms, otherwise) => {
                let bodies = arms.iter().map(|(_, body)| body.as_slice());
                let bodies: Vec<&[Stmt]> = bodies.chain([otherwise.as_slice()]).collect();
                self.branch(stmt.line, &info, &bodies, (way, times), &around);
            }
            Kind::Switch(_, sections) => {
                self.own(stmt.line, info.own, &info.calls, times, &around);
                self.section(stmt.line, sections, (way, times), &around);
            }
            Kind::Loop { init, body, .. } => {
                if let Some(init) = init {
                    self.stmt(init, NEXT, times, &around);
                }
                self.repeat(stmt.line, &info, body, (way, times), &around);
            }
        }
    }

    /// The time of a jump.
    fn jump(&self) -> u64 {
        u64::from(self.walker.machine.jump.time)
    }

    /// The most expensive branch with this way out, after the conditions up to it. The last body is `else`, which may be empty.
    fn branch(
        &mut self,
        line: u32,
        info: &Info,
        bodies: &[&[Stmt]],
        (way, times): (usize, u64),
        around: &[Object],
    ) {
        let jump = self.jump();
        // A branch that continues jumps over the branches after it.
        let last = bodies.len() - usize::from(bodies.last().is_some_and(|body| body.is_empty()));
        let jump_of = |at: usize| if way == NEXT && at + 1 < last { jump } else { 0 };
        let mut before = 0_u64;
        let mut ends = Vec::new();
        for (at, body) in bodies.iter().enumerate() {
            before += info.arms.get(at).map_or(0, |(cost, _)| cost.time);
            let out = self.flow(body).on[way];
            ends.extend(out.map(|out| (before + out.time + jump_of(at), at)));
        }
        let Some(taken) = dearest(ends) else { return };
        for (cost, calls) in info.arms.iter().take(taken + 1) {
            self.own(line, *cost, calls, times, around);
        }
        self.add(line, around, times, jump_of(taken));
        self.inner(bodies[taken], way, times, around);
    }

    /// The most expensive section of a `switch` with this way out.
    fn section<L>(
        &mut self,
        line: u32,
        sections: &[(L, Vec<Stmt>)],
        (way, times): (usize, u64),
        around: &[Object],
    ) {
        let ways: &[usize] = if way == NEXT { &[NEXT, BREAK] } else { &[way] };
        let jump = self.jump();
        let jump_of = |out: usize| if out == BREAK { jump } else { 0 };
        let ends = sections.iter().flat_map(|(_, body)| {
            let flow = self.flow(body);
            let end = move |out: &usize| Some((flow.on[*out]?.time + jump_of(*out), (body, *out)));
            ways.iter().filter_map(end)
        });
        let Some((body, out)) = dearest(ends) else { return };
        self.add(line, around, times, jump_of(out));
        self.inner(body, out, times, around);
    }

    /// The body of a branch. A branch is not a statement; its first line is the line of its head, or the next one.
    fn inner(&mut self, body: &[Stmt], way: usize, times: u64, around: &[Object]) {
        match body.first() {
            Some(first) => {
                let inner = self.objects(first.line.saturating_sub(1), around);
                self.list(body, way, times, &inner);
            }
            None => self.list(body, way, times, around),
        }
    }

    /// All rounds of a loop, or one round fewer, followed by the exit from the body.
    fn repeat(
        &mut self,
        line: u32,
        info: &Info,
        body: &[Stmt],
        (way, times): (usize, u64),
        around: &[Object],
    ) {
        let flow = self.flow(body);
        let time_of = |way: usize| flow.on[way].map(|it| it.time);
        let on = match (time_of(NEXT), time_of(CONTINUE)) {
            (Some(a), Some(b)) if b > a => CONTINUE,
            (None, _) => CONTINUE,
            (Some(_), _) => NEXT,
        };
        let heads: u64 = info.arms.iter().map(|(cost, _)| cost.time).sum();
        let round = time_of(on).map_or(0, |it| it.saturating_add(heads));
        let jump = self.jump();
        let out = if way == NEXT { BREAK } else { way };
        let leaves = time_of(out).filter(|last| way != NEXT || last.saturating_add(jump) > round);
        let whole = if leaves.is_some() { info.rounds.saturating_sub(1) } else { info.rounds };
        let all = times.saturating_mul(whole);
        for (at, (cost, calls)) in info.arms.iter().enumerate() {
            let asked = if at == 0 { all.saturating_add(times) } else { all };
            self.own(line, *cost, calls, asked, around);
        }
        if time_of(on).is_some() && whole > 0 {
            self.list(body, on, all, around);
        }
        if leaves.is_some() && info.rounds > 0 {
            self.add(line, around, times, jump);
            self.list(body, out, times, around);
        }
    }
}

/// The first of the most expensive alternatives.
fn dearest<T>(all: impl IntoIterator<Item = (u64, T)>) -> Option<T> {
    let all = all.into_iter();
    all.reduce(|best, next| if next.0 > best.0 { next } else { best }).map(|(_, it)| it)
}
