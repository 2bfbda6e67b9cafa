//! One register for each region, which also stores the history: rewrites the program so that a state with a history in an enclosing state is coded by its
//! region alone.
//!
//! ```text
//!                  one flip-flop for each state          one register for each region
//! On               On                                    On
//!   Auto, Manual   Auto, Manual                          Auto_r, Manual_r      Auto := On and Auto_r,  Manual := On and Manual_r
//!   history h      h_Auto, h_Manual                      none: the register keeps its value while On is left
//! ```
//! The register of a region is one-hot, with a flip-flop for each child of the state. While the state is active, the flip-flop of a child tells whether
//! the child is active; while it is inactive, the register keeps its value from when the state was last left, which is what a history records. A state is
//! active if its flip-flop is set and its parent is active ([`Origin::Region`]). Before the first activation of the state its register is zero: nothing is
//! recorded, and a history uses its default.
//!
//! A deep history uses all registers below its owner; an atomic state is recorded if every flip-flop on the path up to the owner is set. A region of a parallel
//! state is active if and only if that state is active, so it needs no flip-flop, unless a history records the region itself.
//!
//! The program's own cells become temporaries: they are unpacked from the registers before the reaction and packed after its last micro-step. So the
//! behaviour of the reaction is unchanged.
//!
//! # Exceptions
//! A transition from inside the owner that does not leave the owner may enter the history. It then needs the states recorded when the owner was last left,
//! which the register no longer contains. Such a history has its own flip-flops ([`kept_apart`]).

use super::substitute;
use grafsynth_ir::Gather;
use grafsynth_ir::Span;
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::net::{Enter, History, HistoryId, Net, Step, StepId, StepKind};
use grafsynth_ir::program::{
    Cell, CellId, Expr, Leaf, Origin, Program, Stmt, Temp, TempId, TempRole,
};
use std::collections::{BTreeMap, BTreeSet};

/// A program over registers of regions.
pub(super) struct Regions {
    pub(super) program: Program,
    /// The top-level statement, counted from 1, after which the registers contain the final values of the reaction.
    pub(super) packed_at: usize,
    /// The states that are coded by a region, parents first.
    pub(super) gated: Vec<Gated>,
}

/// A state whose activity is not stored in one flip-flop.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gated {
    /// True if the state is active, within the reaction.
    pub(super) active: TempId,
    /// The state's flip-flop in the register of its region; `None` for a region of a parallel state, which is active if the parallel state is active.
    pub(super) register: Option<CellId>,
    /// The activity of the parent: the parent's own cell, or the temporary that replaces it.
    pub(super) parent: Leaf,
}

/// Histories with their own flip-flops, in declaration order, each with the reason why the register of the region is not sufficient; a clause for a
/// report.
#[must_use]
pub fn kept_apart(net: &Net) -> Vec<(HistoryId, &'static str)> {
    let apart = whys(net);
    apart.iter().filter_map(|(id, why)| Some((id, (*why)?))).collect()
}

/// The reason why each history is not stored in the registers of regions; `None` for a history that is stored there.
fn whys(net: &Net) -> IdMap<History, Option<&'static str>> {
    let mut apart = IdMap::build(&net.histories, |_, history| {
        let recorded: BTreeSet<StepId> = history.cases.iter().map(|case| case.step).gather();
        let is_whole =
            recorded == shallow(net, history.owner) || recorded == deep(net, history.owner);
        (!is_whole)
            .then_some("it records neither all children of its state nor all atomic states in it")
    });
    for transition in net.transitions.values() {
        let entered = histories_of(net, &transition.enters);
        if entered.is_empty() {
            continue;
        }
        let cleared: BTreeSet<StepId> = transition.clears.iter().copied().gather();
        for id in entered.into_iter().filter(|id| !cleared.contains(&net.histories[*id].owner)) {
            apart[id] = Some("a transition enters it without leaving its state");
        }
    }
    apart
}

/// The histories that a list of entries may enter, directly or through other histories.
fn histories_of(net: &Net, enters: &[Enter]) -> BTreeSet<HistoryId> {
    let mut found = BTreeSet::new();
    let mut lists = vec![enters];
    while let Some(list) = lists.pop() {
        for enter in list {
            if let Enter::History(id) = enter
                && found.insert(*id)
            {
                let history = &net.histories[*id];
                lists.push(&history.default);
                lists.extend(history.cases.iter().map(|case| case.enters.as_slice()));
            }
        }
    }
    found
}

fn shallow(net: &Net, owner: StepId) -> BTreeSet<StepId> {
    net.steps.iter().filter(|(_, step)| step.parent == Some(owner)).map(|(id, _)| id).gather()
}

/// The atomic states inside a state.
fn deep(net: &Net, owner: StepId) -> BTreeSet<StepId> {
    let is_atomic = |kind: StepKind| matches!(kind, StepKind::Leaf | StepKind::Final);
    net.steps
        .iter()
        .filter(|(_, step)| is_atomic(step.kind))
        .filter(|(id, _)| way_up(net, *id, owner).is_some())
        .map(|(id, _)| id)
        .gather()
}

/// The states from `step` up to the child of `owner`; `None` if the step is not inside `owner`.
fn way_up(net: &Net, step: StepId, owner: StepId) -> Option<Vec<StepId>> {
    let mut way = vec![step];
    loop {
        let last = *way.last()?;
        match net.steps[last].parent {
            Some(parent) if parent == owner => return Some(way),
            // Parents are declared before children, so the path ends.
            Some(parent) => way.push(parent),
            None => return None,
        }
    }
}

/// The program over registers of regions; `None` if no state benefits.
pub(super) fn regions(net: &Net, program: &Program) -> Option<Regions> {
    if !net.settings.policy.is_statechart() {
        return None;
    }
    let apart = whys(net);
    let mut kept = IdMap::build(&net.histories, |id, _| apart[id].is_none());
    let mut cell_of: IdMap<Step, Option<CellId>> = IdMap::filled(&net.steps, None);
    let mut recorded: BTreeMap<(HistoryId, StepId), CellId> = BTreeMap::new();
    for (id, cell) in program.cells.iter() {
        if let Origin::Step(step) = cell.origin {
            cell_of[step] = Some(id);
        } else if let Origin::Recorded(history, step) = cell.origin
            && kept[history]
        {
            recorded.insert((history, step), id);
        }
    }
    // A history that nothing enters records nothing.
    for (id, history) in net.histories.iter() {
        kept[id] &= history.cases.iter().all(|case| recorded.contains_key(&(id, case.step)));
    }
    recorded.retain(|(id, _), _| kept[*id]);
    // For each state, the history that records it: the innermost one.
    let mut memory: IdMap<Step, Option<HistoryId>> = IdMap::filled(&net.steps, None);
    let mut is_case: IdMap<Step, bool> = IdMap::filled(&net.steps, false);
    let mut by_depth: Vec<HistoryId> = net.histories.ids().filter(|id| kept[*id]).collect();
    // Parents are declared before children, so the owner declared last is the innermost.
    by_depth.sort_by_key(|id| net.histories[*id].owner);
    for id in by_depth {
        let history = &net.histories[id];
        for case in &history.cases {
            is_case[case.step] = true;
            way_up(net, case.step, history.owner)?
                .into_iter()
                .for_each(|step| memory[step] = Some(id));
        }
    }
    let of_parallel = |step: StepId| {
        net.steps[step].parent.is_some_and(|parent| net.steps[parent].kind == StepKind::Parallel)
    };
    let mut maker = Maker {
        net,
        program: program.clone(),
        temp_of: BTreeMap::new(),
        gated: IdMap::filled(&net.steps, None),
        leaf: IdMap::build(&net.steps, |step, _| cell_of[step].map(Leaf::Cell)),
    };
    for (step, data) in net.steps.iter() {
        let (Some(cell), Some(parent)) = (cell_of[step], data.parent) else { continue };
        let is_free = of_parallel(step) && !is_case[step];
        if !is_free && memory[step].is_none() {
            continue;
        }
        let parent = maker.leaf[parent]?;
        let name = data.name.text.clone();
        let active = maker.temp(name, TempRole::NextActive(step));
        maker.temp_of.insert(cell, active);
        maker.leaf[step] = Some(Leaf::Temp(active));
        maker.gated[step] = Some(Gated { active, register: (!is_free).then_some(cell), parent });
    }
    if maker.temp_of.is_empty() {
        return None;
    }
    for &cell in recorded.values() {
        let temp = maker.temp(program.cells[cell].name.clone(), TempRole::Helper);
        maker.temp_of.insert(cell, temp);
    }
    Some(maker.finish(&recorded, &memory))
}

struct Maker<'a> {
    net: &'a Net,
    program: Program,
    /// The temporary that replaces a cell.
    temp_of: BTreeMap<CellId, TempId>,
    gated: IdMap<Step, Option<Gated>>,
    /// The leaf that tells whether a step is active.
    leaf: IdMap<Step, Option<Leaf>>,
}

impl Maker<'_> {
    fn temp(&mut self, name: String, role: TempRole) -> TempId {
        self.program.temps.push(Temp { name, ty: Type::Bool, role })
    }

    fn finish(
        mut self,
        recorded: &BTreeMap<(HistoryId, StepId), CellId>,
        memory: &IdMap<Step, Option<HistoryId>>,
    ) -> Regions {
        let body = std::mem::take(&mut self.program.body);
        let mut last = IdMap::filled(&self.program.cells, 0);
        for (index, stmt) in body.iter().enumerate() {
            super::note_stores(std::slice::from_ref(stmt), index + 1, &mut last);
        }
        let n_moving = self.temp_of.keys().map(|cell| last[*cell]).max().unwrap_or(0);
        let gated: Vec<(StepId, Gated)> =
            self.gated.iter().filter_map(|(step, gated)| Some((step, (*gated)?))).collect();
        let mut out = Vec::new();
        for (_, Gated { active, register, parent }) in &gated {
            let own = register.map(Leaf::Cell);
            let all = own.into_iter().chain([*parent]).map(read);
            out.push(Stmt::Set(*active, Expr::and(all)));
        }
        // While the parent of a state is inactive, the state's register keeps the recorded value: for a state with children, whether anything in it was
        // recorded.
        let mut kept: IdMap<Step, Vec<CellId>> = IdMap::filled(&self.net.steps, Vec::new());
        for (&(history, step), cell) in recorded {
            let owner = self.net.histories[history].owner;
            let way = way_up(self.net, step, owner).unwrap_or_default();
            for state in way.iter().filter(|state| memory[**state] == Some(history)) {
                kept[*state].push(*cell);
            }
            let registers = way.iter().filter_map(|step| self.gated[*step]?.register);
            let all: Vec<Expr> = registers.map(|cell| read(Leaf::Cell(cell))).collect();
            out.push(Stmt::Set(self.temp_of[cell], Expr::and(all)));
        }
        let mut rest = self.block(&body);
        let after = rest.split_off(n_moving);
        out.extend(rest);
        let mut active_first = IdMap::filled(&self.net.steps, false);
        for cell in self.program.cells.values() {
            if let Origin::Step(step) = cell.origin {
                active_first[step] = cell.init.first() == Some(&1);
            }
        }
        let mut init = Vec::new();
        for (step, Gated { active, register, parent }) in &gated {
            let Some(register) = register else { continue };
            let kept = &kept[*step];
            let is_set = |cell: &CellId| self.program.cells[*cell].init.first() == Some(&1);
            let own = is_set(register);
            let around = self.net.steps[*step].parent;
            let is_parent_active = around.is_some_and(|around| active_first[around]);
            let value = if is_parent_active { own } else { kept.iter().any(is_set) };
            init.push((*register, i64::from(value)));
            let kept = Expr::or(kept.iter().map(|cell| read(Leaf::Temp(self.temp_of[cell]))));
            let idle = Expr::and([read(*parent).not(), kept]);
            let next = Expr::or([read(Leaf::Temp(*active)), idle]);
            out.push(Stmt::Store(*register, None, next));
        }
        let packed_at = out.len();
        out.extend(after);
        for (cell, value) in init {
            self.program.cells[cell].init = vec![value];
        }
        // Cells keep their ids; those without a register have no elements.
        let registers: BTreeMap<CellId, StepId> =
            gated.iter().filter_map(|(step, gated)| Some((gated.register?, *step))).gather();
        let gone: Vec<CellId> =
            self.temp_of.keys().filter(|cell| !registers.contains_key(cell)).copied().collect();
        for cell in gone {
            let cell: &mut Cell = &mut self.program.cells[cell];
            (cell.len, cell.init) = (Some(0), Vec::new());
        }
        for (cell, step) in registers {
            self.program.cells[cell].origin = Origin::Region(step);
        }
        self.program.body = out;
        Regions {
            program: self.program,
            packed_at,
            gated: gated.into_iter().map(|(_, gated)| gated).collect(),
        }
    }

    fn other(&self, leaf: Leaf) -> Leaf {
        match leaf {
            Leaf::Cell(cell) => self.temp_of.get(&cell).map_or(leaf, |temp| Leaf::Temp(*temp)),
            Leaf::Temp(_) | Leaf::Input(_) | Leaf::Dt => leaf,
        }
    }

    fn block(&self, block: &[Stmt]) -> Vec<Stmt> {
        substitute::block(block, &|leaf| self.other(leaf))
    }
}

fn read(leaf: Leaf) -> Expr {
    Expr::new(ExprKind::Leaf(leaf), Span::default())
}
