//! Damaged texts: every parser returns findings or a design and never panics; and a design that it accepts can be lowered, checked and run.

use grafsynth_backend_pld::Dialect;
use grafsynth_driver::languages::LANGUAGES;
use grafsynth_driver::pipeline;
use grafsynth_driver::read::{Design, ReadLimits, Texts, read};
use grafsynth_driver::run::logic_trace;
use grafsynth_driver::source::Sources;
use grafsynth_ir::diag::any_error;
use grafsynth_sim::{Random, Stimulus, Trace, TraceLayout};
use grafsynth_tests::rounds;
use grafsynth_verify::structural_facts;

const CHARTS: [&str; 9] = [
    include_str!("../../examples/truck/truck.graf"),
    include_str!("../../examples/bottle-filler/filler.graf"),
    include_str!("../../examples/crossing/crossing.graf"),
    include_str!("../../examples/line-follower/follower.graf"),
    include_str!("../../examples/arbiter/arbiter.graf"),
    include_str!("../../examples/conflict/fig7.graf"),
    include_str!("../../examples/microwave/oven.graf"),
    include_str!("../../examples/drill/drill.graf"),
    include_str!("../cases/semantics/library.graf"),
];

const SCXML: [&str; 2] =
    [include_str!("../scxml/w3c/388.scxml"), include_str!("../scxml/w3c/525.scxml")];
const PROJECTS: [&str; 2] =
    [include_str!("../cases/plcopen/press.xml"), include_str!("../cases/plcopen/parallel.xml")];

const STRUCTURED: [&str; 4] = [
    include_str!("../cases/st/blocks.st"),
    include_str!("../cases/st/qualifiers.st"),
    include_str!("../cases/st/early.st"),
    include_str!("../cases/st/called.st"),
];

const SOURCES: [&str; 3] = [
    include_str!("../cases/c/atoi.c"),
    include_str!("../cases/c/duff.c"),
    include_str!("../cases/c/statements.c"),
];

const MACHINES: [&str; 2] =
    [include_str!("../cases/kiss2/lamp.kiss2"), include_str!("../cases/kiss2/truck.kiss2")];

const FUSES: [&str; 2] = [
    "\u{2}two gates\n*N PINS a:2 b:3 y:12 z:13*QP20*QF2194*QV1*F0*G0*L1792 01111111111111111111111111111111*L1536 11110111111111111111111111111111*L2048 00000011*L2128 1111111111111111111111111111111111111111111111111111111111111111*L2192 10*V1 N01XXXXXXNXLHXXXXXXN*\u{3}0000",
    "*QF5892*F0*L5808 01*K0044 FFFFFFFFFFF*L0088 11110111111111111111111111111111111111111111*",
];

const TABLES: [&str; 2] = [
    ".i 4\n.o 2\n.ilb a b c d\n.ob x y\n.type fd\n.p 3\n1--0 1-\n-11- 01\n0001 -1\n.e\n",
    "# a table\n.i 3\n.o 3\n.phase 101\n.type fdr\n000 1~0\n1-1 -01\n01- 010\n.end\n",
];

/// Valid texts of a language, which the test damages.
fn sound(language: &str) -> Vec<String> {
    let of_charts = |write: &dyn Fn(&grafsynth_driver::read::NetDesign) -> Option<String>| {
        CHARTS
            .iter()
            .filter_map(|text| {
                let mut sources = Sources::default();
                let main = sources.add("chart.graf", *text);
                match read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()).0 {
                    Some(Design::Net(design)) => write(&design),
                    Some(Design::Logic(_)) | None => None,
                }
            })
            .collect::<Vec<_>>()
    };
    let equations = |dialect: Dialect| {
        of_charts(&|design| {
            let logic = pipeline::logic(&design.net, &structural_facts(&design.net)).ok()?;
            // The crossing is too wide for sums of products to be found quickly.
            if logic.flops.len() > 20 {
                return None;
            }
            let options = pipeline::emit_options(&design.net, None, None);
            grafsynth_backend_pld::emit(&logic, dialect, &options).ok().map(|emitted| emitted.text)
        })
    };
    match language {
        "graf" => CHARTS.iter().map(|text| (*text).to_owned()).collect(),
        "rules" => of_charts(&|design| grafsynth_frontend::rules::write_net(&design.net).ok()),
        "scxml" => SCXML.iter().map(|text| (*text).to_owned()).collect(),
        "st" => STRUCTURED.iter().map(|text| (*text).to_owned()).collect(),
        "plcopen" => PROJECTS.iter().map(|text| (*text).to_owned()).collect(),
        "net" => of_charts(&|design| Some(grafsynth_ir::text::print(&design.net))),
        "palasm" => equations(Dialect::Palasm),
        "cupl" => equations(Dialect::Cupl),
        "galasm" => equations(Dialect::Galasm),
        "verilog" => equations(Dialect::Verilog),
        "blif" => equations(Dialect::Blif),
        "kiss2" => MACHINES.iter().map(|text| (*text).to_owned()).collect(),
        "jedec" => FUSES.iter().map(|text| (*text).to_owned()).collect(),
        "pla" => TABLES.iter().map(|text| (*text).to_owned()).collect(),
        "c" => SOURCES.iter().map(|text| (*text).to_owned()).collect(),
        _ => Vec::new(),
    }
}

/// One to four edits: a byte flipped, a piece cut, a piece repeated, a piece of another text, brackets.
fn damaged(texts: &[String], random: &mut Random) -> String {
    let mut bytes = texts[random.below(texts.len())].clone().into_bytes();
    for _ in 0..=random.below(4) {
        let from = random.below(bytes.len().max(1)).min(bytes.len());
        let to = (from + random.below(40)).min(bytes.len());
        match random.below(5) {
            0 => {
                if let Some(byte) = bytes.get_mut(from) {
                    *byte ^= 1 << random.below(8);
                }
            }
            1 => {
                bytes.drain(from..to);
            }
            2 => {
                let piece: Vec<u8> = bytes[from..to].repeat(1 + random.below(20));
                bytes.splice(to..to, piece);
            }
            3 => {
                let other = texts[random.below(texts.len())].as_bytes();
                let at = random.below(other.len());
                let end = (at + random.below(60)).min(other.len());
                bytes.splice(from..to, other[at..end].iter().copied());
            }
            _ => {
                let sign = b"(){}[]/*;:\"'#`-<>&|=,.\n\0"[random.below(24)];
                bytes.splice(from..from, vec![sign; 1 + random.below(300)]);
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

#[test]
fn damaged_designs_give_findings_or_designs() {
    for language in &LANGUAGES {
        let (name, extension) = (language.name, language.extension());
        let texts = sound(name);
        assert!(texts.len() >= 2, "{name}: only {} valid texts", texts.len());
        let mut random = Random::new(17);
        let (mut n_sound, mut n_broken) = (0, 0);
        for round in 0..rounds(250, 10_000) {
            let text = damaged(&texts, &mut random);
            let mut sources = Sources::default();
            let main = sources.add(format!("damaged.{extension}"), text.as_str());
            let asked = Texts { main, language: Some(language), ..Texts::default() };
            let (design, found) = read(&sources, &asked, ReadLimits::default());
            match design {
                None => {
                    assert!(
                        any_error(&found),
                        "{name}, round {round}: nothing read and no error\n{text}"
                    );
                    n_broken += 1;
                }
                Some(design) => {
                    n_sound += 1;
                    match design {
                        Design::Net(design) => {
                            let stimulus = Stimulus::random(&design.net, 3, round, 2);
                            assert_eq!(grafsynth_sim::run(&design.net, &stimulus).rows.len(), 4);
                        }
                        Design::Logic(design) => {
                            let stimulus = Stimulus::random(&design.interface, 3, round, 1);
                            if let Some(logic) = &design.logic {
                                let trace = logic_trace(&design.interface, logic, &stimulus);
                                assert_eq!(trace.expect("a chip's stimulus").rows.len(), 4);
                            }
                        }
                    }
                }
            }
            for finding in &found {
                for label in &finding.labels {
                    assert!(
                        label.span.end as usize <= text.len(),
                        "{name}, round {round}: a location beyond the end\n{text}"
                    );
                }
            }
        }
        assert!(n_broken > 0 && n_sound > 0, "{name}: {n_sound} valid and {n_broken} invalid");
    }
}

#[test]
fn damaged_stimuli_and_traces_give_findings() {
    let mut sources = Sources::default();
    let main = sources.add("chart.graf", CHARTS[1]);
    let Some(Design::Net(design)) =
        read(&sources, &Texts { main, ..Texts::default() }, ReadLimits::default()).0
    else {
        panic!("the filler is a chart");
    };
    let net = &design.net;
    let stimulus = Stimulus::random(net, 30, 1, 5);
    let texts = [stimulus.to_csv(net), grafsynth_sim::run(net, &stimulus).to_csv()];
    let mut random = Random::new(23);
    for _ in 0..rounds(500, 10_000) {
        let text = damaged(&texts, &mut random);
        let (read, found) = Stimulus::parse_csv(net, main, &text);
        assert!(read.is_some() || any_error(&found), "{text}");
        if let Err(found) = Trace::parse_csv(&TraceLayout::of(net), main, &text) {
            assert!(any_error(&found), "{text}");
        }
    }
}
