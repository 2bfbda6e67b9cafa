//! The rows of a covering table: for each kind of point, the columns that cover it.

/// Sets of columns, each sorted; none contains an earlier one.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    sets: Vec<Vec<u32>>,
    /// The sets, grouped by their first column.
    by_first: Vec<Vec<u32>>,
    is_in: Vec<bool>,
    limit: usize,
    /// True if some point is covered by no column.
    pub(super) has_gap: bool,
}

impl Rows {
    /// An empty table for `n_columns` columns; sets beyond `limit` are rejected.
    pub(super) fn new(n_columns: usize, limit: usize) -> Self {
        Rows {
            sets: Vec::new(),
            by_first: vec![Vec::new(); n_columns],
            is_in: vec![false; n_columns],
            limit,
            has_gap: false,
        }
    }

    pub(super) fn sets(self) -> Vec<Vec<u32>> {
        self.sets
    }

    pub(super) fn is_full(&self) -> bool {
        self.sets.len() >= self.limit
    }

    /// Returns true if these columns contain a stored set, and the number of sets that were visited.
    pub(super) fn has_subset_of(&mut self, columns: &[u32]) -> (bool, usize) {
        let mut marked = true;
        for &column in columns {
            match self.is_in.get_mut(column as usize) {
                Some(place) => *place = true,
                None => marked = false,
            }
        }
        debug_assert!(marked, "only columns are asked about");
        let mut looks = 0;
        let found = columns.iter().any(|&first| {
            self.by_first[first as usize].iter().any(|&set| {
                looks += 1;
                self.sets[set as usize].iter().all(|&c| self.is_in[c as usize])
            })
        });
        columns.iter().for_each(|&column| self.is_in[column as usize] = false);
        (found, looks)
    }

    pub(super) fn add(&mut self, columns: &[u32]) {
        let mut set = columns.to_vec();
        set.sort_unstable();
        match set.first() {
            None => self.has_gap = true,
            Some(&first) if !self.is_full() => {
                self.by_first[first as usize]
                    .push(u32::try_from(self.sets.len()).unwrap_or(u32::MAX));
                self.sets.push(set);
            }
            Some(_) => {}
        }
    }
}
