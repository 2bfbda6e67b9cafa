//! Sets of steps.

use grafsynth_ir::net::StepId;

/// A set of steps, one bit each; as the set of active steps, a *situation* (semantics §2).
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Situation {
    words: Vec<u64>,
}

impl Situation {
    /// The empty set over `n_steps` steps.
    #[must_use]
    pub fn empty(n_steps: usize) -> Self {
        Situation { words: vec![0; n_steps.div_ceil(64)] }
    }

    /// True if the step is in the set.
    #[must_use]
    pub fn contains(&self, step: StepId) -> bool {
        self.words.get(step.index() / 64).is_some_and(|word| word >> (step.index() % 64) & 1 == 1)
    }

    /// Adds the step.
    pub fn insert(&mut self, step: StepId) {
        self.words[step.index() / 64] |= 1 << (step.index() % 64);
    }

    /// Removes the step.
    pub fn remove(&mut self, step: StepId) {
        self.words[step.index() / 64] &= !(1 << (step.index() % 64));
    }

    /// Adds or removes the step.
    pub fn set(&mut self, step: StepId, is_in: bool) {
        if is_in { self.insert(step) } else { self.remove(step) }
    }

    /// Removes all steps.
    pub fn clear(&mut self) {
        self.words.fill(0);
    }

    /// Copies `other` without a new allocation.
    pub fn copy_from(&mut self, other: &Situation) {
        self.words.clone_from(&other.words);
    }

    /// True if the set is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|word| *word == 0)
    }

    /// The number of steps in the set.
    #[must_use]
    pub fn len(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The steps in declaration order.
    pub fn iter(&self) -> impl Iterator<Item = StepId> + '_ {
        self.words.iter().enumerate().flat_map(|(index, word)| bits(index, *word))
    }

    /// The steps that are in this set and not in `other`, in declaration order.
    pub fn without<'s>(&'s self, other: &'s Situation) -> impl Iterator<Item = StepId> + 's {
        self.words
            .iter()
            .zip(&other.words)
            .enumerate()
            .flat_map(|(index, (mine, theirs))| bits(index, mine & !theirs))
    }

    /// The bits, 64 steps per word, the first step lowest.
    #[must_use]
    pub fn words(&self) -> &[u64] {
        &self.words
    }
}

fn bits(index: usize, mut word: u64) -> impl Iterator<Item = StepId> {
    std::iter::from_fn(move || {
        if word == 0 {
            return None;
        }
        let bit = word.trailing_zeros() as usize;
        word &= word - 1;
        Some(StepId::from_index(index * 64 + bit))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_come_out_in_declaration_order() {
        let mut set = Situation::empty(130);
        for index in [129, 0, 64, 63] {
            set.insert(StepId::from_index(index));
        }
        let mut other = Situation::empty(130);
        other.insert(StepId::from_index(64));
        assert_eq!(set.iter().map(StepId::index).collect::<Vec<_>>(), [0, 63, 64, 129]);
        assert_eq!(set.without(&other).map(StepId::index).collect::<Vec<_>>(), [0, 63, 129]);
        set.remove(StepId::from_index(0));
        assert!(!set.contains(StepId::from_index(0)) && set.len() == 3);
    }
}
