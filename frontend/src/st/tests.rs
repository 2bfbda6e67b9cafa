//! Tests of nesting depth, error recovery and literals. The tests of depth use the default stack of a thread.

use grafsynth_ir::diag::any_error;
use grafsynth_ir::{FileId, lower};

use super::parse;
use super::parse_expr::duration;

fn findings(text: &str) -> Vec<&'static str> {
    parse(FileId(0), text).diagnostics.iter().map(|finding| finding.code.id).collect()
}

fn with_condition(condition: &str) -> String {
    format!(
        "PROGRAM p VAR_INPUT a : BOOL; END_VAR VAR v : ARRAY [0..1] OF INT (0..1); END_VAR
         INITIAL_STEP s: END_STEP STEP t: END_STEP
         TRANSITION FROM s TO t := {condition}; END_TRANSITION END_PROGRAM"
    )
}

#[test]
fn deep_nesting_is_read_or_refused_and_never_overflows() {
    for n in [200, 255, 5_000] {
        for (open, inner, close) in [
            ("(", "a", ")"),
            ("NOT ", "a", ""),
            ("NOT (", "a", ")"),
            ("a AND (a OR ", "a", ")"),
            ("v[", "0", "] = 0"),
            ("0 < -", "1", ""),
            ("SEL(a, a, ", "a", ")"),
        ] {
            let text = with_condition(&(open.repeat(n) + inner + &close.repeat(n)));
            let found = findings(&text);
            assert!(n < 256 || found.contains(&"G0107"), "{n} x {open}: {found:?}");
        }
        let body = "IF a THEN ".repeat(n) + &"END_IF; ".repeat(n);
        findings(&format!("PROGRAM p VAR_INPUT a : BOOL; END_VAR {body} END_PROGRAM"));
    }
}

#[test]
fn long_chains_are_flat() {
    let chain = vec!["a"; 10_000].join(" AND ");
    assert_eq!(findings(&with_condition(&chain)), Vec::<&str>::new());
    let arms = "ELSIF n = 3 THEN n := 4; ".repeat(2_000);
    let text =
        format!("PROGRAM p VAR n : INT; END_VAR IF n = 1 THEN n := 2; {arms} END_IF; END_PROGRAM");
    assert_eq!(findings(&text), Vec::<&str>::new());
}

#[test]
fn all_errors_of_a_text_are_reported() {
    let found = findings(
        "PROGRAM p VAR x : REAL; n : INT; END_VAR
         INITIAL_STEP s: act(N); nothing(N); END_STEP
         TRANSITION FROM s TO away := n; END_TRANSITION
         ACTION act: n := ; n := 1 + ; WHILE n < 2 DO n := 3; END_WHILE; m := 1; END_ACTION
         END_PROGRAM",
    );
    for code in ["G0441", "G0443", "G0444", "G0445", "G0449"] {
        assert!(found.contains(&code), "{code} is not in {found:?}");
    }
}

#[test]
fn durations_have_units_and_fractions() {
    assert_eq!(duration("1h2m3s4ms"), Some(3_723_004_000_000));
    assert_eq!(duration("2.5s"), Some(2_500_000_000));
    assert_eq!(duration("1d_12h"), Some(129_600_000_000_000));
    assert_eq!(duration("-5ms"), Some(-5_000_000));
    assert_eq!(duration("5"), None);
    assert_eq!(duration(""), None);
    assert_eq!(duration("25h_90m"), Some(95_400_000_000_000));
    assert_eq!(duration("1s1s"), None, "each unit is written once");
    assert_eq!(duration("1s2m"), None, "the longest unit is first");
    assert_eq!(duration("1.5m2s"), None, "only the last unit has a fraction");
}

/// A program with this text as its body.
fn program(body: &str) -> String {
    format!(
        "PROGRAM p VAR_INPUT a, b : BOOL; i : INT; END_VAR VAR_OUTPUT q : BOOL; n : INT; END_VAR \
         VAR v : ARRAY [0..3] OF INT; END_VAR {body} END_PROGRAM"
    )
}

/// Reads and lowers a text; true if the result is a net.
fn is_read(text: &str) -> bool {
    let parsed = parse(FileId(0), text);
    let Some(design) = parsed.design.filter(|_| !any_error(&parsed.diagnostics)) else {
        assert!(any_error(&parsed.diagnostics), "neither a design nor an error");
        return false;
    };
    let (net, found) = lower::lower(&design);
    assert!(net.is_some() || any_error(&found), "neither a net nor an error");
    net.is_some()
}

#[test]
fn nesting_is_bounded_for_every_sign() {
    let bodies = [
        ("q := ", "(", "a", ")", ";"),
        ("q := ", "NOT ", "a", "", ";"),
        ("n := ", "-", "i", "", ";"),
        ("n := ", "+", "i", "", ";"),
        ("q := ", "NOT (", "a", ")", ";"),
        ("q := ", "a OR b AND (", "a", ")", ";"),
        ("n := ", "i + (", "i", ")", ";"),
        ("n := ", "v[", "i", "]", ";"),
        ("n := ", "ABS(", "i", ")", ";"),
        ("n := ", "ABS(IN := ", "i", ")", ";"),
        ("q := ", "AND(a, ", "b", ")", ";"),
        ("n", "[n", "", "]", " := 1;"),
        ("n", ".x", "", "", " := 1;"),
        ("", "IF a THEN ", "q := b;", " END_IF;", ""),
        ("", "IF a THEN ; ELSIF b THEN ", "q := b;", " END_IF;", ""),
        ("", "CASE i OF 1: ", "q := b;", " END_CASE;", ""),
        ("", "FOR n := 1 TO 2 DO ", "q := b;", " END_FOR;", ""),
        ("", "WHILE a DO ", "q := b;", " END_WHILE;", ""),
        ("", "REPEAT ", "q := b;", " UNTIL a END_REPEAT;", ""),
        ("", "IF (((", "a", "))) THEN q := b; END_IF", ""),
        ("n := ", "i + ", "i", "", ";"),
        ("q := ", "a AND ", "b", "", ";"),
        ("q := ", "a XOR ", "b", "", ";"),
        ("q := i ", "= i", "", "", ";"),
    ];
    for (before, open, inside, close, after) in bodies {
        for n in [30, 60, 120, 126, 250, 300, 5000] {
            // Each text is tested with and without its closing parts.
            for closes in [close.repeat(n), String::new()] {
                let body = format!("{before}{}{inside}{closes}{after}", open.repeat(n));
                is_read(&program(&body));
            }
        }
    }
    assert!(is_read(&program(&format!("q := {}a{};", "(".repeat(120), ")".repeat(120)))));
    assert!(is_read(&program(&format!("q := {}a;", "a AND ".repeat(5000)))));
}

#[test]
fn chains_in_parentheses_do_not_add_up_to_a_high_tree() {
    // Each level may contain a chain whose first operand is the inner chain.
    for (open, link) in
        [("(", " + i) "), ("(", " + i + i - i) "), ("(", "= i) "), ("v[", "].x.y.z ")]
    {
        let body = format!("n := {}i{};", open.repeat(250), link.repeat(250));
        is_read(&program(&body));
    }
    let chain = " + i".repeat(200);
    let body = format!("n := {}i{};", "(".repeat(200), format!("{chain})").repeat(200));
    assert!(!is_read(&program(&body)));
}

#[test]
fn calls_in_calls_stay_within_the_budget() {
    for call in ["ABS(", "MIN(i, "] {
        let body = format!("n := {}i{};", call.repeat(60), ")".repeat(60));
        assert!(!is_read(&program(&body)), "{body}");
    }
}

/// Two blocks that refer to each other by in-out parameters and, once both are bound, call each other recursively.
#[test]
fn blocks_that_call_each_other_in_a_circle_are_refused() {
    let text = "FUNCTION_BLOCK f VAR_IN_OUT y : g; END_VAR VAR n : INT; END_VAR n := n + 1; y(); END_FUNCTION_BLOCK
         FUNCTION_BLOCK g VAR_IN_OUT x : f; END_VAR VAR n : INT; END_VAR n := n + 1; x(); END_FUNCTION_BLOCK
         PROGRAM p VAR a : f; b : g; END_VAR b(x := a); a(y := b); b(x := a); END_PROGRAM";
    assert!(findings(text).contains(&"G0448"), "{:?}", findings(text));
}
