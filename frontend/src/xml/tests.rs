use super::*;
use proptest::prelude::*;

const FILE: FileId = FileId(0);

fn read(text: &str) -> Document<'_> {
    parse(FILE, text, &Limits::default()).unwrap()
}

fn refused(text: &str) -> Box<Diagnostic> {
    parse(FILE, text, &Limits::default()).unwrap_err()
}

fn shown<'t>(text: &'t str, finding: &Diagnostic) -> &'t str {
    &text[finding.labels[0].span.range()]
}

#[test]
fn every_character_of_a_value_knows_its_place() {
    let text = "<a x='n&lt;3 &amp;&amp;\r\nb'/>";
    let document = read(text);
    let value = Mapped::value(FILE, text, document.root_element().attributes().next().unwrap());
    assert_eq!(value.text, "n<3 && b");
    assert_eq!(&text[value.span(1..2).range()], "&lt;");
    assert_eq!(&text[value.span(4..6).range()], "&amp;&amp;");
    assert_eq!(&text[value.span(7..8).range()], "b");
    assert_eq!(&text[value.whole().range()], "n&lt;3 &amp;&amp;\r\nb");
}

#[test]
fn content_is_the_text_before_the_first_element() {
    let text = "<a> x<![CDATA[<y>]]>&#122;<!-- no --> w <b/> v</a>";
    let document = read(text);
    let content = Mapped::content(FILE, text, document.root_element());
    assert_eq!(content.text, " x<y>z w ");
    assert_eq!(&text[content.span(2..5).range()], "<y>");
    assert_eq!(&text[content.span(5..6).range()], "&#122;");
    let words = content.words().map(|(word, span)| (word.to_owned(), &text[span.range()]));
    assert_eq!(
        words.collect::<Vec<_>>(),
        [("x<y>z".to_owned(), "x<![CDATA[<y>]]>&#122;"), ("w".to_owned(), "w")]
    );
    let trimmed = content.clone().trimmed();
    assert_eq!(trimmed.text, "x<y>z w");
    assert_eq!(&text[trimmed.whole().range()], "x<![CDATA[<y>]]>&#122;<!-- no --> w");
}

#[test]
fn formatted_text_is_that_of_all_elements_with_a_line_for_each_paragraph() {
    let text = "<a>\n <h:div><h:p>x<h:br/>AND</h:p>\n <h:p><h:b>N</h:b>OT<!-- no --> &lt;<?no?><![CDATA[<y>]]></h:p>\n</h:div></a><b/>";
    let text = format!("<r xmlns:h='h'>{text}</r>");
    let document = read(&text);
    let element = document.root_element().first_element_child().unwrap();
    let content = Mapped::formatted(FILE, &text, element);
    assert_eq!(content.text, "x\nAND\nNOT <<y>");
    assert_eq!(&text[content.span(1..2).range()], "<h:br/>");
    assert_eq!(&text[content.span(6..9).range()], "N</h:b>OT");
    assert_eq!(&text[content.span(10..11).range()], "&lt;");
    assert_eq!(&text[content.span(11..14).range()], "<y>");
    let empty = read("<a><p> </p></a>");
    assert_eq!(Mapped::formatted(FILE, "<a><p> </p></a>", empty.root_element()).text, "");
}

#[test]
fn the_place_of_what_is_wrong_is_shown() {
    let text = "<a>\n  <b>\n</a>";
    assert_eq!(shown(text, &refused(text)), "<");
    assert!(refused(text).message.ends_with("</a> closes <b>"));
    let text = "<é><b x='1'>";
    assert_eq!(shown(text, &refused(text)), "<b x='1'>");
    let text = "<a b='x && y'/>";
    assert_eq!(shown(text, &refused(text)), "&");
    assert_eq!(refused("").code, codes::XML);
}

#[test]
fn bombs_are_refused_before_they_cost_anything() {
    let laughs = "<!DOCTYPE a [<!ENTITY l 'ha'><!ENTITY m '&l;&l;'>]><a>&m;</a>";
    assert_eq!(refused(laughs).code, codes::XML_NOT_READ);
    let external = "<!DOCTYPE a SYSTEM 'file:///etc/passwd'><a/>";
    assert_eq!(refused(external).code, codes::XML_NOT_READ);
    assert_eq!(refused(&"<a>".repeat(100_000)).code, codes::NESTING);
    assert_eq!(refused(&"<".repeat(200_000)).code, codes::XML_NOT_READ);
    assert_eq!(refused(&format!("<a>{}</a>", "=".repeat(200_000))).code, codes::XML_NOT_READ);
    let many: String = (0..300).map(|index| format!(" a{index}='1'")).collect();
    assert_eq!(refused(&format!("<a{many}/>")).code, codes::XML_NOT_READ);
    let namespaces: String = (0..80).map(|index| format!(" xmlns:a{index}='{index}'")).collect();
    assert_eq!(refused(&format!("<a{namespaces}/>")).code, codes::XML_NOT_READ);
}

#[test]
fn what_is_escaped_is_read_as_it_was() {
    let value = "a\t<\"b'>\n&\r é";
    let text = format!("<a x=\"{}\">{}</a>", attribute(value), super::text(value));
    let document = read(&text);
    let root = document.root_element();
    assert_eq!(Mapped::value(FILE, &text, root.attributes().next().unwrap()).text, value);
    assert_eq!(Mapped::content(FILE, &text, root).text, value);
}

proptest! {
    #[test]
    fn values_and_content_are_those_of_the_parser(
        pieces in prop::collection::vec(
            prop::sample::select(vec![
                "a", " ", "\n", "\r\n", "\t", "&lt;", "&#10;", "&#x41;", "é", "'", ">", "&amp;", "b c",
            ]),
            0..12,
        ),
        cdata in prop::sample::select(vec!["", "<![CDATA[]]>", "<![CDATA[x\r\ny &lt; <z>]]>"]),
    ) {
        let raw = pieces.concat();
        let text = format!("<a x=\"{raw}\">{raw}{cdata}{raw}<b/>{raw}</a>");
        let document = read(&text);
        let root = document.root_element();
        let value = Mapped::value(FILE, &text, root.attributes().next().unwrap());
        prop_assert_eq!(value.text.as_ref(), root.attribute("x").unwrap());
        let content = Mapped::content(FILE, &text, root);
        prop_assert_eq!(content.text.as_ref(), root.text().unwrap_or_default());
        for mapped in [value, content] {
            for (index, character) in mapped.text.char_indices() {
                let place = &text[mapped.span(index..index + character.len_utf8()).range()];
                if !place.starts_with(['&', '\r', '\n', '\t']) {
                    prop_assert!(place.starts_with(character), "{:?} at {:?}", character, place);
                }
            }
            let trimmed = mapped.clone().trimmed();
            prop_assert_eq!(trimmed.text.as_ref(), mapped.text.trim());
        }
    }
}
