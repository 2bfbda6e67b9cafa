//! Runs the emitted C on an AVR, whose `int` has 16 bits: avr-gcc, and simavr as a library.
//!
//! The program `simavr` shows a firmware's output as a coloured log and has no input, so a small host program is compiled against
//! libsimavr. A read of GPIOR1 returns the next byte of the stimulus; a write to GPIOR0 adds one byte to the answer. Both are ordinary
//! registers of the machine, so the firmware needs no library and loses no cycles. It ends by sleeping with interrupts off, from which an
//! AVR does not wake up.

use crate::firmware::{ANSWER, BENCH, Bench, Machine, Piece, STIMULUS, too_large_for, traces};
use crate::{Availability, Engine, EngineError, Job, c, simavr, tools};
use grafsynth_backend_c::Options;
use grafsynth_sim::Trace;
use std::path::Path;
use std::sync::OnceLock;

/// An ATmega1284P: 128 KB of flash and 16 KB of RAM, and a program counter of two bytes as on the small devices.
#[derive(Debug, Default)]
pub struct AvrEngine {
    /// The style of the emitted C.
    pub options: Options,
    /// The host program with the simulator, compiled at its first use.
    pub host: OnceLock<Result<c::Program, String>>,
}

/// The machine's name for avr-gcc and for simavr.
const MACHINE: &str = "atmega1284p";
/// Bytes of RAM, and the part that is reserved for the stack.
const RAM: (usize, usize) = (16 * 1024, 1024);

/// The bench's interface to the host.
pub(crate) const PORT: &str = "#ifndef BENCH_PORT_H
#define BENCH_PORT_H

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdint.h>

static inline void bench_begin(void)
{
}

static inline uint8_t bench_get(void)
{
    return GPIOR1;
}

static inline void bench_put(uint8_t value)
{
    GPIOR0 = value;
}

static inline void bench_end(void)
{
    cli();
    sleep_enable();
    for (;;) {
        sleep_cpu();
    }
}

#endif
";

/// The host: runs `chart.elf` with `stimulus.bin` and writes `answer.bin`; its exit code is 0 if the firmware ended normally.
const HOST: &str = r#"int main(int argc, char **argv)
{
    avr_t *avr = argc == 5 ? machine(argv) : NULL;
    if (avr == NULL) {
        return 2;
    }
    int state = cpu_Running;
    while (state != cpu_Done && state != cpu_Crashed) {
        state = avr_run(avr);
    }
    fclose(answer);
    return state == cpu_Done ? 0 : 1;
}
"#;

impl AvrEngine {
    fn host(&self) -> Result<&Path, EngineError> {
        self.host
            .get_or_init(|| simavr::host(HOST))
            .as_ref()
            .map(|program| program.path.as_path())
            .map_err(|why| EngineError::Failed(why.clone()))
    }
}

impl Engine for AvrEngine {
    fn name(&self) -> &'static str {
        "c-avr"
    }

    fn about(&self) -> &'static str {
        "the C text on an AVR (avr-gcc, simavr)"
    }

    fn by_default(&self) -> bool {
        false
    }

    fn runs_c(&self) -> bool {
        true
    }

    fn availability(&self) -> Availability {
        if tools::find(&["avr-gcc"]).is_none() {
            Availability::Missing("avr-gcc".to_owned())
        } else if tools::c_compiler().is_none() {
            Availability::Missing("a C compiler".to_owned())
        } else if !simavr::is_here() {
            Availability::Missing(simavr::LIBRARY.to_owned())
        } else {
            Availability::Here
        }
    }

    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError> {
        self.run_one(job, &self.options)
    }
}

impl Machine for AvrEngine {
    fn run_all(&self, pieces: &[Piece<'_>]) -> Result<Vec<Trace>, EngineError> {
        let bench = Bench::new(pieces, PORT)?;
        let machine = format!("-mmcu={MACHINE}");
        let mut arguments = vec![
            machine.as_str(),
            // `-std=c99` does not support `__flash`.
            "-std=gnu99",
            "-Os",
            "-Wl,--gc-sections",
            "-o",
            "chart.elf",
            BENCH,
        ];
        arguments.extend(bench.sources.iter().map(String::as_str));
        bench.compile(&["avr-gcc"], &arguments, "an ATmega1284P")?;
        // The linker does not know the size of the RAM.
        let sizes = bench.start(&["avr-size"], &["chart.elf"])?;
        if ram(&sizes.stdout).is_none_or(|bytes| bytes + RAM.1 > RAM.0) {
            return Err(EngineError::Refused(vec![too_large_for("an ATmega1284P")]));
        }
        let host = self.host()?;
        let arguments = [MACHINE, "chart.elf", STIMULUS, ANSWER];
        let run = tools::run(host, &arguments, bench.path(), b"", c::LIMIT)
            .map_err(EngineError::Failed)?;
        if !run.is_success {
            let said = String::from_utf8_lossy(&run.stdout);
            return Err(EngineError::Failed(format!(
                "simavr ended with {} {}{}",
                run.ending,
                said.trim(),
                run.stderr.trim()
            )));
        }
        traces(pieces, &bench.answer()?)
    }
}

/// Bytes of `.data` and `.bss` in the output of `size`.
pub(crate) fn ram(printed: &[u8]) -> Option<usize> {
    let text = String::from_utf8_lossy(printed);
    let mut numbers = text.lines().nth(1)?.split_whitespace().skip(1);
    let data: usize = numbers.next()?.parse().ok()?;
    let bss: usize = numbers.next()?.parse().ok()?;
    Some(data + bss)
}

#[cfg(test)]
mod tests {
    use super::ram;

    #[test]
    fn sizes_are_read() {
        let text = b"   text\t   data\t    bss\t    dec\t    hex\tfilename\n    562\t      6\t     36\t    604\t    25c\tx\n";
        assert_eq!(ram(text), Some(42));
        assert_eq!(ram(b""), None);
    }
}
