//! The evidence of outputs that differ from the chart: circuits, bitstreams and rebuilt texts with one change.

use grafsynth_backend_pld::Dialect;
use grafsynth_driver::ice40;
use grafsynth_driver::judge::{self, Judged};
use grafsynth_driver::pipeline::{self, emit_options, through};
use grafsynth_driver::report::{OutputFault, OutputReport, OutputVerdict};
use grafsynth_driver::stem::FileStem;
use grafsynth_ir::Valid;
use grafsynth_ir::logic::Logic;
use grafsynth_ir::net::Net;
use grafsynth_logic::build::Builder;
use grafsynth_tests::chart;
use grafsynth_verify::{Limits, equiv};

const LAMP: &str = "chart lamp {
    input go, stop, spare
    output lit
    initial step off
    step on { lit }
    step late { lit }
    off -> on when go
    on -> late when stop
    late -> off when not stop and not spare
}
";

fn lamp() -> Valid<Net> {
    chart("lamp.graf", LAMP)
}

/// The circuit of the lamp with an output that is wrong in one step.
fn wrong(net: &Valid<Net>) -> Logic {
    let facts = pipeline::facts(net, &Limits::default());
    let logic = pipeline::logic(net, &facts).expect("a circuit");
    let mut builder = Builder::resume(logic);
    let late = builder.logic.flops.iter().find(|(_, flop)| flop.name == "late");
    let (late, _) = late.expect("a flip-flop for the step");
    let late = builder.flop(late);
    let (lit, _) =
        builder.logic.outputs.iter().find(|(_, output)| output.name == "lit").expect("lit");
    let value = builder.logic.outputs[lit].value;
    let not_late = builder.not(late);
    builder.logic.outputs[lit].value = builder.and([value, not_late]);
    builder.logic
}

fn fault(report: &OutputReport) -> &OutputFault {
    let OutputVerdict::Refuted(fault) = &report.verdict else { panic!("not refuted: {report}") };
    fault
}

#[test]
fn a_wrong_circuit_is_shown_beside_the_chart() {
    let net = lamp();
    let facts = pipeline::facts(&net, &Limits::default());
    let wrong = wrong(&net);
    let report = |name| {
        let verdict = equiv(&net, &facts, &wrong, &Limits::default());
        OutputReport::of_verdict(name, &net, &wrong, verdict)
    };
    let (first, second) = (report("lamp.pds"), report("lamp.v"));
    let evidence = fault(&first).evidence(&net).expect("a run");
    // `spare` is read by no transition that could fire in the last row, and never changes.
    let columns = ["row", "go", "stop", "active", "fired", "lit (chart)", "lit (output)"];
    assert_eq!(evidence.columns, columns);
    let last = evidence.rows.last().expect("rows");
    assert_eq!(last[3..], ["late", "on_late", "1", "0"], "{evidence:#?}");
    for row in &evidence.rows[..evidence.rows.len() - 1] {
        assert_eq!(row[5], row[6], "only the last row differs");
    }
    let traces = fault(&first).traces(&net);
    let titles: Vec<&str> = traces.iter().map(|(title, _)| *title).collect();
    assert_eq!(titles, ["chart", "output"]);
    assert_eq!(traces[0].1.rows.len(), evidence.rows.len());
    assert_eq!(traces[1].1.rows.len(), evidence.rows.len());
    assert!(fault(&first).is_same(fault(&second)), "one finding");
    let said = fault(&first).of_several();
    assert!(said.starts_with("differ from the chart after 2 reactions: lit is `1`"), "{said}");
}

#[test]
fn two_circuits_are_shown_clock_by_clock() {
    let net = lamp();
    let facts = pipeline::facts(&net, &Limits::default());
    let right = pipeline::logic(&net, &facts).expect("a circuit");
    let Judged::Different(apart) = judge::judge(&right, &wrong(&net), &Limits::default()) else {
        panic!("they differ");
    };
    assert_eq!(apart.clocks(), 2);
    assert_eq!((apart.outputs.as_slice(), apart.left), (&[false, true, true][..], true));
    let sentence = apart.sentence("text", "output");
    let wanted =
        "after 2 clocks, lit is 1 in the text and 0 in the output while go=0 stop=0 spare=0";
    assert_eq!(sentence, wanted);
    let fault = OutputFault::Rebuilt(Box::new(apart));
    let evidence = fault.evidence(&net).expect("a run");
    assert_eq!(evidence.columns, ["clock", "go", "stop", "lit (text)", "lit (output)"]);
    assert_eq!(
        evidence.rows,
        [["1", "1", "0", "0", "0"], ["2", "0", "1", "1", "1"], ["3", "0", "0", "1", "0"]]
    );
    let traces = fault.traces(&net);
    let [(_, ours), (_, theirs)] = traces.as_slice() else { panic!("two traces") };
    let difference = grafsynth_sim::compare(ours, theirs).expect("they differ");
    assert_eq!((difference.row, difference.column.as_str()), (2, "lit"));
}

#[test]
fn a_wrong_bitstream_is_shown_beside_its_verilog() {
    let net = lamp();
    let facts = pipeline::facts(&net, &Limits::default());
    let logic = pipeline::logic(&net, &facts).expect("a circuit");
    let emitted = through(&logic, Dialect::Verilog, &emit_options(&net, None, None))
        .expect("Verilog")
        .emitted;
    let stem = FileStem::of_name("lamp");
    let job = ice40::job(&stem, &emitted, None, &[]).expect("pins");
    let wrong = job.verilog.replace("assign lit = on | late;", "assign lit = on;");
    assert_ne!(wrong, job.verilog, "{wrong}");
    let report = ice40::judge(&job, &wrong, &Limits::default());
    let said = report.to_string();
    assert!(said.contains("differs from the Verilog: after 2 clocks, lit is 1 in the Verilog and 0 in the bitstream"), "{said}");
    let evidence = fault(&report).evidence(&net).expect("a run");
    assert_eq!(evidence.rows.len(), 3);
    let columns = &evidence.columns;
    assert_eq!(columns[columns.len() - 2..], ["lit (Verilog)", "lit (bitstream)"]);
    assert_eq!(fault(&report).traces(&net).len(), 2);
}
