//! Pass `settings`: the settings of all charts of a file, each at most once, and contradictions between them (semantics §1 C1, §3.4).

use super::codes;
use super::context::Lowering;
use crate::chart::{DeclarationKind, Item, SettingKind};
use crate::diag::Diagnostic;
use crate::net::{Evolution, MAX_LIMIT, Policy, Schedule, Sharing};
use crate::span::Span;

/// A setting and its source location.
type Set<T> = Option<(T, Span)>;

/// The settings of one chart.
#[derive(Debug, Default)]
struct Said {
    tick: Set<u64>,
    policy: Set<Policy>,
    evolution: Set<Option<Evolution>>,
    /// The bound of `evolution stable limit n`; 0 if no limit is written.
    limit: Set<u32>,
    schedule: Set<Schedule>,
    fire_one: Set<bool>,
    assign_simultaneous: Set<bool>,
    iec: Set<bool>,
    final_scan: Set<bool>,
    queue: Set<u32>,
    events_exclusive: Set<bool>,
    priority: Set<u32>,
    shared: Set<Sharing>,
}

/// Lowers the settings of all charts. Runs first: durations need the tick, and names depend on the kind of chart.
pub(super) fn settings(lowering: &mut Lowering<'_>) {
    let design = lowering.design;
    let mut said: Vec<Said> =
        design.charts.iter().map(|chart| read(lowering, &chart.items)).collect();
    lowering.iec = said.iter().map(|said| said.iec.is_some()).collect();
    // Charts that use a library chart must have the same settings as the library chart.
    for library in super::libraries::used(design) {
        said.push(read(lowering, &library.items));
    }

    let settings = &mut lowering.net.settings;
    let mut clashes = Vec::new();
    let mut shared = Shared { said: &said, clashes: &mut clashes };
    if let Some(tick) = shared.one("tick", |said| said.tick) {
        settings.tick_ns = tick.max(1);
    }
    let evolution = shared.one("evolution", |said| said.evolution).flatten();
    let limit = shared.one("limit", |said| said.limit);
    settings.schedule = shared.one("schedule", |said| said.schedule).unwrap_or(Schedule::Declared);
    settings.fire_one = shared.one("fire", |said| said.fire_one).unwrap_or(false);
    settings.assign_simultaneous =
        shared.one("assign", |said| said.assign_simultaneous).unwrap_or(false);
    settings.queue = shared.one("queue", |said| said.queue);
    settings.events_exclusive = shared.one("events", |said| said.events_exclusive).is_some();
    settings.policy = shared.one("conflict", |said| said.policy).unwrap_or(Policy::All);
    settings.final_scan = shared.one("final scan", |said| said.final_scan).is_some();
    lowering.sharing = shared.one("shared", |said| said.shared);
    match evolution {
        Some(Evolution::Single) => settings.evolution = Evolution::Single,
        // semantics §1 [C1]: by default a chart makes one micro-step per reaction, unless it is a statechart.
        None if !settings.policy.is_statechart() => settings.evolution = Evolution::Single,
        Some(Evolution::Stable { .. }) | None => {
            settings.evolution = Evolution::Stable { limit: limit.unwrap_or(0) };
        }
    }
    for clash in clashes {
        lowering.report(clash);
    }
    for said in &said {
        exclusions(lowering, said);
    }
    if lowering.net.settings.evolution != Evolution::Single {
        mealy_needs_single(lowering, &said);
    }
}

fn read(lowering: &mut Lowering<'_>, items: &[Item]) -> Said {
    let mut said = Said::default();
    for item in items {
        let Item::Setting(setting) = item else { continue };
        let span = setting.span;
        let earlier = match &setting.kind {
            SettingKind::Tick(0) => {
                lowering.report(
                    Diagnostic::error(codes::RANGE, "the tick cannot be 0")
                        .at(span, "times are measured in ticks")
                        .help(
                            "write a longer one, such as `tick 10 ms`, which is also the default",
                        ),
                );
                None
            }
            SettingKind::Tick(ns) => once(&mut said.tick, *ns, span),
            SettingKind::Conflict(policy) => once(&mut said.policy, *policy, span),
            SettingKind::EvolutionSingle => {
                once(&mut said.evolution, Some(Evolution::Single), span)
            }
            SettingKind::EvolutionStable(limit) => {
                if limit.is_some_and(|limit| !(1..=MAX_LIMIT).contains(&limit)) {
                    let message = format!("the limit of micro-steps must be in 1..{MAX_LIMIT}");
                    lowering.report(
                        Diagnostic::error(codes::RANGE, message).at(span, "").help(
                            "write a number in this range, or omit `limit` to use the default",
                        ),
                    );
                } else if let Some(limit) = *limit {
                    said.limit.get_or_insert((limit, span));
                }
                once(&mut said.evolution, Some(Evolution::Stable { limit: 0 }), span)
            }
            SettingKind::Schedule(schedule) => once(&mut said.schedule, *schedule, span),
            SettingKind::FireOne(one) => once(&mut said.fire_one, *one, span),
            SettingKind::AssignSimultaneous(on) => once(&mut said.assign_simultaneous, *on, span),
            SettingKind::ActionsIec => once(&mut said.iec, true, span),
            SettingKind::FinalScan => once(&mut said.final_scan, true, span),
            SettingKind::Queue(bound) => once(&mut said.queue, (*bound).max(1), span),
            SettingKind::EventsExclusive => once(&mut said.events_exclusive, true, span),
            SettingKind::Priority(priority) => once(&mut said.priority, *priority, span),
            SettingKind::Shared(sharing, names) if names.is_empty() => {
                once(&mut said.shared, *sharing, span)
            }
            // Pass `sharing` handles the names.
            SettingKind::Shared(..) => None,
        };
        if let Some(earlier) = earlier {
            let what = word(&setting.kind);
            lowering.report(Diagnostic::twice(
                codes::SETTING_TWICE,
                format!("`{what}` is set twice"),
                [span, earlier],
                "keep one of them",
            ));
        }
    }
    said
}

/// Stores the first value; returns the location of an earlier one.
fn once<T>(slot: &mut Set<T>, value: T, span: Span) -> Option<Span> {
    match slot {
        Some((_, earlier)) => Some(*earlier),
        None => {
            *slot = Some((value, span));
            None
        }
    }
}

fn word(kind: &SettingKind) -> &'static str {
    match kind {
        SettingKind::Tick(_) => "tick",
        SettingKind::Conflict(_) => "conflict",
        SettingKind::EvolutionSingle | SettingKind::EvolutionStable(_) => "evolution",
        SettingKind::Schedule(_) => "schedule",
        SettingKind::FireOne(_) => "fire",
        SettingKind::AssignSimultaneous(_) => "assign",
        SettingKind::ActionsIec => "actions",
        SettingKind::FinalScan => "final scan",
        SettingKind::Queue(_) => "queue",
        SettingKind::EventsExclusive => "events exclusive",
        SettingKind::Priority(_) => "priority",
        SettingKind::Shared(..) => "shared",
    }
}

struct Shared<'s> {
    said: &'s [Said],
    clashes: &'s mut Vec<Diagnostic>,
}

impl Shared<'_> {
    /// The value of a setting that may be written in any chart of the file and applies to all charts.
    fn one<T: Copy + PartialEq>(&mut self, word: &str, get: impl Fn(&Said) -> Set<T>) -> Option<T> {
        let mut found: Set<T> = None;
        for (value, span) in self.said.iter().filter_map(get) {
            match found {
                None => found = Some((value, span)),
                Some((first, _)) if first == value => {}
                Some((_, first_span)) => self.clash(word, span, first_span),
            }
        }
        found.map(|(value, _)| value)
    }

    fn clash(&mut self, word: &str, span: Span, first: Span) {
        self.clashes.push(
            Diagnostic::error(
                codes::SETTING_CONFLICT,
                format!("the charts of one file differ in `{word}`"),
            )
            .at(span, "set here")
            .at(first, "set differently here")
            .help("write it in one chart only, or the same in each: the charts of one file share this setting"),
        );
    }
}

fn exclusions(lowering: &mut Lowering<'_>, said: &Said) {
    let is_statechart = lowering.is_statechart();
    let exclude = |lowering: &mut Lowering<'_>, span, message: String, help: &str| {
        lowering
            .report(Diagnostic::error(codes::SETTING_CONFLICT, message).at(span, "").help(help));
    };
    if is_statechart {
        if let Some((Some(Evolution::Single), span)) = said.evolution {
            exclude(
                lowering,
                span,
                "a statechart runs to completion, so its evolution is `stable`".into(),
                "remove `evolution single`, or choose another conflict policy",
            );
        }
        if let Some((true, span)) = said.fire_one {
            exclude(
                lowering,
                span,
                "`fire one` has no meaning in a statechart".into(),
                "remove it: the hierarchy determines which transitions fire",
            );
        }
    } else if let Some((_, span)) = said.queue {
        exclude(
            lowering,
            span,
            "`queue` has no meaning outside a statechart".into(),
            "remove it: here an event is present in exactly one micro-step and is never queued",
        );
    }
}

fn mealy_needs_single(lowering: &mut Lowering<'_>, said: &[Said]) {
    let design = lowering.design;
    for (chart, said) in design.charts.iter().zip(said) {
        for item in &chart.items {
            let Item::Declaration(declaration) = item else { continue };
            if matches!(declaration.kind, DeclarationKind::Output { mealy: true, .. }) {
                let name = &declaration.name;
                let mut finding = Diagnostic::error(
                    codes::SETTING_CONFLICT,
                    format!("the mealy output `{name}` needs `evolution single`"),
                )
                .at(name.span, "declared `mealy` here");
                finding = match said.evolution {
                    Some((_, span)) => finding.at(span, "the evolution is `stable`"),
                    None => {
                        finding.at(chart.name.span, "the evolution of a statechart is `stable`")
                    }
                };
                lowering.report(finding.help("write `evolution single`, or remove `mealy`"));
            }
        }
    }
}
