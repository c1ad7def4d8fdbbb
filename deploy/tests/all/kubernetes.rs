//! The part of the types of Kubernetes that exports use, as its API reference (v1.32, `apps/v1` and
//! `batch/v1`) defines it. An unknown key is an error, as for `kubectl apply --validate=strict`.
//!
//! The crate of all types would be the largest one that tests compile. With a package registry,
//! `export.rs` also checks the same manifests against the complete schemas.
#![expect(dead_code, reason = "most fields are there to be read")]

use serde::Deserialize;
use std::collections::BTreeMap;

type Words = BTreeMap<String, String>;

#[derive(Deserialize)]
#[serde(tag = "kind")]
pub(crate) enum Manifest {
    Deployment(Object<Apps, Deployment>),
    Job(Object<Batch, Job>),
}

impl Manifest {
    pub(crate) fn pod(&self) -> &Pod {
        match self {
            Self::Deployment(object) => &object.spec.template.spec,
            Self::Job(object) => &object.spec.template.spec,
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct Object<Version, Spec> {
    api_version: Version,
    metadata: Metadata,
    spec: Spec,
}

#[derive(Deserialize)]
pub(crate) enum Apps {
    #[serde(rename = "apps/v1")]
    V1,
}

#[derive(Deserialize)]
pub(crate) enum Batch {
    #[serde(rename = "batch/v1")]
    V1,
}

/// Names are set by the object that owns them, so the template of a Pod has none.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Metadata {
    name: Option<String>,
    #[serde(default)]
    labels: Words,
    #[serde(default)]
    annotations: Words,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct Deployment {
    replicas: Option<u32>,
    strategy: Option<Strategy>,
    selector: LabelSelector,
    template: Template,
}

#[derive(Deserialize)]
#[serde(tag = "type", deny_unknown_fields)]
enum Strategy {
    Recreate,
    RollingUpdate,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct LabelSelector {
    match_labels: Words,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct Job {
    backoff_limit: Option<i32>,
    template: Template,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Template {
    metadata: Metadata,
    spec: Pod,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct Pod {
    affinity: Option<Affinity>,
    #[serde(default)]
    node_selector: Words,
    #[serde(rename = "hostPID", default)]
    host_pid: bool,
    #[serde(default)]
    host_network: bool,
    dns_policy: Option<DnsPolicy>,
    security_context: Option<PodSecurity>,
    termination_grace_period_seconds: Option<u32>,
    #[serde(default)]
    init_containers: Vec<InitContainer>,
    pub(crate) containers: Vec<Container>,
    #[serde(default)]
    volumes: Vec<Volume>,
    pub(crate) restart_policy: Restart,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Affinity {
    pod_affinity: PodAffinity,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct PodAffinity {
    required_during_scheduling_ignored_during_execution: Vec<PodAffinityTerm>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct PodAffinityTerm {
    label_selector: LabelSelector,
    topology_key: String,
}

#[derive(Deserialize)]
enum DnsPolicy {
    ClusterFirstWithHostNet,
    ClusterFirst,
    Default,
    None,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct PodSecurity {
    run_as_user: Option<i64>,
    run_as_group: Option<i64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct InitContainer {
    name: String,
    image: String,
    image_pull_policy: PullPolicy,
    #[serde(default)]
    volume_mounts: Vec<VolumeMount>,
    command: Vec<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct Container {
    name: String,
    image: String,
    image_pull_policy: PullPolicy,
    #[serde(default)]
    volume_mounts: Vec<VolumeMount>,
    command: Vec<String>,
    #[serde(default)]
    args: Vec<String>,
    working_dir: Option<String>,
    #[serde(default)]
    env: Vec<Variable>,
    security_context: Option<ContainerSecurity>,
    startup_probe: Probe,
    pub(crate) readiness_probe: Probe,
    pub(crate) liveness_probe: Option<Probe>,
}

#[derive(Deserialize)]
enum PullPolicy {
    Always,
    IfNotPresent,
    Never,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct VolumeMount {
    name: String,
    mount_path: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Variable {
    name: String,
    value: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ContainerSecurity {
    capabilities: Capabilities,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Capabilities {
    add: Vec<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub(crate) struct Probe {
    pub(crate) exec: Exec,
    period_seconds: u32,
    timeout_seconds: u32,
    failure_threshold: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Exec {
    pub(crate) command: Vec<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
struct Volume {
    name: String,
    host_path: HostPath,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct HostPath {
    path: String,
    #[serde(rename = "type")]
    kind: HostPathType,
}

#[derive(Deserialize)]
enum HostPathType {
    Directory,
    DirectoryOrCreate,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub(crate) enum Restart {
    Always,
    OnFailure,
    Never,
}
