//! Tests of semantics §4 and §5 on statecharts.

use super::{check, net};
use crate::{InputRow, Noticed, Simulator};

const SETTINGS: &str = "policy inner-first\nevolution stable limit 9\nqueue 4";

/// §5: eventless transitions first, then internal events, then external ones in declaration order.
#[test]
fn macro_steps() {
    check(
        &net(
            SETTINGS,
            "part g level 1
                 enter (a)
             input e bool event
             input f bool event
             input r bool internal
             var s int 0..99999 = 0
             step a in g
             step b in g
             step c in g
             step d in g
             transition t1 in g a -> b clears (a, b, c, d) restart on (f)
                 do { raise r; s := s * 10 + 1 }
             transition t2 in g b -> c clears (a, b, c, d) restart when s > 0
                 do { s := s * 10 + 2 }
             transition t3 in g c -> d clears (a, b, c, d) restart on (r)
                 do { s := s * 10 + 3 }
             transition t4 in g d -> a clears (a, b, c, d) restart on (e)
                 do { s := s * 10 + 4 }",
        ),
        "e,f\n1,1\n0,0\n1,0\n",
        "steps,s,fault
         a,0,0
         d,123,0
         d,123,0
         a,1234,0",
    );
}

const NESTED: &str = "part g level 1
         enter (p, content p, a)
     input e bool event
     input f bool event
     var s int 0..9999999 = 0
     step p in g composite
         entry { s := s * 10 + 1 }
         exit { s := s * 10 + 2 }
         content { s := s * 10 + 3 }
     step a in g parent p
         entry { s := s * 10 + 4 }
         exit { s := s * 10 + 5 }
     step b in g parent p
     step q in g
     transition outer in g p -> q clears (p, a, b, q) restart on (e)
         do { s := s * 10 + 8 }
     transition inner in g a -> b clears (a, b) restart on (e)
         do { s := s * 10 + 9 }
     transition back in g q -> p, content p, a clears (p, a, b, q) restart on (f)
         do { s := 0 }";

/// §4: the innermost source wins, or the outermost; exits run from the inside out, entries from the outside in.
#[test]
fn inner_and_outer() {
    check(
        &net(SETTINGS, NESTED),
        "e,f\n1,0\n1,0\n0,1\n",
        "steps,s,fault
         a,134,0
         b,13459,0
         q,1345928,0
         a,134,0",
    );
    check(
        &net(&SETTINGS.replace("inner", "outer"), NESTED),
        "e,f\n1,0\n0,1\n",
        "steps,s,fault
         a,134,0
         q,134528,0
         a,134,0",
    );
}

const REGIONS: &str = "part g level 1
         enter (p, r1, a1, r2, a2)
     input e bool event
     input f bool event
     input x bool event
     input d1 bool internal
     input dp bool internal
     step p in g parallel done dp
     step r1 in g composite parent p done d1
     step a1 in g parent r1
     step z1 in g final parent r1
     step r2 in g composite parent p
     step a2 in g parent r2
     step z2 in g final parent r2
     step q in g
     var n int 0..999 = 0
     transition t1 in g a1 -> z1 clears (a1, z1) restart on (e)
     transition t2 in g a2 -> z2 clears (a2, z2) restart on (f)
     transition t3 in g p -> q clears (p, r1, a1, z1, r2, a2, z2, q) restart on (dp)
         do { n := n * 10 + 2 }
     transition t4 in g reaction p -> on (d1)
         do { n := n * 10 + 1 }
     transition t5 in g a2 -> q clears (p, r1, a1, z1, r2, a2, z2, q) restart on (e, x)
         do { n := n * 10 + 3 }";

/// §5: done events of a region and of the parallel state; §4: transitions whose exit sets intersect exclude each other, and the first one taken wins.
#[test]
fn parallel_regions() {
    check(
        &net(SETTINGS, REGIONS),
        "e,f,x\n0,1,0\n1,0,0\n",
        "steps,n,fault
         a1 a2,0,0
         a1 z2,0,0
         q,12,0",
    );
    // t1 is taken first. The exit set of t5 intersects that of t1, and the source of t5 is not a descendant of the source of t1, so t5 is dropped.
    check(
        &net(SETTINGS, REGIONS),
        "e,f,x\n1,0,0\n0,0,1\n",
        "steps,n,fault\na1 a2,0,0\nz1 a2,1,0\nq,13,0",
    );
}

const HISTORY: &str = "part g level 1
         enter (p, a)
     input e bool event
     input f bool event
     input x bool event
     var n int 0..9999 = 0
     step p in g composite
         entry { n := n * 10 + 1 }
     step a in g parent p
     step b in g composite parent p
     step c in g parent b
     step d in g parent b
     step q in g
     history shallow of p
         case a (a)
         case b (b, c)
         default (b, d)
         content { n := n * 10 + 2 }
     history deep of p
         case a (a)
         case c (b, c)
         case d (b, d)
         default (a)
     transition t1 in g a -> b, d clears (a, b, c, d) restart on (e)
     transition t2 in g p -> q clears (p, a, b, c, d, q) restart on (x)
     transition t3 in g q -> p, history shallow clears (p, a, b, c, d, q) restart on (e)
     transition t4 in g q -> p, history deep clears (p, a, b, c, d, q) restart on (f)";

/// §3.3, §5: a history contains what was active when the state was left; its default content runs after the owner's entry list.
#[test]
fn histories() {
    check(
        &net(SETTINGS, HISTORY),
        "e,f,x\n1,0,0\n0,0,1\n1,0,0\n0,0,1\n0,1,0\n",
        "steps,n,fault
         a,1,0
         d,1,0
         q,1,0
         c,11,0
         q,11,0
         c,111,0",
    );
    let late = HISTORY.replace("enter (p, a)", "enter (q)");
    check(&net(SETTINGS, &late), "e,f,x\n1,0,0\n", "steps,n,fault\nq,0,0\nd,12,0");
}

/// §5 [C21]: slots store the remaining ticks; due sends join by due time, then by slot; cancel clears.
#[test]
fn sends() {
    let chart = net(
        SETTINGS,
        "part g level 1
             enter (a)
         input go bool event
         input stop bool event
         input x bool internal
         input y bool internal
         slot late sends x after 3
         slot soon sends y after 2
         slot now sends x after 0
         var n int 0..99999 = 0
         step a in g
             entry { send now }
         transition t1 in g reaction a -> on (go)
             do { send late; send soon }
         transition t2 in g reaction a -> on (x)
             do { n := n * 10 + 1 }
         transition t3 in g reaction a -> on (y)
             do { n := n * 10 + 2 }
         transition t4 in g reaction a -> on (stop)
             do { cancel late }",
    );
    check(
        &chart,
        "dt,go,stop\n1,1,0\n1,0,0\n1,0,0\n1,0,0\n1,1,0\n9,0,0\n1,1,0\n1,0,1\n9,0,0\n",
        "steps,n,fault
         a,1,0
         a,1,0
         a,1,0
         a,12,0
         a,121,0
         a,121,0
         a,12121,0
         a,12121,0
         a,12121,0
         a,99999,0",
    );
    let mut simulator = Simulator::new(&chart);
    let go = InputRow::zero(&chart).with(chart.inputs.ids().next().unwrap(), 1);
    simulator.step(&go);
    simulator.step(&go);
    assert_eq!(
        simulator.notes().iter().filter(|(what, _)| matches!(what, Noticed::Resent(_))).count(),
        2
    );
}

/// §5: a full queue drops the newest event and reports a fault; the reaction continues.
#[test]
fn full_queues() {
    check(
        &net(
            &SETTINGS.replace("queue 4", "queue 1"),
            "part g level 1
                 enter (a)
             input e bool event
             input x bool internal
             input y bool internal
             var n int 0..99 = 0
             step a in g
             transition t1 in g reaction a -> on (e)
                 do { raise x; raise y }
             transition t2 in g reaction a -> on (x)
                 do { n := n + 1 }
             transition t3 in g reaction a -> on (y)
                 do { n := n + 10 }",
        ),
        "e\n1\n0\n",
        "steps,n,fault
         a,0,0
         a,1,1
         a,1,0",
    );
}

/// §5: an event that no `on` refers to is not queued, so it cannot fill a queue.
#[test]
fn unheard_events_take_no_room() {
    check(
        &net(
            &SETTINGS.replace("queue 4", "queue 1"),
            "part g level 1
                 enter (a)
             input e bool event
             input f bool event
             input x bool internal
             input y bool internal
             slot now sends x after 0
             var n int 0..99 = 0
             step a in g
             transition t1 in g reaction a -> on (f)
                 do { raise x; raise y; send now; n := n + 1 }
             transition t2 in g reaction a -> on (y)
                 do { n := n + 10 }",
        ),
        "e,f\n1,1\n",
        "steps,n,fault
         a,0,0
         a,11,0",
    );
}

/// §5: events of one row are taken one by one, each with its own count of micro-steps.
#[test]
fn the_count_starts_anew_with_each_external_event() {
    let body = "part g level 1
             enter (a)
         input e bool event
         input f bool event
         input r bool internal
         slot again sends e after 0
         var n int 0..99 = 0
         step a in g
         transition t1 in g reaction a -> on (e, f)
             do { raise r }
         transition t2 in g reaction a -> on (r)
             do { n := n + 1 }";
    check(
        &net(&SETTINGS.replace("limit 9", "limit 2"), body),
        "e,f\n1,1\n",
        "steps,n,fault
         a,0,0
         a,2,0",
    );
    // A send to oneself does not restart the count, so the reaction ends.
    let endless = body.replace("do { raise r }", "do { send again; n := n + 1 }");
    check(
        &net(&SETTINGS.replace("limit 9", "limit 5"), &endless),
        "e,f\n1,0\n0,0\n",
        "steps,n,fault
         a,0,0
         a,5,1
         a,5,0",
    );
}

/// §5 [C20]: a top-level final state ends the chart; its outputs keep their values of that row.
#[test]
fn top_level_final() {
    check(
        &net(
            SETTINGS,
            "part g level 1
                 enter (a)
             input i bool
             input e bool event
             output o bool continuous
                 emit z if i
             output shout bool extern
                 call z ()
             output q bool controlled q
             action q duration 0
                 use a N
             var n int 0..9 = 0
             step a in g
             step z in g final
                 exit { n := n + 1 }
             transition t in g a -> z clears (a, z) restart on (e)",
        ),
        "i,e\n1,0\n1,1\n0,1\n",
        "steps,o,shout,q,n,fault
         a,0,0,1,0,0
         a,0,0,1,0,0
         z,1,1,1,1,0
         z,1,0,1,1,0",
    );
}

/// §5 [C19]: parallel statecharts share the queues, and every event is offered to all.
#[test]
fn side_by_side() {
    check(
        &net(
            SETTINGS,
            "part g level 1
                 enter (a)
             part h level 1
                 enter (c)
             input e bool event
             input r bool internal
             step a in g
             step b in g
             step c in h
             step d in h
             step x in h
             transition t1 in g a -> b clears (a, b) restart on (e)
                 do { raise r }
             transition t2 in h c -> d clears (c, d, x) restart on (e)
             transition t3 in h d -> x clears (c, d, x) restart on (r)",
        ),
        "e\n1\n",
        "steps,fault
         a c,0
         b x,0",
    );
}

/// §2: reset runs to completion.
#[test]
fn reset_runs_to_completion() {
    check(
        &net(
            SETTINGS,
            "part g level 1
                 enter (a)
             input i bool
             input r bool internal
             edge %0 = i
             step a in g
             step b in g
             step c in g
             step d in g
             transition t1 in g a -> b clears (a, b, c, d) restart when not i
                 do { raise r }
             transition t2 in g b -> c clears (a, b, c, d) restart on (r)
             transition t3 in g c -> d clears (a, b, c, d) restart when rise(%0)",
        ),
        "i\n1\n",
        "steps,fault
         c,0
         d,0",
    );
}
