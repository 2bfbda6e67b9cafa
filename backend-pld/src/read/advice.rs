//! Help texts for mistakes, in the syntax of the language in which they were made.

use crate::Dialect;
use crate::device::Device;
use grafsynth_ir::diag::joined;

/// The pins in ascending order, neighbours as ranges: `12 to 19`, `1, 3 and 5 to 8`.
pub(crate) fn pin_list(pins: impl IntoIterator<Item = u32>) -> String {
    let mut pins: Vec<u32> = pins.into_iter().collect();
    pins.sort_unstable();
    let mut ranges: Vec<(u32, u32)> = Vec::new();
    for pin in pins {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 >= pin => *last = pin,
            _ => ranges.push((pin, pin)),
        }
    }
    let shown: Vec<String> = ranges
        .into_iter()
        .map(|(first, last)| match last - first {
            0 => first.to_string(),
            1 => format!("{first}, {last}"),
            _ => format!("{first} to {last}"),
        })
        .collect();
    joined(&shown, "and")
}

/// The pins of a device that can be outputs.
pub(crate) fn outputs(device: &Device) -> String {
    pin_list(device.macrocells.iter().map(|cell| cell.pin))
}

impl Dialect {
    /// Says how to declare a name that is read without a declaration.
    pub(crate) fn declare(self, name: &str) -> String {
        match self {
            Dialect::Palasm | Dialect::Galasm => {
                format!("add `{name}` to the pins, or use the name of a pin")
            }
            Dialect::Cupl => {
                format!("declare it with `PIN = {name} ;`, or give it an equation: `{name} = .. ;`")
            }
            Dialect::Verilog => {
                format!("declare it as an input, or write `wire {name} = ..;`")
            }
            Dialect::Blif => format!("add it to `.inputs`, or give it a table: `.names .. {name}`"),
        }
    }

    /// Says how to give a declared signal a function.
    pub(crate) fn define(self, name: &str) -> String {
        match self {
            Dialect::Palasm | Dialect::Galasm => format!("write its equation: `{name} = ..`"),
            Dialect::Cupl => format!("write its equation: `{name} = .. ;`"),
            Dialect::Verilog => {
                format!("write `assign {name} = ..;`, or assign it in a clocked block")
            }
            Dialect::Blif => {
                format!("give it a table, `.names .. {name}`, or a register, `.latch .. {name}`")
            }
        }
    }

    /// Says how to combine two functions of one signal.
    pub(crate) fn combine(self, name: &str) -> String {
        match self {
            Dialect::Palasm | Dialect::Galasm => {
                format!(
                    "write one equation with the terms of both, joined by `+`, or give one of them a name other than `{name}`"
                )
            }
            Dialect::Cupl => {
                format!(
                    "write `APPEND {name} = ..` for the second, which joins both with `#`, or remove one of them"
                )
            }
            Dialect::Verilog | Dialect::Blif => {
                format!("remove one of them, or give it a name other than `{name}`")
            }
        }
    }

    /// How registers get their initial values.
    pub(crate) fn first_values(self, first: &str, n_registers: usize) -> String {
        match (self, n_registers) {
            (Dialect::Blif, 1) => "write the value, 0 or 1, at the end of the `.latch`".to_owned(),
            (Dialect::Blif, _) => {
                "write the value, 0 or 1, at the end of the line of each `.latch`".to_owned()
            }
            (_, 1) => format!("write `initial {first} = 1'b0;`, or 1'b1"),
            _ => format!("give each of them one, as in `initial {first} = 1'b0;`"),
        }
    }
}
