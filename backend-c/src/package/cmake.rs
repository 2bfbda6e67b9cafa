//! A CMake project: a library target with an alias, an export and an install rule, and an example.

use super::{Chart, fill, host, written, yours};
use crate::File;

const PROJECT: &str = include_str!("text/CMakeLists.txt");

/// The version of every package: a chart has no version.
pub(super) const VERSION: &str = "1.0.0";

pub(super) fn files(chart: &Chart<'_>) -> Vec<File> {
    let mut files = chart.c_files("include/", "src/");
    let list = |names: Vec<&str>, folder: &str| -> String {
        names.iter().map(|name| format!("    {folder}{name}\n")).collect()
    };
    let project = fill(
        PROJECT,
        &[
            ("NAME", chart.name()),
            // A bracket would begin a bracket comment.
            ("ABOUT", &chart.about().replace('[', "(").replace(']', ")")),
            ("VERSION", VERSION),
            ("SOURCES", list(chart.names_of(true), "src/").trim_end()),
            ("HEADERS", &list(chart.names_of(false), "include/")),
        ],
    );
    files.push(written("CMakeLists.txt", project));
    files.push(written("README.md", chart.readme(&head(chart))));
    files.push(yours("example/host.c", host::text(chart, &format!("\"{}.h\"", chart.stem()))));
    files
}

fn head(chart: &Chart<'_>) -> String {
    let name = chart.name();
    format!(
        "A CMake project. In yours:\n\n\
         ```cmake\nadd_subdirectory({}-cmake)          # this folder, or, once it is installed:\nfind_package({name} REQUIRED)\ntarget_link_libraries(my_program PRIVATE {name}::{name})\n```\n\n\
         By itself: `cmake -S . -B build`, `cmake --build build`, `cmake --install build --prefix DIR`; `build/{name}_host` is the example, which reads a reaction from each \
         line of standard input. For a microcontroller, pass a toolchain file as usual.\n",
        chart.stem()
    )
}
