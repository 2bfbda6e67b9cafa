//! Which units become charts, and the chart of each: its declarations, settings and behaviour.

use grafsynth_ir::Gather;
use std::collections::BTreeSet;

use grafsynth_ir::chart::{Chart, Design, Item, Setting, SettingKind};
use grafsynth_ir::diag::{Diagnostic, Severity};
use grafsynth_ir::net::{Meta, Policy};
use grafsynth_ir::{Name, Span};

use super::context::{Elaborator, Frame, GLOBALS};
use super::usage::{self, Usage};
use crate::codes;
use crate::st::ast::{Body, Element, Pou, PouKind};
use crate::st::symbol::{Ident, Symbol};

/// A unit that becomes a chart.
#[derive(Debug, Clone)]
struct Root {
    pou: usize,
    name: Name,
    tick: Option<u64>,
}

impl Elaborator<'_> {
    pub(super) fn design(&mut self) -> Option<Design> {
        let roots = self.roots();
        if roots.is_empty() {
            let span = self.library.pous.first().map_or(Span::default(), |pou| pou.name.span);
            let finding = Diagnostic::error(
                codes::ST_NO_POU,
                "the text has no program and no function block with a chart",
            );
            self.report(
                if self.library.pous.is_empty() { finding } else { finding.at(span, "only this") }
                    .help("write `PROGRAM name .. END_PROGRAM`"),
            );
            return None;
        }
        let start = self.found.len();
        let design = self.charts(&roots);
        let failed: Vec<usize> = roots
            .iter()
            .map(|root| root.pou)
            .filter(|pou| !matches!(self.library.pous[*pou].body, Body::Sfc(_)))
            .collect();
        let has_error = self.found[start..].iter().any(Diagnostic::is_error);
        if has_error && !failed.is_empty() {
            // A program with errors is left out if it contains instances of blocks with charts: these blocks are then the design.
            let inner = self.charts_of(&failed);
            if !inner.is_empty() {
                return self.instead(&roots, &failed, &inner, start);
            }
        }
        Some(design)
    }

    /// Uses the charts of function blocks instead of the programs that contain their instances.
    fn instead(
        &mut self,
        roots: &[Root],
        failed: &[usize],
        inner: &[usize],
        start: usize,
    ) -> Option<Design> {
        let complaints = self.found.split_off(start);
        let mut second: Vec<Root> =
            roots.iter().filter(|root| !failed.contains(&root.pou)).cloned().collect();
        let tick = roots.iter().find_map(|root| root.tick);
        for pou in inner {
            let name = self.library.pous[*pou].name.name();
            second.push(Root { pou: *pou, name, tick });
        }
        self.restart();
        let design = self.charts(&second);
        let again: Vec<Diagnostic> = self.found[start..].to_vec();
        for mut finding in complaints {
            if again.contains(&finding) {
                continue;
            }
            finding.severity = finding.severity.max(Severity::Warning);
            self.report(finding);
        }
        for pou in failed {
            let name = self.library.pous[*pou].name.name();
            let blocks: Vec<&str> =
                inner.iter().map(|pou| self.library.pous[*pou].name.text.as_str()).collect();
            let blocks = format!("`{}`", blocks.join("`, `"));
            self.report(
                Diagnostic::warning(
                    codes::ST_LEFT_OUT,
                    format!("program `{name}` is ignored; the design is {blocks} alone"),
                )
                .at(name.span, "calls a function block with a chart")
                .help("the inputs and outputs of the design are those of the block"),
            );
        }
        Some(design)
    }

    /// Discards the declarations of the first attempt.
    fn restart(&mut self) {
        self.frames = vec![Frame::default()];
        self.objects.clear();
        self.items.clear();
        self.chart_names.clear();
        self.taken.clear();
        self.inputs.clear();
        self.flags.clear();
        self.narrowed.clear();
        self.time_values.clear();
        self.spent = 0;
        self.chart = 0;
    }

    fn roots(&mut self) -> Vec<Root> {
        let library = self.library;
        let mut roots = Vec::new();
        let tick_of = |task: Option<&Ident>| {
            let task = task?;
            library.tasks.iter().find(|one| one.name.id == task.id)?.interval
        };
        for instance in &library.programs {
            let found = library
                .pous
                .iter()
                .position(|pou| pou.kind == PouKind::Program && pou.name.id == instance.program.id);
            let Some(pou) = found else {
                let programs = library.pous.iter().filter(|pou| pou.kind == PouKind::Program);
                let known: Vec<String> = programs.map(|pou| pou.name.id.to_string()).collect();
                let help = "the file declares no such program";
                self.unknown("program", &instance.program, &known, help);
                continue;
            };
            let times =
                library.programs.iter().filter(|one| one.program.id == instance.program.id).count();
            let name = if times > 1 { instance.name.name() } else { library.pous[pou].name.name() };
            let task = instance.task.as_ref().or(library.tasks.first().map(|task| &task.name));
            roots.push(Root { pou, name, tick: tick_of(task) });
        }
        for (index, pou) in library.pous.iter().enumerate() {
            let is_run = roots.is_empty() || roots.iter().any(|root| root.pou == index);
            if pou.kind == PouKind::Program && !is_run {
                self.report(
                    Diagnostic::warning(
                        codes::ST_LEFT_OUT,
                        format!(
                            "program `{}` is ignored: the configuration has no instance of it",
                            pou.name
                        ),
                    )
                    .at(pou.name.span, "")
                    .help(format!(
                        "in ST: add `PROGRAM main : {0};` to the resource; in PLCopen XML: add <pouInstance name=\"main\" typeName=\"{0}\"/> to a <task>; or remove the configuration",
                        pou.name
                    )),
                );
            }
        }
        let tick = library.tasks.iter().find_map(|task| task.interval);
        let all = |kind: fn(&Pou) -> bool| {
            let pous = library.pous.iter().enumerate().filter(move |(_, pou)| kind(pou));
            pous.map(|(pou, one)| Root { pou, name: one.name.name(), tick }).collect::<Vec<_>>()
        };
        if roots.is_empty() {
            roots = all(|pou| pou.kind == PouKind::Program);
        }
        if roots.is_empty() {
            roots =
                all(|pou| pou.kind == PouKind::FunctionBlock && matches!(pou.body, Body::Sfc(_)));
        }
        if roots.is_empty() {
            let used = self.instantiated();
            roots = all(|pou| pou.kind == PouKind::FunctionBlock);
            roots.retain(|root| !used.contains(&root.pou));
        }
        roots
    }

    /// Function blocks with instances in other units.
    fn instantiated(&self) -> BTreeSet<usize> {
        let mut used = BTreeSet::new();
        for pou in &self.library.pous {
            for var in &pou.vars {
                used.extend(var.ty.name().and_then(|name| self.blocks.get(&name.id)));
            }
        }
        used
    }

    /// Function blocks with charts whose instances these units contain, directly or indirectly.
    fn charts_of(&self, pous: &[usize]) -> Vec<usize> {
        let mut found: Vec<usize> = Vec::new();
        let mut seen: BTreeSet<usize> = pous.iter().copied().gather();
        let mut next = pous.to_vec();
        while let Some(pou) = next.pop() {
            for var in &self.unit(pou).vars {
                let block = var.ty.name().and_then(|name| self.blocks.get(&name.id));
                let Some(&block) = block else { continue };
                if !seen.insert(block) {
                    continue;
                }
                if matches!(self.unit(block).body, Body::Sfc(_)) {
                    found.push(block);
                } else {
                    next.push(block);
                }
            }
        }
        found.sort_unstable();
        found
    }

    fn charts(&mut self, roots: &[Root]) -> Design {
        self.chart_names = roots.iter().map(|root| root.name.clone()).collect();
        let usages: Vec<Usage> =
            roots.iter().map(|root| self.usage(&self.library.pous[root.pou])).collect();
        let mut charts = Vec::new();
        for (index, root) in roots.iter().enumerate() {
            self.chart = index;
            self.items.clear();
            self.taken.clear();
            self.inputs.clear();
            self.flags.clear();
            if index == 0 {
                self.declare_globals(&usages);
            }
            let chart = self.one_chart(root, &usages[index]);
            charts.push(chart);
        }
        Design { charts, ..Design::default() }
    }

    /// How a unit uses its names.
    pub(super) fn usage(&self, pou: &Pou) -> Usage {
        usage::of(pou, &|instance| {
            let mut vars = pou.vars.iter().chain(&self.library.globals);
            let ty = vars.find(|var| var.name.id == *instance).and_then(|var| var.ty.name());
            let block = ty.and_then(|ty| self.blocks.get(&ty.id));
            block.map(|block| self.parameters(*block)).unwrap_or_default()
        })
    }

    /// Declares the global variables that are used, in the first chart.
    fn declare_globals(&mut self, usages: &[Usage]) {
        let library = self.library;
        let mut all = Usage::default();
        for usage in usages {
            all.assigned.extend(usage.assigned.iter().cloned());
            all.actions.extend(usage.actions.iter().cloned());
            all.read.extend(usage.read.iter().cloned());
            all.fields.extend(usage.fields.iter().cloned());
            for (name, values) in &usage.times {
                all.times.entry(name.clone()).or_default().extend(values.iter().cloned());
            }
            for (instance, calls) in &usage.calls {
                all.calls.entry(instance.clone()).or_default().extend(calls.iter().cloned());
            }
        }
        // Function blocks and functions may read and change globals, so their uses count too, even if the unit is never called.
        for pou in library.pous.iter().filter(|pou| pou.kind != PouKind::Program) {
            let inner = self.usage(pou);
            let own = pou.own_names();
            let is_outer = |name: &&Symbol| !own.contains(*name);
            all.assigned.extend(inner.assigned.iter().filter(is_outer).cloned());
            for (name, values) in inner.times.iter().filter(|(name, _)| is_outer(name)) {
                all.times.entry(name.clone()).or_default().extend(values.iter().cloned());
            }
            all.read.extend(inner.read.iter().filter(is_outer).cloned());
            all.fields.extend(inner.fields);
        }
        // `list.name` refers to a global variable by the name of its list.
        for (list, name) in all.fields.clone() {
            if all.assigned.contains(&list) {
                all.assigned.insert(name.clone());
                all.times.entry(name.clone()).or_default().push(None);
            }
            all.read.insert(name);
        }
        let mut seen = BTreeSet::new();
        for var in &library.globals {
            let key = &var.name.id;
            if !seen.insert(key.clone()) {
                self.declared_twice(&var.name);
                continue;
            }
            if var.is_constant
                || all.assigned.contains(key)
                || all.actions.contains(key)
                || all.read.contains(key)
            {
                self.declare(GLOBALS, var, &all, true);
            }
        }
    }

    fn one_chart(&mut self, root: &Root, usage: &Usage) -> Chart {
        let library = self.library;
        let pou = &library.pous[root.pou];
        for refusal in &pou.refused {
            self.report(refusal.diagnostic());
        }
        let frame = self.new_frame();
        self.may_call_charts = matches!(pou.body, Body::Statements(_));
        let mut seen = BTreeSet::new();
        for var in &pou.vars {
            if !seen.insert(var.name.id.clone()) {
                self.declared_twice(&var.name);
                continue;
            }
            self.taken.insert(var.name.id.clone());
            self.declare(frame, var, usage, true);
        }
        let span = pou.name.span;
        let mut items: Vec<Item> = Vec::new();
        let mut kinds = vec![
            SettingKind::Conflict(Policy::Priority),
            SettingKind::EvolutionSingle,
            SettingKind::ActionsIec,
        ];
        kinds.extend(root.tick.map(SettingKind::Tick));
        if pou.options.final_scan {
            kinds.push(SettingKind::FinalScan);
        }
        for setting in &pou.options.settings {
            self.pragma(setting, &mut kinds);
        }
        items.extend(kinds.into_iter().map(|kind| Item::Setting(Setting { kind, span })));
        let behaviour = match &pou.body {
            Body::Sfc(chart) => {
                for element in &chart.elements {
                    if let Element::Step(step) = element {
                        self.taken.insert(step.name.id.clone());
                    }
                }
                for action in &chart.actions {
                    self.taken.insert(action.name.id.clone());
                }
                self.sfc(frame, chart)
            }
            Body::Statements(list) => self.one_step(frame, pou, list, usage),
        };
        items.append(&mut self.items);
        items.extend(behaviour);
        let meta = Meta { span, ..Meta::default() };
        Chart { name: root.name.clone(), span, items, meta, ..Chart::default() }
    }

    /// Adds a setting from a pragma, in the syntax of the chart language. It replaces the default of the standard.
    fn pragma(&mut self, setting: &Name, kinds: &mut Vec<SettingKind>) {
        let text = format!("chart c {{ {} }}", setting.text);
        let parsed = crate::graf::parse(setting.span.file, &text);
        let charts = parsed.design.map(|design| design.charts).unwrap_or_default();
        let settings = charts.iter().flat_map(|chart| &chart.items).filter_map(Item::as_setting);
        let found: Vec<SettingKind> = settings.map(|setting| setting.kind.clone()).collect();
        if !parsed.diagnostics.is_empty() || found.len() != 1 {
            self.report(
                Diagnostic::error(
                    codes::ST_UNEXPECTED,
                    format!("unknown chart setting `{}`", setting.text),
                )
                .at(setting.span, "in this pragma")
                .help("write a setting of the chart language, such as {grafsynth conflict all}; {grafsynth restart} belongs in a transition"),
            );
            return;
        }
        let evolution = |kind: &SettingKind| {
            matches!(kind, SettingKind::EvolutionSingle | SettingKind::EvolutionStable(_))
        };
        let names =
            |kind: &SettingKind| matches!(kind, SettingKind::Shared(_, names) if !names.is_empty());
        for kind in found {
            kinds.retain(|other| {
                (names(other) || names(&kind))
                    || std::mem::discriminant(other) != std::mem::discriminant(&kind)
                        && !(evolution(other) && evolution(&kind))
            });
            kinds.push(kind);
        }
    }
}
