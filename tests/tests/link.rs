//! Links between the parts of a division: the check accepts those of random divisions and rejects damaged ones, and their C performs the acts.

#![allow(clippy::disallowed_methods, reason = "tests write files for tools")]
#![allow(clippy::print_stdout, reason = "tests report what they did")]

use crate::split::{division, features, net_to_divide, stable_features, statechart_features};
use grafsynth_c::storage;
use grafsynth_engines::tools;
use grafsynth_ir::arena::Id;
use grafsynth_ir::division::{Division, PartNet, Source};
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{Driver, Expr, InputId, InputKind, Leaf, Net};
use grafsynth_split::cpu::{CPUS, Cpu, Family, HOST};
use grafsynth_split::link::{
    Act, Carries, ChipPins, ChipSignal, Condition, Connection, CpuNames, Direct, Link, Object, Put,
    Request, Timing, check, files, link, wiring_md, wiring_svg,
};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;
use std::time::Duration;

const LIMIT: Duration = Duration::from_secs(60);

/// A chip with one pin after the other: the clock, the tick, and each bit of each signal.
fn chip(part: &PartNet, has_tick: bool) -> ChipPins {
    let mut chip = ChipPins { device: "test".to_owned(), clock: Some(1), ..ChipPins::default() };
    chip.tick = has_tick.then_some(2);
    chip.reset = Some(3);
    chip.held = held_by(&part.net);
    let inputs = part.net.inputs.iter().map(|(id, it)| (Object::Input(id), &it.name, it.ty));
    let outputs = part.net.outputs.iter().map(|(id, it)| (Object::Output(id), &it.name, it.ty));
    for (object, name, ty) in inputs.chain(outputs) {
        for bit in 0..ty.bits() {
            let pin = 4 + u32::try_from(chip.signals.len()).expect("it is there");
            chip.signals.push(ChipSignal { name: name.text.clone(), pin, object, bit });
        }
    }
    chip
}

/// The inputs that are read by something else than continuous outputs.
fn held_by(net: &Net) -> BTreeSet<InputId> {
    let outputs = net.outputs.values();
    let continuous = outputs.filter(|output| matches!(output.driver, Driver::Continuous(_)));
    let followed: Vec<*const Expr> =
        continuous.flat_map(|output| output.driver.exprs()).map(std::ptr::from_ref).collect();
    let others = net.expressions().filter(|expr| !followed.contains(&std::ptr::from_ref(*expr)));
    let others = others.flat_map(|expr| expr.leaves());
    let mut held: BTreeSet<InputId> = others
        .filter_map(|leaf| if let Leaf::Input(id) = leaf { Some(*id) } else { None })
        .collect();
    held.extend(net.transitions.values().flat_map(|transition| &transition.events));
    held
}

/// The C of the part on the CPU, with names that only these tests use.
fn names(part: &PartNet) -> CpuNames {
    let handed = part.net.inputs.iter().filter(|(_, it)| it.kind.is_handed());
    let shown = part.net.outputs.iter().filter(|(_, it)| !it.is_extern());
    CpuNames {
        prefix: "plant_cpu".to_owned(),
        header: "plant_cpu.h".to_owned(),
        inputs: handed.map(|(id, _)| (id, format!("i{}", id.index()))).collect(),
        outputs: shown.map(|(id, _)| (id, format!("o{}", id.index()))).collect(),
        has_instance: true,
        dt: Some("uint16_t".to_owned()),
        library: "plant_cpu_user.h".to_owned(),
        conditions: conditions(part),
    }
}

/// The functions that the part on the CPU calls, and those of the user.
fn conditions(part: &PartNet) -> BTreeMap<InputId, Condition> {
    let asked = part.net.inputs.iter().filter(|(_, it)| it.kind == InputKind::Extern);
    let functions = |id: InputId| Condition {
        called: format!("c{}", id.index()),
        provided: format!("u{}", id.index()),
    };
    asked.map(|(id, _)| (id, functions(id))).collect()
}

/// A random division with the pins of its chips.
struct Case {
    net: Net,
    division: Division,
    chips: Vec<ChipPins>,
}

impl Case {
    /// Grafcet charts of both evolutions, and statecharts.
    fn new(seed: u64) -> Option<Case> {
        let features = match seed % 6 {
            1 | 4 => stable_features(seed),
            5 => statechart_features(seed),
            _ => features(seed),
        };
        let net = net_to_divide(seed, &features);
        let division = division(&net, seed)?;
        let (_, chips) = division.parts.split_last()?;
        let chips = chips.iter().map(|part| chip(part, seed.is_multiple_of(2))).collect();
        Some(Case { net: (*net).clone(), division, chips })
    }

    fn request(&self, cpu: &'static Cpu) -> Request<'_> {
        Request {
            net: &self.net,
            division: &self.division,
            chips: &self.chips,
            cpu,
            names: names(self.division.parts.last().expect("it is there")),
            stem: "plant".to_owned(),
            name: "plant".to_owned(),
            wanted: BTreeMap::new(),
            timing: Timing::default(),
        }
    }

    /// Whether the acts and connections are accepted.
    fn accepts(&self, link: &Link) -> bool {
        check(link, &self.net, &self.division, &self.chips).is_ok()
    }
}

/// Links that are damaged on purpose, each with a description of the damage.
fn spoiled(case: &Case, link: &Link) -> Vec<(String, Vec<Act>, Vec<Connection>)> {
    let mut all = Vec::new();
    let acts = |change: &dyn Fn(&mut Vec<Act>)| {
        let mut acts = link.acts.clone();
        change(&mut acts);
        acts
    };
    for (at, act) in link.acts.iter().enumerate() {
        let mut spoil = |what: &str, acts: Vec<Act>| {
            all.push((format!("{what} {at}: {act:?}"), acts, link.connections.clone()));
        };
        spoil("dropped", acts(&|acts| _ = acts.remove(at)));
        let to_end = acts(&|acts| {
            let act = acts.remove(at);
            acts.push(act);
        });
        let to_start = acts(&|acts| {
            let act = acts.remove(at);
            acts.insert(0, act);
        });
        match *act {
            Act::Latch | Act::React | Act::Clock { .. } => {
                spoil("twice", acts(&|acts| acts.insert(at, *act)));
                spoil("last", to_end);
                if at > 0 {
                    spoil("first", to_start);
                }
            }
            Act::Hand { .. } => {
                spoil("first", to_start);
                spoil("last", to_end);
            }
            Act::Put { connection, value } => {
                spoil("last", to_end);
                let asks = |act: &Act| matches!(act, Act::AskChip { .. } | Act::AskCpu { .. });
                // Without a part that moves, nothing has to be known before.
                let is_known = value == Put::More && !link.acts.iter().any(asks);
                if value != Put::Tick && !is_known {
                    spoil("first", to_start);
                }
                if let Put::Input { input, bit } = value {
                    let value = Put::Input { input, bit: bit + 1 };
                    spoil("another bit", acts(&|acts| acts[at] = Act::Put { connection, value }));
                }
            }
            Act::Get { connection, to } => {
                spoil("last", to_end);
                let from = link.connections[connection].from.part;
                let chip = &case.chips[from];
                let net = &case.division.parts[from].inputs;
                let is_input = |signal: &ChipSignal| match signal.object {
                    Object::Input(id) => {
                        matches!(net[id], grafsynth_ir::division::Source::Input(_))
                    }
                    Object::Output(_) => false,
                };
                if chip.tick.is_some() || chip.signals.iter().any(is_input) {
                    spoil("first", to_start);
                }
                let other = link.acts.iter().find_map(|other| match *other {
                    Act::Get { connection: other, to: place } if place != to => Some(other),
                    _ => None,
                });
                if let Some(connection) = other {
                    spoil("another wire", acts(&|acts| acts[at] = Act::Get { connection, to }));
                }
            }
            Act::HandMore { .. } => {
                spoil("last", to_end);
                if link.acts.iter().any(|act| matches!(act, Act::AskChip { .. })) {
                    spoil("first", to_start);
                }
            }
            Act::AskChip { .. } => spoil("last", to_end),
            Act::AskCpu { .. } => spoil("first", to_start),
            Act::Settle => {}
        }
    }
    let cpu = case.chips.len();
    let ends: Vec<(usize, usize)> = (link.connections.iter().enumerate())
        .filter_map(|(at, one)| Some((at, one.to.iter().position(|end| end.part != cpu)?)))
        .collect();
    for pair in ends.windows(2) {
        let [(one, at), (other, there)] = *pair else { continue };
        let mut swapped = link.connections.clone();
        let end = swapped[one].to[at];
        swapped[one].to[at] = swapped[other].to[there];
        swapped[other].to[there] = end;
        all.push((format!("readers of {one} and {other} swapped"), link.acts.clone(), swapped));
        let mut open = link.connections.clone();
        open[one].to.remove(at);
        all.push((format!("a reader of {one} is open"), link.acts.clone(), open));
    }
    let drivers: Vec<usize> =
        (0..link.connections.len()).filter(|at| link.connections[*at].from.part != cpu).collect();
    for pair in drivers.windows(2) {
        let mut swapped = link.connections.clone();
        swapped[pair[0]].from = link.connections[pair[1]].from;
        swapped[pair[1]].from = link.connections[pair[0]].from;
        all.push((format!("drivers {pair:?} swapped"), link.acts.clone(), swapped));
    }
    all
}

#[test]
fn links_of_random_divisions_are_one_round_and_spoiled_ones_are_not() {
    let (mut n_links, mut n_spoiled, mut n_refused) = (0, 0, 0);
    let (mut n_direct, mut n_emergency, mut n_bypassed, mut n_once) = (0, 0, 0, 0);
    for seed in 0..200 {
        let Some(case) = Case::new(seed) else { continue };
        let request = case.request(&HOST);
        let made = match link(&request) {
            Ok(made) => made,
            Err(findings) => {
                // Only too few pins, and functions that a chip cannot call, may prevent a link.
                assert!(
                    findings.iter().all(
                        |one| one.message.contains("needs") || one.message.contains("computes")
                    ),
                    "seed {seed}: {findings:?}"
                );
                n_refused += 1;
                continue;
            }
        };
        if let Err(breach) = check(&made, &case.net, &case.division, &case.chips) {
            panic!("seed {seed}: {breach}\n{made:#?}");
        }
        for (what, acts, connections) in spoiled(&case, &made) {
            let link = Link { acts, connections, ..made.clone() };
            assert!(!case.accepts(&link), "seed {seed} is accepted: {what}\n{made:#?}");
            n_spoiled += 1;
        }
        for at in 0..made.once.len() {
            let mut link = made.clone();
            link.once.remove(at);
            assert!(!case.accepts(&link), "seed {seed} is accepted: a condition in each round");
            n_once += 1;
        }
        for at in 0..made.connections.len() {
            let Some(link) = bypassed(&case, &made, at) else { continue };
            assert!(!case.accepts(&link), "seed {seed} is accepted: {at} bypasses\n{made:#?}");
            n_bypassed += 1;
        }
        let (emergency, direct): (Vec<_>, Vec<_>) =
            made.direct.iter().partition(|one| one.is_emergency);
        n_emergency += emergency.len();
        for (what, link) in without_reset(&made) {
            assert!(!case.accepts(&link), "seed {seed} is accepted: {what}\n{made:#?}");
        }
        for (what, link) in without_emergency(&made) {
            assert!(!case.accepts(&link), "seed {seed} is accepted: {what}\n{made:#?}");
        }
        for one in emergency {
            let case = moving(&case, one.input);
            assert!(!case.accepts(&made), "seed {seed} is accepted: {one:?} moves\n{made:#?}");
        }
        n_direct += direct.len();
        for one in direct {
            let case = held(&case, one.input);
            assert!(!case.accepts(&made), "seed {seed} is accepted: {one:?} is held\n{made:#?}");
        }
        n_links += 1;
        if n_links == 60 {
            break;
        }
    }
    println!(
        "{n_links} links with {n_direct} direct inputs, {n_emergency} of emergencies, {n_spoiled} spoiled ones, {n_bypassed} that bypass the CPU, {n_refused} divisions without a link"
    );
    assert!(n_links >= 50 && n_spoiled >= 100 && n_bypassed >= 50);
    assert!(n_direct >= 5 && n_emergency >= 5, "{n_direct} and {n_emergency}");
    assert!(n_once >= 5, "{n_once} conditions");
}

/// The link with an input of a chip that is wired from the plant instead of the CPU, although the CPU must latch it.
fn bypassed(case: &Case, link: &Link, at: usize) -> Option<Link> {
    let one = &link.connections[at];
    let Carries::Input { input, bit } = one.carries else { return None };
    let mut link = link.clone();
    let to = std::mem::take(&mut link.connections[at].to);
    link.direct.push(Direct {
        name: format!("{}_bypass", one.name),
        input,
        bit,
        to,
        is_emergency: false,
    });
    // The other bits of an integer must not be the reason.
    for other in &mut link.connections {
        if let Carries::Input { input: same, bit } = other.carries
            && same == input
            && !other.to.is_empty()
        {
            let to = std::mem::take(&mut other.to);
            link.direct.push(Direct {
                name: format!("{}_bypass", other.name),
                input,
                bit,
                to,
                is_emergency: false,
            });
        }
    }
    case.net.inputs.get(input).map(|_| link)
}

/// Links in which the pins of an emergency are not those of the plant.
fn without_emergency(link: &Link) -> Vec<(String, Link)> {
    let mut all = Vec::new();
    for (at, one) in link.direct.iter().enumerate().filter(|(_, one)| one.is_emergency) {
        let mut open = link.clone();
        open.direct.remove(at);
        all.push((format!("{} is open", one.name), open));
        let mut alone = link.clone();
        alone.direct[at].is_emergency = false;
        all.push((format!("{} is not latched", one.name), alone));
        for (from, passed) in link.connections.iter().enumerate() {
            let Carries::Input { input, bit: 0 } = passed.carries else { continue };
            let ends = passed.to.iter().position(|end| end.part == one.to[0].part);
            if let Some(end) = ends.filter(|_| input == one.input) {
                let mut swapped = link.clone();
                swapped.direct[at].to[0] = passed.to[end];
                swapped.connections[from].to[end] = one.to[0];
                all.push((format!("{} is exchanged with {}", one.name, passed.name), swapped));
            }
        }
    }
    all
}

/// Links that do not reset the chips, or reset them in each round.
fn without_reset(link: &Link) -> Vec<(&'static str, Link)> {
    let at = link.connections.iter().position(|one| one.carries == Carries::Reset);
    let at = at.expect("each chip has a reset");
    let mut low = link.clone();
    low.connections[at].pull = Some(false);
    let mut always = link.clone();
    always.start.retain(|(one, _)| *one != at);
    let mut open = link.clone();
    open.connections[at].to.pop();
    vec![("it is low", low), ("it stays high", always), ("it is open", open)]
}

/// The case with a flip-flop or wire of each chip that depends on the pin of an emergency.
fn moving(case: &Case, input: InputId) -> Case {
    let mut chips = case.chips.clone();
    for (chip, part) in chips.iter_mut().zip(&case.division.parts) {
        let own = part.inputs.iter().filter(|(_, source)| **source == Source::Direct(input));
        chip.moving.extend(own.map(|(id, _)| id));
    }
    Case { net: case.net.clone(), division: case.division.clone(), chips }
}

/// The case with a flip-flop or wire of each chip that depends on an input.
fn held(case: &Case, input: InputId) -> Case {
    let mut chips = case.chips.clone();
    for (chip, part) in chips.iter_mut().zip(&case.division.parts) {
        let own = part.inputs.iter().filter(|(_, source)| **source == Source::Input(input));
        chip.held.extend(own.map(|(id, _)| id));
    }
    Case { net: case.net.clone(), division: case.division.clone(), chips }
}

/// The header of a part on the CPU that only has the interface of emitted C.
fn stub_header(case: &Case, names: &CpuNames) -> String {
    let part = &case.division.parts.last().expect("it is there").net;
    let ty = |ty: Type| if ty.is_bool() { "bool" } else { "int32_t" };
    let mut text =
        "#ifndef PLANT_CPU_H\n#define PLANT_CPU_H\n#include <stdbool.h>\n#include <stdint.h>\n"
            .to_owned();
    let mut parameters = "plant_cpu_t *self".to_owned();
    text += "typedef struct { uint8_t state; } plant_cpu_t;\n";
    let has_in = !names.inputs.is_empty();
    if has_in {
        let members: String = names
            .inputs
            .iter()
            .map(|(id, name)| format!("{} {name}; ", ty(part.inputs[*id].ty)))
            .collect();
        _ = writeln!(text, "typedef struct {{ {members}}} plant_cpu_in_t;");
        parameters += ", const plant_cpu_in_t *in";
    }
    parameters += ", uint16_t dt";
    let mut of_init = "plant_cpu_t *self".to_owned();
    if !names.outputs.is_empty() {
        let members: String = names
            .outputs
            .iter()
            .map(|(id, name)| format!("{} {name}; ", ty(part.outputs[*id].ty)))
            .collect();
        _ = writeln!(text, "typedef struct {{ {members}}} plant_cpu_out_t;");
        parameters += ", plant_cpu_out_t *out";
        of_init += ", plant_cpu_out_t *out";
    }
    _ = writeln!(
        text,
        "void plant_cpu_init({of_init});\nvoid plant_cpu_step({parameters});\n#endif"
    );
    text
}

/// The value of an input of the net in the round that the program runs.
fn value_of(net: &Net, input: usize) -> i64 {
    let (lo, hi) = net.inputs[Id::from_index(input)].ty.bounds();
    lo + (5 + 7 * i64::try_from(input).expect("it is there")) % (hi - lo + 1)
}

/// A program that prints the accesses of one round, and the output that follows from the acts.
fn program(case: &Case, names: &CpuNames, made: &Link) -> (String, String) {
    let net = &case.net;
    let part = &case.division.parts.last().expect("it is there").net;
    let cpu = case.chips.len();
    let has_out = !names.outputs.is_empty();
    let mut c = "#include \"plant_link.h\"\n#include <stdio.h>\nvoid plant_link_host_put(unsigned pin, bool level);\nbool plant_link_host_get(unsigned pin);\nvoid plant_link_host_settle(void);\n\
        void plant_link_host_put(unsigned pin, bool level) { printf(\"put %u %d\\n\", pin, (int)level); }\n\
        bool plant_link_host_get(unsigned pin) { printf(\"get %u\\n\", pin); return pin % 2U == 0U; }\n\
        void plant_link_host_settle(void) { printf(\"settle\\n\"); }\n".to_owned();
    if !made.once.is_empty() {
        c += "#include \"plant_cpu_user.h\"\n";
    }
    let empty = BTreeMap::new();
    let conditions = if made.once.is_empty() { &empty } else { &names.conditions };
    for (id, Condition { provided, .. }) in conditions {
        let ty = storage(part.inputs[*id].ty);
        _ = writeln!(c, "{ty} {provided}(void) {{ puts(\"{provided}\"); return 0; }}");
    }
    let out = if has_out { ", plant_cpu_out_t *out" } else { "" };
    _ = writeln!(
        c,
        "void plant_cpu_init(plant_cpu_t *self{out}) {{ self->state = 0U; {}}}",
        if has_out { "(void)out; " } else { "" }
    );
    let input = if names.inputs.is_empty() { "" } else { ", const plant_cpu_in_t *in" };
    _ = writeln!(
        c,
        "void plant_cpu_step(plant_cpu_t *self{input}, uint16_t dt{out}) {{\n(void)self;\nprintf(\"react %u\\n\", (unsigned)dt);"
    );
    for name in names.inputs.values() {
        _ = writeln!(c, "printf(\"{name} %ld\\n\", (long)in->{name});");
    }
    // The part may ask for a condition in each round, also twice.
    for Condition { called, .. } in conditions.values() {
        _ = writeln!(
            c,
            "(void){called}(); puts(\"{called}\");\n(void){called}(); puts(\"{called}\");"
        );
    }
    for (id, name) in &names.outputs {
        let value =
            if part.outputs[*id].ty.is_bool() { ["false", "true"][id.index() % 2] } else { "1" };
        _ = writeln!(c, "out->{name} = {value};");
    }
    c += "}\nint main(void) {\nplant_cpu_t self;\n";
    let header = files(&case.request(&HOST), made).remove(0).text;
    let has_in = header.contains("plant_link_in_t;");
    if has_in {
        c += "plant_link_in_t in;\n";
        let mut members: Vec<usize> = made
            .acts
            .iter()
            .filter_map(|act| match *act {
                Act::Hand { from, .. } => Some(from.index()),
                Act::Put { value: Put::Input { input, .. }, .. } => Some(input.index()),
                _ => None,
            })
            .collect();
        members.sort_unstable();
        members.dedup();
        // The members are in the order of the inputs of the net.
        let body = header
            .split("typedef struct {")
            .nth(1)
            .expect("it is there")
            .split('}')
            .next()
            .expect("it is there");
        for (input, line) in members.into_iter().zip(body.trim().lines()) {
            let name = line.trim().trim_end_matches(';').split(' ').nth(1).expect("it is there");
            let value = value_of(net, input);
            let value = if net.inputs[Id::from_index(input)].ty.is_bool() {
                (value == 1).to_string()
            } else {
                value.to_string()
            };
            _ = writeln!(c, "in.{name} = {value};");
        }
    }
    let args = |round: bool| {
        [
            "&self",
            if round && has_in { "&in" } else { "" },
            if round { "1" } else { "" },
            if has_out { "&out" } else { "" },
        ]
        .into_iter()
        .filter(|one| !one.is_empty())
        .collect::<Vec<_>>()
        .join(", ")
    };
    if has_out {
        c += "plant_cpu_out_t out;\n";
    }
    _ = writeln!(
        c,
        "plant_link_init({});\nprintf(\"round\\n\");\nplant_link_round({});\nreturn 0;\n}}",
        args(false),
        args(true)
    );

    let mut handed: BTreeMap<usize, i64> = BTreeMap::new();
    let pin = |at: usize| {
        let one = &made.connections[at];
        [one.from].iter().chain(&one.to).find(|end| end.part == cpu).expect("it is there").pin
    };
    let mut moves = false;
    // Events and time are those of the first round.
    let mut round = |is_first: bool| {
        let value_of = |id: InputId| {
            let is_over = !is_first && net.inputs[id].kind.is_event();
            if is_over { 0 } else { value_of(net, id.index()) }
        };
        let mut wanted = String::new();
        moves = false;
        for act in &made.acts {
            match *act {
                Act::Latch => {}
                Act::Hand { from, to } => _ = handed.insert(to.index(), value_of(from)),
                Act::Put { connection, value } => {
                    let level = match value {
                        Put::Input { input, bit } => {
                            let lo = net.inputs[input].ty.bounds().0;
                            (value_of(input) - lo) >> bit & 1
                        }
                        Put::Tick => i64::from(is_first),
                        Put::More => i64::from(moves),
                        Put::Output(id) => i64::try_from(id.index() % 2).expect("it is there"),
                    };
                    _ = writeln!(wanted, "put {} {level}", pin(connection));
                }
                Act::Settle => wanted += "settle\n",
                Act::Get { connection, to } => {
                    handed.insert(to.index(), i64::from(pin(connection) % 2 == 0));
                    _ = writeln!(wanted, "get {}", pin(connection));
                }
                Act::AskChip { connection } => {
                    moves |= pin(connection) % 2 == 0;
                    _ = writeln!(wanted, "get {}", pin(connection));
                }
                Act::HandMore { to } => _ = handed.insert(to.index(), i64::from(moves)),
                Act::AskCpu { output } => moves |= output.index() % 2 == 1,
                Act::React => {
                    _ = writeln!(wanted, "react {}", u8::from(is_first));
                    for id in names.inputs.keys() {
                        _ = writeln!(wanted, "i{} {}", id.index(), handed[&id.index()]);
                    }
                    for Condition { called, provided } in conditions.values() {
                        let asked = if is_first { format!("{provided}\n") } else { String::new() };
                        _ = write!(wanted, "{asked}{called}\n{called}\n");
                    }
                }
                Act::Clock { connection } => {
                    let pin = pin(connection);
                    _ = write!(wanted, "put {pin} 1\nsettle\nput {pin} 0\n");
                }
            }
        }
        wanted
    };
    let mut wanted = round(true);
    let again = round(false);
    // The pins show the same in all rounds, so the reaction ends at once or at the bound.
    if moves {
        let rounds = made.most_rounds.map_or(0, |most| most as usize - 1);
        wanted += &again.repeat(rounds);
    }
    (c, wanted)
}

/// Writes the files of a link and the header of the part on the CPU.
fn write(folder: &Path, case: &Case, request: &Request<'_>, made: &Link) {
    for file in files(request, made) {
        std::fs::write(folder.join(&file.name), &file.text).expect("it is there");
    }
    std::fs::write(folder.join("plant_cpu.h"), stub_header(case, &request.names))
        .expect("it is there");
    let part = &case.division.parts.last().expect("it is there").net;
    let declared = request.names.conditions.iter().map(|(id, one)| {
        let ty = storage(part.inputs[*id].ty);
        format!("{ty} {}(void);\n{ty} {}(void);\n", one.called, one.provided)
    });
    let text =
        format!("#include <stdbool.h>\n#include <stdint.h>\n{}", declared.collect::<String>());
    std::fs::write(folder.join(&request.names.library), text).expect("it is there");
    let table = wiring_md(request, made);
    assert!(made.connections.iter().all(|one| table.contains(&format!("| {} |", one.name))));
    roxmltree::Document::parse(&wiring_svg(request, made)).expect("it is there");
}

const STRICT: [&str; 7] =
    ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-pedantic", "-Werror"];

/// Compiles; `false` if the compiler is not available.
fn compiles(compiler: &str, flags: &[&str], folder: &Path, what: &str) -> bool {
    let Some(program) = tools::find(&[compiler]) else {
        println!("skipped: no {compiler}");
        return false;
    };
    let output = tools::run(&program, flags, folder, b"", LIMIT).expect("it is there");
    assert!(
        output.is_success,
        "{what}: {}\n{}",
        output.stderr,
        std::fs::read_to_string(folder.join("plant_link_pins.h")).expect("it is there")
    );
    true
}

#[test]
fn the_c_of_a_link_does_what_its_acts_say() {
    let (mut n_run, mut n_long) = (0, 0);
    for seed in 0..60 {
        let Some(case) = Case::new(seed) else { continue };
        let request = case.request(&HOST);
        let Ok(made) = link(&request) else { continue };
        let puts = made.acts.iter().filter(|act| matches!(act, Act::Put { .. })).count();
        let gets = made.acts.iter().filter(|act| matches!(act, Act::Get { .. })).count();
        if puts < 2 || gets == 0 {
            continue;
        }
        let folder = tempfile::tempdir().expect("it is there");
        write(folder.path(), &case, &request, &made);
        let (main, wanted) = program(&case, &request.names, &made);
        std::fs::write(folder.path().join("main.c"), &main).expect("it is there");
        let compiler = if n_run % 2 == 0 { "gcc" } else { "clang" };
        let flags: Vec<&str> =
            STRICT.into_iter().chain(["-o", "run", "main.c", "plant_link.c"]).collect();
        if !compiles(compiler, &flags, folder.path(), &format!("seed {seed}")) {
            continue;
        }
        let output =
            tools::run(&folder.path().join("run"), &[] as &[&str], folder.path(), b"", LIMIT)
                .expect("it is there");
        let text = String::from_utf8(output.stdout).expect("it is there");
        let (_, round) = text.split_once("round\n").expect("it is there");
        assert_eq!(round, wanted, "seed {seed}");
        n_run += 1;
        n_long += u32::from(wanted.matches("react 0").count() > 0);
        if n_run == 6 {
            break;
        }
    }
    println!("{n_run} programs run, {n_long} with several rounds");
    assert!(n_long > 0 || n_run == 0);
}

#[test]
fn the_c_of_a_link_compiles_for_each_cpu() {
    for cpu in CPUS {
        let mut n_compiled = 0;
        for seed in 0..60 {
            let Some(case) = Case::new(seed) else { continue };
            let request = case.request(cpu);
            let Ok(made) = link(&request) else { continue };
            if !made.acts.iter().any(|act| matches!(act, Act::Get { .. })) {
                continue;
            }
            let folder = tempfile::tempdir().expect("it is there");
            write(folder.path(), &case, &request, &made);
            let machine = format!("-mmcu={}", cpu.name);
            let (compiler, flags): (&str, &[&str]) = match cpu.family {
                Family::Avr => ("avr-gcc", &[machine.as_str(), "-Os", "-c", "plant_link.c"]),
                Family::Stm32f1 => (
                    "arm-none-eabi-gcc",
                    &["-mcpu=cortex-m3", "-mthumb", "-Os", "-c", "plant_link.c"],
                ),
                Family::Mcs51 | Family::Host => {
                    ("sdcc", &["-mmcs51", "--std-c99", "-c", "plant_link.c"])
                }
            };
            let strict: &[&str] = if compiler == "sdcc" { &[] } else { &STRICT };
            let flags: Vec<&str> = strict.iter().chain(flags).copied().collect();
            if !compiles(compiler, &flags, folder.path(), &format!("{}, seed {seed}", cpu.name)) {
                break;
            }
            n_compiled += 1;
            if n_compiled == 2 {
                break;
            }
        }
        println!("{}: {n_compiled} links compiled", cpu.name);
    }
}
