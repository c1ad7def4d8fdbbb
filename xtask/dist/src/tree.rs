//! The files of a package before they are packed: equal modes, and programs without symbols.

use crate::build::{output, run};
use crate::named;
use std::collections::BTreeSet;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Copies a file, and makes the folders above it.
pub(crate) fn copy(from: &Path, to: &Path) -> Result<(), String> {
    make_parent(to)?;
    std::fs::copy(from, to).map_err(named(from))?;
    let mode = std::fs::metadata(from)
        .map_err(named(from))?
        .permissions()
        .mode();
    set_mode(to, mode & 0o111 != 0)
}

/// Copies a program or a library, without its symbols.
pub(crate) fn copy_program(from: &Path, to: &Path) -> Result<(), String> {
    copy(from, to)?;
    run(Command::new("strip").arg("--strip-unneeded").arg(to))
}

/// Writes a text.
pub(crate) fn write(to: &Path, text: &[u8]) -> Result<(), String> {
    make_parent(to)?;
    std::fs::write(to, text).map_err(named(to))?;
    set_mode(to, false)
}

/// Makes a link.
pub(crate) fn link(target: &str, place: &Path) -> Result<(), String> {
    make_parent(place)?;
    std::os::unix::fs::symlink(target, place).map_err(named(place))
}

fn make_parent(path: &Path) -> Result<(), String> {
    let parent = path.parent().unwrap_or(path);
    std::fs::create_dir_all(parent).map_err(named(parent))
}

pub(crate) fn set_mode(path: &Path, is_program: bool) -> Result<(), String> {
    let mode = if is_program { 0o755 } else { 0o644 };
    let set = std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode));
    set.map_err(named(path))
}

/// All files and links below a folder, relative to it, in the order of their names.
pub(crate) fn files(folder: &Path) -> Result<BTreeSet<PathBuf>, String> {
    let mut all = BTreeSet::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in next.read_dir().map_err(named(&next))? {
            let entry = entry.map_err(named(&next))?;
            let path = entry.path();
            if entry.file_type().map_err(named(&path))?.is_dir() {
                folders.push(path);
            } else if let Ok(inside) = path.strip_prefix(folder) {
                all.insert(inside.to_path_buf());
            }
        }
    }
    Ok(all)
}

/// Whether a file is a program or a library of ELF.
pub(crate) fn is_elf(path: &Path) -> bool {
    use std::io::Read;
    let mut magic = [0; 4];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut magic));
    read.is_ok() && magic == *b"\x7fELF"
}

/// What programs and libraries need of the system.
#[derive(Default, PartialEq, Eq, Debug)]
pub(crate) struct Needs {
    /// The minor version of glibc 2, 0 without one.
    pub(crate) glibc: u32,
    /// Libraries beside glibc.
    pub(crate) libraries: BTreeSet<String>,
}

impl Needs {
    /// Adds the needs of a file of ELF.
    pub(crate) fn add(&mut self, path: &Path) -> Result<(), String> {
        let text = output(
            Command::new("readelf")
                .args(["-dVW"])
                .arg(path)
                .env("LC_ALL", "C"),
        )?;
        self.glibc = self.glibc.max(glibc(&text));
        let needed = text.lines().filter(|line| line.contains("(NEEDED)"));
        let names = needed.filter_map(|line| line.split(['[', ']']).nth(1));
        let own = [
            "libc.so",
            "libm.so",
            "libdl.so",
            "libpthread.so",
            "librt.so",
            "ld-linux",
        ];
        let others = names.filter(|name| !own.iter().any(|own| name.starts_with(own)));
        self.libraries.extend(others.map(str::to_owned));
        Ok(())
    }
}

/// The newest version of glibc that a program needs, by what `readelf` says of its symbols.
fn glibc(text: &str) -> u32 {
    let names = text.split("GLIBC_2.").skip(1);
    let minors = names.filter_map(|name| {
        let end = name.find(|c: char| !c.is_ascii_digit());
        name[..end.unwrap_or(name.len())].parse().ok()
    });
    minors.max().unwrap_or(0)
}
