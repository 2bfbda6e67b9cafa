//! The parts of the help of each verb other than its own options: examples, and the options that all verbs share.

use crate::args::Cli;
use clap::CommandFactory as _;

/// The command line with its help: each verb shows its own options, and names the common ones in one line.
pub(crate) fn command() -> clap::Command {
    let command = Cli::command();
    let common: Vec<clap::Arg> =
        command.get_arguments().filter(|it| it.is_global_set()).cloned().collect();
    let names: Vec<String> =
        common.iter().filter_map(|it| it.get_long()).map(|long| format!("--{long}")).collect();
    let line = format!("Common options: {}; see `grafsynth --help`.", names.join(", "));
    let command = command
        .mut_subcommand("compare", |verb| verb.mut_arg("files", |files| files.help(COMPARED)))
        .mut_subcommand("split", |verb| verb.mut_arg("file", |file| file.help(RUN)))
        .mut_subcommand("draw", |verb| verb.mut_arg("file", |file| file.help(DRAWN)))
        .mut_subcommand("page", |verb| verb.mut_arg("file", |file| file.help(RUN)));
    command.mut_subcommands(|verb| {
        let long = match EXAMPLES.iter().find(|(name, _)| *name == verb.get_name()) {
            Some((_, examples)) => format!("Examples:\n{}\n\n{line}", examples.trim_end()),
            None => line.clone(),
        };
        let hidden = common.iter().map(|it| it.clone().hide(true));
        verb.args(hidden).after_help(line.clone()).after_long_help(long)
    })
}

/// The help for the files of `compare`.
const COMPARED: &str = "Charts (.graf .rules .scxml .st .xml .c .kiss2 .net) or logic (.pds .pld .v .blif .pla .jed); `-` is standard input. One file, or one folder: run \
                        each design on several engines. Several files: compare the first with each of the others, in the columns that both have. Two folders: compare the \
                        charts with the same name. A chart and the C that `build` emitted from it (STEM.c): prove that the C is still equal to the chart after an edit. `--board` and `--assert` apply to the first design, the other input options to all";

/// The help for the file of `draw`.
const DRAWN: &str =
    "A chart or statechart (.graf .rules .scxml .st .xml .c); `-` is standard input";

/// The help for the file of `page` and `split`.
const RUN: &str = "A chart (.graf .rules .scxml .st .xml .c .kiss2 .net); `-` is standard input";

/// The examples at the end of a verb's help, by verb.
const EXAMPLES: [(&str, &str); 15] = [
    (
        "new",
        "  grafsynth new lamp                       # lamp/lamp.graf, .board, .csv and a Makefile
  grafsynth new blink --kind avr           # with a main program for an Arduino Uno
  make -C lamp test                        # check it, and run it on several engines",
    ),
    (
        "check",
        "  grafsynth check lamp.graf --assert 'never (motor and alarm)'
  grafsynth check src --deny warnings      # all charts below src, in CI
  grafsynth check lamp.graf --watch        # again after each save",
    ),
    (
        "build",
        "  grafsynth build lamp.graf --target c --for avr --report -o out  # with lamp.report.html
  grafsynth build lamp.graf --target jedec --device gal22v10 -o out",
    ),
    (
        "split",
        "  grafsynth split truck.graf --part chip=gal16v8 --part cpu=atmega328p --place R,L=chip -o out
  grafsynth split truck.graf --with out/truck.split -o out  # with the partition in that file",
    ),
    (
        "sim",
        "  grafsynth sim lamp.graf --stimulus lamp.csv
  grafsynth sim lamp.graf --random 1000 --seed 7 --trace lamp.vcd
  grafsynth sim lamp.graf --interactive --record run.csv  # by hand, with keys
  echo 'on; react 3; next' | grafsynth sim lamp.graf --interactive",
    ),
    (
        "compare",
        "  grafsynth compare old.graf new.graf --trace run.csv  # prove them equal, or show a difference
  grafsynth compare plant.graf out/plant.c  # C from `build`, after somebody edited it: prove it equal to the chart, or show a difference
  grafsynth compare lamp.graf --random 10000  # the chart, its C, equations, fuses and Verilog",
    ),
    (
        "convert",
        "  grafsynth convert plant.scxml plant.graf
  grafsynth convert old.pld - --to verilog",
    ),
    (
        "draw",
        "  grafsynth draw plant.graf                # plant.svg, in the notation of IEC 60848
  grafsynth draw plant.graf --chart guard --words -o -  # one chart, conditions in words
  grafsynth draw plant.graf --style sfc    # as a sequential function chart of IEC 61131-3
  grafsynth draw plant.graf --watch        # again after each save; keep plant.svg open in a viewer that reloads
  grafsynth draw plant.graf --coverage plant.csv -o plant.pdf  # on pages of A4, with the coverage of a stimulus
  grafsynth draw plant.graf --frames run.csv -o plant.png --scale 3  # the situations of a trace, in pixels",
    ),
    (
        "page",
        "  grafsynth page plant.graf                # plant.html: open it, and press the inputs
  grafsynth page plant.graf --language fr --words -o out/panel.html",
    ),
    (
        "minimise",
        "  grafsynth minimise table.pla -o small.pla
  grafsynth minimise table.pla --per-output --phase --budget 1",
    ),
    (
        "trace",
        "  grafsynth build lamp.graf --target c --trace-ring 64 -o out
  grafsynth trace dump.hex --chart lamp.graf  # after copying the ring from the machine",
    ),
    (
        "fmt",
        "  grafsynth fmt lamp.graf
  grafsynth fmt --check *.graf             # exit with 1 if a file is not formatted",
    ),
    (
        "diff",
        "  grafsynth diff old.graf new.graf --trace run.csv  # run.csv replays on old.graf, run-2.csv on new.graf
  grafsynth diff old.graf new.graf --message-format json",
    ),
    (
        "explain",
        "  grafsynth explain G0711
  grafsynth explain                        # list all codes",
    ),
    (
        "completions",
        "  grafsynth completions bash > ~/.local/share/bash-completion/completions/grafsynth
  grafsynth completions fish > ~/.config/fish/completions/grafsynth.fish",
    ),
];

#[cfg(test)]
mod tests {
    use super::command;
    use grafsynth_driver::languages::LANGUAGES;

    #[test]
    fn the_help_names_the_files_of_every_language() {
        let command = command();
        for (verb, argument) in [("convert", "file"), ("check", "files"), ("compare", "files")] {
            let verb = command.find_subcommand(verb).unwrap();
            let known = verb.get_arguments().find(|it| it.get_id() == argument).unwrap();
            let help = known.get_long_help().or(known.get_help()).unwrap().to_string();
            let named: Vec<&str> = help.split([' ', '(', ')']).collect();
            for language in &LANGUAGES {
                let extension = format!(".{}", language.extension());
                assert!(named.contains(&extension.as_str()), "{extension} is not in: {help}");
            }
        }
    }
}
