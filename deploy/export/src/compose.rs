//! A file for `docker compose` for each machine. Programs, the folder of the network and the
//! folders of configurations are mounted from the machine: no image has to be built.
//!
//! `ipc: host` and `pid: host`, because iceoryx2 asks the kernel which process has locked a file,
//! and all components must see the same pids. `network_mode: host`, because DDS finds peers by
//! multicast and uses addresses of the machine.

use super::yaml::{Map, Yaml, comment, print};
use super::{Export, Machine, Part, Source, seconds, time};
use rc_codegen::Files;
use rc_codegen::files::Owner;
use rc_deploy_network::plan::{Component, Policy};
use rc_deploy_network::process_name;
use std::collections::BTreeSet;
use std::path::Path;

/// This image has the C library of the programs, `chrt` and `taskset`.
const IMAGE: &str = "debian:stable-slim";

pub(super) fn files(source: &Source<'_>) -> Export {
    let (user, group) = source.user;
    let mut notes = vec![
        "the C library of the image must not be older than that of the machine that built the programs; another image: ROBOCOMP_IMAGE".to_owned(),
        format!("all containers run as one user, {user}:{group} (who exported it) unless ROBOCOMP_USER says otherwise: the shared memory is private to its user"),
        "a component that fails for good, or is not ready in time, does not stop the others (those that need it do not start); `docker compose up --abort-on-container-failure` stops all when one fails".to_owned(),
        super::RUN_DIRECTORY.to_owned(),
    ];
    if source.restarts() {
        notes.push("the pause between restarts is Docker's: 100 ms, doubled up to a minute, set back by a run of ten seconds".to_owned());
    }
    for part in source.parts() {
        let restart = part.component.restart;
        if restart.policy != Policy::Never && restart.limit.is_some() {
            notes.push(format!(
                "the limit of restarts of {} has no window of time in Compose{}",
                part.component.name,
                match restart.policy {
                    Policy::Always => ", and none at all with `always`",
                    Policy::Never | Policy::OnFailure => "",
                }
            ));
        }
    }
    if source.parts().any(|part| part.component.priority.is_some()) {
        notes.push("real-time priorities of processes are set by `chrt`, which the image needs, within the limit `rtprio`".to_owned());
    }
    if source.parts().any(|part| part.thread_priority.is_some()) {
        notes.push("threads set real-time priorities within the limit `rtprio`".to_owned());
    }
    if source
        .parts()
        .any(|part| part.component.restart.hung.is_some())
    {
        notes.push("a component that hangs runs on: `hung` is a limit of rcdeploy".to_owned());
    }
    notes.extend(source.notes());
    let mut files = Files::default();
    for machine in &source.machines {
        let name = machine.host.map_or_else(
            || "compose.yaml".to_owned(),
            |host| format!("compose.{}.yaml", host.name.text),
        );
        files.add(name, Owner::Exported, file(source, machine, &notes));
    }
    Export { files, notes }
}

fn file(source: &Source<'_>, machine: &Machine<'_>, notes: &[String]) -> String {
    let mut services = Map::default();
    for part in &machine.parts {
        services = services.with(&part.name, service(source, part));
    }
    let all = Map::default()
        .with("name", source.network.to_lowercase())
        .with("services", services);
    let notes: String = notes.iter().map(|note| format!("- {note}\n")).collect();
    let notes = format!(
        "{}\nWhat is different from rcdeploy, and what is needed:\n{notes}",
        source.head()
    );
    format!("{}\n{}", comment(&notes, 0), print(&all))
}

fn service(source: &Source<'_>, part: &Part<'_>) -> Map {
    let component = part.component;
    let image = source.image.unwrap_or(IMAGE);
    let (user, group) = source.user;
    let mut entrypoint = vec![component.executable.to_string_lossy().into_owned()];
    if let Some(priority) = component.priority {
        entrypoint.splice(
            ..0,
            ["chrt".to_owned(), "-f".to_owned(), priority.to_string()],
        );
    }
    let mut out = Map::default()
        .with(
            "image",
            Yaml::Text(format!("${{ROBOCOMP_IMAGE:-{}}}", literal(image))),
        )
        .with("entrypoint", literals(&entrypoint))
        .with("command", literals(&component.args))
        .with(
            "working_dir",
            literal(&component.directory.to_string_lossy()),
        )
        .with("user", format!("${{ROBOCOMP_USER:-{user}:{group}}}"));
    if !component.env.is_empty() {
        let all = component
            .env
            .iter()
            .fold(Map::default(), |all, (name, value)| {
                all.with(name, literal(value))
            });
        out = out.with("environment", all);
    }
    let volumes: Vec<Map> = mounts(component)
        .into_iter()
        .map(|(path, writes)| {
            let path = literal(&path);
            Map::default()
                .with("type", "bind")
                .with("source", path.clone())
                .with("target", path)
                .with("read_only", !writes)
        })
        .collect();
    out = out.with("volumes", volumes);
    // It contains the run directory, where the probe connects.
    out = out.commented(
        if part.memory {
            "iceoryx2: one /dev/shm, and process numbers that all agree on"
        } else {
            "the run directory is in /dev/shm"
        },
        "ipc",
        "host",
    );
    if part.memory {
        out = out.with("pid", "host");
    }
    out = out.commented(
        if part.dds {
            "DDS: multicast, and addresses of the machine"
        } else {
            ""
        },
        "network_mode",
        "host",
    );
    if !part.needs.is_empty() {
        let all = part.needs.iter().fold(Map::default(), |all, need| {
            all.with(
                &process_name(&need.component.name),
                Map::default().with("condition", "service_healthy"),
            )
        });
        out = out.with("depends_on", all);
    }
    let test: Vec<String> = ["CMD".to_owned()]
        .into_iter()
        .chain(part.probe(source.network))
        .collect();
    // Once a second. Failures during `start_period` do not count.
    let health = Map::default()
        .with("test", literals(&test))
        .with("interval", "1s")
        .with("timeout", format!("{}s", part.probe_limit()))
        .with("retries", 3)
        .with("start_period", time(component.ready));
    out = out.with("healthcheck", health);
    let restart = match (component.restart.policy, component.restart.limit) {
        (Policy::Never, _) => "no".to_owned(),
        (Policy::Always, _) => "always".to_owned(),
        (Policy::OnFailure, Some((count, _))) => format!("on-failure:{count}"),
        (Policy::OnFailure, None) => "on-failure".to_owned(),
    };
    out = out
        .with("restart", restart)
        .with("stop_grace_period", format!("{}s", seconds(component.stop)));
    if !component.cpu.is_empty() {
        let all: Vec<String> = component.cpu.iter().map(u16::to_string).collect();
        out = out.with("cpuset", all.join(","));
    }
    if let Some(priority) = part.highest_priority() {
        out = out.with(
            "ulimits",
            Map::default().with("rtprio", u64::from(priority)),
        );
    }
    out
}

/// The paths that a component needs of the machine, and whether it writes there: `params save`
/// replaces the configuration.
fn mounts(component: &Component) -> Vec<(String, bool)> {
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let mut writes = BTreeSet::from([text(&component.directory)]);
    let mut args = component.args.iter();
    while let Some(arg) = args.next() {
        if arg == "--config"
            && let Some(folder) = args.next().and_then(|file| Path::new(file).parent())
        {
            writes.insert(text(folder));
        }
    }
    let program = text(&component.executable);
    [(program, false)]
        .into_iter()
        .chain(writes.into_iter().map(|path| (path, true)))
        .collect()
}

/// Escapes a text so that Compose replaces nothing in it.
fn literal(text: &str) -> String {
    text.replace('$', "$$")
}

fn literals(texts: &[String]) -> Vec<String> {
    texts.iter().map(|text| literal(text)).collect()
}
