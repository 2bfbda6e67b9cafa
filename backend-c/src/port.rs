//! `NAME_port.h`: the machine-dependent parts, and the ring that interrupts write to.

use crate::c::print::{Kind, Node};
use crate::header::Layout;
use crate::io::INPUT_BITS;
use crate::io::Structure;
use crate::{File, FileKind, Object};
use grafsynth_ir::net::InputKind;
use itertools::Itertools as _;

impl Layout<'_> {
    pub(crate) fn port(&self) -> File {
        let upper = &self.names.upper;
        let mut nodes = vec![
            self.banner("the machine-dependent parts. To change a macro, define it before this file is read, or with -D."),
            Node::directive(format!("#ifndef {upper}_PORT_H")),
            Node::directive(format!("#define {upper}_PORT_H")),
            Node::blank(),
            Node::directive("#include <stdbool.h>"),
            Node::directive("#include <stdint.h>"),
            Node::blank(),
            Node::comment("Critical section around data that interrupts share with the chart: disable interrupts, and restore them."),
            Node::directive(format!("#ifndef {upper}_ENTER_CRITICAL")),
            Node::directive(format!("#define {upper}_ENTER_CRITICAL() ((void)0)")),
            Node::directive("#endif"),
            Node::directive(format!("#ifndef {upper}_EXIT_CRITICAL")),
            Node::directive(format!("#define {upper}_EXIT_CRITICAL() ((void)0)")),
            Node::directive("#endif"),
            Node::blank(),
            Node::comment("A state variable has an impossible value: the memory was corrupted. The usual response is a restart."),
            Node::directive(format!("#ifndef {upper}_BAD_STATE")),
            Node::directive(format!("#define {upper}_BAD_STATE(self) ((void)0)")),
            Node::directive("#endif"),
            Node::blank(),
            Node::comment("After a whole scan: reset the watchdog timer. If nothing is pending after it: sleep until an interrupt."),
            Node::directive(format!("#ifndef {upper}_WATCHDOG")),
            Node::directive(format!("#define {upper}_WATCHDOG() ((void)0)")),
            Node::directive("#endif"),
            Node::directive(format!("#ifndef {upper}_IDLE")),
            Node::directive(format!("#define {upper}_IDLE() ((void)0)")),
            Node::directive("#endif"),
            Node::blank(),
            Node::comment("The memory of constant tables: flash, on machines where it must be declared."),
            Node::directive(format!("#ifndef {upper}_ROM")),
            Node::directive("#if defined(__FLASH) && !defined(__STRICT_ANSI__) && !defined(__cplusplus)"),
            Node::directive(format!("#define {upper}_ROM const __flash")),
            Node::directive("#elif defined(__SDCC_mcs51)"),
            Node::directive(format!("#define {upper}_ROM const __code")),
            Node::directive("#else"),
            Node::directive(format!("#define {upper}_ROM const")),
            Node::directive("#endif"),
            Node::directive("#endif"),
            Node::blank(),
        ];
        nodes.push(Node::directive(format!("#include \"{}.h\"", self.names.stem)));
        nodes.push(Node::blank());
        self.latch(&mut nodes);
        self.ring(&mut nodes);
        self.scan(&mut nodes);
        self.handover(&mut nodes);
        nodes.push(Node::directive("#endif"));
        self.file(format!("{}_port.h", self.names.stem), &nodes, FileKind::Header)
    }

    /// Writes the event ring: interrupts add events, and the loop that calls the chart removes them.
    fn ring(&self, nodes: &mut Vec<Node>) {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let events: Vec<_> =
            self.net.inputs.iter().filter(|(_, input)| input.kind == InputKind::Event).collect();
        if events.is_empty() {
            return;
        }
        let mut body: Vec<Node> = Vec::new();
        for (position, (id, input)) in events.iter().enumerate() {
            let comma = if position + 1 == events.len() { "" } else { "," };
            body.push(
                Node::line(format!("{upper}_EVENT_{}{comma}", self.names.inputs[*id]))
                    .note(input.meta.label.clone())
                    .about(Object::Input(*id)),
            );
        }
        nodes.push(
            Kind::Braces("typedef enum".to_string(), body, format!(" {prefix}_event_t;")).into(),
        );
        nodes.push(Node::blank());
        nodes.extend([
            Node::comment(
                "Memory barrier between writing an event and writing the index that publishes it.",
            ),
            Node::directive(format!("#ifndef {upper}_BARRIER")),
            Node::directive("#if defined(__AVR__)"),
            Node::directive(format!(
                "#define {upper}_BARRIER() __asm__ volatile(\"\" ::: \"memory\")"
            )),
            Node::directive("#elif defined(__GNUC__)"),
            Node::directive(format!("#define {upper}_BARRIER() __sync_synchronize()")),
            Node::directive("#else"),
            Node::directive(format!("#define {upper}_BARRIER() ((void)0)")),
            Node::directive("#endif"),
            Node::directive("#endif"),
            Node::blank(),
        ]);
        nodes.push(Node::comment("The number of entries of a ring, a power of two up to 128."));
        nodes.push(Node::directive(format!("#ifndef {upper}_RING_SIZE")));
        nodes.push(Node::directive(format!("#define {upper}_RING_SIZE 16U")));
        nodes.push(Node::directive("#endif"));
        nodes.push(Node::blank());
        nodes.push(Node::comment(
            "Events on their way from interrupts to the chart. Zero it before use. One writer and one reader need no lock:\neach index is written by one side only and is a single byte.",
        ));
        nodes.push(
            Kind::Braces(
                "typedef struct".to_string(),
                vec![
                    Node::line("volatile uint8_t head;").note("the next entry to write"),
                    Node::line("volatile uint8_t tail;").note("the next entry to read"),
                    Node::line("volatile uint8_t lost;")
                        .note("events lost because the ring was full; stays at 255"),
                    Node::line(format!("volatile uint8_t events[{upper}_RING_SIZE];")),
                ],
                format!(" {prefix}_ring_t;"),
            )
            .into(),
        );
        nodes.push(Node::blank());
        nodes.push(Node::comment(
            "For interrupts: false when the ring is full; the event is then lost, and counted.",
        ));
        nodes.push(Node::function(
            format!(
                "static inline bool {prefix}_post({prefix}_ring_t *ring, {prefix}_event_t event)"
            ),
            vec![
                Node::line("const uint8_t head = ring->head;"),
                Node::when(
                    &format!("(uint8_t)(head - ring->tail) >= {upper}_RING_SIZE"),
                    vec![
                        Node::when(
                            "ring->lost != 255U",
                            vec![Node::line("ring->lost = (uint8_t)(ring->lost + 1U);")],
                        ),
                        Node::line("return false;"),
                    ],
                ),
                Node::line(format!(
                    "ring->events[head & ({upper}_RING_SIZE - 1U)] = (uint8_t)event;"
                )),
                Node::line(format!("{upper}_BARRIER();")),
                Node::line("ring->head = (uint8_t)(head + 1U);"),
                Node::line("return true;"),
            ],
        ));
        nodes.push(Node::blank());
        let mut cases: Vec<Node> = Vec::new();
        for (id, _) in &events {
            let name = &self.names.inputs[*id];
            let case = Kind::Case(
                vec![format!("case {upper}_EVENT_{name}:")],
                vec![
                    Node::line(self.names.io.put(Structure::Behind("in"), name, *id, "true")),
                    Node::line("break;"),
                ],
            );
            cases.push(case.into());
        }
        cases.push(Kind::Case(vec!["default:".to_string()], vec![Node::line("break;")]).into());
        let mut take: Vec<Node> = events
            .iter()
            .map(|(id, _)| {
                Node::line(self.names.io.put(
                    Structure::Behind("in"),
                    &self.names.inputs[*id],
                    *id,
                    "false",
                ))
            })
            .collect();
        take.extend([
            Node::line("const uint8_t tail = ring->tail;"),
            Node::when("tail == ring->head", vec![Node::line("return false;")]),
            Node::line(format!("{upper}_BARRIER();")),
            Node::block(format!("switch (ring->events[tail & ({upper}_RING_SIZE - 1U)])"), cases),
            Node::line(format!("{upper}_BARRIER();")),
            Node::line("ring->tail = (uint8_t)(tail + 1U);"),
            Node::line("return true;"),
        ]);
        nodes.push(Node::comment(
            "For the loop that calls the chart: puts the oldest event, and no other, into the inputs; false when there was none.",
        ));
        nodes.push(Node::function(
            format!("static inline bool {prefix}_take({prefix}_ring_t *ring, {prefix}_in_t *in)"),
            take,
        ));
        nodes.push(Node::blank());
    }

    /// Writes the function that copies, in one critical section, all inputs that interrupts write.
    fn latch(&self, nodes: &mut Vec<Node>) {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let pins: Vec<_> =
            self.net.inputs.iter().filter(|(_, input)| input.kind == InputKind::Pin).collect();
        if pins.is_empty() {
            return;
        }
        let mut body = vec![Node::line(format!("{upper}_ENTER_CRITICAL();"))];
        // The bits of pins in each byte; the other bits of the byte are events.
        let mut masks = vec![0_u8; self.names.io.input_words()];
        for (id, _) in &pins {
            match self.names.io.input_bit(*id) {
                Some(bit) => masks[bit / INPUT_BITS] |= 1 << (bit % INPUT_BITS),
                None => {
                    let name = &self.names.inputs[*id];
                    let line = Node::line(format!("in->{name} = pins->{name};"));
                    body.push(line.about(Object::Input(*id)));
                }
            }
        }
        for (byte, mask) in masks.iter().enumerate().filter(|(_, mask)| **mask != 0) {
            let (to, from) = (format!("in->bits[{byte}]"), format!("pins->bits[{byte}]"));
            let used = self.names.io.used_bits(byte);
            body.push(Node::line(if *mask == used {
                format!("{to} = {from};")
            } else {
                let events = used & !mask;
                format!("{to} = (uint8_t)(({to} & 0x{events:02x}U) | ({from} & 0x{mask:02x}U));")
            }));
        }
        body.push(Node::line(format!("{upper}_EXIT_CRITICAL();")));
        nodes.push(Node::comment(
            "Copies the inputs that interrupts write, all at one moment, except events, which use the ring.",
        ));
        nodes.push(Node::function(
            format!(
                "static inline void {prefix}_latch({prefix}_in_t *in, const volatile {prefix}_in_t *pins)"
            ),
            body,
        ));
        nodes.push(Node::blank());
    }

    /// Writes the functions around `step` for a machine with interrupts.
    fn scan(&self, nodes: &mut Vec<Node>) {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let i = self.interface;
        let has = |kind: InputKind| self.net.inputs.values().any(|input| input.kind == kind);
        let has_ring = has(InputKind::Event);
        let mut parameters = Vec::new();
        if i.has_instance {
            parameters.push(format!("{prefix}_t *self"));
        }
        if has_ring {
            parameters.push(format!("{prefix}_ring_t *ring"));
        }
        let mut body = Vec::new();
        if i.has_in {
            body.push(Node::line(format!("{prefix}_in_t in;")));
        }
        if has(InputKind::Pin) {
            parameters.push(format!("const volatile {prefix}_in_t *pins"));
            body.push(Node::line(format!("{prefix}_latch(&in, pins);")));
        }
        if let Some(ticks) = i.ticks {
            parameters.push(format!("{} dt", ticks.name()));
        }
        if i.has_out {
            parameters.push(format!("{prefix}_out_t *out"));
        }
        let step = |dt: &str| {
            let arguments = [
                (i.has_instance, "self"),
                (i.has_in, "&in"),
                (i.ticks.is_some(), dt),
                (i.has_out, "out"),
            ]
            .into_iter()
            .filter_map(|(is_there, argument)| is_there.then_some(argument))
            .join(", ");
            Node::line(format!("{prefix}_step({arguments});"))
        };
        let (once, idle) = if has_ring {
            body.extend([
                Node::line(format!("bool more = {prefix}_take(ring, &in);")),
                step("dt"),
                Node::block(
                    format!("for (uint8_t i = 1U; more && (i < {upper}_RING_SIZE); ++i)"),
                    vec![
                        Node::line(format!("more = {prefix}_take(ring, &in);")),
                        Node::when("more", vec![step("0U")]),
                    ],
                ),
            ]);
            let sleep = vec![Node::line(format!("{upper}_IDLE();"))];
            (
                "A scan, also for a timer interrupt: latches inputs once and runs a reaction for each pending event, at least one and at most the size of the ring.",
                Node::when("ring->head == ring->tail", sleep),
            )
        } else {
            body.push(step("dt"));
            (
                "A scan, also for a timer interrupt: latches inputs once and runs a reaction.",
                Node::line(format!("{upper}_IDLE();")),
            )
        };
        nodes.push(Node::comment(once));
        let list = if parameters.is_empty() { "void".to_string() } else { parameters.join(", ") };
        nodes.push(Node::function(format!("static inline void {prefix}_scan_isr({list})"), body));
        nodes.push(Node::blank());
        let arguments = [
            (i.has_instance, "self"),
            (has_ring, "ring"),
            (has(InputKind::Pin), "pins"),
            (i.ticks.is_some(), "dt"),
            (i.has_out, "out"),
        ]
        .into_iter()
        .filter_map(|(is_there, argument)| is_there.then_some(argument))
        .join(", ");
        nodes.push(Node::comment(
            "Runs a scan in the main loop, then resets the watchdog timer, and sleeps if nothing is pending. An interrupt between the check and the sleep would be missed, so both\nare in a critical section.",
        ));
        nodes.push(Node::function(
            format!("static inline void {prefix}_scan({list})"),
            vec![
                Node::line(format!("{prefix}_scan_isr({arguments});")),
                Node::line(format!("{upper}_WATCHDOG();")),
                Node::line(format!("{upper}_ENTER_CRITICAL();")),
                idle,
                Node::line(format!("{upper}_EXIT_CRITICAL();")),
            ],
        ));
        nodes.push(Node::blank());
    }
}
