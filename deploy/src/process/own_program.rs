//! The file of this program, from which the supervisor starts others of its kind.

use std::fs::metadata;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// This program, also if another file has its path now: a build may have replaced it.
pub(crate) const OWN: &str = "/proc/self/exe";

/// The path of this program; [`OWN`] if the file there is another one by now.
///
/// # Errors
/// The system does not name this program.
pub(crate) fn own_program() -> io::Result<PathBuf> {
    let path = std::env::current_exe()?;
    let own = metadata(OWN)?;
    let same = |there: std::fs::Metadata| (there.dev(), there.ino()) == (own.dev(), own.ino());
    Ok(if metadata(&path).is_ok_and(same) {
        path
    } else {
        Path::new(OWN).to_path_buf()
    })
}

/// [`own_program`] for another program that starts it: [`OWN`] would be that program. It is valid as
/// long as this process lives.
///
/// # Errors
/// The system does not name this program.
pub(crate) fn own_program_of_this_process() -> io::Result<PathBuf> {
    own_program().map(of_this_process)
}

fn of_this_process(path: PathBuf) -> PathBuf {
    if path == Path::new(OWN) {
        return format!("/proc/{}/exe", std::process::id()).into();
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::Command;

    #[test]
    fn another_program_finds_this_one() {
        let here = PathBuf::from("/opt/rcdeploy");
        assert_eq!(of_this_process(here.clone()), here);
        let own = of_this_process(OWN.into());
        let read = Command::new("readlink").arg(own).output();
        let read = String::from_utf8(read.expect("readlink").stdout).expect("a path");
        let this = std::env::current_exe().expect("this program");
        assert_eq!(read.trim_end(), this.display().to_string());
    }
}
