//! Limits of work; a question that exceeds them is answered "open".

/// Bounds on work and memory. They make every function of this crate end; none of them can make an answer wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Limits {
    /// The maximum number of pairs of a state and an input row that an exploration visits.
    pub pairs: u64,
    /// The maximum number of states that an exploration stores.
    pub states: usize,
    /// The maximum number of input rows that are tried in one state; an exploration ends at a state that needs more.
    pub rows_per_state: u64,
    /// The number of rows of the random comparison that runs if nothing can be proved.
    pub random_rows: usize,
    /// The maximum number of nodes of a decision diagram.
    pub bdd_nodes: usize,
    /// The maximum number of bits of state and inputs for which reachable situations are computed as a decision diagram.
    pub image_bits: usize,
    /// The maximum number of steps of work on that diagram; each step visits one node, or a pair or triple of nodes.
    pub image_work: u64,
    /// The maximum number of conflicts of the solver for one function.
    pub conflicts: u64,
    /// The maximum work of property-directed reachability for one property: propagations of the solver and nodes of the graph that are visited. If several
    /// properties are open, each gets a part, but at least an eighth.
    pub directed_work: u64,
    /// The maximum number of nodes of the verifier's own circuit of a net.
    pub circuit_nodes: usize,
    /// The maximum number of situations that [`Facts::reach`](grafsynth_ir::facts::Reach) lists individually.
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
            directed_work: 200_000_000,
            circuit_nodes: 8_000_000,
            listed_situations: 65_536,
        }
    }
}
