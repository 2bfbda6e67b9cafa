//! x86-64 with gcc 12.2. Times are in clock cycles: the typical time of the slower of two cases. These are estimates, not bounds, because the real time depends
//! on caches and speculation.
//!
//! The main difference between the styles here is that a mispredicted jump of a `switch` costs about twenty clocks (Agner Fog, *The microarchitecture of
//! Intel, AMD and VIA CPUs*, branch misprediction), and a load from a table in the cache four to five. `scripts/bench` measures both: a ring of 10 steps
//! takes 17.6 ns as a `switch`, and 1 ns as a table.

use super::machine::{Machine, op};

/// The constants described above.
pub(super) const X86_64: Machine = Machine {
    name: "host",
    about: "x86-64, gcc",
    unit: "clocks",
    clock_hz: 2_600_000_000,
    clocks_per_unit: 1,
    is_bounded: false,
    defines: &["__GNUC__"],
    int_bits: 32,
    pointer: 8,
    alignment: 8,
    register: 8,
    constant: [op(0, 5), op(0, 5), op(0, 5), op(0, 10)],
    local: [op(0, 3), op(0, 3), op(0, 3), op(0, 4)],
    load: [op(1, 4), op(1, 4), op(1, 4), op(1, 4)],
    store: [op(1, 4), op(1, 4), op(1, 4), op(1, 4)],
    far_store: [op(1, 4), op(1, 4), op(1, 4), op(1, 4)],
    near_pointers: 14,
    rom: [op(1, 4), op(1, 4), op(1, 4), op(1, 4)],
    field: (op(2, 6), op(3, 10)),
    sum: [op(1, 3), op(1, 3), op(1, 3), op(1, 3)],
    compare: [op(1, 3), op(1, 4), op(1, 3), op(1, 4)],
    branch: op(2, 2),
    truth: op(1, 4),
    shift: ([op(1, 3), op(1, 3), op(1, 3), op(1, 4)], [op(0, 0), op(0, 0), op(0, 0), op(0, 0)]),
    byte_shift: None,
    multiply: [op(3, 3), op(3, 3), op(3, 3), op(3, 4)],
    divide: [op(20, 6), op(20, 6), op(20, 6), op(40, 8)],
    widen: [op(1, 3), op(1, 3), op(1, 3), op(1, 3)],
    index: (op(1, 3), op(2, 7)),
    jump: op(1, 2),
    table_from: 5,
    switch_table: op(22, 16),
    switch_compare: op(4, 5),
    call: op(4, 5),
    merges_single_calls: true,
    argument: [op(1, 3), op(1, 3), op(1, 3), op(1, 3)],
    frame: (op(2, 2), op(1, 1)),
    stack_frame: op(1, 8),
    copy: op(1, 0),
    scratch: 48,
    registers: 96,
    saved: 48,
    helper_stack: [0; 4],
    return_address: 8,
    user: op(6, 5),
};
