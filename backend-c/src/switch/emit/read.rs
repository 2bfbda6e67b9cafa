//! Expressions and lists of the net, read in their context. Known facts (the active step, the transitions that did not fire, the times that have been reset)
//! are folded in.

use super::Emit;
use crate::Object;
use crate::c::print::Node;
use crate::calls::{self, Callee};
use crate::cexpr::{CExpr, Prec, Scope, c_expr, saturated};
use crate::io::Structure;
use crate::switch::plan::{Latch, receptivity};
use crate::times::timer_place;
use grafsynth_ir::net::{Block, EdgeId, Expr, InputKind, Leaf, OutputId, StepId, StmtKind};
use grafsynth_ir::walk::expressions;

/// The context of an expression.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// In a receptivity that the variable decides while this step is active; the first `asked` transitions of the step are known not to be fireable.
    Guard { step: StepId, asked: usize },
    /// In a list of a variable: its active step, if any, and whether its time still counts.
    List { machine: usize, active: Option<StepId>, timed: bool },
    /// In an output, after all variables have moved; the step that assigns it is active.
    Output { step: StepId },
    /// In an output, without known facts.
    Free,
}

impl Emit<'_> {
    pub(super) fn block(&mut self, block: &Block, place: Place) -> Vec<Node> {
        let mut nodes = self.demand_all(expressions(block), &[]);
        nodes.extend(self.statements(block, place));
        nodes
    }

    pub(super) fn statements(&mut self, block: &Block, place: Place) -> Vec<Node> {
        let net = self.net;
        let mut nodes = Vec::new();
        for stmt in block {
            match &stmt.kind {
                StmtKind::Assign { var, index, value } => {
                    let ty = net.vars[*var].ty;
                    let value = self.value(value, place);
                    let value = saturated(value, ty, &self.names.prefix, &mut self.helpers);
                    let name = &self.names.vars[*var];
                    let target = match index {
                        None => format!("self->{name}"),
                        Some(index) => {
                            let index = self.value(index, place);
                            format!("self->{}[{}]", self.names.vars[*var], index.text)
                        }
                    };
                    nodes.push(
                        Node::line(format!("{target} = {};", value.stored_as(ty)))
                            .about(Object::Var(*var)),
                    );
                }
                StmtKind::Call { output, arguments } => {
                    let values =
                        arguments.iter().map(|argument| self.value(argument, place)).collect();
                    nodes.push(self.call(*output, values));
                }
                StmtKind::If { condition, then, otherwise } => {
                    let condition = self.value(condition, place);
                    let then = self.statements(then, place);
                    let otherwise = self.statements(otherwise, place);
                    nodes.extend(calls::either(condition, then, otherwise));
                }
                StmtKind::Code(text) => nodes.extend(calls::verbatim(text)),
                // The plan rejects nets that raise or send.
                StmtKind::Raise(_) | StmtKind::Send(_) | StmtKind::Cancel(_) => {}
            }
        }
        nodes
    }

    /// The text of an expression.
    pub(super) fn value(&mut self, expr: &Expr, place: Place) -> CExpr {
        c_expr(expr, &mut Reader { emit: self, place })
    }

    /// The text of a condition; true if there is none.
    pub(super) fn given(&mut self, condition: Option<&Expr>, place: Place) -> CExpr {
        condition.map_or_else(|| CExpr::bool(true), |it| self.value(it, place))
    }

    pub(super) fn call(&mut self, output: OutputId, arguments: Vec<CExpr>) -> Node {
        let callee = Callee { net: self.net, names: self.names, output };
        callee.call(arguments, &mut self.helpers)
    }
}

/// Reads leaves in a context.
struct Reader<'e, 'a> {
    pub(super) emit: &'e mut Emit<'a>,
    pub(super) place: Place,
}

impl Reader<'_, '_> {
    fn active(&self, step: StepId) -> CExpr {
        let emit = &self.emit;
        let (machine, _) = emit.plan.place[step];
        match self.place {
            Place::Guard { step: own, .. } if emit.plan.place[own].0 == machine => {
                CExpr::bool(own == step)
            }
            Place::Guard { step: own, .. } => emit.is_active(step, emit.plan.place[own].0),
            Place::List { machine: own, active, .. } if own == machine => {
                CExpr::bool(active == Some(step))
            }
            Place::List { .. } | Place::Free => emit.now_active(step),
            Place::Output { step: own } if emit.plan.place[own].0 == machine => {
                CExpr::bool(own == step)
            }
            Place::Output { .. } => emit.now_active(step),
        }
    }

    fn elapsed(&self, step: StepId) -> CExpr {
        let emit = &self.emit;
        let (machine, _) = emit.plan.place[step];
        let cap = emit.plan.machines[machine].timer_cap.unwrap_or(0);
        let time = timer_place(&format!("self->{}", emit.timers[machine]), cap);
        match self.place {
            Place::List { machine: own, timed: false, .. } if own == machine => CExpr::int(0),
            Place::Guard { .. } | Place::List { .. } | Place::Output { .. } | Place::Free => {
                CExpr::select(self.active(step), time, CExpr::int(0))
            }
        }
    }
}

impl Scope<Leaf> for Reader<'_, '_> {
    fn prefix(&self) -> &str {
        &self.emit.names.prefix
    }

    fn leaf(&mut self, leaf: &Leaf) -> CExpr {
        let net = self.emit.net;
        match *leaf {
            Leaf::Input(input) => {
                let name = &self.emit.names.inputs[input];
                match net.inputs[input].kind {
                    InputKind::Pin => self.emit.names.io.read(
                        Structure::Behind("in"),
                        name,
                        input,
                        net.inputs[input].ty,
                    ),
                    InputKind::Extern => match self.emit.plan.latches.get(&input) {
                        Some(Latch::InCase) => {
                            CExpr::place(format!("cond_{name}"), net.inputs[input].ty)
                        }
                        Some(Latch::Always | Latch::OnDemand) | None => CExpr::place(
                            self.emit.scan(&format!("cond_{name}")),
                            net.inputs[input].ty,
                        ),
                    },
                    InputKind::Event => {
                        let event = self.emit.names.io.read(
                            Structure::Behind("in"),
                            name,
                            input,
                            net.inputs[input].ty,
                        );
                        if self.emit.stable {
                            CExpr::and([
                                CExpr::condition(self.emit.scan("first"), Prec::Atom),
                                event,
                            ])
                        } else {
                            event
                        }
                    }
                    // Nothing raises it: the plan rejects nets that do.
                    InputKind::InternalEvent => CExpr::bool(false),
                }
            }
            Leaf::Var(var) => {
                CExpr::place(format!("self->{}", self.emit.names.vars[var]), net.vars[var].ty)
            }
            Leaf::Active(step) => self.active(step),
            // This style has no tasks, so they are done at once.
            Leaf::TasksDone(step) => self.active(step),
            Leaf::Elapsed(step) => self.elapsed(step),
            Leaf::Rise(edge) => self.edge("rise", edge),
            Leaf::Fall(edge) => self.edge("fall", edge),
            Leaf::Fireable(rival) => {
                let Place::Guard { step, asked } = self.place else { return CExpr::bool(false) };
                let position = self.emit.plan.leaving[step].iter().position(|it| *it == rival);
                match position {
                    // It was tested before and did not fire, or it leaves another step of the same variable.
                    None => CExpr::bool(false),
                    Some(position) if position < asked => CExpr::bool(false),
                    Some(position) => {
                        let place = Place::Guard { step, asked: position };
                        let guard = receptivity(net, rival);
                        c_expr(&guard, &mut Reader { emit: self.emit, place })
                    }
                }
            }
            Leaf::Timer(timer) => {
                let framed = self.emit.framed.as_mut();
                framed.and_then(|it| it.timer(timer)).unwrap_or_else(|| CExpr::int(0))
            }
            Leaf::Controlled(action) => {
                let framed = self.emit.framed.as_mut();
                framed.and_then(|it| it.action(action)).unwrap_or_else(|| CExpr::bool(false))
            }
            // The plan rejects it.
            Leaf::LastElapsed(_) => CExpr::int(0),
        }
    }

    fn element(&mut self, array: &Leaf, index: &CExpr) -> CExpr {
        let Leaf::Var(var) = *array else { return CExpr::int(0) };
        CExpr::place(
            format!("self->{}[{}]", self.emit.names.vars[var], index.text),
            self.emit.net.vars[var].ty,
        )
    }
}

impl Reader<'_, '_> {
    fn edge(&self, word: &str, edge: EdgeId) -> CExpr {
        let name = self.emit.names.edges[edge].trim_start_matches("was_");
        CExpr::condition(self.emit.scan(&format!("{word}_{name}")), Prec::Atom)
    }
}
