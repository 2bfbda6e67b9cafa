//! Tests of the parser and the writer of rules.

use grafsynth_ir::FileId;
use grafsynth_ir::chart::{Chart, Item};
use itertools::Itertools as _;

use super::*;
use crate::graf;

/// Fig. 3 of the paper on Grafcet, C and PALASM, as printed: its t4 leaves p1 instead of p4, and its last step rule names p2 instead of p4.
pub(super) const AS_PRINTED: &str = "Step p1, p2, p3, p4 
Transition t1, t2, t3, t4 
Input m, b, p, a 
Output R, Z, L 
Marking p1 
Transitions:  
t1:  p1*m |-  @p2 
t2:  p2*b |-  @p3 
t3:  p3*p |-  @p4 
t4:  p1*a |-  @p1 

Steps:  
p2: |-  R 
p3: |-  Z 
p2: |-  L 
";

#[track_caller]
fn chart(text: &str) -> Chart {
    let parsed = parse(FileId(0), text);
    assert_eq!(parsed.diagnostics, [], "{text}");
    parsed.design.unwrap().charts.remove(0)
}

/// The same chart in the chart language.
#[track_caller]
fn graf(text: &str) -> String {
    let parsed = parse(FileId(0), text);
    assert_eq!(parsed.diagnostics, [], "{text}");
    graf::write_design(&parsed.design.unwrap())
}

fn codes(text: &str) -> Vec<(String, String)> {
    parse(FileId(0), text)
        .diagnostics
        .iter()
        .map(|d| {
            (
                d.code.id.to_owned(),
                d.labels.first().map_or("", |label| &text[label.span.range()]).to_owned(),
            )
        })
        .collect()
}

#[test]
fn the_paper_as_printed_is_read() {
    let text = graf(AS_PRINTED);
    assert!(text.contains("step p2 { R; L }"), "{text}");
    assert!(text.contains("t4: p1 -> p1 when a"), "{text}");
    assert!(
        text.contains("conflict priority-age")
            && text.contains("evolution single")
            && text.contains("tick 10 ms"),
        "{text}"
    );
    insta::assert_snapshot!(text);
}

#[test]
fn sub_rules_are_outputs_of_now() {
    let text = graf(
        "Step p1, p2, q\nTransition t1, t2\nInput m, n\nOutput R, Z\nMarking p1, q\nTransitions:
t1: p1*q*m*/n |- @p2*R
t2: p2 * (m + n) |- @p1 * @q
Steps:\np2: n |- Z",
    );
    assert!(text.contains("output mealy R"), "{text}");
    assert!(text.contains("initial step p1 { R if q.active and m and not n }"), "{text}");
    assert!(text.contains("t1: p1 & q -> p2 when m and not n"), "{text}");
    assert!(text.contains("step p2 { Z if n }"), "{text}");
}

#[test]
fn options_carry_all_else() {
    let text = graf(
        "# a comment
# option: chart press \"the press\"
# option: conflict all
# option: evolution stable limit 7
# option: input n \"count\": int 0..9
# option: event E
# option: var v: int 0..9 = 3
# option: output registered R
# option: step p1 priority 2 { entry { v := 0 } set Z }
# option: transition t1: on E after 3 s priority 1 \"go\" do { v := v + 1 }
# option: assert never (R and Z)
Step p1, p2\nTransition t1, t2\nInput E, n, m\nOutput R, Z\nMarking p1\nTransitions:
t1: p1*m*(n + v > 3) |- @p2\nt2: p2 |-\nSteps:\np2: |- R",
    );
    insta::assert_snapshot!(text);
}

#[test]
fn order_is_that_of_the_lists() {
    let chart = chart(
        "Step a, b\nTransition t1, t2\nMarking a\nTransitions:\nt2: b |- @a\nt1: a |- @b\nSteps:",
    );
    let names: Vec<String> = chart
        .items
        .iter()
        .filter_map(|item| {
            if let Item::Transition(t) = item {
                t.name.as_ref().map(|n| n.text.clone())
            } else {
                None
            }
        })
        .collect();
    assert_eq!(names, ["t1", "t2"]);
}

#[test]
fn every_mistake_is_reported() {
    let text = "Step p1, p2\nTransition t1, t2, t3\nInputs m\nOutput R\nMarking p9\nOutput Z\nTransitions:
t1: p1*m |- p2
t2: p1 + p2 |- @q
t4: p1 |- R
 p1 |- @p2
t2: p1*m |- @p2 @p1
Steps:\np1: |- @p1\np2: |- Q\npp: |- R\n# option: oops\n# option: step p3 { R }\n# option: macro m { }\n";
    let found = codes(text);
    let expected = [
        ("G0104", "Inputs"),
        ("G0401", "p9"),
        ("G0406", "Output"),
        ("G0402", "t3"),
        ("G0405", "p2"),
        ("G0404", "p1 + p2"),
        ("G0401", "q"),
        ("G0401", "t4"),
        ("G0101", "|-"),
        ("G0101", "@"),
        ("G0405", "p1"),
        ("G0401", "Q"),
        ("G0401", "pp"),
        ("G0104", "oops"),
        ("G0401", "p3"),
        ("G0403", "macro m { }"),
    ];
    let mut found: Vec<(&str, &str)> =
        found.iter().map(|(code, at)| (code.as_str(), at.as_str())).collect();
    let mut expected = expected.to_vec();
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(found, expected);
}

#[track_caller]
fn lowered(text: &str, design: Option<grafsynth_ir::chart::Design>) -> grafsynth_ir::net::Net {
    let (net, findings) = grafsynth_ir::lower::lower(&design.unwrap());
    net.unwrap_or_else(|| panic!("{findings:#?}\n{text}")).into_inner()
}

/// A net as text without spans.
fn shape(net: &grafsynth_ir::net::Net) -> String {
    let text = format!("{net:#?}");
    text.lines()
        .filter(|line| {
            !["file:", "start:", "end:"].iter().any(|word| line.trim_start().starts_with(word))
        })
        .join("\n")
}

/// Checks that parsing the written rules gives the same net, and that writing it again gives the same text.
#[track_caller]
fn round(net: &grafsynth_ir::net::Net) -> String {
    let written = write_net(net).unwrap_or_else(|findings| panic!("{findings:#?}"));
    let parsed = parse(FileId(0), &written);
    assert_eq!(parsed.diagnostics, [], "{written}");
    let again = lowered(&written, parsed.design);
    let (left, right) = (shape(net), shape(&again));
    if let Some((a, b)) = left.lines().zip(right.lines()).find(|(a, b)| a != b) {
        panic!("{a} is not {b}\n{written}\n{left}\n{right}");
    }
    assert_eq!(write_net(&again).unwrap(), written);
    written
}

#[test]
fn rules_are_bijective_with_flat_nets() {
    let parsed = parse(FileId(0), AS_PRINTED);
    let net = lowered(AS_PRINTED, parsed.design);
    let written = round(&net);
    // Only the name of the chart, spaces and line breaks differ from the paper.
    let words = |text: &str| {
        text.split_whitespace()
            .map(str::to_owned)
            .join("")
            .replace("p2:|-Rp2:|-Lp3:|-Z", "p2:|-Rp3:|-Zp2:|-L")
    };
    assert_eq!(words(&written), format!("#option:chartrules{}", words(AS_PRINTED)));

    let sub =
        "Step p1, p2, q\nTransition t1, t2\nInput m, n\nOutput R, Z\nMarking p1, q\nTransitions:
t1: p1*q*m*/n |- @p2*R\nt2: p2*(m + n) |- @p1*@q*R\nSteps:\np2: n |- Z\n";
    let written = round(&lowered(sub, parse(FileId(0), sub).design));
    assert_eq!(written, format!("# option: chart rules\n{sub}"));
}

#[test]
fn charts_with_everything_flat_come_back() {
    for text in [
        "chart c { conflict priority evolution stable limit 9 tick 20 ms assign simultaneous schedule level
            input n: int 0..9, a, synchronous\ninput synchronous b \"right\"
            output registered Q, W: int 0..5 = 3, S
            var v: int 0..9[4] = [1, 2, 3, 4], w: bool = true\nevent E\ninternal event F\ntimer T while a and v[1] > 2
            extern condition cold(): int 0..3\nextern action go(speed: int 0..9, bool), beep()
            initial step s0 \"first\" req \"R1\" { Q if (a or b) and T >= 1 s; entry { v[n mod 4] := n + 1; raise F } }
            step s1 { Q after 3 s; beep(); exit { if a { W := 2 } else { S := not w } } on E { W := 1 } }
            step s2 { budget 90; task one cost 40 { call go(n, b) } code c \"x();\\ny();\" }
            t0: -> s2 when rise(a and s1.active) and not b
            t1: s0 -> s1 on E, F when a or cold = 2 after 60 ms priority 2 \"go\" do { raise F; if a { W := 1 } }
            t2: s0 -> s2 when if a then n > 3 else fall(b)
            t3: s0 -> s0 when otherwise restart
            t4: s1 & s2 -> sink when s2.done and W = 3 and n * 2 - 1 > -5
            assume never (a and b)\ndevice gal22v10 { clock 1 a 2 Q 23 } }",
        "chart Steps { evolution single\ninput a, b\noutput mealy M, N\noutput P, R
            initial step Transitions { M if a; N if a and b; P if not (a = b); set R }\nstep Steps { M if a or b; P }
            t1: Transitions -> Steps when a\nt2: Steps -> Transitions when (a or b) and not a }",
    ] {
        let parsed = graf::parse(FileId(0), text);
        assert_eq!(parsed.diagnostics, []);
        round(&lowered(text, parsed.design));
    }
}

#[test]
fn what_is_not_flat_is_refused() {
    let text =
        "chart c { macro m { entry exit step e } initial step a macro step x = m a -> x x -> a }";
    let findings = write_design(&graf::parse(FileId(0), text).design.unwrap()).unwrap_err();
    assert_eq!(findings.iter().map(|finding| finding.code.id).collect::<Vec<_>>(), ["G0120"; 3]);
}

#[test]
fn comments_of_rules_stay() {
    let text = "# the press
# option: conflict all
Step p1,  p2   # two steps
Transition t2, t1
Input m, b
# of the motor
Output R, Z
Marking p1
Transitions:
t1: p1 · m |- @p2  # go
# and back
t2: p2*b|-@p1
Steps:  # now
# both
p2: |- Z*R # on
# end
";
    let once = format(FileId(0), text).unwrap();
    insta::assert_snapshot!(once);
    assert_eq!(format(FileId(0), &once).unwrap(), once);
    let bare: String = once
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| format!("{}\n", line.split("  #").next().unwrap()))
        .collect();
    assert_eq!(
        format!("# option: conflict all\n{bare}"),
        write_design(&parse(FileId(0), text).design.unwrap()).unwrap()
    );
}
