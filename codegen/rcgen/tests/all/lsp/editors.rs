//! Other editors with the lines of the documentation.

use super::{GRIP, HAND};
use rc_test_support::debian;
use rc_test_support::python::skipped;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs an editor in a folder, which has its settings, too. It finds `rcgen` on its path.
fn runs_in(folder: &Path, mut command: Command) {
    let programs = Path::new(env!("CARGO_BIN_EXE_rcgen"))
        .parent()
        .expect("a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    let output = command
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", programs.display()))
        .env("HOME", folder)
        .env("XDG_STATE_HOME", folder)
        .env("XDG_CACHE_HOME", folder)
        .output()
        .expect("an editor");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

/// Neovim of the system, or of packages unpacked in `place`.
fn neovim(place: Option<&Path>) -> Command {
    let Some(place) = place else {
        return Command::new("nvim");
    };
    let libraries = format!("usr/lib/{}-linux-gnu", std::env::consts::ARCH);
    let mut command = Command::new(place.join("usr/bin/nvim"));
    command.env("LD_LIBRARY_PATH", place.join(libraries));
    command.env("VIMRUNTIME", place.join("usr/share/nvim/runtime"));
    command
}

/// The client of Neovim with the lines of the documentation.
#[test]
fn neovim_shows_fixes_lays_out_and_navigates() {
    let runs = |place: Option<&Path>| {
        let mut command = neovim(place);
        let quit = [
            "--headless",
            "-u",
            "NONE",
            "-c",
            "lua vim.lsp.get_active_clients()",
            "-c",
            "qall",
        ];
        let output = command.args(quit).output();
        output.is_ok_and(|output| output.status.success() && output.stderr.is_empty())
    };
    let test = "neovim_shows_fixes_lays_out_and_navigates";
    let place = match debian::provided("neovim --no-install-recommends", &runs) {
        Ok(place) => place,
        Err(reason) => return skipped(test, &reason),
    };
    let folder = tempfile::tempdir().expect("a folder");
    let text = "module M { struct S { strign a /* é😀 */\n int b; }; };\n";
    let file = folder.path().join("m.idsl");
    std::fs::write(&file, text).expect("a file");
    std::fs::write(folder.path().join("Grip.idsl"), GRIP).expect("a file");
    std::fs::write(folder.path().join("hand.cdsl"), HAND).expect("a file");
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/editors");
    let mut command = neovim(place.as_deref());
    command
        .args(["--headless", "-n", "-u"])
        .arg(scripts.join("neovim.lua"));
    command
        .arg("-c")
        .arg(format!("luafile {}", scripts.join("session.lua").display()));
    runs_in(folder.path(), command);
    let fixed = std::fs::read_to_string(&file).expect("a file");
    assert_eq!(
        fixed,
        "module M\n{\n    struct S\n    {\n        string a; /* é😀 */\n        int b;\n    };\n};\n"
    );
}

/// The folders below one, as Emacs lists them.
fn folders_below(folder: &Path) -> Vec<String> {
    let mut all = vec![folder.display().to_string()];
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.path().is_dir() {
            all.extend(folders_below(&entry.path()));
        }
    }
    all
}

/// Emacs of the system, or of packages unpacked in `place`.
fn emacs(place: Option<&Path>) -> Command {
    let Some(place) = place else {
        return Command::new("emacs");
    };
    let arch = std::env::consts::ARCH;
    let of_version = |folder: &str| -> PathBuf {
        let versions = std::fs::read_dir(place.join(folder)).into_iter().flatten();
        let mut versions = versions.flatten().map(|entry| entry.path());
        let version =
            versions.find(|path| path.join("lisp").is_dir() || folder.contains("libexec"));
        version.unwrap_or_default()
    };
    let share = of_version("usr/share/emacs");
    let programs = of_version("usr/libexec/emacs").join(format!("{arch}-linux-gnu"));
    let mut lisp = folders_below(&share.join("lisp"));
    lisp.extend(folders_below(
        &place.join("usr/share/emacs/site-lisp/elpa-src"),
    ));
    let mut command = Command::new(place.join("usr/bin/emacs-nox"));
    command
        .env(
            "LD_LIBRARY_PATH",
            place.join(format!("usr/lib/{arch}-linux-gnu")),
        )
        .env("EMACSLOADPATH", lisp.join(":"))
        .env("EMACSDATA", share.join("etc"))
        .env("EMACSPATH", &programs)
        .arg("--dump-file")
        .arg(programs.join("emacs.pdmp"));
    command
}

/// Eglot with the lines of the documentation. Its packages are large: only `cargo xtask soak editor` downloads them.
#[test]
fn emacs_shows_findings_completes_renames_and_lays_out() {
    let test = "emacs_shows_findings_completes_renames_and_lays_out";
    let runs = |place: Option<&Path>| {
        let words = ["-Q", "--batch", "--eval", "(require 'eglot)"];
        let output = emacs(place).args(words).output();
        output.is_ok_and(|output| output.status.success())
    };
    let place = if std::env::var_os("RC_ALL_EDITORS").is_some() {
        debian::provided("emacs-nox elpa-eglot --no-install-recommends", &runs)
    } else if runs(None) {
        Ok(None)
    } else {
        Err("Emacs with Eglot is not installed; `cargo xtask soak editor` unpacks it".to_owned())
    };
    let place = match place {
        Ok(place) => place,
        Err(reason) => return skipped(test, &reason),
    };
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("m.idsl");
    let text = "module M { struct S { strign a; int b; }; };\n";
    std::fs::write(&file, text).expect("a file");
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/editors");
    let mut command = emacs(place.as_deref());
    command.args(["-Q", "--batch"]);
    for script in ["emacs.el", "session.el"] {
        command.arg("-l").arg(scripts.join(script));
    }
    runs_in(folder.path(), command);
    let text = std::fs::read_to_string(&file).expect("a file");
    assert_eq!(
        text,
        "module M\n{\n    struct Renamed\n    {\n        string a;\n        int b;\n    };\n};\n"
    );
}
