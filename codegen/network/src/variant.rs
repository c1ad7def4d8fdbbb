//! Components for another middleware than that of their `generated/`: a workspace below the target
//! folder in which each is generated again, and all other files are the user's, in place.
//!
//! `TARGET/rc/MIDDLEWARE` has a manifest with the dependencies, patches and profiles of the user's
//! workspace, and its lock file; `NAME` in it has the user's manifest with another program name, a
//! `generated/` of its own, and links to all other files of the component. Cargo builds into the
//! user's target folder, and a member `variant-features` requests the features of the user's
//! workspace, so that no library that both need is built twice.

use crate::error::{Error, cannot, refused};
use cargo_metadata::{Dependency, DependencyKind, Source};
use rc_codegen::files::{Files, GENERATED, Owner};
use rc_codegen::interface_crate::{self, InterfaceCrate};
use rc_codegen::{Project, generate, generation, names};
use rc_vocabulary::Middlewares;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, value};

/// Tables of a workspace's manifest that hold for all members.
const SHARED: [&str; 4] = ["workspace", "patch", "replace", "profile"];
/// Entries of a component's folder that its variant has for itself.
const OWN: [&str; 4] = ["Cargo.toml", "Cargo.lock", GENERATED, "target"];
/// The member that chooses features. No component has this name: it is not an identifier.
const FEATURES: &str = "variant-features";
/// The folder of a component in its generated description.
const BUILT_FOLDER: &str = r#"concat!(env!("CARGO_MANIFEST_DIR"), "/..")"#;
const DEPENDENCIES: [&str; 3] = ["dependencies", "dev-dependencies", "build-dependencies"];

/// How long a build waits for another one; a first one compiles a middleware.
pub(crate) const PATIENCE: Duration = Duration::from_mins(30);

/// The program of a variant, next to the one that the user builds.
pub(crate) fn program(package: &str, middleware: Middlewares) -> String {
    format!("{package}-{middleware}")
}

/// Variants that are ready to be built. As long as this lives, no other process changes them.
#[derive(Debug)]
pub(crate) struct Staged {
    folder: PathBuf,
    _held: File,
}

impl Staged {
    /// The folder of their workspace.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The manifest of their workspace.
    pub(crate) fn manifest(&self) -> PathBuf {
        self.folder.join("Cargo.toml")
    }
}

/// Makes or renews the variants of components of the workspace `root`, which is built into
/// `target` and whose members have these dependencies.
pub(crate) fn stage(
    root: &Path,
    target: &Path,
    projects: &[&Project],
    dependencies: &[Dependency],
    middleware: Middlewares,
) -> Result<Staged, Error> {
    let staging = Staging::begin(root, target.join("rc").join(middleware.to_string()))?;
    let packages = projects
        .iter()
        .map(|project| names::package(&project.component.name.text));
    let packages: Vec<String> = packages.collect();
    let variants = packages.iter().zip(projects);
    let variants = variants.map(|(package, project)| (package.as_str(), *project, middleware));
    staging.variants(&variants.collect::<Vec<_>>())?;
    staging.finish(Files::default(), packages, dependencies)
}

/// A workspace below the target folder that is made or renewed.
pub(crate) struct Staging<'r> {
    root: &'r Path,
    folder: PathBuf,
    /// The contents of the manifest of the user's workspace.
    shared: DocumentMut,
    held: File,
}

impl<'r> Staging<'r> {
    /// Begins with the manifest of the user's workspace `root`.
    pub(crate) fn begin(root: &'r Path, folder: PathBuf) -> Result<Self, Error> {
        let held = lock_folder(&folder, PATIENCE)?;
        Ok(Self {
            root,
            shared: shared(root)?,
            folder,
            held,
        })
    }

    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Stages components, each in the folder of its package and for its middleware. They use the
    /// workspace's crate of interfaces in its place.
    pub(crate) fn variants(&self, variants: &[(&str, &Project, Middlewares)]) -> Result<(), Error> {
        if variants.is_empty() {
            return Ok(());
        }
        let root = self.root;
        let action = || format!("add to the interfaces of {}", root.display());
        let interfaces = InterfaceCrate::of(root).map_err(refused(action()))?;
        let projects: Vec<&Project> = variants.iter().map(|(_, project, _)| *project).collect();
        generation::add_interfaces(&interfaces, &projects).map_err(|error| match error {
            interface_crate::Error::Io(error) => refused(action())(error),
            interface_crate::Error::Template(error) => {
                Error::Workspace(format!("cannot {}: {error}", action()))
            }
        })?;
        for (package, project, middleware) in variants {
            let staged = self.folder.join(package);
            component(
                project,
                &interfaces,
                package,
                *middleware,
                &self.shared,
                &staged,
                root,
            )?;
        }
        Ok(())
    }

    /// Writes these files, and the workspace with these members and the one that chooses features.
    pub(crate) fn finish(
        mut self,
        mut files: Files,
        mut members: Vec<String>,
        dependencies: &[Dependency],
    ) -> Result<Staged, Error> {
        members.push(FEATURES.to_owned());
        members.sort();
        let list: toml_edit::Array = members.iter().map(String::as_str).collect();
        self.shared["workspace"]["members"] = value(list);
        files.add("Cargo.toml", Owner::Generic, self.shared.to_string());
        let path = Path::new(FEATURES);
        let manifest = features(dependencies).to_string();
        files.add(path.join("Cargo.toml"), Owner::Generic, manifest);
        let main = "//! Never built; its dependencies choose features.\n\nfn main() {}\n";
        files.add(path.join("src/main.rs"), Owner::Generic, main.to_owned());
        write(&files, &self.folder)?;
        lock(self.root, &self.folder, &members)?;
        Ok(Staged {
            folder: self.folder,
            _held: self.held,
        })
    }
}

/// The manifest of the member that is never built. The features of a library follow from all
/// members that cargo selects, so libraries of crates.io have those of the user's workspace.
fn features(dependencies: &[Dependency]) -> DocumentMut {
    let mut manifest = DocumentMut::new();
    let package = [
        ("name", FEATURES),
        ("version", "0.0.0"),
        ("edition", "2024"),
    ];
    manifest["package"] = Item::Table(Table::from_iter(package));
    // A library may occur in two versions, and with other features in each member.
    let mut texts = BTreeSet::new();
    for dependency in dependencies {
        let kind = match dependency.kind {
            DependencyKind::Normal => "dependencies",
            DependencyKind::Build => "build-dependencies",
            _ => continue,
        };
        let known = dependency.source.as_ref();
        if dependency.optional || !known.is_some_and(Source::is_crates_io) {
            continue;
        }
        let mut wanted = InlineTable::new();
        wanted.insert("package", dependency.name.as_str().into());
        wanted.insert("version", dependency.req.to_string().into());
        wanted.insert("default-features", dependency.uses_default_features.into());
        let named = dependency.features.iter().map(String::as_str);
        wanted.insert("features", named.collect::<toml_edit::Array>().into());
        if !texts.insert((kind, dependency.target.clone(), wanted.to_string())) {
            continue;
        }
        let of = match &dependency.target {
            None => manifest.as_table_mut(),
            Some(target) => child(
                child(manifest.as_table_mut(), "target"),
                &target.to_string(),
            ),
        };
        child(of, kind).insert(&format!("a{}", texts.len()), value(wanted));
    }
    manifest
}

/// A table in a table, made where it is missing.
fn child<'a>(of: &'a mut Table, key: &str) -> &'a mut Table {
    let of = of.entry(key).or_insert(Item::Table(Table::new()));
    of.as_table_mut().expect("nothing else was inserted here")
}

/// Holds the folder of variants. Networks of one target folder have different ones in it, and cargo
/// reads there until it is done.
pub(crate) fn lock_folder(folder: &Path, patience: Duration) -> Result<File, Error> {
    std::fs::create_dir_all(folder).map_err(cannot(format!("make {}", folder.display())))?;
    let path = folder.join(".lock");
    let file = File::create(&path).map_err(cannot(format!("open {}", path.display())))?;
    let deadline = Instant::now() + patience;
    let mut reported = false;
    loop {
        let error = match flock(&file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => return Ok(file),
            Err(Errno::WOULDBLOCK) if Instant::now() < deadline => {
                if !std::mem::replace(&mut reported, true) {
                    let folder = folder.display();
                    // If standard error is closed, the message is not wanted.
                    let _ = writeln!(
                        io::stderr(),
                        "rcdeploy: waiting for another build in {folder}"
                    );
                }
                std::thread::sleep(Duration::from_millis(50));
                continue;
            }
            Err(Errno::WOULDBLOCK) => {
                io::Error::new(io::ErrorKind::TimedOut, "another build holds it")
            }
            Err(error) => error.into(),
        };
        return Err(error).map_err(cannot(format!("lock {}", path.display())));
    }
}

fn write(files: &Files, folder: &Path) -> Result<(), Error> {
    let written = files.write(folder).map(drop);
    written.map_err(cannot(format!("write the variant in {}", folder.display())))
}

/// Reads a manifest.
pub(crate) fn read(path: &Path) -> Result<DocumentMut, Error> {
    let text = rc_files::read(path).map_err(cannot(format!("read {}", path.display())))?;
    text.parse()
        .map_err(|error| Error::Workspace(format!("{}: {error}", path.display())))
}

/// The manifest of the user's workspace, without its members; its paths are absolute.
fn shared(root: &Path) -> Result<DocumentMut, Error> {
    let mut manifest = read(&root.join("Cargo.toml"))?;
    let edition = manifest.get("package").and_then(|p| p.get("edition"));
    // Where there is a package, its edition chooses the resolver.
    let resolver = match edition.and_then(Item::as_str) {
        Some("2021") => Some("2"),
        Some("2015" | "2018") | None => None,
        Some(_) => Some("3"),
    };
    manifest.retain(|key, _| SHARED.contains(&key));
    if let Some(workspace) = table(manifest.as_table_mut(), "workspace") {
        for key in ["exclude", "default-members"] {
            workspace.remove(key);
        }
        if let Some(resolver) = resolver
            && !workspace.contains_key("resolver")
        {
            workspace.insert("resolver", value(resolver));
        }
        if let Some(dependencies) = table(workspace, "dependencies") {
            absolute(dependencies, root);
        }
    }
    if let Some(patches) = table(manifest.as_table_mut(), "patch") {
        for (_, source) in patches.iter_mut() {
            source
                .as_table_like_mut()
                .into_iter()
                .for_each(|patch| absolute(patch, root));
        }
    }
    if let Some(replaced) = table(manifest.as_table_mut(), "replace") {
        absolute(replaced, root);
    }
    Ok(manifest)
}

fn table<'a>(of: &'a mut dyn TableLike, key: &str) -> Option<&'a mut dyn TableLike> {
    of.get_mut(key)?.as_table_like_mut()
}

/// Makes the paths of dependencies lead from anywhere to where they lead from `folder`.
fn absolute(dependencies: &mut dyn TableLike, folder: &Path) {
    for (_, item) in dependencies.iter_mut() {
        let Some(dependency) = item.as_table_like_mut() else {
            continue;
        };
        if let Some(path) = dependency.get("path").and_then(Item::as_str) {
            let path = folder.join(path);
            dependency.insert("path", value(path.to_string_lossy().as_ref()));
        }
    }
}

/// Makes the paths of all dependencies of a package absolute.
fn absolute_in(manifest: &mut DocumentMut, folder: &Path) {
    let mut tables: Vec<&mut dyn TableLike> = Vec::new();
    for (key, item) in manifest.iter_mut() {
        let Some(table) = item.as_table_like_mut() else {
            continue;
        };
        if DEPENDENCIES.contains(&key.get()) {
            tables.push(table);
        } else if key.get() == "target" {
            let platforms = table.iter_mut().filter_map(|(_, i)| i.as_table_like_mut());
            for platform in platforms {
                let kinds = platform.iter_mut();
                let kinds = kinds.filter(|(key, _)| DEPENDENCIES.contains(&key.get()));
                tables.extend(kinds.filter_map(|(_, i)| i.as_table_like_mut()));
            }
        }
    }
    tables.into_iter().for_each(|table| absolute(table, folder));
}

/// Stages one component in `staged`.
fn component(
    project: &Project,
    interfaces: &InterfaceCrate,
    package: &str,
    middleware: Middlewares,
    shared: &DocumentMut,
    staged: &Path,
    root: &Path,
) -> Result<(), Error> {
    let folder = project.code();
    let folder = folder
        .canonicalize()
        .map_err(cannot(format!("open {}", folder.display())))?;
    let dependency = interfaces.dependency(&folder);
    let dependency = dependency.map_err(cannot(format!("find the interfaces of {package}")))?;
    let (generated, _) = generate::component(project, middleware, &dependency)
        .map_err(|error| Error::Workspace(error.to_string()))?;
    let mut files = Files::default();
    for (path, owner, text) in generated.iter() {
        if owner == Owner::Generic {
            files.add(path, owner, text.to_owned());
        }
    }
    // The user's files, at which relative paths start, are not next to the code of the variant.
    let description = Path::new(GENERATED).join("src/description.rs");
    let text = files.text(&description).unwrap_or_default();
    if !text.contains(BUILT_FOLDER) {
        let message = format!("{package}: the generated description names no folder");
        return Err(Error::Workspace(message));
    }
    let text = text.replace(BUILT_FOLDER, &format!("{:?}", folder.to_string_lossy()));
    files.add(description, Owner::Generic, text);
    let crate_manifest = Path::new(GENERATED).join("Cargo.toml");
    let text = files.text(&crate_manifest).unwrap_or_default();
    let mut manifest: DocumentMut = text
        .parse()
        .map_err(|error| Error::Workspace(format!("{package}: {error}")))?;
    inherited(&manifest, shared, root)?;
    absolute_in(&mut manifest, &folder.join(GENERATED));
    files.add(crate_manifest, Owner::Generic, manifest.to_string());
    let manifest = user_manifest(&folder, package, middleware)?;
    files.add("Cargo.toml", Owner::Generic, manifest.to_string());
    write(&files, staged)?;
    link(&folder, staged).map_err(cannot(format!("link the files of {package}")))
}

/// Whether the user's workspace has the dependencies that the generated crate inherits.
fn inherited(manifest: &DocumentMut, shared: &DocumentMut, root: &Path) -> Result<(), Error> {
    let dependencies = manifest.get("dependencies").and_then(Item::as_table_like);
    let known = shared["workspace"].get("dependencies");
    for (name, item) in dependencies.into_iter().flat_map(|table| table.iter()) {
        let is_known = known.is_some_and(|known| known.get(name).is_some());
        if item.get("workspace").is_none() || is_known {
            continue;
        }
        let middleware = name.trim_start_matches("rc-");
        let like = known.and_then(|known| known.get("rc-runtime"));
        let like = like.map_or(String::new(), |like| {
            let like = like.to_string();
            let like = like.replace("/runtime\"", &format!("/middleware/{middleware}\""));
            format!(": `{name} = {}`", like.trim())
        });
        return Err(Error::Workspace(format!(
            "{} does not say where {name} comes from; add it to [workspace.dependencies]{like}",
            root.join("Cargo.toml").display()
        )));
    }
    Ok(())
}

/// The user's manifest, for the same files in another folder and a program of another name.
fn user_manifest(
    folder: &Path,
    package: &str,
    middleware: Middlewares,
) -> Result<DocumentMut, Error> {
    let mut manifest = read(&folder.join("Cargo.toml"))?;
    // Where the component is the root of its workspace, the variant is not.
    manifest.retain(|key, _| !SHARED.contains(&key));
    // Only programs are built. A test's dependency on `generated` would be a second place of it.
    manifest.remove("dev-dependencies");
    if let Some(targets) = table(manifest.as_table_mut(), "target") {
        for (_, platform) in targets.iter_mut() {
            if let Some(platform) = platform.as_table_like_mut() {
                platform.remove("dev-dependencies");
            }
        }
    }
    absolute_in(&mut manifest, folder);
    let mut path = InlineTable::new();
    path.insert("path", GENERATED.into());
    manifest["dependencies"][format!("{package}_generated")] = value(path);
    let program = program(package, middleware);
    if let Some(package) = table(manifest.as_table_mut(), "package") {
        for key in ["workspace", "default-run"] {
            package.remove(key);
        }
        package.insert("autobins", value(false));
    }
    let is_named = |bin: &Table| bin.get("name").and_then(Item::as_str) == Some(package);
    let bins = manifest
        .entry("bin")
        .or_insert(Item::ArrayOfTables(ArrayOfTables::new()));
    let Some(bins) = bins.as_array_of_tables_mut() else {
        let path = folder.join("Cargo.toml");
        let message = "write its programs as `[[bin]]`, or leave them out";
        return Err(Error::Workspace(format!("{}: {message}", path.display())));
    };
    if !bins.iter().any(is_named) {
        let mut bin = Table::new();
        bin.insert("name", value(package));
        bins.push(bin);
    }
    for bin in bins.iter_mut().filter(|bin| is_named(bin)) {
        bin.insert("name", value(program.as_str()));
        source(bin, folder, "src/main.rs");
    }
    if manifest.contains_key("lib") || folder.join("src/lib.rs").exists() {
        let lib = manifest.entry("lib").or_insert(Item::Table(Table::new()));
        let lib = lib.as_table_like_mut();
        lib.into_iter()
            .for_each(|lib| source(lib, folder, "src/lib.rs"));
    }
    Ok(manifest)
}

/// Lets a crate begin where the user's does, so that the compiler names the user's own files.
fn source(of: &mut dyn TableLike, folder: &Path, usual: &str) {
    let path = of.get("path").and_then(Item::as_str).unwrap_or(usual);
    let path = folder.join(path);
    of.insert("path", value(path.to_string_lossy().as_ref()));
}

/// Links the files of the user in the component's folder into that of the variant.
fn link(folder: &Path, staged: &Path) -> io::Result<()> {
    let is_own = |name: &OsStr| OWN.iter().any(|own| *own == name);
    for entry in std::fs::read_dir(staged)? {
        let entry = entry?;
        let wanted = folder.join(entry.file_name());
        let path = entry.path();
        let stays = !is_own(&entry.file_name())
            && std::fs::symlink_metadata(&wanted).is_ok()
            && std::fs::read_link(&path).is_ok_and(|there| there == wanted);
        if entry.file_type()?.is_symlink() && !stays {
            std::fs::remove_file(path)?;
        }
    }
    for entry in std::fs::read_dir(folder)? {
        let name = entry?.file_name();
        let path = staged.join(&name);
        if !is_own(&name) && std::fs::symlink_metadata(&path).is_err() {
            std::os::unix::fs::symlink(folder.join(&name), path)?;
        }
    }
    Ok(())
}

/// Begins with the versions of the user's workspace, again when they or the members are others.
/// Cargo adds packages that only the variants need; they stay until then.
fn lock(root: &Path, folder: &Path, members: &[String]) -> Result<(), Error> {
    let there = root.join("Cargo.lock");
    let text = match rc_files::read(&there) {
        Ok(text) => text,
        // Nothing has been built yet.
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error).map_err(cannot(format!("read {}", there.display()))),
    };
    let of = Path::new("Cargo.lock.of-workspace");
    let wanted = format!("# {}\n{text}", members.join(", "));
    let locked = folder.join("Cargo.lock").exists();
    if locked && rc_files::read(&folder.join(of)).is_ok_and(|before| before == wanted) {
        return Ok(());
    }
    let mut files = Files::default();
    files.add("Cargo.lock", Owner::Generic, text);
    files.add(of, Owner::Generic, wanted);
    write(&files, folder)
}

#[cfg(test)]
mod tests;
