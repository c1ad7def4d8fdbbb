//! A new workspace for components.

use crate::files::{Files, Owner};
use crate::interface_crate;
use crate::paths;
use rc_vocabulary::Middleware;
use semver::VersionReq;
use std::path::{Path, PathBuf};

/// Where a new workspace takes this project's crates from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Framework {
    /// A folder with this project.
    Path(PathBuf),
    /// A git address, with `branch`, `tag` or `rev` and its value.
    Git(String, Option<(&'static str, String)>),
    /// A version in a registry.
    Version(String),
}

impl Framework {
    /// A git address has a scheme or ends in `.git`; `?branch=…`, `?tag=…` or `?rev=…` after it
    /// chooses a version. A version is written as in Cargo.toml. Everything else is a folder, which
    /// must contain this project.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (address, query) = match text.split_once('?') {
            Some((address, query)) => (address, Some(query)),
            None => (text, None),
        };
        let is_git = Path::new(address).extension().is_some_and(|e| e == "git");
        if address.contains("://") || address.starts_with("git@") || is_git {
            let at = query.map(|query| {
                let (key, value) = query.split_once('=').unwrap_or((query, ""));
                let known = ["branch", "tag", "rev"].into_iter().find(|known| *known == key);
                match known {
                    Some(key) if !value.is_empty() => Ok((key, value.to_owned())),
                    _ => Err(format!(
                        "--framework: expected `?branch=…`, `?tag=…` or `?rev=…` after the address, found `?{query}`"
                    )),
                }
            });
            return Ok(Self::Git(address.to_owned(), at.transpose()?));
        }
        if VersionReq::parse(text).is_ok() && !Path::new(text).is_dir() {
            return Ok(Self::Version(text.to_owned()));
        }
        let path = Path::new(text)
            .canonicalize()
            .map_err(|error| format!("--framework: `{text}` cannot be opened: {error}"))?;
        if !path.join("runtime/Cargo.toml").exists() {
            return Err(format!(
                "--framework: `{text}` is not a folder with this project: it has no runtime/Cargo.toml"
            ));
        }
        Ok(Self::Path(path))
    }

    /// The source for a workspace in `root`, which is absolute: a path that every user of the
    /// workspace shares is relative. That is one inside the workspace, or in the same git
    /// repository.
    #[must_use]
    pub fn seen_from(self, root: &Path) -> Self {
        let repository = |path: &Path| {
            let mut above = path.ancestors();
            above
                .find(|folder| folder.join(".git").exists())
                .map(Path::to_path_buf)
        };
        match self {
            Self::Path(path)
                if path.starts_with(root)
                    || repository(root).is_some_and(|there| path.starts_with(there)) =>
            {
                Self::Path(paths::relative(root, &path))
            }
            other => other,
        }
    }

    /// Whether a copy of the workspace on another machine finds it.
    pub fn is_portable(&self) -> bool {
        !matches!(self, Self::Path(path) if path.is_absolute())
    }

    /// One of its crates, in `folder`, as a dependency in a manifest.
    fn dependency(&self, folder: &str) -> String {
        let text = |text: &str| toml_edit::Value::from(text).to_string();
        match self {
            Self::Path(path) => {
                format!(
                    "{{ path = {} }}",
                    text(&path.join(folder).to_string_lossy())
                )
            }
            Self::Git(url, None) => format!("{{ git = {} }}", text(url)),
            Self::Git(url, Some((key, value))) => {
                format!("{{ git = {}, {key} = {} }}", text(url), text(value))
            }
            Self::Version(version) => text(version),
        }
    }
}

/// The crates that a workspace takes from the framework, with their folders there.
fn crates() -> impl Iterator<Item = (&'static str, &'static str)> {
    let first = [("rc-middleware", "middleware"), ("rc-runtime", "runtime")];
    let backends = Middleware::ALL.map(|middleware| middleware.can().package);
    let last = [
        ("innermodel-viewer", "innermodel/viewer"),
        ("rc-world-typed", "world/typed"),
    ];
    first.into_iter().chain(backends).chain(last)
}

/// A workspace for components, with a first network of this name.
pub fn init(network: &str, framework: &Framework) -> Result<Files, interface_crate::Error> {
    let mut files = Files::default();
    let dependencies: String = crates()
        .map(|(name, folder)| format!("{name} = {}\n", framework.dependency(folder)))
        .collect();
    let manifest = format!(
        "# Components, their interfaces and networks. README.md says how to begin.\n\
         [workspace]\nresolver = \"3\"\n\
         members = [\"components/*\", \"components/*/generated\", \"interfaces/generated\"]\n\n\
         [workspace.dependencies]\ninterfaces = {{ path = \"interfaces/generated\" }}\n{dependencies}\n\
         [profile.dev]\ndebug = \"line-tables-only\"\n"
    );
    let readme = format!(
        "# {network}\n\n\
         Components of a robot. They need Linux, cargo, a C compiler, and the tools `rcgen` and `rcdeploy`.\n\n\
         ```\n\
         # makes a component in components/guard\n\
         rcgen new guard --requires Laser\n\
         # checks all files, and generates all components after a change of their descriptions\n\
         rcgen check\n\
         rcgen generate\n\
         # builds the network and runs it; Ctrl-C stops it\n\
         rcdeploy up --build deployments/{network}.ddsl\n\
         ```\n\n\
         | folder | holds |\n|---|---|\n\
         | `components` | one folder for each component: its description (`.cdsl`, `.pdsl`), its worker in `src/` |\n\
         | `interfaces` | `.idsl` files that components share: `import \"NAME.idsl\";` finds them |\n\
         | `deployments` | one `.ddsl` file for each network |\n\n\
         `rcgen` writes the folders `generated`. Commit them, or run `rcgen generate` after a checkout.\n"
    );
    let first = format!(
        "// A network: a line for each component that runs in it.\n\n\
         Deployment {network}\n{{\n    // Component guard {{ cdsl \"../components/guard/guard.cdsl\"; }};\n}};\n"
    );
    files.add("Cargo.toml", Owner::Specific, manifest);
    files.add("README.md", Owner::Specific, readme);
    files.add(".gitignore", Owner::Specific, "/target\n".to_owned());
    files.add(
        "components/README.md",
        Owner::Specific,
        "One folder for each component; `rcgen new NAME` makes one.\n".to_owned(),
    );
    files.add(
        "interfaces/README.md",
        Owner::Specific,
        "The .idsl files that components of this workspace share: `import \"NAME.idsl\";` finds them here.\n\n\
         `generated/` is the crate `interfaces` with the types of all components. Your libraries use it, too: \
         `interfaces.workspace = true`.\n"
            .to_owned(),
    );
    for (path, _, text) in interface_crate::empty()?.iter() {
        let path = Path::new("interfaces").join(path);
        files.add(path, Owner::Specific, text.to_owned());
    }
    files.add(
        format!("deployments/{network}.ddsl"),
        Owner::Specific,
        first,
    );
    Ok(files)
}

/// Lets the workspace in `root` build into the target folder of a framework on this machine, with
/// the versions and profiles of the framework. Cargo then compiles few crates of crates.io
/// again.
///
/// # Errors
/// The framework is not a folder, or has no readable Cargo.lock.
pub fn share_target(files: &mut Files, root: &Path, framework: &Framework) -> Result<(), String> {
    let Framework::Path(path) = framework else {
        return Err("--shared-target: --framework must be a folder with this project".to_owned());
    };
    let lock = root.join(path).join("Cargo.lock");
    let lock = rc_files::read(&lock).map_err(|error| format!("{}: {error}", lock.display()))?;
    files.add("Cargo.lock", Owner::Specific, lock);
    let target = toml_edit::Value::from(path.join("target").to_string_lossy().as_ref());
    // Here, cargo accepts profiles of packages that the workspace does not have. In Cargo.toml, it
    // would warn of each at every build.
    let profiles = profiles(&root.join(path).join("Cargo.toml"))?;
    let configuration = format!(
        "# The target folder of the framework: crates that it has compiled are not compiled again.\n\
         [build]\ntarget-dir = {target}\n\n\
         # The profiles of the framework. A crate with another one is compiled again.\n{profiles}"
    );
    files.add(".cargo/config.toml", Owner::Specific, configuration);
    Ok(())
}

/// The profiles of the workspace with this manifest, without their comments.
fn profiles(manifest: &Path) -> Result<String, String> {
    let read = rc_files::read(manifest).map_err(|error| error.to_string());
    let parsed = read.and_then(|text| {
        text.parse()
            .map_err(|e: toml_edit::TomlError| e.to_string())
    });
    let parsed: toml_edit::DocumentMut =
        parsed.map_err(|error| format!("{}: {error}", manifest.display()))?;
    let mut profiles = toml_edit::DocumentMut::new();
    if let Some(profile) = parsed.get("profile") {
        profiles.insert("profile", profile.clone());
    }
    let text = profiles.to_string();
    let lines = text
        .lines()
        .filter(|line| !line.is_empty() && !line.starts_with('#'));
    Ok(lines.map(|line| format!("{line}\n")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_framework_is_a_git_address_a_version_or_a_folder() {
        let parse = |text: &str| Framework::parse(text);
        let dependency = |text: &str| parse(text).map(|framework| framework.dependency("runtime"));
        let git = |rest: &str| Ok(format!("{{ git = \"https://robots/rc\"{rest} }}"));
        assert_eq!(dependency("https://robots/rc"), git(""));
        let tagged = dependency("https://robots/rc?tag=v1");
        assert_eq!(tagged, git(", tag = \"v1\""));
        assert!(dependency("https://robots/rc?tga=v1").is_err());
        assert_eq!(dependency("0.1"), Ok("\"0.1\"".to_owned()));
        assert!(dependency("nowhere").is_err());
        let here = parse(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).expect("this project");
        let Framework::Path(path) = &here else {
            panic!("{here:?}")
        };
        assert!(
            !here
                .clone()
                .seen_from(Path::new("/elsewhere"))
                .is_portable()
        );
        let inside = here.clone().seen_from(path.parent().expect("a folder"));
        let name = path.file_name().expect("a name");
        assert_eq!(inside, Framework::Path(name.into()));
    }
}
