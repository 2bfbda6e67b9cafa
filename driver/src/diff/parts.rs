//! A design as a list of parts: each with its text, its words, and its parent.

use grafsynth_frontend::graf::pieces::{ItemWriter, Word, words};
use grafsynth_ir::chart::{
    Chart, DeclarationKind, Design, Enclosing, Item, Library, Macro, Path, Setting, SettingKind,
    State, Transition,
};

/// The kind of a part. Parts of one kind in one parent are matched with each other, and for most kinds the order is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    Import,
    Library,
    Chart,
    Setting,
    /// Inputs, events and extern conditions: what a row of a stimulus sets.
    Input,
    Output,
    Var,
    Timer,
    Const,
    ExternAction,
    Action,
    Emergency,
    Property,
    Macro,
    /// Everything that can be active: steps, macro-steps, enclosing steps, states and uses of library charts.
    Step,
    Transition,
    Place,
    Board,
}

impl Kind {
    /// Whether the order of parts of this kind can change the behaviour or the trace of a chart (semantics §1).
    pub(super) fn is_ordered(self) -> bool {
        matches!(
            self,
            Kind::Chart
                | Kind::Input
                | Kind::Output
                | Kind::Var
                | Kind::Timer
                | Kind::ExternAction
                | Kind::Action
                | Kind::Step
                | Kind::Transition
        )
    }
}

/// A design as a list of parts.
pub(super) struct Parts<'a> {
    /// Parents before children, each in the order of the source.
    pub(super) list: Vec<Part<'a>>,
    /// One writer for each chart and library chart.
    writers: Vec<ItemWriter>,
}

/// One part of a design.
pub(super) struct Part<'a> {
    pub(super) kind: Kind,
    /// The part that contains it; `None` for charts and library charts.
    pub(super) parent: Option<usize>,
    /// Its name in its parent; `None` if it has no name.
    pub(super) key: Option<&'a str>,
    /// Its kind and path as shown to people: `state heating.cooking`.
    pub(super) name: String,
    /// Its text without the parts inside it.
    pub(super) own: String,
    /// The words of `own`.
    pub(super) words: Vec<Word>,
    /// The source and target paths, for a transition.
    pub(super) ends: Option<Ends>,
    drawn: Drawn<'a>,
}

/// The source object of a part's text.
enum Drawn<'a> {
    Import,
    Library(&'a Library),
    Chart(&'a Chart),
    Item { item: &'a Item, is_region: bool, writer: usize },
}

/// The ends of a transition, and its other words.
pub(super) struct Ends {
    /// The names of each path.
    pub(super) sources: Vec<Vec<String>>,
    pub(super) targets: Vec<Vec<String>>,
    /// The words of its conditions, clauses and actions.
    pub(super) says: Vec<Word>,
}

impl<'a> Parts<'a> {
    pub(super) fn of(design: &'a Design) -> Self {
        let mut parts = Parts { list: Vec::new(), writers: Vec::new() };
        for import in &design.imports {
            let text = format!("use \"{}\"", import.file);
            parts.add(None, Kind::Import, Some(&import.file), text.clone(), text, Drawn::Import);
        }
        for library in &design.libraries {
            let writer = ItemWriter::new(&library.items);
            let own = writer.library(&Library {
                name: library.name.clone(),
                parameters: library.parameters.clone(),
                items: Vec::new(),
                certificate: None,
                span: library.span,
                meta: library.meta.clone(),
            });
            parts.writers.push(writer);
            let name = format!("library {}", library.name.text);
            let key = Some(library.name.text.as_str());
            let at = parts.add(None, Kind::Library, key, name, own, Drawn::Library(library));
            parts.items(&library.items, at, &library.name.text, false);
        }
        let is_alone = design.charts.len() == 1 && design.libraries.is_empty();
        for chart in &design.charts {
            let writer = ItemWriter::new(&chart.items);
            let own = writer.chart(&Chart {
                is_unnamed: false,
                name: chart.name.clone(),
                span: chart.span,
                initial: chart.initial.clone(),
                items: Vec::new(),
                meta: chart.meta.clone(),
            });
            parts.writers.push(writer);
            let name = format!("chart {}", chart.name.text);
            let key = Some(chart.name.text.as_str());
            let at = parts.add(None, Kind::Chart, key, name, own, Drawn::Chart(chart));
            let prefix = if is_alone { "" } else { chart.name.text.as_str() };
            parts.items(&chart.items, at, prefix, false);
        }
        parts
    }

    /// The text of a part with the parts inside it.
    pub(super) fn whole(&self, at: usize) -> String {
        match self.list[at].drawn {
            Drawn::Import => self.list[at].own.clone(),
            Drawn::Library(library) => ItemWriter::new(&library.items).library(library),
            Drawn::Chart(chart) => ItemWriter::new(&chart.items).chart(chart),
            Drawn::Item { item, is_region, writer } => self.writers[writer].item(item, is_region),
        }
    }

    fn add(
        &mut self,
        parent: Option<usize>,
        kind: Kind,
        key: Option<&'a str>,
        name: String,
        own: String,
        drawn: Drawn<'a>,
    ) -> usize {
        let words = words(&own);
        self.list.push(Part { kind, parent, key, name, own, words, ends: None, drawn });
        self.list.len() - 1
    }

    fn items(&mut self, items: &'a [Item], parent: usize, prefix: &str, is_region: bool) {
        let writer = self.writers.len() - 1;
        for item in items {
            let (kind, word, key) = heading(item, is_region);
            let path = match key {
                Some(key) if prefix.is_empty() => key.to_owned(),
                Some(key) => format!("{prefix}.{key}"),
                None => String::new(),
            };
            let name = if let Item::Transition(transition) = item
                && key.is_none()
            {
                format!("{word} {}", ends_text(transition))
            } else {
                format!("{word} {path}").trim_end().to_owned()
            };
            let bare = without_parts(item);
            let own = self.writers[writer].item(bare.as_ref().unwrap_or(item), is_region);
            let drawn = Drawn::Item { item, is_region, writer };
            let at = self.add(Some(parent), kind, key, name, own, drawn);
            if let Item::Transition(transition) = item {
                self.list[at].ends = Some(ends(transition, &self.writers[writer]));
            }
            let (inner, is_region) = inner(item);
            self.items(inner, at, &path, is_region);
        }
    }
}

/// The parts of an item, and whether they are regions.
fn inner(item: &Item) -> (&[Item], bool) {
    match item {
        Item::State(state) => (&state.items, state.is_parallel),
        Item::Enclosing(enclosing) => (&enclosing.items, false),
        Item::Macro(body) => (&body.items, false),
        _ => (&[], false),
    }
}

/// The item without its parts; `None` if it cannot have any.
fn without_parts(item: &Item) -> Option<Item> {
    match item {
        Item::State(state) => Some(Item::State(State {
            step: state.step.clone(),
            is_parallel: state.is_parallel,
            initial: state.initial.clone(),
            histories: state.histories.clone(),
            items: Vec::new(),
        })),
        Item::Enclosing(one) => {
            Some(Item::Enclosing(Enclosing { step: one.step.clone(), items: Vec::new() }))
        }
        Item::Macro(body) => Some(Item::Macro(Macro {
            name: body.name.clone(),
            items: Vec::new(),
            meta: body.meta.clone(),
        })),
        _ => None,
    }
}

fn ends(transition: &Transition, writer: &ItemWriter) -> Ends {
    let names = |paths: &[Path]| -> Vec<Vec<String>> {
        paths.iter().map(|path| path.names.iter().map(|name| name.text.clone()).collect()).collect()
    };
    let bare = Transition {
        name: None,
        sources: Vec::new(),
        targets: Vec::new(),
        is_sink: false,
        ..transition.clone()
    };
    Ends {
        sources: names(&transition.sources),
        targets: names(&transition.targets),
        says: words(&writer.item(&Item::Transition(bare), false)),
    }
}

/// `p1 & p2 -> p3`; the display name of a transition without a name.
fn ends_text(transition: &Transition) -> String {
    let join =
        |paths: &[Path]| paths.iter().map(ToString::to_string).collect::<Vec<_>>().join(" & ");
    let (sources, targets) = (join(&transition.sources), join(&transition.targets));
    if transition.is_internal && targets.is_empty() {
        return format!("in {sources}");
    }
    format!("{sources} -> {}", if targets.is_empty() { "sink" } else { &targets })
        .trim_start()
        .to_owned()
}

/// Kind, word and name of an item.
fn heading(item: &Item, is_region: bool) -> (Kind, &'static str, Option<&str>) {
    match item {
        Item::Setting(setting) => {
            let (word, key) = setting_heading(setting);
            (Kind::Setting, word, key)
        }
        Item::Declaration(declaration) => {
            let (kind, word) = match declaration.kind {
                DeclarationKind::Input { .. } => (Kind::Input, "input"),
                DeclarationKind::Event { .. } => (Kind::Input, "event"),
                DeclarationKind::ExternCondition { .. } => (Kind::Input, "extern condition"),
                DeclarationKind::Output { .. } => (Kind::Output, "output"),
                DeclarationKind::Var { .. } => (Kind::Var, "var"),
                DeclarationKind::Timer { .. } => (Kind::Timer, "timer"),
                DeclarationKind::Const { .. } => (Kind::Const, "const"),
                DeclarationKind::ExternAction { .. } => (Kind::ExternAction, "extern action"),
            };
            (kind, word, Some(&declaration.name.text))
        }
        Item::Step(step) => (Kind::Step, "step", Some(&step.name.text)),
        Item::MacroStep(step) => (Kind::Step, "macro step", Some(&step.name.text)),
        Item::Enclosing(one) => (Kind::Step, "enclosing step", Some(&one.step.name.text)),
        Item::State(state) => {
            let word = if is_region { "region" } else { "state" };
            (Kind::Step, word, Some(&state.step.name.text))
        }
        Item::Use(one) => (Kind::Step, "use", Some(&one.name.text)),
        Item::Macro(body) => (Kind::Macro, "macro", Some(&body.name.text)),
        Item::Action(action) => (Kind::Action, "action", Some(&action.name.text)),
        Item::Transition(transition) => {
            (Kind::Transition, "transition", transition.name.as_ref().map(|one| one.text.as_str()))
        }
        Item::Emergency(_) => (Kind::Emergency, "emergency", None),
        Item::Property(property) => {
            let word = if property.is_assumption { "assume" } else { "assert" };
            (Kind::Property, word, property.name.as_ref().map(|name| name.text.as_str()))
        }
        Item::Place(_) => (Kind::Place, "place", None),
        Item::Board(_) => (Kind::Board, "device", None),
    }
}

/// The word for a setting in messages, and its key. The key is the keyword, because each setting is allowed once; `shared` of
/// single variables has no key.
fn setting_heading(setting: &Setting) -> (&'static str, Option<&str>) {
    let word = match &setting.kind {
        SettingKind::Tick(_) => "tick",
        SettingKind::Conflict(_) => "conflict",
        SettingKind::EvolutionSingle | SettingKind::EvolutionStable(_) => "evolution",
        SettingKind::Schedule(_) => "schedule",
        SettingKind::FireOne(_) => "fire",
        SettingKind::AssignSimultaneous(_) => "assign",
        SettingKind::ActionsIec => "actions",
        SettingKind::FinalScan => "final",
        SettingKind::Queue(_) => "queue",
        SettingKind::EventsExclusive => "events",
        SettingKind::Priority(_) => "priority",
        SettingKind::Shared(_, paths) if paths.is_empty() => "shared",
        SettingKind::Shared(..) => return ("setting shared", None),
    };
    ("setting", Some(word))
}
