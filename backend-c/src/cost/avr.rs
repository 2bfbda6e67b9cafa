//! ATmega with avr-gcc 5.4 `-Os -std=gnu99`. Time in cycles.
//!
//! Instructions: Microchip DS40002198 (AVR instruction set manual), column AVRe: `ld`/`ldd`/`st`/`std` 2, `lpm` 3, arithmetic 1, `adiw` 2, branches 2 taken,
//! `rjmp` 2, `call` 4, `ret` 4, `push`/`pop` 2. The constants of multiplication and division are larger than the maximum over the operands that `scripts/constants`
//! measures on simavr.

use super::machine::{Machine, op};

/// The constants described above.
pub(super) const AVR: Machine = Machine {
    name: "avr",
    about: "ATmega, avr-gcc -Os",
    unit: "cycles",
    clock_hz: 16_000_000,
    clocks_per_unit: 1,
    is_bounded: true,
    defines: &["__AVR__", "__FLASH", "__GNUC__"],
    int_bits: 16,
    pointer: 2,
    alignment: 1,
    register: 1,
    constant: [op(1, 2), op(2, 4), op(4, 8), op(8, 16)],
    // A move, or ldd from the frame if there are too few registers.
    local: [op(1, 1), op(1, 2), op(2, 4), op(8, 16)],
    // ldd for each byte, and a pointer to load. X has no displacement: adiw, st, sbiw.
    load: [op(3, 3), op(5, 5), op(10, 10), op(18, 18)],
    store: [op(3, 3), op(5, 5), op(10, 10), op(18, 18)],
    far_store: [op(6, 6), op(8, 8), op(12, 12), op(20, 20)],
    near_pointers: 2,
    rom: [op(3, 2), op(6, 4), op(12, 8), op(24, 16)],
    field: (op(4, 5), op(7, 9)),
    sum: [op(1, 2), op(2, 4), op(4, 8), op(10, 20)],
    compare: [op(1, 2), op(3, 5), op(5, 10), op(10, 20)],
    branch: op(2, 3),
    truth: op(3, 5),
    // Loops over single bits: lsl, rol, dec, brne.
    shift: ([op(1, 2), op(2, 6), op(3, 8), op(20, 24)], [op(2, 1), op(5, 1), op(7, 1), op(20, 0)]),
    byte_shift: Some((7, op(6, 12))),
    multiply: [op(6, 6), op(14, 16), op(75, 10), op(320, 30)],
    // Bytes are divided as 16-bit numbers.
    divide: [op(250, 8), op(250, 8), op(760, 16), op(2900, 40)],
    widen: [op(0, 0), op(2, 3), op(4, 7), op(8, 14)],
    index: (op(4, 6), op(12, 14)),
    jump: op(2, 2),
    table_from: 8,
    switch_table: op(28, 26),
    switch_compare: op(3, 4),
    call: op(8, 4),
    merges_single_calls: true,
    argument: [op(1, 2), op(1, 2), op(2, 4), op(8, 16)],
    frame: (op(2, 2), op(4, 4)),
    stack_frame: op(20, 24),
    copy: op(8, 4),
    // There are twelve, but the compiler uses call-saved registers while some of these are still free.
    scratch: 4,
    // r2 to r31, except one pair for an address.
    registers: 28,
    saved: 18,
    helper_stack: [2, 4, 12, 36],
    return_address: 2,
    user: op(8, 4),
};
