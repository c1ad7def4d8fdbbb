//! `rcgen datasheet`: a component on one page.

use crate::command_line::{Common, SheetForm};
use crate::component::described;
use crate::reports::{Failure, print, system};
use pulldown_cmark::{Event, Options, Parser, Tag, html};
use rc_cdsl::model::Middleware;
use rc_codegen::generate;
use std::path::Path;

/// The layout of pages.
pub(crate) const STYLE: &str = "body{font:16px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}\
table{border-collapse:collapse}td,th{border:1px solid #bbb;padding:.2em .6em;text-align:left}\
code{background:#f2f2f2;padding:0 .2em}";

/// Prints the data sheet of a component, or writes it to a file.
pub(crate) fn print_sheet(
    file: &Path,
    common: &Common,
    form: Option<SheetForm>,
    output: Option<&Path>,
) -> Result<(), Failure> {
    let ending = output.and_then(Path::extension);
    let form = form.unwrap_or_else(|| match ending.and_then(|ending| ending.to_str()) {
        Some("html") => SheetForm::Html,
        Some("json") => SheetForm::Json,
        _ => SheetForm::Md,
    });
    let text = described(file, common, |project| match form {
        SheetForm::Md | SheetForm::Html => generate::datasheet(project, Middleware::DEFAULT),
        SheetForm::Json => generate::view(project, Middleware::DEFAULT),
    })?;
    let text = match form {
        SheetForm::Html => page(&text),
        SheetForm::Md | SheetForm::Json => text,
    };
    let Some(path) = output else {
        print(&text);
        return Ok(());
    };
    let written = rc_files::write(path, &text);
    written.map_err(|error| system(format!("{}: {error}", path.display())))
}

/// Whether a link is one to a page: others, such as `javascript:`, run something.
fn leads_to_page(link: &str) -> bool {
    match link.split_once(':') {
        Some((scheme, _)) => {
            let known = ["http", "https", "mailto"];
            known.iter().any(|one| scheme.eq_ignore_ascii_case(one))
        }
        None => true,
    }
}

/// A page of Markdown as HTML. What descriptions say is text: markup in it is shown, not obeyed.
fn page(markdown: &str) -> String {
    let events = Parser::new_ext(markdown, Options::ENABLE_TABLES).map(|mut event| match event {
        Event::Html(text) | Event::InlineHtml(text) => Event::Text(text),
        Event::Start(
            Tag::Link {
                ref mut dest_url, ..
            }
            | Tag::Image {
                ref mut dest_url, ..
            },
        ) if !leads_to_page(dest_url) => {
            *dest_url = "#".into();
            event
        }
        other => other,
    });
    let mut body = String::new();
    html::push_html(&mut body, events);
    let title = markdown.lines().next().unwrap_or_default();
    let title = title.trim_start_matches("# ");
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>{title}</title>\n\
         <style>{STYLE}</style>\n{body}</html>\n"
    )
}
