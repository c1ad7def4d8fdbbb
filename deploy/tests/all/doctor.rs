//! `rcdeploy doctor`.

use rc_test_site::site::Site;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

/// The report of the doctor on a host to which this shell script is the ssh: code, grade, all.
fn of_host(folder: &Path, ssh: &str) -> (Option<i32>, String, String) {
    let program = folder.join("ssh");
    fs::write(&program, format!("#!/bin/sh\n{ssh}\n")).expect("written");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("set");
    let cdsl = Path::new(env!("CARGO_MANIFEST_DIR")).join("../components/clock/clock.cdsl");
    let text = format!(
        "Deployment robot {{ middleware dds; Host arm {{ address \"10.0.0.2\"; user \"pi\"; }}; \
         Component clock {{ cdsl \"{}\"; host arm; }}; }}\n",
        cdsl.display()
    );
    let network = folder.join("robot.ddsl");
    fs::write(&network, text).expect("written");
    let output = Command::new(Site::executable("rcdeploy"))
        .args(["doctor", "--format", "json"])
        .arg(&network)
        .env("RC_SSH", &program)
        .output()
        .expect("it runs");
    let said = String::from_utf8_lossy(&output.stdout);
    let wrong = String::from_utf8_lossy(&output.stderr);
    let findings: Vec<serde_json::Value> =
        serde_json::from_str(&said).unwrap_or_else(|e| panic!("{e}: {said} {wrong}"));
    assert_eq!(findings[0]["check"], "shared memory", "{said}");
    let host = findings.last().expect("a host");
    assert_eq!(host["check"], "host arm", "{said}");
    let grade = host["grade"].as_str().expect("a grade").to_owned();
    (output.status.code(), grade, host.to_string())
}

#[test]
fn a_host_is_asked_over_ssh() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    // The last argument is the command of the other machine; a login may say something first.
    let (_, grade, told) = of_host(folder, "echo Welcome; for last; do :; done; eval \"$last\"");
    assert!(grade == "ok" || told.contains("shared memory"), "{told}");
    let there = "echo; echo 'rcdeploy agent: Plan9 mips'";
    let (code, grade, told) = of_host(folder, there);
    assert_eq!((code, &*grade), (Some(1), "error"), "{told}");
    assert!(told.contains("of the kind Plan9 mips"), "{told}");
    let refuses = "printf 'pi@10.0.0.2: Permission denied (publickey).\\n' >&2; exit 255";
    let (code, grade, told) = of_host(folder, refuses);
    assert_eq!((code, &*grade), (Some(1), "error"), "{told}");
    assert!(told.contains("ssh-copy-id pi@10.0.0.2"), "{told}");
}
