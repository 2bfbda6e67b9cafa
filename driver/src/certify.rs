//! Certificates for the library charts of a file: what is proved of each, by which version, of which text (seed 004, IV.C).
//!
//! [`certificates`](crate::libraries::certificates) looks at those that a file has; [`certify`] writes them.

use crate::codes;
use crate::source::Sources;
use crate::task_costs;
use grafsynth_backend_c::cost::Machine;
use grafsynth_frontend::graf;
use grafsynth_ir::chart::{Certificate, Design, Library};
use grafsynth_ir::net::{Net, PropertyRole};
use grafsynth_ir::{Diagnostic, FileId, Name, Valid};
use grafsynth_verify::{Limits, Outcome};

/// A text with its certificates.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Certified {
    /// The text of the file: as it was, but for the certificates, each behind its library chart or in the place of the former one.
    pub text: String,
    /// How many library charts have one now.
    pub charts: usize,
    /// How many properties they name.
    pub properties: usize,
    /// Each named property and what is known of it, in their order.
    pub verdicts: Vec<Certifiable>,
    /// Named properties that no certificate names, with the reason.
    pub found: Vec<Diagnostic>,
}

/// A named property of a library chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Certifiable {
    /// Its name, where it stands.
    pub name: Name,
    /// The library chart.
    pub of: Name,
    /// The chart by itself, which a witness is a stimulus of.
    pub net: Valid<Net>,
    /// What is known of it.
    pub outcome: Outcome,
}

/// Proves the named properties of the library charts that stand in `file`, each chart by itself, and writes down which hold. One proof a property, within
/// `limits`. Properties without a name cannot be mentioned. Tasks that declare no cost have the one that the model of `machine` counts.
#[must_use]
pub fn certify(
    design: &Design,
    machine: Option<&'static Machine>,
    sources: &Sources,
    file: FileId,
    limits: &Limits,
) -> Certified {
    let text = sources.get(file).map_or("", |source| source.text.as_str());
    let mut certified = Certified {
        text: String::new(),
        charts: 0,
        properties: 0,
        verdicts: Vec::new(),
        found: Vec::new(),
    };
    // Where text is replaced, and by what.
    let mut changes: Vec<(std::ops::Range<usize>, String)> = Vec::new();
    for (index, library) in design.libraries.iter().enumerate() {
        if library.span.file != file || library.span.start == library.span.end {
            continue;
        }
        let net = match task_costs::alone(design, index, machine) {
            Ok(net) => net,
            Err(why) => {
                let message = format!("{} is not certified: by itself it has errors", library.name);
                let finding = Diagnostic::warning(codes::CERTIFICATE, message);
                certified.found.push(finding.at(library.name.span, why));
                continue;
            }
        };
        let verdicts = verdicts(&net, library, limits, &mut certified.found);
        let holds = |one: &&Certifiable| matches!(one.outcome, Outcome::Proved { .. });
        let properties: Vec<Name> =
            verdicts.iter().filter(holds).map(|one| one.name.clone()).collect();
        certified.verdicts.extend(verdicts);
        certified.charts += 1;
        certified.properties += properties.len();
        let certificate = graf::write_certificate(&Certificate {
            of: library.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            hash: graf::fingerprint(library),
            properties,
            ..Certificate::default()
        });
        changes.push(match &library.certificate {
            Some(old) => (old.span.range(), certificate),
            None => {
                // A comment behind the closing brace speaks of the chart, so the line stays whole.
                let end = library.span.range().end;
                let rest = text.get(end..).unwrap_or_default().lines().next().unwrap_or_default();
                let is_end = rest.trim().is_empty() || rest.trim_start().starts_with('#');
                let at = if is_end { end + rest.len() } else { end };
                (at..at, format!("\n{certificate}{}", if is_end { "" } else { "\n" }))
            }
        });
    }
    changes.sort_by_key(|(range, _)| range.start);
    let mut at = 0;
    for (range, certificate) in changes {
        certified.text.push_str(text.get(at..range.start).unwrap_or_default());
        certified.text.push_str(&certificate);
        at = range.end;
    }
    certified.text.push_str(text.get(at..).unwrap_or_default());
    certified
}

/// What is known of the named properties of a library chart, in their order.
fn verdicts(
    net: &Valid<Net>,
    library: &Library,
    limits: &Limits,
    found: &mut Vec<Diagnostic>,
) -> Vec<Certifiable> {
    let mut verdicts = Vec::new();
    for verdict in grafsynth_verify::properties(net, limits) {
        let property = &net.properties[verdict.property];
        if property.role == PropertyRole::Assume {
            continue;
        }
        let (name, span) = (&property.name, property.meta.span);
        if name.is_empty() {
            let message = format!("a property of {} has no name to certify it by", library.name);
            found.push(
                Diagnostic::note(codes::CERTIFICATE, message)
                    .at(span, "")
                    .help("write a name before it: `assert still: never ..`"),
            );
            continue;
        }
        let why = match &verdict.outcome {
            Outcome::Proved { .. } => None,
            Outcome::Refuted { row, .. } => {
                Some(format!("it is broken in row {row} of a stimulus"))
            }
            Outcome::Open(why) => Some(why.to_string()),
        };
        if let Some(why) = why {
            let message = format!("{name} of {} is not certified: it is not proved", library.name);
            found.push(Diagnostic::warning(codes::CERTIFICATE, message).at(span, why));
        }
        let name = Name::new(name.clone(), span);
        verdicts.push(Certifiable {
            name,
            of: library.name.clone(),
            net: net.clone(),
            outcome: verdict.outcome,
        });
    }
    verdicts
}
