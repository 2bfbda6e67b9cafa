//! Reads rules text into a chart.

mod design;

use grafsynth_ir::Gather;
use grafsynth_ir::diag::ErrorReported;
use std::collections::BTreeSet;

use design::{Builder, Listed, Options};
use grafsynth_ir::chart::{Expr, Leaf};
use grafsynth_ir::diag::{Diagnostic, any_error, nearest};
use grafsynth_ir::expr::ExprKind;
use grafsynth_ir::{FileId, Name, Span};

use crate::codes;
use crate::graf::lexer::Lexer;
use crate::graf::numbers::{Numbers, slice};
use crate::graf::parser::{Parse, Parser, short};
use crate::graf::token::Kind;
use crate::graf::{CHECK_FIRST, Limits, Parsed, sorted, too_large};

/// The words that begin a list.
const LISTS: [&str; 5] = ["Step", "Transition", "Input", "Output", "Marking"];

/// Reads rules with the default limits.
#[must_use]
pub fn parse(file: FileId, text: &str) -> Parsed {
    parse_within(file, text, &Limits::default())
}

/// Reads rules with the given limits.
#[must_use]
pub fn parse_within(file: FileId, text: &str, limits: &Limits) -> Parsed {
    if let Some(finding) = too_large(file, text, limits) {
        return Parsed { diagnostics: vec![finding], ..Parsed::default() };
    }
    let options = options(text);
    let declared: String =
        options.iter().map(|(start, end)| format!("{}\n", &text[*start..*end])).collect();
    let numbers = Numbers::declared_in(&declared);

    if text.len() > CHECK_FIRST {
        // For a large text with errors, no tree is built.
        let mut parser = Parser::new(file, text, Some(&numbers), *limits, true);
        Rules::default().read(&mut parser);
        let diagnostics = parser.findings.finish();
        if any_error(&diagnostics) {
            return Parsed { diagnostics: sorted(diagnostics), ..Parsed::default() };
        }
    }
    let mut parser = Parser::new(file, text, Some(&numbers), *limits, false);
    let mut rules = Rules::default();
    rules.read(&mut parser);
    let Parser { findings, comments, .. } = parser;
    let names = |list: &[Name]| list.iter().map(|name| name.text.clone()).gather();
    let (steps, transitions, outputs) =
        (names(&rules.steps), names(&rules.transitions), names(&rules.outputs));
    let listed = Listed { steps, transitions, outputs };
    let mut builder =
        Builder { text, rules, listed, findings, options: Options::default(), has_source: false };
    for (start, end) in options {
        builder.option(file, &text[..end], start, &numbers, limits);
    }
    let design = builder.design(file);
    if builder.rules.is_empty() && builder.options.is_empty() {
        builder.findings.report(|| {
            Diagnostic::error(codes::NO_CHART, "no rules in this text")
                .at(Span::new(file, 0, 0), "expected `Step` and the names of steps")
                .help("list steps and transitions, then write the rules after `Transitions:` and `Steps:`")
        });
    }
    let diagnostics = sorted(builder.findings.finish());
    let has_rules = !builder.rules.steps.is_empty() || !builder.rules.transition_rules.is_empty();
    let design = (has_rules || !any_error(&diagnostics)).then_some(design);
    Parsed { design, diagnostics, comments }
}

/// The start and end of the texts of all `# option:` lines.
fn options(text: &str) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut lexer = Lexer::new(text);
    let mut comment = |start: u32, end: u32| {
        let (start, end) = (start as usize, end as usize);
        let line = &text[start..end];
        let inner = line.trim_start_matches('#').trim_start();
        if let Some(option) = inner.strip_prefix("option:") {
            found.push((end - option.len(), end));
        }
    };
    while lexer.next(&mut comment, &mut |_| {}).kind != Kind::End {}
    found
}

/// A rule as written.
struct Rule {
    label: Name,
    left: Option<Expr>,
    /// The right side: names, and whether `@` precedes each.
    right: Vec<(bool, Name)>,
    span: Span,
}

/// The text as written: lists and rules.
#[derive(Default)]
struct Rules {
    steps: Vec<Name>,
    transitions: Vec<Name>,
    inputs: Vec<Name>,
    outputs: Vec<Name>,
    marking: Vec<Name>,
    /// Span of the first list and its names; `step_list` is the span of the list of steps.
    lists: Option<Span>,
    step_list: Option<Span>,
    seen: BTreeSet<&'static str>,
    transition_rules: Vec<Rule>,
    step_rules: Vec<Rule>,
    /// Labels of transition rules with an error: they have a rule, although it is not read.
    unread: BTreeSet<String>,
}

/// The section of the text that is being parsed.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Section {
    Lists,
    Transitions,
    Steps,
}

impl Rules {
    /// Whether the text contains no list and no rule.
    fn is_empty(&self) -> bool {
        self.seen.is_empty() && self.transition_rules.is_empty() && self.step_rules.is_empty()
    }

    fn read(&mut self, parser: &mut Parser<'_>) {
        let mut section = Section::Lists;
        while parser.kind(0) != Kind::End {
            let before = parser.peek(0).start;
            if self.part(parser, &mut section).is_err() {
                parser.skip_to_line(before);
            }
            parser.depth = 0;
            if parser.peek(0).start == before {
                parser.advance();
            }
        }
    }

    fn part(&mut self, parser: &mut Parser<'_>, section: &mut Section) -> Parse<()> {
        let word = parser.word(0);
        if parser.kind(1) == Kind::Colon && parser.peek(0).new_line {
            let heading = [("Transitions", Section::Transitions), ("Steps", Section::Steps)]
                .into_iter()
                .find(|(known, _)| known.eq_ignore_ascii_case(word));
            // `steps: |- lamp` is the rule of a step that is named `steps`.
            let ends_line = parser.peek(2).new_line || parser.kind(2) == Kind::End;
            if let Some((known, heading)) = heading
                && (known == word || ends_line)
            {
                let span = parser.here();
                if known != word {
                    parser.report(|| {
                        Diagnostic::error(
                            codes::UNKNOWN_WORD,
                            format!("unknown part `{}` of the rules", short(word)),
                        )
                        .at(span, format!("did you mean `{known}`?"))
                        .fix(span, known)
                    });
                }
                parser.advance();
                parser.advance();
                *section = heading;
                return Ok(());
            }
        }
        if let Some(list) = LISTS.iter().find(|list| **list == word)
            && parser.kind(1) != Kind::Colon
        {
            return self.list(parser, list);
        }
        match section {
            Section::Lists => Err(unknown_list(parser)),
            Section::Transitions => {
                let label = parser.name_at(parser.peek(0));
                let rule = rule(parser).inspect_err(|_| {
                    self.unread.insert(label.text);
                })?;
                parser.keep(&mut self.transition_rules, rule);
                Ok(())
            }
            Section::Steps => {
                let rule = rule(parser)?;
                parser.keep(&mut self.step_rules, rule);
                Ok(())
            }
        }
    }

    /// Parses `Step p1, p2`; a word without names is an empty list.
    fn list(&mut self, parser: &mut Parser<'_>, list: &'static str) -> Parse<()> {
        let span = parser.here();
        parser.advance();
        let mut names = Vec::new();
        let mut written: Vec<&str> = Vec::new();
        let mut without_comma = None;
        let start = parser.peek(0).start;
        if parser.is_name_beside(0) {
            loop {
                let token = parser.peek(0);
                let name = parser.name("a name")?;
                if parser.findings.rest == 0 {
                    written.push(slice(parser.text, token));
                }
                parser.keep(&mut names, name);
                if parser.eat(Kind::Comma) {
                    continue;
                }
                if !parser.is_name_beside(0) {
                    break;
                }
                without_comma.get_or_insert(parser.previous_end);
            }
        }
        if let Some(end) = without_comma {
            let whole = parser.span_from(start);
            let here = Span { start: end, end, ..whole };
            parser.report(|| {
                Diagnostic::error(
                    codes::UNEXPECTED,
                    format!("no comma between the names of the list `{list}`"),
                )
                .plural(format!("`{list}`"), "no comma between the names of the lists", "")
                .at(here, "expected `,`")
                .help("write a comma between all names")
                .fix(whole, written.join(", "))
            });
        }
        let line = parser.span_from(span.start);
        self.lists.get_or_insert(line);
        if *list == *"Step" {
            self.step_list.get_or_insert(line);
        }
        if !self.seen.insert(list) {
            parser.report(|| {
                Diagnostic::error(codes::LIST_TWICE, format!("the list `{list}` is given twice"))
                    .at(span, "second list")
                    .help("put all names into one list")
            });
        }
        match list {
            "Step" => self.steps.append(&mut names),
            "Transition" => self.transitions.append(&mut names),
            "Input" => self.inputs.append(&mut names),
            "Output" => self.outputs.append(&mut names),
            _ => self.marking.append(&mut names),
        }
        // A list ends with its line.
        if parser.kind(0) != Kind::End && !parser.peek(0).new_line {
            return Err(parser.unexpected("`,` or the end of the line"));
        }
        Ok(())
    }
}

fn unknown_list(parser: &mut Parser<'_>) -> ErrorReported {
    let word = parser.word(0);
    if word.is_empty() {
        return parser.unexpected("a list such as `Step p1, p2`");
    }
    let span = parser.here();
    let near = nearest(word, LISTS.into_iter().chain(["Transitions", "Steps"]));
    parser.report(|| {
        let finding = Diagnostic::error(codes::UNKNOWN_WORD, format!("unknown part `{}` of the rules", short(word)));
        finding.unknown_word(span, near, "the lists are Step, Transition, Input, Output and Marking; rules follow `Transitions:` and `Steps:`")
    });
    ErrorReported
}

/// The first factor and the span of the word `after`, if this is `red*after` or `red*go*after`.
fn before_after(left: &Expr) -> Option<(String, Span)> {
    let name = |expr: &Expr| match &expr.kind {
        ExprKind::Leaf(Leaf::Name(path)) => Some(path.to_string()),
        _ => None,
    };
    let ExprKind::And(factors) = &left.kind else { return None };
    let last = factors.last()?;
    (name(last)? == "after").then_some(())?;
    Some((name(factors.first()?)?, last.span))
}

/// The text from the next token to the `|-` or the end of the line, for a message.
fn rest_of_line(parser: &Parser<'_>) -> String {
    let text = &parser.text[parser.peek(0).start as usize..];
    let end = text.find(['|', '\n', '*']).unwrap_or(text.len());
    short(text[..end].trim())
}

/// Parses `t1: p1*m |- @p2*@p3`.
fn rule(parser: &mut Parser<'_>) -> Parse<Rule> {
    let start = parser.peek(0).start;
    let label = parser.name("the label of a rule")?;
    parser.expect(Kind::Colon, "`:` after the label of a rule")?;
    let left = if parser.kind(0) == Kind::Yields { None } else { Some(parser.expr()?) };
    if matches!(parser.kind(0), Kind::Number | Kind::Fraction)
        && let Some((step, word)) = left.as_ref().and_then(before_after)
    {
        let length = rest_of_line(parser);
        parser.report(|| {
            Diagnostic::error(codes::UNEXPECTED, "a rule has no clause `after`")
                .at(word, "not allowed on the left side of a rule")
                .help(format!("compare the time of the step: `({step}.t >= {length})`"))
        });
        return Err(ErrorReported);
    }
    if parser.kind(0) != Kind::Yields && (parser.peek(0).new_line || parser.kind(0) == Kind::End) {
        return Err(parser.missing(
            "the `|-` of this rule is missing",
            "a rule of a step is `p1: |- output`, and one of a transition is `t1: p1*input |- @p2`",
        ));
    }
    parser.expect(Kind::Yields, "`|-`")?;
    let mut right = Vec::new();
    while !parser.peek(0).new_line && parser.kind(0) != Kind::End {
        let is_next = parser.eat(Kind::At);
        let what = if is_next { "the name of a step" } else { "`@` and a step, or an output" };
        let name = parser.name(what)?;
        parser.keep(&mut right, (is_next, name));
        if !matches!(parser.kind(0), Kind::Star | Kind::MiddleDot | Kind::AndSign | Kind::Comma)
            && parser.word(0) != "and"
        {
            break;
        }
        parser.advance();
    }
    if !parser.peek(0).new_line && parser.kind(0) != Kind::End {
        return Err(parser.unexpected("`*` or the end of the line"));
    }
    Ok(Rule { label, left, right, span: parser.span_from(start) })
}
