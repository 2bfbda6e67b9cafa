//! The result of a comparison of a net and a circuit.

use grafsynth_ir::counted;
use grafsynth_ir::facts::Proof;
use grafsynth_sim::{Difference, Stimulus};

/// The verdict on a circuit and a net. Proofs apply to every stimulus with `dt` 0 or 1 ([`Scope::OneTick`](crate::Scope::OneTick)), which is all that a
/// chip can see.
pub type Verdict = crate::verdict::Verdict<Certificate, Counterexample>;

/// The proof that a circuit is equivalent to a net.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Certificate {
    /// The method of the proof.
    pub method: Method,
    /// The number of compared bits: outputs, steps, variables, the fault flag; for the symbolic method also the other flip-flops.
    pub compared: usize,
}

/// The methods of [`equiv`](fn@super::equiv), each with the size of the proof.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// An enumeration of all reachable states of net and circuit together, each with every input that either of them reads in it.
    Explicit {
        /// The number of pairs of a net's and a circuit's state.
        states: u64,
        /// The number of reactions compared.
        reactions: u64,
    },
    /// Induction over the reaction.
    Symbolic {
        /// The number of functions that are equal by construction.
        same: usize,
        /// The number of functions that the solver proved equal.
        solved: usize,
        /// The number of clauses that property-directed reachability added to the invariants; 0 if they were sufficient.
        clauses: usize,
    },
}

impl Certificate {
    /// The kind of proof.
    #[must_use]
    pub fn proof(&self) -> Proof {
        match self.method {
            Method::Explicit { .. } => Proof::Explicit,
            Method::Symbolic { clauses: 0, .. } => Proof::Induction,
            Method::Symbolic { .. } => Proof::Directed,
        }
    }
}

impl std::fmt::Display for Certificate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.method {
            Method::Explicit { states, reactions } => write!(
                f,
                "proved by enumeration: {}, {}, {} compared in each",
                counted(states, "state", "states"),
                counted(reactions, "reaction", "reactions"),
                counted(self.compared, "bit", "bits")
            ),
            Method::Symbolic { same, solved, clauses } => {
                let functions = counted(self.compared, "function", "functions");
                write!(
                    f,
                    "proved by induction: {functions}, {same} equal by construction, {solved} by the solver"
                )?;
                if clauses > 0 {
                    let clauses = counted(clauses, "clause", "clauses");
                    write!(f, ", the others with {clauses} from property-directed reachability")?;
                }
                Ok(())
            }
        }
    }
}

/// A stimulus under which circuit and net differ in its last row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counterexample {
    /// The stimulus for both.
    pub stimulus: Stimulus,
    /// The cell that differs: left is the net, right the circuit. For state that no trace shows, the column is the name of the flip-flop.
    pub difference: Difference,
}
