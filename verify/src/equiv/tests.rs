use grafsynth_ir::Valid;
use grafsynth_ir::facts::Facts;
use grafsynth_ir::logic::{Logic, Node};
use grafsynth_ir::lower::program::{ProgramOptions, program};
use grafsynth_ir::net::{Net, Policy};
use grafsynth_logic::{EncodeOptions, encode};

use super::{Verdict, equiv};
use crate::limits::Limits;
use crate::testing::{chart, valid};

fn encoded(net: &Valid<Net>) -> Logic {
    let program = program(net, &ProgramOptions::default()).expect("a program");
    encode(net, &program, &Facts::default(), &EncodeOptions::default()).expect("logic")
}

fn prove(net: &Valid<Net>, logic: &Logic) -> Verdict {
    equiv(net, &crate::facts(net, &Limits::default()), logic, &Limits::default())
}

#[test]
fn an_encoded_ring_is_the_ring() {
    let net = valid(chart("a* b c | a>b:x b>c:y c>a:nx"));
    let verdict = prove(&net, &encoded(&net));
    assert!(matches!(verdict, Verdict::Proved(_)), "{verdict:?}");
}

#[test]
fn every_flipped_literal_is_refuted_or_harmless() {
    let mut net = chart("s* a b | s>a:x s>b:y a>s:ny b>s:nx");
    for policy in [Policy::Priority, Policy::All, Policy::PriorityAge] {
        net.settings.policy = policy;
        let net = valid(net.clone());
        let logic = encoded(&net);
        assert!(matches!(prove(&net, &logic), Verdict::Proved(_)));
        let mut n_refuted = 0;
        for (id, node) in logic.nodes.iter() {
            let Node::Not(inner) = *node else { continue };
            let mut wrong = logic.clone();
            wrong.nodes[id] = Node::And(vec![inner]);
            match prove(&net, &wrong) {
                Verdict::Proved(_) => {}
                Verdict::Refuted(counterexample) => {
                    n_refuted += 1;
                    assert!(counterexample.stimulus.len() <= 6, "{counterexample:?}");
                }
                Verdict::Open(why) => panic!("{why}"),
            }
        }
        assert!(n_refuted > 2, "{n_refuted} of the flips were seen");
    }
}

#[test]
fn a_wrong_power_up_value_is_seen_in_row_0() {
    let net = valid(chart("a* b | a>b:x b>a:nx"));
    let mut logic = encoded(&net);
    let first = logic.flops.ids().next().expect("a flip-flop");
    logic.flops[first].init = false;
    let Verdict::Refuted(counterexample) = prove(&net, &logic) else { panic!("not seen") };
    assert_eq!((counterexample.stimulus.len(), counterexample.difference.row), (0, 0));
    assert_eq!(counterexample.difference.column, "steps");
}
