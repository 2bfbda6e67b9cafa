//! Runs the emitted C on an 8051: sdcc, and the simulator s51 of ucsim.
//!
//! sdcc is the strictest of the compilers: 16-bit `int`, its own library (without 64-bit multiplication and division), and parameters at fixed addresses,
//! so functions are not re-entrant. Bytes are transferred by ucsim's *simulator interface*, one address of the external RAM: write `r` and read the next
//! byte of a file, write `w` and then a byte, write `s` to stop.
//!
//! The stack shares 256 bytes with the data that the linker places below it, and the machine does not detect an overflow: the pointer wraps to 0, and the
//! chart continues with wrong numbers. s51 itself stops at a call or a push that does this. A function that keeps its variables on the stack moves the
//! pointer directly; for this case a breakpoint checks that the pointer is never below the start of the stack.

use crate::firmware::{ANSWER, BENCH, Bench, Machine, Piece, STIMULUS, traces};
use crate::{Availability, Engine, EngineError, Job, tools};
use grafsynth_backend_c::{Options, codes};
use grafsynth_ir::Diagnostic;
use grafsynth_sim::Trace;

/// An 8052 with 64 KB each of code and of external RAM.
#[derive(Debug, Clone, Default)]
pub struct C8051Engine {
    /// The style of the emitted C.
    pub options: Options,
}

/// The bench's interface to the host.
const PORT: &str = "#ifndef BENCH_PORT_H
#define BENCH_PORT_H

#include <stdint.h>

static volatile __xdata uint8_t __at(0xffff) bench_door;

static void bench_begin(void)
{
}

static uint8_t bench_get(void)
{
    bench_door = 'r';
    return bench_door;
}

static void bench_put(uint8_t value)
{
    bench_door = 'w';
    bench_door = value;
}

static void bench_end(void)
{
    bench_door = 's';
    for (;;) {
    }
}

#endif
";

/// Options for sdcc. The linker leaves the last 256 bytes of the external RAM free, because byte 0xffff is the simulator interface.
const FLAGS: [&str; 9] = [
    "-mmcs51",
    "--model-large",
    "--std-sdcc99",
    "--nogcse",
    "--noinvariant",
    "--code-size",
    "65536",
    "--xram-size",
    "65280",
];

impl Engine for C8051Engine {
    fn name(&self) -> &'static str {
        "c-8051"
    }

    fn about(&self) -> &'static str {
        "the C text on an 8051 (sdcc, s51)"
    }

    fn by_default(&self) -> bool {
        false
    }

    fn runs_c(&self) -> bool {
        true
    }

    fn availability(&self) -> Availability {
        if tools::find(&["sdcc"]).is_none() {
            Availability::Missing("sdcc".to_owned())
        } else if tools::find(&SIMULATOR).is_none() {
            Availability::Missing("s51 (Debian: sdcc-ucsim)".to_owned())
        } else {
            Availability::Here
        }
    }

    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError> {
        self.run_one(job, &self.options)
    }
}

impl Machine for C8051Engine {
    fn run_all(&self, pieces: &[Piece<'_>]) -> Result<Vec<Trace>, EngineError> {
        let bench = Bench::new(pieces, PORT)?;
        bench.build_8051()?;
        bench.run_8051()?;
        traces(pieces, &bench.answer()?)
    }
}

const MACHINE: &str = "an 8052 with 64 KB";

impl Bench {
    fn build_8051(&self) -> Result<(), EngineError> {
        let sources = || std::iter::once(BENCH).chain(self.sources.iter().map(String::as_str));
        for source in sources() {
            let mut arguments = FLAGS.to_vec();
            arguments.extend(["-c", source]);
            self.compile(&["sdcc"], &arguments, MACHINE)?;
        }
        let objects: Vec<String> = sources().map(|it| it.replace(".c", ".rel")).collect();
        let mut arguments = FLAGS.to_vec();
        arguments.extend(["-o", "chart.ihx"]);
        arguments.extend(objects.iter().map(String::as_str));
        let linked = self.compile(&["sdcc"], &arguments, MACHINE)?;
        // sdcc's linker only warns about a function that its library does not have.
        if linked.stderr.contains("Undefined Global") {
            return Err(EngineError::Failed(format!("sdcc: {}", linked.stderr.trim())));
        }
        Ok(())
    }

    fn run_8051(&self) -> Result<(), EngineError> {
        let (main, stack) = (self.address("_main")?, self.address("__start__stack")?);
        if self.largest_frame()? >= stack {
            return Err(EngineError::Refused(vec![too_deep(stack)]));
        }
        let door = format!("if=xram[0xffff],in={STIMULUS},out={ANSWER}");
        let arguments = ["-t", "C52", "-I", &door, "chart.ihx"];
        let run = self.start_with(&SIMULATOR, &arguments, commands(main, stack).as_bytes())?;
        let said = String::from_utf8_lossy(&run.stdout);
        if said.contains("Stack overflow") || said.contains("Event break") {
            return Err(EngineError::Refused(vec![too_deep(stack)]));
        }
        if run.is_success {
            Ok(())
        } else {
            let why = format!("s51 ended with {} {}", run.ending, said.trim());
            Err(EngineError::Failed(why))
        }
    }

    /// The maximum number of bytes that a function of the chart puts on the stack at once, from the assembler output of sdcc: `add a,#0x30`, then
    /// `mov sp,a`. Addends above 127 are negative and remove bytes. Single pushes are not considered here, because s51 checks them.
    fn largest_frame(&self) -> Result<u32, EngineError> {
        let mut largest = 0;
        for source in std::iter::once(BENCH).chain(self.sources.iter().map(String::as_str)) {
            let text = self.read(&source.replace(".c", ".asm"))?;
            for (first, second) in text.lines().zip(text.lines().skip(1)) {
                let (first, second) = (first.trim(), second.trim());
                if let Some(bytes) = first.strip_prefix("add\ta,#0x")
                    && second == "mov\tsp,a"
                    && let Ok(bytes @ ..=127) = u32::from_str_radix(bytes, 16)
                {
                    largest = largest.max(bytes);
                }
            }
        }
        Ok(largest)
    }

    /// The address of a name, from the linker's map: `C:   00000BB1  _main   bench_main`, or without the letter in internal RAM.
    fn address(&self, name: &str) -> Result<u32, EngineError> {
        let map = self.read("chart.map")?;
        let found = map.lines().find_map(|line| {
            let words: Vec<&str> = line.split_whitespace().collect();
            let at = words.iter().position(|it| *it == name)?;
            u32::from_str_radix(words.get(at.checked_sub(1)?)?, 16).ok()
        });
        found.ok_or_else(|| EngineError::Failed(format!("the linker's map has no {name}")))
    }
}

/// The console input for s51. It runs to `main`, because the stack pointer is not set before that, and then checks the pointer. (`-G` would start the machine
/// too, but then the end of the console's input stops it wherever it is.)
///
/// A pointer that overflows by less than `stack` is below `stack`; it cannot overflow by more if no function uses more at once
/// ([`Bench::largest_frame`]).
fn commands(main: u32, stack: u32) -> String {
    // The pointer is at the last used byte, so in `main` it is one below the first byte of the stack.
    let lowest = stack.saturating_sub(1);
    format!("run 0 {main:#06x}\nbreak sfr w 0x81 1 if \"sfr[0x81]<{lowest:#04x}\"\nrun\nquit\n")
}

/// Reports that the chart's calls need too much stack.
fn too_deep(stack: u32) -> Diagnostic {
    let left = 256_u32.saturating_sub(stack);
    Diagnostic::error(
        codes::TOO_LARGE,
        format!("the chart's functions need more stack than the {left} bytes that {MACHINE} has available"),
    )
    .help("use a style without an engine, which needs less (c-8051:switch), or an engine with more memory (c-arm)")
}

/// The names of the simulator: newer versions of ucsim use the second.
const SIMULATOR: [&str; 2] = ["s51", "ucsim_51"];

#[cfg(test)]
mod tests {
    use super::*;

    /// The result of a program with these functions, which may use `volatile uint8_t v`; `None` if the tools are missing.
    fn outcome(functions: &str, value: &str) -> Option<Result<u8, EngineError>> {
        let machine = C8051Engine::default();
        if machine.availability() != Availability::Here {
            assert!(
                std::env::var_os("CI").is_none(),
                "sdcc or s51 is missing, and CI must have it"
            );
            return None;
        }
        let bench = Bench::new(&[], PORT).expect("a folder");
        let source = format!(
            "#include \"bench_port.h\"\nvolatile uint8_t v = 1;\n{functions}\nvoid main(void) {{ bench_put({value}); bench_end(); }}\n"
        );
        bench.write(BENCH, source.as_bytes()).expect("a file");
        bench.build_8051().expect("sdcc takes it");
        Some(bench.run_8051().and_then(|()| Ok(bench.answer()?[0])))
    }

    /// A function that calls itself.
    const CALLS: &str =
        "static uint8_t deep(uint8_t n) __reentrant { return n ? deep(n - 1) + v : v; }
        static uint8_t (*volatile f)(uint8_t) __reentrant = deep;";

    /// Functions that keep this many bytes on the stack, the second called by the first, above `data` bytes of data.
    fn frames(data: u8, outer: u8, inner: u8) -> String {
        format!(
            "volatile __data uint8_t below[{data}];
            static uint8_t in(uint8_t n) __reentrant {{
                uint8_t a[{inner}]; uint8_t i; for (i = 0; i < {inner}; i++) {{ a[i] = i ^ v; }} return a[n]; }}
            static uint8_t out(uint8_t n) __reentrant {{
                uint8_t a[{outer}]; uint8_t i; for (i = 0; i < {outer}; i++) {{ a[i] = i ^ v; }} return a[n] + in(n); }}"
        )
    }

    #[test]
    fn a_stack_that_runs_over_is_refused() {
        let is_too_deep = |it: Result<u8, EngineError>| match it {
            Err(EngineError::Refused(found)) => {
                found[0].code.id == "G0604" && found[0].message.contains("stack")
            }
            Err(EngineError::Failed(why)) => panic!("{why}"),
            Ok(_) => false,
        };
        let Some(fits) = outcome(CALLS, "f(20)") else { return };
        assert_eq!(fits.ok(), Some(21));
        let programs = [
            (CALLS.to_owned(), "f(200)", true),
            (frames(60, 50, 50), "out(6) + below[5]", false),
            (frames(100, 90, 60), "out(6) + below[5]", true),
            // The breakpoint cannot detect this overflow: a frame is larger than the address at which the stack begins.
            (frames(10, 90, 60), "out(6) + below[5]", true),
        ];
        for (functions, value, expected) in programs {
            let found = outcome(&functions, value).expect("the machine is here");
            assert_eq!(is_too_deep(found), expected, "{functions}");
        }
    }
}
