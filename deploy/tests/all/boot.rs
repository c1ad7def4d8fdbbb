//! A network on a Debian that boots, with users who log in and out: `cargo xtask soak boot`.

use rc_test_site::site::Site;
use rc_test_support::python::skipped;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

/// The packages of the system.
const PACKAGES: &str =
    "systemd-sysv,dbus-user-session,libpam-systemd,openssh-server,openssh-client,iproute2,procps";
/// Boots the system in namespaces of its own. The first argument is its folder.
const BOOT: &str = include_str!("boot/boot.sh");
/// What is done in the system. The first argument is `first`, or `again` after the second boot.
const INSIDE: &str = include_str!("boot/inside.sh");
const COMPONENTS: [&str; 3] = ["simulator", "pose_monitor", "avoider"];

/// A system that runs. Dropping it ends it.
struct Booted(Child);

impl Booted {
    fn start(site: &Site, root: &Path) -> Self {
        let _ = fs::remove_file(root.join("booted"));
        let log = fs::File::create(site.path("boot.log")).expect("a log");
        let mut command = Command::new("unshare");
        command.args([
            "--mount",
            "--pid",
            "--fork",
            "--kill-child",
            "--uts",
            "--ipc",
            "--net",
        ]);
        command.args(["sh", "-euc", BOOT]).arg(root);
        command
            .stdin(Stdio::null())
            .stdout(log.try_clone().expect("a log"))
            .stderr(log);
        let booted = Self(command.spawn().expect("unshare"));
        Site::until("the system has booted", || root.join("booted").exists());
        booted
    }

    /// The process of its manager, as this system numbers it.
    fn inside(&self) -> Option<String> {
        let id = self.0.id();
        let children = fs::read_to_string(format!("/proc/{id}/task/{id}/children")).ok()?;
        children.split_whitespace().next().map(str::to_owned)
    }

    fn run(&self, stage: &str) -> Output {
        let manager = self.inside().expect("it runs");
        let mut command = Command::new("nsenter");
        command.args(["--target", &manager, "--all", "--root", "--wd"]);
        command.args([
            "env",
            "-i",
            "HOME=/root",
            "PATH=/usr/sbin:/usr/bin:/sbin:/bin",
        ]);
        command.args(["bash", "-euo", "pipefail", "-c", INSIDE, "inside", stage]);
        command.stdin(Stdio::null()).output().expect("nsenter")
    }
}

impl Drop for Booted {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Makes the system with the tools and the components of a network. The error says why this machine cannot.
fn make(root: &Path) -> Result<(), String> {
    let run = |command: &mut Command| {
        let output = command.stdin(Stdio::null()).output();
        let output = output.map_err(|error| error.to_string())?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        output.status.success().then_some(()).ok_or(said)
    };
    let include = format!("--include={PACKAGES}");
    run(Command::new("mmdebstrap")
        .args(["--quiet", "--variant=minbase", &include, "bookworm"])
        .arg(root))
    .map_err(|reason| format!("mmdebstrap: {reason}"))?;
    let prefix = root.join("opt/robocomp");
    for component in COMPONENTS {
        let file = format!("{component}/{component}.cdsl");
        let mut command = Command::new(Site::executable("rcgen"));
        command.args(["install", "--profile", "dev", "--prefix"]);
        run(command.arg(&prefix).arg(Site::components().join(file)))?;
    }
    let tool = prefix.join("bin/rcdeploy");
    fs::create_dir_all(prefix.join("bin")).expect("a folder");
    fs::copy(rc_test_site::site::rcdeploy(), &tool).expect("copied");
    std::os::unix::fs::symlink("/opt/robocomp/bin/rcdeploy", root.join("usr/bin/rcdeploy"))
        .expect("a link");
    let network = Site::components().join("networks/patrol.ddsl");
    fs::copy(network, root.join("root/patrol.ddsl")).expect("copied");
    let _ = run(Command::new("strip").arg(&tool));
    Ok(())
}

#[test]
fn a_network_outlives_logins_and_starts_at_boot() {
    let test = "a_network_outlives_logins_and_starts_at_boot";
    if std::env::var_os("RC_BOOT").is_none() {
        return skipped(test, "`cargo xtask soak boot` runs it");
    }
    let site = Site::new("boot");
    let root = site.path("system");
    if let Err(reason) = make(&root) {
        return skipped(test, &reason);
    }
    for stage in ["first", "again"] {
        let booted = Booted::start(&site, &root);
        let ran = booted.run(stage);
        let said = String::from_utf8_lossy(&ran.stdout);
        let wrong = String::from_utf8_lossy(&ran.stderr);
        assert!(ran.status.success(), "{stage}: {said}{wrong}");
    }
}
