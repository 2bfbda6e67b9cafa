//! Limits of programs: `G0250`. It has a page in `docs/codes`.

use crate::diag::Code;

/// The bound of the queues of a statechart exceeds the maximum.
pub const QUEUE_TOO_LONG: Code = Code { id: "G0250", title: "queue too long" };

/// All codes of this module, in order.
pub const ALL: &[Code] = &[QUEUE_TOO_LONG];
