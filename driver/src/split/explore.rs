//! What a chart costs with some devices: the points among which a designer chooses.

use super::table::cpu_pins;
use super::{Linked, Request, Split, link, split};
use grafsynth_ir::Valid;
use grafsynth_ir::diag::Severity;
use grafsynth_ir::net::Net;

/// The costs of a split. Nothing of it is proved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Costs {
    /// The macrocells of all chips.
    pub cells: u64,
    /// The pins of the CPU: for the link, and for the inputs and outputs of the plant.
    pub pins: u64,
    /// The usable pins of the CPU. If it needs more, some inputs or outputs of the plant must be connected in another way.
    pub usable: u64,
    /// The maximum number of cycles of the part on the CPU in a round; `None` if they are not known.
    pub cycles: Option<u64>,
    /// The longest time of a reaction in nanoseconds, with an estimate for the link; `None` if it is not known.
    pub reaction_ns: Option<u64>,
}

impl Costs {
    fn of(net: &Net, split: &Split, linked: &Linked) -> Costs {
        let round = linked.round.as_ref().ok();
        let chips = split.parts.iter().flat_map(|part| &part.built.chips);
        Costs {
            cells: chips.map(|chip| chip.cells.len() as u64).sum(),
            pins: cpu_pins(net, &split.division, linked),
            usable: linked.cpu.pins.len() as u64,
            cycles: round.map(|round| round.step),
            reaction_ns: round.map(|round| round.ns),
        }
    }

    /// The costs as numbers that can be compared. A cost that is not known is the largest number.
    fn all(self) -> [u64; 5] {
        let known = |value: Option<u64>| value.unwrap_or(u64::MAX);
        let missing = self.pins.saturating_sub(self.usable);
        [self.cells, self.pins, missing, known(self.cycles), known(self.reaction_ns)]
    }

    /// The pins of the CPU, with those that it has if these are fewer.
    #[must_use]
    pub fn pins_text(self) -> String {
        let Costs { pins, usable, .. } = self;
        if pins > usable { format!("{pins}, only {usable} usable") } else { pins.to_string() }
    }

    /// True if the other split is not worse in anything, and better in something.
    #[must_use]
    pub fn is_dominated(self, other: Costs) -> bool {
        let (own, other) = (self.all(), other.all());
        own != other && own.iter().zip(other).all(|(own, other)| other <= *own)
    }
}

/// The costs of the best split of a request, or why there is none.
///
/// # Errors
/// The first error of the split or of its link.
pub fn costs(net: &Valid<Net>, request: &Request<'_>) -> Result<Costs, String> {
    let made = split(net, request).and_then(|split| {
        let linked = link(net, &split, request.parts, request.stem)?;
        Ok(Costs::of(net, &split, &linked))
    });
    made.map_err(|found| {
        let error = found.iter().find(|one| one.severity == Severity::Error);
        error.map_or_else(|| "no split".to_owned(), |one| one.message.clone())
    })
}
