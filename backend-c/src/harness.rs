//! Programs that run emitted charts and print their traces.

use crate::Package;
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;

/// todo
#[must_use]
pub fn harness(net: &Valid<Net>, package: &Package) -> String {
    let _ = (net, package);
    String::new()
}

/// todo
#[must_use]
pub fn multi_harness(all: &[(&Valid<Net>, &Package)]) -> String {
    let _ = all;
    String::new()
}
