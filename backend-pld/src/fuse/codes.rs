//! The findings of fuse maps and JEDEC files (`G0780` to `G0799`).

use grafsynth_ir::Code;

/// The fuse map of the device is unknown.
pub const NO_FUSE_MAP: Code = Code { id: "G0780", title: "unknown fuse map" };
/// The design needs something that the device does not have.
pub const CANNOT_HOLD: Code = Code { id: "G0781", title: "equation without a suitable macrocell" };
/// The fuses select a configuration that no data sheet describes.
pub const UNDOCUMENTED: Code = Code { id: "G0782", title: "undocumented fuse setting" };
/// The programmed device is not a single synchronous circuit.
pub const NOT_SYNCHRONOUS: Code =
    Code { id: "G0783", title: "device that is not a single-clock circuit" };
/// The levels never settle.
pub const NOT_SETTLING: Code = Code { id: "G0784", title: "unstable combinational output" };
/// The file does not follow the standard JESD3-C.
pub const SYNTAX: Code = Code { id: "G0785", title: "syntax error in a JEDEC file" };
/// A checksum is wrong.
pub const CHECKSUM: Code = Code { id: "G0786", title: "checksum mismatch" };
/// No known device has this number of fuses or pins.
pub const UNKNOWN_SIZE: Code = Code { id: "G0787", title: "fuse count of an unknown device" };
/// A field that is ignored.
pub const PASSED_OVER: Code = Code { id: "G0788", title: "ignored JEDEC field" };
/// A fuse map that was written does not read back as intended.
pub const NOT_AS_MEANT: Code = Code { id: "G0789", title: "incorrect fuse map" };
/// The fuse simulator and the test vectors of a file differ.
pub const VECTOR_FAILS: Code = Code { id: "G0790", title: "failed test vector" };
/// Several devices have this number of fuses, and the file does not name the device.
pub const SEVERAL_DEVICES: Code = Code { id: "G0791", title: "ambiguous fuse count" };

/// All codes.
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
