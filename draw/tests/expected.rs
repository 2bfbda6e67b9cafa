//! A chart in the form that the reader of drawings returns, made without the code that draws.

use crate::reader::{Action, Region, Step, Transition};
use grafsynth_draw::Style;
use grafsynth_frontend::graf;
use grafsynth_ir::chart::{
    ActionHow, ArgumentValue, Block, Chart, DeclarationKind, Design, Expr, ForceOrder, Item, Leaf,
    Length, Path, StepItemKind, StepRole, Stmt, StmtKind,
};
use grafsynth_ir::expr::{CompareOp, ExprKind, Type};
use grafsynth_ir::net::{Meta, Verbatim};
use grafsynth_ir::{FileId, Name, Span};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};

/// A condition without spans, with nested conjunctions and disjunctions as one.
pub(crate) fn flat(expr: &Expr) -> Expr {
    let join = |all: &[Expr], is_and: bool| -> Expr {
        let mut out = Vec::new();
        for one in all {
            let one = flat(one);
            match one.kind {
                ExprKind::And(more) if is_and => out.extend(more),
                ExprKind::Or(more) if !is_and => out.extend(more),
                _ => out.push(one),
            }
        }
        if out.len() == 1 {
            return out.remove(0);
        }
        let kind = if is_and { ExprKind::And(out) } else { ExprKind::Or(out) };
        Expr::new(kind, Span::default())
    };
    let two = |a: &Expr, b: &Expr| (Box::new(flat(a)), Box::new(flat(b)));
    let kind = match &expr.kind {
        ExprKind::And(all) => return join(all, true),
        ExprKind::Or(all) => return join(all, false),
        ExprKind::Bool(true) => ExprKind::And(Vec::new()),
        ExprKind::Bool(false) => ExprKind::Or(Vec::new()),
        ExprKind::Not(inner) => ExprKind::Not(Box::new(flat(inner))),
        ExprKind::Neg(inner) => ExprKind::Neg(Box::new(flat(inner))),
        ExprKind::Element(array, index) => ExprKind::Element(array.clone(), Box::new(flat(index))),
        ExprKind::Compare(op, a, b) => {
            let (a, b) = two(a, b);
            ExprKind::Compare(*op, a, b)
        }
        ExprKind::Arith(op, a, b) => {
            let (a, b) = two(a, b);
            ExprKind::Arith(*op, a, b)
        }
        ExprKind::Select(c, a, b) => {
            let (a, b) = two(a, b);
            ExprKind::Select(Box::new(flat(c)), a, b)
        }
        ExprKind::Leaf(Leaf::Rise(inner)) => ExprKind::Leaf(Leaf::Rise(Box::new(flat(inner)))),
        ExprKind::Leaf(Leaf::Fall(inner)) => ExprKind::Leaf(Leaf::Fall(Box::new(flat(inner)))),
        ExprKind::Leaf(Leaf::Delay(on, inner, off)) => {
            ExprKind::Leaf(Leaf::Delay(*on, Box::new(flat(inner)), *off))
        }
        kind => kind.clone(),
    };
    Expr::new(kind, Span::default()).unplaced()
}

fn expr(kind: ExprKind<Leaf>) -> Expr {
    Expr::new(kind, Span::default())
}

fn leaf(names: &[&str]) -> Expr {
    let names = names.iter().map(|name| Name::new(*name, Span::default())).collect();
    expr(ExprKind::Leaf(Leaf::Name(Path { names })))
}

fn all_of(parts: Vec<Expr>) -> Expr {
    flat(&expr(ExprKind::And(parts)))
}

fn elapsed(step: &Path, limit: Expr) -> Expr {
    let mut names: Vec<&str> = step.names.iter().map(|name| name.text.as_str()).collect();
    names.push("t");
    expr(ExprKind::Compare(CompareOp::Ge, Box::new(leaf(&names)), Box::new(limit)))
}

fn wait(step: &Path, ns: u64) -> Expr {
    elapsed(step, expr(ExprKind::Leaf(Leaf::Duration(ns))))
}

fn condition(events: &[Name], guard: Option<&Expr>, mut more: Vec<Expr>) -> Expr {
    let events: Vec<Expr> = events.iter().map(|event| leaf(&[&event.text])).collect();
    let mut parts = Vec::new();
    if !events.is_empty() {
        parts.push(expr(ExprKind::Or(events)));
    }
    parts.extend(guard.cloned());
    parts.append(&mut more);
    all_of(parts)
}

/// A condition in a form that is equal for equal conditions.
pub(crate) fn shown(condition: &Expr) -> String {
    format!("{:?}", flat(condition).kind)
}

/// Reads conditions and lists of one chart as they are drawn.
pub(crate) struct Vocabulary {
    declarations: String,
    names: BTreeSet<String>,
    /// Conditions and lists that were read before.
    known: RefCell<BTreeMap<(bool, String), Result<String, String>>>,
    /// True if conditions and lists are structured text.
    is_st: bool,
}

impl Vocabulary {
    pub(crate) fn of(design: &Design) -> Self {
        let mut vocabulary = Vocabulary {
            is_st: false,
            declarations: String::new(),
            names: BTreeSet::new(),
            known: RefCell::default(),
        };
        design.charts.iter().for_each(|chart| vocabulary.add(&chart.items));
        for library in &design.libraries {
            let parameters = library.parameters.iter();
            let parameters = parameters.map(|one| Item::Declaration(one.declaration.clone()));
            vocabulary.add(&parameters.collect::<Vec<_>>());
            vocabulary.add(&library.items);
        }
        vocabulary
    }

    /// The same for texts in structured text.
    pub(crate) fn st(self) -> Self {
        Vocabulary { is_st: true, ..self }
    }

    fn add(&mut self, items: &[Item]) {
        for item in items {
            match item {
                Item::Declaration(one) => {
                    self.names.insert(one.name.text.clone());
                    // The type decides what `+` means.
                    let chart = Chart {
                        name: Name::new("x", Span::default()),
                        items: vec![item.clone()],
                        ..Chart::default()
                    };
                    let text =
                        graf::write_design(&Design { charts: vec![chart], ..Design::default() });
                    let body = text.split_once('{').map_or("", |(_, body)| body);
                    self.declarations.push_str(body.trim().trim_end_matches('}'));
                    self.declarations.push('\n');
                }
                Item::Step(one) => drop(self.names.insert(one.name.text.clone())),
                Item::Use(one) => drop(self.names.insert(one.name.text.clone())),
                Item::Action(one) => drop(self.names.insert(one.name.text.clone())),
                Item::MacroStep(one) => drop(self.names.insert(one.name.text.clone())),
                Item::Macro(one) => self.add(&one.items),
                Item::Enclosing(one) => {
                    self.names.insert(one.step.name.text.clone());
                    self.add(&one.items);
                }
                _ => {}
            }
        }
    }

    /// A drawn text with dotted names in backquotes: `a.b` is a name if nothing has the name `a`, and otherwise a member of `a`.
    pub(crate) fn quoted(&self, drawn: &str) -> String {
        quoted(drawn, |name| {
            let first = name.split('.').next().unwrap_or(name);
            self.names.contains(name) && !self.names.contains(first)
        })
    }

    fn parse(&self, rest: &str) -> Result<Design, String> {
        let text = format!("chart x {{\n{}\n{}\n}}\n", self.declarations, self.quoted(rest));
        let parsed = graf::parse(FileId(0), &text);
        if parsed.diagnostics.iter().any(grafsynth_ir::Diagnostic::is_error) {
            let found: Vec<&str> =
                parsed.diagnostics.iter().map(|it| it.message.as_str()).collect();
            return Err(format!("{rest}: {}", found.join("; ")));
        }
        parsed.design.ok_or_else(|| "nothing".to_owned())
    }

    /// The condition that a drawn text means, in a form that is equal for equal conditions.
    pub(crate) fn condition(&self, drawn: &str) -> Result<String, String> {
        self.remembered(true, drawn, || self.read_condition(drawn).map(|it| shown(&it)))
    }

    /// The list that a drawn text means, in the canonical form.
    pub(crate) fn list(&self, drawn: &str) -> Result<String, String> {
        self.remembered(false, drawn, || self.read_list(drawn))
    }

    fn remembered(
        &self,
        is_condition: bool,
        drawn: &str,
        read: impl Fn() -> Result<String, String>,
    ) -> Result<String, String> {
        let key = (is_condition, drawn.to_owned());
        if let Some(known) = self.known.borrow().get(&key) {
            return known.clone();
        }
        let read = read();
        self.known.borrow_mut().insert(key, read.clone());
        read
    }

    fn read_condition(&self, drawn: &str) -> Result<Expr, String> {
        if drawn == "1" && !self.is_st {
            return Ok(expr(ExprKind::And(Vec::new())));
        }
        self.guard(&if self.is_st { chart_language(drawn) } else { self.words(drawn) })
    }

    /// The condition that a text in the chart language means.
    pub(crate) fn in_words(&self, text: &str) -> Result<String, String> {
        self.guard(text).map(|it| shown(&it))
    }

    fn guard(&self, text: &str) -> Result<Expr, String> {
        let design = self.parse(&format!("step a_ \n step b_\n a_ -> b_ when {text}"))?;
        let items = design.charts.into_iter().flat_map(|chart| chart.items);
        let mut guard = items.filter_map(|item| match item {
            Item::Transition(one) => one.guard,
            _ => None,
        });
        guard.next_back().ok_or_else(|| format!("no condition in {text}"))
    }

    /// The signs of a drawing in the chart language.
    fn words(&self, drawn: &str) -> String {
        let mut out = String::new();
        let mut rest = drawn;
        let mut brackets: Vec<char> = Vec::new();
        while let Some(c) = rest.chars().next() {
            let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
            if is_word(c) || c == '`' {
                let end = if c == '`' {
                    rest[1..].find('`').map_or(rest.len(), |at| at + 2)
                } else {
                    rest.find(|c: char| !is_word(c)).unwrap_or(rest.len())
                };
                let (word, after) = rest.split_at(end);
                rest = after;
                let first = word.split('.').next().unwrap_or(word);
                match word.strip_prefix('X') {
                    Some(step) if !self.names.contains(first) && !step.is_empty() => {
                        // `3s/Xp` is the time of the step, `Xp` its activity.
                        let time = out.strip_suffix('/').map(str::to_owned);
                        let digits = |text: &str| {
                            text.rfind(|c: char| !is_word(c)).map_or(0, |at| {
                                at + text[at..].chars().next().map_or(1, char::len_utf8)
                            })
                        };
                        match time {
                            Some(before) => {
                                let at = digits(&before);
                                let limit = before[at..].to_owned();
                                out = format!("{}({step}.t >= {limit})", &before[..at]);
                            }
                            None => out.push_str(&format!("{step}.active")),
                        }
                    }
                    _ => out.push_str(word),
                }
                continue;
            }
            rest = &rest[c.len_utf8()..];
            match c {
                '[' => {
                    let is_index = out.ends_with(|c: char| is_word(c) || c == '`');
                    brackets.push(if is_index { ']' } else { ')' });
                    out.push(if is_index { '[' } else { '(' });
                }
                ']' => out.push(brackets.pop().unwrap_or(']')),
                c => out.push(c),
            }
        }
        out
    }

    /// The text of an action block: an action with its condition, or a list.
    pub(crate) fn row(&self, action: &mut Action) -> Result<(), String> {
        if ["force", "code"].contains(&action.qualifier.as_str()) {
            return Ok(());
        }
        action.indicator = self.quoted(&action.indicator);
        let text = if self.is_st { chart_language(&action.text) } else { action.text.clone() };
        if let Ok(design) = self.parse(&format!("step a_ {{ {text} }}")) {
            let items = design.charts.into_iter().flat_map(|chart| chart.items);
            for item in items {
                let Item::Step(step) = item else { continue };
                if let [only] = step.body.as_slice()
                    && let StepItemKind::Action { target, arguments, condition, .. } = &only.kind
                {
                    action.text = target_text(&target.text, arguments.is_some());
                    action.condition = condition.as_ref().map(shown);
                    return Ok(());
                }
            }
        }
        action.text = self.list(&action.text)?;
        Ok(())
    }

    fn read_list(&self, drawn: &str) -> Result<String, String> {
        let drawn = &if self.is_st { chart_language(drawn) } else { drawn.to_owned() };
        let design = self.parse(&format!("step a_ {{ entry {{ {drawn} }} }}"))?;
        let items = design.charts.into_iter().flat_map(|chart| chart.items);
        for item in items {
            if let Item::Step(step) = item
                && let Some(StepItemKind::Entry(block)) = step.body.first().map(|it| &it.kind)
            {
                return Ok(canonical(block));
            }
        }
        Err(format!("no list in {drawn}"))
    }
}

/// A text in which those names with dots that are meant are in backquotes.
pub(crate) fn quoted(text: &str, is_meant: impl Fn(&str) -> bool) -> String {
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let (mut out, mut rest) = (String::new(), text);
    while let Some(c) = rest.chars().next() {
        let end = match c {
            '`' | '"' => rest[1..].find(c).map_or(rest.len(), |at| at + 2),
            c if is_word(c) => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
            c => c.len_utf8(),
        };
        let (word, after) = rest.split_at(end);
        let is_name = word.contains('.') && is_word(c) && is_meant(word);
        out.push_str(&if is_name { format!("`{word}`") } else { word.to_owned() });
        rest = after;
    }
    out
}

fn target_text(name: &str, is_call: bool) -> String {
    format!("{}{}", plain(name), if is_call { "()" } else { "" })
}

/// Structured text in the chart language.
fn chart_language(st: &str) -> String {
    let is_word = |c: char| c.is_alphanumeric() || "_.#".contains(c);
    let mut out = String::new();
    let mut rest = st;
    while let Some(c) = rest.chars().next() {
        if c == '`' || c == '"' {
            let end = rest[1..].find(c).map_or(rest.len(), |at| at + 2);
            out.push_str(&rest[..end]);
            rest = &rest[end..];
            continue;
        }
        if !is_word(c) {
            out.push(c);
            rest = &rest[c.len_utf8()..];
            continue;
        }
        let (word, after) = rest.split_at(rest.find(|c| !is_word(c)).unwrap_or(rest.len()));
        rest = after;
        match word {
            "AND" | "OR" | "NOT" | "MOD" | "TRUE" | "FALSE" | "IF" => {
                out.push_str(&word.to_lowercase());
            }
            "THEN" => out.push('{'),
            "ELSE" => out.push_str("} else {"),
            "END_IF" => out.push('}'),
            "R_TRIG" => out.push_str("rise"),
            "F_TRIG" => out.push_str("fall"),
            "SEL" => {
                let (operands, after) = operands(rest);
                let [condition, no, yes] = operands.map(chart_language);
                out.push_str(&format!("(if {condition} then {yes} else {no})"));
                rest = after;
            }
            _ => out.push_str(&name_or_time(word)),
        }
    }
    out
}

/// The three operands in the parentheses at the beginning of a text, and what follows.
fn operands(text: &str) -> ([&str; 3], &str) {
    let mut all = [""; 3];
    let (mut depth, mut start, mut n) = (0, 1, 0);
    for (at, c) in text.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        if (depth == 1 && c == ',' || depth == 0) && n < 3 {
            all[n] = &text[start..at];
            (n, start) = (n + 1, at + 1);
        }
        if depth == 0 {
            return (all, &text[at + 1..]);
        }
    }
    (all, "")
}

/// A name or a duration of structured text.
fn name_or_time(word: &str) -> String {
    if let Some(time) = word.strip_prefix("T#") {
        let at = time.find(|c: char| !c.is_ascii_digit()).unwrap_or(time.len());
        let unit = if &time[at..] == "m" { "min" } else { &time[at..] };
        return format!("{} {unit}", &time[..at]);
    }
    match word.rsplit_once('.') {
        Some((step, "X")) => format!("{step}.active"),
        Some((step, "T")) => format!("{step}.t"),
        _ => word.to_owned(),
    }
}

/// A list as the formatter writes it.
fn canonical(block: &Block) -> String {
    let item = grafsynth_ir::chart::StepItem {
        kind: StepItemKind::Entry(block.clone()),
        span: Span::default(),
    };
    let step = grafsynth_ir::chart::Step {
        name: Name::new("a_", Span::default()),
        body: vec![item],
        ..Default::default()
    };
    let chart = Chart {
        name: Name::new("x", Span::default()),
        items: vec![Item::Step(step)],
        ..Chart::default()
    };
    graf::write_design(&Design { charts: vec![chart], ..Design::default() })
}

/// The chart as it must be read.
pub(crate) fn region(heading: String, items: &[Item], style: Style) -> Region {
    let mut region = Region { heading, ..Region::default() };
    let declarations = items.iter().filter_map(Item::as_declaration);
    let booleans: Vec<&str> = declarations
        .filter(|one| match &one.kind {
            DeclarationKind::Output { ty, .. } | DeclarationKind::Var { ty, len: None, .. } => {
                *ty == Type::Bool
            }
            _ => false,
        })
        .map(|one| one.name.text.as_str())
        .collect();
    for item in items {
        match item {
            Item::Step(one) => add_step(&mut region, one, "step", style, &booleans),
            Item::Enclosing(one) => {
                add_step(&mut region, &one.step, "enclosing", style, &booleans);
                region.inner.push(self::region(one.step.name.text.clone(), &one.items, style));
            }
            Item::MacroStep(one) => {
                let (is_initial, left) = role(one.role);
                let mut remarks = vec![format!("= {}", one.body.text)];
                remarks.extend(one.priority.map(|rank| format!("priority {rank}")));
                remarks.extend(about(&one.meta));
                let step = Step { is_initial, left, remarks, ..step("macro") };
                region.steps.insert(one.name.text.clone(), step);
            }
            Item::Macro(one) => {
                region.inner.push(self::region(format!("M {}", one.name.text), &one.items, style));
            }
            Item::Use(one) => {
                let name = format!("{} : {}", one.name.text, one.library.text);
                let arguments = one.arguments.iter().map(|argument| {
                    let name = plain(&argument.parameter.text);
                    match &argument.value {
                        ArgumentValue::Reads(expr) => format!("{name} = {}", shown(expr)),
                        ArgumentValue::Drives(target) => format!("{name} → {}", dotted(target)),
                    }
                });
                let remarks = arguments.chain(about(&one.meta)).collect();
                region.steps.insert(name, Step { remarks, ..step("step") });
            }
            _ => {}
        }
    }
    for item in items {
        if let Item::Transition(one) = item {
            add_transition(&mut region, one);
        }
    }
    region
}

/// A step without anything.
fn step(kind: &str) -> Step {
    Step {
        is_initial: false,
        kind: kind.to_owned(),
        left: String::new(),
        actions: Vec::new(),
        is_active: false,
        remarks: Vec::new(),
    }
}

/// The comment and the requirement tags.
fn about(meta: &Meta) -> Vec<String> {
    let mut all = Vec::new();
    if !meta.label.is_empty() {
        all.push(format!("\"{}\"", meta.label.replace('\\', "\\\\").replace('"', "\\\"")));
    }
    if !meta.req.is_empty() {
        all.push(format!("req {}", meta.req.join(", ")));
    }
    all
}

fn role(role: StepRole) -> (bool, String) {
    let left = match role {
        StepRole::MacroEntry => "E",
        StepRole::MacroExit => "S",
        StepRole::MacroEntryExit => "E S",
        StepRole::Plain | StepRole::Initial | StepRole::Final => "",
    };
    (role == StepRole::Initial, left.to_owned())
}

fn time(ns: u64) -> String {
    let units = [
        (3_600_000_000_000, "h"),
        (60_000_000_000, "min"),
        (1_000_000_000, "s"),
        (1_000_000, "ms"),
        (1000, "us"),
        (1, "ns"),
    ];
    let unit =
        units.iter().find(|(size, _)| ns.is_multiple_of(*size)).expect("a unit of one nanosecond");
    format!("{}{}", ns / unit.0, unit.1)
}

fn plain(name: &str) -> String {
    let is_plain = name.chars().all(|c| c.is_alphanumeric() || c == '_')
        && !name.starts_with(|c: char| c.is_ascii_digit())
        && !["and", "or", "not", "mod", "if", "true", "false", "otherwise", "rise", "fall"]
            .contains(&name);
    if is_plain { name.to_owned() } else { format!("`{name}`") }
}

fn dotted(path: &Path) -> String {
    path.names.iter().map(|name| plain(&name.text)).collect::<Vec<_>>().join(".")
}

fn add_step(
    region: &mut Region,
    step: &grafsynth_ir::chart::Step,
    kind: &str,
    style: Style,
    booleans: &[&str],
) {
    let (is_initial, mut left) = role(step.role);
    if step.activation_link {
        left = format!("{left} *").trim().to_owned();
    }
    let own = Path::from(step.name.clone());
    let (mut actions, mut remarks) = (Vec::new(), Vec::new());
    for item in &step.body {
        match &item.kind {
            StepItemKind::Priority(rank) => remarks.push(format!("priority {rank}")),
            StepItemKind::Budget(cost) => remarks.push(format!("budget {cost}")),
            kind => actions.push(match style {
                Style::Grafcet => grafcet_action(&own, kind),
                Style::Sfc => sfc_action(kind, booleans),
            }),
        }
    }
    if let Some(count) = step.count {
        let initial = count.initial.map(|n| format!(" = {n}")).unwrap_or_default();
        remarks.push(format!("count 0..{}{initial}", count.max));
    }
    remarks.extend(about(&step.meta));
    let kind = kind.to_owned();
    let read = Step { is_initial, kind, left, actions, is_active: false, remarks };
    region.steps.insert(step.name.text.clone(), read);
}

fn situation(target: &Path, order: &ForceOrder) -> String {
    let order = match order {
        ForceOrder::Situation(steps) => steps.iter().map(dotted).collect::<Vec<_>>().join(", "),
        ForceOrder::Init => "INIT".to_owned(),
        ForceOrder::Hold => "*".to_owned(),
    };
    format!("G {} {{{order}}}", dotted(target))
}

fn no_action() -> Action {
    Action {
        qualifier: String::new(),
        when: String::new(),
        text: String::new(),
        condition: None,
        is_forcing: false,
        indicator: String::new(),
    }
}

/// An action block of IEC 61131-3.
fn sfc_action(item: &StepItemKind, booleans: &[&str]) -> Action {
    let mut action = no_action();
    let st_time = |ns: u64| format!(" T#{}", time(ns).replace("min", "m"));
    match item {
        StepItemKind::Action { target, arguments, how, condition } => {
            action.text = target_text(&target.text, arguments.is_some());
            action.qualifier = match how {
                ActionHow::Bare => "N".to_owned(),
                ActionHow::After(ns) => format!("D{}", st_time(*ns)),
                ActionHow::For(ns) => format!("L{}", st_time(*ns)),
                ActionHow::Qualified(qualifier, ns) => {
                    format!("{qualifier:?}{}", ns.map(st_time).unwrap_or_default())
                }
            };
            action.condition = condition.as_ref().map(shown);
            return action;
        }
        StepItemKind::Entry(list) => {
            (action.qualifier, action.text) = ("P1".to_owned(), canonical(list));
        }
        StepItemKind::Exit(list) => {
            (action.qualifier, action.text) = ("P0".to_owned(), canonical(list));
        }
        StepItemKind::On { events, guard, actions } => {
            action.qualifier = "on".to_owned();
            let condition = condition(events, guard.as_ref(), Vec::new());
            let kind = StmtKind::If { condition, then: actions.clone(), otherwise: Vec::new() };
            action.text = canonical(&vec![Stmt { kind, span: Span::default() }]);
        }
        StepItemKind::Force { target, order } => {
            (action.qualifier, action.text) = ("force".to_owned(), situation(target, order));
        }
        StepItemKind::Task { name, cost, body } => {
            (action.qualifier, action.text) = (task(name, *cost), canonical(body));
        }
        StepItemKind::Code(code) => {
            (action.qualifier, action.text) = ("code".to_owned(), code_text(code));
        }
        StepItemKind::Priority(_) | StepItemKind::Budget(_) => {}
    }
    let mut indicators: Vec<&str> = Vec::new();
    for stmt in grafsynth_ir::chart::statements(item.list().map_or(&[], Vec::as_slice)) {
        if let StmtKind::Assign { target, .. } = &stmt.kind
            && let [name] = target.names.as_slice()
            && booleans.contains(&name.text.as_str())
            && !indicators.contains(&name.text.as_str())
        {
            indicators.push(&name.text);
        }
    }
    if let [only] = indicators.as_slice() {
        action.indicator = plain(only);
    }
    action
}

fn task(name: &Name, cost: Option<u32>) -> String {
    let cost = cost.map(|cost| format!(" cost {cost}")).unwrap_or_default();
    format!("task {}{cost}", plain(&name.text))
}

fn code_text(code: &Verbatim) -> String {
    let text = code.text.replace('\\', "\\\\").replace('"', "\\\"");
    format!("{} \"{text}\"", plain(&code.language))
}

fn grafcet_action(own: &Path, item: &StepItemKind) -> Action {
    let mut action = no_action();
    match item {
        StepItemKind::Action { target, arguments, how, condition: guard } => {
            action.text = plain(&target.text);
            if arguments.is_some() {
                action.text.push_str("()");
            }
            let mut more = Vec::new();
            match how {
                ActionHow::Bare => {}
                ActionHow::After(ns) => more.push(wait(own, *ns)),
                ActionHow::For(ns) => more.push(expr(ExprKind::Not(Box::new(wait(own, *ns))))),
                ActionHow::Qualified(qualifier, ns) => {
                    action.qualifier = qualifier.letters().to_owned();
                    action.qualifier.extend(ns.map(|ns| format!(" {}", time(ns))));
                }
            }
            if guard.is_some() || !more.is_empty() {
                action.condition = {
                    more.extend(guard.clone());
                    Some(shown(&all_of(more)))
                };
            }
        }
        StepItemKind::Entry(block) => {
            action.when = "↑".into();
            action.text = canonical(block);
        }
        StepItemKind::Exit(block) => {
            action.when = "↓".into();
            action.text = canonical(block);
        }
        StepItemKind::On { events, guard, actions } => {
            action.qualifier = "on".into();
            action.text = canonical(actions);
            action.condition = Some(shown(&condition(events, guard.as_ref(), Vec::new())));
        }
        StepItemKind::Force { target, order } => {
            action.is_forcing = true;
            action.text = situation(target, order);
        }
        StepItemKind::Task { name, cost, body } => {
            (action.qualifier, action.text) = (task(name, *cost), canonical(body));
        }
        StepItemKind::Code(code) => {
            (action.qualifier, action.text) = ("code".to_owned(), code_text(code));
        }
        StepItemKind::Priority(_) | StepItemKind::Budget(_) => {}
    }
    action
}

fn add_transition(region: &mut Region, one: &grafsynth_ir::chart::Transition) {
    let more = match &one.after {
        None => Vec::new(),
        Some((Length::Ns(ns), _)) => one.sources.iter().map(|step| wait(step, *ns)).collect(),
        Some((Length::Named(name), _)) => {
            let limit = expr(ExprKind::Leaf(Leaf::Name(name.clone())));
            one.sources.iter().map(|step| elapsed(step, limit.clone())).collect()
        }
    };
    let mut sources: Vec<String> = one.sources.iter().map(Path::to_string).collect();
    let mut targets: Vec<String> = one.targets.iter().map(Path::to_string).collect();
    sources.sort();
    targets.sort();
    let mut remarks: Vec<String> =
        one.priority.iter().map(|rank| format!("priority {rank}")).collect();
    remarks.extend(one.restart.then(|| "restart".to_owned()));
    remarks.extend(one.deadline_ns.map(|ns| format!("deadline {}", time(ns))));
    remarks.extend(about(&one.meta));
    let mut actions = Vec::new();
    if !one.actions.is_empty() {
        actions.push(Action {
            qualifier: String::new(),
            when: String::new(),
            text: canonical(&one.actions),
            condition: None,
            is_forcing: false,
            indicator: String::new(),
        });
    }
    region.transitions.push(Transition {
        name: one.name.as_ref().map(|name| name.text.clone()).unwrap_or_default(),
        sources,
        targets,
        receptivity: shown(&condition(&one.events, one.guard.as_ref(), more)),
        actions,
        remarks,
    });
}
