//! Plants: the script of a page moves them as the simulator does, on random plants of random nets, and those of the examples work.

use crate::page::{node_is_here, run};
use grafsynth_driver::read::{ReadLimits, plant};
use grafsynth_driver::source::Sources;
use grafsynth_ir::expr::Type;
use grafsynth_ir::net::{InputKind, Net};
use grafsynth_ir::plant::{
    Condition, MAX_RATE, MAX_UNITS, Move, Plant, Quantity, QuantityId, Reading, SCALE, Sensor, Set,
};
use grafsynth_ir::random::Random;
use grafsynth_ir::{FileId, Id, Valid};
use grafsynth_page::{Contents, Reference, page};
use grafsynth_sim::{RunningPlant, Simulator, Stimulus, run as simulate, with_plant};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::{chart, rounds};
use std::fmt::Write as _;

const ROWS: usize = 120;

/// The plant of a net.
pub(crate) fn read(net: &Net, text: &str) -> Plant {
    let mut sources = Sources::default();
    let file = sources.add("plant", text);
    let (found, problems) = plant(&sources, file, net, ReadLimits::default());
    found.unwrap_or_else(|| panic!("{text}: {problems:#?}"))
}

/// The stimulus of a text.
pub(crate) fn operation(net: &Net, text: &str) -> Stimulus {
    let (stimulus, problems) = Stimulus::parse_csv(net, FileId(0), text);
    stimulus.unwrap_or_else(|| panic!("{text}: {problems:#?}"))
}

/// A plant with everything that a plant file can say about values.
fn random_plant(net: &Net, random: &mut Random) -> Plant {
    let mut plant = Plant { view: (100, 100), ..Plant::default() };
    for at in 0..random.between(1, 4) {
        let top = *random.pick(&[2, 50, 1_000, MAX_UNITS]).unwrap_or(&1);
        let (lo, hi) = (random.between(-top, 0), random.between(1, top));
        let init = random.between(lo, hi);
        plant.quantities.push(Quantity { name: format!("q{at}"), label: None, lo, hi, init });
    }
    let quantities: Vec<QuantityId> = plant.quantities.ids().collect();
    let ranges: Vec<(i64, i64)> = plant.quantities.values().map(|it| (it.lo, it.hi)).collect();
    let pick = |random: &mut Random| Id::from_index(random.below(quantities.len()));
    for _ in 0..random.between(1, 6) {
        let speeds: Vec<_> =
            net.outputs.iter().filter(|(_, it)| it.ty != Type::Bool && !it.is_extern()).collect();
        let quantity = pick(random);
        let top = *random.pick(&[3, 200, MAX_RATE]).unwrap_or(&1);
        plant.moves.push(Move {
            quantity,
            rate: random.between(-top, top),
            speed: random.pick(&speeds).map(|(id, _)| *id).filter(|_| random.one_in(3)),
            when: condition(net, &ranges, random, 3),
        });
    }
    for _ in 0..random.between(0, 2) {
        let quantity: QuantityId = pick(random);
        let (lo, hi) = ranges[quantity.index()];
        let value = random.between(lo, hi);
        plant.sets.push(Set { quantity, value, when: condition(net, &ranges, random, 2) });
    }
    for (id, input) in net.inputs.iter() {
        if is_level(input.kind) && random.one_in(2) {
            let sensor = match input.ty {
                Type::Bool => Sensor::Is(condition(net, &ranges, random, 2)),
                Type::Int { .. } => Sensor::Measures(pick(random)),
            };
            plant.sensors.push((id, sensor));
        }
    }
    plant
}

/// Whether an input has a value that stays, and not an event.
fn is_level(kind: InputKind) -> bool {
    matches!(kind, InputKind::Pin | InputKind::Extern)
}

fn condition(net: &Net, ranges: &[(i64, i64)], random: &mut Random, depth: usize) -> Condition {
    let some = |random: &mut Random| {
        (0..random.between(0, 3)).map(|_| condition(net, ranges, random, depth - 1)).collect()
    };
    match if depth == 0 { 9 } else { random.below(10) } {
        0 => Condition::All(some(random)),
        1 => Condition::Any(some(random)),
        2 => Condition::Not(Box::new(condition(net, ranges, random, depth - 1))),
        _ => {
            let inputs: Vec<_> = net.inputs.iter().filter(|(_, it)| is_level(it.kind)).collect();
            let outputs: Vec<_> = net.outputs.iter().filter(|(_, it)| !it.is_extern()).collect();
            let (reading, scale, (lo, hi)) = match random.below(3) {
                0 if !inputs.is_empty() => {
                    let (id, _) = inputs[random.below(inputs.len())];
                    (Reading::Input(id), 1, (0, 3))
                }
                1 if !outputs.is_empty() => {
                    let (id, _) = outputs[random.below(outputs.len())];
                    (Reading::Output(id), 1, (0, 3))
                }
                _ => {
                    let at = random.below(ranges.len());
                    (Reading::Quantity(Id::from_index(at)), SCALE, ranges[at])
                }
            };
            let least = random.between(lo, hi) * scale + random.between(-1, 1);
            let most = random.between(lo, hi) * scale;
            let is_open = random.below(3);
            Condition::Within(
                reading,
                (is_open != 0).then_some(least),
                (is_open != 1).then_some(most),
            )
        }
    }
}

/// Each row of a run: the inputs as they were set, and the quantities.
fn rows(net: &Valid<Net>, plant: &Plant, stimulus: &Stimulus) -> String {
    let mut simulator = Simulator::new(net);
    let mut running = RunningPlant::new(plant, net, &simulator.reset());
    let mut text = String::new();
    for mut row in stimulus.rows() {
        running.advance(row.dt);
        running.drive(net, &mut row, |_| false);
        running.hold(simulator.step(&row));
        let cells: Vec<String> =
            row.values.iter().chain(running.values()).map(i64::to_string).collect();
        // Writing into a String cannot fail.
        let _ = writeln!(text, "{}", cells.join(","));
    }
    text
}

#[test]
fn the_script_of_a_page_moves_a_plant_as_the_simulator_does() {
    if !node_is_here() {
        return;
    }
    let script = include_str!("page_scripts/plant.js");
    for seed in 0..rounds(12, 1_000) {
        let net = random_net(seed, &Features::everything());
        let mut random = Random::new(seed);
        let plant = random_plant(&net, &mut random);
        let longest = *random.pick(&[1, 5, 1_000]).unwrap_or(&1);
        let stimulus = Stimulus::random(&net, ROWS, seed, longest);
        let contents = Contents { plant: Some(&plant), ..Contents::default() };
        let page = page(&net, &Reference::default(), &contents).expect("a page");
        let found = run(&page, &stimulus.to_csv(&net), script);
        assert_eq!(found, rows(&net, &plant, &stimulus), "seed {seed}: {plant:#?}");
    }
}

/// The charts with a plant that drives inputs. For each: a stimulus with what somebody operates, and the situations that follow.
#[test]
fn the_plants_of_the_examples_work() {
    for (name, text, plant_text, pressed, wanted) in [
        (
            "truck.graf",
            include_str!("../../examples/truck/truck.graf"),
            include_str!("../../examples/truck/truck.plant"),
            "dt,m\n1,1\n2000,0\n",
            "p1 p2 p3 p4 p1",
        ),
        (
            "filler.graf",
            include_str!("../../examples/bottle-filler/filler.graf"),
            include_str!("../../examples/bottle-filler/filler.plant"),
            "dt,start\n1,1\n160,0\n",
            "idle bring settle fill count bring settle fill count bring",
        ),
        (
            "tank.graf",
            include_str!("../../examples/tank/tank.graf"),
            include_str!("../../examples/tank/tank.plant"),
            "dt,start\n1,1\n300,0\n",
            "rest fill mix drain rest",
        ),
        (
            "lift.graf",
            include_str!("../../examples/lift/lift.graf"),
            include_str!("../../examples/lift/lift.plant"),
            "dt,call1,call2\n1,0,1\n200,0,0\n1,1,0\n200,0,0\n",
            "wait to2 open close wait to1_down open close wait",
        ),
    ] {
        let net = chart(name, text);
        let driven = with_plant(&net, &read(&net, plant_text), &operation(&net, pressed));
        let driven = driven.expect("few ticks");
        let trace = simulate(&net, &driven);
        let at = trace.layout.columns.iter().position(|it| it.name == "steps").expect("steps");
        let mut situations: Vec<String> =
            trace.rows.iter().map(|row| trace.layout.text(&row.values[at])).collect();
        situations.dedup();
        assert_eq!(situations.join(" "), wanted, "{name}");
    }
}
