//! The reader.
//!
//! A file is a transmission: a start character, free text up to the first `*`, fields that end with `*`, an end character, and four
//! hexadecimal digits that give the sum of all bytes from the start to the end character (`0000`: not checked). A file without these two
//! characters is accepted too, because many files lack them; then there is no sum to check.

use super::{ETX, Jedec, STX, transmission_checksum};
use crate::fuse::vectors::{Level, Vector};
use crate::fuse::{checksum, codes};
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::{FileId, Span};

/// A file with more fuses is not read; the largest device in use has a few hundred thousand.
const MOST_FUSES: u32 = 1 << 22;
/// Vectors beyond this number are not read.
const MOST_VECTORS: usize = 1 << 16;
/// The maximum number of findings for a file.
const MOST_FINDINGS: usize = 100;

/// Reads a file. All findings are reported at once; if one of them is an error, there is no result.
#[must_use]
pub fn read(file: FileId, text: &str) -> (Option<Jedec>, Vec<Diagnostic>) {
    let mut reader = Reader::new(file, text);
    reader.run();
    let is_wrong = reader.found.iter().any(Diagnostic::is_error);
    ((!is_wrong).then_some(reader.jedec), reader.found)
}

/// The text of a field, without the `*` at its end.
#[derive(Debug, Clone, Copy)]
struct Field<'a> {
    text: &'a str,
    start: usize,
}

struct Reader<'a> {
    file: FileId,
    text: &'a str,
    jedec: Jedec,
    found: Vec<Diagnostic>,
    n_fuses: Option<u32>,
    n_vectors: Option<(u32, Span)>,
    /// The default of fuses that no field defines.
    default: Option<bool>,
    /// True if the field of the security fuse was found.
    has_security: bool,
    /// For each fuse, whether the fields define it.
    is_given: Vec<bool>,
    fuse_sum: Option<(u16, Span)>,
    /// The number of vectors that were read.
    n_vectors_read: u32,
}

impl<'a> Reader<'a> {
    fn new(file: FileId, text: &'a str) -> Self {
        Reader {
            file,
            text,
            jedec: Jedec::default(),
            found: Vec::new(),
            n_fuses: None,
            n_vectors: None,
            default: None,
            has_security: false,
            is_given: Vec::new(),
            fuse_sum: None,
            n_vectors_read: 0,
        }
    }

    fn span(&self, start: usize, end: usize) -> Span {
        Span::new(self.file, start, end.max(start))
    }

    fn report(&mut self, finding: Diagnostic) {
        if self.found.len() < MOST_FINDINGS {
            self.found.push(finding);
        }
    }

    fn error(&mut self, start: usize, end: usize, message: impl Into<String>, help: &str) {
        let span = self.span(start, end);
        self.report(Diagnostic::error(codes::SYNTAX, message).at(span, "").help(help));
    }

    fn run(&mut self) {
        let bytes = self.text.as_bytes();
        let start = bytes.iter().position(|byte| *byte == STX);
        let from = start.map_or(0, |at| at + 1);
        let end = bytes[from..].iter().position(|byte| *byte == ETX).map(|at| at + from);
        match (start, end) {
            (Some(start), Some(end)) => self.transmission_sum(start, end),
            (Some(start), None) => self.error(
                start,
                start + 1,
                "the end character (hexadecimal 03) of the transmission is missing",
                "the file may be truncated: get it again, or remove the start character here",
            ),
            (None, Some(end)) => self.error(
                end,
                end + 1,
                "the start character (hexadecimal 02) of the transmission is missing",
                "remove the end character here and the four digits after it, or get the file again",
            ),
            (None, None) => {}
        }
        let body = &self.text[from..end.unwrap_or(bytes.len())];
        let Some(head) = body.find('*') else {
            self.error(
                from,
                from + body.len(),
                "no field: a JEDEC file needs fields that end with `*`",
                "check that this is a fuse map",
            );
            return;
        };
        body[..head].trim().clone_into(&mut self.jedec.head);
        let mut at = from + head + 1;
        let body_end = from + body.len();
        while at < body_end {
            let rest = &self.text[at..body_end];
            let blank = rest.len() - rest.trim_start().len();
            let begin = at + blank;
            let rest = &self.text[begin..body_end];
            if rest.is_empty() {
                break;
            }
            match rest.find('*') {
                Some(length) => {
                    self.field(Field { text: &rest[..length], start: begin });
                    at = begin + length + 1;
                }
                None => {
                    let last = begin + rest.trim_end().len();
                    let help = "write `*` after it if it is complete; otherwise the file is truncated, so get it again";
                    self.error(begin, last, "the last field does not end with `*`", help);
                    break;
                }
            }
        }
        self.finish(from + head);
    }

    /// Checks the sum after the end character.
    fn transmission_sum(&mut self, start: usize, end: usize) {
        let rest = &self.text[end + 1..];
        let digits = rest.trim_start();
        let at = end + 1 + (rest.len() - digits.len());
        let length = digits.bytes().take_while(u8::is_ascii_hexdigit).count();
        if length != 4 {
            let found = Diagnostic::error(
                codes::SYNTAX,
                format!("expected four hexadecimal digits after the transmission, found {length}"),
            );
            let span = self.span(at, at + length);
            self.report(
                found
                    .at(span, "the checksum of the transmission")
                    .help("write 0000 to skip the check"),
            );
            return;
        }
        let said = u16::from_str_radix(&digits[..4], 16).unwrap_or(0);
        let counted = transmission_checksum(&self.text.as_bytes()[start..=end]);
        // Line ends change if files are moved between systems; the sum over the other form is accepted too.
        let other = transmission_checksum(&with_other_ends(&self.text[start..=end]));
        if said != 0 && said != counted && said != other {
            let span = self.span(at, at + 4);
            self.report(
                Diagnostic::error(
                    codes::CHECKSUM,
                    format!("the transmission's checksum is {said:04X}, and its bytes add up to {counted:04X}"),
                )
                .at(span, "given here")
                .help("the file was changed after it was written: get it from its source again, or write 0000 here to skip the check"),
            );
        }
    }

    fn field(&mut self, field: Field<'a>) {
        let Some(letter) = field.text.chars().next() else { return };
        let body = Field {
            text: &field.text[letter.len_utf8()..],
            start: field.start + letter.len_utf8(),
        };
        match letter {
            'N' => self.jedec.notes.push(body.text.trim().to_owned()),
            'Q' => self.quantity(body),
            'F' => {
                // After an error, reading continues as if this were 0.
                self.default = Some(self.bit(body, "the default of all fuses").unwrap_or(false));
            }
            'G' => {
                if let Some(bit) = self.bit(body, "the security fuse") {
                    if std::mem::replace(&mut self.has_security, true)
                        && self.jedec.is_secured != bit
                    {
                        let end = field.start + field.text.trim_end().len();
                        let message = "the security fuse is defined twice, as blown and as intact";
                        self.error(field.start, end, message, "remove one of the `G` fields");
                    }
                    self.jedec.is_secured = bit;
                }
            }
            'L' => self.fuse_list(body, false),
            'K' => self.fuse_list(body, true),
            'C' => self.sum(body),
            'V' => self.vector(body),
            // The default level in tests does not change the logic.
            'X' => {
                let _ = self.bit(body, "the default of tests");
            }
            'P' | 'R' | 'S' | 'T' | 'A' | 'J' | 'D' | 'E' | 'U' | 'B' | 'I' | 'M' | 'O' | 'W'
            | 'Y' | 'Z' | 'H' => self.passed_over(letter, field),
            other => {
                let message = format!("unknown JEDEC field `{other}`");
                let help = "remove the field, or check the `*` before it; `N` begins a note";
                self.error(field.start, field.start + other.len_utf8(), message, help);
            }
        }
    }

    fn passed_over(&mut self, letter: char, field: Field<'a>) {
        let what = match letter {
            'P' => "the order of the pins in test vectors",
            'R' | 'S' | 'T' => "signature tests",
            'A' => "access times",
            'J' => "the device's registry code",
            'D' => "the device's number, removed from the standard",
            'E' => "electrical features",
            'U' => "user data outside the fuses",
            _ => "a reserved letter",
        };
        // Tests, access times and device numbers do not change the contents.
        if !matches!(letter, 'R' | 'S' | 'T' | 'A' | 'J' | 'D') {
            let span = self.span(field.start, field.start + field.text.trim_end().len());
            self.report(
                Diagnostic::warning(
                    codes::PASSED_OVER,
                    format!("field `{letter}` ({what}) is ignored"),
                )
                .at(span, "")
                .help(match letter {
                    'P' => "write the letters of each vector in the order of the pins, and remove the field",
                    _ => "remove it if the device does not need it: grafsynth does not write this field to new fuse maps",
                }),
            );
        }
    }

    fn number(&mut self, field: Field<'a>, what: &str) -> Option<u32> {
        let text = field.text.trim();
        let at = field.start + (field.text.len() - field.text.trim_start().len());
        match text.parse::<u32>() {
            Ok(number) => Some(number),
            Err(_) => {
                let message = format!("{what} must be a decimal number, not `{}`", shown(text));
                self.error(
                    at,
                    at + text.len(),
                    message,
                    "write digits 0 to 9 after the letter of the field",
                );
                None
            }
        }
    }

    fn bit(&mut self, field: Field<'a>, what: &str) -> Option<bool> {
        match field.text.trim() {
            "0" => Some(false),
            "1" => Some(true),
            other => {
                let message = format!("{what} must be 0 or 1, not `{}`", shown(other));
                let end = field.start + field.text.len();
                let letter = field.start.checked_sub(1).and_then(|at| self.text.as_bytes().get(at));
                let letter = letter.map_or('F', |byte| char::from(*byte));
                self.error(field.start, end, message, &format!("write `{letter}0` or `{letter}1`"));
                None
            }
        }
    }

    fn quantity(&mut self, field: Field<'a>) {
        let Some(letter) = field.text.chars().next() else {
            self.error(
                field.start - 1,
                field.start,
                "a `Q` field needs a second letter",
                "write QF (fuses), QP (pins) or QV (test vectors), and the number",
            );
            return;
        };
        let body = Field {
            text: &field.text[letter.len_utf8()..],
            start: field.start + letter.len_utf8(),
        };
        let span = self.span(field.start - 1, field.start + field.text.trim_end().len());
        match letter {
            'F' => {
                let Some(number) = self.number(body, "the number of fuses") else { return };
                if number > MOST_FUSES {
                    let message = format!("{number} fuses exceed the limit of {MOST_FUSES}");
                    let help =
                        "check the number: the largest device in use has a few hundred thousand";
                    self.error(body.start, body.start + body.text.len(), message, help);
                } else if self.n_fuses.is_some() {
                    self.error(
                        body.start,
                        body.start + body.text.len(),
                        "the number of fuses is defined twice",
                        "remove this field",
                    );
                } else if !self.is_given.is_empty() {
                    self.error(
                        body.start,
                        body.start + body.text.len(),
                        "the number of fuses comes after the first fuses",
                        "move this field before the first `L`",
                    );
                } else {
                    self.n_fuses = Some(number);
                    self.jedec.span = span;
                    self.jedec.fuses = vec![false; number as usize];
                    self.is_given = vec![false; number as usize];
                }
            }
            'P' => self.jedec.n_pins = self.number(body, "the number of pins"),
            'V' => {
                self.n_vectors =
                    self.number(body, "the number of vectors").map(|number| (number, span));
            }
            other => {
                let message = format!("unknown quantity `Q{other}`");
                let help = "write QF (fuses), QP (pins) or QV (test vectors)";
                self.error(field.start - 1, field.start + other.len_utf8(), message, help);
            }
        }
    }

    /// Reads `L0040 0101...`, or `K` with hexadecimal digits of four fuses each.
    fn fuse_list(&mut self, field: Field<'a>, is_hex: bool) {
        let text = field.text;
        let digits = text.bytes().take_while(u8::is_ascii_digit).count();
        let Some(first) =
            self.number(Field { text: &text[..digits], start: field.start }, "the first fuse")
        else {
            return;
        };
        let after = &text[digits..];
        if !after.is_empty() && !after.starts_with(char::is_whitespace) && !is_hex {
            let at = field.start + digits;
            let message = "expected a blank between the first fuse and the list";
            self.error(at, at + 1, message, "write it as in `L0040 0110`");
            return;
        }
        let mut fuse = first as usize;
        for (offset, c) in after.char_indices() {
            let at = field.start + digits + offset;
            if c.is_whitespace() {
                continue;
            }
            let bits: Vec<bool> = match (is_hex, c) {
                (false, '0' | '1') => vec![c == '1'],
                (true, _) if c.is_ascii_hexdigit() => {
                    let value = c.to_digit(16).unwrap_or(0);
                    (0..4).rev().map(|bit| value >> bit & 1 == 1).collect()
                }
                _ => {
                    let (message, help) = if is_hex {
                        (
                            format!("expected a hexadecimal digit (four fuses), found `{c}`"),
                            "write 0 to 9 or A to F, or get the file from its source again",
                        )
                    } else {
                        (
                            format!("a fuse must be 0 or 1, not `{c}`"),
                            "write 0 (intact) or 1 (blown), or get the file from its source again",
                        )
                    };
                    self.error(at, at + c.len_utf8(), message, help);
                    return;
                }
            };
            for bit in bits {
                if !self.fuse(fuse, bit, at, is_hex) {
                    return;
                }
                fuse += 1;
            }
        }
    }

    fn fuse(&mut self, fuse: usize, bit: bool, at: usize, is_hex: bool) -> bool {
        let Some(given) = self.is_given.get_mut(fuse) else {
            // The last hexadecimal digit may contain padding.
            if is_hex && !bit {
                return true;
            }
            let (message, help) = match self.n_fuses {
                Some(n_fuses) => (
                    format!(
                        "fuse {fuse} does not exist: the device has {n_fuses} fuses, counted from 0"
                    ),
                    "correct the first number of this `L` field, or the number of fuses in `QF`",
                ),
                None => (
                    "this `L` field comes before the number of fuses".to_owned(),
                    "write the number of fuses in a field before this one, as in `QF2194*`",
                ),
            };
            self.error(at, at + 1, message, help);
            return false;
        };
        if *given && self.jedec.fuses[fuse] != bit {
            self.error(
                at,
                at + 1,
                format!("fuse {fuse} is defined twice, with different values"),
                "check the first number of this field and of the one before it: their fuses overlap",
            );
            return false;
        }
        *given = true;
        self.jedec.fuses[fuse] = bit;
        true
    }

    fn sum(&mut self, field: Field<'a>) {
        let text = field.text.trim();
        let span = self.span(field.start - 1, field.start + field.text.trim_end().len());
        match u16::from_str_radix(text, 16) {
            Ok(sum) if text.len() == 4 => self.fuse_sum = Some((sum, span)),
            Ok(_) | Err(_) => {
                let message = format!(
                    "the checksum of the fuses must have four hexadecimal digits, not `{}`",
                    shown(text)
                );
                let end = field.start + field.text.len();
                self.error(field.start, end, message, "remove the field to skip the check");
            }
        }
    }

    fn vector(&mut self, field: Field<'a>) {
        let digits = field.text.bytes().take_while(u8::is_ascii_digit).count().min(4);
        let Some(number) = self.number(
            Field { text: &field.text[..digits], start: field.start },
            "the number of a vector",
        ) else {
            return;
        };
        self.n_vectors_read += 1;
        if number != self.n_vectors_read {
            let message = format!("found vector {number}, expected vector {}", self.n_vectors_read);
            let help = "number the vectors from 1 in their order; one may be missing";
            self.error(field.start, field.start + digits, message, help);
            self.n_vectors_read = number;
        }
        let mut vector: Vector = Vec::new();
        for (offset, c) in field.text[digits..].char_indices() {
            let at = field.start + digits + offset;
            if c.is_whitespace() {
                continue;
            }
            let level = Level::ALL.iter().find(|(_, letter)| *letter == c.to_ascii_uppercase());
            match (level, c) {
                (Some((level, _)), _) => vector.push(*level),
                // Super voltages, preloads and buried registers concern only the programmer.
                (None, '2'..='9' | 'B' | 'P' | 'F' | 'D' | 'U') => vector.push(Level::Ignore),
                (None, _) => {
                    self.error(
                        at,
                        at + c.len_utf8(),
                        format!("invalid test vector letter `{c}`"),
                        "write 0, 1, C or K for an input, H, L or Z for an output, X or N for neither",
                    );
                    return;
                }
            }
        }
        if let Some(n_pins) = self.jedec.n_pins
            && vector.len() != n_pins as usize
        {
            let message = format!("vector {number} has {} letters for {n_pins} pins", vector.len());
            let help = format!("write one letter for each of the {n_pins} pins, or correct `QP`");
            let end = field.start + field.text.trim_end().len();
            self.error(field.start, end, message, &help);
        }
        if self.jedec.vectors.len() < MOST_VECTORS {
            self.jedec.vectors.push(vector);
            let end = field.start + field.text.trim_end().len();
            self.jedec.vector_spans.push(self.span(field.start - 1, end));
        }
    }

    fn finish(&mut self, head_end: usize) {
        if self.n_fuses.is_none() {
            self.error(
                head_end,
                head_end + 1,
                "the number of fuses (field QF) is missing",
                "write it as the first field after this `*`, as in `QF2194*` for a gal16v8",
            );
            return;
        }
        let missing = self.is_given.iter().filter(|is_given| !**is_given).count();
        match self.default {
            Some(default) => {
                for (fuse, is_given) in self.jedec.fuses.iter_mut().zip(&self.is_given) {
                    if !is_given {
                        *fuse = default;
                    }
                }
            }
            None if missing > 0 => {
                let first = self.is_given.iter().position(|is_given| !is_given).unwrap_or(0);
                let span = self.jedec.span;
                self.report(
                    Diagnostic::error(
                        codes::SYNTAX,
                        format!("{missing} fuses have no value, the first of them fuse {first}, and there is no default (field F)"),
                    )
                    .at(span, "the number of fuses")
                    .help("write a field `F0*` or `F1*` after this one, or the missing fuses as `L` fields"),
                );
            }
            None => {}
        }
        if let Some((said, span)) = self.fuse_sum {
            let counted = checksum(&self.jedec.fuses);
            if said != counted && !self.found.iter().any(Diagnostic::is_error) {
                self.report(
                    Diagnostic::error(
                        codes::CHECKSUM,
                        format!("the checksum of the fuses is {said:04X}, but they add up to {counted:04X}"),
                    )
                    .at(span, "given here")
                    .help("the file was changed after it was written: get it from its source again, or remove this field to skip the check"),
                );
            }
        }
        let n_read = self.jedec.vectors.len();
        if let Some((said, span)) = self.n_vectors
            && said as usize != n_read
        {
            self.report(
                Diagnostic::warning(
                    codes::SYNTAX,
                    format!("the file declares {said} test vectors, but {n_read} were found"),
                )
                .at(span, "announced here")
                .help(format!("write `QV{n_read}`, or get the missing vectors")),
            );
        }
    }
}

/// The first characters of a text, for a message.
fn shown(text: &str) -> String {
    text.chars().take(20).collect()
}

/// The bytes with the other kind of line ends: CR LF instead of LF, or LF instead of CR LF.
fn with_other_ends(text: &str) -> Vec<u8> {
    if text.contains("\r\n") {
        text.replace("\r\n", "\n").into_bytes()
    } else {
        text.replace('\n', "\r\n").into_bytes()
    }
}
