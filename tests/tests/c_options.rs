//! The proof of emitted C with the options that add something around a reaction: the gate, the safe state, the trace ring; and with extern conditions of
//! statecharts. Single changes of the lines that they add must stay unproved.

use crate::c_mutations::{changes, difference};
use grafsynth_backend_c::{Io, Options, Package, Style, emit};
use grafsynth_driver::c_proof::prove_c;
use grafsynth_engines::tools;
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::Random;
use grafsynth_tests::{chart, in_parallel, rounds, small_limits};
use grafsynth_verify::{Limits, facts};

/// Times, a number and two components; an output that is on when it is safe.
const GRAFCET: &str = "chart pump {
    tick 10 ms
    conflict priority
    input start, full, stop
    output run, warn
    output brake safe on
    var n: int 0..5
    initial step idle { brake }
    step fill { run; entry { n := n + 1 } }
    step wait
    idle -> fill when start and n < 5
    fill -> wait when full
    wait -> idle after 2 s
    initial step calm
    step late { warn if n > 2 }
    calm -> late when fill.active after 5 s
    late -> calm when stop
}
";

/// A statechart with a queue, a history and a time.
const STATECHART: &str = "chart door {
    tick 100 ms
    conflict inner-first
    queue 2
    event push, pull
    input light
    output open, lamp
    var n: int 0..3
    initial state shut
    state ajar { open
        history last -> low
        initial state low
        state high { lamp; entry { raise pull } }
        low -> high on push when n < 3 do { n := n + 1 }
        high -> low after 1 s }
    shut -> last on push when light
    ajar -> shut on pull when not light
}
";

/// Extern conditions: read once or twice in a check, in several checks of a reaction, and after the last one.
const ASKS: &str = "chart asks {
    conflict inner-first
    event go, back
    extern condition ready(), warm()
    output lamp
    var n: int 0..9
    initial state off
    state on {
        lamp if warm()
        initial state low
        state high
        low -> high on go when ready()
        high -> low on go when ready() or warm()
    }
    off -> on on go when ready()
    on -> off on back when not warm()
    off -> on when ready() and n < 3 do { n := n + 1 }
}
";

/// Several micro-steps in a reaction, which are a loop in the style `bits` and in byte code; a counted step, which is hidden and always active.
const STABLE: &str = "chart chain {
    tick 10 ms
    conflict priority
    evolution stable
    input go, back
    output a, b
    initial step s0
    step s1 { a }
    step s2
    step s3 { b }
    s0 -> s1 when go
    s1 -> s2 when back
    s2 -> s3 when go
    s3 -> s0 after 1 s
}
";

fn emitted(net: &Valid<Net>, options: Options) -> Package {
    let options = Options { prefix: Some("own".to_owned()), ..options };
    emit(net, &facts(net, &small_limits()), &options).expect("the style supports it")
}

fn proved(net: &Valid<Net>, package: &Package) -> Result<(), String> {
    prove_c(net, &facts(net, &small_limits()), package, &Limits::default()).map(|_| ())
}

/// The sets of options, each with a name.
fn option_sets() -> Vec<(&'static str, Options)> {
    let plain = Options::default;
    vec![
        ("gate", Options { gate: true, ..plain() }),
        ("gate and words", Options { gate: true, io: Io::Words, ..plain() }),
        ("safe state", Options { safe_state: true, ..plain() }),
        ("gate and safe state", Options { gate: true, safe_state: true, ..plain() }),
        ("trace ring", Options { trace: Some(5), ..plain() }),
        ("trace ring and safe state", Options { trace: Some(3), safe_state: true, ..plain() }),
    ]
}

#[test]
fn charts_with_each_option_are_proved() {
    let mut all = Vec::new();
    for (name, text) in [("pump.graf", GRAFCET), ("door.graf", STATECHART)] {
        let net = chart(name, text);
        for style in [Style::Switch, Style::Tables, Style::Bits] {
            for (what, options) in option_sets() {
                let options = Options { style, prefix: Some("own".to_owned()), ..options };
                if let Ok(package) = emit(&net, &facts(&net, &small_limits()), &options) {
                    all.push((net.clone(), what, package));
                }
            }
        }
    }
    let answers = in_parallel(&all, |(net, _, package)| proved(net, package));
    for ((_, what, package), answer) in all.iter().zip(answers) {
        if let Err(why) = answer {
            let (style, text) = (package.style, &package.files[1].text);
            panic!("{} as {style} with {what}: {why}\n{text}", package.prefix());
        }
    }
    assert!(all.len() >= 24, "{}", all.len());
}

/// The charts and styles with callbacks, alone and with other options.
fn packages_with_callbacks() -> Vec<(Valid<Net>, String, Package)> {
    let mut all = Vec::new();
    let charts = [("pump.graf", GRAFCET), ("door.graf", STATECHART), ("chain.graf", STABLE)];
    for (name, text) in charts {
        let net = chart(name, text);
        let facts = facts(&net, &small_limits());
        for style in [Style::Switch, Style::Tables, Style::Bits, Style::Program] {
            for gate in [false, true] {
                for safe_state in [false, true] {
                    let trace = (!gate).then_some(3);
                    let prefix = Some("own".to_owned());
                    let options = Options {
                        style,
                        gate,
                        safe_state,
                        trace,
                        prefix,
                        callbacks: true,
                        ..Options::default()
                    };
                    if let Ok(package) = emit(&net, &facts, &options) {
                        let what = format!(
                            "{name} as {}, gate {gate}, safe state {safe_state}",
                            style.name()
                        );
                        all.push((net.clone(), what, package));
                    }
                }
            }
        }
    }
    all
}

#[test]
fn charts_with_callbacks_are_proved() {
    let all = packages_with_callbacks();
    let answers = in_parallel(&all, |(net, _, package)| proved(net, package));
    let wrong: Vec<String> = (all.iter().zip(answers))
        .filter_map(|((_, what, _), answer)| Some(format!("{what}: {}", answer.err()?)))
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(all.len() >= 36, "{}", all.len());
}

/// A call is left out, is there twice, or has another argument; one has another condition; no reaction makes any.
#[test]
fn a_wrong_callback_is_not_proved() {
    let all = packages_with_callbacks().into_iter();
    for (net, what, package) in all.filter(|(_, what, _)| !what.contains("true")) {
        let file = package.files.iter().find(|file| file.name.ends_with(".c"));
        let text = file.map(|file| file.text.clone()).unwrap_or_default();
        let calls: Vec<&str> = text
            .lines()
            .filter(|line| line.contains("own_activated(") || line.contains("own_enabled("))
            .collect();
        assert!(calls.len() >= 6, "{text}");
        let whole = text.split("static void own_notify").nth(1).unwrap_or_default();
        let whole = whole.split("\n}\n").next().unwrap_or_default().to_owned();
        let mut mutants: Vec<(String, String)> = Vec::new();
        for (at, call) in calls.iter().enumerate() {
            let other = calls[(at + 1) % calls.len()];
            mutants.push(match at % 3 {
                0 => (format!("{call}\n"), String::new()),
                1 => ((*call).to_owned(), format!("{call}\n{call}")),
                _ => ((*call).to_owned(), other.to_owned()),
            });
        }
        for (old, new) in
            [("before->", "self->"), ("!=", "=="), (" && !(", " && ("), (" && !(", " || !(")]
        {
            let new = whole.replacen(old, new, 1);
            assert_ne!(new, whole, "{old}");
            mutants.push((whole.clone(), new));
        }
        // Also a call where nothing is reported yet, and one of the reset.
        mutants.push(("before = *self;".to_owned(), format!("before = *self;\n{}", calls[0])));
        mutants.push(("    own_notify(self, &before);\n".to_owned(), String::new()));
        mutants
            .push(("before = *self;".to_owned(), "before = *self;\n before = before;".to_owned()));
        let answers =
            in_parallel(&mutants, |(old, new)| proved(&net, &changed(&package, old, new)));
        for ((old, new), answer) in mutants.iter().zip(answers) {
            let is_same = new.contains("before = before");
            assert_eq!(answer.is_ok(), is_same, "{what}: `{old}` becomes `{new}`: {answer:?}");
        }
    }
}

/// The text with a change, which must apply.
fn changed(package: &Package, old: &str, new: &str) -> Package {
    let mut package = package.clone();
    let file = package.files.iter_mut().find(|file| file.text.contains(old));
    let file = file.unwrap_or_else(|| panic!("`{old}` is not in the text"));
    file.text = file.text.replacen(old, new, 1);
    package
}

fn stays_open(net: &Valid<Net>, package: &Package, mutants: &[(&str, &str)]) {
    assert_eq!(proved(net, package), Ok(()), "{}", package.files[1].text);
    let answers = in_parallel(mutants, |(old, new)| proved(net, &changed(package, old, new)));
    for ((old, new), answer) in mutants.iter().zip(answers) {
        assert!(answer.is_err(), "proved: `{old}` becomes `{new}`\n{}", package.files[1].text);
    }
}

#[test]
fn a_wrong_gate_is_not_proved() {
    for (name, text) in [("pump.graf", GRAFCET), ("door.graf", STATECHART)] {
        let net = chart(name, text);
        let options = Options { style: Style::Bits, gate: true, ..Options::default() };
        let package = emitted(&net, options);
        let input = if name == "pump.graf" { "full" } else { "light" };
        let same = format!("(in->{input} == self->gate_in.{input})");
        let is_true = "true".to_owned();
        let header = package.files[0].text.clone();
        let compares = header.matches(&same).count();
        assert_eq!(compares, 1, "{header}");
        stays_open(
            &net,
            &package,
            &[
                ("self->gate == 2U", "self->gate >= 1U"),
                ("self->gate == 2U", "self->gate != 2U"),
                (same.as_str(), is_true.as_str()),
                ("(dt == self->gate_dt)", "true"),
                ("self->gate = 0U;", "self->gate = 2U;"),
                ("self->gate = 0U;", ""),
                ("self->gate = 1U;", "self->gate = 2U;"),
                ("self->gate = 1U;", ""),
                ("self->gate_in = *in;", ""),
                ("self->gate_dt = dt;", ""),
                ("changes == 0U", "changes <= 1U"),
                ("changes |= ", "changes = "),
                ("changes |= ", "changes &= "),
                ("before[at] ^ now[at]", "before[at] ^ before[at]"),
                (
                    "uint16_t at = 0U; at < (uint16_t)sizeof(own_t)",
                    "uint16_t at = 1U; at < (uint16_t)sizeof(own_t)",
                ),
                ("self->gate = 2U;", "self->gate = 3U;"),
                ("self->gate != 0U", "self->gate != 1U"),
                ("    own_reaction(self, in, dt, out);\n", ""),
                (
                    "    own_reaction(self, in, dt, out);\n",
                    "    own_reaction(self, in, dt, out);\n    own_reaction(self, in, dt, out);\n",
                ),
                ("own_reaction(self, in, dt, out);", "own_reaction(self, in, 1U, out);"),
            ],
        );
    }
}

#[test]
fn a_wrong_safe_state_is_not_proved() {
    let net = chart("pump.graf", GRAFCET);
    let options = Options { style: Style::Bits, safe_state: true, ..Options::default() };
    let package = emitted(&net, options);
    stays_open(
        &net,
        &package,
        &[
            ("self->intact = 0xA5U;", "self->intact = 0x5AU;"),
            ("self->intact = 0xA5U;", ""),
            ("if (self->intact != 0xA5U)", "if (self->intact == 0xA5U)"),
            ("return self->intact != 0xA5U", "return self->intact == 0xA5U"),
            ("self->intact = 0x5AU;\n}", "}"),
            ("!own_intact(self)", "own_intact(self)"),
            (
                "out->brake = true;\n        if (self->intact",
                "out->brake = false;\n        if (self->intact",
            ),
            ("return true;", "return false;"),
            ("self->n > 5", "self->n > 4"),
            ("        return;\n", ""),
            ("active != 1U", "active == 1U"),
        ],
    );
}

#[test]
fn a_wrong_trace_ring_is_not_proved() {
    for (name, text) in [("pump.graf", GRAFCET), ("door.graf", STATECHART)] {
        let net = chart(name, text);
        let options = Options { style: Style::Bits, trace: Some(4), ..Options::default() };
        let package = emitted(&net, options);
        stays_open(
            &net,
            &package,
            &[
                ("trace->next >= OWN_TRACE_PLACES", "trace->next > OWN_TRACE_PLACES"),
                ("trace->next = 0U;", ""),
                ("self->trace.next = 0;", "self->trace.next = 4;"),
                ("self->trace.next = 0;", ""),
                ("self->trace.reactions = 0;", ""),
                ("++trace->next;", "++trace->next; self->n = 1;"),
            ],
        );
    }
}

#[test]
fn extern_conditions_of_statecharts_are_proved_and_wrong_calls_are_not() {
    let net = chart("asks.graf", ASKS);
    for style in [Style::Switch, Style::Bits] {
        let package = emitted(&net, Options { style, ..Options::default() });
        let of = if style == Style::Bits { "" } else { "scan." };
        let mutants = [
            ("@asked_ready = true;", ""),
            ("@asked_ready = true;", "@asked_ready = false;"),
            ("asked_ready = false;", "asked_ready = true;"),
            ("!@asked_ready", "true"),
            ("!@asked_warm", "true"),
            ("@cond_ready = ready();", "(void)ready();"),
            ("@cond_ready = ready();", "@cond_ready = !ready();"),
            ("@cond_ready = ready();", "@cond_ready = warm();"),
        ];
        let mutants = mutants.map(|(old, new)| (old.replace('@', of), new.replace('@', of)));
        let mutants: Vec<(&str, &str)> =
            mutants.iter().map(|(old, new)| (old.as_str(), new.as_str())).collect();
        stays_open(&net, &package, &mutants);
    }
}

/// No mutant of a text with options is proved unless it is equal.
#[test]
fn no_mutant_of_a_text_with_options_that_differs_is_proved() {
    if tools::c_compiler().is_none() {
        return;
    }
    let mut subjects = Vec::new();
    for (name, text) in [("pump.graf", GRAFCET), ("door.graf", STATECHART)] {
        let net = chart(name, text);
        for (_, options) in option_sets() {
            let package = emitted(&net, Options { style: Style::Bits, ..options });
            let changes = changes(&package);
            subjects.push((net.clone(), package, changes));
        }
    }
    let mut random = Random::new(12);
    let numbers = 0..rounds(12, 1_200) as usize;
    let mutants: Vec<_> = numbers
        .map(|at| {
            let (net, package, changes) = &subjects[at % subjects.len()];
            (net, package, random.pick(changes).expect("C has tokens").clone())
        })
        .collect();
    let proved = in_parallel(&mutants, |(net, package, change)| {
        let mut mutant = (*package).clone();
        mutant.files[change.file].text.replace_range(change.from..change.to, &change.with);
        let is_proved = proved(net, &mutant).is_ok();
        if is_proved && let Some(why) = difference(net, &mutant) {
            let text = &package.files[change.file].text;
            let line = text[..change.from].matches('\n').count() + 1;
            let shown = text.lines().nth(line - 1).unwrap_or_default();
            panic!("proved, but different: {}, {change:?}: `{shown}`: {why}", package.prefix());
        }
        is_proved
    });
    let n_proved = proved.iter().filter(|it| **it).count();
    assert!(n_proved * 2 < mutants.len(), "{n_proved} of {}", mutants.len());
}

/// A statechart in whose text edits can hide behind one value of a number.
const LEVELS: &str = "chart own {
    conflict inner-first
    queue 2
    event go, back
    extern condition ready()
    input level: int 0..60000
    output lamp
    initial state rest { entry { raise back } }
    state run { lamp if level > 100 }
    state mid
    rest -> mid on go when ready()
    mid -> run when ready()
    run -> rest on back
}
";

/// Each edit leaves the right values wherever a check looked for them once: in locals after the last check, in a chart that is stopped, in bytes.
#[test]
fn edits_that_show_only_where_no_value_is_expected_are_not_proved() {
    let end = "        }\n    }\n    out->lamp = self->run";
    let at_end = |statement: &str, read: &str| {
        let text =
            format!("        }}\n        {statement}\n    }}\n    out->lamp = {read} || self->run");
        vec![(end, text)]
    };
    let condition = "&& again; ++round";
    let again = "&& again || round == 200U; ++round";
    let mut late = at_end("if (!again && in->level == 31337U) { round = 199U; }", "false");
    late.push((condition, again.to_owned()));
    let mut lost = at_end("if (in->level == 31337U) { mine = none; }", "mine.level > 200");
    lost.push((
        "bool again = false;",
        "bool again = false; own_in_t mine = *in; own_in_t none;".to_owned(),
    ));
    let mut asked = at_end(
        "if (asked_ready != 0U && in->level == 31337U) { asked_ready = 2U; }",
        "asked_ready == 2U",
    );
    asked.push(("bool asked_ready = false;", "uint8_t asked_ready = 0U;".to_owned()));
    let lost_in_condition = vec![
        (condition, "&& (in->level == 31337U ? (mine = none, again) : again); ++round".to_owned()),
        lost[1].clone(),
        ("out->lamp = self->run", "out->lamp = mine.level > 200 || self->run".to_owned()),
    ];
    let ended_object = vec![
        ("uint8_t round = 0;", "uint8_t round = (uint8_t)((p = &round), 0);".to_owned()),
        ("bool again = false;", "bool again = false; const uint8_t *p = 0;".to_owned()),
        ("out->lamp = self->run", "out->lamp = *p == 77U || self->run".to_owned()),
    ];
    let of_levels = vec![
        lost_in_condition,
        ended_object,
        at_end("if (!again && in->level == 31337U) { micro_steps = 99; }", "micro_steps == 99U"),
        at_end("if (!again && in->level == 31337U) { event = 9; }", "event == 9U"),
        late,
        lost,
        asked,
    ];
    let react = "dt, own_out_t *out)\n{\n    if ((self->gate != 0U)";
    let first = |statement: &str| {
        vec![(
            react,
            format!("dt, own_out_t *out)\n{{\n    {statement}\n    if ((self->gate != 0U)"),
        )]
    };
    let last = |statement: &str| {
        let outputs = "out->run = state_idle";
        vec![(outputs, format!("if (dt == 31337U) {{ {statement} }}\n    {outputs}"))]
    };
    let bytes = "(const uint8_t *)self == (const uint8_t *)&self->state_idle";
    let of_pump = vec![
        first("if (self->intact == 0x5AU) { out->run = true; return; }"),
        first("if (self->intact == 0x5AU) { self->intact = 0xA5U; }"),
        vec![("if (changes == 0U)", format!("if (changes == 0U || {bytes})"))],
        // The inputs of the last reaction are lost, or exchanged.
        last("own_in_t none; self->gate_in = none;"),
        last("self->gate_in.start = self->gate_in.full;"),
    ];
    let levels = chart("own.graf", LEVELS);
    let pump = chart("pump.graf", GRAFCET);
    let bits = Options { style: Style::Bits, ..Options::default() };
    let both = Options { gate: true, safe_state: true, ..Options::default() };
    for (net, options, mutants) in [(levels, bits, of_levels), (pump, both, of_pump)] {
        let package = emitted(&net, options);
        assert_eq!(proved(&net, &package), Ok(()), "{}", package.files[1].text);
        let answers = in_parallel(&mutants, |edits| {
            let edit = |text, (old, new): &(&str, String)| changed(&text, old, new);
            proved(&net, &edits.iter().fold(package.clone(), edit))
        });
        for (edits, answer) in mutants.iter().zip(answers) {
            assert!(answer.is_err(), "proved: {edits:?}\n{}", package.files[1].text);
        }
    }
}
