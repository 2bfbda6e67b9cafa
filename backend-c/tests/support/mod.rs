//! Small hand-written nets, and C compilers to test them with.
#![allow(dead_code, reason = "each test file uses its part")]
#![allow(
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "tests try the text on real compilers and report what they skip"
)]

pub(crate) mod random_net;

use itertools::Itertools as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use grafsynth_backend_c::Package;
use grafsynth_ir::expr::Type;
use grafsynth_ir::facts::{Component, Facts, Proof};
use grafsynth_ir::net::*;
use grafsynth_ir::random::Random;
use grafsynth_ir::{Name, Span, Valid, validate};

/// Builds a net.
pub(crate) struct Build {
    pub(crate) net: Net,
}

pub(crate) fn name(text: &str) -> Name {
    Name::new(text, Span::default())
}

impl Build {
    pub(crate) fn new(title: &str) -> Self {
        let mut net = Net { name: name(title), ..Net::default() };
        net.settings.policy = Policy::Priority;
        net.parts.push(Part { name: name(title), level: 1, ..Part::default() });
        Build { net }
    }

    pub(crate) fn input(&mut self, text: &str) -> InputId {
        self.input_of(text, Type::Bool, InputKind::Pin)
    }

    pub(crate) fn input_of(&mut self, text: &str, ty: Type, kind: InputKind) -> InputId {
        self.net.inputs.push(Input {
            name: name(text),
            ty,
            kind,
            synchronous: false,
            meta: Meta::default(),
        })
    }

    pub(crate) fn output(&mut self, text: &str, driver: Driver) -> OutputId {
        let ty = match &driver {
            Driver::Stored(var) => self.net.vars[*var].ty,
            _ => Type::Bool,
        };
        self.net.outputs.push(Output {
            safe: None,
            name: name(text),
            ty,
            driver,
            registered: false,
            meta: Meta::default(),
        })
    }

    /// A continuous output assigned in these steps.
    pub(crate) fn lamp(&mut self, text: &str, steps: &[StepId]) -> OutputId {
        let emissions = steps
            .iter()
            .map(|step| Emission { step: *step, condition: None, span: Span::default() })
            .collect();
        self.output(text, Driver::Continuous(emissions))
    }

    pub(crate) fn var(&mut self, text: &str, lo: i64, hi: i64, init: i64) -> VarId {
        self.net.vars.push(Var {
            name: name(text),
            ty: Type::Int { lo, hi },
            len: None,
            init: vec![init],
            origin: VarOrigin::Declared,
            meta: Meta::default(),
        })
    }

    pub(crate) fn step(&mut self, text: &str, is_initial: bool) -> StepId {
        self.net.steps.push(Step { is_initial, ..Step::new(name(text), PartId::from_index(0)) })
    }

    pub(crate) fn transition(
        &mut self,
        text: &str,
        from: &[StepId],
        to: &[StepId],
        guard: Expr,
    ) -> TransitionId {
        self.net.transitions.push(Transition {
            name: name(text),
            part: PartId::from_index(0),
            kind: TransitionKind::Move,
            requires: from.to_vec(),
            clears: from.to_vec(),
            enters: to.iter().map(|step| Enter::Step(*step)).collect(),
            events: vec![],
            guard,
            priority: None,
            restart: false,
            actions: vec![],
            deadline_ns: None,
            meta: Meta::default(),
        })
    }

    pub(crate) fn valid(self) -> Valid<Net> {
        validate(self.net).expect("the net is valid")
    }
}

pub(crate) fn read(input: InputId) -> Expr {
    Expr::leaf(Leaf::Input(input), Span::default())
}

pub(crate) fn component(steps: &[StepId], always: bool) -> Component {
    Component { steps: steps.to_vec(), always, by: Proof::Structural }
}

pub(crate) fn facts(components: Vec<Component>) -> Facts {
    Facts { components, ..Facts::default() }
}

/// The truck example: loading a truck.
pub(crate) fn truck() -> (Valid<Net>, Facts) {
    let mut b = Build::new("truck");
    b.net.settings.policy = Policy::PriorityAge;
    let labels = ["loading request", "right limit", "loaded", "left limit"];
    let inputs: Vec<InputId> = ["m", "b", "p", "a"].iter().map(|text| b.input(text)).collect();
    for (id, label) in inputs.iter().zip(labels) {
        b.net.inputs[*id].meta.label = label.to_string();
    }
    let steps: Vec<StepId> = (1..=4).map(|k| b.step(&format!("p{k}"), k == 1)).collect();
    b.net.steps[steps[0]].meta.label = "waiting".to_string();
    for (k, (text, label)) in
        [("R", "move right"), ("Z", "load"), ("L", "move left")].iter().enumerate()
    {
        let id = b.lamp(text, &steps[k + 1..k + 2]);
        b.net.outputs[id].meta.label = (*label).to_string();
    }
    for k in 0..4 {
        b.transition(&format!("t{}", k + 1), &[steps[k]], &[steps[(k + 1) % 4]], read(inputs[k]));
    }
    (b.valid(), facts(vec![component(&steps, true)]))
}

/// Rings of `ring` steps each, `n` steps in total; step k drives the output k mod 16 and waits for the input k mod 16.
pub(crate) fn rings(title: &str, n: usize, ring: usize) -> (Valid<Net>, Facts) {
    let mut b = Build::new(title);
    let inputs: Vec<InputId> = (0..16).map(|k| b.input(&format!("i{k}"))).collect();
    let steps: Vec<StepId> = (0..n).map(|k| b.step(&format!("st{k}"), k % ring == 0)).collect();
    for o in 0..16 {
        let mine: Vec<StepId> = steps.iter().copied().skip(o).step_by(16).collect();
        b.lamp(&format!("o{o}"), &mine);
    }
    for k in 0..n {
        let next = if k % ring == ring - 1 { k + 1 - ring } else { k + 1 };
        b.transition(&format!("t{k}"), &[steps[k]], &[steps[next]], read(inputs[k % 16]));
    }
    let components = steps.chunks(ring).map(|steps| component(steps, true)).collect();
    (b.valid(), facts(components))
}

/// A folder for one test's files, removed when it goes out of scope.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new(tag: &str) -> Self {
        let path = std::env::temp_dir().join(format!("grafsynth-c-{tag}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("the folder can be made");
        Folder(path)
    }

    pub(crate) fn write(&self, package: &Package) {
        for file in &package.files {
            std::fs::write(self.0.join(&file.name), &file.text).expect("the file can be written");
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// True if the tool is available; reports it if not.
pub(crate) fn have(tool: &str) -> bool {
    let found = Command::new(tool)
        .arg("--version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok();
    if !found {
        println!("skipped: {tool} missing");
    }
    found
}

/// Runs a tool in a folder; returns its messages on failure.
pub(crate) fn run(folder: &Path, tool: &str, arguments: &[&str]) -> String {
    let output =
        Command::new(tool).args(arguments).current_dir(folder).output().expect("the tool starts");
    assert!(
        output.status.success(),
        "{tool} {arguments:?} in {}\n{}{}",
        folder.display(),
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Warnings that the emitted text must not cause.
pub(crate) const STRICT: &[&str] = &[
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Werror",
    "-pedantic",
    "-Wconversion",
    "-Wsign-conversion",
    "-Wshadow",
];

/// Compiles every C file of the package with every available compiler.
pub(crate) fn compiles_everywhere(folder: &Folder, package: &Package) {
    for compiler in ["gcc", "clang", "avr-gcc", "arm-none-eabi-gcc"] {
        if !have(compiler) {
            continue;
        }
        for file in package.files.iter().filter(|file| file.name.ends_with(".c")) {
            for level in ["-Os", "-O2"] {
                let mut arguments = STRICT.to_vec();
                arguments.extend([level, "-c", &file.name, "-o", "x.o"]);
                if compiler == "avr-gcc" {
                    arguments.push("-mmcu=atmega328p");
                }
                run(&folder.0, compiler, &arguments);
            }
        }
    }
    for compiler in ["g++", "clang++"] {
        if !have(compiler) {
            continue;
        }
        for file in package.files.iter().filter(|file| file.name.ends_with(".c")) {
            run(
                &folder.0,
                compiler,
                &[
                    "-x",
                    "c++",
                    "-std=c++11",
                    "-Wall",
                    "-Wextra",
                    "-Werror",
                    "-c",
                    &file.name,
                    "-o",
                    "x.o",
                ],
            );
        }
    }
}

/// The total size of the `.text` sections in bytes.
pub(crate) fn text_size(folder: &Folder, file: &str, compiler: &str, flags: &[&str]) -> usize {
    let mut arguments = vec!["-Os", "-c", file, "-o", "size.o"];
    arguments.extend(flags);
    run(&folder.0, compiler, &arguments);
    let size = compiler.replace("gcc", "size");
    let size = if size == "size" { "size".to_string() } else { size };
    let table = run(&folder.0, &size, &["-A", "size.o"]);
    table
        .lines()
        .filter(|line| {
            line.starts_with(".text") || line.starts_with(".rodata") || line.starts_with(".progmem")
        })
        .filter_map(|line| line.split_whitespace().nth(1)?.parse::<usize>().ok())
        .sum()
}

/// Input lines for a harness: the ticks, then a value for each input that has a column.
pub(crate) fn stimulus(net: &Net, rows: usize, seed: u64) -> Vec<(u32, Vec<i64>)> {
    let mut random = Random::new(seed);
    let mut values: Vec<i64> = net.inputs.values().map(|input| input.ty.saturate(0)).collect();
    (0..rows)
        .map(|_| {
            for (id, input) in net.inputs.iter() {
                let (lo, hi) = input.ty.bounds();
                if input.kind == InputKind::InternalEvent {
                    continue;
                }
                if input.kind == InputKind::Event || random.one_in(3) {
                    values[id.index()] = random.between(lo, hi);
                }
            }
            let dt = match random.below(8) {
                0 => 0,
                1 => random.between(2, 9) as u32,
                2 if random.one_in(20) => 100_000,
                _ => 1,
            };
            (dt, values.clone())
        })
        .collect()
}

/// The lines as text.
pub(crate) fn stimulus_text(net: &Net, rows: &[(u32, Vec<i64>)]) -> String {
    let mut text = String::new();
    for (dt, values) in rows {
        text.push_str(&dt.to_string());
        for (id, input) in net.inputs.iter() {
            if input.kind != InputKind::InternalEvent {
                text.push_str(&format!(" {}", values[id.index()]));
            }
        }
        text.push('\n');
    }
    text
}

/// The trace of the reaction program, run by its interpreter.
pub(crate) fn program_trace(net: &Valid<Net>, rows: &[(u32, Vec<i64>)]) -> String {
    use grafsynth_ir::program::{Origin, ResetEffect};
    let program = grafsynth_ir::lower::program::program(net, &Default::default())
        .expect("there is a program");
    let mut machine = grafsynth_ir::program_run::Machine::new(&program);
    let has_fault = net.settings.evolution != Evolution::Single;
    let columns = net.inputs.values().filter(|it| it.kind != InputKind::InternalEvent);
    let mut heading = vec!["scan".to_string(), "dt".to_string()];
    heading.extend(columns.map(|it| it.name.text.clone()));
    heading.push("steps".to_string());
    heading.extend(net.outputs.values().map(|it| it.name.text.clone()));
    for var in net.vars.values().filter(|it| it.origin == VarOrigin::Declared) {
        match var.len {
            None => heading.push(var.name.text.clone()),
            Some(len) => heading.extend((0..len).map(|k| format!("{}[{k}]", var.name.text))),
        }
    }
    if has_fault {
        heading.push("fault".to_string());
    }
    let mut text = heading.join(",") + "\n";
    let zero: Vec<i64> = net.inputs.values().map(|it| it.ty.saturate(0)).collect();
    let first = (0, zero);
    for (scan, (dt, values)) in std::iter::once(&first).chain(rows).enumerate() {
        let shown = if scan == 0 { machine.reset() } else { machine.react(values, *dt) };
        let mut cells = vec![scan.to_string(), dt.to_string()];
        for (id, input) in net.inputs.iter() {
            if input.kind != InputKind::InternalEvent {
                cells.push(values[id.index()].to_string());
            }
        }
        let cell = |origin: Origin| {
            program
                .cells
                .iter()
                .find(|(_, it)| it.origin == origin)
                .map(|(id, _)| machine.cell(id).to_vec())
        };
        let active = net
            .steps
            .iter()
            .filter(|(_, it)| {
                !it.hidden && !matches!(it.kind, StepKind::Composite | StepKind::Parallel)
            })
            .filter(|(id, _)| cell(Origin::Step(*id)).is_some_and(|it| it[0] != 0))
            .map(|(_, it)| it.name.text.as_str())
            .join(" ");
        cells.push(active);
        for (id, output) in net.outputs.iter() {
            let Driver::Extern { params, .. } = &output.driver else {
                cells.push(shown.outputs[id.index()].to_string());
                continue;
            };
            let calls: Vec<Vec<i64>> = shown
                .effects
                .iter()
                .filter_map(|effect| match effect {
                    ResetEffect::Call(callee, values) if *callee == id => Some(
                        values
                            .iter()
                            .zip(params)
                            .map(|(it, param)| param.ty.saturate(*it))
                            .collect(),
                    ),
                    ResetEffect::Call(..) | ResetEffect::Code(_) => None,
                })
                .collect();
            cells.push(if params.is_empty() {
                calls.len().to_string()
            } else {
                let tuple = |it: &Vec<i64>| it.iter().map(i64::to_string).join(":");
                calls.iter().map(tuple).join(";")
            });
        }
        for (id, _) in net.vars.iter().filter(|(_, it)| it.origin == VarOrigin::Declared) {
            cells.extend(cell(Origin::Var(id)).expect("shown").iter().map(i64::to_string));
        }
        if has_fault {
            cells.push(i64::from(shown.fault).to_string());
        }
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}
