//! The inside of one state: cells in layers, links between them, and the lines that result.

use crate::layers::{self, GAP, PITCH, Span};
use crate::picture::{Pen, Picture, Shape, Way};
use crate::routes::{Ends, Part, Plan, Side, crossed};
use crate::states::{Kind, Tree};
use crate::tracks::{self, Joint, Wire};
use crate::vertex::{self, Header, Look};
use grafsynth_ir::Gather;
use std::collections::{BTreeMap, BTreeSet};

/// The distance between tracks.
const TRACK: i64 = 10;
/// The distance of the first track from the layer above it.
const ABOVE: i64 = 14;
/// The distance of the last track from the layer below it, with room for an arrowhead.
const BELOW: i64 = 18;
/// The distance of the last layer from the border.
const BOTTOM: i64 = 14;

/// The width up to which a state is widened for the labels of its transitions.
const WIDENED: i64 = 208;

/// A vertical or horizontal part of a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Piece {
    pub(crate) edge: usize,
    /// The left or upper end.
    pub(crate) from: (i64, i64),
    pub(crate) to: (i64, i64),
}

/// The inside of a state, relative to its upper left corner.
#[derive(Debug, Clone, Default)]
pub(crate) struct Inside {
    pub(crate) width: i64,
    pub(crate) height: i64,
    /// The size of the part with name and activities, if there is one.
    pub(crate) header: Option<Header>,
    /// The columns in which transitions cross the border: by transition, and whether it begins inside.
    pub(crate) ports: BTreeMap<(usize, bool), (Side, i64)>,
    pub(crate) picture: Picture,
    pub(crate) pieces: Vec<Piece>,
    /// Arrowheads: the transition, the tip, and where it points.
    pub(crate) arrows: Vec<(usize, (i64, i64), Way)>,
}

#[derive(Debug, Clone)]
enum What {
    /// The name and activities of the container.
    Header,
    Vertex(usize),
    /// The label of a transition.
    Label(usize),
    /// A link that passes through the layer, perhaps to the border.
    Lane,
}

#[derive(Debug, Clone)]
struct Cell {
    what: What,
    look: Look,
    layer: usize,
    x: i64,
    y: i64,
}

/// An end of a link at a cell. `own` says whether it is the source (true) or target (false) of the transition, if it is one.
#[derive(Debug, Clone, Copy)]
struct End {
    cell: usize,
    side: Side,
    own: Option<bool>,
}

/// A link between neighbouring layers, or between two cells of a layer around their lower sides.
#[derive(Debug, Clone, Copy)]
struct Link {
    edge: usize,
    ends: [End; 2],
    columns: [i64; 2],
}

/// A free end of a link, and the column that makes the link straight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Wish {
    x: i64,
    link: usize,
    place: usize,
}

struct Builder<'a> {
    tree: &'a Tree,
    container: usize,
    plan: &'a Plan,
    insides: &'a mut BTreeMap<usize, Inside>,
    cells: Vec<Cell>,
    of_vertex: BTreeMap<usize, usize>,
    layers: Vec<Vec<usize>>,
    /// True for layers that contain anything besides lanes.
    is_used: Vec<bool>,
    links: Vec<Link>,
    /// The cells at the border, with the transition and its direction.
    borders: Vec<(usize, usize, Side, bool)>,
}

/// Lays out a container whose inner containers are laid out already.
pub(crate) fn lay_out(
    tree: &Tree,
    container: usize,
    plan: &Plan,
    insides: &mut BTreeMap<usize, Inside>,
) -> Inside {
    let last_row = plan.rows.values().copied().max().unwrap_or(0);
    let mut builder = Builder {
        tree,
        container,
        plan,
        insides,
        cells: Vec::new(),
        of_vertex: BTreeMap::new(),
        layers: vec![Vec::new(); 2 * last_row + 5],
        is_used: vec![false; 2 * last_row + 5],
        links: Vec::new(),
        borders: Vec::new(),
    };
    builder.add_cells();
    builder.find_used_layers();
    plan.parts.iter().for_each(|part| builder.add_part(part));
    builder.widen();
    builder.place();
    builder.draw()
}

impl Builder<'_> {
    fn add(&mut self, what: What, look: Look, layer: usize) -> usize {
        let own = self.cells.len();
        self.cells.push(Cell { what, look, layer, x: 0, y: 0 });
        self.layers[layer].push(own);
        own
    }

    fn lane(&mut self, layer: usize) -> usize {
        let look = Look { width: 2 * PITCH, axis: Some(PITCH), ..Look::default() };
        self.add(What::Lane, look, layer)
    }

    fn add_cells(&mut self) {
        let vertex = &self.tree.vertices[self.container];
        let is_named_region = vertex.kind == Kind::Region && !vertex.name.is_empty();
        if vertex.kind == Kind::State || is_named_region {
            self.add(What::Header, vertex::header(vertex), 0);
        }
        let mut n_links: BTreeMap<(usize, Side), i64> = BTreeMap::new();
        for part in &self.plan.parts {
            for (child, side, _) in crossed(&self.plan.rows, part.ends) {
                *n_links.entry((child, side)).or_default() += 1;
            }
        }
        for &child in &vertex.children {
            let sides = [Side::Top, Side::Bottom];
            let most = sides.map(|side| n_links.get(&(child, side)).copied().unwrap_or(0));
            let inside = self.insides.get(&child).map(|it| (it.width, it.height));
            let look = vertex::look(&self.tree.vertices[child], inside, most[0].max(most[1]));
            let row = self.plan.rows.get(&child).copied().unwrap_or(0);
            let cell = self.add(What::Vertex(child), look, 2 * row + 2);
            self.of_vertex.insert(child, cell);
        }
    }

    /// Finds the layers that have states, labels, turns or links to the border.
    fn find_used_layers(&mut self) {
        for (index, layer) in self.layers.iter().enumerate() {
            self.is_used[index] = !layer.is_empty();
        }
        let last = self.layers.len() - 1;
        for part in &self.plan.parts {
            let layer = match part.ends {
                Ends::Children(from, to) => {
                    let (first, second) = (self.layer_of(from), self.layer_of(to));
                    if first != second && vertex::label(&self.tree.edges[part.edge]).is_none() {
                        continue;
                    }
                    if first <= second { first + 1 } else { first - 1 }
                }
                Ends::Local(_) => 1,
                Ends::Border(_, Side::Top, _) => 0,
                Ends::Border(_, Side::Bottom, _) => last,
            };
            self.is_used[layer] = true;
        }
    }

    fn layer_of(&self, vertex: usize) -> usize {
        self.cells[self.of_vertex[&vertex]].layer
    }

    /// Adds the links of a transition, with lanes in the layers that it passes.
    fn add_part(&mut self, part: &Part) {
        let last = self.layers.len() - 1;
        match part.ends {
            Ends::Children(from, to) => {
                let (from, to) = (self.of_vertex[&from], self.of_vertex[&to]);
                let (first, second) = (self.cells[from].layer, self.cells[to].layer);
                if first == second {
                    self.add_turn(part.edge, from, to);
                } else if first < second {
                    self.chain(part.edge, (from, Some(true)), (to, Some(false)), Some(first + 1));
                } else {
                    self.chain(part.edge, (to, Some(false)), (from, Some(true)), Some(first - 1));
                }
            }
            Ends::Local(child) => {
                let child = self.of_vertex[&child];
                self.chain(part.edge, (0, Some(true)), (child, Some(false)), Some(1));
            }
            Ends::Border(child, side, is_from) => {
                let child = (self.of_vertex[&child], Some(is_from));
                let border = self.lane(if side == Side::Top { 0 } else { last });
                self.borders.push((border, part.edge, side, is_from));
                match side {
                    Side::Top => self.chain(part.edge, (border, None), child, None),
                    Side::Bottom => self.chain(part.edge, child, (border, None), None),
                }
            }
        }
    }

    /// The cell with the label of a transition, or a lane if it has none.
    fn label(&mut self, edge: usize, layer: usize) -> usize {
        match vertex::label(&self.tree.edges[edge]) {
            Some(look) => self.add(What::Label(edge), look, layer),
            None => self.lane(layer),
        }
    }

    fn chain(
        &mut self,
        edge: usize,
        upper: (usize, Option<bool>),
        lower: (usize, Option<bool>),
        label: Option<usize>,
    ) {
        let mut above = upper;
        let layers = self.cells[upper.0].layer + 1..self.cells[lower.0].layer;
        let used: Vec<usize> = layers.filter(|layer| self.is_used[*layer]).collect();
        for layer in used {
            let next =
                if label == Some(layer) { self.label(edge, layer) } else { self.lane(layer) };
            self.link(edge, (above, Side::Bottom), ((next, None), Side::Top));
            above = (next, None);
        }
        self.link(edge, (above, Side::Bottom), (lower, Side::Top));
    }

    /// A link from the lower side of a cell to the lower side of the same or another cell of the layer.
    fn add_turn(&mut self, edge: usize, from: usize, to: usize) {
        let layer = self.cells[from].layer + 1;
        let (label, lane) = (self.label(edge, layer), self.lane(layer));
        self.link(edge, ((from, Some(true)), Side::Bottom), ((label, None), Side::Top));
        self.link(edge, ((label, None), Side::Bottom), ((lane, None), Side::Bottom));
        self.link(edge, ((to, Some(false)), Side::Bottom), ((lane, None), Side::Top));
    }

    fn link(
        &mut self,
        edge: usize,
        (first, first_side): ((usize, Option<bool>), Side),
        (second, second_side): ((usize, Option<bool>), Side),
    ) {
        let end = |(cell, own), side| End { cell, side, own };
        let ends = [end(first, first_side), end(second, second_side)];
        self.links.push(Link { edge, ends, columns: [0; 2] });
    }

    /// The column of an end from the left side of its cell, if it is fixed.
    fn fixed(&self, edge: usize, end: End) -> Option<i64> {
        let cell = &self.cells[end.cell];
        if let (What::Vertex(vertex), Some(is_from)) = (&cell.what, end.own)
            && let Some(inside) = self.insides.get(vertex)
            && let Some((_, port)) = inside.ports.get(&(edge, is_from))
        {
            return Some(*port);
        }
        cell.look.axis
    }

    /// Makes cells wide enough for their links, and states a little wider if their links are straight then.
    fn widen(&mut self) {
        let mut needs: BTreeMap<(usize, Side), (i64, i64, i64)> = BTreeMap::new();
        for link in &self.links {
            for (end, other) in link.ends.into_iter().zip(link.ends.into_iter().rev()) {
                let width = self.cells[other.cell].look.width + GAP;
                let (n_links, sum, last) = needs.entry((end.cell, end.side)).or_default();
                (*n_links, *sum, *last) = (*n_links + 1, *sum + width, width);
            }
        }
        for ((cell, _), (n_links, sum, last)) in needs {
            let is_vertex = matches!(self.cells[cell].what, What::Vertex(_));
            let look = &mut self.cells[cell].look;
            if look.axis.is_none() && look.radius.is_none() {
                look.width = look.width.max(2 * PITCH * (n_links + 1));
                if is_vertex {
                    look.width = look.width.max((sum - last + 4 * PITCH).min(WIDENED));
                }
            }
        }
        // Everything has an even number of pitches.
        for cell in &mut self.cells {
            cell.look.width = (cell.look.width + 2 * PITCH - 1) / (2 * PITCH) * (2 * PITCH);
            if cell.look.reach == 0 {
                cell.look.reach = cell.look.width;
            }
        }
    }

    /// Removes empty layers, orders the others, and sets all columns.
    fn place(&mut self) {
        self.layers.retain(|layer| !layer.is_empty());
        for (index, layer) in self.layers.iter().enumerate() {
            layer.iter().for_each(|cell| self.cells[*cell].layer = index);
        }
        let regions = &self.tree.vertices[self.container].children;
        let mut cells: Vec<layers::Cell> = Vec::new();
        for cell in &self.cells {
            let fixed = match cell.what {
                What::Header => Some(0),
                What::Vertex(vertex) if self.tree.vertices[vertex].kind == Kind::Region => {
                    regions.iter().position(|it| *it == vertex)
                }
                _ => None,
            };
            let is_link = matches!(cell.what, What::Label(_) | What::Lane);
            cells.push(layers::Cell { width: cell.look.width, x: 0, fixed, after: None, is_link });
        }
        for turn in self.links.windows(3).filter(|turn| turn[1].ends[1].side == Side::Bottom) {
            if turn[0].ends[0].cell == turn[2].ends[0].cell {
                let [label, lane] = turn[1].ends;
                cells[lane.cell].after = Some(label.cell);
            }
        }
        let mut spans = Vec::new();
        for (index, link) in self.links.iter().enumerate() {
            let [upper, lower] = link.ends;
            if lower.side == Side::Bottom {
                continue;
            }
            let both = [upper, lower].map(|end| matches!(self.cells[end.cell].what, What::Lane));
            let beside = self.beside(index);
            let fixed = self.fixed(link.edge, upper);
            let is_turn_at_port = fixed.is_some() && self.other_of_turn(index).is_some();
            spans.push(Span {
                upper: (upper.cell, fixed.or(beside).unwrap_or(self.middle(upper.cell))),
                lower: (
                    lower.cell,
                    self.fixed(link.edge, lower).unwrap_or(self.middle(lower.cell)),
                ),
                weight: if both == [true, true] || is_turn_at_port { 4 } else { 1 },
            });
        }
        layers::place(&mut cells, &mut self.layers, &spans);
        let left = cells.iter().map(|cell| cell.x).min().unwrap_or(0);
        let is_nested = self.container != 0;
        for (cell, placed) in self.cells.iter_mut().zip(&cells) {
            cell.x = placed.x - left + if is_nested { 2 * PITCH } else { 0 };
            if matches!(cell.what, What::Header) {
                cell.x = 2 * PITCH;
            }
        }
        self.set_columns();
    }

    /// Of the two links of a turn that lead down from cells, the other one.
    fn other_of_turn(&self, index: usize) -> Option<&Link> {
        let is_turn = |middle: usize| {
            self.links.get(middle).is_some_and(|link| link.ends[1].side == Side::Bottom)
        };
        match index.checked_sub(1) {
            Some(before) if is_turn(before) => self.links.get(index.checked_sub(2)?),
            _ if is_turn(index + 1) => self.links.get(index + 2),
            _ => None,
        }
    }

    /// The column for the free end of a turn from a cell to itself whose other end is fixed: the label is to the left of the lane.
    fn beside(&self, index: usize) -> Option<i64> {
        let (own, other) = (&self.links[index], self.other_of_turn(index)?);
        let column = self.fixed(other.edge, other.ends[0])?;
        let is_to = own.ends[0].own == Some(false);
        let is_same = own.ends[0].cell == other.ends[0].cell;
        is_same.then_some(if is_to { column + PITCH } else { column - PITCH })
    }

    fn middle(&self, cell: usize) -> i64 {
        self.cells[cell].look.reach / 2 / PITCH * PITCH
    }

    /// Sets the columns of all ends: those that are fixed, and then each free end as near as possible to the other end of its link.
    fn set_columns(&mut self) {
        let mut used: BTreeMap<(usize, Side), BTreeSet<i64>> = BTreeMap::new();
        let mut free: BTreeMap<(usize, Side), Vec<Wish>> = BTreeMap::new();
        for index in 0..self.links.len() {
            let Link { edge, ends, .. } = self.links[index];
            for (place, end) in ends.into_iter().enumerate() {
                let other = ends[1 - place];
                let column = |end: End, offset| self.cells[end.cell].x + offset;
                match self.fixed(edge, end) {
                    Some(offset) => {
                        let x = column(end, offset);
                        used.entry((end.cell, end.side)).or_default().insert(x);
                        self.links[index].columns[place] = x;
                    }
                    None => {
                        let offset = self.fixed(edge, other).unwrap_or(self.middle(other.cell));
                        let wish = Wish { x: column(other, offset), link: index, place };
                        free.entry((end.cell, end.side)).or_default().push(wish);
                    }
                }
            }
        }
        for ((cell, side), mut wishes) in free {
            let (left, width) = (self.cells[cell].x, self.cells[cell].look.reach);
            // Links meet a circle at every second pitch.
            let step: i64 = if self.cells[cell].look.radius.is_some() { 2 } else { 1 };
            let middle = left + width / 2;
            let used = used.entry((cell, side)).or_default();
            // A link that is alone on its side of a circle is in the middle.
            if step == 2 && used.is_empty() && wishes.len() == 1 {
                self.links[wishes[0].link].columns[wishes[0].place] = middle;
                continue;
            }
            // From the corners to the middle, so that the outermost links are at the corners.
            wishes.sort_unstable();
            let n_left = wishes.iter().filter(|wish| wish.x < middle).count();
            let right = wishes.split_off(n_left);
            for Wish { x: wish, link, place } in wishes.into_iter().chain(right.into_iter().rev()) {
                let slots =
                    (step..width / PITCH).filter(|n| n % step == 0).map(|n| left + n * PITCH);
                let is_free =
                    |x: &i64| used.range(x - 2 * PITCH + 1..x + 2 * PITCH).next().is_none();
                let best = { slots }.filter(is_free).min_by_key(|x| ((x - wish).abs(), *x));
                // There is always room for links at every second slot; after unlucky choices, for closer ones.
                let slots = (1..width / PITCH).map(|n| left + n * PITCH);
                let x = best.or_else(|| { slots }.find(|x| !used.contains(x))).unwrap_or(middle);
                used.insert(x);
                self.links[link].columns[place] = x;
            }
        }
    }

    /// The row of the end of a link at a cell.
    fn row(&self, end: End, x: i64) -> i64 {
        let Cell { look, x: left, y, .. } = &self.cells[end.cell];
        let half = match look.radius {
            Some(radius) => {
                let off = x - left - look.reach / 2;
                (radius * radius - off * off).max(0).isqrt()
            }
            None => return if end.side == Side::Top { *y } else { y + look.height },
        };
        let middle = y + look.height / 2;
        if end.side == Side::Top { middle - half } else { middle + half }
    }

    /// Sets the rows and draws everything.
    fn draw(mut self) -> Inside {
        let mut wires: Vec<Vec<Wire>> = vec![Vec::new(); self.layers.len()];
        for (index, link) in self.links.iter().enumerate() {
            let [first, second] = link.columns;
            let wire = |ups, downs| Wire { ups, downs, joint: None, owner: index };
            if link.ends[1].side == Side::Bottom {
                wires[self.cells[link.ends[0].cell].layer].push(wire(vec![first, second], vec![]));
            } else if first != second {
                wires[self.cells[link.ends[0].cell].layer].push(wire(vec![first], vec![second]));
            }
        }
        let tracks: Vec<Vec<(Wire, i64)>> =
            wires.into_iter().map(|wires| tracks::assign(wires, PITCH)).collect();
        let uppers = self.links.iter().filter(|link| link.ends[0].side == Side::Bottom);
        let has_links: BTreeSet<usize> = uppers.map(|link| link.ends[0].cell).gather();
        let mut inside = Inside::default();
        let mut y = 0;
        let mut bottoms = Vec::new();
        for (layer, tracks) in self.layers.iter().zip(&tracks) {
            let high = layer.iter().map(|cell| self.cells[*cell].look.height).max().unwrap_or(0);
            for &cell in layer {
                let cell = &mut self.cells[cell];
                let is_top = match cell.what {
                    What::Vertex(vertex) => self.tree.vertices[vertex].kind == Kind::Region,
                    _ => true,
                };
                if matches!(cell.what, What::Label(_) | What::Lane) {
                    cell.look.height = high;
                }
                cell.y = if is_top { y } else { y + (high - cell.look.height) / 2 };
            }
            y += high;
            bottoms.push(y);
            let n_tracks = tracks.iter().map(|(_, track)| track + 1).max().unwrap_or(0);
            y += if n_tracks > 0 {
                ABOVE + (n_tracks - 1) * TRACK + BELOW
            } else if layer.iter().any(|cell| has_links.contains(cell)) {
                ABOVE + BELOW / 2
            } else {
                BOTTOM / 2
            };
        }
        // Below the last layer there may be turns.
        inside.height = y.max(bottoms.last().copied().unwrap_or(0) + BOTTOM);
        self.draw_links(&mut inside, &tracks, &bottoms);
        self.draw_cells(&mut inside);
        let from_pieces = inside.pieces.iter().map(|piece| piece.to.0);
        let from_cells = self.cells.iter().map(|cell| cell.x + cell.look.width);
        inside.width = from_pieces.chain(from_cells).max().unwrap_or(0) + 2 * PITCH;
        self.draw_separators(&mut inside);
        inside
    }

    fn draw_links(&self, inside: &mut Inside, tracks: &[Vec<(Wire, i64)>], bottoms: &[i64]) {
        let mut draw = |edge, a: (i64, i64), b: (i64, i64)| {
            inside.pieces.push(Piece { edge, from: a.min(b), to: a.max(b) });
        };
        for link in &self.links {
            for (end, x) in link.ends.into_iter().zip(link.columns) {
                let cell = &self.cells[end.cell];
                let is_target = matches!(cell.what, What::Vertex(vertex) if vertex == self.tree.edges[link.edge].to);
                if is_target && end.own == Some(false) {
                    let way = if end.side == Side::Top { Way::Down } else { Way::Up };
                    inside.arrows.push((link.edge, (x, self.row(end, x)), way));
                }
            }
            let [first, second] = link.columns;
            let [upper, lower] = link.ends;
            if link.ends[1].side == Side::Top && first == second {
                draw(link.edge, (first, self.row(upper, first)), (second, self.row(lower, second)));
            }
            let lower = &self.cells[lower.cell];
            // Lanes and labels are passed in their whole height.
            if matches!(lower.what, What::Label(_) | What::Lane) && link.ends[1].side == Side::Top {
                draw(link.edge, (second, lower.y), (second, lower.y + lower.look.height));
            }
        }
        for (border, edge, side, _) in &self.borders {
            let cell = &self.cells[*border];
            let x = cell.x + PITCH;
            match side {
                Side::Top => draw(*edge, (x, 0), (x, cell.y + cell.look.height)),
                Side::Bottom => draw(*edge, (x, cell.y), (x, inside.height)),
            }
        }
        for (tracks, bottom) in tracks.iter().zip(bottoms) {
            let row = |track: i64| bottom + ABOVE + track * TRACK;
            for (wire, track) in tracks {
                let link = &self.links[wire.owner];
                let y = row(*track);
                let mut columns = [&wire.ups[..], &wire.downs].concat();
                columns.extend(wire.joint.map(Joint::x));
                if let (Some(low), Some(high)) = (columns.iter().min(), columns.iter().max()) {
                    draw(link.edge, (*low, y), (*high, y));
                }
                for (end, x) in link.ends.into_iter().zip(link.columns) {
                    let is_here = match end.side {
                        Side::Bottom => wire.ups.contains(&x),
                        Side::Top => wire.downs.contains(&x),
                    };
                    if is_here {
                        draw(link.edge, (x, self.row(end, x)), (x, y));
                    }
                }
                if let Some(Joint::Above(x)) = wire.joint {
                    let upper = tracks.iter().find(|(it, _)| it.joint == Some(Joint::Below(x)));
                    upper.iter().for_each(|(_, above)| draw(link.edge, (x, row(*above)), (x, y)));
                }
            }
        }
    }

    fn draw_cells(&mut self, inside: &mut Inside) {
        for cell in &self.cells {
            let mut look = cell.look.clone();
            let element = match cell.what {
                What::Vertex(vertex) => self.tree.vertices[vertex].element.as_ref(),
                What::Header => self.tree.vertices[self.container].element.as_ref(),
                What::Label(edge) => self.tree.edges[edge].element.as_ref(),
                What::Lane => None,
            };
            if let What::Vertex(vertex) = cell.what {
                let own = &self.tree.vertices[vertex];
                let within = self.insides.remove(&vertex);
                let header = within.as_ref().map(|it| it.header.unwrap_or_default());
                vertex::finish(own, &mut look, header);
                let picture = &mut look.picture;
                picture.marks.iter_mut().for_each(|mark| mark.element = element.cloned());
                if let Some(mut within) = within {
                    picture.marks.append(&mut within.picture.marks);
                    let moved = |(x, y): (i64, i64)| (x + cell.x, y + cell.y);
                    inside.pieces.extend(within.pieces.iter().map(|piece| Piece {
                        edge: piece.edge,
                        from: moved(piece.from),
                        to: moved(piece.to),
                    }));
                    let arrows = within.arrows.iter();
                    inside.arrows.extend(arrows.map(|(edge, tip, way)| (*edge, moved(*tip), *way)));
                }
            } else {
                look.picture.marks.iter_mut().for_each(|mark| mark.element = element.cloned());
            }
            if matches!(cell.what, What::Header) {
                let is_crossed = self.borders.iter().any(|(.., side, _)| *side == Side::Top);
                let end = cell.x + cell.look.width + GAP / 2;
                let width = is_crossed.then_some(end);
                inside.header = Some(Header { height: cell.look.height, width });
            }
            inside.picture.put(look.picture, cell.x, cell.y);
        }
        for (border, edge, side, is_from) in &self.borders {
            let x = self.cells[*border].x + PITCH;
            inside.ports.insert((*edge, *is_from), (*side, x));
        }
    }

    /// Draws dashed lines between the regions of a parallel state, to its border if nothing is in the way.
    fn draw_separators(&self, inside: &mut Inside) {
        let is_region = |cell: &usize| matches!(self.cells[*cell].what, What::Vertex(vertex) if self.tree.vertices[vertex].kind == Kind::Region);
        let Some(layer) = self.layers.iter().position(|layer| layer.iter().any(is_region)) else {
            return;
        };
        // Links may pass between the regions.
        let regions: Vec<&usize> = self.layers[layer].iter().filter(|it| is_region(it)).collect();
        let bottoms =
            regions.iter().map(|cell| self.cells[**cell].y + self.cells[**cell].look.height);
        let bottom = bottoms.max().unwrap_or(0);
        let is_last = layer + 1 == self.layers.len();
        let top = regions.iter().map(|cell| self.cells[**cell].y).min().unwrap_or(0);
        let top = if layer <= 1 { inside.header.map_or(0, |it| it.height) } else { top };
        for pair in regions.windows(2) {
            if let [left, right] = pair {
                let end = self.cells[**left].x + self.cells[**left].look.width;
                // Never in a column of links.
                let x = (end + self.cells[**right].x) / 2 / PITCH * PITCH + PITCH / 2;
                let to = (x, if is_last { inside.height } else { bottom });
                inside.picture.add(Shape::Line { from: (x, top), to, pen: Pen::Dashed });
            }
        }
    }
}
