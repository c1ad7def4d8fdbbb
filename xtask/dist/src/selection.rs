//! The packages that there are, and those that a command line selects.

use crate::build::Build;
use crate::packages::PREFIX;
use crate::{named, wheel};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The programs of the tools, with what each is for, and its crate.
pub(crate) const TOOLS: [(&str, &str, &str); 5] = [
    (
        "rcgen",
        "generator of robot components from their descriptions",
        "rcgen",
    ),
    (
        "rcdeploy",
        "checks, starts and supervises networks of robot components",
        "rc-deploy",
    ),
    (
        "rcview",
        "viewer and editor of InnerModel scenes",
        "innermodel-viewer",
    ),
    (
        "rcfoxglove",
        "server of robot networks for Foxglove",
        "rc-foxglove",
    ),
    (
        "rcforward",
        "converter and proxy between robot components",
        "rc-forward",
    ),
];
/// Components that are no use outside of this project's tests.
const LEFT_OUT: [&str; 1] = ["interop"];

/// A component that can be packed.
pub(crate) struct Component {
    pub(crate) name: String,
    pub(crate) language: Language,
    pub(crate) summary: String,
}

/// The language of a component, which says what builds it.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Language {
    Rust,
    Python,
    Cpp,
}

impl Component {
    /// The name of its package.
    pub(crate) fn package(&self) -> String {
        format!("robocomp-{}", self.name.replace('_', "-"))
    }

    /// Its folder among the sources.
    pub(crate) fn folder(&self, build: &Build) -> PathBuf {
        build.root.join("components").join(&self.name)
    }

    /// Its folder where it is installed.
    pub(crate) fn place(&self) -> PathBuf {
        Path::new("/")
            .join(PREFIX)
            .join("components")
            .join(&self.name)
    }
}

/// The packages to write.
pub(crate) struct Selection {
    pub(crate) tools: Vec<&'static str>,
    pub(crate) components: Vec<Component>,
    /// The package for Python.
    pub(crate) python: bool,
    pub(crate) wheel: bool,
    /// The library crates.
    pub(crate) crates: bool,
    /// Names of the others.
    pub(crate) others: BTreeSet<&'static str>,
}

impl Selection {
    /// Whether a package has programs, libraries or extension modules.
    pub(crate) fn has_programs(&self) -> bool {
        let none = self.tools.is_empty() && self.components.is_empty();
        !none || self.wheel || self.python || self.has_cpp()
    }

    /// The components in a language.
    pub(crate) fn of(&self, language: Language) -> impl Iterator<Item = &Component> {
        let all = self.components.iter();
        all.filter(move |one| one.language == language)
    }

    /// Whether a package needs the library of components in C++.
    pub(crate) fn has_cpp(&self) -> bool {
        self.of(Language::Cpp).next().is_some() || self.others.contains(LIBRARY.0)
    }

    /// The crates that are linked into the programs.
    pub(crate) fn crates(&self) -> BTreeSet<String> {
        let tools = TOOLS.iter().filter(|(tool, ..)| self.tools.contains(tool));
        let mut all: BTreeSet<String> = tools.map(|(.., name)| (*name).to_owned()).collect();
        all.extend(self.of(Language::Rust).map(|one| one.name.clone()));
        if self.has_cpp() {
            all.insert(LIBRARY.1.to_owned());
        }
        if self.python || self.wheel {
            all.extend(wheel::MODULES.iter().map(|(name, ..)| (*name).to_owned()));
        }
        all
    }
}

/// The package of the library of components in C++, its crate, and its file.
pub(crate) const LIBRARY: (&str, &str, &str) = ("robocomp-cpp", "rc-cpp", "librobocomp_cpp.so");

const META: [&str; 3] = ["robocomp-tools", "robocomp-components", "robocomp-hal"];
const OTHERS: [&str; 4] = [
    "robocomp-interfaces",
    "robocomp-data",
    LIBRARY.0,
    "robocomp-doc",
];

/// The packages of these names; all without names.
pub(crate) fn selected(build: &Build, only: &[String]) -> Result<Selection, String> {
    let components = components(build)?;
    let mut known: BTreeSet<String> = components.iter().map(Component::package).collect();
    known.extend(TOOLS.map(|(name, ..)| name.to_owned()));
    known.extend(META.iter().chain(&OTHERS).map(|&name| name.to_owned()));
    known.extend(["python3-robocomp", "wheel", "crates"].map(str::to_owned));
    if let Some(unknown) = only.iter().find(|name| !known.contains(*name)) {
        let known = known.into_iter().collect::<Vec<_>>().join(", ");
        return Err(format!("`--only {unknown}`: there are {known}"));
    }
    let wanted = |name: &str| only.is_empty() || only.iter().any(|one| one == name);
    let tools = TOOLS.iter().map(|(tool, ..)| *tool);
    let others = META.into_iter().chain(OTHERS);
    Ok(Selection {
        tools: tools.filter(|tool| wanted(tool)).collect(),
        components: components
            .into_iter()
            .filter(|one| wanted(&one.package()))
            .collect(),
        python: wanted("python3-robocomp"),
        wheel: wanted("wheel"),
        crates: wanted("crates"),
        others: others.filter(|name| wanted(name)).collect(),
    })
}

/// Whether a file has the name of a package, of this version or another one.
pub(crate) fn is_ours(file: &str) -> bool {
    let name = file.split('_').next().unwrap_or_default();
    name.starts_with("robocomp-")
        || name == "python3-robocomp"
        || TOOLS.iter().any(|(tool, ..)| name == *tool)
}

/// The components of this project that can be installed.
pub(crate) fn components(build: &Build) -> Result<Vec<Component>, String> {
    let folder = build.root.join("components");
    let mut all = Vec::new();
    for entry in folder.read_dir().map_err(named(&folder))? {
        let name = entry.map_err(named(&folder))?.file_name();
        let name = name.to_string_lossy().into_owned();
        let path = folder.join(&name).join(format!("{name}.cdsl"));
        if LEFT_OUT.contains(&name.as_str()) || !path.is_file() {
            continue;
        }
        let text = std::fs::read_to_string(&path).map_err(named(&path))?;
        let says = |language: &str| text.contains(&format!("language {language};"));
        let language = match (says("python"), says("cpp")) {
            (true, _) => Language::Python,
            (_, true) => Language::Cpp,
            _ => Language::Rust,
        };
        let summary = text
            .lines()
            .next()
            .and_then(|line| line.strip_prefix("// "));
        let summary = summary.ok_or(format!("{}: its first line is no comment", path.display()))?;
        all.push(Component {
            language,
            summary: summary.to_owned(),
            name,
        });
    }
    all.sort_by(|a, b| a.name.cmp(&b.name));
    Ok(all)
}
