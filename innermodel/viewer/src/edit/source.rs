//! The text of the file that is edited, its tree, and the file on the disk.

use super::history::History;
use innermodel::language::Document;
use innermodel::language::rewrite::{self, Value};
use innermodel::{Folders, InnerModel, ROOT, Snapshot};
use rc_diagnostics::foreign::clean;
use rc_diagnostics::{Format, Severity, SourceMap, Span, render};
use std::collections::HashMap;
use std::ffi::OsString;
use std::fs::File;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// The mark at the start of some texts.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// The most files with changes of a file that were not saved.
const MOST_RESCUED: usize = 100;

/// Error of a file that cannot be edited.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OpenError {
    /// The system cannot read the file.
    #[error("{path}: {error}")]
    Unreadable {
        /// The file.
        path: String,
        /// Why.
        error: std::io::Error,
    },
    /// The file is wrong. The text has each finding with its line.
    #[error("{0}")]
    Wrong(String),
}

/// Where a node is written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Written {
    /// In this file: its tag.
    Here(Span),
    /// In a file that this one includes.
    Included {
        path: PathBuf,
        /// Its lengths have the unit of the file that includes it, and may be metres there.
        inherits: bool,
    },
}

/// The content of a text.
struct Content {
    model: Arc<InnerModel>,
    /// The tree that the text says.
    tree: Arc<Snapshot>,
    written: HashMap<String, Written>,
    /// Findings that are not errors, one a line.
    warnings: String,
}

/// A file that is edited: its text, and the tree that the text says.
pub(crate) struct Source {
    path: PathBuf,
    folders: Folders,
    text: String,
    content: Content,
    history: History,
    /// The text of the file on the disk, when it was read or written last.
    saved: String,
}

impl Source {
    /// Reads the file.
    pub(crate) fn open(path: &Path, folders: Folders) -> Result<Self, OpenError> {
        let text = rc_files::read(path).map_err(|error| OpenError::Unreadable {
            path: clean(&path.display().to_string()),
            error,
        })?;
        let content = load(path, &folders, &text).map_err(|wrong| OpenError::Wrong(wrong.all))?;
        Ok(Self {
            path: path.to_path_buf(),
            folders,
            saved: text.clone(),
            text,
            content,
            history: History::default(),
        })
    }

    pub(crate) fn model(&self) -> &Arc<InnerModel> {
        &self.content.model
    }

    /// Findings in the text that are not errors, one a line.
    pub(crate) fn warnings(&self) -> &str {
        &self.content.warnings
    }

    /// The name of the file without its folder.
    pub(crate) fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or(self.path.as_os_str());
        clean(&name.to_string_lossy())
    }

    /// The unit of the lengths in the text.
    pub(crate) fn units(&self) -> &'static str {
        rewrite::units(self.without_mark()).unwrap_or("millimetres")
    }

    /// Whether the text differs from that on the disk, when it was read or written last.
    pub(crate) fn is_changed(&self) -> bool {
        self.text != self.saved
    }

    /// The tag of a node that this file may change. The error is a sentence.
    pub(crate) fn tag(&self, id: &str) -> Result<Span, String> {
        match self.content.written.get(id) {
            Some(Written::Here(span)) => Ok(*span),
            Some(Written::Included { path, inherits }) => {
                let (id, path) = (clean(id), clean(&path.display().to_string()));
                let first = if *inherits {
                    ", with `units` first: alone, its lengths are millimetres"
                } else {
                    ""
                };
                Err(format!(
                    "`{id}` is written in {path}: edit that file{first}"
                ))
            }
            None if id == ROOT => Err(format!("`{ROOT}` is above all that the file has")),
            None => Err(format!("no node has the id `{}`", clean(id))),
        }
    }

    /// Sets an attribute of a node.
    pub(crate) fn set(&mut self, id: &str, name: &str, value: &Value) -> Result<(), String> {
        let tag = self.tag(id)?;
        let new = rewrite::set(self.without_mark(), tag, name, value);
        let no_attribute = || {
            format!(
                "`{}` cannot have the attribute `{}`",
                clean(id),
                clean(name)
            )
        };
        self.replace(new.ok_or_else(no_attribute)?)
    }

    /// Adds an element below a node, or at the outermost place, if `check` accepts the tree with
    /// it.
    pub(crate) fn add(
        &mut self,
        parent: Option<&str>,
        tag: &str,
        attributes: &[(&str, Value)],
        check: impl FnOnce(&Snapshot) -> Result<(), String>,
    ) -> Result<(), String> {
        let parent = parent.map(|id| self.tag(id)).transpose()?;
        let new = rewrite::add(self.without_mark(), parent, tag, attributes);
        self.replace_if(new.ok_or_else(not_there)?, check)
    }

    /// Removes a node with all below it.
    pub(crate) fn remove(&mut self, id: &str) -> Result<(), String> {
        let new = rewrite::remove(self.without_mark(), self.tag(id)?);
        self.replace(new.ok_or_else(not_there)?)
    }

    /// The text to which locations refer.
    fn without_mark(&self) -> &str {
        self.text
            .strip_prefix(BYTE_ORDER_MARK)
            .unwrap_or(&self.text)
    }

    /// Takes a new text without mark, if it is right. It can be undone.
    fn replace(&mut self, new: String) -> Result<(), String> {
        self.replace_if(new, |_| Ok(()))
    }

    fn replace_if(
        &mut self,
        new: String,
        check: impl FnOnce(&Snapshot) -> Result<(), String>,
    ) -> Result<(), String> {
        let has_mark = self.text.starts_with(BYTE_ORDER_MARK);
        let new = if has_mark {
            format!("{BYTE_ORDER_MARK}{new}")
        } else {
            new
        };
        if new == self.text {
            return Ok(());
        }
        let content = self.load(&new)?;
        check(&content.tree)?;
        self.history.record(&self.text, &new);
        (self.text, self.content) = (new, content);
        Ok(())
    }

    fn load(&self, text: &str) -> Result<Content, String> {
        load(&self.path, &self.folders, text).map_err(|wrong| wrong.first)
    }

    /// Returns to the tree of the text, without attempts. Nothing is read: an included file may be
    /// wrong at this moment.
    pub(crate) fn forget_trial(&self) {
        let Content { model, tree, .. } = &self.content;
        model.restore(tree.time(), tree);
    }

    /// Returns to the text before the last change. `false` if none is known.
    pub(crate) fn undo(&mut self) -> Result<bool, String> {
        let Some(text) = self.history.before(&self.text) else {
            return Ok(false);
        };
        self.content = self.load(&text)?;
        self.text = text;
        self.history.undo();
        Ok(true)
    }

    /// Repeats the change that was undone last. `false` if there is none.
    pub(crate) fn redo(&mut self) -> Result<bool, String> {
        let Some(text) = self.history.after(&self.text) else {
            return Ok(false);
        };
        self.content = self.load(&text)?;
        self.text = text;
        self.history.redo();
        Ok(true)
    }

    /// Writes the text into the file, unless another program has changed the file. The error is a
    /// sentence; then the file is as it was.
    pub(crate) fn save(&mut self) -> Result<(), String> {
        let name = self.name();
        let failed = |error: std::io::Error| format!("{name} is not saved: {error}");
        match rc_files::read(&self.path) {
            Ok(now) if now == self.saved => {
                rc_files::replace(&self.path, &self.saved, &self.text).map_err(failed)?;
            }
            Ok(now) if now == self.text => {}
            Ok(_) => {
                return Err(format!(
                    "{name} is not saved: another program changed it; l loads it, then u returns to your text"
                ));
            }
            // Nothing is lost if the file was deleted.
            Err(error) if error.kind() == ErrorKind::NotFound => {
                rc_files::write(&self.path, &self.text).map_err(failed)?;
            }
            Err(error) => return Err(failed(error)),
        }
        self.saved.clone_from(&self.text);
        Ok(())
    }

    /// Reads the file again. It can be undone, so no change is lost.
    pub(crate) fn reload(&mut self) -> Result<(), String> {
        let name = self.name();
        let text = rc_files::read(&self.path);
        let text = text.map_err(|error| format!("{name} is not loaded: {error}"))?;
        // An included file or a mesh may have changed, too.
        let content = self.load(&text);
        self.content = content.map_err(|error| format!("{name} is not loaded: {error}"))?;
        if text != self.text {
            self.history.record(&self.text, &text);
        }
        self.text.clone_from(&text);
        self.saved = text;
        Ok(())
    }

    /// Writes a changed text into a new file and returns its path: next to the file, or in the
    /// folder for temporary files if that fails.
    pub(crate) fn rescue(&self) -> std::io::Result<PathBuf> {
        let beside = self.path.with_file_name("");
        self.rescue_in(&beside)
            .or_else(|error| self.rescue_in(&std::env::temp_dir()).map_err(|_| error))
    }

    fn rescue_in(&self, folder: &Path) -> std::io::Result<PathBuf> {
        let mut refused = None;
        for name in self.rescue_names() {
            let path = folder.join(name);
            match File::options().write(true).create_new(true).open(&path) {
                Ok(mut file) => {
                    let written = file.write_all(self.text.as_bytes());
                    written.and_then(|()| file.sync_all())?;
                    return Ok(path);
                }
                // The changes of an earlier session, which are not replaced.
                Err(error) if error.kind() == ErrorKind::AlreadyExists => refused = Some(error),
                Err(error) => return Err(error),
            }
        }
        Err(refused.unwrap_or_else(|| ErrorKind::AlreadyExists.into()))
    }

    /// The names of the files with changes that were not saved.
    fn rescue_names(&self) -> impl Iterator<Item = OsString> {
        let mut name = self.path.file_name().unwrap_or_default().to_owned();
        name.push(".unsaved");
        let more = (1..MOST_RESCUED).map({
            let name = name.clone();
            move |number| {
                let mut name = name.clone();
                name.push(format!(".{number}"));
                name
            }
        });
        std::iter::once(name).chain(more)
    }

    /// A file next to this one with unsaved changes of an earlier session.
    pub(crate) fn rescued(&self) -> Option<PathBuf> {
        let mut paths = self
            .rescue_names()
            .map(|name| self.path.with_file_name(name));
        paths.find(|path| path.is_file())
    }
}

fn not_there() -> String {
    "the element is not in the text".to_owned()
}

/// Errors of a text.
struct TextErrors {
    /// Message of the first one.
    first: String,
    /// All findings with their lines.
    all: String,
}

fn load(path: &Path, folders: &Folders, text: &str) -> Result<Content, TextErrors> {
    let mut sources = SourceMap::new();
    let source = sources.add(path, text);
    let (document, found) = innermodel::language::load(&mut sources, folders, source);
    let all = render(&sources, &found, Format::Short);
    let mut errors = found.iter().filter(|f| f.severity == Severity::Error);
    if let Some(error) = errors.next() {
        let first = clean(&error.message);
        return Err(TextErrors { first, all });
    }
    let model = InnerModel::from_document(&document).map_err(|error| TextErrors {
        first: error.to_string(),
        all: error.to_string(),
    })?;
    Ok(Content {
        tree: model.snapshot(),
        model: Arc::new(model),
        written: written(&document, source, &sources),
        warnings: all,
    })
}

fn written(
    document: &Document,
    source: rc_diagnostics::SourceId,
    sources: &SourceMap,
) -> HashMap<String, Written> {
    let mut files = HashMap::new();
    let mut all = vec![source];
    all.extend(document.nodes.iter().map(|node| node.span.source));
    for file in all {
        let path = sources.path(file);
        let units = || rewrite::units(sources.text(file));
        files.entry(path).or_insert_with(units);
    }
    let has_metres = files.values().any(|units| *units == Some("metres"));
    let nodes = document.nodes.iter();
    nodes
        .map(|node| {
            let place = if node.span.source == source {
                Written::Here(node.span)
            } else {
                let path = sources.path(node.span.source);
                let has_units = files.get(path).is_some_and(Option::is_some);
                Written::Included {
                    path: path.to_path_buf(),
                    inherits: has_metres && !has_units,
                }
            };
            (node.id.clone(), place)
        })
        .collect()
}
