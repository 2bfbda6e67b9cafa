//! `grafsynth draw FILE`.

use crate::args::{BlankPart, Draw};
use crate::exit::Exit;
use crate::lists::did_you_mean;
use crate::load::{Session, Stop};
use grafsynth_draw::{Blank, NotDrawn, Options, layout, svg};
use grafsynth_driver::stem::FileStem;
use std::path::PathBuf;

pub(crate) fn run(session: &mut Session, arguments: &Draw) -> Result<Exit, Stop> {
    let file = &arguments.input.file;
    let (design, found) = session.net(&arguments.input)?;
    session.show(&found);
    let Some(chart) = &design.chart else {
        return Err(Stop::Input(format!(
            "{file} contains a net, not a chart; convert it to .graf and draw the result"
        )));
    };
    let is_blank = |part| arguments.blank.contains(&part);
    let options = Options {
        chart: arguments.chart.as_deref(),
        words: arguments.words,
        active: &arguments.active,
        blank: Blank {
            actions: is_blank(BlankPart::Actions),
            receptivities: is_blank(BlankPart::Receptivities),
            names: is_blank(BlankPart::Names),
        },
    };
    let picture = layout(chart, &options).map_err(|why| match why {
        NotDrawn::NoStep(name) => {
            Stop::Usage(format!("{file} contains no step or state `{name}` to draw as active"))
        }
        NotDrawn::NoChart(names) => {
            let wanted = arguments.chart.as_deref().unwrap_or_default();
            let near = did_you_mean(wanted, names.iter().map(String::as_str));
            Stop::Usage(format!(
                "{file} contains no chart `{wanted}`{near} (charts: {})",
                names.join(", ")
            ))
        }
    })?;
    let text = svg(&picture);
    let output = arguments.output.clone().unwrap_or_else(|| match FileStem::of_path(file) {
        Some(stem) => PathBuf::from(format!("{}.svg", stem.as_str())),
        None => PathBuf::from("-"),
    });
    if output.as_os_str() == "-" {
        crate::print(&text);
        return Ok(Exit::Done);
    }
    session.write_named(vec![(output.clone(), text.into_bytes())])?;
    session.note(&format!("wrote {}\n", output.display()));
    Ok(Exit::Done)
}
