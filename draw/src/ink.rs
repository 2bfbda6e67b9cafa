//! How the pens of a drawing look on white paper, for files without a style sheet: PDF and PNG.

use crate::picture::{Font, Pen};

/// A colour: red, green and blue.
pub(crate) type Colour = [u8; 3];

/// Letters, arrowheads and dots.
pub(crate) const BLACK: Colour = [0x11; 3];

/// A line or a border.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Stroke {
    /// The thickness in half pixels.
    pub(crate) halves: i64,
    pub(crate) colour: Colour,
}

/// The lengths of the dashes and of the gaps of a dashed line, in pixels.
pub(crate) const DASH: (i64, i64) = (6, 4);
/// Half the length of the gap in a line that another one crosses, in pixels.
pub(crate) const CROSSING: i64 = 4;
/// The radius of the corners of states, in pixels.
pub(crate) const ROUND: i64 = 8;

/// The colour of an area; `None` for a border.
pub(crate) fn area(pen: Pen) -> Option<Colour> {
    let hex = match pen {
        Pen::Shade => 0x00cf_e0f4,
        Pen::Never => 0x00f7_d0c8,
        Pen::Part(part) => {
            *[0x00fd_e3b4, 0x00c9_e7c3, 0x00d9_d2f0, 0x00c5_e6ea, 0x00f6_cfdc, 0x00e3_ddd3]
                .get(usize::from(part % Pen::PARTS))?
        }
        _ => return None,
    };
    let [_, red, green, blue] = u32::to_be_bytes(hex);
    Some([red, green, blue])
}

/// The look of a line or border.
pub(crate) fn stroke(pen: Pen) -> Stroke {
    let (halves, gray) = match pen {
        Pen::Bar => (8, 0x11),
        Pen::Detail | Pen::Dashed => (2, 0x11),
        Pen::Frame => (2, 0x88),
        Pen::Grid => (2, 0xdd),
        _ => (3, 0x11),
    };
    Stroke { halves, colour: [gray; 3] }
}

/// The colour of letters.
pub(crate) fn letters(font: Font) -> Colour {
    if font == Font::Small { [0x55; 3] } else { BLACK }
}
