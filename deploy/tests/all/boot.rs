//! A network on a Debian that boots, with users who log in and out: `cargo xtask soak boot`.

use rc_test_site::site::Site;
use rc_test_support::debian::program;
use rc_test_support::python::skipped;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::process::{Pid, PidfdFlags, pidfd_open};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

/// The packages of the system.
const PACKAGES: &str =
    "systemd-sysv,dbus-user-session,libpam-systemd,openssh-server,openssh-client,iproute2,procps";
/// Boots the system in namespaces of its own. The arguments are its folder, the name of its control group,
/// and a folder where the groups can be mounted.
const BOOT: &str = include_str!("boot/boot.sh");
/// What is done in the system. The first argument is `first`, or `again` after the second boot.
const INSIDE: &str = include_str!("boot/inside.sh");
const COMPONENTS: [&str; 3] = ["simulator", "pose_monitor", "avoider"];
/// The namespaces of the system.
const UNSHARE: [&str; 7] = [
    "--mount",
    "--pid",
    "--fork",
    "--kill-child",
    "--uts",
    "--ipc",
    "--net",
];
/// Mounts the control groups at the first argument.
const MOUNT: &str = "mount -t cgroup2 none \"$0\"";
/// How many seconds the download of the system, or a stage in it, may take.
const LIMIT: &str = "600";
/// How long its processes may take to end.
const END: Timespec = Timespec {
    tv_sec: 10,
    tv_nsec: 0,
};

/// A system that runs. Dropping it ends it.
struct Booted {
    child: Child,
    group: String,
    groups: PathBuf,
}

impl Booted {
    fn start(site: &Site, root: &Path, groups: &Path) -> Self {
        let _ = fs::remove_file(root.join("booted"));
        let log = site.path("boot.log");
        let out = fs::File::create(&log).expect("a log");
        let group = format!("boot-{}", std::process::id());
        let mut command = Command::new("unshare");
        command.args(UNSHARE).args(["sh", "-euc", BOOT]);
        command.arg(root).arg(&group).arg(groups);
        command
            .stdin(Stdio::null())
            .stdout(out.try_clone().expect("a log"))
            .stderr(out);
        let mut booted = Self {
            child: command.spawn().expect("unshare"),
            group,
            groups: groups.to_owned(),
        };
        let has_booted = || root.join("booted").exists();
        Site::until("the system has booted", || {
            has_booted() || !matches!(booted.child.try_wait(), Ok(None))
        });
        let said = fs::read_to_string(&log).unwrap_or_default();
        assert!(has_booted(), "it has ended: {said}");
        booted
    }

    /// The process of its manager, as this system numbers it.
    fn inside(&self) -> Option<String> {
        let id = self.child.id();
        let children = fs::read_to_string(format!("/proc/{id}/task/{id}/children")).ok()?;
        children.split_whitespace().next().map(str::to_owned)
    }

    fn run(&self, stage: &str) -> Output {
        let manager = self.inside().expect("it runs");
        let mut command = within_limit("nsenter");
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
        let manager = self.inside().and_then(|id| Pid::from_raw(id.parse().ok()?));
        let manager = manager.and_then(|pid| pidfd_open(pid, PidfdFlags::empty()).ok());
        let _ = self.child.kill();
        let _ = self.child.wait();
        // The manager ends after all of its processes; its parent is another one now.
        if let Some(manager) = manager {
            let _ = poll(&mut [PollFd::new(&manager, PollFlags::IN)], Some(&END));
        }
        let remove = format!("{MOUNT}; find \"$0/$1\" -depth -type d -exec rmdir {{}} +");
        let mut command = Command::new("unshare");
        command.args(["--mount", "sh", "-euc", &remove]);
        let _ = command.arg(&self.groups).arg(&self.group).status();
    }
}

/// A command that is killed after the limit, with its children.
fn within_limit(program: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new("timeout");
    command.args(["--kill-after=5", LIMIT]).arg(program);
    command
}

fn run(command: &mut Command) -> Result<(), String> {
    let output = command.stdin(Stdio::null()).output();
    let output = output.map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    output.status.success().then_some(()).ok_or(said)
}

/// Makes the system. The error says why this machine cannot, or cannot boot it.
fn make(root: &Path, groups: &Path) -> Result<(), String> {
    fs::create_dir(groups).expect("a folder");
    let mut probe = Command::new("unshare");
    probe.args(UNSHARE).args(["sh", "-euc", MOUNT]).arg(groups);
    let last = |said: String| {
        let last = said.lines().rfind(|line| !line.trim().is_empty());
        last.unwrap_or("it failed").to_owned()
    };
    let refused = |said| {
        format!(
            "no test may make namespaces and mount control groups: {}",
            last(said)
        )
    };
    run(&mut probe).map_err(refused)?;
    let include = format!("--include={PACKAGES}");
    let mmdebstrap = program("mmdebstrap --no-install-recommends", "mmdebstrap")?;
    run(within_limit(&mmdebstrap)
        .args(["--quiet", "--variant=minbase", &include, "bookworm"])
        .arg(root))
    .map_err(|said| format!("mmdebstrap: {}", last(said)))
}

/// Installs the tools and the components of a network.
fn install(root: &Path) {
    let prefix = root.join("opt/robocomp");
    for component in COMPONENTS {
        let file = format!("{component}/{component}.cdsl");
        let mut command = Command::new(Site::executable("rcgen"));
        command.args(["install", "--profile", "dev", "--prefix"]);
        let installed = run(command.arg(&prefix).arg(Site::components().join(file)));
        assert_eq!(installed, Ok(()), "{component}");
    }
    let tool = prefix.join("bin/rcdeploy");
    fs::create_dir_all(prefix.join("bin")).expect("a folder");
    fs::copy(rc_test_site::site::rcdeploy(), &tool).expect("copied");
    std::os::unix::fs::symlink("/opt/robocomp/bin/rcdeploy", root.join("usr/bin/rcdeploy"))
        .expect("a link");
    let network = Site::components().join("networks/patrol.ddsl");
    fs::copy(network, root.join("root/patrol.ddsl")).expect("copied");
    let _ = run(Command::new("strip").arg(&tool));
}

#[test]
fn a_network_outlives_logins_and_starts_at_boot() {
    let test = "a_network_outlives_logins_and_starts_at_boot";
    if std::env::var_os("RC_BOOT").is_none() {
        return skipped(test, "`cargo xtask soak boot` runs it");
    }
    let site = Site::new("boot");
    let (root, groups) = (site.path("system"), site.path("groups"));
    if let Err(reason) = make(&root, &groups) {
        return skipped(test, &reason);
    }
    install(&root);
    for stage in ["first", "again"] {
        let booted = Booted::start(&site, &root, &groups);
        let ran = booted.run(stage);
        let said = String::from_utf8_lossy(&ran.stdout);
        let wrong = String::from_utf8_lossy(&ran.stderr);
        assert!(ran.status.success(), "{stage}: {said}{wrong}");
    }
}
