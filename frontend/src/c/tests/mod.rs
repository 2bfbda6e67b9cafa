//! Tests of the parser and the translation with small sources. `tests/tests/c_sources.rs` compares the results of charts with those of
//! compiled C.

use super::{Options, Parsed, parse, parse_within};
use crate::graf::{Limits, write_design};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::{FileId, lower};

fn findings(text: &str) -> Vec<String> {
    parse(FileId(0), text)
        .diagnostics
        .iter()
        .map(|one| format!("{} {}", one.code.id, one.message))
        .collect()
}

fn drawn(text: &str, options: &Options) -> Parsed {
    let parsed = parse_within(FileId(0), text, &Limits::default(), options);
    assert!(!any_error(&parsed.diagnostics), "{text}\n{:#?}", parsed.diagnostics);
    let design = parsed.design.as_ref().expect("a chart");
    let (net, found) = lower::lower(design);
    assert!(net.is_some(), "{found:#?}\n{}", write_design(design));
    parsed
}

fn chart(text: &str, options: &Options) -> String {
    write_design(&drawn(text, options).design.expect("a chart"))
}

#[test]
fn nesting_is_bounded_for_every_sign() {
    let sources = [
        ("int f(int a) { return ", "(", "a"),
        ("int f(int a) { return ", "-", "a"),
        ("int f(int a) { return ", "!", "a"),
        ("int f(int a) { return ", "*", "a"),
        ("int f(int a) { return ", "a ? ", "a"),
        ("int f(int a) { return ", "a = ", "a"),
        ("int f(int a) { return ", "a + (", "a"),
        ("int f(int a) { return ", "f(", "a"),
        ("int f(int a) { return a", "[a", ""),
        ("int f(int a) { return a", "[1]", ""),
        ("int f(int a) { return ", "sizeof ", "a"),
        ("int f(int a) { return ", "(int)", "a"),
        ("int f(int a) ", "{", ""),
        ("int f(int a) { ", "if (a) ", ""),
        ("int f(int a) { ", "if (a) ; else ", ";"),
        ("int f(int a) { ", "while (a) ", ";"),
        ("int f(int a) { ", "do ", ";"),
        ("int f(int a) { ", "x: ", ";"),
        ("int f(int a) { ", "for (;;) ", ";"),
        ("int f(int a) { ", "switch (a) case 1: ", ";"),
        ("int f(int a) { return a", " + a", ";"),
        ("int f(int a) { return a", " && a", ";"),
        ("int f(int a) { return a", ", a", ";"),
        ("int ", "(*", "f"),
        ("int ", "*", "f"),
        ("int v[] = ", "{", "1"),
        ("int ", "f(int ", "a"),
        ("", "struct {", ""),
    ];
    for (before, sign, after) in sources {
        for n in [100, 300, 5000] {
            let text = format!("{before}{}{after}", sign.repeat(n));
            let parsed = parse(FileId(0), &text);
            assert!(parsed.design.is_some() || any_error(&parsed.diagnostics), "{before}{sign}");
        }
    }
}

#[test]
fn chains_in_parentheses_do_not_add_up_to_a_high_tree() {
    // Each chain is as long as the nesting around it allows, and its first operand is the inner chain.
    for (link, each) in [(" + a", 2), (" + a", 3), ("[1]", 2), (" - (a)", 4)] {
        let n = 240 / each;
        let mut text = "a".to_owned();
        for level in (0..n).rev() {
            text = format!("({text}{})", link.repeat(240 - level * each));
        }
        let parsed = parse(FileId(0), &format!("int f(int a) {{ return {text}; }}"));
        assert!(any_error(&parsed.diagnostics), "{link}");
    }
    let short = format!("int f(int a) {{ return {}a{}; }}", "(".repeat(40), " + a)".repeat(40));
    assert!(!any_error(&parse(FileId(0), &short).diagnostics));
}

#[test]
fn every_call_gets_a_macro_step_and_shared_ones_a_step_that_waits() {
    let text = "int half(int n) { return n / 2; } int f(int a) { return half(a) + half(a + 1); }";
    let copied = chart(text, &Options::default());
    assert!(
        copied.contains("macro step call_half = half")
            && copied.contains("macro step call_half_2 = half"),
        "{copied}"
    );
    let shared = chart(text, &Options { calls: super::Calls::Share, ..Options::default() });
    assert_eq!(shared.matches("macro step run_half = half").count(), 1, "{shared}");
    assert!(shared.contains("-> run_half & wait_half"), "{shared}");
}

#[test]
fn errors_of_all_kinds_are_found_at_once() {
    let text = "int f(int a) { break; goto nowhere; a = a++ + 1; return b; } int g(int a) { if (a { } return 1; }";
    assert_eq!(findings(text), ["G0481 expected `)`, found `{`"]);
    let text = "int f(int a) { a = a++ + 1; return b; }";
    assert_eq!(findings(text).len(), 2, "{:?}", findings(text));
    let text = "int f(int a) { break; goto nowhere; }";
    assert_eq!(findings(text).len(), 2, "{:?}", findings(text));
}

#[test]
fn conditions_leave_text_out() {
    let text = "#ifndef LIMIT
#define LIMIT 5
#endif
#define HAS_FAN
#if LIMIT > 8 && defined(HAS_FAN) /* said */
int f(int a) { return a + 1; }
#elif LIMIT == 5
#  ifdef HAS_PUMP
it isn't C
#  else
int f(int a) { return a + 2; }
#  endif
#else
#error never
#endif
#undef HAS_FAN
#ifdef HAS_FAN
int f(int a) { return a + 3; }
#endif
";
    assert_eq!(findings(text), [""; 0]);
    let plain = chart(text, &Options::default());
    assert!(plain.contains(" + 2") && !plain.contains(" + 1"), "{plain}");
    let given = Options { defines: vec![("LIMIT".to_owned(), 9)], ..Options::default() };
    let other = chart(text, &given);
    assert!(other.contains(" + 1") && !other.contains(" + 2"), "{other}");
}

#[test]
fn conditions_without_a_value_or_an_end_are_findings() {
    let end = "int f(int a) { return a; }\n";
    let of = |text: &str| findings(&format!("{text}\n{end}"));
    assert_eq!(
        of("#if FAST\n#endif"),
        ["G0488 `FAST` is not defined, so it is 0 in this condition"]
    );
    assert_eq!(of("#if defined FAST && FAST > 2\n#endif"), [""; 0]);
    assert_eq!(of("#endif"), ["G0483 `#endif` without an `#if` before it"]);
    assert_eq!(of("#else"), ["G0483 `#else` without an `#if` before it"]);
    assert_eq!(
        of("#if 0\n#else\n#else\n#endif"),
        ["G0483 `#else` after the `#else` of its conditional"]
    );
    assert_eq!(of("#if 1"), ["G0483 this conditional has no `#endif`"]);
    assert_eq!(
        of("#define N 1 +\n#if N\n#endif"),
        ["G0483 the condition is not a constant expression"]
    );
    assert_eq!(of("#if 1 / 0\n#endif"), ["G0483 the condition is not a constant expression"]);
    assert_eq!(of("#error too old"), ["G0483 #error: too old"]);
    assert_eq!(of("#define N 1\n#define N 2"), ["G0483 `N` is redefined as 2; it was 1"]);
    assert_eq!(of("#define N 1\n#undef N\n#define N 1"), [""; 0]);
    assert_eq!(of("#if\n#endif"), ["G0483 missing condition"]);
    let deep = format!("{}{}", "#if 1\n".repeat(400), "#endif\n".repeat(400));
    assert_eq!(of(&deep), ["G0107 conditionals are nested deeper than 256 levels"]);
}
