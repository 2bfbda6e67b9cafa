//! `grafsynth split FILE --part chip=gal22v10 --part cpu=atmega328p -o DIR`.

use super::build::HostC;
use super::build_outputs::report_files;
use super::build_results::{know, say};
use super::draw_overlays::parts_with;
use crate::args::{ReportForm, Split as Arguments};
use crate::exit::Exit;
use crate::files;
use crate::load::{Session, Stop};
use crate::partition::{COMPILE, FITS, Written, partition_file, parts, places};
use crate::progress;
use crate::report::{About, Answer, Status};
use grafsynth_draw::{BarRow, BarTable, bars, svg};
use grafsynth_driver::pipeline::{self, BuildOptions, OutputFile};

use grafsynth_driver::read::{Design, NetDesign};
use grafsynth_driver::report::{Outcome, OutputReport};
use grafsynth_driver::split::{self, Cpu, Linked, Objective, Request, RequestedPart, Split, Whole};
use grafsynth_driver::stem::FileStem;
use grafsynth_ir::division::Original;
use grafsynth_ir::lower::codes::DEADLINE;
use grafsynth_ir::net::Net;
use grafsynth_ir::{Valid, counted};
use grafsynth_verify::verdict::Verdict;
use std::path::Path;

pub(crate) fn run(session: &mut Session, arguments: &Arguments) -> Result<Exit, Stop> {
    let file = &arguments.input.file;
    session.begin(file);
    let (design, found) = session.design(&arguments.input)?;
    let Design::Net(design) = design else {
        session.show(&found);
        return Err(Stop::Input(format!("{file} contains logic; `split` accepts only charts")));
    };
    let net = &design.net;
    // Deadlines are checked here.
    let found: Vec<_> = found.into_iter().filter(|one| one.code != DEADLINE).collect();
    session.know_found(&found);
    if session.is_impossible(net) {
        session.show(&found);
        return Ok(Exit::Errors);
    }
    if arguments.explore {
        let file = drawing(arguments)?;
        session.show(&found);
        return explore(session, arguments, net, file);
    }
    let written = match &arguments.with {
        None => split::Written::default(),
        Some(path) => partition_file(path)?,
    };
    let written = Written { path: arguments.with.as_deref(), partition: &written };
    let parts = parts(&arguments.part, written)?;
    let places = places(session, net, &arguments.place, written, &parts)?;
    let stem = FileStem::of_path(file).unwrap_or_else(|| FileStem::of_name(&net.name.text));
    let made_of = session.made_of();
    let options = options(arguments, &stem);
    if net.board.device.is_some() {
        session.note(
            "the device and pins of the board are not used: `--part` names the devices, and `split` chooses the pins\n",
        );
    }
    let request = Request {
        parts: &parts,
        places: &places,
        running: arguments.link.or(written.partition.running).unwrap_or_default(),
        reset: !(arguments.no_reset || written.partition.no_reset),
        objective: arguments.minimise,
        fits: FITS,
        stem: &stem,
        options: &options,
        compile: COMPILE,
        told: |so_far| progress::known(so_far.to_string()),
    };
    progress::doing(format!("splitting {}", net.name));
    let mut split = match split::split(net, &request) {
        Ok(split) => split,
        Err(mut errors) => {
            let mut all = found;
            all.append(&mut errors);
            return Err(refused(session, &all));
        }
    };
    let mut found = found;
    check_c(session, &mut split, &mut found)?;
    let link = match split::link(net, &split, &parts, &stem) {
        Ok(link) => link,
        Err(errors) => {
            found.extend(errors);
            return Err(refused(session, &found));
        }
    };
    found.extend(split::crowded(net, &split.division, &link));
    let table = arguments.table.then(|| split::table(net, &split, &link, &request));
    let report = match arguments.report {
        None => Vec::new(),
        Some(form) => report(form, &design, (&split, &link), &request),
    };
    let made = (made_of, link, report);
    let exit = finish(session, arguments, net, &stem, (split, &request), made, found)?;
    if let Some(table) = table {
        session.tell(&format!("\n{table}\n"));
    }
    Ok(exit)
}

/// Shows why there is no split.
fn refused(session: &mut Session, found: &[grafsynth_ir::Diagnostic]) -> Stop {
    session.show(found);
    session.tell("nothing was written\n");
    Stop::Errors
}

/// Proves or tests the C of the parts, and collects the findings of their builds.
fn check_c(
    session: &mut Session,
    split: &mut Split,
    found: &mut Vec<grafsynth_ir::Diagnostic>,
) -> Result<(), Stop> {
    for (part, division) in split.parts.iter_mut().zip(&split.division.parts) {
        let net = &division.net;
        found.append(&mut part.built.found);
        let engine = HostC { session, net, options: &part.options };
        let checked = pipeline::check_c(net, &part.facts, &part.options, &mut part.built, &engine);
        if let Err((name, words)) = checked {
            session.show(found);
            return Err(Stop::Input(format!(
                "{name} was not written: the C compiler rejects it\n{words}"
            )));
        }
        know(session, net, &part.built.lines);
    }
    Ok(())
}

/// The largest number of choices of devices that `--explore` compares.
const MOST_CHOICES: usize = 64;

/// Compares the best splits on each choice of devices, and prints those that no other one beats in everything.
fn explore(
    session: &Session,
    arguments: &Arguments,
    net: &Valid<Net>,
    file: Option<&Path>,
) -> Result<Exit, Stop> {
    let choices = choices(&arguments.part)?;
    let stem = FileStem::of_name(&net.name.text);
    let options = BuildOptions { prove: false, ..options(arguments, &stem) };
    let partition = split::Written::default();
    let written = Written { path: None, partition: &partition };
    let mut found: Vec<Choice> = Vec::new();
    let mut refused: Vec<String> = Vec::new();
    for choice in &choices {
        let parts = parts(choice, written)?;
        let places = places(session, net, &arguments.place, written, &parts)?;
        let devices: Vec<&str> = parts.iter().map(|part| part.device.name()).collect();
        let devices = devices.join(", ");
        for objective in Objective::ALL {
            progress::doing(format!("splitting {} on {devices}", net.name));
            let (parts, places) = (&parts, &places);
            let request = Request {
                parts,
                places,
                running: arguments.link.unwrap_or_default(),
                reset: !arguments.no_reset,
                objective,
                fits: FITS,
                stem: &stem,
                options: &options,
                compile: COMPILE,
                told: |so_far| progress::known(so_far.to_string()),
            };
            match split::costs(net, &request) {
                Ok(costs) => found.push((devices.clone(), objective, costs)),
                Err(why) => {
                    refused.push(format!("{devices}: {why}"));
                    break;
                }
            }
        }
    }
    let rows = front(&found);
    if !rows.is_empty() {
        session.tell(&costs_table(&rows));
        draw(session, file, net, &rows)?;
    }
    let beaten = found.len() - rows.len();
    session.tell(&format!(
        "{} compared, {beaten} not shown, because another split is at least as good in every column. Nothing was proved, and no part was written.\n",
        counted(found.len(), "split", "splits")
    ));
    refused.iter().for_each(|why| session.tell(&format!("no split on {why}\n")));
    Ok(if rows.is_empty() { Exit::Errors } else { Exit::Done })
}

/// The devices of a split, its objective, and its costs.
type Choice = (String, Objective, split::Costs);

/// The choices that no other one beats, without duplicates of the same costs on the same devices.
fn front(found: &[Choice]) -> Vec<&Choice> {
    let mut rows: Vec<&Choice> = Vec::new();
    for choice in found {
        let (devices, _, costs) = choice;
        let is_there = rows.iter().any(|(name, _, other)| name == devices && other == costs);
        if !is_there && !found.iter().any(|(_, _, other)| costs.is_dominated(*other)) {
            rows.push(choice);
        }
    }
    rows
}

/// The file of `--explore -o FILE.svg`.
fn drawing(arguments: &Arguments) -> Result<Option<&Path>, Stop> {
    let file = arguments.output.as_path();
    match file.extension() {
        Some(it) if it.eq_ignore_ascii_case("svg") => Ok(Some(file)),
        _ if file == Path::new(".") => Ok(None),
        _ => Err(Stop::Usage(
            "`--explore` writes one drawing: use `-o FILE.svg`, or leave `-o` out".to_owned(),
        )),
    }
}

/// Writes the drawing of the splits.
fn draw(session: &Session, file: Option<&Path>, net: &Net, rows: &[&Choice]) -> Result<(), Stop> {
    let Some(file) = file else { return Ok(()) };
    let known = |value: Option<u64>, text: String| {
        (value, if value.is_some() { text } else { "not known".to_owned() })
    };
    let row = |(devices, objective, costs): &&Choice| BarRow {
        name: format!("{devices} ({})", objective.name()),
        cells: vec![
            (Some(costs.cells), costs.cells.to_string()),
            (Some(costs.pins), costs.pins_text()),
            known(costs.cycles, costs.cycles.unwrap_or_default().to_string()),
            known(costs.reaction_ns, split::rounded(costs.reaction_ns.unwrap_or_default())),
        ],
    };
    let titles = ["macrocells", "pins of the CPU", "cycles of the CPU", "time of a reaction"];
    let table = BarTable {
        title: format!("Splits of {}", net.name),
        columns: titles.map(str::to_owned).to_vec(),
        rows: rows.iter().map(row).collect(),
        notes: vec![
            "Each row is the best split for its devices and its objective. No other one is as good in all columns and better in one.".to_owned(),
            "Shorter bars are better. Cycles and times of the link are estimated. Nothing was proved.".to_owned(),
        ],
    };
    let text = svg(&bars(&table));
    files::write_named(vec![(file.to_owned(), text.into_bytes())])?;
    session.tell(&format!("wrote {}\n", file.display()));
    Ok(())
}

fn costs_table(rows: &[&Choice]) -> String {
    let mut text = "| devices | minimised | macrocells | pins of the CPU | cycles of the CPU | reaction |\n|---|---|---|---|---|---|\n".to_owned();
    let known = |value: Option<String>| value.unwrap_or_else(|| "not known".to_owned());
    for (devices, objective, costs) in rows {
        text += &format!(
            "| {devices} | {} | {} | {} | {} | {} |\n",
            objective.name(),
            costs.cells,
            costs.pins_text(),
            known(costs.cycles.map(|cycles| cycles.to_string())),
            known(costs.reaction_ns.map(split::rounded)),
        );
    }
    text
}

/// Each choice of one device for each part: `chip=gal16v8,gal22v10` names two.
fn choices(parts: &[String]) -> Result<Vec<Vec<String>>, Stop> {
    let mut all: Vec<Vec<String>> = vec![Vec::new()];
    for part in parts {
        let (name, devices) = part.split_once('=').unwrap_or((part, ""));
        let devices: Vec<&str> = devices.split(',').collect();
        let with = |choice: &Vec<String>| -> Vec<Vec<String>> {
            let one = |device: &&str| {
                let part = format!("{name}={}", device.trim());
                choice.iter().cloned().chain([part]).collect()
            };
            devices.iter().map(one).collect()
        };
        all = all.iter().flat_map(with).collect();
        if all.len() > MOST_CHOICES {
            return Err(Stop::Usage(format!(
                "the devices of `--part` allow more than {MOST_CHOICES} choices"
            )));
        }
    }
    Ok(all)
}

/// Writes the files, all or none, and reports what is proved.
fn finish(
    session: &mut Session,
    arguments: &Arguments,
    net: &Valid<Net>,
    stem: &FileStem,
    (split, request): (Split, &Request<'_>),
    (made_of, link, report): (Vec<files::Hashed>, Linked, Vec<OutputFile>),
    found: Vec<grafsynth_ir::Diagnostic>,
) -> Result<Exit, Stop> {
    let worst =
        split.parts.iter().map(|part| part.built.outcome()).max().unwrap_or(Outcome::Proved);
    let (whole, lines) = joined(net, &split, &link);
    let exit = match (whole, worst) {
        (Status::Refuted, _) | (_, Outcome::Refuted) => Exit::Refuted,
        (Status::Proved, Outcome::Proved) => Exit::Done,
        _ => Exit::Open,
    };
    let unwritten = match exit {
        Exit::Refuted => Some("a part or the joined parts differ from the chart"),
        Exit::Open if !arguments.unproved => {
            Some("a proof is open; use `--unproved` to write the files anyway")
        }
        _ => None,
    };
    session.show(&found);
    if unwritten.is_none() {
        let of_parts = split.parts.iter().flat_map(|part| &part.built.files);
        let written = of_parts.chain(&link.files).chain(&report).map(|file| files::Output {
            name: file.name.clone(),
            bytes: file.text.clone().into_bytes(),
            keep_existing: file.keep_existing,
        });
        let mut outputs: Vec<files::Output> = written.collect();
        let text = split::write(net, &split, request);
        let name = format!("{stem}.split");
        // A partition that the user gave, perhaps edited, is not overwritten.
        let keep_existing = arguments.with.is_some();
        outputs.push(files::Output { name, bytes: text.into_bytes(), keep_existing });
        if exit == Exit::Open {
            outputs.iter_mut().for_each(note_unproved);
        }
        let read = session.paths();
        let folder = &arguments.output;
        files::Plan { folder, stem: stem.as_str(), made_of, read, outputs }.write()?;
    }
    for (at, part) in split.parts.iter().enumerate() {
        let own = &split.division.parts[at].net;
        session.tell(&about(net, &split, request.parts, at));
        let lines: Vec<OutputReport> = part.built.lines.clone();
        say(session, own, None, &lines, None)?;
    }
    for line in summary(&split, &link, arguments.minimise) {
        session.tell(&format!("{line}\n"));
    }
    let message = lines.join("\n");
    let answer = Answer::new(About::Output, "joined parts", whole, message.as_str());
    session.answer(&answer, &format!("joined parts: {}\n", lines.join("\n  ")));
    if let Some(why) = unwritten {
        session.tell(&format!("nothing was written: {why}\n"));
    }
    Ok(exit)
}

/// The contents of a part: its device, and the numbers of its steps, transitions and wires.
fn about(net: &Net, split: &Split, parts: &[RequestedPart], at: usize) -> String {
    let owners = &split.division.owners;
    let steps = net.steps.ids().filter(|id| owners.steps[*id] == at).count();
    let copies = match net.settings.policy.is_statechart() {
        true => 0,
        false => {
            let all = split.division.parts[at].steps.values();
            all.filter_map(Original::step).count().saturating_sub(steps)
        }
    };
    let transitions = net.transitions.ids().filter(|id| owners.transitions[*id] == at).count();
    let out = split.division.wires.iter().filter(|wire| wire.from == at).count();
    let into =
        split.division.wires.iter().filter(|wire| wire.to.iter().any(|(to, _)| *to == at)).count();
    format!(
        "{} on {}: {} and {}, {}, {} out, {into} in\n",
        parts[at].name,
        parts[at].device.name(),
        counted(steps, "step", "steps"),
        counted(copies, "copy", "copies"),
        counted(transitions, "transition", "transitions"),
        counted(out, "wire", "wires"),
    )
}

/// The report, with the drawing of the chart in the colours of the parts.
fn report(
    form: ReportForm,
    design: &NetDesign,
    (split, link): (&Split, &Linked),
    request: &Request<'_>,
) -> Vec<OutputFile> {
    let net = &design.net;
    let summary = summary(split, link, request.objective);
    let (status, lines) = joined(net, split, link);
    let document = split::report(net, (split, link), request, &summary, (status.name(), &lines));
    let owners = &split.division.owners;
    let steps = net.steps.iter().map(|(id, step)| (step.meta.span, owners.steps[id]));
    let transitions = net.transitions.iter();
    let transitions = transitions.map(|(id, it)| (it.meta.span, owners.transitions[id]));
    let parts = parts_with(request.parts, steps.chain(transitions));
    let drawn = grafsynth_draw::Options { parts: &parts, ..grafsynth_draw::Options::default() };
    let chart = design.chart.as_ref().map(|chart| (chart, &drawn));
    let mut files = report_files(form, &document, chart, request.stem);
    // The drawing of the wiring is an output of its own.
    files.retain(|file| !link.files.iter().any(|other| other.name == file.name));
    files
}

/// What is said about the whole split: its objective, the memories of the CPU, and the time of a reaction.
fn summary(split: &Split, link: &Linked, objective: Objective) -> [String; 3] {
    let minimised = format!("minimised: {}", split.said(objective));
    [minimised, memory(split, link.cpu), round(link)]
}

/// The memories of the CPU.
fn memory(split: &Split, cpu: &Cpu) -> String {
    match &split.memory {
        Ok(memory) => format!(
            "memory of the {}: {} of {} bytes of flash, {} of {} bytes of RAM, with {} of stack ({})",
            cpu.name,
            memory.flash,
            cpu.flash,
            memory.ram(),
            cpu.ram,
            memory.stack,
            memory.source()
        ),
        Err(why) => format!("memory of the {}: not known: {why}", cpu.name),
    }
}

/// The time of a round.
fn round(link: &Linked) -> String {
    match &link.round {
        Ok(round) => format!(
            "one reaction: at most {} ({}; in a round {} cycles for the part on the CPU and {}, estimated, for the link; {} MHz), from pin to pin at most {}",
            split::rounded(round.ns),
            counted(u64::from(round.rounds), "round", "rounds"),
            round.step,
            round.link,
            round.hz / 1_000_000,
            split::rounded(round.pin_to_pin_ns)
        ),
        Err(why) => format!("one reaction: its time is not known: {why}"),
    }
}

/// The verdict on the joined parts: a line, and for parts that run on their own what it assumes, or how they differ.
fn joined(net: &Net, split: &Split, link: &Linked) -> (Status, Vec<String>) {
    let open = |open: &grafsynth_verify::Open| {
        let reasons: Vec<String> = open.reasons.iter().map(ToString::to_string).collect();
        (Status::Open, vec![format!("open: {}", reasons.join("; "))])
    };
    match &split.joined {
        Whole::Rounds(Verdict::Proved(proof)) => {
            let functions = counted(proof.compared, "function", "functions");
            let message = format!(
                "proved equal to the chart {} ({functions}, {} by construction)",
                proof.scope, proof.same
            );
            (Status::Proved, vec![message])
        }
        Whole::Rounds(Verdict::Refuted(apart)) => {
            let message = format!("DIFFER from the chart: {} ({})", apart.what, apart.when);
            (Status::Refuted, vec![message])
        }
        Whole::Sequences(Verdict::Proved(proof)) => {
            if let Some(why) = split::too_fast(net, proof, link) {
                return (Status::Open, vec![format!("open: {why}")]);
            }
            let message = format!(
                "proved: each output and step takes the same values in the same order as in the chart, however fast the parts are ({} at rest, {} compared)",
                counted(proof.rests, "situation", "situations"),
                counted(proof.moments as usize, "moment", "moments")
            );
            (Status::Proved, vec![message, split::assumed(net, proof, link)])
        }
        Whole::Sequences(Verdict::Refuted(race)) => {
            let events = race.trace(net, &split.division);
            let numbered = (1..).zip(events).map(|(n, event)| format!("{n}. {event}"));
            let first = format!("DIFFER from the chart: {}", race.what(net));
            (Status::Refuted, [first].into_iter().chain(numbered).collect())
        }
        Whole::Rounds(Verdict::Open(why)) | Whole::Sequences(Verdict::Open(why)) => open(why),
    }
}

/// What the head of each text says if a proof of the split is open.
const UNPROVED: &str = "A proof of this split is open: see the output of grafsynth split.";

/// Adds that sentence to the head of a text, as a comment of its language. A drawing has no head.
fn note_unproved(output: &mut files::Output) {
    let Ok(text) = String::from_utf8(output.bytes.clone()) else { return };
    let extension = output.name.rsplit('.').next().unwrap_or_default();
    let noted = match extension {
        "c" | "h" | "pld" => format!("/* {UNPROVED} */\n{text}"),
        "md" => format!("{UNPROVED}\n\n{text}"),
        "split" => format!("# {UNPROVED}\n{text}"),
        "jed" => in_jedec(&text).unwrap_or(text),
        _ => text,
    };
    output.bytes = noted.into_bytes();
}

/// A fuse map with the sentence at the start of its design specification, with a new checksum: the sum of all bytes from STX to ETX.
fn in_jedec(text: &str) -> Option<String> {
    let (before, rest) = text.split_once('\u{2}')?;
    let (design, after) = rest.split_once('\u{3}')?;
    let design = format!("\u{2}{UNPROVED}\n{design}\u{3}");
    let sum = design.bytes().fold(0_u16, |sum, byte| sum.wrapping_add(u16::from(byte)));
    let after = after.get(4..)?;
    Some(format!("{before}{design}{sum:04X}{after}"))
}

/// The options of the builds of the parts.
fn options(arguments: &Arguments, stem: &FileStem) -> BuildOptions {
    BuildOptions {
        stem: Some(stem.clone()),
        prove: true,
        dont_cares: true,
        trusts_code: arguments.trust.trust_code,
        limits: arguments.limits.limits(),
        ..BuildOptions::default()
    }
}
