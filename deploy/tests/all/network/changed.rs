//! Changes of a `.ddsl` while its network runs, full disks, and full shared memory.

use rc_test_site::site::{PATROL, Site};
use rc_test_support::python::skipped;
use rustix::process::{Signal, kill_process};
use std::fs::File;
use std::process::{Command, Stdio};

#[test]
fn a_changed_file_still_refers_to_the_running_network() {
    let site = Site::new("changed");
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let status = || site.rcdeploy(&["status"], true);
    let word = "is not what the network was started from any more";
    let before = status();
    assert_eq!(before.code, 0, "{before:?}");
    assert!(!before.stdout.contains(word), "{before:?}");
    assert_eq!(site.status()["changed"], false);

    let text = std::fs::read_to_string(site.ddsl()).expect("the file");
    let broken = format!("{}\n    Component {{\n", &text[..text.len() / 2]);
    let renamed = PATROL.replace("Deployment patrol", "Deployment other_name");
    // Another comment, another name, a syntax error, and no file.
    for changed in [format!("{text}// later\n"), renamed, broken] {
        std::fs::write(site.ddsl(), changed).expect("written");
        let output = status();
        assert_eq!(output.code, 0, "{output:?}");
        assert!(
            output.stdout.contains(word) && output.stdout.contains(&site.network),
            "{output:?}"
        );
        assert_eq!(site.status()["changed"], true);
        let logs = site.rcdeploy(&["logs"], true);
        assert_eq!(logs.code, 0, "{logs:?}");
    }
    std::fs::remove_file(site.ddsl()).expect("it is there");
    let down = site.rcdeploy(&["down"], true);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
    // Now `rcdeploy` has no information about the network.
    let gone = status();
    assert_eq!(gone.code, 3, "{gone:?}");
    assert!(gone.stderr.contains("No such file"), "{gone:?}");
}

#[test]
fn a_component_survives_an_unwritable_log() {
    let site = Site::new("full");
    let full = || File::options().write(true).open("/dev/full");
    let program = Site::executable("speech_server");
    let mut command = site.command(&program);
    command
        .args(["--network", &site.network, "--log", "debug"])
        .stdin(Stdio::null())
        .stdout(full().expect("Linux has it"))
        .stderr(full().expect("Linux has it"));
    let mut child = command.spawn().expect("it starts");
    let wait = ["--probe", "--network", &site.network, "--wait", "15"];
    let ready = site.component("speech_server", &wait);
    assert_eq!(ready.code, 0, "{ready:?}");
    kill_process(rustix::process::Pid::from_child(&child), Signal::TERM).expect("it runs");
    assert_eq!(child.wait().expect("it ended").code(), Some(0));

    let mut wrong = site.command(&program);
    wrong
        .arg("--unknown")
        .stderr(full().expect("Linux has it"))
        .stdin(Stdio::null());
    let status = wrong.status().expect("it starts");
    assert_eq!(status.code(), Some(2));
}

#[test]
fn a_network_that_exceeds_the_shared_memory_is_reported() {
    let site = Site::new("small");
    let file = site.write(
        "small.ddsl",
        &include_str!("../../../../components/networks/camera.ddsl")
            .replace("Deployment camera", &format!("Deployment {}", site.network))
            .replace("\"../", &format!("\"{}/", Site::components().display())),
    );
    let script = "mount -t tmpfs -o size=200k tmpfs /dev/shm && exec \"$@\"";
    let within = |program: &str| {
        let mut command = Command::new("unshare");
        command.args(["-m", "sh", "-c", script, "sh", program]);
        command
    };
    let mut command = within("true");
    command.stderr(Stdio::null());
    if !command.status().is_ok_and(|status| status.success()) {
        let test = "a_network_that_exceeds_the_shared_memory_is_reported";
        return skipped(test, "this user may not mount (`unshare -m`)");
    }
    let mut command = within(env!("CARGO_BIN_EXE_rcdeploy"));
    command.args(["up", "--profile", "dev"]).arg(file);
    let ran = site.run(command);
    assert_eq!(ran.code, 3, "{ran:?}");
    assert!(
        ran.stderr
            .contains("the shared memory is full: /dev/shm has 204 kB"),
        "{ran:?}"
    );
    site.assert_nothing_left();
}
