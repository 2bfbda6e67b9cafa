//! The page of each diagnostic code: cause, an example that triggers it, and a fix.

use grafsynth_ir::Code;

include!(concat!(env!("OUT_DIR"), "/pages.rs"));

/// The page of a code such as `G0101` (not case-sensitive), in Markdown.
#[must_use]
pub fn page(code: &str) -> Option<&'static str> {
    let code = code.to_ascii_uppercase();
    PAGES.iter().find(|(id, _)| *id == code).map(|(_, text)| *text)
}

/// All codes that have a page, in order.
pub fn pages() -> impl Iterator<Item = (&'static str, &'static str)> {
    PAGES.iter().copied()
}

/// All codes of all crates, in order.
#[must_use]
pub fn codes() -> Vec<Code> {
    let mut all: Vec<Code> = [
        grafsynth_ir::codes::ALL,
        grafsynth_ir::lower::codes::ALL,
        grafsynth_ir::lower::program::codes::ALL,
        grafsynth_frontend::codes::ALL,
        grafsynth_sim::codes::ALL,
        grafsynth_backend_c::codes::ALL,
        grafsynth_c::codes::ALL,
        grafsynth_backend_template::codes::ALL,
        grafsynth_logic::codes::ALL,
        grafsynth_backend_pld::codes::ALL,
        grafsynth_backend_pld::pla::codes::ALL,
        grafsynth_backend_pld::fuse::codes::ALL,
        grafsynth_verify::codes::ALL,
        grafsynth_split::codes::ALL,
        crate::codes::ALL,
    ]
    .concat();
    all.sort_unstable();
    all
}
