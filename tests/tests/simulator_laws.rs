//! Properties of the simulator for any net: its state is complete, and its text formats lose nothing.

use grafsynth_ir::FileId;
use grafsynth_sim::{Simulator, Stimulus, Trace, TraceLayout, breaks_assumption, compare, run};
use grafsynth_tests::random_net::{Features, random_net};

const NETS: u64 = 150;
const ROWS: usize = 40;

/// A run that continues from a saved or copied state equals the original run.
#[test]
fn a_state_is_all_that_a_net_remembers() {
    for seed in 0..NETS {
        let net = random_net(seed, &Features::everything());
        let stimulus = Stimulus::random(&net, ROWS, seed, 3);
        let mut straight = Simulator::new(&net);
        let mut other = Simulator::new(&net);
        for (at, input) in stimulus.rows().enumerate() {
            if at % 2 == 0 {
                let report = other.restore(&straight.save()).unwrap();
                assert!(
                    report.new.is_empty() && report.lost.is_empty() && report.cut.is_empty(),
                    "seed {seed}: {report:?}"
                );
            } else {
                other.set_state(straight.state());
            }
            assert_eq!(other.state(), straight.state(), "seed {seed}, row {at}");
            assert_eq!(other.react(&input), straight.react(&input), "seed {seed}, row {at}");
        }
    }
}

/// Stimuli and traces are read back as they were written, and an independent parser accepts the VCD.
#[test]
fn texts_lose_nothing() {
    for seed in 0..NETS {
        let net = random_net(seed, &Features::everything());
        let stimulus = Stimulus::random(&net, ROWS, seed, 3);
        assert!(stimulus.rows().all(|row| !breaks_assumption(&net, &row)), "seed {seed}");
        let (again, problems) = Stimulus::parse_csv(&net, FileId(0), &stimulus.to_csv(&net));
        assert_eq!((again, problems), (Some(stimulus.clone()), Vec::new()), "seed {seed}");
        let trace = run(&net, &stimulus);
        let csv = trace.to_csv();
        let read = Trace::parse_csv(&TraceLayout::of(&net), FileId(0), &csv).unwrap();
        assert_eq!(compare(&trace, &read), None, "seed {seed}");
        assert_eq!(read.to_csv(), csv, "seed {seed}");
        assert_eq!(trace.to_jsonl().lines().count(), ROWS + 1);
        assert!(trace.to_vcd().contains("$enddefinitions"));
    }
}

/// Equal inputs from equal states give equal rows, and a reset clears everything.
#[test]
fn reactions_are_deterministic() {
    for seed in 0..NETS {
        let net = random_net(seed, &Features::everything());
        let stimulus = Stimulus::random(&net, ROWS, seed, 3);
        let mut simulator = Simulator::new(&net);
        let first: Vec<_> = stimulus.rows().map(|row| simulator.react(&row)).collect();
        simulator.reset();
        let second: Vec<_> = stimulus.rows().map(|row| simulator.react(&row)).collect();
        assert_eq!(first, second, "seed {seed}");
    }
}
