//! Programs of hosts with another processor, and of hosts that build. Scripts stand for ssh and for the
//! cargo that compiles.

use rc_codegen::{FileLoader, paths};
use rc_deploy_network::{self as network, Profile};
use rc_diagnostics::{Format, SourceMap, render};
use rc_test_site::other_host;
use rc_test_site::site::{CommandOutput, Site, rcdeploy};
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

/// Another processor than that of this machine: its word, the name of `uname -m`, and the platform.
const OTHER: [&str; 3] = if cfg!(target_arch = "aarch64") {
    ["amd64", "x86_64", "x86_64-unknown-linux-gnu"]
} else {
    ["arm64", "aarch64", "aarch64-unknown-linux-gnu"]
};

const NETWORK: &str = r#"
Deployment patrol
{
    middleware iceoryx2;
    Host robot { address "robot"; HOST };
    Component simulator { cdsl "../simulator/simulator.cdsl"; host robot; };
};
"#;

fn site(name: &str, host: &str) -> Site {
    let site = Site::new(name);
    write_ddsl(&site, host);
    site
}

fn write_ddsl(site: &Site, host: &str) {
    site.write_ddsl(&NETWORK.replace("HOST", &host.replace("OTHER", OTHER[0])));
}

pub(super) fn script(path: &Path, text: &str) {
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    fs::write(path, format!("#!/bin/sh\n{text}")).expect("written");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("set");
}

fn up(site: &Site, args: &[&str], variables: &[(&str, &Path)]) -> CommandOutput {
    let mut command = Command::new(rcdeploy());
    command.args(["up", "--detach", "--profile", "dev"]);
    command.args(args).arg(site.ddsl());
    command.envs(variables.iter().copied());
    site.run(command)
}

/// A host builds its programs, and the build after a lost connection goes on where that was.
#[test]
fn a_host_with_another_processor_builds_its_programs() {
    let site = site("built_there", "arch OTHER; build there jobs 2 nice 7;");
    let folder = site.path("");
    let ssh = other_host::ssh(&folder);
    // The host says that it has another processor.
    script(
        &site.path("bin/uname"),
        &format!("echo Linux {}\n", OTHER[1]),
    );
    let text = fs::read_to_string(&ssh).expect("a script");
    let path = format!("export PATH={}:$PATH\n", site.path("bin").display());
    fs::write(
        &ssh,
        text.replace("echo \"Welcome", &format!("{path}echo \"Welcome")),
    )
    .expect("written");
    let cargo = site.path("away/home/.cargo/bin/cargo");
    let build = |does: &str| {
        script(&cargo, does);
        let run = up(&site, &["--build"], &[("RC_SSH", &ssh)]);
        (run.code, run.stderr)
    };

    let version = "[ \"$1\" = --version ] && { echo 'cargo 99.0.0 (x)'; exit 0; }\n";
    // The connection ends while it builds, and the build with it.
    let lost = format!(
        "echo $$ > {0}/cargo.pid; kill -9 -$(cat {0}/ssh.pid); sleep 120\n",
        folder.display()
    );
    let (code, said) = build(&format!("{version}{lost}"));
    assert!(
        code == 3 && said.contains("host robot did not build: "),
        "{said}"
    );
    assert!(said.contains("goes on where it was"), "{said}");
    assert!(said.contains("files of sources are copied"), "{said}");
    let pid = fs::read_to_string(site.path("cargo.pid")).expect("a pid");
    let process = Path::new("/proc").join(pid.trim());
    Site::until("the end of the build there", || !process.exists());

    // Cargo there has made the programs.
    let makes = format!(
        "echo \"$(nice) $*\" >> {}/cargo.log\nwhile [ \"$1\" ]; do [ \"$1\" = --target-dir ] && t=\"$2/debug\"; shift; done\n\
         mkdir -p \"$t\" && cp {} {} \"$t\"\n",
        folder.display(),
        Site::executable("simulator").display(),
        rcdeploy().display(),
    );
    let (code, said) = build(&format!("{version}{makes}"));
    assert_eq!(code, 0, "{said}{}", site.log("rcdeploy"));
    // Nothing was sent again, by neither of the two builds.
    assert!(!said.contains("files of sources"), "{said}");
    site.await_component("simulator", |one| one["state"] == "running");
    let log = fs::read_to_string(site.path("cargo.log")).expect("a log");
    let lines: Vec<&str> = log.lines().collect();
    let [components, tools] = lines[..] else {
        panic!("{log}")
    };
    let there = site.path("away/home/.cache/robocomp");
    // Besides that of this test.
    let own = Command::new("nice").output().expect("nice").stdout;
    let own: u8 = String::from_utf8_lossy(&own).trim().parse().expect("one");
    let nice = format!("{} build ", (own + 7).min(19));
    for line in lines {
        assert!(line.starts_with(&nice), "{log}");
        assert!(line.ends_with("--jobs 2"), "{log}");
        assert!(line.contains("/away/home/.cache/robocomp/build/"), "{log}");
    }
    assert!(components.contains(" --bin simulator "), "{log}");
    assert!(
        tools.contains(" --package rc-deploy ") && tools.contains(" --bin rcdeploy "),
        "{log}"
    );
    // The agent is the program that the host has built, and so is the component.
    let running = site.status()["components"][0]["pid"].to_string();
    let program = fs::read_link(format!("/proc/{running}/exe")).expect("a process");
    assert!(
        program.starts_with(there.join("networks").join(&site.network)),
        "{program:?}"
    );
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.await_nothing_left();

    let plan = site.rcdeploy(&["plan", "--unbuilt"], true);
    let line = format!(
        "\nhost robot: {}, its programs are built there, 2 at once, with niceness 7\n",
        OTHER[0]
    );
    assert!(plan.stdout.contains(&line), "{plan:?}");
}

/// This machine builds for a host, up to the call of cargo.
#[test]
fn this_machine_builds_for_another_processor() {
    let site = site("cross_built", "arch OTHER; build here;");
    let ssh = other_host::ssh(&site.path(""));
    let rustc = site.path("bin/rustc");
    let upper = OTHER[2].to_uppercase().replace('-', "_");
    let linker = format!("CARGO_TARGET_{upper}_LINKER");
    let log = site.path("cargo.log");
    // The real one knows the packages.
    let real = std::env::var_os("CARGO").expect("the tests run by cargo");
    let cargo = site.path("bin/cargo");
    let does = format!(
        "[ \"$1\" = metadata ] && exec {:?} \"$@\"\necho \"$*\" >> {}\nexit 1\n",
        Path::new(&real),
        log.display()
    );
    script(&cargo, &does);
    // Nothing but a tool of a test is in the path: this machine may have real ones.
    let run = |words: &[&str], path: &str, configured: &str| {
        let path = site.path(path);
        fs::create_dir_all(&path).expect("a folder");
        let mut command = Command::new(rcdeploy());
        command.args(words).arg(site.ddsl());
        let variables: [(&str, &Path); 5] = [
            ("RC_SSH", &ssh),
            ("CARGO", &cargo),
            ("RUSTC", &rustc),
            ("PATH", &path),
            (&linker, Path::new(configured)),
        ];
        site.run({
            command.envs(variables);
            command
        })
    };
    let build = ["up", "--detach", "--build", "--no-generate"];
    let build = [&build[..], &["--profile", "dev"]].concat();
    script(&rustc, "echo /nowhere/lib\n");
    let refused = run(&build, "none", "a-linker");
    assert_eq!(refused.code, 1, "{refused:?}");
    assert!(
        refused.stderr.contains("error[missing-cross-compiler]"),
        "{refused:?}"
    );
    let advice = format!("`rustup target add {}`", OTHER[2]);
    for advice in [&*advice, "; or write `build there;`"] {
        assert!(refused.stderr.contains(advice), "{refused:?}");
    }

    script(&rustc, &format!("echo {}\n", site.path("").display()));
    let refused = run(&build, "none", "");
    assert!(
        refused.stderr.contains("`pip install cargo-zigbuild`"),
        "{refused:?}"
    );
    assert!(!log.exists());
    let toolchain = format!("{}-linux-gnu", OTHER[1]);
    script(&site.path("zig/cargo-zigbuild"), "");
    script(&site.path("gcc/cargo-zigbuild"), "");
    script(&site.path(&format!("gcc/{toolchain}-gcc")), "");
    // Of the tools that are there, the configured linker comes first, then gcc.
    for (tool, path, begins, ends) in [
        ("configured", "gcc", "build ", String::new()),
        ("zig", "zig", "zigbuild ", String::new()),
        (
            "gcc",
            "gcc",
            "build ",
            format!(" --config target.{}.linker=\"{toolchain}-gcc\"", OTHER[2]),
        ),
    ] {
        let configured = if tool == "configured" { "a-linker" } else { "" };
        let built = run(&build, path, configured);
        assert_eq!(built.code, 3, "{built:?}");
        let said = fs::read_to_string(&log).expect("a log");
        let wanted = format!(" --bin simulator --target {}{ends}\n", OTHER[2]);
        assert!(
            said.starts_with(begins) && said.ends_with(&wanted),
            "{said}"
        );
        fs::remove_file(&log).expect("it was there");

        let plan = run(&["plan", "--unbuilt", "--format", "json"], path, configured);
        let plan: serde_json::Value = serde_json::from_str(&plan.stdout).expect("JSON");
        let wanted = serde_json::json!({
            "arch": OTHER[0], "place": "here", "platform": OTHER[2], "linker": tool,
        });
        assert_eq!(plan["hosts"][0]["build"], wanted, "{plan}");
        let program = plan["components"][0]["executable"].as_str();
        let program = program.expect("a path");
        assert!(
            program.ends_with(&format!("{}/release/simulator", OTHER[2])),
            "{program}"
        );
    }
    let plan = run(&["plan", "--unbuilt"], "zig", "");
    let line = format!(
        "\nhost robot: {}, its programs are built here for {}, linked with zig\n",
        OTHER[0], OTHER[2]
    );
    assert!(plan.stdout.contains(&line), "{plan:?}");
}

/// Their places on the host are those here.
#[test]
fn files_that_parameters_name_are_copied_from_absolute_paths() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path().canonicalize().expect("a folder");
    for (name, text) in [
        ("n/map.txt", "a map"),
        ("start.txt", "a place"),
        (
            "n/reader.cdsl",
            "Component reader { Communications { }; language rust; parameters \"reader.pdsl\"; };",
        ),
        (
            "n/reader.pdsl",
            "ComponentParams reader { map path \"map.txt\"; start path \"\"; };",
        ),
        ("n/reader.toml", "[parameters]\nstart = \"../start.txt\"\n"),
        (
            "n/n.ddsl",
            "Deployment n { Host robot { address \"robot\"; }; \
             Component reader { cdsl \"reader.cdsl\"; executable \"x\"; config \"reader.toml\"; host robot; }; };",
        ),
    ] {
        let place = folder.join(name);
        fs::create_dir_all(place.parent().expect("a parent")).expect("a folder");
        fs::write(place, text).expect("written");
    }
    // From the folder of the test.
    let here = std::env::current_dir().and_then(|here| here.canonicalize());
    let relative = paths::relative(&here.expect("a folder"), &folder.join("n/n.ddsl"));
    let (mut sources, loader) = (SourceMap::new(), FileLoader::default());
    let overrides = network::Overrides::default();
    let loaded = network::load(&relative, &overrides, &mut sources, &loader);
    let (network, found) = loaded.expect("the files");
    let found = render(&sources, &found, Format::Short);
    let plan = network.expect(&found).plan(Profile::Dev).expect("a plan");
    let files = &plan.components[0].files;
    assert!(files.iter().all(|file| file.is_absolute()), "{files:?}");
    let files: Vec<_> = files.iter().map(|file| paths::normal(file)).collect();
    let wanted = ["n/reader.toml", "n/map.txt", "start.txt"].map(|file| folder.join(file));
    assert_eq!(files, wanted, "{found}");
}
