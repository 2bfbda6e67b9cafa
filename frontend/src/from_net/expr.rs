//! Converts expressions of a net to expressions of the chart.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

use grafsynth_ir::Span;
use grafsynth_ir::chart::{Expr as Drawn, Leaf as DrawnLeaf, Path};
use grafsynth_ir::expr::{Expr, ExprKind};
use grafsynth_ir::net::{Leaf, PropertyLeaf, StepId, TransitionId, TransitionKind};
use grafsynth_ir::{Name, net};

use super::bodies::BodyId;
use super::{Writer, cannot};

impl Writer<'_> {
    /// An expression as seen from a body. If it is the receptivity of the transition `receptivity`, `otherwise` is recognised.
    pub(super) fn expr(
        &mut self,
        expr: &Expr<Leaf>,
        from: BodyId,
        receptivity: Option<TransitionId>,
    ) -> Drawn {
        if let Some(transition) = receptivity
            && self.is_otherwise(expr, transition)
        {
            return Drawn::leaf(DrawnLeaf::Otherwise, expr.span);
        }
        self.convert(
            expr,
            &mut |writer, expr| writer.expr(expr, from, receptivity),
            &mut |writer, leaf, span| writer.leaf(*leaf, span, from),
        )
    }

    /// The expression of a property, as seen from a chart.
    pub(super) fn property_expr(&mut self, expr: &Expr<PropertyLeaf>, from: BodyId) -> Drawn {
        self.convert(
            expr,
            &mut |writer, expr| writer.property_expr(expr, from),
            &mut |writer, leaf, span| match leaf {
                PropertyLeaf::Net(leaf) => writer.leaf(*leaf, span, from),
                PropertyLeaf::Output(id) => {
                    DrawnLeaf::Name(writer.bodies.path(&writer.net.outputs[*id].name, from))
                }
            },
        )
    }

    /// Converts one level of an expression.
    fn convert<L: AsTime>(
        &mut self,
        expr: &Expr<L>,
        inner: &mut dyn FnMut(&mut Self, &Expr<L>) -> Drawn,
        leaf: &mut dyn FnMut(&mut Self, &L, Span) -> DrawnLeaf,
    ) -> Drawn {
        let span = expr.span;
        let kind = match &expr.kind {
            ExprKind::Bool(value) => ExprKind::Bool(*value),
            ExprKind::Int(value) => ExprKind::Int(*value),
            ExprKind::Leaf(one) => ExprKind::Leaf(leaf(self, one, span)),
            ExprKind::Element(array, index) => {
                let array = leaf(self, array, span);
                ExprKind::Element(array, Box::new(inner(self, index)))
            }
            ExprKind::Not(a) => ExprKind::Not(Box::new(inner(self, a))),
            ExprKind::And(all) => ExprKind::And(all.iter().map(|one| inner(self, one)).collect()),
            ExprKind::Or(all) => ExprKind::Or(all.iter().map(|one| inner(self, one)).collect()),
            ExprKind::Compare(op, a, b) => {
                // A constant that is compared with a time is a number of ticks.
                let is_time =
                    |expr: &Expr<L>| matches!(&expr.kind, ExprKind::Leaf(leaf) if leaf.is_time());
                let mut side = |writer: &mut Self, one: &Expr<L>, other: &Expr<L>| match &one.kind {
                    ExprKind::Int(ticks) if is_time(other) => writer.duration(*ticks, one.span),
                    _ => inner(writer, one),
                };
                let left = side(self, a, b);
                let right = side(self, b, a);
                ExprKind::Compare(*op, Box::new(left), Box::new(right))
            }
            ExprKind::Neg(a) => ExprKind::Neg(Box::new(inner(self, a))),
            ExprKind::Arith(op, a, b) => {
                let a = inner(self, a);
                ExprKind::Arith(*op, Box::new(a), Box::new(inner(self, b)))
            }
            ExprKind::Select(condition, a, b) => {
                let condition = inner(self, condition);
                let a = inner(self, a);
                ExprKind::Select(Box::new(condition), Box::new(a), Box::new(inner(self, b)))
            }
        };
        Drawn::new(kind, span)
    }

    /// A number of ticks as a duration, or as a plain number if the language cannot express the duration.
    fn duration(&self, ticks: i64, span: Span) -> Drawn {
        let ns = u64::try_from(ticks)
            .ok()
            .and_then(|ticks| ticks.checked_mul(self.net.settings.tick_ns));
        match ns.filter(|ns| i64::try_from(*ns).is_ok()) {
            Some(ns) => Drawn::leaf(DrawnLeaf::Duration(ns), span),
            None => Drawn::new(ExprKind::Int(ticks), span),
        }
    }

    /// The nanoseconds of a number of ticks.
    pub(super) fn nanoseconds(&mut self, ticks: u32, span: Span) -> u64 {
        let ns = u64::from(ticks)
            .checked_mul(self.net.settings.tick_ns)
            .filter(|ns| i64::try_from(*ns).is_ok());
        ns.unwrap_or_else(|| {
            self.findings
                .push(cannot(format!("a duration of {ticks} ticks, which is too long"), span));
            0
        })
    }

    fn leaf(&mut self, leaf: Leaf, span: Span, from: BodyId) -> DrawnLeaf {
        let net = self.net;
        let name = match leaf {
            Leaf::Input(id) => &net.inputs[id].name,
            Leaf::Var(id) => &net.vars[id].name,
            Leaf::Timer(id) => &net.timers[id].name,
            Leaf::Active(id) => return self.of_step(id, "active", from),
            Leaf::Elapsed(id) => return self.of_step(id, "t", from),
            Leaf::LastElapsed(id) => return self.of_step(id, "T", from),
            Leaf::TasksDone(id) => return self.of_step(id, "done", from),
            Leaf::Rise(edge) => {
                return DrawnLeaf::Rise(Box::new(self.expr(&net.edges[edge].expr, from, None)));
            }
            Leaf::Fall(edge) => {
                return DrawnLeaf::Fall(Box::new(self.expr(&net.edges[edge].expr, from, None)));
            }
            Leaf::Fireable(id) => {
                let name = &net.transitions[id].name;
                self.findings.push(cannot(
                    format!("whether `{name}` is fireable, except by `otherwise`"),
                    span,
                ));
                name
            }
            Leaf::Controlled(id) => &net.actions[id].name,
        };
        DrawnLeaf::Name(self.bodies.path(name, from))
    }

    fn of_step(&self, id: StepId, attribute: &str, from: BodyId) -> DrawnLeaf {
        let step = &self.net.steps[id];
        // A step belongs to the body of its part, even if its name contains dots.
        let home = self.bodies.home(step.part);
        let mut path = if self.bodies.share_names(home, from) {
            Path::from(self.bodies.own(home, &step.name))
        } else {
            self.bodies.path(&step.name, from)
        };
        path.names.push(Name::new(attribute, step.name.span));
        DrawnLeaf::Name(path)
    }

    /// Whether this is the lowered form of `otherwise` for this transition.
    fn is_otherwise(&self, expr: &Expr<Leaf>, transition: TransitionId) -> bool {
        let ExprKind::Not(inner) = &expr.kind else { return false };
        let mut named = BTreeSet::new();
        for one in inner.alternatives() {
            let ExprKind::Leaf(Leaf::Fireable(id)) = one.kind else { return false };
            named.insert(id);
        }
        let requires = &self.net.transitions[transition].requires;
        let above: BTreeSet<TransitionId> = self
            .net
            .transitions
            .iter()
            .take(transition.index())
            .filter(|(id, one)| {
                let counts = one.kind == TransitionKind::Move
                    || self.net.settings.policy.is_statechart()
                        && !self.states.in_bodies.contains(id);
                counts && one.requires.iter().any(|step| requires.contains(step))
            })
            .map(|(id, _)| id)
            .gather();
        named == above
    }
}

/// Leaves of expressions, some of which are times.
pub(super) trait AsTime {
    fn is_time(&self) -> bool;
}

impl AsTime for Leaf {
    fn is_time(&self) -> bool {
        Leaf::is_time(self)
    }
}

impl AsTime for net::PropertyLeaf {
    fn is_time(&self) -> bool {
        matches!(self, PropertyLeaf::Net(leaf) if leaf.is_time())
    }
}
