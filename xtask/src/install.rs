//! `cargo xtask install` and `uninstall`: the tools from one build of the workspace, with their
//! completion scripts and man pages, and on request programs that few users need.
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

/// The programs that are installed on request: each has dependencies that nothing else needs.
const EXTRAS: [&str; 3] = ["rcview", "rcfoxglove", "rcforward"];

/// The list of what was installed, below the root: a path a line, relative to the root.
const LIST: &str = "share/robocomp/installed.txt";

/// Builds and installs both tools, and the programs after `--with`.
pub(crate) fn install(arguments: &[&str]) -> Result<(), String> {
    let (root_argument, wanted) = options(arguments, true)?;
    let root = root(root_argument)?;
    let extras = extras(&root, &wanted)?;
    let mut build = vec!["build", "--release", "--locked"];
    let programs = TOOLS.iter().chain(&extras);
    build.extend(programs.flat_map(|program| ["--bin", program]));
    crate::cargo(&build)?;
    // This program is in the target folder, whatever its place is: TARGET/debug/xtask.
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    let target = own.ancestors().nth(2).ok_or("there is no target folder")?;
    let written = copy(&target.join("release"), &root, &extras)?;
    for path in &written {
        println!("wrote {}", root.join(path).display());
    }
    print!("{}", advice(&root));
    Ok(())
}

/// Removes what `install` wrote.
pub(crate) fn uninstall(arguments: &[&str]) -> Result<(), String> {
    let (root_argument, _) = options(arguments, false)?;
    let root = root(root_argument)?;
    for path in remove(&root)? {
        println!("removed {}", path.display());
    }
    Ok(())
}

/// The folder after `--root`, and the programs after each `--with`, which `uninstall` does not
/// take.
fn options<'a>(
    arguments: &[&'a str],
    takes_programs: bool,
) -> Result<(Option<&'a str>, Vec<&'static str>), String> {
    let (mut root, mut wanted) = (None, Vec::new());
    let mut rest = arguments.iter();
    while let Some(option) = rest.next() {
        match (*option, rest.next()) {
            ("--root", Some(folder)) if root.is_none() => root = Some(*folder),
            ("--with", Some(name)) if takes_programs => {
                let known = EXTRAS.into_iter().find(|extra| extra == name);
                let known = known.ok_or_else(|| {
                    let known = EXTRAS.join(" and ");
                    format!(
                        "`--with {name}`: the programs that are installed on request are {known}"
                    )
                })?;
                wanted.push(known);
            }
            _ if takes_programs => {
                return Err("the options are --root DIR, once, and --with PROGRAM".to_owned());
            }
            _ => return Err("the only option is --root DIR".to_owned()),
        }
    }
    Ok((root, wanted))
}

/// The programs on request: those that are wanted, and those that an earlier installation wrote.
fn extras(root: &Path, wanted: &[&str]) -> Result<Vec<&'static str>, String> {
    let before = listed(root)?;
    let is_there = |extra: &&str| before.contains(&Path::new("bin").join(extra));
    let extras = EXTRAS.into_iter();
    Ok(extras
        .filter(|extra| wanted.contains(extra) || is_there(extra))
        .collect())
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

/// Copies the tools of the folder `built` below `root`, and lets them write their pages and
/// scripts. Returns the paths of all files, relative to `root`. If it fails, the list has the
/// written files, so that they can be removed.
fn copy(built: &Path, root: &Path, extras: &[&str]) -> Result<BTreeSet<PathBuf>, String> {
    let mut written = BTreeSet::new();
    let outcome = place(built, root, extras, &mut written);
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
fn place(
    built: &Path,
    root: &Path,
    extras: &[&str],
    written: &mut BTreeSet<PathBuf>,
) -> Result<(), String> {
    for program in TOOLS.iter().chain(extras) {
        let path = Path::new("bin").join(program);
        replace(root, &path, |new| {
            fs::copy(built.join(program), new).map(drop)
        })?;
        written.insert(path);
    }
    for tool in TOOLS {
        let program = Path::new("bin").join(tool);
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

/// Files of an earlier installation, relative to `root`.
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
    // Only empty folders below `share` are removed; other programs use `bin` and the folders above.
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

/// Runs an installed tool, and returns its output.
fn output(program: &Path, arguments: &[&OsStr]) -> Result<String, String> {
    let failed = |reason: String| format!("{}: {reason}", program.display());
    let output = Command::new(program).args(arguments).output();
    let output = output.map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        return Err(failed(String::from_utf8_lossy(&output.stderr).into_owned()));
    }
    String::from_utf8(output.stdout).map_err(|error| failed(error.to_string()))
}

/// The remaining steps for the user, so that the shell finds the tools and their completions.
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
        let mut programs = TOOLS.iter().chain(&EXTRAS);
        assert!(
            programs.all(|program| built.join(program).exists()),
            "{why}"
        );
        let root = std::env::temp_dir().join(format!("rc-install-{}", std::process::id()));
        let mine = root.join("share/man/man1/mine.1");
        fs::create_dir_all(mine.parent().expect("a folder")).expect("a folder");
        fs::write(&mine, "").expect("a page of another program");

        let written = copy(built, &root, &[]).expect("to install");
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

        // A later version no longer has this page, and files outside stay.
        let old = root.join("share/man/man1/rcgen-old.1");
        fs::write(&old, "").expect("written");
        let list = fs::read_to_string(root.join(LIST)).expect("the list");
        let list = list + "share/man/man1/rcgen-old.1\n../outside\n/etc/hostname\n";
        fs::write(root.join(LIST), list).expect("written");
        assert_eq!(copy(built, &root, &[]).expect("to install again"), written);
        assert!(!old.exists());

        // A program on request stays until it is uninstalled.
        let with = copy(built, &root, &["rcfoxglove"]).expect("to install one more");
        let more: Vec<_> = with.difference(&written).collect();
        assert_eq!(more, [Path::new("bin/rcfoxglove")]);
        let extras = extras(&root, &["rcview"]).expect("the list");
        assert_eq!(extras, ["rcview", "rcfoxglove"]);
        let written = with;

        let removed = remove(&root).expect("to uninstall");
        assert_eq!(removed.len(), written.len() + 1);
        assert_eq!(files(&root), [Path::new("share/man/man1/mine.1")]);
        assert!(!root.join("share/fish").exists());
        assert!(remove(&root).is_err_and(|error| error.contains("nothing is installed")));

        // The files of a failed installation can be removed.
        let broken = root.join("broken");
        fs::create_dir_all(&broken).expect("a folder");
        fs::copy("/bin/false", broken.join(TOOLS[0])).expect("a program that fails");
        assert!(copy(&broken, &root, &[]).is_err());
        assert_eq!(remove(&root).expect("to uninstall").len(), 2);
        fs::remove_dir_all(&root).expect("removed");
    }

    #[test]
    fn options_are_read() {
        assert_eq!(options(&[], true), Ok((None, vec![])));
        let read = options(&["--with", "rcview", "--root", "/x"], true);
        assert_eq!(read, Ok((Some("/x"), vec!["rcview"])));
        for wrong in [&["--with", "rcviev"][..], &["--with"], &["--root"], &["x"]] {
            assert!(options(wrong, true).is_err(), "{wrong:?}");
        }
        assert!(options(&["--with", "rcview"], false).is_err());
    }
}
