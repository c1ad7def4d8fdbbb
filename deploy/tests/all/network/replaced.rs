//! `rcdeploy up --build` whose own program is replaced by the build.

use rc_test_site::site::Site;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;

#[test]
fn a_build_may_replace_rcdeploy() {
    let site = Site::new("replaced");
    let rcdeploy = site.path("rcdeploy");
    // A file that this process has open for writing could not be executed by a fork of it.
    let mut copy = Command::new("cp");
    copy.arg(env!("CARGO_BIN_EXE_rcdeploy")).arg(&rcdeploy);
    assert!(copy.status().expect("cp").success());
    // This cargo builds nothing, and leaves a program that cannot run a network.
    let path = rcdeploy.display();
    let script = format!(
        "#!/bin/sh\n[ \"$1\" = metadata ] && exec {} \"$@\"\nrm {path} && cp /bin/false {path}\n",
        env!("CARGO")
    );
    let cargo = site.write("cargo", &script);
    fs::set_permissions(&cargo, fs::Permissions::from_mode(0o755)).expect("a program");
    let mut command = Command::new(&rcdeploy);
    command.args(["up", "--build", "--no-generate", "--profile", "dev"]);
    command
        .arg("--detach")
        .arg(site.ddsl())
        .env("CARGO", &cargo);
    let up = site.run(command);
    assert_eq!(up.code, 0, "{up:?}");
    let there = fs::read(&rcdeploy).expect("a file");
    assert!(there == fs::read("/bin/false").expect("a file"));
    let down = site.rcdeploy(&["down"], true);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}
