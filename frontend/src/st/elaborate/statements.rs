//! Statements of actions, programs and function blocks as lists of the chart.

use grafsynth_ir::chart::{Block, Expr, Stmt, StmtKind};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{CompareOp, ExprKind};
use grafsynth_ir::net::Meta;
use grafsynth_ir::{Name, Span};

use super::leave::{self, LEFT, Leaves, RETURNED, SKIPPED, VARIABLE};
use super::types::Ty;
use super::usage::upper;
use super::value::{Kind, Time, Value};
use super::{Access, Binding, Elaborator, FrameId, ObjectKind, Outcome, Place, Told};
use crate::codes;
use crate::st::ast::{self, Arg, Body, Section};

/// How many rounds one loop may have.
const MAX_ROUNDS: i64 = 65_536;
/// Arms of an IF or CASE beyond which they are searched by halves, so that no list lies too deep.
const MANY_ARMS: usize = 12;

/// The rounds of a FOR.
pub(super) struct Rounds {
    pub(super) each: Vec<i64>,
    /// The variable's value behind the loop.
    pub(super) after: i64,
}

impl Elaborator<'_> {
    /// Statements in order; what is wrong in one is reported and the statement left out.
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
        let span = stmt.span;
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
            // One function for each form: the stack of nested statements is the sum of their frames.
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
            ast::StmtKind::Refused(_) => Err(Told),
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
            let mut then = Block::new();
            self.list(frame, list, &mut then);
            lowered.push((condition, then));
        }
        let mut rest = Block::new();
        self.list(frame, otherwise, &mut rest);
        chosen(lowered, rest, span, out)
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
        for (labels, list) in arms {
            let condition = match selector {
                Ok(selector) => self.label_test(frame, selector, labels),
                Err(told) => Err(*told),
            };
            let mut then = Block::new();
            self.list(frame, list, &mut then);
            lowered.push((condition, then));
        }
        let mut rest = Block::new();
        self.list(frame, otherwise, &mut rest);
        chosen(lowered, rest, span, out)
    }

    fn counted(
        &mut self,
        frame: FrameId,
        var: &Name,
        rounds: &Rounds,
        body: &[ast::Stmt],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let target = ast::Expr::name(var.clone());
        let place = self.place(frame, &target)?;
        let key = upper(&var.text);
        let exits = leave::has(body, Leaves::Exit);
        let left = exits.then(|| self.flag(frame, &format!("{var}.left"), span));
        let skipped = leave::has(body, Leaves::Continue)
            .then(|| self.flag(frame, &format!("{var}.skipped"), span));
        let flat = (left.is_some() || skipped.is_some()).then(|| leave::round(body, var));
        let body = flat.as_deref().unwrap_or(body);
        let bound = [
            (LEFT, left.clone()),
            (SKIPPED, skipped.clone()),
            (VARIABLE, exits.then(|| place.clone())),
        ];
        let outside = self.bind(frame, bound);
        let outer = self.frames[frame].names.get(&key).cloned();
        for value in &rounds.each {
            // Loops in loops go on for ever where nothing is written out any more.
            if self.spend(span, 1).is_err() {
                break;
            }
            let value = Value::int(*value, var.span);
            self.frames[frame].names.insert(key.clone(), Binding::Value(value));
            self.list(frame, body, out);
            if let Some(skipped) = &skipped {
                self.assign(skipped, Value::constant(false, span), span, out)?;
            }
        }
        self.unbind(frame, outside);
        match outer {
            Some(outer) => self.frames[frame].names.insert(key, outer),
            None => self.frames[frame].names.remove(&key),
        };
        let after = Value::int(rounds.after, var.span);
        let Some(left) = left else { return self.assign(&place, after, span, out) };
        let condition = self.read(Access::Place(left.clone()), span)?.expr.not();
        let mut then = Block::new();
        self.assign(&place, after, span, &mut then)?;
        let kind = StmtKind::If { condition, then, otherwise: Block::new() };
        out.push(Stmt { kind, span });
        self.assign(&left, Value::constant(false, span), span, out)
    }

    /// A Boolean variable for what stands at `span`, the same one each time.
    fn flag(&mut self, frame: FrameId, name: &str, span: Span) -> Place {
        let key = format!("#{name}@{}", span.start);
        if let Some(Binding::Place(place)) = self.frames[frame].names.get(&key) {
            return place.clone();
        }
        let name = Name::new(self.free_name(name), span);
        self.declare_var(frame, &key, name.clone(), &Ty::Bool, Vec::new(), Meta::default());
        Place { name, chart: self.chart, index: None, ty: Ty::Bool }
    }

    /// Gives names to places; what they stood for before.
    fn bind<const N: usize>(
        &mut self,
        frame: FrameId,
        places: [(&'static str, Option<Place>); N],
    ) -> [(&'static str, Option<Binding>); N] {
        let names = &mut self.frames[frame].names;
        places.map(|(name, place)| {
            let before = match place {
                Some(place) => names.insert(name.to_owned(), Binding::Place(place)),
                None => names.remove(name),
            };
            (name, before)
        })
    }

    fn unbind<const N: usize>(
        &mut self,
        frame: FrameId,
        before: [(&'static str, Option<Binding>); N],
    ) {
        let names = &mut self.frames[frame].names;
        for (name, binding) in before {
            match binding {
                Some(binding) => names.insert(name.to_owned(), binding),
                None => names.remove(name),
            };
        }
    }

    /// The statements of a unit or action, from which RETURN leads out.
    pub(super) fn body(&mut self, frame: FrameId, list: &[ast::Stmt], span: Span, out: &mut Block) {
        let Ok((list, is_flagged)) = self.without_returns(list, span) else { return };
        if !is_flagged {
            self.list(frame, &list, out);
            return;
        }
        let place = self.flag(frame, "returned", span);
        let outside = self.bind(frame, [(RETURNED, Some(place.clone()))]);
        self.list(frame, &list, out);
        self.unbind(frame, outside);
        let _ = self.assign(&place, Value::constant(false, span), span, out);
    }

    /// Says at once that the rounds of a loop become too much, as far as the bounds of the loops in it are known.
    pub(super) fn count_rounds(
        &mut self,
        frame: FrameId,
        rounds: &Rounds,
        body: &[ast::Stmt],
        span: Span,
    ) -> Outcome<()> {
        let amount = self.weight(frame, body).saturating_mul(rounds.each.len());
        if self.spent.saturating_add(amount) > super::BUDGET {
            return self.spend(span, amount);
        }
        Ok(())
    }

    /// The statements that a list becomes at least.
    fn weight(&self, frame: FrameId, list: &[ast::Stmt]) -> usize {
        let sum = |lists: &mut dyn Iterator<Item = usize>| lists.fold(1, usize::saturating_add);
        let each = list.iter().map(|stmt| match &stmt.kind {
            ast::StmtKind::If { arms, otherwise } => {
                let inside = arms.iter().map(|(_, list)| self.weight(frame, list));
                sum(&mut inside.chain([self.weight(frame, otherwise)]))
            }
            ast::StmtKind::Case { arms, otherwise, .. } => {
                let inside = arms.iter().map(|(_, list)| self.weight(frame, list));
                sum(&mut inside.chain([self.weight(frame, otherwise)]))
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

    /// A number that is written out, or the name of one.
    fn known(&self, frame: FrameId, expr: &ast::Expr) -> Option<i64> {
        match &expr.kind {
            ast::ExprKind::Int(value) => Some(*value),
            ast::ExprKind::Name(name) => match self.lookup(frame, &name.text)? {
                Binding::Value(Value { kind: Kind::Int(lo, hi), .. }) if lo == hi => Some(lo),
                Binding::Value(_)
                | Binding::Place(_)
                | Binding::Object(_)
                | Binding::Step(_)
                | Binding::Broken => None,
            },
            ast::ExprKind::Bool(_)
            | ast::ExprKind::Time(_)
            | ast::ExprKind::Field(..)
            | ast::ExprKind::Bit(..)
            | ast::ExprKind::Index(..)
            | ast::ExprKind::Address(_)
            | ast::ExprKind::Not(_)
            | ast::ExprKind::Neg(_)
            | ast::ExprKind::Binary(..)
            | ast::ExprKind::And(_)
            | ast::ExprKind::Or(_)
            | ast::ExprKind::Call(..)
            | ast::ExprKind::Refused(_) => None,
        }
    }

    pub(super) fn unbounded(&mut self, span: Span) -> Told {
        self.report(
            Diagnostic::error(
                codes::ST_LOOP,
                "WHILE and REPEAT have no bound that is known before the program runs",
            )
            .at(span, "")
            .help("write FOR with constant bounds, or make each round a scan of a step"),
        )
    }

    pub(super) fn leaves(&mut self, span: Span) -> Told {
        self.report(
            Diagnostic::error(codes::ST_UNEXPECTED, "EXIT and CONTINUE stand in a loop")
                .at(span, "there is no loop around this"),
        )
    }

    pub(super) fn too_much(&mut self, span: Span) -> Told {
        self.report(
            Diagnostic::error(
                codes::ST_SIZE,
                "too much when loops, functions and blocks are written out",
            )
            .at(span, "here at the latest")
            .help("use shorter loops, or fewer instances"),
        )
    }

    /// The rounds of a loop whose bounds are constant.
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
                Diagnostic::error(codes::ST_LOOP, "a loop that steps by 0 never ends").at(span, ""),
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
                    format!("{rounds} rounds are more than the {MAX_ROUNDS} that are written out"),
                )
                .at(span, ""),
            ));
        }
        let rounds = i64::try_from(rounds).unwrap_or(0);
        let each: Vec<i64> = (0..rounds).map(|n| first.saturating_add(n * step)).collect();
        Ok(Rounds { each, after: first.saturating_add(rounds.saturating_mul(step)) })
    }

    /// True when the selector is one of the labels.
    pub(super) fn label_test(
        &mut self,
        frame: FrameId,
        selector: &Value,
        labels: &[(ast::Expr, Option<ast::Expr>)],
    ) -> Outcome<Expr> {
        let mut tests = Vec::new();
        for (low, high) in labels {
            let lo = self.constant_int(frame, low)?;
            let hi = match high {
                Some(high) => self.constant_int(frame, high)?,
                None => lo,
            };
            if !matches!(selector.kind, Kind::Int(..)) {
                return Err(self.type_error("CASE chooses by a number", selector.expr.span));
            }
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

    /// Where an assignment goes.
    pub(super) fn place(&mut self, frame: FrameId, target: &ast::Expr) -> Outcome<Place> {
        match self.access(frame, target)? {
            Access::Place(place) if self.inputs.contains(&upper(&place.name.text)) => {
                Err(self.report(
                    Diagnostic::error(codes::ST_TYPE, format!("{} is an input, which the program cannot assign", place.name))
                        .at(target.span, "")
                        .help("keep the value in a variable of its own"),
                ))
            }
            Access::Place(place) => Ok(place),
            Access::Value(value) if matches!(value.kind, Kind::Time(_)) => Err(self.report(
                Diagnostic::error(codes::ST_TIMER, "a TIME variable changes while the program runs")
                    .at(target.span, "assigned here")
                    .help("charts compare times with constants: choose between steps or timers with constant times"),
            )),
            Access::Value(_) => Err(self.report(
                Diagnostic::error(codes::ST_TYPE, "this is a constant, an input or the variable of a loop, which cannot be assigned")
                    .at(target.span, ""),
            )),
            Access::Object(_) => Err(self.type_error("a whole block or structure cannot be assigned", target.span)),
            Access::Step(_) => Err(self.type_error("a step cannot be assigned", target.span)),
        }
    }

    /// `t.PT := T#3s`: the preset of a timer is known before the program runs.
    fn preset(&mut self, frame: FrameId, target: &ast::Expr, value: Option<&Value>) -> bool {
        let ast::ExprKind::Field(inner, field) = &target.kind else { return false };
        let Some(Value { kind: Kind::Time(Time::Constant(ns)), .. }) = value else { return false };
        let ast::ExprKind::Name(name) = &inner.kind else { return false };
        if upper(&field.text) != "PT" {
            return false;
        }
        let Some(Binding::Object(object)) = self.lookup(frame, &name.text) else { return false };
        let changed = self.objects[object].preset.is_some_and(|before| before != *ns);
        self.objects[object].preset = Some(*ns);
        if changed {
            self.report(
                Diagnostic::error(codes::ST_TIMER, format!("PT of {name} gets two values"))
                    .at(target.span, "another one here")
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
        let mut value = self.fit(value, &place.ty, &place.name.text)?;
        if place.ty == Ty::Time {
            value.expr = self.stored_time(place, value.clone())?;
        }
        let target = self.path(place, place.name.span);
        let kind = StmtKind::Assign { target, index: place.index.clone(), value: value.expr };
        out.push(Stmt { kind, span });
        Ok(())
    }

    fn call(
        &mut self,
        frame: FrameId,
        target: &ast::Expr,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        if let ast::ExprKind::Name(name) = &target.kind
            && self.lookup(frame, &name.text).is_none()
        {
            return self.call_by_name(frame, name, arguments, span, out);
        }
        if let ast::ExprKind::Field(inner, name) = &target.kind
            && let Some(done) = self.call_action_of(frame, inner, name, arguments, span, out)
        {
            return done;
        }
        let Access::Object(object) = self.access(frame, target)? else {
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, "this is no function block")
                    .at(target.span, "called here"),
            ));
        };
        let kind = self.objects[object].kind;
        let arguments = self.named_arguments(kind, arguments, span)?;
        let enable = arguments
            .iter()
            .find(|one| {
                !one.is_output && one.name.as_ref().is_some_and(|name| upper(&name.text) == "EN")
            })
            .map(|one| self.condition(frame, &one.value));
        let enable = enable.transpose()?;
        let mut list = Block::new();
        match kind {
            ObjectKind::Standard(block) => {
                self.check_arguments(object, &arguments)?;
                self.call_block(frame, object, block, &arguments, span, &mut list)?;
            }
            ObjectKind::User(pou) => {
                self.check_arguments(object, &arguments)?;
                self.call_user(frame, object, pou, &arguments, span, &mut list)?;
            }
            ObjectKind::Struct => {
                return Err(self.report(
                    Diagnostic::error(codes::ST_CALL, "this is a structure, not a function block")
                        .at(target.span, "called here"),
                ));
            }
        }
        for argument in arguments.iter().filter(|one| one.is_output) {
            let Some(name) = &argument.name else { continue };
            if upper(&name.text) == "ENO" {
                let value = enable.clone().unwrap_or_else(|| Expr::bool(true));
                let place = self.place(frame, &argument.value)?;
                self.assign(&place, Value::bool(value), span, out)?;
                continue;
            }
            let value = self.output_of(object, name)?;
            let value = if argument.is_negated { Value::bool(value.expr.not()) } else { value };
            let place = self.place(frame, &argument.value)?;
            self.assign(&place, value, argument.value.span, &mut list)?;
        }
        match enable {
            Some(condition) => {
                let kind = StmtKind::If { condition, then: list, otherwise: Block::new() };
                out.push(Stmt { kind, span });
            }
            None => out.extend(list),
        }
        Ok(())
    }

    /// `instance.action();` runs a list of the instance's block on its variables. None where the block has no such action.
    fn call_action_of(
        &mut self,
        frame: FrameId,
        instance: &ast::Expr,
        name: &Name,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Option<Outcome<()>> {
        let key = upper(&name.text);
        let root = instance.root()?;
        let Some(Binding::Object(_)) = self.lookup(frame, &root.text) else { return None };
        let Ok(Access::Object(object)) = self.access(frame, instance) else { return None };
        let ObjectKind::User(index) = self.objects[object].kind else { return None };
        let pou = &self.library.pous[index];
        let in_chart = match &pou.body {
            Body::Sfc(chart) => chart.actions.as_slice(),
            Body::Statements(_) => &[],
        };
        if in_chart.iter().any(|one| upper(&one.name.text) == key) {
            return Some(Err(self.refused(
                &format!("a call of {name}, an action of a function block with a chart"),
                span,
                "let the block be the design, or make it a program that runs side by side",
            )));
        }
        let action = pou.actions.iter().find(|one| upper(&one.name.text) == key)?;
        if !arguments.is_empty() {
            return Some(Err(self.refused(
                &format!("a call of the action {name} with arguments"),
                span,
                "actions take none; assign to variables of the block before",
            )));
        }
        let inside = self.objects[object].frame;
        let outside = std::mem::replace(&mut self.bodies, super::bodies_of(&pou.actions));
        let done = self.call_body(inside, &key, name, &action.body, span, out);
        self.bodies = outside;
        Some(done)
    }

    /// The list of an action where it is called.
    fn call_body(
        &mut self,
        frame: FrameId,
        key: &str,
        name: &Name,
        list: &[ast::Stmt],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        // A body that calls itself would never end.
        let key = (frame, key.to_owned());
        if self.open_bodies.contains(&key) {
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, format!("{name} calls itself")).at(span, ""),
            ));
        }
        self.spend(span, 1)?;
        self.open_bodies.push(key);
        self.body(frame, list, span, out);
        self.open_bodies.pop();
        Ok(())
    }

    /// A call of something that is no instance: an action of the unit, a function for its effects, another program.
    fn call_by_name(
        &mut self,
        frame: FrameId,
        name: &Name,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let key = upper(&name.text);
        if let Some(list) = self.bodies.get(&key).cloned()
            && arguments.is_empty()
        {
            return self.call_body(frame, &key, name, &list, span, out);
        }
        if self.functions.contains_key(&key) {
            // Its value is not used; its arguments may still be wrong.
            return self.call_function(frame, name, arguments, span).map(|_| ());
        }
        if self.library.pous.iter().any(|pou| upper(&pou.name.text) == key) {
            return Err(self.refused(
                &format!("a call of the program {name}"),
                span,
                "call function blocks, and let programs run side by side",
            ));
        }
        let candidates = self.candidates(frame);
        Err(self.unknown(
            "function block",
            &name.text,
            name.span,
            &candidates,
            "declare an instance of it",
        ))
    }

    /// Arguments without names get those of the parameters.
    pub(super) fn named_arguments(
        &mut self,
        kind: ObjectKind,
        arguments: &[Arg],
        span: Span,
    ) -> Outcome<Vec<Arg>> {
        if arguments.iter().all(|one| one.name.is_some()) {
            return Ok(arguments.to_vec());
        }
        let order: Vec<(String, bool)> = match kind {
            ObjectKind::Standard(block) => {
                let order = block.order();
                order
                    .iter()
                    .map(|name| ((*name).to_owned(), block.canonical(name).is_none()))
                    .collect()
            }
            ObjectKind::User(pou) => self.library.pous[pou]
                .vars
                .iter()
                .filter(|var| {
                    matches!(var.section, Section::Input | Section::Output | Section::InOut)
                })
                .map(|var| (var.name.text.clone(), var.section == Section::Output))
                .collect(),
            ObjectKind::Struct => Vec::new(),
        };
        if arguments.len() > order.len() {
            return Err(self.report(
                Diagnostic::error(
                    codes::ST_CALL,
                    format!("{} arguments, the block has {}", arguments.len(), order.len()),
                )
                .at(span, ""),
            ));
        }
        let mut named = Vec::new();
        for (argument, (name, is_output)) in arguments.iter().zip(order) {
            let mut argument = argument.clone();
            if argument.name.is_none() {
                argument.is_output = is_output;
                argument.name = Some(Name::new(name, argument.value.span));
            }
            named.push(argument);
        }
        Ok(named)
    }

    /// Every argument names a parameter.
    pub(super) fn check_arguments(&mut self, object: usize, arguments: &[Arg]) -> Outcome<()> {
        let kind = self.objects[object].kind;
        let mut failed = Ok(());
        for argument in arguments {
            let Some(name) = &argument.name else { continue };
            let key = upper(&name.text);
            if matches!(key.as_str(), "EN" | "ENO") {
                continue;
            }
            let known: Vec<String> = match kind {
                ObjectKind::Standard(block) => {
                    if !argument.is_output && block.canonical(&key).is_some() {
                        continue;
                    }
                    block.order().iter().map(|name| (*name).to_owned()).collect()
                }
                ObjectKind::User(pou) => self.library.pous[pou]
                    .vars
                    .iter()
                    .filter(|var| match var.section {
                        Section::Input => !argument.is_output,
                        Section::Output => argument.is_output,
                        Section::InOut => true,
                        Section::Local | Section::Global | Section::External | Section::Temp => {
                            false
                        }
                    })
                    .map(|var| upper(&var.name.text))
                    .collect(),
                ObjectKind::Struct => Vec::new(),
            };
            if !known.contains(&key) {
                let what =
                    if argument.is_output { "output of the block" } else { "input of the block" };
                failed = Err(self.unknown(
                    what,
                    &name.text,
                    name.span,
                    &known,
                    "the block has no such parameter",
                ));
            }
        }
        failed
    }

    pub(super) fn output_of(&mut self, object: usize, name: &Name) -> Outcome<Value> {
        let frame = self.objects[object].frame;
        if let Some(value) = self.block_field(object, &upper(&name.text), name.span) {
            return value;
        }
        match self.frames[frame].names.get(&upper(&name.text)).cloned() {
            Some(Binding::Place(place)) => self.read(Access::Place(place), name.span),
            Some(Binding::Value(value)) => Ok(value),
            Some(Binding::Object(_) | Binding::Step(_) | Binding::Broken) | None => Err(Told),
        }
    }

    /// A function block of the file: its body stands where it is called, its variables are those of the instance.
    fn call_user(
        &mut self,
        frame: FrameId,
        object: usize,
        index: usize,
        arguments: &[Arg],
        span: Span,
        out: &mut Block,
    ) -> Outcome<()> {
        let library = self.library;
        let pou = &library.pous[index];
        let Body::Statements(body) = &pou.body else {
            return Err(self.refused(
                &format!("a call of {} here, a function block with a chart of its own", pou.name),
                span,
                "call it once in each scan, in a program that has no chart, RETURN or condition around the call; or make it a program that runs side by side",
            ));
        };
        let inside = self.objects[object].frame;
        let prefix = self.objects[object].prefix.clone();
        // All arguments are taken before the first of them changes anything.
        let mut taken = Vec::new();
        for var in &pou.vars {
            let key = upper(&var.name.text);
            let given = arguments.iter().find(|one| {
                one.name.as_ref().is_some_and(|name| upper(&name.text) == key)
                    && (!one.is_output || var.section == Section::InOut)
            });
            match (var.section, given) {
                (Section::Input, Some(argument)) => {
                    let value = self.value(frame, &argument.value)?;
                    let ty = self.ty(inside, &var.ty);
                    let value = self.fit(value, &ty, &var.name.text)?;
                    taken.push((key, var, ty, value));
                }
                (Section::InOut, Some(argument)) => {
                    let access = self.access(frame, &argument.value)?;
                    let binding = match access {
                        Access::Place(place) => Binding::Place(place),
                        Access::Object(object) => Binding::Object(object),
                        Access::Value(value) => Binding::Value(value),
                        Access::Step(step) => Binding::Step(step),
                    };
                    self.frames[inside].names.insert(key, binding);
                }
                (Section::InOut, None) => {
                    if !self.frames[inside].names.contains_key(&key) {
                        return Err(self.report(
                            Diagnostic::error(
                                codes::ST_CALL,
                                format!("the in-out parameter {} gets no variable", var.name),
                            )
                            .at(span, "in this call"),
                        ));
                    }
                }
                (
                    Section::Input
                    | Section::Local
                    | Section::Output
                    | Section::Global
                    | Section::External
                    | Section::Temp,
                    _,
                ) => {}
            }
        }
        for (key, var, ty, value) in taken {
            match self.frames[inside].names.get(&key).cloned() {
                Some(Binding::Place(place)) => self.assign(&place, value, span, out)?,
                Some(Binding::Value(_)) | None if self.is_steady(&value) => {
                    self.frames[inside].names.insert(key, Binding::Value(value));
                }
                Some(Binding::Value(_)) | None => {
                    if let Kind::Time(Time::Varying(_)) = value.kind {
                        return Err(self.report(
                            Diagnostic::error(
                                codes::ST_TIMER,
                                format!("{} gets a TIME variable that changes", var.name),
                            )
                            .at(value.expr.span, "in this call")
                            .help("declare the parameter VAR_IN_OUT, or give a constant"),
                        ));
                    }
                    if matches!(value.kind, Kind::Time(_)) {
                        self.frames[inside].names.insert(key, Binding::Value(value));
                        continue;
                    }
                    let name = Name::new(format!("{prefix}.{}", var.name), var.name.span);
                    self.declare_var(inside, &key, name, &ty, Vec::new(), Meta::default());
                    if let Some(Binding::Place(place)) =
                        self.frames[inside].names.get(&key).cloned()
                    {
                        self.assign(&place, value, span, out)?;
                    }
                }
                Some(Binding::Object(_) | Binding::Step(_) | Binding::Broken) => return Err(Told),
            }
        }
        for var in pou.vars.iter().filter(|var| var.section == Section::Temp) {
            if let Some(Binding::Place(place)) =
                self.frames[inside].names.get(&upper(&var.name.text)).cloned()
                && place.index.is_none()
                && let Some(ty) = place.ty.simple()
            {
                let value = match ty {
                    grafsynth_ir::expr::Type::Bool => Value::constant(false, span),
                    ty @ grafsynth_ir::expr::Type::Int { .. } => Value::int(ty.saturate(0), span),
                };
                self.assign(&place, value, span, out)?;
            }
        }
        let outside = std::mem::replace(&mut self.bodies, super::bodies_of(&pou.actions));
        let done = self.call_body(inside, "", &pou.name, body, span, out);
        self.bodies = outside;
        done
    }

    /// True for a value that nothing changes within a scan: constants, inputs, steps.
    fn is_steady(&self, value: &Value) -> bool {
        let mut steady = true;
        value.expr.for_each_leaf(&mut |leaf| {
            if let grafsynth_ir::chart::Leaf::Name(path) = leaf {
                let first = path.names.first().map(|name| upper(&name.text)).unwrap_or_default();
                steady &= path.names.len() > 1
                    && path
                        .names
                        .last()
                        .is_some_and(|last| matches!(last.text.as_str(), "active" | "t" | "T"))
                    || self.inputs.contains(&first);
            }
        });
        steady
    }
}

/// The choice between arms, unless the condition of one is wrong.
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

/// The first arm whose condition holds, else `rest`. Conditions have no effects, so many arms are searched by halves.
fn choose(mut arms: Vec<(Expr, Block)>, rest: Block, span: Span, out: &mut Block) {
    if arms.len() > MANY_ARMS {
        let right = arms.split_off(arms.len() / 2);
        let is_left = Expr::or(arms.iter().map(|(condition, _)| condition.clone()));
        // In the left half one of the conditions holds, so its last arm needs none.
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
