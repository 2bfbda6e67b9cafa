//! Tests whether cubes cover the whole space.

use super::Trit;

/// Whether the cubes cover every point; `None` if `budget` is exhausted first.
///
/// Splits at the input that the most cubes depend on.
#[must_use]
pub fn covers_all(cubes: &[&[Trit]], budget: &mut u64) -> Option<bool> {
    let n_inputs = cubes.first().map_or(0, |cube| cube.len());
    let mut open: Vec<Vec<Vec<Trit>>> = vec![cubes.iter().map(|cube| cube.to_vec()).collect()];
    while let Some(cubes) = open.pop() {
        *budget = budget.checked_sub(cubes.len() as u64 + 1)?;
        if cubes.iter().any(|cube| cube.iter().all(|trit| *trit == Trit::Any)) {
            continue;
        }
        let mentions = |input: usize| cubes.iter().filter(|cube| cube[input] != Trit::Any).count();
        let Some(split) = (0..n_inputs).max_by_key(|input| mentions(*input)) else {
            return Some(false);
        };
        if mentions(split) == 0 {
            return Some(false);
        }
        for value in [Trit::Low, Trit::High] {
            let half = cubes
                .iter()
                .filter(|cube| cube[split] == Trit::Any || cube[split] == value)
                .map(|cube| {
                    let mut cube = cube.clone();
                    cube[split] = Trit::Any;
                    cube
                })
                .collect();
            open.push(half);
        }
    }
    Some(true)
}
