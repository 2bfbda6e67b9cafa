//! C that the author of a chart wrote (`code c`): a compiler sees it, simulation and proofs don't, and whoever runs it runs what the author wanted.

use crate::codes;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Span};

/// That proofs do not see the chart's own C; none if it has none.
#[must_use]
pub fn unseen(net: &Net) -> Option<Diagnostic> {
    let places = net.c_texts();
    let message = format!(
        "{} of C {} not seen by simulation, asserts, reachable situations, waiting times and bounds",
        counted(places.len()),
        if places.len() == 1 { "is" } else { "are" }
    );
    let help = "what it writes to `self` or `out` holds in the compiled chart only; `build --trust-code` compares that with the chart";
    note(&places, message, help)
}

/// That the chart's own C is left out of what is compiled and run; none if it has none.
#[must_use]
pub fn left_out(net: &Net) -> Option<Diagnostic> {
    let places = net.c_texts();
    let message = format!(
        "{} of C {} left out of the C that is compiled and run here",
        counted(places.len()),
        if places.len() == 1 { "is" } else { "are" }
    );
    let help = "--trust-code compiles and runs it: it can do on this machine whatever you can";
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

fn counted(n: usize) -> String {
    format!("{n} text{}", if n == 1 { "" } else { "s" })
}
