//! Cost of operations on a machine: constants as data.
//!
//! There is one file for each machine in this folder. A constant belongs to a machine *and* a compiler with its options: it is the worst-case cost
//! that this compiler needs for a piece of the emitted C, with operands and result in registers.

/// Time and code size of one operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Op {
    /// In the machine's unit of time.
    pub time: u32,
    /// In bytes.
    pub text: u32,
}

/// An operation on 8, 16, 32 and 64 bits.
pub type Widths = [Op; 4];

/// Short constructor for tables.
pub(super) const fn op(time: u32, text: u32) -> Op {
    Op { time, text }
}

/// A machine with its compiler.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Machine {
    /// The name on the command line.
    pub name: &'static str,
    /// A description of the machine and of how the constants were measured.
    pub about: &'static str,
    /// The unit of time: `cycles` or `instructions`.
    pub unit: &'static str,
    /// The default number of clocks per second.
    pub clock_hz: u64,
    /// Clocks per unit of time; for machines whose unit is the instruction, the maximum for a typical instruction.
    pub clocks_per_unit: u32,
    /// True if a time bound may be stated: the instructions alone determine the time, or time *is* counted in instructions.
    pub is_bounded: bool,
    /// The macros that the compiler predefines.
    pub defines: &'static [&'static str],
    /// The number of bits of `int`.
    pub int_bits: u8,
    /// Bytes of a pointer.
    pub pointer: u32,
    /// The widest alignment in bytes.
    pub alignment: u32,
    /// Bytes of a register.
    pub register: u32,
    /// The cost of loading a constant into a register.
    pub constant: Widths,
    /// Access to a local: in registers, or on the stack if there are too few.
    pub local: Widths,
    /// Loading a member through a pointer.
    pub load: Widths,
    /// Storing into a member through a pointer.
    pub store: Widths,
    /// Storing into a member if a function has more pointers than the machine has registers with offset addressing.
    pub far_store: Widths,
    /// The number of pointers that can be used with an offset.
    pub near_pointers: u32,
    /// Reading from a table in ROM.
    pub rom: Widths,
    /// Reading and writing a one-bit bit-field.
    pub field: (Op, Op),
    /// `+`, `-`, `&`, `|`, `^`, negation.
    pub sum: Widths,
    /// A comparison of numbers, without the jump.
    pub compare: Widths,
    /// A conditional jump, taken or not.
    pub branch: Op,
    /// Storing the result of a comparison as a Boolean in a register.
    pub truth: Op,
    /// A shift by a constant number of bits: the fixed cost, and the cost of each bit.
    pub shift: (Widths, Widths),
    /// The maximum cost of an unsigned 16-bit shift by at least this many bits, if the compiler moves bytes instead of shifting bit by bit.
    pub byte_shift: Option<(u64, Op)>,
    /// A product.
    pub multiply: Widths,
    /// A quotient or remainder.
    pub divide: Widths,
    /// Widening to this width from a narrower one.
    pub widen: Widths,
    /// The address of a table element: for an element size of a power of two bytes, and for other sizes.
    pub index: (Op, Op),
    /// A jump at the end of a branch or of a round of a loop.
    pub jump: Op,
    /// From this number of labels on, a dense `switch` uses a jump table.
    pub table_from: u32,
    /// A `switch` with a jump table.
    pub switch_table: Op,
    /// Each comparison of a `switch` without a jump table.
    pub switch_compare: Op,
    /// A call and its return.
    pub call: Op,
    /// True if the compiler inlines a `static` function that is called at one place only.
    pub merges_single_calls: bool,
    /// An argument.
    pub argument: Widths,
    /// Entry and exit of a function, and each byte (rounded to registers) that it must save.
    pub frame: (Op, Op),
    /// The cost of a stack frame if locals do not fit in registers.
    pub stack_frame: Op,
    /// Copying one byte of a structure.
    pub copy: Op,
    /// Bytes of locals that need no saving: registers that a call may overwrite.
    pub scratch: u32,
    /// Bytes of locals that fit in registers; the rest is on the stack.
    pub registers: u32,
    /// The maximum number of register bytes that a function saves.
    pub saved: u32,
    /// Stack bytes of the library functions for products and quotients, including the return address.
    pub helper_stack: [u32; 4],
    /// Stack bytes of a call.
    pub return_address: u32,
    /// A call of a user function, without its body.
    pub user: Op,
}
