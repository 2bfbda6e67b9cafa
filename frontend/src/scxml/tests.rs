use super::*;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, lower, text};
use itertools::Itertools as _;

fn net(source: &str) -> Valid<Net> {
    let parsed = parse(FileId(0), source);
    assert!(!any_error(&parsed.diagnostics), "{:#?}", parsed.diagnostics);
    let (net, found) = lower::lower(&parsed.design.unwrap());
    net.unwrap_or_else(|| panic!("{found:#?}"))
}

/// A document with one state that contains this text.
fn document(data: &str, inside: &str) -> String {
    format!(
        "<scxml xmlns='{SCXML}' xmlns:g='{GRAFSYNTH}' version='1.0'>{data}<state id='s'>{inside}</state><state id='r'/></scxml>"
    )
}

/// Codes, messages and labelled texts of the findings.
fn told(source: &str) -> Vec<String> {
    let parsed = parse(FileId(0), source);
    parsed
        .diagnostics
        .iter()
        .map(|one| {
            let place = one.labels.first().map_or("", |label| &source[label.span.range()]);
            format!("{} {} at {place}", one.code.id, one.message)
        })
        .collect()
}

fn var<'n>(net: &'n Net, name: &str) -> &'n grafsynth_ir::net::Var {
    net.vars.values().find(|var| var.name.text == name).unwrap()
}

#[test]
fn ranges_are_those_that_assignments_reach() {
    let data = "<datamodel><data id='error' expr='0'/><data id='n' expr='0'/><data id='m' expr='3' g:range='0..9'/><data id='k' expr='5'/></datamodel>";
    let inside = "<onentry><assign location='error' expr='1'/><assign location='n' expr='n + 1'/><assign location='k' expr='m * 2'/></onentry>";
    let net = net(&document(data, inside));
    assert_eq!(var(&net, "error").ty.bounds(), (0, 1));
    assert_eq!(var(&net, "n").ty.bounds(), (0, 32_767));
    assert_eq!(var(&net, "m").ty.bounds(), (0, 9));
    assert_eq!(var(&net, "k").ty.bounds(), (0, 18));
}

#[test]
fn an_element_that_stands_nowhere_is_named_with_the_nearest_one() {
    let source = document("", "<onentri/><transition evnet='e' target='r'/>");
    assert_eq!(
        told(&source),
        [
            "G0423 unknown SCXML element <onentri> at <onentri/>",
            "G0424 <transition> has no attribute `evnet` at evnet",
        ]
    );
}

#[test]
fn what_a_controller_has_not_is_refused_with_its_place() {
    let source = document(
        "<datamodel><data id='a' expr=\"'text'\"/><data id='b' expr='1.5'/><data id='c' expr='{}'/></datamodel>",
        "<invoke type='scxml'/><onentry><script>x()</script><assign location='a' expr='f(1)'/></onentry><transition event='e' cond='_event.data == 1' target='r'/>",
    );
    assert_eq!(
        told(&source),
        [
            "G0425 a string is not supported at '",
            "G0425 the fraction `1.5` is not supported at 1.5",
            "G0425 an object is not supported at {",
            "G0425 <invoke> is not supported at <invoke type='scxml'/>",
            "G0425 <script> is not supported at <script>",
            "G0425 a call of `f` is not supported at f",
            "G0425 the data of an event is not supported at _event",
        ]
    );
}

#[test]
fn places_in_escaped_conditions_are_those_of_the_source() {
    let data = "<datamodel><data id='n' expr='0'/></datamodel>";
    let source = document(data, "<transition cond='n &lt; 3 &amp;&amp; wrong' target='r'/>");
    assert_eq!(told(&source), ["G0430 unknown data element `wrong` at wrong"]);
}

#[test]
fn c_has_numbers_for_truth_values_and_ecmascript_has_not() {
    let inside = "<onentry><assign location='n' expr='(n == 0) + 1'/></onentry>";
    let data = "<datamodel><data id='n' expr='0'/></datamodel>";
    let source = document(data, inside);
    assert_eq!(told(&source), ["G0429 expected a number, found a Boolean at n == 0"]);
    let source = source.replace("version=", "datamodel='c89' version=");
    assert_eq!(var(&net(&source), "n").ty.bounds(), (0, 2));
}

#[test]
fn descriptors_match_whole_tokens() {
    let source = document(
        "",
        "<onentry><raise event='a.b'/><raise event='ab'/></onentry><transition event='a' target='r'/><transition event='*' target='s'/>",
    );
    let net = net(&source);
    let events = |at: usize| {
        let (_, transition) = net.transitions.iter().nth(at).unwrap();
        let names = transition.events.iter().map(|event| net.inputs[*event].name.text.clone());
        names.collect::<Vec<_>>()
    };
    assert_eq!(events(0), ["a_b"]);
    assert_eq!(events(1), ["a_b", "ab"]);
}

#[test]
fn a_send_is_cancelled_from_anywhere() {
    let source = document(
        "",
        "<state id='in'><onentry><send event='e' delay='1s' id='x'/></onentry></state><onexit><cancel sendid='x'/></onexit><transition event='e' target='r'/>",
    );
    assert_eq!(net(&source).sends.len(), 1);
}

#[test]
fn loops_stay_within_bounds() {
    let list = vec!["1"; 400].join(",");
    let source = document(
        "<datamodel><data id='n' expr='0'/></datamodel>",
        &format!(
            "<onentry><foreach array='[{list}]' item='a'><foreach array='[{list}]' item='b'><assign location='n' expr='a'/></foreach></foreach></onentry>"
        ),
    );
    let found = told(&source);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].starts_with("G0436 the loops of the chart expand to more than"), "{found:?}");
}

#[test]
fn long_chains_are_refused_before_they_cost_a_stack() {
    let data = "<datamodel><data id='n' expr='0'/></datamodel>";
    for text in
        [vec!["n"; 50_000].join(" + "), "(".repeat(50_000), "!".repeat(50_000), "-".to_owned()]
    {
        let source = document(data, &format!("<transition cond='{text}' target='r'/>"));
        assert_eq!(told(&source).len(), 1);
    }
    let arms = "<elseif cond='n == 1'/>".repeat(50_000);
    let source = document(data, &format!("<onentry><if cond='n == 2'>{arms}</if></onentry>"));
    assert!(told(&source)[0].starts_with("G0107"), "{:?}", told(&source));
    // Two thousand operands of one operator do not increase the depth.
    let wide = vec!["n == 1"; 2_000].join(" || ");
    net(&document(data, &format!("<transition cond='{wide}' target='r'/>")));
}

/// The allowed children and attributes of each element (SCXML 1.0, the tables of sections 3 to 6); `!` marks a required one.
const STRUCTURE: [(&str, &str, &str); 18] = [
    ("scxml", "state parallel final datamodel", "initial name version! datamodel binding"),
    (
        "state",
        "onentry onexit transition initial state parallel final history datamodel",
        "id initial",
    ),
    ("parallel", "onentry onexit transition state parallel history datamodel", "id"),
    ("transition", "raise if assign send cancel", "event cond target type"),
    ("initial", "transition", ""),
    ("final", "onentry onexit", "id"),
    ("history", "transition", "id type"),
    ("onentry", "raise if assign send cancel", ""),
    ("onexit", "raise if assign send cancel", ""),
    ("datamodel", "data", ""),
    ("data", "", "id! expr"),
    ("if", "elseif else raise if assign send cancel", "cond!"),
    ("elseif", "", "cond!"),
    ("else", "", ""),
    ("raise", "", "event!"),
    ("assign", "", "location! expr"),
    ("send", "", "event id delay"),
    ("cancel", "", "sendid!"),
];

/// Checks that a document follows the rules of the recommendation for elements, attributes, identifiers and targets.
fn assert_structure(text: &str) {
    let document = roxmltree::Document::parse(text).unwrap();
    let ids: Vec<&str> = document
        .descendants()
        .filter(|node| !matches!(node.tag_name().name(), "data" | "send"))
        .filter_map(|node| node.attribute("id"))
        .collect();
    for (at, id) in ids.iter().enumerate() {
        assert!(!ids[..at].contains(id), "{id} twice in\n{text}");
    }
    for node in document.descendants().filter(roxmltree::Node::is_element) {
        let name = node.tag_name().name();
        assert_eq!(node.tag_name().namespace(), Some(super::SCXML), "{name} in\n{text}");
        let (_, children, attributes) =
            STRUCTURE.iter().find(|(known, ..)| *known == name).unwrap_or_else(|| panic!("{name}"));
        for child in node.children().filter(roxmltree::Node::is_element) {
            let child = child.tag_name().name();
            assert!(children.split(' ').any(|it| it == child), "{child} in {name}\n{text}");
        }
        for attribute in node.attributes().filter(|it| it.namespace().is_none()) {
            let known = |it: &str| it.trim_end_matches('!') == attribute.name();
            assert!(attributes.split(' ').any(known), "{} of {name}\n{text}", attribute.name());
        }
        for required in attributes.split(' ').filter_map(|it| it.strip_suffix('!')) {
            assert!(node.has_attribute(required), "{name} without {required}\n{text}");
        }
        let n =
            |word: &str| node.children().filter(|it| it.has_tag_name((super::SCXML, word))).count();
        assert!(n("initial") <= 1 && (n("initial") == 0 || node.attribute("initial").is_none()));
        if matches!(name, "initial" | "history") {
            let transition = node.children().find(roxmltree::Node::is_element).unwrap();
            assert!(n("transition") == 1 && transition.has_attribute("target"), "{name}\n{text}");
            assert!(!transition.has_attribute("event") && !transition.has_attribute("cond"));
        }
        if name == "transition" && node.attributes().all(|it| it.name() == "type") {
            panic!("a transition needs an event, a condition or a target\n{text}");
        }
        for targets in [node.attribute("target"), node.attribute("initial")].into_iter().flatten() {
            assert!(targets.split(' ').all(|it| ids.contains(&it)), "{targets} in\n{text}");
        }
    }
}

#[test]
fn what_is_written_is_a_document_of_the_recommendation() {
    let chart = "chart c { conflict outer-first queue 2 event E, F\ninternal event G\noutput R
        var n: int 0..9
        initial state p {
            initial -> b do { n := 1 }
            history h -> a
            step a { R }
            step b { entry { if n > 3 { raise G } else { n := n + 1 } } }
            a -> b after 2 s
            b -> a on E when n > 2 after 1 s
        }
        final state f
        p -> f on F
        p -> p.h on G }";
    let design = crate::graf::parse(FileId(0), chart).design.unwrap();
    let lowered = grafsynth_ir::lower::lower(&design).0.unwrap();
    let (written, lost) = write_design(&design, &lowered).unwrap();
    assert_eq!(lost.len(), 4, "{lost:#?}");
    assert_structure(&written);
    net(&written);
}

#[test]
fn what_is_written_is_read_as_it_was() {
    let folder = format!("{}/../tests/scxml/w3c", env!("CARGO_MANIFEST_DIR"));
    let mut n = 0;
    #[expect(clippy::disallowed_methods, reason = "the test reads charts")]
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let source = std::fs::read_to_string(&path).unwrap();
        let design = parse(FileId(0), &source).design.unwrap();
        let before = net(&source);
        let (written, lost) = write_design(&design, &before).unwrap();
        assert!(lost.is_empty(), "{path:?}: {lost:#?}");
        assert_structure(&written);
        let after = net(&written);
        assert_eq!(text::print(&before), text::print(&after), "{path:?}\n{written}");
        let design = parse(FileId(0), &written).design.unwrap();
        assert_eq!(write_design(&design, &after).unwrap().0, written, "{path:?}");
        n += 1;
    }
    assert_eq!(n, 52);
}

#[test]
fn lists_of_names_are_bounded_one_by_one_and_together() {
    let transition = |from: usize, n: usize| {
        let names = (from..from + n).map(|index| format!("e{index}")).join(" ");
        format!("<transition event='{names}' target='r'/>")
    };
    let sizes = |inside: &str| {
        let found = told(&document("", inside));
        found.iter().filter(|one| one.starts_with("G0436")).count()
    };
    assert_eq!(sizes(&transition(0, 5_000)), 0);
    assert_eq!(sizes(&transition(0, 10_001)), 1);
    let many: String = (0..8).map(|part| transition(part * 9_000, 9_000)).collect();
    assert_eq!(sizes(&many), 1);
    // `*` becomes a list of all events.
    let all = "<transition event='*' target='r'/>".repeat(600);
    assert_ne!(sizes(&(transition(0, 400) + &all)), 0);
}
