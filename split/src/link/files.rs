//! The C of a link: `NAME_link.h`, `NAME_link.c` and `NAME_link_pins.h`, printed from the acts and the connections.

use grafsynth_c::storage;
use grafsynth_ir::Gather;
use grafsynth_ir::division::{Running, Source};
use std::collections::BTreeMap;

use grafsynth_ir::expr::Type;
use grafsynth_ir::names::{C, Namer};
use grafsynth_ir::net::{InputId, Net};

use super::pins_text;
use super::{Act, Carries, Condition, CpuNames, Link, Put, Request, Start};

/// A file of a link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// Its name, without a folder.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// The C of a link: C99 that compiles without warnings for the CPU. `check` must have accepted the acts.
#[must_use]
pub fn files(request: &Request<'_>, link: &Link) -> Vec<File> {
    let text = Text::new(request, link);
    let stem = &request.stem;
    vec![
        File { name: format!("{stem}_link.h"), text: text.header() },
        File { name: format!("{stem}_link.c"), text: text.source() },
        File { name: format!("{stem}_link_pins.h"), text: pins_text::pins(request, link) },
    ]
}

/// The smallest program that uses a link: it repeats rounds, without inputs and outputs of the plant. What it needs of the memories is what every program needs.
#[must_use]
pub fn smallest_program(request: &Request<'_>, link: &Link) -> String {
    let text = Text::new(request, link);
    let name = &request.name;
    let inputs = (!text.members.is_empty()).then(|| format!("{name}_link_in_t"));
    let calls = [format!("{name}_link_init"), format!("{name}_link_round")];
    main(&request.names, &format!("{}_link.h", request.stem), inputs, text.has_dt, calls)
}

/// The smallest program with a part that has no link.
#[must_use]
pub fn smallest_program_alone(names: &CpuNames) -> String {
    let prefix = &names.prefix;
    let inputs = (!names.inputs.is_empty()).then(|| format!("{prefix}_in_t"));
    let calls = [format!("{prefix}_init"), format!("{prefix}_step")];
    main(names, &names.header, inputs, names.dt.is_some(), calls)
}

/// `main` with the static data that its two calls need.
fn main(
    names: &CpuNames,
    header: &str,
    inputs: Option<String>,
    has_dt: bool,
    [init, step]: [String; 2],
) -> String {
    let prefix = &names.prefix;
    let instance = names.has_instance.then(|| format!("{prefix}_t"));
    let outputs = (!names.outputs.is_empty()).then(|| format!("{prefix}_out_t"));
    let mut text = format!("#include \"{header}\"\n\n");
    let mut declared = |ty: Option<String>, name: &str| {
        let ty = ty?;
        text += &format!("static {ty} {name};\n");
        Some(format!("&{name}"))
    };
    let (instance, inputs) = (declared(instance, "self"), declared(inputs, "in"));
    let outputs = declared(outputs, "out");
    let of_init: Vec<&str> =
        [&instance, &outputs].into_iter().flatten().map(String::as_str).collect();
    let dt = has_dt.then(|| "1U".to_owned());
    let of_step = [&instance, &inputs, &dt, &outputs].into_iter().flatten().map(String::as_str);
    let of_step: Vec<&str> = of_step.collect();
    text += &format!(
        "\nint main(void)\n{{\n    {init}({});\n    for (;;) {{\n        {step}({});\n    }}\n}}\n",
        of_init.join(", "),
        of_step.join(", ")
    );
    text
}

/// How a program calls the functions of a link: `NAME_link_init` and `NAME_link_round`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Calls {
    /// The members of `NAME_link_in_t`, with the inputs of the net. Without any, `NAME_link_round` has no parameter `in`.
    pub members: Vec<(InputId, String)>,
    /// The type of the parameter `dt`, if there is one.
    pub dt: Option<String>,
}

/// How a program calls the functions of a link. The other parameters are those of the part on the CPU.
#[must_use]
pub fn calls(request: &Request<'_>, link: &Link) -> Calls {
    let text = Text::new(request, link);
    let dt = text.has_dt.then(|| text.dt().to_owned());
    Calls { members: text.members.into_iter().collect(), dt }
}

/// The names in the files.
struct Text<'l> {
    request: &'l Request<'l>,
    link: &'l Link,
    /// The members of `NAME_link_in_t`.
    members: BTreeMap<InputId, String>,
    has_dt: bool,
}

impl<'l> Text<'l> {
    fn new(request: &'l Request<'l>, link: &'l Link) -> Self {
        let mut namer = Namer::new(&C);
        let used = |act: &Act| match *act {
            Act::Hand { from, .. } => Some(from),
            Act::Put { value: Put::Input { input, .. }, .. } => Some(input),
            _ => None,
        };
        let all: std::collections::BTreeSet<InputId> = link.acts.iter().filter_map(used).gather();
        let members =
            all.into_iter().map(|id| (id, namer.name(&request.net.inputs[id].name.text))).gather();
        let has_tick = link.acts.iter().any(|act| matches!(act, Act::Put { value: Put::Tick, .. }));
        Text { request, link, members, has_dt: has_tick || request.names.dt.is_some() }
    }

    fn dt(&self) -> &str {
        self.request.names.dt.as_deref().unwrap_or("uint8_t")
    }

    /// The parameters of `NAME_link_init` or `NAME_link_round`.
    fn parameters(&self, is_round: bool) -> String {
        let (name, cpu) = (&self.request.name, &self.request.names);
        let mut all = Vec::new();
        if cpu.has_instance {
            all.push(format!("{}_t *self", cpu.prefix));
        }
        if is_round && !self.members.is_empty() {
            all.push(format!("const {name}_link_in_t *in"));
        }
        if is_round && self.has_dt {
            all.push(format!("{} dt", self.dt()));
        }
        if !cpu.outputs.is_empty() {
            all.push(format!("{}_out_t *out", cpu.prefix));
        }
        if all.is_empty() { "void".to_owned() } else { all.join(", ") }
    }

    fn struct_of_inputs(&self) -> String {
        let line = |(id, member): (&InputId, &String)| {
            format!("    {} {member};\n", storage(self.request.net.inputs[*id].ty))
        };
        self.members.iter().map(line).collect()
    }

    fn header(&self) -> String {
        let (name, upper) = (&self.request.name, self.request.name.to_uppercase());
        let is_free = self.request.division.running == Running::Free;
        let about = match is_free {
            true => {
                "One reaction of the part on the CPU: reads the wires of the other parts, reacts, shows its own. The chips run on their own meanwhile."
            }
            false => {
                "One reaction of the chart on all parts. When it returns, the outputs of the chips have settled."
            }
        };
        let mut text = format!(
            "/* {stem}_link: the chart {chart} on a CPU ({cpu}) and chips. Do not edit: it is regenerated from the chart. */\n\
             #ifndef {upper}_LINK_H\n#define {upper}_LINK_H\n\n#include \"{header}\"\n\n#include <stdbool.h>\n#include <stdint.h>\n\n\
             #ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n",
            stem = comment(&self.request.stem),
            chart = comment(&self.request.net.name.text),
            cpu = self.request.cpu.name,
            header = self.request.names.header,
        );
        if !self.members.is_empty() {
            text += &format!(
                "/* The inputs of the {}. A {} reads each of them once. */\ntypedef struct {{\n{}}} {name}_link_in_t;\n\n",
                if is_free { "part on the CPU" } else { "chart" },
                if is_free { "reaction" } else { "round" },
                self.struct_of_inputs()
            );
        }
        let has_reset = self.link.connections.iter().any(|one| one.carries == Carries::Reset);
        text += match is_free {
            true if has_reset => {
                "/* Sets the directions of the pins, holds the chips in their initial states, and resets the part on the CPU. Call it again to start again. */\n"
            }
            true => {
                "/* Sets the directions of the pins, waits until the chips are in their initial states, and resets the part on the CPU. The chips must have been\n \
                 * powered off since the CPU ran last: a reset of the CPU alone does not reset them. */\n"
            }
            false => {
                "/* Sets the directions of the pins, waits until the chips have started, and resets them and the part on the CPU. Call it again to start again. */\n"
            }
        };
        text += &format!("void {name}_link_init({});\n\n", self.parameters(false));
        let ticks = if self
            .link
            .acts
            .iter()
            .any(|act| matches!(act, Act::Put { value: Put::Tick, .. }))
        {
            " A chip\n * counts ticks: call it once per tick with dt 1; with dt 0, no time passes in the round."
        } else {
            ""
        };
        text += &format!(
            "/* {about} Not reentrant; no interrupt may use its pins.{ticks} */\n\
             void {name}_link_round({});\n\n#ifdef __cplusplus\n}}\n#endif\n\n#endif\n",
            self.parameters(true)
        );
        text
    }

    fn source(&self) -> String {
        let (name, upper) = (&self.request.name, self.request.name.to_uppercase());
        let (stem, cpu) = (&self.request.stem, &self.request.names);
        let what = match self.request.division.running {
            Running::Lockstep => "one round of the parts",
            Running::Free => "one reaction of the part on the CPU",
        };
        let mut text = format!(
            "/* {about}_link: {what}, in the order that was checked. Do not edit: it is regenerated from the chart. */\n\
             #include \"{stem}_link.h\"\n#include \"{stem}_link_pins.h\"\n\n",
            about = comment(stem),
        );
        text += &self.conditions();
        text += &format!(
            "void {name}_link_init({})\n{{\n    {upper}_LINK_PINS_INIT();\n    {upper}_LINK_WAIT_CHIPS();\n",
            self.parameters(false)
        );
        text += &self.reset(&upper);
        text += &format!("    {}_init({});\n", cpu.prefix, self.arguments(false));
        for (at, start) in &self.link.start {
            let value = match start {
                Start::Level(level) => level.to_string(),
                Start::Output(output) => self.value(Put::Output(*output)),
            };
            text += &format!("    {upper}_PUT_{}({value});\n", self.link.connections[*at].name);
        }
        text += &format!("    {upper}_LINK_SETTLE();\n}}\n\n");
        text += &format!("void {name}_link_round({})\n{{\n", self.parameters(true));
        if !self.members.is_empty() {
            text += &format!("    {name}_link_in_t latched;\n");
        }
        if !cpu.inputs.is_empty() {
            let handed = |act: &&Act| {
                matches!(act, Act::Hand { .. } | Act::Get { .. } | Act::HandMore { .. })
            };
            let all = self.link.acts.iter().filter(handed).count() == cpu.inputs.len();
            // Some inputs are wired to chips alone; the part on the CPU does not read them.
            let zero = if all { "" } else { " = {0}" };
            text += &format!("    {}_in_t cpu_in{zero};\n", cpu.prefix);
        }
        match self.link.most_rounds {
            None => {
                text += "\n";
                for act in &self.link.acts {
                    text += &self.act(*act, &upper);
                }
            }
            Some(most) => text += &self.rounds(most, &upper),
        }
        text += "}\n";
        text
    }

    /// A clock for the chips while the wire that resets them is high, as its resistor holds it.
    fn reset(&self, upper: &str) -> String {
        let at =
            |carries: Carries| self.link.connections.iter().position(|one| one.carries == carries);
        match (at(Carries::Reset), at(Carries::Clock)) {
            (Some(_), Some(connection)) => self.act(Act::Clock { connection }, upper),
            _ => String::new(),
        }
    }

    /// The functions for extern conditions that are called once in a reaction, with the types of their results.
    fn once(&self) -> impl Iterator<Item = (&Condition, Type)> {
        let part = self.request.division.parts.last();
        let source = move |own: &InputId| {
            let mut all = part?.inputs.iter();
            all.find(|(id, _)| id == own).map(|(_, source)| *source)
        };
        let net = self.request.net;
        self.request.names.conditions.iter().filter_map(move |(own, functions)| {
            match source(own)? {
                Source::Input(id) if self.link.once.contains(&id) => {
                    Some((functions, net.inputs[id].ty))
                }
                Source::Input(_) | Source::Direct(_) | Source::Wire(_) | Source::More => None,
            }
        })
    }

    /// The functions that the part on the CPU calls for its extern conditions.
    fn conditions(&self) -> String {
        let one = |(Condition { called, provided }, ty): (&Condition, Type)| {
            let ty = storage(ty);
            format!(
                "static bool {called}_known;\nstatic {ty} {called}_value;\n\n\
                 /* {provided} is called at most once in a reaction, however many rounds it has. */\n\
                 {ty} {called}(void)\n{{\n    if (!{called}_known) {{\n        {called}_value = {provided}();\n        \
                 {called}_known = true;\n    }}\n    return {called}_value;\n}}\n\n"
            )
        };
        let text: String = self.once().map(one).collect();
        match text.is_empty() {
            true => text,
            false => format!("#include \"{}\"\n\n{text}", self.request.names.library),
        }
    }

    /// A reaction of several rounds. The bound is never reached if the reactions of the chart end and no chip is broken.
    fn rounds(&self, most: u32, upper: &str) -> String {
        let (mut once, mut again) = (String::new(), String::new());
        for act in &self.link.acts {
            match act {
                Act::Latch => once += &self.act(*act, upper),
                _ => again += &self.act(*act, upper),
            }
        }
        let mut text = "    uint32_t rounds = 0U;\n    bool moves;\n\n".to_owned();
        text += &once;
        // Time and events are those of the first round.
        for (id, member) in &self.members {
            if self.request.net.inputs[*id].kind.is_event() {
                again += &format!("    latched.{member} = false;\n");
            }
        }
        if self.has_dt {
            again += "    dt = 0U;\n";
        }
        let again: String = again.lines().map(|line| format!("    {line}\n")).collect();
        text += "    do {\n        moves = false;\n";
        text += &again;
        text += "        rounds++;\n";
        text += &format!("    }} while (moves && rounds < {most}UL);\n");
        text
    }

    /// The arguments of `NAME_init` or `NAME_step`.
    fn arguments(&self, is_step: bool) -> String {
        let cpu = &self.request.names;
        let all = [
            cpu.has_instance.then_some("self"),
            (is_step && !cpu.inputs.is_empty()).then_some("&cpu_in"),
            (is_step && cpu.dt.is_some()).then_some("dt"),
            (!cpu.outputs.is_empty()).then_some("out"),
        ];
        all.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    /// The C expression of a value that is put on a pin.
    fn value(&self, put: Put) -> String {
        let member = |name: Option<&String>| name.cloned().unwrap_or_default();
        match put {
            Put::Input { input, bit } => {
                bit_of(self.request.net, input, &member(self.members.get(&input)), bit)
            }
            Put::Tick => "dt != 0U".to_owned(),
            Put::More => "moves".to_owned(),
            Put::Output(output) => {
                format!("out->{}", member(self.request.names.outputs.get(&output)))
            }
        }
    }

    /// The lines of one act.
    fn act(&self, act: Act, upper: &str) -> String {
        let none = String::new();
        let cpu = &self.request.names;
        let member = |id: InputId| self.members.get(&id).unwrap_or(&none);
        let input = |id: InputId| cpu.inputs.get(&id).unwrap_or(&none);
        let pin = |at: usize| self.link.connections.get(at).map_or("", |one| one.name.as_str());
        match act {
            Act::Latch => {
                let latched =
                    self.members.values().map(|name| format!("    latched.{name} = in->{name};\n"));
                let forgotten =
                    self.once().map(|(name, _)| format!("    {}_known = false;\n", name.called));
                latched.chain(forgotten).collect()
            }
            Act::Hand { from, to } => {
                format!("    cpu_in.{} = latched.{};\n", input(to), member(from))
            }
            Act::Put { connection, value } => {
                let value = self.value(value);
                format!("    {upper}_PUT_{}({value});\n", pin(connection))
            }
            Act::Settle => format!("    {upper}_LINK_SETTLE();\n"),
            Act::Get { connection, to } => {
                format!("    cpu_in.{} = {upper}_GET_{}();\n", input(to), pin(connection))
            }
            Act::AskChip { connection } => {
                format!(
                    "    if ({upper}_GET_{}()) {{\n        moves = true;\n    }}\n",
                    pin(connection)
                )
            }
            Act::AskCpu { output } => {
                let member = cpu.outputs.get(&output).unwrap_or(&none);
                format!("    if (out->{member}) {{\n        moves = true;\n    }}\n")
            }
            Act::HandMore { to } => format!("    cpu_in.{} = moves;\n", input(to)),
            Act::React => format!("    {}_step({});\n", cpu.prefix, self.arguments(true)),
            Act::Clock { connection } => {
                let pin = pin(connection);
                format!(
                    "    {upper}_PUT_{pin}(true);\n    {upper}_LINK_SETTLE();\n    {upper}_PUT_{pin}(false);\n"
                )
            }
        }
    }
}

/// A Boolean expression: one bit of a latched input minus its lower bound.
fn bit_of(net: &Net, input: InputId, member: &str, bit: u32) -> String {
    let Type::Int { lo, .. } = net.inputs[input].ty else { return format!("latched.{member}") };
    // Unsigned arithmetic wraps, so the difference is exact for negative values too.
    let low = lo.rem_euclid(1 << 32);
    let value = if low == 0 {
        format!("(uint32_t)latched.{member}")
    } else {
        format!("((uint32_t)latched.{member} - (uint32_t)0x{low:x}UL)")
    };
    format!("(({value} >> {bit}U) & 1U) != 0U")
}

/// Text in a comment: a name cannot end it.
pub(super) fn comment(text: &str) -> String {
    text.replace("*/", "* /")
}
