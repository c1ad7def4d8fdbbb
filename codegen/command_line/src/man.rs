//! Man pages from a command line.

use crate::Tool;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, bold, roman};
use std::io;

/// A man page.
#[derive(Clone, Debug)]
pub struct Page {
    /// The name of its file, for example `rcgen-init.1`.
    pub file: String,
    /// Contents of the page, in roff.
    pub text: String,
}

pub(crate) fn pages(tool: &Tool, command: clap::Command) -> Vec<Page> {
    let mut command = command.disable_help_subcommand(true);
    command.build();
    let version = command.get_version().unwrap_or_default().to_owned();
    let mut pages = Vec::new();
    add(tool, &version, &command, &[], &mut pages);
    pages
}

/// Adds the page of a command and those of its subcommands. `parents` are the titles of the pages
/// above.
fn add(
    tool: &Tool,
    version: &str,
    command: &clap::Command,
    parents: &[String],
    pages: &mut Vec<Page>,
) {
    let title = command.get_display_name().unwrap_or(command.get_name());
    // Writing into memory does not fail.
    let text = text(tool, version, command, parents).unwrap_or_default();
    pages.push(Page {
        file: format!("{title}.1"),
        text: ascii(&String::from_utf8_lossy(&text)),
    });
    let parents = [parents, &[title.to_owned()]].concat();
    for command in command.get_subcommands().filter(|sub| !sub.is_hide_set()) {
        add(tool, version, command, &parents, pages);
    }
}

fn text(
    tool: &Tool,
    version: &str,
    command: &clap::Command,
    parents: &[String],
) -> io::Result<Vec<u8>> {
    let page = Man::new(command.clone())
        .source(format!("{} {version}", tool.name))
        .manual("RoboComp in Rust");
    let mut text = Vec::new();
    page.render_title(&mut text)?;
    page.render_name_section(&mut text)?;
    page.render_synopsis_section(&mut text)?;
    page.render_description_section(&mut text)?;
    page.render_options_section(&mut text)?;
    if command.get_subcommands().any(|sub| !sub.is_hide_set()) {
        page.render_subcommands_section(&mut text)?;
    }
    let mut roff = Roff::default();
    roff.control("SH", ["EXIT STATUS"]);
    for (code, meaning) in tool.exit_codes {
        roff.control("TP", []);
        roff.text([bold(code.to_string())]);
        roff.text([roman(*meaning)]);
    }
    if let Some((parent, before)) = parents.split_last() {
        roff.control("SH", ["SEE ALSO"]);
        for title in before {
            roff.text([bold(title.clone()), roman("(1),")]);
        }
        roff.text([bold(parent.clone()), roman("(1)")]);
    }
    roff.to_writer(&mut text)?;
    Ok(text)
}

/// Replaces characters that roff reads only with the right locale by their escapes.
fn ascii(text: &str) -> String {
    let escape = |c: char| format!("\\[u{:04X}]", u32::from(c));
    let parts = text.chars().map(|c| {
        if c.is_ascii() {
            c.to_string()
        } else {
            escape(c)
        }
    });
    parts.collect()
}
