//! What people begin with: a workspace, and an empty component in it.

use crate::files::{Files, Owner};
use crate::interface_crate;
use crate::names;
use std::path::{Path, PathBuf};

/// Where a new workspace takes this project's crates from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Framework {
    /// A folder with this project.
    Path(PathBuf),
    /// A git address.
    Git(String),
}

impl Framework {
    /// A git address has a scheme or ends in `.git`; everything else is a folder, which must hold
    /// this project.
    pub fn parse(text: &str) -> Result<Self, String> {
        let is_git = Path::new(text).extension().is_some_and(|e| e == "git");
        if text.contains("://") || text.starts_with("git@") || is_git {
            return Ok(Self::Git(text.to_owned()));
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

    fn dependency(&self, folder: &str) -> String {
        match self {
            Self::Path(path) => {
                let path = path
                    .join(folder)
                    .to_string_lossy()
                    .replace('\\', "\\\\")
                    .replace('"', "\\\"");
                format!("{{ path = \"{path}\" }}")
            }
            Self::Git(url) => format!("{{ git = \"{}\" }}", url.replace('"', "")),
        }
    }
}

/// A workspace for components.
pub fn init(framework: &Framework) -> Result<Files, interface_crate::Error> {
    let mut files = Files::default();
    let crates = [
        ("rc-middleware", "middleware"),
        ("rc-runtime", "runtime"),
        ("rc-iceoryx2", "middleware/iceoryx2"),
        ("rc-dds", "middleware/dds"),
        ("rc-ros2", "middleware/ros2"),
        ("rc-local", "middleware/local"),
    ];
    let dependencies: String = crates
        .iter()
        .map(|(name, folder)| format!("{name} = {}\n", framework.dependency(folder)))
        .collect();
    let manifest = format!(
        "# A network of components. `rcgen new NAME` adds one; `rcgen components/NAME/NAME.cdsl` generates it,\n\
         # `rcgen .` generates all.\n\
         [workspace]\nresolver = \"3\"\n\
         members = [\"components/*\", \"components/*/generated\", \"interfaces/generated\"]\n\n\
         [workspace.dependencies]\ninterfaces = {{ path = \"interfaces/generated\" }}\n{dependencies}\n\
         [profile.dev]\ndebug = \"line-tables-only\"\n"
    );
    files.add("Cargo.toml", Owner::Specific, manifest);
    files.add(".gitignore", Owner::Specific, "/target\n".to_owned());
    files.add(
        "components/README.md",
        Owner::Specific,
        "One folder a component; `rcgen new NAME` makes one.\n".to_owned(),
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
        "deployments/README.md",
        Owner::Specific,
        "One .ddsl file a network; `rcdeploy check FILE.ddsl` checks it, `rcdeploy up --build FILE.ddsl` runs it.\n".to_owned(),
    );
    Ok(files)
}

/// An empty component to fill in.
pub fn new_component(name: &str) -> Result<Files, String> {
    let fits = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    if !fits
        || names::snake(name).ends_with('_')
        || ["generated", "interfaces"].contains(&names::package(name).as_str())
    {
        return Err(format!(
            "`{name}` cannot be the name of a component: letters, digits and `_`, not a word of Rust"
        ));
    }
    let mut files = Files::default();
    let cdsl = format!(
        "// What this component communicates. Interfaces come from .idsl files: `import \"Laser.idsl\";`\n\n\
         Component {name}\n{{\n    Communications\n    {{\n        \
         // implements Speech;        answers calls\n        \
         // requires Laser;           calls\n        \
         // publishes LaserPub;       sends to all who listen\n        \
         // subscribesTo LaserPub;    listens\n    }};\n    \
         language rust;\n    parameters \"{name}.pdsl\";\n    period 100ms;\n}};\n"
    );
    let pdsl = format!(
        "// What may be set in etc/config.toml: NAME TYPE [DEFAULT] [MIN:MAX] [unit \"…\"];\n\n\
         ComponentParams {name}\n{{\n    // speed float 0.2 0:1 unit \"m/s\";\n}};\n"
    );
    let folder = Path::new("components").join(name);
    files.add(folder.join(format!("{name}.cdsl")), Owner::Specific, cdsl);
    files.add(folder.join(format!("{name}.pdsl")), Owner::Specific, pdsl);
    Ok(files)
}
