//! Tests with networks and lists that are deep, long or converge repeatedly, on the default stack of a thread.

use super::parse;
use super::rules::{FREE, RULES};
use grafsynth_ir::diag::any_error;
use grafsynth_ir::{FileId, lower};

/// Whether a program with this body is read and lowered without errors.
fn is_read(body: &str) -> bool {
    let variables = |list: &str, names: [(&str, &str); 2]| {
        let one = |(name, ty)| format!("<variable name=\"{name}\"><type><{ty}/></type></variable>");
        format!("<{list}>{}</{list}>", names.map(one).concat())
    };
    let text = format!(
        "<project xmlns=\"http://www.plcopen.org/xml/tc6_0201\"><types><dataTypes/><pous><pou name=\"p\" pouType=\"program\">\
         <interface>{}{}</interface><body>{body}</body></pou></pous></types></project>",
        variables("inputVars", [("a", "BOOL"), ("i", "INT")]),
        variables("outputVars", [("q", "BOOL"), ("n", "INT")]),
    );
    let parsed = parse(FileId(0), &text);
    let Some(design) = parsed.design.filter(|_| !any_error(&parsed.diagnostics)) else {
        assert!(any_error(&parsed.diagnostics), "neither a design nor an error");
        return false;
    };
    let (net, found) = lower::lower(&design);
    assert!(net.is_some() || any_error(&found), "neither a net nor an error");
    net.is_some()
}

fn wired(from: &[usize]) -> String {
    let one = |id: &usize| format!("<connection refLocalId=\"{id}\"/>");
    let all: String = from.iter().map(one).collect();
    format!("<connectionPointIn>{all}</connectionPointIn>")
}

/// Contacts in series; each is wired to the one before it `n_wires` times.
fn ladder(n: usize, n_wires: usize, variable: &str) -> String {
    let contact = |id: usize| {
        let n_wires = if id == 1 { 1 } else { n_wires };
        let wires = wired(&vec![id - 1; n_wires]);
        format!("<contact localId=\"{id}\">{wires}<variable>{variable}</variable></contact>")
    };
    let contacts: String = (1..=n).map(contact).collect();
    let coil = format!("<coil localId=\"{}\">{}<variable>q</variable></coil>", n + 1, wired(&[n]));
    format!("<LD><leftPowerRail localId=\"0\"/>{contacts}{coil}</LD>")
}

/// Blocks in series.
fn diagram(n: usize) -> String {
    let block = |id: usize| {
        let input = |from| format!("<variable>{}</variable>", wired(&[from]));
        format!(
            "<block localId=\"{id}\" typeName=\"AND\"><inputVariables>{}{}</inputVariables>\
             <outputVariables><variable formalParameter=\"OUT\"/></outputVariables></block>",
            input(id - 1),
            input(0)
        )
    };
    let blocks: String = (1..=n).map(block).collect();
    let sink = format!(
        "<outVariable localId=\"{}\">{}<expression>q</expression></outVariable>",
        n + 1,
        wired(&[n])
    );
    let source = "<inVariable localId=\"0\"><expression>a</expression></inVariable>";
    format!("<FBD>{source}{blocks}{sink}</FBD>")
}

#[test]
fn rows_of_elements_are_bounded() {
    assert!(is_read(&ladder(60, 1, "a")));
    assert!(is_read(&diagram(60)));
    for n in [83, 84, 85, 86, 250, 2_000] {
        is_read(&diagram(n));
        for variable in
            ["a", &"NOT ".repeat(240), &format!("{}a{}", "(".repeat(120), ")".repeat(120))]
        {
            is_read(&ladder(n, 1, variable));
        }
    }
    assert!(!is_read(&diagram(2_000)));
}

#[test]
fn branches_that_meet_again_are_read_as_often_as_the_budget_allows() {
    assert!(is_read(&ladder(8, 2, "a")));
    assert!(!is_read(&ladder(60, 2, "a")));
}

/// The refused parts of an instruction list, each with the text at its span.
fn refusals(list: &str) -> Vec<(String, String)> {
    let text = format!(
        "<project><types><pous><pou name=\"p\" pouType=\"program\"><interface><inputVars><variable name=\"a\"><type><BOOL/></type>\
         </variable></inputVars><outputVars><variable name=\"q\"><type><BOOL/></type></variable></outputVars></interface>\
         <body><IL>{list}</IL></body></pou></pous></types></project>"
    );
    parse(FileId(0), &text)
        .diagnostics
        .iter()
        .filter(|one| one.is_error())
        .map(|one| {
            let span = one.labels[0].span;
            (one.message.clone(), text[span.start as usize..span.end as usize].to_owned())
        })
        .collect()
}

#[test]
fn every_sign_of_an_instruction_list_is_read_or_a_finding() {
    assert_eq!(refusals("LD a\nAND 2#10 (* seen *)\nST q").len(), 1, "a number is no truth value");
    assert_eq!(refusals("LD BOOL#1\nANDN a\nST q"), Vec::new());
    for (list, at) in [
        ("LD a ;\nST q", ";"),
        ("LD a ?\nST q", "?"),
        ("LD a, a\nST q", ","),
        ("LD a\n:= q\nST q", ":="),
        ("LD\nLD a\nST q", "LD"),
        ("LD +\nLD a\nST q", "LD"),
        ("LD a\nST q\nCAL", "CAL"),
        ("NOT\nLD a\nST q", "NOT"),
        ("AND( a\n)\nLD a\nST q", ")"),
        ("LD a\nFOO( a\n)\nLD a\nST q", ")"),
        ("LD a\nST q 'text", "'text"),
    ] {
        let found = refusals(list);
        assert!(found.iter().any(|(_, text)| text == at), "{list}: {found:?}");
    }
}

#[test]
fn instruction_lists_of_any_length_are_read_or_refused() {
    let list = |load: &str, each: &str, n: usize, store: &str, m: usize| {
        is_read(&format!("<IL>LD {load}\n{}{}</IL>", each.repeat(n), store.repeat(m)))
    };
    assert!(list("a", "AND a\n", 5_000, "ST q\n", 1));
    assert!(list("i", "ADD i\n", 50, "ST n\n", 1));
    assert!(!list("i", "ADD i\n", 50_000, "ST n\n", 1));
    assert!(!list("a", "NOT\n", 50_000, "ST q\n", 1));
    assert!(!list("a", "XOR a\nAND a\n", 50_000, "ST q\n", 1));
    assert!(!list("a", "AND a\n", 5_000, "ST q\n", 5_000));
    assert!(!list("a", "AND( a\n", 50_000, "ST q\n", 1));
    assert!(!list(&format!("a{}", ".a".repeat(50_000)), "", 0, "ST q\n", 1));
    list("i", "ADD i\n", 250, "ST n\n", 1);
    list("i", "ADD i\n", 255, "ST n\n", 1);
}

/// A block with an action, called from a program by the name of the instance. An action that is a chart is refused by name.
#[test]
fn actions_of_blocks_are_called_or_refused_by_name() {
    let project = |action: &str| {
        let variables = "<inputVars><variable name=\"step\"><type><INT/></type></variable></inputVars>\
             <outputVars><variable name=\"n\"><type><INT/></type></variable></outputVars>";
        let program = "<interface><outputVars><variable name=\"q\"><type><INT/></type></variable></outputVars>\
             <localVars><variable name=\"c\"><type><derived name=\"counter\"/></type></variable></localVars></interface>\
             <body><ST>c.step := 2; c.reset(); c.up(); c.up(); q := c.n;</ST></body>";
        format!(
            "<project><types><pous><pou name=\"counter\" pouType=\"functionBlock\"><interface>{variables}</interface><actions>\
             <action name=\"up\"><body>{action}</body></action>\
             <action name=\"reset\"><body><ST>n := 0; IF step = 0 THEN RETURN; END_IF; up();</ST></body></action>\
             </actions><body><ST>;</ST></body></pou><pou name=\"p\" pouType=\"program\">{program}</pou></pous></types></project>"
        )
    };
    let text = project("<ST>n := n + step;</ST>");
    let parsed = parse(FileId(0), &text);
    assert!(!any_error(&parsed.diagnostics), "{:#?}", parsed.diagnostics);
    let (net, found) = lower::lower(&parsed.design.expect("it was read"));
    assert!(net.is_some(), "{found:#?}");
    let found = parse(FileId(0), &project("<SFC/>")).diagnostics;
    let messages: Vec<&str> = found.iter().map(|one| one.message.as_str()).collect();
    assert_eq!(messages, ["the action `up` with its own chart is not supported"]);
}

#[test]
fn every_kind_of_the_table_has_one_rule_and_stands_somewhere() {
    let children = || RULES.iter().flat_map(|rule| rule.children).copied().flatten();
    for (name, kind, _) in children().filter(|(_, kind, _)| *kind != FREE) {
        assert_eq!(RULES.iter().filter(|rule| rule.kind == *kind).count(), 1, "{kind} of {name}");
    }
    for rule in RULES.iter().filter(|rule| rule.kind != "project") {
        assert!(children().any(|(_, kind, _)| *kind == rule.kind), "{} is used nowhere", rule.kind);
        let mut names: Vec<&str> =
            rule.attributes.iter().copied().flatten().map(|(name, _)| *name).collect();
        let n_names = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), n_names, "an attribute of {} is listed twice", rule.kind);
    }
}
