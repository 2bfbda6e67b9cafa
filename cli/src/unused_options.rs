//! Options without effect in the command. They are rejected before anything is read: otherwise the user would get an answer to another question.

use crate::args::{Build, BuildTrace, Cli, Compare, Reading, Sim, Verb};
use crate::files;
use crate::verbs::draw::Format;
use clap::ArgMatches;
use clap::CommandFactory as _;
use clap::parser::ValueSource;
use grafsynth_driver::languages::{GRAF, Language};
use grafsynth_driver::target::Target;
use grafsynth_engines::OfCpu;
use std::path::Path;

/// An option, what uses it, and whether the command uses it.
struct Rule {
    /// Its name in [`crate::args`].
    option: &'static str,
    /// Completes the message "it is for ..".
    taker: &'static str,
    is_taken: bool,
}

/// The message about the options of a parsed command that have no effect; `None` if all are used.
pub(crate) fn refusal(cli: &Cli, matches: &ArgMatches) -> Option<String> {
    let (name, given) = matches.subcommand()?;
    let rules = rules(&cli.verb);
    let idle = rules.iter().filter(|rule| {
        !rule.is_taken && given.value_source(rule.option) == Some(ValueSource::CommandLine)
    });
    let lines: Vec<String> = idle
        .map(|rule| {
            format!("{} has no effect here: it is for {}", flag(name, rule.option), rule.taker)
        })
        .collect();
    (!lines.is_empty()).then(|| lines.join("\n"))
}

/// An option as written on the command line.
fn flag(verb: &str, option: &str) -> String {
    let command = Cli::command();
    let known = command.find_subcommand(verb);
    let argument =
        known.and_then(|verb| verb.get_arguments().find(|known| known.get_id() == option));
    let long = argument.and_then(|argument| argument.get_long()).map(|long| format!("--{long}"));
    let short = argument.and_then(|argument| argument.get_short()).map(|short| format!("-{short}"));
    long.or(short).unwrap_or_else(|| option.to_owned())
}

fn rules(verb: &Verb) -> Vec<Rule> {
    match verb {
        Verb::Check(arguments) => {
            let files = Files::of(&arguments.inputs.files, &arguments.inputs.reading);
            let mut rules = of_reading(&files);
            let is_dumped = arguments.dump_after.is_some();
            rules.extend(
                ["certify", "invariants", "recheck", "notes", "proof_limit", "effort"].map(
                    |option| Rule {
                        option,
                        taker: if is_dumped {
                            "checks, and with --dump-after nothing is checked"
                        } else {
                            CHARTS
                        },
                        is_taken: files.any_chart() && !is_dumped,
                    },
                ),
            );
            rules.push(Rule {
                option: "trace",
                taker: "checks without --dump-after, --certify and --recheck",
                is_taken: !is_dumped && arguments.certify.is_none() && arguments.recheck.is_none(),
            });
            rules
        }
        Verb::Build(arguments) => of_build(arguments),
        Verb::Split(arguments) => {
            of_reading(&Files::of([&arguments.input.file], &arguments.input.reading))
        }
        Verb::Sim(arguments) => of_sim(arguments),
        Verb::Compare(arguments) => of_compare(arguments),
        Verb::Convert(arguments) => {
            of_reading(&Files::of([&arguments.input.file], &arguments.input.reading))
        }
        Verb::Draw(arguments) => {
            let files = Files::of([&arguments.input.file], &arguments.input.reading);
            let mut rules = of_reading(&files);
            let is_png = |path: &Path| Format::of(path) == Format::Png;
            let is_taken = arguments.output.as_deref().is_some_and(is_png);
            rules.push(Rule { option: "scale", taker: "PNG files (-o FILE.png)", is_taken });
            rules
        }
        Verb::Page(arguments) => {
            of_reading(&Files::of([&arguments.input.file], &arguments.input.reading))
        }
        Verb::Trace(arguments) => {
            let mut reading = arguments.reading.clone();
            reading.from = None;
            of_reading(&Files::of([&arguments.chart], &reading))
        }
        _ => Vec::new(),
    }
}

const CHARTS: &str = "charts, and this is logic";

/// The languages of the files that a command names; `None` if only the text would show it.
struct Files(Vec<Option<&'static Language>>);

impl Files {
    fn of<'f>(files: impl IntoIterator<Item = &'f String>, reading: &Reading) -> Files {
        let said = reading.from.as_deref().and_then(Language::named);
        let by_name = |file: &String| {
            // The verb uses all chart files of a folder except those in C.
            if files::is_folder(file) { Some(GRAF) } else { Language::of(file, "") }
        };
        Files(files.into_iter().map(|file| said.or_else(|| by_name(file))).collect())
    }

    /// True if a file may be in such a language.
    fn any(&self, is_it: impl Fn(&Language) -> bool) -> bool {
        self.0.iter().any(|language| language.is_none_or(&is_it))
    }

    fn any_chart(&self) -> bool {
        self.any(Language::is_chart)
    }

    fn any_logic(&self) -> bool {
        self.any(|language| !language.is_chart())
    }
}

/// The options that define how a file is read.
fn of_reading(files: &Files) -> Vec<Rule> {
    let c = [
        "entry",
        "fuse",
        "keep",
        "group",
        "calls",
        "int",
        "unsigned_char",
        "array_length",
        "define",
    ];
    let c = c.map(|option| Rule {
        option,
        taker: "charts in C (.c)",
        is_taken: files.any(Language::is_c),
    });
    let of_charts = ["assert", "board", "machine"];
    let of_charts =
        of_charts.map(|option| Rule { option, taker: CHARTS, is_taken: files.any_chart() });
    let root = Rule {
        option: "root",
        taker: "charts with `use` (.graf)",
        is_taken: files.any(|language| language.has_libraries),
    };
    c.into_iter().chain(of_charts).chain([root]).collect()
}

/// Options for the C output of charts only.
const OF_C: [&str; 10] = [
    "style",
    "optimise",
    "io",
    "gate",
    "safe_state",
    "trace_ring",
    "callbacks",
    "measure",
    "package",
    "trust_code",
];

/// Options for circuits of charts only.
const OF_CIRCUITS: [&str; 5] = ["busy", "encoding", "no_dc", "safe", "synchronise"];

/// Other options for outputs of charts only. The first two are checked in more detail with the targets.
const OF_OUTPUTS: [&str; 6] = ["reset", "keep_pins", "stimulus", "emit", "template", "blob"];

fn of_build(arguments: &Build) -> Vec<Rule> {
    let files = Files::of(&arguments.inputs.files, &arguments.inputs.reading);
    let targets = || arguments.target.iter().flat_map(|names| names.split(','));
    // An unknown target is rejected elsewhere.
    let any =
        |is_it: fn(Target) -> bool| targets().any(|name| Target::named(name).is_none_or(is_it));
    let rule = |option, taker, is_taken| Rule { option, taker, is_taken };
    let is_ring = matches!(arguments.trace, Some(BuildTrace::Ring(_)));
    let mut rules = of_reading(&files);
    rules.push(rule("refit", "imported logic; a chart is always fitted", files.any_logic()));
    if !files.any_chart() {
        let of_charts = OF_C.into_iter().chain(OF_CIRCUITS).chain(OF_OUTPUTS);
        rules.extend(of_charts.map(|option| rule(option, CHARTS, false)));
        rules.push(rule("trace", CHARTS, !is_ring));
        return rules;
    }
    let is_c = any(|target| matches!(target, Target::C(_)));
    rules.extend(OF_C.map(|option| rule(option, "C, and no target is C", is_c)));
    rules.push(rule("trace", "C, and no target is C", is_c || !is_ring));
    let circuits = "circuits, and no target is a circuit";
    let is_circuit = any(Target::is_circuit);
    rules.extend(OF_CIRCUITS.map(|option| rule(option, circuits, is_circuit)));
    rules.push(rule("device", circuits, is_circuit));
    rules.push(rule("reset", "Verilog, and no target is Verilog", any(Target::can_reset)));
    let pins = "texts and fuse maps with pins, and no target has pins";
    rules.push(rule("keep_pins", pins, any(Target::has_pins)));
    rules
}

fn of_sim(arguments: &Sim) -> Vec<Rule> {
    let files = Files::of([&arguments.input.file], &arguments.input.reading);
    let runs_c = grafsynth_engines::named(&arguments.engine).is_none_or(|engine| engine.runs_c());
    let mut rules = of_reading(&files);
    rules.push(Rule { option: "seed", taker: "--random", is_taken: arguments.random.is_some() });
    rules.push(Rule {
        option: "trust_code",
        taker: "engines that run C",
        is_taken: runs_c && files.any_chart(),
    });
    let is_taken = OfCpu::named(&arguments.engine).is_some();
    rules.push(Rule { option: "with", taker: OF_SPLITS, is_taken });
    let is_taken = arguments.interactive;
    rules.push(Rule { option: "record", taker: "--interactive", is_taken });
    rules
}

const OF_SPLITS: &str = "the engines split and split-mcu";

fn of_compare(arguments: &Compare) -> Vec<Rule> {
    let files = Files::of(&arguments.inputs.files, &arguments.inputs.reading);
    let is_one = arguments.inputs.files.len() == 1;
    let rule = |option, taker, is_taken| Rule { option, taker, is_taken };
    let mut rules = of_reading(&files);
    let one = "one design that all engines run, not for several designs";
    rules.push(rule("engines", one, is_one));
    let has_split = arguments.engines.iter().any(|name| OfCpu::named(name).is_some());
    rules.push(rule("with", OF_SPLITS, has_split && is_one));
    let is_c = |file: &String| file.to_lowercase().ends_with(".c");
    let runs_c = is_one || arguments.inputs.files.iter().any(is_c);
    let taker = "C that is compiled: that of one design, or edited C";
    rules.push(rule("trust_code", taker, runs_c));
    let logic = "imported logic; charts are compared by their own names";
    rules.push(rule("rename", logic, !is_one && files.any_logic()));
    rules.push(rule("no_proof", "two designs", !is_one));
    rules.push(rule(
        "effort",
        "the proof that two designs are equal",
        !is_one
            && arguments.stimulus.is_none()
            && arguments.random.is_none()
            && !arguments.no_proof,
    ));
    rules.push(rule("seed", "random reactions", arguments.stimulus.is_none()));
    rules
}

#[cfg(test)]
mod tests {
    use super::{refusal, rules};
    use crate::args::Cli;
    use clap::{ArgMatches, CommandFactory as _, FromArgMatches as _};

    fn parsed(words: &str) -> (Cli, ArgMatches) {
        let words = ["grafsynth"].into_iter().chain(words.split(' '));
        let matches = Cli::command().try_get_matches_from(words).unwrap();
        (Cli::from_arg_matches(&matches).unwrap(), matches)
    }

    fn refused(words: &str) -> Option<String> {
        let (cli, matches) = parsed(words);
        refusal(&cli, &matches)
    }

    #[test]
    fn each_rule_is_about_an_option_of_its_verb() {
        for words in [
            "check a.graf",
            "build a.graf -t c",
            "build a.v -t jedec",
            "sim a.graf",
            "compare a.graf",
            "convert a.graf b.st",
            "draw a.graf",
            "trace a.bin --chart a.graf",
        ] {
            let (cli, _) = parsed(words);
            let command = Cli::command();
            let verb = command.find_subcommand(cli.verb.name()).unwrap();
            let rules = rules(&cli.verb);
            assert!(!rules.is_empty());
            for rule in rules {
                let is_known = verb.get_arguments().any(|known| known.get_id() == rule.option);
                assert!(is_known, "{words}: {}", rule.option);
            }
        }
    }

    #[test]
    fn what_something_takes_is_not_refused() {
        for words in [
            "check a.c -D X=1 --int 16",
            "check a.graf b.c --entry f",
            "check - --int 16",
            "check folder --assert never(a) --notes conflicts",
            "build a.graf -t palasm -t c --gate --device gal22v10 --style switch",
            "build a.graf -t c,verilog --reset rst",
            "build a.pld -t jedec --refit --device gal22v10 --trace run.csv",
            "build a.graf -t palasm --trace run.csv",
            "build a.graf -t c --trace 8",
            "build a.graf -t pascal --gate",
            "sim a.graf --random 10 --seed 3",
            "sim a.graf --random 10 -e c --trust-code",
            "compare a.graf --engines c --trust-code",
            "compare a.graf b.v --rename x=y",
            "compare a.graf b.graf --no-proof --seed 4",
            "draw a.graf --scale 3 -o a.PNG",
        ] {
            assert_eq!(refused(words), None, "{words}");
        }
    }

    #[test]
    fn what_nothing_takes_is_named() {
        for (words, flags) in [
            ("check a.graf -D X=1 --int 16", "--int -D"),
            ("check src --entry f", "--entry"),
            ("check a.v --certify b.graf --assert never(a)", "--assert --certify"),
            ("check a.graf --dump-after flatten --notes conflicts", "--notes"),
            ("check a.graf --certify b.graf --trace t.csv", "--trace"),
            ("build a.graf -t palasm --gate", "--gate"),
            ("build a.graf -t palasm --trace 8", "--trace"),
            ("build a.pld -t jedec --trace 8", "--trace"),
            ("build a.graf -t c --reset rst --device gal22v10", "--device --reset"),
            ("build a.graf -t verilog --keep-pins old.jed", "--keep-pins"),
            ("build a.graf -t jedec --refit", "--refit"),
            ("build a.pld -t jedec --gate --encoding compact", "--gate --encoding"),
            ("sim a.graf --stimulus s.csv --seed 3", "--seed"),
            ("sim a.graf --random 10 --trust-code", "--trust-code"),
            ("compare a.graf b.graf --engines c --rename x=y", "--engines --rename"),
            ("compare a.graf --rename x=y --no-proof", "--rename --no-proof"),
            ("convert a.scxml b.graf --root .", "--root"),
            ("draw a.graf --scale 3", "--scale"),
            ("draw a.graf --scale 3 -o a.pdf", "--scale"),
        ] {
            let said = refused(words).unwrap_or_default();
            let named: Vec<&str> = said.lines().filter_map(|line| line.split(' ').next()).collect();
            assert_eq!(named.join(" "), flags, "{words}: {said}");
        }
    }
}
