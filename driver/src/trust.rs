//! C code of the chart's author (`code c`): a compiler sees it, simulation and proofs do not, and running it can have any effect.

use crate::codes;
use grafsynth_ir::net::{Net, without_c_texts};
use grafsynth_ir::{Diagnostic, Span, Valid, counted};
use std::borrow::Cow;

/// The net whose C may be compiled and run: without the C code of the chart's author, unless it is trusted.
#[must_use]
pub fn runnable(net: &Valid<Net>, is_trusted: bool) -> Cow<'_, Valid<Net>> {
    match without_c_texts(net) {
        Some(bare) if !is_trusted => Cow::Owned(bare),
        Some(_) | None => Cow::Borrowed(net),
    }
}

/// A warning that proofs do not see the chart's own C code; `None` if it has none.
#[must_use]
pub fn unseen(net: &Net) -> Option<Diagnostic> {
    let places = net.c_texts();
    let message = format!(
        "{} of C code in the chart {} ignored by simulation, asserts, reachable situations, waiting times and bounds",
        counted(places.len(), "block", "blocks"),
        if places.len() == 1 { "is" } else { "are" }
    );
    let help = "changes that this code makes to `self` and `out` affect only the compiled chart; with `build --trust-code`, the code also runs when the compiled chart is compared with the chart";
    note(&places, message, help)
}

/// A note that the chart's own C code is left out of what is compiled and run; `None` if it has none.
#[must_use]
pub fn left_out(net: &Net) -> Option<Diagnostic> {
    let places = net.c_texts();
    let message = format!(
        "{} of C code in the chart {} left out of the C that is compiled and run here",
        counted(places.len(), "block", "blocks"),
        if places.len() == 1 { "is" } else { "are" }
    );
    let help = "use --trust-code to compile and run it; it then runs with your permissions";
    note(&places, message, help)
}

fn note(places: &[Span], message: String, help: &str) -> Option<Diagnostic> {
    let (first, rest) = places.split_first()?;
    let mut found = Diagnostic::note(codes::OWN_C, message).at(*first, "written here");
    for place in rest {
        found = found.at(*place, "and here");
    }
    Some(found.help(help))
}
