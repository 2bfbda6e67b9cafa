//! States that only long runs reach: facts and findings of charts that count agree with those of an enumeration, which needs thousands of states.

use grafsynth_frontend::graf;
use grafsynth_ir::lower::lower;
use grafsynth_ir::net::Net;
use grafsynth_ir::random::Random;
use grafsynth_ir::{FileId, Valid};
use grafsynth_verify::{Check, Findings, Limits, facts, findings};

use crate::oracle::rounds;

fn net(text: &str) -> Valid<Net> {
    let parsed = graf::parse(FileId(0), text);
    let (net, found) = lower(&parsed.design.unwrap_or_else(|| panic!("{text}")));
    net.unwrap_or_else(|| panic!("{:?} {found:#?} {text}", parsed.diagnostics))
}

fn counter(bits: u32) -> Valid<Net> {
    let most = (1_u64 << bits) - 1;
    net(&format!(
        "chart counter {{ conflict priority\n input up, back\n output full\n var n: int 0..{most}\n \
         initial step count step done {{ full }}\n \
         count -> done when n = {most} priority 1\n \
         count -> count when rise(up) priority 2 do {{ n := n + 1 }}\n \
         done -> count when back do {{ n := 0 }} }}"
    ))
}

fn open(findings: &Findings) -> Vec<Check> {
    let open = findings.checked.iter().filter(|checked| checked.open.is_some());
    open.map(|checked| checked.check).collect()
}

#[test]
fn a_wide_counter_leaves_no_check_open() {
    for bits in [24, 31] {
        let net = counter(bits);
        let facts = facts(&net, &Limits::default());
        assert!(facts.all_dead_known && facts.dead_transitions.is_empty());
        let findings = findings(&net, &facts, &Limits::default());
        assert_eq!(open(&findings), [], "{findings:#?}");
        // At the largest value the chart moves on before the next edge.
        assert_eq!(findings.decided, []);
    }
}

/// A chart with a counter that goes up in strides and moves on at thresholds; now and then something disturbs that.
fn counting(seed: u64) -> String {
    let mut random = Random::new(seed ^ 0xfa5);
    let most = 1_100 + random.below(200);
    let constant = |random: &mut Random| match random.below(4) {
        0 => most,
        1 => random.below(8),
        _ => random.below(most),
    };
    let policy = if random.one_in(4) { "priority-age" } else { "priority" };
    let mut text = format!(
        "chart counting {{ conflict {policy}\n input a, b\n var n: int 0..{most}\n initial step s0 step s1\n"
    );
    for at in 0..2 {
        let guard = match random.below(4) {
            0 | 1 => format!("n = {}", constant(&mut random)),
            2 => format!("b and n > {}", constant(&mut random)),
            _ => format!("n mod 2 = 1 and n > {}", constant(&mut random)),
        };
        let action = match random.below(3) {
            0 => format!(" do {{ n := {} }}", constant(&mut random)),
            1 => " do { n := n + 1 }".to_owned(),
            _ => String::new(),
        };
        text += &format!(" s{at} -> s{} when {guard} priority 1{action}\n", 1 - at);
        let guard = ["rise(a)", "a", "b"][random.below(3)];
        let stride = ["n + 1", "n + 1", "n + 2", "n + 3", "n - 1"][random.below(5)];
        text += &format!(" s{at} -> s{at} when {guard} priority 2 do {{ n := {stride} }}\n");
        if random.one_in(3) {
            let (guard, to) = (constant(&mut random), constant(&mut random));
            text +=
                &format!(" s{at} -> s{at} when a and n = {guard} priority 3 do {{ n := {to} }}\n");
        }
    }
    text + "}\n"
}

#[test]
fn loops_show_nothing_that_an_enumeration_excludes() {
    let (mut n_known, mut n_same) = (0, 0);
    let total = rounds(16, 4_000);
    for seed in 0..total {
        let text = counting(seed);
        let net = net(&text);
        let all = facts(&net, &Limits { image_work: 0, ..Limits::default() });
        if all.reach.is_none() {
            continue;
        }
        let few = Limits {
            pairs: 500,
            states: 200,
            image_work: 0,
            random_rows: 300,
            ..Limits::default()
        };
        let some = facts(&net, &few);
        if some.reach.is_some() {
            continue;
        }
        if some.all_dead_known {
            n_known += 1;
            assert_eq!(some.dead_transitions, all.dead_transitions, "seed {seed}\n{text}");
        }
        let complete = findings(&net, &all, &Limits::default());
        let found = findings(&net, &some, &few);
        assert!(found.decided.iter().all(|one| complete.decided.contains(one)), "{seed}\n{text}");
        if !open(&found).contains(&Check::Conflicts) {
            assert_eq!(found.decided, complete.decided, "seed {seed}\n{text}");
            n_same += 1;
        }
        if !open(&found).contains(&Check::Races) {
            let saturates = complete.found.iter().any(|one| one.code.id == "G0810");
            assert!(!saturates, "seed {seed}\n{:#?}\n{text}", complete.found);
        }
    }
    println!("{n_known} with all transitions, {n_same} with all conflicts, of {total}");
    assert!(n_same > 0, "{n_same}");
}
