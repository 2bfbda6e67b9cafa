//! The values that an option accepts, for `--target list` and similar. A list needs no file, so it is printed before the command line is parsed.

use grafsynth_backend_c::{Style, cost};
use grafsynth_driver::languages::{LANGUAGES, Language};
use grafsynth_driver::split::{CPUS, PartDevice};
use grafsynth_driver::target::{self, Target};
use grafsynth_engines::OfCpu;
use grafsynth_ir::diag::nearest;

/// An option with a list of values, and the verbs that accept it.
struct List {
    /// Its name in [`crate::args`].
    id: &'static str,
    options: &'static [&'static str],
    verbs: &'static [&'static str],
    entries: fn() -> Vec<(String, String)>,
}

const LISTS: [List; 9] = [
    List { id: "target", options: &["--target", "-t"], verbs: &["build"], entries: targets },
    List { id: "device", options: &["--device"], verbs: &["build"], entries: devices },
    List { id: "part", options: &["--part"], verbs: &["split"], entries: parts },
    List { id: "style", options: &["--style"], verbs: &["build"], entries: styles },
    List {
        id: "machine",
        options: &["--for"],
        verbs: &["build", "check", "diff"],
        entries: machines,
    },
    List { id: "engine", options: &["--engine", "-e"], verbs: &["sim"], entries: engines },
    List { id: "engines", options: &["--engines"], verbs: &["compare"], entries: engines },
    List {
        id: "from",
        options: &["--from"],
        verbs: &["check", "build", "sim", "compare", "convert", "draw", "page", "trace"],
        entries: formats,
    },
    List { id: "to", options: &["--to"], verbs: &["convert"], entries: written },
];

/// `, did you mean `jedec`?` for `jed`: the nearest of the known values, or the only one that begins with `name`; empty if there is none.
pub(crate) fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let mut longer = known.iter().copied().filter(|one| name.len() > 1 && one.starts_with(name));
    let near = nearest(name, known.iter().copied())
        .or_else(|| longer.next().filter(|_| longer.next().is_none()));
    near.map(|near| format!(", did you mean `{near}`?")).unwrap_or_default()
}

/// The list that the command line requests, one value per line.
pub(crate) fn asked() -> Option<String> {
    let words: Vec<String> =
        std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    of(&words)
}

fn of(words: &[String]) -> Option<String> {
    let verb = words.get(1)?;
    let asks = |list: &List| {
        list.options.iter().any(|option| {
            words.iter().any(|word| *word == format!("{option}=list"))
                || words.windows(2).any(|pair| pair[0] == *option && pair[1] == "list")
        })
    };
    let list = LISTS.iter().find(|list| list.verbs.contains(&verb.as_str()) && asks(list))?;
    let entries = (list.entries)();
    let width = entries.iter().map(|(name, _)| name.chars().count()).max().unwrap_or_default();
    let line = |(name, about): &(String, String)| format!("{name:<width$}  {about}");
    Some(entries.iter().map(|entry| line(entry).trim_end().to_owned() + "\n").collect())
}

/// Each option of a verb that has a list, with its values.
pub(crate) fn values() -> impl Iterator<Item = (&'static str, &'static str, Vec<String>)> {
    LISTS.iter().flat_map(|list| {
        let values = || (list.entries)().into_iter().map(|(name, _)| name).collect();
        list.verbs.iter().map(move |verb| (*verb, list.id, values()))
    })
}

fn targets() -> Vec<(String, String)> {
    Target::all().map(|(_, name, about)| (name.to_owned(), about.to_owned())).collect()
}

fn devices() -> Vec<(String, String)> {
    target::devices().map(|(name, about)| (name.to_owned(), about)).collect()
}

fn parts() -> Vec<(String, String)> {
    let cpus = CPUS.iter().map(|cpu| {
        let (flash, ram) = (cpu.flash / 1024, cpu.ram);
        (cpu.name.to_owned(), format!("CPU, {flash} KiB of flash, {ram} bytes of RAM"))
    });
    let is_part = |(name, _): &(String, String)| PartDevice::named(name).is_some();
    devices().into_iter().filter(is_part).chain(cpus).collect()
}

fn styles() -> Vec<(String, String)> {
    Style::ALL.iter().map(|style| (style.name().to_owned(), style.about().to_owned())).collect()
}

fn machines() -> Vec<(String, String)> {
    cost::MACHINES.iter().map(|it| (it.name.to_owned(), it.about.to_owned())).collect()
}

fn engines() -> Vec<(String, String)> {
    let all = grafsynth_engines::all();
    let plain = all.iter().map(|it| (it.name(), it.about()));
    let of_splits = OfCpu::ALL.iter().map(|it| (it.name(), it.about()));
    plain.chain(of_splits).map(|(name, about)| (name.to_owned(), about.to_owned())).collect()
}

fn formats() -> Vec<(String, String)> {
    LANGUAGES.iter().map(entry).collect()
}

/// The formats that `convert` writes.
fn written() -> Vec<(String, String)> {
    Language::written().map(entry).collect()
}

fn entry(language: &Language) -> (String, String) {
    (language.name.to_owned(), format!("files `*.{}`", language.extension()))
}
