//! Pointers: their comparison, what they point to, and the end of their objects.

use grafsynth_c::tree::{BinaryOp, Expr, Loc};

use super::exec::{Done, Program};
use super::memory::{Address, Memory, Object, Pointer, Scalar};
use super::value::Int;
use crate::symbolic::aig::Lit;

impl<'u> Program<'u> {
    /// Whether two pointers are equal, or for `!=` whether they are not.
    pub(super) fn same_pointer(&mut self, op: BinaryOp, a: &Scalar, b: &Scalar) -> Done<Int> {
        let (Scalar::Pointer(a), Scalar::Pointer(b)) = (a, b) else {
            return Err("the comparison of a pointer with a number is not supported".to_owned());
        };
        let is_equal = match op {
            BinaryOp::Eq => true,
            BinaryOp::Ne => false,
            _ => return Err("arithmetic on pointers is not supported".to_owned()),
        };
        let mut ways = Vec::new();
        for (x, when_x) in a {
            for (y, when_y) in b {
                let is_same = match (x, y) {
                    // The first byte of a structure is also that of its first member.
                    (Pointer::Bytes(..), other) | (other, Pointer::Bytes(..))
                        if *other != Pointer::Null =>
                    {
                        return Err(
                            "the comparison of pointers to bytes is not supported".to_owned()
                        );
                    }
                    (Pointer::To(x, _), Pointer::To(y, _)) => x == y,
                    (x, y) => x == y,
                };
                if is_same {
                    ways.push(self.aig.and(*when_x, *when_y));
                }
            }
        }
        let equal = self.aig.or_all(ways);
        Ok(Int::Bit(equal.negate_if(!is_equal)))
    }

    /// The obligation that a pointer that is read does not point to an object that has ended: its value ends with the object (C99 6.2.4).
    pub(super) fn is_alive(&mut self, value: Option<&Scalar>, memory: &Memory, loc: Loc) {
        let Some(Scalar::Pointer(cases)) = value else { return };
        for (pointer, when) in cases {
            if let Pointer::To(address, _) | Pointer::Bytes(address, _) = pointer
                && let Object::Changing(number) = address.object
                && memory.object(number).is_none()
            {
                self.oblige(*when, "uses a null or dangling pointer", loc);
            }
        }
    }

    /// The targets of a pointer, each with the number of cells that can be reached from there.
    pub(super) fn targets(
        &mut self,
        pointer: &'u Expr,
        memory: &mut Memory,
        loc: Loc,
    ) -> Done<Vec<(Address, usize, Lit)>> {
        let Scalar::Pointer(cases) = self.scalar(pointer, memory)? else {
            return Err("a number used as a pointer is not supported".to_owned());
        };
        let mut all = Vec::new();
        for (pointer, when) in cases {
            match pointer {
                Pointer::To(address, extent) => all.push((address, extent, when)),
                Pointer::Null | Pointer::Function(_) => {
                    self.oblige(when, "uses a null or dangling pointer", loc);
                }
                Pointer::Bytes(..) => {
                    return Err("this use of the bytes of an object is not supported".to_owned());
                }
            }
        }
        if all.is_empty() {
            Err("a pointer is always null or dangling".to_owned())
        } else {
            Ok(all)
        }
    }
}
