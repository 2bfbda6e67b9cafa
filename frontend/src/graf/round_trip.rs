//! Properties of the writer and the formatter, and tests with invalid input.

use itertools::Itertools as _;
use std::fmt::Write;

use grafsynth_ir::FileId;
use grafsynth_ir::chart::Design;
use proptest::prelude::*;

use super::lexer::Lexer;
use super::random::{self, Random};
use super::tests::TRUCK;
use super::token::Kind;
use super::*;

/// A design without its spans, as text. Two designs with the same meaning have the same text.
fn meaning(design: &Design) -> String {
    let text = format!("{design:#?}");
    let mut out = String::new();
    let mut rest = text.as_str();
    while let Some(at) = rest.find("Span {") {
        out.push_str(&rest[..at]);
        // `Span { file: FileId(0), start: 1, end: 2 }` contains no brace.
        let end = rest[at..].find('}').unwrap();
        out.push_str("Span");
        rest = &rest[at + end + 1..];
    }
    // The text after the last span.
    out.push_str(rest);
    out
}

#[track_caller]
fn read(text: &str) -> Parsed {
    let parsed = parse(FileId(0), text);
    assert_eq!(parsed.diagnostics, [], "{text}");
    parsed
}

#[track_caller]
fn assert_same_meaning(left: &Design, right: &Design, text: &str) {
    let (left, right) = (meaning(left), meaning(right));
    let around = |text: &str, n: usize| text.lines().skip(n.saturating_sub(5)).take(9).join("\n");
    if let Some(n) = left.lines().zip(right.lines()).position(|(a, b)| a != b) {
        panic!("meant\n{}\n=====\nread\n{}\n=====\n{text}", around(&left, n), around(&right, n));
    }
    assert_eq!(left.len(), right.len(), "{text}");
}

/// Checks the guarantees of the formatter for a text that can be read.
#[track_caller]
fn check_format(text: &str) -> String {
    let before = read(text);
    let once = format(FileId(0), text).unwrap();
    let after = read(&once);
    assert_same_meaning(&before.design.unwrap(), &after.design.unwrap(), text);
    let comments = |parsed: &[Comment], text: &str| -> Vec<String> {
        let mut all: Vec<String> =
            parsed.iter().map(|comment| text[comment.span.range()].trim_end().to_owned()).collect();
        all.sort_unstable();
        all
    };
    assert_eq!(
        comments(&before.comments, text),
        comments(&after.comments, &once),
        "comments of\n{text}\n=====\n{once}"
    );
    let twice = format(FileId(0), &once).unwrap();
    for (n, (a, b)) in once.lines().zip(twice.lines()).enumerate() {
        assert_eq!(a, b, "line {} of the second time of\n{text}\n=====\n{once}", n + 1);
    }
    assert_eq!(once, twice, "second time of\n{text}");
    once
}

/// The same text with comments and line breaks between its tokens, where they do not change the meaning.
fn with_comments(text: &str, r: &mut Random, percent: usize) -> String {
    let mut lexer = Lexer::new(text);
    let (mut out, mut last, mut n) = (String::new(), 0, 0);
    let mut previous = Kind::End;
    loop {
        let token = lexer.next(&mut |_, _| {}, &mut |_| {});
        let (start, end) = (token.start as usize, token.end as usize);
        // A line break may end an item, so it is only added where there already is one, or where no item
        // can end.
        let is_safe = token.new_line
            || matches!(
                previous,
                Kind::OpenBrace | Kind::Open | Kind::Comma | Kind::Equal | Kind::Ampersand
            )
            || matches!(token.kind, Kind::CloseBrace | Kind::OpenBrace | Kind::Close | Kind::Equal);
        if is_safe && r.chance(percent) {
            n += 1;
            let gap = &text[last..start];
            if r.chance(50) {
                write!(out, " # c{n}").unwrap();
                out.push_str(if gap.contains('\n') { gap } else { "\n" });
            } else {
                out.push_str(gap);
                write!(
                    out,
                    "{}# c{n}\n{}",
                    r.pick(&["", "\n", "\n\n\n"]),
                    r.pick(&["", "\n", "\n\n"])
                )
                .unwrap();
            }
        } else {
            out.push_str(&text[last..start]);
        }
        if token.kind == Kind::End {
            return out;
        }
        out.push_str(&text[start..end]);
        last = end;
        previous = token.kind;
    }
}

#[test]
fn the_truck_in_its_canonical_form() {
    let once = check_format(TRUCK);
    insta::assert_snapshot!(once);
}

#[test]
fn a_list_of_what_is_shared_goes_on_after_a_comma() {
    let text = "chart c {\n    var a, step\n    shared allow a, # c1\n    step\n\n    enclosing step p1 {\n        step q\n    }\n}\n";
    let once = check_format(text);
    assert!(once.contains("shared allow a, step"), "{once}");
}

#[test]
fn a_blank_line_after_a_comment_stays_even_if_the_comment_ends_with_a_brace() {
    let text = "chart c {\n    input a\n    # old {\n\n    initial step p\n}\n";
    assert_eq!(check_format(text), text);
}

#[test]
fn comments_and_long_lines_in_their_canonical_form() {
    let text = "# heading
   # two


edition 1
chart   truck \"a truck\" req \"R1\" {   # open

  # first
  tick 10 ms conflict priority-age   # same


  input m \"loading request\", b \"right limit\",   # limits
     p \"loaded\" , a
  input i0, i1, i2, i3, i4, i5, i6, i7, i8, i9, i10, i11, i12, i13, i14, i15, i16, i17, i18, i19, i20, i21
  input n:int 0..9
  output R, Z, L extern condition f()
  var k: int 0..9[4] = [1,2,3,4], g
  initial step p1 \"waiting\"
  step p2 { R # go
    Z }
  step p3 { # three
     entry { k[0] := 1; k[1]:=2 } exit { if a { g := true # yes
       } else if b { g := false } else {
       # no
       g := a
       }
       }
     # end
  }
  step p4 { R if a * b + /m; set Z, reset L if f(); Z SD 3 s }
  # before
  t1: p1 -> p2 # mid
      when m # m
  t2: p2 -> p3 when b·/a + i0·i1 # x
  t3: p3 -> p4 when i0 and i1 and i2 and i3 and i4 and i5 and i6 and i7 and i8 and i9 and i10 and i11 and i12 and i13 and i14 and i15 after 3 s priority 3 do { g := true }
  t4: p4 -> sink do { code c \"\"\"
  if (x)
    y();
\"\"\"; g := n + 1 > 3 } restart   # tail
  device gal22v10 { clock 1  m 2 # pin
   R 23 }
  assert never R and L

}   # closing
# last
";
    insta::assert_snapshot!(check_format(text));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_written_is_read_back(seed: u64) {
        let design = random::design(&mut Random::new(seed));
        let text = write_design(&design);
        let parsed = read(&text);
        assert_same_meaning(&design, &parsed.design.unwrap(), &text);
        // Formatting does not change a text that was written without a source.
        let again = check_format(&text);
        prop_assert_eq!(text, again);
    }

    #[test]
    fn comments_stay(seed: u64) {
        let mut r = Random::new(seed);
        let text = write_design(&random::design(&mut r));
        let text = with_comments(&text, &mut r, 15);
        check_format(&text);
    }

    #[test]
    fn broken_input_gives_findings(seed: u64) {
        let mut r = Random::new(seed);
        let text = write_design(&random::design(&mut r));
        let text = broken(&text, &mut r);
        let parsed = parse(FileId(0), &text);
        prop_assert!(parsed.diagnostics.len() <= 101);
        for finding in &parsed.diagnostics {
            for label in &finding.labels {
                prop_assert!(text.get(label.span.range()).is_some(), "{:?} of {:?}", label, text);
            }
        }
        let _ = format(FileId(0), &text);
    }
}

/// A parser, as a function from a text to its findings.
type Reader = fn(&str) -> Vec<Diagnostic>;

#[test]
fn broken_input_of_the_other_readers_gives_findings() {
    let rules = "# option: chart press\n# option: step p1 priority 2 { entry { v := 0 } }\n# option: var v: int 0..9\nStep p1, p2\nTransition t1, t2
Input m, b\nOutput R, Z\nMarking p1\nTransitions:\nt1: p1*m*/b |- @p2*R\nt2: p2*(m + v > 3) |- @p1\nSteps:\np2: m |- Z\n";
    let props = "assume never (a and b) \"label\"\nsafe: always not (R and n > 3)\nnever x\n";
    let board = "device gal22v10 { clock 1  m 2, n[0] 3 }\nplace p2, m1.s on chip\n";
    let readers: [(&str, Reader); 3] = [
        (rules, |text| crate::rules::parse(FileId(0), text).diagnostics),
        (props, |text| crate::props::parse(FileId(0), text).1),
        (board, |text| crate::board::parse(FileId(0), text).1),
    ];
    for (text, read) in readers {
        assert_eq!(read(text), []);
        for seed in 0..300 {
            let text = broken(text, &mut Random::new(seed));
            let findings = read(&text);
            assert!(findings.len() <= 101);
            for label in findings.iter().flat_map(|finding| &finding.labels) {
                assert!(text.get(label.span.range()).is_some(), "{label:?} of {text:?}");
            }
        }
    }
}

/// Flips, cuts or repeats bytes, or inserts brackets.
pub(crate) fn broken(text: &str, r: &mut Random) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..1 + r.below(6) {
        let at = r.below(bytes.len().max(1));
        match r.below(6) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << r.below(8),
            1 if !bytes.is_empty() => {
                bytes[at] = r.pick(b"{}()[]\"`;:,.&+-*/=<>#\n ab0\\!\x00\xc2\xb7")
            }
            2 => bytes.truncate(at),
            3 => {
                let end = (at + r.below(40)).min(bytes.len());
                let piece: Vec<u8> = bytes[at.min(end)..end].repeat(1 + r.below(5));
                bytes.splice(at..at, piece);
            }
            4 => {
                let end = (at + r.below(20)).min(bytes.len());
                bytes.drain(at.min(end)..end);
            }
            _ => {
                let piece = r
                    .pick(&["(", "{", "not ", "\"\"\"", "if ", "[", "`", "·", "->", "otherwise"])
                    .repeat(1 + r.below(300));
                bytes.splice(at..at, piece.into_bytes());
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
