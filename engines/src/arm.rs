//! Runs the emitted C on a Cortex-M3: arm-none-eabi-gcc, and qemu's board mps2-an385.
//!
//! Bytes are transferred by ARM's semihosting (the interface that debuggers offer to a target): files of the folder are opened, read and written in blocks
//! of 256 bytes, and `SYS_EXIT` stops the machine.

use crate::firmware::{BENCH, Bench, Machine, Piece, traces};
use crate::{Availability, Engine, EngineError, Job, tools};
use grafsynth_backend_c::Options;
use grafsynth_sim::Trace;

/// A Cortex-M3 with 4 MB each of code and of data.
#[derive(Debug, Clone, Default)]
pub struct ArmEngine {
    /// The style of the emitted C.
    pub options: Options,
}

/// The bench's interface to the host. Operation numbers: Arm, *Semihosting for AArch32 and AArch64*, §6.
pub(crate) const PORT: &str = r#"#ifndef BENCH_PORT_H
#define BENCH_PORT_H

#include <stdint.h>

#define SYS_OPEN 0x01U
#define SYS_CLOSE 0x02U
#define SYS_WRITE 0x05U
#define SYS_READ 0x06U
#define SYS_EXIT 0x18U

static uint32_t bench_files[2];
static uint8_t bench_in[256];
static uint8_t bench_out[256];
static uint32_t bench_at;
static uint32_t bench_n_in;
static uint32_t bench_n_out;

static uint32_t bench_call(uint32_t operation, const volatile void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const volatile void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static uint32_t bench_open(const char *name, uint32_t length, uint32_t mode)
{
    const volatile uint32_t block[3] = { (uint32_t)(uintptr_t)name, mode, length };
    return bench_call(SYS_OPEN, block);
}

static void bench_begin(void)
{
    bench_files[0] = bench_open("stimulus.bin", 12U, 1U);
    bench_files[1] = bench_open("answer.bin", 10U, 5U);
}

static uint8_t bench_get(void)
{
    if (bench_at == bench_n_in) {
        const volatile uint32_t block[3] = { bench_files[0], (uint32_t)(uintptr_t)bench_in, sizeof bench_in };
        bench_n_in = (uint32_t)sizeof bench_in - bench_call(SYS_READ, block);
        bench_at = 0U;
        if (bench_n_in == 0U) {
            return 0U;
        }
    }
    return bench_in[bench_at++];
}

static void bench_flush(void)
{
    const volatile uint32_t block[3] = { bench_files[1], (uint32_t)(uintptr_t)bench_out, bench_n_out };
    (void)bench_call(SYS_WRITE, block);
    bench_n_out = 0U;
}

static void bench_put(uint8_t value)
{
    bench_out[bench_n_out++] = value;
    if (bench_n_out == sizeof bench_out) {
        bench_flush();
    }
}

static void bench_end(void)
{
    if (bench_n_out != 0U) {
        bench_flush();
    }
    (void)bench_call(SYS_CLOSE, &bench_files[1]);
    (void)bench_call(SYS_EXIT, (const volatile void *)0x20026);
}

#endif
"#;

/// The machine's vectors and start-up code: a fault ends it with another exit code.
pub(crate) const START: &str = r#"#include <stdint.h>

extern uint32_t _stack[];
extern uint32_t _bss[];
extern uint32_t _ebss[];
extern int main(void);

static void start(void)
{
    uint32_t *at = _bss;
    while (at != _ebss) {
        *at++ = 0U;
    }
    (void)main();
    for (;;) {
    }
}

static void fault(void)
{
    __asm__ volatile("mov r0, #0x18\n mov r1, #0\n bkpt 0xab");
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const void *const vectors[] = {
    _stack, (const void *)start, (const void *)fault, (const void *)fault, (const void *)fault, (const void *)fault, (const void *)fault,
};
"#;

/// The linker script. qemu loads both memories, so initialised data is already in place.
pub(crate) const LINK: &str = "MEMORY
{
    code (rx) : ORIGIN = 0x00000000, LENGTH = 4M
    data (rw) : ORIGIN = 0x20000000, LENGTH = 4M
}
SECTIONS
{
    .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) } > code
    .ARM.exidx : { *(.ARM.exidx*) } > code
    .data : { *(.data*) } > data
    .bss : { . = ALIGN(4); _bss = .; *(.bss*) *(COMMON) . = ALIGN(4); _ebss = .; } > data
    _stack = 0x20400000;
}
";

/// The arguments of qemu.
pub(crate) const QEMU: [&str; 12] = [
    "-M",
    "mps2-an385",
    "-display",
    "none",
    "-monitor",
    "none",
    "-serial",
    "none",
    "-semihosting-config",
    "enable=on,target=native",
    "-kernel",
    "chart.elf",
];

impl Engine for ArmEngine {
    fn name(&self) -> &'static str {
        "c-arm"
    }

    fn about(&self) -> &'static str {
        "the C text on a Cortex-M3 (arm-none-eabi-gcc, qemu)"
    }

    fn by_default(&self) -> bool {
        false
    }

    fn runs_c(&self) -> bool {
        true
    }

    fn availability(&self) -> Availability {
        for tool in ["arm-none-eabi-gcc", "qemu-system-arm"] {
            if tools::find(&[tool]).is_none() {
                return Availability::Missing(tool.to_owned());
            }
        }
        Availability::Here
    }

    fn run(&self, job: &Job<'_>) -> Result<Trace, EngineError> {
        self.run_one(job, &self.options)
    }
}

impl Machine for ArmEngine {
    fn run_all(&self, pieces: &[Piece<'_>]) -> Result<Vec<Trace>, EngineError> {
        let bench = Bench::new(pieces, PORT)?;
        bench.write("start.c", START.as_bytes())?;
        bench.write("link.ld", LINK.as_bytes())?;
        let mut arguments = vec![
            "-mcpu=cortex-m3",
            "-mthumb",
            "-std=c99",
            "-Os",
            "-nostartfiles",
            "-T",
            "link.ld",
            "-o",
            "chart.elf",
            "start.c",
            BENCH,
        ];
        arguments.extend(bench.sources.iter().map(String::as_str));
        bench.compile(&["arm-none-eabi-gcc"], &arguments, "a Cortex-M3 with 4 MB")?;
        let run = bench.start(&["qemu-system-arm"], &QEMU)?;
        if !run.is_success {
            return Err(EngineError::Failed(format!(
                "qemu ended with {} {}",
                run.ending,
                run.stderr.trim()
            )));
        }
        traces(pieces, &bench.answer()?)
    }
}
