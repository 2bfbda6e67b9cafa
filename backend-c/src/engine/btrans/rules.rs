//! Guards, actions and conditions as numbered pieces of C outside the tables.

use super::{Tabled, refuse};
use crate::Object;
use crate::c::print::{Kind, Node, Writer};
use crate::cexpr::{CExpr, Class, Helpers, Prec, Scope, c_expr, saturated};
use crate::engine::Plan;
use crate::names::Names;
use grafsynth_ir::expr::Type;
use grafsynth_ir::interval;
use grafsynth_ir::net::{Block, Expr, Leaf, Stmt, StmtKind};
use std::collections::BTreeMap;

/// Guards, actions and the like as numbered pieces of C.
pub(super) struct Rules<'a> {
    pub(super) plan: &'a Plan<'a>,
    pub(super) names: &'a Names,
    pub(super) cases: Vec<Node>,
    /// The pieces so far by their text; equal pieces share a number.
    pub(super) known: BTreeMap<String, u16>,
}

impl Rules<'_> {
    fn add(&mut self, mut body: Vec<Node>) -> u16 {
        let number = self.cases.len() + 1;
        body.push(Node::line("break;"));
        self.cases.push(Kind::Case(vec![format!("case {number}U:")], body).into());
        crate::engine::image::narrow(number)
    }

    /// The number of a new rule that computes a value; equal rules are not shared here.
    pub(super) fn fresh(&mut self, expr: &Expr) -> Tabled<u16> {
        let body = self.giving(expr)?;
        Ok(self.add(body))
    }

    fn giving(&self, expr: &Expr) -> Tabled<Vec<Node>> {
        let value = self.value(expr)?;
        let text = if matches!(value.class, Class::Bool) {
            format!("value = gb_truth({});", value.text)
        } else {
            format!("value = {};", value.cast(Class::Wide).text)
        };
        Ok(vec![Node::line(text)])
    }

    /// The rule of a condition; 0 if it is always true.
    pub(super) fn guard(&mut self, expr: &Expr) -> Tabled<u16> {
        if expr.is_true() {
            return Ok(0);
        }
        let body = self.giving(expr)?;
        Ok(self.shared(body))
    }

    /// The rule of a statement list; 0 if it is empty.
    pub(super) fn list(&mut self, block: &Block) -> Tabled<u16> {
        let body = self.block(block)?;
        Ok(if body.is_empty() { 0 } else { self.shared(body) })
    }

    fn shared(&mut self, body: Vec<Node>) -> u16 {
        let text = Writer::write(&body).0;
        if let Some(known) = self.known.get(&text) {
            return *known;
        }
        let number = self.add(body);
        self.known.insert(text, number);
        number
    }

    fn value(&self, expr: &Expr) -> Tabled<CExpr> {
        self.fits(expr)?;
        Ok(c_expr(expr, &mut Reader { plan: self.plan, names: self.names }))
    }

    /// Rejects what the rules cannot compute: they have no helpers for 64 bits, and can read a time only if the state has a timer.
    fn fits(&self, expr: &Expr) -> Tabled {
        use grafsynth_ir::expr::ExprKind;
        match &expr.kind {
            ExprKind::Neg(_) | ExprKind::Arith(..) => {
                let bounds = interval::net_type(self.plan.net, expr).map(Type::bounds);
                if !bounds
                    .is_ok_and(|(lo, hi)| i32::try_from(lo).is_ok() && i32::try_from(hi).is_ok())
                {
                    return refuse("a value of more than 32 bits", expr.span);
                }
            }
            ExprKind::Leaf(leaf) => {
                let what = match *leaf {
                    Leaf::Input(input) => self.plan.net.inputs[input]
                        .kind
                        .is_event()
                        .then_some("an event in a condition"),
                    Leaf::Elapsed(step) => (!self.plan.timers.contains_key(&step))
                        .then_some("a time that is not compared with a constant"),
                    Leaf::Var(_) | Leaf::Active(_) | Leaf::Rise(_) | Leaf::Fall(_) => None,
                    Leaf::LastElapsed(_) => Some("the time `T` of a step"),
                    Leaf::TasksDone(_) => Some("tasks"),
                    Leaf::Timer(_) => Some("a free timer"),
                    Leaf::Fireable(_) => Some("`otherwise`"),
                    Leaf::Controlled(_) => Some("a controlled action"),
                };
                if let Some(what) = what {
                    return refuse(what, expr.span);
                }
            }
            ExprKind::Element(..) => return refuse("an array", expr.span),
            ExprKind::Bool(_)
            | ExprKind::Int(_)
            | ExprKind::Not(_)
            | ExprKind::And(_)
            | ExprKind::Or(_)
            | ExprKind::Compare(..)
            | ExprKind::Select(..) => {}
        }
        expr.children().try_for_each(|operand| self.fits(operand))
    }

    fn block(&self, block: &Block) -> Tabled<Vec<Node>> {
        let mut nodes = Vec::new();
        for stmt in block {
            nodes.extend(self.stmt(stmt)?);
        }
        Ok(nodes)
    }

    fn stmt(&self, stmt: &Stmt) -> Tabled<Vec<Node>> {
        let span = stmt.span;
        match &stmt.kind {
            StmtKind::Assign { var, index: None, value } => {
                let ty = self.plan.net.vars[*var].ty;
                let place = format!("run->values[{}]", var.index());
                let value = self.value(value)?;
                let text = if ty.is_bool() {
                    format!("{place} = gb_truth({});", value.text)
                } else {
                    let (lo, hi) = ty.bounds();
                    let mut helpers = Helpers::default();
                    let inside = saturated(value.clone(), ty, &self.names.prefix, &mut helpers);
                    if helpers == Helpers::default() {
                        format!("{place} = {};", inside.cast(Class::Wide).text)
                    } else {
                        let value = value.cast(Class::Wide).text;
                        let (lo, hi) = (CExpr::int(lo).text, CExpr::int(hi).text);
                        format!("{place} = gb_between({value}, {lo}, {hi});")
                    }
                };
                Ok(vec![Node::line(text).about(Object::Var(*var))])
            }
            StmtKind::Assign { index: Some(_), .. } => refuse("an array", span),
            // An event without a listener is dropped.
            StmtKind::Raise(event) if !self.plan.listened.contains(event) => Ok(Vec::new()),
            StmtKind::Raise(_) => refuse("`raise`", span),
            StmtKind::Send(_) | StmtKind::Cancel(_) => refuse("`send`", span),
            StmtKind::Call { .. } => refuse("an extern action", span),
            StmtKind::Code(_) => refuse("text of another language", span),
            StmtKind::If { condition, then, otherwise } => {
                let condition = self.value(condition)?;
                let (then, otherwise) = (self.block(then)?, self.block(otherwise)?);
                Ok(crate::calls::either(condition, then, otherwise))
            }
        }
    }
}

/// Reads the values that an engine stores.
struct Reader<'a> {
    plan: &'a Plan<'a>,
    names: &'a Names,
}

impl Scope<Leaf> for Reader<'_> {
    fn prefix(&self) -> &str {
        &self.names.prefix
    }

    fn leaf(&mut self, leaf: &Leaf) -> CExpr {
        let net = self.plan.net;
        let number = |text: String, ty: Type| {
            if ty.is_bool() {
                CExpr::condition(format!("{text} != 0"), Prec::Compare)
            } else {
                CExpr::exact(text, Prec::Atom, Class::Wide, ty.bounds())
            }
        };
        match *leaf {
            Leaf::Input(input) => {
                let at = self.plan.inputs[input].unwrap_or_default();
                number(format!("run->in[{at}]"), net.inputs[input].ty)
            }
            Leaf::Var(var) => number(format!("run->values[{}]", var.index()), net.vars[var].ty),
            Leaf::Active(step) => {
                CExpr::condition(format!("gb_bit(run->active, {}U)", step.index()), Prec::Atom)
            }
            Leaf::Elapsed(step) => match self.plan.timers.get(&step) {
                Some((at, cap)) => {
                    let ty = Type::Int { lo: 0, hi: i64::from(*cap) };
                    number(format!("run->time[{at}]"), ty)
                }
                None => CExpr::int(0),
            },
            Leaf::Rise(edge) => {
                CExpr::condition(format!("gb_rise(run, {}U)", edge.index()), Prec::Atom)
            }
            Leaf::Fall(edge) => {
                CExpr::condition(format!("gb_fall(run, {}U)", edge.index()), Prec::Atom)
            }
            Leaf::LastElapsed(_)
            | Leaf::TasksDone(_)
            | Leaf::Timer(_)
            | Leaf::Fireable(_)
            | Leaf::Controlled(_) => unreachable!("`fits` refuses it"),
        }
    }

    fn element(&mut self, _: &Leaf, _: &CExpr) -> CExpr {
        unreachable!("`fits` refuses arrays")
    }
}
