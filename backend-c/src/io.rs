//! The layout of Boolean inputs and outputs: members of their structures, or bits of words.
//!
//! Members are the easiest to assign and to inspect, and cost one byte each. As words (`--io words`), inputs are bits of bytes, which every
//! machine tests with a constant mask, and a port register can be copied into them directly; outputs are bits of the smallest word that
//! contains all of them, up to 32, so that a reaction collects them in a register and writes them once. Bits are numbered in declaration
//! order and named by macros of the header; unused bits are 0. Numbers are members in both layouts.

use crate::c::print::Node;
use crate::cexpr::{CExpr, Prec, constant};
use crate::{Io, Object};
use grafsynth_ir::IdMap;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Input, InputId, InputKind, Net, Output, OutputId};

/// The bits of one word of inputs.
pub(crate) const INPUT_BITS: usize = 8;

/// How the code accesses a structure of inputs or outputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Structure {
    /// A local.
    Local(&'static str),
    /// The target of a pointer.
    Behind(&'static str),
}

impl Structure {
    /// The text of a member.
    fn member(self, name: &str) -> String {
        match self {
            Structure::Local(local) => format!("{local}.{name}"),
            Structure::Behind(pointer) => format!("{pointer}->{name}"),
        }
    }

    /// The text of the address.
    fn pointer(self) -> String {
        match self {
            Structure::Local(local) => format!("&{local}"),
            Structure::Behind(pointer) => pointer.to_owned(),
        }
    }
}

/// The location of each input and output.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Layout {
    upper: String,
    inputs: IdMap<Input, Option<usize>>,
    outputs: IdMap<Output, Option<usize>>,
    /// The number of inputs that are bits.
    pub(crate) n_inputs: usize,
    /// The number of outputs that are bits.
    pub(crate) n_outputs: usize,
}

impl Layout {
    pub(crate) fn of(net: &Net, upper: &str, io: Io) -> Self {
        let packed = io == Io::Words;
        let (mut n_inputs, mut n_outputs) = (0, 0);
        let number = |counter: &mut usize, is_bit: bool| {
            is_bit.then(|| {
                *counter += 1;
                *counter - 1
            })
        };
        let inputs = IdMap::build(&net.inputs, |_, it| {
            let is_outside = it.kind.is_handed();
            number(&mut n_inputs, packed && is_outside && it.ty.is_bool())
        });
        let outputs = IdMap::build(&net.outputs, |_, it| {
            number(&mut n_outputs, packed && !it.is_extern() && it.ty.is_bool())
        });
        Layout { upper: upper.to_string(), inputs, outputs, n_inputs, n_outputs }
    }

    /// The bit number of an input, if it is passed as a bit of a word.
    pub(crate) fn input_bit(&self, input: InputId) -> Option<usize> {
        self.inputs[input]
    }

    /// The bit number of an output, if it is a bit.
    pub(crate) fn output_bit(&self, output: OutputId) -> Option<usize> {
        self.outputs[output]
    }

    /// The number of input words.
    pub(crate) fn input_words(&self) -> usize {
        self.n_inputs.div_ceil(INPUT_BITS)
    }

    /// The used bits of a byte of inputs.
    pub(crate) fn used_bits(&self, byte: usize) -> u8 {
        let n = self.n_inputs.saturating_sub(byte * INPUT_BITS);
        if n >= INPUT_BITS { u8::MAX } else { (1 << n) - 1 }
    }

    /// The number of bits of one output word.
    pub(crate) fn output_bits(&self) -> usize {
        match self.n_outputs {
            0..=8 => 8,
            9..=16 => 16,
            _ => 32,
        }
    }

    /// The type of one output word.
    pub(crate) fn output_type(&self) -> &'static str {
        match self.output_bits() {
            8 => "uint8_t",
            16 => "uint16_t",
            _ => "uint32_t",
        }
    }

    /// The number of output words.
    pub(crate) fn output_words(&self) -> usize {
        self.n_outputs.div_ceil(self.output_bits())
    }

    /// A mask for an output word.
    pub(crate) fn output_mask(&self, mask: u32) -> String {
        match self.output_bits() {
            8 => format!("0x{mask:02x}U"),
            16 => format!("0x{mask:04x}U"),
            _ => format!("0x{mask:08x}UL"),
        }
    }

    /// The local in which a reaction collects an output word.
    pub(crate) fn lit(&self, word: usize) -> String {
        if word == 0 { "lit".to_string() } else { format!("lit_{}", word + 1) }
    }

    /// The statement `lit |= mask;`, with a cast for types smaller than `int`.
    pub(crate) fn light(&self, word: usize, mask: &str) -> Node {
        let lit = self.lit(word);
        Node::line(format!("{lit} = ({})({lit} | {mask});", self.output_type()))
    }

    /// The value of an input in a structure.
    pub(crate) fn read(&self, place: Structure, name: &str, input: InputId, ty: Type) -> CExpr {
        match self.inputs[input] {
            None => CExpr::place(place.member(name), ty),
            Some(_) => {
                let text = format!("{0}_GET({1}, {0}_IN_{name})", self.upper, place.pointer());
                CExpr::condition(text, Prec::Atom)
            }
        }
    }

    /// Assigns a value to an input.
    pub(crate) fn put(&self, place: Structure, name: &str, input: InputId, value: &str) -> String {
        match self.inputs[input] {
            None => format!("{} = {value};", place.member(name)),
            Some(_) => {
                format!("{0}_PUT({1}, {0}_IN_{name}, {value});", self.upper, place.pointer())
            }
        }
    }

    /// Assigns a value to a single output.
    pub(crate) fn write(&self, name: &str, output: OutputId, value: &str) -> String {
        match self.outputs[output] {
            None => format!("out->{name} = {value};"),
            Some(_) => format!("{0}_LIGHT(out, {0}_OUT_{name}, {value});", self.upper),
        }
    }

    /// Reads an output back.
    pub(crate) fn lamp(&self, place: Structure, name: &str, output: OutputId) -> String {
        match self.outputs[output] {
            None => place.member(name),
            Some(_) => format!("{0}_LIT({1}, {0}_OUT_{name})", self.upper, place.pointer()),
        }
    }

    /// Assigns constant values to all outputs: whole words at once, numbers one by one.
    pub(crate) fn constants(
        &self,
        net: &Net,
        names: &IdMap<Output, String>,
        value: impl Fn(OutputId) -> i64,
    ) -> Vec<Node> {
        let mut words = vec![0u32; self.output_words()];
        let mut objects: Vec<Vec<Object>> = vec![Vec::new(); words.len()];
        let mut nodes = Vec::new();
        for (id, output) in net.outputs.iter().filter(|(_, output)| !output.is_extern()) {
            match self.outputs[id] {
                Some(bit) => {
                    let (word, bit) = (bit / self.output_bits(), bit % self.output_bits());
                    words[word] |= u32::from(value(id) != 0) << bit;
                    objects[word].push(Object::Output(id));
                }
                None => nodes.push(
                    Node::line(format!("out->{} = {};", names[id], constant(value(id), output.ty)))
                        .about(Object::Output(id)),
                ),
            }
        }
        let words = words.into_iter().zip(objects).enumerate().map(|(word, (mask, objects))| {
            Node::line(format!("out->bits[{word}] = {};", self.output_mask(mask)))
                .about_all(objects)
        });
        let mut all: Vec<Node> = words.collect();
        all.extend(nodes);
        all
    }

    /// The macros of the header for inputs: how to access a bit, and the number of each.
    ///
    /// The test is a function: with the masks in the expressions, gcc would warn about every receptivity that reads an input and its negation.
    pub(crate) fn input_macros(
        &self,
        net: &Net,
        prefix: &str,
        names: &IdMap<Input, String>,
    ) -> Vec<Node> {
        if self.n_inputs == 0 {
            return Vec::new();
        }
        let upper = &self.upper;
        let mut nodes = vec![
            Node::function(
                format!("static inline bool {prefix}_bit(uint8_t byte, uint8_t mask)"),
                vec![Node::line("return (byte & mask) != 0U;")],
            ),
            Node::comment("Boolean inputs are bits: GET reads one, PUT writes it."),
            Node::directive(format!(
                "#define {upper}_GET(io, bit) ({prefix}_bit((io)->bits[(bit) / 8U], (uint8_t)(1U << ((bit) % 8U))))"
            )),
            Node::directive(format!(
                "#define {upper}_PUT(io, bit, value) ((io)->bits[(bit) / 8U] = (uint8_t)((value) ? ((io)->bits[(bit) / 8U] | (1U << ((bit) % 8U))) : ((io)->bits[(bit) / 8U] & ~(1U << ((bit) % 8U)))))"
            )),
        ];
        for (id, input) in net.inputs.iter() {
            if let Some(bit) = self.inputs[id] {
                let mut note = String::new();
                if input.kind == InputKind::Event {
                    note.push_str("event");
                }
                if !input.meta.label.is_empty() {
                    note.push_str(if note.is_empty() { "" } else { ": " });
                    note.push_str(&input.meta.label);
                }
                nodes.push(
                    Node::directive(format!("#define {upper}_IN_{} {bit}U", names[id]))
                        .note(note)
                        .about(Object::Input(id)),
                );
            }
        }
        nodes.push(Node::blank());
        nodes
    }

    /// The macros of the header for outputs.
    pub(crate) fn output_macros(&self, net: &Net, names: &IdMap<Output, String>) -> Vec<Node> {
        if self.n_outputs == 0 {
            return Vec::new();
        }
        let (upper, bits, ty) = (&self.upper, self.output_bits(), self.output_type());
        let word = format!("(io)->bits[(bit) / {bits}U]");
        let mask = format!("((uint32_t)1U << ((bit) % {bits}U))");
        let mut nodes = vec![
            Node::comment("Boolean outputs are bits: LIT reads one, LIGHT writes it."),
            Node::directive(format!("#define {upper}_LIT(io, bit) (({word} & {mask}) != 0U)")),
            Node::directive(format!(
                "#define {upper}_LIGHT(io, bit, value) ({word} = ({ty})((value) ? ({word} | {mask}) : ({word} & ~{mask})))"
            )),
        ];
        for (id, output) in net.outputs.iter() {
            if let Some(bit) = self.outputs[id] {
                nodes.push(
                    Node::directive(format!("#define {upper}_OUT_{} {bit}U", names[id]))
                        .note(output.meta.label.clone())
                        .about(Object::Output(id)),
                );
            }
        }
        nodes.push(Node::blank());
        nodes
    }
}
