//! State tables by others compared with an independent interpreter, and charts written as tables and read back.

#![allow(clippy::print_stdout, reason = "tests report what they skip")]
#![allow(clippy::disallowed_methods, reason = "tests read files")]

use grafsynth_driver::languages::Language;
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::run::logic_trace;
use grafsynth_driver::source::Sources;
use grafsynth_driver::{automaton, compare, pipeline};
use grafsynth_frontend::kiss2;
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_sim::{InputRow, Random, Simulator, Stimulus, Value};
use grafsynth_tests::random_net::{Features, random_net};
use grafsynth_tests::random_table::random_table;
use grafsynth_tests::rounds;
use grafsynth_verify::structural_facts;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A table, read in the simplest way.
struct Interpreter {
    rows: Vec<[String; 4]>,
    reset: String,
    n_inputs: usize,
    n_outputs: usize,
}

impl Interpreter {
    fn of(text: &str) -> Self {
        let mut table =
            Interpreter { rows: Vec::new(), reset: String::new(), n_inputs: 0, n_outputs: 0 };
        for line in text.lines() {
            let words: Vec<&str> =
                line.split('#').next().unwrap_or_default().split_whitespace().collect();
            match words[..] {
                [".i", n] => table.n_inputs = n.parse().expect("a number"),
                [".o", n] => table.n_outputs = n.parse().expect("a number"),
                [".r", state] => table.reset = state.to_owned(),
                [x, from, to, y] if !x.starts_with('.') => {
                    table.rows.push([x, from, to, y].map(str::to_owned));
                }
                _ => {}
            }
        }
        if table.reset.is_empty() {
            let [_, from, to, _] = &table.rows[0];
            table.reset = if from == "*" { to.clone() } else { from.clone() };
        }
        table
    }

    /// The next state and the outputs, each `None` if it is undefined.
    fn step(&self, state: &str, inputs: &[bool]) -> (Option<String>, Vec<Option<bool>>) {
        let mut next = None;
        let mut outputs = vec![None; self.n_outputs];
        for [x, from, to, y] in &self.rows {
            let is_here = from == state || from == "*";
            let fits = x.chars().zip(inputs).all(|(c, value)| c == '-' || (c == '1') == *value);
            if is_here && fits {
                if to != "*" && to != "-" {
                    next = Some(to.clone());
                }
                for (output, c) in outputs.iter_mut().zip(y.chars()) {
                    if c != '-' {
                        *output = Some(c == '1');
                    }
                }
            }
        }
        (next, outputs)
    }

    /// An input that some row of the state covers, or sometimes a random input.
    fn some_inputs(&self, state: &str, random: &mut Random) -> Vec<bool> {
        let rows: Vec<&[String; 4]> =
            self.rows.iter().filter(|row| row[1] == state || row[1] == "*").collect();
        let row = if random.one_in(20) { None } else { random.pick(&rows) };
        (0..self.n_inputs)
            .map(|at| match row.and_then(|row| row[0].as_bytes().get(at)) {
                Some(b'0') => false,
                Some(b'1') => true,
                _ => random.one_in(2),
            })
            .collect()
    }
}

fn net_of(name: &str, text: &str) -> Valid<Net> {
    let mut sources = Sources::default();
    let main = sources.add(name, text);
    let asked = Texts { main, language: Language::named("kiss2"), ..Texts::default() };
    let (design, found) = read(&sources, &asked, ReadLimits::default());
    match design {
        Some(Design::Net(design)) => design.net,
        Some(Design::Logic(_)) | None => panic!("{name}: {found:#?}"),
    }
}

/// Runs a table in the reference simulator and as a circuit, and compares both with the interpreter.
fn check(name: &str, text: &str, n_steps: u64) -> u64 {
    let table = Interpreter::of(text);
    let net = net_of(name, text);
    let step_of: BTreeMap<String, _> = {
        let (machine, _) = kiss2::parse(grafsynth_ir::FileId(0), text);
        let machine = machine.expect("a table");
        machine.states.into_iter().map(|state| state.name).zip(net.steps.ids()).collect()
    };
    let mut random = Random::new(71);
    let mut simulator = Simulator::new(&net);
    simulator.reset();
    let mut state = table.reset.clone();
    let mut stimulus = Stimulus::new(&net);
    // The defined outputs of each row. After the first undefined state, the outputs of a circuit are undefined.
    let mut said: Vec<Vec<Option<bool>>> = Vec::new();
    let (mut is_known, mut n_said) = (true, 0_u64);
    for step in 0..n_steps {
        let inputs = table.some_inputs(&state, &mut random);
        let mut row = InputRow { dt: 1, ..InputRow::zero(&net) };
        for (id, value) in net.inputs.ids().zip(&inputs) {
            row = row.with(id, i64::from(*value));
        }
        let (next, outputs) = table.step(&state, &inputs);
        let shown = simulator.step(&row);
        for (id, wanted) in net.outputs.ids().zip(&outputs) {
            let is_open = shown.open.outputs.contains(&id);
            match wanted {
                Some(wanted) => {
                    assert_eq!(
                        shown.outputs[id.index()] != 0,
                        *wanted,
                        "{name}, step {step} in {state}"
                    );
                    assert!(!is_open, "{name}, step {step} in {state}: undefined but set");
                    n_said += 1;
                }
                None => assert!(is_open, "{name}, step {step} in {state}: defined but not set"),
            }
        }
        assert_eq!(shown.open.next, next.is_none(), "{name}, step {step} in {state}");
        if is_known {
            stimulus.push(&row);
            said.push(outputs);
        }
        match next {
            Some(next) => {
                assert_eq!(shown.steps, [step_of[&next]], "{name}, step {step} in {state}");
                state = next;
            }
            None => {
                is_known = false;
                simulator.reset();
                state.clone_from(&table.reset);
            }
        }
    }
    let logic = pipeline::logic(&net, &structural_facts(&net)).expect("a circuit");
    let trace = logic_trace(&net, &logic, &stimulus).expect("a chip's stimulus");
    let first = trace.layout.columns.iter().position(
        |column| matches!(column.kind, grafsynth_sim::ColumnKind::Output(id) if id.index() == 0),
    );
    let first = first.expect("an output");
    for (at, outputs) in said.iter().enumerate() {
        for (output, wanted) in outputs.iter().enumerate() {
            if let Some(wanted) = wanted {
                let value = &trace.rows[at + 1].values[first + output];
                assert_eq!(
                    *value,
                    Value::Number(i64::from(*wanted)),
                    "{name}: circuit, row {}",
                    at + 1
                );
            }
        }
    }
    n_said
}

#[test]
fn tables_by_others_run_as_an_interpreter_says() {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/corpus");
    let root = std::env::var_os("GRAFSYNTH_CORPUS").map_or(beside, PathBuf::from);
    let Ok(entries) = std::fs::read_dir(root.join("kiss2")) else {
        println!("skipped: no corpus (GRAFSYNTH_CORPUS names its folder)");
        return;
    };
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.sort();
    let mut n_files = 0;
    for path in files.iter().filter(|path| path.extension().is_some_and(|ext| ext == "kiss2")) {
        let text = std::fs::read_to_string(path).expect("a text");
        let n_said = check(&path.display().to_string(), &text, rounds(200, 10_000));
        assert!(n_said > 0, "{}: nothing was compared", path.display());
        n_files += 1;
    }
    println!("{n_files} tables");
    assert!(n_files > 0);
}

#[test]
fn random_tables_run_as_an_interpreter_says() {
    let mut random = Random::new(5);
    let mut n_said = 0;
    for round in 0..rounds(40, 1000) {
        let text = random_table(&mut random);
        n_said += check(&format!("round {round}\n{text}"), &text, 60);
    }
    assert!(n_said > 1000, "{n_said} values compared");
}

/// A chart, its table, and the table read back behave the same from the first reaction on.
#[test]
fn charts_written_as_tables_read_back_equal() {
    let mut n_tables = 0;
    for seed in 0..rounds(60, 1000) {
        let net = random_net(seed, &Features::chip());
        let Ok(machine) = automaton::machine_within(&net, 20_000) else { continue };
        if machine.outputs.is_empty() || machine.states.len() > 300 {
            continue;
        }
        let text = kiss2::write(&machine);
        let (again, found) = kiss2::parse(grafsynth_ir::FileId(0), &text);
        assert_eq!(found, [], "seed {seed}\n{text}");
        let again = again.expect("a table");
        assert_eq!(
            kiss2::write(&kiss2::Machine { name: machine.name.clone(), ..again }),
            text,
            "seed {seed}"
        );
        let back = net_of("back.kiss2", &text);
        let has_tick = machine.inputs.last().is_some_and(|name| name == "tick");
        let stimulus = Stimulus::random(&net, 200, seed, 1);
        let (mut left, mut right) = (Simulator::new(&net), Simulator::new(&back));
        left.reset();
        right.reset();
        for (row, input) in stimulus.rows().enumerate() {
            let mut taken = InputRow { dt: 1, ..InputRow::zero(&back) };
            let mut ids = back.inputs.ids();
            for (id, _) in net
                .inputs
                .iter()
                .filter(|(_, input)| input.kind != grafsynth_ir::net::InputKind::InternalEvent)
            {
                taken = taken.with(ids.next().expect("an input"), input.value(id));
            }
            if has_tick {
                taken = taken.with(ids.next().expect("the tick"), i64::from(input.dt));
            }
            let ours = left.step(&input).clone();
            let theirs = right.step(&taken);
            if ours.open.next || ours.open.row {
                break;
            }
            for (id, twin) in net.outputs.ids().zip(back.outputs.ids()) {
                if !ours.open.outputs.contains(&id) {
                    assert_eq!(
                        ours.outputs[id.index()] != 0,
                        theirs.outputs[twin.index()] != 0,
                        "seed {seed}, row {row}, {}\n{text}",
                        net.outputs[id].name
                    );
                    assert!(
                        !theirs.open.outputs.contains(&twin) && !theirs.open.row,
                        "seed {seed}, row {row}"
                    );
                }
            }
        }
        n_tables += 1;
    }
    println!("{n_tables} tables");
    assert!(n_tables >= 5, "{n_tables} tables");
}

/// A table that is equal except for its states' names and encoding compares as equal.
#[test]
fn the_truck_and_its_table_compare_equal() {
    let mut sources = Sources::default();
    let main = sources.add("truck.graf", include_str!("../../examples/truck/truck.graf"));
    let (design, _) = read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default());
    let Some(Design::Net(design)) = design else { panic!("the truck is a chart") };
    let text = kiss2::write(&automaton::machine(&design.net).expect("a table"));
    let back = net_of("truck.kiss2", &text);
    let stimulus = Stimulus::random(&design.net, 2000, 3, 1);
    let outcome = compare::nets(&design.net, &back, &stimulus).expect("columns in common");
    assert_eq!((outcome.difference, outcome.n_columns), (None, 4), "three outputs and the steps");
}
