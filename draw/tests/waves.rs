//! Waveforms are read back from their geometry.

use crate::reader::{self, Line};
use grafsynth_draw::waves::{Group, Signal, Waves};
use grafsynth_draw::{svg, waves};

/// Waveforms with two signals of each kind and 60 reactions.
fn example() -> Waves {
    let mut state = 7_u64;
    let mut next = |n: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 33) % n
    };
    let mut signal = |name: &str, group, is_bool: bool| {
        let values = (0..60).map(|_| match next(9) {
            0 if group != Group::Input => None,
            _ => Some(next(if is_bool { 2 } else { 4 }) as i64),
        });
        Signal { name: name.to_owned(), group, is_bool, values: values.collect() }
    };
    Waves {
        title: "lamp".to_owned(),
        ticks: (0..60).collect(),
        tick_ns: Some(1_000_000),
        fired: (0..60).map(|row| row % 7 == 3).collect(),
        signals: vec![
            signal("a", Group::Input, true),
            signal("n", Group::Input, false),
            signal("p1", Group::Step, true),
            signal("R", Group::Output, true),
            signal("v", Group::Variable, false),
        ],
        is_blank: false,
    }
}

/// The values of each lane, from the lines and numbers in it.
fn read(text: &str) -> Vec<(String, Vec<Option<i64>>)> {
    let document = roxmltree::Document::parse(text).expect("it is XML");
    let of_class = |class: &str| -> Vec<Line> {
        let nodes = document.descendants().filter(|it| it.tag_name().name() == "line");
        let number = |node: &roxmltree::Node<'_, '_>, name: &str| -> i64 {
            node.attribute(name).and_then(|it| it.parse().ok()).expect("it is a number")
        };
        nodes
            .filter(|it| it.attribute("class") == Some(class))
            .map(|it| Line {
                x1: number(&it, "x1"),
                y1: number(&it, "y1"),
                x2: number(&it, "x2"),
                y2: number(&it, "y2"),
            })
            .collect()
    };
    let shapes = reader::shapes(text).expect("it is there");
    let mut lanes: Vec<(String, Vec<Option<i64>>)> = Vec::new();
    let grid = of_class("g");
    let mut names: Vec<&reader::Text> =
        shapes.texts.iter().filter(|it| it.x == 16 && it.class.is_empty()).collect();
    names.sort_by_key(|it| it.y);
    for name in names {
        let at = match lanes.iter().position(|(other, _)| *other == name.text) {
            Some(at) => at,
            None => {
                lanes.push((name.text.clone(), Vec::new()));
                lanes.len() - 1
            }
        };
        let (top, bottom) = (name.y - 11, name.y + 3);
        let is_here = |y: i64| top <= y && y <= bottom;
        let mut columns: Vec<i64> =
            grid.iter().filter(|it| it.y1 < name.y && name.y < it.y2).map(|it| it.x1).collect();
        columns.sort_unstable();
        for pair in columns.windows(2) {
            let middle = (pair[0] + pair[1]) / 2;
            let over = |it: &&Line| it.x1 <= middle && middle <= it.x2 && it.y1 == it.y2;
            let rows: Vec<i64> =
                shapes.links.iter().filter(over).map(|it| it.y1).filter(|y| is_here(*y)).collect();
            let number = shapes.texts.iter().filter(|it| it.class == "s" && is_here(it.y));
            let number = number.filter(|it| it.x > 40 && it.x <= middle).max_by_key(|it| it.x);
            lanes[at].1.push(match rows.as_slice() {
                [] => None,
                [y] => Some(i64::from(*y == top)),
                _ => number.and_then(|it| it.text.parse().ok()),
            });
        }
    }
    lanes
}

#[test]
fn waveforms_are_the_trace() {
    let example = example();
    let text = svg(&waves(&example));
    let lanes = read(&text);
    assert_eq!(lanes.len(), example.signals.len());
    for ((name, values), signal) in lanes.iter().zip(&example.signals) {
        assert_eq!((name, values), (&signal.name, &signal.values));
    }
    // Each reaction in which a transition fired has an arrowhead.
    let n_fired = example.fired.iter().filter(|fired| **fired).count();
    assert_eq!(text.matches("<path class=\"a\"").count(), n_fired);
}

#[test]
fn empty_waveforms_show_only_inputs() {
    let example = Waves { is_blank: true, ..example() };
    let text = svg(&waves(&example));
    for ((name, values), signal) in read(&text).iter().zip(&example.signals) {
        if signal.group == Group::Input {
            assert_eq!((name, values), (&signal.name, &signal.values));
        } else {
            assert!(values.iter().all(Option::is_none), "{name}");
        }
    }
    assert!(!text.contains("<path class=\"a\""));
}

#[test]
fn a_long_trace_is_cut_with_a_note() {
    let signal = Signal {
        name: "a".to_owned(),
        group: Group::Input,
        is_bool: true,
        values: vec![Some(1); 1000],
    };
    let ticks = (0..1000).collect();
    let long = Waves { ticks, signals: vec![signal], ..Waves::default() };
    let picture = waves(&long);
    assert!(svg(&picture).contains("reactions 400 to 999 are not drawn"));
    assert!(picture.width <= 794, "{}", picture.width);
}
