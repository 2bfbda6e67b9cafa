//! Golden cases and differential runs over all engines.
//!
//! With `GRAFSYNTH_DEEP` in the environment the large counts are run; `scripts/test --deep` sets it.

pub mod large_chart;
pub mod random_c;
pub mod random_net;

use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;

/// How many rounds a test makes: few at home, many with `GRAFSYNTH_DEEP`.
#[must_use]
pub fn rounds(few: u64, many: u64) -> u64 {
    if std::env::var_os("GRAFSYNTH_DEEP").is_some_and(|value| !value.is_empty()) {
        many
    } else {
        few
    }
}

/// A net as its reader would like to see it: `.graf` where that can say it, else `.net`.
#[must_use]
pub fn readable(net: &Valid<Net>) -> String {
    match grafsynth_frontend::graf::write_net(net) {
        Ok(text) => text,
        Err(_) => grafsynth_ir::text::print(net),
    }
}
