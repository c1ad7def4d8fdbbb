//! One page: Markdown as HTML, with anchors of headings as GitHub makes them, and links to other pages
//! of the book.

use pulldown_cmark::{CodeBlockKind, CowStr, Event, Options, Parser, Tag, TagEnd, html};
use std::collections::BTreeMap;

pub(super) struct Page {
    /// Its file below `docs`.
    pub(super) file: String,
    /// Its place in the book.
    pub(super) place: String,
    pub(super) title: String,
    /// Texts and anchors.
    pub(super) headings: Vec<(String, String)>,
    pub(super) html: String,
}

/// The place of a page in the book: `time.md` is `time.html`.
pub(super) fn place(file: &str) -> String {
    match file.strip_suffix(".md") {
        Some(stem) => format!("{stem}.html"),
        None => file.to_owned(),
    }
}

/// A text as HTML.
pub(super) fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}

/// The address in the book of what a page links to.
fn address(target: &str) -> String {
    if target.contains("://") {
        return target.to_owned();
    }
    let (file, anchor) = target.split_at(target.find('#').unwrap_or(target.len()));
    place(file) + anchor
}

/// The anchor of a heading.
fn anchor(text: &str) -> String {
    let kept = |c: &char| c.is_alphanumeric() || "-_ ".contains(*c);
    let text: String = text.to_lowercase().chars().filter(kept).collect();
    text.trim().replace(' ', "-")
}

/// Events with what the book changes. Readers do not see the marks of code blocks.
fn changed(event: Event<'_>) -> Event<'_> {
    match event {
        Event::Start(Tag::Link {
            link_type,
            dest_url,
            title,
            id,
        }) => Event::Start(Tag::Link {
            link_type,
            dest_url: address(&dest_url).into(),
            title,
            id,
        }),
        Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(info))) => {
            let tag = info.split(',').next().unwrap_or_default().to_owned();
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(tag.into())))
        }
        other => other,
    }
}

impl Page {
    pub(super) fn read(file: &str, text: &str) -> Self {
        let mut events: Vec<Event<'_>> = Parser::new_ext(text, Options::ENABLE_TABLES)
            .map(changed)
            .collect();
        let mut headings = Vec::new();
        let mut counts = BTreeMap::new();
        for at in 0..events.len() {
            if !matches!(events[at], Event::Start(Tag::Heading { .. })) {
                continue;
            }
            let inside = events[at..].iter();
            let inside =
                inside.take_while(|event| !matches!(event, Event::End(TagEnd::Heading(_))));
            let text: String = inside
                .filter_map(|event| match event {
                    Event::Text(text) | Event::Code(text) => Some(&**text),
                    _ => None,
                })
                .collect();
            let name = anchor(&text);
            let count: &mut usize = counts.entry(name.clone()).or_default();
            let name = if *count == 0 {
                name
            } else {
                format!("{name}-{count}")
            };
            *count += 1;
            if let Event::Start(Tag::Heading { id, .. }) = &mut events[at] {
                *id = Some(CowStr::from(name.clone()));
            }
            headings.push((text, name));
        }
        let mut html = String::new();
        html::push_html(&mut html, events.into_iter());
        Self {
            file: file.to_owned(),
            place: place(file),
            title: headings.first().map_or(file, |(text, _)| text).to_owned(),
            headings,
            html,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_headings_and_code_are_those_of_the_book() {
        let text = "# A `page`\n\n[one](../time.md#ticks), [two](https://x.org/a.md).\n\n## Ticks & more\n\n## Ticks & more\n\n\
                    ```console,not-run=no-robot\n$ ls <dir>\n```\n\n| a | b |\n|---|---|\n| 1 | 2 |\n";
        let page = Page::read("protocol/files.md", text);
        assert_eq!(page.place, "protocol/files.html");
        assert_eq!(page.title, "A page");
        let anchors: Vec<&str> = page.headings.iter().map(|(_, anchor)| &**anchor).collect();
        assert_eq!(anchors, ["a-page", "ticks--more", "ticks--more-1"]);
        for part in [
            "href=\"../time.html#ticks\"",
            "href=\"https://x.org/a.md\"",
            "<h2 id=\"ticks--more-1\">",
            "<code class=\"language-console\">$ ls &lt;dir&gt;",
            "<td>2</td>",
        ] {
            assert!(page.html.contains(part), "{part}: {}", page.html);
        }
        assert!(!page.html.contains("not-run"));
    }
}
