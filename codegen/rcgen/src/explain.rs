//! A page for each diagnostic code. The texts are in `explain/`, one section for each code.

const PAGES: [&str; 12] = [
    include_str!("../explain/common.md"),
    include_str!("../explain/idsl.md"),
    include_str!("../explain/cdsl.md"),
    include_str!("../explain/pdsl.md"),
    include_str!("../explain/smdsl.md"),
    include_str!("../explain/ddsl.md"),
    include_str!("../explain/gdsl.md"),
    include_str!("../explain/dproto.md"),
    include_str!("../explain/kdsl.md"),
    include_str!("../explain/graph.md"),
    include_str!("../explain/innermodel.md"),
    include_str!("../explain/rcgen.md"),
];

/// The page of one code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Page {
    /// The code.
    pub code: &'static str,
    /// Markdown, with a wrong and a right example if a text can show them.
    pub text: &'static str,
}

/// All pages, in the order of their codes.
pub fn pages() -> Vec<Page> {
    let sections = PAGES.into_iter().flat_map(|text| {
        // Skip the title of the file.
        let after_title = || text.split_once("\n## ").map_or("", |(_, rest)| rest);
        let text = text.strip_prefix("## ").unwrap_or_else(after_title);
        text.split("\n## ")
    });
    let pages = sections.filter_map(|section| {
        let (code, text) = section.split_once('\n')?;
        Some(Page {
            code: code.trim(),
            text: text.trim(),
        })
    });
    let mut pages: Vec<Page> = pages.collect();
    pages.sort_by_key(|page| page.code);
    pages
}
