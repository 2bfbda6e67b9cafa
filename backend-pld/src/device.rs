//! Devices as data.
//!
//! The figures of the four GALs are those of the Lattice data sheets GAL16V8, GAL20V8, GAL22V10 and GAL20RA10; the structure was read from open
//! assemblers' device tables, the power-up sentences are from memory of the data sheets' "power-up reset" paragraph and agree with fuse-level
//! simulators.

/// What the pins of the flip-flops show after power-up. All internal Q are 0 then; what the pin shows is a matter of where the polarity gate sits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PowerUp {
    /// The polarity gate comes before the flip-flop and an inverting buffer after it: every registered pin is high, whatever its equation's polarity.
    PinsHigh,
    /// The polarity gate comes after the flip-flop: low for an equation of the pin itself, high for one of its complement.
    ByPolarity,
}

/// Where the flip-flops' clock comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Clock {
    /// Always this pin.
    Pin(u32),
    /// A product term for each macrocell.
    Term,
}

/// An output macrocell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Macrocell {
    /// Its pin.
    pub pin: u32,
    /// Product terms of a registered function.
    pub registered_terms: u32,
    /// Product terms of a combinational function.
    pub combinational_terms: u32,
}

/// One device.
#[derive(Debug, PartialEq, Eq)]
pub struct Device {
    /// Its name here and in `GALasm` (there in capitals).
    pub name: &'static str,
    /// Its name in PALASM.
    pub palasm: &'static str,
    /// Its mnemonic in CUPL.
    pub cupl: &'static str,
    /// The number of pins of the package.
    pub n_pins: u32,
    /// Pins that are only inputs, the clock pin not among them.
    pub inputs: &'static [u32],
    /// The macrocells, by pin.
    pub macrocells: &'static [Macrocell],
    /// Where the clock comes from.
    pub clock: Clock,
    /// The pin that enables all registered outputs (low) or loads them, and serves nothing else once there are registers.
    pub control_pins: &'static [u32],
    /// What registered pins show after power-up.
    pub power_up: PowerUp,
    /// A synchronous preset and an asynchronous reset for all flip-flops.
    pub has_global_reset: bool,
    /// Macrocells whose pin cannot be read back in a chip without registers as soon as another pin is.
    pub deaf_pins: &'static [u32],
    /// A chip without registers may use the clock and control pins as inputs.
    pub free_when_combinational: bool,
}

const fn cell(pin: u32, registered_terms: u32, combinational_terms: u32) -> Macrocell {
    Macrocell { pin, registered_terms, combinational_terms }
}

/// All devices, the default first.
pub const DEVICES: &[Device] = &[
    Device {
        name: "gal22v10",
        palasm: "PAL22V10",
        cupl: "g22v10",
        n_pins: 24,
        inputs: &[2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 13],
        macrocells: &[
            cell(14, 8, 8),
            cell(15, 10, 10),
            cell(16, 12, 12),
            cell(17, 14, 14),
            cell(18, 16, 16),
            cell(19, 16, 16),
            cell(20, 14, 14),
            cell(21, 12, 12),
            cell(22, 10, 10),
            cell(23, 8, 8),
        ],
        clock: Clock::Pin(1),
        control_pins: &[],
        power_up: PowerUp::ByPolarity,
        has_global_reset: true,
        deaf_pins: &[],
        free_when_combinational: true,
    },
    Device {
        name: "gal16v8",
        palasm: "PALCE16V8",
        cupl: "g16v8",
        n_pins: 20,
        inputs: &[2, 3, 4, 5, 6, 7, 8, 9],
        macrocells: &[
            cell(12, 8, 7),
            cell(13, 8, 7),
            cell(14, 8, 7),
            cell(15, 8, 7),
            cell(16, 8, 7),
            cell(17, 8, 7),
            cell(18, 8, 7),
            cell(19, 8, 7),
        ],
        clock: Clock::Pin(1),
        control_pins: &[11],
        power_up: PowerUp::PinsHigh,
        has_global_reset: false,
        deaf_pins: &[12, 19],
        free_when_combinational: true,
    },
    Device {
        name: "gal20v8",
        palasm: "PALCE20V8",
        cupl: "g20v8",
        n_pins: 24,
        inputs: &[2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 14, 23],
        macrocells: &[
            cell(15, 8, 7),
            cell(16, 8, 7),
            cell(17, 8, 7),
            cell(18, 8, 7),
            cell(19, 8, 7),
            cell(20, 8, 7),
            cell(21, 8, 7),
            cell(22, 8, 7),
        ],
        clock: Clock::Pin(1),
        control_pins: &[13],
        power_up: PowerUp::PinsHigh,
        has_global_reset: false,
        deaf_pins: &[15, 22],
        free_when_combinational: true,
    },
    Device {
        name: "gal20ra10",
        palasm: "PAL20RA10",
        cupl: "p20ra10",
        n_pins: 24,
        inputs: &[2, 3, 4, 5, 6, 7, 8, 9, 10, 11],
        macrocells: &[
            cell(14, 4, 4),
            cell(15, 4, 4),
            cell(16, 4, 4),
            cell(17, 4, 4),
            cell(18, 4, 4),
            cell(19, 4, 4),
            cell(20, 4, 4),
            cell(21, 4, 4),
            cell(22, 4, 4),
            cell(23, 4, 4),
        ],
        clock: Clock::Term,
        control_pins: &[1, 13],
        power_up: PowerUp::ByPolarity,
        has_global_reset: false,
        deaf_pins: &[],
        free_when_combinational: false,
    },
];

/// Other names of the same structure: of other makers, of the PALs that the GALs replace, and of the languages.
const ALIASES: &[(&str, &str)] = &[
    ("pal22v10", "gal22v10"),
    ("palce22v10", "gal22v10"),
    ("ampal22v10", "gal22v10"),
    ("atf22v10", "gal22v10"),
    ("atf22v10c", "gal22v10"),
    ("g22v10", "gal22v10"),
    ("p22v10", "gal22v10"),
    ("palce16v8", "gal16v8"),
    ("atf16v8", "gal16v8"),
    ("atf16v8b", "gal16v8"),
    ("g16v8", "gal16v8"),
    ("g16v8a", "gal16v8"),
    ("g16v8ms", "gal16v8"),
    ("g16v8ma", "gal16v8"),
    ("g16v8s", "gal16v8"),
    ("palce20v8", "gal20v8"),
    ("atf20v8", "gal20v8"),
    ("g20v8", "gal20v8"),
    ("g20v8a", "gal20v8"),
    ("g20v8ms", "gal20v8"),
    ("g20v8ma", "gal20v8"),
    ("pal20ra10", "gal20ra10"),
    ("palce20ra10", "gal20ra10"),
    ("p20ra10", "gal20ra10"),
    ("pal16l8", "gal16v8"),
    ("pal16r4", "gal16v8"),
    ("pal16r6", "gal16v8"),
    ("pal16r8", "gal16v8"),
    ("pal20l8", "gal20v8"),
    ("pal20r4", "gal20v8"),
    ("pal20r6", "gal20v8"),
    ("pal20r8", "gal20v8"),
];

impl Device {
    /// The device taken when none is named.
    #[must_use]
    pub fn default_device() -> &'static Device {
        &DEVICES[0]
    }

    /// The device of this name, or of another maker's name for the same structure; letter case does not matter.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Device> {
        let name = name.to_ascii_lowercase();
        let name =
            ALIASES.iter().find(|(alias, _)| *alias == name).map_or(name.as_str(), |(_, own)| own);
        DEVICES.iter().find(|device| device.name == name)
    }

    /// All names that [`Device::find`] knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        DEVICES.iter().map(|device| device.name).chain(ALIASES.iter().map(|(alias, _)| *alias))
    }

    /// The macrocell of a pin.
    #[must_use]
    pub fn macrocell(&self, pin: u32) -> Option<&'static Macrocell> {
        self.macrocells.iter().find(|cell| cell.pin == pin)
    }

    /// The pin of the ground connection; the supply is the last pin.
    #[must_use]
    pub fn gnd(&self) -> u32 {
        self.n_pins / 2
    }

    /// What a signal shows after power-up. `pin_inverted`: the pin carries its complement; `complemented`: the equation gives its complement.
    #[must_use]
    pub fn power_up_value(&self, pin_inverted: bool, complemented: bool) -> bool {
        match self.power_up {
            PowerUp::PinsHigh => !pin_inverted,
            // The gate inverts relative to the pin exactly if one of both holds; the pin is then high, and the signal is the pin or its complement.
            PowerUp::ByPolarity => complemented,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Clock, DEVICES, Device};

    #[test]
    fn every_pin_of_a_device_has_one_use() {
        for device in DEVICES {
            let mut pins: Vec<u32> =
                device.inputs.iter().chain(device.control_pins).copied().collect();
            pins.extend(device.macrocells.iter().map(|cell| cell.pin));
            pins.extend([device.gnd(), device.n_pins]);
            if let Clock::Pin(pin) = device.clock {
                pins.push(pin);
            }
            pins.sort_unstable();
            assert_eq!(pins, (1..=device.n_pins).collect::<Vec<_>>(), "{}", device.name);
        }
    }

    #[test]
    fn other_makers_names_are_found() {
        assert_eq!(Device::find("ATF22V10").unwrap().name, "gal22v10");
        assert!(Device::names().all(|name| Device::find(name).is_some()));
        assert_eq!(Device::find("gal42v13"), None);
    }
}
