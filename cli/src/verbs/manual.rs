//! `grafsynth completions SHELL` and `grafsynth man [VERB]`.

use crate::args::Manual;
use crate::exit::Exit;
use crate::help::command;
use crate::lists;
use clap::builder::PossibleValuesParser;
use clap_complete::Shell;

pub(crate) fn completions(shell: Shell) -> Exit {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut with_values(), "grafsynth", &mut text);
    crate::print(&String::from_utf8_lossy(&text));
    Exit::Done
}

/// The command line with the values of each option that has a list, so that a shell can offer them.
fn with_values() -> clap::Command {
    let mut command = command();
    for (verb, option, values) in lists::values() {
        command = command.mut_subcommand(verb, |verb| {
            if verb.get_arguments().all(|it| it.get_id() != option) {
                return verb;
            }
            verb.mut_arg(option, |it| it.value_parser(PossibleValuesParser::new(values)))
        });
    }
    command
}

pub(crate) fn man(arguments: &Manual) -> Result<Exit, String> {
    let mut command = command();
    command.build();
    let page = match &arguments.verb {
        None => command,
        Some(name) => {
            let known = || command.get_subcommands().map(clap::Command::get_name);
            let Some(verb) = command.find_subcommand(name) else {
                let near = grafsynth_ir::diag::nearest(name, known())
                    .map(|near| format!("; did you mean `{near}`?"))
                    .unwrap_or_default();
                return Err(format!("unknown verb `{name}`{near}"));
            };
            verb.clone().name(format!("grafsynth-{name}"))
        }
    };
    let mut text = Vec::new();
    clap_mangen::Man::new(page)
        .render(&mut text)
        .map_err(|error| format!("cannot create the manual page: {error}"))?;
    crate::print(&String::from_utf8_lossy(&text));
    Ok(Exit::Done)
}
