//! The symbols: steps with their actions, transitions with their receptivities, references and instances.

use crate::order::Node;
use crate::picture::{Element, Font, Pen, Picture, Shape};
use crate::stack;
use crate::text::{Rich, broken_name, width};

/// The smallest side of a step.
const STEP: i64 = 36;
/// Names of steps that are wider than this are broken into lines.
const LONGEST_NAME: i64 = 150;
/// Conditions and actions that are wider than this are broken at spaces.
const LONGEST_LINE: i64 = 260;
/// The distance between lines of text.
const LINE: i64 = 15;
/// The height of the text of an overlay in a step.
const TAG: i64 = 16;
/// Half the length of the bar of a transition.
const BAR: i64 = 14;
/// The thickness of the bar of a transition.
const BAR_HEIGHT: i64 = 4;
/// The distance between a step and its actions.
const STUB: i64 = 18;
/// The distance between action boxes.
const BETWEEN: i64 = 4;

/// The kinds of symbols.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Step,
    MacroStep,
    EnclosingStep,
    Transition,
    /// The name of a step that is drawn elsewhere.
    Reference,
    Instance,
}

/// An arrow at the left side of an action box.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum When {
    /// While the step is active.
    #[default]
    Always,
    /// On activation of the step.
    Activation,
    /// On deactivation of the step.
    Deactivation,
}

/// A box with an action.
#[derive(Debug, Clone, Default)]
pub(crate) struct Action {
    /// The qualifier or word in the left part of the box; may be empty.
    pub(crate) qualifier: String,
    pub(crate) when: When,
    pub(crate) text: Rich,
    /// The condition above the box.
    pub(crate) condition: Option<Rich>,
    /// True for a forcing order.
    pub(crate) is_forcing: bool,
    /// The indicator variable of an action block of IEC 61131-3; may be empty.
    pub(crate) indicator: String,
}

/// A short text in a step or at a transition, and the colour of the step.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tag {
    pub(crate) text: String,
    pub(crate) fill: Option<Pen>,
}

/// A symbol.
#[derive(Debug, Clone)]
pub(crate) struct Symbol {
    pub(crate) kind: Kind,
    pub(crate) is_initial: bool,
    /// True for a step with a token in it.
    pub(crate) is_active: bool,
    pub(crate) name: String,
    /// What an overlay adds.
    pub(crate) tag: Tag,
    /// What is written to the left of a step: `*` of an activation link, `E` and `S` of the ends of a macro.
    pub(crate) left: String,
    /// The receptivity of a transition.
    pub(crate) receptivity: Option<Rich>,
    pub(crate) actions: Vec<Action>,
    /// True for a step whose actions are in action blocks of IEC 61131-3.
    pub(crate) is_stacked: bool,
    /// Remarks below everything else.
    pub(crate) remarks: Vec<String>,
    pub(crate) element: Option<Element>,
}

impl Symbol {
    pub(crate) fn new(kind: Kind, name: impl Into<String>) -> Self {
        Symbol {
            kind,
            is_initial: false,
            is_active: false,
            name: name.into(),
            tag: Tag::default(),
            left: String::new(),
            receptivity: None,
            actions: Vec::new(),
            is_stacked: false,
            remarks: Vec::new(),
            element: None,
        }
    }

    pub(crate) fn is_step(&self) -> bool {
        matches!(self.kind, Kind::Step | Kind::MacroStep | Kind::EnclosingStep | Kind::Instance)
    }

    /// The name that its links have where they are cut; `None` for a transition.
    pub(crate) fn of_link(&self) -> Option<&str> {
        (self.kind != Kind::Transition).then_some(self.name.as_str())
    }

    /// The symbol as a node of the graph, and its drawing with the axis at x = 0 and the upper end of its body at y = 0.
    pub(crate) fn draw(&self) -> (Node, Picture) {
        let mut picture = Picture::default();
        let body = match self.kind {
            Kind::Transition => self.transition(&mut picture),
            Kind::Reference => self.reference(&mut picture),
            Kind::Step | Kind::MacroStep | Kind::EnclosingStep | Kind::Instance => {
                self.step(&mut picture)
            }
        };
        for mark in &mut picture.marks {
            mark.element.clone_from(&self.element);
        }
        let mut node = Node {
            body,
            is_initial: self.is_initial,
            is_transition: self.kind == Kind::Transition,
            ..Node::default()
        };
        for mark in &picture.marks {
            let (left, top, right, bottom) = mark.bounds();
            node.left = node.left.max(-left);
            node.right = node.right.max(right);
            node.above = node.above.max(-top);
            node.below = node.below.max(bottom - body);
        }
        (node, picture)
    }

    fn step(&self, picture: &mut Picture) -> i64 {
        let size = Font::Normal.size();
        let mut lines = broken_name(&self.name, size, LONGEST_NAME);
        if self.kind == Kind::MacroStep
            && let Some(first) = lines.first_mut()
        {
            first.insert_str(0, "M ");
        }
        let widest = lines.iter().map(|line| width(line, size)).max().unwrap_or(0);
        let tag = width(&self.tag.text, Font::Small.size());
        let (widest, band) = (widest.max(tag), if tag > 0 { TAG } else { 0 });
        let margin = if self.kind == Kind::EnclosingStep { 22 } else { 14 };
        // An even width puts the axis in the middle.
        let wide = ((widest + margin).max(STEP) + 1) / 2 * 2;
        let n_lines = i64::try_from(lines.len()).unwrap_or(1);
        let high = (n_lines * LINE + 16 + band).max(STEP);
        let left = -wide / 2;
        if let Some(fill) = self.tag.fill {
            picture.rect((left, 0), (wide, high), fill);
        }
        if self.is_active {
            picture.rect((left, 0), (wide, high), Pen::Shade);
        }
        picture.rect((left, 0), (wide, high), Pen::Line);
        if self.is_active {
            picture.add(Shape::Circle { x: 0, y: high - 9, radius: 3, is_filled: true });
        }
        if self.is_initial {
            picture.rect((left + 3, 3), (wide - 6, high - 6), Pen::Detail);
        }
        match self.kind {
            Kind::MacroStep => {
                for y in [6, high - 6] {
                    picture.line((left, y), (left + wide, y), Pen::Detail);
                }
            }
            Kind::EnclosingStep => {
                for (x, towards) in [(left, 8), (left + wide, -8)] {
                    picture.line((x, 8), (x + towards, 0), Pen::Detail);
                    picture.line((x, high - 8), (x + towards, high), Pen::Detail);
                }
            }
            _ => {}
        }
        if band > 0 {
            picture.text((-tag / 2, 18), &self.tag.text, Font::Small);
        }
        // A token has its place below the name.
        let lifted = if self.is_active { 4 } else { 0 };
        let top = band + (high - band - n_lines * LINE) / 2 - lifted;
        for (index, line) in (0..).zip(&lines) {
            let x = -width(line, size) / 2;
            picture.text((x, top + index * LINE + 12), line, Font::Normal);
        }
        if !self.left.is_empty() {
            let x = left - 6 - width(&self.left, size);
            picture.text((x, high / 2 + 4), &self.left, Font::Normal);
        }
        self.beside(picture, left + wide, high);
        high
    }

    /// Draws the actions and remarks of a step, the first action level with the step.
    fn beside(&self, picture: &mut Picture, right: i64, high: i64) {
        let middle = high / 2;
        let x = right + STUB;
        let mut y = None;
        let mut last = middle;
        if self.is_stacked && !self.actions.is_empty() {
            y = Some(self.stack(picture, (right, middle), x));
        }
        for action in self.actions.iter().filter(|_| !self.is_stacked) {
            let (mut drawn, level) = action.draw();
            let top = y.unwrap_or(middle - level);
            last = top + level;
            y = Some(top + drawn.height + BETWEEN);
            drawn.shift(x, top);
            picture.marks.append(&mut drawn.marks);
            let from = if self.actions.len() > 1 { x - STUB / 2 } else { right };
            picture.line((from, last), (x, last), Pen::Line);
        }
        if self.actions.len() > 1 && !self.is_stacked {
            picture.line((right, middle), (x - STUB / 2, middle), Pen::Line);
            picture.line((x - STUB / 2, middle), (x - STUB / 2, last), Pen::Line);
        }
        let x = if self.actions.is_empty() { right + 8 } else { x };
        let half = i64::try_from(self.remarks.len()).unwrap_or(1) * LINE / 2;
        let mut y = y.map_or(middle - half, |y| y);
        for remark in &self.remarks {
            picture.text((x, y + 11), remark, Font::Small);
            y += LINE;
        }
    }

    /// Draws action blocks at `x`, joined to a point of the step, and returns where the next thing below them may begin.
    fn stack(&self, picture: &mut Picture, from: (i64, i64), x: i64) -> i64 {
        fn row(action: &Action) -> stack::Row<'_> {
            let Action { qualifier, text, indicator, .. } = action;
            stack::Row { qualifier, text, indicator }
        }
        let rows: Vec<stack::Row<'_>> = self.actions.iter().map(row).collect();
        let (mut drawn, level) = stack::draw(&rows);
        let top = from.1 - level;
        drawn.shift(x, top);
        picture.marks.append(&mut drawn.marks);
        picture.line(from, (x, from.1), Pen::Line);
        top + drawn.height + BETWEEN
    }

    fn transition(&self, picture: &mut Picture) -> i64 {
        let middle = BAR_HEIGHT / 2;
        picture.line((-BAR, middle), (BAR, middle), Pen::Bar);
        let name = if self.name.is_empty() { String::new() } else { format!("({})", self.name) };
        let name = format!("{name} {}", self.tag.text);
        let name = name.trim();
        if !name.is_empty() {
            let x = -BAR - 6 - width(name, Font::Small.size());
            picture.text((x, middle + 4), name, Font::Small);
        }
        let x = BAR + 8;
        let mut y = middle + 4;
        if let Some(receptivity) = &self.receptivity {
            for (index, line) in
                receptivity.lines(Font::Normal.size(), LONGEST_LINE).iter().enumerate()
            {
                if index > 0 {
                    y += LINE + 3 * line.levels();
                }
                picture.rich((x, y), line, Font::Normal);
            }
        }
        for remark in &self.remarks {
            y += LINE;
            picture.text((x, y), remark, Font::Small);
        }
        for action in &self.actions {
            let (mut drawn, level) = action.draw();
            y += 7;
            drawn.shift(x, y);
            picture.marks.append(&mut drawn.marks);
            // A tall box is connected at its first line.
            picture.line((BAR - 2, BAR_HEIGHT), (x, y + level.min(12)), Pen::Detail);
            y += drawn.height;
        }
        BAR_HEIGHT
    }

    fn reference(&self, picture: &mut Picture) -> i64 {
        let wide = width(&self.name, Font::Normal.size());
        picture.text((-wide / 2, 13), &self.name, Font::Normal);
        18
    }
}

impl Action {
    /// The drawing with the upper left corner at (0, 0), and the height of the middle of the box.
    fn draw(&self) -> (Picture, i64) {
        let mut picture = Picture::default();
        let size = Font::Normal.size();
        let mut y = 0;
        if let Some(condition) = &self.condition {
            for line in condition.lines(size, LONGEST_LINE) {
                y += LINE + 3 * line.levels();
                picture.rich((4, y - 3), &line, Font::Normal);
                picture.width = picture.width.max(line.width(size));
            }
            picture.line((10, y), (10, y + 7), Pen::Detail);
            y += 7;
        }
        let top = y;
        let inset = if self.is_forcing { 3 } else { 0 };
        let mut x = 8 + inset;
        match self.when {
            When::Always => {}
            When::Activation => x += 8,
            When::Deactivation => x += 8,
        }
        let text_lines = self.text.lines(size, LONGEST_LINE);
        let n_lines = i64::try_from(text_lines.len()).unwrap_or(1);
        let high = n_lines * LINE + 9 + 2 * inset;
        let mut cell = None;
        if !self.qualifier.is_empty() {
            picture.text((x, top + inset + 16), &self.qualifier, Font::Normal);
            x += width(&self.qualifier, size) + 8;
            cell = Some(x);
            x += 8;
        }
        let widest = text_lines.iter().map(|line| line.width(size)).max().unwrap_or(0);
        for (index, line) in (0..).zip(&text_lines) {
            picture.rich((x, top + inset + 16 + index * LINE), line, Font::Normal);
        }
        let wide = x + widest + 8 + inset;
        picture.rect((0, top), (wide, high), Pen::Line);
        if self.is_forcing {
            picture.rect((3, top + 3), (wide - 6, high - 6), Pen::Detail);
        }
        if let Some(x) = cell {
            picture.line((x, top), (x, top + high), Pen::Detail);
        }
        let (low, up) = (top + high - 6, top + 6);
        match self.when {
            When::Always => {}
            When::Activation => arrow(&mut picture, (6, low), (6, up)),
            When::Deactivation => arrow(&mut picture, (6, up), (6, low)),
        }
        picture.width = picture.width.max(wide);
        picture.height = top + high;
        (picture, top + high / 2)
    }
}

/// A small vertical arrow.
fn arrow(picture: &mut Picture, from: (i64, i64), to: (i64, i64)) {
    let back = (from.1 - to.1).signum() * 4;
    picture.line(from, to, Pen::Detail);
    picture.line((to.0 - 3, to.1 + back), to, Pen::Detail);
    picture.line((to.0 + 3, to.1 + back), to, Pen::Detail);
}
