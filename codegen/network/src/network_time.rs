//! The time of a network: which component publishes it, who follows, and over which middleware.

use crate::model::{ClockPlan, Network, NetworkTime};
use crate::process_name::process_name;
use rc_cdsl::model::{Middleware, Role};
use rc_ddsl::Endpoint;
use rc_ddsl::model::Instance;
use rc_diagnostics::{Diagnostic, Diagnostics};
use rc_middleware::Reliability;
use rc_middleware::qos::{MAX_READERS, Qos};
use rc_vocabulary::Value;

fn simulates_time(network: &Network, at: usize) -> bool {
    let project = network.projects[at].as_deref();
    project.is_some_and(|project| project.component.simulates_time)
}

/// Whether an instance takes its time from `/clock` of ROS 2.
fn uses_ros_clock(network: &Network, at: usize) -> bool {
    let set = network.deployment.instances[at].setting(Middleware::Ros2, "use_sim_time");
    set.is_some_and(|set| set.value == Value::Bool(true))
        && network.middlewares_of(at).contains(&Middleware::Ros2)
}

/// Finds the source of time and its followers, and reports mistakes.
pub(crate) fn check(network: &Network, found: &mut Diagnostics) -> Option<NetworkTime> {
    warn_of_unused_sources(network, found);
    check_ros_clocks(network, found);
    let (source, span) = network.deployment.time?;
    let instance = &network.deployment.instances[source];
    if let Some(project) = network.projects[source].as_deref()
        && !project.component.simulates_time
    {
        let name = &project.component.name;
        let message = format!("`{}` cannot publish time", instance.path);
        let error = Diagnostic::error("not-a-time-source", span, message)
            .label(name.span, "it has no clause `simulates time`")
            .help(format!(
                "add `simulates time;` to the .cdsl of {}",
                name.text
            ));
        found.push(error);
        return None;
    }
    if let Some(own) = instance.system_time {
        let message = format!(
            "`{}` publishes the network's time, and has the clock of the system",
            instance.path
        );
        let error = Diagnostic::error("two-clocks", own, message)
            .label(span, "the source of time")
            .help("remove one of them");
        found.push(error);
        return None;
    }
    let mut followers = Vec::new();
    for (at, instance) in network.deployment.instances.iter().enumerate() {
        if at == source || instance.system_time.is_some() || network.projects[at].is_none() {
            continue;
        }
        match time_link(network, source, at) {
            Ok(backend) => followers.push((at, backend)),
            Err(why) => {
                let message = format!(
                    "`{}` cannot hear the time of `{}`: {why}",
                    instance.path, network.deployment.instances[source].path
                );
                let error = Diagnostic::error("time-out-of-reach", instance.name.span, message)
                    .label(span, "the source of time")
                    .help(
                        "give both one middleware that connects them, or this one `time system;`",
                    );
                found.push(error);
            }
        }
    }
    if followers.len() > MAX_READERS {
        let message = format!(
            "{} components follow the time of `{}`, but at most {MAX_READERS} can",
            followers.len(),
            network.deployment.instances[source].path
        );
        let error = Diagnostic::error("too-many-followers", span, message);
        found.push(error.help("give some of them `time system;`"));
    }
    note_short_timeouts(network, &followers, found);
    Some(NetworkTime { source, followers })
}

/// Reports calls with a shorter timeout than usual: the clock of the system measures it, so a busy
/// machine decides in lockstep whether one ends by it.
fn note_short_timeouts(
    network: &Network,
    followers: &[(usize, Middleware)],
    found: &mut Diagnostics,
) {
    let usual = Qos::CALL.timeout;
    for (at, _) in followers {
        let Some(project) = network.projects[*at].as_deref() else {
            continue;
        };
        let instance = &network.deployment.instances[*at];
        let slots = project.component.slots.iter();
        for slot in slots.filter(|slot| slot.role == Role::Requires) {
            let timeout = slot.whole_qos().timeout;
            if timeout >= usual {
                continue;
            }
            let message = format!(
                "a call of `{}` to `{}` ends after {timeout:?} of the clock of the system, also in lockstep: then the next run may differ",
                instance.path, slot.name
            );
            let note = Diagnostic::note("timeout-in-lockstep", instance.name.span, message)
                .label(slot.span, "its timeout")
                .help(format!("give it a `timeout` of {usual:?} or more"));
            found.push(note);
        }
    }
}

/// The first middleware of a follower that connects it with its source; else the reason why
/// there is none.
fn time_link(network: &Network, source: usize, at: usize) -> Result<Middleware, String> {
    let instances = &network.deployment.instances;
    let (one, other) = (&instances[source], &instances[at]);
    // `auto` adds what its peer needs.
    let theirs = network.middlewares_of(source);
    let own = network.middlewares_of(at);
    let common: Vec<Middleware> = match (one.auto, other.auto) {
        // Tools hear the time of a process in shared memory.
        (Some(_), Some(_)) => match network.deployment.fastest(one, other) {
            fastest if fastest.can().joins_processes => vec![fastest],
            _ => vec![Middleware::DEFAULT],
        },
        (Some(_), None) => own.clone(),
        (None, Some(_)) => theirs.clone(),
        (None, None) => {
            let own = own.iter().copied();
            own.filter(|backend| theirs.contains(backend)).collect()
        }
    };
    let mut reasons = Vec::new();
    for backend in common {
        let joins = backend.can().joins_machines;
        let apart = !joins && network.deployment.are_apart(one, other);
        if apart {
            reasons.push(format!(
                "they are on different hosts, which {backend} does not connect"
            ));
        } else if domain(one, backend) != domain(other, backend) {
            reasons.push(format!(
                "they are in different domains of {}",
                backend.word()
            ));
        } else {
            return Ok(backend);
        }
    }
    if reasons.is_empty() {
        let words = |all: &[Middleware]| {
            let all: Vec<&str> = all.iter().map(|backend| backend.word()).collect();
            all.join(", ")
        };
        return Err(format!(
            "it uses {}, the source {}",
            words(&own),
            words(&theirs)
        ));
    }
    Err(reasons.join(", and "))
}

fn warn_of_unused_sources(network: &Network, found: &mut Diagnostics) {
    if network.deployment.time.is_some() {
        return;
    }
    for (at, instance) in network.deployment.instances.iter().enumerate() {
        if simulates_time(network, at)
            && instance.system_time.is_none()
            && !uses_ros_clock(network, at)
        {
            let message = format!(
                "`{}` simulates time, but the network has the clock of the system",
                instance.path
            );
            let warning = Diagnostic::warning("unused-time-source", instance.name.span, message);
            found.push(warning.help(format!(
                "write `time simulated by {};` in the deployment, or `time system;` in the component",
                instance.path
            )));
        }
    }
}

/// Reports components that follow `/clock`, and have another clock by the network.
fn check_ros_clocks(network: &Network, found: &mut Diagnostics) {
    let source = network.deployment.time;
    for (at, instance) in network.deployment.instances.iter().enumerate() {
        let other = instance
            .system_time
            .map(|span| (span, "the clock of the system"));
        let other = other.or(source.map(|(_, span)| (span, "the clock of the network")));
        if let Some((span, label)) = other
            && uses_ros_clock(network, at)
            && let Some(set) = instance.setting(Middleware::Ros2, "use_sim_time")
        {
            let message = format!("`{}` has two clocks", instance.path);
            let error = Diagnostic::error("two-clocks", set.span, message)
                .label(span, label)
                .help("remove `use_sim_time`, or the other one");
            found.push(error);
        }
    }
}

/// The clocks of the instances.
pub(crate) fn clocks(network: &Network) -> Vec<ClockPlan> {
    let instances = 0..network.deployment.instances.len();
    instances.map(|at| clock(network, at)).collect()
}

fn clock(network: &Network, at: usize) -> ClockPlan {
    let (kind, followed) = match &network.time {
        _ if network.deployment.instances[at].system_time.is_some() => ("system", None),
        Some(time) if time.source == at => ("source", None),
        Some(time) => {
            let mut followers = time.followers.iter();
            let found = followers.find(|(follower, _)| *follower == at);
            let followed = found.map(|(_, backend)| (time.source, backend.word()));
            ("simulated", followed)
        }
        None if uses_ros_clock(network, at) => ("ros", None),
        None => ("system", None),
    };
    let path = |at: usize| network.deployment.instances[at].path.clone();
    ClockPlan {
        kind,
        source: followed.map(|(source, _)| path(source)),
        middleware: followed.map(|(_, middleware)| middleware),
    }
}

/// The options by which an instance gets its clock, and what it receives in time.
pub(crate) fn options(network: &Network, at: usize) -> Vec<(&'static str, String)> {
    let clock = &network.clocks[at];
    let mut options = clock_options(network, at);
    let reliable = match clock.kind {
        "source" | "simulated" => reliable(network, at),
        _ => Vec::new(),
    };
    if !reliable.is_empty() {
        options.push(("--reliable", reliable.join(",")));
    }
    options
}

/// The subscribers of an instance that have to confirm their samples, so that these arrive in their
/// tick. All their publishers are in the network, and offer it.
fn reliable(network: &Network, at: usize) -> Vec<&str> {
    let instances = &network.deployment.instances;
    let of = |end: Endpoint| {
        let slot = network.slot(end)?;
        let sets = |middleware: &Middleware| instances[end.instance].setting(*middleware, "qos");
        let is_set = network.middlewares(end).iter().any(|m| sets(m).is_some());
        (!is_set).then(|| (slot, slot.whole_qos().reliability))
    };
    let connections = &network.connections;
    let is_reliable = |provider: Endpoint| {
        let is_inside = provider.instance < instances.len();
        is_inside && of(provider).is_some_and(|(_, offered)| offered == Reliability::Reliable)
    };
    let slots = network.ends(at).filter_map(|end| {
        let (slot, requested) = of(end)?;
        let mut middlewares = network.middlewares(end).into_iter();
        let all = connections.connections.iter();
        let mut own = all.filter(|made| made.consumer == end).peekable();
        let is_meant = slot.role == Role::SubscribesTo
            && requested == Reliability::BestEffort
            && middlewares.any(|one| one.can().joins_machines)
            && !connections.externals.contains_key(&end)
            && own.peek().is_some()
            && own.all(|made| is_reliable(made.provider));
        is_meant.then_some(slot.name.as_str())
    });
    slots.collect()
}

fn clock_options(network: &Network, at: usize) -> Vec<(&'static str, String)> {
    let clock = &network.clocks[at];
    match (clock.kind, clock.middleware) {
        ("source", _) => {
            let followers = network.time.iter().flat_map(|time| &time.followers);
            let names = followers
                .map(|(follower, _)| process_name(&network.deployment.instances[*follower].path));
            let names = names.collect::<Vec<_>>().join(",");
            let mut options = vec![("--clock", "source".to_owned())];
            if !names.is_empty() {
                options.push(("--followers", names));
            }
            options
        }
        ("simulated", Some(middleware)) => {
            vec![("--clock", format!("simulated:{middleware}"))]
        }
        // By itself, it would be a source.
        ("system", _) if simulates_time(network, at) => vec![("--clock", "system".to_owned())],
        _ => Vec::new(),
    }
}

/// The domain of an instance, where its middleware has domains.
fn domain(instance: &Instance, backend: Middleware) -> Option<Value> {
    let set = instance
        .setting(backend, "domain")
        .map(|set| set.value.clone());
    set.or_else(|| backend.key("domain")?.default.clone())
}
