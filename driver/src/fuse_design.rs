//! An imported fuse map as a design: its macrocells, its circuit if it has one, and findings about test vectors that the fuses fail.

use crate::logic::{Fuses, LogicDesign, interface};
use grafsynth_backend_pld::fuse::{self, vectors};
use grafsynth_backend_pld::jedec::Jedec;
use grafsynth_ir::diag::any_error;
use grafsynth_ir::{Diagnostic, FileId, Span, validate};

/// The maximum number of failed test vector levels that are shown.
const SHOWN_FAILURES: usize = 6;

/// Converts a file to a design: its macrocells, its circuit if it has one, and the findings about it.
///
/// # Errors
/// A device whose fuse map is unknown, and fuses that no data sheet describes.
pub fn design(file: &Jedec, id: FileId) -> Result<(LogicDesign, Vec<Diagnostic>), Vec<Diagnostic>> {
    let start = Span::new(id, 0, 0);
    let placed = |finding: Diagnostic| {
        if finding.labels.is_empty() { finding.at(start, "this file") } else { finding }
    };
    let all = |found: Vec<Diagnostic>| found.into_iter().map(placed).collect::<Vec<_>>();
    let map = file.fuse_map(None).map_err(|finding| all(vec![*finding]))?;
    let mut placement = fuse::decode(&map).map_err(all)?;
    placement.title = title(file).unwrap_or_else(|| map.device.name.to_owned());
    placement.pins = file
        .pins()
        .into_iter()
        .filter(|named| {
            (1..map.device.n_pins).contains(&named.pin) && !map.device.is_supply(named.pin)
        })
        .collect();
    placement.pins.sort_by_key(|named| named.pin);
    placement.pins.dedup_by_key(|named| named.pin);
    if !placement.pins.is_empty() {
        // If the file names its pins, a constant on an unnamed pin is a macrocell that the device cannot disable.
        let whole = placement.clone();
        placement.cells.retain(|cell| {
            let is_read = whole.products().any(|product| product.literal(cell.pin).is_some());
            is_read || !cell.sum.is_empty() || whole.name(cell.pin).is_some()
        });
    }
    let mut found = Vec::new();
    let mut n_failed = 0;
    match vectors::failures(&map, &file.vectors, usize::MAX) {
        Ok(failures) => {
            let mut failed: Vec<usize> = failures.iter().map(|(at, _, _)| *at).collect();
            failed.dedup();
            n_failed = failed.len();
            for (at, pin, level) in failures.into_iter().take(SHOWN_FAILURES) {
                let wanted = file.vectors[at].get(pin as usize - 1).map_or('X', |own| own.letter());
                let message = format!(
                    "test vector {} expects {wanted} at pin {pin}, but the fuses give {}",
                    at + 1,
                    level.letter()
                );
                let finding = Diagnostic::warning(fuse::codes::VECTOR_FAILS, message).help(
                    "correct the letter of the vector if the device does the right thing; otherwise correct the design from which the file was made",
                );
                found.push(match file.vector_spans.get(at) {
                    Some(&span) => finding.at(span, format!("letter {pin} is for pin {pin}")),
                    None => placed(finding),
                });
            }
        }
        Err(finding) => found.push(placed(*finding)),
    }
    if any_error(&found) {
        return Err(found);
    }
    let roles = fuse::own_roles(&placement);
    let (circuit, beyond) = match fuse::logic(&placement, &roles) {
        Ok(circuit) => (Some(circuit), Vec::new()),
        Err(why) => (None, all(why)),
    };
    let (mut parts, roles) = match &circuit {
        Some(circuit) => (circuit.clone(), roles),
        None => fuse::shell(&placement),
    };
    let interface = validate(interface(&mut parts))?;
    let logic = circuit.map(|_| parts.clone());
    let n_vectors = file.vectors.len();
    let fuses = Some(Fuses { map, parts, roles, n_vectors, n_failed });
    Ok((LogicDesign { logic, beyond, placement: Ok(placement), interface, fuses }, found))
}

/// The name of the design, from the head of a file made by grafsynth.
fn title(file: &Jedec) -> Option<String> {
    let (title, _) = file.head.lines().next()?.split_once(" - fuse map made by")?;
    Some(title.to_owned())
}
