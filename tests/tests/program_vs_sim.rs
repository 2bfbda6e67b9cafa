//! The reaction program of a net compared with the simulator: two independent implementations of `docs/semantics.md` must give the same rows.
//!
//! `PROGRAM_NETS=20000 cargo test -p grafsynth-tests program_vs_sim::` runs more; `PROGRAM_SEED=77` runs one net and reports the difference.

#![allow(clippy::disallowed_methods, reason = "the environment defines how many nets are run")]

use itertools::Itertools as _;
use std::collections::BTreeSet;

use grafsynth_ir::lower::program::{Additions, ProgramOptions, program_with, shared_timers};
use grafsynth_ir::net::Net;
use grafsynth_ir::program::{Expr, Leaf, Origin, Program, ResetEffect, Stmt, TempId};
use grafsynth_ir::program_run::{Machine, Shown};
use grafsynth_ir::{Valid, text};
use grafsynth_sim::{Effect, Row, Simulator, Stimulus};
use grafsynth_tests::random_net::{Features, random_net, shrink};
use grafsynth_verify::structural_facts;

/// The number of rows of one stimulus.
const ROWS: usize = 60;

/// The difference between a row of the program and a row of the simulator; `None` if both are equal.
fn difference(
    net: &Valid<Net>,
    program: &Program,
    machine: &Machine<'_>,
    shown: &Shown,
    row: &Row,
) -> Option<String> {
    if row.open.row || row.open.next {
        return None;
    }
    let mut steps = Vec::new();
    let mut vars: Vec<(usize, Vec<i64>)> = Vec::new();
    for (id, cell) in program.cells.iter() {
        if let Origin::Step(step) = cell.origin
            && machine.cell(id) == [1]
        {
            steps.push(step);
        }
        if let Origin::Var(var) = cell.origin {
            vars.push((var.index(), machine.cell(id).to_vec()));
        }
    }
    steps.sort_unstable();
    if steps != row.steps {
        let names = |ids: &[grafsynth_ir::net::StepId]| {
            ids.iter().map(|id| net.steps[*id].name.text.clone()).join(" ")
        };
        return Some(format!(
            "steps: program [{}], simulator [{}]",
            names(&steps),
            names(&row.steps)
        ));
    }
    vars.sort();
    let values: Vec<i64> = vars.into_iter().flat_map(|(_, values)| values).collect();
    if values != row.vars {
        return Some(format!("variables: program {values:?}, simulator {:?}", row.vars));
    }
    for (id, output) in net.outputs.iter() {
        let is_extern = output.is_extern();
        if !is_extern
            && !row.open.outputs.contains(&id)
            && shown.outputs[id.index()] != row.outputs[id.index()]
        {
            return Some(format!(
                "output {}: program {}, simulator {}",
                output.name,
                shown.outputs[id.index()],
                row.outputs[id.index()]
            ));
        }
        let mine: Vec<&Vec<i64>> = shown
            .effects
            .iter()
            .filter_map(|effect| match effect {
                ResetEffect::Call(called, arguments) => (*called == id).then_some(arguments),
                ResetEffect::Code(_) => None,
            })
            .collect();
        let theirs: Vec<&Vec<i64>> = row
            .effects
            .iter()
            .filter_map(|effect| match effect {
                Effect::Call(called, arguments) => (*called == id).then_some(arguments),
                Effect::Condition(_) | Effect::Code(_) => None,
            })
            .collect();
        if mine != theirs {
            return Some(format!(
                "calls of {}: program {mine:?}, simulator {theirs:?}",
                output.name
            ));
        }
    }
    (shown.fault != row.fault)
        .then(|| format!("fault: program {}, simulator {}", shown.fault, row.fault))
}

/// Runs the program and the simulator; returns the first difference, with its row.
fn run(net: &Valid<Net>, seed: u64, options: &ProgramOptions, shares: bool) -> Option<String> {
    let shared = if shares { shared_timers(net, &structural_facts(net)) } else { Vec::new() };
    let additions = Additions { shared: &shared, ..Additions::default() };
    let program = match program_with(net, options, additions) {
        Ok(program) => program,
        Err(findings) => return Some(format!("no program: {findings:?}")),
    };
    if let Some(found) = unset(&program, &program.body, &mut BTreeSet::new()) {
        return Some(found);
    }
    let mut machine = Machine::new(&program);
    let mut simulator = Simulator::new(net);
    let shown = machine.reset();
    let row = simulator.reset();
    if let Some(difference) = difference(net, &program, &machine, &shown, &row) {
        return Some(format!("row 0: {difference}"));
    }
    let stimulus = Stimulus::random(net, ROWS, seed, if seed.is_multiple_of(3) { 5 } else { 1 });
    for (at, input) in stimulus.rows().enumerate() {
        let shown = machine.react(&input.values, input.dt);
        let row = simulator.react(&input);
        if row.open.row {
            // Everything that follows from an undefined situation is undefined.
            return None;
        }
        if let Some(difference) = difference(net, &program, &machine, &shown, &row) {
            return Some(format!("row {}: {difference}", at + 1));
        }
        if row.open.next {
            return None;
        }
    }
    None
}

/// The first temp that may be read before it is set; engines that evaluate both sides of an `and` require that there is none.
fn unset(program: &Program, body: &[Stmt], set: &mut BTreeSet<TempId>) -> Option<String> {
    let reads = |expr: &Expr, set: &BTreeSet<TempId>| {
        let mut found = None;
        for leaf in expr.leaves() {
            if let Leaf::Temp(temp) = leaf
                && !set.contains(temp)
            {
                found = Some(format!("{} may be read before it is set", program.temps[*temp].name));
            }
        }
        found
    };
    for statement in body {
        let found = match statement {
            Stmt::Set(temp, value) => {
                let found = reads(value, set);
                set.insert(*temp);
                found
            }
            Stmt::Store(_, index, value) => {
                index.iter().chain([value]).find_map(|expr| reads(expr, set))
            }
            Stmt::If(condition, then, otherwise) => {
                let (mut left, mut right) = (set.clone(), set.clone());
                let found = reads(condition, set)
                    .or_else(|| unset(program, then, &mut left))
                    .or_else(|| unset(program, otherwise, &mut right));
                set.extend(left.intersection(&right));
                found
            }
            Stmt::Repeat { condition, body, .. } => {
                reads(condition, set).or_else(|| unset(program, body, &mut set.clone()))
            }
            Stmt::Output(_, value) | Stmt::Fault(value) => reads(value, set),
            Stmt::Call(_, arguments) => arguments.iter().find_map(|expr| reads(expr, set)),
            Stmt::Code(_) | Stmt::Mark(_) => None,
        };
        if found.is_some() {
            return found;
        }
    }
    None
}

fn check(seed: u64, features: &Features) {
    let net = random_net(seed, features);
    let whole = ProgramOptions { prune: false, properties: true };
    for (options, shares) in
        [(ProgramOptions::default(), false), (whole, false), (ProgramOptions::default(), true)]
    {
        if run(&net, seed, &options, shares).is_none() {
            continue;
        }
        let small = shrink(&net, |net| run(net, seed, &options, shares).is_some());
        let difference = run(&small, seed, &options, shares).unwrap_or_default();
        panic!("seed {seed}: {difference}\n{}", text::print(&small));
    }
}

fn count(default: u64) -> std::ops::Range<u64> {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    match number("PROGRAM_SEED") {
        Some(seed) => seed..seed + 1,
        None => {
            0..number("PROGRAM_NETS").unwrap_or_else(|| grafsynth_tests::rounds(default, 3_000))
        }
    }
}

#[test]
fn grafcet_nets_show_the_same() {
    use grafsynth_ir::net::Policy::{All, Priority, PriorityAge};
    let features =
        Features { policies: vec![All, Priority, PriorityAge], ..Features::everything() };
    count(200).for_each(|seed| check(seed, &features));
}

#[test]
fn statecharts_show_the_same() {
    use grafsynth_ir::net::Policy::{InnerFirst, OuterFirst};
    let features = Features { policies: vec![InnerFirst, OuterFirst], ..Features::everything() };
    count(200).for_each(|seed| check(seed, &features));
}
