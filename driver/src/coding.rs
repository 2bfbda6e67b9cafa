//! State encoding of a circuit, and the don't-cares of its equations: from the proved facts of a net.
//!
//! The steps of a sequential component of [`Facts`] can share a code; if the reachable situations are known and few, unreachable ones are don't-cares. All of
//! this applies to states between clocks, so a circuit with one micro-step per clock is left unchanged. Whatever is assumed here, the resulting text is read
//! back and proved equal to the net from power-up on.

use grafsynth_backend_pld::device::{Device, PowerUp};
use grafsynth_backend_pld::equations::Equations;
use grafsynth_backend_pld::{Dialect, EmitOptions, reset, too_small};
use grafsynth_ir::Gather;
use grafsynth_ir::facts::{Facts, is_active};
use grafsynth_ir::logic::{FlopId, Logic, PinRole};
use grafsynth_ir::net::{Net, StepId, StepKind};
use grafsynth_ir::program::Origin;
use grafsynth_logic::shared_times;
pub use grafsynth_logic::state_assignment::Encoding;
use grafsynth_logic::state_assignment::{self, Group, Room, TRIES};
use std::collections::BTreeMap;
use std::rc::Rc;

/// The requested encoding.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum EncodingChoice {
    /// The first of one-hot, zero-hot and compact that fits the device.
    #[default]
    Auto,
    /// This encoding.
    This(Encoding),
}

/// With more situations than this, unreachable ones are not used as don't-cares: the diagram of all situations would be part of each function's diagram.
const SITUATIONS: usize = 256;
/// With more situations than this, the exclusion of groups is not examined.
const MANY_SITUATIONS: usize = 1 << 14;

/// A circuit with the chosen codes and don't-cares.
#[derive(Debug, Clone)]
pub struct EncodedLogic {
    /// The circuit.
    pub logic: Logic,
    /// The encoding of its groups.
    pub encoding: Encoding,
    /// True if every illegal situation must return to the initial one.
    pub is_safe: bool,
    /// The number of steps without their own flip-flop.
    pub n_coded: usize,
    /// The number of unread inputs that get no pin because the device has too few.
    pub n_unread: usize,
    /// Why an earlier encoding in the order of [`EncodingChoice::Auto`] was not used: what the device lacks for it.
    pub why: Option<String>,
    /// The resources that the device lacks for one flip-flop for each step, if that encoding was tried.
    pub one_hot_lacks: Option<String>,
    /// True if steps that could share a timer have their own, because this is better for the device.
    pub has_own_timers: bool,
    /// The equations of the circuit in the language and for the device that it was encoded for, if they were made to see whether it fits.
    pub equations: Option<Rc<Equations>>,
}

/// The number of steps without their own flip-flop.
fn n_coded(logic: &Logic) -> usize {
    let is_step = |origin| matches!(origin, Origin::Step(_) | Origin::Region(_));
    logic.decoded.iter().filter(|bit| is_step(bit.holds.origin)).count()
}

/// The groups of mutually exclusive steps, by their flip-flops. They are sequential components (joined if they exclude each other), the registers of regions,
/// and single steps that are always active.
#[must_use]
pub fn groups(net: &Net, facts: &Facts, logic: &Logic) -> Vec<Group> {
    let flops = flops_of_steps(logic);
    let sets = sets(facts, MANY_SITUATIONS);
    let mut groups: Vec<(Vec<StepId>, Group)> = Vec::new();
    for component in facts.components.iter().filter(|component| component.steps.len() > 1) {
        let steps: Option<Vec<FlopId>> =
            component.steps.iter().map(|step| flops.get(step).copied()).collect();
        let Some(steps) = steps else { continue };
        let first = &net.steps[component.steps[0]];
        // If a group is a whole part of the chart, the group and its bits are named after the part.
        let part = &net.parts[first.part];
        let of_part = net.steps.values().filter(|step| step.part == first.part).count();
        let name = if of_part == component.steps.len() { &part.name } else { &first.name };
        let group = Group { name: name.text.clone(), steps, is_always: component.always };
        groups.push((component.steps.clone(), group));
    }
    if let Some(sets) = sets {
        join(&mut groups, sets);
        let is_in_one = |step: StepId| groups.iter().any(|(steps, _)| steps.contains(&step));
        let always: Vec<(Vec<StepId>, Group)> = (flops.iter())
            .filter(|(step, flop)| {
                let is_always = sets.iter().all(|set| is_active(set, **step));
                logic.flops[**flop].init && is_always && !is_in_one(**step)
            })
            .map(|(&step, &flop)| {
                let name = net.steps[step].name.text.clone();
                (vec![step], Group { name, steps: vec![flop], is_always: true })
            })
            .collect();
        groups.extend(always);
    }
    groups.into_iter().map(|(_, group)| group).chain(regions(net, logic)).collect()
}

/// The number of flip-flops of a compact group with this many steps.
fn n_bits(n_steps: usize, is_always: bool) -> u32 {
    (n_steps + usize::from(!is_always)).next_power_of_two().trailing_zeros()
}

/// Joins groups whose steps exclude each other, such as the inner states of mutually exclusive states, if a common code has fewer bits than the separate codes.
fn join(groups: &mut Vec<(Vec<StepId>, Group)>, sets: &[Vec<u64>]) {
    let mut at = 0;
    while at < groups.len() {
        let mut other = at + 1;
        while other < groups.len() {
            let (steps, group) = &groups[at];
            let (more, second) = &groups[other];
            let all: Vec<StepId> = steps.iter().chain(more).copied().collect();
            let n_active =
                |set: &Vec<u64>| all.iter().filter(|step| is_active(set, **step)).count();
            let is_always = sets.iter().all(|set| n_active(set) == 1);
            let before =
                n_bits(steps.len(), group.is_always) + n_bits(more.len(), second.is_always);
            if n_bits(all.len(), is_always) >= before || sets.iter().any(|set| n_active(set) > 1) {
                other += 1;
                continue;
            }
            let (_, second) = groups.remove(other);
            groups[at].0 = all;
            groups[at].1.steps.extend(second.steps);
            groups[at].1.is_always = is_always;
        }
        at += 1;
    }
}

/// The registers of regions: of the children of a state, at most one is set, whether the state is active or only recorded. Once entered, the register
/// of a state that a history records is never empty again; the register of a state inside it may be.
fn regions(net: &Net, logic: &Logic) -> Vec<Group> {
    let mut children: BTreeMap<StepId, Vec<FlopId>> = BTreeMap::new();
    for (step, flop) in flops_of(logic, region) {
        if let Some(parent) = net.steps[step].parent
            && net.steps[parent].kind == StepKind::Composite
        {
            children.entry(parent).or_default().push(flop);
        }
    }
    let of_parent = |(parent, steps): (StepId, Vec<FlopId>)| {
        let n_children = net.steps.values().filter(|step| step.parent == Some(parent)).count();
        let is_owner = net.histories.values().any(|history| history.owner == parent);
        let starts_entered = steps.iter().any(|flop| logic.flops[*flop].init);
        let is_always = starts_entered && is_owner && n_children == steps.len();
        Group { name: net.steps[parent].name.text.clone(), steps, is_always }
    };
    children.into_iter().filter(|(_, steps)| steps.len() > 1).map(of_parent).collect()
}

/// The child of a region that a bit of its register represents.
fn region(origin: Origin) -> Option<StepId> {
    if let Origin::Region(step) = origin { Some(step) } else { None }
}

/// The flip-flops that represent single steps.
fn flops_of_steps(logic: &Logic) -> BTreeMap<StepId, FlopId> {
    flops_of(logic, |origin| if let Origin::Step(step) = origin { Some(step) } else { None })
}

/// Flip-flops by their steps; a step with several flip-flops (a counter of its activity) is not included.
fn flops_of(logic: &Logic, step_of: impl Fn(Origin) -> Option<StepId>) -> BTreeMap<StepId, FlopId> {
    let mut held: BTreeMap<StepId, Vec<FlopId>> = BTreeMap::new();
    for (id, flop) in logic.flops.iter() {
        if let Some(holds) = flop.holds.filter(|holds| !holds.inverted)
            && let Some(step) = step_of(holds.origin)
        {
            held.entry(step).or_default().push(id);
        }
    }
    held.into_iter()
        .filter(|(_, flops)| flops.len() == 1)
        .map(|(step, all)| (step, all[0]))
        .gather()
}

/// The reachable situations, if all of them are known and there are at most `most`.
fn sets(facts: &Facts, most: usize) -> Option<&[Vec<u64>]> {
    let reach = facts.reach.as_ref().filter(|reach| reach.exact)?;
    reach.sets.as_deref().filter(|sets| sets.len() <= most)
}

/// A cache of encodings: the search for an encoding does not depend on the device, except for its macrocells. Valid for one net with its
/// facts and its circuit.
#[derive(Debug, Clone, Default)]
pub struct EncodingCache {
    /// The encoded circuits, by encoding, number of tried assignments, safety, and number of omitted inputs.
    made: BTreeMap<(Encoding, usize, bool, usize), EncodedLogic>,
    /// The cache of the circuit with a timer for each step.
    own_timers: Option<Box<EncodingCache>>,
    /// The results of searches for given devices, by the product terms of the macrocells, polarity, and number of omitted inputs.
    within: BTreeMap<(Vec<usize>, bool, usize), Option<Logic>>,
    /// The work of the searches for given devices so far.
    work: usize,
}

impl EncodingCache {
    /// True if the search for an encoding that fits a device reached its limit, so another encoding may still fit.
    #[must_use]
    pub fn is_spent(&self) -> bool {
        self.work >= MOST_WORK
    }
}

/// The limit for the total work of searches for codes that fit a device, as [`state_assignment::recode_within`] counts it: a few seconds.
const MOST_WORK: usize = 50_000_000;

/// Encodes the steps for a language and a device.
#[must_use]
pub fn code(
    net: &Net,
    facts: &Facts,
    logic: &Logic,
    choice: EncodingChoice,
    safe: bool,
    dialect: Dialect,
    options: &EmitOptions,
) -> EncodedLogic {
    let (known, asked) = (&mut EncodingCache::default(), (choice, safe));
    code_knowing(known, net, facts, logic, asked, dialect, options)
}

/// Like [`code`], for one of several devices: results for other devices are reused. `choice` is the requested encoding; with `safe`, every illegal situation
/// must return to the initial one.
#[must_use]
pub fn code_knowing(
    cache: &mut EncodingCache,
    net: &Net,
    facts: &Facts,
    logic: &Logic,
    (choice, safe): (EncodingChoice, bool),
    dialect: Dialect,
    options: &EmitOptions,
) -> EncodedLogic {
    let heard = heard(logic, dialect, options);
    let n_unread = heard.as_ref().map_or(0, |heard| logic.inputs.len() - heard.inputs.len());
    let logic = heard.as_ref().unwrap_or(logic);
    let groups = groups(net, facts, logic);
    if logic.outputs.values().any(|output| output.role == PinRole::Busy) {
        return EncodedLogic::new(logic.clone(), Encoding::OneHot, n_unread, safe);
    }
    let situations = Situations::of(net, facts, logic);
    let mut known = logic.clone();
    if let Some(situations) = &situations {
        state_assignment::only(&mut known, &situations.flops, &situations.values);
    }
    if !safe {
        // Under `--safe`, these states would have to lead to the initial situation.
        let idle = shared_times::idle(&mut known);
        known.unreachable.extend(idle);
    }
    let coder = Coder { net, logic, known, groups, situations, n_unread, safe };
    match choice {
        EncodingChoice::This(encoding) => coder.made(cache, encoding, TRIES),
        EncodingChoice::Auto => coder.first_that_fits(cache, dialect, options),
    }
}

/// A circuit in which steps share timers, and the same circuit with a timer for each step, if it differs.
#[derive(Clone, Copy)]
pub struct Timed<'a> {
    /// The circuit with shared timers.
    pub logic: &'a Logic,
    /// The circuit with a timer for each timed step.
    pub own_timers: Option<&'a Logic>,
}

/// Like [`code_knowing`], with a choice of timers. Netlists share timers, which takes fewer flip-flops. On a device the form that fits is used; of two that
/// fit, the one with fewer product terms; of two that do not fit, the one with fewer flip-flops.
#[must_use]
pub fn code_timed(
    cache: &mut EncodingCache,
    net: &Net,
    facts: &Facts,
    timed: Timed<'_>,
    asked: (EncodingChoice, bool),
    dialect: Dialect,
    options: &EmitOptions,
) -> EncodedLogic {
    let mut shared = code_knowing(cache, net, facts, timed.logic, asked, dialect, options);
    let Some(own) = timed.own_timers.filter(|_| dialect.is_flat()) else { return shared };
    let mut inner = cache.own_timers.take().unwrap_or_default();
    inner.work = cache.work;
    let mut own = code_knowing(&mut inner, net, facts, own, asked, dialect, options);
    cache.work = inner.work;
    cache.own_timers = Some(inner);
    own.has_own_timers = true;
    match (shared.n_terms(dialect, options), own.n_terms(dialect, options)) {
        (None, Some(_)) => own,
        (Some(of_shared), Some(of_own)) if of_own < of_shared => own,
        _ => shared,
    }
}

/// The circuit without the inputs that nothing reads, if the device has too few pins for all of its signals.
fn heard(logic: &Logic, dialect: Dialect, options: &EmitOptions) -> Option<Logic> {
    let device = device_of(options).filter(|_| dialect.is_flat())?;
    // The clock and the supplies have pins too.
    let n_inputs = logic.inputs.len() + usize::from(options.reset_wire.is_some());
    let n_signals = n_inputs + logic.outputs.len() + logic.flops.len() + 3;
    (n_signals > device.n_pins as usize)
        .then(|| grafsynth_logic::build::without_unread_inputs(logic.clone()))
}

impl EncodedLogic {
    /// A circuit that was not fitted yet.
    fn new(logic: Logic, encoding: Encoding, n_unread: usize, is_safe: bool) -> Self {
        let n_coded = n_coded(&logic);
        EncodedLogic {
            logic,
            encoding,
            is_safe,
            n_coded,
            n_unread,
            why: None,
            one_hot_lacks: None,
            has_own_timers: false,
            equations: None,
        }
    }

    /// The circuit to emit: if it must return from every illegal state, these must not be used as don't-cares.
    #[must_use]
    pub fn emitted(&self) -> Logic {
        let mut logic = self.logic.clone();
        if self.is_safe {
            logic.unreachable.clear();
        }
        logic
    }

    /// That circuit with the reset input of the options, if they want one.
    pub(crate) fn with_reset(logic: Logic, options: &EmitOptions) -> Logic {
        match &options.reset_wire {
            Some(name) => reset::add(logic, name),
            None => logic,
        }
    }
}

/// Makes the encodings of one circuit.
struct Coder<'a> {
    net: &'a Net,
    logic: &'a Logic,
    /// The circuit with its unreachable situations.
    known: Logic,
    groups: Vec<Group>,
    situations: Option<Situations>,
    n_unread: usize,
    safe: bool,
}

impl Coder<'_> {
    /// The circuit in an encoding.
    fn made(&self, cache: &mut EncodingCache, encoding: Encoding, tries: usize) -> EncodedLogic {
        let key = (encoding, tries, self.safe, self.n_unread);
        if let Some(coded) = cache.made.get(&key) {
            return coded.clone();
        }
        let mut logic = state_assignment::recode(&self.known, &self.groups, encoding, tries);
        let n_flops = logic.flops.len();
        if let Some(flat) = self.flat(n_flops, tries).filter(|_| encoding == Encoding::Compact) {
            logic = flat;
        }
        let coded = self.finished(logic, encoding);
        cache.made.insert(key, coded.clone());
        coded
    }

    /// A circuit with one code for whole situations, if it has fewer than `n_flops` flip-flops.
    fn flat(&self, n_flops: usize, tries: usize) -> Option<Logic> {
        let situations = self.situations.as_ref()?;
        if situations.n_bits() + self.known.flops.len() >= n_flops + situations.flops.len() {
            return None;
        }
        let (values, name) = (situations.whole()?, &self.net.name.text);
        let flat = state_assignment::flatten(&self.known, name, &situations.flops, &values, tries)?;
        (flat.flops.len() < n_flops).then_some(flat)
    }

    fn finished(&self, logic: Logic, encoding: Encoding) -> EncodedLogic {
        let n_coded = n_coded(&logic);
        let logic = if self.safe { state_assignment::safe(logic) } else { logic };
        EncodedLogic { n_coded, ..EncodedLogic::new(logic, encoding, self.n_unread, self.safe) }
    }

    /// The first encoding that fits the device, in the order of [`EncodingChoice::Auto`]; otherwise one-hot.
    fn first_that_fits(
        &self,
        cache: &mut EncodingCache,
        dialect: Dialect,
        options: &EmitOptions,
    ) -> EncodedLogic {
        let mut one_hot = self.made(cache, Encoding::OneHot, 0);
        if !dialect.is_flat() || self.groups.is_empty() {
            return one_hot;
        }
        let Err(lacks) = one_hot.fit(dialect, options) else { return one_hot };
        one_hot.one_hot_lacks = Some(lacks.clone());
        let chosen = |coded: EncodedLogic, why: String| EncodedLogic {
            why: Some(why),
            one_hot_lacks: one_hot.one_hot_lacks.clone(),
            ..coded
        };
        let mut why = does_not_fit(Encoding::OneHot, &lacks);
        for encoding in [Encoding::ZeroHot, Encoding::Compact] {
            let is_whole = encoding == Encoding::Compact && self.may_fit_whole(options);
            if !is_whole && !may_fit(self.logic, &self.groups, encoding, options) {
                continue;
            }
            let mut coded = self.made(cache, encoding, TRIES);
            match coded.fit(dialect, options) {
                Ok(()) => return chosen(coded, why),
                Err(lacks) => why = does_not_fit(encoding, &lacks),
            }
        }
        let within = self.within(cache, options).map(|logic| {
            let mut coded = self.finished(logic, Encoding::Compact);
            coded.fit(dialect, options).map(|()| coded)
        });
        match within {
            Some(Ok(coded)) => chosen(coded, why),
            Some(Err(_)) | None => one_hot,
        }
    }

    /// True if a code for whole situations has few enough flip-flops for the device.
    fn may_fit_whole(&self, options: &EmitOptions) -> bool {
        self.situations.as_ref().is_some_and(|situations| {
            let n_others = self.known.flops.len().saturating_sub(situations.flops.len());
            n_others + situations.n_bits() <= device_of(options).map_or(0, Device::n_cells)
        })
    }

    /// Codes that fit the product terms of the macrocells: if there are enough pins but too few product terms, other codes for the steps may still fit. Devices
    /// with logic blocks are not tried: what they lack is usually inputs, not terms.
    fn within(&self, cache: &mut EncodingCache, options: &EmitOptions) -> Option<Logic> {
        if !may_fit(self.logic, &self.groups, Encoding::Compact, options) {
            return None;
        }
        let device = device_of(options).filter(|device| device.blocks.is_none())?;
        let room = room(device, &self.known);
        let EncodingCache { within, work, .. } = cache;
        let key = (room.terms.clone(), room.is_by_power_up, self.n_unread);
        let found = within.entry(key).or_insert_with(|| {
            let mut left = MOST_WORK.saturating_sub(*work);
            let (known, groups) = (&self.known, &self.groups);
            let found =
                state_assignment::recode_within(known, groups, &room, MORE_TRIES, &mut left);
            *work = MOST_WORK - left;
            found
        });
        found.clone()
    }
}

/// The number of assignments that are tried if no ordinary encoding fits the device.
pub const MORE_TRIES: usize = 2_000;

fn device_of(options: &EmitOptions) -> Option<&'static Device> {
    options.device.as_deref().map_or(Some(Device::default_device()), Device::find)
}

/// The macrocells that a device has for the sums of a circuit: those whose pins are not needed for inputs. Inputs use the narrowest
/// macrocells.
fn room(device: &Device, logic: &Logic) -> Room {
    let mut terms: Vec<usize> = (device.macrocells.iter())
        .map(|cell| cell.registered_terms.max(cell.combinational_terms) as usize)
        .collect();
    terms.sort_unstable_by(|a, b| b.cmp(a));
    let n_pins = device.n_pins as usize - 2;
    // The clock has a pin too.
    let n_left = n_pins.saturating_sub(logic.inputs.len() + 1);
    terms.truncate(n_left);
    Room { terms, is_by_power_up: device.power_up == PowerUp::ByPolarity }
}

impl EncodedLogic {
    /// The number of product terms if the design fits the device.
    fn n_terms(&mut self, dialect: Dialect, options: &EmitOptions) -> Option<usize> {
        if self.equations.is_none() {
            self.fit(dialect, options).ok()?;
        }
        let made = self.equations.as_ref().filter(|made| made.has_pins)?;
        Some(made.equations.iter().map(|equation| equation.products.len()).sum())
    }

    /// Makes the equations for a language, unless counting shows that the device is too small. The error is what the device lacks.
    fn fit(&mut self, dialect: Dialect, options: &EmitOptions) -> Result<(), String> {
        let logic = EncodedLogic::with_reset(self.emitted(), options);
        if let Some(lack) = too_small(&logic, options) {
            return Err(lack);
        }
        let made = Rc::new(Equations::open(&logic, dialect, options).map_err(|found| {
            found.into_iter().next().map_or_else(String::new, |finding| finding.message)
        })?);
        self.equations = Some(made.clone());
        if made.has_pins { Ok(()) } else { Err(made.lacks.join("; ")) }
    }
}

fn does_not_fit(encoding: Encoding, lacks: &str) -> String {
    format!("{} does not fit: {lacks}", encoding_name(encoding))
}

/// The name of an encoding on the command line.
pub(crate) fn encoding_name(encoding: Encoding) -> &'static str {
    match encoding {
        Encoding::OneHot => "one-hot",
        Encoding::ZeroHot => "zero-hot",
        Encoding::Compact => "compact",
    }
}

/// Whether there are enough pins and flip-flops, so that it is worth minimising sums.
fn may_fit(logic: &Logic, groups: &[Group], encoding: Encoding, options: &EmitOptions) -> bool {
    let Some(device) = device_of(options) else { return false };
    let saved: usize = groups
        .iter()
        .map(|group| match encoding {
            Encoding::OneHot => 0,
            Encoding::ZeroHot => usize::from(group.is_always),
            Encoding::Compact => group
                .steps
                .len()
                .saturating_sub(n_bits(group.steps.len(), group.is_always) as usize),
        })
        .sum();
    // An output may be a flip-flop, so the larger number is a lower bound.
    let n_cells = logic.flops.len().saturating_sub(saved).max(logic.outputs.len());
    // If not every macrocell has a pin, only outputs and inputs need pins.
    let n_pins = device.blocks.map_or(n_cells, |_| logic.outputs.len()) + logic.inputs.len();
    n_cells <= device.n_cells() && n_pins < device.n_pins as usize
}

/// The reachable situations as values of flip-flops, if they are known and few and every step has a flip-flop.
struct Situations {
    flops: Vec<FlopId>,
    /// For each situation the value of each flip-flop; `None` if the register of an inactive region may have any value.
    values: Vec<Vec<Option<bool>>>,
}

impl Situations {
    fn of(net: &Net, facts: &Facts, logic: &Logic) -> Option<Situations> {
        let sets = sets(facts, SITUATIONS)?;
        let plain = flops_of_steps(logic);
        let gated = flops_of(logic, region);
        // Each flip-flop, with the state that must be active for its value to matter.
        let mut flops: Vec<(FlopId, StepId, Option<StepId>)> = Vec::new();
        for (step, data) in net.steps.iter() {
            match (plain.get(&step), gated.get(&step)) {
                (Some(flop), _) => flops.push((*flop, step, None)),
                (None, Some(flop)) => flops.push((*flop, step, Some(data.parent?))),
                (None, None) => return None,
            }
        }
        if flops.len() > 64 {
            return None;
        }
        let of_set = |set: &Vec<u64>| {
            let value = |&(_, step, within): &(FlopId, StepId, Option<StepId>)| {
                within.is_none_or(|within| is_active(set, within)).then(|| is_active(set, step))
            };
            flops.iter().map(value).collect()
        };
        let values = sets.iter().map(of_set).collect();
        Some(Situations { flops: flops.into_iter().map(|(flop, ..)| flop).collect(), values })
    }

    /// The minimum number of bits that distinguish the situations.
    fn n_bits(&self) -> usize {
        self.values.len().next_power_of_two().trailing_zeros() as usize
    }

    /// The values of all flip-flops, if they are defined in every situation.
    fn whole(&self) -> Option<Vec<Vec<bool>>> {
        self.values.iter().map(|values| values.iter().copied().collect()).collect()
    }
}
