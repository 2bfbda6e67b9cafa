//! Writes a flat chart as rules text.

use itertools::Itertools as _;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use grafsynth_ir::chart::{
    Action, ActionHow, Board, Chart, Declaration, DeclarationKind, Design, Expr, Item, Leaf, Path,
    SettingKind, Step, StepItem, StepItemKind, StepRole, Transition,
};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::expr::{ExprKind, Type};
use grafsynth_ir::net::{Meta, Net, Policy};
use grafsynth_ir::{Name, Span};

use crate::codes;
use crate::graf::names::{self, Position, is_writable};
use crate::graf::write_text::{Text, attributes, conditions, keyword, place_text, setting_text};

/// Writes a net as rules.
///
/// # Errors
/// Returns a finding for everything in the net that rules cannot express: several charts, macro-steps, hierarchy.
pub fn write_net(net: &Net) -> Result<String, Vec<Diagnostic>> {
    crate::from_net::design(net).and_then(|design| write_design(&design))
}

/// Writes a flat chart as rules.
///
/// # Errors
/// Returns a finding for everything that makes the design more than one flat chart: several charts, macro-steps, enclosing steps, states, instances of library
/// charts.
pub fn write_design(design: &Design) -> Result<String, Vec<Diagnostic>> {
    let [chart] = design.charts.as_slice() else {
        let n = design.charts.len();
        let span = design.charts.get(1).map_or(Span::default(), |chart| chart.name.span);
        return Err(vec![cannot(format!("rules describe one chart, not {n}"), span)]);
    };
    let mut writer = Writer { text: Text::default(), findings: Vec::new(), mealy: BTreeMap::new() };
    writer.text.exprs.conditions = conditions(&chart.items);
    let rules = writer.chart(chart);
    if writer.findings.is_empty() { Ok(rules) } else { Err(writer.findings) }
}

fn cannot(message: impl Into<String>, span: Span) -> Diagnostic {
    Diagnostic::error(codes::CANNOT_WRITE, message)
        .at(span, "no rule can express this")
        .help("use `.graf` or `.net`, which can express every chart")
}

/// An object that rules have no word for.
fn inexpressible(kind: &str, name: &Name, of: &str) -> Diagnostic {
    cannot(format!("rules cannot express {kind} `{name}`{of}"), name.span)
}

/// The line with name and label of the chart, unless the chart has neither.
fn chart_line(chart: &Chart) -> Option<String> {
    let (name, meta) = (&chart.name.text, attributes(&chart.meta));
    let is_empty = chart.is_unnamed && meta.is_empty();
    (!is_empty).then(|| format!("chart {}{meta}", names::name(name, Position::Anywhere)))
}

/// True for the default settings of rules.
fn is_default(setting: &SettingKind) -> bool {
    matches!(
        setting,
        SettingKind::Tick(10_000_000)
            | SettingKind::Conflict(Policy::PriorityAge)
            | SettingKind::EvolutionSingle
    )
}

fn board_text(board: &Board) -> String {
    let pin = |(name, pin): &(Name, _)| format!("{} {pin}", names::signal(&name.text));
    let device = names::name(&board.device.text, Position::Anywhere);
    format!("device {device} {{ {} }}", board.pins.iter().map(pin).join("  "))
}

struct Writer {
    text: Text,
    findings: Vec<Diagnostic>,
    /// For each transition, the outputs that its rule lists as sub-rules.
    mealy: BTreeMap<usize, Vec<String>>,
}

/// The parts of a flat chart.
#[derive(Default)]
struct Flat<'a> {
    steps: Vec<&'a Step>,
    transitions: Vec<&'a Transition>,
    declarations: Vec<&'a Declaration>,
    /// The names of all outputs except extern actions.
    outputs: BTreeSet<&'a str>,
    /// The actions directly before each output, by the name of the output. Their position matters, because actions run in order.
    behind_actions: BTreeMap<&'a str, Vec<String>>,
}

impl Writer {
    fn chart(&mut self, chart: &Chart) -> String {
        let mut options: Vec<String> = Vec::new();
        options.extend(chart_line(chart));
        let mut flat = Flat::default();
        let mut behind = Vec::new();
        let mut before = Vec::new();
        // The first transition with actions. In rules, all steps and their reactions come before all transitions.
        let mut with_list: Option<&Transition> = None;
        let mut has_policy = false;
        for item in &chart.items {
            match item {
                Item::Setting(setting) => {
                    has_policy |= matches!(setting.kind, SettingKind::Conflict(_));
                    if !is_default(&setting.kind) {
                        options.push(setting_text(setting));
                    }
                }
                Item::Declaration(declaration) => {
                    if matches!(declaration.kind, DeclarationKind::Output { .. }) {
                        flat.outputs.insert(&declaration.name.text);
                        if !before.is_empty() {
                            flat.behind_actions
                                .insert(&declaration.name.text, std::mem::take(&mut before));
                        }
                    }
                    flat.declarations.push(declaration);
                }
                Item::Step(step) => {
                    if let Some(transition) = with_list {
                        self.check_reactions(step, transition);
                    }
                    flat.steps.push(step);
                }
                Item::Transition(transition) => {
                    if with_list.is_none() && !transition.actions.is_empty() {
                        with_list = Some(transition);
                    }
                    flat.transitions.push(transition);
                }
                Item::Action(action) => {
                    before.extend(self.action(action));
                }
                Item::Emergency(emergency) => {
                    self.text.exprs.signs = true;
                    behind.push(self.text.emergency(emergency));
                }
                Item::Property(property) => {
                    self.text.exprs.signs = true;
                    behind.push(self.text.property(property));
                }
                Item::Place(place) => behind.push(place_text(place)),
                Item::Board(board) => behind.push(board_text(board)),
                // Reported at the macro-step that uses it.
                Item::Macro(_) => {}
                Item::MacroStep(one) => {
                    let help = "replace the macro-step by the steps of its macro, or use `.graf` or `.net`";
                    let finding = inexpressible("macro-step", &one.name, "");
                    self.findings.push(finding.help(help));
                }
                Item::Enclosing(one) => {
                    self.findings.push(inexpressible("enclosing step", &one.step.name, ""));
                }
                Item::Use(one) => {
                    let of = " of a library chart";
                    self.findings.push(inexpressible("instance", &one.name, of));
                }
                Item::State(one) => {
                    let of = " of a statechart";
                    self.findings.push(inexpressible("state", &one.step.name, of));
                }
            }
        }
        // The default policy of a chart differs from that of rules; the default evolution is the same.
        if !has_policy {
            options.push("conflict all".to_owned());
        }
        before.append(&mut behind);
        self.rules(&flat, options, before)
    }

    /// Checks that a step after the first transition with actions has no reactions: rules would run them before these actions.
    fn check_reactions(&mut self, step: &Step, transition: &Transition) {
        let reacts = step.body.iter().find(|it| matches!(it.kind, StepItemKind::On { .. }));
        let Some(reaction) = reacts else { return };
        let name = transition.name.as_ref().map_or("", |name| &name.text);
        self.findings.push(cannot(
            format!(
                "the reactions of `{}` run after the list of transition `{name}`, but rules would run them before it",
                step.name
            ),
            reaction.span,
        ));
    }

    /// The line of an action with its list.
    fn action(&mut self, action: &Action) -> Option<String> {
        let list = match action.body.as_slice() {
            [] => Some(String::new()),
            _ => self.text.list(&action.body).map(|list| format!(" {list}")),
        };
        let Action { name, meta, .. } = action;
        if list.is_none() {
            let message = format!("rules cannot contain a list with several lines: `{name}`");
            self.findings.push(cannot(message, name.span));
        }
        let name = names::name(&name.text, Position::Anywhere);
        list.map(|list| format!("action {name}{}{list}", attributes(meta)))
    }

    fn rules(&mut self, flat: &Flat<'_>, mut options: Vec<String>, behind: Vec<String>) -> String {
        self.text.exprs.signs = true;
        let sub_rules = self.sub_rules(flat);
        let mut lists: [(&str, Vec<String>); 5] = [
            ("Step", Vec::new()),
            ("Transition", Vec::new()),
            ("Input", Vec::new()),
            ("Output", Vec::new()),
            ("Marking", Vec::new()),
        ];
        for declaration in &flat.declarations {
            let name = self.name(&declaration.name);
            let is_input = match declaration.kind {
                DeclarationKind::Input { .. }
                | DeclarationKind::Event { .. }
                | DeclarationKind::ExternCondition { .. } => Some(true),
                DeclarationKind::Output { .. } | DeclarationKind::ExternAction { .. } => {
                    Some(false)
                }
                _ => None,
            };
            if let Some(is_input) = is_input {
                lists[if is_input { 2 } else { 3 }].1.push(name);
            }
            let actions = flat.behind_actions.get(declaration.name.text.as_str());
            options.extend(actions.into_iter().flatten().cloned());
            if actions.is_some() || !is_plain(declaration, &sub_rules) {
                options.push(format!(
                    "{} {}",
                    keyword(declaration),
                    self.text.declaration(declaration)
                ));
            }
        }
        let mut step_rules = Vec::new();
        for step in &flat.steps {
            let name = self.name(&step.name);
            match step.role {
                StepRole::Plain => {}
                StepRole::Initial => lists[4].1.push(name.clone()),
                _ => {
                    self.findings.push(cannot(
                        format!("rules cannot express an item of step `{}`", step.name),
                        step.name.span,
                    ));
                }
            }
            lists[0].1.push(name);
            self.step(step, flat, &sub_rules, &mut step_rules, &mut options);
        }
        let mut transition_rules = Vec::new();
        for (index, transition) in flat.transitions.iter().enumerate() {
            self.transition(
                index,
                transition,
                &mut lists[1].1,
                &mut transition_rules,
                &mut options,
            );
        }
        options.extend(behind);

        let mut out = String::new();
        for option in options {
            let _ = writeln!(out, "# option: {option}");
        }
        for (word, names) in lists.iter().filter(|(_, names)| !names.is_empty()) {
            let _ = writeln!(out, "{word} {}", names.join(", "));
        }
        for (heading, rules) in [("Transitions:", transition_rules), ("Steps:", step_rules)] {
            if !rules.is_empty() {
                let _ = writeln!(out, "{heading}");
            }
            for rule in rules {
                let _ = writeln!(out, "{rule}");
            }
        }
        out
    }

    /// A name in a list or rule; the words of the headings get backquotes.
    fn name(&mut self, name: &grafsynth_ir::Name) -> String {
        if !is_writable(&name.text) {
            self.findings.push(cannot(
                format!(
                    "rules cannot express a name that is empty or contains a backquote or line break: {:?}",
                    name.text
                ),
                name.span,
            ));
        }
        if matches!(name.text.as_str(), "Transitions" | "Steps") {
            return format!("`{name}`");
        }
        names::name(&name.text, Position::Anywhere)
    }

    fn step(
        &mut self,
        step: &Step,
        flat: &Flat<'_>,
        sub_rules: &BTreeMap<String, bool>,
        rules: &mut Vec<String>,
        options: &mut Vec<String>,
    ) {
        let label = self.name(&step.name);
        let mut rest = Vec::new();
        for item in &step.body {
            match &item.kind {
                StepItemKind::Action {
                    target,
                    arguments: None,
                    how: ActionHow::Bare,
                    condition,
                } if flat.outputs.contains(target.text.as_str()) => {
                    // Sub-rules of transition rules already drive this output.
                    if sub_rules.get(&target.text) == Some(&true) {
                        continue;
                    }
                    let target = self.name(target);
                    let left = condition.as_ref().map_or_else(String::new, |condition| {
                        format!("{} ", self.text.exprs.text(condition))
                    });
                    rules.push(format!("{label}: {left}|- {target}"));
                }
                _ => rest.push(self.text.one_line_item(item)),
            }
        }
        let attributes = attributes(&step.meta);
        if !rest.is_empty() || !attributes.is_empty() {
            let body =
                if rest.is_empty() { String::new() } else { format!(" {{ {} }}", rest.join("; ")) };
            options.push(format!("step {label}{attributes}{body}"));
        }
    }

    fn transition(
        &mut self,
        index: usize,
        transition: &Transition,
        labels: &mut Vec<String>,
        rules: &mut Vec<String>,
        options: &mut Vec<String>,
    ) {
        let label = match &transition.name {
            Some(name) => self.name(name),
            None => {
                self.findings
                    .push(cannot("rules need a name for this transition", transition.meta.span));
                return;
            }
        };
        let mut left: Vec<String> =
            transition.sources.iter().map(|path| names::path(path, Position::Anywhere)).collect();
        match transition.guard.as_ref().map(|guard| (&guard.kind, guard)) {
            Some((ExprKind::And(factors), _)) if factors.len() > 1 => {
                left.extend(factors.iter().map(|factor| self.text.exprs.factor(factor)));
            }
            Some((_, guard)) => left.push(self.text.exprs.factor(guard)),
            None => {}
        }
        let mut right: Vec<String> = transition
            .targets
            .iter()
            .map(|path| format!("@{}", names::path(path, Position::Anywhere)))
            .collect();
        right.extend(self.mealy.remove(&index).unwrap_or_default());
        let left = if left.is_empty() { String::new() } else { format!("{} ", left.join("*")) };
        let right = if right.is_empty() { String::new() } else { format!(" {}", right.join("*")) };
        rules.push(format!("{label}: {left}|-{right}"));
        labels.push(label.clone());

        // Everything except steps and receptivity is written in an option.
        let bare = Transition {
            name: None,
            sources: Vec::new(),
            targets: Vec::new(),
            guard: None,
            ..transition.clone()
        };
        let clauses = self.text.clauses(&bare);
        let mut clauses: Vec<String> = clauses.into_iter().map(|(_, clause)| clause).collect();
        if !transition.actions.is_empty() {
            clauses.push(format!("do {}", self.text.one_line_list(&transition.actions)));
        }
        if !clauses.is_empty() {
            options.push(format!("transition {label}: {}", clauses.join(" ")));
        }
    }

    /// For each mealy output: whether transition rules can express all its shares, the conditions under which steps drive it. For this,
    /// every share must be the left side of one rule, and reading the rules must restore the order of the shares.
    fn sub_rules(&mut self, flat: &Flat<'_>) -> BTreeMap<String, bool> {
        let mut found = BTreeMap::new();
        // The left sides, by the first preceding step, which has the share.
        let mut left_sides: BTreeMap<String, Vec<(usize, Vec<Expr>)>> = BTreeMap::new();
        for (index, transition) in flat.transitions.iter().enumerate() {
            if let Some((first, others)) = transition.sources.split_first() {
                let mut factors: Vec<Expr> = others.iter().map(active).collect();
                factors.extend(transition.guard.iter().flat_map(Expr::factors).cloned());
                let factors = factors.iter().map(Expr::unplaced).collect();
                left_sides.entry(first.to_string()).or_default().push((index, factors));
            }
        }
        for declaration in &flat.declarations {
            if !matches!(declaration.kind, DeclarationKind::Output { mealy: true, .. }) {
                continue;
            }
            let name = &declaration.name.text;
            let rules = rules_of(name, flat, &left_sides);
            found.insert(name.clone(), rules.is_some());
            for rule in rules.into_iter().flatten() {
                let name = self.name(&declaration.name);
                self.mealy.entry(rule).or_default().push(name);
            }
        }
        found
    }
}

/// The transitions whose left sides are the shares of an output, in order; `None` if a share is not a left side.
fn rules_of(
    name: &str,
    flat: &Flat<'_>,
    left_sides: &BTreeMap<String, Vec<(usize, Vec<Expr>)>>,
) -> Option<Vec<usize>> {
    let mut rules = Vec::new();
    for step in &flat.steps {
        let empty = Vec::new();
        let candidates = left_sides.get(&step.name.text).unwrap_or(&empty);
        let mut next = 0;
        for item in &step.body {
            let condition = share(item, name)?;
            let Some(condition) = condition else { continue };
            // The rules must be found in the order of transitions, each at most once.
            let at = candidates[next..].iter().position(|(_, factors)| *factors == condition)?;
            rules.push(candidates[next + at].0);
            next += at + 1;
        }
    }
    (!rules.is_empty()).then_some(rules)
}

/// The factors under which a step item drives this output. The outer `None` means that the item drives the output in another way; the inner
/// `None` means that the item does not drive this output.
fn share(item: &StepItem, name: &str) -> Option<Option<Vec<Expr>>> {
    match &item.kind {
        StepItemKind::Action { target, arguments: None, how: ActionHow::Bare, condition }
            if target.text == name =>
        {
            let factors = condition.iter().flat_map(Expr::factors);
            Some(Some(factors.map(Expr::unplaced).collect()))
        }
        StepItemKind::Action { target, .. } if target.text == name => None,
        _ => Some(None),
    }
}

fn active(path: &Path) -> Expr {
    let mut names = path.names.clone();
    names.push(grafsynth_ir::Name::new("active", Span::default()));
    Expr::leaf(Leaf::Name(Path { names }), Span::default())
}

/// Whether the lists alone express this declaration, so that it needs no option.
fn is_plain(declaration: &Declaration, sub_rules: &BTreeMap<String, bool>) -> bool {
    let Meta { label, req, span: _ } = &declaration.meta;
    label.is_empty()
        && req.is_empty()
        && match &declaration.kind {
            DeclarationKind::Input { ty: Type::Bool, synchronous: false } => true,
            DeclarationKind::Output {
                ty: Type::Bool,
                init: None,
                registered: false,
                mealy,
                safe: None,
            } => !mealy || sub_rules.get(&declaration.name.text) == Some(&true),
            _ => false,
        }
}
