//! What compiled and interpreted charts have in common: the numbers of their states, and why there is no answer.

/// The number of a state of the executed chart; equal states have equal numbers.
pub(crate) type Instance = usize;

/// Why an executed chart does not answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Trouble {
    /// The compiler rejected the text; this is its output.
    Compiler(String),
    /// The program cannot be created or run on this machine.
    Machine(String),
    /// The program is faulty: it crashes, or does not end a reaction.
    Chart(String),
}
