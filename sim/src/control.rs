//! E1: controlled actions, the ACTION_CONTROL block of IEC 61131-3 (semantics §3.5).

use grafsynth_ir::net::{ActionId, Qualifier};

use crate::layout::Cell;
use crate::reaction::Reaction;

/// The inputs of one action: for each qualifier, the OR over its uses.
#[derive(Debug, Clone, Copy, Default)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "they are the eleven inputs of the standard's block"
)]
struct Asked {
    n: bool,
    r: bool,
    s: bool,
    l: bool,
    d: bool,
    p: bool,
    p0: bool,
    p1: bool,
    sd: bool,
    ds: bool,
    sl: bool,
}

impl Reaction<'_> {
    /// Advances, at Latch, each timer whose input was true at the end of the last reaction.
    pub(crate) fn advance_qualifier_timers(&mut self, dt: i64) {
        for (action, data) in self.net.actions.iter() {
            if self.action_has_ended(action) {
                continue;
            }
            for timed in Qualifier::ALL.into_iter().filter(|it| it.is_timed()) {
                let Some(place) = self.tables.layout.find(Cell::ActionTimer(action, timed)) else {
                    continue;
                };
                if self.state.cells[place + 1] != 0 {
                    self.state.cells[place] =
                        (self.state.cells[place] + dt).min(i64::from(data.duration));
                }
            }
        }
    }

    /// E1, the three passes [C13].
    pub(crate) fn e1_controlled_actions(&mut self) {
        let net = self.net;
        let mut falling: Vec<ActionId> = Vec::new();
        let mut on: Vec<ActionId> = Vec::new();
        // In declaration order: a condition that reads Q of an earlier action sees the new value.
        for action in net.actions.ids() {
            if self.action_has_ended(action) {
                continue;
            }
            let asked = self.asked(action);
            let q = self.step_action(action, asked);
            let place = self.tables.layout.at(Cell::ActionQ(action));
            let was = std::mem::replace(&mut self.state.cells[place], i64::from(q)) != 0;
            if q {
                on.push(action);
            } else if was {
                falling.push(action);
            }
        }
        if net.settings.final_scan {
            falling.into_iter().for_each(|action| self.run(&net.actions[action].body));
        }
        on.into_iter().for_each(|action| self.run(&net.actions[action].body));
    }

    fn asked(&mut self, action: ActionId) -> Asked {
        let mut asked = Asked::default();
        for one in &self.net.actions[action].uses {
            if !self.state.situation.contains(one.step) {
                continue;
            }
            if let Some(condition) = &one.condition {
                self.mention(condition);
                if self.eval(condition) == 0 {
                    continue;
                }
            }
            match one.qualifier {
                Qualifier::N => asked.n = true,
                Qualifier::R => asked.r = true,
                Qualifier::S => asked.s = true,
                Qualifier::L => asked.l = true,
                Qualifier::D => asked.d = true,
                Qualifier::P => asked.p = true,
                Qualifier::P0 => asked.p0 = true,
                Qualifier::P1 => asked.p1 = true,
                Qualifier::SD => asked.sd = true,
                Qualifier::DS => asked.ds = true,
                Qualifier::SL => asked.sl = true,
            }
        }
        asked
    }

    /// Executes the block, line by line as in semantics §3.5; returns Q.
    fn step_action(&mut self, action: ActionId, asked: Asked) -> bool {
        let Asked { n, r, s, l, d, p, p0, p1, sd, ds, sl } = asked;
        let s_ff = self.latch(action, Qualifier::S, s, r);
        let sd_ff = self.latch(action, Qualifier::SD, sd, r);
        let sl_ff = self.latch(action, Qualifier::SL, sl, r);
        let l_ton = self.ton(action, Qualifier::L, l);
        let d_ton = self.ton(action, Qualifier::D, d);
        let ds_ton = self.ton(action, Qualifier::DS, ds);
        let sd_ton = self.ton(action, Qualifier::SD, sd_ff);
        let sl_ton = self.ton(action, Qualifier::SL, sl_ff);
        let ds_ff = self.latch(action, Qualifier::DS, ds_ton, r);
        let p_up = !self.pulse_memory(action, Qualifier::P, p) && p;
        let p1_up = !self.pulse_memory(action, Qualifier::P1, p1) && p1;
        let p0_dn = self.pulse_memory(action, Qualifier::P0, p0) && !p0;
        !r && (n
            || s_ff
            || (l && !l_ton)
            || d_ton
            || p_up
            || p1_up
            || p0_dn
            || sd_ton
            || ds_ff
            || (sl_ff && !sl_ton))
    }

    /// `FF := not R and (FF or set)`. An action without uses of this qualifier has no latch.
    fn latch(&mut self, action: ActionId, which: Qualifier, set: bool, reset: bool) -> bool {
        let Some(place) = self.tables.layout.find(Cell::Latch(action, which)) else { return false };
        let value = !reset && (self.state.cells[place] != 0 || set);
        self.state.cells[place] = i64::from(value);
        value
    }

    /// `ton(in): if not in then T := 0; held := in; result in and T >= d`.
    fn ton(&mut self, action: ActionId, which: Qualifier, input: bool) -> bool {
        let Some(place) = self.tables.layout.find(Cell::ActionTimer(action, which)) else {
            return false;
        };
        if !input {
            self.state.cells[place] = 0;
        }
        self.state.cells[place + 1] = i64::from(input);
        input && self.state.cells[place] >= i64::from(self.net.actions[action].duration)
    }

    /// Stores the input of a pulse qualifier and returns that of the last row.
    fn pulse_memory(&mut self, action: ActionId, which: Qualifier, input: bool) -> bool {
        let Some(place) = self.tables.layout.find(Cell::Old(action, which)) else { return false };
        std::mem::replace(&mut self.state.cells[place], i64::from(input)) != 0
    }

    /// True if all charts that use the action have ended; the action then stops (semantics §5).
    fn action_has_ended(&self, action: ActionId) -> bool {
        if self.tables.may_end.is_empty() {
            return false;
        }
        let uses = &self.net.actions[action].uses;
        !uses.is_empty()
            && uses.iter().all(|one| self.part_has_ended(self.net.steps[one.step].part))
    }
}
