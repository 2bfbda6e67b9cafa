//! CUPL: header, pins, equations. `.t` is the input of a T flip-flop; `$`, the exclusive-or, has lower precedence than `#`.

use super::{Signs, SourceText};
use crate::device::{Clock, FlipFlop};
use crate::equations::{Equations, Source, remark};

const SIGNS: Signs = Signs { not: "!", and: " & ", or: "#", yes: "'b'1", no: "'b'0" };

pub(crate) fn write(equations: &Equations) -> SourceText {
    let mut source = SourceText::default();
    source.line(&format!("Name      {} ;", equations.title));
    source.line("PartNo    1 ;");
    source.line("Date      - ;");
    source.line("Revision  1 ;");
    source.line("Designer  grafsynth ;");
    source.line("Company   - ;");
    source.line("Assembly  - ;");
    source.line("Location  - ;");
    source.line(&format!("Device    {} ;", equations.device.cupl));
    source.line("");
    for line in &equations.head {
        source.line(&format!("/* {line} */"));
    }
    source.line("");
    let mut order: Vec<usize> = (0..equations.signals.len()).collect();
    // A shared pin is declared once, by its flip-flop.
    order.retain(|&index| equations.signals[index].shared.is_none());
    order.sort_by_key(|&index| {
        (equations.signals[index].pin.is_none(), equations.signals[index].pin, index)
    });
    for index in order {
        let signal = &equations.signals[index];
        let pin = signal.pin.map_or_else(|| "   ".to_owned(), |pin| format!("{pin:<3}"));
        let name =
            if signal.is_pin_inverted { format!("!{}", signal.name) } else { signal.name.clone() };
        let remark = remark(&signal.meta);
        let remark = if remark.is_empty() { remark } else { format!(" /* {remark} */") };
        let is_node = match signal.source {
            Source::Buried(_) => true,
            // If not every macrocell has a pin, the fitter places signals that need no pin; a signal that an output shows needs one.
            Source::Flop(_) => {
                equations.device.blocks.is_some()
                    && equations.signals.iter().all(|output| output.shared != Some(index))
            }
            Source::Clock | Source::Input(_) | Source::Output(_) => false,
        };
        let is_node = is_node && signal.pin.is_none();
        let statement = if is_node { "PINNODE" } else { "PIN" };
        source.line_of(
            &format!("{statement} {pin} = {name} ;{remark}"),
            &signal.name,
            &signal.meta,
        );
    }
    source.line("");
    for equation in &equations.equations {
        let name = &equations.signals[equation.signal].name;
        let not = if equation.is_complemented { "!" } else { "" };
        let suffix = match (equation.is_registered, equation.flip_flop) {
            (true, FlipFlop::D) => ".d",
            (true, FlipFlop::T) => ".t",
            (false, FlipFlop::D | FlipFlop::T) => "",
        };
        let end = match &equation.inverter {
            Some(product) => format!(" $ {} ;", SIGNS.product(equations, product)),
            None => " ;".to_owned(),
        };
        SIGNS.print(&mut source, equations, equation, &format!("{not}{name}{suffix} ="), &end);
        // On a device with logic blocks the clock is also named, although it is a pin.
        let has_clock = equations.device.clock == Clock::Term || equations.device.blocks.is_some();
        if let (true, true, Some(clock)) = (equation.is_registered, has_clock, equations.clock()) {
            source.line(&format!("{name}.ck = {} ;", clock.name));
        }
    }
    source
}
