//! The common part of the engines on microcontrollers. The emitted C and a bench are cross-compiled, the machine is simulated instruction by instruction,
//! and bytes are transferred in both directions (`grafsynth_backend_c::firmware` defines the format).
//!
//! The machines: [`crate::avr`], [`crate::arm`], [`crate::c8051`].

use crate::scratch::Scratch;
use crate::{Engine, EngineError, Job, c::LIMIT, tools};
use grafsynth_backend_c::firmware::{PORT, firmware, renamed, shown_steps, stored_bytes};
use grafsynth_backend_c::{Options, codes};
use grafsynth_ir::Diagnostic;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Driver, InputKind, Net, StepId, VarOrigin};
use grafsynth_sim::{Effect, InputRow, Row, Stimulus, Trace, TraceLayout};
use std::fs;
use std::path::Path;

/// The file with the stimulus, in the folder of a run.
pub(crate) const STIMULUS: &str = "stimulus.bin";
/// The file with the answer.
pub(crate) const ANSWER: &str = "answer.bin";
/// The bench's source.
pub(crate) const BENCH: &str = "bench_main.c";

/// The folder of a run: the package, the bench with its port, and the stimulus.
pub(crate) struct Bench {
    folder: Scratch,
    /// The chart's sources, without a folder: one file, and with an engine also its tables and the engine.
    pub(crate) sources: Vec<String>,
    /// The prefix of the global names of each chart.
    pub(crate) prefixes: Vec<String>,
}

/// The stem of the files of a bench's chart: the user's stem could equal that of a file of the bench, or contain letters that a tool for a
/// microcontroller rejects.
pub(crate) fn stem(at: usize) -> String {
    format!("n{at}")
}

/// One of the charts in a firmware.
#[derive(Debug, Clone)]
pub struct Piece<'a> {
    /// The chart and its stimulus.
    pub job: Job<'a>,
    /// The options of its emitted C.
    pub options: Options,
}

/// A microcontroller. It runs several charts in one firmware, which saves most of the time of compilers and simulators.
pub trait Machine: Engine {
    /// The traces of these charts, in order.
    ///
    /// # Errors
    /// See [`EngineError`]; a rejected chart may fit in a firmware with fewer other charts.
    fn run_all(&self, pieces: &[Piece<'_>]) -> Result<Vec<Trace>, EngineError>;

    /// The trace of one chart, as returned by [`Engine::run`].
    ///
    /// # Errors
    /// See [`EngineError`].
    fn run_one(&self, job: &Job<'_>, options: &Options) -> Result<Trace, EngineError> {
        let traces = self.run_all(&[Piece { job: *job, options: options.clone() }])?;
        traces
            .into_iter()
            .next()
            .ok_or_else(|| EngineError::Failed("the machine returned no trace".to_owned()))
    }
}

impl Bench {
    /// Writes all files that a compiler and a machine need. Several charts are called `n0`, `n1` and so on.
    pub(crate) fn new(pieces: &[Piece<'_>], port: &str) -> Result<Self, EngineError> {
        let mut bench = Bench { folder: scratch()?, sources: Vec::new(), prefixes: Vec::new() };
        let mut packages = Vec::new();
        for (at, piece) in pieces.iter().enumerate() {
            let mut options = Options { stem: Some(stem(at)), ..piece.options.clone() };
            if pieces.len() > 1 {
                options.prefix = Some(format!("n{at}"));
            }
            let package = grafsynth_backend_c::emit(piece.job.net, piece.job.facts, &options)
                .map_err(EngineError::Refused)?;
            bench.prefixes.push(package.prefix().to_owned());
            packages.push(package);
        }
        for (piece, package) in pieces.iter().zip(&packages) {
            for file in package.files.iter().filter(|file| !file.keep_existing) {
                let is_source = file.name.ends_with(".c");
                if is_source && pieces.len() > 1 && !file.name.starts_with("grafsynth_") {
                    let text = renamed(piece.job.net, package, &file.text);
                    bench.write(&file.name, text.as_bytes())?;
                } else {
                    bench.write(&file.name, file.text.as_bytes())?;
                }
                // All charts share one engine text.
                if is_source && !bench.sources.contains(&file.name) {
                    bench.sources.push(file.name.clone());
                }
            }
        }
        let pairs: Vec<_> = pieces.iter().map(|piece| piece.job.net).zip(&packages).collect();
        bench.write(BENCH, firmware(&pairs).as_bytes())?;
        bench.write(PORT, port.as_bytes())?;
        let stimuli: Vec<u8> = pieces
            .iter()
            .flat_map(|piece| stimulus_bytes(piece.job.net, piece.job.stimulus))
            .collect();
        bench.write(STIMULUS, &stimuli)?;
        Ok(bench)
    }

    /// A folder with these files; those that end in `.c` are the sources.
    pub(crate) fn of_files<'f>(
        files: impl IntoIterator<Item = (&'f str, &'f str)>,
    ) -> Result<Self, EngineError> {
        let mut bench = Bench { folder: scratch()?, sources: Vec::new(), prefixes: Vec::new() };
        for (name, text) in files {
            bench.write(name, text.as_bytes())?;
            if name.ends_with(".c") {
                bench.sources.push(name.to_owned());
            }
        }
        Ok(bench)
    }

    pub(crate) fn path(&self) -> &Path {
        self.folder.path()
    }

    #[expect(clippy::disallowed_methods, reason = "engines work in temporary folders")]
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<(), EngineError> {
        fs::write(self.path().join(name), bytes)
            .map_err(|error| EngineError::Failed(format!("cannot write {name}: {error}")))
    }

    /// A text file that a tool wrote in the folder.
    #[expect(clippy::disallowed_methods, reason = "engines work in temporary folders")]
    pub(crate) fn read(&self, name: &str) -> Result<String, EngineError> {
        fs::read_to_string(self.path().join(name))
            .map_err(|error| EngineError::Failed(format!("cannot read {name}: {error}")))
    }

    #[expect(clippy::disallowed_methods, reason = "engines work in temporary folders")]
    pub(crate) fn answer(&self) -> Result<Vec<u8>, EngineError> {
        fs::read(self.path().join(ANSWER))
            .map_err(|error| EngineError::Failed(format!("the machine gave no answer: {error}")))
    }

    /// Runs a compiler or linker of this machine. A program that is too large for its memories is rejected; any other failure is an error
    /// of grafsynth.
    pub(crate) fn compile(
        &self,
        names: &[&str],
        arguments: &[&str],
        machine: &str,
    ) -> Result<tools::Finished, EngineError> {
        let finished = self.start(names, arguments)?;
        if finished.is_success {
            return Ok(finished);
        }
        let said = format!("{}{}", finished.stderr, String::from_utf8_lossy(&finished.stdout));
        // The messages of gcc, and of the linkers of binutils and sdcc, for a program that is too large.
        let too_large = [
            "will not fit in region",
            "is too large",
            "is not within region",
            "overflowed by",
            "Insufficient",
            "Could not get",
        ]
        .iter()
        .any(|words| said.contains(words));
        Err(if too_large {
            EngineError::Refused(vec![too_large_for(machine)])
        } else {
            EngineError::Failed(format!("{} rejected the emitted text: {}", names[0], said.trim()))
        })
    }

    /// Runs the machine, or one of its helper programs.
    pub(crate) fn start(
        &self,
        names: &[&str],
        arguments: &[&str],
    ) -> Result<tools::Finished, EngineError> {
        self.start_with(names, arguments, b"")
    }

    /// Like [`Bench::start`], with this standard input.
    pub(crate) fn start_with(
        &self,
        names: &[&str],
        arguments: &[&str],
        input: &[u8],
    ) -> Result<tools::Finished, EngineError> {
        let program = tools::find(names)
            .ok_or_else(|| EngineError::Failed(format!("{} is not installed", names[0])))?;
        tools::run(&program, arguments, self.path(), input, LIMIT).map_err(EngineError::Failed)
    }
}

fn scratch() -> Result<Scratch, EngineError> {
    Scratch::new()
        .map_err(|error| EngineError::Failed(format!("cannot create a temporary folder: {error}")))
}

/// Reports that a chart needs more memory than the machine has.
pub(crate) fn too_large_for(machine: &str) -> Diagnostic {
    Diagnostic::error(
        codes::TOO_LARGE,
        format!("the chart does not fit into the memory of {machine}"),
    )
    .help("use an engine with more memory: c-arm (4 MB), or c (this computer)")
}

/// The stimulus in the format of a bench.
pub(crate) fn stimulus_bytes(net: &Net, stimulus: &Stimulus) -> Vec<u8> {
    let mut bytes = Vec::new();
    for row in stimulus.rows() {
        bytes.push(1);
        bytes.extend(row.dt.to_le_bytes());
        for (id, input) in net.inputs.iter().filter(|(_, it)| it.kind != InputKind::InternalEvent) {
            let value = row.value(id).to_le_bytes();
            bytes.extend(value.iter().take(stored_bytes(input.ty)));
        }
    }
    bytes.push(0);
    bytes
}

/// The traces in an answer.
pub(crate) fn traces(pieces: &[Piece<'_>], answer: &[u8]) -> Result<Vec<Trace>, EngineError> {
    let mut reader = Reader { bytes: answer };
    let traces: Vec<Trace> = pieces
        .iter()
        .map(|piece| trace(piece.job.net, piece.job.stimulus, &mut reader, answer.len()))
        .collect::<Result<_, _>>()?;
    if reader.bytes.is_empty() {
        Ok(traces)
    } else {
        Err(EngineError::Failed("the machine returned more data than expected".to_owned()))
    }
}

/// The rows of one chart.
fn trace(
    net: &Net,
    stimulus: &Stimulus,
    reader: &mut Reader<'_>,
    n_bytes: usize,
) -> Result<Trace, EngineError> {
    let mut trace = Trace::new(TraceLayout::of(net));
    let steps = shown_steps(net);
    let first = InputRow { dt: 0, ..InputRow::zero(net) };
    for (at, input) in std::iter::once(first).chain(stimulus.rows()).enumerate() {
        let Some(row) = row(net, &steps, &input, reader) else {
            return Err(EngineError::Failed(format!(
                "the machine returned {at} of {} rows, {n_bytes} bytes in total",
                stimulus.len() + 1,
            )));
        };
        let cells = trace.layout.row(&row);
        trace.push(cells);
    }
    Ok(trace)
}

pub(crate) struct Reader<'a> {
    pub(crate) bytes: &'a [u8],
}

impl Reader<'_> {
    fn take(&mut self, n: usize) -> Option<u64> {
        let (head, tail) = self.bytes.split_at_checked(n)?;
        self.bytes = tail;
        Some(head.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte)))
    }

    fn value(&mut self, ty: Type) -> Option<i64> {
        let n = stored_bytes(ty);
        let raw = self.take(n)?;
        let shift = 64 - 8 * n;
        // A type with negative values is stored as a signed type.
        Some(if ty.bounds().0 < 0 {
            (raw << shift).cast_signed() >> shift
        } else {
            raw.cast_signed()
        })
    }
}

/// One row; `None` if bytes are missing or refer to an action that does not exist.
pub(crate) fn row(
    net: &Net,
    steps: &[StepId],
    input: &InputRow,
    reader: &mut Reader<'_>,
) -> Option<Row> {
    let mut row = Row::zero(net);
    row.dt = input.dt;
    row.inputs.clone_from(&input.values);
    loop {
        let number = usize::try_from(reader.take(2)?).ok()?;
        let Some(index) = number.checked_sub(1) else { break };
        let (id, output) = net.outputs.iter().nth(index)?;
        let Driver::Extern { params, .. } = &output.driver else { return None };
        let arguments = params.iter().map(|it| reader.value(it.ty)).collect::<Option<_>>()?;
        // The cell of an action without arguments is the number of its calls.
        row.outputs[index] += 1;
        row.effects.push(Effect::Call(id, arguments));
    }
    for eight in steps.chunks(8) {
        let bits = reader.take(1)?;
        row.steps.extend(
            eight.iter().enumerate().filter(|(bit, _)| bits >> bit & 1 == 1).map(|(_, step)| *step),
        );
    }
    for (id, output) in net.outputs.iter() {
        if !output.is_extern() {
            row.outputs[id.index()] = reader.value(output.ty)?;
        }
    }
    let mut place = 0;
    for var in net.vars.values() {
        for _ in 0..var.len.unwrap_or(1) {
            if var.origin == VarOrigin::Declared {
                row.vars[place] = reader.value(var.ty)?;
            }
            place += 1;
        }
    }
    row.fault = reader.take(1)? != 0;
    Some(row)
}
