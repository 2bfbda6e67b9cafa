//! The points of an episode, and the ways between them.

use indexmap::{IndexMap, IndexSet};

use super::{Event, Point};

/// The points of an episode.
pub(super) struct Ways {
    /// Each point with the one before it on a shortest way, and what happens between them.
    points: IndexMap<Point, Option<(usize, Event)>>,
    /// For each point that was followed, the next points, each with the number of reactions in between, 0 or 1.
    followers: Vec<Vec<(usize, usize)>>,
}

impl Ways {
    pub(super) fn new(first: Point) -> Self {
        Ways { points: [(first, None)].into_iter().collect(), followers: Vec::new() }
    }

    pub(super) fn point(&self, at: usize) -> Option<Point> {
        self.points.get_index(at).map(|(point, _)| point.clone())
    }

    pub(super) fn add(&mut self, at: usize, next: Vec<(Event, Point)>) {
        let mut followers = Vec::new();
        for (event, point) in next {
            let reactions = usize::from(matches!(event, Event::React { .. }));
            let entry = self.points.entry(point);
            followers.push((entry.index(), reactions));
            entry.or_insert(Some((at, event)));
        }
        self.followers.push(followers);
    }

    /// The events of a shortest way to a point, and then a last one.
    pub(super) fn trace(&self, mut at: usize, last: Option<Event>) -> Vec<Event> {
        let mut events: Vec<Event> = last.into_iter().collect();
        while let Some((_, Some((before, event)))) = self.points.get_index(at) {
            events.push(event.clone());
            at = *before;
        }
        events.reverse();
        events
    }

    /// The largest number of reactions on a way.
    ///
    /// # Errors
    /// The point of a cycle that was found first, if there is a cycle.
    pub(super) fn longest(&self) -> Result<usize, usize> {
        let mut open = vec![0_usize; self.followers.len()];
        self.followers.iter().flatten().for_each(|(to, _)| open[*to] += 1);
        let mut ready: Vec<usize> = (0..open.len()).filter(|at| open[*at] == 0).collect();
        let (mut reactions, mut most) = (vec![0; open.len()], 0);
        while let Some(at) = ready.pop() {
            most = most.max(reactions[at]);
            for (to, more) in &self.followers[at] {
                reactions[*to] = reactions[*to].max(reactions[at] + more);
                open[*to] -= 1;
                if open[*to] == 0 {
                    ready.push(*to);
                }
            }
        }
        let Some(first) = open.iter().position(|n| *n > 0) else { return Ok(most) };
        // Each point that is left has one of them before it, so the way back from any of them meets itself.
        let mut before = vec![first; open.len()];
        for at in (0..open.len()).filter(|at| open[*at] > 0) {
            self.followers[at].iter().for_each(|(to, _)| before[*to] = at);
        }
        let mut back = IndexSet::new();
        let mut at = first;
        while back.insert(at) {
            at = before[at];
        }
        Err(back.into_iter().skip_while(|point| *point != at).min().unwrap_or(first))
    }
}
