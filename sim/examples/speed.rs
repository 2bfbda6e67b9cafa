//! Measures the speed of the reference simulator: `cargo run --release -p grafsynth-sim --example speed`.

#![allow(
    clippy::print_stdout,
    clippy::disallowed_methods,
    reason = "an example that measures and prints"
)]

use grafsynth_ir::{FileId, text, validate};
use grafsynth_sim::{Simulator, Stimulus};
use std::time::Instant;

const TRUCK: &str = "net truck
policy priority-age
evolution single
part truck level 1
input m bool
input b bool
input p bool
input a bool
output R bool continuous
    emit p2
output Z bool continuous
    emit p3
output L bool continuous
    emit p4
step p1 in truck initial
step p2 in truck
step p3 in truck
step p4 in truck
transition t1 in truck p1 -> p2 when m
transition t2 in truck p2 -> p3 when b
transition t3 in truck p3 -> p4 when p
transition t4 in truck p4 -> p1 when a
";

fn main() {
    let (net, found) = text::parse(FileId(0), TRUCK);
    let Some(Ok(net)) = net.map(validate) else {
        println!("the truck does not parse: {found:?}");
        return;
    };
    let stimulus = Stimulus::random(&net, 1_000_000, 1, 1);
    let rows: Vec<_> = stimulus.rows().collect();
    let mut simulator = Simulator::new(&net);
    simulator.reset();
    let start = Instant::now();
    let mut n_active = 0;
    for row in &rows {
        n_active += simulator.step(row).steps.len();
    }
    println!(
        "truck: 1000000 reactions in {:.3} s ({n_active} active steps seen)",
        start.elapsed().as_secs_f64()
    );
}
