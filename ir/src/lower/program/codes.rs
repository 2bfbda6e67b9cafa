//! What no program of a reasonable size can say: `G0250`. It has a page in `docs/codes`.

use crate::diag::Code;

/// The queues of a statechart are longer than anything that could be reserved for them.
pub const QUEUE_TOO_LONG: Code = Code { id: "G0250", title: "queue too long" };

/// All codes of this module, in order.
pub const ALL: &[Code] = &[QUEUE_TOO_LONG];
