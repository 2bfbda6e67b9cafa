//! The statements around the evolution: free timers and the timers of actions before it, controlled actions and free timers after it.
//!
//! These statements come from the reaction program ([`grafsynth_ir::lower::program::frame`]) and are printed by the printer of the style `bits`; the
//! steps' bits and times are read from the state variables.

use super::Emit;
use crate::bits::outline::{Case, Home, Piece, cut, homes, weight};
use crate::bits::{Emit as Statements, NODES_PER_TRANSITION};
use crate::c::print::Node;
use crate::cexpr::CExpr;
use crate::times::timer_place;
use grafsynth_ir::IdMap;
use grafsynth_ir::lower::program::Frame;
use grafsynth_ir::names::Namer;
use grafsynth_ir::net::{ActionId, Net, OutputId, StepId, TimerId};
use grafsynth_ir::program::{CellId, Expr, Leaf, Origin, Program, Stmt, Temp};
use std::collections::BTreeMap;
use std::ops::Range;

/// The frame of a reaction, with everything in one list for the analyses.
pub(crate) struct Surroundings {
    frame: Frame,
    /// The frame's program. Its body contains everything in order.
    program: Program,
    /// The range of each action's body in the body of `program`.
    bodies: Vec<Range<usize>>,
    /// The ranges of the statements of [`Frame`] with these names in the body of `program`.
    before: Range<usize>,
    control: Range<usize>,
    end: Range<usize>,
    outputs: Range<usize>,
}

impl Surroundings {
    pub(crate) fn of(frame: Frame, net: &Net) -> Self {
        let mut program = frame.program.clone();
        let all = &mut program.body;
        let mut add = |list: &[Stmt]| {
            let start = all.len();
            all.extend(list.iter().cloned());
            start..all.len()
        };
        let before = add(&frame.before);
        let control = add(&frame.control);
        let mut bodies = Vec::new();
        for body in &frame.bodies {
            bodies.push(match &body.steps {
                None => add(&body.list),
                Some(steps) => {
                    let bit = |step: &StepId| {
                        Expr::leaf(Leaf::Cell(frame.bits[*step]), Default::default())
                    };
                    let any = Expr::or(steps.iter().map(bit));
                    add(&[Stmt::If(any, body.list.clone(), Vec::new())])
                }
            });
        }
        let end = add(&frame.end);
        let shown = frame.outputs.iter().filter(|(id, _)| !net.outputs[*id].is_extern());
        let shown: Vec<Stmt> = shown.map(|(id, value)| Stmt::Output(*id, value.clone())).collect();
        let outputs = add(&shown);
        Surroundings { frame, program, bodies, before, control, end, outputs }
    }
}

/// Consecutive bodies that run in steps of one state variable. At most one of these steps is active, so one `switch` selects the bodies of the active step.
struct Group {
    machine: usize,
    /// The classes: sets of steps that share no step, each with the bodies that run in these steps.
    classes: Vec<(Vec<StepId>, Vec<usize>)>,
    class_of: BTreeMap<StepId, usize>,
}

impl Group {
    /// The minimum number of classes for a `switch`; smaller groups are printed as tests.
    const MIN_CLASSES: usize = 3;

    fn new(machine: usize) -> Self {
        Group { machine, classes: Vec::new(), class_of: BTreeMap::new() }
    }

    /// Adds a body; false if its steps overlap a class but are not the same steps.
    fn add(&mut self, body: usize, steps: &[StepId]) -> bool {
        let known: Vec<Option<usize>> =
            steps.iter().map(|step| self.class_of.get(step).copied()).collect();
        match known.first() {
            Some(Some(class))
                if known.iter().all(|it| *it == Some(*class))
                    && self.classes[*class].0.len() == steps.len() =>
            {
                self.classes[*class].1.push(body);
                true
            }
            Some(None) if known.iter().all(Option::is_none) => {
                self.class_of.extend(steps.iter().map(|step| (*step, self.classes.len())));
                self.classes.push((steps.to_vec(), vec![body]));
                true
            }
            Some(_) | None => false,
        }
    }
}

/// The printed frame.
pub(super) struct Framed<'a> {
    surroundings: &'a Surroundings,
    pub(super) statements: Statements<'a>,
    /// Locals of the reaction.
    pub(super) locals: Vec<Node>,
    pub(super) before: Vec<Node>,
    pub(super) after: Vec<Node>,
    pub(super) functions: Vec<Node>,
    /// Members of the structure that functions share.
    pub(super) shared: Vec<Node>,
    /// The values that the outputs driven by actions have after the statements in `after`.
    pub(super) outputs: BTreeMap<OutputId, CExpr>,
}

impl<'a> Framed<'a> {
    /// An unprinted frame; `members` contains the names of the instance's members.
    pub(super) fn new(emit: &Emit<'a>, surroundings: &'a Surroundings, members: Namer) -> Self {
        let homes: IdMap<Temp, Home> = IdMap::filled(&surroundings.program.temps, Home::Nowhere);
        Framed {
            surroundings,
            statements: Statements::new(
                emit.net,
                emit.names,
                &surroundings.program,
                homes,
                members,
                &emit.local_names(),
            ),
            locals: Vec::new(),
            before: Vec::new(),
            after: Vec::new(),
            functions: Vec::new(),
            shared: Vec::new(),
            outputs: BTreeMap::new(),
        }
    }

    /// The counter of a free timer.
    pub(super) fn timer(&mut self, timer: TimerId) -> Option<CExpr> {
        let cell = self.surroundings.frame.timers[timer]?;
        Some(self.read(cell))
    }

    /// Q of an action in the last reaction or, after the controlled actions, in this one.
    pub(super) fn action(&mut self, action: ActionId) -> Option<CExpr> {
        let cell = self.surroundings.frame.actions[action]?;
        Some(self.read(cell))
    }

    fn read(&mut self, cell: CellId) -> CExpr {
        let leaf = Expr::leaf(Leaf::Cell(cell), Default::default());
        self.statements.expr(&leaf)
    }

    /// The values of each variable after reset.
    pub(super) fn variables_after_reset(&self) -> Vec<Vec<i64>> {
        let cells = self.surroundings.program.cells.values();
        cells
            .filter(|cell| matches!(cell.origin, Origin::Var(_)))
            .map(|cell| cell.init.clone())
            .collect()
    }
}

impl<'a> Emit<'a> {
    /// Prints the frame. Runs first, because everything else may read its cells.
    pub(super) fn print_frame(&mut self) {
        let Some(mut framed) = self.framed.take() else { return };
        let surroundings = framed.surroundings;
        let (frame, program) = (&surroundings.frame, &surroundings.program);
        for (step, cell) in frame.bits.iter() {
            framed.statements.elsewhere.insert(*cell, self.stored_active(step));
            if let Some(time) = frame.elapsed[step] {
                let (machine, _) = self.plan.place[step];
                let cap = self.plan.machines[machine].timer_cap.unwrap_or(0);
                let place = timer_place(&format!("self->{}", self.timers[machine]), cap);
                let value = CExpr::select(self.stored_active(step), place, CExpr::int(0));
                framed.statements.elsewhere.insert(time, value);
            }
        }
        for (id, cell) in program.cells.iter() {
            if let Origin::Var(var) = cell.origin {
                let place = CExpr::place(format!("self->{}", self.names.vars[var]), cell.ty);
                framed.statements.elsewhere.insert(id, place);
            }
        }
        let limit = self.options.max_transitions.saturating_mul(NODES_PER_TRANSITION).max(1);
        let part = |range: &Range<usize>| &program.body[range.clone()];
        let mut bodies = Vec::new();
        let mut main = cut(part(&surroundings.before), limit, &mut bodies);
        let n_before = main.len();
        main.extend(cut(part(&surroundings.control), limit, &mut bodies));
        main.extend(self.action_bodies(surroundings, limit, &mut bodies));
        main.extend(cut(part(&surroundings.end), limit, &mut bodies));
        let n_after = main.len();
        let outputs = part(&surroundings.outputs);
        main.extend(outputs.iter().map(Piece::Whole));
        let statements = &mut framed.statements;
        statements.set_homes(homes(program, &main, &bodies));
        statements.is_split = !bodies.is_empty();
        statements.ticks = self.ticks;
        let (functions, calls) = statements.parts(&bodies, 0);
        framed.functions = functions;
        framed.shared = statements.shared_members();
        framed.locals = statements.locals();
        framed.before = statements.pieces(&main[..n_before], &calls);
        framed.after = statements.pieces(&main[n_before..n_after], &calls);
        for statement in outputs {
            if let Stmt::Output(id, value) = statement {
                let value = statements.expr(value);
                framed.outputs.insert(*id, value);
            }
        }
        self.framed = Some(framed);
    }

    /// The bodies of the actions, in order. Bodies in different steps of one state variable are found by a `switch`.
    fn action_bodies(
        &self,
        surroundings: &'a Surroundings,
        limit: usize,
        bodies: &mut Vec<Vec<Piece<'a>>>,
    ) -> Vec<Piece<'a>> {
        let mut pieces = Vec::new();
        // Consecutive bodies that are in no group.
        let mut plain: Range<usize> = surroundings.control.end..surroundings.control.end;
        let mut group: Option<Group> = None;
        for (index, body) in surroundings.frame.bodies.iter().enumerate() {
            let range = surroundings.bodies[index].clone();
            let steps = body.steps.as_deref().unwrap_or_default();
            let machine = steps.first().map(|step| self.plan.place[*step].0);
            let is_one = steps.iter().all(|step| Some(self.plan.place[*step].0) == machine);
            if let (Some(machine), true) = (machine, is_one) {
                let joins =
                    group.as_mut().is_some_and(|it| it.machine == machine && it.add(index, steps));
                if !joins {
                    self.close(group.take(), surroundings, &mut plain, limit, bodies, &mut pieces);
                    let mut next = Group::new(machine);
                    next.add(index, steps);
                    group = Some(next);
                }
                continue;
            }
            self.close(group.take(), surroundings, &mut plain, limit, bodies, &mut pieces);
            plain.end = range.end;
        }
        self.close(group.take(), surroundings, &mut plain, limit, bodies, &mut pieces);
        pieces.extend(cut(&surroundings.program.body[plain], limit, bodies));
        pieces
    }

    /// Adds the bodies before a complete group, then the group; a group that is too small for a `switch` is added to those bodies.
    fn close(
        &self,
        group: Option<Group>,
        surroundings: &'a Surroundings,
        plain: &mut Range<usize>,
        limit: usize,
        bodies: &mut Vec<Vec<Piece<'a>>>,
        pieces: &mut Vec<Piece<'a>>,
    ) {
        let Some(group) = group else { return };
        let members = || group.classes.iter().flat_map(|(_, members)| members);
        let end = members().map(|index| surroundings.bodies[*index].end).max().unwrap_or(plain.end);
        if group.classes.len() < Group::MIN_CLASSES {
            plain.end = end;
            return;
        }
        pieces.extend(cut(&surroundings.program.body[plain.clone()], limit, bodies));
        *plain = end..end;
        let number = format!("self->{}", self.vars[group.machine]);
        let mut cases: Vec<Case<'a>> = Vec::new();
        let mut all: Vec<Vec<Case<'a>>> = Vec::new();
        let mut total = 0;
        for (steps, members) in &group.classes {
            let lists = || members.iter().flat_map(|index| &surroundings.frame.bodies[*index].list);
            let own = 1 + lists().map(weight).sum::<usize>();
            if total > 0 && total + own > limit {
                all.push(std::mem::take(&mut cases));
                total = 0;
            }
            total += own;
            cases.push(Case {
                steps: steps.iter().map(|step| (*step, self.step_code(*step))).collect(),
                body: lists().map(Piece::Whole).collect(),
            });
        }
        all.push(cases);
        let is_split = all.len() > 1;
        for cases in all {
            let choice = Piece::Switch(number.clone(), cases);
            if is_split {
                bodies.push(vec![choice]);
                pieces.push(Piece::Function(bodies.len() - 1));
            } else {
                pieces.push(choice);
            }
        }
    }
}
