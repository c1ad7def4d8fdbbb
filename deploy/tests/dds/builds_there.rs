//! A host that builds its programs, behind a real ssh server that is reached by an IPv6 address with a
//! zone: its cargo is too old, its disk fills, and the network goes away in the middle. Scripts stand
//! for the cargo there.

use crate::remote::{Robot, Server};
use rc_test_site::site::{Site, rcdeploy};
use rc_test_support::cable::{Cable, cable, run};
use rc_test_support::python::skipped;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The addresses of the ends of the cable, which are valid on this link only.
const LINK_LOCAL: [&str; 2] = ["fe80::77:1", "fe80::77:2"];

/// The processor of this machine, and of the other host.
const ARCH: &str = if cfg!(target_arch = "aarch64") {
    "arm64"
} else {
    "amd64"
};

const NETWORK: &str = r#"
Deployment patrol
{
    middleware iceoryx2;
    Host robot { address "ADDRESS"; user "root"; arch ARCH; build there; };
    Component simulator { cdsl "../simulator/simulator.cdsl"; host robot; };
};
"#;

/// A small disk, mounted at a folder. Dropping it unmounts it.
struct Disk(PathBuf);

impl Disk {
    fn mount(at: &Path, size: &str) -> Result<Self, String> {
        let path = at.display().to_string();
        let size = format!("size={size}");
        run("mount", &["-t", "tmpfs", "-o", &size, "small", &path])?;
        Ok(Self(at.to_owned()))
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let path = self.0.display().to_string();
        let _ = run("umount", &["--lazy", &path]);
    }
}

/// Gives an end of the cable its address. Nobody else has it, so it counts at once.
fn address(cable: &Cable, side: usize) -> Result<(), String> {
    let name = cable.name(side);
    let address = format!("{}/64", LINK_LOCAL[side]);
    let add = ["-n", name, "-6", "address", "add", &address, "dev", name];
    run("ip", &[&add[..], &["nodad"]].concat())
}

/// The network on two hosts, whose robot has a small disk for its sources.
struct Builder {
    // The server ends before its disk and the cable.
    robot: Robot,
    _disk: Disk,
    cable: Cable,
    site: Site,
}

impl Builder {
    fn new(cable: Cable) -> Result<Self, String> {
        address(&cable, 0)?;
        address(&cable, 1)?;
        let mut site = Site::new("built_over_ssh");
        let [ours, theirs] = [0, 1].map(|side| format!("{}%{}", LINK_LOCAL[1], cable.name(side)));
        site.write_ddsl(&NETWORK.replace("ADDRESS", &ours).replace("ARCH", ARCH));
        let cache = site.path("robot/cache");
        fs::create_dir_all(&cache).expect("a folder");
        let disk = Disk::mount(&cache, "64m")?;
        let server = Server {
            listen: &theirs,
            known_as: &ours,
            // That of the user may have a cargo.
            home: Some(site.path("robot")),
        };
        let robot = Robot::serve(&site, &cable, &server)?;
        let within = ["ip", "netns", "exec", cable.name(0)];
        site.within = within.map(str::to_owned).to_vec();
        Ok(Self {
            robot,
            _disk: disk,
            cable,
            site,
        })
    }

    /// Sets the cargo of the robot.
    fn cargo(&self, version: &str, does: &str) {
        let path = self.robot.path(".cargo/bin/cargo");
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        let script = format!(
            "#!/bin/sh\n[ \"$1\" = --version ] && {{ echo 'cargo {version} (x)'; exit 0; }}\n\
             while [ \"$1\" ]; do [ \"$1\" = --target-dir ] && t=\"$2\"; shift; done\nmkdir -p \"$t\"; cd \"$t\" || exit 1\n{does}\n"
        );
        fs::write(&path, script).expect("written");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("set");
    }

    fn command(&self) -> Command {
        let mut command = self.site.command(&rcdeploy());
        command.args(["up", "--build", "--detach", "--profile", "dev"]);
        command.arg(self.site.ddsl());
        command.env("RC_SSH", self.robot.ssh());
        command
    }

    /// What `up --build` says, which fails.
    fn fails(&self) -> String {
        let up = self.site.run(self.command());
        assert_eq!(up.code, 3, "{up:?}");
        up.stderr
    }
}

/// Tests beside this one may write files into the workspace.
const FEW: usize = 20;

/// The number of files that were copied to the host.
fn copied(said: &str) -> usize {
    let count = said
        .split_once(" files of sources are copied")
        .map(|(before, _)| before);
    let count = count.and_then(|before| before.rsplit(' ').next());
    count.map_or(0, |count| count.parse().expect("a number"))
}

#[test]
fn a_host_builds_over_ssh_and_goes_on_after_each_failure() {
    let test = "a_host_builds_over_ssh_and_goes_on_after_each_failure";
    let Some(cable) = cable(test) else { return };
    let builder = match Builder::new(cable) {
        Ok(builder) => builder,
        Err(reason) => return skipped(test, &reason),
    };

    builder.cargo("1.60.0", "exit 1");
    let said = builder.fails();
    assert!(said.contains("its cargo 1.60.0 is too old"), "{said}");
    assert!(said.contains("rustup update stable"), "{said}");

    // The disk fills while cargo builds.
    builder.cargo(
        "99.0.0",
        "echo built > first; head -c 200M /dev/zero > large || { rm large; exit 101; }",
    );
    let said = builder.fails();
    assert!(copied(&said) > FEW, "{said}");
    assert!(said.contains("its disk is full (6"), "{said}");

    // The network goes away while it builds, then comes back.
    let begun = builder.site.path("begun");
    let builds = format!("cat first; echo $$ > {}; sleep 120", begun.display());
    builder.cargo("99.0.0", &builds);
    let log = fs::File::create(builder.site.path("up.log")).expect("a log");
    let mut command = builder.command();
    command.stdin(Stdio::null()).stderr(log);
    let mut up = command.spawn().expect("rcdeploy");
    let pid = || fs::read_to_string(&begun).unwrap_or_default();
    Site::until("cargo builds there", || pid().ends_with('\n'));
    builder.cable.set(1, "down");
    assert_eq!(up.wait().expect("a child").code(), Some(3));
    let said = fs::read_to_string(builder.site.path("up.log")).expect("a log");
    assert!(copied(&said) < FEW, "{said}");
    assert!(said.contains("goes on where it was"), "{said}");
    builder.cable.set(1, "up");
    // An end that is down loses its address.
    address(&builder.cable, 1).expect("the address again");
    let process = Path::new("/proc").join(pid().trim());
    Site::until("the end of the build there", || !process.exists());

    // What was built and copied before is there.
    builder.cargo("99.0.0", "cat first; exit 1");
    let said = builder.fails();
    assert!(copied(&said) < FEW, "{said}");
    assert!(said.contains("robot: built"), "{said}");
    assert!(said.contains("cargo failed there (exit code 1)"), "{said}");
}
