//! Pages and drawings of small charts: their contents match the fuses, and every drawing is XML.

use super::chip::{Cell, Chip};
use super::document::{Block, Document, Section, Table};
use super::drawing::{Drawing, PinRole, Shape};
use super::svg::{Anchor, Pen, Svg, width};
use super::{markdown, markdown_files, table};
use crate::pipeline::{self, BuildOptions, Built, OutputFile};
use crate::source::Sources;
use crate::target::Target;
use grafsynth_backend_pld::Dialect;
use grafsynth_backend_pld::device::DEVICES;
use grafsynth_frontend::graf;
use grafsynth_ir::{Valid, lower, net::Net};
use grafsynth_verify::Limits;

const TRUCK: &str = "chart truck {
    input m \"request & <more>\", b req \"R1\", p, a
    output R req \"R2\", Z, L
    assume never (a and b)
    assert never (R and L) req \"R3\"
    initial step p1 \"wäiting\"
    step p2 { R }
    step p3 { Z }
    step p4 { L }
    t1: p1 -> p2 when m req \"R4\"
    p2 -> p3 when b
    p3 -> p4 when p
    p4 -> p1 when a
}";

fn net(text: &str) -> (Valid<Net>, Sources) {
    let mut sources = Sources::default();
    let file = sources.add("chart.graf", text);
    let parsed = graf::parse(file, text);
    let (net, found) = lower::lower(&parsed.design.expect("a chart"));
    (net.unwrap_or_else(|| panic!("{found:?}")), sources)
}

fn built(text: &str, targets: &[Target], options: &BuildOptions) -> (Built, Vec<OutputFile>) {
    let (net, sources) = net(text);
    let limits = Limits::default();
    let facts = pipeline::facts(&net, &limits);
    let options = BuildOptions { report: true, prove: true, dont_cares: true, ..options.clone() };
    let built = pipeline::build(&net, &facts, targets, &options);
    let report = super::document(&net, &facts, &built, None, &sources, &limits);
    let pages = markdown_files(&report, &options.stem_for(&net));
    (built, pages)
}

fn on(device: &str) -> BuildOptions {
    BuildOptions { device: Some(device.to_owned()), ..BuildOptions::default() }
}

fn document(text: &str) -> roxmltree::Document<'_> {
    roxmltree::Document::parse(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

#[test]
fn text_is_escaped_and_cut() {
    let mut svg = Svg::new(100, 50, "<é>");
    let pen = Pen { size: 10, colour: "#000", is_bold: true };
    svg.text((1, 2), Anchor::End, pen, "a name that has no room <", 40);
    svg.text((1, 2), Anchor::Start, pen, "a&b", 40);
    let text = svg.finish();
    let parsed = document(&text);
    let texts: Vec<String> = (parsed.descendants().filter(|node| node.has_tag_name("text")))
        .map(|node| {
            node.children()
                .filter(|child| child.is_text())
                .filter_map(|child| child.text())
                .collect()
        })
        .collect();
    assert_eq!(texts, ["a nam…", "a&b"]);
    assert!(texts.iter().all(|text| width(text, 10) <= 40), "{texts:?}");
    let title = parsed.descendants().find(|node| node.has_tag_name("title"));
    assert_eq!(title.and_then(|node| node.text()), Some("<é>"));
}

#[test]
fn wide_letters_take_two_columns_in_tables() {
    let mut rows = Table::new(["Name", "Is"]);
    rows.row(["計器".to_owned(), "a|b".to_owned()]);
    let section = Section {
        id: "x",
        output: None,
        is_part: false,
        title: "x".to_owned(),
        blocks: vec![Block::Table(rows)],
    };
    let text = markdown(&Document { sections: vec![section], ..Document::default() });
    let text = text.split_once("\n|").map_or("", |(_, table)| table);
    let text = format!("|{text}");
    let lengths: Vec<usize> = text.lines().map(table::width).collect();
    assert!(lengths.windows(2).all(|pair| pair[0] == pair[1]), "{text}");
    assert!(text.contains("a\\|b"), "{text}");
}

/// For every device that the truck chart fits: the package has each pin once, every signal is drawn at its pin, and the picture is XML that stays
/// within its frame.
#[test]
fn every_device_has_its_drawing() {
    let mut n_drawn = 0;
    for device in DEVICES {
        let (built, pages) = built(TRUCK, &[Target::Logic(Dialect::Palasm)], &on(device.name));
        let Some(chip) = built.chips.first() else {
            // The device has no flip-flops, or fewer than the chart has steps; this is reported.
            assert!(!built.found.is_empty(), "{}", device.name);
            continue;
        };
        let drawing = Drawing::of(chip);
        if drawing.shape != Shape::Symbol {
            n_drawn += 1;
            let numbers: Vec<u32> = drawing.pins.iter().filter_map(|pin| pin.number).collect();
            assert_eq!(numbers, (1..=device.n_pins).collect::<Vec<_>>(), "{}", device.name);
            for signal in &chip.signals {
                let Some(pin) = signal.pin else { continue };
                let mark = &drawing.pins[pin as usize - 1];
                assert!(mark.name.contains(&signal.on_pin()), "{}: {mark:?}", device.name);
                assert!(!matches!(mark.role, PinRole::Supply | PinRole::Ground | PinRole::Idle));
                assert!(drawing.text().contains(&signal.on_pin()));
            }
        }
        check_svg(&pages[1].text);
    }
    assert!(n_drawn >= 5, "{n_drawn}");
}

/// Checks that a picture is XML and that nothing in it is outside its frame.
fn check_svg(text: &str) {
    let parsed = document(text);
    let root = parsed.root_element();
    let number = |node: roxmltree::Node<'_, '_>, key: &str| -> u32 {
        node.attribute(key)
            .and_then(|value| value.parse().ok())
            .unwrap_or_else(|| panic!("{key}: {node:?}"))
    };
    let (picture, height) = (number(root, "width"), number(root, "height"));
    for node in parsed.descendants() {
        match node.tag_name().name() {
            "rect" => {
                assert!(number(node, "x") + number(node, "width") <= picture, "{node:?}");
                assert!(number(node, "y") + number(node, "height") <= height, "{node:?}");
            }
            "text" if node.attribute("transform").is_none() => {
                let letters: String = (node.children())
                    .filter(|child| child.is_text())
                    .filter_map(|child| child.text())
                    .collect();
                let wide = width(&letters, number(node, "font-size"));
                let x = number(node, "x");
                let (first, last) = match node.attribute("text-anchor") {
                    Some("end") => (x.checked_sub(wide), x),
                    Some("middle") => (x.checked_sub(wide / 2), x + wide / 2),
                    _ => (Some(x), x + wide),
                };
                assert!(first.is_some() && last <= picture, "`{letters}` is cut off\n{text}");
            }
            _ => {}
        }
    }
}

/// Labels may contain any characters: no label ends a block of the page, breaks one of its lines, or makes the drawing invalid XML.
#[test]
fn odd_labels_stay_on_their_lines() {
    let (net, sources) = net(TRUCK);
    let mut net: Net = (*net).clone();
    for (_, step) in net.steps.iter_mut() {
        step.meta.label = "a\n```\n# <odd> & | `b`\u{1}".to_owned();
    }
    let net = grafsynth_ir::validate(net).expect("labels are free");
    let limits = Limits::default();
    let facts = pipeline::facts(&net, &limits);
    let options = BuildOptions { report: true, ..on("gal22v10") };
    let targets = [Target::Jedec, Target::Logic(Dialect::Verilog)];
    let built = pipeline::build(&net, &facts, &targets, &options);
    let report = super::document(&net, &facts, &built, None, &sources, &limits);
    let pages = markdown_files(&report, &options.stem_for(&net));
    assert_eq!(pages.len(), 3, "{:?}", built.found);
    pages[1..].iter().for_each(|drawing| check_svg(&drawing.text));
    let fences = pages[0].text.lines().filter(|line| line.starts_with("```")).count();
    assert_eq!(fences, 8, "equations, drawing and command, and a drawing: {}", pages[0].text);
    assert!(!pages[0].text.lines().any(|line| line.starts_with("# <")), "{}", pages[0].text);
}

#[test]
fn long_names_stay_inside_the_picture() {
    let long = "a_very_long_name_of_a_signal_that_nobody_would_like_to_write_twice";
    let text = TRUCK
        .replace("R req", &format!("{long} req"))
        .replace("(R and", &format!("({long} and"))
        .replace("{ R }", &format!("{{ {long} }}"));
    let (built, pages) =
        built(&text, &[Target::Jedec, Target::Logic(Dialect::Verilog)], &on("gal22v10"));
    assert_eq!(built.chips.len(), 2, "{:?}", built.found);
    check_svg(&pages[1].text);
    check_svg(&pages[2].text);
    assert!(
        pages[1].text.contains(&format!("{long} = p2</title>")),
        "the whole name is the tooltip"
    );
    assert!(pages[0].text.contains(&format!("--> {long}")));
}

/// The truck needs three terms for its first step on a 22V10, and one more without don't-cares: the figures of docs/forms.md.
#[test]
fn terms_are_counted_with_and_without_dont_cares() {
    let (built, pages) = built(TRUCK, &[Target::Jedec], &on("gal22v10"));
    let chip = &built.chips[0];
    let cell = |name: &str| -> &Cell {
        chip.cells.iter().find(|cell| chip.names(cell)[0] == name).expect("a macrocell")
    };
    let p1 = cell("p1");
    assert_eq!((p1.sum.len(), p1.is_least(), p1.is_complemented), (3, true, true));
    assert_eq!(p1.count.without, Some((4, 4)));
    assert!(
        ["p2", "p3", "p4"].iter().all(|name| cell(name).sum.len() == 2 && cell(name).is_least())
    );
    let page = &pages[0].text;
    assert!(page.contains("Don't-cares saved 1 term:"), "{page}");
    assert!(page.contains("/p1 := "), "{page}");
    assert!(page.contains("request & \\<more>"), "{page}");
}

#[test]
fn requirements_are_traced_to_equations_and_proofs() {
    let targets = [Target::Jedec, Target::Logic(Dialect::Verilog)];
    let (_, pages) = built(TRUCK, &targets, &on("gal22v10"));
    let page = &pages[0].text;
    let rows: Vec<String> = page
        .split("## Requirements")
        .nth(1)
        .expect("the section")
        .lines()
        .filter(|line| line.starts_with('|'))
        .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "))
        .collect();
    let has = |wanted: &str| rows.iter().any(|row| row.starts_with(wanted));
    assert!(has("| R1 | input b | truck.jed | b | proved |"), "{rows:#?}");
    assert!(has("| R2 | output R | truck.jed | R | proved |"), "{rows:#?}");
    assert!(has("| R3 | assert never (R and L) | chart | property | proved |"), "{rows:#?}");
    assert!(has("| R4 | transition t1 | truck.jed | p1, p2 | proved |"), "{rows:#?}");
    assert!(has("| | | truck.v | R; lines "), "{rows:#?}");
}

/// Registers start in the initial situation of the chart, and the page names the source of these data.
#[test]
fn power_up_and_clock_are_said() {
    for (device, note) in [("gal16v8", "not verified"), ("gal22v10", "not verified")] {
        let (built, pages) = built(TRUCK, &[Target::Jedec], &on(device));
        let chip: &Chip = &built.chips[0];
        assert_eq!(chip.reads().iter().filter(|one| one.is_registered).count(), 4);
        let page = &pages[0].text;
        assert!(page.contains("The initial situation of the chart is **p1**"), "{page}");
        assert!(page.contains(note) && page.contains("must be synchronous to the clock"), "{page}");
        let m = page
            .lines()
            .find(|line| line.starts_with("| m     | must be synchronous"))
            .expect("a row");
        assert!(m.contains("p1") && m.contains("p2") && !m.contains("p3"), "{page}");
    }
    let (_, pages) = built(
        TRUCK,
        &[Target::Logic(Dialect::Blif)],
        &BuildOptions { synchronise: 1, ..BuildOptions::default() },
    );
    let page = &pages[0].text;
    assert!(page.contains("synchronised on the chip: may change at any time"), "{page}");
    assert!(!page.contains("must be synchronous to the clock"), "{page}");
}

/// The reason for an encoding: here a flip-flop for each step does not fit.
#[test]
fn a_code_has_its_reason() {
    let mut text = String::from("chart ring { input go\n output Q\n");
    for step in 0..12 {
        text += &format!(
            "{} step s{step} {{ {} }}\n",
            if step == 0 { "initial" } else { "" },
            if step == 3 { "Q" } else { "" }
        );
    }
    for step in 0..12 {
        text += &format!("s{step} -> s{} when go\n", (step + 1) % 12);
    }
    text.push('}');
    let (_, pages) = built(&text, &[Target::Jedec], &on("gal22v10"));
    let page = &pages[0].text;
    assert!(page.contains("**compact**, 4 flip-flops: one-hot does not fit: "), "{page}");
    assert!(page.contains("| s11    | "), "{page}");
}

#[test]
fn a_page_is_the_same_each_time() {
    let targets = [Target::Jedec, Target::Logic(Dialect::Cupl), Target::C(None), Target::Ice40];
    let once = built(TRUCK, &targets, &BuildOptions::default()).1;
    assert_eq!(once, built(TRUCK, &targets, &BuildOptions::default()).1);
    assert_eq!(once.len(), 4, "a page, and a drawing of each chip");
}

/// The commands name the files that were written, and the Makefile if there is one.
#[test]
fn the_page_says_how_the_c_is_flashed() {
    let targets = [Target::C(None)];
    let (_, bare) = built(TRUCK, &targets, &BuildOptions::default());
    let line = "avrdude -p atmega328p -c arduino -P /dev/ttyUSB0 -b 115200 -U flash:w:truck.hex:i";
    assert!(bare[0].text.contains(line), "{}", bare[0].text);
    assert!(bare[0].text.contains("-o truck.elf truck.c main.c"), "{}", bare[0].text);
    let packages = vec![grafsynth_backend_c::package::Ecosystem::Plain];
    let (_, plain) = built(TRUCK, &targets, &BuildOptions { packages, ..BuildOptions::default() });
    assert!(plain[0].text.contains("In `truck-plain`, `make TOOLCHAIN=avr flash`"));
    let (_, chip) = built(TRUCK, &[Target::Jedec], &on("gal22v10"));
    assert!(!chip[0].text.contains("avrdude"));
}
