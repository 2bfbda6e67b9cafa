//! The findings of fuse maps and JEDEC files (`G0780` to `G0799`).

use grafsynth_ir::Code;

/// The tables do not have the fuse map of a device.
pub const NO_FUSE_MAP: Code = Code { id: "G0780", title: "fuse map that is not known" };
/// The design needs something that the device does not have.
pub const CANNOT_HOLD: Code =
    Code { id: "G0781", title: "macrocell that the device does not have" };
/// The fuses choose a configuration that no data sheet describes.
pub const UNDOCUMENTED: Code = Code { id: "G0782", title: "fuses without a documented meaning" };
/// Not a single synchronous circuit.
pub const NOT_SYNCHRONOUS: Code = Code { id: "G0783", title: "device with more than one clock" };
/// The levels never come to rest.
pub const NOT_SETTLING: Code = Code { id: "G0784", title: "device whose levels do not settle" };
/// The file does not follow JEDEC 3.
pub const SYNTAX: Code = Code { id: "G0785", title: "JEDEC file that does not parse" };
/// A checksum differs.
pub const CHECKSUM: Code = Code { id: "G0786", title: "checksum that does not agree" };
/// The number of fuses or pins is that of no device in the tables.
pub const UNKNOWN_SIZE: Code = Code { id: "G0787", title: "fuse count of no known device" };
/// A field that is read over.
pub const PASSED_OVER: Code = Code { id: "G0788", title: "JEDEC field that is passed over" };
/// Two readings of our own fuse map differ.
pub const NOT_AS_MEANT: Code = Code { id: "G0789", title: "fuse map that says something else" };
/// The device's own simulator and the test vectors of a file differ.
pub const VECTOR_FAILS: Code = Code { id: "G0790", title: "test vector that fails" };
/// Several devices have as many fuses, and the file names none.
pub const SEVERAL_DEVICES: Code = Code { id: "G0791", title: "fuse count of several devices" };

/// All of them.
pub const ALL: &[Code] = &[
    NO_FUSE_MAP,
    CANNOT_HOLD,
    UNDOCUMENTED,
    NOT_SYNCHRONOUS,
    NOT_SETTLING,
    SYNTAX,
    CHECKSUM,
    UNKNOWN_SIZE,
    PASSED_OVER,
    NOT_AS_MEANT,
    VECTOR_FAILS,
    SEVERAL_DEVICES,
];
