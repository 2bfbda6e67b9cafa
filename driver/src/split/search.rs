//! The best partition whose devices really hold their parts.
//!
//! First, estimates choose: the best partition within them is built, and after a failed fit the chip is offered less. What is found fits, but a better
//! partition may exist where an estimate was too high. Some that differ in one group are built, too. Then a second search counts only what every chip needs
//! ([`Count::Least`]). Its best objective is a lower bound for all that fit. If that is not below what was found, nothing better exists. Otherwise this partition is
//! built: either it fits and is the best one, or only it is excluded and the bound may rise. Partitions that probably need more macrocells ([`Cells`]) or pins
//! than a device has come last. The search ends after a fixed number of builds; the bound then shows how much better a partition could still be.

use super::conflict::{Exclusion, NoPartition, lacks_pins_of_cpu, unplaced};
use super::free::late_on_cpu;
use super::link::link_parts;
use super::memory::{Memory, memory};
use super::table::crowded;
use super::{BuiltPart, PartDevice, Request, SoFar, build_cpu, build_part, misfit, spec};
use crate::built::BuildOptions;
use crate::codes;
use crate::pipeline;
use grafsynth_backend_pld::codes::DOES_NOT_FIT;
use grafsynth_ir::diag::any_error;
use grafsynth_ir::division::{Division, PartIndex};
use grafsynth_ir::facts::Component;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_split::codes::{LINK, PINS};
use grafsynth_split::cpu::Cpu;
use grafsynth_split::partition::{Unplaced, memory as estimate};
use grafsynth_split::solve::{Constraint, Forbidden};
use grafsynth_split::{
    Cells, Count, Groups, Objective, PartSpec, Partition, divide, given, neighbour, partition,
};

/// The number of partitions from estimates that are built before that search ends.
const MOST_ESTIMATES: usize = 40;

/// The number of partitions that are built because they differ in one group from the best one and would be better.
const MOST_NEIGHBOURS: usize = 8;

/// The largest number of sets of decisions that are left out at first, because they probably need more macrocells than a chip has.
const MOST_CUTS: usize = 200;

/// A partition whose chips hold their parts.
pub(super) struct Fitted {
    pub(super) partition: Partition,
    /// The objective.
    pub(super) value: i64,
    /// No partition that fits has a smaller objective.
    pub(super) bound: i64,
    pub(super) division: Division,
    /// The chips, without the CPU.
    pub(super) chips: Vec<BuiltPart>,
    /// The number of partitions that were built and did not fit.
    pub(super) unfit: usize,
    /// The number of partitions that were built.
    pub(super) builds: usize,
    /// The number of sets of decisions that were left out at first, because they probably need too many macrocells.
    pub(super) cuts: usize,
    /// The memories that the part on the CPU needs.
    pub(super) memory: Result<Memory, String>,
}

/// Finds the best partition that fits. `components` are those of the net of a round.
pub(super) fn search(
    net: &Valid<Net>,
    (groups, components): (&Groups, &[Component]),
    request: &Request<'_>,
) -> Result<Fitted, Vec<Diagnostic>> {
    let mut search = Search {
        net,
        groups,
        components,
        request,
        late: late_on_cpu(net, groups, request).into_iter().map(Exclusion::late).collect(),
        has_plant: true,
        lacks_pins: false,
        misfits: Vec::new(),
        unfit: 0,
        builds: 0,
        last: Vec::new(),
        least_excess: u64::MAX,
        value: None,
        bound: None,
    };
    match search.run() {
        Err(_) if search.lacks_pins => {
            search.has_plant = false;
            search.last = Vec::new();
            search.misfits = Vec::new();
            search.run()
        }
        first => first,
    }
}

struct Search<'a> {
    net: &'a Valid<Net>,
    groups: &'a Groups,
    components: &'a [Component],
    request: &'a Request<'a>,
    /// The decisions with which a deadline is missed in any case.
    late: Vec<Exclusion>,
    /// Whether the CPU must have pins for the inputs and outputs of the plant, besides those for the link. If nothing fits then, they are connected in another way.
    has_plant: bool,
    /// Whether the CPU had too few pins for some partition.
    lacks_pins: bool,
    /// The partitions that were built and are not better than the best one.
    misfits: Vec<Exclusion>,
    unfit: usize,
    builds: usize,
    /// The findings of the last chip that could not be built, or of the part on the CPU that exceeded its memory least.
    last: Vec<Diagnostic>,
    /// How many bytes too large that part was.
    least_excess: u64,
    /// The objective of the best partition so far that fits, and the bound for all that fit.
    value: Option<i64>,
    bound: Option<i64>,
}

/// What a build of the chips gives.
enum Fit {
    Fits(Box<Fitted>),
    /// A part cannot be built, or does not fit its device.
    Misfit {
        part: PartIndex,
        why: Misfit,
    },
}

/// Why a part does not fit.
enum Misfit {
    /// A chip has too few macrocells, product terms or pins.
    Room,
    /// The CPU has too few pins, or a signal cannot be wired.
    Link,
    /// The CPU has too little flash or RAM.
    Memory(Memory, &'static Cpu),
    /// Another reason.
    Other,
}

/// What is known of the part on the CPU with its link.
enum OnCpu {
    /// The link can be wired, with these memories.
    Linked(Result<(Memory, &'static Cpu), String>),
    /// Its pins do not suffice, or a signal cannot be wired.
    Unwired(Vec<Diagnostic>),
}

impl Search<'_> {
    /// Reports what is known.
    fn tell(&self) {
        let Search { value, bound, builds, .. } = *self;
        (self.request.told)(SoFar { objective: self.request.objective, value, bound, builds });
    }

    fn best(
        &self,
        specs: &[PartSpec],
        count: Count,
        (exclusions, others): (&[Exclusion], &[Forbidden]),
    ) -> Result<Partition, NoPartition> {
        let Request { places, objective, .. } = *self.request;
        let kind = (objective, count);
        let all = [&forbidden(exclusions)[..], others].concat();
        partition(self.net, self.groups, specs, places, kind, &all)
            .map_err(|why| NoPartition { why, exclusions: exclusions.to_vec() })
    }

    fn run(&mut self) -> Result<Fitted, Vec<Diagnostic>> {
        if let Some(only) = self.given()? {
            return Ok(only);
        }
        let first = match self.by_estimates()? {
            Ok(first) => Ok(self.by_neighbours(first)?),
            none => none,
        };
        self.by_bounds(first)
    }

    /// The partition, if the places leave no choice and it fits: then no estimate can refuse it. Otherwise the search says why nothing fits.
    fn given(&mut self) -> Result<Option<Fitted>, Vec<Diagnostic>> {
        let Request { places, objective, .. } = *self.request;
        let kind = (objective, Count::Least);
        let Ok(Some(only)) = given(self.net, self.groups, &self.specs(), places, kind) else {
            return Ok(None);
        };
        let is_late = |late: &Exclusion| {
            late.forbidden.decisions().iter().all(|(group, at)| only.part.get(*group) == Some(at))
        };
        if self.late.iter().any(is_late) {
            return Ok(None);
        }
        Ok(match self.fit(only)? {
            Fit::Fits(fitted) => {
                let (bound, unfit, builds) = (fitted.value, self.unfit, self.builds);
                Some(Fitted { bound, unfit, builds, ..*fitted })
            }
            Fit::Misfit { .. } => None,
        })
    }

    /// A better partition that fits, reached by moves of one group at a time; else the same one.
    fn by_neighbours(&mut self, mut best: Box<Fitted>) -> Result<Box<Fitted>, Vec<Diagnostic>> {
        let (specs, Request { places, objective, .. }) = (self.specs(), *self.request);
        let kind = (objective, Count::Least);
        for _ in 0..MOST_NEIGHBOURS {
            let from = (&best.partition.part[..], best.value);
            let excluded = forbidden(&[&self.late[..], &self.misfits].concat());
            let next = neighbour(self.net, self.groups, &specs, places, kind, from, &excluded);
            let Ok(Some(next)) = next else { break };
            let tried = whole(&next);
            match self.fit(next)? {
                Fit::Fits(fitted) if fitted.value < best.value => best = fitted,
                Fit::Fits(_) | Fit::Misfit { .. } => self.misfits.push(tried),
            }
        }
        Ok(best)
    }

    fn specs(&self) -> Vec<PartSpec> {
        let has_plant = self.has_plant;
        let of = |part| PartSpec { has_plant, ..spec(part, self.request.reset) };
        self.request.parts.iter().map(of).collect()
    }

    /// The first partition from estimates that fits; `Ok(Err(_))` if there is none.
    fn by_estimates(&mut self) -> Result<Result<Box<Fitted>, NoPartition>, Vec<Diagnostic>> {
        let mut specs = self.specs();
        let mut excluded = self.late.clone();
        for _ in 0..MOST_ESTIMATES {
            let partition = match self.best(&specs, Count::Estimate, (&excluded, &[])) {
                Ok(partition) => partition,
                Err(why) => return Ok(Err(why)),
            };
            match self.fit(partition.clone())? {
                Fit::Fits(fitted) => return Ok(Ok(fitted)),
                Fit::Misfit { part, why } => {
                    let own = partition.part.iter().enumerate().filter(|(_, own)| **own == part);
                    let nodes: Vec<usize> = own.map(|(group, _)| group).collect();
                    match why {
                        Misfit::Room | Misfit::Link => {
                            offer_less(&mut specs[part], part, &partition);
                        }
                        Misfit::Memory(memory, cpu) => {
                            self.offer_less_memory(&mut specs[part], &nodes, &memory, cpu);
                        }
                        Misfit::Other => {}
                    }
                    excluded.push(match why {
                        // A link depends on all parts.
                        Misfit::Link => whole(&partition),
                        _ => Exclusion::built(Forbidden::Together { nodes, part }),
                    });
                }
            }
        }
        Ok(Err(NoPartition { why: Unplaced::Unknown, exclusions: excluded }))
    }

    /// Finds better partitions that fit, then raises the bound until it meets the best one.
    ///
    /// First, what probably needs too many macrocells or pins is left out, so that the builds are of partitions that may fit. Then it counts, too, because only a
    /// build shows that a device cannot hold its part.
    fn by_bounds(
        &mut self,
        first: Result<Box<Fitted>, NoPartition>,
    ) -> Result<Fitted, Vec<Diagnostic>> {
        let specs = self.specs();
        let mut excluded = [&self.late[..], &self.misfits].concat();
        let (mut best, estimated) = match first {
            Ok(fitted) => (Some(fitted), None),
            Err(none) if none.may_be_of_estimates() => (None, Some(none)),
            Err(none) => return Err(unplaced(self.net, self.groups, self.request, &none, 0)),
        };
        let facts = pipeline::facts(self.net, &self.request.options.limits);
        let cells = Cells::new(self.net, &facts, self.groups);
        // Nothing is sure of the pins before a build: what a chip does not depend on needs none.
        let sure: Vec<PartSpec> =
            specs.iter().map(|spec| PartSpec { pins: None, ..spec.clone() }).collect();
        let mut unlikely: Option<Vec<Forbidden>> = Some(Vec::new());
        let mut bound = i64::MIN;
        let (mut fits, mut cuts, mut likely) = (0, 0, None);
        let ended = loop {
            let found = match &unlikely {
                Some(others) => self.best(&specs, Count::Least, (&excluded, others)),
                None => self.best(&sure, Count::Least, (&excluded, &[])),
            };
            let lower = match found {
                Ok(lower) => lower,
                Err(none) if unlikely.take().is_some() => {
                    likely = Some(none);
                    continue;
                }
                Err(none) => {
                    if none.is_conflict() {
                        // Every partition that is left is at least as dear as the best one.
                        bound = i64::MAX;
                    }
                    break Some(none);
                }
            };
            if unlikely.is_none() {
                bound = bound.max(lower.bound);
                self.bound = Some(bound);
                self.tell();
            }
            let is_better = best.as_ref().is_none_or(|best| lower.evaluation.value < best.value);
            if !is_better || fits >= self.request.fits {
                if unlikely.take().is_some() {
                    continue;
                }
                break None;
            }
            if let Some(unlikely) = &mut unlikely
                && cuts < MOST_CUTS
            {
                let too_much = too_much(&specs, &cells, &lower.part);
                if !too_much.is_empty() {
                    cuts += too_much.len();
                    unlikely.extend(too_much);
                    continue;
                }
            }
            fits += 1;
            excluded.push(whole(&lower));
            if let Fit::Fits(fitted) = self.fit(lower)?
                && best.as_ref().is_none_or(|best| fitted.value < best.value)
            {
                best = Some(fitted);
            }
        };
        match best {
            Some(best) => {
                let (unfit, builds) = (self.unfit, self.builds);
                Ok(Fitted { bound: bound.min(best.value), unfit, builds, cuts, ..*best })
            }
            None => {
                let is_certain = excluded.len() == self.late.len();
                Err(self.nothing_fits(estimated, likely, (ended, is_certain)))
            }
        }
    }

    /// The finding if nothing fits: constraints that exclude each other in any case, else those of the estimates.
    fn nothing_fits(
        &mut self,
        estimated: Option<NoPartition>,
        likely: Option<NoPartition>,
        (ended, is_certain): (Option<NoPartition>, bool),
    ) -> Vec<Diagnostic> {
        for none in [&estimated, &likely].into_iter().flatten() {
            if let Unplaced::Conflict(conflict) = &none.why {
                self.lacks_pins |= lacks_pins_of_cpu(self.request, conflict);
            }
        }
        let is_conflict = |none: &NoPartition| none.is_conflict();
        let none = match ended {
            Some(none) if is_certain && none.is_conflict() => Some(none),
            ended => estimated.filter(is_conflict).or(likely.filter(is_conflict)).or(ended),
        };
        let mut findings = match none {
            None | Some(NoPartition { why: Unplaced::Unknown, .. }) => {
                let message = format!(
                    "no partition found: {} were built, and a device could not hold its part in any of them",
                    grafsynth_ir::counted(self.unfit, "partition", "partitions")
                );
                vec![Diagnostic::error(codes::NO_PARTITION, message)]
            }
            Some(none) => unplaced(self.net, self.groups, self.request, &none, self.unfit),
        };
        for one in &mut self.last {
            // Its advice is for a chart on one chip: another device for the whole of it, or dividing it.
            if one.code == DOES_NOT_FIT {
                one.help = None;
                one.help_in.clear();
            }
        }
        findings.append(&mut self.last);
        findings
    }

    /// Builds the parts of a partition.
    fn fit(&mut self, partition: Partition) -> Result<Fit, Vec<Diagnostic>> {
        let names: Vec<String> = self.request.parts.iter().map(|part| part.name.clone()).collect();
        let owners = partition.owners.clone();
        let division = divide(self.net, self.groups, owners, &names, self.components)?;
        self.builds += 1;
        self.tell();
        let mut chips = Vec::new();
        for (at, requested) in self.request.parts.iter().enumerate() {
            if let PartDevice::Cpu(_) = requested.device {
                continue;
            }
            let chip = build_part(&division.parts[at].net, requested, self.request);
            if any_error(&chip.built.found) {
                self.unfit += 1;
                let is_room = chip.built.found.iter().any(|one| one.code == DOES_NOT_FIT);
                self.last = chip.built.found;
                let why = if is_room { Misfit::Room } else { Misfit::Other };
                return Ok(Fit::Misfit { part: at, why });
            }
            if let Some(misfit) = misfit(&chip) {
                self.unfit += 1;
                let message = format!("`{}` does not fit: {misfit}", requested.name);
                self.last = vec![Diagnostic::error(DOES_NOT_FIT, message)];
                return Ok(Fit::Misfit { part: at, why: Misfit::Room });
            }
            chips.push(chip);
        }
        let cpu = self.request.parts.len() - 1;
        let memory = match self.on_cpu(&division, &mut chips) {
            OnCpu::Linked(memory) => memory,
            OnCpu::Unwired(found) => {
                self.unfit += 1;
                self.lacks_pins |= found.iter().any(|one| one.code == PINS);
                self.last = found;
                return Ok(Fit::Misfit { part: cpu, why: Misfit::Link });
            }
        };
        if let Ok((memory, cpu)) = &memory
            && let Some(found) = memory.misfit(&self.cpu_name(), cpu)
        {
            self.unfit += 1;
            let excess = memory.excess(cpu).into_iter().map(|(_, need, have)| need - have).sum();
            if excess < self.least_excess {
                self.least_excess = excess;
                self.last = vec![found];
            }
            let part = self.request.parts.len() - 1;
            return Ok(Fit::Misfit { part, why: Misfit::Memory(*memory, cpu) });
        }
        let memory = memory.map(|(memory, _)| memory);
        let value = match self.request.objective {
            Objective::Cells => {
                let cells =
                    chips.iter().flat_map(|chip| &chip.built.chips).map(|it| it.cells.len());
                cells.map(|n| n as i64).sum()
            }
            Objective::Cycles | Objective::Pins | Objective::Latency => partition.evaluation.value,
        };
        let bound = i64::MIN;
        let (unfit, builds, cuts) = (0, 0, 0);
        self.value = Some(self.value.map_or(value, |best| best.min(value)));
        self.tell();
        let fitted =
            Fitted { partition, value, bound, division, chips, unfit, builds, cuts, memory };
        Ok(Fit::Fits(Box::new(fitted)))
    }

    fn cpu_name(&self) -> String {
        self.request.parts.last().map_or_else(String::new, |part| part.name.clone())
    }

    /// Builds the part on the CPU and its link. A part that cannot be built is reported after the search.
    fn on_cpu(&self, division: &Division, chips: &mut Vec<BuiltPart>) -> OnCpu {
        let (Some(requested), Some(part)) = (self.request.parts.last(), division.parts.last())
        else {
            return OnCpu::Linked(Err("there is no CPU".to_owned()));
        };
        let options = BuildOptions { prove: false, ..self.request.options.clone() };
        let request = Request { options: &options, ..*self.request };
        chips.push(build_cpu(self.net, &part.net, requested, &request));
        let Request { parts, stem, compile, .. } = *self.request;
        let linked = link_parts(self.net, (division, chips), parts, stem);
        let Some(built) = chips.pop() else {
            return OnCpu::Linked(Err("there is no CPU".to_owned()));
        };
        let linked = match linked {
            Ok(linked) => linked,
            Err(found) if found.iter().any(|one| [PINS, LINK].contains(&one.code)) => {
                return OnCpu::Unwired(found);
            }
            Err(found) => {
                let first = found.first().map(|one| one.message.clone());
                return OnCpu::Linked(Err(first.unwrap_or_default()));
            }
        };
        if self.has_plant
            && let Some(found) = crowded(self.net, division, &linked)
        {
            return OnCpu::Unwired(vec![found]);
        }
        let memory = memory(self.net, &built, &linked, compile);
        OnCpu::Linked(memory.map(|memory| (memory, linked.cpu)))
    }

    /// After a part did not fit the memory of the CPU, the CPU is offered less than the estimate for the groups of that part: by the needed share, and by at least an
    /// eighth.
    fn offer_less_memory(
        &self,
        spec: &mut PartSpec,
        nodes: &[usize],
        needed: &Memory,
        cpu: &'static Cpu,
    ) {
        for (at, need, have) in needed.excess(cpu) {
            let of = |group: &usize| {
                self.groups.groups.get(*group).map_or(0, |items| estimate(self.net, items)[at])
            };
            let used: u64 = nodes.iter().map(of).sum();
            let less = used - (used / 8).max(1).min(used);
            let share = used.saturating_mul(have) / need.max(1);
            spec.memory[at] = Some(less.min(share));
        }
    }
}

/// Exactly this partition.
fn whole(partition: &Partition) -> Exclusion {
    Exclusion::built(Forbidden::Decisions(partition.part.iter().copied().enumerate().collect()))
}

/// The decisions alone, for the solver.
fn forbidden(exclusions: &[Exclusion]) -> Vec<Forbidden> {
    exclusions.iter().map(|one| one.forbidden.clone()).collect()
}

/// Decisions of a placement for which a chip probably has too few macrocells.
fn too_much(specs: &[PartSpec], cells: &Cells<'_>, placement: &[PartIndex]) -> Vec<Forbidden> {
    let of = |(at, spec): (PartIndex, &PartSpec)| {
        let room = spec.cells.filter(|_| spec.is_chip)?;
        cells.too_much(at, placement, room).map(Forbidden::Decisions)
    };
    specs.iter().enumerate().filter_map(of).collect()
}

/// After a fit failed, the device is offered an eighth less than the estimates of that partition used, so that the search ends soon.
fn offer_less(spec: &mut PartSpec, part: usize, failed: &Partition) {
    for usage in &failed.evaluation.usage {
        let less = usage.used.saturating_sub((usage.used / 8).max(1));
        match usage.constraint {
            Constraint::Capacity { part: at, resource: 0 } if at == part => spec.cells = Some(less),
            Constraint::Pins { part: at } if at == part => spec.pins = Some(less),
            _ => {}
        }
    }
}
