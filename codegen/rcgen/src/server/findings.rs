//! The findings of all checks, by the file that they are about.

use super::place::{Encoding, uri};
use rc_diagnostics::foreign::clean_lines;
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, SourceMap};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// How many findings of a file are shown, how many places of each, and how long their texts are.
const MOST: usize = 200;
const LABELS: usize = 12;
const LONGEST: usize = 4_000;

/// The edit that solves a finding.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mend {
    pub(super) title: String,
    /// `range` and `newText`.
    pub(super) edit: Value,
    pub(super) certain: bool,
}

/// A finding, as the protocol has it.
#[derive(Clone, Debug, PartialEq)]
struct Finding {
    diagnostic: Value,
    mend: Option<Mend>,
}

/// What one check gave.
#[derive(Debug, Default)]
struct Checked {
    reads: BTreeSet<PathBuf>,
    found: BTreeMap<PathBuf, Vec<Finding>>,
}

/// The findings of all checks. Two files that read one report it once.
#[derive(Debug, Default)]
pub(super) struct Findings {
    checks: BTreeMap<PathBuf, Checked>,
}

impl Findings {
    /// Takes the findings of a check of `path`. Returns the files whose findings are others now.
    pub(super) fn checked(
        &mut self,
        path: &Path,
        sources: &SourceMap,
        found: &Diagnostics,
        encoding: Encoding,
    ) -> Vec<PathBuf> {
        let paths: Vec<PathBuf> = sources
            .ids()
            .map(|id| super::key(sources.path(id)))
            .collect();
        let mut now = Checked {
            // The file itself, also where it could not be read.
            reads: paths.iter().cloned().chain([path.to_path_buf()]).collect(),
            found: BTreeMap::new(),
        };
        let place = |id| paths.get(sources.ids().position(|one| one == id)?);
        for diagnostic in found.sorted() {
            // Interfaces that come with this program have no file.
            let Some(target) =
                place(diagnostic.span.source).filter(|path| rc_files::unsaved::exists(path))
            else {
                continue;
            };
            let all = now.found.entry(target.clone()).or_default();
            if all.len() < MOST {
                all.push(Finding::new(sources, diagnostic, encoding, &place));
            }
        }
        let before = self.checks.get(path);
        let targets: BTreeSet<PathBuf> = now
            .found
            .keys()
            .chain(before.into_iter().flat_map(|checked| checked.found.keys()))
            .cloned()
            .collect();
        let shown: Vec<Vec<Value>> = targets.iter().map(|target| self.of(target)).collect();
        self.checks.insert(path.to_path_buf(), now);
        let both = targets.into_iter().zip(shown);
        both.filter(|(target, before)| self.of(target) != *before)
            .map(|(target, _)| target)
            .collect()
    }

    /// The checked files that read `path`.
    pub(super) fn readers(&self, path: &Path) -> Vec<PathBuf> {
        let readers = self
            .checks
            .iter()
            .filter(|(_, checked)| checked.reads.contains(path));
        readers.map(|(reader, _)| reader.clone()).collect()
    }

    fn about<'a>(&'a self, path: &'a Path) -> impl Iterator<Item = &'a Finding> {
        let all = self.checks.values();
        all.filter_map(move |checked| checked.found.get(path))
            .flatten()
    }

    /// The findings about a file, as the protocol has them.
    pub(super) fn of(&self, path: &Path) -> Vec<Value> {
        let mut all: Vec<Value> = Vec::new();
        for finding in self.about(path) {
            if all.len() < MOST && !all.contains(&finding.diagnostic) {
                all.push(finding.diagnostic.clone());
            }
        }
        all
    }

    /// The findings about a file that can be mended.
    pub(super) fn mends(&self, path: &Path) -> Vec<(Value, Mend)> {
        let mut all: Vec<(Value, Mend)> = Vec::new();
        for finding in self.about(path) {
            if let Some(mend) = &finding.mend
                && all.len() < MOST
                && !all.iter().any(|(known, _)| *known == finding.diagnostic)
            {
                all.push((finding.diagnostic.clone(), mend.clone()));
            }
        }
        all
    }
}

impl Finding {
    fn new<'a>(
        sources: &SourceMap,
        diagnostic: &Diagnostic,
        encoding: Encoding,
        place: &dyn Fn(rc_diagnostics::SourceId) -> Option<&'a PathBuf>,
    ) -> Self {
        let text = |text: &str| clean_lines(text, LONGEST);
        let message = match &diagnostic.help {
            Some(help) => format!("{}\nhelp: {}", text(&diagnostic.message), text(help)),
            None => text(&diagnostic.message),
        };
        let severity = match diagnostic.severity {
            Severity::Error => 1,
            Severity::Warning => 2,
            Severity::Note => 3,
        };
        let related: Vec<Value> = diagnostic
            .labels
            .iter()
            .take(LABELS)
            .filter_map(|label| {
                let target = place(label.span.source)?;
                Some(json!({
                    "location": { "uri": uri(target), "range": encoding.range(sources, label.span) },
                    "message": text(&label.message),
                }))
            })
            .collect();
        let mut value = json!({
            "range": encoding.range(sources, diagnostic.span),
            "severity": severity,
            "code": diagnostic.code,
            "source": "rcgen",
            "message": message,
            "relatedInformation": related,
        });
        if diagnostic.code.starts_with("unused-") {
            value["tags"] = json!([1]);
        }
        let mend = diagnostic.mend.as_ref().and_then(|mend| {
            let edit = mend.edit(sources, diagnostic.span)?;
            let new = text(&edit.text);
            let title = match mend.old.as_str() {
                "" => format!("Add `{new}`"),
                _ => format!("Write `{new}`"),
            };
            let range = encoding.range(sources, edit.span);
            Some(Mend {
                title,
                edit: json!({ "range": range, "newText": edit.text }),
                certain: mend.certain,
            })
        });
        Self {
            diagnostic: value,
            mend,
        }
    }
}

/// A place in a text: line, then character.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place(u64, u64);

impl Place {
    fn of(position: &Value) -> Option<Self> {
        Some(Self(
            position["line"].as_u64()?,
            position["character"].as_u64()?,
        ))
    }

    /// Whether two ranges share a place, their ends included.
    pub(super) fn meet(one: &Value, other: &Value) -> bool {
        let ends = |range: &Value| Some((Self::of(&range["start"])?, Self::of(&range["end"])?));
        let (Some((a, b)), Some((c, d))) = (ends(one), ends(other)) else {
            return false;
        };
        a <= d && c <= b
    }
}
