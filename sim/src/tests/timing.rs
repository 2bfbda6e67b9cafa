//! Tests of semantics §3.1, §3.5 and §7: time and qualified actions.

use super::{check, net};

/// §3.1, §7: a step has time 0 in the row that activates it; `dt` counts from the next row on.
#[test]
fn times_of_steps() {
    let chart = net(
        "",
        "output early bool continuous
             emit b if b.t < 2
         output kept bool continuous
             emit a if b.T = 3
         step a in g initial
         step b in g
         transition t1 in g a -> b when a.t >= 1
         transition t2 in g b -> a when b.t >= 3",
    );
    check(
        &chart,
        "dt\n1\n1\n0\n1\n5\n1\n0\n",
        "steps,early,kept
         a,0,0
         b,1,0
         b,1,0
         b,1,0
         b,0,0
         a,0,0
         b,1,0
         b,1,0",
    );
    check(
        &chart,
        "dt\n1\n1\n1\n1\n0\n",
        "steps,early,kept
         a,0,0
         b,1,0
         b,1,0
         b,0,0
         a,0,1
         a,0,1",
    );
}

/// §7: a free timer is 0 in the row in which its condition becomes true.
#[test]
fn free_timers() {
    check(
        &net(
            "",
            "input i bool
             timer T while i
             output two bool continuous
                 emit a if T >= 2
             step a in g initial",
        ),
        "dt,i\n5,1\n1,1\n1,1\n1,0\n1,1\n",
        "steps,two
         a,0
         a,0
         a,0
         a,1
         a,0
         a,0",
    );
}

/// Checks a qualifier with a fixed history of its step: active in rows 1 to 4.
fn qualifier(name: &str, duration: u32, expected: &str) {
    let chart = net(
        "",
        &format!(
            "input i bool
             output q bool controlled q
             action q duration {duration}
                 use b {name}
             step a in g initial
             step b in g
             transition t1 in g a -> b when i
             transition t2 in g b -> a when not i"
        ),
    );
    let rows: String = std::iter::once("a,0".to_owned())
        .chain(
            expected
                .chars()
                .enumerate()
                .map(|(row, q)| format!("{},{q}", if row < 4 { "b" } else { "a" })),
        )
        .map(|row| row + "\n")
        .collect();
    check(&chart, "i\n1\n1\n1\n1\n0\n0\n0\n", &format!("steps,q\n{rows}"));
}

/// §3.5: the timing of each qualifier. The step is active in rows 1 to 4 of 7.
#[test]
fn qualifiers() {
    qualifier("N", 0, "1111000");
    qualifier("S", 0, "1111111");
    qualifier("R", 0, "0000000");
    qualifier("P", 0, "1000000");
    qualifier("P1", 0, "1000000");
    qualifier("P0", 0, "0000100");
    qualifier("L", 2, "1100000");
    qualifier("D", 2, "0011000");
    qualifier("SD", 2, "0011111");
    qualifier("SD", 5, "0000011");
    qualifier("DS", 2, "0011111");
    qualifier("DS", 5, "0000000");
    qualifier("SL", 2, "1100000");
    qualifier("SL", 6, "1111110");
    // [C12]: durations of 0.
    qualifier("D", 0, "1111000");
    qualifier("SD", 0, "1111111");
    qualifier("L", 0, "0000000");
    qualifier("SL", 0, "0000000");
}

/// §3.5: inputs are the OR over all steps, so two consecutive steps with P give one pulse; R dominates.
#[test]
fn shared_actions() {
    check(
        &net(
            "",
            "output p bool controlled p
             output s bool controlled s
             action p duration 0
                 use a P
                 use b P
             action s duration 0
                 use a S
                 use b S
                 use b R
             step a in g initial
             step b in g
             step c in g
             transition t1 in g a -> b
             transition t2 in g b -> c
             transition t3 in g c -> a",
        ),
        "dt\n1\n1\n1\n",
        "steps,p,s
         a,1,1
         b,0,0
         c,0,0
         a,1,1",
    );
}

/// §3.5 [C13]: bodies of actions whose Q has become false run first and once more; the others run while Q is true.
#[test]
fn bodies_and_final_scan() {
    let body = "var n int 0..9999999 = 0
         action first duration 0
             use b N
             body { n := n * 10 + 1 }
         action second duration 0
             use a N
             body { if second.q { n := n * 10 + 2 } else { n := n * 10 + 3 } }
         step a in g initial
         step b in g
         transition t1 in g a -> b
         transition t2 in g b -> a";
    check(&net("", body), "dt\n1\n1\n", "steps,n\na,2\nb,21\na,212");
    check(&net("final scan", body), "dt\n1\n1\n", "steps,n\na,2\nb,231\na,23112");
}

/// §3.5: a condition belongs to one use of the action; a transition reads Q of the last row [C14].
#[test]
fn conditions_of_uses_and_q_in_receptivities() {
    check(
        &net(
            "",
            "input i bool
             output q bool controlled q
             action q duration 0
                 use a N if i
             step a in g initial
             step b in g
             transition t in g a -> b when q.q",
        ),
        "i\n0\n1\n0\n0\n",
        "steps,q
         a,0
         a,0
         a,1
         b,0
         b,0",
    );
}
