//! Fuse maps: the data that is programmed into a device.
//!
//! ```text
//! Placement ── map ──► FuseMap ── decode ──► Placement      compared with the intended one (differences)
//!                         │
//!                         └────── sim::Chip ──► levels on pins, clock by clock
//! ```
//! [`map()`], [`decode()`] and [`sim`] read the device's tables ([`crate::device::layout`]) and share no code: a bug in one of them appears as a
//! difference between them.
// A variant that a fuse map forgets is a miscompile.
#![warn(clippy::wildcard_enum_match_arm)]

pub mod codes;
mod decode;
mod logic;
mod map;
mod palasm;
mod place;
pub mod run;
pub mod sim;
pub mod vectors;

#[cfg(test)]
mod tests;

pub use decode::{decode, differences};
pub use logic::{Role, logic, own_roles, shell};
pub use map::map;
pub(crate) use map::no_map;
pub use palasm::palasm;
pub use place::{place, place_from};

use crate::device::Device;
use crate::device::layout::Setting;

/// The fuses of a device: 0 if a connection is made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FuseMap {
    /// The device.
    pub device: &'static Device,
    /// One for each fuse; as many as [`crate::device::Layout::n_fuses`].
    pub fuses: Vec<bool>,
    /// True if the security fuse is set: the device cannot be read out afterwards.
    pub is_secured: bool,
}

impl FuseMap {
    /// The sum of all fuses as bytes, the first fuse the least significant bit of the first byte, modulo 65 536: field `C` of a JEDEC file.
    #[must_use]
    pub fn checksum(&self) -> u16 {
        checksum(&self.fuses)
    }

    /// The value of a fuse; 1 if the device does not have it.
    #[must_use]
    pub fn get(&self, fuse: u32) -> bool {
        self.fuses.get(fuse as usize).copied().unwrap_or(true)
    }

    /// The value of a macrocell's setting.
    #[must_use]
    pub fn setting(&self, setting: Setting) -> bool {
        match setting {
            Setting::Fuse(fuse) => self.get(fuse),
            Setting::Fixed(value) => value,
        }
    }

    /// The eight bytes of the user signature, if the device has one.
    #[must_use]
    pub fn signature(&self) -> Option<[u8; 8]> {
        let first = self.device.layout?.signature?;
        let mut bytes = [0; 8];
        for (index, byte) in (0..).zip(bytes.iter_mut()) {
            for bit in 0..8 {
                *byte = *byte << 1 | u8::from(self.get(first + index * 8 + bit));
            }
        }
        Some(bytes)
    }
}

/// The checksum of a fuse list, see [`FuseMap::checksum`].
#[must_use]
pub fn checksum(fuses: &[bool]) -> u16 {
    fuses.chunks(8).fold(0u16, |sum, byte| {
        let bits = byte.iter().rev().fold(0u16, |value, fuse| value << 1 | u16::from(*fuse));
        // The first fuse is the least significant bit, so an incomplete last byte is padded with zeros.
        sum.wrapping_add(bits)
    })
}
