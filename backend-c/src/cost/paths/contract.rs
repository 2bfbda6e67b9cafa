//! Facts about inputs and members that the text does not contain: value ranges, and which inputs are events.

use crate::cost::rounds;
use crate::io::INPUT_BITS;
use crate::names::Names;
use crate::range::Range;
use grafsynth_ir::expr::Type;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{InputKind, Net};

/// The ranges of inputs and of instance members.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(crate) struct Contract {
    /// Members of `NAME_in_t` that are numbers: minimum and maximum value.
    pub(crate) inputs: Vec<(String, i64, i64)>,
    pub(crate) events: Vec<Event>,
    /// True if each row has at most one event.
    pub(crate) is_exclusive: bool,
    /// Members of the instance that are numbers: minimum and maximum value.
    pub(crate) members: Vec<(String, i64, i64)>,
    /// The chart's own limit of micro-steps (per reaction, or per event in a statechart), if no smaller number is proved.
    pub(crate) limit: Option<u32>,
    /// The members that count pending items within a reaction, such as the events of a queue.
    pub(crate) counts: Vec<String>,
}

/// The location of an external event in `NAME_in_t`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Event {
    pub(crate) member: String,
    pub(crate) element: usize,
    /// The bits of the element that represent it.
    pub(crate) mask: i64,
}

impl Contract {
    pub(crate) fn of(net: &Net, facts: &Facts, names: &Names, ranges: &[Range]) -> Self {
        let rounds = rounds(net, facts).filter(|it| it.proved.is_none());
        let mut contract = Contract {
            is_exclusive: net.settings.events_exclusive,
            limit: rounds.map(|it| it.limit),
            ..Contract::default()
        };
        for (id, input) in net.inputs.iter().filter(|(_, it)| it.kind.is_handed()) {
            let member = names.inputs[id].clone();
            if let Type::Int { lo, hi } = input.ty {
                contract.inputs.push((member.clone(), lo, hi));
            }
            if input.kind == InputKind::Event {
                contract.events.push(match names.io.input_bit(id) {
                    Some(bit) => Event {
                        member: "bits".to_owned(),
                        element: bit / INPUT_BITS,
                        mask: 1 << (bit % INPUT_BITS),
                    },
                    None => Event { member, element: 0, mask: 1 },
                });
            }
        }
        let of_range = |range: &Range| (range.name.clone(), range.lo, range.hi);
        let counts = ranges.iter().filter(|range| range.is_count);
        contract.counts = counts.map(|range| range.name.clone()).collect();
        contract.members = ranges.iter().map(of_range).collect();
        contract
    }
}
