//! The comparison of drawings with their charts.

use crate::expected::{self, Vocabulary};
use crate::random::random_chart;
use crate::reader::{self, Line, Rect, Region, Shapes};
use grafsynth_draw::{Options, Style, layout, svg};
use grafsynth_frontend::graf;
use grafsynth_ir::FileId;
use grafsynth_ir::chart::{Design, Item};
use std::collections::BTreeMap;

/// `many` in runs of the long tests, otherwise `few`.
pub(crate) fn rounds(few: u64, many: u64) -> u64 {
    if std::env::var_os("GRAFSYNTH_DEEP").is_some() { many } else { few }
}

pub(crate) fn parsed(text: &str) -> Design {
    let parsed = graf::parse(FileId(0), text);
    assert!(parsed.diagnostics.iter().all(|it| !it.is_error()), "{:?}\n{text}", parsed.diagnostics);
    parsed.design.expect("it is there")
}

fn drawn(design: &Design, words: bool) -> String {
    svg(&layout(design, &Options { words, ..Options::default() }).expect("it is there"))
}

fn drawn_as_sfc(design: &Design, words: bool) -> String {
    let options = Options { style: Style::Sfc, words, ..Options::default() };
    svg(&layout(design, &options).expect("it is there"))
}

/// Why a drawing does not match the chart.
fn difference(design: &Design, vocabulary: &Vocabulary, svg: &str) -> Option<String> {
    difference_in(Style::Grafcet, design, &[], vocabulary, svg)
}

/// Why a drawing in a style does not match the chart; `active` are the steps of the first chart with a token.
fn difference_in(
    style: Style,
    design: &Design,
    active: &[String],
    vocabulary: &Vocabulary,
    svg: &str,
) -> Option<String> {
    match reader::read(svg, style) {
        Ok(read) => difference_of(style, design, active, vocabulary, read),
        Err(why) => Some(why),
    }
}

/// Why what was read from a drawing does not match the chart.
pub(crate) fn difference_of(
    style: Style,
    design: &Design,
    active: &[String],
    vocabulary: &Vocabulary,
    read: Region,
) -> Option<String> {
    let headings = |one: &Region| one.heading.clone();
    let n_frames = design.charts.len() + design.libraries.len();
    let charts: Vec<Region> = if n_frames == 1 { vec![read] } else { read.inner };
    if charts.len() != n_frames {
        return Some(format!("{} charts", charts.len()));
    }
    let kind = if style == Style::Sfc { "SFC" } else { "G" };
    let all = design.charts.iter().map(|chart| (kind, &chart.name.text, &chart.items));
    let libraries = design.libraries.iter();
    let all = all.chain(libraries.map(|library| ("library", &library.name.text, &library.items)));
    let mut active = active;
    charts.iter().zip(all).find_map(|(read, (kind, name, items))| {
        let mut expected = expected::region(format!("{kind} {name}"), items, style);
        for step in std::mem::take(&mut active) {
            expected.steps.get_mut(step).expect("it is there").is_active = true;
        }
        compare(style, &expected, read, vocabulary)
            .map(|why| format!("{}: {why}", headings(&expected)))
    })
}

fn compare(
    style: Style,
    expected: &Region,
    read: &Region,
    vocabulary: &Vocabulary,
) -> Option<String> {
    let understood = match understood(style, read, vocabulary, expected) {
        Ok(understood) => understood,
        Err(why) => return Some(why),
    };
    if !understood.heading.starts_with(&expected.heading) {
        return Some(format!("heading {}", understood.heading));
    }
    if understood.steps != expected.steps {
        let is_same = |name: &&String| understood.steps.get(*name) == expected.steps.get(*name);
        let mut all = understood.steps.keys().chain(expected.steps.keys());
        let name = all.find(|name| !is_same(name))?;
        let (is, must) = (understood.steps.get(name), expected.steps.get(name));
        return Some(format!("step {name}:\n{is:?}\ninstead of\n{must:?}"));
    }
    let sorted = |region: &Region| {
        let mut all: Vec<String> = region.transitions.iter().map(|it| format!("{it:?}")).collect();
        all.sort();
        all
    };
    let (is, must) = (sorted(&understood), sorted(expected));
    if is != must {
        let pair = is.iter().zip(&must).find(|(is, must)| is != must);
        return Some(format!("transitions: {pair:?}, {} and {}", is.len(), must.len()));
    }
    if understood.inner.len() != expected.inner.len() {
        return Some(format!("{} frames", understood.inner.len()));
    }
    expected
        .inner
        .iter()
        .zip(&read.inner)
        .find_map(|(expected, read)| compare(style, expected, read, vocabulary))
}

/// The region with conditions and lists in the form of the expected ones.
fn understood(
    style: Style,
    read: &Region,
    vocabulary: &Vocabulary,
    expected: &Region,
) -> Result<Region, String> {
    let mut region = read.clone();
    for transition in &mut region.transitions {
        transition.receptivity = vocabulary.condition(&transition.receptivity)?;
        for action in &mut transition.actions {
            action.text = vocabulary.list(&action.text)?;
        }
    }
    for (name, step) in &mut region.steps {
        for remark in &mut step.remarks {
            // The arguments of an instance are in the words of the chart language.
            if let Some((parameter, value)) = remark.split_once(" = ")
                && name.contains(" : ")
            {
                *remark = format!("{parameter} = {}", vocabulary.in_words(value)?);
            }
        }
        for (index, action) in step.actions.iter_mut().enumerate() {
            if style == Style::Sfc {
                vocabulary.row(action)?;
                continue;
            }
            if let Some(condition) = &mut action.condition {
                *condition = vocabulary.condition(condition)?;
            }
            let is_list = (expected.steps.get(name))
                .and_then(|step| step.actions.get(index))
                .is_some_and(|action| {
                    let qualifier = &action.qualifier;
                    !action.when.is_empty() || qualifier == "on" || qualifier.starts_with("task ")
                });
            action.text = match is_list {
                true => vocabulary.list(&action.text)?,
                false => vocabulary.quoted(&action.text),
            };
        }
    }
    Ok(region)
}

/// Everything that must not be in a drawing: boxes, links, bars or texts that overlap or are nearer than 2 pixels, two links on one line, links through boxes
/// or texts, and texts over borders.
pub(crate) fn flaws(svg: &str) -> Option<String> {
    let Shapes { boxes, frames, links, bars, texts, .. } =
        reader::shapes(svg).expect("it is there");
    let area =
        |line: &Line| Rect { x: line.x1, y: line.y1, w: line.x2 - line.x1, h: line.y2 - line.y1 };
    let bars: Vec<Rect> =
        (bars.iter().map(area)).map(|bar| Rect { y: bar.y - 2, h: bar.h + 4, ..bar }).collect();
    let solid: Vec<Rect> = boxes.iter().chain(&bars).copied().collect();
    for (index, one) in solid.iter().enumerate() {
        if let Some(other) = solid[..index].iter().find(|other| !one.is_apart(other, 2)) {
            return Some(format!("boxes {one:?} {other:?}"));
        }
    }
    let overlap = |a: (i64, i64), b: (i64, i64)| a.0.max(b.0) < a.1.min(b.1);
    for (index, one) in links.iter().enumerate() {
        let is_same = |other: &&Line| {
            one.x1 == one.x2
                && other.x1 == other.x2
                && (one.x1 - other.x1).abs() < 4
                && overlap((one.y1, one.y2), (other.y1, other.y2))
                || one.y1 == one.y2
                    && other.y1 == other.y2
                    && (one.y1 - other.y1).abs() < 4
                    && overlap((one.x1, one.x2), (other.x1, other.x2))
        };
        if let Some(other) = links[..index].iter().find(is_same) {
            return Some(format!("links {one:?} {other:?}"));
        }
        // A link ends at the border of a box, and never runs in it or along it.
        let is_through = |rect: &&Rect| {
            let (x, y) = ((one.x1, one.x2), (one.y1, one.y2));
            let wide = (rect.x - 2, rect.x + rect.w + 2);
            let high = (rect.y - 2, rect.y + rect.h + 2);
            x.0 == x.1 && wide.0 < x.0 && x.0 < wide.1 && overlap(y, (rect.y, rect.y + rect.h))
                || y.0 == y.1
                    && high.0 < y.0
                    && y.0 < high.1
                    && overlap(x, (rect.x, rect.x + rect.w))
        };
        if let Some(rect) = solid.iter().find(is_through) {
            return Some(format!("link {one:?} {rect:?}"));
        }
    }
    let around: Vec<&Rect> = boxes.iter().chain(&frames).collect();
    let areas: Vec<Rect> =
        texts.iter().map(|text| Rect { x: text.x, y: text.y - 9, w: text.width, h: 11 }).collect();
    for (index, one) in areas.iter().enumerate() {
        // The parts of one line touch each other.
        let is_near = |other: &&Rect| !one.is_apart(other, if one.y == other.y { 0 } else { 2 });
        if let Some(other) = areas[..index].iter().find(is_near) {
            return Some(format!("texts {one:?} {other:?}"));
        }
        if let Some(line) = links.iter().find(|line| !one.is_apart(&area(line), 2)) {
            return Some(format!("text {:?} {line:?}", texts[index]));
        }
        let is_over = |rect: &&&Rect| {
            let inner = Rect { x: one.x - 2, y: one.y - 2, w: one.w + 4, h: one.h + 4 };
            !one.is_apart(rect, 2) && !rect.encloses(&inner)
        };
        if let Some(rect) = around.iter().find(is_over) {
            return Some(format!("text {:?} {rect:?}", texts[index]));
        }
        if let Some(bar) = bars.iter().find(|bar| !one.is_apart(bar, 2)) {
            return Some(format!("text {:?} {bar:?}", texts[index]));
        }
    }
    None
}

fn check(text: &str) {
    let design = parsed(text);
    let vocabulary = Vocabulary::of(&design);
    let svg = drawn(&design, false);
    if let Some(why) = difference(&design, &vocabulary, &svg).or_else(|| flaws(&svg)) {
        panic!("{why}\n{text}");
    }
    let words = drawn(&design, true);
    if let Some(why) = difference(&design, &vocabulary, &words) {
        panic!("with words: {why}\n{text}");
    }
}

/// The same in the style of IEC 61131-3.
fn check_sfc(text: &str) {
    let design = parsed(text);
    let sfc = drawn_as_sfc(&design, true);
    let vocabulary = Vocabulary::of(&design);
    if let Some(why) = difference_in(Style::Sfc, &design, &[], &vocabulary, &sfc) {
        panic!("with words: {why}\n{text}");
    }
    let sfc = drawn_as_sfc(&design, false);
    let why =
        difference_in(Style::Sfc, &design, &[], &vocabulary.st(), &sfc).or_else(|| flaws(&sfc));
    if let Some(why) = why {
        panic!("{why}\n{text}");
    }
}

/// The Grafcet charts in `examples`.
fn examples() -> Vec<String> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples");
    let mut all = Vec::new();
    for folder in std::fs::read_dir(root).expect("it is there") {
        let Ok(files) = std::fs::read_dir(folder.expect("it is there").path()) else { continue };
        for file in files {
            let path = file.expect("it is there").path();
            if path.extension().is_some_and(|it| it == "graf") {
                all.push(std::fs::read_to_string(path).expect("it is there"));
            }
        }
    }
    all.retain(|text| !text.contains("inner-first"));
    all.sort();
    assert!(all.len() > 10);
    all
}

#[test]
fn the_drawings_of_the_examples_are_their_charts() {
    examples().iter().for_each(|text| check(text));
}

#[test]
fn the_drawings_of_random_charts_are_these_charts() {
    (0..rounds(60, 2_000)).for_each(|seed| check(&random_chart(seed)));
}

#[test]
fn every_form_of_action_and_condition_is_drawn() {
    check(include_str!("forms.graf"));
}

#[test]
fn sequential_function_charts_are_their_charts() {
    examples().iter().for_each(|text| check_sfc(text));
    (0..rounds(40, 2_000)).for_each(|seed| check_sfc(&random_chart(seed)));
    check_sfc(include_str!("forms.graf"));
}

/// A line or text of an action block that is moved or missing is noticed.
#[test]
fn spoiled_action_blocks_are_noticed() {
    let text = include_str!("blocks.graf");
    check_sfc(text);
    let design = parsed(text);
    let vocabulary = Vocabulary::of(&design).st();
    let svg = drawn_as_sfc(&design, false);
    let lines: Vec<&str> = svg.lines().collect();
    let mut n_spoiled = 0;
    for (index, line) in lines.iter().enumerate() {
        let is_line = ["<line class=\"l\"", "<line class=\"d\"", "<line class=\"b\""];
        let is_line = is_line.iter().any(|it| line.starts_with(it));
        if !is_line && !line.starts_with("<text x") {
            continue;
        }
        for other in [String::new(), moved(line)].iter().take(if is_line { 2 } else { 1 }) {
            let mut lines = lines.clone();
            lines[index] = other;
            let why = difference_in(Style::Sfc, &design, &[], &vocabulary, &lines.join("\n"));
            assert!(why.is_some(), "not noticed: {line} -> {other}");
            n_spoiled += 1;
        }
    }
    assert!(n_spoiled > 80, "{n_spoiled}");
}

/// `after` compares the time of the step, unless the control of IEC 61131-3 runs the output; the legend says which it is.
#[test]
fn the_legend_says_whose_time_is_meant() {
    let legend = "D, L: here the time since the activation of the step";
    for (text, is_said) in [
        ("output R\n initial step a { R after 3 s }", true),
        ("output R\n initial step a { R after 3 s }\n step b { reset R }\n a -> b", false),
        ("actions iec\n output R\n initial step a { R after 3 s }", false),
        ("output R\n initial step a { R D 3 s }", false),
    ] {
        let svg = drawn_as_sfc(&parsed(&format!("chart g {{ {text} }}")), false);
        assert_eq!(svg.contains(legend), is_said, "{text}");
        assert!(svg.contains(">D T#3s</text>"), "{text}");
    }
}

#[test]
fn a_statechart_is_not_a_sequential_function_chart() {
    let design = parsed("chart m { state a {} }");
    let options = Options { style: Style::Sfc, ..Options::default() };
    assert_eq!(layout(&design, &options), Err(grafsynth_draw::NotDrawn::Statechart));
}

/// What is done to a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Harm {
    /// A line, a text or a token is left out.
    Missing,
    /// A line or a token is elsewhere.
    Moved,
    /// A link begins or ends at another step.
    Attached,
    /// Two texts are exchanged.
    Exchanged,
}

/// The steps of the first chart that are drawn as active: every third one.
fn some_steps(design: &Design) -> Vec<String> {
    let steps = design.charts[0].items.iter().filter_map(|item| match item {
        // A dot would be read as that of a path.
        Item::Step(step) if !step.name.text.contains('.') => Some(step.name.text.clone()),
        _ => None,
    });
    steps.step_by(3).collect()
}

/// A drawing with a part that is missing or moved, with a link of another step, or with two texts exchanged is not the drawing of the chart.
#[test]
fn spoiled_drawings_are_noticed() {
    let mut counts: BTreeMap<Harm, usize> = BTreeMap::new();
    let charts = examples().into_iter().chain((0..rounds(7, 60)).map(random_chart));
    for text in charts {
        let design = parsed(&text);
        let vocabulary = Vocabulary::of(&design);
        let active = some_steps(&design);
        let chart = &design.charts[0].name.text;
        let paths: Vec<String> = active.iter().map(|step| format!("{chart}.{step}")).collect();
        let options = Options { active: &paths, ..Options::default() };
        let svg = svg(&layout(&design, &options).expect("it is there"));
        let difference =
            |svg: &str| difference_in(Style::Grafcet, &design, &active, &vocabulary, svg);
        assert_eq!(difference(&svg), None, "{text}");
        let lines: Vec<&str> = svg.lines().collect();
        for (harm, changes) in harmed(&lines, svg.len()) {
            let mut other = lines.clone();
            changes.iter().for_each(|(index, line)| other[*index] = line);
            let why = difference(&other.join("\n"));
            assert!(why.is_some(), "{harm:?} is not noticed: {changes:?}\n{text}");
            *counts.entry(harm).or_insert(0) += 1;
        }
    }
    println!("{counts:?}");
    assert!(counts.len() == 4 && counts.values().all(|n| *n > 20), "{counts:?}");
}

/// A harm to a drawing: lines of the file with their new text.
type Harmed = (Harm, Vec<(usize, String)>);

/// Harms to a part of the lines of a file, to every ninth one in long tests; the first one depends on `start`.
fn harmed(lines: &[&str], start: usize) -> Vec<Harmed> {
    let is_of = |line: &str, kinds: &[&str]| kinds.iter().any(|kind| line.starts_with(kind));
    let every = usize::try_from(rounds(50, 9)).expect("it is small");
    let turn = |index: usize| (index + start).is_multiple_of(every);
    let mut all = Vec::new();
    let mut elements: Vec<(usize, &str)> = Vec::new();
    let mut is_element = false;
    for (index, line) in lines.iter().enumerate() {
        is_element = (is_element || line.starts_with("<g ")) && *line != "</g>";
        let is_token = is_of(line, &["<circle"]);
        let is_link = is_of(line, &["<line class=\"l\"", "<line class=\"b\""]);
        if turn(index) && is_of(line, &["<path class=\"a\""]) {
            all.push((Harm::Missing, vec![(index, String::new())]));
        }
        let text = line.strip_prefix("<text").and_then(|it| it.split_once('>'));
        if let Some((_, text)) = text.filter(|_| is_element) {
            elements.push((index, text));
        }
        if is_token || turn(index) && (is_link || line.starts_with("<text x")) {
            all.push((Harm::Missing, vec![(index, String::new())]));
            if is_link || is_token {
                all.push((Harm::Moved, vec![(index, moved(line))]));
            }
        }
    }
    for (at, (index, text)) in elements.iter().enumerate().filter(|(_, it)| turn(it.0)) {
        // Only the letters change places: the places keep their widths.
        let mut others = elements.iter().skip(at + 1 + at % 7).filter(|it| it.1 != *text);
        if let Some((other, other_text)) = others.next() {
            let with = |index: usize, own: &str, new: &str| {
                (index, lines[index].strip_suffix(own).expect("its end").to_owned() + new)
            };
            let changes = vec![with(*index, text, other_text), with(*other, other_text, text)];
            all.push((Harm::Exchanged, changes));
        }
    }
    all.extend(attached(lines, start));
    all
}

/// Links that begin or end at another step than before.
fn attached(lines: &[&str], start: usize) -> Vec<Harmed> {
    let Shapes { boxes, .. } = reader::shapes(&lines.join("\n")).expect("it is there");
    // The line, whether its first end is meant, the number of the box, and whether it is its upper side.
    let mut ends: Vec<(usize, bool, usize, bool)> = Vec::new();
    for (index, line) in lines.iter().enumerate() {
        if !line.starts_with("<line class=\"l\"") {
            continue;
        }
        let numbers: Vec<i64> = line.split('"').filter_map(|part| part.parse().ok()).collect();
        let [x1, y1, x2, y2] = numbers[..] else { panic!("{line}") };
        for (is_first, (x, y)) in [(true, (x1, y1)), (false, (x2, y2))] {
            for (number, rect) in boxes.iter().enumerate().filter(|(_, it)| it.x + it.w / 2 == x) {
                if y == rect.y || y == rect.y + rect.h {
                    ends.push((index, is_first, number, y == rect.y));
                }
            }
        }
    }
    let mut all = Vec::new();
    for (index, is_first, number, is_top) in &ends {
        let next = ends.iter().cycle().skip(index + start);
        let other = next.take(ends.len()).find(|it| it.2 != *number);
        let Some((.., other, _)) = other else { continue };
        let rect = boxes[*other];
        let (x, y) = (rect.x + rect.w / 2, if *is_top { rect.y } else { rect.y + rect.h });
        let parts: Vec<&str> = lines[*index].split('"').collect();
        let (x, y) = (x.to_string(), y.to_string());
        let mut parts = parts;
        // The numbers follow the class.
        let at = if *is_first { 3 } else { 7 };
        (parts[at], parts[at + 2]) = (&x, &y);
        all.push((Harm::Attached, vec![(*index, parts.join("\""))]));
    }
    let every = usize::try_from(rounds(12, 3)).expect("it is small");
    all.into_iter().skip(start % every).step_by(every).collect()
}

/// The line 7 pixels to the right and below.
fn moved(line: &str) -> String {
    let parts: Vec<String> = line
        .split('"')
        .map(|part| part.parse::<i64>().map_or_else(|_| part.to_owned(), |n| (n + 7).to_string()))
        .collect();
    parts.join("\"")
}

#[test]
fn unknown_charts_are_refused() {
    use grafsynth_draw::NotDrawn;
    let chart = parsed("chart g { initial step a }");
    let refused = layout(&chart, &Options { chart: Some("h"), ..Options::default() });
    assert_eq!(refused, Err(NotDrawn::NoChart(vec!["g".to_owned()])));
}

/// A situation is drawn with a dot in each active step, and nothing else changes.
#[test]
fn active_steps_have_a_token() {
    let text = "chart g { initial step a
 step b
 a -> b }";
    let design = parsed(text);
    let active = ["b".to_owned()];
    let options = Options { active: &active, ..Options::default() };
    let svg = svg(&layout(&design, &options).expect("it is there"));
    assert_eq!(svg.matches("<circle").count(), 1);
    let vocabulary = Vocabulary::of(&design);
    assert_eq!(difference_in(Style::Grafcet, &design, &active, &vocabulary, &svg), None);
    let why = difference(&design, &vocabulary, &svg).expect("nothing is active");
    assert!(why.starts_with("G g: step b"), "{why}");
    // With the name of its chart, only the step of this chart is meant.
    let two = parsed("chart g { initial step a } chart h { initial step a }");
    let tokens = |name: &str| {
        let active = [name.to_owned()];
        let options = Options { active: &active, ..Options::default() };
        let svg = grafsynth_draw::svg(&layout(&two, &options).expect("it is there"));
        svg.matches("<circle").count()
    };
    assert_eq!((tokens("a"), tokens("h.a")), (2, 1));
    let unknown = ["c".to_owned()];
    let refused = layout(&design, &Options { active: &unknown, ..Options::default() });
    assert_eq!(refused, Err(grafsynth_draw::NotDrawn::NoStep("c".to_owned())));
}

/// A sheet for exercises has the boxes and lines, but not the texts.
#[test]
fn exercises_have_blanks() {
    use grafsynth_draw::Blank;
    let text = "chart g { input m
 output R
 initial step wait
 step run { R if m }
 wait -> run when m }";
    let design = parsed(text);
    let texts = |blank| {
        let options = Options { blank, ..Options::default() };
        let svg = svg(&layout(&design, &options).expect("it is there"));
        let shapes = reader::shapes(&svg).expect("it is there");
        let texts: Vec<String> = shapes.texts.into_iter().map(|it| it.text).collect();
        (texts, shapes.boxes.len())
    };
    let (all, n_boxes) = texts(Blank::default());
    assert_eq!(all.iter().filter(|it| *it == "m").count(), 2);
    let (left, n_left) = texts(Blank { actions: true, receptivities: true, names: true });
    assert!(!left.iter().any(|it| ["m", "R", "wait", "run"].contains(&it.as_str())), "{left:?}");
    assert_eq!(n_left, n_boxes);
    let (left, _) = texts(Blank { names: true, ..Blank::default() });
    assert!(left.contains(&"R".to_owned()) && !left.contains(&"run".to_owned()), "{left:?}");
}

/// Texts that look like markup, and those that change the direction of what follows, do no harm.
#[test]
fn hostile_texts_stay_texts() {
    let design = parsed(
        "chart g { initial step a \"</text><script>x</script>\u{202E}&amp;\"\n step `<b> \"c\"`\n a -> `<b> \"c\"` when a.active }",
    );
    let svg = drawn(&design, false);
    assert!(!svg.contains("<script") && !svg.contains('\u{202E}'));
    assert_eq!(reader::read(&svg, Style::Grafcet).expect("it is there").steps.len(), 2);
}
