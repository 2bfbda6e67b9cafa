//! Tests of states: equal states behave the same, and a changed net restores the parts that it
//! still has.

use super::{TRUCK, net};
use crate::{InputRow, Simulator};

#[test]
fn a_changed_net_takes_over_by_name() {
    let old = net(
        "policy priority-age",
        "input i bool
         var n int 0..200 = 0
         var gone int 0..9 = 4
         edge %0 = i
         step a in g initial
         step b in g
             entry { n := 150 }
         step c in g
         transition t1 in g a -> b when rise(%0)
         transition t2 in g a -> c when rise(%0)
         transition t3 in g b -> a when b.t >= 9",
    );
    let new = net(
        "policy priority-age",
        "input i bool
         var n int 0..99 = 0
         var fresh int 0..9 = 7
         edge %0 = i
         step a in g initial
         step between in g
         step b in g
         step c in g
         transition t1 in g a -> c when rise(%0)
         transition t2 in g a -> b when rise(%0)
         transition t3 in g b -> between when b.t >= 20
         transition t4 in g between -> a",
    );
    let input = old.inputs.ids().next().unwrap();
    let mut before = Simulator::new(&old);
    before.step(&InputRow::zero(&old).with(input, 1));
    before.step(&InputRow { dt: 5, ..InputRow::zero(&old) });
    let mut after = Simulator::new(&new);
    let report = after.restore(&before.save()).unwrap();
    assert_eq!(report.cut, ["var n"]);
    assert_eq!(report.new, ["step between", "var fresh"]);
    assert_eq!(report.lost, ["var gone"]);
    assert!(
        report.kept.contains(&"time of b".to_owned())
            && report.kept.contains(&"edge of i".to_owned())
    );
    let active: Vec<&str> =
        after.row().steps.iter().map(|step| new.steps[*step].name.text.as_str()).collect();
    assert_eq!(active, ["b"]);
    // The order of activation is restored too: b is the younger branch, so c is next.
    after.step(&InputRow { dt: 15, ..InputRow::zero(&new) });
    after.step(&InputRow::zero(&new));
    after.step(&InputRow::zero(&new).with(input, 1));
    let active: Vec<&str> =
        after.row().steps.iter().map(|step| new.steps[*step].name.text.as_str()).collect();
    assert_eq!(active, ["c"]);
}

#[test]
fn text_that_is_no_state_is_refused() {
    let truck = net("", TRUCK);
    let mut simulator = Simulator::new(&truck);
    let message = |simulator: &mut Simulator<'_>, text: &str| {
        simulator.restore(text).unwrap_err()[0].message.clone()
    };
    assert!(message(&mut simulator, "nonsense").starts_with("the saved state cannot be read: "));
    let other = simulator.save().replace("state 1", "state 99");
    assert_eq!(
        message(&mut simulator, &other),
        "the saved state has format `grafsynth state 99`, but this version reads `grafsynth state 1`"
    );
}

#[test]
fn the_truck_has_four_states() {
    let truck = net("policy priority-age", TRUCK);
    let mut simulator = Simulator::new(&truck);
    let mut seen = std::collections::BTreeSet::from([simulator.state().clone()]);
    let mut todo = vec![simulator.state().clone()];
    while let Some(state) = todo.pop() {
        for bits in 0..16 {
            let values = (0..4).map(|bit| bits >> bit & 1).collect();
            simulator.set_state(&state);
            simulator.step(&InputRow { dt: 1, values });
            if seen.insert(simulator.state().clone()) {
                todo.push(simulator.state().clone());
            }
        }
    }
    assert_eq!(seen.len(), 4);
}
