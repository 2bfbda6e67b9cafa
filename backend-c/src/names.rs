//! All identifiers of the emitted text, each chosen once by [`grafsynth_ir::names::Namer`].
//!
//! Identifiers are made from the chart's names, never from positions, so that an unrelated edit does not change them. Each name is in the space where
//! it is used: members of the input, output and instance structures, enumerators (all with the chart's prefix), and functions of the user's library
//! (without a prefix, so that one library serves several charts).

use crate::io::{Layout, Structure};
use crate::{Io, Options};
use grafsynth_ir::names::{C, Namer, Target};
use grafsynth_ir::net::{
    EdgeOperand, Input, InputId, InputKind, Net, Output, Step, Transition, Var,
};
use grafsynth_ir::span::Name;
use grafsynth_ir::{Arena, IdMap};
use std::collections::BTreeMap;

/// Members that the gate adds to the instance.
const MEMBERS_OF_GATE: [&str; 3] = ["gate", "gate_in", "gate_dt"];

/// The member of the instance that is the trace ring.
pub(crate) const MEMBER_OF_TRACE: &str = "trace";
/// The names, without the prefix, of the macros that the header defines for the trace ring.
const MACROS_OF_TRACE: [&str; 3] = ["TRACE_PLACES", "TRACE_BYTES", "TRACE_CHART"];
/// The member that records whether the chart runs or has stopped in its safe state.
pub(crate) const MEMBER_OF_SAFE_STATE: &str = "intact";

/// The part after a prefix, where no word is reserved.
static SUFFIX: Target = Target { name: "C after a prefix", reserved: &[], ..C };

/// Parameters and locals that every emitted function may have; members avoid these names for readability.
const OWN: &[&str] = &["self", "in", "out", "dt", "scan", "before"];

/// The identifiers of one chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Names {
    /// The prefix of the file names.
    pub(crate) stem: String,
    /// The prefix of types and functions.
    pub(crate) prefix: String,
    /// The prefix of macros and enumerators.
    pub(crate) upper: String,
    /// Members of the input structure; for extern conditions, the functions that the reaction calls.
    pub(crate) inputs: IdMap<Input, String>,
    /// The user's functions for extern conditions.
    pub(crate) provided: BTreeMap<InputId, String>,
    /// Members of the output structure; for extern actions, the user's functions.
    pub(crate) outputs: IdMap<Output, String>,
    /// Members of the instance.
    pub(crate) vars: IdMap<Var, String>,
    /// The steps without the prefix: `p1` of `TRUCK_p1` and `truck_active_p1`.
    pub(crate) steps: IdMap<Step, String>,
    /// The transitions without the prefix, for `TRUCK_T_t1`.
    pub(crate) transitions: IdMap<Transition, String>,
    /// The macros without the prefix, for `truck_macro_m1`.
    pub(crate) macros: Vec<String>,
    /// The layout of Boolean inputs and outputs.
    pub(crate) io: Layout,
    /// The names that the headers define after the upper-case prefix, except steps.
    reserved: Vec<String>,
    /// Members of the instance that store the last value of an edge operand.
    pub(crate) edges: IdMap<EdgeOperand, String>,
    /// All members of the instance so far.
    members: Vec<String>,
}

/// A namer for global identifiers.
pub(crate) fn namer() -> Namer {
    let mut namer = Namer::new(&C);
    OWN.iter().for_each(|word| namer.reserve(word));
    namer
}

/// `text` as an identifier.
pub(crate) fn identifier(text: &str) -> String {
    namer().name(text)
}

impl Names {
    /// The statement that assigns an input: see [`Layout::put`].
    pub(crate) fn put(&self, place: Structure, input: InputId, value: &str) -> String {
        self.io.put(place, &self.inputs[input], input, value)
    }

    /// The names of a net, with `prefix` before everything global.
    pub(crate) fn of(net: &Net, prefix: &str, options: &Options) -> Self {
        let prefix = identifier(prefix);
        let upper = prefix.to_ascii_uppercase();
        let stem = options.stem.clone().unwrap_or_else(|| prefix.clone());
        // Functions of the library share the global space with the names that the chart defines.
        let mut global = namer();
        global.reserve(&prefix);
        let io = Layout::of(net, &upper, options.io);
        // Locals of a reaction must not shadow functions of the library.
        (0..io.output_words()).for_each(|word| global.reserve(&io.lit(word)));
        let mut in_members = namer();
        let mut out_members = namer();
        let mut members = namer();
        let own: Vec<&str> = ["state", "fault"]
            .into_iter()
            .chain(options.gate.then_some(MEMBERS_OF_GATE).into_iter().flatten())
            .chain(options.trace.is_some().then_some(MEMBER_OF_TRACE))
            .chain(options.safe_state.then_some(MEMBER_OF_SAFE_STATE))
            .collect();
        own.iter().for_each(|word| members.reserve(word));
        if options.io == Io::Words {
            in_members.reserve("bits");
            out_members.reserve("bits");
        }
        let mut provided = BTreeMap::new();
        let inputs = IdMap::build(&net.inputs, |id, input| match input.kind {
            InputKind::Extern => {
                let name = global.name(&input.name.text);
                provided.insert(id, name.clone());
                if options.once { global.name(&format!("{prefix}_once_{name}")) } else { name }
            }
            InputKind::Pin | InputKind::Event | InputKind::InternalEvent => {
                in_members.name(&input.name.text)
            }
        });
        let outputs = IdMap::build(&net.outputs, |_, output| {
            if output.is_extern() {
                global.name(&output.name.text)
            } else {
                out_members.name(&output.name.text)
            }
        });
        let vars = assigned(&net.vars, &mut members, |it| &it.name);
        let reserved = reserved(options, &inputs, &outputs);
        let mut enumerators = Namer::new(&SUFFIX);
        reserved.iter().for_each(|word| enumerators.reserve(word));
        let steps = assigned(&net.steps, &mut enumerators, |it| &it.name);
        let transitions = assigned(&net.transitions, &mut Namer::new(&SUFFIX), |it| &it.name);
        let macros = Namer::new(&SUFFIX).assign(net.macros.iter().map(|it| it.name.text.as_str()));
        let edges = IdMap::build(&net.edges, |_, edge| {
            members.name(&format!("was_{}", edge_name(net, edge)))
        });
        let members = own
            .into_iter()
            .map(str::to_owned)
            .chain(vars.values().cloned())
            .chain(edges.values().cloned())
            .collect();
        Names {
            stem,
            prefix,
            upper,
            inputs,
            provided,
            outputs,
            vars,
            steps,
            transitions,
            macros,
            edges,
            members,
            io,
            reserved,
        }
    }

    /// A namer for names after the prefix, except steps.
    pub(crate) fn suffix_namer(&self) -> Namer {
        let mut namer = Namer::new(&SUFFIX);
        self.reserved.iter().for_each(|word| namer.reserve(word));
        self.steps.values().for_each(|name| namer.reserve(name));
        namer
    }

    /// A namer for further members of the instance.
    pub(crate) fn member_namer(&self) -> Namer {
        let mut namer = namer();
        self.members.iter().for_each(|name| namer.reserve(name));
        namer
    }
}

/// The names that the headers define after the upper-case prefix, except steps.
fn reserved(
    options: &Options,
    inputs: &IdMap<Input, String>,
    outputs: &IdMap<Output, String>,
) -> Vec<String> {
    let mut reserved: Vec<String> = ENUMERATORS.iter().map(|word| (*word).to_owned()).collect();
    if options.trace.is_some() {
        reserved.extend(MACROS_OF_TRACE.map(str::to_owned));
    }
    if options.io == Io::Words {
        reserved.extend(["GET", "PUT", "LIT", "LIGHT"].map(str::to_owned));
        reserved.extend(inputs.values().map(|name| format!("IN_{name}")));
        reserved.extend(outputs.values().map(|name| format!("OUT_{name}")));
    }
    reserved
}

/// One name for each item of an arena.
/// The names of all objects of a kind, made from their names in the chart.
fn assigned<T>(
    arena: &Arena<T>,
    namer: &mut Namer,
    name: impl Fn(&T) -> &Name,
) -> IdMap<T, String> {
    let mut names = namer.assign(arena.values().map(|it| name(it).text.as_str())).into_iter();
    IdMap::build(arena, |_, _| names.next().unwrap_or_default())
}

/// The functions of the user's library.
pub(crate) fn library(net: &Net, names: &Names) -> Vec<String> {
    let actions = net.outputs.iter().filter(|(_, it)| it.is_extern());
    let called = names.provided.keys().map(|id| &names.inputs[*id]);
    (names.provided.values().chain(called).cloned())
        .chain(actions.map(|(id, _)| names.outputs[id].clone()))
        .collect()
}

/// A name for the operand of an edge: the names in it, joined.
fn edge_name(net: &Net, edge: &EdgeOperand) -> String {
    use grafsynth_ir::net::Leaf;
    let mut words: Vec<&str> = Vec::new();
    for leaf in edge.expr.leaves() {
        if words.len() < 3 {
            words.push(match *leaf {
                Leaf::Input(input) => &net.inputs[input].name.text,
                Leaf::Var(var) => &net.vars[var].name.text,
                Leaf::Active(step)
                | Leaf::Elapsed(step)
                | Leaf::LastElapsed(step)
                | Leaf::TasksDone(step) => &net.steps[step].name.text,
                Leaf::Timer(timer) => &net.timers[timer].name.text,
                Leaf::Controlled(action) => &net.actions[action].name.text,
                Leaf::Rise(_) | Leaf::Fall(_) | Leaf::Fireable(_) => "edge",
            });
        }
    }
    words.join("_")
}

/// The names that the headers define after the upper-case prefix.
const ENUMERATORS: &[&str] = &[
    "ACTIVE",
    "BAD_STATE",
    "BARRIER",
    "COMPLETE",
    "ENTER_CRITICAL",
    "EXIT_CRITICAL",
    "H",
    "IDLE",
    "INACTIVE",
    "NONE",
    "PORT_H",
    "RING_SIZE",
    "ROM",
    "SAFE_OUT",
    "USER_H",
    "WATCHDOG",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_we_use_ourselves_is_given_away() {
        assert_eq!(identifier("self"), "self_2");
        assert_eq!(identifier("int"), "int_");
        assert_eq!(Namer::new(&SUFFIX).name("int"), "int");
    }
}
