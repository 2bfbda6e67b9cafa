//! `grafsynth trace DUMP --chart FILE`.

use crate::args::Trace;
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop};
use crate::report::{About, Answer, Status};
use grafsynth_driver::{pipeline, ring};
use grafsynth_ir::counted;
use grafsynth_verify::Limits;

pub(crate) fn run(session: &mut Session, arguments: &Trace) -> Result<Exit, Stop> {
    session.begin(&arguments.chart);
    let (design, found) = session.net_at(&arguments.chart, &arguments.reading)?;
    session.show(&found);
    let net = &design.net;
    let dump = files::read_bytes(&arguments.dump, session.source_limit)?;
    let ring =
        ring::parse(net, &dump).map_err(|why| Stop::Input(format!("{}: {why}", arguments.dump)))?;
    let facts = pipeline::facts(net, &Limits::default());
    let replay = ring::replay(net, &facts, &ring);
    crate::print(&ring::to_csv(net, &replay));
    let lost = match ring.lost() {
        0 => "the ring contains all of them".to_owned(),
        1 => "the first was overwritten".to_owned(),
        n => format!("the first {n} were overwritten"),
    };
    session.note(&format!(
        "{}, {} fired, {}: {lost}\n",
        counted(ring.reactions, "reaction", "reactions"),
        counted(ring.count, "transition", "transitions"),
        counted(ring.places, "entry", "entries")
    ));
    match replay.broken {
        None => {
            let message = match ring.reactions {
                1 => "1 reaction matches the chart".to_owned(),
                n => format!("{n} reactions match the chart"),
            };
            session.keep(&Answer::new(
                About::Replay,
                arguments.dump.as_str(),
                Status::Done,
                message,
            ));
            Ok(Exit::Done)
        }
        Some(why) => {
            let why = why.to_string();
            let answer =
                Answer::new(About::Replay, arguments.dump.as_str(), Status::Refuted, &*why);
            session.keep(&answer);
            session.warn(&why);
            Ok(Exit::Refuted)
        }
    }
}
