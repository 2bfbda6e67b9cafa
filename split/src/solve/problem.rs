//! The data of a partition problem, and the check that they are consistent.

use std::fmt;

/// The index of a part in [`Problem::parts`].
pub type PartIndex = usize;

/// The index of a node in [`Problem::nodes`].
pub type NodeIndex = usize;

/// Nodes to be placed on parts, at minimum cost.
///
/// The cost of a placement is the sum of [`Choice::cost`] over the nodes, of [`Wire::cost`] over the wires with members on two parts or more, and of [`Presence::cost`]. The
/// weights of several objectives are already included in these integers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Problem {
    /// The parts, 2 to 16; all have the same resources.
    pub parts: Vec<Part>,
    /// The nodes.
    pub nodes: Vec<Node>,
    /// The wires between nodes.
    pub wires: Vec<Wire>,
    /// What is needed if a node is on some part, once for all nodes.
    pub presences: Vec<Presence>,
    /// Sets of nodes that must be on one part.
    pub together: Vec<Vec<NodeIndex>>,
    /// Placements that are not allowed.
    pub forbidden: Vec<Forbidden>,
}

/// The capacities of one part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Part {
    /// The available amount of each resource; `None` is unlimited.
    pub capacities: Vec<Option<u64>>,
    /// The pins; `None` is unlimited.
    pub pins: Option<u64>,
    /// Pins that every placement needs in addition; negative if the nets count some twice in every placement.
    pub always: i64,
}

/// Something that is placed on one part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Node {
    /// For each part, the cost of the node there; `None` if it is not allowed there. A fixed node has one choice.
    pub choices: Vec<Option<Choice>>,
}

/// The cost of a node on one part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choice {
    /// Its share of the objective; may be negative.
    pub cost: i64,
    /// The amount of each resource that it uses.
    pub uses: Vec<u64>,
}

/// A signal from one node to others.
///
/// If its nodes are on several parts, it costs a pin on each of these parts: an output of the driver's part, an input of the others.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Wire {
    /// The node that drives the signal.
    pub driver: NodeIndex,
    /// The nodes that read it.
    pub readers: Vec<NodeIndex>,
    /// Its share of the objective if it is cut.
    pub cost: u64,
}

/// Something that is needed once if any of some nodes is on one of some parts: an input, whose pin all its readers share; a macrocell.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Presence {
    /// The nodes.
    pub nodes: Vec<NodeIndex>,
    /// The parts on which they need it.
    pub on: Vec<PartIndex>,
    /// Its share of the objective.
    pub cost: u64,
    /// The number of its pins.
    pub pins: u64,
    /// The part that has these pins: often, but not always, the one of `on`.
    pub at: PartIndex,
}

impl Presence {
    /// Pins of a part that are needed if any of these nodes is on it.
    #[must_use]
    pub fn pins(nodes: Vec<NodeIndex>, part: PartIndex, pins: u64) -> Self {
        Self { nodes, on: vec![part], cost: 0, pins, at: part }
    }
}

/// A placement that is not allowed, usually because a real fit failed with it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Forbidden {
    /// At least one of these decisions must be different.
    Decisions(Vec<(NodeIndex, PartIndex)>),
    /// These nodes must not all be on this part, regardless of the other nodes.
    Together {
        /// The nodes.
        nodes: Vec<NodeIndex>,
        /// The part.
        part: PartIndex,
    },
}

impl Forbidden {
    /// The decisions of which one must be different.
    pub fn decisions(&self) -> Vec<(NodeIndex, PartIndex)> {
        match self {
            Self::Decisions(decisions) => decisions.clone(),
            Self::Together { nodes, part } => nodes.iter().map(|&node| (node, *part)).collect(),
        }
    }
}

/// Why a problem or a placement is malformed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ProblemError {
    /// The number of parts is not 2 to 16.
    Parts(usize),
    /// A part, node or warm start has a list of the wrong length; the text says which.
    Length(String),
    /// An index is beyond the end of its list; the text says which.
    Index(String),
    /// A number or a list is too large for exact sums; the text says which.
    TooLarge(String),
}

impl fmt::Display for ProblemError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parts(parts) => write!(f, "expected 2 to 16 parts, found {parts}"),
            Self::Length(text) | Self::Index(text) | Self::TooLarge(text) => f.write_str(text),
        }
    }
}

impl std::error::Error for ProblemError {}

/// The largest amount, cost or weight: sums over all nodes stay exact in `f64` and far from overflow in `i64`.
const LARGEST: u64 = 1 << 30;

/// The maximum number of nodes, wires, presences or sets.
const MOST: usize = 1 << 18;

/// The maximum number of resources of a part.
const MOST_RESOURCES: usize = 64;

impl Problem {
    /// The number of resources of each part.
    pub fn resources(&self) -> usize {
        self.parts.first().map_or(0, |part| part.capacities.len())
    }

    /// Checks lengths, indices and sizes.
    ///
    /// # Errors
    /// The first error. A capacity or a number of pins may have any value.
    pub fn check(&self) -> Result<(), ProblemError> {
        if !(2..=16).contains(&self.parts.len()) {
            return Err(ProblemError::Parts(self.parts.len()));
        }
        let resources = self.resources();
        length(format_args!("parts[0].capacities"), resources.min(MOST_RESOURCES), resources)?;
        for (index, part) in self.parts.iter().enumerate() {
            length(format_args!("parts[{index}].capacities"), resources, part.capacities.len())?;
            size(format_args!("parts[{index}]"), part.always.unsigned_abs())?;
        }
        let lists = [
            ("nodes", self.nodes.len()),
            ("wires", self.wires.len()),
            ("presences", self.presences.len()),
            ("together", self.together.len()),
            ("forbidden", self.forbidden.len()),
        ];
        for (name, len) in lists {
            if len > MOST {
                return Err(ProblemError::TooLarge(format!(
                    "`{name}` has {len} entries, at most {MOST} are allowed"
                )));
            }
        }
        for (index, node) in self.nodes.iter().enumerate() {
            length(format_args!("nodes[{index}].choices"), self.parts.len(), node.choices.len())?;
            for choice in node.choices.iter().flatten() {
                length(format_args!("nodes[{index}]: uses"), resources, choice.uses.len())?;
                for amount in choice.uses.iter().copied().chain([choice.cost.unsigned_abs()]) {
                    size(format_args!("nodes[{index}]"), amount)?;
                }
            }
        }
        self.check_sets()
    }

    fn check_sets(&self) -> Result<(), ProblemError> {
        for (index, wire) in self.wires.iter().enumerate() {
            size(format_args!("wires[{index}]"), wire.cost)?;
            self.check_nodes(
                format_args!("wires[{index}]"),
                wire.readers.iter().chain([&wire.driver]),
            )?;
        }
        for (index, one) in self.presences.iter().enumerate() {
            size(format_args!("presences[{index}]"), one.cost.max(one.pins))?;
            let mut parts = one.on.iter().chain([&one.at]);
            if let Some(part) = parts.find(|&&part| part >= self.parts.len()) {
                return Err(ProblemError::Index(format!(
                    "presences[{index}]: part {part} does not exist"
                )));
            }
            self.check_nodes(format_args!("presences[{index}]"), one.nodes.iter())?;
        }
        for (index, set) in self.together.iter().enumerate() {
            self.check_nodes(format_args!("together[{index}]"), set.iter())?;
        }
        for (index, set) in self.forbidden.iter().enumerate() {
            for (node, part) in set.decisions() {
                self.check_nodes(format_args!("forbidden[{index}]"), [&node])?;
                if part >= self.parts.len() {
                    return Err(ProblemError::Index(format!(
                        "forbidden[{index}]: part {part} does not exist"
                    )));
                }
            }
        }
        Ok(())
    }

    fn check_nodes<'a>(
        &self,
        place: fmt::Arguments<'_>,
        nodes: impl IntoIterator<Item = &'a NodeIndex>,
    ) -> Result<(), ProblemError> {
        match nodes.into_iter().find(|&&node| node >= self.nodes.len()) {
            Some(node) => Err(ProblemError::Index(format!("{place}: node {node} does not exist"))),
            None => Ok(()),
        }
    }

    /// Checks that a placement has an existing part for each node; it need not be feasible.
    ///
    /// # Errors
    /// The first error.
    pub fn check_assignment(&self, assignment: &[PartIndex]) -> Result<(), ProblemError> {
        length(format_args!("assignment"), self.nodes.len(), assignment.len())?;
        match assignment.iter().find(|&&part| part >= self.parts.len()) {
            Some(part) => {
                Err(ProblemError::Index(format!("assignment: part {part} does not exist")))
            }
            None => Ok(()),
        }
    }
}

fn length(place: fmt::Arguments<'_>, expected: usize, found: usize) -> Result<(), ProblemError> {
    if expected == found {
        Ok(())
    } else {
        Err(ProblemError::Length(format!("{place}: expected {expected} entries, found {found}")))
    }
}

fn size(place: fmt::Arguments<'_>, amount: u64) -> Result<(), ProblemError> {
    if amount <= LARGEST {
        Ok(())
    } else {
        Err(ProblemError::TooLarge(format!("{place}: {amount} is larger than {LARGEST}")))
    }
}
