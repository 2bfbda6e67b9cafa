//! The page of each code: its example triggers the code.
//!
//! An example is a net; its file is in comments after the line `// stimulus`, `// trace`, `// state`, `// commands` or
//! `// events` (a stimulus that is divided into events).

use grafsynth_ir::{Diagnostic, FileId, Valid, text, validate};

use crate::{Clocked, Command, Events, Simulator, Stimulus, Trace, TraceLayout, codes, run_with};

macro_rules! pages {
    ($($id:literal)*) => {
        &[$(($id, include_str!(concat!("../../../docs/codes/", $id, ".md")))),*]
    };
}

const PAGES: &[(&str, &str)] = pages! {
    "G0501"
    "G0502"
    "G0503"
    "G0504"
    "G0505"
    "G0506"
    "G0507"
    "G0508"
    "G0509"
    "G0510"
    "G0511"
    "G0512"
    "G0513"
    "G0514"
    "G0515"
    "G0516"
    "G0517"
    "G0520"
    "G0521"
    "G0522"
    "G0523"
    "G0524"
    "G0525"
};

/// The net of a page's example, and the kind and text of its file.
fn example(page: &str) -> (String, String, String) {
    let block = page.split("```").nth(1).unwrap();
    let (_, net) = block.split_once('\n').unwrap();
    let (kind, place) = ["stimulus", "trace", "state", "commands", "events"]
        .into_iter()
        .find_map(|kind| Some((kind, net.find(&format!("// {kind}\n"))?)))
        .unwrap();
    let file = net[place..]
        .lines()
        .skip(1)
        .map(|line| line.trim_start_matches("// ").to_owned() + "\n")
        .collect();
    (net.to_owned(), kind.to_owned(), file)
}

fn found(net: &Valid<grafsynth_ir::net::Net>, kind: &str, file: &str) -> Vec<Diagnostic> {
    let place = FileId(1);
    match kind {
        "trace" => Trace::parse_csv(&TraceLayout::of(net), place, file).err().unwrap_or_default(),
        "commands" => file
            .lines()
            .filter_map(|line| Command::parse(net, place, 0, line).err())
            .map(|found| *found)
            .collect(),
        "events" => {
            let (stimulus, mut problems) = Stimulus::parse_csv(net, place, file);
            let events = stimulus.and_then(|stimulus| Events::of(net, &stimulus).err());
            problems.extend(events.map(|finding| *finding));
            problems
        }
        "state" => Simulator::new(net).restore(file).err().unwrap_or_default(),
        _ => {
            let (stimulus, mut problems) = Stimulus::parse_csv(net, place, file);
            if let Some(stimulus) = stimulus {
                let mut simulator = Simulator::new(net);
                let _ = run_with(&mut simulator, &stimulus);
                problems.extend(simulator.notes().diagnostics(net));
                problems.extend(Clocked::of(net, &stimulus).err().map(|finding| *finding));
            }
            problems
        }
    }
}

#[test]
fn the_example_of_each_page_gives_its_code() {
    for (id, page) in PAGES {
        let code = codes::ALL.iter().find(|code| code.id == *id).unwrap();
        assert!(page.starts_with(&format!("# {id}: {}\n", code.title)), "{id}");
        let (source, kind, file) = example(page);
        let (net, problems) = text::parse(FileId(0), &source);
        assert!(problems.is_empty(), "{id}: {problems:#?}");
        let net = validate(net.unwrap()).unwrap_or_else(|problems| panic!("{id}: {problems:#?}"));
        let found: Vec<&str> =
            found(&net, &kind, &file).iter().map(|problem| problem.code.id).collect();
        assert_eq!(found, [*id]);
    }
    assert_eq!(PAGES.len(), codes::ALL.len());
}
