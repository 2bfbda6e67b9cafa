//! Tests of the choices of semantics §12, with the charts and traces printed there (as far as they concern nets; C1, C8, C14, C18 and C25 concern the
//! lowering).

use super::{check, net};

#[test]
fn c2_fault_tells_about_its_own_row() {
    check(
        &net(
            "evolution stable limit 3",
            "step a in g initial
             step b in g
             transition t1 in g a -> b
             transition t2 in g b -> a",
        ),
        "dt\n1\n1\n",
        "steps,fault\na,0\nb,1\na,1",
    );
}

#[test]
fn c4_sources_inside_an_enclosure() {
    check(
        &net(
            "",
            "part g level 1
             part h level 2
             input i bool
             input j bool
             step o in g initial
             step e in g enclosing
             step x in h parent e
             transition t in h -> x when i
             transition u in g o -> e when j",
        ),
        "i,j\n1,0\n0,1\n1,0\n",
        "steps\no\no\ne\ne x",
    );
}

#[test]
fn c5_restart_belongs_to_the_transition_that_adds() {
    let body = |restart: &str| {
        format!(
            "var n int 0..9 = 0
             step a in g initial
                 entry {{ n := n + 1 }}
             step c in g
             step b in g initial
             transition t1 in g a -> c
             transition t2 in g b -> a {restart}"
        )
    };
    check(&net("", &body("restart")), "dt\n1\n1\n", "steps,n\na b,1\na c,2\nc,2");
    check(&net("", &body("")), "dt\n1\n", "steps,n\na b,1\na c,1");
}

#[test]
fn c7_a_reaction_ends_the_input_edge() {
    check(
        &net(
            "evolution stable limit 9",
            "input a bool
             input E bool event
             edge %0 = a
             var n int 0..9 = 0
             step s in g initial
             step r in g
             transition on_E in g reaction s -> on (E)
                 do { n := n + 1 }
             transition t in g s -> r when rise(%0) and n >= 1",
        ),
        "a,E\n1,1\n1,0\n",
        "steps,n,fault\ns,0,0\ns,1,0\ns,1,0",
    );
}

#[test]
fn c9_edges_in_lists_are_those_of_the_check() {
    check(
        &net(
            "evolution stable limit 9",
            "input a bool
             edge %0 = a
             var n int 0..9 = 0
             step s in g initial
             step r in g
                 entry { if rise(%0) { n := 1 } }
             transition t in g s -> r when a",
        ),
        "a\n1\n",
        "steps,n,fault\ns,0,0\nr,1,0",
    );
}

#[test]
fn c13_all_q_before_any_body() {
    check(
        &net(
            "",
            "var v bool = 0
             output A bool controlled A
             output B bool controlled B
             action A duration 0
                 use s N
                 body { v := true }
             action B duration 0
                 use s N if v
             step s in g initial",
        ),
        "dt\n1\n",
        "steps,A,B,v\ns,1,0,1\ns,1,1,1",
    );
}

#[test]
fn c15_operands_are_compared_whether_used_or_not() {
    check(
        &net(
            "",
            "input a bool
             edge %0 = a
             step s in g initial
             step r in g
             step u in g
             transition t1 in g s -> r when a
             transition t2 in g r -> u when rise(%0)",
        ),
        "a\n1\n1\n0\n1\n",
        "steps\ns\nr\nr\nr\nu",
    );
}

#[test]
fn c16_a_loser_blocks_nobody() {
    check(
        &net(
            "policy priority",
            "step p in g initial
             step q in g initial
             step x in g
             step y in g
             step z in g
             transition t1 in g p -> x priority 1
             transition t2 in g p, q -> y priority 2
             transition t3 in g q -> z priority 3",
        ),
        "dt\n1\n",
        "steps\np q\nx z",
    );
}

#[test]
fn c20_the_row_in_which_a_chart_ends() {
    check(
        &net(
            "policy inner-first\nevolution stable limit 3",
            "part g level 1
                 enter (s)
             input E bool event
             output R bool continuous
                 emit f
             step s in g
             step f in g final
             transition t in g s -> f clears (s, f) restart on (E)",
        ),
        "E\n1\n1\n",
        "steps,R,fault\ns,0,0\nf,1,0\nf,1,0",
    );
}

#[test]
fn c21_due_sends_join_by_due_time() {
    check(
        &net(
            "policy inner-first\nevolution stable limit 3\nqueue 2",
            "part g level 1
                 enter (s)
             input A bool event
             input B bool event
             slot a sends A after 3
             slot b sends B after 2
             step s in g
                 entry { send a; send b }
             step x in g
             step y in g
             transition t1 in g s -> x clears (s, x, y) restart on (A)
             transition t2 in g s -> y clears (s, x, y) restart on (B)",
        ),
        "dt,A,B\n5,0,0\n",
        "steps,fault\ns,0\ny,0",
    );
}

#[test]
fn c22_one_continuous_call_a_reaction() {
    check(
        &net(
            "",
            "output speed bool extern
                 param int 0..9
                 call a (3)
                 call b (5)
             step a in g initial
             step b in g initial",
        ),
        "dt\n1\n",
        "steps,speed\na b,3\na b,3",
    );
}

#[test]
fn c23_on_and_off_delay_count_from_the_ends_of_reactions() {
    check(
        &net(
            "",
            "input a bool
             timer T_E while a
             timer U expired while not (a and T_E >= 1)
             output R bool continuous
                 emit s if a and T_E >= 1 or U < 2
             step s in g initial",
        ),
        "a\n1\n1\n0\n0\n0\n",
        "steps,R\ns,0\ns,0\ns,1\ns,1\ns,1\ns,0",
    );
}

#[test]
fn c24_links_restart_what_they_activate() {
    check(
        &net(
            "",
            "part g level 1
             part h level 2
             input i bool
             var n int 0..9 = 0
             step e in g initial enclosing
             step a in h parent e link
                 entry { n := n + 1 }
             transition t in g e -> e restart when i",
        ),
        "i\n1\n",
        "steps,n\ne a,1\ne a,2",
    );
}
