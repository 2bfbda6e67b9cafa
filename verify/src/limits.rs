//! How much work a question may cost before the answer is "open".

/// Bounds on work and memory. They make every function of this crate end; none of them can make an answer wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// Pairs of a state and an input that an exploration looks at.
    pub pairs: u64,
    /// States that an exploration keeps.
    pub states: usize,
    /// Input rows that are tried in one state; with more than that no exploration is begun.
    pub rows_per_state: u64,
    /// Rows of the random comparison that is run where nothing can be proved.
    pub random_rows: usize,
    /// Nodes of a decision diagram.
    pub bdd_nodes: usize,
    /// Bits of state and inputs with which reachable situations are sought as a decision diagram.
    pub image_bits: usize,
    /// Steps of work on that diagram: looks at a node, or at two or three together.
    pub image_work: u64,
    /// Conflicts that the solver may meet for one function.
    pub conflicts: u64,
    /// Nodes of the verifier's own circuit of a net.
    pub circuit_nodes: usize,
    /// Situations that [`Facts::reach`](grafsynth_ir::facts::Reach) lists one by one.
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
