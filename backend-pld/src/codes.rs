//! The findings of this crate (`G0710` to `G0739`, `G0770` to `G0779`).

use grafsynth_ir::Code;

/// A function in a table needs more product terms than allowed.
pub const TOO_MANY_PRODUCTS: Code =
    Code { id: "G0710", title: "function too large for a sum of products" };
/// The device has too few pins or macrocells.
pub const DOES_NOT_FIT: Code = Code { id: "G0711", title: "design that does not fit the device" };
/// The device is unknown.
pub const UNKNOWN_DEVICE: Code = Code { id: "G0712", title: "unknown device" };
/// A pin of the device has the wrong value after power-up.
pub const POWER_UP: Code =
    Code { id: "G0713", title: "registered output with the wrong power-up value" };
/// A pin number or signal name of a pin assignment does not exist or is used twice.
pub const BAD_PIN: Code = Code { id: "G0714", title: "invalid pin assignment" };
/// The test vectors do not belong to the circuit.
pub const BAD_VECTORS: Code = Code { id: "G0715", title: "test vectors of another circuit" };

/// The text does not follow the language's grammar.
pub const SYNTAX: Code = Code { id: "G0720", title: "syntax error in equations" };
/// A name without a declaration.
pub const UNKNOWN_NAME: Code = Code { id: "G0721", title: "unknown signal" };
/// A signal is declared or defined twice.
pub const DEFINED_TWICE: Code = Code { id: "G0722", title: "signal defined twice" };
/// Combinational functions depend on each other.
pub const LOOP: Code = Code { id: "G0723", title: "combinational loop" };
/// A construct of the language that a synchronous circuit cannot express.
pub const UNSUPPORTED: Code =
    Code { id: "G0724", title: "equations beyond one synchronous circuit" };
/// The construct was read in a simplified form.
pub const TAKEN_AS: Code = Code { id: "G0725", title: "feature read in a simplified form" };
/// Something that the named device does not support.
pub const DEVICE_LIMIT: Code = Code { id: "G0726", title: "equations unsuitable for the device" };
/// A signal without a function.
pub const UNDEFINED: Code = Code { id: "G0727", title: "signal without an equation" };
/// The file is larger than the readers accept.
pub const TOO_LONG: Code = Code { id: "G0728", title: "equation file too large" };
/// A signal that was written is missing from the text that was read back.
pub const NOT_READ_BACK: Code = Code { id: "G0729", title: "signal missing after reading back" };
/// A circuit without outputs and flip-flops: there is nothing to write as an equation.
pub const NO_EQUATION: Code = Code { id: "G0730", title: "design without an equation" };
/// A text that can be read as logic but does not assign functions to macrocells.
pub const NOT_PLACED: Code = Code { id: "G0770", title: "equations not assigned to macrocells" };

/// All codes.
pub const ALL: &[Code] = &[
    TOO_MANY_PRODUCTS,
    DOES_NOT_FIT,
    UNKNOWN_DEVICE,
    POWER_UP,
    BAD_PIN,
    BAD_VECTORS,
    SYNTAX,
    UNKNOWN_NAME,
    DEFINED_TWICE,
    LOOP,
    UNSUPPORTED,
    TAKEN_AS,
    DEVICE_LIMIT,
    UNDEFINED,
    TOO_LONG,
    NOT_READ_BACK,
    NO_EQUATION,
    NOT_PLACED,
];
