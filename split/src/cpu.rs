//! Microcontrollers as data: the pins to which a chip can be wired, and the figures that decide whether a part fits.
//!
//! Each constant names the sources of its figures, and the wiring table repeats them, because figures that are "not verified" must be compared with the data sheet before
//! anyone wires the board.

/// How the pins of a microcontroller are set and read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Family {
    /// `PORTx`, `DDRx` and `PINx` of `<avr/io.h>`.
    Avr,
    /// The GPIO ports of an STM32F1, with `CRL`, `CRH`, `IDR` and `BSRR`.
    Stm32f1,
    /// The ports of an 8051 as bits; a pin is an input while its latch is 1.
    Mcs51,
    /// Functions that the program provides, for tests on a PC.
    Host,
}

/// A pin that software can set and read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pin {
    /// The name of the port: `B` in `PB0`, `1` in `P1.0`.
    pub port: char,
    /// The bit in the port.
    pub bit: u32,
    /// The number on the package.
    pub number: u32,
    /// True if an output of a 5 V chip may drive the pin.
    pub takes_5v: bool,
}

/// The cycles of the driver of a link, counted from the instructions that compilers generate for it, with a margin; the reaction is not included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinkCycles {
    /// The call of the function for a round, with all registers that it saves.
    pub call: u32,
    /// The maximum for one act: an input is copied, a pin set or read, a clock pulse given.
    pub act: u32,
    /// The maximum for one iteration of a wait loop.
    pub wait: u32,
}

/// The bytes of a link and of the smallest program around it, for an estimate without a compiler.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinkBytes {
    /// Flash of the interrupt vectors, the start-up code and a `main` that only calls the link.
    pub program: u32,
    /// Flash of one act of a round, with the initialisation of its pin.
    pub act: u32,
    /// Flash of all waits.
    pub waits: u32,
    /// Stack of `main` and of the function for a round: return addresses and saved registers.
    pub stack: u32,
}

/// From the truck, line and launcher examples with avr-gcc 5.4 `-Os`, with a margin.
const AVR_BYTES: Option<LinkBytes> =
    Some(LinkBytes { program: 190, act: 18, waits: 130, stack: 24 });
/// From the same examples with arm-none-eabi-gcc 12.2 `-Os`, with a margin.
const CORTEX_M3_BYTES: Option<LinkBytes> =
    Some(LinkBytes { program: 120, act: 40, waits: 110, stack: 56 });
/// 18 registers of an AVR, pushed and popped; a pin by `in`, `ori`, `out` after a test.
const AVR_LINK: Option<LinkCycles> = Some(LinkCycles { call: 100, act: 14, wait: 32 });
/// 9 registers of a Cortex-M3; a pin by two loads and a store, with the wait states of the flash.
const CORTEX_M3_LINK: Option<LinkCycles> = Some(LinkCycles { call: 60, act: 24, wait: 24 });

/// One microcontroller.
#[derive(Debug, PartialEq, Eq)]
pub struct Cpu {
    /// Its name in options.
    pub name: &'static str,
    /// Its package.
    pub package: &'static str,
    /// The number of pins of the package.
    pub n_pins: u32,
    /// Bytes of flash.
    pub flash: u32,
    /// Bytes of RAM.
    pub ram: u32,
    /// The pins that a link may use, in order of preference. Pins for reset, crystal and debugger are not listed.
    pub pins: &'static [Pin],
    /// The highest clock frequency in hertz. Delays are computed for it, so they are longer at a lower frequency.
    pub clock_hz: u32,
    /// Clock cycles per cycle of the shortest instruction.
    pub clocks_per_cycle: u32,
    /// The supply voltage at that frequency, with the tolerance.
    pub supply: &'static str,
    /// The name of the cost model of its processor.
    pub machine: &'static str,
    /// What the link itself takes in a round; `None` if no time can be stated.
    pub link_cycles: Option<LinkCycles>,
    /// What the link itself takes of the memories, as an estimate; `None` if only a compiler knows: the cost model of an 8051 assumes external RAM.
    pub link_bytes: Option<LinkBytes>,
    /// How its pins are accessed.
    pub family: Family,
    /// The resistor, in ohms, that pulls a pin to a level while the CPU is in reset.
    pub pull_ohms: u32,
    /// The sources of the figures.
    pub source: &'static str,
}

impl Cpu {
    /// The name of a pin as the manufacturer writes it: `PB0`, or `P1.0` for an 8051.
    #[must_use]
    pub fn pin_name(&self, pin: Pin) -> String {
        match self.family {
            Family::Mcs51 => format!("P{}.{}", pin.port, pin.bit),
            Family::Avr | Family::Stm32f1 | Family::Host => format!("P{}{}", pin.port, pin.bit),
        }
    }

    /// The usable pin with this name; letter case does not matter.
    #[must_use]
    pub fn pin(&self, name: &str) -> Option<Pin> {
        let is_it = |pin: &&Pin| self.pin_name(**pin).eq_ignore_ascii_case(name);
        self.pins.iter().find(is_it).copied()
    }

    /// The usable pin with this number on the package.
    #[must_use]
    pub fn pin_number(&self, number: u32) -> Option<Pin> {
        self.pins.iter().find(|pin| pin.number == number).copied()
    }
}

const fn pin(port: char, bit: u32, number: u32) -> Pin {
    Pin { port, bit, number, takes_5v: true }
}

/// A pin of a 3.3 V microcontroller that a 5 V chip must not drive.
const fn low(port: char, bit: u32, number: u32) -> Pin {
    Pin { port, bit, number, takes_5v: false }
}

/// `ATmega328P` in the 28-pin DIP. PC6 is reset, and PB6 and PB7 are the crystal. The serial port (PD0, PD1) and the pins of the programmer (PB3 to PB5) are last.
const ATMEGA328P: Cpu = Cpu {
    name: "atmega328p",
    package: "DIP-28",
    n_pins: 28,
    flash: 32_768,
    ram: 2048,
    pins: &[
        pin('D', 2, 4),
        pin('D', 3, 5),
        pin('D', 4, 6),
        pin('D', 5, 11),
        pin('D', 6, 12),
        pin('D', 7, 13),
        pin('B', 0, 14),
        pin('B', 1, 15),
        pin('B', 2, 16),
        pin('C', 0, 23),
        pin('C', 1, 24),
        pin('C', 2, 25),
        pin('C', 3, 26),
        pin('C', 4, 27),
        pin('C', 5, 28),
        pin('B', 3, 17),
        pin('B', 4, 18),
        pin('B', 5, 19),
        pin('D', 0, 2),
        pin('D', 1, 3),
    ],
    clock_hz: 20_000_000,
    clocks_per_cycle: 1,
    supply: "4.5 to 5.5 V",
    machine: "avr",
    link_cycles: AVR_LINK,
    link_bytes: AVR_BYTES,
    family: Family::Avr,
    pull_ohms: 10_000,
    source: "memory sizes: avr-libc iom328p.h; pins and frequency: not verified",
};

/// `ATtiny85` in the 8-pin DIP. PB5 is reset; the clock is internal or on PB3, which is therefore last.
const ATTINY85: Cpu = Cpu {
    name: "attiny85",
    package: "DIP-8",
    n_pins: 8,
    flash: 8192,
    ram: 512,
    pins: &[pin('B', 0, 5), pin('B', 1, 6), pin('B', 2, 7), pin('B', 4, 3), pin('B', 3, 2)],
    clock_hz: 20_000_000,
    clocks_per_cycle: 1,
    supply: "4.5 to 5.5 V",
    machine: "avr",
    link_cycles: AVR_LINK,
    link_bytes: AVR_BYTES,
    family: Family::Avr,
    pull_ohms: 10_000,
    source: "memory sizes: avr-libc iotn85.h; pins and frequency: not verified",
};

/// `ATtiny2313` in the 20-pin DIP. PA2 is reset, and PA0 and PA1 are the crystal. The serial port (PD0, PD1) and the pins of the programmer (PB5 to PB7) are last.
const ATTINY2313: Cpu = Cpu {
    name: "attiny2313",
    package: "DIP-20",
    n_pins: 20,
    flash: 2048,
    ram: 128,
    pins: &[
        pin('B', 0, 12),
        pin('B', 1, 13),
        pin('B', 2, 14),
        pin('B', 3, 15),
        pin('B', 4, 16),
        pin('D', 2, 6),
        pin('D', 3, 7),
        pin('D', 4, 8),
        pin('D', 5, 9),
        pin('D', 6, 11),
        pin('B', 5, 17),
        pin('B', 6, 18),
        pin('B', 7, 19),
        pin('D', 0, 2),
        pin('D', 1, 3),
    ],
    clock_hz: 20_000_000,
    clocks_per_cycle: 1,
    supply: "4.5 to 5.5 V",
    machine: "avr",
    link_cycles: AVR_LINK,
    link_bytes: AVR_BYTES,
    family: Family::Avr,
    pull_ohms: 10_000,
    source: "memory sizes: avr-libc iotn2313.h; pins and frequency: not verified",
};

/// `STM32F103C8`. The debugger (PA13 to PA15, PB3, PB4), the start-up mode (PB2) and the slow oscillator (PC14, PC15) are not listed.
/// PC13, which drives at most 3 mA and 2 MHz, is last.
const STM32F103: Cpu = Cpu {
    name: "stm32f103",
    package: "LQFP-48",
    n_pins: 48,
    flash: 65_536,
    ram: 20_480,
    pins: &[
        pin('B', 12, 25),
        pin('B', 13, 26),
        pin('B', 14, 27),
        pin('B', 15, 28),
        pin('A', 8, 29),
        pin('B', 6, 42),
        pin('B', 7, 43),
        pin('B', 8, 45),
        pin('B', 9, 46),
        pin('B', 10, 21),
        pin('B', 11, 22),
        pin('A', 9, 30),
        pin('A', 10, 31),
        pin('A', 11, 32),
        pin('A', 12, 33),
        low('A', 0, 10),
        low('A', 1, 11),
        low('A', 2, 12),
        low('A', 3, 13),
        low('A', 4, 14),
        low('A', 5, 15),
        low('A', 6, 16),
        low('A', 7, 17),
        low('B', 0, 18),
        low('B', 1, 19),
        low('B', 5, 41),
        low('C', 13, 2),
    ],
    clock_hz: 72_000_000,
    clocks_per_cycle: 1,
    supply: "2.0 to 3.6 V",
    machine: "cortex-m3",
    link_cycles: CORTEX_M3_LINK,
    link_bytes: CORTEX_M3_BYTES,
    family: Family::Stm32f1,
    pull_ohms: 10_000,
    source: "memory sizes, frequency, supply: first page of the data sheet; pins: KiCad symbols of the 48-pin STM32F1; 5 V: not verified",
};

/// `STM32F103RB`. The debugger (PA13 to PA15, PB3, PB4), the start-up mode (PB2), the crystal (PD0, PD1) and the slow oscillator (PC14, PC15) are not listed. PC13,
/// which drives at most 3 mA and 2 MHz, is last.
const STM32F103RB: Cpu = Cpu {
    name: "stm32f103rb",
    package: "LQFP-64",
    n_pins: 64,
    flash: 131_072,
    pins: &[
        pin('B', 12, 33),
        pin('B', 13, 34),
        pin('B', 14, 35),
        pin('B', 15, 36),
        pin('C', 6, 37),
        pin('C', 7, 38),
        pin('C', 8, 39),
        pin('C', 9, 40),
        pin('A', 8, 41),
        pin('C', 10, 51),
        pin('C', 11, 52),
        pin('C', 12, 53),
        pin('D', 2, 54),
        pin('B', 6, 58),
        pin('B', 7, 59),
        pin('B', 8, 61),
        pin('B', 9, 62),
        pin('B', 10, 29),
        pin('B', 11, 30),
        pin('A', 9, 42),
        pin('A', 10, 43),
        pin('A', 11, 44),
        pin('A', 12, 45),
        low('A', 0, 14),
        low('A', 1, 15),
        low('A', 2, 16),
        low('A', 3, 17),
        low('A', 4, 20),
        low('A', 5, 21),
        low('A', 6, 22),
        low('A', 7, 23),
        low('B', 0, 26),
        low('B', 1, 27),
        low('B', 5, 57),
        low('C', 0, 8),
        low('C', 1, 9),
        low('C', 2, 10),
        low('C', 3, 11),
        low('C', 4, 24),
        low('C', 5, 25),
        low('C', 13, 2),
    ],
    source: "memory sizes, frequency, supply: first page of the data sheet; pins and 5 V: not verified",
    ..STM32F103
};

/// `AT89S52` in the 40-pin DIP. Port 0 has open drains and is not listed; P1.5 to P1.7 belong to the programmer and P3.0 and P3.1 to the serial port, so they are
/// last. In reset, the microcontroller pulls all pins high with at most 50 microamperes; the resistor must overcome this current.
const AT89S52: Cpu = Cpu {
    name: "at89s52",
    package: "DIP-40",
    n_pins: 40,
    flash: 8192,
    ram: 256,
    pins: &[
        pin('1', 0, 1),
        pin('1', 1, 2),
        pin('1', 2, 3),
        pin('1', 3, 4),
        pin('1', 4, 5),
        pin('2', 0, 21),
        pin('2', 1, 22),
        pin('2', 2, 23),
        pin('2', 3, 24),
        pin('2', 4, 25),
        pin('2', 5, 26),
        pin('2', 6, 27),
        pin('2', 7, 28),
        pin('3', 2, 12),
        pin('3', 3, 13),
        pin('3', 4, 14),
        pin('3', 5, 15),
        pin('3', 6, 16),
        pin('3', 7, 17),
        pin('1', 5, 6),
        pin('1', 6, 7),
        pin('1', 7, 8),
        pin('3', 0, 10),
        pin('3', 1, 11),
    ],
    clock_hz: 33_000_000,
    clocks_per_cycle: 12,
    supply: "4.0 to 5.5 V",
    machine: "8051",
    link_cycles: None,
    link_bytes: None,
    family: Family::Mcs51,
    pull_ohms: 3300,
    source: "all figures: not verified",
};

/// The microcontrollers.
pub const CPUS: &[Cpu] = &[ATMEGA328P, ATTINY85, ATTINY2313, STM32F103, STM32F103RB, AT89S52];

/// A PC for tests; its pins are functions that the program provides. It is not in [`CPUS`].
pub static HOST: Cpu = Cpu {
    name: "host",
    package: "none",
    n_pins: 64,
    flash: u32::MAX,
    ram: u32::MAX,
    pins: &HOST_PINS,
    clock_hz: 1,
    clocks_per_cycle: 1,
    supply: "none",
    machine: "x86-64",
    link_cycles: None,
    link_bytes: None,
    family: Family::Host,
    pull_ohms: 10_000,
    source: "none",
};

const HOST_PINS: [Pin; 64] = {
    let mut pins = [pin('X', 0, 1); 64];
    let mut at = 0;
    while at < 64 {
        pins[at as usize] = pin('X', at, at + 1);
        at += 1;
    }
    pins
};

/// The microcontroller with this name; letter case does not matter.
#[must_use]
pub fn cpu(name: &str) -> Option<&'static Cpu> {
    CPUS.iter().find(|cpu| cpu.name.eq_ignore_ascii_case(name))
}

#[cfg(test)]
mod tests {
    use super::{CPUS, HOST, cpu};
    use std::collections::BTreeSet;

    #[test]
    fn each_pin_is_listed_once_and_is_on_the_package() {
        for cpu in CPUS.iter().chain([&HOST]) {
            let numbers: BTreeSet<u32> = cpu.pins.iter().map(|pin| pin.number).collect();
            let names: BTreeSet<String> = cpu.pins.iter().map(|pin| cpu.pin_name(*pin)).collect();
            assert_eq!(numbers.len(), cpu.pins.len(), "{}", cpu.name);
            assert_eq!(names.len(), cpu.pins.len(), "{}", cpu.name);
            assert!(numbers.iter().all(|number| (1..=cpu.n_pins).contains(number)), "{}", cpu.name);
        }
    }

    #[test]
    fn names_are_found() {
        let chip = cpu("AT89S52").unwrap();
        assert_eq!(chip.pin("p1.0").map(|pin| pin.number), Some(1));
        assert_eq!(chip.pin("P0.0"), None, "port 0 has open drains");
        assert_eq!(cpu("atmega8"), None);
    }
}
