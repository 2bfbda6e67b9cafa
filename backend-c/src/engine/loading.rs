//! The text that both engines with an image have in common: the instance, `NAME_load`, and the sizes in the header.

use super::image::Line;
use super::ops::{Machine, c_text};
use super::room::Room;
use super::{clear_array, declarations, macros, member, table};
use crate::FileKind;
use crate::c::print::Node;
use crate::names::Names;
use crate::style_output::{Engine, EngineFile, Member};
use grafsynth_ir::net::VarId;
use std::collections::BTreeMap;

/// The data that the text depends on.
pub(super) struct Loading<'a> {
    /// The names of the chart.
    pub(super) names: &'a Names,
    /// The instance.
    pub(super) room: &'a Room,
    /// Names of two locals: the instance that the image must fit, and the result of the check.
    pub(super) locals: [&'a str; 2],
}

impl Loading<'_> {
    /// The sizes of the arrays of an instance and of a reaction.
    fn arrays(&self) -> Vec<(&'static str, u32)> {
        let room = self.room;
        let mut all = vec![("BITS", room.bits), ("VALUES", room.values)];
        if room.is_program {
            all.extend([("FLAGS", room.flags), ("NUMBERS", room.numbers)]);
        } else {
            all.push(("WORK", room.work));
        }
        all
    }

    /// The first letters of the engine's functions.
    fn prefix(&self) -> &'static str {
        if self.room.is_program { "gp" } else { "gs" }
    }

    /// The declaration of a parameter for the outputs, and its argument.
    fn out(&self) -> (String, &'static str) {
        if self.room.outputs == 0 {
            return (String::new(), "");
        }
        (format!(", {}_out_t *out", self.names.prefix), ", out")
    }

    fn head(&self) -> String {
        let (prefix, (out, _)) = (&self.names.prefix, self.out());
        format!(
            "uint8_t {prefix}_load({prefix}_t *self, GS_ROM uint8_t *image, uint16_t size{out})"
        )
    }

    /// The members for the image, the bits and the values, with a note on the contents of each.
    pub(super) fn instance(&self, notes: [&str; 3]) -> Vec<Member> {
        let upper = &self.names.upper;
        vec![
            member("GS_ROM uint8_t *image", notes[0]),
            member(&format!("uint8_t bits[{upper}_BITS]"), notes[1]),
            member(&format!("int32_t values[{upper}_VALUES]"), notes[2]),
        ]
    }

    /// The body of `NAME_init`.
    pub(super) fn init(&self) -> Vec<Node> {
        let (prefix, (_, hand)) = (&self.names.prefix, self.out());
        vec![Node::line(format!("{prefix}_start(self, {prefix}_tables{hand});"))]
    }

    /// `NAME_start`, which clears the instance and then runs `reset`, and `NAME_load`.
    pub(super) fn functions(&self, what: &str, reset: Vec<Node>) -> Vec<Node> {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let (out, hand) = self.out();
        let mut start = vec![Node::line("self->image = image;")];
        // The unused part is cleared too, because instances are compared byte by byte.
        start.push(clear_array(&format!("{upper}_BITS"), "self->bits[i] = 0U;"));
        start.push(clear_array(&format!("{upper}_VALUES"), "self->values[i] = 0;"));
        start.extend(reset);
        let (engine, [it, found], room) = (self.prefix(), self.locals, self.room);
        let mut load = vec![format!("{engine}_room_t {it};"), format!("uint8_t {found};")];
        let mut set = |name: &str, value: String| load.push(format!("{it}.{name} = {value};"));
        set("interface", format!("{upper}_INTERFACE"));
        set("inputs", format!("{}U", room.inputs));
        set("outputs", format!("{}U", room.outputs));
        if room.is_program {
            set("rounds", format!("{upper}_ROUNDS"));
            for (name, many) in
                [("calls", room.calls), ("texts", room.texts), ("fired", room.fired)]
            {
                set(name, format!("{many}U"));
            }
        }
        for (name, _) in self.arrays() {
            set(&name.to_ascii_lowercase(), format!("{upper}_{name}"));
        }
        load.push(format!("{found} = {engine}_check(image, size, &{it});"));
        let mut load: Vec<Node> = load.into_iter().map(Node::line).collect();
        let accepted = Node::line(format!("{prefix}_start(self, image{hand});"));
        load.push(Node::when(&format!("{found} == GS_OK"), vec![accepted]));
        load.push(Node::line(format!("return {found};")));
        let head =
            format!("static void {prefix}_start({prefix}_t *self, GS_ROM uint8_t *image{out})");
        vec![
            Node::comment(format!("Resets with {what}.")),
            Node::function(head, start),
            Node::blank(),
            Node::function(self.head(), load),
            Node::blank(),
        ]
    }

    /// The files of the engine, and the additions to the header.
    pub(super) fn engine(
        &self,
        [header, source]: [(&'static str, &'static str); 2],
        machine: Machine,
        instructions: Option<u64>,
        values: BTreeMap<VarId, String>,
        lines: &[Line],
    ) -> Engine {
        let mut sizes: Vec<(&str, String)> =
            self.arrays().into_iter().map(|(name, size)| (name, format!("{size}U"))).collect();
        if self.room.is_program {
            sizes.push(("ROUNDS", format!("{}UL", self.room.rounds)));
        }
        Engine {
            files: files(header, source, machine),
            room: Some(*self.room),
            instructions,
            include: header.0,
            before: macros(self.names, &sizes, self.room.interface),
            declarations: declarations(&self.head()),
            values,
            image: lines.iter().flat_map(|line| line.bytes.iter().copied()).collect(),
            tables: table(self.names, lines),
        }
    }
}

/// The files that are the same for every chart: the common header with which the engines read images, the engine's own, and its source, which contains
/// a virtual machine.
fn files(
    header: (&'static str, &'static str),
    source: (&'static str, &'static str),
    machine: Machine,
) -> Vec<EngineFile> {
    /// The line of a source that the machine replaces.
    const PLACE: &str = "/* The virtual machine. */\n";
    let text = source.1.replacen(PLACE, &c_text(machine), 1);
    vec![
        (FileKind::EngineHeader, "grafsynth_image.h", include_str!("grafsynth_image.h").into()),
        (FileKind::EngineHeader, header.0, header.1.into()),
        (FileKind::EngineSource, source.0, text.into()),
    ]
}
