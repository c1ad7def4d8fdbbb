//! `rcdeploy world query`: asks `rcgen`, which alone has the queries of graphs.

use super::replica::Listener;
use crate::cli::output::{Failure, system};
use graph_exchange::graph_json;
use rc_diagnostics::foreign::clean;
use rc_world::Token;
use std::io::ErrorKind;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

const PROGRAM: &str = "rcgen";
/// How many names of a folder are tried.
const MOST_FOLDERS: usize = 64;

/// A folder that is removed at the end.
struct Folder(PathBuf);

impl Folder {
    /// A name that is not used: an old file may have stayed, and the temporary folder is for all
    /// users.
    fn new() -> Result<Self, Failure> {
        for number in 0..MOST_FOLDERS {
            let name = format!("rcdeploy-world-{}-{number}", std::process::id());
            let path = std::env::temp_dir().join(name);
            match std::fs::DirBuilder::new().mode(0o700).create(&path) {
                Ok(()) => return Ok(Self(path)),
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => {
                    return Err(system(&format_args!(
                        "cannot make {}: {error}",
                        path.display()
                    )));
                }
            }
        }
        let folder = std::env::temp_dir();
        Err(system(&format_args!(
            "remove the folders `rcdeploy-world-*` in {}",
            folder.display()
        )))
    }

    fn write(&self, name: &str, text: &str) -> Result<PathBuf, Failure> {
        // The name comes from a component.
        let mut parts = Path::new(name).components();
        let is_plain = matches!(
            (parts.next(), parts.next()),
            (Some(Component::Normal(_)), None)
        );
        if !is_plain {
            return Err(system(&format_args!(
                "`{}` is not a name of a file",
                clean(name)
            )));
        }
        let path = self.0.join(name);
        std::fs::write(&path, text)
            .map_err(|error| system(&format_args!("cannot write {}: {error}", path.display())))?;
        Ok(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // Remains are in the temporary folder.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub(super) fn query(
    network: &str,
    query: Option<&str>,
    parameters: &[String],
    after: Option<Token>,
) -> Result<u8, Failure> {
    let Some(listener) = Listener::joined_after(network, after)? else {
        return Ok(0);
    };
    let folder = Folder::new()?;
    for (name, text) in &listener.files {
        folder.write(name, text)?;
    }
    let text = graph_json::write(&super::document_of(&listener));
    let file = folder.write("world.graph", &text)?;
    // The one next to this program fits it; otherwise the one in the PATH.
    let own = std::env::current_exe().ok();
    let beside = own.map(|own| own.with_file_name(PROGRAM));
    let program = beside.filter(|beside| beside.is_file());
    let program = program.unwrap_or_else(|| PathBuf::from(PROGRAM));
    let ran = Command::new(&program)
        .arg("query")
        .arg(&file)
        .args(query)
        .args(parameters)
        .status();
    match ran {
        Ok(status) => Ok(status
            .code()
            .and_then(|code| code.try_into().ok())
            .unwrap_or(3)),
        Err(error) if error.kind() == ErrorKind::NotFound => Err(system(&format_args!(
            "there is no `{PROGRAM}`; `cargo xtask install`, in the folder of RoboComp, installs it"
        ))),
        Err(error) => Err(system(&format_args!("{}: {error}", program.display()))),
    }
}
