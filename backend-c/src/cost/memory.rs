//! Sizes of types in bytes, as the compilers of a machine lay them out.

use super::machine::Machine;
use super::tree::{Type, Unit};

/// Bytes and alignment of a type.
pub(super) fn layout(unit: &Unit, machine: &Machine, ty: &Type) -> (u64, u64) {
    let most = u64::from(machine.alignment);
    match ty {
        Type::Void => (0, 1),
        Type::Number { bits, .. } => {
            let bytes = u64::from(bits / 8);
            (bytes, bytes.min(most))
        }
        Type::Pointer(..) => (u64::from(machine.pointer), u64::from(machine.pointer).min(most)),
        Type::Array(element, n) => {
            let (size, align) = layout(unit, machine, element);
            (size * n, align)
        }
        Type::Struct(index) => {
            let members = unit.structs.get(*index).map(Vec::as_slice).unwrap_or_default();
            // Bit-fields of one-byte types: a new byte begins if the next field does not fit in the current one.
            let (mut bytes, mut align, mut open) = (0_u64, 1_u64, 0_u64);
            for member in members {
                if member.is_bit {
                    if open == 0 {
                        bytes += 1;
                        open = 8;
                    }
                    open -= 1;
                    continue;
                }
                open = 0;
                let (size, own) = layout(unit, machine, &member.ty);
                bytes = bytes.next_multiple_of(own) + size;
                align = align.max(own);
            }
            (bytes.next_multiple_of(align), align)
        }
    }
}

/// Bytes of a type.
pub(super) fn size(unit: &Unit, machine: &Machine, ty: &Type) -> u64 {
    layout(unit, machine, ty).0
}
