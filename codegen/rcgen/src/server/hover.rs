//! Information about the symbol at a position: its declaration, the size of a type, the peers of a
//! slot, where a parameter is read, and the pages of findings.

use super::Server;
use super::file_key::key;
use super::findings::Place;
use super::names::{Kind, Symbol};
use crate::explain;
use rc_codegen::source_files;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

/// The most listed connections of a slot, and places of a parameter.
const MOST: usize = 50;

/// Limits of the search for a parameter: files of a worker, bytes of a file.
const MOST_FILES: usize = 200;
const LONGEST: u64 = 1 << 20;

impl Server {
    /// The meanings of the names at a position, and the pages of the findings there.
    pub(super) fn hover(&mut self, path: &Path, position: &Value) -> io::Result<Value> {
        let mut parts = Vec::new();
        for place in self.files.places(path, position, self.editor.encoding()) {
            let symbols = if place.declares {
                place.symbols
            } else {
                self.files.resolved(&place.symbols).into_iter().collect()
            };
            for symbol in symbols {
                parts.extend(self.described(&symbol)?);
            }
        }
        parts.extend(self.pages(path, position));
        let mut seen = BTreeSet::new();
        parts.retain(|part| seen.insert(part.clone()));
        if parts.is_empty() {
            return Ok(Value::Null);
        }
        Ok(json!({ "contents": { "kind": "markdown", "value": parts.join("\n\n") } }))
    }

    /// A symbol for people, in Markdown.
    fn described(&mut self, symbol: &Symbol) -> io::Result<Option<String>> {
        self.files.know(&symbol.file);
        let names = self.files.known(&symbol.file);
        let declared = names.and_then(|names| names.declared(symbol.kind, &symbol.name));
        let (Some(names), Some((written, doc))) = (names, declared) else {
            return Ok(None);
        };
        let mut lines = vec![format!("```text\n{written}\n```")];
        if !doc.is_empty() {
            lines.push(doc);
        }
        match symbol.kind {
            Kind::Type => lines.extend(names.sizes.get(&symbol.name).cloned()),
            Kind::Slot => {
                let slot = names.slots.iter().find(|slot| slot.name == symbol.name);
                lines.extend(slot.map(|slot| {
                    format!("`{}` {} `{}`", slot.name, slot.role.word(), slot.interface)
                }));
                self.know_networks()?;
                let peers = self.peers(symbol);
                if !peers.is_empty() {
                    lines.push(peers.join("\n"));
                }
            }
            Kind::Parameter => {
                let places = self.read_at(symbol);
                if !places.is_empty() {
                    lines.push(format!("Read at:\n{}", places.join("\n")));
                }
            }
            _ => {}
        }
        Ok(Some(lines.join("\n\n")))
    }

    /// The peers of a slot in each network, as lines of a list.
    fn peers(&self, slot: &Symbol) -> Vec<String> {
        let mut lines = Vec::new();
        for wired in self.networks.wired() {
            let network = &wired.network;
            let own = wired.ends.iter().filter(|end| end.slot == *slot);
            for end in own.take(MOST) {
                let before = lines.len();
                for joined in &wired.connections {
                    let middleware = joined
                        .middleware
                        .map_or(String::new(), |m| format!(" over {m}"));
                    if joined.consumer == *end {
                        let peer = &joined.provider.path;
                        lines.push(format!(
                            "- `{network}`: `{}` ← `{peer}`{middleware}",
                            end.path
                        ));
                    } else if joined.provider == *end {
                        let peer = &joined.consumer.path;
                        lines.push(format!(
                            "- `{network}`: `{}` → `{peer}`{middleware}",
                            end.path
                        ));
                    }
                }
                if lines.len() == before {
                    lines.push(format!("- `{network}`: `{}` has no peer", end.path));
                }
            }
        }
        lines.truncate(MOST);
        lines
    }

    /// The places of workers that read a parameter, as lines of a list.
    fn read_at(&self, parameter: &Symbol) -> Vec<String> {
        let users = self.files.iter();
        let users = users.filter(|(_, names)| names.parameters.contains(&parameter.file));
        let mut lines = Vec::new();
        for (cdsl, _) in users {
            let Some(folder) = cdsl.parent() else {
                continue;
            };
            for file in worker_files(&folder.join("src")) {
                let Ok(text) = rc_files::read(&file) else {
                    continue;
                };
                for (number, line) in text.lines().enumerate() {
                    if lines.len() < MOST && reads(line, &parameter.name) {
                        let number = number + 1;
                        let uri = self.editor.address(&key(&file));
                        let name = file.strip_prefix(folder).unwrap_or(&file).display();
                        lines.push(format!("- [{name}:{number}]({uri}#L{number})"));
                    }
                }
            }
        }
        lines
    }

    /// The pages of the findings at a position.
    fn pages(&self, path: &Path, position: &Value) -> Vec<String> {
        let here = json!({ "start": position, "end": position });
        let at = self.findings.of(path).into_iter();
        let at = at.filter(|diagnostic| Place::meet(&diagnostic["range"], &here));
        let all = explain::pages();
        at.filter_map(|diagnostic| {
            let page = all.iter().find(|page| diagnostic["code"] == page.code)?;
            Some(format!("### {}\n\n{}", page.code, page.text))
        })
        .collect()
    }
}

/// The files of a worker in Rust or in Python.
pub(super) fn worker_files(src: &Path) -> Vec<PathBuf> {
    let wanted = |path: &Path| {
        let ending = path.extension().and_then(|ending| ending.to_str());
        let is_short = || path.metadata().is_ok_and(|data| data.len() <= LONGEST);
        matches!(ending, Some("rs" | "py")) && is_short()
    };
    let files = source_files::files(&[src.to_path_buf()], &wanted);
    let mut files = files.unwrap_or_default();
    files.truncate(MOST_FILES);
    files
}

/// Whether a line of code reads a parameter: a field with its name after a `.`, for a group the
/// field of the group before it.
fn reads(line: &str, parameter: &str) -> bool {
    let wanted = format!(".{parameter}");
    let code = line.split("//").next().unwrap_or(line);
    code.match_indices(&wanted).any(|(at, _)| {
        let behind = code[at + wanted.len()..].chars().next();
        !behind.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '(')
    })
}

#[cfg(test)]
mod tests {
    use super::reads;

    #[test]
    fn a_line_that_reads_a_parameter_names_its_field() {
        for (line, expected) in [
            ("let a = ctx.parameters().motor.speed;", true),
            ("p.motor.speed", true),
            ("p.motor.speed_limit", false),
            ("speed = 3", false),
            ("// p.motor.speed", false),
            ("p.motor.speed()", false),
        ] {
            assert_eq!(reads(line, "motor.speed"), expected, "{line}");
        }
    }
}
