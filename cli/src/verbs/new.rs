//! `grafsynth new NAME --kind KIND`: a small project that builds and passes its tests at once.

use crate::args::{Kind, New};
use crate::exit::Exit;
use crate::files::{self, Output};
use std::path::Path;

/// Files of a project. In names and texts, `NAME` is the name of the project and `UPPER` the same in capital letters.
type Template = &'static [(&'static str, &'static str)];

/// The files of a project of this kind, the source first.
fn template(kind: Kind) -> Template {
    match kind {
        Kind::Grafcet => &[
            ("NAME.graf", include_str!("../templates/grafcet/NAME.graf")),
            ("NAME.board", include_str!("../templates/grafcet/NAME.board")),
            ("NAME.csv", include_str!("../templates/grafcet/NAME.csv")),
            ("Makefile", include_str!("../templates/grafcet/Makefile")),
        ],
        Kind::Statechart => &[
            ("NAME.graf", include_str!("../templates/statechart/NAME.graf")),
            ("NAME.csv", include_str!("../templates/statechart/NAME.csv")),
            ("Makefile", include_str!("../templates/statechart/Makefile")),
        ],
        Kind::Rules => &[
            ("NAME.rules", include_str!("../templates/rules/NAME.rules")),
            ("NAME.csv", include_str!("../templates/rules/NAME.csv")),
            ("Makefile", include_str!("../templates/rules/Makefile")),
        ],
        Kind::Sfc => &[
            ("NAME.st", include_str!("../templates/sfc/NAME.st")),
            ("NAME.csv", include_str!("../templates/sfc/NAME.csv")),
            ("Makefile", include_str!("../templates/sfc/Makefile")),
        ],
        Kind::Gal => &[
            ("NAME.graf", include_str!("../templates/gal/NAME.graf")),
            ("NAME.board", include_str!("../templates/gal/NAME.board")),
            ("NAME.csv", include_str!("../templates/gal/NAME.csv")),
            ("Makefile", include_str!("../templates/gal/Makefile")),
        ],
        Kind::Avr => &[
            ("NAME.graf", include_str!("../templates/avr/NAME.graf")),
            ("main.c", include_str!("../templates/avr/main.c")),
            ("NAME.csv", include_str!("../templates/avr/NAME.csv")),
            ("Makefile", include_str!("../templates/avr/Makefile")),
        ],
    }
}

pub(crate) fn run(arguments: &New, quiet: bool) -> Result<Exit, String> {
    let folder = Path::new(&arguments.name);
    let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let is_identifier = name.chars().next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !is_identifier {
        return Err(format!(
            "`{name}` cannot be the name of a chart: use letters, digits and _, not beginning with a digit"
        ));
    }
    if files::is_taken(folder) {
        return Err(format!("{} already exists", folder.display()));
    }
    let upper = name.to_ascii_uppercase();
    let named = |text: &str| text.replace("UPPER", &upper).replace("NAME", name);
    let all: Vec<_> = template(arguments.kind)
        .iter()
        .map(|(file, text)| Output {
            name: format!("{name}/{}", named(file)),
            bytes: named(text).into_bytes(),
            keep_existing: false,
        })
        .collect();
    files::write_in(files::folder_of(folder), &all)?;
    if !quiet {
        let list: Vec<String> =
            template(arguments.kind).iter().map(|(file, _)| named(file)).collect();
        crate::print(&format!("{} contains {}\n", folder.display(), list.join(", ")));
    }
    Ok(Exit::Done)
}
