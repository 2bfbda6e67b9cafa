//! 8051 with sdcc 4.2 `--model-large --nogcse --noinvariant`. Time in machine cycles of twelve clocks; these are estimates, not bounds.
//!
//! Derived from the cycles of the instruction set (`mov`, `add` 1, `movx`, `movc`, jumps and calls 2, `mul`, `div` 4) and from the code that sdcc generates:
//! it accesses instance, inputs and outputs by generic pointers, each byte by a library function (about 20 cycles); locals are in external RAM, and library
//! products and quotients are computed bit by bit. The estimates are good enough to compare styles; they do not bound the time. The stack contains little
//! more than return addresses.

use super::machine::{Machine, op};

/// The constants described above.
pub(super) const I8051: Machine = Machine {
    name: "8051",
    about: "8051, sdcc --model-large",
    unit: "machine cycles",
    clock_hz: 12_000_000,
    clocks_per_unit: 12,
    is_bounded: false,
    defines: &["__SDCC_mcs51"],
    int_bits: 16,
    pointer: 3,
    alignment: 1,
    register: 1,
    constant: [op(1, 2), op(2, 4), op(4, 8), op(8, 16)],
    local: [op(5, 4), op(9, 7), op(17, 13), op(33, 25)],
    load: [op(30, 12), op(52, 20), op(96, 36), op(184, 68)],
    store: [op(30, 12), op(52, 20), op(96, 36), op(184, 68)],
    far_store: [op(30, 12), op(52, 20), op(96, 36), op(184, 68)],
    near_pointers: 1,
    rom: [op(12, 8), op(20, 14), op(36, 26), op(68, 50)],
    field: (op(34, 16), op(70, 32)),
    sum: [op(3, 4), op(8, 10), op(20, 24), op(44, 48)],
    compare: [op(3, 4), op(8, 10), op(16, 20), op(32, 40)],
    branch: op(4, 5),
    truth: op(5, 7),
    shift: (
        [op(4, 5), op(8, 10), op(20, 20), op(80, 40)],
        [op(1, 1), op(8, 2), op(20, 2), op(60, 2)],
    ),
    byte_shift: None,
    multiply: [op(8, 6), op(50, 14), op(250, 26), op(12_000, 50)],
    divide: [op(10, 6), op(320, 14), op(2_400, 26), op(16_000, 50)],
    widen: [op(0, 0), op(2, 3), op(6, 8), op(14, 16)],
    index: (op(10, 12), op(24, 20)),
    jump: op(2, 3),
    table_from: 4,
    switch_table: op(14, 16),
    switch_compare: op(5, 6),
    call: op(4, 4),
    merges_single_calls: false,
    argument: [op(5, 5), op(9, 9), op(17, 17), op(33, 33)],
    frame: (op(0, 0), op(0, 0)),
    stack_frame: op(0, 0),
    copy: op(60, 2),
    scratch: 255,
    registers: 255,
    saved: 0,
    helper_stack: [2, 4, 6, 8],
    return_address: 2,
    user: op(4, 4),
};
