//! The result of placing everything in one mode of a device.

use super::matching::PinRequest;
use super::need::{Need, Refusal, View};
use crate::equations::SignalIndex;

/// The result of placing everything in one mode.
#[derive(Debug)]
pub(crate) struct Attempt {
    pub(crate) view: View,
    /// Signals by pin.
    pub(crate) pins: Vec<(u32, SignalIndex)>,
    /// Signals that got no pin.
    pub(crate) left: Vec<PinRequest>,
    /// Requested pins that cannot carry their signal: the index of the request in [`Order::board`], the need, and the reason.
    pub(crate) refused: Vec<(usize, Need, Refusal)>,
    /// Inputs and outputs that are not on the pins given by the order of declarations.
    pub(crate) moved: Vec<Moved>,
}

/// A signal that is not on the pin given by the order of declarations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moved {
    pub(crate) index: SignalIndex,
    pub(crate) pin: u32,
    /// The pin given by the order of declarations.
    pub(crate) natural: u32,
    /// The signal that has that pin, or the reason why that pin is not possible.
    pub(crate) because: Result<SignalIndex, Refusal>,
}

impl Attempt {
    pub(crate) fn fits(&self) -> bool {
        self.left.is_empty() && self.refused.is_empty()
    }
}
