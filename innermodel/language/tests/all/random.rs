//! Damaged texts.

use crate::{Disk, loaded, scenes};
use innermodel_language::format;

#[test]
fn no_text_makes_the_reader_panic() {
    let texts: Vec<_> = scenes()
        .into_iter()
        .map(|path| (std::fs::read_to_string(&path).expect("a scene"), path))
        .collect();
    arbtest::arbtest(|u| {
        let (text, path) = u.choose(&texts)?;
        let mut chars: Vec<char> = text.chars().collect();
        for _ in 0..u.int_in_range(1..=4)? {
            let at = u.choose_index(chars.len())?;
            let end = (at + u.int_in_range(0..=20)?).min(chars.len());
            let new = *u.choose(&[
                "",
                "<",
                ">",
                "\"",
                "/",
                "-->",
                "<!--",
                "&",
                "1e9",
                "é",
                "</transform>",
                "=",
            ])?;
            chars.splice(at..end, new.chars());
        }
        let text: String = chars.into_iter().collect();
        let (document, found, output) = loaded(&Disk, path, &text);
        if !found.has_errors() {
            let formatted = format(&text);
            assert_eq!(format(&formatted), formatted);
            let (again, _, _) = loaded(&Disk, path, &formatted);
            assert_eq!(again, document, "{output}");
        }
        Ok(())
    })
    .size_min(64)
    .budget_ms(1500);
}
