//! A compiled chart that answers for single reactions, from any state that it has been in.

use crate::c;
use grafsynth_backend_c::{Carried, Package};
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{InputRow, Row, TraceLayout};
use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write as _};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// The number of a state of the compiled chart; equal states have equal numbers.
pub(crate) type Instance = usize;

/// A cell of a row that is not what the net says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Cell {
    pub(crate) column: String,
    pub(crate) expected: String,
    pub(crate) got: String,
}

/// The compiled chart with its pipes.
pub(crate) struct Explorer {
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    /// Goes when the program has ended.
    _program: c::Program,
}

impl Drop for Explorer {
    fn drop(&mut self) {
        // It ends when its input does; if not, it is stopped.
        self.input = None;
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Explorer {
    /// Compiles the package as it is written (optimising would only cost time) and starts it; gives the row after `init` and the number of that state.
    ///
    /// # Errors
    /// What the compiler says, or that the program does not run.
    pub(crate) fn start(
        net: &Valid<Net>,
        package: &Package,
        carried: Carried,
    ) -> Result<(Self, String, Instance), Trouble> {
        let main = grafsynth_backend_c::explorer(net, package, carried);
        let program =
            c::compile(package, &main, &["-std=c99", "-O0"]).map_err(Trouble::Compiler)?;
        let mut child = Command::new(&program.path)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| {
                Trouble::Program(format!("the compiled chart cannot be started: {error}"))
            })?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(Trouble::Program("the compiled chart has no pipes".to_owned()));
        };
        let mut explorer = Explorer {
            child,
            input: Some(input),
            output: BufReader::new(output),
            _program: program,
        };
        let mut header = String::new();
        explorer.output.read_line(&mut header).map_err(|error| {
            Trouble::Program(format!("the compiled chart cannot be read: {error}"))
        })?;
        let (row, start) = explorer.answer().map_err(Trouble::Program)?;
        Ok((explorer, row, start))
    }

    fn answer(&mut self) -> Result<(String, Instance), String> {
        let mut line = |text: &mut String| match self.output.read_line(text) {
            Ok(n) if n > 0 => Ok(()),
            Ok(_) => Err("the compiled chart ended early".to_owned()),
            Err(error) => Err(format!("the compiled chart cannot be read: {error}")),
        };
        let (mut row, mut state) = (String::new(), String::new());
        line(&mut row)?;
        line(&mut state)?;
        let state = state
            .trim()
            .parse()
            .map_err(|_| format!("the compiled chart printed `{}`", state.trim()))?;
        row.truncate(row.trim_end().len());
        Ok((row, state))
    }

    /// One reaction from a state: the row that it prints, and the state that it comes to.
    pub(crate) fn one(
        &mut self,
        net: &Net,
        from: Instance,
        row: &InputRow,
    ) -> Result<(String, Instance), String> {
        let mut question = String::new();
        push(net, from, row, &mut question);
        let input = self.input.as_mut().ok_or("the compiled chart has ended")?;
        input
            .write_all(question.as_bytes())
            .and_then(|()| input.flush())
            .map_err(|error| format!("the compiled chart cannot be asked: {error}"))?;
        self.answer()
    }

    /// Asks for all of these reactions and takes the answers as they come, until one is not taken: then the program is over.
    pub(crate) fn ask(
        &mut self,
        questions: &str,
        n_answers: usize,
        mut take: impl FnMut(usize, &str, Instance) -> bool,
    ) -> Result<(), String> {
        let Some(mut input) = self.input.take() else {
            return Err("the compiled chart has ended".to_owned());
        };
        std::thread::scope(|scope| {
            // Questions and answers are served at once: a full pipe on one side must not stop the other.
            let writer = scope.spawn(move || {
                let sent = input.write_all(questions.as_bytes()).and_then(|()| input.flush());
                (input, sent)
            });
            let mut outcome = Ok(());
            for at in 0..n_answers {
                match self.answer() {
                    // A difference was found: the program is stopped, so that the writer ends.
                    Ok((row, state)) => {
                        if !take(at, &row, state) {
                            let _ = self.child.kill();
                            break;
                        }
                    }
                    Err(why) => {
                        outcome = Err(why);
                        let _ = self.child.kill();
                        break;
                    }
                }
            }
            match writer.join() {
                Ok((input, _)) => {
                    self.input = Some(input);
                    outcome
                }
                Err(_) => Err("the compiled chart cannot be asked".to_owned()),
            }
        })
    }
}

/// Why a compiled chart does not answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Trouble {
    /// The compiler refuses the text: its words.
    Compiler(String),
    /// The program does not run, or ended, as it should not.
    Program(String),
}

/// A question: a state, then the line of a harness.
pub(crate) fn push(net: &Net, from: Instance, row: &InputRow, text: &mut String) {
    let _ = write!(text, "{from} ");
    c::line(net, row, text);
}

/// The first cell of a printed row that differs from the simulator's. The number of the scan is not compared.
pub(crate) fn differs(layout: &TraceLayout, expected: &Row, printed: &str) -> Option<Cell> {
    let wanted = layout.row(expected);
    let mut cells = printed.split(',');
    for (at, column) in layout.columns.iter().enumerate() {
        let got = cells.next().unwrap_or("(missing)");
        let is_open = wanted.open.get(at).copied().unwrap_or(false);
        let expected = wanted.values.get(at).map(|value| layout.text(value)).unwrap_or_default();
        if at > 0 && !is_open && got != expected {
            return Some(Cell { column: column.name.clone(), expected, got: got.to_owned() });
        }
    }
    None
}
