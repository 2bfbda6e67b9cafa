//! The covering problem: the fewest columns that cover all rows, with a proved lower bound.
//!
//! ```text
//! rows ─ reduce (essential, dominated) ─► cyclic core ─ split into blocks ─► each block: dual bound, descent, branch and bound
//! ```
//! The lower bound is a Lagrangian relaxation with subgradients, started from dual ascent, as in Caprara, Fischetti and Toth [1999]; prices are
//! integers, so the bound is exact and the same on every machine. Reduced costs fix columns between the bound and the best cover. The limit of the
//! branching is given in steps, not in seconds.

use super::local;
use grafsynth_ir::ranks::sort_by_rank;

/// A cover and a lower bound.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Solution {
    /// The chosen columns, ascending.
    pub(super) columns: Vec<u32>,
    /// A lower bound: no cover has fewer columns.
    pub(super) lower: usize,
}

/// The unit of prices: one column costs this much.
const UNIT: i64 = 1 << 16;

/// Blocks and branches deeper than this are solved heuristically.
const MAX_DEPTH: usize = 200;

/// A covering problem with columns numbered `0..`; `weights` decides between equivalent columns.
#[derive(Debug, Clone)]
struct Matrix {
    /// The columns of each row, sorted.
    rows: Vec<Vec<u32>>,
    /// The rows of each column, sorted.
    columns: Vec<Vec<u32>>,
    /// The weight of each column: of equivalent columns, the one with the lowest weight is chosen.
    weights: Vec<u32>,
    /// The number of each column in the original problem.
    names: Vec<u32>,
}

/// A small cover of all rows, each a non-empty set of columns. `steps` bounds the work; more steps give a better bound and cover.
pub(super) fn solve(sets: &[Vec<u32>], weights: &[u32], steps: u64) -> Solution {
    let matrix = Matrix::new(sets, weights);
    let mut search = Search { steps };
    let mut solution = search.whole(&matrix, 0, usize::MAX);
    solution.columns.sort_unstable();
    solution
}

impl Matrix {
    fn new(sets: &[Vec<u32>], weights: &[u32]) -> Self {
        let names: Vec<u32> = (0u32..).take(weights.len()).collect();
        let mut matrix = Matrix {
            rows: sets.to_vec(),
            columns: vec![Vec::new(); weights.len()],
            weights: weights.to_vec(),
            names,
        };
        matrix.index();
        matrix
    }

    /// Computes the columns from the rows.
    fn index(&mut self) {
        self.columns.iter_mut().for_each(Vec::clear);
        for (number, row) in (0u32..).zip(&self.rows) {
            for &column in row {
                self.columns[column as usize].push(number);
            }
        }
    }

    /// Removes these rows and columns, and all columns without rows.
    fn compact(&mut self, is_row_gone: &[bool], is_column_gone: &[bool]) {
        let mut is_used = vec![false; self.columns.len()];
        let mut rows: Vec<Vec<u32>> = Vec::new();
        for (row, _) in self.rows.iter().zip(is_row_gone).filter(|(_, gone)| !**gone) {
            let kept: Vec<u32> =
                row.iter().copied().filter(|&column| !is_column_gone[column as usize]).collect();
            kept.iter().for_each(|&column| is_used[column as usize] = true);
            rows.push(kept);
        }
        let mut renamed = vec![0u32; self.columns.len()];
        let (mut weights, mut names) = (Vec::new(), Vec::new());
        for column in 0..self.columns.len() {
            if is_used[column] {
                renamed[column] = u32::try_from(names.len()).unwrap_or(u32::MAX);
                weights.push(self.weights[column]);
                names.push(self.names[column]);
            }
        }
        for row in &mut rows {
            row.iter_mut().for_each(|column| *column = renamed[*column as usize]);
        }
        *self = Matrix { rows, columns: vec![Vec::new(); names.len()], weights, names };
        self.index();
    }
}

struct Search {
    steps: u64,
}

impl Search {
    fn spend(&mut self, n: usize) -> bool {
        let enough = self.steps > n as u64;
        self.steps = self.steps.saturating_sub(n as u64 + 1);
        enough
    }

    /// Solves the problem; a cover with `limit` columns or more is not wanted (the result may then be any cover).
    fn whole(&mut self, matrix: &Matrix, depth: usize, limit: usize) -> Solution {
        let mut core = matrix.clone();
        let mut chosen = Vec::new();
        self.reduce(&mut core, &mut chosen);
        if core.rows.is_empty() {
            let lower = chosen.len();
            return Solution { columns: chosen, lower };
        }
        let blocks = blocks(&core);
        let mut lower = chosen.len();
        let n_blocks = blocks.len();
        for block in blocks {
            let room = if n_blocks == 1 { limit.saturating_sub(chosen.len()) } else { usize::MAX };
            let part = self.block(&block, depth, room);
            lower += part.lower;
            chosen.extend(part.columns);
        }
        Solution { columns: chosen, lower }
    }

    /// Chooses essential columns and removes dominated rows and columns, until nothing changes.
    fn reduce(&mut self, matrix: &mut Matrix, chosen: &mut Vec<u32>) {
        loop {
            let (n_rows, n_columns) = (matrix.rows.len(), matrix.columns.len());
            let mut is_row_gone = vec![false; n_rows];
            let mut is_column_gone = vec![false; n_columns];
            for row in &matrix.rows {
                if let [only] = row[..]
                    && !is_column_gone[only as usize]
                {
                    chosen.push(matrix.names[only as usize]);
                    is_column_gone[only as usize] = true;
                    for &row in &matrix.columns[only as usize] {
                        is_row_gone[row as usize] = true;
                    }
                }
            }
            if is_row_gone.contains(&true) {
                matrix.compact(&is_row_gone, &is_column_gone);
                continue;
            }
            self.dominated_rows(matrix, &mut is_row_gone);
            if is_row_gone.contains(&true) {
                matrix.compact(&is_row_gone, &is_column_gone);
                is_row_gone = vec![false; matrix.rows.len()];
                is_column_gone = vec![false; matrix.columns.len()];
            }
            self.dominated_columns(matrix, &mut is_column_gone);
            if !is_column_gone.contains(&true) {
                return;
            }
            matrix.compact(&is_row_gone, &is_column_gone);
        }
    }

    /// Marks rows that contain another row: a column that covers the other row covers them too.
    fn dominated_rows(&mut self, matrix: &Matrix, is_gone: &mut [bool]) {
        let mut order: Vec<usize> = (0..matrix.rows.len()).collect();
        sort_by_rank(&mut order, |&row| [matrix.rows[row].len() as u64]);
        for number in order {
            let row = &matrix.rows[number];
            if is_gone[number] {
                continue;
            }
            let Some(&rarest) = row.iter().min_by_key(|c| matrix.columns[**c as usize].len())
            else {
                continue;
            };
            for &other in &matrix.columns[rarest as usize] {
                let other = other as usize;
                if other != number && !is_gone[other] && matrix.rows[other].len() >= row.len() {
                    self.spend(row.len());
                    is_gone[other] = is_subset(row, &matrix.rows[other]);
                }
            }
        }
    }

    /// Marks columns whose rows are all in another column; of equal ones the lightest is kept, then the first.
    fn dominated_columns(&mut self, matrix: &Matrix, is_gone: &mut [bool]) {
        for (number, column) in matrix.columns.iter().enumerate() {
            let Some(&shortest) = column.iter().min_by_key(|r| matrix.rows[**r as usize].len())
            else {
                is_gone[number] = true;
                continue;
            };
            let rank =
                |c: usize| (matrix.columns[c].len(), std::cmp::Reverse((matrix.weights[c], c)));
            for &other in &matrix.rows[shortest as usize] {
                let other = other as usize;
                if is_gone[other] || rank(other) <= rank(number) {
                    continue;
                }
                self.spend(column.len());
                if is_subset(column, &matrix.columns[other]) {
                    is_gone[number] = true;
                    break;
                }
            }
        }
    }

    /// Solves a connected core by bounds, descent and branching.
    fn block(&mut self, matrix: &Matrix, depth: usize, limit: usize) -> Solution {
        let rounds = if depth == 0 { 600 } else { 80 };
        let mut relaxed = Relaxation::new(matrix, limit);
        relaxed.run(self, rounds);
        let mut lower = relaxed.lower();
        if depth == 0 && lower < relaxed.best.len() {
            // A quarter of the remaining steps is for better covers, the rest for the proof.
            let mut steps = self.steps / 4;
            let before = steps;
            let found =
                local::improve(&matrix.rows, &matrix.columns, &relaxed.best, lower, &mut steps);
            self.steps -= before - steps;
            if relaxed.is_better(&found) {
                relaxed.best = found;
            }
        }
        let mut best = relaxed.best.clone();
        let name = |columns: &[u32]| columns.iter().map(|c| matrix.names[*c as usize]).collect();
        let goal = best.len().min(limit);
        if lower >= goal || depth >= MAX_DEPTH || self.steps == 0 {
            return Solution { columns: name(&best), lower: lower.min(best.len()) };
        }
        // Columns whose reduced cost shows that no better cover contains them, or that every better cover does.
        let (is_out, is_in) = relaxed.fixed(goal);
        if is_out.contains(&true) || is_in.contains(&true) {
            let mut smaller = matrix.clone();
            let mut is_row_gone = vec![false; matrix.rows.len()];
            let mut is_column_gone = is_out;
            let mut taken = Vec::new();
            for (column, _) in is_in.iter().enumerate().filter(|(_, taken)| **taken) {
                taken.push(matrix.names[column]);
                is_column_gone[column] = true;
                matrix.columns[column].iter().for_each(|row| is_row_gone[*row as usize] = true);
            }
            smaller.compact(&is_row_gone, &is_column_gone);
            if smaller.rows.iter().any(Vec::is_empty) {
                // No better cover exists.
                return Solution { columns: name(&best), lower: goal };
            }
            let rest = self.whole(&smaller, depth + 1, goal.saturating_sub(taken.len()));
            let found = taken.len() + rest.columns.len();
            let bound = lower.max((taken.len() + rest.lower).min(goal));
            if found < best.len() {
                taken.extend(rest.columns);
                return Solution { columns: taken, lower: bound.min(found) };
            }
            return Solution { columns: name(&best), lower: bound };
        }
        let mut named: Vec<u32> = name(&best);
        best.clear();
        // Some column of this row is in the cover: try each in turn, excluding the earlier ones.
        let Some(row) = relaxed.branching_row() else {
            return Solution { columns: named, lower };
        };
        let mut goal = goal;
        let mut proved = usize::MAX;
        let mut is_column_gone = vec![false; matrix.columns.len()];
        for column in row {
            let mut branch = matrix.clone();
            let mut is_row_gone = vec![false; matrix.rows.len()];
            matrix.columns[column as usize].iter().for_each(|r| is_row_gone[*r as usize] = true);
            is_column_gone[column as usize] = true;
            branch.compact(&is_row_gone, &is_column_gone);
            if branch.rows.iter().any(Vec::is_empty) {
                continue;
            }
            if !self.spend(matrix.rows.len() + matrix.columns.len()) {
                proved = 0;
                break;
            }
            let rest = self.whole(&branch, depth + 1, goal.saturating_sub(1));
            proved = proved.min(rest.lower + 1);
            if rest.columns.len() + 1 < named.len() {
                named = rest.columns;
                named.push(matrix.names[column as usize]);
                goal = goal.min(named.len());
            }
            if lower >= goal {
                break;
            }
        }
        lower = lower.max(proved.min(goal));
        Solution { lower: lower.min(named.len()), columns: named }
    }
}

fn is_subset(a: &[u32], b: &[u32]) -> bool {
    let mut rest = b.iter();
    a.iter().all(|want| rest.by_ref().find(|have| *have >= want) == Some(want))
}

/// Parts of a problem that share no column.
fn blocks(matrix: &Matrix) -> Vec<Matrix> {
    let mut block_of = vec![usize::MAX; matrix.rows.len()];
    let mut n_blocks = 0;
    for start in 0..matrix.rows.len() {
        if block_of[start] != usize::MAX {
            continue;
        }
        let mut open = vec![start];
        block_of[start] = n_blocks;
        while let Some(row) = open.pop() {
            for &column in &matrix.rows[row] {
                for &next in &matrix.columns[column as usize] {
                    if block_of[next as usize] == usize::MAX {
                        block_of[next as usize] = n_blocks;
                        open.push(next as usize);
                    }
                }
            }
        }
        n_blocks += 1;
    }
    if n_blocks == 1 {
        return vec![matrix.clone()];
    }
    (0..n_blocks)
        .map(|block| {
            let is_row_gone: Vec<bool> = block_of.iter().map(|own| *own != block).collect();
            let mut part = matrix.clone();
            part.compact(&is_row_gone, &vec![false; matrix.columns.len()]);
            part
        })
        .collect()
}

/// The Lagrangian relaxation of one block.
struct Relaxation<'a> {
    matrix: &'a Matrix,
    /// The price of each row, and the prices of the best bound.
    prices: Vec<i64>,
    best_prices: Vec<i64>,
    reduced: Vec<i64>,
    bound: i64,
    /// The best cover found.
    best: Vec<u32>,
    limit: usize,
}

impl<'a> Relaxation<'a> {
    fn new(matrix: &'a Matrix, limit: usize) -> Self {
        let widest = |row: &Vec<u32>| {
            row.iter().map(|c| matrix.columns[*c as usize].len()).max().unwrap_or(1).max(1)
        };
        // A row pays its share of the longest column that can cover it, so no column is overpaid.
        let prices: Vec<i64> = matrix
            .rows
            .iter()
            .map(|row| UNIT / i64::try_from(widest(row)).unwrap_or(i64::MAX))
            .collect();
        let mut relaxed = Relaxation {
            matrix,
            best_prices: prices.clone(),
            prices,
            reduced: vec![0; matrix.columns.len()],
            bound: 0,
            best: Vec::new(),
            limit,
        };
        relaxed.evaluate();
        relaxed.best = relaxed.greedy();
        relaxed
    }

    /// The bound, rounded up to a whole number of columns.
    fn lower(&self) -> usize {
        usize::try_from((self.bound + UNIT - 1).div_euclid(UNIT)).unwrap_or(0)
    }

    /// Reduced costs and the bound at the current prices.
    fn evaluate(&mut self) -> i64 {
        let mut bound: i64 = self.prices.iter().sum();
        for (column, rows) in self.matrix.columns.iter().enumerate() {
            let paid: i64 = rows.iter().map(|row| self.prices[*row as usize]).sum();
            self.reduced[column] = UNIT - paid;
            bound += self.reduced[column].min(0);
        }
        bound
    }

    fn run(&mut self, search: &mut Search, rounds: usize) {
        let n_entries: usize = self.matrix.rows.iter().map(Vec::len).sum();
        let mut step = 1.0f64;
        let mut since = 0;
        for round in 0..rounds {
            if !search.spend(n_entries / 4) && round > 20 {
                break;
            }
            let bound = self.evaluate();
            if bound > self.bound {
                if (bound - self.bound) * 2000 > UNIT {
                    since = 0;
                }
                self.bound = bound;
                self.best_prices.clone_from(&self.prices);
            }
            since += 1;
            if since > 20 {
                since = 0;
                step /= 2.0;
                if step < 0.004 {
                    break;
                }
                self.prices.clone_from(&self.best_prices);
                self.evaluate();
            }
            if round % 6 == 0 || since == 1 {
                let cover = self.greedy();
                if self.is_better(&cover) {
                    self.best = cover;
                }
            }
            if self.lower() >= self.best.len().min(self.limit) {
                break;
            }
            // Rows that are covered too often become cheaper, uncovered ones more expensive.
            let mut slack: Vec<i64> = vec![1; self.matrix.rows.len()];
            for (column, rows) in self.matrix.columns.iter().enumerate() {
                if self.reduced[column] < 0 {
                    rows.iter().for_each(|row| slack[*row as usize] -= 1);
                }
            }
            let norm: i64 = slack.iter().map(|s| s * s).sum();
            if norm == 0 {
                break;
            }
            let goal = i64::try_from(self.best.len()).unwrap_or(i64::MAX / UNIT) * UNIT;
            #[expect(clippy::cast_precision_loss, reason = "a step length, not a bound")]
            let length = step * ((goal - bound).max(UNIT / 20)) as f64 / norm as f64;
            for (price, slack) in self.prices.iter_mut().zip(&slack) {
                #[expect(
                    clippy::cast_precision_loss,
                    clippy::cast_possible_truncation,
                    reason = "any price gives a true bound"
                )]
                let change = (length * *slack as f64).round() as i64;
                *price = (*price + change).clamp(0, 8 * UNIT);
            }
        }
        self.prices.clone_from(&self.best_prices);
        self.evaluate();
    }

    fn is_better(&self, cover: &[u32]) -> bool {
        let weight = |cover: &[u32]| -> u64 {
            cover.iter().map(|c| u64::from(self.matrix.weights[*c as usize])).sum()
        };
        (cover.len(), weight(cover)) < (self.best.len(), weight(&self.best))
    }

    /// A cover chosen by reduced cost per newly covered row, then without columns that became superfluous.
    fn greedy(&self) -> Vec<u32> {
        let matrix = self.matrix;
        let mut n_covers = vec![0u32; matrix.rows.len()];
        let mut open = matrix.rows.len();
        let mut news: Vec<usize> = matrix.columns.iter().map(Vec::len).collect();
        let mut chosen: Vec<u32> = Vec::new();
        let mut heap = std::collections::BinaryHeap::new();
        let key = |column: usize, news: usize| {
            let cost = self.reduced[column];
            let n = i64::try_from(news).unwrap_or(1).max(1);
            let score = if cost > 0 { cost * 256 / n } else { cost * 256 * n };
            (score, matrix.weights[column], column)
        };
        for (column, &n) in news.iter().enumerate() {
            heap.push(std::cmp::Reverse((key(column, n), n)));
        }
        while open > 0 {
            let Some(std::cmp::Reverse(((_, _, column), known))) = heap.pop() else { break };
            let now = news[column];
            if now == 0 {
                continue;
            }
            if now != known {
                heap.push(std::cmp::Reverse((key(column, now), now)));
                continue;
            }
            chosen.push(u32::try_from(column).unwrap_or(u32::MAX));
            for &row in &matrix.columns[column] {
                n_covers[row as usize] += 1;
                if n_covers[row as usize] == 1 {
                    open -= 1;
                    for &other in &matrix.rows[row as usize] {
                        news[other as usize] -= 1;
                    }
                }
            }
        }
        let mut order = chosen.clone();
        order.sort_by_key(|c| {
            let c = *c as usize;
            std::cmp::Reverse((self.reduced[c], matrix.weights[c], c))
        });
        let mut is_kept = vec![true; matrix.columns.len()];
        for column in order {
            let rows = &matrix.columns[column as usize];
            if rows.iter().all(|row| n_covers[*row as usize] > 1) {
                rows.iter().for_each(|row| n_covers[*row as usize] -= 1);
                is_kept[column as usize] = false;
            }
        }
        chosen.retain(|column| is_kept[*column as usize]);
        chosen
    }

    /// Columns that no cover below `goal` contains, and those that each such cover contains.
    fn fixed(&self, goal: usize) -> (Vec<bool>, Vec<bool>) {
        // A cover below the goal costs at most this much.
        let most = (i64::try_from(goal).unwrap_or(i64::MAX / UNIT) - 1) * UNIT;
        let out = self.reduced.iter().map(|cost| *cost > 0 && self.bound + cost > most).collect();
        let taken = self.reduced.iter().map(|cost| *cost < 0 && self.bound - cost > most).collect();
        (out, taken)
    }

    /// The columns of a row with the fewest columns, the most promising first.
    fn branching_row(&self) -> Option<Vec<u32>> {
        let row = self
            .matrix
            .rows
            .iter()
            .zip(&self.prices)
            .min_by_key(|(row, price)| (row.len(), std::cmp::Reverse(**price)));
        let mut columns = row?.0.clone();
        columns.sort_by_key(|c| {
            let c = *c as usize;
            (self.reduced[c], std::cmp::Reverse(self.matrix.columns[c].len()), c)
        });
        Some(columns)
    }
}

#[cfg(test)]
mod tests {
    use super::solve;
    use proptest::prelude::*;

    /// The minimum cover of at most 10 columns, by trying all sets.
    fn brute(sets: &[Vec<u32>]) -> usize {
        (0u32..1 << 10)
            .filter(|chosen| sets.iter().all(|set| set.iter().any(|c| chosen >> c & 1 == 1)))
            .map(|chosen| chosen.count_ones() as usize)
            .min()
            .unwrap_or(usize::MAX)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]
        #[test]
        fn covers_are_minimal_and_bounds_true(masks in prop::collection::vec(1u32..1 << 10, 1..24), steps in prop::sample::select(vec![0u64, 100, 1 << 24])) {
            let sets: Vec<Vec<u32>> = masks.iter().map(|mask| (0..10).filter(|c| mask >> c & 1 == 1).collect()).collect();
            let solution = solve(&sets, &[1; 10], steps);
            prop_assert!(sets.iter().all(|set| set.iter().any(|c| solution.columns.contains(c))));
            let least = brute(&sets);
            prop_assert!(solution.lower <= least && least <= solution.columns.len());
            if steps > 1000 {
                prop_assert_eq!(solution.columns.len(), least);
                prop_assert_eq!(solution.lower, least);
            }
        }
    }

    #[test]
    fn a_ring_of_pairs_needs_half_its_columns() {
        // Row k has columns k and k + 1 of a ring of n columns: the linear bound is n / 2.
        let n = 41u32;
        let sets: Vec<Vec<u32>> = (0..n)
            .map(|k| {
                let mut set = vec![k, (k + 1) % n];
                set.sort_unstable();
                set
            })
            .collect();
        let solution = solve(&sets, &vec![1; n as usize], 1 << 26);
        assert_eq!((solution.columns.len(), solution.lower), (21, 21));
    }
}
