//! The cargo workspace of a folder, found by reading manifests: rcgen starts no cargo.

use crate::files::GENERATED;
use crate::paths::{absolute, normal, relative};
use crate::source_files;
use rc_cdsl::ast::Clause;
use rc_diagnostics::SourceMap;
use rc_vocabulary::Language;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use toml_edit::{Array, Document, DocumentMut, InlineTable, Item, TableLike, Value};

/// The folder of a workspace's interfaces, unless `[workspace.metadata.robocomp]` names another
/// one.
const INTERFACES: &str = "interfaces";

/// The crate that the crate of interfaces depends on, and a crate of the same origin that
/// workspaces of every age name.
const MIDDLEWARE: (&str, &str) = ("rc-middleware", "/middleware");
const RUNTIME: (&str, &str) = ("rc-runtime", "/runtime");

/// A cargo workspace.
#[derive(Clone, Debug)]
pub struct Workspace {
    root: PathBuf,
    manifest: Arc<Document<String>>,
}

impl Workspace {
    /// The workspace that a package in `folder` belongs to, if any. `folder` need not exist yet.
    ///
    /// # Errors
    /// A manifest in `folder` or above it cannot be read, or is not TOML.
    pub fn of(folder: &Path) -> io::Result<Option<Self>> {
        let folder = absolute(folder)?;
        let own = manifest(&folder)?;
        if let Some(own) = &own
            && let Some(named) = get(own, &["package", "workspace"]).and_then(Item::as_str)
        {
            let root = absolute(&folder.join(named))?;
            return Ok(manifest(&root)?.map(|manifest| Self { root, manifest }));
        }
        for root in folder.ancestors() {
            let found = if root == folder {
                own.clone()
            } else {
                manifest(root)?
            };
            let Some(manifest) = found else {
                continue;
            };
            let workspace = Self {
                root: root.to_path_buf(),
                manifest,
            };
            let is_root = workspace.manifest.contains_key("workspace");
            // Cargo must not take a component in another language for a package.
            let is_other = || {
                let mut others = Language::ALL.into_iter();
                others.any(|one| !one.is_built_by_cargo() && folder.join(one.manifest()).exists())
            };
            if is_root && (root == folder || !workspace.excludes(&folder) || is_other()) {
                return Ok(Some(workspace));
            }
        }
        Ok(None)
    }

    /// The folder of its manifest, absolute.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The folder of its interfaces: `interfaces` in
    ///
    /// ```toml
    /// [workspace.metadata.robocomp]
    /// interfaces = "components/interfaces"
    /// ```
    pub fn interfaces(&self) -> PathBuf {
        let path = ["workspace", "metadata", "robocomp", "interfaces"];
        let named = get(&self.manifest, &path).and_then(Item::as_str);
        normal(&self.root.join(named.unwrap_or(INTERFACES)))
    }

    /// The folders in which imports are looked for: that of its interfaces, and those of `include` in
    /// the same table:
    ///
    /// ```toml
    /// [workspace.metadata.robocomp]
    /// include = ["../shared/interfaces"]
    /// ```
    pub fn search(&self) -> Vec<PathBuf> {
        let path = ["workspace", "metadata", "robocomp", "include"];
        let named = get(&self.manifest, &path).and_then(Item::as_array);
        let named = named.into_iter().flatten().filter_map(Value::as_str);
        let named = named.map(|folder| normal(&self.root.join(folder)));
        std::iter::once(self.interfaces()).chain(named).collect()
    }

    /// Whether it names the framework, as workspaces of `rcgen init` do.
    pub fn has_framework(&self) -> bool {
        get(&self.manifest, &["workspace", "dependencies", RUNTIME.0]).is_some()
    }

    /// The folder of the framework, if it is named by a path.
    pub fn framework(&self) -> Option<PathBuf> {
        let runtime = get(&self.manifest, &["workspace", "dependencies", RUNTIME.0])?;
        let path = self.root.join(runtime.get("path")?.as_str()?);
        path.ends_with(RUNTIME.1.trim_start_matches('/'))
            .then(|| path.parent().map(normal))?
    }

    /// The folder of a package below the root, if one has this name.
    pub fn package(&self, name: &str) -> io::Result<Option<PathBuf>> {
        let is_manifest = |path: &Path| path.file_name().is_some_and(|file| file == "Cargo.toml");
        for path in source_files::files(std::slice::from_ref(&self.root), &is_manifest)? {
            let folder = path.parent().unwrap_or(Path::new(""));
            // A manifest with a fault is not judged here.
            let Ok(Some(found)) = manifest(folder) else {
                continue;
            };
            let named = get(&found, &["package", "name"]).and_then(Item::as_str);
            if named == Some(name) && !found.contains_key("workspace") {
                return Ok(Some(relative(&self.root, folder)));
            }
        }
        Ok(None)
    }

    /// The folders that its members name, with their packages. Folders without a manifest that can
    /// be read are left out, and those of generated code.
    ///
    /// # Errors
    /// A folder that a pattern leads through cannot be listed.
    pub(crate) fn members(&self) -> io::Result<Vec<(PathBuf, Package)>> {
        let mut folders = BTreeSet::new();
        for pattern in self.patterns() {
            folders.extend(expand(&self.root, pattern)?);
        }
        folders.retain(|folder| !folder.ends_with(GENERATED) && !self.excludes(folder));
        let named = self.named();
        let packages = folders.into_iter().filter_map(|folder| {
            let package = match named.get(&folder) {
                Some(name) => Package::Named((*name).to_owned()),
                None => Package::Manifest(rc_files::read(&folder.join("Cargo.toml")).ok()?),
            };
            Some((folder, package))
        });
        Ok(packages.collect())
    }

    /// The packages that `[workspace.dependencies]` names, by their folders: cargo refuses to use
    /// one whose manifest has another name.
    fn named(&self) -> BTreeMap<PathBuf, &str> {
        let all = get(&self.manifest, &["workspace", "dependencies"]);
        let all = all.and_then(Item::as_table_like);
        let all = all.into_iter().flat_map(TableLike::iter);
        let named = all.filter_map(|(key, item)| {
            let path = item.get("path")?.as_str()?;
            let name = item.get("package").and_then(Item::as_str).unwrap_or(key);
            Some((normal(&self.root.join(path)), name))
        });
        named.collect()
    }

    /// The text of its manifest, and that text with `folder`, from the root, among its members;
    /// none if its members name it already.
    pub(crate) fn with_member(&self, folder: &Path) -> io::Result<Option<(String, String)>> {
        if self.names(&self.root.join(folder)) {
            return Ok(None);
        }
        let path = self.root.join("Cargo.toml");
        let text = rc_files::read(&path)?;
        let faulty = |error: &dyn std::fmt::Display| {
            let message = format!("{}: {error}", path.display());
            io::Error::new(io::ErrorKind::InvalidInput, message)
        };
        let mut manifest: DocumentMut =
            text.parse().map_err(|e: toml_edit::TomlError| faulty(&e))?;
        let workspace = manifest.get_mut("workspace");
        let workspace = workspace.and_then(Item::as_table_like_mut);
        let workspace = workspace.ok_or_else(|| faulty(&"`workspace` is not a table"))?;
        let members = workspace
            .entry("members")
            .or_insert(toml_edit::value(Array::new()));
        let members = members
            .as_array_mut()
            .ok_or_else(|| faulty(&"`members` is not a list"))?;
        let mut member = Value::from(folder.to_string_lossy().as_ref());
        let last = members.len().checked_sub(1);
        if let Some(last) = last.and_then(|last| members.get_mut(last)) {
            // On a line of its own if the last member is on one.
            let text = |raw: Option<&toml_edit::RawString>| {
                let text = raw.and_then(toml_edit::RawString::as_str);
                text.filter(|text| text.contains('\n')).map(str::to_owned)
            };
            let before = text(last.decor().prefix()).unwrap_or_else(|| " ".to_owned());
            let behind = text(last.decor().suffix()).unwrap_or_default();
            last.decor_mut().set_suffix("");
            *member.decor_mut() = toml_edit::Decor::new(before, behind);
        }
        members.push_formatted(member);
        Ok(Some((text, manifest.to_string())))
    }

    /// The `.cdsl` files below `folder` in packages of this workspace, also in those that have no
    /// manifest yet. The second list has those in new folders that no member names.
    pub fn components(&self, folder: &Path) -> io::Result<(Vec<PathBuf>, Vec<PathBuf>)> {
        let is_component = |path: &Path| path.extension().is_some_and(|e| e == "cdsl");
        let files = source_files::files(&[folder.to_path_buf()], &is_component)?;
        let (mut components, mut unlisted) = (Vec::new(), Vec::new());
        for file in files {
            let own = absolute(file.parent().unwrap_or(Path::new("")))?;
            if Self::of(&own)?.is_none_or(|of| of.root != self.root) {
                continue;
            }
            let mut inside = own.ancestors().take_while(|above| **above != self.root);
            let has_manifest = |one: Language| own.join(one.manifest()).exists();
            if self.lists(&own) {
                components.push(file);
            } else if inside.any(|above| above.join("Cargo.toml").exists()) {
                // A file inside another package belongs to its tests, unless it is a package itself.
                let other = language(&file)?.filter(|one| !one.is_built_by_cargo());
                if other.is_some_and(has_manifest) {
                    components.push(file);
                }
            } else if language(&file)?.is_some_and(|one| !one.is_built_by_cargo()) {
                components.push(file);
            } else {
                unlisted.push(file);
            }
        }
        Ok((components, unlisted))
    }

    /// The text of its manifest, and that text with `rc-middleware` and `interfaces` among the
    /// dependencies, and `no_packages` excluded if a pattern of the members names them; none if
    /// nothing is missing.
    pub(crate) fn as_needed(&self, no_packages: &[&Path]) -> io::Result<Option<(String, String)>> {
        // Another generation may have changed it since it was found.
        let Some(manifest) = manifest(&self.root)? else {
            return Ok(None);
        };
        let text = rc_files::read(&self.root.join("Cargo.toml"))?;
        let with_middleware = self.add_middleware(&manifest);
        let current = with_middleware.clone().unwrap_or_else(|| text.clone());
        let new = self
            .exclude(&current, no_packages)?
            .or(with_middleware)
            .map(|new| {
                if text.contains("\r\n") && !text.replace("\r\n", "").contains('\n') {
                    new.replace("\r\n", "\n").replace('\n', "\r\n")
                } else {
                    new
                }
            });
        Ok(new.map(|new| (text, new)))
    }

    /// A manifest with these folders among `exclude`; none if cargo does not consider any of them a
    /// package.
    fn exclude(&self, manifest: &str, folders: &[&Path]) -> io::Result<Option<String>> {
        let mut missing = Vec::new();
        for folder in folders {
            let folder = absolute(folder)?;
            let inside = folder.starts_with(&self.root) && folder != self.root;
            if inside && self.names(&folder) && !self.excludes(&folder) {
                missing.push(relative(&self.root, &folder));
            }
        }
        if missing.is_empty() {
            return Ok(None);
        }
        let faulty = |error: &dyn std::fmt::Display| {
            let message = format!("{}: {error}", self.root.join("Cargo.toml").display());
            io::Error::new(io::ErrorKind::InvalidInput, message)
        };
        let manifest = manifest.parse::<DocumentMut>();
        let mut manifest = manifest.map_err(|error| faulty(&error))?;
        let workspace = manifest.get_mut("workspace");
        let workspace = workspace.and_then(Item::as_table_like_mut);
        let workspace = workspace.ok_or_else(|| faulty(&"`workspace` is not a table"))?;
        let excluded = workspace
            .entry("exclude")
            .or_insert(toml_edit::value(Array::new()));
        let excluded = excluded
            .as_array_mut()
            .ok_or_else(|| faulty(&"`exclude` is not a list"))?;
        for folder in missing {
            excluded.push(folder.to_string_lossy().as_ref());
        }
        Ok(Some(manifest.to_string()))
    }

    fn add_middleware(&self, manifest: &Document<String>) -> Option<String> {
        let known = ["workspace", "dependencies", MIDDLEWARE.0];
        if get(manifest, &known).is_some() {
            return None;
        }
        let mut manifest = manifest.clone().into_mut();
        let dependencies = manifest.get_mut("workspace")?.get_mut("dependencies")?;
        let dependencies = dependencies.as_table_like_mut()?;
        let runtime = dependencies.get(RUNTIME.0)?;
        let mut like = InlineTable::new();
        if let Some(version) = runtime.as_str() {
            like.insert("version", version.into());
        }
        for key in ["path", "git", "branch", "tag", "rev", "version"] {
            if let Some(word) = runtime.get(key).and_then(Item::as_str) {
                like.insert(key, word.into());
            }
        }
        if let Some(path) = like.get("path").and_then(Value::as_str) {
            let path = path.trim_end_matches('/').strip_suffix(RUNTIME.1)?;
            let path = format!("{path}{}", MIDDLEWARE.1);
            like.insert("path", path.into());
        }
        dependencies.insert(MIDDLEWARE.0, toml_edit::value(like));
        if !dependencies.contains_key("interfaces") {
            let path = relative(&self.root, &self.interfaces().join(GENERATED));
            let mut interfaces = InlineTable::new();
            interfaces.insert("path", path.to_string_lossy().as_ref().into());
            dependencies.insert("interfaces", toml_edit::value(interfaces));
        }
        Some(manifest.to_string())
    }

    /// Whether cargo leaves `folder`, which is below its root, out of it.
    fn excludes(&self, folder: &Path) -> bool {
        let under = |paths: Option<&Array>| {
            let mut paths = paths.into_iter().flatten().filter_map(Value::as_str);
            paths.any(|path| folder.starts_with(normal(&self.root.join(path))))
        };
        under(self.list("exclude")) && !under(self.list("members"))
    }

    /// Whether `folder` is a package, or one of its `members` that is none yet.
    pub(crate) fn lists(&self, folder: &Path) -> bool {
        folder.join("Cargo.toml").exists() || self.names(folder)
    }

    /// Whether one of its `members` is `folder`.
    fn names(&self, folder: &Path) -> bool {
        let Ok(inside) = folder.strip_prefix(&self.root) else {
            return false;
        };
        let folder: Vec<_> = inside.iter().map(|part| part.to_string_lossy()).collect();
        self.patterns().any(|pattern| {
            let pattern: Vec<&str> = parts(pattern).collect();
            let mut parts = pattern.iter().zip(&folder);
            pattern.len() == folder.len() && parts.all(|(pattern, name)| matches(pattern, name))
        })
    }

    /// The patterns of its members.
    fn patterns(&self) -> impl Iterator<Item = &str> {
        let members = self.list("members").into_iter().flatten();
        members.filter_map(Value::as_str)
    }

    fn list(&self, key: &str) -> Option<&Array> {
        get(&self.manifest, &["workspace", key])?.as_array()
    }
}

/// The package of a member.
#[derive(Debug)]
pub(crate) enum Package {
    /// Its name, which the manifest of the workspace has.
    Named(String),
    /// The text of its manifest.
    Manifest(String),
}

impl Package {
    /// Whether this is its name.
    pub(crate) fn is_named(&self, name: &str) -> bool {
        match self {
            Self::Named(own) => own == name,
            // Parsing a manifest takes a hundred times as long as searching it.
            Self::Manifest(text) => {
                text.contains(name) && package_name(text).as_deref() == Some(name)
            }
        }
    }
}

/// The name of the package of a manifest.
fn package_name(manifest: &str) -> Option<String> {
    let manifest: Document<String> = manifest.parse().ok()?;
    let name = get(&manifest, &["package", "name"])?.as_str()?;
    Some(name.to_owned())
}

/// The steps of a pattern from the root.
fn parts(pattern: &str) -> impl Iterator<Item = &str> {
    let parts = pattern.split('/');
    parts.filter(|part| !part.is_empty() && *part != ".")
}

/// The folders below `root` that a pattern names, without generated, built and hidden ones.
fn expand(root: &Path, pattern: &str) -> io::Result<Vec<PathBuf>> {
    let mut folders = vec![root.to_path_buf()];
    for part in parts(pattern) {
        let mut inside = Vec::new();
        for folder in folders {
            if part.contains(['*', '?']) {
                let names = source_files::folders(&folder)?.into_iter();
                let names = names.filter(|name| matches(part, name));
                inside.extend(names.map(|name| folder.join(name)));
            } else if !source_files::is_left_out(part) {
                inside.push(folder.join(part));
            }
        }
        folders = inside;
    }
    Ok(folders)
}

/// Whether a pattern with `*` and `?` is that of `name`.
fn matches(pattern: &str, name: &str) -> bool {
    let Some(first) = pattern.chars().next() else {
        return name.is_empty();
    };
    let rest = &pattern[first.len_utf8()..];
    let mut chars = name.chars();
    match (first, chars.next()) {
        ('*', next) => matches(rest, name) || next.is_some() && matches(pattern, chars.as_str()),
        ('?', Some(_)) => matches(rest, chars.as_str()),
        (_, Some(next)) => first == next && matches(rest, chars.as_str()),
        (_, None) => false,
    }
}

/// The manifest in `folder`, if there is one.
fn manifest(folder: &Path) -> io::Result<Option<Arc<Document<String>>>> {
    let path = folder.join("Cargo.toml");
    let named = |kind: io::ErrorKind, error: &dyn std::fmt::Display| {
        io::Error::new(kind, format!("{}: {error}", path.display()))
    };
    match rc_files::read(&path) {
        Ok(text) => parsed(text)
            .map(Some)
            .map_err(|error| named(io::ErrorKind::InvalidInput, &error)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) if error.kind() == io::ErrorKind::NotADirectory => Ok(None),
        Err(error) => Err(named(error.kind(), &error)),
    }
}

/// Parsed manifests. A generation reads the manifest of its workspace several times, and parsing
/// takes a hundred times as long as reading.
static PARSED: Mutex<Vec<Arc<Document<String>>>> = Mutex::new(Vec::new());
/// How many of them are kept.
const KEPT: usize = 8;

fn parsed(text: String) -> Result<Arc<Document<String>>, toml_edit::TomlError> {
    let known = |parsed: &[Arc<Document<String>>]| {
        let mut parsed = parsed.iter();
        parsed.find(|manifest| manifest.raw() == text).cloned()
    };
    let found = PARSED.lock().ok().and_then(|parsed| known(&parsed));
    if let Some(manifest) = found {
        return Ok(manifest);
    }
    let manifest = Arc::new(Document::parse(text)?);
    if let Ok(mut parsed) = PARSED.lock() {
        parsed.truncate(KEPT - 1);
        parsed.insert(0, manifest.clone());
    }
    Ok(manifest)
}

fn get<'a>(manifest: &'a Document<String>, path: &[&str]) -> Option<&'a Item> {
    let mut table: &dyn TableLike = manifest.as_table();
    let (last, tables) = path.split_last()?;
    for key in tables {
        table = table.get(key)?.as_table_like()?;
    }
    table.get(last)
}

/// The language that a `.cdsl` names. `None` if it is unknown, or if the file cannot be read as a
/// description.
///
/// # Errors
/// The system does not give the file.
fn language(path: &Path) -> io::Result<Option<Language>> {
    let mut sources = SourceMap::new();
    let source = sources.add(path, rc_files::read(path)?);
    let (file, _) = rc_cdsl::parse(&sources, source);
    let clauses = file
        .component
        .into_iter()
        .flat_map(|component| component.clauses);
    let mut words = clauses.filter_map(|(_, clause)| match clause {
        Clause::Language(word) => Some(Language::from_file(&word.text)),
        _ => None,
    });
    Ok(words.next().flatten())
}

#[cfg(test)]
mod tests;
