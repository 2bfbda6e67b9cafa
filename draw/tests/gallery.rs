//! The drawings in docs/gallery are those of the examples. `scripts/gallery` writes them.

use grafsynth_draw::{Options, Style, layout, svg};
use grafsynth_frontend::{graf, scxml};
use grafsynth_ir::FileId;

#[test]
fn the_gallery_shows_the_examples() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/..");
    let page = std::fs::read_to_string(format!("{root}/docs/gallery.md")).expect("it is there");
    let mut n_drawings = 0;
    for folder in std::fs::read_dir(format!("{root}/examples")).expect("it is there") {
        let Ok(files) = std::fs::read_dir(folder.expect("it is there").path()) else { continue };
        for file in files {
            let file = file.expect("it is there").path();
            let text = || std::fs::read_to_string(&file).expect("it is there");
            let parsed = match file.extension().and_then(|it| it.to_str()) {
                Some("graf") => graf::parse(FileId(0), &text()).design,
                Some("scxml") => scxml::parse(FileId(0), &text()).design,
                _ => continue,
            };
            let stem = file.file_stem().and_then(|it| it.to_str()).expect("it is there");
            let design = parsed.expect("it is a chart");
            let mut drawings = vec![(stem.to_owned(), Style::Grafcet)];
            if stem == "filler" {
                drawings.push(("filler_sfc".to_owned(), Style::Sfc));
            }
            for (name, style) in drawings {
                let drawing = layout(&design, &Options { style, ..Options::default() });
                let drawing = svg(&drawing.expect("it is there"));
                let kept = std::fs::read_to_string(format!("{root}/docs/gallery/{name}.svg"));
                assert!(
                    kept.is_ok_and(|kept| kept == drawing),
                    "docs/gallery/{name}.svg is not the drawing: run scripts/gallery"
                );
                assert!(
                    page.contains(&format!("(gallery/{name}.svg)")),
                    "{name} is not on the page"
                );
                n_drawings += 1;
            }
        }
    }
    assert!(n_drawings > 10);
}
