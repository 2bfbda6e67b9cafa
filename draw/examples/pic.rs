fn main() {
    for path in std::env::args().skip(1) {
        let text = std::fs::read_to_string(&path).unwrap();
        let parsed = grafsynth_frontend::graf::parse(grafsynth_ir::FileId(0), &text);
        let name = std::path::Path::new(&path).file_stem().unwrap().to_string_lossy().into_owned();
        match grafsynth_draw::layout(&parsed.design.unwrap(), &grafsynth_draw::Options::default()) {
            Ok(p) => {
                std::fs::write(format!("/tmp/drawn/{name}.svg"), grafsynth_draw::svg(&p)).unwrap()
            }
            Err(e) => println!("{name} {e:?}"),
        }
    }
}
