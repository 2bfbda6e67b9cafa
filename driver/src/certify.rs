//! Certificates for the library charts of a file (section IV.C of the paper on Grafcet, C and PALASM). A certificate names the proved properties of a chart,
//! the version that proved them, and the hash of its text.
//!
//! [`certificates`](crate::libraries::certificates) checks those that a file has; [`certify`] writes them.

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
    /// The text of the file, unchanged except for the certificates: each follows its library chart or replaces the former one.
    pub text: String,
    /// The number of library charts that now have a certificate.
    pub charts: usize,
    /// The number of properties in the certificates.
    pub properties: usize,
    /// Each named property with its result, in order.
    pub verdicts: Vec<Certifiable>,
    /// Properties that are in no certificate, and library charts that are not certified, each with the reason.
    pub found: Vec<Diagnostic>,
}

/// A named property of a library chart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Certifiable {
    /// Its name, with its location.
    pub name: Name,
    /// The library chart.
    pub of: Name,
    /// The chart alone, to which a witness stimulus belongs.
    pub net: Valid<Net>,
    /// The result.
    pub outcome: Outcome,
}

/// Proves the named properties of the library charts in `file`, each chart alone. For each chart, it writes a certificate that lists the proved ones. Each
/// property gets one proof within `limits`. A certificate cannot list a property without a name. Tasks without a declared cost get the estimate of the model of
/// `machine`.
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
    // The ranges of text to replace, and their replacements.
    let mut changes: Vec<(std::ops::Range<usize>, String)> = Vec::new();
    for (index, library) in design.libraries.iter().enumerate() {
        if library.span.file != file || library.span.start == library.span.end {
            continue;
        }
        let net = match task_costs::alone(design, index, machine) {
            Ok(net) => net,
            Err(why) => {
                let message = format!(
                    "`{}` is not certified: the library chart alone has errors",
                    library.name
                );
                let finding = Diagnostic::warning(codes::CERTIFICATE, message);
                let help = "`use` it in a chart of this file and run `check` to see them";
                certified.found.push(finding.at(library.name.span, why).help(help));
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
                // A comment after the closing brace belongs to the chart, so the line is not split.
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

/// The results of the named properties of a library chart, in order.
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
            let message = format!(
                "a property of `{}` cannot be certified because it has no name",
                library.name
            );
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
                Some(format!("it is violated in row {row} of a stimulus"))
            }
            Outcome::Open(why) => Some(why.to_string()),
        };
        if let Some(why) = why {
            let message = format!(
                "property `{name}` of `{}` is not certified, because it is not proved",
                library.name
            );
            let help = match verdict.outcome {
                Outcome::Proved { .. } | Outcome::Refuted { .. } => {
                    "correct the chart or the property; `check` of a file with only this library chart shows the stimulus"
                }
                Outcome::Open(_) => "raise --proof-limit, or make the property simpler",
            };
            found.push(Diagnostic::warning(codes::CERTIFICATE, message).at(span, why).help(help));
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
