//! Pins: first those requested by the user, then the rest.

use super::attempt::{Attempt, Moved};
use super::matching::{Matching, PinRequest, Rank, in_order, source_key};
use super::misfit::{Misfit, Obstacles};
use super::need::{MovedBecause, MovedPin, Need, Refusal, View};
use crate::EmitOptions;
use crate::codes;
use crate::equations::{Equation, Equations, SignalIndex, Source, source_matches, source_name};
use grafsynth_ir::Span;
use grafsynth_ir::diag::{Diagnostic, nearest};
use grafsynth_ir::logic::Logic;
use std::collections::BTreeMap;

/// The signals to place, before a device's mode is chosen.
#[derive(Debug, Clone)]
pub(crate) struct Order {
    /// The user's requests: pin, signal, and its name in the request.
    pub(crate) board: Vec<(u32, SignalIndex, String)>,
    /// Everything that needs a pin, including the requested signals.
    pub(crate) wishes: Vec<PinRequest>,
    pub(crate) has_registers: bool,
    /// The locations of the requests.
    spans: BTreeMap<String, Span>,
}

impl Order {
    /// Places everything in one mode of the device.
    pub(crate) fn attempt(&self, view: View) -> Attempt {
        let refused = self.refused(&view);
        let is_good = |at: &usize| refused.iter().all(|(bad, ..)| bad != at);
        let mut pins: Vec<(u32, SignalIndex)> = (0..self.board.len())
            .filter(is_good)
            .map(|at| (self.board[at].0, self.board[at].1))
            .collect();
        let is_wished = |pin: &u32| self.board.iter().any(|(wished, ..)| wished == pin);
        let free: Vec<u32> = view.pins().filter(|pin| !is_wished(pin)).collect();
        let is_open =
            |wish: &&PinRequest| self.board.iter().all(|(_, index, _)| *index != wish.index);
        let mut open: Vec<PinRequest> = self.wishes.iter().filter(is_open).copied().collect();
        in_order(view, &free, &mut open);
        let mut matching = Matching::new(view, free.clone());
        let mut left = matching.place_all(&open);
        if !left.is_empty() {
            // If signals are left over, the order of declarations is ignored, so that the reported signals depend only on
            // functions and names.
            for wish in &mut open {
                wish.natural = None;
                if let Rank::Output(_) = wish.rank {
                    wish.rank = Rank::Inner;
                }
            }
            matching = Matching::new(view, free);
            left = matching.place_all(&open);
        }
        pins.extend(matching.pins());
        let moved = moved(&view, &open, &pins);
        Attempt { view, pins, left, refused, moved }
    }

    /// Requested pins that cannot carry their signal, by their index in the list.
    pub(crate) fn refused(&self, view: &View) -> Vec<(usize, Need, Refusal)> {
        let of = |(at, (pin, index, _)): (usize, &(u32, SignalIndex, String))| {
            let wish = self.wishes.iter().find(|wish| wish.index == *index);
            let need = wish.map_or(Need::Input, |wish| wish.need);
            Some((at, need, view.refuses(need, *pin)?))
        };
        self.board.iter().enumerate().filter_map(of).collect()
    }

    /// Tries the modes of a device until everything fits; returns all attempts if nothing fits.
    pub(crate) fn first_fit(
        &self,
        device: &'static crate::device::Device,
    ) -> Result<Attempt, Vec<Attempt>> {
        let mut tried = Vec::new();
        for view in View::all(device, self.has_registers) {
            let attempt = self.attempt(view);
            if attempt.fits() {
                return Ok(attempt);
            }
            tried.push(attempt);
        }
        Err(tried)
    }
}

/// A request that cannot be met, at its location if it has one.
fn bad_pin(spans: &BTreeMap<String, Span>, name: &str, message: String) -> Diagnostic {
    let finding = Diagnostic::error(codes::BAD_PIN, message);
    match spans.get(name) {
        Some(span) => finding.at(*span, ""),
        None => finding,
    }
}

impl Equations {
    /// Assigns the pins; returns the reason if the design does not fit. Impossible requests are findings.
    pub(crate) fn assign_pins(
        &mut self,
        logic: &Logic,
        options: &EmitOptions,
        with_parts: bool,
        findings: &mut Vec<Diagnostic>,
    ) -> Option<Misfit> {
        let before = findings.len();
        let mut order = self.order(logic, options, findings);
        if !with_parts {
            let is_part = |index: usize| matches!(self.signals[index].source, Source::Buried(_));
            order.wishes.retain(|wish| !is_part(wish.index));
        }
        if let Some(blocks) = self.device.blocks {
            return self.assign_to_blocks(blocks, &order, findings, before);
        }
        match order.first_fit(self.device) {
            Ok(attempt) => {
                self.moved = attempt.moved.iter().map(|it| self.moved_pin(logic, it)).collect();
                for (pin, index) in attempt.pins {
                    self.signals[index].pin = Some(pin);
                }
                self.copy_shared_pins();
                self.has_pins = true;
                None
            }
            Err(tried) => {
                self.bad_pins(&order, &tried, findings);
                if findings.len() > before {
                    return None;
                }
                self.only_board_pins(&order);
                let obstacles = tried.iter().map(|attempt| Obstacles::of(self, logic, attempt));
                Some(Misfit::new(self, obstacles.collect()))
            }
        }
    }

    /// Keeps only the requested pins, if the design does not fit.
    pub(crate) fn only_board_pins(&mut self, order: &Order) {
        for signal in &mut self.signals {
            signal.pin = None;
        }
        for (pin, index, _) in &order.board {
            self.signals[*index].pin = Some(*pin);
        }
        self.copy_shared_pins();
    }

    /// The signals to place; requested names that the circuit does not have, and pins requested twice, are findings.
    pub(crate) fn order(
        &self,
        logic: &Logic,
        options: &EmitOptions,
        findings: &mut Vec<Diagnostic>,
    ) -> Order {
        let mut board: Vec<(u32, SignalIndex, String)> = Vec::new();
        for (name, pin) in &options.pins {
            let Some(index) = self.find_source(logic, name) else {
                let known = self.signals.iter().map(|signal| source_name(logic, signal.source));
                let message = format!(
                    "pin {pin} is assigned to `{name}`, but the circuit has no such signal"
                );
                let mut finding = bad_pin(&options.pin_spans, name, message);
                if let Some(near) = nearest(name, known) {
                    finding = finding.help(format!("did you mean `{near}`?"));
                }
                findings.push(finding);
                continue;
            };
            // Both an output and the flip-flop that it shares may be named.
            let index = self.signals[index].shared.unwrap_or(index);
            match board.iter().find(|(known, ..)| known == pin) {
                Some((_, other, _)) if *other == index => {}
                Some((_, _, other)) => {
                    let message = format!("pin {pin} is assigned to `{other}` and to `{name}`");
                    let finding = bad_pin(&options.pin_spans, name, message);
                    findings.push(finding.help("assign a separate pin to each signal"));
                }
                None => board.push((*pin, index, name.clone())),
            }
        }
        // Equation languages use their own short names, a fuse map those of the source; a shared pin uses that of the output.
        let keep = |index: SignalIndex| {
            let shown = self.signals.iter().find(|signal| signal.shared == Some(index));
            let source = source_name(logic, shown.unwrap_or(&self.signals[index]).source);
            let is_kept = |kept: &&(String, u32)| {
                kept.0.eq_ignore_ascii_case(&self.signals[index].name)
                    || kept.0.eq_ignore_ascii_case(source)
            };
            options.keep.iter().find(is_kept).map(|(_, pin)| *pin)
        };
        let rank = |index: SignalIndex| {
            let shown = self.signals.iter().position(|signal| signal.shared == Some(index));
            match (self.signals[index].source, shown) {
                (Source::Clock | Source::Input(_), _) => Rank::Input(index),
                (_, Some(output)) => Rank::Output(output),
                (Source::Output(_), None) => Rank::Output(index),
                (Source::Flop(_) | Source::Buried(_), None) => Rank::Inner,
            }
        };
        // `is_read` is computed once for all signals, because a search through all products for each signal would be slow.
        let mut is_read = vec![false; self.signals.len()];
        for equation in &self.equations {
            equation.products.iter().flatten().for_each(|(signal, _)| is_read[*signal] = true);
        }
        let mut own: Vec<Option<&Equation>> = vec![None; self.signals.len()];
        self.equations.iter().rev().for_each(|equation| own[equation.signal] = Some(equation));
        let wishes = (0..self.signals.len())
            .filter(|index| self.signals[*index].shared.is_none())
            .map(|index| PinRequest {
                index,
                need: need(self.signals[index].source, own[index], is_read[index]),
                key: source_key(logic, self.signals[index].source, &self.signals[index].name),
                kept: keep(index),
                rank: rank(index),
                natural: None,
            })
            .collect();
        let has_registers = self.equations.iter().any(|equation| equation.is_registered);
        Order { board, wishes, has_registers, spans: options.pin_spans.clone() }
    }

    /// Reports requested pins that cannot be used in any mode, with the reasons of the mode that accepts most of them.
    pub(crate) fn bad_pins(
        &self,
        order: &Order,
        tried: &[Attempt],
        findings: &mut Vec<Diagnostic>,
    ) {
        let Some(best) = tried.iter().min_by_key(|attempt| attempt.refused.len()) else { return };
        for (at, need, reason) in &best.refused {
            let (pin, _, name) = &order.board[*at];
            let message =
                format!("pin {pin} of {} cannot be `{name}`: {reason}", self.device.with_article());
            let help = format!("possible pins: {}", best.view.possible(*need));
            findings.push(bad_pin(&order.spans, name, message).help(help));
        }
    }

    /// Gives each output without its own macrocell the pin of its flip-flop.
    pub(crate) fn copy_shared_pins(&mut self) {
        for index in 0..self.signals.len() {
            if let Some(flop) = self.signals[index].shared {
                self.signals[index].pin = self.signals[flop].pin;
            }
        }
    }

    /// The report of a signal that is not on the pin given by the order of declarations.
    fn moved_pin(&self, logic: &Logic, moved: &Moved) -> MovedPin {
        let name = |index: SignalIndex| {
            let shown = self.signals.iter().find(|signal| signal.shared == Some(index));
            let signal = shown.unwrap_or(&self.signals[index]);
            match source_name(logic, signal.source) {
                "" => signal.name.clone(),
                name => name.to_owned(),
            }
        };
        MovedPin {
            name: name(moved.index),
            pin: moved.pin,
            instead_of: moved.natural,
            because: match moved.because {
                Ok(index) => MovedBecause::Needed { by: name(index) },
                Err(refusal) => MovedBecause::Refused(refusal),
            },
        }
    }

    fn find_source(&self, logic: &Logic, name: &str) -> Option<SignalIndex> {
        self.signals.iter().position(|signal| source_matches(logic, signal.source, name))
    }
}

/// The inputs and outputs that are not on the pins given by the order of declarations. A signal that keeps its pin of an earlier build is not
/// reported, because the user wants it there.
fn moved(view: &View, wishes: &[PinRequest], pins: &[(u32, SignalIndex)]) -> Vec<Moved> {
    let of = |wish: &PinRequest| {
        let natural = wish.natural?;
        let (pin, _) = pins.iter().find(|(_, index)| *index == wish.index)?;
        if *pin == natural || wish.kept == Some(*pin) {
            return None;
        }
        let because = match view.refuses(wish.need, natural) {
            Some(refusal) => Err(refusal),
            None => Ok(pins.iter().find(|(taken, _)| *taken == natural)?.1),
        };
        Some(Moved { index: wish.index, pin: *pin, natural, because })
    };
    wishes.iter().filter_map(of).collect()
}

/// The requirement of a signal on its pin; `own` is its equation.
fn need(source: Source, own: Option<&Equation>, is_read: bool) -> Need {
    match (source, own) {
        (Source::Clock, _) => Need::Clock,
        (_, Some(equation)) => Need::Macrocell {
            terms: equation.n_terms(),
            is_registered: equation.is_registered,
            is_read,
        },
        (Source::Input(_) | Source::Flop(_) | Source::Output(_) | Source::Buried(_), None) => {
            Need::Input
        }
    }
}
