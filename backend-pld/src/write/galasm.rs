//! `GALasm`: device, signature, two rows of pins, equations.

use super::{Signs, SourceText};
use crate::device::Clock;
use crate::equations::{Equations, remark};

const SIGNS: Signs = Signs { not: "/", and: " * ", or: "+", yes: "VCC", no: "GND" };

pub(crate) fn write(equations: &Equations) -> SourceText {
    let device = equations.device;
    let mut source = SourceText::default();
    source.line(device.galasm);
    let signature: String =
        equations.title.chars().filter(char::is_ascii_alphanumeric).take(8).collect();
    source.line(&signature);
    source.line("");
    let half = device.n_pins / 2;
    for row in 0..2 {
        let mut line = String::new();
        for pin in row * half + 1..=(row + 1) * half {
            let name =
                equations.signals.iter().find(|signal| signal.pin == Some(pin)).map(|signal| {
                    if signal.is_pin_inverted {
                        format!("/{}", signal.name)
                    } else {
                        signal.name.clone()
                    }
                });
            let name = name.unwrap_or_else(|| {
                let fixed = if device.grounds.contains(&pin) {
                    "GND"
                } else if device.supplies.contains(&pin) {
                    "VCC"
                } else {
                    "NC"
                };
                fixed.to_owned()
            });
            line.push_str(&format!("{name:<9} "));
        }
        source.line(&line);
    }
    source.line("");
    for line in &equations.head {
        source.line(&format!("; {line}"));
    }
    source.line("");
    for equation in &equations.equations {
        let signal = &equations.signals[equation.signal];
        let remark = remark(&signal.meta);
        if !remark.is_empty() {
            source.line_of(&format!("; {remark}"), &signal.name, &signal.meta);
        }
        let name = &signal.name;
        let not = if equation.is_complemented { "/" } else { "" };
        let suffix = if equation.is_registered { ".R" } else { "" };
        SIGNS.print(&mut source, equations, equation, &format!("{not}{name}{suffix} ="), "");
        if let (true, Clock::Term, Some(clock)) =
            (equation.is_registered, device.clock, equations.clock())
        {
            source.line(&format!("{name}.CLK = {}", clock.name));
        }
        source.line("");
    }
    source.line("DESCRIPTION");
    source.line("");
    for line in &equations.head {
        source.line(line);
    }
    source
}
