//! The checks of this machine.

use super::Finding;
use std::io;
use std::net::{Ipv4Addr, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Shared memory below this many bytes is full after some images.
const LITTLE_MEMORY: u64 = 256 << 20;

/// A disk with fewer free bytes is full after a build, or after some minutes of recording.
const LITTLE_DISK: u64 = 2 << 30;

/// The greatest domain of DDS whose ports exist (OMG DDSI-RTPS 2.5, 9.6.2.3).
const LAST_DOMAIN: u32 = 232;

/// The subject of the checks: this machine, or files of a test.
pub(crate) struct Machine<'a> {
    /// The folder of `/dev`, `/etc`, `/proc`, `/run` and `/sys`.
    pub(crate) root: PathBuf,
    /// The environment.
    pub(crate) variable: &'a dyn Fn(&str) -> Option<String>,
    /// The number of the user.
    pub(crate) user: u32,
    /// Where recordings and builds are written.
    pub(crate) folder: PathBuf,
}

impl Machine<'_> {
    /// Runs all checks, in the order in which a network needs their subjects.
    pub(crate) fn examine(&self) -> Vec<Finding> {
        let checks: [fn(&Self) -> Finding; 13] = [
            Self::shared_memory,
            Self::logout_finding,
            Self::watches,
            Self::real_time,
            Self::disk,
            Self::build,
            Self::cpp,
            Self::python,
            Self::ros,
            Self::multicast,
            Self::firewall,
            Self::clock,
            Self::clock_steps,
        ];
        checks.iter().map(|check| check(self)).collect()
    }

    pub(super) fn path(&self, absolute: &str) -> PathBuf {
        self.root.join(absolute.trim_start_matches('/'))
    }

    /// A file of the system, without the blanks around.
    pub(super) fn text(&self, absolute: &str) -> Option<String> {
        let text = std::fs::read_to_string(self.path(absolute)).ok()?;
        Some(text.trim().to_owned())
    }

    fn variable(&self, name: &str) -> Option<String> {
        (self.variable)(name).filter(|value| !value.is_empty())
    }

    fn shared_memory(&self) -> Finding {
        const CHECK: &str = "shared memory";
        let place = self.path("/dev/shm");
        let Ok(disk) = rustix::fs::statvfs(&place) else {
            let fix = "mount a tmpfs there; iceoryx2 needs it, the middleware `dds` does not";
            return Finding::error(CHECK, format!("there is no {}", place.display()), fix);
        };
        let all = disk.f_blocks.saturating_mul(disk.f_frsize);
        let free = disk.f_bavail.saturating_mul(disk.f_frsize);
        let found = format!("/dev/shm has {}, {} are free", bytes(all), bytes(free));
        if rustix::fs::access(&place, rustix::fs::Access::WRITE_OK).is_err() {
            let fix = "chmod 1777 /dev/shm, as root";
            return Finding::error(CHECK, format!("{found}, but you may not write there"), fix);
        }
        if all >= LITTLE_MEMORY && free >= LITTLE_MEMORY / 4 {
            return Finding::ok(CHECK, found);
        }
        let fix = if all < LITTLE_MEMORY {
            "mount -o remount,size=1G /dev/shm (a container: --shm-size=1g)"
        } else {
            "remove the files of programs that have ended: ls -l /dev/shm"
        };
        Finding::warning(CHECK, found, fix)
    }

    fn watches(&self) -> Finding {
        const CHECK: &str = "inotify";
        let limit = self.text("/proc/sys/fs/inotify/max_user_instances");
        let Some(limit) = limit.and_then(|text| text.parse::<usize>().ok()) else {
            return Finding::ok(CHECK, "the system reports no limit");
        };
        let used = self.used_instances();
        let found = format!("{used} of {limit} instances are used");
        if used + 16 <= limit {
            return Finding::ok(CHECK, found);
        }
        let fix = "sysctl fs.inotify.max_user_instances=1024, as root; until then, `logs --follow` reads again and again";
        Finding::warning(CHECK, found, fix)
    }

    /// The instances of inotify of the user's processes, as far as they are visible.
    fn used_instances(&self) -> usize {
        let processes = std::fs::read_dir(self.path("/proc")).into_iter().flatten();
        let descriptors = processes.flatten().flat_map(|process| {
            let folder = std::fs::read_dir(process.path().join("fd"));
            folder.into_iter().flatten().flatten()
        });
        let is_watch = |path: PathBuf| {
            std::fs::read_link(path).is_ok_and(|to| to == Path::new("anon_inode:inotify"))
        };
        descriptors.filter(|entry| is_watch(entry.path())).count()
    }

    #[expect(clippy::unused_self, reason = "all checks have one form")]
    fn real_time(&self) -> Finding {
        const CHECK: &str = "real time";
        match rc_scheduling::permits(1) {
            Ok(()) => Finding::ok(CHECK, "components may have a `priority`"),
            Err(reason) => {
                let (found, fix) = reason.split_once("; ").unwrap_or((&reason, "leave it out"));
                Finding::warning(CHECK, found, fix)
            }
        }
    }

    fn disk(&self) -> Finding {
        const CHECK: &str = "disk";
        let place = self.folder.display();
        let Ok(disk) = rustix::fs::statvfs(&self.folder) else {
            let fix = "go to a folder that exists";
            return Finding::error(CHECK, format!("{place} cannot be read"), fix);
        };
        let free = disk.f_bavail.saturating_mul(disk.f_frsize);
        let found = format!("{} are free in {place}", bytes(free));
        if free >= LITTLE_DISK {
            return Finding::ok(CHECK, found);
        }
        let fix = "make room: a build needs some GB, and a recording ends when the disk is full";
        Finding::warning(CHECK, found, fix)
    }

    fn build(&self) -> Finding {
        const CHECK: &str = "building";
        let needed = env!("CARGO_PKG_RUST_VERSION");
        let Some(said) = self.said("rustc", &["--version"]) else {
            let found = "there is no rustc in the PATH; networks that are built elsewhere run";
            return Finding::warning(CHECK, found, "https://rustup.rs installs it");
        };
        let version = said.split(' ').nth(1).unwrap_or_default().to_owned();
        if is_older(&version, needed) {
            let found = format!("rustc is {version}, and {needed} is needed");
            return Finding::error(CHECK, found, "rustup update stable");
        }
        if self.said("cargo", &["--version"]).is_none() {
            let fix = "https://rustup.rs installs it";
            return Finding::error(CHECK, "there is no cargo in the PATH", fix);
        }
        if self.said("cc", &["--version"]).is_none() {
            let fix = "apt install gcc libc6-dev";
            return Finding::error(CHECK, "there is no C compiler `cc` in the PATH", fix);
        }
        Finding::ok(CHECK, format!("rustc {version}, cargo and cc are there"))
    }

    fn cpp(&self) -> Finding {
        const CHECK: &str = "C++";
        let fix = "apt install cmake g++";
        let Some(said) = self.said("cmake", &["--version"]) else {
            let found = "there is no cmake in the PATH, which components in C++ need";
            return Finding::warning(CHECK, found, fix);
        };
        let Some(compiler) = self.said("c++", &["--version"]) else {
            let found = "there is no compiler `c++` in the PATH, which components in C++ need";
            return Finding::warning(CHECK, found, fix);
        };
        let [cmake, compiler] =
            [&said, &compiler].map(|said| said.lines().next().unwrap_or_default());
        let needed = if compiler.contains("clang") { "7" } else { "8" };
        for (found, needed) in [(cmake, "3.16"), (compiler, needed)] {
            if version_in(found).is_some_and(|version| is_older(version, needed)) {
                let found =
                    format!("`{found}` is older than {needed}, which components in C++ need");
                return Finding::warning(CHECK, found, fix);
            }
        }
        Finding::ok(CHECK, format!("{cmake} and {compiler} are there"))
    }

    fn python(&self) -> Finding {
        const CHECK: &str = "Python";
        if let Some(home) = self.variable("PYTHONHOME")
            && self.said("python3", &["-S", "-c", "print(1)"]).is_none()
        {
            let found = format!("PYTHONHOME is {home}, with which python3 does not start");
            return Finding::error(CHECK, found, "unset PYTHONHOME");
        }
        let script = "import sys; print('%d.%d' % sys.version_info[:2]); import numpy; print(numpy.__version__)";
        match self.said("python3", &["-c", script]) {
            Some(said) => {
                let versions = said.replace('\n', ", NumPy ");
                Finding::ok(CHECK, format!("python3 is {versions}"))
            }
            None if self.said("python3", &["-c", "print(1)"]).is_some() => {
                let found = "python3 has no NumPy, which components in Python need";
                Finding::warning(CHECK, found, "`rcgen venv` installs it for a component")
            }
            None => {
                let found = "there is no python3 in the PATH; components in Python need it";
                Finding::warning(CHECK, found, "apt install python3 python3-venv")
            }
        }
    }

    fn ros(&self) -> Finding {
        const CHECK: &str = "ROS 2";
        const RANGE: &str = "ROS_AUTOMATIC_DISCOVERY_RANGE";
        if let Some(name) = self.variable("RMW_IMPLEMENTATION")
            && crate::process::machine::NOT_DDS.contains(&name.as_str())
        {
            let found = format!("nodes run on {name}, which components of ours do not meet");
            let fix = "export RMW_IMPLEMENTATION=rmw_cyclonedds_cpp, where the nodes start";
            return Finding::warning(CHECK, found, fix);
        }
        let is_only = self
            .variable("ROS_LOCALHOST_ONLY")
            .is_some_and(|set| set != "0");
        let only = is_only.then(|| ("ROS_LOCALHOST_ONLY", "1".to_owned()));
        let (name, range) = only
            .or_else(|| Some((RANGE, self.variable(RANGE)?)))
            .unwrap_or((RANGE, "SUBNET".to_owned()));
        let found = match range.as_str() {
            "SUBNET" | "SYSTEM_DEFAULT" => None,
            "OFF" => Some(format!("{name} is OFF: nodes find no others")),
            "LOCALHOST" | "1" => Some(format!(
                "{name} is {range}: nodes do not find those of other machines"
            )),
            other => {
                let found = format!("{name} is `{other}`");
                let fix = "it is SUBNET, LOCALHOST, OFF or SYSTEM_DEFAULT";
                return Finding::error(CHECK, found, fix);
            }
        };
        if let Some(found) = found {
            return Finding::warning(CHECK, found, format!("unset {name}, if they are to"));
        }
        let Some(domain) = self.variable("ROS_DOMAIN_ID") else {
            return Finding::ok(CHECK, "domain 0");
        };
        match domain.parse::<u32>() {
            Ok(number) if number <= LAST_DOMAIN => {
                Finding::ok(CHECK, format!("domain {number}, from ROS_DOMAIN_ID"))
            }
            _ => {
                let found = format!("ROS_DOMAIN_ID is `{domain}`");
                Finding::error(
                    CHECK,
                    found,
                    format!("it is a number from 0 to {LAST_DOMAIN}"),
                )
            }
        }
    }

    /// DDS finds other machines by multicast.
    fn multicast(&self) -> Finding {
        const CHECK: &str = "multicast";
        let entries = std::fs::read_dir(self.path("/sys/class/net"));
        let mut able: Vec<String> = entries
            .into_iter()
            .flatten()
            .flatten()
            .filter_map(|entry| entry.file_name().into_string().ok())
            .filter(|name| self.is_for_multicast(name))
            .collect();
        able.sort();
        if able.is_empty() {
            let found = "no interface to other machines that is up has multicast; networks on several machines need it";
            let fix = "ip link set dev NAME up multicast on, as root";
            return Finding::warning(CHECK, found, fix);
        }
        let names = able.join(", ");
        match heard() {
            Ok(()) => Finding::ok(CHECK, format!("{names}; datagrams arrive")),
            Err(error) => {
                let found =
                    format!("{names}, but what this machine sends it does not hear: {error}");
                let fix = "open the UDP ports 7400 to 7700 in the firewall, or add the route: ip route add 224.0.0.0/4 dev NAME";
                Finding::warning(CHECK, found, fix)
            }
        }
    }

    /// Whether an interface is up, no loop, and has multicast (the flags are those of netdevice(7)).
    fn is_for_multicast(&self, name: &str) -> bool {
        const UP: u32 = 0x1;
        const LOOPBACK: u32 = 0x8;
        const MULTICAST: u32 = 0x1000;
        let text = self.text(&format!("/sys/class/net/{name}/flags"));
        let flags = text.and_then(|t| u32::from_str_radix(t.trim_start_matches("0x"), 16).ok());
        flags.is_some_and(|flags| flags & (UP | LOOPBACK | MULTICAST) == UP | MULTICAST)
    }

    /// Deadlines, ages and delays between machines need clocks that agree.
    fn clock(&self) -> Finding {
        const CHECK: &str = "clock";
        let is_there = |path: &str| self.path(path).exists();
        if is_there("/run/systemd/timesync/synchronized") || is_there("/run/chrony/chronyd.pid") {
            return Finding::ok(CHECK, "it follows other clocks");
        }
        let found = "nothing sets it; networks on several machines need it";
        Finding::warning(
            CHECK,
            found,
            "timedatectl set-ntp true, or apt install chrony",
        )
    }

    /// The output of a program of the PATH, if it succeeds.
    pub(super) fn said(&self, program: &str, arguments: &[&str]) -> Option<String> {
        let mut command = Command::new(program);
        command
            .args(arguments)
            .stdin(Stdio::null())
            .stderr(Stdio::null());
        for name in ["PATH", "PYTHONHOME"] {
            match (self.variable)(name) {
                Some(value) => command.env(name, value),
                None => command.env_remove(name),
            };
        }
        let output = command.output().ok().filter(|o| o.status.success())?;
        let text = String::from_utf8(output.stdout).ok()?;
        Some(text.trim().to_owned())
    }
}

/// Sends a datagram to a group of the discovery of DDS's kind, and waits for it.
fn heard() -> io::Result<()> {
    // The group of the discovery itself would reach nodes that run (DDSI-RTPS 2.5, 9.6.2.3).
    const GROUP: Ipv4Addr = Ipv4Addr::new(239, 255, 0, 131);
    let ears = UdpSocket::bind((GROUP, 0))?;
    ears.join_multicast_v4(&GROUP, &Ipv4Addr::UNSPECIFIED)?;
    ears.set_read_timeout(Some(Duration::from_secs(1)))?;
    let mouth = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
    mouth.set_multicast_ttl_v4(0)?;
    mouth.send_to(b"rcdeploy doctor", (GROUP, ears.local_addr()?.port()))?;
    let mut datagram = [0; 64];
    ears.recv_from(&mut datagram).map(|_| ())
}

/// The version that a program prints. Its packager may have added others in parentheses.
fn version_in(line: &str) -> Option<&str> {
    let mut depth = 0_usize;
    line.split(' ').find(|word| {
        let is_version = depth == 0 && word.starts_with(|c: char| c.is_ascii_digit());
        depth += word.matches('(').count();
        depth = depth.saturating_sub(word.matches(')').count());
        is_version
    })
}

/// Whether a version, as in `1.94.0-nightly`, is older than another.
fn is_older(version: &str, than: &str) -> bool {
    let numbers = |text: &str| -> Vec<u32> {
        let parts = text.split(['.', '-']);
        parts.map_while(|part| part.parse().ok()).collect()
    };
    numbers(version) < numbers(than)
}

/// An amount as people read it.
fn bytes(count: u64) -> String {
    #[expect(clippy::cast_precision_loss, reason = "one decimal is shown")]
    let megabytes = count as f64 / 1e6;
    if megabytes < 1000.0 {
        format!("{megabytes:.0} MB")
    } else {
        format!("{:.1} GB", megabytes / 1000.0)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::Grade;
    use super::*;

    /// Makes a machine out of files: path and content; a path that ends with `/` is a folder.
    pub(in super::super) fn with<T>(
        files: &[(&str, &str)],
        variables: &[(&str, &str)],
        look: impl FnOnce(&Machine<'_>) -> T,
    ) -> T {
        let root = tempfile::tempdir().expect("a folder");
        for (path, content) in files {
            let path = root.path().join(path);
            std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
            if path.to_string_lossy().ends_with('/') {
                std::fs::create_dir_all(&path).expect("a folder");
            } else {
                std::fs::write(&path, content).expect("a file");
            }
        }
        let variable = |name: &str| {
            let found = variables.iter().find(|(n, _)| *n == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        look(&Machine {
            root: root.path().to_owned(),
            variable: &variable,
            user: 4_000_000,
            folder: root.path().to_owned(),
        })
    }

    #[track_caller]
    pub(in super::super) fn is(finding: &Finding, grade: Grade, words: &str) {
        let told = finding.to_string();
        assert_eq!(finding.grade, grade, "{told}");
        assert!(told.contains(words), "{told}");
        assert_eq!(finding.fix.is_some(), grade != Grade::Ok, "{told}");
    }

    #[test]
    fn missing_and_small_things_are_named() {
        with(&[], &[("PATH", "/nowhere")], |machine| {
            is(&machine.shared_memory(), Grade::Error, "there is no ");
            is(&machine.build(), Grade::Warning, "there is no rustc");
            is(&machine.python(), Grade::Warning, "there is no python3");
            is(&machine.multicast(), Grade::Warning, "no interface");
            is(&machine.clock(), Grade::Warning, "nothing sets it");
            is(&machine.cpp(), Grade::Warning, "there is no cmake");
            assert_eq!(machine.examine().len(), 13);
        });
        let limit = "proc/sys/fs/inotify/max_user_instances";
        with(&[(limit, "12\n")], &[], |machine| {
            is(&machine.watches(), Grade::Warning, "0 of 12 instances");
        });
        with(&[(limit, "128\n"), ("proc/7/fd/", "")], &[], |machine| {
            let watch = machine.path("/proc/7/fd/3");
            std::os::unix::fs::symlink("anon_inode:inotify", watch).expect("a link");
            is(&machine.watches(), Grade::Ok, "1 of 128 instances");
        });
    }

    #[test]
    fn settings_of_ros_that_hide_nodes_are_named() {
        for (variables, grade, words) in [
            (&[][..], Grade::Ok, "domain 0"),
            (&[("ROS_DOMAIN_ID", "7")], Grade::Ok, "domain 7"),
            (&[("ROS_DOMAIN_ID", "233")], Grade::Error, "from 0 to 232"),
            (&[("ROS_DOMAIN_ID", "a")], Grade::Error, "`a`"),
            (
                &[("RMW_IMPLEMENTATION", "rmw_zenoh_cpp")],
                Grade::Warning,
                "rmw_zenoh_cpp",
            ),
            (
                &[("ROS_LOCALHOST_ONLY", "1")],
                Grade::Warning,
                "those of other machines",
            ),
            (&[("ROS_LOCALHOST_ONLY", "0")], Grade::Ok, "domain 0"),
            (
                &[("ROS_AUTOMATIC_DISCOVERY_RANGE", "OFF")],
                Grade::Warning,
                "find no others",
            ),
            (
                &[("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")],
                Grade::Ok,
                "domain 0",
            ),
            (
                &[("ROS_AUTOMATIC_DISCOVERY_RANGE", "FAR")],
                Grade::Error,
                "SUBNET, LOCALHOST",
            ),
        ] {
            with(&[], variables, |machine| is(&machine.ros(), grade, words));
        }
    }

    #[test]
    fn what_a_component_in_cpp_needs_is_named() {
        let program = "#!/bin/sh\necho tool 31.3\n";
        let old = "#!/bin/sh\necho 'x++ (Debian 7.5.0-3) 7.5.0'\n";
        let clang = "#!/bin/sh\necho Debian clang version 7.0.1-8\n";
        with(
            &[
                ("bin/cmake", program),
                ("more/c++", program),
                ("old/c++", old),
                ("clang/c++", clang),
            ],
            &[],
            |machine| {
                for path in ["/bin/cmake", "/more/c++", "/old/c++", "/clang/c++"] {
                    let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
                    std::fs::set_permissions(machine.path(path), mode).expect("to set");
                }
                let looks = |folders: &[&str]| {
                    let folders = folders.iter().map(|f| machine.path(f));
                    let path = std::env::join_paths(folders).expect("a path");
                    let variable = |name: &str| match name {
                        "PATH" => Some(path.to_string_lossy().into_owned()),
                        _ => None,
                    };
                    let machine = Machine {
                        root: machine.root.clone(),
                        variable: &variable,
                        user: 0,
                        folder: machine.folder.clone(),
                    };
                    machine.cpp()
                };
                is(&looks(&["/none"]), Grade::Warning, "there is no cmake");
                is(&looks(&["/bin"]), Grade::Warning, "no compiler `c++`");
                is(&looks(&["/bin", "/more"]), Grade::Ok, "tool 31.3 and tool");
                is(&looks(&["/bin", "/old"]), Grade::Warning, "older than 8");
                is(&looks(&["/bin", "/clang"]), Grade::Ok, "7.0.1-8");
            },
        );
    }

    #[test]
    fn a_broken_home_of_python_is_named() {
        let python = "#!/bin/sh\n[ -z \"$PYTHONHOME\" ] || exit 1\n[ \"$1\" = -c ] && case $2 in *numpy*) exit 1;; esac\necho 1\n";
        with(&[("bin/python3", python)], &[], |machine| {
            let program = machine.path("/bin/python3");
            let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
            std::fs::set_permissions(&program, mode).expect("to set");
            let bin = machine.path("/bin").to_string_lossy().into_owned();
            let looks = |home: Option<&str>| {
                let variable = |name: &str| match name {
                    "PATH" => Some(format!("{bin}:/usr/bin:/bin")),
                    "PYTHONHOME" => home.map(str::to_owned),
                    _ => None,
                };
                let machine = Machine {
                    root: machine.root.clone(),
                    variable: &variable,
                    user: 0,
                    folder: machine.folder.clone(),
                };
                machine.python()
            };
            is(&looks(None), Grade::Warning, "has no NumPy");
            is(&looks(Some("/gone")), Grade::Error, "unset PYTHONHOME");
        });
    }

    #[test]
    fn interfaces_and_versions_are_read() {
        let files = [
            ("sys/class/net/eth0/flags", "0x1003\n"),
            ("sys/class/net/lo/flags", "0x9\n"),
            ("sys/class/net/down0/flags", "0x1002\n"),
        ];
        with(&files, &[], |machine| {
            let able = ["eth0", "lo", "down0", "none"].map(|n| machine.is_for_multicast(n));
            assert_eq!(able, [true, false, false, false]);
        });
        for (line, version) in [
            ("cmake version 3.22.1-g37088a8", Some("3.22.1-g37088a8")),
            ("c++ (Debian 12.2.0-14) 12.2.0", Some("12.2.0")),
            ("c++ (GCC) 7.3.1 20180303 (Red Hat 7.3.1-5)", Some("7.3.1")),
            ("c++ (crosstool-NG 1.25.0) 10.2.0", Some("10.2.0")),
            (
                "clang version 15.0.7 (https://github.com/llvm/llvm-project.git 8dfdcc7b)",
                Some("15.0.7"),
            ),
            ("a compiler", None),
        ] {
            assert_eq!(version_in(line), version);
        }
        assert!(is_older("1.94.1", "1.95"));
        assert!(!is_older("1.95.0-nightly", "1.95"));
        assert!(!is_older("2.0.0", "1.95"));
        assert_eq!(
            [bytes(64 << 20), bytes(12_340_000_000)],
            ["67 MB", "12.3 GB"]
        );
    }
}
