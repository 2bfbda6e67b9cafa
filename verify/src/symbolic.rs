//! Placeholder of the second encoding.
use crate::equiv::{Binding, Verdict};
use crate::limits::Limits;
use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;

pub(crate) fn equiv(_: &Valid<Net>, _: &Facts, _: &Logic, _: &Binding, _: &Limits) -> Verdict {
    Verdict::Open("not symbolic".to_owned())
}
pub(crate) fn reach(_: &Valid<Net>, _: &Limits, _: &mut Facts) {}
