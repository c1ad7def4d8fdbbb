//! Kubernetes manifests: one Pod for each process, so that each has its own policy. All Pods of a
//! machine run on one node and share /dev/shm, which iceoryx2 needs, and which contains the run
//! directory for `--probe`.
//!
//! A component that always restarts is a Deployment; one that may end is a Job, whose Pod is not
//! replaced after success. Order: init containers wait (`--probe --wait`) until the needed
//! components are ready.

use super::yaml::{Map, Yaml, comment, print};
use super::{Export, Machine, Part, Source, dockerfile, seconds};
use rc_codegen::Files;
use rc_codegen::files::Owner;
use rc_deploy_network::plan::Policy;
use std::collections::{BTreeSet, HashMap};
use std::path::PathBuf;

/// The file that describes the image.
const DOCKERFILE: &str = "Dockerfile";
/// How long a Pod waits for a needed component before it tries again, in seconds.
const WAIT: &str = "3600";
/// More restarts than any Job reaches.
const UNLIMITED: u64 = 1_000_000;

pub(super) fn manifests(source: &Source<'_>) -> Export {
    let image = image(source);
    let images: Vec<(PathBuf, dockerfile::Image)> = images(source, &image);
    let mut notes: Vec<String> = images
        .iter()
        .map(|(folder, built)| {
            let folder = folder.display().to_string();
            let folder = if folder.is_empty() { "." } else { &folder };
            format!(
                "the image {image} holds the programs and configurations at the paths of this machine: `{}`; another name: --image",
                built.command.replace("FOLDER", folder)
            )
        })
        .collect();
    notes.extend([
        "all Pods of a machine run on one node, where they share /dev/shm (hostPath) and, for iceoryx2, process numbers (hostPID); a namespace with the pod security standard `privileged` permits it".to_owned(),
        "all Pods run as one user: the shared memory is private to its user".to_owned(),
        "a component that fails for good does not stop the others, and all stop at once, not the dependents first".to_owned(),
        "a component that is not ready in time is ended and follows its restart policy; one that hangs for half a minute, too, unless its policy is `never`: rcdeploy does so after the time that `hung` sets".to_owned(),
        super::RUN_DIRECTORY.to_owned(),
        "limits for stopping are whole seconds".to_owned(),
    ]);
    if source.restarts() {
        notes.push(
            "the pause between restarts is Kubernetes': 10 s, doubled up to five minutes"
                .to_owned(),
        );
    }
    for part in source.parts() {
        let restart = part.component.restart;
        if restart.policy != Policy::Never && restart.limit.is_some() {
            notes.push(format!(
                "the limit of restarts of {} has no window of time in Kubernetes{}",
                part.component.name,
                match restart.policy {
                    Policy::Always => ", and none at all in a Deployment",
                    Policy::Never | Policy::OnFailure => "",
                }
            ));
        }
    }
    if source.parts().any(|part| part.component.priority.is_some()) {
        notes.push("real-time priorities of processes are set by `chrt`, which the image needs, and as root with CAP_SYS_NICE: so all Pods run as root".to_owned());
    }
    if source.parts().any(|part| part.thread_priority.is_some()) {
        notes.push(
            "threads set real-time priorities as root with CAP_SYS_NICE: so all Pods run as root"
                .to_owned(),
        );
    }
    if source.parts().any(|part| !part.component.cpu.is_empty()) {
        notes.push("processors are chosen by `taskset`, which the image needs; the scheduler of Kubernetes knows nothing of it".to_owned());
    }
    for host in source.machines.iter().filter_map(|machine| machine.host) {
        notes.push(format!(
            "the node of {0} needs a label: `kubectl label node NODE robocomp-host={0}`",
            host.name.text
        ));
    }
    notes.extend(source.notes());
    let names = names(source);
    let list: String = notes.iter().map(|note| format!("- {note}\n")).collect();
    let head = format!(
        "{}\nWhat is different from rcdeploy, and what is needed:\n{list}",
        source.head()
    );
    let mut text = comment(&head, 0);
    for machine in &source.machines {
        for part in &machine.parts {
            text.push_str("---\n");
            text.push_str(&print(&manifest(source, machine, part, &names)));
        }
    }
    let mut files = Files::default();
    files.add(format!("{}.yaml", source.network), Owner::Exported, text);
    for (folder, built) in images {
        files.add(folder.join(DOCKERFILE), Owner::Exported, built.text);
        let ignore = format!("{DOCKERFILE}.dockerignore");
        files.add(folder.join(ignore), Owner::Exported, built.ignore);
    }
    Export { files, notes }
}

/// The image of each machine, with the folder of its Dockerfile.
fn images(source: &Source<'_>, name: &str) -> Vec<(PathBuf, dockerfile::Image)> {
    let machines = source.machines.iter();
    let images = machines.filter_map(|machine| {
        let folder = machine.host.map(|host| PathBuf::from(&host.name.text));
        let built = dockerfile::image(source, machine, name, DOCKERFILE, user(source))?;
        Some((folder.unwrap_or_default(), built))
    });
    images.collect()
}

/// The user of all Pods. Real-time priorities need root.
fn user(source: &Source<'_>) -> u64 {
    let mut parts = source.parts();
    let urgent = parts.any(|part| part.highest_priority().is_some());
    if urgent { 0 } else { 1000 }
}

fn image(source: &Source<'_>) -> String {
    source.image.map_or_else(
        || format!("robocomp/{}:latest", source.network.to_lowercase()),
        str::to_owned,
    )
}

/// Unique object names: lower-case letters, digits and `-`, at most 63 characters.
fn names<'s>(source: &'s Source<'_>) -> HashMap<&'s str, String> {
    let mut taken = BTreeSet::new();
    let mut names = HashMap::new();
    for part in source.parts() {
        let plain = plain(&format!("{}-{}", source.network, part.name));
        let mut name = plain.clone();
        let mut number = 2;
        while !taken.insert(name.clone()) {
            let end = format!("-{number}");
            name = format!(
                "{}{end}",
                plain[..plain.len().min(63 - end.len())].trim_end_matches('-')
            );
            number += 1;
        }
        names.insert(part.component.name.as_str(), name);
    }
    names
}

fn plain(text: &str) -> String {
    let small = text.to_lowercase();
    let letters = small
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
    let name: String = letters.take(63).collect();
    let name = name.trim_matches('-');
    // A name begins with a letter.
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name.to_owned()
    } else {
        format!("n{}", &name[..name.len().min(62)])
    }
}

fn manifest(
    source: &Source<'_>,
    machine: &Machine<'_>,
    part: &Part<'_>,
    names: &HashMap<&str, String>,
) -> Map {
    let name = names[part.component.name.as_str()].as_str();
    let host = machine.host.map(|host| plain(&host.name.text));
    let labels = Map::default()
        .with("robocomp-network", plain(source.network))
        .with("robocomp-component", name)
        .with("robocomp-host", host.unwrap_or_else(|| "any".to_owned()));
    let called = Map::default().with("robocomp-component", part.component.name.as_str());
    let meta = Map::default()
        .with("name", name)
        .with("labels", labels.clone())
        .with("annotations", called);
    let policy = part.component.restart.policy;
    let pod = pod(source, machine, part).with(
        "restartPolicy",
        match policy {
            Policy::Always => "Always",
            Policy::OnFailure => "OnFailure",
            Policy::Never => "Never",
        },
    );
    let template = Map::default()
        .with("metadata", Map::default().with("labels", labels))
        .with("spec", pod);
    let (version, kind, spec) = match policy {
        Policy::Always => {
            let of = Map::default().with("robocomp-component", name);
            let spec = Map::default()
                .with("replicas", 1)
                .commented(
                    "Two of one name cannot run at once.",
                    "strategy",
                    Map::default().with("type", "Recreate"),
                )
                .with("selector", Map::default().with("matchLabels", of))
                .with("template", template);
            ("apps/v1", "Deployment", spec)
        }
        Policy::OnFailure | Policy::Never => {
            let limit = match (policy, part.component.restart.limit) {
                (Policy::Never, _) => 0,
                (_, Some((count, _))) => u64::from(count),
                (_, None) => UNLIMITED,
            };
            (
                "batch/v1",
                "Job",
                Map::default()
                    .with("backoffLimit", limit)
                    .with("template", template),
            )
        }
    };
    Map::default()
        .with("apiVersion", version)
        .with("kind", kind)
        .with("metadata", meta)
        .with("spec", spec)
}

/// A Pod without its restart policy.
fn pod(source: &Source<'_>, machine: &Machine<'_>, part: &Part<'_>) -> Map {
    let component = part.component;
    let user = user(source);
    let mut out = Map::default();
    if let Some(host) = machine.host {
        out = out.with(
            "nodeSelector",
            Map::default().with("robocomp-host", plain(&host.name.text)),
        );
    } else {
        let of = Map::default()
            .with("robocomp-network", plain(source.network))
            .with("robocomp-host", "any");
        let term = Map::default()
            .with("labelSelector", Map::default().with("matchLabels", of))
            .with("topologyKey", "kubernetes.io/hostname");
        let affinity =
            Map::default().with("requiredDuringSchedulingIgnoredDuringExecution", vec![term]);
        out = out.commented(
            "Where the first Pod of the network runs, all others do.",
            "affinity",
            Map::default().with("podAffinity", affinity),
        );
    }
    if part.memory {
        out = out.commented(
            "iceoryx2: process numbers that all agree on",
            "hostPID",
            true,
        );
    }
    if part.dds {
        out = out
            .commented(
                "DDS: multicast, and addresses of the machine",
                "hostNetwork",
                true,
            )
            .with("dnsPolicy", "ClusterFirstWithHostNet");
    }
    out = out.with(
        "securityContext",
        Map::default()
            .with("runAsUser", user)
            .with("runAsGroup", user),
    );
    out = out.with("terminationGracePeriodSeconds", seconds(component.stop));
    let needed = part.needs.iter().flat_map(|need| &need.probed);
    let waits = needed.enumerate().map(|(at, need)| {
        let mut command = part.probe_other(source.network, &need.name);
        command.extend(["--wait".to_owned(), WAIT.to_owned()]);
        container(source, &format!("wait-{}", at + 1)).with("command", literals(&command))
    });
    let waits: Vec<Map> = waits.collect();
    if !waits.is_empty() {
        let needs = part.needs.iter().map(|need| need.component.name.as_str());
        let needs: Vec<&str> = needs.collect();
        out = out.commented(
            &format!("after {}", needs.join(", ")),
            "initContainers",
            waits,
        );
    }
    out = out.with("containers", vec![main(source, part)]);
    let shm = Map::default().with("name", "shm").with(
        "hostPath",
        Map::default()
            .with("path", "/dev/shm")
            .with("type", "Directory"),
    );
    out.with("volumes", vec![shm])
}

fn container(source: &Source<'_>, name: &str) -> Map {
    Map::default()
        .with("name", name)
        .with("image", literal(&image(source)))
        .with("imagePullPolicy", "IfNotPresent")
        .with(
            "volumeMounts",
            vec![
                Map::default()
                    .with("name", "shm")
                    .with("mountPath", "/dev/shm"),
            ],
        )
}

fn main(source: &Source<'_>, part: &Part<'_>) -> Map {
    let component = part.component;
    let mut command = Vec::new();
    if !component.cpu.is_empty() {
        let all: Vec<String> = component.cpu.iter().map(u16::to_string).collect();
        command.extend(["taskset".to_owned(), "-c".to_owned(), all.join(",")]);
    }
    if let Some(priority) = component.priority {
        command.extend(["chrt".to_owned(), "-f".to_owned(), priority.to_string()]);
    }
    command.push(component.executable.to_string_lossy().into_owned());
    let env: Vec<Map> = component
        .env
        .iter()
        .map(|(name, value)| {
            Map::default()
                .with("name", name.as_str())
                .with("value", literal(value))
        })
        .collect();
    let probe = |period: u64, failures: u64| {
        // Not escaped: the command of a probe has no variables.
        Map::default()
            .with(
                "exec",
                Map::default().with("command", part.probe(source.network)),
            )
            .with("periodSeconds", period)
            .with("timeoutSeconds", part.probe_limit())
            .with("failureThreshold", failures)
    };
    let mut out = container(source, "component")
        .with("command", literals(&command))
        .with("args", literals(&component.args))
        .with(
            "workingDir",
            component.directory.to_string_lossy().into_owned(),
        );
    if !env.is_empty() {
        out = out.with("env", env);
    }
    if part.highest_priority().is_some() {
        let add = Map::default().with("add", vec!["SYS_NICE"]);
        out = out.with("securityContext", Map::default().with("capabilities", add));
    }
    out = out
        .with("startupProbe", probe(1, seconds(component.ready)))
        .with("readinessProbe", probe(2, 1));
    if component.restart.policy != Policy::Never {
        out = out.with("livenessProbe", probe(10, 3));
    }
    out
}

/// Escapes a text so that Kubernetes replaces no `$(NAME)` in it. It makes one `$` of two.
fn literal(text: &str) -> String {
    text.replace('$', "$$")
}

fn literals(texts: &[String]) -> Yaml {
    texts
        .iter()
        .map(|text| literal(text))
        .collect::<Vec<_>>()
        .into()
}
