//! Expressions: resolves names to values of the net, converts times to ticks, edges and delays to operands and timers, and checks types.

use super::codes;
use super::context::{Alias, AliasValue, Lowering, Outcome, Role, ScopeId, Symbol, Value};
use super::names::{Attribute, Resolved, StepLike};
use super::place::{Place, Target};
use crate::chart::{Expr as Syntax, Leaf as SyntaxLeaf, Path};
use crate::diag::{Diagnostic, ErrorReported};
use crate::duration;
use crate::expr::{Expr, ExprKind, Type};
use crate::interval::{self, NetLeaves, TypeError, TypeErrorKind};
use crate::net::{EdgeOperand, InputKind, Leaf, OutputId, StepId};
use crate::span::Span;

/// The depth limit of expressions: the limit of the chart language plus room for what front ends add.
const MAX_DEPTH: usize = 300;
/// Limit of the transitions that all `otherwise` of a design may refer to.
const MAX_OTHERWISE: usize = 4_000_000;
/// Limit of the uses of parameters that are replaced by arguments of library charts.
const MAX_MENTIONS: usize = 300_000;

impl Lowering<'_> {
    /// Lowers a condition, which must be Boolean.
    pub(super) fn condition<L: Target>(
        &mut self,
        syntax: &Syntax,
        place: &Place<'_>,
    ) -> Outcome<Expr<L>>
    where
        for<'n> NetLeaves<'n>: interval::Leaves<L>,
    {
        let expr = self.expression::<L>(syntax, place)?;
        match self.type_of(&expr)? {
            Type::Bool => Ok(expr),
            Type::Int { lo, hi } => {
                let kind = TypeErrorKind::BoolExpected { lo, hi };
                Err(self.report_type(&TypeError { span: expr.span, kind }))
            }
        }
    }

    /// Lowers an expression; returns it with its type.
    pub(super) fn typed(
        &mut self,
        syntax: &Syntax,
        place: &Place<'_>,
    ) -> Outcome<(Expr<Leaf>, Type)> {
        let expr = self.expression::<Leaf>(syntax, place)?;
        let ty = self.type_of(&expr)?;
        Ok((expr, ty))
    }

    fn type_of<L: Target>(&mut self, expr: &Expr<L>) -> Outcome<Type>
    where
        for<'n> NetLeaves<'n>: interval::Leaves<L>,
    {
        let found = interval::check(expr, &mut NetLeaves(&self.net));
        found.map_err(|error| self.report_type(&error))
    }

    pub(super) fn report_type(&mut self, error: &TypeError) -> ErrorReported {
        let code = match error.kind {
            TypeErrorKind::IndexOutOfArray { .. }
            | TypeErrorKind::ArrayWithoutIndex
            | TypeErrorKind::NotAnArray => codes::ARRAY,
            TypeErrorKind::DurationAlone | TypeErrorKind::DurationNegative { .. } => {
                codes::TIME_ALONE
            }
            TypeErrorKind::BoolExpected { .. }
            | TypeErrorKind::IntExpected
            | TypeErrorKind::Mixed
            | TypeErrorKind::Overflow64 { .. }
            | TypeErrorKind::DivisorMayBeZero { .. }
            | TypeErrorKind::ShiftOutOfRange { .. }
            | TypeErrorKind::Dangling
            | TypeErrorKind::DurationTooLong { .. }
            | TypeErrorKind::NotReadableHere { .. }
            | TypeErrorKind::TooDeep => codes::TYPE,
        };
        let mut finding = Diagnostic::error(code, error.kind.to_string()).at(error.span, "");
        if let Some(help) = error.kind.help() {
            finding = finding.help(help);
        }
        self.report(finding)
    }

    /// The value of a constant expression.
    pub(super) fn constant_value(&mut self, scope: ScopeId, syntax: &Syntax) -> Outcome<Value> {
        if let Some(ns) = self.duration_constant(scope, syntax) {
            return Ok(Value::Duration(ns));
        }
        let place = Place { constant: true, ..Place::level(scope, "a constant") };
        let (expr, ty) = self.typed(syntax, &place)?;
        match (expr.as_constant(), ty) {
            (Some(value), Type::Bool) => Ok(Value::Bool(value != 0)),
            (Some(value), Type::Int { .. }) => Ok(Value::Int(value)),
            (None, _) => Err(self.report(
                Diagnostic::error(codes::CONSTANT_NEEDED, "this is not a constant expression")
                    .at(syntax.span, "a constant is needed here")
                    .help("use only numbers, `true`, `false` and names declared with `const`"),
            )),
        }
    }

    /// The expression with its names resolved; every unknown name in it is reported, not only the first.
    pub(super) fn expression<L: Target>(
        &mut self,
        syntax: &Syntax,
        place: &Place<'_>,
    ) -> Outcome<Expr<L>> {
        if self.expression_depth >= MAX_DEPTH {
            let kind = TypeErrorKind::TooDeep;
            return Err(self.report_type(&TypeError { span: syntax.span, kind }));
        }
        self.expression_depth += 1;
        let result = self.expression_inside(syntax, place);
        self.expression_depth -= 1;
        result
    }

    fn expression_inside<L: Target>(
        &mut self,
        syntax: &Syntax,
        place: &Place<'_>,
    ) -> Outcome<Expr<L>> {
        let span = syntax.span;
        let kind = match &syntax.kind {
            ExprKind::Bool(value) => ExprKind::Bool(*value),
            ExprKind::Int(value) => ExprKind::Int(*value),
            ExprKind::Leaf(leaf) => return self.leaf(leaf, span, place),
            ExprKind::Element(leaf, index) => {
                let array = self.array(leaf, span, place);
                let index = self.expression(index, place);
                ExprKind::Element(L::of_net(array?), Box::new(index?))
            }
            ExprKind::Not(a) => ExprKind::Not(Box::new(self.expression(a, place)?)),
            ExprKind::And(all) => ExprKind::And(self.all(all, place)?),
            ExprKind::Or(all) => ExprKind::Or(self.all(all, place)?),
            ExprKind::Compare(op, a, b) => return self.comparison(*op, a, b, span, place),
            ExprKind::Neg(a) => ExprKind::Neg(Box::new(self.expression(a, place)?)),
            ExprKind::Arith(op, a, b) => {
                let (a, b) = (self.expression(a, place), self.expression(b, place));
                ExprKind::Arith(*op, Box::new(a?), Box::new(b?))
            }
            ExprKind::Select(c, a, b) => {
                let c = self.expression(c, place);
                let (a, b) = (self.expression(a, place), self.expression(b, place));
                ExprKind::Select(Box::new(c?), Box::new(a?), Box::new(b?))
            }
        };
        Ok(Expr::new(kind, span))
    }

    fn all<L: Target>(&mut self, all: &[Syntax], place: &Place<'_>) -> Outcome<Vec<Expr<L>>> {
        // Collected first, so that every operand is checked even if an earlier one has an error.
        let lowered: Vec<Outcome<Expr<L>>> =
            all.iter().map(|one| self.expression(one, place)).collect();
        lowered.into_iter().collect()
    }

    fn leaf<L: Target>(
        &mut self,
        leaf: &SyntaxLeaf,
        span: Span,
        place: &Place<'_>,
    ) -> Outcome<Expr<L>> {
        match leaf {
            SyntaxLeaf::Name(path) => self.value(path, span, place),
            SyntaxLeaf::Rise(operand) => self.edge(operand, span, place, Leaf::Rise),
            SyntaxLeaf::Fall(operand) => self.edge(operand, span, place, Leaf::Fall),
            SyntaxLeaf::Otherwise => self.otherwise(span, place),
            SyntaxLeaf::Duration(ns) => Err(self.report(
                Diagnostic::error(
                    codes::TIME_ALONE,
                    format!("{} must be compared with the time of a step or timer", duration(*ns)),
                )
                .at(span, "")
                .help("write a comparison such as `s.t >= 3 s`"),
            )),
            SyntaxLeaf::Delay(on, operand, off) => self.delay(*on, operand, *off, span, place),
        }
    }

    /// The array that an element belongs to.
    fn array(&mut self, leaf: &SyntaxLeaf, span: Span, place: &Place<'_>) -> Outcome<Leaf> {
        let SyntaxLeaf::Name(path) = leaf else {
            return Err(self.report_type(&TypeError { span, kind: TypeErrorKind::NotAnArray }));
        };
        match self.resolve(place.scope, path)? {
            Resolved::Symbol(Symbol::Var(var)) if place.constant => {
                Err(self.not_constant(path, Symbol::Var(var)))
            }
            Resolved::Symbol(Symbol::Var(var)) => Ok(Leaf::Var(var)),
            Resolved::Symbol(symbol) => Err(self.wrong_kind(path.span(), path, symbol, "an array")),
            Resolved::Attribute(..) => {
                Err(self.report_type(&TypeError { span, kind: TypeErrorKind::NotAnArray }))
            }
        }
    }

    fn not_constant(&mut self, path: &Path, symbol: Symbol) -> ErrorReported {
        let kind = self.kind(symbol);
        self.report(
            Diagnostic::error(
                codes::CONSTANT_NEEDED,
                format!("expected a constant, but `{path}` is {kind}"),
            )
            .at(path.span(), "its value is not known before the chart runs")
            .help("write a number, or a name declared with `const` above"),
        )
    }

    /// The value of a name.
    fn value<L: Target>(&mut self, path: &Path, span: Span, place: &Place<'_>) -> Outcome<Expr<L>> {
        let resolved = match self.peek(place.scope, path) {
            Some(found) => found,
            None => {
                self.left = place.otherwise.unwrap_or_default().to_vec();
                self.resolve(place.scope, path)?
            }
        };
        let symbol = match resolved {
            Resolved::Symbol(symbol) => symbol,
            Resolved::Attribute(like, attribute) => {
                if place.constant {
                    return Err(self.report(
                        Diagnostic::error(
                            codes::CONSTANT_NEEDED,
                            format!("`{path}` is not a constant"),
                        )
                        .at(span, "its value is not known before the chart runs")
                        .help("write a value, or the name of a `const`"),
                    ));
                }
                return self.attribute_value(path, like, attribute, span);
            }
        };
        if place.constant && !matches!(symbol, Symbol::Const(_)) {
            return Err(self.not_constant(path, symbol));
        }
        let leaf = match symbol {
            Symbol::Const(Value::Bool(value)) => return Ok(Expr::new(ExprKind::Bool(value), span)),
            Symbol::Const(Value::Int(value)) => return Ok(Expr::new(ExprKind::Int(value), span)),
            Symbol::Const(Value::Duration(_)) | Symbol::Timer(_) => {
                return Err(self.time_alone(path));
            }
            Symbol::Input(input) => {
                if self.net.inputs[input].kind.is_event() {
                    self.event_here(path, input, place)?;
                }
                Leaf::Input(input)
            }
            Symbol::Var(var) => Leaf::Var(var),
            Symbol::Output(output) => return self.output_value(path, output, span),
            Symbol::Action(action) => match self.drawn_actions[action].id {
                Some(id) => Leaf::Controlled(id),
                None => return Err(self.already_told()),
            },
            Symbol::Step(step) if self.counted.contains_key(&step) => {
                Leaf::Var(self.counted[&step])
            }
            Symbol::Step(_) | Symbol::MacroStep(_) => {
                let kind = symbol.kind();
                return Err(self.report(
                    Diagnostic::error(
                        codes::WRONG_KIND,
                        format!(
                            "{} `{path}` cannot be used as a value",
                            kind.trim_start_matches("a ")
                        ),
                    )
                    .at(span, "")
                    .help(format!("write `{path}.active` to test whether it is active"))
                    .fix(span, format!("{path}.active")),
                ));
            }
            Symbol::Alias(alias) => return self.argument_value(alias, path, place),
            Symbol::Macro(_)
            | Symbol::Transition(_)
            | Symbol::Chart(_)
            | Symbol::History(_)
            | Symbol::Broken => {
                return Err(self.wrong_kind(span, path, symbol, "a value"));
            }
        };
        Ok(Expr::leaf(L::of_net(leaf), span))
    }

    /// The argument for a parameter of a library chart, as if it were written here in parentheses.
    fn argument_value<L: Target>(
        &mut self,
        alias: usize,
        path: &Path,
        place: &Place<'_>,
    ) -> Outcome<Expr<L>> {
        let Alias { scope, value: AliasValue::Expr(syntax) } = self.aliases[alias] else {
            return Err(self.already_told());
        };
        if self.open_aliases.contains(&alias) {
            return Err(self.report(
                Diagnostic::error(
                    codes::ARGUMENT,
                    format!("the argument for `{path}` refers to itself"),
                )
                .at(syntax.span, "this argument")
                .help("write the argument with names of the chart that contains the `use`"),
            ));
        }
        self.alias_mentions += 1;
        if self.alias_mentions > MAX_MENTIONS {
            return Err(self.report(
                Diagnostic::error(
                    codes::EXPANSION_SIZE,
                    format!("arguments replace parameters in more than {MAX_MENTIONS} places"),
                )
                .at(syntax.span, "reached here")
                .help("use fewer levels: if arguments contain parameters, the number of copies multiplies"),
            ));
        }
        self.open_aliases.push(alias);
        let result = self.expression(syntax, &Place { scope, otherwise: None, ..*place });
        self.open_aliases.pop();
        result
    }

    pub(super) fn time_alone(&mut self, path: &Path) -> ErrorReported {
        self.report(
            Diagnostic::error(
                codes::TIME_ALONE,
                format!("the time `{path}` can only be compared with a constant"),
            )
            .at(path.span(), "")
            .help(format!("write a comparison such as `{path} >= 3 s`; to count, use a variable")),
        )
    }

    fn event_here(
        &mut self,
        path: &Path,
        input: crate::net::InputId,
        place: &Place<'_>,
    ) -> Outcome<()> {
        let is_property = place.what == "a property";
        if self.is_statechart() && !is_property {
            return Err(self.report(
                Diagnostic::error(
                    codes::PULSE_PLACE,
                    format!("the event `{path}` is not allowed in a condition of a statechart"),
                )
                .at(path.span(), "")
                .help(format!("write `on {path}`: a statechart processes one event at a time")),
            ));
        }
        if place.events {
            return Ok(());
        }
        if is_property && self.net.inputs[input].kind == InputKind::Event {
            return Ok(());
        }
        Err(self.report(
            Diagnostic::error(codes::PULSE_PLACE, format!("the event `{path}` is not allowed in {}", place.what))
                .at(path.span(), "an event is true for one micro-step only")
                .help("use it in a transition or with `on` in a step, and store its effect in a step or variable"),
        ))
    }

    fn output_value<L: Target>(
        &mut self,
        path: &Path,
        output: OutputId,
        span: Span,
    ) -> Outcome<Expr<L>> {
        let role = self.roles.get(output.index()).copied().unwrap_or(Role::Broken);
        // An extern action with parameters has no single value; one without is true in a reaction that calls it.
        let has_value = self.net.outputs[output].driver.params().is_empty();
        if let Some(leaf) = L::of_output(output)
            && has_value
            && role != Role::Broken
        {
            return Ok(Expr::leaf(leaf, span));
        }
        match role {
            Role::Stored(var) => Ok(Expr::leaf(L::of_net(Leaf::Var(var)), span)),
            Role::Controlled(action) => Ok(Expr::leaf(L::of_net(Leaf::Controlled(action)), span)),
            Role::Extern => Err(self.wrong_kind(span, path, Symbol::Output(output), "a value")),
            Role::Continuous | Role::Mealy => {
                let word = if role == Role::Mealy { "mealy" } else { "continuous" };
                let mut finding = Diagnostic::error(
                    codes::OUTPUT_UNREADABLE,
                    format!("`{path}` is a {word} output and cannot be read"),
                )
                .at(span, "");
                let by = self.uses.get(output.index()).and_then(|uses| uses.first());
                finding = match by {
                    Some(by) => {
                        let step = self.net.steps[by.step].name.text.clone();
                        finding
                            .at(by.span, "driven here")
                            .help(format!("read the step instead: `{step}.active`"))
                    }
                    None => finding.help("read the steps that drive it instead"),
                };
                Err(self.report(finding))
            }
            Role::Broken => Err(self.already_told()),
        }
    }

    fn attribute_value<L: Target>(
        &mut self,
        path: &Path,
        like: StepLike,
        attribute: Attribute,
        span: Span,
    ) -> Outcome<Expr<L>> {
        if let StepLike::Step(step) = like
            && let Some(var) = self.counted.get(&step)
        {
            return match attribute {
                Attribute::Active => Ok(super::counted::is_active(*var, span, L::of_net)),
                Attribute::Elapsed
                | Attribute::LastElapsed
                | Attribute::Done
                | Attribute::Complete => {
                    super::counted::no_time(self, step, span);
                    Err(self.already_told())
                }
            };
        }
        match (like, attribute) {
            (_, Attribute::Elapsed | Attribute::LastElapsed) => Err(self.time_alone(path)),
            (StepLike::Step(step), Attribute::Active | Attribute::Complete) => {
                Ok(Expr::leaf(L::of_net(Leaf::Active(step)), span))
            }
            (StepLike::MacroStep(instance), Attribute::Active) => {
                Ok(self.macro_active(instance, span))
            }
            (StepLike::Step(step), Attribute::Done) => Ok(self.step_done(step, span)),
            (StepLike::MacroStep(instance), Attribute::Done | Attribute::Complete) => {
                match self.instances[instance].exit {
                    Some(exit) if attribute == Attribute::Complete => {
                        Ok(Expr::leaf(L::of_net(Leaf::Active(exit)), span))
                    }
                    Some(exit) => Ok(self.step_done(exit, span)),
                    None => Err(self.already_told()),
                }
            }
        }
    }

    /// A step without tasks is done as soon as it is active (semantics §6).
    fn step_done<L: Target>(&self, step: StepId, span: Span) -> Expr<L> {
        let leaf = if self.has_tasks(step) { Leaf::TasksDone(step) } else { Leaf::Active(step) };
        Expr::leaf(L::of_net(leaf), span)
    }

    fn has_tasks(&self, step: StepId) -> bool {
        self.tasked.contains(&step) || !self.net.steps[step].tasks.is_empty()
    }

    /// The value of XM: true if some step of the expansion is active.
    pub(super) fn macro_active<L: Target>(&self, instance: usize, span: Span) -> Expr<L> {
        let steps = self.instances[instance].steps.clone().map(StepId::from_index);
        let mut leaves: Vec<Expr<L>> =
            steps.map(|step| Expr::leaf(L::of_net(Leaf::Active(step)), span)).collect();
        match (leaves.pop(), leaves.is_empty()) {
            (Some(only), true) => only,
            (Some(last), false) => {
                leaves.push(last);
                Expr::new(ExprKind::Or(leaves), span)
            }
            (None, _) => Expr::new(ExprKind::Bool(false), span),
        }
    }

    /// `rise(e)`, `fall(e)`.
    fn edge<L: Target>(
        &mut self,
        operand: &Syntax,
        span: Span,
        place: &Place<'_>,
        leaf: fn(crate::net::EdgeId) -> Leaf,
    ) -> Outcome<Expr<L>> {
        if !place.edges || place.constant {
            let what = place.what;
            let help = match what {
                "the condition of an output" => {
                    "use `pulse`, or a step that the edge activates: the condition is evaluated after the evolution, when the edge is over"
                }
                "an edge" => "take the edge of the inner expression, or keep it in a variable",
                _ => {
                    "use the edge in a transition or with `on` in a step, and store its effect in a step or variable"
                }
            };
            return Err(self.report(
                Diagnostic::error(codes::PULSE_PLACE, format!("an edge is not allowed in {what}"))
                    .at(span, "an edge is true for one micro-step only")
                    .help(help),
            ));
        }
        let inner = Place::level(place.scope, "an edge");
        let expr = self.condition::<Leaf>(operand, &inner)?;
        let shape = expr.without_spans();
        let id = match self.edges.get(&shape) {
            Some(id) => *id,
            None => {
                let id = self.net.edges.push(EdgeOperand { expr });
                self.edges.insert(shape, id);
                id
            }
        };
        Ok(Expr::leaf(L::of_net(leaf(id)), span))
    }

    /// True if no earlier transition that leaves one of the same steps is fireable.
    fn otherwise<L: Target>(&mut self, span: Span, place: &Place<'_>) -> Outcome<Expr<L>> {
        let steps = match place.otherwise {
            Some(steps) if !steps.is_empty() => steps,
            Some(_) => {
                return Err(self.report(
                    Diagnostic::error(
                        codes::OTHERWISE_PLACE,
                        "`otherwise` is not allowed on a source transition",
                    )
                    .at(span, "it leaves no step, so there are no competing transitions")
                    .help("write the condition explicitly"),
                ));
            }
            None => {
                return Err(self.report(
                    Diagnostic::error(
                        codes::OTHERWISE_PLACE,
                        format!("`otherwise` is not allowed in {}", place.what),
                    )
                    .at(span, "")
                    .help("it belongs to the `when` of a transition that leaves a step"),
                ));
            }
        };
        let mut above: Vec<_> =
            steps.iter().flat_map(|step| self.leaving[step.index()].iter().copied()).collect();
        above.sort_unstable();
        above.dedup();
        self.otherwise_mentions += above.len();
        if self.otherwise_mentions > MAX_OTHERWISE {
            return Err(self.report(
                Diagnostic::error(
                    codes::EXPANSION_SIZE,
                    format!(
                        "all uses of `otherwise` together expand to more than {MAX_OTHERWISE} conditions"
                    ),
                )
                .at(span, "reached here")
                .help("write `otherwise` once, in the last transition that leaves a step"),
            ));
        }
        if above.is_empty() {
            self.report(
                Diagnostic::warning(codes::NO_EFFECT, "`otherwise` is always true here")
                    .at(span, "no transition above leaves the same step")
                    .help("`otherwise` refers to the transitions above it: move it to the last transition"),
            );
        }
        let fireable = above.into_iter().map(|id| Expr::leaf(L::of_net(Leaf::Fireable(id)), span));
        Ok(Expr { span, ..Expr::or(fireable).not() })
    }
}
