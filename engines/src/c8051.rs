//! The emitted C on an 8051: sdcc, and the simulator s51 of ucsim.
//!
//! sdcc is the strictest of the compilers: 16-bit `int`, its own library (without 64-bit multiplication and division), and parameters at fixed addresses, so
//! nothing may be re-entered. Bytes go in and out by ucsim's *simulator interface*, one address of the external RAM: write `r` and read the next
//! byte of a file, write `w` and then a byte, write `s` to stop.

use crate::firmware::{ANSWER, BENCH, Bench, Machine, Piece, STIMULUS, traces};
use crate::{Availability, Engine, EngineError, Job, tools};
use grafsynth_backend_c::Options;
use grafsynth_sim::Trace;

/// An 8052 with 64 KB each of code and of external RAM.
#[derive(Debug, Clone, Default)]
pub struct C8051Engine {
    /// Style of what is emitted.
    pub options: Options,
}

/// The bench's way out of the machine.
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

/// Settings of compiler and linker; the last byte of the external RAM is the door.
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
        let sources = || std::iter::once(BENCH).chain(bench.sources.iter().map(String::as_str));
        for source in sources() {
            let mut arguments = FLAGS.to_vec();
            arguments.extend(["-c", source]);
            bench.compile(&["sdcc"], &arguments, MACHINE)?;
        }
        let objects: Vec<String> = sources().map(|it| it.replace(".c", ".rel")).collect();
        let mut arguments = FLAGS.to_vec();
        arguments.extend(["-o", "chart.ihx"]);
        arguments.extend(objects.iter().map(String::as_str));
        let linked = bench.compile(&["sdcc"], &arguments, MACHINE)?;
        // A function that sdcc's library does not have is a warning to its linker.
        if linked.stderr.contains("Undefined Global") {
            return Err(EngineError::Failed(format!("sdcc: {}", linked.stderr.trim())));
        }
        let door = format!("if=xram[0xffff],in={STIMULUS},out={ANSWER}");
        let run = bench.start_with(&SIMULATOR, &["-t", "C52", "-I", &door, "chart.ihx"], RUN)?;
        if !run.is_success {
            let said = String::from_utf8_lossy(&run.stdout);
            return Err(EngineError::Failed(format!(
                "s51 ended with {} {}",
                run.ending,
                said.trim()
            )));
        }
        traces(pieces, &bench.answer()?)
    }
}

const MACHINE: &str = "an 8052 with 64 KB";

/// Commands on the console. `-G` would start the machine too, but then the end of the console's input stops it wherever it is.
const RUN: &[u8] = b"run\nquit\n";

/// Newer versions of ucsim call it by another name.
const SIMULATOR: [&str; 2] = ["s51", "ucsim_51"];
