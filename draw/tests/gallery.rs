//! The drawings in docs/gallery are those of the examples. `scripts/gallery` writes them.

use grafsynth_draw::{Options, layout, svg};
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
            let drawing = layout(&parsed.expect("it is a chart"), &Options::default());
            let drawing = svg(&drawing.expect("it is there"));
            let kept = std::fs::read_to_string(format!("{root}/docs/gallery/{stem}.svg"));
            assert!(
                kept.is_ok_and(|kept| kept == drawing),
                "docs/gallery/{stem}.svg is not the drawing: run scripts/gallery"
            );
            assert!(page.contains(&format!("(gallery/{stem}.svg)")), "{stem} is not on the page");
            n_drawings += 1;
        }
    }
    assert!(n_drawings > 10);
}
