//! JEDEC files, the language of device programmers (standard JESD3-C).
//!
//! ```text
//! FuseMap ── write ──► .jed ── read ──► Jedec ── fuse_map ──► FuseMap
//! ```
//! The reader follows the standard and is independent of the writer: it accepts all fields, checks both checksums, and reports all errors at once,
//! each with its location.

mod read;
#[cfg(test)]
mod tests;
mod write;

pub use read::read;
pub use write::{Head, write};

use crate::device::{DEVICES, Device};
use crate::fuse::vectors::Vector;
use crate::fuse::{FuseMap, codes};
use crate::placement::PinName;
use grafsynth_ir::diag::Diagnostic;
use grafsynth_ir::span::Span;

/// The contents of a JEDEC file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Jedec {
    /// The text before the first field: free text, in which some tools write the device's name.
    pub head: String,
    /// The texts of the notes, field `N`.
    pub notes: Vec<String>,
    /// The number of pins, field `QP`.
    pub n_pins: Option<u32>,
    /// The fuses, as many as field `QF` declares; those in no field `L` have the value of field `F`.
    pub fuses: Vec<bool>,
    /// True if the security fuse is set, field `G`.
    pub is_secured: bool,
    /// The test vectors, field `V`, in their order.
    pub vectors: Vec<Vector>,
    /// The location of each test vector.
    pub vector_spans: Vec<Span>,
    /// The location of the number of fuses.
    pub span: Span,
}

impl Jedec {
    /// The names of the pins, if a note `PINS name:number ...` lists them; `/name` and `!name` are complements of their pins.
    #[must_use]
    pub fn pins(&self) -> Vec<PinName> {
        let mut pins = Vec::new();
        for note in &self.notes {
            let Some(rest) = note.trim_start().strip_prefix("PINS ").or_else(|| {
                // Some tools write the word NOTE in full; the N is its first letter.
                note.trim_start().strip_prefix("OTE PINS ")
            }) else {
                continue;
            };
            for word in rest.split_whitespace() {
                let Some((name, number)) = word.rsplit_once(':') else { continue };
                let bare = name.strip_prefix(['/', '!']).unwrap_or(name);
                if let Ok(pin) = number.parse()
                    && !bare.is_empty()
                {
                    let is_inverted = bare.len() < name.len();
                    pins.push(PinName { pin, name: bare.to_owned(), is_inverted });
                }
            }
        }
        pins
    }

    /// Among several devices with the same number of fuses, the one that the head or the notes name.
    fn named(
        &self,
        possible: &[&'static Device],
        n_fuses: u32,
    ) -> Result<&'static Device, Box<Diagnostic>> {
        // Manufacturers add letters to the type: `AmPAL16R4A`, `TIBPAL16L8-15`, `p16r8`.
        let names = |device: &Device, word: &str| {
            let word = word.to_ascii_lowercase();
            let kind = device.name.trim_start_matches("pal");
            word.rfind(kind).is_some_and(|at| {
                let after = word.as_bytes().get(at + kind.len());
                let before = at.checked_sub(1).and_then(|at| word.as_bytes().get(at));
                before.is_some_and(u8::is_ascii_alphabetic)
                    && !after.is_some_and(u8::is_ascii_digit)
            })
        };
        let is_named = |device: &&'static Device| {
            let texts = std::iter::once(&self.head).chain(&self.notes);
            let mut words = texts.flat_map(|text| text.split(|c: char| !c.is_ascii_alphanumeric()));
            words.any(|word| names(device, word))
        };
        let named: Vec<&'static Device> = possible.iter().copied().filter(is_named).collect();
        if let [only] = named[..] {
            return Ok(only);
        }
        let names: Vec<&str> = possible.iter().map(|device| device.palasm).collect();
        let which = if named.is_empty() { "none" } else { "several" };
        let message =
            format!("{n_fuses} fuses fit {}, and the file names {which} of them", names.join(", "));
        Err(Box::new(
            Diagnostic::error(codes::SEVERAL_DEVICES, message)
                .at(self.span, "the number of fuses")
                .help(format!(
                    "write the name of the device in the header, before the first `*`, as in `Device: {}`",
                    names[0]
                )),
        ))
    }

    /// The fuse map of the device that the file is for. This is `device` if it is given, otherwise the device with this number of fuses; of several, the one
    /// that the file names in its head or in a note.
    ///
    /// # Errors
    /// If the device has no known fuse map or another number of fuses, or if the number fits several devices and the file names none of them.
    pub fn fuse_map(&self, device: Option<&'static Device>) -> Result<FuseMap, Box<Diagnostic>> {
        let n_fuses = u32::try_from(self.fuses.len()).unwrap_or(u32::MAX);
        // A file may omit the signature; the fuses before it are the same.
        let fits = |device: &Device| {
            device.layout.is_some_and(|layout| {
                layout.n_fuses == n_fuses
                    || layout.signature == Some(n_fuses) && n_fuses + 64 == layout.n_fuses
            })
        };
        let device = match device {
            Some(device) if device.layout.is_none() => {
                return Err(Box::new(crate::fuse::no_map(device)));
            }
            Some(device) if fits(device) => Some(device),
            Some(device) => {
                let has = device.layout.map_or(0, |layout| layout.n_fuses);
                let finding = Diagnostic::error(
                    codes::UNKNOWN_SIZE,
                    format!("the file has {n_fuses} fuses, and a {} has {has}", device.name),
                );
                let help =
                    "leave out the device to use that of the file, or get a file for the device";
                return Err(Box::new(finding.at(self.span, "the number of fuses").help(help)));
            }
            None => {
                // Entries for a GAL that replaces a PAL are left out, because their fuses are those of the GAL.
                let is_itself =
                    |device: &Device| device.burned_as.eq_ignore_ascii_case(device.name);
                let possible: Vec<&'static Device> = DEVICES
                    .iter()
                    .filter(|device| fits(device) && is_itself(device))
                    .filter(|device| self.n_pins.is_none_or(|n_pins| n_pins == device.n_pins))
                    .collect();
                match possible[..] {
                    [] => None,
                    [only] => Some(only),
                    _ => Some(self.named(&possible, n_fuses)?),
                }
            }
        };
        let Some(device) = device else {
            let known: Vec<String> = DEVICES
                .iter()
                .filter(|device| device.burned_as.eq_ignore_ascii_case(device.name))
                .filter_map(|device| Some(format!("{} ({})", device.layout?.n_fuses, device.name)))
                .collect();
            let finding = Diagnostic::error(
                codes::UNKNOWN_SIZE,
                format!("no known device has {n_fuses} fuses"),
            );
            let finding = finding.at(self.span, "the number of fuses");
            return Err(Box::new(finding.help(format!("known fuse counts: {}", known.join(", ")))));
        };
        let mut fuses = self.fuses.clone();
        if let Some(layout) = device.layout {
            fuses.resize(layout.n_fuses as usize, false);
        }
        Ok(FuseMap { device, fuses, is_secured: self.is_secured })
    }
}

/// The sum of all bytes of a transmission, from the start character to the end character, modulo 65 536.
#[must_use]
pub fn transmission_checksum(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0u16, |sum, byte| sum.wrapping_add(u16::from(*byte)))
}

/// The first character of a transmission.
pub(crate) const STX: u8 = 2;
/// The last character of a transmission, before its checksum.
pub(crate) const ETX: u8 = 3;
