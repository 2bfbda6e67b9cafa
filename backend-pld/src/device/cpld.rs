//! ATF1502, ATF1504 and ATF1508: 32, 64 and 128 macrocells in logic blocks of sixteen. Equations only: the placement of functions is checked; the
//! routing of signals through the switch matrix, and the fuses, are left to the manufacturer's fitter.

use super::{Blocks, Clock, Device, Figure, FlipFlop, Macrocell, Polarity, PowerUp, Source};

/// The devices of this file.
pub(super) const DEVICES: &[Device] = &[
    ATF1502_PLCC44,
    ATF1502_TQFP44,
    ATF1504_PLCC44,
    ATF1504_TQFP44,
    ATF1504_PLCC84,
    ATF1508_PLCC84,
];

const BSDL: &str =
    "boundary scan descriptions of the manufacturer (BSDL), in whitequark's prjbureau";

const FIGURES: &[Figure] = &[
    Figure { what: "pins, supplies, JTAG pins, macrocell of each pin", source: Source::Read(BSDL) },
    Figure {
        what: "five product terms per macrocell, at most 40 with those of others; D, T or latch",
        source: Source::Read("Atmel data sheets 0995, 0950 and 0784, features"),
    },
    Figure {
        what: "blocks of 16 macrocells, buried functions, cascade, foldback terms (not used here)",
        source: Source::Read("Microchip, ATF15xx fitter user guide, sections 1 to 1.3 and 1.7"),
    },
    Figure {
        what: "40 multiplexers bring signals into a block, each selecting one of a few",
        source: Source::Read("prjbureau, interconnect multiplexers of the ATF1502AS"),
    },
    Figure {
        what: "exclusive-or of the sum with a term or with the flip-flop, before the flip-flop",
        source: Source::Read("prjbureau, schema of macrocell options: xor_a_mux, xor_b_mux"),
    },
    Figure {
        what: "0 after power-up, or 1 if the function is inverted: one switch controls both",
        source: Source::Read("prjbureau, schema (reset, xor_invert) and fuzzer o_inv"),
    },
    Figure {
        what: "a wide sum uses whole macrocells in addition to its own",
        source: Source::Memory("Atmel data sheet ATF1504AS, cascade logic"),
    },
    Figure {
        what: "the manufacturer's fitter inverts the functions that the text inverts, so that the power-up values match the text",
        source: Source::Memory("Atmel fitter, option Optimize"),
    },
];

/// A macrocell with a pin.
const fn with_pin(pin: u32, block: u32) -> Macrocell {
    Macrocell {
        pin,
        registered_terms: 40,
        combinational_terms: 40,
        flip_flops: &[FlipFlop::D, FlipFlop::T],
        has_xor: true,
        block,
    }
}

/// The `N` macrocells with a pin; the pins of each block follow those of the previous one, and a 0 ends a block.
const fn cells<const N: usize>(pins: &[u32]) -> [Macrocell; N] {
    let mut cells = [with_pin(0, 0); N];
    let (mut at, mut made, mut block) = (0, 0, 0);
    while at < pins.len() {
        if pins[at] == 0 {
            block += 1;
        } else {
            cells[made] = with_pin(pins[at], block);
            made += 1;
        }
        at += 1;
    }
    cells
}

static OF_1502_PLCC44: [Macrocell; 32] = cells(&[
    4, 5, 6, 7, 8, 9, 11, 12, 13, 14, 16, 17, 18, 19, 20, 21, 0, //
    24, 25, 26, 27, 28, 29, 31, 32, 33, 34, 36, 37, 38, 39, 40, 41,
]);
static OF_1502_TQFP44: [Macrocell; 32] = cells(&[
    42, 43, 44, 1, 2, 3, 5, 6, 7, 8, 10, 11, 12, 13, 14, 15, 0, //
    18, 19, 20, 21, 22, 23, 25, 26, 27, 28, 30, 31, 32, 33, 34, 35,
]);
static OF_1504_PLCC44: [Macrocell; 32] = cells(&[
    4, 5, 6, 7, 8, 9, 11, 12, 0, //
    13, 14, 16, 17, 18, 19, 20, 21, 0, //
    24, 25, 26, 27, 28, 29, 31, 32, 0, //
    33, 34, 36, 37, 38, 39, 40, 41,
]);
static OF_1504_TQFP44: [Macrocell; 32] = cells(&[
    42, 43, 44, 1, 2, 3, 5, 6, 0, //
    7, 8, 10, 11, 12, 13, 14, 15, 0, //
    18, 19, 20, 21, 22, 23, 25, 26, 0, //
    27, 28, 30, 31, 32, 33, 34, 35,
]);
static OF_1504_PLCC84: [Macrocell; 64] = cells(&[
    4, 5, 6, 8, 9, 10, 11, 12, 14, 15, 16, 17, 18, 20, 21, 22, 0, //
    23, 24, 25, 27, 28, 29, 30, 31, 33, 34, 35, 36, 37, 39, 40, 41, 0, //
    44, 45, 46, 48, 49, 50, 51, 52, 54, 55, 56, 57, 58, 60, 61, 62, 0, //
    63, 64, 65, 67, 68, 69, 70, 71, 73, 74, 75, 76, 77, 79, 80, 81,
]);
static OF_1508_PLCC84: [Macrocell; 64] = cells(&[
    4, 5, 6, 8, 9, 10, 11, 12, 0, //
    14, 15, 16, 17, 18, 20, 21, 22, 0, //
    23, 24, 25, 27, 28, 29, 30, 31, 0, //
    33, 34, 35, 36, 37, 39, 40, 41, 0, //
    44, 45, 46, 48, 49, 50, 51, 52, 0, //
    54, 55, 56, 57, 58, 60, 61, 62, 0, //
    63, 64, 65, 67, 68, 69, 70, 71, 0, //
    73, 74, 75, 76, 77, 79, 80, 81,
]);

const fn blocks(n_blocks: u32) -> Blocks {
    Blocks { n_blocks, n_cells: 16, fan_in: 40, own_terms: 5 }
}

static TWO: Blocks = blocks(2);
static FOUR: Blocks = blocks(4);
static EIGHT: Blocks = blocks(8);

/// A package: its dedicated pins. If several are clocks, the first global clock is used.
struct Package {
    name: &'static str,
    n_pins: u32,
    /// GCLR, OE1, and OE2, which is also the second clock.
    inputs: &'static [u32],
    clock: u32,
    grounds: &'static [u32],
    supplies: &'static [u32],
    /// TDI, TMS, TCK, TDO.
    jtag: &'static [u32],
}

const PLCC44: Package = Package {
    name: "PLCC44",
    n_pins: 44,
    inputs: &[1, 2, 44],
    clock: 43,
    grounds: &[10, 22, 30, 42],
    supplies: &[3, 15, 23, 35],
    jtag: &[7, 13, 32, 38],
};
const TQFP44: Package = Package {
    name: "TQFP44",
    n_pins: 44,
    inputs: &[38, 39, 40],
    clock: 37,
    grounds: &[4, 16, 24, 36],
    supplies: &[9, 17, 29, 41],
    jtag: &[1, 7, 26, 32],
};
const PLCC84: Package = Package {
    name: "PLCC84",
    n_pins: 84,
    inputs: &[1, 2, 84],
    clock: 83,
    grounds: &[7, 19, 32, 42, 47, 59, 72, 82],
    supplies: &[3, 13, 26, 38, 43, 53, 66, 78],
    jtag: &[14, 23, 62, 71],
};

/// A device. Its names are, in this order: our own, that in PALASM, that of the chip, and that in CUPL.
const fn device(
    [name, palasm, chip, cupl]: [&'static str; 4],
    aliases: &'static [&'static str],
    package: &Package,
    macrocells: &'static [Macrocell],
    blocks: &'static Blocks,
) -> Device {
    Device {
        name,
        aliases,
        palasm,
        cupl,
        package: package.name,
        n_pins: package.n_pins,
        grounds: package.grounds,
        supplies: package.supplies,
        inputs: package.inputs,
        macrocells,
        clock: Clock::Pin(package.clock),
        control_pins: &[],
        jtag_pins: package.jtag,
        blocks: Some(blocks),
        power_up: PowerUp::ByPolarity,
        has_global_reset: false,
        deaf_pins: &[],
        free_when_combinational: true,
        polarity: Polarity::Programmable,
        layout: None,
        burned_as: chip,
        galasm: chip,
        programmers: &[],
        figures: FIGURES,
    }
}

const ATF1502_PLCC44: Device = device(
    ["atf1502-plcc44", "ATF1502PLCC44", "ATF1502AS", "f1502ispplcc44"],
    &["atf1502", "atf1502as", "atf1502asl", "atf1502asv", "f1502plcc44"],
    &PLCC44,
    &OF_1502_PLCC44,
    &TWO,
);
const ATF1502_TQFP44: Device = device(
    ["atf1502-tqfp44", "ATF1502TQFP44", "ATF1502AS", "f1502isptqfp44"],
    &["f1502tqfp44"],
    &TQFP44,
    &OF_1502_TQFP44,
    &TWO,
);
const ATF1504_PLCC44: Device = device(
    ["atf1504-plcc44", "ATF1504PLCC44", "ATF1504AS", "f1504ispplcc44"],
    &["atf1504", "atf1504as", "atf1504asl", "atf1504asv", "f1504plcc44"],
    &PLCC44,
    &OF_1504_PLCC44,
    &FOUR,
);
const ATF1504_TQFP44: Device = device(
    ["atf1504-tqfp44", "ATF1504TQFP44", "ATF1504AS", "f1504isptqfp44"],
    &["f1504tqfp44"],
    &TQFP44,
    &OF_1504_TQFP44,
    &FOUR,
);
const ATF1504_PLCC84: Device = device(
    ["atf1504-plcc84", "ATF1504PLCC84", "ATF1504AS", "f1504ispplcc84"],
    &["f1504plcc84"],
    &PLCC84,
    &OF_1504_PLCC84,
    &FOUR,
);
const ATF1508_PLCC84: Device = device(
    ["atf1508-plcc84", "ATF1508PLCC84", "ATF1508AS", "f1508ispplcc84"],
    &["atf1508", "atf1508as", "atf1508asl", "atf1508asv", "f1508plcc84"],
    &PLCC84,
    &OF_1508_PLCC84,
    &EIGHT,
);
