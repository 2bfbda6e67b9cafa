//! Depth, recovery and literals.

use grafsynth_ir::FileId;

use super::parse;
use super::parse_stmt::duration;

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
}
