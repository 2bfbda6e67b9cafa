//! Statecharts of any size, for measurements: parallel regions with four levels each.
//!
//! ```text
//! parallel P                        P -> P on reset
//!   region R0 .. R7                 (each of the same shape)
//!     state C0_0 ..                 C0_0 -> C0_1 on c0        to its history, if it has one
//!       state S0_0_0 ..             S0_0_0 -> S0_0_1 on n0
//!         state L0_0_0_0 ..         L0_0_0_0 -> L0_0_0_1 on tick; the last one raises n1, if requested
//! ```
//!
//! A `tick` moves every region, `n` and `c` move one, `reset` restarts all: broadcast, inherited transitions, transitions that exit many
//! states, history and internal events.

use grafsynth_ir::chart::{
    Block, Chart, Declaration, DeclarationKind, Design, Expr, History, Item, Leaf, Path, Setting,
    SettingKind, State, Step, StepItem, StepItemKind, Stmt, StmtKind, Transition,
};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind, Type};
use grafsynth_ir::lower::lower;
use grafsynth_ir::net::{Meta, Policy};
use grafsynth_ir::span::Name;
use grafsynth_ir::{Diagnostic, Span, Valid, net};

/// The parameters of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LargeChart {
    /// Regions of the parallel state.
    pub regions: usize,
    /// Composite states in each region.
    pub composites: usize,
    /// States in each composite.
    pub states: usize,
    /// Atomic states in each state of a composite.
    pub leaves: usize,
    /// How a composite is entered: by its history (true: deep) or by its first state.
    pub history: Option<bool>,
    /// True if the last atomic state raises the event of the next region.
    pub raises: bool,
    /// True if every state counts in a variable of its region on entry and exit, and the transitions of atomic states read that variable.
    pub lists: bool,
}

impl LargeChart {
    /// The measured sizes: 31, 217, 513 or 1001 states; `None` for other numbers.
    #[must_use]
    pub fn of_size(n_states: usize) -> Option<Self> {
        let (regions, composites, states, leaves) = match n_states {
            31 => (2, 2, 2, 2),
            217 => (8, 2, 3, 3),
            513 => (8, 3, 4, 4),
            1001 => (8, 4, 5, 5),
            _ => return None,
        };
        Some(LargeChart {
            regions,
            composites,
            states,
            leaves,
            history: None,
            raises: false,
            lists: false,
        })
    }

    /// The number of states of all levels.
    #[must_use]
    pub fn n_states(&self) -> usize {
        1 + self.regions * (1 + self.composites * (1 + self.states * (1 + self.leaves)))
    }

    /// The chart as a front end would produce it.
    #[must_use]
    pub fn design(&self) -> Design {
        let mut items = vec![setting(SettingKind::Conflict(Policy::InnerFirst))];
        if self.raises {
            // All regions may raise in one micro-step, and these events do not cause further ones.
            let places = u32::try_from(self.regions).unwrap_or(u32::MAX);
            items.push(setting(SettingKind::Queue(places)));
        }
        let kinds = (0..self.regions).map(|r| format!("n{r}"));
        let kinds = kinds.chain((0..self.regions).map(|r| format!("c{r}")));
        for event in ["tick", "reset"].into_iter().map(str::to_owned).chain(kinds) {
            items.push(declare(&event, DeclarationKind::Event { internal: false }));
        }
        if self.lists {
            for r in 0..self.regions {
                let ty = Type::Int { lo: 0, hi: 99 };
                let kind = DeclarationKind::Var { ty, len: None, init: Vec::new() };
                items.push(declare(&format!("v{r}"), kind));
            }
        }
        let mut top = State { step: self.step("P", None), is_parallel: true, ..State::default() };
        top.items = (0..self.regions).map(|r| Item::State(self.region(r))).collect();
        items.push(Item::State(top));
        items.push(go("P", "P", "reset", None, Vec::new()));
        let chart = Chart { name: named("large"), items, ..Chart::default() };
        Design { charts: vec![chart], ..Design::default() }
    }

    /// The chart as a net.
    ///
    /// # Errors
    /// Returns the errors of lowering; there are none unless a number is 0.
    pub fn net(&self) -> Result<Valid<net::Net>, Vec<Diagnostic>> {
        match lower(&self.design()) {
            (Some(net), found) if !any_error(&found) => Ok(net),
            (_, found) => Err(found),
        }
    }

    fn region(&self, r: usize) -> State {
        let mut items = Vec::new();
        for c in 0..self.composites {
            items.push(Item::State(self.composite(r, c)));
            let next = (c + 1) % self.composites;
            let (from, mut to) = (format!("C{r}_{c}"), format!("C{r}_{next}"));
            if self.history.is_some() {
                to.push_str(&format!(".H{r}_{next}"));
            }
            items.push(go(&from, &to, &format!("c{r}"), None, Vec::new()));
        }
        State { step: self.step(&format!("R{r}"), Some(r)), items, ..State::default() }
    }

    fn composite(&self, r: usize, c: usize) -> State {
        let mut state =
            State { step: self.step(&format!("C{r}_{c}"), Some(r)), ..State::default() };
        for s in 0..self.states {
            state.items.push(Item::State(self.state(r, c, s)));
            let (from, to) = (format!("S{r}_{c}_{s}"), (s + 1) % self.states);
            state.items.push(go(
                &from,
                &format!("S{r}_{c}_{to}"),
                &format!("n{r}"),
                None,
                Vec::new(),
            ));
        }
        if let Some(is_deep) = self.history {
            state.histories.push(History {
                name: named(format!("H{r}_{c}")),
                is_deep,
                default: vec![named(format!("S{r}_{c}_0")).into()],
                ..History::default()
            });
        }
        state
    }

    fn state(&self, r: usize, c: usize, s: usize) -> State {
        let mut state =
            State { step: self.step(&format!("S{r}_{c}_{s}"), Some(r)), ..State::default() };
        for l in 0..self.leaves {
            let from = format!("L{r}_{c}_{s}_{l}");
            let to = format!("L{r}_{c}_{s}_{}", (l + 1) % self.leaves);
            let mut actions = Vec::new();
            if self.raises && l + 1 == self.leaves {
                actions.push(statement(StmtKind::Raise(named(format!(
                    "n{}",
                    (r + 1) % self.regions
                )))));
            }
            let low = Expr::compare(CompareOp::Le, value(&format!("v{r}")), Expr::int(97));
            let guard = (self.lists && l % 2 == 1).then_some(low);
            state.items.push(Item::Step(self.step(&from, Some(r))));
            state.items.push(go(&from, &to, "tick", guard, actions));
        }
        state
    }

    /// A state without its children; with lists, it counts in the variable of its region.
    fn step(&self, name: &str, region: Option<usize>) -> Step {
        let mut body = Vec::new();
        if let Some(r) = region.filter(|_| self.lists) {
            let var = format!("v{r}");
            let sum = ExprKind::Arith(ArithOp::Add, Box::new(value(&var)), Box::new(Expr::int(3)));
            let rest = Expr::new(sum, Span::default());
            let rest = ExprKind::Arith(ArithOp::Mod, Box::new(rest), Box::new(Expr::int(100)));
            let less = ExprKind::Arith(ArithOp::Sub, Box::new(value(&var)), Box::new(Expr::int(1)));
            let [entry, exit] =
                [rest, less].map(|kind| assign(&var, Expr::new(kind, Span::default())));
            body = vec![
                StepItem { kind: StepItemKind::Entry(vec![entry]), span: Span::default() },
                StepItem { kind: StepItemKind::Exit(vec![exit]), span: Span::default() },
            ];
        }
        Step { name: named(name), body, ..Step::default() }
    }
}

fn named(text: impl Into<String>) -> Name {
    Name::new(text, Span::default())
}

fn value(name: &str) -> Expr {
    Expr::leaf(Leaf::Name(named(name).into()), Span::default())
}

fn setting(kind: SettingKind) -> Item {
    Item::Setting(Setting { kind, span: Span::default() })
}

fn declare(name: &str, kind: DeclarationKind) -> Item {
    Item::Declaration(Declaration { name: named(name), kind, meta: Meta::default() })
}

fn statement(kind: StmtKind) -> Stmt {
    Stmt { kind, span: Span::default() }
}

fn assign(var: &str, value: Expr) -> Stmt {
    statement(StmtKind::Assign { target: Path::from(named(var)), index: None, value })
}

fn go(from: &str, to: &str, event: &str, guard: Option<Expr>, actions: Block) -> Item {
    Item::Transition(Transition {
        sources: vec![named(from).into()],
        targets: vec![Path { names: to.split('.').map(named).collect() }],
        events: vec![named(event)],
        guard,
        actions,
        ..Transition::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sizes_are_what_they_are_called() {
        for n in [31, 217, 513, 1001] {
            let chart = LargeChart::of_size(n).expect("a size that is measured");
            assert_eq!(chart.n_states(), n);
            let full = LargeChart { history: Some(true), raises: true, lists: true, ..chart };
            let net = full.net().expect("it is a chart");
            assert_eq!((net.steps.len(), net.transitions.len()), (n, n - 1 - chart.regions + 1));
        }
    }
}
