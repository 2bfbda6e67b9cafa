//! What came of placing everything in one mode of a device.

use super::matching::Wish;
use super::need::{Need, Refusal, View};
use crate::equations::SignalIndex;

/// What came of placing everything in one mode.
#[derive(Debug)]
pub(crate) struct Attempt {
    pub(crate) view: View,
    /// Signals by pin.
    pub(crate) pins: Vec<(u32, SignalIndex)>,
    /// What found no pin.
    pub(crate) left: Vec<Wish>,
    /// Pins of the board that cannot carry what they are given: the wish's place in [`Order::board`], and why.
    pub(crate) refused: Vec<(usize, Need, Refusal)>,
}

impl Attempt {
    pub(crate) fn fits(&self) -> bool {
        self.left.is_empty() && self.refused.is_empty()
    }
}
