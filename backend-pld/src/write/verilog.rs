//! Verilog-2001: one module, one clocked block.

use super::SourceText;
use crate::ResetStyle;
use crate::equations::remark;
use crate::netlist::Netlist;
use grafsynth_ir::logic::{Logic, Node, NodeId};
use grafsynth_ir::net::Meta;

pub(crate) fn write(logic: &Logic, netlist: &Netlist) -> SourceText {
    let mut source = SourceText::default();
    for line in &netlist.head {
        source.line(&format!("// {line}"));
    }
    ports(&mut source, logic, netlist);
    for (id, flop) in logic.flops.iter() {
        declare_register(&mut source, "    reg ", &netlist.flops[id], flop.init, &flop.meta);
    }
    let writer = Expressions { logic, netlist };
    let mut metas = netlist.meta.iter().map(|(node, meta)| (*node, meta)).collect::<Vec<_>>();
    metas.sort_by_key(|(node, _)| *node);
    let nothing = Meta::default();
    for (id, name) in netlist.wires.iter() {
        if let Some(name) = name {
            let meta =
                metas.binary_search_by_key(&id, |entry| entry.0).map_or(&nothing, |at| metas[at].1);
            let mut expr = String::new();
            writer.gate(id, Level::Loose, &mut expr);
            wrapped(&mut source, "    ", &format!("wire {name} = {expr};"), name, meta);
        }
    }
    clocked(&mut source, &writer);
    for (id, output) in logic.outputs.iter() {
        if output.registered.is_none() {
            let mut expr = String::new();
            writer.operand(output.value, Level::Loose, &mut expr);
            wrapped(
                &mut source,
                "    ",
                &format!("assign {} = {expr};", netlist.outputs[id]),
                &output.name,
                &output.meta,
            );
        }
    }
    source.line("endmodule");
    source
}

fn ports(source: &mut SourceText, logic: &Logic, netlist: &Netlist) {
    let nothing = Meta::default();
    let mut ports: Vec<(String, &Meta)> = Vec::new();
    ports.extend(netlist.clock.iter().map(|name| (format!("input wire {name}"), &nothing)));
    ports
        .extend(netlist.reset.iter().map(|reset| (format!("input wire {}", reset.name), &nothing)));
    ports.extend(
        logic
            .inputs
            .iter()
            .map(|(id, input)| (format!("input wire {}", netlist.inputs[id]), &input.meta)),
    );
    for (id, output) in logic.outputs.iter() {
        let kind = if output.registered.is_some() { "output reg " } else { "output wire" };
        ports.push((format!("{kind} {}", netlist.outputs[id]), &output.meta));
    }
    if ports.is_empty() {
        source.line(&format!("module {};", netlist.title));
        return;
    }
    source.line(&format!("module {} (", netlist.title));
    let count = ports.len();
    for (index, (port, meta)) in ports.into_iter().enumerate() {
        let comma = if index + 1 < count { "," } else { "" };
        let name = port.rsplit(' ').next().unwrap_or_default().to_owned();
        source.line_of(&commented(&format!("    {port}{comma}"), meta), &name, meta);
    }
    source.line(");");
    for (id, output) in logic.outputs.iter() {
        if let Some(init) = output.registered {
            source.line(&format!("    initial {} = {};", netlist.outputs[id], constant(init)));
        }
    }
}

fn declare_register(source: &mut SourceText, lead: &str, name: &str, init: bool, meta: &Meta) {
    source.line_of(&commented(&format!("{lead}{name} = {};", constant(init)), meta), name, meta);
}

fn clocked(source: &mut SourceText, writer: &Expressions<'_>) {
    let (logic, netlist) = (writer.logic, writer.netlist);
    let Some(clock) = &netlist.clock else { return };
    source.line("");
    let also = match &netlist.reset {
        Some(reset) if reset.style == ResetStyle::Asynchronous => {
            format!(" or posedge {}", reset.name)
        }
        Some(_) | None => String::new(),
    };
    source.line(&format!("    always @(posedge {clock}{also}) begin"));
    let registers = || {
        let flops = logic
            .flops
            .iter()
            .map(|(id, flop)| (&netlist.flops[id], flop.init, flop.next, &flop.meta));
        let outputs = logic.outputs.iter().filter_map(|(id, output)| {
            output.registered.map(|init| (&netlist.outputs[id], init, output.value, &output.meta))
        });
        flops.chain(outputs)
    };
    let mut indent = "        ";
    if let Some(reset) = &netlist.reset {
        source.line(&format!("        if ({}) begin", reset.name));
        for (name, init, _, _) in registers() {
            source.line(&format!("            {name} <= {};", constant(init)));
        }
        source.line("        end else begin");
        indent = "            ";
    }
    for (name, _, next, meta) in registers() {
        let mut expr = String::new();
        writer.operand(next, Level::Loose, &mut expr);
        wrapped(source, indent, &format!("{name} <= {expr};"), name, meta);
    }
    if netlist.reset.is_some() {
        source.line("        end");
    }
    source.line("    end");
    source.line("");
}

fn constant(value: bool) -> &'static str {
    if value { "1'b1" } else { "1'b0" }
}

fn commented(line: &str, meta: &Meta) -> String {
    let remark = remark(meta);
    if remark.is_empty() { line.to_owned() } else { format!("{line} // {remark}") }
}

/// Prints a statement, broken at blanks if it is long.
fn wrapped(source: &mut SourceText, indent: &str, statement: &str, name: &str, meta: &Meta) {
    let mut line = indent.to_owned();
    for word in statement.split(' ') {
        if line.len() + word.len() > 110 && line.trim_end().len() > indent.len() {
            source.line_of(&line, name, meta);
            line = format!("{indent}    ");
        }
        line.push_str(word);
        line.push(' ');
    }
    source.line_of(&commented(line.trim_end(), meta), name, meta);
}

/// The context of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Level {
    /// No operator around it.
    Loose,
    /// An operand of `|`, or a branch of `?:`: sums, exclusive-ors and choices need parentheses.
    Sum,
    /// An operand of `&`, `^` or `~`, or the condition of `?:`: all operations except a negation need parentheses.
    Tight,
}

struct Expressions<'a> {
    logic: &'a Logic,
    netlist: &'a Netlist,
}

impl Expressions<'_> {
    /// Writes a node where it is used: its name if it has one. The recursion is bounded by the depth at which functions become wires.
    fn operand(&self, node: NodeId, level: Level, text: &mut String) {
        if let Some(name) = self.netlist.name(self.logic, node) {
            text.push_str(name);
            return;
        }
        self.gate(node, level, text);
    }

    fn gate(&self, node: NodeId, level: Level, text: &mut String) {
        match &self.logic.nodes[node] {
            Node::Const(value) => text.push_str(constant(*value)),
            Node::Not(a) => {
                text.push('~');
                self.operand(*a, Level::Tight, text);
            }
            Node::And(all) => self.list(all, " & ", Level::Tight, level == Level::Tight, text),
            Node::Or(all) => self.list(all, " | ", Level::Sum, level != Level::Loose, text),
            Node::Xor(a, b) => {
                self.list(&[*a, *b], " ^ ", Level::Tight, level != Level::Loose, text)
            }
            Node::Mux(a, b, c) => {
                let parens = level != Level::Loose;
                text.push_str(if parens { "(" } else { "" });
                self.operand(*a, Level::Tight, text);
                text.push_str(" ? ");
                self.operand(*b, Level::Sum, text);
                text.push_str(" : ");
                self.operand(*c, Level::Sum, text);
                text.push_str(if parens { ")" } else { "" });
            }
            // Pins and flip-flops have names.
            Node::Input(input) => text.push_str(&self.netlist.inputs[*input]),
            Node::Flop(flop) => text.push_str(&self.netlist.flops[*flop]),
        }
    }

    fn list(&self, all: &[NodeId], sign: &str, inner: Level, parens: bool, text: &mut String) {
        text.push_str(if parens { "(" } else { "" });
        for (index, &operand) in all.iter().enumerate() {
            if index > 0 {
                text.push_str(sign);
            }
            self.operand(operand, inner, text);
        }
        text.push_str(if parens { ")" } else { "" });
    }
}
