//! Declarations of the text form.

use super::lexer::Kind;
use super::parse::{Fail, HEADS, Parser};
use crate::codes;
use crate::diag::{Diagnostic, nearest};
use crate::expr::{Expr as GenericExpr, Type};
use crate::net::*;
use itertools::Itertools as _;

impl Parser<'_> {
    /// Reads the whole text.
    pub(super) fn net(&mut self) {
        let mut has_name = false;
        loop {
            match self.token().kind {
                Kind::Newline => {
                    self.bump();
                }
                Kind::End => break,
                _ => {
                    has_name |= self.is("net");
                    if self.declaration().is_err() {
                        self.skip();
                    }
                }
            }
        }
        if !has_name {
            let message = "the text has no line `net NAME`";
            self.told(Diagnostic::error(codes::NET_SYNTAX, message).at(self.here(), ""));
        }
    }

    /// Skips to the next line that begins a declaration, so that one error is reported only once.
    fn skip(&mut self) {
        while self.token().kind != Kind::End {
            if self.token().kind != Kind::Newline {
                self.bump();
                continue;
            }
            self.bump();
            if self.at_head() {
                return;
            }
        }
    }

    /// Reads a declaration with its continuation lines.
    fn declaration(&mut self) -> Result<(), Fail> {
        if !self.at_head() {
            return self.no_line(&[]);
        }
        let head = self.text();
        self.bump();
        match head {
            "net" => {
                let name = self.name()?;
                self.net_mut().name = name;
            }
            "policy" | "evolution" | "schedule" | "fire" | "assign" | "final" | "events"
            | "queue" | "tick" => {
                self.setting(head)?;
            }
            "part" => return self.part(),
            "input" => self.input()?,
            "output" => return self.output(),
            "var" => self.var()?,
            "timer" => self.timer()?,
            "edge" => {
                if self.token().kind != Kind::Edge {
                    return self.unexpected("a number such as `%0`");
                }
                self.bump();
                self.expect("=")?;
                let expr = self.expr()?;
                self.net_mut().edges.push(EdgeOperand { expr });
            }
            "step" => return self.step(),
            "transition" => return self.transition(),
            "action" => return self.action(),
            "slot" => {
                let (name, meta) = self.head()?;
                self.expect("sends")?;
                let event = self.input_ref()?;
                self.expect("after")?;
                let delay = self.number()?;
                self.net_mut().sends.push(SendSlot { name, event, delay, meta });
            }
            "history" => return self.history(),
            "force" => self.forcing()?,
            "assume" => self.property(PropertyRole::Assume)?,
            "assert" => self.property(PropertyRole::Assert)?,
            "emergency" => self.emergency()?,
            "ending" => self.ending()?,
            "open" => self.open_cell()?,
            "macro" => {
                let (name, meta) = self.head()?;
                self.expect("entry")?;
                let entry = self.step_ref()?;
                self.expect("exit")?;
                let exit = self.step_ref()?;
                self.expect("steps")?;
                let steps = self.list(Self::step_ref)?;
                self.net_mut().macros.push(MacroStep { name, steps, entry, exit, meta });
            }
            "place" => self.placement()?,
            "device" => {
                let name = self.name()?;
                self.net_mut().board.device = Some(name);
            }
            "pin" => {
                let name = self.name()?;
                let number = self.number()?;
                self.net_mut().board.pins.push((name, number));
            }
            _ => unreachable!("every head word is listed here"),
        }
        self.end_of_line()
    }

    /// Reports a line that begins with neither a declaration nor one of `words`.
    fn no_line<T>(&mut self, words: &[&str]) -> Result<T, Fail> {
        let text = self.text();
        let known = HEADS.iter().chain(words).copied();
        let near = if text.len() < 40 { nearest(text, known) } else { None };
        let text: String = text.chars().take(40).collect();
        let message = format!("unknown declaration `{text}`");
        let diagnostic = Diagnostic::error(codes::NET_SYNTAX, message).at(self.here(), "");
        self.told(match (near, words) {
            (Some(near), _) => {
                diagnostic.help(format!("did you mean `{near}`?")).fix(self.here(), near)
            }
            (None, []) => diagnostic,
            (None, _) => {
                let words = words.iter().map(|word| format!("`{word}`")).join(", ");
                diagnostic.help(format!("expected {words}"))
            }
        });
        Err(Fail)
    }

    fn end_of_line(&mut self) -> Result<(), Fail> {
        match self.token().kind {
            Kind::Newline => {
                self.bump();
                Ok(())
            }
            Kind::End => Ok(()),
            _ => self.unexpected("the end of the line"),
        }
    }

    /// The word that begins the next line, if it is one of `words`; empty lines are skipped.
    fn below<'w>(&mut self, words: &[&'w str]) -> Result<Option<&'w str>, Fail> {
        while self.token().kind == Kind::Newline {
            self.bump();
        }
        let found = words.iter().copied().find(|word| self.is(word));
        if found.is_none() && self.token().kind == Kind::Word && !self.at_head() {
            return self.no_line(words);
        }
        Ok(found)
    }

    fn setting(&mut self, head: &str) -> Result<(), Fail> {
        let mut settings = self.net_mut().settings.clone();
        match head {
            "policy" => {
                settings.policy = match self.hyphenated()?.as_str() {
                    "all" => Policy::All,
                    "priority" => Policy::Priority,
                    "priority-age" => Policy::PriorityAge,
                    "inner-first" => Policy::InnerFirst,
                    "outer-first" => Policy::OuterFirst,
                    other => {
                        let message = format!("unknown conflict policy `{other}`");
                        return self.fail(codes::NET_SYNTAX, self.before(), message);
                    }
                };
            }
            "evolution" => {
                if self.eat("single") {
                    settings.evolution = Evolution::Single;
                } else {
                    self.expect("stable")?;
                    self.expect("limit")?;
                    settings.evolution = Evolution::Stable { limit: self.number()? };
                }
            }
            "schedule" => {
                settings.schedule = if self.eat("declared") {
                    Schedule::Declared
                } else if self.eat("level") {
                    Schedule::Level
                } else {
                    self.expect("priority")?;
                    Schedule::Priority
                };
            }
            "fire" => {
                self.expect("one")?;
                settings.fire_one = true;
            }
            "assign" => {
                self.expect("simultaneous")?;
                settings.assign_simultaneous = true;
            }
            "final" => {
                self.expect("scan")?;
                settings.final_scan = true;
            }
            "events" => {
                self.expect("exclusive")?;
                settings.events_exclusive = true;
            }
            "queue" => settings.queue = Some(self.number()?),
            _ => {
                settings.tick_ns = self.nanoseconds()?;
            }
        }
        self.net_mut().settings = settings;
        Ok(())
    }

    /// A word, or two words with a hyphen between them.
    fn hyphenated(&mut self) -> Result<String, Fail> {
        if self.token().kind != Kind::Word {
            return self.unexpected("a word");
        }
        let mut word = self.text().to_owned();
        self.bump();
        if self.eat("-") {
            word.push('-');
            word.push_str(self.text());
            self.bump();
        }
        Ok(word)
    }

    fn part(&mut self) -> Result<(), Fail> {
        let (name, meta) = self.head()?;
        self.expect("level")?;
        let level = self.number()?;
        let priority = if self.eat("priority") { Some(self.number()?) } else { None };
        let is_cut = self.eat("cut");
        self.end_of_line()?;
        let mut initial = Vec::new();
        while self.below(&["enter"])?.is_some() {
            self.bump();
            initial.extend(self.list(Self::enter)?);
            self.end_of_line()?;
        }
        self.net_mut().parts.push(Part { name, level, priority, initial, is_cut, meta });
        Ok(())
    }

    fn enter(&mut self) -> Result<Enter, Fail> {
        if self.eat("content") {
            Ok(Enter::InitialContent(self.step_ref()?))
        } else if self.eat("history") {
            Ok(Enter::History(self.history_ref()?))
        } else {
            Ok(Enter::Step(self.step_ref()?))
        }
    }

    fn ty(&mut self) -> Result<Type, Fail> {
        if self.eat("bool") {
            return Ok(Type::Bool);
        }
        if !self.eat("int") {
            return self.unexpected("`bool` or `int`");
        }
        let lo = self.integer()?;
        self.expect("..")?;
        let hi = self.integer()?;
        Ok(Type::Int { lo, hi })
    }

    fn input(&mut self) -> Result<(), Fail> {
        let (name, meta) = self.head()?;
        let ty = self.ty()?;
        let kind = if self.eat("extern") {
            InputKind::Extern
        } else if self.eat("event") {
            InputKind::Event
        } else if self.eat("internal") {
            InputKind::InternalEvent
        } else {
            InputKind::Pin
        };
        let synchronous = self.eat("synchronous");
        self.net_mut().inputs.push(Input { name, ty, kind, synchronous, meta });
        Ok(())
    }

    fn output(&mut self) -> Result<(), Fail> {
        let (name, meta) = self.head()?;
        let ty = self.ty()?;
        let registered = self.eat("registered");
        let safe = if self.eat("safe") { Some(self.integer()?) } else { None };
        let driver = if self.is("continuous") || self.is("mealy") {
            let is_mealy = self.eat("mealy");
            let _ = self.eat("continuous");
            self.end_of_line()?;
            let mut emissions = Vec::new();
            while self.below(&["emit"])?.is_some() {
                self.bump();
                let span = self.here();
                let step = self.step_ref()?;
                emissions.push(Emission { step, condition: self.if_condition()?, span });
                self.end_of_line()?;
            }
            if is_mealy { Driver::Mealy(emissions) } else { Driver::Continuous(emissions) }
        } else if self.eat("fires") {
            let mut transitions = vec![self.transition_ref()?];
            while !matches!(self.token().kind, Kind::Newline | Kind::End) {
                transitions.push(self.transition_ref()?);
            }
            Driver::Fires(transitions)
        } else if self.eat("stored") {
            Driver::Stored(self.var_ref()?)
        } else if self.eat("controlled") {
            Driver::Controlled(self.action_ref()?)
        } else {
            self.expect("extern")?;
            self.end_of_line()?;
            self.extern_driver()?
        };
        if matches!(driver, Driver::Fires(_) | Driver::Stored(_) | Driver::Controlled(_)) {
            self.end_of_line()?;
        }
        self.net_mut().outputs.push(Output { name, ty, driver, safe, registered, meta });
        Ok(())
    }

    fn extern_driver(&mut self) -> Result<Driver, Fail> {
        let (mut params, mut calls) = (Vec::new(), Vec::new());
        while let Some(word) = self.below(&["param", "call"])? {
            self.bump();
            let span = self.here();
            if word == "param" {
                let ty = self.ty()?;
                let is_named = matches!(self.token().kind, Kind::Word | Kind::Quoted);
                let name = if is_named { self.name()?.text } else { String::new() };
                params.push(Param { name, ty });
            } else {
                let step = self.step_ref()?;
                let arguments = self.arguments()?;
                calls.push(ExternCall { step, arguments, condition: self.if_condition()?, span });
            }
            self.end_of_line()?;
        }
        Ok(Driver::Extern { params, calls })
    }

    fn if_condition(&mut self) -> Result<Option<Expr>, Fail> {
        if self.eat("if") { self.expr().map(Some) } else { Ok(None) }
    }

    fn var(&mut self) -> Result<(), Fail> {
        let (name, meta) = self.head()?;
        let ty = self.ty()?;
        let len = if self.eat("[") {
            let len = self.number()?;
            self.expect("]")?;
            Some(len)
        } else {
            None
        };
        let origin = if self.eat("stored") {
            VarOrigin::StoredOutput
        } else if self.eat("hidden") {
            VarOrigin::Hidden
        } else {
            VarOrigin::Declared
        };
        let sharing =
            SHARINGS.into_iter().find(|(word, _)| self.eat(word)).map(|(_, sharing)| sharing);
        let mut init = Vec::new();
        if self.eat("=") {
            init.push(self.integer()?);
            while self.eat(",") {
                init.push(self.integer()?);
            }
        }
        let id = self.net_mut().vars.push(Var { name, ty, len, init, origin, meta });
        if let Some(sharing) = sharing {
            self.net_mut().sharing.insert(id, sharing);
        }
        Ok(())
    }

    fn timer(&mut self) -> Result<(), Fail> {
        let (name, meta) = self.head()?;
        let starts_expired = self.eat("expired");
        self.expect("while")?;
        let condition = self.expr()?;
        self.net_mut().timers.push(Timer { name, condition, starts_expired, meta });
        Ok(())
    }

    fn step(&mut self) -> Result<(), Fail> {
        let (name, meta) = self.head()?;
        self.expect("in")?;
        let part = self.part_ref()?;
        let is_initial = self.eat("initial");
        let kind = if self.eat("enclosing") {
            StepKind::Enclosing
        } else if self.eat("composite") {
            StepKind::Composite
        } else if self.eat("parallel") {
            StepKind::Parallel
        } else if self.eat("final") {
            StepKind::Final
        } else {
            StepKind::Leaf
        };
        let parent = if self.eat("parent") { Some(self.step_ref()?) } else { None };
        let activation_link = self.eat("link");
        let hidden = self.eat("hidden");
        let priority = if self.eat("priority") { Some(self.number()?) } else { None };
        let budget = if self.eat("budget") { self.number()? } else { 0 };
        let locks = if self.eat("locks") { self.list(Self::var_ref)? } else { Vec::new() };
        let done_event = if self.eat("done") { Some(self.input_ref()?) } else { None };
        self.end_of_line()?;
        let mut step = Step {
            name,
            part,
            is_initial,
            kind,
            parent,
            activation_link,
            hidden,
            priority,
            entry: Block::new(),
            exit: Block::new(),
            initial_content: Block::new(),
            code: Vec::new(),
            tasks: Vec::new(),
            locks,
            budget,
            done_event,
            meta,
        };
        while let Some(word) = self.below(&["entry", "exit", "content", "code", "task"])? {
            if word == "code" {
                step.code.push(self.verbatim()?);
                self.end_of_line()?;
                continue;
            }
            self.bump();
            match word {
                "entry" => step.entry.extend(self.block()?),
                "exit" => step.exit.extend(self.block()?),
                "content" => step.initial_content.extend(self.block()?),
                _ => {
                    let (name, meta) = self.head()?;
                    self.expect("cost")?;
                    let cost = self.number()?;
                    step.tasks.push(Task { name, cost, body: self.block()?, meta });
                }
            }
            self.end_of_line()?;
        }
        self.net_mut().steps.push(step);
        Ok(())
    }

    fn transition(&mut self) -> Result<(), Fail> {
        let (name, meta) = self.head()?;
        self.expect("in")?;
        let part = self.part_ref()?;
        let kind =
            if self.eat("reaction") { TransitionKind::Reaction } else { TransitionKind::Move };
        let requires = self.row("->", Self::step_ref)?;
        self.expect("->")?;
        let enters = self.row("", Self::enter)?;
        let clears = if self.eat("clears") {
            self.list(Self::step_ref)?
        } else if kind == TransitionKind::Move {
            requires.clone()
        } else {
            Vec::new()
        };
        let restart = self.eat("restart");
        let events = if self.eat("on") { self.list(Self::input_ref)? } else { Vec::new() };
        let priority = if self.eat("priority") { Some(self.number()?) } else { None };
        let deadline_ns = if self.eat("deadline") { Some(self.nanoseconds()?) } else { None };
        let guard = if self.eat("when") {
            self.expr()?
        } else {
            GenericExpr { span: name.span, ..Expr::bool(true) }
        };
        self.end_of_line()?;
        let mut actions = Block::new();
        while self.below(&["do"])?.is_some() {
            self.bump();
            actions.extend(self.block()?);
            self.end_of_line()?;
        }
        let transition = Transition {
            name,
            part,
            kind,
            requires,
            clears,
            enters,
            events,
            guard,
            priority,
            restart,
            actions,
            deadline_ns,
            meta,
        };
        self.net_mut().transitions.push(transition);
        Ok(())
    }

    /// Parses items separated by commas. There may be no item; then `end`, a keyword or the end of the line
    /// follows immediately.
    fn row<T>(
        &mut self,
        end: &str,
        mut item: impl FnMut(&mut Self) -> Result<T, Fail>,
    ) -> Result<Vec<T>, Fail> {
        let mut all = Vec::new();
        let none = match self.token().kind {
            Kind::Word => ["clears", "restart", "on", "priority", "deadline", "when"]
                .iter()
                .any(|word| self.is(word)),
            Kind::Newline | Kind::End => true,
            Kind::Symbol => self.is(end),
            _ => false,
        };
        if none {
            return Ok(all);
        }
        loop {
            all.push(item(self)?);
            if !self.eat(",") {
                return Ok(all);
            }
        }
    }

    fn action(&mut self) -> Result<(), Fail> {
        let (name, meta) = self.head()?;
        self.expect("duration")?;
        let duration = self.number()?;
        self.end_of_line()?;
        let (mut uses, mut body) = (Vec::new(), Block::new());
        while let Some(word) = self.below(&["use", "body"])? {
            self.bump();
            if word == "body" {
                body.extend(self.block()?);
            } else {
                let span = self.here();
                let step = self.step_ref()?;
                let Some(found) = Qualifier::ALL.into_iter().find(|each| self.is(each.letters()))
                else {
                    return self.unexpected("a qualifier such as `N` or `SD`");
                };
                self.bump();
                uses.push(ActionUse {
                    step,
                    qualifier: found,
                    condition: self.if_condition()?,
                    span,
                });
            }
            self.end_of_line()?;
        }
        self.net_mut().actions.push(ControlledAction { name, uses, duration, body, meta });
        Ok(())
    }

    fn history(&mut self) -> Result<(), Fail> {
        let (name, meta) = self.head()?;
        self.expect("of")?;
        let owner = self.step_ref()?;
        self.end_of_line()?;
        let (mut cases, mut default, mut default_content) = (Vec::new(), Vec::new(), Block::new());
        while let Some(word) = self.below(&["case", "default", "content"])? {
            self.bump();
            match word {
                "case" => {
                    let step = self.step_ref()?;
                    cases.push(HistoryCase { step, enters: self.list(Self::enter)? });
                }
                "default" => default.extend(self.list(Self::enter)?),
                _ => default_content.extend(self.block()?),
            }
            self.end_of_line()?;
        }
        self.net_mut().histories.push(History {
            name,
            owner,
            cases,
            default,
            default_content,
            meta,
        });
        Ok(())
    }

    fn forcing(&mut self) -> Result<(), Fail> {
        let start = self.before();
        let step = self.step_ref()?;
        let target = self.list(Self::part_ref)?;
        let order = if self.eat("hold") {
            ForcingOrder::Hold
        } else {
            self.expect("situation")?;
            ForcingOrder::Situation(self.list(Self::step_ref)?)
        };
        let span = start.to(self.before());
        self.net_mut().forcings.push(Forcing { step, target, order, span });
        Ok(())
    }

    fn property(&mut self, role: PropertyRole) -> Result<(), Fail> {
        let start = self.before();
        let is_unnamed = self.token().kind == Kind::Str || self.is("never") || self.is("req");
        let name = if is_unnamed { String::new() } else { self.name()?.text };
        let meta = self.meta(start)?;
        self.expect("never")?;
        let never = self.expr()?;
        self.net_mut().properties.push(Property { name, role, never, meta });
        Ok(())
    }

    fn emergency(&mut self) -> Result<(), Fail> {
        let start = self.before();
        let meta = self.meta(start)?;
        self.expect("when")?;
        let condition = self.expr()?;
        if let Some(first) = self.net_mut().emergency.as_ref().map(|first| first.meta.span) {
            self.told(
                Diagnostic::error(codes::NET_SYNTAX, "second emergency; a net can have only one")
                    .at(start, "again here")
                    .at(first, "first here"),
            );
            return Err(Fail);
        }
        self.net_mut().emergency = Some(Emergency { condition, meta });
        Ok(())
    }

    fn ending(&mut self) -> Result<(), Fail> {
        let start = self.before();
        let is_quiet = self.eat("quiet");
        self.expect("unless")?;
        let waits = self.expr()?;
        if let Some(first) = self.net_mut().ending.as_ref().map(|first| first.waits.span) {
            let message = "second `ending`; a net can have only one";
            let found = Diagnostic::error(codes::NET_SYNTAX, message);
            self.told(found.at(start, "again here").at(first, "first here"));
            return Err(Fail);
        }
        self.net_mut().ending = Some(Ending { waits, is_quiet });
        Ok(())
    }

    fn open_cell(&mut self) -> Result<(), Fail> {
        let what = if self.eat("next") {
            OpenCell::Next
        } else {
            self.expect("output")?;
            OpenCell::Output(self.output_ref()?)
        };
        self.expect("when")?;
        let when = self.expr()?;
        self.net_mut().unspecified.push(Unspecified { when, what });
        Ok(())
    }

    fn placement(&mut self) -> Result<(), Fail> {
        let start = self.before();
        let item = if self.eat("step") {
            PlacedItem::Step(self.step_ref()?)
        } else if self.eat("var") {
            PlacedItem::Var(self.var_ref()?)
        } else if self.eat("transition") {
            PlacedItem::Transition(self.transition_ref()?)
        } else {
            self.expect("output")?;
            PlacedItem::Output(self.output_ref()?)
        };
        self.expect("on")?;
        let part = self.name()?;
        let span = start.to(self.before());
        self.net_mut().placements.push(Placement { item, part, span });
        Ok(())
    }
}
