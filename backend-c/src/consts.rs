//! Values that are known before the chart runs: the state and outputs after reset.

use grafsynth_ir::net::{Block, Driver, Leaf, Net, OutputId, StepId, StmtKind, VarId, Verbatim};
use std::collections::BTreeSet;

/// An effect of reset outside the chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Effect {
    /// Calls an extern action with these (saturated) arguments.
    Call(OutputId, Vec<i64>),
    /// Runs verbatim text.
    Code(Verbatim),
}

/// The state after reset, for nets without hierarchy, controlled actions and tasks (semantics §2).
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Reset {
    /// The values of each variable.
    pub(crate) vars: Vec<Vec<i64>>,
    /// The value of each output.
    pub(crate) outputs: Vec<i64>,
    /// Calls and verbatim texts, in order.
    pub(crate) effects: Vec<Effect>,
}

/// Runs the reset of a flat net.
pub(crate) fn reset(net: &Net) -> Reset {
    let mut state = State {
        net,
        active: BTreeSet::new(),
        vars: net.vars.values().map(|var| var.init.clone()).collect(),
        effects: Vec::new(),
    };
    for (id, step) in net.steps.iter().filter(|(_, step)| step.is_initial) {
        state.active.insert(id);
        state.run(&step.entry);
    }
    let mut outputs = Vec::new();
    let emergency = state.holds(net.emergency.as_ref().map(|one| &one.condition));
    let emergency = net.emergency.is_some() && emergency;
    for (id, output) in net.outputs.iter() {
        if emergency {
            outputs.push(if output.is_extern() { 0 } else { output.safe_value() });
            continue;
        }
        outputs.push(match &output.driver {
            Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
                let on = emissions.iter().any(|it| {
                    state.active.contains(&it.step) && state.holds(it.condition.as_ref())
                });
                i64::from(on)
            }
            Driver::Stored(var) => state.var(*var, 0),
            Driver::Controlled(_) => 0,
            Driver::Extern { calls, params } => {
                // The first active step in declaration order gives the arguments.
                let active = calls.iter().filter(|it| {
                    state.active.contains(&it.step) && state.holds(it.condition.as_ref())
                });
                let first = active.min_by_key(|it| it.step);
                if let Some(call) = first {
                    let arguments = call
                        .arguments
                        .iter()
                        .zip(params)
                        .map(|(it, param)| param.ty.saturate(state.eval(it)))
                        .collect();
                    state.effects.push(Effect::Call(id, arguments));
                }
                0
            }
        });
    }
    for (_, step) in net.steps.iter().filter(|(_, step)| step.is_initial) {
        state.effects.extend(step.code.iter().cloned().map(Effect::Code));
    }
    Reset { vars: state.vars, outputs, effects: state.effects }
}

struct State<'a> {
    net: &'a Net,
    active: BTreeSet<StepId>,
    vars: Vec<Vec<i64>>,
    effects: Vec<Effect>,
}

impl State<'_> {
    fn var(&self, var: VarId, index: i64) -> i64 {
        let index = usize::try_from(index).unwrap_or(0);
        self.vars[var.index()].get(index).copied().unwrap_or(0)
    }

    fn eval(&self, expr: &grafsynth_ir::net::Expr) -> i64 {
        expr.eval(&mut |leaf, index| match *leaf {
            Leaf::Var(var) => self.var(var, index),
            Leaf::Active(step) | Leaf::TasksDone(step) => i64::from(self.active.contains(&step)),
            // Inputs are 0, or the permitted value that is nearest to 0.
            Leaf::Input(input) => self.net.inputs[input].ty.saturate(0),
            // No time has passed; edges read as false.
            _ => 0,
        })
    }

    fn holds(&self, condition: Option<&grafsynth_ir::net::Expr>) -> bool {
        condition.is_none_or(|it| self.eval(it) != 0)
    }

    fn run(&mut self, block: &Block) {
        for stmt in block {
            match &stmt.kind {
                StmtKind::Assign { var, index, value } => {
                    let value = self.net.vars[*var].ty.saturate(self.eval(value));
                    let index = index.as_ref().map_or(0, |it| self.eval(it));
                    let slot = usize::try_from(index)
                        .ok()
                        .and_then(|it| self.vars[var.index()].get_mut(it));
                    if let Some(slot) = slot {
                        *slot = value;
                    }
                }
                StmtKind::Call { output, arguments } => {
                    let Driver::Extern { params, .. } = &self.net.outputs[*output].driver else {
                        continue;
                    };
                    let values = arguments
                        .iter()
                        .zip(params)
                        .map(|(it, param)| param.ty.saturate(self.eval(it)))
                        .collect();
                    self.effects.push(Effect::Call(*output, values));
                }
                StmtKind::If { condition, then, otherwise } => {
                    let taken = if self.eval(condition) != 0 { then } else { otherwise };
                    self.run(taken);
                }
                StmtKind::Code(text) => self.effects.push(Effect::Code(text.clone())),
                // The plan rejects nets that raise or send.
                StmtKind::Raise(_) | StmtKind::Send(_) | StmtKind::Cancel(_) => {}
            }
        }
    }
}
