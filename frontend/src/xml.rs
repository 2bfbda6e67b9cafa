//! XML for the parsers of charts: a document tree with spans, within limits.
//!
//! [`parse`] scans the text before it builds a tree, so that neither a malicious nor an invalid file takes more memory than a small
//! multiple of its size. Nesting, attributes and namespaces are limited. Document types are rejected, and with them every entity that a
//! file could define. A file that consists almost entirely of markup is rejected too.
//!
//! [`Mapped`] text knows the source position of each of its bytes, even with character references and `CDATA` sections, so that an
//! expression in an attribute has exact spans.
//!
//! Writers use [`attribute`] and [`text`] to escape texts.

use std::borrow::Cow;
use std::ops::Range;

use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::{FileId, Span};
use roxmltree::{Attribute, Document, Error, Node, ParsingOptions, TextPos};

use crate::codes;
use crate::graf::Limits;

/// Maximum number of attributes of an element: the search for duplicates takes quadratic time.
const MAX_ATTRIBUTES: usize = 256;
/// Maximum number of namespaces declared on the path from the root to an element: each element that declares one copies the inherited ones.
const MAX_NAMESPACES: usize = 64;
/// Memory of the tree in bytes for an element, text or comment, and for an attribute, rounded up.
const NODE: usize = 80;
const ATTRIBUTE: usize = 80;
/// Limit for the memory of the tree: this multiple of the text, plus an allowance for small files.
const TREE_FACTOR: usize = 18;
const TREE_FREE: usize = 1 << 20;
/// The usual prefixes of the documents that are read here, with their namespaces.
const PREFIXES: [(&str, &str); 3] = [
    ("g", "urn:grafsynth:scxml:1"),
    ("xhtml", "http://www.w3.org/1999/xhtml"),
    ("xsi", "http://www.w3.org/2001/XMLSchema-instance"),
];

/// Parses XML. The tree borrows from `text`; its ranges are byte ranges in it.
///
/// # Errors
/// Returns the first error, with its location; parsing stops there.
pub(crate) fn parse<'t>(
    file: FileId,
    text: &'t str,
    limits: &Limits,
) -> Result<Document<'t>, Box<Diagnostic>> {
    if let Some(finding) = crate::graf::too_large(file, text, limits) {
        return Err(Box::new(finding));
    }
    let scan = Scan::of(file, text, limits);
    if let Some(finding) = scan.refused {
        return Err(Box::new(finding));
    }
    let options = ParsingOptions { allow_dtd: false, ..ParsingOptions::default() };
    Document::parse_with_options(text, options)
        .map_err(|error| Box::new(malformed(file, text, &error, scan.unclosed)))
}

/// The span of a byte range.
pub(crate) fn span(file: FileId, range: Range<usize>) -> Span {
    Span::new(file, range.start, range.end)
}

/// The span of a node for messages: the start tag of an element, the whole of any other node.
pub(crate) fn tag_span(file: FileId, node: Node<'_, '_>) -> Span {
    let range = node.range();
    if !node.is_element() {
        return span(file, range);
    }
    let text = node.document().input_text();
    let end = tag_end(text, range.start).unwrap_or(range.end).min(range.end);
    span(file, range.start..end)
}

/// The span of an element with its contents.
pub(crate) fn node_span(file: FileId, node: Node<'_, '_>) -> Span {
    span(file, node.range())
}

/// The span of an attribute name.
pub(crate) fn name_span(file: FileId, attribute: Attribute<'_, '_>) -> Span {
    span(file, attribute.range_qname())
}

/// The end of the tag that begins at `start`, after its `>`.
fn tag_end(text: &str, start: usize) -> Option<usize> {
    let mut quote = None;
    for (offset, byte) in text.as_bytes().get(start..)?.iter().enumerate() {
        match (quote, byte) {
            (None, b'>') => return Some(start + offset + 1),
            (None, b'"' | b'\'') => quote = Some(*byte),
            (Some(open), byte) if open == *byte => quote = None,
            (None | Some(_), _) => {}
        }
    }
    None
}

/// Decoded text, with the source position of each byte.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Mapped<'t> {
    file: FileId,
    /// The characters.
    pub(crate) text: Cow<'t, str>,
    /// Pieces in order; they cover `text`.
    pieces: Vec<Piece>,
    /// Offset of the end in the source.
    end: usize,
}

/// A run of characters that is identical in the source, or that replaces a part of the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Piece {
    /// Offset of the first byte in the text.
    from: usize,
    /// Offset of the first byte in the source.
    place: usize,
    /// Length in the source of the reference or line end that it replaces; `None` if the source has the same bytes.
    stands_for: Option<usize>,
}

impl<'t> Mapped<'t> {
    /// The value of an attribute. References are resolved; line ends and tabs become blanks.
    pub(crate) fn value(file: FileId, source: &'t str, attribute: Attribute<'_, '_>) -> Self {
        let range = attribute.range();
        let raw = source.get(range.clone()).unwrap_or_default();
        let quote = raw.find(['"', '\'']).unwrap_or(raw.len());
        let start = (range.start + quote + 1).min(range.end);
        let end = range.end.saturating_sub(1).max(start);
        let raw = &source[start..end];
        if !raw.contains(['&', '\t', '\n', '\r']) {
            return Self::plain(file, raw, start);
        }
        let mut out = Builder::default();
        out.resolve(raw, start, true);
        out.finish(file, end)
    }

    /// The text of an element up to its first child that is not text. References and `CDATA` sections are resolved; comments are omitted.
    pub(crate) fn content(file: FileId, source: &'t str, element: Node<'_, '_>) -> Self {
        let range = element.range();
        let start = tag_end(source, range.start).unwrap_or(range.end).min(range.end);
        let raw = &source[start..range.end];
        let plain = &raw[..raw.find('<').unwrap_or(raw.len())];
        let is_whole =
            !["<![CDATA[", "<!--"].iter().any(|mark| raw[plain.len()..].starts_with(mark));
        if is_whole && !plain.contains(['&', '\r']) {
            return Self::plain(file, plain, start);
        }
        let mut out = Builder::default();
        let mut at = start;
        while let Some(mark) = Mark::at(source, at..range.end) {
            match mark {
                Mark::Tag(_) => break,
                Mark::Text { raw, place, is_verbatim, .. } => out.text(raw, place, is_verbatim),
                Mark::Nothing(_) => {}
            }
            at = mark.end();
        }
        out.finish(file, at)
    }

    /// The whole text of an element with formatted text, including its child elements, with a line end between paragraphs. References and
    /// `CDATA` sections are resolved; comments and the blanks between paragraphs are omitted.
    pub(crate) fn formatted(file: FileId, source: &'t str, element: Node<'_, '_>) -> Self {
        let range = element.range();
        let mut at = tag_end(source, range.start).unwrap_or(range.end).min(range.end);
        let mut out = Builder::default();
        // The tag that ends a line, pending until more characters follow.
        let mut line_end: Option<Range<usize>> = None;
        let mut end = at;
        while let Some(mark) = Mark::at(source, at..range.end) {
            match &mark {
                Mark::Tag(tag) if ends_line(&source[tag.clone()]) => line_end = Some(tag.clone()),
                Mark::Text { raw, place, is_verbatim, end: after } => {
                    let is_between = out.text.is_empty() || line_end.is_some();
                    if !(is_between && raw.trim().is_empty()) {
                        if let Some(tag) = line_end.take().filter(|_| !out.text.is_empty()) {
                            out.put('\n', tag.start, tag.len());
                        }
                        out.text(raw, *place, *is_verbatim);
                        end = *after;
                    }
                }
                Mark::Tag(_) | Mark::Nothing(_) => {}
            }
            at = mark.end();
        }
        out.finish(file, end)
    }

    /// A part of the source without changes.
    fn plain(file: FileId, raw: &'t str, start: usize) -> Self {
        let pieces = vec![Piece { from: 0, place: start, stands_for: None }];
        Mapped { file, text: Cow::Borrowed(raw), pieces, end: start + raw.len() }
    }

    /// The piece that contains a byte of the text.
    fn piece(&self, at: usize) -> Option<Piece> {
        let after = self.pieces.partition_point(|piece| piece.from <= at);
        after.checked_sub(1).and_then(|index| self.pieces.get(index)).copied()
    }

    /// The source position of a byte of the text; the end of the text maps to its end in the source.
    pub(crate) fn place(&self, at: usize) -> usize {
        match self.piece(at) {
            Some(Piece { place, stands_for: Some(_), .. }) if at < self.text.len() => place,
            Some(Piece { from, place, .. }) if at < self.text.len() => place + (at - from),
            Some(_) | None => self.end,
        }
    }

    /// The source span of a range of the text.
    pub(crate) fn span(&self, range: Range<usize>) -> Span {
        let start = self.place(range.start);
        let end = match (range.end > range.start).then(|| self.piece(range.end - 1)).flatten() {
            Some(Piece { place, stands_for: Some(length), .. }) => place + length,
            Some(Piece { from, place, stands_for: None }) => place + (range.end - from),
            None => start,
        };
        Span::new(self.file, start, end.min(self.end).max(start))
    }

    /// The span of the whole text.
    pub(crate) fn whole(&self) -> Span {
        match self.pieces.first() {
            Some(first) => Span::new(self.file, first.place, self.end),
            None => Span::new(self.file, self.end, self.end),
        }
    }

    /// Blank-separated words, each with its span.
    pub(crate) fn words(&self) -> impl Iterator<Item = (&str, Span)> {
        let text = self.text.as_ref();
        text.split([' ', '\t', '\r', '\n']).filter(|word| !word.is_empty()).map(|word| {
            let start = word.as_ptr() as usize - text.as_ptr() as usize;
            (word, self.span(start..start + word.len()))
        })
    }

    /// The same text without blanks at both ends.
    pub(crate) fn trimmed(self) -> Mapped<'t> {
        let trimmed = self.text.trim();
        if trimmed.len() == self.text.len() {
            return self;
        }
        let start = self.text.len() - self.text.trim_start().len();
        let end = start + trimmed.len();
        let source_end = self.span(start..end).end as usize;
        let place = self.place(start);
        let first = self.piece(start).map(|piece| Piece { from: 0, place, ..piece });
        let later = self.pieces.iter().filter(|piece| piece.from > start && piece.from < end);
        let later = later.map(|piece| Piece { from: piece.from - start, ..*piece });
        let pieces = first.into_iter().chain(later).collect();
        let text = match self.text {
            Cow::Borrowed(text) => Cow::Borrowed(&text[start..end]),
            Cow::Owned(text) => Cow::Owned(text[start..end].to_owned()),
        };
        Mapped { file: self.file, text, pieces, end: source_end }
    }
}

/// A part of the content of an element.
enum Mark<'t> {
    /// A start or end tag.
    Tag(Range<usize>),
    /// Characters that begin at byte `place`; in verbatim text, references are not resolved. `end` is the end of their section.
    Text { raw: &'t str, place: usize, is_verbatim: bool, end: usize },
    /// A comment or a processing instruction that ends at this byte.
    Nothing(usize),
}

impl<'t> Mark<'t> {
    /// The mark that begins at the start of a range; `None` if the range is empty.
    fn at(source: &'t str, range: Range<usize>) -> Option<Mark<'t>> {
        let at = range.start;
        let rest = source.get(range)?;
        if rest.is_empty() {
            return None;
        }
        let past = |mark: &str| at + rest.find(mark).map_or(rest.len(), |found| found + mark.len());
        Some(if let Some(inside) = rest.strip_prefix("<![CDATA[") {
            let raw = &inside[..inside.find("]]>").unwrap_or(inside.len())];
            Mark::Text { raw, place: at + 9, is_verbatim: true, end: past("]]>") }
        } else if rest.starts_with("<!--") {
            Mark::Nothing(past("-->"))
        } else if rest.starts_with("<?") {
            Mark::Nothing(past("?>"))
        } else if rest.starts_with('<') {
            let end = tag_end(source, at).unwrap_or(at + rest.len());
            Mark::Tag(at..end.min(at + rest.len()))
        } else {
            let raw = &rest[..rest.find('<').unwrap_or(rest.len())];
            Mark::Text { raw, place: at, is_verbatim: false, end: at + raw.len() }
        })
    }

    /// The offset of the byte that follows the markup or text.
    fn end(&self) -> usize {
        match self {
            Mark::Tag(range) => range.end,
            Mark::Text { end, .. } | Mark::Nothing(end) => *end,
        }
    }
}

/// Whether a tag of XHTML begins or ends a line.
fn ends_line(tag: &str) -> bool {
    const LINES: [&str; 16] = [
        "p",
        "div",
        "br",
        "li",
        "pre",
        "ul",
        "ol",
        "dl",
        "dt",
        "dd",
        "table",
        "tr",
        "hr",
        "blockquote",
        "body",
        "html",
    ];
    let name = tag.trim_start_matches(['<', '/']);
    let name = &name[..name.find([' ', '\t', '\r', '\n', '/', '>']).unwrap_or(name.len())];
    let local = name.rsplit(':').next().unwrap_or(name);
    LINES.contains(&local)
}

/// Text under construction, with the positions of its pieces.
#[derive(Default)]
struct Builder {
    text: String,
    pieces: Vec<Piece>,
}

impl Builder {
    /// Appends characters that are identical in the source at byte `place`.
    fn keep(&mut self, text: &str, place: usize) {
        let from = self.text.len();
        let follows = self.pieces.last().is_some_and(|last| {
            last.stands_for.is_none() && last.place + (from - last.from) == place
        });
        if !follows && !text.is_empty() {
            self.pieces.push(Piece { from, place, stands_for: None });
        }
        self.text.push_str(text);
    }

    /// Appends characters of the source; resolves references unless the text is verbatim.
    fn text(&mut self, raw: &str, place: usize, is_verbatim: bool) {
        if is_verbatim {
            self.lines(raw, place);
        } else {
            self.resolve(raw, place, false);
        }
    }

    /// Appends a character that replaces `length` bytes of the source.
    fn put(&mut self, character: char, place: usize, length: usize) {
        self.pieces.push(Piece { from: self.text.len(), place, stands_for: Some(length) });
        self.text.push(character);
    }

    /// Appends characters with normalised line ends.
    fn lines(&mut self, raw: &str, start: usize) {
        let mut at = 0;
        while let Some(found) = raw[at..].find('\r') {
            self.keep(&raw[at..at + found], start + at);
            at += found;
            let length = if raw[at..].starts_with("\r\n") { 2 } else { 1 };
            self.put('\n', start + at, length);
            at += length;
        }
        self.keep(&raw[at..], start + at);
    }

    /// Appends characters and resolves references; in an attribute, all white space becomes blanks.
    fn resolve(&mut self, raw: &str, start: usize, in_attribute: bool) {
        let special: &[char] = if in_attribute { &['&', '\t', '\n', '\r'] } else { &['&', '\r'] };
        let mut at = 0;
        while let Some(found) = raw[at..].find(special) {
            self.keep(&raw[at..at + found], start + at);
            at += found;
            let rest = &raw[at..];
            let length = if rest.starts_with('&') {
                let length = rest.find(';').map_or(rest.len(), |end| end + 1);
                let reference = rest.get(1..length.saturating_sub(1)).unwrap_or_default();
                if let Some(character) = resolved(reference) {
                    self.put(character, start + at, length);
                }
                length
            } else {
                let length = if rest.starts_with("\r\n") { 2 } else { 1 };
                self.put(if in_attribute { ' ' } else { '\n' }, start + at, length);
                length
            };
            at += length;
        }
        self.keep(&raw[at..], start + at);
    }

    fn finish<'t>(self, file: FileId, end: usize) -> Mapped<'t> {
        Mapped { file, text: Cow::Owned(self.text), pieces: self.pieces, end }
    }
}

/// The character of a reference between `&` and `;`: a number, or one of the five names that XML defines.
fn resolved(reference: &str) -> Option<char> {
    let number = |digits: &str, radix| u32::from_str_radix(digits, radix).ok();
    match reference {
        "lt" => Some('<'),
        "gt" => Some('>'),
        "amp" => Some('&'),
        "quot" => Some('"'),
        "apos" => Some('\''),
        other => {
            let digits = other.strip_prefix('#')?;
            let number = match digits.strip_prefix('x') {
                Some(digits) => number(digits, 16),
                None => number(digits, 10),
            };
            number.and_then(char::from_u32)
        }
    }
}

/// Result of scanning the text before a tree is built.
struct Scan {
    refused: Option<Diagnostic>,
    /// The start tag of the innermost unclosed element.
    unclosed: Option<Span>,
}

/// An element that is open during the scan.
struct Open {
    place: Span,
    n_namespaces: usize,
}

impl Scan {
    fn of(file: FileId, text: &str, limits: &Limits) -> Scan {
        let bytes = text.as_bytes();
        let mut open: Vec<Open> = Vec::new();
        let (mut n_nodes, mut n_attributes) = (0_usize, 0_usize);
        let mut at = 0;
        let refuse = |code, message: String, at, help: &str| Scan {
            refused: Some(Diagnostic::error(code, message).at(span(file, at), "").help(help)),
            unclosed: None,
        };
        while let Some(found) = text.get(at..).and_then(|rest| rest.find('<')) {
            // The text before the tag is a separate node.
            n_nodes += 1 + usize::from(found > 0);
            at += found;
            let rest = &text[at..];
            let skip = |mark: &str| rest.find(mark).map_or(rest.len(), |end| end + mark.len());
            if rest.starts_with("<!--") {
                at += skip("-->");
            } else if rest.starts_with("<![CDATA[") {
                at += skip("]]>");
            } else if rest.starts_with("<?") {
                at += skip("?>");
            } else if rest.starts_with("<!") {
                let end = skip(">");
                let message = "document types (<!DOCTYPE>) are not supported".to_owned();
                let help = "delete it, and write out the entities that it defines";
                return refuse(codes::XML_NOT_READ, message, at..at + end, help);
            } else if rest.starts_with("</") {
                open.pop();
                at += skip(">");
            } else {
                let end = tag_end(text, at).unwrap_or(text.len());
                let tag = &bytes[at..end];
                let in_tag = tag.iter().filter(|byte| **byte == b'=').count();
                let declares = text[at..end].matches("xmlns").count();
                n_attributes += in_tag;
                let n_namespaces = declares + open.last().map_or(0, |around| around.n_namespaces);
                if in_tag > MAX_ATTRIBUTES && attributes_of(tag) > MAX_ATTRIBUTES
                    || declares > 0 && n_namespaces > MAX_NAMESPACES
                {
                    let message = format!(
                        "the element has more than {MAX_ATTRIBUTES} attributes, or more than {MAX_NAMESPACES} namespaces are in scope"
                    );
                    let help = "remove attributes that no tool reads";
                    return refuse(codes::XML_NOT_READ, message, at..end, help);
                }
                if !tag.ends_with(b"/>") {
                    if open.len() >= limits.nesting as usize {
                        let message =
                            format!("more than {} levels of nested elements", limits.nesting);
                        let help = "raise the limit with --nesting-limit";
                        return refuse(codes::NESTING, message, at..end, help);
                    }
                    open.push(Open { place: span(file, at..end), n_namespaces });
                }
                at = end;
            }
        }
        // The tree reserves memory for each `<`, even in text and comments.
        n_nodes = n_nodes.max(bytes.iter().filter(|byte| **byte == b'<').count());
        n_attributes = n_attributes.max(bytes.iter().filter(|byte| **byte == b'=').count());
        let tree =
            n_nodes.saturating_mul(NODE).saturating_add(n_attributes.saturating_mul(ATTRIBUTE));
        if tree > text.len().saturating_mul(TREE_FACTOR).saturating_add(TREE_FREE) {
            let message = format!(
                "the {} bytes of the file contain {n_nodes} tags and texts and {n_attributes} equals signs, \
                 which would need more memory than {TREE_FACTOR} times the size of the file",
                text.len()
            );
            let help = "check that this is the right file";
            return refuse(codes::XML_NOT_READ, message, 0..text.len().min(1), help);
        }
        Scan { refused: None, unclosed: open.pop().map(|open| open.place) }
    }
}

/// The number of attributes of a tag: equals signs outside quotes.
fn attributes_of(tag: &[u8]) -> usize {
    let mut quote = None;
    let mut count = 0;
    for byte in tag {
        match (quote, *byte) {
            (None, b'=') => count += 1,
            (None, b'"' | b'\'') => quote = Some(*byte),
            (Some(open), byte) if open == byte => quote = None,
            (None | Some(_), _) => {}
        }
    }
    count
}

/// The finding for a text that the XML parser rejects.
fn malformed(file: FileId, text: &str, error: &Error, unclosed: Option<Span>) -> Diagnostic {
    let here = point(file, text, error.pos());
    let end = Span::new(file, text.len(), text.len());
    let finding = |message: String, place: Span| {
        Diagnostic::error(codes::XML, format!("the file is not well-formed XML: {message}"))
            .at(place, "")
    };
    match error {
        Error::InvalidName(_) => match bare_less_than(text, here.start as usize) {
            Some(at) => {
                let sign = Span::new(file, at, at + 1);
                finding("`<` begins a tag, and no tag follows".to_owned(), sign)
                    .help("write &lt; for the sign itself, as in `n &lt; 3`")
                    .fix(sign, "&lt;")
            }
            None => finding("invalid name".to_owned(), here),
        },
        Error::DtdDetected => {
            Diagnostic::error(codes::XML_NOT_READ, "document types (<!DOCTYPE>) are not supported")
                .at(here, "")
                .help("delete it, and write out the entities that it defines")
        }
        Error::NodesLimitReached
        | Error::AttributesLimitReached
        | Error::NamespacesLimitReached => Diagnostic::error(
            codes::XML_NOT_READ,
            "the file has too many elements, attributes or namespaces",
        )
        .at(here, "the limit is reached here")
        .help("split the file"),
        Error::NoRootNode => finding("it contains no element".to_owned(), end)
            .help("write one outermost element, such as <scxml> or <project>"),
        Error::UnclosedRootNode | Error::UnexpectedEndOfStream => match unclosed {
            Some(place) => finding("this element is not closed".to_owned(), place)
                .help("write its end tag, or `/>` at its end if it is empty"),
            None => finding("unexpected end of the file".to_owned(), end)
                .help("write the rest of the file: its last element is not complete"),
        },
        Error::UnexpectedCloseTag(expected, actual, _) => {
            finding(format!("</{actual}> closes <{expected}>"), here)
                .help(format!(
                    "write </{expected}> before it or in its place; if <{expected}> is empty, end that tag with `/>`"
                ))
        }
        Error::UnknownEntityReference(name, _) => finding(format!("unknown entity &{name};"), here)
            .help("XML defines &lt; &gt; &amp; &quot; &apos; and numbers such as &#233;"),
        Error::MalformedEntityReference(_) => {
            finding("`&` begins a reference such as &amp;, and none follows".to_owned(), here)
                .help("write &amp; for the sign itself, as in `a &amp;&amp; b`")
        }
        Error::InvalidAttributeValue(_) => {
            finding("`<` is not allowed in an attribute value".to_owned(), here)
                .help("write &lt; for the sign itself, as in `n &lt; 3`")
        }
        Error::InvalidComment(_) => finding("a comment contains `--`".to_owned(), here)
            .help("remove one of the two signs, or put a space between them"),
        Error::InvalidCharacterData(_) => {
            finding("`]]>` is not allowed in a text".to_owned(), here).help("write ]]&gt;")
        }
        Error::DuplicatedAttribute(name, _) => finding(format!("duplicate attribute {name}"), here)
            .help("remove one of them"),
        Error::UnknownNamespace(prefix, _) => {
            finding(format!("undeclared namespace prefix {prefix}"), here)
                .help(match PREFIXES.iter().find(|(known, _)| *known == prefix) {
                    Some((_, space)) => {
                        format!("declare it on the outermost element: xmlns:{prefix}=\"{space}\"")
                    }
                    None => format!(
                        "remove the prefix, or declare it on the outermost element with the namespace of its tool: xmlns:{prefix}=\"..\""
                    ),
                })
        }
        _ => {
            // The message of the parser contains the position, which the label already shows.
            let words = error.to_string().replace(&format!(" at {}", error.pos()), "");
            finding(words, here).help("correct this place, or write the file again with the tool that made it")
        }
    }
}

/// The stray `<` before a byte at which a name was expected; `None` if the name is invalid for another reason.
fn bare_less_than(text: &str, at: usize) -> Option<usize> {
    let open = match text.get(..=at).filter(|part| part.ends_with('<')) {
        Some(_) => at,
        None => text.get(..at).filter(|part| part.ends_with('<'))?.len() - 1,
    };
    let next = text.get(open + 1..)?.chars().next();
    let is_tag =
        next.is_some_and(|c| c.is_alphabetic() || matches!(c, '_' | ':' | '/' | '!' | '?'));
    (!is_tag).then_some(open)
}

/// The span at a line and column, both counted from 1; columns count characters.
fn point(file: FileId, text: &str, place: TextPos) -> Span {
    let mut start = 0;
    for _ in 1..place.row {
        match text[start..].find('\n') {
            Some(end) => start += end + 1,
            None => break,
        }
    }
    let line = &text[start..];
    let column = (place.col as usize).saturating_sub(1);
    let (offset, length) = line
        .char_indices()
        .nth(column)
        .map_or((line.len(), 0), |(offset, character)| (offset, character.len_utf8()));
    Span::new(file, start + offset, start + offset + length)
}

/// Escapes the value of an attribute in double quotes.
pub(crate) fn attribute(value: &str) -> String {
    escaped(value, true)
}

/// Escapes text between tags.
#[allow(dead_code, reason = "SCXML has no text between tags; other formats use it")]
pub(crate) fn text(value: &str) -> String {
    escaped(value, false)
}

fn escaped(value: &str, in_attribute: bool) -> String {
    let mut out = String::with_capacity(value.len());
    for character in value.chars() {
        match character {
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '"' if in_attribute => out.push_str("&quot;"),
            // An XML parser would turn unescaped ones into blanks, or into a single line end.
            '\t' | '\n' if in_attribute => out.push_str(&format!("&#{};", character as u32)),
            '\r' => out.push_str("&#13;"),
            // XML cannot represent other control characters.
            '\u{0}'..='\u{8}'
            | '\u{b}'
            | '\u{c}'
            | '\u{e}'..='\u{1f}'
            | '\u{fffe}'
            | '\u{ffff}' => {
                out.push('\u{fffd}');
            }
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests;
