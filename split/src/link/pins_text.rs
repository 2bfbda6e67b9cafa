//! `NAME_link_pins.h`: how the CPU sets and reads the pins of a link. Only this module depends on the family of the CPU.

use super::time::{Wait, loop_of, settle};
use super::{Connection, Link, Request};
use crate::cpu::{Cpu, Family, Pin};

/// One connection of the CPU.
struct Line<'l> {
    connection: &'l Connection,
    pin: Pin,
    /// True if the CPU drives the pin.
    drives: bool,
}

/// The text of `NAME_link_pins.h`.
pub(super) fn pins(request: &Request<'_>, link: &Link) -> String {
    let (name, upper, cpu) = (&request.name, request.name.to_uppercase(), request.cpu);
    let part = request.chips.len();
    let lines: Vec<Line<'_>> =
        link.connections.iter().filter_map(|one| line(one, part, cpu)).collect();
    let mut text = format!(
        "/* {}_link_pins: the pins of the CPU ({}). To change a macro, define it before this file is read, or with -D. */\n\
         #ifndef {upper}_LINK_PINS_H\n#define {upper}_LINK_PINS_H\n\n#include <stdbool.h>\n#include <stdint.h>\n",
        super::files::comment(&request.stem),
        cpu.name
    );
    text += &preamble(cpu, name, &upper, &lines);
    for one in &lines {
        let signal = &one.connection.name;
        let pin = cpu.pin_name(one.pin);
        if one.drives {
            let (high, low) =
                (set(cpu, name, &upper, one.pin, true), set(cpu, name, &upper, one.pin, false));
            let body = if cpu.family == Family::Host {
                format!("    {name}_link_host_put({}U, level);\n", one.pin.number)
            } else {
                format!(
                    "    if (level) {{\n        {high}\n    }} else {{\n        {low}\n    }}\n"
                )
            };
            text += &format!(
                "\n/* {signal}: {pin}, pin {}. */\nstatic inline void {name}_link_put_{signal}(bool level)\n{{\n{body}}}\n",
                one.pin.number
            );
            text += &format!(
                "#ifndef {upper}_PUT_{signal}\n#define {upper}_PUT_{signal}(level) {name}_link_put_{signal}(level)\n#endif\n"
            );
        } else {
            let value = read(cpu, name, &upper, one.pin);
            text += &format!(
                "\n/* {signal}: {pin}, pin {}. */\nstatic inline bool {name}_link_get_{signal}(void)\n{{\n    return {value};\n}}\n",
                one.pin.number
            );
            text += &format!(
                "#ifndef {upper}_GET_{signal}\n#define {upper}_GET_{signal}() {name}_link_get_{signal}()\n#endif\n"
            );
        }
    }
    text += &format!(
        "\n/* Sets the pins to the levels of their resistors, then sets their directions. */\nstatic inline void {name}_link_pins_init(void)\n{{\n{}}}\n\
         #ifndef {upper}_LINK_PINS_INIT\n#define {upper}_LINK_PINS_INIT() {name}_link_pins_init()\n#endif\n",
        directions(cpu, name, &upper, &lines)
    );
    text += &waits(request, &upper);
    text += "\n#endif\n";
    text
}

fn line<'l>(connection: &'l Connection, part: usize, cpu: &Cpu) -> Option<Line<'l>> {
    let drives = connection.from.part == part;
    let mut ends = [&connection.from].into_iter().chain(&connection.to);
    let end = ends.find(|end| end.part == part)?;
    Some(Line { connection, pin: cpu.pin_number(end.pin)?, drives })
}

/// The base address of a port of an STM32F1: A is at 0x40010800, and the ports are 0x400 apart.
fn port_address(pin: Pin) -> u32 {
    0x4001_0800 + 0x400 * (u32::from(pin.port).saturating_sub(u32::from('A')))
}

fn preamble(cpu: &Cpu, name: &str, upper: &str, lines: &[Line<'_>]) -> String {
    match cpu.family {
        Family::Avr => "\n#include <avr/io.h>\n".to_owned(),
        Family::Stm32f1 => format!(
            "\n/* A register of the processor. */\n#ifndef {upper}_LINK_REG\n#define {upper}_LINK_REG(address) (*(volatile uint32_t *)(address))\n#endif\n"
        ),
        Family::Mcs51 => {
            // The ports are at 0x80, 0x90, 0xA0 and 0xB0, and their bits at the same addresses.
            let bit = |one: &Line<'_>| {
                let address = 0x80 + 0x10 * one.pin.port.to_digit(10).unwrap_or(0) + one.pin.bit;
                format!("static __sbit __at(0x{address:02X}) {};\n", bit_name(name, one.pin))
            };
            format!("\n{}", lines.iter().map(bit).collect::<String>())
        }
        Family::Host => format!(
            "\n/* Your program provides these functions: set a pin, read a pin, let the chips follow their inputs. */\n\
             void {name}_link_host_put(unsigned pin, bool level);\nbool {name}_link_host_get(unsigned pin);\nvoid {name}_link_host_settle(void);\n"
        ),
    }
}

fn bit_name(name: &str, pin: Pin) -> String {
    format!("{name}_link_P{}_{}", pin.port, pin.bit)
}

/// The statement that sets an output to a level.
fn set(cpu: &Cpu, name: &str, upper: &str, pin: Pin, level: bool) -> String {
    let Pin { port, bit, number, .. } = pin;
    match cpu.family {
        Family::Avr if level => format!("PORT{port} = (uint8_t)(PORT{port} | (1U << {bit}U));"),
        Family::Avr => format!("PORT{port} = (uint8_t)(PORT{port} & ~(1U << {bit}U));"),
        // BSRR: the lower half sets bits, the upper half resets them.
        Family::Stm32f1 => {
            let shift = if level { bit } else { bit + 16 };
            format!(
                "{upper}_LINK_REG(0x{:08X}UL) = (uint32_t)1U << {shift}U;",
                port_address(pin) + 0x10
            )
        }
        Family::Mcs51 => format!("{} = {};", bit_name(name, pin), u8::from(level)),
        Family::Host => format!("{name}_link_host_put({number}U, {level});"),
    }
}

/// The expression for the level of an input.
fn read(cpu: &Cpu, name: &str, upper: &str, pin: Pin) -> String {
    let Pin { port, bit, number, .. } = pin;
    match cpu.family {
        Family::Avr => format!("(PIN{port} & (1U << {bit}U)) != 0U"),
        Family::Stm32f1 => format!(
            "({upper}_LINK_REG(0x{:08X}UL) & ((uint32_t)1U << {bit}U)) != 0U",
            port_address(pin) + 0x08
        ),
        Family::Mcs51 => format!("{} != 0", bit_name(name, pin)),
        Family::Host => format!("{name}_link_host_get({number}U)"),
    }
}

/// The body of the function that sets levels and directions.
fn directions(cpu: &Cpu, name: &str, upper: &str, lines: &[Line<'_>]) -> String {
    let mut text = String::new();
    if cpu.family == Family::Stm32f1 {
        // RCC_APB2ENR: bit 2 is port A, bit 3 is port B.
        let mask = lines.iter().fold(0, |mask, one| {
            mask | 4_u32 << (u32::from(one.pin.port).saturating_sub(u32::from('A')))
        });
        text += &format!(
            "    {upper}_LINK_REG(0x40021018UL) |= 0x{mask:X}UL; /* the clocks of the ports */\n"
        );
    }
    for one in lines {
        let Pin { port, bit, .. } = one.pin;
        let level = one.connection.pull.unwrap_or(false);
        if one.drives {
            text += &format!("    {}\n", set(cpu, name, upper, one.pin, level));
        }
        match cpu.family {
            Family::Avr if one.drives => {
                text += &format!("    DDR{port} = (uint8_t)(DDR{port} | (1U << {bit}U));\n")
            }
            Family::Avr => {
                text += &format!("    DDR{port} = (uint8_t)(DDR{port} & ~(1U << {bit}U));\n")
            }
            Family::Stm32f1 => {
                // CRL has bits 0 to 7, CRH bits 8 to 15. 2: an output with 2 MHz; 4: an input without a resistor.
                let register = port_address(one.pin) + if bit < 8 { 0 } else { 4 };
                let (shift, mode) = (4 * (bit % 8), if one.drives { 2 } else { 4 });
                text += &format!(
                    "    {upper}_LINK_REG(0x{register:08X}UL) = ({upper}_LINK_REG(0x{register:08X}UL) & ~((uint32_t)0xFU << {shift}U)) | ((uint32_t){mode}U << {shift}U);\n"
                );
            }
            // A pin is an input while its latch is 1.
            Family::Mcs51 if !one.drives => {
                text += &format!("    {}\n", set(cpu, name, upper, one.pin, true))
            }
            Family::Mcs51 | Family::Host => {}
        }
    }
    text
}

/// The waits for the chips.
fn waits(request: &Request<'_>, upper: &str) -> String {
    let (cpu, name) = (request.cpu, &request.name);
    let hz = u64::from(cpu.clock_hz / cpu.clocks_per_cycle);
    let power_up = (hz * u64::from(request.timing.power_up_us)).div_ceil(1_000_000);
    let settle = settle(cpu, &request.timing);
    let (settle_body, power_up_body) = match cpu.family {
        Family::Host => (format!("    {name}_link_host_settle();\n"), String::new()),
        Family::Avr | Family::Mcs51 | Family::Stm32f1 => {
            (wait(cpu, settle), wait(cpu, loop_of(power_up)))
        }
    };
    format!(
        "\n/* Waits until the outputs of the chips have settled: {} ns at {} Hz, longer at a lower frequency. */\n\
         static inline void {name}_link_settle(void)\n{{\n{settle_body}}}\n\
         #ifndef {upper}_LINK_SETTLE\n#define {upper}_LINK_SETTLE() {name}_link_settle()\n#endif\n\
         \n/* Waits from the start of the CPU until the chips are in their initial states: {} us. Replace it if their supply starts later. */\n\
         static inline void {name}_link_wait_chips(void)\n{{\n{power_up_body}}}\n\
         #ifndef {upper}_LINK_WAIT_CHIPS\n#define {upper}_LINK_WAIT_CHIPS() {name}_link_wait_chips()\n#endif\n",
        request.timing.settle_ns, cpu.clock_hz, request.timing.power_up_us,
    )
}

/// The statements of a wait.
fn wait(cpu: &Cpu, wait: Wait) -> String {
    let nop = match cpu.family {
        Family::Mcs51 => "    __asm__(\"nop\");\n",
        Family::Avr | Family::Stm32f1 | Family::Host => "    __asm__ __volatile__(\"nop\");\n",
    };
    match wait {
        Wait::Nops(n) => (0..n).map(|_| nop).collect(),
        Wait::Loop(n) => {
            format!("    for (volatile uint32_t rest = {n}UL; rest != 0U; --rest) {{\n    }}\n")
        }
    }
}
