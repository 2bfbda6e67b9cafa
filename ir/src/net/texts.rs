//! Target-language texts in a net: their locations, and the net without them.
//!
//! Simulation and proofs ignore such text, but a C compiler does not: to compile and run the emitted C is to run code of the chart's author.

use super::{Net, StmtKind, Verbatim};
use crate::span::Span;
use crate::validate::{Valid, validate};
use crate::walk::change_statements;

/// The replacement for a removed text.
const LEFT_OUT: &str = "/* text of the chart, left out */";

impl Verbatim {
    /// True for text that emitted C contains.
    #[must_use]
    pub fn is_c(&self) -> bool {
        is_c(&self.language)
    }
}

/// True for the name of a language whose text emitted C contains.
#[must_use]
pub fn is_c(language: &str) -> bool {
    language.eq_ignore_ascii_case("c")
}

impl Net {
    /// All target-language texts, in the order of the steps and then of their locations.
    #[must_use]
    pub fn texts(&self) -> Vec<(&Verbatim, Span)> {
        let mut all: Vec<(&Verbatim, Span)> = Vec::new();
        for step in self.steps.values() {
            all.extend(step.code.iter().map(|text| (text, step.meta.span)));
        }
        let n_levels = all.len();
        for stmt in self.statements() {
            if let StmtKind::Code(text) = &stmt.kind {
                all.push((text, stmt.span));
            }
        }
        all[n_levels..].sort_by_key(|(_, span)| *span);
        all
    }

    /// The locations of texts that emitted C contains.
    #[must_use]
    pub fn c_texts(&self) -> Vec<Span> {
        self.texts().into_iter().filter(|(text, _)| text.is_c()).map(|(_, span)| span).collect()
    }
}

/// The same net with a comment in place of each C text, so that the emitted code has the same structure but runs none of the author's code. `None` if
/// there is no such text.
#[must_use]
pub fn without_c_texts(net: &Valid<Net>) -> Option<Valid<Net>> {
    if net.c_texts().is_empty() {
        return None;
    }
    let mut net: Net = (**net).clone();
    net.steps.iter_mut().for_each(|(_, step)| step.code.iter_mut().for_each(leave_out));
    for list in net.lists_mut() {
        change_statements(list, &mut |stmt| {
            if let StmtKind::Code(text) = &mut stmt.kind {
                leave_out(text);
            }
        });
    }
    match validate(net) {
        Ok(net) => Some(net),
        Err(_) => unreachable!("nothing that is validated was changed"),
    }
}

fn leave_out(text: &mut Verbatim) {
    if text.is_c() {
        LEFT_OUT.clone_into(&mut text.text);
    }
}
