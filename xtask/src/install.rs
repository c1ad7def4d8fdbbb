//! `cargo xtask install` and `uninstall`: both tools from one build of the workspace, with their
//! completion scripts and man pages.
//!
//! `cargo install` would build each tool alone, and thus most crates twice: the features of a
//! dependency follow from the packages that cargo selects. This build selects the workspace, as
//! `cargo run` does, and shares all libraries with it.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

const TOOLS: [&str; 2] = ["rcgen", "rcdeploy"];

/// The list of what was installed, below the root: a path a line, relative to the root.
const LIST: &str = "share/robocomp/installed.txt";

/// Builds and installs both tools.
pub(crate) fn install(root_argument: Option<&str>) -> Result<(), String> {
    let root = root(root_argument)?;
    let mut build = vec!["build", "--release", "--locked"];
    build.extend(TOOLS.iter().flat_map(|tool| ["--bin", tool]));
    crate::cargo(&build)?;
    // This program lies in the target folder, whatever its place is: TARGET/debug/xtask.
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    let target = own.ancestors().nth(2).ok_or("there is no target folder")?;
    let written = copy(&target.join("release"), &root)?;
    for path in &written {
        println!("wrote {}", root.join(path).display());
    }
    print!("{}", advice(&root));
    Ok(())
}

/// Removes what `install` wrote.
pub(crate) fn uninstall(root_argument: Option<&str>) -> Result<(), String> {
    let root = root(root_argument)?;
    for path in remove(&root)? {
        println!("removed {}", path.display());
    }
    Ok(())
}

/// The folder that holds `bin` and `share`, by the rules of `cargo install`.
fn root(named: Option<&str>) -> Result<PathBuf, String> {
    let variable = |name: &str| {
        let value = std::env::var_os(name).filter(|value| !value.is_empty());
        value.map(PathBuf::from)
    };
    let root = named
        .map(PathBuf::from)
        .or_else(|| variable("CARGO_INSTALL_ROOT"))
        .or_else(|| variable("CARGO_HOME"))
        .or_else(|| variable("HOME").map(|home| home.join(".cargo")))
        .ok_or("there is no HOME; name a folder with --root DIR")?;
    std::path::absolute(&root).map_err(|error| format!("{}: {error}", root.display()))
}

/// Copies the tools of the folder `built` below `root`, and lets them write what belongs to them.
/// Returns the paths of all files, relative to `root`. If it fails, the list holds what was written,
/// so that it can be removed.
fn copy(built: &Path, root: &Path) -> Result<BTreeSet<PathBuf>, String> {
    let mut written = BTreeSet::new();
    let outcome = place(built, root, &mut written);
    let before = listed(root)?;
    if outcome.is_ok() {
        for old in before.difference(&written) {
            remove_file(root, &root.join(old))?;
        }
    } else {
        written.extend(before);
    }
    let lines = written.iter().map(|path| format!("{}\n", path.display()));
    let lines = lines.collect::<String>();
    replace(root, Path::new(LIST), |new| fs::write(new, lines))?;
    outcome.map(|()| written)
}

/// Writes the files, and adds each one to `written`.
fn place(built: &Path, root: &Path, written: &mut BTreeSet<PathBuf>) -> Result<(), String> {
    for tool in TOOLS {
        let program = PathBuf::from("bin").join(tool);
        replace(root, &program, |new| {
            fs::copy(built.join(tool), new).map(drop)
        })?;
        written.insert(program.clone());
        for (shell, place) in [
            ("bash", format!("share/bash-completion/completions/{tool}")),
            ("zsh", format!("share/zsh/site-functions/_{tool}")),
            (
                "fish",
                format!("share/fish/vendor_completions.d/{tool}.fish"),
            ),
        ] {
            let script = output(
                &root.join(&program),
                &["completions".as_ref(), shell.as_ref()],
            )?;
            let place = PathBuf::from(place);
            replace(root, &place, |new| fs::write(new, &script))?;
            written.insert(place);
        }
        let pages = root.join("share/man/man1");
        let printed = output(&root.join(&program), &["man".as_ref(), pages.as_os_str()])?;
        for line in printed.lines() {
            // `create PATH`, `update PATH` or `keep PATH`.
            let page = line.split_once(' ').map(|(_, path)| Path::new(path));
            let page = page.and_then(|page| page.strip_prefix(root).ok());
            let page = page.ok_or_else(|| format!("{tool} man printed `{line}`"))?;
            written.insert(page.to_path_buf());
        }
    }
    Ok(())
}

/// Removes the listed files, the list, and folders that are empty then.
fn remove(root: &Path) -> Result<Vec<PathBuf>, String> {
    let listed = listed(root)?;
    if listed.is_empty() {
        return Err(format!(
            "nothing is installed below {}: there is no {LIST}",
            root.display()
        ));
    }
    let all = listed.iter().map(PathBuf::as_path).chain([Path::new(LIST)]);
    let mut removed = Vec::new();
    for path in all {
        let path = root.join(path);
        if remove_file(root, &path)? {
            removed.push(path);
        }
    }
    Ok(removed)
}

/// What an earlier installation wrote, relative to `root`.
fn listed(root: &Path) -> Result<BTreeSet<PathBuf>, String> {
    let list = root.join(LIST);
    match fs::read_to_string(&list) {
        // Nothing outside of the root is removed, whatever the file says.
        Ok(text) => Ok(text
            .lines()
            .map(PathBuf::from)
            .filter(|path| path.is_relative() && !path.iter().any(|part| part == ".."))
            .collect()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(BTreeSet::new()),
        Err(error) => Err(format!("{}: {error}", list.display())),
    }
}

/// Returns false if the file does not exist.
fn remove_file(root: &Path, path: &Path) -> Result<bool, String> {
    let existed = match fs::remove_file(path) {
        Ok(()) => true,
        Err(error) if error.kind() == ErrorKind::NotFound => false,
        Err(error) => return Err(format!("{}: {error}", path.display())),
    };
    // Only empty folders below `share` go; other programs use `bin` and what lies above.
    let share = root.join("share");
    let folders = path.ancestors().skip(1);
    let own = folders.take_while(|folder| folder.starts_with(&share));
    for folder in own {
        if fs::remove_dir(folder).is_err() {
            break;
        }
    }
    Ok(existed)
}

/// Writes a file under another name, then renames it: a running program keeps its file.
fn replace(
    root: &Path,
    path: &Path,
    write: impl FnOnce(&Path) -> std::io::Result<()>,
) -> Result<(), String> {
    let path = root.join(path);
    let folder = path.parent().unwrap_or(root);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let new = folder.join(format!(".{name}.new-{}", std::process::id()));
    let written = fs::create_dir_all(folder)
        .and_then(|()| write(&new))
        .and_then(|()| fs::rename(&new, &path));
    written.map_err(|error| {
        let _ = fs::remove_file(&new);
        format!("{}: {error}", path.display())
    })
}

/// Runs an installed tool, and returns what it prints.
fn output(program: &Path, arguments: &[&OsStr]) -> Result<String, String> {
    let failed = |reason: String| format!("{}: {reason}", program.display());
    let output = Command::new(program).args(arguments).output();
    let output = output.map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        return Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    String::from_utf8(output.stdout).map_err(|error| failed(error.to_string()))
}

/// What the user still has to do, so that the shell finds the tools and their completions.
fn advice(root: &Path) -> String {
    let shown = root.display();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut advice = String::new();
    if !std::env::split_paths(&path).any(|folder| folder == root.join("bin")) {
        advice += &format!("note: {shown}/bin is not in the PATH\n");
    }
    if !["/usr", "/usr/local"]
        .iter()
        .any(|known| root == Path::new(known))
    {
        advice += &format!(
            "note: for completion, add to ~/.bashrc:  source <(rcgen completions bash; rcdeploy completions bash)\n      \
             to ~/.zshrc, before compinit:     fpath+=({shown}/share/zsh/site-functions)\n      \
             to ~/.config/fish/config.fish:    rcgen completions fish | source; rcdeploy completions fish | source\n"
        );
    }
    advice
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every file below a folder, relative to it.
    fn files(folder: &Path) -> Vec<PathBuf> {
        let mut all = Vec::new();
        let mut folders = vec![folder.to_path_buf()];
        while let Some(next) = folders.pop() {
            for entry in fs::read_dir(next).expect("a folder").flatten() {
                match entry.path() {
                    path if path.is_dir() => folders.push(path),
                    path => all.push(path.strip_prefix(folder).expect("below it").to_path_buf()),
                }
            }
        }
        all.sort();
        all
    }

    #[test]
    fn both_tools_are_installed_and_leave_nothing() {
        let own = std::env::current_exe().expect("this test");
        let built = own.ancestors().nth(2).expect("the target folder");
        let why = "build the tools first: `cargo xtask test` does";
        assert!(TOOLS.iter().all(|tool| built.join(tool).exists()), "{why}");
        let root = std::env::temp_dir().join(format!("rc-install-{}", std::process::id()));
        let mine = root.join("share/man/man1/mine.1");
        fs::create_dir_all(mine.parent().expect("a folder")).expect("a folder");
        fs::write(&mine, "").expect("a page of another program");

        let written = copy(built, &root).expect("to install");
        for file in [
            "bin/rcgen",
            "bin/rcdeploy",
            "share/man/man1/rcgen-init.1",
            "share/man/man1/rcdeploy-params-set.1",
            "share/bash-completion/completions/rcdeploy",
            "share/zsh/site-functions/_rcgen",
            "share/fish/vendor_completions.d/rcgen.fish",
        ] {
            assert!(written.contains(Path::new(file)), "{file}: {written:?}");
        }
        assert!(written.iter().all(|path| root.join(path).is_file()));
        let bash = output(
            &root.join("bin/rcgen"),
            &["completions".as_ref(), "bash".as_ref()],
        );
        let installed = fs::read_to_string(root.join("share/bash-completion/completions/rcgen"));
        assert_eq!(installed.expect("the script"), bash.expect("a script"));

        // A later version has no such page any more, and nothing outside is touched.
        let old = root.join("share/man/man1/rcgen-old.1");
        fs::write(&old, "").expect("written");
        let list = fs::read_to_string(root.join(LIST)).expect("the list");
        let list = list + "share/man/man1/rcgen-old.1\n../outside\n/etc/hostname\n";
        fs::write(root.join(LIST), list).expect("written");
        assert_eq!(copy(built, &root).expect("to install again"), written);
        assert!(!old.exists());

        let removed = remove(&root).expect("to uninstall");
        assert_eq!(removed.len(), written.len() + 1);
        assert_eq!(files(&root), [Path::new("share/man/man1/mine.1")]);
        assert!(!root.join("share/fish").exists());
        assert!(remove(&root).is_err_and(|error| error.contains("nothing is installed")));

        // What an installation that fails has written can be removed.
        let broken = root.join("broken");
        fs::create_dir_all(&broken).expect("a folder");
        fs::copy("/bin/false", broken.join(TOOLS[0])).expect("a program that fails");
        assert!(copy(&broken, &root).is_err());
        assert_eq!(remove(&root).expect("to uninstall").len(), 2);
        fs::remove_dir_all(&root).expect("removed");
    }
}
