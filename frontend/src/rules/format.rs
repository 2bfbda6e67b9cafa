//! Formats rules in their canonical form, with their comments.
//!
//! A comment belongs to the list, heading or rule on its own line, otherwise to the next one. In the canonical form the lines may be
//! reordered or split, so each comment goes to the first line with the same heading and first word.

use std::collections::{BTreeMap, VecDeque};

use grafsynth_ir::FileId;
use grafsynth_ir::diag::{Diagnostic, any_error};

use super::{parse_within, write_design};
use crate::graf::Limits;
use crate::graf::lexer::Lexer;
use crate::graf::numbers::name_of;
use crate::graf::token::Kind;

/// Formats rules in the canonical form. Comments are kept.
///
/// # Errors
/// Returns the findings of the text if it has errors. The text is not changed.
pub fn format(file: FileId, text: &str) -> Result<String, Vec<Diagnostic>> {
    format_within(file, text, &Limits::default())
}

/// Like [`format()`], with the given limits.
///
/// # Errors
/// Returns the findings of the text if it has errors. The text is not changed.
pub fn format_within(file: FileId, text: &str, limits: &Limits) -> Result<String, Vec<Diagnostic>> {
    let parsed = parse_within(file, text, limits);
    let Some(design) = parsed.design.filter(|_| !any_error(&parsed.diagnostics)) else {
        return Err(parsed.diagnostics);
    };
    let canonical = write_design(&design)?;

    let mut comments: BTreeMap<Key, VecDeque<Comments>> = BTreeMap::new();
    let mut last = Comments::default();
    for line in lines(text) {
        match line.key {
            Some(key) => comments.entry(key).or_default().push_back(line.comments),
            None => last = line.comments,
        }
    }
    let mut out = String::new();
    let mut end = 0;
    for line in lines(&canonical) {
        let Some(key) = line.key else { break };
        let found = comments.get_mut(&key).and_then(VecDeque::pop_front).unwrap_or_default();
        // In the canonical form, options are already before their line; only the other comments are added.
        let (start, stop) = line.range;
        out.push_str(&canonical[end..start]);
        for above in &found.above {
            out.push_str(above);
            out.push('\n');
        }
        out.push_str(&canonical[start..stop]);
        if let Some(beside) = &found.beside {
            out.push_str("  ");
            out.push_str(beside);
        }
        end = stop;
    }
    out.push_str(&canonical[end..]);
    // Comments without a matching line are written at the end.
    let rest = comments.into_values().flatten().chain([last]);
    for comment in rest.flat_map(|one| one.above.into_iter().chain(one.beside)) {
        out.push_str(&comment);
        out.push('\n');
    }
    Ok(out)
}

/// The key of a line: the heading above it, and its first word.
type Key = (String, String);

/// The comments of a line.
#[derive(Default)]
struct Comments {
    above: Vec<String>,
    beside: Option<String>,
}

struct Line {
    /// `None` after the last line.
    key: Option<Key>,
    /// The range from its first to its last token.
    range: (usize, usize),
    comments: Comments,
}

/// The non-empty lines of rules, and the text after the last one. A list that continues on the next line counts as one line.
fn lines(text: &str) -> Vec<Line> {
    // The comments before the first line are the head of the text, which is treated as an empty line.
    let head = Line { key: Some(Key::default()), range: (0, 0), comments: Comments::default() };
    let mut lines: Vec<Line> = vec![head];
    let mut above: Vec<String> = Vec::new();
    let mut in_head = true;
    let mut lexer = Lexer::new(text);
    let mut heading = String::new();
    let mut goes_on = false;
    let mut first_of_line = String::new();
    loop {
        let mut comments: Vec<(usize, usize)> = Vec::new();
        let token = lexer
            .next(&mut |start, end| comments.push((start as usize, end as usize)), &mut |_| {});
        for (start, end) in comments {
            let comment = text[start..end].trim_end().to_owned();
            if comment.trim_start_matches('#').trim_start().starts_with("option:") {
                in_head = false;
                continue;
            }
            match lines.last_mut() {
                Some(head) if in_head => head.comments.above.push(comment),
                Some(line)
                    if !text[line.range.1..start].contains('\n')
                        && line.comments.beside.is_none() =>
                {
                    line.comments.beside = Some(comment);
                }
                _ => above.push(comment),
            }
        }
        in_head = false;
        let (start, end) = (token.start as usize, token.end as usize);
        if token.kind == Kind::End {
            let comments = Comments { above, beside: None };
            lines.push(Line { key: None, range: (start, end), comments });
            return lines;
        }
        if token.new_line && !goes_on {
            first_of_line = name_of(text, token).to_owned();
            let comments = Comments { above: std::mem::take(&mut above), beside: None };
            lines.push(Line {
                key: Some((heading.clone(), first_of_line.clone())),
                range: (start, end),
                comments,
            });
        } else if let Some(line) = lines.last_mut() {
            if token.kind == Kind::Colon
                && matches!(first_of_line.as_str(), "Transitions" | "Steps")
            {
                heading.clone_from(&first_of_line);
            }
            line.range.1 = end;
        }
        goes_on = token.kind == Kind::Comma;
    }
}
