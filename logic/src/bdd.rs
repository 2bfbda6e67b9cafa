//! Reduced ordered binary decision diagrams [Bryant 1986], hash-consed in one arena.
//!
//! Two functions are equal if and only if their [`Ref`]s are equal. The client chooses the order of the variables, which is the order of their levels.
//! Nodes are freed only on request: most managers are used for one query, and a longer-lived one drops unneeded nodes with [`Bdd::keep`]. The limit
//! given to [`Bdd::with_limit`] bounds the size and [`Bdd::limit_work`] bounds the work; beyond a limit, operations return [`Full`]. No operation
//! recurses, so only memory bounds the number of variables. Nothing depends on addresses or on a random hash, so the same calls give the same
//! diagrams on all machines.

mod ask;

/// A function in a [`Bdd`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Ref(u32);

impl Ref {
    /// The function that is never true.
    pub const FALSE: Ref = Ref(0);
    /// The function that is always true.
    pub const TRUE: Ref = Ref(1);

    /// True for the two constants.
    #[must_use]
    pub fn is_const(self) -> bool {
        self.0 < 2
    }

    /// The constant function with this value.
    #[must_use]
    pub fn constant(value: bool) -> Ref {
        if value { Ref::TRUE } else { Ref::FALSE }
    }
}

/// The exhausted resource.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LimitExceeded {
    /// Nodes.
    Nodes,
    /// Steps of work.
    Work,
}

/// The diagram exceeded its limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Full {
    /// The exhausted resource.
    pub of: LimitExceeded,
    /// The limit, in nodes or in steps.
    pub limit: usize,
}

impl std::fmt::Display for Full {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let what = match self.of {
            LimitExceeded::Nodes => "nodes",
            LimitExceeded::Work => "steps of work",
        };
        write!(f, "the decision diagram needs more than {} {what}", self.limit)
    }
}

impl std::error::Error for Full {}

/// `if the variable of this level then high else low`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Node {
    level: u32,
    low: Ref,
    high: Ref,
}

/// The level of the constants: below every variable.
const LEAF: u32 = u32::MAX;

/// Codes of the memoised operations.
const OP_ITE: u32 = 1;
const OP_AND_EXISTS: u32 = 2;

/// A memoised operation and its result; `op` 0 marks an empty entry.
#[derive(Debug, Clone, Copy, Default)]
struct Memo {
    op: u32,
    a: u32,
    b: u32,
    c: u32,
    answer: u32,
}

/// A pending task; a stack of these replaces recursion.
#[derive(Debug, Clone, Copy)]
enum Task {
    Ite(Ref, Ref, Ref),
    AndExists(Ref, Ref, Ref),
    /// Make a node from the two values on top of the stack and memoise it under `key`.
    Join(u32, (u32, Ref, Ref, Ref)),
    /// The low half of a quantified variable is on top of the stack: stop if it is true, else compute the high half.
    High((Ref, Ref, Ref), (u32, Ref, Ref, Ref)),
    /// Replace the two values on top of the stack by their disjunction and memoise it.
    Either((u32, Ref, Ref, Ref)),
    /// Memoise the value on top of the stack.
    Note((u32, Ref, Ref, Ref)),
}

/// A manager: all functions built so far, over one variable order.
#[derive(Debug, Clone)]
pub struct Bdd {
    nodes: Vec<Node>,
    /// Open addressing over `nodes`; 0 is an empty entry (the constants are never looked up).
    unique: Vec<u32>,
    /// A lossy cache of results.
    memo: Vec<Memo>,
    limit: usize,
    work: u64,
    work_limit: u64,
    tasks: Vec<Task>,
    values: Vec<Ref>,
}

impl Default for Bdd {
    fn default() -> Self {
        Self::with_limit(1 << 22)
    }
}

impl Bdd {
    /// An empty manager with at most `limit` nodes (about 30 bytes each).
    #[must_use]
    pub fn with_limit(limit: usize) -> Self {
        let leaf = |value| Node { level: LEAF, low: Ref(value), high: Ref(value) };
        Bdd {
            nodes: vec![leaf(0), leaf(1)],
            unique: vec![0; 64],
            memo: vec![Memo::default(); 64],
            limit: limit.clamp(2, u32::MAX as usize - 1),
            work: 0,
            work_limit: u64::MAX,
            tasks: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Limits the work from now on to `steps`; one step visits one node, or one pair or triple of nodes. Unlike nodes, steps are never given back, so
    /// together with the node limit they bound the time of a query, in the same way on every machine.
    pub fn limit_work(&mut self, steps: u64) {
        self.work_limit = self.work.saturating_add(steps);
    }

    /// The number of steps so far.
    #[must_use]
    pub fn work(&self) -> u64 {
        self.work
    }

    fn spend(&mut self, steps: usize) -> Result<(), Full> {
        self.work = self.work.saturating_add(steps as u64);
        if self.work > self.work_limit {
            let limit = usize::try_from(self.work_limit).unwrap_or(usize::MAX);
            return Err(Full { of: LimitExceeded::Work, limit });
        }
        Ok(())
    }

    /// Drops all nodes except those of these functions, whose references are updated. All other [`Ref`]s except the constants become invalid.
    pub fn keep(&mut self, roots: &mut [Ref]) {
        let mut new_name = vec![0; self.nodes.len()];
        new_name[1] = 1;
        let mut is_live = vec![false; self.nodes.len()];
        roots.iter().for_each(|root| is_live[root.0 as usize] = true);
        // Children are made before their parents, so descending order is top-down and ascending order is bottom-up.
        for index in (2..self.nodes.len()).rev() {
            if is_live[index] {
                let node = self.nodes[index];
                is_live[node.low.0 as usize] = true;
                is_live[node.high.0 as usize] = true;
            }
        }
        let mut kept: Vec<Node> = self.nodes[..2].to_vec();
        for index in (2..self.nodes.len()).filter(|index| is_live[*index]) {
            let node = self.nodes[index];
            new_name[index] = kept.len() as u32;
            kept.push(Node {
                level: node.level,
                low: Ref(new_name[node.low.0 as usize]),
                high: Ref(new_name[node.high.0 as usize]),
            });
        }
        self.nodes = kept;
        roots.iter_mut().for_each(|root| *root = Ref(new_name[root.0 as usize]));
        self.memo.fill(Memo::default());
        self.fill_unique();
    }

    /// The number of nodes built so far, including both constants.
    #[must_use]
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Always false: the constants always exist.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The level of the root variable; `None` for a constant.
    #[must_use]
    pub fn level(&self, f: Ref) -> Option<u32> {
        let level = self.nodes[f.0 as usize].level;
        (level != LEAF).then_some(level)
    }

    /// The functions for root variable = 0 and = 1; for a constant, the constant twice.
    #[must_use]
    pub fn branches(&self, f: Ref) -> (Ref, Ref) {
        let node = self.nodes[f.0 as usize];
        (node.low, node.high)
    }

    /// The variable of this level (any number below `u32::MAX`).
    ///
    /// # Errors
    /// If the manager is full.
    pub fn var(&mut self, level: u32) -> Result<Ref, Full> {
        self.node(level, Ref::FALSE, Ref::TRUE)
    }

    /// The node `if level then high else low`; both children must be below `level` in the order.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn node(&mut self, level: u32, low: Ref, high: Ref) -> Result<Ref, Full> {
        if low == high {
            return Ok(low);
        }
        debug_assert!(
            self.nodes[low.0 as usize].level > level && self.nodes[high.0 as usize].level > level
        );
        let mask = self.unique.len() - 1;
        let mut place = mix(level, low.0, high.0, 0) as usize & mask;
        loop {
            let index = self.unique[place];
            if index == 0 {
                break;
            }
            let node = self.nodes[index as usize];
            if node.level == level && node.low == low && node.high == high {
                return Ok(Ref(index));
            }
            place = (place + 1) & mask;
        }
        if self.nodes.len() >= self.limit {
            return Err(self.full());
        }
        let index = u32::try_from(self.nodes.len()).map_err(|_| self.full())?;
        self.nodes.push(Node { level, low, high });
        self.unique[place] = index;
        if self.nodes.len() * 2 > self.unique.len() {
            self.grow();
        }
        Ok(Ref(index))
    }

    fn full(&self) -> Full {
        Full { of: LimitExceeded::Nodes, limit: self.limit }
    }

    /// Enters all nodes into the table of unique nodes, which is empty or outdated.
    fn fill_unique(&mut self) {
        let mask = self.unique.len() - 1;
        self.unique.fill(0);
        for (index, node) in (0u32..).zip(&self.nodes).skip(2) {
            let mut place = mix(node.level, node.low.0, node.high.0, 0) as usize & mask;
            while self.unique[place] != 0 {
                place = (place + 1) & mask;
            }
            self.unique[place] = index;
        }
    }

    fn grow(&mut self) {
        let size = self.unique.len() * 2;
        self.unique = vec![0; size];
        self.fill_unique();
        // Old results are still valid, but their positions change; discarding them costs less than moving them.
        let memo = (size / 2).min(1 << 20);
        if memo > self.memo.len() {
            self.memo = vec![Memo::default(); memo];
        }
    }

    fn recall(&self, (op, a, b, c): (u32, Ref, Ref, Ref)) -> Option<Ref> {
        let memo = self.memo[mix(a.0, b.0, c.0, op) as usize & (self.memo.len() - 1)];
        (memo.op == op && memo.a == a.0 && memo.b == b.0 && memo.c == c.0)
            .then_some(Ref(memo.answer))
    }

    fn note(&mut self, (op, a, b, c): (u32, Ref, Ref, Ref), answer: Ref) {
        let place = mix(a.0, b.0, c.0, op) as usize & (self.memo.len() - 1);
        self.memo[place] = Memo { op, a: a.0, b: b.0, c: c.0, answer: answer.0 };
    }

    /// `if f then g else h`.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn ite(&mut self, f: Ref, g: Ref, h: Ref) -> Result<Ref, Full> {
        self.run(Task::Ite(f, g, h))
    }

    /// The negation.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn not(&mut self, f: Ref) -> Result<Ref, Full> {
        self.ite(f, Ref::FALSE, Ref::TRUE)
    }

    /// The conjunction.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn and(&mut self, f: Ref, g: Ref) -> Result<Ref, Full> {
        // The smaller one first, so that both orders share one cache entry.
        self.ite(f.min(g), f.max(g), Ref::FALSE)
    }

    /// The disjunction.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn or(&mut self, f: Ref, g: Ref) -> Result<Ref, Full> {
        self.ite(f.min(g), Ref::TRUE, f.max(g))
    }

    /// The exclusive disjunction.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn xor(&mut self, f: Ref, g: Ref) -> Result<Ref, Full> {
        let inverse = self.not(g)?;
        self.ite(f, inverse, g)
    }

    /// The equivalence: true if `f` and `g` are equal.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn iff(&mut self, f: Ref, g: Ref) -> Result<Ref, Full> {
        let inverse = self.not(g)?;
        self.ite(f, g, inverse)
    }

    /// `f and not g`.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn and_not(&mut self, f: Ref, g: Ref) -> Result<Ref, Full> {
        self.ite(g, Ref::FALSE, f)
    }

    /// The conjunction of the given functions, built as a balanced tree.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn and_all(&mut self, all: impl IntoIterator<Item = Ref>) -> Result<Ref, Full> {
        self.fold_balanced(all.into_iter().collect(), Ref::TRUE, Bdd::and)
    }

    /// The disjunction of the given functions, built as a balanced tree.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn or_all(&mut self, all: impl IntoIterator<Item = Ref>) -> Result<Ref, Full> {
        self.fold_balanced(all.into_iter().collect(), Ref::FALSE, Bdd::or)
    }

    fn fold_balanced(
        &mut self,
        mut layer: Vec<Ref>,
        neutral: Ref,
        join: fn(&mut Self, Ref, Ref) -> Result<Ref, Full>,
    ) -> Result<Ref, Full> {
        while layer.len() > 1 {
            let mut next = Vec::with_capacity(layer.len().div_ceil(2));
            for pair in layer.chunks(2) {
                next.push(match *pair {
                    [a, b] => join(self, a, b)?,
                    _ => pair[0],
                });
            }
            layer = next;
        }
        Ok(layer.first().copied().unwrap_or(neutral))
    }

    /// The conjunction of the variables of these levels: the representation of a variable set for [`Bdd::exists`].
    ///
    /// # Errors
    /// If the manager is full.
    pub fn cube(&mut self, levels: impl IntoIterator<Item = u32>) -> Result<Ref, Full> {
        let mut levels: Vec<u32> = levels.into_iter().collect();
        levels.sort_unstable();
        levels.dedup();
        let mut cube = Ref::TRUE;
        for level in levels.into_iter().rev() {
            cube = self.node(level, Ref::FALSE, cube)?;
        }
        Ok(cube)
    }

    /// The function that is true if some values of the variables of `cube` make `f` true.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn exists(&mut self, f: Ref, cube: Ref) -> Result<Ref, Full> {
        self.and_exists(f, Ref::TRUE, cube)
    }

    /// The function that is true if `f` is true for all values of the variables of `cube`.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn forall(&mut self, f: Ref, cube: Ref) -> Result<Ref, Full> {
        let inverse = self.not(f)?;
        let some = self.exists(inverse, cube)?;
        self.not(some)
    }

    /// `exists(and(f, g), cube)` without building the conjunction: the relational product of image computation.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn and_exists(&mut self, f: Ref, g: Ref, cube: Ref) -> Result<Ref, Full> {
        self.run(Task::AndExists(f, g, cube))
    }

    /// `f` with each variable of `level` replaced by the variable of level `map(level)`. Any map is allowed; one that preserves the order is cheap.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn rename(&mut self, f: Ref, mut map: impl FnMut(u32) -> u32) -> Result<Ref, Full> {
        let reached = self.reached(f);
        self.spend(reached.len())?;
        let mut images: Vec<(Ref, Ref)> = Vec::with_capacity(reached.len());
        // Children are made before their parents, so ascending order is bottom-up.
        for node_ref in reached {
            let node = self.nodes[node_ref.0 as usize];
            let low = image_of(&images, node.low);
            let high = image_of(&images, node.high);
            let level = map(node.level);
            let above = |child: Ref| self.nodes[child.0 as usize].level > level;
            let image = if above(low) && above(high) {
                self.node(level, low, high)?
            } else {
                let var = self.var(level)?;
                self.ite(var, high, low)?
            };
            images.push((node_ref, image));
        }
        Ok(image_of(&images, f))
    }

    /// `f` with the variable of `level` set to `value`.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn restrict(&mut self, f: Ref, level: u32, value: bool) -> Result<Ref, Full> {
        self.compose(f, level, Ref::constant(value))
    }

    /// `f` with the variable of `level` replaced by the function `g`.
    ///
    /// # Errors
    /// If the manager is full.
    pub fn compose(&mut self, f: Ref, level: u32, g: Ref) -> Result<Ref, Full> {
        let reached = self.reached(f);
        self.spend(reached.len())?;
        let mut images: Vec<(Ref, Ref)> = Vec::with_capacity(reached.len());
        for node_ref in reached {
            let node = self.nodes[node_ref.0 as usize];
            let low = image_of(&images, node.low);
            let high = image_of(&images, node.high);
            let image = if node.level == level {
                self.ite(g, high, low)?
            } else if node.level > level {
                node_ref
            } else {
                let var = self.var(node.level)?;
                self.ite(var, high, low)?
            };
            images.push((node_ref, image));
        }
        Ok(image_of(&images, f))
    }

    /// Processes tasks until the value of the first one is known.
    fn run(&mut self, first: Task) -> Result<Ref, Full> {
        let mut tasks = std::mem::take(&mut self.tasks);
        let mut values = std::mem::take(&mut self.values);
        tasks.clear();
        values.clear();
        tasks.push(first);
        let mut outcome = Ok(());
        while let Some(task) = tasks.pop() {
            if let Err(full) =
                self.spend(1).and_then(|()| self.work_on(task, &mut tasks, &mut values))
            {
                outcome = Err(full);
                break;
            }
        }
        let value = values.pop().unwrap_or(Ref::FALSE);
        self.tasks = tasks;
        self.values = values;
        outcome.map(|()| value)
    }

    fn work_on(
        &mut self,
        task: Task,
        tasks: &mut Vec<Task>,
        values: &mut Vec<Ref>,
    ) -> Result<(), Full> {
        let mut pop = || values.pop().unwrap_or_else(|| unreachable!("each task leaves one value"));
        match task {
            Task::Ite(f, g, h) => match ite_at_once(f, g, h) {
                Some(value) => values.push(value),
                None => {
                    let key = (OP_ITE, f, g, h);
                    if let Some(value) = self.recall(key) {
                        values.push(value);
                        return Ok(());
                    }
                    let level = self.top(f).min(self.top(g)).min(self.top(h));
                    let ((f0, f1), (g0, g1), (h0, h1)) =
                        (self.at(f, level), self.at(g, level), self.at(h, level));
                    tasks.push(Task::Join(level, key));
                    tasks.push(Task::Ite(f1, g1, h1));
                    tasks.push(Task::Ite(f0, g0, h0));
                }
            },
            Task::AndExists(f, g, cube) => {
                let (f, g) = (f.min(g), f.max(g));
                if f == Ref::FALSE {
                    values.push(Ref::FALSE);
                    return Ok(());
                }
                if f == Ref::TRUE && g == Ref::TRUE {
                    values.push(Ref::TRUE);
                    return Ok(());
                }
                let level = self.top(f).min(self.top(g));
                // Variables that occur in neither function are skipped.
                let mut cube = cube;
                while self.top(cube) < level {
                    cube = self.nodes[cube.0 as usize].high;
                }
                if cube == Ref::TRUE {
                    tasks.push(Task::Ite(f, g, Ref::FALSE));
                    return Ok(());
                }
                let key = (OP_AND_EXISTS, f, g, cube);
                if let Some(value) = self.recall(key) {
                    values.push(value);
                    return Ok(());
                }
                let ((f0, f1), (g0, g1)) = (self.at(f, level), self.at(g, level));
                if self.top(cube) == level {
                    let rest = self.nodes[cube.0 as usize].high;
                    tasks.push(Task::High((f1, g1, rest), key));
                    tasks.push(Task::AndExists(f0, g0, rest));
                } else {
                    tasks.push(Task::Join(level, key));
                    tasks.push(Task::AndExists(f1, g1, cube));
                    tasks.push(Task::AndExists(f0, g0, cube));
                }
            }
            Task::Join(level, key) => {
                let (high, low) = (pop(), pop());
                let value = self.node(level, low, high)?;
                self.note(key, value);
                values.push(value);
            }
            Task::High((f, g, rest), key) => {
                let low = pop();
                values.push(low);
                if low == Ref::TRUE {
                    self.note(key, low);
                } else {
                    tasks.push(Task::Either(key));
                    tasks.push(Task::AndExists(f, g, rest));
                }
            }
            Task::Either(key) => {
                let (high, low) = (pop(), pop());
                tasks.push(Task::Note(key));
                tasks.push(Task::Ite(low, Ref::TRUE, high));
            }
            Task::Note(key) => {
                let value = pop();
                self.note(key, value);
                values.push(value);
            }
        }
        Ok(())
    }

    fn top(&self, f: Ref) -> u32 {
        self.nodes[f.0 as usize].level
    }

    /// Both cofactors of `f` at `level`; `level` is at or above the root of `f`.
    fn at(&self, f: Ref, level: u32) -> (Ref, Ref) {
        let node = self.nodes[f.0 as usize];
        if node.level == level { (node.low, node.high) } else { (f, f) }
    }
}

/// The image of a child: constants are unchanged, inner nodes were recorded before.
fn image_of(images: &[(Ref, Ref)], child: Ref) -> Ref {
    if child.is_const() {
        return child;
    }
    match images.binary_search_by_key(&child, |pair| pair.0) {
        Ok(at) => images[at].1,
        Err(_) => unreachable!("children are numbered before their parents"),
    }
}

fn ite_at_once(f: Ref, g: Ref, h: Ref) -> Option<Ref> {
    if f == Ref::TRUE || g == h {
        Some(g)
    } else if f == Ref::FALSE {
        Some(h)
    } else if g == Ref::TRUE && h == Ref::FALSE {
        Some(f)
    } else {
        None
    }
}

/// A hash of four words (the finaliser of `MurmurHash3`, over a sum with odd factors).
fn mix(a: u32, b: u32, c: u32, d: u32) -> u32 {
    let mut hash = a
        .wrapping_mul(0x9E37_79B1)
        .wrapping_add(b.wrapping_mul(0x85EB_CA77))
        .wrapping_add(c.wrapping_mul(0xC2B2_AE3D))
        .wrapping_add(d.wrapping_mul(0x27D4_EB2F));
    hash ^= hash >> 16;
    hash = hash.wrapping_mul(0x85EB_CA6B);
    hash ^= hash >> 13;
    hash = hash.wrapping_mul(0xC2B2_AE35);
    hash ^ (hash >> 16)
}

#[cfg(test)]
mod tests {
    use super::{Bdd, Full, LimitExceeded, Ref};
    use proptest::prelude::*;

    /// A function of 5 variables as its truth table.
    fn build(bdd: &mut Bdd, table: u32) -> Ref {
        let mut rows = Vec::new();
        for row in 0..32u32 {
            if table >> row & 1 == 1 {
                let mut cube = Ref::TRUE;
                for level in (0..5).rev() {
                    let var = bdd.var(level).unwrap();
                    let literal = if row >> level & 1 == 1 { var } else { bdd.not(var).unwrap() };
                    cube = bdd.and(cube, literal).unwrap();
                }
                rows.push(cube);
            }
        }
        bdd.or_all(rows).unwrap()
    }

    fn table(bdd: &Bdd, f: Ref) -> u32 {
        (0..32)
            .filter(|row| bdd.eval(f, |level| row >> level & 1 == 1))
            .fold(0, |table, row| table | 1 << row)
    }

    proptest! {
        #[test]
        fn operations_agree_with_truth_tables(a: u32, b: u32, c: u32) {
            let mut bdd = Bdd::default();
            let (f, g, h) = (build(&mut bdd, a), build(&mut bdd, b), build(&mut bdd, c));
            let ite = bdd.ite(f, g, h).unwrap();
            prop_assert_eq!(table(&bdd, ite), a & b | !a & c);
            let xor = bdd.xor(f, g).unwrap();
            prop_assert_eq!(table(&bdd, xor), a ^ b);
            let again = build(&mut bdd, a ^ b);
            prop_assert_eq!(xor, again);
            prop_assert_eq!(bdd.sat_count(f, &[0, 1, 2, 3, 4]), u128::from(a.count_ones()));
        }

        #[test]
        fn quantifiers_and_renaming_agree_with_truth_tables(a: u32, b: u32, mask in 0u32..32) {
            let mut bdd = Bdd::default();
            let (f, g) = (build(&mut bdd, a), build(&mut bdd, b));
            let cube = bdd.cube((0..5).filter(|level| mask >> level & 1 == 1)).unwrap();
            let product = bdd.and_exists(f, g, cube).unwrap();
            let expected = (0..32u32)
                .filter(|row| (0..32u32).any(|other| (row ^ other) & !mask == 0 && (a & b) >> other & 1 == 1))
                .fold(0, |table, row| table | 1 << row);
            prop_assert_eq!(table(&bdd, product), expected);
            // Reversing the variable order twice is the identity.
            let turned = bdd.rename(f, |level| 4 - level).unwrap();
            prop_assert_eq!(table(&bdd, turned), (0..32u32).filter(|row| a >> (row.reverse_bits() >> 27) & 1 == 1).fold(0, |t, row| t | 1 << row));
            prop_assert_eq!(bdd.rename(turned, |level| 4 - level).unwrap(), f);
            let composed = bdd.compose(f, 2, g).unwrap();
            let want = (0..32u32).filter(|row| {
                let value = b >> row & 1;
                a >> (row & !4 | value << 2) & 1 == 1
            }).fold(0, |t, row| t | 1 << row);
            prop_assert_eq!(table(&bdd, composed), want);
        }

        #[test]
        fn what_is_kept_stays_what_it_was(a: u32, b: u32, c: u32) {
            let mut bdd = Bdd::default();
            let (f, _, h) = (build(&mut bdd, a), build(&mut bdd, b), build(&mut bdd, c));
            let mut roots = [f, Ref::TRUE, h];
            bdd.keep(&mut roots);
            let [f, one, h] = roots;
            prop_assert_eq!((table(&bdd, f), one, table(&bdd, h)), (a, Ref::TRUE, c));
            // Unneeded nodes are gone, and the kept nodes are still found.
            let n_nodes = bdd.len();
            prop_assert!(n_nodes <= 2 + bdd.size(f) + bdd.size(h));
            let again = build(&mut bdd, a);
            prop_assert_eq!(again, f);
            let either = bdd.or(f, h).unwrap();
            prop_assert_eq!(table(&bdd, either), a | c);
        }
    }

    #[test]
    fn many_variables_need_no_stack() {
        let mut bdd = Bdd::default();
        let vars: Vec<Ref> = (0..50_000).map(|level| bdd.var(level).unwrap()).collect();
        let all = bdd.and_all(vars.iter().copied()).unwrap();
        assert_eq!(bdd.size(all), 50_000);
        let none = bdd.not(all).unwrap();
        assert_eq!(bdd.and(all, none).unwrap(), Ref::FALSE);
        let cube = bdd.cube(0..50_000).unwrap();
        assert_eq!(bdd.exists(all, cube).unwrap(), Ref::TRUE);
    }

    #[test]
    fn a_full_manager_says_so_and_stays_usable() {
        let mut bdd = Bdd::with_limit(8);
        let vars: Result<Vec<Ref>, Full> = (0..10).map(|level| bdd.var(level)).collect();
        assert_eq!(vars, Err(Full { of: LimitExceeded::Nodes, limit: 8 }));
        let a = bdd.var(0).unwrap();
        assert_eq!(bdd.and(a, Ref::TRUE), Ok(a));
    }

    #[test]
    fn work_is_limited_too() {
        let mut bdd = Bdd::default();
        let vars: Vec<Ref> = (0..100).map(|level| bdd.var(level).unwrap()).collect();
        bdd.limit_work(50);
        let all = bdd.and_all(vars.iter().copied());
        assert_eq!(all.map_err(|full| full.of), Err(LimitExceeded::Work));
        bdd.limit_work(10_000);
        let all = bdd.and_all(vars).unwrap();
        assert_eq!(bdd.size(all), 100);
    }
}
