//! Pages show everything once, with marks at both ends of each cut link; PDF files have a valid structure and contain all texts.

use crate::random::random_chart;
use crate::read_back::{parsed, rounds};
use grafsynth_draw::picture::{Font, Mark, Pen, Picture, Shape};
use grafsynth_draw::{
    Counts, Frame, Options, Page, Paper, Part, TitleBlock, frames, layout, page_svg, pages, pdf,
    svg,
};
use grafsynth_ir::Span;
use grafsynth_ir::chart::{Design, Item};
use std::collections::{BTreeMap, BTreeSet};

fn example(path: &str) -> Design {
    let path = format!("{}/../examples/{path}", env!("CARGO_MANIFEST_DIR"));
    parsed(&std::fs::read_to_string(path).expect("it is there"))
}

fn drawn(design: &Design) -> Picture {
    layout(design, &Options::default()).expect("it is there")
}

fn title() -> TitleBlock {
    let cells = [("chart", "line"), ("source", "0123456789abcdef")];
    TitleBlock { cells: cells.map(|(label, text)| (label.to_owned(), text.to_owned())).to_vec() }
}

fn texts(picture: &Picture) -> Vec<String> {
    let texts = picture.marks.iter().filter_map(|mark| match &mark.shape {
        Shape::Text { text, .. } => Some(text.clone()),
        _ => None,
    });
    let mut texts: Vec<String> = texts.collect();
    texts.sort();
    texts
}

/// The page and the column that a mark names.
pub(crate) type Named = (Option<usize>, Option<usize>);

/// The mark of a cut link: its step, and the place of the other end.
pub(crate) fn reference(text: &str) -> Option<(&str, Named)> {
    let (step, place) = text.rsplit_once(" / ")?;
    let number = |text: &str| text.parse().ok();
    if let Some(column) = place.strip_prefix("column ") {
        return Some((step, (None, Some(number(column)?))));
    }
    let place = place.strip_prefix("page ")?;
    Some(match place.split_once(", column ") {
        Some((page, column)) => (step, (Some(number(page)?), Some(number(column)?))),
        None => (step, (Some(number(place)?), None)),
    })
}

/// The lines between the columns of a page.
fn separators(page: &Picture) -> Vec<i64> {
    let lines = page.marks.iter().filter_map(|mark| match mark.shape {
        Shape::Line { from, to, pen: Pen::Grid } if from.0 == to.0 => Some(from.0),
        _ => None,
    });
    lines.collect()
}

/// The column of a place on a page; `None` if there is only one.
fn column(page: &Picture, x: i64) -> Option<usize> {
    let lines = separators(page);
    let before = lines.iter().filter(|line| **line < x).count();
    (!lines.is_empty()).then_some(before + 1)
}

/// What a page says after the heading of a frame that begins on another page.
const CONTINUED: &str = ", continued";

/// The headings of the frames around each symbol, by geometry.
fn headings(picture: &Picture) -> BTreeMap<&str, BTreeSet<&str>> {
    let text_at = |at: (i64, i64)| {
        picture.marks.iter().find_map(|mark| match &mark.shape {
            Shape::Text { x, y, text, font: Font::Heading, .. } if (*x, *y) == at => {
                Some(text.as_str())
            }
            _ => None,
        })
    };
    let frames = picture.marks.iter().filter_map(|mark| match mark.shape {
        Shape::Rect { x, y, width, height, pen: Pen::Frame } => {
            Some((x..x + width, y..y + height, text_at((x + 16, y + 28))?))
        }
        _ => None,
    });
    let frames: Vec<_> = frames.collect();
    let mut all = BTreeMap::new();
    for mark in &picture.marks {
        if let Some(element) = &mark.element
            && let Shape::Rect { x, y, .. } | Shape::Line { from: (x, y), pen: Pen::Bar, .. } =
                &mark.shape
        {
            let around =
                frames.iter().filter(|(wide, high, _)| wide.contains(x) && high.contains(y));
            all.insert(element.id.as_str(), around.map(|(.., heading)| *heading).collect());
        }
    }
    all
}

/// Why a column of a page, read alone, does not say in which frames its symbols are; `all` are the headings around each symbol.
fn unheaded(page: &Picture, all: &BTreeMap<&str, BTreeSet<&str>>) -> Option<String> {
    (0..=separators(page).len()).find_map(|at| {
        let mut part = page.clone();
        part.marks.retain(|mark| match mark.shape {
            Shape::Rect { x, .. } | Shape::Text { x, .. } | Shape::Line { from: (x, _), .. } => {
                column(page, x).unwrap_or(1) == at + 1
            }
            _ => true,
        });
        unheaded_column(&part, all)
    })
}

fn unheaded_column(page: &Picture, all: &BTreeMap<&str, BTreeSet<&str>>) -> Option<String> {
    let is_apart = |one: &(i64, i64, i64, i64), other: &(i64, i64, i64, i64)| {
        one.2 <= other.0 || other.2 <= one.0 || one.3 <= other.1 || other.3 <= one.1
    };
    let texts = page.marks.iter().filter_map(|mark| match &mark.shape {
        Shape::Text { x, y, text, width, font } => {
            Some((text.as_str(), *font, (*x, y - font.size(), x + width, y + 3)))
        }
        _ => None,
    });
    let texts: Vec<_> = texts.collect();
    let links = page.marks.iter().filter_map(|mark| match mark.shape {
        Shape::Line { from, to, pen: Pen::Line } => Some((from.0, from.1, to.0 + 1, to.1 + 1)),
        _ => None,
    });
    let links: Vec<_> = links.collect();
    let here: Vec<_> = texts.iter().filter(|(_, font, _)| *font == Font::Heading).collect();
    for (text, _, place) in here.iter().filter(|(text, ..)| text.ends_with(CONTINUED)) {
        let free = links.iter().chain(texts.iter().filter(|it| it.0 != *text).map(|it| &it.2));
        if let Some(other) = { free }.find(|other| !is_apart(place, other)) {
            return Some(format!("{text} is not alone: {other:?}"));
        }
    }
    let elements = page.marks.iter().filter_map(|mark| mark.element.as_ref());
    let needed: BTreeSet<&str> =
        elements.filter_map(|it| all.get(it.id.as_str())).flatten().copied().collect();
    { needed.iter() }.find_map(|heading| {
        let own = |text: &str| text.strip_suffix(CONTINUED).unwrap_or(text) == *heading;
        let n_here = here.iter().filter(|(text, ..)| own(text)).count();
        (n_here != 1).then(|| format!("{n_here} headings {heading}"))
    })
}

/// Checks that the pages show everything once, and returns the number of cut links.
fn check(picture: &Picture, pages: &[Page]) -> usize {
    let mut seen = Vec::new();
    type Place = (usize, Option<usize>);
    let mut references: BTreeMap<(Place, Place), Vec<String>> = BTreeMap::new();
    let headings = headings(picture);
    let mut all = texts(picture);
    for (number, page) in (1..).zip(pages) {
        let Page { picture: page, .. } = page;
        assert_eq!(unheaded(page, &headings), None, "page {number}");
        let ends: BTreeSet<(i64, i64)> = page
            .marks
            .iter()
            .filter_map(|mark| match mark.shape {
                Shape::Line { from, to, pen: Pen::Line } => Some([from, to]),
                _ => None,
            })
            .flatten()
            .collect();
        for mark in &page.marks {
            match &mark.shape {
                Shape::Text { x, y, text, width, .. } => {
                    assert!(*x >= 0 && x + width <= page.width && *y <= page.height, "{text}");
                    // A step may have a name like a mark.
                    match reference(text).filter(|_| !all.contains(text)) {
                        Some((step, other)) => {
                            let own = (number, column(page, *x));
                            let other = (other.0.unwrap_or(number), other.1);
                            let all = references.entry((own, other)).or_default();
                            all.push(step.to_owned());
                            let mut sides = [x - 7, x - 3, x + width + 3].into_iter();
                            assert!(sides.any(|x| ends.contains(&(x, y - 4))), "no link at {text}");
                        }
                        None => seen.push(text.clone()),
                    }
                }
                Shape::Rect { x, y, width, height, .. } => {
                    assert!(x + width <= page.width && y + height <= page.height);
                }
                _ => {}
            }
        }
        seen.retain(|text| !text.ends_with(CONTINUED));
        seen.retain(|text| {
            !["chart", "line", "source", "0123456789abcdef", "page"].contains(&text.as_str())
        });
        let own = format!("{number} of {}", pages.len());
        assert!(seen.contains(&own), "{own}");
        seen.retain(|text| *text != own);
    }
    seen.sort();
    all.retain(|text| !["chart", "line", "source", "page"].contains(&text.as_str()));
    assert_eq!(seen, all);
    for ((from, to), mut steps) in references.clone() {
        let mut others = references.get(&(to, from)).cloned().unwrap_or_default();
        steps.sort();
        others.sort();
        assert_eq!(steps, others, "pages {from:?} and {to:?}");
        steps.dedup();
        assert_eq!(steps.len(), others.len(), "the same mark twice on page {from:?}: {others:?}");
    }
    references.values().map(Vec::len).sum()
}

#[test]
fn pages_show_everything_once() {
    let picture = drawn(&example("split-line/line.graf"));
    for (paper, n_pages) in [(Paper::A4, 2), (Paper::A3, 1), (Paper::Letter, 2)] {
        let pages = pages(&picture, paper, &title());
        assert_eq!(pages.len(), n_pages, "{paper:?}");
        assert!(check(&picture, &pages) >= 2 * (pages.len() - 1));
        for page in &pages {
            let Picture { width, height, .. } = page.picture;
            let (wide, high) = page.size;
            assert!((width * high - height * wide).abs() <= wide.max(high) * 2, "{width} {height}");
            assert!(page_svg(page).contains(&format!("width=\"{}.{}mm\"", wide / 10, wide % 10)));
        }
    }
    let small = drawn(&parsed("chart line { initial step a\n step b\n a -> b\n b -> a }"));
    let one = pages(&small, Paper::A4, &title());
    assert_eq!((one.len(), check(&small, &one)), (1, 0));
    assert_eq!(one[0].percent, 100);
}

/// A ring of steps.
pub(crate) fn ring(n: usize) -> Design {
    let steps: String = (0..n)
        .map(|n| format!(" {} s{n}\n", if n == 0 { "initial step" } else { "step" }))
        .collect();
    let links: String = (0..n).map(|it| format!(" s{it} -> s{}\n", (it + 1) % n)).collect();
    parsed(&format!("chart line {{\n{steps}{links}}}"))
}

/// The links at a cut are those of the chart: between both pages, exactly the steps whose links lead from one to the other.
#[test]
fn cut_links_name_their_steps() {
    let picture = drawn(&ring(200));
    let pages = pages(&picture, Paper::A4, &title());
    assert!(pages.len() > 2);
    check(&picture, &pages);
    for (number, page) in (1..).zip(&pages) {
        let texts = texts(&page.picture);
        let marks: Vec<_> = texts.iter().filter_map(|text| reference(text)).collect();
        let marks: BTreeSet<(&str, usize)> =
            marks.into_iter().filter_map(|(step, place)| Some((step, place.0?))).collect();
        // The last transition returns to the first step, past all pages between.
        let other = if number == 1 { pages.len() } else { 1 };
        let is_end = number == 1 || number == pages.len();
        assert_eq!(marks.contains(&("s0", other)), is_end, "{marks:?}");
        assert_eq!(marks.len(), 2, "{marks:?}");
    }
}

/// A narrow chart has columns, of which each is read before those to its right; a line leads from one to the next.
#[test]
fn a_narrow_chart_has_columns() {
    for (n, most, columns) in [(10, 1, 1), (20, 1, 2), (1000, 16, 5)] {
        let options = Options { paper: Some(Paper::A4), ..Options::default() };
        let picture = layout(&ring(n), &options).expect("it is there");
        let pages = pages(&picture, Paper::A4, &title());
        check(&picture, &pages);
        assert!(pages.len() <= most, "{n} steps on {} pages", pages.len());
        let mut next = 0;
        for page in pages.iter().map(|page| &page.picture) {
            let lines = separators(page);
            assert!(lines.len() < columns, "{} columns", lines.len() + 1);
            let boxes = page.marks.iter().filter_map(|mark| match (&mark.element, &mark.shape) {
                (Some(element), Shape::Rect { x, y, .. }) => Some((column(page, *x), *y, element)),
                _ => None,
            });
            let mut boxes: Vec<_> = boxes.collect();
            boxes.sort_by_key(|(column, y, _)| (*column, *y));
            boxes.dedup_by_key(|(.., element)| &element.id);
            for (.., element) in boxes {
                assert_eq!(element.id, format!("line.s{next}"));
                next += 1;
            }
            // Each border has a line, which has an arrow because it goes up, or a mark on both sides.
            let is_arrow = |x: &i64, line: &i64| (line - 20..*line).contains(x);
            let arrows = page.marks.iter().filter_map(|mark| match mark.shape {
                Shape::Arrow { x, .. } => Some(x),
                _ => None,
            });
            let n_drawn = arrows.filter(|x| lines.iter().any(|line| is_arrow(x, line))).count();
            let all = texts(page);
            let marked = all.iter().filter(|it| matches!(reference(it), Some((_, (None, _)))));
            assert_eq!(n_drawn + marked.count() / 2, lines.len());
        }
        assert_eq!(next, n);
    }
}

/// A chart with many branches is cut between them, and each page has symbols in their own size.
#[test]
fn wide_charts_are_cut_between_branches() {
    let all = |text: &dyn Fn(usize) -> String, with: &str| {
        (0..60).map(text).collect::<Vec<_>>().join(with)
    };
    let (first, last) = (all(&|n| format!("a{n}"), " & "), all(&|n| format!("b{n}"), " & "));
    let steps = all(&|n| format!("step a{n}\n step b{n}\n a{n} -> b{n} when i{n}"), "\n");
    let inputs = all(&|n| format!("i{n}"), ", ");
    let text = format!(
        "chart line {{ input {inputs}\n initial step s\n {steps}\n s -> {first}\n {last} -> s }}"
    );
    let picture = drawn(&parsed(&text));
    let wide = pages(&picture, Paper::A4, &title());
    check(&picture, &wide);
    let frame = pages(&drawn(&example("mcs-frame/frame.graf")), Paper::A4, &title());
    let oven = drawn(&example("microwave/oven.graf"));
    for page in wide.iter().chain(&frame).chain(&pages(&oven, Paper::A4, &title())) {
        assert!(page.picture.marks.iter().any(|mark| mark.element.is_some()), "an empty page");
    }
    assert!(wide.len() > 3, "{} pages", wide.len());
    assert!(wide.iter().chain(&frame).all(|page| page.percent >= 85));
}

/// A page that is read alone says in which charts and expansions its symbols are; a heading that is missing or wrong is noticed.
#[test]
fn pages_repeat_the_headings_of_frames() {
    let (mut n_continued, mut n_pages, mut n_empty) = (0, 0, 0);
    for number in 0..rounds(40, 400) {
        // Charts with hierarchy, every second one with links that fit no structure.
        let picture = drawn(&parsed(&random_chart(number * 3 + 2)));
        let pages = pages(&picture, Paper::A4, &title());
        check(&picture, &pages);
        n_pages += pages.len();
        let headings = headings(&picture);
        for page in &pages {
            let has = |is_it: &dyn Fn(&Mark) -> bool| page.picture.marks.iter().any(is_it);
            let is_legend = |mark: &Mark| matches!(&mark.shape, Shape::Text { text, .. } if text == "not IEC 60848:");
            n_empty += usize::from(!has(&|mark| mark.element.is_some()) && !has(&is_legend));
            for at in 0..page.picture.marks.len() {
                let mut spoiled = page.picture.clone();
                if let Shape::Text { text, .. } = &mut spoiled.marks[at].shape
                    && text.ends_with(CONTINUED)
                {
                    n_continued += 1;
                    text.insert(0, 'q');
                    assert!(unheaded(&spoiled, &headings).is_some(), "{number}: mark {at}");
                }
            }
        }
    }
    println!("{n_continued} headings on {n_pages} pages are continued; {n_empty} have no symbols");
    // Only the border of a frame that is much wider than the symbols in it.
    assert!(n_empty * 100 <= n_pages, "{n_empty} of {n_pages} pages have no symbols");
    assert!(n_continued > 40, "{n_continued}");
}

/// The objects of a PDF file by their number, after a check of its table of offsets.
fn objects(bytes: &[u8]) -> BTreeMap<usize, String> {
    // All bytes as characters of the same number.
    let text: String = bytes.iter().map(|byte| char::from(*byte)).collect();
    let bytes: Vec<char> = text.chars().collect();
    let from = |at: usize| bytes[at..].iter().collect::<String>();
    assert!(text.starts_with("%PDF-1."));
    assert!(text.trim_end().ends_with("%%EOF"));
    let start = text.rsplit_once("startxref").expect("it is there").1;
    let start: usize =
        start.split_whitespace().next().expect("it is there").parse().expect("a number");
    let table = from(start);
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("xref"));
    let (first, count) = lines.next().and_then(|line| line.split_once(' ')).expect("a section");
    assert_eq!(first, "0");
    let count: usize = count.trim().parse().expect("a number");
    let mut objects = BTreeMap::new();
    for number in 0..count {
        let line = lines.next().expect("an entry");
        if line.contains('f') {
            continue;
        }
        let offset: usize = line[..10].parse().expect("an offset");
        let object = from(offset);
        assert!(object.starts_with(&format!("{number} 0 obj")), "{number}");
        objects.insert(number, object.split("endobj").next().expect("it is there").to_owned());
    }
    objects
}

/// The texts in the content of a page, one on each line; bytes are characters of the same number.
fn shown(content: &str) -> String {
    let mut out = String::new();
    for line in content.lines().filter_map(|line| line.trim().strip_suffix(" Tj")) {
        if let Some(hex) = line.strip_prefix('<') {
            for at in (0..hex.len() - 1).step_by(2) {
                out.push(char::from(u8::from_str_radix(&hex[at..at + 2], 16).expect("a byte")));
            }
        } else {
            let text = line.strip_prefix('(').and_then(|text| text.strip_suffix(')'));
            let text = text.expect("a text in parentheses");
            out.push_str(&text.replace("\\(", "(").replace("\\)", ")").replace("\\\\", "\\"));
        }
        out.push('\n');
    }
    out
}

#[test]
fn pdf_files_have_pages_and_texts() {
    let picture = drawn(&example("split-line/line.graf"));
    let pages = pages(&picture, Paper::A4, &title());
    let file = pdf(&pages, "line");
    assert_eq!(file, pdf(&pages, "line"));
    assert!(file.missing.is_empty(), "{:?}", file.missing);
    let objects = objects(&file.bytes);
    let tree = objects.values().find(|object| object.contains("/Type /Pages")).expect("a tree");
    assert!(tree.contains(&format!("/Count {}", pages.len())));
    let entries: Vec<&String> = objects
        .values()
        .filter(|object| object.contains("/Type /Page\n") || object.contains("/Type /Page "))
        .collect();
    assert_eq!(entries.len(), pages.len());
    for (entry, page) in entries.iter().zip(&pages) {
        assert!(entry.contains("/MediaBox [0 0 595.27"), "{entry}");
        let (_, contents) = entry.split_once("/Contents ").expect("it has contents");
        let number = contents.split(' ').next().expect("a number").parse().expect("a number");
        let stream: &String = &objects[&number];
        let (head, data) = stream.split_once("stream\n").expect("a stream");
        let data = data.rsplit_once("endstream").expect("its end").0;
        let length = head.split_once("/Length ").expect("a length").1;
        let length: usize =
            length.split_whitespace().next().expect("a number").parse().expect("a number");
        assert!((length..=length + 1).contains(&data.chars().count()), "{length}");
        let shown = shown(data);
        for text in texts(&page.picture).iter().filter(|text| text.is_ascii()) {
            assert!(shown.contains(text.as_str()), "{text} is not in\n{shown}");
        }
    }
}

#[test]
fn signs_are_in_the_font_symbol_and_other_characters_are_reported() {
    let picture = drawn(&parsed(
        "chart line { input a, n: int 0..9\n initial step a1 \"größe Ж α\"\n step b\n a1 -> b when rise(a) and n >= 3 }",
    ));
    let pages = pages(&picture, Paper::A4, &title());
    let file = pdf(&pages, "line");
    assert_eq!(file.missing, BTreeSet::from(['Ж']));
    let text: String = file.bytes.iter().map(|byte| char::from(*byte)).collect();
    assert!(text.contains("/BaseFont /Symbol"));
    let shown = shown(&text);
    // The arrow, the sign for at least, and alpha in the font Symbol.
    for text in ["\"gr\u{f6}\u{df}e ? \n", "\n\u{ad}\n", "\n\u{b3}\n", "\na\n"] {
        assert!(shown.contains(text), "{text:?} is not in {shown:?}");
    }
}

fn span_of(design: &Design, name: &str) -> Span {
    let items = design.charts.iter().flat_map(|chart| &chart.items);
    let mut spans = items.filter_map(|item| match item {
        Item::Step(step) if step.name.text == name => Some(step.meta.span),
        Item::Transition(one) if one.name.as_ref().is_some_and(|it| it.text == name) => {
            Some(one.meta.span)
        }
        _ => None,
    });
    spans.next().expect("it is there")
}

const TWO: &str = "chart line { initial step a\n step b\n step c\n t: a -> b\n u: b -> c }";

#[test]
fn parts_have_a_colour_and_a_letter() {
    let design = parsed(TWO);
    let part = |name: &str, elements: &[&str]| Part {
        name: name.to_owned(),
        elements: elements.iter().map(|it| span_of(&design, it)).collect(),
    };
    let parts = [part("chip = gal22v10", &["a", "t"]), part("cpu = atmega328p", &["b", "u"])];
    let options = Options { parts: &parts, ..Options::default() };
    let picture = layout(&design, &options).expect("it is there");
    let all = texts(&picture);
    for text in ["A", "B", "(t) A", "(u) B", "A: chip = gal22v10", "B: cpu = atmega328p", "c"] {
        assert!(all.iter().any(|it| it == text), "{text}: {all:?}");
    }
    // Two steps and two rows of the legend; the third step has no part.
    let areas = |pen| {
        picture
            .marks
            .iter()
            .filter(|mark| matches!(mark.shape, Shape::Rect { pen: own, .. } if own == pen))
            .count()
    };
    assert_eq!((areas(Pen::Part(0)), areas(Pen::Part(1))), (2, 2));
}

#[test]
fn counts_are_numbers_and_never_is_a_word() {
    let design = parsed(TWO);
    let numbers = [("a", 3), ("b", 1), ("c", 0), ("t", 2), ("u", 0)];
    let by_element = numbers.iter().map(|(name, n)| (span_of(&design, name), *n)).collect();
    let counts = Counts { by_element, note: "of 4 reactions".to_owned() };
    let options = Options { counts: Some(&counts), ..Options::default() };
    let picture = layout(&design, &options).expect("it is there");
    let all = texts(&picture);
    for text in ["3×", "1×", "never", "(t) 2×", "(u) never", "of 4 reactions"] {
        assert!(all.iter().any(|it| it == text), "{text}: {all:?}");
    }
    assert_eq!(svg(&picture).matches("class=\"n\"").count(), 2);
}

#[test]
fn frames_light_the_steps_of_their_situation() {
    let design = parsed(TWO);
    let frame = |title: &str, steps: &[&str]| Frame {
        title: title.to_owned(),
        active: steps.iter().map(|it| span_of(&design, it)).collect(),
    };
    let all = [frame("1: reset", &["a"]), frame("2: reaction 1", &["b", "c"])];
    let picture = frames(&design, &Options::default(), &all).expect("it is there");
    let lit = picture.marks.iter().filter(|mark| matches!(mark.shape, Shape::Circle { .. }));
    let lit: Vec<&str> = lit.filter_map(|mark| Some(mark.element.as_ref()?.id.as_str())).collect();
    assert_eq!(lit, ["line.a", "line.b", "line.c"]);
    let texts = texts(&picture);
    assert!(texts.contains(&"1: reset".to_owned()) && texts.contains(&"2: reaction 1".to_owned()));
    assert_eq!(texts.iter().filter(|text| *text == "a").count(), 2);
}
