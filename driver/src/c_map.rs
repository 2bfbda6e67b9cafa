//! `NAME.map.json`: how emitted C holds the state of its chart, as `build` writes it beside `NAME.c`. A proof of C that somebody edited needs it.
//!
//! The map is a hint. A proof checks each statement in it, so that a wrong map can prevent a proof but never make a wrong one. Which member of the interface is
//! which input or output is not in the map: that follows from the chart and from the options of the build.

use grafsynth_backend_c::cost::{self, Goal};
use grafsynth_backend_c::{Io, Options, Package, Style};
use grafsynth_c::tree::types::Type;
use grafsynth_c::tree::{Symbol, SymbolKind, Unit};
use grafsynth_ir::instance::{Holds, Place, Representation};
use grafsynth_ir::net::{
    ActionId, EdgeId, HistoryId, InputId, Net, PartId, SendId, StepId, TimerId, VarId,
};
use grafsynth_ir::program::{ActionPart, Origin};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The format and its version.
const FORMAT: &str = "grafsynth-c-map-1";

/// The map of one package of C.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CMap {
    format: String,
    chart: String,
    options: BuiltWith,
    /// Empty for an image.
    instance: Vec<Member>,
}

/// The options of the build that decide what the interface is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct BuiltWith {
    style: String,
    #[serde(default, rename = "for", skip_serializing_if = "Option::is_none")]
    machine: Option<String>,
    #[serde(default, skip_serializing_if = "is_default")]
    optimise_size: bool,
    #[serde(default, skip_serializing_if = "is_default")]
    io_words: bool,
    #[serde(default, skip_serializing_if = "is_default")]
    gate: bool,
    #[serde(default, skip_serializing_if = "is_default")]
    safe_state: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    trace_ring: Option<u16>,
    #[serde(default, skip_serializing_if = "is_default")]
    callbacks: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    prefix: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    stem: Option<String>,
}

/// The first JSON member that is absent or different when the parsed value is written again.
fn unneeded(found: &Value, written: &Value, at: &str) -> Option<String> {
    match (found, written) {
        (Value::Object(found), Value::Object(written)) => found.iter().find_map(|(name, value)| {
            let at = if at.is_empty() { name.clone() } else { format!("{at}.{name}") };
            match written.get(name) {
                Some(written) => unneeded(value, written, &at),
                None => Some(at),
            }
        }),
        (Value::Array(found), Value::Array(written)) => {
            let mut pairs = found.iter().zip(written).enumerate();
            pairs.find_map(|(n, (found, written))| unneeded(found, written, &format!("{at}[{n}]")))
        }
        _ => None,
    }
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// A scalar of the instance and what it holds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Member {
    member: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    element: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    bit: Option<u32>,
    holds: Held,
}

/// What a scalar holds, in the names of the chart. Operands of edges and controlled actions have no names, so they have their numbers in the net.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
enum Held {
    /// The number of the active step.
    Active {
        steps: Vec<Code>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        none: Option<i64>,
    },
    /// The time since the active step became active.
    Time {
        steps: Vec<String>,
        cap: i64,
        #[serde(default, skip_serializing_if = "is_default")]
        zero_between: bool,
    },
    Step(String),
    Elapsed(String),
    SharedElapsed(String),
    LastElapsed(String),
    Variable {
        name: String,
        #[serde(default, skip_serializing_if = "is_default")]
        element: u32,
    },
    Edge(u32),
    Timer(String),
    TimerCondition(String),
    Older(String, String),
    TaskIndex(String),
    ActionQ(u32),
    ActionLatch(u32, String),
    ActionTimer(u32, String),
    Pending(String),
    Fault,
    /// The number of the state that a history recorded.
    Record {
        history: String,
        steps: Vec<Code>,
    },
    /// A history recorded this state.
    Recorded(String, String),
    SendTimer(String),
    /// A send is waiting.
    SendRuns(String),
    /// A chart by its number in the net: it has ended.
    Ended(u32),
    /// An output, and the chart that ended with it, by their numbers in the net.
    KeptOutput(u32, u32),
    InternalQueue(u32),
    InternalLength,
    ExternalQueue(u32),
    ExternalLength,
}

#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Code {
    step: String,
    code: i64,
}

impl CMap {
    /// The map of a package; `None` if the style does not say how it holds the state of the net.
    #[must_use]
    pub fn of(net: &Net, package: &Package, options: &Options) -> Option<CMap> {
        // A map cannot describe single bits. An image has them, and its instance is the same after any edit.
        let has_bits = |hint: &&Representation| hint.state.iter().any(|it| it.0.bit.is_some());
        let is_image = !package.image.is_empty();
        let hint = package.representation.as_ref().filter(|hint| is_image || !has_bits(hint))?;
        let members = hint.state.iter().filter(|_| !is_image).filter_map(|(place, holds)| {
            let Place { member, element, bit } = place.clone();
            Some(Member { member, element, bit, holds: held(net, holds)? })
        });
        Some(CMap {
            format: FORMAT.to_owned(),
            chart: net.name.text.clone(),
            options: BuiltWith {
                style: options.style.name().to_owned(),
                machine: options.machine.map(|machine| machine.name.to_owned()),
                optimise_size: options.goal == Goal::Size,
                io_words: options.io == Io::Words,
                gate: options.gate,
                safe_state: options.safe_state,
                trace_ring: options.trace,
                callbacks: options.callbacks,
                prefix: options.prefix.clone(),
                stem: options.stem.clone(),
            },
            instance: members.collect(),
        })
    }

    /// Reads a map.
    ///
    /// # Errors
    /// The text is not JSON, has another version, has members that no map has, or has values that `build` does not write; with the line or the member.
    pub fn parse(text: &str) -> Result<CMap, String> {
        /// Only the format, so that another version is not reported as an unknown member.
        #[derive(Deserialize)]
        struct Head {
            format: String,
        }
        let head: Head = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if head.format != FORMAT {
            return Err(format!("format `{}` (this version reads `{FORMAT}`)", head.format));
        }
        let map: CMap = serde_json::from_str(text).map_err(|error| error.to_string())?;
        let found: Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
        let written = serde_json::to_value(&map).map_err(|error| error.to_string())?;
        match unneeded(&found, &written, "") {
            Some(place) => Err(format!("`{place}` is set to its default value; remove it")),
            None => Ok(map),
        }
    }

    /// Checks that the map is one of this chart.
    ///
    /// # Errors
    /// It names another chart.
    pub fn is_of(&self, net: &Net) -> Result<(), String> {
        let name = &net.name.text;
        if self.chart == *name {
            return Ok(());
        }
        Err(format!(
            "`chart`: the map is of the chart `{}`, and the chart is called `{name}`; name the map of this chart with `--map`, or write the new name here",
            self.chart
        ))
    }

    /// Checks that the members of the map are scalars of the instance: the structure `NAME_t` of a unit. Members that the structure does not have are not
    /// checked, because the proof reports them.
    ///
    /// # Errors
    /// The first member that is not, with its place in the map.
    pub fn scalars_of(&self, unit: &Unit, instance: &str) -> Result<(), String> {
        let is_it = |symbol: &&Symbol| {
            symbol.name == instance && matches!(symbol.kind, SymbolKind::Typedef)
        };
        let symbol = unit.symbols.values().find(is_it);
        let Some(id) = symbol.and_then(|it| it.canonical.ty.as_struct()) else { return Ok(()) };
        for (at, Member { member, element, bit, .. }) in self.instance.iter().enumerate() {
            let Some(found) = unit.structs[id].members.iter().find(|it| it.name == *member) else {
                continue;
            };
            let why = match (&found.canonical.ty, element, bit) {
                (_, _, Some(_)) => "`bit`: a map cannot describe single bits; remove it".to_owned(),
                (Type::Array(_, Some(len)), Some(element), None) if u64::from(*element) >= *len => {
                    format!(
                        "`element`: `{member}` has {len} elements, counted from 0; write a smaller number"
                    )
                }
                (Type::Array(..), None, None) => {
                    format!("`{member}` is an array; select an element with `element`")
                }
                (Type::Array(..), Some(_), None) | (_, None, None) => continue,
                (_, Some(_), None) => {
                    format!("`element`: `{member}` is not an array; remove it")
                }
            };
            return Err(format!("`instance[{at}]`: {why}"));
        }
        Ok(())
    }

    /// The text of the file.
    #[must_use]
    pub fn to_text(&self) -> String {
        // Numbers and strings can always be written.
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// The name of the chart.
    #[must_use]
    pub fn chart(&self) -> &str {
        &self.chart
    }

    /// The options of the build.
    ///
    /// # Errors
    /// A style or a machine is unknown, or an option that `build` would not accept with the others.
    pub fn options(&self) -> Result<Options, String> {
        let built = &self.options;
        if built.optimise_size && built.machine.is_none() {
            return Err("`optimise_size` needs a machine: write `for`, or remove it".to_owned());
        }
        if built.trace_ring.is_some_and(|n| !(1..=8192).contains(&n)) {
            return Err("`trace_ring` must be a number from 1 to 8192".to_owned());
        }
        let style = Style::from_name(&built.style);
        let machine =
            |name: &String| cost::machine(name).ok_or_else(|| format!("unknown machine `{name}`"));
        Ok(Options {
            style: style.ok_or_else(|| format!("unknown style `{}`", built.style))?,
            machine: built.machine.as_ref().map(machine).transpose()?,
            goal: if built.optimise_size { Goal::Size } else { Goal::Speed },
            io: if built.io_words { Io::Words } else { Io::Members },
            gate: built.gate,
            safe_state: built.safe_state,
            trace: built.trace_ring,
            callbacks: built.callbacks,
            prefix: built.prefix.clone(),
            stem: built.stem.clone(),
            ..Options::default()
        })
    }

    /// What the scalars of the instance hold.
    ///
    /// # Errors
    /// A name that the chart does not have, or has more than once.
    pub fn state(&self, net: &Net) -> Result<Vec<(Place, Holds)>, String> {
        let names = Names { net };
        let one = |member: &Member| {
            let Member { member, element, bit, holds } = member.clone();
            let holds = names.holds(&holds);
            let holds = holds.map_err(|why| format!("member `{member}` holds {why}"))?;
            Ok((Place { member, element, bit }, holds))
        };
        self.instance.iter().map(one).collect()
    }
}

/// What a scalar holds, for the map; `None` for parts of charts that no proof covers.
fn held(net: &Net, holds: &Holds) -> Option<Held> {
    let step = |id: StepId| net.steps[id].name.text.clone();
    let number = |index: usize| u32::try_from(index).unwrap_or(u32::MAX);
    let part = |it: ActionPart| it.name().to_owned();
    Some(match holds {
        Holds::ActiveOf { steps, none } => Held::Active {
            steps: steps.iter().map(|(id, code)| Code { step: step(*id), code: *code }).collect(),
            none: *none,
        },
        Holds::TimeOf { steps, cap, is_zero_between } => Held::Time {
            steps: steps.iter().map(|id| step(*id)).collect(),
            cap: *cap,
            zero_between: *is_zero_between,
        },
        Holds::Recorded { history, states } => Held::Record {
            history: net.histories[*history].name.text.clone(),
            steps: states.iter().map(|(id, code)| Code { step: step(*id), code: *code }).collect(),
        },
        Holds::Piece(origin, element) => match *origin {
            Origin::Step(id) => Held::Step(step(id)),
            Origin::Elapsed(id) => Held::Elapsed(step(id)),
            Origin::SharedElapsed(id) => Held::SharedElapsed(step(id)),
            Origin::LastElapsed(id) => Held::LastElapsed(step(id)),
            Origin::Var(id) => {
                Held::Variable { name: net.vars[id].name.text.clone(), element: *element }
            }
            Origin::Edge(id) => Held::Edge(number(id.index())),
            Origin::Timer(id) => Held::Timer(net.timers[id].name.text.clone()),
            Origin::TimerCondition(id) => Held::TimerCondition(net.timers[id].name.text.clone()),
            Origin::Older(first, second) => Held::Older(step(first), step(second)),
            Origin::TaskIndex(id) => Held::TaskIndex(step(id)),
            Origin::ActionQ(id) => Held::ActionQ(number(id.index())),
            Origin::ActionLatch(id, it) => Held::ActionLatch(number(id.index()), part(it)),
            Origin::ActionTimer(id, it) => Held::ActionTimer(number(id.index()), part(it)),
            Origin::Pending(id) => Held::Pending(net.inputs[id].name.text.clone()),
            Origin::Fault => Held::Fault,
            Origin::SendTimer(id) => Held::SendTimer(net.sends[id].name.text.clone()),
            Origin::Ended(id) => Held::Ended(number(id.index())),
            Origin::HeldOutput(output, part) => {
                Held::KeptOutput(number(output.index()), number(part.index()))
            }
            Origin::InternalQueue => Held::InternalQueue(*element),
            Origin::InternalLength => Held::InternalLength,
            Origin::ExternalQueue => Held::ExternalQueue(*element),
            Origin::ExternalLength => Held::ExternalLength,
            Origin::SendRuns(id) => Held::SendRuns(net.sends[id].name.text.clone()),
            Origin::Recorded(history, state) => {
                Held::Recorded(net.histories[history].name.text.clone(), step(state))
            }
            // What only a chip has, and what one reaction keeps for itself.
            Origin::Region(_) | Origin::Helper => return None,
        },
    })
}

/// The objects of a net by name.
struct Names<'a> {
    net: &'a Net,
}

/// The one object with a name.
fn one<'a, T>(
    what: &str,
    name: &str,
    mut all: impl Iterator<Item = (T, &'a str)>,
) -> Result<T, String> {
    let mut named = all.by_ref().filter(|(_, known)| *known == name).map(|(id, _)| id);
    match (named.next(), named.next()) {
        (Some(id), None) => Ok(id),
        (None, _) => Err(format!("the {what} `{name}`, which the chart does not have")),
        (Some(_), Some(_)) => Err(format!("the {what} `{name}`, which the chart has twice")),
    }
}

/// The object with a number.
fn numbered<T>(what: &str, number: u32, mut all: impl Iterator<Item = T>) -> Result<T, String> {
    let index = usize::try_from(number).unwrap_or(usize::MAX);
    all.nth(index).ok_or_else(|| format!("the {what} {number}, which the chart does not have"))
}

impl Names<'_> {
    fn step(&self, name: &str) -> Result<StepId, String> {
        one("step", name, self.net.steps.iter().map(|(id, it)| (id, it.name.text.as_str())))
    }

    fn var(&self, name: &str) -> Result<VarId, String> {
        one("variable", name, self.net.vars.iter().map(|(id, it)| (id, it.name.text.as_str())))
    }

    fn timer(&self, name: &str) -> Result<TimerId, String> {
        one("timer", name, self.net.timers.iter().map(|(id, it)| (id, it.name.text.as_str())))
    }

    fn input(&self, name: &str) -> Result<InputId, String> {
        one("event", name, self.net.inputs.iter().map(|(id, it)| (id, it.name.text.as_str())))
    }

    fn history(&self, name: &str) -> Result<HistoryId, String> {
        one("history", name, self.net.histories.iter().map(|(id, it)| (id, it.name.text.as_str())))
    }

    fn send(&self, name: &str) -> Result<SendId, String> {
        one("send", name, self.net.sends.iter().map(|(id, it)| (id, it.name.text.as_str())))
    }

    fn part(&self, number: u32) -> Result<PartId, String> {
        numbered("chart", number, self.net.parts.ids())
    }

    fn edge(&self, number: u32) -> Result<EdgeId, String> {
        numbered("edge", number, self.net.edges.iter().map(|(id, _)| id))
    }

    fn action(&self, number: u32) -> Result<ActionId, String> {
        numbered("action", number, self.net.actions.iter().map(|(id, _)| id))
    }

    fn holds(&self, held: &Held) -> Result<Holds, String> {
        let part = |name: &str| {
            ActionPart::named(name).ok_or_else(|| format!("the unknown part `{name}`"))
        };
        let mut element = 0;
        let origin = match held {
            Held::Active { steps, none } => {
                let code = |it: &Code| Ok((self.step(&it.step)?, it.code));
                let steps = steps.iter().map(code).collect::<Result<_, String>>()?;
                return Ok(Holds::ActiveOf { steps, none: *none });
            }
            Held::Time { steps, cap, zero_between } => {
                if *cap < 0 {
                    return Err(format!("a time up to {cap}"));
                }
                let steps =
                    steps.iter().map(|name| self.step(name)).collect::<Result<_, String>>()?;
                return Ok(Holds::TimeOf { steps, cap: *cap, is_zero_between: *zero_between });
            }
            Held::Step(name) => Origin::Step(self.step(name)?),
            Held::Elapsed(name) => Origin::Elapsed(self.step(name)?),
            Held::SharedElapsed(name) => Origin::SharedElapsed(self.step(name)?),
            Held::LastElapsed(name) => Origin::LastElapsed(self.step(name)?),
            Held::Variable { name, element: at } => {
                element = *at;
                Origin::Var(self.var(name)?)
            }
            Held::Edge(number) => Origin::Edge(self.edge(*number)?),
            Held::Timer(name) => Origin::Timer(self.timer(name)?),
            Held::TimerCondition(name) => Origin::TimerCondition(self.timer(name)?),
            Held::Older(first, second) => Origin::Older(self.step(first)?, self.step(second)?),
            Held::TaskIndex(name) => Origin::TaskIndex(self.step(name)?),
            Held::ActionQ(number) => Origin::ActionQ(self.action(*number)?),
            Held::ActionLatch(number, it) => Origin::ActionLatch(self.action(*number)?, part(it)?),
            Held::ActionTimer(number, it) => Origin::ActionTimer(self.action(*number)?, part(it)?),
            Held::Pending(name) => Origin::Pending(self.input(name)?),
            Held::Fault => Origin::Fault,
            Held::Record { history, steps } => {
                let code = |it: &Code| Ok((self.step(&it.step)?, it.code));
                let states = steps.iter().map(code).collect::<Result<_, String>>()?;
                return Ok(Holds::Recorded { history: self.history(history)?, states });
            }
            Held::Recorded(history, state) => {
                Origin::Recorded(self.history(history)?, self.step(state)?)
            }
            Held::SendTimer(name) => Origin::SendTimer(self.send(name)?),
            Held::SendRuns(name) => Origin::SendRuns(self.send(name)?),
            Held::Ended(number) => Origin::Ended(self.part(*number)?),
            Held::KeptOutput(output, part) => {
                let output = numbered("output", *output, self.net.outputs.ids())?;
                Origin::HeldOutput(output, self.part(*part)?)
            }
            Held::InternalQueue(at) => {
                element = *at;
                Origin::InternalQueue
            }
            Held::InternalLength => Origin::InternalLength,
            Held::ExternalQueue(at) => {
                element = *at;
                Origin::ExternalQueue
            }
            Held::ExternalLength => Origin::ExternalLength,
        };
        Ok(Holds::Piece(origin, element))
    }
}

#[cfg(test)]
mod tests {
    use super::CMap;

    #[test]
    fn reading_is_strict() {
        let good = r#"{"format": "grafsynth-c-map-1", "chart": "a", "options": {"style": "auto"},
            "instance": [{"member": "s", "holds": {"step": "go"}}]}"#;
        let map = CMap::parse(good).unwrap();
        assert_eq!(CMap::parse(&map.to_text()), Ok(map));
        for (from, to, why) in [
            ("map-1", "map-2", "format `grafsynth-c-map-2`"),
            ("\"auto\"", "3", "invalid type"),
            ("\"step\"", "\"stop\"", "unknown variant `stop`"),
            ("\"chart\": \"a\",", "", "missing field `chart`"),
            ("\"member\"", "\"x\": 1, \"member\"", "unknown field `x`"),
            ("\"chart\"", "\"chart\": \"b\", \"chart\"", "duplicate field `chart`"),
            ("]}", "]", "EOF"),
        ] {
            let error = CMap::parse(&good.replace(from, to)).unwrap_err();
            assert!(error.contains(why), "{to}: {error}");
        }
        for (from, to, place) in [
            ("\"style\"", "\"gate\": false, \"style\"", "`options.gate`"),
            ("\"style\"", "\"for\": null, \"style\"", "`options.for`"),
            ("\"member\"", "\"bit\": null, \"member\"", "`instance[0].bit`"),
        ] {
            let error = CMap::parse(&good.replace(from, to)).unwrap_err();
            assert!(error.starts_with(place) && error.ends_with("remove it"), "{to}: {error}");
        }
        for (options, why) in [
            ("\"optimise_size\": true", "`optimise_size` needs a machine"),
            ("\"trace_ring\": 0", "`trace_ring`"),
        ] {
            let text = good.replace("\"style\"", &format!("{options}, \"style\""));
            let error = CMap::parse(&text).unwrap().options().unwrap_err();
            assert!(error.starts_with(why), "{error}");
        }
        let unknown = CMap::parse(&good.replace("auto", "other")).unwrap();
        assert_eq!(unknown.options(), Err("unknown style `other`".to_owned()));
    }
}
