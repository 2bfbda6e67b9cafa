//! Signals matched to pins.

use super::need::{Need, View};
use crate::equations::{SignalIndex, Source, source_name};
use grafsynth_ir::logic::Logic;
use std::collections::{BTreeMap, BTreeSet};

/// What a signal is known by from one build to the next: its kind and its name in the source, or for a part of a function the name given to it.
pub(crate) fn source_key(logic: &Logic, source: Source, name: &str) -> u64 {
    let (kind, name) = match source {
        Source::Clock => (0, "clock"),
        Source::Input(_) => (1, source_name(logic, source)),
        Source::Flop(_) => (2, source_name(logic, source)),
        Source::Output(_) => (3, source_name(logic, source)),
        Source::Buried(_) => (4, name),
    };
    std::iter::once(kind).chain(name.bytes()).fold(0xCBF2_9CE4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3)
    })
}

/// How much a signal and a pin like each other: a number that looks random and depends on nothing else, the finaliser of splitmix64.
fn liking(key: u64, pin: u32) -> u64 {
    let mut mixed = key ^ u64::from(pin).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}

/// A signal that looks for a pin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wish {
    pub(crate) index: SignalIndex,
    pub(crate) need: Need,
    /// [`source_key`].
    pub(crate) key: u64,
    /// The pin that it had in an earlier build.
    pub(crate) kept: Option<u32>,
}

/// Signals to pins, so that a small edit of the chart moves few of them. All pairs of a signal and a pin that can carry it are gone through in one fixed
/// order, and a pair is taken where both are still free: first pins that are to be kept, then by what the signal needs, then by [`liking`]. What a signal
/// likes depends on its name alone, not on other signals, its place in the chart or the number of its products; so a signal moves only if its pin can no
/// longer hold it, or one that likes the pin better comes. Who finds none after that takes one whose signal can go elsewhere: everything that can be placed
/// together is placed.
pub(crate) struct Matching {
    view: View,
    free: Vec<u32>,
    taken: BTreeMap<u32, (SignalIndex, Need)>,
}

impl Matching {
    /// Nothing is placed yet; these pins are free.
    pub(crate) fn new(view: View, free: Vec<u32>) -> Self {
        Matching { view, free, taken: BTreeMap::new() }
    }

    /// Which signal each pin has been given to.
    pub(crate) fn pins(&self) -> impl Iterator<Item = (u32, SignalIndex)> + '_ {
        self.taken.iter().map(|(pin, (index, _))| (*pin, *index))
    }

    /// Places what can be placed, and gives the others.
    pub(crate) fn place_all(&mut self, wishes: &[Wish]) -> Vec<Wish> {
        let mut pairs: Vec<((u32, u64, u32, SignalIndex), usize)> = Vec::new();
        for (at, wish) in wishes.iter().enumerate() {
            for &pin in &self.free {
                if self.view.refuses(wish.need, pin).is_none() {
                    let level = if wish.kept == Some(pin) { 0 } else { self.level(wish.need, pin) };
                    pairs.push(((level, liking(wish.key, pin), pin, wish.index), at));
                }
            }
        }
        pairs.sort_unstable();
        let mut is_placed = vec![false; wishes.len()];
        for ((_, _, pin, index), at) in pairs {
            if !is_placed[at] && self.free.contains(&pin) {
                is_placed[at] = true;
                self.free.retain(|other| *other != pin);
                self.taken.insert(pin, (index, wishes[at].need));
            }
        }
        // The widest sums first: those that stay without a pin then are as few and as narrow as can be.
        let mut open: Vec<usize> = (0..wishes.len()).filter(|at| !is_placed[*at]).collect();
        open.sort_by_key(|&at| (wishes[at].need.order(), wishes[at].key));
        let mut left = Vec::new();
        for at in open {
            let wish = wishes[at];
            if !self.place(wish, &mut BTreeSet::new()) {
                left.push(wish);
            }
        }
        left
    }

    /// Finds a pin for a signal, if need be by moving others.
    fn place(&mut self, wish: Wish, tried: &mut BTreeSet<u32>) -> bool {
        let Wish { index, need, key, .. } = wish;
        let mut possible: Vec<u32> = (1..=self.view.device.n_pins)
            .filter(|pin| self.free.contains(pin) || self.taken.contains_key(pin))
            .filter(|pin| self.view.refuses(need, *pin).is_none())
            .collect();
        possible.sort_by_key(|pin| (self.level(need, *pin), liking(key, *pin)));
        if let Some(pin) = possible.iter().copied().find(|pin| self.free.contains(pin)) {
            self.free.retain(|other| *other != pin);
            self.taken.insert(pin, (index, need));
            return true;
        }
        for pin in possible {
            let Some(&(other, others_need)) = self.taken.get(&pin) else { continue };
            // The order in which one that makes room looks for another pin is of no matter.
            let other = Wish { index: other, need: others_need, key, kept: None };
            if tried.insert(pin) && self.place(other, tried) {
                self.taken.insert(pin, (index, need));
                return true;
            }
        }
        false
    }

    /// What goes first: the clock, then macrocells; an input takes what only inputs can use, then a macrocell that cannot be read back.
    fn level(&self, need: Need, pin: u32) -> u32 {
        match need {
            Need::Clock => 1,
            Need::Macrocell { .. } => 2,
            Need::Input if self.view.device.macrocell(pin).is_none() => 3,
            Need::Input if self.view.device.deaf_pins.contains(&pin) => 4,
            Need::Input => 5,
        }
    }
}
