//! `grafsynth convert IN OUT`.

use crate::args::Convert;
use crate::exit::Exit;
use crate::files::{self, Output};
use crate::lists::did_you_mean;
use crate::load::{Session, Stop};
use grafsynth_driver::languages::Language;
use grafsynth_driver::read::Design;
use grafsynth_driver::stem::FileStem;
use grafsynth_driver::target::Target;

pub(crate) fn run(session: &mut Session, arguments: &Convert) -> Result<Exit, Stop> {
    let output = arguments.output.to_string_lossy();
    let known = || Language::written().map(|it| it.name).collect::<Vec<_>>().join(", ");
    let to = match &arguments.to {
        Some(name) => match Language::named(name) {
            Some(language) => language,
            None => return Err(no_format(&arguments.input.file, name, &known())),
        },
        None => Language::of(&output, "").ok_or_else(|| {
            Stop::Usage(format!(
                "cannot tell the format from the name {output}: give it with --to ({})",
                known()
            ))
        })?,
    };
    let (design, found) = session.design(&arguments.input)?;
    session.show(&found);
    if let Design::Net(design) = &design
        && session.is_impossible(&design.net)
    {
        return Ok(Exit::Errors);
    }
    match grafsynth_driver::convert::convert(&design, to) {
        Err(found) => {
            session.show(&found);
            Err(Stop::Errors)
        }
        Ok(converted) => {
            session.show(&converted.lost);
            if output == "-" {
                crate::print(&converted.text);
                return Ok(Exit::Done);
            }
            session.write_named(vec![(arguments.output.clone(), converted.text.into_bytes())])?;
            if let Design::Net(design) = &design
                && let Some(library) = &design.library
            {
                // The name that `build --target c` of the output uses for the file of the user's functions. The build does not change that file
                // if it exists.
                let name = format!(
                    "{}_user.c",
                    FileStem::of_path(&output)
                        .unwrap_or_else(|| FileStem::of_name(&design.net.name.text))
                );
                let folder = files::folder_of(&arguments.output);
                let path = folder.join(&name);
                // Once written, the file belongs to the user.
                session.note(&if files::exists(&path) {
                    format!(
                        "{} exists and is kept; to write it again, delete it first\n",
                        path.display()
                    )
                } else {
                    format!("{} contains the functions that stay C\n", path.display())
                });
                let bytes = library.clone().into_bytes();
                files::write_in(folder, &[Output { name, bytes, keep_existing: true }])?;
            }
            Ok(Exit::Done)
        }
    }
}

/// The message for a name that is not a format: it may be a target of `build`.
fn no_format(file: &str, name: &str, known: &str) -> Stop {
    if Target::named(name).is_some() {
        return Stop::Usage(format!(
            "`{name}` is a target, not a format: write it with `build {file} --target {name}`"
        ));
    }
    let near = did_you_mean(name, Language::written().map(|it| it.name));
    Stop::Usage(format!("unknown format `{name}`{near} (known: {known})"))
}
