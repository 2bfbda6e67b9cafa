//! The common part of the host programs around the library libsimavr. Each program adds its own `main`.

use crate::c;
use std::path::Path;

/// A machine with a firmware, which reads the next byte of a stimulus from GPIOR1 and writes one byte of the answer to GPIOR0.
const MACHINE: &str = r#"#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static FILE *stimulus;
static FILE *answer;

static uint8_t give(struct avr_t *avr, avr_io_addr_t address, void *parameter)
{
    (void)avr;
    (void)address;
    (void)parameter;
    const int byte = fgetc(stimulus);
    return byte == EOF ? 0U : (uint8_t)byte;
}

static void take(struct avr_t *avr, avr_io_addr_t address, uint8_t value, void *parameter)
{
    (void)parameter;
    avr->data[address] = value;
    fputc(value, answer);
}

/* Arguments: the machine, the firmware, the files of stimulus and answer. Returns NULL if one of them cannot be opened. */
static avr_t *machine(char **argv)
{
    static elf_firmware_t firmware;
    if (elf_read_firmware(argv[2], &firmware) != 0) {
        return NULL;
    }
    avr_t *avr = avr_make_mcu_by_name(argv[1]);
    stimulus = fopen(argv[3], "rb");
    answer = fopen(argv[4], "wb");
    if (avr == NULL || stimulus == NULL || answer == NULL) {
        return NULL;
    }
    avr_init(avr);
    avr->frequency = 16000000U;
    avr_load_firmware(avr, &firmware);
    avr_register_io_write(avr, 0x3e, take, NULL);
    avr_register_io_read(avr, 0x4a, give, NULL);
    return avr;
}

"#;

/// Whether libsimavr is installed.
pub(crate) fn is_here() -> bool {
    ["/usr/include", "/usr/local/include"]
        .iter()
        .any(|folder| Path::new(folder).join("simavr/sim_avr.h").is_file())
}

/// What is missing if libsimavr is not installed.
pub(crate) const LIBRARY: &str = "libsimavr (Debian: libsimavr-dev)";

/// Compiles a host with this `main`.
///
/// # Errors
/// The output of the compiler.
pub(crate) fn host(main: &str) -> Result<c::Program, String> {
    c::compile_with(&format!("{MACHINE}{main}"), &["-O2"], &["-lsimavr", "-lelf"])
}
