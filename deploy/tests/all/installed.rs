//! Components that `rcgen install` puts under a prefix, and networks of them without cargo.

use rc_test_site::site::{CommandOutput, PATROL, Site};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A site whose network names components that lie nowhere near it.
fn site(name: &str) -> Site {
    let site = Site::new(name);
    let text = PATROL.replace("Deployment patrol", &format!("Deployment {}", site.network));
    fs::write(site.ddsl(), text).expect("a network");
    site
}

/// Runs a tool that finds no cargo.
fn run(site: &Site, tool: &str, args: &[&str]) -> CommandOutput {
    let mut command = Command::new(Site::executable(tool));
    command.args(args).env("ROBOCOMP_PREFIX", site.path("rc"));
    command
        .env("PATH", "/usr/bin:/bin")
        .env("CARGO", "/nowhere/cargo");
    site.run(command)
}

fn install(site: &Site, component: &str, more: &[&str]) -> CommandOutput {
    let file = Site::components()
        .join(component)
        .join(format!("{component}.cdsl"));
    let file = file.display().to_string();
    run(
        site,
        "rcgen",
        &[&["install", "--profile", "dev", &file], more].concat(),
    )
}

/// The executable of each component in the plan.
fn executables(site: &Site) -> String {
    let plan = run(
        site,
        "rcdeploy",
        &["plan", "--unbuilt", "--format", "json", "patrol.ddsl"],
    );
    assert_eq!(plan.code, 0, "{plan:?}");
    let plan: serde_json::Value = serde_json::from_str(&plan.stdout).expect("JSON");
    let all = plan["components"].as_array().expect("components").iter();
    all.map(|one| format!("{} {}\n", one["name"], one["executable"]))
        .collect()
}

fn change(path: &Path, from: &str, to: &str) {
    let text = fs::read_to_string(path).expect("a file");
    assert!(text.contains(from), "{text}");
    fs::write(path, text.replace(from, to)).expect("a file");
}

#[test]
fn a_network_of_installed_components_runs_without_cargo() {
    let site = site("installed");
    for component in ["simulator", "pose_monitor", "avoider"] {
        let installed = install(&site, component, &[]);
        assert_eq!(installed.code, 0, "{installed:?}");
        let program = format!("  components/{component}/bin/{component}\n");
        assert!(installed.stdout.contains(&program), "{installed:?}");
    }
    let up = run(&site, "rcdeploy", &["up", "--detach", "patrol.ddsl"]);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_in_log("monitor", "poses=");
    // A new version is put in place beside the running one.
    let again = install(&site, "simulator", &[]);
    assert_eq!(again.code, 0, "{again:?}");
    assert!(again.stdout.starts_with("replace "), "{again:?}");
    let restart = run(&site, "rcdeploy", &["restart", &site.network, "simulator"]);
    assert_eq!(restart.code, 0, "{restart:?}");
    let down = run(&site, "rcdeploy", &["down", &site.network]);
    assert_eq!(down.code, 0, "{down:?}");
    assert!(site.path("networks/patrol.svg").exists());
    let left = fs::read_dir(site.path("rc/components")).expect("the prefix");
    assert_eq!(left.count(), 4, "three components, and their maps");
}

#[test]
fn a_component_of_the_workspace_comes_first() {
    let site = site("overlay");
    for component in ["simulator", "pose_monitor", "avoider"] {
        assert_eq!(install(&site, component, &[]).code, 0);
    }
    let prefix = site.path("rc").display().to_string();
    assert_eq!(executables(&site).matches(&prefix).count(), 3);
    let own = site.path("components/avoider");
    fs::create_dir_all(&own).expect("a folder");
    fs::write(site.path("Cargo.toml"), "[workspace]\n").expect("a manifest");
    for file in [
        "avoider.cdsl",
        "avoider.pdsl",
        "avoider.scxml",
        "Cargo.toml",
    ] {
        let from = Site::components().join("avoider").join(file);
        fs::copy(from, own.join(file)).expect("a file");
    }
    let executables = executables(&site);
    assert_eq!(executables.matches(&prefix).count(), 2, "{executables}");
    // An installed component has one program for one middleware, and a process of its own.
    let other = run(
        &site,
        "rcdeploy",
        &[
            "check",
            "--middleware",
            "dds",
            "--format",
            "short",
            "patrol.ddsl",
        ],
    );
    assert!(
        other.stderr.contains("error[middleware-mismatch]"),
        "{other:?}"
    );
    assert!(other.stderr.contains("uses iceoryx2"), "{other:?}");
}

#[test]
fn what_cannot_be_installed_says_why() {
    let site = site("refused");
    assert_eq!(install(&site, "avoider", &[]).code, 0);
    let laser = site.path("rc/interfaces/Laser.idsl");
    change(&laser, "float angle;", "double angle;");
    // Other components may have been built with this one.
    let conflict = install(&site, "avoider", &[]);
    assert_eq!(conflict.code, 1, "{conflict:?}");
    assert!(
        conflict
            .stderr
            .contains("Laser.idsl is installed in another version"),
        "{conflict:?}"
    );
    let check = ["check", "--format", "short", "patrol.ddsl"];
    let stale = run(&site, "rcdeploy", &check);
    assert!(
        stale.stderr.contains("error[stale-executable]"),
        "{stale:?}"
    );
    // The next version replaces the files of this one, and no others.
    let avoider = site.path("rc/components/avoider");
    let listed = avoider.join("installed.txt");
    let list = fs::read_to_string(&listed).expect("a list");
    assert!(list.contains("avoider.cdsl\n") && list.contains("bin/avoider\n"));
    fs::write(&listed, format!("{list}old.pdsl\n")).expect("a list");
    for file in ["old.pdsl", "maps/of_another.map"] {
        let file = avoider.join(file);
        fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
        fs::write(file, "").expect("a file");
    }
    assert_eq!(install(&site, "avoider", &["--replace"]).code, 0);
    assert!(!avoider.join("old.pdsl").exists());
    assert!(avoider.join("maps/of_another.map").exists());
    assert_eq!(fs::read_to_string(&listed).expect("a list"), list);
    let replaced = run(&site, "rcdeploy", &check);
    assert!(
        !replaced.stderr.contains("stale-executable"),
        "{replaced:?}"
    );

    let other = site.path("other.cdsl");
    let text = "Component another { Communications {}; language rust; };\n";
    fs::write(&other, text).expect("a component");
    let renamed = run(&site, "rcgen", &["install", &other.display().to_string()]);
    assert_eq!(renamed.code, 1, "{renamed:?}");
    assert!(
        renamed.stderr.contains("name the file `another.cdsl`"),
        "{renamed:?}"
    );

    let nowhere = install(&site, "avoider", &["--prefix", "/proc/nowhere"]);
    assert_eq!(nowhere.code, 3, "{nowhere:?}");
    // A dry run writes nothing.
    let dry = install(&site, "simulator", &["--dry-run"]);
    assert_eq!(dry.code, 0, "{dry:?}");
    assert!(!site.path("rc/components/simulator").exists());

    let networks = site.path("rc/components/networks");
    fs::create_dir_all(&networks).expect("a folder");
    fs::write(networks.join("house.ddsl"), "").expect("a network");
    let named = run(&site, "rcdeploy", &["up", "house"]);
    assert_eq!(named.code, 3, "{named:?}");
    let copy = format!("`cp {} house.ddsl`", networks.join("house.ddsl").display());
    assert!(named.stderr.contains(&copy), "{named:?}");
}

/// A workspace with copies of components and interfaces of this project.
fn workspace(site: &Site, name: &str, components: &[&str]) -> PathBuf {
    let root = site.path(name);
    let (own, interfaces) = (root.join("components"), root.join("interfaces"));
    for folder in [&own, &interfaces] {
        fs::create_dir_all(folder).expect("a folder");
    }
    fs::write(root.join("Cargo.toml"), "[workspace]\n").expect("a manifest");
    for component in components {
        let mut copy = Command::new("cp");
        copy.arg("-r")
            .arg(Site::components().join(component))
            .arg(&own);
        assert_eq!(site.run(copy).code, 0);
    }
    for interface in ["Laser", "GenericBase", "DifferentialRobot", "BatteryStatus"] {
        let file = format!("{interface}.idsl");
        let from = Site::components().join("interfaces").join(&file);
        fs::copy(from, interfaces.join(file)).expect("an interface");
    }
    root
}

#[test]
fn two_workspaces_that_disagree_are_not_installed_together() {
    let site = site("disagree");
    let roots = ["one", "two"].map(|name| workspace(&site, name, &["avoider_python", "avoider"]));
    let file = "components/avoider_python/avoider_python.cdsl";
    let files = roots
        .each_ref()
        .map(|root| root.join(file).display().to_string());
    let install = |more: &[&str]| {
        let all = [&["install"], more, &[&*files[0], &*files[1]]].concat();
        run(&site, "rcgen", &all)
    };
    let equal = install(&[]);
    assert_eq!(equal.code, 0, "{equal:?}");
    // A comment changes no type, but the file is another one.
    let laser = roots[1].join("interfaces/Laser.idsl");
    change(
        &laser,
        "module RoboCompLaser",
        "// of two\nmodule RoboCompLaser",
    );
    let refused = install(&["--replace"]);
    assert_eq!(refused.code, 1, "{refused:?}");
    let names = [&roots[0].join("interfaces/Laser.idsl"), &laser];
    let names = names.map(|path| path.display().to_string());
    let told = format!("{} and {} differ, and only one", names[0], names[1]);
    assert!(refused.stderr.contains(&told), "{refused:?}");
    assert!(refused.stderr.contains("another --prefix"), "{refused:?}");
    // So are two components of one name.
    fs::copy(roots[0].join("interfaces/Laser.idsl"), &laser).expect("an interface");
    let worker = roots[1].join("components/avoider_python/src/policy.py");
    fs::write(&worker, "").expect("a file");
    let twins = install(&["--replace"]);
    assert_eq!(twins.code, 1, "{twins:?}");
    assert!(twins.stderr.contains("src/policy.py differ"), "{twins:?}");
}
