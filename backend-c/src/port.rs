//! `NAME_port.h`: the machine-dependent parts, and the ring that interrupts write to.

use crate::c::print::Node;
use crate::header::Layout;
use crate::io::INPUT_BITS;
use crate::io::Structure;
use crate::times::Ticks;
use crate::{File, Object};
use grafsynth_ir::net::{InputId, InputKind};
use itertools::Itertools as _;

impl Layout<'_> {
    pub(crate) fn port(&self) -> File {
        let upper = &self.names.upper;
        let nothing = |name: &str| Node::default_macro(&format!("{upper}_{name}"), "((void)0)");
        let mut nodes = vec![
            Node::blank(),
            Node::comment(
                "Critical section around data that interrupts share with the chart: disable interrupts, and restore them.",
            ),
        ];
        nodes.extend(nothing("ENTER_CRITICAL()"));
        nodes.extend(nothing("EXIT_CRITICAL()"));
        nodes.push(Node::blank());
        nodes.push(Node::comment("A state variable has an impossible value: the memory was corrupted. The usual response is a restart."));
        nodes.extend(nothing("BAD_STATE(self)"));
        nodes.push(Node::blank());
        nodes.push(Node::comment("After a whole scan: reset the watchdog timer. If nothing is pending after it: sleep until an interrupt."));
        nodes.extend(nothing("WATCHDOG()"));
        nodes.extend(nothing("IDLE()"));
        nodes.extend([
            Node::blank(),
            Node::comment(
                "The memory of constant tables: flash, on machines where it must be declared.",
            ),
            Node::directive(format!("#ifndef {upper}_ROM")),
            Node::directive(
                "#if defined(__FLASH) && !defined(__STRICT_ANSI__) && !defined(__cplusplus)",
            ),
            Node::directive(format!("#define {upper}_ROM const __flash")),
            Node::directive("#elif defined(__SDCC_mcs51)"),
            Node::directive(format!("#define {upper}_ROM const __code")),
            Node::directive("#else"),
            Node::directive(format!("#define {upper}_ROM const")),
            Node::directive("#endif"),
            Node::directive("#endif"),
            Node::blank(),
            Node::directive(format!("#include \"{}.h\"", self.names.stem)),
            Node::blank(),
        ]);
        self.latch(&mut nodes);
        self.ring(&mut nodes);
        self.scan(&mut nodes);
        self.handover(&mut nodes);
        let what = "the machine-dependent parts. To change a macro, define it before this file is read, or with -D.";
        self.header_file("_port", what, nodes)
    }

    /// Writes the event ring: interrupts add events, and the loop that calls the chart removes them.
    fn ring(&self, nodes: &mut Vec<Node>) {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let events: Vec<InputId> = (self.net.inputs.iter())
            .filter(|(_, input)| input.kind == InputKind::Event)
            .map(|(id, _)| id)
            .collect();
        let Some(last) = events.last() else { return };
        let enumerators = events.iter().map(|id| {
            let comma = if id == last { "" } else { "," };
            Node::line(format!("{upper}_EVENT_{}{comma}", self.names.inputs[*id]))
                .note(self.net.inputs[*id].meta.label.clone())
                .about(Object::Input(*id))
        });
        nodes.extend([
            Node::typedef("enum", enumerators.collect(), format!("{prefix}_event_t")),
            Node::blank(),
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
            Node::comment("The number of entries of a ring, a power of two up to 128."),
        ]);
        nodes.extend(Node::default_macro(&format!("{upper}_RING_SIZE"), "16U"));
        let members = vec![
            Node::line("volatile uint8_t head;").note("the next entry to write"),
            Node::line("volatile uint8_t tail;").note("the next entry to read"),
            Node::line("volatile uint8_t lost;")
                .note("events lost because the ring was full; stays at 255"),
            Node::line(format!("volatile uint8_t events[{upper}_RING_SIZE];")),
        ];
        nodes.extend([
            Node::blank(),
            Node::comment(
                "Events on their way from interrupts to the chart. Zero it before use. One writer and one reader need no lock:\neach index is written by one side only and is a single byte.",
            ),
            Node::typedef("struct", members, format!("{prefix}_ring_t")),
            Node::blank(),
        ]);
        nodes.extend(self.post());
        nodes.extend(self.take(&events));
    }

    /// `NAME_post`: adds an event to the ring.
    fn post(&self) -> [Node; 3] {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let count = Node::line("ring->lost = (uint8_t)(ring->lost + 1U);");
        Node::documented(
            "For interrupts: false when the ring is full; the event is then lost, and counted.",
            format!(
                "static inline bool {prefix}_post({prefix}_ring_t *ring, {prefix}_event_t event)"
            ),
            vec![
                Node::line("const uint8_t head = ring->head;"),
                Node::when(
                    &format!("(uint8_t)(head - ring->tail) >= {upper}_RING_SIZE"),
                    vec![
                        Node::when("ring->lost != 255U", vec![count]),
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
        )
    }

    /// `NAME_take`: moves the oldest event of the ring to the inputs.
    fn take(&self, events: &[InputId]) -> [Node; 3] {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let put = |id: InputId, value: &str| {
            Node::line(self.names.put(Structure::Behind("in"), id, value))
        };
        let cases = events.iter().map(|id| {
            let label = format!("{upper}_EVENT_{}", self.names.inputs[*id]);
            Node::case(label, vec![put(*id, "true")])
        });
        let event = format!("ring->events[tail & ({upper}_RING_SIZE - 1U)]");
        let mut body: Vec<Node> = events.iter().map(|id| put(*id, "false")).collect();
        body.extend([
            Node::line("const uint8_t tail = ring->tail;"),
            Node::when("tail == ring->head", vec![Node::line("return false;")]),
            Node::line(format!("{upper}_BARRIER();")),
            Node::switch(event, cases.collect()),
            Node::line(format!("{upper}_BARRIER();")),
            Node::line("ring->tail = (uint8_t)(tail + 1U);"),
            Node::line("return true;"),
        ]);
        Node::documented(
            "For the loop that calls the chart: puts the oldest event, and no other, into the inputs; false when there was none.",
            format!("static inline bool {prefix}_take({prefix}_ring_t *ring, {prefix}_in_t *in)"),
            body,
        )
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
        nodes.extend(Node::documented(
            "Copies the inputs that interrupts write, all at one moment, except events, which use the ring.",
            format!(
                "static inline void {prefix}_latch({prefix}_in_t *in, const volatile {prefix}_in_t *pins)"
            ),
            body,
        ));
    }

    /// Writes the functions around `step` for a machine with interrupts.
    fn scan(&self, nodes: &mut Vec<Node>) {
        let (prefix, upper) = (&self.names.prefix, &self.names.upper);
        let i = self.interface;
        let has = |kind: InputKind| self.net.inputs.values().any(|input| input.kind == kind);
        let has_ring = has(InputKind::Event);
        let ty = i.ticks.map_or("", Ticks::name);
        // The parameters of both functions, and their names.
        let (parameters, passed): (Vec<String>, Vec<&str>) = [
            (i.has_instance, format!("{prefix}_t *self"), "self"),
            (has_ring, format!("{prefix}_ring_t *ring"), "ring"),
            (has(InputKind::Pin), format!("const volatile {prefix}_in_t *pins"), "pins"),
            (i.ticks.is_some(), format!("{ty} dt"), "dt"),
            (i.has_out, format!("{prefix}_out_t *out"), "out"),
        ]
        .into_iter()
        .filter_map(|(is_there, parameter, name)| is_there.then_some((parameter, name)))
        .unzip();
        let mut body = Vec::new();
        if i.has_in {
            body.push(Node::line(format!("{prefix}_in_t in;")));
        }
        if has(InputKind::Pin) {
            body.push(Node::line(format!("{prefix}_latch(&in, pins);")));
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
        let list = if parameters.is_empty() { "void".to_string() } else { parameters.join(", ") };
        let head = format!("static inline void {prefix}_scan_isr({list})");
        nodes.extend(Node::documented(once, head, body));
        nodes.extend(Node::documented(
            "Runs a scan in the main loop, then resets the watchdog timer, and sleeps if nothing is pending. An interrupt between the check and the sleep would be missed, so both\nare in a critical section.",
            format!("static inline void {prefix}_scan({list})"),
            vec![
                Node::line(format!("{prefix}_scan_isr({});", passed.join(", "))),
                Node::line(format!("{upper}_WATCHDOG();")),
                Node::line(format!("{upper}_ENTER_CRITICAL();")),
                idle,
                Node::line(format!("{upper}_EXIT_CRITICAL();")),
            ],
        ));
    }
}
