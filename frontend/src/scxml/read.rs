//! The elements and attributes of a document: what may stand where, and what of it is read.

use std::collections::BTreeSet;

use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::{FileId, Name, Span};
use roxmltree::Node;

mod content;
mod rules;

use rules::RULES;

use super::expr::{self, Ast, AstKind, Language};
use super::time;
use super::tree::{
    Act, Child, Datum, Handler, History, Machine, Role, Settings, State, StateKind, Transition,
    language,
};
use super::{GRAFSYNTH, SCXML, refuse};
use crate::codes;
use crate::graf::Limits;
use crate::graf::parser::Findings;
use crate::xml::{self, Mapped};

/// Events or targets of one transition at most.
const MAX_NAMES: usize = 10_000;
/// Names of a whole document at most that stand behind another one in their attribute: a name of a few bytes becomes an event of a kilobyte.
const MAX_FURTHER: usize = 50_000;

/// Elements and attributes that need more than a controller has, with what to do instead.
const REFUSED: &[(&str, &str)] = &[
    (
        "invoke",
        "a controller starts no other session: draw what it would run as a region of a <parallel>",
    ),
    ("finalize", "it belongs to <invoke>, which is refused"),
    ("script", "write what it computes as <assign> in an <onentry>"),
    (
        "donedata",
        "an event of a controller carries nothing: set a datum in the <onentry> of the <final>",
    ),
    ("param", "an event of a controller carries nothing: set a datum before it is sent"),
    ("content", "an event of a controller carries nothing: set a datum before it is sent"),
    ("src", "write the value as `expr`"),
    ("eventexpr", "name the event with `event`"),
    ("targetexpr", "an event goes to the chart itself: leave `target` out"),
    ("typeexpr", "leave it out"),
    ("idlocation", "name the send with `id`, and give that name to <cancel>"),
    ("namelist", "an event of a controller carries nothing"),
    ("sendidexpr", "name the send with `sendid`"),
];

/// Reads a document; every element that is refused is left out and reported.
pub(super) struct Reader<'r, 't> {
    file: FileId,
    source: &'t str,
    language: Language,
    nesting: u32,
    pub(super) found: &'r mut Findings,
    /// Names so far that stand behind another one in their attribute.
    n_further: usize,
    data: Vec<Datum>,
    is_late: Option<Span>,
    /// Namespaces of others that were mentioned already.
    foreign: BTreeSet<String>,
    /// Elements without a meaning that were mentioned already, by name.
    ignored: BTreeSet<&'static str>,
}

type N<'a, 't> = Node<'a, 't>;

/// Reads a document; none if it is no SCXML.
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
                format!("the outermost element is <{}>, not <scxml>", tag.name()),
            )
            .at(span, "")
            .help("is it another XML format? say which with --from")
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
    fn report(&mut self, finding: impl Into<Box<Diagnostic>>) {
        let finding: Box<Diagnostic> = finding.into();
        self.found.report(|| *finding);
    }

    fn tag(&self, node: N<'_, 't>) -> Span {
        xml::tag_span(self.file, node)
    }

    fn namespace(&mut self, root: N<'_, 't>) {
        let span = self.tag(root);
        let declared = root.tag_name().namespace();
        let finding = match declared {
            Some(other) => Diagnostic::error(
                codes::SCXML_NAMESPACE,
                format!("the document is in the namespace {other}, not in that of SCXML"),
            ),
            None => Diagnostic::warning(
                codes::SCXML_NAMESPACE,
                "the document names no namespace; it is read as SCXML all the same",
            ),
        };
        self.report(
            finding.at(span, "").help(format!("write <scxml xmlns=\"{SCXML}\" version=\"1.0\">")),
        );
    }

    /// True for an element of SCXML: in its namespace, or in none where the document has none.
    fn is_ours(&self, node: N<'_, 't>) -> bool {
        let root = node.document().root_element().tag_name().namespace();
        node.tag_name().namespace() == root
    }

    /// The children of SCXML that may stand here; others are reported.
    fn children<'a>(&mut self, node: N<'a, 't>) -> Vec<N<'a, 't>> {
        let name = node.tag_name().name();
        let allowed =
            RULES.iter().find(|rule| rule.name == name).map_or(&[][..], |rule| rule.children);
        let mut kept = Vec::new();
        let mut text_reported = false;
        for child in node.children() {
            if child.is_text() {
                let stray = child.text().is_some_and(|text| !text.trim().is_empty());
                // The value of a datum is the one thing written between tags.
                if stray && !text_reported && !matches!(name, "data" | "assign") {
                    text_reported = true;
                    let span = xml::node_span(self.file, child);
                    self.report(
                        Diagnostic::error(
                            codes::SCXML_ELEMENT,
                            format!("text stands in <{name}>, which has none"),
                        )
                        .at(span, ""),
                    );
                }
                continue;
            }
            if !child.is_element() {
                continue;
            }
            let tag = child.tag_name().name();
            if !self.is_ours(child) {
                self.foreign_element(child, node);
                continue;
            }
            if !allowed.contains(&tag) {
                self.misplaced(child, name, allowed);
                continue;
            }
            if let Some((what, help)) = REFUSED.iter().find(|(refused, _)| *refused == tag) {
                let span = self.tag(child);
                self.report(refuse(span, &format!("<{what}>"), help));
                continue;
            }
            self.attributes(child);
            kept.push(child);
        }
        kept
    }

    fn misplaced(&mut self, child: N<'_, 't>, parent: &str, allowed: &[&str]) {
        let tag = child.tag_name().name();
        let span = self.tag(child);
        if let Some((what, help)) = REFUSED.iter().find(|(refused, _)| *refused == tag) {
            self.report(refuse(span, &format!("<{what}>"), help));
            return;
        }
        let is_known = RULES.iter().any(|rule| rule.name == tag);
        let message = if is_known {
            format!("<{tag}> cannot stand in <{parent}>")
        } else {
            format!("SCXML has no element <{tag}>")
        };
        let mut finding = Diagnostic::error(codes::SCXML_ELEMENT, message).at(span, "");
        if let Some(near) = nearest(tag, allowed.iter().copied()).filter(|_| !is_known) {
            finding = finding.help(format!("did you mean <{near}>?"));
        } else if allowed.is_empty() {
            finding = finding.help(format!("nothing stands in <{parent}>"));
        } else {
            finding = finding.help(format!("in it may stand {}", allowed.join(", ")));
        }
        self.report(finding);
    }

    /// An element of another namespace: kept by others for themselves, unless it would do something.
    fn foreign_element(&mut self, child: N<'_, 't>, parent: N<'_, 't>) {
        let tag = child.tag_name();
        let span = self.tag(child);
        let space = tag.namespace().unwrap_or_default();
        let does_something = matches!(
            parent.tag_name().name(),
            "onentry" | "onexit" | "transition" | "if" | "foreach"
        );
        if does_something || space == "http://www.w3.org/2001/XInclude" {
            self.report(refuse(
                span,
                &format!("<{}> of {space}", tag.name()),
                "write what it does with the elements of SCXML",
            ));
        } else if space == GRAFSYNTH {
            self.report(
                Diagnostic::error(
                    codes::SCXML_ELEMENT,
                    format!("grafsynth has no element <{}> of its own", tag.name()),
                )
                .at(span, ""),
            );
        } else if self.foreign.insert(space.to_owned()) {
            self.report(
                Diagnostic::warning(
                    codes::SCXML_IGNORED,
                    format!("what belongs to the namespace {space} is not read"),
                )
                .at(span, "here first"),
            );
        }
    }

    /// Reports attributes that an element does not have.
    fn attributes(&mut self, node: N<'_, 't>) {
        let name = node.tag_name().name();
        let known =
            RULES.iter().find(|rule| rule.name == name).map_or(&[][..], |rule| rule.attributes);
        for attribute in node.attributes() {
            let span = xml::name_span(self.file, attribute);
            let word = attribute.name();
            match attribute.namespace() {
                None if known.contains(&word) => {
                    if let Some((_, help)) = REFUSED.iter().find(|(refused, _)| *refused == word) {
                        self.report(refuse(span, &format!("the attribute {word}"), help));
                    }
                }
                None => {
                    let mut finding = Diagnostic::error(
                        codes::SCXML_ATTRIBUTE,
                        format!("<{name}> has no attribute {word}"),
                    )
                    .at(span, "");
                    if let Some(near) = nearest(word, known.iter().copied()) {
                        finding = finding.help(format!("did you mean {near}?")).fix(span, near);
                    } else if !known.is_empty() {
                        finding = finding.help(format!("it has {}", known.join(", ")));
                    }
                    self.report(finding);
                }
                Some(GRAFSYNTH) => {
                    let ours: &[&str] = match name {
                        "scxml" => &["tick", "queue", "limit", "events", "input", "internal"],
                        "data" => &["range", "role", "label"],
                        "state" | "parallel" | "final" => &["label"],
                        _ => &[],
                    };
                    if !ours.contains(&word) {
                        let mut finding = Diagnostic::error(
                            codes::SCXML_ATTRIBUTE,
                            format!("grafsynth has no attribute {word} for <{name}>"),
                        )
                        .at(span, "");
                        if !ours.is_empty() {
                            finding = finding.help(format!("it has {}", ours.join(", ")));
                        }
                        self.report(finding);
                    }
                }
                // Languages and other things that XML itself defines.
                Some("http://www.w3.org/XML/1998/namespace")
                | Some("http://www.w3.org/2001/XMLSchema-instance") => {}
                Some(space) => {
                    if self.foreign.insert(space.to_owned()) {
                        self.report(
                            Diagnostic::warning(
                                codes::SCXML_IGNORED,
                                format!("what belongs to the namespace {space} is not read"),
                            )
                            .at(span, "here first"),
                        );
                    }
                }
            }
        }
    }

    /// The value of an attribute.
    fn value(&self, node: N<'_, 't>, name: &str) -> Option<Mapped<'t>> {
        self.value_in(node, None, name)
    }

    fn value_in(&self, node: N<'_, 't>, space: Option<&str>, name: &str) -> Option<Mapped<'t>> {
        node.attributes()
            .find(|attribute| attribute.name() == name && attribute.namespace() == space)
            .map(|attribute| Mapped::value(self.file, self.source, attribute))
    }

    /// The value of an attribute as one name.
    fn name(&mut self, node: N<'_, 't>, attribute: &str) -> Option<Name> {
        let value = self.value(node, attribute)?.trimmed();
        if value.text.is_empty() || value.text.contains([' ', '\t', '\n', '\r']) {
            let tag = node.tag_name().name();
            self.report(
                Diagnostic::error(
                    codes::SCXML_ATTRIBUTE,
                    format!("the {attribute} of <{tag}> is not one name: {:?}", value.text),
                )
                .at(value.whole(), ""),
            );
            return None;
        }
        Some(Name::new(value.text.as_ref(), value.whole()))
    }

    /// As [`Reader::name`], where an element cannot do without.
    fn needed_name(&mut self, node: N<'_, 't>, attribute: &str) -> Option<Name> {
        if self.value(node, attribute).is_none() {
            self.missing(node, attribute);
        }
        self.name(node, attribute)
    }

    fn missing(&mut self, node: N<'_, 't>, attribute: &str) {
        let tag = node.tag_name().name();
        let span = self.tag(node);
        self.report(
            Diagnostic::error(
                codes::SCXML_ATTRIBUTE,
                format!("<{tag}> has no attribute {attribute}, which it needs"),
            )
            .at(span, ""),
        );
    }

    /// The value of an attribute as names between blanks.
    fn names(&mut self, node: N<'_, 't>, attribute: &str) -> Option<Vec<Name>> {
        let value = self.value(node, attribute)?;
        let names: Vec<Name> =
            value.words().take(MAX_NAMES + 1).map(|(word, span)| Name::new(word, span)).collect();
        if names.len() > MAX_NAMES {
            self.report(
                Diagnostic::error(
                    codes::SCXML_SIZE,
                    format!("the attribute {attribute} holds more than {MAX_NAMES} names"),
                )
                .at(self.tag(node), "")
                .help("write several transitions"),
            );
            return Some(Vec::new());
        }
        let before = self.n_further;
        self.n_further += names.len().saturating_sub(1);
        if self.n_further > MAX_FURTHER {
            if before <= MAX_FURTHER {
                self.report(
                    Diagnostic::error(
                        codes::SCXML_SIZE,
                        format!("the lists of names of the document hold more than {MAX_FURTHER}"),
                    )
                    .at(self.tag(node), "here the count was reached")
                    .help(
                        "give events a common beginning, as in `key.a` and `key.b`, and name that",
                    ),
                );
            }
            return Some(Vec::new());
        }
        Some(names)
    }

    fn expression(&mut self, text: &Mapped<'_>) -> Option<Ast> {
        match expr::parse(text, self.language, self.nesting) {
            Ok(ast) => Some(ast),
            Err(finding) => {
                self.report(finding);
                None
            }
        }
    }

    /// An expression that is no array.
    fn scalar(&mut self, text: &Mapped<'_>) -> Option<Ast> {
        let ast = self.expression(text)?;
        if matches!(ast.kind, AstKind::Array(_)) {
            self.report(refuse(
                ast.span,
                "an array as a value",
                "assign its elements one by one; an array stands in <data> and <foreach>",
            ));
            return None;
        }
        Some(ast)
    }

    fn condition(&mut self, node: N<'_, 't>) -> Option<Ast> {
        let text = self.value(node, "cond")?;
        self.scalar(&text)
    }

    fn root(&mut self, root: N<'_, 't>) -> Machine {
        self.attributes(root);
        if let Some(model) = self.value(root, "datamodel") {
            match language(model.text.trim()) {
                Some(language) => self.language = language,
                None => {
                    let finding = refuse(
                        model.whole(),
                        &format!("the data model {}", model.text.trim()),
                        "the expressions read are those of null, ecmascript and c89, as far as integers and Booleans reach",
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
                        format!("the binding is `{other}`"),
                    )
                    .at(binding.whole(), "")
                    .help("it is `early`");
                    self.report(finding);
                }
            }
        }
        match self.value(root, "version") {
            Some(version) if version.text.trim() == "1.0" => {}
            Some(version) => {
                let finding = Diagnostic::error(
                    codes::SCXML_ATTRIBUTE,
                    format!("the version is {}, and 1.0 is read", version.text.trim()),
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
                    Diagnostic::error(codes::SCXML_TIME, format!("the tick is `{}`", tick.text))
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
                                "{name} is `{}`, and a number from 1 to 65535 is needed",
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
                    Diagnostic::error(codes::SCXML_ATTRIBUTE, format!("events are `{other}`"))
                        .at(events.whole(), "")
                        .help(
                            "write `exclusive` where never two arrive in one reaction, else `any`",
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
                    "a datum of the null data model",
                    "write datamodel=\"ecmascript\" at <scxml>",
                ));
                continue;
            }
            let written = self.value(data, "expr");
            let content = Mapped::content(self.file, self.source, data).trimmed();
            let text = written.or_else(|| (!content.text.is_empty()).then_some(content));
            if let Some(late) = self.is_late.filter(|_| !at_root && text.is_some()) {
                let finding = refuse(
                    span,
                    "a value that is given when its state is first entered (binding=\"late\")",
                    "assign it in the <onentry> of the state",
                );
                self.report(finding.at(late, "said here"));
            }
            if data.children().any(|child| child.is_element()) {
                let finding =
                    refuse(span, "an element as a value", "use one datum for each value in it");
                self.report(finding);
                continue;
            }
            let value = text.map(|text| self.expression(&text));
            let Some(id) = self.needed_name(data, "id") else { continue };
            if id.text.starts_with('_') {
                self.report(
                    Diagnostic::error(
                        codes::SCXML_LOCATION,
                        format!("{id} is a name that SCXML keeps for the system"),
                    )
                    .at(id.span, "")
                    .help("begin it with a letter"),
                );
                continue;
            }
            let range = self.range(data);
            let role = self.role(data);
            let label = self.label(data);
            // A value that was refused is no value that is missing.
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
                    Diagnostic::error(codes::SCXML_RANGE, format!("the range is `{}`", range.text))
                        .at(range.whole(), "")
                        .help(
                            "write the least and the greatest value within 32 bits, as in `0..99`",
                        ),
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
                    Diagnostic::error(codes::SCXML_ATTRIBUTE, format!("the role is `{other}`"))
                        .at(role.whole(), "")
                        .help("it is `input`, `output` or `variable`"),
                );
                Role::Variable
            }
        }
    }

    /// A state with everything in it. The depth of the document bounds the recursion.
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
                                "the state says twice where it is entered",
                            )
                            .at(span, "again here")
                            .help("keep the attribute or the element"),
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
                    "the state has nothing in it where it could be entered",
                )
                .at(span, ""),
            );
        }
        Some(state)
    }

    fn missing_target(&mut self, node: N<'_, 't>) {
        let span = self.tag(node);
        self.report(
            Diagnostic::error(codes::SCXML_TARGET, "no state is named where the way leads to")
                .at(span, "")
                .help("name the state with `target`, or with the attribute `initial`"),
        );
    }

    /// The one transition of an `initial` or `history`.
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
                        format!("the transition of <{what}> has `{attribute}`"),
                    )
                    .at(value.whole(), "it is always taken, without waiting"),
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
                            format!("the history is `{other}`"),
                        )
                        .at(kind.whole(), "")
                        .help("it is `shallow` or `deep`"),
                    );
                    false
                }
            },
        };
        let id = self.name(node, "id");
        let (targets, content) = self.pseudo(node, "history");
        History { id, span: self.tag(node), is_deep, targets, content }
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
                            format!("the transition is `{other}`"),
                        )
                        .at(kind.whole(), "")
                        .help("it is `external` or `internal`"),
                    );
                    false
                }
            },
        };
        let events = self.names(node, "event");
        let targets = self.names(node, "target");
        let has_condition = self.value(node, "cond").is_some();
        let condition = self.condition(node);
        if events.is_none() && targets.is_none() && !has_condition {
            let span = self.tag(node);
            self.report(
                Diagnostic::error(
                    codes::SCXML_ATTRIBUTE,
                    "the transition has neither event nor condition nor target",
                )
                .at(span, "it would be taken for ever"),
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
                Diagnostic::error(codes::SCXML_ATTRIBUTE, "the transition names no event")
                    .at(span, "its attribute `event` is empty")
                    .help("leave it out for a transition that waits for none"),
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
