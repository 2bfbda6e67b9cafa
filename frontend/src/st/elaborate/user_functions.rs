//! Functions that the user declares: a call runs the body symbolically, with expressions as the values of variables.

use grafsynth_ir::Gather;
use std::collections::BTreeMap;

use grafsynth_ir::Span;
use grafsynth_ir::chart::Expr;
use grafsynth_ir::diag::{Diagnostic, ErrorReported, counted};

use super::context::{Binding, Elaborator, Frame, FrameId, MAX_CALLS, MAX_NODES, Outcome};
use super::jump_elimination;
use super::types::Ty;
use super::value::{Value, nodes, select};
use crate::codes;
use crate::st::ast::{self, Arg, Body, Flag, Pou, PouKind, Section, StmtKind, Var};
use crate::st::symbol::{Ident, Symbol};

impl Elaborator<'_> {
    /// The value of a function call. Runs the body symbolically: both branches of an IF are run, and a choice combines the results.
    pub(super) fn run_function(
        &mut self,
        frame: FrameId,
        index: usize,
        arguments: &[Arg],
        span: Span,
    ) -> Outcome<Value> {
        if self.calls.contains(&index) || self.calls.len() >= MAX_CALLS {
            let name = &self.library.pous[index].name;
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, format!("`{name}` calls itself"))
                    .at(span, "in this call")
                    .help("write a FOR loop instead of the recursion"),
            ));
        }
        let library = self.library;
        let pou = &library.pous[index];
        let PouKind::Function(Some(result)) = &pou.kind else {
            return Err(self.report(
                Diagnostic::error(codes::ST_CALL, format!("`{}` returns no value", pou.name))
                    .at(span, "expected a value")
                    .help(format!(
                        "declare its type, as in `FUNCTION {} : BOOL`, and assign {0} in its body",
                        pou.name
                    )),
            ));
        };
        for refusal in &pou.refused {
            self.report(refusal.diagnostic());
        }
        self.check_parameters(pou, arguments)?;
        let inside = self.new_frame();
        let result_type = self.ty(inside, result);
        let mut types: BTreeMap<Symbol, Ty> = BTreeMap::new();
        types.insert(pou.name.id.clone(), result_type.clone());
        let start = self.zero_value(&result_type, span)?;
        self.bind(inside, &pou.name.id, Binding::Value(start));
        self.bind_parameters(frame, inside, pou, arguments, span, &mut types)?;
        let Body::Statements(body) = &pou.body else {
            return Err(self.refused(
                "a function with a chart",
                pou.name.span,
                "make it a function block",
            ));
        };
        self.calls.push(index);
        self.frames[inside].flags = lowered(span);
        self.frames[inside].flags.insert(Flag::Returned, no(span));
        let list = self.without_returns(body, pou.name.span);
        let done = list.and_then(|(list, _)| self.run(inside, &types, &list));
        self.calls.pop();
        done?;
        match self.own(inside, &pou.name.id) {
            Some(Binding::Value(value)) => Ok(value.clone()),
            _ => Err(ErrorReported),
        }
    }

    /// Declares the variables of a function, and gives its inputs the values of the arguments.
    fn bind_parameters(
        &mut self,
        frame: FrameId,
        inside: FrameId,
        pou: &Pou,
        arguments: &[Arg],
        span: Span,
        types: &mut BTreeMap<Symbol, Ty>,
    ) -> Outcome<()> {
        let mut position = 0;
        for var in &pou.vars {
            let ty = self.ty(inside, &var.ty);
            let key = &var.name.id;
            let mut value = self.first_value(inside, var, &ty)?;
            if matches!(var.section, Section::InOut | Section::Output) {
                return Err(self.refused(
                    "functions that change their arguments",
                    var.name.span,
                    "make it a function block",
                ));
            }
            if var.section == Section::Input {
                let given = arguments
                    .iter()
                    .find(|one| one.is_for(key))
                    .or_else(|| arguments.get(position).filter(|one| one.name.is_none()));
                position += 1;
                if let Some(argument) = given {
                    let argument = self.value(frame, &argument.value)?;
                    value = self.fit(argument, &ty, &format!("`{}`", var.name))?;
                }
            }
            types.insert(key.clone(), ty);
            self.bind(inside, key, Binding::Value(value));
        }
        if arguments.len() > position {
            return Err(self.report(
                Diagnostic::error(
                    codes::ST_CALL,
                    format!(
                        "`{}` takes {}, found {}",
                        pou.name,
                        counted(position, "argument", "arguments"),
                        arguments.len()
                    ),
                )
                .at(span, "")
                .help(format!(
                    "remove {}",
                    counted(arguments.len() - position, "argument", "arguments")
                )),
            ));
        }
        Ok(())
    }

    /// Checks that each named argument names an input.
    fn check_parameters(&mut self, pou: &Pou, arguments: &[Arg]) -> Outcome<()> {
        let is_input = |name: &Ident| {
            let mut inputs = pou.vars.iter().filter(|var| var.section == Section::Input);
            inputs.any(|var| var.name.id == name.id)
        };
        let mut named = arguments.iter().filter_map(|one| one.name.as_ref());
        if let Some(unknown) = named.find(|name| !is_input(name)) {
            let known: Vec<&str> = pou
                .vars
                .iter()
                .filter(|var| var.section == Section::Input)
                .map(|var| var.name.text.as_str())
                .collect();
            return Err(self.no_parameter(&pou.name, unknown, &known.join(", ")));
        }
        Ok(())
    }

    /// The value of a variable of a function when a call begins.
    fn first_value(&mut self, inside: FrameId, var: &Var, ty: &Ty) -> Outcome<Value> {
        match &var.init {
            Some(init) if *ty == Ty::Time => match init {
                ast::Init::Value(init) => self.value(inside, init),
                ast::Init::List(_, span) | ast::Init::Fields(_, span) => {
                    Err(self.type_error("expected a time", *span))
                }
            },
            Some(init) => {
                let expr = self.initial(inside, ty, init)?.pop().ok_or(ErrorReported)?;
                Ok(Value::literal(expr))
            }
            None => self.zero_value(ty, var.name.span),
        }
    }

    pub(super) fn zero_value(&mut self, ty: &Ty, span: Span) -> Outcome<Value> {
        match ty {
            Ty::Bool => Ok(Value::constant(false, span)),
            Ty::Int { lo, hi, .. } => Ok(Value::int(0.clamp(*lo, *hi), span)),
            Ty::Time => Ok(Value::time(0, span)),
            Ty::Broken => Err(ErrorReported),
            Ty::Array(..) | Ty::Block(_) | Ty::Struct(_) => Err(self.refused(
                "arrays, structures and blocks in functions",
                span,
                "use simple variables, or make it a function block",
            )),
        }
    }

    fn run(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<Symbol, Ty>,
        list: &[ast::Stmt],
    ) -> Outcome<()> {
        for stmt in list {
            self.run_one(frame, types, stmt)?;
        }
        Ok(())
    }

    fn run_one(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<Symbol, Ty>,
        stmt: &ast::Stmt,
    ) -> Outcome<()> {
        self.spend(stmt.span, 1)?;
        match &stmt.kind {
            StmtKind::Assign { target, value } => {
                let value = self.value(frame, value)?;
                if let ast::ExprKind::Flag(flag) = target.kind {
                    self.frames[frame].flags.insert(flag, Binding::Value(value));
                    return Ok(());
                }
                let ast::ExprKind::Name(name) = &target.kind else {
                    return Err(self.refused(
                        "assignments to parts of variables in functions",
                        target.span,
                        "use simple variables",
                    ));
                };
                let Some(ty) = types.get(&name.id) else {
                    return Err(self.report(
                        Diagnostic::error(
                            codes::ST_CALL,
                            format!("a function cannot change `{name}`, which it does not declare"),
                        )
                        .at(target.span, "")
                        .help("make it a function block"),
                    ));
                };
                let value = self.fit(value, ty, &format!("`{name}`"))?;
                if nodes(&value.expr, MAX_NODES) >= MAX_NODES {
                    return Err(self.too_much(stmt.span));
                }
                self.bind(frame, &name.id, Binding::Value(value));
                Ok(())
            }
            StmtKind::If { arms, otherwise } => {
                self.run_arms(frame, types, arms, otherwise, stmt.span)
            }
            StmtKind::Case { selector, arms, otherwise } => {
                let selector = self.value(frame, selector)?;
                let (mut tested, mut taken) = (Vec::new(), Vec::new());
                for (labels, list) in arms {
                    let condition = self.label_test(frame, &selector, labels, &mut taken)?;
                    tested.push((condition, list.as_slice()));
                }
                self.run_tested(frame, types, &tested, otherwise, stmt.span)
            }
            StmtKind::For { var, from, to, by, body } => {
                if !types.contains_key(&var.id) {
                    let candidates: Vec<String> = types.keys().map(Symbol::to_string).collect();
                    let help = "declare it in the function";
                    return Err(self.unknown("variable", var, &candidates, help));
                }
                let values = self.loop_values(frame, from, to, by.as_ref(), stmt.span)?;
                self.count_rounds(frame, &values, body, stmt.span)?;
                self.run_loop(frame, types, var, &values, body, stmt.span)
            }
            StmtKind::While { .. } | StmtKind::Repeat { .. } => Err(self.unbounded(stmt.span)),
            StmtKind::Call { target, .. } => Err(self.refused(
                "calls of blocks in functions",
                target.span,
                "make it a function block",
            )),
            StmtKind::Exit | StmtKind::Continue | StmtKind::Return => Err(self.leaves(stmt.span)),
            StmtKind::Refused(_) => Err(ErrorReported),
        }
    }

    /// Runs the iterations of a loop. If EXIT leaves the loop, its variable keeps its current value.
    fn run_loop(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<Symbol, Ty>,
        var: &Ident,
        rounds: &super::statements::Rounds,
        body: &[ast::Stmt],
        span: Span,
    ) -> Outcome<()> {
        let body = jump_elimination::round(body, var);
        let mut outer = self.frames[frame].flags.clone();
        self.frames[frame].flags.extend(lowered(span));
        for value in &rounds.each {
            self.spend(span, 1)?;
            let value = Value::int(*value, var.span);
            self.bind(frame, &var.id, Binding::Value(value));
            self.frames[frame].flags.insert(Flag::Skipped, no(span));
            self.run(frame, types, &body)?;
        }
        let mut last = Value::int(rounds.after, var.span);
        let flags = &mut self.frames[frame].flags;
        if let (Some(Binding::Value(left)), Some(Binding::Value(kept))) =
            (flags.get(&Flag::Left), flags.get(&Flag::Variable))
        {
            last = select(left.expr.clone(), kept.clone(), last, span);
        }
        // RETURN leaves the outer loops too.
        outer.extend(flags.remove_entry(&Flag::Returned));
        *flags = outer;
        self.bind(frame, &var.id, Binding::Value(last));
        Ok(())
    }

    fn run_arms(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<Symbol, Ty>,
        arms: &[(ast::Expr, Vec<ast::Stmt>)],
        otherwise: &[ast::Stmt],
        span: Span,
    ) -> Outcome<()> {
        if let [(condition, list)] = arms
            && let Some(flags) = jump_elimination::guards(condition)
        {
            return self.run_guarded(frame, types, &flags, list, span);
        }
        let mut tested = Vec::new();
        for (condition, list) in arms {
            tested.push((self.condition(frame, condition)?, list.as_slice()));
        }
        self.run_tested(frame, types, &tested, otherwise, span)
    }

    /// Runs a list under the condition that no flag is set. Inside the list all flags are false; afterwards each flag is the OR of its
    /// previous and its new value. So the expression of a flag grows linearly, not exponentially, with the number of statements that set
    /// it.
    fn run_guarded(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<Symbol, Ty>,
        flags: &[Flag],
        list: &[ast::Stmt],
        span: Span,
    ) -> Outcome<()> {
        let before: Frame = self.frames[frame].clone();
        let free = |flag: &Flag| match before.flags.get(flag) {
            Some(Binding::Value(value)) => value.expr.clone().not(),
            _ => Expr::bool(true),
        };
        let condition = Expr::and(flags.iter().map(free));
        if condition.is_false() {
            return Ok(());
        }
        for flag in flags {
            self.frames[frame].flags.insert(*flag, no(span));
        }
        self.run(frame, types, list)?;
        let mut after = std::mem::replace(&mut self.frames[frame], before.clone());
        let mut raised = Vec::new();
        for flag in flags {
            if let (Some(Binding::Value(then)), Some(Binding::Value(other))) =
                (after.flags.remove(flag), before.flags.get(flag))
            {
                let others = flags.iter().filter(|one| *one != flag).map(free);
                let now = Expr::and(others.chain([then.expr]));
                raised.push((*flag, Expr::or([other.expr.clone(), now])));
            }
        }
        self.merge(frame, types, &condition, &after, span)?;
        for (flag, expr) in raised {
            if nodes(&expr, MAX_NODES) >= MAX_NODES {
                return Err(self.too_much(span));
            }
            self.frames[frame].flags.insert(flag, Binding::Value(Value::bool(expr)));
        }
        Ok(())
    }

    /// Chooses the values in `then` if the condition is true, otherwise those in the frame.
    fn merge(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<Symbol, Ty>,
        condition: &Expr,
        then: &Frame,
        span: Span,
    ) -> Outcome<()> {
        for key in types.keys() {
            let other = self.own(frame, key).cloned();
            if let Some(chosen) = self.merged(condition, then.names.get(key), other, span)? {
                self.bind(frame, key, chosen);
            }
        }
        for (flag, binding) in &then.flags {
            let other = self.frames[frame].flags.get(flag).cloned();
            if let Some(chosen) = self.merged(condition, Some(binding), other, span)? {
                self.frames[frame].flags.insert(*flag, chosen);
            }
        }
        Ok(())
    }

    fn merged(
        &mut self,
        condition: &Expr,
        then: Option<&Binding>,
        other: Option<Binding>,
        span: Span,
    ) -> Outcome<Option<Binding>> {
        let (Some(Binding::Value(then)), Some(Binding::Value(other))) = (then, other) else {
            return Ok(None);
        };
        let chosen = self.choice(condition.clone(), then.clone(), other, span)?;
        if nodes(&chosen.expr, MAX_NODES) >= MAX_NODES {
            return Err(self.too_much(span));
        }
        Ok(Some(Binding::Value(chosen)))
    }

    /// Runs each list on a copy of the variables, and chooses between the results.
    fn run_tested(
        &mut self,
        frame: FrameId,
        types: &BTreeMap<Symbol, Ty>,
        arms: &[(Expr, &[ast::Stmt])],
        otherwise: &[ast::Stmt],
        span: Span,
    ) -> Outcome<()> {
        let before: Frame = self.frames[frame].clone();
        let mut results = Vec::new();
        for (condition, list) in arms {
            self.frames[frame] = before.clone();
            self.run(frame, types, list)?;
            results.push((condition.clone(), self.frames[frame].clone()));
        }
        self.frames[frame] = before;
        self.run(frame, types, otherwise)?;
        for (condition, result) in results.into_iter().rev() {
            self.merge(frame, types, &condition, &result, span)?;
        }
        Ok(())
    }
}

fn no(span: Span) -> Binding {
    Binding::Value(Value::constant(false, span))
}

/// The flags of a loop at its start, all false.
fn lowered(span: Span) -> BTreeMap<Flag, Binding> {
    let start = Binding::Value(Value::int(0, span));
    [(Flag::Left, no(span)), (Flag::Skipped, no(span)), (Flag::Variable, start)]
        .into_iter()
        .gather()
}
