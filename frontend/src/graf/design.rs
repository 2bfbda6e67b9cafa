//! Parser of a whole source: its edition, imports, library charts with their certificates, and charts.

use grafsynth_ir::Span;
use grafsynth_ir::chart::{
    Certificate, Chart, Design, Import, Item, Library, Setting, SettingKind,
};
use grafsynth_ir::diag::{Diagnostic, ErrorReported, nearest};
use grafsynth_ir::net::Meta;

use super::items::ITEM_WORDS;
use super::parser::{Parse, Parser, Separators, short};
use super::token::Kind;
use crate::codes;

impl Parser<'_> {
    /// Parses a whole source. Returns `None` if it has no chart, library chart, import or certificate.
    pub(crate) fn design(&mut self) -> Option<Design> {
        let mut design = Design { edition: self.edition(), ..Design::default() };
        let mut certificates = Vec::new();
        let mut has_chart = false;
        let mut reported_outside = false;
        loop {
            let before = self.peek(0).start;
            if self.kind(0) == Kind::End {
                break;
            }
            if self.word(0) == "chart" && self.is_name(1) {
                has_chart = true;
                reported_outside = false;
                match self.chart() {
                    Ok(chart) => self.keep(&mut design.charts, chart),
                    Err(ErrorReported) => self.skip_to_item(before),
                }
                self.depth = 0;
                continue;
            }
            if self.begins_library_part() {
                // A file that contains only library charts is valid.
                has_chart = true;
                reported_outside = false;
                let result = match self.word(0) {
                    "use" => self.import().map(|one| self.keep(&mut design.imports, one)),
                    "library" => self.library().map(|one| self.keep(&mut design.libraries, one)),
                    _ => self.certificate().map(|one| self.keep(&mut certificates, one)),
                };
                if result.is_err() {
                    self.skip_to_item(before);
                }
                self.depth = 0;
                continue;
            }
            if !reported_outside {
                reported_outside = true;
                self.outside();
            }
            // Continue at the next line that begins with a chart, a library chart, an import or a certificate.
            self.advance();
            while self.kind(0) != Kind::End
                && !(self.peek(0).new_line
                    && (self.word(0) == "chart" || self.begins_library_part()))
            {
                self.advance();
            }
        }
        if !has_chart && !reported_outside {
            let here = self.here();
            self.report(|| {
                Diagnostic::error(codes::NO_CHART, "no chart in this text")
                    .at(here, "expected a chart")
                    .help("a chart is written `chart NAME { … }`")
            });
        }
        self.forgotten_targets(&design);
        for certificate in certificates {
            self.certify(&mut design.libraries, certificate);
        }
        (has_chart || self.dry).then_some(design)
    }

    /// Warns about transitions without targets outside of statecharts: such a transition deactivates a step and activates no step.
    fn forgotten_targets(&mut self, design: &Design) {
        let items = design.charts.iter().map(|chart| &chart.items);
        let mut items =
            items.chain(design.libraries.iter().map(|library| &library.items)).flatten();
        let is_statechart = items.any(|item| {
            matches!(item, Item::Setting(Setting { kind: SettingKind::Conflict(policy), .. }) if policy.is_statechart())
        });
        let arrows = std::mem::take(&mut self.bare_arrows);
        if is_statechart {
            return;
        }
        for arrow in arrows {
            self.report(|| {
                Diagnostic::warning(codes::NO_TARGET, "a transition without a following step")
                    .at(arrow, "the sequence ends here")
                    .help(
                        "name a step after the arrow, or write `-> sink` if the sequence ends here",
                    )
                    .fix(arrow, "-> sink")
            });
        }
    }

    /// Parses the imports before the first chart or library chart.
    pub(crate) fn imports(&mut self) -> Vec<Import> {
        let mut imports = Vec::new();
        self.edition();
        while self.word(0) == "use" && self.begins_library_part() {
            imports.extend(self.import());
        }
        imports
    }

    /// Whether an import, a library chart or a certificate begins here, outside of charts.
    fn begins_library_part(&self) -> bool {
        match self.word(0) {
            "use" => matches!(self.kind(1), Kind::Text | Kind::RawText),
            "library" => self.word(1) == "chart" && self.is_name(2),
            "certificate" => self.is_name_beside(1) && self.word(2) == "by",
            _ => false,
        }
    }

    /// Attaches a certificate to the library chart of this file that it names.
    fn certify(&mut self, libraries: &mut [Library], certificate: Certificate) {
        if self.dry {
            return;
        }
        let span = certificate.of.span;
        let known = libraries.iter_mut().find(|library| library.name.text == certificate.of.text);
        if let Some(library) = known {
            self.once(&mut library.certificate, certificate, span, "certificate");
            return;
        }
        let names = libraries.iter().map(|library| library.name.text.as_str());
        let near = nearest(&certificate.of.text, names);
        self.report(|| {
            let finding = Diagnostic::error(
                codes::UNKNOWN_WORD,
                format!("this file has no library chart `{}`", certificate.of),
            );
            finding.at(span, "unknown here").near(
                span,
                near,
                "move the certificate to the file that declares its library chart",
            )
        });
    }

    /// Reports text outside of all charts.
    fn outside(&mut self) {
        let token = self.peek(0);
        if token.kind == Kind::Unknown {
            return;
        }
        let span = self.span(token);
        let word = self.word(0);
        let shown = short(super::numbers::slice(self.text, token));
        if ITEM_WORDS.contains(&word) {
            self.report(|| {
                Diagnostic::error(codes::NO_CHART, format!("`{shown}` outside of a chart"))
                    .at(span, "no chart begins before it")
                    .help("put it between the braces of `chart NAME { … }`")
            });
        } else if token.kind == Kind::CloseBrace {
            self.report(|| {
                Diagnostic::error(codes::UNCLOSED_BLOCK, "unmatched closing brace")
                    .at(span, "no block is open here")
                    .help("remove it, or look for a `}` before it that closes a block too early")
            });
        } else {
            self.unexpected("`chart NAME {`");
        }
    }

    fn edition(&mut self) -> Option<(u32, Span)> {
        if self.word(0) != "edition" || self.kind(1) != Kind::Number {
            return None;
        }
        let start = self.advance().start;
        let number = self.count("the number of the edition").ok()?;
        let span = self.span_from(start);
        if number != 1 {
            self.report(|| {
                Diagnostic::error(codes::EDITION, format!("unknown edition {number}"))
                    .at(span, "the only edition is 1")
                    .help("write `edition 1`, or use a newer grafsynth")
            });
        }
        Some((number, span))
    }

    fn chart(&mut self) -> Parse<Chart> {
        let start = self.advance().start;
        let name = self.name("the name of the chart")?;
        let mut meta = Meta::default();
        self.attributes(&mut meta)?;
        let mut items = Vec::new();
        let mut initial = None;
        self.braced("the chart", Separators::None, &mut |parser| {
            if parser.word(0) == "initial" && parser.kind(1) == Kind::Arrow {
                return parser.initial_of_chart(&mut initial);
            }
            parser.item(&mut items)
        })?;
        let initial = initial.unwrap_or_default();
        let span = self.span_from(start);
        meta.span = span;
        Ok(Chart { name, is_unnamed: false, span, initial, items, meta })
    }
}
