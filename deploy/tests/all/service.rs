//! `rcdeploy install-service`, with programs in the place of those of systemd, and with a real
//! manager of a user.

use rc_test_site::site::{CommandOutput, PATROL, Site, rcdeploy};
use rc_test_support::python::skipped;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A program that writes its arguments into a file, and fails if the file `refuse` exists.
fn fake(site: &Site, name: &str) {
    let calls = site.path("calls");
    let refuse = site.path("networks/refuse");
    let text = format!(
        "#!/bin/sh\necho {name} \"$@\" >> {}\n[ ! -e {} ] || {{ echo 'Failed to connect to bus' >&2; exit 1; }}\n",
        calls.display(),
        refuse.display()
    );
    let path = site.write(&format!("bin/{name}"), &text);
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755)).expect("to set");
}

fn install(site: &Site, words: &[&str]) -> CommandOutput {
    let mut command = site.command(&rcdeploy());
    command.args([
        "install-service",
        "--profile",
        "dev",
        "--set",
        "avoider.speed=310",
    ]);
    command.args(words).arg(site.ddsl());
    let path = std::env::var("PATH").unwrap_or_default();
    command.env(
        "PATH",
        format!("{}:{path}", site.path("networks/bin").display()),
    );
    command.env("XDG_CONFIG_HOME", site.path("config"));
    site.run(command)
}

/// The calls of the fake programs since the last look. Whether the user lingers depends on the
/// machine.
fn calls(site: &Site) -> Vec<String> {
    let text = std::fs::read_to_string(site.path("calls")).unwrap_or_default();
    let _ = std::fs::remove_file(site.path("calls"));
    let lines = text.lines().filter(|line| !line.starts_with("loginctl"));
    lines.map(str::to_owned).collect()
}

#[test]
fn a_network_becomes_a_unit_that_is_enabled_started_and_removed() {
    let site = Site::new("service");
    std::fs::create_dir_all(site.path("networks/bin")).expect("a folder");
    ["systemctl", "loginctl"]
        .iter()
        .for_each(|name| fake(&site, name));
    site.write_ddsl(PATROL);
    let own = format!("robocomp-{}.service", site.network);
    let unit = site.path("config/systemd/user").join(&own);
    let shown = install(&site, &["--dry-run"]);
    assert_eq!((shown.code, unit.exists()), (0, false), "{shown:?}");
    // In the folder of the file, its name is enough.
    let mut command = site.command(&rcdeploy());
    command.args(["install-service", "--dry-run", "--profile", "dev"]);
    command.args(["--set", "avoider.speed=310"]);
    command.arg(site.ddsl().file_name().expect("a name"));
    let named = site.run(command);
    assert_eq!(named.stdout, shown.stdout, "{named:?}");
    let installed = install(&site, &[]);
    assert_eq!(installed.code, 0, "{installed:?}");
    let text = std::fs::read_to_string(&unit).expect("a unit");
    assert_eq!(text, shown.stdout);
    // The command of the unit runs the network: another command of it is the check.
    let start = text
        .lines()
        .find_map(|line| line.strip_prefix("ExecStart=:"));
    let start: Vec<&str> = start.expect("a command").split(' ').collect();
    assert_eq!(Path::new(start[0]).file_name(), rcdeploy().file_name());
    let options = [
        "up",
        "--plain",
        "--profile",
        "dev",
        "--set",
        "avoider.speed=310",
        "--",
    ];
    assert_eq!(start[1..8], options);
    assert!(Path::new(start[8]).is_absolute() && Path::new(start[8]).is_file());
    assert_eq!(
        calls(&site),
        [
            "systemctl --user daemon-reload".to_owned(),
            format!("systemctl --user enable {own}"),
            format!("systemctl --user --no-block restart {own}"),
        ]
    );
    let again = install(&site, &["--no-start"]);
    assert_eq!((again.code, calls(&site).len()), (0, 2), "{again:?}");
    site.write("refuse", "");
    let refused = install(&site, &[]);
    assert_eq!(refused.code, 3, "{refused:?}");
    assert!(
        refused
            .stderr
            .contains("Failed to connect to bus; a login by `su`"),
        "{refused:?}"
    );
    std::fs::remove_file(site.path("networks/refuse")).expect("it was there");
    calls(&site);
    let removed = install(&site, &["--remove"]);
    assert_eq!((removed.code, unit.exists()), (0, false), "{removed:?}");
    assert_eq!(
        calls(&site)[0],
        format!("systemctl --user disable --now {own}")
    );
    // A unit of the system runs as the owner of the file, whoever made a link to it. Only root gives
    // files away.
    let link = site.path("networks/link.ddsl");
    std::os::unix::fs::symlink(site.ddsl(), &link).expect("a link");
    if std::os::unix::fs::chown(site.ddsl(), Some(4_000_000), None).is_ok() {
        let mut command = site.command(&rcdeploy());
        command.args(["install-service", "--system", "--dry-run", "--profile"]);
        command.arg("dev").arg(link);
        let shown = site.run(command);
        assert!(shown.stdout.contains("\nUser=4000000\n"), "{shown:?}");
    }
    // A name with a line feed would be a line of the unit.
    let odd = site.path("odd\nExecStartPre=touch x");
    std::os::unix::fs::symlink(site.path("networks"), &odd).expect("a link");
    let file = odd.join(site.ddsl().file_name().expect("a file"));
    let mut command = site.command(&rcdeploy());
    command.args(["install-service", "--dry-run", "--profile", "dev"]);
    command.arg(file);
    let refused = site.run(command);
    assert_eq!(refused.code, 2, "{refused:?}");
    assert!(
        refused.stderr.contains("without control characters"),
        "{refused:?}"
    );
    // What the user wrote stays.
    std::fs::write(&unit, "[Unit]\n").expect("a unit");
    let foreign = [install(&site, &[]), install(&site, &["--remove"])];
    assert!(foreign.iter().all(|ran| ran.code == 2), "{foreign:?}");
    assert_eq!(std::fs::read_to_string(&unit).expect("a unit"), "[Unit]\n");
}

/// systemd as the manager of a user, with processes and mounts of its own: what it leaves ends with it.
/// When it ends, it begins again, as at the next boot.
struct Systemd(Child);

impl Systemd {
    /// Where Debian has it.
    const PROGRAM: &str = "/lib/systemd/systemd";
    /// How long it may take to run, once it is there.
    const LIMIT: Duration = Duration::from_mins(1);

    /// The error says why this machine cannot.
    fn start(site: &Site) -> Result<Self, String> {
        if !Path::new(Self::PROGRAM).exists() {
            return Err("there is no systemd".to_owned());
        }
        let unshare = ["--mount", "--pid", "--fork", "--kill-child", "--mount-proc"];
        let probe = Command::new("unshare").args(unshare).arg("true").output();
        if !probe.is_ok_and(|output| output.status.success()) {
            return Err("no test may make namespaces".to_owned());
        }
        let script = format!(
            "mount -t tmpfs none /run && mkdir -p /run/systemd/system && echo up > {}; while :; do {} --user; echo ended >> {}; done",
            site.path("manager").display(),
            Self::PROGRAM,
            site.path("ended").display()
        );
        let mut command = Command::new("unshare");
        command.args(unshare).args(["sh", "-c", &script]);
        site.place(&mut command);
        command
            .env("XDG_CONFIG_HOME", site.path("config"))
            .env_remove("DBUS_SESSION_BUS_ADDRESS")
            .stdout(Stdio::null())
            .stderr(std::fs::File::create(site.path("systemd.log")).expect("a log"));
        let systemd = Self(command.spawn().map_err(|error| error.to_string())?);
        Site::until("the namespaces", || site.path("manager").exists());
        Ok(systemd)
    }

    /// Waits until it runs. The error says why it does not on this machine: it ends, as without control
    /// groups, or never has all of its own units.
    fn await_first(site: &Site, runs: impl Fn() -> bool) -> Result<(), String> {
        let begun = Instant::now();
        while !runs() {
            let why = if site.path("ended").exists() {
                "`systemd --user` ends at once"
            } else if begun.elapsed() > Self::LIMIT {
                "`systemd --user` starts and does not run"
            } else {
                std::thread::sleep(Duration::from_millis(10));
                continue;
            };
            let log = std::fs::read_to_string(site.path("systemd.log")).unwrap_or_default();
            let last = log.lines().rfind(|line| !line.trim().is_empty());
            return Err(format!("{why}: {}", last.unwrap_or("it says nothing")));
        }
        Ok(())
    }

    /// The words that run a program beside the manager.
    fn beside(&self) -> Vec<String> {
        let id = self.0.id();
        let children = format!("/proc/{id}/task/{id}/children");
        let inside = std::fs::read_to_string(children).expect("it has a child");
        let target = inside.split_whitespace().next().expect("it has a child");
        let words = ["nsenter", "--mount", "--pid", "--target", target];
        words.map(str::to_owned).to_vec()
    }
}

impl Drop for Systemd {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn systemd_starts_the_network_at_each_boot_and_again_after_a_failure() {
    let test = "systemd_starts_the_network_at_each_boot_and_again_after_a_failure";
    let mut site = Site::new("systemd");
    site.write_ddsl(PATROL);
    for name in ["simulator", "avoider", "pose_monitor"] {
        Site::executable(name);
    }
    std::fs::create_dir_all(site.path("run")).expect("a folder");
    std::fs::set_permissions(site.path("run"), PermissionsExt::from_mode(0o700)).expect("set");
    let systemd = match Systemd::start(&site) {
        Ok(systemd) => systemd,
        Err(reason) => return skipped(test, &reason),
    };
    site.within = systemd.beside();
    let systemctl = |words: &[&str]| {
        let mut command = site.command(Path::new("systemctl"));
        command.arg("--user").args(words);
        command.env("XDG_CONFIG_HOME", site.path("config"));
        site.run(command)
    };
    let runs = || systemctl(&["is-system-running"]).stdout == "running\n";
    if let Err(reason) = Systemd::await_first(&site, runs) {
        return skipped(test, &reason);
    }
    let unit = format!("robocomp-{}.service", site.network);
    // The pause of five seconds is not part of the test.
    let drop_in = site.path(&format!("config/systemd/user/{unit}.d"));
    std::fs::create_dir_all(&drop_in).expect("a folder");
    std::fs::write(drop_in.join("soon.conf"), "[Service]\nRestartSec=100ms\n").expect("written");

    let installed = install(&site, &[]);
    assert_eq!(installed.code, 0, "{installed:?}");
    let is_up = || {
        let ran = site.rcdeploy(&["status", "--format", "json", &site.network], false);
        let status: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap_or_default();
        let all = status["components"].as_array().cloned().unwrap_or_default();
        let is_well = all.len() == 3 && all.iter().all(|one| one["state"] == "running");
        status["pid"].as_i64().filter(|_| is_well)
    };
    let supervisor = || {
        let mut found = None;
        Site::until("the network is up", || {
            found = is_up();
            found.is_some()
        });
        found.expect("it was found")
    };
    let first = supervisor();
    let active = systemctl(&["is-active", &unit]);
    assert_eq!(active.stdout, "active\n", "{active:?}");
    let shown = systemctl(&["show", "--property", "MainPID", &unit]);
    assert_eq!(shown.stdout, format!("MainPID={first}\n"), "{shown:?}");

    // The supervisor is killed.
    let mut kill = site.command(Path::new("kill"));
    kill.args(["-9", &first.to_string()]);
    assert_eq!(site.run(kill).code, 0);
    let second = supervisor();
    assert_ne!(first, second);

    // The machine boots again: nobody starts the network.
    systemctl(&["exit"]);
    Site::until("the end of the network", || is_up() != Some(second));
    Site::until("the manager runs", runs);
    supervisor();

    let removed = install(&site, &["--remove"]);
    assert_eq!(removed.code, 0, "{removed:?}");
    let listed = systemctl(&["is-active", &unit]);
    assert_eq!(listed.stdout, "inactive\n", "{listed:?}");
    drop(systemd);
    site.within = Vec::new();
    site.assert_nothing_left();
}
