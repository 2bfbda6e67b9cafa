//! The run that each page repeats when it is opened: a directed run of the simulator, with a hash of each row.

use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{Ahead, InputRow, MAX_DT, Row, TraceLayout};

/// The seed of the run.
const SEED: u64 = 1;
/// The number of reactions that are executed at once.
const BATCH: usize = 64;

/// A run of the simulator.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Reference {
    /// The inputs of each reaction.
    pub rows: Vec<InputRow>,
    /// For each reaction, the state from which it continues: 0 is the state after reset, n is the state after reaction n, counted from 1.
    pub from: Vec<usize>,
    /// For each reaction, the hash of its row without the number of the row; `None` if the chart leaves a cell of the row open.
    pub hashes: Vec<Option<u32>>,
}

/// A directed run of `reactions` reactions; fewer if no inputs satisfy the assumptions of the chart, or if the reactions have very many micro-steps.
#[must_use]
pub fn reference(net: &Valid<Net>, reactions: usize) -> Reference {
    let layout = TraceLayout::of(net);
    let mut run = Ahead::new(net, SEED, MAX_DT, reactions);
    let mut hashes = Vec::new();
    loop {
        let (_, rows) = run.batch(BATCH);
        if rows.is_empty() {
            break;
        }
        hashes.extend(rows.iter().map(|row| hash(&layout, row)));
    }
    let made = run.made();
    Reference {
        rows: made.iter().map(|made| made.row.clone()).collect(),
        from: made.iter().map(|made| made.from).collect(),
        hashes,
    }
}

fn hash(layout: &TraceLayout, row: &Row) -> Option<u32> {
    if row.open.any() {
        return None;
    }
    let mut text = String::new();
    layout.write_cells(row, &mut text);
    Some(fnv1a(&text))
}

/// FNV-1a with 32 bits, which `engine.js` computes too.
fn fnv1a(text: &str) -> u32 {
    text.bytes().fold(0x811c_9dc5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}
