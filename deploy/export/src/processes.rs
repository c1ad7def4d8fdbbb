//! The processes of a network: a component of its own, or several that share one.

use rc_deploy_network::plan::{Component, Plan};
use rc_deploy_network::process_name;
use std::collections::{BTreeSet, HashMap};

/// A process, as an orchestrator starts it.
pub(crate) struct Process {
    /// The component. For several components, the properties of the process: its name, the command
    /// line of all its threads, the longest limits.
    pub(crate) component: Component,
    /// The places of its components in the plan.
    pub(crate) members: Vec<usize>,
    /// The components, by which the process is probed.
    pub(crate) probed: Vec<Probed>,
    /// The highest priority that a thread sets for itself.
    pub(crate) thread_priority: Option<u8>,
    /// The places of the processes that must be ready first.
    pub(crate) needs: BTreeSet<usize>,
}

/// A component that is probed.
pub(crate) struct Probed {
    /// `arm-left-motor`.
    pub(crate) name: String,
    /// The name by which the program of a process of several components knows it.
    pub(crate) word: Option<String>,
}

/// The processes in the order of their first components.
pub(crate) fn all(plan: &Plan) -> Vec<Process> {
    let mut processes: Vec<Vec<usize>> = Vec::new();
    let mut places: HashMap<&str, usize> = HashMap::new();
    let mut process_of = Vec::new();
    for (at, component) in plan.components.iter().enumerate() {
        let place = *places.entry(component.process()).or_insert_with(|| {
            processes.push(Vec::new());
            processes.len() - 1
        });
        processes[place].push(at);
        process_of.push(place);
    }
    let needs = plan.needs();
    let processes = processes.into_iter().enumerate();
    let processes = processes.map(|(place, members)| {
        let needed = members.iter().flat_map(|at| &needs[*at]);
        let needed = needed.map(|need| process_of[*need]);
        let threads = || members.iter().map(|at| &plan.components[*at]);
        let probed = threads().map(|component| Probed {
            name: process_name(&component.name),
            word: component.thread.as_ref().map(|one| one.component.clone()),
        });
        let of_threads = threads().filter(|component| component.thread.is_some());
        Process {
            needs: needed.filter(|need| *need != place).collect(),
            probed: probed.collect(),
            thread_priority: of_threads.filter_map(|one| one.priority).max(),
            component: whole(plan, &members, &needs),
            members,
        }
    });
    processes.collect()
}

/// A process as one component. Its threads set their processors and priorities themselves.
fn whole(plan: &Plan, members: &[usize], needs: &[BTreeSet<usize>]) -> Component {
    let first = &plan.components[members[0]];
    let mut whole = first.clone();
    let Some(thread) = &first.thread else {
        return whole;
    };
    whole.name.clone_from(&thread.process);
    whole.args.clear();
    (whole.cpu, whole.priority) = (Vec::new(), None);
    for at in members {
        let component = &plan.components[*at];
        let word = component.thread.as_ref().map_or("", |one| &one.component);
        let after = members.iter().filter(|other| needs[*at].contains(other));
        let after = after.map(|other| process_name(&plan.components[*other].name));
        let after: Vec<String> = after.collect();
        whole.args.extend(component.thread_arguments(word, &after));
        whole.env.extend(component.env.clone());
        whole.ready = whole.ready.max(component.ready);
        whole.stop = whole.stop.max(component.stop);
        whole.exact |= component.exact;
    }
    whole
}
