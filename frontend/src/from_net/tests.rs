//! Tests that lower charts, write them back, and lower them again.

use grafsynth_ir::net::Net;
use grafsynth_ir::{FileId, lower};
use itertools::Itertools as _;

use crate::graf;

#[track_caller]
fn lowered(text: &str) -> Net {
    let parsed = graf::parse(FileId(0), text);
    assert_eq!(parsed.diagnostics, [], "{text}");
    let (net, findings) = lower::lower(&parsed.design.unwrap());
    net.unwrap_or_else(|| panic!("{findings:#?}\n{text}")).into_inner()
}

/// A net as lines of text, without spans.
fn shape(net: &Net) -> String {
    let text = format!("{net:#?}");
    let mut out = String::new();
    let mut rest = text.as_str();
    while let Some(at) = rest.find("Span {") {
        out.push_str(&rest[..at]);
        let end = rest[at..].find('}').unwrap();
        out.push_str("Span");
        rest = &rest[at + end + 1..];
    }
    out.push_str(rest);
    out
}

/// Lowers, writes and lowers again, and compares both nets. Returns the text in between.
#[track_caller]
fn round(text: &str) -> String {
    let net = lowered(text);
    let written = graf::write_net(&net).unwrap_or_else(|findings| panic!("{findings:#?}"));
    let again = lowered(&written);
    let (left, right) = (shape(&net), shape(&again));
    let around = |text: &str, n: usize| text.lines().skip(n.saturating_sub(12)).take(20).join("\n");
    if let Some(n) = left.lines().zip(right.lines()).position(|(a, b)| a != b) {
        panic!("net\n{}\n=====\nagain\n{}\n=====\n{written}", around(&left, n), around(&right, n));
    }
    assert_eq!(left.len(), right.len(), "{written}");
    written
}

#[test]
fn the_truck_comes_back() {
    let text = round(graf::tests::TRUCK);
    assert!(text.contains("t1: p1 -> p2 when m"), "{text}");
    insta::assert_snapshot!(text);
}

#[test]
fn variables_timers_and_lists_come_back() {
    round(
        "chart c {
            conflict priority evolution stable limit 9 tick 20 ms assign simultaneous
            input n: int 0..9, a, synchronous
            input synchronous b
            output registered Q, W: int 0..5 = 3, S
            var v: int 0..9[4] = [1, 2, 3, 4], w: bool = true, u: int 5..9
            event E\ninternal event F
            timer T while a and v[1] > 2
            extern condition cold(): int 0..3\nextern action go(speed: int 0..9, bool), beep()
            initial step s0 \"first\" req \"R1\" { Q if a and T >= 1 s; entry { v[n mod 4] := n + 1; raise F } }
            step s1 { Q after 3 s; beep(); exit { if a { W := 2 } else { S := not w } } }
            step s2 { budget 90; task one cost 40 { call go(n, b) } task two cost 50 { w := a } code c \"x();\" }
            -> s2 when rise(a and s1.active) and not b
            t1: s0 -> s1 on E, F when a or cold = 2 after 60 ms priority 2 do { raise F; W := 1 }
            s0 -> s2 when if a then n > 3 else fall(b)
            s0 -> s0 when otherwise restart
            s1 & s2 -> sink when s2.done and s1.T < 40 ms and W = 3 and n * 2 - 1 > -5
            assume never (a and b)\nassert safe: always (Q or not S)
            device gal22v10 { clock 1 a 2 Q 23 }
        }",
    );
}

#[test]
fn controlled_actions_come_back() {
    let chart = |settings: &str, bodies: &str| {
        format!(
            "chart c {{ {settings}\ninput a\noutput P, Q, R\nextern action go(int 0..9)\ninitial step s0 {{ {bodies} }}\nstep s1 {{ reset Q; R }}\ns0 -> s1 when a\ns1 -> s0 when not a }}"
        )
    };
    round(&chart("final scan", "set Q if a; P pulse; P P0; go(3) P1"));
    round(&chart("", "Q SD 3 s; Q N; P DS 1 s; go(1) SL 2 s"));
    round(&chart("actions iec", "Q after 3 s; P; go(1) for 2 s"));
}

#[test]
fn reactions_keep_their_order() {
    round(
        "chart c { input a\nevent E\nvar n: int 0..9
            initial step s0 { on E { n := n + 1 } }
            t1: s0 -> s1 when a
            step s1 { on E when a { n := 0 } when n > 3 { n := 1 } }
            t2: s1 -> s0 when not a
        }",
    );
}

#[test]
fn macro_steps_are_folded_back() {
    let text = round(
        "chart c { input a, b\noutput R, Z
            macro fill { var k: int 0..3
                entry step e { entry { k := 1 } } exit step s { R } step x { Z if e.active or k > 2 }
                e -> x when a\n x -> s when b and e.t < 2 s }
            macro outer { entry step e\nmacro step in = fill\nexit step s\ne -> in when a\nin -> s when b }
            initial step p
            go: p -> m1 when a
            macro step m1 = outer \"first\"
            back: m1 & m2 -> p & m2 when m1.active and m1.in.x.active
            initial macro step m2 = fill
            out: m2.x -> m2 when a
        }",
    );
    assert!(text.contains("macro step m1 = m1_body \"first\""), "{text}");
    assert!(text.contains("go: p -> m1 when a"), "{text}");
}

#[test]
fn charts_beside_each_other_come_back() {
    round(
        "chart g { conflict all priority 2 input a output R initial step s { R } step r s -> r when a and h.y.active r -> s when h.b }
        chart h { priority 1 input b output Z initial step x { Z } step y { force g { r } } x -> y when b and g.r.active y -> x when not g.a }",
    );
}

#[test]
fn flat_statecharts_come_back() {
    round(
        "chart c { conflict inner-first queue 4 input a\nevent E\ninternal event F\noutput R
            initial step s { entry { send E after 1 s as x; raise F } exit { cancel x } on F { send E } } step r { R }
            t1: s -> r on E when a\nr -> s on F, E when not a }",
    );
}

#[test]
fn odd_names_come_back() {
    round(
        "chart `mod` { input X, int, `and`, `1`, é\noutput `or`\ninitial step `1.5` { `or` if `and` } step if_
            t_t: `1.5` -> if_ when X and int or é\nif_ -> `1.5` when `1` and `1.5`.t < 3 s }"
            .replace("if_", "`if`")
            .as_str(),
    );
}

#[test]
fn delays_that_begin_expired_are_refused_by_name() {
    let net =
        lowered("chart c { input a initial step s step r s -> r when 3 s/a/2 s r -> s when a }");
    let findings = graf::write_net(&net).unwrap_err();
    assert_eq!(findings.iter().map(|finding| finding.code.id).collect::<Vec<_>>(), ["G0120"]);
    // An on-delay becomes a declared timer.
    let net = lowered("chart c { input a initial step s step r s -> r when 3 s/a r -> s when a }");
    assert!(graf::write_net(&net).unwrap().contains("timer a_on_delay while a"));
}

#[test]
fn controlled_actions_with_lists_come_back() {
    let text = round(
        "chart c {
            conflict priority actions iec tick 20 ms
            input a
            output R, n: int 0..99
            extern action go()
            var v: bool
            action early { v := not v }
            output Q
            action count \"counts\" { if flag { n := n + 1 } else { n := 0 } }
            action flag
            initial step s { count pulse; Q; go pulse }
            step t { count P0; flag after 40 ms; R if flag; reset Q; early }
            s -> t when a and flag
            t -> s when not a
        }",
    );
    assert!(text.contains("action flag\n"), "{text}");
}

#[test]
fn states_come_back() {
    let text = round(
        "chart c {
            conflict inner-first queue 4
            input m
            event E, F, G, back
            internal event over
            output R, S, T
            var n: int 0..9
            state off { R; entry { n := 0 } on G { n := n + 1 } }
            initial state busy {
                initial -> slow do { n := 1 }
                history last -> left
                state left { S }
                state right {
                    state fast
                    state slow { T; exit { raise over } }
                    fast -> slow on E
                    slow -> fast on E when m
                }
                left -> slow on F
                final state out
                right -> fast on G internal
                right -> out on G
            }
            off -> busy on E
            off -> busy.last on F
            busy -> off on over
            busy -> off on busy.done
            busy -> left on back do { n := n + 1 }
        }",
    );
    assert!(text.contains("initial -> slow do { n := 1 }"), "{text}");
    assert!(text.contains("history last -> left"), "{text}");
}

#[test]
fn regions_and_deep_history_come_back() {
    let text = round(
        "chart c {
            conflict outer-first queue 8
            input m
            event E, F, G, H
            output R
            initial state idle { on E when m { raise F } }
            parallel work {
                history deep all
                region a { initial state a1 state a2 { R } a1 -> a2 on E in a2 on F do { raise G } }
                region b {
                    initial -> b2.y
                    state b1
                    state b2 { history h -> x state x state y x -> y on E when otherwise y -> x on F }
                    b1 -> b2.h on G
                    b2 -> b1 on H when m
                }
            }
            idle -> work on E
            idle -> a2 & b1 on F
            idle -> work.all on G
            work -> idle on H
            a2 -> b1 on F
            a1 -> work on G
        }",
    );
    assert!(text.contains("idle -> a2 & b1 on F"), "{text}");
    assert!(text.contains("idle -> work.all on G"), "{text}");
}

#[test]
fn enclosing_steps_come_back() {
    let text = round(
        "chart c {
            evolution stable
            input a, b, d
            output R, S, T
            macro part { entry step e { R } exit step x e -> x when a }
            initial step p
            enclosing step run {
                priority 3
                step w * { S }
                step v
                var k: int 0..3
                w -> v when a do { k := 2 }
                enclosing step deep * { step z * { T } macro step m = part z -> m when b m -> z when d }
                v -> w when b
                -> v when d
            }
            step q { R if m.e.active and k > 1 }
            p -> run when a
            run -> q when b
            run -> run when d restart
            q -> p when a
            macro holder {
                entry step i
                enclosing step o { step i2 * i2 -> sink when a }
                exit step j
                i -> o when a o -> j when b
            }
            macro step outer = holder
            q -> outer when d
            outer -> p when d
        }",
    );
    assert!(text.contains("enclosing step deep *"), "{text}");
}

#[test]
fn charts_of_states_beside_each_other_come_back() {
    round(
        "chart g { conflict inner-first queue 2 event E initial state s { state t state u t -> u on E } final state f s -> f on E when h.y.active }
        chart h { conflict inner-first state x state y { state z } x -> y when g.u.active y -> x when g.u.active }",
    );
}
