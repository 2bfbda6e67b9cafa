//! Data exchange between the chart and the main program if `NAME_step` runs in an interrupt: the part of `NAME_port.h` that makes it safe.
//!
//! The interrupt owns the instance and the reading end of the ring; the main program writes inputs and reads outputs, instance and variables. On one
//! processor, the main program cannot interrupt the interrupt, so only the main program must disable interrupts, and only while it copies
//! (docs/c.md).

use crate::Object;
use crate::c::print::Node;
use crate::header::Layout;
use crate::io::INPUT_BITS;
use grafsynth_ir::net::InputKind;

impl Layout<'_> {
    /// Adds `NAME_read_out`, `NAME_write_in` and `NAME_read_self`, if the chart can use them.
    pub(crate) fn handover(&self, nodes: &mut Vec<Node>) {
        self.read_out(nodes);
        self.write_in(nodes);
        self.read_self(nodes);
    }

    fn locked(&self, mut body: Vec<Node>) -> Vec<Node> {
        let upper = &self.names.upper;
        body.insert(0, Node::line(format!("{upper}_ENTER_CRITICAL();")));
        body.push(Node::line(format!("{upper}_EXIT_CRITICAL();")));
        body
    }

    fn read_out(&self, nodes: &mut Vec<Node>) {
        if !self.interface.has_out {
            return;
        }
        let prefix = &self.names.prefix;
        let io = &self.names.io;
        let words = if io.n_outputs > 0 { io.output_words() } else { 0 };
        let mut body: Vec<Node> = (0..words)
            .map(|word| Node::line(format!("to->bits[{word}] = from->bits[{word}];")))
            .collect();
        for (id, output) in self.net.outputs.iter() {
            if !output.is_extern() && io.output_bit(id).is_none() {
                let name = &self.names.outputs[id];
                let line = Node::line(format!("to->{name} = from->{name};"));
                body.push(line.about(Object::Output(id)));
            }
        }
        nodes.push(Node::comment(
            "For main, if the chart runs in an interrupt: all outputs of one reaction.",
        ));
        nodes.push(Node::function(
            format!(
                "static inline void {prefix}_read_out({prefix}_out_t *to, const volatile {prefix}_out_t *from)"
            ),
            self.locked(body),
        ));
        nodes.push(Node::blank());
    }

    fn write_in(&self, nodes: &mut Vec<Node>) {
        let prefix = &self.names.prefix;
        let pins: Vec<_> =
            self.net.inputs.iter().filter(|(_, input)| input.kind == InputKind::Pin).collect();
        if pins.is_empty() {
            return;
        }
        let mut body = Vec::new();
        let mut words = vec![false; self.names.io.input_words()];
        for (id, _) in &pins {
            match self.names.io.input_bit(*id) {
                Some(bit) => words[bit / INPUT_BITS] = true,
                None => {
                    let name = &self.names.inputs[*id];
                    let line = Node::line(format!("pins->{name} = from->{name};"));
                    body.push(line.about(Object::Input(*id)));
                }
            }
        }
        for (word, _) in words.iter().enumerate().filter(|(_, is_used)| **is_used) {
            body.push(Node::line(format!("pins->bits[{word}] = from->bits[{word}];")));
        }
        nodes.push(Node::comment(
            "For main, if the chart runs in an interrupt: writes all inputs at once, except events, which use the ring.",
        ));
        nodes.push(Node::function(
            format!(
                "static inline void {prefix}_write_in(volatile {prefix}_in_t *pins, const {prefix}_in_t *from)"
            ),
            self.locked(body),
        ));
        nodes.push(Node::blank());
    }

    fn read_self(&self, nodes: &mut Vec<Node>) {
        if !self.interface.has_instance {
            return;
        }
        let prefix = &self.names.prefix;
        let body = vec![
            Node::line("uint8_t *const bytes = (uint8_t *)to;"),
            Node::line("const volatile uint8_t *const source = (const volatile uint8_t *)from;"),
            Node::block(
                format!("for (uint16_t at = 0U; at < (uint16_t)sizeof({prefix}_t); ++at)"),
                vec![Node::line("bytes[at] = source[at];")],
            ),
        ];
        nodes.push(Node::comment(format!(
            "For main, if the chart runs in an interrupt: a copy of the instance between two reactions. Read it with {prefix}_active_STEP and {prefix}_var_V.",
        )));
        let mut locked = self.locked(body);
        // Declarations come first: the macro may contain declarations too.
        locked.swap(0, 1);
        locked.swap(1, 2);
        nodes.push(Node::function(
            format!("static inline void {prefix}_read_self({prefix}_t *to, const volatile {prefix}_t *from)"),
            locked,
        ));
        nodes.push(Node::blank());
    }
}
