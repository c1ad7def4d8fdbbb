//! docs/smdsl.md lists every diagnostic.

const PAGE: &str = include_str!("../../../docs/smdsl.md");

#[test]
fn every_diagnostic_is_on_the_page() {
    let sources = [
        include_str!("../../src/check.rs"),
        include_str!("../../src/parse.rs"),
        include_str!("../../src/resolve.rs"),
        include_str!("../../src/scxml.rs"),
        include_str!("../../../syntax/xml/src/lib.rs"),
        include_str!("../../src/builder.rs"),
    ];
    let quoted = sources.iter().flat_map(|s| s.split('"').skip(1).step_by(2));
    let codes = quoted.filter(|text| {
        text.contains('-') && text.bytes().all(|b| b == b'-' || b.is_ascii_lowercase())
    });
    let missing: Vec<&str> = codes
        .filter(|code| !PAGE.contains(&format!("`{code}`")))
        .collect();
    assert_eq!(missing, [""; 0]);
}
