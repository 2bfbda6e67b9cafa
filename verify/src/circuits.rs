//! Equality of two circuits: a breadth-first search of their product from power-up, with all inputs; or induction if their flip-flops correspond.
//!
//! Outputs are compared in every pair of states that both circuits reach together, under every input.

use crate::limits::Limits;
use crate::verdict::{Open, OpenReason};
use grafsynth_ir::Gather;
use grafsynth_ir::logic::{FlopId, Logic, PinInputId, PinOutputId};
use grafsynth_logic::bdd::{Bdd, Full};
use grafsynth_logic::node_bdds::{Functions, Var};
use grafsynth_logic::sim::LogicSim;
use indexmap::IndexMap;
use std::collections::BTreeMap;

/// Inputs and outputs that correspond.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pairs {
    /// Pins that carry the same value; `None` for a circuit that does not have the input.
    pub inputs: Vec<(Option<PinInputId>, Option<PinInputId>)>,
    /// Pins that are compared.
    pub outputs: Vec<(PinOutputId, PinOutputId)>,
    /// Flip-flops that may correspond. They are only used if the circuits are too large to enumerate; the proof checks that they really correspond.
    pub flops: Vec<(FlopId, FlopId)>,
}

/// The result of a comparison of two circuits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Equality {
    /// The outputs are equal in every pair of states that the circuits reach together.
    Enumerated {
        /// The number of pairs of states.
        states: usize,
        /// The number of outputs compared under each input.
        outputs: usize,
    },
    /// The circuits are equal by induction: corresponding flip-flops have equal initial values, and this many pairs of functions are equal.
    ByFunctions(usize),
    /// The circuits differ after a stimulus.
    Different(Apart),
    /// Open, with the reason.
    Open(Open),
}

/// A difference between two circuits.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Apart {
    /// The values of [`Pairs::inputs`] at each clock; with the values of the last row, the outputs differ before the clock edge.
    pub rows: Vec<Vec<bool>>,
    /// The pair of outputs, as an index into [`Pairs::outputs`].
    pub output: usize,
    /// The value of the left output; the right output has the opposite value.
    pub left: bool,
}

/// The maximum number of inputs that are enumerated; with more, induction is used.
const MAX_INPUTS: usize = 16;

/// Compares two circuits from power-up.
#[must_use]
pub fn circuits(left: &Logic, right: &Logic, pairs: &Pairs, limits: &Limits) -> Equality {
    let found = if pairs.inputs.len() <= MAX_INPUTS {
        enumerate(left, right, pairs, limits)
    } else {
        Equality::Open(Open::because(OpenReason::Inputs { inputs: pairs.inputs.len() }))
    };
    let Equality::Open(mut open) = found else { return found };
    match by_functions(left, right, pairs) {
        Ok(n_functions) => Equality::ByFunctions(n_functions),
        Err(also) => {
            open.reasons.push(also.into());
            Equality::Open(open)
        }
    }
}

type State = (Vec<u64>, Vec<u64>);

fn state_of(sim: &LogicSim<'_>, lane: u32) -> Vec<u64> {
    let flops = sim.logic().flops.ids();
    let mut code = vec![0; sim.logic().flops.len().div_ceil(64)];
    for flop in flops {
        code[flop.index() / 64] |= (sim.flop(flop) >> lane & 1) << (flop.index() % 64);
    }
    code
}

fn put_state(sim: &mut LogicSim<'_>, code: &[u64]) {
    for flop in sim.logic().flops.ids() {
        let bit = code[flop.index() / 64] >> (flop.index() % 64) & 1;
        sim.set_flop(flop, if bit == 1 { !0 } else { 0 });
    }
}

fn enumerate(left: &Logic, right: &Logic, pairs: &Pairs, limits: &Limits) -> Equality {
    if left.outputs.values().chain(right.outputs.values()).any(|output| output.registered.is_some())
    {
        let why = "an output with its own register cannot be enumerated".to_owned();
        return Equality::Open(Open::because(why));
    }
    let n_rows = 1_u64 << pairs.inputs.len();
    let (mut ours, mut theirs) = (LogicSim::new(left), LogicSim::new(right));
    let start: State = (state_of(&ours, 0), state_of(&theirs, 0));
    let mut states: IndexMap<State, Option<(usize, u64)>> = IndexMap::new();
    states.insert(start, None);
    let mut work = 0_u64;
    let mut at = 0;
    while at < states.len() {
        let Some((state, _)) = states.get_index(at) else { break };
        let state = state.clone();
        for first in (0..n_rows).step_by(64) {
            let lanes = u32::try_from((n_rows - first).min(64)).unwrap_or(64);
            work = work.saturating_add(u64::from(lanes));
            if work > limits.pairs {
                let reason = OpenReason::Pairs { limit: limits.pairs, states: states.len() };
                return Equality::Open(Open::because(reason));
            }
            put_state(&mut ours, &state.0);
            put_state(&mut theirs, &state.1);
            for (bit, (a, b)) in pairs.inputs.iter().enumerate() {
                let word = (0..lanes)
                    .fold(0, |word, lane| word | ((first + u64::from(lane)) >> bit & 1) << lane);
                a.iter().for_each(|pin| ours.set_input(*pin, word));
                b.iter().for_each(|pin| theirs.set_input(*pin, word));
            }
            let mask = if lanes == 64 { !0 } else { (1 << lanes) - 1 };
            for (index, (a, b)) in pairs.outputs.iter().enumerate() {
                let value = ours.output(*a);
                let differ = (value ^ theirs.output(*b)) & mask;
                if differ != 0 {
                    let lane = differ.trailing_zeros();
                    let mut rows = vec![first + u64::from(lane)];
                    let mut from = at;
                    while let Some((_, Some((before, row)))) = states.get_index(from) {
                        rows.push(*row);
                        from = *before;
                    }
                    rows.reverse();
                    let bits =
                        |row: u64| (0..pairs.inputs.len()).map(|bit| row >> bit & 1 == 1).collect();
                    return Equality::Different(Apart {
                        rows: rows.into_iter().map(bits).collect(),
                        output: index,
                        left: value >> lane & 1 == 1,
                    });
                }
            }
            ours.clock();
            theirs.clock();
            for lane in 0..lanes {
                let next = (state_of(&ours, lane), state_of(&theirs, lane));
                states.entry(next).or_insert(Some((at, first + u64::from(lane))));
                if states.len() > limits.states {
                    return Equality::Open(Open::because(OpenReason::States {
                        limit: limits.states,
                    }));
                }
            }
        }
        at += 1;
    }
    Equality::Enumerated { states: states.len(), outputs: pairs.outputs.len() }
}

/// Compares by induction: the flip-flops of each pair must have equal initial values and equal functions of corresponding signals. Outputs with equal functions
/// are then always equal.
fn by_functions(left: &Logic, right: &Logic, pairs: &Pairs) -> Result<usize, String> {
    let twins: BTreeMap<FlopId, FlopId> = pairs.flops.iter().map(|(a, b)| (*b, *a)).gather();
    if pairs.flops.len() < left.flops.len() || twins.len() < right.flops.len() {
        return Err("their flip-flops have different names".to_owned());
    }
    let inputs: BTreeMap<PinInputId, PinInputId> =
        pairs.inputs.iter().filter_map(|(a, b)| Some(((*b)?, (*a)?))).gather();
    if let Some((a, _)) =
        pairs.flops.iter().find(|(a, b)| left.flops[*a].init != right.flops[*b].init)
    {
        return Err(format!("`{}` has different power-up values", left.flops[*a].name));
    }
    let full = |_: Full| "their functions are too large to compare".to_owned();
    let mut bdd = Bdd::with_limit(1 << 20);
    let (mut ours, mut theirs) = (Functions::new(), Functions::new());
    let mut functions: Vec<(String, _, _)> = pairs
        .flops
        .iter()
        .map(|(a, b)| (left.flops[*a].name.clone(), left.flops[*a].next, right.flops[*b].next))
        .collect();
    functions.extend(pairs.outputs.iter().map(|(a, b)| {
        (left.outputs[*a].name.clone(), left.outputs[*a].value, right.outputs[*b].value)
    }));
    for (name, a, b) in &functions {
        let first = ours.build(&mut bdd, left, *a).map_err(full)?;
        let second = theirs.build(&mut bdd, right, *b).map_err(full)?;
        // Maps levels of the right circuit to those of the left one.
        let mut moved = second;
        let support = bdd.support(second);
        let mut images = Vec::new();
        for level in support {
            let image = match theirs.vars().get(level as usize) {
                Some(Var::Flop(flop)) => twins.get(flop).map(|twin| Var::Flop(*twin)),
                Some(Var::Input(pin)) => inputs.get(pin).map(|twin| Var::Input(*twin)),
                None => None,
            };
            let Some(image) = image else {
                return Err(format!(
                    "`{name}` reads a signal that the other circuit does not have"
                ));
            };
            images.push((level, ours.level(image)));
        }
        // First move all levels far away, so that no old level is confused with a new one.
        let far = 1 << 20;
        for (level, to) in &images {
            let var = bdd.var(far + to).map_err(full)?;
            moved = bdd.compose(moved, *level, var).map_err(full)?;
        }
        for (_, to) in &images {
            let var = bdd.var(*to).map_err(full)?;
            moved = bdd.compose(moved, far + to, var).map_err(full)?;
        }
        if first != moved {
            return Err(format!(
                "the functions of `{name}` differ in a state that may be unreachable"
            ));
        }
    }
    Ok(functions.len())
}

#[cfg(test)]
mod tests {
    use super::{Apart, Equality, Pairs, circuits};
    use crate::limits::Limits;
    use grafsynth_ir::logic::{Logic, PinOutput, PinRole};
    use grafsynth_logic::build::Builder;

    fn pin(name: &str, value: grafsynth_ir::logic::NodeId) -> PinOutput {
        let meta = Default::default();
        PinOutput {
            name: name.into(),
            role: PinRole::Unknown,
            value,
            registered: None,
            mealy: false,
            meta,
        }
    }

    /// A divider by 4, one-hot or binary, that counts while `go` is true.
    fn divider(is_binary: bool, wakes_late: bool) -> Logic {
        let mut builder = Builder::default();
        let go = builder.input_named("go");
        if is_binary {
            let (a, low) = builder.flop_named("a", false);
            let (b, high) = builder.flop_named("b", wakes_late);
            builder.logic.flops[a].next = builder.xor(low, go);
            let carry = builder.and([low, go]);
            builder.logic.flops[b].next = builder.xor(high, carry);
            let last = builder.and([low, high]);
            builder.logic.outputs.push(pin("y", last));
        } else {
            let steps: Vec<_> =
                (0..4).map(|step| builder.flop_named(&format!("s{step}"), step == 0)).collect();
            for step in 0..4 {
                let next = builder.mux(go, steps[(step + 3) % 4].1, steps[step].1);
                builder.logic.flops[steps[step].0].next = next;
            }
            builder.logic.outputs.push(pin("y", steps[3].1));
        }
        builder.finish()
    }

    fn pairs(left: &Logic, right: &Logic) -> Pairs {
        Pairs {
            inputs: left
                .inputs
                .ids()
                .zip(right.inputs.ids())
                .map(|(a, b)| (Some(a), Some(b)))
                .collect(),
            outputs: left.outputs.ids().zip(right.outputs.ids()).collect(),
            flops: left.flops.ids().zip(right.flops.ids()).collect(),
        }
    }

    #[test]
    fn codings_may_differ_and_behaviour_may_not() {
        let (hot, binary, late) =
            (divider(false, false), divider(true, false), divider(true, true));
        let limits = Limits::default();
        let equal = circuits(&hot, &binary, &pairs(&hot, &binary), &limits);
        assert_eq!(equal, Equality::Enumerated { states: 4, outputs: 1 });
        let apart = circuits(&hot, &late, &pairs(&hot, &late), &limits);
        let Equality::Different(Apart { rows, output: 0, left: false }) = apart else {
            panic!("{apart:?}");
        };
        assert_eq!(rows.len(), 2, "one clock, then the pin");
        let few = Limits { pairs: 3, ..Limits::default() };
        let same = circuits(&binary, &binary, &pairs(&binary, &binary), &few);
        assert_eq!(same, Equality::ByFunctions(3));
        let open = circuits(&hot, &binary, &pairs(&hot, &binary), &few);
        assert!(matches!(open, Equality::Open(_)), "{open:?}");
    }
}
