//! The position of each stored object of a net in a [`State`](crate::State). A net stores only what it uses (semantics §2).

use std::collections::BTreeMap;

use grafsynth_ir::net::{
    ActionId, Driver, EdgeId, Enter, HistoryId, InputId, Leaf, Net, OutputId, PartId, Policy,
    Qualifier, SendId, StepId, StepKind, TimerId, TransitionId, TransitionKind, VarId,
};

use crate::constants;
use crate::ranks::Ranks;

/// The content of one cell of a state.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Cell {
    /// `s.t` in ticks.
    Elapsed(StepId),
    /// `s.T` in ticks.
    LastElapsed(StepId),
    /// A variable, or one element of an array.
    Var(VarId, u32),
    /// The value of an edge operand in its last comparison.
    Edge(EdgeId),
    /// A free timer in ticks.
    Timer(TimerId),
    /// The bit that stores whether the condition of a free timer was true at the end of the last reaction.
    TimerHeld(TimerId),
    /// One position, counted from the oldest, in one of the orders of last activation; the value is the index of a step.
    Age(u32, u32),
    /// The index of the step's next task.
    Task(StepId),
    /// Q of a controlled action.
    ActionQ(ActionId),
    /// A latch of a controlled action.
    Latch(ActionId, Qualifier),
    /// The timer of a qualifier, in ticks.
    ActionTimer(ActionId, Qualifier),
    /// The bit that stores the last input of a qualifier's timer.
    ActionTimerHeld(ActionId, Qualifier),
    /// The input of a pulse qualifier in the last row.
    Old(ActionId, Qualifier),
    /// The event was raised and will be present in the next check (Grafcet charts).
    Raised(InputId),
    /// The remaining ticks of a send slot; 0 if it is not running.
    Slot(SendId),
    /// The history recorded the case with this number.
    Recorded(HistoryId, u32),
    /// The statechart has ended.
    Ended(PartId),
    /// The contribution of an ended chart's steps to an output in its last row.
    Held(OutputId, PartId),
}

/// One order of last activation: it ranks the steps that decide between competing transitions of equal rank and P (semantics §4). Steps that can never
/// decide are omitted, so that states that differ only in them are equal.
#[derive(Debug, Clone, Default)]
pub(crate) struct AgeOrder {
    /// The steps, in declaration order.
    pub(crate) steps: Vec<StepId>,
    /// The index of the first cell of this order.
    pub(crate) base: usize,
}

const NONE: u32 = u32::MAX;

#[derive(Debug, Clone, Default)]
pub(crate) struct Layout {
    pub(crate) cells: Vec<Cell>,
    places: BTreeMap<Cell, u32>,
    /// For each action, the index of its first cell; at the end, the index of the first cell after all actions.
    of_action: Vec<u32>,
    elapsed: Vec<u32>,
    last_elapsed: Vec<u32>,
    elapsed_caps: Vec<i64>,
    last_elapsed_caps: Vec<i64>,
    timer_caps: Vec<i64>,
    vars: Vec<u32>,
    pub(crate) n_var_cells: usize,
    tasks: Vec<u32>,
    first_edge: usize,
    first_timer: usize,
    raised: Vec<u32>,
    pub(crate) ages: Vec<AgeOrder>,
    /// The order that decides for each transition, if there is one.
    pub(crate) age_of: Vec<Option<u32>>,
    /// Cells of outputs of charts that can end.
    pub(crate) held: Vec<(OutputId, PartId)>,
}

impl Layout {
    pub(crate) fn of(net: &Net, ranks: &Ranks) -> Layout {
        let mut layout = Layout::default();
        layout.variables(net);
        let caps = constants::timer_caps(net);
        let cap = |leaf: Leaf| caps.get(&leaf).copied();
        for step in net.steps.ids() {
            let place = cap(Leaf::Elapsed(step)).map_or(NONE, |_| layout.push(Cell::Elapsed(step)));
            layout.elapsed.push(place);
            layout.elapsed_caps.push(cap(Leaf::Elapsed(step)).unwrap_or(0));
            let place =
                cap(Leaf::LastElapsed(step)).map_or(NONE, |_| layout.push(Cell::LastElapsed(step)));
            layout.last_elapsed.push(place);
            layout.last_elapsed_caps.push(cap(Leaf::LastElapsed(step)).unwrap_or(0));
        }
        layout.first_timer = layout.cells.len();
        for timer in net.timers.ids() {
            layout.push(Cell::Timer(timer));
            layout.push(Cell::TimerHeld(timer));
            layout.timer_caps.push(cap(Leaf::Timer(timer)).unwrap_or(0));
        }
        layout.first_edge = layout.cells.len();
        for edge in net.edges.ids() {
            layout.push(Cell::Edge(edge));
        }
        for (step, data) in net.steps.iter() {
            let place = if data.tasks.is_empty() { NONE } else { layout.push(Cell::Task(step)) };
            layout.tasks.push(place);
        }
        layout.actions(net);
        for (event, input) in net.inputs.iter() {
            let is_carried = input.kind.is_event() && !net.settings.policy.is_statechart();
            let place = if is_carried { layout.push(Cell::Raised(event)) } else { NONE };
            layout.raised.push(place);
        }
        for send in net.sends.ids() {
            layout.push(Cell::Slot(send));
        }
        for (history, data) in net.histories.iter() {
            for case in 0..data.cases.len() {
                layout.push(Cell::Recorded(history, case as u32));
            }
        }
        layout.endings(net, ranks);
        layout.age_orders(net, ranks);
        layout
    }

    fn push(&mut self, cell: Cell) -> u32 {
        let place = self.cells.len() as u32;
        self.cells.push(cell);
        self.places.insert(cell, place);
        place
    }

    /// Adds the cells of variables. They come first, so that they can be counted from 0.
    fn variables(&mut self, net: &Net) {
        for (id, var) in net.vars.iter() {
            self.vars.push(self.cells.len() as u32);
            for element in 0..var.len.unwrap_or(1) {
                self.push(Cell::Var(id, element));
            }
        }
        self.n_var_cells = self.cells.len();
    }

    fn actions(&mut self, net: &Net) {
        for (action, data) in net.actions.iter() {
            self.of_action.push(self.cells.len() as u32);
            self.push(Cell::ActionQ(action));
            let has = |it: &Qualifier| data.uses.iter().any(|one| one.qualifier == *it);
            let used = || Qualifier::ALL.into_iter().filter(has);
            for latch in used().filter(|it| it.is_stored()) {
                self.push(Cell::Latch(action, latch));
            }
            for timed in used().filter(|it| it.is_timed()) {
                self.push(Cell::ActionTimer(action, timed));
                self.push(Cell::ActionTimerHeld(action, timed));
            }
            for pulse in used().filter(|it| it.is_pulse()) {
                self.push(Cell::Old(action, pulse));
            }
        }
        self.of_action.push(self.cells.len() as u32);
    }

    /// Adds the cells of charts with a top-level final state: whether the chart has ended, and its contribution to each output at that time (semantics §5).
    fn endings(&mut self, net: &Net, ranks: &Ranks) {
        if !net.settings.policy.is_statechart() {
            return;
        }
        for step in
            net.steps.values().filter(|step| step.kind == StepKind::Final && step.parent.is_none())
        {
            let chart = ranks.chart_of(step.part);
            if self.find(Cell::Ended(chart)).is_none() {
                self.push(Cell::Ended(chart));
            }
        }
        for (output, data) in net.outputs.iter() {
            let Driver::Continuous(emissions) = &data.driver else { continue };
            for emission in emissions {
                let chart = ranks.chart_of(net.steps[emission.step].part);
                let cell = Cell::Held(output, chart);
                if self.find(Cell::Ended(chart)).is_some() && self.find(cell).is_none() {
                    self.push(cell);
                    self.held.push((output, chart));
                }
            }
        }
    }

    /// Adds the orders of last activation. Transitions that share a preceding step compete (with `fire one`: all); among those of equal rank and P, age decides
    /// (semantics §4).
    fn age_orders(&mut self, net: &Net, ranks: &Ranks) {
        self.age_of = vec![None; net.transitions.len()];
        if net.settings.policy != Policy::PriorityAge {
            return;
        }
        let group_of = competing_groups(net);
        /// Transitions between which age decides, and their following steps.
        type Competitors = (Vec<TransitionId>, Vec<StepId>);
        let mut sets: BTreeMap<(usize, u64, u64), Competitors> = BTreeMap::new();
        for (id, transition) in
            net.transitions.iter().filter(|(_, transition)| transition.kind == TransitionKind::Move)
        {
            let key = (
                group_of[id.index()],
                ranks.of_part(transition.part),
                ranks.following_priority(net, id),
            );
            let (members, steps) = sets.entry(key).or_default();
            members.push(id);
            steps.extend(transition.enters.iter().filter_map(|enter| match enter {
                Enter::Step(step) => Some(*step),
                Enter::InitialContent(_) | Enter::History(_) => None,
            }));
        }
        for (members, mut steps) in sets.into_values() {
            steps.sort_unstable();
            steps.dedup();
            if members.len() < 2 || steps.len() < 2 {
                continue;
            }
            let order = self.ages.len() as u32;
            let base = self.cells.len();
            for place in 0..steps.len() {
                self.push(Cell::Age(order, place as u32));
            }
            for member in members {
                self.age_of[member.index()] = Some(order);
            }
            self.ages.push(AgeOrder { steps, base });
        }
    }

    /// The index of a cell, or `None` if the net does not use it.
    pub(crate) fn find(&self, cell: Cell) -> Option<usize> {
        let (Cell::ActionQ(action)
        | Cell::Latch(action, _)
        | Cell::ActionTimer(action, _)
        | Cell::ActionTimerHeld(action, _)
        | Cell::Old(action, _)) = cell
        else {
            return self.places.get(&cell).map(|place| *place as usize);
        };
        // All actions are looked up in each row, and an action has few cells.
        let own = self.of_action.get(action.index()..action.index() + 2)?;
        let (first, end) = (own[0] as usize, own[1] as usize);
        self.cells.get(first..end)?.iter().position(|it| *it == cell).map(|at| first + at)
    }

    /// The index of a cell that the caller knows to exist. If the cell does not exist, which only a faulty table could cause, the index is 0.
    pub(crate) fn at(&self, cell: Cell) -> usize {
        self.find(cell).unwrap_or(0)
    }

    pub(crate) fn var(&self, var: VarId) -> usize {
        self.vars[var.index()] as usize
    }

    pub(crate) fn elapsed(&self, step: StepId) -> Option<(usize, i64)> {
        let place = self.elapsed[step.index()];
        (place != NONE).then(|| (place as usize, self.elapsed_caps[step.index()]))
    }

    pub(crate) fn last_elapsed(&self, step: StepId) -> Option<(usize, i64)> {
        let place = self.last_elapsed[step.index()];
        (place != NONE).then(|| (place as usize, self.last_elapsed_caps[step.index()]))
    }

    pub(crate) fn task(&self, step: StepId) -> Option<usize> {
        let place = self.tasks[step.index()];
        (place != NONE).then_some(place as usize)
    }

    pub(crate) fn edge(&self, edge: EdgeId) -> usize {
        self.first_edge + edge.index()
    }

    /// The index of the timer's cell; its held bit is in the next cell.
    pub(crate) fn timer(&self, timer: TimerId) -> usize {
        self.first_timer + 2 * timer.index()
    }

    /// The cell that stores whether the event was raised for the next check (Grafcet charts only).
    pub(crate) fn raised(&self, event: InputId) -> Option<usize> {
        let place = self.raised[event.index()];
        (place != NONE).then_some(place as usize)
    }

    pub(crate) fn timer_cap(&self, timer: TimerId) -> i64 {
        self.timer_caps[timer.index()]
    }
}

/// For each transition, the number of its group of competitors: those connected by shared preceding steps.
fn competing_groups(net: &Net) -> Vec<usize> {
    let mut leader: Vec<usize> = (0..net.transitions.len()).collect();
    let find = |leader: &mut Vec<usize>, mut at: usize| {
        while leader[at] != at {
            leader[at] = leader[leader[at]];
            at = leader[at];
        }
        at
    };
    let mut first_leaving = vec![None; net.steps.len()];
    let mut first_of_all = None;
    for (id, transition) in
        net.transitions.iter().filter(|(_, transition)| transition.kind == TransitionKind::Move)
    {
        let mut join = |other: &mut Option<usize>| match *other {
            Some(other) => {
                let (a, b) = (find(&mut leader, id.index()), find(&mut leader, other));
                leader[a.max(b)] = a.min(b);
            }
            None => *other = Some(id.index()),
        };
        for step in &transition.requires {
            join(&mut first_leaving[step.index()]);
        }
        if net.settings.fire_one {
            join(&mut first_of_all);
        }
    }
    (0..leader.len()).map(|at| find(&mut leader, at)).collect()
}
