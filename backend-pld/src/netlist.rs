//! A circuit prepared for a multi-level language: names, and the internal functions that become wires.

use crate::equations::{busy_note, one_line, register_name};
use crate::{Dialect, EmitOptions, Named, Object, Reset};
use grafsynth_ir::arena::IdMap;
use grafsynth_ir::logic::{Flop, Logic, Node, NodeId, PinInput, PinOutput};
use grafsynth_ir::names::{BLIF, Namer, VERILOG};
use grafsynth_ir::net::Meta;
use grafsynth_logic::build::{for_each_operand, needed};

/// A function that is nested deeper than this inside an expression becomes a separate wire.
const MAX_DEPTH: u32 = 6;

/// The name of each function that becomes a wire.
pub type WireNames = IdMap<Node, Option<String>>;

/// All decisions about a netlist before it is printed.
#[derive(Debug)]
pub struct Netlist {
    /// The module's name.
    pub title: String,
    /// Comment lines for the header.
    pub head: Vec<String>,
    /// The clock, if there is a register.
    pub clock: Option<String>,
    /// The reset, if one was requested and there is a register.
    pub reset: Option<Reset>,
    /// Names of the inputs.
    pub inputs: IdMap<PinInput, String>,
    /// Names of the flip-flops.
    pub flops: IdMap<Flop, String>,
    /// Names of the outputs.
    pub outputs: IdMap<PinOutput, String>,
    /// Names of the functions that become wires.
    pub wires: WireNames,
    /// The origins of the named wires.
    pub meta: Vec<(NodeId, Meta)>,
}

impl Netlist {
    /// Makes all decisions in linear time, except for the search for names.
    #[must_use]
    pub fn new(logic: &Logic, dialect: Dialect, options: &EmitOptions) -> Self {
        let is_blif = dialect == Dialect::Blif;
        let mut names = Namer::new(if is_blif { &BLIF } else { &VERILOG });
        let title = names.name(&logic.name.text);
        let is_registered = !logic.flops.is_empty()
            || logic.outputs.values().any(|output| output.registered.is_some());
        let pins = logic.inputs.values().map(|input| input.name.as_str());
        let mut pins = names
            .assign(pins.chain(logic.outputs.values().map(|output| output.name.as_str())))
            .into_iter();
        let inputs = IdMap::build(&logic.inputs, |_, _| pins.next().unwrap_or_default());
        let outputs = IdMap::build(&logic.outputs, |_, _| pins.next().unwrap_or_default());
        let flops = IdMap::build(&logic.flops, |_, flop| register_name(&mut names, &flop.name));
        let clock = is_registered.then(|| names.name("clk"));
        let reset = options
            .reset
            .as_ref()
            .filter(|_| is_registered && !is_blif)
            .map(|reset| Reset { name: names.name(&reset.name), style: reset.style });
        let (wires, meta) = choose_wires(logic, is_blif, &mut names);
        let mut head = vec![format!(
            "{} - made by grafsynth {}",
            one_line(&logic.name.text),
            env!("CARGO_PKG_VERSION")
        )];
        if logic.outputs.values().any(|output| output.mealy) {
            head.push("mealy outputs are valid just before the clock".to_owned());
        }
        head.extend(busy_note(logic));
        head.extend(options.notes.iter().map(|note| one_line(note)));
        Netlist { title, head, clock, reset, inputs, flops, outputs, wires, meta }
    }

    /// The names for [`crate::Emitted`].
    #[must_use]
    pub fn named(&self, logic: &Logic) -> Vec<Named> {
        let named = |name: &String, object| Named {
            name: name.clone(),
            pin: None,
            object,
            is_complement: false,
        };
        let clock = self.clock.iter().map(|name| named(name, Object::Clock));
        let reset = self.reset.iter().map(|reset| named(&reset.name, Object::Reset));
        let inputs = logic
            .inputs
            .iter()
            .map(|(id, input)| named(&self.inputs[id], Object::Input(input.clone())));
        let outputs = logic
            .outputs
            .iter()
            .map(|(id, output)| named(&self.outputs[id], Object::Output(output.clone())));
        let flops =
            logic.flops.iter().map(|(id, flop)| named(&self.flops[id], Object::Flop(flop.clone())));
        clock.chain(reset).chain(inputs).chain(outputs).chain(flops).collect()
    }

    /// The name of a node that needs no expression: a pin, a flip-flop or a wire.
    #[must_use]
    pub fn name(&self, logic: &Logic, node: NodeId) -> Option<&str> {
        match &logic.nodes[node] {
            Node::Input(input) => Some(&self.inputs[*input]),
            Node::Flop(flop) => Some(&self.flops[*flop]),
            _ => self.wires[node].as_deref(),
        }
    }
}

/// The names of all wires, and the data of those that have their own name.
fn choose_wires(
    logic: &Logic,
    is_blif: bool,
    names: &mut Namer,
) -> (WireNames, Vec<(NodeId, Meta)>) {
    let roots = || {
        let flops = logic.flops.values().map(|flop| (flop.next, format!("next_{}", flop.name)));
        flops.chain(
            logic.outputs.values().map(|output| (output.value, format!("{}_d", output.name))),
        )
    };
    let keep = needed(logic, roots().map(|(node, _)| node));
    let is_wire = is_wire(logic, is_blif, &keep, roots().map(|(node, _)| node));
    let mut wires: WireNames = IdMap::filled(&logic.nodes, None);
    let mut meta = Vec::new();
    for wire in &logic.wires {
        if is_wire[wire.node] && wires[wire.node].is_none() {
            wires[wire.node] = Some(names.name(&wire.name));
            meta.push((wire.node, wire.meta.clone()));
        }
    }
    // A wire without its own name is named after its user: the function of a pin is `next_p2` or `R_d`, and its parts are numbered.
    let mut owner: IdMap<Node, Option<u32>> = IdMap::filled(&logic.nodes, None);
    let mut owners: Vec<(String, u32)> = Vec::new();
    for (root, name) in roots() {
        if is_wire[root] && wires[root].is_none() {
            wires[root] = Some(names.name(&name));
        }
        if owner[root].is_none() {
            owner[root] = u32::try_from(owners.len()).ok();
            owners.push((name, 0));
        }
    }
    for (id, node) in logic.nodes.iter().rev() {
        if !keep[id] {
            continue;
        }
        if let (Some(name), None) = (&wires[id], owner[id]) {
            owner[id] = u32::try_from(owners.len()).ok();
            owners.push((name.clone(), 0));
        }
        let own = owner[id];
        for_each_operand(node, |operand| {
            if owner[operand].is_none() {
                owner[operand] = own;
            }
        });
    }
    for id in logic.nodes.ids() {
        if is_wire[id] && wires[id].is_none() {
            let (base, count) = match owner[id].and_then(|index| owners.get_mut(index as usize)) {
                Some((base, count)) => (base.as_str(), count),
                None => continue,
            };
            *count += 1;
            wires[id] = Some(names.name_with_suffix(base, &format!("_{count}")));
        }
    }
    (wires, meta)
}

/// A function becomes a wire if it has a name, if several functions use it, or if it is deep inside an expression; in BLIF every gate does.
fn is_wire(
    logic: &Logic,
    is_blif: bool,
    keep: &IdMap<Node, bool>,
    roots: impl Iterator<Item = NodeId>,
) -> IdMap<Node, bool> {
    let is_gate = |node: NodeId| match logic.nodes[node] {
        Node::And(_) | Node::Or(_) | Node::Xor(..) | Node::Mux(..) => true,
        Node::Const(_) | Node::Input(_) | Node::Flop(_) | Node::Not(_) => false,
    };
    // A negation is printed where it is used, so its uses count as uses of its operand.
    let mut uses: IdMap<Node, u32> = IdMap::filled(&logic.nodes, 0);
    roots.for_each(|root| uses[root] += 1);
    for (id, node) in logic.nodes.iter().rev().filter(|(id, _)| keep[*id]) {
        let times = if matches!(node, Node::Not(_)) { uses[id] } else { 1 };
        for_each_operand(node, |operand| uses[operand] = uses[operand].saturating_add(times));
    }
    let mut is_wire: IdMap<Node, bool> = IdMap::filled(&logic.nodes, false);
    for wire in &logic.wires {
        is_wire[wire.node] = keep[wire.node] && is_gate(wire.node);
    }
    let mut depth: IdMap<Node, u32> = IdMap::filled(&logic.nodes, 0);
    for (id, node) in logic.nodes.iter().filter(|(id, _)| keep[*id]) {
        let mut below = 0;
        for_each_operand(node, |operand| below = below.max(depth[operand]));
        if is_gate(id) && (is_blif || uses[id] > 1 || below + 1 >= MAX_DEPTH) {
            is_wire[id] = true;
        }
        depth[id] = if is_wire[id] { 0 } else { below + u32::from(is_gate(id)) };
    }
    is_wire
}
