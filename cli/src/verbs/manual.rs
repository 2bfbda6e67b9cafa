//! `grafsynth completions SHELL` and `grafsynth man`.

use crate::args::Cli;
use crate::exit::Exit;
use clap::CommandFactory as _;
use clap_complete::Shell;

pub(crate) fn completions(shell: Shell) -> Exit {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "grafsynth", &mut text);
    crate::print(&String::from_utf8_lossy(&text));
    Exit::Done
}

pub(crate) fn man() -> Result<Exit, String> {
    let mut text = Vec::new();
    clap_mangen::Man::new(Cli::command())
        .render(&mut text)
        .map_err(|error| format!("the manual page cannot be made: {error}"))?;
    crate::print(&String::from_utf8_lossy(&text));
    Ok(Exit::Done)
}
