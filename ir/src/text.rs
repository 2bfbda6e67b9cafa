//! The text form of a net: for dumps after a pass, bug reports, tests, and as an input of every verb (`.net`).
//!
//! [`print()`] writes every field except the spans; [`parse()`] returns the same net, with spans that refer to the text. This also works for invalid nets,
//! so a broken net can be written: an object that its name does not identify (an id beyond its arena, the second of two equal names) is written `?N` by
//! its position.
//!
//! # Form
//! One declaration per line. Declarations of one kind are in declaration order; the kinds can come in any order. Lines below a declaration that begin with
//! one of its own keywords belong to it (the printer indents them). Blanks only separate tokens; `//` starts a comment.
//!
//! ```text
//! net truck
//! policy priority-age
//! evolution single
//! schedule declared
//! tick 10000000 ns
//!
//! part truck level 1
//!
//! input m "loading request" bool
//! output R "move right" bool continuous
//!     emit p2 if not b
//! var n int 0..99 = 0
//!
//! step p1 "waiting" req "R12" in truck initial
//!     entry { n := n + 1 }
//! step p2 in truck
//!
//! transition t1 in truck p1 -> p2 when m and n < 99
//!     do { raise E }
//! ```
//!
//! # Grammar
//! `[x]` optional, `{x}` repeated, `|` choice; capitals are rules. `LIST(x)` is `( [x {, x}] )`.
//!
//! ```text
//! net NAME
//! policy all | priority | priority-age | inner-first | outer-first
//! evolution single | stable limit N
//! schedule declared | level | priority
//! fire one    assign simultaneous    final scan    events exclusive    queue N    tick N ns
//! part NAME META level N [priority N]
//!     enter LIST(ENTER)                                      what reset enters
//! input NAME META TYPE [extern | event | internal] [synchronous]
//! output NAME META TYPE [registered] [safe INT] (continuous | mealy | extern | stored VAR | controlled ACTION)
//!     emit STEP [if EXPR]
//!     param TYPE [NAME]
//!     call STEP LIST(EXPR) [if EXPR]
//! var NAME META TYPE ["[" N "]"] [stored | hidden] [= INT {, INT}]
//! timer NAME META [expired] while EXPR
//! edge %N = EXPR
//! step NAME META in PART [initial] [enclosing | composite | parallel | final] [parent STEP] [link] [hidden] [priority N] [budget N] [done EVENT]
//!     entry BLOCK    exit BLOCK    content BLOCK
//!     code STRING STRING                                     language, text
//!     task NAME META cost N BLOCK
//! transition NAME META in PART [reaction] [STEP {, STEP}] -> [ENTER {, ENTER}] [clears LIST(STEP)] [restart] [on LIST(EVENT)] [priority N] [deadline N ns] [when EXPR]
//!     do BLOCK
//! action NAME META duration N
//!     use STEP QUALIFIER [if EXPR]
//!     body BLOCK
//! slot NAME META sends EVENT after N
//! history NAME META of STEP
//!     case STEP LIST(ENTER)    default LIST(ENTER)    content BLOCK
//! force STEP LIST(PART) (hold | situation LIST(STEP))
//! emergency META when EXPR
//! (assume | assert) [NAME] META never EXPR
//! open (next | output OUTPUT) when EXPR
//! macro NAME META entry STEP exit STEP steps LIST(STEP)
//! place (step | var | transition | output) NAME on (chip | cpu)
//! device NAME
//! pin NAME N
//!
//! META   = [STRING] {req STRING}                             comment, requirement tags
//! ENTER  = STEP | content STEP | history HISTORY
//! TYPE   = bool | int INT..INT
//! BLOCK  = "{" {STMT (";" | line break)} "}"
//! STMT   = VAR ["[" EXPR "]"] := EXPR | raise EVENT | send SLOT | cancel SLOT | call OUTPUT LIST(EXPR) | code STRING STRING
//!        | if EXPR BLOCK [else BLOCK]
//! EXPR   = operators from loose to tight: or; and; not; = <> < <= > >= (not chained); + - bor bxor; * / mod band shl shr; then
//!          true | false | INT | LEAF ["[" EXPR "]"] | ( EXPR ) | -( EXPR ) | select( EXPR, EXPR, EXPR ) | and LIST(EXPR) | or LIST(EXPR)
//! LEAF   = SIGNAL | (input | var | timer) ?N | STEP.active | STEP.t | STEP.T | STEP.done | TRANSITION.fireable | ACTION.q | OUTPUT.out | rise(%N) | fall(%N)
//! NAME   = letters, digits, `_`, parts joined by `.`; any other name, a name that is a keyword here, or a name that
//!          ends in one of the endings of LEAF,
//!          is written in back quotes: `odd name`
//! ```
//!
//! `a and b and c` is one conjunction of three operands; `(a and b) and c` contains a nested conjunction. Strings and quoted names accept the escapes
//! `\n \t \r \\ \" \` \u{1F600}`.
//! `clears` is omitted if it equals the preceding steps (nothing for a reaction), `when` if it is `true`.

mod declarations;
mod erase;
mod expr;
mod lexer;
mod parse;
mod print;
mod statements;

pub use parse::parse;
pub use print::{print, print_condition, print_expr};

use crate::net::Net;

/// True if both nets are equal except for source locations.
#[must_use]
pub fn same(a: &Net, b: &Net) -> bool {
    a.without_spans() == b.without_spans()
}

/// Keywords that could be confused with a name, sorted; a name equal to one of them is quoted.
const RESERVED: &[&str] = &[
    "action",
    "and",
    "assert",
    "assume",
    "band",
    "bor",
    "bxor",
    "call",
    "cancel",
    "clears",
    "code",
    "content",
    "deadline",
    "device",
    "edge",
    "else",
    "emergency",
    "ending",
    "fall",
    "false",
    "force",
    "history",
    "if",
    "in",
    "input",
    "macro",
    "mod",
    "net",
    "never",
    "not",
    "of",
    "on",
    "open",
    "or",
    "output",
    "part",
    "pin",
    "place",
    "priority",
    "raise",
    "reaction",
    "req",
    "restart",
    "rise",
    "select",
    "send",
    "shl",
    "shr",
    "slot",
    "step",
    "timer",
    "transition",
    "true",
    "var",
    "when",
];

/// Endings of a leaf's name.
const SUFFIXES: &[&str] = &["T", "active", "done", "fireable", "out", "q", "t"];

/// True if the name can be written without quotes.
fn is_plain(name: &str) -> bool {
    let mut parts = name.split('.');
    parts.next().is_some_and(|first| first.starts_with(|c: char| c.is_alphabetic() || c == '_'))
        && name.split('.').all(|part| !part.is_empty() && part.chars().all(is_word_char))
        && name.rsplit_once('.').is_none_or(|(_, last)| SUFFIXES.binary_search(&last).is_err())
        && RESERVED.binary_search(&name).is_err()
}

fn is_word_char(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::span::FileId;
    use itertools::Itertools as _;

    #[test]
    fn words_are_sorted() {
        for list in [RESERVED, SUFFIXES, parse::HEADS] {
            assert!(list.is_sorted(), "{list:?}");
        }
        // A line of a block may begin with a variable's name; setting lines declare nothing, so their words cannot be confused with a name there.
        let settings = [
            "assign",
            "events",
            "evolution",
            "final",
            "fire",
            "policy",
            "queue",
            "schedule",
            "tick",
        ];
        let mut declarations = parse::HEADS.iter().filter(|head| !settings.contains(head));
        let missing = declarations.find(|head| RESERVED.binary_search(head).is_err());
        assert_eq!(missing, None);
    }

    #[test]
    fn the_form_reads_well() {
        let source = "\
net truck
policy priority-age
evolution single
schedule declared
tick 10000000 ns

part truck level 1

input m \"loading request\" bool

output R \"move right\" bool continuous
    emit p2 if not m

var n int 0..99 = 0

step p1 \"waiting\" req \"R12\" in truck initial
    entry { n := n + 1 }
step p2 in truck

transition t1 in truck p1 -> p2 when m and n < 99
transition t2 in truck p2 -> p1 when not (m or n = 3) and p2.t >= 5
    do {
        if n > 3 { n := 0 } else { n := -(n) - -1 }
    }
";
        let (net, findings) = parse(FileId(0), source);
        assert!(findings.is_empty(), "{findings:#?}");
        assert_eq!(print(&net.unwrap()), source);
    }

    #[test]
    fn all_slips_are_told_with_places_and_ways_out() {
        let source = "net a\npart a level x\nstep p1 in b\nstepp p2 in a\ntransition t in a p1 -> p3 when m +\npin x 99999999999\n";
        let (net, findings) = parse(FileId(0), source);
        assert!(net.is_none());
        let told = findings
            .iter()
            .map(|finding| {
                let place = &source[finding.labels[0].span.range()];
                let help = finding.help.clone().unwrap_or_default();
                format!("{} {place:?}: {}; {help}", finding.code.id, finding.message)
                    .trim_end()
                    .to_owned()
            })
            .join("\n");
        insta::assert_snapshot!(told, @r#"
        G0301 "x": expected a number, found `x`;
        G0302 "b": unknown partial chart `b`; write a name that an earlier line of this net declares, or declare this one in an earlier line
        G0301 "stepp": unknown declaration `stepp`; did you mean `step`?
        G0302 "p3": unknown step `p3`; write a name that an earlier line of this net declares, or declare this one in an earlier line
        G0302 "m": unknown input, event, variable or timer `m`; write a name that an earlier line of this net declares, or declare this one in an earlier line
        G0301 "\n": expected a value, found the end of the line;
        G0303 "99999999999": the number does not fit in 32 bits;
        "#);
    }
}
