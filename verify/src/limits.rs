//! Limits of work; a question that exceeds them is answered "open".

/// Bounds on work and memory. They make every function of this crate end; none of them can make an answer wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// Pairs of a state and an input that an exploration visits.
    pub pairs: u64,
    /// States that an exploration stores.
    pub states: usize,
    /// Input rows that are tried in one state; if there are more, no exploration is started.
    pub rows_per_state: u64,
    /// Rows of the random comparison that runs if nothing can be proved.
    pub random_rows: usize,
    /// Nodes of a decision diagram.
    pub bdd_nodes: usize,
    /// Bits of state and inputs up to which reachable situations are computed as a decision diagram.
    pub image_bits: usize,
    /// Steps of work on that diagram; each visits one node, or a pair or triple of nodes.
    pub image_work: u64,
    /// Conflicts of the solver for one function.
    pub conflicts: u64,
    /// Nodes of the verifier's own circuit of a net.
    pub circuit_nodes: usize,
    /// Situations that [`Facts::reach`](grafsynth_ir::facts::Reach) lists individually.
    pub listed_situations: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            pairs: 2_000_000,
            states: 500_000,
            rows_per_state: 1 << 14,
            random_rows: 10_000,
            bdd_nodes: 1 << 20,
            image_bits: 2_048,
            image_work: 20_000_000,
            conflicts: 20_000,
            circuit_nodes: 8_000_000,
            listed_situations: 65_536,
        }
    }
}
