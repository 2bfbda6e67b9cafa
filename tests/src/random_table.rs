//! Random state tables (KISS2) with undefined entries.

use grafsynth_sim::Random;

/// The text of a table with few inputs, outputs and states. Each state's inputs are split into disjoint cubes; some cubes have no row, some rows no next
/// state or no value for an output.
#[must_use]
pub fn random_table(random: &mut Random) -> String {
    let (n_inputs, n_outputs, n_states) =
        (1 + random.below(4), 1 + random.below(3), 1 + random.below(6));
    let mut text = format!(".i {n_inputs}\n.o {n_outputs}\n");
    for state in 0..n_states {
        let mut open = vec!["-".repeat(n_inputs)];
        for _ in 0..random.below(5) {
            let at = random.below(open.len());
            if let Some(column) =
                open[at].find('-').filter(|_| random.one_in(2)).or(open[at].rfind('-'))
            {
                let cube = open.swap_remove(at);
                open.extend(
                    ["0", "1"]
                        .map(|value| format!("{}{value}{}", &cube[..column], &cube[column + 1..])),
                );
            }
        }
        for cube in open {
            if random.one_in(6) && state > 0 {
                continue;
            }
            let next = if random.one_in(10) {
                "*".to_owned()
            } else {
                format!("st{}", random.below(n_states))
            };
            let outputs: String = (0..n_outputs)
                .map(|_| random.pick(&['0', '1', '-']).copied().unwrap_or('-'))
                .collect();
            text += &format!("{cube} st{state} {next} {outputs}\n");
        }
    }
    text
}
