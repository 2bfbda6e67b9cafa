//! Builds the chart that lists, rules and options describe together.

use grafsynth_ir::Gather;
use itertools::Itertools as _;
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use grafsynth_ir::chart::{
    ActionHow, Chart, Declaration, DeclarationKind, Design, Expr, Item, Leaf, Path, Setting,
    SettingKind, Step, StepItem, StepItemKind, StepRole, Transition,
};
use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::expr::{ArithOp, ExprKind, Type};
use grafsynth_ir::lower::codes::NO_INITIAL_STEP;
use grafsynth_ir::net::{Meta, Policy};
use grafsynth_ir::{FileId, Name, Span};

use super::{Rule, Rules};
use crate::codes;
use crate::findings::Findings;
use crate::graf::Limits;
use crate::graf::numbers::Numbers;
use crate::graf::parser::{Parse, Parser, short};
use crate::graf::token::Kind;

/// The contents of the option lines.
#[derive(Default)]
pub(super) struct Options {
    chart: Option<(Name, Meta)>,
    steps: BTreeMap<String, Step>,
    transitions: BTreeMap<String, Transition>,
    /// Declarations, settings and other items, in order.
    items: Vec<Item>,
}

impl Options {
    pub(super) fn is_empty(&self) -> bool {
        self.chart.is_none()
            && self.steps.is_empty()
            && self.transitions.is_empty()
            && self.items.is_empty()
    }
}

/// The lists as sets.
pub(super) struct Listed {
    pub(super) steps: BTreeSet<String>,
    pub(super) transitions: BTreeSet<String>,
    pub(super) outputs: BTreeSet<String>,
}

/// Builds the design and reports inconsistencies.
pub(super) struct Builder<'a> {
    pub(super) text: &'a str,
    pub(super) rules: Rules,
    pub(super) listed: Listed,
    pub(super) findings: Findings,
    pub(super) options: Options,
    /// Whether the current rule leaves a step.
    pub(super) has_source: bool,
}

impl Builder<'_> {
    /// Reads one option line: the option begins at byte `start`, and `text` ends with it.
    pub(super) fn option(
        &mut self,
        file: FileId,
        text: &str,
        start: usize,
        numbers: &Numbers<'_>,
        limits: &Limits,
    ) {
        let start = u32::try_from(start).unwrap_or(u32::MAX);
        let mut parser = Parser::starting_at(file, text, start, Some(numbers), *limits);
        // The text has a single list of findings, which the parser of the option borrows.
        std::mem::swap(&mut parser.findings, &mut self.findings);
        let named = self.one_option(&mut parser);
        if named.is_ok() && parser.kind(0) != Kind::End {
            parser.unexpected("the end of the line");
        }
        std::mem::swap(&mut parser.findings, &mut self.findings);
        if let Ok(Some((name, is_step))) = named {
            self.check_listed(&name, is_step);
        }
    }

    /// Returns the step (true) or transition (false) that the option is for.
    fn one_option(&mut self, parser: &mut Parser<'_>) -> Parse<Option<(Name, bool)>> {
        let start = parser.peek(0).start;
        match parser.word(0) {
            "chart" => {
                parser.advance();
                let name = parser.name("the name of the chart")?;
                let mut meta = Meta::default();
                parser.attributes(&mut meta)?;
                self.options.chart = Some((name, meta));
            }
            "step" => {
                let step = parser.step(start, StepRole::Plain)?;
                let name = step.name.clone();
                self.options.steps.insert(name.text.clone(), step);
                return Ok(Some((name, true)));
            }
            "transition" => {
                parser.advance();
                let name = parser.name("the name of a transition")?;
                parser.expect(Kind::Colon, "`:`")?;
                let mut transition = Transition::default();
                parser.clauses(&mut transition)?;
                if let Some(guard) = &transition.guard {
                    let span = guard.span;
                    parser.report(|| {
                        Diagnostic::error(
                            codes::OPTION,
                            "a receptivity belongs to the rule, not to an option",
                        )
                        .at(span, "not allowed here")
                        .help(
                            "move it to the left side of the rule: `t1: step*receptivity |- @next`",
                        )
                    });
                }
                self.options.transitions.insert(name.text.clone(), transition);
                return Ok(Some((name, false)));
            }
            _ => {
                let mut items = Vec::new();
                parser.item(&mut items)?;
                for item in items {
                    self.keep_option(parser, item);
                }
            }
        }
        Ok(None)
    }

    fn keep_option(&mut self, parser: &mut Parser<'_>, item: Item) {
        let refused = match &item {
            Item::Step(step) => Some((
                step.meta.span,
                "write `# option: step NAME …`; list initial steps in `Marking`",
            )),
            Item::Transition(transition) => Some((
                transition.meta.span,
                "a transition is a rule; write `# option: transition NAME: …`",
            )),
            Item::Macro(one) => Some((one.meta.span, "rules describe flat charts")),
            Item::MacroStep(one) => Some((one.meta.span, "rules describe flat charts")),
            Item::Enclosing(one) => Some((one.step.meta.span, "rules describe flat charts")),
            Item::Use(one) => Some((one.meta.span, "rules describe flat charts")),
            Item::State(one) => Some((one.step.meta.span, "rules describe flat charts")),
            _ => None,
        };
        match refused {
            Some((span, help)) => {
                parser.report(|| {
                    Diagnostic::error(codes::OPTION, "this is not allowed in an option")
                        .at(span, "")
                        .help(help)
                });
            }
            None => self.options.items.push(item),
        }
    }

    /// Reports a name in an option or rule that is missing from its list.
    fn check_listed(&mut self, name: &Name, is_step: bool) -> bool {
        let listed = if is_step { &self.listed.steps } else { &self.listed.transitions };
        // Without a list of transitions, every label is allowed.
        let is_listed =
            listed.contains(&name.text) || !is_step && !self.rules.seen.contains("Transition");
        if !is_listed {
            self.unlisted(name, if is_step { "Step" } else { "Transition" });
        }
        is_listed
    }

    fn unlisted(&mut self, name: &Name, list: &str) {
        let shown = short(&name.text);
        let listed = match list {
            "Step" => &self.listed.steps,
            "Transition" => &self.listed.transitions,
            _ => &self.listed.outputs,
        };
        self.findings.report(|| {
            let finding = Diagnostic::error(
                codes::UNLISTED,
                format!("`{shown}` is not in the list `{list}`"),
            );
            finding.at(name.span, "not listed").near(
                name.span,
                nearest(&name.text, listed.iter().map(String::as_str)),
                format!("add it to the line that begins with `{list}`"),
            )
        });
    }

    pub(super) fn design(&mut self, file: FileId) -> Design {
        let is_unnamed = self.options.chart.is_none();
        let (mut name, mut meta) = self
            .options
            .chart
            .take()
            .unwrap_or_else(|| (Name::new("rules", Span::new(file, 0, 0)), Meta::default()));
        // The span of the chart is that of its first list.
        meta.span = self.rules.lists.unwrap_or(Span::new(file, 0, 0));
        if name.span == Span::new(file, 0, 0) {
            name.span = self.rules.step_list.unwrap_or(meta.span);
        }
        let mut items = self.settings();
        let mealy = self.mealy_outputs();
        let rest = self.declarations(&mut items, &mealy);
        let transitions = self.transitions();
        self.steps(&mut items);
        items.extend(transitions.into_iter().map(Item::Transition));
        items.extend(rest);
        let span = meta.span;
        Design {
            charts: vec![Chart { name, is_unnamed, span, items, meta, ..Chart::default() }],
            ..Design::default()
        }
    }

    /// The given settings, and the defaults of rules for the others.
    fn settings(&mut self) -> Vec<Item> {
        let (mut items, others): (Vec<Item>, Vec<Item>) = std::mem::take(&mut self.options.items)
            .into_iter()
            .partition(|item| matches!(item, Item::Setting(_)));
        self.options.items = others;
        let has = |items: &[Item], test: fn(&SettingKind) -> bool| {
            items.iter().any(|item| matches!(item, Item::Setting(setting) if test(&setting.kind)))
        };
        let defaults: [Default; 3] = [
            (
                |kind| {
                    matches!(kind, SettingKind::EvolutionSingle | SettingKind::EvolutionStable(_))
                },
                SettingKind::EvolutionSingle,
            ),
            (
                |kind| matches!(kind, SettingKind::Conflict(_)),
                SettingKind::Conflict(Policy::PriorityAge),
            ),
            (|kind| matches!(kind, SettingKind::Tick(_)), SettingKind::Tick(10_000_000)),
        ];
        for (test, kind) in defaults {
            if !has(&items, test) {
                items.insert(0, Item::Setting(Setting { kind, span: Span::default() }));
            }
        }
        items
    }

    /// Outputs on the right side of transition rules.
    fn mealy_outputs(&self) -> BTreeSet<String> {
        let names = self.rules.transition_rules.iter().flat_map(|rule| &rule.right);
        names.filter(|(is_next, _)| !is_next).map(|(_, name)| name.text.clone()).gather()
    }

    /// Adds inputs and outputs in the order of their lists, then everything that only options declare. Returns all other options. An action
    /// is placed before an output if its option is before that of the output, because actions run in order.
    fn declarations(&mut self, items: &mut Vec<Item>, mealy: &BTreeSet<String>) -> Vec<Item> {
        let mut declared: BTreeMap<String, Declaration> = BTreeMap::new();
        let mut order = Vec::new();
        let mut rest = Vec::new();
        let mut actions = Vec::new();
        let mut before: BTreeMap<String, Vec<Item>> = BTreeMap::new();
        for item in std::mem::take(&mut self.options.items) {
            match item {
                Item::Declaration(declaration) => {
                    let name = declaration.name.clone();
                    if matches!(declaration.kind, DeclarationKind::Output { .. }) {
                        before.entry(name.text.clone()).or_default().append(&mut actions);
                    }
                    match declared.entry(name.text.clone()) {
                        Entry::Vacant(place) => {
                            place.insert(declaration);
                            order.push(name.text);
                        }
                        Entry::Occupied(_) => self.findings.report(|| {
                            Diagnostic::error(
                                codes::OPTION,
                                format!("`{}` is declared twice", short(&name.text)),
                            )
                            .at(name.span, "again here")
                            .help("rename or remove one of them")
                        }),
                    }
                }
                item @ Item::Action(_) => actions.push(item),
                item => rest.push(item),
            }
        }
        actions.append(&mut rest);
        let rest = actions;
        for (list, is_output) in [(&self.rules.inputs, false), (&self.rules.outputs, true)] {
            for name in list {
                let mut declaration = match declared.remove(&name.text) {
                    Some(declaration) => declaration,
                    None => plain(name, is_output),
                };
                let fits = match &mut declaration.kind {
                    DeclarationKind::Input { .. }
                    | DeclarationKind::Event { .. }
                    | DeclarationKind::ExternCondition { .. } => !is_output,
                    DeclarationKind::Output { mealy: is_mealy, .. } => {
                        *is_mealy |= mealy.contains(&name.text);
                        is_output
                    }
                    DeclarationKind::ExternAction { .. } => is_output,
                    _ => false,
                };
                if !fits {
                    let (span, list) =
                        (declaration.name.span, if is_output { "Output" } else { "Input" });
                    self.findings.report(|| {
                        Diagnostic::error(
                            codes::OPTION,
                            format!(
                                "`{}` is in the list `{list}`, but is declared as something else",
                                short(&name.text)
                            ),
                        )
                        .at(span, "declared here")
                        .at(name.span, "listed here")
                        .help(format!("remove it from the list `{list}`, or rename one of them"))
                    });
                }
                items.extend(before.remove(&name.text).unwrap_or_default());
                items.push(Item::Declaration(declaration));
            }
        }
        for name in order {
            items.extend(before.remove(&name).unwrap_or_default());
            items.extend(declared.remove(&name).map(Item::Declaration));
        }
        rest
    }

    /// The transitions in the order of their list. Adds the sub-rules of each transition rule to its first preceding step.
    fn transitions(&mut self) -> Vec<Transition> {
        let place: BTreeMap<String, usize> = self
            .rules
            .transitions
            .iter()
            .enumerate()
            .rev()
            .map(|(index, name)| (name.text.clone(), index))
            .gather();
        let mut rules = std::mem::take(&mut self.rules.transition_rules);
        let with_rule: BTreeSet<&str> = rules.iter().map(|rule| rule.label.text.as_str()).gather();
        for name in &self.rules.transitions {
            if !with_rule.contains(name.text.as_str()) && !self.rules.unread.contains(&name.text) {
                self.findings.report(|| {
                    Diagnostic::error(
                        codes::NO_RULE,
                        format!("transition `{}` has no rule", short(&name.text)),
                    )
                    .at(name.span, "listed here")
                    .help(format!("write `{}: … |- @…` after `Transitions:`", short(&name.text)))
                });
            }
        }
        rules.sort_by_key(|rule| place.get(&rule.label.text).copied().unwrap_or(usize::MAX));
        let mut transitions = Vec::new();
        for rule in &rules {
            self.check_listed(&rule.label, false);
            let mut transition =
                self.options.transitions.remove(&rule.label.text).unwrap_or_default();
            let (sources, guard) = self.left_side(rule);
            self.has_source |= sources.is_empty() && !self.names_a_step(rule);
            transition.is_sink =
                !rule.right.iter().any(|(is_next, _)| *is_next) && !sources.is_empty();
            for (is_next, name) in &rule.right {
                match (
                    *is_next,
                    self.listed.steps.contains(&name.text),
                    self.listed.outputs.contains(&name.text),
                ) {
                    (true, true, _) => transition.targets.push(Path::from(name.clone())),
                    (true, false, true) => self.output_with_sign(rule, name),
                    (true, false, false) => self.unlisted(name, "Step"),
                    (false, _, true) => self.sub_rule(rule, name, &sources, guard.as_ref()),
                    (false, true, false) => self.findings.report(|| {
                        Diagnostic::error(
                            codes::RIGHT_SIDE,
                            format!("step `{}` without `@` on the right side", short(&name.text)),
                        )
                        .at(name.span, "a following step needs `@`")
                        .fix(name.span, format!("@{}", name.text))
                    }),
                    (false, false, false) => self.unlisted(name, "Output"),
                }
            }
            transition.name = Some(rule.label.clone());
            transition.sources = sources;
            transition.guard = guard;
            transition.meta.span = rule.span;
            transitions.push(transition);
        }
        transitions
    }

    /// Reports `@valve`, if `valve` is an output: the following step should drive it.
    fn output_with_sign(&mut self, rule: &Rule, name: &Name) {
        let shown = short(&name.text);
        let step = rule.right.iter().find_map(|(is_next, other)| {
            (*is_next && self.listed.steps.contains(&other.text)).then(|| short(&other.text))
        });
        self.findings.report(|| {
            let finding = Diagnostic::error(
                codes::RIGHT_SIDE,
                format!("output `{shown}` has an `@`, which is only for following steps"),
            )
            .at(name.span, "an output, not a step");
            finding.help(match step {
                Some(step) => format!(
                    "remove `@{shown}` from this rule, and write `{step}: |- {shown}` below a line `Steps:` at the end of the file, so that it is on while `{step}` is active"
                ),
                None => format!(
                    "remove `@{shown}` from this rule, and write a rule such as `p1: |- {shown}`, for the step that turns it on, below a line `Steps:` at the end of the file"
                ),
            })
        });
    }

    /// Splits the left side: preceding steps are factors, and the other factors are the receptivity.
    fn left_side(&mut self, rule: &Rule) -> (Vec<Path>, Option<Expr>) {
        let Some(left) = &rule.left else { return (Vec::new(), None) };
        let span = left.span;
        let (mut sources, mut others, mut guard) = (Vec::new(), Vec::new(), Vec::new());
        for factor in left.factors() {
            if let ExprKind::Leaf(Leaf::Name(path)) = &factor.kind
                && path.names.len() == 1
                && self.listed.steps.contains(&path.names[0].text)
            {
                sources.push(path.clone());
            } else {
                others.push(factor);
            }
        }
        for factor in others {
            if self.no_sum_of_steps(rule, factor) && self.no_bare_step(factor, !sources.is_empty())
            {
                guard.push(factor.clone());
            }
        }
        let guard = match guard.len() {
            0 => None,
            1 => guard.pop(),
            _ => Some(Expr::new(ExprKind::And(guard), span)),
        };
        (sources, guard)
    }

    /// Reports `(p1 + p2)*m`: a rule leaves all of its preceding steps together, so each of these steps needs its own rule. Returns true if
    /// the factor does not have this form.
    fn no_sum_of_steps(&mut self, rule: &Rule, factor: &Expr) -> bool {
        const SHOWN: usize = 4;
        let ExprKind::Or(parts) = &factor.kind else { return true };
        let is_step = |expr: &Expr| {
            matches!(&expr.kind, ExprKind::Leaf(Leaf::Name(path))
                if path.names.len() == 1 && self.listed.steps.contains(&path.names[0].text))
        };
        let has_step = |part: &Expr| part.factors().iter().any(is_step);
        let Some(left) = &rule.left else { return true };
        if !parts.iter().all(has_step) {
            return true;
        }
        let text = |start: u32, end: u32| self.text.get(start as usize..end as usize).unwrap_or("");
        let label = short(&rule.label.text);
        let rules = parts
            .iter()
            .take(SHOWN)
            .zip('a'..='z')
            .map(|(part, letter)| {
                format!(
                    "`{label}{letter}: {}{}{}{}`",
                    text(left.span.start, factor.span.start),
                    text(part.span.start, part.span.end),
                    text(factor.span.end, left.span.end),
                    text(left.span.end, rule.span.end),
                )
            })
            .join(" and ");
        let more = if parts.len() > SHOWN { " and so on" } else { "" };
        let n = parts.len();
        self.findings.report(|| {
            Diagnostic::error(
                codes::STEP_IN_CONDITION,
                format!("transition `{label}` cannot leave only one of {n} steps"),
            )
            .at(factor.span, "a sum of steps")
            .help(format!(
                "a transition leaves all of its preceding steps; write one rule for each, {rules}{more}, and list their labels in the line `Transition`"
            ))
        });
        false
    }

    /// Reports a step that is not a factor: the text must show whether it is a preceding step or a tested one. Returns true if there is no
    /// such step.
    fn no_bare_step(&mut self, expr: &Expr, has_source: bool) -> bool {
        let mut bare = Vec::new();
        bare_names(expr, &mut |name| {
            if self.listed.steps.contains(&name.text) {
                bare.push(name.clone());
            }
        });
        let is_clear = bare.is_empty();
        if let Some(name) = bare.first()
            && let Some((start, compared)) = multiplied(expr, name)
        {
            let text = self.text.get(start as usize..expr.span.end as usize).unwrap_or_default();
            let (step, name, text) = (short(&name.text), name.span, format!("({text})"));
            self.findings.report(|| {
                let message = format!("`*` multiplies step `{step}` by a number in the comparison");
                Diagnostic::error(codes::STEP_IN_CONDITION, message)
                    .at(compared, "`*` multiplies numbers here")
                    .at(name, "not a factor of the left side")
                    .help(format!("write parentheses around the comparison: `{text}`"))
                    .fix(Span { start, ..expr.span }, text)
            });
            return false;
        }
        for name in bare {
            let shown = short(&name.text);
            self.findings.report(|| {
                let finding = Diagnostic::error(
                    codes::STEP_IN_CONDITION,
                    format!("step `{shown}` inside a condition"),
                )
                .at(name.span, "not a factor of the left side")
                .help(format!(
                    "a preceding step is a factor, joined with `*`; to test whether it is active, write `{shown}.active`"
                ));
                // Without a preceding step, the fix would create a rule that leaves no step.
                if has_source {
                    finding.fix(name.span, format!("{shown}.active"))
                } else {
                    finding
                }
            });
        }
        is_clear
    }

    /// Whether the left side names a step, as a factor or otherwise.
    fn names_a_step(&self, rule: &Rule) -> bool {
        let mut found = false;
        if let Some(left) = &rule.left {
            bare_names(left, &mut |name| found |= self.listed.steps.contains(&name.text));
        }
        found
    }

    /// Adds an output of a transition rule, which is true while the left side is true.
    fn sub_rule(&mut self, rule: &Rule, name: &Name, sources: &[Path], guard: Option<&Expr>) {
        let Some((first, others)) = sources.split_first() else {
            self.findings.report(|| {
                Diagnostic::error(
                    codes::RIGHT_SIDE,
                    format!("output `{}` in a rule without a preceding step", short(&name.text)),
                )
                .at(name.span, "no step turns it on")
                .help("name a preceding step on the left side")
            });
            return;
        };
        let active = |path: &Path| {
            let mut names = path.names.clone();
            names.push(Name::new("active", path.span()));
            Expr::leaf(Leaf::Name(Path { names }), path.span())
        };
        let mut factors: Vec<Expr> = others.iter().map(active).collect();
        factors.extend(guard.into_iter().flat_map(Expr::factors).cloned());
        let condition = match factors.len() {
            0 => None,
            1 => factors.pop(),
            _ => Some(Expr::new(ExprKind::And(factors), rule.span)),
        };
        let target = Name { text: name.text.clone(), span: name.span };
        let kind =
            StepItemKind::Action { target, arguments: None, how: ActionHow::Bare, condition };
        let item = StepItem { kind, span: name.span };
        let step = first.to_string();
        self.options
            .steps
            .entry(step.clone())
            .or_insert_with(|| Step { name: Name::new(step, Span::default()), ..Step::default() })
            .body
            .push(item);
    }

    /// Adds the steps in the order of their list, with the items from options and rules.
    fn steps(&mut self, items: &mut Vec<Item>) {
        let mut bodies: BTreeMap<String, Vec<StepItem>> = BTreeMap::new();
        for rule in std::mem::take(&mut self.rules.step_rules) {
            if !self.check_listed(&rule.label, true) {
                continue;
            }
            if rule.right.is_empty() {
                self.findings.report(|| {
                    Diagnostic::error(codes::RIGHT_SIDE, "a step rule without an output")
                        .at(rule.span, "expected an output after `|-`")
                        .help("write the outputs of the step, or remove the rule: a step without outputs needs none")
                });
            }
            for (is_next, name) in &rule.right {
                if *is_next {
                    self.findings.report(|| {
                        Diagnostic::error(codes::RIGHT_SIDE, "`@` in a step rule")
                            .at(name.span, "a step rule names outputs only")
                            .help("remove the `@`, or write a transition rule")
                    });
                } else if !self.listed.outputs.contains(&name.text) {
                    self.unlisted(name, "Output");
                } else {
                    let kind = StepItemKind::Action {
                        target: name.clone(),
                        arguments: None,
                        how: ActionHow::Bare,
                        condition: rule.left.clone(),
                    };
                    bodies
                        .entry(rule.label.text.clone())
                        .or_default()
                        .push(StepItem { kind, span: rule.span });
                }
            }
        }
        let marking = std::mem::take(&mut self.rules.marking);
        for name in &marking {
            self.check_listed(name, true);
        }
        let begins = self.begins_nowhere(&marking);
        let marking: BTreeSet<String> =
            begins.into_iter().chain(marking).map(|name| name.text).gather();
        for name in &self.rules.steps {
            let mut step = self.options.steps.remove(&name.text).unwrap_or_default();
            step.name = name.clone();
            step.meta.span = name.span;
            step.role =
                if marking.contains(&name.text) { StepRole::Initial } else { StepRole::Plain };
            step.body.extend(bodies.remove(&name.text).unwrap_or_default());
            items.push(Item::Step(step));
        }
    }
}

impl Builder<'_> {
    /// Reports that no step is initial, and returns the first step as a replacement. `None` if there is an initial step, or if the chart
    /// begins in another way.
    fn begins_nowhere(&mut self, marking: &[Name]) -> Option<Name> {
        let first = self.rules.steps.first()?.clone();
        let forces = |step: &Step| {
            step.body.iter().any(|item| matches!(item.kind, StepItemKind::Force { .. }))
        };
        if !marking.is_empty() || self.has_source || self.options.steps.values().any(forces) {
            return None;
        }
        let place = self.rules.step_list.unwrap_or(first.span);
        let shown = short(&first.text);
        self.findings.report(|| {
            Diagnostic::error(NO_INITIAL_STEP, "no step is active after reset")
                .at(place, "none of these steps is in a list `Marking`")
                .help(format!("add a line such as `Marking {shown}`"))
        });
        Some(first)
    }
}

/// A test whether an option gives a setting, and the default of rules for this setting.
type Default = (fn(&SettingKind) -> bool, SettingKind);

/// A Boolean input or output that only its list declares.
fn plain(name: &Name, is_output: bool) -> Declaration {
    let kind = if is_output {
        DeclarationKind::Output {
            ty: Type::Bool,
            init: None,
            registered: false,
            mealy: false,
            safe: None,
        }
    } else {
        DeclarationKind::Input { ty: Type::Bool, synchronous: false }
    };
    Declaration { name: name.clone(), kind, meta: Meta { span: name.span, ..Meta::default() } }
}

/// For `red*red.t >= 10 s`, which multiplies: the start of the last factor, and the span of the product. `name` is the first factor.
fn multiplied(expr: &Expr, name: &Name) -> Option<(u32, Span)> {
    let ExprKind::Compare(_, left, right) = &expr.kind else { return None };
    let ExprKind::Arith(ArithOp::Mul, _, last) = &left.kind else { return None };
    let is_last = !matches!(right.kind, ExprKind::Arith(..));
    (is_last && name.span.start == left.span.start).then_some((last.span.start, left.span))
}

/// Visits all names without dots, including those inside edges and delays.
fn bare_names(expr: &Expr, visit: &mut dyn FnMut(&Name)) {
    if let ExprKind::Leaf(leaf) | ExprKind::Element(leaf, _) = &expr.kind {
        match leaf {
            Leaf::Name(path) => {
                if let [only] = path.names.as_slice() {
                    visit(only);
                }
            }
            Leaf::Rise(inner) | Leaf::Fall(inner) | Leaf::Delay(_, inner, _) => {
                bare_names(inner, visit);
            }
            Leaf::Otherwise | Leaf::Duration(_) => {}
        }
    }
    for operand in expr.children() {
        bare_names(operand, visit);
    }
}
