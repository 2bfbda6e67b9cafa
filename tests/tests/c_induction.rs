//! The proof of emitted C by induction: it applies at sizes at which no enumeration ends, it proves texts that were edited without an effect, and it never proves one
//! that differs. Mutants of realistic charts are in `c_mutations`.

#![allow(clippy::print_stdout, reason = "tests report what they counted")]

use crate::c_mutations::{changes, difference};
use grafsynth_backend_c::{Io, Options, Package, Style, emit};
use grafsynth_driver::c_proof::prove_c;
use grafsynth_engines::tools;
use grafsynth_ir::Valid;
use grafsynth_ir::instance::{Holds, Place};
use grafsynth_ir::net::{Evolution, Leaf, Net, Policy};
use grafsynth_ir::program::Origin;
use grafsynth_sim::Random;
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, in_parallel, readable, rounds, small_limits};
use grafsynth_verify::{Limits, facts};
use std::collections::BTreeMap;

/// Realistic charts.
const CHARTS: [(&str, &str); 5] = [
    ("truck.graf", include_str!("../../examples/truck/truck.graf")),
    ("arbiter.graf", include_str!("../../examples/arbiter/arbiter.graf")),
    ("filler.graf", include_str!("../../examples/bottle-filler/filler.graf")),
    ("crossing.graf", include_str!("../../examples/crossing/crossing.graf")),
    ("frame.graf", include_str!("../../examples/mcs-frame/frame.graf")),
];

/// Two lights with times, and a watchdog that reads the state of one of them.
const LIGHTS: &str = "chart lights {
    tick 10 ms
    evolution single
    conflict priority
    input ped, car
    output green, red, alarm
    var n: int 0..9
    initial step go { green }
    step slow { red }
    step stop {
        red
        exit { n := n + 1 }
    }
    go -> slow when car or rise(ped) after 20 s
    slow -> stop after 3 s
    stop -> go when not car after 2 s
    initial step calm
    step waiting
    step late { alarm if n > 3 }
    calm -> waiting when ped
    waiting -> calm when stop.active
    waiting -> late after 60 s
    late -> calm when stop.active
}
";

fn emitted(net: &Valid<Net>, style: Style, io: Io) -> Option<Package> {
    let options = Options { style, io, prefix: Some("own".to_owned()), ..Options::default() };
    emit(net, &facts(net, &small_limits()), &options).ok()
}

fn proved(net: &Valid<Net>, package: &Package) -> Result<(), String> {
    prove_c(net, &facts(net, &small_limits()), package, &Limits::default()).map(|_| ())
}

#[test]
fn charts_of_every_style_are_proved() {
    for (name, text) in CHARTS.into_iter().chain([("lights.graf", LIGHTS)]) {
        let net = chart(name, text);
        for style in [Style::Auto, Style::Tables, Style::Bits, Style::Program] {
            for io in [Io::Members, Io::Words] {
                if io == Io::Words && style == Style::Auto {
                    continue;
                }
                let Some(package) = emitted(&net, style, io) else { continue };
                if let Err(why) = proved(&net, &package) {
                    panic!("{name} as {}: {why}", package.style);
                }
            }
        }
    }
}

/// A ring of steps: enumeration of its 16 inputs does not end.
fn ring(n_steps: usize) -> String {
    let inputs: Vec<String> = (0..16).map(|at| format!("i{at}")).collect();
    let mut text = format!(
        "chart ring {{ evolution single conflict priority input {} output q\n",
        inputs.join(", ")
    );
    for at in 0..n_steps {
        let initial = if at == 0 { "initial " } else { "" };
        let q = if at % 2 == 0 { "q" } else { "" };
        text.push_str(&format!("{initial}step s{at} {{ {q} }}\n"));
        let (next, a, b) = ((at + 1) % n_steps, at % 16, (at + 5) % 16);
        text.push_str(&format!("s{at} -> s{next} when i{a} and not i{b}\n"));
    }
    text.push('}');
    text
}

/// The second step is never active, and only the facts of the chart say so: its tasks must not run in the induction either.
const NEVER: &str = "chart never {
    evolution single
    input x
    output q
    var n: int 0..9
    initial step a { q }
    step b {
        budget 1
        task one cost 1 { n := 5 }
        task two cost 1 { n := 6 }
    }
    a -> b when n > 3 do { n := 1 }
    b -> a when x or b.done do { n := 7 }
}
";

/// A product, of which only the equality of each intermediate value shows that the last one is equal.
const WORDS: &str = "chart words {
    evolution single
    conflict priority
    input x
    input n: int -8..7
    output q: int -128..127
    initial step a { exit { q := q - n } }
    step b { entry { q := q * n } exit { q := q + n } }
    a -> b when x do { q := q * (n + q) }
    b -> a when not x do { q := q - 100 }
}
";

/// A time that needs 32 bits: numbers of ticks beyond the contract would be negative.
const HOURS: &str = "chart hours {
    tick 1 ms
    evolution single
    input a
    output q
    initial step s
    step w { q }
    s -> w when rise(a)
    w -> s after 3600 s
}
";

#[test]
fn steps_that_are_never_active_products_and_hours_are_proved() {
    let wrong = |value: &str| format!("out->q = {value} == 77 ? 76 : {value};");
    let (hour, later) = ("self->w_t >= INT32_C(3600000)", "self->w_t > INT32_C(3600000)");
    let cases = [
        ("hours.graf", HOURS, hour, later),
        ("never.graf", NEVER, "out->q = self->a;", "out->q = self->a != (self->b_task == 0U);"),
        ("words.graf", WORDS, "out->q = (int8_t)(int)self->q;", &wrong("(int8_t)(int)self->q")),
    ];
    for (name, text, old, new) in cases {
        let net = chart(name, text);
        let package = emitted(&net, Style::Bits, Io::Members).expect("the style supports it");
        if let Err(why) = proved(&net, &package) {
            panic!("{name}: {why}");
        }
        assert!(proved(&net, &changed(&package, "own.c", old, new)).is_err(), "{name}: {new}");
    }
}

/// In a state that is not reachable (`n` is 1; it is 0, 5 or 9), a reaction takes more micro-steps than any reachable one.
const DEEPER: &str = "chart deeper {
    tick 10 ms
    evolution stable limit 20
    input go, more
    output o
    var n: int 0..9 = 0
    initial step p { entry { n := if n = 0 then 5 else if n = 5 then 9 else 0 } }
    step q { o }
    step r
    step s
    p -> q when go
    q -> p when not go
    q -> r when more and not go or n = 1
    r -> s when more and not go or n = 1
    s -> p when go or n = 1
}
";

/// The last value of the edge is always false, so the transition never fires.
const STUCK: &str = "chart stuck {
    input go
    output o
    initial step p { o if go }
    step q { o }
    p -> q when fall(go <> go)
    q -> p when go
}
";

/// `p` and `q` are compared with `u` and `v`, but not with each other, so a circle of ages has no triangle.
const CIRCLE: &str = "chart circle {
    conflict priority-age
    input a, b
    output o
    initial step s
    step p { o }
    step q
    step u
    step v
    s -> p & q when a
    s -> u & v when b
    p & q -> s when not a
    u & v -> s when not b
}
";

/// `q` and `d` share a timer, because a search shows that `d` is never active: `n` is 0 or 5. Where `n` is 1, a reaction makes `d` active beside `q`.
const AFTER: &str = "chart after {
    tick 10 ms
    evolution single
    input go
    output o, w
    var n: int 0..9 = 0
    initial step p { entry { n := if n = 0 then 5 else 0 } }
    step q { o if q.t >= 30 ms }
    step r
    step d { w if d.t >= 20 ms }
    p -> q & r when go
    r -> r & d when n = 1
    q & r -> p when not go
    d -> q when not go
}
";

#[test]
fn facts_about_reachable_states_complete_the_induction() {
    let cases = [
        ("deeper.graf", DEEPER, "out->o = self->q;", "out->o = self->q || self->s;"),
        ("circle.graf", CIRCLE, "out->o = self->p;", "out->o = self->p || self->u;"),
        ("after.graf", AFTER, ">= 3U", ">= 4U"),
        ("stuck.graf", STUCK, "(self->p && in->go) || self->q;", "self->p || self->q;"),
    ];
    for (name, text, old, new) in cases {
        let net = chart(name, text);
        let package = emitted(&net, Style::Bits, Io::Members).expect("the style supports it");
        if let Err(why) = proved(&net, &package) {
            panic!("{name}: {why}");
        }
        assert!(proved(&net, &changed(&package, "own.c", old, new)).is_err(), "{name}: {new}");
    }
}

#[test]
fn many_steps_and_inputs_are_proved() {
    let net = chart("ring.graf", &ring(60));
    for style in [Style::Switch, Style::Tables, Style::Bits, Style::Program] {
        if let Some(package) = emitted(&net, style, Io::Members)
            && let Err(why) = proved(&net, &package)
        {
            panic!("{}: {why}", package.style);
        }
    }
}

/// Branches between a fork and a join, each moved by its own input, with times in one of them.
fn fork(n_branches: usize, n_steps: usize) -> String {
    let list = |text: &dyn Fn(usize) -> String, by: &str| {
        (0..n_branches).map(text).collect::<Vec<_>>().join(by)
    };
    let inputs = list(&|branch| format!("i{branch}"), ", ");
    let mut text = format!(
        "chart fork {{ tick 10 ms evolution single conflict priority input go, {inputs} output q, r\ninitial step s\nstep e {{ q }}\n"
    );
    let firsts = list(&|branch| format!("b{branch}_0"), " & ");
    let lasts = list(&|branch| format!("b{branch}_{}", n_steps - 1), " & ");
    for branch in 0..n_branches {
        for at in 0..n_steps {
            text.push_str(&format!(
                "step b{branch}_{at} {{ {} }}\n",
                if at % 2 == 1 { "r" } else { "" }
            ));
            let after = if branch == 1 && at % 4 == 0 { " after 2 s" } else { "" };
            if at + 1 < n_steps {
                text.push_str(&format!(
                    "b{branch}_{at} -> b{branch}_{} when i{branch}{after}\n",
                    at + 1
                ));
            }
        }
    }
    text.push_str(&format!(
        "s -> {firsts} when go\n{lasts} -> e\ne -> s when not go after 3 s\n}}"
    ));
    text
}

#[test]
fn branches_between_a_fork_and_a_join_are_proved() {
    for (n_branches, n_steps) in [(3, rounds(8, 60) as usize), (5, 4)] {
        let net = chart("fork.graf", &fork(n_branches, n_steps));
        for style in [Style::Switch, Style::Tables, Style::Program] {
            let Some(package) = emitted(&net, style, Io::Members) else { continue };
            if let Err(why) = proved(&net, &package) {
                panic!("{n_branches} branches of {n_steps} steps as {}: {why}", package.style);
            }
        }
    }
}

/// If another transition leaves or enters a branch, the invariants of the branches do not apply and exclude nothing.
#[test]
fn a_text_that_is_wrong_only_in_a_broken_fork_is_not_proved() {
    let chart_of = |more: &str| {
        let text = fork(2, 3);
        let text = text.replacen("e -> s when", &format!("{more}\ne -> s when"), 1);
        chart("fork.graf", &text)
    };
    // Wrong only if `s` is active together with a step of the second branch.
    let body = "own_in_t *in, uint16_t dt, own_out_t *out)\n{\n";
    let wrong = "    if (own_active_s(self) && own_active_b1_2(self)) { return; }\n";
    let fate = |more: &str| {
        let net = chart_of(more);
        let package = emitted(&net, Style::Bits, Io::Members).expect("the style supports it");
        assert!(proved(&net, &package).is_ok(), "{more}: {:?}", proved(&net, &package));
        proved(&net, &changed(&package, "own.c", body, &format!("{body}{wrong}")))
    };
    assert!(fate("").is_ok(), "{:?}", fate(""));
    for more in ["b0_1 -> s when i1", "b0_2 -> e when go and i1"] {
        assert!(fate(more).is_err(), "{more}");
    }
}

#[test]
fn random_charts_are_proved() {
    let mut n_proved = 0;
    for seed in 0..rounds(30, 3_000) {
        let net = random_net(seed, &Features::plain());
        for style in [Style::Switch, Style::Tables, Style::Bits, Style::Program] {
            let Some(package) = emitted(&net, style, Io::Members) else { continue };
            if let Err(why) = proved(&net, &package) {
                panic!("seed {seed} as {}: {why}\n{}", package.style, readable(&net));
            }
            n_proved += 1;
        }
    }
    println!("{n_proved} texts proved");
    assert!(n_proved > 30);
}

/// The features that a chart may have, for the count below.
fn features_of(net: &Net) -> Vec<&'static str> {
    let transitions = || net.transitions.values();
    let reads_time = transitions().any(|it| it.guard.leaves().any(Leaf::is_time));
    let all = [
        ("timer", reads_time || !net.timers.is_empty()),
        ("age", net.settings.policy == Policy::PriorityAge),
        ("event", net.inputs.values().any(|input| input.kind.is_event())),
        ("fork", transitions().any(|it| it.enters.len() > 1)),
        ("list", net.statements().next().is_some()),
        ("int", net.vars.values().any(|var| !var.ty.is_bool())),
        ("stable", net.settings.evolution != Evolution::Single),
    ];
    all.into_iter().filter(|(_, has)| *has).map(|(name, _)| name).collect()
}

/// The share of charts with all features of Grafcet whose C is proved; the rest stays open, which is not an error.
#[test]
fn most_charts_of_all_features_are_proved() {
    let base = Features { max_steps: 28, ..Features::everything().without_statecharts() };
    let seeds: Vec<u64> = (7..7 + rounds(4, 2_000)).collect();
    let answers = in_parallel(&seeds, |seed| {
        let net = random_net(*seed, &base.some(*seed));
        let package = emitted(&net, Style::Bits, Io::Members)?;
        let answer = proved(&net, &package);
        if let Err(why) = &answer {
            println!("seed {seed}: {why}");
        }
        Some((net.steps.len(), features_of(&net), answer.is_ok()))
    });
    let answers: Vec<(usize, Vec<&str>, bool)> = answers.into_iter().flatten().collect();
    // For all charts and for those with each feature: how many there are, and how many are proved.
    let mut counts: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for (_, features, is_proved) in &answers {
        for feature in features.iter().chain(&["any"]) {
            let (n, n_proved) = counts.entry(feature).or_default();
            *n += 1;
            *n_proved += usize::from(*is_proved);
        }
    }
    let mut sizes: Vec<usize> = answers.iter().map(|(size, ..)| *size).collect();
    sizes.sort_unstable();
    println!(
        "charts, and those that are proved: {counts:?}; the median has {} steps",
        sizes[sizes.len() / 2]
    );
    // A few charts are too few for proportions.
    let (n_all, n_proved) = counts["any"];
    if n_all >= 100 {
        assert_eq!(counts.len(), 8, "{counts:?}");
        for (n, n_proved) in counts.values() {
            assert!(n * 10 >= n_all && n_proved * 100 >= n * 95, "{counts:?}");
        }
    }
    assert!(n_proved * 2 >= n_all, "{n_proved} of {n_all}");
}

/// No mutant is proved unless it is equal. The proofs of these charts merge values that are equal step by step, or need facts about reachable situations.
#[test]
fn no_mutant_of_a_random_chart_that_differs_is_proved() {
    if tools::c_compiler().is_none() {
        println!("skipped: no C compiler is installed");
        return;
    }
    let base = Features { max_steps: 12, ..Features::everything().without_statecharts() };
    let n_charts = if rounds(0, 1) > 0 { 15 } else { 3 };
    let subject = |seed: &u64| {
        let net = random_net(*seed, &base.some(*seed));
        let package = emitted(&net, Style::Bits, Io::Members).expect("the style supports it");
        let changes = changes(&package);
        (*seed, net, package, changes)
    };
    // Every second one evolves until it is stable.
    let seeds = [54, 9, 55, 15, 34, 16, 29, 17, 24, 18, 39, 19, 23, 41, 26];
    let subjects: Vec<_> = seeds.iter().take(n_charts).map(subject).collect();
    let mut random = Random::new(9);
    let numbers = 0..rounds(8, 900) as usize;
    let mutants: Vec<_> = numbers
        .map(|at| {
            let subject = &subjects[at % subjects.len()];
            (subject, random.pick(&subject.3).expect("C has tokens").clone())
        })
        .collect();
    let proved = in_parallel(&mutants, |((seed, net, package, _), change)| {
        let mut mutant = package.clone();
        mutant.files[change.file].text.replace_range(change.from..change.to, &change.with);
        let is_proved = proved(net, &mutant).is_ok();
        if is_proved && let Some(why) = difference(net, &mutant) {
            let line = package.files[change.file].text[..change.from].matches('\n').count() + 1;
            panic!("proved, but different: seed {seed}, line {line}, {change:?}: {why}");
        }
        is_proved
    });
    let n_proved = proved.iter().filter(|it| **it).count();
    println!("{n_proved} of {} mutants are proved and equal", mutants.len());
    // In two of these charts, most steps are never active, so many changes have no effect.
    assert!(n_proved < mutants.len(), "some changes have an effect");
}

/// A bit that never changes in one case of the proof may change in another one.
#[test]
fn what_a_case_never_changes_is_not_a_constant() {
    let base = Features { max_steps: 12, ..Features::everything().without_statecharts() };
    let net = random_net(16, &base.some(16));
    let package = emitted(&net, Style::Bits, Io::Members).expect("the style supports it");
    assert_eq!(proved(&net, &package), Ok(()));
    let done = "self->s4_task == 1U";
    let wrong = changed(&package, "own.c", done, "self->s4_task == 3U");
    assert!(proved(&net, &wrong).is_err(), "s4 is active in some states");
}

/// A reaction of more micro-steps than could be unrolled, with events, edges and a list in each.
#[test]
fn an_evolution_is_proved_check_by_check() {
    let steps = 12;
    let mut text = "chart own {
    evolution stable limit 2000
    input go
    event e
    internal event more
    output done
    var n: int 0..1000
    initial step s0
"
    .to_owned();
    for at in 1..steps {
        let output = if at == steps - 1 { "done; " } else { "" };
        text += &format!("    step s{at} {{ {output}entry {{ n := n + 1 }} }}\n");
    }
    text += "    s0 -> s1 on e when rise(go) do { raise more }\n";
    text += "    s1 -> s2 on more\n";
    for at in 2..steps - 1 {
        text += &format!("    s{at} -> s{} when go\n", at + 1);
    }
    text += &format!("    s{} -> s0 when not go\n}}\n", steps - 1);
    let net = chart("own.graf", &text);
    let package = emitted(&net, Style::Bits, Io::Members).expect("the style supports it");
    assert_eq!(proved(&net, &package), Ok(()));
    for (old, new) in [
        ("more = self->more_pending;", "more = false;"),
        ("again = any && (micro_steps != 2000);", "again = any && (micro_steps != 1999);"),
        ("self->go_before = in->go;", "self->go_before = false;"),
    ] {
        let wrong = changed(&package, "own.c", old, new);
        assert!(proved(&net, &wrong).is_err(), "{new}");
    }
}

/// The text of `own.c`, or the header, with a change.
fn changed(package: &Package, file: &str, old: &str, new: &str) -> Package {
    let mut package = package.clone();
    let mut n = 0;
    for one in package.files.iter_mut().filter(|one| one.name == file) {
        n += one.text.matches(old).count();
        one.text = one.text.replacen(old, new, 1);
    }
    assert!(n > 0, "`{old}` is not in {file}:\n{}", package.files[1].text);
    package
}

#[test]
fn edits_without_an_effect_are_proved() {
    let net = chart("lights.graf", LIGHTS);
    let package = emitted(&net, Style::Switch, Io::Members).expect("the style supports it");
    for (old, new) in [
        (
            "own_in_t *in, uint16_t dt, own_out_t *out)\n{\n",
            "own_in_t *in, uint16_t dt, own_out_t *out)\n{\n    int unused = 3;\n    while (unused > 0) { --unused; }\n    (void)unused;\n",
        ),
        ("if (in->ped) {", "if (!!in->ped && (1 | dt) != 0) {"),
        (
            "    out->green = state_go == OWN_go;\n",
            "    if (state_go != OWN_go) {\n        out->green = false;\n    } else {\n        out->green = true;\n    }\n",
        ),
        ("(int)self->time_go >= 2000", "!(self->time_go < 2000)"),
        ("(int)self->time_go >= 2000", "self->time_go / 10u > 199"),
        (
            "own_in_t *in, uint16_t dt, own_out_t *out)\n{\n",
            "own_in_t *in, uint16_t dt, own_out_t *out)\n{\n    static const uint8_t row[4] = {0U};\n    const uint8_t *at = &row[in->car ? 1 : 2];\n    (void)at[1];\n",
        ),
    ] {
        let edited = changed(&package, "own.c", old, new);
        if let Err(why) = proved(&net, &edited) {
            panic!("`{new}`: {why}");
        }
    }
}

#[test]
fn a_text_that_differs_or_is_undefined_is_not_proved() {
    let net = chart("lights.graf", LIGHTS);
    let package = emitted(&net, Style::Switch, Io::Members).expect("the style supports it");
    let body = "own_in_t *in, uint16_t dt, own_out_t *out)\n{\n";
    let with = |line: &str| format!("{body}    {line}\n");
    let lines = [
        // Differs in one state, for one input, for one number of ticks, or later.
        with("if (self->n == 7) { self->n = 6; }"),
        with("if (dt == 777U && in->car) { self->time_go = 0; }"),
        with("static int calls = 0; if (++calls > 1000) { return; }"),
        with("if (self->state_go == OWN_slow && in->ped) { self->state_go = OWN_stop; }"),
        // Undefined in one state.
        with("{ int big = 32767; big += self->n > 8 ? 1 : 0; (void)big; }"),
        with("{ int table[9] = {0}; (void)table[self->n]; }"),
        with("{ int none; (void)(in->car ? none : 0); }"),
        with("{ int by = self->n == 9 ? 0 : 1; (void)(7 / by); }"),
        with("{ const own_t *other = in->car ? self : NULL; (void)other->n; }"),
        with("(void)(&in->ped)[1];"),
        with(
            "{ static const uint8_t row[4] = {0U}; const uint8_t *at = &row[in->car ? 3 : 2]; (void)at[1]; }",
        ),
        with(
            "{ static const uint8_t two[2][2] = {{0U}}; const uint8_t *at = &two[0][1]; (void)at[1]; }",
        ),
        with("if (own_no_value(in)) { (void)self; }"),
        // Writes to objects that it must not change, or reads objects that may change.
        with("((own_in_t *)in)->ped = false;"),
        with("own_later_n = self->n;"),
        with("if (own_watched) { (void)self; }"),
        // A condition whose second operand changes what the first one read.
        with("if (self->state_go == OWN_go && own_bump(self, in)) { (void)self; }"),
        // Objects that are gone, or whose declaration was jumped over.
        with(
            "{ uint8_t *p; { uint8_t x = 1U; p = &x; } { uint8_t y = 7U; (void)y; self->n = *p; } }",
        ),
        with(
            "switch (self->state_go) { case OWN_go: ; uint8_t x = 0U; (void)x; break; case OWN_slow: ; uint8_t y = 5U; x = 7U; self->n = y; break; default: break; }",
        ),
        // Constants.
        with("{ const uint8_t k = 5U; *(uint8_t *)&k = 7U; self->n = k; }"),
        with("if (own_table[0] != 1U) { self->n = 9; }"),
        with("if (own_elsewhere[0] == 0U) { (void)self; } else { self->n = 9; }"),
        with("{ uint8_t v[2]; if (&v[0] == v) { self->n = 3; } }"),
        // Differs on one kind of machine only.
        with("if ((char)200 < 0) { self->n = 3; }"),
        with("if ((char)200 > 0) { self->n = 3; }"),
        with("if ((long)-1 > 0U) { self->n = 3; }"),
        // Does not end.
        with("while (in->car) { }"),
    ];
    let helpers = "static const uint8_t own_table[1] = {2U};
static const uint8_t own_table[1];
extern const uint8_t own_elsewhere[1];
static int own_later_n;
static volatile bool own_watched;
static bool own_no_value(const own_in_t *in) { if (in->ped) { return false; } }
static bool own_bump(own_t *self, const own_in_t *in) { if (in->car && in->ped) { self->state_go = OWN_stop; } return true; }
void own_step(";
    let package = changed(&package, "own.c", "void own_step(", helpers);
    if let Err(why) = proved(&net, &package) {
        panic!("functions that nothing calls: {why}");
    }
    for new in &lines {
        let edited = changed(&package, "own.c", body, new);
        assert!(proved(&net, &edited).is_err(), "{new}");
    }
    for (old, new) in [
        ("(int)self->time_go >= 2000", "(int)self->time_go > 2000"),
        ("(int)self->time_go >= 2000", "(int)self->time_go >= 1999"),
        ("self->state_go = state_go;\n", ""),
        ("out->green = state_go == OWN_go;\n", ""),
        ("out->green = state_go == OWN_go;\n", "out->green = self->state_go != OWN_slow;\n"),
        ("time_go = 0;", "time_go = 1;"),
    ] {
        let edited = changed(&package, "own.c", old, new);
        assert!(proved(&net, &edited).is_err(), "{new}");
    }
    // A query with a wrong answer, one that changes the instance, a missing one, and wrong values after reset.
    let head = "static inline bool own_active_slow(const own_t *self)";
    let edited = changed(
        &package,
        "own.h",
        head,
        "bool own_slow(const own_t *self); static inline bool own_hidden(const own_t *self)",
    );
    assert!(proved(&net, &edited).is_err(), "a query that is not there");
    let edited = changed(
        &package,
        "own.h",
        head,
        "static inline bool own_active_slow(own_t *self) { self->n = 0; return self->state_go == OWN_slow; }\nstatic inline bool own_hidden(const own_t *self)",
    );
    assert!(proved(&net, &edited).is_err(), "a query that changes the instance");
    let edited =
        changed(&package, "own.h", "return self->n;", "return self->n == 7 ? 0 : self->n;");
    assert!(proved(&net, &edited).is_err(), "the variable");
    let edited = changed(&package, "own.h", "return self->state_go == OWN_slow;", "return false;");
    assert!(proved(&net, &edited).is_err(), "the query");
    let edited = changed(&package, "own.c", "out->green = true;", "out->green = false;");
    assert!(proved(&net, &edited).is_err(), "the reset");
}

/// Calls from lists, steps and tasks, and during an emergency; conditions that an edge, a receptivity and an action read.
const CALLS: &str = "chart calls {
    tick 10 ms
    evolution single
    conflict priority
    input go, stop
    extern condition ready(), level(): int 0..300, door()
    extern action move(int 0..9, bool), beep(), note(int -5..5)
    output lamp
    var n: int 0..20
    emergency stop
    initial step rest { lamp if level() > 200 }
    step work {
        move(n, go)
        budget 5
        task one cost 2 { n := n + 1; note(n - 3) }
        task two cost 3 { beep(); note(1); if n > 3 { beep() } }
    }
    step wait { move(7, not go) if n > 2 }
    rest -> work when go and ready() do { note(n); beep() }
    work -> wait when work.done and (level() < 100 or ready())
    wait -> rest when rise(door()) or n > 15 do { beep(); note(2); n := n + 1 }
}
";

/// The package with another text of `own.c`.
fn with_source(package: &Package, text: &str) -> Package {
    let mut edited = package.clone();
    for file in edited.files.iter_mut().filter(|file| file.name == "own.c") {
        text.clone_into(&mut file.text);
    }
    edited
}

/// All changes of one line of `own.c`: a call that is lost, made twice, made with another argument or after the next one; a condition that is called twice.
fn wrong_calls(package: &Package) -> Vec<String> {
    let text = &package.files.iter().find(|file| file.name == "own.c").expect("a file").text;
    let lines: Vec<&str> = text.lines().collect();
    let is_call =
        |line: &str| ["move(", "beep(", "note("].iter().any(|name| line.trim().starts_with(name));
    let mut all = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let with = |changed: &str| {
            let mut lines = lines.clone();
            lines[at] = changed;
            lines.join("\n") + "\n"
        };
        if is_call(line) {
            all.extend([with(";"), with(&format!("{line}{line}"))]);
            if !line.contains("()") {
                all.push(with(&line.replacen('(', "(1 - ", 1)));
            }
            if lines.get(at + 1).is_some_and(|next| is_call(next) && next != line) {
                let mut lines = lines.clone();
                lines.swap(at, at + 1);
                all.push(lines.join("\n") + "\n");
            }
        } else if let Some((_, call)) = line.split_once(" = ").filter(|it| it.1.ends_with("();")) {
            all.push(with(&format!("{line} (void){call}")));
        }
    }
    all
}

#[test]
fn calls_and_tasks_are_proved_and_wrong_calls_are_not() {
    let without_tasks: Vec<&str> =
        CALLS.lines().filter(|it| !it.contains("task ") && !it.contains("budget")).collect();
    let without_tasks = without_tasks.join("\n");
    for (text, styles) in [
        (CALLS, &[Style::Bits][..]),
        (&without_tasks, &[Style::Switch, Style::Tables, Style::Bits]),
    ] {
        let net = chart("calls.graf", text);
        for style in styles {
            let Some(package) = emitted(&net, *style, Io::Members) else { continue };
            if let Err(why) = proved(&net, &package) {
                panic!("{}: {why}", package.style);
            }
            let wrong = wrong_calls(&package);
            assert!(wrong.len() >= 12, "{}: {} mutants", package.style, wrong.len());
            for mutant in wrong {
                let edited = with_source(&package, &mutant);
                assert!(proved(&net, &edited).is_err(), "{}:\n{mutant}", package.style);
            }
            // At reset, at a stop, and a function of the same name that does nothing.
            let init = "void own_init(own_t *self, own_out_t *out)\n{\n";
            let stop = "void own_stop(own_t *self, own_out_t *out)\n{\n";
            for (file, old, new) in [
                ("own.c", init, format!("{init}    beep();\n")),
                ("own.c", init, format!("{init}    (void)ready();\n")),
                ("own.h", stop, format!("{stop}    beep();\n")),
                ("own.c", init, format!("void beep(void) {{ }}\n{init}")),
            ] {
                let edited = changed(&package, file, old, &new);
                assert!(proved(&net, &edited).is_err(), "{}: {new}", package.style);
            }
        }
    }
}

/// A member that no proof relates to the chart, and that `own_init` does not set, has no value in the first reaction, whatever the reaction does with it.
#[test]
fn a_member_that_was_never_set_must_not_be_read() {
    let net = chart("lights.graf", LIGHTS);
    let mut package = emitted(&net, Style::Switch, Io::Members).expect("the style supports it");
    // `calm.t` is never read, so the proof has no time for it.
    let calm = net.steps.iter().find(|(_, step)| step.name.text == "calm").expect("a step").0;
    let hint = package.representation.as_mut().expect("the style has a representation");
    hint.state.push((Place::member("extra"), Holds::Piece(Origin::Elapsed(calm), 0)));
    let package = changed(&package, "own.h", "} own_t;", "    uint8_t extra;\n} own_t;");
    assert!(proved(&net, &package).is_ok(), "nothing uses it: {:?}", proved(&net, &package));
    let body = "own_in_t *in, uint16_t dt, own_out_t *out)\n{\n";
    let with = |lines: &str| changed(&package, "own.c", body, &format!("{body}    {lines}\n"));
    let written = with("self->extra = 1U; self->extra = (uint8_t)(self->extra & 2U);");
    assert!(proved(&net, &written).is_ok(), "{:?}", proved(&net, &written));
    for lines in [
        "self->extra = (uint8_t)(self->extra & 0U);",
        "if (self->extra > 3U) { (void)in; }",
        "if (in->car) { self->extra = 0U; } if (dt > 5U) { (void)self->extra; }",
    ] {
        let why = proved(&net, &with(lines)).expect_err("it reads what was never set");
        assert!(why.contains("never set"), "{lines}: {why}");
    }
}
