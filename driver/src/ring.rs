//! Reads the trace ring of an emitted chart (`build --target c --trace-ring N`, bytes as in [`grafsynth_backend_c::trace`]) and reports what the chart did.
//!
//! The ring contains the transitions that fired in each reaction, but not the inputs, so it is replayed without receptivities: each micro-step must be
//! one that the situation enables and the conflict policy allows ([`Simulator::replay`]). A ring that never wrapped is replayed from reset. In a ring that
//! wrapped, the first micro-step may be incomplete, and the situation before it is lost. From the second micro-step on, each transition shows that its
//! preceding steps were active, and a proved sequential component with an active step has no other active step. Steps whose state is not known yet are
//! shown as `?`. Charts with enclosing steps, forcing or states are not reconstructed like this: their transitions are listed.

use grafsynth_backend_c::trace::{BEGINS, ENTRY_BYTES, HEADER_BYTES, MAGIC, hash};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{Evolution, Net, Policy, StepId, StepKind, TransitionId, TransitionKind};
use grafsynth_ir::{IdMap, Valid};
use grafsynth_sim::Simulator;

/// A ring with its entries in order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Ring {
    /// Reactions since reset, modulo 2^32.
    pub reactions: u32,
    /// Transitions fired since reset; more than the number of entries if older ones were overwritten.
    pub count: u32,
    /// The capacity of the ring.
    pub places: u16,
    /// The entries, oldest first.
    pub entries: Vec<Entry>,
}

/// One transition that fired.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry {
    /// The number of its reaction; the first has the number 1.
    pub reaction: u32,
    /// The transition.
    pub transition: TransitionId,
    /// True if it is the first of its micro-step; only in charts that mark micro-steps.
    pub begins: bool,
}

impl Ring {
    /// The number of overwritten entries.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.count.saturating_sub(u32::try_from(self.entries.len()).unwrap_or(u32::MAX))
    }
}

/// A reaction in which something fired.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reaction {
    /// Its number; 0 is the reset.
    pub number: u32,
    /// The transitions that fired, by micro-step.
    pub fired: Vec<Vec<TransitionId>>,
    /// The steps that are known to be active after it, in declaration order.
    pub active: Vec<StepId>,
    /// True if it is known that no other step is active.
    pub is_known: bool,
}

/// The behaviour of the chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replay {
    /// The reactions in order; row 0 is the first if nothing was overwritten.
    pub reactions: Vec<Reaction>,
    /// Why the remaining entries are impossible in the chart; `None` if all entries are possible.
    pub broken: Option<String>,
}

/// Reads a dump of the ring: its bytes, or the bytes as hexadecimal text with optional white space.
///
/// # Errors
/// The dump is not a ring, is corrupt, or belongs to another chart.
pub fn parse(net: &Net, dump: &[u8]) -> Result<Ring, String> {
    let from_text;
    let bytes = if dump.starts_with(&MAGIC) {
        dump
    } else {
        from_text = hexadecimal(dump).ok_or("this is neither a trace ring nor hexadecimal text")?;
        &from_text
    };
    if !bytes.starts_with(&MAGIC) {
        return Err("this is not a trace ring: it does not begin with GTR1".to_owned());
    }
    let byte = |at: usize| bytes.get(at).copied().unwrap_or(0);
    let short = |at: usize| u16::from_le_bytes([byte(at), byte(at + 1)]);
    let long = |at: usize| u32::from_le_bytes([byte(at), byte(at + 1), byte(at + 2), byte(at + 3)]);
    let (reactions, count, places, next) = (long(8), long(12), short(16), short(18));
    let expected = HEADER_BYTES + ENTRY_BYTES * usize::from(places);
    if bytes.len() < HEADER_BYTES || bytes.len() != expected {
        return Err(format!(
            "the trace ring is truncated: it has {} bytes, expected {expected} for {places} entries",
            bytes.len()
        ));
    }
    if long(4) != hash(net) {
        return Err(format!(
            "the trace ring is of another chart, of another version of this one, or of one built with other options (`--for`, `--assert`, ..): its hash is {:08x}, that of `{}` is {:08x}",
            long(4),
            net.name,
            hash(net)
        ));
    }
    let wrapped = count >= u32::from(places);
    if places == 0 || next >= places || (!wrapped && count != u32::from(next)) {
        return Err("the trace ring is corrupt: its numbers contradict each other".to_owned());
    }
    let order: Vec<u16> =
        if wrapped { (next..places).chain(0..next).collect() } else { (0..next).collect() };
    let mut entries: Vec<Entry> = Vec::with_capacity(order.len());
    for place in order {
        let at = HEADER_BYTES + ENTRY_BYTES * usize::from(place);
        let number = usize::from(short(at + 4) & !BEGINS);
        let reaction = long(at);
        // Reactions count modulo 2^32, so their ages are compared.
        let age = |it: u32| reactions.wrapping_sub(it);
        let is_late = entries.last().is_some_and(|last| age(reaction) > age(last.reaction));
        if number >= net.transitions.len() || is_late {
            return Err(format!("the trace ring is corrupt at entry {place}"));
        }
        entries.push(Entry {
            reaction,
            transition: TransitionId::from_index(number),
            begins: short(at + 4) & BEGINS != 0,
        });
    }
    Ok(Ring { reactions, count, places, entries })
}

fn hexadecimal(text: &[u8]) -> Option<Vec<u8>> {
    let digits: Option<Vec<u8>> = text
        .iter()
        .filter(|byte| !byte.is_ascii_whitespace())
        .map(|byte| char::from(*byte).to_digit(16).and_then(|digit| u8::try_from(digit).ok()))
        .collect();
    let digits = digits.filter(|digits| digits.len() % 2 == 0)?;
    Some(digits.chunks(2).map(|pair| pair[0] << 4 | pair[1]).collect())
}

/// Replays a ring.
#[must_use]
pub fn replay(net: &Valid<Net>, facts: &Facts, ring: &Ring) -> Replay {
    let reactions = grouped(net, ring);
    if ring.lost() == 0 {
        from_reset(net, reactions)
    } else if is_plain(net) {
        from_anywhere(net, facts, reactions)
    } else {
        Replay { reactions, broken: None }
    }
}

/// The entries, by reaction and micro-step.
fn grouped(net: &Net, ring: &Ring) -> Vec<Reaction> {
    let stable = net.settings.evolution != Evolution::Single;
    let mut reactions: Vec<Reaction> = Vec::new();
    for entry in &ring.entries {
        if reactions.last().is_none_or(|last| last.number != entry.reaction) {
            let (number, fired) = (entry.reaction, vec![Vec::new()]);
            reactions.push(Reaction { number, fired, active: Vec::new(), is_known: false });
        }
        let Some(reaction) = reactions.last_mut() else { continue };
        let is_new = reaction.fired.last().is_some_and(|last| !last.is_empty());
        if stable && entry.begins && is_new {
            reaction.fired.push(Vec::new());
        }
        if let Some(last) = reaction.fired.last_mut() {
            last.push(entry.transition);
        }
    }
    reactions
}

fn impossible(net: &Net, number: u32, fired: &[TransitionId]) -> String {
    let names: Vec<&str> = fired.iter().map(|id| net.transitions[*id].name.text.as_str()).collect();
    let verb = if names.len() == 1 { "fires" } else { "fire together" };
    format!("in reaction {number} {} {verb}, which is impossible in this chart", names.join(", "))
}

fn from_reset(net: &Valid<Net>, reactions: Vec<Reaction>) -> Replay {
    let mut simulator = Simulator::new(net);
    let situation = |simulator: &Simulator<'_>| -> Vec<StepId> {
        net.steps.ids().filter(|step| simulator.is_active(*step)).collect()
    };
    let active = situation(&simulator);
    let mut done = vec![Reaction { number: 0, fired: Vec::new(), active, is_known: true }];
    for mut reaction in reactions {
        for fired in &reaction.fired {
            if !simulator.replay(fired) {
                let broken = Some(impossible(net, reaction.number, fired));
                return Replay { reactions: done, broken };
            }
        }
        reaction.active = situation(&simulator);
        reaction.is_known = true;
        done.push(reaction);
    }
    Replay { reactions: done, broken: None }
}

/// True if the situation depends only on the preceding and following steps of transitions.
fn is_plain(net: &Net) -> bool {
    let is_leaf = |kind| matches!(kind, StepKind::Leaf);
    !net.settings.policy.is_statechart()
        && net.forcings.is_empty()
        && net.steps.values().all(|step| is_leaf(step.kind) && step.parent.is_none())
}

fn from_anywhere(net: &Net, facts: &Facts, reactions: Vec<Reaction>) -> Replay {
    let mut known: IdMap<grafsynth_ir::net::Step, Option<bool>> = IdMap::filled(&net.steps, None);
    let mut done: Vec<Reaction> = Vec::new();
    let mut is_first = true;
    for mut reaction in reactions {
        for fired in &reaction.fired {
            // The oldest micro-step may be partly overwritten.
            if std::mem::take(&mut is_first) {
                continue;
            }
            if !micro_step(net, facts, fired, &mut known) {
                let broken = Some(impossible(net, reaction.number, fired));
                return Replay { reactions: done, broken };
            }
        }
        reaction.active = net.steps.ids().filter(|step| known[*step] == Some(true)).collect();
        reaction.is_known = known.values().all(Option::is_some);
        done.push(reaction);
    }
    Replay { reactions: done, broken: None }
}

/// Applies a micro-step to the known situation; false on a contradiction.
fn micro_step(
    net: &Net,
    facts: &Facts,
    fired: &[TransitionId],
    known: &mut IdMap<grafsynth_ir::net::Step, Option<bool>>,
) -> bool {
    let competes = net.settings.policy != Policy::All;
    let mut taken: Vec<StepId> = Vec::new();
    for id in fired {
        let transition = &net.transitions[*id];
        for step in &transition.requires {
            let is_taken = transition.kind == TransitionKind::Move && competes;
            if known[*step] == Some(false) || (is_taken && taken.contains(step)) {
                return false;
            }
            known[*step] = Some(true);
        }
        if transition.kind == TransitionKind::Move {
            taken.extend(&transition.requires);
        }
    }
    if !settle(facts, known) {
        return false;
    }
    let moves: Vec<_> = fired
        .iter()
        .map(|id| &net.transitions[*id])
        .filter(|it| it.kind == TransitionKind::Move)
        .collect();
    for step in moves.iter().flat_map(|it| &it.requires) {
        known[*step] = Some(false);
    }
    for enter in moves.iter().flat_map(|it| &it.enters) {
        if let grafsynth_ir::net::Enter::Step(step) = enter {
            known[*step] = Some(true);
        }
    }
    settle(facts, known)
}

/// Applies the sequential components: if one step of a component is active, the others are not; if all others are inactive, the last one must be active.
/// False if two are active.
fn settle(facts: &Facts, known: &mut IdMap<grafsynth_ir::net::Step, Option<bool>>) -> bool {
    for component in &facts.components {
        let n_active = component.steps.iter().filter(|it| known[**it] == Some(true)).count();
        let mut unknown = component.steps.iter().filter(|it| known[**it].is_none());
        match (n_active, unknown.next(), unknown.next()) {
            (0, Some(last), None) if component.always => known[*last] = Some(true),
            (0, ..) => {}
            (1, ..) => {
                for step in &component.steps {
                    known[*step].get_or_insert(false);
                }
            }
            _ => return false,
        }
    }
    true
}

/// A replay as CSV: `scan,fired,steps`. Micro-steps are separated by `;`, and `?` marks what is not known yet.
#[must_use]
pub fn to_csv(net: &Net, replay: &Replay) -> String {
    let mut text = String::from("scan,fired,steps\n");
    for reaction in &replay.reactions {
        let fired: Vec<String> = reaction
            .fired
            .iter()
            .map(|micro_step| {
                let names: Vec<&str> =
                    micro_step.iter().map(|id| net.transitions[*id].name.text.as_str()).collect();
                names.join(" ")
            })
            .collect();
        let mut steps: Vec<&str> = reaction
            .active
            .iter()
            .map(|step| &net.steps[*step])
            .filter(|step| {
                let is_shown =
                    matches!(step.kind, StepKind::Leaf | StepKind::Enclosing | StepKind::Final);
                is_shown && !step.hidden
            })
            .map(|step| step.name.text.as_str())
            .collect();
        if !reaction.is_known {
            steps.push("?");
        }
        text.push_str(&format!("{},{},{}\n", reaction.number, fired.join("; "), steps.join(" ")));
    }
    text
}
