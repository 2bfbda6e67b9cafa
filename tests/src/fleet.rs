//! Generates many random charts in one style of C, each with different options, combines them into programs and compares them with the
//! simulator.
//!
//! ```text
//! let drawn = draw(Style::Switch, 1000);                 // charts that the style supports; rejected ones are counted separately
//! println!("{drawn}");                                   // and their features
//! check(&drawn, 20, &Compiler::watchful()?);             // each agrees with the simulator
//! ```

use crate::random_net::{Features, random_net, shrink};
use crate::{in_parallel, readable, small_limits};
use grafsynth_backend_c::{Io, Options, Package, Style, emit, multi_harness};
use grafsynth_driver::run::net_trace;
use grafsynth_engines::{c, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::expr::{ArithOp, ExprKind, Type};
use grafsynth_ir::facts::Facts;
use grafsynth_ir::net::{
    Driver, Evolution, Expr, InputKind, Leaf, Net, Policy, Schedule, StepKind, Stmt, StmtKind,
    TransitionKind,
};
use grafsynth_sim::{Directed, MAX_DT, Random, Stimulus, compare};
use grafsynth_verify::{facts, structural_facts};
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;
use std::time::Duration;

/// The number of rows of a stimulus.
const ROWS: usize = 120;
/// The number of seeds that are generated together.
const BLOCK: u64 = 64;
/// The maximum number of seeds per requested chart; beyond it, the style is reported as supporting too few charts.
const PATIENCE: u64 = 200;
const LIMIT: Duration = Duration::from_secs(120);

/// A chart that a style supports.
pub struct Chart {
    /// The seed that it was made from.
    pub seed: u64,
    /// The chart.
    pub net: Valid<Net>,
    /// The C package of the chart, with the prefix `n` and the seed.
    pub package: Package,
    /// The options with which it was emitted.
    pub options: Options,
}

/// The generated charts.
#[derive(Default)]
pub struct Drawn {
    /// The charts that the style supports, sorted by seed.
    pub charts: Vec<Chart>,
    /// The number of charts that were rejected, for each reason.
    pub refused: BTreeMap<String, u64>,
}

/// Facts as in `build`, with small limits because the nets are small. The style of a statechart needs no proved facts, and neither does
/// straight-line code.
#[must_use]
pub fn small_facts(net: &Valid<Net>, style: Style) -> Facts {
    let needs_none = net.settings.policy.is_statechart();
    if needs_none || matches!(style, Style::Bits | Style::Engine) {
        structural_facts(net)
    } else {
        facts(net, &small_limits())
    }
}

/// Random options of this style. [`emitted`] removes options that are incompatible with the chart or with each other.
#[must_use]
pub fn options(seed: u64, style: Style) -> Options {
    let mut random = Random::new(seed ^ 0x0971);
    let gate = random.one_in(3);
    Options {
        style,
        io: if random.one_in(2) { Io::Words } else { Io::Members },
        gate,
        trace: if !gate && random.one_in(3) { Some(1 + random.below(9) as u16) } else { None },
        callbacks: random.one_in(3),
        // Sometimes so small that every chart is split into functions.
        max_transitions: [200, 200, 1, 3][random.below(4)],
        prefix: Some(format!("n{seed}")),
        safe_state: random.one_in(3),
        ..Options::default()
    }
}

/// The chart in C with these options, without the options that are rejected for this chart.
///
/// # Errors
/// Returns why the style does not support the chart.
///
/// # Panics
/// If something is rejected that is not a documented limitation.
pub fn emitted(net: &Valid<Net>, mut options: Options) -> Result<(Package, Options), String> {
    let facts = small_facts(net, options.style);
    loop {
        let found = match emit(net, &facts, &options) {
            Ok(package) => return Ok((package, options)),
            Err(found) => found,
        };
        let why: String = found.iter().map(|it| it.message.clone()).collect();
        let error = found.iter().find(|it| it.severity == grafsynth_ir::diag::Severity::Error);
        match error.map(|it| it.code.id) {
            _ if options.trace.is_some() && why.contains("trace ring") => options.trace = None,
            Some("G0605") if options.gate => options.gate = false,
            Some("G0630") if options.safe_state => options.safe_state = false,
            Some("G0601") if options.style == Style::Auto || options.style == Style::Bits => {
                panic!("every valid net can be expressed in C: {found:?}\n{}", readable(net))
            }
            Some("G0601" | "G0606" | "G0620") => return Err(why),
            _ => panic!("{found:?}\n{}", readable(net)),
        }
    }
}

/// The features of a seed's chart. Of three charts, one has all features of programs, one has some of them, and one has some of the features that the
/// styles with state variables support for Grafcet, or the features of the table engine, which random charts would hardly ever have.
#[must_use]
pub fn features(seed: u64, style: Style, max_steps: usize) -> Features {
    let all = Features { max_steps, ..Features::program() };
    if style == Style::Btrans {
        // Only the features of the table layout `btrans`: with any others, hardly one chart in a thousand would be supported.
        let statecharts = Features { max_steps, ..Features::tabular_statecharts() };
        return if seed.is_multiple_of(3) { statecharts } else { statecharts.some(seed) };
    }
    if style == Style::Tables && seed % 3 == 2 {
        let mixed =
            Features { several_parts: true, timers: true, mealy: true, ..Features::plain() };
        return Features { waits_for_inputs: true, max_steps, ..mixed };
    }
    if style == Style::Engine && seed % 3 == 2 {
        // The features that the table engine supports without a program.
        let tables = [Features::tabular(), Features::tabular_statecharts()];
        let tables = tables[(seed / 3 % 2) as usize].clone();
        return Features { several_parts: true, max_steps, ..tables };
    }
    match seed % 3 {
        0 if style != Style::Engine => all,
        1 => all.some(seed),
        _ => Features {
            fire_one: false,
            forcing: false,
            tasks: false,
            enclosing: false,
            step_actions: (seed / 3).is_multiple_of(2),
            ..all.without_statecharts()
        }
        .some(seed),
    }
}

/// Generates charts until `wanted` of them are supported, equally many of each kind of [`features`]: otherwise kinds that a style often rejects would
/// be rare.
///
/// # Panics
/// If the style supports fewer than one in `PATIENCE` charts.
#[must_use]
pub fn draw(style: Style, wanted: u64) -> Drawn {
    let mut drawn = Drawn::default();
    let mut left = [0, 1, 2].map(|kind| (wanted + 2 - kind) / 3);
    let (mut next, block) = (0, BLOCK.min(3 * wanted));
    while left.iter().sum::<u64>() > 0 {
        assert!(next < wanted * PATIENCE, "{left:?} left at {next}: {:?}", drawn.refused);
        let kind = |seed: u64| (seed % 3) as usize;
        let seeds: Vec<u64> = (next..next + block).filter(|seed| left[kind(*seed)] > 0).collect();
        next += block;
        let found = in_parallel(&seeds, |seed| {
            let net = random_net(*seed, &features(*seed, style, 12));
            let (package, options) = emitted(&net, options(*seed, style))?;
            if style == Style::Tables && kind(*seed) == 2 && package.style != "switch with tables" {
                return Err("no component waits for inputs only".to_owned());
            }
            if style == Style::Engine && kind(*seed) == 2 && package.style != "engine" {
                return Err("tables cannot express all of it without a program".to_owned());
            }
            Ok(Chart { seed: *seed, net, package, options })
        });
        for found in found {
            match found {
                Ok(chart) if left[kind(chart.seed)] > 0 => {
                    left[kind(chart.seed)] -= 1;
                    drawn.charts.push(chart);
                }
                Ok(_) => {}
                Err(why) => *drawn.refused.entry(why).or_default() += 1,
            }
        }
    }
    drawn
}

/// The charts of the first seeds that a style supports: half of them with all of these features, half with some of them.
#[must_use]
pub fn draw_of(style: Style, seeds: u64, features: &Features) -> Drawn {
    let seeds: Vec<u64> = (0..seeds).collect();
    let found = in_parallel(&seeds, |seed| {
        let all = seed.is_multiple_of(2);
        let net = random_net(*seed, &if all { features.clone() } else { features.some(*seed) });
        let (package, options) = emitted(&net, options(*seed, style))?;
        Ok(Chart { seed: *seed, net, package, options })
    });
    let mut drawn = Drawn::default();
    for found in found {
        match found {
            Ok(chart) => drawn.charts.push(chart),
            Err(why) => *drawn.refused.entry(why).or_default() += 1,
        }
    }
    drawn
}

/// Random rows for a chart. With a gate, each row occurs three times, so that the gate closes; some rows have ticks that pass long times at once.
#[must_use]
pub fn stimulus(net: &Valid<Net>, seed: u64, options: &Options) -> Stimulus {
    let most = [3, 3, 300, 70_000][(seed / 2 % 4) as usize];
    if !options.gate {
        return Stimulus::random(net, ROWS, seed, most);
    }
    let rows: Vec<_> = Stimulus::random(net, ROWS / 3, seed, most).rows().collect();
    Stimulus::of_rows(net, rows.iter().flat_map(|row| [row, row, row]))
}

/// A compiler with its flags.
#[derive(Debug, Clone)]
pub struct Compiler {
    /// The program.
    pub path: PathBuf,
    /// Its arguments.
    pub flags: Vec<&'static str>,
}

impl Compiler {
    /// A C99 compiler with the address and undefined-behaviour sanitizers, without optimisation, because optimising would take the most
    /// time. `None` if no compiler has both; clang first, which is faster.
    #[must_use]
    pub fn watchful() -> Option<Self> {
        let flags =
            vec!["-std=c99", "-O0", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
        [tools::find(&["clang"]), tools::c_compiler()].into_iter().flatten().find_map(|path| {
            let compiler = Compiler { path, flags: flags.clone() };
            compiler.program("int main(void) { return 0; }").is_ok().then_some(compiler)
        })
    }

    /// A compiler that checks every number: clang with its integer sanitizer, which also stops at an implicit conversion that changes a value, and at a shift
    /// that loses bits. Unsigned sums may overflow, because hash generators and ring indices rely on it. The sanitizer stops the program by a signal, which
    /// needs no runtime library. `None` without clang.
    #[must_use]
    pub fn exact() -> Option<Self> {
        let path = tools::find(&["clang"])?;
        let flags = vec![
            "-std=c99",
            "-O0",
            "-g",
            "-fsanitize=integer",
            "-fno-sanitize=unsigned-integer-overflow",
            "-fsanitize-trap=all",
        ];
        let compiler = Compiler { path, flags };
        compiler.program("int main(void) { return 0; }").is_ok().then_some(compiler)
    }

    /// The host's compiler without sanitizers.
    #[must_use]
    pub fn plain() -> Option<Self> {
        Some(Compiler { path: tools::c_compiler()?, flags: vec!["-std=c99", "-O0"] })
    }

    fn program(&self, text: &str) -> Result<c::Program, String> {
        c::compile_text_by(&self.path, text, &self.flags)
    }
}

/// Combines charts into one program and compares each with the simulator: `None`, or the first difference in words.
#[must_use]
pub fn run(charts: &[&Chart], compiler: &Compiler) -> Option<(usize, String)> {
    let program = match compiler.program(&text(charts)) {
        Ok(program) => program,
        Err(why) => return Some((0, why)),
    };
    let stimuli: Vec<Stimulus> =
        charts.iter().map(|it| stimulus(&it.net, it.seed, &it.options)).collect();
    // One run for all charts; each stimulus ends with an empty line.
    let input: String = (charts.iter().zip(&stimuli))
        .map(|(chart, stimulus)| c::lines(&chart.net, stimulus) + "\n")
        .collect();
    let folder = program.folder.path();
    let output = match tools::run(&program.path, &[], folder, input.as_bytes(), LIMIT) {
        Err(why) => return Some((0, why)),
        Ok(run) if !run.is_success => return Some((0, format!("{} {}", run.ending, run.stderr))),
        Ok(run) => String::from_utf8_lossy(&run.stdout).into_owned(),
    };
    // Each trace follows a line with its number, and does not contain `#` itself.
    let traces: Vec<&str> = output.split('#').skip(1).collect();
    charts.iter().zip(&stimuli).enumerate().find_map(|(at, (chart, stimulus))| {
        let trace = traces.get(at).and_then(|it| it.split_once('\n')).map_or("", |it| it.1);
        let apart = differs(&chart.net, stimulus, trace.as_bytes()).or_else(|| {
            directed(&chart.net, chart.seed).iter().find_map(|stimulus| {
                let input = c::lines(&chart.net, stimulus);
                match tools::run(&program.path, &[&at.to_string()], folder, input.as_bytes(), LIMIT)
                {
                    Err(why) => Some(why),
                    Ok(run) if !run.is_success => Some(format!("{} {}", run.ending, run.stderr)),
                    Ok(run) => differs(&chart.net, stimulus, &run.stdout),
                }
            })
        });
        apart.map(|why| (at, why))
    })
}

/// Where the output of a program differs from the simulator.
fn differs(net: &Valid<Net>, stimulus: &Stimulus, printed: &[u8]) -> Option<String> {
    match c::parse(net, printed) {
        Err(why) => Some(format!("{why:?}")),
        Ok(got) => compare(&net_trace(net, stimulus), &got).map(|apart| format!("{apart:?}")),
    }
}

/// The number of directed reactions of a chart.
const DIRECTED: usize = 400;

/// Stimuli from reset, each to a transition that fires for the first time.
fn directed(net: &Valid<Net>, seed: u64) -> Vec<Stimulus> {
    let mut directed = Directed::new(net, seed, MAX_DT);
    let mut all = Vec::new();
    let mut n_fired = 0;
    for _ in 0..DIRECTED {
        let fired = directed.next().map_or(n_fired, |_| directed.coverage().fired);
        if fired > n_fired {
            all.push(Stimulus::of_rows(net, &directed.path()));
        }
        n_fired = fired;
    }
    all
}

/// One program of many charts.
#[must_use]
pub fn text(charts: &[&Chart]) -> String {
    let pairs: Vec<(&Valid<Net>, &Package)> =
        charts.iter().map(|chart| (&chart.net, &chart.package)).collect();
    multi_harness(&pairs)
}

/// Runs all charts, `unit` of them per program; the first difference is shrunk.
///
/// # Panics
/// If a chart in C differs from its net, or has undefined behaviour.
pub fn check(drawn: &Drawn, unit: usize, compiler: &Compiler) {
    let units: Vec<Vec<&Chart>> =
        drawn.charts.chunks(unit).map(|unit| unit.iter().collect()).collect();
    let found = in_parallel(&units, |unit| run(unit, compiler));
    let mut found = found.into_iter().zip(&units);
    let Some((at, why, unit)) =
        found.find_map(|(found, unit)| found.map(|(at, why)| (at, why, unit)))
    else {
        return;
    };
    // A program that aborts does not report which chart it was running.
    let alone = unit.iter().find_map(|it| Some((*it, run(&[it], compiler)?.1)));
    let (chart, why) = alone.unwrap_or((unit[at], why));
    let small = shrink(&chart.net, |net| difference(net, chart, compiler).is_some());
    panic!(
        "seed {}, {:?}: {why}\nshrunk: {:?}\n{}",
        chart.seed,
        chart.options,
        difference(&small, chart, compiler),
        readable(&small)
    );
}

/// The difference of another net with the stimuli of a chart.
fn difference(net: &Valid<Net>, like: &Chart, compiler: &Compiler) -> Option<String> {
    let (package, options) = emitted(net, like.options.clone()).ok()?;
    let chart = Chart { seed: like.seed, net: net.clone(), package, options };
    run(&[&chart], compiler).map(|(_, why)| why)
}

type Has = fn(&Chart) -> bool;

/// The properties of charts, each with its test.
pub const PROPERTIES: &[(&str, Has)] = &[
    ("conflict all", |it| it.net.settings.policy == Policy::All),
    ("conflict priority", |it| it.net.settings.policy == Policy::Priority),
    ("conflict priority-age", |it| it.net.settings.policy == Policy::PriorityAge),
    ("conflict inner-first", |it| it.net.settings.policy == Policy::InnerFirst),
    ("conflict outer-first", |it| it.net.settings.policy == Policy::OuterFirst),
    ("fire one", |it| it.net.settings.fire_one),
    ("schedule level", |it| it.net.settings.schedule == Schedule::Level),
    ("schedule priority", |it| it.net.settings.schedule == Schedule::Priority),
    ("evolution single", |it| it.net.settings.evolution == Evolution::Single),
    ("evolution stable", |it| it.net.settings.evolution != Evolution::Single),
    ("assign simultaneous", |it| it.net.settings.assign_simultaneous),
    ("final scan", |it| it.net.settings.final_scan),
    ("queue", |it| it.net.settings.queue.is_some()),
    ("edges", |it| !it.net.edges.is_empty()),
    ("timers", |it| !it.net.timers.is_empty()),
    ("times of 255 ticks and more", |it| {
        waits_long(&it.net)
            || it.net.actions.values().any(|it| it.duration >= 255)
            || it.net.sends.values().any(|it| it.delay >= 255)
    }),
    ("numbers", |it| ranges(&it.net).next().is_some()),
    ("negative numbers", |it| ranges(&it.net).any(|(lo, _)| lo < 0)),
    ("numbers of 16 bits", |it| ranges(&it.net).any(|range| bits(range) == 16)),
    ("numbers of 32 bits", |it| ranges(&it.net).any(|range| bits(range) == 32)),
    ("division", |it| divides(&it.net, false)),
    ("division by a non-constant", |it| divides(&it.net, true)),
    ("arrays", |it| it.net.vars.values().any(|var| var.len.is_some())),
    ("events", |it| it.net.inputs.values().any(|it| it.kind == InputKind::Event)),
    ("internal events", |it| it.net.inputs.values().any(|it| it.kind == InputKind::InternalEvent)),
    ("extern conditions", |it| it.net.inputs.values().any(|it| it.kind == InputKind::Extern)),
    ("extern actions", |it| it.net.outputs.values().any(|it| it.is_extern())),
    ("an END that waits", |it| it.net.ending.is_some()),
    ("firings shown", |it| it.net.outputs.values().any(|it| matches!(it.driver, Driver::Fires(_)))),
    ("mealy outputs", |it| it.net.outputs.values().any(|it| matches!(it.driver, Driver::Mealy(_)))),
    ("stored outputs", |it| {
        it.net.outputs.values().any(|it| matches!(it.driver, Driver::Stored(_)))
    }),
    ("qualified actions", |it| !it.net.actions.is_empty()),
    ("tasks", |it| it.net.steps.values().any(|step| !step.tasks.is_empty())),
    ("reactions", |it| it.net.transitions.values().any(|it| it.kind == TransitionKind::Reaction)),
    ("restart", |it| it.net.transitions.values().any(|it| it.restart)),
    ("priorities", |it| it.net.transitions.values().any(|it| it.priority.is_some())),
    ("sources and sinks", |it| {
        it.net.transitions.values().any(|it| {
            it.kind == TransitionKind::Move && (it.requires.is_empty() || it.enters.is_empty())
        })
    }),
    ("forks and joins", |it| {
        it.net.transitions.values().any(|it| it.requires.len() > 1 || it.enters.len() > 1)
    }),
    ("several parts", |it| it.net.parts.len() > 1),
    ("forcing", |it| !it.net.forcings.is_empty()),
    ("enclosing steps", |it| has_kind(&it.net, StepKind::Enclosing)),
    ("regions", |it| has_kind(&it.net, StepKind::Parallel)),
    ("histories", |it| !it.net.histories.is_empty()),
    ("histories with content", |it| {
        it.net.histories.values().any(|it| !it.default_content.is_empty())
    }),
    ("entries that read states", |it| {
        it.net.steps.values().any(|step| step.entry.iter().any(reads_states))
    }),
    ("sends", |it| !it.net.sends.is_empty()),
    ("delayed sends", |it| it.net.sends.values().any(|it| it.delay > 0)),
    ("12 inputs and more", |it| it.net.inputs.len() >= 12),
    ("final states", |it| has_kind(&it.net, StepKind::Final)),
    ("emergency", |it| it.net.emergency.is_some()),
    ("safe values without one", |it| {
        it.net.emergency.is_none() && it.net.outputs.values().any(|it| it.safe.is_some())
    }),
    ("words", |it| it.options.io == Io::Words),
    ("gate", |it| it.options.gate),
    ("safe state", |it| it.options.safe_state),
    ("trace", |it| it.options.trace.is_some()),
    ("callbacks", |it| it.options.callbacks),
    ("split functions", |it| it.options.max_transitions < 200),
];

fn reads_states(stmt: &Stmt) -> bool {
    let StmtKind::If { condition, .. } = &stmt.kind else { return false };
    condition.leaves().any(|leaf| matches!(leaf, Leaf::Active(_)))
}

fn has_kind(net: &Net, kind: StepKind) -> bool {
    net.steps.values().any(|step| step.kind == kind)
}

/// Visits every part of every expression.
fn for_each_part(net: &Net, visit: &mut impl FnMut(&Expr)) {
    for expr in net.expressions() {
        let mut todo = vec![expr];
        while let Some(part) = todo.pop() {
            visit(part);
            todo.extend(part.children());
        }
    }
}

fn waits_long(net: &Net) -> bool {
    let mut found = false;
    for_each_part(net, &mut |part| {
        if let ExprKind::Compare(_, time, ticks) = &part.kind {
            let is_time = matches!(&time.kind, ExprKind::Leaf(leaf) if leaf.is_time());
            found |= is_time && matches!(ticks.kind, ExprKind::Int(255..));
        }
    });
    found
}

fn ranges(net: &Net) -> impl Iterator<Item = (i64, i64)> {
    let types = net.inputs.values().map(|it| it.ty).chain(net.vars.values().map(|it| it.ty));
    types.filter(|ty| !ty.is_bool()).map(Type::bounds)
}

fn bits((lo, hi): (i64, i64)) -> u32 {
    let fits = |bits: u32| {
        let most = 1_i64 << bits;
        (lo >= 0 && hi < most) || (lo >= -most / 2 && hi < most / 2)
    };
    [8, 16, 32].into_iter().find(|bits| fits(*bits)).unwrap_or(64)
}

fn divides(net: &Net, by_no_constant: bool) -> bool {
    let mut found = false;
    for_each_part(net, &mut |part| {
        if let ExprKind::Arith(ArithOp::Div | ArithOp::Mod, _, by) = &part.kind {
            found |= !by_no_constant || !matches!(by.kind, ExprKind::Int(_));
        }
    });
    found
}

impl Drawn {
    /// The number of charts that have a property.
    #[must_use]
    pub fn with(&self, property: &str) -> usize {
        let found = PROPERTIES.iter().find(|(name, _)| *name == property);
        found.map_or(0, |(_, has)| self.charts.iter().filter(|chart| has(chart)).count())
    }
}

impl fmt::Display for Drawn {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n_refused: u64 = self.refused.values().sum();
        writeln!(out, "{} charts, {n_refused} refused", self.charts.len())?;
        let mut shapes: BTreeMap<&str, u64> = BTreeMap::new();
        for chart in &self.charts {
            *shapes.entry(chart.package.style).or_default() += 1;
        }
        for (shape, n) in shapes {
            writeln!(out, "{n:6}  as {shape}")?;
        }
        for (name, _) in PROPERTIES {
            writeln!(out, "{:6}  {name}", self.with(name))?;
        }
        for (why, n) in &self.refused {
            writeln!(out, "{n:6}  refused: {why}")?;
        }
        Ok(())
    }
}
