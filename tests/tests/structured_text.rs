//! Structured text against the same computation in Rust: operators on bits, loops that are left early, times that change.

#![allow(clippy::print_stdout, reason = "tests say what they skip")]

use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::source::Sources;
use grafsynth_engines::{Availability, Job};
use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, Valid};
use grafsynth_sim::{Random, Stimulus, Trace, compare};
use grafsynth_tests::rounds;

fn net_of(text: &str) -> Valid<Net> {
    let mut sources = Sources::default();
    let main = sources.add("a.st", text);
    match read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()) {
        (Some(Design::Net(design)), _) => design.net,
        (Some(Design::Logic(_)) | None, found) => panic!("{found:#?}\n{text}"),
    }
}

/// The findings of a text that is not a valid chart.
fn refusals(text: &str) -> Vec<(&'static str, String)> {
    let mut sources = Sources::default();
    let main = sources.add("a.st", text);
    let (_, found) = read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default());
    found
        .iter()
        .filter(|one| one.is_error())
        .map(|one| (one.code.id, one.message.clone()))
        .collect()
}

/// The trace of a stimulus; compiled C must give the same trace.
fn trace_of(net: &Valid<Net>, csv: &str) -> Trace {
    let (stimulus, found) = Stimulus::parse_csv(net, FileId(0), csv);
    let stimulus = stimulus.unwrap_or_else(|| panic!("{found:#?}"));
    let trace = grafsynth_driver::run::net_trace(net, &stimulus);
    let facts = grafsynth_verify::structural_facts(net);
    let engine = grafsynth_engines::named("c").expect("there is an engine of that name");
    match engine.availability() {
        Availability::Here => {
            let got = engine
                .run(&Job { net, facts: &facts, stimulus: &stimulus })
                .unwrap_or_else(|why| panic!("{why:?}"));
            assert_eq!(compare(&trace, &got), None);
        }
        Availability::Missing(tool) => println!("skipped: {tool} is not here"),
    }
    trace
}

/// A column as numbers, without row 0.
fn column(trace: &Trace, name: &str) -> Vec<i64> {
    let csv = trace.to_csv();
    let mut lines = csv.lines();
    let head: Vec<&str> = lines.next().unwrap_or("").split(',').collect();
    let at = head.iter().position(|one| *one == name).unwrap_or_else(|| panic!("no {name}"));
    let value = |line: &str| {
        line.split(',').nth(at).and_then(|one| one.parse().ok()).unwrap_or_else(|| panic!("{line}"))
    };
    lines.skip(1).map(value).collect()
}

#[test]
fn bits_are_those_of_two_s_complement() {
    type Row = (&'static str, fn(u8, u8, i16) -> i64);
    let all: [Row; 26] = [
        ("a AND b", |a, b, _| i64::from(a & b)),
        ("a OR b", |a, b, _| i64::from(a | b)),
        ("a XOR b", |a, b, _| i64::from(a ^ b)),
        ("NOT a", |a, _, _| i64::from(!a)),
        ("a AND 16#0F", |a, _, _| i64::from(a & 0x0f)),
        ("a AND 2#0101_1010", |a, _, _| i64::from(a & 0x5a)),
        ("a AND NOT 16#30", |a, _, _| i64::from(a & !0x30)),
        ("a OR 16#81", |a, _, _| i64::from(a | 0x81)),
        ("a XOR 16#3C", |a, _, _| i64::from(a ^ 0x3c)),
        ("XOR(a, b, 16#FF)", |a, b, _| i64::from(a ^ b ^ 0xff)),
        ("(a AND b) OR (NOT a AND 16#70)", |a, b, _| i64::from((a & b) | (!a & 0x70))),
        ("SHL(a, 3)", |a, _, _| i64::from(a << 3)),
        ("SHL(a, 8)", |_, _, _| 0),
        ("SHR(a, 3)", |a, _, _| i64::from(a >> 3)),
        ("SHR(IN := a, N := 7)", |a, _, _| i64::from(a >> 7)),
        ("ROL(a, 3)", |a, _, _| i64::from(a.rotate_left(3))),
        ("ROR(a, 3)", |a, _, _| i64::from(a.rotate_right(3))),
        ("ROL(a, 11)", |a, _, _| i64::from(a.rotate_left(3))),
        ("ROR(a, 8)", |a, _, _| i64::from(a)),
        ("i AND 16#FF", |_, _, i| i64::from(i & 0xff)),
        ("i AND -16", |_, _, i| i64::from(i & -16)),
        ("i OR a", |a, _, i| i64::from(i | i16::from(a))),
        ("i XOR -1", |_, _, i| i64::from(!i)),
        ("NOT i", |_, _, i| i64::from(!i)),
        ("i AND j", |a, _, i| i64::from(i & (i16::from(a) - 100))),
        ("BOOL_TO_INT(a.7) + 2 * BOOL_TO_INT(a.0)", |a, _, _| {
            i64::from(a >> 7) + 2 * i64::from(a & 1)
        }),
    ];
    let outputs: String = (0..all.len()).map(|n| format!("q{n} : DINT; ")).collect();
    let body: String =
        all.iter().enumerate().map(|(n, (text, _))| format!("q{n} := {text};\n")).collect();
    let net = net_of(&format!(
        "PROGRAM p VAR_INPUT a, b : BYTE; i : INT; END_VAR VAR_OUTPUT {outputs} c : BYTE; END_VAR VAR j : INT; END_VAR
         j := a - 100;
         {body}
         c := a; c.0 := b.1; c.7 := NOT c.7; c.3 := FALSE;
         END_PROGRAM"
    ));
    let mut random = Random::new(5);
    let mut rows: Vec<(u8, u8, i16)> =
        vec![(0, 0, 0), (255, 255, -1), (1, 128, i16::MIN), (170, 85, i16::MAX)];
    for _ in 0..rounds(300, 20_000) {
        let mut any = |most: usize| random.below(most);
        rows.push((any(256) as u8, any(256) as u8, any(65_536) as u16 as i16));
    }
    let lines: String = rows.iter().map(|(a, b, i)| format!("{a},{b},{i}\n")).collect();
    let trace = trace_of(&net, &format!("a,b,i\n{lines}"));
    for (n, (text, expected)) in all.iter().enumerate() {
        for (got, (a, b, i)) in column(&trace, &format!("q{n}")).iter().zip(&rows) {
            assert_eq!(*got, expected(*a, *b, *i), "{text} of a = {a}, b = {b}, i = {i}");
        }
    }
    for (got, (a, b, _)) in column(&trace, "c").iter().zip(&rows) {
        let expected = ((a & 0x76) | (b >> 1 & 1)) | (!a & 0x80);
        assert_eq!(*got, i64::from(expected), "a = {a}, b = {b}");
    }
}

#[test]
fn bit_operators_without_a_width_are_refused_by_name() {
    for (text, what) in [
        ("x := NOT s;", "NOT of a number that is neither BYTE"),
        ("x := SHL(i, 2);", "SHL with a signed number"),
        ("x := SHR(a, s);", "SHR with a variable bit count"),
        ("x := ROL(s, 1);", "ROL of a number that is neither BYTE nor WORD"),
        ("x := a AND f;", "a bit operator cannot mix numbers and Booleans"),
        ("s.3 := f;", "a single bit can only be assigned in a BYTE"),
    ] {
        let found = refusals(&format!(
            "PROGRAM p VAR_INPUT a : BYTE; f : BOOL; i : INT; END_VAR VAR x : DINT; s : INT (0..9); END_VAR {text} END_PROGRAM"
        ));
        assert!(found.iter().any(|(_, message)| message.contains(what)), "{text}: {found:?}");
    }
}

/// A loop that searches four numbers and is left early in every possible way, in a program, in a block and in a function.
#[test]
fn loops_are_left_where_they_say() {
    let search = "
        found := -1; sum := 0; odd := 0;
        FOR k := 0 TO 3 DO
            IF v[k] = 0 THEN CONTINUE; END_IF;
            IF v[k] = wanted THEN found := k; EXIT; END_IF;
            sum := sum + v[k];
            CASE v[k] OF 1, 3, 5, 7: odd := odd + 1; END_CASE;
        END_FOR;";
    let net = net_of(&format!(
        "FUNCTION first : DINT
         VAR_INPUT a, b, c, d, wanted : DINT; END_VAR VAR k : INT; x : DINT; END_VAR
             first := -1;
             FOR k := 0 TO 3 DO
                 x := MUX(k, a, b, c, d);
                 IF x = 0 THEN CONTINUE; END_IF;
                 IF x = wanted THEN first := k; EXIT; END_IF;
             END_FOR;
             IF k > 3 THEN first := -1; RETURN; END_IF;
             first := first * 10 + k;
         END_FUNCTION
         FUNCTION_BLOCK pairs
         VAR_INPUT wanted : INT (0..15); a, b, c, d : INT (0..7); END_VAR VAR_OUTPUT spot : INT; END_VAR
         VAR v : ARRAY [0..3] OF INT (0..7); i, j : INT; END_VAR
             spot := 99;
             IF wanted = 0 THEN RETURN; END_IF;
             v[0] := a; v[1] := b; v[2] := c; v[3] := d;
             FOR i := 0 TO 2 DO
                 FOR j := i + 1 TO 3 DO
                     IF v[i] = 7 THEN EXIT; END_IF;
                     IF v[i] + v[j] = wanted THEN spot := i * 10 + j; RETURN; END_IF;
                 END_FOR;
                 spot := 50 + i;
             END_FOR;
             spot := 77;
         END_FUNCTION_BLOCK
         PROGRAM p
         VAR_INPUT a, b, c, d : INT (0..7); wanted : INT (0..7); END_VAR
         VAR_OUTPUT found, sum, odd, f, spot : INT; END_VAR
         VAR v : ARRAY [0..3] OF INT (0..7); k : INT; two : pairs; END_VAR
             v[0] := a; v[1] := b; v[2] := c; v[3] := d;
             {search}
             f := DINT_TO_INT(first(a, b, c, d, wanted));
             two(wanted := wanted, a := a, b := b, c := c, d := d, spot => spot);
         END_PROGRAM"
    ));
    let mut random = Random::new(11);
    let rows: Vec<[i64; 5]> = (0..rounds(400, 20_000))
        .map(|_| std::array::from_fn(|_| i64::try_from(random.below(8)).unwrap_or(0)))
        .collect();
    let lines: String =
        rows.iter().map(|[a, b, c, d, w]| format!("{a},{b},{c},{d},{w}\n")).collect();
    let trace = trace_of(&net, &format!("a,b,c,d,wanted\n{lines}"));
    let got: Vec<Vec<i64>> = ["found", "sum", "odd", "k", "f", "spot", "two.i", "two.j"]
        .map(|name| column(&trace, name))
        .into();
    let (mut i_kept, mut j_kept) = (0, 0);
    for (row, [a, b, c, d, wanted]) in rows.iter().enumerate() {
        let v = [*a, *b, *c, *d];
        let (mut found, mut sum, mut odd, mut last) = (-1, 0, 0, 4);
        for (k, one) in (0_i64..).zip(v) {
            if one == 0 {
                continue;
            }
            if one == *wanted {
                (found, last) = (k, k);
                break;
            }
            sum += one;
            odd += one % 2;
        }
        let f = if found < 0 { -1 } else { found * 10 + last };
        let at = pairs(v, *wanted, &mut i_kept, &mut j_kept);
        let expected = [found, sum, odd, last, f, at, i_kept, j_kept];
        let got: Vec<i64> = got.iter().map(|column| column[row]).collect();
        assert_eq!(got, expected, "v = {v:?}, wanted = {wanted}");
    }
}

/// The expected result of the block; its loop variables keep their values when the loop is left, and between calls.
fn pairs(v: [i64; 4], wanted: i64, i_kept: &mut i64, j_kept: &mut i64) -> i64 {
    if wanted == 0 {
        return 99;
    }
    for i in 0..3 {
        *i_kept = i as i64;
        let mut is_left = false;
        for j in i + 1..4 {
            *j_kept = j as i64;
            if v[i] == 7 {
                is_left = true;
                break;
            }
            if v[i] + v[j] == wanted {
                return (i * 10 + j) as i64;
            }
        }
        if !is_left {
            *j_kept = 4;
        }
    }
    *i_kept = 3;
    77
}

/// A time that is computed before it is waited for: 300 ms, or 100 ms plus 100 ms, or the milliseconds of an input in a plain comparison.
#[test]
fn times_change_and_are_compared_with_clocks_value_by_value() {
    let net = net_of(
        "PROGRAM p
         VAR_INPUT slow, go, reset : BOOL; limit : TIME; END_VAR
         VAR_OUTPUT busy, done, over : BOOL; shown : DINT; END_VAR
         VAR CONSTANT quick : TIME := T#100ms; END_VAR
         VAR wait, own : TIME := T#200ms; total : TIME; t : TON; END_VAR
         INITIAL_STEP idle: choose(N); END_STEP
         TRANSITION FROM idle TO filling := go; END_TRANSITION
         STEP filling: busy(N); count(P1); END_STEP
         TRANSITION FROM filling TO idle := filling.T >= wait; END_TRANSITION
         INITIAL_STEP always: watch(N); END_STEP
         ACTION choose: IF slow THEN wait := T#300ms; ELSE wait := quick; END_IF; own := SEL(slow, quick, wait); END_ACTION
         ACTION count: total := total + wait * 2 - T#50ms; END_ACTION
         ACTION watch: t(IN := filling.X, PT := own, Q => done); over := total > limit; shown := TIME_TO_DINT(total); END_ACTION
         END_PROGRAM
         CONFIGURATION c RESOURCE r ON plc TASK s(INTERVAL := T#50ms, PRIORITY := 0); PROGRAM i WITH s : p; END_RESOURCE END_CONFIGURATION",
    );
    // Row 1 chooses and row 2 starts; `filling` runs from row 2 and is left in the first row in which its time is reached.
    let mut csv = String::from("slow,go,reset,limit\n");
    for row in 1..=30 {
        let slow = u8::from(row >= 8);
        let go = u8::from(row == 2 || row == 12);
        csv.push_str(&format!("{slow},{go},0,300\n"));
    }
    let trace = trace_of(&net, &csv);
    let rows_with = |name: &str| -> Vec<usize> {
        let values = column(&trace, name);
        (0..values.len()).filter(|row| values[*row] == 1).map(|row| row + 1).collect()
    };
    // 100 ms are two scans of 50 ms, and 300 ms are six.
    assert_eq!(rows_with("busy"), [2, 3, 12, 13, 14, 15, 16, 17]);
    assert_eq!(rows_with("done"), Vec::<usize>::new(), "the step is left before its timer is seen");
    let shown = column(&trace, "shown");
    assert_eq!(
        (shown[0], shown[1], shown[11]),
        (0, 150, 700),
        "2 * 100 - 50, then 2 * 300 - 50 more"
    );
    assert_eq!(rows_with("over"), (12..=30).collect::<Vec<_>>());
    let found = refusals(
        "PROGRAM p VAR_INPUT t1 : TIME; END_VAR VAR a : TIME; q : BOOL; END_VAR
         INITIAL_STEP s: work(N); END_STEP STEP u: END_STEP
         TRANSITION FROM s TO u := s.T > t1; END_TRANSITION
         ACTION work: a := s.T; END_ACTION END_PROGRAM",
    );
    assert_eq!(
        found.iter().map(|(code, _)| *code).collect::<Vec<_>>(),
        ["G0454", "G0454"],
        "{found:?}"
    );
}

/// The size of an unrolled loop is counted first: 10^15 rounds are rejected at once, otherwise this test would not end.
#[test]
fn loops_in_loops_are_counted_before_they_are_written_out() {
    let n = 5;
    let open: String = (0..n).map(|k| format!("FOR i{k} := 1 TO 1000 DO ")).collect();
    let vars: String = (0..n).map(|k| format!("i{k} : INT; ")).collect();
    let text = format!(
        "PROGRAM p VAR x : INT; {vars} END_VAR {open} x := x + 1; {} END_PROGRAM",
        "END_FOR; ".repeat(n)
    );
    let found = refusals(&text);
    assert_eq!(found.iter().map(|(code, _)| *code).collect::<Vec<_>>(), ["G0455"], "{found:?}");
}

/// A block with a chart gives the same results, in the same scan, in a program that calls it and as a separate design.
#[test]
fn blocks_with_charts_do_in_a_program_what_they_do_alone() {
    let block = "FUNCTION_BLOCK lights
         VAR_INPUT on, ask : BOOL; n_long : INT (0..3); END_VAR
         VAR_OUTPUT red, green, late : BOOL; rounds : INT (0..99); END_VAR
         VAR asked : BOOL; END_VAR
         INITIAL_STEP off: END_STEP
         TRANSITION FROM off TO stop := on; END_TRANSITION
         STEP stop: red(N); late(S); END_STEP
         TRANSITION t1 FROM stop TO go := stop.T >= T#30ms; END_TRANSITION
         TRANSITION FROM stop TO off := NOT on; END_TRANSITION
         STEP go: green(N); late(R); count(P1); watch(N); END_STEP
         TRANSITION FROM go TO stop := asked AND n_long < 2; END_TRANSITION
         TRANSITION FROM go TO off := NOT on; END_TRANSITION
         ACTION count: rounds := rounds + 1; asked := FALSE; END_ACTION
         ACTION watch: asked := asked OR ask; END_ACTION
         END_FUNCTION_BLOCK\n";
    let alone = net_of(block);
    let program = |body: &str| {
        format!(
            "{block}PROGRAM p VAR_INPUT on, ask : BOOL; n_long : INT (0..3); END_VAR
             VAR_OUTPUT red, green, late, both, seen : BOOL; rounds, before : INT; END_VAR VAR a, b : lights; END_VAR
             {body} END_PROGRAM"
        )
    };
    let net = net_of(&program(
        "before := a.rounds; a(on := on, ask := ask, n_long := n_long, red => red, NOT green => both);
         b(on, TRUE, 1); green := a.green; late := a.late; rounds := a.rounds; both := both AND b.green; seen := a.go.X AND a.go.T >= T#0ms;",
    ));
    let mut random = Random::new(3);
    let mut csv = String::from("on,ask,n_long\n");
    for _ in 0..rounds(300, 5_000) {
        csv.push_str(&format!(
            "{},{},{}\n",
            u8::from(random.below(8) > 0),
            random.below(2),
            random.below(4)
        ));
    }
    let (expected, got) = (trace_of(&alone, &csv), trace_of(&net, &csv));
    for name in ["red", "green", "late", "rounds"] {
        assert_eq!(column(&expected, name), column(&got, name), "{name}");
    }
    assert_eq!(column(&got, "seen"), column(&got, "green"));
    let counted = column(&got, "rounds");
    assert!(counted.last().is_some_and(|n| *n > 20), "{counted:?}");
    // A statement before the call reads the outputs of the block from the previous scan.
    assert_eq!(column(&got, "before")[1..], counted[..counted.len() - 1]);
    assert!(column(&got, "both").contains(&1));
    for (body, what) in [
        ("red := NOT on; a(on := red);", "`on` of `a` as an expression that changes within a scan"),
        (
            "IF ask THEN a(on := on); END_IF;",
            "a call of `lights`, a function block with its own chart, in this place",
        ),
        ("a(on := on); a(on := ask);", "a second call of a function block with a chart"),
        ("a.on := ask; a(ask := ask);", "assignments to variables of `a`"),
        (
            "IF ask THEN RETURN; END_IF; a(on := on);",
            "a call of `lights`, a function block with its own chart, in this place",
        ),
    ] {
        // The design is then the block alone, and the rejections are warnings (G0451).
        let mut sources = Sources::default();
        let main = sources.add("a.st", program(body));
        let (_, found) = read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default());
        assert!(found.iter().any(|one| one.message.contains(what)), "{body}: {found:#?}");
        assert!(found.iter().any(|one| one.code.id == "G0451"), "{body}: {found:#?}");
    }
}

/// The C text of a net, without the comment that names its source.
fn c_text(net: &Valid<Net>) -> (&'static str, String) {
    let options = grafsynth_backend_c::Options {
        prefix: Some("ring".to_owned()),
        ..grafsynth_backend_c::Options::default()
    };
    let facts = grafsynth_verify::structural_facts(net);
    let package = grafsynth_backend_c::emit(net, &facts, &options).expect("every net has C");
    let file = package.files.iter().find(|file| file.name == "ring.c").expect("there is a .c");
    (package.style, file.text.lines().skip(2).collect::<Vec<_>>().join("\n"))
}

/// A ring of steps with `N` on shared outputs, as a sequential function chart and in the chart language.
fn rings(n_steps: usize) -> (String, String) {
    const PINS: usize = 16;
    let pins = |prefix: &str| (0..PINS).map(|at| format!("{prefix}{at}")).collect::<Vec<_>>();
    let (inputs, outputs) = (pins("i").join(", "), pins("o").join(", "));
    let mut st = format!(
        "PROGRAM ring\nVAR_INPUT {inputs} : BOOL; END_VAR\nVAR_OUTPUT {outputs} : BOOL; END_VAR\n"
    );
    let mut graf = format!(
        "chart ring {{\nevolution single\nconflict priority\ninput {inputs}\noutput {outputs}\n"
    );
    for at in 0..n_steps {
        let (pin, next) = (at % PINS, (at + 1) % n_steps);
        let first = if at == 0 { ("INITIAL_", "initial ") } else { ("", "") };
        st += &format!("{}STEP s{at}: o{pin}(N); END_STEP\n", first.0);
        st += &format!("TRANSITION FROM s{at} TO s{next} := i{pin}; END_TRANSITION\n");
        graf += &format!("{}step s{at} {{ o{pin} }}\ns{at} -> s{next} when i{pin}\n", first.1);
    }
    (st + "END_PROGRAM\n", graf + "}\n")
}

#[test]
fn a_ring_gets_the_code_of_the_same_chart_in_graf() {
    for (n_steps, style) in [(12, "switch"), (100, "switch with tables")] {
        let (st, graf) = rings(n_steps);
        let (from_st, of_st) = c_text(&net_of(&st));
        let (from_graf, of_graf) = c_text(&grafsynth_tests::chart("ring.graf", &graf));
        assert_eq!((from_st, from_graf), (style, style));
        assert!(of_st == of_graf, "{of_st}\n----\n{of_graf}");
    }
}

#[test]
fn the_body_of_a_step_costs_time_only_in_that_step() {
    let mut st = "PROGRAM ring\nVAR_INPUT go: BOOL; END_VAR\nVAR n: INT; END_VAR\n".to_owned();
    for at in 0..20 {
        let first = if at == 0 { "INITIAL_" } else { "" };
        st += &format!(
            "{first}STEP s{at}: a{at}(N); END_STEP\nACTION a{at}: n := n + {at}; END_ACTION\n"
        );
        st += &format!("TRANSITION FROM s{at} TO s{} := go; END_TRANSITION\n", (at + 1) % 20);
    }
    let net = net_of(&(st + "END_PROGRAM\n"));
    let (style, text) = c_text(&net);
    assert_eq!(style, "switch");
    // One `switch` for the transitions, one for the bodies.
    assert_eq!(text.matches("switch (").count(), 2, "{text}");
    assert_eq!(text.matches("case RING_s7:").count(), 2, "{text}");
    let _ = trace_of(&net, "go,dt\n1,1\n1,1\n0,1\n1,1\n");
}
