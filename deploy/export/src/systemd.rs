//! systemd units: a service for each process, a target for each group and for the network.
//!
//! - `After=` and `Wants=`: a component starts when those that it needs have reported that they are
//!   ready (`Type=notify`). Not `Requires=`, with which a restart of one would restart all that
//!   need it.
//! - A unit that has failed for good starts `NETWORK.failed.target`, which the network's target
//!   conflicts with, and all are part of that: they stop, the dependents first.

use super::{Export, Machine, Part, Source, Supervised, time};
use rc_codegen::Files;
use rc_codegen::files::Owner;
use rc_deploy_network::plan::{Policy, Restart};
use rc_deploy_network::process_name;
use std::collections::BTreeMap;
use std::path::PathBuf;

pub(super) fn units(source: &Source<'_>) -> Export {
    let mut notes = vec![
        "the units are for `systemctl --user`; for the manager of the system, add the same `User=` to all of them".to_owned(),
    ];
    if source.restarts() {
        notes.push("a component whose first start fails is started again as its policy says; rcdeploy would stop the network at once".to_owned());
        notes.push("the pause between restarts grows from systemd 254 on, and is not set back by a run of ten seconds".to_owned());
    }
    if source
        .parts()
        .any(|part| part.component.restart.limit.is_some())
    {
        notes.push("the limit of starts counts the first start as well, which is why it is one more than in the network".to_owned());
    }
    if source.parts().any(|part| part.highest_priority().is_some()) {
        notes.push("real-time priorities of user units need `LimitRTPRIO=` of user@.service, or the user's `rtprio` in /etc/security/limits.conf".to_owned());
    }
    notes.push(
        "the network's target stays active when all its components have ended well".to_owned(),
    );
    if source
        .parts()
        .any(|part| part.component.restart.hung.is_some())
    {
        notes.push("a component that hangs runs on: `hung` is a limit of rcdeploy".to_owned());
    }
    notes.extend(source.notes());
    let mut files = Files::default();
    for machine in &source.machines {
        let folder = machine
            .host
            .map_or_else(PathBuf::new, |host| PathBuf::from(&host.name.text));
        let mut add =
            |name: String, text: String| files.add(folder.join(name), Owner::Exported, text);
        for (name, text) in targets(source, machine, &notes) {
            add(name, text);
        }
        for part in &machine.parts {
            add(
                unit(source.network, &part.name, "service"),
                service(source, part),
            );
        }
    }
    Export { files, notes }
}

/// The unit of a supervisor, which runs a whole network as `rcdeploy up` does.
pub(super) fn supervisor(service: &Supervised<'_>) -> Export {
    let network = service.network;
    let own = supervisor_unit(network);
    let mut out = format!(
        "{} for the network {network} from {}.\n# The log: `journalctl {}-u {own}`.\n\n[Unit]\nDescription=The network {network}\n",
        super::INSTALLED,
        service.file,
        if service.user.is_some() {
            ""
        } else {
            "--user "
        },
    );
    let mut line = |key: &str, value: String| out.push_str(&format!("{key}={value}\n"));
    // The units of an export run the same components.
    line("Conflicts", network_target(network));
    if service.user.is_some() {
        line("Wants", "network-online.target".to_owned());
        line("After", "network-online.target".to_owned());
    }
    // Other machines of the network may be on later.
    line("StartLimitIntervalSec", "0".to_owned());
    out.push_str("\n[Service]\nType=exec\n");
    let words: Vec<String> = service.command.iter().map(|one| word(one)).collect();
    let mut line = |key: &str, value: String| out.push_str(&format!("{key}={value}\n"));
    line("ExecStart", format!(":{}", words.join(" ")));
    let directory = service.directory.to_string_lossy();
    line("WorkingDirectory", directory.replace('%', "%%"));
    if let Some(user) = service.user {
        line("User", user.replace('%', "%%"));
    }
    // SIGTERM goes to the supervisor, which stops the components in order.
    line("KillMode", "mixed".to_owned());
    line("TimeoutStopSec", time(service.stop));
    line("Restart", "on-failure".to_owned());
    line("RestartSec", "5s".to_owned());
    // Files that are wrong stay wrong.
    line("RestartPreventExitStatus", "1 2".to_owned());
    if let Some(priority) = service.priority {
        line("LimitRTPRIO", priority.to_string());
    }
    let target = match service.user {
        Some(_) => "multi-user.target",
        None => "default.target",
    };
    out.push_str(&format!("\n[Install]\nWantedBy={target}\n"));
    let mut files = Files::default();
    files.add(own, Owner::Exported, out);
    Export {
        files,
        notes: Vec::new(),
    }
}

/// The name of the unit of a supervisor.
pub(super) fn supervisor_unit(network: &str) -> String {
    format!("robocomp-{network}.service")
}

fn unit(network: &str, name: &str, kind: &str) -> String {
    format!("robocomp-{network}-{name}.{kind}")
}

fn network_target(network: &str) -> String {
    format!("robocomp-{network}.target")
}

/// The target that directly contains a component or a group.
fn target_of(network: &str, groups: &[String]) -> String {
    groups.last().map_or_else(
        || network_target(network),
        |group| unit(network, group, "target"),
    )
}

fn targets(source: &Source<'_>, machine: &Machine<'_>, notes: &[String]) -> Vec<(String, String)> {
    let network = source.network;
    // Each target with its direct contents and its parent.
    let mut inside: BTreeMap<String, (Vec<String>, Option<String>)> = BTreeMap::new();
    for part in &machine.parts {
        let mut child = unit(network, &part.name, "service");
        for depth in (0..=part.groups.len()).rev() {
            let target = target_of(network, &part.groups[..depth]);
            let above = depth
                .checked_sub(1)
                .map(|up| target_of(network, &part.groups[..up]));
            let (members, _) = inside.entry(target.clone()).or_insert((Vec::new(), above));
            if !members.contains(&child) {
                members.push(child);
            }
            child = target;
        }
    }
    let failed = format!("robocomp-{network}.failed.target");
    let own = network_target(network);
    let mut out = Vec::new();
    for (target, (members, above)) in inside {
        let mut text = format!("# {}\n", source.head());
        if target == own {
            let notes = notes.iter().map(|note| format!("# - {note}\n"));
            text.push_str(&format!(
                "# Start: `systemctl --user start {own}`; it is active when all components are ready. What is different from rcdeploy:\n{}",
                notes.collect::<String>()
            ));
        }
        let what = match &above {
            Some(_) => format!("A group of the network {network}"),
            None => format!("The network {network}"),
        };
        text.push_str(&format!("\n[Unit]\nDescription={what}\n"));
        if let Some(above) = &above {
            text.push_str(&format!("PartOf={above}\n"));
        }
        for word in ["Wants", "After"] {
            for member in &members {
                text.push_str(&format!("{word}={member}\n"));
            }
        }
        if above.is_none() {
            text.push_str("\n[Install]\nWantedBy=default.target\n");
        }
        out.push((target, text));
    }
    let text = format!(
        "# {}\n# A component has failed for good: what this conflicts with is stopped, as rcdeploy does.\n\n[Unit]\nDescription=The network {network} has failed\nConflicts={own}\nAfter={own}\n",
        source.head()
    );
    out.push((failed, text));
    out
}

fn service(source: &Source<'_>, part: &Part<'_>) -> String {
    let (network, component) = (source.network, part.component);
    let mut out = format!("# {}\n\n[Unit]\n", source.head());
    let mut line = |key: &str, value: String| out.push_str(&format!("{key}={value}\n"));
    line(
        "Description",
        format!("{} of the network {network}", component.name),
    );
    line("PartOf", target_of(network, &part.groups));
    for word in ["Wants", "After"] {
        for need in &part.needs {
            line(
                word,
                unit(network, &process_name(&need.component.name), "service"),
            );
        }
    }
    line("OnFailure", format!("robocomp-{network}.failed.target"));
    match component.restart {
        Restart {
            policy: Policy::Never,
            ..
        } => {}
        Restart {
            limit: Some((count, within)),
            ..
        } => {
            line("StartLimitIntervalSec", time(within));
            line("StartLimitBurst", (count + 1).to_string());
        }
        Restart { limit: None, .. } => line("StartLimitIntervalSec", "0".to_owned()),
    }
    out.push_str("\n[Service]\nType=notify\nNotifyAccess=main\n");
    // The prefix `:` disables the expansion of `$`.
    let program = word(&component.executable.to_string_lossy());
    out.push_str(&format!("ExecStart=:{program}"));
    let mut args = component.args.iter().peekable();
    while let Some(arg) = args.next() {
        out.push_str(&format!(" \\\n    {}", word(arg)));
        // The value of an option of rcdeploy follows it.
        if arg.starts_with("--")
            && let Some(value) = args.next_if(|next| !next.starts_with('-'))
        {
            out.push_str(&format!(" {}", word(value)));
        }
    }
    out.push('\n');
    let mut line = |key: &str, value: String| out.push_str(&format!("{key}={value}\n"));
    line(
        "WorkingDirectory",
        component.directory.to_string_lossy().replace('%', "%%"),
    );
    for (name, value) in &component.env {
        line("Environment", quoted(&format!("{name}={value}")));
    }
    line("TimeoutStartSec", time(component.ready));
    line("TimeoutStopSec", time(component.stop));
    // SIGTERM goes to the component only, SIGKILL also to the processes that it leaves.
    line("KillMode", "mixed".to_owned());
    restart(component.restart, &mut line);
    if !component.cpu.is_empty() {
        let all: Vec<String> = component.cpu.iter().map(u16::to_string).collect();
        line("CPUAffinity", all.join(" "));
    }
    if let Some(priority) = component.priority {
        line("CPUSchedulingPolicy", "fifo".to_owned());
        line("CPUSchedulingPriority", priority.to_string());
    }
    if let Some(priority) = part.thread_priority {
        line("LimitRTPRIO", priority.to_string());
    }
    out
}

fn restart(restart: Restart, line: &mut impl FnMut(&str, String)) {
    let word = match restart.policy {
        Policy::Never => return line("Restart", "no".to_owned()),
        Policy::OnFailure => "on-failure",
        Policy::Always => "always",
    };
    line("Restart", word.to_owned());
    if restart.policy == Policy::OnFailure {
        // systemd counts these as success, but rcdeploy as failures unless a command has stopped
        // the component.
        line(
            "RestartForceExitStatus",
            "SIGHUP SIGINT SIGTERM SIGPIPE".to_owned(),
        );
    }
    line("RestartSec", time(restart.backoff));
    if restart.backoff < Restart::LONGEST_PAUSE && !restart.backoff.is_zero() {
        // The number of doublings up to the longest pause.
        let ratio = Restart::LONGEST_PAUSE.as_secs_f64() / restart.backoff.as_secs_f64();
        line("RestartSteps", (ratio.log2().ceil() as u32).to_string());
        line("RestartMaxDelaySec", time(Restart::LONGEST_PAUSE));
    }
}

/// One word of a command line, quoted if necessary.
fn word(text: &str) -> String {
    let fine = |c: char| c.is_ascii_alphanumeric() || "_@+=:,./-".contains(c);
    if !text.is_empty() && text.chars().all(fine) {
        return text.to_owned();
    }
    quoted(text)
}

fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            '%' => out.push_str("%%"),
            '\n' => out.push_str("\\n"),
            c if c.is_ascii_control() => out.push_str(&format!("\\x{:02x}", c as u32)),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::{Supervised, quoted, supervisor, word};
    use std::path::Path;
    use std::time::Duration;

    #[test]
    fn a_supervisor_is_one_unit_of_the_user_or_of_the_system() {
        let mut service = Supervised {
            network: "patrol",
            file: "patrol.ddsl",
            command: &[
                "/opt/my tools/rcdeploy",
                "up",
                "--plain",
                "/robot/patrol.ddsl",
            ]
            .map(str::to_owned),
            directory: Path::new("/robot"),
            user: None,
            stop: Duration::from_millis(13_500),
            priority: None,
        };
        let unit = |service: &Supervised<'_>| {
            let export = supervisor(service);
            let mut files = export.files.iter();
            let (path, _, text) = files.next().expect("a unit");
            assert_eq!(path, Path::new("robocomp-patrol.service"));
            text.to_owned()
        };
        expect_test::expect![[r#"
            # Made by `rcdeploy install-service` for the network patrol from patrol.ddsl.
            # The log: `journalctl --user -u robocomp-patrol.service`.

            [Unit]
            Description=The network patrol
            Conflicts=robocomp-patrol.target
            StartLimitIntervalSec=0

            [Service]
            Type=exec
            ExecStart=:"/opt/my tools/rcdeploy" up --plain /robot/patrol.ddsl
            WorkingDirectory=/robot
            KillMode=mixed
            TimeoutStopSec=13500ms
            Restart=on-failure
            RestartSec=5s
            RestartPreventExitStatus=1 2

            [Install]
            WantedBy=default.target
        "#]]
        .assert_eq(&unit(&service));
        service.user = Some(r"CORP\mia%1");
        service.priority = Some(20);
        let system = unit(&service);
        for line in [
            "# The log: `journalctl -u robocomp-patrol.service`.",
            "After=network-online.target",
            r"User=CORP\mia%%1",
            "LimitRTPRIO=20",
            "WantedBy=multi-user.target",
        ] {
            assert!(
                system.lines().any(|known| known == line),
                "{line}: {system}"
            );
        }
    }

    #[test]
    fn special_words_of_systemd_are_quoted() {
        assert_eq!(word("a/b=c"), "a/b=c");
        assert_eq!(word(""), "\"\"");
        assert_eq!(word(";"), "\";\"");
        assert_eq!(word("a b"), "\"a b\"");
        assert_eq!(quoted("100% \"\\\t"), r#""100%% \"\\\x09""#);
    }
}
