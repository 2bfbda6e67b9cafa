//! Parser of the settings of a chart: conflict policy, schedule, evolution, time base and the other switches.

use grafsynth_ir::chart::{Setting, SettingKind};
use grafsynth_ir::diag::{Diagnostic, ErrorReported, joined, nearest};
use grafsynth_ir::net::{Policy, SHARINGS, Schedule};

use super::parser::{Parse, Parser, short};
use super::token::Kind;
use crate::codes;

/// The conflict policies and their keywords.
pub(crate) const POLICIES: [(&str, Policy); 5] = [
    ("all", Policy::All),
    ("priority", Policy::Priority),
    ("priority-age", Policy::PriorityAge),
    ("inner-first", Policy::InnerFirst),
    ("outer-first", Policy::OuterFirst),
];

/// The schedules and their keywords.
pub(crate) const SCHEDULES: [(&str, Schedule); 3] = [
    ("declared", Schedule::Declared),
    ("level", Schedule::Level),
    ("priority", Schedule::Priority),
];

/// The words as alternatives: `` `a`, `b` or `c` ``.
pub(crate) fn one_of<'a>(words: impl Iterator<Item = &'a str>) -> String {
    let words: Vec<String> = words.map(|word| format!("`{word}`")).collect();
    joined(&words, "or")
}

impl Parser<'_> {
    pub(super) fn setting(&mut self) -> Parse<Setting> {
        let start = self.peek(0).start;
        let word = self.word(0);
        self.advance();
        let kind = match word {
            "tick" => SettingKind::Tick(self.duration()?),
            "conflict" => SettingKind::Conflict(self.choice("conflict policy", &POLICIES)?),
            "evolution" => {
                if self.choice("evolution", &[("single", false), ("stable", true)])? {
                    let limit = if self.word(0) == "limit" && !self.peek(0).new_line {
                        self.advance();
                        Some(self.count("the largest number of micro-steps")?)
                    } else {
                        None
                    };
                    SettingKind::EvolutionStable(limit)
                } else {
                    SettingKind::EvolutionSingle
                }
            }
            "schedule" => SettingKind::Schedule(self.choice("schedule", &SCHEDULES)?),
            "fire" => {
                SettingKind::FireOne(self.choice("way to fire", &[("one", true), ("all", false)])?)
            }
            "assign" => SettingKind::AssignSimultaneous(
                self.choice("way to assign", &[("simultaneous", true), ("ordered", false)])?,
            ),
            "actions" => {
                self.choice("kind of actions", &[("iec", ())])?;
                SettingKind::ActionsIec
            }
            "final" => {
                self.choice("final setting", &[("scan", ())])?;
                SettingKind::FinalScan
            }
            "queue" => SettingKind::Queue(self.count("the length of the queues")?),
            "events" => {
                self.choice("setting of events", &[("exclusive", ())])?;
                SettingKind::EventsExclusive
            }
            "shared" => {
                let sharing = self.choice("way to share", &SHARINGS)?;
                let mut names = Vec::new();
                if self.is_name_beside(0) {
                    loop {
                        // After a comma, the list may continue on the next line.
                        let path = self.path("a variable")?;
                        self.keep(&mut names, path);
                        if !self.eat(Kind::Comma) {
                            break;
                        }
                    }
                }
                SettingKind::Shared(sharing, names)
            }
            _ => SettingKind::Priority(self.count("the priority of the chart")?),
        };
        Ok(Setting { kind, span: self.span_from(start) })
    }

    /// Parses one of the given words, which may contain hyphens.
    pub(super) fn choice<T: Copy>(&mut self, what: &str, among: &[(&str, T)]) -> Parse<T> {
        if self.kind(0) != Kind::Word || self.peek(0).new_line {
            let list = one_of(among.iter().map(|(word, _)| *word));
            return Err(self.missing(&format!("the {what} is missing"), &format!("write {list}")));
        }
        let first = self.advance();
        while self.kind(0) == Kind::Minus
            && self.kind(1) == Kind::Word
            && self.peek(0).start == self.previous_end
        {
            self.advance();
            self.advance();
        }
        let word = self.text.get(first.start as usize..self.previous_end as usize).unwrap_or("");
        if let Some((_, value)) = among.iter().find(|(other, _)| *other == word) {
            return Ok(*value);
        }
        let span = self.span_from(first.start);
        self.report(|| {
            let finding =
                Diagnostic::error(codes::UNKNOWN_WORD, format!("unknown {what} `{}`", short(word)));
            match nearest(word, among.iter().map(|(word, _)| *word)) {
                Some(near) => finding.at(span, format!("did you mean `{near}`?")).fix(span, near),
                None => {
                    let list = one_of(among.iter().map(|(word, _)| *word));
                    finding.at(span, "unknown here").help(format!("write {list}"))
                }
            }
        });
        Err(ErrorReported)
    }
}
