//! Name resolution: the body that contains the name first, then the surrounding bodies, then the chart, then `chart.name`.
#![allow(
    clippy::wildcard_enum_match_arm,
    reason = "a name is looked up in the few symbols that contain names"
)]

use super::codes;
use super::context::{
    Alias, AliasValue, Entry, FlatNames, InstanceId, Lowering, Outcome, ScopeId, Symbol,
};
use crate::chart::{Leaf, Path};
use crate::diag::{Diagnostic, ErrorReported, Notation, nearest};
use crate::expr::ExprKind;
use crate::net::{Driver, InputKind, StepId};
use crate::span::{Name, Span};
use itertools::Itertools as _;

/// Pins that do not belong to a signal of the chart.
pub(super) const BOARD_SIGNALS: [&str; 8] =
    ["clock", "tick", "reset", "busy", "oe", "vcc", "gnd", "nc"];
/// The kind of a name in a board, for [`Lowering::wanting`]; a board declares nothing.
pub(super) const BOARD_SIGNAL: &str = "signal";

/// Limit of the candidates that all suggestions together may examine: a file with thousands of unknown names does not have typing errors.
const MAX_CANDIDATES: usize = 500_000;

/// The maximum length of a chain of parameters that refer to each other: more than the nesting depth of charts.
const MAX_FOLLOWING: u32 = 64;

/// A step or a macro-step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StepLike {
    Step(StepId),
    MacroStep(InstanceId),
}

/// The attributes of a step that an expression can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Attribute {
    /// `active`
    Active,
    /// `t`
    Elapsed,
    /// `T`
    LastElapsed,
    /// `done`
    Done,
    /// `complete`, of a macro-step: its exit step is active.
    Complete,
}

/// What a path in an expression refers to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Resolved {
    Symbol(Symbol),
    Attribute(StepLike, Attribute),
}

/// The reason why a path cannot be resolved.
enum Unknown {
    /// The name at this position of the path is not declared in this scope (`None`: not visible at all).
    Name(usize, Option<ScopeId>),
    /// The item before this position contains no names.
    NoInside(usize, Symbol),
    /// The declaration was rejected.
    Broken,
}

impl<'a> Lowering<'a> {
    /// Declares a name in a body; a second declaration is reported and ignored.
    pub(super) fn declare(&mut self, scope: ScopeId, name: &'a Name, symbol: Symbol) -> bool {
        if name.text.is_empty() {
            return false;
        }
        let home = self.scopes[scope].home;
        if let Some(earlier) = self.scopes[home].names.get(name.text.as_str()) {
            let first = earlier.span;
            // Within one body the reason is obvious; between bodies the help explains it.
            let help = match (earlier.body == scope, self.is_statechart()) {
                (true, _) => "give one of them another name",
                (false, true) => {
                    "rename one of them: traces show names in states and regions without their path, so each must be unique in its chart"
                }
                (false, false) => {
                    "rename one of them: traces show names in enclosing steps without their path, so each must be unique in its chart or macro; or make the part a macro, whose steps are named after the macro-step"
                }
            };
            self.report(
                Diagnostic::error(codes::DUPLICATE_NAME, format!("`{name}` is declared twice"))
                    .at(name.span, "declared again here")
                    .at(first, "first declared here")
                    .help(help),
            );
            return false;
        }
        let entry = Entry { symbol, span: name.span, body: scope };
        self.scopes[home].names.insert(&name.text, entry);
        // The name is also declared in its own body, for paths such as `e.x`.
        self.scopes[scope].names.insert(&name.text, entry);
        true
    }

    /// Declares a history in the body of its state. Traces do not show histories, so several states may use the same name: `a.H`, `b.H`. If the name is
    /// used only once, it is visible in the whole chart.
    pub(super) fn declare_history(&mut self, body: ScopeId, name: &'a Name, symbol: Symbol) {
        let home = self.scopes[body].home;
        let text = name.text.as_str();
        let entry = Entry { symbol, span: name.span, body };
        match self.scopes[home].names.get(text) {
            Some(Entry { symbol: Symbol::History(_), body: other, .. }) if *other != body => {
                self.scopes[home].names.remove(text);
                self.shared_histories.insert((home, text));
            }
            None if self.shared_histories.contains(&(home, text))
                && !self.scopes[body].names.contains_key(text) => {}
            _ => {
                self.declare(body, name, symbol);
                return;
            }
        }
        self.scopes[body].names.insert(text, entry);
    }

    /// The full name of an item that is declared in a body; the name is then in use.
    pub(super) fn full_name(&mut self, scope: ScopeId, name: &Name) -> Name {
        let full = format!("{}{}", self.scopes[scope].prefix, name.text);
        self.taken.insert(full.clone());
        Name::new(full, name.span)
    }

    /// The object that a name refers to, as seen from a body.
    pub(super) fn find(&self, scope: ScopeId, text: &str) -> Option<Symbol> {
        if let Some(flat) = &self.flat {
            return flat.others.get(text).or_else(|| flat.steps.get(text)).copied();
        }
        let mut next = Some(scope);
        while let Some(scope) = next {
            if let Some(entry) = self.scopes[scope].names.get(text) {
                return Some(self.follow(entry.symbol));
            }
            next = self.scopes[scope].parent;
        }
        if let Some(chart) = self.charts.get(text) {
            return Some(Symbol::Chart(*chart));
        }
        // A name that contains dots but is stored as one name: `g.E`.
        let (first, rest) = text.split_once('.').filter(|(first, _)| !first.is_empty())?;
        let mut symbol = self.find(scope, first)?;
        for part in rest.split('.') {
            let inside = self.inside(symbol)?;
            symbol = self.follow(self.scopes[inside].names.get(part)?.symbol);
        }
        Some(symbol)
    }

    /// The object that a parameter refers to, if its argument is a name; otherwise the parameter itself.
    fn follow(&self, symbol: Symbol) -> Symbol {
        let Symbol::Alias(alias) = symbol else { return symbol };
        let Alias { scope, value } = self.aliases[alias];
        let (path, of_expression) = match value {
            AliasValue::Path(path) => (path, Symbol::Broken),
            AliasValue::Expr(expr) => match &expr.kind {
                ExprKind::Leaf(Leaf::Name(path)) => (path, symbol),
                _ => return symbol,
            },
        };
        if self.following.get() >= MAX_FOLLOWING {
            return Symbol::Broken;
        }
        self.following.set(self.following.get() + 1);
        let found = self.walk(scope, &path.names).ok();
        self.following.set(self.following.get() - 1);
        found.unwrap_or(of_expression)
    }

    /// True in a library chart that is used, and in all bodies inside it.
    pub(super) fn is_in_instance(&self, scope: ScopeId) -> bool {
        let mut next = Some(scope);
        while let Some(scope) = next {
            if self.scopes[scope].is_instance {
                return true;
            }
            next = self.scopes[scope].parent;
        }
        false
    }

    /// The body inside an item, if it has one.
    pub(super) fn inside(&self, symbol: Symbol) -> Option<ScopeId> {
        match symbol {
            Symbol::Chart(scope) => Some(scope),
            Symbol::MacroStep(instance) => Some(self.instances[instance].scope),
            Symbol::Step(step) => self.bodies.get(&step).copied(),
            _ => None,
        }
    }

    fn walk(&self, scope: ScopeId, names: &[Name]) -> Result<Symbol, Unknown> {
        let Some((first, rest)) = names.split_first() else { return Err(Unknown::Broken) };
        if let Some(flat) = &self.flat {
            return self.walk_flat(flat, names, false);
        }
        let mut symbol = self.find(scope, &first.text).ok_or(Unknown::Name(0, None))?;
        for (index, name) in rest.iter().enumerate() {
            if symbol == Symbol::Broken {
                return Err(Unknown::Broken);
            }
            let inside = self.inside(symbol).ok_or(Unknown::NoInside(index + 1, symbol))?;
            let entry = self.scopes[inside].names.get(name.text.as_str());
            symbol = self.follow(entry.ok_or(Unknown::Name(index + 1, Some(inside)))?.symbol);
        }
        if symbol == Symbol::Broken { Err(Unknown::Broken) } else { Ok(symbol) }
    }

    /// Resolves a path in a finished net. Names there contain dots, and the name of a single chart may precede them. If a step and a signal have the
    /// same name, the step is used where a step is needed.
    fn walk_flat(
        &self,
        flat: &FlatNames,
        names: &[Name],
        step_first: bool,
    ) -> Result<Symbol, Unknown> {
        let look = |names: &[Name]| {
            let joined = names.iter().map(|name| name.text.as_str()).join(".");
            let (first, second) =
                if step_first { (&flat.steps, &flat.others) } else { (&flat.others, &flat.steps) };
            first.get(&joined).or_else(|| second.get(&joined)).copied()
        };
        if let Some(symbol) = look(names) {
            return Ok(symbol);
        }
        match names.split_first() {
            Some((first, rest)) if !rest.is_empty() && first.text == self.net.name.text => {
                look(rest).ok_or(Unknown::Name(1, None))
            }
            _ => Err(Unknown::Name(0, None)),
        }
    }

    /// The object that a path refers to; nothing is reported if there is no such object.
    pub(super) fn peek(&self, scope: ScopeId, path: &Path) -> Option<Resolved> {
        self.attribute(scope, path)
            .map(|(like, attribute)| Resolved::Attribute(like, attribute))
            .or_else(|| self.walk(scope, &path.names).ok().map(Resolved::Symbol))
    }

    /// `s.active` and similar: the last name is an attribute, and the names before it are a step.
    fn attribute(&self, scope: ScopeId, path: &Path) -> Option<(StepLike, Attribute)> {
        let (last, before) = path.names.split_last()?;
        let attribute = match last.text.as_str() {
            "active" => Attribute::Active,
            "t" => Attribute::Elapsed,
            "T" => Attribute::LastElapsed,
            "done" => Attribute::Done,
            "complete" => Attribute::Complete,
            _ => return None,
        };
        let found = match &self.flat {
            Some(flat) => self.walk_flat(flat, before, true),
            None => self.walk(scope, before),
        };
        match found.ok()? {
            // `complete` is defined only for macro-steps.
            Symbol::Step(_) if attribute == Attribute::Complete => None,
            Symbol::Step(step) => Some((StepLike::Step(step), attribute)),
            Symbol::MacroStep(instance) => Some((StepLike::MacroStep(instance), attribute)),
            _ => None,
        }
    }

    /// What a path in an expression refers to.
    pub(super) fn resolve(&mut self, scope: ScopeId, path: &Path) -> Outcome<Resolved> {
        if let Some(found) = self.peek(scope, path) {
            return Ok(found);
        }
        match self.walk(scope, &path.names) {
            Ok(symbol) => Ok(Resolved::Symbol(symbol)),
            Err(unknown) => Err(self.report_unknown(scope, &path.names, &unknown)),
        }
    }

    /// The object that a path outside expressions refers to; attributes are not allowed there.
    pub(super) fn symbol(&mut self, scope: ScopeId, path: &Path) -> Outcome<Symbol> {
        self.walk(scope, &path.names)
            .map_err(|unknown| self.report_unknown(scope, &path.names, &unknown))
    }

    /// Looks up names that this keyword, such as `step`, would declare.
    pub(super) fn wanting<T>(
        &mut self,
        wanted: &'static str,
        find: impl FnOnce(&mut Self) -> T,
    ) -> T {
        let before = std::mem::replace(&mut self.wanted, wanted);
        let found = find(self);
        self.wanted = before;
        found
    }

    /// Like [`Lowering::symbol`], for a name without dots.
    pub(super) fn symbol_of(&mut self, scope: ScopeId, name: &Name) -> Outcome<Symbol> {
        let names = std::slice::from_ref(name);
        self.walk(scope, names).map_err(|unknown| self.report_unknown(scope, names, &unknown))
    }

    fn report_unknown(
        &mut self,
        scope: ScopeId,
        names: &[Name],
        unknown: &Unknown,
    ) -> ErrorReported {
        match *unknown {
            Unknown::Broken => self.already_told(),
            Unknown::NoInside(at, symbol) => {
                let (owner, name) = (&names[at - 1], &names[at]);
                let kind = self.kind(symbol);
                let is_time = at + 1 == names.len() && matches!(name.text.as_str(), "t" | "T");
                let message = if is_time {
                    format!("`{owner}` is {kind} and has no time")
                } else {
                    format!("`{owner}` is {kind} and has no part named `{name}`")
                };
                let mut finding = Diagnostic::error(codes::WRONG_KIND, message)
                    .at(name.span, "")
                    .at(owner.span, kind);
                if matches!(symbol, Symbol::Step(_)) {
                    finding = finding.help(format!(
                        "a step has `{owner}.active`, `{owner}.t` and `{owner}.done`"
                    ));
                } else if is_time {
                    finding = self.time_of_another(finding, symbol, owner, name);
                }
                self.report(finding)
            }
            Unknown::Name(at, inside) => {
                let name = &names[at];
                let message = match inside {
                    Some(_) => format!("`{}` contains no `{name}`", names[at - 1]),
                    None => format!("unknown name `{name}`"),
                };
                let mut finding =
                    Diagnostic::error(codes::UNKNOWN_NAME, message).at(name.span, "not declared");
                if self.suggestions < MAX_CANDIDATES {
                    finding = self.suggest(finding, scope, name, inside);
                }
                self.report(finding)
            }
        }
    }

    /// Help for `Q.t`: suggests the time of the steps that drive the output.
    fn time_of_another(
        &self,
        finding: Diagnostic,
        symbol: Symbol,
        owner: &Name,
        name: &Name,
    ) -> Diagnostic {
        const SHOWN: usize = 3;
        let mut steps: Vec<&str> = Vec::new();
        if let Symbol::Output(output) = symbol {
            let uses = || self.uses.get(output.index()).into_iter().flatten();
            // If there are several steps, the one that the transition leaves is suggested.
            let is_left = uses().any(|one| self.left.contains(&one.step));
            for one in uses().filter(|one| !is_left || self.left.contains(&one.step)) {
                let step = self.net.steps[one.step].name.text.as_str();
                if !steps.contains(&step) {
                    steps.push(step);
                }
            }
        }
        let written: Vec<String> =
            steps.iter().take(SHOWN).map(|step| format!("`{step}.{name}`")).collect();
        match &written[..] {
            [] => finding.help("only steps and timers have a time, as in `s.t >= 3 s`"),
            [only] if steps.len() == 1 => finding
                .help(format!(
                    "only steps and timers have a time; step `{}` drives `{owner}`, so write {only}",
                    steps[0]
                ))
                .fix(owner.span, steps[0]),
            several => finding.help(format!(
                "only steps and timers have a time; write the time of a step that drives `{owner}`: {}",
                several.join(" or ")
            )),
        }
    }

    fn suggest(
        &mut self,
        finding: Diagnostic,
        scope: ScopeId,
        name: &Name,
        inside: Option<ScopeId>,
    ) -> Diagnostic {
        if inside.is_none() && self.charts.len() > 1 {
            let owner = self.charts.iter().find(|(_, chart)| {
                **chart != scope && self.scopes[**chart].names.contains_key(name.text.as_str())
            });
            if let Some((chart, _)) = owner {
                return finding
                    .help(format!("chart `{chart}` declares it: write `{chart}.{name}`"))
                    .fix(name.span, format!("{chart}.{name}"));
            }
        }
        let mut candidates: Vec<&str> = Vec::new();
        if let Some(flat) = &self.flat {
            candidates.extend(flat.others.keys().chain(flat.steps.keys()).map(String::as_str));
        }
        let mut next = inside.or((!self.scopes.is_empty()).then_some(scope));
        while let Some(scope) = next {
            candidates.extend(self.scopes[scope].names.keys());
            next = if inside.is_some() { None } else { self.scopes[scope].parent };
        }
        self.suggestions += candidates.len();
        let is_clock = matches!(name.text.to_ascii_lowercase().as_str(), "clk" | "ck" | "cp");
        let near = match self.wanted {
            BOARD_SIGNAL if is_clock => Some("clock"),
            BOARD_SIGNAL => nearest(&name.text, candidates.into_iter().chain(BOARD_SIGNALS)),
            _ => nearest(&name.text, candidates),
        };
        match near {
            Some(near) => finding.help(format!("did you mean `{near}`?")).fix(name.span, near),
            None if inside.is_some() => finding.help("declare it there, or write another name"),
            None if self.wanted == BOARD_SIGNAL => finding.help(format!(
                "write the name of an input, output, variable or step of the chart, or one of {}; or remove the line",
                BOARD_SIGNALS.map(|signal| format!("`{signal}`")).join(", ")
            )),
            None => finding
                .help(format!("declare it, as in `{} {name}`, or write another name", self.wanted))
                .help_in(Notation::Iec, format!("declare `{name}`, or write another name")),
        }
    }

    /// The word for the kind of a symbol, with its article.
    pub(super) fn kind(&self, symbol: Symbol) -> &'static str {
        match symbol {
            Symbol::Input(input) => match self.net.inputs[input].kind {
                InputKind::Pin => "an input",
                InputKind::Extern => "an extern condition",
                InputKind::Event | InputKind::InternalEvent => "an event",
            },
            Symbol::Output(output) => match self.net.outputs[output].driver {
                Driver::Extern { .. } => "an extern action",
                _ => "an output",
            },
            _ => symbol.kind(),
        }
    }

    /// For items whose error was reported at their declaration: stops without another finding.
    pub(super) fn already_told(&mut self) -> ErrorReported {
        ErrorReported
    }

    /// Reports for example "m is an input, not a step".
    pub(super) fn wrong_kind(
        &mut self,
        span: Span,
        name: &dyn std::fmt::Display,
        symbol: Symbol,
        wanted: &str,
    ) -> ErrorReported {
        if symbol == Symbol::Broken {
            return self.already_told();
        }
        let kind = self.kind(symbol);
        self.report(
            Diagnostic::error(codes::WRONG_KIND, format!("`{name}` is {kind}, not {wanted}"))
                .at(span, format!("{wanted} is needed here"))
                .help(match (symbol, wanted) {
                    (Symbol::Step(_) | Symbol::MacroStep(_), "a value") => {
                        format!("write `{name}.active` for its activity")
                    }
                    _ => format!("write the name of {wanted}, or declare one"),
                }),
        )
    }
}

impl Symbol {
    /// The word for it, with its article.
    pub(super) fn kind(self) -> &'static str {
        match self {
            Symbol::Const(_) => "a constant",
            Symbol::Input(_) => "an input",
            Symbol::Output(_) => "an output",
            Symbol::Action(_) => "a controlled action",
            Symbol::Var(_) => "a variable",
            Symbol::Timer(_) => "a timer",
            Symbol::Step(_) => "a step",
            Symbol::MacroStep(_) => "a macro-step",
            Symbol::Macro(_) => "a macro",
            Symbol::Transition(_) => "a transition",
            Symbol::Chart(_) => "a chart",
            Symbol::History(_) => "a history",
            Symbol::Alias(_) => "an expression",
            Symbol::Broken => "unknown",
        }
    }
}
