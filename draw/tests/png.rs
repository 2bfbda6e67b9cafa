//! PNG files are decoded again: they are valid, and each shape is where the SVG file has it.

use crate::random::random_chart;
use crate::read_back::{parsed, rounds};
use grafsynth_draw::picture::{Font, Mark, Pen, Picture, Shape, Way};
use grafsynth_draw::{
    Options, Paper, Rendered, Style, TitleBlock, TooLarge, layout, page_png, pages, png,
};
use miniz_oxide::inflate::decompress_to_vec_zlib;
use std::collections::BTreeSet;

/// A decoded file.
struct Image {
    width: usize,
    height: usize,
    /// Red, green and blue of each pixel.
    pixels: Vec<[u8; 3]>,
    /// Pixels in one metre.
    per_metre: u32,
}

impl Image {
    fn decoded(file: &[u8]) -> Image {
        let mut rest = file.strip_prefix(b"\x89PNG\r\n\x1a\n").expect("a signature");
        let (mut head, mut physical, mut data) = (Vec::new(), Vec::new(), Vec::new());
        let number = |bytes: &[u8]| u32::from_be_bytes(bytes[..4].try_into().expect("four bytes"));
        while !rest.is_empty() {
            let len = number(rest) as usize;
            let content = &rest[8..8 + len];
            match &rest[4..8] {
                b"IHDR" => head = content.to_vec(),
                b"pHYs" => physical = content.to_vec(),
                b"IDAT" => data = decompress_to_vec_zlib(content).expect("it was compressed"),
                b"IEND" => assert_eq!((len, number(&rest[8..])), (0, 0xae42_6082)),
                other => panic!("{other:?}"),
            }
            rest = &rest[12 + len..];
        }
        let (width, height) = (number(&head) as usize, number(&head[4..]) as usize);
        let n_parts = match head[8..] {
            [8, 0, 0, 0, 0] => 1,
            [8, 2, 0, 0, 0] => 3,
            _ => panic!("{head:?}"),
        };
        assert_eq!(physical[8], 1);
        assert_eq!(data.len(), height * (width * n_parts + 1));
        let mut above = vec![0_u8; width * n_parts];
        let mut pixels = Vec::new();
        for row in data.chunks_exact(width * n_parts + 1) {
            assert_eq!(row[0], 2);
            above
                .iter_mut()
                .zip(&row[1..])
                .for_each(|(last, byte)| *last = last.wrapping_add(*byte));
            pixels.extend(
                above.chunks_exact(n_parts).map(|it| [it[0], it[n_parts / 2], it[n_parts - 1]]),
            );
        }
        Image { width, height, pixels, per_metre: number(&physical) }
    }

    fn at(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.width + x]
    }

    /// The left, top, right and bottom of everything that is not white; the last two are outside.
    fn bounds(&self) -> Option<(usize, usize, usize, usize)> {
        let is_ink = |pixel: &[u8; 3]| *pixel != [255; 3];
        let (mut across, mut down) = ((usize::MAX, 0), (usize::MAX, 0));
        for (y, row) in self.pixels.chunks_exact(self.width).enumerate() {
            let Some(first) = row.iter().position(is_ink) else { continue };
            let last = row.iter().rposition(is_ink).unwrap_or(first);
            across = (across.0.min(first), across.1.max(last + 1));
            down = (down.0.min(y), y + 1);
        }
        (down.1 > 0).then_some((across.0, down.0, across.1, down.1))
    }
}

/// A picture of 100 x 60 pixels with one shape.
fn alone(shape: Shape) -> Picture {
    let mark = Mark { shape, element: None, link: None };
    Picture { width: 100, height: 60, marks: vec![mark], ..Picture::default() }
}

fn image(picture: &Picture, scale: u8) -> Image {
    Image::decoded(&png(picture, scale).expect("it is small").bytes)
}

fn drawn(text: &str) -> Picture {
    layout(&parsed(text), &Options::default()).expect("it is there")
}

#[test]
fn shapes_are_at_their_places() {
    let rect = |pen| Shape::Rect { x: 10, y: 20, width: 30, height: 16, pen };
    let line = |to, pen| Shape::Line { from: (10, 20), to, pen };
    // At four pixels for one, lines of one and a half pixels have whole edges.
    for (shape, bounds) in [
        (rect(Pen::Line), (37, 77, 163, 147)),
        (rect(Pen::State), (37, 77, 163, 147)),
        (rect(Pen::Detail), (38, 78, 162, 146)),
        (rect(Pen::Shade), (40, 80, 160, 144)),
        (line((10, 50), Pen::Line), (37, 80, 43, 200)),
        (line((50, 20), Pen::Bar), (40, 72, 200, 88)),
        (line((38, 20), Pen::Dashed), (40, 78, 144, 82)),
        (Shape::Arrow { x: 50, y: 30, way: Way::Down }, (184, 84, 216, 120)),
        (Shape::Arrow { x: 50, y: 30, way: Way::Up }, (184, 120, 216, 156)),
        (Shape::Circle { x: 50, y: 30, radius: 6, is_filled: true }, (176, 96, 224, 144)),
        (Shape::Circle { x: 50, y: 30, radius: 6, is_filled: false }, (173, 93, 227, 147)),
    ] {
        let image = image(&alone(shape.clone()), 4);
        assert_eq!((image.width, image.height), (400, 240));
        assert_eq!(image.bounds(), Some(bounds), "{shape:?}");
    }
    // Inside of a border and of a ring it is white, and so is the gap of a dashed line.
    assert_eq!(image(&alone(rect(Pen::Line)), 4).at(100, 110), [255; 3]);
    let ring = Shape::Circle { x: 50, y: 30, radius: 6, is_filled: false };
    assert_eq!(image(&alone(ring), 4).at(200, 120), [255; 3]);
    let dashed = image(&alone(line((38, 20), Pen::Dashed)), 1);
    let dark: Vec<usize> = (10..38).filter(|x| dashed.at(*x, 20) != [255; 3]).collect();
    assert_eq!(dark, (10..16).chain(20..26).chain(30..36).collect::<Vec<_>>());
    // A line of one and a half pixels covers a half of some pixels: this is a gray, and a crossing erases it.
    let mut crossed = alone(line((50, 20), Pen::Line));
    let half = image(&crossed, 1).at(20, 19)[0];
    assert!((0x40..0xc0).contains(&half), "{half}");
    crossed.marks.push(alone(Shape::Crossing { x: 30, y: 20 }).marks.remove(0));
    let crossed = image(&crossed, 1);
    let is_white = |x| crossed.at(x, 19) == [255; 3] && crossed.at(x, 20) == [255; 3];
    assert!(!is_white(25) && is_white(26) && is_white(33) && !is_white(34));
    // A slanted line is as thick as a straight one.
    let slanted = image(&alone(line((40, 50), Pen::Bar)), 2);
    let dark: u64 = slanted.pixels.iter().map(|it| u64::from(255 - it[0])).sum();
    let area = dark as f64 / f64::from(255 - 0x11);
    let wanted = 2.0 * 2.0 * 4.0 * (30.0_f64 * 30.0 + 30.0 * 30.0).sqrt();
    assert!((area / wanted - 1.0).abs() < 0.02, "{area} instead of {wanted}");
}

#[test]
fn letters_fill_the_width_of_their_text() {
    let text = |text: &str, width, font| {
        alone(Shape::Text { x: 10, y: 40, text: text.to_owned(), width, font })
    };
    // Without the space beside the letters: H has 168 and 162 of its 1479 units, at 12/2048 pixels for each.
    let (left, top, right, bottom) =
        image(&text("HHH", 26, Font::Normal), 8).bounds().expect("ink");
    assert!((86..=88).contains(&left) && (279..=281).contains(&right), "{left} {right}");
    // Capitals are 1409 units high.
    assert!((253..=255).contains(&top) && bottom == 320, "{top} {bottom}");
    // A text is stretched, and a letter with an accent and a descender has both.
    let (left, _, right, _) = image(&text("HHH", 52, Font::Normal), 8).bounds().expect("ink");
    assert!((92..=96).contains(&left) && (478..=484).contains(&right), "{left} {right}");
    let (_, top, _, bottom) = image(&text("Äg", 16, Font::Normal), 8).bounds().expect("ink");
    assert!((236..244).contains(&top) && (336..345).contains(&bottom), "{top} {bottom}");
    // Headings are bold, comments are gray.
    let ink = |font, width| -> u64 {
        let image = image(&text("lilt", width, font), 4);
        image.pixels.iter().map(|it| u64::from(255 - it[0])).sum()
    };
    let (bold, thin) = (ink(Font::Heading, 15), ink(Font::Normal, 12));
    assert!(bold * 10 > thin * 18, "bold: {bold} {thin}");
    assert!(ink(Font::Small, 12) < ink(Font::Normal, 12), "gray");
    // Letters of a heading are further apart, but not wider.
    let (near, far) = (ink(Font::Heading, 16), ink(Font::Heading, 26));
    assert!(near.abs_diff(far) * 20 < near, "spread: {near} {far}");
    // Nothing is drawn for a space.
    assert_eq!(image(&text(" ", 9, Font::Normal), 2).bounds(), None);
}

/// Colours are only in files with an overlay; the others have one byte for each pixel.
#[test]
fn areas_have_the_colours_of_the_svg_file() {
    let area = |pen| alone(Shape::Rect { x: 10, y: 20, width: 30, height: 16, pen });
    for (pen, colour) in [
        (Pen::Shade, [0xcf, 0xe0, 0xf4]),
        (Pen::Never, [0xf7, 0xd0, 0xc8]),
        (Pen::Part(0), [0xfd, 0xe3, 0xb4]),
        (Pen::Part(5), [0xe3, 0xdd, 0xd3]),
        (Pen::Part(6), [0xfd, 0xe3, 0xb4]),
    ] {
        let svg = grafsynth_draw::svg(&area(pen));
        let hex: String = colour.iter().map(|part| format!("{part:02x}")).collect();
        assert!(svg.contains(&format!("{{fill:#{hex}}}")), "{hex}");
        assert_eq!(image(&area(pen), 1).at(20, 30), colour);
    }
}

#[test]
fn files_have_the_size_of_the_drawing_and_of_the_paper() {
    let picture = drawn("chart c { initial step a step b a -> b b -> a }");
    for scale in [1, 2, 8] {
        let image = image(&picture, scale);
        let (width, height) = (picture.width as usize, picture.height as usize);
        let n = usize::from(scale);
        assert_eq!((image.width, image.height), (width * n, height * n));
        // 96 pixels of the drawing are one inch.
        let inch = f64::from(image.per_metre) * 0.0254;
        assert!((inch - 96.0 * f64::from(scale)).abs() < 0.1, "{inch}");
    }
    let example = format!("{}/../examples/split-line/line.graf", env!("CARGO_MANIFEST_DIR"));
    let large = drawn(&std::fs::read_to_string(example).expect("it is there"));
    let all = pages(&large, Paper::A4, &TitleBlock::default());
    assert!(all.len() > 1);
    for page in &all {
        let image = Image::decoded(&page_png(page, 1).expect("it is small").bytes);
        let millimetres = |n: usize| n as f64 * 1000.0 / f64::from(image.per_metre);
        let (wide, high) = (page.size.0 as f64 / 10.0, page.size.1 as f64 / 10.0);
        assert!((millimetres(image.width) - wide).abs() < 0.3, "{}", millimetres(image.width));
        assert!((millimetres(image.height) - high).abs() < 0.3, "{}", millimetres(image.height));
    }
}

/// Bands of a file join without a seam: a file with some rows more or less above has the same picture.
#[test]
fn the_place_in_the_file_makes_no_difference() {
    let example = format!("{}/../examples/bottle-filler/filler.graf", env!("CARGO_MANIFEST_DIR"));
    let design = parsed(&std::fs::read_to_string(example).expect("it is there"));
    let options = Options { style: Style::Sfc, ..Options::default() };
    let picture = layout(&design, &options).expect("it is there");
    let first = image(&picture, 2);
    let mut lower = picture.clone();
    lower.height += 53;
    for mark in &mut lower.marks {
        match &mut mark.shape {
            Shape::Line { from, to, .. } => (from.1, to.1) = (from.1 + 53, to.1 + 53),
            Shape::Rect { y, .. }
            | Shape::Text { y, .. }
            | Shape::Arrow { y, .. }
            | Shape::Circle { y, .. }
            | Shape::Crossing { y, .. } => *y += 53,
        }
    }
    let second = image(&lower, 2);
    assert!(first.height > 1000, "more than one band");
    assert!(first.pixels == second.pixels[second.pixels.len() - first.pixels.len()..]);
}

/// Nothing is too odd to be drawn, and the same drawing gives the same bytes.
#[test]
fn random_and_odd_drawings_are_written() {
    for seed in 0..rounds(2, 200) {
        let picture = drawn(&random_chart(seed));
        let file = png(&picture, 1).expect("it is small");
        assert_eq!(file, png(&picture, 1).expect("it is small"));
        let image = Image::decoded(&file.bytes);
        let (left, top, right, bottom) = image.bounds().expect("ink");
        assert!(left > 0 && top > 0 && right < image.width && bottom < image.height, "{seed}");
    }
    let empty = png(&Picture::default(), 0).expect("it is small");
    let empty = Image::decoded(&empty.bytes);
    assert_eq!((empty.width, empty.height, empty.bounds()), (1, 1, None));
    // Shapes outside of the picture, or without a size.
    for shape in [
        Shape::Rect { x: -50, y: -900, width: 9000, height: 0, pen: Pen::State },
        Shape::Rect { x: 500, y: 900, width: 0, height: 5000, pen: Pen::Shade },
        Shape::Circle { x: 0, y: 0, radius: 0, is_filled: false },
        Shape::Line { from: (5, 5), to: (5, 5), pen: Pen::Dashed },
        Shape::Text { x: -9, y: 0, text: "\u{301}\u{0}".into(), width: 0, font: Font::Small },
    ] {
        png(&alone(shape), 3).expect("it is small");
    }
}

#[test]
fn a_file_that_is_too_large_is_refused() {
    let huge = Picture { width: 40_000, height: 30_000, ..Picture::default() };
    let refused = TooLarge { width: 80_000, height: 60_000 };
    assert_eq!(png(&huge, 2), Err(refused));
    let endless = Picture { width: i64::MAX / 16, height: i64::MAX / 16, ..Picture::default() };
    assert!(png(&endless, 8).is_err());
}

#[test]
fn letters_that_the_font_lacks_are_named() {
    let missing = |text: &str| {
        let Rendered { missing, .. } = png(&drawn(text), 1).expect("it is small");
        missing
    };
    assert_eq!(
        missing("chart c { initial step a \"größe Ж α → ≤ ё\" step b a -> b when not a.active }"),
        BTreeSet::new()
    );
    let odd = "chart c { initial step `日` \"\u{5d0} 🚀 \u{202e}\" }";
    assert_eq!(missing(odd), BTreeSet::from(['日', '\u{5d0}', '🚀', '\u{202e}']));
}
