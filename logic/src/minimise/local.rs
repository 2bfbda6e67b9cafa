//! A local search for small covers: rows that stay uncovered gain weight until a column covers them [Gao, Weise and Li 2015].
//!
//! It proves nothing, but finds covers that greedy choices by price miss in symmetric tables, where all columns are alike.

/// Tries to cover all rows with fewer columns than `cover`, down to `goal`. Columns are lists of rows and rows are lists of columns, both numbered from 0.
/// `steps` bounds the work in entries visited; the same problem always gives the same result.
pub(super) fn improve(
    rows: &[Vec<u32>],
    columns: &[Vec<u32>],
    cover: &[u32],
    goal: usize,
    steps: &mut u64,
) -> Vec<u32> {
    let mut best = cover.to_vec();
    let mut search = Search {
        rows,
        columns,
        weights: vec![1; rows.len()],
        n_covers: vec![0; rows.len()],
        open: Vec::new(),
        place: vec![usize::MAX; rows.len()],
        scores: columns.iter().map(|rows| i64::try_from(rows.len()).unwrap_or(i64::MAX)).collect(),
        is_in: vec![false; columns.len()],
        stamps: vec![0; columns.len()],
        may_enter: vec![true; columns.len()],
        chosen: Vec::new(),
        work: 0,
    };
    search.open.extend(0..rows.len());
    (0..rows.len()).for_each(|row| search.place[row] = row);
    cover.iter().for_each(|column| search.add(*column as usize));
    let mut random = 0x9e37_79b9_7f4a_7c15u64;
    let mut round = 0u64;
    let mut tabu = usize::MAX;
    while *steps > search.work {
        round += 1;
        while search.open.is_empty() {
            best.clone_from(&search.chosen);
            if best.len() <= goal {
                *steps -= search.work;
                return best;
            }
            let Some(out) = search.cheapest(usize::MAX) else { break };
            search.remove(out, round);
        }
        if search.open.is_empty() || search.chosen.is_empty() {
            break;
        }
        if let Some(out) = search.cheapest(tabu) {
            search.remove(out, round);
        }
        random =
            random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let at = usize::try_from(random >> 33).unwrap_or(0) % search.open.len();
        let row = search.open[at];
        if let Some(column) = search.dearest_of(row) {
            search.add(column);
            search.stamps[column] = round;
            tabu = column;
        }
        search.press();
    }
    *steps = steps.saturating_sub(search.work);
    best
}

struct Search<'a> {
    rows: &'a [Vec<u32>],
    columns: &'a [Vec<u32>],
    weights: Vec<i64>,
    n_covers: Vec<u32>,
    /// The uncovered rows, and the position of each row among them.
    open: Vec<usize>,
    place: Vec<usize>,
    /// The score of each column. Outside the cover: the weight of the uncovered rows that the column would cover. Inside: minus the weight of the rows that
    /// only this column covers.
    scores: Vec<i64>,
    is_in: Vec<bool>,
    /// The round of the last move of each column.
    stamps: Vec<u64>,
    /// True if a row of the column has changed since the column left the cover.
    may_enter: Vec<bool>,
    chosen: Vec<u32>,
    work: u64,
}

impl Search<'_> {
    fn add(&mut self, column: usize) {
        self.is_in[column] = true;
        self.scores[column] = -self.scores[column];
        self.chosen.push(u32::try_from(column).unwrap_or(u32::MAX));
        for &row in &self.columns[column] {
            let row = row as usize;
            self.n_covers[row] += 1;
            let weight = self.weights[row];
            match self.n_covers[row] {
                1 => {
                    self.close(row);
                    for &other in &self.rows[row] {
                        let other = other as usize;
                        if other != column {
                            self.scores[other] -= weight;
                            self.may_enter[other] = true;
                        }
                    }
                    self.work += self.rows[row].len() as u64;
                }
                2 => {
                    if let Some(&other) = self.rows[row]
                        .iter()
                        .find(|c| **c as usize != column && self.is_in[**c as usize])
                    {
                        self.scores[other as usize] += weight;
                    }
                    self.work += self.rows[row].len() as u64;
                }
                _ => self.work += 1,
            }
        }
    }

    fn remove(&mut self, column: usize, round: u64) {
        self.is_in[column] = false;
        self.scores[column] = -self.scores[column];
        self.may_enter[column] = false;
        self.stamps[column] = round;
        self.chosen.retain(|c| *c as usize != column);
        for &row in &self.columns[column] {
            let row = row as usize;
            self.n_covers[row] -= 1;
            let weight = self.weights[row];
            match self.n_covers[row] {
                0 => {
                    self.place[row] = self.open.len();
                    self.open.push(row);
                    for &other in &self.rows[row] {
                        let other = other as usize;
                        if other != column {
                            self.scores[other] += weight;
                            self.may_enter[other] = true;
                        }
                    }
                    self.work += self.rows[row].len() as u64;
                }
                1 => {
                    if let Some(&other) = self.rows[row].iter().find(|c| self.is_in[**c as usize]) {
                        self.scores[other as usize] -= weight;
                    }
                    self.work += self.rows[row].len() as u64;
                }
                _ => self.work += 1,
            }
        }
    }

    fn close(&mut self, row: usize) {
        let at = self.place[row];
        self.open.swap_remove(at);
        if let Some(&moved) = self.open.get(at) {
            self.place[moved] = at;
        }
        self.place[row] = usize::MAX;
    }

    /// The chosen column with the smallest loss; of equal ones the one that has been in the cover longest.
    fn cheapest(&mut self, tabu: usize) -> Option<usize> {
        self.work += self.chosen.len() as u64;
        self.chosen
            .iter()
            .map(|column| *column as usize)
            .filter(|column| *column != tabu)
            .max_by_key(|column| {
                (self.scores[*column], std::cmp::Reverse((self.stamps[*column], *column)))
            })
    }

    /// The column of a row that covers the most weight; of equal ones the one that has been outside longest.
    fn dearest_of(&mut self, row: usize) -> Option<usize> {
        self.work += self.rows[row].len() as u64;
        self.rows[row]
            .iter()
            .map(|column| *column as usize)
            .filter(|column| self.may_enter[*column])
            .max_by_key(|column| {
                (self.scores[*column], std::cmp::Reverse((self.stamps[*column], *column)))
            })
    }

    /// Increases the weight of uncovered rows.
    fn press(&mut self) {
        for at in 0..self.open.len() {
            let row = self.open[at];
            self.weights[row] += 1;
            for &column in &self.rows[row] {
                self.scores[column as usize] += 1;
            }
            self.work += self.rows[row].len() as u64;
        }
    }
}
