//! Turns statements of actions, programs and function blocks into lists of the chart.

use grafsynth_ir::chart::{Block, Expr, Stmt, StmtKind};
use grafsynth_ir::diag::{Diagnostic, ErrorReported};
use grafsynth_ir::expr::{CompareOp, ExprKind};
use grafsynth_ir::net::Meta;
use grafsynth_ir::{Name, Span};

use super::context::{BUDGET, Binding, Elaborator, FrameId, Outcome, Place};
use super::jump_elimination::{self, Leaves};
use super::types::Ty;
use super::value::{Kind, Time, Value};
use crate::codes;
use crate::st::ast::{self, Flag};
use crate::st::symbol::Ident;

/// Maximum number of iterations of a loop.
const MAX_ROUNDS: i64 = 65_536;
/// An IF or CASE with more branches than this becomes a binary search, so that lists are not nested too deeply.
const MANY_ARMS: usize = 12;

/// The iterations of a FOR loop.
pub(super) struct Rounds {
    pub(super) each: Vec<i64>,
    /// The value of the variable after the loop.
    pub(super) after: i64,
}

impl Elaborator<'_> {
    /// Elaborates statements in order. Reports and omits invalid ones.
    pub(super) fn list(&mut self, frame: FrameId, list: &[ast::Stmt], out: &mut Block) {
        for stmt in list {
            let _ = self.stmt(frame, stmt, out);
        }
    }

    pub(super) fn stmt(
        &mut self,
        frame: FrameId,
        stmt: &ast::Stmt,
        out: &mut Block,
    ) -> Outcome<()> {
        let span = self.at(stmt.span);
        self.spend(span, 1)?;
        match &stmt.kind {
            ast::StmtKind::Assign {
                target: ast::Expr { kind: ast::ExprKind::Bit(inner, bit), .. },
                value,
            } => {
                let value = self.value(frame, value)?;
                self.assign_bit(frame, (inner, *bit), value, span, out)
            }
            ast::StmtKind::Assign { target, value } => {
                let value = self.value(frame, value);
                if self.preset(frame, target, value.as_ref().ok()) {
                    return Ok(());
                }
                let place = self.place(frame, target);
                let (value, place) = (value?, place?);
                self.assign(&place, value, span, out)
            }
            ast::StmtKind::Call { target, arguments } => {
                self.call(frame, target, arguments, span, out)
            }
            // One function for each form of statement: nested statements add up the stack frames of these functions.
            ast::StmtKind::If { arms, otherwise } => {
                self.conditional(frame, arms, otherwise, span, out)
            }
            ast::StmtKind::Case { selector, arms, otherwise } => {
                let selector = self.value(frame, selector);
                self.case(frame, &selector, arms, otherwise, span, out)
            }
            ast::StmtKind::For { var, from, to, by, body } => {
                let rounds = self.loop_values(frame, from, to, by.as_ref(), span)?;
                self.count_rounds(frame, &rounds, body, span)?;
                self.counted(frame, var, &rounds, body, span, out)
            }
            ast::StmtKind::While { .. } | ast::StmtKind::Repeat { .. } => Err(self.unbounded(span)),
            ast::StmtKind::Exit | ast::StmtKind::Continue | ast::StmtKind::Return => {
                Err(self.leaves(span))
            }
            ast::StmtKind::Refused(_) => Err(ErrorReported),
        }
    }

    fn conditional(
        &mut self,
        frame: FrameId,
        arms: &[(ast::Expr, Vec<ast::Stmt>)],
        otherwise: &[ast::Stmt],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let mut lowered = Vec::new();
        for (condition, list) in arms {
            let condition = self.condition(frame, condition);
            lowered.push((condition, self.branch(frame, list)));
        }
        chosen(lowered, self.branch(frame, otherwise), span, out)
    }

    /// The statements of one branch.
    fn branch(&mut self, frame: FrameId, list: &[ast::Stmt]) -> Block {
        let mut branch = Block::new();
        self.list(frame, list, &mut branch);
        branch
    }

    fn case(
        &mut self,
        frame: FrameId,
        selector: &Outcome<Value>,
        arms: &[(Vec<ast::CaseLabel>, Vec<ast::Stmt>)],
        otherwise: &[ast::Stmt],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let mut lowered = Vec::new();
        let mut taken = Vec::new();
        for (labels, list) in arms {
            let condition = match selector {
                Ok(selector) => self.label_test(frame, selector, labels, &mut taken),
                Err(told) => Err(*told),
            };
            lowered.push((condition, self.branch(frame, list)));
        }
        chosen(lowered, self.branch(frame, otherwise), span, out)
    }

    fn counted(
        &mut self,
        frame: FrameId,
        var: &Ident,
        rounds: &Rounds,
        body: &[ast::Stmt],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let target = ast::Expr::name(var.clone());
        let place = self.place(frame, &target)?;
        let key = &var.id;
        let exits = jump_elimination::has(body, Leaves::Exit);
        let left = exits.then(|| self.flag(frame, Flag::Left, &format!("{var}.left"), span));
        let skipped = jump_elimination::has(body, Leaves::Continue)
            .then(|| self.flag(frame, Flag::Skipped, &format!("{var}.skipped"), span));
        let flat =
            (left.is_some() || skipped.is_some()).then(|| jump_elimination::round(body, var));
        let body = flat.as_deref().unwrap_or(body);
        let bound = [
            (Flag::Left, left.clone()),
            (Flag::Skipped, skipped.clone()),
            (Flag::Variable, exits.then(|| place.clone())),
        ];
        let outside = self.frames[frame].flags.clone();
        let bound =
            bound.into_iter().filter_map(|(flag, place)| Some((flag, Binding::Place(place?))));
        self.frames[frame].flags.extend(bound);
        let outer = self.own(frame, key).cloned();
        for value in &rounds.each {
            // Otherwise, nested loops would continue even after the budget is exhausted.
            if self.spend(span, 1).is_err() {
                break;
            }
            let value = Value::int(*value, var.span);
            self.bind(frame, key, Binding::Value(value));
            self.list(frame, body, out);
            if let Some(skipped) = &skipped {
                self.assign(skipped, Value::constant(false, span), span, out)?;
            }
        }
        self.frames[frame].flags = outside;
        match outer {
            Some(outer) => self.bind(frame, key, outer),
            None => self.frames[frame].names.remove(key),
        };
        let after = Value::int(rounds.after, var.span);
        let Some(left) = left else { return self.assign(&place, after, span, out) };
        let condition = self.read(Binding::Place(left.clone()), span)?.expr.not();
        let mut then = Block::new();
        self.assign(&place, after, span, &mut then)?;
        let kind = StmtKind::If { condition, then, otherwise: Block::new() };
        out.push(Stmt { kind, span });
        self.assign(&left, Value::constant(false, span), span, out)
    }

    /// The Boolean variable that stores a flag of the statement at `span`; every expansion of the statement uses the same one.
    fn flag(&mut self, frame: FrameId, flag: Flag, name: &str, span: Span) -> Place {
        let key = (flag, span.start);
        if let Some(place) = self.frames[frame].jumps.get(&key) {
            return place.clone();
        }
        let name = Name::new(self.free_name(name), span);
        let place = self.new_var(name, &Ty::Bool, Vec::new(), Meta::default());
        self.frames[frame].jumps.insert(key, place.clone());
        place
    }

    /// Elaborates the statements of a unit or action, which RETURN may leave.
    pub(super) fn body(&mut self, frame: FrameId, list: &[ast::Stmt], span: Span, out: &mut Block) {
        let Ok((list, is_flagged)) = self.without_returns(list, span) else { return };
        if !is_flagged {
            self.list(frame, &list, out);
            return;
        }
        let place = self.flag(frame, Flag::Returned, "returned", span);
        let outside = self.frames[frame].flags.clone();
        self.frames[frame].flags.insert(Flag::Returned, Binding::Place(place.clone()));
        self.list(frame, &list, out);
        self.frames[frame].flags = outside;
        let _ = self.assign(&place, Value::constant(false, span), span, out);
    }

    /// Reports, before the loop is expanded, that its expansion exceeds the limit; counts inner loops whose bounds are known.
    pub(super) fn count_rounds(
        &mut self,
        frame: FrameId,
        rounds: &Rounds,
        body: &[ast::Stmt],
        span: Span,
    ) -> Outcome<()> {
        let amount = self.weight(frame, body).saturating_mul(rounds.each.len());
        if self.spent.saturating_add(amount) > BUDGET {
            return self.spend(span, amount);
        }
        Ok(())
    }

    /// The minimum that the expansion of a list counts towards [`BUDGET`].
    fn weight(&self, frame: FrameId, list: &[ast::Stmt]) -> usize {
        let each = list.iter().map(|stmt| match &stmt.kind {
            kind @ (ast::StmtKind::If { .. } | ast::StmtKind::Case { .. }) => {
                kind.lists().map(|list| self.weight(frame, list)).fold(1, usize::saturating_add)
            }
            ast::StmtKind::For { from, to, by, body, .. } => {
                let step = by.as_ref().map_or(Some(1), |by| self.known(frame, by));
                let rounds = match (self.known(frame, from), self.known(frame, to), step) {
                    (Some(from), Some(to), Some(step)) if step != 0 => {
                        to.saturating_sub(from).checked_div(step).unwrap_or(0).saturating_add(1)
                    }
                    _ => 1,
                };
                let rounds = usize::try_from(rounds).unwrap_or(0);
                rounds.saturating_mul(self.weight(frame, body).saturating_add(1)).saturating_add(1)
            }
            ast::StmtKind::Assign { .. }
            | ast::StmtKind::Call { .. }
            | ast::StmtKind::While { .. }
            | ast::StmtKind::Repeat { .. }
            | ast::StmtKind::Exit
            | ast::StmtKind::Continue
            | ast::StmtKind::Return
            | ast::StmtKind::Refused(_) => 2,
        });
        each.fold(0, usize::saturating_add)
    }

    /// The value of a literal number or of a named constant.
    fn known(&self, frame: FrameId, expr: &ast::Expr) -> Option<i64> {
        if let ast::ExprKind::Int(value) = expr.kind {
            return Some(value);
        }
        let ast::ExprKind::Name(name) = &expr.kind else { return None };
        let binding = self.lookup(frame, &name.id)?;
        let Binding::Value(Value { kind: Kind::Int(lo, hi), .. }) = binding else { return None };
        (lo == hi).then_some(lo)
    }

    pub(super) fn unbounded(&mut self, span: Span) -> ErrorReported {
        self.report(
            Diagnostic::error(codes::ST_LOOP, "WHILE and REPEAT have no constant bound")
                .at(span, "")
                .help("use FOR with constant bounds, or run one iteration per scan in a step"),
        )
    }

    pub(super) fn leaves(&mut self, span: Span) -> ErrorReported {
        self.report(
            Diagnostic::error(codes::ST_UNEXPECTED, "EXIT and CONTINUE are only allowed in a loop")
                .at(span, "not inside a loop")
                .help("remove it, or write RETURN to leave the unit"),
        )
    }

    /// The iterations of a loop with constant bounds.
    pub(super) fn loop_values(
        &mut self,
        frame: FrameId,
        from: &ast::Expr,
        to: &ast::Expr,
        by: Option<&ast::Expr>,
        span: Span,
    ) -> Outcome<Rounds> {
        let (first, last) = (self.constant_int(frame, from), self.constant_int(frame, to));
        let step = by.map_or(Ok(1), |by| self.constant_int(frame, by));
        let (first, last, step) = (first?, last?, step?);
        if step == 0 {
            return Err(self.report(
                Diagnostic::error(codes::ST_LOOP, "a loop with step 0 never ends")
                    .at(span, "")
                    .help("write another step after BY, such as 1"),
            ));
        }
        let rounds = if (step > 0) == (last >= first) || last == first {
            (i128::from(last) - i128::from(first)) / i128::from(step) + 1
        } else {
            0
        };
        if rounds > i128::from(MAX_ROUNDS) {
            return Err(self.report(
                Diagnostic::error(
                    codes::ST_LOOP,
                    format!("the loop has {rounds} iterations; the limit is {MAX_ROUNDS}"),
                )
                .at(span, "")
                .help("loops are unrolled: iterate over fewer values"),
            ));
        }
        let rounds = i64::try_from(rounds).unwrap_or(0);
        let each: Vec<i64> = (0..rounds).map(|n| first.saturating_add(n * step)).collect();
        Ok(Rounds { each, after: first.saturating_add(rounds.saturating_mul(step)) })
    }

    /// The condition that the selector matches one of the labels.
    pub(super) fn label_test(
        &mut self,
        frame: FrameId,
        selector: &Value,
        labels: &[(ast::Expr, Option<ast::Expr>)],
        taken: &mut Vec<(i64, i64, Span)>,
    ) -> Outcome<Expr> {
        let mut tests = Vec::new();
        for (low, high) in labels {
            let lo = self.constant_int(frame, low)?;
            let hi = match high {
                Some(high) => self.constant_int(frame, high)?,
                None => lo,
            };
            if !matches!(selector.kind, Kind::Int(..)) {
                return Err(
                    self.type_error("the selector of CASE must be a number", selector.expr.span)
                );
            }
            let span = high.as_ref().map_or(low.span, |high| low.span.to(high.span));
            let earlier = taken.iter().find(|(from, to, _)| lo <= *to && *from <= hi).copied();
            if let Some((from, _, first)) = earlier {
                let value = lo.max(from);
                return Err(self.report(Diagnostic::twice(
                    codes::ST_DUPLICATE,
                    format!("two labels of this CASE contain {value}"),
                    [span, first],
                    "remove the value from one of them: a CASE chooses one list for each value",
                )));
            }
            taken.push((lo, hi, span));
            let test = |op, value| {
                let constant = Expr::new(ExprKind::Int(value), low.span);
                Expr::compare(op, selector.expr.clone(), constant)
            };
            tests.push(if lo == hi {
                test(CompareOp::Eq, lo)
            } else {
                Expr::and([test(CompareOp::Ge, lo), test(CompareOp::Le, hi)])
            });
        }
        Ok(Expr::or(tests))
    }

    /// Resolves the target of an assignment.
    pub(super) fn place(&mut self, frame: FrameId, target: &ast::Expr) -> Outcome<Place> {
        match self.access(frame, target)? {
            Binding::Place(place) if self.inputs.contains(&place.name.text) => {
                Err(self.report(
                    Diagnostic::error(codes::ST_TYPE, format!("`{}` is an input and cannot be assigned", place.name))
                        .at(target.span, "")
                        .help("assign to a separate variable"),
                ))
            }
            Binding::Place(place) => Ok(place),
            Binding::Broken => Err(ErrorReported),
            Binding::Value(value) if matches!(value.kind, Kind::Time(_)) => Err(self.report(
                Diagnostic::error(codes::ST_TIMER, "this TIME variable must be constant")
                    .at(target.span, "assigned here")
                    .help("charts compare times only with constants: choose between steps or timers with constant times"),
            )),
            Binding::Value(_) => Err(self.report(
                Diagnostic::error(codes::ST_TYPE, "a constant, an input or a loop variable cannot be assigned")
                    .at(target.span, "")
                    .help("assign to a separate variable of VAR or VAR_OUTPUT"),
            )),
            Binding::Object(_) => Err(self.type_error("a whole block or structure cannot be assigned", target.span)),
            Binding::Step(_) => Err(self.type_error("a step cannot be assigned", target.span)),
        }
    }

    /// Sets `t.PT := T#3s`. The preset of a timer must be constant.
    fn preset(&mut self, frame: FrameId, target: &ast::Expr, value: Option<&Value>) -> bool {
        let ast::ExprKind::Field(inner, field) = &target.kind else { return false };
        let Some(Value { kind: Kind::Time(Time::Constant(ns)), .. }) = value else { return false };
        let ast::ExprKind::Name(name) = &inner.kind else { return false };
        if field.id != "PT" {
            return false;
        }
        let Some(object) = self.object(frame, &name.id) else { return false };
        let inside = self.objects[object].frame;
        if !self.is_standard_object(object) || self.own(inside, "PT").is_none() {
            return false;
        }
        let given = Binding::Value(Value::time(*ns, target.span));
        let before = self.bind(inside, &field.id, given);
        let had_preset = std::mem::replace(&mut self.objects[object].has_preset, true);
        let changed = had_preset
            && matches!(before, Some(Binding::Value(Value { kind: Kind::Time(Time::Constant(before)), .. })) if before != *ns);
        if changed {
            self.report(
                Diagnostic::error(
                    codes::ST_TIMER,
                    format!("PT of `{name}` is assigned two values"),
                )
                .at(target.span, "second value")
                .help("use two timers"),
            );
        }
        true
    }

    pub(super) fn assign(
        &mut self,
        place: &Place,
        value: Value,
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let mut value = self.fit(value, &place.ty, &format!("`{}`", place.name))?;
        if place.ty == Ty::Time {
            value.expr = self.stored_time(place, value.clone())?;
        }
        let target = self.path(place, self.at(place.name.span));
        let kind = StmtKind::Assign { target, index: place.index.clone(), value: value.expr };
        out.push(Stmt { kind, span });
        Ok(())
    }
}

/// Adds the choice between branches, unless one of the conditions is invalid.
fn chosen(
    arms: Vec<(Outcome<Expr>, Block)>,
    rest: Block,
    span: Span,
    out: &mut Block,
) -> Outcome<()> {
    let arms = arms.into_iter().map(|(condition, then)| Ok((condition?, then)));
    choose(arms.collect::<Outcome<Vec<_>>>()?, rest, span, out);
    Ok(())
}

/// Adds a choice of the first branch whose condition is true, otherwise `rest`. Conditions have no side effects, so many branches become a
/// binary search.
fn choose(mut arms: Vec<(Expr, Block)>, rest: Block, span: Span, out: &mut Block) {
    if arms.len() > MANY_ARMS {
        let right = arms.split_off(arms.len() / 2);
        let is_left = Expr::or(arms.iter().map(|(condition, _)| condition.clone()));
        // In the left half of the search, one condition is certainly true, so the last arm needs no condition.
        let last = arms.pop().map(|(_, list)| list).unwrap_or_default();
        let (mut then, mut otherwise) = (Block::new(), Block::new());
        choose(arms, last, span, &mut then);
        choose(right, rest, span, &mut otherwise);
        out.push(Stmt { kind: StmtKind::If { condition: is_left, then, otherwise }, span });
        return;
    }
    let mut otherwise = rest;
    for (condition, then) in arms.into_iter().rev() {
        if condition.is_true() {
            otherwise = then;
        } else if !condition.is_false() {
            let kind = StmtKind::If { condition, then, otherwise };
            otherwise = vec![Stmt { kind, span }];
        }
    }
    out.extend(otherwise);
}
