//! The findings of all checks, by the file that they are about.

use super::place::Encoding;
use rc_diagnostics::foreign::clean_lines;
use rc_diagnostics::{Diagnostic, Diagnostics, Severity, SourceId, SourceMap};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::{Path, PathBuf};

/// Limits: findings of a file, places of a finding, bytes of a text.
const MOST: usize = 200;
const LABELS: usize = 12;
const LONGEST: usize = 4_000;

/// The edit that solves a finding.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fix {
    pub(super) title: String,
    /// `range` and `newText`.
    pub(super) edit: Value,
    pub(super) certain: bool,
}

/// A finding, as the protocol has it.
#[derive(Clone, Debug, PartialEq)]
struct Finding {
    diagnostic: Value,
    fix: Option<Fix>,
}

/// The result of one check.
#[derive(Debug, Default)]
struct Checked {
    reads: BTreeSet<PathBuf>,
    /// Files with the texts of their findings.
    found: Vec<(PathBuf, String)>,
}

/// The subject of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Phase {
    /// A file, as `rcgen check` judges it.
    File,
    /// A network with all of its components, as `rcdeploy check` judges it.
    Network,
}

/// The findings of all checks. Two files that read one report it once.
#[derive(Debug, Default)]
pub(super) struct Findings {
    checks: BTreeMap<(PathBuf, Phase), Checked>,
    /// By file and text: how many checks have a finding.
    shown: BTreeMap<PathBuf, BTreeMap<String, (usize, Finding)>>,
    /// Files with another text, until a check has read it.
    forgotten: BTreeSet<PathBuf>,
}

impl Findings {
    /// Takes the findings of a check of `path`; `files` has the file of each source, with its address. Returns the files whose findings changed.
    pub(super) fn checked(
        &mut self,
        (path, phase): (&Path, Phase),
        sources: &SourceMap,
        files: &HashMap<SourceId, (PathBuf, String)>,
        found: &Diagnostics,
        encoding: Encoding,
    ) -> BTreeSet<PathBuf> {
        let place = |id| files.get(&id);
        let paths = files.values().map(|(path, _)| path);
        let mut now = Checked {
            // The file itself, also where it could not be read.
            reads: paths.cloned().chain([path.to_path_buf()]).collect(),
            found: Vec::new(),
        };
        let mut counts: BTreeMap<&PathBuf, usize> = BTreeMap::new();
        let mut changed: BTreeSet<PathBuf> = BTreeSet::new();
        let read = now.reads.iter();
        changed.extend(read.filter_map(|path| self.forgotten.take(path)));
        for diagnostic in found.sorted() {
            // Interfaces that come with this program have no file.
            let target = place(diagnostic.span.source);
            let target = target.map(|(path, _)| path);
            let Some(target) = target.filter(|path| rc_files::unsaved::exists(path)) else {
                continue;
            };
            let count = counts.entry(target).or_default();
            *count += 1;
            if *count > MOST {
                continue;
            }
            let finding = Finding::new(sources, diagnostic, encoding, &place);
            let text = finding.diagnostic.to_string();
            let all = self.shown.entry(target.clone()).or_default();
            all.entry(text.clone()).or_insert_with(|| {
                changed.insert(target.clone());
                (0, finding)
            });
            if let Some((count, _)) = all.get_mut(&text) {
                *count += 1;
            }
            now.found.push((target.clone(), text));
        }
        let before = if files.is_empty() {
            // It could not be read: nothing is known of it any more.
            self.checks.remove(&(path.to_path_buf(), phase))
        } else {
            self.checks.insert((path.to_path_buf(), phase), now)
        };
        self.drop(before, &mut changed);
        changed
    }

    /// The last check of a network depends on these files, too.
    pub(super) fn also_reads(&mut self, network: &Path, files: Vec<PathBuf>) {
        let check = (network.to_path_buf(), Phase::Network);
        if let Some(checked) = self.checks.get_mut(&check) {
            checked.reads.extend(files);
        }
    }

    /// A network as a whole has no findings any more. Returns the files whose findings changed.
    pub(super) fn unchecked(&mut self, network: &Path) -> BTreeSet<PathBuf> {
        let mut changed = BTreeSet::new();
        let before = self.checks.remove(&(network.to_path_buf(), Phase::Network));
        self.drop(before, &mut changed);
        changed
    }

    /// Takes away what an earlier check found.
    fn drop(&mut self, before: Option<Checked>, changed: &mut BTreeSet<PathBuf>) {
        for (target, text) in before.into_iter().flat_map(|checked| checked.found) {
            let Some(all) = self.shown.get_mut(&target) else {
                continue;
            };
            let left = all.get_mut(&text).map(|(count, _)| {
                *count -= 1;
                *count
            });
            if left == Some(0) {
                all.remove(&text);
                changed.insert(target);
            }
        }
    }

    /// A file has another text: the findings in the previous text have no places any more.
    pub(super) fn forget(&mut self, path: &Path) {
        self.shown.remove(path);
        self.forgotten.insert(path.to_path_buf());
        for checked in self.checks.values_mut() {
            checked.found.retain(|(target, _)| target != path);
        }
    }

    /// The checked files that read `path`.
    pub(super) fn readers(&self, path: &Path) -> Vec<PathBuf> {
        let readers = self.checks.iter();
        let readers = readers.filter(|(_, checked)| checked.reads.contains(path));
        let mut readers: Vec<PathBuf> = readers.map(|((reader, _), _)| reader.clone()).collect();
        readers.dedup();
        readers
    }

    /// All checked files.
    pub(super) fn all(&self) -> Vec<PathBuf> {
        let files = self.checks.keys();
        let files = files.filter(|(_, phase)| *phase == Phase::File);
        files.map(|(path, _)| path.clone()).collect()
    }

    /// The findings about a file in its order.
    fn about(&self, path: &Path) -> Vec<&Finding> {
        let all = self.shown.get(path).into_iter().flat_map(BTreeMap::values);
        let mut all: Vec<&Finding> = all.map(|(_, finding)| finding).collect();
        all.sort_by_key(|finding| Place::of(&finding.diagnostic["range"]["start"]));
        all.truncate(MOST);
        all
    }

    /// The findings about a file, as the protocol has them.
    pub(super) fn of(&self, path: &Path) -> Vec<Value> {
        let all = self.about(path).into_iter();
        all.map(|finding| finding.diagnostic.clone()).collect()
    }

    /// The findings about a file that can be fixed.
    pub(super) fn fixes(&self, path: &Path) -> Vec<(Value, Fix)> {
        let all = self.about(path).into_iter();
        all.filter_map(|finding| Some((finding.diagnostic.clone(), finding.fix.clone()?)))
            .collect()
    }
}

/// The edits that can be made together, in their order: of those that overlap, the first.
pub(super) fn together(mut edits: Vec<Value>) -> Vec<Value> {
    edits.sort_by_key(|edit| Place::of(&edit["range"]["start"]));
    let mut last: Option<(Place, Place)> = None;
    edits.retain(|edit| {
        let ends = |end: &str| Place::of(&edit["range"][end]);
        let (Some(start), Some(end)) = (ends("start"), ends("end")) else {
            return false;
        };
        let kept = last.is_none_or(|(from, to)| start >= to && (start, end) != (from, to));
        if kept {
            last = Some((start, end));
        }
        kept
    });
    edits
}

impl Finding {
    fn new<'a>(
        sources: &SourceMap,
        diagnostic: &Diagnostic,
        encoding: Encoding,
        place: &dyn Fn(SourceId) -> Option<&'a (PathBuf, String)>,
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
                let (_, address) = place(label.span.source)?;
                Some(json!({
                    "location": { "uri": address, "range": encoding.range(sources, label.span) },
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
        let fix = diagnostic.fix.as_ref().and_then(|fix| {
            let edit = fix.edit(sources, diagnostic.span)?;
            let title = match fix.old.as_str() {
                "" => format!("Add `{}`", text(edit.text.trim())),
                _ => format!("Write `{}`", text(&edit.text)),
            };
            let range = encoding.range(sources, edit.span);
            Some(Fix {
                title,
                edit: json!({ "range": range, "newText": edit.text }),
                certain: fix.certain,
            })
        });
        Self {
            diagnostic: value,
            fix,
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
