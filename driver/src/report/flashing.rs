//! How to flash the C program to a microcontroller: the commands, for one machine of each kind.

use super::Subject;
use super::document::{Block, Rich};

pub(super) fn write(subject: &Subject<'_>) -> Vec<Block> {
    let Some(package) = subject.built.packages.first() else { return Vec::new() };
    let name = package.stem();
    // All files that are compiled, and the program around the chart, which the user writes.
    let sources = package.files.iter().map(|file| file.name.as_str());
    let sources: Vec<&str> = sources.filter(|file| file.ends_with(".c")).collect();
    let sources = sources.join(" ");
    let plain = subject.built.files.iter().any(|file| file.name.ends_with("-plain/Makefile"));
    let about = if plain {
        let words = "In `{}`, `make TOOLCHAIN=avr flash` does this (use `arm` and `sdcc` for the others); the program around the chart is `example/board.c`.";
        Rich::say(words, [format!("{name}-plain").into()])
    } else {
        let words = "`main.c` is your program around the chart; `--package plain` writes one, with a Makefile.";
        Rich::say(words, [])
    };
    let text = format!(
        "AVR         avr-gcc -std=gnu99 -Os -mmcu=atmega328p -o {name}.elf {sources} main.c\n\
         \x20           avr-objcopy -O ihex -R .eeprom {name}.elf {name}.hex\n\
         \x20           avrdude -p atmega328p -c arduino -P /dev/ttyUSB0 -b 115200 -U flash:w:{name}.hex:i\n\
         Cortex-M    arm-none-eabi-objcopy -O binary {name}.elf {name}.bin\n\
         \x20           st-flash write {name}.bin 0x08000000\n\
         8051        packihx {name}.ihx > {name}.hex\n\
         \x20           stcgal -P stc89 -p /dev/ttyUSB0 {name}.hex\n"
    );
    vec![Block::Paragraph(about), Block::Text(text)]
}
