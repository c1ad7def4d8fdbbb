//! `rcgen index`: what folders hold, as a text, a document or a page.

use crate::datasheet::STYLE;
use crate::reports::{Failure, print, print_line, system};
use rc_diagnostics::foreign::clean;
use rcgen::index::{Index, IndexedComponent};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Hides the rows of the page that do not have all words of the search.
const SEARCH: &str = "\
const q=document.getElementById('q');\
q.addEventListener('input',()=>{const words=q.value.toLowerCase().split(/\\s+/);\
for(const row of document.querySelectorAll('tbody tr')){const text=row.textContent.toLowerCase();\
row.hidden=!words.every(word=>text.includes(word))}});";

/// Makes the index of some paths. With `since`, prints what has changed since then.
pub(crate) fn index(
    paths: &[PathBuf],
    include: &[PathBuf],
    output: Option<&Path>,
    since: Option<&Path>,
) -> Result<(), Failure> {
    let index = Index::of(paths, include).map_err(system)?;
    let before = since.map(read).transpose()?;
    if let Some(path) = output {
        let text = match path.extension().and_then(|ending| ending.to_str()) {
            Some("html") => page(&index),
            Some("json") => document(&index)?,
            _ => {
                let message = format!(
                    "the index is written as .json or .html, not as {}",
                    path.display()
                );
                return Err(Failure::Usage(message));
            }
        };
        rc_files::write(path, text).map_err(|e| system(format!("{}: {e}", path.display())))?;
    }
    let Some(before) = before else {
        if output.is_none() {
            print(&text(&index));
        }
        return Ok(());
    };
    let changes = index.changes(&before);
    for change in &changes {
        let mark = if change.breaks { "!" } else { " " };
        print_line(format_args!("{mark} {}", clean(&change.text)));
    }
    if changes.iter().any(|change| change.breaks) {
        return Err(Failure::Input);
    }
    Ok(())
}

/// Reads an index that was written before.
fn read(path: &Path) -> Result<Index, Failure> {
    let text = rc_files::read(path).map_err(|e| system(format!("{}: {e}", path.display())))?;
    serde_json::from_str(&text).map_err(|error| {
        let help = "`rcgen index DIR -o FILE.json` writes one";
        Failure::Usage(format!(
            "{} is not an index: {error}; {help}",
            path.display()
        ))
    })
}

fn document(index: &Index) -> Result<String, Failure> {
    let text = serde_json::to_string_pretty(index).map_err(system)?;
    Ok(text + "\n")
}

/// Names of the interfaces of a component in a role, with commas.
fn interfaces(component: &IndexedComponent, role: &str) -> String {
    let slots = component.slots.iter().filter(|slot| slot.role == role);
    let short = |name: &str| name.rsplit("::").next().unwrap_or_default().to_owned();
    let mut names: Vec<String> = slots.map(|slot| short(&slot.interface)).collect();
    names.dedup();
    names.join(", ")
}

const ROLES: [&str; 4] = ["implements", "requires", "publishes", "subscribesTo"];

/// The index for people.
fn text(index: &Index) -> String {
    let mut out = String::new();
    for component in &index.components {
        let broken = if component.broken { ", broken" } else { "" };
        let licence = component.licence.iter().map(|name| format!(", {name}"));
        let about: String = licence.collect();
        let _ = writeln!(
            out,
            "{} ({}{about}{broken}): {}",
            component.name,
            component.language,
            component.file.display()
        );
        for role in ROLES {
            let names = interfaces(component, role);
            if !names.is_empty() {
                let _ = writeln!(out, "    {role} {names}");
            }
        }
    }
    let _ = writeln!(out);
    for interface in &index.interfaces {
        let several = if interface.hashes.len() > 1 {
            format!(", {} different definitions", interface.hashes.len())
        } else {
            String::new()
        };
        let _ = writeln!(out, "{}{several}", interface.name);
        for (role, names) in &interface.users {
            let _ = writeln!(out, "    {role}: {}", names.join(", "));
        }
    }
    let faults = &index.faults;
    if !faults.is_empty() {
        let _ = writeln!(out, "\nbroken:");
        faults.iter().for_each(|fault| {
            let _ = writeln!(out, "    {fault}");
        });
    }
    let counts = [
        (index.components.len(), "component"),
        (index.interfaces.len(), "interface"),
        (faults.len(), "fault"),
    ];
    let counts = counts.map(|(count, what)| match count {
        1 => format!("1 {what}"),
        _ => format!("{count} {what}s"),
    });
    let _ = writeln!(out, "\n{}", counts.join(", "));
    out
}

/// A table of rows of cells.
fn table(out: &mut String, titles: &[&str], rows: impl Iterator<Item = Vec<String>>) {
    let line = |out: &mut String, tag: &str, cells: &[String]| {
        let cells = cells.iter().map(|cell| {
            format!(
                "<{tag}>{}</{tag}>",
                rc_diagnostics::xml::escaped(&clean(cell))
            )
        });
        let _ = writeln!(out, "<tr>{}</tr>", cells.collect::<String>());
    };
    out.push_str("<table><thead>\n");
    let titles: Vec<String> = titles.iter().map(|title| (*title).to_owned()).collect();
    line(out, "th", &titles);
    out.push_str("</thead><tbody>\n");
    rows.for_each(|cells| line(out, "td", &cells));
    out.push_str("</tbody></table>\n");
}

/// A page that needs nothing else, with a search.
fn page(index: &Index) -> String {
    let mut out = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>Components</title>\n\
         <style>{STYLE}</style>\n<input id=\"q\" placeholder=\"search\" autofocus>\n<h2>Components</h2>\n"
    );
    let titles = [
        "component",
        "language",
        "licence",
        ROLES[0],
        ROLES[1],
        ROLES[2],
        ROLES[3],
        "file",
        "",
    ];
    let components = index.components.iter().map(|component| {
        let mut row = vec![
            component.name.clone(),
            component.language.clone(),
            component.licence.clone().unwrap_or_default(),
        ];
        row.extend(ROLES.map(|role| interfaces(component, role)));
        row.push(component.file.display().to_string());
        row.push(if component.broken {
            "broken".to_owned()
        } else {
            component.doc.join(" ")
        });
        row
    });
    table(&mut out, &titles, components);
    out.push_str("<h2>Interfaces</h2>\n");
    let titles = ["interface", ROLES[0], ROLES[1], ROLES[2], ROLES[3], "hash"];
    let interfaces = index.interfaces.iter().map(|interface| {
        let users = |role: &str| {
            interface
                .users
                .get(role)
                .map_or_else(String::new, |all| all.join(", "))
        };
        let mut row = vec![interface.name.clone()];
        row.extend(ROLES.map(users));
        row.push(interface.hashes.join(", "));
        row
    });
    table(&mut out, &titles, interfaces);
    if !index.faults.is_empty() {
        out.push_str("<h2>Broken</h2>\n");
        table(
            &mut out,
            &["finding"],
            index.faults.iter().map(|fault| vec![fault.clone()]),
        );
    }
    let _ = writeln!(out, "<script>{SEARCH}</script>\n</html>");
    out
}
