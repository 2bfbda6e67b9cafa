//! Assigns signals to pins.

use super::need::{Need, View};
use crate::device::Clock;
use crate::equations::{SignalIndex, Source, source_name};
use grafsynth_ir::logic::Logic;
use std::collections::{BTreeMap, BTreeSet};

/// The key that identifies a signal from one build to the next: its kind and its name in the source, or for a part of a function its generated name.
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

/// The preference of a signal for a pin: a pseudo-random number that depends only on the key and the pin (the finaliser of
/// splitmix64).
fn liking(key: u64, pin: u32) -> u64 {
    let mut mixed = key ^ u64::from(pin).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}

/// The kind of a signal for the person who wires the chip: pins of inputs and outputs follow the order of their declarations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Rank {
    /// The clock, or an input with its index among the signals.
    Input(usize),
    /// An output with its index, or the flip-flop that this output shows.
    Output(usize),
    /// A flip-flop or a part of a function that no output shows.
    Inner,
}

/// A signal that needs a pin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PinRequest {
    pub(crate) index: SignalIndex,
    pub(crate) need: Need,
    /// The result of [`source_key`].
    pub(crate) key: u64,
    /// Its pin in an earlier build.
    pub(crate) kept: Option<u32>,
    pub(crate) rank: Rank,
    /// The pin given by the order of declarations; `None` if the order does not determine it.
    pub(crate) natural: Option<u32>,
}

/// Assigns natural pins in the order of declarations: to inputs the pins that are only inputs, to outputs the macrocells. If there are not enough
/// such pins, the remaining inputs get the last macrocells.
pub(crate) fn in_order(view: View, free: &[u32], wishes: &mut [PinRequest]) {
    let is_cell = |pin: &u32| view.device.macrocell(*pin).is_some();
    let (cells, plain): (Vec<u32>, Vec<u32>) = free.iter().copied().partition(is_cell);
    let can_be_input = |pin: &u32| view.refuses(Need::Input, *pin).is_none();
    let mut order: Vec<usize> = (0..wishes.len()).collect();
    order.sort_by_key(|at| wishes[*at].rank);
    // A clock with a dedicated pin needs no other.
    let is_input = |wish: &PinRequest| {
        let is_fixed = matches!((wish.need, view.device.clock), (Need::Clock, Clock::Pin(_)));
        matches!(wish.rank, Rank::Input(_)) && !is_fixed
    };
    let inputs: Vec<usize> = order.iter().copied().filter(|at| is_input(&wishes[*at])).collect();
    let mut pins: Vec<u32> = plain.into_iter().filter(can_be_input).collect();
    let readable: Vec<u32> = cells.iter().copied().filter(can_be_input).collect();
    let n_more = inputs.len().saturating_sub(pins.len());
    pins.extend(&readable[readable.len().saturating_sub(n_more)..]);
    for (at, pin) in inputs.into_iter().zip(pins) {
        wishes[at].natural = Some(pin);
    }
    let outputs = order.into_iter().filter(|at| matches!(wishes[*at].rank, Rank::Output(_)));
    for (at, pin) in outputs.collect::<Vec<_>>().into_iter().zip(cells) {
        wishes[at].natural = Some(pin);
    }
}

/// Assigns signals to pins: inputs and outputs in the order of their declarations, all others such that a small edit of the chart moves few of them.
///
/// All pairs of a signal and a pin that can carry it are tried in one fixed order, and a pair is used if both are still free: first the pins of an
/// earlier build, then those of [`in_order`], then the first possible pins for outputs whose natural pin is not possible, then flip-flops and parts
/// that no output shows, by [`liking`], then the other inputs. The preference of such a flip-flop depends only on its name, not on other signals, its
/// position in the chart or the number of its products. So it moves only if its pin cannot hold it any more, or if a new signal has a higher
/// preference for that pin.
///
/// A signal that still has no pin then displaces one that can move to another pin, so that as many signals as possible are placed.
pub(crate) struct Matching {
    view: View,
    free: Vec<u32>,
    taken: BTreeMap<u32, PinRequest>,
    /// True if the order of declarations gives some signals a pin.
    has_order: bool,
}

impl Matching {
    /// An empty assignment; these pins are free.
    pub(crate) fn new(view: View, free: Vec<u32>) -> Self {
        Matching { view, free, taken: BTreeMap::new(), has_order: false }
    }

    /// The signal assigned to each pin.
    pub(crate) fn pins(&self) -> impl Iterator<Item = (u32, SignalIndex)> + '_ {
        self.taken.iter().map(|(pin, wish)| (*pin, wish.index))
    }

    /// Places as many signals as possible, and returns the others.
    pub(crate) fn place_all(&mut self, wishes: &[PinRequest]) -> Vec<PinRequest> {
        self.has_order = wishes.iter().any(|wish| wish.natural.is_some());
        let mut pairs: Vec<((u32, u64, u32, SignalIndex), usize)> = Vec::new();
        for (at, wish) in wishes.iter().enumerate() {
            for &pin in &self.free {
                if self.view.refuses(wish.need, pin).is_none() {
                    let (level, liking) = self.preference(wish, pin);
                    pairs.push(((level, liking, pin, wish.index), at));
                }
            }
        }
        pairs.sort_unstable();
        let mut is_placed = vec![false; wishes.len()];
        for ((_, _, pin, _), at) in pairs {
            if !is_placed[at] && self.free.contains(&pin) {
                is_placed[at] = true;
                self.free.retain(|other| *other != pin);
                self.taken.insert(pin, wishes[at]);
            }
        }
        // The widest sums first: the signals left without a pin are then as few and as narrow as possible.
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

    /// Finds a pin for a signal, if necessary by moving others.
    fn place(&mut self, wish: PinRequest, tried: &mut BTreeSet<u32>) -> bool {
        let mut possible: Vec<u32> = (1..=self.view.device.n_pins)
            .filter(|pin| self.free.contains(pin) || self.taken.contains_key(pin))
            .filter(|pin| self.view.refuses(wish.need, *pin).is_none())
            .collect();
        possible.sort_by_key(|pin| self.preference(&wish, *pin));
        if let Some(pin) = possible.iter().copied().find(|pin| self.free.contains(pin)) {
            self.free.retain(|other| *other != pin);
            self.taken.insert(pin, wish);
            return true;
        }
        // Signals that are not wired on the board move first.
        if self.has_order {
            possible.sort_by_key(|pin| {
                self.taken.get(pin).is_some_and(|taken| taken.rank != Rank::Inner)
            });
        }
        for pin in possible {
            let Some(&other) = self.taken.get(&pin) else { continue };
            if tried.insert(pin) && self.place(other, tried) {
                self.taken.insert(pin, wish);
                return true;
            }
        }
        false
    }

    /// The priority of a pair of signal and pin: its group and its order within the group; smaller numbers come first. An input whose
    /// natural pin is not possible gets the first pin that only inputs can use.
    fn preference(&self, wish: &PinRequest, pin: u32) -> (u32, u64) {
        let first = u64::from(pin);
        if wish.kept == Some(pin) {
            return (0, first);
        }
        match (wish.need, wish.rank) {
            (Need::Clock, _) if wish.natural.is_none() => (1, first),
            _ if wish.natural == Some(pin) => (1, first),
            (_, Rank::Output(_)) => (2, first),
            (_, Rank::Inner) => (3, liking(wish.key, pin)),
            _ if self.view.device.macrocell(pin).is_none() => (4, first),
            _ if self.view.device.deaf_pins.contains(&pin) => (5, first),
            _ => (6, first),
        }
    }
}
