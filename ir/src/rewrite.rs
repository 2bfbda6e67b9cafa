//! Passes that replace a net by a net with the same rows that is easier to run. The result is the input of a back end, whose output is compared with the
//! original net. Ids stay the same.

mod continuous;

use crate::net::Net;
use crate::validate::{Valid, validate};

pub use continuous::continuous;

/// A pass; it returns true if it changed the net.
type Pass = fn(&mut Net) -> bool;

/// The passes with their stable names, in order.
const PIPELINE: &[(&str, Pass)] = &[("continuous", continuous)];

/// The net after all passes; `None` if no pass changes it.
#[must_use]
pub fn simpler(net: &Valid<Net>) -> Option<Valid<Net>> {
    let mut changed = (**net).clone();
    let mut any = false;
    for (_, pass) in PIPELINE {
        any |= pass(&mut changed);
    }
    if !any {
        return None;
    }
    let changed = validate(changed);
    debug_assert!(changed.is_ok(), "a pass made an invalid net: {changed:?}");
    changed.ok()
}
