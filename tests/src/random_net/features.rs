//! The features of a random net, and the sets of features that the tests use.

use grafsynth_ir::net::Policy;
use grafsynth_sim::Random;

/// The features of a random net. A feature that is off never occurs; one that is on occurs in some nets.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "each flag names its feature")]
#[expect(clippy::struct_excessive_bools, reason = "they are switches")]
pub struct Features {
    /// The policies to choose from; at least one.
    pub policies: Vec<Policy>,
    pub single: bool,
    pub stable: bool,
    /// The largest number of steps, at least 1. A statechart may have a few more, to close its regions.
    pub max_steps: usize,
    /// Source and sink transitions, shared sources, several initial steps, and transitions from anywhere to anywhere.
    pub odd_shapes: bool,
    /// Chains of steps whose transitions compete pairwise, up to 15 steps more than `max_steps`.
    pub conflict_chains: bool,
    pub edges: bool,
    pub timers: bool,
    /// Values of variables and inputs: 8-bit, negative, and across the 16-bit limit.
    pub integers: bool,
    /// The first and last values of 16 and 32 bits and one beyond, and non-constant divisors.
    pub wide_integers: bool,
    /// Times near the maximum of 8 and 16 bits.
    pub long_times: bool,
    pub arrays: bool,
    pub events: bool,
    pub raise: bool,
    pub stored_outputs: bool,
    pub controlled_actions: bool,
    pub tasks: bool,
    /// Variables of halting steps are buffered or protected.
    pub sharing: bool,
    pub reactions: bool,
    pub forcing: bool,
    pub enclosing: bool,
    pub several_parts: bool,
    pub history: bool,
    pub sends: bool,
    /// Many sends, most of them delayed and some cancelled.
    pub delayed_sends: bool,
    /// Statecharts with much activity on entry and exit: lists of composites that read the bits of states entered or left with them, and
    /// many transitions to histories, whose defaults have lists.
    pub entries: bool,
    /// 12 to 20 inputs.
    pub many_inputs: bool,
    pub finals: bool,
    pub mealy: bool,
    /// What parts of a split have: outputs that show that a transition fires, and an END that waits for a later round. It uses its own random numbers.
    pub firings: bool,
    pub restart: bool,
    pub otherwise: bool,
    pub simultaneous: bool,
    pub fire_one: bool,
    pub externs: bool,
    pub unspecified: bool,
    pub assumptions: bool,
    /// A condition that forces all outputs, and safe values for it. It uses its own random numbers: the rest of a net is the same without it.
    pub emergency: bool,
    /// True if most receptivities read inputs only, so that whole components only wait for inputs.
    pub waits_for_inputs: bool,
    /// As in structured text: most steps have actions of their own with `N` and a body, and `N` drives outputs in several steps.
    pub step_actions: bool,
}

impl Features {
    /// All features of semantics.md, without numbers and times at the limits of C types.
    #[must_use]
    pub fn everything() -> Self {
        use Policy::{All, InnerFirst, OuterFirst, Priority, PriorityAge};
        Features {
            policies: vec![All, Priority, PriorityAge, InnerFirst, OuterFirst],
            single: true,
            stable: true,
            max_steps: 12,
            odd_shapes: true,
            conflict_chains: true,
            edges: true,
            timers: true,
            integers: true,
            wide_integers: false,
            long_times: false,
            arrays: true,
            events: true,
            raise: true,
            stored_outputs: true,
            controlled_actions: true,
            tasks: true,
            sharing: true,
            reactions: true,
            forcing: true,
            enclosing: true,
            several_parts: true,
            history: true,
            sends: true,
            delayed_sends: false,
            entries: false,
            many_inputs: false,
            finals: true,
            mealy: true,
            firings: false,
            restart: true,
            otherwise: true,
            simultaneous: true,
            fire_one: true,
            externs: true,
            unspecified: false,
            assumptions: true,
            emergency: true,
            waits_for_inputs: false,
            step_actions: false,
        }
    }

    /// All features of emitted programs, including numbers and times at the limits of 8, 16 and 32 bits.
    #[must_use]
    pub fn program() -> Self {
        Features {
            wide_integers: true,
            long_times: true,
            delayed_sends: true,
            entries: true,
            many_inputs: true,
            firings: true,
            ..Self::everything()
        }
    }

    /// Statecharts with much activity on entry, exit and sending.
    #[must_use]
    pub fn entering() -> Self {
        Features {
            policies: vec![Policy::InnerFirst, Policy::OuterFirst],
            single: false,
            stable: true,
            max_steps: 14,
            integers: true,
            events: true,
            raise: true,
            reactions: true,
            history: true,
            sends: true,
            delayed_sends: true,
            entries: true,
            many_inputs: true,
            finals: true,
            timers: true,
            ..Self::plain()
        }
    }

    /// Some of these features, chosen by the seed: every switch that is on is turned off with a probability of one third. If all charts had
    /// all features, an error that occurs only if a feature is absent would not be found.
    #[must_use]
    pub fn some(&self, seed: u64) -> Self {
        let mut random = Random::new(seed ^ 0x5eed);
        let mut some = self.clone();
        if let Some(policy) = random.pick(&self.policies) {
            some.policies = vec![*policy];
        }
        for switch in some.switches() {
            *switch &= !random.one_in(3);
        }
        // At least one evolution must remain.
        some.single |= !some.stable;
        some
    }

    /// All switches except `unspecified`, which leaves cells undefined that two engines may fill differently, and `waits_for_inputs` and `step_actions`,
    /// which are shapes and not features of a net.
    fn switches(&mut self) -> [&mut bool; 35] {
        [
            &mut self.single,
            &mut self.stable,
            &mut self.odd_shapes,
            &mut self.conflict_chains,
            &mut self.edges,
            &mut self.timers,
            &mut self.integers,
            &mut self.wide_integers,
            &mut self.long_times,
            &mut self.arrays,
            &mut self.events,
            &mut self.raise,
            &mut self.stored_outputs,
            &mut self.controlled_actions,
            &mut self.tasks,
            &mut self.reactions,
            &mut self.forcing,
            &mut self.enclosing,
            &mut self.several_parts,
            &mut self.history,
            &mut self.sends,
            &mut self.finals,
            &mut self.mealy,
            &mut self.restart,
            &mut self.otherwise,
            &mut self.simultaneous,
            &mut self.fire_one,
            &mut self.externs,
            &mut self.assumptions,
            &mut self.sharing,
            &mut self.emergency,
            &mut self.delayed_sends,
            &mut self.entries,
            &mut self.many_inputs,
            &mut self.firings,
        ]
    }

    /// Steps, transitions, conditions over Boolean inputs and step bits, continuous outputs; nothing else.
    #[must_use]
    pub fn plain() -> Self {
        Features {
            policies: vec![Policy::All, Policy::Priority, Policy::PriorityAge],
            single: true,
            stable: false,
            max_steps: 8,
            odd_shapes: false,
            conflict_chains: true,
            edges: false,
            timers: false,
            integers: false,
            wide_integers: false,
            long_times: false,
            arrays: false,
            events: false,
            raise: false,
            stored_outputs: false,
            controlled_actions: false,
            tasks: false,
            sharing: false,
            reactions: false,
            forcing: false,
            enclosing: false,
            several_parts: false,
            history: false,
            sends: false,
            delayed_sends: false,
            entries: false,
            many_inputs: false,
            finals: false,
            mealy: false,
            firings: false,
            restart: false,
            otherwise: false,
            simultaneous: false,
            fire_one: false,
            externs: false,
            unspecified: false,
            assumptions: false,
            emergency: false,
            waits_for_inputs: false,
            step_actions: false,
        }
    }

    /// The Grafcet features that the table engine supports without a program.
    #[must_use]
    pub fn tabular() -> Self {
        Features {
            policies: vec![Policy::All, Policy::Priority],
            stable: true,
            odd_shapes: true,
            edges: true,
            timers: true,
            integers: true,
            stored_outputs: true,
            emergency: true,
            ..Self::plain()
        }
    }

    /// Statecharts for the tables of states and transitions: regions, histories, inner and outer transitions, events.
    #[must_use]
    pub fn tabular_statecharts() -> Self {
        Features {
            policies: vec![Policy::InnerFirst, Policy::OuterFirst],
            single: false,
            stable: true,
            max_steps: 12,
            timers: true,
            integers: true,
            events: true,
            edges: true,
            stored_outputs: true,
            emergency: true,
            reactions: true,
            history: true,
            ..Self::plain()
        }
    }

    /// The features of a chip: evolution `single`, small integers, no calls with arguments.
    #[must_use]
    pub fn chip() -> Self {
        Features {
            stable: false,
            firings: true,
            arrays: false,
            externs: false,
            policies: vec![Policy::All, Policy::Priority, Policy::PriorityAge],
            max_steps: 8,
            ..Self::everything()
        }
    }

    /// These features without statecharts.
    #[must_use]
    pub fn without_statecharts(mut self) -> Self {
        self.policies.retain(|policy| !policy.is_statechart());
        self
    }
}
