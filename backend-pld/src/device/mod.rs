//! Devices as data.
//!
//! There is one file per family. Each device lists its figures with their sources ([`Figure`]): the document in which a figure was read, or a note that it
//! was not verified. A fuse map is written only for devices whose map has a source ([`Device::layout`]), and a fit that uses a figure that was not verified reports
//! that.

mod atf;
mod bipolar;
mod cpld;
pub mod layout;
mod pal20;
mod ra10;
mod v10;
mod v8;

pub use layout::Layout;

/// The values of registered pins after power-up. All internal Q are 0; the value of the pin depends on the position of the polarity gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PowerUp {
    /// The polarity gate is before the flip-flop and an inverting buffer is after it: every registered pin is high, whatever its equation's polarity.
    PinsHigh,
    /// The polarity gate is after the flip-flop: low for an equation of the pin itself, high for one of its complement.
    ByPolarity,
}

/// The source of the flip-flops' clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Clock {
    /// Always this pin.
    Pin(u32),
    /// A product term for each macrocell.
    Term,
    /// The device has no flip-flops.
    None,
}

/// An output macrocell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Macrocell {
    /// Its pin.
    pub pin: u32,
    /// Product terms of a registered function; 0 if it has no flip-flop.
    pub registered_terms: u32,
    /// Product terms of a combinational function; 0 if it is always registered.
    pub combinational_terms: u32,
    /// The possible kinds of its flip-flop, if it has one.
    pub flip_flops: &'static [FlipFlop],
    /// True if one of its product terms can invert the sum (through an exclusive-or gate) while the term is true.
    pub has_xor: bool,
    /// Its logic block, from 0, on devices with logic blocks.
    pub block: u32,
}

/// How a flip-flop uses its input at the clock edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FlipFlop {
    /// It stores the input.
    D,
    /// It toggles if the input is 1.
    T,
}

/// Macrocells in blocks that are connected by a switch matrix.
#[derive(Debug, PartialEq, Eq)]
pub struct Blocks {
    /// The number of blocks.
    pub n_blocks: u32,
    /// The number of macrocells per block, including those without a pin.
    pub n_cells: u32,
    /// The number of signals that the switch matrix can bring into a block: pins, and functions of any block.
    pub fan_in: u32,
    /// The number of a macrocell's own product terms. A wider sum uses those of adjacent macrocells, which then have no function themselves.
    pub own_terms: u32,
}

/// One device.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Device {
    /// Its name here and in `GALasm` (there in upper case).
    pub name: &'static str,
    /// Its other names: of other manufacturers, of the PALs that it replaces, and in the languages.
    pub aliases: &'static [&'static str],
    /// Its name in PALASM.
    pub palasm: &'static str,
    /// Its mnemonic in CUPL.
    pub cupl: &'static str,
    /// The package, as named by the manufacturer.
    pub package: &'static str,
    /// The number of pins of the package.
    pub n_pins: u32,
    /// The ground pins, the main one first.
    pub grounds: &'static [u32],
    /// The pins of the supply voltages, the main one first.
    pub supplies: &'static [u32],
    /// Pins that are only inputs, without the clock pin.
    pub inputs: &'static [u32],
    /// The macrocells, by pin.
    pub macrocells: &'static [Macrocell],
    /// The source of the clock.
    pub clock: Clock,
    /// The pins that control all registered outputs: a low level enables or loads them. If the design has registers, these pins have no
    /// other function.
    pub control_pins: &'static [u32],
    /// Pins for programming the soldered device, which a design cannot use; the macrocells of these pins may contain functions
    /// without a pin.
    pub jtag_pins: &'static [u32],
    /// The logic blocks of a device with buried macrocells; `None`: every macrocell has a pin and every term can read every signal.
    pub blocks: Option<&'static Blocks>,
    /// The values of registered pins after power-up.
    pub power_up: PowerUp,
    /// Whether there is a synchronous preset and an asynchronous reset for all flip-flops.
    pub has_global_reset: bool,
    /// Pins of macrocells that product terms cannot read in a design without registers: on a PAL never, on a GAL if an output is read back or
    /// has an enable term (complex mode).
    pub deaf_pins: &'static [u32],
    /// True if a design without registers may use the clock and control pins as inputs.
    pub free_when_combinational: bool,
    /// The possible polarities of a sum.
    pub polarity: Polarity,
    /// The fuse map; `None` if no source was read, and then no fuse map is written.
    pub layout: Option<&'static Layout>,
    /// The device whose fuse map is written: some tables describe a GAL that replaces an old PAL.
    pub burned_as: &'static str,
    /// Its name in `GALasm`, or the name of the GAL that replaces it.
    pub galasm: &'static str,
    /// The parts with that fuse map, by their names in the programmer `minipro`: the usual one first. Only parts that public projects
    /// program with this map are listed.
    pub programmers: &'static [&'static str],
    /// The known figures of the device, with their sources.
    pub figures: &'static [Figure],
}

/// The possible polarities of the sums of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Polarity {
    /// Each macrocell has a polarity fuse.
    Programmable,
    /// The pin is the complement of the sum.
    ActiveLow,
    /// The pin is the sum.
    ActiveHigh,
}

/// A figure of a device with its source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Figure {
    /// The figure, in words.
    pub what: &'static str,
    /// The source.
    pub source: Source,
}

/// How reliable a figure is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// Read in this source.
    Read(&'static str),
    /// From memory of this source, not verified.
    Memory(&'static str),
}

const fn cell(pin: u32, registered_terms: u32, combinational_terms: u32) -> Macrocell {
    let flip_flops: &[FlipFlop] = if registered_terms == 0 { &[] } else { &[FlipFlop::D] };
    Macrocell { pin, registered_terms, combinational_terms, flip_flops, has_xor: false, block: 0 }
}

/// The supply pins of a dual in-line package: ground is the last pin of the first side, and the supply voltage is the last pin of all.
const DIP_20: (&[u32], &[u32]) = (&[10], &[20]);
const DIP_24: (&[u32], &[u32]) = (&[12], &[24]);

/// The families, the one with the default device first. Each lists its devices in its file.
const FAMILIES: [&[Device]; 6] =
    [v10::DEVICES, v8::DEVICES, ra10::DEVICES, atf::DEVICES, cpld::DEVICES, pal20::DEVICES];

const N_DEVICES: usize = {
    let (mut n, mut at) = (0, 0);
    while at < FAMILIES.len() {
        n += FAMILIES[at].len();
        at += 1;
    }
    n
};

static ALL: [Device; N_DEVICES] = {
    let mut all = [FAMILIES[0][0]; N_DEVICES];
    let (mut n, mut family) = (0, 0);
    while family < FAMILIES.len() {
        let mut at = 0;
        while at < FAMILIES[family].len() {
            all[n] = FAMILIES[family][at];
            n += 1;
            at += 1;
        }
        family += 1;
    }
    all
};

/// All devices, the default first.
pub static DEVICES: &[Device] = &ALL;

/// Shows only the name, because the tables are long and the name identifies them.
impl std::fmt::Debug for Device {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Device({})", self.name)
    }
}

impl Device {
    /// Its name with the indefinite article: `a gal16v8`, `an atf750c`.
    pub(crate) fn with_article(&self) -> String {
        let article = if self.name.starts_with(['a', 'e', 'i', 'o']) { "an" } else { "a" };
        format!("{article} {}", self.name)
    }

    /// The default device.
    #[must_use]
    pub fn default_device() -> &'static Device {
        &DEVICES[0]
    }

    /// The device with this name, or with another manufacturer's name for the same structure; not case-sensitive.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Device> {
        let name = name.to_ascii_lowercase();
        let is_named = |device: &&Device| {
            device.programmers.iter().any(|part| part.eq_ignore_ascii_case(&name))
                || device.name == name
                || device.cupl == name
                || device.palasm.eq_ignore_ascii_case(&name)
        };
        let has_alias = |device: &&Device| device.aliases.contains(&name.as_str());
        DEVICES.iter().find(has_alias).or_else(|| DEVICES.iter().find(is_named))
    }

    /// The part that a name identifies exactly, as `minipro` names it.
    #[must_use]
    pub fn part(&self, name: &str) -> Option<&'static str> {
        self.programmers.iter().copied().find(|part| part.eq_ignore_ascii_case(name))
    }

    /// All devices, each once.
    pub fn all() -> impl Iterator<Item = &'static Device> {
        DEVICES.iter()
    }

    /// All names that [`Device::find`] knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        let names = DEVICES.iter().map(|device| device.name);
        names.chain(DEVICES.iter().flat_map(|device| device.aliases.iter().copied()))
    }

    /// The macrocell of a pin.
    #[must_use]
    pub fn macrocell(&self, pin: u32) -> Option<&'static Macrocell> {
        self.macrocells.iter().find(|cell| cell.pin == pin)
    }

    /// True for ground and supply pins.
    #[must_use]
    pub fn is_supply(&self, pin: u32) -> bool {
        self.grounds.contains(&pin) || self.supplies.contains(&pin)
    }

    /// False if the fuse map is known and this pin has no column in any mode.
    #[must_use]
    pub fn can_read(&self, pin: u32) -> bool {
        self.layout.is_none_or(|layout| layout.modes.iter().any(|mode| mode.column(pin).is_some()))
    }

    /// The number of all macrocells, including those without a pin.
    #[must_use]
    pub fn n_cells(&self) -> usize {
        self.blocks
            .map_or(self.macrocells.len(), |blocks| (blocks.n_blocks * blocks.n_cells) as usize)
    }

    /// True if flip-flops can be of this kind.
    #[must_use]
    pub fn has_flip_flop(&self, kind: FlipFlop) -> bool {
        self.macrocells.iter().any(|cell| cell.flip_flops.contains(&kind))
    }

    /// True if a product can invert a sum.
    #[must_use]
    pub fn has_xor(&self) -> bool {
        self.macrocells.iter().any(|cell| cell.has_xor)
    }

    /// The figures that were not verified against a document.
    pub fn remembered(&self) -> impl Iterator<Item = &'static Figure> {
        self.figures.iter().filter(|figure| matches!(figure.source, Source::Memory(_)))
    }

    /// The value of a signal after power-up. `pin_inverted`: the pin carries its complement; `complemented`: the equation gives its complement.
    #[must_use]
    pub fn power_up_value(&self, pin_inverted: bool, complemented: bool) -> bool {
        match self.power_up {
            PowerUp::PinsHigh => !pin_inverted,
            // The pin is high if exactly one of `pin_inverted` and `complemented` is true; the signal is the pin or, if `pin_inverted`, its complement.
            PowerUp::ByPolarity => complemented,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Clock, DEVICES, Device, Macrocell, Source, layout};
    use std::collections::BTreeSet;

    #[test]
    fn every_pin_of_a_device_has_one_use() {
        for device in DEVICES {
            let mut pins: Vec<u32> =
                device.inputs.iter().chain(device.control_pins).copied().collect();
            pins.extend(device.macrocells.iter().map(|cell| cell.pin));
            pins.extend(device.grounds.iter().chain(device.supplies));
            if let Clock::Pin(pin) = device.clock {
                pins.push(pin);
            }
            pins.sort_unstable();
            assert_eq!(pins, (1..=device.n_pins).collect::<Vec<_>>(), "{}", device.name);
        }
    }

    #[test]
    fn packages_macrocells_and_figures_are_whole() {
        for device in DEVICES {
            let name = device.name;
            let n_pins: u32 =
                device.package.trim_start_matches(char::is_alphabetic).parse().unwrap();
            assert_eq!(n_pins, device.n_pins, "{name}");
            assert!(!device.grounds.is_empty() && !device.supplies.is_empty(), "{name}");
            if device.package.starts_with("DIP") {
                assert_eq!((device.grounds, device.supplies), (&[n_pins / 2][..], &[n_pins][..]));
            }
            for pin in device.jtag_pins {
                assert!(device.macrocell(*pin).is_some(), "{name} {pin}");
            }
            let n_terms = |cell: &Macrocell| cell.registered_terms.max(cell.combinational_terms);
            for cell in device.macrocells {
                assert!(n_terms(cell) > 0, "{name} {}", cell.pin);
                assert_eq!(cell.registered_terms > 0, !cell.flip_flops.is_empty(), "{name}");
            }
            match device.blocks {
                None => assert!(device.macrocells.iter().all(|cell| cell.block == 0), "{name}"),
                Some(blocks) => {
                    for block in 0..blocks.n_blocks {
                        let own = device.macrocells.iter().filter(|cell| cell.block == block);
                        assert!((1..=blocks.n_cells as usize).contains(&own.count()), "{name}");
                    }
                    let is_known = |cell: &Macrocell| cell.block < blocks.n_blocks;
                    assert!(device.macrocells.iter().all(is_known), "{name}");
                    let most = blocks.n_cells * blocks.own_terms;
                    assert!(device.macrocells.iter().all(|cell| n_terms(cell) <= most), "{name}");
                }
            }
            let has_registers = device.macrocells.iter().any(|cell| cell.registered_terms > 0);
            assert_eq!(has_registers, device.clock != Clock::None, "{name}");
            for figure in device.figures {
                let (Source::Read(text) | Source::Memory(text)) = figure.source;
                assert!(!figure.what.is_empty() && !text.is_empty(), "{name}");
            }
        }
        // Each has its own name in CUPL; the text is also written for the GALs that replace them.
        let own = DEVICES.iter().filter(|device| !device.name.contains("-as-"));
        let mut names: Vec<_> = own.map(|device| device.cupl).collect();
        let n_devices = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), n_devices);
    }

    #[test]
    fn other_makers_names_are_found() {
        assert_eq!(Device::find("ATF22V10").unwrap().name, "gal22v10");
        let names: BTreeSet<&str> = Device::names().collect();
        assert_eq!(names.len(), Device::names().count(), "a name is used twice");
        for device in DEVICES {
            let all = device.aliases.iter().chain([&device.name]);
            all.for_each(|name| assert_eq!(Device::find(name), Some(device), "{name}"));
        }
        let exact = Device::find("atf22v10cqz").unwrap();
        assert_eq!((exact.name, exact.part("atf22v10cqz")), ("gal22v10", Some("ATF22V10CQZ")));
        assert_eq!(exact.part("gal22v10"), None);
        assert_eq!(Device::find("gal42v13"), None);
        assert_eq!(Device::find("PAL16R8").unwrap().burned_as, "PAL16R8");
        assert_eq!(Device::find("pal16r8-as-gal16v8").unwrap().burned_as, "GAL16V8");
    }

    /// The fuse tables were typed by hand: each fuse of a map has one use, and each column of each mode has one signal.
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
                fuses.extend(cell.polarity.fuse());
                fuses.extend(cell.kind.and_then(layout::Setting::fuse));
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
                figure.what.contains("fuse") && matches!(figure.source, Source::Read(_))
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
