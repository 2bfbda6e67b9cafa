//! Devices as data.
//!
//! One file a family. Each device lists its figures with their sources ([`Figure`]): what was read, and where; what is remembered. A fuse map is
//! written only for devices whose map was read ([`Device::layout`]), and a fit that rests on a remembered figure says so.

mod atf;
pub mod layout;
mod pal20;
mod ra10;
mod v10;
mod v8;

pub use layout::Layout;

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
    /// It has no flip-flops.
    None,
}

/// An output macrocell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Macrocell {
    /// Its pin.
    pub pin: u32,
    /// Product terms of a registered function; 0: it has no flip-flop.
    pub registered_terms: u32,
    /// Product terms of a combinational function; 0: it is always registered.
    pub combinational_terms: u32,
}

/// One device.
#[derive(PartialEq, Eq)]
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
    /// Which polarities a sum can have.
    pub polarity: Polarity,
    /// Where its fuses lie; none where that was not read, and then no fuse map is written.
    pub layout: Option<&'static Layout>,
    /// The device whose fuse map is written: an old PAL is emulated by the GAL that takes its place.
    pub burned_as: &'static str,
    /// What the programmer `minipro` calls that, where it has it.
    pub programmer: Option<&'static str>,
    /// What is known of it, and whence.
    pub figures: &'static [Figure],
}

/// Which polarities the sums of a device can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Polarity {
    /// Each macrocell has a polarity fuse.
    Programmable,
    /// The pin is the complement of the sum.
    ActiveLow,
    /// The pin is the sum.
    ActiveHigh,
}

/// A figure of a device and where it comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Figure {
    /// What it says.
    pub what: &'static str,
    /// Where it comes from.
    pub source: Source,
}

/// How sure a figure is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Read there.
    Read(&'static str),
    /// Remembered from there, and not read again.
    Memory(&'static str),
}

const fn cell(pin: u32, registered_terms: u32, combinational_terms: u32) -> Macrocell {
    Macrocell { pin, registered_terms, combinational_terms }
}

/// All devices, the default first.
pub static DEVICES: &[Device] = &[
    v10::GAL22V10,
    v8::GAL16V8,
    v8::GAL20V8,
    ra10::GAL20RA10,
    atf::ATF750C,
    pal20::PAL16L8,
    pal20::PAL16R4,
    pal20::PAL16R6,
    pal20::PAL16R8,
    pal20::PAL10H8,
    pal20::PAL12H6,
    pal20::PAL14H4,
    pal20::PAL16H2,
    pal20::PAL10L8,
    pal20::PAL12L6,
    pal20::PAL14L4,
    pal20::PAL16L2,
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
    ("atf750", "atf750c"),
    ("v750", "atf750c"),
    ("pal20l8", "gal20v8"),
    ("pal20r4", "gal20v8"),
    ("pal20r6", "gal20v8"),
    ("pal20r8", "gal20v8"),
];

/// Tables are long, and the name says which they are.
impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Device({})", self.name)
    }
}

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
        let is_named = |device: &&Device| {
            device.name == name || device.cupl == name || device.palasm.eq_ignore_ascii_case(name)
        };
        DEVICES.iter().find(is_named)
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

    /// The figures that are remembered and were not read.
    pub fn remembered(&self) -> impl Iterator<Item = &'static Figure> {
        self.figures.iter().filter(|figure| matches!(figure.source, Source::Memory(_)))
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
        assert_eq!(Device::find("PAL16R8").unwrap().burned_as, "GAL16V8");
    }

    /// The tables of fuses are typed in by hand: each fuse of a map has one use, and each column of each mode one signal.
    #[test]
    fn every_fuse_and_column_has_one_use() {
        for device in DEVICES {
            let Some(layout) = device.layout else { continue };
            let mut rows: Vec<u32> =
                layout.cells.iter().flat_map(|cell| cell.row..cell.row + cell.n_rows).collect();
            rows.extend(layout.async_reset.iter().chain(&layout.sync_preset));
            rows.sort_unstable();
            assert_eq!(rows, (0..layout.n_rows()).collect::<Vec<_>>(), "{}", device.name);
            let mut fuses: Vec<u32> = (0..layout.n_rows() * layout.n_columns).collect();
            for cell in layout.cells {
                fuses.push(cell.polarity);
                fuses.extend(cell.kind);
            }
            fuses.extend(layout.signature.iter().flat_map(|first| *first..first + 64));
            fuses.extend(
                layout.row_switches.iter().flat_map(|first| *first..first + layout.n_rows()),
            );
            fuses.extend(layout.modes[0].fuses.iter().map(|(fuse, _)| *fuse));
            fuses.sort_unstable();
            assert_eq!(fuses, (0..layout.n_fuses).collect::<Vec<_>>(), "{}", device.name);
            for mode in layout.modes {
                let mut columns: Vec<u32> =
                    mode.columns.iter().flat_map(|(_, column)| [*column, column + 1]).collect();
                columns.sort_unstable();
                assert_eq!(columns, (0..layout.n_columns).collect::<Vec<_>>(), "{}", mode.name);
                let readable = |pin: &u32| mode.column(*pin).is_some();
                assert!(!mode.deaf.iter().any(readable), "{} {}", device.name, mode.name);
            }
        }
    }

    #[test]
    fn a_map_is_read_and_every_device_says_whence_its_figures_are() {
        for device in DEVICES {
            assert!(!device.figures.is_empty(), "{}", device.name);
            let read = |figure: &super::Figure| {
                figure.what.contains("fuse") && matches!(figure.source, super::Source::Read(_))
            };
            assert_eq!(device.layout.is_some(), device.figures.iter().any(read), "{}", device.name);
            for cell in device.macrocells {
                if let Some(fuses) = device.layout.and_then(|layout| layout.cell(cell.pin)) {
                    assert!(cell.registered_terms.max(cell.combinational_terms) <= fuses.n_rows);
                }
            }
        }
    }
}
