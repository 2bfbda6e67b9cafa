//! Runs a split: the part on the CPU with the C of the link, the chips with their fuses, wired as the link says.
//!
//! ```text
//! part on the CPU, link   compiled for this computer, or for the CPU and run by simavr or qemu
//!   │ accesses of registers: messages (tools::converse)
//! registers               which pins the CPU drives, and with which levels
//! board                   the connections of the link; each chip fuse by fuse, or as the circuit read back from its text
//! ```
//!
//! Inputs that are wired to chips alone have the opposite levels until the round ends, so a state or a wire that depends on them is found.
//!
//! The chips follow each change of a pin at once, and the CPU's program sees their levels when it reads a pin: delays of the chips and of the synchronisers of the
//! CPU are not simulated.

mod board;
mod programs;
mod registers;

use crate::firmware::{BENCH, Bench, Reader, row, too_large_for};
use crate::{Availability, Engine, EngineError, Job, arm, avr, c, simavr, tools};
use board::Board;
use grafsynth_backend_c::Package;
use grafsynth_backend_c::firmware::{LinkCalls, PORT, linked, shown_steps, stored_bytes};
use grafsynth_driver::split::{self, Linked, RequestedPart, Split};
use grafsynth_driver::stem::FileStem;
use grafsynth_ir::division::{Division, PartNet, Source};
use grafsynth_ir::net::{InputKind, Net, StepId};
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_sim::{InputRow, Row, Trace, TraceLayout, joined_row};
use grafsynth_split::cpu::{Cpu, Family};
use registers::Registers;
use std::path::PathBuf;
use std::time::Duration;

/// The time limit of a run; each access of a pin takes some microseconds.
const LIMIT: Duration = Duration::from_secs(1800);

/// What runs the part on the CPU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OfCpu {
    /// This computer: its pins are functions.
    Host,
    /// The simulated CPU itself, with the registers of its ports.
    Simulated,
}

impl OfCpu {
    /// All of them.
    pub const ALL: [OfCpu; 2] = [OfCpu::Host, OfCpu::Simulated];

    /// The engine with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<OfCpu> {
        OfCpu::ALL.into_iter().find(|it| it.name() == name)
    }

    /// The name of the engine.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            OfCpu::Host => "split",
            OfCpu::Simulated => "split-mcu",
        }
    }

    /// A short description.
    #[must_use]
    pub fn about(self) -> &'static str {
        match self {
            OfCpu::Host => {
                "the parts of a partition file with their link, the CPU on this computer"
            }
            OfCpu::Simulated => "the same with the CPU and its ports simulated (simavr, qemu)",
        }
    }
}

/// A split as an engine. Its job must have the net that was split.
#[derive(Debug)]
pub struct SplitEngine {
    split: Split,
    linked: Linked,
    of_cpu: OfCpu,
}

impl SplitEngine {
    /// The engine `split`, or `split-mcu` with the simulated CPU.
    ///
    /// # Errors
    /// There is no link: see [`split::link`].
    pub fn new(
        net: &Net,
        split: Split,
        parts: &[RequestedPart],
        stem: &FileStem,
        of_cpu: OfCpu,
    ) -> Result<Self, Vec<Diagnostic>> {
        let link = match of_cpu {
            OfCpu::Host => split::link_on_host,
            OfCpu::Simulated => split::link,
        };
        let linked = link(net, &split, parts, stem)?;
        Ok(SplitEngine { split, linked, of_cpu })
    }

    fn cpu(&self) -> &'static Cpu {
        self.linked.cpu
    }
}

impl Engine for SplitEngine {
    fn name(&self) -> &'static str {
        self.of_cpu.name()
    }

    fn about(&self) -> &'static str {
        self.of_cpu.about()
    }

    fn by_default(&self) -> bool {
        false
    }

    fn availability(&self) -> Availability {
        let missing = |name: &str| Availability::Missing(name.to_owned());
        let tools: &[&str] = match self.cpu().family {
            Family::Avr => &["avr-gcc"],
            Family::Stm32f1 => &["arm-none-eabi-gcc", "qemu-system-arm"],
            Family::Host => &[],
            Family::Mcs51 => return missing("a simulator of the ports of an 8051"),
        };
        if let Some(tool) = tools.iter().find(|tool| tools::find(&[tool]).is_none()) {
            missing(tool)
        } else if self.cpu().family == Family::Avr && !simavr::is_here() {
            missing(simavr::LIBRARY)
        } else if self.cpu().family != Family::Stm32f1 && tools::c_compiler().is_none() {
            missing("a C compiler")
        } else {
            Availability::Here
        }
    }

    fn is_chip(&self) -> bool {
        self.linked.chips.iter().any(|chip| chip.tick.is_some())
    }

    fn runs_c(&self) -> bool {
        true
    }

    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError> {
        let (Some(part), Some(built)) = (self.split.division.parts.last(), self.split.parts.last())
        else {
            return Err(EngineError::Failed("the split has no parts".to_owned()));
        };
        let Some(package) = built.built.packages.first() else {
            return Err(EngineError::Failed("the part on the CPU was not built".to_owned()));
        };
        let program = self.program(job.net, &part.net, package)?;
        let board = Board::new(&self.split, &self.linked).map_err(EngineError::Refused)?;
        let mut run = Run {
            net: job.net,
            division: &self.split.division,
            part,
            linked: &self.linked,
            steps: shown_steps(&part.net),
            board,
            registers: Registers::new(self.cpu()),
            rest: job.stimulus.rows().collect(),
            input: InputRow { dt: 0, ..InputRow::zero(job.net) },
            sent: Vec::new(),
            asked: Vec::new(),
            trace: Trace::new(TraceLayout::of(job.net)),
        };
        run.rest.reverse();
        run.board.supply(job.net, &run.input, false);
        let arguments: Vec<&str> = program.arguments.iter().map(String::as_str).collect();
        tools::converse(&program.file, &arguments, program.bench.path(), LIMIT, |message| {
            run.answer(message)
        })
        .map_err(EngineError::Failed)?;
        Ok(run.trace)
    }
}

/// What is started.
struct Program {
    bench: Bench,
    file: PathBuf,
    arguments: Vec<String>,
    /// Keeps the folder of a program around the machine.
    _host: Option<c::Program>,
}

impl SplitEngine {
    /// Compiles the part on the CPU, its link and a bench.
    fn program(
        &self,
        net: &Net,
        part: &Valid<Net>,
        package: &Package,
    ) -> Result<Program, EngineError> {
        let Linked { name, calls, files, .. } = &self.linked;
        let member = |(id, name): &(_, String)| (name.clone(), net.inputs[*id].ty);
        let calls = LinkCalls {
            name: name.clone(),
            members: calls.members.iter().map(member).collect(),
            dt: calls.dt.clone(),
        };
        let main = linked(part, package, &calls);
        let port = programs::port(self.cpu().family, name);
        let of_package = package.files.iter().filter(|file| !file.keep_existing);
        let of_package = of_package.map(|file| (file.name.as_str(), file.text.as_str()));
        let is_c = |name: &str| name.ends_with(".c") || name.ends_with(".h");
        let of_link = files.iter().filter(|file| is_c(&file.name));
        let of_link = of_link.map(|file| (file.name.as_str(), file.text.as_str()));
        let bench = Bench::of_files(
            of_package.chain(of_link).chain([(BENCH, main.as_str()), (PORT, port.as_str())]),
        )?;
        match self.cpu().family {
            Family::Avr => self.for_simavr(bench),
            Family::Stm32f1 => self.for_qemu(bench),
            Family::Host | Family::Mcs51 => host(bench),
        }
    }

    fn for_simavr(&self, bench: Bench) -> Result<Program, EngineError> {
        let cpu = self.cpu();
        let machine = format!("-mmcu={}", cpu.name);
        let mut arguments =
            vec![machine.as_str(), "-std=gnu99", "-Os", "-Wl,--gc-sections", "-o", "chart.elf"];
        arguments.extend(bench.sources.iter().map(String::as_str));
        bench.compile(&["avr-gcc"], &arguments, cpu.name)?;
        let sizes = bench.start(&["avr-size"], &["chart.elf"])?;
        if avr::ram(&sizes.stdout).is_none_or(|bytes| bytes >= cpu.ram as usize) {
            return Err(EngineError::Refused(vec![too_large_for(cpu.name)]));
        }
        let host = c::compile_with(programs::SIMAVR, &["-O2"], &["-lsimavr", "-lelf"])
            .map_err(EngineError::Failed)?;
        let mut arguments =
            vec![cpu.name.to_owned(), "chart.elf".to_owned(), cpu.clock_hz.to_string()];
        // GPIOR0 and GPIOR1, and PIN of each port: iom328p.h and iotn85.h of avr-libc.
        let addresses: &[&str] = match cpu.name {
            "attiny85" => &["31", "32", "B36"],
            _ => &["3e", "4a", "B23", "C26", "D29"],
        };
        arguments.extend(addresses.iter().map(|address| (*address).to_owned()));
        Ok(Program { bench, file: host.path.clone(), arguments, _host: Some(host) })
    }

    fn for_qemu(&self, bench: Bench) -> Result<Program, EngineError> {
        bench.write("start.c", arm::START.as_bytes())?;
        bench.write("link.ld", arm::LINK.as_bytes())?;
        bench.write("accesses.h", programs::accesses(&self.linked.name).as_bytes())?;
        let mut arguments = vec![
            "-mcpu=cortex-m3",
            "-mthumb",
            "-std=c99",
            "-Os",
            "-nostartfiles",
            "-T",
            "link.ld",
            "-include",
            "accesses.h",
            "-o",
            "chart.elf",
            "start.c",
        ];
        arguments.extend(bench.sources.iter().map(String::as_str));
        bench.compile(&["arm-none-eabi-gcc"], &arguments, "a Cortex-M3 with 4 MB")?;
        let file = tools::find(&["qemu-system-arm"])
            .ok_or_else(|| EngineError::Failed("qemu-system-arm is not installed".to_owned()))?;
        let arguments = arm::QEMU.map(str::to_owned).to_vec();
        Ok(Program { bench, file, arguments, _host: None })
    }
}

fn host(bench: Bench) -> Result<Program, EngineError> {
    let compiler = tools::c_compiler()
        .ok_or_else(|| EngineError::Failed("a C compiler is not installed".to_owned()))?;
    let mut arguments = vec!["-std=c99", "-O1", "-o", "chart"];
    arguments.extend(bench.sources.iter().map(String::as_str));
    let made = tools::run(&compiler, &arguments, bench.path(), b"", c::LIMIT)
        .map_err(EngineError::Failed)?;
    if !made.is_success {
        let why = made.stderr.trim();
        return Err(EngineError::Failed(format!("the C compiler rejected the split: {why}")));
    }
    let file = bench.path().join("chart");
    Ok(Program { bench, file, arguments: Vec::new(), _host: None })
}

/// A run between two messages.
struct Run<'a> {
    net: &'a Net,
    division: &'a Division,
    part: &'a PartNet,
    linked: &'a Linked,
    /// The steps of the part on the CPU in its response.
    steps: Vec<StepId>,
    board: Board<'a>,
    registers: Registers,
    /// The rows that were not sent yet, the last first.
    rest: Vec<InputRow>,
    /// The inputs of the current round.
    input: InputRow,
    /// The bytes of the next round that the program has not asked for yet, the last first.
    asked: Vec<u8>,
    /// The response to the current round.
    sent: Vec<u8>,
    trace: Trace,
}

impl Run<'_> {
    fn answer(&mut self, message: tools::Message) -> Result<Option<u32>, String> {
        let answer = match message.kind {
            programs::WRITE => {
                self.registers.write(message.at, message.value, &mut self.board);
                None
            }
            programs::READ => Some(self.registers.read(message.at, &mut self.board)),
            programs::PUT => {
                self.sent.extend(message.value.to_le_bytes().first());
                None
            }
            programs::GET => {
                if self.asked.is_empty() {
                    self.end_of_round()?;
                }
                self.asked.pop().map(u32::from)
            }
            _ => return Err("the program sent an unknown message".to_owned()),
        };
        match self.board.trouble() {
            Some(why) => Err(format!("row {}: {why}", self.trace.rows.len())),
            None => Ok(answer),
        }
    }

    /// The row of the round that has ended, and the bytes of the next one.
    fn end_of_round(&mut self) -> Result<(), String> {
        self.board.supply(self.net, &self.input, false);
        let nets: Vec<&Net> = self.division.parts.iter().map(|part| &*part.net).collect();
        let mut rows: Vec<Row> = self.board.rows(&nets, &self.input);
        let mut reader = Reader { bytes: &self.sent };
        let own = row(&self.part.net, &self.steps, &InputRow::zero(&self.part.net), &mut reader);
        match own {
            Some(own) if reader.bytes.is_empty() => rows.push(own),
            _ => return Err(format!("the response to row {} is malformed", self.trace.rows.len())),
        }
        let row = joined_row(self.net, self.division, &rows, &self.input);
        let cells = self.trace.layout.row(&row);
        self.trace.push(cells);
        self.sent.clear();
        let Some(input) = self.rest.pop() else {
            self.asked.push(0);
            return Ok(());
        };
        self.asked.push(1);
        self.asked.extend(input.dt.to_le_bytes());
        let members = self.linked.calls.members.iter().map(|(id, _)| *id);
        let conditions = self.part.inputs.iter().filter_map(|(id, source)| match source {
            Source::Input(old) if self.part.net.inputs[id].kind == InputKind::Extern => Some(*old),
            Source::Input(_) | Source::Wire(_) => None,
        });
        for id in members.chain(conditions) {
            let bytes = input.value(id).to_le_bytes();
            self.asked.extend(bytes.iter().take(stored_bytes(self.net.inputs[id].ty)));
        }
        self.asked.reverse();
        // What has an effect during the round has been latched, so these inputs may have any level until the round ends.
        self.board.supply(self.net, &input, true);
        self.input = input;
        Ok(())
    }
}
