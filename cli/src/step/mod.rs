//! `sim --interactive`: a person, or a script, drives a chart reaction by reaction.
//!
//! With a terminal, each key is a command ([`keys`]); otherwise each line contains commands ([`grafsynth_sim::Command`]). Both use the same [`Stepping`].

#[cfg(unix)]
pub(crate) mod terminal;
mod view;

use crate::load::{Session, Stop};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{InputId, Net};
use grafsynth_ir::{Diagnostic, FileId};
use grafsynth_sim::{COMMANDS, ColumnKind, Command, Frame, Stepper};
use std::io::{self, BufRead as _, IsTerminal as _};

/// The longest line of commands, in bytes.
const LONGEST_LINE: u64 = 1 << 16;

/// A key of the terminal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(not(unix), allow(dead_code, reason = "keys are read on unix only"))]
pub(crate) enum Key {
    /// A printable character; `\n` for the return key.
    Char(char),
    /// The arrow to the left.
    Left,
    /// The arrow to the right.
    Right,
    /// The end of the input (Ctrl-D).
    End,
    /// Any other key.
    Other,
}

/// The keys of inputs, in the order of the inputs: digits, then the letters that no command uses.
const INPUT_KEYS: &str = "1234567890abcdefghijklopsvwyz";

/// The keys of commands, for the line below the chart.
const KEYS: &str = "space react   m micro-step   t next threshold   + - ticks   u undo   x restart   : command   ? help   q quit";

/// A session in progress.
pub(crate) struct Stepping<'n> {
    stepper: Stepper<'n>,
    /// The ticks before the next reaction.
    dt: u32,
    /// The micro-steps of the last reaction while they are shown one by one, and the number of those that were shown.
    micro: Option<(Vec<Frame>, usize)>,
}

/// What to do after a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum After {
    Show,
    Help,
    Quit,
}

impl<'n> Stepping<'n> {
    /// A session that begins at the present row of the stepper.
    pub(crate) fn new(stepper: Stepper<'n>) -> Self {
        Stepping { stepper, dt: 1, micro: None }
    }

    /// The result of the session.
    pub(crate) fn stepper(&self) -> &Stepper<'n> {
        &self.stepper
    }

    /// Runs the session on standard input until it ends.
    ///
    /// # Errors
    /// A line of a script that is not a command, which was shown, or an error of the system.
    pub(crate) fn run(&mut self, session: &mut Session) -> Result<(), Stop> {
        #[cfg(unix)]
        if io::stdin().is_terminal() && io::stdout().is_terminal() {
            return self.run_keys(session);
        }
        self.run_lines(session)
    }

    fn net(&self) -> &'n Net {
        self.stepper.simulator().net()
    }

    /// Runs commands line by line. A wrong line ends the session, unless a person can write it again.
    fn run_lines(&mut self, session: &mut Session) -> Result<(), Stop> {
        let is_person = io::stdin().is_terminal();
        self.print(&|_| None);
        for number in 0.. {
            let Some(line) = next_line()? else { break };
            match self.line(session, number, &line) {
                Ok(true) => break,
                Ok(false) => {}
                Err(finding) => {
                    session.show(&[*finding]);
                    if !is_person {
                        return Err(Stop::Errors);
                    }
                }
            }
        }
        Ok(())
    }

    /// Runs the commands of a line, or none of them; true if the session ends.
    fn line(
        &mut self,
        session: &mut Session,
        number: usize,
        line: &str,
    ) -> Result<bool, Box<Diagnostic>> {
        let file = FileId(u32::try_from(session.sources.iter().count()).unwrap_or(u32::MAX));
        let commands = Command::parse(self.net(), file, number, line).inspect_err(|_| {
            // Empty lines before it give the line its number.
            session.sources.add("<commands>", format!("{}{line}", "\n".repeat(number)));
        })?;
        let Some((last, before)) = commands.split_last() else { return Ok(false) };
        let mut after = After::Show;
        for (command, _) in before.iter().chain([last]) {
            after = self.command(*command);
            match after {
                After::Quit => return Ok(true),
                After::Help => crate::print(&self.help()),
                After::Show => {}
            }
        }
        if after == After::Show {
            self.print(&|_| None);
        }
        Ok(false)
    }

    fn command(&mut self, command: Command) -> After {
        if command != Command::Micro {
            self.micro = None;
        }
        match command {
            Command::Toggle(input) => self.stepper.set(input, 1 - self.stepper.input(input)),
            Command::Set(input, value) => self.stepper.set(input, value),
            Command::React(n) => (0..n).for_each(|_| self.stepper.react(self.dt)),
            Command::Micro => self.micro_step(),
            Command::Next => self.stepper.react(self.stepper.to_threshold().unwrap_or(self.dt)),
            Command::Dt(dt) => self.dt = dt,
            Command::Undo(n) => {
                for _ in 0..n {
                    if !self.stepper.undo() {
                        break;
                    }
                }
            }
            Command::Restart => self.stepper.restart(),
            Command::Show => {}
            Command::Help => return After::Help,
            Command::Quit => return After::Quit,
        }
        After::Show
    }

    /// The next micro-step of a reaction: that of a new one, or of the reaction whose micro-steps are shown.
    fn micro_step(&mut self) {
        self.micro = match self.micro.take() {
            None => {
                self.stepper.react(self.dt);
                Some((self.stepper.frames(), 1)).filter(|(frames, _)| !frames.is_empty())
            }
            Some((frames, shown)) => Some((frames, shown + 1)),
        }
        .filter(|(frames, shown)| *shown <= frames.len());
    }

    /// The present picture as lines.
    fn lines(&self, key: &dyn Fn(usize) -> Option<char>) -> Vec<String> {
        if let Some((frames, shown)) = &self.micro
            && let Some(frame) = frames.get(shown - 1)
        {
            return view::micro_step(self.net(), *shown, frames.len(), frame);
        }
        let mut lines = view::lines(&self.stepper, self.dt, key);
        if self.dt != 1 {
            let time = view::time(self.net(), i64::from(self.dt));
            lines.push(format!("  {:<9} {} ticks ({time}) before each reaction", "dt", self.dt));
        }
        lines
    }

    fn print(&self, key: &dyn Fn(usize) -> Option<char>) {
        crate::print(&(self.lines(key).join("\n") + "\n"));
    }

    fn help(&self) -> String {
        let mut text = String::new();
        for (word, more, what) in COMMANDS {
            let command = if more.is_empty() { word.to_owned() } else { format!("{word} {more}") };
            text += &format!("  {command:<18} {what}\n");
        }
        text += "inputs:\n";
        for input in self.inputs() {
            let input = &self.net().inputs[input];
            let range = match input.ty {
                Type::Bool if input.kind.is_event() => "event".to_owned(),
                Type::Bool => "0 or 1".to_owned(),
                Type::Int { .. } => {
                    let (lo, hi) = input.ty.bounds();
                    format!("{lo} to {hi}")
                }
            };
            text +=
                &view::clean(&format!("  {:<18} {range}  {}", input.name.text, input.meta.label));
            text = text.trim_end().to_owned() + "\n";
        }
        text
    }

    /// The inputs that a session can set, in the order of the columns of a stimulus.
    fn inputs(&self) -> Vec<InputId> {
        let columns = self.stepper.layout().columns.iter();
        columns
            .filter_map(|column| match column.kind {
                ColumnKind::Input(input) => Some(input),
                _ => None,
            })
            .collect()
    }
}

/// The next line of standard input without its end; `None` at the end of the input.
fn next_line() -> Result<Option<String>, Stop> {
    let mut line = String::new();
    let read = io::Read::take(io::stdin().lock(), LONGEST_LINE).read_line(&mut line);
    match read {
        Ok(0) => Ok(None),
        Ok(n) if n as u64 == LONGEST_LINE && !line.ends_with('\n') => {
            Err(Stop::Input(format!("a line of commands is longer than {LONGEST_LINE} bytes")))
        }
        Ok(_) => Ok(Some(line.trim_end_matches(['\n', '\r']).to_owned())),
        Err(error) => Err(Stop::Usage(format!("cannot read the commands: {error}"))),
    }
}

#[cfg(unix)]
mod keys {
    //! The session with keys.

    use super::{After, INPUT_KEYS, KEYS, Key, Stepping, terminal, view};
    use crate::load::{Session, Stop};
    use grafsynth_ir::expr::Type;
    use grafsynth_ir::net::InputId;
    use grafsynth_sim::{Command, MAX_DT};

    /// Moves to the top left corner, and clears from there.
    const CLEAR: &str = "\x1b[H\x1b[J";

    /// Reads a line after a prompt; `None` at the end of the input.
    fn typed(prompt: &str) -> Result<Option<String>, Stop> {
        crate::print(&view::clean(prompt));
        super::next_line()
    }

    /// What a key asks for.
    enum Asked {
        Command(Command),
        /// A value for an input, as a line of text.
        Value(InputId),
        /// A line of commands.
        Line,
        Nothing,
    }

    impl Stepping<'_> {
        pub(super) fn run_keys(&mut self, session: &mut Session) -> Result<(), Stop> {
            let mut keys = terminal::Keys::new();
            let mut below = String::new();
            // The findings about the chart stay in sight until the first key.
            let mut clear = "";
            loop {
                self.draw(session, clear, &below);
                clear = CLEAR;
                below.clear();
                let pressed = keys.next();
                let pressed =
                    pressed.map_err(|why| Stop::Usage(format!("cannot read the keys: {why}")))?;
                let Some(key) = pressed else { return Ok(()) };
                let after = match self.asked(key) {
                    Asked::Command(command) => self.command(command),
                    Asked::Value(input) => {
                        let name = self.net().inputs[input].name.text.clone();
                        match typed(&format!("{name}="))? {
                            Some(value) => {
                                self.typed_line(session, &format!("set {name}={value}"), &mut below)
                            }
                            None => return Ok(()),
                        }
                    }
                    Asked::Line => match typed(":")? {
                        Some(line) => self.typed_line(session, &line, &mut below),
                        None => return Ok(()),
                    },
                    Asked::Nothing => After::Show,
                };
                match after {
                    After::Quit => return Ok(()),
                    After::Help => below = self.help(),
                    After::Show => {}
                }
            }
        }

        /// Runs a line of commands; a wrong one is explained below the chart.
        fn typed_line(&mut self, session: &mut Session, line: &str, below: &mut String) -> After {
            match self.line(session, 0, line) {
                Ok(true) => After::Quit,
                Ok(false) => After::Show,
                Err(finding) => {
                    let help =
                        finding.help.as_ref().map_or(String::new(), |help| format!("; {help}"));
                    *below = view::clean(&format!("{}{help}", finding.message)) + "\n";
                    After::Show
                }
            }
        }

        fn asked(&self, key: Key) -> Asked {
            Asked::Command(match key {
                Key::Char(' ' | '\n') | Key::Right => Command::React(1),
                Key::Char('m') => Command::Micro,
                Key::Char('t') => Command::Next,
                Key::Char('+') => Command::Dt((self.dt + 1).min(MAX_DT)),
                Key::Char('-') => Command::Dt(self.dt.saturating_sub(1)),
                Key::Char('u') | Key::Left => Command::Undo(1),
                Key::Char('x') => Command::Restart,
                Key::Char('?') => Command::Help,
                Key::Char('q') | Key::End => Command::Quit,
                Key::Char(':') => return Asked::Line,
                Key::Char(other) => {
                    let at = INPUT_KEYS.chars().position(|key| key == other);
                    let Some(input) = at.and_then(|at| self.inputs().get(at).copied()) else {
                        return Asked::Nothing;
                    };
                    match self.net().inputs[input].ty {
                        Type::Bool => Command::Toggle(input),
                        Type::Int { .. } => return Asked::Value(input),
                    }
                }
                Key::Other => return Asked::Nothing,
            })
        }

        /// Draws the chart on the terminal, as much of it as fits.
        fn draw(&self, session: &Session, clear: &str, below: &str) {
            let key = |at: usize| INPUT_KEYS.chars().nth(at);
            let mut lines = self.lines(&key);
            let more: Vec<String> = below.lines().map(str::to_owned).collect();
            let height = session.style.height.unwrap_or(crate::HEIGHT);
            let room = height.saturating_sub(more.len() + 4).max(1);
            if lines.len() > room {
                lines.truncate(room);
                lines.push("  ...".to_owned());
            }
            lines.push(String::new());
            lines.extend(more);
            lines.push(KEYS.to_owned());
            let width = session.style.width.max(20);
            let cut = |line: &String| line.chars().take(width - 1).collect::<String>();
            let lines: Vec<String> = lines.iter().map(cut).collect();
            crate::print(&format!("{clear}{}\n", lines.join("\n")));
        }
    }
}
