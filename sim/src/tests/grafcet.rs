//! Tests of semantics §2 to §4, §6 and §8 on Grafcet and SFC charts.

use super::{TRUCK, check, net, trace};
use crate::{Effect, InputRow, Noticed, Simulator};

#[test]
fn the_truck_of_the_seed() {
    check(
        &net("policy priority-age", TRUCK),
        "m,b,p,a\n0,0,0,0\n1,0,0,0\n1,0,0,0\n0,1,0,0\n0,0,1,0\n0,0,0,1\n",
        "steps,R,Z,L
         p1,0,0,0
         p1,0,0,0
         p2,1,0,0
         p2,1,0,0
         p3,0,1,0
         p4,0,0,1
         p1,0,0,0",
    );
}

/// §2: row 0 may be unstable, and its lists run as from the empty situation.
#[test]
fn reset_runs_lists_but_does_not_evolve() {
    check(
        &net(
            "evolution stable limit 5",
            "var n int 0..9 = 3
             output o bool continuous
                 emit a
             step a in g initial
                 entry { if b.active { n := 9 } else { n := n + 1 } }
             step b in g initial
                 entry { if a.active { n := n * 2 } }
             step c in g
             transition t in g a -> c",
        ),
        "dt\n1\n",
        "steps,o,n,fault
         a b,1,8,0
         b c,0,8,0",
    );
}

/// §3.2: a step that is removed and added stays active; with `restart` it is both deactivated and activated.
#[test]
fn staying_and_restarting() {
    let body = |restart: &str| {
        format!(
            "input i bool
             var ins int 0..99 = 0
             var outs int 0..99 = 0
             step a in g initial
                 entry {{ ins := ins + 1 }}
                 exit {{ outs := outs + 1 }}
             output late bool continuous
                 emit a if a.t >= 2
             transition t in g a -> a {restart} when i"
        )
    };
    check(
        &net("", &body("")),
        "i\n1\n1\n1\n",
        "steps,late,ins,outs
         a,0,1,0
         a,0,1,0
         a,1,1,0
         a,1,1,0",
    );
    check(
        &net("", &body("restart")),
        "i\n0\n0\n1\n0\n",
        "steps,late,ins,outs
         a,0,1,0
         a,0,1,0
         a,1,1,0
         a,0,2,1
         a,0,2,1",
    );
}

/// §3.2: the same with two transitions; the `restart` of the transition that adds the step decides whether it stays active.
#[test]
fn two_transitions_can_keep_a_step() {
    check(
        &net(
            "",
            "var ins int 0..9 = 0
             step a in g initial
             step b in g initial
                 entry { ins := ins + 1 }
             step c in g
             transition t1 in g a -> b
             transition t2 in g b -> c",
        ),
        "dt\n1\n",
        "steps,ins
         a b,1
         b c,1",
    );
}

/// §3.2: `otherwise` tests whether the earlier transitions are fireable, not whether they win.
#[test]
fn otherwise_looks_at_what_is_fireable() {
    check(
        &net(
            "",
            "input i bool
             step a in g initial
             step b in g
             step c in g
             transition t1 in g a -> b when i
             transition t2 in g a -> c when not t1.fireable",
        ),
        "i\n1\n",
        "steps
         a
         b",
    );
    check(
        &net(
            "",
            "input i bool
             step a in g initial
             step b in g
             step c in g
             transition t1 in g a, b -> b when i
             transition t2 in g a -> c when not t1.fireable",
        ),
        "i\n1\n",
        "steps
         a
         c",
    );
}

/// §3.2 [C4], [C7]: source transitions are always enabled; a reaction consumes nothing and counts as a micro-step.
#[test]
fn sources_sinks_and_reactions() {
    check(
        &net(
            "",
            "input i bool
             input e bool event
             var n int 0..9 = 0
             step a in g initial
             step b in g
             transition t1 in g -> b when i
             transition r1 in g reaction a -> on (e)
                 do { n := n + 1 }
             transition t2 in g a -> when not i and e",
        ),
        "i,e\n1,0\n0,0\n1,1\n0,1\n0,1\n",
        "steps,n
         a,0
         a b,0
         a b,0
         a b,1
         b,2
         b,2",
    );
    // A reaction with a level condition is a livelock in `stable`.
    check(
        &net(
            "evolution stable limit 3",
            "input i bool
             var n int 0..9 = 0
             step a in g initial
             transition r1 in g reaction a -> when i
                 do { n := n + 1 }",
        ),
        "i\n1\n0\n",
        "steps,n,fault
         a,0,0
         a,3,1
         a,3,0",
    );
}

/// §3.3: exit lists, then transitions by urgency, then entry lists; each sees all earlier ones.
#[test]
fn lists_run_in_one_order() {
    let body = "var s int 0..9999999 = 0
         step a in g initial
             exit { s := s * 10 + 1 }
         step b in g initial
             exit { s := s * 10 + 2 }
         step c in g
             entry { s := s * 10 + 5 }
         step d in g
             entry { s := s * 10 + 6 }
         transition t1 in g b -> c priority 2
             do { s := s * 10 + 3 }
         transition t2 in g a -> d priority 1
             do { s := s * 10 + 4 }";
    check(&net("policy priority", body), "dt\n1\n", "steps,s\na b,0\nc d,124356");
    // Under `all`, priorities do not order actions.
    check(&net("policy all", body), "dt\n1\n", "steps,s\na b,0\nc d,123456");
    // Simultaneous: all read the values at the start, the last write wins.
    check(&net("assign simultaneous", body), "dt\n1\n", "steps,s\na b,0\nc d,6");
}

/// §3.3: step bits are cleared after the exit list and set before the entry list.
#[test]
fn bits_change_within_the_lists() {
    let body = "var seen int 0..9999 = 0
         step a in g initial
             exit { if a.active { seen := seen + 1000 } }
         step b in g
             entry { if b.active and not c.active { seen := seen + 1 } }
         step c in g
             entry { if b.active and c.active { seen := seen + 10 } }
         transition t in g a -> b, c
             do { if not a.active and not b.active { seen := seen + 100 } }";
    check(&net("", body), "dt\n1\n", "steps,seen\na,0\nb c,1111");
    // With `assign simultaneous`, step bits have their values from the start of the micro-step, so the second and third conditions are false; the last of the
    // other writes wins.
    check(&net("assign simultaneous", body), "dt\n1\n", "steps,seen\na,0\nb c,1000");
}

/// §3.4: `stable` continues; external events are present only in the first micro-step; the limit is exact.
#[test]
fn search_for_stability() {
    let body = "input i bool
         input e bool event
         step a in g initial
         step b in g
         step c in g
         step d in g
         transition t1 in g a -> b on (e)
         transition t2 in g b -> c when i
         transition t3 in g c -> d on (e)";
    check(
        &net("evolution stable limit 9", body),
        "i,e\n1,0\n1,1\n0,0\n0,1\n",
        "steps,fault
         a,0
         a,0
         c,0
         c,0
         d,0",
    );
    let cycle = "input i bool
         step a in g initial
         step b in g
         transition t1 in g a -> b when i
         transition t2 in g b -> a when i";
    check(
        &net("evolution stable limit 3", cycle),
        "i\n0\n1\n0\n",
        "steps,fault
         a,0
         a,0
         b,1
         b,0",
    );
    let cycle = net("evolution stable limit 3", cycle);
    let mut simulator = Simulator::new(&cycle);
    let row = InputRow::zero(&cycle).with(cycle.inputs.ids().next().unwrap(), 1);
    simulator.step(&row);
    assert_eq!(simulator.notes().iter().next().map(|(what, _)| *what), Some(Noticed::LimitReached));
    assert_eq!(simulator.fired().len(), 3);
}

/// §3.4 [C11]: an event raised by the last allowed micro-step is lost; it is a fault if it would make something fire.
#[test]
fn an_event_pending_at_the_limit() {
    let body = "input r bool internal
         step a in g initial
         step b in g
         step c in g
         transition t1 in g a -> b
             do { raise r }
         transition t2 in g b -> c on (r)";
    check(&net("evolution stable limit 1", body), "dt\n1\n1\n", "steps,fault\na,0\nb,1\nb,0");
    check(&net("evolution stable limit 2", body), "dt\n1\n", "steps,fault\na,0\nc,0");
    check(&net("evolution single", body), "dt\n1\n1\n", "steps\na\nb\nc");
    let unheard = body.replace("on (r)", "when false");
    check(&net("evolution stable limit 1", &unheard), "dt\n1\n", "steps,fault\na,0\nb,0");
}

/// §5 [C10]: no second check "with the event now 0".
#[test]
fn a_check_that_fires_nothing_ends_the_reaction() {
    check(
        &net(
            "evolution stable limit 5",
            "input e bool event
             step a in g initial
             step b in g
             transition t in g a -> b when not e",
        ),
        "e\n1\n1\n0\n",
        "steps,fault
         a,0
         a,0
         a,0
         b,0",
    );
}

/// §3.6: conditions read the resulting variables; mealy outputs read the situation before.
#[test]
fn moore_and_mealy() {
    check(
        &net(
            "",
            "input i bool
             output moore bool continuous
                 emit b if n = 1
             output mealy bool mealy
                 emit a if i
             output stored int 0..9 stored stored
             output bit bool controlled bit
             var n int 0..9 = 0
             var stored int 0..9 stored = 4
             action bit duration 0
                 use b N if i
             step a in g initial
             step b in g
                 entry { n := 1; stored := 20 }
             transition t in g a -> b when i",
        ),
        "i\n0\n1\n0\n",
        "steps,moore,mealy,stored,bit,n
         a,0,0,4,0,0
         a,0,0,4,0,0
         b,1,1,9,1,1
         b,1,0,9,0,1",
    );
}

/// §3.6: open cells are held or 0, and masked from there on.
#[test]
fn unspecified_cells() {
    let chart = net(
        "",
        "input i bool
         output o bool continuous
             emit a
         step a in g initial
         step b in g
         transition t in g a -> b when i
         open next when a.active and i
         open output o when not i",
    );
    check(&chart, "i\n0\n1\n", "steps,o\na,1\na,0\na,1");
    let (stimulus, _) = crate::Stimulus::parse_csv(&chart, grafsynth_ir::FileId(0), "i\n0\n1\n1\n");
    let trace = crate::run(&chart, &stimulus.unwrap());
    assert_eq!(trace.rows[0].open, [] as [bool; 0]);
    assert_eq!(trace.rows[1].open, [false, false, false, false, true]);
    assert_eq!(trace.rows[2].open, [false, false, false, true, true]);
    assert_eq!(trace.rows[3].open, [false, false, false, true, true]);
}

/// §3.6: row 0 shows the mealy cell of the reset situation with all inputs 0, so it is open if that cell is; nothing else is open there.
#[test]
fn unspecified_cells_of_row_0() {
    let chart = net(
        "",
        "input i bool
         output m bool mealy
             emit a
         output o bool continuous
             emit a
         step a in g initial
         open next when not i
         open output m when not i
         open output o when not i",
    );
    let (stimulus, _) = crate::Stimulus::parse_csv(&chart, grafsynth_ir::FileId(0), "i\n1\n");
    let trace = crate::run(&chart, &stimulus.unwrap());
    assert_eq!(trace.rows[0].open, [false, false, false, false, true, false]);
    assert_eq!(trace.rows[1].open, [] as [bool; 0]);
}

/// §3.7: edges of inputs compare with the previous reaction and last until the first micro-step; others compare with the last micro-step.
#[test]
fn edges() {
    let body = "input i bool
         edge %0 = i
         edge %1 = b.active
         step a in g initial
         step b in g
         step c in g
         step x in g initial
         step y in g
         transition t1 in g a -> b when rise(%0)
         transition t2 in g b -> c when rise(%0)
         transition t3 in g x -> y when rise(%1)
         transition t4 in g y -> x when fall(%1)";
    check(
        &net("evolution stable limit 9", body),
        "i\n1\n1\n0\n1\n",
        "steps,fault
         a x,0
         b y,0
         b y,0
         b y,0
         c x,0",
    );
    check(
        &net("evolution single", body),
        "i\n1\n1\n0\n1\n1\n1\n",
        "steps
         a x
         b x
         b y
         b y
         c y
         c x
         c x",
    );
    // [C3]: after reset every operand is still false.
    check(
        &net(
            "",
            "input i bool
             edge %0 = not i
             edge %1 = a.active
             step a in g initial
             step b in g
             step c in g initial
             step d in g
             transition t1 in g a -> b when rise(%0)
             transition t2 in g c -> d when rise(%1)",
        ),
        "i\n0\n",
        "steps
         a c
         b d",
    );
}

/// §3.7: an assignment in a body at the end of a reaction is an edge for the next reaction.
#[test]
fn edges_of_what_the_end_assigns() {
    check(
        &net(
            "",
            "var n bool = 0
             edge %0 = n
             action set duration 0
                 use a P
                 body { n := true }
             step a in g initial
             step b in g
             transition t in g a -> b when rise(%0)",
        ),
        "dt\n1\n1\n",
        "steps,n
         a,1
         b,1
         b,1",
    );
}

/// §4: `all` fires both, `priority` the most urgent of those that compete; a transition that is not chosen blocks nothing [C16].
#[test]
fn policies_all_and_priority() {
    let body = "step a in g initial
         step b in g initial
         step c in g initial
         step x in g
         step y in g
         step z in g
         transition t1 in g a, b -> x
         transition t2 in g b, c -> y priority 3
         transition t3 in g c -> z";
    check(&net("policy all", body), "dt\n1\n", "steps\na b c\nx y z");
    // t2 has a priority and goes first; t1 and t3 share a step with it and are not chosen.
    check(&net("policy priority", body), "dt\n1\n", "steps\na b c\na y");
    let body = body.replace(" priority 3", "");
    // t1 goes first; t2 is not chosen and does not block t3.
    check(&net("policy priority", &body), "dt\n1\n", "steps\na b c\nx z");
    check(&net("policy priority\nfire one", &body), "dt\n1\n1\n", "steps\na b c\nc x\nx z");
}

/// §4: P first, then the older branch, then declaration; a sink transition comes last.
#[test]
fn policy_priority_age() {
    let body = "step a in g initial
         step x in g
         step y in g
         transition t1 in g a -> x
         transition t2 in g a -> y
         transition t3 in g x -> a
         transition t4 in g y -> a";
    check(
        &net("policy priority-age", body),
        "dt\n1\n1\n1\n1\n1\n",
        "steps
         a
         x
         a
         y
         a
         x",
    );
    let urgent = body.replace("step y in g", "step y in g priority 1");
    check(&net("policy priority-age", &urgent), "dt\n1\n1\n1\n", "steps\na\ny\na\ny");
    let sink = "step a in g initial
         transition t1 in g a ->
         transition t2 in g a -> a";
    check(&net("policy priority-age", sink), "dt\n1\n1\n", "steps\na\na\na");
}

/// §4, ranks: the chart's rank comes before all other keys, both for conflicts and for actions.
#[test]
fn schedules() {
    let body = "part outer level 1 priority 2
         part inner level 2
         part other level 1 priority 1
         var s int 0..99999 = 0
         step a in outer initial
             exit { s := s * 10 + 1 }
         step b in inner initial
             exit { s := s * 10 + 2 }
         step c in other initial
             exit { s := s * 10 + 3 }
         step d in outer initial
             exit { s := s * 10 + 4 }
         transition ta in outer a ->
         transition tb in inner b ->
         transition tc in other c ->
         transition td in outer d ->";
    check(&net("schedule declared", body), "dt\n1\n", "steps,s\na b c d,0\n,1243");
    check(&net("schedule level", body), "dt\n1\n", "steps,s\na b c d,0\n,1342");
    check(&net("schedule priority", body), "dt\n1\n", "steps,s\na b c d,0\n,3124");
}

/// §6: only assignments saturate; division truncates toward zero.
#[test]
fn arithmetic() {
    let chart = net(
        "",
        "var n int -5..5 = 0
         var q int -9..9 = 0
         var r int -9..9 = 0
         var v int 0..3 [2] = 1, 2
         step a in g initial
         step b in g
             entry { n := 40000 * 40000 - 1; q := -7 / 2; r := -7 mod 2; v[(n + 6) mod 2] := v[0] + 1 }
         transition t in g a -> b",
    );
    check(
        &chart,
        "dt\n1\n",
        "steps,n,q,r,v[0],v[1]
         a,0,0,0,1,2
         b,5,-3,-1,1,2",
    );
}

#[test]
fn saturation_and_races_are_noted() {
    let chart = net(
        "",
        "var n int 0..5 = 0
         step a in g initial
             exit { n := 0 }
         step b in g
             entry { n := 7 }
         step c in g
             entry { n := 1 }
         transition t in g a -> b, c",
    );
    let mut simulator = Simulator::new(&chart);
    simulator.step(&InputRow::zero(&chart));
    let noticed: Vec<Noticed> = simulator.notes().iter().map(|(what, _)| *what).collect();
    assert!(matches!(noticed[..], [Noticed::Saturated(..), Noticed::Race(..)]), "{noticed:?}");
    let messages: Vec<String> =
        simulator.notes().diagnostics(&chart).into_iter().map(|d| d.message).collect();
    assert_eq!(
        messages,
        [
            "a value for `n` was outside 0..5, in row 1",
            "`n` is written by the entry list of `b` and by the entry list of `c` in one micro-step, in row 1",
        ]
    );
}

/// §3.3: a deactivation list comes before the actions, and these before activation lists, whatever the order of declaration.
#[test]
fn lists_whose_order_is_fixed_do_not_race() {
    let chart = net(
        "",
        "var n int 0..5 = 0
         step b in g
             entry { n := 1 }
         step a in g initial
             exit { n := 3 }
         transition t in g a -> b
             do { n := 2 }",
    );
    let mut simulator = Simulator::new(&chart);
    simulator.step(&InputRow::zero(&chart));
    assert_eq!(simulator.notes().iter().count(), 0);
}

/// §6: calls are counted, or shown with their arguments in order; continuous ones come last, with the arguments of the first step [C22].
#[test]
fn extern_actions() {
    let chart = net(
        "",
        "input seen bool extern
         output beep bool extern
         output move bool extern
             param int 0..9 speed
             param bool
             call b (12, true)
             call a (3, false)
         output say bool extern
             param int 0..99
         step a in g initial
             entry { call beep (); call say (5) }
         step b in g initial
             entry { call beep (); call say (500) }
         step c in g
         transition t in g a, b -> c when seen",
    );
    check(
        &chart,
        "seen\n0\n1\n",
        "steps,beep,move,say
         a b,2,3:0,5;99
         a b,0,3:0,
         c,0,,",
    );
    let mut simulator = Simulator::new(&chart);
    simulator.step(&InputRow::zero(&chart));
    assert!(matches!(simulator.effects()[..], [Effect::Condition(_), Effect::Call(..)]));
}

/// §6: tasks run while their costs fit in the budget; the index is 0 on activation.
#[test]
fn tasks() {
    check(
        &net(
            "",
            "var n int 0..9999 = 0
             output all bool continuous
                 emit a if a.done
             step a in g initial budget 3
                 task one cost 2 { n := n * 10 + 1 }
                 task two cost 2 { n := n * 10 + 2 }
                 task three cost 1 { n := n * 10 + 3 }
             step b in g
             transition t1 in g a -> b when a.done
             transition t2 in g b -> a",
        ),
        "dt\n1\n1\n1\n",
        "steps,all,n
         a,0,1
         a,1,123
         b,0,123
         a,0,1231",
    );
}

/// §8: an enclosing step deactivates all steps inside it; a restart enters by the activation links [C24].
#[test]
fn enclosing_steps() {
    let body = "part g level 1
         part in1 level 2
         part in2 level 3
         input i bool
         input j bool
         var log int 0..9999999 = 0
         step run in g initial enclosing
         step off in g
         step x in in1 enclosing parent run link
             entry { log := log * 10 + 1 }
             exit { log := log * 10 + 2 }
         step y in in1 parent run
             entry { log := log * 10 + 9 }
         step deep in in2 parent x link
             entry { log := log * 10 + 3 }
             exit { log := log * 10 + 4 }
         transition stop in g run -> off when i
         transition go in g off -> run when not i
             do { log := 0 }
         transition again in g run -> run restart when j
         transition inside in in1 x -> y when i or j
             do { log := log * 10 + 5 }
         transition birth in in2 -> deep when not deep.active";
    check(
        &net("", body),
        "i,j\n0,0\n1,0\n0,0\n0,1\n",
        "steps,log
         run x deep,13
         run x deep,13
         off,13245
         run x deep,13
         run x deep,1324513",
    );
}

/// §8: transitions of forced charts do not fire; the charts change to the forced situation and run its lists once.
#[test]
fn forcing() {
    let chart = |order: &str| {
        net(
            "",
            &format!(
                "part top level 1
                 part low level 1
                 input i bool
                 var n int 0..99 = 0
                 step free in top initial
                 step stop in top
                 step a in low initial
                     exit {{ n := n + 1 }}
                 step b in low
                     entry {{ n := n + 10 }}
                 step c in low
                 transition t1 in top free -> stop when i
                 transition t2 in top stop -> free when not i
                 transition t3 in low a -> b
                 transition t4 in low b -> c
                 transition t5 in low c -> a
                 force stop (low) {order}"
            ),
        )
    };
    check(
        &chart("situation (b)"),
        "i\n1\n1\n0\n0\n",
        "steps,n
         free a,0
         stop b,11
         stop b,11
         free b,11
         free c,11",
    );
    check(
        &chart("hold"),
        "i\n1\n1\n0\n0\n",
        "steps,n\nfree a,0\nstop a,0\nstop a,0\nfree a,0\nfree b,11",
    );
    check(&chart("situation ()"), "i\n0\n1\n0\n", "steps,n\nfree a,0\nfree b,11\nstop,11\nfree,11");
}

/// §11: complete traces, including the columns of the stimulus.
#[test]
fn full_trace_of_the_truck() {
    let truck = net("", TRUCK);
    let (stimulus, _) = crate::Stimulus::parse_csv(&truck, grafsynth_ir::FileId(0), "dt,m\n3,1\n");
    assert_eq!(
        crate::run(&truck, &stimulus.unwrap()).to_csv(),
        "scan,dt,m,b,p,a,steps,R,Z,L\n0,0,0,0,0,0,p1,0,0,0\n1,3,1,0,0,0,p2,1,0,0\n"
    );
    assert!(trace(&truck, "m\n1\n").starts_with("steps,R,Z,L\n"));
}
