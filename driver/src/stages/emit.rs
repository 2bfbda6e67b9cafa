//! Stage 2: the circuit as a text or as a fuse map.

use super::encode::Encoded;
use crate::context::{BuildContext, Medium};
use crate::jedec::{self, FuseText};
use grafsynth_backend_pld::{Emitted, emit_from};
use grafsynth_ir::Diagnostic;

/// The written output.
pub(crate) enum Written {
    Text(Emitted),
    Fuses(FuseText),
}

/// Writes the circuit; its equations are not made again if they are known.
///
/// # Errors
/// The language or the device does not support something.
pub(crate) fn emit(
    context: &BuildContext<'_>,
    encoded: &Encoded,
) -> Result<Written, Vec<Diagnostic>> {
    let Encoded { circuit, options, .. } = encoded;
    match context.medium {
        Medium::Text(dialect) => {
            emit_from(encoded.equations(), circuit, dialect, options).map(Written::Text)
        }
        Medium::Fuses => jedec::emit(context.net, encoded.equations(), circuit, options, None)
            .map(Written::Fuses),
    }
}
