//! Packages of the programs of this test run: equal bytes each time, a network that runs from what they
//! unpack to, and the commands of the pages over it.

use rc_test_site::site::{PATROL, Site};
use rc_test_support::python::skipped;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const PACKAGES: [&str; 5] = [
    "robocomp-avoider",
    "robocomp-data",
    "robocomp-interfaces",
    "robocomp-pose-monitor",
    "robocomp-simulator",
];

fn output(command: &mut Command) -> String {
    let output = command.output().expect("a program that starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {said}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Packs, and returns the packages with their contents.
fn pack(out: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut dist = Command::new(env!("CARGO_BIN_EXE_dist"));
    dist.args([
        "--profile",
        "dev",
        "--built",
        "--maintainer",
        "Nobody <nobody@debian.org>",
        "--out",
    ]);
    dist.arg(out);
    for name in PACKAGES {
        dist.args(["--only", name]);
    }
    output(&mut dist);
    let mut all: Vec<PathBuf> = fs::read_dir(out)
        .expect("a folder")
        .flatten()
        .map(|file| file.path())
        .collect();
    all.sort();
    all.into_iter()
        .map(|path| {
            let bytes = fs::read(&path).expect("a file");
            (path, bytes)
        })
        .collect()
}

#[test]
fn packages_are_equal_each_time_and_run_where_they_are_unpacked() {
    for tool in ["dpkg-deb", "strip", "readelf", "gzip"] {
        if Command::new(tool).arg("--version").output().is_err() {
            return skipped(
                "packages_are_equal_each_time_and_run_where_they_are_unpacked",
                &format!("there is no {tool}"),
            );
        }
    }
    let folder = tempfile::tempdir().expect("a folder");
    let first = pack(&folder.path().join("first"));
    // Packages of others stay in the folder, those of an earlier version do not.
    let out = folder.path().join("second");
    fs::create_dir(&out).expect("a folder");
    let foreign = out.join("tree_2.1.deb");
    fs::write(&foreign, "").expect("a file");
    fs::write(out.join("robocomp-data_0.0.1_all.deb"), "").expect("a file");
    let mut second = pack(&out);
    second.retain(|(path, _)| *path != foreign);
    assert!(foreign.exists());
    assert_eq!(second.len(), first.len());
    assert_eq!(first.len(), PACKAGES.len() + 1);
    for ((one, a), (_, b)) in first.iter().zip(&second) {
        assert!(a == b, "{} differs", one.display());
    }
    output(
        Command::new("sha256sum")
            .args(["--check", "--quiet", "SHA256SUMS"])
            .current_dir(folder.path().join("first")),
    );
    let root = folder.path().join("root");
    for (deb, _) in first
        .iter()
        .filter(|(path, _)| path.extension().is_some_and(|e| e == "deb"))
    {
        output(Command::new("dpkg-deb").arg("-x").arg(deb).arg(&root));
        let depends = output(Command::new("dpkg-deb").arg("-f").arg(deb).arg("Depends"));
        let has_program = deb.to_string_lossy().contains("simulator");
        assert!(
            !has_program || depends.contains("libc6 (>= 2."),
            "{depends}"
        );
    }

    let site = Site::new("packed");
    let text = PATROL.replace("Deployment patrol", &format!("Deployment {}", site.network));
    let (head, rest) = text
        .split_once("    Component avoider")
        .expect("a component");
    let binds = rest.lines().filter(|line| line.contains("bind monitor"));
    let text = format!("{head}{}\n}};\n", binds.collect::<String>());
    fs::write(site.ddsl(), text).expect("a network");
    let rcdeploy = |args: &[&str]| {
        let mut command = Command::new(Site::executable("rcdeploy"));
        command
            .args(args)
            .env("ROBOCOMP_PREFIX", root.join("opt/robocomp"));
        command
            .env("PATH", "/usr/bin:/bin")
            .env("CARGO", "/nowhere/cargo");
        site.run(command)
    };
    let up = rcdeploy(&["up", "--detach", "patrol.ddsl"]);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_in_log("monitor", "poses=");
    let down = rcdeploy(&["down", &site.network]);
    assert_eq!(down.code, 0, "{down:?}");

    // What the pages say, as the test of all packages runs it in a clean Debian.
    let script = output(Command::new(env!("CARGO_BIN_EXE_dist")).arg("--pages"));
    assert!(script.contains("rcdeploy echo patrol"), "{script}");
    let tools = Site::executable("rcdeploy");
    let tools = tools.parent().expect("a folder").display();
    let pages = site.path("pages");
    fs::create_dir(&pages).expect("a folder");
    let mut shell = Command::new("sh");
    shell
        .args(["-c", &script])
        .env("PAGES", pages)
        .env("PATROL", Site::components().join("networks/patrol.ddsl"))
        .env("ROBOCOMP_PREFIX", root.join("opt/robocomp"))
        .env("PATH", format!("{tools}:/usr/bin:/bin"))
        .env("CARGO", "/nowhere/cargo");
    let ran = site.run(shell);
    assert_eq!(ran.code, 0, "{ran:?}");
    site.assert_nothing_left();
}
