//! Cortex-M3 with arm-none-eabi-gcc 12.2 `-Os -mcpu=cortex-m3 -mthumb`. Time in instructions, which is what qemu counts with `-icount shift=0`.
//!
//! A usual instruction takes one clock, a load or a branch taken two or three (Arm DDI 0337, table 18-1), so three clocks an instruction are on the safe side without wait
//! states of the flash. Quotients of 64 bits are a loop of the library over the bits.

use super::machine::{Machine, op};

/// See the module.
pub(super) const CORTEX_M3: Machine = Machine {
    name: "cortex-m3",
    about: "Cortex-M3, arm-none-eabi-gcc -Os",
    unit: "instructions",
    clock_hz: 72_000_000,
    clocks_per_unit: 3,
    is_bounded: true,
    defines: &["__GNUC__"],
    int_bits: 32,
    pointer: 4,
    alignment: 8,
    register: 4,
    constant: [op(1, 2), op(1, 4), op(1, 6), op(2, 10)],
    local: [op(0, 1), op(0, 1), op(0, 1), op(1, 4)],
    load: [op(1, 2), op(1, 2), op(1, 2), op(2, 4)],
    store: [op(1, 2), op(1, 2), op(1, 2), op(2, 4)],
    far_store: [op(1, 2), op(1, 2), op(1, 2), op(2, 4)],
    near_pointers: 8,
    rom: [op(1, 2), op(1, 2), op(1, 2), op(2, 4)],
    field: (op(2, 4), op(4, 8)),
    sum: [op(1, 2), op(1, 2), op(1, 2), op(3, 6)],
    compare: [op(1, 2), op(1, 2), op(1, 2), op(3, 6)],
    branch: op(1, 2),
    truth: op(3, 6),
    shift: ([op(1, 2), op(1, 2), op(1, 2), op(6, 14)], [op(0, 0), op(0, 0), op(0, 0), op(0, 0)]),
    multiply: [op(1, 2), op(1, 2), op(1, 2), op(6, 14)],
    divide: [op(3, 8), op(3, 8), op(3, 8), op(900, 12)],
    widen: [op(0, 0), op(0, 0), op(1, 2), op(2, 4)],
    index: (op(2, 4), op(3, 6)),
    jump: op(1, 2),
    table_from: 5,
    switch_table: op(5, 10),
    switch_compare: op(2, 4),
    call: op(3, 4),
    argument: [op(1, 2), op(1, 2), op(1, 2), op(2, 4)],
    frame: (op(2, 4), op(1, 0)),
    stack_frame: op(2, 4),
    copy: op(1, 0),
    scratch: 12,
    saved: 32,
    helper_stack: [0, 0, 0, 64],
    return_address: 8,
    user: op(2, 4),
};
