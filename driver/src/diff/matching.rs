//! Matches the parts of the old design with those of the new one.

use super::parts::{Ends, Kind, Part};
use grafsynth_frontend::graf::pieces::Word;
use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Old names and their new ones.
pub(super) type Renames = BTreeMap<String, String>;

/// Pairs of parts that represent the same object.
pub(super) struct Matching {
    /// For each old part, the index of the matched new part.
    pub(super) new_of: Vec<Option<usize>>,
    /// For each new part, the index of the matched old part.
    pub(super) old_of: Vec<Option<usize>>,
}

/// The maximum number of name pairs that are tried as a renaming; each try matches both designs again.
const RENAMES_TRIED: usize = 64;

/// The parts by parent and kind, each list in the order of the source.
type Children = BTreeMap<(Option<usize>, Kind), Vec<usize>>;

/// Matches the parts of two designs, and finds the names that were changed everywhere.
pub(super) fn matching(old: &[Part<'_>], new: &[Part<'_>]) -> (Matching, Renames) {
    let mut renames = Renames::new();
    let mut best = Matcher::new(old, new, &renames).run();
    let mut tried = BTreeSet::new();
    'again: loop {
        let cost = n_changed(old, new, &best, &renames);
        for (from, to) in candidates(old, new, &best, &renames) {
            let pair = (from, to);
            if tried.contains(&pair) {
                continue;
            }
            if tried.len() >= RENAMES_TRIED {
                break;
            }
            tried.insert(pair);
            let mut more = renames.clone();
            if let (Some(from), Some(to)) = (old[from].key, new[to].key) {
                more.insert(from.to_owned(), to.to_owned());
            }
            let next = Matcher::new(old, new, &more).run();
            // The pair itself saves two changes. It is a renaming if other parts then agree too, or if no other part uses the name and the part is in the same
            // place.
            let saved = cost.saturating_sub(n_changed(old, new, &next, &more));
            if saved > 2 || (saved == 2 && is_in_place(old, new, &next, from, to)) {
                renames = more;
                best = next;
                continue 'again;
            }
        }
        return (best, renames);
    }
}

/// The words after renaming.
pub(super) fn renamed(words: &[Word], renames: &Renames) -> Vec<Word> {
    words
        .iter()
        .map(|word| match word {
            Word::Name(name) => Word::Name(new_name(name, renames).to_owned()),
            Word::Sign(_) => word.clone(),
        })
        .collect()
}

/// True if a part has the same text after renaming.
pub(super) fn is_same(old: &Part<'_>, new: &Part<'_>, renames: &Renames) -> bool {
    old.words.len() == new.words.len()
        && old.words.iter().zip(&new.words).all(|(old, new)| match (old, new) {
            (Word::Name(old), Word::Name(new)) => new_name(old, renames) == new,
            _ => old == new,
        })
}

fn new_name<'n>(name: &'n str, renames: &'n Renames) -> &'n str {
    renames.get(name).map_or(name, String::as_str)
}

/// The number of parts that only one design has or whose text differs.
fn n_changed(old: &[Part<'_>], new: &[Part<'_>], matching: &Matching, renames: &Renames) -> usize {
    let only_new = matching.old_of.iter().filter(|one| one.is_none()).count();
    let gone_or_changed = old
        .iter()
        .zip(&matching.new_of)
        .filter(|(part, other)| other.is_none_or(|other| !is_same(part, &new[other], renames)));
    only_new + gone_or_changed.count()
}

/// Pairs of an unmatched old part and an unmatched new part that differ only in a name that no other part has.
fn candidates(
    old: &[Part<'_>],
    new: &[Part<'_>],
    matching: &Matching,
    renames: &Renames,
) -> Vec<(usize, usize)> {
    let (old_names, new_names) = (names(old), names(new));
    let is_alone = |names: &BTreeMap<&str, usize>, other: &BTreeMap<&str, usize>, key: &str| {
        names.get(key) == Some(&1) && !other.contains_key(key)
    };
    let mut added: BTreeMap<(Option<usize>, Kind), Vec<usize>> = BTreeMap::new();
    for (at, part) in new.iter().enumerate() {
        if matching.old_of[at].is_none()
            && part.key.is_some_and(|key| is_alone(&new_names, &old_names, key))
        {
            added.entry((part.parent, part.kind)).or_default().push(at);
        }
    }
    let mut pairs = Vec::new();
    for (at, part) in old.iter().enumerate() {
        let Some(key) = part.key else { continue };
        let parent = part.parent.map(|parent| matching.new_of[parent]);
        // If the new design lacks the parent, its parts were removed with it.
        if matching.new_of[at].is_some()
            || parent == Some(None)
            || !is_alone(&old_names, &new_names, key)
            || matches!(part.kind, Kind::Setting | Kind::Import | Kind::Transition | Kind::Property)
        {
            continue;
        }
        for &other in added.get(&(parent.flatten(), part.kind)).into_iter().flatten() {
            let mut more = renames.clone();
            if let Some(to) = new[other].key {
                more.insert(key.to_owned(), to.to_owned());
            }
            if is_same(part, &new[other], &more) {
                pairs.push((at, other));
            }
        }
    }
    pairs
}

fn names<'p>(parts: &[Part<'p>]) -> BTreeMap<&'p str, usize> {
    let mut names = BTreeMap::new();
    for key in parts.iter().filter_map(|part| part.key) {
        *names.entry(key).or_insert(0) += 1;
    }
    names
}

/// True if no other part names the old or the new part, and the preceding parts of their kind are the same.
fn is_in_place(
    old: &[Part<'_>],
    new: &[Part<'_>],
    matching: &Matching,
    from: usize,
    to: usize,
) -> bool {
    let is_named = |parts: &[Part<'_>], at: usize| {
        parts.iter().enumerate().any(|(other, part)| {
            let is_key =
                |word: &Word| matches!(word, Word::Name(name) if Some(name.as_str()) == parts[at].key);
            other != at && part.words.iter().any(is_key)
        })
    };
    let before = |parts: &[Part<'_>], at: usize| {
        let part = &parts[at];
        parts[..at].iter().rposition(|one| one.kind == part.kind && one.parent == part.parent)
    };
    let is_behind_same = match (before(old, from), before(new, to)) {
        (None, None) => true,
        (Some(old), Some(new)) => matching.new_of[old] == Some(new),
        _ => false,
    };
    is_behind_same && !is_named(old, from) && !is_named(new, to)
}

struct Matcher<'p, 'd> {
    old: &'p [Part<'d>],
    new: &'p [Part<'d>],
    renames: &'p Renames,
    matching: Matching,
}

impl<'p, 'd> Matcher<'p, 'd> {
    fn new(old: &'p [Part<'d>], new: &'p [Part<'d>], renames: &'p Renames) -> Self {
        let matching = Matching { new_of: vec![None; old.len()], old_of: vec![None; new.len()] };
        Matcher { old, new, renames, matching }
    }

    /// Matches all parts, from the outermost inwards: only parts with matched parents can be the same object.
    fn run(mut self) -> Matching {
        let (old, new) = (children(self.old), children(self.new));
        let kinds: BTreeSet<Kind> = self.old.iter().map(|part| part.kind).gather();
        let mut open = VecDeque::from([(None, None)]);
        while let Some((old_parent, new_parent)) = open.pop_front() {
            for &kind in &kinds {
                let (Some(ours), Some(theirs)) =
                    (old.get(&(old_parent, kind)), new.get(&(new_parent, kind)))
                else {
                    continue;
                };
                self.group(kind, ours, theirs);
                for &at in ours {
                    if let Some(other) = self.matching.new_of[at] {
                        open.push_back((Some(at), Some(other)));
                    }
                }
            }
        }
        self.matching
    }

    /// Matches the parts of one kind in one parent, the most certain pairs first.
    fn group(&mut self, kind: Kind, old: &[usize], new: &[usize]) {
        let (before, after, renames) = (self.old, self.new, self.renames);
        if kind == Kind::Transition {
            return self.transitions(old, new);
        }
        self.pair(old, new, false, |at| old_key(&before[at], renames), |at| new_key(&after[at]));
        // Parts without a name are matched by their text. For some kinds, the only parts left on both sides are matched too.
        let unnamed = |part: &Part<'_>| part.key.is_none();
        self.pair(
            old,
            new,
            false,
            |at| unnamed(&before[at]).then(|| renamed(&before[at].words, renames)),
            |at| unnamed(&after[at]).then(|| after[at].words.clone()),
        );
        if matches!(
            kind,
            Kind::Chart | Kind::Property | Kind::Emergency | Kind::Place | Kind::Board
        ) {
            self.pair(old, new, true, |_| Some(()), |_| Some(()));
        }
    }

    fn transitions(&mut self, old: &[usize], new: &[usize]) {
        let (before, after, renames) = (self.old, self.new, self.renames);
        let steps_of = |parts: &[Part<'_>]| -> BTreeSet<String> {
            let steps = parts.iter().filter(|part| part.kind == Kind::Step);
            steps.filter_map(|part| part.key).map(str::to_owned).gather()
        };
        let (old_steps, new_steps) = (
            steps_of(before).iter().map(|name| new_name(name, renames).to_owned()).gather(),
            steps_of(after),
        );
        let are_in = |sources: &[Vec<String>], steps: &BTreeSet<String>| {
            sources.iter().filter_map(|path| path.last()).all(|name| steps.contains(name))
        };
        let ours: BTreeMap<usize, Ends> = old
            .iter()
            .filter_map(|&at| {
                let ends = before[at].ends.as_ref()?;
                let paths = |paths: &[Vec<String>]| -> Vec<Vec<String>> {
                    let path = |path: &Vec<String>| {
                        path.iter().map(|name| new_name(name, renames).to_owned()).collect()
                    };
                    paths.iter().map(path).collect()
                };
                let ends = Ends {
                    sources: paths(&ends.sources),
                    targets: paths(&ends.targets),
                    says: renamed(&ends.says, renames),
                };
                Some((at, ends))
            })
            .gather();
        let our = |at: usize| ours.get(&at);
        let their = |at: usize| after[at].ends.as_ref();
        self.pair(
            old,
            new,
            false,
            |at| Some(renamed(&before[at].words, renames)),
            |at| Some(after[at].words.clone()),
        );
        self.pair(old, new, false, |at| old_key(&before[at], renames), |at| new_key(&after[at]));
        let ends = |ends: &Ends| (ends.sources.clone(), ends.targets.clone());
        self.pair(old, new, false, |at| our(at).map(ends), |at| their(at).map(ends));
        let from = |ends: &Ends| (ends.sources.clone(), ends.says.clone());
        self.pair(old, new, false, |at| our(at).map(from), |at| their(at).map(from));
        // A transition may also have moved from another step, but only if both designs have both steps: otherwise the transition was added
        // or removed with its step.
        let to = |ends: &Ends, steps: &BTreeSet<String>| {
            are_in(&ends.sources, steps).then(|| (ends.targets.clone(), ends.says.clone()))
        };
        self.pair(
            old,
            new,
            false,
            |at| our(at).and_then(|ends| to(ends, &new_steps)),
            |at| their(at).and_then(|ends| to(ends, &old_steps)),
        );
        // Each of the two is the only transition left for its step.
        self.pair(
            old,
            new,
            true,
            |at| our(at).map(|ends| ends.sources.clone()),
            |at| their(at).map(|ends| ends.sources.clone()),
        );
    }

    /// Matches parts with the same key, in order; with `only_single`, only if each is the only one on its side.
    fn pair<K: Ord>(
        &mut self,
        old: &[usize],
        new: &[usize],
        only_single: bool,
        old_key: impl Fn(usize) -> Option<K>,
        new_key: impl Fn(usize) -> Option<K>,
    ) {
        let mut groups: BTreeMap<K, (Vec<usize>, Vec<usize>)> = BTreeMap::new();
        for &at in old.iter().filter(|&&at| self.matching.new_of[at].is_none()) {
            if let Some(key) = old_key(at) {
                groups.entry(key).or_default().0.push(at);
            }
        }
        if groups.is_empty() {
            return;
        }
        for &at in new.iter().filter(|&&at| self.matching.old_of[at].is_none()) {
            if let Some(group) = new_key(at).and_then(|key| groups.get_mut(&key)) {
                group.1.push(at);
            }
        }
        for (ours, theirs) in groups.into_values() {
            if only_single && (ours.len() != 1 || theirs.len() != 1) {
                continue;
            }
            for (ours, theirs) in ours.into_iter().zip(theirs) {
                self.matching.new_of[ours] = Some(theirs);
                self.matching.old_of[theirs] = Some(ours);
            }
        }
    }
}

fn old_key(part: &Part<'_>, renames: &Renames) -> Option<String> {
    part.key.map(|key| new_name(key, renames).to_owned())
}

fn new_key(part: &Part<'_>) -> Option<String> {
    part.key.map(str::to_owned)
}

fn children(parts: &[Part<'_>]) -> Children {
    let mut children = Children::new();
    for (at, part) in parts.iter().enumerate() {
        children.entry((part.parent, part.kind)).or_default().push(at);
    }
    children
}
