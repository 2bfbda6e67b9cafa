//! A folder with a Makefile for five compilers, an example for the host and one for a board.

use super::{Chart, board, fill, host, written, yours};
use crate::File;

const MAKEFILE: &str = include_str!("text/Makefile");
/// The linker script: the memory of a Cortex-M.
const MEMORY: &str = include_str!("text/cortex-m.ld");

pub(super) fn files(chart: &Chart<'_>) -> Vec<File> {
    let mut files = chart.c_files("", "");
    let makefile = fill(
        MAKEFILE,
        &[
            ("NAME", chart.name()),
            // A dollar or a number sign has a meaning for make, even at the end of a comment.
            ("ABOUT", &chart.about().replace(['$', '\\', '#'], " ")),
            ("SOURCES", &chart.names_of(true).join(" ")),
        ],
    );
    files.push(written("Makefile", makefile));
    files.push(written("README.md", chart.readme(&head(chart))));
    let include = format!("\"../{}.h\"", chart.stem());
    files.push(yours("example/host.c", host::text(chart, &include)));
    files.push(yours("example/board.c", board::text(chart, "../")));
    files.push(yours("example/cortex-m.ld", MEMORY));
    files
}

fn head(chart: &Chart<'_>) -> String {
    let stem = chart.stem();
    format!(
        "C99 with a Makefile (GNU make).\n\n\
         | command | does |\n|---|---|\n\
         | `make`, `make TOOLCHAIN=clang` | builds `example/host.c`: each line of standard input is a reaction |\n\
         | `make run < rows` | runs the example on the lines of the file `rows` |\n\
         | `make TOOLCHAIN=avr MCU=atmega328p F_CPU=16000000UL` | firmware of `example/board.c` for an AVR |\n\
         | `make TOOLCHAIN=avr flash PROGRAMMER=arduino PORT=/dev/ttyUSB0` | writes the firmware with avrdude |\n\
         | `make TOOLCHAIN=arm CPU=cortex-m3` | firmware for a Cortex-M; `FLASH_START`, `FLASH_SIZE`, `RAM_START`, `RAM_SIZE` are its memories, `flash` calls st-flash |\n\
         | `make TOOLCHAIN=sdcc` | firmware for an 8051 with external RAM (`MODEL=small` without); `flash` calls stcgal |\n\
         | `make TOOLCHAIN=.. size` | prints the memory that the program uses |\n\n\
         The pins of a board are at the top of `example/board.c`. Put settings in `local.mk`. In your own project, use `{stem}*.c` and `{stem}*.h`; nothing else is needed.\n"
    )
}
