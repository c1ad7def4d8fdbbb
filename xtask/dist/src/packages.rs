//! What belongs into which package of Debian.

use crate::build::{Build, output};
use crate::selection::{Component, LIBRARY, Language, Selection, TOOLS, components};
use crate::{book, deb, named, tree, wheel};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The licences of the project.
pub(crate) const LICENCES: [&str; 2] = ["LICENSE-MIT", "LICENSE-APACHE"];

/// The prefix of packages, as `rc_codegen::installed` has it, without the `/` in front.
pub(crate) const PREFIX: &str = "opt/robocomp";

/// Tools that write completion scripts and pages of their own.
const DOCUMENTED: [&str; 2] = ["rcgen", "rcdeploy"];

/// The program that `rcdeploy` starts, and no user.
const INTERNAL: &str = "rcforward";

/// Components that drive devices, or stand for them.
const HAL: [&str; 8] = [
    "camera",
    "joint_controller",
    "lidar",
    "motor_bus",
    "rcis",
    "serial_imu",
    "simulator",
    "usb_camera",
];

/// Files beside a `.cdsl` that networks name.
const DATA: [&str; 5] = ["gdsl", "map", "obj", "urdf", "xml"];

/// Packages of Debian with packages of `PyPI`.
const PYTHON: [(&str, &str); 2] = [
    ("numpy", "python3-numpy"),
    ("opencv-python-headless", "python3-opencv"),
];

const PROJECT: &str = "RoboComp describes robots as networks of processes, by small text files.";

/// Whether a package has programs of one architecture.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Architecture {
    Any,
    All,
}

/// A package whose files are in their places below a folder.
pub(crate) struct Package {
    pub(crate) name: String,
    pub(crate) architecture: Architecture,
    pub(crate) section: &'static str,
    pub(crate) depends: Vec<String>,
    pub(crate) recommends: Vec<String>,
    /// One line.
    pub(crate) summary: String,
    /// Lines.
    pub(crate) description: String,
    pub(crate) tree: PathBuf,
    /// Scripts of the package: their names, and their texts.
    pub(crate) scripts: Vec<(&'static str, String)>,
}

impl Package {
    fn new(name: &str, summary: &str, stage: &Path) -> Self {
        Self {
            name: name.to_owned(),
            architecture: Architecture::All,
            section: "science",
            depends: Vec::new(),
            recommends: Vec::new(),
            summary: summary.to_owned(),
            description: PROJECT.to_owned(),
            tree: stage.join("packages").join(name),
            scripts: Vec::new(),
        }
    }

    /// The place of a file of the prefix.
    fn below_prefix(&self, path: &Path) -> PathBuf {
        self.tree.join(PREFIX).join(path)
    }
}

/// All selected packages, with their files below `stage`.
pub(crate) fn all(
    build: &Build,
    selected: &Selection,
    wheel: Option<&Path>,
    stage: &Path,
) -> Result<Vec<Package>, String> {
    let mut all = Vec::new();
    let exactly = |name: &str| format!("{name} (= {})", build.version);
    for (tool, summary, _) in TOOLS
        .iter()
        .filter(|(tool, ..)| selected.tools.contains(tool))
    {
        all.push(program(build, tool, summary, stage)?);
    }
    all.extend(installed(build, selected, stage)?);
    if selected.python {
        all.push(python(build, wheel, stage)?);
    }
    let every = components(build)?;
    let meta = |name: &'static str, summary: &str, members: Vec<String>| {
        let mut package = Package::new(name, summary, stage);
        package.section = "metapackages";
        package.description += "\nThis package has no files of its own; it names others.";
        package.depends = members.iter().map(|member| exactly(member)).collect();
        package
    };
    for name in &selected.others {
        all.push(match *name {
            "robocomp-tools" => {
                let tools = TOOLS.map(|(tool, ..)| tool.to_owned()).to_vec();
                meta(name, "tools of RoboComp", tools)
            }
            "robocomp-hal" => {
                let hal = every.iter().filter(|one| HAL.contains(&one.name.as_str()));
                let hal = hal.map(Component::package).collect();
                meta(
                    name,
                    "components of RoboComp that drive or simulate devices",
                    hal,
                )
            }
            "robocomp-components" => {
                let members = every.iter().map(Component::package).collect();
                let mut package = meta(
                    name,
                    "all components of RoboComp, and networks of them",
                    members,
                );
                PROJECT.clone_into(&mut package.description);
                package.description +=
                    "\nIts networks in /opt/robocomp/components/networks are examples to copy.";
                package.section = "science";
                let folder = build.root.join("components/networks");
                for file in tree::files(&folder)? {
                    let is_source = file.extension().is_some_and(|e| e == "ddsl" || e == "toml");
                    if is_source {
                        let place = Path::new("components/networks").join(&file);
                        tree::copy(&folder.join(&file), &package.below_prefix(&place))?;
                    }
                }
                package
            }
            "robocomp-interfaces" => interfaces(build, stage)?,
            "robocomp-cpp" => library(build, stage)?,
            "robocomp-doc" => documentation(build, stage)?,
            // With the components.
            _ => continue,
        });
    }
    Ok(all)
}

/// A tool: its program, its pages, and its completion scripts.
fn program(build: &Build, tool: &str, summary: &str, stage: &Path) -> Result<Package, String> {
    let mut package = Package::new(tool, summary, stage);
    package.architecture = Architecture::Any;
    package.section = "devel";
    if tool == "rcdeploy" {
        package.recommends.push(INTERNAL.to_owned());
    }
    let place = Path::new("bin").join(tool);
    tree::copy_program(&build.programs().join(tool), &package.below_prefix(&place))?;
    if tool == INTERNAL {
        return Ok(package);
    }
    let link = package.tree.join("usr/bin").join(tool);
    tree::link(&format!("/{PREFIX}/bin/{tool}"), &link)?;
    let built = build.programs().join(tool);
    let pages = package.tree.join("usr/share/man/man1");
    if DOCUMENTED.contains(&tool) {
        for (shell, place) in [
            ("bash", format!("bash-completion/completions/{tool}")),
            ("zsh", format!("zsh/vendor-completions/_{tool}")),
            ("fish", format!("fish/vendor_completions.d/{tool}.fish")),
        ] {
            let script = output(Command::new(&built).args(["completions", shell]))?;
            let place = package.tree.join("usr/share").join(place);
            tree::write(&place, script.as_bytes())?;
        }
        output(Command::new(&built).arg("man").arg(&pages))?;
        for page in tree::files(&pages)? {
            let page = pages.join(page);
            let text = std::fs::read(&page).map_err(named(&page))?;
            deb::packed(&page, &text)?;
        }
    } else {
        let help = output(Command::new(&built).arg("--help"))?;
        let page = pages.join(format!("{tool}.1"));
        deb::packed(&page, page_of_help(tool, summary, &help).as_bytes())?;
    }
    Ok(package)
}

/// A man page of what `--help` prints.
fn page_of_help(tool: &str, summary: &str, help: &str) -> String {
    let mut page = format!(
        ".TH {} 1\n.SH NAME\n{tool} \\- {summary}\n.SH DESCRIPTION\n.nf\n",
        tool.to_uppercase()
    );
    for line in help.lines() {
        let line = line.replace('\\', "\\e").replace('-', "\\-");
        // A dot or a quote begins a command.
        let guard = if line.starts_with(['.', '\'']) {
            "\\&"
        } else {
            ""
        };
        page += &format!("{guard}{line}\n");
    }
    page + ".fi\n"
}

/// The packages of components, and of the files that they share.
fn installed(build: &Build, selected: &Selection, stage: &Path) -> Result<Vec<Package>, String> {
    let data = Package::new(
        "robocomp-data",
        "maps and scenes for components of RoboComp",
        stage,
    );
    let prefix = stage.join("installed");
    let exactly = |name: &str| format!("{name} (= {})", build.version);
    let mut all = Vec::new();
    for component in &selected.components {
        let mut rcgen = Command::new(build.programs().join("rcgen"));
        rcgen.args(["install", "--profile", build.profile.word(), "--prefix"]);
        rcgen.arg(&prefix);
        rcgen.arg(
            component
                .folder(build)
                .join(format!("{}.cdsl", component.name)),
        );
        rcgen.env("CARGO_TARGET_DIR", &build.target);
        let printed = output(&mut rcgen)?;
        let files = printed.lines().filter_map(|line| line.strip_prefix("  "));
        let mut package = Package::new(&component.package(), "", stage);
        package.summary = format!("component {} of RoboComp", component.name);
        package.description = format!("{}\n{PROJECT}", component.summary);
        // Its program was built with these interfaces.
        package.depends.push(exactly("robocomp-interfaces"));
        package.recommends.push("rcdeploy".to_owned());
        if component.language == Language::Python {
            package.depends.extend(requirements(build, component)?);
            let folder = component.place();
            let script = without_compiled(&folder.to_string_lossy());
            package.scripts.push(("prerm", script));
        } else {
            package.architecture = Architecture::Any;
        }
        let own = Path::new("components").join(&component.name);
        for file in files.map(Path::new) {
            let from = prefix.join(file);
            let others = file.strip_prefix("components").ok();
            let other = others.and_then(|inside| inside.iter().next());
            let other = other.and_then(|name| name.to_str()).unwrap_or_default();
            if file.starts_with(&own) {
                let place = package.below_prefix(file);
                if tree::is_elf(&from) {
                    tree::copy_program(&from, &place)?;
                } else {
                    tree::copy(&from, &place)?;
                }
            } else if build
                .root
                .join("components")
                .join(other)
                .join(format!("{other}.cdsl"))
                .is_file()
            {
                package
                    .depends
                    .push(exactly(&format!("robocomp-{}", other.replace('_', "-"))));
            } else if file.starts_with("lib") {
                package.depends.push(exactly(LIBRARY.0));
            } else if !file.starts_with("interfaces") {
                package.depends.push(exactly(&data.name));
                tree::copy(&from, &data.below_prefix(file))?;
            }
        }
        let folder = build.root.join(&own);
        copy_data(&folder, &package.below_prefix(&own))?;
        all.push(package);
    }
    if selected.others.contains("robocomp-data") {
        for folder in ["components/maps", "innermodel/scenes"] {
            let place = data.below_prefix(Path::new(folder));
            copy_data(&build.root.join(folder), &place)?;
        }
        all.push(data);
    }
    Ok(all)
}

/// Copies the data in a folder that networks may name.
fn copy_data(from: &Path, to: &Path) -> Result<(), String> {
    for entry in from.read_dir().map_err(named(from))? {
        let path = entry.map_err(named(from))?.path();
        let ending = path.extension().and_then(|ending| ending.to_str());
        if path.is_file() && ending.is_some_and(|ending| DATA.contains(&ending)) {
            tree::copy(&path, &to.join(path.file_name().unwrap_or_default()))?;
        }
    }
    Ok(())
}

/// The packages that a component in Python needs.
fn requirements(build: &Build, component: &Component) -> Result<Vec<String>, String> {
    let path = build
        .root
        .join("components")
        .join(&component.name)
        .join("pyproject.toml");
    let text = std::fs::read_to_string(&path).map_err(named(&path))?;
    let list = text
        .split_once("\ndependencies = [")
        .map_or("", |(_, rest)| rest);
    let list = list.split(']').next().unwrap_or_default();
    let known: BTreeMap<&str, &str> = PYTHON.into_iter().collect();
    let mut all = vec![format!("python3-robocomp (= {})", build.version)];
    for requirement in list.split('"').skip(1).step_by(2) {
        let end = requirement.find(|c: char| !c.is_ascii_alphanumeric() && c != '-' && c != '_');
        let name = &requirement[..end.unwrap_or(requirement.len())];
        let package = known.get(name);
        let package = package.ok_or(format!(
            "{}: no package of Debian is known for `{name}`",
            path.display()
        ))?;
        all.push((*package).to_owned());
    }
    Ok(all)
}

/// A script that removes what Python has compiled.
fn without_compiled(folder: &str) -> String {
    format!(
        "#!/bin/sh\nset -e\nif [ -d {folder} ]; then\n    \
         find {folder} -depth -type d -name __pycache__ -exec rm -r {{}} +\nfi\n"
    )
}

fn interfaces(build: &Build, stage: &Path) -> Result<Package, String> {
    let package = Package::new(
        "robocomp-interfaces",
        "interfaces of components of RoboComp",
        stage,
    );
    let folder = build.root.join("components/interfaces");
    for entry in folder.read_dir().map_err(named(&folder))? {
        let path = entry.map_err(named(&folder))?.path();
        let ending = path.extension().and_then(|ending| ending.to_str());
        if ending.is_some_and(|ending| ["idsl", "dproto", "gdsl"].contains(&ending)) {
            let place = Path::new("interfaces").join(path.file_name().unwrap_or_default());
            tree::copy(&path, &package.below_prefix(&place))?;
        }
    }
    Ok(package)
}

/// The library of components in C++, where their programs look for it.
fn library(build: &Build, stage: &Path) -> Result<Package, String> {
    let (name, _, file) = LIBRARY;
    let mut package = Package::new(name, "library of components of RoboComp in C++", stage);
    package.architecture = Architecture::Any;
    package.section = "libs";
    let place = package.below_prefix(&Path::new("lib").join(file));
    tree::copy_program(&build.programs().join(file), &place)?;
    tree::set_mode(&place, false)?;
    Ok(package)
}

/// The package for the Python of the system, with the wheel for environments.
fn python(build: &Build, wheel: Option<&Path>, stage: &Path) -> Result<Package, String> {
    let mut package = Package::new(
        "python3-robocomp",
        "clients and components of RoboComp in Python",
        stage,
    );
    package.architecture = Architecture::Any;
    package.section = "python";
    package.depends = ["python3 (>= 3.11)", "python3-numpy"]
        .map(str::to_owned)
        .to_vec();
    let packages = package.tree.join("usr/lib/python3/dist-packages");
    wheel::package(build, &packages.join("robocomp"))?;
    let information = packages.join(format!("robocomp-{}.dist-info", build.version));
    let metadata = wheel::metadata(build);
    tree::write(&information.join("METADATA"), metadata.as_bytes())?;
    tree::write(&information.join("INSTALLER"), b"debian\n")?;
    if let Some(wheel) = wheel {
        let place = Path::new("wheels").join(wheel.file_name().unwrap_or_default());
        tree::copy(wheel, &package.below_prefix(&place))?;
    }
    let compile = "#!/bin/sh\nset -e\nif [ \"$1\" = configure ] && command -v py3compile >/dev/null; then\n    \
                   py3compile -p python3-robocomp\nfi\n";
    package.scripts.push(("postinst", compile.to_owned()));
    let folder = "/usr/lib/python3/dist-packages/robocomp";
    package.scripts.push(("prerm", without_compiled(folder)));
    Ok(package)
}

fn documentation(build: &Build, stage: &Path) -> Result<Package, String> {
    let mut package = Package::new("robocomp-doc", "documentation of RoboComp", stage);
    package.section = "doc";
    let place = package.tree.join("usr/share/doc/robocomp-doc");
    let docs = build.root.join("docs");
    for file in tree::files(&docs)? {
        tree::copy(&docs.join(&file), &place.join("docs").join(&file))?;
    }
    let pages = place.join("html");
    book::write(build, &pages, false)?;
    let mark = pages.join(book::MARK);
    std::fs::remove_file(&mark).map_err(named(&mark))?;
    for file in [
        "README.md",
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "BENCHMARKS.md",
    ] {
        tree::copy(&build.root.join(file), &place.join(file))?;
    }
    Ok(package)
}
