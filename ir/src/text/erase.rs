//! A net without source locations, to compare nets that come from different sources.

use crate::expr::Expr;
use crate::net::*;
use crate::span::{Name, Span};
use crate::walk::change_statements;

impl Net {
    /// The same net with every span set to the default. Two nets that differ only in source locations become equal.
    #[must_use]
    pub fn without_spans(&self) -> Net {
        let mut net = self.clone();
        name(&mut net.name);
        for (_, item) in net.parts.iter_mut() {
            named(&mut item.name, &mut item.meta);
        }
        for (_, item) in net.inputs.iter_mut() {
            named(&mut item.name, &mut item.meta);
        }
        for (_, item) in net.outputs.iter_mut() {
            named(&mut item.name, &mut item.meta);
            driver(&mut item.driver);
        }
        for (_, item) in net.vars.iter_mut() {
            named(&mut item.name, &mut item.meta);
        }
        for (_, item) in net.timers.iter_mut() {
            named(&mut item.name, &mut item.meta);
            item.condition.erase_spans();
        }
        for (_, item) in net.edges.iter_mut() {
            item.expr.erase_spans();
        }
        for (_, item) in net.steps.iter_mut() {
            named(&mut item.name, &mut item.meta);
            item.tasks.iter_mut().for_each(|task| named(&mut task.name, &mut task.meta));
        }
        for (_, item) in net.transitions.iter_mut() {
            named(&mut item.name, &mut item.meta);
            item.guard.erase_spans();
        }
        for (_, item) in net.actions.iter_mut() {
            named(&mut item.name, &mut item.meta);
            for of in &mut item.uses {
                of.span = Span::default();
                of.condition.iter_mut().for_each(Expr::erase_spans);
            }
        }
        for (_, item) in net.sends.iter_mut() {
            named(&mut item.name, &mut item.meta);
        }
        for (_, item) in net.histories.iter_mut() {
            named(&mut item.name, &mut item.meta);
        }
        for list in net.lists_mut() {
            change_statements(list, &mut |stmt| {
                stmt.span = Span::default();
                stmt.exprs_mut().for_each(Expr::erase_spans);
            });
        }
        for item in &mut net.forcings {
            item.span = Span::default();
        }
        if let Some(item) = &mut net.emergency {
            item.meta.span = Span::default();
            item.condition.erase_spans();
        }
        if let Some(item) = &mut net.ending {
            item.waits.erase_spans();
        }
        for item in &mut net.properties {
            item.meta.span = Span::default();
            item.never.erase_spans();
        }
        for item in &mut net.unspecified {
            item.when.erase_spans();
        }
        for item in &mut net.macros {
            named(&mut item.name, &mut item.meta);
        }
        for item in &mut net.placements {
            name(&mut item.part);
            item.span = Span::default();
        }
        net.board.device.iter_mut().for_each(name);
        net.board.pins.iter_mut().for_each(|(pin, _)| name(pin));
        net
    }
}

fn name(name: &mut Name) {
    name.span = Span::default();
}

fn named(of: &mut Name, meta: &mut Meta) {
    name(of);
    meta.span = Span::default();
}

fn driver(driver: &mut Driver) {
    match driver {
        Driver::Continuous(emissions) | Driver::Mealy(emissions) => {
            for emission in emissions {
                emission.span = Span::default();
                emission.condition.iter_mut().for_each(Expr::erase_spans);
            }
        }
        Driver::Extern { calls, .. } => {
            for call in calls {
                call.span = Span::default();
                call.condition.iter_mut().for_each(Expr::erase_spans);
                call.arguments.iter_mut().for_each(Expr::erase_spans);
            }
        }
        Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_) => {}
    }
}
