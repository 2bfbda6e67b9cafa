//! A compiled chart that executes single reactions, from any state that it has been in.

use crate::c;
use crate::executed::{Instance, Trouble};
use crate::interpreted::{Text, Tree};
use crate::watchdog::{Watchdog, kill};
use grafsynth_backend_c::Package;
use grafsynth_ir::Valid;
use grafsynth_ir::instance::Representation;
use grafsynth_ir::net::Net;
use grafsynth_sim::{InputRow, Row, TraceLayout};
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A cell of a row that differs from the net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Cell {
    pub(crate) column: String,
    pub(crate) expected: String,
    pub(crate) got: String,
}

/// A path to a row that differs; a shortest one if it comes from the enumeration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Difference {
    pub(crate) path: Vec<InputRow>,
    pub(crate) cell: Cell,
}

/// How a chart is compiled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Build {
    /// As written.
    Plain,
    /// With sanitizers where the compiler has them, so that undefined behaviour ends the program.
    Sanitized,
}

/// How the C is executed.
#[derive(Clone, Copy)]
pub(crate) enum Runner<'n> {
    /// Compiled, as a program of its own.
    Compiled(Build),
    /// From its tree, with the interface: the representation without a state.
    Tree(&'n Text<'n>, &'n Representation),
}

/// The executed chart.
pub(crate) enum Explorer<'n> {
    /// A compiled program.
    Compiled(Process),
    /// A tree.
    Tree(Box<Tree<'n>>),
}

impl<'n> Explorer<'n> {
    /// Starts the C of a package.
    ///
    /// # Errors
    /// The output of the compiler, or the reason why the C does not run.
    pub(crate) fn start(
        net: &'n Valid<Net>,
        package: &Package,
        runner: Runner<'n>,
    ) -> Result<Started<'n>, Trouble> {
        match runner {
            Runner::Compiled(build) => {
                let (process, row, instance) = Process::start(net, package, build)?;
                Ok(Started { explorer: Explorer::Compiled(process), row, instance })
            }
            Runner::Tree(text, interface) => {
                let (tree, row, instance) = Tree::start(net, text, interface)?;
                Ok(Started { explorer: Explorer::Tree(Box::new(tree)), row, instance })
            }
        }
    }

    /// Requests all of these reactions ([`push`]) and processes the answers as they come, until the caller rejects one; then the program is stopped.
    pub(crate) fn ask(
        &mut self,
        questions: &str,
        n_answers: usize,
        mut take: impl FnMut(usize, &str, Instance) -> bool,
    ) -> Result<(), Trouble> {
        match self {
            Explorer::Compiled(process) => process.ask(questions, n_answers, take),
            Explorer::Tree(tree) => {
                for (at, question) in questions.lines().enumerate() {
                    let (row, instance) = tree.answer(question)?;
                    if !take(at, &row, instance) {
                        break;
                    }
                }
                Ok(())
            }
        }
    }
}

/// The compiled chart with its pipes.
pub(crate) struct Process {
    /// The process, shared with the watchdog.
    child: Arc<Mutex<Child>>,
    watchdog: Watchdog,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    /// Keeps the folder of the program until the program has ended.
    program: c::Program,
}

/// A chart in C after `init`.
pub(crate) struct Started<'n> {
    pub(crate) explorer: Explorer<'n>,
    /// The row that it printed.
    pub(crate) row: String,
    /// The number of its state.
    pub(crate) instance: Instance,
}

impl Drop for Process {
    fn drop(&mut self) {
        // The program ends when its input ends; otherwise it is stopped.
        self.input = None;
        kill(&self.child);
        if let Ok(mut child) = self.child.lock() {
            let _ = child.wait();
        }
    }
}

impl Process {
    /// Compiles the package without optimisation, which would only cost time, and starts it.
    ///
    /// # Errors
    /// The output of the compiler, or the reason why the program does not run.
    fn start(
        net: &Valid<Net>,
        package: &Package,
        build: Build,
    ) -> Result<(Process, String, Instance), Trouble> {
        let main = grafsynth_backend_c::explorer(net, package);
        let mut flags = FLAGS.to_vec();
        if build == Build::Sanitized {
            flags.extend(c::sanitizers());
        }
        let program = match c::compile(package, &main, &flags) {
            Ok(program) => program,
            Err(c::CompileError::Machine(why)) => return Err(Trouble::Machine(why)),
            Err(c::CompileError::Refused(words)) => {
                // A compiler for another machine fails for every program.
                return Err(match c::compile_text("int main(void) { return 0; }\n", &FLAGS) {
                    Ok(_) => Trouble::Compiler(words),
                    Err(_) => Trouble::Machine(
                        "the C compiler cannot create programs for this machine".to_owned(),
                    ),
                });
            }
        };
        let mut child = Command::new(&program.path)
            .envs(c::SANITIZER_OPTIONS)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(create(&said(&program)))
            .spawn()
            .map_err(|error| {
                Trouble::Machine(format!("the compiled chart cannot be started: {error}"))
            })?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(Trouble::Machine("cannot connect to the compiled chart".to_owned()));
        };
        let child = Arc::new(Mutex::new(child));
        let mut explorer = Process {
            watchdog: Watchdog::new(Arc::clone(&child), PATIENCE),
            child,
            input: Some(input),
            output: BufReader::with_capacity(1 << 16, output),
            program,
        };
        let mut first = (String::new(), 0);
        explorer.batch("", |output| {
            output.read_line(&mut String::new()).map_err(Lost::Broken)?;
            first.0 = take_line(output)?;
            first.1 = number(&take_line(output)?)?;
            Ok(())
        })?;
        Ok((explorer, first.0, first.1))
    }

    fn ask(
        &mut self,
        questions: &str,
        n_answers: usize,
        mut take: impl FnMut(usize, &str, Instance) -> bool,
    ) -> Result<(), Trouble> {
        if n_answers == 0 {
            return Ok(());
        }
        self.batch(&format!("{n_answers}\n{questions}"), |output| {
            let (mut row, mut state) = (String::new(), String::new());
            for at in 0..n_answers {
                read_line(output, &mut row)?;
                read_line(output, &mut state)?;
                if !take(at, &row, number(&state)?) {
                    return Err(Lost::NotWanted);
                }
            }
            Ok(())
        })
    }

    /// Sends requests and reads their answers concurrently: a full pipe on one side must not block the other. A batch that takes too long is stopped.
    fn batch(
        &mut self,
        questions: &str,
        read: impl FnOnce(&mut BufReader<ChildStdout>) -> Result<(), Lost>,
    ) -> Result<(), Trouble> {
        let Process { child, watchdog, input, output, .. } = self;
        let mut pipe = input.take().ok_or_else(ended)?;
        let write = move || {
            // If the program has ended, its answers show it.
            let _ = pipe.write_all(questions.as_bytes()).and_then(|()| pipe.flush());
            pipe
        };
        let read = || {
            let outcome = read(output);
            if outcome.is_err() {
                // Lets the writer end.
                kill(child);
            }
            outcome
        };
        let (outcome, pipe) = watchdog.during(|| {
            if questions.len() <= PIPE {
                let pipe = write();
                return (read(), Some(pipe));
            }
            std::thread::scope(|scope| {
                let writer = scope.spawn(write);
                (read(), writer.join().ok())
            })
        });
        *input = pipe;
        match outcome {
            Ok(()) | Err(Lost::NotWanted) => Ok(()),
            Err(_) if self.watchdog.is_late() => Err(Trouble::Chart(format!(
                "a reaction did not end within {} seconds",
                PATIENCE.as_secs()
            ))),
            Err(Lost::Broken(error)) => {
                Err(Trouble::Machine(format!("the compiled chart cannot be read: {error}")))
            }
            Err(Lost::Nonsense(text)) => {
                Err(Trouble::Chart(format!("the compiled chart printed `{text}`")))
            }
            Err(Lost::Ended) => Err(self.why_ended()),
        }
    }

    /// Why the program ended before it gave all answers.
    fn why_ended(&mut self) -> Trouble {
        let status = self.child.lock().ok().and_then(|mut child| child.wait().ok());
        match status {
            // The harness itself ran out of memory.
            Some(status) if status.code() == Some(1) => {
                Trouble::Machine("the compiled chart ran out of memory".to_owned())
            }
            Some(status) => {
                Trouble::Chart(match undefined_behaviour(&read(&said(&self.program))) {
                    Some(what) => format!("the compiled chart has undefined behaviour: {what}"),
                    None => format!("the compiled chart crashed: {status}"),
                })
            }
            None => ended(),
        }
    }
}

/// The file with the standard error of a program.
fn said(program: &c::Program) -> PathBuf {
    program.folder.path().join("stderr")
}

#[expect(clippy::disallowed_methods, reason = "engines work in temporary folders")]
fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_default()
}

#[expect(clippy::disallowed_methods, reason = "engines work in temporary folders")]
fn create(path: &Path) -> Stdio {
    File::create(path).map_or_else(|_| Stdio::null(), Stdio::from)
}

/// What a sanitizer reported, with the place: `plant.c:12:5: index 4 out of bounds for type 'uint8_t [4]'`.
fn undefined_behaviour(said: &str) -> Option<String> {
    said.lines().find_map(|line| {
        if let Some((place, what)) = line.split_once(": runtime error: ") {
            return Some(format!("{}: {what}", file_name(place)));
        }
        let (_, summary) = line.split_once("SUMMARY: AddressSanitizer: ")?;
        let mut words = summary.split_whitespace();
        let (what, place) = (words.next()?, words.next().unwrap_or_default());
        Some(format!("{}: {what}", file_name(place)))
    })
}

/// A place without its folder, which is temporary.
fn file_name(place: &str) -> &str {
    place.rsplit_once(['/', '\\']).map_or(place, |(_, name)| name)
}

fn ended() -> Trouble {
    Trouble::Machine("the compiled chart has ended".to_owned())
}

/// Why answers of a batch are missing.
enum Lost {
    /// The caller needs no more answers.
    NotWanted,
    Ended,
    Nonsense(String),
    Broken(std::io::Error),
}

fn read_line(output: &mut BufReader<ChildStdout>, line: &mut String) -> Result<(), Lost> {
    line.clear();
    match output.read_line(line) {
        Ok(_) if line.ends_with('\n') => {
            line.truncate(line.trim_end().len());
            Ok(())
        }
        Ok(_) => Err(Lost::Ended),
        Err(error) => Err(Lost::Broken(error)),
    }
}

fn take_line(output: &mut BufReader<ChildStdout>) -> Result<String, Lost> {
    let mut line = String::new();
    read_line(output, &mut line)?;
    Ok(line)
}

fn number(text: &str) -> Result<Instance, Lost> {
    text.parse().map_err(|_| Lost::Nonsense(text.to_owned()))
}

/// The flags of the compiler: without optimisation, so that the text is tested as written.
const FLAGS: [&str; 2] = ["-std=c99", "-O0"];

/// What a pipe takes at once: the program has read everything before, since all its answers came.
const PIPE: usize = 4096;

/// The time limit for a batch of answers, which normally takes some milliseconds.
const PATIENCE: Duration = Duration::from_secs(10);

/// The start of a reaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Start {
    /// This state.
    State(Instance),
    /// The state after this answer; answer 0 is the state after `init`.
    Answer(usize),
}

/// Adds a request.
pub(crate) fn push(net: &Net, from: Start, row: &InputRow, text: &mut String) {
    // Writing to a string cannot fail.
    let _ = match from {
        Start::State(instance) => write!(text, "{instance} "),
        Start::Answer(answer) => write!(text, "-{} ", answer + 1),
    };
    c::line(net, row, text);
}

/// The first cell of a printed row that differs from the simulator's. The row number is not compared.
pub(crate) fn differs(layout: &TraceLayout, expected: &Row, printed: &str) -> Option<Cell> {
    // Nearly all rows are equal, so whole rows are compared first.
    let mut whole = String::with_capacity(printed.len());
    layout.write_cells(expected, &mut whole);
    if printed.split_once(',').is_some_and(|(_, cells)| cells == whole) {
        return None;
    }
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
