//! Small random charts: [`Chart::random`] makes one, [`Chart::text`] writes it for the tool.

use grafsynth_sim::Random;
use itertools::Itertools as _;
use std::fmt::Write;

/// How transitions that share a preceding step compete.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Policy {
    /// No competition: all fire.
    All,
    /// By their priority number.
    Priority,
    /// By the number of the following steps, then by their age.
    Age,
}

/// A comparison with a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Compare {
    /// `=`
    Is,
    /// `<`
    Below,
    /// `<=`
    AtMost,
    /// `>`
    Above,
    /// `>=`
    AtLeast,
}

/// A condition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Guard {
    /// Always.
    True,
    /// An input, compared; Boolean ones are 0 and 1.
    Input(usize, Compare, i64),
    /// The Boolean input was 0 in the last reaction, and is 1 in the first micro-step of this one.
    Rise(usize),
    /// A variable.
    Var(usize, Compare, i64),
    /// `s.t` in ticks.
    Time(usize, Compare, i64),
    /// A free timer.
    Timer(usize, Compare, i64),
    /// A step is active.
    Active(usize),
    /// Negation.
    Not(Box<Guard>),
    /// All of these are true.
    And(Vec<Guard>),
    /// At least one of these is true.
    Or(Vec<Guard>),
}

/// `v := n` or `v := v + n`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Assign {
    /// The variable.
    pub(crate) var: usize,
    /// True for `v := v + n`.
    pub(crate) adds: bool,
    /// The number.
    pub(crate) number: i64,
}

/// A step.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Step {
    /// True if active after reset.
    pub(crate) initial: bool,
    /// For [`Policy::Age`].
    pub(crate) priority: Option<u32>,
    /// Runs on activation.
    pub(crate) entry: Vec<Assign>,
    /// Runs on deactivation.
    pub(crate) exit: Vec<Assign>,
}

/// A transition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Move {
    /// Preceding steps.
    pub(crate) from: Vec<usize>,
    /// Following steps.
    pub(crate) to: Vec<usize>,
    /// The receptivity.
    pub(crate) guard: Guard,
    /// For [`Policy::Priority`].
    pub(crate) priority: Option<u32>,
    /// Its actions.
    pub(crate) acts: Vec<Assign>,
}

/// A chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Chart {
    /// How transitions compete.
    pub(crate) policy: Policy,
    /// The limit of micro-steps if the chart evolves until it is stable.
    pub(crate) stable: Option<u32>,
    /// The largest value of each input: 1 for a Boolean one.
    pub(crate) inputs: Vec<i64>,
    /// Two inputs that are never 1 together.
    pub(crate) never_both: Option<(usize, usize)>,
    /// The largest value of each variable; all start with 0.
    pub(crate) vars: Vec<i64>,
    /// Free timers, each with the condition under which it runs.
    pub(crate) timers: Vec<Guard>,
    /// Steps.
    pub(crate) steps: Vec<Step>,
    /// Transitions.
    pub(crate) moves: Vec<Move>,
    /// Conditions that are asserted never to be true after a reaction.
    pub(crate) asserts: Vec<Guard>,
}

/// The length of the times in a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Span {
    /// No time is read.
    None,
    /// One step is timed, with up to this many ticks.
    One(i64),
    /// Two steps are timed.
    Two(i64),
    /// All steps may be timed, and a free timer too.
    Many(i64),
}

struct Maker<'r> {
    random: &'r mut Random,
    chart: Chart,
    span: Span,
    timed: Vec<usize>,
}

impl Chart {
    /// A chart, the same for the same seed.
    pub(crate) fn random(seed: u64, span: Span) -> Chart {
        let random = &mut Random::new(seed);
        let policy = [Policy::All, Policy::All, Policy::Priority, Policy::Age][random.below(4)];
        let stable = (random.below(3) == 0).then(|| 3 + random.below(6) as u32);
        let n_inputs = 1 + random.below(2);
        let inputs: Vec<i64> =
            (0..n_inputs).map(|_| if random.below(4) == 0 { 2 } else { 1 }).collect();
        let never_both = (random.below(6) == 0 && inputs == [1, 1]).then_some((0, 1));
        let vars = (0..random.below(3)).map(|_| 1 + random.below(3) as i64).collect();
        let n_steps = 2 + random.below(5);
        let chart = Chart {
            policy,
            stable,
            inputs,
            never_both,
            vars,
            timers: Vec::new(),
            steps: vec![Step::default(); n_steps],
            moves: Vec::new(),
            asserts: Vec::new(),
        };
        let mut timed: Vec<usize> = (0..n_steps).collect();
        let n_timed = match span {
            Span::None => 0,
            Span::One(_) => 1,
            Span::Two(_) => 2,
            Span::Many(_) => n_steps,
        };
        while timed.len() > n_timed {
            timed.remove(random.below(timed.len()));
        }
        let mut maker = Maker { random, chart, span, timed };
        maker.fill();
        maker.chart
    }

    /// The chart as the tool reads it.
    pub(crate) fn text(&self) -> String {
        let mut text = String::from("chart c {\n tick 1 ms\n");
        let policy = match self.policy {
            Policy::All => "all",
            Policy::Priority => "priority",
            Policy::Age => "priority-age",
        };
        let _ = writeln!(text, " conflict {policy}");
        if let Some(limit) = self.stable {
            let _ = writeln!(text, " evolution stable limit {limit}");
        }
        for (at, hi) in self.inputs.iter().enumerate() {
            let ty = if *hi == 1 { String::new() } else { format!(": int 0..{hi}") };
            let _ = writeln!(text, " input x{at}{ty}");
        }
        if let Some((a, b)) = self.never_both {
            let _ = writeln!(text, " assume never (x{a} and x{b})");
        }
        for (at, hi) in self.vars.iter().enumerate() {
            let _ = writeln!(text, " var v{at}: int 0..{hi} = 0");
        }
        for (at, guard) in self.timers.iter().enumerate() {
            let _ = writeln!(text, " timer T{at} while {}", self.guard(guard));
        }
        let list = |list: &[Assign]| -> String {
            let one = |it: &Assign| match it.adds {
                true => format!("v{0} := v{0} + {1}", it.var, it.number),
                false => format!("v{} := {}", it.var, it.number),
            };
            list.iter().map(one).join("; ")
        };
        for (at, step) in self.steps.iter().enumerate() {
            let initial = if step.initial { "initial " } else { "" };
            let mut inside = String::new();
            if let (Some(priority), Policy::Age) = (step.priority, self.policy) {
                let _ = write!(inside, " priority {priority};");
            }
            if !step.entry.is_empty() {
                let _ = write!(inside, " entry {{ {} }}", list(&step.entry));
            }
            if !step.exit.is_empty() {
                let _ = write!(inside, " exit {{ {} }}", list(&step.exit));
            }
            let _ = writeln!(text, " {initial}step s{at} {{{inside} }}");
        }
        let names = |steps: &[usize]| steps.iter().map(|step| format!("s{step}")).join(" & ");
        for (at, it) in self.moves.iter().enumerate() {
            let _ = write!(text, " t{at}: {} -> {}", names(&it.from), names(&it.to));
            if it.guard != Guard::True {
                let _ = write!(text, " when {}", self.guard(&it.guard));
            }
            if let (Some(priority), Policy::Priority) = (it.priority, self.policy) {
                let _ = write!(text, " priority {priority}");
            }
            if !it.acts.is_empty() {
                let _ = write!(text, " do {{ {} }}", list(&it.acts));
            }
            text.push('\n');
        }
        for guard in &self.asserts {
            let _ = writeln!(text, " assert never ({})", self.guard(guard));
        }
        text + "}\n"
    }

    fn guard(&self, guard: &Guard) -> String {
        let sign = |compare: &Compare| match compare {
            Compare::Is => "=",
            Compare::Below => "<",
            Compare::AtMost => "<=",
            Compare::Above => ">",
            Compare::AtLeast => ">=",
        };
        let joined = |all: &[Guard], word: &str| {
            let all: Vec<String> = all.iter().map(|one| format!("({})", self.guard(one))).collect();
            all.join(word)
        };
        match guard {
            Guard::True => "true".to_owned(),
            Guard::Input(at, _, number) if self.inputs[*at] == 1 => {
                format!("{}x{at}", if *number == 0 { "not " } else { "" })
            }
            Guard::Input(at, compare, number) => format!("x{at} {} {number}", sign(compare)),
            Guard::Rise(at) => format!("rise(x{at})"),
            Guard::Var(at, compare, number) => format!("v{at} {} {number}", sign(compare)),
            Guard::Time(at, compare, ticks) => format!("s{at}.t {} {ticks} ms", sign(compare)),
            Guard::Timer(at, compare, ticks) => format!("T{at} {} {ticks} ms", sign(compare)),
            Guard::Active(at) => format!("s{at}.active"),
            Guard::Not(one) => format!("not ({})", self.guard(one)),
            Guard::And(all) => joined(all, " and "),
            Guard::Or(all) => joined(all, " or "),
        }
    }

    /// Calls `visit` with every condition in the chart.
    pub(crate) fn for_each_guard(&self, visit: &mut impl FnMut(&Guard)) {
        fn walk(guard: &Guard, visit: &mut impl FnMut(&Guard)) {
            visit(guard);
            match guard {
                Guard::Not(one) => walk(one, visit),
                Guard::And(all) | Guard::Or(all) => all.iter().for_each(|one| walk(one, visit)),
                _ => {}
            }
        }
        let moves = self.moves.iter().map(|it| &it.guard);
        for guard in moves.chain(&self.timers).chain(&self.asserts) {
            walk(guard, visit);
        }
    }
}

impl Maker<'_> {
    fn chance(&mut self, one_in: usize) -> bool {
        self.random.below(one_in) == 0
    }

    fn step(&mut self) -> usize {
        self.random.below(self.chart.steps.len())
    }

    fn fill(&mut self) {
        let n_steps = self.chart.steps.len();
        self.chart.steps[0].initial = true;
        if self.chance(2) {
            let at = self.step();
            self.chart.steps[at].initial = true;
        }
        if matches!(self.span, Span::Many(_)) && self.chance(2) {
            let timer = if self.chance(2) {
                Guard::Active(self.step())
            } else {
                let input = self.random.below(self.chart.inputs.len());
                Guard::Input(input, Compare::AtLeast, 1)
            };
            self.chart.timers.push(timer);
        }
        for at in 0..n_steps {
            let entry = self.list(3);
            let exit = self.list(6);
            let step = &mut self.chart.steps[at];
            (step.entry, step.exit) = (entry, exit);
            let numbered = self.chance(4);
            self.chart.steps[at].priority = numbered.then(|| 1 + self.random.below(2) as u32);
        }
        let n_moves = n_steps + self.random.below(n_steps + 2);
        for at in 0..n_moves {
            let mut from = vec![if at < n_steps { at } else { self.step() }];
            if self.chance(6) {
                from.push(self.step());
            }
            let mut to = vec![self.step()];
            if self.chance(6) {
                to.push(self.step());
            }
            for steps in [&mut from, &mut to] {
                steps.sort_unstable();
                steps.dedup();
            }
            let guard = self.receptivity(&from);
            let numbered = self.chance(3);
            let priority = numbered.then(|| 1 + self.random.below(3) as u32);
            let acts = self.list(5);
            self.chart.moves.push(Move { from, to, guard, priority, acts });
        }
        for _ in 0..2 + self.random.below(3) {
            let guard = self.property();
            self.chart.asserts.push(guard);
        }
    }

    fn list(&mut self, one_in: usize) -> Vec<Assign> {
        if self.chart.vars.is_empty() || !self.chance(one_in) {
            return Vec::new();
        }
        let var = self.random.below(self.chart.vars.len());
        let adds = self.chance(2);
        let number =
            if adds { 1 } else { self.random.below(self.chart.vars[var] as usize + 1) as i64 };
        vec![Assign { var, adds, number }]
    }

    fn compare(&mut self) -> Compare {
        use Compare::{Above, AtLeast, AtMost, Below, Is};
        [AtLeast, AtLeast, AtLeast, Below, Above, AtMost, Is][self.random.below(7)]
    }

    fn ticks(&mut self) -> i64 {
        let most = match self.span {
            Span::None => 0,
            Span::One(most) | Span::Two(most) | Span::Many(most) => most,
        };
        // Also short ones: abstractions fail where a long time is next to a short one.
        let most = if self.chance(3) { most.min(4) } else { most };
        self.random.below(most as usize + 1) as i64
    }

    /// A time of one of the steps, or of any step.
    fn time(&mut self, steps: &[usize]) -> Option<Guard> {
        let near: Vec<usize> = steps.iter().copied().filter(|it| self.timed.contains(it)).collect();
        if !self.chart.timers.is_empty() && self.chance(4) {
            let (compare, ticks) = (self.compare(), self.ticks());
            return Some(Guard::Timer(0, compare, ticks));
        }
        let from = if near.is_empty() { self.timed.clone() } else { near };
        if from.is_empty() {
            return None;
        }
        let step = from[self.random.below(from.len())];
        let (compare, ticks) = (self.compare(), self.ticks());
        Some(Guard::Time(step, compare, ticks))
    }

    fn level(&mut self) -> Guard {
        let input = self.random.below(self.chart.inputs.len());
        let hi = self.chart.inputs[input];
        if hi == 1 {
            if self.chance(6) {
                return Guard::Rise(input);
            }
            return Guard::Input(input, Compare::Is, self.random.below(2) as i64);
        }
        let compare = self.compare();
        Guard::Input(input, compare, self.random.below(hi as usize + 1) as i64)
    }

    fn receptivity(&mut self, from: &[usize]) -> Guard {
        let mut all = Vec::new();
        if self.chance(2)
            && let Some(time) = self.time(from)
        {
            all.push(time);
        }
        if all.is_empty() || self.chance(3) {
            let level = self.level();
            all.push(level);
        }
        if self.chance(8) {
            let step = self.step();
            all.push(Guard::Active(step));
        }
        if self.chance(8) && !self.chart.vars.is_empty() {
            let var = self.random.below(self.chart.vars.len());
            let compare = self.compare();
            let number = self.random.below(self.chart.vars[var] as usize + 1) as i64;
            all.push(Guard::Var(var, compare, number));
        }
        let guard = if all.len() == 1 {
            all.remove(0)
        } else if self.chance(5) {
            Guard::Or(all)
        } else {
            Guard::And(all)
        };
        if self.chance(10) { Guard::Not(Box::new(guard)) } else { guard }
    }

    fn property(&mut self) -> Guard {
        let mut all = vec![Guard::Active(self.step())];
        match self.random.below(5) {
            0 => all.push(Guard::Active(self.step())),
            1 => all.extend(self.time(&[])),
            2 if !self.chart.vars.is_empty() => {
                let var = self.random.below(self.chart.vars.len());
                let hi = self.chart.vars[var];
                all.push(Guard::Var(var, Compare::Is, self.random.below(hi as usize + 1) as i64));
            }
            3 => {
                let input = self.random.below(self.chart.inputs.len());
                all.push(Guard::Input(input, Compare::AtLeast, 1));
            }
            _ => {}
        }
        Guard::And(all)
    }
}
