//! What no bounded program can say.

use crate::diag::Code;

/// All codes of this module, in order.
pub const ALL: &[Code] = &[];
