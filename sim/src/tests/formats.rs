//! Tests of semantics §11: stimuli and traces as text, and all errors in them.

use grafsynth_ir::{Diagnostic, FileId};

use super::{TRUCK, net};
use crate::{
    Difference, Stimulus, Trace, TraceLayout, TraceOptions, breaks_assumption, codes, compare, run,
};

fn problems(net: &grafsynth_ir::net::Net, text: &str) -> Vec<String> {
    let (stimulus, problems) = Stimulus::parse_csv(net, FileId(0), text);
    assert_eq!(stimulus.is_none(), problems.iter().any(Diagnostic::is_error));
    problems
        .into_iter()
        .map(|problem| {
            let label = &problem.labels[0];
            assert!(
                text.is_char_boundary(label.span.range().start)
                    && label.span.range().end <= text.len()
            );
            let help = problem.help.map_or(String::new(), |help| format!(" ({help})"));
            format!("{}@{}: {}{help}", problem.code.id, &text[label.span.range()], problem.message)
        })
        .collect()
}

#[test]
fn each_error_of_a_stimulus() {
    let chart = net(
        "events exclusive",
        "input load bool
         input n int -3..7
         input e bool event
         input f bool event
         input r bool internal
         step a in g initial",
    );
    assert_eq!(
        problems(&chart, "lod\n"),
        ["G0501@lod: the chart has no input or event `lod` (did you mean `load`?)"]
    );
    assert_eq!(
        problems(&chart, "zzzzz\n"),
        [
            "G0501@zzzzz: the chart has no input or event `zzzzz` (columns can be `load`, `n`, `e`, `f`, `dt`)"
        ]
    );
    assert_eq!(
        problems(&chart, "n,load, n\n"),
        ["G0502@n: column `n` is listed twice (remove one of them)"]
    );
    assert_eq!(
        problems(&chart, "n,load\n8,2\nx,\n"),
        [
            "G0503@8: invalid value for `n`: `8` (write a whole number from -3 to 7)",
            "G0503@2: invalid value for `load`: `2` (write 0 or 1)",
            "G0503@x: invalid value for `n`: `x` (write a whole number from -3 to 7)",
            "G0503@: invalid value for `load`: `` (write 0 or 1)",
        ]
    );
    assert_eq!(
        problems(&chart, "n,load\n1\n1,1,1\n"),
        [
            "G0504@1: wrong number of cells in this row: expected 2, found 1 (write one cell for each column of the header)",
            "G0504@1,1,1: wrong number of cells in this row: expected 2, found 3 (write one cell for each column of the header)",
        ]
    );
    assert_eq!(
        problems(&chart, "dt\n-1\n1.5\n2147483648\n"),
        [
            "G0505@-1: invalid dt `-1`: it is negative (write a number of ticks from 0 to 2147483647)",
            "G0505@1.5: invalid dt `1.5`: it is not a whole number of ticks (write a number of ticks from 0 to 2147483647)",
            "G0505@2147483648: invalid dt `2147483648`: it is not a whole number of ticks (write a number of ticks from 0 to 2147483647)",
        ]
    );
    assert_eq!(
        problems(&chart, "e,f\n1,0\n1,1\n"),
        [
            "G0506@1: `e` and `f` occur in one row (2), but the chart declares `events exclusive` (split them into two rows; with `dt` 0 no time passes in between)"
        ]
    );
    assert_eq!(
        problems(&chart, "# nothing\n\n"),
        ["G0507@: the stimulus is empty (begin with a header such as `dt,load,n,e,f`)"]
    );
    assert_eq!(
        problems(&chart, "r\n"),
        [
            "G0508@r: `r` is an internal event: only the chart raises it (remove the column, or declare the event without `internal`)"
        ]
    );
    // At most a hundred errors are reported.
    assert_eq!(problems(&chart, &format!("n\n{}", "x\n".repeat(5000))).len(), 100);
    assert!(problems(&chart, &"q,".repeat(200_000)).len() <= 101);
}

#[test]
fn a_broken_assumption_is_a_warning_and_masks() {
    let truck = net("", TRUCK);
    let text = "a,b\n1,0\n1,1\n1,1\n0,0\n";
    assert_eq!(
        problems(&truck, text),
        [
            "G0509@1,1: row 2 violates an assumption of the chart (change the row; from here on comparisons ignore all cells, because back ends may rely on the assumption)"
        ]
    );
    let (stimulus, _) = Stimulus::parse_csv(&truck, FileId(0), text);
    let trace = run(&truck, &stimulus.unwrap());
    let mut other = trace.clone();
    for row in &mut other.rows[2..] {
        row.values[6] = crate::Value::Steps(vec![]);
    }
    assert_eq!(compare(&trace, &other), None);
    other.rows[1].values[6] = crate::Value::Steps(vec![1]);
    let found = compare(&trace, &other);
    assert_eq!(
        found,
        Some(Difference { row: 1, column: "steps".into(), left: "p1".into(), right: "p2".into() })
    );
}

#[test]
fn stimuli_come_back_from_text() {
    let truck = net("", TRUCK);
    let stimulus = Stimulus::random(&truck, 50, 3, 4);
    let (again, problems) = Stimulus::parse_csv(&truck, FileId(0), &stimulus.to_csv(&truck));
    assert_eq!((again.as_ref(), problems.len()), (Some(&stimulus), 0));
    // Any order of columns, blanks, comments and CR are accepted.
    let (odd, _) =
        Stimulus::parse_csv(&truck, FileId(0), "# of the truck\r\n b , m \r\n\r\n1, 0 # moves\r\n");
    let row = odd.unwrap().row(0);
    assert_eq!((row.dt, row.values), (1, vec![0, 1, 0, 0]));
    assert!(stimulus.long_rows() > 0);
    assert_eq!(Stimulus::random(&truck, 50, 3, 1).long_rows(), 0);
}

#[test]
fn random_stimuli_keep_the_rules_and_move_the_chart() {
    let truck = net("", TRUCK);
    let stimulus = Stimulus::random(&truck, 400, 1, 2);
    assert_eq!(stimulus, Stimulus::random(&truck, 400, 1, 2));
    assert_ne!(stimulus, Stimulus::random(&truck, 400, 2, 2));
    assert!(stimulus.rows().all(|row| row.dt <= 2 && !breaks_assumption(&truck, &row)));
    let csv = run(&truck, &stimulus).to_csv();
    let rounds = csv.lines().filter(|line| line.contains(",p4,")).count();
    assert!(rounds > 20, "{rounds}");
    let exclusive = net(
        "events exclusive",
        "input e bool event
         input f bool event
         step a in g initial",
    );
    assert!(
        Stimulus::random(&exclusive, 400, 1, 1)
            .rows()
            .all(|row| row.values.iter().sum::<i64>() <= 1)
    );
    // A guard that is true for only one value in 70 001 is found.
    let narrow = net(
        "",
        "input n int 0..70000
         step a in g initial
         step b in g
         transition t in g a -> b when n = 40001",
    );
    assert!(run(&narrow, &Stimulus::random(&narrow, 200, 1, 1)).to_csv().contains(",b"));
}

const ALL_COLUMNS: &str = "input i bool
     input n int -2..5
     input e bool event
     input x bool extern
     output o bool continuous
         emit s.b
     output tell bool extern
         param int -9..9
         param bool
     output beep bool extern
     output kept int -40..40 stored kept
     var kept int -40..40 stored = -33
     var v int 0..3 [2] = 0, 3
     var hid int 0..3 hidden = 0
     step s.a in g initial
         entry { call tell (-3, true); call tell (7, false); call beep () }
     step s.b in g initial
     step s.h in g initial hidden
     macro s entry s.a exit s.b steps (s.a, s.b)
     transition t in g s.a -> when i";

#[test]
fn all_columns_in_all_forms() {
    let chart = net("evolution stable limit 3", ALL_COLUMNS);
    let (stimulus, _) = Stimulus::parse_csv(&chart, FileId(0), "dt,i,n,e,x\n2,1,-2,1,0\n");
    let trace = run(&chart, &stimulus.unwrap());
    assert_eq!(
        trace.to_csv(),
        "scan,dt,i,n,e,x,steps,o,tell,beep,kept,v[0],v[1],fault\n\
         0,0,0,0,0,0,s.a s.b,1,-3:1;7:0,1,-33,0,3,0\n\
         1,2,1,-2,1,0,s.b,1,,0,-33,0,3,0\n"
    );
    assert_eq!(
        trace.to_jsonl(),
        "{\"scan\":0,\"dt\":0,\"i\":0,\"n\":0,\"e\":0,\"x\":0,\"steps\":[\"s.a\",\"s.b\"],\"o\":1,\"tell\":[[-3,1],[7,0]],\"beep\":1,\"kept\":-33,\"v[0]\":0,\"v[1]\":3,\"fault\":0}\n\
         {\"scan\":1,\"dt\":2,\"i\":1,\"n\":-2,\"e\":1,\"x\":0,\"steps\":[\"s.b\"],\"o\":1,\"tell\":[],\"beep\":0,\"kept\":-33,\"v[0]\":0,\"v[1]\":3,\"fault\":0}\n"
    );
    let options = TraceOptions { composites: true, macros: true };
    let wide = TraceLayout::with(&chart, options);
    assert_eq!(wide.step_names().collect::<Vec<_>>(), ["s", "s.a", "s.b"]);
}

#[test]
fn value_change_dumps_are_read_by_others() {
    let chart = net("evolution stable limit 3", ALL_COLUMNS);
    let (stimulus, _) = Stimulus::parse_csv(&chart, FileId(0), "dt,i,n\n2,1,-2\n");
    let text = run(&chart, &stimulus.unwrap()).to_vcd();
    let mut parser = vcd::Parser::new(text.as_bytes());
    let header = parser.parse_header().unwrap();
    let n = header.find_var(&["chart", "n"]).unwrap();
    assert_eq!(n.size, 4);
    let a = header.find_var(&["chart", "steps", "s.a"]).unwrap().code;
    let commands: Vec<vcd::Command> = parser.map(Result::unwrap).collect();
    assert!(commands.contains(&vcd::Command::ChangeScalar(a, vcd::Value::V0)));
    let minus_two = "1110".parse().unwrap();
    assert!(commands.contains(&vcd::Command::ChangeVector(n.code, minus_two)));
}

#[test]
fn traces_come_back_and_differences_are_found() {
    let chart = net("evolution stable limit 3", ALL_COLUMNS);
    let trace = run(&chart, &Stimulus::random(&chart, 30, 5, 3));
    let layout = TraceLayout::of(&chart);
    let csv = trace.to_csv();
    let read = |text: &str| Trace::parse_csv(&layout, FileId(0), text);
    assert_eq!(compare(&trace, &read(&csv).unwrap()), None);
    assert_eq!(read(&csv).unwrap().to_csv(), csv);
    let changed = read(&csv.replacen("-3:1;7:0", "-3:1;7:1", 1)).unwrap();
    let expected = Difference {
        row: 0,
        column: "tell".into(),
        left: "-3:1;7:0".into(),
        right: "-3:1;7:1".into(),
    };
    assert_eq!(compare(&trace, &changed), Some(expected));
    let mut shorter = trace.clone();
    shorter.rows.pop();
    let expected =
        Difference { row: 30, column: "scan".into(), left: "30".into(), right: String::new() };
    assert_eq!(compare(&trace, &shorter), Some(expected));

    let message = |text: &str| {
        let problem = read(text).unwrap_err().remove(0);
        format!("{}: {}", problem.code.id, problem.message)
    };
    assert_eq!(message(""), "G0511: the trace is empty");
    assert_eq!(message("scan,dt,j\n"), "G0511: column 3 is `j`, but the chart has `i` there");
    assert_eq!(message("scan,dt\n"), "G0511: the trace has 2 columns, the chart 14");
    assert_eq!(
        message(&csv.replacen("s.a", "s.c", 1)),
        "G0512: `s.c s.b` is not valid in column `steps`"
    );
    assert_eq!(
        message(&csv.replacen("-3:1", "-3:y", 1)),
        "G0512: `-3:y;7:0` is not valid in column `tell`"
    );
    assert!(
        message(&(csv + "1,2\n"))
            .starts_with("G0504: wrong number of cells in this row: expected 14, found 2")
    );
}

/// Every code that a stimulus, trace or saved state can cause has a page, and the example on the page triggers it.
#[test]
fn the_list_of_codes_is_in_order() {
    let ids: Vec<&str> = codes::ALL.iter().map(|code| code.id).collect();
    assert!(ids.is_sorted() && ids.iter().all(|id| id.starts_with("G05")));
}
