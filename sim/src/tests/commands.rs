//! The commands of a session.

use super::net;
use crate::Command;
use grafsynth_ir::FileId;
use grafsynth_ir::net::InputId;

#[test]
fn a_line_is_commands_or_an_error_with_its_place() {
    let net = net("", "input a bool\ninput next bool\ninput n int 0..9\nstep p1 in g initial");
    let parse = |line: &str| {
        let parsed = Command::parse(&net, FileId(0), 100, line);
        parsed.map(|all| all.into_iter().map(|(command, _)| command).collect::<Vec<_>>())
    };
    let input = InputId::from_index;
    assert_eq!(parse("  # nothing"), Ok(vec![]));
    assert_eq!(
        parse("a; n = 7 ;react 3;; next # later"),
        Ok(vec![
            Command::Toggle(input(0)),
            Command::Set(input(2), 7),
            Command::React(3),
            Command::Next
        ])
    );
    assert_eq!(parse("set next"), Ok(vec![Command::Toggle(input(1))]));
    assert_eq!(parse("set next=1"), Ok(vec![Command::Set(input(1), 1)]));
    assert_eq!(parse("next=0"), Ok(vec![Command::Set(input(1), 0)]));
    assert_eq!(
        parse("dt 0;undo;u 2;q"),
        Ok(vec![Command::Dt(0), Command::Undo(1), Command::Undo(2), Command::Quit])
    );
    for (line, place, message) in [
        ("a; reakt 2", 103, "`reakt 2` is neither a command nor an input"),
        ("react 0", 100, "invalid number of reactions: `0`"),
        ("react -1", 100, "invalid number of reactions: `-1`"),
        ("dt 99999999999", 100, "invalid number of ticks: `99999999999`"),
        ("n", 100, "no value for the numeric input `n`"),
        ("n=10", 100, "invalid value for `n`: `10`"),
        ("n=", 100, "invalid value for `n`: ``"),
        ("=", 100, "`` is neither a command nor an input"),
        ("a 1", 100, "`a 1` is neither a command nor an input"),
        ("quit now", 100, "unexpected text after `quit`"),
        ("é;a=2", 103, "invalid value for `a`: `2`"),
    ] {
        let line = line.replace("é;", "a; ");
        let found = parse(&line).unwrap_err();
        assert_eq!(
            (found.message.as_str(), found.labels[0].span.start),
            (message, place),
            "{line}"
        );
    }
}

#[test]
fn a_short_name_is_enough_if_only_one_input_has_it() {
    let inputs = "input a.x bool\ninput a.go bool\ninput b.x bool\nstep p1 in g initial";
    let net = net("", inputs);
    let parse = |line: &str| {
        let parsed = Command::parse(&net, FileId(0), 0, line);
        parsed.map(|all| all.into_iter().map(|(command, _)| command).collect::<Vec<_>>())
    };
    assert_eq!(parse("go; b.x"), parse("a.go; b.x"));
    assert_eq!(parse("go"), Ok(vec![Command::Toggle(InputId::from_index(1))]));
    let found = parse("x").unwrap_err();
    assert_eq!(found.message, "`x` is the short name of 2 different inputs");
}
