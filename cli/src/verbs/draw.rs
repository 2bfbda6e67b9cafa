//! `grafsynth draw FILE`.

use crate::args::{BlankPart, Draw, DrawStyle, PaperSize};
use crate::exit::Exit;
use crate::files;
use crate::lists::did_you_mean;
use crate::load::{Session, Stop};
use crate::verbs::{draw_overlays, products};
use grafsynth_draw::{
    Blank, Counts, NotDrawn, Options, Page, Paper, Part, Picture, Rendered, Style, TitleBlock,
    TooLarge, frames, layout, marked, noticed, page_png, page_svg, pages, pdf, png, svg,
};
use grafsynth_driver::read::NetDesign;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The size in per cent below which a page is reported as hard to read: its smallest letters have fewer than 7 points, instead of 8.25.
const SMALL: i64 = 85;

/// The longest side of pictures in many viewers and browsers, in pixels.
const LONGEST_SIDE: i64 = 32_767;

/// The kinds of files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Format {
    Svg,
    Pdf,
    Png,
}

impl Format {
    /// The format that the ending of a file names; SVG for all others.
    pub(crate) fn of(path: &Path) -> Format {
        let is = |ending: &str| path.extension().is_some_and(|it| it.eq_ignore_ascii_case(ending));
        match (is("pdf"), is("png")) {
            (true, _) => Format::Pdf,
            (_, true) => Format::Png,
            _ => Format::Svg,
        }
    }
}

pub(crate) fn run(session: &mut Session, arguments: &Draw) -> Result<Exit, Stop> {
    match draw(session, arguments) {
        Err(Stop::Errors) => with_errors(session, arguments),
        done => Ok(done?.1),
    }
}

/// Draws what was parsed of a chart with errors and marks the errors, which were already shown. It writes no pages.
fn with_errors(session: &mut Session, arguments: &Draw) -> Result<Exit, Stop> {
    let Some((design, errors)) = session.unchecked() else { return Err(Stop::Errors) };
    let output = products::target(arguments.output.as_deref(), &arguments.input.file, "svg");
    let options = options(arguments, &[], None);
    let options = Options { active: &[], ..options };
    if design.charts.is_empty() || paper(arguments, &output)?.is_some() {
        return Err(Stop::Errors);
    }
    let Ok(picture) = layout(&design, &options) else { return Err(Stop::Errors) };
    let heading = format!("{} has errors", arguments.input.file);
    write_whole(session, &marked(&picture, &heading, &errors), arguments.scale, output)?;
    Ok(Exit::Errors)
}

/// Draws the chart for `--watch`. If it cannot be drawn, the last good picture is written with the errors above it, except on pages.
pub(crate) fn again(
    session: &mut Session,
    arguments: &Draw,
    last: &mut Option<Picture>,
) -> Result<Exit, Stop> {
    match draw(session, arguments) {
        Ok((Some(picture), exit)) => {
            *last = Some(picture);
            return Ok(exit);
        }
        Ok((None, _)) | Err(Stop::Errors) => {}
        Err(Stop::Input(why) | Stop::Usage(why)) => {
            session.warn(&why);
            session.remark(why);
        }
    }
    let output = products::target(arguments.output.as_deref(), &arguments.input.file, "svg");
    let errors = session.remarks();
    let is_shown = paper(arguments, &output)?.is_none();
    if last.is_none() {
        return with_errors(session, arguments);
    }
    if let Some(picture) = last.as_ref().filter(|_| is_shown) {
        let title = format!("{} has errors; this is the last good drawing", arguments.input.file);
        write_whole(session, &noticed(picture, &title, &errors), arguments.scale, output)?;
    }
    Ok(Exit::Errors)
}

/// Draws the chart and writes the drawing, which is returned; none if it has errors, which were shown.
fn draw(session: &mut Session, arguments: &Draw) -> Result<(Option<Picture>, Exit), Stop> {
    let file = &arguments.input.file;
    let output = products::target(arguments.output.as_deref(), file, "svg");
    let paper = paper(arguments, &output)?;
    let (design, found) = session.net(&arguments.input)?;
    session.show(&found);
    let Some(picture) = picture(session, arguments, &design, paper)? else {
        return Ok((None, Exit::Errors));
    };
    let exit = match paper {
        None => write_whole(session, &picture, arguments.scale, output)?,
        Some(paper) => {
            let hash = source_hash(session);
            let pages = pages(&picture, paper, &TitleBlock::of(&design.net, &hash));
            write_pages(session, &pages, &picture.title, arguments.scale, &output)?
        }
    };
    Ok((Some(picture), exit))
}

/// The paper, if the drawing is divided into pages: for `--page` and PDF files.
fn paper(arguments: &Draw, output: &Path) -> Result<Option<Paper>, Stop> {
    let size = match arguments.page {
        None if Format::of(output) == Format::Pdf => Some(PaperSize::A4),
        size => size,
    };
    if size.is_some() && products::is_stdout(output) {
        return Err(Stop::Usage(
            "pages are files: name one with -o, for example -o plant.pdf".to_owned(),
        ));
    }
    Ok(size.map(|size| match size {
        PaperSize::A4 => Paper::A4,
        PaperSize::A3 => Paper::A3,
        PaperSize::Letter => Paper::Letter,
    }))
}

/// The drawing with its overlays; `None` if a file for one of them has errors, which were shown.
fn picture(
    session: &mut Session,
    arguments: &Draw,
    design: &NetDesign,
    paper: Option<Paper>,
) -> Result<Option<Picture>, Stop> {
    let file = &arguments.input.file;
    let Some(chart) = &design.chart else {
        return Err(Stop::Input(format!(
            "{file} contains a net, not a chart; convert it to .graf and draw the result"
        )));
    };
    let net = &design.net;
    let parts = match &arguments.split {
        Some(path) => draw_overlays::split_parts(session, net, path)?,
        None => Vec::new(),
    };
    let counts = match &arguments.coverage {
        Some(path) => {
            let Some(counts) = draw_overlays::coverage(session, net, path)? else {
                return Ok(None);
            };
            Some(counts)
        }
        None => None,
    };
    let options = Options { paper, ..options(arguments, &parts, counts.as_ref()) };
    let drawn = match &arguments.frames {
        Some(path) => frames(chart, &options, &draw_overlays::trace_frames(session, net, path)?),
        None => layout(chart, &options),
    };
    drawn.map(Some).map_err(|why| not_drawn(arguments, why))
}

fn options<'a>(arguments: &'a Draw, parts: &'a [Part], counts: Option<&'a Counts>) -> Options<'a> {
    let is_blank = |part| arguments.blank.contains(&part);
    Options {
        chart: arguments.chart.as_deref(),
        style: match arguments.style {
            DrawStyle::Grafcet => Style::Grafcet,
            DrawStyle::Sfc => Style::Sfc,
        },
        words: arguments.words,
        active: &arguments.active,
        blank: Blank {
            actions: is_blank(BlankPart::Actions),
            receptivities: is_blank(BlankPart::Receptivities),
            names: is_blank(BlankPart::Names),
        },
        parts,
        counts,
        paper: None,
    }
}

fn not_drawn(arguments: &Draw, why: NotDrawn) -> Stop {
    let file = &arguments.input.file;
    match why {
        NotDrawn::NoStep(name) => {
            Stop::Usage(format!("{file} contains no step or state `{name}` to draw as active"))
        }
        NotDrawn::Statechart => Stop::Input(format!(
            "{file} contains a statechart, which cannot be drawn as a sequential function chart; omit --style sfc, or name another chart with --chart"
        )),
        NotDrawn::NoChart(names) => {
            let wanted = arguments.chart.as_deref().unwrap_or_default();
            let near = did_you_mean(wanted, names.iter().map(String::as_str));
            Stop::Usage(format!(
                "{file} contains no chart `{wanted}`{near} (charts: {})",
                names.join(", ")
            ))
        }
    }
}

/// The beginning of the hash of the source, for the title block.
fn source_hash(session: &Session) -> String {
    let source = session.sources.get(grafsynth_ir::FileId(0));
    let hash = source.map(|source| files::sha256(source.text.as_bytes())).unwrap_or_default();
    hash.get(..16).unwrap_or_default().to_owned()
}

/// Writes the drawing as one SVG or PNG file.
fn write_whole(
    session: &Session,
    picture: &Picture,
    scale: u8,
    output: PathBuf,
) -> Result<Exit, Stop> {
    if Format::of(&output) != Format::Png {
        return products::write_text(session, output, svg(picture));
    }
    let Rendered { bytes, missing } = png(picture, scale).map_err(too_large)?;
    warn_missing(session, "PNG", &missing);
    let [width, height] = [picture.width, picture.height].map(|it| it * i64::from(scale));
    if width.max(height) > LONGEST_SIDE {
        session.note(&format!(
            "grafsynth: the PNG file has {width} x {height} pixels, and many programs show at most {LONGEST_SIDE} on a side: --page A4 divides the drawing into pages\n"
        ));
    }
    products::write(session, vec![(output, bytes)])
}

/// Writes the pages: one PDF file, or a numbered SVG or PNG file for each.
fn write_pages(
    session: &Session,
    pages: &[Page],
    title: &str,
    scale: u8,
    output: &Path,
) -> Result<Exit, Stop> {
    let small = (1..).zip(pages).filter(|(_, page)| page.percent < SMALL);
    let small: Vec<(usize, &Page)> = small.collect();
    if let Some((number, page)) = small.iter().min_by_key(|(_, page)| page.percent) {
        session.warn(&format!(
            "{} of {} pages have letters of fewer than 7 points: page {number} is drawn at {} % of its size; use larger paper, or draw one chart with --chart",
            small.len(),
            pages.len(),
            page.percent
        ));
    }
    let numbered = |number| numbered(output, number);
    match Format::of(output) {
        Format::Svg => {
            let all = (1..).zip(pages);
            let all = all.map(|(number, page)| (numbered(number), page_svg(page).into_bytes()));
            products::write(session, all.collect())
        }
        Format::Png => {
            let (mut all, mut lacking) = (Vec::new(), BTreeSet::new());
            for (number, page) in (1..).zip(pages) {
                let Rendered { bytes, missing } = page_png(page, scale).map_err(too_large)?;
                all.push((numbered(number), bytes));
                lacking.extend(missing);
            }
            warn_missing(session, "PNG", &lacking);
            products::write(session, all)
        }
        Format::Pdf => {
            let Rendered { bytes, missing } = pdf(pages, title);
            warn_missing(session, "PDF", &missing);
            products::write(session, vec![(output.to_owned(), bytes)])
        }
    }
}

/// Names the characters that are question marks in a file.
fn warn_missing(session: &Session, format: &str, missing: &BTreeSet<char>) {
    if !missing.is_empty() {
        // Escaped, because a character may change the direction of what follows in a terminal.
        let name = |c: &char| format!("`{}` (U+{:04X})", c.escape_debug(), u32::from(*c));
        let all = missing.iter().map(name);
        session.warn(&format!(
            "the {format} file has question marks for characters that its fonts lack: {}; the SVG file shows them",
            all.collect::<Vec<_>>().join(", ")
        ));
    }
}

fn too_large(TooLarge { width, height }: TooLarge) -> Stop {
    Stop::Input(format!(
        "a PNG file of {width} x {height} pixels is too large (at most 250 million pixels); use a smaller --scale, --page, or an SVG file"
    ))
}

/// `plant.svg` as `plant-2.svg`.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
    let extension = path.extension().and_then(|one| one.to_str()).unwrap_or("svg");
    path.with_file_name(format!("{stem}-{number}.{extension}"))
}
