//! Measures reactions: the emitted C on a simulated machine, each call of `NAME_step` separately.
//!
//! On an AVR, nothing is added to the program: the host of the simulator knows the addresses of `NAME_init` and `NAME_step`, records time and stack pointer
//! there, and again when the stack is back at its level before the call. On a Cortex-M3, the bench measures itself ([`ArmMeter`]). The time of user functions
//! is excluded, as in the bounds of `grafsynth_backend_c::cost`.

pub mod search;

use crate::firmware::{ANSWER, BENCH, Bench, Piece, STIMULUS, stem, stimulus_bytes};
use crate::{
    ArmEngine, Availability, AvrEngine, Engine as _, EngineError, Job, arm, c, simavr, tools,
};
use grafsynth_backend_c::{Options, Package};
use grafsynth_ir::net::Net;
use grafsynth_sim::Stimulus;

/// The results, in the unit of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Measured {
    /// `NAME_init`, from the call to the return.
    pub init: u64,
    /// The worst call of `NAME_step`.
    pub step: u64,
    /// The maximum stack of either in bytes, including the return address; `None` on a Cortex-M3 if user functions are called, because their stack cannot
    /// be separated.
    pub stack: Option<u64>,
    /// The number of measured reactions.
    pub reactions: u64,
    /// Bytes of code and constant tables of `NAME.c`.
    pub text: u64,
}

/// The cycles of a call instruction: the host first observes the machine after it.
const CALL: u64 = 4;

/// Runs the firmware and prints each call of `NAME_init` (0) and `NAME_step` (1): its time and its stack.
const HOST: &str = r#"int main(int argc, char **argv)
{
    avr_t *avr = argc >= 7 ? machine(argv) : NULL;
    if (avr == NULL) {
        return 2;
    }
    /* Addresses of init and step, then of the user's functions. */
    const int functions = argc - 5;
    avr_flashaddr_t *at = malloc(sizeof *at * (size_t)functions);
    for (int k = 0; k < functions; ++k) {
        at[k] = (avr_flashaddr_t)strtoul(argv[5 + k], NULL, 16);
    }
    int which = -1, is_away = 0;
    unsigned top = 0, away_top = 0, lowest = 0;
    avr_cycle_count_t begin = 0, away_begin = 0, away = 0;
    int state = cpu_Running;
    while (state != cpu_Done && state != cpu_Crashed) {
        const unsigned sp = avr->data[R_SPL] | (unsigned)avr->data[R_SPH] << 8;
        if (which >= 0 && sp > top) {
            printf("%d %llu %u\n", which, (unsigned long long)(avr->cycle - begin - away), top + 2U - lowest);
            which = -1;
        }
        if (which < 0) {
            for (int k = 0; k < 2; ++k) {
                if (avr->pc == at[k]) {
                    which = k;
                    top = lowest = sp;
                    begin = avr->cycle;
                    away = 0;
                }
            }
        } else {
            if (is_away && sp > away_top) {
                is_away = 0;
                away += avr->cycle - away_begin;
            }
            if (!is_away) {
                if (sp < lowest) {
                    lowest = sp;
                }
                for (int k = 2; k < functions; ++k) {
                    if (avr->pc == at[k]) {
                        is_away = 1;
                        away_top = sp;
                        away_begin = avr->cycle;
                    }
                }
            }
        }
        state = avr_run(avr);
    }
    fclose(answer);
    return state == cpu_Done ? 0 : 1;
}
"#;

/// A machine on which reactions can be measured.
pub trait Meter {
    /// Its name in `grafsynth_backend_c::cost::machine`.
    fn machine(&self) -> &'static str;

    /// Compiles the C with these options, ready to run the stimulus of `job` and others.
    ///
    /// # Errors
    /// The errors of an engine: constructs that the back end or the machine does not support, and failures of tools.
    fn prepare(&self, job: &Job<'_>, options: &Options) -> Result<Box<dyn Prepared>, EngineError>;

    /// Measures each reaction of the stimulus of `job`, with the C for these options.
    ///
    /// # Errors
    /// As [`Meter::prepare`].
    fn run(&self, job: &Job<'_>, options: &Options) -> Result<Measured, EngineError> {
        self.prepare(job, options)?.run(job.net, job.stimulus).map(|(measured, _)| measured)
    }
}

/// Compiled C on a machine.
pub trait Prepared {
    /// Measures each reaction of a stimulus, from reset: the total results, and the time of each reaction if the machine can separate them.
    ///
    /// # Errors
    /// The output of the simulator.
    fn run(&self, net: &Net, stimulus: &Stimulus) -> Result<(Measured, Vec<u64>), EngineError>;
}

/// The machines whose tools are installed.
#[must_use]
pub fn meters() -> Vec<Box<dyn Meter>> {
    let mut all: Vec<Box<dyn Meter>> = Vec::new();
    if AvrEngine::default().availability() == Availability::Here {
        all.push(Box::new(AvrMeter::default()));
    }
    if ArmEngine::default().availability() == Availability::Here {
        all.push(Box::new(ArmMeter));
    }
    all
}

/// Measures an ATmega1284P, in cycles.
#[derive(Debug, Default)]
pub struct AvrMeter {
    host: std::sync::OnceLock<Result<c::Program, String>>,
}

impl Meter for AvrMeter {
    fn machine(&self) -> &'static str {
        "avr"
    }

    fn prepare(&self, job: &Job<'_>, options: &Options) -> Result<Box<dyn Prepared>, EngineError> {
        let piece = Piece { job: *job, options: options.clone() };
        let bench = Bench::new(&[piece], crate::avr::PORT)?;
        let source = own_source(&bench)?;
        let object = ["-mmcu=atmega1284p", "-std=gnu99", "-Os", "-c", "-o", "chart.o", source];
        bench.compile(&["avr-gcc"], &object, "an ATmega1284P")?;
        let arguments = [
            "-mmcu=atmega1284p",
            "-std=gnu99",
            "-Os",
            "-Wl,--gc-sections",
            "-o",
            "chart.elf",
            BENCH,
            "chart.o",
        ];
        bench.compile(&["avr-gcc"], &arguments, "an ATmega1284P")?;
        let sections = bench.start(&["avr-size"], &["-A", "chart.o"])?;
        let symbols = bench.start(&["avr-nm"], &["chart.elf"])?;
        let symbols = String::from_utf8_lossy(&symbols.stdout).into_owned();
        let prefix = bench.prefixes.first().map(String::as_str).unwrap_or_default();
        let addresses = addresses(&symbols, prefix).ok_or_else(|| {
            EngineError::Failed(
                "the compiled program does not contain the functions of the chart".to_owned(),
            )
        })?;
        let host = self
            .host
            .get_or_init(|| simavr::host(HOST))
            .as_ref()
            .map_err(|why| EngineError::Failed(why.clone()))?;
        let (host, text) = (host.path.clone(), text_bytes(&sections.stdout));
        Ok(Box::new(OnAvr { bench, host, addresses, text }))
    }
}

/// A chart in an ATmega1284P.
struct OnAvr {
    bench: Bench,
    host: std::path::PathBuf,
    addresses: Vec<String>,
    text: u64,
}

impl Prepared for OnAvr {
    fn run(&self, net: &Net, stimulus: &Stimulus) -> Result<(Measured, Vec<u64>), EngineError> {
        self.bench.write(STIMULUS, &stimulus_bytes(net, stimulus))?;
        let mut arguments = vec!["atmega1284p", "chart.elf", STIMULUS, ANSWER];
        arguments.extend(self.addresses.iter().map(String::as_str));
        let run = tools::run(&self.host, &arguments, self.bench.path(), b"", c::LIMIT)
            .map_err(EngineError::Failed)?;
        if !run.is_success {
            return Err(EngineError::Failed(format!("simavr ended with {}", run.ending)));
        }
        let mut measured = Measured { text: self.text, ..Measured::default() };
        let mut times = Vec::new();
        for line in String::from_utf8_lossy(&run.stdout).lines() {
            let numbers: Vec<u64> = line.split(' ').filter_map(|it| it.parse().ok()).collect();
            let [which, time, stack] = numbers[..] else { continue };
            let time = time + CALL;
            if which == 0 {
                measured.init = measured.init.max(time);
            } else {
                measured.step = measured.step.max(time);
                measured.reactions += 1;
                times.push(time);
            }
            measured.stack = measured.stack.max(Some(stack));
        }
        Ok((measured, times))
    }
}

/// Measures a Cortex-M3, in instructions. Each reaction is repeated many times from the same instance, and measured with the timer of the
/// processor, which counts one for 40 instructions under qemu's `-icount shift=0`. The time of an empty function with the same arguments is
/// subtracted. For the stack, the memory below the stack pointer is filled with a pattern before one more call, and the words that differ
/// afterwards count as used. A word that a function reserves but never writes is not detected. User functions count as empty.
#[derive(Debug, Default)]
pub struct ArmMeter;

/// Bytes below the stack pointer that are filled with a pattern on a Cortex-M3; use beyond them is not detected.
const DEEP: u64 = 32_768;

/// The code that counts the reactions: `NAME_step` becomes a macro in the bench. A macro is not expanded within itself.
fn arm_port(package: &Package) -> String {
    let (stem, prefix) = (package.stem(), package.prefix());
    let (saved, save, restore) = if package.has_instance() {
        (format!("static {prefix}_t bench_saved;"), "bench_saved = self;", "self = bench_saved;")
    } else {
        (String::new(), "", "")
    };
    let count = format!(
        r#"static uint32_t bench_worst;
static uint32_t bench_first;
static uint32_t bench_stack;
__attribute__((noinline)) static void bench_empty() {{ __asm__ volatile("" ::: "memory"); }}
#define BENCH_TIMER (*(volatile uint32_t *)0xE000E018U)
#define BENCH_DEEP {DEEP}U
#define BENCH_COUNT(call, none, into) do {{ \
    {save} \
    const uint32_t begin = BENCH_TIMER; \
    for (uint32_t k = 0U; k < 40U; ++k) {{ {restore} none; __asm__ volatile("" ::: "memory"); }} \
    const uint32_t middle = BENCH_TIMER; \
    for (uint32_t k = 0U; k < 40U; ++k) {{ {restore} call; __asm__ volatile("" ::: "memory"); }} \
    const uint32_t end = BENCH_TIMER; \
    const uint32_t n = ((middle - end) & 0xFFFFFFU) - ((begin - middle) & 0xFFFFFFU) + 2U; \
    if (n > into) {{ into = n; }} \
    {restore} \
    uint32_t top; \
    __asm__ volatile("mov %0, sp" : "=r"(top) : : "memory"); \
    volatile uint32_t *at = (volatile uint32_t *)(top - BENCH_DEEP); \
    while (at != (volatile uint32_t *)top) {{ *at++ = 0xA5A5A5A5U; }} \
    call; \
    at = (volatile uint32_t *)(top - BENCH_DEEP); \
    while ((at != (volatile uint32_t *)top) && (*at == 0xA5A5A5A5U)) {{ ++at; }} \
    if (top - (uint32_t)at > bench_stack) {{ bench_stack = top - (uint32_t)at; }} \
}} while (0)
#define {prefix}_step(...) BENCH_COUNT({prefix}_step(__VA_ARGS__), bench_empty(__VA_ARGS__), bench_worst)
#define {prefix}_init(...) BENCH_COUNT({prefix}_init(__VA_ARGS__), bench_empty(__VA_ARGS__), bench_first)

static void bench_put(uint8_t value) {{ (void)value; }}
static void bench_end(void)
{{
    for (uint32_t k = 0U; k < 4U; ++k) {{
        bench_emit((uint8_t)(bench_first >> (8U * k)));
    }}
    for (uint32_t k = 0U; k < 4U; ++k) {{
        bench_emit((uint8_t)(bench_worst >> (8U * k)));
    }}
    for (uint32_t k = 0U; k < 4U; ++k) {{
        bench_emit((uint8_t)(bench_stack >> (8U * k)));
    }}
"#
    );
    let begin = "static void bench_begin(void)\n{\n    *(volatile uint32_t *)0xE000E014U = 0xFFFFFFU;\n    *(volatile uint32_t *)0xE000E010U = 5U;\n";
    // The chart's header comes first, so that the macro does not change its prototypes.
    let header = format!("#include \"{stem}.h\"\n{saved}\n");
    arm::PORT
        .replace("static void bench_put(uint8_t", "static void bench_emit(uint8_t")
        .replace("static void bench_begin(void)\n{\n", begin)
        .replace("static void bench_end(void)\n{\n", &format!("{header}{count}"))
}

impl Meter for ArmMeter {
    fn machine(&self) -> &'static str {
        "cortex-m3"
    }

    fn prepare(&self, job: &Job<'_>, options: &Options) -> Result<Box<dyn Prepared>, EngineError> {
        // The emitted C uses the names of the bench.
        let options = &Options { stem: Some(stem(0)), ..options.clone() };
        let package =
            grafsynth_backend_c::emit(job.net, job.facts, options).map_err(EngineError::Refused)?;
        let calls_user = package.files.iter().any(|file| file.name.ends_with("_user.h"));
        let piece = Piece { job: *job, options: options.clone() };
        let bench = Bench::new(&[piece], &arm_port(&package))?;
        let source = own_source(&bench)?;
        bench.write("start.c", arm::START.as_bytes())?;
        bench.write("link.ld", arm::LINK.as_bytes())?;
        let machine = ["-mcpu=cortex-m3", "-mthumb", "-std=gnu99", "-Os"];
        let mut object = machine.to_vec();
        object.extend(["-c", "-o", "chart.o", source]);
        bench.compile(&["arm-none-eabi-gcc"], &object, "a Cortex-M3 with 4 MB")?;
        let mut arguments = machine.to_vec();
        arguments.extend(["-nostartfiles", "-T", "link.ld", "-o", "chart.elf", "start.c", BENCH]);
        arguments.push("chart.o");
        bench.compile(&["arm-none-eabi-gcc"], &arguments, "a Cortex-M3 with 4 MB")?;
        let sections = bench.start(&["arm-none-eabi-size"], &["-A", "chart.o"])?;
        let text = text_bytes(&sections.stdout);
        Ok(Box::new(OnArm { bench, calls_user, text }))
    }
}

/// A chart in a Cortex-M3.
struct OnArm {
    bench: Bench,
    calls_user: bool,
    text: u64,
}

impl Prepared for OnArm {
    fn run(&self, net: &Net, stimulus: &Stimulus) -> Result<(Measured, Vec<u64>), EngineError> {
        self.bench.write(STIMULUS, &stimulus_bytes(net, stimulus))?;
        let machine = ["-M", "mps2-an385", "-display", "none", "-monitor", "none"];
        let mut arguments = machine.to_vec();
        arguments.extend(["-serial", "none", "-icount", "shift=0"]);
        arguments.extend(["-semihosting-config", "enable=on,target=native"]);
        arguments.extend(["-kernel", "chart.elf"]);
        let run = self.bench.start(&["qemu-system-arm"], &arguments)?;
        let answer = self.bench.answer()?;
        let number = |at: usize| {
            let bytes = answer.get(at..at + 4)?;
            Some(bytes.iter().rev().fold(0_u64, |all, byte| all << 8 | u64::from(*byte)))
        };
        match (run.is_success, number(0), number(4), number(8)) {
            (true, _, _, Some(stack)) if stack >= DEEP && !self.calls_user => {
                Err(EngineError::Failed(format!("the chart needs {DEEP} bytes of stack or more")))
            }
            (true, Some(init), Some(step), Some(stack)) => {
                let stack = (!self.calls_user).then_some(stack);
                let reactions = stimulus.len() as u64;
                Ok((Measured { init, step, stack, reactions, text: self.text }, Vec::new()))
            }
            _ => Err(EngineError::Failed(format!("qemu ended with {}", run.ending))),
        }
    }
}

/// The file name of the chart's only source; an error for a style whose engine is in another file.
fn own_source(bench: &Bench) -> Result<&str, EngineError> {
    match &bench.sources[..] {
        [source] => Ok(source),
        _ => Err(EngineError::Failed("the emitted C has more than one source file".to_owned())),
    }
}

/// The addresses of `NAME_init` and `NAME_step`, then of all functions of the bench that the chart may call.
fn addresses(symbols: &str, prefix: &str) -> Option<Vec<String>> {
    let all: Vec<(&str, &str)> = symbols
        .lines()
        .filter_map(|line| {
            let mut words = line.split_whitespace();
            let (address, kind, name) = (words.next()?, words.next()?, words.next()?);
            (kind == "T").then_some((address, name))
        })
        .collect();
    let find = |end: &str| {
        let name = format!("{prefix}_{end}");
        all.iter().find(|(_, it)| *it == name).map(|(address, _)| (*address).to_owned())
    };
    let mut found = vec![find("init")?, find("step").or_else(|| find("react"))?];
    let own = ["init", "step", "react"].map(|end| format!("{prefix}_{end}"));
    let library = ["main", "memcpy", "memcmp", "memset", "exit", "abort"];
    found.extend(
        all.iter()
            .filter(|(_, name)| {
                !name.starts_with('_')
                    && !library.contains(name)
                    && !own.iter().any(|it| it == name)
            })
            .map(|(address, _)| (*address).to_owned()),
    );
    Some(found)
}

/// Bytes of code and constant tables, from the output of `size -A`.
pub(crate) fn text_bytes(printed: &[u8]) -> u64 {
    let mut sum = 0;
    for line in String::from_utf8_lossy(printed).lines() {
        let mut words = line.split_whitespace();
        if let (Some(name), Some(size)) = (words.next(), words.next())
            && [".text", ".rodata", ".progmem"].iter().any(|it| name.starts_with(it))
        {
            sum += size.parse::<u64>().unwrap_or(0);
        }
    }
    sum
}
