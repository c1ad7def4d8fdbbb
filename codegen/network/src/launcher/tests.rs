//! Scripts are run by a real shell.

use super::*;

fn note() -> Note {
    Note {
        component: "Eyes".to_owned(),
        model: "0".repeat(16),
        middleware: "dds".to_owned(),
    }
}

/// Exit code, standard output and standard error of a launcher.
fn run(path: &Path) -> (Option<i32>, String, String) {
    run_in(path, &[])
}

/// [`run`] with variables.
fn run_in(path: &Path, variables: &[(&str, &Path)]) -> (Option<i32>, String, String) {
    // The shell reads it: another thread of the tests may just have a copy of an open file.
    let output = std::process::Command::new("/bin/sh")
        .arg(path)
        .args(["--name", "a b"])
        .env_remove("VIRTUAL_ENV")
        .env_remove("PYTHONPATH")
        .env_remove("PYTHONHOME")
        .envs(variables.iter().copied())
        .output()
        .expect("it starts");
    let text = |bytes| String::from_utf8(bytes).expect("a text");
    (
        output.status.code(),
        text(output.stdout),
        text(output.stderr),
    )
}

#[test]
fn a_launcher_is_a_script_with_the_note_of_its_component() {
    let folder = tempfile::tempdir().expect("a folder");
    let home = folder.path().join("it's here");
    let bin = home.join(".venv/bin");
    std::fs::create_dir_all(&bin).expect("a folder");
    std::os::unix::fs::symlink("/bin/echo", bin.join("python")).expect("a link");
    let path = folder.path().join("eyes");
    let native = [("ROBOCOMP_NATIVE", PathBuf::from("/x/lib.so"))];
    let text = text(
        "eyes",
        &path,
        &home,
        &[home.join(GENERATED)],
        &native,
        (3, 11),
        &note(),
    );
    let text = text.expect("a script");
    assert!(
        text.contains("\nexport ROBOCOMP_NATIVE=\"$root\"/x/lib.so\n"),
        "{text}"
    );
    write(&path, &text).expect("a launcher");
    assert_eq!(Note::read(&path).expect("a file"), [note()]);
    let (code, out, err) = run(&path);
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert!(out.starts_with("-c import os, sys\n"), "{out}");
    assert!(out.ends_with("alter_sys=True) --name a b\n"), "{out}");
}

#[test]
fn an_interpreter_without_the_framework_is_a_failed_start_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let packages = folder.path().join("it's here");
    std::fs::create_dir_all(packages.join("eyes")).expect("a folder");
    let path = folder.path().join("launcher");
    let text = text(
        "eyes",
        &path,
        folder.path(),
        std::slice::from_ref(&packages),
        &[],
        (3, 11),
        &note(),
    );
    write(&path, &text.expect("a script")).expect("a launcher");
    let package = |name: &str, text: &str| {
        std::fs::write(packages.join(name), text).expect("a file");
    };
    package("eyes/__init__.py", "import robocomp\n");
    let main = "import sys\nprint(__name__, __package__, sys.argv[1:])\nsys.exit(7)\n";
    package("eyes/__main__.py", main);
    package("robocomp.py", "raise ImportError('it needs NumPy')\n");
    let wanted = "eyes: error: it needs NumPy\n".to_owned();
    assert_eq!(run(&path), (Some(3), String::new(), wanted));
    // Another length, so that Python takes no compiled file of the first one.
    package("robocomp.py", "");
    let wanted = "__main__ eyes ['--name', 'a b']\n".to_owned();
    assert_eq!(run(&path), (Some(7), wanted, String::new()));
}

/// As an agent copies it: below a folder of another machine, at the same path.
#[test]
fn a_copied_launcher_runs_the_copies_beside_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = Path::new("/it's here, nowhere");
    let path = here.join("target/eyes");
    let generated = here.join(GENERATED);
    let native = here.join("lib.so");
    let text = text(
        "eyes",
        &path,
        here,
        std::slice::from_ref(&generated),
        &[("ROBOCOMP_NATIVE", native.clone())],
        (3, 11),
        &note(),
    );
    let root = folder.path().join("the robot's");
    let there = |path: &Path| root.join(path.strip_prefix("/").expect("an absolute path"));
    std::fs::create_dir_all(there(&generated).join("eyes")).expect("a folder");
    let package = |name: &str, text: &str| {
        std::fs::write(there(&generated).join(name), text).expect("a file");
    };
    package("robocomp.py", "");
    package("eyes/__init__.py", "");
    let main = "import os\nprint(__file__)\nprint(os.environ['ROBOCOMP_NATIVE'])\n";
    package("eyes/__main__.py", main);
    write(&there(&path), &text.expect("a script")).expect("a launcher");
    let (code, out, err) = run(&there(&path));
    assert_eq!((code, err.as_str()), (Some(0), ""));
    let main = there(&generated.join("eyes/__main__.py"));
    let wanted = format!("{}\n{}\n", main.display(), there(&native).display());
    assert_eq!(out, wanted);
}

#[test]
fn an_interpreter_that_is_too_old_is_a_failed_start_in_one_line() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("launcher");
    let text = text("eyes", &path, folder.path(), &[], &[], (3, 999), &note());
    write(&path, &text.expect("a script")).expect("a launcher");
    let (code, out, err) = run(&path);
    assert_eq!((code, out.as_str()), (Some(3), ""));
    assert!(err.starts_with("eyes: error: "), "{err}");
    assert!(err.ends_with("needs Python 3.999 or newer\n"), "{err}");
    assert_eq!(err.lines().count(), 1, "{err}");
}

#[test]
fn what_the_shell_has_does_not_beat_the_environment_of_a_component() {
    let folder = tempfile::tempdir().expect("a folder");
    let home = folder.path().join("eyes");
    let venv = home.join(".venv");
    std::fs::create_dir(&home).expect("a folder");
    let made = std::process::Command::new("python3")
        .args(["-m", "venv", "--without-pip"])
        .arg(&venv)
        .status();
    assert!(made.is_ok_and(|status| status.success()));
    let lib = std::fs::read_dir(venv.join("lib"))
        .expect("a folder")
        .next();
    let own = lib
        .expect("a version")
        .expect("its folder")
        .path()
        .join("site-packages");
    let package = |place: &Path, name: &str, text: &str| {
        std::fs::create_dir_all(place).expect("a folder");
        std::fs::write(place.join(name), text).expect("a file");
    };
    package(&own, "numpy.py", "place = 'own'\n");
    let foreign = folder.path().join("foreign");
    package(&foreign, "numpy.py", "place = 'foreign'\n");
    package(&foreign, "other.py", "");
    let generated = home.join(GENERATED);
    package(&generated, "robocomp.py", "");
    package(&generated.join("eyes"), "__init__.py", "");
    let main = "import os, sys, numpy, other\n\
                    print(numpy.place, sys.prefix.endswith('eyes/.venv'), os.environ['PYTHONPATH'])\n";
    package(&generated.join("eyes"), "__main__.py", main);
    let path = folder.path().join("launcher");
    let paths = [generated.clone()];
    let text = text("eyes", &path, &home, &paths, &[], (3, 11), &note());
    write(&path, &text.expect("a script")).expect("a launcher");

    // A foreign folder comes behind; programs that the worker starts have it as before.
    let active = folder.path().join("active");
    package(&active.join("bin"), "python", "#!/bin/sh\necho active\n");
    let variables = [("PYTHONPATH", foreign.as_path()), ("VIRTUAL_ENV", &active)];
    let path_there = format!("{}:{}", generated.display(), foreign.display());
    let wanted = format!("own True {path_there}\n");
    assert_eq!(run_in(&path, &variables), (Some(0), wanted, String::new()));

    // No interpreter starts with the home of another one.
    let (code, out, err) = run_in(&path, &[("PYTHONHOME", &foreign)]);
    assert_eq!((code, out.as_str()), (Some(3), ""), "{err}");
    let wanted = format!(
        "eyes: error: PYTHONHOME is {}, with which ",
        foreign.display()
    );
    assert!(
        err.starts_with(&wanted) && err.ends_with("; unset it\n"),
        "{err}"
    );
    assert_eq!(err.lines().count(), 1, "{err}");
}

#[test]
fn an_environment_is_made_for_a_component_that_asks_for_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let home = folder.path().join("eyes");
    std::fs::create_dir(&home).expect("a folder");
    let manifest = "[project]\nname = \"eyes\"\ndependencies = [\"no-such-package\"]\n";
    std::fs::write(home.join("pyproject.toml"), manifest).expect("a file");
    let make = |minor| {
        let venv = Venv {
            folder: home.clone(),
            oldest: (3, minor),
            lock: folder.path().join("lock"),
        };
        venv.make()
    };
    let said = make(999).expect_err("no such Python").to_string();
    assert!(said.contains("needs Python 3.999 or newer"), "{said}");
    assert!(!home.join(".venv").exists());
    let script = "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))";
    let has_venv = std::process::Command::new("python3")
        .args(["-c", script])
        .status();
    if !has_venv.is_ok_and(|status| status.success()) {
        println!(
            "skipped: an_environment_is_made_for_a_component_that_asks_for_it: there is no \
                 Python 3.11 with `venv` in the path"
        );
        return;
    }
    make(11).expect("an environment");
    let settings = home.join(".venv/pyvenv.cfg");
    let made = || {
        settings
            .metadata()
            .and_then(|m| m.modified())
            .expect("a file")
    };
    let first = made();
    make(11).expect("the same environment");
    assert_eq!(made(), first);
    let said = make(999).expect_err("it is too old").to_string();
    assert!(said.contains("delete this environment"), "{said}");
}

#[test]
fn a_path_that_python_cannot_take_is_refused() {
    use std::os::unix::ffi::OsStrExt;
    let here = Path::new("/here");
    let mistake = |folder: &Path, path: &Path| {
        let text = text(
            "eyes",
            Path::new("/target/eyes"),
            folder,
            &[path.to_path_buf()],
            &[],
            (3, 11),
            &note(),
        );
        text.expect_err("a refusal").to_string()
    };
    let said = mistake(here, Path::new("/a:b/generated"));
    assert!(said.contains("/a:b/generated: PYTHONPATH"), "{said}");
    let foreign = Path::new(std::ffi::OsStr::from_bytes(b"/a\xff"));
    for (folder, path) in [(here, foreign), (foreign, here)] {
        assert!(mistake(folder, path).contains("not UTF-8"));
    }
}

#[test]
fn two_builds_write_one_variant_in_turn() {
    let user = tempfile::tempdir().expect("a folder");
    for _ in 0..5 {
        let target = tempfile::tempdir().expect("a folder");
        let start = std::sync::Barrier::new(4);
        let writes = || {
            start.wait();
            let mut files = rc_codegen::Files::default();
            let owner = rc_codegen::files::Owner::Generic;
            files.add(
                Path::new(GENERATED).join("a.py"),
                owner,
                "a = 1\n".to_owned(),
            );
            stage(&target.path().join("rc/eyes"), &files, user.path())
        };
        std::thread::scope(|scope| {
            let all: Vec<_> = (0..4).map(|_| scope.spawn(writes)).collect();
            for one in all {
                one.join().expect("a thread").expect("a variant");
            }
        });
        let link = std::fs::read_link(target.path().join("rc/eyes/src")).expect("a link");
        assert_eq!(link, user.path().join("src"));
    }
}
