//! Random nets whose components are known by construction.

use super::*;
use grafsynth_ir::expr::{ArithOp, CompareOp, ExprKind};

/// The features that a random net may use.
#[derive(Clone, Copy)]
pub(crate) struct Flavour {
    pub(crate) policy: Policy,
    pub(crate) stable: bool,
    /// Entry, exit and transition actions on variables.
    pub(crate) lists: bool,
    /// Fork and join between rings.
    pub(crate) forks: bool,
    /// Times of steps.
    pub(crate) times: bool,
}

struct Grow {
    b: Build,
    random: Random,
    inputs: Vec<InputId>,
    steps: Vec<StepId>,
    vars: Vec<VarId>,
    edges: Vec<EdgeId>,
    flavour: Flavour,
}

fn leaf(leaf: Leaf) -> Expr {
    Expr::leaf(leaf, Span::default())
}

impl Grow {
    /// A Boolean expression.
    fn condition(&mut self, depth: usize, step: Option<StepId>) -> Expr {
        let n = if depth == 0 { 5 } else { 9 };
        match self.random.below(n) {
            0 | 1 => read(self.pick_input()),
            2 => read(self.pick_input()).not(),
            3 if !self.edges.is_empty() => {
                let edge = self.edges[self.random.below(self.edges.len())];
                if self.random.one_in(2) { leaf(Leaf::Rise(edge)) } else { leaf(Leaf::Fall(edge)) }
            }
            4 if self.flavour.times && step.is_some() => {
                let step = step.expect("asked");
                let constant = self.random.between(0, 12);
                Expr::compare(CompareOp::Ge, leaf(Leaf::Elapsed(step)), Expr::int(constant))
            }
            5 if !self.steps.is_empty() => {
                let step = self.steps[self.random.below(self.steps.len())];
                leaf(Leaf::Active(step))
            }
            6 if !self.vars.is_empty() => {
                let a = self.number(depth.saturating_sub(1));
                let b = self.number(depth.saturating_sub(1));
                let op = [
                    CompareOp::Eq,
                    CompareOp::Ne,
                    CompareOp::Lt,
                    CompareOp::Le,
                    CompareOp::Gt,
                    CompareOp::Ge,
                ][self.random.below(6)];
                Expr::compare(op, a, b)
            }
            7 => {
                let a = self.condition(depth.saturating_sub(1), step);
                let b = self.condition(depth.saturating_sub(1), step);
                Expr::and([a, b])
            }
            8 => {
                let a = self.condition(depth.saturating_sub(1), step);
                let b = self.condition(depth.saturating_sub(1), step);
                Expr::or([a, b])
            }
            _ => read(self.pick_input()),
        }
    }

    fn pick_input(&mut self) -> InputId {
        self.inputs[self.random.below(self.inputs.len())]
    }

    fn number(&mut self, depth: usize) -> Expr {
        let n = if depth == 0 { 2 } else { 7 };
        match self.random.below(n) {
            0 => Expr::int(self.random.between(-40, 40)),
            1 => leaf(Leaf::Var(self.vars[self.random.below(self.vars.len())])),
            2 => {
                let a = self.number(depth - 1);
                Expr::new(ExprKind::Neg(Box::new(a)), Span::default())
            }
            3 => {
                let a = self.number(depth - 1);
                let divisor = [-7, -3, -1, 1, 2, 5][self.random.below(6)];
                let op = if self.random.one_in(2) { ArithOp::Div } else { ArithOp::Mod };
                Expr::new(
                    ExprKind::Arith(op, Box::new(a), Box::new(Expr::int(divisor))),
                    Span::default(),
                )
            }
            4 => {
                let c = self.condition(0, None);
                let a = self.number(depth - 1);
                let b = self.number(depth - 1);
                Expr::new(ExprKind::Select(Box::new(c), Box::new(a), Box::new(b)), Span::default())
            }
            5 => {
                let a = self.number(depth - 1);
                let all =
                    [ArithOp::BitAnd, ArithOp::BitOr, ArithOp::BitXor, ArithOp::Shl, ArithOp::Shr];
                let op = all[self.random.below(all.len())];
                let b = if op.is_shift() {
                    Expr::int(self.random.between(0, 5))
                } else {
                    self.number(depth - 1)
                };
                Expr::new(ExprKind::Arith(op, Box::new(a), Box::new(b)), Span::default())
            }
            _ => {
                let a = self.number(depth - 1);
                let b = self.number(depth - 1);
                let op = [ArithOp::Add, ArithOp::Sub, ArithOp::Mul][self.random.below(3)];
                Expr::new(ExprKind::Arith(op, Box::new(a), Box::new(b)), Span::default())
            }
        }
    }

    fn list(&mut self) -> Block {
        if !self.flavour.lists || self.vars.is_empty() || !self.random.one_in(3) {
            return vec![];
        }
        let var = self.vars[self.random.below(self.vars.len())];
        let value = self.number(2);
        let assign =
            Stmt { kind: StmtKind::Assign { var, index: None, value }, span: Span::default() };
        if self.random.one_in(3) {
            let condition = self.condition(1, None);
            let other = self.vars[self.random.below(self.vars.len())];
            let value = self.number(1);
            let otherwise = vec![Stmt {
                kind: StmtKind::Assign { var: other, index: None, value },
                span: Span::default(),
            }];
            let kind = StmtKind::If { condition, then: vec![assign], otherwise };
            return vec![Stmt { kind, span: Span::default() }];
        }
        vec![assign]
    }
}

/// A random net of a few rings, with forks and joins between the first two, and the facts about it.
pub(crate) fn random_net(title: &str, seed: u64, flavour: Flavour) -> (Valid<Net>, Facts) {
    let mut b = Build::new(title);
    b.net.settings.policy = flavour.policy;
    let mut random = Random::new(seed);
    if flavour.stable {
        b.net.settings.evolution = Evolution::Stable { limit: random.between(1, 6) as u32 };
    }
    let n_inputs = 2 + random.below(5);
    let inputs: Vec<InputId> = (0..n_inputs)
        .map(|k| {
            let kind = match random.below(8) {
                0 => InputKind::Extern,
                1 => InputKind::Event,
                _ => InputKind::Pin,
            };
            b.input_of(&format!("i{k}"), Type::Bool, kind)
        })
        .collect();
    let mut vars = Vec::new();
    if flavour.lists {
        for k in 0..2 {
            let (lo, hi) =
                [(0, 9), (-100, 100), (0, 255), (0, 40000), (-70000, 5), (0, 300)][random.below(6)];
            vars.push(b.var(&format!("v{k}"), lo, hi, 0));
        }
    }
    let mut grow = Grow { b, random, inputs, steps: vec![], vars, edges: vec![], flavour };
    for input in grow.inputs.clone() {
        if !grow.b.net.inputs[input].kind.is_event() && grow.random.one_in(3) {
            grow.edges.push(grow.b.net.edges.push(EdgeOperand { expr: read(input) }));
        }
    }
    let n_rings = if flavour.lists && grow.random.one_in(2) { 1 } else { 1 + grow.random.below(3) };
    let mut rings: Vec<Vec<StepId>> = Vec::new();
    for ring in 0..n_rings {
        let n = 2 + grow.random.below(5);
        let steps: Vec<StepId> =
            (0..n).map(|k| grow.b.step(&format!("r{ring}s{k}"), k == 0)).collect();
        grow.steps.extend(&steps);
        rings.push(steps);
    }
    let mut components: Vec<Component> = rings.iter().map(|steps| component(steps, true)).collect();
    // Ring 0 forks into a branch and waits for it.
    let mut branch = Vec::new();
    if flavour.forks && rings[0].len() >= 3 {
        let n = 1 + grow.random.below(3);
        branch = (0..n).map(|k| grow.b.step(&format!("bs{k}"), false)).collect::<Vec<_>>();
        grow.steps.extend(&branch);
        components.push(component(&branch, false));
    }
    let mut count = 0;
    for (index, ring) in rings.clone().iter().enumerate() {
        for (k, step) in ring.iter().enumerate() {
            let is_fork = index == 0 && !branch.is_empty() && k == 0;
            let is_join = index == 0 && !branch.is_empty() && k + 1 == ring.len();
            let inner = if index == 0 && !branch.is_empty() { &ring[1..] } else { &ring[..] };
            let exits = if is_fork || is_join { 1 } else { 1 + grow.random.below(2) };
            let exclusive = read(grow.pick_input());
            for exit in 0..exits {
                let mut from = vec![*step];
                let mut to = if is_fork {
                    vec![ring[1], branch[0]]
                } else if is_join {
                    vec![ring[0]]
                } else if exit == 0 {
                    vec![ring[(k + 1) % ring.len()]]
                } else {
                    vec![inner[grow.random.below(inner.len())]]
                };
                if is_join {
                    from.push(branch[branch.len() - 1]);
                }
                let mut guard = grow.condition(2, Some(*step));
                if flavour.policy == Policy::All {
                    // If both fired at once, the component would be violated.
                    let side = if exit == 0 { exclusive.clone() } else { exclusive.clone().not() };
                    guard = Expr::and([side, guard]);
                }
                to.dedup();
                let id = grow.b.transition(&format!("t{count}"), &from, &to, guard);
                count += 1;
                if grow.random.one_in(3) {
                    grow.b.net.transitions[id].priority = Some(grow.random.between(1, 3) as u32);
                }
                let event = grow.pick_input();
                if grow.b.net.inputs[event].kind.is_event() && grow.random.one_in(2) {
                    grow.b.net.transitions[id].events = vec![event];
                }
                if to == [*step] && grow.random.one_in(2) {
                    grow.b.net.transitions[id].restart = true;
                }
                let actions = if branch.is_empty() { grow.list() } else { vec![] };
                grow.b.net.transitions[id].actions = actions;
            }
        }
    }
    for k in 0..branch.len().saturating_sub(1) {
        let guard = grow.condition(2, Some(branch[k]));
        grow.b.transition(&format!("t{count}"), &[branch[k]], &[branch[k + 1]], guard);
        count += 1;
    }
    for step in grow.steps.clone() {
        let entry = grow.list();
        let exit = grow.list();
        if branch.is_empty() {
            grow.b.net.steps[step].entry = entry;
            grow.b.net.steps[step].exit = exit;
        }
    }
    for k in 0..3 {
        let mut emissions = Vec::new();
        for step in grow.steps.clone() {
            if grow.random.one_in(3) {
                let edges = std::mem::take(&mut grow.edges);
                let mut condition = grow.random.one_in(2).then(|| grow.condition(1, Some(step)));
                grow.edges = edges;
                // Conditions of outputs read no events.
                let mut reads_event = false;
                if let Some(condition) = &condition {
                    for leaf in condition.leaves() {
                        if let Leaf::Input(input) = leaf {
                            reads_event |= grow.b.net.inputs[*input].kind.is_event();
                        }
                    }
                }
                if reads_event {
                    condition = None;
                }
                emissions.push(Emission { step, condition, span: Span::default() });
            }
        }
        let mealy = k == 2 && !flavour.stable && grow.random.one_in(2);
        let driver = if mealy { Driver::Mealy(emissions) } else { Driver::Continuous(emissions) };
        grow.b.output(&format!("o{k}"), driver);
    }
    if grow.random.one_in(2) {
        let mut calls = Vec::new();
        for step in grow.steps.clone() {
            if grow.random.one_in(3) {
                let arguments =
                    vec![if grow.vars.is_empty() { Expr::int(3) } else { grow.number(0) }];
                calls.push(ExternCall { step, condition: None, arguments, span: Span::default() });
            }
        }
        let params = vec![Param { name: "a".into(), ty: Type::Int { lo: 0, hi: 9 } }];
        grow.b.output("speak", Driver::Extern { params, calls });
    }
    if !grow.vars.is_empty() {
        let var = grow.vars[0];
        grow.b.net.vars[var].origin = VarOrigin::StoredOutput;
        grow.b.output("stored", Driver::Stored(var));
    }
    (grow.b.valid(), facts(components))
}
