//! Compiles the emitted C with the host's compiler and runs it.

use crate::scratch::Scratch;
use crate::tools;
use crate::{Availability, Engine, EngineError, Job};
use grafsynth_backend_c::{Options, Package};
use grafsynth_ir::FileId;
use grafsynth_ir::net::{InputKind, Net};
use grafsynth_sim::{InputRow, Stimulus, Trace, TraceLayout};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Duration;

/// The emitted C, compiled by the host's C compiler.
#[derive(Debug, Clone, Default)]
pub struct CEngine {
    /// The style and callbacks of the emitted C.
    pub options: Options,
}

/// The time limit of a compiler, longer than it needs for any chart in the tests.
pub(crate) const LIMIT: Duration = Duration::from_secs(300);

/// The flags of the compiler. No warnings are requested: the tests check that the emitted text compiles without any, and the user's
/// compiler may have other warnings.
const FLAGS: [&str; 2] = ["-std=c99", "-O1"];

impl Engine for CEngine {
    fn name(&self) -> &'static str {
        "c"
    }

    fn about(&self) -> &'static str {
        "the C text, compiled by the host's compiler"
    }

    fn runs_c(&self) -> bool {
        true
    }

    fn availability(&self) -> Availability {
        if tools::c_compiler().is_some() {
            Availability::Here
        } else {
            Availability::Missing("a C compiler".to_owned())
        }
    }

    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError> {
        let package = grafsynth_backend_c::emit(job.net, job.facts, &self.options)
            .map_err(EngineError::Refused)?;
        let main = grafsynth_backend_c::harness(job.net, &package);
        let program = compile(&package, &main, &FLAGS)
            .map_err(|error| EngineError::Failed(error.to_string()))?;
        let input = lines(job.net, job.stimulus);
        let run = tools::run(&program.path, &[], program.folder.path(), input.as_bytes(), LIMIT)
            .map_err(EngineError::Failed)?;
        if !run.is_success {
            return Err(EngineError::Failed(format!(
                "the compiled chart ended with {} {}",
                run.ending,
                run.stderr.trim()
            )));
        }
        parse(job.net, &run.stdout)
    }
}

/// The flags with which a program stops at undefined behaviour: an overflow, an index or an address outside its array, a shift that is too wide.
const SANITIZERS: [&str; 3] = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g1"];

/// The environment of a program with sanitizers. The exit code differs from those of the harness; memory that is not freed is no fault of a chart.
pub(crate) const SANITIZER_OPTIONS: [(&str, &str); 2] =
    [("ASAN_OPTIONS", "exitcode=99:detect_leaks=0"), ("UBSAN_OPTIONS", "exitcode=99")];

/// The flags of the sanitizers, or none if programs with them cannot be compiled or run here.
pub(crate) fn sanitizers() -> &'static [&'static str] {
    static WORK: OnceLock<bool> = OnceLock::new();
    let work = *WORK.get_or_init(|| {
        let Ok(program) = compile_text("int main(void) { return 0; }\n", &SANITIZERS) else {
            return false;
        };
        let run = tools::run(&program.path, &[], program.folder.path(), b"", LIMIT);
        run.is_ok_and(|run| run.is_success)
    });
    if work { &SANITIZERS } else { &[] }
}

/// The trace that a harness printed.
///
/// # Errors
/// The output is not a trace of this net.
pub fn parse(net: &Net, output: &[u8]) -> Result<Trace, EngineError> {
    let text = String::from_utf8_lossy(output);
    Trace::parse_csv(&TraceLayout::of(net), FileId(u32::MAX), &text).map_err(|found| {
        let why = found.first().map(|diagnostic| diagnostic.message.clone()).unwrap_or_default();
        EngineError::Failed(format!("the compiled chart did not print a trace: {why}"))
    })
}

/// A compiled program; dropping it removes its folder.
#[derive(Debug)]
pub struct Program {
    /// The folder, removed on drop.
    pub folder: Scratch,
    /// The executable.
    pub path: PathBuf,
}

/// Why there is no program.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CompileError {
    /// The compiler rejects the text: its output.
    Refused(String),
    /// There is no compiler, or it cannot be run.
    Machine(String),
}

impl std::fmt::Display for CompileError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            CompileError::Refused(words) => {
                write!(f, "the C compiler rejected the emitted text: {words}")
            }
            CompileError::Machine(why) => f.write_str(why),
        }
    }
}

impl From<CompileError> for String {
    fn from(error: CompileError) -> Self {
        error.to_string()
    }
}

/// Compiles a package with a `main`, without the user's library (the harness provides its functions).
///
/// # Errors
/// The output of the compiler.
pub fn compile(package: &Package, main: &str, flags: &[&str]) -> Result<Program, CompileError> {
    let folder = temporary().map_err(CompileError::Machine)?;
    let mut sources = vec!["bench_main.c".to_owned()];
    for file in &package.files {
        write(folder.path(), &file.name, &file.text).map_err(CompileError::Machine)?;
        if file.name.ends_with(".c") && !file.keep_existing {
            sources.push(file.name.clone());
        }
    }
    write(folder.path(), "bench_main.c", main).map_err(CompileError::Machine)?;
    compile_in(folder, &sources, flags, &[])
}

/// Compiles one text that is a complete program.
///
/// # Errors
/// The output of the compiler.
pub fn compile_text(text: &str, flags: &[&str]) -> Result<Program, String> {
    let folder = temporary()?;
    write(folder.path(), "bench_main.c", text)?;
    Ok(compile_in(folder, &["bench_main.c".to_owned()], flags, &[])?)
}

/// Compiles with a compiler other than the host's.
///
/// # Errors
/// The output of that compiler.
pub fn compile_text_by(compiler: &Path, text: &str, flags: &[&str]) -> Result<Program, String> {
    let folder = temporary()?;
    write(folder.path(), "bench_main.c", text)?;
    Ok(compile_by(compiler, folder, &["bench_main.c".to_owned()], flags, &[])?)
}

/// Like [`compile_text`], with libraries after the text on the command line.
///
/// # Errors
/// The output of the compiler.
pub fn compile_with(text: &str, flags: &[&str], libraries: &[&str]) -> Result<Program, String> {
    let folder = temporary()?;
    write(folder.path(), "bench_main.c", text)?;
    Ok(compile_in(folder, &["bench_main.c".to_owned()], flags, libraries)?)
}

fn compile_in(
    folder: Scratch,
    sources: &[String],
    flags: &[&str],
    libraries: &[&str],
) -> Result<Program, CompileError> {
    let compiler = tools::c_compiler().ok_or_else(|| {
        CompileError::Machine("no C compiler found; install one or set CC".to_owned())
    })?;
    compile_by(&compiler, folder, sources, flags, libraries)
}

fn compile_by(
    compiler: &Path,
    folder: Scratch,
    sources: &[String],
    flags: &[&str],
    libraries: &[&str],
) -> Result<Program, CompileError> {
    let path = folder.path().join("bench");
    let output = path.display().to_string();
    let mut arguments: Vec<&str> = flags.to_vec();
    arguments.extend(["-o", &output]);
    arguments.extend(sources.iter().map(String::as_str));
    arguments.extend(libraries);
    let compiled = tools::run(compiler, &arguments, folder.path(), b"", LIMIT)
        .map_err(CompileError::Machine)?;
    if compiled.is_success {
        Ok(Program { folder, path })
    } else {
        Err(CompileError::Refused(compiled.stderr.trim().to_owned()))
    }
}

fn temporary() -> Result<Scratch, String> {
    Scratch::new().map_err(|error| format!("cannot create a temporary folder: {error}"))
}

#[expect(clippy::disallowed_methods, reason = "engines work in temporary folders")]
fn write(folder: &Path, name: &str, text: &str) -> Result<(), String> {
    fs::write(folder.join(name), text).map_err(|error| format!("cannot write {name}: {error}"))
}

/// A stimulus in the format of a harness: a line for each reaction, the ticks and then the inputs that have a column.
#[must_use]
pub fn lines(net: &Net, stimulus: &Stimulus) -> String {
    let mut text = String::new();
    for row in stimulus.rows() {
        line(net, &row, &mut text);
    }
    text
}

/// Adds one line of [`lines`] to a text.
pub(crate) fn line(net: &Net, row: &InputRow, text: &mut String) {
    // Writing to a string cannot fail.
    let _ = write!(text, "{}", row.dt);
    for (id, _) in net.inputs.iter().filter(|(_, input)| input.kind != InputKind::InternalEvent) {
        let _ = write!(text, " {}", row.value(id));
    }
    text.push('\n');
}
