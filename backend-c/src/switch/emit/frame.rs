//! What surrounds the evolution: free timers and the timers of actions before it, controlled actions and free timers after it.
//!
//! These statements come from the reaction program ([`grafsynth_ir::lower::program::frame`]) and are printed by the printer of the style `bits`; the
//! steps' bits and times are read from the state variables.

use super::Emit;
use crate::bits::outline::{Home, cut, homes};
use crate::bits::{Emit as Statements, NODES_PER_TRANSITION};
use crate::c::print::Node;
use crate::cexpr::CExpr;
use crate::times::timer_place;
use grafsynth_ir::IdMap;
use grafsynth_ir::lower::program::Frame;
use grafsynth_ir::names::Namer;
use grafsynth_ir::net::{ActionId, Net, OutputId, TimerId};
use grafsynth_ir::program::{CellId, Leaf, Origin, Program, Stmt, Temp};
use std::collections::BTreeMap;

/// The frame of a reaction, with everything in one list for the analyses.
pub(crate) struct Surroundings {
    frame: Frame,
    /// The frame's program. Its body is `before`, `after` and the outputs.
    program: Program,
}

impl Surroundings {
    pub(crate) fn of(frame: Frame, net: &Net) -> Self {
        let mut program = frame.program.clone();
        program.body = [frame.before.as_slice(), frame.after.as_slice()].concat();
        let shown = frame.outputs.iter().filter(|(id, _)| !net.outputs[*id].is_extern());
        program.body.extend(shown.map(|(id, value)| Stmt::Output(*id, value.clone())));
        Surroundings { frame, program }
    }
}

/// The printed frame.
pub(super) struct Framed<'a> {
    surroundings: &'a Surroundings,
    pub(super) statements: Statements<'a>,
    /// Locals at the start of the reaction.
    pub(super) locals: Vec<Node>,
    pub(super) before: Vec<Node>,
    pub(super) after: Vec<Node>,
    pub(super) functions: Vec<Node>,
    /// Members of the structure that functions share.
    pub(super) shared: Vec<Node>,
    /// The values of the outputs that actions drive, after `after`.
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
        let leaf = grafsynth_ir::program::Expr::leaf(Leaf::Cell(cell), Default::default());
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
        let (before, rest) = program.body.split_at(frame.before.len());
        let (after, outputs) = rest.split_at(frame.after.len());
        let mut bodies = Vec::new();
        let mut main = cut(before, limit, &mut bodies);
        let n_before = main.len();
        main.extend(cut(after, limit, &mut bodies));
        let n_after = main.len();
        main.extend(outputs.iter().map(crate::bits::outline::Piece::Whole));
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
}
