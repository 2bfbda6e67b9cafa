//! The elements and attributes of a document: checks which are allowed where, and reads those that are supported.

use std::collections::BTreeSet;

use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::{FileId, Name, Span};
use roxmltree::Node;

mod content;
mod markup;
mod rules;

use super::expr::{Ast, AstKind, Language};
use super::time;
use super::tree::{
    Act, Child, Datum, Handler, History, Machine, Role, Settings, State, StateKind, Transition,
    language,
};
use super::{GRAFSYNTH, SCXML, refuse};
use crate::codes;
use crate::findings::Findings;
use crate::graf::Limits;
use crate::xml::{self, Mapped};

/// Maximum number of events or targets of one transition.
const MAX_NAMES: usize = 10_000;
/// Maximum number of names in a document that follow another name in the same attribute: such a name of a few bytes may become an event
/// that takes a kilobyte of memory.
const MAX_FURTHER: usize = 50_000;

/// Unsupported elements and attributes, with an alternative for each.
const REFUSED: &[(&str, &str)] = &[
    ("invoke", "a controller has no sessions: write the invoked chart as a region of a <parallel>"),
    ("finalize", "it belongs to <invoke>, which is not supported"),
    ("script", "write its computations as <assign> in an <onentry>"),
    ("donedata", "events carry no data: assign a data element in the <onentry> of the <final>"),
    ("param", "events carry no data: assign a data element before the <send>"),
    ("content", "events carry no data: assign a data element before the <send>"),
    ("src", "write the value as `expr`"),
    ("eventexpr", "name the event with `event`"),
    ("targetexpr", "the chart sends events only to itself: remove `target`"),
    ("typeexpr", "remove it"),
    ("idlocation", "name the send with `id`, and use that name in <cancel>"),
    ("namelist", "events carry no data"),
    ("sendidexpr", "name the send with `sendid`"),
];

/// Reads a document. Reports and omits unsupported elements.
pub(super) struct Reader<'r, 't> {
    file: FileId,
    source: &'t str,
    language: Language,
    nesting: u32,
    pub(super) found: &'r mut Findings,
    /// Number of names so far that follow another name in their attribute.
    n_further: usize,
    data: Vec<Datum>,
    is_late: Option<Span>,
    /// Foreign namespaces that are already reported.
    foreign: BTreeSet<String>,
    /// Ignored elements that are already reported, by name.
    ignored: BTreeSet<&'static str>,
}

type N<'a, 't> = Node<'a, 't>;

/// Reads a document; `None` if it is not SCXML.
pub(super) fn machine<'t>(
    file: FileId,
    source: &'t str,
    document: &roxmltree::Document<'t>,
    limits: &Limits,
    found: &mut Findings,
) -> Option<(Machine, Language)> {
    let root = document.root_element();
    let tag = root.tag_name();
    if tag.name() != "scxml" {
        let span = xml::tag_span(file, root);
        found.report(|| {
            Diagnostic::error(
                codes::SCXML_ELEMENT,
                format!("expected <scxml> as the root element, found <{}>", tag.name()),
            )
            .at(span, "")
            .help("for another XML format, give it with --from")
        });
        return None;
    }
    let mut reader = Reader {
        file,
        source,
        language: Language::Ecmascript,
        nesting: limits.nesting,
        found,
        n_further: 0,
        data: Vec::new(),
        is_late: None,
        foreign: BTreeSet::new(),
        ignored: BTreeSet::new(),
    };
    if tag.namespace() != Some(SCXML) {
        reader.namespace(root);
        if tag.namespace().is_some() {
            return None;
        }
    }
    let machine = reader.root(root);
    Some((machine, reader.language))
}

impl<'t> Reader<'_, 't> {
    fn root(&mut self, root: N<'_, 't>) -> Machine {
        self.attributes(root);
        if let Some(model) = self.value(root, "datamodel") {
            match language(model.text.trim()) {
                Some(language) => self.language = language,
                None => {
                    let finding = refuse(
                        model.whole(),
                        &format!("the data model `{}`", model.text.trim()),
                        "the supported data models are null, ecmascript and c89, with integers and Booleans",
                    );
                    self.report(finding);
                }
            }
        }
        if let Some(binding) = self.value(root, "binding") {
            match binding.text.trim() {
                "early" => {}
                "late" => self.is_late = Some(binding.whole()),
                other => {
                    let finding = Diagnostic::error(
                        codes::SCXML_ATTRIBUTE,
                        format!("unknown binding `{other}`"),
                    )
                    .at(binding.whole(), "")
                    .help("write `early`");
                    self.report(finding);
                }
            }
        }
        match self.value(root, "version") {
            Some(version) if version.text.trim() == "1.0" => {}
            Some(version) => {
                let finding = Diagnostic::error(
                    codes::SCXML_ATTRIBUTE,
                    format!("unsupported SCXML version {}; expected 1.0", version.text.trim()),
                )
                .at(version.whole(), "");
                self.report(finding);
            }
            None => self.missing(root, "version"),
        }
        let settings = self.settings(root);
        let initial = self.names(root, "initial").unwrap_or_default();
        let name =
            self.value(root, "name").map(Mapped::trimmed).filter(|name| !name.text.is_empty());
        let name = name.map(|name| Name::new(name.text.as_ref(), name.whole()));
        let mut states = Vec::new();
        for child in self.children(root) {
            match child.tag_name().name() {
                "datamodel" => self.datamodel(child, true),
                _ => states.extend(self.state(child)),
            }
        }
        let span = self.tag(root);
        let data = std::mem::take(&mut self.data);
        Machine { span, name, initial, states, data, settings }
    }

    fn settings(&mut self, root: N<'_, 't>) -> Settings {
        let ours = |reader: &Self, name: &str| reader.value_in(root, Some(GRAFSYNTH), name);
        let mut settings = Settings::default();
        if let Some(tick) = ours(self, "tick") {
            match time::nanoseconds(tick.text.trim()) {
                Some(ns) if ns > 0 => settings.tick_ns = Some((ns, tick.whole())),
                Some(_) | None => self.report(
                    Diagnostic::error(codes::SCXML_TIME, format!("invalid tick `{}`", tick.text))
                        .at(tick.whole(), "")
                        .help("write a number with ms or s, as in `10ms`"),
                ),
            }
        }
        let mut number = |name: &str| {
            let value = ours(self, name)?;
            match value.text.trim().parse::<u32>() {
                Ok(number) if (1..=65_535).contains(&number) => Some((number, value.whole())),
                Ok(_) | Err(_) => {
                    self.report(
                        Diagnostic::error(
                            codes::SCXML_ATTRIBUTE,
                            format!(
                                "invalid {name} `{}`: expected a number from 1 to 65535",
                                value.text
                            ),
                        )
                        .at(value.whole(), ""),
                    );
                    None
                }
            }
        };
        settings.queue = number("queue");
        settings.limit = number("limit");
        if let Some(events) = ours(self, "events") {
            match events.text.trim() {
                "any" => {}
                "exclusive" => settings.exclusive = Some(events.whole()),
                other => self.report(
                    Diagnostic::error(codes::SCXML_ATTRIBUTE, format!("unknown value `{other}` of g:events"))
                        .at(events.whole(), "")
                        .help(
                            "write `exclusive` if two events never arrive in one reaction, otherwise `any`",
                        ),
                ),
            }
        }
        let list = |value: Option<Mapped<'_>>| {
            let names = value.iter().flat_map(Mapped::words);
            names.map(|(word, span)| Name::new(word, span)).collect::<Vec<_>>()
        };
        settings.inputs = list(ours(self, "input"));
        settings.internals = list(ours(self, "internal"));
        settings
    }

    fn datamodel(&mut self, node: N<'_, 't>, at_root: bool) {
        for data in self.children(node) {
            let span = self.tag(data);
            if self.language == Language::Null {
                self.report(refuse(
                    span,
                    "a data element in the null data model",
                    "write datamodel=\"ecmascript\" on <scxml>",
                ));
                continue;
            }
            let written = self.value(data, "expr");
            let content = Mapped::content(self.file, self.source, data).trimmed();
            if written.is_some() && !content.text.is_empty() {
                self.two_values(data, &content);
            }
            let text = written.or_else(|| (!content.text.is_empty()).then_some(content));
            if let Some(late) = self.is_late.filter(|_| !at_root && text.is_some()) {
                let finding = refuse(
                    span,
                    "a value that is assigned when its state is first entered (binding=\"late\")",
                    "assign it in the <onentry> of the state",
                );
                self.report(finding.at(late, "requested here"));
            }
            if data.children().any(|child| child.is_element()) {
                let finding =
                    refuse(span, "an element as a value", "use one data element for each value");
                self.report(finding);
                continue;
            }
            let value = text.map(|text| self.expression(&text));
            let Some(id) = self.needed_name(data, "id") else { continue };
            if id.text.starts_with('_') {
                self.report(
                    Diagnostic::error(
                        codes::SCXML_LOCATION,
                        format!("`{id}` is reserved: names with `_` belong to SCXML"),
                    )
                    .at(id.span, "")
                    .help("choose a name that begins with a letter"),
                );
                continue;
            }
            let range = self.range(data);
            let role = self.role(data);
            let label = self.label(data);
            // A rejected value must not be reported as missing.
            let value = match value {
                Some(None) => Some(Ast::of(AstKind::Int(0), id.span)),
                Some(value) => value,
                None => None,
            };
            self.data.push(Datum { id, value, range, role, label });
        }
    }

    fn label(&self, node: N<'_, 't>) -> String {
        let label = self.value_in(node, Some(GRAFSYNTH), "label");
        label.map(|label| label.text.trim().to_owned()).unwrap_or_default()
    }

    fn range(&mut self, data: N<'_, 't>) -> Option<(i64, i64)> {
        let range = self.value_in(data, Some(GRAFSYNTH), "range")?;
        let bounds = range.text.split_once("..").and_then(|(lo, hi)| {
            Some((lo.trim().parse::<i64>().ok()?, hi.trim().parse::<i64>().ok()?))
        });
        let fits = |value: i64| i32::try_from(value).is_ok();
        match bounds {
            Some((lo, hi)) if lo <= hi && fits(lo) && fits(hi) => Some((lo, hi)),
            Some(_) | None => {
                self.report(
                    Diagnostic::error(
                        codes::SCXML_RANGE,
                        format!("invalid range `{}`", range.text),
                    )
                    .at(range.whole(), "")
                    .help("write the smallest and the largest value within 32 bits, as in `0..99`"),
                );
                None
            }
        }
    }

    fn role(&mut self, data: N<'_, 't>) -> Role {
        let Some(role) = self.value_in(data, Some(GRAFSYNTH), "role") else {
            return Role::Variable;
        };
        match role.text.trim() {
            "variable" => Role::Variable,
            "input" => Role::Input,
            "output" => Role::Output,
            other => {
                self.report(
                    Diagnostic::error(codes::SCXML_ATTRIBUTE, format!("unknown role `{other}`"))
                        .at(role.whole(), "")
                        .help("write `input`, `output` or `variable`"),
                );
                Role::Variable
            }
        }
    }

    /// Reads a state and its contents. The depth of the document bounds the recursion.
    fn state(&mut self, node: N<'_, 't>) -> Option<State> {
        let kind = match node.tag_name().name() {
            "state" => StateKind::State,
            "parallel" => StateKind::Parallel,
            "final" => StateKind::Final,
            _ => return None,
        };
        let span = self.tag(node);
        let mut state = State {
            kind,
            id: self.name(node, "id"),
            span,
            label: self.label(node),
            initial: self.names(node, "initial").map(|targets| (targets, Vec::new())),
            entry: Vec::new(),
            exit: Vec::new(),
            histories: Vec::new(),
            children: Vec::new(),
        };
        for child in self.children(node) {
            match child.tag_name().name() {
                "onentry" => {
                    let acts = self.acts(child);
                    state.entry.push(Handler { acts, span: xml::node_span(self.file, child) });
                }
                "onexit" => {
                    let acts = self.acts(child);
                    state.exit.push(Handler { acts, span: xml::node_span(self.file, child) });
                }
                "transition" => {
                    let transition = self.transition(child);
                    state.children.push(Child::Transition(transition));
                }
                "initial" => {
                    let (targets, content) = self.pseudo(child, "initial");
                    if state.initial.is_some() {
                        let span = self.tag(child);
                        self.report(
                            Diagnostic::error(
                                codes::SCXML_ELEMENT,
                                "the state has two initial targets",
                            )
                            .at(span, "again here")
                            .help("keep either the attribute `initial` or the element <initial>"),
                        );
                    }
                    state.initial = Some((targets, content));
                }
                "history" => {
                    let history = self.history(child);
                    state.histories.push(history);
                }
                "datamodel" => self.datamodel(child, false),
                _ => state.children.extend(self.state(child).map(Child::State)),
            }
        }
        if let Some((targets, _)) = &state.initial
            && targets.is_empty()
        {
            state.initial = None;
            self.missing_target(node);
        }
        if state.initial.is_some() && state.states().next().is_none() {
            state.initial = None;
            self.report(
                Diagnostic::error(
                    codes::SCXML_ELEMENT,
                    "the state has `initial` but no child states",
                )
                .at(span, ""),
            );
        }
        Some(state)
    }

    fn missing_target(&mut self, node: N<'_, 't>) {
        let span = self.tag(node);
        self.report(
            Diagnostic::error(codes::SCXML_TARGET, "missing target state")
                .at(span, "")
                .help("name the state with `target`, or with the attribute `initial`"),
        );
    }

    /// Reads the single transition of an `initial` or `history` element.
    fn pseudo(&mut self, node: N<'_, 't>, what: &str) -> (Vec<Name>, Vec<Act>) {
        let transitions = self.children(node);
        let mut all = transitions.into_iter();
        let Some(only) = all.next() else {
            let span = self.tag(node);
            self.report(
                Diagnostic::error(codes::SCXML_ELEMENT, format!("<{what}> has no <transition>"))
                    .at(span, "")
                    .help("write <transition target=\"..\"/> in it"),
            );
            return (Vec::new(), Vec::new());
        };
        if let Some(second) = all.next() {
            let span = self.tag(second);
            self.report(
                Diagnostic::error(
                    codes::SCXML_ELEMENT,
                    format!("<{what}> has more than one <transition>"),
                )
                .at(span, "again here"),
            );
        }
        for attribute in ["event", "cond"] {
            if let Some(value) = self.value(only, attribute) {
                self.report(
                    Diagnostic::error(
                        codes::SCXML_ATTRIBUTE,
                        format!("`{attribute}` is not allowed on the transition of <{what}>"),
                    )
                    .at(value.whole(), "this transition is always taken immediately"),
                );
            }
        }
        let targets = self.names(only, "target").unwrap_or_default();
        if targets.is_empty() {
            self.missing_target(only);
        }
        let content = self.acts(only);
        (targets, content)
    }

    fn history(&mut self, node: N<'_, 't>) -> History {
        let is_deep = match self.value(node, "type") {
            None => false,
            Some(kind) => match kind.text.trim() {
                "shallow" => false,
                "deep" => true,
                other => {
                    self.report(
                        Diagnostic::error(
                            codes::SCXML_ATTRIBUTE,
                            format!("unknown history type `{other}`"),
                        )
                        .at(kind.whole(), "")
                        .help("write `shallow` or `deep`"),
                    );
                    false
                }
            },
        };
        let id = self.name(node, "id");
        let (targets, content) = self.pseudo(node, "history");
        History { id, span: self.tag(node), is_deep, targets, content }
    }

    /// Warns about an event descriptor with characters that are not allowed in event names (SCXML 1.0, §3.12.1 and the schema).
    fn check_event(&mut self, event: &Name) {
        let text = event.text.as_str();
        let is_strange = |c: char| {
            c.is_ascii_punctuation() && !matches!(c, '.' | '_' | '-' | ':' | '*' | '#' | '/')
        };
        let Some(strange) = text.chars().find(|c| is_strange(*c)) else { return };
        let finding = Diagnostic::warning(
            codes::SCXML_ATTRIBUTE,
            format!("`{strange}` in the event name `{text}`"),
        );
        let bare = text.trim_matches([',', ';', '|']);
        let is_list = !bare.is_empty() && !bare.contains(is_strange);
        let is_time = text.starts_with("after(") || text.starts_with("every(");
        self.report(if is_list {
            finding
                .at(event.span, "the separator becomes part of the name")
                .help("separate events with spaces, as in event=\"open key\"")
                .fix(event.span, bare)
        } else if is_time {
            finding
                .at(event.span, "SCXML has no timed transitions; this waits for an event of that name")
                .help("send a delayed event in <onentry> and wait for it: <send event=\"late\" delay=\"5s\"/>")
        } else {
            finding
                .at(event.span, "this waits for an event of exactly that name")
                .help("use letters, digits, `_`, `-` and `.`; write conditions in `cond`")
        });
    }

    fn transition(&mut self, node: N<'_, 't>) -> Transition {
        let is_internal = match self.value(node, "type") {
            None => false,
            Some(kind) => match kind.text.trim() {
                "external" => false,
                "internal" => true,
                other => {
                    self.report(
                        Diagnostic::error(
                            codes::SCXML_ATTRIBUTE,
                            format!("unknown transition type `{other}`"),
                        )
                        .at(kind.whole(), "")
                        .help("write `external` or `internal`"),
                    );
                    false
                }
            },
        };
        let events = self.names(node, "event");
        events.iter().flatten().for_each(|event| self.check_event(event));
        let targets = self.names(node, "target");
        let has_condition = self.value(node, "cond").is_some();
        let condition = self.condition(node);
        if events.is_none() && targets.is_none() && !has_condition {
            let span = self.tag(node);
            self.report(
                Diagnostic::error(
                    codes::SCXML_ATTRIBUTE,
                    "the transition has no event, condition or target",
                )
                .at(span, "it would fire again and again without end"),
            );
        }
        if let Some(targets) = &targets
            && targets.is_empty()
        {
            self.missing_target(node);
        }
        let has_event = events.is_some();
        let events = events.unwrap_or_default();
        if has_event && events.is_empty() {
            let span = self.tag(node);
            self.report(
                Diagnostic::error(codes::SCXML_ATTRIBUTE, "the attribute `event` is empty")
                    .at(span, "no event name")
                    .help("omit it if the transition waits for no event"),
            );
        }
        Transition {
            span: self.tag(node),
            events,
            has_event,
            condition,
            targets: targets.unwrap_or_default(),
            is_internal,
            content: self.acts(node),
        }
    }
}
