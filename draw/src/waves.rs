//! Traces as waveforms: one lane for each signal, one column for each reaction.

use crate::notation::duration;
use crate::picture::{Font, Pen, Picture, Shape, Way};
use crate::text::{cut, width};

/// The width of a column.
const COLUMN: i64 = 24;
/// The height of a lane.
const LANE: i64 = 22;
/// The height of a signal in its lane.
const HIGH: i64 = 14;
/// The margin around the sheet.
const MARGIN: i64 = 16;
/// The width of a sheet: that of a page of A4 with 96 dots per inch and narrow margins.
const SHEET: i64 = 730;
/// The width from which names of signals are cut.
const LONGEST_NAME: i64 = 200;
/// The longest title of a line beside the columns.
const LONGEST_TITLE: &str = "reaction";
/// The largest number of reactions that are drawn.
const MOST: usize = 400;

/// What a signal is; lanes are grouped in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Group {
    /// From the stimulus.
    Input,
    /// The activity of a step.
    Step,
    /// An output.
    Output,
    /// A variable.
    Variable,
}

impl Group {
    fn heading(self) -> &'static str {
        match self {
            Group::Input => "inputs",
            Group::Step => "steps",
            Group::Output => "outputs",
            Group::Variable => "variables",
        }
    }
}

/// A signal with its values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Signal {
    /// The name.
    pub name: String,
    /// The group.
    pub group: Group,
    /// True for a signal that is 0 or 1.
    pub is_bool: bool,
    /// The value after each reaction; `None` where the chart leaves it open. The first is that after the reset.
    pub values: Vec<Option<i64>>,
}

/// A trace.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Waves {
    /// The name of the chart.
    pub title: String,
    /// The ticks from the reset to each reaction.
    pub ticks: Vec<u64>,
    /// The length of a tick in nanoseconds; without one, times are given in ticks.
    pub tick_ns: Option<u64>,
    /// True for each reaction in which a transition fired; empty if that is not known.
    pub fired: Vec<bool>,
    /// The signals; those of a group are neighbours.
    pub signals: Vec<Signal>,
    /// True to leave the lanes of everything but inputs empty, for exercises.
    pub is_blank: bool,
}

/// Draws a trace. The columns continue below each other; of a long trace, the first reactions are drawn, with a note about the rest.
#[must_use]
pub fn waves(waves: &Waves) -> Picture {
    let names = waves.signals.iter().map(|signal| width(&signal.name, Font::Normal.size()));
    let names = names.max().unwrap_or(0).min(LONGEST_NAME);
    let names = names.max(width(LONGEST_TITLE, Font::Small.size())) + 12;
    let left = MARGIN + names;
    let per_band = usize::try_from((SHEET - left - MARGIN) / COLUMN).unwrap_or(1).max(1);
    let n_rows = waves.ticks.len();
    let n_drawn = n_rows.min(MOST);
    let mut picture = Picture { title: waves.title.clone(), ..Picture::default() };
    picture.heading((MARGIN, MARGIN + 12), &waves.title);
    let mut y = MARGIN + 28;
    let mut first = 0;
    while first < n_drawn {
        let last = (first + per_band).min(n_drawn);
        y = Band { waves, first, last, left }.draw(&mut picture, y) + 20;
        first = last;
    }
    for note in notes(waves, n_drawn) {
        picture.text((MARGIN, y), &note, Font::Small);
        y += 15;
    }
    let ends = picture.marks.iter().map(|mark| mark.bounds().2);
    picture.width = ends.max().unwrap_or(0) + MARGIN;
    picture.height = y;
    picture
}

/// What is written below the waveforms.
fn notes(waves: &Waves, n_drawn: usize) -> Vec<String> {
    let n_rows = waves.ticks.len();
    let mut notes = Vec::new();
    if n_drawn < n_rows {
        notes.push(format!(
            "reactions {n_drawn} to {} are not drawn; .csv and .vcd contain them",
            n_rows - 1
        ));
    }
    if waves.is_blank {
        return notes;
    }
    if waves.fired.iter().take(n_drawn).any(|fired| *fired) {
        notes.push("arrow: a transition fired in this reaction".to_owned());
    }
    let is_open = |signal: &Signal| signal.values.iter().take(n_drawn).any(Option::is_none);
    if waves.signals.iter().any(is_open) {
        notes.push("dashed: the chart does not determine the value".to_owned());
    }
    notes
}

/// The columns of some reactions.
struct Band<'a> {
    waves: &'a Waves,
    first: usize,
    last: usize,
    left: i64,
}

impl Band<'_> {
    fn x(&self, row: usize) -> i64 {
        self.left + i64::try_from(row - self.first).unwrap_or(0) * COLUMN
    }

    /// Draws the lanes from `top` on, and returns where they end.
    fn draw(&self, picture: &mut Picture, top: i64) -> i64 {
        let mut y = self.axis(picture, top);
        let lanes = y;
        let mut group = None;
        let mut bodies = Picture::default();
        for signal in &self.waves.signals {
            if group != Some(signal.group) {
                group = Some(signal.group);
                bodies.text((MARGIN, y + 15), signal.group.heading(), Font::Small);
                y += LANE;
            }
            bodies.text(
                (MARGIN, y + HIGH),
                &cut(&signal.name, Font::Normal.size(), LONGEST_NAME),
                Font::Normal,
            );
            if self.waves.is_blank && signal.group != Group::Input {
                bodies.line(
                    (self.left, y + HIGH + 3),
                    (self.x(self.last), y + HIGH + 3),
                    Pen::Frame,
                );
            } else {
                self.signal(&mut bodies, signal, y + 3);
            }
            y += LANE;
        }
        for row in self.first..=self.last {
            picture.line((self.x(row), lanes), (self.x(row), y), Pen::Grid);
        }
        picture.marks.append(&mut bodies.marks);
        y
    }

    /// Numbers, times and marks of the reactions; returns where they end.
    fn axis(&self, picture: &mut Picture, top: i64) -> i64 {
        let small = Font::Small;
        picture.text((MARGIN, top + 12), LONGEST_TITLE, small);
        picture.text((MARGIN, top + 26), "time", small);
        let (mut free_number, mut free_time) = (i64::MIN, i64::MIN);
        for row in self.first..self.last {
            let x = self.x(row) + 2;
            let number = row.to_string();
            if x >= free_number {
                free_number = x + picture.text((x, top + 12), &number, small) + 6;
            }
            let ticks = self.waves.ticks.get(row).copied().unwrap_or(0);
            let time = match self.waves.tick_ns {
                Some(ns) => duration(ticks.saturating_mul(ns)),
                None => ticks.to_string(),
            };
            if x >= free_time {
                free_time = x + picture.text((x, top + 26), &time, small) + 6;
            }
        }
        let has_marks = !self.waves.is_blank && self.waves.fired.iter().any(|fired| *fired);
        if !has_marks {
            return top + 32;
        }
        picture.text((MARGIN, top + 42), "fired", small);
        for row in self.first..self.last {
            if self.waves.fired.get(row) == Some(&true) {
                picture.add(Shape::Arrow { x: self.x(row), y: top + 44, way: Way::Down });
            }
        }
        top + 48
    }

    fn signal(&self, picture: &mut Picture, signal: &Signal, top: i64) {
        let bottom = top + HIGH;
        let mut row = self.first;
        let mut before: Option<i64> = None;
        while row < self.last {
            let value = signal.values.get(row).copied().flatten();
            let is_same = |at: &usize| signal.values.get(*at).copied().flatten() == value;
            let end = (row + 1..self.last).find(|at| !is_same(at)).unwrap_or(self.last);
            let (from, to) = (self.x(row), self.x(end));
            match value {
                None => picture.line((from, top + HIGH / 2), (to, top + HIGH / 2), Pen::Dashed),
                Some(value) if signal.is_bool => {
                    let level = |value: i64| if value == 0 { bottom } else { top };
                    if value != 0 {
                        picture.rect((from, top), (to - from, HIGH), Pen::Shade);
                    }
                    if let Some(before) = before {
                        picture.line((from, level(before)), (from, level(value)), Pen::Line);
                    }
                    picture.line((from, level(value)), (to, level(value)), Pen::Line);
                }
                Some(value) => {
                    let (left, right) = (from + 3, to - 3);
                    for (x, inner) in [(from, left), (to, right)] {
                        picture.line((x, top + HIGH / 2), (inner, top), Pen::Line);
                        picture.line((x, top + HIGH / 2), (inner, bottom), Pen::Line);
                    }
                    picture.line((left, top), (right, top), Pen::Line);
                    picture.line((left, bottom), (right, bottom), Pen::Line);
                    let text = cut(&value.to_string(), Font::Normal.size(), right - left);
                    picture.text((left + 2, bottom - 3), &text, Font::Small);
                }
            }
            before = value;
            row = end;
        }
    }
}
