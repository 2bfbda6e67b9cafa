//! Parts that run on their own (semantics §10.7): what is proved of them holds at all speeds of their clocks, what is refuted is a race, and a link that is spoiled is not
//! accepted.

#![allow(clippy::print_stdout, reason = "tests report what they did")]

use grafsynth_backend_pld::fuse;
use grafsynth_driver::pipeline::{self, BuildOptions, logic, synchronised};
use grafsynth_driver::report::chip::Kind;
use grafsynth_driver::split::{
    Item, Objective, PartDevice, Request, RequestedPart, link as wired, split,
};
use grafsynth_driver::stem::FileStem;
use grafsynth_ir::Valid;
use grafsynth_ir::division::{Division, PartNet, Running, Shown, Source};
use grafsynth_ir::logic::{Logic, PinRole};
use grafsynth_ir::net::{InputId, Net, OutputId};
use grafsynth_logic::sim::LogicSim;
use grafsynth_sim::{InputRow, Random, Simulator, measures_time, seen};
use grafsynth_split::cpu::HOST;
use grafsynth_split::link::{
    Act, ChipPins, ChipSignal, CpuNames, Link, Object, Request as LinkRequest, SYNCHRONISERS,
    Start, Timing, check, link,
};
use grafsynth_split::{divide, together};
use grafsynth_tests::{chart, rounds};
use grafsynth_verify::verdict::Verdict;
use grafsynth_verify::{Limits, Race, Settled, settles};
use std::collections::{BTreeMap, BTreeSet};

mod replay;
mod runs;

use runs::Episode;

/// The division of a net into chips and a CPU; `on_chip` gives the chip of a step or output, by name.
fn divided(net: &Valid<Net>, names: &[&str], place: impl Fn(&str) -> Option<usize>) -> Division {
    let groups = together(net, Running::Free).expect("it can be split");
    let cpu = names.len() - 1;
    let of = |items: &Vec<Item>| {
        let name = |item: &Item| match item {
            Item::Step(id) => place(&net.steps[*id].name.text),
            Item::Output(id) => place(&net.outputs[*id].name.text),
            _ => None,
        };
        items.iter().find_map(name).unwrap_or(cpu)
    };
    let parts: Vec<usize> = groups.groups.iter().map(of).collect();
    let owners = grafsynth_split::partition::owners(net, &groups, &parts);
    let names: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    divide(net, &groups, owners, &names, &[]).expect("it can be divided")
}

/// The chart with the steps and outputs of these names on a chip.
fn verdict(text: &str, chip: &[&str]) -> Verdict<Settled, Race> {
    let (net, division) = on_chip(text, chip);
    settles(&net, &division, &Limits::default())
}

fn on_chip(text: &str, chip: &[&str]) -> (Valid<Net>, Division) {
    let net = chart("c.graf", text);
    let division = divided(&net, &["chip", "cpu"], |name| chip.contains(&name).then_some(0));
    (net, division)
}

fn refused(text: &str, chip: &[&str]) -> (String, Vec<String>) {
    let (net, division) = on_chip(text, chip);
    match settles(&net, &division, &Limits::default()) {
        Verdict::Refuted(race) => (race.what(&net), race.trace(&net, &division)),
        other => panic!("{other:?}"),
    }
}

/// Each of two parts reads an input for itself, and a third step needs both at the same moment: with a delay, it becomes active although it never is in the chart.
#[test]
fn an_input_of_two_parts_arrives_at_different_moments() {
    let (what, trace) = refused(
        "chart c { input a initial step p step p2 step z initial step q step q2
            p -> p2 when a  q -> q2 when a  p2 -> z when q.active }",
        &["p", "p2", "z"],
    );
    assert_eq!(what, "step `p2` becomes inactive, unlike in the chart");
    assert_eq!(
        trace,
        [
            "`chip` reacts, reads active_q 1",
            "input `a` becomes 1",
            "`chip` reacts, reads a 1: step `p` 0, step `p2` 1",
            "`chip` reacts: step `p2` 0, step `z` 1"
        ]
    );
}

#[test]
fn a_request_with_an_answer_is_the_same_at_all_speeds() {
    let with_answer = "chart c { input go, stop output M, B initial step off step on { M if not stop }
        off -> on when run.active  on -> off when not run.active
        initial step idle step run { B } step ready
        idle -> run when go  run -> ready when on.active  ready -> idle when not go and not on.active }";
    let Verdict::Proved(settled) = verdict(with_answer, &["off", "on", "M"]) else { panic!() };
    assert_eq!((settled.rests, settled.has_time), (4, false), "{settled:?}");
    // Without the answer, the CPU can be there and back before the chip has noticed.
    let without = with_answer.replace("when on.active", "").replace(" and not on.active", "");
    let (what, _) = refused(&without, &["off", "on", "M"]);
    assert!(what.contains("unlike in the chart") || what.contains("does not become"), "{what}");
}

#[test]
fn a_pulse_can_be_missed() {
    let (what, trace) = refused(
        "chart c { input a initial step p step q initial step r step s
            p -> q when rise(a)  q -> p  r -> s when q.active }",
        &["r", "s"],
    );
    assert_eq!(what, "step `r` does not become 0, as it does in the chart");
    assert_eq!(trace.last().map(String::as_str), Some("`chip` reacts, reads active_q 0"));
}

#[test]
fn charts_and_parts_that_do_not_come_to_rest_are_refused() {
    let (what, _) =
        refused("chart c { initial step p step q initial step r p -> q q -> p }", &["r"]);
    assert_eq!(what, "the chart itself does not come to rest");
}

#[test]
fn ticks_may_pass_in_between() {
    let text = "chart c { tick 10 ms input go output M, T initial step off step on { M }
        off -> on when run.active  on -> off when not run.active
        initial step idle step run step late { T }
        idle -> run when go and off.active  run -> late when run.t >= 30 ms and on.active
        late -> idle when not go }";
    let Verdict::Proved(settled) = verdict(text, &["off", "on", "M"]) else {
        panic!("{:?}", verdict(text, &["off", "on", "M"]))
    };
    assert!(settled.has_time, "{settled:?}");
}

#[test]
fn asserts_over_several_parts_hold_at_every_moment() {
    let text = |more: &str| {
        format!(
            "chart c {{ input a output X, Y initial step p {{ X }} step p2 initial step q step q2 {{ Y }}
                p -> p2 when a  q -> q2 when p2.active
                p2 -> p when not a{more}  q2 -> q when not p2.active  assert never (X and Y) }}"
        )
    };
    // p may be active again before q2 is left.
    let (what, _) = refused(&text(" and q2.active"), &["q", "q2", "Y"]);
    assert_eq!(what, "an assert does not hold");
}

#[test]
fn inputs_that_cannot_change_alone_are_open() {
    let text = "chart c { input a, b initial step p step q initial step r step s
        assume never (a and not b)  assume never (b and not a)
        p -> q when a  r -> s when q.active }";
    let Verdict::Open(open) = verdict(text, &["r", "s"]) else { panic!() };
    assert!(open.to_string().contains("can never change alone"), "{open}");
}

/// The part whose cycle a step, transition or output of a random chart belongs to.
pub(crate) fn part_of_name(name: &str) -> Option<usize> {
    name.trim_start_matches(['s', 'O']).split('_').next()?.parse::<usize>().ok()
}

/// A random chart of two or three cycles that read each other's steps, some with the pattern of request and answer.
pub(crate) fn random_text(random: &mut Random) -> (String, usize) {
    let n_parts = 2 + random.below(2);
    let lengths: Vec<usize> = (0..n_parts).map(|_| 2 + random.below(2)).collect();
    let has_time = random.below(3) == 0;
    let mut text = String::from("chart c {\n    tick 10 ms\n");
    if random.below(4) == 0 {
        text += "    evolution stable limit 8\n";
    }
    text += "    input i0, i1, i2\n";
    let mut outputs = Vec::new();
    let mut body = String::new();
    for (part, length) in lengths.iter().enumerate() {
        let foreign = |random: &mut Random| {
            let other = (part + 1 + random.below(n_parts - 1)) % n_parts;
            let step = format!("s{other}_{}.active", random.below(lengths[other]));
            if random.below(3) == 0 { format!("not {step}") } else { step }
        };
        for step in 0..*length {
            let action = match random.below(4) {
                0 => String::new(),
                n => {
                    outputs.push(format!("O{part}_{step}"));
                    let condition = match n {
                        1 => format!(" if i{}", random.below(3)),
                        2 if random.below(3) == 0 => format!(" if {}", foreign(random)),
                        _ => String::new(),
                    };
                    format!(" {{ O{part}_{step}{condition} }}")
                }
            };
            let initial = if step == 0 { "initial " } else { "" };
            body += &format!("    {initial}step s{part}_{step}{action}\n");
        }
        for step in 0..*length {
            let next = (step + 1) % length;
            let input = format!("{}i{}", ["", "not "][random.below(2)], random.below(3));
            let receptivity = match random.below(8) {
                0 => input,
                1 => format!("rise({input})"),
                2 => format!("{input} and {}", foreign(random)),
                3 if has_time && part + 1 == n_parts => format!("s{part}_{step}.t >= 20 ms"),
                // Request and answer: the same step of the next part.
                4..=6 => {
                    let other = (part + 1) % n_parts;
                    format!("s{other}_{}.active", step.min(lengths[other] - 1))
                }
                _ => foreign(random),
            };
            body += &format!("    s{part}_{step} -> s{part}_{next} when {receptivity}\n");
        }
    }
    if !outputs.is_empty() {
        text += &format!("    output {}\n", outputs.join(", "));
    }
    (text + &body + "}\n", n_parts)
}

/// The division of a random chart: each cycle on its own part.
pub(crate) fn random_division(net: &Valid<Net>, n_parts: usize) -> Division {
    let names = ["one", "two", "three"];
    let mut names = names[..n_parts - 1].to_vec();
    names.push("cpu");
    let of = |name: &str| {
        let part = part_of_name(name)?;
        (part + 1 < n_parts).then_some(part)
    };
    divided(net, &names, of)
}

/// A part with what it shows, as the co-simulation sees it.
enum Piece<'a> {
    Chip { sim: Box<LogicSim<'a>>, logic: &'a Logic },
    Cpu(Box<Simulator<'a>>),
}

impl<'a> Piece<'a> {
    /// The parts after reset: chips as these circuits, the CPU as its net.
    fn all(division: &'a Division, circuits: &'a [Logic]) -> Vec<Self> {
        let chips = circuits.iter().map(|logic| {
            let mut sim = Box::new(LogicSim::new(logic));
            sim.reset();
            Piece::Chip { sim, logic }
        });
        let mut simulator = Simulator::new(&division.parts[circuits.len()].net);
        simulator.reset();
        chips.chain([Piece::Cpu(Box::new(simulator))]).collect()
    }

    /// Makes one reaction with these values at the pins. Returns the outputs after it.
    fn react(
        &mut self,
        of_part: &PartNet,
        values: Vec<i64>,
        tick: bool,
    ) -> BTreeMap<OutputId, i64> {
        match self {
            Piece::Cpu(simulator) => {
                let row = simulator.step(&InputRow { dt: u32::from(tick), values });
                of_part.net.outputs.ids().zip(row.outputs.iter().copied()).collect()
            }
            Piece::Chip { sim, logic } => {
                for (pin, input) in logic.inputs.iter() {
                    let PinRole::Input(id, _) = input.role else { panic!("no tick on a chip") };
                    sim.set_input(pin, values[id.index()] as u64 & 1);
                }
                sim.clock();
                let outputs = logic.outputs.iter().filter_map(|(pin, output)| match output.role {
                    PinRole::Output(id, _) => Some((id, pin)),
                    _ => None,
                });
                outputs.map(|(id, pin)| (id, (sim.output(pin) & 1) as i64)).collect()
            }
        }
    }
}

impl Piece<'_> {
    /// True for a circuit that needs more clocks for its reaction.
    fn is_busy(&mut self) -> bool {
        let Piece::Chip { sim, logic } = self else { return false };
        let mut busy = logic.outputs.iter().filter(|(_, output)| output.role == PinRole::Busy);
        busy.any(|(pin, _)| sim.output(pin) & 1 == 1)
    }
}

/// The circuits of the chips, with the flip-flops that synchronise their inputs.
fn circuits(division: &Division) -> Vec<Logic> {
    let chips = division.parts.iter().take(division.parts.len() - 1);
    let circuit = |part: &PartNet| {
        let facts = pipeline::facts(&part.net, &Limits::default());
        let circuit = logic(&part.net, &facts).expect("it has a circuit");
        synchronised(&part.net, circuit, SYNCHRONISERS as u32).0
    };
    chips.map(circuit).collect()
}

/// A value that may have changed so recently that a flip-flop stores the old one or the new one.
#[derive(Clone, Copy, Default)]
struct Level {
    old: i64,
    new: i64,
    since: u64,
}

/// The parts with clocks of random speeds: chips as circuits with their synchronisers, the CPU as its net.
struct Bench<'a> {
    net: &'a Valid<Net>,
    division: &'a Division,
    pieces: Vec<Piece<'a>>,
    periods: Vec<u64>,
    next: Vec<u64>,
    inputs: BTreeMap<InputId, Level>,
    /// For each wire, by its index.
    wires: Vec<Level>,
    /// The values that each output took, and the times at which ticks are due.
    sequences: Vec<Vec<i64>>,
    tick_left: bool,
    now: u64,
}

impl<'a> Bench<'a> {
    fn new(
        net: &'a Valid<Net>,
        division: &'a Division,
        circuits: &'a [Logic],
        random: &mut Random,
    ) -> Self {
        let cpu = division.parts.len() - 1;
        let pieces = Piece::all(division, circuits);
        let mut periods: Vec<u64> = (0..cpu).map(|_| 2 + random.below(12) as u64).collect();
        periods.push(2 + random.below(40) as u64);
        let next = periods.iter().map(|period| 1 + random.below(*period as usize) as u64).collect();
        let level = |value: i64| Level { old: value, new: value, since: 0 };
        let step = |signal: &grafsynth_ir::division::Signal| match signal {
            grafsynth_ir::division::Signal::Active(step) => i64::from(net.steps[*step].is_initial),
            grafsynth_ir::division::Signal::Fires(_) => 0,
        };
        let mut whole = Simulator::new(net);
        let sequences = whole.reset().outputs.iter().map(|value| vec![*value]).collect();
        Bench {
            net,
            division,
            pieces,
            periods,
            next,
            inputs: net.inputs.ids().map(|id| (id, level(0))).collect(),
            wires: division.wires.iter().map(|wire| level(step(&wire.signal))).collect(),
            sequences,
            tick_left: false,
            now: 0,
        }
    }

    /// What a part reads now from a source.
    fn read(&self, source: Source, random: &mut Random) -> i64 {
        let level = match source {
            Source::Input(id) => self.inputs[&id],
            Source::Wire(signal) => {
                let at = self.division.wires.iter().position(|wire| wire.signal == signal);
                self.wires[at.expect("it is there")]
            }
            Source::Direct(_) | Source::More => unreachable!("only rounds have it"),
        };
        if self.now <= level.since && random.below(2) == 0 { level.old } else { level.new }
    }

    /// Runs until a time.
    fn run(&mut self, until: u64, random: &mut Random) {
        while self.now < until {
            self.now += 1;
            let mut due: Vec<usize> =
                (0..self.pieces.len()).filter(|part| self.next[*part] <= self.now).collect();
            while !due.is_empty() {
                let part = due.swap_remove(random.below(due.len()));
                self.react(part, random);
                // The program of a CPU does not need the same time for each reaction.
                let jitter = if part + 1 == self.pieces.len() { random.below(3) as u64 } else { 0 };
                self.next[part] = self.now + self.periods[part] + jitter;
            }
        }
    }

    fn react(&mut self, part: usize, random: &mut Random) {
        let division = self.division;
        let of_part = &division.parts[part];
        let values: Vec<i64> =
            of_part.inputs.values().map(|source| self.read(*source, random)).collect();
        let tick = part + 1 == self.pieces.len() && std::mem::take(&mut self.tick_left);
        let shown = self.pieces[part].react(of_part, values, tick);
        for (own, shown_as) in of_part.outputs.iter() {
            let value = shown[&own];
            match shown_as {
                Shown::Output(id) => {
                    let all = &mut self.sequences[id.index()];
                    if all.last() != Some(&value) {
                        all.push(value);
                    }
                }
                Shown::Wire(signal) => {
                    let at = division.wires.iter().position(|wire| wire.signal == *signal);
                    let level = &mut self.wires[at.expect("it is there")];
                    if level.new != value {
                        *level = Level { old: level.new, new: value, since: self.now };
                    }
                }
                Shown::Moves => panic!("parts of their own show no moves"),
            }
        }
    }
}

/// The first difference between parts at random speeds and the net, in a number of episodes.
fn difference(
    net: &Valid<Net>,
    division: &Division,
    settled: &Settled,
    (seed, episodes): (u64, usize),
) -> Option<String> {
    let circuits = circuits(division);
    let mut random = Random::new(seed);
    let mut bench = Bench::new(net, division, &circuits, &mut random);
    let slowest = bench.periods.iter().map(|period| period * 4 + 4).max().expect("there are parts");
    let gap = 2 * slowest * settled.longest.max(1) as u64;
    let mut whole = Simulator::new(net);
    let mut start = seen(&whole.reset(), net.steps.len());
    // Each state in which the net can be, as far as the outputs show it.
    let mut states = vec![whole.state().clone()];
    let (mut episode, mut row) = (Episode::default(), InputRow { dt: 0, ..InputRow::zero(net) });
    for count in 0..=episodes {
        bench.run(bench.now + gap, &mut random);
        let mut runs = Vec::new();
        for state in &states {
            // A chart that was refuted may also move without an end.
            runs.extend(episode.runs(net, state, (&row, &start))?);
        }
        let n_outputs = net.outputs.len();
        let got: Vec<Vec<i64>> =
            bench.sequences.iter_mut().map(|all| all.drain(1..).collect()).collect();
        for (all, got) in bench.sequences.iter_mut().zip(&got) {
            all[0] = *got.last().unwrap_or(&all[0]);
        }
        let want: Vec<_> = runs.iter().map(|(changes, _)| changes[..n_outputs].to_vec()).collect();
        runs.retain(|(changes, _)| changes[..n_outputs] == got);
        if runs.is_empty() {
            return Some(format!("episode {count}: {got:?}, in the chart {want:?}"));
        }
        for (value, changes) in start.iter_mut().zip(&runs[0].0) {
            *value = *changes.last().unwrap_or(value);
        }
        states = runs.into_iter().map(|(_, state)| state).collect();
        states.sort();
        states.dedup();
        if let Some((input, value)) = episode.change {
            row = row.with(input, value);
        }
        // A change, a tick, or both at about the same time.
        let kind = if settled.has_time { random.below(4) } else { 0 };
        episode = Episode { change: None, has_tick: kind > 1 };
        bench.tick_left = episode.has_tick;
        if kind != 2 {
            let ids: Vec<InputId> = bench.net.inputs.ids().collect();
            let id = ids[random.below(ids.len())];
            let level = bench.inputs.get_mut(&id).expect("it is there");
            *level = Level { old: level.new, new: 1 - level.new, since: bench.now + 1 };
            episode.change = Some((id, level.new));
        }
    }
    None
}

#[test]
fn what_is_proved_holds_at_all_speeds() {
    let (mut seed, mut proved, mut refuted, mut open, mut timed) = (0, 0, 0, 0, 0);
    while proved < rounds(12, 500) {
        seed += 1;
        let mut random = Random::new(seed);
        let (text, n_parts) = random_text(&mut random);
        let net = chart("c.graf", &text);
        let division = random_division(&net, n_parts);
        let limits = Limits { pairs: 200_000, ..Limits::default() };
        match settles(&net, &division, &limits) {
            Verdict::Proved(settled) => {
                proved += 1;
                timed += usize::from(settled.has_time);
                for run in 0..4 {
                    let different = difference(&net, &division, &settled, (seed * 16 + run, 60));
                    assert_eq!(different, None, "seed {seed}, run {run}\n{text}");
                }
            }
            Verdict::Refuted(_) => refuted += 1,
            Verdict::Open(_) => open += 1,
        }
    }
    println!("{seed} charts: {proved} proved ({timed} with time), {refuted} refuted, {open} open");
}

/// Each refusal is a race of the circuits and the CPU, not only of the model in which the proof searches: they show it when its events are replayed.
#[test]
fn what_is_refuted_can_be_seen() {
    let (mut seed, mut shown, mut others) = (0, BTreeMap::<&str, usize>::new(), Vec::new());
    let count = rounds(40, 1000) as usize;
    while shown.values().sum::<usize>() + others.len() < count {
        seed += 1;
        let (text, n_parts) = random_text(&mut Random::new(seed));
        let net = chart("c.graf", &with_all_outputs(&text));
        let division = random_division(&net, n_parts);
        let limits = Limits { pairs: 200_000, ..Limits::default() };
        let Verdict::Refuted(race) = settles(&net, &division, &limits) else { continue };
        let settled = Settled { longest: 4, has_time: measures_time(&net), ..Settled::default() };
        let at_random =
            |run| difference(&net, &division, &settled, (seed * 64 + run, 60)).is_some();
        match replay::is_shown(&net, &division, &race) {
            Ok(how) => *shown.entry(how).or_default() += 1,
            Err(_) if (0..20).any(at_random) => *shown.entry("at random").or_default() += 1,
            Err(why) => {
                let trace = race.trace(&net, &division).join("\n  ");
                let what = race.what(&net);
                let text = format!("seed {seed}: {why}; {what}\n  {trace}\n{text}");
                others.push((why, text));
            }
        }
    }
    println!("{shown:?}, {} not shown", others.len());
    for (_, one) in &others {
        println!("{one}");
    }
    // In the model, a change can be read at once; by a chip only after two clock edges, and a few races need more than that.
    assert!(others.iter().all(|(why, _)| why == replay::EARLY));
    assert!(others.len() * 100 <= count, "{} races were not seen", others.len());
}

/// A random chart in which each step has an output, so that the outputs show all steps.
fn with_all_outputs(text: &str) -> String {
    let mut added = Vec::new();
    let mut lines = Vec::new();
    for line in text.lines() {
        let step = line.trim().trim_start_matches("initial ").strip_prefix("step s");
        match step.filter(|rest| !rest.contains('{')) {
            Some(name) => {
                added.push(format!("O{name}"));
                lines.push(format!("{line} {{ O{name} }}"));
            }
            None => lines.push(line.to_owned()),
        }
    }
    if !added.is_empty() {
        lines.insert(1, format!("    output {}", added.join(", ")));
    }
    lines.join("\n") + "\n"
}

/// The chip of a part that runs on its own: one pin after the other, the last one for a reset.
fn chip(division: &Division, part: usize, has_reset: bool) -> ChipPins {
    let of_part = &division.parts[part];
    let mut chip = ChipPins { device: "test".to_owned(), clock: Some(1), ..ChipPins::default() };
    let inputs = of_part.net.inputs.iter().map(|(id, it)| (Object::Input(id), &it.name));
    let outputs = of_part.net.outputs.iter().map(|(id, it)| (Object::Output(id), &it.name));
    for (pin, (object, name)) in (2..).zip(inputs.chain(outputs)) {
        chip.signals.push(ChipSignal { name: name.text.clone(), pin, object, bit: 0 });
        match object {
            Object::Input(_) => _ = chip.synchronisers.insert(pin, SYNCHRONISERS),
            Object::Output(_) => _ = chip.registered.insert(pin),
        }
    }
    if has_reset {
        let pin = 2 + chip.signals.len() as u32;
        chip.reset = Some(pin);
        chip.synchronisers.insert(pin, SYNCHRONISERS);
    }
    chip
}

fn names(division: &Division) -> CpuNames {
    let part = &division.parts[division.parts.len() - 1];
    CpuNames {
        prefix: "c_cpu".to_owned(),
        header: "c_cpu.h".to_owned(),
        inputs: part.net.inputs.ids().map(|id| (id, format!("i{}", id.index()))).collect(),
        outputs: part.net.outputs.ids().map(|id| (id, format!("o{}", id.index()))).collect(),
        has_instance: true,
        dt: None,
        library: String::new(),
        conditions: BTreeMap::new(),
    }
}

/// Each way to spoil a link or a chip by one change.
fn spoiled(good: &Link, chips: &[ChipPins]) -> Vec<(String, Link, Vec<ChipPins>)> {
    let mut all = Vec::new();
    let mut add = |what: String, link: Link| all.push((what, link, chips.to_vec()));
    for at in 0..good.acts.len() {
        let mut link = good.clone();
        // Nothing depends on when the CPU waits.
        if link.acts.remove(at) == Act::Settle {
            continue;
        }
        add(format!("act {at} dropped"), link);
        let mut link = good.clone();
        link.acts.insert(at, link.acts[at]);
        add(format!("act {at} twice"), link);
        if good.acts[at] != Act::React
            && let Some(react) = good.acts.iter().position(|act| *act == Act::React)
        {
            let mut link = good.clone();
            let act = link.acts.remove(at);
            let to = if at < react { link.acts.len() } else { 0 };
            link.acts.insert(to, act);
            add(format!("act {at} on the other side of the reaction"), link);
        }
    }
    for at in 0..good.connections.len() {
        let mut link = good.clone();
        link.connections.remove(at);
        if !good.connections[at].to.is_empty() {
            add(format!("connection {at} missing"), link);
        }
        if let Some(level) = good.connections[at].pull {
            let mut link = good.clone();
            link.connections[at].pull = Some(!level);
            add(format!("resistor of connection {at} to the other level"), link);
        }
        for other in at + 1..good.connections.len() {
            let mut link = good.clone();
            let (one, two) = (link.connections[at].to.clone(), link.connections[other].to.clone());
            // The CPU reads each wire from the pin that the link names, whichever it is.
            if one.iter().chain(&two).all(|end| end.part == chips.len()) {
                continue;
            }
            (link.connections[at].to, link.connections[other].to) = (two, one);
            add(format!("connections {at} and {other} swapped"), link);
        }
    }
    for at in 0..good.direct.len() {
        let mut link = good.clone();
        link.direct.remove(at);
        add(format!("input {at} not wired"), link);
        for other in at + 1..good.direct.len() {
            let mut link = good.clone();
            let (one, two) = (link.direct[at].to.clone(), link.direct[other].to.clone());
            (link.direct[at].to, link.direct[other].to) = (two, one);
            if link != *good {
                add(format!("inputs {at} and {other} swapped"), link);
            }
        }
    }
    for (at, (connection, _)) in good.start.iter().enumerate() {
        let mut link = good.clone();
        link.start.remove(at);
        add(format!("connection {connection} not released"), link);
        let mut link = good.clone();
        link.start[at].1 = Start::Level(true);
        add(format!("connection {connection} stays high"), link);
    }
    for at in 0..good.oscillator.len() {
        let mut link = good.clone();
        link.oscillator.remove(at);
        add(format!("clock {at} missing"), link);
    }
    let wires: BTreeSet<(usize, u32)> = (good.connections.iter())
        .filter(|one| !one.to.is_empty() && one.from.part < chips.len())
        .map(|one| (one.from.part, one.from.pin))
        .collect();
    for (part, chip) in chips.iter().enumerate() {
        for pin in chip.synchronisers.keys() {
            let mut other = chips.to_vec();
            other[part].synchronisers.insert(*pin, SYNCHRONISERS - 1);
            all.push((format!("one flip-flop less at pin {pin}"), good.clone(), other));
        }
        for (_, pin) in wires.iter().filter(|(of, _)| *of == part) {
            let mut other = chips.to_vec();
            other[part].registered.remove(pin);
            all.push((format!("no flip-flop drives pin {pin}"), good.clone(), other));
            let mut other = chips.to_vec();
            other[part].following.insert(*pin);
            all.push((format!("pin {pin} follows an input"), good.clone(), other));
        }
    }
    all
}

#[test]
fn links_have_all_lines_and_spoiled_ones_do_not() {
    let (mut n, mut wrong) = (0, Vec::new());
    for seed in 1..=rounds(10, 100) {
        let (text, n_parts) = random_text(&mut Random::new(seed));
        let net = chart("c.graf", &text);
        let division = random_division(&net, n_parts);
        let of_part = |part| chip(&division, part, seed % 2 == 0);
        let chips: Vec<ChipPins> = (0..n_parts - 1).map(of_part).collect();
        let request = LinkRequest {
            net: &net,
            division: &division,
            chips: &chips,
            cpu: &HOST,
            names: names(&division),
            stem: "c".to_owned(),
            name: "c".to_owned(),
            wanted: BTreeMap::new(),
            timing: Timing::default(),
        };
        let good = link(&request).unwrap_or_else(|found| panic!("seed {seed}: {found:?}\n{text}"));
        assert_eq!(check(&good, &net, &division, &chips), Ok(()), "seed {seed}\n{text}");
        for (what, link, chips) in spoiled(&good, &chips) {
            n += 1;
            if check(&link, &net, &division, &chips).is_ok() {
                wrong.push(format!("seed {seed}: {what}"));
            }
        }
    }
    assert_eq!(wrong, Vec::<String>::new());
    assert!(n >= 100, "{n} links");
    println!("{n} spoiled links");
}

/// A GAL22V10 and an ATmega328P.
fn parts() -> [RequestedPart; 2] {
    [("chip", "gal22v10"), ("cpu", "atmega328p")].map(|(name, device)| RequestedPart {
        name: name.to_owned(),
        device: PartDevice::named(device).expect("the device is known"),
    })
}

/// The request of a split of [`parts`] with few pins.
fn request<'a>(
    parts: &'a [RequestedPart],
    (stem, options): (&'a FileStem, &'a BuildOptions),
    (running, reset): (Running, bool),
) -> Request<'a> {
    Request {
        parts,
        places: &[],
        running,
        reset,
        objective: Objective::Pins,
        fits: 4,
        stem,
        options,
        compile: None,
        told: |_| (),
    }
}

/// A chart with a reaction that must follow within a microsecond.
const CUT_OUT: &str = "chart cut {
    tick 10 ms
    input go, over
    output M, B
    initial step off
    step on { M }
    step cut
    t1: off -> on when run.active and not over
    t2: on -> cut when over DEADLINE
    t3: cut -> off when not run.active
    t4: on -> off when not run.active and not over
    initial step idle
    step run { B }
    t5: idle -> run when go and off.active
    t6: run -> idle when not go and run.t >= 100 ms and on.active
    t7: run -> idle when not go and cut.active
}";

#[test]
fn a_microsecond_needs_a_chip_with_a_clock_of_its_own() {
    let parts = parts();
    let (stem, options) = (FileStem::of_name("cut"), BuildOptions::default());
    let made = |text: &str, running: Running| {
        let net = chart("cut.graf", text);
        // The chip has no macrocells left for a reset.
        let request = request(&parts, (&stem, &options), (running, false));
        let split = split(&net, &request).expect("it fits");
        let t2 = net.transitions.iter().find(|(_, it)| it.name.text == "t2");
        let owner = split.division.owners.transitions[t2.expect("it is there").0];
        (owner, wired(&net, &split, &parts, &stem).map(|_| ()))
    };
    let hurried = CUT_OUT.replace("DEADLINE", "deadline 1 us");
    assert_eq!(made(&hurried, Running::Free), (0, Ok(())));
    let (_, refused) = made(&hurried, Running::Lockstep);
    let refused = refused.expect_err("a round takes longer");
    assert!(refused[0].message.contains("in lockstep up to"), "{refused:?}");
    // Without the deadline, everything is on the CPU: that needs the fewest pins.
    assert_eq!(made(&CUT_OUT.replace(" DEADLINE", ""), Running::Free), (1, Ok(())));
}

/// A chart whose chip stays in the step `driving` while its inputs are 0.
const DRIVE: &str = "chart drive {
    input go, over
    output M, B
    initial step off
    step driving { M }
    t1: off -> driving when run.active and not over deadline 1 us
    t2: driving -> off when over
    initial step idle
    step run { B }
    t5: idle -> run when go and off.active
    t6: run -> idle when not go and driving.active
}";

/// The fuses of a chip after random clocks with random pins: three clocks with a high reset and two more bring all flip-flops back to their values after the start.
#[test]
fn a_reset_passes_through_synchronisers_and_sets_all_flip_flops() {
    let parts = parts();
    let (stem, options) = (FileStem::of_name("drive"), BuildOptions::default());
    let net = chart("drive.graf", DRIVE);
    let request = request(&parts, (&stem, &options), (Running::Free, true));
    let split = split(&net, &request).expect("it fits");
    let chip = &split.parts[0].built.chips[0];
    let pin_of = |is_it: &dyn Fn(&Kind) -> bool| {
        chip.signals.iter().find(|one| is_it(&one.kind)).and_then(|one| one.pin)
    };
    let is_reset = |kind: &Kind| match kind {
        Kind::Input(id) => chip.circuit.inputs[*id].role == PinRole::Reset,
        _ => false,
    };
    let reset = pin_of(&is_reset).expect("it has a reset");
    let clock = pin_of(&|kind| *kind == Kind::Clock).expect("it has a clock");
    let map = chip.fuses.as_ref().expect("a GAL has fuses");
    let mut sim = fuse::sim::Chip::new(map).expect("it settles");
    let others: Vec<u32> = chip.signals.iter().filter_map(|one| one.pin).collect();
    let others = || others.iter().filter(|pin| ![clock, reset].contains(*pin));
    // The chip starts in reset. After two clocks without it, the chip has reacted to inputs of 0 only, which do not move it.
    for _ in 0..2 {
        let levels: Vec<(u32, u64)> = others().chain([&reset]).map(|pin| (*pin, 0)).collect();
        sim.put(&levels).expect("it settles");
        sim.pulse(clock).expect("it settles");
    }
    let first = sim.state(0);
    let mut random = Random::new(7);
    let mut clocked = |level: u64, clocks: usize, is_random: bool| {
        for _ in 0..clocks {
            let other = |pin: &u32| (*pin, if is_random { random.bits() } else { 0 });
            let levels: Vec<(u32, u64)> = others().map(other).chain([(reset, level)]).collect();
            sim.put(&levels).expect("it settles");
            sim.pulse(clock).expect("it settles");
        }
        (0..64).filter(|run| sim.state(*run) != first).count()
    };
    assert!(clocked(0, 40, true) > 32, "the chip moves");
    // Without the reset, the chip does not come back by itself.
    assert!(clocked(0, 8, false) > 0);
    clocked(0, 40, true);
    clocked(u64::MAX, 3, false);
    assert_eq!(clocked(0, 2, false), 0);
}
