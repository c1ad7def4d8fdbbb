//! `rcdeploy install-service`, with programs in the place of those of systemd.

use rc_test_site::site::{CommandOutput, PATROL, Site, rcdeploy};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

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
