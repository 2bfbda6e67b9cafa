//! The enumeration that proves C leaves out inputs that neither the chart nor the C reads, and only those.

#![allow(clippy::print_stdout, reason = "tests say what they skip")]

use grafsynth_backend_c::{Io, Options, Package, Style, emit};
use grafsynth_driver::report::OutputVerdict;
use grafsynth_engines::{exhaustive, tools};
use grafsynth_ir::Valid;
use grafsynth_ir::net::Net;
use grafsynth_tests::{chart, small_limits};
use grafsynth_verify::{OpenReason, structural_facts};

/// A chart that reads two of its 20 inputs.
fn two_of_twenty() -> Valid<Net> {
    let inputs: Vec<String> = (0..20).map(|at| format!("i{at}")).collect();
    let text = format!(
        "chart two {{\nevolution single\nconflict priority\ninput {}\noutput lamp\ninitial step a\nstep b {{ lamp }}\na -> b when i3\nb -> a when not i3 and i7\n}}",
        inputs.join(", ")
    );
    chart("two.graf", &text)
}

fn package(net: &Valid<Net>, io: Io, gate: bool) -> Package {
    let options = Options {
        style: Style::Switch,
        io,
        gate,
        prefix: Some("two".into()),
        ..Options::default()
    };
    emit(net, &structural_facts(net), &options).unwrap_or_else(|found| panic!("{found:?}"))
}

fn verdict(net: &Valid<Net>, package: &Package) -> OutputVerdict {
    let limits = small_limits();
    exhaustive::check(
        "two.c",
        net,
        package,
        &limits,
        Err(OpenReason::Method("only the enumeration is tested".to_owned())),
    )
    .unwrap_or_else(|refused| panic!("{refused:?}"))
    .verdict
}

/// The package with a text of `two.c` in place of another.
fn changed(package: &Package, old: &str, new: &str) -> Package {
    let mut package = package.clone();
    for file in package.files.iter_mut().filter(|file| file.name == "two.c") {
        assert!(file.text.contains(old), "{}", file.text);
        file.text = file.text.replacen(old, new, 1);
    }
    package
}

#[test]
fn an_input_that_nobody_reads_has_one_value_and_one_that_the_c_reads_has_all() {
    if tools::c_compiler().is_none() {
        assert!(std::env::var_os("CI").is_none(), "a C compiler is missing, and CI must have it");
        println!("skipped: no C compiler");
        return;
    }
    let net = two_of_twenty();
    let plain = package(&net, Io::Members, false);
    let is_proved = |package: &Package| matches!(verdict(&net, package), OutputVerdict::Proved(_));
    assert!(is_proved(&plain));
    // The gate compares the whole structure, and words are read as a whole: all inputs count, and these are too many.
    assert!(!is_proved(&package(&net, Io::Members, true)));
    assert!(!is_proved(&package(&net, Io::Words, false)));
    // Wrong C that reads another input, in whatever way, is never proved.
    let step = "two_step(two_t *self, const two_in_t *in, two_out_t *out)\n{\n";
    for (old, new) in [
        ("if (in->i3)", "if (in->i3 || in->i9)"),
        ("if (in->i3)", "if (in->i3 || (&in->i3)[6])"),
        ("if (in->i3)", "if (((const bool *)in)[9])"),
        ("if (in->i3)", "if ((*in).i9)"),
        ("if (in->i3)", "if (in[0].i9)"),
        (step, &format!("{step}    const two_in_t copy = *in;\n    if (copy.i9) {{ return; }}\n")),
        (
            step,
            &format!("{step}    const two_in_t *other = in;\n    if (other->i9) {{ return; }}\n"),
        ),
    ] {
        let wrong = changed(&plain, old, new);
        let verdict = verdict(&net, &wrong);
        assert!(!matches!(verdict, OutputVerdict::Proved(_)), "{new}: {verdict:?}");
    }
    // The same in a function that the step calls.
    let helper = "void two_step(";
    let wrong = changed(
        &changed(&plain, "if (in->i3)", "if (two_asks(in))"),
        helper,
        &format!(
            "static bool two_asks(const two_in_t *given)\n{{\n    return given->i9;\n}}\n\n{helper}"
        ),
    );
    assert!(!matches!(verdict(&net, &wrong), OutputVerdict::Proved(_)));
}
