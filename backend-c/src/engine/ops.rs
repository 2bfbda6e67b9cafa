//! The instructions of the virtual machine: the one table from which the encoder, the checks on both sides, and the text of the C machine are made.
//!
//! There is one machine with two sizes. The *narrow* one computes with 32 bits and has few instructions; the table engine runs guards, lists and output
//! values on it. The *wide* one computes with 64 bits; the program engine runs whole reactions on it. `machine.c` is the interpreter and the check
//! of both; [`c_text`] makes the text of either.
//!
//! Code is postfix. Code that is skipped or repeated is *contained* in the instruction before it, which encodes its length; parts are nested and never
//! overlap. So one pass over the code can check that it stays within its bytes, its stack and its rounds, and no jump can leave the code.

/// The size of the machine's stack, which is also the maximum number of call arguments.
pub(super) const STACK: usize = 16;
/// The maximum depth of nested loops.
pub(super) const LOOPS: usize = 3;
/// The maximum number of parts that are open at once, with the code itself.
pub(super) const NEST: usize = 32;

/// What an instruction does, in the order of the numbers in the C text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Class {
    /// Pushes a value.
    Leaf,
    /// Replaces the top of the stack.
    One,
    /// Replaces the two values on top by one.
    Two,
    /// Stores a value.
    Store,
    /// Skips or repeats code.
    Control,
    /// Interrupts the machine until its caller has done something.
    Service,
}

/// The operand of an instruction; little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Operand {
    /// The number (2 bytes) of an object.
    Of(Kind),
    /// The number of an action (2 bytes), and how many arguments it has (a byte).
    Call,
    /// A constant of this many bytes, or nothing.
    Bytes(usize),
    /// The length of the code that the instruction contains (2 bytes).
    Length,
    /// The maximum number of rounds (4 bytes), and the length of the body (2 bytes).
    Loop,
}

/// The kinds of objects that operands refer to, in the order of the numbers in the C text; the narrow machine has those up to `Cell`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// An input, or the answer of an extern condition.
    Input,
    /// A bit of the instance.
    Bit,
    /// A bit of the instance that has another one after it.
    Pair,
    /// A number of the instance.
    Value,
    /// A row of cells: consecutive numbers with a range.
    Cell,
    /// A bit of a reaction.
    Flag,
    /// A number of a reaction.
    Number,
    /// An output.
    Output,
    /// An extern action.
    Call,
    /// A text of the user.
    Text,
    /// A transition that is recorded when it fires.
    Fired,
}

/// The number of kinds of the narrow machine, and of the wide one.
const N_KINDS: [usize; 2] = [Kind::Cell as usize + 1, Kind::Fired as usize + 1];

impl Operand {
    /// Its length in bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Operand::Of(_) | Operand::Length => 2,
            Operand::Call => 3,
            Operand::Bytes(size) => size,
            Operand::Loop => 6,
        }
    }

    /// The kind of object that it refers to.
    pub(super) fn kind(self) -> Option<Kind> {
        match self {
            Operand::Of(kind) => Some(kind),
            Operand::Call => Some(Kind::Call),
            Operand::Bytes(_) | Operand::Length | Operand::Loop => None,
        }
    }
}

/// The machines that have an instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Machines {
    Narrow,
    Wide,
    Both,
}

/// A row of the table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Instruction {
    /// The instruction.
    pub(super) op: Op,
    /// Its name in C, without the prefix.
    pub(super) name: &'static str,
    /// The machines that have it.
    machines: Machines,
    /// What it does.
    pub(super) class: Class,
    /// What follows it.
    pub(super) operand: Operand,
    /// The number of values that it pops; a call also pops all its arguments.
    pub(super) takes: usize,
    /// The number of values that it pushes.
    pub(super) gives: usize,
    /// Its effect.
    pub(super) doc: &'static str,
}

impl Instruction {
    /// The row as the number that the C machine reads.
    fn number(&self) -> usize {
        let kind = self.operand.kind().map_or(15, |kind| kind as usize);
        let class = self.class as usize;
        class << 12 | self.operand.size() << 8 | kind << 4 | self.takes << 1 | self.gives
    }
}

/// Makes the enumeration and the table; the code of an instruction is its place.
macro_rules! instructions {
    ($($op:ident $name:literal $machines:ident $class:ident $operand:expr, $takes:literal $gives:literal, $doc:literal;)*) => {
        /// The instructions, in the order of their codes.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(super) enum Op {
            $(#[doc = $doc] $op,)*
        }

        /// The instructions by code.
        pub(super) const TABLE: &[Instruction] = &[
            $(Instruction {
                op: Op::$op,
                name: $name,
                machines: Machines::$machines,
                class: Class::$class,
                operand: $operand,
                takes: $takes,
                gives: $gives,
                doc: $doc,
            },)*
        ];
    };
}

use Kind::{Bit, Cell, Fired, Flag, Input, Number, Output, Pair, Text, Value};
use Operand::{Bytes, Length, Of};

/// No operand.
const NONE: Operand = Bytes(0);

instructions! {
    Byte "BYTE" Both Leaf Bytes(1), 0 1, "a constant of 8 bits";
    Long "LONG" Both Leaf Bytes(4), 0 1, "a constant of 32 bits";
    Input "INPUT" Both Leaf Of(Input), 0 1, "an input";
    Bit "BIT" Both Leaf Of(Bit), 0 1, "a bit of the instance";
    Value "VALUE" Both Leaf Of(Value), 0 1, "a number of the instance";
    Rise "RISE" Narrow Leaf Of(Pair), 0 1, "a bit is false and the next one true";
    Fall "FALL" Narrow Leaf Of(Pair), 0 1, "a bit is true and the next one false";
    Not "NOT" Both One NONE, 1 1, "not";
    Neg "NEG" Both One NONE, 1 1, "negation";
    And "AND" Both Two NONE, 2 1, "and";
    Or "OR" Both Two NONE, 2 1, "or";
    Eq "EQ" Both Two NONE, 2 1, "equal";
    Ne "NE" Both Two NONE, 2 1, "not equal";
    Lt "LT" Both Two NONE, 2 1, "less";
    Le "LE" Both Two NONE, 2 1, "less or equal";
    Gt "GT" Both Two NONE, 2 1, "greater";
    Ge "GE" Both Two NONE, 2 1, "greater or equal";
    Add "ADD" Both Two NONE, 2 1, "sum";
    Sub "SUB" Both Two NONE, 2 1, "difference";
    Mul "MUL" Both Two NONE, 2 1, "product";
    SetValue "SET_VALUE" Both Store Of(Cell), 1 0, "stores into the first number of a cell; saturates";
    Unless "UNLESS" Both Control Length, 1 0, "skips the code that it contains unless the value is true";
    Else "ELSE" Both Control Length, 0 0, "the end of UNLESS: skips the code that follows";
    Wide "WIDE" Wide Leaf Bytes(8), 0 1, "a constant of 64 bits";
    Dt "DT" Wide Leaf NONE, 0 1, "the ticks since the last reaction";
    Flag "FLAG" Wide Leaf Of(Flag), 0 1, "a bit of the reaction";
    Number "NUMBER" Wide Leaf Of(Number), 0 1, "a number of the reaction";
    Element "ELEMENT" Wide One Of(Cell), 1 1, "the element of a cell with this index; 0 if it does not exist";
    Div "DIV" Wide Two NONE, 2 1, "quotient, rounded toward 0; 0 if the divisor is 0";
    Mod "MOD" Wide Two NONE, 2 1, "remainder, with the sign of the dividend; 0 if the divisor is 0";
    BitAnd "BIT_AND" Wide Two NONE, 2 1, "bitwise and";
    BitOr "BIT_OR" Wide Two NONE, 2 1, "bitwise or";
    BitXor "BIT_XOR" Wide Two NONE, 2 1, "bitwise exclusive or";
    Shl "SHL" Wide Two NONE, 2 1, "shift to the left by 0 to 63";
    Shr "SHR" Wide Two NONE, 2 1, "shift to the right by 0 to 63; rounds down";
    SetBit "SET_BIT" Wide Store Of(Bit), 1 0, "stores into a bit of the instance";
    SetFlag "SET_FLAG" Wide Store Of(Flag), 1 0, "stores into a bit of the reaction";
    SetNumber "SET_NUMBER" Wide Store Of(Number), 1 0, "stores into a number of the reaction";
    SetElement "SET_ELEMENT" Wide Store Of(Cell), 2 0, "stores the top at the index below it; saturates; does nothing if the element does not exist";
    Output "OUTPUT" Wide Store Of(Output), 1 0, "sets an output";
    Fault "FAULT" Wide Store NONE, 1 0, "sets the fault flag";
    Ask "ASK" Wide Service Of(Input), 0 0, "evaluates an extern condition, so that INPUT can read it";
    Call "CALL" Wide Service Operand::Call, 0 0, "calls an extern action; its arguments are all values on the stack, which it pops";
    Text "TEXT" Wide Service Of(Text), 0 0, "runs a block of user code";
    Fired "FIRED" Wide Service Of(Fired), 0 0, "records that a transition fires";
    Micro "MICRO" Wide Service NONE, 0 0, "records that a micro-step begins";
    AndThen "ANDTHEN" Wide Control Length, 1 0, "if the top is false, keeps it and skips the code that it contains; else drops it";
    OrElse "ORELSE" Wide Control Length, 1 0, "if the top is true, keeps it and skips the code that it contains; else drops it";
    Loop "LOOP" Wide Control Operand::Loop, 0 0, "repeats the code that it contains";
    While "WHILE" Wide Control NONE, 1 0, "leaves the loop unless the value is true";
    Again "AGAIN" Wide Control NONE, 0 0, "the end of LOOP";
}

/// The number of codes of the narrow machine.
const N_NARROW: usize = Op::Else as usize + 1;

/// The two sizes of the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Machine {
    /// 32 bits; for tables.
    Narrow,
    /// 64 bits; for programs.
    Wide,
}

impl Machine {
    /// The instructions by code; `None` for those of the other machine. No code follows.
    fn table(self) -> impl ExactSizeIterator<Item = Option<&'static Instruction>> {
        let n = match self {
            Machine::Narrow => N_NARROW,
            Machine::Wide => TABLE.len(),
        };
        TABLE.iter().take(n).map(move |row| self.has(row).then_some(row))
    }

    fn has(self, row: &Instruction) -> bool {
        match row.machines {
            Machines::Narrow => self == Machine::Narrow,
            Machines::Wide => self == Machine::Wide,
            Machines::Both => true,
        }
    }

    /// The instruction with this code.
    pub(super) fn instruction(self, code: u8) -> Option<&'static Instruction> {
        TABLE.get(usize::from(code)).filter(|row| self.has(row))
    }
}

/// The interpreter and the check, for both sizes. Lines between `/* wide: */` and `/* :wide */` are only for the wide machine, and those
/// between `/* narrow: */` and `/* :narrow */` only for the narrow one.
const TEMPLATE: &str = include_str!("machine.c");

/// The instructions and the machine as C: names begin with `gs_` (narrow) or `gp_` (wide).
pub(super) fn c_text(machine: Machine) -> String {
    let (prefix, number, word, begin) = match machine {
        Machine::Narrow => ("gs", "int32_t", "uint32_t", "/* narrow: */"),
        Machine::Wide => ("gp", "int64_t", "uint64_t", "/* wide: */"),
    };
    let mut text = numbers(machine);
    let mut is_own = true;
    for line in TEMPLATE.lines() {
        match line {
            "/* narrow: */" | "/* wide: */" => is_own = line == begin,
            "/* :narrow */" | "/* :wide */" => is_own = true,
            _ if is_own => text.extend([line, "\n"]),
            _ => {}
        }
    }
    let names = [
        ("gc_number_t", number),
        ("gc_word_t", word),
        ("gc_", &format!("{prefix}_")),
        ("GC_", &format!("{}_", prefix.to_ascii_uppercase())),
    ];
    names.into_iter().fold(text, |text, (name, own)| text.replace(name, own))
}

/// The numbers of classes, kinds and instructions, and the table that the check and the interpreter read.
fn numbers(machine: Machine) -> String {
    let n_kinds = N_KINDS[machine as usize];
    let mut text = String::from("/* What instructions do. */\n");
    let classes = ["LEAF", "ONE", "TWO", "STORE", "CONTROL", "SERVICE"];
    for (at, name) in classes.iter().enumerate() {
        if machine == Machine::Wide || *name != "SERVICE" {
            text.push_str(&format!("#define GC_{name} {at}U\n"));
        }
    }
    text.push_str("\n/* The kinds of objects that operands refer to. */\n");
    let kinds = [
        "INPUT", "BIT", "PAIR", "VALUE", "CELL", "FLAG", "NUMBER", "OUTPUT", "CALL", "TEXT",
        "FIRED",
    ];
    for (at, name) in kinds.iter().enumerate().take(n_kinds) {
        text.push_str(&format!("#define GC_KIND_{name} {at}U\n"));
    }
    text.push_str(&format!("#define GC_KINDS {n_kinds}U\n\n/* Instructions. */\n"));
    for (code, row) in machine.table().enumerate() {
        let Some(row) = row else { continue };
        text.push_str(&format!("#define GC_OP_{} {code}U /* {} */\n", row.name, row.doc));
    }
    let n_ops = machine.table().len();
    text.push_str(&format!(
        "#define GC_N_OPS {n_ops}U\n\n/* For each instruction, class (4 bits), bytes of the operand (4), kind of the operand (4; 15: none), values that \
         it pops (3)\n   and pushes (1); 0 is no\n   instruction. */\nstatic GS_ROM uint16_t gc_use[GC_N_OPS] = {{\n"
    ));
    for (code, row) in machine.table().enumerate() {
        let comma = if code + 1 < n_ops { "," } else { "" };
        let (number, name) = row.map_or((0, "no instruction"), |row| (row.number(), row.name));
        text.push_str(&format!("    0x{number:04X}U{comma} /* {name} */\n"));
    }
    text.push_str("};\n\n");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_instruction_is_at_its_code() {
        for (code, row) in TABLE.iter().enumerate() {
            assert_eq!(row.op as usize, code);
            assert!(row.takes <= 3 && row.gives <= 1 && row.operand.size() <= 15);
        }
        let mut narrow = Machine::Narrow.table().flatten();
        assert!(narrow.all(|row| row.operand.kind() <= Some(Kind::Cell)));
        assert!(TABLE.iter().all(|row| row.number() != 0));
        assert!(TABLE[N_NARROW..].iter().all(|row| row.machines == Machines::Wide));
    }

    /// The page lists the instructions of this table.
    #[test]
    fn the_page_lists_the_instructions() {
        let page = include_str!("../../../docs/c.md");
        let mut table = String::from(
            "| code | name | engine | operand | takes, leaves | effect |\n|---|---|---|---|---|---|\n",
        );
        for (code, row) in TABLE.iter().enumerate() {
            let engine = match row.machines {
                Machines::Narrow => "tables",
                Machines::Wide => "programs",
                Machines::Both => "",
            };
            let operand = match row.operand {
                Operand::Of(kind) => format!("{kind:?}").to_lowercase(),
                Operand::Call => "call; arguments (a byte)".to_owned(),
                Operand::Bytes(0) => String::new(),
                Operand::Bytes(1) => "1 byte".to_owned(),
                Operand::Bytes(n) => format!("{n} bytes"),
                Operand::Length => "length".to_owned(),
                Operand::Loop => "rounds (4 bytes); length".to_owned(),
            };
            let (name, takes, gives, doc) = (row.name, row.takes, row.gives, row.doc);
            table.push_str(&format!(
                "| {code} | {name} | {engine} | {operand} | {takes}, {gives} | {doc} |\n"
            ));
        }
        assert!(page.contains(&table), "docs/c.md must contain\n{table}");
    }

    /// Neither text has a trace of the template.
    #[test]
    fn the_texts_are_complete() {
        for machine in [Machine::Narrow, Machine::Wide] {
            let text = c_text(machine);
            for mark in ["gc_", "GC_", "wide: */", "narrow: */", ":wide", ":narrow"] {
                assert!(!text.contains(mark), "{mark} in {machine:?}");
            }
        }
    }
}
