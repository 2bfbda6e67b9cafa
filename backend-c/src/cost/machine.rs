//! What operations cost on a machine: constants as data.
//!
//! One file for each machine in this folder. A constant belongs to a machine *and* a compiler with its options: it says what that compiler needs at worst for a
//! piece of the C that we emit, beginning with operands in registers where they would be, ending with the result in registers.

/// Time and text of one operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Op {
    /// In the machine's unit of time.
    pub time: u32,
    /// In bytes.
    pub text: u32,
}

/// An operation on 8, 16, 32 and 64 bits.
pub type Widths = [Op; 4];

/// Short for tables.
pub(super) const fn op(time: u32, text: u32) -> Op {
    Op { time, text }
}

/// A machine with its compiler.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Machine {
    /// The word on the command line.
    pub name: &'static str,
    /// What it is, and what the constants were measured with.
    pub about: &'static str,
    /// What time is counted in: `cycles` or `instructions`.
    pub unit: &'static str,
    /// Clocks in a second where nobody says another number.
    pub clock_hz: u64,
    /// Clocks in a unit of time; for machines that count instructions the most that a usual one takes.
    pub clocks_per_unit: u32,
    /// True if a bound on time may be stated: nothing but the instructions decides how long they take, or time *is* counted in instructions.
    pub is_bounded: bool,
    /// What the compiler defines.
    pub defines: &'static [&'static str],
    /// Bits of `int`.
    pub int_bits: u8,
    /// Bytes of a pointer.
    pub pointer: u32,
    /// The widest alignment in bytes.
    pub alignment: u32,
    /// Bytes of a register.
    pub register: u32,
    /// A constant into a register.
    pub constant: Widths,
    /// A local: it is in registers, or on the stack where they do not suffice.
    pub local: Widths,
    /// A member through a pointer.
    pub load: Widths,
    /// Into a member through a pointer.
    pub store: Widths,
    /// Into a member where a function has more pointers than the machine has registers that address with an offset.
    pub far_store: Widths,
    /// Pointers that address with an offset.
    pub near_pointers: u32,
    /// From a table in ROM.
    pub rom: Widths,
    /// Reading and writing a bit-field of one bit.
    pub field: (Op, Op),
    /// `+`, `-`, `&`, `|`, `^`, negation.
    pub sum: Widths,
    /// A comparison of numbers, without the jump.
    pub compare: Widths,
    /// A conditional jump, taken or not.
    pub branch: Op,
    /// A truth value in a register, from a comparison.
    pub truth: Op,
    /// A shift by a constant number of bits: what it begins with, and each bit.
    pub shift: (Widths, Widths),
    /// The most that a shift without a sign takes whose bits move by so many or more, where the compiler moves bytes instead of shifting bit by bit: of 16 bits.
    pub byte_shift: Option<(u64, Op)>,
    /// A product.
    pub multiply: Widths,
    /// A quotient or rest.
    pub divide: Widths,
    /// To this width from a narrower one.
    pub widen: Widths,
    /// The address of an element of a table: with elements of one byte or a power of two of bytes, and of other sizes.
    pub index: (Op, Op),
    /// A jump at the end of an arm or a round.
    pub jump: Op,
    /// From so many labels on a dense `switch` is a jump by a table.
    pub table_from: u32,
    /// A `switch` by a table of addresses.
    pub switch_table: Op,
    /// Each comparison of a `switch` without.
    pub switch_compare: Op,
    /// A call and its return.
    pub call: Op,
    /// The compiler puts a `static` function with one place of call into its caller.
    pub merges_single_calls: bool,
    /// An argument.
    pub argument: Widths,
    /// What a function begins and ends with, and each byte (rounded to registers) that it must save.
    pub frame: (Op, Op),
    /// What a frame on the stack costs where locals do not fit in registers.
    pub stack_frame: Op,
    /// Each byte of a structure that is copied.
    pub copy: Op,
    /// Bytes of locals that cost no saving: registers that a call may destroy.
    pub scratch: u32,
    /// Bytes of locals that are in registers; what is more is on the stack.
    pub registers: u32,
    /// The most bytes of registers that a function saves.
    pub saved: u32,
    /// Bytes of stack of the library's functions for products and quotients, the return address among them.
    pub helper_stack: [u32; 4],
    /// Bytes of stack of a call.
    pub return_address: u32,
    /// A function of the user, without its body.
    pub user: Op,
}
