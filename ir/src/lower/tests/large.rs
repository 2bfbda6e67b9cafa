//! Tests of the running time on large inputs.

use super::build::*;
use crate::lower::lower;

/// 100 000 steps and as many transitions, one in ten with an `otherwise`. Measured by hand: `cargo test --release lower::tests::large -- --nocapture`.
#[test]
fn a_large_chart_is_lowered() {
    let n = if cfg!(debug_assertions) { 2_000 } else { 100_000 };
    let mut items = vec![];
    for index in 0..n {
        let text = format!("s{index}");
        let body = vec![action(&format!("o{}", index % 100))];
        items.push(if index == 0 { initial(&text, body) } else { step(&text, body) });
    }
    for index in 0..n {
        let to = format!("s{index} -> s{}", (index + 1) % n);
        items.push(go(&to, and(vec![v("a"), not(v("b"))])));
        if index % 10 == 0 {
            items.push(go(&to, v("otherwise")));
        }
    }
    let outputs = (0..100).map(|index| output(&format!("o{index}"))).collect();
    let design = design(vec![chart("c", vec![vec![single()], inputs("a b"), outputs, items])]);
    let (net, found) = lower(&design);
    assert_eq!(told(&found), Vec::<String>::new());
    assert_eq!(net.unwrap().steps.len(), n);
}

/// Many unknown names must not each cause a search for similar names.
#[test]
fn many_mistakes_cost_little() {
    let n = if cfg!(debug_assertions) { 500 } else { 50_000 };
    let mut items = vec![initial("p", vec![])];
    for index in 0..n {
        items.push(step(&format!("step_{index}"), vec![]));
        items.push(go("p -> p", v(&format!("stop_{index}"))));
    }
    let (net, found) = lower(&design(vec![chart("c", vec![items])]));
    assert!(net.is_none());
    assert_eq!(found.len(), n);
}
