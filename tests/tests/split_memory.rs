//! The flash and RAM of the CPU decide where objects are: a chart that is too large for a small microcontroller moves steps to a chip, or is refused.

#![allow(clippy::print_stdout, reason = "tests report what they did")]

use grafsynth_driver::pipeline::BuildOptions;
use grafsynth_driver::split::{
    Compile, Memory, Objective, PartDevice, Request, RequestedPart, Split, split,
};
use grafsynth_driver::stem::FileStem;
use grafsynth_engines::memory::sizes;
use grafsynth_engines::tools;
use grafsynth_ir::division::Running;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Diagnostic, Valid};
use grafsynth_split::codes::MEMORY;
use grafsynth_split::cpu::{CPUS, cpu};
use grafsynth_tests::chart;

/// Independent pairs of steps, the first ones with an output, the others with a variable of their own. With them on the CPU, no wire is needed.
fn pairs(n: usize, outputs: usize) -> Valid<Net> {
    let outputs: Vec<String> = (0..outputs).map(|at| format!("o{at}")).collect();
    let pair = |at: usize| {
        let body = match outputs.get(at) {
            Some(output) => output.clone(),
            None => format!("entry {{ v{at} := v{at} + {} }}", at % 9 + 1),
        };
        format!(
            "initial step a{at}\nstep b{at} {{ {body} }}\nu{at}: a{at} -> b{at} when go and not back\nd{at}: b{at} -> a{at} when back\n"
        )
    };
    let all: String = (0..n).map(pair).collect();
    let vars: String =
        (outputs.len()..n).map(|at| format!("var v{at}: int 0..200 = 0\n")).collect();
    let text = format!(
        "chart pairs {{\nconflict priority\ninput go, back\n{vars}output {}\n{all}}}",
        outputs.join(", ")
    );
    chart("pairs.graf", &text)
}

fn split_on(
    net: &Valid<Net>,
    (chip, cpu): (&str, &str),
    objective: Objective,
    compile: Option<Compile>,
) -> Result<Split, Vec<Diagnostic>> {
    let part = |name: &str, device: &str| RequestedPart {
        name: name.to_owned(),
        device: PartDevice::named(device).expect("the device is known"),
    };
    let (stem, options) = (FileStem::of_name("random"), BuildOptions::default());
    let request = Request {
        parts: &[part("chip", chip), part("cpu", cpu)],
        places: &[],
        running: Running::Lockstep,
        reset: true,
        objective,
        fits: 4,
        stem: &stem,
        options: &options,
        compile,
        told: |_| (),
    };
    split(net, &request)
}

/// The steps on the chip.
fn on_chip(split: &Split) -> usize {
    split.division.owners.steps.values().filter(|owner| **owner == 0).count()
}

#[test]
fn a_chart_that_is_too_large_for_the_cpu_moves_steps_to_the_chip() {
    // More outputs would not fit the pins of the CPU.
    let net = pairs(17, 8);
    // With `cells`, nothing is on the chip unless it must be.
    let large = split_on(&net, ("gal22v10", "atmega328p"), Objective::Cells, None).unwrap();
    let small = split_on(&net, ("gal22v10", "attiny2313"), Objective::Cells, None).unwrap();
    assert_eq!((on_chip(&large), large.unfit), (0, 0));
    let why = (on_chip(&small), small.unfit, &large.memory, &small.memory);
    assert!(on_chip(&small) > 0 && small.unfit > 0, "{why:?}");
    let fits = |memory: &Memory, name: &str| {
        let cpu = cpu(name).unwrap();
        memory.flash <= u64::from(cpu.flash) && memory.ram() <= u64::from(cpu.ram)
    };
    let memory = large.memory.as_ref().unwrap();
    assert!(fits(memory, "atmega328p") && !fits(memory, "attiny2313"));
    let memory = small.memory.as_ref().unwrap();
    assert!(fits(memory, "attiny2313") && memory.compiler.is_none());
    // A better partition may fit in a way that the bound does not exclude.
    assert!(small.bound <= small.value && large.bound == large.value);
}

#[test]
fn a_chart_that_fits_nowhere_is_refused_with_the_numbers() {
    let text = "chart samples {\n    input i\n    var n: int 0..199 = 0\n    var heard: int 0..200[200] = 0\n    output full\n    \
        initial step s { exit { n := n + 1; heard[n] := n } }\n    step r { full if heard[n] > 50 }\n    s -> r when i\n    r -> s when not i\n}";
    let net = chart("samples.graf", text);
    let found = split_on(&net, ("gal16v8", "attiny2313"), Objective::Cells, None).unwrap_err();
    let memory = found.iter().find(|one| one.code == MEMORY).expect("the memory is the reason");
    assert!(memory.message.starts_with("`cpu` does not fit the attiny2313: it needs "));
    assert!(
        memory.message.contains(" bytes of RAM, but has 128")
            && memory.message.ends_with("(estimated)")
    );
    assert!(memory.help.is_some());
    let conflict = &found[0].message;
    assert!(conflict.contains("the memory of `cpu`") && conflict.contains("`chip`"), "{conflict}");
}

/// What the compilers report is not above the estimate, and not below a third of it.
#[test]
fn estimates_of_memory_are_near_what_compilers_need() {
    for one in CPUS.iter().filter(|one| one.link_bytes.is_some() && one.pins.len() > 8) {
        let compiler = if one.machine == "avr" { "avr-gcc" } else { "arm-none-eabi-gcc" };
        if tools::find(&[compiler]).is_none() {
            println!("skipped {}: {compiler} is not installed", one.name);
            continue;
        }
        for n in [2, 6, 12] {
            let net = pairs(n, n);
            let of = |compile| {
                let split = split_on(&net, ("gal16v8", one.name), Objective::Cells, compile);
                split.unwrap().memory.unwrap()
            };
            let (estimate, compiled) = (of(None), of(Some(sizes as Compile)));
            println!("{} {n}: {estimate:?} {compiled:?}", one.name);
            assert_eq!(compiled.compiler, Some(compiler));
            for (estimate, compiled) in
                [(estimate.flash, compiled.flash), (estimate.ram(), compiled.ram())]
            {
                assert!(compiled <= estimate && 3 * compiled >= estimate, "{} {n}", one.name);
            }
        }
    }
}
