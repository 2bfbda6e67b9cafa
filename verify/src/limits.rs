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

/// The effort of [`Limits::default`].
pub const DEFAULT_EFFORT: u8 = 1;
/// The largest effort.
pub const MAX_EFFORT: u8 = 3;

impl Limits {
    /// The limits of an effort from 0 to [`MAX_EFFORT`]; a larger number counts as the largest. Effort 0 proves by structure and induction, with a short enumeration
    /// and a small decision diagram; each effort after 1 allows ten times the work of the one before. The limits of memory grow less.
    #[must_use]
    pub fn of_effort(effort: u8) -> Self {
        let more = match effort {
            0 => {
                return Limits {
                    pairs: 20_000,
                    states: 20_000,
                    image_work: 500_000,
                    directed_work: 0,
                    ..Limits::default()
                };
            }
            1 => 1,
            2 => 10,
            _ => 100,
        };
        // An exploration keeps its states, and a diagram its nodes, so these limits are limits of memory too.
        let (times, memory) = (more, if more > 10 { 20 } else { more });
        let least = Limits::default();
        Limits {
            pairs: least.pairs * times,
            states: least.states * memory as usize,
            rows_per_state: least.rows_per_state * memory.min(4),
            bdd_nodes: least.bdd_nodes * memory.min(8) as usize,
            image_work: least.image_work * times,
            conflicts: least.conflicts * times,
            directed_work: least.directed_work * times,
            ..least
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_effort_never_allows_less() {
        assert_eq!(Limits::of_effort(DEFAULT_EFFORT), Limits::default());
        assert_eq!(Limits::of_effort(u8::MAX), Limits::of_effort(MAX_EFFORT));
        for effort in 0..MAX_EFFORT {
            let (less, more) = (Limits::of_effort(effort), Limits::of_effort(effort + 1));
            assert!(less.pairs < more.pairs && less.states < more.states, "{effort}");
            assert!(less.image_work < more.image_work && less.directed_work < more.directed_work);
            assert!(less.bdd_nodes <= more.bdd_nodes && less.rows_per_state <= more.rows_per_state);
            assert!(less.conflicts <= more.conflicts && less.random_rows <= more.random_rows);
        }
    }
}
