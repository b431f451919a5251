use super::write::Writer;
use super::*;

fn read(text: &str) -> Result<Document, Fault> {
    Document::read(text.as_bytes(), Path::new("x.xml"), Limits::default())
}

#[test]
fn elements_have_names_attributes_and_lines() {
    let document =
        read("<?xml version=\"1.0\"?>\n<!-- c -->\n<s:A xmlns:s=\"u\" s:x='1 &lt; 2'>\n  text <s:B/>\n\n<B y=\"&#233;\"\n z='3'/></s:A>\n")
            .unwrap();
    let root = document.root_named("A").unwrap();
    assert_eq!((root.line(), root.attribute("x")), (3, Some("1 < 2")));
    let children: Vec<_> = root.all("B").map(|b| (b.line(), b.attribute("y"), b.attribute("z"))).collect();
    assert_eq!(children, [(4, None, None), (6, Some("\u{e9}"), Some("3"))]);
}

#[test]
fn what_is_no_document_is_told_with_its_line() {
    for (text, part, line) in [
        ("<a>\n<b></a>", "not well-formed", 2),
        ("<a>\n<b>", "cut off", 2),
        ("", "no element", 0),
        ("<!DOCTYPE a [<!ENTITY x \"y\">]><a/>", "DOCTYPE", 1),
        ("<a/><b/>", "more than one root", 1),
        ("<a x='1' x='2'/>", "not well-formed", 1),
        ("<a>\n<b x='&boom;'/></a>", "attribute x", 2),
        ("<?xml version='1.0' encoding='EBCDIC'?><a/>", "EBCDIC", 0),
    ] {
        let fault = read(text).err().unwrap_or_else(|| panic!("accepted {text}"));
        assert!(fault.to_string().contains(part), "{fault}");
        assert_eq!(fault.place.line, line, "{fault}");
    }
}

#[test]
fn limits_hold() {
    let deep = "<a>".repeat(10_000);
    assert!(matches!(*read(&deep).err().unwrap().kind, FaultKind::TooMuch { .. }));
    let wide: String = (0..200).map(|i| format!(" a{i}=''")).collect();
    assert!(matches!(*read(&format!("<a{wide}/>")).err().unwrap().kind, FaultKind::TooMuch { .. }));
    let limits = Limits { elements: 3, ..Limits::default() };
    let many = Document::read(b"<a><b/><b/><b/></a>", Path::new("x"), limits);
    assert!(matches!(*many.err().unwrap().kind, FaultKind::TooMuch { .. }));
}

#[test]
fn encodings() {
    let latin = b"<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><a x=\"\xe9\"/>";
    let document = Document::read(latin, Path::new("x"), Limits::default()).unwrap();
    assert_eq!(document.root().attribute("x"), Some("\u{e9}"));
    let mut wide = vec![0xFF, 0xFE];
    wide.extend("<a x='\u{e9}'/>".encode_utf16().flat_map(u16::to_le_bytes));
    let document = Document::read(&wide, Path::new("x"), Limits::default()).unwrap();
    assert_eq!(document.root().attribute("x"), Some("\u{e9}"));
    assert!(Document::read(b"<a x='\xe9'/>", Path::new("x"), Limits::default()).is_err());
    assert!(Document::read(&wide[..wide.len() - 1], Path::new("x"), Limits::default()).is_err());
}

#[test]
fn what_is_written_is_read_back() {
    let mut writer = Writer::default();
    let nasty = "a<b> & \"c\"\n\td'\u{e9}";
    writer.open("r").attribute("x", nasty).optional("no", None::<i32>).open("c").close();
    let text = writer.finish();
    let document = read(&text).unwrap();
    assert_eq!(document.root().attribute("x"), Some(nasty));
    assert!(document.root().child("c").is_some());
}
