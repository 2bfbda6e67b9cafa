//! Texts as written by other people.

use crate::{Dialect, codes, read};
use grafsynth_ir::logic::Logic;
use grafsynth_ir::span::FileId;
use grafsynth_logic::sim::LogicSim;

fn accepted(dialect: Dialect, text: &str) -> Logic {
    let (logic, findings) = read(dialect, FileId(0), text);
    assert_eq!(findings, []);
    logic.unwrap()
}

/// The codes and lines (from 1) of all findings.
fn findings(dialect: Dialect, text: &str) -> Vec<(&'static str, usize)> {
    let (_, findings) = read(dialect, FileId(0), text);
    let line = |at: u32| text[..at as usize].matches('\n').count() + 1;
    findings.iter().map(|finding| (finding.code.id, line(finding.labels[0].span.start))).collect()
}

fn output(logic: &Logic, name: &str, inputs: &[(&str, bool)]) -> bool {
    let mut sim = LogicSim::new(logic);
    for (name, value) in inputs {
        let pin =
            logic.inputs.iter().find(|(_, input)| input.name == *name).map(|(id, _)| id).unwrap();
        sim.set_input(pin, u64::from(*value));
    }
    let pin =
        logic.outputs.iter().find(|(_, output)| output.name == name).map(|(id, _)| id).unwrap();
    sim.output(pin) & 1 == 1
}

#[test]
fn palasm_with_a_list_of_pins() {
    let logic = accepted(
        Dialect::Palasm,
        "Title   DECODER          ; free text: * + / here\r\nPattern 1\r\nAuthor  somebody\r\n\r\nCHIP DEC PAL16R4-7\r\n\
         ;1   2  3  4  5  6  7  8  9  10\r\n CLK  A  B  /C NC NC NC NC NC GND\r\n /OE NC NC Q0 Q1 NC NC Y /Z VCC\r\n\r\n\
         STRING BOTH 'A * B'\r\nEQUATIONS\r\n\
         Y = BOTH * C            ; a string and an inverted pin\r\n  + /A\r\n  */B\r\n\
         /Z = (A + B) :+: C\r\n\
         Q0 := /Q0\r\n/Q1 := Q0 * A\r\nQ0.TRST = VCC\r\nY.TRST=VCC\r\n\r\nSIMULATION\r\nSETF A /B\r\nwhatever follows ((( is not read\r\n",
    );
    let names: Vec<&str> = logic.inputs.values().map(|input| input.name.as_str()).collect();
    assert_eq!(names, ["A", "B", "C", "OE"], "the clock is not an input");
    for bits in 0..8u8 {
        let (a, b, c) = (bits & 1 == 1, bits & 2 == 2, bits & 4 == 4);
        let pins = [("A", a), ("B", b), ("C", c)];
        // C and Z are the complements of their pins.
        assert_eq!(output(&logic, "Y", &pins), a && b && !c || !a && !b);
        assert_eq!(output(&logic, "Z", &pins), (a || b) == c);
    }
    // Pins of a 16R4 are high after power-up, whatever the polarity of the equation.
    assert!(logic.flops.values().all(|flop| flop.init));
}

#[test]
fn palasm_errors_come_all_at_once() {
    let text = "CHIP x PAL22V10\nPIN 1 clk\nPIN 2 a\nPIN 2 b\nPIN 99 c\nPIN 14 q REGISTERED\nPIN 15 y\nEQUATIONS\nq := a +\ny = a * nobody\n\
                a = b\ny = b\nq.JKF = a\n = b\n";
    let mut found = findings(Dialect::Palasm, text);
    found.sort_unstable_by_key(|entry| entry.1);
    let lines: Vec<usize> = found.iter().map(|entry| entry.1).collect();
    assert_eq!(lines, [4, 5, 10, 10, 11, 12, 13, 14], "{found:?}");
    assert!(found.contains(&("G0721", 10)), "{found:?}");
}

#[test]
fn galasm_errors_name_what_the_device_lacks() {
    let chip = |device: &str, rows: &str, equations: &str| {
        format!("{device}\nSIG\n\n{rows}\n\n{equations}\n")
    };
    let rows = "Clock I0 I1 I2 I3 I4 I5 NC NC GND\n/OE O0 O1 O2 O3 O4 NC NC NC VCC";
    let v8 = |equations: &str| findings(Dialect::Galasm, &chip("GAL16V8", rows, equations));
    assert_eq!(v8("O0 = I0 * I1\n/O4 = I0 + I1"), []);
    assert_eq!(v8("O0 = I0 *\n   I1\n  + /I2"), []);
    assert_eq!(v8("O0.R = I0 + Clock"), [("G0726", 7), ("G0724", 4)]);
    assert_eq!(v8("O0 = GND + I1"), [("G0726", 7)]);
    assert_eq!(v8("O0 = /VCC"), [("G0726", 7)]);
    assert_eq!(v8("O0.CLK = I0\nO0 = I1"), [("G0726", 7)]);
    assert_eq!(v8("O0 = I0\nO0.E = I1"), [("G0726", 7)]);
    assert_eq!(v8("O0.T = I0\n/O0.E = I1"), [("G0726", 8), ("G0725", 8)]);
    assert_eq!(v8("O0.UNK = I0"), [("G0720", 7)]);
    assert_eq!(v8("I0 = I1"), [("G0726", 7)]);
    assert_eq!(v8("O0 = I0\nO0.T = I1"), [("G0722", 8)]);
    assert_eq!(
        v8("O0 = I0 + I1 + I2 + I3 + I4 + I5 + /I0 + /I1\nO1 = O0"),
        [("G0726", 8), ("G0726", 7)]
    );
    assert_eq!(v8("O0 = Io"), [("G0721", 7)]);
    assert_eq!(v8("O0 = I4 * /I5 *\n   + /I4\nO1 = I0"), [("G0720", 8)]);
    assert_eq!(findings(Dialect::Galasm, "GAL16V9\nSIG\n"), [("G0712", 1)]);
    assert_eq!(
        findings(Dialect::Galasm, &chip("GAL16V8", "Clock I0 / GND\nNC VCC", "O0 = I0")),
        [("G0720", 4), ("G0726", 4), ("G0726", 4)]
    );
    let ra = "/PL I0 I1 I2 I3 I4 I5 I6 I7 I8 Clock GND\n/OE O0 O1 O2 O3 O4 O5 O6 O7 NC NC VCC";
    let ra = |equations: &str| findings(Dialect::Galasm, &chip("GAL20RA10", ra, equations));
    assert_eq!(ra("O0.R = I0\nO0.CLK = Clock"), []);
    assert_eq!(ra("O0.R = I0"), [("G0726", 7)]);
    assert_eq!(ra("O1 = I0\nO1.ARST = I1"), [("G0726", 8)]);
    assert_eq!(ra("O0.R = I0\nO0.CLK = Clock\nO1.R = I1\nO1.CLK = I2"), [("G0724", 10)]);
    let v10 = "clk I0 I1 I2 I3 I4 NC I5 I6 I7 I8 GND\n/OE O0 O1 O2 O3 O4 NC O5 O6 O7 NC VCC";
    let v10 = |equations: &str| findings(Dialect::Galasm, &chip("GAL22V10", v10, equations));
    assert_eq!(v10("O0.R = I0\nSP = I1"), []);
    assert_eq!(v10("O0.R = I0\nAR = I1"), [("G0725", 8)]);
    assert_eq!(v10("O0.R = I0\nSP = I1 + I2"), [("G0726", 8)]);
    assert_eq!(v10("O0.R = I0\n/SP = I1"), [("G0726", 8)]);
    assert_eq!(v10("O0.R = I0\nSP.R = I1"), [("G0720", 8)]);
    assert_eq!(v10("O0 = I0 + AR"), [("G0721", 7)]);
}

#[test]
fn inverted_pins_and_inverted_equations_are_two_ways_to_say_one_thing() {
    let rows = |a: &str, b: &str| {
        format!(
            "GAL22V10\nInv\nclk A B NC NC NC NC NC NC NC NC GND\n/CS {a} {b} NC NC NC NC NC NC NC NC VCC\n"
        )
    };
    let plain = accepted(Dialect::Galasm, &format!("{}/P.R = A * B\n/Q.R = /P\n", rows("Q", "P")));
    let turned = accepted(Dialect::Galasm, &format!("{}P.R = A * B\n/Q.R = P\n", rows("Q", "/P")));
    // P of the second text is the complement of its pin; both read the level at the pin.
    let (mut x, mut y) = (LogicSim::new(&plain), LogicSim::new(&turned));
    let flop = |logic: &Logic, name: &str| {
        logic.flops.iter().find(|(_, flop)| flop.name == name).map(|(id, _)| id).unwrap()
    };
    for row in 0..4u64 {
        for pin in plain.inputs.ids().take(2) {
            x.set_input(pin, row >> pin.index() & 1);
            y.set_input(pin, row >> pin.index() & 1);
        }
        let shown = |sim: &LogicSim<'_>, name| sim.flop(flop(sim.logic(), name)) & 1;
        assert_eq!(shown(&x, "Q"), shown(&y, "Q"));
        assert_eq!(shown(&x, "P"), shown(&y, "P"));
        x.clock();
        y.clock();
    }
}

#[test]
fn cupl_as_wincupl_users_write_it() {
    let logic = accepted(
        Dialect::Cupl,
        "Name     Demo ;\nPartNo   00 ;\nDate     25.06.2011 ;\nRevision 01 ;\nDesigner Engineer ;\nCompany  None ;\nAssembly None ;\nLocation None ;\n\
         Device   g22v10 ;\n/* inputs */\nPin 1 = clk ;\nPIN [2..4] = [a,b,c] ;\nPIN 5 = !d;\n/* outputs */\nPIN 14 = x ;\nPIN 15 = !y ;\nPIN 16 = z;\n\
         both = a & b ;\nx = both # !c $ d ;\n!y.d = both & !y ;\ny.ar = 'b'0 ;\ny.sp = 'b'0 ;\nz = 'b'1 ;\n",
    );
    for bits in 0..16u8 {
        let (a, b, c, d) = (bits & 1 == 1, bits & 2 == 2, bits & 4 == 4, bits & 8 == 8);
        let pins = [("a", a), ("b", b), ("c", c), ("d", d)];
        assert_eq!(output(&logic, "x", &pins), (a && b || !c) == d);
        assert!(output(&logic, "z", &pins));
    }
    assert_eq!(logic.flops.len(), 1);
    let found = findings(
        Dialect::Cupl,
        "Device g22v10;\nPIN 1 = clk\nPIN 2 = a;\nPIN 14 = x;\nx = a &;\nx.j = a;\nFIELD f = [a];\n",
    );
    let codes: Vec<&str> = found.iter().map(|entry| entry.0).collect();
    assert_eq!(codes, ["G0720", "G0720", "G0724", "G0721"], "{found:?}");
}

#[test]
fn verilog_with_ports_below_and_conditions() {
    let logic = accepted(
        Dialect::Verilog,
        "`timescale 1ns/1ps\n(* keep *) module m(clk, a, b, q, y);\n input clk, a, b; output q, y; reg q; /* a\n comment */ wire n = ~a ^ b, o;\n\
         assign o = a ? b : n ? 1'b1 : 1'h0, y = !(o || a && b);\n initial begin q = 1'b1; end\n\
         always @(posedge clk) begin\n  if (a) q <= b;\n  else if (b) begin q <= ~q; end\n end\nendmodule\n",
    );
    assert_eq!(logic.flops.len(), 1);
    for bits in 0..4u8 {
        let (a, b) = (bits & 1 == 1, bits & 2 == 2);
        let n = a == b;
        let o = if a { b } else { n };
        assert_eq!(output(&logic, "y", &[("a", a), ("b", b)]), !(o || a && b));
        let mut sim = LogicSim::new(&logic);
        for (pin, value) in logic.inputs.ids().zip([a, b]) {
            sim.set_input(pin, u64::from(value));
        }
        let flop = logic.flops.ids().next().unwrap();
        assert_eq!(sim.flop(flop) & 1, 1);
        sim.clock();
        assert_eq!(sim.flop(flop) & 1 == 1, if a { b } else { !b });
    }
    let found = findings(
        Dialect::Verilog,
        "module m(input wire a, output wire y);\n wire [3:0] v;\n assign y = a +;\n assign z = a;\n always @(negedge a) y <= a;\n foo bar(a);\nendmodule\n",
    );
    let codes: Vec<&str> = found.iter().map(|entry| entry.0).collect();
    assert_eq!(codes, ["G0724", "G0720", "G0724", "G0724", "G0721"], "{found:?}");
}

#[test]
fn blif_with_joined_lines_and_both_kinds_of_rows() {
    let logic = accepted(
        Dialect::Blif,
        "# made by hand\n.model m\n.inputs a \\\n b clk\n.outputs x y\n.names a b x # and\n11 1\n.names a b n\n00 0\n.names n q y\n1- 1\n-1 1\n\
         .latch n q re clk 1\n.latch q r re clk 0\n.end\n",
    );
    assert_eq!(logic.inputs.len(), 2, "the clock is not an input");
    for bits in 0..4u8 {
        let (a, b) = (bits & 1 == 1, bits & 2 == 2);
        assert_eq!(output(&logic, "x", &[("a", a), ("b", b)]), a && b);
    }
    assert_eq!(logic.flops.values().map(|flop| flop.init).collect::<Vec<_>>(), [true, false]);
    let found = findings(
        Dialect::Blif,
        ".model m\n.inputs a\n.outputs x\n.names a x\n2 1\n11 1\n0 2\n.gate and2 a=b\n.latch\n01\n.end\n",
    );
    assert_eq!(
        found.iter().map(|entry| entry.1).collect::<Vec<_>>(),
        [5, 6, 7, 8, 9, 10],
        "{found:?}"
    );
    assert!(found.contains(&(codes::UNSUPPORTED.id, 8)));
}

#[test]
fn palasm_of_the_first_version() {
    let text = "PAL16L8            PAL DESIGN SPECIFICATION\nP7001              SOMEBODY 11/2/86\nDECODER OF SOMETHING (A*B): IF NOT\nA FIRM\n\n\
         A B C D E F G H I GND\nJ O1 P2 P3 P4 P5 P6 P7 O8 VCC\n\n\
         IF (VCC) /O1 = A*/B + C   ; always\n  + D\nIF (/E) /P2 = A * P3\n/P4 = /A\n\nFUNCTION TABLE\nA B ((( whatever\nDESCRIPTION\nmore = ((\n";
    let said = crate::read_text(Dialect::Palasm, FileId(0), text);
    assert_eq!(said.findings, []);
    assert_eq!(said.beyond.len(), 1, "the enable of P2 is not part of the circuit");
    let placement = said.placement.expect("macrocells");
    assert_eq!((placement.device.palasm, placement.cells.len()), ("PAL16L8", 3));
    let cell = |name: &str| {
        let pin = placement.pins.iter().find(|pin| pin.name == name).expect("a pin").pin;
        placement.cell(pin).expect("a macrocell").clone()
    };
    assert_eq!(cell("O1").sum.len(), 3);
    assert!(cell("O1").is_active_low && cell("O1").enable.is_none());
    assert_eq!(cell("P2").enable.map(|product| product.0), Some(vec![(5, false)]));
    let found = findings(
        Dialect::Palasm,
        "PAL16L8\nX\nY\nZ\nA B C D E F G H I GND\nJ O1 P2 P3 P4 P5 P6 P7 O8 VCC\nIF A /O1 = B\nIF (A /P2 = B\n/O8 := A +\n",
    );
    assert_eq!(found.iter().map(|one| one.1).collect::<Vec<_>>(), [7, 8, 10], "{found:?}");
}

#[test]
fn palasm_names_the_set_and_reset_of_a_22v10() {
    let list = "CHIP C PAL22V10\nCK A B NC NC NC NC NC NC NC NC GND NC Q0 Q1 NC NC NC NC NC NC NC NC VCC ALL\n";
    let equations =
        "EQUATIONS\nQ0 := A\n/Q1 := B + Q0\nALL.RSTF = A * B\nALL.SETF = /A\nQ1.TRST = B\n";
    let said = crate::read_text(Dialect::Palasm, FileId(0), &format!("{list}{equations}"));
    assert_eq!(said.findings, []);
    let placement = said.placement.expect("macrocells");
    assert_eq!(placement.async_reset.map(|product| product.0), Some(vec![(2, true), (3, true)]));
    assert_eq!(placement.sync_preset.map(|product| product.0), Some(vec![(2, false)]));
    assert_eq!(
        placement.cells[1].enable.as_ref().map(|product| product.0.clone()),
        Some(vec![(3, true)])
    );
    let pins = "CHIP C PAL22V10\nPIN 1 CK\nPIN 2 A\nPIN 3 B\nPIN 14 Q0\nPIN 15 Q1\nNODE 1 ALL\n";
    let other = crate::read_text(Dialect::Palasm, FileId(0), &format!("{pins}{equations}"));
    assert_eq!(other.placement.expect("macrocells").cells, placement.cells);
}

#[test]
fn cupl_fields_lists_and_appended_sums() {
    let text = "Name x; Device g22v10;\nPIN 1 = clk; PIN [2..5] = [a3..0]; PIN 6 = !en;\nPIN [14..17] = [y3..0]; PIN 18 = hit; PIN 19 = any; PIN 20 = odd; PIN 21 = !q;\n\
         FIELD addr = [a3..a0]; FIELD out = [y3..0];\n$DEFINE BOTH a3 & a2\n\
         hit = addr:[4..6] & en # addr:'b'1X01;\nany = addr:#; odd = [a3,a2,a1,a0]:$;\n\
         out = addr & en $ !addr & !en;\nq.d = BOTH; APPEND q.d = a0 & q.dfb; q.ar = 'b'0; q.sp = a1;\nMIN hit = 2;\n";
    let (logic, found) = read(Dialect::Cupl, FileId(0), text);
    let codes: Vec<&str> = found.iter().map(|finding| finding.code.id).collect();
    assert_eq!(codes, ["G0725"], "{found:?}");
    let logic = logic.expect("a circuit");
    for bits in 0..32u8 {
        let bit = |at: u8| bits >> at & 1 == 1;
        let pins = [("a0", bit(0)), ("a1", bit(1)), ("a2", bit(2)), ("a3", bit(3)), ("en", bit(4))];
        let address = bits & 15;
        // `en` is the complement of its pin.
        let hit = (4..=6).contains(&address) && !bit(4) || address & 0b1011 == 0b1001;
        assert_eq!(output(&logic, "hit", &pins), hit, "{bits:b}");
        assert_eq!(output(&logic, "any", &pins), address != 0);
        assert_eq!(output(&logic, "odd", &pins), address.count_ones() % 2 == 1);
        for at in 0..4 {
            assert_eq!(output(&logic, &format!("y{at}"), &pins), bit(at) != bit(4), "{bits:b}");
        }
    }
    let said = crate::read_text(Dialect::Cupl, FileId(0), text);
    let placement = said.placement.expect("macrocells");
    let hit = placement.cell(18).expect("hit");
    // `10X` and `110` with `en`, and one of three literals.
    assert_eq!(hit.sum.len(), 3, "{hit:?}");
    assert_eq!(placement.cell(21).expect("q").sum.len(), 2);
    let bad = "Device g22v10;\nPIN 2 = a; PIN 14 = y;\nFIELD f = [a, nobody..2];\ny = f:'h'F;\n[y, a] = [a, a, a];\nSEQUENCE f { PRESENT 0 NEXT 1; }\n\
               $IFDEF X\ny = a:'b'12;\ny.t = a;\nAPPEND !y = a;\n";
    let found = findings(Dialect::Cupl, bad);
    assert_eq!(
        found.iter().map(|one| one.1).collect::<std::collections::BTreeSet<_>>(),
        [3, 4, 5, 6, 7, 8, 9].into(),
        "{found:?}"
    );
}

/// The output `y` of a CUPL text over the pins `A15..A8` for an address.
fn decoded(statements: &str, address: u16) -> bool {
    let text = format!("Device g22v10;\nPIN [2..9] = [A15..A8];\nPIN 14 = y;\n{statements}\n");
    let (logic, _) = read(Dialect::Cupl, FileId(0), &text);
    let logic = logic.expect("a circuit");
    let names: Vec<String> = (8..16).map(|at| format!("A{at}")).collect();
    let pins: Vec<(&str, bool)> =
        (8..16).zip(&names).map(|(at, name)| (name.as_str(), address >> at & 1 == 1)).collect();
    output(&logic, "y", &pins)
}

#[test]
fn the_bit_number_of_a_signal_is_the_index_in_its_name() {
    let field = "FIELD page = [A15..A8];";
    let backwards = "FIELD page = [A8..A15];";
    let high = "FIELD page = [A15..A12];";
    let gap = "FIELD page = [A15, A12..A10];";
    for block in 0..=0xFF_u16 {
        let address = block << 8;
        let within = |low: u16, high: u16| low <= address | 0xFF && address <= high;
        for field in [field, backwards] {
            let of = |test: &str| decoded(&format!("{field} y = page:{test};"), address);
            assert_eq!(of("[8000..FFFF]"), address >= 0x8000);
            assert_eq!(of("[0000..7EFF]"), address <= 0x7EFF, "{address:x}");
            assert_eq!(of("[1300..C4FF]"), within(0x1300, 0xC4FF), "{address:x}");
            // A block that overlaps the range counts as inside.
            assert_eq!(of("[1380..C47F]"), within(0x1380, 0xC47F), "{address:x}");
            assert_eq!(of("A3XX"), block == 0xA3);
            assert_eq!(of("'b'1X10000000000000"), block & 0xBF == 0xA0, "{address:x}");
            assert_eq!(of("[0100..01FF, FF00]"), block == 1 || block == 0xFF);
        }
        // Bits 11 to 0 are not part of the field, so a small number is a zero.
        let of = |test: &str| decoded(&format!("{high} y = page:{test};"), address);
        assert_eq!(of("[8..F]"), address >> 12 == 0);
        assert_eq!(of("[8000..FFFF]"), address >= 0x8000);
        assert_eq!(of("6000"), address >> 12 == 6);
        let of = |test: &str| decoded(&format!("{gap} y = page:{test};"), address);
        // Bits 14 and 13 are free.
        let is_met = |low: u16, high: u16| {
            (0..4).any(|free: u16| {
                let address = address & 0x9C00 | free << 13;
                (low..=high).any(|one| one & 0xFC00 == address & 0xFC00)
            })
        };
        assert_eq!(of("[3000..8BFF]"), is_met(0x3000, 0x8BFF), "{address:x}");
    }
}

#[test]
fn a_range_is_as_short_as_it_can_be_written() {
    let text = "Device g22v10;\nPIN [2..9] = [A15..A8]; PIN 14 = a; PIN 15 = b; PIN 16 = c;\n\
        FIELD f = [A15..A8];\na = f:[0000..7FFF]; b = f:[0000..7EFF]; c = f:[0100..01FF];\n";
    let placement = crate::read_text(Dialect::Cupl, FileId(0), text).placement.expect("cells");
    let n_terms = |pin| placement.cell(pin).map(|cell| cell.sum.len());
    assert_eq!([14, 15, 16].map(n_terms), [Some(1), Some(7), Some(1)]);
}

#[test]
fn fields_whose_bits_have_no_clear_numbers_are_refused() {
    let codes = |statements: &str| {
        let text = format!(
            "Device g22v10;\nPIN [2..5] = [A0..A3]; PIN [6..9] = [B0..B3]; PIN 10 = en; PIN 11 = wr;\n\
             PIN [14..17] = [Y0..Y3]; PIN 18 = z;\n{statements}\n"
        );
        findings(Dialect::Cupl, &text).iter().map(|found| found.0).collect::<Vec<_>>()
    };
    assert_eq!(codes("FIELD f = [A0, B0]; z = en;"), ["G0724"]);
    assert_eq!(codes("FIELD f = [A1, en]; z = A0;"), ["G0724"]);
    assert_eq!(codes("FIELD f = [en, wr]; z = f:1;"), [] as [&str; 0]);
    assert_eq!(codes("FIELD f = [A3..A0]; z = f:1;"), [] as [&str; 0]);
    assert_eq!(codes("FIELD f = [A3..A0]; z = f:1F;"), ["G0725"]);
    assert_eq!(codes("FIELD f = [A3..A2]; z = f:[0..4];"), ["G0725"]);
    assert_eq!(codes("FIELD f = [en, wr]; z = f:4;"), ["G0720"]);
    // A list in brackets has an order and indices; if they differ, the meaning is ambiguous.
    assert_eq!(codes("z = [A3..A0]:5;"), [] as [&str; 0]);
    assert_eq!(codes("z = [A0..A3]:5;"), ["G0724"]);
    assert_eq!(codes("z = A3:1;"), ["G0724"]);
    // A field is assigned to a field by index; a list is assigned to a list by position.
    assert_eq!(
        codes("FIELD a = [A0..A3]; FIELD y = [Y3..Y0]; y = a & [B3..B0]; z = en;"),
        [] as [&str; 0]
    );
    assert_eq!(
        codes("FIELD a = [A0..A3]; FIELD y = [Y3..Y0]; y = a & [B0..B3]; z = en;"),
        ["G0724"]
    );
    assert_eq!(codes("[Y0..Y3] = [A3..A0]; z = en;"), [] as [&str; 0]);
    assert_eq!(codes("FIELD a = [A3..A0]; [Y0..Y3] = a; z = en;"), ["G0724"]);
}

#[test]
fn numbers_have_names_and_letter_case_matters() {
    let of = |address| {
        decoded(
            "$DEFINE ROM 'h'A000\n$DEFINE LAST 'h'BFFF\n$DEFINE ON 'b'1\nFIELD f = [A15..A8];\nY = f:[ROM..LAST];\ny = Y & ON;",
            address,
        )
    };
    assert!(of(0xA000) && of(0xBF00) && !of(0xC000) && !of(0x9F00));
}

#[test]
fn mnemonics_say_what_the_device_can_do() {
    let codes = |device: &str, statements: &str| {
        let text = format!(
            "Device {device};\nPIN 1 = clk; PIN 2 = a; PIN 4 = b; PIN 14 = y;\n{statements}\n"
        );
        findings(Dialect::Cupl, &text).iter().map(|found| found.0).collect::<Vec<_>>()
    };
    for device in ["g16v8", "G16V8AS", "g16v8ma", "g16v8s", "g20v8as", "g22lv10", "g20ra10"] {
        if device != "g20v8as" && device != "g20ra10" {
            assert_eq!(codes(device, "y = a & b;"), [] as [&str; 0], "{device}");
        }
        assert!(crate::device::Device::find(device).is_some());
    }
    assert_eq!(codes("g16v8as", "y.d = a;"), ["G0726"]);
    assert_eq!(codes("g16v8ms", "y.d = a;"), [] as [&str; 0]);
    // `cp`: pin 4 powers the device down.
    assert_eq!(codes("g22v10cp", "y.d = a;"), ["G0725"]);
    assert_eq!(codes("g22v10cp", "y.d = a & b;"), ["G0726"]);
}

#[test]
fn galasm_may_say_more_behind_the_device() {
    let text = "GAL16V8  decoder, board 2\nSIG\n\nClock I0 I1 I2 I3 I4 I5 NC NC GND\n/OE O0 O1 O2 O3 O4 NC NC NC VCC\n\nO0 = I0\n";
    assert_eq!(findings(Dialect::Galasm, text), []);
}
