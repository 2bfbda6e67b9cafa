//! The types of stored values.

use grafsynth_ir::expr::Type;

/// The C type in which a value of this type is stored: the smallest that contains it.
#[must_use]
pub fn storage(ty: Type) -> &'static str {
    let Type::Int { lo, hi } = ty else { return "bool" };
    let fits = |a: i64, b: i64| lo >= a && hi <= b;
    if fits(0, 0xff) {
        "uint8_t"
    } else if fits(-0x80, 0x7f) {
        "int8_t"
    } else if fits(-0x8000, 0x7fff) {
        // Not `uint16_t`: a 16-bit `int` cannot represent it, so all arithmetic with it would become unsigned.
        "int16_t"
    } else if fits(0, 0xffff) {
        "uint16_t"
    } else if fits(i64::from(i32::MIN), i64::from(i32::MAX)) {
        "int32_t"
    } else if fits(0, i64::from(u32::MAX)) {
        "uint32_t"
    } else {
        "int64_t"
    }
}
