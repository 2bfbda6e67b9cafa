//! The writers: they print decisions that were made before, and make none.
// A variant that a writer forgets is a miscompile.
#![warn(clippy::wildcard_enum_match_arm)]

pub(crate) mod bench;
pub(crate) mod blif;
pub(crate) mod cupl;
pub(crate) mod galasm;
pub(crate) mod palasm;
pub(crate) mod verilog;

use crate::MapLine;
use crate::equations::{Equation, Equations};
use grafsynth_ir::net::Meta;

/// A text that grows line by line, with the origins of its lines.
#[derive(Debug, Default)]
pub(crate) struct SourceText {
    pub(crate) text: String,
    pub(crate) map: Vec<MapLine>,
    lines: u32,
}

impl SourceText {
    /// Adds a line without trailing blanks.
    pub(crate) fn line(&mut self, line: &str) {
        self.text.push_str(line.trim_end());
        self.text.push('\n');
        self.lines += 1;
    }

    /// Adds a line that comes from an object of the source.
    pub(crate) fn line_of(&mut self, line: &str, name: &str, meta: &Meta) {
        self.line(line);
        self.map.push(MapLine {
            line: self.lines,
            name: name.to_owned(),
            span: meta.span,
            req: meta.req.clone(),
        });
    }
}

/// The operators with which a language writes sums.
pub(crate) struct Signs {
    pub(crate) not: &'static str,
    pub(crate) and: &'static str,
    pub(crate) or: &'static str,
    pub(crate) yes: &'static str,
    pub(crate) no: &'static str,
}

impl Signs {
    fn literal(&self, name: &str, value: bool) -> String {
        if value { name.to_owned() } else { format!("{}{name}", self.not) }
    }

    /// A product as a text.
    pub(crate) fn product(&self, equations: &Equations, product: &[(usize, bool)]) -> String {
        if product.is_empty() {
            return self.yes.to_owned();
        }
        let literals: Vec<String> = product
            .iter()
            .map(|&(signal, value)| self.literal(&equations.signals[signal].name, value))
            .collect();
        literals.join(self.and)
    }

    /// The products of a sum, as texts.
    pub(crate) fn products(&self, equations: &Equations, equation: &Equation) -> Vec<String> {
        if equation.products.is_empty() {
            return vec![self.no.to_owned()];
        }
        equation.products.iter().map(|product| self.product(equations, product)).collect()
    }

    /// Prints `head sum`, on one line if it is short, otherwise with one product per line.
    pub(crate) fn print(
        &self,
        source: &mut SourceText,
        equations: &Equations,
        equation: &Equation,
        head: &str,
        end: &str,
    ) {
        let signal = &equations.signals[equation.signal];
        let products = self.products(equations, equation);
        let flat = format!("{head} {}{end}", products.join(&format!(" {} ", self.or)));
        if flat.len() <= 76 {
            source.line_of(&flat, &signal.name, &signal.meta);
            return;
        }
        // A product longer than a line is broken after an operator; the continuation lines are indented.
        let count = products.len();
        for (index, product) in products.iter().enumerate() {
            let lead = if index == 0 { format!("{head} ") } else { format!("    {} ", self.or) };
            let mut line = lead;
            let parts: Vec<&str> = product.split(self.and).collect();
            for (at, part) in parts.iter().enumerate() {
                if line.len() + part.len() > 74 && at > 0 {
                    source.line_of(&line, &signal.name, &signal.meta);
                    "        ".clone_into(&mut line);
                }
                line.push_str(part);
                if at + 1 < parts.len() {
                    line.push_str(self.and);
                }
            }
            if index + 1 == count {
                line.push_str(end);
            }
            source.line_of(&line, &signal.name, &signal.meta);
        }
    }
}
