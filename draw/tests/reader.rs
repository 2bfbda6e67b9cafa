//! Reads a drawing back from its geometry: the ends of lines on borders and bars, and texts beside or inside their symbols. Ids are not used.

use grafsynth_draw::Style;
use roxmltree::Node;
use std::collections::{BTreeMap, BTreeSet};

/// A rectangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Rect {
    pub(crate) x: i64,
    pub(crate) y: i64,
    pub(crate) w: i64,
    pub(crate) h: i64,
}

impl Rect {
    fn middle(&self) -> (i64, i64) {
        (self.x + self.w / 2, self.y + self.h / 2)
    }

    fn contains(&self, (x, y): (i64, i64)) -> bool {
        self.x < x && x < self.x + self.w && self.y < y && y < self.y + self.h
    }

    /// True if the other rectangle is inside of this one.
    pub(crate) fn encloses(&self, other: &Rect) -> bool {
        self.contains((other.x, other.y)) && self.contains((other.x + other.w, other.y + other.h))
    }

    pub(crate) fn is_apart(&self, other: &Rect, gap: i64) -> bool {
        self.x + self.w + gap <= other.x
            || other.x + other.w + gap <= self.x
            || self.y + self.h + gap <= other.y
            || other.y + other.h + gap <= self.y
    }
}

/// A line, from its upper or left end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Line {
    pub(crate) x1: i64,
    pub(crate) y1: i64,
    pub(crate) x2: i64,
    pub(crate) y2: i64,
}

impl Line {
    pub(crate) fn ends(&self) -> [(i64, i64); 2] {
        [(self.x1, self.y1), (self.x2, self.y2)]
    }

    fn has(&self, (x, y): (i64, i64)) -> bool {
        let is_straight = self.x1 == self.x2 || self.y1 == self.y2;
        let is_between = |a: i64, b: i64, at: i64| a.min(b) <= at && at <= a.max(b);
        is_straight && is_between(self.x1, self.x2, x) && is_between(self.y1, self.y2, y)
            || self.ends().contains(&(x, y))
    }

    fn touches(&self, other: &Line) -> bool {
        self.ends().iter().any(|end| other.has(*end))
            || other.ends().iter().any(|end| self.has(*end))
    }
}

/// A text on one line with its overlines as `(not (..))`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Text {
    pub(crate) x: i64,
    pub(crate) y: i64,
    pub(crate) width: i64,
    pub(crate) text: String,
    pub(crate) class: String,
}

/// All shapes of a drawing or of one frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Shapes {
    pub(crate) boxes: Vec<Rect>,
    pub(crate) frames: Vec<Rect>,
    pub(crate) insets: Vec<Rect>,
    pub(crate) links: Vec<Line>,
    pub(crate) details: Vec<Line>,
    pub(crate) bars: Vec<Line>,
    /// The lines between columns of a page.
    pub(crate) separators: Vec<Line>,
    pub(crate) texts: Vec<Text>,
    /// The middles of tokens.
    pub(crate) dots: Vec<(i64, i64)>,
    /// The tips of arrows that point up; `None` if arrows are not read.
    pub(crate) tips: Option<Vec<(i64, i64)>>,
}

impl Shapes {
    /// Adds the shapes of another drawing with its upper left corner at (`dx`, `dy`).
    pub(crate) fn add(&mut self, other: Shapes, (dx, dy): (i64, i64)) {
        let rect = |it: Rect| Rect { x: it.x + dx, y: it.y + dy, ..it };
        let line =
            |it: Line| Line { x1: it.x1 + dx, y1: it.y1 + dy, x2: it.x2 + dx, y2: it.y2 + dy };
        self.boxes.extend(other.boxes.into_iter().map(rect));
        self.frames.extend(other.frames.into_iter().map(rect));
        self.insets.extend(other.insets.into_iter().map(rect));
        self.links.extend(other.links.into_iter().map(line));
        self.details.extend(other.details.into_iter().map(line));
        self.bars.extend(other.bars.into_iter().map(line));
        let texts = other.texts.into_iter();
        self.texts.extend(texts.map(|it| Text { x: it.x + dx, y: it.y + dy, ..it }));
        self.dots.extend(other.dots.into_iter().map(|(x, y)| (x + dx, y + dy)));
    }
}

pub(crate) fn shapes(svg: &str) -> Result<Shapes, String> {
    let document = roxmltree::Document::parse(svg).map_err(|error| error.to_string())?;
    let mut shapes = Shapes::default();
    let mut tips = Vec::new();
    for node in document.descendants() {
        let class = node.attribute("class").unwrap_or_default();
        match (node.tag_name().name(), class) {
            ("rect", "l" | "d" | "f") => {
                let [x, y, w, h] = numbers(&node, ["x", "y", "width", "height"])?;
                let rect = Rect { x, y, w, h };
                match class {
                    "l" => shapes.boxes.push(rect),
                    "d" => shapes.insets.push(rect),
                    _ => shapes.frames.push(rect),
                }
            }
            ("line", "l" | "d" | "b" | "g") => {
                let [x1, y1, x2, y2] = numbers(&node, ["x1", "y1", "x2", "y2"])?;
                let line = if (y1, x1) <= (y2, x2) {
                    Line { x1, y1, x2, y2 }
                } else {
                    Line { x1: x2, y1: y2, x2: x1, y2: y1 }
                };
                match class {
                    "l" => shapes.links.push(line),
                    "d" => shapes.details.push(line),
                    "g" => shapes.separators.push(line),
                    _ => shapes.bars.push(line),
                }
            }
            ("circle", "a") => {
                let [x, y] = numbers(&node, ["cx", "cy"])?;
                shapes.dots.push((x, y));
            }
            ("path", "a") => {
                let path = node.attribute("d").unwrap_or_default();
                let tip = path.strip_prefix('M').and_then(|it| it.strip_suffix("l-4 9h8z"));
                if let Some((x, y)) = tip.and_then(|it| it.split_once(' ')) {
                    let number = |text: &str| text.parse().map_err(|_| format!("arrow at {text}"));
                    tips.push((number(x)?, number(y)?));
                }
            }
            ("text", _) => {
                let [x, y, width] = numbers(&node, ["x", "y", "textLength"])?;
                let text = node.text().unwrap_or_default().to_owned();
                shapes.texts.push(Text { x, y, width, text, class: class.to_owned() });
            }
            _ => {}
        }
    }
    shapes.tips = Some(tips);
    Ok(shapes)
}

fn numbers<const N: usize>(node: &Node<'_, '_>, names: [&str; N]) -> Result<[i64; N], String> {
    let mut all = [0; N];
    for (at, name) in all.iter_mut().zip(names) {
        let text = node.attribute(name).ok_or_else(|| format!("no {name}"))?;
        *at = text.parse().map_err(|_| format!("{name}={text}"))?;
    }
    Ok(all)
}

/// An action box.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Action {
    pub(crate) qualifier: String,
    /// `↑`, `↓` or nothing.
    pub(crate) when: String,
    pub(crate) text: String,
    pub(crate) condition: Option<String>,
    pub(crate) is_forcing: bool,
    /// The indicator of an action block of IEC 61131-3.
    pub(crate) indicator: String,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Step {
    pub(crate) is_initial: bool,
    /// `step`, `macro` or `enclosing`.
    pub(crate) kind: String,
    pub(crate) left: String,
    pub(crate) actions: Vec<Action>,
    /// True if there is a token in it.
    pub(crate) is_active: bool,
    /// Small texts beside it or below its actions.
    pub(crate) remarks: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Transition {
    pub(crate) name: String,
    pub(crate) sources: Vec<String>,
    pub(crate) targets: Vec<String>,
    pub(crate) receptivity: String,
    pub(crate) actions: Vec<Action>,
    /// Small texts below the receptivity.
    pub(crate) remarks: Vec<String>,
}

/// A chart or an expansion.
#[derive(Debug, Clone, Default)]
pub(crate) struct Region {
    pub(crate) heading: String,
    pub(crate) steps: BTreeMap<String, Step>,
    pub(crate) transitions: Vec<Transition>,
    pub(crate) inner: Vec<Region>,
    /// Other small texts.
    pub(crate) remarks: Vec<String>,
}

/// Reads the sheet: a region for everything outside of frames, with the frames in it. In the style of IEC 61131-3, boxes right of steps have a row for each
/// action.
pub(crate) fn read(svg: &str, style: Style) -> Result<Region, String> {
    region(shapes(svg)?, style)
}

pub(crate) fn region(mut shapes: Shapes, style: Style) -> Result<Region, String> {
    let mut inner = Vec::new();
    let all = std::mem::take(&mut shapes.frames);
    let outer: Vec<Rect> = all
        .iter()
        .filter(|frame| !all.iter().any(|other| other.encloses(frame)))
        .copied()
        .collect();
    for frame in outer {
        let mut part = Shapes::default();
        let take = |at: (i64, i64)| frame.contains(at);
        part.frames = all.iter().filter(|one| frame.encloses(one)).copied().collect();
        let middle = |line: &Line| ((line.x1 + line.x2) / 2, (line.y1 + line.y2) / 2);
        part.boxes = split(&mut shapes.boxes, |it| take(it.middle()));
        part.insets = split(&mut shapes.insets, |it| take(it.middle()));
        part.links = split(&mut shapes.links, |it| take(middle(it)));
        part.details = split(&mut shapes.details, |it| take(middle(it)));
        part.bars = split(&mut shapes.bars, |it| take(middle(it)));
        part.texts = split(&mut shapes.texts, |it| take((it.x + it.width / 2, it.y - 3)));
        part.dots = split(&mut shapes.dots, |it| take(*it));
        part.tips = shapes.tips.as_mut().map(|tips| split(tips, |it| take(*it)));
        inner.push(region(part, style)?);
    }
    let mut region = Reader::new(shapes, style)?.region()?;
    region.inner = inner;
    Ok(region)
}

fn split<T: Clone>(from: &mut Vec<T>, mut is_taken: impl FnMut(&T) -> bool) -> Vec<T> {
    let taken = from.iter().filter(|it| is_taken(it)).cloned().collect();
    from.retain(|it| !is_taken(it));
    taken
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum End {
    Step(usize),
    Transition(usize),
    Double(usize),
    /// The text of a reference.
    Reference(usize),
}

/// The vertical lines of a group that lead up on the way from its only beginning (or to its only end) to its other ends.
fn upward(group: &[Line], root: (i64, i64), others: &[(i64, i64)], is_source: bool) -> Vec<Line> {
    let mut up = Vec::new();
    let mut rest: Vec<Line> = group.to_vec();
    let mut next = vec![root];
    while let Some(from) = next.pop() {
        for line in split(&mut rest, |line| line.has(from)) {
            // Where other lines continue, and the ends of the group on this line.
            let ends = others.iter().copied().filter(|end| line.has(*end));
            let joints: Vec<(i64, i64)> = { rest.iter() }
                .filter(|other| other.touches(&line))
                .map(
                    |other| {
                        if line.x1 == line.x2 { (line.x1, other.y1) } else { (other.x1, line.y1) }
                    },
                )
                .filter(|at| line.has(*at))
                .collect();
            let goes_up = |to: (i64, i64)| if is_source { to.1 < from.1 } else { from.1 < to.1 };
            if ends.chain(joints.iter().copied()).any(goes_up) && line.x1 == line.x2 {
                up.push(line);
            }
            next.extend(joints);
        }
    }
    up
}

#[derive(Default, Debug)]
struct Net {
    sources: Vec<End>,
    sinks: Vec<End>,
}

struct Reader {
    style: Style,
    shapes: Shapes,
    lines: Vec<Text>,
    used: BTreeSet<usize>,
    doubles: Vec<(i64, i64, i64)>,
}

impl Reader {
    fn new(shapes: Shapes, style: Style) -> Result<Self, String> {
        let lines = text_lines(&shapes);
        Ok(Reader { style, shapes, lines, used: BTreeSet::new(), doubles: Vec::new() })
    }

    /// Takes the line of text that `is_it` describes.
    fn take(&mut self, is_it: impl Fn(&Text) -> bool) -> Option<Text> {
        let index = self.lines.iter().position(is_it)?;
        if !self.used.insert(index) {
            return None;
        }
        self.lines.get(index).cloned()
    }

    /// The lowest text that is not used yet and has a property.
    fn take_last(&mut self, is_it: impl Fn(&Text) -> bool) -> Option<Text> {
        let unused = (0..self.lines.len()).filter(|index| !self.used.contains(index));
        let found = unused.filter(|index| is_it(&self.lines[*index]));
        let index = found.max_by_key(|index| self.lines[*index].y)?;
        self.used.insert(index);
        self.lines.get(index).cloned()
    }

    fn region(mut self) -> Result<Region, String> {
        let mut region = Region::default();
        if let Some(heading) = self.take(|line| line.class == "h") {
            region.heading = heading.text;
        }
        self.find_doubles();
        let nets = self.line_groups();
        // Boxes that a line enters from the left are actions; the other boxes are steps.
        let enters = |line: &Line, rect: &Rect| {
            line.ends().iter().any(|(x, y)| *x == rect.x && rect.y < *y && *y < rect.y + rect.h)
        };
        let lines = || {
            self.shapes
                .links
                .iter()
                .chain(self.shapes.details.iter().filter(|it| it.x1 != it.x2 && it.y1 != it.y2))
        };
        let is_action = |rect: &Rect| {
            lines().any(|line| enters(line, rect) && !(rect.x < line.x2 && rect.x < line.x1))
                && lines().any(|line| enters(line, rect) && line.x1.min(line.x2) < rect.x)
        };
        let (actions, steps): (Vec<Rect>, Vec<Rect>) =
            self.shapes.boxes.iter().partition(|it| is_action(it));
        let links = self.shapes.links.clone();
        let mut boxes: Vec<Option<Vec<Action>>> = Vec::new();
        for rect in &actions {
            let is_stack = self.style == Style::Sfc && links.iter().any(|line| enters(line, rect));
            boxes.push(Some(if is_stack { self.stack(rect)? } else { vec![self.action(rect)?] }));
        }
        let mut names = Vec::new();
        for rect in &steps {
            let (name, step) = self.step(rect)?;
            names.push(name.clone());
            if region.steps.insert(name.clone(), step).is_some() {
                return Err(format!("two steps {name}"));
            }
        }
        if self.shapes.dots.iter().any(|dot| !steps.iter().any(|rect| rect.contains(*dot))) {
            return Err("a token outside of steps".to_owned());
        }
        let bars = self.shapes.bars.clone();
        let (mut links, mut led_up) = (Vec::new(), BTreeSet::new());
        let mut ends_of_actions: BTreeMap<usize, i64> = BTreeMap::new();
        for net in &nets {
            let group: Vec<Line> = net.iter().map(|index| self.shapes.links[*index]).collect();
            let owner = steps.iter().position(|rect| {
                group
                    .iter()
                    .flat_map(Line::ends)
                    .any(|(x, y)| x == rect.x + rect.w && rect.y < y && y < rect.y + rect.h)
            });
            let Some(owner) = owner else {
                links.push(self.net(&group, &steps, &bars, &mut led_up)?);
                continue;
            };
            let mut entered: Vec<usize> = (0..actions.len())
                .filter(|index| group.iter().any(|line| enters(line, &actions[*index])))
                .collect();
            if entered.is_empty() {
                return Err("a line from a step to nothing".to_owned());
            }
            let all = group.iter().flat_map(Line::ends);
            for end in all {
                let n = group.iter().filter(|line| line.has(end)).count();
                let is_entered = entered.iter().any(|index| actions[*index].x == end.0);
                if n < 2 && !is_entered && end.0 != steps[owner].x + steps[owner].w {
                    return Err(format!("a loose end at {end:?}"));
                }
            }
            entered.sort_by_key(|index| actions[*index].y);
            let bottom = entered.iter().map(|index| actions[*index].y + actions[*index].h).max();
            ends_of_actions.extend(bottom.map(|bottom| (owner, bottom)));
            for index in entered {
                let actions = boxes[index].take().ok_or("an action of two steps")?;
                if let Some(step) = region.steps.get_mut(&names[owner]) {
                    step.actions.extend(actions);
                }
            }
        }
        self.check_arrows(&led_up)?;
        let mut transitions = Vec::new();
        for bar in &bars {
            transitions.push(self.transition(bar, &actions, &mut boxes)?);
        }
        if boxes.iter().any(Option::is_some) {
            return Err("an action without a step".to_owned());
        }
        self.connect(&links, &names, &mut transitions)?;
        region.transitions = transitions;
        for (index, rect) in steps.iter().enumerate() {
            let remarks = self.remarks_of_step(rect, ends_of_actions.get(&index).copied());
            if let Some(step) = region.steps.get_mut(&names[index]) {
                step.remarks = remarks;
            }
        }
        let rest = (0..self.lines.len()).filter(|index| !self.used.contains(index));
        for index in rest {
            let line = &self.lines[index];
            if line.class != "s" {
                return Err(format!("a text without a symbol: {}", line.text));
            }
            region.remarks.push(line.text.clone());
        }
        region.remarks.sort();
        Ok(region)
    }

    /// Two horizontal lines of the same length, 4 pixels apart.
    fn find_doubles(&mut self) {
        let links = self.shapes.links.clone();
        let is_flat = |line: &&Line| line.y1 == line.y2 && line.x1 < line.x2;
        for line in links.iter().filter(is_flat) {
            let lower = Line { y1: line.y1 + 4, y2: line.y2 + 4, ..*line };
            if links.contains(&lower) {
                self.doubles.push((line.x1, line.x2, line.y1 + 2));
                self.shapes.links.retain(|it| it != line && *it != lower);
            }
        }
    }

    /// The lines that touch, by their numbers.
    fn line_groups(&self) -> Vec<Vec<usize>> {
        let links = &self.shapes.links;
        let mut groups: Vec<Vec<usize>> = Vec::new();
        let mut is_known = vec![false; links.len()];
        for start in 0..links.len() {
            if std::mem::replace(&mut is_known[start], true) {
                continue;
            }
            let mut group = vec![start];
            let mut next = 0;
            while let Some(&at) = group.get(next) {
                next += 1;
                for other in 0..links.len() {
                    if !is_known[other] && links[at].touches(&links[other]) {
                        is_known[other] = true;
                        group.push(other);
                    }
                }
            }
            groups.push(group);
        }
        groups
    }

    /// Each link that leads up has an arrow, and no other line has one.
    fn check_arrows(&self, led_up: &BTreeSet<Line>) -> Result<(), String> {
        let Some(tips) = &self.shapes.tips else { return Ok(()) };
        // A long one has an arrow every 600 pixels.
        let n_tips = |line: &Line| tips.iter().filter(|tip| line.has(**tip)).count();
        let is_wrong = |line: &&Line| n_tips(line) as i64 != 1 + (line.y2 - line.y1) / 600;
        if let Some(line) = led_up.iter().find(is_wrong) {
            return Err(format!("a link leads up with {} arrows: {line:?}", n_tips(line)));
        }
        match tips.iter().find(|tip| !led_up.iter().any(|line| line.has(**tip))) {
            Some(tip) => Err(format!("an arrow at no link that leads up: {tip:?}")),
            None => Ok(()),
        }
    }

    /// The objects that the ends of a group of links touch. Adds its lines that lead up to `led_up`.
    fn net(
        &mut self,
        group: &[Line],
        steps: &[Rect],
        bars: &[Line],
        led_up: &mut BTreeSet<Line>,
    ) -> Result<Net, String> {
        let mut net = Net::default();
        let (mut sources, mut sinks) = (Vec::new(), Vec::new());
        let ends: BTreeSet<(i64, i64)> = group.iter().flat_map(Line::ends).collect();
        for &(x, y) in &ends {
            let n = group.iter().filter(|line| line.has((x, y))).count();
            let bar_middle = |bar: &Line| (bar.x1 + bar.x2) / 2;
            let mut found = Vec::new();
            for (index, rect) in steps.iter().enumerate().filter(|(_, rect)| rect.middle().0 == x) {
                found.extend((rect.y == y).then_some((End::Step(index), true)));
                found.extend((rect.y + rect.h == y).then_some((End::Step(index), false)));
            }
            for (index, bar) in bars.iter().enumerate().filter(|(_, bar)| bar_middle(bar) == x) {
                found.extend((bar.y1 - 2 == y).then_some((End::Transition(index), true)));
                found.extend((bar.y1 + 2 == y).then_some((End::Transition(index), false)));
            }
            let is_vertical = group.iter().any(|line| line.x1 == line.x2 && line.has((x, y)));
            for (index, (left, right, at)) in self.doubles.iter().enumerate() {
                if is_vertical && *left <= x && x <= *right {
                    found.extend((at - 2 == y).then_some((End::Double(index), true)));
                    found.extend((at + 2 == y).then_some((End::Double(index), false)));
                }
            }
            if found.is_empty() && n < 2 {
                let below =
                    |line: &Text| (line.x + line.width / 2 - x).abs() <= 1 && line.y == y + 13;
                let above =
                    |line: &Text| (line.x + line.width / 2 - x).abs() <= 1 && line.y == y - 5;
                let below = self.lines.iter().position(below);
                let above = self.lines.iter().position(above);
                let (index, is_sink) = match (below, above) {
                    (Some(index), None) => (index, true),
                    (None, Some(index)) => (index, false),
                    _ => return Err(format!("a link that ends at nothing: {x} {y}")),
                };
                self.used.insert(index);
                found.push((End::Reference(index), is_sink));
            }
            for (end, is_sink) in found {
                if is_sink { &mut sinks } else { &mut sources }.push((x, y));
                if is_sink { net.sinks.push(end) } else { net.sources.push(end) }
            }
        }
        if net.sources.is_empty() || net.sinks.is_empty() {
            return Err(format!("links without a beginning or an end: {group:?}"));
        }
        if net.sources.len() > 1 && net.sinks.len() > 1 {
            return Err("links with several beginnings and ends".to_owned());
        }
        led_up.extend(match sources.as_slice() {
            [source] => upward(group, *source, &sinks, true),
            _ => upward(group, sinks[0], &sources, false),
        });
        Ok(net)
    }

    fn connect(
        &self,
        nets: &[Net],
        names: &[String],
        transitions: &mut [Transition],
    ) -> Result<(), String> {
        // Alternatives are only below steps and above steps: several links meet at a transition only at a double line.
        for net in nets {
            let is_transition = |end: &End| matches!(end, End::Transition(_));
            if net.sources.len() > 1 && net.sinks.iter().any(is_transition)
                || net.sinks.len() > 1 && net.sources.iter().any(is_transition)
            {
                return Err("several links at a transition without a double line".to_owned());
            }
        }
        let name = |end: &End| -> Result<String, String> {
            match end {
                End::Step(index) => Ok(names[*index].clone()),
                End::Reference(index) => {
                    let text = &self.lines[*index].text;
                    Ok(text.trim_start_matches("→ ").trim_end_matches(" →").to_owned())
                }
                End::Transition(_) | End::Double(_) => Err("transition to transition".to_owned()),
            }
        };
        for (index, (..)) in self.doubles.iter().enumerate() {
            let above = nets.iter().filter(|net| net.sinks.contains(&End::Double(index)));
            let below = nets.iter().filter(|net| net.sources.contains(&End::Double(index)));
            let (above, below): (Vec<_>, Vec<_>) = (above.collect(), below.collect());
            let joins = matches!(below.as_slice(), [net] if matches!(net.sinks.as_slice(), [End::Transition(_)]));
            let forks = matches!(above.as_slice(), [net] if matches!(net.sources.as_slice(), [End::Transition(_)]));
            let ends = |nets: &[&Net], sinks: bool| -> usize {
                let all = nets.iter().flat_map(|net| if sinks { &net.sinks } else { &net.sources });
                all.filter(|end| **end == End::Double(index)).count()
            };
            if !(joins && ends(&above, true) > 1 || forks && ends(&below, false) > 1) {
                return Err("a double line that neither forks nor joins".to_owned());
            }
        }
        for (index, transition) in transitions.iter_mut().enumerate() {
            let own = End::Transition(index);
            for net in nets.iter().filter(|net| net.sinks.contains(&own)) {
                for source in &net.sources {
                    match source {
                        End::Double(double) => {
                            let above = |net: &&Net| net.sinks.contains(&End::Double(*double));
                            for net in nets.iter().filter(above) {
                                let n = net
                                    .sinks
                                    .iter()
                                    .filter(|end| **end == End::Double(*double))
                                    .count();
                                for source in &net.sources {
                                    for _ in 0..n {
                                        transition.sources.push(name(source)?);
                                    }
                                }
                            }
                        }
                        end => transition.sources.push(name(end)?),
                    }
                }
            }
            for net in nets.iter().filter(|net| net.sources.contains(&own)) {
                for sink in &net.sinks {
                    match sink {
                        End::Double(double) => {
                            let below = |net: &&Net| net.sources.contains(&End::Double(*double));
                            for net in nets.iter().filter(below) {
                                let n = net
                                    .sources
                                    .iter()
                                    .filter(|end| **end == End::Double(*double))
                                    .count();
                                for sink in &net.sinks {
                                    for _ in 0..n {
                                        transition.targets.push(name(sink)?);
                                    }
                                }
                            }
                        }
                        end => transition.targets.push(name(end)?),
                    }
                }
            }
            transition.sources.sort();
            transition.targets.sort();
        }
        Ok(())
    }

    /// The lines of text in a box, from the column on, joined.
    fn inside(&mut self, rect: &Rect, from: i64, to: i64, between: &str) -> String {
        let mut lines: Vec<(i64, usize)> = Vec::new();
        for (index, line) in self.lines.iter().enumerate() {
            if rect.contains((line.x, line.y - 3)) && from <= line.x && line.x < to {
                lines.push((line.y, index));
            }
        }
        lines.sort_unstable();
        self.used.extend(lines.iter().map(|(_, index)| *index));
        let texts: Vec<&str> =
            lines.iter().map(|(_, index)| self.lines[*index].text.as_str()).collect();
        texts.join(between)
    }

    /// The small texts that begin at a point and below it.
    fn remarks(&mut self, x: i64, first: i64) -> Vec<String> {
        let mut all = Vec::new();
        let mut y = first;
        while let Some(line) = self.take(|line| line.class == "s" && line.x == x && line.y == y) {
            all.push(line.text);
            y += 15;
        }
        all
    }

    /// The remarks of a step: below its actions, or level with its middle.
    fn remarks_of_step(&mut self, rect: &Rect, end_of_actions: Option<i64>) -> Vec<String> {
        let right = rect.x + rect.w;
        if let Some(end) = end_of_actions {
            return self.remarks(right + 18, end + 15);
        }
        let is_here = |lines: &[Text], y: i64| {
            lines.iter().any(|line| line.class == "s" && line.x == right + 8 && line.y == y)
        };
        let first = |n: i64| rect.middle().1 - n * 15 / 2 + 11;
        let all_here = |n: &i64| (0..*n).all(|at| is_here(&self.lines, first(*n) + 15 * at));
        match (1..9).rev().find(all_here) {
            Some(n) => self.remarks(right + 8, first(n)),
            None => Vec::new(),
        }
    }

    fn has_inset(&self, rect: &Rect) -> bool {
        let Rect { x, y, w, h } = *rect;
        self.shapes.insets.contains(&Rect { x: x + 3, y: y + 3, w: w - 6, h: h - 6 })
    }

    fn step(&mut self, rect: &Rect) -> Result<(String, Step), String> {
        let Rect { x, y, w, h } = *rect;
        let mut name = self.inside(rect, x, x + w, "");
        let details = |line: Line| self.shapes.details.contains(&line);
        let across = |y: i64| details(Line { x1: x, y1: y, x2: x + w, y2: y });
        let corner = |x1, y1, x2, y2| details(Line { x1, y1, x2, y2 });
        let is_macro = across(y + 6) && across(y + h - 6);
        let is_enclosing = corner(x + 8, y, x, y + 8)
            && corner(x + w - 8, y, x + w, y + 8)
            && corner(x, y + h - 8, x + 8, y + h)
            && corner(x + w, y + h - 8, x + w - 8, y + h);
        let kind = match (is_macro, is_enclosing) {
            (true, _) => "macro",
            (_, true) => "enclosing",
            _ => "step",
        };
        if is_macro {
            name = name.strip_prefix("M ").ok_or("a macro-step without M")?.to_owned();
        }
        if name.is_empty() {
            return Err("a step without a name".to_owned());
        }
        let left = self.take(|line| line.x + line.width == x - 6 && line.y == y + h / 2 + 4);
        let left = left.map(|line| line.text).unwrap_or_default();
        Ok((
            name,
            Step {
                is_initial: self.has_inset(rect),
                kind: kind.to_owned(),
                left,
                actions: Vec::new(),
                is_active: self.shapes.dots.contains(&(x + w / 2, y + h - 9)),
                remarks: Vec::new(),
            },
        ))
    }

    fn action(&mut self, rect: &Rect) -> Result<Action, String> {
        let Rect { x, y, w, h } = *rect;
        let cell = self.shapes.details.iter().find(|line| {
            line.x1 == line.x2 && x < line.x1 && line.x1 < x + w && line.y1 == y && line.y2 == y + h
        });
        let cell = cell.map(|line| line.x1);
        let qualifier = cell.map(|cell| self.inside(rect, x, cell, " ")).unwrap_or_default();
        let text = self.inside(rect, cell.unwrap_or(x), x + w, " ");
        if text.is_empty() && qualifier.is_empty() {
            return Err("an empty box".to_owned());
        }
        let tips: Vec<i64> = (self.shapes.details.iter())
            .filter(|line| {
                line.x1 == line.x2 && line.x1 == x + 6 && rect.contains((line.x1, line.y1))
            })
            .flat_map(|line| [line.y1, line.y2])
            .filter(|y| {
                self.shapes.details.iter().filter(|line| line.ends().contains(&(x + 6, *y))).count()
                    == 3
            })
            .collect();
        let when = match tips.as_slice() {
            [tip] if *tip < y + h / 2 => "↑",
            [_] => "↓",
            _ => "",
        };
        let stroke = Line { x1: x + 10, y1: y - 7, x2: x + 10, y2: y };
        let mut condition = None;
        if self.shapes.details.contains(&stroke) {
            let mut lines = Vec::new();
            let mut last = y - 7;
            // The lowest line first.
            while let Some(line) =
                self.take_last(|line| line.x == x + 4 && line.y < last && last - line.y <= 30)
            {
                last = line.y;
                lines.insert(0, line.text);
            }
            if lines.is_empty() {
                return Err("a stroke without a condition".to_owned());
            }
            condition = Some(lines.join(" "));
        }
        Ok(Action {
            qualifier,
            when: when.to_owned(),
            text,
            condition,
            is_forcing: self.has_inset(rect),
            indicator: String::new(),
        })
    }

    /// The rows of a box, which lines divide into qualifier, action and perhaps indicator.
    fn stack(&mut self, rect: &Rect) -> Result<Vec<Action>, String> {
        let Rect { x, y, w, h } = *rect;
        let details = &self.shapes.details;
        let across = details.iter().filter(|line| {
            line.y1 == line.y2 && line.x1 == x && line.x2 == x + w && y < line.y1 && line.y1 < y + h
        });
        let mut cuts: Vec<i64> = across.map(|line| line.y1).chain([y, y + h]).collect();
        cuts.sort_unstable();
        let mut rows = Vec::new();
        let mut first = None;
        for pair in cuts.windows(2) {
            let row = Rect { x, y: pair[0], w, h: pair[1] - pair[0] };
            let inside = self.shapes.details.iter().filter(|line| {
                line.x1 == line.x2
                    && x < line.x1
                    && line.x1 < x + w
                    && row.y <= line.y1
                    && line.y2 <= row.y + row.h
            });
            let mut columns: Vec<i64> = Vec::new();
            for line in inside {
                if line.y1 != row.y || line.y2 != row.y + row.h {
                    return Err(format!("a line that does not divide a row: {line:?}"));
                }
                columns.push(line.x1);
            }
            columns.sort_unstable();
            let (left, right) = match columns.as_slice() {
                [left] => (*left, x + w),
                [left, right] => (*left, *right),
                _ => return Err(format!("{} columns in a row", columns.len() + 1)),
            };
            if *first.get_or_insert(left) != left {
                return Err("rows with different columns".to_owned());
            }
            let action = Action {
                qualifier: self.inside(&row, x, left, " "),
                when: String::new(),
                text: self.inside(&row, left, right, " "),
                condition: None,
                is_forcing: false,
                indicator: self.inside(&row, right, x + w, " "),
            };
            if action.qualifier.is_empty() || action.text.is_empty() {
                return Err("an action block without qualifier or action".to_owned());
            }
            if action.indicator.is_empty() != (right == x + w) {
                return Err("a column without an indicator".to_owned());
            }
            rows.push(action);
        }
        Ok(rows)
    }

    fn transition(
        &mut self,
        bar: &Line,
        actions: &[Rect],
        boxes: &mut [Option<Vec<Action>>],
    ) -> Result<Transition, String> {
        let name = self.take(|line| line.x + line.width == bar.x1 - 6 && line.y == bar.y1 + 4);
        let name =
            name.map(|name| name.text.trim_start_matches('(').trim_end_matches(')').to_owned());
        let mut texts = Vec::new();
        let mut y = bar.y1 + 4;
        if let Some(line) =
            self.take(|line| line.x == bar.x2 + 8 && line.y == y && line.class.is_empty())
        {
            texts.push(line.text);
        }
        while let Some(line) = self.take(|line| {
            line.x == bar.x2 + 8
                && line.y > y
                && line.y <= y + 30
                && line.class.is_empty()
                && !actions.iter().any(|rect| rect.contains((line.x + 1, line.y - 3)))
        }) {
            y = line.y;
            texts.push(line.text);
        }
        if texts.is_empty() {
            return Err("a transition without a receptivity".to_owned());
        }
        let remarks = self.remarks(bar.x2 + 8, y + 15);
        let mut own = Vec::new();
        for (rect, action) in actions.iter().zip(boxes.iter_mut()) {
            let end = (rect.x, rect.middle().1);
            let start = (bar.x2 - 2, bar.y1 + 2);
            let is_joined = |line: &Line| {
                line.ends().contains(&start)
                    && line.ends().iter().any(|it| it.0 == end.0 && (it.1 - end.1).abs() <= 1)
            };
            if self.shapes.details.iter().any(is_joined) {
                own.extend(action.take().unwrap_or_default());
            }
        }
        Ok(Transition {
            name: name.unwrap_or_default(),
            sources: Vec::new(),
            targets: Vec::new(),
            receptivity: texts.join(" "),
            actions: own,
            remarks,
        })
    }
}

/// Joins the runs of each line of text, with overlines.
fn text_lines(shapes: &Shapes) -> Vec<Text> {
    let mut runs = shapes.texts.clone();
    runs.sort_by_key(|run| (run.y, run.x));
    let mut lines: Vec<Vec<Text>> = Vec::new();
    for run in runs {
        match lines.last_mut() {
            Some(line)
                if line.last().is_some_and(|last| {
                    last.y == run.y && last.x + last.width == run.x && last.class == run.class
                }) =>
            {
                line.push(run);
            }
            _ => lines.push(vec![run]),
        }
    }
    lines.iter().map(|runs| joined(runs, shapes)).collect()
}

fn joined(runs: &[Text], shapes: &Shapes) -> Text {
    let first = &runs[0];
    let size = match first.class.as_str() {
        "s" => 11,
        "h" => 14,
        _ => 12,
    };
    let end = runs.last().map_or(0, |run| run.x + run.width);
    let mut over: Vec<&Line> = shapes
        .details
        .iter()
        .filter(|line| {
            let up = first.y - size + 1 - line.y1;
            line.y1 == line.y2
                && (0..=30).contains(&up)
                && up % 3 == 0
                && first.x <= line.x1
                && line.x2 <= end
        })
        .filter(|line| {
            runs.iter().any(|run| run.x == line.x1)
                && runs.iter().any(|run| run.x + run.width == line.x2)
        })
        .collect();
    // Outer overlines first.
    over.sort_by_key(|line| line.y1);
    let mut text = String::new();
    for run in runs {
        over.iter().filter(|line| line.x1 == run.x).for_each(|_| text.push_str("(not ("));
        text.push_str(&run.text);
        over.iter().filter(|line| line.x2 == run.x + run.width).for_each(|_| text.push_str("))"));
    }
    Text { x: first.x, y: first.y, width: end - first.x, text, class: first.class.clone() }
}
