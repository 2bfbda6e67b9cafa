//! The events of a race, replayed by circuits with their synchronisers and the CPU, against the net.
//!
//! The clocks and lines of free-running parts may have any speed, so each event can come when the race needs it. A chip reads through two flip-flops: before a reaction
//! that takes changes, it has two more clock edges, at which the old values are still read.

use std::collections::BTreeMap;

use grafsynth_ir::Valid;
use grafsynth_ir::division::{Division, PartIndex, Shown, Signal};
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::{Net, OutputId};
use grafsynth_sim::{FreeParts, InputRow, Moment, Simulator, seen};
use grafsynth_split::link::SYNCHRONISERS;
use grafsynth_verify::{Event, Race, Unlike};

use super::runs::Episode;
use super::{Piece, circuits};

/// Why a replay does not show a race: the chip moves before it has read what the race needs.
pub(crate) const EARLY: &str = "a chip moves while its inputs arrive";

/// How a race is shown by the parts.
///
/// # Errors
/// Why it is not shown.
pub(crate) fn is_shown(
    net: &Valid<Net>,
    division: &Division,
    race: &Race,
) -> Result<&'static str, String> {
    if race.what == Unlike::Reset {
        let mut whole = Simulator::new(net);
        return match seen(&whole.reset(), net.steps.len()) == first(net, division) {
            true => Err("the parts show row 0".to_owned()),
            false => Ok("row 0"),
        };
    }
    let circuits = circuits(division);
    let mut replay = Replay::new(net, division, &circuits);
    // Each run of the net that has shown the same so far: its state at rest.
    let mut simulator = Simulator::new(net);
    simulator.reset();
    let mut inputs = InputRow { dt: 0, ..InputRow::zero(net) };
    let mut runs = vec![simulator.state().clone()];
    for (at, events) in race.episodes.iter().enumerate() {
        let is_last = at + 1 == race.episodes.len();
        let start = replay.model.seen(&replay.moment);
        let taken = replay.episode(events)?;
        let mut episode = Episode::default();
        for event in events {
            match event {
                Event::Change(input, value) => episode.change = Some((*input, *value)),
                Event::React { tick, .. } => episode.has_tick |= tick,
            }
        }
        let mut after = Vec::new();
        for state in &runs {
            match episode.runs(net, state, (&inputs, &start)) {
                Some(all) => after.extend(all),
                None if is_last && race.what == Unlike::NetMoves => return Ok("the net moves"),
                None => return Err("the net does not come to rest".to_owned()),
            }
        }
        if let Some((input, value)) = episode.change {
            inputs = inputs.with(input, value);
        }
        if !is_last {
            after.retain(|(changes, _)| *changes == taken);
            runs = after.into_iter().map(|(_, state)| state).collect();
            continue;
        }
        let is_prefix = |changes: &Vec<Vec<i64>>| {
            changes.iter().zip(&taken).all(|(all, taken)| all.starts_with(taken))
        };
        return match race.what {
            Unlike::Becomes(..) if !after.iter().any(|(changes, _)| is_prefix(changes)) => {
                Ok("another value")
            }
            Unlike::Missing(..) if !after.iter().any(|(changes, _)| *changes == taken) => {
                Ok("a value less")
            }
            _ => Err("the net can do that too".to_owned()),
        };
    }
    Err("it has no end".to_owned())
}

/// What the parts show after reset.
fn first(net: &Net, division: &Division) -> Vec<i64> {
    let mut model = FreeParts::new(net, division);
    let moment = model.reset();
    model.seen(&moment)
}

/// The parts, and the model of the proof beside them.
struct Replay<'a> {
    net: &'a Net,
    division: &'a Division,
    pieces: Vec<Piece<'a>>,
    model: FreeParts<'a>,
    moment: Moment,
}

impl<'a> Replay<'a> {
    fn new(net: &'a Net, division: &'a Division, circuits: &'a [Logic]) -> Self {
        let mut model = FreeParts::new(net, division);
        let moment = model.reset();
        Replay { net, division, pieces: Piece::all(division, circuits), model, moment }
    }

    /// The values that each output and step takes in an episode.
    fn episode(&mut self, events: &[Event]) -> Result<Vec<Vec<i64>>, String> {
        let mut last = self.model.seen(&self.moment);
        let mut taken = vec![Vec::new(); last.len()];
        for event in events {
            match event {
                Event::Change(input, value) => {
                    self.model.change(&mut self.moment, *input, *value);
                }
                Event::React { part, takes, tick } => self.react(*part, takes, *tick)?,
            }
            let now = self.model.seen(&self.moment);
            for ((all, old), new) in taken.iter_mut().zip(&last).zip(&now) {
                if old != new {
                    all.push(*new);
                }
            }
            last = now;
        }
        Ok(taken)
    }

    /// A reaction of a part, which must show what the model shows.
    fn react(&mut self, part: PartIndex, takes: &[usize], tick: bool) -> Result<(), String> {
        let of_part = &self.division.parts[part];
        let next = self.model.react(&self.moment, part, takes, u32::from(tick));
        let values: Vec<i64> = self.model.taken(&next, part).collect();
        if let Piece::Chip { .. } = self.pieces[part]
            && takes.iter().any(|n| *n > 0)
        {
            let before = self.expected(part, &self.moment);
            for _ in 0..SYNCHRONISERS {
                let shown = self.reaction(part, &values, false);
                if shown.into_values().collect::<Vec<_>>() != before {
                    return Err(EARLY.to_owned());
                }
            }
        }
        let shown = self.reaction(part, &values, tick);
        self.moment = next;
        let (shown, expected): (Vec<i64>, _) =
            (shown.into_values().collect(), self.expected(part, &self.moment));
        if shown != expected {
            let name = &of_part.name;
            return Err(format!("`{name}` shows {shown:?}, but {expected:?} in the model"));
        }
        Ok(())
    }

    /// One whole reaction of a part, for which some circuits need several clocks.
    fn reaction(&mut self, part: PartIndex, values: &[i64], tick: bool) -> BTreeMap<OutputId, i64> {
        let (of_part, piece) = (&self.division.parts[part], &mut self.pieces[part]);
        let mut shown = piece.react(of_part, values.to_vec(), tick);
        while piece.is_busy() {
            shown = piece.react(of_part, values.to_vec(), false);
        }
        shown
    }

    /// What a part shows at a moment of the model.
    fn expected(&self, part: PartIndex, moment: &Moment) -> Vec<i64> {
        let seen = self.model.seen(moment);
        let n_outputs = self.net.outputs.len();
        let of_part = &self.division.parts[part];
        let value = |shown: &Shown| match shown {
            Shown::Output(id) => seen[id.index()],
            Shown::Wire(Signal::Active(step)) => seen[n_outputs + step.index()],
            other => panic!("{other:?}"),
        };
        of_part.outputs.values().map(value).collect()
    }
}
