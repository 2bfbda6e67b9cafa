//! Renders a user template over the JSON of a net, with bounded work.

use crate::codes;
use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::{FileId, Span};
use minijinja::syntax::SyntaxConfig;
use minijinja::value::{Rest, Serde, ValueKind};
use minijinja::{Environment, Error, ErrorKind, UndefinedBehavior, Value, context};
use std::io;

/// The maximum number of instructions of one rendering. This many take a few seconds; a chart of 10 000 steps needs about a tenth of them.
pub const FUEL: u64 = 50_000_000;

/// The maximum number of bytes of one rendering.
pub const MOST_TEXT: usize = 64 << 20;

/// The maximum depth of recursive macros, such as those for expressions.
const RECURSION: usize = 400;

/// Filters whose output size depends on a number, and the largest number allowed: each call counts as one instruction, however large its output is.
const BY_NUMBER: [&str; 6] = ["batch", "format", "indent", "round", "slice", "tojson"];
const MOST_NUMBER: f64 = 10_000.0;

/// The prefix that marks an error of the template engine as a refusal by the template; the reason follows.
const REFUSED: &str = "refused: ";

/// A user template.
#[derive(Debug, Clone, Copy)]
pub struct Template<'a> {
    /// The file that findings point into.
    pub file: FileId,
    /// Its path, for output that names its origin: `{{ template }}`.
    pub path: &'a str,
    /// The text, in the language of Jinja2.
    pub text: &'a str,
}

/// The text that a template generates from a net.
///
/// In addition to the members of the JSON, a template has `grafsynth` (the version), `template` (its file's name), and `refuse(reason)`, with which
/// it reports that it does not support a chart. Unknown names are errors, not empty.
///
/// # Errors
/// If the template has an error, which is reported with its location (G0611), if it refuses the chart (G0612), or if it exceeds its limits (G0613).
pub fn render(
    json: &serde_json::Value,
    template: &Template<'_>,
) -> Result<String, Vec<Diagnostic>> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_fuel(Some(FUEL));
    environment.set_recursion_limit(RECURSION);
    let mut syntax = SyntaxConfig::builder();
    syntax.trim_blocks(true).lstrip_blocks(true).keep_trailing_newline(true);
    if let Ok(syntax) = syntax.build() {
        environment.set_syntax(syntax);
    }
    environment.set_auto_escape_callback(|_| minijinja::AutoEscape::None);
    environment.add_function("refuse", |reason: String| -> Result<Value, Error> {
        Err(Error::new(ErrorKind::InvalidOperation, format!("{REFUSED}{reason}")))
    });
    for name in BY_NUMBER {
        let mut plain = Environment::new();
        plain.set_undefined_behavior(UndefinedBehavior::Strict);
        environment.add_filter(name, move |arguments: Rest<Value>| -> Result<Value, Error> {
            if !is_modest(name, &arguments) {
                let said = format!("{name} with a number above {MOST_NUMBER}");
                return Err(Error::new(ErrorKind::InvalidOperation, said));
            }
            plain.empty_state().apply_filter(name, &arguments)
        });
    }
    let compiled = environment
        .template_from_named_str(template.path, template.text)
        .map_err(|error| vec![finding(&error, template)])?;
    let name = template.path.rsplit(['/', '\\']).next().unwrap_or(template.path);
    let own = context! { grafsynth => env!("CARGO_PKG_VERSION"), template => name };
    let all = context! { ..own, ..Value::from(Serde(json)) };
    let mut text = Bounded { bytes: Vec::new(), is_full: false };
    match compiled.render_captured_to(all, &mut text) {
        Ok(_) => String::from_utf8(text.bytes).map_err(|_| {
            let message = "the template wrote something that is not UTF-8";
            vec![Diagnostic::error(codes::TEMPLATE_ERROR, message)]
        }),
        Err(_) if text.is_full => {
            let message = format!("the template writes more than {MOST_TEXT} bytes");
            let at = Span { file: template.file, ..Span::default() };
            let found = Diagnostic::error(codes::TEMPLATE_ENDLESS, message);
            let help = "write less for each step or transition, or split the template into several";
            Err(vec![found.at(at, "rendered from here").help(help)])
        }
        Err(error) => Err(vec![with_near_name(finding(&error, template), json, template)]),
    }
}

/// True if the numbers in a call of a filter are at most [`MOST_NUMBER`], which bounds the size of its output.
fn is_modest(name: &str, arguments: &[Value]) -> bool {
    let is_number = |value: &Value| {
        let number = (value.kind() == ValueKind::Number).then(|| f64::try_from(value.clone()));
        number.is_none_or(|number| number.is_ok_and(|number| number.abs() <= MOST_NUMBER))
    };
    let is_named = |value: &Value| {
        let names = value.try_iter().into_iter().flatten();
        names.filter_map(|name| value.get_item(&name).ok()).all(|value| is_number(&value))
    };
    // A format such as `"%5d"` contains a number in its text.
    let is_short = |text: &str| text.split(|c: char| !c.is_ascii_digit()).all(|it| it.len() < 5);
    let text = arguments.first().and_then(Value::as_str).filter(|_| name == "format");
    text.is_none_or(is_short)
        && arguments
            .iter()
            .skip(1)
            .all(|value| is_number(value) && (value.kind() != ValueKind::Map || is_named(value)))
}

/// A text with a maximum size.
struct Bounded {
    bytes: Vec<u8>,
    is_full: bool,
}

impl io::Write for Bounded {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.bytes.len() + bytes.len() > MOST_TEXT {
            self.is_full = true;
            return Err(io::Error::other("too much text"));
        }
        self.bytes.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Adds the name that was probably intended to a finding about an unknown name.
fn with_near_name(
    finding: Diagnostic,
    json: &serde_json::Value,
    template: &Template<'_>,
) -> Diagnostic {
    let Some(span) = finding.labels.first().map(|label| label.span) else { return finding };
    let word = template.text.get(span.start as usize..span.end as usize).unwrap_or_default();
    let names = json.as_object().into_iter().flat_map(|all| all.keys().map(String::as_str));
    // Only findings about unknown names have a help text.
    match nearest(word, names).filter(|_| finding.help.is_some()) {
        Some(near) => finding.help(format!("did you mean `{near}`?")).fix(span, near),
        None => finding,
    }
}

/// The error of the template engine as a diagnostic.
fn finding(error: &Error, template: &Template<'_>) -> Diagnostic {
    // The innermost cause describes the error; the outer ones only report that it occurred in a macro.
    let mut innermost = error;
    let mut next = std::error::Error::source(error);
    while let Some(source) = next {
        if let Some(source) = source.downcast_ref::<Error>() {
            innermost = source;
        }
        next = source.source();
    }
    let place = place(innermost, template).or_else(|| place(error, template));
    let span = place.unwrap_or(Span { file: template.file, ..Span::default() });
    let said = innermost.detail().map_or_else(|| innermost.kind().to_string(), str::to_owned);
    if let Some(reason) = said.strip_prefix(REFUSED) {
        let message = format!("the template does not support this chart: {reason}");
        return Diagnostic::error(codes::TEMPLATE_REFUSED, message).at(span, "refused here");
    }
    if innermost.kind() == ErrorKind::OutOfFuel {
        let message = format!("the template executes more than {FUEL} instructions");
        return Diagnostic::error(codes::TEMPLATE_ENDLESS, message)
            .at(span, "the limit was reached here")
            .help("end the loop earlier, or loop over a list of the chart");
    }
    let kind = innermost.kind().to_string();
    let message = if said == kind { kind } else { format!("{kind}: {said}") };
    let found = Diagnostic::error(codes::TEMPLATE_ERROR, message).at(span, "here");
    if innermost.kind() != ErrorKind::UndefinedError {
        return found;
    }
    found.help("docs/net-json.md lists all names; `build --target json` writes them for this chart")
}

/// The location of an error in the template.
fn place(error: &Error, template: &Template<'_>) -> Option<Span> {
    let range = error.range().or_else(|| {
        // Only the line is known, so the whole line is used.
        let line = error.line()?.checked_sub(1)?;
        let start: usize = template.text.split_inclusive('\n').take(line).map(str::len).sum();
        let length = template.text.get(start..)?.lines().next()?.len();
        Some(start..start + length)
    })?;
    let limit = template.text.len();
    let at = |byte: usize| u32::try_from(byte.min(limit)).ok();
    Some(Span { file: template.file, start: at(range.start)?, end: at(range.end)? })
}
