//! Tables of two-level logic in the format of espresso (`.pla`): functions with don't-cares, not circuits.
//!
//! ```text
//! text ── read ──► Pla (names, on, free, off) ── grafsynth_logic::minimise ──► products ── write ──► text
//! ```
//! The format is that of espresso's manual page espresso(5): one row of input and output characters for each product. The meaning of `0`, `1`, `-`
//! and `~` among the outputs depends on `.type`:
//!
//! | type | `1` or `4` | `-` or `2` | `0` | `~` or `3` | the rest |
//! |---|---|---|---|---|---|
//! | `f` | on | nothing | nothing | nothing | off |
//! | `fd` (default) | on | free | nothing | nothing | off |
//! | `fr` | on | nothing | off | nothing | free |
//! | `fdr` | on | free | off | nothing | free |

pub mod codes;

mod circuit;
mod clash;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use circuit::{circuit, read_text, table};
pub use clash::{clashes, function, undefined};
pub use read::{Places, read};
pub use write::write;

use grafsynth_logic::minimise::{Shape, Terms};

/// The sets that a table defines; the rest follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The on-set; the rest is off.
    F,
    /// The on-set and the don't-care set; the rest is off.
    Fd,
    /// The on-set and the off-set; the rest is free.
    Fr,
    /// The on-set, the don't-care set and the off-set; the rest is free.
    Fdr,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Kind; 4] = [Kind::F, Kind::Fd, Kind::Fr, Kind::Fdr];

    /// The name after `.type`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Kind::F => "f",
            Kind::Fd => "fd",
            Kind::Fr => "fr",
            Kind::Fdr => "fdr",
        }
    }

    /// True if the rows define the off-set.
    #[must_use]
    pub fn says_off(self) -> bool {
        matches!(self, Kind::Fr | Kind::Fdr)
    }
}

/// A table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pla {
    /// The sets that the rows define.
    pub kind: Kind,
    /// The names of the inputs, if the text has any.
    pub inputs: Option<Vec<String>>,
    /// The names of the outputs, if the text has any.
    pub outputs: Option<Vec<String>>,
    /// The on-set of the outputs.
    pub on: Terms,
    /// The don't-care set.
    pub free: Terms,
    /// The off-set; empty unless the kind defines it.
    pub off: Terms,
    /// For each output: whether it is inverted (`.phase` with a 0).
    pub is_inverted: Vec<bool>,
}

impl Pla {
    /// A table without rows.
    #[must_use]
    pub fn new(kind: Kind, shape: Shape) -> Self {
        Pla {
            kind,
            inputs: None,
            outputs: None,
            on: Terms::new(shape),
            free: Terms::new(shape),
            off: Terms::new(shape),
            is_inverted: vec![false; shape.outputs()],
        }
    }

    /// The number of inputs and outputs.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.on.shape
    }

    /// The name of an output; generated from its number (from 0) if the text has none.
    #[must_use]
    pub fn output_name(&self, output: usize) -> String {
        self.outputs
            .as_ref()
            .and_then(|names| names.get(output).cloned())
            .unwrap_or_else(|| format!("o{output}"))
    }
}
