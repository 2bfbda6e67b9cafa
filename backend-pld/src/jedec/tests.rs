//! The reader, tested with files from other tools and with damaged files.

use super::{read, transmission_checksum};
use crate::fuse::vectors::Level;
use grafsynth_ir::span::FileId;
use proptest::prelude::*;

/// A file for a device with 13 fuses, with its checksums.
fn file(fields: &str) -> String {
    let body = format!("\u{2}made by hand\n*{fields}\u{3}");
    let sum = transmission_checksum(body.as_bytes());
    format!("{body}{sum:04x}\n")
}

/// The findings of a file, each as its code, line, column and message.
fn findings(text: &str) -> Vec<String> {
    let (_, found) = read(FileId(0), text);
    found
        .iter()
        .map(|finding| {
            let start = finding.labels[0].span.range().start;
            let before = &text[..start];
            let line = before.matches('\n').count() + 1;
            let column = start - before.rfind('\n').map_or(0, |at| at + 1) + 1;
            format!("{} {line}:{column} {}", finding.code.id, finding.message)
        })
        .collect()
}

#[test]
fn all_fields_are_read() {
    let text = file(
        "QP4*QF13*QV2*F1*G1*N PINS a:1 b:2*L0000 0101*\nL8 0 0*K12 8*C0116*X0*V1 01NC*\nV0002 HLZX*",
    );
    let (jedec, found) = read(FileId(0), &text);
    assert_eq!(found, []);
    let jedec = jedec.unwrap();
    let bits: String = jedec.fuses.iter().map(|fuse| if *fuse { '1' } else { '0' }).collect();
    assert_eq!(bits, "0101111100111");
    assert!(jedec.is_secured);
    assert_eq!((jedec.head.as_str(), jedec.n_pins), ("made by hand", Some(4)));
    let pins: Vec<_> = jedec.pins().into_iter().map(|pin| (pin.pin, pin.name)).collect();
    assert_eq!(pins, [(1, "a".to_owned()), (2, "b".to_owned())]);
    assert_eq!(jedec.vectors[0], [Level::Low, Level::High, Level::NotTested, Level::Clock]);
    assert_eq!(
        jedec.vectors[1],
        [Level::ExpectHigh, Level::ExpectLow, Level::ExpectOff, Level::Ignore]
    );
}

#[test]
fn everything_wrong_comes_at_once_with_its_place() {
    let text = file("QFx*\nQP4*Q1*\nL0000 0121*\nC12*\nV3 0*\nV4 01?1*\n=5*\nF2*");
    assert_eq!(
        findings(&text),
        [
            "G0785 2:4 the number of fuses must be a decimal number, not `x`",
            "G0785 3:5 unknown quantity `Q1`",
            "G0785 4:7 this `L` field comes before the number of fuses",
            "G0785 5:2 the checksum of the fuses must have four hexadecimal digits, not `12`",
            "G0785 6:2 found vector 3, expected vector 1",
            "G0785 6:2 vector 3 has 1 letters for 4 pins",
            "G0785 7:6 invalid test vector letter `?`",
            "G0785 8:1 unknown JEDEC field `=`",
            "G0785 9:2 the default of all fuses must be 0 or 1, not `2`",
            "G0785 2:1 the number of fuses (field QF) is missing",
        ]
    );
}

#[test]
fn fuses_are_counted_and_given_once() {
    assert_eq!(
        findings(&file("QF4*L2 010*L0 1*L0 0*")),
        [
            "G0785 2:11 fuse 4 does not exist: the device has 4 fuses, counted from 0",
            "G0785 2:21 fuse 0 is defined twice, with different values",
            "G0785 2:2 1 fuses have no value, the first of them fuse 1, and there is no default (field F)",
        ]
    );
}

#[test]
fn sums_are_checked() {
    let good = file("QF8*L0 11000000*C0003*");
    assert_eq!(findings(&good), [""; 0]);
    assert_eq!(
        findings(&file("QF8*L0 11000000*C0004*")),
        ["G0786 2:18 the checksum of the fuses is 0004, but they add up to 0003"]
    );
    let changed = good.replace("made", "Made");
    assert_eq!(findings(&changed).len(), 1, "{:?}", findings(&changed));
    assert!(findings(&changed)[0].starts_with("G0786 2:25 the transmission's checksum is"));
    // Not counted, or counted with the line ends of another system.
    let sum = good.len() - 5;
    assert_eq!(findings(&format!("{}0000", &changed[..sum])), [""; 0]);
    assert_eq!(findings(&good.replace('\n', "\r\n")), [""; 0]);
}

#[test]
fn a_transmission_has_a_beginning_and_an_end() {
    let good = file("QF1*F0*");
    assert!(findings(&good.replace('\u{2}', ""))[0].contains("start character"));
    assert!(findings(&good.replace('\u{3}', ""))[0].contains("end character"));
    assert!(findings("QF1").join("").contains("no field"));
    assert_eq!(findings("head*QF1*F0*"), [""; 0], "files without both are common");
}

proptest! {
    /// Any changed file is either read or rejected.
    #[test]
    fn damaged_files_are_read_or_refused(at in 0usize..120, with in "\\PC{0,3}", length in 0usize..4) {
        let mut text: Vec<char> =
            file("QP4*QF13*QV2*F1*G1*L0000 0101*\nK12 8*C0116*X0*V1 01NC*\nV0002 HLZX*").chars().collect();
        let at = at.min(text.len());
        let end = (at + length).min(text.len());
        text.splice(at..end, with.chars());
        let text: String = text.into_iter().collect();
        let (jedec, found) = read(FileId(0), &text);
        prop_assert!(jedec.is_some() != found.iter().any(grafsynth_ir::Diagnostic::is_error));
    }
}
