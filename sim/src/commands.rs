//! The commands of a session of `sim --interactive`, as lines of text.
//!
//! A line contains commands with `;` between them; `#` begins a comment. The words are those of [`Command`]; a name that is not one of them is an input.

use grafsynth_ir::diag::nearest;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{InputId, InputKind, Net};
use grafsynth_ir::{Diagnostic, FileId, Span};

use crate::codes;
use crate::row::has_column;
use crate::stimulus::{MAX_DT, full_name, listed};

/// The largest number of reactions that one command makes or undoes.
const MOST_REACTIONS: u32 = 1_000_000;

/// A command of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// `NAME`: changes a Boolean input from 0 to 1 or back; an event occurs in the next reaction, or does not after all.
    Toggle(InputId),
    /// `NAME=VALUE`: sets an input.
    Set(InputId, i64),
    /// `react [N]`: one reaction, or N.
    React(u32),
    /// `micro`: the next micro-step of a reaction; after the last one, the result of the reaction.
    Micro,
    /// `next`: one reaction at the next threshold of a timer.
    Next,
    /// `dt TICKS`: the ticks before each of the next reactions.
    Dt(u32),
    /// `undo [N]`: undoes the last reaction, or the last N.
    Undo(u32),
    /// `restart`: undoes all reactions.
    Restart,
    /// `show`: shows the chart again.
    Show,
    /// `help`: lists the commands and the inputs.
    Help,
    /// `quit`: ends the session.
    Quit,
}

/// The words of commands, with what follows them and what they do, for help texts.
pub const COMMANDS: [(&str, &str, &str); 12] = [
    ("NAME", "", "change a Boolean input; let an event occur in the next reaction"),
    ("NAME=VALUE", "", "set an input"),
    ("set", "NAME[=VALUE]", "the same, for an input whose name is also a command"),
    ("react", "[N]", "run one reaction, or N"),
    ("micro", "", "run a reaction and show its first micro-step; repeat for the next one"),
    ("next", "", "run a reaction at the next threshold of a timer"),
    ("dt", "TICKS", "set the ticks before each following reaction (default: 1)"),
    ("undo", "[N]", "undo the last reaction, or the last N"),
    ("restart", "", "undo all reactions"),
    ("show", "", "show the chart again"),
    ("help", "", "list the commands and the inputs"),
    ("quit", "", "write the requested files and end"),
];

impl Command {
    /// The commands of one line, each with its location; the line begins at byte `start` of `file`.
    ///
    /// # Errors
    /// The first command that is not one.
    pub fn parse(
        net: &Net,
        file: FileId,
        start: usize,
        line: &str,
    ) -> Result<Vec<(Command, Span)>, Box<Diagnostic>> {
        let line = line.split_once('#').map_or(line, |(before, _)| before);
        let mut commands = Vec::new();
        let mut at = start;
        for part in line.split(';') {
            let text = part.trim();
            if !text.is_empty() {
                let first = at + (part.len() - part.trim_start().len());
                let words = Words { net, file, start: first, text };
                let span = Span::new(file, first, first + text.len());
                commands.push((words.command()?, span));
            }
            at += part.len() + 1;
        }
        Ok(commands)
    }
}

/// The text of one command.
struct Words<'t> {
    net: &'t Net,
    file: FileId,
    start: usize,
    text: &'t str,
}

impl Words<'_> {
    fn command(&self) -> Result<Command, Box<Diagnostic>> {
        let (word, rest) = self.text.split_once(char::is_whitespace).unwrap_or((self.text, ""));
        let rest = rest.trim();
        if rest.starts_with('=') || word.contains('=') {
            return if word == "set" { self.input(rest) } else { self.input(self.text) };
        }
        // A short form is free for an input with this name.
        let is_word = COMMANDS.iter().skip(2).any(|(full, ..)| *full == word);
        if !is_word && self.net.inputs.values().any(|input| input.name.text == self.text) {
            return self.input(self.text);
        }
        let alone =
            |command| if rest.is_empty() { Ok(command) } else { Err(self.surplus(word).into()) };
        match word {
            "set" => self.input(rest),
            "react" | "r" => self.count(rest).map(Command::React),
            "undo" | "u" => self.count(rest).map(Command::Undo),
            "dt" => self.dt(rest),
            "micro" | "m" => alone(Command::Micro),
            "next" | "n" => alone(Command::Next),
            "restart" => alone(Command::Restart),
            "show" => alone(Command::Show),
            "help" | "?" => alone(Command::Help),
            "quit" | "q" => alone(Command::Quit),
            _ => self.input(self.text),
        }
    }

    /// The location of the whole command.
    fn span(&self) -> Span {
        Span::new(self.file, self.start, self.start + self.text.len())
    }

    fn wrong(&self, message: String) -> Diagnostic {
        Diagnostic::error(codes::SESSION_COMMAND, message).at(self.span(), "")
    }

    fn surplus(&self, word: &str) -> Diagnostic {
        self.wrong(format!("unexpected text after `{word}`"))
            .help("separate the commands on a line with `;`")
    }

    fn count(&self, text: &str) -> Result<u32, Box<Diagnostic>> {
        match text.parse::<u32>() {
            _ if text.is_empty() => Ok(1),
            Ok(count) if (1..=MOST_REACTIONS).contains(&count) => Ok(count),
            Ok(_) | Err(_) => Err(self
                .wrong(format!("invalid number of reactions: `{text}`"))
                .help(format!("write a whole number from 1 to {MOST_REACTIONS}"))
                .into()),
        }
    }

    fn dt(&self, text: &str) -> Result<Command, Box<Diagnostic>> {
        match text.parse::<u32>() {
            Ok(dt) if dt <= MAX_DT => Ok(Command::Dt(dt)),
            Ok(_) | Err(_) => Err(self
                .wrong(format!("invalid number of ticks: `{text}`"))
                .help(format!("write a whole number from 0 to {MAX_DT}, such as `dt 5`"))
                .into()),
        }
    }

    /// `NAME` or `NAME=VALUE`.
    fn input(&self, text: &str) -> Result<Command, Box<Diagnostic>> {
        let (name, value) = match text.split_once('=') {
            Some((name, value)) => (name.trim(), Some(value.trim())),
            None => (text, None),
        };
        let of_name = |name: &str| self.net.inputs.iter().find(|(_, it)| it.name.text == name);
        // A short name is enough if only one input has it, as in the header of a stimulus.
        let found = match (of_name(name), full_name(name, &self.names())) {
            (Some(found), _) => Some(found),
            (None, Ok(full)) => of_name(full),
            (None, Err(all)) => return Err(self.ambiguous(name, &all).into()),
        };
        let Some((id, input)) = found else { return Err(self.unknown(name).into()) };
        if input.kind == InputKind::InternalEvent {
            return Err(self
                .wrong(format!("`{name}` is an internal event: only the chart raises it"))
                .help("change an input that makes the chart raise it")
                .into());
        }
        let Some(value) = value else {
            return match input.ty {
                Type::Bool => Ok(Command::Toggle(id)),
                Type::Int { .. } => Err(self
                    .wrong(format!("no value for the numeric input `{name}`"))
                    .help(format!("write `{name}=VALUE`"))
                    .into()),
            };
        };
        let (lo, hi) = input.ty.bounds();
        match value.parse::<i64>() {
            Ok(number) if (lo..=hi).contains(&number) => Ok(Command::Set(id, number)),
            Ok(_) | Err(_) => Err(self
                .wrong(format!("invalid value for `{name}`: `{value}`"))
                .help(format!("write a whole number from {lo} to {hi}"))
                .into()),
        }
    }

    /// The names of the inputs that a session can set.
    fn names(&self) -> Vec<&str> {
        let inputs = self.net.inputs.values().filter(|input| has_column(input.kind));
        inputs.map(|input| input.name.text.as_str()).collect()
    }

    fn ambiguous(&self, name: &str, candidates: &[&str]) -> Diagnostic {
        self.wrong(format!("`{name}` is the short name of {} different inputs", candidates.len()))
            .help(format!("write the full name: {}", listed(candidates.iter().copied())))
    }

    fn unknown(&self, name: &str) -> Diagnostic {
        let names = self.names().into_iter();
        let words = COMMANDS.iter().skip(2).map(|(word, ..)| *word);
        let finding = self.wrong(format!("`{name}` is neither a command nor an input"));
        match nearest(name, names.chain(words)) {
            Some(near) => finding.help(format!("did you mean `{near}`?")),
            None => finding.help("`help` lists the commands and the inputs"),
        }
    }
}
