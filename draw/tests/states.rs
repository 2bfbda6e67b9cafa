//! Drawings of statecharts are read back from their geometry and compared with their charts.
//!
//! Both sides become lists of short charts in the chart language: one for each activity and each transition.

use crate::reader::{Line, Rect, Text};
use grafsynth_draw::{Options, layout, svg};
use grafsynth_frontend::{graf, scxml};
use grafsynth_ir::chart::{Chart, Design, Item, Path, State, StepItemKind, StepRole, Transition};
use grafsynth_ir::net::Meta;
use grafsynth_ir::{FileId, Name, Span};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

/// The contents of a statechart: each state with its kind and activities, and everything else as a canonical text.
#[derive(Debug, Default, PartialEq, Eq)]
struct Meaning {
    states: BTreeMap<Vec<String>, String>,
    /// What a state does and its reactions without a target, in their order.
    activities: BTreeMap<Vec<String>, Vec<String>>,
    facts: Vec<String>,
}

impl Meaning {
    fn fact(&mut self, text: String) {
        self.facts.push(text);
        self.facts.sort();
    }

    fn activity(&mut self, state: Vec<String>, text: String) {
        self.activities.entry(state).or_default().push(text);
    }
}

/// A short chart in its canonical form.
fn canonical(items: &str) -> Result<String, String> {
    let text = format!("chart c {{ conflict inner-first\n{items}\n}}");
    let parsed = graf::parse(FileId(0), &text);
    match parsed.design {
        Some(design) if !parsed.diagnostics.iter().any(|it| it.is_error()) => {
            Ok(graf::write_design(&design))
        }
        _ => Err(format!("{text}: {:?}", parsed.diagnostics)),
    }
}

fn written(item: Item) -> String {
    let chart = Chart { items: vec![item], ..Chart::default() };
    let text = graf::write_design(&Design { charts: vec![chart], ..Design::default() });
    let start = text.find('{').expect("it is there") + 1;
    let end = text.rfind('}').expect("it is there");
    canonical(&text[start..end]).expect("it was written")
}

// ---- the contents of the chart ----

/// A state or history, or nothing (`None`) for a region without a name.
struct Known {
    path: Vec<String>,
}

fn meaning(chart: &Chart) -> Meaning {
    let mut known = Vec::new();
    for state in chart.items.iter().filter_map(as_state) {
        know(&state, &[], &mut known);
    }
    let mut out = Meaning::default();
    items(&chart.items, &[], &known, &mut out);
    reactions(&chart.items, &[], &known, &mut out);
    if chart.initial.is_empty() {
        default_child(&chart.items, &[], &mut out);
    } else {
        default(&[], &[], &chart.initial, &[], &known, &mut out);
    }
    out
}

fn below(around: &[String], name: &Name) -> Vec<String> {
    [around, std::slice::from_ref(&name.text)].concat()
}

/// A final state is a step without states in it.
fn as_state(item: &Item) -> Option<State> {
    match item {
        Item::State(state) => Some(state.clone()),
        Item::Step(step) => Some(State { step: step.clone(), ..State::default() }),
        _ => None,
    }
}

fn know(state: &State, around: &[String], known: &mut Vec<Known>) {
    let path = below(around, &state.step.name);
    for history in &state.histories {
        known.push(Known { path: below(&path, &history.name) });
    }
    for inner in state.items.iter().filter_map(as_state) {
        know(&inner, &path, known);
    }
    known.push(Known { path });
}

/// The full path of the state that a path refers to: of the possible ones, the one with the longest prefix in common with the scope.
fn resolved(path: &Path, scope: &[String], known: &[Known]) -> Vec<String> {
    let names: Vec<&str> = path.names.iter().map(|name| name.text.as_str()).collect();
    let is_meant = |it: &&Known| {
        let mut all = it.path.iter().rev();
        it.path.last().map(String::as_str) == names.last().copied()
            && names.iter().rev().all(|name| all.any(|one| one == name))
    };
    let shared = |it: &&Known| it.path.iter().zip(scope).take_while(|(a, b)| a == b).count();
    let mut all: Vec<&Known> = known.iter().filter(is_meant).collect();
    all.sort_by_key(|it| std::cmp::Reverse(shared(it)));
    all.first()
        .map_or_else(|| names.iter().map(|it| (*it).to_owned()).collect(), |it| it.path.clone())
}

fn as_path(names: &[String]) -> Path {
    Path { names: names.iter().map(|name| Name::new(name.clone(), Span::default())).collect() }
}

fn items(all: &[Item], scope: &[String], known: &[Known], out: &mut Meaning) {
    for item in all {
        match item {
            Item::State(_) | Item::Step(_) => {
                let one = as_state(item).expect("it is one");
                state(&one, scope, known, out);
            }
            Item::Transition(one) if !is_reaction(one) => {
                let full = |ends: &[Path]| {
                    let all = ends.iter().map(|end| as_path(&resolved(end, scope, known)));
                    let mut all: Vec<Path> = all.collect();
                    all.sort_by_key(ToString::to_string);
                    all
                };
                let (sources, targets) = (full(&one.sources), full(&one.targets));
                let is_inside = |it: &Path| {
                    it.names.len() > sources[0].names.len()
                        && it.names.iter().zip(&sources[0].names).all(|(a, b)| a == b)
                };
                let is_internal = one.is_internal && targets.iter().all(is_inside);
                let meta = Meta { span: Span::default(), ..one.meta.clone() };
                let one = Transition { sources, targets, is_internal, meta, ..one.clone() };
                out.fact(written(Item::Transition(one)));
            }
            _ => {}
        }
    }
}

/// True for a transition that is drawn inside of its state, below the activities.
fn is_reaction(transition: &Transition) -> bool {
    transition.is_internal && transition.targets.is_empty() && transition.sources.len() == 1
}

/// Adds the transitions that are drawn inside of their states.
fn reactions(all: &[Item], scope: &[String], known: &[Known], out: &mut Meaning) {
    for item in all {
        match item {
            Item::State(state) => {
                reactions(&state.items, &below(scope, &state.step.name), known, out);
            }
            Item::Transition(one) if is_reaction(one) => {
                let path = resolved(&one.sources[0], scope, known);
                let meta = Meta { span: Span::default(), ..one.meta.clone() };
                let sources = vec![as_path(&path)];
                let one = Transition { sources, meta, ..one.clone() };
                out.activity(path, written(Item::Transition(one)));
            }
            _ => {}
        }
    }
}

fn state(one: &State, scope: &[String], known: &[Known], out: &mut Meaning) {
    let path = below(scope, &one.step.name);
    let n_states = one.items.iter().filter_map(as_state).count();
    let kind = if one.step.role == StepRole::Final {
        "final".to_owned()
    } else if one.is_parallel && n_states > 1 {
        format!("{n_states} regions")
    } else {
        "state".to_owned()
    };
    let mut remarks = about(&one.step.meta);
    for item in &one.step.body {
        match item.kind {
            StepItemKind::Priority(rank) => remarks.push(format!("priority {rank}")),
            StepItemKind::Budget(cost) => remarks.push(format!("budget {cost}")),
            _ => {}
        }
    }
    out.states.insert(path.clone(), format!("{kind} {}", remarks.join(" ")).trim().to_owned());
    for item in &one.step.body {
        let kind = match item.kind.clone() {
            StepItemKind::Priority(_) | StepItemKind::Budget(_) => continue,
            StepItemKind::On { events, guard, actions } => {
                let sources = vec![as_path(&path)];
                let is_internal = true;
                let one = Transition {
                    sources,
                    events,
                    guard,
                    actions,
                    is_internal,
                    ..Transition::default()
                };
                out.activity(path.clone(), written(Item::Transition(one)));
                continue;
            }
            kind => kind,
        };
        let mut bare = State::default();
        bare.step.name = Name::new(path.join("_"), Span::default());
        bare.step.body = vec![grafsynth_ir::chart::StepItem { kind, span: Span::default() }];
        out.activity(path.clone(), written(Item::State(bare)));
    }
    for history in &one.histories {
        let full = below(&path, &history.name);
        let deep = if history.is_deep { "deep history" } else { "history" };
        let remarks = about(&history.meta).join(" ");
        out.states.insert(full.clone(), format!("{deep} {remarks}").trim().to_owned());
        if !history.default.is_empty() {
            default(&full, &path, &history.default, &history.content, known, out);
        }
    }
    items(&one.items, &path, known, out);
    match &one.initial {
        Some((targets, actions)) => {
            let from = [&path[..], &["initial".to_owned()]].concat();
            default(&from, &path, targets, actions, known, out);
        }
        None if !one.is_parallel => default_child(&one.items, &path, out),
        None => {}
    }
}

fn about(meta: &Meta) -> Vec<String> {
    let mut all = Vec::new();
    if !meta.label.is_empty() {
        all.push(format!("\"{}\"", meta.label.replace('\\', "\\\\").replace('"', "\\\"")));
    }
    if !meta.req.is_empty() {
        all.push(format!("req {}", meta.req.join(", ")));
    }
    all
}

fn default_child(all: &[Item], scope: &[String], out: &mut Meaning) {
    let states =
        all.iter().filter_map(|item| if let Item::State(one) = item { Some(one) } else { None });
    let marked = states.clone().find(|one| one.step.role == StepRole::Initial);
    if let Some(one) = marked.or_else(|| states.clone().next()) {
        let to = below(scope, &one.step.name);
        let from = [scope, &["initial".to_owned()]].concat();
        let one = Transition {
            sources: vec![as_path(&from)],
            targets: vec![as_path(&to)],
            ..Transition::default()
        };
        out.fact(written(Item::Transition(one)));
    }
}

fn default(
    from: &[String],
    scope: &[String],
    targets: &[Path],
    actions: &[grafsynth_ir::chart::Stmt],
    known: &[Known],
    out: &mut Meaning,
) {
    let mut from = from.to_vec();
    if from.is_empty() {
        from.push("initial".to_owned());
    }
    let mut targets: Vec<Path> =
        targets.iter().map(|target| as_path(&resolved(target, scope, known))).collect();
    targets.sort_by_key(ToString::to_string);
    let sources = vec![as_path(&from)];
    let one = Transition { sources, targets, actions: actions.to_vec(), ..Transition::default() };
    out.fact(written(Item::Transition(one)));
}

// ---- the contents of the drawing ----

#[derive(Debug, Default)]
struct Drawing {
    boxes: Vec<Rect>,
    links: Vec<Line>,
    details: Vec<Line>,
    dashed: Vec<Line>,
    bars: Vec<Line>,
    /// Middle, radius, and whether it is filled.
    circles: Vec<(i64, i64, i64, bool)>,
    tips: Vec<(i64, i64)>,
    texts: Vec<Text>,
}

fn drawing(svg: &str) -> Result<Drawing, String> {
    let document = roxmltree::Document::parse(svg).map_err(|error| error.to_string())?;
    let mut out = Drawing::default();
    for node in document.descendants() {
        let class = node.attribute("class").unwrap_or_default();
        let number = |name: &str| -> Result<i64, String> {
            let text = node.attribute(name).ok_or_else(|| format!("no {name}"))?;
            text.parse().map_err(|_| format!("{name}={text}"))
        };
        match (node.tag_name().name(), class) {
            ("rect", "u") => out.boxes.push(Rect {
                x: number("x")?,
                y: number("y")?,
                w: number("width")?,
                h: number("height")?,
            }),
            ("line", class) => {
                let (a, b) = ((number("x1")?, number("y1")?), (number("x2")?, number("y2")?));
                let (a, b) = (a.min(b), a.max(b));
                let line = Line { x1: a.0, y1: a.1, x2: b.0, y2: b.1 };
                match class {
                    "l" => out.links.push(line),
                    "d" => out.details.push(line),
                    "r" => out.dashed.push(line),
                    "b" => out.bars.push(line),
                    _ => {}
                }
            }
            ("circle", class) => {
                out.circles.push((number("cx")?, number("cy")?, number("r")?, class == "a"));
            }
            ("path", "a") => {
                let text = node.attribute("d").unwrap_or_default();
                let tip = text.trim_start_matches('M').split('l').next().unwrap_or_default();
                let tip: Vec<i64> = tip.split(' ').filter_map(|it| it.parse().ok()).collect();
                out.tips.push((tip[0], tip[1]));
            }
            ("text", _) => {
                let text = node.text().unwrap_or_default().to_owned();
                let (x, y, width) = (number("x")?, number("y")?, number("textLength")?);
                out.texts.push(Text { x, y, width, text, class: class.to_owned() });
            }
            _ => {}
        }
    }
    // The heading and the remarks of the chart are above everything else.
    let tops = out.boxes.iter().map(|one| one.y).chain(out.circles.iter().map(|it| it.1 - it.2));
    let top = tops.min().unwrap_or(i64::MAX);
    out.texts.retain(|text| text.y > top);
    Ok(out)
}

/// A box or region with its texts.
#[derive(Debug, Clone)]
struct Area {
    rect: Rect,
    parent: Option<usize>,
    name: String,
    remarks: String,
    lines: Vec<String>,
    /// The line below the texts of a box with contents.
    header: i64,
    n_regions: usize,
    is_region: bool,
}

fn read(svg: &str) -> Result<Meaning, String> {
    let drawing = drawing(svg)?;
    let mut used = vec![false; drawing.texts.len()];
    let mut areas = areas(&drawing, &mut used)?;
    regions(&drawing, &mut areas);
    let mut out = Meaning::default();
    let round = circles(&drawing, &mut used)?;
    let labels = labels(&drawing, &mut used);
    region_texts(&drawing, &mut areas, &mut used);
    if let Some(index) = used.iter().position(|used| !used) {
        return Err(format!("a text without a place: {:?}", drawing.texts[index]));
    }
    for (index, area) in areas.iter().enumerate().filter(|(_, area)| !area.name.is_empty()) {
        let has_contents = areas.iter().any(|it| it.parent == Some(index));
        if area.is_region
            && !has_contents
            && !drawing.circles.iter().any(|it| within(&area.rect, (it.0, it.1)))
        {
            return Err(format!("nothing in {}", area.name));
        }
        let kind =
            if area.n_regions > 1 { format!("{} regions", area.n_regions) } else { "state".into() };
        let path = path(&areas, Some(index));
        for line in &area.lines {
            out.activity(path.clone(), activity(&path, line)?);
        }
        let text = format!("{kind} {}", area.remarks).trim().to_owned();
        if out.states.insert(path, text).is_some() {
            return Err(format!("two states {}", area.name));
        }
    }
    let mut circles = Vec::new();
    for circle in round {
        let mut path = path(&areas, around(&areas, (circle.at.0, circle.at.1)));
        path.push(circle.name);
        for line in circle.lines {
            out.activity(path.clone(), activity(&path, &line)?);
        }
        if !circle.kind.is_empty() {
            let text = format!("{} {}", circle.kind, circle.remarks.trim());
            out.states.insert(path.clone(), text.trim().to_owned());
        }
        circles.push((circle.at, path));
    }
    let arrows = arrows(&drawing, &areas, &circles)?;
    transitions(&arrows, &labels, &mut out)?;
    Ok(out)
}

fn encloses(outer: &Rect, inner: &Rect) -> bool {
    outer.x < inner.x
        && outer.y < inner.y
        && inner.x + inner.w < outer.x + outer.w
        && inner.y + inner.h < outer.y + outer.h
}

fn within(rect: &Rect, (x, y): (i64, i64)) -> bool {
    rect.x <= x && x <= rect.x + rect.w && rect.y <= y && y <= rect.y + rect.h
}

/// The smallest area around a point.
fn around(areas: &[Area], point: (i64, i64)) -> Option<usize> {
    let all = areas.iter().enumerate().filter(|(_, area)| within(&area.rect, point));
    all.min_by_key(|(_, area)| area.rect.w * area.rect.h).map(|(index, _)| index)
}

fn path(areas: &[Area], area: Option<usize>) -> Vec<String> {
    let mut names = Vec::new();
    let mut next = area;
    while let Some(index) = next {
        if !areas[index].name.is_empty() {
            names.insert(0, areas[index].name.clone());
        }
        next = areas[index].parent;
    }
    names
}

fn areas(drawing: &Drawing, used: &mut [bool]) -> Result<Vec<Area>, String> {
    let mut areas = Vec::new();
    for (index, rect) in drawing.boxes.iter().enumerate() {
        let outer = |(_, other): &(usize, &Rect)| encloses(other, rect);
        let parents = drawing.boxes.iter().enumerate().filter(outer);
        let parent = parents.min_by_key(|(_, other)| other.w * other.h).map(|(index, _)| index);
        let is_inside = |point: (i64, i64)| within(rect, point);
        let has_contents = drawing
            .boxes
            .iter()
            .enumerate()
            .any(|(it, other)| it != index && encloses(rect, other))
            || drawing.circles.iter().any(|it| is_inside((it.0, it.1)));
        let edge = header_edge(drawing, rect);
        let across = drawing.details.iter().filter(|it| {
            it.y1 == it.y2 && it.x1 == rect.x && it.x2 == edge && is_inside((it.x1, it.y1))
        });
        let mut lines: Vec<i64> = across.map(|it| it.y1).collect();
        lines.sort_unstable();
        let end = rect.y + rect.h;
        let first = lines.first().copied().unwrap_or(end);
        let last = match (has_contents, lines.last()) {
            (true, Some(last)) => *last,
            (true, None) => return Err(format!("no line below the name in {rect:?}")),
            (false, _) => end,
        };
        let mut area = Area {
            rect: *rect,
            parent,
            name: String::new(),
            remarks: String::new(),
            lines: Vec::new(),
            header: last,
            n_regions: 0,
            is_region: false,
        };
        let mut texts: Vec<usize> = (0..drawing.texts.len()).collect();
        texts.sort_by_key(|it| (drawing.texts[*it].y, drawing.texts[*it].x));
        let left = texts
            .iter()
            .map(|it| &drawing.texts[*it])
            .filter(|it| is_inside((it.x, it.y)) && it.y > first);
        let left = left.map(|it| it.x).min().unwrap_or(0);
        for index in texts {
            let text = &drawing.texts[index];
            // Texts outside of this box, and those below its last line, belong to other states.
            if !is_inside((text.x, text.y)) || text.y > last || used[index] {
                continue;
            }
            used[index] = true;
            if text.y < first && text.class == "s" {
                area.remarks = format!("{} {}", area.remarks, text.text).trim().to_owned();
            } else if text.y < first {
                area.name.push_str(&text.text);
            } else if text.x > left {
                let line = area.lines.last_mut().ok_or("a line without a beginning")?;
                *line = format!("{line} {}", text.text);
            } else {
                area.lines.push(text.text.clone());
            }
        }
        area.name = area.name.trim_matches('`').to_owned();
        areas.push(area);
    }
    Ok(areas)
}

/// The right side of the part of a box with its name: that of the box, or the line that makes it a tab.
fn header_edge(drawing: &Drawing, rect: &Rect) -> i64 {
    let is_edge =
        |it: &&Line| it.x1 == it.x2 && it.y1 == rect.y && rect.x < it.x1 && it.x1 < rect.x + rect.w;
    drawing.details.iter().find(is_edge).map_or(rect.x + rect.w, |it| it.x1)
}

/// Adds the regions of boxes with dashed lines, and puts the boxes inside of them.
fn regions(drawing: &Drawing, areas: &mut Vec<Area>) {
    for owner in 0..areas.len() {
        let rect = areas[owner].rect;
        let mine = drawing
            .dashed
            .iter()
            .filter(|it| around(&areas[..drawing.boxes.len()], (it.x1, it.y1 + 1)) == Some(owner));
        let mut dashes: Vec<&Line> = mine.collect();
        dashes.sort();
        let (Some(first), Some(last)) = (dashes.first(), dashes.last()) else { continue };
        let mut edges = vec![rect.x];
        edges.extend(dashes.iter().map(|it| it.x1));
        edges.push(rect.x + rect.w);
        areas[owner].n_regions = edges.len() - 1;
        for pair in edges.windows(2) {
            let rect =
                Rect { x: pair[0], y: first.y1, w: pair[1] - pair[0], h: last.y2 - first.y1 };
            let own = areas.len();
            for area in areas.iter_mut().filter(|area| area.parent == Some(owner)) {
                if within(&rect, (area.rect.x, area.rect.y)) && !area.is_region {
                    area.parent = Some(own);
                }
            }
            areas.push(Area {
                rect,
                parent: Some(owner),
                name: String::new(),
                remarks: String::new(),
                lines: Vec::new(),
                header: 0,
                n_regions: 0,
                is_region: true,
            });
        }
    }
}

/// Texts that belong to nothing else are the heads of regions.
fn region_texts(drawing: &Drawing, areas: &mut [Area], used: &mut [bool]) {
    let mut order: Vec<usize> = (0..drawing.texts.len()).filter(|it| !used[*it]).collect();
    order.sort_by_key(|it| (drawing.texts[*it].y, drawing.texts[*it].x));
    let mut left = BTreeMap::new();
    let mut bottom = BTreeMap::new();
    for index in order {
        let text = &drawing.texts[index];
        let Some(area) = around(areas, (text.x, text.y)).filter(|it| areas[*it].is_region) else {
            continue;
        };
        used[index] = true;
        let gap = text.y - bottom.insert(area, text.y).unwrap_or(text.y);
        let left = *left.entry(area).or_insert(text.x);
        let area = &mut areas[area];
        if text.class == "s" {
            area.remarks = format!("{} {}", area.remarks, text.text).trim().to_owned();
        } else if gap <= 15 && area.lines.is_empty() {
            area.name.push_str(&text.text);
        } else if text.x > left && !area.lines.is_empty() {
            let line = area.lines.last_mut().expect("it is there");
            *line = format!("{line} {}", text.text);
        } else {
            area.lines.push(text.text.clone());
        }
    }
}

/// A pseudo-state or final state.
#[derive(Debug)]
struct Circle {
    at: (i64, i64, i64),
    /// Empty for the dot of a default.
    kind: &'static str,
    name: String,
    remarks: String,
    lines: Vec<String>,
}

/// The rows of the lines that follow each other without a gap, and whose middle is at `y`.
fn lines_around<'t>(texts: impl Iterator<Item = &'t Text>, y: i64) -> Vec<i64> {
    let mut rows: Vec<i64> = texts.map(|text| text.y).collect();
    rows.sort_unstable();
    rows.dedup();
    let blocks = rows.chunk_by(|above, below| below - above <= 15);
    let is_meant = |block: &&[i64]| (block[0] - 12 - y + block[block.len() - 1] + 3 - y).abs() < 8;
    { blocks }.find(is_meant).map(<[i64]>::to_vec).unwrap_or_default()
}

/// The circles with their texts.
fn circles(drawing: &Drawing, used: &mut [bool]) -> Result<Vec<Circle>, String> {
    let mut all = Vec::new();
    for &(x, y, radius, is_filled) in &drawing.circles {
        let same = || drawing.circles.iter().filter(|it| (it.0, it.1) == (x, y));
        if is_filled && same().any(|it| !it.3) {
            continue;
        }
        let mut circle = Circle {
            at: (x, y, radius),
            kind: if same().any(|it| it.3) { "final" } else { "" },
            name: String::new(),
            remarks: String::new(),
            lines: Vec::new(),
        };
        if is_filled {
            circle.kind = "";
            circle.name = "initial".to_owned();
            all.push(circle);
            continue;
        }
        let left = x + radius + 5;
        // A text in a box that the circle is not in belongs to the box.
        let is_elsewhere = |text: &Text| {
            let boxes = drawing.boxes.iter().filter(|it| within(it, (text.x, text.y)));
            { boxes }.any(|it| !within(it, (x, y)))
        };
        let is_column = |text: &Text| [left, left + 12].contains(&text.x) && !is_elsewhere(text);
        let rows = lines_around(drawing.texts.iter().filter(|it| is_column(it)), y);
        for (index, text) in drawing.texts.iter().enumerate() {
            if (text.x - x).abs() < radius && (text.y - y).abs() < radius {
                circle.kind = match text.text.as_str() {
                    "H" => "history",
                    "H*" => "deep history",
                    _ => continue,
                };
            } else if is_column(text) && rows.contains(&text.y) {
                if text.class == "s" {
                    circle.remarks = format!("{} {}", circle.remarks, text.text);
                } else if circle.name.is_empty() {
                    circle.name.clone_from(&text.text);
                } else if text.x == left {
                    circle.lines.push(text.text.clone());
                } else if let Some(line) = circle.lines.last_mut() {
                    *line = format!("{line} {}", text.text);
                }
            } else {
                continue;
            }
            used[index] = true;
        }
        if circle.kind.is_empty() {
            return Err(format!("an empty circle at {x} {y}"));
        }
        all.push(circle);
    }
    Ok(all)
}

/// The texts beside vertical lines: label and remarks, by the line.
fn labels(drawing: &Drawing, used: &mut [bool]) -> BTreeMap<Line, (String, String)> {
    let mut all: BTreeMap<Line, (String, String)> = BTreeMap::new();
    let mut order: Vec<usize> = (0..drawing.texts.len()).filter(|it| !used[*it]).collect();
    order.sort_by_key(|it| (drawing.texts[*it].y, drawing.texts[*it].x));
    for index in order {
        let text = &drawing.texts[index];
        let is_beside = |line: &&Line| {
            line.x1 == line.x2
                && [6, 18].contains(&(text.x - line.x1))
                && line.y1 < text.y - 8
                && text.y < line.y2
        };
        let nearest = drawing.links.iter().filter(is_beside).min_by_key(|line| text.x - line.x1);
        if let Some(line) = nearest {
            used[index] = true;
            let (label, remarks) = all.entry(*line).or_default();
            let out = if text.class == "s" { remarks } else { label };
            *out = format!("{out} {}", text.text).trim().to_owned();
        }
    }
    all
}

/// An end of an arrow.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum End {
    Vertex(Vec<String>),
    /// The inner side of a state.
    Inner(Vec<String>),
    Bar(Line),
}

/// The middle and radius of a circle, with its full name.
type Named = ((i64, i64, i64), Vec<String>);

#[derive(Debug, Clone)]
struct Arrow {
    from: End,
    to: End,
    lines: Vec<Line>,
}

fn arrows(drawing: &Drawing, areas: &[Area], circles: &[Named]) -> Result<Vec<Arrow>, String> {
    let end = |(x, y): (i64, i64)| -> Result<End, String> {
        let mut found = BTreeSet::new();
        for (index, area) in areas.iter().enumerate().filter(|(_, area)| !area.is_region) {
            let rect = area.rect;
            if rect.x < x && x < rect.x + rect.w {
                if y == rect.y || y == rect.y + rect.h {
                    found.insert(End::Vertex(path(areas, Some(index))));
                } else if y == area.header {
                    found.insert(End::Inner(path(areas, Some(index))));
                }
            }
        }
        for ((cx, cy, radius), path) in circles {
            let square = (x - cx).pow(2) + (y - cy).pow(2);
            if ((radius - 1).pow(2)..=(radius + 1).pow(2)).contains(&square) {
                found.insert(End::Vertex(path.clone()));
            }
        }
        for bar in &drawing.bars {
            if bar.x1 <= x && x <= bar.x2 && (y - bar.y1).abs() == 2 {
                found.insert(End::Bar(*bar));
            }
        }
        let mut found = found.into_iter();
        match (found.next(), found.next()) {
            (Some(one), None) => Ok(one),
            other => Err(format!("a line ends at {x} {y}: {other:?}")),
        }
    };
    let mut rest: BTreeSet<Line> = drawing.links.iter().copied().collect();
    let mut all = Vec::new();
    for &tip in &drawing.tips {
        let mut at = tip;
        let mut lines = Vec::new();
        loop {
            let mut next =
                rest.iter().filter(|line| [(line.x1, line.y1), (line.x2, line.y2)].contains(&at));
            let (Some(&line), None) = (next.next(), next.next()) else { break };
            rest.remove(&line);
            at = if (line.x1, line.y1) == at { (line.x2, line.y2) } else { (line.x1, line.y1) };
            lines.push(line);
        }
        all.push(Arrow { from: end(at)?, to: end(tip)?, lines });
    }
    match rest.first() {
        Some(line) => Err(format!("{line:?} is no part of an arrow")),
        None => Ok(all),
    }
}

fn transitions(
    arrows: &[Arrow],
    labels: &BTreeMap<Line, (String, String)>,
    out: &mut Meaning,
) -> Result<(), String> {
    let label = |arrow: &Arrow| {
        let mut all = arrow.lines.iter().filter_map(|line| labels.get(line));
        all.next().cloned().unwrap_or_default()
    };
    let is_bar = |end: &End| matches!(end, End::Bar(_));
    let mut seen = BTreeSet::new();
    for arrow in arrows {
        // The arrows of a transition with bars: from sources to a bar, from it to a target or another bar, and on to targets.
        let begins = |bar: &End| {
            arrows.iter().filter(|it| it.to == *bar).map(|it| &it.from).collect::<Vec<_>>()
        };
        let leads = |bar: &End| {
            arrows.iter().filter(|it| it.from == *bar).map(|it| &it.to).collect::<Vec<_>>()
        };
        let is_middle = |arrow: &Arrow| {
            let from_one = !is_bar(&arrow.from) || begins(&arrow.from).len() > 1;
            let to_one = !is_bar(&arrow.to) || leads(&arrow.to).len() > 1;
            from_one && to_one
        };
        if !is_middle(arrow) {
            continue;
        }
        let sources = if is_bar(&arrow.from) { begins(&arrow.from) } else { vec![&arrow.from] };
        let targets = if is_bar(&arrow.to) { leads(&arrow.to) } else { vec![&arrow.to] };
        seen.extend(sources.iter().chain(&targets).copied());
        let names = |ends: &[&End]| -> Result<Vec<String>, String> {
            let mut all = Vec::new();
            for end in ends {
                match end {
                    End::Vertex(path) | End::Inner(path) => all.push(quoted(path)),
                    End::Bar(_) => return Err("bars in a row".to_owned()),
                }
            }
            all.sort_by_key(|it| it.replace('`', ""));
            Ok(all)
        };
        let internal = if matches!(arrow.from, End::Inner(_)) { " internal" } else { "" };
        let (text, remarks) = label(arrow);
        let (name, trigger, actions) = parts(&text)?;
        let (from, to) = (names(&sources)?.join(" & "), names(&targets)?.join(" & "));
        let text = format!("{name}{from} -> {to}{internal} {trigger} {remarks} {actions}");
        out.fact(canonical(&text)?);
    }
    Ok(())
}

fn quoted(path: &[String]) -> String {
    let names: Vec<String> = path.iter().map(|name| format!("`{name}`")).collect();
    names.join(".")
}

/// The name with a colon, the clauses of the trigger, and those of the actions.
fn parts(label: &str) -> Result<(String, String, String), String> {
    let mut rest = label.trim();
    let mut name = String::new();
    if let Some((first, after)) = rest.split_once(": ")
        && first.chars().all(|c| c.is_alphanumeric() || c == '_')
    {
        name = format!("{first}: ");
        rest = after;
    }
    let mut clauses = String::new();
    let start = rest.find('[').unwrap_or(usize::MAX);
    let slash = if rest.starts_with('/') { Some(0) } else { rest.find(" /") };
    let trigger_end = start.min(slash.unwrap_or(usize::MAX)).min(rest.len());
    let trigger = rest[..trigger_end].trim();
    if trigger.starts_with("after ") {
        let _ = write!(clauses, " {trigger}");
    } else if !trigger.is_empty() {
        let _ = write!(clauses, " on {trigger}");
    }
    rest = &rest[trigger_end..];
    if rest.starts_with('[') {
        let mut depth = 0;
        let end = rest.char_indices().find(|(_, c)| {
            depth += match c {
                '[' => 1,
                ']' => -1,
                _ => 0,
            };
            depth == 0
        });
        let end = end.ok_or("a guard without an end")?.0;
        let mut guard = rest[1..end].to_owned();
        if let Some(time) = guard.strip_prefix("after ") {
            let (time, more) = time.split_once(" and ").unwrap_or((time, ""));
            let _ = write!(clauses, " after {time}");
            guard = more.to_owned();
        }
        if !guard.is_empty() {
            let _ = write!(clauses, " when {guard}");
        }
        rest = &rest[end + 1..];
    }
    let rest = rest.trim();
    let actions = match rest.strip_prefix('/') {
        Some(list) => format!("do {{ {list} }}"),
        None if rest.is_empty() => String::new(),
        None => return Err(format!("not a label: {label}")),
    };
    Ok((name, clauses, actions))
}

/// An activity of a state, or a reaction.
fn activity(path: &[String], line: &str) -> Result<String, String> {
    let state = path.join("_");
    if let Some(text) = line.strip_prefix("do / ") {
        return canonical(&format!("state `{state}` {{ {text} }}"));
    }
    for word in ["entry", "exit"] {
        if let Some(list) = line.strip_prefix(word).and_then(|it| it.strip_prefix(" / ")) {
            return canonical(&format!("state `{state}` {{ {word} {{ {list} }} }}"));
        }
    }
    if let Some((task, list)) = line.strip_prefix("task ").and_then(|it| it.split_once(" / ")) {
        return canonical(&format!("state `{state}` {{ task {task} {{ {list} }} }}"));
    }
    if line.starts_with("code ") {
        return canonical(&format!("state `{state}` {{ {line} }}"));
    }
    let (name, trigger, actions) = parts(line)?;
    canonical(&format!("{name}in {} {trigger} {actions}", quoted(path)))
}

// ---- the comparison ----

fn difference(design: &Design, svg: &str) -> Option<String> {
    let is = match read(svg) {
        Ok(is) => is,
        Err(why) => return Some(why),
    };
    let must = meaning(&design.charts[0]);
    if is.states != must.states {
        let all = is.states.keys().chain(must.states.keys());
        let differs = |name: &&Vec<String>| is.states.get(*name) != must.states.get(*name);
        let name = { all }.find(differs)?;
        return Some(format!(
            "{name:?}: {:?}, not {:?}",
            is.states.get(name),
            must.states.get(name)
        ));
    }
    let mut all = is.activities.keys().chain(must.activities.keys());
    if let Some(name) = all.find(|name| is.activities.get(*name) != must.activities.get(*name)) {
        let (is, must) = (is.activities.get(name), must.activities.get(name));
        return Some(format!("activities of {name:?}: {is:?}, not {must:?}"));
    }
    let missing = must.facts.iter().find(|it| !is.facts.contains(it));
    let extra = is.facts.iter().find(|it| !must.facts.contains(it));
    (is.facts != must.facts).then(|| format!("missing {missing:?}\nextra {extra:?}"))
}

/// Boxes, texts or links that overlap, and links through texts or states.
fn flaws(svg: &str) -> Option<String> {
    let drawing = drawing(svg).expect("it is there");
    let mut rects = drawing.boxes.clone();
    let round = drawing.circles.iter().filter(|it| {
        !it.3 || !drawing.circles.iter().any(|other| (other.0, other.1) == (it.0, it.1) && !other.3)
    });
    let n_boxes = rects.len();
    rects.extend(round.map(|(x, y, r, _)| Rect { x: x - r, y: y - r, w: 2 * r, h: 2 * r }));
    for (index, one) in rects.iter().enumerate() {
        let is_fine =
            |other: &Rect| one.is_apart(other, 2) || encloses(one, other) || encloses(other, one);
        if let Some(other) = rects[..index].iter().find(|other| !is_fine(other)) {
            return Some(format!("boxes {one:?} {other:?}"));
        }
    }
    let is_near = |a: i64, b: i64| (a - b).abs() < 4;
    let overlap = |a: (i64, i64), b: (i64, i64)| a.0.max(b.0) < a.1.min(b.1);
    let links = &drawing.links;
    for (index, one) in links.iter().enumerate() {
        let is_same = |other: &&Line| {
            let columns = one.x1 == one.x2 && other.x1 == other.x2 && is_near(one.x1, other.x1);
            let rows = one.y1 == one.y2 && other.y1 == other.y2 && is_near(one.y1, other.y1);
            columns && overlap((one.y1, one.y2), (other.y1, other.y2))
                || rows && overlap((one.x1, one.x2), (other.x1, other.x2))
        };
        if let Some(other) = links[..index].iter().find(is_same) {
            return Some(format!("links {one:?} {other:?}"));
        }
        // Links meet circles inside of the rectangle around them.
        let is_through = |(index, rect): &(usize, &Rect)| {
            let inset = if *index < n_boxes { 4 } else { rect.w / 4 };
            let is_leaf = !rects.iter().any(|inner| encloses(rect, inner));
            let area = Rect {
                x: rect.x + inset,
                y: rect.y + inset,
                w: rect.w - 2 * inset,
                h: rect.h - 2 * inset,
            };
            let line = Rect { x: one.x1, y: one.y1, w: one.x2 - one.x1, h: one.y2 - one.y1 };
            is_leaf && !area.is_apart(&line, 0)
        };
        if let Some((_, rect)) = rects.iter().enumerate().find(is_through) {
            return Some(format!("{one:?} through {rect:?}"));
        }
    }
    // Names and activities of states that contain others are above the last line across them.
    for rect in &drawing.boxes {
        let edge = header_edge(&drawing, rect);
        let across = drawing.details.iter().filter(|it| {
            it.y1 == it.y2 && (it.x1, it.x2) == (rect.x, edge) && within(rect, (it.x1, it.y1))
        });
        let bottom = across.map(|it| it.y1).max().unwrap_or(rect.y);
        let name = (rect.x + 1, rect.y + 1, edge - 1, bottom - 1);
        let is_through = |it: &&Line| {
            it.x1 < name.2
                && name.0 < it.x2.max(it.x1 + 1)
                && it.y1 < name.3
                && name.1 < it.y2.max(it.y1 + 1)
        };
        if let Some(line) = links.iter().find(is_through) {
            return Some(format!("{line:?} through the name of {rect:?}"));
        }
    }
    let texts: Vec<Rect> = (drawing.texts.iter())
        .map(|text| Rect { x: text.x, y: text.y - 9, w: text.width, h: 11 })
        .collect();
    for (index, one) in texts.iter().enumerate() {
        if let Some(other) = texts[..index].iter().find(|other| !one.is_apart(other, 2)) {
            return Some(format!("texts {one:?} {other:?}"));
        }
        for line in links.iter().chain(&drawing.details).chain(&drawing.dashed) {
            let area = Rect { x: line.x1, y: line.y1, w: line.x2 - line.x1, h: line.y2 - line.y1 };
            if !one.is_apart(&area, 2) {
                return Some(format!("text {:?} {line:?}", drawing.texts[index]));
            }
        }
        let crosses = |rect: &&Rect| !(one.is_apart(rect, 2) || encloses(rect, one));
        if let Some(rect) = drawing.boxes.iter().find(crosses) {
            return Some(format!("text {:?} {rect:?}", drawing.texts[index]));
        }
    }
    None
}

fn drawn(design: &Design) -> String {
    svg(&layout(design, &Options::default()).expect("it is there"))
}

fn check(design: &Design, name: &str) {
    let svg = drawn(design);
    if let Some(why) = difference(design, &svg).or_else(|| flaws(&svg)) {
        panic!("{name}: {why}");
    }
}

/// The statecharts in the examples and cases, and those of the W3C.
fn all_charts() -> Vec<(String, Design)> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let mut folders: Vec<std::path::PathBuf> = vec![format!("{root}/tests/scxml/w3c").into()];
    for around in ["examples", "tests/cases"] {
        let all = std::fs::read_dir(format!("{root}/{around}")).expect("it is there");
        folders.extend(all.map(|folder| folder.expect("it is there").path()));
    }
    let mut files: Vec<std::path::PathBuf> = Vec::new();
    for folder in folders.iter().filter(|it| it.is_dir()) {
        let all = std::fs::read_dir(folder).expect("it is there");
        files.extend(all.map(|file| file.expect("it is there").path()));
    }
    files.sort();
    let mut charts = Vec::new();
    for file in files {
        let extension = file.extension().and_then(|it| it.to_str()).unwrap_or_default();
        // The examples of mistakes contain transitions without ends.
        if !["graf", "scxml"].contains(&extension)
            || file.components().any(|it| it.as_os_str() == "mistakes")
        {
            continue;
        }
        let text = std::fs::read_to_string(&file).expect("it is there");
        let (design, has_error) = if extension == "graf" {
            let parsed = graf::parse(FileId(0), &text);
            (parsed.design, parsed.diagnostics.iter().any(|it| it.is_error()))
        } else {
            let parsed = scxml::parse(FileId(0), &text);
            (parsed.design, parsed.diagnostics.iter().any(|it| it.is_error()))
        };
        let Some(design) = design.filter(|it| !has_error && it.charts.len() == 1) else { continue };
        if design.charts[0].items.iter().any(|it| matches!(it, Item::State(_))) {
            charts.push((file.display().to_string(), design));
        }
    }
    charts
}

#[test]
fn the_drawings_of_statecharts_are_these_charts() {
    let charts = all_charts();
    assert!(charts.len() > 30, "{}", charts.len());
    charts.iter().for_each(|(name, design)| check(design, name));
}

#[test]
fn the_drawings_of_random_statecharts_are_these_charts() {
    for seed in 0..crate::read_back::rounds(40, 2_000) {
        let text = random(seed);
        check(&crate::read_back::parsed(&text), &format!("{seed}\n{text}"));
    }
}

/// A drawing with a shape or a text missing, with two texts exchanged, or with an arrow to another state is not the drawing of the chart.
#[test]
fn spoiled_drawings_of_statecharts_are_noticed() {
    let mut counts = [0; 3];
    let mut charts = all_charts();
    charts.extend(
        (0..crate::read_back::rounds(6, 60))
            .map(|seed| ("random".to_owned(), crate::read_back::parsed(&random(seed)))),
    );
    for (name, design) in charts {
        let svg = drawn(&design);
        let lines: Vec<&str> = svg.lines().collect();
        let harms = [missing(&lines), exchanged(&lines), other_ends(&lines)];
        for (harms, count) in harms.iter().zip(&mut counts) {
            let every = usize::try_from(crate::read_back::rounds(23, 13)).expect("it is small");
            for changes in harms.iter().skip(svg.len() % every).step_by(every) {
                let mut other = lines.clone();
                changes.iter().for_each(|(index, line)| other[*index] = line);
                let why = difference(&design, &other.join("\n"));
                assert!(why.is_some(), "{name}: not noticed: {changes:?}");
                *count += 1;
            }
        }
    }
    println!("{counts:?} missing, exchanged, with other ends");
    assert!(counts.iter().all(|n| *n > 10), "{counts:?}");
}

/// Lines of a file with their new text.
type Changes = Vec<(usize, String)>;

fn missing(lines: &[&str]) -> Vec<Changes> {
    let kinds = [
        "<line class=\"l\"",
        "<line class=\"r\"",
        "<path class=\"a\"",
        "<rect class=\"u\"",
        "<circle",
    ];
    let is_shape = |line: &str| kinds.iter().any(|kind| line.starts_with(kind));
    let shapes = (0..lines.len()).filter(|index| is_shape(lines[*index]));
    let texts = texts(lines).into_iter().map(|(index, ..)| index);
    shapes.chain(texts).map(|index| vec![(index, String::new())]).collect()
}

/// The texts in and at states: the number of the line, the attributes, and the text with the end of the element.
fn texts<'s>(lines: &[&'s str]) -> Vec<(usize, &'s str, &'s str)> {
    let drawing = drawing(&lines.join("\n")).expect("it is there");
    let top = drawing.texts.iter().map(|text| text.y).min().unwrap_or(0);
    let texts = lines.iter().enumerate().filter_map(|(index, line)| {
        let (place, text) = line.strip_prefix("<text")?.split_once('>')?;
        let y: i64 = place.split_once(" y=\"")?.1.split('"').next()?.parse().ok()?;
        (y >= top).then_some((index, place, text))
    });
    texts.collect()
}

/// Texts exchanged with a later one; the places keep their widths.
fn exchanged(lines: &[&str]) -> Vec<Changes> {
    let texts = texts(lines);
    let mut all = Vec::new();
    for (at, (index, place, text)) in texts.iter().enumerate() {
        let mut others = texts.iter().skip(at + 1 + at % 7).filter(|it| it.2 != *text);
        if let Some((other, other_place, other_text)) = others.next() {
            all.push(vec![
                (*index, format!("<text{place}>{other_text}")),
                (*other, format!("<text{other_place}>{text}")),
            ]);
        }
    }
    all
}

/// Arrows that end at the upper side of another state.
fn other_ends(lines: &[&str]) -> Vec<Changes> {
    let drawing = drawing(&lines.join("\n")).expect("it is there");
    let mut all = Vec::new();
    for (at, (x, y)) in drawing.tips.iter().enumerate() {
        let here = |rect: &&Rect| {
            rect.x < *x && *x < rect.x + rect.w && [rect.y, rect.y + rect.h].contains(y)
        };
        let Some(own) = drawing.boxes.iter().find(here) else { continue };
        let Some(rect) =
            drawing.boxes.iter().cycle().skip(at).take(drawing.boxes.len()).find(|it| *it != own)
        else {
            continue;
        };
        let (new_x, new_y) = (rect.x + rect.w / 2, rect.y);
        let mut changes = Vec::new();
        for (index, line) in lines.iter().enumerate() {
            let tip = format!("d=\"M{x} {y}l");
            if line.contains(&tip) {
                changes.push((index, line.replace(&tip, &format!("d=\"M{new_x} {new_y}l"))));
            }
            for end in ["1", "2"] {
                let old = format!("x{end}=\"{x}\" y{end}=\"{y}\"");
                if line.starts_with("<line class=\"l\"") && line.contains(&old) {
                    let new = format!("x{end}=\"{new_x}\" y{end}=\"{new_y}\"");
                    changes.push((index, line.replace(&old, &new)));
                }
            }
        }
        all.push(changes);
    }
    all
}

// ---- random statecharts ----

struct Random {
    state: u64,
    n_names: usize,
    paths: Vec<String>,
    text: String,
}

fn random(seed: u64) -> String {
    let state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut random = Random { state, n_names: 0, paths: Vec::new(), text: String::new() };
    random.text.push_str("chart random { conflict inner-first\n event go, stop, a_long_name_of_an_event\n input a, b\n output X, Y\n var n: int 0..9\n");
    random.children(0, seed.is_multiple_of(2));
    let n_transitions = 2 + random.below(2 * random.paths.len());
    for _ in 0..n_transitions {
        random.transition();
    }
    random.text.push_str("}\n");
    random.text
}

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        (self.state >> 20) as usize % n.max(1)
    }

    fn children(&mut self, depth: usize, with_final: bool) {
        for _ in 0..=self.below(3) {
            self.state(depth);
        }
        if with_final {
            let name = self.name();
            let _ = writeln!(self.text, "final state {name}");
        }
    }

    fn name(&mut self) -> String {
        self.n_names += 1;
        let name = match self.below(9) {
            0 => format!("a_state_with_a_very_long_name_{}", self.n_names),
            1 => format!("`<b>\u{65e5}\u{672c} & {}</b>`", self.n_names),
            2 => format!("`state {} of it`", self.n_names),
            _ => format!("s{}", self.n_names),
        };
        self.paths.push(name.clone());
        name
    }

    fn state(&mut self, depth: usize) {
        let name = self.name();
        let is_parallel = depth < 3 && self.below(5) == 0;
        let label = match self.below(12) {
            0 => " \"a comment\"",
            1 => " \"says \\\"go\\\" & <waits>, then \\\\\"",
            _ => "",
        };
        let word = if is_parallel { "parallel" } else { "state" };
        let _ = writeln!(self.text, "{word} {name}{label} {{");
        for _ in 0..self.below(3) {
            let line = match self.below(8) {
                0 => "entry { n := n + 1 }",
                4 => "task `the work` cost 80 { n := 2; n := n + 1 }",
                5 => "budget 200",
                6 => "code c \"if (x < 3 && y) PORTB |= 1;\"",
                1 => "exit { n := 0; n := n + 2 }",
                2 => "X if a and not b",
                3 => "on go when a { n := 3 }",
                _ => "Y",
            };
            let _ = writeln!(self.text, "{line}");
        }
        if is_parallel {
            for _ in 0..2 + self.below(2) {
                let name = self.name();
                let _ = writeln!(self.text, "region {name} {{");
                if self.below(5) > 0 {
                    self.children(depth + 1, false);
                }
                self.text.push_str("}\n");
            }
        } else if depth < 3 && self.below(3) == 0 {
            let with_final = self.below(2) == 0;
            self.children(depth + 1, with_final);
        }
        if self.below(4) == 0 && self.text.ends_with("}\n") {
            let deep = if self.below(2) == 0 { "deep " } else { "" };
            let name = self.name();
            let _ = writeln!(self.text, "history {deep}{name}");
        }
        self.text.push_str("}\n");
    }

    fn transition(&mut self) {
        let n = self.paths.len();
        let (from, to) = (self.below(n), self.below(n));
        let (from, to) = (self.paths[from].clone(), self.paths[to].clone());
        let more = if self.below(8) == 0 {
            let other = self.below(n);
            format!(" & {}", self.paths[other])
        } else {
            String::new()
        };
        let more = if more == format!(" & {to}") { String::new() } else { more };
        let internal = if self.below(6) == 0 { " internal" } else { "" };
        let rest = match self.below(8) {
            0 => "after 3 s",
            1 => "on go when a and not b do { n := n + 1 }",
            2 => "when n > 3",
            3 => {
                "on a_long_name_of_an_event when a or b and n > 3 do { n := 3; n := n + 2; raise go }"
            }
            4 => "on go after 2 s \"a comment\"",
            5 => "on go, stop priority 2",
            6 => "",
            _ => "on stop",
        };
        let _ = writeln!(self.text, "{from} -> {to}{more}{internal} {rest}");
    }
}
