//! Runs a split: the part on the CPU with the C of the link, the chips with their fuses, wired as the link says.
//!
//! ```text
//! part on the CPU, link   compiled for this computer, or for the CPU and run by simavr or qemu
//!   │ accesses of registers: messages (tools::converse)
//! registers               which pins the CPU drives, and with which levels
//! board                   the connections of the link; each chip fuse by fuse, or as the circuit read back from its text
//! ```
//!
//! Inputs that are wired to chips without the CPU have the opposite levels until the round ends, so a state or a wire that depends on them is found.
//!
//! In lockstep, the chips follow each change of a pin at once, and the CPU's program sees their levels when it reads a pin: delays of the chips and of the
//! synchronisers of the CPU are not simulated. Parts that run on their own have clocks and lines with random speeds: see [`free`].

mod board;
mod free;
mod lines;
mod programs;
mod registers;

use crate::firmware::{BENCH, Bench, Reader, row, too_large_for};
use crate::{Availability, Engine, EngineError, Job, Pace, arm, avr, c, simavr, tools};
use board::Board;
use grafsynth_backend_c::Package;
use grafsynth_backend_c::firmware::{LinkCalls, PORT, linked, shown_steps, stored_bytes};
use grafsynth_driver::split::{self, Linked, RequestedPart, Split};
use grafsynth_driver::stem::FileStem;
use grafsynth_ir::division::{Division, PartNet, Running, Source};
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

    fn pace(&self) -> Pace {
        match self.split.division.running {
            Running::Free => Pace::Events,
            Running::Lockstep if self.linked.chips.iter().any(|chip| chip.tick.is_some()) => {
                Pace::Clocks
            }
            Running::Lockstep => Pace::Rows,
        }
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
        let mut board = Board::new(&self.split, &self.linked).map_err(EngineError::Refused)?;
        let input = InputRow { dt: 0, ..InputRow::zero(job.net) };
        board.supply(job.net, &input, false);
        let cpu = OnCpu {
            net: job.net,
            division: &self.split.division,
            part,
            linked: &self.linked,
            steps: shown_steps(&part.net),
            board,
            registers: Registers::new(self.cpu()),
            sent: Vec::new(),
            asked: Vec::new(),
        };
        if self.split.division.running == Running::Free {
            return free::run(cpu, job, &program);
        }
        let mut run = Run {
            cpu,
            rest: job.stimulus.rows().collect(),
            input,
            trace: Trace::new(TraceLayout::of(job.net)),
        };
        run.rest.reverse();
        program.converse(|message| run.answer(message))?;
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

impl Program {
    /// Runs the program; `answer` answers its messages.
    fn converse(
        &self,
        answer: impl FnMut(tools::Message) -> Result<Option<u32>, String>,
    ) -> Result<(), EngineError> {
        let arguments: Vec<&str> = self.arguments.iter().map(String::as_str).collect();
        tools::converse(&self.file, &arguments, self.bench.path(), LIMIT, answer)
            .map_err(EngineError::Failed)
    }
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

/// The CPU between two messages of its program.
struct OnCpu<'a> {
    net: &'a Net,
    division: &'a Division,
    part: &'a PartNet,
    linked: &'a Linked,
    /// The steps of the part on the CPU in its response.
    steps: Vec<StepId>,
    board: Board<'a>,
    registers: Registers,
    /// The bytes of the next round that the program has not asked for yet, the last first.
    asked: Vec<u8>,
    /// The response to the current round.
    sent: Vec<u8>,
}

/// What a message of the program demands.
enum Demand {
    /// Nothing more than this answer.
    Answer(Option<u32>),
    /// A round has ended, and the program asks for the next one.
    Round,
}

impl OnCpu<'_> {
    /// The effect of a message on the registers and the board.
    fn demand(&mut self, message: tools::Message) -> Result<Demand, String> {
        Ok(match message.kind {
            programs::WRITE => {
                self.registers.write(message.at, message.value, &mut self.board);
                Demand::Answer(None)
            }
            programs::READ => {
                Demand::Answer(Some(self.registers.read(message.at, &mut self.board)))
            }
            programs::PUT => {
                self.sent.extend(message.value.to_le_bytes().first());
                Demand::Answer(None)
            }
            programs::GET if self.asked.is_empty() => Demand::Round,
            programs::GET => Demand::Answer(self.asked.pop().map(u32::from)),
            _ => return Err("the program sent an unknown message".to_owned()),
        })
    }

    /// The row of the part on the CPU after a round; `None` if the response is malformed.
    fn row(&mut self) -> Option<Row> {
        let sent = std::mem::take(&mut self.sent);
        let mut reader = Reader { bytes: &sent };
        let own = row(&self.part.net, &self.steps, &InputRow::zero(&self.part.net), &mut reader)?;
        reader.bytes.is_empty().then_some(own)
    }

    /// Lets the program end, or make a round with these inputs.
    fn ask(&mut self, input: Option<&InputRow>) -> Option<u32> {
        let Some(input) = input else { return Some(0) };
        self.asked.extend(input.dt.to_le_bytes());
        let members = self.linked.calls.members.iter().map(|(id, _)| *id);
        let conditions = self.part.inputs.iter().filter_map(|(id, source)| match source {
            Source::Input(old) if self.part.net.inputs[id].kind == InputKind::Extern => Some(*old),
            Source::Input(_) | Source::Direct(_) | Source::Wire(_) | Source::More => None,
        });
        for id in members.chain(conditions) {
            let bytes = input.value(id).to_le_bytes();
            self.asked.extend(bytes.iter().take(stored_bytes(self.net.inputs[id].ty)));
        }
        self.asked.reverse();
        Some(1)
    }
}

/// A run in lockstep.
struct Run<'a> {
    cpu: OnCpu<'a>,
    /// The rows that were not sent yet, the last first.
    rest: Vec<InputRow>,
    /// The inputs of the current round.
    input: InputRow,
    trace: Trace,
}

impl Run<'_> {
    fn answer(&mut self, message: tools::Message) -> Result<Option<u32>, String> {
        let answer = match self.cpu.demand(message)? {
            Demand::Answer(answer) => answer,
            Demand::Round => self.end_of_round()?,
        };
        match self.cpu.board.trouble() {
            Some(why) => Err(format!("row {}: {why}", self.trace.rows.len())),
            None => Ok(answer),
        }
    }

    /// The row of the round that has ended, and the next one.
    fn end_of_round(&mut self) -> Result<Option<u32>, String> {
        let cpu = &mut self.cpu;
        cpu.board.supply(cpu.net, &self.input, false);
        let nets: Vec<&Net> = cpu.division.parts.iter().map(|part| &*part.net).collect();
        let mut rows: Vec<Row> = cpu.board.rows(&nets, &self.input);
        match cpu.row() {
            Some(own) => rows.push(own),
            None => {
                return Err(format!("the response to row {} is malformed", self.trace.rows.len()));
            }
        }
        let row = joined_row(cpu.net, cpu.division, &rows, &self.input);
        let cells = self.trace.layout.row(&row);
        self.trace.push(cells);
        let next = self.rest.pop();
        let answer = cpu.ask(next.as_ref());
        if let Some(input) = next {
            // What has an effect during the round has been latched, so these inputs may have any level until the round ends.
            cpu.board.supply(cpu.net, &input, true);
            self.input = input;
        }
        Ok(answer)
    }
}
