//! BLIF: one `.names` for each gate, one `.latch` for each register.

use super::SourceText;
use crate::netlist::Netlist;
use grafsynth_ir::logic::{Logic, Node, NodeId};
use grafsynth_ir::net::Meta;

pub(crate) fn write(logic: &Logic, netlist: &Netlist) -> SourceText {
    let mut source = SourceText::default();
    for line in &netlist.head {
        source.line(&format!("# {line}"));
    }
    source.line(&format!(".model {}", netlist.title));
    list(&mut source, ".inputs", netlist.inputs.values().map(String::as_str));
    list(&mut source, ".outputs", netlist.outputs.values().map(String::as_str));
    if let Some(clock) = &netlist.clock {
        source.line(&format!(".clock {clock}"));
    }
    let mut writer = Writer { logic, netlist, source };
    for (id, flop) in logic.flops.iter() {
        writer.latch(&netlist.flops[id], flop.next, flop.init, &flop.meta);
    }
    for (id, output) in logic.outputs.iter() {
        let name = &netlist.outputs[id];
        match output.registered {
            Some(init) => writer.latch(name, output.value, init, &output.meta),
            None => writer.buffer(name, output.value, &output.meta),
        }
    }
    for (id, name) in netlist.wires.iter() {
        if let Some(name) = name {
            writer.gate(id, name);
        }
    }
    let mut source = writer.source;
    source.line(".end");
    source
}

/// Writes a directive with names, broken into lines if it is long.
fn list<'a>(source: &mut SourceText, directive: &str, names: impl Iterator<Item = &'a str>) {
    let mut line = directive.to_owned();
    for name in names {
        if line.len() + name.len() > 100 {
            line.push_str(" \\");
            source.line(&line);
            " ".clone_into(&mut line);
        }
        line.push(' ');
        line.push_str(name);
    }
    source.line(&line);
}

struct Writer<'a> {
    logic: &'a Logic,
    netlist: &'a Netlist,
    source: SourceText,
}

impl Writer<'_> {
    /// A node as a signal: its name and whether it is negated; `Err` for a constant.
    fn literal(&self, node: NodeId) -> Result<(&str, bool), bool> {
        if let Node::Const(value) = self.logic.nodes[node] {
            return Err(value);
        }
        let (bare, is_negated) = if let Node::Not(inner) = self.logic.nodes[node] {
            (inner, true)
        } else {
            (node, false)
        };
        match self.netlist.name(self.logic, bare) {
            Some(name) => Ok((name, is_negated)),
            None => {
                unreachable!("every gate has a wire here, and constants are never operands")
            }
        }
    }

    fn latch(&mut self, name: &str, next: NodeId, init: bool, meta: &Meta) {
        let data = match self.literal(next) {
            Ok((signal, false)) => signal.to_owned(),
            Ok((_, true)) | Err(_) => {
                // A latch needs a signal, so a constant or a negation gets one.
                let data = format!("{name}$d");
                self.buffer(&data, next, meta);
                data
            }
        };
        let clock = self.netlist.clock.clone().unwrap_or_default();
        self.source.line_of(
            &format!(".latch {data} {name} re {clock} {}", u8::from(init)),
            name,
            meta,
        );
    }

    fn buffer(&mut self, name: &str, node: NodeId, meta: &Meta) {
        match self.literal(node) {
            Ok((signal, is_negated)) => {
                let line = format!(".names {signal} {name}");
                self.source.line_of(&line, name, meta);
                self.source.line(if is_negated { "0 1" } else { "1 1" });
            }
            Err(value) => {
                self.source.line_of(&format!(".names {name}"), name, meta);
                if value {
                    self.source.line("1");
                }
            }
        }
    }

    fn gate(&mut self, node: NodeId, name: &str) {
        let logic = self.logic;
        match &logic.nodes[node] {
            Node::And(all) => self.row(all, name, true),
            Node::Or(all) => self.row(all, name, false),
            Node::Xor(a, b) => self.table(&[*a, *b], name, &["10 1", "01 1"]),
            Node::Mux(a, b, c) => self.table(&[*a, *b, *c], name, &["11- 1", "0-1 1"]),
            Node::Const(_) | Node::Input(_) | Node::Flop(_) | Node::Not(_) => {}
        }
    }

    /// Prints a gate as a table of one row: a product is true if all its literals are true, and a sum is false if no literal is.
    fn row(&mut self, all: &[NodeId], name: &str, is_and: bool) {
        let literals: Vec<(String, bool)> = all
            .iter()
            .filter_map(|&operand| self.literal(operand).ok())
            .map(|(signal, is_negated)| (signal.to_owned(), is_negated))
            .collect();
        list(
            &mut self.source,
            ".names",
            literals.iter().map(|(signal, _)| signal.as_str()).chain([name]),
        );
        let row: String = literals
            .iter()
            .map(|(_, is_negated)| if *is_negated == is_and { '0' } else { '1' })
            .collect();
        self.source.line(&format!("{row} {}", u8::from(is_and)));
    }

    fn table(&mut self, all: &[NodeId], name: &str, rows: &[&str]) {
        let literals: Vec<(String, bool)> = all
            .iter()
            .filter_map(|&operand| self.literal(operand).ok())
            .map(|(signal, is_negated)| (signal.to_owned(), is_negated))
            .collect();
        list(
            &mut self.source,
            ".names",
            literals.iter().map(|(signal, _)| signal.as_str()).chain([name]),
        );
        for row in rows {
            let (inputs, value) = row.split_once(' ').unwrap_or((row, "1"));
            let turned: String = inputs
                .chars()
                .zip(&literals)
                .map(|(c, (_, is_negated))| match (c, is_negated) {
                    ('0', true) => '1',
                    ('1', true) => '0',
                    (c, _) => c,
                })
                .collect();
            self.source.line(&format!("{turned} {value}"));
        }
    }
}
