//! The registers of a CPU that set and read its pins, as far as a link uses them.

use super::board::Board;
use grafsynth_split::cpu::{Cpu, Family, Pin};
use std::collections::BTreeMap;

/// `RCC_APB2ENR` of an STM32F1: bit 2 is the clock of port A.
const STM32_CLOCKS: u32 = 0x4002_1018;
/// The first register of port A of an STM32F1; the ports are 0x400 apart.
const STM32_PORTS: u32 = 0x4001_0800;

/// The registers with their values.
pub(super) struct Registers {
    cpu: &'static Cpu,
    values: BTreeMap<u32, u32>,
}

/// The number of a register of an AVR in messages: the letter of the port, and 0 for PORT, 1 for DDR, 2 for PIN.
fn avr(port: char, which: u32) -> u32 {
    u32::from(port) << 8 | which
}

impl Registers {
    /// All registers after reset.
    pub(super) fn new(cpu: &'static Cpu) -> Self {
        Registers { cpu, values: BTreeMap::new() }
    }

    fn value(&self, at: u32) -> u32 {
        let own = self.values.get(&at).copied();
        own.unwrap_or(match (self.cpu.family, at.wrapping_sub(STM32_PORTS) & 0x3ff) {
            // CRL and CRH: all pins are inputs without a resistor.
            (Family::Stm32f1, 0 | 4) if at != STM32_CLOCKS => 0x4444_4444,
            _ => 0,
        })
    }

    fn pins_of(&self, port: char) -> impl Iterator<Item = Pin> + use<> {
        let mut pins: Vec<Pin> =
            self.cpu.pins.iter().filter(|pin| pin.port == port).copied().collect();
        pins.sort_unstable_by_key(|pin| pin.bit);
        pins.into_iter()
    }

    /// The CPU writes a register; the pins follow.
    pub(super) fn write(&mut self, at: u32, value: u32, board: &mut Board<'_>) {
        match self.cpu.family {
            Family::Host => board.set(at, Some(value != 0)),
            Family::Avr => {
                self.values.insert(at, value);
                let Some(port) = char::from_u32(at >> 8) else { return };
                let (levels, directions) = (self.value(avr(port, 0)), self.value(avr(port, 1)));
                for pin in self.pins_of(port) {
                    let is_output = directions >> pin.bit & 1 == 1;
                    board.set(pin.number, is_output.then_some(levels >> pin.bit & 1 == 1));
                }
            }
            Family::Stm32f1 => self.write_stm32(at, value, board),
            Family::Mcs51 => {}
        }
    }

    fn write_stm32(&mut self, at: u32, value: u32, board: &mut Board<'_>) {
        if at == STM32_CLOCKS {
            self.values.insert(at, value);
            return;
        }
        let Some((base, port)) = stm32_port(at) else { return };
        let bit = 2 + (base - STM32_PORTS) / 0x400;
        if self.value(STM32_CLOCKS) >> bit & 1 == 0 {
            let message =
                format!("a register of port {port} is written before the port has a clock");
            board.trouble.get_or_insert(message);
            return;
        }
        // BSRR changes the levels, which are stored as ODR.
        if at - base == 0x10 {
            let levels = (self.value(base + 0x0c) & !(value >> 16)) | value & 0xffff;
            self.values.insert(base + 0x0c, levels);
        } else {
            self.values.insert(at, value);
        }
        let levels = self.value(base + 0x0c);
        for pin in self.pins_of(port) {
            let modes = self.value(base + if pin.bit < 8 { 0 } else { 4 });
            // The two lower bits of a mode are 0 for an input; the upper ones are 0 for an output that drives both levels.
            let mode = modes >> (4 * (pin.bit % 8)) & 0xf;
            let is_output = mode & 3 != 0 && mode >> 2 == 0;
            board.set(pin.number, is_output.then_some(levels >> pin.bit & 1 == 1));
        }
    }

    /// The CPU reads a register.
    pub(super) fn read(&self, at: u32, board: &mut Board<'_>) -> u32 {
        match self.cpu.family {
            Family::Host => u32::from(board.level(at)),
            Family::Avr => match char::from_u32(at >> 8) {
                Some(port) if at & 0xff == 2 => self.levels(port, board),
                _ => self.value(at),
            },
            Family::Stm32f1 => match stm32_port(at) {
                Some((base, port)) if at - base == 0x08 => self.levels(port, board),
                // BSRR cannot be read.
                Some((base, _)) if at - base == 0x10 => 0,
                _ => self.value(at),
            },
            Family::Mcs51 => 0,
        }
    }

    /// The levels at the pins of a port.
    fn levels(&self, port: char, board: &mut Board<'_>) -> u32 {
        let wired = self.pins_of(port);
        wired.fold(0, |levels, pin| levels | u32::from(board.level(pin.number)) << pin.bit)
    }
}

/// The base address and the letter of the port that has this register.
fn stm32_port(at: u32) -> Option<(u32, char)> {
    let index = at.checked_sub(STM32_PORTS)? / 0x400;
    let letter =
        char::from_u32(u32::from('A') + index).filter(|letter| ('A'..='G').contains(letter))?;
    Some((STM32_PORTS + index * 0x400, letter))
}
