//! The text of the file that is edited, its tree, and the file on the disk.

use super::history::History;
use innermodel::language::Document;
use innermodel::language::rewrite::{self, Value};
use innermodel::{Folders, InnerModel, ROOT};
use rc_diagnostics::foreign::clean;
use rc_diagnostics::{Format, Severity, SourceMap, Span, render};
use std::collections::HashMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// The mark at the start of some texts.
const BYTE_ORDER_MARK: char = '\u{feff}';

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
    Included(PathBuf),
}

/// What a text says.
struct Content {
    model: Arc<InnerModel>,
    written: HashMap<String, Written>,
    /// Findings that are no errors, one a line.
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

    /// Findings in the text that are no errors, one a line.
    pub(crate) fn warnings(&self) -> &str {
        &self.content.warnings
    }

    /// The name of the file without its folder.
    pub(crate) fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or(self.path.as_os_str());
        clean(&name.to_string_lossy())
    }

    /// Whether the text differs from that on the disk, when it was read or written last.
    pub(crate) fn is_changed(&self) -> bool {
        self.text != self.saved
    }

    /// The tag of a node that this file may change. The error is a sentence.
    pub(crate) fn tag(&self, id: &str) -> Result<Span, String> {
        match self.content.written.get(id) {
            Some(Written::Here(span)) => Ok(*span),
            Some(Written::Included(path)) => {
                let (id, path) = (clean(id), clean(&path.display().to_string()));
                Err(format!("`{id}` is written in {path}: edit that file"))
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

    /// Adds an element below a node, or at the outermost place.
    pub(crate) fn add(
        &mut self,
        parent: Option<&str>,
        tag: &str,
        attributes: &[(&str, Value)],
    ) -> Result<(), String> {
        let parent = parent.map(|id| self.tag(id)).transpose()?;
        let new = rewrite::add(self.without_mark(), parent, tag, attributes);
        self.replace(new.ok_or_else(not_there)?)
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
        self.history.record(&self.text, &new);
        (self.text, self.content) = (new, content);
        Ok(())
    }

    fn load(&self, text: &str) -> Result<Content, String> {
        load(&self.path, &self.folders, text).map_err(|wrong| wrong.first)
    }

    /// Reads the tree from the text again, without what was only tried.
    pub(crate) fn forget_trial(&mut self) -> Result<(), String> {
        self.content = self.load(&self.text)?;
        Ok(())
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

    /// Undoes the last change as if it had never been made.
    pub(crate) fn withdraw(&mut self) -> Result<(), String> {
        self.undo()?;
        self.history.forget_undone();
        Ok(())
    }

    /// Makes the change again that was undone last. `false` if there is none.
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
            // Nothing is lost if the file is gone.
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

    /// Writes a changed text beside the file, and returns where.
    pub(crate) fn rescue(&self) -> std::io::Result<PathBuf> {
        let mut name = self.path.file_name().unwrap_or_default().to_owned();
        name.push(".unsaved");
        let path = self.path.with_file_name(name);
        rc_files::write(&path, &self.text)?;
        Ok(path)
    }
}

fn not_there() -> String {
    "the element is not in the text".to_owned()
}

/// Errors of a text.
struct Wrong {
    /// Message of the first one.
    first: String,
    /// All findings with their lines.
    all: String,
}

fn load(path: &Path, folders: &Folders, text: &str) -> Result<Content, Wrong> {
    let mut sources = SourceMap::new();
    let source = sources.add(path, text);
    let (document, found) = innermodel::language::load(&mut sources, folders, source);
    let all = render(&sources, &found, Format::Short);
    let mut errors = found.iter().filter(|f| f.severity == Severity::Error);
    if let Some(error) = errors.next() {
        let first = clean(&error.message);
        return Err(Wrong { first, all });
    }
    let model = InnerModel::from_document(&document).map_err(|error| Wrong {
        first: error.to_string(),
        all: error.to_string(),
    })?;
    Ok(Content {
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
    let nodes = document.nodes.iter();
    nodes
        .map(|node| {
            let place = if node.span.source == source {
                Written::Here(node.span)
            } else {
                Written::Included(sources.path(node.span.source).to_path_buf())
            };
            (node.id.clone(), place)
        })
        .collect()
}
