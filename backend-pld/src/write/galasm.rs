//! `GALasm`: device, signature, two rows of pins, equations.

use super::{Sheet, Signs};
use crate::device::Clock;
use crate::equations::{Equations, remark};

const SIGNS: Signs = Signs { not: "/", and: " * ", or: "+", yes: "VCC", no: "GND" };

pub(crate) fn write(equations: &Equations) -> Sheet {
    let device = equations.device;
    let mut sheet = Sheet::default();
    sheet.line(device.galasm);
    let signature: String =
        equations.title.chars().filter(char::is_ascii_alphanumeric).take(8).collect();
    sheet.line(&signature);
    sheet.line("");
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
        sheet.line(&line);
    }
    sheet.line("");
    for line in &equations.head {
        sheet.line(&format!("; {line}"));
    }
    sheet.line("");
    for equation in &equations.equations {
        let signal = &equations.signals[equation.signal];
        let remark = remark(&signal.meta);
        if !remark.is_empty() {
            sheet.line_of(&format!("; {remark}"), &signal.name, &signal.meta);
        }
        let name = &signal.name;
        let not = if equation.is_complemented { "/" } else { "" };
        let suffix = if equation.is_registered { ".R" } else { "" };
        SIGNS.print(&mut sheet, equations, equation, &format!("{not}{name}{suffix} ="), "");
        if let (true, Clock::Term, Some(clock)) =
            (equation.is_registered, device.clock, equations.clock())
        {
            sheet.line(&format!("{name}.CLK = {}", clock.name));
        }
        sheet.line("");
    }
    sheet.line("DESCRIPTION");
    sheet.line("");
    for line in &equations.head {
        sheet.line(line);
    }
    sheet
}
