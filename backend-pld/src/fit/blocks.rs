//! Placement on a device with logic blocks: not every macrocell has a pin, and each block can read only a limited number of signals.
//!
//! The checks use only data that equations determine: macrocells, macrocells that wide sums take from their neighbours, pins with a macrocell, and the
//! number of signals that a block reads. Functions without a pin are assigned to a block but to no macrocell: the fitter chooses the macrocell and
//! the routing of every signal.

use super::attempt::Attempt;
use super::misfit::{Misfit, Obstacles, UnplacedFunction};
use super::need::{Need, View};
use super::pins::Order;
use crate::device::{Blocks, Device};
use crate::equations::{Equations, SignalIndex, Source};
use grafsynth_ir::Gather;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::ranks::sort_by_rank;
use std::collections::BTreeSet;

/// A block during placement.
struct Block {
    cells: u32,
    pins: Vec<u32>,
    reads: BTreeSet<SignalIndex>,
}

/// A function that needs a block.
struct Function {
    signal: SignalIndex,
    cells: u32,
    is_shown: bool,
    pin: Option<u32>,
    reads: BTreeSet<SignalIndex>,
}

impl Equations {
    /// Assigns the pins of a device with blocks; returns the reason if the design does not fit. Impossible requests are findings.
    pub(crate) fn assign_to_blocks(
        &mut self,
        blocks: &'static Blocks,
        order: &Order,
        findings: &mut Vec<Diagnostic>,
        before: usize,
    ) -> Option<Misfit> {
        let has_registers = order.has_registers;
        let view = View { device: self.device, mode: None, has_registers };
        let refused = order.refused(&view);
        let attempt =
            Attempt { view, pins: Vec::new(), left: Vec::new(), refused, moved: Vec::new() };
        self.bad_pins(order, &[attempt], findings);
        if findings.len() > before {
            return None;
        }
        self.only_board_pins(order);
        let is_wished = |pin: &u32| order.board.iter().any(|(wished, ..)| wished == pin);
        let needs: Vec<(SignalIndex, Need)> =
            order.wishes.iter().map(|wish| (wish.index, wish.need)).collect();
        let obstacles =
            self.assign_blocks(blocks, view.pins().filter(|pin| !is_wished(pin)).collect(), &needs);
        if obstacles.count() == 0 {
            self.copy_shared_pins();
            self.has_pins = true;
            return None;
        }
        self.only_board_pins(order);
        Some(Misfit::new(self, vec![obstacles]))
    }

    /// Assigns functions to blocks and visible signals to pins. `free` contains the pins without a request, and `needs` the requirement of each
    /// signal.
    fn assign_blocks(
        &mut self,
        blocks: &'static Blocks,
        mut free: Vec<u32>,
        needs: &[(SignalIndex, Need)],
    ) -> Obstacles {
        let device = self.device;
        let mut misfit = Obstacles::default();
        let mut all: Vec<Block> = (0..blocks.n_blocks)
            .map(|block| Block {
                cells: blocks.n_cells,
                pins: device
                    .macrocells
                    .iter()
                    .filter(|cell| cell.block == block && free.contains(&cell.pin))
                    .map(|cell| cell.pin)
                    .collect(),
                reads: BTreeSet::new(),
            })
            .collect();
        let has_registers = self.equations.iter().any(|equation| equation.is_registered);
        let view = View { device, mode: None, has_registers };
        // Inputs use pins without a macrocell first; the others are placed last, so that they do not take pins that outputs need.
        for &(signal, need) in needs {
            let wants = matches!(need, Need::Clock | Need::Input);
            if wants && self.signals[signal].pin.is_none() {
                let own = free.iter().position(|pin| {
                    device.macrocell(*pin).is_none() && view.refuses(need, *pin).is_none()
                });
                self.signals[signal].pin = own.map(|at| free.remove(at));
            }
        }
        let mut functions = self.functions(blocks);
        sort_by_rank(&mut functions, |own| {
            [
                u64::from(own.pin.is_none()),
                !u64::from(own.cells),
                u64::from(!own.is_shown),
                own.signal as u64,
            ]
        });
        for own in functions {
            let Some(at) = choose(&all, blocks, device, &own) else {
                let signal = &self.signals[own.signal];
                misfit.homeless.push(UnplacedFunction {
                    name: signal.name.clone(),
                    n_signals: own.reads.len(),
                    meta: signal.meta.clone(),
                });
                continue;
            };
            all[at].cells -= own.cells;
            all[at].reads.extend(&own.reads);
            if own.is_shown && own.pin.is_none() {
                let pin = all[at].pins.remove(0);
                free.retain(|other| *other != pin);
                self.signals[own.signal].pin = Some(pin);
            }
        }
        for &(signal, need) in needs {
            if !matches!(need, Need::Clock | Need::Input) || self.signals[signal].pin.is_some() {
                continue;
            }
            let possible = free.iter().position(|pin| view.refuses(need, *pin).is_none());
            match possible {
                Some(at) => self.signals[signal].pin = Some(free.remove(at)),
                None => misfit.inputs.push(self.signals[signal].name.clone()),
            }
        }
        misfit
    }

    /// The functions that need macrocells. The clock uses its own net, and no term reads it; the value of a T flip-flop reaches its own gate without the
    /// switch matrix.
    fn functions(&self, blocks: &Blocks) -> Vec<Function> {
        self.equations
            .iter()
            .map(|equation| {
                let signal = &self.signals[equation.signal];
                let literals = equation.products.iter().chain(&equation.inverter).flatten();
                let terms = u32::try_from(equation.n_terms()).unwrap_or(u32::MAX);
                Function {
                    signal: equation.signal,
                    cells: terms.div_ceil(blocks.own_terms).max(1),
                    is_shown: matches!(signal.source, Source::Output(_))
                        || signal.pin.is_some()
                        || self.signals.iter().any(|own| own.shared == Some(equation.signal)),
                    pin: signal.pin,
                    reads: literals.map(|(signal, _)| *signal).gather(),
                }
            })
            .collect()
    }
}

/// The block with room that must read the fewest additional signals; for a function with a pin, the block of that pin.
fn choose(all: &[Block], blocks: &Blocks, device: &Device, own: &Function) -> Option<usize> {
    let fixed = own.pin.and_then(|pin| device.macrocell(pin)).map(|cell| cell.block as usize);
    let more = |block: &Block| own.reads.difference(&block.reads).count();
    let has_room = |(at, block): &(usize, &Block)| {
        fixed.is_none_or(|fixed| fixed == *at)
            && block.cells >= own.cells
            && (!own.is_shown || own.pin.is_some() || !block.pins.is_empty())
            && block.reads.len() + more(block) <= blocks.fan_in as usize
    };
    all.iter()
        .enumerate()
        .filter(has_room)
        .min_by_key(|(at, block)| (more(block), u32::MAX - block.cells, *at))
        .map(|(at, _)| at)
}
