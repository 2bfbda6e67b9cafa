//! Stage 5: the report of an output, its files, and the data of the report page.

use super::encode::Encoded;
use super::prove::Proved;
use super::read_back::{Content, ReadBack};
use crate::built::{MapEntry, OutputFile};
use crate::circuit_notes::{codes_and_dont_cares, form};
use crate::coding::groups;
use crate::context::BuildContext;
use crate::fit_advice;
use crate::jedec;
use crate::output_report::{Note, Outcome, OutputReport};
use crate::report::chip::{Chip, Code, Made};
use grafsynth_backend_pld::{Emitted, Named, Object, too_small};

/// An output for the user. A refuted output has a report only.
pub(crate) struct Described {
    pub(crate) report: OutputReport,
    pub(crate) files: Vec<OutputFile>,
    /// The data of the report page, if requested.
    pub(crate) chip: Option<Chip>,
    /// The text, for tools that continue with it.
    pub(crate) emitted: Option<Emitted>,
}

/// Describes an output: the notes in their order, then the files.
pub(crate) fn describe(
    context: &BuildContext<'_>,
    encoded: Encoded,
    read_back: ReadBack,
    proved: Proved,
) -> Described {
    let content = read_back.content;
    let Proved { mut report, emergency, safety } = proved;
    let evolution = form(context.net, context.facts, &encoded.logic, context.options.busy);
    let notes = &mut report.notes;
    if let Content::Fuses(burned) = &content {
        notes.extend(jedec::notes(burned, &report.name));
        notes.extend(burned.placement.moved.iter().cloned().map(Note::PinMoved));
    }
    notes.extend(emergency);
    notes.extend(
        codes_and_dont_cares(&encoded.coded, &encoded.logic, &encoded.options).map(Note::Codes),
    );
    notes.extend(safety);
    if let Content::Text(emitted) = &content {
        notes.extend(open_pins(context, emitted));
        let moved = emitted.equations.iter().flat_map(|equations| &equations.moved);
        notes.extend(moved.cloned().map(Note::PinMoved));
    }
    notes.extend(evolution.clone().map(Note::Form));
    notes.extend(grafsynth_logic::kept_apart(context.net).into_iter().map(|(history, why)| {
        let name = context.net.histories[history].name.to_string();
        Note::History { name, why: why.to_string() }
    }));
    notes.extend(
        encoded.chains.first().map(|chain| Note::Synchronised {
            pins: encoded.chains.len(),
            stages: chain.flops.len(),
        }),
    );
    if report.outcome() == Outcome::Refuted {
        return Described { report, files: Vec::new(), chip: None, emitted: None };
    }
    let chip = context.options.report.then(|| {
        let made = Made {
            file: &report.name,
            outcome: report.outcome(),
            circuit: &encoded.circuit,
            chains: &encoded.chains,
            code: Some(code(context, &encoded, &content)),
            evolution,
            dont_cares: encoded.options.dont_cares,
            budget: encoded.options.budget,
        };
        let mut chip = chip(made, &encoded, &content);
        chip.read_back = read_back.circuit;
        if let Content::Fuses(burned) = &content {
            chip.roles.clone_from(&burned.roles);
        }
        chip
    });
    let name = report.name.clone();
    let (files, emitted) = match content {
        Content::Fuses(burned) => (vec![OutputFile::new(name, burned.text)], None),
        Content::Text(emitted) => (text_files(context, name, &emitted), Some(emitted)),
    };
    Described { report, files, chip, emitted }
}

/// The note on pins that were left open on a device that the user named, with advice.
fn open_pins(context: &BuildContext<'_>, emitted: &Emitted) -> Option<Note> {
    let is_open = |named: &Named| {
        named.pin.is_none() && matches!(named.object, Object::Input(_) | Object::Output(_))
    };
    let equations = emitted.equations.as_ref()?;
    if context.options.device.is_none() || !emitted.names.iter().any(is_open) {
        return None;
    }
    let advice = fit_advice::advice_for(context);
    let lacks = equations.lacks.join("; ");
    Some(Note::PinsOpen(if lacks.is_empty() || advice.is_empty() {
        format!("{lacks}{advice}")
    } else {
        format!("{lacks}; {advice}")
    }))
}

/// The encoding for the report page.
fn code(context: &BuildContext<'_>, encoded: &Encoded, content: &Content) -> Code {
    let BuildContext { net, facts, logic, options, medium, .. } = *context;
    let coded = &encoded.coded;
    // A circuit with only one encoding was not fitted before it was written.
    let lacks_now = || match content {
        Content::Text(emitted) if medium.dialect().is_flat() => {
            too_small(&encoded.logic, &encoded.options)
                .or_else(|| emitted.equations.as_ref().and_then(|equations| equations.misfit()))
        }
        Content::Text(_) | Content::Fuses(_) => None,
    };
    let is_tried = coded.one_hot_lacks.is_some();
    let why_not_one_hot = if is_tried { coded.one_hot_lacks.clone() } else { lacks_now() };
    Code {
        encoding: coded.encoding,
        choice: options.encoding,
        n_coded: coded.n_coded,
        n_groups: groups(net, facts, logic).len(),
        why_not_one_hot,
        is_safe: options.safe,
    }
}

/// The data of the report page.
fn chip(made: Made<'_>, encoded: &Encoded, content: &Content) -> Chip {
    match content {
        Content::Text(emitted) => {
            let vectors = encoded.options.vectors.as_ref();
            Chip::of_text(made, emitted, vectors.map_or(0, |vectors| vectors.rows.len()))
        }
        Content::Fuses(burned) => {
            let (placement, roles) = (&burned.placement, &burned.roles);
            Chip::burned(made, &burned.map, placement, roles, burned.vectors.len())
        }
    }
}

/// The text with the origin of each line, and its test bench.
fn text_files(context: &BuildContext<'_>, name: String, emitted: &Emitted) -> Vec<OutputFile> {
    let lines = emitted.map.iter().cloned();
    let map = lines.map(|line| MapEntry {
        line: line.line,
        name: line.name,
        span: line.span,
        req: line.req,
    });
    let text = OutputFile { map: map.collect(), ..OutputFile::new(name, emitted.text.clone()) };
    let bench = emitted.bench.clone().map(|bench| {
        let stem = context.options.stem_for(context.net);
        OutputFile::new(format!("{stem}_tb.{}", emitted.dialect.extension()), bench)
    });
    std::iter::once(text).chain(bench).collect()
}
