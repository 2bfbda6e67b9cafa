//! Synchronisers: flip-flops between a pin and the circuit, so that all functions see the same value of an asynchronous input.
//!
//! ```text
//! pin m ──► m_sync ──► (m_sync_2) ──► everything that read m
//! ```
//! The rule of docs/semantics.md §9 still applies: a row of a trace contains the outputs of the synchronisers, so their delay is not part
//! of the chart's behaviour. [`add`] inserts the flip-flops before a text is written; [`strip`] removes them from the circuit that was read
//! back, after it has checked that each of them only passes on its pin. The remaining circuit is that of the chart, and is proved equal to
//! it.

use crate::codes;
use crate::vectors::Vectors;
use grafsynth_ir::arena::{Arena, Id, IdMap};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::logic::{Flop, FlopId, Logic, Node, PinInput, PinInputId};
use grafsynth_ir::net::Meta;
use grafsynth_logic::build::{needed, prune, roots};

/// The flip-flops after one input bit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chain {
    /// The pin.
    pub input: PinInputId,
    /// The flip-flops from the pin inwards; at least one.
    pub flops: Vec<FlopId>,
}

/// Inserts `stages` flip-flops after each input bit for which `wakes_as` returns a value; that value is their power-up value.
///
/// The new flip-flops follow all others, in the order of the pins. Without stages there are no chains, and nothing changes.
#[must_use]
pub fn add(
    mut logic: Logic,
    stages: u32,
    wakes_as: impl Fn(&PinInput) -> Option<bool>,
) -> (Logic, Vec<Chain>) {
    if stages == 0 {
        return (logic, Vec::new());
    }
    let mut chains = Vec::new();
    let mut behind: IdMap<PinInput, Option<FlopId>> = IdMap::filled(&logic.inputs, None);
    for (input, pin) in logic.inputs.clone().iter() {
        let Some(init) = wakes_as(pin) else { continue };
        let mut before = logic.nodes.push(Node::Input(input));
        let mut flops = Vec::new();
        for stage in 1..=stages {
            let name = match stage {
                1 => format!("{}_sync", pin.name),
                _ => format!("{}_sync_{stage}", pin.name),
            };
            let meta = Meta { label: format!("synchroniser of {}", pin.name), ..pin.meta.clone() };
            let flop = logic.flops.push(Flop { name, init, next: before, holds: None, meta });
            before = logic.nodes.push(Node::Flop(flop));
            flops.push(flop);
        }
        behind[input] = flops.last().copied();
        chains.push(Chain { input, flops });
    }
    let first_stages: Vec<_> =
        chains.iter().map(|chain| logic.flops[chain.flops[0]].next).collect();
    for (id, node) in logic.nodes.iter_mut() {
        if let Node::Input(input) = *node
            && let Some(flop) = behind[input]
            && !first_stages.contains(&id)
        {
            *node = Node::Flop(flop);
        }
    }
    (prune(logic), chains)
}

/// Removes the chains from a circuit that was read back.
///
/// # Errors
/// If a chain does more than delay its pin: its flip-flops have other functions, or something reads the chain before its end.
pub fn strip(mut logic: Logic, chains: &[Chain]) -> Result<Logic, Vec<Diagnostic>> {
    let findings: Vec<Diagnostic> = chains
        .iter()
        .filter(|chain| !is_chain(&logic, chain))
        .map(|chain| {
            let pin = &logic.inputs[chain.input].name;
            let message = format!("the synchroniser of `{pin}` reads back differently");
            Diagnostic::error(codes::NOT_READ_BACK, message)
                .help("this is a bug in grafsynth: please report it with the chart")
        })
        .collect();
    if !findings.is_empty() {
        return Err(findings);
    }
    let mut pin_of: IdMap<Flop, Option<Id<PinInput>>> = IdMap::filled(&logic.flops, None);
    for chain in chains {
        for flop in &chain.flops {
            pin_of[*flop] = Some(chain.input);
        }
    }
    let mut kept = Arena::new();
    let mut image: IdMap<Flop, Option<FlopId>> = IdMap::filled(&logic.flops, None);
    for (id, flop) in logic.flops.iter() {
        if pin_of[id].is_none() {
            image[id] = Some(kept.push(flop.clone()));
        }
    }
    for (_, node) in logic.nodes.iter_mut() {
        if let Node::Flop(flop) = *node {
            *node = match (pin_of[flop], image[flop]) {
                (Some(pin), _) => Node::Input(pin),
                (None, Some(flop)) => Node::Flop(flop),
                (None, None) => unreachable!("a flip-flop outside the chains is kept"),
            };
        }
    }
    logic.flops = kept;
    Ok(prune(logic))
}

/// True if each flip-flop stores the value of the one before it, and nothing else reads the pin or the chain before its end.
fn is_chain(logic: &Logic, chain: &Chain) -> bool {
    let Some((last, inner)) = chain.flops.split_last() else { return false };
    let mut source = Node::Input(chain.input);
    for &flop in &chain.flops {
        if logic.flops.get(flop).is_none_or(|flop| logic.nodes[flop.next] != source) {
            return false;
        }
        source = Node::Flop(flop);
    }
    // Only the next stage may read a stage before the end.
    let roots = roots(logic).zip(own_roots(logic, chain)).filter(|(_, is_own)| !is_own);
    let needed = needed(logic, roots.map(|(root, _)| root));
    logic.nodes.iter().all(|(id, node)| match node {
        Node::Input(input) => !needed[id] || *input != chain.input,
        Node::Flop(flop) => !needed[id] || *flop == *last || !inner.contains(flop),
        _ => true,
    })
}

/// For each root, in the order of [`roots`]: whether it is the D function of a flip-flop of the chain.
fn own_roots(logic: &Logic, chain: &Chain) -> impl Iterator<Item = bool> {
    logic.flops.ids().map(|id| chain.flops.contains(&id)).chain(std::iter::repeat(false))
}

/// Turns the vectors of the circuit without chains into those of the circuit with them. `vectors` begins with as many idle rows as there are stages, and the
/// pins of the chains get each row that many clocks earlier.
///
/// An output that reads a synchronised input without a register is checked only while that input does not change: the chain advances with the
/// same clock.
pub fn delayed(logic: &Logic, chains: &[Chain], vectors: &mut Vectors) {
    let Some(stages) = chains.first().map(|chain| chain.flops.len()) else { return };
    let n_rows = vectors.rows.len();
    let wanted: Vec<Vec<bool>> = vectors.rows.iter().map(|row| row.inputs.clone()).collect();
    let at = |row: usize| &wanted[row.min(n_rows - 1)];
    // The chains that each output reads directly.
    let reads: Vec<Vec<usize>> = logic
        .outputs
        .values()
        .map(|output| {
            if output.registered.is_some() || output.mealy {
                return Vec::new();
            }
            let needed = needed(logic, [output.value]);
            let reads = |chain: &&Chain| {
                logic.nodes.iter().any(|(id, node)| {
                    needed[id]
                        && matches!(node, Node::Flop(flop) if chain.flops.last() == Some(flop))
                })
            };
            chains.iter().filter(reads).map(|chain| chain.input.index()).collect()
        })
        .collect();
    for row in 0..n_rows {
        let made = &mut vectors.rows[row];
        for chain in chains {
            let pin = chain.input.index();
            made.inputs[pin] = at(row + stages)[pin];
        }
        for (output, pins) in made.outputs.iter_mut().zip(&reads) {
            if pins.iter().any(|&pin| at(row)[pin] != at(row + 1)[pin]) {
                *output = None;
            }
        }
        made.flops.resize(logic.flops.len(), None);
    }
}

#[cfg(test)]
mod tests {
    use super::{add, strip};
    use crate::{Dialect, EmitOptions, emit, read, rebind};
    use grafsynth_ir::logic::{Logic, Node};
    use grafsynth_logic::build::Builder;

    /// `q := enable :+: q`, and a pin that shows both.
    fn toggle() -> Logic {
        let mut builder = Builder::default();
        let (q, value) = builder.flop_named("q", true);
        let enable = builder.input_named("enable");
        builder.logic.flops[q].next = builder.xor(value, enable);
        builder.finish()
    }

    #[test]
    fn what_is_put_in_comes_out_again_in_every_language() {
        for stages in 0..=2 {
            let (with, chains) = add(toggle(), stages, |_| Some(false));
            assert_eq!(with.flops.len(), 1 + stages as usize);
            for dialect in Dialect::ALL {
                let emitted = emit(&with, dialect, &EmitOptions::default()).unwrap();
                let (back, found) = read(dialect, Default::default(), &emitted.text);
                let mut back = back.unwrap_or_else(|| panic!("{found:?}\n{}", emitted.text));
                assert!(rebind(&mut back, &emitted).is_empty(), "{}", emitted.text);
                let without = strip(back, &chains).unwrap();
                assert_eq!(without.flops.len(), 1, "{}", emitted.text);
                assert!(without.nodes.values().any(|node| matches!(node, Node::Input(_))));
            }
        }
    }

    #[test]
    fn a_chain_that_is_read_on_the_way_is_none() {
        let (mut with, chains) = add(toggle(), 2, |_| Some(false));
        let q = with.flops.ids().next().unwrap();
        // The circuit reads the first stage instead of the second.
        let early = with.flops[chains[0].flops[1]].next;
        let late = with.nodes.ids().find(|&id| with.nodes[id] == Node::Flop(chains[0].flops[1]));
        let early = with.nodes[early].clone();
        for (id, node) in with.nodes.iter_mut() {
            if Some(id) == late {
                *node = early.clone();
            }
        }
        assert!(with.flops[q].init);
        assert!(strip(with, &chains).is_err());
        // And one whose first stage does not store the pin.
        let (mut with, chains) = add(toggle(), 1, |_| Some(false));
        let next = with.flops[q].next;
        for (id, flop) in with.flops.iter_mut() {
            if chains[0].flops.contains(&id) {
                flop.next = next;
            }
        }
        assert!(strip(with, &chains).is_err());
    }
}
