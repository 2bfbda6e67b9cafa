//! What a plant file may contain, and what its errors say.

use super::parse;
use crate::graf::Limits;
use grafsynth_ir::net::Net;
use grafsynth_ir::plant::{Condition, Plant, Reading, SCALE, Sensor};
use grafsynth_ir::{Diagnostic, FileId, Valid, lower};

fn net() -> Valid<Net> {
    let text = "chart c { input a, b\n input n: int 0..9\n event e\n output R\n output v: int 0..9 = 0\n initial step s { R } }";
    let parsed = crate::graf::parse(FileId(0), text);
    let (net, found) = lower::lower(&parsed.design.expect("a chart"));
    net.unwrap_or_else(|| panic!("{found:#?}"))
}

fn read(text: &str) -> (Option<Plant>, Vec<Diagnostic>) {
    parse(&net(), FileId(0), text, &Limits::default())
}

fn plant(text: &str) -> Plant {
    let (plant, found) = read(&format!("view 10, 10\n{text}"));
    plant.unwrap_or_else(|| panic!("{found:#?}"))
}

/// The code, the message and the marked text of each finding.
fn errors(text: &str) -> Vec<(&'static str, String, String)> {
    let text = format!("view 10, 10\n{text}");
    let (plant, found) = read(&text);
    assert_eq!(plant, None);
    let marked = |it: &Diagnostic| {
        it.labels.first().map_or(String::new(), |label| text[label.span.range()].to_owned())
    };
    found.iter().map(|it| (it.code.id, it.message.clone(), marked(it))).collect()
}

#[test]
fn items_are_resolved() {
    let plant = plant(
        "quantity pos \"position\": -5..100 = 3   # a comment\nmove pos by -20 * v when R and not a\nset pos := 0 when pos > 90 or b\n\
         input a = pos <= 2\ninput n = pos\nrect 1 + pos, 10 - pos * 3 / 4, 2, 3 fill blue when v >= 2\ntext 1, 2, \"go\"",
    );
    let quantity = plant.quantities.values().next().expect("a quantity");
    assert_eq!((quantity.lo, quantity.hi, quantity.init), (-5, 100, 3));
    assert_eq!(plant.moves[0].rate, -20);
    assert!(plant.moves[0].speed.is_some());
    let Condition::Any(any) = &plant.sets[0].when else { panic!("{:?}", plant.sets[0]) };
    let id = plant.moves[0].quantity;
    assert_eq!(any[0], Condition::Within(Reading::Quantity(id), Some(90 * SCALE + 1), None));
    assert_eq!(plant.sensors[1].1, Sensor::Measures(id));
    assert_eq!(plant.shapes[0].places[1].base, 10);
    assert_eq!(plant.shapes[0].places[1].terms, [(id, -3, 4)]);
    assert_eq!(plant.shapes[1].text, "go");
}

#[test]
fn names_have_suggestions_and_places() {
    let found = errors(
        "quantity pos: 0..9\nmove pso by 1\ninput x = pos < 1\ncircl 1, 2, 3\nline 1, 2, 3, 4 fill blu",
    );
    let codes: Vec<_> = found.iter().map(|(code, _, marked)| (*code, marked.as_str())).collect();
    assert_eq!(
        codes,
        [("G0122", "pso"), ("G0122", "x"), ("G0104", "circl"), ("G0104", "blu")],
        "{found:#?}"
    );
}

#[test]
fn what_a_plant_cannot_do_is_refused() {
    for (text, code, marked) in [
        ("quantity R: 0..1", "G0123", "R"),
        ("quantity q: 0..1\nquantity q: 0..1", "G0123", "q"),
        ("quantity q: 1..1", "G0114", "1..1"),
        ("quantity q: 0..9000001", "G0105", "9000001"),
        ("quantity q: 0..1 = 2", "G0105", "2"),
        ("quantity q: 0..1\nmove q by 1000001", "G0105", "1000001"),
        ("quantity q: 0..1\nmove q by 1 * R", "G0123", "R"),
        ("quantity q: 0..1\nmove q by 1 * a", "G0123", "a"),
        ("quantity q: 0..1\nset q := 2 when a", "G0105", "2"),
        ("move a by 1", "G0123", "a"),
        ("input R = a", "G0123", "R"),
        ("input e = a", "G0123", "e"),
        ("input a = e", "G0123", "e"),
        ("input a = n", "G0101", ""),
        ("input n = a", "G0123", "a"),
        ("input a = R\ninput a = R", "G0112", "a"),
        ("view 1, 2", "G0112", "view 1, 2"),
        ("rect 1, 2, 3", "G0101", ""),
        ("rect a, 2, 3, 4", "G0123", "a"),
        ("text 1, 2, go", "G0101", "go"),
        ("pos 1", "G0104", "pos"),
        ("7", "G0101", "7"),
    ] {
        let found = errors(text);
        let found: Vec<_> = found.iter().map(|(code, _, marked)| (*code, &**marked)).collect();
        assert_eq!(found, [(code, marked)], "{text}");
    }
    let (plant, found) = read("rect 1, 2, 3, 4");
    assert_eq!((plant, found.len(), found[0].code.id), (None, 1, "G0117"));
}

#[test]
fn limits_end_the_reading() {
    let deep = format!("input a = {}R{}", "(".repeat(300), ")".repeat(300));
    assert_eq!(errors(&deep)[0].0, "G0107");
    let not = format!("input a = {}R", "not ".repeat(300));
    assert_eq!(errors(&not)[0].0, "G0107");
    let many = "circle 1, 2, 3\n".repeat(600);
    let found = errors(&many);
    assert_eq!((found.len(), found[0].0), (1, "G0123"));
}
